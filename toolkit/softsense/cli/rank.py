"""Rank sensors and subsets of sensors by what they tell about the target.

mi       plug-in mutual information of the raw codes, the paper's measure (bits; nats in --json).
         Right for one or two sensors; saturates at the target's entropy from about three on.
score    bits by which a polynomial of the sensors, tested on samples that it has not seen, narrows
         the target down. Meaningful for every size; the ranking goes by it.
mi >=    nearest neighbours between that held-out estimate and the target: by data processing a
         lower bound of the mutual information, up to its own error of about 0.1 bit.

Up to ten sensors every subset is scored; beyond, forward selection looks for good ones."""

from __future__ import annotations

import argparse
from math import log
from pathlib import Path
from typing import TYPE_CHECKING

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

if TYPE_CHECKING:
    from softsense.select import Ranking

HELP = "rank every subset of sensors by what it tells about the target"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense rank``."""
    add_recording(parser)
    parser.add_argument("--max-size", type=int, metavar="K", help="largest subset (default all)")
    parser.add_argument(
        "--criterion",
        default="score",
        choices=("score", "cmim", "jmi"),
        help="what forward selection goes by; cmim and jmi always select forward (default score)",
    )
    parser.add_argument(
        "--uniform",
        default="none",
        choices=("none", "weight", "resample"),
        help="make the target cover its range evenly: count rare values more (weight), or thin "
        "out frequent ones (resample)",
    )
    parser.add_argument(
        "--unseen",
        default="samples",
        choices=("stretches", "samples"),
        help="test the score on single samples (default), which ranks best, or on stretches of "
        "time, as a device meets them: harder on sensors that tell the time",
    )
    parser.add_argument("--top", type=int, default=3, help="subsets shown per size (default 3)")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write the JSON here")


def run(args: argparse.Namespace, console: Console) -> int:
    """Rank, then print the tables or the JSON."""
    import json

    from softsense.select import rank
    from softsense_codegen.atomic import write_text

    recording = read_recording(args)
    ranking = rank(
        recording,
        args.max_size,
        criterion=args.criterion,
        uniform=args.uniform,
        unseen=args.unseen,
        seed=args.seed,
    )
    for warning in ranking.warnings:
        console.say(f"warning: {warning}")
    text = json.dumps(ranking.to_dict())
    if args.output is not None:
        write_text(args.output, text + "\n")
    if args.json:
        print(text)
    else:
        show(ranking, args.top, console)
    return 0


def show(ranking: Ranking, top: int, console: Console) -> None:
    """Singles, dissimilarity, and the best subsets of each size."""
    names = tuple(ranking.singles)
    console.table(
        ("sensor", "mi / bit", "mi / nat", "entropy / bit"),
        [
            (n, f"{s.mi_bits:.3f}", f"{s.mi_bits * log(2):.3f}", f"{s.entropy_bits:.3f}")
            for n, s in ranking.singles.items()
        ],
        title=f"each sensor alone (the target's entropy is {ranking.target_entropy_bits:.3f} bit)",
    )
    pairs = sorted(ranking.of_size(2), key=lambda pair: -pair.mi_bits)
    if pairs and len(names) <= 12:
        console.table(
            ("pair", "mi / bit", "mi / nat"),
            [
                (" ".join(pair.sensors), f"{pair.mi_bits:.3f}", f"{pair.mi_bits * log(2):.3f}")
                for pair in pairs
            ],
            title="each pair, by the measure of the raw codes",
        )
    if len(names) <= 12:
        console.table(
            ("known", *names),
            [
                (first, *(f"{value:.2f}" if i != j else "-" for j, value in enumerate(row)))
                for i, (first, row) in enumerate(
                    zip(names, ranking.dissimilarity_bits.tolist(), strict=True)
                )
            ],
            title="dissimilarity: bits that the column's sensor adds to the row's",
        )
    rows = [
        (
            " ".join(subset.sensors),
            f"{subset.score:.3f}",
            "" if subset.mi_lower_bits is None else f"{subset.mi_lower_bits:.3f}",
            f"{subset.mi_bits:.3f}",
        )
        for size in ranking.best
        for subset in ranking.of_size(size)[: max(1, top)]
    ]
    console.table(
        ("subset", "score", "mi >=", "mi"), rows, title=f"best subsets per size ({ranking.method})"
    )
