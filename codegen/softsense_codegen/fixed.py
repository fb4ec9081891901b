"""Integer primitives: the one rounding rule, and the table that stands for tanh.

The rounding rule of everything that runs on the device is **floor**: every product or
interpolation is shifted right and its fraction dropped, towards minus infinity. What rounding to
nearest would have gained is folded into biases and table entries when the network is made.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]

INT32_MIN, INT32_MAX = -(2**31), 2**31 - 1
# Activations travel as 16-bit unsigned words: 0 … 65535 stands for -1 … 1 (minus one step).
ONE = 1 << 15
ACTIVATION_MAX = (1 << 16) - 1
# The fraction between two table entries has 16 bits.
FRACTION_BITS = 16
# Entries of a finer table are made between the ends of so many intervals; small code stores these.
NODE_SEGMENTS = 128


def floor_shift(value: Integers, bits: int) -> Integers:
    """value / 2**bits rounded towards minus infinity: the rounding rule (exact for bits < 0)."""
    return value >> bits if bits >= 0 else value << -bits


@dataclass(frozen=True)
class Table:
    """(1 + tanh) * 2**15 on a uniform grid from -reach to reach, for linear interpolation.

    ``entries``: (segments + 1,) uint16. An argument z, in units of ``step`` / 2**16, counted from
    -reach, is read as entry i = z >> 16, fraction f = z & 0xffff,
    y = entries[i] + (rise * f + rise >> 16) with rise = entries[i + 1] - entries[i].
    """

    reach: float
    entries: tuple[int, ...]

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.entries) - 1

    @cached_property
    def nodes(self) -> tuple[int, ...] | None:
        """The few nodes that ``between`` makes all entries of, or None where it cannot."""
        ratio = self.segments // NODE_SEGMENTS
        if ratio < 2 or self.segments % NODE_SEGMENTS:
            return None
        nodes = _padded(np.asarray(self.entries[::ratio]))
        if tuple(between(nodes, ratio).tolist()) != self.entries:
            return None
        return tuple(nodes.tolist())

    @property
    def step(self) -> float:
        """Width of a segment, in units of the argument of tanh."""
        return 2.0 * self.reach / self.segments

    @property
    def last(self) -> int:
        """The largest argument, in units of step / 2**16."""
        return (self.segments << FRACTION_BITS) - 1

    def read(self, z: Integers) -> Integers:
        """The device's activation (any shape), 0 … 65535, of arguments 0 … ``last``."""
        entries = np.asarray(self.entries, dtype=z.dtype)
        index = z >> FRACTION_BITS
        fraction = z & (2**FRACTION_BITS - 1)
        low = entries[index]
        rise = entries[index + 1] - low
        result: Integers = low + ((rise * fraction + rise) >> FRACTION_BITS)
        return result


def tanh_table(reach: float, segments: int, nodes: int = NODE_SEGMENTS) -> Table:
    """The table of tanh with ``segments`` segments from -reach to reach.

    ``segments`` is a power of two, so that a core with a saturating instruction clips in one.
    Entries lie off the curve by half the sagitta of their segments, -f'' h**2 / 16, which halves
    the error of linear interpolation, and a quarter of a step up, which centres the two floors.
    Where there are fewer ``nodes`` than segments, the other entries are made ``between`` them.
    """
    if segments & (segments - 1):
        raise ValueError(f"{segments} segments are no power of two")
    stored = min(segments, nodes)
    z = np.linspace(-reach, reach, stored + 1)
    step = 2.0 * reach / segments
    tanh = np.tanh(z)
    curvature = -2.0 * tanh * (1.0 - tanh**2)
    balanced = tanh - curvature * step**2 / 16.0
    # The outer entries also stand for everything beyond: halfway between there and one.
    rounded = np.floor((1.0 + balanced) * ONE + 0.5 + 0.25).astype(np.int64)
    entries = np.clip(rounded, 0, ACTIVATION_MAX)
    if segments > stored:
        entries = between(_padded(entries), segments // stored)
    return Table(reach, tuple(entries.tolist()))


def between(nodes: Integers, ratio: int) -> Integers:
    """``ratio`` entries (a power of two) per interval of ``nodes``, rounded to nearest.

    ``nodes``: (intervals + 3,), one beyond either end. Bessel's formula with the mean of the
    two second differences (Whittaker and Robinson 1924), in integers; at j of r = ``ratio``:
    n1 + j/r (n2 - n1) + j (r - j) / (4 r**2) (n1 + n2 - n0 - n3).
    """
    j = np.arange(ratio)
    n0, n1, n2, n3 = (nodes[i : len(nodes) - 3 + i, None] for i in range(4))
    sums = (n1 * ratio + j * (n2 - n1)) * 4 * ratio + j * (ratio - j) * (n1 + n2 - n0 - n3)
    made = (sums + 2 * ratio**2) // (4 * ratio**2)
    entries: Integers = np.append(made.ravel(), nodes[-2])
    return entries


def _padded(nodes: Integers) -> Integers:
    """``nodes`` and one more at either end, on the line through the outer two."""
    first, last = 2 * nodes[0] - nodes[1], 2 * nodes[-1] - nodes[-2]
    padded: Integers = np.concatenate([[first], nodes, [last]]).astype(np.int64)
    return padded.clip(0, ACTIVATION_MAX)


def table_error(table: Table, needed: float = math.inf) -> float:
    """Worst |table - tanh| for arguments within +-``needed``, those beyond the reach included.

    Exhaustive over the table's 2**16 fractions of every segment in steps of 64; in between the
    error changes by less than 64 / 2**16 of a segment's rise.
    """
    z = np.append(np.arange(0, table.last + 1, 64, dtype=np.int64), table.last)
    value = table.read(z) / ONE - 1.0
    argument = z / 2.0**FRACTION_BITS * table.step - table.reach
    inside = np.abs(argument) <= needed
    error = float(np.abs(value - np.tanh(argument))[inside].max())
    if needed <= table.reach:
        return error
    edge = math.tanh(needed)
    return max(error, edge - float(value[-1]), edge + float(value[0]))
