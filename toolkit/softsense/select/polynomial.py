"""How well a set of sensors can be mapped to the target: cross-validated polynomial ridge.

The basis is every product of Chebyshev polynomials of the sensors (scaled to [-1, 1]) up to a
total degree. Each fold needs one Gram matrix, for all sensors together: the basis of a subset is a
part of the full one, so its normal equations are a principal sub-block, and the held-out error is a
quadratic form of that fold's Gram matrix. No subset touches the samples again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

Floats = NDArray[np.float64]

DEGREE = 5
# Folds are contiguous: in time, or in whatever order the samples are handed over. Folds of samples
# drawn at random are alike and few tell as much as many; stretches of time are not.
FOLDS = 4
STRETCHES = 10
# Per sample and squared weight, ascending; the best by held-out error is taken for each subset.
RIDGES = (1e-7, 1e-5, 1e-3)


@dataclass(frozen=True)
class Basis:
    """Exponents (features, sensors) of the Chebyshev products; row 0 is the constant."""

    exponents: NDArray[np.int64]

    def part(self, subset: Sequence[int]) -> NDArray[np.intp]:
        """Feature numbers that need only the sensors in ``subset``."""
        others = np.setdiff1d(np.arange(self.exponents.shape[1]), np.asarray(subset, dtype=int))
        return np.flatnonzero(~self.exponents[:, others].any(axis=1))

    def features(self, x: Floats) -> Floats:
        """(samples, features) for sensors (samples, sensors) in [-1, 1]."""
        degree = int(self.exponents.max(initial=0))
        columns = np.ascontiguousarray(x.T)
        chebyshev = [np.ones_like(columns), columns]
        for _ in range(2, degree + 1):
            chebyshev.append(2 * columns * chebyshev[-1] - chebyshev[-2])
        # Feature by feature in memory: each is then a product of whole rows.
        result = np.ones((len(self.exponents), len(x)))
        for feature, row in zip(result, self.exponents, strict=True):
            for sensor in np.flatnonzero(row):
                feature *= chebyshev[row[sensor]][sensor]
        return result.T


def basis(sensors: int, degree: int = DEGREE) -> Basis:
    """All products of up to ``degree`` for ``sensors`` inputs."""
    rows = [
        np.bincount(np.asarray(chosen, dtype=np.int64), minlength=sensors)
        for size in range(degree + 1)
        for chosen in combinations_with_replacement(range(sensors), size)
    ]
    return Basis(np.asarray(rows, dtype=np.int64).reshape(-1, sensors))


@dataclass(frozen=True)
class Moments:
    """Per fold: the features, their Gram matrix, and the moments with and of the targets."""

    basis: Basis
    features: tuple[Floats, ...]  # folds of (samples in the fold, features)
    gram: Floats  # (folds, features, features)
    cross: Floats  # (folds, features, targets)
    square: Floats  # (folds,) sum of the squared targets
    mass: Floats  # (folds,) sum of the weights


@dataclass(frozen=True)
class HeldOut:
    """A subset's ridge regression: its error on each fold, which it never saw, and its weights.

    ``errors``: (folds,) mean squared error, summed over the targets. ``error``: their geometric
    mean. ``weights``: (folds, features of ``part``, targets). ``ridge``: of ``RIDGES``.
    """

    ridge: float
    errors: Floats
    error: float
    part: NDArray[np.intp]
    weights: Floats


def moments(
    x: Floats, y: Floats, weights: Floats, degree: int = DEGREE, folds: int = FOLDS
) -> Moments:
    """Moments of sensors ``x`` in [-1, 1] with centred targets ``y``, (samples, …) each.

    ``weights`` (samples,) counts each sample so many times.
    """
    products = basis(x.shape[1], degree)
    features, gram, cross, square, mass = [], [], [], [], []
    for part in np.array_split(np.arange(len(x)), folds):
        own = products.features(x[part])
        root = np.sqrt(weights[part, None])
        rooted = own * root
        features.append(own)
        gram.append(rooted.T @ rooted)  # a product with itself: numpy makes but half of it
        cross.append(rooted.T @ (y[part] * root))
        square.append(float(np.sum(y[part] ** 2 * weights[part, None])))
        mass.append(float(weights[part].sum()))
    return Moments(
        products,
        tuple(features),
        np.asarray(gram),
        np.asarray(cross),
        np.asarray(square),
        np.asarray(mass),
    )


def every_subset(known: Moments, size: int) -> dict[tuple[int, ...], HeldOut]:
    """The ridge regression of every subset of up to ``size`` sensors.

    The largest choose their ridge freely. A smaller one has less to restrain, and is not asked for
    a stronger ridge than all that are one sensor larger needed.
    """
    sensors = range(known.basis.exponents.shape[1])
    fitted: dict[tuple[int, ...], HeldOut] = {}
    strongest: dict[tuple[int, ...], float] = {}
    for count in range(size, 0, -1):
        for chosen in combinations(sensors, count):
            limit = strongest.get(chosen, RIDGES[-1])
            one = held_out(known, chosen, [ridge for ridge in RIDGES if ridge <= limit])
            fitted[chosen] = one
            for part in combinations(chosen, count - 1):
                strongest[part] = max(strongest.get(part, 0.0), one.ridge)
    return fitted


def held_out(known: Moments, subset: Sequence[int], ridges: Sequence[float] = RIDGES) -> HeldOut:
    """The ridge regression of ``subset``, at that of ``ridges`` whose held-out error is least."""
    part = known.basis.part(subset)
    gram = [one.take(part, axis=0).take(part, axis=1) for one in known.gram]
    cross = known.cross[:, part]
    total, total_cross = sum(gram[1:], gram[0]), cross.sum(axis=0)
    whole = float(known.mass.sum())
    best: HeldOut | None = None
    for ridge in ridges:
        errors = np.empty(len(known.mass))
        weights = np.empty_like(cross)
        for fold, mass in enumerate(known.mass):
            left = total - gram[fold]
            left[np.diag_indices_from(left)] += ridge * (whole - mass)
            # LAPACK directly: the checks of the friendlier calls cost more than small systems
            _, weight, _ = dposv(left, total_cross - cross[fold], lower=True, overwrite_a=True)
            weights[fold] = weight
            missed = np.sum(weight * (gram[fold] @ weight - 2.0 * cross[fold]))
            errors[fold] = (known.square[fold] + missed) / mass
        error = _typical(errors, known.mass)
        if best is not None and error >= best.error:
            break  # still stronger ridges do no better
        best = HeldOut(ridge, errors, error, part, weights)
    assert best is not None
    return best


def _typical(errors: Floats, mass: Floats) -> float:
    """Geometric mean of the folds' errors.

    A polynomial that leaves the range it knows can miss by far on one stretch of time, where a
    network, which saturates, does not; the arithmetic mean would then speak of that stretch alone.
    No fold counts as better than a hundredth of the mean: one at rest must not decide either.
    """
    floor = np.average(errors, weights=mass) / 100.0
    return float(np.exp(np.average(np.log(np.maximum(errors, floor)), weights=mass)))


def predictions(known: Moments, fitted: HeldOut) -> Floats:
    """Estimates (samples, targets), each from the folds that it is not in."""
    return np.concatenate(
        [
            features[:, fitted.part] @ weight
            for features, weight in zip(known.features, fitted.weights, strict=True)
        ]
    )
