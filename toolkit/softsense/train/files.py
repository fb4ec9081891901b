"""The folder of a trained network: mlp.json, recording.npz, train.json."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from softsense.recording import Recording
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
