"""What is easily mistaken: noise for a tone's, walks for none, laws for other ones."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from softsense.diagnose import augment, diagnose, vetting
from softsense.diagnose.design import Fit
from softsense.diagnose.nominal import motion_of
from softsense.diagnose.search import Model, priced
from softsense.diagnose.tones import without_tone
from softsense.diagnose.variance import findings
from softsense.diagnose.wandering import noisy

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import RATE_HZ, SAMPLES, clean, hide, recorded, sensed

WALK = "random_walk"


def of(names: str, price: float) -> Model:
    return Model(frozenset(names.split("+")), (), price)


def test_a_tone_takes_no_more_of_the_noise_along_than_it_must() -> None:
    """The price of its changes is the noise that there is, not what they leave of it."""
    noise = np.random.default_rng(3).normal(0.0, 6.6, 8000)
    tone = 91.0 * np.sin(2.0 * np.pi * 6.5125 * 0.05 * np.arange(8000) + 0.4)
    assert np.std(without_tone(noise + tone, 6.5125, 0.05)) > 0.97 * np.std(noise)


@pytest.mark.parametrize(
    ("price", "steady", "taken"),
    [(1.3, True, "relaxation"), (1.7, True, "crosstalk"), (1.3, False, "crosstalk")],
)
def test_another_effect_may_be_beside_what_is_a_walk(
    monkeypatch, price: float, steady: bool, taken: str
) -> None:
    """Where the walk of the cheapest is none, if it costs nearly as little and all its own are."""
    models = [of("crosstalk+random_walk", 1.0), of("relaxation+random_walk", price), of("gain", 9)]
    for same in ("_steady", "_calm", "weighed"):
        monkeypatch.setattr(vetting, same, lambda channels, made: made)
    if not steady:
        monkeypatch.setattr(vetting, "_calm", lambda channels, made: replace(made))
    monkeypatch.setattr(vetting, "_stepped", lambda channels, models: models[0])
    monkeypatch.setattr(vetting, "_is_none", lambda c, made, *rest: "crosstalk" in made.names)
    channels = [SimpleNamespace(effect_price=0.25, entries={"gain": []})] * 2
    assert vetting._beside_walks(channels, models, models[-1], None).names == {taken, WALK}


def test_what_the_motion_tells_of_walks_is_an_effects(monkeypatch) -> None:
    """With which the rest is a walk, and costs no more than the walks did."""
    fits = {"gain": 2.0, "relaxation": 3.0}
    channel = SimpleNamespace(entries={name: [] for name in fits}, best=lambda names: names)
    walks = Model(frozenset({WALK}), (None,), 1.0)
    monkeypatch.setattr(vetting, "_driven_on", lambda channels, made, motion: [0])
    monkeypatch.setattr(
        vetting,
        "priced",
        lambda channels, made: Model(made[0], made, min(fits[n] for n in made[0] - {WALK})),
    )
    for none, said in ({"gain"}, ["relaxation"]), ({"gain", "relaxation"}, []):
        monkeypatch.setattr(
            vetting, "_is_none", lambda c, made, *rest, none=none: bool(made.names & none)
        )
        told = vetting._told([channel], walks, of("gain", 9.0), None)
        assert [(made.names, made.price) for made in told] == [({name, WALK}, 1.0) for name in said]


def test_what_heeds_the_motion_does_so_with_a_step(monkeypatch) -> None:
    channel = SimpleNamespace(nominal=SimpleNamespace(channel=0, rate=np.zeros(9)))
    monkeypatch.setattr(vetting, "walks_of", lambda channels, made: [(channel, np.zeros(9))])
    monkeypatch.setattr(vetting, "_jerky", lambda channels, made: True)
    monkeypatch.setattr(vetting, "_jerky_on", lambda channels, made, number: True)
    monkeypatch.setattr(vetting.wandering, "moved_by", lambda walk, speed: True)
    assert vetting._jumped([channel], Model(frozenset({WALK}), (None,), 1.0)) == []


def test_beside_a_walk_a_ladder_of_relaxations_says_no_more_than_others() -> None:
    """The walk says all that is slow anyway."""
    channel = SimpleNamespace(
        **dict.fromkeys(("samples", "excess", "guard", "effect_price"), 1.0),
        **dict.fromkeys(("price", "left"), lambda fit: 1.0),
        idle=lambda fit, curved: (),
    )
    beside = [
        Fit(((name, 0), (WALK, 0)), np.ones(1), np.zeros(0), None)
        for name in ("relaxation", "gain")
    ]
    creep, scale = (priced([channel], (fit,)).price for fit in beside)
    assert creep == scale


def test_what_a_simulation_has_itself_is_nothing_left() -> None:
    fit = Fit((), np.full(1, 500.0), np.zeros(0), None)
    same = {"samples": 100, "noise": 1.0, "sigma": 1.0, "excess": 400.0}
    channels = [SimpleNamespace(**same, quiet=quiet) for quiet in (False, True)]
    both = Model(frozenset(), (Fit((), np.full(1, 140.0), np.zeros(0), None), fit), 0.0)
    assert vetting.left_share(channels, both) == pytest.approx(40.0 / 800.0)


def test_spikes_are_named_beside_what_nobody_knows_on_another_channel() -> None:
    x, codes = clean(44)
    swap = np.random.default_rng(23).random(len(x)) < 0.01
    made = hide(x, codes, "spikes", 3)
    made[:, 2] += 12.0 * (np.cumsum(swap) % 2)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("spikes", ["s1"])]
    assert result.data["unexplained"]["unknown_effect"]


def test_noise_in_bursts_shows_beside_an_effect() -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(8)
    left, own = rng.normal(size=(2, *codes.shape))
    residual = left + 30.0 * x[:, None]
    left[:, 1] *= np.where(np.arange(8000) % 900 < 150, 9.0, 1.0)
    found = findings(left, residual, own, motion_of(x, 0.05, 0.0, None), True)
    assert [(each.name, each.channels) for each in found] == [("noise", (1,))]


def test_noise_may_be_louder_with_the_strain_rate() -> None:
    x, _ = clean(9, 8000)
    speed = np.abs(np.gradient(x))
    white = np.random.default_rng(8).normal(size=8000)
    assert noisy(white * (0.1 + speed / speed.mean()), speed)
    held = lfilter([1.0], [1.0, -0.9], white)
    assert not noisy(held * (0.1 + speed / speed.mean()), speed)


def test_noise_may_come_in_bursts_of_any_length() -> None:
    """Some of which are over within what tells how loud it is."""
    speed = np.ones(8000)
    rng = np.random.default_rng(21)
    swing = lfilter([1.0], [1.0, -0.95], rng.normal(size=8000))
    white = rng.normal(size=8000) * (0.1 + (swing > 1.2 * swing.std()))
    assert noisy(white, speed)
    assert not noisy(lfilter([1.0], [1.0, -0.95], white), speed)


@pytest.mark.parametrize("middle", [0.5, 0.4])
def test_an_amplifier_that_gives_less_and_less_saturates(middle: float) -> None:
    x, codes = clean(14)
    low, span = codes.min(axis=0), np.ptp(codes, axis=0)
    at, reach = low + middle * span, 0.55 * span
    bent = at + reach * np.tanh((codes - at) / reach)
    result = diagnose(recorded(x, codes, 1), recorded(x, bent, 2))
    assert result.effects == ("saturation",)
    assert result.data["unexplained"]["share"] < 2e-3


def test_a_room_that_warms_and_cools_is_a_drift_that_goes_on_so() -> None:
    x, codes = clean(16, 2 * SAMPLES)
    t = np.arange(len(x)) / RATE_HZ
    made = codes + 30.0 * (np.sin(2.0 * np.pi * t / 750.0 + 1.0) - np.sin(1.0))[:, None]
    first, then = slice(0, SAMPLES), slice(SAMPLES + 200, None)
    result = diagnose(recorded(x[first], codes[first], 1), recorded(x[first], made[first], 2))
    assert result.effects == ("drift",)
    after = augment(result, recorded(x[then], codes[then], 3)).codes
    assert np.std(after - made[then]) < 0.3 * np.std(codes[then] - made[then])


def test_damage_that_follows_a_larger_strain_slowly_is_softening() -> None:
    x, _ = clean(11)
    x = x * np.linspace(0.4, 1.0, SAMPLES)
    codes = sensed(x)
    most, top = 0.0, []
    for strain in x.tolist():
        most += max(strain - most, 0.0) * -np.expm1(-1.0 / (RATE_HZ * 3.0))
        top.append(most)
    share = (codes - codes[0]) / np.ptp(codes, axis=0)
    hurt = codes - 60.0 * np.array(top)[:, None] ** 1.2 * share
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert result.effects == ("softening",)
    assert result.data["unexplained"]["share"] < 5e-3
    assert all(1.0 <= trace.values["after_s"] <= 4.0 for trace in result.traces)


@pytest.mark.parametrize(("any_strain", "said"), [(4.0, {"delay", WALK}), (0.5, {"delay"})])
def test_walks_beside_a_motion_are_what_no_strain_says(monkeypatch, any_strain, said) -> None:
    """Any strain takes some of them, as it is another one in every sample."""
    models = [of(f"delay+{WALK}", 1.0), of("delay", 2.0)]
    monkeypatch.setattr(vetting, "_beside_noise", lambda channels, models: None)
    monkeypatch.setattr(vetting, "_beside_walks", lambda channels, models, named, motion: models[0])
    monkeypatch.setattr(vetting, "_by_sign", lambda channels, models: list(models))
    monkeypatch.setattr(vetting, "_jerky", lambda channels, made: False)
    monkeypatch.setattr(vetting, "_is_none", lambda channels, made, named, motion: False)
    monkeypatch.setattr(vetting, "left_share", lambda channels, made: 0.05)
    monkeypatch.setattr(vetting, "_moving_alone", lambda channels: [])
    strain = SimpleNamespace(left=any_strain, gap=100.0)
    channels = [SimpleNamespace(long=False)]
    assert vetting.vetted(channels, models, None, strain).models[0].names == said
