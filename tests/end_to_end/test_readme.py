"""The README's commands and code, executed as they stand."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder with ``softsense`` on the path, as after ``make demo``."""
    folder = tmp_path_factory.mktemp("readme")
    script = folder / "bin" / "softsense"
    script.parent.mkdir()
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m softsense "$@"\n')
    script.chmod(0o755)
    return folder


def run(place: Path, *command: str) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "PATH": f"{place / 'bin'}:{os.environ['PATH']}",
        "PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}",
    }
    return subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True)


def test_commands_and_python_run(place: Path) -> None:
    commands = [line for block in blocks("sh") for line in block.strip().splitlines()]
    assert len(commands) >= 4
    for command in commands:
        done = run(place, "sh", "-c", command)
        assert done.returncode == 0, f"{command}\n{done.stderr}"
    for script in blocks("python"):
        done = run(place, sys.executable, "-c", script)
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == "True"
    header = (place / "out" / "strain" / "manifest.json").parent
    assert list(header.glob("*_vectors.h"))


def test_the_c_snippet_compiles(place: Path, tool) -> None:
    (snippet,) = blocks("c")
    include, _, body = snippet.partition("\n")
    code = f"{include}\nvoid use(double v);\nvoid f(int16_t adc_s4, int16_t adc_s7);\n"
    code += f"void f(int16_t adc_s4, int16_t adc_s7)\n{{\n{body}\n}}\n"
    sys.path.insert(0, str(ROOT / "tests" / "codegen"))
    from networks import make_network

    from softsense_codegen.generate import generate

    generate(make_network(name="strain"), place / "snippet")
    (place / "snippet" / "f.c").write_text(code)
    done = run(place, tool("gcc"), "-Wall", "-Wextra", "-Werror", "-c", "snippet/f.c")
    assert done.returncode == 0, done.stderr


def test_every_command_is_named() -> None:
    from softsense.cli.main import build_parser

    (choices,) = [a.choices for a in build_parser()._actions if a.dest == "command"]
    for command in choices:
        assert f"`{command}`" in TEXT, command


def test_the_two_commands_of_set_up_exist() -> None:
    for target in re.findall(r"make (\w+)", TEXT):
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE), target
