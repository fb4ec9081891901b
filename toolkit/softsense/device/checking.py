"""What a board must answer: the integer reference, on codes from all over the input space."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softsense.device.board import adc_bits, networks
from softsense.errors import SoftsenseError
from softsense_codegen import reference
from softsense_codegen.network import IntNetwork

# Corners of the box are 2^inputs: beyond this many inputs a random share of them is taken.
MOST_CORNER_INPUTS = 10


def vectors(out: Path, count: int, seed: int) -> tuple[NDArray[np.int16], NDArray[np.int32]]:
    """Codes (rows, inputs) and the estimates (rows, outputs) they must give.

    All corners of the converter's range and of int16, then ``count`` random rows: half within the
    converter's range, half anywhere in int16.
    """
    network = networks(out)[0]
    inputs = len(network.inputs)
    path = out / f"{network.name}.json"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise SoftsenseError(
            f"cannot be read: {error.strerror}", where=str(path), remedy="export the model again"
        ) from error
    rng = np.random.default_rng(seed)
    highest = 2 ** adc_bits(out) - 1
    ends = np.array([[-0x8000, 0x7FFF], [0, highest]])
    if inputs <= MOST_CORNER_INPUTS:
        chosen = np.array(list(itertools.product((0, 1), repeat=inputs)))
    else:
        chosen = rng.integers(0, 2, (1 << MOST_CORNER_INPUTS, inputs))
    corners = np.concatenate([pair[chosen] for pair in ends])
    inside = rng.integers(0, highest + 1, (count - count // 2, inputs))
    anywhere = rng.integers(-0x8000, 0x8000, (count // 2, inputs))
    codes = np.ascontiguousarray(np.concatenate([corners, inside, anywhere]), np.int16)
    return codes, reference.estimate(IntNetwork.from_json(text, str(path)), codes)
