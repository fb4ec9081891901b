"""Delay: two clocks that are apart, or run apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

FORMS = ("smooth", "linear")
# Cosines of time that say how a delay wanders, slowly or less so.
COURSES = (4, 8)
# Around which a delay may wander where clocks run apart, but not evenly, in seconds.
WANDERING_S = np.array([-0.3, -0.1, -0.03, 0.03, 0.1, 0.3])
# Delays at the beginning and the end of a recording, in seconds, where clocks run apart.
ENDS_S = (0.0, 0.05, 0.2, 0.5, 1.5)
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
    delays = np.geomspace(0.01, 1.0, 27)
    slope = np.gradient(nominal.u) / nominal.dt_s
    skew = np.stack([-slope, -slope * nominal.time_s / 400.0], axis=1)
    ends = [(sign * late, sign * later) for sign in (1.0, -1.0) for late, later in SKEWED]
    return [
        *_traces(nominal, np.concatenate([-delays, delays]), ("smooth",)),
        *_skewed(nominal, ends),
        Candidate(skew, {}, "skew"),
    ]


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one offset, or around those at the beginning and the end; or wandering."""
    if "delay_s" not in values:
        return _wandering(nominal, [(late_s, late_s) for late_s in WANDERING_S])
    first = values["delay_s"]
    if "skew" in values:
        last = first + values["skew"] * nominal.reference.duration_s
        reach = max(abs(first), abs(last)) * np.linspace(-0.3, 0.3, 7)
        even = _skewed(nominal, [(first + a, last + b) for a in reach for b in reach])
        ends = [(first + a, last + b) for a in reach[1::2] for b in reach[1::2]]
        return even + _wandering(nominal, ends)
    near_s = first * np.geomspace(0.8, 1.25, 15)
    return _traces(nominal, near_s, FORMS) + _wandering(
        nominal, [(late_s, late_s) for late_s in near_s[1::6]]
    )


def _traces(nominal: Nominal, delays_s: Floats, forms: tuple[str, ...]) -> list[Candidate]:
    """Straight between samples, as software reads late, and smooth, as nature is late."""
    u = nominal.u
    pieces = {
        "smooth": CubicSpline(np.arange(len(u)), u).c[::-1],
        "linear": np.stack([u[:-1], np.diff(u)]),
    }
    result = []
    for delay_s in delays_s:
        values = {"delay_s": float(delay_s)}
        for form in forms:
            shifted = _shifted(u, pieces[form], delay_s / nominal.dt_s)
            column = (shifted - u)[nominal.keep, None]
            moved = partial(_moved, nominal, values)
            result.append(Candidate(column.copy(), values, form, fixed=True, moved=moved))
    return result


def _wandering(nominal: Nominal, ends_s: Sequence[tuple[float, float]]) -> list[Candidate]:
    """Delays that wander slowly around an even course of time, by Taylor's first term."""
    t, reference = nominal.time_s[nominal.keep], nominal.reference
    # What is to come is not known: the last delay stays.
    passed = np.clip((t - reference.start_s) / reference.duration_s, 0.0, 1.0)
    course = np.cos(np.pi * passed[:, None] * np.arange(max(COURSES)))
    slope = -np.gradient(nominal.u) / nominal.dt_s
    result = []
    for even in _skewed(nominal, ends_s):
        late_s = _late_s(nominal, even.values)
        columns = np.concatenate([even.columns, _read(slope, nominal, late_s)[:, None] * course], 1)
        wandering = replace(even, form="wandering", fixed=False, curved=True, pliable=True)
        result += [replace(wandering, made=columns[:, : 1 + count]) for count in COURSES]
    return result


def _skewed(nominal: Nominal, ends_s: Sequence[tuple[float, float]]) -> list[Candidate]:
    """Delays that go from one to another over the time of the reference."""
    result = []
    for first, last in ends_s:
        values = {"delay_s": float(first)}
        if first != last:
            values["skew"] = float((last - first) / nominal.reference.duration_s)
        read = _read(nominal.u, nominal, _late_s(nominal, values))
        column = (read - nominal.u[nominal.keep])[:, None]
        moved = partial(_moved, nominal, values)
        result.append(Candidate(column, values, "skewed", fixed=True, moved=moved))
    return result


def _late_s(nominal: Nominal, values: Mapping[str, float]) -> Floats:
    """(samples,) the delay of an even course of time."""
    since_s = nominal.time_s[nominal.keep] - nominal.reference.start_s
    return values["delay_s"] + values.get("skew", 0.0) * since_s


def _moved(nominal: Nominal, values: Mapping[str, float]) -> Floats:
    """(samples,) the strain so late."""
    always = replace(nominal, keep=slice(None))
    return _read(nominal.strain, always, _late_s(always, values))


def _read(u: Floats, nominal: Nominal, late_s: Floats) -> Floats:
    """(samples,) ``u`` so late, straight between samples; beyond its ends it rests."""
    now = np.arange(len(u), dtype=np.float64)[nominal.keep]
    at = np.clip(now - late_s / nominal.dt_s, 0.0, len(u) - 1.0)
    below = np.minimum(at.astype(np.intp), len(u) - 2)
    return np.asarray(u[below] + (at - below) * (u[below + 1] - u[below]))


def _shifted(u: Floats, pieces: Floats, late: float) -> Floats:
    """(samples,) ``u`` so many samples ``late``; beyond its ends it rests.

    ``pieces`` (powers, samples - 1): polynomials of the way from one sample to the next, of which
    a constant delay meets every one at the same place.
    """
    first = int(np.floor(-late))
    part = -late - first
    at = pieces[-1].copy()
    for factors in pieces[-2::-1]:
        at *= part
        at += factors
    moved = np.full(len(u), u[0] if late > 0 else u[-1])
    begin, end = max(-first, 0), min(len(u) - first - 1, len(u))
    moved[begin:end] = at[begin + first : end + first]
    return moved


EFFECT = Effect(
    name="delay",
    stage="motion",
    mechanism="clocks of motion and sensors are apart, or run apart",
    equation="x(t - d0 - d1 t)",
    source="clock offset and skew",
    fingerprint="late without attenuation; with skew, later and later",
    parameters=(
        Parameter("delay_s", "s", 0.005, 0.5, 0.1, "offset d0"),
        Parameter("skew", "1", 0.0, 0.002, 0.0, "relative difference of the clocks d1"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    exact=True,
)
