"""Crosstalk: a channel hears another one."""

from __future__ import annotations

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

# The largest share of another channel that still goes by this name.
MOST = 0.25


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
    """A share of another channel, or of the two scanned before, as they really read or would
    without their effects; or a supply that sags, or lifts, with all channels together."""
    result = []
    channels = nominal.codes.shape[1]
    # What others really read would say all that channels have in common, were it not for the share.
    for codes, most in ((nominal.heard, MOST), (nominal.codes, np.inf)) if channels > 1 else ():
        for other in range(channels):
            if other != nominal.channel:
                source = {"source": float(other)}
                instead = codes[:, other] - nominal.u
                alone = codes[:, other] - nominal.reference.rest[other]
                result.append(Candidate(instead[:, None], source, largest=most))
                result.append(Candidate(alone[:, None], source, largest=most))
        if channels > 2:
            # The capacitor keeps some of the one before that, too.
            one, two = codes[:, nominal.channel - 1], codes[:, nominal.channel - 2]
            source = {"source": float((nominal.channel - 1) % channels)}
            both = np.stack([one - nominal.u, two - nominal.u], axis=1)
            result.append(Candidate(both, source, "scan", parallel=True, largest=most))
        own = codes[:, nominal.channel] - nominal.u
        together = codes.mean(axis=1) - own / channels
        result.append(Candidate((together - nominal.u)[:, None], {}, "supply", largest=most))
        sagging = nominal.u * together / nominal.full_scale
        result.append(Candidate(sagging[:, None], {}, "supply", largest=most))
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
    memoryless=True,
)
