"""Small SVG charts that take their colours from the page.

Lines longer than the picture is wide are drawn by the extremes of each pixel column, so that no
spike is lost and a million samples stay small.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
COLOURS = "abcd"
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 520, 56, 12, 14, 34


@dataclass(frozen=True)
class Line:
    """One curve: ``y`` over the chart's x, its label, and whether to draw dots instead."""

    y: Floats
    label: str


def lines(
    x: Floats, curves: Sequence[Line], x_label: str, y_label: str, height: int = 220, wide: int = 1
) -> str:
    """Curves over a common, increasing x."""
    width = WIDTH * wide
    values = np.concatenate([curve.y for curve in curves])
    frame = _Frame(width, height, _range(x), _range(values))
    parts = [frame.axes(x_label, y_label)]
    for curve, colour in zip(curves, COLOURS, strict=False):
        parts.append(f'<path class="thin {colour}" d="{frame.path(x, curve.y)}"/>')
    return frame.svg(parts, [curve.label for curve in curves], f"{y_label} over {x_label}")


def scatter(x: Floats, y: Floats, x_label: str, y_label: str, diagonal: bool = True) -> str:
    """Points; at most 1500 of them, evenly drawn. ``diagonal``: equal axes, the line y = x."""
    both = _range(np.concatenate([x, y]))
    frame = _Frame(WIDTH, 320, both if diagonal else _range(x), both if diagonal else _range(y))
    pick = np.unique(np.linspace(0, len(x) - 1, min(len(x), 1500)).astype(int))
    parts = [frame.axes(x_label, y_label)]
    if diagonal:
        ends = np.array(both)
        parts.append(f'<path class="thin axis" d="{frame.path(ends, ends)}"/>')
    dots = "".join(
        f"M{frame.x(a):.1f} {frame.y(b):.1f}h.01" for a, b in zip(x[pick], y[pick], strict=True)
    )
    parts.append(
        f'<path class="a" d="{dots}" stroke-width="3" stroke-linecap="round" opacity=".45"/>'
    )
    return frame.svg(parts, [], f"{y_label} against {x_label}")


def bars(labels: Sequence[str], values: Sequence[float], y_label: str, colour: str = "a") -> str:
    """Horizontal bars, labelled at both ends."""
    row, left = 22, 150
    top = max([*values, 0.0]) or 1.0
    height = row * len(labels) + 24
    parts = []
    for number, (label, value) in enumerate(zip(labels, values, strict=True)):
        length = max(value, 0.0) / top * (WIDTH - left - 70)
        y = 4 + row * number
        parts.append(
            f'<text class="strong" x="{left - 6}" y="{y + 13}" text-anchor="end">'
            f"{escape(_short(label))}</text>"
            f'<rect class="f{colour}" x="{left}" y="{y + 2}" width="{length:.1f}" height="15" '
            f'rx="2"/><text x="{left + length + 5:.1f}" y="{y + 13}">{value:.4g}</text>'
        )
    parts.append(f'<text x="{left}" y="{height - 6}">{escape(y_label)}</text>')
    return _svg(WIDTH, height, parts, y_label)


def histogram(values: Floats, x_label: str) -> str:
    """Counts of ``values`` in 41 bins, symmetric about zero."""
    reach = float(np.abs(values).max()) or 1.0
    counts, edges = np.histogram(values, bins=41, range=(-reach, reach))
    frame = _Frame(WIDTH, 220, (-reach, reach), (0.0, float(counts.max()) * 1.05))
    parts = [frame.axes(x_label, "samples")]
    for count, low, high in zip(counts, edges, edges[1:], strict=False):
        parts.append(
            f'<rect class="fa" x="{frame.x(low):.1f}" y="{frame.y(count):.1f}" '
            f'width="{max(frame.x(high) - frame.x(low) - 1, 1):.1f}" '
            f'height="{frame.y(0) - frame.y(count):.1f}"/>'
        )
    return frame.svg(parts, [], f"histogram of {x_label}")


def heat(values: ArrayLike, rows: Sequence[str], columns: Sequence[str], label: str) -> str:
    """A table of shaded cells, (rows, columns); cells that are not finite stay empty."""
    table = np.asarray(values, dtype=np.float64)
    left, cell = 90, max(min((WIDTH - 100) // max(len(columns), 1), 60), 6)
    high = 22 if len(rows) <= 24 else 8
    finite = table[np.isfinite(table)]
    low, top = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    parts = []
    for i, name in enumerate(rows):
        if len(rows) <= 24:
            parts.append(
                f'<text class="strong" x="{left - 6}" y="{19 + high * i + 15}" '
                f'text-anchor="end">{escape(_short(name, 12))}</text>'
            )
        for j in range(len(columns)):
            if not np.isfinite(table[i, j]):
                continue
            shade = 0.08 + 0.87 * (table[i, j] - low) / ((top - low) or 1.0)
            x, y = left + cell * j, 19 + high * i
            parts.append(
                f'<rect class="fa" x="{x}" y="{y}" width="{cell - 1}" height="{high - 1}" '
                f'opacity="{shade:.2f}"><title>{table[i, j]:.4g}</title></rect>'
            )
    if len(columns) <= 24:
        parts += [
            f'<text x="{left + cell * j + cell / 2:.0f}" y="13" text-anchor="middle">'
            f"{escape(_short(name, 8))}</text>"
            for j, name in enumerate(columns)
        ]
    height = 19 + high * len(rows) + 22
    parts.append(
        f'<text x="{left}" y="{height - 6}">{escape(label)}: {low:.3g} (pale) … {top:.3g}</text>'
    )
    return _svg(WIDTH, height, parts, label)


class _Frame:
    """Maps data to pixels and draws the axes."""

    def __init__(
        self, width: int, height: int, x: tuple[float, float], y: tuple[float, float]
    ) -> None:
        self.width, self.height = width, height
        self.x_range, self.y_range = x, y

    def x(self, value: float) -> float:
        low, high = self.x_range
        return LEFT + (value - low) / (high - low) * (self.width - LEFT - RIGHT)

    def y(self, value: float) -> float:
        low, high = self.y_range
        return self.height - BOTTOM - (value - low) / (high - low) * (self.height - TOP - BOTTOM)

    def path(self, x: Floats, y: Floats) -> str:
        """A polyline; of more points than pixels only each column's extremes."""
        columns = self.width - LEFT - RIGHT
        if len(x) > 2 * columns:
            edges = np.linspace(0, len(x), columns + 1).astype(int)
            keep = []
            for a, b in itertools.pairwise(edges):
                if b > a:
                    keep += sorted({a + int(y[a:b].argmin()), a + int(y[a:b].argmax())})
            x, y = x[keep], y[keep]
        points = [f"{self.x(a):.1f} {self.y(b):.1f}" for a, b in zip(x, y, strict=True)]
        return "M" + "L".join(points)

    def axes(self, x_label: str, y_label: str) -> str:
        bottom, right = self.height - BOTTOM, self.width - RIGHT
        parts = [f'<path class="axis" d="M{LEFT} {TOP}V{bottom}H{right}"/>']
        for value in _ticks(self.x_range):
            parts.append(
                f'<text x="{self.x(value):.1f}" y="{bottom + 14}" text-anchor="middle">'
                f"{value:.6g}</text>"
            )
        for value in _ticks(self.y_range):
            parts.append(
                f'<text x="{LEFT - 5}" y="{self.y(value) + 4:.1f}" text-anchor="end">'
                f"{value:.6g}</text>"
            )
        parts.append(
            f'<text x="{right}" y="{self.height - 4}" text-anchor="end">{escape(x_label)}</text>'
            f'<text x="4" y="{TOP - 3}">{escape(y_label)}</text>'
        )
        return "".join(parts)

    def svg(self, parts: Sequence[str], legend: Sequence[str], label: str) -> str:
        drawn = list(parts)
        for number, (name, colour) in enumerate(zip(legend, COLOURS, strict=False)):
            x = LEFT + 90 + 130 * number
            drawn.append(
                f'<path class="thick {colour}" d="M{x} {TOP - 6}h16"/>'
                f'<text class="strong" x="{x + 20}" y="{TOP - 2}">{escape(_short(name))}</text>'
            )
        return _svg(self.width, self.height, drawn, label)


def _svg(width: int, height: int, parts: Sequence[str], label: str) -> str:
    return (
        f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(label)}">'
        f"{''.join(parts)}</svg>"
    )


def _range(values: Floats) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _ticks(ends: tuple[float, float]) -> list[float]:
    """Two to six round numbers within ``ends``."""
    span = ends[1] - ends[0]
    step = 10.0 ** np.floor(np.log10(span))
    for factor in (1.0, 0.5, 0.25, 0.2, 0.1, 0.05):
        width = step * factor
        first = int(np.ceil(ends[0] / width - 1e-9))
        last = int(np.floor(ends[1] / width + 1e-9))
        if 3 <= last - first + 1 <= 8:
            return [float(k * width) for k in range(first, last + 1)]
    return [ends[0], ends[1]]


def _short(text: str, most: int = 20) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
