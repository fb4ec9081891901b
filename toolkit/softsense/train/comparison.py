"""How well a ranking foretells accuracy: rank correlation and regret, per size of subset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from softsense.select import Ranking
from softsense.train.fitting import Fit


@dataclass(frozen=True)
class Agreement:
    """For subsets of ``size``: Spearman correlation with accuracy, and regret.

    ``score``, ``mi``, ``mi_lower``: rank correlation of that measure with accuracy, None where
    there is one subset or the measure is the same for all. ``regret``: test MSE of the subset
    with the best score over the best test MSE of the size, at least 1. ``regret_of_three``: the
    same for the best of the three with the best scores, 1 when they contain the best of all.
    """

    size: int
    subsets: int
    score: float | None
    mi: float | None
    mi_lower: float | None
    regret: float
    regret_of_three: float


def compare(ranking: Ranking, trained: Sequence[Fit]) -> tuple[Agreement, ...]:
    """Agreement of ``ranking`` with the accuracy of ``trained`` for each size."""
    known = {one.sensors: one for one in trained}
    order = tuple(ranking.singles)
    result = []
    for size in ranking.best:
        ranked = ranking.of_size(size)
        names = [tuple(sorted(subset.sensors, key=order.index)) for subset in ranked]
        accuracy = [known[name].accuracy for name in names]
        lower = [0.0 if s.mi_lower_bits is None else s.mi_lower_bits for s in ranked]
        result.append(
            Agreement(
                size,
                len(ranked),
                _spearman([subset.score for subset in ranked], accuracy),
                _spearman([subset.mi_bits for subset in ranked], accuracy),
                _spearman(lower, accuracy),
                max(accuracy) / accuracy[0],
                max(accuracy) / max(accuracy[:3]),
            )
        )
    return tuple(result)


def _spearman(measure: Sequence[float], accuracy: Sequence[float]) -> float | None:
    if len(measure) < 2 or np.ptp(measure) == 0 or np.ptp(accuracy) == 0:
        return None
    return float(spearmanr(measure, accuracy).statistic)
