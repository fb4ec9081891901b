"""Measures of information: time, error against known truth, and how well they foretell accuracy.

    python tests/benchmarks/selection/measures.py [RECORDING] [--target NAME] [--mitoolbox FILE]
                                                   [--json FILE]

Without a recording, the built-in linear rig (seven sensors, 8000 samples). Prints, from one run:

- CPU time of the plug-in measure, and its largest difference, against numpy's sorting of joint
  states, scikit-learn's mutual_info_score and (where it is installed) pyitlib, a toolkit of
  discrete information; with --mitoolbox FILE also against MIToolbox, which the paper used: it is C
  without a Python package, and FILE is the library that its own make builds (libMIToolbox.so);
- CPU time of the score against scikit-learn's mutual_info_regression;
- error in bits on Gaussians;
- with --accuracy DIR (the folder of ``softsense train --all`` on the same recording), Spearman
  correlation with accuracy; ``ceiling.py`` tells how much there is to be had.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib
import json
import sys
import time
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr
from sklearn.feature_selection import mutual_info_regression
from sklearn.metrics import mutual_info_score
from threadpoolctl import threadpool_limits

from softsense import recording
from softsense.information import labels_of, mutual_information, subset_entropies
from softsense.recording import FrontEnd, Recording
from softsense.select import Ranking, rank
from softsense.simulate import linear_rig, random_motion, run, to_recording


def best_s(work: Callable[[], Any], repeats: int) -> float:
    """Least CPU time of ``repeats`` calls, after one that warms up."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def sorted_entropy(*columns: np.ndarray) -> float:
    """H in bits by the definition: sort the joint states, count them."""
    _, counts = np.unique(np.stack(columns, axis=1), axis=0, return_counts=True)
    share = counts / len(columns[0])
    return float(-(share * np.log2(share)).sum())


def every_subset(sensors: int) -> list[list[int]]:
    """Sensor numbers of all subsets, by size."""
    return [
        list(chosen)
        for size in range(1, sensors + 1)
        for chosen in combinations(range(sensors), size)
    ]


def sorted_information(codes: np.ndarray, label: np.ndarray) -> list[float]:
    """Plug-in I(S;Y) of every subset by ``sorted_entropy``."""
    target = sorted_entropy(label)
    result = []
    for chosen in every_subset(codes.shape[1]):
        columns = [codes[:, i] for i in chosen]
        result.append(sorted_entropy(*columns) + target - sorted_entropy(*columns, label))
    return result


def scored_information(codes: np.ndarray, label: np.ndarray) -> list[float]:
    """Plug-in I(S;Y) of every subset by scikit-learn, from a contingency table."""
    result = []
    for chosen in every_subset(codes.shape[1]):
        _, states = np.unique(codes[:, chosen], axis=0, return_inverse=True)
        result.append(float(mutual_info_score(states.ravel(), label) / np.log(2.0)))
    return result


def pyitlib_information(codes: np.ndarray, label: np.ndarray) -> list[float] | None:
    """Plug-in I(S;Y) of every subset by pyitlib; None where it is not installed."""
    try:
        joint: Any = importlib.import_module("pyitlib.discrete_random_variable").entropy_joint
    except ImportError:
        return None
    target = float(joint(label))
    result = []
    for chosen in every_subset(codes.shape[1]):
        columns = codes[:, chosen].T
        both = np.vstack([columns, label])
        result.append(float(joint(columns)) + target - float(joint(both)))
    return result


def mitoolbox_information(library: Path) -> Callable[[np.ndarray, np.ndarray], list[float]]:
    """Plug-in I(S;Y) of every subset by MIToolbox's own routines."""
    tool = ctypes.CDLL(str(library.resolve()))
    tool.calcMutualInformation.restype = ctypes.c_double

    def information(codes: np.ndarray, label: np.ndarray) -> list[float]:
        samples = len(label)
        states, target = np.zeros(samples, np.intc), label.astype(np.intc)
        result = []
        for chosen in every_subset(codes.shape[1]):
            columns = np.ascontiguousarray(codes[:, chosen].T, np.float64)
            tool.mergeMultipleArrays(
                columns.ctypes.data_as(ctypes.c_void_p),
                states.ctypes.data_as(ctypes.c_void_p),
                len(chosen),
                samples,
            )
            bits = tool.calcMutualInformation(
                states.ctypes.data_as(ctypes.c_void_p),
                target.ctypes.data_as(ctypes.c_void_p),
                samples,
            )
            result.append(float(bits))
        return result

    return information


def plug_in_peers(rec: Recording, mitoolbox: Path | None) -> list[dict[str, Any]]:
    """CPU seconds for all subsets, and the largest difference from ours in bits."""
    codes, label = rec.codes, labels_of(rec.target)[:, 0]
    own, joint, target = subset_entropies(codes, label)
    masks = [sum(1 << i for i in chosen) for chosen in every_subset(codes.shape[1])]
    ours = np.array([own[mask] + target - joint[mask] for mask in masks])
    ours_s = best_s(lambda: subset_entropies(codes, label), 20)
    rows: list[dict[str, Any]] = [
        {"who": "softsense", "all_s": ours_s, "ratio": 1.0, "largest_difference_bits": 0.0}
    ]
    peers: dict[str, Callable[[np.ndarray, np.ndarray], list[float] | None]] = {
        "numpy, sorted joint states": sorted_information,
        "sklearn mutual_info_score": scored_information,
        "pyitlib": pyitlib_information,
    }
    if mitoolbox is not None:
        peers["MIToolbox"] = mitoolbox_information(mitoolbox)
    for name, peer in peers.items():
        begin = time.process_time()
        theirs = peer(codes, label)
        spent = time.process_time() - begin
        if theirs is None:
            print(f"{name} is not installed: left out", file=sys.stderr)
            continue
        difference = float(np.max(np.abs(ours - theirs)))
        rows.append(
            {
                "who": name,
                "all_s": spent,
                "ratio": spent / ours_s,
                "largest_difference_bits": difference,
            }
        )
    return rows


def plug_in_times(rec: Recording) -> dict[str, float]:
    """CPU seconds for one sensor and for a pair."""
    codes, label = rec.codes, labels_of(rec.target)[:, 0]
    one, two = codes[:, 0].copy(), codes[:, :2].copy()
    return {
        "single_s": best_s(lambda: mutual_information(one, label), 200),
        "pair_s": best_s(lambda: mutual_information(two, label), 200),
    }


def gaussian_errors() -> list[dict[str, float]]:
    """Largest error in bits over subsets of each size: Y plus noise on seven sensors."""
    rng = np.random.default_rng(0)
    rows = []
    for noise in (1.0, 1 / 30):
        y = rng.normal(size=8000)
        x = y[:, None] + noise * rng.normal(size=(8000, 7))
        low, high = x.min(axis=0), x.max(axis=0)
        codes = np.round((x - low) / (high - low) * 4095).astype(np.int32)
        names = tuple(f"s{i}" for i in range(7))
        ends = (FrontEnd("codes", 12),) * 7
        rec = Recording("gaussian", names, codes, ("y",), ("1",), y[:, None], None, ends)
        ranking = rank(rec)
        for size in range(1, 8):
            truth = 0.5 * np.log2(1 + size / noise**2)
            subsets = ranking.of_size(size)
            rows.append(
                {
                    "noise": noise,
                    "sensors": size,
                    "truth_bits": truth,
                    "score_error": max(abs(s.score - truth) for s in subsets),
                    "mi_lower_error": max(abs((s.mi_lower_bits or 0) - truth) for s in subsets),
                    "plug_in_error": max(abs(s.mi_bits - truth) for s in subsets),
                }
            )
    return rows


def foretelling(ranking: Ranking, rec: Recording, folder: Path) -> list[dict[str, Any]]:
    """Spearman of each measure with the accuracy that ``train --all`` found, and regret."""
    accuracy = {}
    for file in sorted((folder / "subsets").glob("*.json")):
        data = json.loads(file.read_text())
        accuracy[frozenset(data["sensors"])] = data["accuracy"]
    alone = mutual_info_regression(rec.codes, rec.target[:, 0], random_state=0)
    singles = dict(zip(rec.sensors, alone, strict=True))
    rows = []
    for size in ranking.best:
        subsets = ranking.of_size(size)
        known = [accuracy[frozenset(s.sensors)] for s in subsets]
        if len(known) < 2:
            continue
        measures = {
            "score": [s.score for s in subsets],
            "mi_lower": [s.mi_lower_bits or 0.0 for s in subsets],
            "plug_in": [s.mi_bits for s in subsets],
            "sum of sklearn singles": [sum(singles[name] for name in s.sensors) for s in subsets],
        }
        rows.append(
            {
                "size": size,
                **{
                    name: float(spearmanr(values, known).statistic) if np.ptp(values) else None
                    for name, values in measures.items()
                },
                "regret": max(known) / known[0],
                "regret_of_three": max(known) / max(known[:3]),
            }
        )
    return rows


def show(title: str, rows: list[dict[str, Any]]) -> None:
    """An aligned table."""
    table = [list(rows[0]), *([cell(value) for value in row.values()] for row in rows)]
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    print(f"\n{title}")
    for row in table:
        print("  " + "  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)))


def cell(value: Any) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", nargs="?", type=Path)
    parser.add_argument("--target", default="strain")
    parser.add_argument("--accuracy", type=Path, metavar="DIR")
    parser.add_argument("--mitoolbox", type=Path, metavar="FILE")
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    if args.recording is None:
        rig, strain = linear_rig(0), random_motion(8000, 0.05, 0)
        rec = to_recording(rig, run(rig, strain, 0))
    else:
        rec = recording.read(args.recording, target=args.target)
    with threadpool_limits(limits=1):
        rank(rec)
        ranking = rank(rec)
        sklearn_s = best_s(
            lambda: mutual_info_regression(rec.codes, rec.target[:, 0], random_state=0), 2
        )
        result: dict[str, Any] = {
            "plug_in": plug_in_times(rec),
            "peers": plug_in_peers(rec, args.mitoolbox),
        }
        result["score"] = {
            "subsets": len(ranking.subsets),
            **{f"{name}_s": value for name, value in ranking.seconds.items()},
            "sklearn_singles_s": sklearn_s,
            "ratio_per_subset": (sklearn_s / len(rec.sensors))
            / (ranking.seconds["score"] / len(ranking.subsets)),
        }
        result["gaussians"] = gaussian_errors()
    for name in ("plug_in", "score"):
        show(f"{name} (CPU)", [{"what": key, "value": v} for key, v in result[name].items()])
    show("plug-in, all subsets (CPU)", result["peers"])
    show("Gaussians: largest error in bits, 8000 samples", result["gaussians"])
    if args.accuracy is not None:
        result["foretelling"] = foretelling(ranking, rec, args.accuracy)
        show("Spearman with accuracy, and regret", result["foretelling"])
    if args.json is not None:
        args.json.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
