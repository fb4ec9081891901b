"""The benchmark of the diagnosis: the same answers here, in processes, and on a cluster."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "benchmarks" / "gap"


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("gap_run", FOLDER / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["gap_run"] = module
    spec.loader.exec_module(module)
    return module


def test_two_workers_say_what_one_says(
    benchmark: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import LocalCluster

    # Workers find the benchmark and the packages by their path.
    paths = [str(FOLDER), str(ROOT / "toolkit"), str(ROOT / "codegen")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*paths, os.environ.get("PYTHONPATH", "")]))
    sys.path.insert(0, str(FOLDER))
    from run import score

    monkeypatch.setattr(benchmark, "score", score)
    work = [(("gain",), 1, "rich", False, ()), ((), 50_000, "typical", False, ())]
    serial = benchmark.mapped(work, 1, None)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        spread = benchmark.mapped(work, 1, cluster.scheduler_address)
    for result in (*serial, *spread):
        result.pop("seconds")
    assert spread == serial
    assert serial[0]["said"] == ["gain"]
    assert serial[1]["said"] == []
