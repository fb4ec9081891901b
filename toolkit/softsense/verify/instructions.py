"""Instructions or cycles per inference on emulated cores, counted deterministically.

QEMU with ``-icount shift=0`` advances virtual time by 1 ns per instruction: a Cortex-M's SysTick at
the board's 25 MHz then ticks every 40 instructions, and RISC-V's minstret counts them one by one.
simavr is accurate to the cycle: timer 1 of an ATmega328P at an eighth of its clock. Many inferences
between two readings, less the empty loop, give the count to a fraction of a percent. The C and
linker scripts of the cores are in ``cores/``.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from softsense.errors import DoesNotFitError, SoftsenseError, too_large

HERE = Path(__file__).parent / "cores"
QEMU_ARM = "-nographic -icount shift=0 -semihosting-config enable=on,target=native -monitor none"
QEMU_RISCV = "-M virt -m 8M -bios none -nographic -icount shift=0 -monitor none"
SECONDS = 120

Unit = Literal["instructions", "cycles"]


@dataclass(frozen=True)
class Core:
    """How to compile for a core and run there.

    ``files``: stem of its C (and linker script, if any) in ``cores/``; ``emulator``: the command
    that the image's path completes; ``tick``: instructions or cycles per tick of its counter;
    ``calls`` timed, on so many different ``rows`` of inputs (a power of two) as its RAM holds.
    """

    compiler: str
    flags: str
    files: str
    emulator: str
    tick: int
    unit: Unit = "instructions"
    calls: int = 256
    rows: int = 64


def _cortex(machine: str, flags: str) -> Core:
    emulator = f"qemu-system-arm -M {machine} {QEMU_ARM} -kernel"
    return Core("arm-none-eabi-gcc", f"{flags} -mthumb -std=gnu11", "cortexm", emulator, 40)


# ARMv6-M code runs unchanged on the Cortex-M3 machine.
CORES = {
    "Cortex-M0+": _cortex("mps2-an385", "-mcpu=cortex-m0plus"),
    "Cortex-M3": _cortex("mps2-an385", "-mcpu=cortex-m3"),
    "Cortex-M4F": _cortex("mps2-an386", "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard"),
    "Cortex-M7": _cortex("mps2-an500", "-mcpu=cortex-m7 -mfpu=fpv4-sp-d16 -mfloat-abi=hard"),
    "RISC-V rv32imac": Core(
        "riscv64-unknown-elf-gcc",
        "-march=rv32imac -mabi=ilp32 -mcmodel=medany -std=gnu11 --specs=picolibc.specs",
        "riscv",
        f"qemu-system-riscv32 {QEMU_RISCV} -kernel",
        1,
    ),
    "AVR ATmega328P": Core(
        "avr-gcc",
        "-mmcu=atmega328p -std=gnu11",
        "avr",
        "simavr -m atmega328p -f 16000000",
        8,
        "cycles",
        calls=32,
        rows=8,
    ),
}


@dataclass(frozen=True)
class Count:
    """What one call takes.

    ``work`` in the core's unit; ``flash`` and ``ram``: bytes of code and constants, and of static
    data, of the sources' objects; ``image``: bytes of code and constants of the linked program,
    with what it needs of libraries and the program around.
    """

    work: float
    flash: int
    ram: int
    image: int


def countable(core: str) -> bool:
    """Whether this machine can count on ``core``."""
    if core not in CORES:
        return False
    compiler, emulator = CORES[core].compiler, CORES[core].emulator.split()[0]
    return all(shutil.which(tool) for tool in (compiler, size_tool(compiler), emulator))


def of_estimate(core: str, source: Path) -> Count:
    """The work of one NAME_estimate() of ``source`` (NAME.c beside NAME.h), over its range."""
    name = source.stem
    text = source.with_suffix(".h").read_text(encoding="utf-8")
    found = re.search(rf"#define {name}_INPUTS (\d+)", text)
    if found is None:
        raise SoftsenseError(f"does not define {name}_INPUTS", where=f"{name}.h")
    number = CORES[core].rows
    rows = ", ".join(
        "{"
        + ", ".join(
            # Sensors sweep their ranges at different paces.
            f"(int16_t)({name}_INPUT{i}_LOW + (int32_t)({name}_INPUT{i}_HIGH - "
            f"(int32_t){name}_INPUT{i}_LOW) * {j * (64 // number) * (2 * i + 1) % 64} / 63)"
            for i in range(int(found[1]))
        )
        + "}"
        for j in range(number)
    )
    setup = f'#include "{name}.h"\nstatic const int16_t x[{number}][{name}_INPUTS] = {{{rows}}};\n'
    setup += f"static int32_t y[{name}_OUTPUTS];\n"
    return count(core, [source], setup, f"{name}_estimate(x[i % {number}u], y); sink = y[0]")


def count(
    core: str,
    sources: list[Path],
    setup: str,
    call: str,
    libraries: tuple[str, ...] = (),
) -> Count:
    """The work of the C statement ``call``, which may use ``i`` (0, 1, …).

    ``setup``: C before ``main`` (includes, inputs). The cost of the loop around is subtracted.

    Raises ``DoesNotFitError`` where the core's memory is too small, ``SoftsenseError`` where the
    program does not link or does not come to its end.
    """
    how = CORES[core]
    script = HERE / f"{how.files}.ld"
    linking = ["-Wl,--gc-sections", *libraries, "-lgcc"]
    if script.exists():
        linking = ["-nostartfiles", "-T", str(script), *linking]
    with tempfile.TemporaryDirectory(prefix="count-") as scratch:
        folder = Path(scratch)
        main = folder / "main.c"
        main.write_text(
            f"{(HERE / f'{how.files}.c').read_text()}\n{setup}\n"
            f"#define CALLS {how.calls}u\n#define CALL {call}\n{(HERE / 'main.c').read_text()}"
        )
        cc = [how.compiler, *how.flags.split(), "-O2", "-ffreestanding"]
        cc += ["-ffunction-sections", "-fdata-sections"]
        objects: list[str] = []
        flash = ram = 0
        for source in sources:
            made = folder / f"{source.stem}.o"
            subprocess.run([*cc, "-c", str(source.resolve()), "-o", str(made)], check=True)
            objects.append(str(made))
            sizes = _sizes(how.compiler, made)
            flash, ram = flash + sizes[0], ram + sizes[1]
        include = [f"-I{source.resolve().parent}" for source in sources]
        image = folder / "image.elf"
        linked = subprocess.run(
            [*cc, *include, str(main), *objects, "-o", str(image), *linking],
            capture_output=True,
            text=True,
        )
        if linked.returncode != 0:
            if too_large(linked.stderr):
                raise DoesNotFitError("is too small for the program", where=core)
            reason = linked.stderr.strip().splitlines()[0].rpartition("ld: ")[2]
            raise SoftsenseError(f"does not link: {reason}", where=core)
        whole = _sizes(how.compiler, image)[0]
        ticks = _run(core, [*how.emulator.split(), str(image)])
    return Count(ticks * how.tick / how.calls, flash, ram, whole)


def _run(core: str, command: list[str]) -> int:
    """The ticks that the program prints: a line of digits, which simavr ends with a dot."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=SECONDS, stdin=subprocess.DEVNULL
        )
    except subprocess.TimeoutExpired as error:
        raise SoftsenseError(
            f"no estimate within {SECONDS} s of emulation", where=core, remedy="name another core"
        ) from error
    found = re.search(r"^(?:\x1b\[\d+m)?(\d+)\.?$", done.stdout + done.stderr, re.MULTILINE)
    if found is None:
        raise SoftsenseError("the emulated program stopped before its end", where=core)
    return int(found[1])


def _sizes(compiler: str, path: Path) -> tuple[int, int]:
    """Bytes of code and constants (flash), and of static data (RAM)."""
    said = subprocess.run(
        [size_tool(compiler), str(path)], capture_output=True, text=True, check=True
    ).stdout.splitlines()[1]
    text, data, bss = (int(part) for part in said.split()[:3])
    return text + data, data + bss


def size_tool(compiler: str) -> str:
    """The tool that tells the sizes of what ``compiler`` makes."""
    return compiler.removesuffix("gcc") + "size"
