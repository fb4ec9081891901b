"""The report of a build: how good the estimator is, why these sensors, and what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softsense.recording import Recording
from softsense.report import charts
from softsense.report.page import Figure, Table, write_page
from softsense.select import Ranking
from softsense.verify.costs import HEADER as COST_HEADER
from softsense.verify.costs import Cost

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Estimates:
    """(samples, outputs) each, in target units: the truth, the float and the fixed network."""

    truth: Floats
    real: Floats
    fixed: Floats
    test: NDArray[np.intp]


def write_build_report(
    out: Path,
    recording: Recording,
    ranking: Ranking,
    estimates: Estimates,
    costs: Sequence[Cost],
    tables: Sequence[Table],
    lead: str,
) -> list[Path]:
    """Write report.html and figures/*.svg into ``out``; returns their paths."""
    names = list(recording.sensors)
    time = np.arange(float(len(recording))) if recording.t_s is None else recording.t_s
    time_label = "sample" if recording.t_s is None else "time / s"
    figures = []
    for index, target in enumerate(recording.targets):
        unit = recording.target_units[index]
        label = target if unit == "1" else f"{target} / {unit}"
        truth = estimates.truth[:, index]
        fixed = estimates.fixed[:, index]
        test = estimates.test
        error = fixed - truth
        figures += [
            Figure(
                f"time_{index}",
                f"{target}: true and estimated",
                "The estimate of the integer network over the whole recording.",
                charts.lines(
                    time,
                    [charts.Line(truth, "true"), charts.Line(fixed, "estimated")],
                    time_label,
                    label,
                    wide=2,
                ),
                wide=True,
            ),
            Figure(
                f"scatter_{index}",
                f"{target}: estimated against true",
                "Held-out samples only; on the line the estimate is exact.",
                charts.scatter(truth[test], fixed[test], f"true {label}", f"estimated {label}"),
            ),
            Figure(
                f"errors_{index}",
                f"{target}: errors",
                "How often the held-out estimate is off by how much.",
                charts.histogram(error[test], f"estimate - truth, {label}"),
            ),
            Figure(
                f"where_{index}",
                f"{target}: where the errors lie",
                "Root mean square error of held-out samples by true value.",
                _error_by_value(truth[test], error[test], label),
            ),
            Figure(
                f"fixed_{index}",
                f"{target}: fixed point against float",
                "What the integers change, sample by sample.",
                charts.lines(
                    time,
                    [charts.Line(fixed - estimates.real[:, index], "fixed - float")],
                    time_label,
                    label,
                ),
            ),
        ]
    information = [ranking.singles[name].mi_bits for name in names]
    figures += [
        Figure(
            "ranking",
            "What each sensor tells alone",
            "Plug-in mutual information of its raw codes with the target.",
            charts.bars(names, information, "mutual information / bit"),
        ),
        Figure(
            "sizes",
            "Best subset of each size",
            "Score on held-out time, larger is better; adding a sensor should pay.",
            _best_by_size(ranking),
        ),
    ]
    if len(names) > 1:
        figures.append(
            Figure(
                "dissimilarity",
                "Dissimilarity",
                "Bits that the column's sensor adds to what the row's sensor tells.",
                charts.heat(ranking.dissimilarity_bits, names, names, "bits"),
            )
        )
    if costs:
        figures.append(_cost_figure(costs))
    header = next(iter(sorted(out.glob("*_vectors.h"))), None)
    code = "" if header is None else Path(str(header).replace("_vectors.h", ".h")).read_text()
    return write_page(out, f"{recording.name}: estimator", lead, figures, tables, code)


def write_export_report(
    out: Path,
    name: str,
    verdict: str,
    difference: Floats,
    units: Sequence[str],
    costs: Sequence[Cost],
) -> list[Path]:
    """The short report of an export: ``difference`` (samples, outputs), fixed - float per code."""
    figures = [
        Figure(
            f"fixed_{index}",
            f"output {index}: fixed point against float",
            "What the integers change, code by code.",
            charts.lines(
                np.arange(float(len(difference))),
                [charts.Line(difference[:, index], "fixed - float")],
                "sample",
                unit,
            ),
        )
        for index, unit in enumerate(units)
    ]
    if costs:
        figures.append(_cost_figure(costs))
    table = Table("cost", COST_HEADER, [cost.row for cost in costs])
    code = (out / f"{name}.h").read_text()
    return write_page(out, f"{name}: export", verdict, figures, [table], code)


def _cost_figure(costs: Sequence[Cost]) -> Figure:
    return Figure(
        "cost",
        "Flash per target",
        "Code and constants of the generated C, gcc -O2.",
        charts.bars([c.target for c in costs], [float(c.flash) for c in costs], "bytes"),
    )


def _error_by_value(truth: Floats, error: Floats, label: str) -> str:
    edges = np.linspace(truth.min(), truth.max(), 13)
    place = np.clip(np.digitize(truth, edges) - 1, 0, 11)
    names, values = [], []
    for part in range(12):
        inside = error[place == part]
        if len(inside):
            names.append(f"{edges[part]:.3g} … {edges[part + 1]:.3g}")
            values.append(float(np.sqrt((inside**2).mean())))
    return charts.bars(names, values, f"RMSE by true {label}", "b")


def _best_by_size(ranking: Ranking) -> str:
    sizes = sorted(ranking.best)
    best = [next(s for s in ranking.of_size(k) if s.sensors == ranking.best[k]) for k in sizes]
    return charts.bars([" ".join(s.sensors) for s in best], [s.score for s in best], "score", "c")
