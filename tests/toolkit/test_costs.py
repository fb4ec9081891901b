"""What an estimate costs: counted on emulated cores, the same each time."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from softsense.errors import SoftsenseError
from softsense.verify.costs import measure_costs
from softsense.verify.instructions import CORES, count, of_estimate
from softsense_codegen.fixed import NODE_SEGMENTS, tanh_table
from softsense_codegen.generate import generate
from softsense_codegen.network import IntNetwork
from softsense_codegen.view import table_bytes

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "models" / "linear_pair"
EMULATORS = {
    "arm-none-eabi-gcc": "qemu-system-arm",
    "riscv64-unknown-elf-gcc": "qemu-system-riscv32",
    "avr-gcc": "simavr",
}


@pytest.mark.parametrize("core", CORES)
def test_a_count_is_the_same_each_time(core: str, tool) -> None:
    tool(CORES[core].compiler)
    tool(EMULATORS[CORES[core].compiler])
    first, second = (of_estimate(core, MODEL / "linear_pair.c") for _ in range(2))
    assert first == second
    targets = json.loads((MODEL / "manifest.json").read_text())["costs"]["targets"]
    for told in targets:
        if told["target"] == core:
            # Another version of the compiler makes other code.
            assert first.work == pytest.approx(told[CORES[core].unit], rel=0.15)


def test_the_unit_is_said(tool) -> None:
    for compiler, emulator in EMULATORS.items():
        tool(compiler)
        tool(emulator)
    costs = {cost.target: cost for cost in measure_costs(MODEL / "linear_pair.c")}
    assert costs["AVR ATmega328P"].time.endswith(" cycles")
    assert costs["RISC-V rv32imac"].time.endswith(" instructions")
    assert costs["host"].time == ""


def test_small_code_keeps_few_nodes_of_the_table(tmp_path: Path, tool) -> None:
    tool("arm-none-eabi-gcc")
    coarse = IntNetwork.from_json((MODEL / "linear_pair.json").read_text())
    assert coarse.table is not None
    # Four segments to a node: what only counts bytes need not estimate well.
    net = replace(coarse, table=tanh_table(coarse.table.reach, 4 * NODE_SEGMENTS))
    flash = {}
    for optimise in ("speed", "size"):
        source = generate(net, tmp_path / optimise, optimise=optimise)[1]
        (cost,) = measure_costs(source, only="Cortex-M0+")
        flash[optimise] = cost.flash
    # What the code grows by is little beside what the table shrinks by.
    assert table_bytes(net, "size") == 2 * 131
    assert flash["size"] < flash["speed"] - 0.7 * (table_bytes(net, "speed") - 262)


def test_a_program_too_large_for_the_core_is_refused(tmp_path: Path, tool) -> None:
    tool("avr-gcc")
    source = tmp_path / "large.c"
    source.write_text("volatile char memory[4000];\nchar at(int i) { return memory[i]; }\n")
    with pytest.raises(SoftsenseError, match="AVR ATmega328P: is too small"):
        count("AVR ATmega328P", [source], "char at(int i);", "sink = at(3)")
