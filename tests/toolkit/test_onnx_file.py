"""ONNX files under ONNX Runtime: the float one equals the network, the integer one the bits."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from softsense.onnx_file import float_model, int_model
from softsense_codegen import reference

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "codegen"))

from made_networks import codes_of, make_mlp
from networks import make_network


def run(model: bytes, codes: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    (source,) = session.get_inputs()
    (result,) = session.get_outputs()
    assert (source.name, result.name) == ("codes", "estimate")
    dtype = np.float32 if "float" in source.type else np.int32
    return session.run(None, {"codes": codes.astype(dtype)})[0]


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    inputs=st.integers(1, 9),
    hidden=st.lists(st.integers(1, 10), min_size=1, max_size=3),
    outputs=st.integers(1, 3),
    activation=st.sampled_from(["tanh", "relu"]),
    bits=st.sampled_from([8, 16]),
    fine=st.integers(-3, 4),
)
def test_the_integer_graph_has_the_reference_s_bits(
    seed, inputs, hidden, outputs, activation, bits, fine
) -> None:
    net = make_network(seed, inputs, tuple(hidden), outputs, activation, bits, 2.0, fine)
    codes = np.random.default_rng(seed).integers(-32768, 32767, size=(200, inputs), endpoint=True)
    codes[:100] = np.abs(codes[:100]) % 4096
    answered = run(int_model(net), codes)
    assert answered.dtype == np.int32
    assert np.array_equal(answered, reference.estimate(net, codes))


@pytest.mark.parametrize("activation", ["tanh", "relu", "sigmoid"])
def test_the_float_graph_equals_torch_to_float_tolerance(activation: str) -> None:
    mlp = make_mlp(inputs=3, hidden=(12, 7), outputs=2, activation=activation)
    codes = codes_of(mlp, 300)
    codes[:50] = np.random.default_rng(0).integers(-32768, 32767, size=(50, 3))  # clipped
    modules: list[torch.nn.Module] = []
    kinds = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "sigmoid": torch.nn.Sigmoid}
    for layer in mlp.layers:
        linear = torch.nn.Linear(layer.weight.shape[1], layer.weight.shape[0])
        linear.weight.data = torch.tensor(layer.weight, dtype=torch.float32)
        linear.bias.data = torch.tensor(layer.bias, dtype=torch.float32)
        modules.append(linear)
        if layer.activation != "linear":
            modules.append(kinds[layer.activation]())
    x = np.clip(codes, [i.low for i in mlp.inputs], [i.high for i in mlp.inputs])
    x = (x - [i.offset for i in mlp.inputs]) * [i.scale for i in mlp.inputs]
    y = torch.nn.Sequential(*modules)(torch.tensor(x, dtype=torch.float32)).detach().numpy()
    expected = y * [o.scale for o in mlp.outputs] + [o.offset for o in mlp.outputs]
    assert run(float_model(mlp, "net"), codes) == pytest.approx(expected, abs=2e-5 * 20)
    assert mlp.predict(codes) == pytest.approx(expected, abs=2e-5 * 20)


def test_files_are_deterministic() -> None:
    mlp, net = make_mlp(), make_network()
    assert float_model(mlp, "net") == float_model(mlp, "net")
    assert int_model(net) == int_model(net)
