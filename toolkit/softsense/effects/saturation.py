"""Saturation: the amplifier or the divider runs into its rail."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values


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
    """What is cut off above a level, weight 1, hard or with a soft knee."""
    return _traces(nominal, nominal.low + np.linspace(0.5, 0.99, 25) * nominal.span)


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one level."""
    level = values["level"] * nominal.full_scale
    return _traces(nominal, level + np.linspace(-0.02, 0.02, 11) * nominal.span)


def _traces(nominal: Nominal, levels: Floats) -> list[Candidate]:
    result = []
    for level in levels:
        values = {"level": float(level / nominal.full_scale)}
        over = nominal.u - level
        for knee in (0.0, 0.03, 0.08):
            width = knee * nominal.span
            cut = np.maximum(over, 0.0) if not width else width * np.logaddexp(0.0, over / width)
            result.append(Candidate(-cut[:, None], values, fixed=True))
    return result


EFFECT = Effect(
    name="saturation",
    stage="electrical",
    mechanism="the front end runs into its rail",
    equation="hard: min(u, m); soft: m - k ln(1 + exp((m - u)/k))",
    source="ideal limiter; softplus as its smooth form",
    fingerprint="static, only at the top",
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
