"""Effects without a mean: noise, spikes and lines, in what is left over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kurtosis

from softsense.diagnose.nominal import Motion, noise_rms

Floats = NDArray[np.float64]

# Real and simulated noise differ anyway by up to this factor.
NOISE_FACTOR = 2.5
LINE_RATIO = 18.0
SPIKE_SIGMA = 7.0
SPIKE_COUNT = 6
# Excess kurtosis of the moves of a walk.
JERKY = 4.0


@dataclass(frozen=True)
class Finding:
    """A variance-type effect on ``channels``, with a number that says how strong it is."""

    name: str
    channels: tuple[int, ...]
    value: float
    what: str


def findings(left: Floats, own: Floats, motion: Motion, explained: bool) -> list[Finding]:
    """Test the leftovers ``left`` (samples, channels) in codes, against the simulation's ``own``.

    ``explained``: an effect has been taken out, whose form being only nearly right leaves edges
    and ripples: spikes and lines must then stand out more.
    """
    result = []
    unevenness = 8.0 if explained else 2.5
    enough = 3 * SPIKE_COUNT if explained else SPIKE_COUNT
    spiky = [
        c
        for c in range(left.shape[1])
        if _spikes(left[:, c]).sum() >= enough + 2 * _spikes(own[:, c]).sum()
    ]
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
    here, there = noise_rms(left), noise_rms(own)
    loud = [
        c
        for c in range(left.shape[1])
        if c not in spiky
        and c not in lines
        and (
            here[c] > NOISE_FACTOR * max(there[c], 1.0)
            or (
                _uneven(left[:, c], motion, unevenness)
                and not _uneven(own[:, c], motion, unevenness)
            )
        )
    ]
    if loud:
        result.append(Finding("noise", tuple(loud), float(here[loud].max()), "rms_codes"))
    return result


def cleaned(residual: Floats, found: list[Finding], motion: Motion) -> Floats:
    """``residual`` (samples, channels) without the spikes and lines of ``found``, or itself."""
    clean = residual
    for finding in found:
        if finding.name not in ("spikes", "interference"):
            continue
        clean = clean.copy()
        for c in finding.channels:
            if finding.name == "spikes":
                hit = np.convolve(_spikes(clean[:, c]), np.ones(5), "same") > 0
                good = np.flatnonzero(~hit)
                clean[hit, c] = np.interp(np.flatnonzero(hit), good, clean[good, c])
            else:
                clean[:, c] -= _tone(clean[:, c], finding.value, motion.dt_s)
    return clean


def _tone(signal: Floats, frequency: float, dt_s: float) -> Floats:
    """What ``signal`` has within a narrow band around ``frequency`` (Hz), which may wander."""
    spectrum = np.fft.rfft(signal)
    away = np.abs(np.fft.rfftfreq(len(signal), dt_s) - frequency)
    spectrum[away > max(0.02 * frequency, 12.0 / (len(signal) * dt_s))] = 0.0
    tone: Floats = np.fft.irfft(spectrum, len(signal))
    return tone


def _spikes(left: Floats) -> NDArray[np.bool_]:
    """(samples,) whether a sample is far from its neighbours, in units of the local noise."""
    fast = left - np.convolve(left, np.ones(5) / 5, "same")
    scale = 1.4826 * float(np.median(np.abs(fast))) + 1e-9
    hit: NDArray[np.bool_] = np.abs(fast) > SPIKE_SIGMA * max(scale, 0.5)
    return hit


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
    local = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)[::8], axis=1)
    floor = np.repeat(local, 8)[: len(power)] / np.log(2.0)
    # The largest of n exponential values is about log n: ask for far more than that, and for a
    # tone that is itself as large as the noise.
    peak = int(np.argmax(power / floor))
    around = slice(max(peak - 3, 0), peak + 4)
    tone = float(power[around].sum()) * 2.0 / (float((window**2).sum()) * len(left))
    noise = float(noise_rms(left[:, None])[0]) ** 2
    strong = power[peak] / floor[peak] > LINE_RATIO + np.log(len(power)) and tone > least * noise
    return float(frequency[peak]) if strong else None


def _uneven(left: Floats, motion: Motion, factor: float) -> bool:
    """Whether the noise varies by ``factor`` (of power) with strain or with its rate."""
    fast = np.diff(left, 2, append=[left[-1]] * 2) / np.sqrt(6.0)
    square = fast**2
    speed = np.abs(np.gradient(motion.strain))
    for covariate in (motion.strain, speed):
        edges = np.quantile(covariate, [0.25, 0.75])
        quiet, loud = square[covariate <= edges[0]], square[covariate >= edges[1]]
        ratio = (loud.mean() + 0.05) / (quiet.mean() + 0.05)
        if ratio > factor or ratio < 1.0 / factor:
            return True
    return False


def jerky(walk: Floats) -> bool:
    """Whether what wanders goes in jumps or bumps, and not by many small steps.

    A random walk's moves over a second are Gaussian; contacts and loads come and go.
    """
    moves = np.diff(walk[: len(walk) // 20 * 20].reshape(-1, 20).mean(axis=1))
    return float(kurtosis(moves)) > JERKY
