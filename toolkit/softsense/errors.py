"""The errors that a user is meant to read (the first defined in the leaf package, named here)."""

from __future__ import annotations

import re

from softsense_codegen.errors import SoftsenseError

__all__ = ["DoesNotFitError", "SoftsenseError", "too_large"]


class DoesNotFitError(SoftsenseError):
    """A program with these networks is larger than the memory that it is meant for."""


def too_large(said: str) -> bool:
    """Whether a compiler or linker that ``said`` this had no room for the program."""
    return bool(
        re.search(r"array .* is too large|will not fit in region|is not within region", said)
    )
