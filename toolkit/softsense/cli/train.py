"""Train the static network (one tanh layer, Levenberg-Marquardt) on chosen sensors.

The folder then holds mlp.json (the network), recording.npz (codes and targets of its sensors) and
train.json (errors, split, selection, why training stopped). Sensors are chosen on the training and
validation rows alone; test rows only judge.

--all trains every subset of the sensors, and writes subsets.csv, all.json (how well the ranking
foretold accuracy) and figures/. It draws rows at random, as the paper does: which subset is best on
a few blocks of time is much by chance. Interrupt it at will: the same command goes on where it was.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

if TYPE_CHECKING:
    from softsense.recording import Recording
    from softsense.train import Agreement, Fit

HELP = "fit the static network on the best sensors, on given ones, or on every subset"

RESTARTS = 3
MAX_EPOCHS = 100


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense train``."""
    add_recording(parser)
    parser.add_argument("--size", type=int, metavar="K", help="choose the best K sensors")
    parser.add_argument("--all", action="store_true", help="train every subset of the sensors")
    parser.add_argument("--hidden", type=int, default=60, help="tanh units (default 60)")
    parser.add_argument(
        "--split",
        choices=("blocks", "forward", "random"),
        help="70:15:15 by blocks of time (default), by time, or sample by sample (which flatters, "
        "and compares subsets best: default with --all)",
    )
    parser.add_argument(
        "--restarts",
        type=int,
        metavar="N",
        help=f"descents; the best on validation is kept (default {RESTARTS}; 1 with --all)",
    )
    parser.add_argument(
        "--max-epochs", type=int, default=MAX_EPOCHS, metavar="N", help="(default %(default)s)"
    )
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="processes for --all (default: the number of cores)"
    )
    parser.add_argument("--dask", metavar="ADDRESS", help="train --all on a Dask cluster")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="results")


def run(args: argparse.Namespace, console: Console) -> int:
    """Select, fit, save, and say how good it is."""
    import json

    from softsense.errors import SoftsenseError
    from softsense.train.files import summary

    rec = read_recording(args)
    if args.split is None:
        args.split = "random" if args.all else "blocks"
    if args.all:
        if args.size is not None:
            raise SoftsenseError("--all and --size exclude each other", remedy="give one of them")
        result, agreement = _all(args, rec, console)
    else:
        result, agreement = _one(args, rec, console), ()
    if args.json:
        from dataclasses import asdict

        extra = {"agreement": [asdict(one) for one in agreement]} if args.all else {}
        print(json.dumps({**summary(result), **extra}))
        return 0
    rows = [
        (output.name, output.unit, *(f"{result.rmse[part][i]:.4g}" for part in result.rmse))
        for i, output in enumerate(result.mlp.outputs)
    ]
    title = f"{' '.join(result.sensors)}: stopped after {result.epochs} epochs, {result.status}"
    console.table(("RMSE of", "unit", *result.rmse), rows, title=title)
    if agreement:
        console.table(
            ("size", "subsets", "score", "mi", "mi >=", "regret", "of three"),
            [
                (
                    str(one.size),
                    str(one.subsets),
                    *("-" if v is None else f"{v:.2f}" for v in (one.score, one.mi, one.mi_lower)),
                    f"{one.regret:.3f}",
                    f"{one.regret_of_three:.3f}",
                )
                for one in agreement
            ],
            title="Spearman correlation with accuracy, and regret (MSE chosen / MSE best)",
        )
        if args.split == "random":
            console.say("rows were drawn at random: fair between subsets, but all errors flatter")
    return 0


def _one(args: argparse.Namespace, rec: Recording, console: Console) -> Fit:
    """Train on the best ``--size`` sensors, or on all that were read."""
    import numpy as np

    from softsense import recording
    from softsense.select import select
    from softsense.train import fit
    from softsense.train.files import save

    chosen = None
    extra = {}
    if args.size is not None:
        rec.require_usable()
        rows = recording.split(len(rec), args.split, args.seed)
        known = rec.rows(np.sort(np.concatenate([rows.train, rows.validation])))
        chosen = select(known, args.size)
        extra["selection"] = {
            "size": args.size,
            "score": chosen.score,
            "mi_bits": chosen.mi_bits,
            "ranking": [[list(s.sensors), s.score] for s in chosen.ranking],
        }
    with console.progress("training", 1.0) as advance:
        result = fit(
            rec,
            chosen,
            hidden=args.hidden,
            split=args.split,
            seed=args.seed,
            restarts=RESTARTS if args.restarts is None else args.restarts,
            max_epochs=args.max_epochs,
            progress=advance,
        )
    save(result, rec, args.output, extra)
    return result


def _all(
    args: argparse.Namespace, rec: Recording, console: Console
) -> tuple[Fit, tuple[Agreement, ...]]:
    """Train every subset; the folder's own network is the best of them on validation."""
    import os

    import numpy as np

    from softsense import recording
    from softsense.select import rank
    from softsense.train import Settings, compare, fit_all
    from softsense.train.figures import draw
    from softsense.train.files import save, save_table

    settings = Settings(
        args.hidden,
        args.split,
        args.seed,
        1 if args.restarts is None else args.restarts,
        args.max_epochs,
    )
    rec.require_usable()
    jobs = (os.cpu_count() or 1) if args.jobs is None else max(1, args.jobs)
    with console.progress("training subsets", 2 ** len(rec.sensors) - 1) as advance:
        trained = fit_all(rec, args.output, settings, jobs=jobs, dask=args.dask, progress=advance)
    rows = recording.split(len(rec), args.split, args.seed)
    known = rec.rows(np.sort(np.concatenate([rows.train, rows.validation])))
    ranking = rank(known)
    for warning in ranking.warnings:
        console.say(f"warning: {warning}")
    agreement = compare(ranking, trained)
    save_table(args.output, ranking, trained, agreement)
    draw(args.output / "figures", ranking, trained, rec, rows)
    result = min(trained, key=lambda one: one.judged)
    save(result, rec, args.output)
    return result, agreement
