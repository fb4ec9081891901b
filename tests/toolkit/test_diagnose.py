"""The diagnosis: right on cases whose truth is known, and silent where there is nothing."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import threading
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, fftconvolve, lfilter

import softsense as ss
from softsense.cli.main import main
from softsense.diagnose import augment, diagnose, folder, telling, vetting
from softsense.diagnose.channel import Channel
from softsense.diagnose.cores import all_at_once, one_core
from softsense.diagnose.design import Entry, Fit
from softsense.diagnose.engine import BETWEEN_S, change_of
from softsense.diagnose.moved import Together
from softsense.diagnose.nominal import (
    curves_of,
    denoise,
    history_basis,
    history_weights,
    lost_codes,
    motion_of,
    nominals,
    reference_of,
)
from softsense.diagnose.search import (
    Model,
    _fewest_first,
    _said_elsewhere,
    _walk_last,
    by_price,
    priced,
    search,
)
from softsense.diagnose.tones import without_tone
from softsense.diagnose.variance import Finding, cleaned, evident, findings, noise_beside
from softsense.diagnose.walk import innovations, likely_gain
from softsense.diagnose.wandering import jerky, moved_by
from softsense.effects import all_effects
from softsense.errors import SoftsenseError
from softsense.recording import FrontEnd, Recording
from softsense.simulate.motion import random_motion

GAP = Path(__file__).parents[1] / "benchmarks" / "gap"
RATE_HZ = 20.0
SAMPLES = 6000


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


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_is_no_gap(seed: int) -> None:
    x, codes = clean(seed)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes, 2, noise=2.0))
    assert not result.data["gap"]["present"]
    assert result.effects == ()
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize(
    ("effect", "channels"),
    [
        ("drift", ["s1", "s2"]),
        ("delay", ["s1", "s2", "s3", "s4"]),
        ("step", ["s2"]),
        ("crosstalk", ["s3"]),
        ("spikes", ["s1"]),
        ("interference", ["s4"]),
        ("noise", ["s2"]),
        ("overshoot", ["s1"]),
    ],
)
def test_a_hidden_effect_is_named_with_its_channels(effect: str, channels: list[str]) -> None:
    x, codes = clean(5)
    result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, effect), 2))
    assert result.effects == (effect,)
    assert result.data["gap"]["present"]
    found = result.data["effects"][0]
    assert found["channels"] == channels
    assert found["kind"] == "add"
    if effect == "step":
        assert abs(result.data["where"]["onset_s"] - 171.0) < 5.0
    if effect in ("drift", "delay", "crosstalk", "overshoot"):
        assert result.data["after"]["shrink"] > 0.9
        low, high = result.data["after"]["shrink_ci95"]
        assert low <= result.data["after"]["shrink"] <= high
        assert result.data["after"]["rmse_codes"] < 0.5 * result.data["gap"]["rmse_codes"]


@pytest.mark.parametrize(
    ("effect", "key", "truth", "width"),
    [("delay", "delay_s", 1.6 / RATE_HZ, 0.01), ("step", "onset_s", 171.0, 0.5)],
)
def test_the_interval_of_a_parameter_holds_the_truth(effect, key, truth, width) -> None:
    x, codes = clean(5)
    result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, effect), 2))
    low, high = result.data["effects"][0]["parameters"][key]["ci95"]
    assert low <= truth <= high
    assert 0.0 < high - low < width


def test_no_parameter_is_claimed_to_be_exact() -> None:
    x, codes = clean(5)
    for effect in ("delay", "step", "overshoot", "drift"):
        result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, effect), 2))
        for name, found in result.data["effects"][0]["parameters"].items():
            low, high = found["ci95"]
            assert low < found["value"] < high, (effect, name)


@pytest.mark.parametrize(("common", "said"), [(True, "temperature"), (False, "random_walk")])
def test_a_walk_that_all_channels_share_is_a_temperature(common: bool, said: str) -> None:
    """One that nobody logged: the same for every channel, each with its own gain."""
    x, codes = clean(6)
    rng = np.random.default_rng(3)
    walks = np.cumsum(rng.normal(size=codes.shape), axis=0) * 0.4
    if common:
        walks = walks[:, :1] * np.array([1.0, 0.6, -0.8, 1.3]) * (1.0 + 0.2 * x[:, None])
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + walks, 2))
    assert result.effects == (said,)
    others = [other["name"] for other in result.data["effects"][0]["alternatives"]]
    assert ("random_walk" in others) == common
    assert any("log the temperature" in text for text in result.data["advice"]) == common


def test_an_effect_beside_a_walk_is_named_too() -> None:
    x, codes = clean(8)
    walks = np.cumsum(np.random.default_rng(5).normal(size=codes.shape), axis=0) * 0.2
    result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, "overshoot") + walks, 2))
    assert set(result.effects) == {"overshoot", "random_walk"}


def test_a_step_beside_walks_is_named_too() -> None:
    """No other time foretells it, and a walk follows it with one move."""
    x, codes = clean(21)
    made = codes + np.cumsum(np.random.default_rng(1).normal(0.0, 0.25, codes.shape), axis=0)
    made[SAMPLES // 3 :, :2] += 25.0
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"random_walk": ["s1", "s2", "s3", "s4"], "step": ["s1", "s2"]}
    assert not result.data["unexplained"]["unknown_effect"]
    assert result.data["where"]["onset_s"] == pytest.approx(SAMPLES / 3 / RATE_HZ, abs=1.0)


def test_a_walk_that_jumps_has_a_step_instead_of_another_effect(monkeypatch) -> None:
    """Where that costs not much more, and it jumps no more then."""
    gain, step = (Model(frozenset({vetting.WALK, name}), (), 100.0) for name in ("gain", "step"))
    for jumps, price, said in (
        ({"gain"}, 90.0, step),
        ({"gain"}, 60.0, None),
        ({"gain", "step"}, 90.0, None),
        ({"step"}, 90.0, None),
    ):
        monkeypatch.setattr(vetting, "_jerky", lambda _, made, j=jumps: bool(made.names & j))
        best = replace(gain, price=price)
        assert vetting._stepped((), [best, step]) is (said or best)


@pytest.mark.parametrize(("seed", "slow"), [(13, "drift"), (12, "relaxation"), (13, "relaxation")])
def test_two_effects_of_the_material_are_looked_at_again_together(seed: int, slow: str) -> None:
    """A break that heals is found where it is beside what is slow, though neither acts on what the
    other does."""
    x, codes = clean(seed)
    t = np.arange(SAMPLES) / RATE_HZ
    since = np.maximum(t - 171.03, 0.0)
    made = codes.copy()
    if slow == "drift":
        behind = 4.0 * codes[:, :2] / 4095 * (1.0 - codes[:, :2] / 4095)
        made[:, :2] -= 25.0 * np.expm1(-((t / 150.0) ** 1.7))[:, None] * behind
        size, heals_s, felt = 120.0, 23.0, behind[:, 1]
    else:
        late = 0.6 * filtered(codes, 3.0) + 0.4 * filtered(codes, 17.0)
        made[:, 1] += 0.12 * (late - codes)[:, 1]
        size, heals_s, felt = 90.0, 13.0, 1.0
    made[:, 1] -= size * (t >= 171.03) * (0.6 + 0.4 * np.exp(-since / heals_s)) * felt
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"step", slow}


def test_a_drift_beside_another_channels_walk_is_named_too() -> None:
    x, codes = clean(45)
    made = codes.copy()
    made[:, [0, 2]] += np.cumsum(np.random.default_rng(4).normal(0.0, 0.35, (len(x), 2)), axis=0)
    made[:, 1] += 10.0 * np.log1p(np.arange(len(x)) / RATE_HZ / 20.0)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"drift": ["s2"], "random_walk": ["s1", "s3"]}


def test_one_walk_of_many_may_go_in_jumps() -> None:
    x, codes = clean(46)
    rng = np.random.default_rng(31)
    steps = rng.normal(0.0, 0.4, codes.shape)
    steps[:, 1] *= 0.1
    steps[rng.choice(len(x), 30, replace=False), 1] = rng.normal(0.0, 4.0, 30)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + np.cumsum(steps, axis=0), 2))
    assert result.effects == ("random_walk",)
    assert not result.data["unexplained"]["unknown_effect"]


def test_what_wanders_alike_beside_an_effect_is_no_walk() -> None:
    """It may be what the effect's equation does not say, and so it is no temperature either."""
    x, codes = clean(8)
    rng = np.random.default_rng(5)
    shared = np.cumsum(rng.normal(size=SAMPLES)) * 0.3
    own = np.cumsum(rng.normal(size=codes.shape), axis=0) * 0.1
    made = hide(x, codes, "overshoot") + shared[:, None] + own
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert "overshoot" in result.effects
    assert not set(result.effects) & {"random_walk", "temperature"}
    assert result.data["unexplained"]["unknown_effect"]


def test_a_step_that_heals_is_still_a_step() -> None:
    x, codes = clean(10)
    since = np.maximum(np.arange(SAMPLES) / RATE_HZ - 120.0, 0.0)
    hurt = codes.copy()
    hurt[:, 1] += (since > 0.0) * (8.0 + 12.0 * np.exp(-since / 35.0))
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("step",)
    assert result.data["where"]["onset_s"] == pytest.approx(120.0, abs=1.0)


def test_a_step_that_takes_a_while_is_still_a_step() -> None:
    x, codes = clean(10)
    torn = codes.copy()
    torn[:, 1] += 20.0 * np.clip((np.arange(SAMPLES) / RATE_HZ - 120.0) / 4.0, 0.0, 1.0)
    result = diagnose(recorded(x, codes, 1), recorded(x, torn, 2))
    assert result.effects == ("step",)
    assert result.data["where"]["onset_s"] == pytest.approx(120.0, abs=1.0)


def test_steps_that_bend_the_curve_or_come_in_two_blows_are_still_steps() -> None:
    x, codes = clean(10)
    t = np.arange(SAMPLES) / RATE_HZ
    share = (codes[:, 1] - codes[:, 1].min()) / np.ptp(codes[:, 1])
    after = {
        "bent": (t > 120.0) * 60.0 * (0.3 + share + 2.0 * share**2),
        "in two blows": 16.0 * (t > 120.0) + 9.0 * (t > 138.0),
    }
    for form, change in after.items():
        hurt = codes.copy()
        hurt[:, 1] += change
        result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
        assert result.effects == ("step",), form
        assert result.data["where"]["onset_s"] == pytest.approx(120.0, abs=1.0), form
        assert result.data["unexplained"]["share"] < 0.01, form


@pytest.mark.parametrize(("course", "left"), [("comes back", 1e-3), ("gives way", 2e-4)])
def test_what_goes_on_after_a_step_is_the_steps(course: str, left: float) -> None:
    """It comes back with the logarithm of time, or gives way a little more."""
    x, codes = clean(10)
    since = np.maximum(np.arange(SAMPLES) / RATE_HZ - 120.0, 0.0)
    logarithm = np.log1p(since / 2.0)
    after = 1.0 - (0.12 * logarithm if course == "comes back" else 0.4 * np.exp(-since / 15.0))
    hurt = codes.copy()
    hurt[:, 1:3] += 40.0 * ((since > 0.0) * after)[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("step",)
    assert result.data["where"]["onset_s"] == pytest.approx(120.0, abs=0.1)
    assert result.data["unexplained"]["share"] < left


def test_one_circuit_follows_the_other() -> None:
    """In which order is found out, and each parameter keeps its interval."""
    x, codes = clean(15)
    top = float(np.quantile(codes[:, 0], 0.9))
    for made in (
        filtered(np.minimum(codes[:, :1], top), 0.4),
        np.minimum(filtered(codes[:, :1], 0.4), top),
    ):
        hurt = np.concatenate([made, codes[:, 1:]], axis=1)
        sim = recorded(x, codes, 1)
        result = diagnose(sim, recorded(x, hurt, 2))
        assert set(result.effects) == {"lag", "saturation"}
        change = result.augmented - sim.codes
        assert np.abs(change[:, 0] - (hurt - codes)[:, 0]).mean() < 0.7
        lag = next(effect for effect in result.data["effects"] if effect["name"] == "lag")
        low, high = lag["parameters"]["tau_s"]["ci95"]
        assert low <= 0.4 <= high


@pytest.mark.parametrize(("seed", "tau_s", "share"), [(12, 0.15, 0.05), (16, 0.2, 0.15)])
def test_a_lag_and_crosstalk_are_no_relaxation(seed: int, tau_s: float, share: float) -> None:
    """Many time constants leave little of both, and two exact equations next to nothing."""
    x, codes = clean(seed)
    late = filtered(codes, tau_s)
    made = late + share * (np.roll(late, 1, axis=1) - late)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"lag", "crosstalk"}


def test_a_fast_circuit_is_not_the_materials_fastest_part() -> None:
    x, codes = clean(52)
    paced = codes + sum(0.05 * (filtered(codes, tau_s) - codes) for tau_s in (2.0, 8.0, 30.0))
    made = np.concatenate([filtered(paced[:, :3], 0.2), paced[:, 3:]], axis=1)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"lag": ["s1", "s2", "s3"], "relaxation": ["s1", "s2", "s3", "s4"]}


def test_loud_noise_spreads_the_edges_of_a_converter() -> None:
    """Some heavy bits weigh wrong, and noise of so many codes is there before they are set."""
    x, codes = clean(70)
    motion = motion_of(x, 0.05, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[1]
    wrong = np.zeros(12)
    wrong[6:10] = 8.0, -14.0, 25.0, -18.0
    for noise in (0.5, 2.5, 4.5):
        met = np.random.default_rng(3).normal(codes[:, 1], noise, (400, len(x)))
        off = ((np.rint(met).astype(np.int64)[..., None] >> np.arange(12) & 1) @ wrong).mean(axis=0)
        left = [
            np.var(off - made.columns @ np.linalg.lstsq(made.columns, off)[0]) / np.var(off)
            for made in all_effects()["adc_nonlinearity"].explain(nominal)
            if made.form == "bits"
        ]
        assert min(left) < 0.001


def test_a_converters_curve_goes_on_where_other_effects_take_the_signal() -> None:
    x, codes = clean(70)
    motion = motion_of(x, 0.05, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[1]
    far = nominal.rest + 1.15 * (nominal.u - nominal.rest)
    at = 2.0 * (far - far.min()) / np.ptp(far) - 1.0
    off = np.polynomial.chebyshev.chebval(at, [0.0, 0.0, 0.0, 9.0, -8.0, 7.0, 6.0])
    off -= off.mean()
    left = [
        np.var(off - columns @ np.linalg.lstsq(columns, off)[0]) / np.var(off)
        for made in all_effects()["adc_nonlinearity"].explain(nominal.acting_on(far, None))
        if made.form == "polynomial"
        for columns in [made.columns - made.columns.mean(axis=0)]
    ]
    assert min(left) < 1e-6


def test_a_curve_that_is_steep_where_it_is_rarely_met_is_the_converters_alone() -> None:
    x, codes = clean(69)
    made = codes.copy()
    for c in range(3):
        low, high = codes[np.argmin(x), c], codes[np.argmax(x), c]
        share = (codes[:, c] - low) / (high - low)
        bent = np.polynomial.chebyshev.chebval(2.0 * share - 1.0, [0, 0, 0, -0.3, 0.6, -1.2, -1.8])
        made[:, c] += 25.0 * bent
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("adc_nonlinearity",)
    assert result.data["unexplained"]["share"] < 0.003


def test_unequal_capacitors_are_neither_noise_nor_unknown() -> None:
    """Their small bits are wrong too, and beside a drift they are met at other codes."""
    x, codes = clean(53)
    wrong = np.random.default_rng(3).normal(size=12) * np.sqrt(2.0 ** np.arange(12))
    slow = 40.0 * (1.0 - np.exp(-np.arange(len(x)) / RATE_HZ / 150.0))
    for drift, names in ((0.0 * slow, set()), (slow, {"drift"})):
        met = recorded(x, codes + drift[:, None], 2)
        converted = met.codes + (met.codes[..., None] >> np.arange(12) & 1) @ wrong
        real = replace(met, codes=np.clip(np.rint(converted), 0, 4095).astype(np.int32))
        result = diagnose(recorded(x, codes, 1), real)
        assert set(result.effects) == {"adc_nonlinearity"} | names
        assert not result.data["unexplained"]["unknown_effect"]


def test_a_supply_that_all_channels_pull_down_is_crosstalk() -> None:
    x, codes = clean(11)
    sagging = codes * (1.0 - 0.08 * codes.mean(axis=1, keepdims=True) / 4095.0)
    sagging[:, 2:] = codes[:, 2:]
    result = diagnose(recorded(x, codes, 1), recorded(x, sagging, 2))
    assert result.effects == ("crosstalk",)
    assert result.data["effects"][0]["channels"] == ["s1", "s2"]


def test_a_neighbour_is_heard_through_a_capacitance() -> None:
    """In series only what is fast comes through, beside its own; to ground it comes late."""
    x, codes = clean(11)
    series, ground = (codes[:, 0] - filtered(codes[:, :1], tau)[:, 0] for tau in (1.0, 0.15))
    for change in (0.3 * series, 0.15 * (codes[:, 0] - ground - codes[:, 1])):
        hurt = codes.copy()
        hurt[:, 1] += change
        result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
        assert result.effects == ("crosstalk",)
        assert result.data["effects"][0]["channels"] == ["s2"]


@pytest.mark.parametrize(("source", "channel"), [(3, 1), (1, 3)])
def test_a_share_is_no_less_crosstalk_where_the_zero_was_set_with_it(
    source: int, channel: int
) -> None:
    """Instead of its own, or lifting the ground that both share."""
    x, codes = clean(11)
    moved, own = codes[:, source] - codes[0, source], codes[:, channel]
    for change in (0.06 * (moved - (own - own[0])), 0.03 * moved * (1.0 - own / 4095.0)):
        hurt = codes.copy()
        hurt[:, channel] += change
        result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
        assert result.effects == ("crosstalk",)
        assert result.data["effects"][0]["channels"] == [f"s{channel + 1}"]


def test_what_a_capacitor_keeps_that_is_charged_between_channels_is_crosstalk() -> None:
    """To the middle of the converter's range, or to nothing, wherever the other one rests."""
    x, codes = clean(11)
    for share, zero in ((0.1, 2048.0), (-0.08, 0.0)):
        hurt = codes.copy()
        hurt[:, 1] += share * (codes[:, 3] - zero)
        result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
        assert result.effects == ("crosstalk",)
        assert result.data["after"]["shrink"] > 0.99


def test_a_step_is_looked_for_when_it_says_all_of_another_channel() -> None:
    """And not when it says a little of what is something else on several."""
    x, codes = clean(11, 8000)
    since = np.arange(8000) / RATE_HZ - 223.0
    step = np.where(since > 0.0, 30.0 + 50.0 * np.exp(-np.maximum(since, 0.0) / 40.0), 0.0)
    made = codes.copy()
    for channel in (0, 1, 3):
        behind = filtered(codes[:, channel : channel + 1], 12.0)[:, 0]
        made[:, channel] += 0.3 * (behind - codes[:, channel])
    made[:, [0, 2]] += step[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert {e["name"]: e["channels"] for e in result.data["effects"]} == {
        "relaxation": ["s1", "s2", "s4"],
        "step": ["s1", "s3"],
    }


@pytest.mark.parametrize(
    ("seed", "creeping", "railed", "part"),
    [
        # What creeps is seen plainly where there is no rail.
        (11, (0, 1, 2, 3), (1, 3), 0.8),
        (11, (0, 1, 2, 3), (0, 2, 3), 0.6),
        # A static curve stands for the rail at first.
        (21, (1, 3), (0, 1, 2, 3), 0.8),
    ],
)
def test_what_creeps_into_a_rail(
    seed: int, creeping: tuple[int, ...], railed: tuple[int, ...], part: float
) -> None:
    x, codes = clean(seed, 8000)
    made = codes.copy()
    for channel in creeping:
        made[:, channel] += 0.3 * (filtered(codes, 12.0) - codes)[:, channel]
    for channel in railed:
        made[:, channel] = np.minimum(made[:, channel], np.quantile(made[:, channel], part))
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert {e["name"]: e["channels"] for e in result.data["effects"]} == {
        "relaxation": [f"s{channel + 1}" for channel in creeping],
        "saturation": [f"s{channel + 1}" for channel in railed],
    }


@pytest.mark.parametrize(
    ("half", "seed", "names"),
    [
        # The coarse grids have it, and then each effect alone goes elsewhere.
        ("wearable", 160041, ("step", "drift")),
        # All pairs that cost least on the coarse grids have a walk.
        ("optical", 160025, ("gain", "step")),
    ],
)
def test_a_close_look_begins_where_the_coarse_one_stood(
    monkeypatch, half: str, seed: int, names: tuple[str, ...]
) -> None:
    """Cases of the benchmark that are not held out."""
    monkeypatch.syspath_prepend(str(GAP))
    excitation = "typical" if half == "wearable" else "rich"
    case = importlib.import_module(half).make(seed, names, excitation)
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_a_rail_is_tried_in_place_of_a_converters_curve(monkeypatch) -> None:
    """Side by side with what it cuts off, a rail says nothing, and any curve something."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("liquid").make(170012, ("saturation", "relaxation"), "typical")
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)
    found = diagnose(case.sim, case.real, without=["saturation"]).effects
    assert "saturation" not in found


def test_what_moves_nothing_on_a_channel_keeps_its_curve_there() -> None:
    """Without it, that channel would seem to cost little."""
    x, codes = clean(3, 1500)
    channel = first_channel(x, codes, 20.0 * x**2, ["gain"])
    fit = min((channel._fit((("gain", k),), 2) for k in range(3)), key=channel.price)
    assert fit.static is not None
    assert channel.with_motion(fit, {}, bare=True) is fit


def test_a_curve_of_what_was_read_leaves_no_less_than_the_noise() -> None:
    """What noise moves goes with what was read."""
    x, codes = clean(3, 1500)
    channel = first_channel(x, codes, np.cumsum(np.random.default_rng(2).normal(size=1500)), [])
    nothing = Fit((("random_walk", 0),), np.zeros(1), np.zeros(0), None)
    assert channel.gain > 0.1
    assert channel.left(nothing) == 0.0


def test_ways_of_hysteresis_that_grow_with_the_way_gone() -> None:
    """Valanis, with a time step for each sample."""
    x, codes = clean(12, 8000)
    inner, made = 0.0, codes.copy()
    state, states = np.zeros(2), np.zeros((len(x), 2))
    for k in range(1, len(x)):
        way = abs(x[k] - x[k - 1])
        inner += way
        fades = np.array([4.0, 16.0]) * way / (1.0 + 0.02 * inner)
        state = np.exp(-fades) * state + x[k] - x[k - 1]
        states[k] = state
    made += np.array([60.0, 90.0, -70.0, 80.0]) * states.sum(axis=1)[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("hysteresis",)
    assert not result.data["unexplained"]["unknown_effect"]
    assert result.data["after"]["shrink"] > 0.99


def test_crosstalk_of_a_capacitor_whose_dielectric_gives_back() -> None:
    x, codes = clean(13, 8000)
    late, made = filtered(codes, 1.5), codes.copy()
    made[:, 2] += 0.02 * (codes[:, 1] - codes[:, 2]) + 0.04 * (late[:, 1] - codes[:, 2])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.traces[0].form == "absorbing"
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("crosstalk", ["s3"])]
    assert result.data["after"]["shrink"] > 0.99


def test_crosstalk_through_a_capacitance_may_be_raised() -> None:
    x, codes = clean(14, 8000)
    made = codes.copy()
    made[:, 0] += 1.6 * (codes - filtered(codes, 0.15))[:, 3]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("crosstalk", ["s1"])]


def test_an_effect_says_all_of_a_small_gap_whatever_it_costs_to_name_it() -> None:
    fits = {"step": Fit((("step", 0),), None, None, None)}
    entries = {"step": [Entry((), None, np.zeros((9, 1)), 0, None, "")]}

    def channel(excess: float, left: float) -> SimpleNamespace:
        price = 1000.0 + 250.0 + left
        return SimpleNamespace(
            excess=excess,
            samples=1000,
            effect_price=250.0,
            entries=entries,
            best=lambda names: fits[min(names)],
            price=lambda fit: price,
        )

    small, large = channel(13e3, 100.0), channel(60e3, 20e3)
    assert _said_elsewhere([small, large], ["step"]) == [{}, {"step": entries["step"][0]}]
    assert _said_elsewhere([channel(13e3, 1e3), large], ["step"]) == [{}, {}]


def test_the_best_is_no_worse_for_what_was_tried_upon_it(monkeypatch) -> None:
    x, codes = clean(11)
    channel = first_channel(x, codes, 20.0 * (np.arange(SAMPLES) > 3000), ["step", "drift"])
    beyond = Together(np.inf, 1.0)
    best = search([channel], ["step", "drift"], beyond)[0]
    assert best.names == {"step"}

    def upon(channels, models, names):
        return [replace(models[0], names=frozenset({"drift"}), price=1e9)]

    monkeypatch.setattr(importlib.import_module("softsense.diagnose.search"), "_upon_best", upon)
    assert search([channel], ["step", "drift"], beyond)[0].names == {"step"}


def test_fits_begin_with_what_another_channel_has_where_this_one_has_it_too() -> None:
    x, codes = clean(11)
    channel = first_channel(x, codes, 30.0 * x, ["crosstalk"])
    before = len(channel.entries["crosstalk"])
    entry = channel.entries["crosstalk"][0].apart()
    elsewhere = replace(entry.candidate, values={"source": 0.0})
    for other in (replace(entry, number=10**6), replace(entry, candidate=elsewhere)):
        channel.begin_with({"crosstalk": other})
        assert len(channel.entries["crosstalk"]) == before
    channel.begin_with({"crosstalk": entry})
    assert len(channel.entries["crosstalk"]) == before + 1


def test_a_contact_that_heals_in_part_is_a_step_behind_a_divider() -> None:
    x, codes = clean(11)
    since = np.maximum(np.arange(SAMPLES) / RATE_HZ - 123.0, 0.0)
    healed = np.where(since > 0.0, 0.5 + 0.5 * np.exp(-since / 25.0), 0.0)
    hurt = codes.copy()
    hurt[:, 1] += 400.0 * healed * (1.0 - codes[:, 1] / 4095.0) ** 2
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("step",)
    assert abs(result.data["where"]["onset_s"] - 123.0) < 1.0
    assert result.data["after"]["shrink"] > 0.99


def test_overshoot_may_be_larger_one_way() -> None:
    x, codes = clean(11)
    rate = np.gradient(x) * RATE_HZ
    hurt = codes.copy()
    hurt[:, 0] += 300.0 * filtered(np.where(rate > 0.0, rate, -0.3 * rate)[:, None], 0.5)[:, 0]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("overshoot",)


def test_overshoot_may_be_over_at_once() -> None:
    rng = np.random.default_rng(0)
    times, turns = np.cumsum(rng.uniform(0.5, 4.0, 1000)), rng.uniform(0.0, 1.0, 1000)
    x = np.interp(np.arange(SAMPLES) / RATE_HZ, times, turns)
    codes, speed = sensed(x), np.abs(np.gradient(x)) * RATE_HZ
    more = np.array([20.0, -10.0, 8.0, 0.0]) * speed[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + more, 2))
    assert result.effects == ("overshoot",)
    assert np.std(change_of(result, 12) - more) < 0.1


def test_overshoot_may_be_what_a_current_tunnels_through() -> None:
    x, codes = clean(11)
    opened = filtered(np.abs(np.gradient(x))[:, None] * RATE_HZ, 0.4)
    made = codes + np.expm1(4.0 * opened) * [3.0, 0.0, -2.0, 0.0]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("overshoot",)
    assert result.data["unexplained"]["share"] < 0.01


def test_overshoot_may_begin_at_some_strain_rate() -> None:
    x, codes = clean(11)
    beyond = np.maximum(np.abs(np.gradient(x)) * RATE_HZ - 0.15, 0.0)
    hurt = codes.copy()
    hurt[:, 0] += 600.0 * filtered(beyond[:, None], 0.6)[:, 0]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("overshoot",)
    assert result.data["unexplained"]["share"] < 5e-3


def test_a_gain_under_a_motion_that_never_rests_is_no_overshoot() -> None:
    """Where all breaks all the time, what is broken shows as the signal does."""
    rng = np.random.default_rng(0)
    t = np.arange(SAMPLES) / RATE_HZ
    turns = 2.0 * np.pi * rng.uniform(0.02, 0.8, 4) * t[:, None] + rng.uniform(0.0, 6.0, 4)
    x = np.sin(turns) @ np.array([1.0, 0.6, 0.5, 0.3])
    x = (x - x.min()) / np.ptp(x)
    columns = []
    for _ in range(4):
        s = x + rng.uniform(-0.3, 0.4) * x**2
        zero, span = rng.uniform(800, 2600), rng.uniform(400, 900) * rng.choice([-1, 1])
        share = rng.uniform(0.05, 0.2)
        slow = filtered(s[:, None], rng.uniform(1.0, 8.0))[:, 0]
        columns.append(zero + span * (s + share * (slow - s)))
    codes = np.stack(columns, axis=1)
    signs, zeros = rng.choice([-1, 1], 4), rng.uniform(-300.0, 300.0, 4)
    made = codes + 0.03 * signs * (codes - codes.mean(axis=0) + zeros)
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("gain",)


def test_a_clock_that_wandered_is_foretold_to_be_where_it_mostly_was() -> None:
    x = random_motion(SAMPLES + 4000, 2.0 / RATE_HZ, 48)
    index = np.arange(len(x), dtype=float)
    at = np.linspace(0.0, SAMPLES, 15)
    knots = 0.08 * np.random.default_rng(3).normal(size=15)
    knots[-2:] = 0.3
    late_s = np.where(index < SAMPLES, np.interp(index, at, knots), 0.0)
    codes = sensed(x)
    made = np.stack([np.interp(index - late_s * RATE_HZ, index, c) for c in codes.T], axis=1)
    first, then = slice(0, SAMPLES), slice(SAMPLES, None)
    given = recorded(x[first], codes[first], 1), recorded(x[first], made[first], 2)
    result = diagnose(*given)
    assert result.effects == ("delay",)
    later = augment(result, recorded(x[then], codes[then], 3, noise=0.0)).codes
    # The last delay, 0.3 s, would be further off than one of 0.1 s.
    off = np.stack([np.interp(index - 0.1 * RATE_HZ, index, c) for c in codes.T], axis=1)
    assert np.std((later - made[then])[1000:]) < np.std((off - made)[then][1000:])


@pytest.mark.parametrize(
    ("period_s", "set_right"), [(9.0, True), (47.0, True), (83.0, False)], ids=str
)
def test_a_clock_that_comes_and_goes_does_so_later_too(period_s: float, set_right: bool) -> None:
    between = round(BETWEEN_S * RATE_HZ)
    x = random_motion(SAMPLES + between + 4000, 1.0 / RATE_HZ, 48)
    index = np.arange(len(x), dtype=float)
    turns = index / RATE_HZ / period_s + 0.3
    late = turns % 1.0 if set_right else 0.5 + 0.5 * np.sin(2.0 * np.pi * turns)
    codes = sensed(x)
    made = np.stack([np.interp(index - 2.0 - 3.0 * late, index, c) for c in codes.T], axis=1)
    first, then = slice(0, SAMPLES), slice(SAMPLES + between, None)
    result = diagnose(recorded(x[first], codes[first], 1), recorded(x[first], made[first], 2))
    assert result.effects == ("delay",)
    later = augment(result, recorded(x[then], codes[then], 3, noise=0.0)).codes
    even = np.stack([np.interp(index - 3.5, index, c) for c in codes.T], axis=1)
    assert np.std(later - made[then]) < 0.2 * np.std((even - made)[then])


def test_a_drivers_smoothing_of_less_than_a_sample_is_a_lag() -> None:
    x = random_motion(SAMPLES, 4.0 / RATE_HZ, 47)
    codes = sensed(x)
    hurt = codes.copy()
    hurt[:, 1:3] = filtered(codes, 0.042)[:, 1:3]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("lag", ["s2", "s3"])]


def test_overshoot_may_come_sooner_than_it_goes() -> None:
    x, codes = clean(15)
    rate = np.gradient(x) * RATE_HZ
    breaking, broken = np.abs(rate) ** 1.2 * np.where(rate > 0.0, 1.0, 0.5), np.zeros(len(x))
    for k in range(1, len(x)):
        gone = breaking[k] - broken[k - 1]
        broken[k] = broken[k - 1] + gone * (0.3 if gone > 0.0 else 0.06)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + 60.0 * broken[:, None], 2))
    assert result.effects == ("overshoot",)


def test_a_neighbour_is_heard_with_what_it_has() -> None:
    """What a neighbour's own effect adds goes over with the rest, at the same share."""
    x, codes = clean(12)
    hurt = codes.copy()
    hurt[2400:, 0] += 150.0
    hurt[:, 1] += 0.12 * (hurt[:, 0] - codes[:, 1])
    pair = recorded(x, codes, 1), recorded(x, hurt, 2)
    result = diagnose(*pair)
    channels = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert channels == {"step": ["s1"], "crosstalk": ["s2"]}
    assert np.abs(result.augmented[:, 1] - hurt[:, 1]).mean() < 2.0
    # On the next motion the step is there from the start, and is heard.
    again = augment(result, pair[0]).codes
    stepped = codes[:, 0] + 150.0
    assert np.abs(again[:, 0] - stepped).mean() < 3.0
    assert np.abs(again[:, 1] - codes[:, 1] - 0.12 * (stepped - codes[:, 1])).mean() < 3.0


def test_effects_of_other_equations_keep_their_names() -> None:
    """Ogden-Roxburgh softening, a branch drawn to a curve, relaxation of a curve, worn play, play
    beside a spring, behind slack or between faces that give way, a converter with teeth, clocks
    that run apart or wander, a bit that weighs wrong, a line of resistors and capacitors, an active
    filter, one that a part gets past, one that discharges slowly, an amplifier with two rails, and
    a capacitor that keeps two channels."""
    from scipy.special import erf

    x, codes = clean(13)
    top = np.maximum.accumulate(x)
    soft = erf((top**2 - x**2) / (0.1 + 0.6 * top**2))
    drawn = np.zeros(len(x))
    for k in range(1, len(x)):
        pull = 6.0 * abs(x[k] - x[k - 1])
        drawn[k] = drawn[k - 1] + pull * (np.tanh(2.0 * (x[k] - 0.4)) - drawn[k - 1])
    elastic = np.expm1(0.8 * (codes - codes[0]) / 500.0)
    worn, even, loose, soft_faced = np.full((4, len(x)), x[0])
    taut = np.maximum(x - 0.02, 0.0)
    loose[0] = taut[0]
    for k, value in enumerate(x[1:], start=1):
        half = 0.03 * (1.0 + value)
        worn[k] = min(max(worn[k - 1], value - half), value + half)
        even[k] = min(max(even[k - 1], value - 0.03), value + 0.03)
        loose[k] = min(max(loose[k - 1], taut[k] - 0.02), taut[k] + 0.02)
        touching = min(max(soft_faced[k - 1], value - 0.03), value + 0.03)
        soft_faced[k] = soft_faced[k - 1] + 0.45 * (touching - soft_faced[k - 1])
    index = np.arange(len(x))
    apart = np.stack([np.interp(index - 4.0 * index / len(x), index, c) for c in codes.T], axis=1)
    wandering = index - 1.6 - 0.5 * np.sin(index / 700.0)
    wander = np.stack([np.interp(wandering, index, c) for c in codes.T], axis=1)
    quick, far = (index - a - b * (index / SAMPLES) ** 2 for a, b in ((0.6, 1.5), (5.0, 10.0)))
    coupled = lfilter(*butter(2, 1.5, fs=RATE_HZ), codes - codes[0], axis=0) + codes[0]
    runs_off, runs_far = (
        np.stack([np.interp(late, index, c) for c in codes.T], axis=1) for late in (quick, far)
    )
    line = filtered(filtered(codes, 0.7), 0.1)
    slow_down = codes.copy()
    for k in range(1, len(codes)):
        gone = codes[k] - slow_down[k - 1]
        slow_down[k] = slow_down[k - 1] + gone * np.where(gone > 0.0, 0.2, 0.12)
    kept = codes.copy()
    kept[:, 2] += 0.05 * (codes[:, 1] - codes[:, 2]) + 0.02 * (codes[:, 0] - codes[:, 2])
    for name, made in (
        ("softening", codes - 20.0 * (soft * x)[:, None]),
        ("hysteresis", codes + 15.0 * drawn[:, None]),
        ("delay", apart),
        ("delay", wander),
        (
            "relaxation",
            codes + 30.0 * (filtered(elastic, 8.0) + filtered(elastic, 0.9)) - 60.0 * elastic,
        ),
        ("backlash", sensed(worn)),
        ("backlash", sensed(0.75 * even + 0.25 * x)),
        ("backlash", sensed(loose)),
        ("backlash", sensed(soft_faced)),
        ("delay", runs_off),
        ("delay", runs_far),
        ("adc_nonlinearity", codes + 15.0 * (np.rint(codes).astype(int) >> 8 & 1)),
        ("adc_nonlinearity", codes + 0.15 * (codes % 130.0)),
        ("lag", line),
        ("lag", coupled),
        ("lag", 0.85 * filtered(codes, 0.4) + 0.15 * codes),
        ("lag", slow_down),
        ("saturation", np.clip(codes, *np.quantile(codes, [0.06, 0.9], axis=0))),
        ("crosstalk", kept),
    ):
        assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == (name,)


def test_laws_of_time_way_and_place_keep_their_names() -> None:
    """A gain that goes over from one value to another, two drifts that settle, chains that break in
    some cycles, a largest strain that is forgotten, a capacitor that the sensor itself or a line
    charges, a rack that is worn where it works most, a converter of two stages, and leaping
    relays."""
    x, codes = clean(17)
    t, index = np.arange(len(x)) / RATE_HZ, np.arange(len(x))
    over = -np.expm1(-((t / 150.0) ** 1.3))[:, None]
    two = 45.0 * -np.expm1(-t / 250.0) - 25.0 * -np.expm1(-t / 25.0)
    forth, lost = np.maximum(np.diff(x, prepend=x[0]), 0.0), np.zeros(len(x))
    for limit in np.linspace(0.2, 0.95, 9):
        broken = -np.expm1(-np.cumsum(np.where(x > limit, forth, 0.0)) / 0.6)
        lost += broken * np.maximum(1.0 - (x / limit) ** 2, 0.0) * x
    largest, worn = np.full((2, len(x)), x[0])
    own = codes.copy()
    wide = 0.03 * (1.0 + 0.7 * np.exp(-(((x - 0.4) / 0.25) ** 2)))
    for k in index[1:]:
        largest[k] = max(x[k], x[k] + (largest[k - 1] - x[k]) * np.exp(-0.05 / 250.0))
        worn[k] = min(max(worn[k - 1], x[k] - wide[k]), x[k] + wide[k])
        own[k] += (own[k - 1] - codes[k]) * np.exp(-0.05 / (1.5e-4 * codes[k]))
    rests = np.pad(codes, ((400, 400), (0, 0)), mode="edge")
    root = np.sqrt(2j * np.pi * np.maximum(np.fft.rfftfreq(len(rests), 0.05), 1e-9) * 0.5)[:, None]
    line = np.fft.irfft(np.fft.rfft(rests, axis=0) * np.tanh(root) / root, len(rests), axis=0)
    line = line[400:-400]
    slopes = np.random.default_rng(3).uniform(-0.15, 0.15, 40)
    stages = slopes[codes.astype(int) // 128] * (codes % 128.0 - 64.0)
    relays = np.zeros(len(x))
    for middle in np.linspace(0.1, 0.9, 9):
        for half in (0.03, 0.08, 0.15):
            up, on = np.where(x > middle + half, 1.0, np.where(x < middle - half, -1.0, 0.0)), -1.0
            for k in index:
                on = up[k] or on
                relays[k] += on
    for name, made in (
        ("gain", codes + 0.08 * over * (codes - codes[0])),
        ("drift", codes + two[:, None]),
        ("softening", codes - 60.0 * lost[:, None]),
        ("softening", codes + 25.0 * (np.expm1((x - largest) / 0.3) * x)[:, None]),
        ("lag", own),
        ("lag", line),
        ("backlash", sensed(worn)),
        ("adc_nonlinearity", codes + stages),
        ("hysteresis", codes + 1.5 * relays[:, None]),
    ):
        assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == (name,), name


def test_two_laws_of_time_may_be_felt_more_where_more_is_strained() -> None:
    x, codes = clean(71)
    t = np.arange(len(x)) / RATE_HZ
    law = 60.0 - 30.0 * (np.exp(-t / 25.0) + np.exp(-t / 350.0))
    felt = 1.0 + 0.4 * (codes - codes.min(axis=0)) / np.ptp(codes, axis=0)
    made = codes.copy()
    made[:, 1:3] += (law[:, None] * felt)[:, 1:3]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("drift",)
    assert result.data["unexplained"]["share"] < 0.0005


def test_a_drift_behind_a_divider_is_no_gain() -> None:
    """A resistance that changes much is felt several times as much at one end of its range."""
    x, codes = clean(72)
    t = np.arange(len(x)) / RATE_HZ
    share = (codes - codes.min(axis=0)) / np.ptp(codes, axis=0)
    felt = 1.0 + np.array([1.65, -0.55, 1.6, 0.0]) * share
    made = codes + 12.0 * np.log1p(t / 12.0)[:, None] * felt * np.array([1.0, -2.0, 0.6, 0.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("drift",)
    assert result.data["unexplained"]["share"] < 0.005


def test_what_the_first_cycles_soften_is_no_gain() -> None:
    """Nothing ages within seconds."""
    x, codes = clean(73)
    lost = -np.expm1(-np.cumsum(np.abs(np.diff(x, prepend=x[0]))) / 2.5)
    made = codes - 0.04 * lost[:, None] * (codes - codes[0]) * np.array([1.0, 0.7, 1.2, 0.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("softening",)


def test_a_simulator_that_was_calibrated_hides_the_curve_of_what_it_lacks() -> None:
    """What relaxes has no mean curve over strain then; on another motion the curve is the same."""
    x, codes = clean(18, SAMPLES + 2000)
    now, then = slice(0, SAMPLES), slice(SAMPLES, None)
    relaxed = 0.2 * (filtered(codes, 9.0) - codes)
    powers = np.vander(x, 4)
    made = codes + relaxed - powers @ np.linalg.lstsq(powers[now], relaxed[now])[0]
    result = diagnose(recorded(x[now], codes[now], 1), recorded(x[now], made[now], 2))
    assert result.effects == ("relaxation",)
    again = augment(result, recorded(x[then], codes[then], 3, noise=0.0)).codes
    # Once what happened between the recordings, which nobody knows, has relaxed.
    late = slice(1200, None)
    gap = (made[then] - codes[then])[late]
    assert np.std((again - made[then])[late]) < 0.1 * np.std(gap)


def test_a_gain_of_what_the_strain_alone_says_is_a_gain() -> None:
    """A good part of these sensors lags behind, and is as large as before."""
    x, _ = clean(19)
    elastic = 1500.0 + 700.0 * (x[:, None] + np.array([0.2, -0.2, 0.1, 0.3]) * x[:, None] ** 2)
    codes = elastic + 0.4 * (elastic - filtered(elastic, 1.5))
    made = codes + 0.08 * (elastic - elastic[0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("gain",)
    assert np.std(change_of(result, 12) - (made - codes)) < 1.0


def test_a_gain_of_what_is_no_signal_where_it_begins_is_a_gain() -> None:
    """A recording begins in the middle of a stroke; a converter's curve would say it too."""
    x, codes = clean(44, start=300)
    assert x[0] > 0.4
    more = 0.05 * (codes - sensed(np.zeros_like(x)))
    more[:, 0] = 0.0
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + more, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("gain", ["s2", "s3", "s4"])
    ]


@pytest.mark.parametrize("zero", [0.0, 2048.0])
@pytest.mark.parametrize("course", ["always", "growing", "running in"])
def test_a_gain_of_all_that_is_read_is_a_gain(zero: float, course: str) -> None:
    """A converter's reference or the amplifier of a bridge: its zero is not where sensors rest."""
    x, codes = clean(45)
    t = np.arange(len(x)) / len(x)
    grown = {"always": np.ones_like(t), "growing": t, "running in": np.exp(-5.0 * t)}[course]
    more = 0.02 * grown[:, None] * (codes - zero)
    more[:, 1] = 0.0
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + more, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("gain", ["s1", "s3", "s4"])
    ]
    assert np.std(change_of(result, 12) - more) < 1.0


def test_a_coarse_plane_of_relays_is_hysteresis_alone() -> None:
    """Its steps are at the same strains again and again, and wide relays begin switched off."""
    x, codes = clean(57)
    levels, change = np.linspace(x.min(), x.max(), 25), np.zeros_like(x)
    index = np.arange(len(x))
    for k, up in enumerate(levels):
        above = np.maximum.accumulate(np.where(x >= up, index, -1))
        for down in levels[:k]:
            below = np.maximum.accumulate(np.where(x <= down, index, 0))
            change += np.where(above > below, 1.0, -1.0)
    change *= 25.0 / np.std(change)
    loops = codes.copy()
    loops[:, :2] += change[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, loops, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("hysteresis", ["s1", "s2"])
    ]
    assert not result.data["unexplained"]["unknown_effect"]


def test_what_rings_on_after_a_knock_is_no_spike() -> None:
    x, codes = clean(58)
    rng, k = np.random.default_rng(6), np.arange(40) / RATE_HZ
    knocks = (rng.random(len(x)) < 0.002) * rng.normal(size=len(x))
    rung = np.convolve(knocks, np.exp(-k / 0.4) * np.cos(2.0 * np.pi * 1.3 * k))[: len(x)]
    knocked = codes + 12.0 * (rung / rung.std())[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, knocked, 2))
    assert result.data["unexplained"]["unknown_effect"]
    assert not result.effects


def test_a_gain_behind_a_divider_and_an_amplifier_is_a_gain() -> None:
    """Of a resistance that is never 0, and amplified from two volts that nobody knows: nearly
    straight, as a converter's curve may be too."""
    x, codes = clean(9, 8000)
    resistance = 1.0 + (codes - codes.min(0)) / np.ptp(codes, axis=0)
    zero = np.array([0.6, 1.3, 1.8, 2.2])

    def read(value: np.ndarray) -> np.ndarray:
        return 900.0 + 9000.0 * (value / (1.5 + value) - 0.4)

    more = read(resistance + np.array([0.05, 0.04, 0.0, 0.06]) * (resistance - zero))
    result = diagnose(recorded(x, read(resistance), 1), recorded(x, more, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("gain", ["s1", "s2", "s4"])
    ]
    assert result.data["after"]["shrink"] > 0.98


def test_a_converters_curve_is_neither_hysteresis_nor_a_gain() -> None:
    """Beside a delay, which both could bend."""
    x, codes = clean(43)
    late = hide(x, codes, "delay")
    share = (late[:, 1] - late[:, 1].min()) / np.ptp(late[:, 1])
    late[:, 1] += 20.0 * (share**3 - 0.6 * share) + 6.0 * np.sin(9.0 * share)
    result = diagnose(recorded(x, codes, 1), recorded(x, late, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"delay": ["s1", "s2", "s3", "s4"], "adc_nonlinearity": ["s2"]}


def test_a_little_more_noise_shows_beside_channels_that_are_simulated_right() -> None:
    x, codes = clean(20)
    louder = np.array([1.3, 2.1, 1.3, 2.1])
    result = diagnose(recorded(x, codes, 1), recorded(x, codes, 2, louder))
    assert result.effects == ("noise",)
    assert result.data["effects"][0]["channels"] == ["s2", "s4"]


def test_what_is_elastic_leaks_or_gives_way_keeps_its_name() -> None:
    """Play between elastic faces, a lower rail that a part gets past, a neighbour through a
    resistance and a capacitance, a dashpot's force whichever way it goes, and what a curved spring
    is right about at once, and loses then."""
    x, codes = clean(14)
    pressed, y, fine = [], x[0], np.interp(np.arange(8 * len(x) - 7) / 8.0, np.arange(len(x)), x)
    for before, now in pairwise(fine):
        over = (now - y) * np.sign(now - before) - 0.03
        y += (now - before) / (1.0 + np.exp(-over / 0.008))
        pressed.append(y)
    played = np.array([x[0], *pressed[7::8]])
    bottom = np.quantile(codes, 0.2, axis=0)
    wired = codes.copy()
    wired[:, 1] += 0.04 * (codes[:, 0] - codes[0, 0]) + 0.01 * np.gradient(codes[:, 0]) * RATE_HZ
    behind = (x[:, None] - filtered(x[:, None], 0.7))[:, 0]
    force = np.where(behind > 0.0, behind, -0.4 * behind)
    share = (codes - codes.min(axis=0)) / np.ptp(codes, axis=0)
    curved = np.expm1(1.5 * share) / np.expm1(1.5)
    relaxed = filtered(curved, 2.0) + filtered(curved, 20.0) - 2.0 * curved[0]
    for name, made in (
        ("backlash", sensed(played)),
        ("saturation", np.where(codes < bottom, bottom + 0.1 * (codes - bottom), codes)),
        ("crosstalk", wired),
        ("overshoot", codes + 150.0 * force[:, None]),
        ("relaxation", codes - 30.0 * relaxed),
    ):
        assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == (name,)


def test_damage_that_only_a_larger_strain_makes_is_softening() -> None:
    """Nothing is as stiff again close to the largest strain so far."""
    x, codes = clean(11)
    x = x * np.linspace(0.4, 1.0, SAMPLES)
    codes = sensed(x)
    share = (codes - codes[0]) / np.ptp(codes, axis=0)
    damage = -np.expm1(-np.maximum.accumulate(x) / 0.8)
    hurt = codes - 60.0 * damage[:, None] * share
    assert diagnose(recorded(x, codes, 1), recorded(x, hurt, 2)).effects == ("softening",)


def test_strain_that_does_not_all_reach_the_sensor_is_a_gain() -> None:
    """Glue takes some of it, before a curve that is steep at one end and a material that creeps."""
    x, _ = clean(33)
    bends = np.array([1.6, -2.0, 2.4, 1.2])

    def read(felt: np.ndarray) -> np.ndarray:
        static = 1200.0 + 900.0 * np.expm1(bends * felt[:, None]) / np.expm1(bends)
        return static + 0.1 * (filtered(static, 8.0) - static)

    codes, made = read(x), read(0.85 * x)
    made[:, 3] = codes[:, 3]
    diagnosis = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert diagnosis.effects == ("gain",)
    assert diagnosis.data["effects"][0]["channels"] == ["s1", "s2", "s3"]


def test_a_filter_whose_resistor_is_the_sensor_is_a_lag() -> None:
    """Slow where the resistance is high, which is many times what it is at the other end."""
    x, codes = clean(34)
    made = codes.copy()
    for channel, ratio in ((0, 7.0), (2, 0.2)):
        u = codes[:, channel]
        share = (u - u.min()) / np.ptp(u)
        pull = 2.0 / (1.0 + (ratio - 1.0) * share) / (0.3 * RATE_HZ)
        y = u[0]
        for k in range(1, len(u)):
            fine = np.linspace(u[k - 1], u[k], 11)[1:]
            for value in fine:
                y += (value - y) * -np.expm1(-0.1 * pull[k])
            made[k, channel] = y
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("lag",)


@pytest.mark.parametrize(
    "near", [{"tau_s": 0.01, "poles": 2.0}, {"tau_s": 0.0143, "poles": 2.0, "damping": 0.7}]
)
def test_what_two_poles_say_is_looked_at_as_one_pole_that_is_as_late(near) -> None:
    x, codes = clean(34)
    nominal = first_channel(x, codes, np.zeros(len(x)), ["lag"]).nominal
    zoom = all_effects()["lag"].zoom
    assert zoom is not None
    for form in ("own", "uneven"):
        times_s = [c.values["tau_s"] for c in zoom(nominal, near) if c.form == form]
        assert min(times_s) < 0.019 < 0.021 < max(times_s)


@pytest.mark.parametrize(("sign", "beyond"), [(1.0, []), (-1.0, ["adc_nonlinearity"])])
def test_bits_are_as_far_off_as_they_are_together(sign: float, beyond: list[str]) -> None:
    """Around the middle of the range the highest bit is on where the next one is not."""
    x, codes = clean(34)
    codes[:, 0] += 2048.0 - codes[:, 0].mean()
    channel = first_channel(x, codes, 30.0 * x, ["adc_nonlinearity"])
    entries = channel.entries["adc_nonlinearity"]
    number = next(k for k, entry in enumerate(entries) if entry.candidate.form == "bits")
    weights = np.zeros(entries[number].width)
    weights[6:8] = 0.4, sign * 0.4
    fit = Fit((("adc_nonlinearity", number),), np.zeros(1), weights, None)
    assert channel._beyond(fit) == beyond


@pytest.mark.parametrize("tau_s", [1.4, 2.6])
def test_a_slow_circuit_that_lets_some_through_is_no_relaxation(tau_s: float) -> None:
    x, codes = clean(17)
    made = 0.85 * filtered(codes, tau_s) + 0.15 * codes
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("lag",)


def test_a_lead_that_all_others_return_through_is_crosstalk() -> None:
    x, _ = clean(35)
    static = [np.expm1(b * x) / np.expm1(b) for b in (0.5, -1.5, 2.0, -0.5, 1.5, -2.0)]
    times_s = 0.5, 20.0, 4.0, 60.0, 1.5, 9.0
    signals = [s + 0.4 * (filtered(s, tau_s) - s) for s, tau_s in zip(static, times_s, strict=True)]
    codes = 1500.0 + np.stack(signals, axis=1) * [700.0, -900.0, 600.0, 800.0, -650.0, 750.0]
    pulls, made = codes - codes[0], codes.copy()
    for channel in (0, 1, 3, 4):
        others = np.delete(pulls, channel, axis=1)
        made[:, channel] -= 0.08 * others @ [0.2, 0.9, 0.5, 0.7, 0.3]
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("crosstalk",)


def test_a_dashpot_that_gives_way_is_relaxation() -> None:
    """Eyring: the further it is stretched, the far faster it flows."""
    x, codes = clean(36)
    made = codes.copy()
    for channel, bend in ((0, 0.06), (1, 0.1), (3, 0.15)):
        share = (codes[:, channel] - codes[:, channel].min()) / np.ptp(codes[:, channel])
        ahead, s = np.zeros(len(x)), 0.0
        for k in range(1, len(x)):
            s += share[k] - share[k - 1]
            for _ in range(20):
                s -= bend * np.sinh(s / bend) / (20 * 6.0 * RATE_HZ)
            ahead[k] = s
        made[:, channel] += 0.3 * ahead * np.ptp(codes[:, channel])
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("relaxation",)


@pytest.mark.parametrize(("noise", "step", "gain"), [(2.0, 256, 0.3), (4.0, 128, 0.4)])
def test_noise_at_the_edges_of_a_converter_is_the_converters(
    noise: float, step: int, gain: float
) -> None:
    """Noise before it makes it leap from one side of an edge to the other, and is amplified."""
    x, codes = clean(38)
    real = recorded(x, codes, 2, noise)
    read = real.codes.copy()
    read[:, :3] += np.rint(gain * (read[:, :3] % step - 0.5 * step)).astype(np.int32)
    diagnosis = diagnose(recorded(x, codes, 1, noise), replace(real, codes=read))
    assert diagnosis.effects == ("adc_nonlinearity",)
    assert not diagnosis.data["unexplained"]["unknown_effect"]


def test_damage_carries_over_to_a_motion_that_brings_no_more() -> None:
    x, _ = clean(38, 4 * SAMPLES)
    x[:SAMPLES] *= np.linspace(0.55, 1.0, SAMPLES)
    now, then = slice(0, SAMPLES), slice(SAMPLES, None)
    codes = sensed(x)
    share = (codes - codes[0]) / np.ptp(codes, axis=0)
    hurt = codes + 80.0 * np.expm1(-np.maximum.accumulate(x) / 0.6)[:, None] * share
    diagnosis = diagnose(recorded(x[now], codes[now], 1), recorded(x[now], hurt[now], 2))
    assert diagnosis.effects == ("softening",)
    made = augment(diagnosis, recorded(x[then], codes[then], 3)).codes
    assert np.mean((made - hurt[then]) ** 2) < 0.1 * np.mean((codes - hurt)[then] ** 2)


def test_what_a_material_does_before_a_bent_curve_keeps_its_name() -> None:
    """The network feels more strain, later more and more, or strain that relaxes, and a curve that
    is steep at one end makes codes of it; a smaller motion follows."""
    x, _ = clean(15, SAMPLES + 2000)
    now, then = slice(0, SAMPLES), slice(SAMPLES, None)
    x[then] *= 0.6
    bends = np.array([1.8, -1.5, 2.2, -2.0])

    def read(felt: np.ndarray) -> np.ndarray:
        return 1200.0 + 900.0 * np.expm1(bends * felt) / np.expm1(bends)

    strain = x[:, None]
    growing = 0.03 * np.arange(len(x))[:, None] / SAMPLES
    codes = read(strain)
    for name, made in (
        ("gain", read(1.01 * strain)),
        ("gain", read((1.0 + growing) * strain)),
        ("relaxation", read(strain + 0.06 * (strain - filtered(strain, 6.0)))),
    ):
        result = diagnose(recorded(x[now], codes[now], 1), recorded(x[now], made[now], 2))
        assert result.effects == (name,)
        again = augment(result, recorded(x[then], codes[then], 3, noise=0.0)).codes
        gap = made[then] - codes[then]
        # Rounding alone is 0.18 of the smallest.
        assert np.std(again - made[then]) < 0.3 * np.std(gap)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_curve_says_the_strain_of_its_codes(sign: float) -> None:
    strain = random_motion(2000, 1 / RATE_HZ, 3)
    codes = sign * 500.0 * (strain + strain**2)
    curve = curves_of(codes[:, None], motion_of(strain, 1 / RATE_HZ, 0.0, None).strain)[0]
    assert curve.bent
    top = np.ptp(strain)
    np.testing.assert_allclose(top * curve.strain(codes) + strain.min(), strain, atol=2e-3)
    felt = np.linspace(0.02, 0.98, 50)
    steep = sign * 500.0 * top * (1.0 + 2.0 * (strain.min() + top * felt))
    np.testing.assert_allclose(curve.slope(felt), steep, rtol=0.03)
    assert not curves_of(strain[:, None], strain)[0].bent


def test_drives_that_give_way_or_stick_are_backlash() -> None:
    """Friction that gives way before it slips, and a drive that sticks and jumps on."""
    x, codes = clean(17)
    force, anchor, way, last = 0.0, x[0], 0.0, x[0]
    slipping, jumping = [x[0]], [x[0]]
    for before, now in pairwise(x):
        for _ in range(10):
            move = (now - before) / 10.0
            force += move * np.sqrt(max(0.5 * (1.0 - np.sign(move) * force / 0.02), 0.0))
        slipping.append(now - force)
        if way * (now - anchor) < 0.0:
            way = 0.0
        elif way == 0.0 and abs(now - anchor) > 0.04:
            way = np.sign(now - anchor)
        if way != 0.0:
            anchor, last = now, now - 0.01 * way
        jumping.append(last)
    for made in (slipping, jumping):
        result = diagnose(recorded(x, codes, 1), recorded(x, sensed(np.array(made)), 2))
        assert result.effects == ("backlash",)
        assert result.data["after"]["shrink"] > 0.98


@pytest.mark.parametrize("zeroed", [0.3, -1.0])
def test_play_whose_zero_is_off_its_middle_is_backlash(zeroed: float) -> None:
    """It begins anywhere in its play, or was zeroed while it pulled."""
    x, codes = clean(17)
    played = [x[0]]
    for now in x[1:]:
        played.append(min(max(played[-1], now - 0.02), now + 0.02))
    moved = np.array(played) + 0.02 * zeroed
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(moved), 2))
    assert result.effects == ("backlash",)
    assert {trace.form for trace in result.traces} == {"off_centre"}
    assert all(abs(trace.values["zeroed"] - zeroed) < 0.1 for trace in result.traces)


def test_worn_play_under_a_gain_is_played_as_it_is_under_what_says_it_best() -> None:
    x, codes = clean(20)
    played = [x[0]]
    for now, width in zip(x[1:], 0.15 * 2.0 ** (x[1:] - 0.5), strict=True):
        played.append(min(max(played[-1], now - width / 2), now + width / 2))
    moved = sensed(np.array(played))
    made = moved - 0.15 * (moved - moved[0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"backlash", "gain"}


def test_a_long_recordings_motion_is_looked_at_closely_on_one_channel(monkeypatch) -> None:
    monkeypatch.setattr(sys.modules[Channel.__module__], "LONG", 0)
    closely, offered = [], Channel._offered

    def counted(self, nominal, name, near, place=""):
        if name == "backlash" and near is not None:
            closely.append(nominal.channel)
        return offered(self, nominal, name, near, place)

    monkeypatch.setattr(Channel, "_offered", counted)
    x, codes = clean(57)
    played = np.empty(SAMPLES)
    at = x[0]
    for k, strain in enumerate(x):
        at = min(max(at, strain - 0.04), strain + 0.04)
        played[k] = at
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(played), 2))
    (effect,) = result.data["effects"]
    assert (effect["name"], effect["channels"]) == ("backlash", ["s1", "s2", "s3", "s4"])
    assert abs(effect["parameters"]["width"]["value"] - 0.08) < 0.004
    assert len(set(closely)) == 1


def test_a_late_clock_after_play_is_both_where_samples_are_thinned(monkeypatch) -> None:
    monkeypatch.setattr(sys.modules[Channel.__module__], "SEARCHED", 2000)
    x, codes = clean(58)
    played, at, index = np.empty(SAMPLES), x[0], np.arange(SAMPLES)
    for k, strain in enumerate(x):
        at = min(max(at, strain - 0.04), strain + 0.04)
        played[k] = at
    late = np.stack([np.interp(index - 1.6, index, c) for c in sensed(played).T], axis=1)
    result = diagnose(recorded(x, codes, 1), recorded(x, late, 2))
    assert set(result.effects) == {"backlash", "delay"}
    assert result.data["after"]["shrink"] > 0.98


def test_a_walk_is_one_where_its_samples_are_thinned(monkeypatch) -> None:
    channel = sys.modules[Channel.__module__]
    monkeypatch.setattr(channel, "LONG", 0)
    monkeypatch.setattr(channel, "SEARCHED_OF_LONG", 600)
    x, codes = clean(59, 30_000)
    walks = np.cumsum(np.random.default_rng(4).normal(0.0, 0.5, codes.shape), axis=0)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + walks, 2))
    assert result.effects == ("random_walk",)


def test_what_spikes_seldom_reach_is_no_lost_code() -> None:
    rng, samples = np.random.default_rng(5), 400_000
    base = 1400.0 + 250.0 * np.sin(np.arange(samples) / 40.0)[:, None]
    spiky = base + 900.0 * (rng.random(base.shape) < 0.003)
    x = np.sin(np.arange(samples) / 40.0)
    sim, real = recorded(x, base, 1), recorded(x, spiky, 2)
    assert not len(lost_codes(real, sim))
    # A converter that gives one code of 40 has lost the others, spikes or not.
    assert len(lost_codes(replace(real, codes=real.codes // 40 * 40), sim)) > 0


@pytest.mark.parametrize("kind", ["steady", "wandering", "switched"])
def test_a_tone_is_taken_out_of_a_long_signal_as_parts_see_it(kind: str) -> None:
    rng, samples = np.random.default_rng(6), 120_000
    t = np.arange(samples) / RATE_HZ
    phase = np.cumsum(rng.normal(0.0, 0.02, samples)) if kind == "wandering" else 0.0
    on = np.sin(2.0 * np.pi * t / 70.0) > -0.3 if kind == "switched" else 1.0
    noise = rng.normal(size=samples)
    rest = without_tone(noise + 12.0 * on * np.sin(2.0 * np.pi * 3.7 * t + phase), 3.7, 1 / RATE_HZ)
    assert np.std(rest) < {"steady": 1.01, "wandering": 1.3, "switched": 1.2}[kind]


@pytest.mark.parametrize("jumps", [False, True])
def test_a_specimen_that_slips_in_its_clamp_is_unknown(jumps: bool) -> None:
    """It creeps, or slips now and then, where it is pulled hard: on each channel that looks like a
    drift or a walk of its own."""
    x, codes = clean(41)
    pulled = np.maximum(x - 0.6, 0.0)
    if jumps:
        pulled = (pulled > 0.0) * (np.random.default_rng(3).random(len(x)) < 0.004)
    slid = 0.08 * np.cumsum(pulled) / pulled.sum()
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(x - slid), 2))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_a_lag_beside_clocks_that_run_apart_is_told_by_the_other_channels() -> None:
    """On its own channel a little more skew would say most of it."""
    x, codes = clean(61)
    index = np.arange(len(x), dtype=float)
    late = np.interp(index - 4.0 - index / 3000.0, index, x)
    made = sensed(late)
    made[:, 1:3] = filtered(made[:, 1:3], 0.09)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect for effect in result.data["effects"]}
    assert found.keys() == {"delay", "lag"}
    assert found["lag"]["channels"] == ["s2", "s3"]
    assert abs(found["delay"]["parameters"]["delay_s"]["value"] - 0.2) < 0.02


def test_a_carriage_that_rolls_on_in_its_play_is_backlash() -> None:
    x, codes = clean(62)
    rolled, at, pace = np.empty(len(x)), x[0], 0.0
    for k, strain in enumerate(x):
        free = at + pace
        at = min(max(free, strain - 0.05), strain + 0.05)
        pace = pace if at == free else strain - x[max(k - 1, 0)]
        rolled[k] = at
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(rolled), 2))
    assert result.effects == ("backlash",)
    assert not result.data["unexplained"]["unknown_effect"]


def test_play_that_a_spring_takes_up_is_backlash() -> None:
    x, codes = clean(62)
    taken, at = np.empty(len(x)), x[0]
    for k, strain in enumerate(x):
        at = min(max(at, strain - 0.05), strain + 0.05)
        at += (strain - at) / (20.0 * RATE_HZ)
        taken[k] = at
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(taken), 2))
    assert result.effects == ("backlash",)
    assert {trace.form for trace in result.traces} == {"centred"}
    assert result.data["unexplained"]["share"] < 1e-3


@pytest.mark.parametrize("drive", ["teeth", "joints"])
def test_play_of_any_width_in_any_place_is_backlash(drive: str) -> None:
    """Teeth that are not alike, or joints in a row of which each has some play of its own."""
    x, codes = clean(17)
    moved = np.zeros(len(x))
    joints = [0.1] if drive == "teeth" else [0.02, 0.06, 0.12, 0.2]
    for width in joints:
        uneven = 0.4 * np.sin(2.0 * np.pi * x / 0.15) if drive == "teeth" else np.zeros(len(x))
        at = x[0]
        for k, half in enumerate(0.5 * width * (1.0 + uneven)):
            at = min(max(at, x[k] - half), x[k] + half)
            moved[k] += at / len(joints)
    made = sensed(moved)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("backlash",)
    assert {trace.form for trace in result.traces} == {"free"}
    assert result.data["unexplained"]["share"] < 2e-3
    assert not result.data["unexplained"]["unknown_effect"]
    again = augment(result, recorded(x, codes, 3, noise=0.0)).codes
    # It goes on from where the drive was left, and in 10 s, to where it began.
    assert np.std((again - made)[500:]) < 0.08 * np.std(made - codes)


def test_slack_about_a_pose_is_backlash() -> None:
    """A joint that is loose where it is straight passes nothing on while it goes through there."""
    x, codes = clean(18)
    loose = 0.44 + np.sign(x - 0.44) * np.maximum(np.abs(x - 0.44) - 0.03, 0.0)
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(loose), 2))
    assert result.effects == ("backlash",)
    assert {trace.form for trace in result.traces} == {"dead_zone"}
    pose, width = (result.data["effects"][0]["parameters"][key] for key in ("pose", "width"))
    assert pose["value"] == pytest.approx(0.44, abs=0.005)
    assert width["value"] == pytest.approx(0.06, abs=0.003)
    assert result.data["unexplained"]["share"] < 1e-3


def test_what_creeps_behind_worn_play_is_told_beside_it() -> None:
    """Play of which one side is worn where the strain is large: a clock that wanders would say more
    of what the creep leaves."""
    x, codes = clean(17)
    worn, at = np.empty(len(x)), x[0]
    for k, strain in enumerate(x):
        at = min(max(at, strain - 0.06 * (0.4 + strain)), strain + 0.06)
        worn[k] = at
    played = sensed(worn)
    crept = 0.5 * (filtered(played, 2.0) + filtered(played, 40.0))
    made = played + 0.4 * (crept - played)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"backlash", "relaxation"}
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize("rail", ["deep", "sinks"])
def test_a_rail_may_be_deep_or_sink(rail: str) -> None:
    x, codes = clean(14)
    low, span = codes.min(axis=0), np.ptp(codes, axis=0)
    passed = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    top = low + span * (0.41 if rail == "deep" else 0.7 - 0.1 * passed)
    hurt = codes.copy()
    hurt[:, 1] = np.minimum(codes, top)[:, 1]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("saturation",)
    assert result.data["unexplained"]["share"] < 1e-3


def test_a_rail_that_gives_way_slowly_is_no_converters_curve(tmp_path: Path) -> None:
    x, codes = clean(15)
    low, span = codes.min(axis=0), np.ptp(codes, axis=0)

    def railed(codes: np.ndarray) -> np.ndarray:
        return codes - 70.0 * np.maximum((codes - low) / span - 0.12, 0.0) ** 2.6

    result = diagnose(recorded(x, codes, 1), recorded(x, railed(codes), 2))
    assert result.effects == ("saturation",)
    assert {o["name"] for o in result.data["effects"][0]["alternatives"]} >= {"adc_nonlinearity"}
    later, further = clean(16)
    folder.write(result, recorded(x, codes, 1), recorded(x, railed(codes), 2), tmp_path)
    made = augment(folder.read(tmp_path), recorded(later, further, 3))
    left = made.codes - recorded(later, railed(further), 3).codes
    assert np.sqrt(np.mean(left**2)) < 1.0


@pytest.mark.parametrize("rings", [False, True])
def test_a_strain_that_no_play_or_delay_says_is_unknown(rings: bool) -> None:
    """A spindle that is not even, or a frame that rings when it is struck."""
    x, codes = clean(63)
    away = 0.02 * np.sin(2.0 * np.pi * x / 0.07)
    if rings:
        knocks = np.random.default_rng(5).random(len(x)) < 0.003
        k = np.arange(200) / RATE_HZ
        away = np.convolve(knocks, np.exp(-k / 2.0) * np.sin(2.0 * np.pi * 1.7 * k))[: len(x)]
        away *= 0.02 / away.std()
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(x + away), 2))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_what_goes_with_the_signed_rate_may_be_a_little_lag(monkeypatch) -> None:
    """Where a lag costs next to nothing more, that is no charge that the motion makes."""
    charge = Model(frozenset({"overshoot"}), (), 9.0)
    monkeypatch.setattr(vetting, "signed", lambda channels, made: made is charge)
    channels = [SimpleNamespace(effect_price=0.5)]
    for price, name in ((9.4, "lag"), (9.6, "overshoot")):
        models = [charge, Model(frozenset({"lag"}), (), price)]
        assert vetting._by_sign(channels, models)[0].names == {name}


@pytest.mark.parametrize("leaks_s", [0.02, 0.12])
def test_a_charge_that_the_motion_makes_is_unknown(leaks_s: float) -> None:
    """It goes with the signed strain rate, which no effect does, though some of them nearly."""
    x, codes = clean(64)
    kept = np.exp(-1.0 / (RATE_HZ * leaks_s))
    charge = lfilter([1.0 - kept], [1.0, -kept], np.gradient(x) * RATE_HZ)
    made = codes.copy()
    made[:, :3] += 12.0 * (charge / charge.std())[:, None] * [1.0, -0.7, 1.2]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_a_fold_that_lies_the_other_way_each_time_is_unknown() -> None:
    """It wanders as slowly as a walk or a temperature, and only while the strain moves."""
    x, codes = clean(66)
    side = 1.0 - 2.0 * (np.cumsum(np.diff(x < 0.3, prepend=False)) // 2 % 2)
    made = codes.copy()
    made[:, 1:3] += (60.0 * side * np.maximum(x - 0.3, 0.0) ** 2)[:, None] * [1.0, 0.6]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_a_part_that_relaxes_at_another_pace_is_retuned() -> None:
    x, codes = clean(42)

    def paced(tau_s: float) -> np.ndarray:
        return codes + 0.2 * (filtered(codes, tau_s) - codes)

    for was_s, is_s in ((10.0, 25.0), (30.0, 120.0)):
        result = diagnose(recorded(x, paced(was_s), 1), recorded(x, paced(is_s), 2))
        assert [(e["name"], e["kind"]) for e in result.data["effects"]] == [
            ("relaxation", "retune")
        ]
        assert result.data["effects"][0]["channels"] == ["s1", "s2", "s3", "s4"]


def test_what_relaxes_faster_where_it_is_stretched_is_relaxation() -> None:
    x, codes = clean(47)
    slow = codes.copy()
    for k in range(1, len(x)):
        kept = np.exp(-np.exp(2.0 * x[k]) / (RATE_HZ * 12.0))
        slow[k] = codes[k] + kept * (slow[k - 1] - codes[k])
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + 0.25 * (slow - codes), 2))
    assert result.effects == ("relaxation",)
    assert result.data["unexplained"]["share"] < 0.002


@pytest.mark.parametrize("effect", ["step", "random_walk"])
def test_an_effect_shows_beside_a_noise_that_is_much_louder(effect: str) -> None:
    """So many samples tell it from chance, far below one noise."""
    x, codes = clean(4, 8000)
    rng = np.random.default_rng(4)
    real = codes + rng.normal(0.0, 25.0, codes.shape)
    if effect == "step":
        real[5000:] += 9.0
    else:
        real += np.cumsum(rng.normal(0.0, 0.35, codes.shape), axis=0)
    result = diagnose(recorded(x, codes, 1), recorded(x, real, 2))
    assert sorted(result.effects) == sorted([effect, "noise"])
    assert not result.data["unexplained"]["unknown_effect"]


def test_one_channel_is_louder_where_the_others_agree() -> None:
    """By less than what a recording may be louder than its simulation."""
    x, codes = clean(16)
    loud = codes.copy()
    loud[:, 1] += np.random.default_rng(5).normal(0.0, 2.2, len(x))
    result = diagnose(recorded(x, codes, 1), recorded(x, loud, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("noise", ["s2"])]


@pytest.mark.parametrize("read", ["below", "nearest"])
def test_codes_that_never_occur_are_the_converters(read: str, tmp_path: Path) -> None:
    """The converter of two channels gives one code of 40, and says so on the next motion too."""

    def lost(recording: Recording) -> Recording:
        codes = recording.codes.copy()
        whole = codes[:, :2] / 40.0
        codes[:, :2] = 40 * (np.floor(whole) if read == "below" else np.rint(whole))
        return replace(recording, codes=codes)

    x, codes = clean(18, SAMPLES + 2000)
    now, then = slice(0, SAMPLES), slice(SAMPLES, None)
    sim, real = recorded(x[now], codes[now], 1), recorded(x[now], codes[now], 2)
    assert not len(lost_codes(real, sim))
    result = diagnose(sim, lost(real))
    assert result.effects == ("adc_nonlinearity",)
    assert result.data["effects"][0]["channels"] == ["s1", "s2"]
    assert not result.data["unexplained"]["unknown_effect"]
    folder.write(result, sim, lost(real), tmp_path / "found")
    sim2, real2 = recorded(x[then], codes[then], 3), lost(recorded(x[then], codes[then], 4))
    later = augment(folder.read(tmp_path / "found"), sim2).codes - real2.codes
    before = sim2.codes - real2.codes
    # The noise of both decides which code it is next to a threshold.
    assert (later[:, :2] ** 2).sum() < 0.55 * (before[:, :2] ** 2).sum()


@pytest.mark.parametrize("kind", ["coloured", "bursts", "long bursts"])
def test_noise_of_a_colour_or_in_bursts_is_noise(kind: str) -> None:
    """It is no walk, and its bursts are no spikes and nothing unknown."""
    x, codes = clean(41)
    rng = np.random.default_rng(17)
    white = rng.normal(0.0, 8.0, (len(x), 2))
    second = np.arange(len(x)) / RATE_HZ
    louder = lfilter([1.0], [1.0, -0.7], 0.6 * white, axis=0)
    if kind != "coloured":
        on = second % 37.0 < (2.0 if kind == "bursts" else 8.0)
        louder = white * on[:, None]
    made = codes.copy()
    made[:, [0, 2]] += louder
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"noise": ["s1", "s3"]}
    assert not result.data["unexplained"]["unknown_effect"]


def test_a_loop_with_another_mean_curve_is_hysteresis_alone() -> None:
    """What its equation leaves is a small share of it, and no effect besides."""
    x, codes = clean(50)
    loops = np.zeros_like(x)
    for size, half in ((0.5, 0.05), (1.0, 0.12), (0.6, 0.25)):
        played, at = np.empty_like(x), x[0]
        for k, value in enumerate(x):
            played[k] = at = min(max(at, value - half), value + half)
        loops += size * (played - x)
    loops -= np.polyval(np.polyfit(x, loops, 3), x)
    curve = np.sin(2.2 * np.pi * x)
    curve -= np.polyval(np.polyfit(x, curve, 1), x)
    change = 18.0 * (loops / loops.std() + 0.5 * curve / curve.std())
    made = codes + change[:, None] * np.array([1.0, -1.0, 0.7, 0.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("hysteresis",)
    assert not result.data["unexplained"]["unknown_effect"]


def test_spikes_that_come_in_bursts_are_spikes() -> None:
    """Between those of one burst it is as calm as elsewhere, unlike in a burst of noise."""
    x, codes = clean(47)
    rng = np.random.default_rng(31)
    made = codes.copy()
    for begin in np.flatnonzero(rng.random(len(x) - 40) < 0.003):
        made[begin + rng.choice(33, 11, replace=False), 1] += rng.uniform(30.0, 90.0, 11)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("spikes",)
    assert not result.data["unexplained"]["unknown_effect"]


def test_what_spikes_leave_is_no_coloured_noise() -> None:
    """Nor is what is coloured where it is little beside the noise that was simulated."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(12)
    own, left = rng.normal(size=(2, *codes.shape))
    left *= 1.6
    left[:, 1] += 90.0 * (rng.random(len(codes)) < 0.005)
    left[:, 2] += lfilter([0.3], [1.0, -0.7], rng.normal(size=len(codes)))
    left[:, 3] += lfilter([3.0], [1.0, -0.7], rng.normal(size=len(codes)))
    found = findings(left, left, own, motion_of(x, 0.05, 0.0, None), False, noisy=(1, 2, 3))
    assert {f.name: f.channels for f in found} == {"spikes": (1,), "noise": (3,)}


def test_a_contact_that_opens_and_closes_is_neither_a_walk_nor_a_temperature() -> None:
    """It is the same on several channels, and at one of two levels nearly always."""
    x, codes = clean(44)
    rng = np.random.default_rng(23)
    swap = rng.random(len(x)) < 0.01
    made = codes + np.array([9.0, -7.0, 0.0, 8.0]) * (np.cumsum(swap) % 2)[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_a_tone_that_is_loud_on_one_channel_is_heard_on_others_beside_walks() -> None:
    """There it is little beside what wanders, and would look like a swing of that."""
    x, codes = clean(45)
    rng = np.random.default_rng(29)
    tone = np.sin(2.0 * np.pi * 3.47 * np.arange(len(x)) / RATE_HZ)
    made = codes + np.cumsum(rng.normal(0.0, 1.6, codes.shape), axis=0)
    made += tone[:, None] * np.array([3.0, 3.0, 9.0, 3.0])
    real = recorded(x, made, 2)
    result = diagnose(recorded(x, codes, 1), real)
    assert set(result.effects) == {"interference", "random_walk"}
    assert all(effect["channels"] == list(real.sensors) for effect in result.data["effects"])


@pytest.mark.parametrize(
    ("hertz", "noise", "said"),
    [((3.656,), 14.0, {"interference", "noise"}), ((0.818, 0.588), 1.3, {"interference"})],
)
def test_channels_seem_to_hear_no_tone_of_each_other(
    hertz: tuple[float, ...], noise: float, said: set[str]
) -> None:
    """Tones that are little beside a loud noise, or slow, on several channels at once."""
    x, codes = clean(47)
    t = np.arange(len(x)) / RATE_HZ
    tones = sum(np.sin(2.0 * np.pi * f * t) for f in hertz)
    made = codes + 1.1 * noise * tones[:, None] * np.array([1.0, 1.5, 0.0, 0.8])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2, noise))
    assert set(result.effects) == said
    assert not result.data["unexplained"]["unknown_effect"]


def test_a_tone_that_fades_in_and_out_is_nothing_else() -> None:
    """It is off for most of the time, so that little of it is in its line."""
    x, codes = clean(42)
    second = np.arange(len(x)) / RATE_HZ
    fades = lfilter([0.25], [1.0, -0.75], second % 23.0 < 4.0)
    made = codes.copy()
    made[:, 2] += 70.0 * np.sin(2.0 * np.pi * 1.34 * second) * fades
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("interference",)
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize("draws", [35.0, 60.0])
def test_codes_that_draw_others_in_are_the_converters(draws: float) -> None:
    """From below and from above, and where the motion ends among them."""
    x, codes = clean(43)

    def sticky(recording: Recording) -> Recording:
        read = recording.codes.copy()
        beside = (read[:, 1:] - 5) % 128 - 64
        read[:, 1:] -= np.where(np.abs(beside) < draws, beside, 0)
        return replace(recording, codes=read)

    result = diagnose(recorded(x, codes, 1), sticky(recorded(x, codes, 2)))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"adc_nonlinearity": ["s2", "s3", "s4"]}
    assert not result.data["unexplained"]["unknown_effect"]


def test_a_material_feels_the_strain_that_comes_late() -> None:
    """Its loops turn when the strain does that reaches it."""
    x, codes = clean(16)
    index = np.arange(len(x))
    late = np.interp(index - 6.0, index, x)
    loops = np.stack([np.full(len(x), x[0])] * 3)
    for loop, half in zip(loops, (0.03, 0.08, 0.2), strict=True):
        for k in range(1, len(x)):
            loop[k] = min(max(loop[k - 1], late[k] - half), late[k] + half)
    made = sensed(late) + 150.0 * (loops.mean(axis=0) - late)[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"delay", "hysteresis"}
    # Loops of the strain as it was sent would be more off than half the noise.
    assert np.abs(change_of(result, 12) - (made - codes)).mean() < 0.65


def test_a_clock_that_is_late_has_seen_the_play_before_it() -> None:
    """Play and a delay are not the sum of what either does alone."""
    x, codes = clean(17)
    played, index = np.empty(len(x)), np.arange(len(x))
    played[0] = x[0]
    for k in range(1, len(x)):
        played[k] = min(max(played[k - 1], x[k] - 0.06), x[k] + 0.06)
    made = sensed(np.interp(index - 4.0, index, played))
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"backlash", "delay"}


def test_what_one_channel_knows_of_the_motion_helps_the_others() -> None:
    """Beside a lag that is much larger, nobody would begin with so little slack and play."""
    x, codes = clean(19)
    taut = np.maximum(x - 0.01, 0.0)
    played = np.empty(len(x))
    played[0] = taut[0]
    for k in range(1, len(x)):
        played[k] = min(max(played[k - 1], taut[k] - 0.02), taut[k] + 0.02)
    made = sensed(played)
    made[:, 1:] = filtered(filtered(made[:, 1:], 0.3), 0.3)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"backlash", "lag"}
    assert np.abs(change_of(result, 12) - (made - codes)).mean() < 0.65


def test_a_small_effect_shows_beside_a_large_one_that_is_right() -> None:
    """A gain of 1.5 % under a step of 80 codes; these channels are all alike, and so it could be
    crosstalk."""
    x, codes = clean(5)
    late = (np.arange(SAMPLES) > 0.55 * SAMPLES)[:, None]
    diagnosis = diagnose(
        recorded(x, codes, 1), recorded(x, codes + 0.015 * (codes - codes[0]) + 80.0 * late, 2)
    )
    step, other = diagnosis.effects
    assert step == "step"
    assert other in ("gain", "crosstalk")
    assert not diagnosis.data["unexplained"]["unknown_effect"]


def test_a_slow_recording_has_no_tones() -> None:
    left = np.random.default_rng(0).normal(size=(600, 2)) * 3.0
    motion = motion_of(np.linspace(0.0, 1.0, 600), 5.0, 0.0, None)
    assert findings(left, left, left, motion, False) == []


def test_heavy_tails_are_no_spikes_and_harmonics_no_noise() -> None:
    x, codes = clean(14)
    rng = np.random.default_rng(3)
    tails = codes + 7.0 * rng.laplace(size=codes.shape)
    assert diagnose(recorded(x, codes, 1), recorded(x, tails, 2)).effects == ("noise",)
    square = 12.0 * np.sign(np.sin(2.0 * np.pi * 2.31 * np.arange(SAMPLES) / RATE_HZ))
    hummed = codes + square[:, None]
    assert diagnose(recorded(x, codes, 1), recorded(x, hummed, 2)).effects == ("interference",)


@pytest.mark.parametrize(("step", "gain"), [(0.02, 0.02), (0.2, 0.2), (1.0, 0.6)])
def test_what_a_walk_does_not_foretell_is_white(step: float, gain: float) -> None:
    """The settled gain K of a local level solves K^2 / (1 - K) = (step / noise)^2."""
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.normal(size=40_000)) * step + rng.normal(size=40_000)
    assert likely_gain(walk, 1.0) == gain
    news = innovations(walk[:, None], gain)[:, 0]
    assert news.std() == pytest.approx(1.0, rel=0.03)
    assert abs(np.corrcoef(news[1:], news[:-1])[0, 1]) < 0.05
    everywhere = np.ones(len(walk), dtype=bool)
    assert not jerky(walk, gain, everywhere)
    ringing = np.exp(-np.arange(60) / 12) * np.sin(np.arange(60) * 0.53)
    rung = np.convolve(rng.normal(size=len(walk)) * (rng.random(len(walk)) < 0.02), ringing)
    assert jerky(20.0 * rung[: len(walk)] + rng.normal(size=len(walk)), gain, everywhere)
    swung = sum(np.sin(np.arange(len(walk)) * pace) for pace in (0.013, 0.037, 0.11))
    assert jerky(20.0 * swung + rng.normal(size=len(walk)), gain, everywhere)


def test_noise_is_no_louder_beside_a_walk_that_moves_as_much() -> None:
    rng = np.random.default_rng(6)
    x, _ = clean(9, 8000)
    motion = motion_of(x, 0.05, 0.0, None)
    own = rng.normal(size=(8000, 3))
    walk = 8.0 * np.cumsum(rng.normal(size=(8000, 3)), axis=0)
    for louder in (1.0, 3.0):
        left = walk + louder * rng.normal(size=(8000, 3))
        found = findings(left, left, own, motion, explained=True, walking=(0, 1, 2))
        assert [finding.name for finding in found] == ["noise"] * (louder > 1.0)


def test_tones_spikes_and_noise_are_found_beside_each_other() -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(2)
    own = rng.normal(size=codes.shape)
    left = rng.normal(size=codes.shape)
    tone = 12.0 * np.sin(2 * np.pi * 6.9 * 0.05 * np.arange(len(codes)))
    spikes = 60.0 * (rng.random(len(codes)) < 0.005)
    left[:, 0] += tone
    left[:, 1] += tone + spikes
    left[:, 2] = 4.0 * left[:, 2] + spikes
    motion = motion_of(x, 0.05, 0.0, None)
    found = {f.name: f for f in findings(left, left, own, motion, True)}
    channels = {name: finding.channels for name, finding in found.items()}
    assert channels == {"spikes": (1, 2), "interference": (0, 1), "noise": (2,)}
    assert found["interference"].value == pytest.approx(6.9, abs=0.01)
    rest = cleaned(left, list(found.values()), motion)
    assert rest[:, :2].std() == pytest.approx(1.0, rel=0.1)


def test_a_fast_tone_beside_a_slow_one_is_no_noise() -> None:
    x, codes = clean(9, 8000)
    left = np.random.default_rng(2).normal(size=codes.shape)
    turns = 2 * np.pi * 0.05 * np.arange(len(codes))
    left[:, 1] += 40.0 * np.sin(3.1 * turns) + 24.0 * np.sin(8.412 * turns)
    motion = motion_of(x, 0.05, 0.0, None)
    found = evident(left, motion)
    assert [(f.name, f.channels) for f in found] == [("interference", (1,))]
    assert cleaned(left, found, motion)[:, 1].std() == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize("hertz", [0.061, 0.2425, 0.36])
def test_a_tone_as_slow_as_the_motion_is_a_tone(hertz: float) -> None:
    """Beside a walk, of which it leaves what is nearly as slow as it."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(7)
    motion = motion_of(x, 0.05, 0.0, None)
    alone = 0.3 * np.cumsum(rng.normal(size=codes.shape), axis=0) + rng.normal(size=codes.shape)
    tone = 12.0 * np.sin(2 * np.pi * hertz * 0.05 * np.arange(len(codes)))
    left = alone + tone[:, None] * np.array([1.0, 0.0, 1.0, 0.0])
    found = evident(left, motion)
    assert {(f.name, f.channels) for f in found} == {("interference", (0,)), ("interference", (2,))}
    for finding in found:
        assert finding.value == pytest.approx(hertz, abs=5e-4)
    rest = cleaned(left, found, motion)
    assert (rest - alone).std(axis=0).max() < 0.15 * tone.std()


def test_a_line_of_the_motion_is_no_slow_tone() -> None:
    x = 0.5 - 0.5 * np.cos(2 * np.pi * 0.0525 * 0.05 * np.arange(8000))
    left = np.random.default_rng(8).normal(size=(8000, 1))
    left[:, 0] += 9.0 * np.cos(3.0 * np.arccos(1.0 - 2.0 * x))
    assert evident(left, motion_of(x, 0.05, 0.0, None)) == []


def test_a_drift_of_a_short_recording_is_no_slow_tone() -> None:
    t = np.arange(400) / RATE_HZ
    left = np.random.default_rng(8).normal(size=(400, 1))
    left[:, 0] += 60.0 * np.exp(-3.0 * t / t[-1])
    assert evident(left, motion_of(0.5 - 0.5 * np.cos(3.0 * t), 0.05, 0.0, None)) == []


def test_a_resistor_that_was_not_met_is_as_its_neighbour() -> None:
    """Nothing else tells how far a converter is off where a fit has not been."""
    adc = importlib.import_module("softsense.effects.adc_nonlinearity")
    share = np.linspace(0.0, 1.0, 441)
    columns = adc._ladder(SimpleNamespace(share=share, span=500.0), 12)
    off = 40.0 * (share > 0.3) - 15.0 * (share > 0.6)
    met = (share > 0.2) & (share < 0.8)
    weights = np.linalg.lstsq(columns[met], off[met])[0]
    levels = 500.0 * adc._levels(weights)
    assert levels == pytest.approx((columns @ weights)[::40])
    assert levels[[0, -1]] == pytest.approx(levels[[1, -2]])
    assert levels[[0, -1]] == pytest.approx([0.0, 25.0], abs=5.0)


def test_one_spike_that_is_large_enough_is_one() -> None:
    x, codes = clean(9, 8000)
    for size, said in ((15.0, []), (200.0, ["spikes"])):
        left = np.random.default_rng(5).normal(size=codes.shape)
        left[4321, 2] += size
        motion = motion_of(x, 0.05, 0.0, None)
        own = np.random.default_rng(6).normal(size=codes.shape)
        assert [f.name for f in findings(left, left, own, motion, False)] == said
        found = evident(left, motion)
        assert [(f.name, f.channels) for f in found] == [(name, (2,)) for name in said]
    assert abs(cleaned(left, found, motion)[4321, 2]) < 5.0


@pytest.mark.parametrize("width", [1, 2])
def test_what_a_few_spikes_leave_in_a_tone_is_no_noise(width: int) -> None:
    """They bend a tone that moves, all around them, which then hides them."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(1)
    own, left = rng.normal(size=(2, len(codes), 1))
    phase = 2.0 * np.pi * 4.3 * np.arange(len(codes)) / RATE_HZ
    left[:, 0] += 8.0 * np.sin(phase + np.cumsum(rng.normal(0.0, 0.05, len(codes))))
    for begin, sign in ((700, 1.0), (3121, -1.0), (5410, 1.0)):
        left[begin : begin + width, 0] += 120.0 * sign
    motion = motion_of(x, 1.0 / RATE_HZ, 0.0, None)
    found = findings(left, left, own, motion, False)
    assert [each.name for each in found] == ["spikes", "interference"]
    assert np.std(cleaned(left, found, motion)) < 1.3


def test_steps_of_a_converter_are_no_spikes() -> None:
    """Of every 128 codes eight are off: they tell where it jumps."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(31)
    voltage = codes + rng.normal(size=codes.shape)
    left = rng.normal(size=codes.shape)
    left[:, 1] += 30.0 * (voltage[:, 1] % 128.0 < 8.0)
    left[rng.random(8000) < 0.01, 2] += 40.0
    motion = motion_of(x, 0.05, 0.0, None)
    own = rng.normal(size=codes.shape)
    for found in (evident(left, motion), findings(left, left, own, motion, False)):
        there = {c for finding in found if finding.name == "spikes" for c in finding.channels}
        assert there == {1, 2}
    met = [codes, voltage]
    for found in (
        evident(left, motion, codes=met),
        findings(left, left, own, motion, False, codes=met),
    ):
        there = {c for finding in found if finding.name == "spikes" for c in finding.channels}
        assert there == {2}


def test_a_converters_curve_is_seen_where_all_wanders() -> None:
    """What was read tells where on its curve the converter was, whatever led there."""
    x, codes = clean(18)
    rng = np.random.default_rng(32)
    wandered = codes + 2.0 * np.cumsum(rng.normal(size=codes.shape), axis=0)
    hurt = wandered + 15.0 * np.sin(2.0 * np.pi * wandered / 900.0)
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert set(result.effects) == {"adc_nonlinearity", "random_walk"}
    assert not result.data["unexplained"]["unknown_effect"]


def test_spikes_that_go_where_nothing_else_does_are_no_steps() -> None:
    """All to the lowest code: it would tell them."""
    x, codes = clean(54)
    hit = np.random.default_rng(2).random(len(x)) < 0.008
    read = np.clip(np.rint(codes - 2500.0 * hit[:, None] * [1, 0, 0, 0]), 0, 4095)
    own = np.random.default_rng(3).normal(0.0, 1.3, codes.shape)
    left = read - codes + own
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    (found,) = findings(left, left, own, motion, False, codes=(codes, read))
    assert (found.name, found.channels) == ("spikes", (0,))


def test_spikes_with_a_tail_are_spikes() -> None:
    """Which fall to a half in a quarter of a second, and would leave a wandering behind."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(12)
    struck = (rng.random(len(codes)) < 0.006) * rng.choice([-1.0, 1.0], len(codes))
    spikes = lfilter([1.0], [1.0, -(0.5**0.2)], struck * rng.uniform(15.0, 60.0, len(codes)))
    left = rng.normal(size=codes.shape)
    left[:, 1] += spikes
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert (found.name, found.channels) == ("spikes", (1,))
    rest = cleaned(left, [found], motion)[:, 1]
    assert rest.std() < 1.15
    assert np.convolve(rest, np.ones(8) / 8.0, "same").std() < 0.7


@pytest.mark.parametrize("seed", [11, 12])
def test_what_long_tails_of_spikes_leave_is_nothing_unknown(seed: int) -> None:
    """Tails of two paces, of which one is taken out: the rest comes and goes with the spikes."""
    x, codes = clean(seed)
    rng = np.random.default_rng(seed)
    struck = (rng.random(SAMPLES) < 0.004) * rng.choice([-1.0, 1.0], SAMPLES)
    struck *= rng.uniform(40.0, 120.0, SAMPLES)
    k = np.arange(300)
    shape = 0.7 * np.exp(-k / 6.0) + 0.3 * np.exp(-k / 30.0)
    hurt = codes.copy()
    hurt[:, 1] += np.convolve(struck, shape)[:SAMPLES]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("spikes",)
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize("seed", [14, 17])
def test_spikes_that_rise_between_samples_and_fade_slowly_are_gone(seed: int) -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(seed)
    left = rng.normal(size=codes.shape)
    struck = np.zeros(8000)
    at = rng.choice(np.arange(100, 7900), 16, replace=False)
    struck[at] = rng.choice([-1.0, 1.0], 16) * rng.uniform(12.0, 40.0, 16)
    shape = np.concatenate([[0.6], np.exp(-np.arange(40) / 7.0)])
    left[:, 2] += np.convolve(struck, shape)[:8000]
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = evident(left, motion)
    assert (found.name, found.channels) == ("spikes", (2,))
    assert left[:, 2].std() > 2.5
    assert cleaned(left, [found], motion)[:, 2].std() < 1.2


@pytest.mark.parametrize("seed", [19, 23])
def test_long_tails_of_large_spikes_are_no_tone(seed: int) -> None:
    """Each is far off for as long as a burst of one."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(seed)
    left = rng.normal(0.0, 3.0, codes.shape)
    struck = np.zeros(8000)
    at = rng.choice(np.arange(100, 7900), 40, replace=False)
    struck[at] = rng.choice([-1.0, 1.0, 1.0], 40) * rng.uniform(200.0, 1000.0, 40)
    left[:, 2] += lfilter([1.0], [1.0, -np.exp(-1.0 / 10.5)], struck)
    motion = motion_of(x, 0.05, 0.0, None)
    found = findings(left, left, rng.normal(0.0, 3.0, codes.shape), motion, False)
    assert [(each.name, each.channels) for each in found] == [("spikes", (2,))]
    assert np.std(cleaned(left, found, motion)[:, 2]) < 6.0


def test_tails_of_spikes_are_no_walk() -> None:
    """A walk follows small ones, and foretells their tails: what it does not is no longer sharp."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(22)
    struck = (rng.random(len(codes)) < 0.008) * rng.choice([-1.0, 1.0], len(codes))
    sizes = np.exp(rng.uniform(np.log(8.0), np.log(32.0), len(codes)))
    spikes = lfilter([1.0], [1.0, -0.82], struck * sizes)
    left = rng.normal(size=codes.shape)
    left[:, 1] += spikes
    motion = motion_of(x, 0.05, 0.0, None)
    own = rng.normal(size=codes.shape)
    (found,) = findings(left, left, own, motion, True, walking=[1])
    assert (found.name, found.channels) == ("spikes", (1,))
    assert cleaned(left, [found], motion)[:, 1].std() < 1.1


def test_neither_noise_that_varies_nor_an_edge_is_spiky() -> None:
    """Noise that is loud for some seconds and quiet for others; jumps that come a moment late."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(13)
    own, left = rng.normal(size=(2, *codes.shape))
    loudness = np.convolve(rng.normal(size=len(codes)), np.hanning(200), "same")
    left[:, 0] *= np.exp(loudness / loudness.std())
    jumps = np.flatnonzero(rng.random(len(codes)) < 0.01)
    said = np.zeros(codes.shape)
    said[:, 2] = 40.0 * (np.cumsum(np.bincount(jumps, minlength=len(codes))) % 2)
    left[jumps, 2] += 40.0 * rng.choice([-1.0, 1.0], len(jumps))
    motion = motion_of(x, 0.05, 0.0, None)
    assert "spikes" not in {f.name for f in findings(left, left + said, own, motion, True)}
    hurt = {f.name: f.channels for f in findings(left, left, own, motion, True)}
    assert hurt["spikes"] == (2,)


def test_what_is_rough_for_a_while_is_not_spiky() -> None:
    """An equation that is only nearly right leaves much where it is, and nothing elsewhere."""
    x, codes = clean(9, 8000)
    own, left = np.random.default_rng(18).normal(size=(2, *codes.shape))
    left[1000:1300, 1] *= 12.0
    left[5000:5200, 1] *= 12.0
    motion, said = motion_of(x, 0.05, 0.0, None), 30.0 * x[:, None]
    left[::200, 2] += 40.0
    found = {f.name: f.channels for f in findings(left, left + said, own, motion, True)}
    assert found["spikes"] == (2,)


def test_noise_that_comes_with_moves_is_noise_beside_what_is_slow() -> None:
    """What an equation of moves leaves comes with them too; what a drift leaves does not."""
    x, codes = clean(9, 8000)
    own, left = np.random.default_rng(19).normal(size=(2, *codes.shape))
    speed = np.abs(np.gradient(x))
    left[:, 1] *= 1.2 + speed / speed.std()
    motion = motion_of(x, 0.05, 0.0, None)
    drift, moves = 40.0 * np.linspace(0.0, 1.0, len(x)), 300.0 * x
    (found,) = findings(left, left + drift[:, None], own, motion, True)
    assert (found.name, found.channels) == ("noise", (1,))
    assert findings(left, left + moves[:, None], own, motion, True) == []


def test_a_low_harmonic_is_gone_with_its_tone() -> None:
    """The fifth of 7.93 Hz folds down to 0.35 Hz, among what the motion does; the third is not
    there."""
    _, codes = clean(9, 8000)
    t = 0.05 * np.arange(len(codes))
    x = sum(np.sin(2 * np.pi * hertz * t + 9.0 * hertz) for hertz in (0.07, 0.13, 0.22, 0.39))
    left = np.random.default_rng(14).normal(size=codes.shape)
    left[:, 3] += 3.0 * x
    for order, size in ((1, 10.0), (2, 4.0), (5, 6.0)):
        left[:, 3] += size * np.sin(2 * np.pi * order * 7.93 * t + order)
    motion = motion_of(x, 0.05, 0.0, None)
    rest = cleaned(left, [Finding("interference", (3,), 7.93, "")], motion)[:, 3]
    for hertz in (7.93, 4.14, 0.35):
        assert 2.0 * np.abs(np.mean(rest * np.exp(2j * np.pi * hertz * t))) < 0.1


def test_noise_behind_a_curve_is_as_uneven_as_the_curve_is_steep() -> None:
    x, codes = clean(9, 8000)
    own, left = np.random.default_rng(16).normal(size=(2, *codes.shape))
    left[:, 2] *= 0.2 + 1.2 * x
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = findings(left, left, own, motion, True)
    assert (found.name, found.channels) == ("noise", (2,))
    assert findings(left, left, own, motion, True, bent=[2]) == []


def test_harmonics_are_gone_beside_what_is_slow_and_where_they_are() -> None:
    """A second that folds down to 0.15 Hz and a loud fifth, beside a drift far above the noise."""
    _, codes = clean(9, 8000)
    t = 0.05 * np.arange(len(codes))
    x = sum(np.sin(2 * np.pi * hertz * t + 9.0 * hertz) for hertz in (0.07, 0.13, 0.22, 0.39))
    left = np.random.default_rng(15).normal(size=codes.shape)
    left[:, 3] += 40.0 * np.tanh((t - 200.0) / 50.0)
    for order, size in ((1, 20.0), (2, 8.0), (3, 6.0), (5, 12.0)):
        left[:, 3] += size * np.sin(2 * np.pi * order * 9.925 * t + order)
    motion = motion_of(x, 0.05, 0.0, None)
    rest = cleaned(left, [Finding("interference", (3,), 9.925, "")], motion)[:, 3]
    for hertz in (9.925, 0.15, 9.775, 9.625):
        assert 2.0 * np.abs(np.mean(rest * np.exp(2j * np.pi * hertz * t))) < 0.3


def test_a_tone_that_was_heard_before_is_heard_again() -> None:
    """Beside an effect, whose ripples pass for weak tones, only where that one was already."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(6)
    own, left = rng.normal(size=(2, *codes.shape))
    left[:, 0] += 0.8 * np.sin(2 * np.pi * 6.9 * 0.05 * np.arange(len(codes)))
    motion = motion_of(x, 0.05, 0.0, None)
    assert findings(left, left, own, motion, True) == []
    assert findings(left, left, own, motion, True, heard=[4.2]) == []
    (again,) = findings(left, left, own, motion, True, heard=[6.9])
    assert (again.name, again.channels) == ("interference", (0,))
    # So it is where another channel has it loud, whose phase is its own.
    left[:, 2] += 20.0 * np.cos(2 * np.pi * 6.9 * 0.05 * np.arange(len(codes)))
    residual = left.copy()
    residual[:, 0] = own[:, 1]  # where it would be heard anyway
    (both,) = findings(left, residual, own, motion, True)
    assert (both.name, both.channels) == ("interference", (0, 2))


@pytest.mark.parametrize("size", [0.8, 20.0])
def test_a_tone_whose_frequency_moves_is_a_tone(size: float) -> None:
    """From 4 to 4.4 Hz, and so at no frequency for long."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(7)
    t = 0.05 * np.arange(len(codes))
    own, left = rng.normal(size=(2, *codes.shape))
    left[:, 2] += size * np.sin(2 * np.pi * (4.0 + 0.0005 * t) * t)
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = findings(left, left, own, motion, False)
    assert (found.name, found.channels) == ("interference", (2,))
    assert found.value == pytest.approx(4.2, abs=0.02)
    assert cleaned(left, [found], motion).std() == pytest.approx(1.0, rel=0.05)
    loud = [(hum.channels, round(hum.value, 1)) for hum in evident(left, motion)]
    assert loud == ([((2,), 4.2)] if size > 1.0 else [])


def test_a_tone_that_wanders_leaves_alone_what_is_slow() -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(3)
    # Its phase runs away by chance; the 28th harmonic would fold down to 0.34 Hz.
    phase = 2 * np.pi * 5.702 * 0.05 * np.arange(len(codes)) + np.cumsum(
        rng.normal(0.0, 0.02, len(codes))
    )
    slow = 20.0 * np.convolve(rng.normal(size=len(codes)), np.hanning(60) / 5.0, "same")
    left = rng.normal(size=codes.shape)
    left[:, 0] += slow + 40.0 * np.sin(phase)
    rest = cleaned(left, [Finding("interference", (0,), 5.702, "")], motion_of(x, 0.05, 0.0, None))
    assert np.std(rest[:, 0] - slow) < 1.25


def test_a_tone_that_is_switched_leaves_nothing_at_its_instants() -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(4)
    index = np.arange(len(codes))
    on = (index // 230 % 3 > 0) & (index > 517)
    hummed = 20.0 * on * np.sin(2 * np.pi * 3.37 * 0.05 * index)
    left = rng.normal(size=codes.shape)
    left[:, 1] += hummed
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert (found.name, found.channels) == ("interference", (1,))
    rest = cleaned(left, [found], motion)
    assert np.abs(rest).max() < 6.0
    assert np.std(rest[:, 1]) == pytest.approx(1.0, rel=0.03)


def test_a_tone_in_pulses_whose_phase_wanders_is_no_spikes() -> None:
    """A heater that is on for two thirds of a minute, its pulses sampled now and then."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(5)
    index = np.arange(len(codes))
    on = index // 400 % 3 > 0
    phase = 2 * np.pi * 7.79 * 0.05 * index + np.cumsum(rng.normal(0.0, 0.03, len(codes)))
    left = rng.normal(size=codes.shape)
    left[:, 2] += 40.0 * on * (np.exp(2.0 * (np.cos(phase) - 1.0)) - 0.3)
    motion = motion_of(x, 0.05, 0.0, None)
    found = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert [(each.name, each.channels) for each in found] == [("interference", (2,))]
    assert np.std(cleaned(left, found, motion)[:, 2]) < 2.0
    assert noise_beside(cleaned(left, found, motion), found) == pytest.approx(np.ones(4), abs=0.2)


def test_a_tone_with_edges_leaves_none() -> None:
    """A relay's, whose edges are between other samples each time."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(9)
    left = rng.normal(size=codes.shape)
    left[:, 1] += 15.0 * np.sign(np.sin(2 * np.pi * 5.578 * 0.05 * np.arange(len(codes)) + 1.0))
    motion = motion_of(x, 0.05, 0.0, None)
    found = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert [(each.name, each.channels) for each in found] == [("interference", (1,))]
    assert np.std(cleaned(left, found, motion)[:, 1]) < 1.1


def test_a_walk_does_not_heed_the_motion() -> None:
    x, _ = clean(9, 8000)
    rng = np.random.default_rng(10)
    speed = np.abs(np.gradient(x))
    noise, moves = rng.normal(size=(2, 8000))
    assert not moved_by(noise + np.cumsum(0.3 * moves), speed)
    assert moved_by(noise + np.cumsum(0.3 * moves * speed / speed.mean()), speed)
    assert moved_by(noise + np.cumsum(moves * (speed < np.median(speed))), speed)


def test_spikes_that_ring_for_long_are_spikes() -> None:
    """Two time constants, and the next one often before the last is over."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(8)
    hits = (rng.random(len(codes)) < 0.01) * rng.choice([-1.0, 1.0], len(codes)) * 90.0
    left = rng.normal(size=codes.shape)
    left[:, 1] += lfilter([1.0], np.convolve([1.0, -0.7], [1.0, -0.8]), hits)
    motion = motion_of(x, 0.05, 0.0, None)
    found = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert [(each.name, each.channels) for each in found] == [("spikes", (1,))]
    assert np.std(left[:, 1]) > 12.0
    assert np.std(cleaned(left, found, motion)[:, 1]) < 2.5


def test_walks_are_another_effects_only_where_most_of_them_is(monkeypatch) -> None:
    """What all channels have in common may be a little of what each has for itself."""
    rng = np.random.default_rng(14)
    own = np.cumsum(rng.normal(size=(3, 8000)), axis=1) + rng.normal(size=(3, 8000))
    common = lfilter([1.0], [1.0, -0.95], rng.normal(size=8000))
    channel = SimpleNamespace(gain_of=lambda walk: 0.6)
    for share, said in ((0.4, False), (3.0, True)):
        walks = [(channel, walk + share * common) for walk in own]
        monkeypatch.setattr(vetting, "walks_of", lambda channels, best, walks=walks: walks)
        assert vetting._alike((), Model(frozenset({"gain", "random_walk"}), (), 0.0), False) is said


def test_noise_of_some_colour_beside_a_step_is_no_walk() -> None:
    x, codes = clean(72)
    hiss = lfilter([1.0], [1.0, -0.8], np.random.default_rng(72).normal(size=(SAMPLES, 2)), axis=0)
    made = codes.copy()
    made[SAMPLES // 2 :] += 15.0
    made[:, :2] += 9.0 * hiss / hiss.std(axis=0)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert {e["name"]: e["channels"] for e in result.data["effects"]} == {
        "step": ["s1", "s2", "s3", "s4"],
        "noise": ["s1", "s2"],
    }
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize(("walk", "noisy"), [(set(), False), ({"random_walk"}, True)])
def test_a_little_that_an_effect_leaves_is_no_noise_and_has_rivals(
    monkeypatch, walk: set[str], noisy: bool
) -> None:
    """Only what a walk would say may be noise in its place, and what else it could be is kept."""
    lag, delay = (
        Model(frozenset({name}), (), price) for name, price in (("lag", 2.0), ("delay", 3.0))
    )
    best = Model(frozenset({"lag", *walk}), (), 1.0)
    monkeypatch.setattr(vetting, "model", lambda channels, names: Model(names, (), 9.0))
    monkeypatch.setattr(vetting, "_noisy", lambda channels, said: (0,) if said is lag else ())
    result = vetting._beside_noise((), [best, lag, delay] if walk else [lag, delay])
    assert (result is not None) is noisy
    assert result is None or {"delay"} in [made.names for made in result.models]


@pytest.mark.parametrize(("left", "noisy"), [(0.4, False), (0.6, True)])
def test_what_an_effect_says_most_of_is_no_noise(monkeypatch, left: float, noisy: bool) -> None:
    """A material that soon forgets may look like noise of some colour."""
    creep, walk = (
        Model(frozenset({name}), (), price)
        for name, price in (("relaxation", 2.0), ("random_walk", 1.0))
    )
    monkeypatch.setattr(vetting, "model", lambda channels, names: Model(names, (), 9.0))
    monkeypatch.setattr(vetting, "left_share", lambda channels, made: left)
    monkeypatch.setattr(vetting, "_noisy", lambda channels, said: () if said.names else (0,))
    assert (vetting._beside_noise((), [walk, creep]) is not None) is noisy


@pytest.mark.parametrize(("off", "jumps"), [(0, False), (10, False), (100, True)])
def test_what_a_rail_leaves_beside_it_is_no_jump_of_a_walk(off: int, jumps: bool) -> None:
    rng = np.random.default_rng(5)
    walk = np.cumsum(rng.normal(0.0, 0.3, SAMPLES)) + rng.normal(0.0, 1.0, SAMPLES)
    held = np.arange(SAMPLES) % 500 > 460
    walk[np.arange(SAMPLES) % 1500 == 461 - off] += 40.0
    channel = SimpleNamespace(
        residual=walk - 50.0 * held,
        predicted=lambda fit: -50.0 * held,
        columns=lambda pick: -held[:, None].astype(float),
        weighted=lambda fit: [(("saturation", 0), np.array([50.0]))],
        nominal=SimpleNamespace(rate=np.ones(SAMPLES)),
        sigma=1.0,
        gain_of=lambda walk: 0.25,
    )
    made = Model(frozenset({"random_walk", "saturation"}), (None,), 1.0)
    assert bool(vetting._jerky_on([channel], made, 0)) is jumps


def fit_with(names: str, left: float) -> Fit:
    picks = tuple((name, 0) for name in names.split("+"))
    return Fit(picks, np.full(1, left), np.zeros(0), None)


@pytest.mark.parametrize(("left", "walks"), [(0.8, False), (1.0, True)])
def test_a_walk_beside_an_effect_says_what_no_others_do(left: float, walks: bool) -> None:
    """It follows whatever is slow, and so the little that is left of a large gap."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=60.0)]
    beside = Model(frozenset({"gain", "random_walk"}), (fit_with("gain+random_walk", 0.1),), 1.0)
    creep = Model(frozenset({"drift"}), (fit_with("drift", left),), 2.0)
    assert (_walk_last(channels, [beside, creep])[0] is beside) is walks


@pytest.mark.parametrize(("left", "walks"), [(0.7, False), (0.9, True)])
def test_a_walk_alone_leaves_less_than_effects_do(left: float, walks: bool) -> None:
    """Or they say the gap, though they may cost more."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=60.0)]
    walk = Model(frozenset({"random_walk"}), (fit_with("random_walk", 0.8),), 1.0)
    late = Model(frozenset({"delay", "gain"}), (fit_with("delay+gain", left),), 2.0)
    first = by_price(_walk_last(channels, [walk, late]))[0]
    assert (first.names == walk.names) is walks


@pytest.mark.parametrize(
    ("names", "left", "alone", "excess", "beside", "remains"),
    [
        ("gain", 0.05, 0.05, 100.0, False, False),
        ("gain", 0.07, 0.07, 1.0, False, True),
        ("gain", 0.07, 0.07, 100.0, True, False),
        ("gain", 0.16, 0.16, 100.0, True, True),
        ("gain+step", 0.015, 0.05, 1.0, False, False),
        ("gain+step", 0.015, 0.05, 100.0, False, True),
        ("gain+step", 0.015, 0.2, 100.0, False, False),
        ("gain+step", 0.04, 0.2, 100.0, False, True),
    ],
)
def test_what_is_clearly_left_is_said_to_be_unknown(
    names: str, left: float, alone: float, excess: float, beside: bool, remains: bool
) -> None:
    """Of a gap that is hardly more than the noise, more is left by chance; and two effects that
    each say much of it need not be as close as two that may be a third one in pieces."""
    channels = [SimpleNamespace(excess=excess * 1000.0, samples=1000, entries={"gain": []})] * 2
    made = Model(frozenset(names.split("+")), (), 0.0)
    assert telling._remains(channels, made, left, alone, beside) is remains


def test_a_walk_is_no_jerk_where_a_rail_hides_it() -> None:
    rng = np.random.default_rng(2)
    walk = np.cumsum(rng.normal(size=8000)) + rng.normal(size=8000)
    held = np.arange(8000) // 700 % 2 == 1
    hidden = np.where(held, 0.0, 3.0 * walk)
    assert jerky(hidden, 0.6, np.ones(8000, dtype=bool))
    assert not jerky(hidden, 0.6, ~np.convolve(held, np.ones(41), "same").astype(bool), False)


def test_where_all_strokes_are_alike_so_are_effects_that_lag_behind() -> None:
    """A delay on a random motion and on a triangle: the second says what else it could be."""
    x, codes = clean(5)
    rich = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, "delay"), 2))
    assert not motion_of(x, 0.05, 0.0, None).strokes_alike()
    triangle = np.abs((np.arange(SAMPLES) / 400.0) % 2.0 - 1.0)
    columns = np.stack([1500.0 + gain * triangle for gain in (500.0, -700.0, 640.0)], axis=1)
    assert motion_of(triangle, 0.05, 0.0, None).strokes_alike()
    late = hide(triangle, columns, "delay")
    poor = diagnose(recorded(triangle, columns, 1), recorded(triangle, late, 2))
    (one,), (other,) = rich.data["effects"], poor.data["effects"]
    said = {other["name"], *(rival["name"] for rival in other["alternatives"])}
    assert said == {"backlash", "delay", "hysteresis", "lag", "relaxation"}
    assert other["confidence"] < 0.5 < one["confidence"]
    assert "a chirp" in poor.data["advice"][0]


def test_strokes_that_return_at_another_rate_are_alike_too() -> None:
    phase = np.arange(SAMPLES) / 400.0 % 1.0
    uneven = np.interp(phase, [0.0, 0.3, 1.0], [0.0, 1.0, 0.0])
    assert motion_of(uneven, 0.05, 0.0, None).strokes_alike()
    faster = np.where(np.arange(SAMPLES) > SAMPLES // 2, np.roll(uneven, 1)[::-1], uneven)
    assert not motion_of(faster, 0.05, 0.0, None).strokes_alike()


def test_curves_are_not_told_apart_where_all_strokes_are_alike() -> None:
    triangle = np.abs((np.arange(SAMPLES) / 400.0) % 2.0 - 1.0)
    columns = np.stack([1500.0 + gain * triangle for gain in (500.0, -700.0, 640.0)], axis=1)
    bent = columns.copy()
    bent[:, 0] += 40.0 * triangle**2
    (effect,) = diagnose(recorded(triangle, columns, 1), recorded(triangle, bent, 2)).data[
        "effects"
    ]
    said = {effect["name"], *(rival["name"] for rival in effect["alternatives"])}
    assert said >= {"adc_nonlinearity", "crosstalk", "gain", "saturation"}


def test_the_same_is_said_every_time(tmp_path: Path) -> None:
    """In whatever order Python goes through its sets, which differs from process to process."""
    x, codes = clean(5, 3000)
    index = np.arange(len(x))
    late = np.stack([np.interp(0.9995 * index - 1.6, index, c) for c in codes.T], axis=1)
    ss.write(recorded(x, codes, 1), tmp_path / "sim.csv")
    ss.write(recorded(x, late, 2), tmp_path / "real.csv")
    said = []
    for order in ("1", "2", "3"):
        asked = [sys.executable, "-m", "softsense", "diagnose", "sim.csv", "real.csv", "-o", order]
        environment = {**os.environ, "PYTHONHASHSEED": order}
        subprocess.run(asked, cwd=tmp_path, env=environment, check=True, capture_output=True)
        said.append((tmp_path / order / "diagnosis.json").read_bytes())
    assert said[0] == said[1] == said[2]


def test_two_effects_are_both_named() -> None:
    x, codes = clean(7)
    both = hide(x, hide(x, codes, "drift"), "delay")
    result = diagnose(recorded(x, codes, 1), recorded(x, both, 2))
    assert set(result.effects) == {"drift", "delay"}


def test_what_acts_upon_an_effect_may_say_little_side_by_side(monkeypatch) -> None:
    """A converter's curve upon a material that relaxes: a training case of the benchmark."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("cases").make(
        82034, ("adc_nonlinearity", "relaxation"), "rich", False
    )
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_where_fewer_effects_say_all_no_more_are_missed(monkeypatch) -> None:
    """One effect alone on one channel, beside another on the next: what is not looked at would not
    have paid."""
    x, codes = clean(4)
    made = hide(x, hide(x, codes, "drift"), "overshoot")
    sim, real = recorded(x, codes, 1), recorded(x, made, 2)
    quick = diagnose(sim, real)
    monkeypatch.setattr(Channel, "_said_by_fewer", lambda channel, count: False)
    whole = diagnose(sim, real)
    assert set(quick.effects) == {"drift", "overshoot"}
    assert quick.state_json() == whole.state_json()
    assert quick.data["after"] == whole.data["after"]


def test_short_work_stays_on_its_core() -> None:
    def where(item: int) -> int:
        return threading.get_ident()

    with one_core():
        assert set(all_at_once(where, range(8))) == {threading.get_ident()}
    assert threading.get_ident() not in all_at_once(where, range(8))


def test_an_effect_more_must_leave_less() -> None:
    """Each channel may find a cheaper one than the others have."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=50.0, samples=1.0)] * 2
    alone = fit_with("crosstalk", 0.1), fit_with("crosstalk", 0.2)
    one = Model(frozenset({"crosstalk"}), alone, 8.3)
    other = fit_with("adc_nonlinearity", 0.3)
    two = Model(frozenset({"crosstalk", "adc_nonlinearity"}), (alone[0], other), 8.0)
    assert by_price(_fewest_first(channels, [two, one]))[0].names == one.names
    better = replace(two, fits=(alone[0], fit_with("adc_nonlinearity", 0.1)))
    assert by_price(_fewest_first(channels, [better, one]))[0].names == two.names
    cheaper = replace(two, price=7.7)
    assert by_price(_fewest_first(channels, [cheaper, one]))[0].names == two.names


@pytest.mark.parametrize(("left", "name"), [(0.7, "drift"), (0.5, "relaxation")])
def test_a_ladder_of_relaxations_must_leave_clearly_less(left: float, name: str) -> None:
    """Its many weights say nearly all that is slow."""
    channel = SimpleNamespace(
        **dict.fromkeys(("samples", "excess", "guard"), 1.0),
        **dict.fromkeys(("price", "left"), lambda fit: fit.errors[0]),
        exact=lambda fit: False,
        idle=lambda fit, lasting: (),
    )
    fits = fit_with("drift", 1.0), fit_with("relaxation", left)
    assert by_price([priced([channel], (fit,)) for fit in fits])[0].names == {name}


def test_a_gain_that_ages_is_a_model_of_a_material() -> None:
    """A wrong scale is exact."""
    x, codes = clean(2, 1500)
    channel = first_channel(x, codes, 0.05 * codes[:, 0], ["gain"])
    exact: dict[str, set[bool]] = {}
    for number, entry in enumerate(channel.entries["gain"]):
        fit = Fit((("gain", number),), np.zeros(1), np.zeros(0), None)
        exact.setdefault(entry.candidate.form, set()).add(channel.exact(fit))
    always = {"constant", "divided", "transferred"}
    assert exact == {form: {form in always} for form in exact}
    assert {"constant", "logarithmic", "ageing", "cycles"} <= exact.keys()


@pytest.mark.parametrize(
    ("left", "price", "names"), [(0.3, 10.2, 1), (0.1, 10.2, 2), (0.3, 10.4, 2)]
)
def test_a_scale_that_is_seen_only_beside_another_effect_must_say_enough(
    left: float, price: float, names: int
) -> None:
    """It is what an equation leaves that is only nearly right; where all is said it is there, and
    where fewer need a curve besides."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=50.0, samples=1.0)] * 2
    creep = fit_with("relaxation", 0.4)
    one = Model(frozenset({"relaxation"}), (creep, creep), price)
    both = creep, fit_with("gain+relaxation", left)
    two = Model(frozenset({"gain", "relaxation"}), both, 10.0)
    assert len(by_price(_fewest_first(channels, [two, one]))[0].names) == names
    bent = replace(one, fits=(creep, replace(creep, static=np.ones(8))))
    assert len(by_price(_fewest_first(channels, [two, bent]))[0].names) == 2


def test_a_large_step_is_known_to_the_sample() -> None:
    x, codes = clean(55)
    at_s = 171.43
    made = codes + 40.0 * (np.arange(len(x)) / RATE_HZ >= at_s)[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("step",)
    # The samples before and after it are .05 s apart.
    assert 171.40 < result.data["where"]["onset_s"] <= 171.45


def test_fast_moves_of_a_simulation_are_kept_where_the_real_recording_has_them() -> None:
    rng = np.random.default_rng(4)
    x, codes = clean(56)
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    # What no history of the strain tells, within a few samples.
    fast = np.convolve(rng.normal(0.0, 12.0, len(x)), np.hanning(6)[1:-1], "same")
    moved = codes + fast[:, None] * [1, 1, 0, 0]
    there = codes + fast[:, None] * [1, 0, 0, 0]
    sim, real = (recorded(x, own, k).codes.astype(float) for k, own in enumerate((moved, there)))
    smooth, kept = denoise(sim, motion, real)
    error = np.std(smooth - there, axis=0)
    assert error[0] < 0.35 * np.std(denoise(sim, motion)[0][:, 0] - there[:, 0])
    assert kept[0] > kept[1] == kept[2] == kept[3]


@pytest.mark.parametrize("keep", [slice(None), slice(None, None, 3)])
def test_a_channel_responds_as_the_history_of_the_motion_has_it(keep: slice) -> None:
    x, codes = clean(50, 2000)
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    played = np.maximum(motion.strain - 0.1, 0.0)
    said = history_basis(played, motion.dt_s) @ history_weights(codes, motion)
    for channel, one in enumerate(
        nominals(
            codes,
            codes,
            motion,
            12,
            reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3))),
        )
    ):
        np.testing.assert_allclose(one.respond(played, keep), said[keep, channel], atol=1e-6)


def test_the_diagnosed_effect_carries_over_to_another_motion() -> None:
    x, codes = clean(5)
    result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, codes, "delay"), 2))
    x2, codes2 = clean(31, 3000)
    sim2, real2 = recorded(x2, codes2, 3), recorded(x2, hide(x2, codes2, "delay"), 4)
    made = augment(result, sim2)
    before = np.sqrt(np.mean((real2.codes - sim2.codes) ** 2.0))
    after = np.sqrt(np.mean((real2.codes - made.codes) ** 2.0))
    assert after < 0.3 * before


def test_an_effect_withheld_from_the_catalogue_is_not_named() -> None:
    x, codes = clean(5)
    pair = recorded(x, codes, 1), recorded(x, hide(x, codes, "delay"), 2)
    assert "delay" not in diagnose(*pair, without=("delay",)).effects


def test_a_noise_without_its_name_is_unknown() -> None:
    x, codes = clean(3)
    loud = codes + 8.0 * np.random.default_rng(4).normal(size=codes.shape)
    result = diagnose(recorded(x, codes, 1), recorded(x, loud, 2), without=("noise",))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]


def test_the_labelled_examples(shared: Path) -> None:
    truth = json.loads((shared / "gapcases" / "truth.json").read_text())
    for name, case in truth.items():
        folder = shared / "gapcases" / name
        sim, real = (ss.read(folder / f"{kind}1.csv") for kind in ("sim", "real"))
        result = diagnose(sim, real)
        assert list(result.effects) == case["effects"]
        for effect in result.data["effects"]:
            assert effect["channels"] == case["channels"][effect["name"]]
        if case["effects"]:
            sim2, real2 = (ss.read(folder / f"{kind}2.csv") for kind in ("sim", "real"))
            made = augment(result, sim2)
            before = np.mean((real2.codes - sim2.codes) ** 2.0)
            assert np.mean((real2.codes - made.codes) ** 2.0) < 0.2 * before


def test_commands_and_files(tmp_path: Path, capsys) -> None:
    x, codes = clean(5)
    ss.write(recorded(x, codes, 1), tmp_path / "sim.csv")
    ss.write(recorded(x, hide(x, codes, "drift"), 2), tmp_path / "real.csv")
    out = tmp_path / "gap"
    pair = [str(tmp_path / "sim.csv"), str(tmp_path / "real.csv")]
    assert main(["diagnose", *pair, "-o", str(out), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data == json.loads((out / "diagnosis.json").read_text())
    assert data["schema"] == "softsense.diagnosis/1"
    assert set(data) == {
        "schema", "gap", "where", "effects", "unexplained", "confusable", "after", "advice",
    }  # fmt: skip
    assert {effect["name"] for effect in data["effects"]} <= set(all_effects())
    assert len((out / "report.html").read_text()) > 5000
    assert len(ss.read(out / "augmented.csv")) == SAMPLES
    assert main(["augment", str(out), pair[0], "-o", str(tmp_path / "aug.csv")]) == 0
    assert "drift" in capsys.readouterr().out
    assert main(["diagnose", *pair, "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert "drift is missing on s1, s2" in said
    state = (out / "augmentation.json").read_text()
    (out / "augmentation.json").write_text(state.replace("augmentation/9", "augmentation/1"))
    assert main(["augment", str(out), pair[0], "-o", str(tmp_path / "aug.csv")]) == 1
    assert "augmentation.json is softsense.augmentation/1, not" in capsys.readouterr().err
    (out / "augmentation.json").write_text("{")
    assert main(["augment", str(out), pair[0], "-o", str(tmp_path / "aug.csv")]) == 1
    assert "not a whole diagnosis" in capsys.readouterr().err


def in_kohm(path: Path, x: np.ndarray, codes: np.ndarray, rows: slice) -> Path:
    """``rows`` of a recording in physical units, 0.002 kohm to a code."""
    kohm = [[f"{0.3 + 0.002 * code:.5f}" for code in row] for row in codes[rows].tolist()]
    lines = [
        f"{0.05 * k:.2f},{strain:.6f},{','.join(row)}"
        for k, (strain, row) in enumerate(zip(x[rows], kohm, strict=True))
    ]
    head = ",".join(["t_s,strain", *(f"s{k + 1}" for k in range(codes.shape[1]))])
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


def test_files_in_physical_units_are_read_on_one_scale(tmp_path: Path, capsys) -> None:
    x, codes = clean(4)
    noise = np.random.default_rng(4).normal(0.0, 1.3, (2, *codes.shape))
    pole = np.exp(-1 / (0.3 * RATE_HZ))
    real = codes.copy()
    real[:, 1] = lfilter([1 - pole], [1, -pole], codes[:, 1] - codes[0, 1]) + codes[0, 1]
    first, second = slice(0, 3000), slice(3000, 6000)
    sim = in_kohm(tmp_path / "sim.csv", x, codes + noise[0], first)
    seen = in_kohm(tmp_path / "real.csv", x, real + noise[1], first)
    out, made = tmp_path / "out", tmp_path / "made.csv"
    assert main(["diagnose", str(sim), str(seen), "-o", str(out)]) == 0
    found = json.loads((out / "diagnosis.json").read_text())["effects"]
    assert [(effect["name"], effect["channels"]) for effect in found] == [("lag", ["s2"])]
    # A next motion is scaled as the first, not by its own range.
    later = in_kohm(tmp_path / "later.csv", x, codes + noise[0], second)
    assert main(["augment", str(out), str(later), "-o", str(made)]) == 0
    ends = folder.read(out).front_ends
    told = ss.read(made).codes - ss.read(later, front_end=ends).codes
    true = 0.002 * ends["s2"].scale * (real - codes)[second, 1]
    assert np.std(told[:, 1] - true) < 0.1 * np.std(true)
    assert not told[:, 0].any()
    # What leaves the scale, or has none, is refused.
    wide = in_kohm(tmp_path / "wide.csv", x, 2 * codes, second)
    whole = ss.write(recorded(x, codes, 1), tmp_path / "whole.csv")
    capsys.readouterr()
    for command, words in (
        (["augment", str(out), str(wide), "-o", str(made)], "leaves the scale"),
        (["diagnose", str(whole), str(seen), "-o", str(tmp_path / "no")], "codes here and phys"),
    ):
        assert main(command) == 1
        assert words in capsys.readouterr().err
    assert not (tmp_path / "no").exists()
    with pytest.raises(SoftsenseError, match="two scales"):
        diagnose(ss.read(sim), ss.read(seen))


def test_recordings_that_do_not_belong_together_are_refused() -> None:
    x, codes = clean(1)
    sim, real = recorded(x, codes, 1), recorded(x, codes, 2)
    dead = real.codes.copy()
    dead[:, 2] = 7
    clipped = real.codes.copy()
    clipped[:3000, 1] = 4095
    assert sim.t_s is not None
    for wrong, words in (
        (replace(real, codes=dead), "'s3' is dead"),
        (replace(real, codes=clipped), "'s2' is clipped"),
        (replace(real, sensors=("a", "b", "c", "d")), "no sensor is in both"),
        (replace(real, t_s=sim.t_s * 2), "rates differ"),
        (replace(real, target=real.target[::-1]), "motions differ"),
        (real.rows(slice(0, 200)), "too few"),
    ):
        with pytest.raises(SoftsenseError, match=words):
            diagnose(sim, wrong)


def test_effects_of_the_motion_are_composed_where_a_channel_has_no_gap() -> None:
    x, codes = clean(2, 1500)
    names = frozenset({"backlash", "delay"})
    channel = first_channel(x, codes, np.zeros(len(x)), sorted(names))
    assert not channel.composed(channel.within(names), names).picks


def test_what_relaxes_for_hours_is_no_drift() -> None:
    """By a power law of time, in a recording that is far longer than most."""
    x, codes = clean(0, 6000)
    t_s = np.arange(len(x), dtype=np.float64)
    share = 1.0 - (1.0 + t_s / 2.0) ** -0.3
    moved = codes - codes[0]
    gone = fftconvolve(moved, np.diff(share, prepend=0.0)[:, None], axes=0)[: len(x)]
    sim, real = recorded(x, codes, 1), recorded(x, codes + 0.3 * (gone - moved), 2)
    result = diagnose(replace(sim, t_s=t_s), replace(real, t_s=t_s))
    assert result.effects == ("relaxation",)


def test_what_is_offered_before_is_offered_again() -> None:
    x, codes = clean(2, 1500)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    gap = 20.0 * x + np.random.default_rng(1).normal(0.0, 1.3, len(x))
    given = nominal, gap, 1.3, x[:, None] ** [1, 2]
    rest = 1.7, 0.0, 0.1, motion.history
    offered: dict = {}
    Channel(*given, ["lag"], *rest, offered)
    lag = offered["lag"]
    both = Channel(*given, ["gain", "lag"], *rest, offered)
    fresh = Channel(*given, ["gain", "lag"], *rest)
    assert offered.keys() == {"lag"}
    assert offered["lag"] is lag
    assert np.shares_memory(both.entries["lag"][0].columns, lag[0].columns)
    for name in ("gain", "lag"):
        for one, other in zip(both.entries[name], fresh.entries[name], strict=True):
            assert one.at == other.at
            np.testing.assert_array_equal(one.columns, other.columns)


def test_of_a_long_recording_what_leaves_far_more_is_not_looked_at_closely(monkeypatch) -> None:
    module = importlib.import_module("softsense.diagnose.channel")
    monkeypatch.setattr(module, "SEARCHED", 500)
    x, codes = clean(2)
    gap = np.where(np.arange(len(x)) > 3000, 40.0, 0.0)

    def looked_at(beside: tuple[str, ...]) -> int:
        made = first_channel(x, codes, gap, ["step", "drift"])
        assert made.long
        made.zoom((), beside, {}, {}, ())
        assert len(made.entries["step"]) > 1
        return len(made.entries["drift"])

    # Alone a drift says much of a step, and would be worth a look.
    assert looked_at(()) == 1
    assert looked_at(("drift",)) > 1


def test_every_effect_that_explains_says_finite_columns() -> None:
    from softsense.diagnose.nominal import motion_of, nominals, reference_of

    x, codes = clean(2, 1500)
    sim = recorded(x, codes, 1)
    motion = motion_of(sim.target[:, 0], sim.dt_s, 0.0, None)
    nominal = nominals(
        codes, codes, motion, 12, reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    )[0]
    for name, effect in all_effects().items():
        for candidate in effect.explain(nominal) if effect.explain else ():
            assert candidate.columns.shape[0] == len(x), name
            assert np.isfinite(candidate.columns).all(), name
            assert not candidate.fixed or candidate.columns.shape[1] == 1, name


def test_what_remembers_runs_at_the_full_rate_where_samples_are_thinned() -> None:
    x, _ = clean(11, 3000)
    x = x * np.linspace(0.4, 1.0, len(x))
    codes, motion = sensed(x), motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    whole = nominals(codes, codes, motion, 12, reference)[0]
    thinned = replace(whole, keep=slice(None, None, 3))
    for name, effect in all_effects().items():
        if effect.explain is None or effect.memoryless:
            continue
        for one, other in zip(effect.explain(whole), effect.explain(thinned), strict=True):
            some = other.columns if len(other.columns) == 1000 else other.columns[::3]
            size = np.abs(one.columns).max() + 1e-9
            assert np.abs(one.columns[::3] - some).max() < 1e-6 * size, (name, one.form, one.values)


def test_candidates_are_the_same_ones_whatever_moves_the_strain() -> None:
    """They are known by their number."""
    x, codes = clean(2, 1500)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    strain = motion.strain
    still = nominal.acting_on(codes[:, 0], lambda: np.where(strain > 0.0, 0.9 + 0.1 * strain, 0.9))
    for name, effect in all_effects().items():
        made = effect.explain(nominal) if effect.explain else []
        assert len(effect.explain(still) if effect.explain else []) == len(made), name
        for candidate in made if effect.zoom else ():
            near = effect.zoom(nominal, candidate.values)
            assert len(effect.zoom(still, candidate.values)) == len(near), name


@pytest.mark.parametrize(
    ("effect", "place", "true"),
    [
        ("lag", "electrical", {"tau_s": 0.06}),
        ("relaxation", "response", {"amplitude": 0.1, "tau_s": 8.0}),
        ("drift", "response", {"amplitude": 0.08, "tau_s": 60.0}),
    ],
)
def test_the_effect_goes_back_into_the_rig(
    effect: str, place: str, true: dict[str, float], tmp_path: Path, capsys
) -> None:
    from softsense.simulate import read_rig, run
    from softsense.simulate.rig import Placed

    rig = ss.linear_rig(3)
    # What is random in a simulator is not the same twice.
    rig = replace(rig, effects=tuple(e for e in rig.effects if e.name != "random_walk"))
    hidden = Placed(effect, place, dict(true), channels=("s1", "s3"))
    (tmp_path / "rig.toml").write_text(rig.to_toml())
    lab = replace(rig, effects=(*rig.effects, hidden))
    ss.write(ss.simulate(lab, samples=4000, seed=5), tmp_path / "real.csv")
    command = ["diagnose", str(tmp_path / "rig.toml"), str(tmp_path / "real.csv"), "-q"]
    assert main([*command, "-o", str(tmp_path / "gap")]) == 0
    assert f"rig.toml has {effect} on s1, s3" in capsys.readouterr().out
    made = read_rig(tmp_path / "gap" / "rig.toml")
    added = next(one for one in made.effects[len(rig.effects) :] if one.name == effect)
    assert (added.name, added.at, added.channels) == (effect, place, ("s1", "s3"))
    strain = random_motion(3000, 1.0 / rig.rate_hz, 9)
    truth, before, after = (run(one, strain).codes.astype(float) for one in (lab, rig, made))
    assert np.std(truth - after) < 0.35 * np.std(truth - before)
