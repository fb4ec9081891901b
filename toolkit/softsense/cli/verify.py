"""Check an export folder bit for bit: recorded, corner, random and out-of-range codes, and with
one or two inputs every possible one, on each evaluator against the integer reference.

  softsense verify out/demo
  softsense verify out/demo --on host,qemu:mps2-an386,/dev/ttyACM0

Exit code 3 when a single bit differs.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console

HELP = "check C, ONNX and boards bit for bit against the reference"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense verify``."""
    parser.add_argument("out", type=Path, metavar="OUT", help="folder made by build or export")
    parser.add_argument(
        "--on",
        default="reference,onnxruntime,host",
        metavar="A,B,…",
        help="reference, onnxruntime, host, emulate:host, qemu:BOARD, a serial port "
        "(default reference,onnxruntime,host)",
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Verify, print a row per evaluator."""
    import json

    from softsense.verify import verify

    on = tuple(part.strip() for part in args.on.split(",") if part.strip())
    result = verify(args.out, on, seed=args.seed, stage=console.say)
    if args.json:
        print(json.dumps(result.to_dict()))
    else:
        rows = [
            (c.evaluator, f"{c.mismatches} of {c.compared}", f"{c.seconds:.2f} s")
            for c in result.comparisons
        ]
        console.table(
            ("evaluator", "mismatches", "time"), rows, title=f"digest {result.digest[:16]}"
        )
        for c in result.comparisons:
            if c.first is not None:
                print(f"{c.evaluator}: x = {c.first[0]} must give {c.first[1]}, gave {c.first[2]}")
        gap = result.fixed_vs_float
        print(
            f"fixed - float ONNX: at most {gap['max_abs']:.4g} {gap['unit']}, "
            f"stated bound {gap['bound']:.4g}"
        )
    return 0 if result.good else 3
