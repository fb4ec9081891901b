"""A random walk under white noise: what its best predictor does not foresee.

The local level model of Harvey, "Forecasting, structural time series models and the Kalman filter"
(1989), chapter 4: y = m + noise, m a random walk. Its Kalman filter, once settled, is exponential
smoothing with a ``gain``; what the smoothed past does not foresee (the innovations) is white, so
that least squares on innovations is the best linear estimate of effects beside a walk.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softsense.effects.operators import compiled

Floats = NDArray[np.float64]

GAINS = np.array([0.01, 0.02, 0.04, 0.07, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
# So many columns at once: each step of one waits for the step before.
ABREAST = 8
# Samples whose mean says where a walk is.
CALM = 20


@compiled
def _unforeseen(rows: Floats, gain: float) -> Floats:
    left = np.empty_like(rows)
    scale = np.sqrt(1.0 - gain)
    for first in range(0, len(rows), ABREAST):
        some = rows[first : first + ABREAST]
        level = some[:, 0].astype(np.float64)
        if len(some) == 1:
            alone = level[0]
            for k in range(rows.shape[1]):
                news = some[0, k] - alone
                alone += gain * news
                left[first, k] = scale * news
            continue
        for k in range(rows.shape[1]):
            for row in range(len(some)):
                news = some[row, k] - level[row]
                level[row] += gain * news
                left[first + row, k] = scale * news
    return left


def innovations(table: Floats, gain: float) -> Floats:
    """Columns (samples, p) less what their past foresees, so scaled that a walk of this ``gain``
    under white noise leaves the noise's variance."""
    left: Floats = _unforeseen(np.ascontiguousarray(table.T), gain)
    return left.T


def likely_gain(signal: Floats, sigma: float) -> float:
    """The gain of ``GAINS`` under which ``signal`` (samples,) with noise ``sigma`` is likeliest."""
    costs = []
    for gain in GAINS:
        square = float((innovations(signal[:, None], float(gain)) ** 2).sum()) / sigma**2
        costs.append(square - len(signal) * np.log1p(-gain))
    return float(GAINS[int(np.argmin(costs))])


def levels(signal: Floats) -> Floats:
    """(samples // ``CALM``,) where ``signal`` (samples,) is, noise aside: means of so many."""
    means: Floats = signal[: len(signal) // CALM * CALM].reshape(-1, CALM).mean(axis=1)
    return means


def without_slow(table: Floats, reach: int) -> Floats:
    """Columns (samples, p) less the mean of their neighbours within ``reach`` samples.

    Scaled so that white noise keeps its size.
    """
    window = 2 * reach + 1
    total = np.cumsum(np.pad(table, ((reach + 1, reach), (0, 0)), mode="edge"), axis=0)
    around = (total[window:] - total[:-window] - table) / (window - 1)
    fast: Floats = (table - around) / np.sqrt(1.0 + 1.0 / (window - 1))
    return fast
