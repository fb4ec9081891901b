"""How results show themselves: one line in a terminal, a small table in a notebook."""

from __future__ import annotations

from html import escape


class Shown:
    """A result with a ``summary``: what it is worth knowing first, as (name, text)."""

    def summary(self) -> list[tuple[str, str]]:
        """Name and text of each line, the most important first."""
        raise NotImplementedError

    def __repr__(self) -> str:
        parts = ", ".join(f"{name}: {text}" for name, text in self.summary())
        return f"{type(self).__name__}({parts})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th>"
            f"<td style='text-align:left'>{escape(text)}</td></tr>"
            for name, text in self.summary()
        )
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"
