"""All traces that effects could leave in one channel, as inner products of columns.

The search compares thousands of models of a channel. Each is a least-squares fit on some columns,
and all that a fit needs are inner products. To choose a candidate beside others takes those over
the whole time, of one effect's columns with another's, where neighbouring samples may be taken
together; each such tile is made when it is first asked for. A model's error on blocks of time that
its fit has not seen takes those per block, of every sample of the few columns that were chosen.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.walk import ABREAST, innovations
from softsense.effects import MARKS, Candidate, Nominal, altered
from softsense.effects.operators import compiled

Floats = NDArray[np.float64]
# What is fitted has noise in its fourth digit: seven are enough, and half the memory.
Columns = NDArray[np.float32]
Pick = tuple[str, int]
# A candidate as all channels know it: its number, and what it is near.
Key = tuple[int, tuple[tuple[str, float], ...] | None]

# Parameters that are whole numbers, and have no interval.
COUNTED = frozenset({"source", "poles", "from", "way"}) | MARKS
BLOCKS = 12
# So many groups of columns, and of their products per block, are kept for what is asked next.
KEPT = 24
# The residual, an offset and the static curve, which stand before all effects.
BASE = ""
_RIDGE = 1e-7
# What is less of a column's square is rounding: of products of double, and of single precision.
_ROUNDING = 1e-12
_DIGITS = 3e-6
# What is less of two columns is not theirs apart: they are the same but for so much.
APART = 1e-3


@dataclass(frozen=True)
class Entry:
    """Where a candidate's columns stand in the table: ``at``, empty for those of another table.

    ``columns`` (samples, p) of the candidate, which has none itself. ``number`` in what its effect
    explains; where ``near`` is given, in its zoom around that; ``place``: where its effect acts
    (``Nominal.places``), or on the codes.
    """

    at: tuple[int, ...]
    candidate: Candidate
    columns: NDArray[np.floating]
    number: int
    near: Mapping[str, float] | None = None
    place: str = ""
    # The changed signal that it acts on, where that is not the channel's own.
    nominal: Nominal | None = None

    def laid(self, at: tuple[int, ...], columns: Columns) -> Entry:
        """The same ``at`` a place in a table, whose ``columns`` these are."""
        return altered(self, at=at, columns=columns)

    def apart(self) -> Entry:
        """The same in no table."""
        return altered(self, at=())

    def said(self, weights: Floats) -> Floats:
        """(samples,) of the columns with these weights, as exactly as the columns are."""
        said = self.columns @ weights.astype(self.columns.dtype)
        return said.astype(np.float64)

    @property
    def key(self) -> Key:
        """The same for the same candidate of another channel."""
        return self.number, None if self.near is None else tuple(sorted(self.near.items()))

    @property
    def width(self) -> int:
        """How many columns."""
        width: int = self.columns.shape[1]
        return width


def further(candidate: Candidate) -> int:
    """How many parameters it has beyond a first one; those that are numbered are as good as two."""
    return _further(frozenset(candidate.values))


@cache
def _further(names: frozenset[str]) -> int:
    keys = names - COUNTED
    kinds = {key.rstrip("0123456789") for key in keys}
    return max(len(kinds) + len(kinds - keys) - 1, 0)


@dataclass(frozen=True)
class Term:
    """A candidate in a fit: its effect, and the columns ``at`` of the table.

    ``fixed``: taken with a weight of 1, which may deviate where ``stiff`` is finite: that is what
    the square of the deviation costs.
    """

    name: str
    at: tuple[int, ...]
    fixed: bool = False
    stiff: float = 0.0


@dataclass(frozen=True, eq=False)
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
        return len(self.weights) + self.static_columns

    @property
    def static_columns(self) -> int:
        """Of these, those of the static part: none, an offset's, or a curve's."""
        return 0 if self.static is None else len(self.static)


class Group:
    """Candidates of one effect, and where their columns stand."""

    def __init__(self, entries: Sequence[Entry], rows: Sequence[NDArray[np.floating]]) -> None:
        """``entries`` of the table, which has these ``rows`` (samples,) of them, each once."""
        self.rows = rows
        widths = np.array([entry.width for entry in entries])
        self.columns = np.array([at for entry in entries for at in entry.at], dtype=np.intp)
        self.begins = np.concatenate([[0], np.cumsum(widths)])
        self.fixed = np.array([entry.candidate.fixed for entry in entries], dtype=bool)
        self.free_widths = np.where(self.fixed, 0, widths)
        self.curved = np.array([entry.candidate.curved for entry in entries])
        self.shifting = np.array([entry.candidate.shifting for entry in entries])
        self.further = np.array([further(entry.candidate) for entry in entries])
        self.pliable = [k for k, entry in enumerate(entries) if entry.candidate.pliable]
        # Those of one column whose weight is free.
        self.narrow = np.flatnonzero((widths == 1) & ~self.fixed)


class Base:
    """What stands before all effects, laid out once for every table of a channel."""

    def __init__(
        self,
        rows: Floats,
        gain: float | None = None,
        together: int = 1,
        felt: Floats | None = None,
    ) -> None:
        """``rows``: columns, each a row (…, samples), first the residual. ``gain``: of a walk,
        whose innovations all columns are, of which so much is ``felt`` (samples,). ``together``: so
        many samples make one where candidates are chosen."""
        self.rows: Floats = np.ascontiguousarray(rows)
        self.gain, self.together, self.felt = gain, together, felt
        self.whole = self.unforeseen(self.rows)
        self.chosen_by = -(-rows.shape[1] // together)
        self.laid = np.empty((len(rows), self.chosen_by), dtype=np.float32)
        # The residual keeps its size; of the others it is 1 from here on.
        self.scale = np.array(
            [_laid(row, together, self.laid[k], not k) for k, row in enumerate(self.whole)]
        )
        sizes = self.scale[:, None] * self.scale
        self.per_block: Floats = _block_products(self.whole, self.whole, BLOCKS) / sizes
        self.squares: Floats = self.per_block[:, 0, 0]

    def unforeseen(self, rows: NDArray[Any]) -> NDArray[Any]:
        """(n, samples) as they are, or beside a walk what their past does not foresee."""
        if self.gain is None:
            return rows
        return innovations((rows if self.felt is None else rows / self.felt).T, self.gain).T

    def each_unforeseen(self, rows: Sequence[NDArray[Any]]) -> Iterator[NDArray[Any]]:
        """The same of many ``rows`` (samples,), some at once."""
        if self.gain is None:
            yield from rows
            return
        for k in range(0, len(rows), ABREAST):
            yield from self.unforeseen(np.array(rows[k : k + ABREAST]))


class Design:
    """Inner products of one channel's residual, static curve and effects' columns."""

    def __init__(self, base: Base, groups: Mapping[str, Group] | None = None) -> None:
        """The columns of ``base``, and then those of each of the ``groups``; a column's number
        counts through."""
        self._before, self._groups = base, groups or {}
        parts: dict[str, Sequence[NDArray[Any]]] = {BASE: list(base.rows)}
        parts |= {name: group.rows for name, group in self._groups.items()}
        self._columns = [np.ascontiguousarray(row) for part in parts.values() for row in part]
        ends = np.cumsum([len(part) for part in parts.values()])
        begins = [0, *ends[:-1]]
        self._spans = dict(zip(parts, map(slice, begins, ends), strict=True))
        self.samples, self.chosen_by = base.rows.shape[1], base.chosen_by
        # Memory that is never written takes no room. To choose, half the digits are enough.
        self._rows = np.empty((ends[-1], self.chosen_by), dtype=np.float32)
        # Of a symmetric matrix, what is on the diagonal and right of it.
        self._total = np.empty((ends[-1], ends[-1]), dtype=np.float32)
        self._scale = np.empty(ends[-1])
        self._laid = {BASE}
        self._multiplied: set[tuple[str, str]] = set()
        self._ready: set[tuple[str, ...]] = set()
        self._wholes: dict[tuple[int, ...], Floats] = {}
        self._tiles: dict[tuple[tuple[int, ...], tuple[int, ...]], Floats] = {}
        self._grams: dict[tuple[tuple[int, ...], ...], Floats] = {}
        count = len(base.rows)
        self._rows[:count], self._scale[:count] = base.laid, base.scale
        self._base = tuple(range(count))
        self._tiles[self._base, self._base] = base.per_block
        # The residual stands first, and the offset before the curve, which includes it.
        self._static = {0: [], 1: [1], count - 2: list(range(2, count))}

    def _lay(self, name: str) -> None:
        """Write the rows of an effect."""
        if name in self._laid:
            return
        self._laid.add(name)
        span = self._spans[name]
        rows = self._before.each_unforeseen(self._columns[span])
        for number, row in enumerate(rows, span.start):
            self._scale[number] = _laid(row, self._before.together, self._rows[number], False)

    def _whole(self, columns: tuple[int, ...]) -> Floats:
        """(n, samples) of the columns, or their innovations, each of its own size."""
        if columns == self._base:
            return self._before.whole
        if columns in self._wholes:
            # What was asked longest ago is the first to go.
            self._wholes[columns] = self._wholes.pop(columns)
            return self._wholes[columns]
        _make_room(self._wholes)
        rows = np.array([self._columns[number] for number in columns], dtype=np.float64)
        self._wholes[columns] = self._before.unforeseen(rows)
        return self._wholes[columns]

    def _multiply(self, first: str, second: str) -> None:
        """See to it that the products of two effects' columns are there.

        Of one effect, those of a candidate's columns with each other.
        """
        if (first, second) in self._multiplied:
            return
        self._multiplied |= {(first, second), (second, first)}
        self._lay(first)
        self._lay(second)
        if first == second != BASE:
            group = self._groups[first]
            _own_products(self._rows, group.columns, group.begins, self._total)
            return
        a, b = sorted((self._spans[first], self._spans[second]), key=lambda span: span.start)
        np.matmul(self._rows[a], self._rows[b].T, out=self._total[a, b])

    def _per_block(self, first: tuple[int, ...], second: tuple[int, ...]) -> Floats:
        """(blocks, n, m) products of the columns ``first`` with ``second``."""
        if (first, second) not in self._tiles:
            one, other = self._whole(first), self._whole(second)
            sizes = self._scale[list(first), None] * self._scale[list(second)]
            self._tiles[first, second] = _block_products(one, other, BLOCKS) / sizes
        return self._tiles[first, second]

    @property
    def squares(self) -> Floats:
        """(blocks,) squares of the residual."""
        return self._before.squares

    def _index(self, terms: Sequence[Term], static: int) -> tuple[NDArray[np.intp], Floats, Floats]:
        """Columns, the signs of the last of them (fixed ones, the residual), and what the square of
        the others' weights costs."""
        free, stiff = self._static[static], [0.0] * len(self._static[static])
        fixed: list[int] = []
        for term in terms:
            if term.fixed:
                fixed.extend(term.at)
            if term.stiff < np.inf:
                free = [*free, *term.at]
                stiff += [term.stiff] * len(term.at)
        # Columns are scaled; a fixed one has a weight of 1 before it was scaled.
        signs = np.array([*(-self._scale[column] for column in fixed), 1.0])
        ridge: Floats = np.array(stiff) / self._scale[free] ** 2 + _RIDGE * self.samples
        return np.array([*free, *fixed, 0], dtype=np.intp), signs, ridge

    def fit(self, terms: Sequence[Term], static: int = 0) -> tuple[Floats, Floats]:
        """Squared errors (blocks,) where the fit has not seen the block; weights of the whole.

        ``static``: 0, 1 for an offset, or how many columns the static curve has.
        """
        for term in terms:
            self._lay(term.name)
        parts = (self._base, *(term.at for term in terms))
        if parts not in self._grams:
            _make_room(self._grams)
            self._grams[parts] = self._assembled(parts)
        index, signs, ridge = self._index(terms, static)
        place = {column: k for k, column in enumerate(sum(parts, ()))}
        at = np.array([place[c] for c in index.tolist()], dtype=np.intp)
        errors, whole = _unseen(self._grams[parts], at, signs, ridge)
        return errors, whole / self._scale[index[: len(ridge)]]

    def _assembled(self, parts: Sequence[tuple[int, ...]]) -> Floats:
        """(blocks, n, n) products of all columns of ``parts``."""
        ends = np.cumsum([len(part) for part in parts])
        spans = [slice(end - len(part), end) for part, end in zip(parts, ends, strict=True)]
        grams = np.empty((BLOCKS, ends[-1], ends[-1]))
        for (first, a), (second, b) in combinations_with_replacement(
            zip(parts, spans, strict=True), 2
        ):
            tile = self._per_block(first, second)
            grams[:, a, b] = tile
            grams[:, b, a] = tile.transpose(0, 2, 1)
        return grams

    def gains(self, terms: Sequence[Term], static: int, wanted: str) -> tuple[Floats, float]:
        """(candidates,) of the effect ``wanted``: by how much each lowers the fit's squared error,
        on the time it saw; and that error.

        ``terms`` and ``static`` as those of ``fit``.
        """
        there = (BASE, *(term.name for term in terms), wanted)
        if there not in self._ready:
            for two in combinations_with_replacement(there, 2):
                self._multiply(*two)
            self._ready.add(there)
        group = self._groups[wanted]
        # What a fixed candidate's column is scaled by, and 0 for the free ones.
        sizes = np.where(group.fixed, self._scale[group.columns[group.begins[:-1]]], 0.0)
        index, signs, ridge = self._index(terms, static)
        more, least = 10.0 * _RIDGE * self.samples, _DIGITS * self.chosen_by
        result: tuple[Floats, float] = _each_gain(
            self._total, index, signs, ridge, group.columns, group.begins, sizes, more, least
        )
        return result

    def best_beside(self, first: str, second: str) -> tuple[int, float]:
        """Of two effects, that candidate of the ``first`` which with one of the ``second`` lowers
        the squared error most, on the time that the fit saw, both of one free column; and by how
        much: not at all where there are none."""
        for two in combinations_with_replacement((BASE, first, second), 2):
            self._multiply(*two)
        group, other = self._groups[first], self._groups[second]
        if not len(group.narrow) or not len(other.narrow):
            return 0, 0.0
        a, b = (some.columns[some.begins[some.narrow]] for some in (group, other))
        upper = self._spans[first].start < self._spans[second].start
        cross = self._total[a[:, None], b] if upper else self._total[b[:, None], a].T
        said, other_said = self._total[0, a, None], self._total[0, b]
        own, others_own = self._total[a, a, None], self._total[b, b]
        gain = said**2 * others_own - 2.0 * said * other_said * cross + own * other_said**2
        apart = own * others_own - cross**2
        gain = np.where(apart > APART * own * others_own, gain / np.maximum(apart, 1e-30), 0.0)
        best = int(np.argmax(gain.max(axis=1)))
        return int(group.narrow[best]), float(gain[best].max())


def _make_room(kept: dict[Any, Floats]) -> None:
    """Let go of what was kept first, for one more."""
    if len(kept) >= KEPT:
        del kept[next(iter(kept))]


@compiled
def _laid(column: Floats, together: int, row: NDArray[np.float32], keeps: bool) -> float:
    """Write a column of size 1, or as it is where it ``keeps`` it, into ``row``; its size.

    So many samples (1, 2 or 4) are one ``together``: of what hardly moves in between that keeps the
    inner products, and of white noise the size.
    """
    size = 1.0 if keeps else np.sqrt(np.dot(column, column) / len(column)) + 1e-12
    whole = len(column) // together
    share = np.float32(1.0 / (size * np.sqrt(together)))
    # Where the compiler knows how many there are, the processor does several at once.
    if together == 1:
        for k in range(whole):
            row[k] = share * column[k]
    elif together == 2:
        for k in range(whole):
            row[k] = share * (column[2 * k] + column[2 * k + 1])
    else:
        for k in range(whole):
            two = column[4 * k] + column[4 * k + 1]
            row[k] = share * (two + (column[4 * k + 2] + column[4 * k + 3]))
    if whole < len(row):
        rest = column[whole * together :]
        row[whole] = rest.sum() / (size * np.sqrt(len(rest)))
    return size


def _block_products(one: Floats, other: Floats, blocks: int) -> Floats:
    """(blocks, n, m) products of the rows of ``one`` with those of ``other``."""
    result = np.empty((blocks, len(one), len(other)))
    size, longer = divmod(one.shape[1], blocks)
    # The first blocks are one sample longer: those of one length are multiplied at once.
    split = longer * (size + 1)
    for first, length, part in ((0, size + 1, result[:longer]), (split, size, result[longer:])):
        last = first + length * len(part)
        a, b = (r[:, first:last].reshape(len(r), len(part), length) for r in (one, other))
        np.matmul(a.transpose(1, 0, 2), b.transpose(1, 2, 0), out=part)
    return result


@compiled
def _own_products(
    rows: NDArray[np.float32],
    columns: NDArray[np.intp],
    begins: NDArray[np.intp],
    total: NDArray[np.float32],
) -> None:
    """Write the products of each entry's ``rows`` with each other into ``total``."""
    for e in range(len(begins) - 1):
        own = columns[begins[e] : begins[e + 1]]
        for i in range(len(own)):
            for j in range(i, len(own)):
                low, high = min(own[i], own[j]), max(own[i], own[j])
                total[low, high] = np.dot(rows[low], rows[high])


@compiled
def _product(total: NDArray[np.float32], i: int, j: int) -> float:
    """Of the columns ``i`` and ``j``, from a ``total`` on and right of whose diagonal all are."""
    product: float = total[i, j] if i < j else total[j, i]
    return product


@compiled
def _factor(gram: Floats, least: float) -> Floats:
    """The upper triangle whose transpose times itself is ``gram`` (n, n).

    A column of which those before it leave less than ``least`` is left out. Row by row, so that the
    innermost loops run along memory.
    """
    root = gram.copy()
    for k in range(len(gram)):
        root[k, k] = np.sqrt(root[k, k]) if root[k, k] > least else np.inf
        for i in range(k + 1, len(gram)):
            root[k, i] /= root[k, k]
        for j in range(k + 1, len(gram)):
            part = root[k, j]
            for i in range(j, len(gram)):
                root[j, i] -= part * root[k, i]
    return root


@compiled
def _forward(root: Floats, side: Floats) -> Floats:
    """(n,) whose product with the transpose of the upper triangle ``root`` is ``side``."""
    said = side.copy()
    for k in range(len(side)):
        said[k] /= root[k, k]
        for i in range(k + 1, len(side)):
            said[i] -= root[k, i] * said[k]
    return said


@compiled
def _unseen(
    grams: Floats, at: NDArray[np.intp], signs: Floats, ridge: Floats
) -> tuple[Floats, Floats]:
    """Squared errors (blocks,) on each block of a fit on all others, and the weights of all.

    Of the columns ``at`` the first are free, with a ``ridge`` each, and the others' sum, signed by
    ``signs``, is what is fitted. All blocks are one innermost loop.
    """
    blocks, free = len(grams), len(ridge)
    gram, side = np.zeros((free, free, blocks)), np.zeros((free, blocks))
    errors = np.zeros(blocks)
    for b in range(blocks):
        block = grams[b]
        for i in range(len(signs)):
            for j in range(len(signs)):
                errors[b] += signs[i] * signs[j] * block[at[free + i], at[free + j]]
        for i in range(free):
            row = block[at[i]]
            for j in range(i, free):
                gram[i, j, b] = row[at[j]]
            for j in range(len(signs)):
                side[i, b] += row[at[free + j]] * signs[j]
    # The fits without one block each, and at last the one of all.
    root, weights = np.empty((free, free, blocks + 1)), np.empty((free, blocks + 1))
    for i in range(free):
        weights[i, blocks] = side[i].sum()
        weights[i, :blocks] = weights[i, blocks] - side[i]
        for j in range(i, free):
            root[i, j, blocks] = gram[i, j].sum() + (ridge[i] if i == j else 0.0)
            root[i, j, :blocks] = root[i, j, blocks] - gram[i, j]
    _solve_each(root, weights)
    for i in range(free):
        part = np.zeros(blocks)
        for j in range(i + 1, free):
            for b in range(blocks):
                part[b] += gram[i, j, b] * weights[j, b]
        for b in range(blocks):
            own = gram[i, i, b] * weights[i, b] + 2.0 * (part[b] - side[i, b])
            errors[b] += weights[i, b] * own
    return errors, weights[:, blocks].copy()


@compiled
def _solve_each(root: Floats, weights: Floats) -> None:
    """Turn ``weights`` (n, systems), the right sides, into what solves the symmetric systems, whose
    upper halves ``root`` (n, n, systems) has, and write their triangles into it."""
    free, systems = weights.shape
    for k in range(free):
        for s in range(systems):
            own = root[k, k, s]
            for j in range(k):
                own -= root[j, k, s] ** 2
            # Rounding may leave less than nothing of columns that are nearly one.
            root[k, k, s] = np.sqrt(max(own, _ROUNDING * root[k, k, s]))
        for i in range(k + 1, free):
            row = root[k, i]
            for j in range(k):
                one, other = root[j, k], root[j, i]
                for s in range(systems):
                    row[s] -= one[s] * other[s]
            for s in range(systems):
                row[s] /= root[k, k, s]
    for k in range(free):
        for j in range(k):
            for s in range(systems):
                weights[k, s] -= root[j, k, s] * weights[j, s]
        for s in range(systems):
            weights[k, s] /= root[k, k, s]
    for k in range(free - 1, -1, -1):
        for j in range(k + 1, free):
            for s in range(systems):
                weights[k, s] -= root[k, j, s] * weights[j, s]
        for s in range(systems):
            weights[k, s] /= root[k, k, s]


@compiled
def _each_gain(
    total: NDArray[np.float32],
    index: NDArray[np.intp],
    signs: Floats,
    ridge: Floats,
    columns: NDArray[np.intp],
    begins: NDArray[np.intp],
    sizes: Floats,
    more: float,
    least: float,
) -> tuple[Floats, float]:
    """(entries,) squares that each entry's columns explain beside a fit; and what the fit leaves.

    Of the columns ``index`` the first are free, with a ``ridge`` each, and the others' sum, signed
    by ``signs``, is what is fitted. Entry ``e`` has the columns ``begins[e]`` … ``begins[e + 1]``
    of ``columns``, with the ridge ``more``, or where ``sizes`` has one is fixed at that size.
    ``least``: what is less of a column is rounding.
    """
    free = len(ridge)
    gram, side, error = np.empty((free, free)), np.zeros(free), 0.0
    for i in range(len(signs)):
        for j in range(len(signs)):
            error += signs[i] * signs[j] * _product(total, index[free + i], index[free + j])
    for i in range(free):
        for j in range(free):
            gram[i, j] = _product(total, index[i], index[j])
        gram[i, i] += ridge[i]
        for j in range(len(signs)):
            side[i] += _product(total, index[i], index[free + j]) * signs[j]
    root = _factor(gram, least)
    said = _forward(root, side)
    error -= (said**2).sum()
    # What the fit says of each column is taken off.
    above, rest, squares = (
        np.empty((free, len(columns))),
        np.zeros(len(columns)),
        np.zeros(len(columns)),
    )
    for j in range(len(signs)):
        for c in range(len(columns)):
            rest[c] += _product(total, index[free + j], columns[c]) * signs[j]
    for i in range(free):
        one = above[i]
        for c in range(len(columns)):
            one[c] = _product(total, index[i], columns[c])
        for k in range(i):
            part, other = root[k, i], above[k]
            for c in range(len(columns)):
                one[c] -= part * other[c]
        for c in range(len(columns)):
            one[c] /= root[i, i]
            rest[c] -= one[c] * said[i]
            squares[c] += one[c] ** 2
    result = np.empty(len(begins) - 1)
    for e in range(len(result)):
        first, width = begins[e], begins[e + 1] - begins[e]
        own = max(total[columns[first], columns[first]] - squares[first], 0.0)
        if sizes[e] > 0.0:
            result[e] = 2.0 * rest[first] * sizes[e] - own * sizes[e] ** 2
            continue
        if width == 1:
            result[e] = rest[first] ** 2 / (own + more) if own + more > least else 0.0
            continue
        inner = np.empty((width, width))
        for i in range(width):
            for j in range(i, width):
                product = _product(total, columns[first + i], columns[first + j])
                for k in range(free):
                    product -= above[k, first + i] * above[k, first + j]
                inner[i, j] = product + more if i == j else product
        root = _factor(inner, least)
        result[e] = (_forward(root, rest[first : first + width]) ** 2).sum()
    return result, error
