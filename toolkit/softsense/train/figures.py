"""The paper's figures of a recording's subsets, as PNG and SVG.

Not imported with the package: only here is matplotlib needed.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib.figure import Figure

from softsense.recording import Recording, Split
from softsense.select import Ranking
from softsense.train.fitting import Fit
from softsense_codegen.atomic import write_bytes

# Text stays text and ids do not change from run to run: the same results give the same files.
STYLE: Any = {
    "svg.hashsalt": "softsense",
    "svg.fonttype": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "font.size": 9,
}
ACCURACY, INFORMATION = "#1f6f8b", "#d1622b"


def draw(
    folder: Path, ranking: Ranking, trained: Sequence[Fit], rec: Recording, rows: Split
) -> tuple[Path, ...]:
    """Write accuracy_per_sensor (the paper's Figs 7, 11), pairs (8, 12), accuracy_by_size (9, 14)
    and true_and_predicted (13) into ``folder``, each as .png and .svg. Returns the paths."""
    known = {one.sensors: one for one in trained}
    figures: dict[str, Callable[[], Figure]] = {
        "accuracy_per_sensor": lambda: _measures(ranking, known, 1, "sensor"),
        "accuracy_by_size": lambda: _by_size(trained),
        "true_and_predicted": lambda: _true_and_predicted(trained, rec, rows),
    }
    if len(ranking.singles) > 1:
        figures["pairs"] = lambda: _measures(ranking, known, 2, "pair, by mutual information")
    paths = []
    with matplotlib.rc_context(STYLE):
        for name, make in figures.items():
            figure = make()
            # Once for both kinds of file: to lay it out takes as long as to draw it.
            figure.draw_without_rendering()
            figure.set_layout_engine("none")
            for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None})):
                buffer = io.BytesIO()
                figure.savefig(buffer, format=kind, dpi=150, metadata=metadata)
                paths.append(write_bytes(folder / f"{name}.{kind}", buffer.getvalue()))
    return tuple(paths)


def _measures(ranking: Ranking, known: dict[tuple[str, ...], Fit], size: int, label: str) -> Figure:
    """Accuracy and mutual information of all subsets of one size, side by side."""
    ranked = sorted(ranking.of_size(size), key=lambda subset: -subset.mi_bits)
    if size == 1:
        ranked.sort(key=lambda subset: list(ranking.singles).index(subset.sensors[0]))
    place = np.arange(len(ranked))
    figure = Figure(figsize=(max(5.0, 0.38 * len(ranked) + 2), 3.4), layout="constrained")
    left = figure.subplots()
    right = left.twinx()
    right.grid(visible=False)
    right.spines["right"].set_visible(True)
    left.bar(place - 0.2, [known[s.sensors].accuracy for s in ranked], 0.38, color=ACCURACY)
    right.bar(place + 0.2, [s.mi_bits for s in ranked], 0.38, color=INFORMATION)
    names = [" + ".join(s.sensors) for s in ranked]
    left.set_xticks(place, names, rotation=60 if size > 1 or len(names) > 8 else 0)
    left.set_xlabel(label)
    left.set_ylabel("accuracy, 1 / MSE", color=ACCURACY)
    right.set_ylabel("mutual information / bit", color=INFORMATION)
    low = min(s.mi_bits for s in ranked)
    high = max(s.mi_bits for s in ranked)
    if high > low:  # information differs little between pairs: show the difference
        right.set_ylim(low - 0.5 * (high - low), high + 0.1 * (high - low))
    return figure


def _best_by_size(trained: Sequence[Fit]) -> list[Fit]:
    """For each size the subset with the least validation error, which is not the test error."""
    best: dict[int, Fit] = {}
    for one in trained:
        size = len(one.sensors)
        if size not in best or one.judged < best[size].judged:
            best[size] = one
    return [best[size] for size in sorted(best)]


def _by_size(trained: Sequence[Fit]) -> Figure:
    best = _best_by_size(trained)
    figure = Figure(figsize=(5.0, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.plot(
        [len(one.sensors) for one in trained],
        [one.accuracy for one in trained],
        ".",
        color="0.7",
        label="every subset",
    )
    axes.plot(
        [len(one.sensors) for one in best],
        [one.accuracy for one in best],
        "o-",
        color=ACCURACY,
        label="best on validation",
    )
    axes.set_xticks([len(one.sensors) for one in best])
    axes.set_xlabel("number of sensors")
    axes.set_ylabel("accuracy, 1 / MSE")
    axes.legend(frameon=False)
    return figure


def _true_and_predicted(trained: Sequence[Fit], rec: Recording, rows: Split) -> Figure:
    best = _best_by_size(trained)
    targets = len(rec.targets)
    figure = Figure(figsize=(2.2 * len(best) + 0.6, 2.3 * targets + 0.5), layout="constrained")
    panels = figure.subplots(targets, len(best), squeeze=False, sharex="row", sharey="row")
    for column, one in enumerate(best):
        test = rec.with_sensors(one.sensors).rows(rows.test)
        estimate = one.mlp.predict(test.codes)
        for row in range(targets):
            axes = panels[row][column]
            truth = test.target[:, row]
            ends = [float(truth.min()), float(truth.max())]
            axes.plot(truth, estimate[:, row], ".", markersize=1.5, color=ACCURACY, rasterized=True)
            axes.plot(ends, ends, "-", linewidth=0.8, color="black")
            if row == 0:
                axes.set_title("\n+ ".join(one.sensors), fontsize=7)
            axes.set_xlabel(f"true {rec.targets[row]}")
            if column == 0:
                axes.set_ylabel(f"predicted {rec.targets[row]}")
    return figure
