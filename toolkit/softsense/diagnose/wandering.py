"""Whether what wanders is a random walk: no jumps, no swings, no noise, nothing of the motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.stats import kurtosis

from softsense.diagnose.spikes import BURST, PACES, paces
from softsense.diagnose.walk import innovations, levels

Floats = NDArray[np.float64]

# Excess kurtosis of the moves of a walk, of so many at least.
JERKY = 5.5
FEW_MOVES = 30
# The autocorrelation of these moves, so many later, of what swings back.
SWINGING = -0.3
SWINGS = range(2, 11)
# What is left of a walk's variance about two levels, as a median over so many samples has it, which
# it goes to and fro between so often: of a line from one to the other a quarter is; and steps that
# find the levels (Lloyd).
BETWEEN = 0.12
CALMED = 5
TO_AND_FRO = 6
LLOYD = 20
# Noise remembers less than this, on average, of where it was from so many samples before, to so
# many; and swings back by no more than that. Its kurtosis is this near a Gaussian's.
REMEMBERED = 0.15
FORGOTTEN, LATER = 30, 60
SWUNG = 0.2
GAUSSIAN = 0.5
# Noise that goes with the speed remembers less than this of any sample before, of so many; and has
# a kurtosis of no more than this at any pace; in bursts, which begin and end within what is
# averaged, for how loud it is where it is.
WHITE, WHITE_SAMPLES = 0.1, 10
PACED, BURSTY = 15.0, 3.0
# The power of the moves of a walk while the strain is fast over that while it is slow: of no walk
# above the one, over a second, nor below the other, over so many samples.
HURRIED, HURRIED_SAMPLES = 5.0, 20
AT_REST, AT_REST_SAMPLES = 0.1, 5
# A gap of so many times the noise that heeds the strain so much may be a walk behind a divider, if
# that leaves half at most. An amplifier may follow, so that a divider's end is so far beyond the
# converter's, in its ranges.
GAPING = 1.5
HEEDS, HALF = 3.0, 0.5
BEYOND = (0.02, 0.2, 0.5, 1.0)
# What of the noise in such moves is not known.
NOISE_LEFT = 0.1
# The same of its innovations, sample by sample, and their autocorrelation within ``ECHO`` samples.
JUMPY = 10.0
COLOURED = 0.3
ECHO = 40


def jerky(walk: Floats, gain: float, where: NDArray[np.bool_], whole: bool = True) -> bool:
    """Whether what wanders goes in jumps, bumps or swings, or to and fro between two levels, and
    not by many small steps.

    Jumps count ``where`` nothing else makes them; swings on the ``whole``, if that is free of what
    an equation leaves that is only nearly right.

    A random walk's moves over a second are Gaussian, and it does not come back some seconds later;
    so are its innovations (of this ``gain``), which are white besides. Contacts and loads come and
    go, loose parts ring, what nobody logs swings.
    """
    if _two_levels(walk):
        return True
    moves = np.diff(levels(walk))
    moves -= moves.mean()
    news = innovations(walk[:, None], gain)[:, 0]
    news -= news.mean()
    often = levels(where.astype(np.float64)) > 0.5
    calm = _gaussian(moves[often[1:] & often[:-1]], JERKY) and _gaussian(news[where], JUMPY)
    if not (calm and whole):
        return not calm
    later = [float(moves[k:] @ moves[:-k]) for k in SWINGS if k < len(moves)]
    swinging = min(later, default=0.0) < SWINGING * float(moves @ moves)
    echoes = [float(news[k:] @ news[:-k]) for k in range(1, ECHO)]
    return swinging or max(np.abs(echoes)) > COLOURED * float(news @ news)


def _two_levels(walk: Floats) -> bool:
    """Whether ``walk`` (samples,) goes to and fro between two levels, as a contact does, and seldom
    is anywhere else."""
    calm = median_filter(walk, CALMED)
    edge = float(np.mean(np.quantile(calm, [0.05, 0.95])))
    for _ in range(LLOYD):
        high = calm > edge
        if high.all() or not high.any():
            return False
        levels = float(calm[~high].mean()), float(calm[high].mean())
        edge = 0.5 * sum(levels)
    within = float(high.mean() * calm[high].var() + (~high).mean() * calm[~high].var())
    there = np.abs(calm - edge) > 0.5 * (levels[1] - edge)
    return bool(within < BETWEEN * calm.var() and np.diff(high[there]).sum() >= TO_AND_FRO)


def noisy(walk: Floats, speed: Floats) -> bool:
    """Whether what wanders is noise of some colour, which soon forgets where it was, does not swing
    and is Gaussian; or white, in bursts or louder with the ``speed`` (samples,)."""
    held = walk - walk.mean()
    after = _echoes(held)
    if abs(after[FORGOTTEN:].mean()) > REMEMBERED or after.min() < -SWUNG:
        return False
    if abs(float(kurtosis(held))) < GAUSSIAN or in_bursts(held):
        return True
    return _white(held, _power_at(held, speed), GAUSSIAN)


def with_speed(held: Floats, speed: Floats) -> bool:
    """Whether ``held`` (samples,), of mean 0, is white noise, however loud it is at what ``speed``
    (samples,) and if not Gaussian."""
    after = np.abs(_echoes(held)[:WHITE_SAMPLES]).max()
    return bool(after < WHITE) and _kurtosis_for(held, _power_at(held, speed)) < PACED


def _power_at(held: Floats, speed: Floats) -> Floats:
    """(samples,) the mean square of ``held`` (samples,) at the pace of each sample."""
    pace = paces(speed)
    power = np.bincount(pace, held**2, PACES) / np.maximum(np.bincount(pace, minlength=PACES), 1)
    return np.asarray(power[pace])


def in_bursts(held: Floats) -> bool:
    """Whether ``held`` (samples,), of mean 0, is white noise that is louder at times."""
    return _white(held, uniform_filter1d(held**2, BURST), BURSTY)


def _white(held: Floats, power: Floats, most: float) -> bool:
    """Whether ``held`` (samples,) is white, and Gaussian for the ``power`` (samples,) that it has
    where it is, but for an excess kurtosis of ``most``."""
    here = _kurtosis_for(held, power)
    return abs(float(_echoes(held)[0])) < REMEMBERED and abs(here) < most


def _kurtosis_for(held: Floats, power: Floats) -> float:
    """The excess kurtosis of ``held`` (samples,) for the ``power`` (samples,) that it has."""
    return float(kurtosis(held / np.sqrt(np.maximum(power, 1e-24))))


def _echoes(held: Floats) -> Floats:
    """(lags,) autocorrelation of ``held`` (samples,), of mean 0, one sample later and more."""
    square = float(held @ held)
    return np.array([float(held[k:] @ held[:-k]) / square for k in range(1, LATER)])


def moved_by(walk: Floats, speed: Floats) -> bool:
    """Whether what wanders does so while the strain moves, or while it does not: a walk does not
    heed its ``speed`` (samples,)."""
    return (
        _hurry(walk, speed, HURRIED_SAMPLES) > HURRIED
        or _hurry(walk, speed, AT_REST_SAMPLES) < AT_REST
    )


def behind_dividers(
    gaps: Floats, sigma: Floats, speed: Floats, signals: Floats
) -> list[Floats | None]:
    """By channel: (samples,) how much of a resistance's walk a divider lets through, on average 1;
    None where the walk does not heed the ``speed`` (samples,), and everywhere where one of the
    ``gaps`` (channels, samples), beyond a noise ``sigma`` (channels,), does so behind any divider:
    then something else is there.

    The slope of F R / (R + R0) over R, and that of F R0 / (R + R0), at ``signals`` (channels,
    samples) that are shares of the converter's range.
    """
    result: list[Floats | None] = [None] * len(gaps)
    for channel in np.flatnonzero(gaps.std(axis=1) > GAPING * sigma):
        heeds = _hurry(gaps[channel], speed, HURRIED_SAMPLES)
        if heeds < HEEDS:
            continue
        inside = np.clip(signals[channel], 0.0, 1.0)
        ends = [end + side for end in BEYOND for side in (1.0 - inside, inside)]
        slopes = [(far / np.exp(np.mean(np.log(far)))) ** 2 for far in ends]
        left = [_hurry(gaps[channel] / slope, speed, HURRIED_SAMPLES) for slope in slopes]
        least = int(np.argmin(np.abs(np.log(left))))
        if left[least] > min(HALF * heeds, HURRIED):
            return [None] * len(gaps)
        result[channel] = slopes[least]
    return result


def _hurry(walk: Floats, speed: Floats, samples: int) -> float:
    """Mean square of the moves of ``walk`` over so many ``samples`` where the ``speed`` is in its
    upper quarter, over the same in its lower one, noise apart."""
    whole = len(walk) // samples * samples
    means, paces = (x[:whole].reshape(-1, samples).mean(axis=1) for x in (walk, speed))
    moves, along = np.diff(means) ** 2, 0.5 * (paces[1:] + paces[:-1])
    noise, there = np.diff(walk, 2) ** 2 / 6.0 * (2.0 / samples), speed[1:-1]

    def ends(square: Floats, pace: Floats) -> tuple[float, float]:
        low, high = np.quantile(pace, [0.25, 0.75])
        return float(square[pace <= low].mean()), float(square[pace >= high].mean())

    noises = ends(noise, there)
    least = max(NOISE_LEFT * min(noises), 1e-12)
    slow, fast = np.maximum(np.subtract(ends(moves, along), noises), least).tolist()
    return float(fast / slow)


def _gaussian(values: Floats, most: float) -> bool:
    """Whether no more excess kurtosis than ``most`` is seen; of a few values none is."""
    return len(values) < FEW_MOVES or float(kurtosis(values)) <= most
