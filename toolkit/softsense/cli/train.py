"""Train the static network (one tanh layer, Levenberg-Marquardt) on chosen sensors."""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

HELP = "fit the static network on the best or on given sensors"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense train``."""
    add_recording(parser)
    parser.add_argument("--size", type=int, metavar="K", help="choose the best K sensors")
    parser.add_argument("--hidden", type=int, default=60, help="tanh units (default 60)")
    parser.add_argument(
        "--split", default="blocks", metavar="HOW", help="blocks (default), forward or random"
    )
    parser.add_argument("--restarts", type=int, default=1, help="descents (default 1)")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="results")


def run(args: argparse.Namespace, console: Console) -> int:
    """Select, fit, save, and say how good it is."""
    import json

    from softsense.select import select
    from softsense.train import fit
    from softsense.train.files import save, summary

    rec = read_recording(args)
    chosen = None if args.size is None else select(rec, args.size)
    result = fit(
        rec,
        chosen,
        hidden=args.hidden,
        split=args.split,
        seed=args.seed,
        restarts=args.restarts,
    )
    save(result, rec, args.output)
    if args.json:
        print(json.dumps(summary(result)))
    else:
        rows = [
            (name, unit, *(f"{result.rmse[part][i]:.4g}" for part in result.rmse))
            for i, (name, unit) in enumerate(
                (output.name, output.unit) for output in result.mlp.outputs
            )
        ]
        header = ("RMSE of", "unit", *result.rmse)
        console.table(header, rows, title=f"{' '.join(result.sensors)} ({result.status})")
    return 0
