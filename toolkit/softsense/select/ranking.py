"""Rank subsets of sensors by how well they determine the target."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from softsense.errors import SoftsenseError
from softsense.recording import Recording
from softsense.select import polynomial


@dataclass(frozen=True)
class Subset:
    """A set of sensors. ``score``: larger is better, within and across sizes (see ``rank``)."""

    sensors: tuple[str, ...]
    score: float
    mi_bits: float


@dataclass(frozen=True)
class Ranking:
    """Every ranked subset, best first within each size."""

    targets: tuple[str, ...]
    subsets: tuple[Subset, ...]

    def of_size(self, size: int) -> tuple[Subset, ...]:
        """Subsets of ``size`` sensors, best first."""
        return tuple(subset for subset in self.subsets if len(subset.sensors) == size)


@dataclass(frozen=True)
class Selection:
    """The chosen sensors, and the alternatives of the same size (best first, itself included)."""

    sensors: tuple[str, ...]
    score: float
    mi_bits: float
    ranking: tuple[Subset, ...]


def rank(rec: Recording, max_size: int | None = None) -> Ranking:
    """Score every subset of up to ``max_size`` sensors (default all)."""
    rec.require_usable()
    sensors = len(rec.sensors)
    largest = sensors if max_size is None else min(max_size, sensors)
    low, high = rec.codes.min(axis=0), rec.codes.max(axis=0)
    x = (2.0 * rec.codes - low - high) / (high - low)
    y = (rec.target - rec.target.mean(axis=0)) / rec.target.std(axis=0)
    known = polynomial.moments(x, y)
    chosen = [c for size in range(1, largest + 1) for c in combinations(range(sensors), size)]
    error = polynomial.held_out_error(known, chosen)
    scores = -0.5 * np.log2(error).sum(axis=1)
    subsets = [
        Subset(tuple(rec.sensors[i] for i in subset), float(score), float(score))
        for subset, score in zip(chosen, scores, strict=True)
    ]
    subsets.sort(key=lambda subset: (len(subset.sensors), -subset.score))
    return Ranking(rec.targets, tuple(subsets))


def select(rec: Recording, size: int) -> Selection:
    """The best ``size`` sensors of ``rec``.

    Raises ``SoftsenseError`` when there are fewer sensors.
    """
    if not 1 <= size <= len(rec.sensors):
        raise SoftsenseError(
            f"cannot choose {size} of {len(rec.sensors)} sensors",
            where=rec.name,
            remedy=f"choose a size from 1 to {len(rec.sensors)}",
        )
    ranked = rank(rec, size).of_size(size)
    best = ranked[0]
    return Selection(best.sensors, best.score, best.mi_bits, ranked)
