"""Effects without a mean: noise, spikes and lines, in what is left over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d, uniform_filter1d
from scipy.signal import lfilter, oaconvolve, welch
from scipy.stats import kurtosis

from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import BLOCKS
from softsense.diagnose.nominal import Motion, noise_rms
from softsense.diagnose.walk import innovations, levels, likely_gain

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Real and simulated noise differ anyway by up to this factor.
NOISE_FACTOR = 2.5
# Less will do on few channels where all others, at least so many, are louder than simulated by
# factors that are equal within so much.
LONE_FACTOR = 1.6
AGREEING = 3
AGREED = 1.15
# And less still where some, at least so many, are as loud as simulated within this factor.
SIMULATED = 2
RIGHT = 1.1
BESIDE_RIGHT = 1.4
# Noise is uneven where its power varies by such a factor; by more beside an effect that ever moves,
# from one sample to the next, by so much of the noise.
UNEVEN = 2.5
UNEVEN_BESIDE = 8.0
MOVING = 0.3
# Or where it is louder by some factor besides: uneven by such a one, of such an excess kurtosis, of
# some colour, or in bursts.
SOMEWHAT = 1.4
RATHER_UNEVEN = 1.5
BURSTS = 1.5
# The slowest of so many samples are still.
STILL = 0.2
# Samples of a spectrum in whose middle lines do not show.
PIECE = 256
LINE_RATIO = 18.0
# What is slower is motion.
LEAST_HZ = 0.3
# Lines of two channels are one within this.
SAME_HZ = 0.05
# So much stronger than by the motion's strongest lines is one that the motion does not make.
MOTION_LINES = 10
BEYOND_MOTION = 30.0
SPIKE_SIGMA = 7.0
SPIKE_COUNT = 6
# One alone is a spike where it is so many times the usual distance from both its neighbours, which
# differ by less than this share of it.
LONE_SIGMA = 40.0
LONE_BACK = 0.1
# Not spikes but steps of a converter are those of which its codes tell more than this share, by
# bins of so many codes, beside what goes on over so many samples.
STEPS_SHARE = 0.3
STEPS_CODES = 4.0
STEPS_SAMPLES = 41
# So many times as many are asked where edges of an effect may be among them.
MANY = 3
# Within so many samples an edge of what was explained is no spike.
SPIKE_EDGE = 7
# Of the spikes in an effect's leftovers such a share must stand out from so many samples around
# them too: what is rough in places only is not spiky there.
SPIKE_AROUND = 101
SPIKE_STANDS = 0.5
# Where spikes of one shape are known smaller ones are spikes too.
SPIKES_MORE = 5.0
# No more samples are spikes: what is far from its neighbours more often is a tone that is off half
# of the time.
SPIKE_MOST = 0.1
# Samples whose median is what is usual where a spike begins.
NEWS = 9
# Of the samples that are half as far as a spike is, so many must be spikes.
SPIKE_PART = 0.35
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
# How often spikes are looked for in what the larger ones leave.
STRUCK = 3
# Of so many samples what follows is foretold where spikes ring; what is not has such a kurtosis.
RINGS = 4
RINGING = 20.0
# So much of a long recording says how large a tone is beside the noise.
STRETCH = 32_768
# Over which a tone may keep its size and phase; a shorter time must explain so many noise variances
# for each time that they change. What does so within a few periods is no tone.
TONES_S = (20.0, 7.0, 2.5, 1.2)
TONE_PERIODS = 4.0
TONE_PRICE = 24.0
# So many samples of nearly one phase make a tone of any shape, and so many may be of another side
# of an edge of it.
FOLD, EDGE = 31, 7
# Samples whose mean is slow beside it.
SLOWER = 21
# What a spike that is left costs, in noise variances: pulses that are not followed leave some.
SHARP_PRICE = 100.0
HARMONICS = 40
# A tone whose frequency moves is seen in frames of so many seconds, in so many of them at least; it
# stands out there by this factor, and moves by so many lines of a frame's spectrum to the next one.
FRAME_S = 25.0
LIT_PART = 0.6
LIT_RATIO = 12.0
FRAME_STEP = 2
COURSE_ORDER = 5
# So many of the frames are looked at before all.
FRAMES = 100
# A tone whose phase wanders, or that is switched all the time, is a hump in the spectrum of pieces
# of so many seconds: by this factor above both sides, so far from it, and above this frequency.
HUMP_S = 12.0
HUMP_RATIO = 8.0
HUMP_HZ = 1.5
ASIDE_HZ = 0.5, 1.5
# How many more tones may be beside one, and their least power, of the noise's.
MORE_TONES = 2
LEAST_TONE = 0.05
# Of a tone that is taken out before all else: its power, of the noise's, and what is no motion.
LOUD_TONE = 2.0
FAST_HZ = 1.0
# A harmonic is one where it has more power than is usual so far around it, by this factor, and no
# more of the tone's than pulses have, in units of its order to the power of -2; and where one of
# the two before it is there. Else it is the motion's: harmonics fold down to where that is.
HARMONIC_RATIO = 6.0
AROUND_HZ = 1.0
HARMONIC_MOST = 4.0
SLOWEST_HZ = 0.05
# Of the first ones a sharp line just where it is foretold is one whatever its size.
LOW_HARMONIC = 5
SHARP_RATIO = 40.0
# What comes and goes faster is left in part: so often is the rest looked at again.
TWICING = 4
# A tone that is switched on and off shows within so long and so many of its periods; an instant
# must explain so many noise variances, of each harmonic.
SWITCH_S = 1.5
SWITCH_PERIODS = 3.0
SWITCH_PRICE = 12.0
# So many samples about each such instant it is neither: it fades in and out.
FADES = 12
# The part of all samples that says how loud it is without the tone.
LEAST_OFF = 0.1
# Spikes are there while it is off, too: no less often than this part of what chance would have.
WHILE_OFF = 0.4
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
# many; and swings back by no more than that. Its kurtosis is this near a Gaussian's, or in bursts
# for how loud it is where it is.
REMEMBERED = 0.15
FORGOTTEN, LATER = 30, 60
SWUNG = 0.2
GAUSSIAN = 0.5
# The power of the moves of a walk while the strain is fast over that while it is slow: of no walk
# above the one, over a second, nor below the other, over so many samples.
HURRIED, HURRIED_SAMPLES = 5.0, 20
AT_REST, AT_REST_SAMPLES = 0.1, 5
# What of the noise in such moves is not known.
NOISE_LEFT = 0.1
# The same of its innovations, sample by sample, and their autocorrelation within ``ECHO`` samples.
JUMPY = 10.0
COLOURED = 0.3
ECHO = 40


@dataclass(frozen=True)
class Finding:
    """A variance-type effect on ``channels``, with a number that says how strong it is."""

    name: str
    channels: tuple[int, ...]
    value: float
    what: str


def findings(
    left: Floats,
    residual: Floats,
    own: Floats,
    motion: Motion,
    explained: bool,
    walking: Sequence[int] = (),
    heard: Sequence[float] = (),
    bent: Sequence[int] = (),
    coarse: Sequence[int] = (),
    codes: Sequence[Floats] = (),
    noisy: Sequence[int] = (),
) -> list[Finding]:
    """Test the leftovers ``left`` (samples, channels) in codes, against the simulation's ``own``.

    ``residual``: the same before anything was explained, where a line that one channel seemed to
    hear of another is still there. ``explained``: an effect has been taken out, whose form being
    only nearly right leaves edges and ripples: spikes and lines must then stand out more, and what
    swings with the motion is no line.
    ``walking``: channels with a random walk, or coloured noise, which is left over too. ``heard``:
    tones (Hz) that were found before, and need stand out no more than where nothing is explained.
    ``bent``: channels behind a curve, which is steep for their noise where it is steep for them.
    ``coarse``: channels whose converter has lost codes, between which noise makes it leap.
    ``codes``, each (samples, channels), which may tell what is sharp. ``noisy``: channels whose gap
    is noise.
    """
    there, covariates = noise_rms(own), _covariates(motion)

    def of_channel(c: int) -> _Found:
        return _found(
            left[:, c],
            residual[:, c],
            own[:, c],
            float(there[c]),
            motion,
            covariates[1:] if c in bent else covariates,
            explained,
            c in walking,
            heard,
            c in coarse,
            [met[:, c] for met in codes],
        )

    each = all_at_once(of_channel, range(left.shape[1]))
    spiky = [c for c, one in enumerate(each) if one.spiky]
    lines = {c: one.line for c, one in enumerate(each) if one.line is not None}
    levels = {c: one.level for c, one in enumerate(each) if one.level is not None}
    loud = {c: one.level for c, one in enumerate(each) if one.level is not None and one.loud}
    # A tone takes some of the noise beside it along.
    toneless = {c: levels[c] / there[c] for c in levels if c not in lines}
    loud |= {c: levels[c] for c in _apart(toneless) - set(bent)}
    for c in noisy:
        rest = _unspiked(left[:, c]) if c in spiky else left[:, c]
        level, white = float(np.std(rest)), float(noise_rms(rest[:, None])[0])
        # Its colour, or its bursts, must be as loud as all that was simulated.
        if level > max(SOMEWHAT * there[c], np.hypot(white, there[c])):
            loud[c] = level
    result = []
    if spiky:
        result.append(Finding("spikes", tuple(spiky), float(len(spiky)), "channels with spikes"))
    if lines:
        frequency = float(np.median(list(lines.values())))
        for c in set(range(left.shape[1])) - set(lines):
            line = _line(_unspiked(residual[:, c]), motion.dt_s, 2.0)
            if line is not None and abs(line - frequency) < SAME_HZ:
                lines[c] = line
        result.append(Finding("interference", tuple(sorted(lines)), frequency, "frequency_hz"))
    if loud:
        result.append(Finding("noise", tuple(sorted(loud)), max(loud.values()), "rms_codes"))
    return result


@dataclass(frozen=True)
class _Found:
    """Of one channel: its line (Hz), if it has spikes, how loud it is, and if that is noise."""

    line: float | None
    spiky: bool = False
    level: float | None = None
    loud: bool = False


def _found(
    left: Floats,
    residual: Floats,
    own: Floats,
    there: float,
    motion: Motion,
    covariates: Sequence[Floats],
    explained: bool,
    walking: bool,
    heard: Sequence[float],
    coarse: bool,
    codes: Sequence[Floats],
) -> _Found:
    """``findings`` of one channel: all (samples,). ``there``: the simulation's noise."""
    enough = MANY * SPIKE_COUNT if explained else SPIKE_COUNT
    # Each is looked for without the others: a tone hides spikes, and both pass for noise.
    rest = left
    news = _news(rest) if walking else rest
    least = 2.0 if explained else LEAST_TONE
    line = _line(_plain(news), motion.dt_s, least)
    if walking:
        # A walk follows a slow tone too.
        line = line or _line(_plain(rest), motion.dt_s, least)
    if line is None and heard:
        again = _line(_unspiked(news), motion.dt_s, LEAST_TONE)
        line = next((f for f in heard if again and abs(again - f) < SAME_HZ), None)
    if line is not None and explained and _moves(rest, motion, line):
        line = None
    off = np.ones(len(rest), dtype=bool)
    if line is not None:
        rest = _without_tone(rest, line, motion.dt_s)
        news = _news(rest) if walking else rest
        off = _off(_plain(left), line, motion.dt_s)
    if coarse:
        return _Found(line)
    # Tails pass for a walk, which foretells them: what it does not is no longer sharp.
    sharp = rest if walking and not _spikes(news).any() else news
    hit = _sudden(sharp)
    # What was explained may jump a moment early or late.
    said = residual - left
    jumps = maximum_filter1d(said, SPIKE_EDGE) - minimum_filter1d(said, SPIKE_EDGE)
    hit &= _fast(sharp) > jumps
    if said.any() and hit.any() and _stands_out(sharp, hit) < SPIKE_STANDS * hit.sum():
        hit[:] = False
    if _only_while_on(hit, off):
        hit[:] = False
    rest = news
    if hit.any() and _steps(sharp, hit, codes):
        hit[:] = False
    lone = hit.any() and _lone(sharp) and not _lone(own)
    spiky = bool(lone or hit.sum() >= enough + 2 * _spikes(own).sum())
    if spiky:
        rest = _unspiked(rest)
    # How a tone fades leaves some of it.
    plain = rest[off]
    level = _between_lines(plain) if line is not None else float(noise_rms(plain[:, None])[0])
    # What an equation leaves that is only nearly right comes with moves, where it says them.
    moving = float(np.abs(np.diff(said)).max()) > MOVING * there
    unevenness = UNEVEN_BESIDE if moving else UNEVEN
    if walking:
        level = min(level, _under_walk(left))
    if moving:
        level, covariates = min(level, _still(rest, motion)), covariates[:-1]
    here, simulated = _unevenness(rest, covariates), _unevenness(own, covariates)
    uneven = here > unevenness >= simulated
    louder = level / max(there, 1.0)
    if not explained and louder > SOMEWHAT:
        # Two signs of it together, though each alone could be as simulated.
        uneven |= louder * np.sqrt(here) > NOISE_FACTOR and here > RATHER_UNEVEN * simulated
        uneven |= _tails(rest) > BURSTS > 2.0 * _tails(own)
    return _Found(line, spiky, level, bool(louder > NOISE_FACTOR or (uneven and not spiky)))


def evident(
    residual: Floats, motion: Motion, coarse: Sequence[int] = (), codes: Sequence[Floats] = ()
) -> list[Finding]:
    """Loud tones and many spikes of each channel that are seen before anything is explained.

    What all channels have in common they would else seem to hear of each other, and what is sharp
    would have to be explained again without it. On channels that are ``coarse`` all is sharp.
    ``codes``, each (samples, channels), which may tell what is sharp.
    """

    def seen(c: int, heard: Sequence[float] = ()) -> list[Finding]:
        result, signal = [], residual[:, c]
        plain = _plain(signal)
        line = _line(plain, motion.dt_s, LEAST_TONE if heard else LOUD_TONE, FAST_HZ)
        if line is not None and (heard or _moves(plain, motion, line)):
            line = next((f for f in heard if abs(line - f) < SAME_HZ), None)
        if line is not None:
            result.append(Finding("interference", (c,), line, "frequency_hz"))
            signal = _without_tone(signal, line, motion.dt_s)
        hit = _sudden(signal)
        if line is not None and _only_while_on(hit, _off(plain, line, motion.dt_s)):
            return result
        many = hit.sum() >= MANY * SPIKE_COUNT
        many = many and not _steps(signal, hit, [met[:, c] for met in codes])
        if c not in coarse and (many or _lone(signal)):
            result.append(Finding("spikes", (c,), 1.0, "channels with spikes"))
        return result

    each = all_at_once(seen, range(residual.shape[1]))
    heard = [f.value for found in each for f in found if f.name == "interference"]
    deaf = [c for c, found in enumerate(each) if not any(f.value in heard for f in found)]
    if heard:
        # What is loud on one channel need not be so on others, beside a walk.
        for c, found in zip(deaf, all_at_once(lambda c: seen(c, heard), deaf), strict=True):
            each[c] = found
    return [finding for found in each for finding in found]


def _steps(signal: Floats, hit: NDArray[np.bool_], codes: Sequence[Floats]) -> bool:
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


def _news(signal: Floats) -> Floats:
    """What of ``signal`` (samples,) a random walk in it does not foretell."""
    gain = likely_gain(signal, float(noise_rms(signal[:, None])[0]))
    return innovations(signal[:, None], gain)[:, 0]


def cleaned(residual: Floats, found: list[Finding], motion: Motion) -> Floats:
    """``residual`` (samples, channels) without the spikes and lines of ``found``, or itself."""
    clean = residual
    # Tones first, which hide spikes.
    for finding in sorted(found, key=lambda finding: finding.name):
        if finding.name not in ("spikes", "interference"):
            continue
        clean = clean.copy()
        for c in finding.channels:
            if finding.name == "spikes":
                clean[:, c] = _unspiked(clean[:, c])
                continue
            rest = _without_tone(clean[:, c], finding.value, motion.dt_s)
            for _ in range(MORE_TONES):
                plain = _unspiked(rest)
                line = _line(plain, motion.dt_s, LEAST_TONE)
                if line is None or _moves(plain, motion, line):
                    break
                rest = _without_tone(rest, line, motion.dt_s)
            clean[:, c] = rest
    return clean


def noise_beside(residual: Floats, found: Sequence[Finding]) -> Floats:
    """(channels,) noise of a ``residual`` (samples, channels) that is ``cleaned`` of what was
    ``found``: with a tone went what noise there is near its frequency."""
    level = noise_rms(residual)
    for c in {c for finding in found if finding.name == "interference" for c in finding.channels}:
        level[c] = max(level[c], _between_lines(residual[:, c]))
    return level


def _unspiked(signal: Floats) -> Floats:
    """``signal`` (samples,) with straight lines where its spikes were, and without their tails."""
    plain = _lined(signal)
    answer = _ringing(signal)
    if not len(answer):
        return plain
    # What no spike before foretells is the spikes themselves, which are sharp; what is beside them
    # stays as it is, since an error there would have a tail of its own.
    news = lfilter(answer, [1.0], signal - signal[0])
    usual = median_filter(news, NEWS)
    far = np.abs(news - usual)
    sudden = far > max(SPIKES_MORE * 1.4826 * float(np.median(far)), 1.0)
    tailless = lfilter([1.0], answer, np.where(sudden, usual, news))
    several = [plain, _lined(signal[0] + tailless), _lined(_struck(signal))]
    return min(several, key=np.var)


def _plain(signal: Floats) -> Floats:
    """``signal`` (samples,) where a tone may be: without its spikes, which are no burst of one."""
    hit = _spikes(signal)
    return signal if hit.any() and _in_bursts(signal, hit) else _unspiked(signal)


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
    hits = np.flatnonzero(_spikes(signal))
    hits = hits[(hits > BEFORE + 1) & (hits < len(signal) - TAIL - 1)]
    jump = np.abs(np.diff(signal, prepend=signal[0]))
    groups = np.split(hits, np.flatnonzero(np.diff(hits) > BEFORE) + 1)
    # The largest jump may be beside those that are far from all around them.
    spans = [np.arange(g[0] - 1, g[-1] + 2) for g in groups if len(g)]
    return np.array([span[np.argmax(jump[span])] for span in spans], dtype=np.intp)


def _lined(signal: Floats) -> Floats:
    """``signal`` (samples,) with straight lines where its spikes were, and close to them."""
    return _between(signal, np.convolve(_spikes(signal), np.ones(5), "same") > 0)


def _between(signal: Floats, hit: NDArray[np.bool_]) -> Floats:
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
    return answer if np.abs(np.roots(answer)).max() < SPIKE_FADES else np.zeros(0)


def _ringing(signal: Floats) -> Floats:
    """The same of what spikes in ``signal`` (samples,) leave behind, or nothing where they are
    sharp. Where they are too many for their shape to be seen, all samples say what follows one."""
    answer = _answer(_shape(signal))
    if len(answer):
        return answer
    held = signal - signal.mean()
    past = np.stack([held[RINGS - k : -k] for k in range(1, RINGS + 1)], axis=1)
    answer = np.array([1.0, *-np.linalg.lstsq(past, held[RINGS:])[0]])
    below = np.flatnonzero(lfilter([1.0], answer, np.eye(1, TAIL)[0]) < -TAIL_END)
    swings = len(below) > 0 and below[0] > TAIL_TURN
    if np.abs(np.roots(answer)).max() > SPIKE_FADES or swings:
        return np.zeros(0)
    news = lfilter(answer, [1.0], held)
    rings = kurtosis(news) > RINGING and _spikes(news).sum() >= MANY * SPIKE_COUNT
    return answer if rings else np.zeros(0)


def _sudden(signal: Floats) -> NDArray[np.bool_]:
    """(samples,) whether there is a spike, or one begins that rings."""
    hit = _spikes(signal)
    if hit.any() and _in_bursts(signal, hit):
        return np.zeros(len(hit), dtype=bool)
    answer = np.zeros(0) if hit.any() else _ringing(signal)
    return _spikes(lfilter(answer, [1.0], signal - signal[0])) if len(answer) else hit


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


def _turns(frequency: Floats | float, samples: int, dt_s: float) -> Complex:
    """(samples,) a wave of size 1 and a ``frequency`` in Hz, one or (samples,)."""
    turned = np.cumsum(np.broadcast_to(frequency, samples)) * dt_s
    return np.asarray(np.exp(2j * np.pi * turned))


def _size(signal: Floats, turns: Complex, dt_s: float, window_s: float, on: Floats) -> Complex:
    """(samples,) half the size and phase that a wave of these ``turns`` (samples,) has in
    ``signal``, averaged over ``window_s`` while it is ``on`` (samples,) 0 or 1; else 0."""
    window = np.hanning(round(window_s / dt_s) + 2)[: len(signal)]
    weight = np.where(on > 0.0, oaconvolve(on, window, "same"), np.inf)
    mixed = (signal - signal.mean()) * turns.conj()
    size: Complex = oaconvolve(mixed * on, window, "same") / weight
    return size


def _wave(signal: Floats, turns: Complex, dt_s: float, window_s: float, on: Floats) -> Floats:
    """What ``signal`` has of such a wave, size and phase wandering slowly: mixed down to 0 Hz,
    averaged, and mixed up again."""
    wave: Floats = 2.0 * (_size(signal, turns, dt_s, window_s, on) * turns).real
    return wave


def _switched(signal: Floats, frequency: float, dt_s: float) -> tuple[Floats, int]:
    """(samples,) 1 while a tone of ``frequency`` (Hz) is on and else 0, and how often it is
    switched."""
    window_s = max(SWITCH_S, SWITCH_PERIODS / frequency)
    turns = _turns(frequency, len(signal), dt_s)
    size = np.abs(_size(signal, turns, dt_s, window_s, np.ones(len(signal))))
    on = size > 0.5 * np.quantile(size, 0.9)
    edges = np.flatnonzero(np.diff(on)) + 1
    if not len(edges):
        return np.ones(len(signal)), 0
    tone = _while_on(signal, frequency, dt_s, edges, on[0], window_s)
    # The instants themselves: by what fits either side better, beside what is slow.
    window = np.hanning(round(window_s / dt_s) + 2)
    fast = signal - np.convolve(signal - on * tone, window / window.sum(), "same")
    better = np.cumsum(fast**2 - (fast - tone) ** 2)
    reach = round(0.5 * window_s / dt_s)
    for number, edge in enumerate(edges.tolist()):
        low, high = max(edge - reach, 1), min(edge + reach, len(on) - 1)
        near = better[low - 1 : high]
        edges[number] = low + int(np.argmin(near) if on[edge] else np.argmax(near))
    crossed = np.searchsorted(edges, np.arange(len(signal)), side="right")
    return ((crossed + on[0]) % 2).astype(np.float64), len(edges)


def _while_on(
    signal: Floats,
    frequency: float,
    dt_s: float,
    edges: NDArray[np.intp],
    first: bool,
    more_s: float,
) -> Floats:
    """(samples,) the tone between every other two of ``edges``, and ``more_s`` to either side.

    Its size and phase are fitted to each time, and how they change in it.
    """
    tone = np.zeros(len(signal))
    more = round(more_s / dt_s)
    ends = [0, *edges, len(signal)]
    for begin, end in list(pairwise(ends))[0 if first else 1 :: 2]:
        k = np.arange(begin, end)
        if len(k) < 8:
            continue
        wide = np.arange(max(begin - more // 2, 0), min(end + more // 2, len(signal)))
        u = (wide - begin) / len(k) - 0.5
        powers = u[:, None] ** np.arange(3 if len(k) * dt_s * frequency > 10.0 else 1)
        turns = 2.0 * np.pi * frequency * dt_s * wide
        waves = np.concatenate([powers * wave(turns)[:, None] for wave in (np.cos, np.sin)], 1)
        inside = slice(begin - wide[0], end - wide[0])
        basis = np.concatenate([waves, u[:, None] ** np.arange(2)], 1)[inside]
        weights = np.linalg.lstsq(basis, signal[begin:end])[0]
        tone[wide] = waves @ weights[: waves.shape[1]]
    return tone


def _off(signal: Floats, frequency: float, dt_s: float) -> NDArray[np.bool_]:
    """(samples,) whether a tone of ``frequency`` (Hz) in ``signal`` is off, and was for a while; or
    everywhere where it is on nearly all the time. Spikes in it would switch it on."""
    on, times = _switched(signal, frequency, dt_s)
    off: NDArray[np.bool_] = maximum_filter1d(on, FADES) == 0.0
    return off if times and off.mean() > LEAST_OFF else np.ones(len(on), dtype=bool)


def _only_while_on(hit: NDArray[np.bool_], off: NDArray[np.bool_]) -> bool:
    """Whether samples are ``hit`` only while a tone is not ``off``: such are what is left of its
    pulses, or of how it fades."""
    return bool((hit & off).sum() < WHILE_OFF * float(off.mean()) * hit.sum())


def _without_tone(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """The same with the spikes that ``signal`` (samples,) has: they are no part of a tone, unless
    it comes in pulses."""
    plain = _unspiked(signal)
    toneless = _toneless(plain, frequency, dt_s) + signal - plain
    if np.array_equal(plain, signal):
        return toneless
    return min(_toneless(signal, frequency, dt_s), toneless, key=np.var)


def _toneless(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """``signal`` without the tone of ``frequency`` (Hz), and without its harmonics, which fold."""
    moving = _moving(signal, dt_s, 0.5 * frequency)
    courses: list[Floats | float] = [frequency]
    if moving is not None and np.abs(moving - frequency).min() < SAME_HZ:
        courses.append(moving)
    always, switched = (np.ones(len(signal)), 0), _switched(signal, frequency, dt_s)
    made = []
    for on, times in [always, switched] if switched[1] else [always]:
        for turns in (_turns(course, len(signal), dt_s) for course in courses):
            as_waves = []
            for window_s in TONES_S:
                if window_s * frequency < TONE_PERIODS:
                    continue
                rest = signal
                for _ in range(TWICING):
                    rest = rest - _wave(rest, turns, dt_s, window_s, on)
                wave = signal - rest
                rest, waves = _without_harmonics(rest, wave, frequency, dt_s, window_s, on)
                changes = TONE_PRICE * dt_s / window_s + SWITCH_PRICE * times / len(signal)
                as_waves.append((_left_of(rest, changes * waves), rest))
            made += as_waves
            if not as_waves or as_waves[0] is not min(as_waves, key=lambda one: one[0]):
                continue
            # It keeps time: all its harmonics at once. What is slow would fold, too.
            slow = uniform_filter1d(as_waves[0][1], SLOWER)
            if np.var(slow) < np.var(signal - as_waves[0][1]):
                rest = slow + _folded(signal - slow, turns, dt_s, on)
                changes = (SWITCH_PRICE * times + TONE_PRICE) / len(signal) + 2.0 / FOLD
                made.append((_left_of(rest, changes), rest))
    return min(made, key=lambda one: one[0])[1]


def _left_of(rest: Floats, changes: float) -> float:
    """Variance of ``rest`` (samples,) with a price for a tone's ``changes``, in noise variances,
    and for what is still sharp."""
    # Spikes, which a tone hid, are no reason for a shorter time.
    plain = _unspiked(rest)
    noise = float(noise_rms(plain[:, None])[0])
    sharp = SHARP_PRICE * float(_spikes(rest).mean())
    return float(np.var(plain)) + (changes + sharp) * noise**2


def _folded(signal: Floats, turns: Complex, dt_s: float, on: Floats) -> Floats:
    """``signal`` without what comes again with each of the ``turns`` (samples,) while it is ``on``,
    whatever its shape: the median of what is at nearly the same phase."""
    size = _size(signal, turns, dt_s, TONES_S[0], on)
    times = np.arange(len(signal))
    late = np.polyval(np.polyfit(times, np.unwrap(np.angle(size)), 1, w=on), times)
    order = np.argsort((np.angle(turns) + late) % (2.0 * np.pi))
    order = order[on[order] > 0.0]
    there, rest = signal[order], signal.copy()
    shape = median_filter(there, FOLD, mode="wrap")
    # At an edge a sample is of the side that it is closer to: nobody knows the phase so well.
    low, high = (each(shape, EDGE, mode="wrap") for each in (minimum_filter1d, maximum_filter1d))
    edge = high - low > SPIKE_SIGMA * 1.4826 * float(np.median(np.abs(there - shape)))
    side = np.where(there - low < high - there, low, high)
    rest[order] -= np.where(edge, side, shape) - shape.mean()
    return rest


def _without_harmonics(
    rest: Floats, wave: Floats, frequency: float, dt_s: float, window_s: float, on: Floats
) -> tuple[Floats, int]:
    """``rest`` without the harmonics of a tone ``wave`` (samples,) of ``frequency`` (Hz) that is
    ``on`` or off, and how many waves that are, the tone among them."""
    tone = float(np.var(wave))
    turns = _turns(frequency, len(rest), dt_s)
    turned = np.unwrap(np.angle(_size(wave, turns, dt_s, window_s, on) * turns))
    away = np.abs(np.fft.fftfreq(len(rest), dt_s))
    last = waves = 1
    for harmonic in range(2, HARMONICS + 1):
        folded = abs((harmonic * frequency * dt_s + 0.5) % 1.0 - 0.5) / dt_s
        close = harmonic <= last + 2
        if folded < SLOWEST_HZ or not (close or harmonic <= LOW_HARMONIC):
            continue
        over_s = max(window_s, 4.0 / folded)
        # Its phase goes as the tone's does.
        along = np.exp(1j * harmonic * turned)
        power = 2.0 * np.abs(np.fft.fft((rest - rest.mean()) * along.conj())) ** 2 / len(rest) ** 2
        within = power[away <= 0.75 / over_s]
        chance = len(within) * float(np.median(power[away < AROUND_HZ])) / np.log(2.0)
        # What is as slow as the tone changes is motion, unless it is sharp.
        usual = close and over_s == window_s and within.sum() < HARMONIC_MOST * tone / harmonic**2
        if within.sum() > HARMONIC_RATIO * chance and (
            usual or (harmonic <= LOW_HARMONIC and _sharp(rest, folded, dt_s))
        ):
            rest = rest - _wave(rest, along, dt_s, over_s, on)
            last, waves = harmonic, waves + 1
    return rest, waves


def _fast(signal: Floats) -> Floats:
    """(samples,) how far each sample is from the mean of those around it."""
    far: Floats = np.abs(signal - np.convolve(signal, np.ones(5) / 5, "same"))
    return far


def _sharp(signal: Floats, frequency: float, dt_s: float) -> bool:
    """Whether ``signal`` has a line of a few bins' width at ``frequency`` (Hz)."""
    power, at, floor = _spectrum(signal, dt_s, min(LEAST_HZ, 0.5 * frequency))
    near = np.abs(at - frequency) < 2.0 / (len(signal) * dt_s)
    return bool(near.any()) and float((power[near] / floor[near]).max()) > SHARP_RATIO


def _spikes(left: Floats) -> NDArray[np.bool_]:
    """(samples,) whether a sample is far more than the usual distance from its neighbours.

    None where many more are half as far: that is noise with heavy tails.
    """
    fast = _fast(left)
    scale = max(1.4826 * float(np.median(fast)), 0.5)
    hit: NDArray[np.bool_] = fast > SPIKE_SIGMA * scale
    many = hit.sum() > SPIKE_MOST * len(hit)
    if many or hit.sum() < SPIKE_PART * (fast > 0.5 * SPIKE_SIGMA * scale).sum():
        hit[:] = False
    return hit


def _in_bursts(left: Floats, hit: NDArray[np.bool_]) -> bool:
    """Whether what is around most samples that are ``hit`` is as far off: that is noise, or a tone,
    in bursts. Spikes that come in bursts have calm samples between them."""
    off = np.abs(left - median_filter(left, BURST))
    usual = 1.4826 * median_filter(off, BURST)[hit]
    # The neighbours of a spike are far from it.
    alone = maximum_filter1d(off, 3)[hit] > BURST_SIGMA * usual
    return bool(alone.sum() < ALONE_PART * hit.sum())


def _lone(signal: Floats) -> bool:
    """Whether a sample of ``signal`` (samples,) is so far off that one such is enough."""
    middle = 0.5 * (signal[:-2] + signal[2:])
    far = np.abs(signal[1:-1] - middle)
    back = np.abs(signal[2:] - signal[:-2]) < LONE_BACK * far
    scale = max(1.4826 * float(np.median(far)), 0.5)
    return bool(np.any(far[back] > LONE_SIGMA * scale))


def _stands_out(left: Floats, hit: NDArray[np.bool_]) -> int:
    """How many samples that are ``hit`` are far from their neighbours for where they are."""
    fast = _fast(left)
    usual = 1.4826 * median_filter(fast, SPIKE_AROUND)
    return int((fast[hit] > SPIKE_SIGMA * usual[hit]).sum())


def _moves(left: Floats, motion: Motion, frequency: float) -> bool:
    """Whether ``left`` has a line at ``frequency`` (Hz) as it has others that the motion makes."""
    power, at, _ = _spectrum(left, motion.dt_s)
    near = np.abs(at - frequency) < SAME_HZ
    rate = np.gradient(motion.strain)
    for signal in (motion.strain, motion.strain**2, motion.strain**3, rate**2, np.abs(rate)):
        cause = _spectrum(signal, motion.dt_s)[0]
        others = np.argsort(np.where(near, 0.0, cause))[-MOTION_LINES:]
        usual = float((power[others] / cause[others]).max())
        if power[near].max() < BEYOND_MOTION * usual * cause[near].max():
            return True
    return False


def _spectrum(
    signal: Floats, dt_s: float, slowest: float = LEAST_HZ
) -> tuple[Floats, Floats, Floats]:
    """(frequencies,) power, hertz above ``slowest``, and the power of what surrounds them."""
    power: Floats = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
    frequency: Floats = np.fft.rfftfreq(len(signal), dt_s).astype(np.float64)
    keep = frequency > slowest
    power, frequency = power[keep], frequency[keep]
    half = 60
    padded = np.pad(power, half, mode="reflect")
    local = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)[::8], axis=1)
    floor: Floats = np.repeat(local, 8)[: len(power)] / np.log(2.0)
    return power, frequency, floor


def _moving(signal: Floats, dt_s: float, slowest: float) -> Floats | None:
    """(samples,) the frequency (Hz) of a tone that moves, above ``slowest`` all along, or None."""
    length = round(FRAME_S / dt_s)
    if len(signal) < 4 * length:
        return None
    begins = np.arange(0, len(signal) - length + 1, length // 4)
    few = begins[:: max(len(begins) // FRAMES, 1)]
    # Of a long recording some frames tell whether there may be a tone.
    for some in [few, begins] if len(few) < len(begins) else [begins]:
        frames = [_spectrum(signal[k : k + length], dt_s, slowest) for k in some]
        # A frame in which nothing is left has no floor.
        ratios = np.stack([power / np.maximum(floor, 1e-12) for power, _, floor in frames])
        lit = np.flatnonzero(ratios.max(axis=1) > LIT_RATIO)
        if len(lit) < LIT_PART * len(some):
            return None
    at, peaks = frames[0][1], np.argmax(ratios, axis=1)
    # What is far from its neighbours is another line, or chance.
    usual = np.array([np.median(peaks[lit[max(k - 4, 0) : k + 5]]) for k in range(len(lit))])
    lit = lit[np.abs(peaks[lit] - usual) <= 2 * FRAME_STEP]
    steps = np.abs(np.diff(peaks[lit])) / np.diff(lit)
    if len(lit) < LIT_PART * len(begins) or np.mean(steps > FRAME_STEP) > 0.1:
        return None
    course = np.polynomial.Polynomial.fit(begins[lit] + 0.5 * length, at[peaks[lit]], COURSE_ORDER)
    within = np.clip(np.arange(len(signal)), begins[lit[0]], begins[lit[-1]] + length)
    frequency: Floats = course(within)
    return frequency


def _hump(signal: Floats, dt_s: float, slowest: float) -> float | None:
    """Frequency (Hz) of what stands out from both sides of it, though no line is sharp there."""
    length = round(HUMP_S / dt_s)
    if len(signal) < 4 * length:
        return None
    at, power = welch(signal, fs=1.0 / dt_s, nperseg=length)
    peak = int(np.argmax(np.where(at > max(slowest, HUMP_HZ), power, 0.0)))
    away = at - at[peak]
    near, far = ASIDE_HZ
    sides = [power[(way * away > near) & (way * away < far)] for way in (-1.0, 1.0)]
    # There is none beyond half the rate.
    floors = [float(np.median(side)) for side in sides if len(side) > 0.5 * (far - near) * HUMP_S]
    high = float(power[peak]) > HUMP_RATIO * max(floors, default=np.inf)
    return float(at[peak]) if high else None


def _line(left: Floats, dt_s: float, least: float, slowest: float = LEAST_HZ) -> float | None:
    """Frequency of a line far above its surroundings, and above ``least`` of the noise, in Hz.

    Above ``slowest``. Where it moves, it is the one in the middle.
    """
    if np.std(left) < 1.0 or 0.5 / dt_s <= slowest:
        return None
    window, some = np.hanning(len(left)), left[:STRETCH]
    power, frequency, floor = _spectrum(left, dt_s, slowest)
    # The largest of n exponential values is about log n: ask for far more than that, and for a
    # tone that is not lost in the noise beside it.
    peak = int(np.argmax(power / floor))
    if power[peak] <= floor[peak] * (LINE_RATIO + np.log(len(power))):
        moving = _moving(left, dt_s, slowest)
        hump = _hump(left, dt_s, slowest) if moving is None else float(np.median(moving))
        if hump is None:
            return None
        hertz = hump
        rest = _toneless(some, hertz, dt_s)
        tone = float(np.var(some) - np.var(rest))
    else:
        around = slice(max(peak - 3, 0), peak + 4)
        tone = float(power[around].sum()) * 2.0 / (float((window**2).sum()) * len(left))
        # Between two bins, by a parabola through the logarithms: many periods of a harmonic are
        # asked.
        below, top, above = np.log(power[np.clip([peak - 1, peak, peak + 1], 0, len(power) - 1)])
        bend = below - 2.0 * top + above
        part = 0.5 * (below - above) / bend if bend < 0.0 else 0.0
        hertz = float(frequency[peak] + part / (len(left) * dt_s))
        rest = _toneless(some, hertz, dt_s)
        # Of one that is off for most of the time little is in its line.
        tone = max(tone, float(np.var(some) - np.var(rest)))
    noise = float(noise_rms(rest[:, None])[0]) ** 2
    return hertz if tone > least * noise else None


def _apart(more: Mapping[int, float]) -> set[int]:
    """Channels that are louder than simulated by far ``more`` than most are, which agree."""
    least = min(more.values(), default=0.0)
    usual = {c for c, factor in more.items() if factor < AGREED * least}
    others = more.keys() - usual
    most = max((more[c] for c in usual), default=0.0)
    if len(usual) >= SIMULATED and least > 1.0 / RIGHT and most < RIGHT:
        return others if all(more[c] > BESIDE_RIGHT for c in others) else set()
    apart = all(more[c] > LONE_FACTOR * most for c in others)
    return others if apart and len(usual) >= max(AGREEING, len(others) + 1) else set()


def _still(left: Floats, motion: Motion) -> float:
    """The noise while the strain hardly moves."""
    third = np.diff(left, 3) / np.sqrt(20.0)
    speed = np.abs(np.gradient(motion.strain))[1:-2]
    level: float = np.sqrt(np.mean(third[speed <= np.quantile(speed, STILL)] ** 2))
    return level


def _under_walk(signal: Floats) -> float:
    """Noise of ``signal`` (samples,) beside a random walk, whose moves are independent: one after
    the other they go against each other by what noise makes of both."""
    moves = np.diff(signal)
    return float(np.sqrt(max(-float(np.mean(moves[1:] * moves[:-1])), 0.0)))


def _between_lines(signal: Floats) -> float:
    """Noise of ``signal`` (samples,) from what most of its frequencies have: a tone that wanders
    leaves some of itself beside its line."""
    power = welch(signal, nperseg=min(PIECE, len(signal)))[1]
    # Up to half the rate, in cycles per sample.
    return float(np.sqrt(0.5 * np.median(power[1:-1])))


def _covariates(motion: Motion) -> list[Floats]:
    """(samples,) each of what noise may vary with: strain, and its rate."""
    return [motion.strain, np.abs(np.gradient(motion.strain))]


def _unevenness(left: Floats, along: Sequence[Floats]) -> float:
    """The factor by which the noise's power varies with any of ``along``, at most."""
    square = (np.diff(left, 2, append=[left[-1]] * 2) / np.sqrt(6.0)) ** 2
    most = 1.0
    for covariate in along:
        edges = np.quantile(covariate, [0.25, 0.75])
        quiet, loud = square[covariate <= edges[0]], square[covariate >= edges[1]]
        ratio = (loud.mean() + 0.05) / (quiet.mean() + 0.05)
        most = max(most, float(ratio), 1.0 / float(ratio))
    return most


def _tails(left: Floats) -> float:
    """Excess kurtosis of what is fast: noise that comes and goes has some."""
    return float(kurtosis(np.diff(left, 2)))


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


def noisy(walk: Floats) -> bool:
    """Whether what wanders is noise of some colour, which soon forgets where it was, does not swing
    and is Gaussian; or white noise in bursts, which is Gaussian for where it is."""
    held = walk - walk.mean()
    after = _echoes(held)
    if abs(after[FORGOTTEN:].mean()) > REMEMBERED or after.min() < -SWUNG:
        return False
    if abs(float(kurtosis(held))) < GAUSSIAN:
        return True
    scale = np.sqrt(uniform_filter1d(held**2, BURST))
    here = float(kurtosis(held / np.maximum(scale, 1e-12)))
    return abs(float(after[0])) < REMEMBERED and abs(here) < GAUSSIAN


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
    least = NOISE_LEFT * min(noises)
    slow, fast = np.maximum(np.subtract(ends(moves, along), noises), least).tolist()
    return float(fast / slow)


def _gaussian(values: Floats, most: float) -> bool:
    """Whether no more excess kurtosis than ``most`` is seen; of a few values none is."""
    return len(values) < FEW_MOVES or float(kurtosis(values)) <= most
