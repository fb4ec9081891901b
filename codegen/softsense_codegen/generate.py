"""An integer network to files: C header and source, test vectors, and the network itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from softsense_codegen import reference
from softsense_codegen.atomic import write_text
from softsense_codegen.network import IntNetwork
from softsense_codegen.render import render
from softsense_codegen.view import Optimise, network_view, vectors_view

# Vectors for a self-test in flash: enough to touch every unit, few enough for a small device.
SELF_TEST_VECTORS = 48


def generate(
    net: IntNetwork,
    out: str | Path,
    codes: ArrayLike | None = None,
    cost_lines: Sequence[str] = (),
    optimise: Optimise = "speed",
) -> list[Path]:
    """Write NAME.h, NAME.c, NAME_vectors.h and NAME.json into ``out``; returns their paths.

    ``codes``: (samples, inputs) recorded codes, some of which join the corners and the random
    codes of the vectors. ``cost_lines``: measured costs, for the header. ``optimise``: "speed"
    (a table of words, an unrolled loop) or "size" (half the table, a tight loop), the same bits.
    """
    out = Path(out)
    view = network_view(net, cost_lines, optimise)
    x = self_test_codes(net, codes)
    y = reference.estimate(net, x)
    rows = list(zip(x.tolist(), y.tolist(), strict=True))
    return [
        write_text(out / f"{net.name}.h", render("network.h.j2", view)),
        write_text(out / f"{net.name}.c", render("network.c.j2", view)),
        write_text(out / f"{net.name}_vectors.h", render("vectors.h.j2", vectors_view(net, rows))),
        write_text(out / f"{net.name}.json", net.to_json()),
    ]


def self_test_codes(net: IntNetwork, codes: ArrayLike | None = None) -> np.ndarray:
    """Codes (SELF_TEST_VECTORS, inputs): corners, ends of int16, random, and recorded ones."""
    low = np.array([i.low for i in net.inputs])
    high = np.array([i.high for i in net.inputs])
    rng = np.random.default_rng(0)
    quarter = SELF_TEST_VECTORS // 4
    corners = np.where(rng.random((quarter, len(low))) < 0.5, low, high)
    corners[0], corners[1] = low, high
    wild = rng.integers(-32768, 32767, size=(quarter, len(low)), endpoint=True)
    wild[0], wild[1] = -32768, 32767
    inside = rng.integers(low, high, size=(quarter, len(low)), endpoint=True)
    recorded = inside
    if codes is not None:
        table = np.atleast_2d(np.asarray(codes, dtype=np.int64))
        recorded = table[np.linspace(0, len(table) - 1, quarter).astype(int)]
    return np.concatenate([corners, wild, inside, recorded]).astype(np.int16)
