"""Crosstalk: a channel hears another one."""

from __future__ import annotations

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

# Shares at which a chain of channels that hear each other is looked at, and its length.
CHAINED = (0.06, 0.15, 0.3)
REACH = 3


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u_i + A (u_j - u_i) from channel j, or u_i (1 - A (mean of all u)) through the supply."""
    amplitude = values["amplitude"]
    if form == "supply":
        return u * (1.0 - amplitude * u.mean(axis=1, keepdims=True)), {}
    channels = u.shape[1]
    last = u[0] if state is None else state["last"]
    result = u.copy()
    for channel in range(channels):
        source = int(values["source"][channel])
        if source < 0:
            source = channel - 1 if channel else channels - 1
        heard = u[:, source]
        # A channel that is scanned later was sampled in the scan before.
        if source >= channel:
            heard = np.concatenate([[last[source]], heard[:-1]])
        result[:, channel] += amplitude[channel] * (heard - u[:, channel])
    return result, {"last": u[-1].copy()}


def explain(nominal: Nominal) -> list[Candidate]:
    """A share of another channel in place of its own."""
    result = []
    channels = nominal.codes.shape[1]
    for amplitude in CHAINED if channels >= REACH else ():
        # The capacitor keeps what it had, with what that had kept of the channels before.
        heard = nominal.codes[:, nominal.channel - REACH]
        for back in range(REACH - 1, 0, -1):
            own = nominal.codes[:, nominal.channel - back]
            heard = own + amplitude * (heard - own)
        source = float((nominal.channel - 1) % channels)
        result.append(Candidate((heard - nominal.u)[:, None], {"source": source}))
    for other in range(channels):
        if other != nominal.channel:
            column = (nominal.codes[:, other] - nominal.u)[:, None]
            result.append(Candidate(column, {"source": float(other)}))
            alone = nominal.codes[:, other] - nominal.reference.rest[other]
            result.append(Candidate(alone[:, None], {"source": float(other)}))
    if channels > 1:
        # A shared supply sags, or lifts, with all channels together.
        together = nominal.codes.mean(axis=1)
        result.append(Candidate((together - nominal.u)[:, None], {}, "supply"))
        sagging = nominal.u * together / nominal.full_scale
        result.append(Candidate(sagging[:, None], {}, "supply"))
    return result


EFFECT = Effect(
    name="crosstalk",
    stage="electrical",
    mechanism="the sampling capacitor keeps part of the channel before; or channels share a supply",
    equation="scan: u_i + A (u_j - u_i), j the channel scanned before; supply: u_i (1 - A mean u)",
    source="incomplete RC settling of a multiplexed converter: A = exp(-t_sample / (R C))",
    fingerprint="follows another channel, one way only, in the order of the scan",
    parameters=(
        Parameter("amplitude", "1", 0.002, 0.2, 0.03, "share of the other channel"),
        Parameter("source", "channel", -1.0, 63.0, -1.0, "channel heard; -1: the one before"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("scan", "supply"),
    exact=True,
)
