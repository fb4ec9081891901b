"""Viscoelastic relaxation: stress that a step of strain leaves behind decays in a hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import at_own_pace, compiled, followed, low_pass

# The largest share that one part of a material relaxes; what follows as a whole is a circuit.
MOST = 0.7
# The same for a part beside others: all parts of a fractional element together relax more than 1.
# Those that take no longer than a circuit may count as one part; where there are none, each of a
# curve may be more than the whole, beside what bends the other way.
MOST_OF_SEVERAL = 0.95
MOST_OF_SLOW = 1.2
CIRCUIT_S = 0.3
# Poles that stand for a fractional element, two per decade below its longest time.
_POWER_POLES = 6
_POWER_RATIO = 10.0**0.5
# Time constants of a diagnosis, and how far a curved elastic response is off a straight one.
LADDERS = (
    (1.0, 10.0, 100.0),
    (0.6, 3.0, 15.0, 75.0),
    (0.6, 1.5, 4.0, 12.0, 36.0, 120.0),
    (0.2, 0.8, 3.0, 12.0, 50.0, 200.0, 800.0),
    (0.05, 0.15, 0.5, 1.5, 5.0, 20.0, 80.0, 400.0),
)
# What takes so many times as long as the recording is a scale: that of a simulator which was fitted
# while its sensors had relaxed in part, and so the other way.
FITTED = (0.6, 3.0, 15.0, 75.0, 375.0)
STAYS = 20.0
# Of a recording that is so many times as long as the slowest of these, one that goes on to its end.
LONGER = 2.0
LONG_STEP = 4.0
# Time constants of one part alone, where the signal is right at once.
SLOW_S = (10.0, 20.0, 40.0, 80.0, 160.0)
BENDS = (-1.4, -0.5, 0.3, 0.6, 1.2, 2.0)
# Time constants of a rising signal, and how many times as long a falling one takes.
PACES_S = (2.0, 4.0, 8.0, 16.0, 32.0)
RECOVERIES = (0.4, 0.6, 1.7, 2.5)
# How much faster it relaxes at full signal than at none, as powers of e; and where as stated.
MIDDLE = 0.5
HASTES = (-2.0, -1.0, 1.0, 2.0)
# Around one of these; and how much more of it relaxes at full signal than at none.
HASTES_NEAR = (-0.5, 0.0, 0.5)
GROWTHS = (-0.4, 0.0, 0.4, 0.8)
# Or how far what drives it bends upwards.
LOADS = (0.5, 1.0, 1.6)
# Time constants of a dashpot that gives way by activation, and how far of the range it is stretched
# where it does so much faster.
GIVES_S = (3.0, 10.0, 30.0)
ACTIVATED = (0.06, 0.12, 0.25)
# How long a pressure of the whole range seeps away.
SEEPS_S = (4.0, 6.5, 10.0, 16.0, 26.0, 42.0, 70.0, 110.0)
# Time constants that a simulator has and that are in truth, where its own are wrong, and how many
# places apart they are.
RETIMED_S = tuple(0.6 * 1.5**k for k in range(15))
APART = (1, 2, 3, 4, 6)


def ladder(values: Values, form: str) -> tuple[Floats, Floats]:
    """Weights and time constants, (channels, poles) each, of a Prony series.

    ``power_law``: poles tau_s / sqrt(10)^j with weights proportional to tau^-exponent, which is
    t^-exponent over the decades that the poles span; the weights sum to ``amplitude``.
    """
    amplitude, tau = values["amplitude"], values["tau_s"]
    if form == "prony":
        weights = amplitude if amplitude.ndim == 2 else amplitude[:, None]
        times = tau if tau.ndim == 2 else tau[:, None]
        shape = np.broadcast_shapes(weights.shape, times.shape)
        return np.broadcast_to(weights, shape), np.broadcast_to(times, shape)
    times = tau[:, None] / _POWER_RATIO ** np.arange(_POWER_POLES)
    weights = times ** -values["exponent"][:, None]
    return amplitude[:, None] * weights / weights.sum(axis=1, keepdims=True), times


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + sum_i g_i (u - LP_tau_i u), settled at the first sample."""
    weights, times = ladder(values, form)
    result = u.copy()
    memories = []
    for pole in range(weights.shape[1]):
        memory = None if state is None else state["memory"][pole]
        slow, memory = low_pass(u, context.dt_s, times[:, pole], memory)
        result += weights[:, pole] * (u - slow)
        memories.append(memory)
    return result, {"memory": np.stack(memories)}


def explain(nominal: Nominal) -> list[Candidate]:
    """A ladder of relaxing parts of the signal (Prony), dense enough for a power law."""
    singles = _singles(nominal, np.geomspace(0.6, 150.0, 16))
    return singles + [
        _prony(partial(_relaxed, nominal, nominal.u, taus), "prony", taus)
        for taus in _ladders(nominal)
    ]


def _ladders(nominal: Nominal) -> tuple[tuple[float, ...], ...]:
    """``LADDERS``, one with a scale besides, and for a long recording one more."""
    slowest, duration_s = max(map(max, LADDERS)), nominal.reference.duration_s
    ladders = (*LADDERS, _fitted(nominal))
    if duration_s < LONGER * slowest:
        return ladders
    count = int(np.ceil(np.log(duration_s / LADDERS[0][0]) / np.log(LONG_STEP)))
    return (*ladders, tuple((duration_s / LONG_STEP ** np.arange(count)[::-1]).tolist()))


def _fitted(nominal: Nominal) -> tuple[float, ...]:
    """A ladder whose last part is a scale."""
    return (*FITTED, STAYS * nominal.reference.duration_s)


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """Around one time constant; and the ladders, also of a curve of the signal (Fung: what is
    stretched further relaxes more than in proportion), where the signal is right at once, and where
    what is stretched further relaxes faster; a part that relaxes at another pace than it recovers,
    or than the simulator has it; one that relaxes the faster, the further it has to go,
    or seeps out; and what a load relaxes that is no line of the signal."""
    if "activated" in values:
        times_s, bends = (values[key] * np.geomspace(0.6, 1.7, 5) for key in ("tau_s", "activated"))
        return _activated(nominal, times_s.tolist(), bends.tolist())
    if "seeps_s" in values:
        return _seeping(nominal, (values["seeps_s"] * np.geomspace(0.6, 1.7, 9)).tolist())
    if "haste" in values:
        return [
            _prony(partial(_hasty, nominal, haste, taus, grows), "hasty", taus, values)
            for haste in values["haste"] + np.array(HASTES_NEAR)
            for grows in GROWTHS
            for values in [{"haste": haste, "grows": grows} if grows else {"haste": haste}]
            for taus in (*LADDERS[1:3], _fitted(nominal))
        ] + _loaded(nominal, values["haste"] + np.array(HASTES_NEAR))
    if "recovers" in values:
        around = np.geomspace(0.6, 1.7, 7)
        paces_s, times = values["rising_s"] * around, values["recovers"] * around
        return _uneven(nominal, paces_s.tolist(), times.tolist())
    near = values["tau_s"] * np.geomspace(0.75, 1.33, 5) if "tau_s" in values else np.zeros(0)

    # One candidate may be asked for alone, and two share what is relaxed.
    curved = cache(partial(_curved, nominal))

    @cache
    def relaxed(bend: float, taus: tuple[float, ...]) -> Floats:
        return _relaxed(nominal, curved(bend), taus)

    def at_once(bend: float, taus: tuple[float, ...]) -> Floats:
        signal = curved(bend)
        whole: Floats = relaxed(bend, taus) + (signal - signal[0])[nominal.keep, None]
        return whole

    result = _singles(nominal, near) + _uneven(nominal, PACES_S, RECOVERIES)
    result += _retimed(nominal, values)
    result += _activated(nominal, GIVES_S, ACTIVATED) + _seeping(nominal, SEEPS_S)
    result += [
        _prony(partial(_hasty, nominal, haste, taus), "hasty", taus, {"haste": haste})
        for haste in HASTES
        for taus in (*LADDERS[1:3], _fitted(nominal))
    ]
    result += _loaded(nominal, HASTES)
    result += [_prony(partial(relaxed, 0.0, taus), "prony", taus) for taus in _ladders(nominal)]
    for bend in (0.0, *BENDS):
        for taus in LADDERS[1:3]:
            if bend:
                result.append(_prony(partial(relaxed, bend, taus), "curved", taus))
            result.append(_prony(partial(at_once, bend, taus), "instant", taus))
    return result + [_prony(partial(at_once, 0.0, (tau,)), "instant", (tau,)) for tau in SLOW_S]


def _singles(nominal: Nominal, taus: Floats) -> list[Candidate]:
    return [
        Candidate(
            partial(_relaxed, nominal, nominal.u, (tau,)), {"tau_s": tau}, "prony", largest=MOST
        )
        for tau in taus.tolist()
    ]


def _loaded(nominal: Nominal, hastes: Iterable[float]) -> list[Candidate]:
    """What is hasty under a load that grows more than in proportion."""
    return [
        _prony(
            partial(_hasty, nominal, haste, LADDERS[2], load=load),
            "hasty",
            LADDERS[2],
            {"haste": float(haste), "load": load},
        )
        for haste in hastes
        for load in LOADS
    ]


def _curved(nominal: Nominal, bend: float) -> Floats:
    """(samples,) the signal, over the same span, where it is bent so far."""
    share = np.expm1(bend * nominal.share) / np.expm1(bend) if bend else nominal.share
    curved: Floats = share * nominal.span
    return curved


def _uneven(
    nominal: Nominal, rising_s: Sequence[float], recovers: Sequence[float]
) -> list[Candidate]:
    """What relaxes in ``rising_s``, and takes so many times as long where it ``recovers``."""
    result = []
    for pace_s in rising_s:
        for times in recovers:
            values = {"rising_s": pace_s, "recovers": times}
            made = partial(_at_two_paces, nominal, pace_s, pace_s * times)
            result.append(Candidate(made, values, "uneven", largest=MOST))
    return result


def _at_two_paces(nominal: Nominal, rising_s: float, falling_s: float) -> Floats:
    slow = followed(nominal.u, nominal.dt_s / rising_s, nominal.dt_s / falling_s, nominal.u[0])
    column: Floats = (slow - nominal.u)[nominal.keep, None].copy()
    return column


def _activated(
    nominal: Nominal, times_s: Sequence[float], bends: Sequence[float]
) -> list[Candidate]:
    """A part of the signal, or of the strain, behind a dashpot that flows by activation: Eyring,
    J. Chem. Phys. 4 (1936); Halsey, White and Eyring, Text. Res. J. 15 (1945)."""

    def behind(signal: Floats, tau_s: float, bend: float) -> Floats:
        column: Floats = -nominal.span * _flowing(signal, nominal.dt_s / tau_s, bend)
        return column[nominal.keep, None]

    return [
        Candidate(
            partial(behind, signal, tau_s, bend),
            {"tau_s": tau_s, "activated": bend},
            "activated",
            largest=MOST,
        )
        for signal in (nominal.share, nominal.strain)
        for tau_s in times_s
        for bend in bends
    ]


def _seeping(nominal: Nominal, seeps_s: Sequence[float]) -> list[Candidate]:
    """Air that seeps through a pinhole as the root of its pressure (Torricelli)."""

    def behind(signal: Floats, time_s: float) -> Floats:
        column: Floats = -nominal.span * _seeped(signal, nominal.dt_s / time_s)
        return column[nominal.keep, None]

    return [
        Candidate(partial(behind, signal, time_s), {"seeps_s": time_s}, "seeping", largest=MOST)
        for signal in (nominal.share, nominal.strain)
        for time_s in seeps_s
    ]


@compiled
def _seeped(signal: Floats, falls: float) -> Floats:
    """(samples,) how far ``signal`` is ahead, whose root ``falls`` so much in a sample of rest."""
    output = np.zeros_like(signal)
    ahead = 0.0
    for k in range(1, len(signal)):
        ahead += signal[k] - signal[k - 1]
        root = max(np.sqrt(abs(ahead)) - falls, 0.0)
        ahead = root * root if ahead > 0.0 else -root * root
        output[k] = ahead
    return output


def _flowing(signal: Floats, pull: float, bend: float) -> Floats:
    """(samples,) how far ``signal`` u is ahead: ds = du - pull bend sinh(s / bend) per sample,
    exact while it rests."""
    pushes = np.tanh(0.5 * np.diff(signal, prepend=signal[0]) / bend)
    ahead: Floats = 2.0 * bend * np.arctanh(_given_way(pushes, float(np.exp(-pull))))
    return ahead


@compiled
def _given_way(pushes: Floats, kept: float) -> Floats:
    """(samples,) tanh(s / (2 bend)), of which so much is ``kept`` from sample to sample; ``pushes``
    are the same of du alone."""
    output = np.empty_like(pushes)
    y = 0.0
    for k in range(len(pushes)):
        y = kept * (y + pushes[k]) / (1.0 + y * pushes[k])
        output[k] = y
    return output


def _hasty(
    nominal: Nominal, haste: float, taus: Sequence[float], grows: float = 0.0, load: float = 0.0
) -> Floats:
    """(kept samples, time constants) of parts that relax the faster, the larger the signal is, and
    weigh the more (``grows``), or of a ``load`` that grows more than in proportion to it.

    Schapery, Polym. Eng. Sci. 9 (1969): time goes by the faster, the more a material is stressed.
    """
    faster = np.exp(haste * (nominal.share - MIDDLE))
    signal = _curved(nominal, load) if load else nominal.u
    parts = [
        at_own_pace(signal, nominal.dt_s / tau * faster)[nominal.keep] - signal[nominal.keep]
        for tau in taus
    ]
    weight = 1.0 + grows * (nominal.share[nominal.keep] - MIDDLE)
    return np.stack(parts, axis=1) * weight[:, None]


def _retimed(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """A part that the simulator relaxes at ``was_s``, and that does so at ``tau_s``."""
    if "was_s" in values:
        around = np.geomspace(0.8, 1.25, 5)
        taus = [(was, tau) for was in values["was_s"] * around for tau in values["tau_s"] * around]
    else:
        taus = [
            (RETIMED_S[k], RETIMED_S[k + apart])
            for apart in APART
            for k in range(len(RETIMED_S) - apart)
        ]

    @cache
    def slow(tau_s: float) -> Floats:
        return low_pass(nominal.u[:, None], nominal.dt_s, np.array([tau_s]), None)[0][nominal.keep]

    def between(was_s: float, tau_s: float) -> Floats:
        column: Floats = slow(tau_s) - slow(was_s)
        return column

    return [
        Candidate(partial(between, was, tau), {"tau_s": tau, "was_s": was}, "retimed", largest=MOST)
        for was, tau in taus
    ]


def _prony(
    made: Callable[[], Floats],
    form: str,
    taus: Sequence[float],
    values: Mapping[str, float] | None = None,
) -> Candidate:
    quick = sum(tau < CIRCUIT_S for tau in taus)
    most = MOST_OF_SEVERAL if quick or form == "prony" else MOST_OF_SLOW
    return Candidate(
        made,
        values or {},
        form,
        parallel=True,
        largest=most,
        alone=MOST,
        quick=quick,
        opposed=taus[:-1] == FITTED,
    )


def _relaxed(nominal: Nominal, signal: Floats, taus: Sequence[float]) -> Floats:
    """(kept samples, time constants) what of the signal decays while it is held."""
    kept = signal[nominal.keep]
    # Each column in one piece of memory.
    parts = np.empty((len(taus), len(kept))).T
    for part, tau in zip(parts.T, taus, strict=True):
        slow = low_pass(signal[:, None], nominal.dt_s, np.array([tau]), None)[0]
        np.subtract(slow[nominal.keep, 0], kept, out=part)
    return parts


EFFECT = Effect(
    name="relaxation",
    stage="material",
    mechanism="viscoelastic stress: what a fast change adds decays while the strain is held",
    equation="u + sum_i g_i (u - y_i), tau_i dy_i/dt = u - y_i; power_law: g_i ~ tau_i^-a",
    source="generalised Maxwell (Prony) model: Ferry, Viscoelastic Properties of Polymers (1980); "
    "Eyring, J. Chem. Phys. 4 (1936); "
    "ladder of a fractional element: Schiessel and Blumen, J. Phys. A 26 (1993)",
    fingerprint="decays in holds, signed, linear in the signal",
    parameters=(
        Parameter("amplitude", "share of span", 0.01, 0.5, 0.1, "share that relaxes, per pole"),
        Parameter("tau_s", "s", 0.2, 200.0, 5.0, "time constant (power law: the longest)"),
        Parameter("exponent", "1", 0.1, 0.7, 0.3, "power law only: decay as t^-exponent"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("prony", "power_law"),
    lasting=True,
    broad=True,
)
