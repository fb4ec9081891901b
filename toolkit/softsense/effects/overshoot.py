"""Overshoot: conductive paths break in motion, whichever way it goes, and form again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import at_own_pace, followed, low_pass, rate

TAUS_S = (0.002, 0.02, 0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 4.0)
LADDERS_S: tuple[tuple[float, ...], ...] = ((0.12, 0.5, 2.0), (0.05, 0.25, 1.0, 4.0))
# At which strain rates half of what there is breaks.
HALVES_PER_S = (0.03, 0.1, 0.3)
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
# What goes with the strain rate and its sign, as a charge does: no overshoot, and offered only to
# be told from it.
SIGNED = "signed"
# A slower dashpot is what relaxes.
SLOWEST_DASHPOT_S = 1.5


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
        speed = np.abs(nominal.rate) ** power
        result += _traces(nominal, speed, {"power": power}, TAUS_S, LADDERS_S)
    return result + _one_way(nominal, TAUS_S)


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """Around one time constant and power, or where more speed breaks less and less; or one way; or
    sooner than it forms again, or from some strain rate on."""
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
    result = _quick(nominal, near[::2]) + _structures(nominal, REBUILDS_S, BREAKS)
    result += _late(nominal, near[::2]) + _beyond(nominal, near[::2], LEAST_PER_S)
    if "power" not in values:
        # Once more of one direction, it may be more of one end of the range.
        speed = np.abs(nominal.rate)
        result += _traces(nominal, speed, {"power": 1.0}, near[::2], LADDERS_S, within=True)
        return result + _one_way(nominal, near)
    for power in values["power"] * np.array([0.85, 1.0, 1.2]):
        speed = np.abs(nominal.rate) ** power
        for within in (False, True):
            result += _traces(nominal, speed, {"power": float(power)}, near[::2], ladders, within)
    for half in HALVES_PER_S:
        speed = np.abs(nominal.rate) / (np.abs(nominal.rate) + half)
        result += _traces(nominal, speed, {"half_per_s": half}, near[::2], ())
    return result


def _traces(
    nominal: Nominal,
    speed: Floats,
    values: Mapping[str, float],
    taus_s: Sequence[float],
    ladders: Sequence[Sequence[float]],
    within: bool = False,
) -> list[Candidate]:
    """What ``speed`` (samples,) breaks, for one time constant or a ladder of them: a network that
    forms again at several rates.

    It shows the more, the larger the signal is; or ``within``: it breaks the more then.
    """
    share = nominal.share[nominal.keep]
    breaking = np.stack([speed, speed * nominal.share] if within else [speed], axis=1)
    parts: dict[float, Floats] = {}
    for tau_s in dict.fromkeys((*taus_s, *(tau for taus in ladders for tau in taus))):
        taus = np.full(breaking.shape[1], tau_s)
        y = low_pass(breaking, nominal.dt_s, taus, None)[0][nominal.keep] * nominal.span
        parts[tau_s] = y if within else np.concatenate([y, y * share[:, None]], axis=1)
    return [Candidate(parts[tau_s], {"tau_s": tau_s, **values}) for tau_s in taus_s] + [
        Candidate(np.concatenate([parts[tau_s] for tau_s in taus], axis=1), values)
        for taus in ladders
    ]


def _quick(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What breaks sooner than it forms again, and breaks less on the way back."""
    result = []
    share, speed = nominal.share[nominal.keep], np.abs(nominal.rate)
    for power in QUICK_POWERS:
        for back in BACK:
            breaking = speed**power * np.where(nominal.rate > 0.0, 1.0, back)
            for tau_s in taus_s:
                forming = nominal.dt_s / tau_s
                y = followed(breaking, forming / QUICK, forming, 0.0)[nominal.keep] * nominal.span
                values = {"tau_s": tau_s, "power": power, "back": back}
                result.append(Candidate(np.stack([y, y * share], axis=1), values, "quick"))
    return result


def _structures(
    nominal: Nominal, rebuilds_s: Sequence[float], breaks: Sequence[float]
) -> list[Candidate]:
    """What is broken of a structure: what breaks is a share of what still holds.

    Moore, Trans. Br. Ceram. Soc. 58 (1959): dx/dt = b |v| (1 - x) - x / tau.
    """
    result = []
    speed, share = np.abs(nominal.rate), nominal.share[nominal.keep]
    for tau_s in rebuilds_s:
        for each in breaks:
            pull = 1.0 / tau_s + each * speed
            broken = at_own_pace(each * speed / pull, nominal.dt_s * pull)
            y = broken[nominal.keep] * nominal.span
            values = {"tau_s": tau_s, "breaks": each}
            result.append(Candidate(np.stack([y, y * share], axis=1), values, "structure"))
    return result


def _beyond(
    nominal: Nominal, taus_s: Sequence[float], least_per_s: Iterable[float]
) -> list[Candidate]:
    """What breaks only where the strain rate is beyond a least one."""
    result = []
    for least in least_per_s:
        speed = np.maximum(np.abs(nominal.rate) - least, 0.0)
        result += _traces(nominal, speed, {"least_per_s": float(least)}, taus_s, ())
    return result


def _late(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """What takes a while to break, too."""
    late = {
        power: low_pass(
            np.abs(nominal.rate)[:, None] ** power, nominal.dt_s, np.array([LATE_S]), None
        )[0][:, 0]
        for power in LATE_POWERS
    }
    return [
        replace(candidate, form="late")
        for power, speed in late.items()
        for candidate in _traces(nominal, speed, {"power": power}, taus_s, ())
    ]


def _one_way(nominal: Nominal, taus_s: Sequence[float]) -> list[Candidate]:
    """More of one direction than of the other: what each breaks, or what a dashpot does; and its
    force with its sign."""
    ways = _ways(nominal.rate)
    sides = {}
    for tau_s in dict.fromkeys((*taus_s, *(tau for taus in LADDERS_S for tau in taus))):
        y = low_pass(ways, nominal.dt_s, np.full(2, tau_s), None, rest=np.zeros(2))[0]
        sides[tau_s] = y[nominal.keep] * nominal.span
    found = [({"tau_s": tau_s}, sides[tau_s]) for tau_s in taus_s]
    found += [({}, np.concatenate([sides[tau_s] for tau_s in taus], axis=1)) for taus in LADDERS_S]
    result = [Candidate(columns, values, "one_way", parallel=True) for values, columns in found]
    for tau_s in taus_s:
        if tau_s > SLOWEST_DASHPOT_S:
            continue
        # What of the strain a dashpot has not followed yet.
        behind = low_pass(nominal.strain[:, None], nominal.dt_s, np.array([tau_s]), None)[0][:, 0]
        force = (nominal.strain - behind)[nominal.keep] * nominal.span
        result.append(Candidate(_ways(force), {"tau_s": tau_s}, "viscous", parallel=True))
        result.append(Candidate(force[:, None], {"tau_s": tau_s}, SIGNED))
    return result


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
