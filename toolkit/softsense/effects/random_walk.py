"""Slow wander without a known cause."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from softsense.effects import REFERENCE_S, Context, Effect, Floats, Parameter, State, Values

# One Ornstein-Uhlenbeck process per octave makes 1/f noise over that many octaves.
_OCTAVES = 8


def _wander(steps: Floats, keep: Floats, start: Floats) -> Floats:
    """w[k] = keep w[k-1] + steps[k] along axis 0; ``keep``, ``start``: (columns,)."""
    result = np.empty_like(steps)
    for column in range(steps.shape[1]):
        zi = [keep[column] * start[column]]
        result[:, column] = lfilter([1.0], [1.0, -keep[column]], steps[:, column], zi=zi)[0]
    return result


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + w, w started at 0 (walk) or within its stationary distribution (the others)."""
    samples, channels = u.shape
    rng = context.generator(state)
    amplitude, tau = values["amplitude"], values["tau_s"]
    parts = _OCTAVES if form == "flicker" else 1
    if form == "walk":
        keep = np.ones(channels)
        size = amplitude * np.sqrt(context.dt_s / REFERENCE_S)
    else:
        times = (tau[:, None] / 2.0 ** np.arange(parts)).ravel()
        keep = np.exp(-context.dt_s / times)
        size = np.repeat(amplitude, parts) * np.sqrt((1.0 - keep**2) / parts)
    if state is None:
        w = np.zeros(channels) if form == "walk" else rng.standard_normal(keep.size)
        if form != "walk":
            w = w * np.repeat(amplitude, parts) / np.sqrt(parts)
    else:
        w = state["w"]
    wandered = _wander(size * rng.standard_normal((samples, keep.size)), keep, w)
    total = wandered.reshape(samples, channels, parts).sum(axis=2)
    return u + total, {"rng": rng.bit_generator.state, "w": wandered[-1].copy()}


EFFECT = Effect(
    name="random_walk",
    stage="material",
    mechanism="slow wander without a known cause",
    equation="u + w; walk: dw = A dB / sqrt(400 s); ornstein_uhlenbeck: dw = -w dt/tau + "
    "A sqrt(2/tau) dB; flicker: sum of 8 of these, an octave apart below tau",
    source="Uhlenbeck and Ornstein, Phys. Rev. 36 (1930)",
    fingerprint="slow, follows nothing that was recorded",
    parameters=(
        Parameter("amplitude", "share of span", 0.002, 0.1, 0.02, "deviation (walk: after 400 s)"),
        Parameter("tau_s", "s", 10.0, 1000.0, 100.0, "correlation time (not for walk)"),
    ),
    simulate=simulate,
    forms=("walk", "ornstein_uhlenbeck", "flicker"),
)
