"""The live page in a real browser: it moves, it complains of nothing, and Ctrl-C ends it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from softsense.device import Device, Emulator
from softsense.device.transport import Line

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "tests" / "firmware" / "model"
ENVIRONMENT = os.environ | {"PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}"}
ROWS = 400
LOOSE = 100
# Pixels of the estimate's line and of the truth's, counted in a copy of the chart.
INK = (
    "const c = document.getElementById('chart'), copy = document.createElement('canvas');"
    "copy.width = c.width; copy.height = c.height;"
    "const pen = copy.getContext('2d', {willReadFrequently: true}); pen.drawImage(c, 0, 0);"
    "const d = pen.getImageData(0, 0, c.width, c.height).data; let value = 0, truth = 0;"
    "for (let i = 0; i < d.length; i += 4) {"
    "value += d[i + 3] > 200 && d[i] < 90 && d[i + 2] > 150;"
    "truth += d[i + 3] > 200 && d[i] > 150 && d[i] < 210;} return [value, truth]"
)


@pytest.fixture
def emulator() -> Iterator[Emulator]:
    t = np.arange(ROWS)
    adc = np.stack([1000 + 5 * t, 3000 - 4 * t, 500 + 3 * t], axis=1)
    adc[LOOSE:, 1] = 4095  # s4 comes loose
    with Emulator(MODEL, adc=adc.astype(np.int16)) as running:
        yield running


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    path = tmp_path / "truth.csv"
    path.write_text("strain,s1\n" + "".join(f"{row * 5},1\n" for row in range(ROWS)))
    return path


def wait_for(found: Callable[[], bool], seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found():
            return True
        time.sleep(0.05)
    return False


def test_the_page_moves_and_says_what_fails(emulator: Emulator, truth: Path, browser) -> None:
    command = [sys.executable, "-m", "softsense", "device", "monitor", "--port", emulator.port]
    command += ["--web", "--rate", "50", "--truth", str(truth)]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT
    )
    try:
        assert running.stdout is not None
        address = running.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:")
        browser.get(address)

        def rows() -> int:
            return int(browser.execute_script("return document.body.dataset.rows || 0"))

        def text(name: str) -> str:
            return str(
                browser.execute_script(f"return document.getElementById('{name}').innerText")
            )

        assert wait_for(lambda: rows() > 20)
        assert text("title") == "strain on host"
        assert text("truth").startswith("truth ")
        assert [text(f"code{i}").isdigit() for i in range(3)] == [True] * 3
        assert wait_for(lambda: min(browser.execute_script(INK)) > 100)
        picture = "return document.getElementById('chart').toDataURL()"
        before, seen, value = browser.execute_script(picture), rows(), text("value")
        assert wait_for(lambda: rows() > seen + 20)
        assert browser.execute_script(picture) != before
        assert text("value") != value
        words = "s4 has failed; fallback network pair_a answers"
        assert wait_for(lambda: text("state").startswith(words))
        assert browser.get_log("browser") == []
    finally:
        running.send_signal(signal.SIGINT)
        _, complaints = running.communicate(timeout=60)
    assert running.returncode == 0
    assert complaints == ""
    browser.get("about:blank")
    # The port is free again, and the board no longer streams.
    with Device(Line(emulator.port)) as device:
        count = device.statistics()["conversions"]
        time.sleep(0.2)
        assert device.statistics()["conversions"] == count


def test_a_taken_port_is_said_and_a_limit_of_time_is_kept(emulator: Emulator) -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        command = [sys.executable, "-m", "softsense", "device", "monitor", "--port", emulator.port]
        command += ["--web", str(taken.getsockname()[1])]
        done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=60)
    assert done.returncode == 1
    assert "cannot be used" in done.stderr
    assert "Traceback" not in done.stderr
    command[-1] = "0"
    done = subprocess.run(
        [*command, "--seconds", "0.3"], capture_output=True, text=True, env=ENVIRONMENT, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("action", ["monitor", "record"])
def test_ctrl_c_leaves_the_port_and_the_terminal_clean(
    action: str, emulator: Emulator, tmp_path: Path
) -> None:
    """Typed on a real terminal: its settings and cursor are back, and the board is silent."""
    import fcntl
    import pty
    import termios

    recording = tmp_path / "rec.csv"
    command = [sys.executable, "-m", "softsense", "device", action, "--port", emulator.port]
    command += ["--rate", "50"] + (["-o", str(recording)] if action == "record" else [])
    near, far = pty.openpty()
    termios.tcsetwinsize(far, (40, 100))
    before = termios.tcgetattr(far)
    running = subprocess.Popen(
        command,
        stdin=far,
        stdout=far,
        stderr=far,
        env=ENVIRONMENT | {"TERM": "xterm-256color"},
        start_new_session=True,
        # Ctrl-C reaches the processes that the terminal controls.
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    shown = b""
    try:
        os.set_blocking(near, False)

        def read() -> None:
            nonlocal shown
            with contextlib.suppress(BlockingIOError):
                shown += os.read(near, 1 << 16)

        def moves() -> bool:
            read()
            if action == "record":
                return recording.exists() and len(recording.read_text().splitlines()) > 20
            return b"s4" in shown and "●".encode() in shown

        def ended() -> bool:
            read()
            return running.poll() is not None

        assert wait_for(moves), shown
        os.write(near, b"\x03")
        assert wait_for(ended), shown
        read()
    finally:
        running.kill()
        running.wait()
    assert running.returncode == 0, shown
    assert b"Traceback" not in shown
    assert termios.tcgetattr(far) == before
    # A cursor that was hidden is shown again.
    assert shown.rfind(b"\x1b[?25h") >= shown.rfind(b"\x1b[?25l")
    os.close(near)
    os.close(far)
    with Device(Line(emulator.port)) as device:
        count = device.statistics()["conversions"]
        time.sleep(0.2)
        assert device.statistics()["conversions"] == count
