"""Tones in a signal: lines, what moves or is switched, harmonics, and the signal without them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d, uniform_filter1d
from scipy.signal import oaconvolve, periodogram

from softsense.diagnose.nominal import Motion, noise_rms
from softsense.diagnose.periods import BATCHES
from softsense.diagnose.spikes import (
    SPIKE_SIGMA,
    between,
    has_lone,
    peaks,
    spike_hits,
    without_spikes,
)

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# How far a line is above its surroundings.
LINE_RATIO = 18.0
# What is slower is motion.
LEAST_HZ = 0.3
# Lines of two channels are one within this.
SAME_HZ = 0.05
# So much stronger than by the motion's strongest lines is one that the motion does not make.
MOTION_LINES = 10
BEYOND_MOTION = 30.0
# Nor has any that is no more than this share of itself without what batches of readings make.
OF_BATCHES = 0.25
# So much of a long recording says how large a tone is beside the noise.
STRETCH = 32_768
# So many signals without their tones are kept, of no more samples than these: each is asked for
# again, to see if there are spikes too and what effects leave.
KEPT = 32
KEPT_SAMPLES = 2_000_000
# And for so many, when the tone is on, which is asked for again at once.
KEPT_ON = 4
# Over which a tone may keep its size and phase; a shorter time must explain so many noise variances
# for each time that they change. What does so within a few periods is no tone.
TONES_S = (20.0, 7.0, 2.5, 1.2)
TONE_PERIODS = 4.0
TONE_PRICE = 24.0
# A tone that keeps time, whatever its shape, needs no such time.
KEEPS_TIME = np.inf
# So many parts of a long recording say how a tone is seen best, each of so many of the longest of
# these times at least.
PARTS = 3
PART_TIMES = 3.0
# One that is as slow as the motion, between these frequencies, is a line of so large a share of all
# power, in so many bins to either side, that stands out by some factor from so many, where the
# motion makes none that stands out by another one. Over so long it keeps its size and phase.
SLOW_HZ = 0.05, 0.4
SLOW_SHARE = 0.2
LINE_BINS, AROUND_BINS = 3, 15
SLOW_RATIO, MOTION_RATIO = 30.0, 10.0
SLOW_S = 200.0
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
# So many of the frames are looked at before all, and about so many of a long recording are all.
FRAMES = 100
FRAMES_OF_LONG = 1000
# A tone whose phase wanders, or that is switched all the time, is a hump in the spectrum of pieces
# of so many seconds: by this factor above both sides, so far from it, and above this frequency.
HUMP_S = 12.0
HUMP_RATIO = 8.0
HUMP_HZ = 1.5
ASIDE_HZ = 0.5, 1.5
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
# And so often are spikes looked for that it had hidden, each time smaller ones.
AGAIN = 3
# A tone that is switched on and off shows within so long and so many of its periods; an instant
# must explain so many noise variances, of each harmonic.
SWITCH_S = 1.5
SWITCH_PERIODS = 3.0
SWITCH_PRICE = 12.0
# So many samples about each such instant it is neither: it fades in and out.
FADES = 12
# Samples of a spectrum in whose middle lines do not show.
PIECE = 256
# And the part of its frequencies that is beside a tone and its harmonics; so much of what is there
# is noise, for short pulses are everywhere.
QUIET_PART = 0.25
OF_NOISE = 0.6
# The part of all samples that says how loud it is without the tone.
LEAST_OFF = 0.1
# Spikes are there while it is off, too: no less often than this part of what chance would have.
WHILE_OFF = 0.4


def _turns(frequency: Floats | float, samples: int, dt_s: float) -> Complex:
    """(samples,) a wave of size 1 and a ``frequency`` in Hz, one or (samples,)."""
    turned = np.cumsum(np.broadcast_to(frequency, samples)) * dt_s
    return np.asarray(np.exp(2j * np.pi * turned))


class _While:
    """While a tone is ``on``: (samples,) 0 or 1."""

    def __init__(self, on: Floats) -> None:
        self.on = on
        self._weights: dict[int, Floats] = {}

    def mean(self, values: Complex, samples: int) -> Complex:
        """(samples,) ``values`` averaged over so many about each while it is on; else 0."""
        window = np.hanning(samples + 2)[: len(values)]
        if samples not in self._weights:
            there = oaconvolve(self.on, window, "same")
            self._weights[samples] = np.where(self.on > 0.0, there, np.inf)
        mean: Complex = oaconvolve(values * self.on, window, "same") / self._weights[samples]
        return mean


def _size(signal: Floats, turns: Complex, dt_s: float, window_s: float, on: _While) -> Complex:
    """(samples,) half the size and phase that a wave of these ``turns`` (samples,) has in
    ``signal``, averaged over ``window_s`` while it is ``on``; else 0."""
    return on.mean((signal - signal.mean()) * turns.conj(), round(window_s / dt_s))


def _wave(signal: Floats, turns: Complex, dt_s: float, window_s: float, on: _While) -> Floats:
    """What ``signal`` has of such a wave, size and phase wandering slowly: mixed down to 0 Hz,
    averaged, and mixed up again."""
    wave: Floats = 2.0 * (_size(signal, turns, dt_s, window_s, on) * turns).real
    return wave


def _switched(signal: Floats, frequency: float, dt_s: float) -> tuple[Floats, int]:
    """(samples,) 1 while a tone of ``frequency`` (Hz) is on and else 0, and how often it is
    switched."""
    if len(signal) > KEPT_SAMPLES:
        return _while_loud(signal, frequency, dt_s)
    return _kept_on(signal.tobytes(), frequency, dt_s)


@lru_cache(maxsize=KEPT_ON)
def _kept_on(samples: bytes, frequency: float, dt_s: float) -> tuple[Floats, int]:
    on, times = _while_loud(np.frombuffer(samples), frequency, dt_s)
    on.flags.writeable = False
    return on, times


def _while_loud(signal: Floats, frequency: float, dt_s: float) -> tuple[Floats, int]:
    """The same, made now: about when the tone has half its size, and then to the sample."""
    window_s = max(SWITCH_S, SWITCH_PERIODS / frequency)
    turns = _turns(frequency, len(signal), dt_s)
    size = np.abs(_size(signal, turns, dt_s, window_s, _While(np.ones(len(signal)))))
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
        # By the normal equations: of so few waves they are well conditioned.
        weights = np.linalg.lstsq(basis.T @ basis, basis.T @ signal[begin:end])[0]
        tone[wide] = waves @ weights[: waves.shape[1]]
    return tone


def while_off(signal: Floats, frequency: float, dt_s: float) -> NDArray[np.bool_]:
    """(samples,) whether a tone of ``frequency`` (Hz) in ``signal`` is off, and was for a while; or
    everywhere where it is on nearly all the time. Spikes in it would switch it on."""
    on, times = _switched(signal, frequency, dt_s)
    off: NDArray[np.bool_] = maximum_filter1d(on, FADES) == 0.0
    return off if times and off.mean() > LEAST_OFF else np.ones(len(on), dtype=bool)


def only_while_on(hit: NDArray[np.bool_], off: NDArray[np.bool_]) -> bool:
    """Whether samples are ``hit`` only while a tone is not ``off``: such are what is left of its
    pulses, or of how it fades."""
    return bool((hit & off).sum() < WHILE_OFF * float(off.mean()) * hit.sum())


def without_tone(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """The same with the spikes that ``signal`` (samples,) has: they are no part of a tone, unless
    it comes in pulses."""
    plain = without_spikes(signal)
    rest = _toneless(plain, frequency, dt_s) + signal - plain
    if not np.array_equal(plain, signal):
        rest = min(_toneless(signal, frequency, dt_s), rest, key=np.var)
    hit = np.zeros(len(signal), dtype=bool)
    for _ in range(AGAIN if has_lone(rest) else 0):
        # Those that it had hidden have left traces in it.
        more = peaks(between(rest, hit))
        if not more.any():
            break
        hit |= more
        hidden = rest - between(rest, hit)
        rest = _toneless(signal - hidden, frequency, dt_s) + hidden
    return rest


def _toneless(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """``signal`` without the tone of ``frequency`` (Hz), and without its harmonics, which fold."""
    if len(signal) > KEPT_SAMPLES:
        return _apart(signal, frequency, dt_s)
    return _kept(signal.tobytes(), frequency, dt_s)


@lru_cache(maxsize=KEPT)
def _kept(samples: bytes, frequency: float, dt_s: float) -> Floats:
    rest = _apart(np.frombuffer(samples), frequency, dt_s)
    rest.flags.writeable = False
    return rest


def _apart(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """The same, made now: whatever way to see the tone leaves least. Of a long recording parts say
    which that is."""
    moving = _moving(signal, dt_s, 0.5 * frequency)
    courses: list[Floats | float] = [frequency]
    if moving is not None and np.abs(moving - frequency).min() < SAME_HZ:
        courses.append(moving)
    always, switched = (np.ones(len(signal)), 0), _switched(signal, frequency, dt_s)
    given = [
        (_While(on), SWITCH_PRICE * times, _turns(course, len(signal), dt_s))
        for on, times in ([always, switched] if switched[1] else [always])
        for course in courses
    ]
    # What wanders has as much beside a slow one.
    slow = frequency < SLOW_HZ[1]
    windows = [SLOW_S] if slow else [each for each in TONES_S if each * frequency >= TONE_PERIODS]
    parts = _parts(len(signal), round(PART_TIMES * TONES_S[0] / dt_s))
    if parts is None:
        whole = [_seen(signal, *one, len(signal), frequency, dt_s, windows) for one in given]
        return min((way for ways in whole for way in ways.values()), key=lambda way: way[0])[1]
    costs: dict[tuple[int, float], list[float]] = {}
    for number, (on, price, turns) in enumerate(given):
        for part in parts:
            there = _While(on.on[part]), price, turns[part], len(signal), frequency, dt_s, windows
            for kind, (cost, _) in _seen(signal[part], *there).items():
                costs.setdefault((number, kind), []).append(cost)
    number, kind = min(costs, key=lambda way: (-len(costs[way]), sum(costs[way])))
    alone = _seen(signal, *given[number], len(signal), frequency, dt_s, windows, kind)
    return min(alone.values(), key=lambda way: way[0])[1]


def _parts(samples: int, least: int) -> list[slice] | None:
    """``PARTS`` stretches of a long recording, of ``least`` samples at least; None of others."""
    length = max(STRETCH // 4, least)
    if samples <= max(STRETCH, PARTS * length):
        return None
    begins = np.linspace(0, samples - length, PARTS).astype(int).tolist()
    return [slice(begin, begin + length) for begin in begins]


def _seen(
    signal: Floats,
    on: _While,
    price: float,
    turns: Complex,
    samples: int,
    frequency: float,
    dt_s: float,
    windows: Sequence[float],
    only: float | None = None,
) -> dict[float, tuple[float, Floats]]:
    """What a tone with these ``turns`` (samples,) leaves of ``signal`` while it is ``on``, and what
    that costs: by the window (s) in which it may change, of ``windows``, or ``KEEPS_TIME``.

    ``price``: of the instants that switch it, in a recording of so many ``samples``. ``only``: one
    of these ways.
    """
    seen: dict[float, tuple[float, Floats]] = {}
    least = OF_NOISE * between_lines(signal, QUIET_PART)
    steady = only is None or only == KEEPS_TIME
    tried = windows if only is None else windows[:1] if steady else [only]
    for window_s in tried:
        rest = signal
        for _ in range(TWICING):
            rest = rest - _wave(rest, turns, dt_s, window_s, on)
        wave = signal - rest
        rest, waves = _without_harmonics(rest, wave, frequency, dt_s, window_s, on)
        changes = TONE_PRICE * dt_s / window_s + price / samples
        seen[window_s] = _left_of(rest, changes * waves, least), rest
    if not steady or min(seen, key=lambda kind: seen[kind][0]) != windows[0]:
        return seen
    # It keeps time: all its harmonics at once. What is slow would fold, too.
    rest = seen[windows[0]][1]
    slow = uniform_filter1d(rest, SLOWER)
    if np.var(slow) < np.var(signal - rest):
        rest = slow + _folded(signal - slow, turns, dt_s, windows[0], on)
        changes = (price + TONE_PRICE) / samples + 2.0 / FOLD
        seen[KEEPS_TIME] = _left_of(rest, changes, least), rest
    return seen


def _left_of(rest: Floats, changes: float, least: float) -> float:
    """Variance of ``rest`` (samples,) with a price for a tone's ``changes``, in noise variances,
    and for what is still sharp; ``least``: noise that there is, whatever else went with it."""
    # Spikes, which a tone hid, are no reason for a shorter time.
    plain = without_spikes(rest)
    noise = max(float(noise_rms(plain[:, None])[0]), least)
    sharp = SHARP_PRICE * float(spike_hits(rest).mean())
    return float(np.var(plain)) + (changes + sharp) * noise**2


def _folded(signal: Floats, turns: Complex, dt_s: float, window_s: float, on: _While) -> Floats:
    """``signal`` without what comes again with each of the ``turns`` (samples,) while it is ``on``,
    whatever its shape: the median of what is at nearly the same phase."""
    size = _size(signal, turns, dt_s, window_s, on)
    times = np.arange(len(signal))
    late = np.polyval(np.polyfit(times, np.unwrap(np.angle(size)), 1, w=on.on), times)
    order = np.argsort((np.angle(turns) + late) % (2.0 * np.pi))
    order = order[on.on[order] > 0.0]
    there, rest = signal[order], signal.copy()
    shape = median_filter(there, FOLD, mode="wrap")
    # At an edge a sample is of the side that it is closer to: nobody knows the phase so well.
    low, high = (each(shape, EDGE, mode="wrap") for each in (minimum_filter1d, maximum_filter1d))
    edge = high - low > SPIKE_SIGMA * 1.4826 * float(np.median(np.abs(there - shape)))
    side = np.where(there - low < high - there, low, high)
    rest[order] -= np.where(edge, side, shape) - shape.mean()
    return rest


def _without_harmonics(
    rest: Floats, wave: Floats, frequency: float, dt_s: float, window_s: float, on: _While
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


def _sharp(signal: Floats, frequency: float, dt_s: float) -> bool:
    """Whether ``signal`` has a line of a few bins' width at ``frequency`` (Hz)."""
    power, at, floor = _spectrum(signal, dt_s, min(LEAST_HZ, 0.5 * frequency))
    near = np.abs(at - frequency) < 2.0 / (len(signal) * dt_s)
    return bool(near.any()) and float((power[near] / floor[near]).max()) > SHARP_RATIO


def made_by_motion(left: Floats, motion: Motion, frequency: float) -> bool:
    """Whether ``left`` has a line at ``frequency`` (Hz) as it has others that the motion makes."""
    (power,), at = _powers(left[None], motion.dt_s)
    near = np.abs(at - frequency) < SAME_HZ
    for signal in _causes(motion):
        cause = _powers(signal[None], motion.dt_s)[0][0]
        others = np.argsort(np.where(near, 0.0, cause))[-MOTION_LINES:]
        usual = float((power[others] / cause[others]).max())
        if power[near].max() < BEYOND_MOTION * usual * cause[near].max():
            return True
    there = float(power[near].max())
    return any(
        float(_powers(rest[None], motion.dt_s)[0][0][near].max()) < OF_BATCHES * there
        for rest in _without_batches(left, motion, frequency)
    )


def _without_batches(left: Floats, motion: Motion, frequency: float) -> Iterator[Floats]:
    """``left`` (samples,) without what goes with the strain rate at a place in each batch, by ways
    to send readings in batches that make lines near ``frequency`` (Hz)."""
    rate, count = np.gradient(motion.strain), np.arange(len(left))
    moves = np.stack([rate, rate * motion.strain])
    for share in {Fraction(line, size) for size in BATCHES for line in range(1, size // 2 + 1)}:
        if abs(float(share) / motion.dt_s - frequency) < AROUND_HZ:
            turns = 2.0 * np.pi * (count * share.numerator % share.denominator) / share.denominator
            columns = np.concatenate([moves * np.cos(turns), moves * np.sin(turns)])
            gram = columns @ columns.T
            ridge = 1e-9 * np.trace(gram) * np.eye(len(gram))
            yield left - np.linalg.solve(gram + ridge, columns @ left) @ columns


def _causes(motion: Motion) -> tuple[Floats, ...]:
    """(samples,) each of what the motion makes lines by."""
    strain, rate = motion.strain, np.gradient(motion.strain)
    return strain, strain**2, strain**3, rate**2, np.abs(rate)


def slow_line(signal: Floats, motion: Motion, least: float = SLOW_SHARE) -> float | None:
    """Frequency (Hz) of a line of ``SLOW_HZ`` that has ``least`` of all power, and is none of the
    motion's; what has too few periods for neighbours on both sides may be a drift."""
    slowest, fastest = SLOW_HZ
    (power,), at = _powers(signal[None], motion.dt_s, 0.0)
    there = np.flatnonzero((at > slowest) & (at < fastest))
    there = there[there >= AROUND_BINS]
    if not len(there):
        return None
    peak = int(there[np.argmax(power[there])])
    line = slice(peak - LINE_BINS, peak + LINE_BINS + 1)
    if power[line].sum() <= least * power.sum() or _stands(power, peak) <= SLOW_RATIO:
        return None
    for cause in _causes(motion):
        if _stands(_powers(cause[None], motion.dt_s, 0.0)[0][0], peak) > MOTION_RATIO:
            return None
    return float((power[line] * at[line]).sum() / power[line].sum())


def _stands(power: Floats, peak: int) -> float:
    """How many times the power about a ``peak`` of a spectrum is that of what surrounds it."""
    line = power[peak - LINE_BINS : peak + LINE_BINS + 1]
    around = power[peak - AROUND_BINS : peak + AROUND_BINS + 1]
    beside = (around.sum() - line.sum()) / max(len(around) - len(line), 1)
    return float(line.mean() / max(beside, 1e-12))


def _spectrum(
    signal: Floats, dt_s: float, slowest: float = LEAST_HZ
) -> tuple[Floats, Floats, Floats]:
    """(frequencies,) power, hertz above ``slowest``, and the power of what surrounds them."""
    powers, frequency, floors = _spectra(signal[None], dt_s, slowest)
    return powers[0], frequency, floors[0]


def _powers(signals: Floats, dt_s: float, slowest: float = LEAST_HZ) -> tuple[Floats, Floats]:
    """(n, frequencies) power of ``signals`` (n, samples), and hertz above ``slowest``."""
    window = np.hanning(signals.shape[1])
    spectra = np.fft.rfft((signals - signals.mean(axis=1, keepdims=True)) * window)
    frequency: Floats = np.fft.rfftfreq(signals.shape[1], dt_s).astype(np.float64)
    keep = frequency > slowest
    return np.abs(spectra[:, keep]) ** 2, frequency[keep]


def _spectra(signals: Floats, dt_s: float, slowest: float) -> tuple[Floats, Floats, Floats]:
    """The same with what surrounds them: powers and floors (n, frequencies)."""
    powers, frequency = _powers(signals, dt_s, slowest)
    half = 60
    padded = np.pad(powers, ((0, 0), (half, half)), mode="reflect")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=1)[:, ::8]
    floors: Floats = np.repeat(np.median(around, axis=2), 8, axis=1)[:, : len(frequency)]
    return powers, frequency, floors / np.log(2.0)


def _moving(signal: Floats, dt_s: float, slowest: float) -> Floats | None:
    """(samples,) the frequency (Hz) of a tone that moves, above ``slowest`` all along, or None."""
    length = round(FRAME_S / dt_s)
    if len(signal) < 4 * length:
        return None
    begins = np.arange(0, len(signal) - length + 1, length // 4)
    begins = begins[:: max(len(begins) // FRAMES_OF_LONG, 1)]
    few = begins[:: max(len(begins) // FRAMES, 1)]
    # Of a long recording some frames tell whether there may be a tone.
    for some in [few, begins] if len(few) < len(begins) else [begins]:
        frames = np.lib.stride_tricks.sliding_window_view(signal, length)[some]
        spectra = [
            _spectra(frames[k : k + FRAMES], dt_s, slowest) for k in range(0, len(frames), FRAMES)
        ]
        # A frame in which nothing is left has no floor.
        ratios = np.concatenate([power / np.maximum(floor, 1e-12) for power, _, floor in spectra])
        lit = np.flatnonzero(ratios.max(axis=1) > LIT_RATIO)
        if len(lit) < LIT_PART * len(some):
            return None
    at, peaks = spectra[0][1], np.argmax(ratios, axis=1)
    # What is far from its neighbours is another line, or chance.
    beside = np.pad(peaks[lit].astype(np.float64), 4, constant_values=np.nan)
    usual = np.nanmedian(np.lib.stride_tricks.sliding_window_view(beside, 9), axis=1)
    lit = lit[np.abs(peaks[lit] - usual) <= 2 * FRAME_STEP]
    steps = np.abs(np.diff(peaks[lit])) / np.diff(lit)
    if len(lit) < LIT_PART * len(begins) or np.mean(steps > FRAME_STEP) > 0.1:
        return None
    course = np.polynomial.Polynomial.fit(begins[lit] + 0.5 * length, at[peaks[lit]], COURSE_ORDER)
    within = np.clip(np.arange(len(signal)), begins[lit[0]], begins[lit[-1]] + length)
    frequency: Floats = course(within)
    return frequency


def _mean_power(signal: Floats, length: int, dt_s: float) -> tuple[Floats, Floats]:
    """(frequencies,) hertz, and the mean power density of pieces of so many samples: as Welch's
    method has it, with all pieces at once."""
    pieces = np.lib.stride_tricks.sliding_window_view(signal, length)[:: length // 2]
    at, powers = periodogram(pieces, fs=1.0 / dt_s, window="hann")
    return at, powers.mean(axis=0)


def _hump(signal: Floats, dt_s: float, slowest: float) -> float | None:
    """Frequency (Hz) of what stands out from both sides of it, though no line is sharp there."""
    length = round(HUMP_S / dt_s)
    if len(signal) < 4 * length:
        return None
    at, power = _mean_power(signal, length, dt_s)
    peak = int(np.argmax(np.where(at > max(slowest, HUMP_HZ), power, 0.0)))
    away = at - at[peak]
    near, far = ASIDE_HZ
    sides = [power[(way * away > near) & (way * away < far)] for way in (-1.0, 1.0)]
    # There is none beyond half the rate.
    floors = [float(np.median(side)) for side in sides if len(side) > 0.5 * (far - near) * HUMP_S]
    high = float(power[peak]) > HUMP_RATIO * max(floors, default=np.inf)
    return float(at[peak]) if high else None


def line_of(left: Floats, dt_s: float, least: float, slowest: float = LEAST_HZ) -> float | None:
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
        # No finer than a tenth of a bin: channels that hear one tone shall agree.
        hertz = float(frequency[peak] + round(part, 1) / (len(left) * dt_s))
        rest = _toneless(some, hertz, dt_s)
        # Of one that is off for most of the time little is in its line.
        tone = max(tone, float(np.var(some) - np.var(rest)))
    # A second tone may be fast, and is no noise.
    noise = min(float(noise_rms(rest[:, None])[0]), between_lines(rest))
    return hertz if tone > least * noise**2 else None


def between_lines(signal: Floats, part: float = 0.5) -> float:
    """Noise of ``signal`` (samples,) from what its frequencies have, this ``part`` of them no more:
    a tone that wanders leaves some of itself beside its line."""
    power = _mean_power(signal, min(PIECE, len(signal)), 1.0)[1]
    # Up to half the rate, in cycles per sample.
    return float(np.sqrt(0.5 * np.quantile(power[1:-1], part)))
