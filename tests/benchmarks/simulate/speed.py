"""CPU time of the simulator: 8000 samples, a million samples, and how it grows.

python tests/benchmarks/simulate/speed.py [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from softsense.simulate import finger_rig, linear_rig, random_motion, run, simulate
from softsense.simulate.calibrate import calibrate
from softsense.simulate.characterise import characterise

DT_S = 0.05


def best_s(samples: int, rig, repeats: int) -> float:
    """Least CPU time of ``repeats`` runs, motion not included."""
    strain = random_motion(samples, DT_S, 0)
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run(rig, strain, 0)
        times.append(time.process_time() - start)
    return min(times)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the rows here")
    args = parser.parse_args()
    rigs = {"linear": linear_rig(0), "finger": finger_rig(0)}
    rows = {}
    for name, rig in rigs.items():
        best_s(200, rig, 1)  # compiles or loads the loops
        for samples, repeats in ((8_000, 10), (100_000, 3), (1_000_000, 1)):
            rows[f"{name}, {samples} samples x 7 sensors"] = best_s(samples, rig, repeats)
    recording = simulate(rigs["linear"])
    start = time.process_time()
    characterise(recording)
    rows["characterise, 8000 samples x 7 sensors"] = time.process_time() - start
    start = time.process_time()
    calibrate(recording)
    rows["calibrate, 8000 samples x 7 sensors"] = time.process_time() - start
    for name, seconds in rows.items():
        print(f"{name:40s} {1000 * seconds:9.1f} ms")
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
