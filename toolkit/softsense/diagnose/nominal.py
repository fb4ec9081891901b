"""What the simulator says without its noise, and how noisy a recording is."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly

from softsense.diagnose.walk import without_slow
from softsense.effects import Curve, Nominal, Reference, along, by_channel
from softsense.effects.operators import compiled, first_order_hold, low_pass, play
from softsense.recording import Recording

Floats = NDArray[np.float64]
KNOTS = 16
# What of the history of the strain shows in a sensor: how fast it relaxes, how fast what a rate
# breaks comes back, and the widths of its loops.
RELAXING_S = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
BROKEN_S = (0.1, 0.5, 2.0)
WIDTHS = np.array([0.03, 0.06, 0.1, 0.18, 0.3, 0.45, 0.6, 0.9])
# As many of each as the processor takes at once, and none more than the first: the rest have no
# weight.
SLOW, LOOPS, FAST = 8, 8, 4
# Weights of averages over two thirds of a second and less; what each keeps of white noise, and what
# is left beside it.
AVERAGES = [np.hanning(n + 2)[1:-1] / np.hanning(n + 2).sum() for n in (13, 9, 7, 5, 3)]
KEPT = [float((average**2).sum()) for average in AVERAGES]
BESIDE = [1.0 - 2.0 * float(a.max()) + kept for a, kept in zip(AVERAGES, KEPT, strict=True)]
# The longest one is usual; a shorter one must be better by so much.
KEPT_USUALLY = KEPT[0]
BETTER = 0.97
# And what it keeps besides must be in the real recording to this share, or it is only noise.
SHARED = 0.8
# Over so many samples a seldom fast move shows, by so many times the noise.
AT_ONCE = np.full(5, 1.0 / 5.0)
FAR = 9.0
# Where the strain is not as recorded, so that nothing tells it, any move is there that has so many
# times the noise in both recordings, or in one alone, where its own noise is, too.
ANY, ANY_ALONE = 1.0, 2.0
# No more than this share of its noise is taken to be in such moves.
MOST_KEPT = 0.9
# Of so many strains what all channels say of them is kept, where few samples are asked for.
STRAINS_KEPT = 256
# Splines of a static curve, how many points of it are kept, and how flat it may be of its mean.
CURVE_KNOTS = 6
CURVE_POINTS = 41
FLATTEST = 0.15
# So many samples at most say how the largest strain grew.
LARGEST = 1000
# What the history of the strain does not tell of a channel in both recordings alike, of its range,
# where that is not what strains it, and how alike at least; and so many seconds around a sample say
# what is slow of that.
OWN_STRAIN = 0.006
OWN_ALIKE = 0.2
SLOWER_S = 5.0
# Samples are taken together that keep so much of the power of the strain's rate.
SLOW_KEPT = 0.9
# Smaller strokes, as shares of the range, are no strokes; larger ones are alike within so much, if
# there are so many each way.
TREMBLE = 0.05
ALIKE = 0.1
LEAST_STROKES = 2
# Codes are lost where so many samples would be expected of them, as many as in the stretches to
# either side, of so many times their width.
EXPECTED = 12.0
AROUND_LOST = 4
# And more than this share of as many codes anywhere: what spikes reach is read seldom.
SELDOM = 0.03
# Their stretches are as wide within so many codes, for noise rounds them.
LOST_ROUNDED = 2
# And by so many times the power of what the simulation never meets.
MORE_LOST = 4.0
# The last code before others that are lost has so many times the samples of each one near it.
PILED = 3.0
# How many levels the range of strain may have; a line among them stands out so much; and the
# samples that are looked at, less their mean around them. Lines of several channels are one within
# so many steps of ``LEVELS``.
LEVELS_STEP = 0.1
LEVELS = np.arange(8.0, 64.0, LEVELS_STEP)
BINS = 4096
LEVELS_RATIO = 15.0
LEVELS_SAMPLES = 16_000
LEVELS_AROUND = np.full(9, 1.0 / 9.0)
LEVELS_ALIKE = 4


@dataclass(frozen=True)
class Motion:
    """The common motion: ``strain`` 0 … 1, and the ``largest`` so far, of its range; and what
    single channels feel ``instead``."""

    strain: Floats
    largest: Floats
    dt_s: float
    start_s: float
    temp_c: Floats | None
    instead: Mapping[int, Motion] = field(default_factory=dict)

    def felt_by(self, channel: int) -> Motion:
        """What strains a channel."""
        return self.instead.get(channel, self)

    @cached_property
    def history(self) -> Floats:
        """(samples, columns) its ``history_basis``, which is asked for again and again."""
        return history_basis(self.strain, self.dt_s)

    @cached_property
    def history_gram(self) -> Floats:
        """(columns, columns) products of the ``history`` with itself."""
        gram: Floats = self.history.T @ self.history
        return gram

    def strokes_alike(self) -> bool:
        """Whether the strain goes to and fro between the same ends, at one rate each way.

        What happens after a smaller stroke, a faster one or a rest is not seen then.
        """
        smooth = np.convolve(self.strain, AVERAGES[0], "valid")
        turns = np.flatnonzero(np.diff(np.sign(np.diff(smooth))) != 0) + 1
        strokes = np.diff(smooth[turns])
        paces = strokes / np.diff(turns)
        for way in (strokes > TREMBLE, strokes < -TREMBLE):
            if way.sum() < LEAST_STROKES or any(
                np.std(one[way]) > ALIKE * np.abs(np.mean(one[way])) for one in (strokes, paces)
            ):
                return False
        return True


def motion_of(
    target: Floats,
    dt_s: float,
    start_s: float,
    temp_c: Floats | None,
    low: float | None = None,
    high: float | None = None,
) -> Motion:
    """The motion ``target`` (samples,), as shares of ``low`` … ``high`` (its own where absent)."""
    low = float(target.min()) if low is None else low
    high = float(target.max()) if high is None else high
    strain = (target - low) / ((high - low) or 1.0)
    return Motion(strain, np.maximum.accumulate(strain), dt_s, start_s, temp_c)


def felt(motion: Motion, codes: Floats, own: Sequence[int], reference: Floats) -> Motion:
    """``motion`` with what the channels feel whose ``own`` way (see ``Reference``) is not 0: their
    noiseless ``codes`` (samples, channels) within the range of those of a ``reference``."""
    low, span = reference.min(axis=0), np.ptp(reference, axis=0)
    instead = {}
    for channel, way in enumerate(own):
        if way:
            share = (codes[:, channel] - low[channel]) / span[channel]
            strain = along(share, way)
            largest = np.maximum.accumulate(strain)
            instead[channel] = replace(motion, strain=strain, largest=largest, instead={})
    return replace(motion, instead=instead) if instead else motion


def own_ways(simulated: Floats, real: Floats, motion: Motion) -> tuple[int, ...]:
    """(channels,) 0 where the history of the recorded strain says the codes of both recordings
    (samples, channels); else which way they go with it, up or down: a sensor elsewhere on what
    moves in more than one way is strained otherwise, in both alike."""
    reach = round(SLOWER_S / motion.dt_s)
    one, other = (without_slow(codes - told(codes, motion), reach) for codes in (simulated, real))
    alike = (one * other).mean(axis=0)
    large = alike > (OWN_STRAIN * np.ptp(simulated, axis=0)) ** 2
    # Loud noise of both goes together by chance.
    own = large & (alike > OWN_ALIKE * one.std(axis=0) * other.std(axis=0))
    ways = np.where(motion.strain @ (simulated - simulated.mean(axis=0)) < 0.0, -1, 1)
    return tuple(np.where(own, ways, 0).tolist())


def slow_over(strain: Floats) -> int:
    """Of how many samples (4, 2 or 1) the mean says nearly all of how ``strain`` changes."""
    change = np.diff(strain)
    for count in (4, 2):
        together = change[: len(change) // count * count].reshape(-1, count).mean(axis=1)
        if count * float((together**2).sum()) > SLOW_KEPT * float((change**2).sum()):
            return count
    return 1


def spline_basis(values: Floats, knots: int = KNOTS) -> Floats:
    """(samples, knots + 2) cubic B-splines over the range of ``values`` (0 … 1, clipped)."""
    inside = np.clip(values, 0.0, 1.0 - 1e-12)
    basis: Floats = BSpline.design_matrix(inside, _knots(knots), 3).toarray()
    return basis


def _knots(knots: int) -> Floats:
    return np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, knots), [1.0] * 3])


def noise_rms(signal: Floats) -> Floats:
    """(channels,) noise of ``signal`` (samples, channels), from third differences.

    Slow parts vanish in differences; the square root of 20 is their gain for white noise. The
    median of windows keeps fast moves out.
    """
    third = np.diff(signal, 3, axis=0) / np.sqrt(20.0)
    windows = np.array_split(third, 64)
    level = np.sqrt(np.median([np.mean(w**2, axis=0) for w in windows], axis=0))
    # Rounding to whole codes alone makes 0.29.
    result: Floats = np.maximum(level, 0.29)
    return result


def history_basis(x: Floats, dt_s: float) -> Floats:
    """(samples, columns) a static curve of the strain, and what mechanisms make of its history."""
    largest = np.maximum.accumulate(x)[:, None]
    return np.concatenate([spline_basis(x), *history_groups(x, dt_s).values(), largest], axis=1)


def history_groups(x: Floats, dt_s: float) -> dict[str, Floats]:
    """(samples, columns) by mechanism: relaxing parts, play, and the filtered rate."""
    relaxing = [
        low_pass(signal[:, None], dt_s, np.array([tau]), None)[0]
        for signal in (x, x**2)
        for tau in RELAXING_S
    ]
    speed = np.abs(np.gradient(x))[:, None] / dt_s
    broken = [low_pass(speed, dt_s, np.array([tau]), None)[0] for tau in BROKEN_S]
    return {
        "relaxation": np.concatenate(relaxing, axis=1),
        "hysteresis": _loops(x),
        "overshoot": np.concatenate(broken, axis=1),
    }


def _loops(x: Floats) -> Floats:
    count = len(WIDTHS)
    loops: Floats = play(np.repeat(x[:, None], count, axis=1), WIDTHS, np.full(count, x[0]))
    return loops


def curves_of(codes: Floats, strain: Floats) -> tuple[Curve, ...]:
    """Of each channel, the curve of ``codes`` (samples, channels) over ``strain``; it rises, or
    falls, all along."""
    basis = spline_basis(strain, CURVE_KNOTS)
    gram = basis.T @ basis
    gram[np.diag_indices_from(gram)] += 1e-9 * len(basis)
    weights = np.linalg.solve(gram, basis.T @ codes)
    all_along = spline_basis(np.linspace(0.0, 1.0, CURVE_POINTS), CURVE_KNOTS) @ weights
    return tuple(_one_way(said) for said in all_along.T)


def _one_way(said: Floats) -> Curve:
    """The curve of what is ``said`` all along the range; as flat as one gets where that turns."""
    sign = 1.0 if said[-1] >= said[0] else -1.0
    steps = np.maximum(sign * np.diff(said), FLATTEST * max(np.ptp(said), 1.0) / CURVE_POINTS)
    return Curve(said[0] + sign * np.concatenate([[0.0], np.cumsum(steps)]))


def history_weights(codes: Floats, motion: Motion) -> Floats:
    """(columns, channels) of ``history_basis`` that say the simulated ``codes``."""
    gram = motion.history_gram
    scale = np.sqrt(np.diag(gram) / len(codes)) + 1e-12
    scaled = gram / scale / scale[:, None]
    scaled[np.diag_indices_from(scaled)] += 1e-9 * len(codes)
    side = motion.history.T @ codes / scale[:, None]
    weights: Floats = np.linalg.solve(scaled, side) / scale[:, None]
    return weights


def told(codes: Floats, motion: Motion) -> Floats:
    """(samples, channels) what the history of the motion tells of ``codes``, and of what single
    channels feel."""
    result: Floats = motion.history @ history_weights(codes, motion)
    for channel, own in motion.instead.items():
        alone = codes[:, [channel]]
        result[:, channel] = (own.history @ history_weights(alone, own))[:, 0]
    return result


def elastic_of(codes: Floats, motion: Motion) -> tuple[Curve, ...]:
    """Of each channel, what its ``codes`` (samples, channels) would be over the strain if that had
    always been there."""
    weights = history_weights(codes, motion)
    strain = np.linspace(0.0, 1.0, CURVE_POINTS)
    relaxing = len(RELAXING_S)
    straight, bent = np.repeat(strain[:, None], relaxing, axis=1), strain[:, None] ** 2
    loops = np.repeat(strain[:, None], len(WIDTHS), axis=1)
    always = np.concatenate(
        [
            spline_basis(strain),
            straight,
            np.repeat(bent, relaxing, axis=1),
            loops,
            np.zeros((CURVE_POINTS, len(BROKEN_S) + 1)),
        ],
        axis=1,
    )
    return tuple(Curve(curve) for curve in (always @ weights).T)


def denoise(
    codes: Floats, motion: Motion, real: Floats | None = None, own: Sequence[int] = ()
) -> tuple[Floats, Floats]:
    """(samples, channels) nominal codes as a smooth function of strain and its history; and
    (channels,) the share of the simulation's noise that is still in them.

    The noise of the simulated codes is left out, which would otherwise look like a lag. ``real``
    (samples, channels): codes that have what is fast of them too, where that is no noise. ``own``:
    see ``own_ways``.
    """
    smooth, kept = told(codes, motion), np.full(codes.shape[1], KEPT_USUALLY)
    # What this cannot say is kept, averaged over two thirds of a second.
    for channel, left in enumerate((codes - smooth).T):
        averaged = best = np.convolve(left, AVERAGES[0], "same")
        strained = bool(own) and own[channel] != 0
        if real is None:
            if strained:
                best = np.where(_any_fast(left - best, left - best, ANY_ALONE), left, best)
            smooth[:, channel] += best
            continue
        least = BETTER * _foretold(left, averaged, AVERAGES[0])
        rest = real[:, channel] - smooth[:, channel]
        for average, keeps in zip(AVERAGES[1:], KEPT[1:], strict=True):
            other = np.convolve(left, average, "same")
            error, more = _foretold(left, other, average), other - averaged
            if error < least and float((rest - averaged) @ more) > SHARED * float(more @ more):
                best, least, kept[channel] = other, error, keeps
        if strained:
            fast = _any_fast(left - best, rest - best, ANY)
            share = kept[channel] + (1.0 - kept[channel]) * float(fast.mean())
            kept[channel] = min(share, MOST_KEPT)
        else:
            fast = _fast(left - best, rest - best)
        smooth[:, channel] += np.where(fast, left, best)
    return smooth, kept


def beside_average(kept: float) -> float:
    """The share of white noise that is left beside an average that has ``kept`` so much of it."""
    return float(np.interp(kept, KEPT, BESIDE))


def _fast(simulated: Floats, real: Floats) -> NDArray[np.bool_]:
    """(samples,) where much more than noise is left of the ``simulated`` codes, and of the ``real``
    ones (both (samples,)) alike: a move that is too fast for any average."""
    there = np.convolve(simulated**2, AT_ONCE, "same")
    both = np.convolve(simulated * real, AT_ONCE, "same")
    return (there > FAR * noise_rms(simulated[:, None]) ** 2) & (both > SHARED * there)


def _any_fast(one: Floats, other: Floats, times: float) -> NDArray[np.bool_]:
    """(samples,) where two recordings (samples,) have more in common than their noise makes."""
    noise = noise_rms(one[:, None]) * noise_rms(other[:, None])
    return np.asarray(np.convolve(one * other, AT_ONCE, "same") > times * noise)


def _foretold(signal: Floats, averaged: Floats, average: Floats) -> float:
    """Mean square error of each sample as those around it foretell it, by their ``average``."""
    beside = 1.0 - float(average[len(average) // 2])
    return float(np.mean((signal - averaged) ** 2)) / beside**2


def reference_of(
    codes: Floats, motion: Motion, lost: Floats, levels: Floats, own: Sequence[int] | None = None
) -> Reference:
    """The yardsticks of a recording with noiseless ``codes``, of which some are ``lost``, and with
    ``levels`` of strain at which it goes in steps; it is the beginning of the ``motion``. ``own``:
    see ``own_ways``."""
    duration_s = len(codes) * motion.dt_s
    low, span = codes.min(axis=0), np.ptp(codes, axis=0)
    strain = motion.strain[: len(codes)]
    curves = curves_of(codes, strain)
    same = len(strain) == len(motion.strain)
    elastic = elastic_of(codes, motion if same else replace(motion, strain=strain))
    rest, start_s = codes[0].copy(), motion.start_s
    largest = motion.largest[: len(codes) : -(-len(codes) // LARGEST)]
    ways = tuple(own or [0] * codes.shape[1])
    return Reference(
        rest, low, span, start_s, duration_s, lost, levels, curves, elastic, largest, ways
    )


def levels_of(beside: Floats, smooth: Floats, motion: Motion) -> Floats:
    """(channels, 3) how many levels there are in the range of what goes in steps, one of them, and
    whether that is the strain (0) or the channel's own signal (1); zeros where nothing does.

    ``beside`` (samples, channels): what a smooth history of the motion does not tell of the
    residual; ``smooth``: noiseless codes. Few relays (Preisach) switch at the same levels again and
    again: a line of its spectrum over strain, or over the signal.
    """
    some = slice(None, None, -(-len(beside) // LEVELS_SAMPLES))
    fast = beside - np.stack([np.convolve(c, LEVELS_AROUND, "same") for c in beside.T], axis=1)
    share = (smooth - smooth.min(axis=0)) / np.maximum(np.ptp(smooth, axis=0), 1.0)
    strain, share, fast = motion.strain[some], share[some], fast[some]
    found = np.zeros((beside.shape[1], 3))
    # A material is mostly the same on all channels, and so is the strain.
    over_strain = _lines(strain, fast)
    at = int(np.argmax(over_strain.sum(axis=1)))
    stands = over_strain[max(at - LEVELS_ALIKE, 0) : at + LEVELS_ALIKE + 1].max(axis=0)
    stepping = stands > LEVELS_RATIO
    if stepping.any():
        found[stepping, :2] = _levels_near(LEVELS[at], strain, fast[:, stepping])
    for channel in range(len(found)):
        own = _lines(share[:, channel], fast[:, channel : channel + 1])
        if own.max() > max(LEVELS_RATIO, stands[channel]):
            count = LEVELS[int(np.argmax(own))]
            near = _levels_near(count, share[:, channel], fast[:, channel : channel + 1])
            found[channel] = (*near, 1.0)
    return found


def _lines(base: Floats, signals: Floats) -> Floats:
    """(levels, n) power of ``signals`` (samples, n) that is periodic over ``base`` so often as
    ``LEVELS`` says, over what is usual; the ends of the range count less.

    By way of bins that are far narrower than such a level.
    """
    bins = np.clip((base * BINS).astype(np.intp), 0, BINS - 1)
    weight = np.sin(np.pi * base) ** 2
    binned = np.stack([np.bincount(bins, weight * one, BINS) for one in signals.T])
    waves = np.fft.rfft(binned, round(BINS / LEVELS_STEP))
    power = np.abs(waves[:, np.rint(LEVELS / LEVELS_STEP).astype(np.intp)].T) ** 2
    return np.asarray(power / np.median(power, axis=0))


def _levels_near(count: float, base: Floats, signals: Floats) -> tuple[float, float]:
    """How many levels there are in the range of ``base`` (samples,), close to ``count``, and one of
    them, by what ``signals`` (samples, n) have in common."""
    near = count + np.arange(-LEVELS_ALIKE, LEVELS_ALIKE, 0.1) * LEVELS_STEP
    weighted = signals * np.sin(np.pi * base)[:, None] ** 2
    lines = np.exp(-2j * np.pi * np.outer(near, base - 0.5)) @ weighted
    at = int(np.argmax((np.abs(lines) ** 2).sum(axis=1)))
    best, line = float(near[at]), lines[at]
    # Steps upwards at x0 are sine waves from there on, beside the straight line that they make;
    # squared, steps downwards are the same.
    turns = (0.5 * np.angle((line**2).sum()) + 0.5 * np.pi) / (-2.0 * np.pi)
    return best, float(0.5 + turns / best)


def lost_codes(real: Recording, sim: Recording) -> Floats:
    """(stretches, 4) channel, the codes next to those that do not occur in ``real``, and what part
    of the samples of these two reads the one above.

    Only of channels where that is more than noise, and more than of ``sim``, where a motion that
    repeats itself meets some codes only, too.
    """
    found = [np.zeros((0, 4))]
    noise = noise_rms(sim.codes.astype(np.float64))
    for channel in range(real.codes.shape[1]):
        lost, power = _never(real.codes[:, channel])
        _, usual = _never(sim.codes[:, channel])
        if power > max(noise[channel] ** 2, MORE_LOST * usual):
            found.append(np.insert(lost, 0, channel, axis=1))
    return np.concatenate(found)


def _never(codes: NDArray[np.int32]) -> tuple[Floats, float]:
    """(stretches, 3) of ``codes`` (samples,) next to those that do not occur, although as many
    as are met around them would be expected there, and how often the one above is met, of both; and
    the mean square of what that makes."""
    there, counts = np.unique(codes, return_counts=True)
    counted = np.concatenate([[0], np.cumsum(counts)])
    below, above = there[:-1], there[1:]
    wide = AROUND_LOST * (above - below)
    here = counted[1:-1]
    before = here - counted[np.searchsorted(there, below - wide)]
    after = counted[np.searchsorted(there, above + wide, side="right")] - here
    expected = (above - below - 1) * np.minimum(before, after) / (wide + 1)
    seldom = SELDOM * (above - below - 1) * len(codes) / np.ptp(codes)
    lost = expected > np.maximum(EXPECTED, seldom)
    power = float((expected * (above - below) ** 2 / 12.0)[lost].sum() / len(codes))
    if not lost.any():
        return np.zeros((0, 3)), power
    # Where few samples are they are as wide as elsewhere.
    width = above - below
    upper = counts[1:] / (counts[1:] + counts[:-1])
    widest = float(width[lost].max())
    near = (width > 1) & (width <= widest + LOST_ROUNDED)
    found = np.stack([below, above, upper], axis=1)[near]
    # Beyond the ends of the motion it goes on as it was, but nothing is read there.
    (low, first, _), (last, high, _) = found[0], found[-1]
    if low == there[0]:
        found = np.concatenate([[[low - (first - low), low, 1.0]], found])
    elif _piled(counts):
        found = np.concatenate([[[there[0] - widest, there[0], 1.0]], found])
    if high == there[-1]:
        found = np.concatenate([found, [[high, high + (high - last), 0.0]]])
    elif _piled(counts[::-1]):
        found = np.concatenate([found, [[there[-1], there[-1] + widest, 0.0]]])
    return found, power


def _piled(counts: NDArray[np.intp]) -> bool:
    """Whether the first of these codes is read for many that are lost beyond it, by ``counts``
    (codes,) of samples."""
    return bool(counts[0] > PILED * counts[1 : 1 + AROUND_LOST].max(initial=0))


@compiled
def _said(
    strain: Floats,
    dt_s: float,
    step: int,
    curves: Floats,
    relaxing: Floats,
    broken: Floats,
    weights: Floats,
) -> Floats:
    """(channels, kept samples) ``history_basis`` of ``strain`` times weights at every ``step``-th
    sample, in one pass.

    ``curves`` (channels, 4, pieces): the static parts as cubics. ``relaxing`` (3, SLOW), ``broken``
    (3, FAST): coefficients of filters. ``weights`` (channels, n): of the columns behind the static
    curve, as many each.
    """
    # Where the compiler knows how many there are, the processor does several at once.
    samples, pieces = len(strain), curves.shape[2]
    slow, square, loops, fast = np.empty(SLOW), np.empty(SLOW), np.empty(LOOPS), np.empty(FAST)
    of_square, of_loop, of_fast = SLOW, 2 * SLOW, 2 * SLOW + LOOPS
    x = before = largest = strain[0]
    speed = abs(strain[min(1, samples - 1)] - x) / dt_s
    slow[:], square[:], loops[:], fast[:] = x, x**2, x, speed
    # Sums side by side: one after the other, each would wait for the one before.
    part, quarter = np.empty(SLOW), SLOW // 4
    said = np.empty((len(weights), (samples - 1) // step + 1))
    for k in range(samples):
        x, speed_before = strain[k], speed
        ahead, behind = min(k + 1, samples - 1), max(k - 1, 0)
        speed = abs(strain[ahead] - strain[behind]) / (max(ahead - behind, 1) * dt_s)
        largest = max(largest, x)
        for f in range(SLOW):
            a, b0, b1 = relaxing[0, f], relaxing[1, f], relaxing[2, f]
            slow[f] = a * slow[f] + (b0 * x + b1 * before)
            square[f] = a * square[f] + (b0 * x**2 + b1 * before**2)
        for f in range(LOOPS):
            half = 0.5 * WIDTHS[f]
            loops[f] = min(max(loops[f], x - half), x + half)
        for f in range(FAST):
            a, b0, b1 = broken[0, f], broken[1, f], broken[2, f]
            fast[f] = a * fast[f] + (b0 * speed + b1 * speed_before)
        before = x
        if k % step == 0:
            inside = min(max(x, 0.0), 1.0 - 1e-12)
            piece = int(inside * pieces)
            past = inside - piece / pieces
            for c in range(len(weights)):
                own, curve = weights[c], curves[c]
                for f in range(SLOW):
                    part[f] = own[f] * slow[f] + own[of_square + f] * square[f]
                for f in range(LOOPS):
                    part[f] += own[of_loop + f] * loops[f]
                for f in range(FAST):
                    part[f] += own[of_fast + f] * fast[f]
                total = own[-1] * largest
                for f in range(quarter):
                    first, second = part[f] + part[f + 2 * quarter], part[f + quarter]
                    total += first + (second + part[f + 3 * quarter])
                static = curve[0, piece]
                for power in range(1, 4):
                    static = static * past + curve[power, piece]
                said[c, k // step] = static + total
    return said


def _filled(rows: Floats, count: int) -> Floats:
    """(count, n) ``rows``, and zeros behind them."""
    return np.concatenate([rows, np.zeros((count - len(rows), rows.shape[1]))])


def nominals(
    codes: Floats, heard: Floats, motion: Motion, bits: int, reference: Reference
) -> list[Nominal]:
    """One ``Nominal`` per channel of noiseless ``codes``, which read ``heard`` in truth."""
    weights = history_weights(codes, motion)
    sizes = len(RELAXING_S), len(RELAXING_S), len(WIDTHS), len(BROKEN_S)
    static, *parts, largest = np.split(weights, np.cumsum([KNOTS + 2, *sizes]))
    full = [
        _filled(part, size) for part, size in zip(parts, (SLOW, SLOW, LOOPS, FAST), strict=True)
    ]
    history = np.concatenate([*full, largest])
    relaxing, broken = (
        _filled(np.array([first_order_hold(motion.dt_s, tau) for tau in taus]), size).T.copy()
        for taus, size in ((RELAXING_S, SLOW), (BROKEN_S, FAST))
    )

    # Cubics of the distance from the knot before; none are between knots that coincide.
    curves = [PPoly.from_spline(BSpline(_knots(KNOTS), one, 3)).c[:, 3:-3] for one in static.T]
    given = np.stack(curves), relaxing, broken, np.ascontiguousarray(history.T)
    signals, others = by_channel(codes), by_channel(heard)
    # One strain moves all channels, one after the other.
    kept: OrderedDict[Hashable, Floats] = OrderedDict()
    of_strain: dict[Hashable, Floats] = {}

    def said_of_all(strain: Floats, step: int) -> Floats:
        some = strain[::step]
        key = step, some.tobytes(), float(strain @ strain), float(strain.sum())
        said = kept.get(key)
        if said is None:
            kept[key] = said = _said(strain, motion.dt_s, step, *given)
            if len(kept) > STRAINS_KEPT:
                kept.popitem(last=False)
        return said

    def all_respond(strain: Floats, keep: slice) -> Floats:
        said: Floats = _said(strain, motion.dt_s, keep.step or 1, *given)
        return said

    def respond_of(channel: int) -> Callable[[Floats, slice], Floats]:
        alone = tuple(each[channel : channel + 1] for each in (given[0], given[3]))

        @cache
        def undisturbed(step: int) -> Floats:
            return said_of(motion.strain, step)

        def said_of(strain: Floats, step: int) -> Floats:
            said: Floats
            if step > 1:
                said = said_of_all(strain, step)[channel]
            else:
                said = _said(strain, motion.dt_s, 1, alone[0], relaxing, broken, alone[1])[0]
            return said

        def respond(strain: Floats, keep: slice) -> Floats:
            step = keep.step or 1
            return undisturbed(step) if strain is motion.strain else said_of(strain, step)

        return respond

    return [
        Nominal(
            codes=signals,
            heard=others,
            channel=channel,
            strain=motion.strain,
            dt_s=motion.dt_s,
            respond=respond_of(channel),
            all_respond=all_respond,
            largest=motion.largest,
            reference=reference,
            start_s=motion.start_s,
            temp_c=motion.temp_c,
            full_scale=float(2**bits - 1),
            known_of_strain=of_strain,
        )
        for channel in range(codes.shape[1])
    ]
