"""Training: the normal equations, the descent, and what a fit promises."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from softsense.errors import SoftsenseError
from softsense.mlp import Mlp
from softsense.recording import FrontEnd, Recording
from softsense.train import fit
from softsense.train.levenberg_marquardt import Status, Weights, nguyen_widrow, normal_equations
from softsense.train.tanh import tanh


def recording(samples: int = 1200, outputs: int = 1) -> Recording:
    """Three sensors that are noisy, curved views of a slow random motion."""
    rng = np.random.default_rng(3)
    t = np.arange(samples) * 0.05
    motion = 0.5 + 0.3 * np.sin(0.7 * t) + 0.2 * np.sin(1.9 * t + 1)
    views = [motion, motion**2, np.sqrt(np.abs(motion))]
    codes = [np.round(500 + 2500 * v + rng.normal(0, 8, samples)) for v in views]
    target = np.stack([motion, np.cos(motion)], axis=1)[:, :outputs]
    names = ("strain", "x_mm")[:outputs]
    return Recording(
        "bench",
        ("a", "b", "c"),
        np.stack(codes, axis=1).astype(np.int32),
        names,
        ("1", "mm")[:outputs],
        target,
        t,
        (FrontEnd("codes", 12),) * 3,
    )


@pytest.mark.parametrize("outputs", [1, 2])
def test_normal_equations_are_those_of_the_differentiated_network(outputs: int) -> None:
    rng = np.random.default_rng(5)
    weights = nguyen_widrow(rng, 3, 5, outputs)
    x, y = rng.uniform(-1, 1, (700, 3)), rng.uniform(-1, 1, (700, outputs))
    vector = weights.flat()

    def residual(w: np.ndarray) -> np.ndarray:
        return (weights.unflat(w).predict(x) - y).ravel()

    step = 1e-6
    jacobian = np.stack(
        [
            (residual(vector + step * unit) - residual(vector - step * unit)) / (2 * step)
            for unit in np.eye(len(vector))
        ],
        axis=1,
    )
    gram, gradient, square = normal_equations(weights, x, y, weights.hidden(x))
    exact = np.tril(jacobian.T @ jacobian)
    np.testing.assert_allclose(np.tril(gram), exact, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(gradient, jacobian.T @ residual(vector), rtol=1e-6, atol=1e-5)
    assert square == pytest.approx(float(residual(vector) @ residual(vector)))
    some, slope, whole = normal_equations(weights, x, y, weights.hidden(x), stride=3)
    third = np.repeat(np.arange(700) % 3 == 0, outputs)
    exact = np.tril(3 * jacobian[third].T @ jacobian[third])
    np.testing.assert_allclose(np.tril(some), exact, atol=1e-6 * np.abs(exact).max())
    assert np.array_equal(slope, gradient)
    assert whole == square


def test_the_vector_tanh_is_tanh() -> None:
    x = np.concatenate([np.linspace(-50.0, 50.0, 20001), np.geomspace(1e-300, 1.0, 301), [0.0]])
    values = x.copy()
    tanh(values)
    np.testing.assert_allclose(values, np.tanh(x), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("outputs", [1, 2])
def test_the_best_second_layer_has_no_slope_left(outputs: int) -> None:
    rng = np.random.default_rng(6)
    x, y = rng.uniform(-1, 1, (700, 3)), rng.uniform(-1, 1, (700, outputs))
    start = nguyen_widrow(rng, 3, 5, outputs)
    hidden = start.hidden(x)
    best = start.with_best_outputs(hidden, y, 0.5)
    _, gradient, square = normal_equations(best, x, y, hidden)
    slope = gradient + 0.5 * best.flat()
    second = outputs * (5 + 1)
    np.testing.assert_allclose(slope[-second:], 0.0, atol=1e-10)
    assert np.array_equal(best.w1, start.w1)
    assert np.array_equal(best.b1, start.b1)
    assert square < float(np.sum((start.outputs(hidden) - y) ** 2))


def test_flat_and_unflat_are_inverse() -> None:
    weights = nguyen_widrow(np.random.default_rng(0), 2, 4, 2)
    back = weights.unflat(weights.flat())
    for name in ("w1", "b1", "w2", "b2"):
        assert np.array_equal(getattr(weights, name), getattr(back, name))
    assert isinstance(back, Weights)


def test_the_same_call_gives_the_same_network_bit_for_bit() -> None:
    first, second = (fit(recording(), hidden=8, seed=4, max_epochs=15) for _ in range(2))
    assert first.mlp.to_json() == second.mlp.to_json()
    assert first.mlp.to_json() != fit(recording(), hidden=8, seed=5, max_epochs=15).mlp.to_json()


@pytest.mark.parametrize("outputs", [1, 2])
def test_a_smooth_map_is_learnt_down_to_the_noise(outputs: int) -> None:
    rec = recording(outputs=outputs)
    result = fit(rec, hidden=10)
    # Noise of 8 codes of 2500 per unit strain leaves 0.0032 for one sensor, less for three.
    assert max(result.rmse["test"]) < 0.0032
    assert result.status in get_args(Status)
    again = Mlp.from_json(result.mlp.to_json())
    error = again.predict(rec.codes[result.split.test]) - rec.target[result.split.test]
    np.testing.assert_allclose(np.sqrt((error**2).mean(axis=0)), result.rmse["test"])
    assert result.accuracy == pytest.approx(1 / np.mean(error**2))


def test_inputs_are_calibrated_on_training_and_validation_rows() -> None:
    rec = recording()
    result = fit(rec, ("c", "a"), hidden=4, split="forward", max_epochs=3)
    known = np.concatenate([result.split.train, result.split.validation])
    assert [i.name for i in result.mlp.inputs] == ["c", "a"]
    for one, column in zip(result.mlp.inputs, (2, 0), strict=True):
        assert (one.low, one.high) == (
            rec.codes[known, column].min(),
            rec.codes[known, column].max(),
        )
        assert one.scale * (one.low - one.offset) == pytest.approx(-1)
        assert one.scale * (one.high - one.offset) == pytest.approx(1)


def test_what_cannot_be_trained_is_refused_with_a_remedy() -> None:
    with pytest.raises(SoftsenseError, match="too few"):
        fit(recording(60))
    with pytest.raises(SoftsenseError, match="no sensor 'z'"):
        fit(recording(), ("z",))
    with pytest.raises(SoftsenseError, match="at least 1"):
        fit(recording(), hidden=0)
