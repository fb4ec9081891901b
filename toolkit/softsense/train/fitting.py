"""From a recording to a trained network: scaling, split, restarts, and what came out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from softsense import recording
from softsense.errors import SoftsenseError
from softsense.mlp import Layer, Mlp, MlpInput, MlpOutput
from softsense.notebook import Shown
from softsense.recording import Recording, Split
from softsense.select import Selection
from softsense.train.levenberg_marquardt import Outcome, Status, Weights, descend, nguyen_widrow

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

# Of the squared weights, in units of the squared error of targets scaled to [-1, 1], summed over
# the samples. Chosen by validation error on recordings of rigs and of people (the decay table of
# tests/benchmarks/training/references.py): up to 1e-3 costs nothing, 1e-2 halves the sum of the
# output weights' sizes, which fixed point likes, but costs accuracy where noise is low.
DECAY = 1e-3
PATIENCE = 10


@dataclass(frozen=True, repr=False)
class Fit(Shown):
    """A trained network and how good it is.

    ``rmse``: "train", "validation", "test" to one root mean square error per target, in the
    targets' units. ``accuracy``: 1 / mean squared test error (mean over the targets), the paper's
    measure. ``status``: why the descent ended. ``train_mse``, ``validation_mse``: per epoch, of the
    run that won, for scaled targets.
    """

    mlp: Mlp
    split: Split
    rmse: dict[str, tuple[float, ...]]
    accuracy: float
    status: Status
    epochs: int
    best_epoch: int
    restarts: int
    train_mse: tuple[float, ...]
    validation_mse: tuple[float, ...]

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the network's inputs, in order."""
        return tuple(i.name for i in self.mlp.inputs)

    @property
    def judged(self) -> float:
        """The larger of training and validation error (summed squares), to choose subsets by."""
        return max(sum(value**2 for value in self.rmse[part]) for part in ("train", "validation"))

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        units = [f" {output.unit}" if output.unit != "1" else "" for output in self.mlp.outputs]
        return [
            ("network", repr(self.mlp)),
            *(
                (f"RMSE {part}", ", ".join(f"{v:.4g}{u}" for v, u in zip(rmse, units, strict=True)))
                for part, rmse in self.rmse.items()
            ),
            ("stopped", f"{self.status} after {self.epochs} epochs, best of {self.restarts}"),
        ]


def fit(
    rec: Recording,
    sensors: Sequence[str] | Selection | None = None,
    *,
    hidden: int = 60,
    split: str | Split = "blocks",
    seed: int = 0,
    restarts: int = 3,
    max_epochs: int = 100,
    decay: float = DECAY,
    progress: Progress | None = None,
) -> Fit:
    """Train the static network of ``hidden`` tanh units on ``sensors`` (default all).

    Of ``restarts`` descents from different starting weights the one with the lowest validation
    error wins (training error, where that is larger: see ``descend``). ``decay`` pulls weights
    towards zero. The same arguments give the same network bit for bit on one machine. ``progress``
    is called with the share of the work that is done, 0 … 1.

    Raises ``SoftsenseError`` for a recording that nothing can be learnt from.
    """
    if hidden < 1 or restarts < 1 or max_epochs < 1:
        raise SoftsenseError(
            f"hidden {hidden}, restarts {restarts}, epochs {max_epochs}: all must be at least 1"
        )
    names = sensors.sensors if isinstance(sensors, Selection) else sensors
    rec = rec if names is None else rec.with_sensors(names)
    rec.require_usable()
    rows = recording.split(len(rec), split, seed) if isinstance(split, str) else split
    known = np.concatenate([rows.train, rows.validation])
    inputs = scaled_inputs(rec, known)
    outputs = scaled_outputs(rec, known)
    x = (rec.codes - [i.offset for i in inputs]) * [i.scale for i in inputs]
    y = (rec.target - [o.offset for o in outputs]) / [o.scale for o in outputs]
    best: Outcome | None = None
    for restart in range(restarts):
        rng = np.random.default_rng([seed, restart])
        start = nguyen_widrow(rng, len(inputs), hidden, len(outputs))
        # One thread, so that no rounding depends on how many cores there are.
        with threadpool_limits(limits=1, user_api="blas"):
            outcome = descend(
                start,
                (x[rows.train], y[rows.train]),
                (x[rows.validation], y[rows.validation]),
                decay=decay,
                max_epochs=max_epochs,
                patience=PATIENCE,
            )
        if best is None or outcome.best_error < best.best_error:
            best = outcome
        if progress is not None:
            progress((restart + 1) / restarts)
    assert best is not None
    mlp = as_mlp(best.weights, inputs, outputs)
    rmse, accuracy = errors(mlp, rec, rows)
    return Fit(
        mlp,
        rows,
        rmse,
        accuracy,
        best.status,
        best.epochs,
        best.best_epoch,
        restarts,
        best.train_mse,
        best.validation_mse,
    )


def scaled_inputs(rec: Recording, rows: NDArray[np.intp]) -> tuple[MlpInput, ...]:
    """Inputs calibrated on ``rows`` and scaled so that their range there becomes [-1, 1]."""
    result = []
    for column, name in enumerate(rec.sensors):
        low, high = int(rec.codes[rows, column].min()), int(rec.codes[rows, column].max())
        if low == high:
            raise SoftsenseError(
                f"sensor {name!r} is constant on the training rows",
                where=rec.name,
                remedy="use another --split, or leave the sensor out",
            )
        end = rec.front_ends[column].describe()
        result.append(MlpInput(name, low, high, 2.0 / (high - low), (low + high) / 2.0, end))
    return tuple(result)


def scaled_outputs(rec: Recording, rows: NDArray[np.intp]) -> tuple[MlpOutput, ...]:
    """Outputs scaled so that the targets' range on ``rows`` becomes [-1, 1]."""
    result = []
    for column, name in enumerate(rec.targets):
        low, high = float(rec.target[rows, column].min()), float(rec.target[rows, column].max())
        if low == high:
            raise SoftsenseError(
                f"target {name!r} is constant on the training rows",
                where=rec.name,
                remedy="use another --split, or record more motion",
            )
        unit = rec.target_units[column]
        result.append(MlpOutput(name, unit, (high - low) / 2, (high + low) / 2, low, high))
    return tuple(result)


def as_mlp(weights: Weights, inputs: tuple[MlpInput, ...], outputs: tuple[MlpOutput, ...]) -> Mlp:
    """The network of ``weights`` between calibrated inputs and outputs."""
    layers = (Layer(weights.w1, weights.b1, "tanh"), Layer(weights.w2, weights.b2, "linear"))
    return Mlp(inputs, outputs, layers)


def errors(mlp: Mlp, rec: Recording, rows: Split) -> tuple[dict[str, tuple[float, ...]], float]:
    """Root mean square errors per part and target, and the accuracy 1 / MSE on the test rows."""
    square = (mlp.predict(rec.codes) - rec.target) ** 2
    parts = {"train": rows.train, "validation": rows.validation, "test": rows.test}
    rmse = {
        part: tuple(float(value) for value in np.sqrt(square[index].mean(axis=0)))
        for part, index in parts.items()
    }
    return rmse, 1.0 / float(square[rows.test].mean())
