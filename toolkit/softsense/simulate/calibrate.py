"""Fit a rig to a recording: curve, stress states, friction, overshoot, drift and noise by sensor.

A sensor is a static curve (hat functions) with stress states and friction, and with overshoot
and drift added. Each of these terms has one non-linear parameter (a time constant, a threshold)
that runs over a grid, and a weight that is solved together with the curve. States and friction
may act before the curve, on the strain (``stress``), or behind it, on its output (``response``);
both are tried. What a term adds depends on curve and weights, so that solving is repeated
(Gauss-Newton before the curve, fixed point behind it). A term comes in only if it lowers the
error on blocks of time that the weights have not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softsense.effects import Context, effect
from softsense.recording import Recording
from softsense.simulate.characterise import noise_codes
from softsense.simulate.rig import Place, Placed, Rig, Sensor, Value
from softsense.simulate.run import run

Floats = NDArray[np.float64]

KNOTS = 25
BLOCKS = 10
# A term must lower the held-out mean square error by this share to come in.
GAIN = 0.02
MAX_STATES = 4
_ROUNDS = 8
_STEPS = (1.0, 0.5, 0.2)
# Terms tried in turn, best promise first, before the search ends.
_TRIES = 3
# These may act before the curve; the others add to the response.
BEFORE = ("relaxation", "hysteresis")
_TAU_RATIO = 1.6
_THRESHOLDS = (0.06, 0.12, 0.25, 0.5)
_OVERSHOOT_S = (0.3, 0.8, 2.0)
_DRIFT_S = (10.0, 60.0, 300.0)
# What rounding to whole codes adds to the variance.
_ROUNDING = 1.0 / 12.0
# Unknown dividers are taken to have this reference; a recording of codes cannot tell it.
_REFERENCE_OHM = 10_000.0


@dataclass(frozen=True)
class Term:
    """One effect and the value of its one non-linear parameter."""

    effect: str
    parameter: str
    value: float


@dataclass(frozen=True)
class FittedSensor:
    """How well a sensor's model fits, RMS in codes.

    ``held_out_by_states``: with 0, 1, 2, … stress states, as the search went. ``residual``: of
    the noiseless rig against the whole recording. ``noise``: the floor, from differences.
    """

    name: str
    states: int
    terms: tuple[Term, ...]
    held_out_by_states: tuple[float, ...]
    held_out: float
    residual: float
    noise: float


@dataclass(frozen=True)
class Calibration:
    """The rig, and per sensor how far it is from the recording."""

    rig: Rig
    sensors: tuple[FittedSensor, ...]


def calibrate(
    recording: Recording, advance: Callable[[int], None] = lambda done: None
) -> Calibration:
    """Fit a rig to ``recording``; its first target drives the rig.

    ``advance`` is told how many sensors are done. Raises ``SoftsenseError`` without time, for
    fewer than 500 samples, or for constant columns.
    """
    recording.require_usable(500)
    y = recording.target[:, 0]
    low, high = float(y.min()), float(y.max())
    x = (y - low) / (high - low)
    rate_hz = float(f"{1.0 / recording.dt_s:.9g}")
    fits = []
    for channel in range(len(recording.sensors)):
        fits.append(_fit(recording, channel, x, 1.0 / rate_hz))
        advance(channel + 1)
    rig = _rig(recording, fits, low, high, rate_hz)
    quiet = replace(rig, effects=tuple(e for e in rig.effects if e.name != "noise"))
    gap = run(quiet, x).volts * (2**rig.adc_bits - 1) - recording.codes
    sensors = tuple(
        replace(fit.report, residual=float(np.sqrt(np.mean(gap[:, i] ** 2))))
        for i, fit in enumerate(fits)
    )
    return Calibration(rig, sensors)


@dataclass(frozen=True)
class _Fit:
    """One sensor as fitted, and how its shares become ohm."""

    scale: _Scale
    solution: _Solution
    report: FittedSensor


@dataclass(frozen=True)
class _Solution:
    """Terms and what was solved for them: ``curve`` at knots from ``low`` to ``high``.

    ``wrong``: mean square error in codes, of the model itself and not of its linearisation.
    """

    place: Place
    terms: tuple[Term, ...]
    weights: Floats
    curve: Floats
    low: float
    high: float
    wrong: float


@dataclass(frozen=True)
class _Scale:
    """How codes become shares of a sensor's span and back: the divider, base and span."""

    top: float
    reference_ohm: float
    base_ohm: float
    span: float

    def response(self, code: Floats) -> Floats:
        """u of ``code``; the rails stand for half a code inside them."""
        share = np.clip(code / self.top, 0.5 / self.top, 1.0 - 0.5 / self.top)
        result: Floats = (
            self.reference_ohm * share / (1.0 - share) / self.base_ohm - 1.0
        ) / self.span
        return result

    def codes(self, response: Floats) -> Floats:
        """Code of ``response`` before rounding."""
        ohm = np.maximum(self.base_ohm * (1.0 + self.span * response), 0.0)
        result: Floats = self.top * ohm / (ohm + self.reference_ohm)
        return result

    def work(self, model: Floats, code: Floats) -> tuple[Floats, Floats]:
        """Working response and weight of Gauss-Newton at responses ``model``.

        (work - model) weight = code - code(model), weight = d code / d u at ``model``, held
        within the ADC's scale, where the weight is never nil.
        """
        low, high = self.response(np.zeros(1))[0], self.response(np.full(1, self.top))[0]
        inside = np.clip(model, min(low, high), max(low, high))
        ohm = self.base_ohm * (1.0 + self.span * inside)
        weight = self.top * self.reference_ohm / (ohm + self.reference_ohm) ** 2
        weight = weight * abs(self.base_ohm * self.span)
        sign = 1.0 if self.span > 0 else -1.0
        return inside + sign * (code - self.codes(inside)) / weight, weight


@dataclass(frozen=True)
class _Linear:
    """goal = [hats, columns] @ [curve, weights] near a solution whose own output is ``model``.

    ``work``: the response that ``model`` is to reach; ``weight``: codes per response.
    """

    hats: Floats
    columns: list[Floats]
    goal: Floats
    work: Floats
    weight: Floats
    model: Floats
    low: float
    high: float
    curve: Floats


class _Problem:
    """One sensor's weighted least squares, with normal equations kept by block of time."""

    def __init__(self, x: Floats, dt_s: float, scale: _Scale, code: Floats, place: Place) -> None:
        self.x, self.scale, self.code, self.place = x, scale, code, place
        self.context = Context(dt_s, x)
        bend = np.diff(np.eye(KNOTS), 2, axis=0)
        self.smooth = bend.T @ bend
        self.edges = np.linspace(0, len(x), BLOCKS + 1).astype(int)

    def wrong(self, model: Floats) -> float:
        """Mean square error in codes of responses ``model``."""
        return float(np.mean((self.scale.codes(model) - self.code) ** 2))

    def hats(self, z: Floats, low: float, high: float) -> Floats:
        """(samples, knots) hat functions of ``z`` within low … high."""
        at = (z - low) / (high - low) * (KNOTS - 1)
        knot = np.clip(at.astype(np.intp), 0, KNOTS - 2)
        hats = np.zeros((len(z), KNOTS))
        rows = np.arange(len(z))
        hats[rows, knot] = 1.0 - (at - knot)
        hats[rows, knot + 1] = at - knot
        return hats

    def added(self, term: Term, source: Floats) -> Floats:
        """(samples,) what one unit of ``term`` adds to ``source``."""
        values: dict[str, ArrayLike] = {"amplitude": 1.0, term.parameter: term.value}
        changed, _ = effect(term.effect).apply(source[:, None], self.context, values)
        result: Floats = changed[:, 0] - source
        return result

    def states(self, terms: Sequence[Term], weights: Floats, source: Floats) -> list[Floats]:
        """What one unit of each term adds: states to ``source``, friction to it with states."""
        relaxed = source
        units = {}
        for number, term in enumerate(terms):
            if term.effect == "relaxation":
                units[number] = self.added(term, source)
                if number < len(weights):
                    relaxed = relaxed + weights[number] * units[number]
        for number, term in enumerate(terms):
            if term.effect == "hysteresis":
                units[number] = self.added(term, relaxed)
            elif term.effect != "relaxation":
                units[number] = self.added(term, np.zeros_like(source))
        return [units[number] for number in range(len(terms))]

    def forward(self, solution: _Solution, terms: Sequence[Term] = ()) -> _Linear:
        """The model around ``solution``, with columns for its terms and for further ``terms``."""
        every = (*solution.terms, *terms)
        behind = self.place == "response"
        curve = solution.curve
        if behind:
            hats = self.hats(self.x, solution.low, solution.high)
            output = hats @ curve
            units = self.states(every, solution.weights, output)
            model = output.copy()
            for weight, unit in zip(solution.weights, units, strict=False):
                model += weight * unit
            work, weight = self.scale.work(model, self.code)
            low, high = solution.low, solution.high
            return _Linear(hats, units, work, work, weight, model, low, high, curve)
        units = self.states(every, solution.weights, self.x)
        moved = np.zeros_like(self.x)
        for weight, unit, term in zip(solution.weights, units, every, strict=False):
            if term.effect in BEFORE:
                moved += weight * unit
        z = self.x + moved
        low, high = float(z.min()), float(z.max())
        # The old curve on the new range, level beyond its ends until it is solved anew.
        at = np.linspace(low, high, KNOTS)
        old = np.linspace(solution.low, solution.high, KNOTS)
        curve = np.interp(at, old, curve)
        hats = self.hats(z, low, high)
        slopes = np.diff(curve) / (at[1] - at[0])
        slope = slopes[np.clip(((z - low) / (at[1] - at[0])).astype(np.intp), 0, KNOTS - 2)]
        columns = [
            slope * unit if term.effect in BEFORE else unit
            for unit, term in zip(units, every, strict=True)
        ]
        model = hats @ curve
        for weight, unit, term in zip(solution.weights, units, every, strict=False):
            if term.effect not in BEFORE:
                model += weight * unit
        # curve(z) near the old z is hats @ curve + slope (z - old z): the old part to the goal
        work, weight = self.scale.work(model, self.code)
        goal = work + slope * moved
        return _Linear(hats, columns, goal, work, weight, model, low, high, curve)

    def normal(self, linear: _Linear) -> tuple[Floats, Floats, Floats]:
        """Per block: Gram matrices, moments with the goal, and its power."""
        columns = np.column_stack([linear.hats, *linear.columns])
        grams, moments, powers = [], [], []
        for begin, end in zip(self.edges[:-1], self.edges[1:], strict=True):
            part = columns[begin:end] * linear.weight[begin:end, None]
            goal = linear.goal[begin:end] * linear.weight[begin:end]
            grams.append(part.T @ part)
            moments.append(part.T @ goal)
            powers.append(float(goal @ goal))
        return np.stack(grams), np.stack(moments), np.array(powers)

    def solve(self, gram: Floats, moment: Floats) -> Floats:
        """Weights; the curve is held smooth where the motion hardly goes."""
        count = len(moment)
        size = np.trace(gram) / count
        stiff = 1e-9 * size * np.eye(count)
        stiff[:KNOTS, :KNOTS] += 1e-5 * size * self.smooth
        weights: Floats = np.linalg.solve(gram + stiff, moment)
        return weights

    def held_out(self, normal: tuple[Floats, Floats, Floats], use: NDArray[np.intp]) -> float:
        """Mean square error, in codes squared, on blocks whose weights never saw them."""
        grams, moments, powers = normal
        grams, moments = grams[:, use[:, None], use], moments[:, use]
        gram, moment = grams.sum(axis=0), moments.sum(axis=0)
        wrong = 0.0
        for block in range(BLOCKS):
            w = self.solve(gram - grams[block], moment - moments[block])
            wrong += float(powers[block] - 2.0 * w @ moments[block] + w @ grams[block] @ w)
        return max(wrong, 0.0) / len(self.x)


def _fit(recording: Recording, channel: int, x: Floats, dt_s: float) -> _Fit:
    code = recording.codes[:, channel].astype(np.float64)
    end = recording.front_ends[channel]
    top = 2.0**end.bits - 1.0
    known = end.kind == "divider" and abs(end.scale - top) < 0.5
    reference = end.offset if known else _REFERENCE_OHM
    share = np.clip(code / top, 0.5 / top, 1.0 - 0.5 / top)
    ohm = reference * share / (1.0 - share)
    near_rest, near_full = x <= np.quantile(x, 0.05), x >= np.quantile(x, 0.95)
    base = max(float(np.median(ohm[near_rest])), 0.2 * float(np.median(ohm)))
    reach = float(np.median(ohm[near_full])) / base - 1.0
    # A sensor whose ends are alike bends in between; any span will do to scale it.
    span = reach if abs(reach) > 0.05 else float(np.ptp(ohm)) / base
    scale = _Scale(top, reference, base, span)
    places: tuple[Place, ...] = ("stress", "response")
    tried = [_choose(_Problem(x, dt_s, scale, code, place)) for place in places]
    solution, held_out, by_states = min(tried, key=lambda one: max(one[0].wrong, one[1]))
    terms = solution.terms
    report = FittedSensor(
        recording.sensors[channel],
        sum(term.effect == "relaxation" for term in terms),
        terms,
        tuple(float(np.sqrt(value)) for value in by_states),
        float(np.sqrt(held_out)),
        0.0,
        noise_codes(code),
    )
    return _Fit(scale, solution, report)


def _candidates(samples: int, dt_s: float) -> tuple[Term, ...]:
    longest = min(samples * dt_s / 4.0, 300.0)
    count = max(int(np.log(longest / (4.0 * dt_s)) / np.log(_TAU_RATIO)) + 1, 1)
    taus = 4.0 * dt_s * _TAU_RATIO ** np.arange(count)
    return (
        *(Term("relaxation", "tau_s", float(f"{tau:.6g}")) for tau in taus),
        *(Term("hysteresis", "threshold", value) for value in _THRESHOLDS),
        *(Term("overshoot", "tau_s", value) for value in _OVERSHOOT_S),
        *(Term("drift", "tau_s", value) for value in _DRIFT_S),
    )


def _choose(problem: _Problem) -> tuple[_Solution, float, tuple[float, ...]]:
    """Add the best term while held-out time says so.

    Returns the solution, its held-out mean square, and that for each number of stress states on
    the way.
    """
    candidates = _candidates(len(problem.x), problem.context.dt_s)
    none = np.zeros(0)
    flat = _Solution(problem.place, (), none, np.zeros(KNOTS), 0.0, 1.0, np.inf)
    solution = _refine(problem, flat)
    taken = np.arange(KNOTS)
    best = problem.held_out(problem.normal(problem.forward(solution)), taken)
    by_states = [best]
    while True:
        open_ones = [term for term in candidates if _may_join(term, solution.terms)]
        if not open_ones:
            break
        normal = problem.normal(problem.forward(solution, open_ones))
        trials = [
            problem.held_out(normal, np.append(taken, len(taken) + number))
            for number in range(len(open_ones))
        ]
        better = None
        for number in np.argsort(trials)[:_TRIES]:
            if trials[number] > (1.0 - GAIN) * best:
                break
            more = replace(
                solution,
                terms=(*solution.terms, open_ones[number]),
                weights=np.append(solution.weights, 0.0),
            )
            refined = _tune(problem, _refine(problem, more))
            held = problem.held_out(
                problem.normal(problem.forward(refined)), np.arange(KNOTS + len(refined.terms))
            )
            # What is good only as long as it is small promised more than it keeps.
            if held < (1.0 - 0.5 * GAIN) * best and refined.wrong < solution.wrong:
                better = refined, held
                break
        if better is None:
            break
        solution, best = better
        taken = np.append(taken, len(taken))
        states = sum(term.effect == "relaxation" for term in solution.terms)
        by_states[states:] = [best]
    solution, best = _prune(problem, solution, best)
    return solution, best, tuple(by_states)


def _prune(problem: _Problem, solution: _Solution, best: float) -> tuple[_Solution, float]:
    """Drop terms that later ones have made needless: a state between two that came after it."""
    while solution.terms:
        every = np.arange(KNOTS + len(solution.terms))
        normal = problem.normal(problem.forward(solution))
        trials = [problem.held_out(normal, np.delete(every, i)) for i in every[KNOTS:]]
        number = int(np.argmin(trials))
        fewer = replace(
            solution,
            terms=solution.terms[:number] + solution.terms[number + 1 :],
            weights=np.delete(solution.weights, number),
            wrong=np.inf,
        )
        refined = _tune(problem, _refine(problem, fewer))
        held = problem.held_out(problem.normal(problem.forward(refined)), every[:-1])
        if held > (1.0 + GAIN) * best:
            break
        solution, best = refined, held
    return solution, best


def _may_join(term: Term, chosen: Sequence[Term]) -> bool:
    """Each effect once; stress states up to ``MAX_STATES`` and not side by side on the grid."""
    same = [other for other in chosen if other.effect == term.effect]
    if term.effect != "relaxation":
        return not same
    near = _TAU_RATIO**1.5
    return len(same) < MAX_STATES and all(
        not 1.0 / near < term.value / other.value < near for other in same
    )


def _tune(problem: _Problem, solution: _Solution) -> _Solution:
    """Move every non-linear parameter off its grid, by halves, quarters and eighths of a step."""
    count = len(solution.terms)
    for part in (0.5, 0.25, 0.125):
        for number in range(count):
            term = solution.terms[number]
            near = [replace(term, value=term.value * _TAU_RATIO**way) for way in (-part, part)]
            normal = problem.normal(problem.forward(solution, near))
            taken = np.arange(KNOTS + count)
            now = problem.held_out(normal, taken)
            trials = []
            for extra in range(len(near)):
                use = taken.copy()
                use[KNOTS + number] = KNOTS + count + extra
                trials.append(problem.held_out(normal, use))
            best = int(np.argmin(trials))
            if trials[best] < now:
                value = float(f"{near[best].value:.6g}")
                terms = list(solution.terms)
                terms[number] = replace(term, value=value)
                moved = _refine(problem, replace(solution, terms=tuple(terms), wrong=np.inf))
                if moved.wrong < solution.wrong:
                    solution = moved
    return solution


def _refine(problem: _Problem, solution: _Solution) -> _Solution:
    """Solve curve and weights together, again and again; shorter steps where a step overshoots."""
    for _ in range(_ROUNDS):
        linear = problem.forward(solution)
        grams, moments, _ = problem.normal(linear)
        solved = problem.solve(grams.sum(axis=0), moments.sum(axis=0))
        for share in _STEPS:
            moved = _step(problem, solution, solved, share)
            if moved.wrong < solution.wrong:
                break
        else:
            break
        rests = moved.wrong > 0.999 * solution.wrong
        solution = moved
        if rests:
            break
    return solution


def _step(problem: _Problem, solution: _Solution, solved: Floats, share: float) -> _Solution:
    """``solution`` moved by ``share`` of the way to ``solved``."""
    weights = solution.weights + share * (solved[KNOTS:] - solution.weights)
    if problem.place == "response":
        curve = solution.curve + share * (solved[:KNOTS] - solution.curve)
        moved = replace(solution, weights=weights, curve=curve)
    else:
        # With the weights given, the curve over the strain and its states is solved exactly.
        linear = problem.forward(replace(solution, weights=weights))
        rest = linear.model - linear.hats @ linear.curve
        known = replace(linear, columns=[], goal=linear.work - rest)
        grams, moments, _ = problem.normal(known)
        curve = problem.solve(grams.sum(axis=0), moments.sum(axis=0))
        moved = _Solution(
            problem.place, solution.terms, weights, curve, linear.low, linear.high, np.inf
        )
    return replace(moved, wrong=problem.wrong(problem.forward(moved).model))


def _rig(
    recording: Recording, fits: Sequence[_Fit], low: float, high: float, rate_hz: float
) -> Rig:
    sensors = tuple(
        Sensor(
            name=name,
            matrix="",
            sample=1,
            base_ohm=fit.scale.base_ohm,
            reference_ohm=fit.scale.reference_ohm,
            span=fit.scale.span,
            curve=tuple(fit.solution.curve.tolist()),
            curve_low=fit.solution.low,
            curve_high=fit.solution.high,
            stress_share=1.0 if fit.solution.place == "stress" else 0.0,
        )
        for name, fit in zip(recording.sensors, fits, strict=True)
    )
    placed = []
    for place in ("stress", "response"):
        for name in ("relaxation", "hysteresis", "overshoot", "drift"):
            rows = [_sizes(fit, name, place) for fit in fits]
            if any(rows):
                placed.append(_placed(name, place, rows))
    level = tuple(float(np.sqrt(max(fit.report.noise**2 - _ROUNDING, 0.0))) for fit in fits)
    placed.append(Placed("noise", "electrical", {"level_lsb": level}))
    return Rig(
        name=recording.name,
        sensors=sensors,
        effects=tuple(placed),
        target=recording.targets[0],
        low=low,
        high=high,
        rate_hz=rate_hz,
        adc_bits=recording.adc_bits,
        notes=(f"fitted to the recording {recording.name}",),
    )


def _sizes(fit: _Fit, name: str, place: Place) -> list[tuple[float, float]]:
    """(weight, parameter) of each of a sensor's terms ``name`` at ``place``."""
    solution = fit.solution
    where = solution.place if name in BEFORE else "response"
    return [
        (float(weight), term.value)
        for term, weight in zip(solution.terms, solution.weights, strict=True)
        if term.effect == name and where == place
    ]


def _placed(name: str, place: Place, rows: list[list[tuple[float, float]]]) -> Placed:
    """One effect for all sensors; a sensor without it, or with fewer parts, has amplitude 0."""
    parameter = "threshold" if name == "hysteresis" else "tau_s"
    size = max(map(len, rows))
    neutral = (0.0, effect(name).defaults()[parameter])
    full = [[*row, *[neutral] * (size - len(row))] for row in rows]
    values: dict[str, Value] = {}
    for position, key in enumerate(("amplitude", parameter)):
        if name == "relaxation":
            values[key] = tuple(tuple(part[position] for part in row) for row in full)
        else:
            values[key] = tuple(row[0][position] for row in full)
    return Placed(name, place, values)
