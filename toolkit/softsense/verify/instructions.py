"""Guest instructions per inference on emulated Cortex-M cores, counted deterministically.

QEMU with ``-icount shift=0`` advances virtual time by 1 ns per instruction; SysTick at the
board's 25 MHz then ticks every 40 instructions. Many inferences between two readings, less the
empty loop, give the count to a fraction of an instruction.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from softsense.errors import SoftsenseError

# name: QEMU machine, compiler flags. ARMv6-M code runs unchanged on the Cortex-M3 machine.
CORES = {
    "Cortex-M0+": ("mps2-an385", "-mcpu=cortex-m0plus -mthumb"),
    "Cortex-M3": ("mps2-an385", "-mcpu=cortex-m3 -mthumb"),
    "Cortex-M4F": ("mps2-an386", "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard"),
    "Cortex-M7": ("mps2-an500", "-mcpu=cortex-m7 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard"),
}
TICK_INSTRUCTIONS = 40

START = r"""
#include <stdint.h>
#include <stddef.h>
int main(void);
extern uint32_t stack_top;
static long semihost(long operation, const void *argument)
{
    register long r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}
static void say(const char *text) { semihost(4, text); }
static void number(uint32_t value)
{
    char text[12];
    char *p = text + 11;
    *p = 0;
    *--p = '\n';
    do { *--p = (char)('0' + value % 10u); value /= 10u; } while (value);
    say(p);
}
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the FPU, where there is one */
    main();
    semihost(0x18, (void *)0x20026);
    for (;;) { }
}
__attribute__((section(".vectors"), used)) static const void *const vectors[16] =
    { &stack_top, (const void *)reset };
#define SYST_CSR (*(volatile uint32_t *)0xE000E010)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018)
"""

SCRIPT = """
ENTRY(reset)
MEMORY { flash (rx) : ORIGIN = 0, LENGTH = 4M
         ram (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) *(.ARM*) } > flash
  .data : { *(.data*) } > ram
  .bss : { *(.bss*) *(COMMON) } > ram
  stack_top = 0x20300000;
}
"""


@dataclass(frozen=True)
class Count:
    """Instructions per call and bytes of flash (code and constants of the unit alone)."""

    instructions: float
    flash: int


def countable(core: str) -> bool:
    """Whether this machine can count on ``core``."""
    tools = ("arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm")
    return core in CORES and all(shutil.which(tool) for tool in tools)


def of_estimate(core: str, source: Path) -> Count:
    """Instructions of one NAME_estimate() of ``source`` (NAME.c beside NAME.h), over its range."""
    name = source.stem
    text = source.with_suffix(".h").read_text(encoding="utf-8")
    found = re.search(rf"#define {name}_INPUTS (\d+)", text)
    if found is None:
        raise SoftsenseError(f"does not define {name}_INPUTS", where=f"{name}.h")
    rows = ", ".join(
        "{"
        + ", ".join(
            # Sensors sweep their ranges at different paces.
            f"{name}_INPUT{i}_LOW + ({name}_INPUT{i}_HIGH - {name}_INPUT{i}_LOW) * "
            f"{j * (2 * i + 1) % 64} / 63"
            for i in range(int(found[1]))
        )
        + "}"
        for j in range(64)
    )
    setup = f'#include "{name}.h"\nstatic const int16_t x[64][{name}_INPUTS] = {{{rows}}};\n'
    setup += f"static int32_t y[{name}_OUTPUTS];\n"
    return count(core, [source], setup, f"{name}_estimate(x[i & 63u], y); sink = y[0]")


def count(
    core: str,
    sources: list[Path],
    setup: str,
    call: str,
    calls: int = 256,
    optimise: str = "-O2",
    libraries: tuple[str, ...] = (),
) -> Count:
    """Instructions of the C statement ``call``, which may use ``i`` (0 … calls - 1).

    ``setup``: C before ``main`` (includes, inputs). The cost of the loop around is subtracted.
    """
    machine, flags = CORES[core]
    main = f"""
{setup}
volatile int32_t sink;
#define BARRIER __asm__ volatile("" ::: "memory")
int main(void)
{{
    uint32_t before, empty, full;
    SYST_RVR = 0xFFFFFF; SYST_CVR = 0; SYST_CSR = 5;
    before = SYST_CVR;
    for (uint32_t i = 0; i < {calls}u; i++) {{ BARRIER; }}
    empty = (before - SYST_CVR) & 0xFFFFFFu;
    before = SYST_CVR;
    for (uint32_t i = 0; i < {calls}u; i++) {{ {call}; BARRIER; }}
    full = (before - SYST_CVR) & 0xFFFFFFu;
    number(full - empty);
    return 0;
}}
"""
    with tempfile.TemporaryDirectory(prefix="count-") as scratch:
        folder = Path(scratch)
        (folder / "main.c").write_text(START + main)
        (folder / "link.ld").write_text(SCRIPT)
        cc = ["arm-none-eabi-gcc", *flags.split(), optimise, "-std=gnu11", "-ffreestanding"]
        objects: list[str] = []
        flash = 0
        for source in sources:
            made = folder / f"{source.stem}.o"
            subprocess.run(
                [*cc, "-ffunction-sections", "-c", str(source.resolve()), "-o", str(made)],
                check=True,
            )
            objects.append(str(made))
            said = subprocess.run(
                ["arm-none-eabi-size", made], capture_output=True, text=True, check=True
            ).stdout.splitlines()[1]
            text, data, _ = (int(part) for part in said.split()[:3])
            flash += text + data
        include: list[str] = [f"-I{source.resolve().parent}" for source in sources]
        image = folder / "image.elf"
        subprocess.run(
            [*cc, *include, "-nostartfiles", "-Wl,--gc-sections", "-T", str(folder / "link.ld")]
            + [str(folder / "main.c"), *objects, "-o", str(image), *libraries, "-lgcc"],
            check=True,
        )
        done = subprocess.run(
            [
                "qemu-system-arm",
                "-M",
                machine,
                "-kernel",
                str(image),
                "-nographic",
                "-icount",
                "shift=0",
            ]
            + ["-semihosting-config", "enable=on,target=native", "-monitor", "none"],
            capture_output=True,
            text=True,
            timeout=120,
        )
    ticks = int((done.stdout + done.stderr).split()[0])
    return Count(ticks * TICK_INSTRUCTIONS / calls, flash)
