"""The static network as a scikit-learn regressor, for pipelines, searches and comparisons.

>>> from softsense.sklearn import MlpEstimator
>>> MlpEstimator(hidden=20).fit(codes, strain).score(codes, strain)  # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data
from threadpoolctl import threadpool_limits

from softsense import recording
from softsense.train.fitting import DECAY, PATIENCE
from softsense.train.levenberg_marquardt import descend, nguyen_widrow

Floats = NDArray[np.float64]

# Samples that a split takes.
FEWEST = 100


class MlpEstimator(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """One hidden layer of tanh units, trained by Levenberg-Marquardt with early stopping.

    Inputs and targets are scaled to [-1, 1] over the training rows. Rows are taken in their order
    in time: ``split`` is "blocks", "forward" or "random" (see ``softsense.fit``), of which the
    validation rows stop the descent and the test rows stay unused.

    Parameters
    ----------
    hidden : int
        tanh units.
    decay : float
        Weight decay.
    max_epochs : int
        Limit of one descent.
    restarts : int
        Descents from different starting weights; the best on validation is kept.
    split : str
        How rows are held out.
    seed : int
        Of the starting weights and of the split.

    Attributes
    ----------
    weights_ : Weights
        Of the scaled network.
    status_ : str
        Why the descent stopped.
    n_features_in_ : int
        Inputs seen at ``fit``.
    """

    def __init__(
        self,
        hidden: int = 60,
        *,
        decay: float = DECAY,
        max_epochs: int = 100,
        restarts: int = 1,
        split: str = "blocks",
        seed: int = 0,
    ) -> None:
        self.hidden = hidden
        self.decay = decay
        self.max_epochs = max_epochs
        self.restarts = restarts
        self.split = split
        self.seed = seed

    def fit(self, X: ArrayLike, y: ArrayLike) -> MlpEstimator:
        """Train on ``X`` (samples, inputs) and ``y`` (samples,) or (samples, outputs).

        Raises ``ValueError`` for what scikit-learn refuses, and for fewer than 2 samples.
        """
        x, target = validate_data(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64, ensure_min_samples=2
        )
        targets = target.astype(np.float64).reshape(len(target), -1)
        self._flat = target.ndim == 1
        train, validation = self._rows(len(x))
        self._input = _range(x[train])
        self._output = _range(targets[train])
        scaled = (x - self._input[0]) / self._input[1]
        wanted = (targets - self._output[0]) / self._output[1]
        best = None
        for restart in range(self.restarts):
            rng = np.random.default_rng([self.seed, restart])
            start = nguyen_widrow(rng, x.shape[1], self.hidden, targets.shape[1])
            with threadpool_limits(limits=1, user_api="blas"):
                made = descend(
                    start,
                    (scaled[train], wanted[train]),
                    (scaled[validation], wanted[validation]),
                    decay=self.decay,
                    max_epochs=self.max_epochs,
                    patience=PATIENCE,
                )
            if best is None or made.best_error < best.best_error:
                best = made
        if best is None:
            raise ValueError(f"restarts must be at least 1, and is {self.restarts}")
        self.weights_ = best.weights
        self.status_ = best.status
        self.n_iter_ = best.epochs
        return self

    def predict(self, X: ArrayLike) -> Floats:
        """Estimates of ``X`` (samples, inputs), in the shape and unit of the ``y`` of ``fit``."""
        check_is_fitted(self, "weights_")
        x = validate_data(self, X, reset=False, dtype=np.float64)
        y: Floats = self.weights_.predict((x - self._input[0]) / self._input[1])
        y = y * self._output[1] + self._output[0]
        return y[:, 0] if self._flat else y

    def _rows(self, samples: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        everything = np.arange(samples)
        if samples < FEWEST:
            # Too few to hold any out.
            return everything, everything
        rows = recording.split(samples, self.split, self.seed)
        return rows.train, rows.validation

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # A descent that stops early is no good on the tiny sets that scikit-learn tries.
        tags.regressor_tags.poor_score = True
        return tags


def _range(values: Floats) -> tuple[Floats, Floats]:
    """Middle and half of the range of each column; half 1 for a constant one."""
    low, high = values.min(axis=0), values.max(axis=0)
    half = (high - low) / 2.0
    return (low + high) / 2.0, np.where(half > 0, half, 1.0)
