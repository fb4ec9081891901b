"""Work on all cores at once."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

_here = threading.local()


def all_at_once(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """``work`` on each of ``items``: filters and matrix products let go of Python.

    One after the other where all cores have work already: within what is done at once.
    """
    if len(items) < 2 or getattr(_here, "busy", False):
        return [work(item) for item in items]
    with ThreadPoolExecutor(os.cpu_count(), initializer=_begin) as pool:
        return list(pool.map(work, items))


@contextmanager
def one_core() -> Iterator[None]:
    """``all_at_once`` does one after the other meanwhile: of short recordings each piece of work is
    over before another core has begun, and threads wait for Python in turn."""
    before = getattr(_here, "busy", False)
    _here.busy = True
    try:
        yield
    finally:
        _here.busy = before


def _begin() -> None:
    _here.busy = True
