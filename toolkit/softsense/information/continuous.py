"""Mutual information between continuous values: nearest neighbours, and a Gaussian form.

What each is good for, by measurement against closed forms (tests and selection benchmark):
``nearest_neighbour`` for one value against one value, atoms and curved relations included;
``gaussian`` where a regression's error is known.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import digamma

Floats = NDArray[np.float64]

# Neighbours: fewer are noisier, more smooth over the width of a sharp relation.
NEIGHBOURS = 5


def gaussian(variance: float, error: float) -> float:
    """Bits 0.5 log2(``variance`` / ``error``) of a target and of an estimate's squared error.

    For a Gaussian target a lower bound of I(X;Y), whatever the estimate: h(Y|X) is at most the
    entropy of a Gaussian with the error's variance. It is reached where the estimate is the
    conditional mean and the error Gaussian. For other targets the same number with h(Y) taken to
    be Gaussian: accuracy in bits, not a bound.
    """
    return float(0.5 * np.log2(variance / error))


def nearest_neighbour(x: ArrayLike, y: ArrayLike, neighbours: int = NEIGHBOURS) -> float:
    """I(X;Y) in bits of two (samples,) variables that may have atoms.

    Kraskov, Stoegbauer and Grassberger 2004 (estimator 1) with the counts of Gao, Kannan, Oh and
    Viswanath 2017 (NeurIPS, eq. 8), which stays right for mixtures of atoms and densities, such as
    a target that rests at one value. Both variables are scaled to unit variance. Biased low when
    the relation is narrower than the spacing of ``neighbours`` samples.

    Applied to an estimate f(X) made without the sample in question it is, by data processing, an
    estimate of a lower bound of I(X;Y).
    """
    first = np.asarray(x, dtype=np.float64).ravel()
    second = np.asarray(y, dtype=np.float64).ravel()
    samples = len(first)
    if len(second) != samples or samples <= neighbours:
        raise ValueError(f"{samples} and {len(second)} samples for {neighbours} neighbours")
    if np.ptp(first) == 0 or np.ptp(second) == 0:
        return 0.0
    first, second = first / first.std(), second / second.std()
    order = np.argsort(first, kind="stable")
    first, second = first[order], second[order]
    distance = _neighbour_distance(first, second, neighbours)
    sorted_second = np.sort(second)
    same = distance == 0
    # Estimator 1 counts strictly within the distance (less than it by more than rounding); at an
    # atom the distance is zero, and all that coincide count.
    inside = distance * (1.0 - 1e-9)
    near = np.zeros(samples)
    for centre, ranked in ((first, first), (second, sorted_second)):
        high = np.searchsorted(ranked, centre + inside, side="right")
        low = np.searchsorted(ranked, centre - inside, side="left")
        near += digamma((high - low).astype(np.float64))  # the sample itself included
    shared = np.full(samples, float(neighbours))
    if same.any():
        _, inverse, counts = np.unique(
            np.stack([first, second], axis=1), axis=0, return_inverse=True, return_counts=True
        )
        shared[same] = counts[inverse.ravel()][same]
    nats = digamma(samples) + float(np.mean(digamma(shared) - near))
    return float(max(0.0, nats / np.log(2.0)))


@njit(cache=True, nogil=True)
def _neighbour_distance(x, y, neighbours):  # type: ignore[no-untyped-def]
    """Distance (maximum norm) of the k-th neighbour; ``x`` is sorted."""  # pragma: no cover
    samples = len(x)
    result = np.empty(samples)
    nearest = np.empty(neighbours)
    for i in range(samples):
        for k in range(neighbours):
            nearest[k] = np.inf
        low, high = i - 1, i + 1
        while True:
            below = x[i] - x[low] if low >= 0 else np.inf
            above = x[high] - x[i] if high < samples else np.inf
            # walk outwards along x until x alone is farther than the k-th neighbour so far
            if min(below, above) >= nearest[-1]:
                break
            if below <= above:
                gap = max(below, abs(y[i] - y[low]))
                low -= 1
            else:
                gap = max(above, abs(y[i] - y[high]))
                high += 1
            if gap < nearest[-1]:
                place = neighbours - 1
                while place > 0 and nearest[place - 1] > gap:
                    nearest[place] = nearest[place - 1]
                    place -= 1
                nearest[place] = gap
        result[i] = nearest[-1]
    return result
