"""The pages of docs: their commands and code run as they stand, and print what they say."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "toolkit" / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "firmware" / "README.md"]
BLOCK = re.compile(r"^```(sh|python|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e-?\d+)?")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_page_does_what_it_says(page: Path, tmp_path: Path, shared: Path, tool) -> None:
    tool("arm-none-eabi-gcc")
    script = tmp_path / "bin" / "softsense"
    script.parent.mkdir()
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m softsense "$@"\n')
    script.chmod(0o755)
    (tmp_path / "shared").symlink_to(shared)
    place = tmp_path / "here"
    place.mkdir()
    # What is built in a checkout stays out of this one.
    shutil.copytree(ROOT / "firmware", place / "firmware", ignore=shutil.ignore_patterns("build"))
    (place / "models").symlink_to(ROOT / "models")
    environment = {
        **os.environ,
        "PATH": f"{script.parent}:{os.environ['PATH']}",
        "PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}",
    }
    said = ""
    for language, text in BLOCK.findall(page.read_text()):
        if language == "text":
            same_but_for_rounding(text.strip().splitlines(), said)
            continue
        commands = [["sh", "-ec", text]] if language == "sh" else [[sys.executable, "-c", text]]
        for command in commands:
            done = subprocess.run(
                command, cwd=place, env=environment, capture_output=True, text=True
            )
            assert done.returncode == 0, f"{text}\n{done.stderr}"
            said = done.stdout
            if language == "python":
                assert said.strip().splitlines()[-1] == "True"


def same_but_for_rounding(expected: list[str], said: str) -> None:
    """Every line was printed, with numbers within a tenth: processors round differently."""
    lines = said.splitlines()
    for line in expected:
        words = NUMBER.split(line)
        found = [other for other in lines if NUMBER.split(other) == words]
        assert found, f"not printed: {line}\n{said}"
        for value, other in zip(NUMBER.findall(line), NUMBER.findall(found[0]), strict=True):
            assert abs(float(value) - float(other)) <= 0.1 * abs(float(value)) + 0.05


def test_links_lead_somewhere() -> None:
    for page in DOCS.glob("*.md"):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
