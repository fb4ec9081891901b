"""The generated C handed on: Arduino, CMake, PlatformIO, self-test; and budgets."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

import softsense as ss
from softsense.cli.main import main

QUICK = ["--hidden", "7", "--epochs", "8", "--size", "2", "--on", "reference", "-q"]
STUB = """
#pragma once
#include <stdint.h>
enum { A0 = 14, A1, A2 };
int analogRead(uint8_t pin);
void analogReadResolution(int bits);
void delay(unsigned long ms);
struct Print {
  void begin(long);
  void print(float, int);
  void print(const char *);
  void println(const char *);
};
extern Print Serial;
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("packages")
    ss.write(ss.simulate(ss.linear_rig(2), samples=1500, seed=0), made / "rec.csv")
    packages = ["--arduino", "--cmake", "--platformio", "--vectors", "--name", "strain"]
    assert main(["build", str(made / "rec.csv"), *QUICK, *packages, "-o", str(made / "out")]) == 0
    return made


@pytest.mark.parametrize(
    ("compiler", "flags"),
    [
        ("avr-g++", ["-mmcu=atmega328p", "-std=gnu++11"]),
        ("arm-none-eabi-g++", ["-mcpu=cortex-m0plus", "-mthumb", "-std=gnu++11"]),
    ],
)
def test_the_arduino_example_compiles(
    compiler: str, flags: list[str], folder: Path, tmp_path: Path, tool
) -> None:
    library = folder / "out" / "arduino" / "strain"
    properties = dict(
        line.split("=", 1) for line in (library / "library.properties").read_text().splitlines()
    )
    assert (properties["name"], properties["includes"]) == ("strain", "strain.h")
    (tmp_path / "Arduino.h").write_text(STUB)
    sketch = library / "examples" / "Estimate" / "Estimate.ino"
    command = [tool(compiler), *flags, "-Wall", "-Wextra", "-Werror", "-I", str(tmp_path)]
    command += ["-I", str(library / "src"), "-include", "Arduino.h", "-x", "c++", "-c"]
    subprocess.run([*command, str(sketch), "-o", str(tmp_path / "sketch.o")], check=True)
    for name in ("strain.h", "strain.c"):
        assert (library / "src" / name).read_bytes() == (folder / "out" / name).read_bytes()


def test_cmake_links_the_library_and_its_self_test_passes(
    folder: Path, tmp_path: Path, tool
) -> None:
    (tmp_path / "main.c").write_text(
        "#include <stdint.h>\nuint32_t strain_self_test(void);\n"
        "int main(void) { return (int)strain_self_test(); }\n"
    )
    out = folder / "out"
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.13)\nproject(app C)\n"
        f"add_subdirectory({out} strain)\n"
        f"add_executable(app main.c {out}/strain_selftest.c)\n"
        "target_link_libraries(app PRIVATE strain)\n"
    )
    for command in (["-S", ".", "-B", "build"], ["--build", "build"]):
        subprocess.run([tool("cmake"), *command], cwd=tmp_path, check=True, capture_output=True)
    assert subprocess.run([tmp_path / "build" / "app"], check=False).returncode == 0


def test_the_self_test_counts_what_is_wrong(folder: Path, tmp_path: Path, tool) -> None:
    """A changed weight is seen."""
    out = folder / "out"
    source = (out / "strain.c").read_text()
    start = source.index("W(", source.index("units[")) + 2
    end = source.index(")", start)
    (tmp_path / "strain.c").write_text(
        source[:start] + str(int(source[start:end]) ^ 64) + source[end:]
    )
    (tmp_path / "main.c").write_text(
        "#include <stdint.h>\nuint32_t strain_self_test(void);\n"
        "int main(void) { return strain_self_test() > 0; }\n"
    )
    program = tmp_path / "program"
    sources = [tmp_path / "strain.c", tmp_path / "main.c", out / "strain_selftest.c"]
    subprocess.run([tool("gcc"), f"-I{out}", *sources, "-o", program], check=True)
    assert subprocess.run([program], check=False).returncode == 1


def test_platformio_finds_the_sources(folder: Path) -> None:
    data = json.loads((folder / "out" / "library.json").read_text())
    assert data["name"] == "strain"
    assert data["build"]["srcFilter"] == ["+<strain.c>"]
    assert data["headers"] == "strain.h"


def test_a_budget_chooses_the_best_that_fits(folder: Path, tmp_path: Path, tool, capsys) -> None:
    tool("arm-none-eabi-gcc")
    tool("qemu-system-arm")
    command = ["build", str(folder / "rec.csv"), *QUICK, "-o", str(tmp_path), "--json"]
    command[command.index("--hidden") + 1] = "20"
    assert main([*command, "--max-cycles", "250"]) == 0
    result = json.loads(capsys.readouterr().out)
    fitting = [c for c in result["candidates"] if c["fits"]]
    assert 0 < len(fitting) < len(result["candidates"])
    for candidate in result["candidates"]:
        assert candidate["fits"] == (candidate["cost"]["instructions"] <= 250)
    best = min(fitting, key=lambda c: c["rmse"][0])
    (chosen,) = [c for c in result["costs"] if c["target"] == "Cortex-M4F"]
    assert chosen["instructions"] == best["cost"]["instructions"]
    assert chosen["flash"] == best["cost"]["flash"]


def test_a_budget_that_nothing_meets_is_said(folder: Path, tmp_path: Path, tool, capsys) -> None:
    tool("arm-none-eabi-gcc")
    command = ["build", str(folder / "rec.csv"), *QUICK, "-o", str(tmp_path / "none")]
    assert main([*command, "--max-flash", "100"]) == 1
    assert "no network fits on Cortex-M4F: the smallest takes" in capsys.readouterr().err
    assert not (tmp_path / "none" / "manifest.json").exists()
