"""Templates to text: substitution, ``for`` and ``if`` only; an unknown name is an error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

_ENVIRONMENT = Environment(
    loader=PackageLoader("softsense_codegen"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
    autoescape=False,
)


def render(template: str, view: Mapping[str, Any]) -> str:
    """The text of ``template`` filled from ``view``, without blanks at line ends."""
    text = _ENVIRONMENT.get_template(template).render(view)
    return "\n".join(line.rstrip() for line in text.split("\n"))
