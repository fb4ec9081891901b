"""Every subset trained: resumable, the same with any number of jobs, and reported honestly."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from softsense import recording
from softsense.cli.main import main
from softsense.errors import SoftsenseError
from softsense.mlp import Mlp
from softsense.select import rank
from softsense.train import Settings, compare, fit, fit_all
from softsense.train.levenberg_marquardt import Status

SETTINGS = Settings(hidden=4, max_epochs=6)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    rng = np.random.default_rng(2)
    strain = 0.2 + 0.15 * np.sin(np.linspace(0, 90, 700)) + 0.05 * np.sin(np.linspace(0, 23, 700))
    rows = [
        f"{y:.6f}," + ",".join(str(int(600 + 5000 * y * (k + 1) / 3 + e)) for k, e in enumerate(n))
        for y, n in zip(strain, rng.normal(0, [40, 20, 60], (700, 3)), strict=True)
    ]
    file = tmp_path / "rec.csv"
    file.write_text("strain,a,b,c\n" + "\n".join(rows) + "\n")
    return file


def texts(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in sorted((folder / "subsets").iterdir())}


def test_any_number_of_jobs_gives_the_same_files(path: Path, tmp_path: Path) -> None:
    rec = recording.read(path)
    one = fit_all(rec, tmp_path / "one", SETTINGS)
    two = fit_all(rec, tmp_path / "two", SETTINGS, jobs=2)
    assert [t.sensors for t in one] == [
        ("a",), ("b",), ("c",), ("a", "b"), ("a", "c"), ("b", "c"), ("a", "b", "c")
    ]  # fmt: skip
    assert texts(tmp_path / "one") == texts(tmp_path / "two")
    assert [t.accuracy for t in one] == [t.accuracy for t in two]
    alone = fit(rec, ("a", "c"), hidden=4, split=SETTINGS.split, max_epochs=6, restarts=1)
    assert one[4].mlp.to_json() == alone.mlp.to_json()
    assert one[4].rmse == alone.rmse


def test_an_interrupted_run_goes_on_where_it_was(path: Path, tmp_path: Path) -> None:
    rec = recording.read(path)
    folder = tmp_path / "out"
    seen: list[tuple[int, str]] = []

    def stop(done: int, note: str) -> None:
        seen.append((done, note))
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_all(rec, folder, SETTINGS, progress=stop)
    finished = texts(folder)
    assert len(finished) == 3
    stamps = {file.name: file.stat().st_mtime_ns for file in (folder / "subsets").iterdir()}
    later: list[int] = []
    fit_all(rec, folder, SETTINGS, progress=lambda done, note: later.append(done))
    assert later == [4, 5, 6, 7]
    assert all((folder / "subsets" / n).stat().st_mtime_ns == s for n, s in stamps.items())
    fit_all(rec, tmp_path / "whole", SETTINGS)
    assert texts(folder) == texts(tmp_path / "whole")


def test_results_of_other_settings_and_torn_files_are_refused(path: Path, tmp_path: Path) -> None:
    rec = recording.read(path)
    fit_all(rec.with_sensors(("a", "b")), tmp_path, SETTINGS)
    with pytest.raises(SoftsenseError, match="other data or with other settings"):
        fit_all(rec.with_sensors(("a", "b")), tmp_path, Settings(hidden=5, max_epochs=6))
    with pytest.raises(SoftsenseError, match="other data or with other settings"):
        fit_all(rec, tmp_path, SETTINGS)
    torn = next((tmp_path / "subsets").iterdir())
    torn.write_text(torn.read_text()[:200])
    with pytest.raises(SoftsenseError, match="not a whole result"):
        fit_all(rec.with_sensors(("a", "b")), tmp_path, SETTINGS)


def test_agreement_is_rank_correlation_and_regret(path: Path, tmp_path: Path) -> None:
    rec = recording.read(path)
    trained = fit_all(rec, tmp_path, SETTINGS)
    ranking = rank(rec)
    first, second, third = compare(ranking, trained)
    assert (first.size, first.subsets, third.subsets) == (1, 3, 1)
    accuracy = {t.sensors: t.accuracy for t in trained}
    chosen = accuracy[ranking.best[2]]
    best = max(accuracy[pair] for pair in (("a", "b"), ("a", "c"), ("b", "c")))
    assert second.regret == pytest.approx(best / chosen)
    assert second.regret_of_three == 1.0
    assert third.score is None
    assert first.score is not None
    assert -1 <= first.score <= 1


def test_the_command_writes_tables_figures_and_the_best_network(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["train", str(path), "--all", "--hidden", "4", "--max-epochs", "5", "--jobs", "1"]
    assert main([*command, "--json", "-o", str(out)]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["size"] for one in data["agreement"]] == [1, 2, 3]
    with (out / "subsets.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7
    mlp = Mlp.from_json((out / "mlp.json").read_text())
    parts = ("rmse_train_strain", "rmse_validation_strain")
    best = min(rows, key=lambda row: max(float(row[part]) for part in parts))
    assert " ".join(i.name for i in mlp.inputs) == best["sensors"]
    saved = np.load(out / "recording.npz")
    assert saved["codes"].dtype == np.int32
    error = mlp.predict(saved["codes"]) - saved["target"]
    rows_of = data["split"]
    assert rows_of["how"] == "random"
    assert rows_of["train"] + rows_of["validation"] + rows_of["test"] == len(error) == 700
    names = ("accuracy_per_sensor", "pairs", "accuracy_by_size", "true_and_predicted")
    before = {}
    for name in names:
        assert (out / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        before[name] = (out / "figures" / f"{name}.svg").read_bytes()
        assert b"<svg" in before[name]
    assert main([*command, "-q", "-o", str(out)]) == 0
    for name in names:
        assert (out / "figures" / f"{name}.svg").read_bytes() == before[name]


def test_the_command_selects_without_the_test_rows(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "two"
    assert main(["train", str(path), "--size", "2", "--hidden", "4", "-q", "-o", str(out)]) == 0
    data = json.loads((out / "train.json").read_text())
    rec = recording.read(path)
    rows = recording.split(len(rec), "blocks", 0)
    known = rec.rows(np.sort(np.concatenate([rows.train, rows.validation])))
    assert tuple(data["sensors"]) == rank(known, 2).best[2]
    assert data["selection"]["size"] == 2
    assert data["status"] in get_args(Status)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--size", "4"], "cannot choose 4 of 3"),
        (["--all", "--size", "2"], "exclude each other"),
        (["--sensors", "a,z"], "no column 'z'"),
        (["--hidden", "0"], "at least 1"),
    ],
)
def test_mistakes_are_one_line(
    path: Path, tmp_path: Path, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", str(path), *options, "-o", str(tmp_path / "x")]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_dask_cluster_gives_the_same_files(path: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    rec = recording.read(path).with_sensors(("a", "b"))
    fit_all(rec, tmp_path / "alone", SETTINGS)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as cluster:
        fit_all(rec, tmp_path / "dask", SETTINGS, dask=cluster.scheduler_address)
    assert texts(tmp_path / "alone") == texts(tmp_path / "dask")
