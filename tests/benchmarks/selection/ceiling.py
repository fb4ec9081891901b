"""How well could any ranking foretell accuracy, when accuracy itself scatters?

    python tests/benchmarks/selection/ceiling.py [--rigs SEED ...] [--split NAME] [--unseen NAME]
                                                  [--starts N] [--json FILE]

Trains every subset of built-in linear rigs that the score's form was not chosen on: from several
starting weights on the same rows, and once on another draw of rows. Prints per size, as Spearman
correlations of test accuracy:

- score: of the score (which has not seen the test rows) with a training's accuracy, the mean of
  two draws of rows;
- best of starts: of the score with the network that has the least validation error;
- other start, other rows: of one training's ranking with another's;
- perfect start, perfect rows: their square roots. Two measurements of one truth with independent
  errors correlate by the product of what each has with the truth (Spearman 1904), so this is about
  what a ranking would have that knew every subset's typical accuracy on these rows, or on any rows.
  A goal above it cannot be met but by chance.

and, of mean squared test error, the scatter (typical ratio of two starts of one subset), the regret
of the first by score, and the regret of the first three (means over starts).
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from softsense import recording
from softsense.recording import Recording
from softsense.select import rank
from softsense.simulate import linear_rig, random_motion, run, to_recording
from softsense.train import fit

GOALS = {1: 0.95, 2: 0.95, 3: 0.95, 4: 0.95, 5: 0.95, 6: 0.8}

Names = tuple[str, ...]
Task = tuple[int, str, int, int, Names]  # rig, split and its seed, start, sensors
Trained = tuple[float, float]  # accuracy, the larger of training and validation RMSE

_recordings: dict[int, Recording] = {}


def rig_recording(seed: int) -> Recording:
    """8000 samples of the linear rig, made once per process."""
    if seed not in _recordings:
        rig, strain = linear_rig(seed), random_motion(8000, 0.05, seed)
        _recordings[seed] = to_recording(rig, run(rig, strain, seed))
    return _recordings[seed]


def train(task: Task) -> Trained:
    """One network from one start."""
    rig, split, seed, start, sensors = task
    rec = rig_recording(rig)
    rows = recording.split(len(rec), split, seed)
    result = fit(rec, sensors, split=rows, seed=start, restarts=1)
    return result.accuracy, max(result.rmse["train"][0], result.rmse["validation"][0])


def mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def spearman(first: Sequence[float], second: Sequence[float]) -> float:
    return float(spearmanr(first, second).statistic)


def ceilings(rig: int, split: str, unseen: str, starts: int, jobs: int) -> list[dict[str, Any]]:
    """A row per size of subset."""
    rec = rig_recording(rig)
    rankings = []
    for draw in range(2):
        rows = recording.split(len(rec), split, draw)
        known = rec.rows(np.sort(np.concatenate([rows.train, rows.validation])))
        rankings.append(rank(known, unseen=unseen))
    runs = [(0, start) for start in range(starts)] + [(1, 0)]
    names = [s.sensors for s in reversed(rankings[0].subsets) if len(s.sensors) < len(rec.sensors)]
    tasks = [(rig, split, *one, sensors) for one in runs for sensors in names]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        trained = dict(zip(tasks, pool.map(train, tasks, chunksize=4), strict=True))
    result = []
    for size in range(1, len(rec.sensors)):
        sensors = [s.sensors for s in rankings[0].of_size(size)]
        outcomes = [[trained[rig, split, *one, s] for s in sensors] for one in runs]
        accuracy = [[value for value, _ in start] for start in outcomes]
        same, other_rows = accuracy[:-1], accuracy[-1]
        best = [min(each, key=lambda one: one[1])[0] for each in zip(*outcomes[:-1], strict=True)]
        start_again = mean([spearman(a, b) for a, b in combinations(same, 2)])
        rows_again = mean([spearman(start, other_rows) for start in same])
        logs = [abs(np.log(a) - np.log(b)) for a, b in combinations(np.asarray(same), 2)]
        # Each draw of rows has a ranking and trainings of its own; both draws count alike.
        foretold, first, three = [], [], []
        for ranking, made in zip(rankings, (same, [other_rows]), strict=True):
            scores = {s.sensors: s.score for s in ranking.of_size(size)}
            by_score = sorted(range(len(sensors)), key=lambda k: -scores[sensors[k]])
            foretold.append(mean([spearman([scores[s] for s in sensors], one) for one in made]))
            first.append(mean([max(one) / one[by_score[0]] for one in made]))
            three.append(mean([max(one) / max(one[k] for k in by_score[:3]) for one in made]))
        score = [s.score for s in rankings[0].of_size(size)]
        result.append(
            {
                "size": size,
                "goal": GOALS[size],
                "score": mean(foretold),
                "best of starts": spearman(score, best),
                "other start": start_again,
                "perfect start": float(np.sqrt(max(start_again, 0.0))),
                "other rows": rows_again,
                "perfect rows": float(np.sqrt(max(rows_again, 0.0))),
                "scatter": float(np.exp(np.median(logs))),
                "regret": mean(first),
                "of three": mean(three),
            }
        )
    return result


def show(title: str, rows: list[dict[str, Any]]) -> None:
    """An aligned table."""
    table = [list(rows[0]), *([cell(value) for value in row.values()] for row in rows)]
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    print(f"\n{title}")
    for row in table:
        print("  " + "  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)))


def cell(value: Any) -> str:
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, nargs="+", default=[3], help="seeds, motion included")
    parser.add_argument("--split", choices=("blocks", "random"), default="blocks")
    parser.add_argument("--unseen", choices=("samples", "stretches"), default="samples")
    parser.add_argument("--starts", type=int, default=2, help="at least 2 (default)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    if args.starts < 2:
        parser.error("one start has nothing to be compared with")
    result = {}
    for rig in args.rigs:
        result[f"linear rig {rig}"] = ceilings(
            rig, args.split, args.unseen, args.starts, os.cpu_count() or 1
        )
    if len(result) > 1:
        sizes = zip(*result.values(), strict=True)
        result["mean"] = [
            {
                key: first if isinstance(first, int) else mean([row[key] for row in rows])
                for key, first in rows[0].items()
            }
            for rows in sizes
        ]
    for name, rows in result.items():
        title = f"{name}, split {args.split}, score on {args.unseen}"
        show(f"{title}: rank correlation of accuracy, ratios of error", rows)
    if args.json is not None:
        args.json.write_text(
            json.dumps({"split": args.split, "unseen": args.unseen, **result}, indent=1) + "\n"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
