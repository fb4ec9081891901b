"""Effects of the electrical side: circuits, rails, converters and what channels hear."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from softsense.diagnose import augment, diagnose, folder, vetting
from softsense.diagnose.design import Fit
from softsense.diagnose.nominal import lost_codes, motion_of, nominals, reference_of
from softsense.diagnose.search import Model
from softsense.effects import Candidate, all_effects
from softsense.recording import Recording
from softsense.simulate.motion import random_motion

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import (
    FINE,
    GAP,
    RATE_HZ,
    SAMPLES,
    clean,
    filtered,
    first_channel,
    hide,
    recorded,
    sensed,
    walked,
)


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


def test_a_rail_is_tried_in_place_of_a_converters_curve(monkeypatch) -> None:
    """Side by side with what it cuts off, a rail says nothing, and any curve something."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("liquid").make(170012, ("saturation", "relaxation"), "typical")
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)
    found = diagnose(case.sim, case.real, without=["saturation"]).effects
    assert "saturation" not in found


def test_a_share_may_grow_with_what_the_channel_itself_has_moved() -> None:
    """It settles the more slowly, the higher its resistance is; the zero is that of the moves."""
    x, codes = clean(19)
    slow_s = (0.05, 0.4, 2.0, 10.0)
    codes = np.hstack([filtered(codes[:, [k]], tau_s) for k, tau_s in enumerate(slow_s)])
    moved = codes - codes[0]
    share = 0.015 * np.exp(1.2 * np.abs(moved) / np.ptp(codes, axis=0))
    made = codes + share * (np.roll(moved, 1, axis=1) - moved)
    assert diagnose(recorded(x, codes, 1), recorded(x, made, 2)).effects == ("crosstalk",)


def test_a_capacitor_may_take_less_of_a_channel_than_it_brings(monkeypatch) -> None:
    """A case of the benchmark that is not held out; a gain would say the rest."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("elsewhere").make(731300, ("crosstalk",), "rich")
    assert diagnose(case.sim, case.real).effects == ("crosstalk",)


def test_crosstalk_of_a_capacitor_whose_dielectric_gives_back() -> None:
    x, codes = clean(13, 8000)
    late, made = filtered(codes, 1.5), codes.copy()
    made[:, 2] += 0.02 * (codes[:, 1] - codes[:, 2]) + 0.04 * (late[:, 1] - codes[:, 2])
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert result.traces[0].form == "absorbing"
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("crosstalk", ["s3"])]
    assert result.data["after"]["shrink"] > 0.99


@pytest.mark.parametrize("share", [1.6, -1.6])
def test_crosstalk_through_a_capacitance_may_be_raised_or_turned_over(share: float) -> None:
    x, codes = clean(14, 8000)
    made = codes.copy()
    made[:, 0] += share * (codes - filtered(codes, 0.15))[:, 3]
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("crosstalk", ["s1"])]


def test_a_drivers_smoothing_of_less_than_a_sample_is_a_lag() -> None:
    x = random_motion(SAMPLES, 4.0 / RATE_HZ, 47)
    codes = sensed(x)
    hurt = codes.copy()
    hurt[:, 1:3] = filtered(codes, 0.042)[:, 1:3]
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("lag", ["s2", "s3"])]


def _between_samples(u: np.ndarray, tau_s: float) -> np.ndarray:
    """Codes on a fine clock behind a resistor and a capacitor."""
    kept = np.exp(-1.0 / (RATE_HZ * FINE * tau_s))
    return lfilter([1.0 - kept], [1.0, -kept], u, axis=0, zi=kept * u[:1])[0]


@pytest.mark.parametrize("seed", [30, 31])
def test_an_amplifier_that_gives_less_and_less_both_ways_is_saturation(seed: int) -> None:
    """A static curve, and a converter's, would say as much of one channel."""
    x, codes = clean(seed)
    made, u = codes.copy(), codes[:, 1]
    half = 0.5 * np.ptp(u)
    middle, reach = u.min() + 1.15 * half, 1.6 * half
    made[:, 1] = middle + reach * np.tanh((u - middle) / reach)
    result = diagnose(recorded(x, codes, 1), recorded(x, made, 2))
    assert [(e["name"], e["channels"]) for e in result.data["effects"]] == [("saturation", ["s2"])]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_amplifier_that_bends_over_from_somewhere_on_is_near_one_that_is_looked_at(
    way: float,
) -> None:
    x, codes = clean(15)
    nominal = first_channel(x, codes, np.zeros(len(x)), ["saturation"]).nominal
    begin = nominal.low + (0.5 - 0.13 * way) * nominal.span
    room = 0.71 * nominal.span
    beyond = np.maximum(way * (nominal.u - begin), 0.0)
    taken = way * (room * np.tanh(beyond / room) - beyond)
    saturation = all_effects()["saturation"]

    def left(candidate: Candidate) -> float:
        return float(((candidate.columns[:, 0] - taken) ** 2).mean() / (taken**2).mean())

    coarse = [c for c in saturation.explain(nominal) if c.form == "bending"]
    assert saturation.zoom is not None
    closer = saturation.zoom(nominal, min(coarse, key=left).values)
    assert min(map(left, closer)) < 1e-3


def test_a_converters_curve_upon_a_slow_lag_is_no_material(monkeypatch) -> None:
    """Nothing that stays slow altogether relaxes."""
    monkeypatch.syspath_prepend(str(GAP))
    cases = importlib.import_module("cases")
    case = cases.make(670000, ("lag", "adc_nonlinearity"), "rich", False)
    found = diagnose(case.sim, case.real).effects
    assert "lag" in found
    assert "relaxation" not in found


@pytest.mark.parametrize("late", [(0,), (0, 1, 2)])
def test_a_lag_of_far_less_than_a_sample_is_no_delay(late: tuple[int, ...]) -> None:
    """A clock is late on all channels and by as much; and what goes on between samples is smooth,
    which a walk sees."""
    x, codes = walked(6)
    made = codes.copy()
    for channel in late:
        tau_s = 0.006 / (1.0 + channel)
        made[:, channel] = _between_samples(codes[:, channel : channel + 1], tau_s)[:, 0]
    sim = recorded(x[::FINE], codes[::FINE], 1)
    result = diagnose(sim, recorded(x[::FINE], made[::FINE], 2))
    assert result.effects == ("lag",)
    assert result.data["effects"][0]["channels"] == [f"s{c + 1}" for c in late]
    assert result.data["unexplained"]["share"] < 0.02


def test_a_capacitance_is_crosstalk_also_where_it_is_charged_within_a_sample() -> None:
    x, codes = walked(7)
    made = codes.copy()
    for channel, source in ((1, 3), (2, 3)):
        fast = np.gradient(codes[:, source : source + 1], 1.0 / (RATE_HZ * FINE), axis=0)
        made[:, channel] += 0.005 * _between_samples(fast, 0.03)[:, 0]
    sim = recorded(x[::FINE], codes[::FINE], 1)
    result = diagnose(sim, recorded(x[::FINE], made[::FINE], 2))
    assert result.effects == ("crosstalk",)
    assert result.data["unexplained"]["share"] < 0.01


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


def test_a_converters_curve_is_neither_hysteresis_nor_a_gain() -> None:
    """Beside a delay, which both could bend."""
    x, codes = clean(43)
    late = hide(x, codes, "delay")
    share = (late[:, 1] - late[:, 1].min()) / np.ptp(late[:, 1])
    late[:, 1] += 20.0 * (share**3 - 0.6 * share) + 6.0 * np.sin(9.0 * share)
    result = diagnose(recorded(x, codes, 1), recorded(x, late, 2))
    found = {effect["name"]: effect["channels"] for effect in result.data["effects"]}
    assert found == {"delay": ["s1", "s2", "s3", "s4"], "adc_nonlinearity": ["s2"]}


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


def test_what_goes_with_the_signed_rate_may_be_a_little_lag(monkeypatch) -> None:
    """Where a lag costs next to nothing more, that is no charge that the motion makes."""
    charge = Model(frozenset({"overshoot"}), (), 9.0)
    monkeypatch.setattr(vetting, "signed", lambda channels, made: made is charge)
    channels = [SimpleNamespace(effect_price=0.5)]
    for price, name in ((9.4, "lag"), (9.6, "overshoot")):
        models = [charge, Model(frozenset({"lag"}), (), price)]
        assert vetting._by_sign(channels, models)[0].names == {name}


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


def test_a_converters_curve_is_seen_where_all_wanders() -> None:
    """What was read tells where on its curve the converter was, whatever led there."""
    x, codes = clean(18)
    rng = np.random.default_rng(32)
    wandered = codes + 2.0 * np.cumsum(rng.normal(size=codes.shape), axis=0)
    hurt = wandered + 15.0 * np.sin(2.0 * np.pi * wandered / 900.0)
    result = diagnose(recorded(x, codes, 1), recorded(x, hurt, 2))
    assert set(result.effects) == {"adc_nonlinearity", "random_walk"}
    assert not result.data["unexplained"]["unknown_effect"]


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
