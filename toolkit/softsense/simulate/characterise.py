"""What one sensor does, measured on a recording: hysteresis, drift, relaxation, noise and so on.

Loop area, noise and linearity are read off the recording without a model. What has several
causes at once (drift, overshoot, relaxation, friction) is told apart by one linear regression on
known shapes: a static curve, stop operators, relaxing poles, the smoothed speed, and time.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from softsense.effects import Context, effect
from softsense.effects.operators import low_pass, rate
from softsense.errors import SoftsenseError
from softsense.recording import Recording
from softsense.simulate.rig import Rig
from softsense.simulate.run import run

Floats = NDArray[np.float64]

BINS = 25
_CURVE_KNOTS = 16
# Overshoot is smoothed, and friction slips, over these; see their effects' defaults.
_OVERSHOOT_S = 0.8
_SLIP = 0.15
_TAU_RATIO = 1.6
_MAX_POLES = 3
# A further pole must take away this share of what is left.
_POLE_GAIN = 0.03
_SETTLED = 0.05
_NET_STEPS = 200
_BASE_BINS = 3
# Paired samples that differ by more than this share of their span are not repeatable.
UNREPEATABLE = 0.15


@dataclass(frozen=True)
class SensorCharacter:
    """One sensor; ``matrix`` as its rig says.

    Shares are of ``span_codes``, the span of its mean curve over the target.

    ``curve``: (bins,) mean code rising, falling and both, at ``Character.target_bins``; NaN where
    a bin is empty. ``relaxation``: (time constant in s, share) pairs. ``gauge_factor``: relative
    change of resistance per unit target; None where only codes are known. ``response_s``: until a
    step's response stays within 5 % of the settled one, by the fitted poles.
    """

    name: str
    matrix: str
    span_codes: float
    curve: Floats
    curve_rising: Floats
    curve_falling: Floats
    loop_area_share: float
    friction_share: float
    drift_share: float
    drift_share_per_hour: float
    relaxation: tuple[tuple[float, float], ...]
    overshoot_share: float
    response_s: float
    linearity_r2: float
    nonlinearity_share: float
    gauge_factor: float | None
    base_ohm: float | None
    noise_codes: float
    resolution: float
    static_rmse: float


@dataclass(frozen=True)
class Pair:
    """Two samples that should be the same, and the share of the span by which they differ."""

    first: str
    second: str
    difference_share: float
    repeatable: bool


@dataclass(frozen=True)
class TwoFactor:
    """How well a small network gives resistance on held-out time: from strain, from stress too.

    R^2 each, as in Fig. 4 of Thuruthel et al. (2021).
    """

    name: str
    from_strain_r2: float
    from_strain_and_stress_r2: float


@dataclass(frozen=True)
class Character:
    """All sensors of a recording; ``target_bins``: (bins,) centres in ``unit``."""

    target: str
    unit: str
    target_bins: Floats
    sensors: tuple[SensorCharacter, ...]
    pairs: tuple[Pair, ...]


def characterise(
    recording: Recording, rig: Rig | None = None, pairs: Sequence[tuple[str, str]] = ()
) -> Character:
    """Characterise every sensor of ``recording`` against its first target.

    ``rig`` tells dividers and which sensors are samples of one matrix; ``pairs`` names more.

    Raises ``SoftsenseError`` without time, or for constant columns.
    """
    recording.require_usable()
    dt_s = recording.dt_s
    y = recording.target[:, 0]
    x = (y - y.min()) / np.ptp(y)
    edges = np.linspace(y.min(), y.max(), BINS + 1)
    centres = 0.5 * (edges[1:] + edges[:-1])
    bins = np.clip(np.searchsorted(edges, y, side="right") - 1, 0, BINS - 1)
    rising = _direction(x, dt_s)
    shapes = _Shapes(x, dt_s)
    ohms = _ohms(recording, rig)
    matrices = {sensor.name: sensor.matrix for sensor in rig.sensors} if rig else {}
    sensors = tuple(
        _sensor(
            name,
            matrices.get(name, ""),
            recording.codes[:, i].astype(np.float64),
            ohms[i],
            y,
            bins,
            rising,
            shapes,
        )
        for i, name in enumerate(recording.sensors)
    )
    every = (*(_samples_of_one(rig) if rig else ()), *pairs)
    known = [pair for pair in every if set(pair) <= set(recording.sensors)]
    return Character(
        recording.targets[0],
        recording.target_units[0],
        centres,
        sensors,
        tuple(_pair(recording, sensors, *pair) for pair in known),
    )


def two_factor(recording: Recording, rig: Rig, seed: int) -> tuple[TwoFactor, ...]:
    """Predict the resistance that ``rig`` gives under the recorded strain, from its causes.

    The first seven tenths of time train a network of ten tanh units, the rest tests it.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPRegressor

    x = (recording.target[:, 0] - rig.low) / (rig.high - rig.low)
    truth = run(rig, x, seed)
    cut = round(0.7 * len(x))
    result = []
    for i, name in enumerate(rig.names):
        log_ohm = np.log(np.maximum(truth.ohm[:, i], 1e-3))
        goal = (log_ohm - log_ohm.mean()) / log_ohm.std()
        scores = []
        for inputs in (x[:, None], np.stack([x, truth.stress[:, i]], axis=1)):
            scaled = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
            net = MLPRegressor(
                hidden_layer_sizes=(10,),
                activation="tanh",
                solver="lbfgs",
                alpha=1e-5,
                max_iter=_NET_STEPS,
                random_state=seed,
            )
            with warnings.catch_warnings():
                # A step limit reached is what the scores say, not news for a user.
                warnings.simplefilter("ignore", ConvergenceWarning)
                net.fit(scaled[:cut], goal[:cut])
            wrong = goal[cut:] - net.predict(scaled[cut:])
            scores.append(1.0 - float(np.mean(wrong**2) / np.var(goal[cut:])))
        result.append(TwoFactor(name, scores[0], scores[1]))
    return tuple(result)


class _Shapes:
    """Known shapes that a sensor's code may be made of, given the strain, (samples, n) each."""

    def __init__(self, x: Floats, dt_s: float) -> None:
        self.x, self.dt_s = x, dt_s
        at = np.linspace(0.0, 1.0, _CURVE_KNOTS)
        self.static = np.maximum(1.0 - np.abs(x[:, None] - at) * (_CURVE_KNOTS - 1), 0.0)
        values = {"amplitude": 1.0, "threshold": _SLIP}
        slipped, _ = effect("hysteresis").apply(x[:, None], Context(dt_s, x), values)
        friction = slipped - x[:, None]
        speed = np.abs(rate(x, dt_s, None))[:, None]
        smooth, _ = low_pass(speed, dt_s, np.array([_OVERSHOOT_S]), None, rest=np.zeros(1))
        t = dt_s * np.arange(len(x))[:, None]
        self.length_s = float(t[-1, 0])
        time = np.hstack([t / self.length_s, np.log1p(t / 60.0)])
        self.fixed = np.hstack([self.static, friction, smooth, time])
        self.speed_95 = float(np.quantile(smooth, 0.95))
        longest = min(self.length_s / 4.0, 300.0)
        count = max(int(np.log(longest / (2.0 * dt_s)) / np.log(_TAU_RATIO)), 1)
        self.tau_s: Floats = 2.0 * dt_s * _TAU_RATIO ** np.arange(count, dtype=np.float64)
        slow, _ = low_pass(np.repeat(x[:, None], count, axis=1), dt_s, self.tau_s, None)
        self.poles = x[:, None] - slow
        everything = np.hstack([self.fixed, self.poles])
        self.gram = everything.T @ everything
        self.everything = everything

    def fit(self, code: Floats) -> tuple[Floats, tuple[int, ...], Floats]:
        """Weights of ``fixed``, the chosen poles and their weights, chosen greedily."""
        moment = self.everything.T @ code
        power = float(code @ code)
        fixed = list(range(self.fixed.shape[1]))

        def solve(poles: Sequence[int]) -> tuple[Floats, float]:
            columns = [*fixed, *(len(fixed) + pole for pole in poles)]
            gram = self.gram[np.ix_(columns, columns)]
            ridge = 1e-9 * np.trace(gram) / len(columns) * np.eye(len(columns))
            weights: Floats = np.linalg.solve(gram + ridge, moment[columns])
            left = power - 2.0 * weights @ moment[columns] + weights @ gram @ weights
            return weights, max(float(left), 0.0)

        chosen: tuple[int, ...] = ()
        weights, left = solve(chosen)
        while len(chosen) < _MAX_POLES:
            trials = [(*chosen, pole) for pole in range(len(self.tau_s)) if _apart(pole, chosen)]
            if not trials:
                break
            solved = [(solve(trial), trial) for trial in trials]
            # More than half the span relaxing is two shapes that fight, not physics.
            solved = [
                entry
                for entry in solved
                if np.abs(entry[0][0][len(fixed) :]).max() < 0.5 * np.ptp(code)
            ]
            if not solved:
                break
            (better, less), best = min(solved, key=lambda entry: entry[0][1])
            if less > (1.0 - _POLE_GAIN) * left:
                break
            weights, left, chosen = better, less, best
        return weights[: len(fixed)], chosen, weights[len(fixed) :]


def _apart(pole: int, chosen: Sequence[int]) -> bool:
    """Neighbours on the grid would fight each other with weights of opposite sign."""
    return all(abs(pole - other) >= 3 for other in chosen)


def _sensor(
    name: str,
    matrix: str,
    code: Floats,
    ohm: Floats | None,
    y: Floats,
    bins: NDArray[np.intp],
    rising: NDArray[np.bool_],
    shapes: _Shapes,
) -> SensorCharacter:
    both, up, down = (
        _bin_means(code, bins, rows) for rows in (np.ones_like(rising), rising, ~rising)
    )
    span = float(np.nanmax(both) - np.nanmin(both))
    if span == 0.0:  # the motion filled one bin only: the sensor's own range must do
        span = float(np.ptp(code))
    sign = 1.0 if np.corrcoef(y, code)[0, 1] >= 0 else -1.0
    slope, offset = np.polyfit(y, code, 1)
    straight = slope * y + offset
    per_bin = np.array([y[bins == b].mean() if (bins == b).any() else np.nan for b in range(BINS)])
    bent = both - (slope * per_bin + offset)
    fixed, poles, weights = shapes.fit(code - code.mean())
    friction, overshoot, linear, logarithmic = fixed[_CURVE_KNOTS:]
    drift = linear + logarithmic * np.log1p(shapes.length_s / 60.0)
    relaxation = tuple(
        (float(shapes.tau_s[pole]), float(sign * weight / span))
        for pole, weight in zip(poles, weights, strict=True)
    )
    noise = noise_codes(code)
    gauge = base = None
    if ohm is not None:
        mean_ohm = _bin_means(ohm, bins, np.ones_like(rising))
        # At rest, by a line through the lowest bins: a bin's mean lies half a bin above it.
        lowest = np.flatnonzero(np.isfinite(mean_ohm))[:_BASE_BINS]
        base = float(np.polyval(np.polyfit(per_bin[lowest], mean_ohm[lowest], 1), y.min()))
        gauge = float(np.polyfit(y, ohm / base, 1)[0])
    return SensorCharacter(
        name=name,
        matrix=matrix,
        span_codes=span,
        curve=both,
        curve_rising=up,
        curve_falling=down,
        loop_area_share=_mean(np.abs(up - down)) / span,
        friction_share=float(sign * friction / span),
        drift_share=float(drift / span),
        drift_share_per_hour=float(drift / span * 3600.0 / shapes.length_s),
        relaxation=relaxation,
        overshoot_share=float(overshoot * shapes.speed_95 / span),
        response_s=_settling_s(relaxation),
        linearity_r2=1.0 - float(np.var(code - straight) / np.var(code)),
        nonlinearity_share=float(np.nanmax(np.abs(bent)) / span),
        gauge_factor=gauge,
        base_ohm=base,
        noise_codes=noise,
        resolution=float(noise / abs(slope)) if slope else float("inf"),
        static_rmse=_static_rmse(code, y),
    )


def noise_codes(code: Floats) -> float:
    """Standard deviation of white noise on ``code`` (samples,), from its third differences.

    Motion smooth on the scale of a few samples drops out; a third difference multiplies the
    deviation of white noise by sqrt(20), and the median tells the deviation without the outliers.
    Rounding to codes is part of it.
    """
    third = np.diff(code, 3)
    spread = float(np.median(np.abs(third))) / 0.6745
    # Few codes make the median coarse; the mean square of the middle half then says more.
    if spread < 8.0:
        middle = third[np.abs(third) <= 3.0 * max(spread, 1.0)]
        spread = float(np.sqrt(np.mean(middle**2)))
    return spread / float(np.sqrt(20.0))


def _static_rmse(code: Floats, y: Floats) -> float:
    """RMSE in the target's unit of the best estimate from this code alone: means per code bin."""
    edges = np.unique(np.quantile(code, np.linspace(0, 1, 65)))
    bins = np.clip(np.searchsorted(edges, code, side="right") - 1, 0, max(len(edges) - 2, 0))
    count = np.bincount(bins)
    total, square = np.bincount(bins, y), np.bincount(bins, y * y)
    return float(np.sqrt((square - total**2 / np.maximum(count, 1)).sum() / len(y)))


def _direction(x: Floats, dt_s: float) -> NDArray[np.bool_]:
    """Whether the strain rises; a quarter of a second of smoothing takes tracking noise out."""
    kernel = max(round(0.25 / dt_s), 1)
    smooth = np.convolve(np.pad(x, kernel, mode="edge"), np.ones(kernel) / kernel, mode="same")
    rising: NDArray[np.bool_] = np.gradient(smooth)[kernel:-kernel] > 0.0
    return rising


def _bin_means(values: Floats, bins: NDArray[np.intp], rows: NDArray[np.bool_]) -> Floats:
    """Mean of ``values`` per bin among ``rows``; NaN where fewer than three fall."""
    count = np.bincount(bins[rows], minlength=BINS)
    total = np.bincount(bins[rows], values[rows], minlength=BINS)
    means: Floats = np.where(count >= 3, total / np.maximum(count, 1), np.nan)
    return means


def _mean(values: Floats) -> float:
    """Mean of what is a number; NaN where nothing is, e.g. of a motion that never returns."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _settling_s(relaxation: Sequence[tuple[float, float]]) -> float:
    """When sum g exp(-t/tau) stays below 5 %: on a fine grid, from the end."""
    if not relaxation:
        return 0.0
    longest = max(tau for tau, _ in relaxation)
    t = np.linspace(0.0, 8.0 * longest, 4000)
    left = np.abs(sum(g * np.exp(-t / tau) for tau, g in relaxation))
    outside = np.flatnonzero(left > _SETTLED)
    return float(t[outside[-1]]) if len(outside) else 0.0


def _ohms(recording: Recording, rig: Rig | None) -> list[Floats | None]:
    """Resistances by sensor where the divider is known, in the unit of its reference."""
    result: list[Floats | None] = []
    by_name = {sensor.name: sensor for sensor in rig.sensors} if rig else {}
    for i, name in enumerate(recording.sensors):
        code, end = recording.codes[:, i].astype(np.float64), recording.front_ends[i]
        if end.kind == "divider":
            top, reference = end.scale, end.offset
        elif name in by_name:
            top, reference = 2.0**end.bits - 1.0, by_name[name].reference_ohm
        else:
            result.append(None)
            continue
        share = np.minimum(code / top, 0.9999)
        result.append(reference * share / (1.0 - share))
    return result


def _samples_of_one(rig: Rig) -> tuple[tuple[str, str], ...]:
    """Names of sensors that are different samples of one matrix, each with the next."""
    found = []
    for matrix in dict.fromkeys(sensor.matrix for sensor in rig.sensors):
        same = [sensor.name for sensor in rig.sensors if matrix and sensor.matrix == matrix]
        found += list(pairwise(same))
    return tuple(found)


def _pair(
    recording: Recording, sensors: tuple[SensorCharacter, ...], first: str, second: str
) -> Pair:
    if first == second:
        raise SoftsenseError(f"{first!r} is paired with itself", remedy="--pairs s1:s2")
    a, b = recording.index_of((first, second))
    apart = recording.codes[:, a].astype(np.float64) - recording.codes[:, b]
    span = 0.5 * (sensors[a].span_codes + sensors[b].span_codes)
    share = float(np.sqrt(np.mean(apart**2)) / span)
    return Pair(first, second, share, share <= UNREPEATABLE)
