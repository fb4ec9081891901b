"""What ``softsense device`` does, one function per action."""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.device import connect
from softsense.device.board import build, networks, read_board
from softsense.device.client import CHOOSE, Device, physical
from softsense.device.framing import Flag
from softsense.device.news import Console
from softsense.device.transport import now_s, ports
from softsense.errors import SoftsenseError


def _connect(args: argparse.Namespace) -> Device:
    return connect(args.model, args.port, baud=args.baud, patience_s=args.patience, seed=args.seed)


def list_ports(args: argparse.Namespace, console: Console) -> int:
    """Serial ports that answer in this protocol."""
    found: list[dict[str, str]] = []
    silent = 0
    for path, description in ports():
        try:
            with connect(None, path, baud=args.baud, patience_s=min(args.patience, 1.0)) as device:
                identity = device.identity
                found.append(
                    {"port": path, "model": identity.networks[0].name, "board": identity.board}
                )
        except SoftsenseError as error:
            silent += 1
            console.say(f"{path} ({description}): {error.what}")
    if args.json:
        print(json.dumps(found))
    elif found:
        console.table(
            ("port", "model", "board"), [(f["port"], f["model"], f["board"]) for f in found]
        )
    else:
        print(f"no port answers ({silent} tried); softsense emulate OUT makes one")
    return 0


def ping(args: argparse.Namespace, console: Console) -> int:
    """Round-trip times."""
    with _connect(args) as device:
        trips = [device.ping() * 1e3 for _ in range(max(args.count, 1))]
        name, board = device.identity.networks[0].name, device.identity.board
    result = {
        "model": name,
        "board": board,
        "requests": len(trips),
        "ms": {"min": min(trips), "median": float(np.median(trips)), "max": max(trips)},
    }
    if args.json:
        print(json.dumps(result))
    else:
        print(
            f"{name} on {board}: {len(trips)} answers, round trip "
            f"{min(trips):.2f} / {np.median(trips):.2f} / {max(trips):.2f} ms (min/median/max)"
        )
    return 0


def info(args: argparse.Namespace, console: Console) -> int:
    """What the board holds."""
    with _connect(args) as device:
        identity, statistics = device.identity, device.statistics()
        tests = [device.self_test(number) for number in range(len(identity.networks))]
    if args.json:
        document = asdict(identity) | {"digest": identity.digest, "statistics": statistics}
        document["self_test"] = [{"compared": n, "mismatches": bad} for n, bad in tests]
        print(json.dumps(document))
        return 3 if any(bad for _, bad in tests) else 0
    print(
        f"board      {identity.board}, firmware {identity.firmware}, protocol {identity.protocol}"
    )
    link = f"{identity.baud} baud" if identity.baud else "no baud rate"
    print(f"link       {link}, frames of {identity.frame_bytes} bytes")
    print(f"channels   {', '.join(identity.channels)}")
    for number, network in enumerate(identity.networks):
        print(f"network {number}  {network.name}, digest {network.digest}")
        print(f"  inputs   {', '.join(network.inputs)}")
        for name, unit, scale in zip(network.outputs, network.units, network.scales, strict=True):
            print(f"  output   {name}: (y - {scale[1]:g}) * {scale[0]:.9g} in {unit}")
        compared, bad = tests[number]
        if compared:
            print(f"  self-test  {bad} mismatches of {compared} vectors in flash")
    print(f"statistics {', '.join(f'{key} {value}' for key, value in statistics.items())}")
    return 3 if any(bad for _, bad in tests) else 0


def _rows(args: argparse.Namespace, columns: tuple[str, ...]) -> NDArray[np.int16]:
    """Rows of codes from the command line, a CSV or stdin."""
    if args.csv is None:
        if not args.codes:
            raise SoftsenseError("no codes were given", remedy="CODE CODE … or --csv FILE")
        rows = [args.codes]
        where = "command line"
    else:
        where = "stdin" if args.csv == "-" else args.csv
        rows = list(_read_csv(args.csv, where, columns))
    for number, row in enumerate(rows):
        if len(row) != len(columns):
            raise SoftsenseError(
                f"{len(row)} codes instead of {len(columns)}",
                where=where,
                remedy=f"one code each for {', '.join(columns)}",
            )
        for code in row:
            if not -0x8000 <= code <= 0x7FFF:
                raise SoftsenseError(
                    f"code {code} does not fit int16", where=f"{where}, row {number + 1}"
                )
    return np.array(rows, np.int16).reshape(-1, len(columns))


def _read_csv(path: str, where: str, columns: tuple[str, ...]) -> Iterator[list[int]]:
    try:
        text = sys.stdin.read() if path == "-" else Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SoftsenseError(
            f"cannot be read: {error.strerror}", where=where, remedy="check the path"
        ) from error
    reader = csv.DictReader(text.splitlines())
    names = [name.strip() for name in reader.fieldnames or ()]
    reader.fieldnames = names
    for column in columns:
        if column not in names:
            raise SoftsenseError(
                f"there is no column {column!r}", where=where, remedy=f"it has {', '.join(names)}"
            )
    for number, row in enumerate(reader):
        try:
            yield [int(row[column]) for column in columns]
        except (ValueError, TypeError) as error:
            raise SoftsenseError(
                "is not a row of integer codes",
                where=f"{where}, row {number + 2}",
                remedy="physical values must pass the model's front end first",
            ) from error


def estimate(args: argparse.Namespace, console: Console) -> int:
    """Estimates for given codes."""
    with _connect(args) as device:
        identity = device.identity
        columns = identity.channels if args.health else identity.networks[0].inputs
        codes = _rows(args, columns)
        # One row per answer, so that every row has its own flags.
        verdicts = list(device.verdicts(codes, CHOOSE if args.health else 0, 1))
    documents = []
    for verdict in verdicts:
        network = identity.networks[verdict.network]
        values = physical(network, verdict.estimate[0])
        documents.append(
            {
                "estimate": dict(zip(network.outputs, values, strict=True)),
                "raw": verdict.estimate[0].tolist(),
                "network": network.name,
                "flags": flag_names(verdict.flags),
                "uncalibrated": named(verdict.uncalibrated, network.inputs),
                "failed": named(verdict.failed, identity.channels),
            }
        )
    if args.json:
        print(json.dumps(documents))
        return 0
    primary = identity.networks[0]
    units = [
        name if unit == "1" or name.endswith(f"_{unit}") else f"{name}_{unit}"
        for name, unit in zip(primary.outputs, primary.units, strict=True)
    ]
    print(",".join([*units, "network", "flags"]))
    for verdict, document in zip(verdicts, documents, strict=True):
        values = physical(identity.networks[verdict.network], verdict.estimate[0])
        cells = [f"{value:.9g}" for value in values]
        print(",".join([*cells, str(document["network"]), " ".join(document["flags"])]))
    return 0


def flag_names(flags: Flag) -> list[str]:
    """Flags as words."""
    return [str(flag.name).lower() for flag in Flag if flag in flags]


def named(mask: int, names: tuple[str, ...]) -> list[str]:
    """Names whose bit is set."""
    return [name for bit, name in enumerate(names) if mask >> bit & 1]


def flash(args: argparse.Namespace, console: Console) -> int:
    """Build the firmware and put it on a board."""
    import subprocess
    import tempfile

    board = read_board(args.board)
    models = networks(args.out)
    with tempfile.TemporaryDirectory(prefix="softsense-") as folder:
        program = build(args.out, board, Path(folder) / "firmware.elf")
        if not board.flash:
            # An emulated board is loaded at its start: show that this image starts and answers.
            with connect(args.out, f"emulate:{board.name}", patience_s=args.patience) as device:
                identity = device.identity
            message = f"{identity.networks[0].name} loads and answers on {board.name}"
        else:
            replace = {"{program}": str(program), "{port}": args.port}
            command = [_substitute(part, replace) for part in board.flash]
            console.say(" ".join(command))
            try:
                done = subprocess.run(command, capture_output=True, text=True, check=False)
            except FileNotFoundError as error:
                raise SoftsenseError(
                    f"{command[0]} is not installed", remedy="install the board's flash tool"
                ) from error
            if done.returncode:
                lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
                raise SoftsenseError(f"{command[0]}: {lines[-1]}", where=args.board)
            message = f"{models[0].name} is on {board.name}"
    document: dict[str, Any] = {"board": board.name, "digest": models[0].digest}
    print(json.dumps(document) if args.json else message)
    return 0


def _substitute(part: str, values: dict[str, str]) -> str:
    for name, value in values.items():
        part = part.replace(name, value)
    return part


def verify(args: argparse.Namespace, console: Console) -> int:
    """Compare bit for bit with the reference, with throughput."""
    from softsense.device.checking import vectors

    codes, wanted = vectors(args.out, args.vectors, args.seed)
    args.model = args.out
    with _connect(args) as device, console.progress("vectors", len(codes)) as advance:
        started = now_s()
        got = device.estimate(codes, advance=advance)
        seconds = now_s() - started
        counters = device.counters
    bad = np.flatnonzero((got != wanted).any(axis=1))
    result = {
        "compared": len(codes),
        "mismatches": len(bad),
        "seconds": seconds,
        "estimates_per_second": len(codes) / seconds,
        "retries": counters.retries,
        "resets": counters.resets,
    }
    if args.json:
        print(json.dumps(result))
    else:
        print(
            f"{len(bad)} mismatches of {len(codes)}; {len(codes) / seconds:.0f} estimates/s, "
            f"{counters.retries} retries, {counters.resets} resets"
        )
        if len(bad):
            first = int(bad[0])
            print(
                f"first: codes {codes[first].tolist()} give {got[first].tolist()}, not "
                f"{wanted[first].tolist()}"
            )
    return 3 if len(bad) else 0


def record(args: argparse.Namespace, console: Console) -> int:
    """Raw codes to a recording."""
    from softsense.device.recorder import record as run

    with _connect(args) as device:
        rows = run(device, args.output, args.rate, args.seconds, args.resume, console.say)
    print(json.dumps({"rows": rows}) if args.json else f"{rows} rows in {args.output}")
    return 0


def monitor(args: argparse.Namespace, console: Console) -> int:
    """Live estimates."""
    from softsense.device import monitor as views

    with _connect(args) as device:
        feed = views.Feed(device, args.rate, args.seconds, views.read_truth(args))
        try:
            if args.web is not None:
                views.web(feed, args.web, console)
            elif args.csv is not None:
                views.rows(feed, args.csv)
            else:
                views.terminal(feed)
        except KeyboardInterrupt:
            return 0
    return 0
