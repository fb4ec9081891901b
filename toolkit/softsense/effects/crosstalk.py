"""Crosstalk: a channel hears another one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import low_pass, smooth_low_pass, spline_pieces

# The largest share of another channel that still goes by this name.
MOST = 0.25
# The same of what comes late, or through a capacitance within a few samples, else a delay would be
# some; and of what comes through one as it would without effects, which an amplifier may raise or
# turn over: all of that is little where its time constant is short.
MOST_LATE = 0.5
MOST_COUPLED = 3.0
# And of the others together where they pull down a reference.
MOST_PULLED = 0.5
# Time constants of the wire that a share comes through, and of the capacitor that lets only what is
# faster through: none takes longer, which a material does.
WIRES_S = (0.04, 0.08, 0.125, 0.2, 0.35)
CAPACITORS_S = (0.2, 0.5, 1.2)
# Through shorter ones comes next to nothing of slow moves, and of fast ones what these do between
# samples.
SHORT_S = (0.015, 0.04, 0.1)
# And those after which a sampling capacitor's dielectric gives back what it took.
DIELECTRICS_S = (0.4, 0.9, 2.0)


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
    without their effects; or what a capacitor held of it, a ground that one lifts, a return that
    all others go through, a supply that sags, or lifts, with all channels together, or a reference
    with the others. Or what of another channel comes through a capacitance, or from a dielectric.
    """
    channels = len(nominal.codes)
    result = _shares(nominal)
    for other in range(channels):
        if other != nominal.channel:
            result.extend(_filtered(nominal, other, WIRES_S, CAPACITORS_S))
            result.extend(_short(nominal, other, SHORT_S))
    return result + _sides(nominal, WIRES_S[::2]) + _absorbed(nominal, DIELECTRICS_S)


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """All that has no time constant; and around the one of a wire or a capacitor."""
    if "tau_s" not in values:
        return _shares(nominal)
    near, other = (values["tau_s"] * np.geomspace(0.6, 1.6, 7)).tolist(), int(values["source"])
    capacitors = [tau_s for tau_s in near if tau_s <= CAPACITORS_S[-1]]
    filtered = _filtered(nominal, other, near, capacitors)
    if values["tau_s"] <= SHORT_S[-1]:
        filtered += _short(nominal, other, near)
    return _shares(nominal) + filtered + _sides(nominal, near[::2]) + _absorbed(nominal, near[1::2])


def _shares(nominal: Nominal) -> list[Candidate]:
    result = []
    keep, channels = nominal.keep, len(nominal.codes)
    u, rest = nominal.u[keep], nominal.reference.rest
    at_rest = (nominal.rest - nominal.low) / nominal.span
    far = np.abs(u - nominal.rest) / nominal.span
    at, last = np.arange(len(nominal.u))[keep], len(nominal.u) - 1
    ahead, behind = np.minimum(at + 1, last), np.maximum(at - 1, 0)
    slopes = np.stack([codes[ahead] - codes[behind] for codes in nominal.codes], axis=1)
    slopes /= (ahead - behind)[:, None] * nominal.dt_s
    # What others really read would say all that channels have in common, were it not for the share.
    for whole, most in ((nominal.heard, MOST), (nominal.codes, np.inf)) if channels > 1 else ():
        codes = np.stack([one[keep] for one in whole], axis=1)
        for other in range(channels):
            if other != nominal.channel:
                source = {"source": float(other)}
                alone = codes[:, other] - rest[other]
                result.append(Candidate(alone[:, None], source, largest=most))
                # A capacitor that is emptied, or charged to the middle, between two channels.
                for zero in (0.0, 0.5 * nominal.full_scale):
                    held = codes[:, other] - zero
                    result.append(Candidate(held[:, None], source, "held", largest=most))
                # Other wires' current lifts the ground that they share, the less at the top.
                lifted = alone * (1.0 - u / nominal.full_scale)
                result.append(Candidate(lifted[:, None], source, "ground", largest=most))
                instead = codes[:, other] - u
                # The more, the higher its own resistance is.
                loaded = np.stack([instead, instead * nominal.share[keep]], axis=1)
                # Who set the zero with the share in place does not see it at rest.
                for zero in (0.0, rest[other] - rest[nominal.channel]):
                    result.append(Candidate((instead - zero)[:, None], source, largest=most))
                    zeroed = loaded - zero * np.array([1.0, at_rest])
                    result.append(Candidate(zeroed, source, "loaded", curved=True, largest=most))
                # Nor where it is a share of how far both have moved, more where its own has moved.
                moved = instead - rest[other] + rest[nominal.channel]
                more = np.stack([moved, moved * far], axis=1)
                result.append(Candidate(more, source, "loaded", positive=True, largest=most))
                # And what a capacitance beside the resistance lets through.
                both = np.stack([alone, slopes[:, other]], axis=1)
                result.append(Candidate(both, source, "capacitive", positive=True, largest=most))
        if channels > 2:
            # The sampling capacitor keeps some of the one before that, too.
            scanned = [(nominal.channel - k) % channels for k in (1, 2)]
            source = {"source": float(scanned[0])}
            both = codes[:, scanned] - u[:, None]
            for zeros in (np.zeros(2), rest[scanned] - rest[nominal.channel]):
                kept = both - zeros
                result.append(Candidate(kept, source, "scan", parallel=True, largest=most))
            # Or it takes less of the channel's own than it brings of the one before.
            brought = codes[:, scanned[0]] - rest[scanned[0]]
            less = np.stack([brought, brought - (u - nominal.rest)], axis=1)
            result.append(Candidate(less, source, "sharing", positive=True, largest=most))
            # On a connector both neighbours leak, unequally.
            beside = [scanned[0], (nominal.channel + 1) % channels]
            sides = codes[:, beside] - rest[beside]
            result.append(Candidate(sides, source, "sides", positive=True, largest=most))
        own = codes[:, nominal.channel] - u
        together = codes.mean(axis=1) - own / channels
        result.append(Candidate((together - u)[:, None], {}, "supply", largest=most))
        sagging = u * together / nominal.full_scale
        result.append(Candidate(sagging[:, None], {}, "supply", largest=most))
        # A reference that every other one pulls from where it was at rest, or a lead that the
        # currents of all the others go through.
        pulls = np.delete(codes - rest, nominal.channel, axis=1)
        pulled = min(most, MOST_PULLED)
        if channels > 2:
            result.append(Candidate(pulls.mean(axis=1)[:, None], {}, "return", largest=pulled))
            if most > MOST:
                # What all have in common as they really read would be said by any of them.
                result.append(Candidate(pulls, {}, "return", parallel=True, largest=most))
        others = u * pulls.sum(axis=1) / nominal.full_scale
        result.append(Candidate(others[:, None], {}, "reference", largest=pulled))
    return result


def _sides(nominal: Nominal, times_s: Sequence[float]) -> list[Candidate]:
    """What leaks from both neighbours, late from one of them."""
    channels = len(nominal.codes)
    if channels < 3:
        return []
    two = [(nominal.channel - 1) % channels, (nominal.channel + 1) % channels]

    def leaking(late: int, tau_s: float) -> Floats:
        columns = []
        for other in two:
            signal = (nominal.codes[other] - nominal.reference.rest[other])[:, None]
            there = _slow(nominal, signal, tau_s) if other == late else signal[nominal.keep]
            columns.append(there)
        return np.concatenate(columns, axis=1)

    return [
        Candidate(
            partial(leaking, late, tau_s),
            {"source": float(late), "tau_s": tau_s},
            "sides",
            positive=True,
            largest=MOST_LATE,
        )
        for late in two
        for tau_s in times_s
    ]


def _absorbed(nominal: Nominal, times_s: Sequence[float]) -> list[Candidate]:
    """What a sampling capacitor keeps of the channel scanned before, and what its dielectric gives
    back later (dielectric absorption)."""
    channels = len(nominal.codes)
    if channels < 2:
        return []
    before = (nominal.channel - 1) % channels
    would = nominal.codes[before][:, None]
    apart = float(nominal.reference.rest[before] - nominal.reference.rest[nominal.channel])

    # Both zeros ask for it.
    back = cache(partial(_slow, nominal, would))

    def kept(tau_s: float, zero: float) -> Floats:
        both = np.concatenate([would[nominal.keep], back(tau_s)], axis=1)
        return np.asarray(both - nominal.u[nominal.keep, None] - zero)

    return [
        Candidate(
            partial(kept, tau_s, zero),
            {"source": float(before), "tau_s": tau_s},
            "absorbing",
            positive=True,
            largest=MOST_LATE,
        )
        for tau_s in times_s
        for zero in (0.0, apart)
    ]


def _filtered(
    nominal: Nominal, other: int, wires_s: Sequence[float], capacitors_s: Sequence[float]
) -> list[Candidate]:
    """What of another channel comes late, through the wire's capacitance, instead of its own; and
    what comes through the capacitance between two wires, beside its own."""
    if other == nominal.channel:
        # Near what another channel hears of this one.
        return []
    keep = nominal.keep
    would, really = nominal.codes[other][:, None], nominal.heard[other][:, None]

    def late(tau_s: float) -> Floats:
        return _slow(nominal, would, tau_s) - nominal.u[keep, None]

    def fast(signal: Floats, tau_s: float) -> Floats:
        return signal[keep] - _slow(nominal, signal, tau_s)

    result = []
    for tau_s in wires_s:
        values = {"source": float(other), "tau_s": tau_s}
        made = partial(late, tau_s)
        result.append(Candidate(made, values, "late", largest=MOST_LATE, positive=True))
    for tau_s in capacitors_s:
        values = {"source": float(other), "tau_s": tau_s}
        # A tone that all hear has another phase on each: much of what others really read says it.
        for signal, most in ((really, MOST), (would, MOST_COUPLED)):
            made = partial(fast, signal, tau_s)
            result.append(Candidate(made, values, "coupled", largest=most))
    return result


def _short(nominal: Nominal, other: int, times_s: Sequence[float]) -> list[Candidate]:
    """What comes through the capacitance between two wires within a few samples, of a signal that
    is smooth in between."""
    if other == nominal.channel:
        return []
    would, keep = nominal.codes[other], nominal.keep

    def fast(tau_s: float) -> Floats:
        pieces = nominal.once_of(other, "smooth pieces", spline_pieces)
        return np.asarray((would - smooth_low_pass(pieces, nominal.dt_s, tau_s))[keep, None])

    return [
        Candidate(
            partial(fast, tau_s),
            {"source": float(other), "tau_s": tau_s},
            "brief",
            largest=MOST_LATE,
            positive=True,
        )
        for tau_s in times_s
    ]


def _slow(nominal: Nominal, signal: Floats, tau_s: float) -> Floats:
    """(kept samples, 1) of a ``signal`` (samples, 1) behind one time constant."""
    return low_pass(signal, nominal.dt_s, np.array([tau_s]), None)[0][nominal.keep]


EFFECT = Effect(
    name="crosstalk",
    stage="electrical",
    mechanism="the sampling capacitor keeps part of the channel before; channels share a supply or "
    "a ground; or wires couple through a capacitance",
    equation="scan: u_i + A (u_j - u_i), j the channel scanned before; supply: u_i (1 - A mean u)",
    source="incomplete RC settling of a multiplexed converter: A = exp(-t_sample / (R C)); "
    "dielectric absorption: Dow, IRE Trans. Electron. Comput. EC-7 (1958)",
    fingerprint="follows another channel, one way only: in the order of the scan, or late, or only "
    "its fast part",
    parameters=(
        Parameter("amplitude", "1", 0.002, 0.2, 0.03, "share of the other channel"),
        Parameter("source", "channel", -1.0, 63.0, -1.0, "channel heard; -1: the one before"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("scan", "supply"),
    exact=True,
)
