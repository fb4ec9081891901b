"""The diagnosis: right on cases whose truth is known, and silent where there is nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import softsense as ss
from softsense.cli.main import main
from softsense.diagnose import augment, diagnose, folder
from softsense.diagnose.engine import SCHEMA
from softsense.diagnose.nominal import (
    curves_of,
    history_basis,
    history_weights,
    motion_of,
    nominals,
    reference_of,
)
from softsense.effects import all_effects
from softsense.errors import SoftsenseError
from softsense.simulate.motion import random_motion

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import RATE_HZ, SAMPLES, clean, filtered, hide, recorded, sensed


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
    (out / "augmentation.json").write_text(state.replace(SCHEMA, "softsense.augmentation/1"))
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
