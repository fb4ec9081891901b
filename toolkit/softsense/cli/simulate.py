"""A recording from a built-in rig: what the sensors would have said, with the truth beside it."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from softsense.cli.console import Console

HELP = "a recording from a built-in rig, or from a rig.toml"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what ``softsense simulate`` takes."""
    parser.add_argument("kind", nargs="?", choices=("linear",), default="linear", help="the rig")
    parser.add_argument("--samples", type=int, default=8000, metavar="N", help="default 8000")
    parser.add_argument("--rate", type=float, default=20.0, metavar="HZ", help="default 20 Hz")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the recording, .csv")


def run(args: argparse.Namespace, console: Console) -> int:
    """Simulate and write the recording."""
    from softsense import recording
    from softsense.simulate import linear_rig
    from softsense.simulate import run as drive
    from softsense.simulate.motion import random_motion
    from softsense.simulate.record import to_recording

    rig = linear_rig(args.seed, rate_hz=args.rate)
    strain = random_motion(args.samples, 1.0 / rig.rate_hz, args.seed)
    result = to_recording(rig, strain, drive(rig, strain, args.seed))
    recording.write(result, args.output)
    if args.json:
        print(json.dumps({"recording": str(args.output), "samples": len(result)}))
    else:
        print(f"{args.output}: {result!r}")
    return 0
