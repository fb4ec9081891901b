"""Quantising: close to the float network over the whole box, and honest about it."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from softsense.errors import SoftsenseError
from softsense.quantise import TOLERANCE, quantise
from softsense_codegen import reference

sys.path.insert(0, str(Path(__file__).parent))

from made_networks import codes_of, make_mlp

SHAPES = {
    "one input": {"inputs": 1},
    "a pair": {"inputs": 2},
    "seven": {"inputs": 7, "hidden": (30,)},
    "two outputs": {"inputs": 3, "outputs": 2},
    "sigmoid": {"inputs": 3, "activation": "sigmoid"},
    "relu": {"inputs": 3, "activation": "relu"},
    "two layers": {"inputs": 3, "hidden": (12, 8)},
    "three layers": {"inputs": 3, "hidden": (10, 8, 6)},
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_stated_worst_difference_holds_on_new_codes(shape: str) -> None:
    mlp = make_mlp(**SHAPES[shape])
    made = quantise(mlp, codes_of(mlp), name="made")
    net = made.network
    fresh = codes_of(mlp, 20_000, seed=99)
    difference = np.abs(reference.values(net, reference.estimate(net, fresh)) - mlp.predict(fresh))
    accuracy = net.accuracy
    assert accuracy is not None
    for output in range(len(net.outputs)):
        found = float(difference[:, output].max())
        # Exhaustive: the stated worst is the maximum. Otherwise a search found it, and what
        # nothing may exceed is the proved bound.
        assert found <= (accuracy.worst[output] * (1 + 1e-9 if accuracy.exhaustive else 1.1))
        assert accuracy.worst[output] <= accuracy.bound[output]
    assert made.reached == (made.share <= TOLERANCE)
    if len(mlp.layers) == 2:
        assert made.reached, made.verdict()


@pytest.mark.parametrize("inputs", [1, 2])
def test_one_and_two_inputs_are_searched_exhaustively(inputs: int) -> None:
    mlp = make_mlp(inputs=inputs, hidden=(6,))
    net = quantise(mlp, codes_of(mlp), name="made").network
    accuracy = net.accuracy
    assert accuracy is not None
    assert accuracy.exhaustive
    assert accuracy.compared == np.prod([i.high - i.low + 1 for i in net.inputs])
    codes = np.array(accuracy.worst_codes)
    fixed = reference.values(net, reference.estimate(net, codes))
    assert float(np.abs(fixed - mlp.predict(codes))[0, 0]) == pytest.approx(
        accuracy.worst[0], rel=1e-9
    )


def test_compensated_rounding_beats_rounding_to_nearest() -> None:
    """The same word length, weights rounded each for itself: the method earns its keep."""
    # ``softsense.quantise`` is the public function; the module of that name holds the limit.
    module = importlib.import_module("softsense.quantise")
    mlp = make_mlp(inputs=4, hidden=(40,), seed=4)
    codes = codes_of(mlp)
    compensated = quantise(mlp, codes, bits=8).share
    limit = module.MAX_COMPENSATED
    try:
        module.MAX_COMPENSATED = 0
        nearest = quantise(mlp, codes, bits=8).share
    finally:
        module.MAX_COMPENSATED = limit
    assert compensated < nearest


def test_eight_bits_are_coarser_and_say_so() -> None:
    mlp = make_mlp(inputs=3)
    eight, sixteen = (quantise(mlp, codes_of(mlp), bits=bits) for bits in (8, 16))
    assert sixteen.reached
    assert eight.share > sixteen.share
    assert not eight.reached
    assert "times the 1/8192 that was aimed at" in eight.verdict()
    assert max(abs(eight.network.layers[0].matrix).max(), 0) <= 127


def test_a_far_offset_goes_into_zero() -> None:
    mlp = make_mlp(offset=1e6)
    net = quantise(mlp, codes_of(mlp)).network
    codes = codes_of(mlp, 500, seed=3)
    values = reference.values(net, reference.estimate(net, codes))
    assert np.abs(values - mlp.predict(codes)).max() < 20.0 / 8192
    assert net.outputs[0].zero != 0


def test_same_input_same_bytes() -> None:
    mlp = make_mlp(inputs=3)
    first, second = (quantise(mlp, codes_of(mlp), name="same").network for _ in range(2))
    assert first.to_json() == second.to_json()


def test_what_cannot_be_quantised_is_said() -> None:
    from dataclasses import replace

    mlp = make_mlp()
    with pytest.raises(SoftsenseError, match="4 bits"):
        quantise(mlp, codes_of(mlp), bits=4)
    steep = replace(mlp.layers[0], weight=mlp.layers[0].weight * 1e9)
    with pytest.raises(SoftsenseError, match="too steep"):
        quantise(replace(mlp, layers=(steep, mlp.layers[1])), codes_of(mlp))
    broken = replace(mlp.layers[0], weight=mlp.layers[0].weight * np.nan)
    with pytest.raises(SoftsenseError, match="not finite"):
        quantise(replace(mlp, layers=(broken, mlp.layers[1])), codes_of(mlp))
