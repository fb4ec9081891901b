"""How long the diagnosis of a long recording takes, on all cores.

  python tests/benchmarks/gap/long.py [--samples N] [EFFECT …]

Prints what was said of each hidden effect, and seconds of wall and of CPU time.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import cases

from softsense.diagnose import diagnose

# With the most channels (7) of the first seeds.
SEED = 3
EFFECTS = ("backlash", "hysteresis", "relaxation", "crosstalk")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("effects", nargs="*", metavar="EFFECT", default=EFFECTS)
    parser.add_argument("--samples", type=int, default=1_000_000)
    args = parser.parse_args()
    # Loops are compiled at their first call.
    short = cases.make(SEED, ("hysteresis",), "rich", False)
    diagnose(short.sim, short.real)
    cases.SAMPLES = args.samples
    for effect in args.effects:
        case = cases.make(SEED, (effect,), "rich", False)
        wall, cpu = time.perf_counter(), time.process_time()
        said = "+".join(diagnose(case.sim, case.real).effects) or "none"
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        samples, channels = case.sim.codes.shape
        print(
            f"{effect:12} {samples} samples of {channels} channels: {said}, "
            f"{wall:.1f} s, {cpu:.1f} s of CPU"
        )


if __name__ == "__main__":
    main()
