"""Every emulated board: its own converter, its clock, and sleep that misses nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from softsense.cli.main import main
from softsense.device import Device, Emulator, boards
from softsense.device.transport import Line, now_s
from softsense.errors import SoftsenseError

MODEL = Path(__file__).resolve().parents[1] / "firmware" / "model"
RATE_HZ = 100


def test_a_board_without_a_converter_says_so() -> None:
    adc = np.zeros((10, 3), dtype=np.int16)
    with pytest.raises(SoftsenseError, match="avr-uno has no converter"):
        Emulator(MODEL, "avr-uno", adc=adc).__enter__()


@pytest.mark.parametrize("name", [board.name for board in boards() if board.converts])
def test_a_board_estimates_its_own_samples(name: str, tool) -> None:
    board = next(board for board in boards() if board.name == name)
    tool(board.compiler)
    if board.run[0] != "{program}":
        tool(board.run[0])
    t = np.arange(300)
    adc = np.stack([1000 + 5 * t, 3000 - 4 * t, 500 + 3 * t], axis=1).astype(np.int16)
    with Emulator(MODEL, name, adc=adc) as emulator, Device(Line(emulator.port)) as device:
        device.stream(RATE_HZ)
        started = now_s()
        seen = [sample for sample, _ in zip(device.watch(), range(50), strict=False)]
        seconds = now_s() - started
        device.stream(0)
        statistics = device.statistics()
    assert [sample.conversion for sample in seen] == list(range(50))
    for sample in seen:
        assert sample.codes == tuple(adc[sample.conversion])
        x0, x1, _ = (int(code) for code in sample.codes)
        assert sample.estimate == (3 * x0 - 5 * x1 + x0 * x1 // 16,)
    # A board that comes late skips samples; one whose clock is wrong is off by far more than this.
    assert np.diff([sample.time_us for sample in seen]).min() == 1_000_000 // RATE_HZ
    assert 0.5 < seconds * RATE_HZ / 50 < 5
    assert statistics["overrun"] == 0
    assert statistics["damaged"] == 0


def test_flash_shows_that_the_image_answers_on_an_emulated_board(tool, capsys) -> None:
    tool("arm-none-eabi-gcc")
    tool("qemu-system-arm")
    assert main(["device", "flash", str(MODEL), "--board", "mps2-an386"]) == 0
    assert capsys.readouterr().out == "pair loads and answers on mps2-an386\n"


def test_flash_calls_the_tool_of_a_real_board(tmp_path: Path, tool, monkeypatch, capsys) -> None:
    tool("avr-gcc")
    seen = tmp_path / "seen"
    fake = tmp_path / "bin" / "avrdude"
    fake.parent.mkdir()
    fake.write_text(f'#!/bin/sh\necho "$@" > {seen}\nexit $STATUS\n')
    fake.chmod(0o755)
    command = ["device", "flash", str(MODEL), "--board", "avr-uno", "--port", "/dev/ttyACM7"]
    monkeypatch.setenv("PATH", str(fake.parent), prepend=":")
    monkeypatch.setenv("STATUS", "0")
    assert main(command) == 0
    assert "pair is on avr-uno" in capsys.readouterr().out
    assert "-P /dev/ttyACM7" in seen.read_text()
    monkeypatch.setenv("STATUS", "1")
    assert main(command) == 1
    assert "avrdude: exit code 1" in capsys.readouterr().err
