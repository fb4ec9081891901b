"""Spikes: a loose contact, a switching load."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from softsense.effects import Context, Effect, Floats, Parameter, State, Values


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + impulses at Poisson times, of either sign, each decaying exponentially."""
    rng = context.generator(state)
    # One draw for when, size and sign, sample by sample, so that a cut changes nothing.
    drawn = rng.random((*u.shape, 3))
    hit = drawn[..., 0] < -np.expm1(-values["rate_hz"] * context.dt_s)
    sign = np.where(drawn[..., 2] < 0.5, -1.0, 1.0)
    size = -np.log1p(-drawn[..., 1]) * sign
    if form == "positive":
        size = np.abs(size)
    impulses = context.lsb * values["amplitude_lsb"] * np.where(hit, size, 0.0)
    result = u.copy()
    last = np.zeros(u.shape[1]) if state is None else state["last"]
    ends = np.empty(u.shape[1])
    for channel, tau in enumerate(values["decay_s"]):
        keep = float(np.exp(-context.dt_s / tau)) if tau > 0 else 0.0
        zi = [keep * last[channel]]
        pulses = lfilter([1.0], [1.0, -keep], impulses[:, channel], zi=zi)[0]
        result[:, channel] += pulses
        ends[channel] = pulses[-1]
    return result, {"rng": rng.bit_generator.state, "last": ends}


EFFECT = Effect(
    name="spikes",
    stage="electrical",
    mechanism="a loose contact or a switching load throws single readings off",
    equation="u + lsb A sum_k e_k exp(-(t - t_k)/tau), t_k Poisson, e_k exponential with random "
    "sign (positive: without)",
    source="filtered Poisson process (shot noise)",
    fingerprint="sparse, without a mean",
    parameters=(
        Parameter("rate_hz", "1/s", 0.005, 1.0, 0.05, "spikes per second"),
        Parameter("amplitude_lsb", "LSB", 5.0, 500.0, 50.0, "mean size"),
        Parameter("decay_s", "s", 0.0, 1.0, 0.05, "decay"),
    ),
    simulate=simulate,
    forms=("either_sign", "positive"),
)
