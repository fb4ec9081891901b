"""Sensors on what moves in two ways, of which one was recorded: each is strained by both."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from softsense.diagnose import augment, diagnose
from softsense.diagnose.nominal import denoise, felt, motion_of, own_ways, told
from softsense.simulate.motion import random_motion

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import RATE_HZ, clean, recorded

# Of the motion that was recorded, and of the other one.
PARTS = np.array([[0.9, 0.1], [0.5, 0.6], [0.7, -0.5], [-0.6, 0.5]])
SIZES = np.array([800.0, 700.0, -900.0, 750.0])
NOISE = 1.3


def strained(seed: int, samples: int = 6000) -> tuple[np.ndarray, np.ndarray]:
    """The recorded strain share (samples,) and what strains each sensor (samples, 4)."""
    both = [random_motion(samples, 1 / RATE_HZ, seed + k) for k in (0, 500)]
    return both[0], np.stack(both, axis=1) @ PARTS.T


def read(s: np.ndarray) -> np.ndarray:
    """Codes (samples, 4) of strains."""
    return 2000.0 + SIZES * (s + 0.15 * s**2)


def with_effect(s: np.ndarray, effect: str) -> np.ndarray:
    """The same where an effect acts on the strain of the sensors."""
    if effect == "overshoot":
        s = s + 0.05 * np.abs(np.gradient(s, 1 / RATE_HZ, axis=0))
    else:
        played = s.copy()
        for k in range(1, len(s)):
            played[k] = np.clip(played[k - 1], s[k] - 0.08, s[k] + 0.08)
        s = s + 0.15 * (played - s)
    return s


def test_a_channel_is_strained_otherwise_where_the_recorded_motion_does_not_tell_it() -> None:
    x, codes = clean(3)
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    assert own_ways(codes, codes, motion) == (0, 0, 0, 0)
    # Nor is one that wanders, if only in the simulation.
    wanders = np.cumsum(np.random.default_rng(1).normal(0.0, 2.0, codes.shape), axis=0)
    assert own_ways(codes + wanders, codes, motion) == (0, 0, 0, 0)
    x, s = strained(3)
    codes, motion = read(s), motion_of(x, 1 / RATE_HZ, 0.0, None)
    # The last two fall with the strain, by their sign or their place.
    ways = own_ways(codes, codes, motion)
    assert ways == (1, 1, -1, -1)
    # Its own signal tells it.
    left = codes - told(codes, felt(motion, codes, ways, codes))
    assert left.std(axis=0).max() < 1e-3 * np.ptp(codes, axis=0).min()


def test_fast_moves_that_nothing_tells_are_kept() -> None:
    """With less than the noise itself."""
    x, s = strained(5)
    t = np.arange(len(x)) / RATE_HZ
    s += (0.05 * np.sin(2.0 * np.pi * 3.0 * t) * (t % 60.0 < 15.0))[:, None]
    codes = read(s)
    sim, real = (recorded(x, codes, seed, NOISE).codes.astype(float) for seed in (1, 2))
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    made, kept = denoise(sim, motion, real, own_ways(sim, real, motion))
    assert ((made - codes) ** 2).mean(axis=0).max() < NOISE**2
    assert np.all((kept > 0.0) & (kept < 1.0))


@pytest.mark.parametrize("effect", ["overshoot", "hysteresis"])
def test_an_effect_of_the_material_acts_on_what_each_sensor_feels(effect: str) -> None:
    """On another motion, too."""
    x, s = strained(7)
    result = diagnose(
        recorded(x, read(s), 1, NOISE), recorded(x, read(with_effect(s, effect)), 2, NOISE)
    )
    assert result.effects == (effect,)
    assert not result.data["unexplained"]["unknown_effect"]
    x2, s2 = strained(31, 3000)
    sim2 = recorded(x2, read(s2), 3, NOISE)
    real2 = recorded(x2, read(with_effect(s2, effect)), 4, NOISE)
    made, noise = augment(result, sim2), 2.0 * NOISE**2 + 1.0 / 6.0
    before = float(np.mean((real2.codes - sim2.codes) ** 2.0)) - noise
    after = float(np.mean((real2.codes - made.codes) ** 2.0)) - noise
    assert after < 0.1 * before
