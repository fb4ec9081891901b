"""Anybody's MLP: PyTorch's two exporters, Keras' and scikit-learn's shapes, and what is refused."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper

from softsense.cli.main import main
from softsense.errors import SoftsenseError
from softsense.onnx_import import parse_scaling, read_onnx

SCALING = parse_scaling("0.00048828125,2048", 12)


def answer(path: Path, x: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    return session.run(None, {session.get_inputs()[0].name: x.astype(np.float32)})[0]


def agrees(path: Path, inputs: int) -> None:
    mlp = read_onnx(path, SCALING)
    codes = np.random.default_rng(1).integers(0, 4096, size=(64, inputs))
    x = 0.00048828125 * (codes - 2048.0)
    assert mlp.predict(codes) == pytest.approx(answer(path, x).reshape(64, -1), abs=1e-5)


def graph_file(path: Path, nodes, constants, inputs: int, outputs: int) -> Path:
    graph = helper.make_graph(
        nodes,
        "g",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", inputs])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["n", outputs])],
        [numpy_helper.from_array(np.asarray(v, np.float32), k) for k, v in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    onnx.save(model, str(path))
    return path


@pytest.mark.parametrize("activation", [torch.nn.Tanh, torch.nn.ReLU, torch.nn.Sigmoid])
def test_pytorch(activation, tmp_path: Path) -> None:
    torch.manual_seed(0)
    net = torch.nn.Sequential(
        torch.nn.Linear(3, 10),
        activation(),
        torch.nn.Linear(10, 6),
        activation(),
        torch.nn.Linear(6, 2),
    )
    path = tmp_path / "net.onnx"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(net, (torch.zeros(64, 3),), str(path), dynamo=False)
    agrees(path, 3)


def test_keras_shape(tmp_path: Path) -> None:
    """MatMul + Add, weights (inputs, units), as tf2onnx writes a Dense layer."""
    rng = np.random.default_rng(0)
    constants = {
        "w1": rng.normal(size=(4, 8)),
        "b1": rng.normal(size=8),
        "w2": rng.normal(size=(8, 1)),
        "b2": rng.normal(size=1),
    }
    nodes = [
        helper.make_node("MatMul", ["x", "w1"], ["m1"]),
        helper.make_node("Add", ["m1", "b1"], ["a1"]),
        helper.make_node("Tanh", ["a1"], ["t1"]),
        helper.make_node("MatMul", ["t1", "w2"], ["m2"]),
        helper.make_node("Add", ["b2", "m2"], ["y"]),
    ]
    agrees(graph_file(tmp_path / "keras.onnx", nodes, constants, 4, 1), 4)


def test_scikit_learn_shape(tmp_path: Path) -> None:
    """Cast, scaling before the network, MatMul + Add, Reshape at the end, as skl2onnx writes."""
    rng = np.random.default_rng(0)
    constants = {
        "mean": rng.normal(size=2),
        "std": rng.uniform(1, 2, size=2),
        "w1": rng.normal(size=(2, 5)),
        "b1": rng.normal(size=(1, 5)),
        "w2": rng.normal(size=(5, 1)),
        "b2": rng.normal(size=(1, 1)),
    }
    nodes = [
        helper.make_node("Cast", ["x"], ["c"], to=TensorProto.FLOAT),
        helper.make_node("Sub", ["c", "mean"], ["s"]),
        helper.make_node("Div", ["s", "std"], ["d"]),
        helper.make_node("MatMul", ["d", "w1"], ["m1"]),
        helper.make_node("Add", ["m1", "b1"], ["a1"]),
        helper.make_node("Relu", ["a1"], ["r1"]),
        helper.make_node("MatMul", ["r1", "w2"], ["m2"]),
        helper.make_node("Add", ["m2", "b2"], ["y0"]),
        helper.make_node("Identity", ["y0"], ["y"]),
    ]
    agrees(graph_file(tmp_path / "sklearn.onnx", nodes, constants, 2, 1), 2)


def test_the_command_makes_a_verified_export(tmp_path: Path, capsys) -> None:
    torch.manual_seed(1)
    net = torch.nn.Sequential(torch.nn.Linear(3, 12), torch.nn.Tanh(), torch.nn.Linear(12, 1))
    path = tmp_path / "net.onnx"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(net, (torch.zeros(64, 3),), str(path), dynamo=False)
    out = tmp_path / "out"
    command = ["export", str(path), "--adc-bits", "12", "--input-affine", "0.00048828125,2048"]
    assert main([*command, "-o", str(out), "--json", "-q"]) == 0
    manifest = json.loads(capsys.readouterr().out)
    assert manifest["name"] == "net"
    assert manifest["bounds"]["reached"]
    assert main(["verify", str(out), "--on", "reference,onnxruntime,host", "-q"]) == 0
    small = tmp_path / "small"
    assert main([*command, "-o", str(small), "--optimise", "size", "--json", "-q"]) == 0
    capsys.readouterr()
    assert (small / "net.json").read_bytes() == (out / "net.json").read_bytes()
    assert main(["verify", str(small), "--on", "host", "-q"]) == 0
    flash = {
        folder: json.loads((folder / "manifest.json").read_text())["costs"]["targets"][0]["flash"]
        for folder in (out, small)
    }
    assert flash[small] < flash[out]


def test_what_cannot_be_taken_is_named(tmp_path: Path, capsys) -> None:
    weights = {"w": np.ones((2, 2))}
    nodes = [
        helper.make_node("MatMul", ["x", "w"], ["m"]),
        helper.make_node("Softmax", ["m"], ["y"], name="squash"),
    ]
    path = graph_file(tmp_path / "foreign.onnx", nodes, weights, 2, 2)
    with pytest.raises(SoftsenseError, match=r"'squash', operator Softmax"):
        read_onnx(path, SCALING)
    linear = graph_file(
        tmp_path / "linear.onnx", [helper.make_node("MatMul", ["x", "w"], ["y"])], weights, 2, 2
    )
    with pytest.raises(SoftsenseError, match="no hidden layer"):
        read_onnx(linear, SCALING)
    (tmp_path / "cut.onnx").write_bytes(path.read_bytes()[:40])
    with pytest.raises(SoftsenseError, match=r"cut\.onnx"):
        read_onnx(tmp_path / "cut.onnx", SCALING)
    with pytest.raises(SoftsenseError, match="cannot be read"):
        read_onnx(tmp_path / "absent.onnx", SCALING)
    for text in ("1", "0,1", "x,y", "1,2;3"):
        with pytest.raises(SoftsenseError, match="input affine"):
            parse_scaling(text, 12)
    assert main(["export", str(path), "-o", str(tmp_path / "o")]) == 1
    assert "--input-affine" in capsys.readouterr().err
