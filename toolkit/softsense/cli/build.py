"""From a recording to a verified estimator: select, train, quantise, generate, verify, report.

RECORDING is a recording (.csv, .npz, .mat, .parquet), or a rig.toml, which is simulated first.
OUT receives NAME.h and NAME.c for your firmware, the float and the integer ONNX, test vectors,
manifest.json and report.html.

  softsense build rec.csv --size 2 -o out/demo
  softsense build sleeve.csv --target knee_deg --size 3 -o out/knee
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_packages, add_recording, packages_of, read_recording

HELP = "all of it in one go: from a recording to a verified estimator, with a report"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense build``."""
    add_recording(parser)
    parser.add_argument(
        "--size", type=int, metavar="K", help="choose the best K sensors (default: all given)"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="folder")
    parser.add_argument("--name", help="C prefix (default: the recording's stem)")
    group = parser.add_argument_group("training and quantising")
    group.add_argument(
        "--hidden", type=int, default=60, metavar="N", help="tanh units (default 60)"
    )
    group.add_argument(
        "--split", default="blocks", metavar="HOW", help="blocks (default), forward or random"
    )
    group.add_argument("--restarts", type=int, default=1, metavar="N", help="descents (default 1)")
    group.add_argument(
        "--epochs", type=int, default=100, metavar="N", help="limit per descent (default 100)"
    )
    group.add_argument(
        "--bits", type=int, default=16, choices=(8, 16), help="bits of a weight (default 16)"
    )
    group.add_argument(
        "--optimise",
        choices=("speed", "size"),
        default="speed",
        help="layout of the generated C, the same bits either way (default speed)",
    )
    group.add_argument(
        "--fallback",
        type=int,
        default=0,
        choices=(0, 1),
        help="1: also a network without each sensor, for the day when that sensor fails",
    )
    group = parser.add_argument_group("a budget: the best network that fits is chosen")
    group.add_argument("--max-flash", type=int, metavar="BYTES", help="flash of code and tables")
    group.add_argument(
        "--max-cycles",
        type=int,
        metavar="N",
        help="cycles per estimate; instructions on a core whose cycles no emulator here counts",
    )
    group.add_argument(
        "--core", default="Cortex-M4F", help="that the budget is for (default Cortex-M4F)"
    )
    add_packages(parser)
    parser.add_argument(
        "--on",
        metavar="A,B,…",
        help="evaluators to verify on (default: reference, onnxruntime, host, the emulator and "
        "every emulated board whose compiler and QEMU are installed)",
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Build, and print the table of what was reached."""
    import json

    from softsense import pipeline
    from softsense.errors import SoftsenseError
    from softsense.verify.costs import TARGETS

    budget = None
    if args.max_flash is not None or args.max_cycles is not None:
        cores = [target for target, _, _ in TARGETS]
        if args.core not in cores:
            raise SoftsenseError(f"there is no core {args.core!r}", remedy=", ".join(cores))
        budget = pipeline.Budget(args.core, args.max_flash, args.max_cycles)
    recipe = pipeline.Recipe(
        size=args.size,
        hidden=args.hidden,
        split=args.split,
        seed=args.seed,
        restarts=args.restarts,
        epochs=args.epochs,
        bits=args.bits,
        optimise=args.optimise,
        fallback=bool(args.fallback),
        packages=packages_of(args),
        budget=budget,
    )
    if args.recording.suffix == ".toml":
        recording = pipeline.simulate_rig(args.recording, seed=args.seed)
    else:
        recording = read_recording(args)
    on = None if args.on is None else tuple(args.on.split(","))
    result = pipeline.build(
        recording, args.output, recipe, name=args.name, on=on, stage=console.say
    )
    if args.json:
        print(json.dumps(result.to_dict()))
    else:
        for title, header, rows in result.tables():
            console.table(header, rows, title=title)
        print(result.export.quantised.verdict())
        print(f"files: {result.out}")
        print(f"report: {result.out / 'report.html'}")
    return 0 if result.good else 3
