"""How an action tells a person what it does; the command line's console is one of these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol


class Console(Protocol):
    """News and progress on stderr, tables on stdout."""

    def say(self, text: str = "") -> None:
        """One line of news."""

    def progress(self, label: str, total: float) -> AbstractContextManager[Callable[..., Any]]:
        """Yields a function to call with the amount done."""

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> None:
        """An aligned table."""
