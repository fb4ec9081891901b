"""Saturation: the amplifier or the divider runs into its rail."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

# Widths of the knee as shares of the signal's range, and what is tried near one: far and close, for
# the next look is around what is best.
KNEES = np.array([0.0, 0.02, 0.06, 0.15])
NEAR = np.array([0.5, 0.7, 0.84, 0.94, 1.0, 1.06, 1.18, 1.4, 2.0])
SHARP = np.array([0.0, 0.004, 0.01, 0.02])
AROUND = np.array([0.0005, 0.0015, 0.004, 0.01, 0.02])
# An upper rail, and a lower one.
ENDS = ("level", "bottom")
# How far inside the signal's range a second rail may be, as shares of it.
INSIDE = np.array([0.03, 0.06, 0.1, 0.15, 0.2])
# What of the signal comes through beyond a rail.
THROUGH = (0.025, 0.05, 0.075, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45)


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """min(u, m), or the soft minimum m - k ln(1 + exp((m - u) / k))."""
    level = values["level"]
    if form == "hard":
        return np.minimum(u, level), {}
    knee = np.maximum(values["knee"], 1e-9)
    return level - knee * np.logaddexp(0.0, (level - u) / knee), {}


def explain(nominal: Nominal) -> list[Candidate]:
    """What is cut off above a level or below one, weight 1, hard or with a soft knee."""
    levels = nominal.low + np.linspace(0.5, 0.99, 25) * nominal.span
    bottoms = nominal.low + np.linspace(0.01, 0.5, 25) * nominal.span
    knees = KNEES * nominal.span
    return _traces(nominal, levels, knees) + _lower(nominal, bottoms, knees[:2])


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one level and one knee, also where a part comes through; or both rails."""
    around = np.concatenate([-AROUND[::-1], [0.0], AROUND]) * nominal.span
    knee = np.array([values["knee"] * nominal.full_scale])
    knees = knee * NEAR if knee else SHARP * nominal.span
    ends = {key: values[key] * nominal.full_scale + around for key in ENDS if key in values}
    if len(ends) == 2:
        return _between(nominal, ends["level"][::2], knee, ends["bottom"][::2])
    upper = "level" in ends
    end, made = (ends["level"], _traces) if upper else (ends["bottom"], _lower)
    other = nominal.low + (INSIDE if upper else 1.0 - INSIDE) * nominal.span
    levels, bottoms = (end[1::3], other) if upper else (other, end[1::3])
    there, through = made(nominal, end, knees), values.get("through", 0.0)
    return [
        *([each.leaking(through) for each in there] if through else there),
        *(each.leaking(part) for each in made(nominal, end, knee) for part in THROUGH),
        *_between(nominal, levels, knee, bottoms),
    ]


def _traces(nominal: Nominal, levels: Floats, knees: Floats) -> list[Candidate]:
    result = []
    for level in levels.tolist():
        for knee in knees.tolist():
            values = {"level": level / nominal.full_scale, "knee": knee / nominal.full_scale}
            result.append(Candidate(partial(_cut, nominal, level, knee, -1.0), values, fixed=True))
    return result


def _lower(nominal: Nominal, bottoms: Floats, knees: Floats) -> list[Candidate]:
    result = []
    for bottom in bottoms.tolist():
        for knee in knees.tolist():
            values = {"bottom": bottom / nominal.full_scale, "knee": knee / nominal.full_scale}
            made = partial(_cut, nominal, bottom, knee, 1.0)
            result.append(Candidate(made, values, "lower_rail", fixed=True))
    return result


def _cut(nominal: Nominal, end: float, knee: float, way: float) -> Floats:
    """(samples, 1) what a rail takes off above it (``way`` -1) or adds below it (1); and more of it
    the closer the signal comes within a ``knee``."""
    over = way * (end - nominal.u)
    cut = knee * np.logaddexp(0.0, over / knee) if knee else np.maximum(over, 0.0)
    return way * cut[:, None]


def _between(nominal: Nominal, levels: Floats, knees: Floats, bottoms: Floats) -> list[Candidate]:
    """What is cut off above a level and below another one."""
    result = []
    for below in _lower(nominal, bottoms, np.zeros(1)):
        for above in _traces(nominal, levels, knees):
            values = {**above.values, "bottom": below.values["bottom"]}
            both = partial(_both, above, below)
            result.append(Candidate(both, values, "both_rails", fixed=True))
    return result


def _both(above: Candidate, below: Candidate) -> Floats:
    return above.columns + below.columns


EFFECT = Effect(
    name="saturation",
    stage="electrical",
    mechanism="the front end runs into its rail",
    equation="hard: min(u, m); soft: m - k ln(1 + exp((m - u)/k))",
    source="ideal limiter; softplus as its smooth form",
    fingerprint="static, only at the ends",
    parameters=(
        Parameter("level", "share of ADC scale", 0.3, 1.0, 0.6, "highest reading m"),
        Parameter("knee", "share of ADC scale", 0.002, 0.1, 0.02, "soft: width k of the knee"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("hard", "soft"),
    exact=True,
    memoryless=True,
)
