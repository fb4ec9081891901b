"""Codes worth comparing on: recorded, corners, random, saturating and out of range; or all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from softsense_codegen import reference
from softsense_codegen.network import IntNetwork

Codes = NDArray[np.int16]
RANDOM = 4000
# All 2**k corners up to this many inputs, a random choice of them beyond.
ALL_CORNERS = 10
SLAB = 1 << 20


def vectors(net: IntNetwork, recorded: Codes, seed: int = 0) -> Codes:
    """Codes (samples, inputs) for every evaluator."""
    rng = np.random.default_rng(seed)
    low = np.array([i.low for i in net.inputs])
    high = np.array([i.high for i in net.inputs])
    width = len(low)
    if width <= ALL_CORNERS:
        pick = (np.arange(2**width)[:, None] >> np.arange(width)) & 1
    else:
        pick = rng.integers(0, 2, size=(2**ALL_CORNERS, width))
    corners = np.where(pick == 1, high, low)
    around = np.clip(corners + rng.integers(-2, 3, size=corners.shape), -32768, 32767)
    inside = rng.integers(low, high, size=(RANDOM, width), endpoint=True)
    anywhere = rng.integers(-32768, 32767, size=(RANDOM // 2, width), endpoint=True)
    ends = np.where(rng.random((64, width)) < 0.5, -32768, 32767)
    parts = [recorded.astype(np.int64), corners, around, inside, anywhere, ends]
    return np.concatenate(parts).astype(np.int16)


def every_input(net: IntNetwork) -> Iterator[tuple[Codes, NDArray[np.int32]]]:
    """Every code 0 … 4095 (or up to the calibrated end) of one or two inputs, with the reference.

    Yields slabs of (codes, estimates). Codes outside the box share the estimate of the box's edge,
    so the reference is only computed within it.
    """
    ends = [max(4095, i.high) for i in net.inputs]
    axes = [np.arange(end + 1) for end in ends]
    if len(axes) == 1:
        yield axes[0][:, None].astype(np.int16), reference.estimate(net, axes[0][:, None])
        return
    first, second = net.inputs
    columns = np.arange(second.low, second.high + 1)
    expand = np.clip(axes[1], second.low, second.high) - second.low
    rows = max(SLAB // len(axes[1]), 1)
    for start in range(0, len(axes[0]), rows):
        slab = axes[0][start : start + rows]
        inside = np.unique(np.clip(slab, first.low, first.high))
        grid = np.stack([g.ravel() for g in np.meshgrid(inside, columns, indexing="ij")], axis=1)
        box = reference.estimate(net, grid).reshape(len(inside), len(columns), -1)
        expected = box[np.clip(slab, first.low, first.high) - inside[0]][:, expand]
        codes = np.stack([g.ravel() for g in np.meshgrid(slab, axes[1], indexing="ij")], axis=1)
        yield codes.astype(np.int16), expected.reshape(-1, len(net.outputs))
