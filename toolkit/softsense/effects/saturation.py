"""Saturation: the amplifier or the divider runs into its rail."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from softsense.effects import (
    AS_CURVE,
    Candidate,
    Context,
    Effect,
    Floats,
    Nominal,
    Parameter,
    State,
    Values,
    adc_nonlinearity,
    altered,
)

# Widths of the knee as shares of the signal's range, and what is tried near one: far and close, for
# the next look is around what is best.
KNEES = np.array([0.0, 0.02, 0.06, 0.15])
NEAR = np.array([0.5, 0.7, 0.84, 0.94, 1.0, 1.06, 1.18, 1.4, 2.0])
SHARP = np.array([0.0, 0.004, 0.01, 0.02])
AROUND = np.array([0.0005, 0.0015, 0.004, 0.01, 0.02])
# The softer a knee is, the farther out is its rail that takes as much, in widths of the knee.
OUTWARDS = 1.8
# An upper rail, and a lower one.
ENDS = ("level", "bottom")
# Where an upper rail may be, as shares of the signal's range, and a lower one from its other end.
ENDS_AT = np.linspace(0.99, 0.36, 32)
# How far inside the signal's range a second rail may be, as shares of it.
INSIDE = np.array([0.03, 0.06, 0.1, 0.15, 0.2])
# By how much of the signal's range an upper rail sinks over the recording.
SAGS = np.array([0.02, 0.045, 0.1])
# What of the signal comes through beyond a rail.
THROUGH = (0.025, 0.05, 0.075, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45)
# An amplifier that gives less and less towards both its ends: what it could give at most, in halves
# of the signal's range, and the middle between its ends, in the same from that range's; and around
# one of each.
REACHES = np.geomspace(0.7, 3.2, 12)
MIDDLES = np.array([-0.3, 0.0, 0.3])
REACHES_NEAR = np.geomspace(0.85, 1.18, 17)
MIDDLES_NEAR = np.array(
    [-0.2, -0.14, -0.1, -0.07, -0.05, -0.035, -0.02, -0.01, 0.0]
    + [0.01, 0.02, 0.035, 0.05, 0.07, 0.1, 0.14, 0.2]
)
# One that follows exactly up to somewhere and bends over to a ceiling: how far the signal goes
# beyond where that begins, in its range, and what room it then has, of that way; around one of
# each. If it takes off as much, room goes with so high a power of that way.
BEYONDS = np.geomspace(0.1, 0.85, 7)
ROOMS = np.array([0.4, 0.7, 1.2, 2.0])
BEYONDS_NEAR = np.geomspace(0.65, 1.54, 11)
ROOMS_NEAR = np.geomspace(0.85, 1.18, 17)
ROOM_POWER = 1.5
# A curve is a rail that is flat up to somewhere, and falls off from there: in shares of all that it
# falls, by how much it may rise before and after, and may have fallen at these shares of the range.
# Of that there are so many cells, and so much at each end is rarely met.
CELLS = 100
ENDS_RARE = 0.002
WAVERS = 0.12
FALLEN = {0.3: 0.06, 0.5: 0.25}


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """min(u, m), or the soft minimum m - k ln(1 + exp((m - u) / k))."""
    level = values["level"]
    if form == "hard":
        return np.minimum(u, level), {}
    knee = np.maximum(values["knee"], 1e-9)
    return level - knee * np.logaddexp(0.0, (level - u) / knee), {}


def explain(nominal: Nominal) -> list[Candidate]:
    """What is cut off above a level or below one, weight 1, hard or with a soft knee; or taken off
    by an amplifier that gives less and less towards both its ends, or from somewhere on."""
    levels = nominal.low + ENDS_AT[::-1] * nominal.span
    bottoms = nominal.low + (1.0 - ENDS_AT) * nominal.span
    knees = KNEES * nominal.span
    half = 0.5 * nominal.span
    bent = _compressed(nominal, half * REACHES, nominal.low + half * (1.0 + MIDDLES))
    for beyond in BEYONDS * nominal.span:
        bent += _bending(nominal, nominal.low + nominal.span - beyond, beyond * ROOMS, 1.0)
        bent += _bending(nominal, nominal.low + beyond, beyond * ROOMS, -1.0)
    return _traces(nominal, levels, knees) + _lower(nominal, bottoms, knees[:2]) + bent


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one level and one knee, also where a part comes through; or both rails, or
    an upper one that sinks. Around one of those, or an amplifier, closer. Or any curve."""
    if AS_CURVE in values:
        return [altered(one, values={AS_CURVE: 1.0}) for one in adc_nonlinearity.explain(nominal)]
    if "room" in values:
        way = values["way"]
        last = nominal.low + (way > 0.0) * nominal.span
        room, begin = (values[key] * nominal.full_scale for key in ("room", "begins"))
        return [
            each
            for part in BEYONDS_NEAR
            for each in _bending(
                nominal,
                last - part * (last - begin),
                part**ROOM_POWER * room * ROOMS_NEAR,
                way,
            )
        ]
    if "reach" in values:
        reach, middle = (values[key] * nominal.full_scale for key in ("reach", "middle"))
        near = middle + MIDDLES_NEAR * 0.5 * nominal.span
        return _compressed(nominal, reach * REACHES_NEAR, near)
    around = np.concatenate([-AROUND[::-1], [0.0], AROUND]) * nominal.span
    knee = np.array([values["knee"] * nominal.full_scale])
    knees = knee * NEAR if knee else SHARP * nominal.span
    ends = {key: values[key] * nominal.full_scale + around for key in ENDS if key in values}
    if len(ends) == 2:
        return _between(nominal, ends["level"][::2], knee, ends["bottom"][::2])
    upper = "level" in ends
    if "sags" in values:
        sags = values["sags"] * nominal.full_scale * NEAR[1:-1]
        return _sagging(nominal, ends["level"][::2], knee, sags)
    end, made = (ends["level"], _traces) if upper else (ends["bottom"], _lower)
    other = nominal.low + (INSIDE if upper else 1.0 - INSIDE) * nominal.span
    levels, bottoms = (end[1::3], other) if upper else (other, end[1::3])
    outwards = OUTWARDS * (knees - knee) * (1.0 if upper else -1.0) * bool(knee)
    there = [
        each
        for width, farther in zip(knees, outwards, strict=True)
        for each in made(nominal, end + farther, np.array([width]))
    ]
    through = values.get("through", 0.0)
    return [
        *([each.leaking(through) for each in there] if through else there),
        *(each.leaking(part) for each in made(nominal, end, knee) for part in THROUGH),
        *_between(nominal, levels, knee, bottoms),
        *(_sagging(nominal, ends["level"][1::2], knee, nominal.span * SAGS) if upper else ()),
    ]


def is_rail(u: Floats, change: Floats) -> bool:
    """Whether a ``change`` (samples,) of the signal ``u`` (samples,) has the shape of an upper or
    a lower rail."""
    low, high = np.quantile(u, [ENDS_RARE, 1.0 - ENDS_RARE])
    cells = np.rint(np.clip((u - low) / max(high - low, 1e-12), 0.0, 1.0) * CELLS).astype(np.intp)
    counts = np.bincount(cells, minlength=CELLS + 1)
    met = np.flatnonzero(counts)
    means = np.bincount(cells, change, CELLS + 1)[met] / counts[met]
    curve = np.interp(np.arange(CELLS + 1), met, means)
    return _falls_off(curve) or _falls_off(-curve[::-1])


def _falls_off(curve: Floats) -> bool:
    """Whether a ``curve`` (cells,) is flat, and then falls."""
    top = int(np.argmax(curve))
    falls = curve[top] - curve[-1]
    before = curve[top] - curve[: top + 1].min()
    after = np.maximum(np.diff(curve[top:]), 0.0).sum()
    late = all(curve[top] - curve[round(at * CELLS)] < part * falls for at, part in FALLEN.items())
    return bool(late and max(before, after) < WAVERS * falls)


def _traces(nominal: Nominal, levels: Floats, knees: Floats) -> list[Candidate]:
    result = []
    for level in levels.tolist():
        for knee in knees.tolist():
            values = {"level": level / nominal.full_scale, "knee": knee / nominal.full_scale}
            made = partial(_cut, nominal.u, level, knee, -1.0)
            result.append(Candidate(made, values, fixed=True))
    return result


def _lower(nominal: Nominal, bottoms: Floats, knees: Floats) -> list[Candidate]:
    result = []
    for bottom in bottoms.tolist():
        for knee in knees.tolist():
            values = {"bottom": bottom / nominal.full_scale, "knee": knee / nominal.full_scale}
            made = partial(_cut, nominal.u, bottom, knee, 1.0)
            result.append(Candidate(made, values, "lower_rail", fixed=True))
    return result


def _sagging(nominal: Nominal, levels: Floats, knees: Floats, sags: Floats) -> list[Candidate]:
    """What is cut off above a level that sinks as a supply does, by so much from begin to end."""
    result = []
    for sag in sags.tolist():
        for above in _traces(nominal, levels, knees):
            level, knee = (above.values[key] * nominal.full_scale for key in ("level", "knee"))
            values = {**above.values, "sags": sag / nominal.full_scale}
            made = partial(_under, nominal, level, knee, sag)
            result.append(Candidate(made, values, "sagging", fixed=True))
    return result


def _under(nominal: Nominal, level: float, knee: float, sag: float) -> Floats:
    """(samples, 1) what such a rail takes off that is at ``level`` in the middle of the time."""
    return _cut(nominal.u + sag * (nominal.passed - 0.5), level, knee, -1.0)


def _cut(u: Floats, end: float, knee: float, way: float) -> Floats:
    """(samples, 1) what a rail takes off ``u`` above it (``way`` -1) or adds below it (1); and more
    of it the closer the signal comes within a ``knee``."""
    over = way * (end - u)
    cut = knee * np.logaddexp(0.0, over / knee) if knee else np.maximum(over, 0.0)
    return way * cut[:, None]


def _between(nominal: Nominal, levels: Floats, knees: Floats, bottoms: Floats) -> list[Candidate]:
    """What is cut off above a level and below another one."""
    result = []
    for below in _lower(nominal, bottoms, np.zeros(1)):
        for above in _traces(nominal, levels, knees):
            values = {**above.values, "bottom": below.values["bottom"]}
            both = partial(_both, above, below)
            result.append(Candidate(both, values, "both_rails", fixed=True))
    return result


def _compressed(nominal: Nominal, reaches: Floats, middles: Floats) -> list[Candidate]:
    """What an amplifier takes off that follows exactly at the ``middles``, and reaches no further
    than so many codes from there: m + r tanh((u - m) / r)."""

    def taken(reach: float, middle: float) -> Floats:
        beyond = nominal.u - middle
        return (reach * np.tanh(beyond / reach) - beyond)[:, None]

    result = []
    for reach in reaches.tolist():
        for middle in middles.tolist():
            values = {"reach": reach / nominal.full_scale, "middle": middle / nominal.full_scale}
            made = partial(taken, reach, middle)
            result.append(Candidate(made, values, "compressing", fixed=True))
    return result


def _bending(nominal: Nominal, begin: float, rooms: Floats, way: float) -> list[Candidate]:
    """What an amplifier takes off that follows exactly up to where it bends over, or down to there
    (``way`` -1), and then has so much room: b + r tanh((u - b) / r)."""

    def taken(room: float) -> Floats:
        beyond = np.maximum(way * (nominal.u - begin), 0.0)
        return way * (room * np.tanh(beyond / room) - beyond)[:, None]

    result = []
    for room in rooms.tolist():
        shares = {"begins": begin / nominal.full_scale, "room": room / nominal.full_scale}
        made = partial(taken, room)
        result.append(Candidate(made, {**shares, "way": way}, "bending", fixed=True))
    return result


def _both(above: Candidate, below: Candidate) -> Floats:
    return above.columns + below.columns


EFFECT = Effect(
    name="saturation",
    stage="electrical",
    mechanism="the front end runs into its rail",
    equation="hard: min(u, m); soft: m - k ln(1 + exp((m - u)/k)); bending over from b on: "
    "b + r tanh((u - b)/r)",
    source="ideal limiter; softplus as its smooth form; an amplifier's tanh",
    fingerprint="static, only at the ends",
    parameters=(
        Parameter("level", "share of ADC scale", 0.3, 1.0, 0.6, "highest reading m"),
        Parameter("knee", "share of ADC scale", 0.002, 0.1, 0.02, "soft: width k of the knee"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("hard", "soft"),
    exact=True,
    memoryless=True,
)
