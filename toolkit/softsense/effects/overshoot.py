"""Overshoot: conductive paths break in motion, whichever way it goes, and form again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import at_own_pace, compiled, followed, low_pass, rate

TAUS_S = (0.002, 0.02, 0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 4.0)
LADDERS_S: tuple[tuple[float, ...], ...] = ((0.12, 0.5, 2.0), (0.05, 0.25, 1.0, 4.0))
# At which strain rates half of what there is breaks.
HALVES_PER_S = (0.03, 0.1, 0.3)
# Powers of the strain rate in that: with more than 1, little breaks at first.
HILL = (1.0, 2.0)
# Strain rates below which nothing breaks.
LEAST_PER_S = (0.02, 0.05, 0.1)
# What breaks sooner than it forms again: in which share of that time, by which powers of the strain
# rate, and how much of it on the way back.
QUICK = 0.25
QUICK_POWERS = (0.65, 0.9, 1.2)
BACK = (0.6, 1.0)
# A structure that moves break and rests rebuild: its times, and how much of it a move through the
# whole range breaks. Around one of those, closer.
REBUILDS_S = (0.3, 0.7, 1.5, 3.0)
BREAKS = (1.0, 3.0, 9.0)
# What the network takes to break, where that is not at once, and powers of the strain rate.
LATE_S = 0.16
LATE_POWERS = (0.75, 1.0, 1.4)
# Over which share of the range after a reversal more breaks than later.
REVERSALS = (0.05, 0.1, 0.2)
# How many times as much by a factor of e, per ranges per second, where currents tunnel.
TUNNELS_S = (1.0, 2.0, 4.0, 7.0)
# So many such factors at most, after which nothing is left to open.
OPEN = 6.0
# What goes with the strain rate and its sign, as a charge does: no overshoot, and offered only to
# be told from it.
SIGNED = "signed"
# A slower dashpot is what relaxes.
SLOWEST_DASHPOT_S = 1.5
# Powers of what shears, of which either way counts.
SHEARS = (1.0, 1.25, 1.5)
# Powers of the strain rate by which its fastest moment breaks.
PEAKS = (1.0, 0.8, 0.65)


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + A y (1 + b u), y = LP_tau(|v|), starting at rest."""
    speed = np.abs(rate(context.strain, context.dt_s, None if state is None else state["strain"]))
    speeds = np.broadcast_to(speed[:, None], u.shape)
    memory = None if state is None else state["memory"]
    broken, memory = low_pass(
        speeds, context.dt_s, values["tau_s"], memory, rest=np.zeros(u.shape[1])
    )
    result = u + values["amplitude"] * broken * (1.0 + values["by_signal"] * u)
    return result, {"memory": memory, "strain": float(context.strain[-1])}


def explain(nominal: Nominal) -> list[Candidate]:
    """Filtered magnitude of the strain rate, alone and times the signal: even in direction.

    Or more of one direction than of the other, but of one sign.
    """
    result = []
    for power in (0.5, 0.75, 1.0, 1.5):
        speed = partial(_to_the, nominal, power)
        result += _traces(nominal, speed, {"power": power}, TAUS_S, LADDERS_S)
    return result + _one_way(nominal, TAUS_S)


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """Around one time constant and power, or where more speed breaks less and less; or one way; or
    sooner than it forms again, from some strain rate on, or through which a current tunnels; what
    shears, and what the fastest moment or a reversal breaks."""
    ladders = () if "tau_s" in values else LADDERS_S
    # What a ladder says coarsely, one time between those of the grid may say better.
    near = (
        values["tau_s"] * np.geomspace(0.7, 1.4, 5)
        if "tau_s" in values
        else np.geomspace(0.1, 2.5, 9)
    ).tolist()
    if "breaks" in values:
        breaks = values["breaks"] * np.geomspace(0.6, 1.7, 5)
        return _structures(nominal, near, breaks.tolist())
    if "least_per_s" in values:
        return _beyond(nominal, near, values["least_per_s"] * np.geomspace(0.7, 1.4, 7))
    if "reversal" in values:
        return _at_reversals(nominal, near, values["reversal"] * np.geomspace(0.7, 1.4, 5))
    if "tunnels_s" in values:
        return _tunnelling(nominal, near, values["tunnels_s"] * np.geomspace(0.7, 1.4, 7))
    if "half_per_s" in values:
        halves = (values["half_per_s"] * np.geomspace(0.6, 1.7, 7)).tolist()
        return _levelled(nominal, near, halves)
    result = _quick(nominal, near[::2]) + _structures(nominal, REBUILDS_S, BREAKS)
    result += _late(nominal, near[::2]) + _beyond(nominal, near[::2], LEAST_PER_S)
    result += _tunnelling(nominal, near[::2], TUNNELS_S)
    result += _sheared(nominal, near) + _peaks(nominal, near)
    result += _at_reversals(nominal, near[::2], REVERSALS)
    if "power" not in values:
        # Once more of one direction, it may be more of one end of the range.
        speed = partial(_speed, nominal)
        result += _traces(nominal, speed, {"power": 1.0}, near[::2], LADDERS_S, within=True)
        return result + _one_way(nominal, near)
    for power in (values["power"] * np.array([0.85, 0.93, 1.0, 1.09, 1.2])).tolist():
        speed = partial(_to_the, nominal, power)
        for within in (False, True):
            result += _traces(nominal, speed, {"power": power}, near, ladders, within)
    return result + _levelled(nominal, near[::2], HALVES_PER_S)


def _speed(nominal: Nominal) -> Floats:
    """(samples,) size of the strain rate, per second."""
    return nominal.once("speed", lambda: np.abs(nominal.rate))


def _to_the(nominal: Nominal, power: float) -> Floats:
    powered: Floats = _speed(nominal) ** power
    return powered


def _levelled(
    nominal: Nominal, taus_s: Sequence[float], halves_per_s: Sequence[float]
) -> list[Candidate]:
    """0 … 1 of what more speed breaks less and less of, half of it at one speed; or little of it
    below, too (Hill, J. Physiol. 40, 1910)."""

    def levelling(half: float, order: float) -> Floats:
        speed = _speed(nominal) ** order
        level: Floats = speed / (speed + half**order)
        return level

    result = []
    for half in halves_per_s:
        for order in HILL:
            values = {"half_per_s": half} if order == 1.0 else {"half_per_s": half, "hill": order}
            speed = partial(levelling, half, order)
            result += _traces(nominal, speed, values, taus_s, ())
    return result


def _traces(
    nominal: Nominal,
    speed: Callable[[], Floats],
    values: Mapping[str, float],
    taus_s: Sequence[float],
    ladders: Sequence[Sequence[float]],
    within: bool = False,
    form: str = "",
) -> list[Candidate]:
    """What ``speed()`` (samples,) breaks, for one time constant or a ladder of them: a network that
    forms again at several rates.

    It shows the more, the larger the signal is; or ``within``: it breaks the more then.
    """

    # One candidate may be asked for alone, and several share these.
    @cache
    def breaking() -> Floats:
        fast = speed()
        return np.stack([fast, fast * nominal.share] if within else [fast], axis=1)

    @cache
    def part(tau_s: float) -> Floats:
        taus = np.full(2 if within else 1, tau_s)
        y = low_pass(breaking(), nominal.dt_s, taus, None)[0][nominal.keep] * nominal.span
        return y if within else _felt(nominal, y[:, 0])

    def several(taus: Sequence[float]) -> Floats:
        return np.concatenate([part(tau_s) for tau_s in taus], axis=1)

    alone = [Candidate(partial(part, tau), {"tau_s": tau, **values}, form) for tau in taus_s]
    return alone + [Candidate(partial(several, taus), values, form) for taus in ladders]


def _felt(nominal: Nominal, y: Floats) -> Floats:
    """(kept samples, 2) what is broken, and the same times the signal."""
    return np.stack([y, y * nominal.share[nominal.keep]], axis=1)


def _quick(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What breaks sooner than it forms again, and breaks less on the way back."""

    @cache
    def breaking(power: float, back: float) -> Floats:
        made: Floats = _to_the(nominal, power) * np.where(nominal.rate > 0.0, 1.0, back)
        return made

    def quick(power: float, back: float, tau_s: float) -> Floats:
        forming = nominal.dt_s / tau_s
        y = followed(breaking(power, back), forming / QUICK, forming, 0.0)
        return _felt(nominal, y[nominal.keep] * nominal.span)

    return [
        Candidate(
            partial(quick, power, back, tau_s),
            {"tau_s": tau_s, "power": power, "back": back},
            "quick",
        )
        for power in QUICK_POWERS
        for back in BACK
        for tau_s in taus_s
    ]


def _structures(
    nominal: Nominal, rebuilds_s: Sequence[float], breaks: Sequence[float]
) -> list[Candidate]:
    """What is broken of a structure: what breaks is a share of what still holds.

    Moore, Trans. Br. Ceram. Soc. 58 (1959): dx/dt = b |v| (1 - x) - x / tau.
    """

    def broken(tau_s: float, each: float) -> Floats:
        speed = _speed(nominal)
        pull = 1.0 / tau_s + each * speed
        share = at_own_pace(each * speed / pull, nominal.dt_s * pull)
        return _felt(nominal, share[nominal.keep] * nominal.span)

    return [
        Candidate(partial(broken, tau_s, each), {"tau_s": tau_s, "breaks": each}, "structure")
        for tau_s in rebuilds_s
        for each in breaks
    ]


def _beyond(
    nominal: Nominal, taus_s: Sequence[float], least_per_s: Iterable[float]
) -> list[Candidate]:
    """What breaks only where the strain rate is beyond a least one."""

    def beyond(least: float) -> Floats:
        return np.maximum(_speed(nominal) - least, 0.0)

    result = []
    for least in least_per_s:
        values = {"least_per_s": float(least)}
        result += _traces(nominal, partial(beyond, least), values, taus_s, ())
    return result


def _tunnelling(
    nominal: Nominal, taus_s: Sequence[float], tunnels_s: Iterable[float]
) -> list[Candidate]:
    """Where currents tunnel through what has opened: exponential in it (Simmons, J. Appl. Phys. 34,
    1963)."""

    @cache
    def opened(tau_s: float) -> Floats:
        y: Floats = low_pass(_speed(nominal)[:, None], nominal.dt_s, np.array([tau_s]), None)[0]
        return y[nominal.keep, 0]

    def through(tau_s: float, tunnels_s: float) -> Floats:
        more = np.minimum(tunnels_s * opened(tau_s), OPEN)
        return _felt(nominal, np.expm1(more) / tunnels_s * nominal.span)

    return [
        Candidate(partial(through, tau_s, each), {"tau_s": tau_s, "tunnels_s": each}, "tunnelling")
        for tau_s in taus_s
        for each in map(float, tunnels_s)
    ]


def _peaks(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What the fastest moment has broken, by a power of its speed, which forms again until a faster
    one."""

    def peaks(tau_s: float, power: float) -> Floats:
        y = _held(_speed(nominal) ** power, float(np.exp(-nominal.dt_s / tau_s)))
        return _felt(nominal, y[nominal.keep] * nominal.span)

    return [
        Candidate(
            partial(peaks, tau_s, power),
            {"tau_s": tau_s, "peaks": power} if power != 1.0 else {"tau_s": tau_s},
            "peaks",
        )
        for tau_s in taus_s
        for power in PEAKS
    ]


def _sheared(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What shears as far as a dashpot has not followed, and shows in some power of that."""
    ahead = cache(partial(_ahead, nominal))

    def sheared(tau_s: float, power: float) -> Floats:
        made: Floats = np.abs(ahead(tau_s))[:, None] ** power * nominal.span
        return made

    return [
        Candidate(partial(sheared, tau_s, power), {"tau_s": tau_s, "shears": power}, "sheared")
        for tau_s in taus_s
        for power in SHEARS
    ]


@compiled
def _held(speed: Floats, kept: float) -> Floats:
    """(samples,) ``speed``, or what was before if that is more, of which so much is ``kept``."""
    output = np.empty_like(speed)
    y = 0.0
    for k in range(len(speed)):
        y = max(speed[k], kept * y)
        output[k] = y
    return output


def _at_reversals(
    nominal: Nominal, taus_s: Sequence[float], reaches: Iterable[float]
) -> list[Candidate]:
    """What breaks as the strain turns round, and what breaks later."""

    @cache
    def since() -> Floats:
        gone: Floats = _since_reversal(nominal.strain)
        return gone

    def breaking(tau_s: float, reach: float) -> Floats:
        speed = _speed(nominal)
        both = np.stack([speed * np.exp(-since() / reach), speed], axis=1)
        y = low_pass(both, nominal.dt_s, np.full(2, tau_s), None)[0][nominal.keep] * nominal.span
        return np.concatenate([y[:, :1], _felt(nominal, y[:, 1])], axis=1)

    return [
        Candidate(partial(breaking, tau_s, reach), {"tau_s": tau_s, "reversal": reach}, "reversals")
        for tau_s in taus_s
        for reach in map(float, reaches)
    ]


@compiled
def _since_reversal(strain: Floats) -> Floats:
    """(samples,) way gone since the strain turned round."""
    output = np.zeros_like(strain)
    way = 0.0
    for k in range(1, len(strain)):
        move = strain[k] - strain[k - 1]
        gone = 0.0 if move * way < 0.0 else output[k - 1]
        output[k] = gone + abs(move)
        if move != 0.0:
            way = move
    return output


def _late(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What takes a while to break, too."""

    def late(power: float) -> Floats:
        speed = _to_the(nominal, power)[:, None]
        return low_pass(speed, nominal.dt_s, np.array([LATE_S]), None)[0][:, 0]

    result = []
    for power in LATE_POWERS:
        result += _traces(nominal, partial(late, power), {"power": power}, taus_s, (), form="late")
    return result


def _one_way(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """More of one direction than of the other: what each breaks, or what a dashpot does; and its
    force with its sign."""

    # One candidate may be asked for alone, and several share these.
    @cache
    def ways() -> Floats:
        return _ways(nominal.rate)

    @cache
    def sides(tau_s: float) -> Floats:
        y = low_pass(ways(), nominal.dt_s, np.full(2, tau_s), None, rest=np.zeros(2))[0]
        kept: Floats = y[nominal.keep] * nominal.span
        return kept

    def several(taus: Sequence[float]) -> Floats:
        return np.concatenate([sides(tau_s) for tau_s in taus], axis=1)

    @cache
    def force(tau_s: float) -> Floats:
        return _ahead(nominal, tau_s) * nominal.span

    def viscous(tau_s: float) -> Floats:
        return _ways(force(tau_s))

    def signed(tau_s: float) -> Floats:
        return force(tau_s)[:, None]

    result = [
        Candidate(partial(sides, tau_s), {"tau_s": tau_s}, "one_way", parallel=True)
        for tau_s in taus_s
    ]
    result += [
        Candidate(partial(several, taus), {}, "one_way", parallel=True) for taus in LADDERS_S
    ]
    for tau_s in taus_s:
        if tau_s <= SLOWEST_DASHPOT_S:
            values = {"tau_s": tau_s}
            result.append(Candidate(partial(viscous, tau_s), values, "viscous", parallel=True))
            # Of its own signal, that is a lag.
            if not nominal.itself:
                result.append(Candidate(partial(signed, tau_s), values, SIGNED))
    return result


def _ahead(nominal: Nominal, tau_s: float) -> Floats:
    """(kept samples,) what of the strain a dashpot has not followed yet."""
    behind = low_pass(nominal.strain[:, None], nominal.dt_s, np.array([tau_s]), None)[0][:, 0]
    ahead: Floats = (nominal.strain - behind)[nominal.keep]
    return ahead


def _ways(signal: Floats) -> Floats:
    """(samples, 2) its size where it is above 0, and where it is below."""
    return np.stack([np.maximum(signal, 0.0), np.maximum(-signal, 0.0)], axis=1)


EFFECT = Effect(
    name="overshoot",
    stage="material",
    mechanism="conductive paths break while the strain changes and form again at rest",
    equation="u + A y (1 + b u), tau dy/dt = |v| - y, v the strain rate",
    source="first-order breakdown and re-formation of the filler network, after the rate-dependent "
    "peaks that Thuruthel et al. (2021), Figs 3 and 6, show",
    fingerprint="even in the strain rate: a spike at fast moves in both directions",
    parameters=(
        Parameter("amplitude", "s * share of span", 0.005, 0.5, 0.05, "per strain range per s"),
        Parameter("tau_s", "s", 0.1, 5.0, 0.8, "time to form again"),
        Parameter("by_signal", "1", -1.0, 3.0, 0.0, "how much more at full strain than at rest"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    lasting=True,
    by_rate=True,
)
