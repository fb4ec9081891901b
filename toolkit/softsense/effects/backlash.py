"""Backlash: the drive has play before it takes the sensor along."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import play


def simulate(
    x: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """play_w(x), starting in touch in the middle of its play, or max(x - d, 0)."""
    if form == "dead_zone":
        return np.maximum(x - values["width"], 0.0), {}
    memory = x[0].copy() if state is None else state["memory"].copy()
    moved: Floats = play(x, np.ascontiguousarray(values["width"]), memory)
    return moved, {"memory": memory}


def explain(nominal: Nominal) -> list[Candidate]:
    """What the channel says of the played strain less what it says of the strain, weight 1."""
    return _traces(nominal, np.geomspace(0.004, 0.3, 22))


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one width."""
    return _traces(nominal, values["width"] * np.geomspace(0.8, 1.25, 15))


def _traces(nominal: Nominal, widths: Floats) -> list[Candidate]:
    moved = nominal.respond(nominal.strain, nominal.keep)
    result = []
    for width in widths:
        played = play(nominal.strain[:, None], np.array([width]), nominal.strain[:1].copy())[:, 0]
        values = {"width": float(width)}
        column = (nominal.respond(played, nominal.keep) - moved)[:, None]
        result.append(Candidate(column, values, "play", fixed=True))
    return result


EFFECT = Effect(
    name="backlash",
    stage="motion",
    mechanism="play in the drive, slip or slack: part of a move is lost after each reversal",
    equation="play: y = min(max(y, x - w/2), x + w/2); dead_zone: y = max(x - w, 0)",
    source="play operator: Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989)",
    fingerprint="flat after each reversal, over the same width on all channels",
    parameters=(Parameter("width", "share of range", 0.005, 0.15, 0.05, "play, or slack"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("play", "dead_zone"),
    exact=True,
)
