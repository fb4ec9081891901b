"""Delay: two clocks that are apart, or run apart, or channels that are read one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from softsense.effects import (
    STRAIGHT,
    Candidate,
    Context,
    Effect,
    Fine,
    Floats,
    Nominal,
    Parameter,
    Recurring,
    State,
    Values,
)
from softsense.effects.operators import (
    LONG_PERIOD_S,
    SAW,
    SINE,
    compiled,
    spline_pieces,
    straight_pieces,
    wave,
)

FORMS = ("smooth", "linear")
# Polynomials of time (Legendre) that say how a delay wanders about an even course, in seconds each.
COURSES = tuple(f"course{k}" for k in range(2, 10))
# And delays beyond those at even times, straight in between.
KNOTS = tuple(f"knot{k}" for k in range(41))
# What comes again: a clock in a room that warms and cools, and one that is set right now and then,
# or that beats with another one.
WAVES = {"swinging": SINE, "set right": SAW}
# After which part of a recording what wandered in it is forgotten.
RETURNS = 0.1
# One converter for all: how much later each channel is read than the one before.
SCAN = "scan_s"
STEPS = {
    SCAN: 0.0005,
    **dict.fromkeys(("delay_s", "swing_s", "phase", *COURSES, *KNOTS), 0.001),
    "skew": 3e-6,
    # Of many turns it moves the last one far.
    "period_s": 1e-5,
}
# Delays at the beginning and the end of a recording, in seconds, where clocks run apart.
ENDS_S = (0.0, 0.015, 0.05, 0.2, 0.5, 1.5)
SKEWED = [(a, b) for a in ENDS_S for b in ENDS_S if a != b]


def simulate(
    x: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """x(t - d0 - d1 t), straight between samples; the first sample before the start.

    A delay that would look ahead is held at zero. ``state`` keeps the samples that will still be
    read.
    """
    first = round(context.t0_s / context.dt_s)
    if state is None:
        history, begins = x, first
    else:
        history, begins = np.concatenate([state["history"], x]), int(state["begins"])
    now = first + np.arange(len(x), dtype=np.float64)
    late_s = values["delay_s"] + values["skew"] * (now * context.dt_s)[:, None]
    at = np.maximum(now[:, None] - np.maximum(late_s, 0.0) / context.dt_s, float(begins))
    below = np.minimum(np.floor(at).astype(np.intp) - begins, len(history) - 2)
    below = np.maximum(below, 0)
    part = at - (below + begins)
    columns = np.arange(x.shape[1])
    above = np.minimum(below + 1, len(history) - 1)
    low, high = history[below, columns], history[above, columns]
    # What is read next lies at or after what was read last.
    keep = int(below.min(axis=1)[-1])
    return low + part * (high - low), {"history": history[keep:], "begins": begins + keep}


def explain(nominal: Nominal) -> list[Candidate]:
    """The signal of another time less the signal, weight 1; or a clock that runs differently."""
    delays = np.geomspace(0.001, 1.0, 40)
    ends = [(sign * late, sign * later) for sign in (1.0, -1.0) for late, later in SKEWED]
    return [
        *_traces(nominal, np.concatenate([-delays, delays]), ("smooth",)),
        *_skewed(nominal, ends),
    ]


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one offset, or around those at the beginning and the end."""
    first = values["delay_s"]
    if "skew" in values:
        last = first + values["skew"] * nominal.reference.duration_s
        reach = max(abs(first), abs(last)) * np.linspace(-0.3, 0.3, 7)
        ends_s = [(first + a, last + b) for a in reach for b in reach]
        return _skewed(nominal, ends_s) + _skewed(nominal, ends_s, straight=True)
    return _traces(nominal, first * np.geomspace(0.8, 1.25, 15), FORMS)


def at(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """Just this delay."""
    if values.keys() <= {"delay_s", STRAIGHT}:
        return _traces(nominal, np.array([values["delay_s"]]), FORMS)
    if "period_s" in values:
        return [_changing(nominal, values, form) for form in WAVES]
    return [_changing(nominal, values)]


def _traces(nominal: Nominal, delays_s: Floats, forms: tuple[str, ...]) -> list[Candidate]:
    """Straight between samples, as software reads late, and smooth, as nature is late."""
    result = []
    for delay_s in delays_s.tolist():
        for form in forms:
            values = {"delay_s": delay_s, **_marks(form == "linear")}
            moved = partial(_moved, nominal, values)
            made = partial(_late_by, nominal, form, delay_s / nominal.dt_s)
            result.append(Candidate(made, values, form, fixed=True, moved=moved))
    return result


def _marks(straight: bool) -> dict[str, float]:
    """What values say besides of a delay that is ``straight`` between samples."""
    return {STRAIGHT: 1.0} if straight else {}


def _pieces(nominal: Nominal, form: str) -> Floats:
    """(powers, samples - 1) polynomials of the way from one sample to the next."""
    made = straight_pieces if form == "linear" else spline_pieces
    return nominal.once(f"{form} pieces", lambda: made(nominal.u))


def _late_by(nominal: Nominal, form: str, late: float) -> Floats:
    """(kept samples, 1) what it changes of the signal to be so many samples late; beyond its ends
    the signal rests.

    A constant delay meets every polynomial at the same place.
    """
    u, step, pieces = nominal.u, nominal.keep.step or 1, _pieces(nominal, form)
    first = int(np.floor(-late))
    part = -late - first
    moved = np.full(len(u[::step]), u[0] if late > 0 else u[-1])
    begin, end = max(-(first // step), 0), min(-((first + 1 - len(u)) // step), len(moved))
    if begin < end:
        there = pieces[:, begin * step + first : (end - 1) * step + first + 1 : step]
        at = there[-1].copy()
        for factors in there[-2::-1]:
            at *= part
            at += factors
        moved[begin:end] = at
    change: Floats = (moved - u[::step])[:, None]
    return change


def _skewed(
    nominal: Nominal, ends_s: Sequence[tuple[float, float]], straight: bool = False
) -> list[Candidate]:
    """Delays that go from one to another over the time of the reference."""
    result = []
    for first, last in ends_s:
        values = {"delay_s": float(first), **_marks(straight)}
        if first != last:
            values["skew"] = float((last - first) / nominal.reference.duration_s)
        result.append(_changing(nominal, values))
    return result


def _changing(nominal: Nominal, values: Mapping[str, float], form: str = "") -> Candidate:
    def made() -> Floats:
        pieces = _pieces(nominal, "linear" if STRAIGHT in values else "smooth")
        read = _read(pieces, nominal, _late_s(nominal, values, form))
        return (read - nominal.u[nominal.keep])[:, None]

    moved, freely = partial(_moved, nominal, values, form), KNOTS[0] in values
    if not form:
        form = "skewed" if values.keys().isdisjoint((*COURSES, *KNOTS)) else "wandering"
    return Candidate(made, values, form, fixed=True, pliable=freely, moved=moved)


def _late_s(nominal: Nominal, values: Mapping[str, float], form: str = "") -> Floats:
    """(samples,) the delay of a course of time, as the channel has it."""
    reference, step = nominal.reference, nominal.keep.step or 1
    times = (
        -(-len(nominal.strain) // step),
        nominal.start_s - reference.start_s,
        nominal.dt_s * step,
        reference.duration_s,
    )
    late = _late(tuple((k, v) for k, v in values.items() if k != SCAN), form, *times)
    if SCAN in values:
        # All are read before the first one is again.
        most = nominal.dt_s / len(nominal.codes)
        late = late + float(np.clip(values[SCAN], -most, most)) * nominal.channel
    return late


@lru_cache(maxsize=8)
def _late(
    values: tuple[tuple[str, float], ...],
    form: str,
    samples: int,
    first_s: float,
    step_s: float,
    duration_s: float,
) -> Floats:
    """The same of the first channel; every one asks for it."""
    given, times = dict(values), (samples, first_s, step_s, duration_s)
    since = _since(*times)
    late: Floats = given.get("delay_s", 0.0) + given.get("skew", 0.0) * duration_s * since
    if form in WAVES:
        turns = duration_s * since / given["period_s"] + given["phase"]
        swing = given["swing_s"] * wave(WAVES[form], turns)
        # Where in a batch of readings a next recording begins, nobody knows.
        late = late + np.where((since < 1.0) | (given["period_s"] > LONG_PERIOD_S), swing, 0.0)
    # What is to come is not known: the last delay stays, or grows on evenly.
    if not given.keys().isdisjoint(COURSES):
        late = late + _courses(*times) @ np.array([given.get(key, 0.0) for key in COURSES])
    if KNOTS[0] in given:
        at, knots = np.linspace(0.0, 1.0, len(KNOTS)), np.array([given[key] for key in KNOTS])
        wandered: Floats = late + np.interp(_passed(*times), at, knots)
        # What wandered freely has no pace either: it goes back to where it was on the whole.
        beyond = np.maximum(since - 1.0, 0.0)
        pace = given.get("skew", 0.0) * duration_s
        mean = given.get("delay_s", 0.0) + 0.5 * pace + float(knots.mean())
        held = wandered - pace * beyond
        returning: Floats = mean + (held - mean) * np.exp(-beyond / RETURNS)
        return returning
    return late


@lru_cache(maxsize=8)
def _courses(samples: int, first_s: float, step_s: float, duration_s: float) -> Floats:
    """(samples, courses) of the time that has passed; every channel asks for the same."""
    passed = _passed(samples, first_s, step_s, duration_s)
    return np.asarray(np.polynomial.legendre.legvander(2.0 * passed - 1.0, len(COURSES) + 1)[:, 2:])


@lru_cache(maxsize=8)
def _passed(samples: int, first_s: float, step_s: float, duration_s: float) -> Floats:
    """(samples,) of the reference's time, that is 1 at its end and stays so."""
    passed: Floats = np.clip(_since(samples, first_s, step_s, duration_s), 0.0, 1.0)
    return passed


def _since(samples: int, first_s: float, step_s: float, duration_s: float) -> Floats:
    """(samples,) time since the reference began, of its duration."""
    since: Floats = (first_s + step_s * np.arange(samples, dtype=np.float64)) / duration_s
    return since


def _moved(nominal: Nominal, values: Mapping[str, float], form: str = "") -> Floats:
    """(samples,) the strain so late."""
    always = replace(nominal, keep=slice(None))
    return _read(straight_pieces(nominal.strain), always, _late_s(always, values, form))


def _read(pieces: Floats, nominal: Nominal, late_s: Floats) -> Floats:
    """(kept samples,) what goes in ``pieces`` (powers, samples - 1), so late; beyond its ends it
    rests."""
    read = np.empty(len(late_s))
    _read_at(pieces, float(nominal.keep.step or 1), late_s / nominal.dt_s, read)
    return read


@compiled
def _read_at(pieces: Floats, step: float, late: Floats, read: Floats) -> None:
    """Write what ``pieces`` are at every so manyth sample, ``late`` (samples,) before it."""
    last = pieces.shape[1] - 1
    for k in range(len(read)):
        at = min(max(k * step - late[k], 0.0), last + 1.0)
        piece = min(int(at), last)
        value, part = 0.0, at - piece
        for power in range(len(pieces) - 1, -1, -1):
            value = value * part + pieces[power, piece]
        read[k] = value


EFFECT = Effect(
    name="delay",
    stage="motion",
    mechanism="clocks of motion and sensors are apart, or run apart, or channels are read in turn",
    equation="x(t - d0 - d1 t)",
    source="clock offset and skew; a multiplexer's scan",
    fingerprint="late without attenuation; with skew, later and later; read in turn, each channel "
    "by as much more",
    parameters=(
        Parameter("delay_s", "s", 0.001, 0.5, 0.1, "offset d0"),
        Parameter("skew", "1", 0.0, 0.002, 0.0, "relative difference of the clocks d1"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    fine=Fine(
        at,
        STEPS,
        (("delay_s", "skew", *COURSES), ("delay_s", SCAN), KNOTS),
        Recurring("delay_s", "skew", "swing_s", _late_s, WAVES),
    ),
    exact=True,
)
