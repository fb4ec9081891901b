"""Networks to test on: made up, since codegen knows nothing of training."""

from __future__ import annotations

import numpy as np

from softsense_codegen.fixed import tanh_table
from softsense_codegen.network import Input, IntLayer, IntNetwork, Output, bias_words


def make_network(
    seed: int = 0,
    inputs: int = 2,
    hidden: tuple[int, ...] = (5,),
    outputs: int = 1,
    activation: str = "tanh",
    bits: int = 16,
    steep: float = 1.0,
    fine: int = 0,
    name: str = "toy",
    segments: int = 64,
) -> IntNetwork:
    """A random network whose sums fit 32 bits; ``steep`` > 1 drives units beyond the table."""
    rng = np.random.default_rng(seed)
    word = 2 ** (bits - 1) - 1
    table = tanh_table(4.0, segments) if activation == "tanh" else None
    middle = 0 if table is None else table.segments << (15 + fine)
    low = rng.integers(0, 1500, size=inputs)
    high = low + rng.integers(200, 2500, size=inputs)
    layers = []
    width = inputs
    for depth, units in enumerate(hidden):
        weight = rng.integers(-word, word, size=(units, width), endpoint=True)
        if depth == 0:
            span = steep * 2.0 ** (22 + fine) / (word * 2000.0 * max(inputs, 1))
            weight = np.clip((weight * span).astype(int), -word, word)
            shift, center = 0, weight @ ((low + high) // 2)
        else:
            shift, center = min(6, bits - 1), (weight.sum(axis=1) * 32768) >> 6
        noise = rng.integers(-(2**18), 2**18, size=units) * 1.0
        if depth == 0:
            bias = bias_words(middle + noise) - center
        else:
            bias = bias_words(middle - center + noise)
        layers.append(
            IntLayer(
                tuple(map(tuple, weight.tolist())), tuple(bias.tolist()), shift, activation, fine
            )
        )
        width = units
    least = 0 if outputs == 1 else -word
    last = rng.integers(least, word, size=(outputs, width), endpoint=True)
    layers.append(
        IntLayer(
            tuple(map(tuple, last.tolist())), tuple([-12345] * outputs), min(7, bits - 1), "linear"
        )
    )
    return IntNetwork(
        name,
        bits,
        tuple(Input(f"s{i + 1}", int(low[i]), int(high[i])) for i in range(inputs)),
        tuple(Output(f"y{i + 1}", "1", 0.5, 0, 1.0) for i in range(outputs)),
        tuple(layers),
        table,
    )
