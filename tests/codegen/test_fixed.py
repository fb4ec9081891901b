"""The rounding rule, and the table of tanh over every argument that it can be asked."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsense_codegen.fixed import (
    NODE_SEGMENTS,
    ONE,
    between,
    floor_shift,
    table_error,
    tanh_table,
)


@given(st.integers(-(2**40), 2**40), st.integers(-8, 20))
def test_the_rule_is_floor(value: int, bits: int) -> None:
    expected = math.floor(value / 2**bits) if bits >= 0 else value * 2**-bits
    assert floor_shift(np.int64(value), bits) == expected


@pytest.mark.parametrize(("reach", "segments"), [(4.0, 64), (5.5, 256), (2.0, 32)])
def test_every_argument_of_the_table(reach: float, segments: int) -> None:
    """Exhaustive: all segments * 65536 arguments, against tanh and for monotony."""
    table = tanh_table(reach, segments)
    stated = table_error(table, reach)
    worst, last = 0.0, 0
    for segment in range(segments):
        z = np.arange(segment << 16, (segment + 1) << 16, dtype=np.int64)
        y = table.read(z)
        assert y.min() >= 0
        assert y.max() <= 65535
        assert y[0] >= last
        assert np.all(np.diff(y) >= 0)
        last = int(y[-1])
        truth = np.tanh(z / 2.0**16 * table.step - reach)
        worst = max(worst, float(np.abs(y / ONE - 1.0 - truth).max()))
    rise = max(np.diff(table.entries)) / ONE
    assert worst <= stated + rise * 64 / 2**16
    assert stated <= worst
    assert stated < 0.1 * table.step**2 + 2.0 / ONE


def test_beyond_its_reach_the_error_is_that_of_the_cut() -> None:
    table = tanh_table(3.0, 128)
    assert table_error(table, math.inf) == pytest.approx(1 - math.tanh(3.0), abs=2e-4)
    assert table_error(table, 3.0) < 2e-4
    assert table_error(table, 3.0) <= table_error(table, 3.5) <= table_error(table, math.inf)


def test_balanced_entries_halve_the_error_of_interpolation() -> None:
    table = tanh_table(4.0, 64)
    sagitta = 0.77 * table.step**2 / 8.0  # largest |tanh''| is 0.77
    assert table_error(table, 4.0) < 0.6 * sagitta


@pytest.mark.parametrize("reach", [3.5, 5.0, 8.0])
@pytest.mark.parametrize("segments", [256, 512, 1024, 2048])
def test_few_nodes_stand_for_a_fine_table(reach: float, segments: int) -> None:
    table = tanh_table(reach, segments)
    assert table.nodes is not None
    assert len(table.nodes) == NODE_SEGMENTS + 3
    made = between(np.array(table.nodes), segments // NODE_SEGMENTS)
    assert tuple(made.tolist()) == table.entries
    # A direct table is closer by a step of a 16-bit activation at the most.
    direct = tanh_table(reach, segments, nodes=segments)
    assert direct.nodes is None
    assert table_error(table, reach) < table_error(direct, reach) + 1.0 / ONE


def test_a_coarse_table_is_stored_whole() -> None:
    assert tanh_table(4.0, 128).nodes is None
