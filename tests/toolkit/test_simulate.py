"""The two rigs: determinism, continuation, files, the ADC, and the commands."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsense import recording
from softsense.cli.main import main
from softsense.effects import all_effects
from softsense.errors import SoftsenseError
from softsense.simulate import (
    Placed,
    Rig,
    Sensor,
    all_wires,
    finger_rig,
    linear_rig,
    random_motion,
    run,
    simulate,
    to_recording,
    triangle,
)
from softsense.simulate.linear import MATRICES, draw_wires
from softsense.simulate.record import read_state, write_state
from softsense.simulate.rig import PLACES

DT_S = 0.05
RIGS = {"linear": linear_rig, "finger": finger_rig}


@pytest.fixture(scope="module")
def every_effect() -> Rig:
    """A rig with every effect of the catalogue, in every form."""
    stages = {
        "motion": ["motion"],
        "material": ["stress", "response"],
        "electrical": ["electrical"],
    }
    placed = [
        Placed(name, at, {}, form)
        for name, one in all_effects().items()
        for form in one.forms
        for at in stages[one.stage]
    ]
    rig = linear_rig(2)
    return replace(rig, effects=(*rig.effects, *placed))


def test_a_seed_is_a_rig_and_another_is_another() -> None:
    assert linear_rig(3) == linear_rig(3)
    assert linear_rig(3) != linear_rig(4)
    strain = random_motion(500, DT_S, 3)
    np.testing.assert_array_equal(
        simulate(linear_rig(3), 500, 3).codes, run(linear_rig(3), strain, 3).codes
    )
    np.testing.assert_array_equal(
        run(linear_rig(3), strain, 3).codes, run(linear_rig(3), strain, 3).codes
    )
    assert (run(linear_rig(3), strain, 3).codes != run(linear_rig(3), strain, 4).codes).any()


def test_the_first_codes_of_seed_0_are_these() -> None:
    """Golden: another machine, numpy or compiler must give the same recording."""
    strain = random_motion(200, DT_S, 0)
    codes = run(linear_rig(0), strain, 0).codes
    assert codes[::40].tolist() == GOLDEN


GOLDEN = [
    [1482, 1489, 1629, 1536, 1459, 1454, 1455],
    [1588, 1571, 1752, 1674, 1597, 1549, 1553],
    [2169, 2084, 2270, 2356, 2290, 2079, 2084],
    [2212, 2128, 2261, 2224, 2164, 2139, 2143],
    [1763, 1757, 1835, 1690, 1623, 1728, 1733],
]


def test_another_processor_gives_the_same_codes(tmp_path) -> None:
    """numpy without its widest vectors, loops compiled for a plain processor: not one code off."""
    program = (
        "import hashlib\n"
        "from softsense.simulate import finger_rig, linear_rig, simulate\n"
        "rigs = [*(linear_rig(s) for s in range(3)), finger_rig(0)]\n"
        "codes = b''.join(simulate(rig, 8000, 1).codes.tobytes() for rig in rigs)\n"
        "print(hashlib.sha256(codes).hexdigest())\n"
    )
    path = {"PYTHONPATH": ":".join(sys.path)}
    plain = {
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "NPY_DISABLE_CPU_FEATURES": "AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR",
    }
    digests = {
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", program],
            env={**os.environ, **path, **extra},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for extra in ({}, plain)
    }
    assert len(digests) == 1


def test_seven_wires_of_five_matrices_are_drawn() -> None:
    seen = set()
    for seed in range(20):
        wires = draw_wires(seed)
        assert len(set(wires)) == 7
        seen |= set(wires)
    assert {name for name, _ in seen} == set(MATRICES) - {"bare", "Sil-Poxy"}
    assert len(all_wires()) == 14


def test_a_wire_is_the_same_whatever_is_beside_it() -> None:
    alone = linear_rig(5, (("natural rubber", 2),)).sensors[0]
    among = linear_rig(5, all_wires()).sensors[-1]
    assert replace(among, name="s1") == alone


def test_random_motion_covers_its_range_about_uniformly() -> None:
    for seed in range(10):
        motion = random_motion(8000, DT_S, seed)
        counts = np.histogram(motion, bins=10, range=(0, 1))[0]
        assert counts.sum() == 8000
        assert counts.min() > 400
        assert counts.max() < 1300
        assert np.ptp(motion) > 0.97


def test_random_motion_varies_in_frequency_and_amplitude() -> None:
    motion = random_motion(8000, DT_S, 1)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(motion)))) + 1
    swings, times = np.abs(np.diff(motion[turns])), np.diff(turns) * DT_S
    assert np.quantile(swings, 0.9) > 5 * np.quantile(swings, 0.1)
    assert np.quantile(times, 0.9) > 3 * np.quantile(times, 0.1)


@given(cut=st.integers(1, 399), seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_a_longer_motion_begins_with_the_shorter(cut: int, seed: int) -> None:
    whole = random_motion(400, DT_S, seed)
    np.testing.assert_array_equal(random_motion(cut, DT_S, seed), whole[:cut])
    np.testing.assert_array_equal(random_motion(400 - cut, DT_S, seed, start=cut), whole[cut:])


def test_a_triangle_is_one() -> None:
    motion = triangle(1200, DT_S, 3.5, 30.0)
    assert motion[0] == 0.0
    assert motion.max() == pytest.approx(3.5)
    np.testing.assert_allclose(np.abs(np.diff(motion)), 3.5 / 15 * DT_S, rtol=1e-9)


@pytest.mark.parametrize("kind", RIGS)
def test_batch_equals_streaming(kind: str) -> None:
    rig, strain = RIGS[kind](7), random_motion(600, DT_S, 7)
    whole = run(rig, strain, 7)
    state, parts = None, []
    for begin, end in ((0, 1), (1, 250), (250, 251), (251, 600)):
        part = run(rig, strain[begin:end], 7 if state is None else 99, state)
        state = part.state
        parts.append(part.codes)
    np.testing.assert_array_equal(np.concatenate(parts), whole.codes)


def test_batch_equals_streaming_with_every_effect(every_effect: Rig, tmp_path) -> None:
    strain = random_motion(300, DT_S, 7)
    whole = run(every_effect, strain, 7)
    first = run(every_effect, strain[:111], 7)
    path = write_state(every_effect, 7, first.state, tmp_path / "state.json")
    rig, seed, state = read_state(path)
    assert (rig, seed) == (every_effect, 7)
    rest = run(rig, strain[111:], seed, state)
    np.testing.assert_allclose(
        np.concatenate([first.volts, rest.volts]), whole.volts, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("kind", RIGS)
def test_a_rig_round_trips(kind: str, seed: int) -> None:
    rig = RIGS[kind](seed)
    assert Rig.from_toml(rig.to_toml()) == rig


def test_every_effect_round_trips(every_effect: Rig) -> None:
    noted = replace(every_effect, notes=("fitted", "to nothing"))
    assert Rig.from_toml(noted.to_toml()) == noted


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('schema = "softsense.rig/1"', 'schema = "rig/9"', "not a rig"),
        ('name = "relaxation"', 'name = "rust"', "no effect 'rust'"),
        ('at = "stress"', 'at = "motion"', "is of stage material"),
        ("threshold = 0.15", "treshold = 0.15", "no parameter treshold"),
        ("base_ohm = ", "base_ohms = ", "base_ohms"),
        ("rate_hz = 20.0", "rate_hz = -1.0", "above zero"),
        ("[[sensors]]", "[sensors", "Expected"),
    ],
)
def test_a_bad_rig_is_refused(old: str, new: str, what: str) -> None:
    text = linear_rig(0).to_toml()
    assert old in text
    with pytest.raises(SoftsenseError, match=what):
        Rig.from_toml(text.replace(old, new, 1))


def test_parameters_must_fit_the_sensors() -> None:
    with pytest.raises(ValueError, match="2 values for 7 sensors"):
        replace(linear_rig(0), effects=(Placed("gain", "response", {"amplitude": (0.1, 0.2)}),))
    with pytest.raises(ValueError, match="no sensor s9"):
        replace(linear_rig(0), effects=(Placed("gain", "response", {}, channels=("s9",)),))


def test_an_effect_may_sit_on_some_channels_only() -> None:
    rig, strain = linear_rig(1), random_motion(300, DT_S, 1)
    gain = Placed("gain", "response", {"amplitude": 0.2}, channels=("s2", "s5"))
    plain, changed = run(rig, strain, 1), run(replace(rig, effects=(*rig.effects, gain)), strain, 1)
    differs = (plain.codes != changed.codes).any(axis=0)
    assert differs.tolist() == [name in ("s2", "s5") for name in rig.names]


@given(
    bits=st.integers(4, 15),
    level=st.floats(0.0, 5000.0),
    base=st.floats(1e-3, 1e9),
    scale=st.floats(-50.0, 50.0),
)
@settings(max_examples=60, deadline=None)
def test_the_adc_saturates_and_never_wraps(
    bits: int, level: float, base: float, scale: float
) -> None:
    sensor = Sensor("s1", "", 1, base_ohm=base, reference_ohm=1000.0, span=1.5)
    noise = Placed("noise", "electrical", {"level_lsb": level})
    rig = Rig("one", (sensor,), (noise,), adc_bits=bits)
    result = run(rig, scale * random_motion(200, DT_S, 0))
    top = 2**bits - 1
    assert result.codes.min() >= 0
    assert result.codes.max() <= top
    expected = np.clip(np.round(result.volts * top), 0, top)
    assert np.abs(result.codes - expected).max() <= 1


def test_resistance_is_what_the_divider_reads() -> None:
    rig, strain = linear_rig(0), random_motion(400, DT_S, 0)
    quiet = replace(rig, effects=tuple(e for e in rig.effects if e.name != "noise"))
    result = run(quiet, strain)
    reference = np.array([sensor.reference_ohm for sensor in rig.sensors])
    np.testing.assert_allclose(
        result.codes / 4095, result.ohm / (result.ohm + reference), atol=0.5 / 4095 + 1e-12
    )


def test_an_ideal_sensor_follows_its_curve() -> None:
    sensor = Sensor("s1", "", 1, 1000.0, 2000.0, 1.0, curve=(0.0, 0.25, 1.0), curve_high=1.0)
    strain = np.array([-0.5, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5])
    ohm = run(Rig("one", (sensor,), ()), strain).ohm[:, 0]
    np.testing.assert_allclose(ohm, 1000 * (1 + np.array([-0.25, 0, 0.125, 0.25, 0.625, 1, 1.75])))


def test_the_finger_bends_along_an_arc() -> None:
    rig = finger_rig(0)
    pose = run(rig, np.zeros(50)).pose
    assert pose is not None
    assert np.ptp(pose.x_px) == 0.0
    assert pose.y_px[0] - 60.0 == pytest.approx(300.0)
    moved = run(rig, random_motion(3000, DT_S, 0)).pose
    assert moved is not None
    away = np.hypot(moved.x_px - 320.0, moved.y_px - 60.0)
    assert away.max() <= 300.0 + 1e-9
    assert moved.bend_deg.max() > 120.0
    # One pressure, several poses: the finger has its own hidden states.
    middle = np.abs(moved.pressure_kpa - 30.0) < 1.0
    assert np.ptp(moved.bend_deg[middle]) > 5.0


def test_places_have_a_stage() -> None:
    assert set(PLACES) == {"motion", "stress", "response", "electrical"}


def command(*args: object) -> int:
    return main(["simulate", *map(str, args), "-q"])


def test_the_command_writes_a_recording_that_reads_back(tmp_path, capsys) -> None:
    path = tmp_path / "rec.csv"
    assert command("linear", "-o", path, "--samples", 300, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["samples"] == 300
    read = recording.read(path)
    assert read.sensors == tuple(f"s{i}" for i in range(1, 8))
    assert len(told["sensors"]) == 7
    rig, strain = linear_rig(0), random_motion(300, DT_S, 0)
    np.testing.assert_array_equal(read.codes, run(rig, strain, 0).codes)
    np.testing.assert_allclose(read.target[:, 0], 0.4 * strain, rtol=1e-8, atol=1e-12)


def test_a_finger_recording_never_takes_truth_for_a_sensor(tmp_path) -> None:
    path = tmp_path / "finger.csv"
    assert command("finger", "-o", path, "--samples", 200) == 0
    for target in ("x_px,y_px", "bend_deg"):
        assert recording.read(path, target=target).sensors == tuple(f"s{i}" for i in range(1, 8))


def test_a_rig_file_and_a_motion_file_repeat_the_recording(tmp_path) -> None:
    first, second, rig = tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "rig.toml"
    command("linear", "-o", first, "--samples", 300, "--save-rig", rig, "--seed", 4)
    command("--rig", rig, "--motion", first, "-o", second, "--seed", 4)
    assert first.read_bytes() == second.read_bytes()


def test_a_recording_goes_on_where_it_stopped(tmp_path) -> None:
    paths = [tmp_path / f"{name}.csv" for name in ("whole", "first", "second")]
    state = tmp_path / "state.json"
    for kind in RIGS:
        command(kind, "-o", paths[0], "--samples", 400, "--seed", 3)
        command(kind, "-o", paths[1], "--samples", 150, "--seed", 3, "--save-state", state)
        command("--continue", state, "-o", paths[2], "--samples", 250)
        whole, first, second = (path.read_text().splitlines() for path in paths)
        assert whole == first + second[1:]


def test_ohms_are_resistances(tmp_path) -> None:
    path = tmp_path / "ohm.csv"
    command("linear", "-o", path, "--samples", 200, "--signal", "ohms")
    table = np.genfromtxt(path, delimiter=",", names=True)
    rig, strain = linear_rig(0), random_motion(200, DT_S, 0)
    ohm = run(rig, strain, 0).ohm
    for column, name in enumerate(rig.names):
        np.testing.assert_allclose(table[name], ohm[:, column], rtol=0.01)


def test_the_cyclic_test_reaches_140_percent(tmp_path) -> None:
    path = tmp_path / "cyclic.csv"
    command("linear", "-o", path, "--motion", "triangle", "--amplitude", 1.4, "--samples", 1200)
    read = recording.read(path)
    assert read.target.max() == pytest.approx(1.4)
    assert read.codes.max() < 4095
    assert np.ptp(read.codes, axis=0).min() > 1000


@pytest.mark.parametrize(
    ("args", "what"),
    [
        ((), "no rig was named"),
        (("linear", "--rig", "r.toml"), "both given"),
        (("linear", "--rate", "0"), "not above zero"),
        (("linear", "--samples", "3"), "cannot be a recording"),
        (("linear", "--wires", "11"), "cannot be drawn"),
        (("--rig", "nowhere.toml"), "cannot be read"),
        (("--continue", "nowhere.json"), "not the state of a rig"),
        (("linear", "--continue", "nowhere.json"), "which rig goes on"),
        (("linear", "--motion", "nowhere.csv"), "cannot be read"),
        (("linear", "--motion", "triangle", "--period", "0"), "not above zero"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(tmp_path, capsys, args, what) -> None:
    path = tmp_path / "rec.csv"
    assert command(*args, "-o", path) == 1
    said = capsys.readouterr().err
    assert what in said
    assert said.count("\n") == 1
    assert not path.exists()


def test_the_catalogue_is_listed(capsys) -> None:
    assert main(["effects", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in listed] == list(all_effects())
    for name, one in all_effects().items():
        assert main(["effects", name]) == 0
        told = capsys.readouterr().out
        assert one.mechanism in told
        assert all(parameter.name in told for parameter in one.parameters)
    assert main(["effects", "rust"]) == 1


def test_a_sensor_s_hidden_state_makes_static_estimation_hard_alone() -> None:
    """The same strain twice, and not the same code: far beyond the noise."""
    rig, strain = linear_rig(0), random_motion(4000, DT_S, 0)
    codes = to_recording(rig, run(rig, strain, 0)).codes
    near = np.abs(strain - 0.5) < 0.01
    assert (codes[near].std(axis=0) > 8.0).all()
