"""ADC non-linearity: a code stands for another voltage than it says."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, partial

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from scipy.ndimage import gaussian_filter1d

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import compiled

# Orders of a polynomial over the span of a signal.
ORDERS = (4, 7)
# What other effects move goes beyond the span: the polynomial is one of so many spans. Its line
# belongs to it, since over another span the same curve has another one.
SPANS = 1.4
# Taps of a converter's string of resistors, over the span of a signal.
RUNGS = 12
# The same for what is off in every step of a coarse converter.
TEETH = 96
# Bits that weigh enough to be seen when they are wrong, beside a straight line; and without it also
# smaller ones, which make up a line together.
BITS = range(4, 12)
FINE_BITS = range(2, 12)
# Over so many codes (rms) noise spreads where a bit goes on, or the next coarse step begins.
SPREADS = (0.6, 2.5, 4.5)
# The part of a span at its ends that is rarely met, and how far a converter may be off, of a span
# or of all its range, by steps and by bits.
MARGIN = 0.05
LARGEST = 0.15
LARGEST_OF_ALL = 0.025
FARTHEST = 0.3
# Codes of the coarse steps of a converter of two stages, and how many of their edges must be met.
COARSE = (64.0, 128.0, 256.0)
STEPPED = 3
# What is read where a code is lost, and the noise before the converter, in codes.
READ = ("below", "nearest", "above", "oftener")
NOISES = (0.5, 1.0, 2.0, 4.0, 8.0)
# The one of both ends that is read so much oftener than the other draws in what is between.
DRAWS = 0.7
# Beyond so many times the noise there is none.
REACH = 4.0


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + lsb A shape(u), or codes that never occur."""
    if form == "missing_codes":
        code = np.floor(u / context.lsb + 0.5)
        # The code in the middle of each stretch is lost to the one below it.
        every = np.maximum(np.round(values["every"]), 2.0)
        lost = np.mod(code, every) == np.floor(every / 2.0)
        return np.where(lost, u - context.lsb, u), {}
    inside = np.clip(u, 0.0, 1.0)
    shape = 4.0 * inside * (1.0 - inside) if form == "bow" else np.sin(2.0 * np.pi * inside)
    return u + context.lsb * values["inl_lsb"] * shape, {}


def explain(nominal: Nominal) -> list[Candidate]:
    """A bow and an S over the converter's range, alone and together; a polynomial over what is met
    of it; uneven taps, steps, bits."""

    # One candidate may be asked for alone, and several share these.
    @cache
    def waves() -> Floats:
        q = np.pi * nominal.u / nominal.full_scale
        return np.stack([np.sin(k * q) for k in range(1, 7)], axis=1) * 10.0

    @cache
    def polynomial() -> Floats:
        share = np.clip((2.0 * nominal.share - 1.0) / SPANS, -1.0, 1.0)
        return np.asarray(chebvander(share, max(ORDERS)), dtype=np.float64) * nominal.span

    def some(first: int, last: int) -> Floats:
        return waves()[:, first:last]

    def up_to(order: int) -> Floats:
        return polynomial()[:, 1 : order + 1]

    largest = max(LARGEST, LARGEST_OF_ALL * nominal.full_scale / nominal.span)
    return [
        Candidate(partial(some, 0, 1), {}, "bow"),
        Candidate(partial(some, 1, 2), {}, "s"),
        Candidate(partial(some, 0, 3), {}, "bow"),
        Candidate(waves, {}, "wave", pliable=True),
        *(Candidate(partial(up_to, order), {}, "polynomial", pliable=True) for order in ORDERS),
        *(
            Candidate(
                partial(_ladder, nominal, rungs),
                {},
                form,
                curved=True,
                pliable=True,
                largest=largest,
                levels=_levels,
            )
            for form, rungs in (("ladder", RUNGS), ("table", TEETH))
        ),
        *(candidate for noise in SPREADS for candidate in _edged(nominal, noise)),
        *_lost(nominal),
    ]


def read_instead(lost: Floats, read: str, noise: float) -> tuple[Floats, Floats, Floats]:
    """Codes, what is read there instead of them on average, less the code, and its variance.

    ``lost`` (stretches, 3): the codes below and above those that never occur, of which ``read``
    ("below", "nearest", "above", or what is read "oftener") is taken, and how often the one above
    is read, of both. ``noise``: rms in codes before the converter.
    """
    room = np.ceil(REACH * noise) + 1.0
    codes = np.arange(lost[0, 0] - room, lost[-1, 1] + room + 1.0)
    stretch = np.clip(np.searchsorted(lost[:, 0], codes, side="right") - 1, 0, None)
    below, above, upper = lost[stretch].T
    nearest = np.where(codes - below < above - codes, below, above)
    oftener = np.select([upper > DRAWS, upper < 1.0 - DRAWS], [above, below], nearest)
    instead = {"below": below, "above": above, "oftener": oftener}.get(read, nearest)
    given = np.where((below < codes) & (codes < above), instead, codes)
    mean = gaussian_filter1d(given, noise, mode="nearest", truncate=REACH)
    square = gaussian_filter1d(given**2, noise, mode="nearest", truncate=REACH)
    noiseless = gaussian_filter1d(codes, noise, mode="nearest", truncate=REACH)
    return codes, mean - noiseless, square - mean**2


def _lost(nominal: Nominal) -> list[Candidate]:
    """What a converter that never gives some codes reads in their place."""
    if not len(nominal.lost):
        return []

    def instead(read: str, noise: float) -> Floats:
        codes, change, _ = read_instead(nominal.lost, read, noise)
        return np.interp(nominal.u, codes, change, left=0.0, right=0.0)[:, None]

    return [
        Candidate(partial(instead, read, noise), {}, "missing_codes", fixed=True)
        for read in READ
        for noise in NOISES
    ]


def _edged(nominal: Nominal, noise: float) -> list[Candidate]:
    """Bits of the wrong weight, and coarse steps, where noise (rms, codes) spreads their edges."""

    def binary(known: Iterable[int], first: int) -> Floats:
        straight = _straight(nominal)[:, first:]
        return np.concatenate([_bits(nominal, known, noise), straight], axis=1)

    bits = [
        # Bits make up each other, so that only their sum is known.
        Candidate(partial(binary, known, first), {}, "bits", farthest=FARTHEST * nominal.span)
        for known, first in ((BITS, 0), (FINE_BITS, 1))
    ]
    return bits + _subranging(nominal, noise)


def _bits(nominal: Nominal, known: Iterable[int], noise: float) -> Floats:
    """(samples, bits) which of its capacitors a converter had switched on: of one that weighs
    wrong, or is stuck, all codes with its bit are off. Of those that the reference moves."""
    bits = np.array(known)
    low, high = nominal.low + MARGIN * nominal.span, nominal.low + (1 - MARGIN) * nominal.span
    moved = int(low) >> bits != int(high) >> bits
    codes = _codes(nominal)
    on = codes.astype(np.int64)[:, None] >> bits & 1
    return _spread(nominal, codes, on * moved * nominal.span, noise)


def _codes(nominal: Nominal) -> Floats:
    """(codes,) all that the signal meets."""
    codes: Floats = np.arange(max(nominal.u.min(), 0.0) // 1, max(nominal.u.max(), 0.0) + 2.0)
    return codes


def _spread(nominal: Nominal, codes: Floats, made: Floats, noise: float) -> Floats:
    """(samples, p) of what is ``made`` (codes, p) where noise (rms, codes) is on the signal."""
    mean = gaussian_filter1d(made, noise, axis=0, mode="nearest")
    here: Floats = _between(np.ascontiguousarray(mean.T), nominal.u - codes[0])
    return here.T


@compiled
def _between(rows: Floats, at: Floats) -> Floats:
    """(n, samples) the ``rows`` (n, places) at these places (samples,), straight in between."""
    result = np.empty((len(rows), len(at)))
    for k in range(len(at)):
        over = max(at[k], 0.0)
        below = min(int(over), rows.shape[1] - 2)
        for row in range(len(rows)):
            first, second = rows[row, below], rows[row, below + 1]
            result[row, k] = first + (over - below) * (second - first)
    return result


def _subranging(nominal: Nominal, noise: float) -> list[Candidate]:
    """Of a converter that finds a coarse code and then what is left of it, which is amplified
    wrongly: a slope in each coarse step that the reference moves in, where that is some."""

    def sloping(step: float, first: int, last: int) -> Floats:
        codes = _codes(nominal)
        coarse = np.floor(codes / step)
        rest = codes - (coarse + 0.5) * step
        slopes = np.where(coarse[:, None] == np.arange(first, last + 1), rest[:, None], 0.0)
        spread = _spread(nominal, codes, slopes, noise)
        return np.concatenate([spread, _straight(nominal)], axis=1)

    result = []
    for step in COARSE:
        first, last = int(nominal.low // step), int((nominal.low + nominal.span) // step)
        if last - first >= STEPPED:
            made = partial(sloping, step, first, last)
            result.append(Candidate(made, {"step": step}, "subranging", pliable=True))
    return result


def _straight(nominal: Nominal) -> Floats:
    """(samples, 2) the line that a calibration takes such an error against."""
    return np.stack([nominal.u - nominal.rest, np.full(len(nominal.u), nominal.span)], axis=1)


def _ladder(nominal: Nominal, rungs: int) -> Floats:
    """(samples, rungs) what the middle one of so many uneven resistors is too large by, and what
    each is more than the one below it: straight in between.

    So one that a fit has not met is as its neighbour, where it would else be right.
    """
    at = np.clip(nominal.share, 0.0, 1.0) * (rungs - 1)
    result: Floats = _rungs(at, rungs, nominal.span)
    return result.T


@compiled
def _rungs(at: Floats, rungs: int, span: float) -> Floats:
    """(rungs, samples) of ``_ladder`` for a signal ``at`` so many rungs, over a ``span``."""
    result = np.empty((rungs, len(at)))
    result[0] = span
    for rung in range(rungs - 1):
        below = 1.0 if rung < (rungs - 1) // 2 else 0.0
        for k in range(len(at)):
            result[rung + 1, k] = (min(max(at[k] - rung, 0.0), 1.0) - below) * span
    return result


def _levels(weights: Floats) -> Floats:
    """(rungs,) what each of them is too large by."""
    levels = np.concatenate([[0.0], np.cumsum(weights[1:])])
    above: Floats = levels - levels[(len(weights) - 1) // 2] + weights[0]
    return above


EFFECT = Effect(
    name="adc_nonlinearity",
    stage="electrical",
    mechanism="integral or differential non-linearity of the converter",
    equation="bow: u + lsb A 4u(1 - u); s_shape: u + lsb A sin(2 pi u); missing_codes: one code "
    "of every n is read as the code below",
    source="IEEE Std 1241 defines INL, DNL and missing codes",
    fingerprint="a function of the code only",
    parameters=(
        Parameter("inl_lsb", "LSB", -40.0, 40.0, 4.0, "largest deviation (bow, s_shape)"),
        Parameter("every", "codes", 2.0, 64.0, 8.0, "missing_codes: distance between lost codes"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("bow", "s_shape", "missing_codes"),
    exact=True,
    memoryless=True,
    bent=True,
)
