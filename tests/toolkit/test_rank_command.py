"""``softsense rank``: the JSON that other programs read, and the lines that people read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from softsense.cli.main import main
from softsense.information import labels_of, mutual_information


@pytest.fixture
def path(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    strain = 0.2 + 0.2 * np.sin(np.linspace(0, 60, 900))
    codes = [np.round(800 + 4000 * strain * (k + 1) / 3 + rng.normal(0, 20, 900)) for k in range(3)]
    lines = ["strain,s1,s2,s3"]
    lines += [
        f"{y:.6f},{int(a)},{int(b)},{int(c)}" for y, a, b, c in zip(strain, *codes, strict=True)
    ]
    file = tmp_path / "rec.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_json_has_the_documented_shape(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rank", str(path), "--json", "-o", str(path.parent / "rank.json")]) == 0
    out, err = capsys.readouterr()
    data = json.loads(out)
    assert err == ""
    assert json.loads((path.parent / "rank.json").read_text()) == data
    assert data["target"] == ["strain"]
    assert set(data["sensors"]) == {"s1", "s2", "s3"}
    assert set(data["dissimilarity_bits"]["s1"]) == {"s2", "s3"}
    assert len(data["subsets"]) == 7
    assert set(data["best"]) == {"1", "2", "3"}
    assert {"plug_in", "score"} <= set(data["seconds"])
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    target, codes = labels_of(table[:, :1]), table[:, 1:].astype(int)
    for subset in data["subsets"]:
        columns = [int(name[1]) - 1 for name in subset["sensors"]]
        direct = mutual_information(codes[:, columns], target)
        assert subset["mi_bits"] == pytest.approx(direct, abs=1e-12)
        assert subset["mi_nats"] == pytest.approx(direct * np.log(2), abs=1e-12)
    for name, one in data["sensors"].items():
        first = next(s for s in data["subsets"] if s["sensors"] == [name])
        assert one["mi_bits"] == first["mi_bits"]
    pair = next(s for s in data["subsets"] if set(s["sensors"]) == {"s1", "s2"})
    added = data["dissimilarity_bits"]["s1"]["s2"]
    assert pair["mi_bits"] == pytest.approx(data["sensors"]["s1"]["mi_bits"] + added, abs=1e-12)
    for size, best in data["best"].items():
        scores = {tuple(s["sensors"]): s["score"] for s in data["subsets"]}
        same = [value for key, value in scores.items() if len(key) == int(size)]
        assert scores[tuple(best)] == max(same)


def test_the_table_names_every_size(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rank", str(path), "--top", "1", "--max-size", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("best subsets per size (exhaustive)") for line in lines)
    assert sum(line.startswith("  s") and len(line.split()) >= 4 for line in lines) >= 2


def test_mistakes_are_one_line(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rank", str(path), "--max-size", "9"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "cannot choose 9 of 3 sensors" in error
