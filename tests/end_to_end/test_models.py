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


def test_the_card_and_the_readme_state_what_the_manifest_holds() -> None:
    folder = ROOT / "models" / "linear_pair"
    manifest = json.loads((folder / "manifest.json").read_text())
    card, readme = (folder / "card.md").read_text(), (ROOT / "README.md").read_text()
    share = f"1/{1 / manifest['bounds']['share_of_full_scale']:.0f}"
    assert f"at most {share} of full scale" in card
    assert re.search(rf"^  strain .* {share}$", readme, re.MULTILINE)
    costs = [Cost(**cost) for cost in manifest["costs"]["targets"] if cost["target"] != "host"]
    instructions = [str(cost.instructions) for cost in costs if cost.instructions is not None]
    assert f"| {' / '.join(instructions)} instructions |" in card
    assert f"| {costs[-1].cycles} cycles |" in card
    assert f"| {' / '.join(str(cost.flash) for cost in costs)} bytes, static RAM 0 |" in card
    stated = re.search(r"RMSE on held-out time \| ([0-9.]+)", card)
    shown = re.search(r"^  strain +([0-9.]+) ", readme, re.MULTILINE)
    assert stated is not None
    assert shown is not None
    assert float(shown[1]) == pytest.approx(float(stated[1]), abs=5e-6)
