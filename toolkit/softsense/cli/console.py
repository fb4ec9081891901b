"""What a person sees while a command works: stages, progress and tables, on stderr.

stdout carries only the result, so that it can be piped. rich is imported on first use, since
``softsense --help`` must start fast.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol


class Advance(Protocol):
    """Tell how far the work is: ``done`` of the total given to ``Console.progress``."""

    def __call__(self, done: float, note: str = "") -> None: ...


class Console:
    """Progress for people. Silent when ``quiet``; no bars where stderr is not a terminal."""

    def __init__(self, quiet: bool = False) -> None:
        self.quiet = quiet

    def say(self, text: str = "") -> None:
        """One line of news."""
        if not self.quiet:
            print(text, file=sys.stderr, flush=True)

    @contextmanager
    def progress(self, label: str, total: float) -> Iterator[Advance]:
        """A progress bar for long work; yields a function to call with the amount done."""
        if self.quiet or not sys.stderr.isatty():

            def silent(done: float, note: str = "") -> None:
                return None

            yield silent
            return
        from rich.console import Console as RichConsole
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("  {task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} % {task.fields[note]}"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=RichConsole(stderr=True), transient=True) as bar:
            task = bar.add_task(label, total=total, note="")

            def advance(done: float, note: str = "") -> None:
                bar.update(task, completed=done, note=note)

            yield advance

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> None:
        """A plain aligned table on stdout; the first column to the left, numbers to the right."""
        if title:
            print(title)
        cells = [list(header), *[list(row) for row in rows]]
        widths = [max(len(row[column]) for row in cells) for column in range(len(header))]
        for number, row in enumerate(cells):
            parts = [row[0].ljust(widths[0])]
            parts += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
            print("  " + "  ".join(parts).rstrip())
            if number == 0:
                print("  " + "  ".join("-" * width for width in widths))
