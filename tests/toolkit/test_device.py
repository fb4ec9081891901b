"""A board on a serial line, emulated: right numbers on a bad cable, or one clear line."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from softsense.cli.console import Console
from softsense.cli.main import main
from softsense.device import Device, Emulator, boards, connect
from softsense.device.board import board_names
from softsense.device.client import CHOOSE
from softsense.device.emulator import parse_faults
from softsense.device.framing import Flag
from softsense.device.transport import Line
from softsense.errors import SoftsenseError

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "tests" / "firmware" / "model"
ENVIRONMENT = os.environ | {"PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}"}


def expected(x: np.ndarray, a: int = 3, b: int = 5) -> np.ndarray:
    """What the stand-in network of tests/firmware/model must answer; C divides towards zero."""
    x0, x1 = x.astype(np.int64).T
    product = x0 * x1
    return (a * x0 - b * x1 + np.sign(product) * (abs(product) // 16))[:, None]


def codes(rows: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(-32768, 32768, (rows, 2)).astype(np.int16)


@pytest.fixture(scope="module")
def emulator() -> Iterator[Emulator]:
    rows = 400
    t = np.arange(rows)
    adc = np.stack([1000 + 5 * t, 3000 - 4 * t, 500 + 3 * t], axis=1)
    adc[200:, 1] = 4095  # s4 comes loose
    with Emulator(MODEL, adc=adc.astype(np.int16), tcp=0) as running:
        yield running


@pytest.fixture
def device(emulator: Emulator) -> Iterator[Device]:
    with Device(Line(emulator.port)) as found:
        yield found


def test_identity(device: Device) -> None:
    identity = device.identity
    assert identity.digest == "5f3a9c01"
    assert [network.name for network in identity.networks] == ["pair", "pair_a"]
    assert identity.channels == ("s1", "s4", "s2")
    assert identity.networks[0].outputs == ("strain",)
    assert identity.networks[0].scales == ((0.0009765625, 0.0),)


def test_both_networks_bit_for_bit(device: Device) -> None:
    x = codes(3000)
    assert np.array_equal(device.estimate(x), expected(x))
    assert np.array_equal(device.estimate(x, network=1), expected(x, 2, 7))
    assert np.array_equal(device.estimate(x[:50], batch=1), expected(x[:50]))
    assert device.estimate(x[:0]).shape == (0, 1)


def test_self_test_runs_the_vectors_in_flash(device: Device) -> None:
    assert device.self_test() == (3, 0)
    assert device.self_test(1) == (3, 0)


def test_uncalibrated_inputs_are_named(device: Device) -> None:
    (verdict,) = device.verdicts(np.array([[50, 2000]], np.int16))
    assert verdict.uncalibrated == 1
    assert verdict.flags == Flag.UNCALIBRATED


def test_a_failed_sensor_switches_to_the_fallback_and_back(device: Device) -> None:
    t = np.arange(200)
    x = np.stack([1000 + 7 * t, 3000 - 5 * t, 1500 + 3 * t], axis=1).astype(np.int16)
    x[60:120, 1] = 4095
    verdicts = list(device.verdicts(x, CHOOSE, batch=1))
    used = np.array([verdict.network for verdict in verdicts])
    assert set(used[:60]) == {0}
    assert set(used[64:120]) == {1}
    assert set(used[170:]) == {0}
    assert all(verdict.failed == 0b010 for verdict in verdicts[64:120])
    fallback = np.concatenate([verdict.estimate for verdict in verdicts[64:120]])
    assert np.array_equal(fallback, expected(x[64:120][:, [0, 2]], 2, 7))


def test_a_stuck_sensor_is_seen_and_a_body_at_rest_is_not(device: Device) -> None:
    rest = np.tile(np.array([2000, 1900, 1800], np.int16), (200, 1))
    assert all(not v.failed for v in device.verdicts(rest, CHOOSE, batch=1))
    moving = rest.copy()
    moving[:, 0] += (10 * np.arange(200)).astype(np.int16)
    moving[:, 2] += (9 * np.arange(200)).astype(np.int16)
    verdicts = list(device.verdicts(moving, CHOOSE, batch=1))
    assert verdicts[-1].failed == 0b010
    assert verdicts[-1].flags & Flag.FALLBACK


def test_without_any_healthy_network_the_estimate_is_not_trusted(device: Device) -> None:
    x = np.tile(np.array([0, 2000, 2000], np.int16), (10, 1))
    verdicts = list(device.verdicts(x, CHOOSE, batch=1))
    assert verdicts[-1].flags & Flag.UNTRUSTED
    assert verdicts[-1].network == 0


def test_the_device_estimates_its_own_samples(device: Device) -> None:
    device.stream(200)
    seen = [sample for sample, _ in zip(device.watch(), range(60), strict=False)]
    first = seen[0].conversion
    assert [sample.conversion for sample in seen] == list(range(first, first + 60))
    steps = np.diff([sample.time_us for sample in seen])
    # A busy machine may starve the emulated board, which then skips samples: whole periods only.
    assert all(steps > 0)
    assert not any(steps % 5000)
    assert np.median(steps) == 5000
    for sample in seen:
        row = sample.conversion % 400
        assert sample.codes == (
            1000 + 5 * row,
            3000 - 4 * row if row < 200 else 4095,
            500 + 3 * row,
        )


def test_over_tcp(emulator: Emulator) -> None:
    with Device(Line(f"socket://127.0.0.1:{emulator.tcp}")) as found:
        assert np.array_equal(found.estimate(codes(500)), expected(codes(500)))


@pytest.mark.parametrize(
    ("faults", "rows"),
    [
        ("drop=0.002", 20000),
        ("flip=0.002", 20000),
        ("noise=0.002", 20000),
        ("reorder=0.05", 20000),
        ("delay=2ms", 10000),
        ("reset=300ms", 200000),
        ("cut=300ms", 200000),
        ("drop=0.001,flip=1e-3,delay=1ms,cut=1s,reorder=0.02,reset=1s", 10000),
    ],
)
def test_no_wrong_number_on_a_bad_cable(faults: str, rows: int) -> None:
    x = codes(rows)
    with connect(MODEL, "emulate:host", faults=parse_faults(faults), seed=3) as device:
        assert np.array_equal(device.estimate(x, batch=10), expected(x))
        counters, cable = device.counters, device.owner
    assert cable is not None
    if "reset" in faults and cable.resets:
        assert counters.resets > 0
    if "drop" in faults or "flip" in faults:
        assert counters.retries > 0


def test_requests_are_as_long_as_the_cable_lets_through() -> None:
    """Of frames of 1 KB with their answers fewer than 1 in 10 would come through here."""
    x = codes(5000)
    faults = parse_faults("drop=0.001,flip=1e-4,delay=20ms")
    with connect(MODEL, "emulate:host", faults=faults, seed=2) as device:
        assert np.array_equal(device.estimate(x), expected(x))
        sent = len(x) / device.counters.answers
        assert 5 < sent < device.rows_per_batch() / 2
    with connect(MODEL, "emulate:host") as device:
        assert np.array_equal(device.estimate(x), expected(x))
        assert device.counters.answers < 3 * len(x) / device.rows_per_batch()


def test_a_reset_is_noticed() -> None:
    with connect(MODEL, "emulate:host", faults=parse_faults("reset=50ms"), seed=1) as device:
        end = time.monotonic() + 60
        while not device.counters.resets and time.monotonic() < end:
            device.ping()
        assert device.counters.resets > 0
        assert np.array_equal(device.estimate(codes(100)), expected(codes(100)))


def test_an_unplugged_cable_is_plugged_in_again_or_said() -> None:
    with connect(MODEL, "emulate:host", faults=parse_faults("cut=100ms"), seed=1) as device:
        end = time.monotonic() + 60
        while not device.counters.reconnects and time.monotonic() < end:
            device.ping()
        assert device.counters.reconnects > 0
    with Emulator(MODEL) as running:
        device = Device(Line(running.port), patience_s=0.3).__enter__()
    with pytest.raises(SoftsenseError, match="unplugged"):
        device.ping()
    device.line.close()


def test_another_model_is_refused(tmp_path: Path, emulator: Emulator) -> None:
    text = (MODEL / "manifest.json").read_text().replace("5f3a9c01", "00000000")
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(SoftsenseError, match="another model"), connect(tmp_path, emulator.port):
        pass


def test_silence_is_one_clear_line() -> None:
    import pty

    master, slave = pty.openpty()
    try:
        with (
            pytest.raises(SoftsenseError, match="no answer for"),
            connect(None, os.ttyname(slave), patience_s=0.3),
        ):
            pass
    finally:
        os.close(master)
        os.close(slave)


def test_a_busy_and_a_missing_port_are_said(emulator: Emulator, device: Device) -> None:
    with pytest.raises(SoftsenseError, match="used by another"), connect(None, emulator.port):
        pass
    with pytest.raises(SoftsenseError, match="cannot be opened"), connect(None, "/dev/ttyNONE"):
        pass


def test_faults_are_read_or_refused() -> None:
    faults = parse_faults("drop=0.01,flip=1e-4,delay=20ms,cut=30s,reorder,reset")
    assert (faults.drop, faults.delay_s, faults.cut_s) == (0.01, 0.02, 30.0)
    assert faults.reorder > 0
    assert faults.reset_s > 0
    for wrong in ("lightning", "drop=2", "delay=soon", "flip=-1"):
        with pytest.raises(SoftsenseError):
            parse_faults(wrong)


@pytest.mark.parametrize("name", board_names())
def test_every_board_answers_bit_for_bit(name: str, tool) -> None:
    board = next(board for board in boards() if board.name == name)
    tool(board.compiler)
    if board.run[0] != "{program}":
        tool(board.run[0])
    x = codes(300)
    with connect(MODEL, f"emulate:{name}") as device:
        assert device.identity.board == name
        assert np.array_equal(device.estimate(x), expected(x))
        assert device.self_test() == (3, 0)


def test_a_device_is_of_use_again_after_it_failed_to_come_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with connect(MODEL, "emulate:host") as device:

        def fails(self: Device) -> None:
            monkeypatch.undo()
            self._identity = None
            raise SoftsenseError("no answer for 5 s")

        monkeypatch.setattr(Device, "_identify", fails)
        device._session ^= 1  # as after a reset: the board knows no such session
        with pytest.raises(SoftsenseError, match="no answer"):
            device.ping()
        x = codes(10)
        assert np.array_equal(device.estimate(x), expected(x))


def test_nothing_is_left_behind(tmp_path: Path) -> None:
    environment = ENVIRONMENT | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-m", "softsense", "emulate", str(MODEL)]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
    )
    assert running.stdout is not None
    port = running.stdout.readline().strip()
    assert Path(port).exists()
    with connect(MODEL, port) as device:
        device.ping()
    running.send_signal(signal.SIGINT)
    assert running.wait(10) == 0
    assert list(tmp_path.iterdir()) == []


def test_ended_as_soon_as_the_port_is_said(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def ends(self: Console, text: str) -> None:
        if "device ping" in text:
            raise KeyboardInterrupt

    monkeypatch.setattr(Console, "say", ends)
    assert main(["emulate", str(MODEL)]) == 0
    assert not Path(capsys.readouterr().out.strip()).exists()


def test_estimate_and_info_commands(emulator: Emulator, tmp_path: Path, capsys) -> None:
    assert main(["device", "ping", "--port", emulator.port]) == 0
    assert main(["device", "info", "--port", emulator.port]) == 0
    assert "5f3a9c01" in capsys.readouterr().out
    table = tmp_path / "codes.csv"
    table.write_text("s4,other,s1\n1711,9,2048\n")
    for source in (["2048", "1711"], ["--csv", str(table)]):
        assert main(["device", "estimate", "--port", emulator.port, *source]) == 0
        line = capsys.readouterr().out.splitlines()[1]
        raw = float(expected(np.array([[2048, 1711]]))[0, 0])
        assert line == f"{raw * 0.0009765625:.9g},pair,"
    assert main(["device", "estimate", "--port", emulator.port, "1"]) == 1
    assert "1 codes instead of 2" in capsys.readouterr().err


def test_record_survives_and_resumes(emulator: Emulator, tmp_path: Path) -> None:
    from softsense.recording import read

    path = tmp_path / "rec.csv"
    base = ["device", "record", "--port", emulator.port, "-o", str(path), "--rate", "100", "-q"]
    assert main([*base, "--seconds", "0.5"]) == 0
    first = len(path.read_text().splitlines())
    with path.open("a") as file:
        file.write("0.7,12")  # a kill in the middle of a line
    assert main(base) == 1
    assert main([*base, "--seconds", "0.5", "--resume"]) == 0
    recording = read(path, target="s2")
    assert len(recording) > first
    assert recording.sensors == ("s1", "s4")
    assert recording.dt_s == pytest.approx(0.01, rel=0.01)


def test_monitor_rows_show_the_truth(emulator: Emulator, tmp_path: Path, capsys) -> None:
    truth = tmp_path / "truth.csv"
    truth.write_text("strain,s1\n" + "".join(f"{row / 10},1\n" for row in range(400)))
    command = ["device", "monitor", "--port", emulator.port, "--csv", "-", "--rate", "100"]
    assert main([*command, "--seconds", "0.3", "--truth", str(truth)]) == 0
    lines = [line.split(",") for line in capsys.readouterr().out.splitlines()]
    assert lines[0][:4] == ["t_s", "strain", "strain_truth", "s1"]
    assert len(lines) > 20
    for line in lines[1:]:
        assert float(line[2]) == pytest.approx((int(line[3]) - 1000) / 5 / 10)


def test_device_never_loads_torch() -> None:
    code = (
        "import sys, softsense.device.actions, softsense.device.monitor, softsense.device.recorder,"
        "softsense.device.checking; print({'torch', 'onnx', 'numba', 'scipy'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=ENVIRONMENT, check=True
    )
    assert done.stdout.strip() == "set()"
