"""Live estimates: in the terminal, as a local web page, or as CSV rows."""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from softsense.device.client import Device, physical
from softsense.device.feeder import read_truth as read_recording
from softsense.device.framing import Flag
from softsense.device.news import Console
from softsense.device.transport import now_s
from softsense.errors import SoftsenseError

CHART_COLUMNS = 72
CHART_ROWS = 12
_PAGE = Path(__file__).with_name("monitor.html")


@dataclass(frozen=True)
class Row:
    """One sample for people: estimates and truth in the outputs' units."""

    t_s: float
    estimates: tuple[float, ...]
    truth: tuple[float, ...]
    codes: tuple[int, ...]
    network: str
    flags: tuple[str, ...]
    failed: tuple[str, ...]
    uncalibrated: tuple[str, ...]


def read_truth(args: argparse.Namespace) -> list[tuple[float, ...]]:
    """The truth of every row of the recording that plays in the emulator; empty without one."""
    if args.truth is None:
        return []
    recording = read_recording(args.model, args.truth, args.target)
    return [tuple(float(value) for value in row) for row in recording.target]


@dataclass
class Feed:
    """Samples of a device as ``Row``; the truth is that of the conversion's row."""

    device: Device
    rate_hz: float
    seconds: float | None
    truth: list[tuple[float, ...]]

    def __iter__(self) -> Iterator[Row]:
        identity = self.device.identity
        self.device.stream(self.rate_hz)
        started = now_s()
        time_us = 0
        before: int | None = None
        for sample in self.device.watch():
            if before is not None:
                time_us += (sample.time_us - before) & 0xFFFFFFFF
            before = sample.time_us
            network = identity.networks[sample.network]
            yield Row(
                t_s=time_us * 1e-6,
                estimates=tuple(physical(network, sample.estimate)),
                truth=self.truth[sample.conversion % len(self.truth)] if self.truth else (),
                codes=sample.codes,
                network=network.name,
                flags=tuple(str(flag.name).lower() for flag in Flag if flag in sample.flags),
                failed=_named(sample.failed, identity.channels),
                uncalibrated=_named(sample.uncalibrated, network.inputs),
            )
            if self.seconds is not None and now_s() - started >= self.seconds:
                return


def _named(mask: int, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for bit, name in enumerate(names) if mask >> bit & 1)


def rows(feed: Feed, path: str) -> None:
    """CSV rows to a file, or stdout for "-"."""
    identity = feed.device.identity
    outputs = identity.networks[0].outputs
    truth = [f"{name}_truth" for name in outputs] if feed.truth else []
    header = ["t_s", *outputs, *truth, *identity.channels, "network", "flags", "failed"]
    try:
        with ExitStack() as stack:
            file = sys.stdout
            if path != "-":
                file = stack.enter_context(Path(path).open("w", encoding="utf-8"))
            print(",".join(header), file=file, flush=True)
            for row in feed:
                numbers = [f"{value:.9g}" for value in (*row.estimates, *row.truth)]
                words = [row.network, " ".join(row.flags), " ".join(row.failed)]
                cells = [f"{row.t_s:.6f}", *numbers, *map(str, row.codes), *words]
                print(",".join(cells), file=file, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise SoftsenseError(f"cannot write: {error.strerror}", where=path) from error


def chart(values: list[float], truth: list[float], columns: int, height: int) -> list[str]:
    """Lines of text: the estimate as a solid dot, the truth as a small one."""
    both = [*values, *truth]
    low, high = min(both), max(both)
    span = (high - low) or 1.0
    grid = [[" "] * columns for _ in range(height)]
    for series, mark in ((truth, "·"), (values, "●")):
        for column, value in enumerate(series[-columns:]):
            line = round((high - value) / span * (height - 1))
            grid[line][column] = mark
    labels = [f"{high - span * line / (height - 1):10.4g} ┤" for line in range(height)]
    return [label + "".join(line) for label, line in zip(labels, grid, strict=True)]


def terminal(feed: Feed) -> None:
    """A plot of the first output and a bar per sensor, redrawn in place."""
    from rich.console import Console as RichConsole
    from rich.live import Live
    from rich.text import Text

    identity = feed.device.identity
    primary = identity.networks[0]
    values: deque[float] = deque(maxlen=CHART_COLUMNS)
    truth: deque[float] = deque(maxlen=CHART_COLUMNS)
    screen = RichConsole()
    unit = "" if primary.units[0] == "1" else f" {primary.units[0]}"

    def draw(row: Row) -> Text:
        text = Text()
        text.append(f"{primary.outputs[0]} {row.estimates[0]:.5g}{unit}", style="bold")
        if row.truth:
            text.append(f"   truth {row.truth[0]:.5g}{unit}", style="dim")
        text.append(f"   {row.t_s:.1f} s   network {row.network}\n")
        lines = chart(list(values), list(truth), CHART_COLUMNS, CHART_ROWS)
        text.append("\n".join(lines) + "\n")
        for name, code in zip(identity.channels, row.codes, strict=True):
            bar = "█" * max(min(round(code / 4096 * 40), 40), 0)
            text.append(f"{name:>10} {code:6d} {bar}")
            if name in row.failed:
                text.append("  failed", style="bold red")
            elif name in row.uncalibrated:
                text.append("  outside its calibrated range", style="yellow")
            text.append("\n")
        if "untrusted" in row.flags:
            text.append("no network does without the failed sensor\n", style="bold red")
        elif "fallback" in row.flags:
            text.append(f"fallback network {row.network} answers\n", style="yellow")
        return text

    with Live(console=screen, refresh_per_second=10, transient=False) as live:
        for row in feed:
            values.append(row.estimates[0])
            truth.extend(row.truth[:1])
            live.update(draw(row))


def web(feed: Feed, port: int, console: Console) -> None:
    """A page on 127.0.0.1 with a live chart; prints its address, runs until Ctrl-C."""
    watchers: set[queue.Queue[str]] = set()
    lock = threading.Lock()
    identity = feed.device.identity
    about = json.dumps(
        {
            "outputs": identity.networks[0].outputs,
            "units": identity.networks[0].units,
            "channels": identity.channels,
            "board": identity.board,
        }
    )

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path == "/":
                self._whole("text/html; charset=utf-8", _PAGE.read_bytes())
            elif self.path == "/about":
                self._whole("application/json", about.encode())
            elif self.path == "/events":
                self._events()
            else:
                self.send_error(404)

        def _whole(self, kind: str, body: bytes) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def _events(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            mine: queue.Queue[str] = queue.Queue(maxsize=1000)
            with lock:
                watchers.add(mine)
            try:
                while True:
                    self.wfile.write(f"data: {mine.get()}\n\n".encode())
                    self.wfile.flush()
            except OSError:
                return  # the page was closed
            finally:
                with lock:
                    watchers.discard(mine)

        def log_message(self, format: str, *args: Any) -> None:
            return

    try:
        server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
    except OSError as error:
        raise SoftsenseError(
            f"TCP port {port} cannot be used: {error.strerror}", remedy="choose another"
        ) from error
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        print(f"http://127.0.0.1:{server.server_address[1]}/", flush=True)
        for row in feed:
            text = json.dumps(row.__dict__)
            with lock:
                for watcher in watchers:
                    if not watcher.full():
                        watcher.put(text)
    finally:
        server.shutdown()
        server.server_close()
