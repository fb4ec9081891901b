"""Noise of the front end, and of contacts that open and close as the wire moves."""

from __future__ import annotations

import numpy as np

from softsense.effects import Context, Effect, Floats, Parameter, State, Values
from softsense.effects.operators import rate


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + lsb sigma n, n white and Gaussian."""
    rng = context.generator(state)
    white = rng.standard_normal(u.shape)
    sigma = np.broadcast_to(values["level_lsb"], u.shape)
    previous = None if state is None else state["strain"]
    if form == "heteroscedastic":
        v = np.abs(rate(context.strain, context.dt_s, previous))
        sigma = sigma * np.maximum(
            1.0 + values["by_signal"] * u + values["by_rate"] * v[:, None], 0.0
        )
    state = {"rng": rng.bit_generator.state, "strain": float(context.strain[-1])}
    return u + context.lsb * sigma * white, state


EFFECT = Effect(
    name="noise",
    stage="electrical",
    mechanism="random scatter of the reading, perhaps larger at some strains or in motion",
    equation="u + lsb sigma n; heteroscedastic: sigma (1 + b u + c |v|)",
    source="white Gaussian noise; the heteroscedastic form is a first-order expansion",
    fingerprint="variance only",
    parameters=(
        Parameter("level_lsb", "LSB", 0.2, 30.0, 1.0, "standard deviation"),
        Parameter("by_signal", "1", -0.9, 10.0, 0.0, "relative growth over full scale"),
        Parameter("by_rate", "s", 0.0, 10.0, 0.0, "relative growth per strain range per second"),
    ),
    simulate=simulate,
    forms=("white", "heteroscedastic"),
)
