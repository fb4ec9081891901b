"""A parameter that comes and goes with a period that nobody knows, from what it does at every
sample.

Around the strongest lines of its spectrum all periods are tried, each with every phase: weighted
least squares of an even course and a swing. Of a saw-tooth sums over the samples, in the order of
their phase, say at once what each phase would.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from softsense.effects.operators import LONG_PERIOD_S, SAW, SINE, wave

Floats = NDArray[np.float64]

# Of at least so many periods in a recording, each a long one of at least so many samples; around so
# many of the strongest lines, at so many frequencies, and again closer by.
LEAST_PERIODS = 2.5
LEAST_SAMPLES = 4.0
# Readings that are sent in batches of so many are the later the earlier they are in one.
BATCHES = range(3, 13)
LINES = 3
NEAR_A_LINE = 9
CLOSER = 3
# Teeth say less than so many times what their first line does.
OF_FIRST = 2.0
# A spectrum has a line between its own ones: so many times as many are looked at.
PADDED = 4


@dataclass(frozen=True)
class Course:
    """``begin + pace t + swing wave(shape, t / period_s + phase)`` (``operators.wave``).

    ``gained``: squares that it says more than an even course.
    """

    shape: str
    begin: float
    pace: float
    swing: float
    period_s: float
    phase: float
    gained: float


def courses(
    time_s: Floats,
    pull: Floats,
    power: Floats,
    least: float,
    shapes: Iterable[str] = (SINE, SAW),
) -> list[Course]:
    """The best course of each wave at even times ``time_s`` (samples,), that gains ``least``.

    ``pull`` and ``power`` (samples,): a parameter that is p at a sample gains 2 p pull - p^2 power.
    """
    even = _Even(time_s, pull, power)
    lines = even.lines(least / OF_FIRST) + even.batches(least / OF_FIRST)
    made = [_best(even, shape, lines) for shape in shapes] if lines else []
    return [course for course in made if course.gained > least]


class _Even:
    """What an even course leaves."""

    def __init__(self, time_s: Floats, pull: Floats, power: Floats) -> None:
        self.time_s, self.power = time_s, power
        self.long_s = float(time_s[-1] - time_s[0])
        # Columns of size 1 in the weighted product.
        one = np.full(len(time_s), 1.0 / np.sqrt(power.sum()))
        slope = time_s - float(one @ (power * time_s)) * one
        slope = slope / np.sqrt(float((power * slope) @ slope))
        self.columns: Floats = np.stack([one, slope])
        self.said: Floats = self.columns @ pull
        self.pull: Floats = pull - power * (self.said @ self.columns)

    def lines(self, least: float) -> list[float]:
        """Frequencies of the strongest lines that gain about ``least``."""
        count = PADDED * len(self.time_s)
        step_s = self.time_s[1] - self.time_s[0]
        at = np.fft.rfftfreq(count, step_s)
        size = np.abs(np.fft.rfft(self.pull, count))
        most = min(1.0 / LONG_PERIOD_S, 1.0 / (LEAST_SAMPLES * step_s))
        peak = (size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])
        there = 1 + np.flatnonzero(peak & (at[1:-1] * self.long_s > LEAST_PERIODS))
        gained = 2.0 * size**2 / self.power.sum()
        there = there[(at[there] < most) & (gained[there] > least)]
        strongest: list[float] = at[there[np.argsort(-size[there])[:LINES]]].tolist()
        return strongest

    def batches(self, least: float) -> list[float]:
        """The frequency of batches that gains most, if it gains about ``least``."""
        count, step_s = np.arange(len(self.time_s)), self.time_s[1] - self.time_s[0]
        said = {k: abs(np.exp(2j * np.pi * (count % k) / k) @ self.pull) ** 2 for k in BATCHES}
        best = max(said, key=said.__getitem__)
        enough = 2.0 * said[best] / self.power.sum() > least
        return [1.0 / (best * step_s)] if enough else []

    def course(self, shape: str, column: Floats, period_s: float, phase: float) -> Course:
        """With the ``column`` (samples,) of a wave."""
        shared = self.columns @ (self.power * column)
        rest = column - shared @ self.columns
        size = float((self.power * rest) @ rest)
        pull = float(rest @ self.pull)
        swing = pull / max(size, 1e-30)
        one, slope = self.said - swing * shared
        straight = one * self.columns[0] + slope * self.columns[1]
        pace = float(straight[-1] - straight[0]) / self.long_s
        begin = float(straight[0]) - pace * float(self.time_s[0])
        return Course(shape, begin, pace, swing, period_s, phase, swing * pull)


def _best(even: _Even, shape: str, lines: list[float]) -> Course:
    """The course of a wave, near any of ``lines``, that gains most."""
    with_phase = _sine if shape == SINE else _saw
    made = []
    for line in lines:
        middle, reach = line, 0.5 / even.long_s
        for _ in range(CLOSER):
            near = middle + reach * np.linspace(-1.0, 1.0, NEAR_A_LINE)
            best = max((with_phase(even, 1.0 / f) for f in near.tolist()), key=attrgetter("gained"))
            middle, reach = 1.0 / best.period_s, 2.0 * reach / (NEAR_A_LINE - 1)
        made.append(best)
    return max(made, key=attrgetter("gained"))


def _sine(even: _Even, period_s: float) -> Course:
    """The best phase of a sine."""
    turns = even.time_s / period_s
    both = np.stack([wave(SINE, turns), wave(SINE, turns + 0.25)])
    rest = both - (both * even.power) @ even.columns.T @ even.columns
    gram = (rest * even.power) @ rest.T
    sine, cosine = np.linalg.solve(gram + 1e-12 * np.trace(gram) * np.eye(2), rest @ even.pull)
    phase = float(np.arctan2(cosine, sine) / (2.0 * np.pi) % 1.0)
    return even.course(SINE, wave(SINE, turns + phase), period_s, phase)


def _saw(even: _Even, period_s: float) -> Course:
    """The best phase of a saw-tooth: it falls where a phase comes to one."""
    turns = even.time_s / period_s
    part = turns % 1.0
    order = np.argsort(part)
    # Of a tooth that falls nowhere, less one from each sample on.
    power, columns = even.power[order], even.columns[:, order]
    weighted = power * part[order]
    fallen = _from_each(power)
    shared = (columns @ weighted)[:, None] - np.stack([_from_each(power * c) for c in columns])
    square = float(weighted @ part[order]) - 2.0 * _from_each(weighted) + fallen
    pull = float(even.pull @ part) - _from_each(even.pull[order])
    size = square - (shared**2).sum(axis=0)
    gained = np.where(size > 1e-9 * square.max(), pull**2 / np.maximum(size, 1e-30), 0.0)
    at = int(np.argmax(gained))
    before = part[order[at - 1]] if at else part[order[-1]] - 1.0
    phase = float((1.0 - 0.5 * (before + part[order[at]])) % 1.0)
    return even.course(SAW, wave(SAW, turns + phase), period_s, phase)


def _from_each(values: Floats) -> Floats:
    """(samples,) the sum from each sample on."""
    return np.asarray(np.cumsum(values[::-1])[::-1])
