"""Anybody's MLP as ONNX: Gemm or MatMul + Add with tanh, relu or sigmoid, read into an ``Mlp``.

Understands what PyTorch, Keras (tf2onnx) and scikit-learn (skl2onnx) converters write: transposed
or plain weights, alpha and beta, scaling by constants, and operators that change nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError
from softsense.mlp import Activation, Layer, Mlp, MlpInput, MlpOutput

if TYPE_CHECKING:
    import onnx

Floats = NDArray[np.float64]

_ACTIVATIONS: dict[str, Activation] = {"Tanh": "tanh", "Relu": "relu", "Sigmoid": "sigmoid"}
_NOTHING = {"Identity", "Cast", "Dropout", "Flatten", "Reshape", "Squeeze", "Unsqueeze"}
_REMEDY = "MLPs of Gemm or MatMul + Add with Tanh, Relu or Sigmoid are taken"


@dataclass(frozen=True)
class InputScaling:
    """How codes become the network's inputs: x = scale * (code - offset), once or per input."""

    scale: tuple[float, ...]
    offset: tuple[float, ...]
    bits: int


def parse_scaling(text: str, bits: int) -> InputScaling:
    """Read ``SCALE,OFFSET`` or ``SCALE,OFFSET;SCALE,OFFSET;…`` (one pair per input)."""
    try:
        pairs = [tuple(float(part) for part in pair.split(",")) for pair in text.split(";")]
    except ValueError:
        pairs = []
    good = pairs and all(len(p) == 2 and p[0] != 0 and np.isfinite(p).all() for p in pairs)
    if not good:
        raise SoftsenseError(
            f"input affine {text!r} is not understood",
            remedy="give SCALE,OFFSET (SCALE not 0), or one pair per input joined by ;",
        )
    if not 4 <= bits <= 15:
        raise SoftsenseError(f"{bits} ADC bits are outside 4 … 15", remedy="--adc-bits 12")
    return InputScaling(tuple(p[0] for p in pairs), tuple(p[1] for p in pairs), bits)


def read_onnx(path: str | Path, scaling: InputScaling, unit: str = "1") -> Mlp:
    """The network of an ONNX file on raw codes 0 … 2**bits - 1.

    Full scale of an output is the range that it takes over the box of codes (sampled).

    Raises ``SoftsenseError`` naming node and operator for whatever it cannot take.
    """
    import onnx
    from google.protobuf.message import DecodeError

    path = Path(path)
    try:
        model = onnx.load(str(path))
        onnx.checker.check_model(model)
    except OSError as error:
        raise SoftsenseError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except (DecodeError, onnx.checker.ValidationError) as error:
        raise SoftsenseError(
            "not a whole ONNX file", where=str(path), remedy="export the network again"
        ) from error
    layers = _Walk(model.graph, str(path)).layers()
    width = layers[0].weight.shape[1]
    if len(scaling.scale) not in (1, width):
        raise SoftsenseError(
            f"{len(scaling.scale)} input affines for {width} inputs",
            where=str(path),
            remedy="give one, or one per input",
        )
    scale = np.broadcast_to(scaling.scale, (width,))
    offset = np.broadcast_to(scaling.offset, (width,))
    top = 2**scaling.bits - 1
    note = f"x = scale * (code - offset), {scaling.bits} bits"
    inputs = tuple(
        MlpInput(f"x{i}", 0, top, float(scale[i]), float(offset[i]), note) for i in range(width)
    )
    names = [f"y{o}" for o in range(len(layers[-1].bias))]
    bare = Mlp(inputs, tuple(MlpOutput(n, unit, 1.0, 0.0, 0.0, 1.0) for n in names), layers)
    sample = np.random.default_rng(0).integers(0, top, size=(20_000, width), endpoint=True)
    values = bare.predict(sample)
    low, high = values.min(axis=0), values.max(axis=0)
    for name, least, most in zip(names, low, high, strict=True):
        if not most > least:
            raise SoftsenseError(
                f"output {name} is constant over all codes",
                where=str(path),
                remedy="check --input-affine and --adc-bits",
            )
    outputs = tuple(
        MlpOutput(n, unit, 1.0, 0.0, float(a), float(b))
        for n, a, b in zip(names, low, high, strict=True)
    )
    return Mlp(inputs, outputs, layers)


class _Walk:
    """Follows the graph from its input to its output, one linear map or activation at a time."""

    def __init__(self, graph: onnx.GraphProto, where: str) -> None:
        from onnx import numpy_helper

        self.where = where
        self.nodes = list(graph.node)
        self.constants: dict[str, NDArray[Any]] = {
            tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer
        }
        for node in self.nodes:
            if node.op_type == "Constant":
                value = next((a.t for a in node.attribute if a.name == "value"), None)
                if value is not None:
                    self.constants[node.output[0]] = numpy_helper.to_array(value)
        sources = [value.name for value in graph.input if value.name not in self.constants]
        if len(sources) != 1 or len(graph.output) != 1:
            raise SoftsenseError(
                f"{len(sources)} inputs and {len(graph.output)} outputs",
                where=where,
                remedy="one input and one output tensor are taken",
            )
        self.source, self.result = sources[0], graph.output[0].name

    def refuse(self, node: onnx.NodeProto, why: str) -> SoftsenseError:
        name = node.name or node.output[0]
        return SoftsenseError(
            f"node {name!r}, operator {node.op_type}: {why}", where=self.where, remedy=_REMEDY
        )

    def layers(self) -> tuple[Layer, ...]:
        """The layers, an affine map and its activation each; the last is linear."""
        made: list[Layer] = []
        weight: Floats | None = None
        bias: Floats | None = None
        value = self.source
        while value != self.result:
            users = [node for node in self.nodes if value in node.input]
            if len(users) != 1:
                raise SoftsenseError(
                    f"value {value!r} goes to {len(users)} nodes", where=self.where, remedy=_REMEDY
                )
            (node,) = users
            kind = node.op_type
            if kind in _ACTIVATIONS:
                if weight is None or bias is None:
                    raise self.refuse(node, "an activation before any weights")
                made.append(Layer(weight, bias, _ACTIVATIONS[kind]))
                width = len(bias)
                weight, bias = np.eye(width), np.zeros(width)
            elif kind not in _NOTHING:
                change, shift = self.affine(node, value, None if bias is None else len(bias))
                if change.shape[1] != (change.shape[1] if bias is None else len(bias)):
                    raise self.refuse(node, f"takes {change.shape[1]}, is given {len(bias or ())}")
                weight = change if weight is None else change @ weight
                bias = shift if bias is None else change @ bias + shift
            value = node.output[0]
        if weight is None or bias is None or not made:
            raise SoftsenseError("no hidden layer was found", where=self.where, remedy=_REMEDY)
        made.append(Layer(weight, bias, "linear"))
        return tuple(made)

    def affine(self, node: onnx.NodeProto, value: str, width: int | None) -> tuple[Floats, Floats]:
        """``node`` as y = weight @ x + bias of its input ``value``."""
        attributes = {a.name: (a.f if a.type == 1 else a.i) for a in node.attribute}
        others = [name for name in node.input if name and name != value]
        for name in others:
            if name not in self.constants:
                raise self.refuse(node, f"its input {name!r} is no constant")
        given = [self.constants[name].astype(np.float64) for name in others]
        kind = node.op_type
        if kind == "Gemm":
            if attributes.get("transA") or node.input[0] != value:
                raise self.refuse(node, "the data must be its first, untransposed input")
            matrix = given[0] if attributes.get("transB") else given[0].T
            matrix = matrix * attributes.get("alpha", 1.0)
            shift = given[1] if len(given) > 1 else np.zeros(1)
            bias = np.broadcast_to(shift.ravel() * attributes.get("beta", 1.0), (len(matrix),))
            return matrix, bias.copy()
        if kind == "MatMul":
            if given[0].ndim != 2:
                raise self.refuse(node, "its weights are no matrix")
            matrix = given[0].T if node.input[0] == value else given[0]
            return matrix, np.zeros(len(matrix))
        if kind in ("Add", "Sub", "Mul", "Div"):
            constant = given[0].ravel()
            size = width if width is not None else self._width(node, constant)
            constant = np.broadcast_to(constant, (size,))
            first = node.input[0] == value
            eye = np.eye(size)
            if kind == "Add":
                return eye, constant.copy()
            if kind == "Sub":
                return (eye, -constant) if first else (-eye, constant.copy())
            if kind == "Mul":
                return np.diag(constant), np.zeros(size)
            if first:
                return np.diag(1.0 / constant), np.zeros(size)
        raise self.refuse(node, "is not taken")

    def _width(self, node: onnx.NodeProto, constant: Floats) -> int:
        """Inputs of the network, where a scaling comes before the first weights."""
        if constant.size > 1:
            return int(constant.size)
        for other in self.nodes:
            if other.op_type in ("Gemm", "MatMul"):
                for name in other.input:
                    if name in self.constants and self.constants[name].ndim == 2:
                        transposed = any(a.name == "transB" and a.i for a in other.attribute)
                        return int(self.constants[name].shape[1 if transposed else 0])
        raise self.refuse(node, "no weights follow it")


def grid_codes(mlp: Mlp, samples: int = 2000, seed: int = 0) -> NDArray[np.int64]:
    """Codes (samples, inputs) over the box, where no recording tells which are met."""
    rng = np.random.default_rng(seed)
    low: Sequence[int] = [i.low for i in mlp.inputs]
    high: Sequence[int] = [i.high for i in mlp.inputs]
    codes: NDArray[np.int64] = rng.integers(low, high, size=(samples, len(low)), endpoint=True)
    return codes
