"""Effects without a mean: noise, spikes, lines, and slow wandering, in what is left over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.nominal import Motion, noise_rms

Floats = NDArray[np.float64]

# Real and simulated noise differ anyway by up to this factor.
NOISE_FACTOR = 3.2
LINE_RATIO = 18.0
SPIKE_SIGMA = 7.0
SPIKE_COUNT = 6
WANDER_RATIO = 25.0


@dataclass(frozen=True)
class Finding:
    """A variance-type effect on ``channels``, with a number that says how strong it is."""

    name: str
    channels: tuple[int, ...]
    value: float
    what: str


def findings(left: Floats, sim: Floats, motion: Motion, explained: bool) -> list[Finding]:
    """Test the leftovers ``left`` (samples, channels) in codes.

    ``explained``: an effect has been taken out, whose form being only nearly right leaves edges
    and ripples: spikes and lines must then stand out more.
    """
    result = []
    enough = 3 * SPIKE_COUNT if explained else SPIKE_COUNT
    spiky = [c for c in range(left.shape[1]) if _spikes(left[:, c]) >= enough]
    if spiky:
        result.append(Finding("spikes", tuple(spiky), float(len(spiky)), "channels with spikes"))
    lines = {
        c: line
        for c in range(left.shape[1])
        if (line := _line(left[:, c], motion.dt_s, 2.0 if explained else 0.28)) is not None
    }
    lines = {c: line for c, line in lines.items() if c not in spiky}
    if lines:
        frequency = float(np.median(list(lines.values())))
        result.append(Finding("interference", tuple(lines), frequency, "frequency_hz"))
    slow = [
        c
        for c in range(left.shape[1])
        if c not in lines and c not in spiky and _wander(left[:, c]) > WANDER_RATIO
    ]
    if slow:
        result.append(Finding("random_walk", tuple(slow), float(len(slow)), "wandering channels"))
    own, other = noise_rms(left), noise_rms(sim)
    loud = [
        c
        for c in range(left.shape[1])
        if c not in spiky
        and c not in lines
        and (own[c] > NOISE_FACTOR * max(other[c], 1.0) or _uneven(left[:, c], motion))
    ]
    if loud:
        result.append(Finding("noise", tuple(loud), float(own[loud].max()), "rms_codes"))
    return result


def _spikes(left: Floats) -> int:
    """Samples far from their neighbours, in units of the local noise."""
    fast = left - np.convolve(left, np.ones(5) / 5, "same")
    scale = 1.4826 * float(np.median(np.abs(fast))) + 1e-9
    return int(np.sum(np.abs(fast) > SPIKE_SIGMA * max(scale, 0.5)))


def _line(left: Floats, dt_s: float, least: float) -> float | None:
    """Frequency of a line far above its surroundings, and above ``least`` of the noise, in Hz."""
    window = np.hanning(len(left))
    power = np.abs(np.fft.rfft((left - left.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(len(left), dt_s)
    keep = frequency > 0.3
    power, frequency = power[keep], frequency[keep]
    half = 60
    if np.std(left) < 1.0:
        return None
    padded = np.pad(power, half, mode="reflect")
    local = np.array([np.median(padded[i : i + 2 * half + 1]) for i in range(0, len(power), 8)])
    floor = np.repeat(local, 8)[: len(power)] / np.log(2.0)
    # The largest of n exponential values is about log n: ask for far more than that, and for a
    # tone that is itself as large as the noise.
    peak = int(np.argmax(power / floor))
    around = slice(max(peak - 3, 0), peak + 4)
    tone = float(power[around].sum()) * 2.0 / (float((window**2).sum()) * len(left))
    noise = float(noise_rms(left[:, None])[0]) ** 2
    strong = power[peak] / floor[peak] > LINE_RATIO + np.log(len(power)) and tone > least * noise
    return float(frequency[peak]) if strong else None


def wanders(residual: Floats, sigma: float) -> float:
    """Excess left, in units of the noise variance, when the neighbours in time predict a sample.

    Neighbours within a second, the sample itself left out: good for what is slow, whatever drives
    it, and bad for all that follows the motion.
    """
    kernel = np.ones(21)
    kernel[10] = 0.0
    weight = np.convolve(np.ones(len(residual)), kernel, "same")
    guess = np.convolve(residual, kernel, "same") / weight
    return float(((residual - guess) ** 2).sum() / sigma**2 - 1.05 * len(residual))


def _wander(left: Floats) -> float:
    """Variance of block means over what white noise would give."""
    size = 100
    blocks = left[: len(left) // size * size].reshape(-1, size)
    white = float(noise_rms(left[:, None])[0]) ** 2 / size
    return float(np.var(blocks.mean(axis=1)) / white)


def _uneven(left: Floats, motion: Motion) -> bool:
    """Whether the noise depends on strain or on its rate."""
    fast = np.diff(left, 2, append=[left[-1]] * 2) / np.sqrt(6.0)
    square = fast**2
    speed = np.abs(np.gradient(motion.strain))
    for covariate in (motion.strain, speed):
        edges = np.quantile(covariate, [0.25, 0.75])
        quiet, loud = square[covariate <= edges[0]], square[covariate >= edges[1]]
        ratio = (loud.mean() + 0.05) / (quiet.mean() + 0.05)
        if ratio > 2.5 or ratio < 0.4:
            return True
    return False
