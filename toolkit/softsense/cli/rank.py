"""Rank sensors and subsets of sensors by what they tell about the target."""

from __future__ import annotations

import argparse

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

HELP = "rank every subset of sensors by what it tells about the target"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense rank``."""
    add_recording(parser)
    parser.add_argument("--max-size", type=int, metavar="K", help="largest subset (default all)")


def run(args: argparse.Namespace, console: Console) -> int:
    """Rank, then print the table."""
    from softsense.select import rank

    ranking = rank(read_recording(args), args.max_size)
    rows = [(" ".join(s.sensors), f"{s.score:.3f}") for s in ranking.subsets]
    console.table(("sensors", "score"), rows)
    return 0
