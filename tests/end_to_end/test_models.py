"""The shipped models: same bytes from the same integers, and recipes that still hold."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from softsense.onnx_file import int_model
from softsense.verify.costs import Cost
from softsense_codegen.generate import generate
from softsense_codegen.network import IntNetwork

ROOT = Path(__file__).resolve().parents[2]
MODELS = sorted(path.parent for path in (ROOT / "models").glob("*/recipe.sh"))


@pytest.mark.parametrize("folder", MODELS, ids=lambda path: path.name)
def test_generating_again_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text())
    name = manifest["name"]
    net = IntNetwork.from_json((folder / f"{name}.json").read_text())
    costs = [Cost(**cost).line for cost in manifest["costs"]["targets"]]
    generate(net, tmp_path, cost_lines=costs)
    for suffix in (".h", ".c", ".json"):
        made = (tmp_path / f"{name}{suffix}").read_bytes()
        assert made == (folder / f"{name}{suffix}").read_bytes(), suffix
    assert int_model(net) == (folder / f"{name}_int.onnx").read_bytes()
    assert manifest["digest"] == net.digest


@pytest.mark.parametrize("folder", MODELS, ids=lambda path: path.name)
def test_the_recipe_reaches_what_the_card_says(folder: Path, tmp_path: Path) -> None:
    tool = tmp_path / "bin" / "softsense"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m softsense "$@" --json\n')
    tool.chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tool.parent}:{os.environ['PATH']}",
        "PYTHONPATH": f"{ROOT / 'toolkit'}:{ROOT / 'codegen'}",
    }
    done = subprocess.run(
        ["sh", str(folder / "recipe.sh"), str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    built = json.loads(done.stdout.strip().splitlines()[-1])
    stated = re.search(r"RMSE on held-out time \| ([0-9.]+)", (folder / "card.md").read_text())
    assert stated is not None
    # Other processors round other last bits, and training amplifies them.
    assert built["rmse_fixed_test"][0] == pytest.approx(float(stated.group(1)), rel=0.2)
    assert built["within_tolerance"]
