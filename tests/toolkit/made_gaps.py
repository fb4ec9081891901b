"""Recordings whose gap is known, of one simple physics; shared by the diagnosis' tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from softsense.diagnose.channel import Channel
from softsense.diagnose.design import Fit
from softsense.diagnose.nominal import history_basis, motion_of, nominals, reference_of
from softsense.recording import FrontEnd, Recording
from softsense.simulate.motion import random_motion

GAP = Path(__file__).parents[1] / "benchmarks" / "gap"
RATE_HZ = 20.0
SAMPLES = 6000
# So many times as fine is the clock of what goes on between samples.
FINE = 10


def clean(seed: int, samples: int = SAMPLES, start: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Strain share (samples,) and noiseless nominal codes (samples, 4), one physics for all."""
    x = random_motion(samples + start, 1 / RATE_HZ, seed)[start:]
    return x, sensed(x)


def sensed(x: np.ndarray) -> np.ndarray:
    """Noiseless codes (samples, 4) of the strain share ``x``."""
    rng = np.random.default_rng(99)
    columns = []
    for _ in range(4):
        s = x + rng.uniform(-0.3, 0.4) * x**2
        slow = lfilter([0.02], [1, -0.98], s)
        columns.append(
            rng.uniform(1300, 1800)
            + rng.choice([-1, 1]) * rng.uniform(500, 900) * (s + 0.2 * (slow - s))
        )
    return np.stack(columns, axis=1)


def walked(seed: int, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The same of steps at one pace after another, of which a sample sees little: on a clock that
    is ``FINE`` times as fine."""
    rng = np.random.default_rng(seed)
    paces, sizes = rng.uniform(0.9, 1.5, samples // 600 + 1), rng.uniform(0.5, 1.0, samples)
    turns = np.cumsum(paces.repeat(600 * FINE)[: samples * FINE]) / (RATE_HZ * FINE)
    x = sizes[turns.astype(int)] * np.sin(np.pi * turns) ** 4
    return x, sensed(x)


def recorded(
    x: np.ndarray, codes: np.ndarray, seed: int, noise: float | np.ndarray = 1.3
) -> Recording:
    noisy = codes + np.random.default_rng(seed).normal(0.0, noise, codes.shape)
    names = tuple(f"s{i + 1}" for i in range(codes.shape[1]))
    return Recording(
        "made",
        names,
        np.clip(np.rint(noisy), 0, 4095).astype(np.int32),
        ("strain",),
        ("1",),
        0.4 * x[:, None],
        np.arange(len(x)) / RATE_HZ,
        tuple(FrontEnd("codes", 12) for _ in names),
    )


def filtered(codes: np.ndarray, tau_s: float) -> np.ndarray:
    """Codes (samples, channels) behind a resistor and a capacitor."""
    kept = np.exp(-1.0 / (RATE_HZ * tau_s))
    settled = kept * codes[:1]
    return lfilter([1.0 - kept], [1.0, -kept], codes, axis=0, zi=settled)[0]


def hide(x: np.ndarray, codes: np.ndarray, effect: str, seed: int = 0) -> np.ndarray:
    """Codes with an effect in them that is written here, not taken from the catalogue."""
    t = np.arange(len(x)) / RATE_HZ
    made = codes.copy()
    if effect == "drift":
        made[:, :2] += 25.0 * (1.0 - np.exp(-((t / 120.0) ** 0.7)))[:, None]
    elif effect == "delay":
        index = np.arange(len(x))
        made = np.stack([np.interp(index - 1.6, index, c) for c in codes.T], axis=1)
    elif effect == "step":
        made[t > 171.0, 1] -= 14.0
    elif effect == "crosstalk":
        made[:, 2] += 0.06 * (codes[:, 1] - codes[:, 2])
    elif effect == "spikes":
        rng = np.random.default_rng(seed)
        hit = rng.random(len(x)) < 0.004
        made[hit, 0] += 60.0 * rng.choice([-1, 1], hit.sum())
    elif effect == "interference":
        made[:, 3] += 7.0 * np.sin(2 * np.pi * 6.3 * t)
    elif effect == "noise":
        made[:, 1] += np.random.default_rng(seed).normal(0.0, 9.0, len(x))
    elif effect == "overshoot":
        from scipy.signal import lfilter

        speed = np.abs(np.gradient(x)) * RATE_HZ
        made[:, 0] += 60.0 * lfilter([0.15], [1, -0.85], speed)
    return made


def first_channel(x: np.ndarray, codes: np.ndarray, gap: np.ndarray, names: list[str]) -> Channel:
    """The first of the channels ``codes``, with such a ``gap`` (samples,) and noise, and what could
    say it."""
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    nominal = nominals(
        codes, codes, motion, 12, reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    )[0]
    noise = np.random.default_rng(1).normal(0.0, 1.3, len(x))
    curve, history = x[:, None] ** [1, 2], history_basis(x, 1 / RATE_HZ)
    return Channel(nominal, gap + noise, 1.3, curve, names, 1.7, 0.0, 0.1, history)


def fit_with(names: str, left: float) -> Fit:
    """One whose effects ``names``, joined by ``+``, leave so much."""
    picks = tuple((name, 0) for name in names.split("+"))
    return Fit(picks, np.full(1, left), np.zeros(0), None)
