"""Operators that several effects are made of: filters, the play operator, the strain rate.

Filters are exact for inputs that are straight between samples (first-order hold), or smooth, where
that is said. A filter that holds its input over a sample would lag by half a sample, which at 20 Hz
is as large as many of the effects that are to be simulated and diagnosed.
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp, expm1
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]

# Of so many samples filters run over several parts at once, and forget what is so little.
LONG = 100_000
FORGOTTEN = 1e-20
# What comes and goes with a period.
SINE, SAW = "sine", "saw-tooth"
# What does so within so many seconds is not where it was after a break.
LONG_PERIOD_S = 5.0


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """``function`` as a compiled loop, kept on disk where there is a place to keep it."""
    try:
        result: Callable[..., Any] = njit(cache=True, nogil=True)(function)
    except RuntimeError:  # no writable folder for the cache: compile in every process
        result = njit(nogil=True)(function)
    return result


def wave(shape: str, turns: Floats) -> Floats:
    """(samples,) after so many ``turns`` (samples,): a sine, or a saw-tooth that rises from -1/2 to
    1/2."""
    if shape == SINE:
        return np.asarray(np.sin(2.0 * np.pi * turns))
    return np.asarray(turns % 1.0 - 0.5)


def first_order_hold(dt_s: float, tau_s: float) -> tuple[float, float, float]:
    """(a, b0, b1) of y[k] = a y[k-1] + b0 u[k] + b1 u[k-1], i.e. of tau dy/dt = u - y.

    Exact for u straight between samples. tau 0 (or far below a sample) gives y = u.
    """
    ratio = dt_s / tau_s if tau_s > 0 else np.inf
    if ratio > 700.0:
        return 0.0, 1.0, 0.0
    a = exp(-ratio)
    share = -expm1(-ratio) / ratio
    return a, 1.0 - share, share - a


def low_pass(
    signal: Floats, dt_s: float, tau_s: Floats, memory: Floats | None, rest: Floats | None = None
) -> tuple[Floats, Floats]:
    """Each channel of ``signal`` (samples, channels) through 1 / (1 + tau p).

    ``memory``: (2, channels), the last input and the last output, or None to start settled at
    ``rest`` (the first sample where None). Returns the output and the new memory.
    """
    if memory is None:
        start = signal[0] if rest is None else rest
        memory = np.stack([start, start])
    output = np.empty_like(signal)
    for channel, tau in enumerate(tau_s):
        a, b0, b1 = first_order_hold(dt_s, float(tau))
        before, out = memory[:, channel].tolist()
        follow = _follow if len(signal) < LONG else _follow_long
        follow(signal[:, channel], output[:, channel], a, b0, b1, before, out)
    return output, np.stack([signal[-1], output[-1]])


def straight_pieces(signal: Floats) -> Floats:
    """(2, samples - 1) polynomials of the straight way from one sample of ``signal`` (samples,) to
    the next, lowest power first."""
    return np.stack([signal[:-1], np.diff(signal)])


def spline_pieces(signal: Floats) -> Floats:
    """(4, samples - 1) polynomials of the way from one sample of ``signal`` (samples,) to the next,
    lowest power first, as nature goes it: smoothly."""
    pieces: Floats = np.ascontiguousarray(CubicSpline(np.arange(len(signal)), signal).c[::-1])
    return pieces


def smooth_low_pass(pieces: Floats, dt_s: float, tau_s: float) -> Floats:
    """(samples,) a signal of such ``pieces`` (``spline_pieces``) through 1 / (1 + tau p), settled
    at the first sample; exact between samples."""
    ratio = dt_s / tau_s
    # What each power leaves at the end of a piece, by parts.
    left = [-expm1(-ratio)]
    for power in range(1, len(pieces)):
        left.append(1.0 - power / ratio * left[-1])
    output = np.empty(pieces.shape[1] + 1)
    output[0] = pieces[0, 0]
    _decay(np.array(left) @ pieces, exp(-ratio), output)
    return output


@compiled
def _decay(driven: Floats, a: float, output: Floats) -> None:
    """Write y[k + 1] = a y[k] + ``driven``[k] into ``output``, which begins with y[0]."""
    y = output[0]
    for k in range(len(driven)):
        y = a * y + driven[k]
        output[k + 1] = y


@compiled
def _follow(
    signal: Floats, output: Floats, a: float, b0: float, b1: float, before: float, y: float
) -> None:
    """Write y[k] = a y[k-1] + b0 u[k] + b1 u[k-1] of ``signal`` u (samples,) into ``output``."""
    for k in range(len(signal)):
        y = b0 * signal[k] + (b1 * before + a * y)
        before = signal[k]
        output[k] = y


@compiled
def _follow_long(
    signal: Floats, output: Floats, a: float, b0: float, b1: float, before: float, y: float
) -> None:
    """The same, four parts of the signal at once: each step waits for the one before it.

    The last three parts begin from 0, and are then given what those before them left.
    """
    part = len(signal) // 4
    first, second, third = part, 2 * part, 3 * part
    y1 = y2 = y3 = 0.0
    before1, before2, before3 = signal[first - 1], signal[second - 1], signal[third - 1]
    for k in range(part):
        u, u1, u2, u3 = signal[k], signal[first + k], signal[second + k], signal[third + k]
        y = b0 * u + (b1 * before + a * y)
        y1 = b0 * u1 + (b1 * before1 + a * y1)
        y2 = b0 * u2 + (b1 * before2 + a * y2)
        y3 = b0 * u3 + (b1 * before3 + a * y3)
        before, before1, before2, before3 = u, u1, u2, u3
        output[k], output[first + k], output[second + k], output[third + k] = y, y1, y2, y3
    for k in range(4 * part, len(signal)):
        y3 = b0 * signal[k] + (b1 * before3 + a * y3)
        before3, output[k] = signal[k], y3
    for begin, end in ((first, second), (second, third), (third, len(signal))):
        left = output[begin - 1]
        least = FORGOTTEN * abs(left)
        for k in range(begin, end):
            left *= a
            if abs(left) <= least:
                break
            output[k] += left


def rate(strain: Floats, dt_s: float, previous: float | None) -> Floats:
    """(samples,) change per second of ``strain`` since the sample before; 0 at the very first."""
    first = strain[0] if previous is None else previous
    return np.diff(strain, prepend=first) / dt_s


@compiled
def play(signal: Floats, width: Floats, memory: Floats) -> Floats:
    """Play operators: memory[c] follows signal[:, c] at most ``width[c] / 2`` away from it.

    Changes ``memory`` (channels,) in place; returns (samples, channels).
    """
    samples, channels = signal.shape
    output = np.empty((samples, channels))
    for c in range(channels):
        half = 0.5 * width[c]
        y = memory[c]
        for k in range(samples):
            y = min(max(y, signal[k, c] - half), signal[k, c] + half)
            output[k, c] = y
        memory[c] = y
    return output


@compiled
def uneven_play(signal: Floats, width: Floats) -> Floats:
    """(samples,) a play that is ``width[k]`` wide at sample k, and begins in its middle."""
    output = np.empty(len(signal))
    y = signal[0]
    for k in range(len(signal)):
        y = min(max(y, signal[k] - 0.5 * width[k]), signal[k] + 0.5 * width[k])
        output[k] = y
    return output


@compiled
def followed(signal: Floats, rising: float, falling: float, start: float) -> Floats:
    """(samples,) what goes to ``signal`` by these shares of its distance per sample, other ones up
    than down, from ``start`` on."""
    up, down = -expm1(-rising), -expm1(-falling)
    output = np.empty_like(signal)
    y = start
    for k in range(len(signal)):
        gone = signal[k] - y
        y += gone * (up if gone > 0.0 else down)
        output[k] = y
    return output


@compiled
def at_own_pace(u: Floats, pull: Floats) -> Floats:
    """(samples,) what follows ``u`` at rates ``pull`` (samples,), exact between samples of one."""
    output = np.empty_like(u)
    y = u[0]
    output[0] = y
    for k in range(1, len(u)):
        kept = np.exp(-pull[k])
        share = (1.0 - kept) / pull[k]
        y = kept * y + (1.0 - share) * u[k] + (share - kept) * u[k - 1]
        output[k] = y
    return output
