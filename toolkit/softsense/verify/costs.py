"""What the generated C costs on each target whose compiler is here: flash, RAM, time."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from softsense.errors import DoesNotFitError, SoftsenseError, too_large
from softsense.verify.instructions import CORES, countable, of_estimate, size_tool

# name, compiler, flags. Sizes are of NAME.c alone; it needs no library.
TARGETS = (
    ("Cortex-M0+", "arm-none-eabi-gcc", "-mcpu=cortex-m0plus -mthumb"),
    ("Cortex-M3", "arm-none-eabi-gcc", "-mcpu=cortex-m3 -mthumb"),
    (
        "Cortex-M4F",
        "arm-none-eabi-gcc",
        "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
    ),
    ("RISC-V rv32imac", "riscv64-unknown-elf-gcc", "-march=rv32imac -mabi=ilp32"),
    # Its constants stay in flash with GNU's extensions only.
    ("AVR ATmega328P", "avr-gcc", "-mmcu=atmega328p -std=gnu99"),
    ("host", "gcc", ""),
)

HEADER = ("core", "flash", "static RAM", "stack", "per estimate")


@dataclass(frozen=True)
class Cost:
    """Bytes on one target: ``flash`` (code and constants), ``ram`` (static), ``stack``.

    ``instructions`` or ``cycles`` of one estimate, None where no emulator here counts them.
    """

    target: str
    flash: int
    ram: int
    stack: int
    instructions: int | None = None
    cycles: int | None = None

    @property
    def work(self) -> int | None:
        """Cycles where they are counted, else instructions."""
        return self.instructions if self.cycles is None else self.cycles

    @property
    def time(self) -> str:
        """What one estimate takes, with its unit; empty where it is not counted."""
        if self.work is None:
            return ""
        return f"{self.work} {'instructions' if self.cycles is None else 'cycles'}"

    @property
    def line(self) -> str:
        """For the header."""
        counted = f", {self.time}" if self.time else ""
        return f"{self.target}: {self.flash} bytes of flash, {self.stack} of stack{counted} (-O2)"

    @property
    def row(self) -> tuple[str, ...]:
        """For tables, under ``HEADER``."""
        sizes = (f"{self.flash} B", f"{self.ram} B", f"{self.stack} B")
        return (self.target, *sizes, self.time or "-")


def measure_costs(source: Path, only: str | None = None) -> tuple[Cost, ...]:
    """Compile ``source`` (NAME.c, beside NAME.h) with -O2 for every target that can be.

    ``only``: for this one of ``TARGETS``. A core that cannot address the weights is left out;
    where only its memory is too small for them, what an estimate takes is not counted.

    Raises ``SoftsenseError`` where a compiler refuses it.
    """
    costs = []
    for target, compiler, flags in TARGETS:
        if only not in (None, target):
            continue
        if shutil.which(compiler) is None or shutil.which(size_tool(compiler)) is None:
            continue
        with tempfile.TemporaryDirectory(prefix="softsense-") as scratch:
            made = Path(scratch) / "unit.o"
            command = [
                compiler,
                "-std=c99",
                "-ffreestanding",
                "-O2",
                *flags.split(),
                "-fstack-usage",
            ]
            command += [
                "-fno-asynchronous-unwind-tables",
                "-c",
                str(source.resolve()),
                "-o",
                str(made),
            ]
            done = subprocess.run(command, capture_output=True, text=True, cwd=scratch)
            if too_large(done.stderr):
                continue
            if done.returncode != 0:
                said = done.stderr.strip().splitlines()[0]
                raise SoftsenseError(f"{compiler} refuses it: {said}", where=str(source))
            sizes = subprocess.run(
                [size_tool(compiler), "-A", str(made)], capture_output=True, text=True, check=True
            ).stdout
            usage = made.with_suffix(".su").read_text()
        work = {}
        if countable(target):
            with suppress(DoesNotFitError):
                work[CORES[target].unit] = round(of_estimate(target, source).work)
        costs.append(Cost(target, *_sections(sizes), _stack(usage), **work))
    return tuple(costs)


def _sections(sizes: str) -> tuple[int, int]:
    flash = ram = 0
    for name, size in re.findall(r"^(\.\S+)\s+(\d+)", sizes, re.MULTILINE):
        if name.startswith((".text", ".rodata", ".progmem", ".data")):
            flash += int(size)
        if name.startswith((".data", ".bss")):
            ram += int(size)
    return flash, ram


def _stack(usage: str) -> int:
    return max((int(row.split("\t")[1]) for row in usage.splitlines()), default=0)
