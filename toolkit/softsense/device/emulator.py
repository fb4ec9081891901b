"""The serial hardware-in-the-loop: firmware in a process, a pty in front, a bad cable between.

``Emulator`` is a context manager; within it, ``port`` is a path that behaves like a board's serial
port. Leaving it ends the process and removes every file.
"""

from __future__ import annotations

import os
import pty
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import tty
from collections import deque
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from softsense.device.board import Board, build, read_board
from softsense.errors import SoftsenseError

# How long a cut cable stays away, and how long a frame waits to be overtaken.
CUT_S = 0.3
SWAP_S = 0.005
# Bytes that wait for a reader before the oldest are lost, as a UART without flow control loses.
MOST_WAITING = 1 << 16
_READ = 4096


@dataclass(frozen=True)
class Faults:
    """What is wrong with the cable; zero is nothing.

    ``drop``: probability that a byte is lost. ``flip``: that one of a byte's bits is turned.
    ``noise``: that a random byte is added. ``reorder``: that a frame is overtaken by the next.
    ``delay_s``: bytes come up to this late. ``cut_s``, ``reset_s``: mean time between unplugs of
    the cable (for 0.3 s) and resets of the board. ``baud``: bytes per second are limited to a
    tenth of it.
    """

    drop: float = 0.0
    flip: float = 0.0
    noise: float = 0.0
    reorder: float = 0.0
    delay_s: float = 0.0
    cut_s: float = 0.0
    reset_s: float = 0.0
    baud: float = 0.0


# Where a fault is named without a value.
_DEFAULTS = {"drop": "0.001", "flip": "1e-4", "noise": "1e-4", "reorder": "0.01", "delay": "20ms"}
_DEFAULTS |= {"cut": "30s", "reset": "20s", "baud": "115200"}


def parse_faults(text: str) -> Faults:
    """Read e.g. ``drop=0.01,flip=1e-4,delay=20ms,cut=30s,reorder,reset``.

    Raises ``SoftsenseError`` for what is not understood.
    """
    known = {item.name.removesuffix("_s"): item.name for item in fields(Faults)}
    values: dict[str, float] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, _, value = part.partition("=")
        if name not in known:
            raise SoftsenseError(
                f"there is no fault {name!r}", remedy=f"faults are {', '.join(known)}"
            )
        values[known[name]] = _number(name, value or _DEFAULTS[name], known[name].endswith("_s"))
    return Faults(**values)


def _number(name: str, text: str, seconds: bool) -> float:
    scale = 1.0
    if seconds and text.endswith("ms"):
        text, scale = text[:-2], 1e-3
    elif seconds and text.endswith("s"):
        text = text[:-1]
    try:
        value = float(text) * scale
    except ValueError:
        value = -1.0
    if not 0 <= value < 1e9 or (value > 1 and not seconds and name != "baud"):
        raise SoftsenseError(
            f"{name}={text} is not understood",
            remedy="probabilities 0 … 1; times as 20ms or 30s; baud as 115200",
        )
    return value


@dataclass
class Cable:
    """One direction of the cable: bytes go in at a time, and come out, perhaps, later."""

    faults: Faults
    rng: np.random.Generator
    _queue: deque[tuple[float, bytes]] = field(default_factory=deque)
    _frame: bytes = b""
    _held: bytes = b""
    _held_s: float = 0.0
    _free_s: float = 0.0

    def push(self, data: bytes, now_s: float) -> None:
        """Bytes enter the cable."""
        if self.faults.reorder:
            *frames, self._frame = (self._frame + data).split(b"\0")
            for frame in frames:
                self._swap(frame + b"\0", now_s)
            return
        self._enter(data, now_s)

    def _swap(self, frame: bytes, now_s: float) -> None:
        if len(frame) > 1 and not self._held and self.rng.random() < self.faults.reorder:
            self._held, self._held_s = frame, now_s
            return
        self._enter(frame, now_s)
        if self._held and len(frame) > 1:
            held, self._held = self._held, b""
            self._enter(held, now_s)

    def _enter(self, data: bytes, now_s: float) -> None:
        data = self._damage(data)
        start = now_s
        if self.faults.delay_s:
            start += self.rng.uniform(0.0, self.faults.delay_s)
        start = max(start, self._free_s)
        if not self.faults.baud:
            self._free_s = start
            self._queue.append((start, data))
            return
        for at in range(0, len(data), 16):
            part = data[at : at + 16]
            start += 10 * len(part) / self.faults.baud
            self._queue.append((start, part))
        self._free_s = start

    def _damage(self, data: bytes) -> bytes:
        faults, rng = self.faults, self.rng
        if not (faults.drop or faults.flip or faults.noise):
            return data
        raw = np.frombuffer(data, np.uint8).copy()
        if faults.flip:
            hit = rng.random(len(raw)) < faults.flip
            raw[hit] ^= (1 << rng.integers(0, 8, int(hit.sum()))).astype(np.uint8)
        if faults.drop:
            raw = raw[rng.random(len(raw)) >= faults.drop]
        if faults.noise:
            places = np.flatnonzero(rng.random(len(raw)) < faults.noise)
            raw = np.insert(raw, places, rng.integers(0, 256, len(places)).astype(np.uint8))
        return raw.tobytes()

    def pull(self, now_s: float) -> bytes:
        """Bytes that have come out by now."""
        if self._held and now_s - self._held_s > SWAP_S:
            held, self._held = self._held, b""
            self._enter(held, now_s)
        out = []
        while self._queue and self._queue[0][0] <= now_s:
            out.append(self._queue.popleft()[1])
        return b"".join(out)

    def next_s(self) -> float | None:
        """When to look again; None: nothing is on its way."""
        times = [self._held_s + SWAP_S] if self._held else []
        times += [self._queue[0][0]] if self._queue else []
        return min(times, default=None)

    def clear(self) -> None:
        """Whatever was on its way is lost."""
        self._queue.clear()
        self._frame = self._held = b""


@dataclass
class Emulator(AbstractContextManager["Emulator"]):
    """The firmware of export folder ``out`` on ``board``, behind a serial port.

    ``adc``: (rows, channels) int16 codes for the emulated converter; conversion n reads row
    n modulo rows. ``tcp``: also listen there, for pyserial's ``socket://127.0.0.1:tcp``.
    """

    out: Path
    board: str = "host"
    faults: Faults = field(default_factory=Faults)
    seed: int = 0
    tcp: int | None = None
    adc: NDArray[np.int16] | None = None
    port: str = ""
    resets: int = 0
    cuts: int = 0
    _folder: Path | None = None
    _process: subprocess.Popen[bytes] | None = None
    _thread: threading.Thread | None = None
    _wake: tuple[int, int] = (-1, -1)
    _failure: str | None = None

    def __enter__(self) -> Emulator:
        if self.faults.baud and self.faults.baud < 300:
            raise SoftsenseError(f"baud={self.faults.baud:g} is too slow", remedy="300 or more")
        board = read_board(self.board)
        if self.adc is not None and not board.converts:
            raise SoftsenseError(
                f"the emulation of {board.name} has no converter to play a recording into",
                remedy="leave the recording out, or choose another board",
            )
        self._folder = Path(tempfile.mkdtemp(prefix="softsense-"))
        try:
            self._command = self._prepare(board)
            if self.adc is not None:
                (self._folder / "adc.bin").write_bytes(self.adc.astype("<i2").tobytes())
            self._random = np.random.default_rng(self.seed)
            self._listener = self._listen() if self.tcp is not None else None
            self._start()
            self._plug()
            self._wake = os.pipe()
            self._thread = threading.Thread(target=self._relay, name="emulator", daemon=True)
            self._thread.start()
        except BaseException:
            self._clean()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._thread is not None:
            os.write(self._wake[1], b"x")
            self._thread.join()
        self._clean()

    def _prepare(self, board: Board) -> list[str]:
        assert self._folder is not None
        program = build(self.out, board, self._folder / "firmware.elf")
        command = [part.replace("{program}", str(program)) for part in board.run]
        if not command:
            raise SoftsenseError(
                f"board {board.name} has no emulator", remedy="flash a real one, or --board host"
            )
        if shutil.which(command[0]) is None:
            raise SoftsenseError(
                f"the emulator {command[0]} of board {board.name} is not installed",
                remedy="install it, or use --board host",
            )
        return command

    def _listen(self) -> socket.socket:
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("127.0.0.1", self.tcp or 0))
        except OSError as error:
            listener.close()
            raise SoftsenseError(
                f"TCP port {self.tcp} cannot be used: {error.strerror}", remedy="choose another"
            ) from error
        listener.listen(1)
        self.tcp = listener.getsockname()[1]
        return listener

    # -- board and plug ----------------------------------------------------------------------

    def _start(self) -> None:
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=self._folder,
            start_new_session=True,
            bufsize=0,
        )
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()

    _master: int = -1
    _slave: int = -1
    _client: socket.socket | None = None
    _listener: socket.socket | None = None

    def _plug(self) -> None:
        assert self._folder is not None
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        link = self._folder / "port"
        temporary = self._folder / "port.new"
        temporary.symlink_to(os.ttyname(self._slave))
        os.replace(temporary, link)
        self.port = str(link)

    def _unplug(self) -> None:
        if self._folder is not None:
            (self._folder / "port").unlink(missing_ok=True)
        for handle in (self._master, self._slave):
            if handle >= 0:
                os.close(handle)
        self._master = self._slave = -1
        if self._client is not None:
            self._client.close()
            self._client = None

    def _clean(self) -> None:
        self._stop()
        self._unplug()
        if self._listener is not None:
            self._listener.close()
        for handle in self._wake:
            if handle >= 0:
                os.close(handle)
        self._wake = (-1, -1)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    # -- the relay ---------------------------------------------------------------------------

    def _relay(self) -> None:
        """Carries bytes until told to stop. Everything below runs in this one thread."""
        faults = self.faults
        there = Cable(faults, np.random.default_rng([self.seed, 1]))
        back = Cable(faults, np.random.default_rng([self.seed, 2]))
        to_board = b""
        to_client = b""
        now = time.monotonic()
        cut_s = now + self._interval(faults.cut_s)
        reset_s = now + self._interval(faults.reset_s)
        plug_s: float | None = None
        while True:
            process = self._process
            assert process is not None
            assert process.stdin is not None
            assert process.stdout is not None
            into, outof = process.stdin.fileno(), process.stdout.fileno()
            times = [cut_s, reset_s, there.next_s(), back.next_s(), plug_s]
            due = min(moment for moment in times if moment is not None)
            reading = [self._wake[0], outof]
            writing = [into] if to_board else []
            if plug_s is None:
                reading.append(self._master)
                if self._client is not None:
                    reading.append(self._client.fileno())
                elif self._listener is not None:
                    reading.append(self._listener.fileno())
                if to_client:
                    writing.append(self._sink())
            wait = None if due == float("inf") else max(due - time.monotonic(), 0)
            ready, room, _ = select.select(reading, writing, [], wait)
            now = time.monotonic()
            if self._wake[0] in ready:
                return
            if outof in ready:
                data = os.read(outof, _READ)
                if not data:
                    self._explain(process)
                    return
                back.push(data, now)
            for data in self._from_client(ready) if plug_s is None else ():
                there.push(data, now)
            to_board += there.pull(now)
            to_client = (to_client + back.pull(now))[-MOST_WAITING:]
            if into in room:
                to_board = to_board[_write(into, to_board) :]
            if plug_s is None and to_client and self._sink() in room:
                to_client = to_client[_write(self._sink(), to_client) :]
            if now >= reset_s:
                self._stop()
                self._start()
                self.resets += 1
                to_board = b""
                reset_s = now + self._interval(faults.reset_s)
            if plug_s is not None and now >= plug_s:
                self._plug()
                plug_s = None
            elif now >= cut_s:
                self._unplug()
                self.cuts += 1
                there.clear()
                back.clear()
                to_client = b""
                plug_s = now + CUT_S
                cut_s = plug_s + self._interval(faults.cut_s)

    def _interval(self, mean_s: float) -> float:
        return float(self._random.exponential(mean_s)) if mean_s else float("inf")

    def _sink(self) -> int:
        return self._master if self._client is None else self._client.fileno()

    def _from_client(self, ready: list[int]) -> list[bytes]:
        found = []
        if self._master in ready:
            # An error means that nobody has the other end open just now.
            with suppress(OSError):
                found.append(os.read(self._master, _READ))
        if self._client is not None and self._client.fileno() in ready:
            try:
                data = self._client.recv(_READ)
            except OSError:
                data = b""
            if data:
                found.append(data)
            else:
                self._client.close()
                self._client = None
        elif self._listener is not None and self._listener.fileno() in ready:
            self._client, _ = self._listener.accept()
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client.setblocking(False)
        return found

    def _explain(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stderr is not None
        process.wait()
        lines = process.stderr.read().decode("utf-8", "replace").strip().splitlines()
        self._failure = lines[-1] if lines else f"exit code {process.returncode}"
        self._unplug()

    def failure(self) -> str | None:
        """Why the emulated board has stopped; None while it runs."""
        return self._failure


def _write(handle: int, data: bytes) -> int:
    try:
        return os.write(handle, data)
    except BlockingIOError:
        return 0
    except OSError:
        return len(data)  # the other end has gone; its bytes with it


def terminate_on(*numbers: signal.Signals) -> None:
    """Let these signals end the command as Ctrl-C does, so that everything is cleaned up."""

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    for number in numbers:
        signal.signal(number, interrupt)
