"""Effects of the material, in equations that the catalogue does not have."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import fftconvolve, lfilter

from softsense.diagnose import augment, diagnose
from softsense.diagnose.design import Fit
from softsense.diagnose.engine import change_of
from softsense.diagnose.nominal import motion_of, nominals, reference_of
from softsense.diagnose.search import Model, _fewest_first, by_price, priced
from softsense.effects import all_effects

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import (
    RATE_HZ,
    SAMPLES,
    clean,
    filtered,
    first_channel,
    fit_with,
    hide,
    recorded,
    sensed,
)


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


def test_what_has_settled_at_once_is_no_drift() -> None:
    """It is another zero from the start, as a gain about the middle of a converter makes it."""
    x, codes = clean(50)
    channel = first_channel(x, codes, np.zeros(len(x)), ["drift"])
    for course in ({}, {"tau_s": 1.0}, {"tau_s": 4.0}):
        candidates = all_effects()["drift"].zoom(channel.nominal, course)
        settling = [c.values["tau_s"] for c in candidates if c.form == "exponential"]
        assert min(settling, default=3.0) >= 3.0


def test_a_sensitivity_that_comes_back_in_part_is_a_step() -> None:
    x, codes = clean(49)
    since = (np.arange(len(x)) - 3000) / RATE_HZ
    lost = (since >= 0.0) * (0.5 + 0.5 * np.exp(-np.maximum(since, 0.0) / 25.0))
    more = -0.05 * lost[:, None] * (codes - codes[0] + 0.2 * np.ptp(codes, axis=0))
    more[:, 2] = 0.0
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + more, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("step", ["s1", "s2", "s4"])
    ]
    assert {trace.form for trace in result.traces} == {"regaining"}
    assert result.data["unexplained"]["share"] < 5e-3


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


@pytest.mark.parametrize("half", [0.06, 0.2])
def test_overshoot_may_begin_slowly_and_level_off(half: float) -> None:
    x, codes = clean(1)
    speed = np.abs(np.gradient(x)) * RATE_HZ
    broken = lfilter([0.1], [1, -0.9], speed**2 / (speed**2 + half**2))
    made = codes + 40.0 * broken[:, None] * np.array([1.0, 0.5, -1.0, 0.8])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("overshoot",)
    assert result.data["unexplained"]["share"] < 0.006


@pytest.mark.parametrize(("tau_s", "order"), [(150.0, 2.0), (110.0, 1.7)])
def test_a_drift_that_cures_is_known_closely(tau_s: float, order: float) -> None:
    """What is left would look like something else."""
    x, codes = clean(2)
    cured = -40.0 * np.expm1(-((np.arange(SAMPLES) / RATE_HZ / tau_s) ** order))
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + cured[:, None], 2))
    assert result.effects == ("drift",)
    assert result.data["unexplained"]["share"] < 0.0004


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


def test_overshoot_may_come_sooner_than_it_goes() -> None:
    x, codes = clean(15)
    rate = np.gradient(x) * RATE_HZ
    breaking, broken = np.abs(rate) ** 1.2 * np.where(rate > 0.0, 1.0, 0.5), np.zeros(len(x))
    for k in range(1, len(x)):
        gone = breaking[k] - broken[k - 1]
        broken[k] = broken[k - 1] + gone * (0.3 if gone > 0.0 else 0.06)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + 60.0 * broken[:, None], 2))
    assert result.effects == ("overshoot",)


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


def test_a_gain_of_what_the_strain_alone_says_is_a_gain() -> None:
    """A good part of these sensors lags behind, and is as large as before."""
    x, _ = clean(19)
    elastic = 1500.0 + 700.0 * (x[:, None] + np.array([0.2, -0.2, 0.1, 0.3]) * x[:, None] ** 2)
    codes = elastic + 0.4 * (elastic - filtered(elastic, 1.5))
    made = codes + 0.08 * (elastic - elastic[0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("gain",)
    assert np.std(change_of(result, 12) - (made - codes)) < 1.0


@pytest.mark.parametrize("form", ["peaks", "reversals"])
def test_what_the_fastest_moment_or_a_reversal_breaks_is_overshoot(form: str) -> None:
    x, codes = clean(47)
    broken = np.zeros(len(x))
    turned = way = 0.0
    for k in range(1, len(x)):
        move = x[k] - x[k - 1]
        turned = abs(move) if move * way < 0.0 else turned + abs(move)
        way = move or way
        speed = abs(move) * RATE_HZ
        if form == "peaks":
            broken[k] = max(speed, broken[k - 1] * np.exp(-1.0 / RATE_HZ / 0.7))
        else:
            more = speed * (0.3 + np.exp(-turned / 0.08))
            broken[k] = broken[k - 1] + (more - broken[k - 1]) / RATE_HZ / 0.7
    made = codes + np.outer(broken, [160.0, -120.0, 0.0, 140.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("overshoot", ["s1", "s2", "s4"])
    ]
    assert form in {trace.form for trace in result.traces}
    assert result.data["unexplained"]["share"] < 5e-3


def test_what_shears_more_than_in_proportion_is_overshoot() -> None:
    """Either way counts, as of light that a core loses to its cladding."""
    x, codes = clean(47)
    behind = filtered(x[:, None], 2.2)[:, 0]
    made = codes + np.outer(np.abs(x - behind) ** 1.4, [300.0, -250.0, 0.0, 400.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("overshoot", ["s1", "s2", "s4"])
    ]
    assert {trace.form for trace in result.traces} == {"sheared"}
    assert result.data["unexplained"]["share"] < 5e-3


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


def test_a_magnet_that_ages_by_decades_is_a_gain() -> None:
    """It is far away at rest, so that no field is beyond all that is read."""
    x, codes = clean(46)
    no_field = codes[0] + 0.9 * np.ptp(codes, axis=0)
    more = -0.02 * np.log1p(np.arange(len(x)) / (5.0 * RATE_HZ))[:, None] * (codes - no_field)
    more[:, 1] = 0.0
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + more, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("gain", ["s1", "s3", "s4"])
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


def test_softening_that_goes_on_for_cycles_or_leaves_a_set_or_cracks_is_no_other() -> None:
    """Below the largest strain so far, over some cycles; with what stays stretched, beside a
    simulator that was calibrated with it; and cracks that a larger strain opens further."""
    x, codes = clean(36)
    top = np.maximum.accumulate(x)
    way = np.cumsum(np.abs(np.diff(x, prepend=x[0])))
    stretched = 0.3 * (top - x) * top + x * np.expm1(-(top - x) / 0.2)
    cracked = np.maximum(top - 0.25, 0.0) ** 1.6 * (0.2 + x / np.maximum(top, 1e-3))
    for lost in (
        x * (top - x) ** 0.7 * -np.expm1(-way / 12.0),
        3.0 * (np.polynomial.Polynomial.fit(x, stretched, 3)(x) - stretched),
        cracked,
    ):
        made = codes - np.outer(lost, [120.0, -90.0, 0.0, 150.0])
        result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
        assert result.effects == ("softening",)
        assert result.data["unexplained"]["share"] < 1e-2


def test_damage_that_only_a_larger_strain_makes_is_softening() -> None:
    """Nothing is as stiff again close to the largest strain so far; of any curve of the strain."""
    x, codes = clean(11)
    x = x * np.linspace(0.4, 1.0, SAMPLES)
    codes = sensed(x)
    share = (codes - codes[0]) / np.ptp(codes, axis=0)
    damage = -np.expm1(-np.maximum.accumulate(x) / 0.8)
    bent = (x - 0.6 * x**2)[:, None] * [1.0, -1.0, 1.0, -1.0]
    for carried in (share, bent):
        hurt = codes - 60.0 * damage[:, None] * carried
        result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
        assert result.effects == ("softening",)
        assert result.data["unexplained"]["share"] < 1e-2


def test_what_the_fastest_moment_breaks_goes_with_some_power_of_its_speed() -> None:
    """And forms again until a faster one; a filtered rate says it badly."""
    x, codes = clean(12)
    speed, held = np.abs(np.gradient(x)) * RATE_HZ, np.zeros_like(x)
    for k in range(1, len(x)):
        held[k] = max(speed[k] ** 0.65, 0.95 * held[k - 1])
    made = codes.copy()
    made[:, 1:3] += (80.0 * held * (1.0 + 0.5 * x))[:, None] * [1.0, -0.7]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("overshoot", ["s2", "s3"])
    ]
    assert result.data["unexplained"]["share"] < 5e-3


@pytest.mark.parametrize("size", [60.0, 200.0])
def test_damage_takes_a_share_of_what_is_read_from_rest(size: float) -> None:
    """Also of sensors whose codes fall where they are stretched."""
    x, _ = clean(11)
    x = x * np.linspace(0.4, 1.0, SAMPLES)
    codes = sensed(x)
    assert np.sign(codes[-1] - codes[0]).tolist() == [-1.0, 1.0, -1.0, 1.0]
    damage = -np.expm1(-np.maximum.accumulate(x) / 0.8)[:, None]
    hurt = codes - size * damage * (codes - codes[0]) / np.ptp(codes, axis=0)
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("softening",)
    assert result.data["unexplained"]["share"] < 1e-3


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


def test_a_curve_is_as_steep_as_where_a_change_goes() -> None:
    """A large one, before a curve that is seven times as steep at its upper end."""
    x, _ = clean(15)

    def read(felt: np.ndarray) -> np.ndarray:
        return 1200.0 + 1500.0 * np.expm1(2.0 * felt) / np.expm1(2.0)

    more = 0.12 * np.sin(np.arange(SAMPLES) / 200.0) * (1.0 - x)
    codes, made = read(np.stack([x, x], axis=1)), read((x + more)[:, None])
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((2, 3)))
    heard = np.concatenate([made, codes[:, 1:]], axis=1)
    left = []
    for read_instead in (codes, heard):
        nominal = nominals(codes, read_instead, motion, 12, reference)[0]
        there, slope = nominal.at("before_curve")
        left.append(np.std(slope * there.span * more - (made - codes[:, :1])[:, 0]))
    assert left[1] < 0.25 * left[0]


def test_air_that_seeps_out_before_a_bent_curve_is_relaxation() -> None:
    """As the root of its pressure: soon at first, and never quite."""
    x, _ = clean(15)
    bends = np.array([1.8, -1.5, 2.2, -2.0])

    def read(felt: np.ndarray) -> np.ndarray:
        return 1200.0 + 900.0 * np.expm1(bends * felt) / np.expm1(bends)

    ahead = np.zeros(len(x))
    for k in range(1, len(x)):
        pressure = ahead[k - 1] + x[k] - x[k - 1]
        root = max(np.sqrt(abs(pressure)) - 1.0 / RATE_HZ / 8.0, 0.0)
        ahead[k] = np.sign(pressure) * root**2
    codes, made = read(x[:, None]), read((x + 0.15 * ahead)[:, None])
    made[:, 3] = codes[:, 3]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("relaxation",)
    assert ("seeping", "before_curve") in {(t.form, t.place) for t in result.traces}
    assert result.data["unexplained"]["share"] < 0.01


def test_a_load_that_grows_more_than_in_proportion_relaxes() -> None:
    """Schapery: and the faster, the more it is strained."""
    x, codes = clean(36)
    share = (codes - codes.min(axis=0)) / np.ptp(codes, axis=0)
    load, slow = share * (1.0 + 1.2 * share), np.zeros_like(share)
    slow[0] = load[0]
    for k in range(1, len(x)):
        kept = np.exp(-np.exp(1.5 * share[k]) / RATE_HZ / 15.0)
        slow[k] = load[k] + (slow[k - 1] - load[k]) * kept
    made = codes + np.ptp(codes, axis=0) * [0.1, 0.08, 0.0, 0.12] * (slow - load)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("relaxation",)
    assert all("load" in trace.values for trace in result.traces)
    assert result.data["unexplained"]["share"] < 5e-3


def test_what_recovers_far_faster_is_relaxation() -> None:
    x, codes = clean(36)
    share = (codes - codes.min(axis=0)) / np.ptp(codes, axis=0)
    slow = share.copy()
    for k in range(1, len(x)):
        times = np.where(share[k] > slow[k - 1], 9.0, 9.0 * 0.22) * RATE_HZ
        slow[k] = share[k] - (share[k] - slow[k - 1]) * np.exp(-1.0 / times)
    made = codes + np.ptp(codes, axis=0) * [0.1, -0.09, 0.0, 0.12] * (slow - share)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.effects == ("relaxation",)
    assert {trace.form for trace in result.traces} == {"uneven"}
    assert result.data["unexplained"]["share"] < 2e-3


def test_what_creeps_on_beside_a_simulator_fitted_before_is_relaxation() -> None:
    """It was fitted to the first quarter, in which the sensors had crept less."""
    x, codes = clean(15)
    crept = fftconvolve(np.diff(x, prepend=x[0]), (np.arange(SAMPLES) / RATE_HZ + 0.03) ** 0.3)
    first = slice(0, SAMPLES // 4)
    scale = float(crept[first] @ x[first]) / float(x[first] @ x[first])
    made = codes + np.outer(crept[:SAMPLES] - scale * x, [180.0, -120.0, 0.0, 60.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [
        ("relaxation", ["s1", "s2", "s4"])
    ]


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


@pytest.mark.parametrize("softened", [0.0, 40.0])
def test_a_softening_that_adds_nothing_to_its_curve_is_that_curve(softened: float) -> None:
    x, codes = clean(16)
    below = np.maximum.accumulate(x) - x
    channel = first_channel(x, codes, 40.0 * x**2 + softened * below, ["softening"])
    offered = channel._offered(channel.nominal, "softening", {})
    settled = next(entry for entry in offered if entry.candidate.form == "settled")
    channel._take({"softening": [settled]})
    fit = channel.bare([("softening", 0)])
    assert channel.idle(fit, curved=True) == ([] if softened else ["softening"])


@pytest.mark.parametrize(("left", "name"), [(0.7, "drift"), (0.5, "relaxation")])
def test_a_ladder_of_relaxations_must_leave_clearly_less(left: float, name: str) -> None:
    """Its many weights say nearly all that is slow."""
    channel = SimpleNamespace(
        **dict.fromkeys(("samples", "excess", "guard"), 1.0),
        **dict.fromkeys(("price", "left"), lambda fit: fit.errors[0]),
        exact=lambda fit: False,
        idle=lambda fit, curved: (),
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
