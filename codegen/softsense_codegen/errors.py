"""The one error that a user is meant to read."""

from __future__ import annotations


class SoftsenseError(Exception):
    """A mistake that the user can mend, said in one line: what, where, and what to do.

    ``where`` names the place (file, row, column, node, port), ``remedy`` the next step.
    """

    def __init__(self, what: str, *, where: str | None = None, remedy: str | None = None) -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        text = f"{where}: {what}" if where else what
        super().__init__(f"{text} ({remedy})" if remedy else text)
