"""Networks as data: round trip, digest, names; and the proof of 32 bits."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsense_codegen import bounds, reference
from softsense_codegen.errors import SoftsenseError
from softsense_codegen.network import IntNetwork, c_name, check_name


def test_round_trip_and_digest(network) -> None:
    net = network(inputs=3, hidden=(4, 5), outputs=2)
    again = IntNetwork.from_json(net.to_json())
    assert again == net
    assert again.digest == net.digest
    assert network(seed=1).digest != network(seed=2).digest


def test_a_truncated_altered_or_foreign_file_is_refused(network) -> None:
    text = network().to_json()
    for bad in (text[:200], text.replace('"shift": 7', '"shift": 6'), "{}", "[]", ""):
        with pytest.raises(SoftsenseError) as caught:
            IntNetwork.from_json(bad, where="NET.json")
        assert "NET.json" in str(caught.value)
        assert "\n" not in str(caught.value)
    foreign = json.loads(text)
    foreign["schema"] = "other/1"
    with pytest.raises(SoftsenseError, match="schema"):
        IntNetwork.from_json(json.dumps(foreign))


@pytest.mark.parametrize("name", ["2knee", "knee-left", "", "int", "knee left", "é", "a" * 60])
def test_names_that_c_cannot_take_are_refused(name: str) -> None:
    with pytest.raises(SoftsenseError, match="identifier"):
        check_name(name)


@given(st.text(max_size=60))
def test_any_stem_becomes_a_name(stem: str) -> None:
    check_name(c_name(stem))


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10**6),
    st.integers(1, 6),
    st.sampled_from([(3,), (8,), (4, 3), (3, 3, 3)]),
    st.sampled_from(["tanh", "relu"]),
    st.sampled_from([8, 16]),
)
def test_no_sum_leaves_its_proved_interval(
    network, seed: int, inputs: int, hidden: tuple[int, ...], activation: str, bits: int
) -> None:
    net = network(seed, inputs, hidden, 2, activation, bits)
    proofs = bounds.prove(net)
    rng = np.random.default_rng(seed)
    a = reference.clip_codes(net, rng.integers(-32768, 32767, size=(500, inputs)))
    for layer, proof in zip(net.layers, proofs, strict=True):
        products = a[:, None, :] * layer.matrix[None]
        assert proof.product[0] <= products.min()
        assert products.max() <= proof.product[1]
        z = reference.arguments(layer, a)
        assert proof.total[0] <= z.min()
        assert z.max() <= proof.total[1]
        a = reference.activate(net, layer, z)


def test_the_interval_of_one_layer_is_attained(network) -> None:
    """With one layer the bound is exact: a corner of the box reaches it."""
    net = network(inputs=4, hidden=(6,))
    corners = np.array(np.meshgrid(*[[i.low, i.high] for i in net.inputs])).reshape(4, -1).T
    z = reference.arguments(net.layers[0], corners)
    assert bounds.prove(net)[0].total == (z.min(), z.max())


def test_what_does_not_fit_is_refused(network) -> None:
    from dataclasses import replace

    net = network()
    layer = replace(net.layers[0], bias=tuple([2**31 - 1] * 5))
    with pytest.raises(SoftsenseError, match="beyond 32 bits"):
        bounds.prove(replace(net, layers=(layer, net.layers[1])))
