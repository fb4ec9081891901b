"""Effects of the motion: play, slack, and clocks that are late or run apart."""

from __future__ import annotations

import importlib
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from softsense.diagnose import augment, diagnose, pricing
from softsense.diagnose.channel import Channel
from softsense.diagnose.engine import BETWEEN_S, change_of
from softsense.diagnose.nominal import AVERAGES, denoise, motion_of, nominals, reference_of
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


@pytest.mark.parametrize("count", [3, 8])
def test_readings_that_are_sent_in_batches_are_late(count: int) -> None:
    """The later, the earlier they are in one; where in one the next motion begins, nobody knows."""
    x = random_motion(SAMPLES, 1.0 / RATE_HZ, 48)
    codes, at = sensed(x), np.arange(len(x), dtype=float)
    late = 0.5 + 2.0 * (count - 1 - at % count) / count
    made, even = (
        np.stack([np.interp(at - each, at, c) for c in codes.T], axis=1)
        for each in (late, np.full(len(at), late.mean()))
    )
    sim = recorded(x, codes, 1)
    result = diagnose(sim, recorded(x, made, 2))
    assert result.effects == ("delay",)
    assert result.data["unexplained"]["share"] < 0.005
    later = augment(result, recorded(x, codes, 3, noise=0.0)).codes
    assert np.std((later - even)[100:]) < 0.5 * np.std((made - even)[100:])


@pytest.mark.parametrize("skew", [0.0, 3e-5])
def test_a_clock_that_is_late_by_far_less_than_a_sample_is(skew: float) -> None:
    """What goes on between samples is smooth, which a walk sees; and no circuit of each channel is
    there where one clock says as much."""
    x, codes = walked(8)
    index = np.arange(len(x), dtype=float)
    late = 0.003 * (skew == 0.0) * RATE_HZ * FINE + skew * index
    made = np.stack([np.interp(index - late, index, c) for c in codes.T], axis=1)
    sim = recorded(x[::FINE], codes[::FINE], 1)
    result = diagnose(sim, recorded(x[::FINE], made[::FINE], 2))
    assert result.effects == ("delay",)
    assert result.data["unexplained"]["share"] < 0.01


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
    monkeypatch.setattr(pricing, "LONG", 0)
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
    monkeypatch.setattr(pricing, "SEARCHED", 2000)
    x, codes = clean(58)
    played, at, index = np.empty(SAMPLES), x[0], np.arange(SAMPLES)
    for k, strain in enumerate(x):
        at = min(max(at, strain - 0.04), strain + 0.04)
        played[k] = at
    late = np.stack([np.interp(index - 1.6, index, c) for c in sensed(played).T], axis=1)
    result = diagnose(recorded(x, codes, 1), recorded(x, late, 2))
    assert set(result.effects) == {"backlash", "delay"}
    assert result.data["after"]["shrink"] > 0.98


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


def test_a_drive_that_slips_before_it_takes_hold_and_stays_there_is_backlash() -> None:
    """What it has slipped it never makes up for, so it goes astray like a walk."""
    x, codes = clean(63)
    crept, at, bent = np.empty(len(x)), x[0], 0.0
    for k, move in enumerate(np.diff(x, prepend=x[0])):
        for part in np.full(20, move / 20):
            at += part * min(0.5 * (1.0 + np.sign(part) * bent), 1.0) ** 2.5
            bent = min(max(bent + part / 0.02, -1.0), 1.0)
        crept[k] = at
    result = diagnose(recorded(x, codes, 1), recorded(x, sensed(crept), 2))
    assert result.effects == ("backlash",)
    assert {trace.form for trace in result.traces} == {"creeping"}
    assert result.data["unexplained"]["share"] < 1e-3


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


@pytest.mark.parametrize("average", AVERAGES, ids=len)
def test_what_an_average_keeps_of_the_noise_is_no_gap(average: np.ndarray) -> None:
    """However few samples it takes."""
    x, codes = clean(3)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    simulated, real = np.random.default_rng(8).normal(0.0, 1.7, (2, len(x)))
    still = np.convolve(simulated, average, "same")
    own, kept = float(np.mean((simulated - still) ** 2)), float((average**2).sum())
    curve, history = x[:, None] ** [1, 2], motion.history
    channel = Channel(nominal, real - still, 1.7, curve, ["gain"], own, 0.0, kept, history)
    assert channel.noise == pytest.approx(np.var(real - still), rel=0.03)
    assert not channel.entries
    assert channel.left(channel.fit(())) < 0.15 * len(x)


def test_a_seldom_fast_move_of_a_simulation_is_kept() -> None:
    """No average of the whole recording is good there, and the rest would look like spikes."""
    x, codes = clean(56)
    motion = motion_of(x, 1 / RATE_HZ, 0.0, None)
    moved = codes.copy()
    moved[3000:3006] += 60.0 * np.hanning(8)[1:-1, None]
    sim, real = (recorded(x, moved, k).codes.astype(float) for k in range(2))
    other = recorded(x, codes, 1).codes.astype(float)
    there = slice(2998, 3008)
    assert np.abs(denoise(sim, motion, real)[0] - moved)[there].max() < 8.0
    assert np.abs(denoise(sim, motion, other)[0] - moved)[there].max() > 20.0


def test_effects_of_the_motion_are_composed_where_a_channel_has_no_gap() -> None:
    x, codes = clean(2, 1500)
    names = frozenset({"backlash", "delay"})
    channel = first_channel(x, codes, np.zeros(len(x)), sorted(names))
    assert not channel.composed(channel.within(names), names).picks


@pytest.mark.parametrize("effect", ["", "step"])
def test_channels_that_are_read_one_after_the_other_are_late_by_more_and_more(effect: str) -> None:
    """And not each by a circuit of its own."""
    x, codes = clean(1)
    index = np.arange(len(x), dtype=float)
    each = 0.4 + 0.15 * np.arange(codes.shape[1])
    made = np.stack(
        [np.interp(index - late, index, c) for late, c in zip(each, codes.T, strict=True)], axis=1
    )
    result = diagnose(recorded(x, codes, 1), recorded(x, hide(x, made, effect), 2))
    assert set(result.effects) == {"delay", effect} - {""}
    assert result.data["unexplained"]["share"] < 0.005
    late_s = {
        trace.channel: trace.values["delay_s"] + trace.values["scan_s"] * trace.channel
        for trace in result.traces
        if trace.effect == "delay"
    }
    assert [late_s[c] for c in sorted(late_s)] == pytest.approx(each / RATE_HZ, abs=0.003)


@pytest.mark.parametrize("seed", [6200, 6201])
def test_circuits_behind_a_clock_that_is_late(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock alone would be as late as all of them on average."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("liquid").make(seed, ("delay", "lag"), "rich")
    result = diagnose(case.sim, case.real)
    assert set(result.effects) == {"delay", "lag"}
    assert result.data["unexplained"]["share"] < 0.005
