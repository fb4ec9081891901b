"""Apply diagnosed effects to another simulated recording of the same sensors.

  softsense augment gap/ sim2.csv -o augmented2.csv

The other motion is taken to come after the one that was diagnosed: ageing goes on.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_reading, read_recordings

HELP = "apply the diagnosed effects to another simulated recording"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense augment``."""
    parser.add_argument("diagnosis", type=Path, metavar="DIR", help="folder of softsense diagnose")
    parser.add_argument("sim", type=Path, metavar="SIM2", help="simulated recording")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="AUG2.csv")
    add_reading(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    """Read, apply, write."""
    import json

    from softsense.diagnose import augment
    from softsense.diagnose.folder import read
    from softsense.recording import write

    diagnosis = read(args.diagnosis)
    (sim,) = read_recordings(args, args.sim, front_end=diagnosis.front_ends)
    made = augment(diagnosis, sim)
    write(made, args.output)
    if args.json:
        print(json.dumps({"recording": str(args.output), "effects": list(diagnosis.effects)}))
    else:
        print(f"{args.output}: {', '.join(diagnosis.effects) or 'nothing to add'}")
    return 0
