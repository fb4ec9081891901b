"""``calibrate`` finds what a rig was made of, and its rig repeats the recording."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from softsense import recording
from softsense.cli.main import main
from softsense.errors import SoftsenseError
from softsense.simulate import (
    Placed,
    Rig,
    Sensor,
    linear_rig,
    random_motion,
    read_rig,
    run,
    to_recording,
)
from softsense.simulate.calibrate import calibrate
from softsense.simulate.characterise import characterise

DT_S = 0.05
NOISE = Placed("noise", "electrical", {"level_lsb": 1.0})


def rig_of(*effects: Placed, share: float = 0.0) -> Rig:
    """Two sensors with bent curves; ``share`` 1: states act before the curve."""
    at = np.linspace(0.0, 1.0, 17)
    sensors = tuple(
        Sensor(name, "", 1, 10_000.0, 12_000.0, span, tuple(at * (1 + bend * (at - 1))))
        for name, span, bend in (("a", 1.0, 0.2), ("b", -0.5, -0.3))
    )
    sensors = tuple(replace(sensor, stress_share=share) for sensor in sensors)
    return Rig("two", sensors, (*effects, NOISE))


def recorded(rig: Rig, samples: int = 6000, seed: int = 1) -> recording.Recording:
    return to_recording(rig, run(rig, random_motion(samples, DT_S, seed), seed))


def test_a_plain_sensor_needs_nothing() -> None:
    for sensor in calibrate(recorded(rig_of())).sensors:
        assert sensor.terms == ()
        assert sensor.residual < 1.3
        assert sensor.noise == pytest.approx(np.hypot(1.0, 0.29), rel=0.06)


@pytest.mark.parametrize("states", [1, 2])
def test_the_number_of_stress_states_is_found(states: int) -> None:
    taus = (1.0, 20.0)[:states]
    relaxation = Placed(
        "relaxation", "response", {"amplitude": ((0.15,) * states,) * 2, "tau_s": (taus,) * 2}
    )
    for sensor in calibrate(recorded(rig_of(relaxation))).sensors:
        found = sorted(term.value for term in sensor.terms if term.effect == "relaxation")
        assert sensor.states == len(found)
        # a time between two of the grid may take both of its neighbours
        assert states <= len(found) <= states + 1
        assert all(any(1 / 1.7 < f / tau < 1.7 for f in found) for tau in taus)
        assert sensor.held_out < 0.25 * sensor.held_out_by_states[0]
        assert sensor.held_out < 2.0


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("hysteresis", {"amplitude": 0.06, "threshold": 0.12}),
        ("overshoot", {"amplitude": 0.2, "tau_s": 0.8}),
        ("drift", {"amplitude": 0.1, "tau_s": 60.0}),
    ],
)
def test_one_effect_is_found_and_nothing_else(name: str, parameters: dict[str, float]) -> None:
    for sensor in calibrate(recorded(rig_of(Placed(name, "response", parameters)))).sensors:
        assert [term.effect for term in sensor.terms] == [name]
        assert sensor.residual < 1.5


def test_states_before_the_curve_are_told_from_states_behind_it() -> None:
    values = {"amplitude": 0.25, "tau_s": 3.27680}
    for place, share in (("stress", 1.0), ("response", 0.0)):
        fitted = calibrate(recorded(rig_of(Placed("relaxation", place, values), share=share)))
        assert {sensor.stress_share for sensor in fitted.rig.sensors} == {share}
        assert all(sensor.residual < 1.5 for sensor in fitted.sensors)


def test_the_rig_repeats_the_paper_s_rig_on_another_motion() -> None:
    rig = linear_rig(0)
    fitted = calibrate(recorded(rig, 8000, 0)).rig
    strain = random_motion(4000, DT_S, 77)
    # The fitted rig's range is what was seen; the same strain, in its shares.
    share = (0.4 * strain - fitted.low) / (fitted.high - fitted.low)
    real, again = run(rig, strain, 5).codes, run(fitted, share, 6).codes
    apart = np.sqrt(np.mean((real - again) ** 2.0, axis=0))
    scale = real.std(axis=0)
    # a static curve leaves 7 to 30 % here
    assert (apart < 0.10 * scale).all()
    assert np.median(apart / scale) < 0.06


def test_the_command_writes_a_rig_that_runs(tmp_path, capsys) -> None:
    rec, rig, again = (tmp_path / name for name in ("nominal.csv", "rig.toml", "again.csv"))
    recording.write(recorded(rig_of(), 1000), rec)
    assert main(["calibrate", str(rec), "-o", str(rig), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in told["sensors"]] == ["a", "b"]
    assert main(["calibrate", str(rec), "-o", str(rig), "-q"]) == 0
    assert "noise floor" in capsys.readouterr().out
    assert read_rig(rig).notes == ("fitted to the recording nominal",)
    assert main(["simulate", "--rig", str(rig), "--motion", str(rec), "-o", str(again), "-q"]) == 0
    first, second = recording.read(rec), recording.read(again)
    assert first.sensors == second.sensors
    np.testing.assert_allclose(first.target, second.target, rtol=0, atol=1e-8)
    assert np.sqrt(np.mean((first.codes - second.codes) ** 2.0)) < 2.5


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("motion", ["ramp", "binary", "noise", "spike", "huge"])
@pytest.mark.parametrize("kind", ["straight", "rails", "noise", "one code", "falling"])
def test_odd_recordings_neither_crash_nor_give_nonsense(motion: str, kind: str) -> None:
    count = 600
    t = DT_S * np.arange(count)
    rng = np.random.default_rng(0)
    y = {
        "ramp": np.linspace(0, 1, count),
        "binary": (np.sin(t) > 0).astype(float),
        "noise": rng.random(count),
        "spike": np.append(np.zeros(count - 1), 1.0),
        "huge": 1e9 + 1e3 * np.sin(t),
    }[motion]
    share = (y - y.min()) / np.ptp(y)
    codes = {
        "straight": 500 + 3000 * share,
        "rails": np.where(np.arange(count) % 50 < 25, 0, 4095),
        "noise": rng.integers(0, 4096, count),
        "one code": np.append(np.zeros(count - 1), 1),
        "falling": 3000 - 2990 * share,
    }[kind]
    end = recording.FrontEnd("codes", 12)
    odd = recording.Recording(
        "odd",
        ("s1",),
        codes.astype(np.int32)[:, None],
        ("strain",),
        ("1",),
        y[:, None],
        t,
        (end,),
    )
    fitted = calibrate(odd)
    assert np.isfinite(run(fitted.rig, share).volts).all()
    # never worse than saying the mean code throughout
    assert fitted.sensors[0].residual <= 1.02 * codes.std() + 1.0
    assert characterise(odd).sensors[0].span_codes > 0


def test_too_little_is_refused() -> None:
    with pytest.raises(SoftsenseError, match="too few"):
        calibrate(recorded(rig_of(), 300))


@pytest.mark.parametrize("name", ["s1_2_sit", "s5_6_squat", "s7_8_hc90"])
def test_real_recordings_are_fitted_better_than_by_a_curve(shared, name: str) -> None:
    real = recording.read(shared / "recordings" / f"sleeve_{name}.csv", target="knee_deg")
    fitted = calibrate(real)
    static = np.array([sensor.held_out_by_states[0] for sensor in fitted.sensors])
    held_out = np.array([sensor.held_out for sensor in fitted.sensors])
    assert (held_out <= 1.02 * static).all()
    assert all(sensor.noise < sensor.residual for sensor in fitted.sensors)
