"""All traces that effects could leave in one channel, as products of columns per block of time.

The search compares thousands of models of a channel. Each is a least-squares fit on some columns,
and all that a fit needs are inner products: they are taken once, per block of time, so that a
model's error on blocks that its fit has not seen costs no more than a small linear solve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from softsense.effects import Candidate, Nominal
from softsense.effects.operators import compiled

Floats = NDArray[np.float64]
Pick = tuple[str, int]

BLOCKS = 12
_RIDGE = 1e-7


@dataclass(frozen=True)
class Entry:
    """Where a candidate's columns stand in the table: ``at``, empty for those of another table.

    ``number`` in what its effect explains; where ``near`` is given, in its zoom around that.
    """

    at: tuple[int, ...]
    candidate: Candidate
    number: int
    near: Mapping[str, float] | None = None
    # The changed signal that it acts on, where that is not the channel's own.
    nominal: Nominal | None = None

    @property
    def width(self) -> int:
        """How many columns."""
        width: int = self.candidate.columns.shape[1]
        return width


@dataclass(frozen=True)
class Fit:
    """Least squares on some candidates: squared errors (blocks,) on unseen blocks, and weights.

    ``weights`` of the free candidates' columns in the order of ``picks``; ``static`` of the offset
    (1,) or of the static curve, None without either.
    """

    picks: tuple[Pick, ...]
    errors: Floats
    weights: Floats
    static: Floats | None

    @property
    def columns(self) -> int:
        """How many weights were fitted."""
        return len(self.weights) + (0 if self.static is None else len(self.static))


class Group:
    """Candidates of one effect, and where their columns stand."""

    def __init__(self, entries: Sequence[Entry]) -> None:
        """``entries`` of the table."""
        widths = np.array([entry.width for entry in entries])
        self.columns = np.array([at for entry in entries for at in entry.at], dtype=np.intp)
        self.begins = np.concatenate([[0], np.cumsum(widths)])
        self.fixed = np.array([entry.candidate.fixed for entry in entries])
        self.free_widths = np.where(self.fixed, 0, widths)
        self.curved = np.array([entry.candidate.curved for entry in entries])
        self.conditional = np.array([entry.candidate.conditional for entry in entries])


class Design:
    """Inner products of one channel's residual, static curve and candidates, per block of time."""

    def __init__(self, table: Floats) -> None:
        """``table`` (samples, p): last the residual."""
        self.samples = len(table)
        self.grams = np.empty((BLOCKS, table.shape[1], table.shape[1]))
        for part, gram in zip(np.array_split(table, BLOCKS), self.grams, strict=True):
            np.matmul(part.T, part, out=gram)
        squares = np.einsum("bii->i", self.grams)
        self.scale = np.sqrt(squares / self.samples) + 1e-12
        self.scale[-1] = 1.0
        # Columns of size 1 from here on; the residual keeps its own.
        self.grams /= self.scale[:, None] * self.scale
        self.total = self.grams.sum(axis=0)
        self.y = table.shape[1] - 1

    def fit(
        self, free: Sequence[int], fixed: Sequence[int], stiff: Floats
    ) -> tuple[Floats, Floats]:
        """Squared errors (blocks,) where the fit has not seen the block; weights of the whole.

        ``fixed`` columns are taken with a weight of 1. ``stiff`` (free,): what a free weight's
        square costs, for what may only deviate a little.
        """
        width = len(free)
        target = np.array([*fixed, self.y], dtype=np.intp)
        # Columns are scaled; a fixed one has a weight of 1 before it was scaled.
        signs = np.append(-self.scale[list(fixed)], 1.0)
        index = np.concatenate([np.array(free, dtype=np.intp), target])
        sub = self.grams[:, index[:, None], index]
        squares: Floats = signs @ sub[:, width:, width:] @ signs
        if width == 0:
            return squares, np.zeros(0)
        grams, sides = sub[:, :width, :width], sub[:, :width, width:] @ signs
        ridge = self._ridge(free, stiff)
        gram, side = grams.sum(axis=0), sides.sum(axis=0)
        weights = np.linalg.solve(gram - grams + ridge, (side - sides)[..., None])[..., 0]
        error = squares - 2.0 * (weights * sides).sum(axis=1)
        error += ((grams @ weights[..., None])[..., 0] * weights).sum(axis=1)
        whole = np.linalg.solve(gram + ridge, side)
        return error, whole / self.scale[index[:width]]

    def _ridge(self, free: Sequence[int], stiff: Floats) -> Floats:
        ridge: Floats = np.diag(stiff / self.scale[list(free)] ** 2 + _RIDGE * self.samples)
        return ridge

    def gains(
        self, free: Sequence[int], fixed: Sequence[int], stiff: Floats, group: Group
    ) -> tuple[Floats, float]:
        """(candidates,) by how much each lowers the fit's squared error, on the time it saw; and
        that error."""
        total, known, sizes = self.total, list(fixed), self.scale[list(fixed)]
        side = total[self.y] - sizes @ total[known]
        error = float(side[self.y] - sizes @ side[known])
        wanted = group.columns
        if len(free):
            index = np.array(free, dtype=np.intp)
            gram = total[index[:, None], index] + self._ridge(free, stiff)
            root = np.linalg.cholesky(gram)
            sides = np.column_stack([total[index[:, None], wanted], side[index]])
            said = solve_triangular(root, sides, lower=True, check_finite=False)
            above = np.ascontiguousarray(said[:, :-1].T)
            rest = side[wanted] - above @ said[:, -1]
            error -= float(said[:, -1] @ said[:, -1])
        else:
            above, rest = np.zeros((len(wanted), 1)), side[wanted]
        # What a fixed candidate's column is scaled by, and 0 for the free ones.
        sizes = np.where(group.fixed, self.scale[wanted[group.begins[:-1]]], 0.0)
        ridge = 10.0 * _RIDGE * self.samples
        result: Floats = _each_gain(total, wanted, group.begins, above, rest, sizes, ridge)
        return result, error


@compiled
def _each_gain(
    total: Floats,
    columns: NDArray[np.intp],
    begins: NDArray[np.intp],
    above: Floats,
    rest: Floats,
    sizes: Floats,
    ridge: float,
) -> Floats:
    """(entries,) squares that each entry's columns explain of ``rest``, by their Cholesky factor.

    Entry ``e`` has the columns ``begins[e]`` … ``begins[e + 1]`` of ``columns``; of their products
    (``total``) those of ``above`` are taken off, which say what other columns explain already.
    """
    result = np.empty(len(begins) - 1)
    for e in range(len(result)):
        first, width = begins[e], begins[e + 1] - begins[e]
        if sizes[e] > 0.0:
            square = total[columns[first], columns[first]] - (above[first] ** 2).sum()
            result[e] = 2.0 * rest[first] * sizes[e] - square * sizes[e] ** 2
            continue
        root = np.empty((width, width))
        said = np.empty(width)
        gain = 0.0
        for i in range(width):
            for j in range(i + 1):
                product = total[columns[first + i], columns[first + j]]
                for k in range(above.shape[1]):
                    product -= above[first + i, k] * above[first + j, k]
                for k in range(j):
                    product -= root[i, k] * root[j, k]
                if i == j:
                    # Rounding may leave less than nothing of columns that are nearly one.
                    root[i, i] = np.sqrt(max(product + ridge, 0.1 * ridge))
                else:
                    root[i, j] = product / root[j, j]
            said[i] = rest[first + i]
            for k in range(i):
                said[i] -= root[i, k] * said[k]
            said[i] /= root[i, i]
            gain += said[i] ** 2
        result[e] = gain
    return result
