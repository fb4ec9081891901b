"""Recordings from a board: raw codes and device time, safe against a kill at any moment."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from softsense.device.client import Device
from softsense.device.transport import now_s
from softsense.errors import SoftsenseError
from softsense.recording import TIME_COLUMN

FLUSH_S = 0.5


def record(
    device: Device,
    path: Path,
    rate_hz: float,
    seconds: float | None,
    resume: bool,
    say: Callable[[str], None],
) -> int:
    """Append the device's samples to ``path`` until Ctrl-C or ``seconds``; returns the rows in it.

    Time is the device's. Where samples are lost (a bad cable, a reset, a pause before --resume)
    the clock is closed up, so that it stays uniform, and the gaps are counted and told: rows on
    either side of one are not neighbours. A half-written last line is removed on resume.
    """
    header = ",".join([TIME_COLUMN, *device.identity.channels])
    rows, clock_s = _begin(path, header, resume)
    gaps = 0
    try:
        with path.open("a", encoding="utf-8") as file:
            device.stream(rate_hz)
            started = flushed = now_s()
            before: int | None = None
            step_s = 1 / rate_hz
            for sample in device.watch():
                if before is None:
                    clock_s += step_s if rows else 0.0
                else:
                    passed_s = ((sample.time_us - before) & 0xFFFFFFFF) * 1e-6
                    lost = abs(passed_s - step_s) > 0.1 * step_s
                    gaps += lost
                    clock_s += step_s if lost else passed_s
                before = sample.time_us
                file.write(f"{clock_s:.6f},{','.join(map(str, sample.codes))}\n")
                rows += 1
                if now_s() - flushed > FLUSH_S:
                    file.flush()
                    os.fsync(file.fileno())
                    flushed = now_s()
                if seconds is not None and now_s() - started >= seconds:
                    break
    except KeyboardInterrupt:
        say("stopped")
    if gaps:
        say(f"{gaps} gaps were closed up: samples were lost there")
    return rows


def _begin(path: Path, header: str, resume: bool) -> tuple[int, float]:
    """Rows already there and the time of the last one."""
    if not path.exists() or path.stat().st_size == 0:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(header + "\n", encoding="utf-8")
        except OSError as error:
            raise SoftsenseError(f"cannot write: {error.strerror}", where=str(path)) from error
        return 0, 0.0
    if not resume:
        raise SoftsenseError("is there already", where=str(path), remedy="--resume goes on with it")
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    lines = whole.splitlines()
    if not lines or lines[0] != header:
        raise SoftsenseError(
            f"its columns are not {header}", where=str(path), remedy="record to another file"
        )
    if whole != text:
        with path.open("r+", encoding="utf-8") as file:
            file.truncate(len(whole.encode("utf-8")))
    if len(lines) == 1:
        return 0, 0.0
    return len(lines) - 1, float(lines[-1].split(",")[0])
