"""Plug-in entropy and mutual information of discrete labels, in bits or nats.

The plug-in (maximum likelihood) estimate puts the observed share c/n of every joint state into
H = -sum p log p = log n - (1/n) sum c log c. It is the measure of the paper (raw 12-bit codes). Its
entropy is too low by about (states - 1) / 2n nats (Miller 1955), so its mutual information is too
high, by about (joint states - states of X - states of Y + 1) / 2n nats; when nearly every joint
state of X was seen once, I(X;Y) equals H(Y) whatever X is, and ranks nothing. Trust it for one or
two sensors and many more samples than states.

How it is fast: a state that was seen once adds nothing to sum c log c, and stays alone whatever
variable is added. So the samples are kept as groups of equal states, singles dropped, and adding a
variable splits the groups (partition refinement). No joint state is ever numbered: nothing
overflows, and the work shrinks as states get rarer.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Labels = NDArray[np.int32]
Weights = NDArray[np.float64]
Unit = Literal["bits", "nats"]

# Labels up to here index a counting table directly; larger or negative ones are renumbered first.
DIRECT_LABELS = 1 << 16


def entropy(x: ArrayLike, unit: Unit = "bits", weights: Weights | None = None) -> float:
    """H(X) of integer labels ``x``, (samples,) or (samples, variables) taken jointly.

    With ``weights`` (samples,) the shares are shares of weight.
    """
    columns, states = _columns(x)
    if weights is not None:
        return _in(unit, _weighted_entropy(_joint_labels(columns, states), weights))
    return _in(unit, _joint_entropy(columns, states, _table(columns.shape[1])))


def mutual_information(
    x: ArrayLike, y: ArrayLike, unit: Unit = "bits", weights: Weights | None = None
) -> float:
    """I(X;Y) = H(X) + H(Y) - H(X,Y) of integer labels, (samples,) or (samples, variables) each."""
    first, first_states = _columns(x)
    second, second_states = _columns(y)
    _same_length(first, second)
    sums = _table(first.shape[1])
    states = max(first_states, second_states)
    if weights is not None:
        own, other = _joint_labels(first, states), _joint_labels(second, states)
        both = _joint_labels(np.stack([own, other]), int(other.max()) + 1)
        parts = [_weighted_entropy(label, weights) for label in (own, other, both)]
        return _in(unit, parts[0] + parts[1] - parts[2])
    if len(first) == 1 and len(second) == 1:
        return _in(unit, _pair(first[0], second[0], states, sums))
    label = second[0] if len(second) == 1 else _joint_labels(second, second_states)
    states = max(states, int(label.max()) + 1)
    return _in(unit, _set_and_label(first, label, states, sums))


def conditional_mutual_information(
    x: ArrayLike, y: ArrayLike, given: ArrayLike, unit: Unit = "bits"
) -> float:
    """I(X;Y|Z) = H(X,Z) + H(Y,Z) - H(X,Y,Z) - H(Z) of integer labels."""
    first, a = _columns(x)
    second, b = _columns(y)
    third, c = _columns(given)
    _same_length(first, second)
    _same_length(first, third)
    states = max(a, b, c)
    sums = _table(first.shape[1])
    return _in(
        unit,
        _joint_entropy(np.concatenate([first, third]), states, sums)
        + _joint_entropy(np.concatenate([second, third]), states, sums)
        - _joint_entropy(np.concatenate([first, second, third]), states, sums)
        - _joint_entropy(third, states, sums),
    )


def subset_entropies(
    x: ArrayLike, y: ArrayLike, max_size: int | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """H(S), H(S,Y) in bits for every subset S of the columns of ``x``, and H(Y).

    ``x``: labels (samples, variables), at most 20 variables; ``y``: (samples,) or (samples,
    targets) taken jointly. Both results have 2**variables entries; entry m is the subset of the
    variables whose bits are set in m (0 for those larger than ``max_size``), so that
    I(S;Y) = H(S) + H(Y) - H(S,Y).
    """
    columns, x_states = _columns(x)
    targets, y_states = _columns(y)
    _same_length(columns, targets)
    if len(columns) > 20:
        raise ValueError(f"2**{len(columns)} subsets are too many to enumerate")
    samples = columns.shape[1]
    sums = _table(samples)
    label = targets[0] if len(targets) == 1 else _joint_labels(targets, y_states)
    states = max(x_states, int(label.max()) + 1)
    largest = len(columns) if max_size is None else max_size
    own = np.zeros(1 << len(columns))
    joint = np.zeros(1 << len(columns))
    own[0] = 0.0
    joint[0] = _joint_entropy(label[None, :], states, sums)
    _enumerate(columns, label, states, largest, sums, own, joint)
    return own, joint, float(joint[0])


def _weighted_entropy(label: Labels, weights: Weights) -> float:
    share = np.bincount(label, weights=weights) / weights.sum()
    share = share[share > 0]
    return float(-(share * np.log2(share)).sum())


def _columns(x: ArrayLike) -> tuple[Labels, int]:
    """Variables as contiguous rows of small labels, and one more than the largest label."""
    table = np.asarray(x)
    if not np.issubdtype(table.dtype, np.integer):
        raise ValueError(
            f"labels must be integers, not {table.dtype}: rounding would merge states "
            "(see softsense.information.labels_of)"
        )
    if table.ndim not in (1, 2) or table.size == 0:
        raise ValueError(f"labels of shape {table.shape}; (samples,) or (samples, variables)")
    rows = np.ascontiguousarray(table.reshape(1, -1) if table.ndim == 1 else table.T)
    if rows.dtype == np.int32:
        low, high = _bounds(rows)
    else:
        low, high = int(rows.min()), int(rows.max())
    if low < 0 or high >= DIRECT_LABELS:
        rows = np.stack([np.unique(row, return_inverse=True)[1] for row in rows])
        high = int(rows.max())
    return rows.astype(np.int32, copy=False), high + 1


@njit(cache=True, nogil=True)
def _bounds(rows):  # type: ignore[no-untyped-def]
    """Smallest and largest label: numpy's own two calls cost as much as the counting."""
    flat = rows.reshape(-1)
    low, high = flat[0], flat[0]
    for i in range(len(flat)):  # vectorised so, and not with min() and max() of each row
        if flat[i] < low:
            low = flat[i]
        if flat[i] > high:
            high = flat[i]
    return low, high


def _same_length(first: Labels, second: Labels) -> None:
    if first.shape[1] != second.shape[1]:
        raise ValueError(f"{first.shape[1]} and {second.shape[1]} samples")


def _in(unit: Unit, bits: float) -> float:
    if unit not in ("bits", "nats"):
        raise ValueError(f"unit {unit!r}: bits or nats")
    return float(bits) if unit == "bits" else float(bits) * float(np.log(2.0))


@lru_cache(maxsize=8)
def _table(samples: int) -> NDArray[np.float64]:
    """c log2 c for c = 0 … samples."""
    counts = np.arange(samples + 1, dtype=np.float64)
    return counts * np.log2(np.maximum(counts, 1.0))


@njit(cache=True, nogil=True)
def _split(  # type: ignore[no-untyped-def]
    order, starts, groups, codes, counts, places, new_order, new_starts
):  # pragma: no cover - compiled
    """Split ``groups`` groups by ``codes``; keep groups of two and more. Returns their number.

    ``order``: sample numbers, group by group; ``starts``: where groups begin, and the end.
    ``counts`` is zero before and after.
    """
    made = 0
    end = 0
    for group in range(groups):
        low, high = starts[group], starts[group + 1]
        for place in range(low, high):
            counts[codes[order[place]]] += 1
        for place in range(low, high):
            sample = order[place]
            code = codes[sample]
            count = counts[code]
            if count > 1:  # first sight of a state that others share: reserve its room
                new_starts[made] = end
                made += 1
                places[code] = end
                end += count
                counts[code] = -1
            elif count == 1:
                counts[code] = 0
                continue
            if counts[code] == -1:
                new_order[places[code]] = sample
                places[code] += 1
        for place in range(low, high):
            counts[codes[order[place]]] = 0
    new_starts[made] = end
    return made


@njit(cache=True, nogil=True)
def _sum_within(order, starts, groups, codes, counts, sums):  # type: ignore[no-untyped-def]
    """sum c log2 c over the states that ``codes`` makes within the groups."""  # pragma: no cover
    total = 0.0
    for group in range(groups):
        low, high = starts[group], starts[group + 1]
        if high - low == 2:  # most groups of a fine partition are pairs
            if codes[order[low]] == codes[order[low + 1]]:
                total += 2.0
            continue
        for place in range(low, high):
            counts[codes[order[place]]] += 1
        for place in range(low, high):
            code = codes[order[place]]
            total += sums[counts[code]]
            counts[code] = 0
    return total


@njit(cache=True, nogil=True)
def _sum_groups(starts, groups, sums):  # type: ignore[no-untyped-def]
    """sum c log2 c over the groups."""  # pragma: no cover
    total = 0.0
    for group in range(groups):
        total += sums[starts[group + 1] - starts[group]]
    return total


# The states' own sums may be taken in any order, and so several at once.
@njit(cache=True, nogil=True, fastmath={"reassoc"})
def _sum_states(x_counts, y_counts, sums):  # type: ignore[no-untyped-def]
    """sum c log2 c over the states of two variables."""  # pragma: no cover
    total = 0.0
    for code in range(len(x_counts)):
        total += sums[x_counts[code]] + sums[y_counts[code]]
    return total


@njit(cache=True, nogil=True)
def _pair(x, y, states, sums):  # type: ignore[no-untyped-def]
    """I(X;Y) in bits of one variable each."""  # pragma: no cover
    samples = len(x)
    x_counts = np.zeros(states, dtype=np.int32)
    y_counts = np.zeros(states, dtype=np.int32)
    for i in range(samples):
        x_counts[x[i]] += 1
        y_counts[y[i]] += 1
    total = -_sum_states(x_counts, y_counts, sums)
    ends = np.empty(states, dtype=np.int32)
    end = 0
    for code in range(states):
        ends[code] = end
        end += x_counts[code]
        y_counts[code] = 0
    # y itself, group after group of equal x: the second pass then reads memory in order
    ordered = np.empty(samples, dtype=np.int32)
    for i in range(samples):
        ordered[ends[x[i]]] = y[i]
        ends[x[i]] += 1
    low = 0
    for high in ends:
        if high - low == 2:
            if ordered[low] == ordered[low + 1]:
                total += 2.0
        elif high - low > 2:
            for place in range(low, high):
                y_counts[ordered[place]] += 1
            for place in range(low, high):
                code = ordered[place]
                total += sums[y_counts[code]]
                y_counts[code] = 0
        low = high
    return np.log2(float(samples)) + total / samples


@njit(cache=True, nogil=True)
def _set_and_label(columns, y, states, sums):  # type: ignore[no-untyped-def]
    """I(columns;Y) in bits: H(columns) and H(columns,Y) from one refinement."""  # pragma: no cover
    samples = len(y)
    counts = np.zeros(states, dtype=np.int32)
    places = np.zeros(states, dtype=np.int32)
    starts = np.empty(samples // 2 + 2, dtype=np.int32)
    other_starts = np.empty(samples // 2 + 2, dtype=np.int32)
    total = 0.0
    for i in range(samples):
        counts[y[i]] += 1
    for code in range(states):
        total -= sums[counts[code]]
        counts[code] = 0
    # The first variable by counting sort: cheaper than splitting one group of everything.
    first = columns[0]
    for i in range(samples):
        counts[first[i]] += 1
    groups = 0
    end = 0
    for code in range(states):
        if counts[code] > 1:
            places[code] = end
            starts[groups] = end
            groups += 1
            end += counts[code]
    starts[groups] = end
    order = np.empty(end, dtype=np.int32)
    other = np.empty(end, dtype=np.int32)
    for i in range(samples):
        code = first[i]
        if counts[code] > 1:
            order[places[code]] = i
            places[code] += 1
    for code in range(states):
        counts[code] = 0
    for variable in range(1, len(columns)):
        groups = _split(
            order, starts, groups, columns[variable], counts, places, other, other_starts
        )
        order, other = other, order
        starts, other_starts = other_starts, starts
    total += _sum_within(order, starts, groups, y, counts, sums)
    total -= _sum_groups(starts, groups, sums)
    return np.log2(float(samples)) + total / samples


@njit(cache=True, nogil=True)
def _joint_entropy(columns, states, sums):  # type: ignore[no-untyped-def]
    """H of all ``columns`` (variables, samples) together, in bits."""  # pragma: no cover
    samples = columns.shape[1]
    counts = np.zeros(states, dtype=np.int32)
    places = np.empty(states, dtype=np.int32)
    order = np.arange(samples).astype(np.int32)
    other = np.empty(samples, dtype=np.int32)
    starts = np.empty(samples // 2 + 3, dtype=np.int32)
    other_starts = np.empty(samples // 2 + 3, dtype=np.int32)
    starts[0] = 0
    starts[1] = samples
    groups = 1
    for variable in range(len(columns) - 1):
        groups = _split(
            order, starts, groups, columns[variable], counts, places, other, other_starts
        )
        order, other = other, order
        starts, other_starts = other_starts, starts
    total = _sum_within(order, starts, groups, columns[-1], counts, sums)
    return np.log2(float(samples)) - total / samples


@njit(cache=True, nogil=True)
def _enumerate(  # type: ignore[no-untyped-def]
    columns, target, states, largest, sums, own, joint
):  # pragma: no cover - compiled
    """Fill ``own`` and ``joint`` for all subsets, each split once from its parent's groups.

    The parent of a subset lacks its highest variable; a stack holds one partition per size.
    """
    variables, samples = columns.shape
    counts = np.zeros(states, dtype=np.int32)
    places = np.empty(states, dtype=np.int32)
    orders = np.empty((variables + 1, samples), dtype=np.int32)
    starts = np.empty((variables + 1, samples // 2 + 3), dtype=np.int32)
    groups = np.zeros(variables + 1, dtype=np.int64)
    chosen = np.zeros(variables + 1, dtype=np.int64)
    for i in range(samples):
        orders[0, i] = i
    starts[0, 0] = 0
    starts[0, 1] = samples
    groups[0] = 1
    whole = np.log2(float(samples))
    depth = 1
    chosen[1] = 0
    mask = 0
    while depth > 0:
        variable = chosen[depth]
        if variable >= variables or depth > largest:
            depth -= 1
            if depth > 0:
                mask &= ~(1 << chosen[depth])
                chosen[depth] += 1
            continue
        groups[depth] = _split(
            orders[depth - 1],
            starts[depth - 1],
            groups[depth - 1],
            columns[variable],
            counts,
            places,
            orders[depth],
            starts[depth],
        )
        mask |= 1 << variable
        own[mask] = whole - _sum_groups(starts[depth], groups[depth], sums) / samples
        joint[mask] = (
            whole
            - _sum_within(orders[depth], starts[depth], groups[depth], target, counts, sums)
            / samples
        )
        depth += 1
        if depth <= variables:
            chosen[depth] = variable + 1
        else:
            depth -= 1
            mask &= ~(1 << chosen[depth])
            chosen[depth] += 1


def _joint_labels(columns: Labels, states: int) -> Labels:
    """Progressive relabelling: the label of a set is that of its parent and one more label."""
    label = np.zeros(columns.shape[1], dtype=np.int64)
    for row in columns:
        label = np.unique(label * states + row, return_inverse=True)[1]
    return label.astype(np.int32)
