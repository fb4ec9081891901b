"""Forward selection by pairwise information, where subsets are too many to look at.

Brown, Pocock, Zhao and Lujan, JMLR 13 (2012), 27-66, write the classical criteria in one form: from
the sensors not yet chosen take the one with the largest J(Xk) given those chosen, S.

    CMIM (Fleuret 2004)        J = min over j in S of I(Xk;Y|Xj)
    JMI  (Yang and Moody 1999) J = sum over j in S of I(Xk,Xj;Y)

Both start with the largest I(Xk;Y). They look at pairs only, so that they need no joint state of
more than three variables; codes must be coarse enough to be counted so (see ``coarse``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softsense.information import mutual_information

Labels = NDArray[np.int32]


def coarse(values: NDArray[np.float64] | NDArray[np.int32], samples_per_state: int = 10) -> Labels:
    """Labels of equal bins over each column's range, (samples, columns).

    So many bins that two columns and the target, all three, have ``samples_per_state`` samples for
    each pair of their states: about 28 bins for 8000 samples, at least 4.
    """
    table = np.asarray(values, dtype=np.float64)
    bins = max(4, int(np.sqrt(len(table) / samples_per_state)))
    low, span = table.min(axis=0), np.ptp(table, axis=0)
    labels: Labels = np.minimum((table - low) / span * bins, bins - 1).astype(np.int32)
    return labels


def forward(x: Labels, y: Labels, size: int, criterion: str) -> tuple[int, ...]:
    """The order in which ``criterion`` takes ``size`` columns of ``x`` (samples, sensors)."""
    if criterion not in ("cmim", "jmi"):
        raise ValueError(f"criterion {criterion!r}: cmim or jmi")
    sensors = x.shape[1]
    single = np.array([mutual_information(x[:, k], y) for k in range(sensors)])
    value = single.copy()
    chosen: list[int] = []
    while len(chosen) < size:
        free = [k for k in range(sensors) if k not in chosen]
        best = max(free, key=lambda k: value[k])
        chosen.append(best)
        for k in free:
            pair = mutual_information(x[:, [k, best]], y)
            gain = pair - single[best]  # I(Xk;Y|Xbest) by the chain rule
            if criterion == "cmim":
                value[k] = gain if len(chosen) == 1 else min(value[k], gain)
            else:
                value[k] = pair if len(chosen) == 1 else value[k] + pair
    return tuple(chosen)


def joint_target(target: NDArray[np.float64]) -> Labels:
    """One coarse label (samples,) for all targets together."""
    labels = coarse(target)
    joint = np.zeros(len(labels), dtype=np.int64)
    for column in labels.T:
        joint = np.unique(joint * (int(column.max()) + 1) + column, return_inverse=True)[1]
    return joint.astype(np.int32)
