"""What the integer network computes: the reference that C, ONNX and devices must equal."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softsense_codegen.fixed import ACTIVATION_MAX, floor_shift
from softsense_codegen.network import IntLayer, IntNetwork

Integers = NDArray[np.int64]

# Chunks of this many samples keep the (samples, units) arrays within the processor's cache.
CHUNK = 2048


def clip_codes(net: IntNetwork, codes: ArrayLike) -> Integers:
    """Codes (samples, inputs) clipped to the calibrated box."""
    x = np.atleast_2d(np.asarray(codes, dtype=np.int64))
    if x.ndim != 2 or x.shape[1] != len(net.inputs):
        raise ValueError(f"codes {x.shape} for {len(net.inputs)} inputs")
    clipped: Integers = np.clip(x, [i.low for i in net.inputs], [i.high for i in net.inputs])
    return clipped


def estimate(net: IntNetwork, codes: ArrayLike) -> NDArray[np.int32]:
    """Estimates (samples, outputs) int32 for int16 ``codes`` (samples, inputs).

    Defined for every code. Value in the output's unit: (y - zero) * lsb.
    """
    x = clip_codes(net, codes)
    result = np.empty((len(x), len(net.outputs)), dtype=np.int32)
    for start in range(0, len(x), CHUNK):
        a = x[start : start + CHUNK]
        for layer in net.layers:
            a = activations(net, layer, a)
        result[start : start + CHUNK] = a
    return result


def activations(net: IntNetwork, layer: IntLayer, a: Integers) -> Integers:
    """One layer's activations (samples, units) of the former ones ``a`` (samples, inputs)."""
    return activate(net, layer, arguments(layer, a))


def arguments(layer: IntLayer, a: Integers) -> Integers:
    """A layer's sums z (samples, units), exact integers."""
    bias = np.asarray(layer.bias, dtype=np.int64)
    if layer.shift == 0:
        # Products of 16-bit words and their sums are exact in double, and BLAS is fast.
        exact: Integers = (a.astype(np.float64) @ layer.matrix.T.astype(np.float64)).astype(
            np.int64
        )
        return exact + bias
    z = np.tile(bias, (len(a), 1))
    for column in range(a.shape[1]):
        z += floor_shift(a[:, column, None] * layer.matrix[None, :, column], layer.shift)
    return z


def activate(net: IntNetwork, layer: IntLayer, z: Integers) -> Integers:
    """The activation of sums ``z`` (any shape)."""
    if layer.activation == "linear":
        return z
    if layer.activation == "relu":
        relu: Integers = np.clip(floor_shift(z, layer.fine), 0, ACTIVATION_MAX)
        return relu
    assert net.table is not None
    return net.table.read(floor_shift(np.clip(z, 0, layer.clip_at(net.table)), layer.fine))


def values(net: IntNetwork, estimates: ArrayLike) -> NDArray[np.float64]:
    """Estimates (samples, outputs) in the outputs' units."""
    y = np.asarray(estimates, dtype=np.float64)
    result: NDArray[np.float64] = (y - [o.zero for o in net.outputs]) * [o.lsb for o in net.outputs]
    return result


def uncalibrated(net: IntNetwork, codes: ArrayLike) -> NDArray[np.uint64]:
    """Bit i is set where code i lies outside its calibrated range: (samples,).

    The C function reports the first 32 inputs.
    """
    x = np.atleast_2d(np.asarray(codes, dtype=np.int64))
    outside = (x < [i.low for i in net.inputs]) | (x > [i.high for i in net.inputs])
    bits = np.left_shift(np.uint64(1), np.arange(len(net.inputs), dtype=np.uint64))
    mask: NDArray[np.uint64] = (outside * bits).sum(axis=1).astype(np.uint64)
    return mask
