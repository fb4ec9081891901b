"""Lag: the reading follows with a time constant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache, partial

import numpy as np
from scipy.signal import cont2discrete, lfilter

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import (
    at_own_pace,
    compiled,
    low_pass,
    smooth_low_pass,
    spline_pieces,
)

# The second of two poles, of the first.
SECOND = (0.12, 0.25, 0.5)
# How many times as slowly a capacitor discharges as it charges, where a diode is in the way.
FALLS = (0.5, 0.7, 1.4, 2.0)
# Two poles that are the same, of each: as partial fractions they are not quite.
APART_BY = 1e-3
# What comes through at once where the capacitor has a resistance of its own.
THROUGH = (0.08, 0.1, 0.125, 0.16, 0.2, 0.25)
# Poles of a line of resistors and capacitors, as the roots of how many times the first they are.
LINE = (1, 3, 5, 7)
# Exponents of a cable whose dielectric absorbs, and the time constants of its poles, of the middle
# one, between logarithms.
ABSORBS = (0.86, 0.93)
APART = np.linspace(-5.5, 5.5, 12)
SPREAD = np.exp(0.5 * (APART[1:] + APART[:-1]))
# How many times as slow a filter is at the highest codes as at the lowest, whose resistor is the
# sensor itself.
SLOWER = (0.12, 0.3, 0.6, 1.7, 3.0, 8.0)
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
    # Of a circuit that is as fast as a sample it is seen how the signal goes in between.
    short = [c for c in _traces(nominal, np.geomspace(0.001, 0.1, 21)) if c.form == "smooth"]
    return alone + short + _coupled(nominal, np.geomspace(0.015, 1.0, 14), DAMPINGS[1:2])


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one time constant; a second pole that is faster, or coupled; a part that
    comes through at once; another time constant on the way down, or at other codes. Around one of
    those, closer."""
    if "damping" in values:
        # As late with one pole.
        one_s = 2.0 * values["damping"] * values["tau_s"] * np.geomspace(0.77, 1.3, 5)
        return [
            *_coupled(nominal, values["tau_s"] * np.geomspace(0.75, 1.33, 13), DAMPINGS),
            *_uneven(nominal, one_s, FALLS),
            *_own(nominal, one_s, SLOWER),
        ]
    close_s, near = values["tau_s"] * np.geomspace(0.92, 1.09, 7), np.geomspace(0.75, 1.33, 7)
    if "second" in values:
        return _two_poles(nominal, close_s, values["second"] * near)
    if "slower" in values:
        return _traces(nominal, close_s) + _own(nominal, close_s, values["slower"] * near)
    if "fall" in values:
        return _uneven(nominal, close_s, values["fall"] * near)
    if "through" in values:
        return _leaking(_traces(nominal, close_s), values["through"] * near)
    times_s = values["tau_s"] * np.geomspace(0.77, 1.3, 11)
    alone = _traces(nominal, times_s)
    poles = int(values.get("poles", 1.0))
    # As late with one pole.
    one_s = times_s * poles
    return [
        *alone,
        # With one pole instead of two, or with two instead of one.
        *_traces(nominal, one_s / (3 - poles), (3 - poles,)),
        *_lines(nominal, one_s),
        *_two_poles(nominal, times_s[1::2], SECOND),
        *_leaking([c for c in alone if c.values["tau_s"] in times_s[1::2]], THROUGH),
        *_uneven(nominal, one_s[1::2], FALLS),
        *_own(nominal, one_s[1::2], SLOWER),
    ]


def _traces(nominal: Nominal, times_s: Floats, several: Sequence[int] = (1, 2)) -> list[Candidate]:
    """Circuits, exact for a signal that is straight between samples, as simulators have it, or
    smooth, as nature is; and the smoothing that a driver does sample by sample."""
    result = []
    for tau_s in times_s.tolist():
        # As late as the circuit is, which far below a sample is another time constant.
        kept = tau_s / (tau_s + nominal.dt_s)
        for poles in several:
            values = {"tau_s": tau_s, "poles": float(poles)}
            circuits = partial(_circuits, nominal, [tau_s] * poles)
            result.append(_trace(nominal, circuits, values, "circuit"))
            smooth = partial(_smooth, nominal, _apart(tau_s, poles))
            result.append(_trace(nominal, smooth, values, "smooth"))
            smoothed = partial(_smoothed, nominal.u, kept, poles)
            own_s = float(-nominal.dt_s / np.log(kept))
            result.append(_trace(nominal, smoothed, {**values, "tau_s": own_s}, "digital"))
    return result


def _trace(
    nominal: Nominal, filtered: Callable[[], Floats], values: Mapping[str, float], form: str
) -> Candidate:
    """The signal that is ``filtered`` less the signal itself."""
    return Candidate(partial(_change, nominal, filtered), values, form, fixed=True)


def _change(nominal: Nominal, filtered: Callable[[], Floats]) -> Floats:
    change: Floats = filtered()[nominal.keep, None] - nominal.u[nominal.keep, None]
    return change


def _circuits(nominal: Nominal, times_s: Sequence[float]) -> Floats:
    """(samples,) the signal through circuits in a row with these time constants."""
    y = nominal.u[:, None]
    for tau_s in times_s:
        y = low_pass(y, nominal.dt_s, np.array([tau_s]), None)[0]
    return y[:, 0]


def _apart(tau_s: float, poles: int) -> list[float]:
    """So many time constants that are all but the same."""
    return [tau_s] if poles == 1 else [(1.0 - APART_BY) * tau_s, (1.0 + APART_BY) * tau_s]


def _smooth(nominal: Nominal, times_s: Sequence[float]) -> Floats:
    """(samples,) the signal, smooth between samples, through circuits in a row with these time
    constants, of which no two are the same: as partial fractions."""
    pieces = nominal.once("smooth pieces", lambda: spline_pieces(nominal.u))
    y = np.zeros_like(nominal.u)
    for own_s in times_s:
        share = 1.0
        for other_s in times_s:
            share *= own_s / (own_s - other_s) if other_s != own_s else 1.0
        y += share * smooth_low_pass(pieces, nominal.dt_s, own_s)
    return y


def _two_poles(nominal: Nominal, times_s: Floats, parts: Iterable[float]) -> list[Candidate]:
    """Two circuits in a row, the second with such a part of the first one's time constant."""
    result = []
    for tau_s in times_s.tolist():
        for part in parts:
            values = {"tau_s": tau_s, "poles": 2.0, "second": float(part)}
            for filtered, form in ((_circuits, "unequal"), (_smooth, "smooth unequal")):
                made = partial(filtered, nominal, [tau_s, part * tau_s])
                result.append(_trace(nominal, made, values, form))
    return result


def _lines(nominal: Nominal, times_s: Floats) -> list[Candidate]:
    """A line of many small resistors and capacitors, seen at its end or at its beginning (a finite
    Warburg element); and a cable whose dielectric absorbs."""
    result = []
    for tau_s in times_s.tolist():
        for power in ABSORBS:
            filtered = partial(_absorbing, nominal, tau_s, power)
            values = {"tau_s": tau_s, "power": power}
            result.append(_trace(nominal, filtered, values, "absorbing"))
        for form, filtered in (
            ("line", partial(_end_of_line, nominal, tau_s)),
            ("diffusion", partial(_begin_of_line, nominal, tau_s)),
        ):
            result.append(_trace(nominal, filtered, {"tau_s": tau_s}, form))
    return result


def _end_of_line(nominal: Nominal, tau_s: float) -> Floats:
    return _circuits(nominal, [tau_s / number**2 for number in LINE])


def _begin_of_line(nominal: Nominal, tau_s: float) -> Floats:
    begin = nominal.u.copy()
    for number in LINE:
        slow = _circuits(nominal, [tau_s / number**2])
        begin += 8.0 / (np.pi * number) ** 2 * (slow - nominal.u)
    return begin


def _absorbing(nominal: Nominal, tau_s: float, power: float) -> Floats:
    """(samples,) through 1 / (1 + (tau p)^power): Cole and Cole, J. Chem. Phys. 9 (1941), whose
    time constants spread on a logarithmic scale as known."""
    weights = np.diff(np.arctan(np.tan(0.5 * power * np.pi) * np.tanh(0.5 * power * APART)))
    absorbed = np.zeros_like(nominal.u)
    for weight, part in zip(weights / weights.sum(), SPREAD, strict=True):
        absorbed += weight * _circuits(nominal, [tau_s * part])
    return absorbed


def _own(nominal: Nominal, times_s: Floats, ratios: Iterable[float]) -> list[Candidate]:
    """A filter whose resistor is the sensor: from the lowest to the highest codes its time constant
    grows by such a ratio, and its mean over them is the one that is said."""

    def filtered(tau_s: float, ratio: float) -> Floats:
        own = np.maximum(1.0 + (ratio - 1.0) * nominal.share, 0.5 * min(ratio, 1.0))
        paced: Floats = at_own_pace(nominal.u, nominal.dt_s * (1.0 + ratio) / (2.0 * tau_s * own))
        return paced

    return [
        _trace(
            nominal,
            partial(filtered, tau_s, float(ratio)),
            {"tau_s": tau_s, "slower": float(ratio)},
            "own",
        )
        for tau_s in times_s.tolist()
        for ratio in ratios
    ]


def _leaking(candidates: Sequence[Candidate], shares: Iterable[float]) -> list[Candidate]:
    """(1 + through tau p) / (1 + tau p), and the same of two poles: less of what each adds."""
    forms = {"circuit": "leaking", "smooth": "smooth leaking"}
    circuits = [candidate for candidate in candidates if candidate.form in forms]
    return [
        circuit.leaking(float(share), forms[circuit.form])
        for circuit in circuits
        for share in shares
    ]


def _uneven(nominal: Nominal, times_s: Floats, falls: Iterable[float]) -> list[Candidate]:
    """One pole with a time constant on the way up and another on the way down."""
    result = []
    for tau_s in times_s.tolist():
        for fall in falls:
            up, down = (nominal.dt_s / (tau_s * fall**way) for way in (-0.5, 0.5))
            values = {"tau_s": tau_s, "fall": float(fall)}
            filtered = partial(_one_way, nominal.u, up, down)
            result.append(_trace(nominal, filtered, values, "uneven"))
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
    result = []
    for tau_s in times_s.tolist():
        for damping in dampings:
            values = {"tau_s": tau_s, "poles": 2.0, "damping": damping}
            filtered = partial(_active, nominal, tau_s, damping)
            result.append(_trace(nominal, filtered, values, "coupled"))
    return result


def _active(nominal: Nominal, tau_s: float, damping: float) -> Floats:
    """(samples,) the signal through that filter."""
    top, bottom = _discrete(tau_s, damping, nominal.dt_s)
    first = nominal.u[0]
    y: Floats = lfilter(top, bottom, nominal.u - first) + first
    return y


@lru_cache(maxsize=4096)
def _discrete(tau_s: float, damping: float, dt_s: float) -> tuple[Floats, Floats]:
    """Numerator and denominator of that filter, exact for a signal straight between samples."""
    system = ([1.0], [tau_s**2, 2.0 * damping * tau_s, 1.0])
    top, bottom, _ = cont2discrete(system, dt_s, "foh")
    return top.ravel(), bottom


def _smoothed(u: Floats, kept: float, times: int) -> Floats:
    """(samples,) ``u`` smoothed so often, each time to keep so much of the sample before."""
    y = u
    for _ in range(times):
        y = lfilter([1.0 - kept], [1.0, -kept], y, zi=[kept * y[0]])[0]
    return y


EFFECT = Effect(
    name="lag",
    stage="electrical",
    mechanism="an RC filter or slow contact: the reading follows with a time constant",
    equation="u / (1 + tau p)^n, gain 1; one_pole: n = 1; two_poles: n = 2",
    source="first-order low-pass; two in a row with the same time constant",
    fingerprint="fast motion is attenuated and late",
    parameters=(Parameter("tau_s", "s", 0.001, 0.5, 0.1, "time constant of each pole"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("one_pole", "two_poles"),
    exact=True,
)
