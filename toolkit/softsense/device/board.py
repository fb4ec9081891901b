"""Boards: the folders in firmware/ports, and the firmware built for one of them."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softsense.errors import DoesNotFitError, SoftsenseError, too_large

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def firmware_folder() -> Path:
    """The firmware sources: within the wheel, or beside ``toolkit/`` in a checkout.

    Raises ``SoftsenseError`` where they are in neither place.
    """
    here = Path(__file__).resolve()
    for folder in (here.parents[1] / "firmware", here.parents[3] / "firmware"):
        if (folder / "include" / "port.h").is_file():
            return folder
    raise SoftsenseError(
        "the firmware sources are not installed", where=str(here), remedy="reinstall softsense"
    )


@dataclass(frozen=True)
class Board:
    """One folder of firmware/ports: how to compile for it, and how to run or flash the result."""

    name: str
    description: str
    compiler: str
    flags: tuple[str, ...]
    link_flags: tuple[str, ...]
    sources: tuple[str, ...]
    run: tuple[str, ...]
    flash: tuple[str, ...]

    @property
    def usable(self) -> bool:
        """Whether this machine can compile for it and emulate it."""
        needed = [self.compiler, *self.run[:1]]
        return bool(self.run) and all(
            tool == "{program}" or shutil.which(tool) is not None for tool in needed
        )

    @property
    def converts(self) -> bool:
        """Whether a recording can be played into the converter of its emulation."""
        return self.run == ("{program}",) or any("semihosting" in part for part in self.run)


@dataclass(frozen=True)
class Network:
    """What a client must know of one network: from manifest.json or from the board itself."""

    name: str
    digest: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    scales: tuple[tuple[float, float], ...]  # (lsb, zero) per output


def boards() -> list[Board]:
    """All boards, by name."""
    return [read_board(name) for name in board_names()]


def board_names() -> list[str]:
    """Names of all boards."""
    return sorted(path.parent.name for path in firmware_folder().glob("ports/*/board.mk"))


def read_board(name: str) -> Board:
    """The board in ``firmware/ports/<name>``. Raises ``SoftsenseError`` for an unknown one."""
    if name not in board_names():
        raise SoftsenseError(
            f"there is no board {name!r}", remedy=f"boards are {', '.join(board_names())}"
        )
    values: dict[str, str] = {}
    path = firmware_folder() / "ports" / name / "board.mk"
    for line in path.read_text(encoding="utf-8").splitlines():
        key, equals, value = line.partition("=")
        if equals and not line.startswith("#"):
            values[key.strip()] = value.strip()
    try:
        return Board(
            name=name,
            description=values["DESCRIPTION"],
            compiler=values["CC"],
            flags=tuple(shlex.split(values["CFLAGS"])),
            link_flags=tuple(shlex.split(values["LDFLAGS"])),
            sources=tuple(shlex.split(values["SOURCES"])),
            run=tuple(shlex.split(values["RUN"])),
            flash=tuple(shlex.split(values["FLASH"])),
        )
    except KeyError as error:
        raise SoftsenseError(f"{error.args[0]} is missing", where=str(path)) from error


def read_manifest(out: Path) -> dict[str, Any]:
    """manifest.json of an export folder. Raises ``SoftsenseError`` where it is none."""
    path = out / "manifest.json"
    try:
        manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SoftsenseError(
            f"cannot be read: {error.strerror or error}",
            where=str(path),
            remedy="give the folder that softsense build or export has written",
        ) from error
    except ValueError as error:
        raise SoftsenseError(f"is not JSON: {error}", where=str(path)) from error
    for key in ("name", "digest", "inputs", "outputs"):
        if key not in manifest:
            raise SoftsenseError(f"{key!r} is missing", where=str(path), remedy="export it again")
    return manifest


def networks(out: Path) -> list[Network]:
    """The primary network of an export folder, then its fallbacks, best first."""
    manifest = read_manifest(out)
    return [_network(entry, out) for entry in (manifest, *manifest.get("fallbacks", ()))]


def _network(entry: dict[str, Any], out: Path) -> Network:
    outputs = entry["outputs"]
    name = str(entry["name"])
    if not _NAME.match(name):
        raise SoftsenseError(f"{name!r} is not a C identifier", where=str(out / "manifest.json"))
    return Network(
        name=name,
        digest=str(entry["digest"]),
        inputs=tuple(str(item["name"]) for item in entry["inputs"]),
        outputs=tuple(str(item["name"]) for item in outputs),
        units=tuple(str(item["unit"]) for item in outputs),
        scales=tuple((float(item["lsb"]), float(item.get("zero", 0))) for item in outputs),
    )


def build(out: Path, board: Board, target: Path) -> Path:
    """Compile the firmware with the networks of ``out`` for ``board``; returns ``target``.

    Raises ``SoftsenseError`` where the compiler is missing or refuses, ``DoesNotFitError`` where
    the board is too small.
    """
    if shutil.which(board.compiler) is None:
        raise SoftsenseError(
            f"the compiler {board.compiler} of board {board.name} is not installed",
            remedy="install it, or use --board host",
        )
    firmware = firmware_folder()
    command = [board.compiler, *board.flags, *WARNINGS, f'-DPORT_NAME="{board.name}"', "-Iinclude"]
    command += _model_flags(out)
    command += [str(path.relative_to(firmware)) for path in sorted(firmware.glob("src/*.c"))]
    command += [*board.sources, *board.link_flags, "-o", str(target)]
    done = subprocess.run(command, cwd=firmware, capture_output=True, text=True, check=False)
    if too_large(done.stderr):
        raise DoesNotFitError(
            f"the networks do not fit on {board.name}",
            where=f"firmware for {board.name}",
            remedy="use --optimise size, fewer hidden units or no fallbacks, or a larger board",
        )
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line or "will not" in line]
        raise SoftsenseError(
            f"{board.compiler} refuses: {(lines or [done.stderr.strip()[-200:]])[0]}",
            where=f"firmware for {board.name}",
            remedy="check that the export folder is whole",
        )
    return target


def _model_flags(out: Path) -> list[str]:
    out = out.resolve()
    flags = [f"-I{out}"]
    models = ""
    selftest = True
    bits = adc_bits(out)
    for network in networks(out):
        for needed in (f"{network.name}.h", f"{network.name}.c"):
            if not (out / needed).is_file():
                raise SoftsenseError(
                    "is missing", where=str(out / needed), remedy="export the model again"
                )
        scales = ",".join(f"{lsb!r}:{zero!r}" for lsb, zero in network.scales)
        models += f'MODEL({network.name},"{scales}")'
        flags += ["-include", f"{network.name}.h", str(out / f"{network.name}.c")]
        vectors = out / f"{network.name}_vectors.h"
        selftest = selftest and vectors.is_file() and "_vector_x" in vectors.read_text("utf-8")
    if selftest:
        flags.append("-DSOFTSENSE_SELF_TEST")
        for network in networks(out):
            flags += ["-include", f"{network.name}_vectors.h"]
    return [*flags, f"-DSOFTSENSE_MODELS={models}", f"-DSOFTSENSE_HIGHEST_CODE={2**bits - 1}"]


def channels(networks: list[Network]) -> tuple[str, ...]:
    """Sensors in the order in which the firmware wants them from the converter."""
    return tuple(dict.fromkeys(name for network in networks for name in network.inputs))


def adc_bits(out: Path) -> int:
    """Word length of the codes that the model was trained with, from its front ends."""
    return code_bits(str(entry.get("front_end", "")) for entry in read_manifest(out)["inputs"])


def code_bits(front_ends: Iterable[str]) -> int:
    """Word length of the codes behind ``front_ends``, as they describe themselves; else 12."""
    found = [re.search(r"(\d+)(?:-bit| bits)", text) for text in front_ends]
    return max((int(match[1]) for match in found if match), default=12)
