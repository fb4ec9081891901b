"""Spikes in a signal: where they are, whether they are some, and the signal without them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, maximum_filter1d, median_filter, uniform_filter1d
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.stats import kurtosis

from softsense.diagnose.design import BLOCKS

Floats = NDArray[np.float64]

# How far spikes are from what is around them, in usual distances, and how many are some.
SPIKE_SIGMA = 7.0
SPIKE_COUNT = 6
# One alone is a spike where it is so many times the usual distance from both its neighbours, which
# differ by less than this share of it; and has so many samples, which do.
LONE_SIGMA = 40.0
LONE_BACK = 0.1
LONE_SAMPLES = 1, 2
# A peak is farther off than this share of what is farthest of so many samples around it.
AROUND = 21
PEAK = 0.7
# Not spikes but steps of a converter are those of which its codes tell more than this share, by
# bins of so many codes, beside what goes on over so many samples.
STEPS_SHARE = 0.3
STEPS_CODES = 4.0
STEPS_SAMPLES = 41
# So many times as many are asked where edges of an effect may be among them.
MANY = 3
# What stands out does so from so many samples around it.
SPIKE_AROUND = 101
BESIDE_SPIKE = 2
# Noise may go with so many paces of the strain.
PACES = 20
# Where spikes of one shape are known smaller ones are spikes too.
SPIKES_MORE = 5.0
# Where more samples are hit they must stand alone, and be nearly all of those that are half as far:
# what is far from its neighbours more often is a tone that is off half of the time, or what is left
# of one.
SPIKE_MOST = 0.1
ALL_PART = 0.9
# A sample beside a spike is about a quarter as far from its mean with it as the spike is.
BESIDE = 0.35
# Samples whose median is what is usual where a spike begins.
NEWS = 9
# Of the samples that are half as far as a spike is, so many must be spikes; and so many of those
# that are so without one beside them.
SPIKE_PART = 0.35
OWN_PART = 0.45
# Of the spikes such a share must stand out, by so many times what is usual, from so many samples
# around them: noise that comes in bursts is as loud there.
BURST = 31
BURST_SIGMA = 4.0
ALONE_PART = 0.3
# What comes before a spike, and how long its tail is looked for, in samples: it begins with so much
# of the spike at least, is below the other share by then, and below 0 soon if at all. What is there
# of a spike at the end is no more than the last share.
BEFORE = 3
TAIL = 40
TAIL_LEAST = 0.2
TAIL_END = 0.08
TAIL_TURN = 3
TAIL_STAYS = 0.2
# And fades by so much from sample to sample at least.
SPIKE_FADES = 0.95
# By how much more slowly than it seems to, and how closely and in how many samples that is looked
# for.
FADES_SLOWER = (0.98, 1.03)
FADES_WITHIN = 3e-4
FADES_SEEN = 20_000
# White noise is so many times its usual distance from its neighbours; and what tails leave is just
# that where it has no more than so much of its power.
USUAL = 1.4826 / np.sqrt(0.8)
JUST_NOISE = 1.2
# How often spikes are looked for in what the larger ones leave.
STRUCK = 3
# Of so many samples what follows is foretold where spikes ring; what is not has such a kurtosis.
RINGS = 4
RINGING = 20.0


def are_steps(signal: Floats, hit: NDArray[np.bool_], codes: Sequence[Floats]) -> bool:
    """Whether what is ``hit`` of ``signal`` (samples,) is a converter's, by any of ``codes``, each
    (samples,)."""
    fast = _beyond(signal)
    left = (fast - _by_code(fast, met, hit) for met in codes)
    most = (1.0 - STEPS_SHARE) * float((fast[hit] ** 2).sum())
    return any(float((rest[hit] ** 2).sum()) < most for rest in left)


def _beyond(signal: Floats) -> Floats:
    """``signal`` (samples,) beyond what goes on around it."""
    fast: Floats = signal - uniform_filter1d(signal, STEPS_SAMPLES)
    return fast


def _by_code(fast: Floats, codes: Floats, hit: NDArray[np.bool_]) -> Floats:
    """(samples,) what ``codes`` tell of what is ``fast``, by means of what other minutes have at
    the same code; nothing where only what is ``hit`` goes."""
    bins = ((codes - codes.min()) / STEPS_CODES).astype(np.intp)
    turn = np.arange(len(fast)) * 2 * BLOCKS // len(fast) % 2
    told = np.empty(len(fast))
    for here in (0, 1):
        seen = turn != here
        counts = np.bincount(bins[seen], minlength=bins.max() + 1)
        sums = np.bincount(bins[seen], fast[seen], len(counts))
        told[~seen] = (sums / np.maximum(counts, 1))[bins[~seen]]
    usual = np.bincount(bins[~hit], minlength=bins.max() + 1) > 0
    return _beyond(np.where(usual[bins], told, 0.0))


def without_spikes(signal: Floats) -> Floats:
    """``signal`` (samples,) with straight lines where its spikes were, and without their tails."""
    plain = _lined(signal)
    answer = _ringing(signal)
    if not len(answer):
        return plain
    fading = [slow for slow in (answer, _fading(signal[:FADES_SEEN], answer)) if _fades(slow)]
    tailless = [_lined(_tailless(signal, slow, width)) for slow in fading for width in (1, 2)]
    best = min([plain, *tailless], key=np.var)
    if np.var(best) < JUST_NOISE * (USUAL * float(np.median(beyond_mean(signal)))) ** 2:
        return best
    return min([best, _lined(_struck(signal))], key=np.var)


def _fading(signal: Floats, answer: Floats) -> Floats:
    """``answer``, as fast as spikes in ``signal`` (samples,) fade: noise, and tails that are cut
    off, hide that from their mean shape."""

    def at(slower: float) -> Floats:
        return answer * slower ** np.arange(len(answer))

    def left(slower: float) -> float:
        # What does not fade leaves all.
        slow = at(slower)
        return float(np.var(_lined(_tailless(signal, slow, 1)) if _fades(slow) else signal))

    within = {"xatol": FADES_WITHIN}
    return at(minimize_scalar(left, bounds=FADES_SLOWER, method="bounded", options=within).x)


def _tailless(signal: Floats, answer: Floats, width: int) -> Floats:
    """``signal`` (samples,) without its spikes and what they leave behind, as ``answer`` has it.

    What no spike before foretells is the spikes themselves, which are sharp, ``width`` samples from
    where they begin; what is beside them stays as it is, since an error there would have a tail of
    its own.
    """
    news = lfilter(answer, [1.0], signal - signal[0])
    usual = median_filter(news, NEWS)
    far = np.abs(news - usual)
    sudden = far > max(SPIKES_MORE * 1.4826 * float(np.median(far)), 1.0)
    for _ in range(width - 1):
        sudden[1:] |= sudden[:-1]
    rest: Floats = signal[0] + lfilter([1.0], answer, np.where(sudden, usual, news))
    return rest


def plain_of(signal: Floats) -> Floats:
    """``signal`` (samples,) where a tone may be: without its spikes, which are no burst of one."""
    hit = spike_hits(signal)
    return signal if hit.any() and _in_bursts(signal, hit) else without_spikes(signal)


def _struck(signal: Floats) -> Floats:
    """``signal`` (samples,) without its spikes and their tails, as their own mean shapes have them:
    two, for each begins somewhere between two samples."""
    begins, rest, shape = _begins(signal), signal.copy(), _shape(signal)
    if not len(shape):
        return rest
    reach = np.arange(-1, min(len(shape) + BEFORE, TAIL))
    windows = signal[begins[:, None] + reach] - _before(signal, begins)[:, None]
    shapes = np.linalg.svd(windows, full_matrices=False)[2][:2]
    for _ in range(STRUCK):
        # Large ones hide small ones that are near.
        begins = begins[np.argsort(-np.abs(rest[begins] - _before(rest, begins)))]
        for begin in begins:
            above = rest[begin + reach] - _before(rest, begin[None])
            rest[begin + reach] -= shapes.T @ (shapes @ above)
        begins = _begins(rest)
    return rest


def _before(signal: Floats, begins: NDArray[np.intp]) -> Floats:
    """(spikes,) what is there before each of the spikes that begin at these samples."""
    level: Floats = signal[begins[:, None] - np.arange(2, BEFORE + 2)].mean(axis=1)
    return level


def _begins(signal: Floats) -> NDArray[np.intp]:
    """(spikes,) where spikes begin that are not at the very ends."""
    hits = np.flatnonzero(spike_hits(signal))
    hits = hits[(hits > BEFORE + 1) & (hits < len(signal) - TAIL - 1)]
    jump = np.abs(np.diff(signal, prepend=signal[0]))
    groups = np.split(hits, np.flatnonzero(np.diff(hits) > BEFORE) + 1)
    # The largest jump may be beside those that are far from all around them.
    spans = [np.arange(g[0] - 1, g[-1] + 2) for g in groups if len(g)]
    return np.array([span[np.argmax(jump[span])] for span in spans], dtype=np.intp)


def _lined(signal: Floats) -> Floats:
    """``signal`` (samples,) with straight lines where its spikes were, and close to them."""
    return between(signal, np.convolve(spike_hits(signal), np.ones(5), "same") > 0)


def between(signal: Floats, hit: NDArray[np.bool_]) -> Floats:
    """``signal`` (samples,) with straight lines where it is ``hit``."""
    clean, good = signal.copy(), np.flatnonzero(~hit)
    if len(good):
        clean[hit] = np.interp(np.flatnonzero(hit), good, signal[good])
    return clean


def _answer(shape: Floats) -> Floats:
    """1 and less what two samples foretell of the next one in a spike's ``shape``, or nothing."""
    if len(shape) < 2:
        return np.zeros(0)
    held = np.concatenate([[0.0], shape, [0.0, 0.0]])
    past = np.stack([held[1:-1], held[:-2]], axis=1)
    ahead, _, _, _ = np.linalg.lstsq(past, held[2:])
    answer = np.array([1.0, *-ahead])
    return answer if _fades(answer) else np.zeros(0)


def _fades(answer: Floats) -> bool:
    """Whether what follows a spike so is soon gone."""
    return bool(np.abs(np.roots(answer)).max() < SPIKE_FADES)


def _ringing(signal: Floats) -> Floats:
    """The same of what spikes in ``signal`` (samples,) leave behind, or nothing where they are
    sharp. Where they are too many for their shape to be seen, all samples say what follows one."""
    answer = _answer(_shape(signal))
    if len(answer):
        return answer
    held = signal - signal.mean()
    past = np.stack([held[RINGS - k : -k] for k in range(1, RINGS + 1)])
    answer = np.array([1.0, *-np.linalg.lstsq(past @ past.T, past @ held[RINGS:])[0]])
    below = np.flatnonzero(lfilter([1.0], answer, np.eye(1, TAIL)[0]) < -TAIL_END)
    swings = len(below) > 0 and below[0] > TAIL_TURN
    if not _fades(answer) or swings:
        return np.zeros(0)
    news = lfilter(answer, [1.0], held)
    rings = kurtosis(news) > RINGING and spike_hits(news).sum() >= MANY * SPIKE_COUNT
    return answer if rings else np.zeros(0)


def sudden_hits(signal: Floats) -> NDArray[np.bool_]:
    """(samples,) whether there is a spike, or one begins that rings."""
    hit = spike_hits(signal)
    if hit.any() and _in_bursts(signal, hit):
        return np.zeros(len(hit), dtype=bool)
    answer = np.zeros(0) if hit.any() else _ringing(signal)
    return spike_hits(lfilter(answer, [1.0], signal - signal[0])) if len(answer) else hit


def _shape(signal: Floats) -> Floats:
    """A spike of size 1 and its tail, as ``signal`` (samples,) has them; nothing where it is sharp.

    Nothing either where it stays, or swings so slowly that it is no circuit's.
    """
    begins = _begins(signal)
    if len(begins) < SPIKE_COUNT:
        return np.zeros(0)
    after = signal[begins[:, None] + np.arange(TAIL)] - _before(signal, begins)[:, None]
    shape: Floats = after[:, 0] @ after / (after[:, 0] @ after[:, 0])
    # Others nearby, and what is slow, are still there at its end.
    stays = float(shape[-TAIL // 4 :].mean())
    if abs(stays) > TAIL_STAYS:
        return np.zeros(0)
    shape = (shape - stays) / (1.0 - stays)
    there = np.abs(shape) > TAIL_END
    gone = np.flatnonzero(~(there[1:-2] | there[2:-1] | there[3:]))
    back = np.flatnonzero(shape < -TAIL_END)
    sharp = np.abs(shape[1:3]).max() < TAIL_LEAST
    if sharp or not len(gone) or (len(back) and TAIL_TURN < back[0] <= gone[0]):
        return np.zeros(0)
    return shape[: gone[0] + 1]


def beyond_mean(signal: Floats) -> Floats:
    """(samples,) how far each sample is from the mean of those around it."""
    far: Floats = np.abs(signal - np.convolve(signal, np.ones(5) / 5, "same"))
    return far


def spike_hits(left: Floats) -> NDArray[np.bool_]:
    """(samples,) whether a sample is far more than the usual distance from its neighbours.

    None where many more are half as far, but for those that are so for a spike beside them: that
    is noise with heavy tails. Nor where very many are hit that do not stand alone: that is a tone.
    """
    fast = beyond_mean(left)
    hit, near = _far(fast), _far(fast, 0.5)
    if hit.sum() > SPIKE_MOST * len(hit):
        good = hit.sum() > ALL_PART * near.sum() and _stand_alone(left, hit)
    else:
        good = hit.sum() >= SPIKE_PART * near.sum()
        if not good:
            own = fast > BESIDE * maximum_filter1d(fast, 5)
            good = (hit & own).sum() >= OWN_PART * (near & own).sum()
    if not good:
        hit[:] = False
    return hit


def peaks(signal: Floats) -> NDArray[np.bool_]:
    """(samples,) which of ``signal`` (samples,) are as far off as spikes are, and nearly the
    farthest of those around them; whatever else is half as far."""
    fast = beyond_mean(signal)
    peak: NDArray[np.bool_] = _far(fast) & (fast > PEAK * maximum_filter1d(fast, AROUND))
    return peak


def _far(fast: Floats, part: float = 1.0) -> NDArray[np.bool_]:
    """(samples,) which distances from their neighbours are such a ``part`` of what spikes have."""
    scale = max(1.4826 * float(np.median(fast)), 0.5)
    return np.asarray(fast > part * SPIKE_SIGMA * scale)


def _in_bursts(left: Floats, hit: NDArray[np.bool_]) -> bool:
    """Whether what is around most samples that are ``hit`` is as far off: that is noise, or a tone,
    in bursts. Spikes that come in bursts have calm samples between them, and tails that follow."""
    if _stand_alone(left, hit):
        return False
    answer = _answer(_shape(left))
    if not len(answer):
        return True
    news = lfilter(answer, [1.0], left - left[0])
    return not _stand_alone(news, spike_hits(news))


def _stand_alone(left: Floats, hit: NDArray[np.bool_]) -> bool:
    """Whether there is little around many samples that are ``hit``."""
    off = np.abs(left - median_filter(left, BURST))
    usual = 1.4826 * median_filter(off, BURST)[hit]
    # The neighbours of a spike are far from it.
    alone = maximum_filter1d(off, 3)[hit] > BURST_SIGMA * usual
    return bool(hit.any() and alone.sum() >= ALONE_PART * hit.sum())


def has_lone(signal: Floats) -> bool:
    """Whether one sample of ``signal`` (samples,), or two, are so far off that one such spike is
    enough."""
    return any(_has_lone(signal, width) for width in LONE_SAMPLES)


def _has_lone(signal: Floats, width: int) -> bool:
    """The same of so many samples, which are alike."""
    before, after = signal[: -width - 1], signal[width + 1 :]
    first, last = signal[1:-width], signal[width:-1]
    far = np.abs(0.5 * (first + last) - 0.5 * (before + after))
    back = (np.abs(after - before) < LONE_BACK * far) & (np.abs(last - first) < LONE_BACK * far)
    scale = max(1.4826 * float(np.median(far)), 0.5)
    return bool(np.any(far[back] > LONE_SIGMA * scale))


def paces(speed: Floats) -> NDArray[np.intp]:
    """(samples,) at which of ``PACES`` paces the ``speed`` (samples,) of the strain is, each as
    often as any other."""
    edges = np.quantile(speed, np.linspace(0.0, 1.0, PACES + 1)[1:-1])
    return np.searchsorted(edges, speed)


def standing_out(left: Floats, hit: NDArray[np.bool_], speed: Floats) -> int:
    """How many samples that are ``hit`` are far from their neighbours for where they are, and for
    the ``speed`` (samples,) of the strain there."""
    fast = beyond_mean(left)
    pace = paces(speed)
    usual = np.array(
        [np.median(fast[pace == k]) if np.any(pace == k) else 0.0 for k in range(PACES)]
    )
    # Those beside a spike are far from their mean with it.
    calm = between(fast, binary_dilation(hit, iterations=BESIDE_SPIKE))
    usual = 1.4826 * np.maximum(median_filter(calm, SPIKE_AROUND), usual[pace])
    return int((fast[hit] > SPIKE_SIGMA * usual[hit]).sum())
