"""Gain: the sensor is more or less sensitive than assumed, or becomes so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial

import numpy as np

from softsense.effects import (
    REFERENCE_S,
    Candidate,
    Context,
    Effect,
    Floats,
    Nominal,
    Parameter,
    State,
    Values,
)

_REFERENCE_CYCLES = 100.0
# No divider goes closer to its ends, as a share of the converter's range.
EDGE = 0.01
# Where the signal is 0, in spans from where a recording begins.
ABOUT = (-0.7, -0.35, -0.15, 0.15, 0.35, 0.7)
# Powers of the way gone by which fatigue grows.
FATIGUE = (0.35, 0.5, 0.7, 0.85)
# Nothing ages in less than such a part of 400 s.
LEAST_PART = 0.05
# How much more a gain makes a span from where a recording begins, as a share, behind a divider and
# an amplifier of whatever range. More is a converter's curve.
BENDS = (-0.3, -0.15, 0.15, 0.3)
MOST_BENT = 0.4
# What of the strain reaches the sensor, less all of it.
TRANSFERRED = (-0.25, -0.07, 0.07, 0.25)
NEAR = (-0.06, -0.03, -0.015, 0.0, 0.015, 0.03, 0.06)
ANYWHERE = np.linspace(-1.0, 1.0, 21).tolist()
# Where the signal is 0 besides: where the recording begins, the converter's zero, its middle (a
# bridge), and where nothing is strained; and a span off on either side, as of a magnet far away.
REST = 0
ZEROS = (REST, 1, 2, 3)
FAR_ZEROS = (4, 5)
# In how many seconds it first loses much that goes with the logarithm of time.
LOG_S = (1.0, 8.0, 60.0)
FROM = "from"
# In every other form it ages, by a law of a material.
CONSTANT = "constant"
# How a gain goes over the kept samples, its parameters and its form.
Course = tuple[Floats | float, Mapping[str, float], str]


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u (1 + A c): c = 1, time / 400 s, or sqrt(cycles / 100)."""
    after: State = {}
    if form == CONSTANT:
        course = np.ones((len(u), 1))
    elif form == "time":
        course = context.time_s()[:, None] / REFERENCE_S
    else:
        strain, before, way = context.strain, context.strain[0], 0.0
        if state is not None:
            before, way = state["strain"], state["way"]
        # A cycle is once over the full range and back.
        ways = way + np.cumsum(np.abs(np.diff(strain, prepend=before)))
        course = np.sqrt(ways / 2.0 / _REFERENCE_CYCLES)[:, None]
        after = {"strain": float(strain[-1]), "way": float(ways[-1])}
    return u * (1.0 + values["amplitude"] * course), after


def explain(nominal: Nominal) -> list[Candidate]:
    """In proportion to the signal: constant, or growing with time or with the way gone; to the
    resistance, whose voltage is read behind a divider; or to the strain, not all of which reaches
    the sensor. What is no signal need not be where the recording begins."""
    usual = [*_usual(nominal), *_settling(nominal, (0.05, 0.15, 0.4), (1.0,))]
    return [
        *_grown(nominal, [(1.0, {}, CONSTANT)], ZEROS),
        *_about(nominal, ABOUT),
        *_divided(nominal),
        *_bent(nominal, BENDS),
        *_transferred(nominal, TRANSFERRED),
        *_grown(nominal, usual, ZEROS),
        *_grown(nominal, _cycles(nominal, FATIGUE)),
        *_grown(nominal, _induced(nominal, (0.15, 0.3, 0.45), (0.1,))),
        *_grown(nominal, _logarithmic(nominal, (2.0, 20.0))),
        *_grown(nominal, _settling(nominal, (0.2, 0.35, 0.6), (1.5, 2.0))),
        *_grown(nominal, _by_decades(nominal, LOG_S), (*ZEROS, *FAR_ZEROS)),
    ]


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one way, one zero, one power, or one time and order; and behind an amplified
    divider. All zeros besides, which an offset makes equal."""
    if "zero" in values:
        near = values["zero"] + np.array(NEAR)
        return _about(nominal, [*ANYWHERE, *near.tolist()]) + _bent(nominal, BENDS)
    if "bend" in values:
        near = values["bend"] + np.array(NEAR)
        return explain(nominal) + _bent(nominal, near[np.abs(near) <= MOST_BENT].tolist())
    if "transferred" in values:
        near = values["transferred"] * np.geomspace(0.5, 1.6, 7)
        return explain(nominal) + _transferred(nominal, near.tolist())
    from_zero = (int(values.get(FROM, REST)),)
    if "ways" in values:
        ways = (values["ways"] * np.geomspace(0.25, 4.0, 7)).tolist()
        return _grown(nominal, _logarithmic(nominal, ways), from_zero)
    if "log_s" in values:
        times = (values["log_s"] * np.geomspace(0.25, 4.0, 7)).tolist()
        return _grown(nominal, _by_decades(nominal, times), from_zero)
    if "begins" in values:
        near = (values["begins"] + np.array([-0.05, -0.025, 0.0, 0.025, 0.05])).tolist()
        return _grown(nominal, _induced(nominal, near, (0.03, 0.06, 0.1, 0.15, 0.2)), from_zero)
    if "power" in values:
        powers = (values["power"] * np.array([0.8, 0.9, 1.1, 1.2])).tolist()
        return explain(nominal) + _grown(nominal, _cycles(nominal, powers), from_zero)
    if "part" in values:
        near = np.maximum(values["part"] * np.geomspace(0.6, 1.7, 9), LEAST_PART)
        parts = np.unique(near).tolist()
        orders = (0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 0.92 * values["order"], 1.07 * values["order"])
        return _grown(nominal, _settling(nominal, parts, orders), from_zero)
    some = explain(nominal) + _about(nominal, ANYWHERE)
    if FROM in values:
        some += _grown(nominal, _cycles(nominal, FATIGUE), from_zero)
        some += _grown(nominal, _induced(nominal, (0.15, 0.3, 0.45), (0.1,)), from_zero)
        some += _grown(nominal, _logarithmic(nominal, (2.0, 20.0)), from_zero)
    return some


def _grown(
    nominal: Nominal, courses: Sequence[Course], zeros: Sequence[int] = (REST,)
) -> list[Candidate]:
    """The signal, from each of ``zeros``, times each of ``courses``."""
    result = []
    for zero in zeros:
        moved, mark = _moved(nominal, zero), {} if zero == REST else {FROM: float(zero)}
        result += [
            Candidate((moved * course)[:, None], {**values, **mark}, form, nearly=form != CONSTANT)
            for course, values, form in courses
        ]
    return result


def _time(nominal: Nominal) -> Floats:
    """(kept samples,) since the experiment began, in 400 s."""
    t: Floats = np.maximum(nominal.time_s[nominal.keep], 0.0) / REFERENCE_S
    return t


def _moved(nominal: Nominal, zero: int = REST) -> Floats:
    """(kept samples,) codes from one of ``ZEROS`` or ``FAR_ZEROS``."""
    at = (
        *(nominal.rest, 0.0, 0.5 * nominal.full_scale, float(nominal.curve.codes[0])),
        *(nominal.rest - nominal.span, nominal.rest + nominal.span),
    )
    moved: Floats = nominal.u[nominal.keep] - at[zero]
    return moved


def _about(nominal: Nominal, zeros: Sequence[float]) -> list[Candidate]:
    """Constant, from where the signal is 0, in spans from where the recording begins."""
    moved = _moved(nominal)
    return [
        Candidate((moved - zero * nominal.span)[:, None], {"zero": zero}, CONSTANT)
        for zero in zeros
    ]


def _usual(nominal: Nominal) -> list[Course]:
    """With time, and with its root."""
    t = _time(nominal)
    return [(t, {}, "ageing"), (np.sqrt(t), {}, "cycles")]


def _cycles(nominal: Nominal, powers: Sequence[float]) -> list[Course]:
    """With powers of the way gone."""
    way = nominal.way
    return [(way**power, {"power": power}, "cycles") for power in powers]


def _logarithmic(nominal: Nominal, ways: Sequence[float]) -> list[Course]:
    """With the logarithm of the way gone."""
    way = nominal.way
    return [(np.log1p(way / one), {"ways": one}, "logarithmic") for one in ways]


def _by_decades(nominal: Nominal, times_s: Sequence[float]) -> list[Course]:
    """With the logarithm of time, as of a magnet or a poled ceramic."""
    t_s = _time(nominal) * REFERENCE_S
    return [(np.log1p(t_s / one), {"log_s": one}, "by decades") for one in times_s]


def _settling(nominal: Nominal, parts: Sequence[float], orders: Sequence[float]) -> list[Course]:
    """From one gain to another in such a part of 400 s (Weibull; Avrami where it begins slowly):
    right at first, or in the end."""
    t = _time(nominal)
    result: list[Course] = []
    for part in parts:
        for order in orders:
            ahead, values = np.exp(-((t / part) ** order)), {"part": part, "order": order}
            result += [(1.0 - ahead, values, "settling"), (ahead, values, "running in")]
    return result


def _induced(nominal: Nominal, begins: Sequence[float], widths: Sequence[float]) -> list[Course]:
    """Growing with time from an instant on, in 400 s, as what is consumed first holds it off."""
    t = _time(nominal)
    result: list[Course] = []
    for begin in begins:
        for width in widths:
            grown = np.logaddexp(0.0, (t - begin) / width) - np.logaddexp(0.0, -begin / width)
            result.append((width * grown, {"begins": begin, "width": width}, "ageing"))
    return result


def _divided(nominal: Nominal) -> list[Candidate]:
    """What a little more of a resistance's change makes where it is the lower or the upper one."""
    ends = EDGE, 1.0 - EDGE
    low = np.clip(nominal.u[nominal.keep] / nominal.full_scale, *ends)
    rest = np.clip(nominal.rest / nominal.full_scale, *ends)
    result = []
    for share, at_rest in ((low, rest), (1.0 - low, 1.0 - rest)):
        change = share / (1.0 - share) - at_rest / (1.0 - at_rest)
        column = change * (1.0 - share) ** 2 * nominal.full_scale
        result.append(Candidate(column[:, None], {}, "divided"))
    return result


def _bent(nominal: Nominal, bends: Sequence[float]) -> list[Candidate]:
    """The same where an amplifier follows, so that nobody knows where the divider has its ends: a
    parabola of the signal, which is nearly straight."""
    moved = _moved(nominal)
    # It is 0 anywhere between a span below and one above.
    both = np.stack([moved + nominal.span, moved - nominal.span], axis=1)
    share = moved[:, None] / nominal.span
    return [
        Candidate(
            both * (1.0 + bend * share), {"bend": bend}, "divided", parallel=True, shifting=True
        )
        for bend in bends
    ]


def _transferred(nominal: Nominal, more: Sequence[float]) -> list[Candidate]:
    """Where more or less of the strain reaches the sensor, through its glue or its clamps."""

    @cache
    def reading(part: float) -> Floats:
        return nominal.respond(part * nominal.strain, nominal.keep)

    def change(part: float) -> Floats:
        less = 1.0 - abs(part)
        change = reading(less) - reading(1.0)
        if part > 0.0:
            # Nobody has seen how it reads beyond its range: a parabola through what is within.
            change = reading(less - part) - reading(less) - 2.0 * change
        return change[:, None]

    return [Candidate(partial(change, part), {"transferred": part}, "transferred") for part in more]


EFFECT = Effect(
    name="gain",
    stage="material",
    mechanism="the sensor is more or less sensitive than assumed, from the start or by ageing",
    equation="u (1 + A c); constant: c = 1; time: c = t / 400 s; cycles: c = sqrt(n / 100), "
    "n the way travelled in full cycles",
    source="miscalibration; shear lag: Cox, Brit. J. Appl. Phys. 3 (1952); "
    "magnets age by decades: Street and Woolley, Proc. Phys. Soc. A 62 (1949); "
    "fatigue of filler networks grows with the number of cycles",
    fingerprint="proportional to the signal, may grow with time or cycles",
    parameters=(Parameter("amplitude", "1", -0.4, 0.4, 0.1, "relative change of the gain"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=(CONSTANT, "time", "cycles"),
    exact=True,
)
