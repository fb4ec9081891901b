"""Float networks to quantise: made up, with moderate weights as trained ones have."""

from __future__ import annotations

import numpy as np

from softsense.mlp import Layer, Mlp, MlpInput, MlpOutput


def make_mlp(
    seed: int = 0,
    inputs: int = 2,
    hidden: tuple[int, ...] = (20,),
    outputs: int = 1,
    activation: str = "tanh",
    offset: float = 0.2,
) -> Mlp:
    """A random network of smooth units on codes of calibrated ranges within 12 bits."""
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 1500, size=inputs)
    high = low + rng.integers(600, 2500, size=inputs)
    layers, width = [], inputs
    for units in hidden:
        weight = rng.normal(0.0, 1.5 / np.sqrt(width), size=(units, width))
        layers.append(Layer(weight, rng.normal(0.0, 0.7, size=units), activation))
        width = units
    last = rng.normal(0.0, 1.0 / np.sqrt(width), size=(outputs, width))
    layers.append(Layer(last, np.zeros(outputs), "linear"))
    return Mlp(
        tuple(
            MlpInput(
                f"s{i + 1}",
                int(low[i]),
                int(high[i]),
                2.0 / (high[i] - low[i]),
                (low[i] + high[i]) / 2,
            )
            for i in range(inputs)
        ),
        tuple(MlpOutput(f"y{o + 1}", "mm", 10.0, offset, -10.0, 10.0) for o in range(outputs)),
        tuple(layers),
    )


def codes_of(mlp: Mlp, samples: int = 600, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low, high = [i.low for i in mlp.inputs], [i.high for i in mlp.inputs]
    return rng.integers(low, high, size=(samples, len(low)), endpoint=True)
