"""A built estimator on its board: verified over the wire, and with a sensor cut."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import softsense as ss
from softsense.cli.main import main
from softsense.device import Emulator, boards
from softsense.device.board import networks
from softsense.device.feeder import converter_codes
from softsense_codegen import reference
from softsense_codegen.network import IntNetwork

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}"}
QUICK = ["--size", "2", "--hidden", "8", "--epochs", "10", "--restarts", "1", "-q"]
QUICK += ["--on", "reference"]
FAULT_ROW = 200


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of one rig; of the first, a build with fallbacks and one without."""
    folder = tmp_path_factory.mktemp("device")
    rig = ss.linear_rig(3)
    for number, name in enumerate(("train", "unseen")):
        ss.write(ss.simulate(rig, samples=1500, seed=number), folder / f"{name}.csv")
    command = ["build", str(folder / "train.csv"), *QUICK]
    assert main([*command, "--fallback", "1", "-o", str(folder / "out")]) == 0
    assert main([*command, "--seed", "5", "-o", str(folder / "other")]) == 0
    return folder


@pytest.mark.parametrize("spec", ["auto", "divider:30"])
def test_physical_values_are_played_through_the_stored_front_end(tmp_path: Path, spec: str) -> None:
    """A recording of another range must not be stretched over the converter's whole range."""
    made = ss.simulate(ss.linear_rig(2), samples=600)
    rows = np.column_stack([made.target[:, 0], made.codes[:, :2] / 64 + 3.0])
    for name, part in (("whole", rows), ("quarter", rows[:150])):
        np.savetxt(tmp_path / f"{name}.csv", part, "%.6f", ",", header="strain,a,b", comments="")
    command = ["build", str(tmp_path / "whole.csv"), "--front-end", spec, *QUICK]
    assert main([*command, "-o", str(tmp_path / "out")]) == 0
    trained = ss.read(tmp_path / "whole.csv", front_end=spec).codes
    inputs = networks(tmp_path / "out")[0].inputs
    order = ["ab".index(name) for name in inputs]
    for name, count in (("whole", 600), ("quarter", 150)):
        played = converter_codes(tmp_path / "out", tmp_path / f"{name}.csv")
        assert np.array_equal(played, trained[:count, order])


def answer_of(out: Path, name: str, codes: np.ndarray) -> np.ndarray:
    path = out / f"{name}.json"
    return reference.estimate(IntNetwork.from_json(path.read_text(), str(path)), codes)


@pytest.mark.parametrize(
    "name", ["host", "mps2-an386", "microbit", "mps2-an505", "riscv32-virt", "avr-uno"]
)
def test_verify_is_bit_for_bit_with_and_without_fallbacks(
    name: str, folder: Path, tool, capsys
) -> None:
    board = next(board for board in boards() if board.name == name)
    tool(board.compiler)
    if board.run[0] != "{program}":
        tool(board.run[0])
    for out in ("out", "other"):
        command = ["device", "verify", str(folder / out), "--port", f"emulate:{name}", "--json"]
        assert main([*command, "--vectors", "2000"]) == 0
        result = json.loads(capsys.readouterr().out)
        assert (result["mismatches"], result["compared"]) == (0, 2000 + 2 * 2**2)


def test_verify_says_where_bits_differ(folder: Path, tmp_path: Path, capsys) -> None:
    """The weights in the C are not quite those of the reference."""
    for path in (folder / "other").iterdir():
        if path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
    source = tmp_path / "train.c"
    text = source.read_text()
    altered = re.sub(r"(W2?\()(-?\d+)", lambda found: f"{found[1]}{int(found[2]) ^ 1}", text)
    assert altered != text
    source.write_text(altered)
    command = ["device", "verify", str(tmp_path), "--port", "emulate:host", "--vectors", "500"]
    assert main(command) == 3
    assert "first: codes [" in capsys.readouterr().out


def test_info_names_all_networks_and_another_board_is_refused(folder: Path, capsys) -> None:
    wanted = networks(folder / "out")
    with Emulator(folder / "out") as emulator:
        assert main(["device", "info", "--port", emulator.port, "--json"]) == 0
        info = json.loads(capsys.readouterr().out)
        for action in (
            ["verify", str(folder / "other")],
            ["ping", "--model", str(folder / "other")],
        ):
            assert main(["device", *action, "--port", emulator.port]) == 1
            assert "the board holds another model" in capsys.readouterr().err
    assert info["digest"] == wanted[0].digest
    assert len(wanted) == 3
    for number, network in enumerate(wanted):
        told = info["networks"][number]
        assert (told["name"], told["digest"]) == (network.name, network.digest)
        assert tuple(told["inputs"]) == network.inputs
        assert tuple(told["units"]) == network.units
        assert info["self_test"][number]["compared"] > 0
        assert info["self_test"][number]["mismatches"] == 0


def test_after_a_sensor_fault_the_fallback_answers(folder: Path, capsys) -> None:
    """`softsense emulate --sensor-fault` beside `softsense device monitor --csv -`."""
    out, recording = folder / "out", folder / "unseen.csv"
    primary = networks(out)[0]
    sensor = primary.inputs[0]
    fault = f"{sensor}:open@{FAULT_ROW}"
    command = [sys.executable, "-m", "softsense", "emulate", str(out), "-q"]
    command += ["--recording", str(recording), "--sensor-fault", fault]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
    try:
        assert running.stdout is not None
        port = running.stdout.readline().strip()
        watch = ["device", "monitor", "--port", port, "--model", str(out), "--csv", "-"]
        watch += ["--rate", "500", "--seconds", "0.8", "--truth", str(recording)]
        assert main(watch) == 0
    finally:
        running.send_signal(signal.SIGINT)
        assert running.wait(10) == 0
    header, *lines = [line.split(",") for line in capsys.readouterr().out.splitlines()]
    codes = converter_codes(out, recording, [fault])
    width = codes.shape[1]
    by_name = {network.name: network for network in networks(out)}
    channels = header[3 : 3 + width]
    assert len(lines) > FAULT_ROW + 50
    seen = np.array([[int(cell) for cell in line[3 : 3 + width]] for line in lines])
    assert np.array_equal(seen, codes[: len(lines)])
    for row, line in enumerate(lines):
        network, flags, failed = line[3 + width :]
        if row < FAULT_ROW:
            assert (network, failed) == (primary.name, "")
        elif row >= FAULT_ROW + 2:
            assert network == f"{primary.name}_no_{sensor}"
            assert set(flags.split()) >= {"failed", "fallback"}
            assert failed == sensor
        inputs = [channels.index(name) for name in by_name[network].inputs]
        (raw,) = answer_of(out, network, seen[row : row + 1, inputs].astype(np.int16))[0]
        lsb, zero = by_name[network].scales[0]
        assert line[1] == f"{(int(raw) - zero) * lsb:.9g}"


def test_fallbacks_keep_the_error_small(folder: Path, tmp_path: Path) -> None:
    """The measurement of tests/benchmarks/link/fallback.py, on a recording not trained on."""
    script = ROOT / "tests" / "benchmarks" / "link" / "fallback.py"
    command = [sys.executable, str(script), "--build", str(folder / "out")]
    command += ["--recording", str(folder / "unseen.csv"), "--json", str(tmp_path / "cut.json")]
    subprocess.run(command, env=ENVIRONMENT, check=True, capture_output=True)
    cases = json.loads((tmp_path / "cut.json").read_text())
    assert len(cases) == 2 * 3
    for case in cases:
        assert case["with_fallback"] < 0.5 * case["without"], case
        assert case["answers"].endswith(f"_no_{case['sensor']}")
        # Three conversions at a rail; a sensor that stands is judged at the end of two windows.
        assert 1 <= case["noticed_after"] <= (3 if case["kind"] != "stuck" else 40), case
