"""The command line as a whole: it teaches, starts fast, and fails in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from softsense.cli.main import build_parser, main

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = [
    "simulate",
    "characterise",
    "rank",
    "train",
    "export",
    "verify",
    "build",
    "device",
    "emulate",
    "calibrate",
    "diagnose",
    "augment",
    "effects",
]


def test_every_command_of_the_design_is_there_and_teaches(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--help"])
    assert left.value.code == 0
    overview = capsys.readouterr().out
    for command in COMMANDS:
        assert command in overview
        with pytest.raises(SystemExit) as left:
            main([command, "--help"])
        assert left.value.code == 0
        assert "--json" in capsys.readouterr().out or command == "device"


def test_help_and_device_load_nothing_heavy() -> None:
    """Start-up time is decided by what is imported; torch alone costs over a second."""
    for arguments in (["--help"], ["device", "--help"]):
        code = (
            "import sys\nfrom softsense.cli.main import main\n"
            f"try:\n    main({arguments!r})\nexcept SystemExit:\n    pass\n"
            "heavy = {'torch', 'scipy', 'numba', 'onnx', 'matplotlib', 'sklearn', 'numpy'}\n"
            "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=ENV)
        assert done.stderr.strip() == "[]", arguments


ENV = {"PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}", "PATH": "/usr/bin:/bin"}


def test_usage_errors_exit_with_2(capsys: pytest.CaptureFixture) -> None:
    assert main([]) == 2
    for arguments in (["nonsense"], ["build"], ["rank", "x.csv", "--no-such-option"]):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 2
    capsys.readouterr()


def test_a_mistake_is_one_line_on_stderr_and_exit_1(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("t_s,strain,s1\n0,0.1,100\n0.05,oops,101\n" + "0.1,0.2,7\n" * 20)
    for command in (
        ["rank", str(bad)],
        ["build", str(bad), "--size", "1", "-o", str(tmp_path / "o")],
    ):
        assert main(command) == 1
        printed = capsys.readouterr()
        assert printed.out == ""
        lines = printed.err.strip().splitlines()
        assert len(lines) == 1
        assert "row 3" in lines[0]
        assert "'oops'" in lines[0]
    assert not (tmp_path / "o").exists()


def test_the_version_is_the_distribution_s() -> None:
    assert build_parser().prog == "softsense"
