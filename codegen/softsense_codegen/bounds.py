"""Proofs about an integer network over its whole calibrated box, by interval arithmetic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softsense_codegen.errors import SoftsenseError
from softsense_codegen.fixed import ACTIVATION_MAX, INT32_MAX, INT32_MIN, floor_shift
from softsense_codegen.network import IntNetwork

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class LayerBounds:
    """What a layer can reach: products and sums (least and largest over the box, all units).

    ``clips``: whether any unit's argument can leave the table, so that the clip is needed.
    """

    product: tuple[int, int]
    total: tuple[int, int]
    clips: bool


def prove(net: IntNetwork) -> tuple[LayerBounds, ...]:
    """Bounds of every layer. Raises ``SoftsenseError`` where 32 bits do not suffice.

    Each bound is attained or generous: units are taken one by one, exactly, and inputs of a layer
    as independent of each other.
    """
    low = np.array([i.low for i in net.inputs], dtype=np.int64)
    high = np.array([i.high for i in net.inputs], dtype=np.int64)
    result = []
    for number, layer in enumerate(net.layers):
        ends = np.stack([layer.matrix * low, layer.matrix * high])
        shifted = floor_shift(ends, layer.shift)
        bias = np.asarray(layer.bias, dtype=np.int64)
        least = shifted.min(axis=0).sum(axis=1) + bias
        largest = shifted.max(axis=0).sum(axis=1) + bias
        product = (int(ends.min()), int(ends.max()))
        total = (int(least.min()), int(largest.max()))
        word = 2**32 - 1 if layer.unsigned and low.min() >= 0 else INT32_MAX
        for what, (lower, upper), limit in (
            ("a product", product, word),
            ("a sum", total, INT32_MAX),
        ):
            if lower < INT32_MIN or upper > limit:
                raise SoftsenseError(
                    f"{what} of layer {number + 1} reaches {lower} … {upper}, beyond 32 bits",
                    where=net.name,
                    remedy="use smaller weights (more weight decay) or fewer inputs",
                )
        clips = False
        if layer.activation == "tanh":
            assert net.table is not None
            clips = total[0] < 0 or total[1] > layer.clip_at(net.table)
        result.append(LayerBounds(product, total, clips))
        low = np.zeros(len(layer.bias), dtype=np.int64)
        high = np.full(len(layer.bias), ACTIVATION_MAX, dtype=np.int64)
    return tuple(result)
