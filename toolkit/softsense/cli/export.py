"""Quantise a trained network and write C, ONNX, vectors and manifest.

SOURCE is the folder of ``softsense train``:
  softsense export fit/ -o out/knee --name knee
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console

HELP = "quantise a network; write C header and source, ONNX, vectors, manifest"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense export``."""
    parser.add_argument("source", type=Path, metavar="SOURCE", help="training folder")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="folder")
    parser.add_argument("--name", help="C prefix (default: the recording's stem)")
    parser.add_argument(
        "--bits", type=int, default=16, choices=(8, 16), help="bits of a weight (default 16)"
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Export, and say what the integers are worth."""
    import json

    from softsense import pipeline
    from softsense_codegen.network import c_name, check_name

    mlp, codes, stem = pipeline.read_training(args.source)
    name = c_name(stem) if args.name is None else check_name(args.name)
    result = pipeline.export(
        mlp, codes, args.output, name=name, bits=args.bits, seed=args.seed, stage=console.say
    )
    if args.json:
        print((args.output / "manifest.json").read_text(), end="")
    else:
        print(result.quantised.verdict())
        rows = [(c.target, f"{c.flash} B", f"{c.ram} B", f"{c.stack} B") for c in result.costs]
        console.table(("core", "flash", "static RAM", "stack"), rows)
        print(f"files: {args.output} ({json.dumps(result.files)})")
    return 0
