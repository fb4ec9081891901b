"""Lag: the reading follows with a time constant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

import numpy as np
from scipy.signal import cont2discrete, lfilter

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import at_own_pace, compiled, low_pass

# The second of two poles, of the first.
SECOND = (0.12, 0.25, 0.5)
# How many times as slowly a capacitor discharges as it charges, where a diode is in the way.
FALLS = (0.5, 0.7, 1.4, 2.0)
# What comes through at once where the capacitor has a resistance of its own.
THROUGH = (0.1, 0.2)
# Poles of a line of resistors and capacitors, as the roots of how many times the first they are.
LINE = (1, 3, 5, 7)
# What is never left of a sensor's share of its divider.
EDGE = 0.02
TOP = 1.0 + 2.0 * EDGE
# Of two poles that are coupled: Chebyshev, Butterworth and Bessel filters are in between.
DAMPINGS = (0.5, 0.7, 0.87)


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u through 1 / (1 + tau p)^n, n = 1 or 2, settled at the first sample."""
    memories = []
    for pole in range(2 if form == "two_poles" else 1):
        before = None if state is None else state["memory"][pole]
        u, memory = low_pass(u, context.dt_s, values["tau_s"], before)
        memories.append(memory)
    return u, {"memory": np.stack(memories)}


def explain(nominal: Nominal) -> list[Candidate]:
    """The filtered signal less the signal itself, weight 1: one pole, and two, apart or coupled."""
    alone = [c for c in _traces(nominal, np.geomspace(0.01, 4.0, 27)) if c.form == "circuit"]
    return alone + _coupled(nominal, np.geomspace(0.015, 1.0, 14), DAMPINGS[1:2])


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one time constant; a second pole that is faster, or coupled; a part that
    comes through at once; or another time constant on the way down. Around one of those, closer."""
    if "damping" in values:
        return _coupled(nominal, values["tau_s"] * np.geomspace(0.75, 1.33, 13), DAMPINGS)
    close_s, near = values["tau_s"] * np.geomspace(0.92, 1.09, 7), np.geomspace(0.75, 1.33, 7)
    if "second" in values:
        return _two_poles(nominal, close_s, values["second"] * near)
    if "fall" in values:
        return _uneven(nominal, close_s, values["fall"] * near)
    if "through" in values:
        return _leaking(_traces(nominal, close_s), values["through"] * near)
    times_s = values["tau_s"] * np.geomspace(0.77, 1.3, 11)
    alone = _traces(nominal, times_s)
    return [
        *alone,
        *_lines(nominal, times_s),
        *_two_poles(nominal, times_s[1::2], SECOND),
        *_leaking(alone, THROUGH),
        *_uneven(nominal, times_s[1::2], FALLS),
    ]


def _traces(nominal: Nominal, times_s: Floats) -> list[Candidate]:
    """Circuits, exact between samples, and the smoothing that a driver does sample by sample."""
    result = []
    for tau_s in times_s:
        kept = float(np.exp(-nominal.dt_s / tau_s))
        once = low_pass(nominal.u[:, None], nominal.dt_s, np.array([tau_s]), None)[0][:, 0]
        twice = low_pass(once[:, None], nominal.dt_s, np.array([tau_s]), None)[0][:, 0]
        digital = _smoothed(nominal.u, kept)
        for poles, form, y in (
            (1, "circuit", once),
            (2, "circuit", twice),
            (1, "digital", digital),
            (2, "digital", _smoothed(digital, kept)),
        ):
            values = {"tau_s": float(tau_s), "poles": float(poles)}
            column = (y - nominal.u)[nominal.keep, None]
            result.append(Candidate(column.copy(), values, form, fixed=True))
    return result


def _two_poles(nominal: Nominal, times_s: Floats, parts: Iterable[float]) -> list[Candidate]:
    """Two circuits in a row, the second with such a part of the first one's time constant."""
    result = []
    for tau_s in times_s:
        once = low_pass(nominal.u[:, None], nominal.dt_s, np.array([tau_s]), None)[0]
        for part in parts:
            y = low_pass(once, nominal.dt_s, np.array([part * tau_s]), None)[0]
            column = (y[:, 0] - nominal.u)[nominal.keep, None]
            values = {"tau_s": float(tau_s), "poles": 2.0, "second": float(part)}
            result.append(Candidate(column.copy(), values, "unequal", fixed=True))
    return result


def _lines(nominal: Nominal, times_s: Floats) -> list[Candidate]:
    """A line of many small resistors and capacitors, seen at its end or at its beginning (a finite
    Warburg element); and one whose resistor is the sensor itself, the lower or the upper one."""
    u, result = nominal.u, []
    low = np.clip(u / nominal.full_scale, 0.0, 1.0) + EDGE
    middle = (nominal.low + 0.5 * nominal.span) / nominal.full_scale + EDGE
    for tau_s in times_s:
        end, begin = u, u.copy()
        for number in LINE:
            part_s = np.array([tau_s / number**2])
            end = low_pass(end[:, None], nominal.dt_s, part_s, None)[0][:, 0]
            slow = low_pass(u[:, None], nominal.dt_s, part_s, None)[0][:, 0]
            begin += 8.0 / (np.pi * number) ** 2 * (slow - u)
        own = [
            at_own_pace(u, nominal.dt_s / (tau_s * share / usual))
            for share, usual in ((low, middle), (TOP - low, TOP - middle))
        ]
        for form, y in (("line", end), ("diffusion", begin), ("own", own[0]), ("own", own[1])):
            column = (y - u)[nominal.keep, None]
            result.append(Candidate(column.copy(), {"tau_s": float(tau_s)}, form, fixed=True))
    return result


def _leaking(candidates: Sequence[Candidate], shares: Iterable[float]) -> list[Candidate]:
    """(1 + through tau p) / (1 + tau p), and the same of two poles: less of what each adds."""
    circuits = [candidate for candidate in candidates if candidate.form == "circuit"]
    return [circuit.leaking(float(share)) for circuit in circuits for share in shares]


def _uneven(nominal: Nominal, times_s: Floats, falls: Iterable[float]) -> list[Candidate]:
    """One pole with a time constant on the way up and another on the way down."""
    result = []
    for tau_s in times_s:
        for fall in falls:
            up, down = (nominal.dt_s / (tau_s * fall**way) for way in (-0.5, 0.5))
            column = (_one_way(nominal.u, up, down) - nominal.u)[nominal.keep, None]
            values = {"tau_s": float(tau_s), "fall": float(fall)}
            result.append(Candidate(column.copy(), values, "uneven", fixed=True))
    return result


@compiled
def _one_way(u: Floats, up: float, down: float) -> Floats:
    """(samples,) what follows ``u`` at the rates ``up`` and ``down`` per sample, exact for a signal
    straight between samples but where it changes its way."""
    output = np.empty_like(u)
    y = u[0]
    output[0] = y
    for k in range(1, len(u)):
        pull = up if u[k] > y else down
        kept = np.exp(-pull)
        share = (1.0 - kept) / pull
        y = kept * y + (1.0 - share) * u[k] + (share - kept) * u[k - 1]
        output[k] = y
    return output


def _coupled(nominal: Nominal, times_s: Floats, dampings: Sequence[float]) -> list[Candidate]:
    """1 / (1 + 2 damping tau p + (tau p)^2): two poles of one active filter, against aliasing."""
    u, result = nominal.u, []
    for tau_s in times_s:
        for damping in dampings:
            top, bottom = _discrete(float(tau_s), damping, nominal.dt_s)
            y = lfilter(top, bottom, u - u[0]) + u[0]
            values = {"tau_s": float(tau_s), "poles": 2.0, "damping": float(damping)}
            column = (y - u)[nominal.keep, None]
            result.append(Candidate(column.copy(), values, "coupled", fixed=True))
    return result


@lru_cache(maxsize=4096)
def _discrete(tau_s: float, damping: float, dt_s: float) -> tuple[Floats, Floats]:
    """Numerator and denominator of that filter, exact for a signal straight between samples."""
    system = ([1.0], [tau_s**2, 2.0 * damping * tau_s, 1.0])
    top, bottom, _ = cont2discrete(system, dt_s, "foh")
    return top.ravel(), bottom


def _smoothed(u: Floats, kept: float) -> Floats:
    y: Floats = lfilter([1.0 - kept], [1.0, -kept], u, zi=[kept * u[0]])[0]
    return y


EFFECT = Effect(
    name="lag",
    stage="electrical",
    mechanism="an RC filter or slow contact: the reading follows with a time constant",
    equation="u / (1 + tau p)^n, gain 1; one_pole: n = 1; two_poles: n = 2",
    source="first-order low-pass; two in a row with the same time constant",
    fingerprint="fast motion is attenuated and late",
    parameters=(Parameter("tau_s", "s", 0.01, 0.5, 0.1, "time constant of each pole"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("one_pole", "two_poles"),
    exact=True,
)
