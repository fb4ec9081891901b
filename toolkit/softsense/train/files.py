"""The folder of a trained network: mlp.json, recording.npz, train.json."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from softsense.recording import Recording
from softsense.select import Ranking
from softsense.train.comparison import Agreement
from softsense.train.fitting import Fit
from softsense_codegen.atomic import write_bytes, write_text


def save(fit: Fit, rec: Recording, folder: Path, extra: dict[str, Any] | None = None) -> None:
    """Write ``fit`` and the codes and targets that it was trained on (see ``summary``)."""
    write_text(folder / "mlp.json", fit.mlp.to_json())
    used = rec.with_sensors(fit.sensors)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, codes=used.codes, target=used.target)
    write_bytes(folder / "recording.npz", buffer.getvalue())
    data = {**summary(fit), "recording": rec.name, **(extra or {})}
    write_text(folder / "train.json", json.dumps(data, indent=1) + "\n")


def summary(fit: Fit) -> dict[str, Any]:
    """What train.json tells: sensors, errors per target, how the split was drawn, the status."""
    return {
        "schema": "softsense.train/1",
        "sensors": list(fit.sensors),
        "targets": [output.name for output in fit.mlp.outputs],
        "units": [output.unit for output in fit.mlp.outputs],
        "hidden": len(fit.mlp.layers[0].bias),
        "rmse": {part: list(values) for part, values in fit.rmse.items()},
        "accuracy": fit.accuracy,
        "status": fit.status,
        "epochs": fit.epochs,
        "best_epoch": fit.best_epoch,
        "restarts": fit.restarts,
        "split": {
            "how": fit.split.how,
            "train": len(fit.split.train),
            "validation": len(fit.split.validation),
            "test": len(fit.split.test),
        },
        "history": {"train_mse": fit.train_mse, "validation_mse": fit.validation_mse},
    }


def save_table(
    folder: Path, ranking: Ranking, trained: Sequence[Fit], agreement: Sequence[Agreement]
) -> None:
    """Write subsets.csv, one row per subset, and all.json, how well the ranking foretold them."""
    known = {one.sensors: one for one in trained}
    order = tuple(ranking.singles)
    buffer = io.StringIO()
    table = csv.writer(buffer, lineterminator="\n")
    parts = ("train", "validation", "test")
    header = [f"rmse_{part}_{target}" for target in ranking.targets for part in parts]
    table.writerow(
        ["sensors", "size", "score", "mi_bits", "mi_lower_bits", "accuracy", *header, "status"]
    )
    for subset in ranking.subsets:
        one = known[tuple(sorted(subset.sensors, key=order.index))]
        errors = [one.rmse[part][i] for i in range(len(ranking.targets)) for part in parts]
        measures = [subset.score, subset.mi_bits, subset.mi_lower_bits, one.accuracy, *errors]
        numbers = ["" if value is None else f"{value:.9g}" for value in measures]
        table.writerow([" ".join(subset.sensors), len(subset.sensors), *numbers, one.status])
    write_text(folder / "subsets.csv", buffer.getvalue())
    data = {
        "schema": "softsense.all_subsets/1",
        "targets": list(ranking.targets),
        "subsets": len(trained),
        "agreement": [asdict(one) for one in agreement],
    }
    write_text(folder / "all.json", json.dumps(data, indent=1) + "\n")
