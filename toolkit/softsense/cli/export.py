"""Quantise a trained network and write C, ONNX, vectors, manifest and report.

SOURCE is the folder of ``softsense train``, or any MLP as ONNX (Gemm or MatMul + Add with tanh,
relu or sigmoid, as PyTorch, Keras and scikit-learn converters write them):

  softsense export fit/ -o out/knee --name knee
  softsense export net.onnx --adc-bits 12 --input-affine 0.000488,2048 -o out/net

With --input-affine SCALE,OFFSET the network sees x = SCALE * (code - OFFSET); for inputs that
differ give one pair per input, joined by semicolons.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_packages, packages_of

HELP = "quantise a network; write C header and source, ONNX, vectors, manifest"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense export``."""
    parser.add_argument("source", type=Path, metavar="SOURCE", help="training folder or NET.onnx")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="folder")
    parser.add_argument("--name", help="C prefix (default: the recording's or file's stem)")
    parser.add_argument(
        "--bits", type=int, default=16, choices=(8, 16), help="bits of a weight (default 16)"
    )
    parser.add_argument(
        "--optimise",
        choices=("speed", "size"),
        default="speed",
        help="layout of the generated C, the same bits either way (default speed)",
    )
    add_packages(parser)
    group = parser.add_argument_group("a network as ONNX")
    group.add_argument("--adc-bits", type=int, default=12, metavar="N", help="default 12")
    group.add_argument("--input-affine", metavar="SCALE,OFFSET", help="x = SCALE * (code - OFFSET)")
    group.add_argument("--unit", default="1", help="unit of the outputs")


def run(args: argparse.Namespace, console: Console) -> int:
    """Export, and say what the integers are worth."""
    import tempfile

    from softsense import pipeline
    from softsense.errors import SoftsenseError
    from softsense.verify.costs import HEADER as COSTS
    from softsense.verify.costs import measure_costs
    from softsense_codegen.generate import generate
    from softsense_codegen.network import c_name, check_name
    from softsense_codegen.view import Optimise

    if args.source.suffix.lower() == ".onnx":
        from softsense.onnx_import import grid_codes, parse_scaling, read_onnx

        if args.input_affine is None:
            raise SoftsenseError(
                "codes must be mapped to the network's inputs",
                where=str(args.source),
                remedy="give --input-affine SCALE,OFFSET",
            )
        mlp = read_onnx(args.source, parse_scaling(args.input_affine, args.adc_bits), args.unit)
        codes, stem = grid_codes(mlp, seed=args.seed), args.source.stem
    else:
        mlp, codes, stem = pipeline.read_training(args.source)
    name = c_name(stem) if args.name is None else check_name(args.name)
    result = pipeline.export(
        mlp,
        codes,
        args.output,
        name=name,
        bits=args.bits,
        seed=args.seed,
        optimise=args.optimise,
        packages=packages_of(args),
        stage=console.say,
    )
    if args.json:
        print((args.output / "manifest.json").read_text(), end="")
        return 0
    print(result.quantised.verdict())
    other: Optimise = "size" if args.optimise == "speed" else "speed"
    with tempfile.TemporaryDirectory(prefix="softsense-") as scratch:
        files = generate(result.network, scratch, codes, optimise=other)
        others = {cost.target: cost for cost in measure_costs(files[1])}
    # The same bits, laid out otherwise: what the choice costs and gains.
    rows = [
        (*cost.row, f"{rival.flash} B", rival.time or "-")
        for cost in result.costs
        if (rival := others.get(cost.target))
    ]
    console.table((*COSTS, f"flash, {other}", f"per estimate, {other}"), rows)
    print(f"files: {args.output}")
    return 0
