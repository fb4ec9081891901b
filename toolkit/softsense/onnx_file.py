"""Networks as ONNX: the float one as trained, and the integer one of standard operators.

Both are plain files for ONNX Runtime; the integer one is an independent evaluator of the same
semantics, not a translation of the C.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softsense.mlp import Mlp
from softsense_codegen.fixed import ACTIVATION_MAX, FRACTION_BITS
from softsense_codegen.network import IntLayer, IntNetwork

if TYPE_CHECKING:
    import onnx

OPSET = 17
IR_VERSION = 8
# Added before a right shift, which ONNX has for unsigned words only; a multiple of every power
# of two in use, and far above any product.
LIFT = 1 << 52


class _Graph:
    """Collects nodes and constants of one graph; names are made in order."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: dict[str, NDArray[np.generic]] = {}

    def node(self, operator: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        from onnx import helper

        output = name or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def constant(self, value: NDArray[np.generic], name: str | None = None) -> str:
        name = name or f"constant_{len(self.constants)}"
        self.constants[name] = value
        return name

    def int64(self, value: object) -> str:
        return self.constant(np.asarray(value, dtype=np.int64))

    def shift(self, value: str, bits: int) -> str:
        """floor(value / 2**bits) of an int64 that may be negative."""
        from onnx import TensorProto

        if bits == 0:
            return value
        if bits < 0:
            return self.node("Mul", value, self.int64(1 << -bits))
        lifted = self.node("Add", value, self.int64(LIFT))
        unsigned = self.node("Cast", lifted, to=TensorProto.UINT64)
        shifted = self.node(
            "BitShift",
            unsigned,
            self.constant(np.asarray(bits, dtype=np.uint64)),
            direction="RIGHT",
        )
        signed = self.node("Cast", shifted, to=TensorProto.INT64)
        return self.node("Sub", signed, self.int64(LIFT >> bits))

    def model(self, name: str, kind: int, output_kind: int, inputs: int, outputs: int) -> bytes:
        import onnx
        from onnx import helper, numpy_helper

        graph = helper.make_graph(
            self.nodes,
            name,
            [helper.make_tensor_value_info("codes", kind, ["samples", inputs])],
            [helper.make_tensor_value_info("estimate", output_kind, ["samples", outputs])],
            [numpy_helper.from_array(value, key) for key, value in self.constants.items()],
        )
        model = helper.make_model(
            graph,
            producer_name="softsense",
            opset_imports=[helper.make_opsetid("", OPSET)],
        )
        model.ir_version = IR_VERSION
        onnx.checker.check_model(model, full_check=True)
        data: bytes = model.SerializeToString(deterministic=True)
        return data


def float_model(mlp: Mlp, name: str) -> bytes:
    """``mlp`` as ONNX: ``codes`` float32 (samples, inputs) -> ``estimate`` in target units.

    Codes are clipped to their calibrated ranges, as everywhere.
    """
    from onnx import TensorProto

    graph = _Graph()

    def row(values: list[float]) -> str:
        return graph.constant(np.asarray(values, dtype=np.float32))

    x = graph.node("Max", "codes", row([i.low for i in mlp.inputs]))
    x = graph.node("Min", x, row([i.high for i in mlp.inputs]))
    x = graph.node("Sub", x, row([i.offset for i in mlp.inputs]))
    x = graph.node("Mul", x, row([i.scale for i in mlp.inputs]))
    operators = {"tanh": "Tanh", "relu": "Relu", "sigmoid": "Sigmoid"}
    for number, layer in enumerate(mlp.layers):
        weight = graph.constant(layer.weight.astype(np.float32), f"weight_{number + 1}")
        bias = graph.constant(layer.bias.astype(np.float32), f"bias_{number + 1}")
        x = graph.node("Gemm", x, weight, bias, transB=1)
        if layer.activation != "linear":
            x = graph.node(operators[layer.activation], x)
    x = graph.node("Mul", x, row([o.scale for o in mlp.outputs]))
    graph.node("Add", x, row([o.offset for o in mlp.outputs]), name="estimate")
    kind = TensorProto.FLOAT
    return graph.model(name, kind, kind, len(mlp.inputs), len(mlp.outputs))


def int_model(net: IntNetwork) -> bytes:
    """``net`` as ONNX of standard integer operators: ``codes`` int32 -> ``estimate`` int32."""
    from onnx import TensorProto

    graph = _Graph()
    x = graph.node("Cast", "codes", to=TensorProto.INT64)
    x = graph.node("Max", x, graph.int64([i.low for i in net.inputs]))
    x = graph.node("Min", x, graph.int64([i.high for i in net.inputs]))
    for layer in net.layers:
        x = _layer(graph, net, layer, x)
    graph.node("Cast", x, to=TensorProto.INT32, name="estimate")
    kind = TensorProto.INT32
    return graph.model(net.name, kind, kind, len(net.inputs), len(net.outputs))


def _layer(graph: _Graph, net: IntNetwork, layer: IntLayer, x: str) -> str:
    if layer.shift == 0:
        z = graph.node("MatMul", x, graph.constant(np.ascontiguousarray(layer.matrix.T)))
    else:
        # (samples, 1, inputs) * (units, inputs), floor by floor, then summed over the inputs.
        lifted = graph.node("Unsqueeze", x, graph.int64([1]))
        product = graph.node("Mul", lifted, graph.constant(layer.matrix))
        shifted = graph.shift(product, layer.shift)
        z = graph.node("ReduceSum", shifted, graph.int64([2]), keepdims=0)
    z = graph.node("Add", z, graph.int64(layer.bias))
    if layer.activation == "linear":
        return z
    if layer.activation == "relu":
        z = graph.shift(z, layer.fine)
        z = graph.node("Max", z, graph.int64(0))
        return graph.node("Min", z, graph.int64(ACTIVATION_MAX))
    table = net.table
    assert table is not None
    z = graph.node("Max", z, graph.int64(0))
    z = graph.node("Min", z, graph.int64(layer.clip_at(table)))
    z = graph.shift(z, layer.fine)
    index = graph.shift(z, FRACTION_BITS)
    fraction = graph.node("Sub", z, graph.node("Mul", index, graph.int64(1 << FRACTION_BITS)))
    entries = graph.constant(np.asarray(table.entries, dtype=np.int64), "table")
    low = graph.node("Gather", entries, index)
    high = graph.node("Gather", entries, graph.node("Add", index, graph.int64(1)))
    rise = graph.node("Sub", high, low)
    part = graph.node("Add", graph.node("Mul", rise, fraction), rise)
    return graph.node("Add", low, graph.shift(part, FRACTION_BITS))
