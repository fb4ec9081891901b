"""Motions: what the rig is made to do, as strain (samples,) in shares of its range."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from softsense.recording import TIME_COLUMN, read

Floats = NDArray[np.float64]

_TONES = 40
# Band of the random motion at its usual speed; the speed itself wanders between these factors.
_BAND_HZ = (0.01, 0.25)
_SPEED = (0.4, 2.0)
# Mean time between two changes of speed, and the time that a change takes.
_SPEED_HELD_S = 20.0


def random_motion(samples: int, dt_s: float, seed: int, start: int = 0) -> Floats:
    """Pseudo-random motion within 0 … 1 that covers its range about uniformly.

    A sum of tones of random frequency, played at a wandering speed, is nearly Gaussian; its
    distribution function makes it uniform. Frequency and amplitude of the swings vary. It starts
    at rest at 0 and a longer motion has a shorter one as its beginning: ``start`` cuts that off.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x6D6F]))
    low, high = np.log(_BAND_HZ[0]), np.log(_BAND_HZ[1])
    # Stratified, so that no seed lacks slow or fast swings.
    spread = (np.arange(_TONES) + rng.random(_TONES)) / _TONES
    omega = 2.0 * np.pi * np.exp(low + (high - low) * spread)
    phase = 2.0 * np.pi * rng.random(_TONES)
    t = dt_s * np.arange(start, start + samples)
    knots = int(t[-1] / _SPEED_HELD_S) + 3
    speed = np.exp(np.log(_SPEED[0]) + np.log(_SPEED[1] / _SPEED[0]) * rng.random(knots))
    # Piecewise linear speed; its integral is exact on the knots and quadratic between them.
    at = np.concatenate([[0.0], np.cumsum(0.5 * _SPEED_HELD_S * (speed[1:] + speed[:-1]))])
    knot = (t / _SPEED_HELD_S).astype(np.intp)
    into = t - knot * _SPEED_HELD_S
    slope = np.diff(speed) / _SPEED_HELD_S
    played = at[knot] + speed[knot] * into + 0.5 * slope[knot] * into**2
    total = np.zeros(samples)
    for k in range(_TONES):
        total += np.cos(omega[k] * played + phase[k])
    uniform = ndtr(total * np.sqrt(2.0 / _TONES))
    # The first second rises from rest, as a rig that is switched on does.
    result: Floats = uniform * np.minimum(t / 1.0, 1.0)
    return result


def triangle(
    samples: int, dt_s: float, amplitude: float, period_s: float, start: int = 0
) -> Floats:
    """A triangle from 0 to ``amplitude`` and back every ``period_s``."""
    phase = (dt_s * np.arange(start, start + samples) / period_s) % 1.0
    result: Floats = amplitude * (1.0 - np.abs(2.0 * phase - 1.0))
    return result


def read_motion(path: Path, target: str) -> tuple[Floats, float, Floats | None]:
    """Column ``target`` of a file in its own unit, its sample rate in Hz, and ``temp_c``.

    Raises ``SoftsenseError`` as ``softsense.recording.read`` does, also without a time column.
    """
    # Sensors play no role here; the time column stands in, for a motion has no other.
    motion = read(path, target=target, sensors=(TIME_COLUMN,))
    return motion.target[:, 0], 1.0 / motion.dt_s, motion.context.get("temp_c")
