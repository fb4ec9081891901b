"""The static multilayer perceptron: the float network that everything else is measured against."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softsense.errors import SoftsenseError

Floats = NDArray[np.float64]

Activation = Literal["tanh", "relu", "sigmoid", "linear"]
ACTIVATIONS: tuple[Activation, ...] = ("tanh", "relu", "sigmoid", "linear")


def activate(kind: str, z: Floats) -> Floats:
    """The activation ``kind`` of pre-activations ``z`` (any shape)."""
    if kind == "tanh":
        return np.tanh(z)
    if kind == "relu":
        return np.maximum(z, 0.0)
    if kind == "sigmoid":
        # 1 / (1 + exp(-z)) without overflow for large negative z
        return 0.5 + 0.5 * np.tanh(0.5 * z)
    if kind == "linear":
        return z
    raise SoftsenseError(f"there is no activation {kind!r}", remedy=", ".join(ACTIVATIONS))


@dataclass(frozen=True)
class Layer:
    """activation(weight @ x + bias): ``weight`` (outputs, inputs), ``bias`` (outputs,)."""

    weight: Floats
    bias: Floats
    activation: Activation


@dataclass(frozen=True)
class MlpInput:
    """One sensor: x = scale * (code - offset), calibrated for codes low … high (inclusive)."""

    name: str
    low: int
    high: int
    scale: float
    offset: float
    front_end: str = ""


@dataclass(frozen=True)
class MlpOutput:
    """One target: value = offset + scale * y, in ``unit``; ``low`` … ``high`` is its full scale."""

    name: str
    unit: str
    scale: float
    offset: float
    low: float
    high: float


@dataclass(frozen=True)
class Mlp:
    """A trained static network from ADC codes to targets.

    Codes outside an input's calibrated range are clipped to it: outside, a network is a guess.
    """

    inputs: tuple[MlpInput, ...]
    outputs: tuple[MlpOutput, ...]
    layers: tuple[Layer, ...]

    def __post_init__(self) -> None:
        width = len(self.inputs)
        for number, layer in enumerate(self.layers):
            if layer.weight.ndim != 2 or layer.weight.shape[1] != width:
                raise ValueError(f"layer {number}: weight {layer.weight.shape} after width {width}")
            if layer.bias.shape != (layer.weight.shape[0],):
                raise ValueError(f"layer {number}: bias {layer.bias.shape}")
            width = layer.weight.shape[0]
        if width != len(self.outputs):
            raise ValueError(f"{width} network outputs for {len(self.outputs)} targets")

    def __repr__(self) -> str:
        widths = [len(self.inputs), *(len(layer.bias) for layer in self.layers)]
        return (
            f"Mlp {' -> '.join(map(str, widths))} ({self.layers[0].activation}): "
            f"{', '.join(i.name for i in self.inputs)} -> {', '.join(o.name for o in self.outputs)}"
        )

    def predict(self, codes: ArrayLike) -> Floats:
        """Estimates (samples, outputs) in target units for ``codes`` (samples, inputs)."""
        x = np.atleast_2d(np.asarray(codes, dtype=np.float64))
        x = np.clip(x, [i.low for i in self.inputs], [i.high for i in self.inputs])
        x = (x - [i.offset for i in self.inputs]) * [i.scale for i in self.inputs]
        for layer in self.layers:
            x = activate(layer.activation, x @ layer.weight.T + layer.bias)
        result: Floats = x * [o.scale for o in self.outputs] + [o.offset for o in self.outputs]
        return result

    def to_json(self) -> str:
        """Text from which ``from_json`` makes the identical network."""
        data = {
            "schema": "softsense.mlp/1",
            "inputs": [vars(i) for i in self.inputs],
            "outputs": [vars(o) for o in self.outputs],
            "layers": [
                {
                    "weight": layer.weight.tolist(),
                    "bias": layer.bias.tolist(),
                    "activation": layer.activation,
                }
                for layer in self.layers
            ],
        }
        return json.dumps(data, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str, where: str = "mlp.json") -> Mlp:
        """The inverse of ``to_json``. Raises ``SoftsenseError`` for a truncated or foreign file."""
        try:
            data: dict[str, Any] = json.loads(text)
            if data["schema"] != "softsense.mlp/1":
                raise SoftsenseError(
                    f"schema {data['schema']!r} is not softsense.mlp/1", where=where
                )
            layers = tuple(
                Layer(
                    np.asarray(layer["weight"], dtype=np.float64),
                    np.asarray(layer["bias"], dtype=np.float64),
                    layer["activation"],
                )
                for layer in data["layers"]
            )
            return cls(
                tuple(MlpInput(**i) for i in data["inputs"]),
                tuple(MlpOutput(**o) for o in data["outputs"]),
                layers,
            )
        except (ValueError, KeyError, TypeError) as error:
            raise SoftsenseError(
                f"not a whole network file: {error}", where=where, remedy="train again"
            ) from error
