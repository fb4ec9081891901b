"""Where a simulated recording disagrees with a real one of the same motion, and why.

  softsense diagnose sim.csv real.csv -o gap/
  softsense diagnose rig.toml real.csv -o gap/          the rig is run on the real motion
  softsense diagnose nominal.csv later.csv --calibrate -o gap/

Writes diagnosis.json, augmented.csv, report.html and what `softsense augment` needs.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_reading, read_recording

HELP = "the sim-to-real gap: where, which effect, how far it shrinks"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense diagnose``."""
    parser.add_argument("sim", type=Path, metavar="SIM", help="simulated recording, or rig.toml")
    parser.add_argument("real", type=Path, metavar="REAL", help="real recording")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder")
    parser.add_argument(
        "--calibrate",
        action="store_true",
        help="SIM is an earlier recording: fit a simulator to it, then diagnose REAL",
    )
    add_reading(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    """Diagnose, write, and say the verdict."""
    from softsense.diagnose import diagnose
    from softsense.diagnose.folder import calibrated, diagnose_rig, verdict, write

    real = read_recording(args, args.real)
    if args.sim.suffix == ".toml":
        sim, result = diagnose_rig(args.sim, real, args.seed)
    elif args.calibrate:
        console.say("fit a simulator to the first recording")
        sim = calibrated(read_recording(args, args.sim), real, args.seed)
        result = diagnose(sim, real, seed=args.seed)
    else:
        sim = read_recording(args, args.sim)
        result = diagnose(sim, real, seed=args.seed)
    write(result, sim, real, args.output)
    if args.json:
        print(result.to_json(), end="")
    else:
        print(verdict(result))
        print(f"report: {args.output / 'report.html'}")
    return 0
