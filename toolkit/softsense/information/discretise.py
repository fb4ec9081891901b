"""From measured targets to states that can be counted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# The paper counts the strain by the codes of its own 12-bit converter.
STATES = 4096


def labels_of(target: NDArray[np.float64], states: int = STATES) -> NDArray[np.int32]:
    """Labels (samples, targets) of ``target`` on its own grid, 0 … at most ``states`` - 1.

    A target with no more than ``states`` distinct values keeps each of them as a state, so codes,
    whole degrees and a strain stored with few digits are counted exactly as they were measured.
    One with more is cut into ``states`` equal bins over its range, as a converter would.
    Nothing is rounded to whole numbers: a strain of 0 … 0.4 keeps all its states.
    """
    target = np.asarray(target, dtype=np.float64)
    table = target.reshape(len(target), -1)
    result = np.empty(table.shape, dtype=np.int32)
    for column in range(table.shape[1]):
        values = table[:, column]
        distinct, inverse = np.unique(values, return_inverse=True)
        if len(distinct) <= states:
            result[:, column] = inverse
        else:
            width = (distinct[-1] - distinct[0]) / states
            bins = np.floor((values - distinct[0]) / width)
            result[:, column] = np.minimum(bins, states - 1)
    return result
