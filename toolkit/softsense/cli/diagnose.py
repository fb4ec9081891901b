"""Where a simulated recording disagrees with a real one of the same motion, and why.

  softsense diagnose sim.csv real.csv -o gap/
  softsense diagnose rig.toml real.csv -o gap/          the rig is run on the real motion
  softsense diagnose nominal.csv later.csv --calibrate -o gap/

Writes diagnosis.json, augmented.csv, report.html and what `softsense augment` needs; where a rig
was run, also rig.toml with the diagnosed effects in it, for `softsense build rig.toml`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_reading, read_recordings

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
    from softsense.diagnose.folder import calibrated, carry_over, on_motion_of, verdict, write
    from softsense.simulate import codes_of, read_rig

    if args.sim.suffix == ".toml":
        rig = read_rig(args.sim)
        (real,) = read_recordings(args, args.real, front_end=codes_of(rig))
        sim = on_motion_of(real, rig, args.seed)
    else:
        rig = None
        sim, real = read_recordings(args, args.sim, args.real)
        if args.calibrate:
            console.say("fit a simulator to the first recording")
            rig = calibrated(sim)
            sim = on_motion_of(real, rig, args.seed)
    result = diagnose(sim, real, seed=args.seed)
    write(result, sim, real, args.output)
    carried = () if rig is None else carry_over(result, rig, sim, args.output)
    if args.json:
        print(result.to_json(), end="")
        return 0
    print(verdict(result))
    for one in carried:
        where = ", ".join(one.placed.channels)
        share = f"{100 * one.share:.0f} % of what was diagnosed"
        if one.share > 0.0:
            print(f"rig.toml has {one.placed.name} on {where}: {share}")
        else:
            print(
                f"rig.toml is without {one.placed.name} on {where}: its equation there only harms"
            )
    print(f"report: {args.output / 'report.html'}")
    return 0
