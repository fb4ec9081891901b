"""What no motion explains: walks, tones, spikes and noise, beside effects and beside each other."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from softsense.diagnose import diagnose, pricing, telling, vetting
from softsense.diagnose.nominal import lost_codes, motion_of
from softsense.diagnose.search import Model, _walk_last, by_price
from softsense.diagnose.tones import without_tone
from softsense.diagnose.variance import Finding, cleaned, evident, findings, noise_beside
from softsense.diagnose.walk import innovations, likely_gain
from softsense.diagnose.wandering import jerky, moved_by

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import GAP, RATE_HZ, SAMPLES, clean, fit_with, hide, recorded


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


def test_a_step_beside_walks_is_there_on_channels_that_have_both() -> None:
    """A slip that takes a moment, also on a channel that wanders as fast."""
    x, codes = clean(87)
    rng = np.random.default_rng(7)
    made = codes + np.cumsum(rng.normal(0.0, [0.5, 0.0, 0.5, 0.7], codes.shape), axis=0)
    slipped = -np.expm1(-np.maximum(np.arange(len(x)) - 3100.0, 0.0) / 6.0)
    made += slipped[:, None] * np.array([8.0, -20.0, 14.0, 30.0])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found["random_walk"] == ["s1", "s3", "s4"]
    assert {"s2", "s4"} <= set(found["step"])
    assert result.data["unexplained"]["share"] < 0.005


@pytest.mark.parametrize(
    ("instants", "agreed"),
    [([322, 3100, 3110, 3095], 3100), ([3100], 3100), ([10, 900], None), ([], None)],
    ids=str,
)
def test_an_instant_is_what_most_channels_agree_upon(
    instants: list[int], agreed: int | None
) -> None:
    assert vetting._most_agree(instants) == agreed


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


def test_one_walk_of_many_may_go_in_jumps() -> None:
    x, codes = clean(46)
    rng = np.random.default_rng(31)
    steps = rng.normal(0.0, 0.4, codes.shape)
    steps[:, 1] *= 0.1
    steps[rng.choice(len(x), 30, replace=False), 1] = rng.normal(0.0, 4.0, 30)
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + np.cumsum(steps, axis=0), 2))
    assert result.effects == ("random_walk",)
    assert not result.data["unexplained"]["unknown_effect"]


@pytest.mark.parametrize("seed", [56, 168])
def test_a_walk_of_many_that_goes_faster_at_times_has_no_step(seed: int) -> None:
    """Without its largest move it would go like others."""
    x, codes = clean(46)
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 0.4, codes.shape)
    steps[:, 1] *= np.exp(0.08 * lfilter([1.0], [1.0, -0.995], rng.normal(size=len(x))))
    result = diagnose(recorded(x, codes, 1), recorded(x, codes + np.cumsum(steps, axis=0), 2))
    assert result.effects == ("random_walk",)


@pytest.mark.parametrize(("rises", "raised"), [(True, 1.0), (False, 1.0), (False, 1.3)])
def test_a_walk_of_a_resistance_behind_a_divider_is_a_walk(rises: bool, raised: float) -> None:
    """It heeds the motion as the divider's slope does, also before an amplifier."""
    x, _ = clean(46)
    rng = np.random.default_rng(7)
    walks = np.cumsum(rng.normal(0.0, 5e-4, (len(x), 3)), axis=0)

    def read(resistance: np.ndarray) -> np.ndarray:
        share = resistance / (1.0 + resistance)
        return raised * 4095.0 * (share if rises else 1.0 - share) + 4095.0 * (1.0 - raised)

    moved = 0.3 + [1.2, 1.6, 0.9] * x[:, None]
    result = diagnose(recorded(x, read(moved), 1), recorded(x, read(moved + walks), 2))
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


def test_what_rings_on_after_a_knock_is_no_spike() -> None:
    x, codes = clean(58)
    rng, k = np.random.default_rng(6), np.arange(40) / RATE_HZ
    knocks = (rng.random(len(x)) < 0.002) * rng.normal(size=len(x))
    rung = np.convolve(knocks, np.exp(-k / 0.4) * np.cos(2.0 * np.pi * 1.3 * k))[: len(x)]
    knocked = codes + 12.0 * (rung / rung.std())[:, None]
    result = diagnose(recorded(x, codes, 1), recorded(x, knocked, 2))
    assert result.data["unexplained"]["unknown_effect"]
    assert not result.effects


def test_a_little_more_noise_shows_beside_channels_that_are_simulated_right() -> None:
    x, codes = clean(20)
    louder = np.array([1.3, 2.1, 1.3, 2.1])
    result = diagnose(recorded(x, codes, 1), recorded(x, codes, 2, louder))
    assert result.effects == ("noise",)
    assert result.data["effects"][0]["channels"] == ["s2", "s4"]


def test_what_a_static_curve_leaves_of_the_simulations_noise_is_no_noise(monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(GAP))
    cases = importlib.import_module("cases")
    case = cases.make(745001, ("crosstalk", "interference"), "typical", False)
    assert "noise" not in diagnose(case.sim, case.real).effects


def test_a_walk_is_one_where_its_samples_are_thinned(monkeypatch) -> None:
    monkeypatch.setattr(pricing, "LONG", 0)
    monkeypatch.setattr(pricing, "SEARCHED_OF_LONG", 600)
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


def test_noise_that_comes_with_fast_steps_has_no_spikes(monkeypatch) -> None:
    """Beside a drift; at the same speed it is as loud everywhere."""
    monkeypatch.syspath_prepend(str(GAP))
    insole = importlib.import_module("insole")
    case = insole.make(1011, ("drift", "noise"), "typical")
    assert set(diagnose(case.sim, case.real).effects) == {"drift", "noise"}


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


@pytest.mark.parametrize("seed", [0, 1])
def test_spikes_in_showers_are_spikes_beside_an_effect(seed: int) -> None:
    """There most samples that are near one are hit too."""
    x, codes = clean(70 + seed)
    rng = np.random.default_rng(seed)
    at = np.arange(len(x), dtype=float)
    made = np.stack([np.interp(at - 0.02 * RATE_HZ, at, c) for c in codes.T], axis=1)
    begins = (rng.random(made.shape) < 0.003).astype(float)
    near = lfilter([1.0], [1.0, -np.exp(-1.0 / (1.5 * RATE_HZ))], begins, axis=0)
    hit = rng.random(made.shape) < 0.3 * np.minimum(near, 1.0)
    made += hit * 25.0 * np.exp(0.4 * rng.normal(size=made.shape))
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert set(result.effects) == {"delay", "spikes"}
    assert all(len(effect["channels"]) == 4 for effect in result.data["effects"])


def test_what_a_late_clock_makes_of_jerks_is_no_spikes(monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("optical").make(680240, ("delay",), "rich", {"delay": "skew"})
    result = diagnose(case.sim, case.real)
    assert result.effects == ("delay",)
    assert result.data["unexplained"]["share"] < 0.005


def test_noise_that_goes_with_a_recent_speed_is_no_spikes(monkeypatch) -> None:
    """It is far louder at times, and for how fast the strain is there nothing stands out."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("optical").make(
        680281, ("noise",), "typical", {"noise": "rattle"}
    )
    assert diagnose(case.sim, case.real).effects == ("noise",)


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


def test_columns_are_foretold_side_by_side_as_they_are_alone() -> None:
    table = np.random.default_rng(1).normal(size=(900, 19))
    alone = [innovations(column[:, None], 0.2)[:, 0] for column in table.T]
    np.testing.assert_array_equal(innovations(table, 0.2), np.stack(alone, axis=1))


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


@pytest.mark.parametrize(
    ("share", "size"),
    [
        # So many that they and what is beside them are more samples than a tone that is on has.
        (0.022, 250.0),
        # What is beside them is half as far off as a spike is, but not so far that it is hit too.
        (0.02, 29.0),
    ],
)
def test_many_sharp_spikes_are_spikes(share: float, size: float) -> None:
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(7)
    struck = (rng.random(len(codes)) < share) * rng.choice([-1.0, 1.0], len(codes))
    left = rng.normal(size=codes.shape)
    left[:, 1] += struck * size * rng.uniform(0.95, 1.05, len(codes))
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = findings(left, left, rng.normal(size=codes.shape), motion, False)
    assert (found.name, found.channels) == ("spikes", (1,))
    assert cleaned(left, [found], motion)[:, 1].std() < 1.1


def test_a_spike_that_begins_between_samples_leaves_no_tail() -> None:
    """Its second sample is not what the first one foretells."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(2)
    struck = (rng.random(len(codes)) < 0.012) * rng.choice([-1.0, 1.0], len(codes))
    struck *= rng.uniform(80.0, 250.0, len(codes))
    left = rng.normal(size=codes.shape)
    left[:, 1] += lfilter([1.0], [1.0, -0.64], struck)
    left[:, 1] += struck * rng.uniform(-0.15, 0.15, len(codes))
    motion = motion_of(x, 0.05, 0.0, None)
    (found,) = evident(left, motion)
    assert (found.name, found.channels) == ("spikes", (1,))
    assert cleaned(left, [found], motion)[:, 1].std() < 1.1


def test_tails_of_large_spikes_leave_nothing() -> None:
    """What the motion's history seems to tell follows them somewhat, and how fast they fade is not
    seen closely enough in their mean shape: no walk is there."""
    x, codes = clean(9, 8000)
    rng = np.random.default_rng(2)
    struck = (rng.random(len(codes)) < 0.008) * rng.choice([-1.0, 1.0], len(codes))
    hurt = codes.copy()
    hurt[:, 1] += lfilter([1.0], [1.0, -0.82], struck * rng.uniform(180.0, 900.0, len(codes)))
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    found = [(effect["name"], effect["channels"]) for effect in result.data["effects"]]
    assert found == [("spikes", ["s2"])]


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


@pytest.mark.parametrize("beside", ["drift", "moves"])
def test_noise_that_comes_with_moves_is_noise(beside: str) -> None:
    """What an equation of moves leaves comes with them too, but on several channels, or it is not
    white; what a drift leaves does not."""
    x, codes = clean(9, 8000)
    own, left = np.random.default_rng(19).normal(size=(2, *codes.shape))
    speed = np.abs(np.gradient(x))
    left[:, 1] *= 1.2 + speed / speed.std()
    motion = motion_of(x, 0.05, 0.0, None)
    said = {"drift": 40.0 * np.linspace(0.0, 1.0, len(x)), "moves": 300.0 * x}[beside][:, None]
    (found,) = findings(left, left + said, own, motion, True)
    assert (found.name, found.channels) == ("noise", (1,))
    slower = left.copy()
    slower[1:, 1] = 0.8 * left[1:, 1] + 0.6 * left[:-1, 1]
    assert bool(findings(slower, slower + said, own, motion, True)) == (beside == "drift")
    both = left.copy()
    both[:, 2] = left[:, 1] + left[:, 2]
    assert bool(findings(both, both + said, own, motion, True)) == (beside == "drift")


def test_noise_that_comes_with_moves_beside_play_is_all_that_is_left(monkeypatch) -> None:
    """Heavy tails and all: nothing unknown."""
    monkeypatch.syspath_prepend(str(GAP))
    wearable = importlib.import_module("wearable")
    case = wearable.make(222001, ("backlash", "noise"), "typical")
    result = diagnose(case.sim, case.real)
    assert set(result.effects) == {"backlash", "noise"}
    assert not result.data["unexplained"]["unknown_effect"]


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


@pytest.mark.parametrize(
    ("more", "tau_s", "said"), [(0.03, 0.04, "delay"), (0.07, 0.04, "lag"), (0.03, 0.06, "lag")]
)
def test_one_clock_for_all_is_said_where_circuits_say_no_more(
    more: float, tau_s: float, said: str
) -> None:
    """Each circuit has a time constant of its own."""
    entries = {"lag": [SimpleNamespace(candidate=SimpleNamespace(values={"tau_s": tau_s}))]}
    nominal = SimpleNamespace(dt_s=0.05)
    channel = SimpleNamespace(samples=1000, entries=entries, nominal=nominal)
    lag, delay = (
        Model(frozenset({name, "drift"}), (fit_with(name, 0.0),) * 4, price)
        for name, price in (("lag", 5000.0), ("delay", 5000.0 + 4000.0 * more))
    )
    assert said in vetting._by_clock([channel] * 4, [lag, delay])[0].names


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
        wandering=lambda walk: walk,
    )
    made = Model(frozenset({"random_walk", "saturation"}), (None,), 1.0)
    assert bool(vetting._jerky_on([channel], made, 0)) is jumps


@pytest.mark.parametrize(
    ("gap", "left", "walks"),
    [(60.0, 0.8, False), (60.0, 1.0, True), (600.0, 2.9, False), (600.0, 3.1, True)],
)
def test_a_walk_beside_an_effect_says_what_no_others_do(
    gap: float, left: float, walks: bool
) -> None:
    """It follows whatever is slow, and so the little that is left of a large gap."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=gap, samples=1)]
    beside = Model(frozenset({"gain", "random_walk"}), (fit_with("gain+random_walk", 0.1),), 1.0)
    creep = Model(frozenset({"drift"}), (fit_with("drift", left),), 2.0)
    assert (_walk_last(channels, [beside, creep])[0] is beside) is walks


@pytest.mark.parametrize(("left", "walks"), [(0.7, False), (0.9, True)])
def test_a_walk_alone_leaves_less_than_effects_do(left: float, walks: bool) -> None:
    """Or they say the gap, though they may cost more."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=60.0, samples=1)]
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


def test_a_noise_without_its_name_is_unknown() -> None:
    x, codes = clean(3)
    loud = codes + 8.0 * np.random.default_rng(4).normal(size=codes.shape)
    result = diagnose(recorded(x, codes, 1), recorded(x, loud, 2), without=("noise",))
    assert result.effects == ()
    assert result.data["unexplained"]["unknown_effect"]
