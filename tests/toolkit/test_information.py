"""Estimators against closed forms, and the identities that information must obey."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.metrics import mutual_info_score

from softsense.information import (
    conditional_mutual_information,
    entropy,
    gaussian,
    labels_of,
    mutual_information,
    nearest_neighbour,
    subset_entropies,
)

EXACT = 1e-12


def counted(*columns: np.ndarray) -> float:
    """H by the definition, from sorted rows: another way to the same number."""
    _, counts = np.unique(np.stack(columns, axis=1), axis=0, return_counts=True)
    share = counts / len(columns[0])
    return float(-(share * np.log2(share)).sum())


def codes(seed: int, samples: int, variables: int, states: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    hidden = rng.integers(0, states, samples)
    noisy = [(hidden * (k + 1) + rng.integers(0, 3, samples)) % states for k in range(variables)]
    return np.stack(noisy, axis=1).astype(np.int32)


@given(st.integers(0, 10**6), st.integers(2, 400), st.integers(1, 5), st.sampled_from([2, 7, 4096]))
@settings(max_examples=60, deadline=None)
def test_every_subset_equals_the_definition(
    seed: int, samples: int, variables: int, states: int
) -> None:
    x = codes(seed, samples, variables + 1, states)
    x, y = x[:, :-1], x[:, -1]
    own, joint, target = subset_entropies(x, y)
    assert target == pytest.approx(counted(y), abs=EXACT)
    for mask in range(1, 2**variables):
        chosen = [x[:, i] for i in range(variables) if mask >> i & 1]
        assert own[mask] == pytest.approx(counted(*chosen), abs=EXACT)
        assert joint[mask] == pytest.approx(counted(*chosen, y), abs=EXACT)
        together = np.stack(chosen, axis=1)
        assert entropy(together) == pytest.approx(own[mask], abs=EXACT)
        direct = mutual_information(together, y)
        assert direct == pytest.approx(own[mask] + target - joint[mask], abs=EXACT)


def test_every_subset_of_fine_codes_equals_an_independent_package() -> None:
    rng = np.random.default_rng(5)
    strain = np.cumsum(rng.normal(size=4000))
    noisy = strain[:, None] * rng.uniform(0.5, 2, 5) + rng.normal(size=(4000, 5))
    low, span = noisy.min(axis=0), np.ptp(noisy, axis=0)
    x = np.round((noisy - low) / span * 4095).astype(np.int32)
    y = np.round((strain - strain.min()) / np.ptp(strain) * 4095).astype(np.int32)
    own, joint, target = subset_entropies(x, y)
    for mask in range(1, 2**5):
        chosen = [i for i in range(5) if mask >> i & 1]
        _, states = np.unique(x[:, chosen], axis=0, return_inverse=True)
        theirs = mutual_info_score(states.ravel(), y) / np.log(2.0)
        assert own[mask] + target - joint[mask] == pytest.approx(theirs, abs=EXACT)


def test_a_largest_size_leaves_the_rest_out() -> None:
    x = codes(1, 300, 4, 7)
    whole, _, _ = subset_entropies(x[:, :3], x[:, 3])
    part, _, _ = subset_entropies(x[:, :3], x[:, 3], max_size=2)
    assert np.array_equal(part[:7], whole[:7])
    assert part[7] == 0 < whole[7]


@given(st.integers(0, 10**6), st.integers(2, 300), st.sampled_from([2, 5, 60]))
@settings(max_examples=40, deadline=None)
def test_identities(seed: int, samples: int, states: int) -> None:
    x, y, z = codes(seed, samples, 3, states).T
    both = np.stack([x, z], axis=1)
    # chain rule, symmetry, I(X,X;Y) = I(X;Y), I(X;X) = H(X)
    chain = mutual_information(x, y) + conditional_mutual_information(z, y, x)
    assert mutual_information(both, y) == pytest.approx(chain, abs=1e-11)
    assert mutual_information(x, y) == pytest.approx(mutual_information(y, x), abs=EXACT)
    twice = np.stack([x, x], axis=1)
    assert mutual_information(twice, y) == pytest.approx(mutual_information(x, y), abs=EXACT)
    assert mutual_information(x, x) == pytest.approx(entropy(x), abs=EXACT)
    assert conditional_mutual_information(x, y, y) == pytest.approx(0, abs=1e-11)
    # invariance under relabelling and under the order of the samples
    rng = np.random.default_rng(seed)
    names = rng.permutation(states + 3) + 7
    order = rng.permutation(samples)
    renamed = mutual_information(names[x][order], y[order])
    assert renamed == pytest.approx(mutual_information(x, y), abs=EXACT)


def test_bits_and_nats_are_the_same_information() -> None:
    x, y = codes(2, 500, 2, 9).T
    nats = np.log(2) * mutual_information(x, y)
    assert mutual_information(x, y, unit="nats") == pytest.approx(nats, rel=EXACT)
    with pytest.raises(ValueError, match="bits or nats"):
        entropy(x, unit="bans")  # type: ignore[arg-type]


def test_a_weight_counts_a_sample_so_many_times() -> None:
    x, y = codes(3, 300, 2, 9).T
    weights = np.random.default_rng(3).integers(1, 4, 300)
    whole = weights.astype(float)
    again = np.repeat(np.arange(300), weights)
    assert entropy(x, weights=whole) == pytest.approx(entropy(x[again]), abs=EXACT)
    direct = mutual_information(x[again], y[again])
    assert mutual_information(x, y, weights=whole) == pytest.approx(direct, abs=EXACT)


def test_many_wide_variables_do_not_overflow() -> None:
    """Twenty variables of 15 bits: 2**300 joint states, none of which is ever numbered."""
    rng = np.random.default_rng(0)
    x = rng.integers(0, 2**15, (500, 20))
    assert entropy(x) == pytest.approx(np.log2(500), abs=EXACT)
    huge = np.array([2**62, -(2**62), 2**62, 5])
    assert entropy(huge) == pytest.approx(1.5, abs=EXACT)


def test_fractions_are_refused_as_labels_and_keep_their_states_as_targets() -> None:
    strain = np.linspace(0, 0.4, 300)
    with pytest.raises(ValueError, match="integers"):
        entropy(strain)
    assert entropy(labels_of(strain)) == pytest.approx(np.log2(300), abs=EXACT)
    fine = np.random.default_rng(1).random(20000)
    label = labels_of(fine)
    assert label.min() == 0
    assert label.max() == 4095
    assert np.all(np.diff(label[np.argsort(fine), 0]) >= 0)
    whole = np.array([[3.0], [1.0], [3.0]])
    assert labels_of(whole).tolist() == [[1], [0], [1]]


@pytest.mark.parametrize("flip", [0.0, 0.05, 0.3, 0.5])
@pytest.mark.parametrize("samples", [2000, 50000])
def test_binary_symmetric_channel(flip: float, samples: int) -> None:
    """I = 1 - H2(flip) bits; four joint states bias it by at most 2 / n nats."""
    rng = np.random.default_rng(4)
    x = rng.integers(0, 2, samples)
    y = x ^ (rng.random(samples) < flip)
    losses = [p * np.log2(p) for p in (flip, 1 - flip) if p]
    assert mutual_information(x, y.astype(int)) == pytest.approx(
        1 + sum(losses), abs=4 / np.sqrt(samples)
    )


def test_plug_in_is_biased_upwards_by_what_miller_says() -> None:
    """Independent labels: (a - 1)(b - 1) / 2n nats, not zero."""
    rng = np.random.default_rng(5)
    values = [
        mutual_information(rng.integers(0, 8, 4000), rng.integers(0, 16, 4000), unit="nats")
        for _ in range(40)
    ]
    assert np.mean(values) == pytest.approx(7 * 15 / 8000, rel=0.1)


@pytest.mark.parametrize(("samples", "tolerance"), [(500, 0.2), (2000, 0.1), (8000, 0.06)])
@pytest.mark.parametrize("noise", [1.0, 0.3, 1 / 30])
def test_nearest_neighbours_on_gaussians(samples: int, tolerance: float, noise: float) -> None:
    rng = np.random.default_rng(6)
    y = rng.normal(size=samples)
    x = y + noise * rng.normal(size=samples)
    truth = 0.5 * np.log2(1 + 1 / noise**2)
    assert nearest_neighbour(x, y) == pytest.approx(truth, abs=tolerance)
    assert nearest_neighbour(3 - 40 * x, y) == pytest.approx(nearest_neighbour(x, y), abs=1e-9)
    residual = y - np.polyval(np.polyfit(x, y, 1), x)
    assert gaussian(float(np.var(y)), float(np.var(residual))) == pytest.approx(
        truth, abs=tolerance
    )


def test_nearest_neighbours_on_uniform_plus_uniform_noise() -> None:
    """X uniform on [0, 1], Y = X + uniform noise of width a <= 1: I = a / 2 - log a nats."""
    rng = np.random.default_rng(7)
    for width in (0.1, 0.5, 1.0):
        x = rng.random(8000)
        y = x + width * rng.random(8000)
        truth = (width / 2 - np.log(width)) / np.log(2)
        assert nearest_neighbour(x, y) == pytest.approx(truth, abs=0.06)


def test_nearest_neighbours_with_atoms() -> None:
    """Discrete against its blurred copy, and a target that rests half of the time."""
    rng = np.random.default_rng(8)
    state = rng.integers(0, 4, 8000)
    assert nearest_neighbour(state, state) == pytest.approx(2, abs=0.02)
    blurred = state + 0.01 * rng.normal(size=8000)
    assert nearest_neighbour(blurred, state) == pytest.approx(2, abs=0.02)
    # Y = 0 at rest, else Gaussian; X = Y + noise. I = H(rest) given by the two-part mixture.
    rest = rng.random(8000) < 0.5
    y = np.where(rest, 0.0, 10 + rng.normal(size=8000))
    x = y + 0.1 * rng.normal(size=8000)
    truth = 1 + 0.5 * 0.5 * np.log2(1 + 100)
    assert nearest_neighbour(x, y) == pytest.approx(truth, abs=0.05)
    assert nearest_neighbour(np.ones(100), np.arange(100)) == 0
