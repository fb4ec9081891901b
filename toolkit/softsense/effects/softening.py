"""Stress softening (Mullins effect): below its largest strain so far the material is softer."""

from __future__ import annotations

import numpy as np
from scipy.special import erf

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u (1 - D s), s from 0 at the largest strain so far to 1 far below it."""
    x = context.strain[:, None]
    earlier = -np.inf if state is None else state["largest"]
    largest = np.maximum(np.maximum.accumulate(x, axis=0), earlier)
    if form == "exponential":
        soft = -np.expm1(-(largest - x) / values["width"])
    else:
        # Energy on the virgin path, as of a linear material.
        below = 0.5 * (largest**2 - np.maximum(x, 0.0) ** 2)
        soft = erf(np.maximum(below, 0.0) / values["width"])
    return u * (1.0 - values["depth"] * soft), {"largest": float(largest[-1, 0])}


def explain(nominal: Nominal) -> list[Candidate]:
    """Functions of the largest strain so far and of the distance below it."""
    below = nominal.largest - nominal.strain
    bends = [below, below * nominal.largest, below**2, below * nominal.strain]
    deep = [np.minimum(below / (0.1 + 0.9 * nominal.largest), 1.0), nominal.largest * nominal.share]
    return [
        Candidate(np.stack(parts, axis=1) * nominal.span, {}, form)
        for parts, form in (
            (bends, "exponential"),
            ([*bends, *deep], "ogden-roxburgh"),
            (bends[:2], "exponential"),
        )
    ]


EFFECT = Effect(
    name="softening",
    stage="material",
    mechanism="bonds broken by the largest strain so far leave the material softer below it",
    equation="u (1 - D s); exponential: s = 1 - exp(-(x_m - x)/w); "
    "ogden_roxburgh: s = erf((W(x_m) - W(x))/w), W = x^2/2; x_m the largest strain so far",
    source="Ogden and Roxburgh, Proc. R. Soc. A 455 (1999); Mullins, Rubber Chem. Technol. 42 "
    "(1969)",
    fingerprint="depends on the largest strain so far, only below an earlier maximum",
    parameters=(
        Parameter("depth", "1", 0.02, 0.5, 0.15, "share of the signal that is lost"),
        Parameter("width", "strain range (its square)", 0.05, 1.0, 0.3, "way to become soft"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("exponential", "ogden_roxburgh"),
)
