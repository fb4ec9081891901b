"""The generated C: compiled in every way, run, and compared with the reference bit for bit."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from networks import make_network

import softsense_codegen
from softsense_codegen import reference
from softsense_codegen.errors import SoftsenseError
from softsense_codegen.generate import generate
from softsense_codegen.network import IntNetwork
from softsense_codegen.view import Optimise

GOLDEN = Path(__file__).parent / "golden"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
SANITIZE = ["-O1", "-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
MAIN = """
#include <stdio.h>
#include "{name}.h"
int main(void)
{{
    int16_t x[{name}_INPUTS];
    int32_t y[{name}_OUTPUTS];
    while (fread(x, sizeof x, 1, stdin) == 1) {{
        uint32_t mask = {name}_uncalibrated(x);
        {name}_estimate(x, y);
        fwrite(y, sizeof y, 1, stdout);
        fwrite(&mask, sizeof mask, 1, stdout);
    }}
    return 0;
}}
"""


def codes_for(net: IntNetwork, seed: int = 0, samples: int = 400) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low = [i.low for i in net.inputs]
    high = [i.high for i in net.inputs]
    inside = rng.integers(low, high, size=(samples, len(low)), endpoint=True)
    anywhere = rng.integers(-32768, 32767, size=(samples, len(low)), endpoint=True)
    ends = np.array([[-32768] * len(low), [32767] * len(low), low, high])
    return np.concatenate([inside, anywhere, ends]).astype("<i2")


def run_and_compare(
    net: IntNetwork,
    folder: Path,
    compiler: str,
    flags: list[str],
    emulator: Sequence[str] = (),
    order: str = "<",
    optimise: Optimise = "speed",
) -> None:
    """Compile NAME.c with a main program, run it, and compare estimates and masks.

    ``order``: "<" where the program reads its least significant byte first, else ">".
    """
    main = "main.c"
    generate(net, folder, optimise=optimise)
    (folder / main).write_text(MAIN.format(name=net.name))
    program = folder / "program"
    subprocess.run(
        [compiler, *flags, f"{net.name}.c", main, "-o", str(program)], cwd=folder, check=True
    )
    codes = codes_for(net)
    done = subprocess.run(
        [*emulator, program],
        input=codes.astype(f"{order}i2").tobytes(),
        capture_output=True,
        check=True,
    )
    answered = np.frombuffer(done.stdout, f"{order}i4").astype(np.int32).reshape(len(codes), -1)
    assert np.array_equal(answered[:, :-1], reference.estimate(net, codes))
    masks = reference.uncalibrated(net, codes) & np.uint64(0xFFFFFFFF)
    assert np.array_equal(answered[:, -1].astype(np.uint32), masks.astype(np.uint32))


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("standard", ["c99", "c11", "c17"])
@pytest.mark.parametrize("level", ["-O0", "-O2", "-Os"])
def test_the_compile_matrix_runs(compiler, standard, level, tmp_path, tool) -> None:
    net = make_network(inputs=3, hidden=(7,), steep=2.0)
    run_and_compare(net, tmp_path, tool(compiler), [f"-std={standard}", level, *WARNINGS])


SHAPES = {
    "one input": {"inputs": 1},
    "seven inputs": {"inputs": 7, "hidden": (60,)},
    "twelve inputs": {"inputs": 12, "hidden": (9,)},
    "64 inputs": {"inputs": 64, "hidden": (5,)},
    "two outputs": {"outputs": 2, "hidden": (9,)},
    "two layers": {"hidden": (6, 5)},
    "three layers, three outputs": {"inputs": 4, "hidden": (6, 5, 4), "outputs": 3},
    "relu": {"activation": "relu", "fine": 6},
    "relu, two layers": {"activation": "relu", "hidden": (6, 5), "fine": 4},
    "int8": {"bits": 8, "hidden": (9,)},
    "int8, two layers and outputs": {"bits": 8, "hidden": (9, 4), "outputs": 2},
    "steep": {"steep": 8.0, "fine": -2},
    "fine": {"fine": 3},
    "fine table": {"inputs": 3, "segments": 512},
    "finer table, two layers": {"hidden": (6, 5), "segments": 2048},
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("optimise", ["speed", "size"])
def test_every_shape_with_sanitizers(shape, compiler, optimise, tmp_path: Path, tool) -> None:
    net = make_network(seed=3, **SHAPES[shape])
    flags = ["-std=c99", *SANITIZE, *WARNINGS]
    run_and_compare(net, tmp_path, tool(compiler), flags, optimise=optimise)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    seed=st.integers(0, 10**6),
    inputs=st.integers(1, 10),
    hidden=st.lists(st.integers(1, 12), min_size=1, max_size=3),
    outputs=st.integers(1, 3),
    activation=st.sampled_from(["tanh", "relu"]),
    bits=st.sampled_from([8, 16]),
    fine=st.integers(-3, 4),
)
def test_any_network(
    seed, inputs, hidden, outputs, activation, bits, fine, tmp_path_factory, tool
) -> None:
    net = make_network(seed, inputs, tuple(hidden), outputs, activation, bits, 2.0, fine)
    folder = tmp_path_factory.mktemp("any")
    run_and_compare(net, folder, tool("gcc"), ["-std=c99", "-O1", *WARNINGS])


def test_32_bit_host_gives_the_same_bits(tmp_path: Path, tool) -> None:
    probe = tmp_path / "probe.c"
    probe.write_text("#include <stdio.h>\nint main(void) { return 0; }\n")
    done = subprocess.run([tool("gcc"), "-m32", str(probe), "-o", str(tmp_path / "probe")])
    if done.returncode != 0:
        from conftest import skip_or_fail

        skip_or_fail("gcc -m32 needs libc6-dev-i386 and lib32gcc-VERSION-dev")
    net = make_network(inputs=4, hidden=(9,), outputs=2)
    run_and_compare(net, tmp_path, "gcc", ["-m32", "-std=c99", "-O2", *WARNINGS])


@pytest.mark.parametrize("shape", ["seven inputs", "three layers, three outputs", "relu", "int8"])
def test_big_endian_gives_the_same_bits(shape: str, tmp_path: Path, tool) -> None:
    net = make_network(seed=3, **SHAPES[shape])
    flags = ["-static", "-std=c99", "-O2", *WARNINGS]
    emulator = [tool("qemu-ppc")]
    run_and_compare(net, tmp_path, tool("powerpc-linux-gnu-gcc"), flags, emulator, ">")


def test_the_header_serves_cpp(tmp_path: Path, tool) -> None:
    net = make_network(inputs=2)
    generate(net, tmp_path)
    (tmp_path / "main.cpp").write_text(MAIN.format(name=net.name))
    for compiler in ("g++", "clang++"):
        subprocess.run(
            [tool(compiler), "-std=c++11", "-Wall", "-Wextra", "-Werror", "-c", "main.cpp"],
            cwd=tmp_path,
            check=True,
        )
    subprocess.run([tool("gcc"), "-c", f"{net.name}.c"], cwd=tmp_path, check=True)
    subprocess.run([tool("g++"), "main.o", f"{net.name}.o", "-o", "p"], cwd=tmp_path, check=True)
    codes = codes_for(net)
    done = subprocess.run([tmp_path / "p"], input=codes.tobytes(), capture_output=True, check=True)
    answered = np.frombuffer(done.stdout, "<i4").reshape(len(codes), -1)
    assert np.array_equal(answered[:, :-1], reference.estimate(net, codes))


def test_two_networks_share_one_firmware(tmp_path: Path, tool) -> None:
    one, two = make_network(seed=1, name="one"), make_network(seed=2, name="two")
    for net in (one, two):
        generate(net, tmp_path)
    (tmp_path / "main.c").write_text(
        '#include "one.h"\n#include "two.h"\n#include <stdio.h>\n'
        "int main(void) { int16_t x[2] = {700, 900}; int32_t a[1], b[1];\n"
        'one_estimate(x, a); two_estimate(x, b); printf("%ld %ld", (long)a[0], (long)b[0]);\n'
        "return 0; }\n"
    )
    subprocess.run(
        [tool("gcc"), *WARNINGS, "main.c", "one.c", "two.c", "-o", "p"], cwd=tmp_path, check=True
    )
    said = subprocess.run([tmp_path / "p"], capture_output=True, text=True, check=True).stdout
    expected = [int(reference.estimate(net, [[700, 900]])[0, 0]) for net in (one, two)]
    assert [int(part) for part in said.split()] == expected


@pytest.mark.parametrize(
    ("compiler", "flags"),
    [
        ("arm-none-eabi-gcc", "-mcpu=cortex-m0plus -mthumb"),
        ("arm-none-eabi-gcc", "-mcpu=cortex-m3 -mthumb"),
        ("arm-none-eabi-gcc", "-mcpu=cortex-m4 -mthumb"),
        ("arm-none-eabi-gcc", "-mcpu=cortex-m33 -mthumb"),
        ("riscv64-unknown-elf-gcc", "-march=rv32imac -mabi=ilp32"),
        ("avr-gcc", "-mmcu=atmega328p"),
    ],
)
def test_cross_compilers_take_it_without_a_warning_library_or_global(
    compiler: str, flags: str, tmp_path: Path, tool
) -> None:
    net = make_network(inputs=3, hidden=(9,))
    generate(net, tmp_path)
    subprocess.run(
        [tool(compiler), *flags.split(), "-std=c99", "-ffreestanding", "-O2", *WARNINGS]
        + ["-c", f"{net.name}.c"],
        cwd=tmp_path,
        check=True,
    )
    binutils = compiler.replace("gcc", "nm")
    symbols = subprocess.run(
        [tool(binutils), f"{net.name}.o"], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    kinds = {line.split()[-2] for line in symbols}
    outside = {line.split()[-1] for line in symbols if line.split()[-2] == "U"}
    # No writable globals (b, d and their kin). AVR has no multiplier of 32 bits and copies
    # constants to RAM, through its compiler's own helpers.
    allowed = {name for name in outside if name.startswith("__") and compiler == "avr-gcc"}
    assert outside == allowed
    assert not kinds & set("bBC")


def golden_network() -> IntNetwork:
    return make_network(seed=5, inputs=2, hidden=(3,), name="golden")


@pytest.mark.parametrize("suffix", [".h", ".c", "_vectors.h", ".json"])
def test_golden_files(suffix: str, tmp_path: Path) -> None:
    """For review. After an intended change: SOFTSENSE_GOLDEN=write pytest tests/codegen"""
    generate(golden_network(), tmp_path)
    made = (tmp_path / f"golden{suffix}").read_text()
    if os.environ.get("SOFTSENSE_GOLDEN") == "write":
        GOLDEN.mkdir(exist_ok=True)
        (GOLDEN / f"golden{suffix}").write_text(made)
    assert made == (GOLDEN / f"golden{suffix}").read_text()


def test_two_runs_give_identical_bytes(tmp_path: Path) -> None:
    net = make_network(inputs=3)
    first = [path.read_bytes() for path in generate(net, tmp_path / "a")]
    second = [path.read_bytes() for path in generate(net, tmp_path / "b")]
    assert first == second


def test_foreign_names_cannot_break_out_of_comments_and_strings(tmp_path: Path, tool) -> None:
    from dataclasses import replace

    net = make_network()
    evil = '*/ int x = 1; /* "\\ \n,'
    net = replace(net, inputs=tuple(replace(i, name=evil, front_end=evil) for i in net.inputs))
    generate(net, tmp_path)
    subprocess.run(
        [tool("gcc"), "-std=c99", *WARNINGS, "-c", f"{net.name}.c"], cwd=tmp_path, check=True
    )


def test_a_network_without_a_hidden_layer_is_refused(tmp_path: Path) -> None:
    from dataclasses import replace

    net = make_network(inputs=5, hidden=(5,))
    with pytest.raises(SoftsenseError, match="no hidden layer"):
        generate(replace(net, layers=(replace(net.layers[1], shift=0),)), tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("optimise", ["speed", "size"])
@pytest.mark.parametrize(
    "shape",
    [
        {"inputs": 2, "hidden": (60,), "segments": 512},
        {"inputs": 3, "hidden": (4,), "outputs": 2},
        {"inputs": 3, "hidden": (5, 4), "outputs": 2},
    ],
    ids=["60 units", "two outputs", "two layers"],
)
def test_frama_c_finds_no_undefined_behaviour_for_any_input(
    shape, optimise, tmp_path: Path, tool
) -> None:
    """Eva over all int16 inputs: 0 alarms; unsigned wrap-around is what the code relies on."""
    net = make_network(seed=2, **shape)
    generate(net, tmp_path, optimise=optimise)
    (tmp_path / "eva.c").write_text(
        f'#include "{net.name}.h"\n#include "__fc_builtin.h"\n'
        f"void eva(void) {{ int16_t x[{net.name}_INPUTS]; int32_t y[{net.name}_OUTPUTS];\n"
        f"for (int i = 0; i < {net.name}_INPUTS; i++)\n"
        "    x[i] = (int16_t)Frama_C_interval(-32768, 32767);\n"
        f"{net.name}_estimate(x, y); (void){net.name}_uncalibrated(x); }}\n"
    )
    done = subprocess.run(
        [tool("frama-c"), "-eva", "-eva-precision", "2", "-main", "eva"]
        + ["-eva-auto-loop-unroll", "100", f"{net.name}.c", "eva.c", "-cpp-extra-args=-I."],
        cwd=tmp_path,
        env={**os.environ, "PWD": str(tmp_path)},  # frama-c trusts it more than the kernel
        capture_output=True,
        text=True,
    )
    assert "0 alarms generated" in done.stdout, done.stdout[-3000:] + done.stderr[-2000:]


def test_cppcheck_and_clang_tidy_are_clean(tmp_path: Path, tool) -> None:
    net = make_network(inputs=3, hidden=(4, 3), outputs=2)
    generate(net, tmp_path)
    subprocess.run(
        [tool("cppcheck"), "--enable=warning,style,performance,portability", "--error-exitcode=1"]
        + ["--quiet", "--suppress=unusedFunction", f"{net.name}.c"],
        cwd=tmp_path,
        check=True,
    )
    checks = "-checks=-*,bugprone-*,clang-analyzer-*,cert-*,-bugprone-easily-swappable-parameters"
    done = subprocess.run(
        [tool("clang-tidy"), "--quiet", checks, "--warnings-as-errors=*", f"{net.name}.c"]
        + ["--", "-std=c99"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout


MISRA = Path(softsense_codegen.__file__).parent / "misra.txt"


@pytest.mark.parametrize("optimise", ["speed", "size"])
@pytest.mark.parametrize("shape", ["fine table", "relu, two layers", "int8", "twelve inputs"])
def test_misra_rules_hold_or_are_justified(shape, optimise, tmp_path: Path, tool) -> None:
    net = make_network(seed=2, **SHAPES[shape])
    generate(net, tmp_path, optimise=optimise)
    done = subprocess.run(
        [tool("cppcheck"), "--addon=misra", "--enable=style", "--quiet", "--error-exitcode=1"]
        + [f"--suppressions-list={MISRA}", "--suppress=unusedFunction", f"{net.name}.c"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_the_misra_check_sees_a_violation(tmp_path: Path, tool) -> None:
    (tmp_path / "bad.c").write_text("int f(int a);\nint f(int a) { if (a) return 1; return 0; }\n")
    done = subprocess.run(
        [tool("cppcheck"), "--addon=misra", "--enable=style", "--quiet", "--error-exitcode=1"]
        + [f"--suppressions-list={MISRA}", "bad.c"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "misra-c2012-14.4" in done.stderr
