"""Rate-independent hysteresis: friction between filler, network and wire."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cache, partial
from math import exp

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import compiled, play

# Stop operators of a Prandtl-Ishlinskii loop: with fewer, the corners of a loop show.
_STOPS = 6


@compiled
def _stops(u: Floats, thresholds: Floats, last: Floats, memory: Floats) -> Floats:
    """Mean of stop operators, of size 1 when all slip. ``thresholds``, ``memory``: (c, stops).

    A stop with threshold r follows the input's steps and is held within -r … r.
    """
    samples, channels = u.shape
    stops = thresholds.shape[1]
    output = np.empty((samples, channels))
    for c in range(channels):
        total = thresholds[c].sum()
        before = last[c]
        for k in range(samples):
            step = u[k, c] - before
            before = u[k, c]
            held = 0.0
            for j in range(stops):
                r = thresholds[c, j]
                memory[c, j] = min(max(memory[c, j] + step, -r), r)
                held += memory[c, j]
            output[k, c] = held / total
        last[c] = before
    return output


@compiled
def _bouc_wen(u: Floats, threshold: Floats, beta: float, last: Floats, memory: Floats) -> Floats:
    """dz = (du - beta |du| z - (1 - beta) du |z|) / threshold, solved exactly for each step."""
    samples, channels = u.shape
    output = np.empty((samples, channels))
    for c in range(channels):
        z = memory[c, 0]
        before = last[c]
        for k in range(samples):
            way = u[k, c] - before
            before = u[k, c]
            sign = 1.0 if way > 0.0 else -1.0
            # seen along the way: w = sign z rises from w0 towards 1
            w, left = sign * z, abs(way) / threshold[c]
            back = 2.0 * beta - 1.0
            if w < 0.0 and left > 0.0:  # dw = 1 - back w until w = 0
                need = -w if back == 0.0 else np.log(1.0 - back * w) / back
                if left < need:
                    w = (
                        w + left
                        if back == 0.0
                        else (1.0 - (1.0 - back * w) * exp(-back * left)) / back
                    )
                    left = 0.0
                else:
                    w, left = 0.0, left - need
            if left > 0.0:  # dw = 1 - w
                w = 1.0 - (1.0 - w) * exp(-left)
            z = sign * w
            output[k, c] = z
        memory[c, 0] = z
        last[c] = before
    return output


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + amplitude z, with z within -1 … 1 (see ``EFFECT.equation``)."""
    channels = u.shape[1]
    threshold = np.maximum(values["threshold"], 1e-9)
    stops = _STOPS if form == "prandtl_ishlinskii" else 1
    if state is None:
        last, memory = u[0].copy(), np.zeros((channels, stops))
    else:
        last, memory = state["last"].copy(), state["memory"].copy()
    if form == "prandtl_ishlinskii":
        ladder = threshold[:, None] * (np.arange(1, stops + 1) / stops)
        z = _stops(u, ladder, last, memory)
    else:
        z = _bouc_wen(u, threshold, 0.5 if form == "bouc_wen" else 1.0, last, memory)
    return u + values["amplitude"] * z, {"last": last, "memory": memory}


# Widths of plays and ways of Dahl's states, of the range, and how soon branches meet their curve.
LADDERS = {
    "prandtl-ishlinskii": (0.03, 0.08, 0.18, 0.35, 0.6, 0.95),
    "short": (0.1, 0.25, 0.6),
}
WAYS = np.array([0.03, 0.07, 0.15, 0.3, 0.6])
# Widths of relays; and of plays that begin at rest, as relays of one density everywhere do.
RELAYS = np.array([0.05, 0.12, 0.25, 0.45])
RESTING = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8])
# Widths of few relays, in steps from level to level, and orders of their curves.
FEW_RELAYS = (
    ((1, 2, 4, 8), 3),
    ((1, 2, 4, 8), 5),
    ((1, 2, 3, 4, 6, 8, 11, 16, 22, 30), 1),
    ((1, 2, 3, 5, 8, 12, 18, 26), 3),
)
PULLS = (2.5, 5.0, 10.0, 20.0)
# By how much of themselves ways grow for each range that was gone.
HARDENS = (0.004, 0.015)
# Cells along each side of a plane whose density is any, and ways of states that pinch.
CELLS = 8
PINCHED = np.array([0.05, 0.15, 0.4])
# Of the range, around which curves are powers.
MIDDLE = 0.5
# Columns of ``_duhem`` before its curve, and of the curve of ``_preisach``.
_BRANCHES, _CURVE = 4, 3


def _at_rest(first: Floats, widths: Floats) -> Floats:
    """Plays of these ``widths`` that see ``first`` (widths,) and have come from the bottom of their
    plane, whose relays are all off: those below it would switch outside of the range."""
    return np.maximum(first - 0.5 * widths, 0.5 * widths)


def _powers(base: Floats, order: int) -> list[Floats]:
    """(samples, 1) each: powers of ``base`` (samples,), 0 where it begins."""
    return [power - power[0] for power in _ascending((base - MIDDLE)[:, None], order)]


def _ascending(signal: Floats, order: int) -> list[Floats]:
    """Powers 1 … ``order`` of a signal: products, which are far faster than powers."""
    powers = [signal]
    for _ in range(order - 1):
        powers.append(powers[-1] * signal)
    return powers


def _preisach(base: Floats, seen: Floats, widths: Floats, order: int, keep: slice) -> Floats:
    """(kept samples, columns) that a plane of relays of these ``widths`` can make of ``base``
    (samples,) where they have ``seen`` (samples, widths) of it.

    Relays of one width switch where a play of half that width passes their middles, so a plane of
    them is a sum of curves of plays (Krasnosel'skii and Pokrovskii 1989, Systems with Hysteresis):
    polynomials of this ``order``, less what is the same up and down.
    """
    played = play(seen, widths, _at_rest(seen[0], widths))[keep]
    base = base[keep]
    here = _ascending((base - MIDDLE)[:, None], order)
    there = _ascending(played - MIDDLE, order)
    powers = [own - same for own, same in zip(there, here, strict=True)]
    return np.concatenate([*powers, *_powers(base, order)], axis=1)


@compiled
def _last_level(base: Floats, count: float, first: float) -> Floats:
    """(samples,) the level that ``base`` crossed last, of so many in its range; one is ``first``.

    Before it has crossed any, the middle between two."""
    held = np.empty_like(base)
    below = np.floor((base[0] - first) * count)
    level = below + 0.5
    for k in range(len(base)):
        now = np.floor((base[k] - first) * count)
        if now > below:
            level = now
        elif now < below:
            level = now + 1.0
        below = now
        held[k] = first + level / count
    return held


@compiled
def _within(cells: int, above: float, below: float, sign: float, area: Floats) -> None:
    """Add to ``area`` (cells,) of a plane that of the relays which switch on up to ``above`` and
    off down to ``below``, as a share of each cell's, times ``sign``."""
    number = 0
    for row in range(cells):
        on = min(max(above * cells - row, 0.0), 1.0)
        for column in range(row + 1):
            off = min(max(below * cells - column, 0.0), 1.0)
            if column < row:
                area[number] += sign * on * (1.0 - off)
            else:
                area[number] += sign * max(on - off, 0.0) ** 2
            number += 1


@compiled
def _plane(base: Floats, cells: int, step: int) -> Floats:
    """(samples, cells (cells + 1) / 2) the share of relays that are on in each cell of a plane, at
    every so many samples of ``base`` (0 … 1), all off before.

    Preisach's operator by the extrema that no later one has wiped out (Everett, Trans. Faraday Soc.
    51, 1955), of a density that is the same within each cell.
    """
    count = cells * (cells + 1) // 2
    output = np.empty(((len(base) + step - 1) // step, count))
    high, low = np.empty(len(base) + 1), np.empty(len(base) + 1)
    settled, pairs, rising, top, last = np.zeros(count), 0, True, 0.0, 0.0
    for k in range(len(base)):
        now = min(max(base[k], 0.0), 1.0)
        before = pairs
        if now > last and not rising:
            high[pairs], low[pairs] = top, last
            pairs, rising = pairs + 1, True
        elif now < last and rising:
            top, rising = last, False
        while rising and pairs and now >= high[pairs - 1]:
            pairs -= 1
        while not rising and pairs and now <= low[pairs - 1]:
            pairs -= 1
            top = high[pairs]
        if pairs != before:
            settled[:] = 0.0
            for j in range(pairs):
                _within(cells, high[j], low[j - 1] if j else 0.0, 1.0, settled)
                _within(cells, high[j], low[j], -1.0, settled)
        last = now
        if k % step == 0:
            row = output[k // step]
            row[:] = settled
            bottom = low[pairs - 1] if pairs else 0.0
            _within(cells, now if rising else top, bottom, 1.0, row)
            if not rising:
                _within(cells, top, now, -1.0, row)
    return output


@compiled
def _along(base: Floats, way: Floats, pull: float) -> Floats:
    """Each column of ``base`` (samples, p) through a low-pass of the first order whose time is the
    ``way`` (samples,) that was gone, with ``pull`` its rate."""
    output = np.empty_like(base)
    output[0] = base[0]
    for k in range(1, len(base)):
        ratio = pull * way[k]
        kept = exp(-ratio)
        share = (1.0 - kept) / ratio if ratio > 1e-9 else 1.0
        for c in range(base.shape[1]):
            fresh = (1.0 - share) * base[k, c] + (share - kept) * base[k - 1, c]
            output[k, c] = kept * output[k - 1, c] + fresh
    return output


def _duhem(base: Floats, pull: float, keep: slice) -> Floats:
    """(kept samples, columns) of dz = pull |dx| (f(x) - z) + g |dx|, f any cubic and z(0) any.

    Coleman and Hodgdon, Int. J. Eng. Sci. 24 (1986): what the branches are drawn to is a curve.
    """
    way = np.abs(np.diff(base, prepend=base[0]))
    around = base - MIDDLE
    powers = np.stack([around, around * around, around * around * around], axis=1)
    begun = -np.expm1(-pull * np.cumsum(way))
    slow = _along(powers, way, pull) - powers
    return np.concatenate([slow, begun[:, None], powers - powers[0]], axis=1)[keep]


def _hardening(base: Floats, hardens: float, keep: slice) -> Floats:
    """(kept samples, columns) Dahl's states whose ways grow with the way that was gone (Valanis,
    Arch. Mech. 23, 1971: the intrinsic time of a material that hardens is a logarithm of it)."""
    way = np.abs(np.diff(base, prepend=base[0]))
    intrinsic = way / (1.0 + hardens * np.cumsum(way))
    made = [base - _along(base[:, None], intrinsic, 1.0 / far)[:, 0] for far in WAYS.tolist()]
    return np.stack(made, axis=1)[keep]


def _pinched(base: Floats, keep: slice) -> Floats:
    """(kept samples, columns) of Dahl's states, their powers, and these along ``base`` (samples,).

    Loops that are pinched, or wider at one end (Baber and Noori, J. Eng. Mech. 111, 1985), are
    curves of such states.
    """
    signal = np.repeat(base[:, None], len(PINCHED), axis=1)
    state = _bouc_wen(signal, PINCHED, 1.0, signal[0].copy(), np.zeros((len(PINCHED), 1)))[keep]
    base = base[keep]
    here = (base - MIDDLE)[:, None]
    square = state * state
    parts = [state, state * here, state * here**2, square, square * here, square * state]
    return np.concatenate([*parts, *_powers(base, _CURVE)], axis=1)


def _sharp(base: Floats, form: str, keep: slice) -> Floats:
    """(kept samples, columns) plays, less what they see, or Dahl's states."""
    made: Floats
    if form in LADDERS:
        signal = np.repeat(base[:, None], len(LADDERS[form]), axis=1)
        made = play(signal, np.array(LADDERS[form]), signal[0].copy()) - signal
    else:
        signal = np.repeat(base[:, None], len(WAYS), axis=1)
        made = _bouc_wen(signal, WAYS, 1.0, signal[0].copy(), np.zeros((len(WAYS), 1)))
    return made[keep]


def _begun(base: Floats, keep: slice) -> Floats:
    """(kept samples, columns) plays that begin at rest, less what they see."""
    signal = np.repeat(base[:, None], len(RESTING), axis=1)
    made: Floats = play(signal, RESTING, _at_rest(signal[0], RESTING)) - signal
    return made[keep]


def _any_relays(base: Floats, keep: slice) -> Floats:
    """(kept samples, columns) ``_preisach`` of relays of all widths."""
    return _preisach(base, np.repeat(base[:, None], len(RELAYS), axis=1), RELAYS, _CURVE, keep)


def _any_density(base: Floats, keep: slice) -> Floats:
    """(kept samples, columns) a plane of relays whose density is any, and a curve."""
    cells = _plane(base, CELLS, keep.step or 1)
    return np.concatenate([cells, *_powers(base[keep], _CURVE)], axis=1)


def explain(nominal: Nominal) -> list[Candidate]:
    """Ladders of plays and of Dahl's states, of signal, strain or both; planes of relays;
    branches that are drawn to a curve; loops that are pinched, or that harden."""
    bases = (nominal.share, nominal.strain)

    # One candidate may be asked for alone, and several share these; all channels see one strain.
    @cache
    def spanned(base: int, made: Callable[..., Floats], *given: Hashable) -> Floats:
        def make() -> Floats:
            # No view of all samples is held.
            return np.ascontiguousarray(made(bases[base], *given, nominal.keep))

        name = made.__name__, *given
        return (nominal.once_for_all(name, make) if base else make()) * nominal.span

    def sharp(form: str, base: int) -> Floats:
        return spanned(base, _sharp, form)

    def begun(base: int) -> Floats:
        return spanned(base, _begun)

    def relays(base: int) -> Floats:
        return spanned(base, _any_relays)

    def drawn(base: int, pull: float) -> Floats:
        return spanned(base, _duhem, pull)

    def hardening(base: int, hardens: float) -> Floats:
        return spanned(base, _hardening, hardens)

    def any_density() -> Floats:
        return spanned(1, _any_density)

    def pinched() -> Floats:
        return spanned(1, _pinched)

    def beside(*parts: Callable[[], Floats]) -> Callable[[], Floats]:
        return lambda: np.concatenate([part() for part in parts], axis=1)

    result = []
    for form in (*LADDERS, "dahl"):
        name = "prandtl-ishlinskii" if form == "short" else form
        two: list[Callable[[], Floats]] = [partial(sharp, form, base) for base in (0, 1)]
        result += [Candidate(made, {}, name) for made in [*two, beside(*two)]]
    for base in (0, 1):
        result.append(Candidate(partial(begun, base), {}, "prandtl-ishlinskii"))
        result.append(Candidate(partial(relays, base), {}, "preisach", curved=True))
        for pull in PULLS:
            branches = partial(drawn, base, pull)
            fewer = partial(_first, branches, _BRANCHES)
            result.append(Candidate(fewer, {"pull": pull}, "duhem"))
            result.append(Candidate(branches, {"pull": pull}, "duhem", curved=True))
        for hardens in HARDENS:
            made = partial(hardening, base, hardens)
            result.append(Candidate(made, {"hardens": hardens}, "endochronic"))
        slipped = partial(sharp, "dahl", base)
        mixed = beside(partial(sharp, "prandtl-ishlinskii", base), slipped)
        result.append(Candidate(mixed, {}, "prandtl-ishlinskii and dahl"))
        # What is the same up and down a simulator may have been calibrated on.
        curve = partial(_last, partial(relays, base), _CURVE)
        for form, part in (("dahl", slipped), ("prandtl-ishlinskii and dahl", mixed)):
            result.append(Candidate(beside(part, curve), {}, form, curved=True))
    for form, part in (("preisach", any_density), ("pinched", pinched)):
        result.append(Candidate(part, {}, form, curved=True, pliable=True))
    return result + _few_relays(nominal)


def _few_relays(nominal: Nominal) -> list[Candidate]:
    """Planes of relays at so few levels that their steps are seen: what they see is the level that
    was crossed last. Steps upwards or downwards, which lie in between."""
    count, first, base = nominal.levels
    if not count:
        return []
    result = []
    for level in (first, first + 0.5 / count):
        crossed = _last_level(base, count, level)

        def few(steps: tuple[int, ...], order: int, crossed: Floats = crossed) -> Floats:
            widths = (np.array([step for step in steps if step < count]) - 0.5) / count
            seen = np.repeat(crossed[:, None], len(widths), axis=1)
            made = _preisach(base, seen, widths, order, nominal.keep) * nominal.span
            return np.asarray(made)

        for steps, order in FEW_RELAYS:
            made = partial(few, steps, order)
            result.append(Candidate(made, {"levels": count}, "preisach", curved=True))
    return result


def _first(made: Callable[[], Floats], count: int) -> Floats:
    return made()[:, :count]


def _last(made: Callable[[], Floats], count: int) -> Floats:
    return made()[:, -count:]


EFFECT = Effect(
    name="hysteresis",
    stage="material",
    mechanism="friction in the network: loading and unloading run on different branches",
    equation="u + A z; prandtl_ishlinskii: z = mean of 6 stop operators with thresholds r/6 … r; "
    "bouc_wen: dz = (du - |du| z / 2 - du |z| / 2) / r; dahl: dz = (du - |du| z) / r",
    source="Prandtl-Ishlinskii: Visintin, Differential Models of Hysteresis (1994); "
    "Preisach, Z. Phys. 94 (1935); "
    "Bouc-Wen: Wen, J. Eng. Mech. Div. 102 (1976); Dahl, AIAA J. 14 (1976); "
    "endochronic: Valanis, Arch. Mech. 23 (1971)",
    fingerprint="loading differs from unloading, loop area independent of rate, constant in "
    "holds, minor loops close",
    parameters=(
        Parameter("amplitude", "share of span", 0.005, 0.25, 0.05, "half the loop's height"),
        Parameter("threshold", "share of span", 0.02, 0.6, 0.2, "way after a reversal to slip"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("prandtl_ishlinskii", "bouc_wen", "dahl"),
    lasting=True,
)
