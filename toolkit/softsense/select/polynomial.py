"""How well a set of sensors can be mapped to the target: cross-validated polynomial ridge.

The basis is every product of Chebyshev polynomials of the sensors (scaled to [-1, 1]) up to a
total degree. Each fold needs one Gram matrix, for all sensors together: the basis of a subset is a
part of the full one, so its normal equations are a principal sub-block, and the held-out error is a
quadratic form of that fold's Gram matrix. No subset touches the samples again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Floats = NDArray[np.float64]

DEGREE = 4
# Folds are contiguous in time: neighbours in time are nearly copies, and a fold that is drawn
# sample by sample would test on what it has trained on.
FOLDS = 10
# Of the mean diagonal of the Gram matrix; small, because the basis is nearly orthogonal.
RIDGE = 1e-6


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
        chebyshev = [np.ones_like(x), x]
        for _ in range(2, degree + 1):
            chebyshev.append(2 * x * chebyshev[-1] - chebyshev[-2])
        result = np.ones((len(x), len(self.exponents)))
        for number, row in enumerate(self.exponents):
            for sensor in np.flatnonzero(row):
                result[:, number] *= chebyshev[row[sensor]][:, sensor]
        return result


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
    """Per fold: Gram matrix, moments with the targets, and the targets' own second moments."""

    basis: Basis
    gram: Floats  # (folds, features, features)
    cross: Floats  # (folds, features, targets)
    square: Floats  # (folds, targets)
    counts: NDArray[np.int64]


def moments(x: Floats, y: Floats, degree: int = DEGREE, folds: int = FOLDS) -> Moments:
    """Moments of sensors ``x`` in [-1, 1] with standardised targets ``y``, (samples, …) each."""
    products = basis(x.shape[1], degree)
    parts = np.array_split(np.arange(len(x)), folds)
    gram, cross, square = [], [], []
    for part in parts:
        features = products.features(x[part])
        gram.append(features.T @ features)
        cross.append(features.T @ y[part])
        square.append((y[part] ** 2).sum(axis=0))
    return Moments(
        products,
        np.asarray(gram),
        np.asarray(cross),
        np.asarray(square),
        np.asarray([len(part) for part in parts]),
    )


def held_out_error(known: Moments, subsets: Iterable[Sequence[int]]) -> Floats:
    """Held-out mean squared error (subsets, targets) of each subset's ridge regression."""
    total, total_cross = known.gram.sum(axis=0), known.cross.sum(axis=0)
    samples = int(known.counts.sum())
    result = []
    for subset in subsets:
        part = known.basis.part(subset)
        block = np.ix_(part, part)
        error = np.zeros(known.square.shape[1])
        for fold in range(len(known.counts)):
            own = known.gram[fold][block]
            left = total[block] - own
            left[np.diag_indices_from(left)] += RIDGE * (samples - known.counts[fold])
            right = total_cross[part] - known.cross[fold][part]
            weight = cho_solve(cho_factor(left, check_finite=False), right)
            error += (
                known.square[fold]
                - 2 * np.sum(weight * known.cross[fold][part], axis=0)
                + np.sum(weight * (own @ weight), axis=0)
            )
        result.append(error / samples)
    return np.asarray(result)
