"""Does the target visit its whole range evenly? The paper's condition for comparing sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BINS = 20
# Evenness of 20 bins below which a person is told; a sine (which dwells at its ends) has 0.9.
EVEN_ENOUGH = 0.8


def evenness(target: Floats, weights: Floats) -> Floats:
    """Per target: 2^H / bins of its histogram, 1 for a uniform one, 1 / bins for one value."""
    result = []
    for column in target.T:
        share = np.bincount(_bins(column), weights=weights, minlength=BINS) / weights.sum()
        share = share[share > 0]
        result.append(2.0 ** float(-(share * np.log2(share)).sum()) / BINS)
    return np.asarray(result)


def uniform_weights(target: Floats) -> Floats:
    """Weights (samples,), mean 1, that give every visited bin of the target the same mass.

    No weight is more than ten times another's: a handful of samples must not decide. Several
    targets count in a joint grid.
    """
    count = _occupancy(target)
    weights = 1.0 / np.maximum(count, count.max() / 10.0)
    result: Floats = weights / weights.mean()
    return result


def uniform_rows(target: Floats, seed: int) -> NDArray[np.intp]:
    """Row numbers, in order of time, with full bins thinned at random to the median bin's count."""
    rng = np.random.default_rng(seed)
    count = _occupancy(target)
    limit = np.median([count[count == value][0] for value in np.unique(count)])
    return np.flatnonzero(rng.random(len(count)) < limit / count).astype(np.intp)


def _bins(column: Floats) -> NDArray[np.intp]:
    scaled = (column - column.min()) / np.ptp(column) * BINS
    bins: NDArray[np.intp] = np.minimum(scaled, BINS - 1).astype(np.intp)
    return bins


def _occupancy(target: Floats) -> Floats:
    """For each sample, how many share its bin."""
    label = np.zeros(len(target), dtype=np.intp)
    for column in target.T:
        label = label * BINS + _bins(column)
    _, inverse, counts = np.unique(label, return_inverse=True, return_counts=True)
    return counts[inverse].astype(np.float64)
