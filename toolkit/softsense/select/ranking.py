"""Rank subsets of sensors by how well they determine the target."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from softsense.errors import SoftsenseError
from softsense.information import (
    entropy,
    gaussian,
    labels_of,
    mutual_information,
    nearest_neighbour,
    subset_entropies,
)
from softsense.notebook import Shown
from softsense.recording import Recording
from softsense.select import coverage, greedy, polynomial

Floats = NDArray[np.float64]

CRITERIA = ("score", "cmim", "jmi")
UNIFORM = ("none", "weight", "resample")
UNSEEN = ("stretches", "samples")
# Up to here every subset is scored (2^10 - 1 of them, 1001 features); beyond, forward selection.
EXHAUSTIVE_SENSORS = 10
GREEDY_SIZE = 7
# The basis of a forward step stays below this, by a lower degree for more sensors.
GREEDY_FEATURES = 330
LN2 = float(np.log(2.0))


@dataclass(frozen=True)
class Subset:
    """A set of sensors and what it tells about the targets.

    ``score``: bits 0.5 log2(target variance / held-out squared error) of a cross-validated
    polynomial regression, the error a geometric mean over the folds; larger is better,
    within and across sizes. On one Gaussian target it is the mutual information. Several targets
    add up their variances and errors, in their common unit or, where units differ, each relative to
    its own variance: so the score foretells the mean squared error of a network with those outputs.

    ``mi_bits``: plug-in joint mutual information on raw codes, the paper's measure; it saturates
    at the target's entropy from about three sensors on.

    ``mi_lower_bits``: nearest neighbours between the held-out estimate and the target, which by
    data processing is an estimate of a lower bound of the mutual information (of the best told of
    several targets; None for the candidates that a forward step passed over).
    """

    sensors: tuple[str, ...]
    score: float
    mi_bits: float
    mi_lower_bits: float | None

    @property
    def mi_nats(self) -> float:
        """``mi_bits`` in nats."""
        return self.mi_bits * LN2


@dataclass(frozen=True)
class Single:
    """One sensor alone: plug-in I(X;Y) and H(X) of its raw codes."""

    mi_bits: float
    entropy_bits: float


@dataclass(frozen=True, repr=False)
class Ranking(Shown):
    """What every sensor and every ranked subset tells.

    ``dissimilarity_bits``: [i, j] is I(Xj;Y|Xi), what sensor j adds to sensor i (plug-in).
    ``subsets``: by size, best score first. ``method``: "exhaustive", or "forward" where only the
    candidates of each step were looked at. ``evenness``: per target, 1 when it covers its range
    uniformly. ``seconds``: CPU time of the parts.
    """

    targets: tuple[str, ...]
    singles: dict[str, Single]
    target_entropy_bits: float
    dissimilarity_bits: Floats
    subsets: tuple[Subset, ...]
    best: dict[int, tuple[str, ...]]
    method: str
    evenness: tuple[float, ...]
    seconds: dict[str, float]

    def of_size(self, size: int) -> tuple[Subset, ...]:
        """Subsets of ``size`` sensors, best first."""
        return tuple(subset for subset in self.subsets if len(subset.sensors) == size)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why the numbers should be read with care."""
        return tuple(
            f"{target} does not cover its range evenly (evenness {value:.2f} of 1): sensors that "
            "are good where it dwells are favoured; see --uniform"
            for target, value in zip(self.targets, self.evenness, strict=True)
            if value < coverage.EVEN_ENOUGH
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        names = tuple(self.singles)
        return {
            "target": list(self.targets),
            "target_entropy_bits": self.target_entropy_bits,
            "sensors": {
                name: {
                    "mi_bits": one.mi_bits,
                    "mi_nats": one.mi_bits * LN2,
                    "entropy_bits": one.entropy_bits,
                }
                for name, one in self.singles.items()
            },
            "dissimilarity_bits": {
                first: {
                    second: float(self.dissimilarity_bits[i, j])
                    for j, second in enumerate(names)
                    if i != j
                }
                for i, first in enumerate(names)
            },
            "subsets": [
                {
                    "sensors": list(subset.sensors),
                    "mi_bits": subset.mi_bits,
                    "mi_nats": subset.mi_nats,
                    "mi_lower_bits": subset.mi_lower_bits,
                    "score": subset.score,
                }
                for subset in self.subsets
            ],
            "best": {str(size): list(sensors) for size, sensors in self.best.items()},
            "method": self.method,
            "evenness": dict(zip(self.targets, self.evenness, strict=True)),
            "warnings": list(self.warnings),
            "seconds": self.seconds,
        }

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        best = [(f"best {size}", " ".join(sensors)) for size, sensors in sorted(self.best.items())]
        return [("subsets", f"{len(self.subsets)} ({self.method})"), *best]


@dataclass(frozen=True, repr=False)
class Selection(Shown):
    """The chosen sensors, and the alternatives of the same size (best first, itself included)."""

    sensors: tuple[str, ...]
    score: float
    mi_bits: float
    ranking: tuple[Subset, ...]

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [
            ("sensors", " ".join(self.sensors)),
            ("score", f"{self.score:.4g}"),
            ("mutual information", f"{self.mi_bits:.3f} bit"),
            ("next best", " ".join(self.ranking[1].sensors) if len(self.ranking) > 1 else "none"),
        ]


@dataclass(frozen=True)
class Scored:
    """Scores and lower bounds by sensor numbers, and the CPU time they took.

    Forward selection bounds only what it chose; its bounds' time is within ``score_s``.
    """

    score: dict[tuple[int, ...], float]
    lower: dict[tuple[int, ...], float]
    score_s: float
    lower_s: float


def rank(
    rec: Recording,
    max_size: int | None = None,
    *,
    criterion: str = "score",
    uniform: str = "none",
    unseen: str = "samples",
    seed: int = 0,
) -> Ranking:
    """Rank the subsets of up to ``max_size`` sensors.

    Up to ten sensors every subset is scored; with more, forward selection takes in each step the
    sensor that ``criterion`` prefers: "score", or "cmim" or "jmi" (see ``greedy``), up to seven
    sensors unless ``max_size`` says otherwise. ``uniform``: "weight" counts rare values of the
    target more, "resample" thins frequent ones (drawn by ``seed``).

    ``unseen``: what the score is tested on. Single "samples" (drawn by ``seed``) between others
    that it knows, which ranks best, by measurement (``tests/benchmarks/selection/ceiling.py``); or
    "stretches" of time, as a device meets them: lower bits, and harder on sensors that tell the
    time rather than the target.

    Raises ``SoftsenseError`` for a recording that cannot be ranked, or a wrong choice.
    """
    if criterion not in CRITERIA or uniform not in UNIFORM or unseen not in UNSEEN:
        choices = "; ".join(", ".join(names) for names in (CRITERIA, UNIFORM, UNSEEN))
        raise SoftsenseError(
            f"criterion {criterion!r}, uniform {uniform!r}, unseen {unseen!r}",
            remedy=f"choose from {choices}",
        )
    rec.require_usable()
    if max_size is not None:
        _require_size(rec, max_size)
    if uniform == "resample":
        rec = rec.rows(coverage.uniform_rows(rec.target, seed))
        rec.require_usable()
    folds = polynomial.STRETCHES
    if unseen == "samples":
        folds = polynomial.FOLDS
        # In this order contiguous folds are samples from everywhere; all else is free of order.
        rec = rec.rows(np.random.default_rng(seed).permutation(len(rec)))
    weights = coverage.uniform_weights(rec.target) if uniform == "weight" else np.ones(len(rec))
    exhaustive = len(rec.sensors) <= EXHAUSTIVE_SENSORS and criterion == "score"
    size = min(GREEDY_SIZE, len(rec.sensors)) if max_size is None else max_size
    if exhaustive and max_size is None:
        size = len(rec.sensors)
    # One thread: no rounding then depends on the number of cores, and small matrices gain nothing.
    with threadpool_limits(limits=1, user_api="blas"):
        if exhaustive:
            scored = _exhaustive(rec, size, weights, folds)
        else:
            scored = _forward(rec, size, weights, criterion, folds)
    begin = time.process_time()
    counted = _plug_in(rec, list(scored.score), weights, exhaustive)
    plug_in_s = time.process_time() - begin
    plug_in, singles, dissimilarity, target_entropy = counted
    subsets = [
        Subset(
            tuple(rec.sensors[i] for i in chosen),
            score,
            plug_in[chosen],
            scored.lower.get(chosen),
        )
        for chosen, score in scored.score.items()
    ]
    subsets.sort(key=lambda subset: (len(subset.sensors), -subset.score, subset.sensors))
    return Ranking(
        rec.targets,
        singles,
        target_entropy,
        dissimilarity,
        tuple(subsets),
        _best(subsets),
        "exhaustive" if exhaustive else f"forward by {criterion}",
        tuple(float(value) for value in coverage.evenness(rec.target, weights)),
        {"plug_in": plug_in_s, "score": scored.score_s, "mi_lower": scored.lower_s},
    )


def select(rec: Recording, size: int, *, uniform: str = "none") -> Selection:
    """The best ``size`` sensors of ``rec`` by score.

    Raises ``SoftsenseError`` when there are fewer sensors.
    """
    _require_size(rec, size)
    ranked = rank(rec, size, uniform=uniform).of_size(size)
    best = ranked[0]
    return Selection(best.sensors, best.score, best.mi_bits, ranked)


def _require_size(rec: Recording, size: int) -> None:
    if not 1 <= size <= len(rec.sensors):
        raise SoftsenseError(
            f"cannot choose {size} of {len(rec.sensors)} sensors",
            where=rec.name,
            remedy=f"choose a size from 1 to {len(rec.sensors)}",
        )


def _best(subsets: Sequence[Subset]) -> dict[int, tuple[str, ...]]:
    """The first subset of each size; ``subsets`` are sorted."""
    best: dict[int, tuple[str, ...]] = {}
    for subset in subsets:
        best.setdefault(len(subset.sensors), subset.sensors)
    return best


def _standard(rec: Recording, weights: Floats) -> tuple[Floats, Floats]:
    """Sensors in [-1, 1], targets with (weighted) mean 0 and variance 1.

    Targets of one unit keep their proportions, with a mean variance of 1.
    """
    low, high = rec.codes.min(axis=0), rec.codes.max(axis=0)
    x = (2.0 * rec.codes - low - high) / (high - low)
    centred = rec.target - np.average(rec.target, axis=0, weights=weights)
    variance = np.average(centred**2, axis=0, weights=weights)
    if len(set(rec.target_units)) == 1:
        variance = np.full_like(variance, variance.mean())
    return x, centred / np.sqrt(variance)


def _degree(sensors: int, samples: int, features: int) -> int:
    """The largest degree, at most the default, whose basis is not too large to determine."""
    limit = min(features, samples // 5)
    for degree in range(polynomial.DEGREE, 1, -1):
        if len(polynomial.basis(sensors, degree).exponents) <= limit:
            return degree
    return 1


def _score(known: polynomial.Moments, fitted: polynomial.HeldOut) -> float:
    return gaussian(float(known.square.sum() / known.mass.sum()), fitted.error)


def _lower(known: polynomial.Moments, fitted: polynomial.HeldOut, y: Floats) -> float:
    estimate = polynomial.predictions(known, fitted)
    return max(nearest_neighbour(estimate[:, t], y[:, t]) for t in range(y.shape[1]))


def _exhaustive(rec: Recording, size: int, weights: Floats, folds: int) -> Scored:
    x, y = _standard(rec, weights)
    sensors = x.shape[1]
    begin = time.process_time()
    known = polynomial.moments(x, y, weights, _degree(sensors, len(x), 1001), folds)
    fitted = polynomial.every_subset(known, size)
    score = {chosen: _score(known, one) for chosen, one in fitted.items()}
    scored = time.process_time()
    lower = {chosen: _lower(known, one, y) for chosen, one in fitted.items()}
    return Scored(score, lower, scored - begin, time.process_time() - scored)


def _forward(rec: Recording, size: int, weights: Floats, criterion: str, folds: int) -> Scored:
    """Scores of the candidates of each forward step, or of the criterion's own choices."""
    x, y = _standard(rec, weights)
    score: dict[tuple[int, ...], float] = {}
    lower: dict[tuple[int, ...], float] = {}
    begin = time.process_time()

    def evaluate(chosen: tuple[int, ...], bound: bool) -> None:
        degree = _degree(len(chosen), len(x), GREEDY_FEATURES)
        known = polynomial.moments(x[:, list(chosen)], y, weights, degree, folds)
        fitted = polynomial.held_out(known, range(len(chosen)))
        score[chosen] = _score(known, fitted)
        if bound:
            lower[chosen] = _lower(known, fitted, y)

    if criterion in ("cmim", "jmi"):
        target = greedy.joint_target(rec.target)
        order = greedy.forward(greedy.coarse(rec.codes), target, size, criterion)
        for count in range(1, size + 1):
            evaluate(tuple(sorted(order[:count])), bound=True)
    else:
        chosen: tuple[int, ...] = ()
        for _ in range(size):
            free = (sensor for sensor in range(x.shape[1]) if sensor not in chosen)
            candidates = [tuple(sorted((*chosen, sensor))) for sensor in free]
            for candidate in candidates:
                evaluate(candidate, bound=False)
            chosen = max(candidates, key=lambda candidate: score[candidate])
            evaluate(chosen, bound=True)
    return Scored(score, lower, time.process_time() - begin, 0.0)


def _plug_in(
    rec: Recording, subsets: Sequence[tuple[int, ...]], weights: Floats, exhaustive: bool
) -> tuple[dict[tuple[int, ...], float], dict[str, Single], Floats, float]:
    """Plug-in information: of ``subsets``, of singles, of pairs as dissimilarity; and H(Y)."""
    codes, label = rec.codes, labels_of(rec.target)
    sensors = codes.shape[1]
    even = bool(np.ptp(weights) == 0)
    counted = None if even else weights
    information: dict[tuple[int, ...], float] = {}
    if exhaustive and even:
        own, joint, target = subset_entropies(codes, label, max(map(len, subsets)))
        for chosen in subsets:
            mask = sum(1 << i for i in chosen)
            information[chosen] = float(own[mask] + target - joint[mask])
    wanted = [*subsets, *((i,) for i in range(sensors)), *combinations(range(sensors), 2)]
    for chosen in wanted:
        if chosen not in information:
            information[chosen] = mutual_information(codes[:, list(chosen)], label, weights=counted)
    singles = {
        name: Single(information[(i,)], entropy(codes[:, i], weights=counted))
        for i, name in enumerate(rec.sensors)
    }
    dissimilarity = np.zeros((sensors, sensors))
    for i, j in combinations(range(sensors), 2):
        pair = information[(i, j)]
        dissimilarity[i, j] = pair - information[(i,)]
        dissimilarity[j, i] = pair - information[(j,)]
    return information, singles, dissimilarity, entropy(label, weights=counted)
