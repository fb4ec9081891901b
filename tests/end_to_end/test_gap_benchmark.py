"""The benchmark of the diagnosis: the same answers here, in processes, and on a cluster."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
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
    work = [(("gain",), 1, "rich", "train", ()), ((), 50_000, "typical", "train", ())]
    serial = benchmark.mapped(work, 1, None)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        spread = benchmark.mapped(work, 1, cluster.scheduler_address)
    for result in (*serial, *spread):
        result.pop("seconds")
        result.pop("on_the_clock")
    assert spread == serial
    assert serial[0]["said"] == ["gain"]
    assert serial[1]["said"] == []


def test_cases_of_another_origin_are_whole(benchmark: ModuleType) -> None:
    """Every effect, each of its equations or some: what is hidden shows on its channels only."""
    elsewhere = sys.modules["elsewhere"]
    for name in elsewhere.NAMES:
        for family in range(elsewhere.FAMILIES):
            case = elsewhere.make(3, (name,), "typical", family)
            assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
            changed = case.change.std(axis=0) > 0.0
            assert tuple(np.flatnonzero(changed)) == case.truth[name]
            assert np.abs(case.real.codes - case.sim.codes - case.change).max() < 7.0 * max(
                case.floors
            )
    again = elsewhere.make(3, ("gain",), "typical")
    assert np.array_equal(again.real.codes, elsewhere.make(3, ("gain",), "typical").real.codes)
    liquid = sys.modules["liquid"]
    for name in liquid.NAMES:
        for seed in range(3):
            case = liquid.make(seed, (name,), "typical")
            assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
            changed = case.change.std(axis=0) > 0.0
            assert tuple(np.flatnonzero(changed)) == (() if name == "noise" else case.truth[name])
    again = liquid.make(3, ("gain",), "typical")
    assert np.array_equal(again.real.codes, liquid.make(3, ("gain",), "typical").real.codes)
    wearable = sys.modules["wearable"]
    for name, equations in wearable.EQUATIONS.items():
        for equation in equations:
            case = wearable.make(3, (name,), "typical", {name: equation})
            assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
            assert tuple(np.flatnonzero(case.change.std(axis=0) > 0.0)) == case.truth[name]
    again = wearable.make(3, ("gain",), "typical")
    assert np.array_equal(again.real.codes, wearable.make(3, ("gain",), "typical").real.codes)
    for half in ("actuator", "optical"):
        source = sys.modules[half]
        for name, equations in source.EQUATIONS.items():
            for equation in list(equations)[:2]:
                case = source.make(3, (name,), "typical", {name: equation})
                assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
                changed = np.flatnonzero(case.change.std(axis=0) > 0.0)
                assert tuple(changed) == case.truth[name]
        again = source.make(3, ("gain",), "typical")
        assert np.array_equal(again.real.codes, source.make(3, ("gain",), "typical").real.codes)
    for origin in (sys.modules[half] for half in ("insole", "arm", "finger", "garment")):
        for name in origin.NAMES:
            for seed in range(3):
                case = origin.make(seed, (name,), "typical")
                assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
                assert tuple(np.flatnonzero(case.change.std(axis=0) > 0.0)) == case.truth[name]
        again = origin.make(3, ("gain",), "typical")
        assert np.array_equal(again.real.codes, origin.make(3, ("gain",), "typical").real.codes)
    strange = sys.modules["strange"]
    for name in strange.FOREIGN:
        case = strange.make(3, (name,), "rich")
        assert case.real.codes.shape == (benchmark.SAMPLES, len(case.floors))
        assert tuple(np.flatnonzero(case.change.std(axis=0) > 0.0)) == case.truth[name]
    again = strange.make(3, ("yarn_snag",), "rich")
    assert np.array_equal(again.real.codes, strange.make(3, ("yarn_snag",), "rich").real.codes)
    with pytest.raises(ValueError, match="solder_crack"):
        strange.make(3, ("gain",), "rich")
