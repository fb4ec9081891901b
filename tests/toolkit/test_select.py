"""Selection: scores against closed forms, greedy search, coverage, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from softsense.errors import SoftsenseError
from softsense.recording import FrontEnd, Recording
from softsense.select import coverage, greedy, polynomial, rank, select


def as_recording(sensors: np.ndarray, target: np.ndarray, bits: int = 12) -> Recording:
    """Physical columns through an ideal converter over each one's range."""
    target = target.reshape(len(sensors), -1)
    low, high = sensors.min(axis=0), sensors.max(axis=0)
    codes = np.round((sensors - low) / (high - low) * (2**bits - 1)).astype(np.int32)
    count, targets = codes.shape[1], target.shape[1]
    return Recording(
        "made",
        tuple(f"s{i + 1}" for i in range(count)),
        codes,
        tuple(f"y{i + 1}" for i in range(targets)),
        ("1",) * targets,
        target,
        None,
        (FrontEnd("codes", bits),) * count,
    )


def gaussians(noise: float, sensors: int = 7, samples: int = 8000, seed: int = 0) -> Recording:
    """Y of variance 1, and sensors Y + noise: I(k sensors; Y) = 0.5 log2(1 + k / noise^2)."""
    rng = np.random.default_rng(seed)
    y = rng.normal(size=samples)
    return as_recording(y[:, None] + noise * rng.normal(size=(samples, sensors)), y)


@pytest.mark.parametrize("noise", [1.0, 1 / 30])
def test_score_and_lower_bound_are_the_information_of_gaussians(noise: float) -> None:
    """Within 0.1 bit for 1 … 7 sensors, at 8000 samples; no saturation."""
    ranking = rank(gaussians(noise))
    assert ranking.method == "exhaustive"
    assert len(ranking.subsets) == 127
    for subset in ranking.subsets:
        truth = 0.5 * np.log2(1 + len(subset.sensors) / noise**2)
        assert subset.score == pytest.approx(truth, abs=0.1)
        assert subset.mi_lower_bits == pytest.approx(truth, abs=0.1)
    # The plug-in measure, by contrast, has no room above H(Y) = log2(8000) and sits at it.
    assert ranking.of_size(7)[0].mi_bits == pytest.approx(ranking.target_entropy_bits, abs=1e-6)


@pytest.mark.parametrize(("samples", "tolerance"), [(500, 0.45), (2000, 0.12), (20000, 0.06)])
def test_the_tolerance_shrinks_with_the_samples(samples: int, tolerance: float) -> None:
    ranking = rank(gaussians(0.3, sensors=4, samples=samples, seed=2))
    for subset in ranking.subsets:
        truth = 0.5 * np.log2(1 + len(subset.sensors) / 0.09)
        assert subset.score == pytest.approx(truth, abs=tolerance)


def test_the_score_of_several_targets_is_that_of_their_mean_squared_error() -> None:
    """Two correlated Gaussian targets seen through noise: the error covariance in closed form."""
    rng = np.random.default_rng(3)
    a = rng.normal(size=8000)
    y = np.stack([a, 0.9 * a + np.sqrt(1 - 0.81) * rng.normal(size=8000)], axis=1)
    x = y + 0.5 * rng.normal(size=y.shape)
    for scale in (np.array([1.0, 1.0]), np.array([1.0, 20.0])):
        covariance = np.array([[1, 0.9], [0.9, 1]]) * np.outer(scale, scale)
        channel = np.diag(1 / scale)  # the sensors see the targets before they were scaled
        seen = channel @ covariance @ channel + 0.25 * np.eye(2)
        gain = covariance @ channel @ np.linalg.inv(seen)
        error = covariance - gain @ channel @ covariance
        rec = as_recording(x, y * scale)
        truth = 0.5 * np.log2(np.trace(covariance) / np.trace(error))
        assert rank(rec).of_size(2)[0].score == pytest.approx(truth, abs=0.05)
        # in different units each counts relative to its own variance
        relative = 0.5 * np.log2(2 / np.sum(np.diag(error) / np.diag(covariance)))
        mixed = rank(replace(rec, target_units=("mm", "deg"))).of_size(2)[0].score
        assert mixed == pytest.approx(relative, abs=0.05)


def test_complementary_sensors_win_although_each_alone_is_poor() -> None:
    """s1 and s2 see Y only through a hidden state that they share with opposite sign."""
    rng = np.random.default_rng(4)
    y, hidden = rng.normal(size=4000), 2 * rng.normal(size=4000)
    noise = 0.05 * rng.normal(size=(4000, 4))
    x = np.stack([y + hidden, y - hidden, y, y], axis=1)
    x[:, 2:] += rng.normal(size=(4000, 1)) * 0.5  # s3 and s4 share their error
    rec = as_recording(x + noise, y)
    assert select(rec, 1).sensors in {("s3",), ("s4",)}
    chosen = select(rec, 2)
    assert chosen.sensors == ("s1", "s2")
    assert chosen.ranking[0].sensors == chosen.sensors
    assert [s.score for s in chosen.ranking] == sorted(s.score for s in chosen.ranking)[::-1]
    # dissimilarity: what the other adds, with nothing between copies
    table = rank(rec, 2).dissimilarity_bits
    assert np.all(np.diag(table) == 0)


def test_duplicate_sensors_add_nothing() -> None:
    rec = gaussians(0.3, sensors=3)
    twice = replace(
        rec,
        sensors=(*rec.sensors, "s1_again"),
        codes=np.hstack([rec.codes, rec.codes[:, :1]]),
        front_ends=(*rec.front_ends, rec.front_ends[0]),
    )
    ranking = rank(twice)
    known = {subset.sensors: subset for subset in ranking.subsets}
    once, both = known[("s1",)], known[("s1", "s1_again")]
    assert both.mi_bits == pytest.approx(once.mi_bits, abs=1e-12)
    assert both.score == pytest.approx(once.score, abs=1e-3)
    assert ranking.dissimilarity_bits[0, 3] == pytest.approx(0, abs=1e-12)
    labels = greedy.coarse(twice.codes)
    for criterion in ("cmim", "jmi"):
        order = greedy.forward(labels, greedy.joint_target(rec.target), 4, criterion)
        assert sorted(order) == [0, 1, 2, 3]
    # CMIM takes a copy of what it has last
    assert greedy.forward(labels, greedy.joint_target(rec.target), 4, "cmim")[3] in (0, 3)


def sixty() -> Recording:
    """Three sensors that together tell Y, their noisy copies, and fifty that tell nothing."""
    rng = np.random.default_rng(5)
    parts = rng.normal(size=(3000, 3))
    y = parts.sum(axis=1)
    copies = np.repeat(parts, 3, axis=1) + rng.normal(size=(3000, 9)) * np.tile([0.05, 0.4, 0.8], 3)
    return as_recording(np.hstack([copies, rng.normal(size=(3000, 51))]), y)


@pytest.mark.parametrize("criterion", ["score", "cmim", "jmi"])
def test_forward_selection_finds_three_among_sixty(criterion: str) -> None:
    ranking = rank(sixty(), 3, criterion=criterion)
    assert ranking.method == f"forward by {criterion}"
    assert set(ranking.best[3]) == {"s1", "s4", "s7"}


def test_held_out_error_is_that_of_refitting_without_each_fold() -> None:
    """The quadratic form against the samples themselves."""
    rng = np.random.default_rng(6)
    x = rng.uniform(-1, 1, (300, 3))
    y = np.stack([x[:, 0] * x[:, 1], x[:, 2] ** 3], axis=1) + 0.1 * rng.normal(size=(300, 2))
    weights = rng.uniform(0.5, 2, 300)
    known = polynomial.moments(x, y, weights)
    for subset in ((0,), (0, 1), (2, 0), (0, 1, 2)):
        fitted = polynomial.held_out(known, subset)
        square = np.sum((y - polynomial.predictions(known, fitted)) ** 2, axis=1)
        folds = np.array_split(np.arange(300), polynomial.FOLDS)
        direct = [np.average(square[fold], weights=weights[fold]) for fold in folds]
        np.testing.assert_allclose(fitted.errors, direct, rtol=1e-8, atol=1e-10)
        mass = [weights[fold].sum() for fold in folds]
        typical = np.exp(np.average(np.log(direct), weights=mass))
        assert fitted.error == pytest.approx(typical)
        alone = polynomial.moments(x[:, sorted(subset)], y, weights)
        own = polynomial.held_out(alone, range(len(subset)))
        np.testing.assert_allclose(fitted.errors, own.errors, rtol=1e-8)


def test_smaller_subsets_need_no_stronger_ridge_than_larger_ones() -> None:
    """What is passed over to save time must not have been the better choice."""
    rng = np.random.default_rng(8)
    x = rng.uniform(-1, 1, (2000, 4))
    for noise in (0.001, 0.1, 3.0):
        y = (x[:, 0] * x[:, 1] + x[:, 2] ** 3 + noise * rng.normal(size=2000))[:, None]
        known = polynomial.moments(x, y, np.ones(2000))
        fitted = polynomial.every_subset(known, 4)
        assert len(fitted) == 15
        for chosen, one in fitted.items():
            ridges = [polynomial.held_out(known, chosen, [ridge]) for ridge in polynomial.RIDGES]
            assert one.error <= 1.01 * min(free.error for free in ridges)


def test_features_are_chebyshev_products() -> None:
    products = polynomial.basis(2, 3)
    x = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    angle = np.arccos(x)
    for number, (a, b) in enumerate(products.exponents):
        expected = np.cos(a * angle[:, 0]) * np.cos(b * angle[:, 1])
        np.testing.assert_allclose(products.features(x)[:, number], expected, atol=1e-12)
    assert len(products.exponents) == 10


def test_an_uneven_target_is_told_and_can_be_evened() -> None:
    """s1 is good where the target dwells, s2 over the whole range."""
    rng = np.random.default_rng(7)
    y = np.where(rng.random(6000) < 0.95, 0.1 * rng.random(6000), rng.random(6000))
    s1 = np.minimum(y, 0.1) + 0.0005 * rng.normal(size=6000)
    s2 = y + 0.01 * rng.normal(size=6000)
    rec = as_recording(np.stack([s1, s2], axis=1), y)
    plain = rank(rec, 1)
    assert plain.evenness[0] < coverage.EVEN_ENOUGH
    assert "does not cover its range" in plain.warnings[0]
    for uniform in ("weight", "resample"):
        evened = rank(rec, 1, uniform=uniform)
        assert evened.evenness[0] > plain.evenness[0]
        gain = {s.sensors: s.score for s in evened.subsets}
        before = {s.sensors: s.score for s in plain.subsets}
        assert gain[("s2",)] > before[("s2",)]
    assert rank(gaussians(0.5, 2, 500), 1).to_dict()["best"]["1"][0] in {"s1", "s2"}


def test_a_clock_helps_between_known_samples_but_not_in_an_unseen_stretch() -> None:
    rng = np.random.default_rng(6)
    clock = np.linspace(-1, 1, 3000)
    y = rng.uniform(-1, 1, 3000)
    rec = as_recording(np.stack([y + 0.5 * np.sin(5 * clock), clock], axis=1), y)
    stretches, samples = (rank(rec, unseen=unseen) for unseen in ("stretches", "samples"))
    scores = [{s.sensors: s.score for s in r.subsets} for r in (stretches, samples)]
    assert scores[1][("s1", "s2")] > scores[0][("s1", "s2")] + 0.5
    assert scores[1][("s1",)] == pytest.approx(scores[0][("s1",)], abs=0.1)
    # What counts states does not look at their order.
    plug_in = [{s.sensors: s.mi_bits for s in r.subsets} for r in (stretches, samples)]
    assert plug_in[0] == pytest.approx(plug_in[1], abs=1e-12)
    assert samples.to_dict()["subsets"] == rank(rec, unseen="samples").to_dict()["subsets"]
    with pytest.raises(SoftsenseError, match="unseen 'rows'"):
        rank(rec, unseen="rows")


def test_what_cannot_be_ranked_is_refused() -> None:
    rec = gaussians(0.5, 3, 500)
    with pytest.raises(SoftsenseError, match="cannot choose 4 of 3"):
        select(rec, 4)
    with pytest.raises(SoftsenseError, match="cannot choose 0"):
        rank(rec, 0)
    with pytest.raises(SoftsenseError, match="too few"):
        rank(rec.rows(slice(0, 50)))
    with pytest.raises(SoftsenseError, match="criterion 'mrmr'"):
        rank(rec, criterion="mrmr")
    flat = replace(rec, codes=np.where([True, False, False], 7, rec.codes).astype(np.int32))
    with pytest.raises(SoftsenseError, match="'s1' is constant at code 7"):
        rank(flat)
