"""Error of the estimate with each sensor cut, with and without the fallback networks.

python tests/benchmarks/link/fallback.py [--board host] [--build OUT --recording REC] [--json FILE]

The firmware on the emulated board watches the sensors and chooses the network ("with"); "without"
asks the same board for the primary network, as a firmware without fallbacks would. Every row after
the fault counts, those before the board has noticed too. Without --build, a small network with
fallbacks is built from one simulated recording and measured on another.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import softsense as ss
from softsense.cli.main import main as softsense
from softsense.device import Device, connect
from softsense.device.board import networks
from softsense.device.client import CHOOSE
from softsense.device.feeder import converter_codes, read_truth

FAULT_ROW = 200


@dataclass(frozen=True)
class Case:
    """One sensor cut in one way: RMSE in the output's unit, rows until the board said so."""

    sensor: str
    kind: str
    healthy: float
    without: float
    with_fallback: float
    answers: str
    noticed_after: int


def rmse(device: Device, network: np.ndarray, y: np.ndarray, truth: np.ndarray) -> float:
    """Of estimates by the networks with these numbers."""
    scales = np.array([item.scales[0] for item in device.identity.networks])[network]
    return float(np.sqrt(np.mean(((y - scales[:, 1]) * scales[:, 0] - truth) ** 2)))


def measure(device: Device, out: Path, recording: Path, sensor: str, kind: str) -> Case:
    """Cut ``sensor`` at FAULT_ROW of the recording and ask for every row."""
    truth = read_truth(out, recording).target[:, 0]
    inputs = len(networks(out)[0].inputs)
    sound = converter_codes(out, recording)
    cut = converter_codes(out, recording, [f"{sensor}:{kind}@{FAULT_ROW}"])
    after = slice(FAULT_ROW, None)
    primary = np.zeros(len(truth) - FAULT_ROW, int)
    # The board's memory of the sensors is that of the case before: healthy rows clear it.
    list(device.verdicts(sound[:FAULT_ROW], CHOOSE, batch=1))
    verdicts = list(device.verdicts(cut, CHOOSE, batch=1))
    y = np.concatenate([verdict.estimate[:, 0] for verdict in verdicts])
    used = np.array([verdict.network for verdict in verdicts])
    healthy = device.estimate(sound[:, :inputs])[:, 0]
    without = device.estimate(cut[:, :inputs])[:, 0]
    failed = np.array([verdict.failed for verdict in verdicts])
    return Case(
        sensor=sensor,
        kind=kind,
        healthy=rmse(device, primary, healthy[after], truth[after]),
        without=rmse(device, primary, without[after], truth[after]),
        with_fallback=rmse(device, used[after], y[after], truth[after]),
        answers=device.identity.networks[int(used[-1])].name,
        noticed_after=int(np.argmax(failed[after] != 0)) + 1 if failed[after].any() else -1,
    )


def build(folder: Path) -> tuple[Path, Path]:
    """A small network with fallbacks from one recording, and another recording to measure on."""
    rig = ss.linear_rig(3)
    for number, name in enumerate(("train", "unseen")):
        ss.write(ss.simulate(rig, samples=2000, seed=number), folder / f"{name}.csv")
    command = ["build", str(folder / "train.csv"), "--size", "2", "--hidden", "8", "-q"]
    command += ["--epochs", "10", "--fallback", "1", "--on", "reference"]
    if softsense([*command, "-o", str(folder / "out")]) != 0:
        raise SystemExit("the network could not be built")
    return folder / "out", folder / "unseen.csv"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--board", default="host")
    parser.add_argument("--build", type=Path, metavar="OUT")
    parser.add_argument("--recording", type=Path, metavar="REC")
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    if (args.build is None) != (args.recording is None):
        parser.error("--build and --recording go together")
    with tempfile.TemporaryDirectory() as folder:
        out, recording = args.build, args.recording
        if out is None:
            out, recording = build(Path(folder))
        with connect(out, f"emulate:{args.board}") as device:
            sensors = device.identity.networks[0].inputs
            cases = [
                measure(device, out, recording, sensor, kind)
                for sensor in sensors
                for kind in ("open", "short", "stuck")
            ]
    print("sensor  fault   healthy   without      with  noticed after  network")
    for case in cases:
        print(
            f"{case.sensor:7s} {case.kind:6s} {case.healthy:8.5f}  {case.without:8.5f}  "
            f"{case.with_fallback:8.5f}  {case.noticed_after:8d} rows  {case.answers}"
        )
    if args.json is not None:
        args.json.write_text(json.dumps([asdict(case) for case in cases], indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
