"""Interference: mains hum and other tones, folded by the sampling."""

from __future__ import annotations

import numpy as np

from softsense.effects import Context, Effect, Floats, Parameter, State, Values


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + lsb A sin(2 pi f t + phase), sampled as it is: above half the rate it folds."""
    phase = 2.0 * np.pi * values["frequency_hz"] * context.time_s()[:, None] + values["phase_rad"]
    after: State = {}
    if form == "wandering":
        rng = context.generator(state)
        start = 0.0 if state is None else state["wander_rad"]
        size = values["wander"][0] * np.sqrt(context.dt_s)
        wander = start + np.cumsum(size * rng.standard_normal(len(u)))
        phase = phase + wander[:, None]
        after = {"rng": rng.bit_generator.state, "wander_rad": float(wander[-1])}
    tone = np.sin(phase)
    if form == "harmonics":
        tone = tone + values["harmonic"] * np.sin(3.0 * phase)
    return u + context.lsb * values["amplitude_lsb"] * tone, after


EFFECT = Effect(
    name="interference",
    stage="electrical",
    mechanism="mains hum or another tone couples into the wires",
    equation="u + lsb A sin(2 pi f t + p); harmonics: + h sin(3 (2 pi f t + p)); wandering: p a "
    "random walk",
    source="tone above half the sample rate folded by sampling",
    fingerprint="a line above the local floor of the spectrum",
    parameters=(
        Parameter("amplitude_lsb", "LSB", 0.5, 50.0, 5.0, "amplitude"),
        Parameter("frequency_hz", "Hz", 0.5, 500.0, 50.3, "frequency before sampling"),
        Parameter("phase_rad", "rad", 0.0, 6.283, 0.0, "phase at time 0"),
        Parameter("harmonic", "1", 0.0, 1.0, 0.3, "harmonics: share of the third"),
        Parameter("wander", "rad / sqrt(s)", 0.0, 1.0, 0.1, "wandering: growth of the phase"),
    ),
    simulate=simulate,
    forms=("tone", "harmonics", "wandering"),
)
