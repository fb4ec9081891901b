"""The distribution: what is in the wheel and sdist, and that it works outside the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """sdist and wheel, built by the standard front end from the sources."""
    out = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)],
        check=True,
        capture_output=True,
    )
    return out


def test_the_wheel_holds_both_packages_templates_and_firmware(dist: Path) -> None:
    (wheel,) = dist.glob("softsense-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for needed in (
        "softsense/__init__.py",
        "softsense/py.typed",
        "softsense_codegen/py.typed",
        "softsense_codegen/reference.py",
        "softsense/firmware/README.md",
        "softsense/firmware/src/main.c",
        "softsense/effects/drift.py",
    ):
        assert needed in names, needed
    assert any(name.startswith("softsense_codegen/templates/") for name in names)
    assert any(name.startswith("softsense/firmware/ports/host/") for name in names)
    assert not any("/build/" in name or "__pycache__" in name for name in names)
    assert not any(name.startswith("tests") for name in names)
    assert wheel.stat().st_size < 1_000_000


def test_the_sdist_holds_the_house(dist: Path) -> None:
    (sdist,) = dist.glob("softsense-*.tar.gz")
    with tarfile.open(sdist) as archive:
        tops = {name.split("/")[1] for name in archive.getnames() if name.count("/")}
    house = {"pyproject.toml", "toolkit", "codegen", "firmware", "models", "tests", "README.md"}
    assert house <= tops


def test_the_installed_wheel_works_outside_the_checkout(dist: Path, tmp_path: Path) -> None:
    """Unpacked beside the dependencies only: nothing may come from the checkout."""
    (wheel,) = dist.glob("softsense-*.whl")
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONSAFEPATH": "1"}

    def softsense(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "softsense", *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )

    where = subprocess.run(
        [sys.executable, "-c", "import softsense; print(softsense.__file__)"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert str(site) in where.stdout
    made = softsense("simulate", "linear", "--samples", "1500", "-o", "rec.csv")
    assert made.returncode == 0, made.stderr
    built = softsense(
        "build", "rec.csv", "--size", "1", "--hidden", "8", "--epochs", "15", "-o", "out",
        "--on", "reference,onnxruntime,host,emulate:host", "--json",
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    assert (tmp_path / "out" / "rec.h").is_file()
