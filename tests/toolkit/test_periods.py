"""Values that come and go with a period."""

from __future__ import annotations

import numpy as np
import pytest

from softsense.diagnose.periods import courses
from softsense.effects.operators import SAW, SINE, wave

STEP_S = 0.05
SAMPLES = 8000


def squares(value: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, pull and power (samples,) of a value that is seen the better the faster something
    moves, behind noise."""
    time_s = STEP_S * np.arange(SAMPLES)
    power = 400.0 * np.sin(2.0 * np.pi * time_s / 3.3) ** 2
    noise = np.random.default_rng(seed).normal(size=SAMPLES)
    return time_s, power * value + np.sqrt(power) * noise, power


@pytest.mark.parametrize("shape", [SINE, SAW])
@pytest.mark.parametrize(("period_s", "phase"), [(7.7, 0.45), (61.0, 0.1), (133.0, 0.8)])
def test_a_course_is_found(shape: str, period_s: float, phase: float) -> None:
    time_s = STEP_S * np.arange(SAMPLES)
    value = 0.2 + 1e-4 * time_s - 0.08 * wave(shape, time_s / period_s + phase)
    made = courses(*squares(value, 1), least=100.0)
    best = max(made, key=lambda course: course.gained)
    assert best.shape == shape
    assert best.period_s == pytest.approx(period_s, rel=0.01)
    said = (
        best.begin
        + best.pace * time_s
        + best.swing * wave(best.shape, time_s / best.period_s + best.phase)
    )
    assert np.std(said - value) < 0.15 * np.std(value)


@pytest.mark.parametrize("pace", [0.0, 1e-3])
def test_an_even_course_comes_and_goes_nowhere(pace: float) -> None:
    assert courses(*squares(pace * STEP_S * np.arange(SAMPLES), 2), least=100.0) == []
