"""Levenberg-Marquardt for a network with one tanh layer: all weights in one damped step.

With residuals e(w) of every sample and output, the cost is C(w) = |e|^2 + decay |w|^2 and the step
solves (J'J + (decay + damping) I) s = -(J'e + decay w), J = de/dw (Levenberg 1944, Marquardt 1963;
Hagan and Menhaj 1994 for networks). A step that lowers the cost is taken, one that raises it is
thrown away, and the damping follows how much of the promised fall came true (Nielsen, Damping
parameter in Marquardt's method, 1999).

The output is linear in the second layer, so after each step that layer is set to its least squares
solution (Golub and Pereyra 1973; that a full Gauss-Newton step followed by it is nearly their
variable projection: Kaufman 1975, Ruhe and Wedin 1980). A third of the epochs then do as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk, ssyrk
from scipy.linalg.lapack import dposv

from softsense.train.tanh import tanh

Floats = NDArray[np.float64]
Status = Literal["validation stopped falling", "gradient small", "damping limit", "epoch limit"]

# Samples whose part of the Jacobian fits a core's cache.
BLOCK = 512
# J'J leaves samples out as long as this many remain for each weight.
CURVATURE_SAMPLES = 3
DAMPING_START = 1e-3
DAMPING_LIMIT = 1e10
GRADIENT_SMALL = 1e-7
# A fall of the validation error by less than this share is no progress.
ERROR_SMALL = 1e-3


@dataclass(frozen=True)
class Weights:
    """y = w2 @ tanh(w1 @ x + b1) + b2; w1 (hidden, inputs), w2 (outputs, hidden)."""

    w1: Floats
    b1: Floats
    w2: Floats
    b2: Floats

    def flat(self) -> Floats:
        """All weights in one vector: w1 input by input, b1, then (w2 | b2) output by output."""
        second = np.hstack([self.w2, self.b2[:, None]])
        return np.concatenate([self.w1.T.ravel(), self.b1, second.ravel()])

    def unflat(self, vector: Floats) -> Weights:
        """The inverse of ``flat`` with this object's shapes."""
        hidden, inputs = self.w1.shape
        edge = hidden * (inputs + 1)
        first = vector[:edge].reshape(inputs + 1, hidden)
        second = vector[edge:].reshape(len(self.b2), hidden + 1)
        return Weights(
            first[:-1].T.copy(), first[-1].copy(), second[:, :-1].copy(), second[:, -1].copy()
        )

    def hidden(self, x: Floats) -> Floats:
        """What the tanh units make of inputs (samples, inputs), and a 1: (samples, hidden + 1)."""
        units = len(self.b1)
        out = np.empty((len(x), units + 1))
        np.matmul(x, self.w1.T, out=out[:, :units])
        out[:, :units] += self.b1
        out[:, units] = 0.0
        tanh(out.reshape(-1))
        out[:, units] = 1.0
        return out

    def outputs(self, hidden: Floats) -> Floats:
        """Outputs (samples, outputs) for what ``hidden`` gave."""
        y: Floats = hidden @ np.column_stack([self.w2, self.b2]).T
        return y

    def predict(self, x: Floats) -> Floats:
        """Outputs (samples, outputs) for inputs (samples, inputs)."""
        return self.outputs(self.hidden(x))

    def with_best_outputs(self, hidden: Floats, target: Floats, decay: float) -> Weights:
        """The second layer that has least cost for what ``hidden`` gave."""
        units = hidden.shape[1] - 1
        gram = dsyrk(1.0, hidden.T, lower=1)
        gram[np.diag_indices(units + 1)] += decay
        _, second, flaw = dposv(gram, hidden.T @ target, lower=1, overwrite_a=1)
        if flaw:  # not positive definite to rounding: nothing better is known
            return self
        return Weights(self.w1, self.b1, second[:-1].T.copy(), second[-1].copy())


@dataclass(frozen=True)
class Outcome:
    """Where a descent ended, and why it stopped.

    ``weights`` are those of ``best_epoch``, where the larger of the training and the validation
    error, ``best_error``, was least.
    """

    weights: Weights
    status: Status
    epochs: int
    best_epoch: int
    best_error: float
    train_mse: tuple[float, ...]
    validation_mse: tuple[float, ...]


def nguyen_widrow(rng: np.random.Generator, inputs: int, hidden: int, outputs: int) -> Weights:
    """Starting weights whose units' active regions tile the box [-1, 1]^inputs.

    Nguyen and Widrow, IJCNN 1990: directions are random, |w| = 0.7 hidden^(1/inputs), and the
    biases spread the units' centres evenly along their directions.
    """
    w1 = rng.uniform(-1.0, 1.0, (hidden, inputs))
    w1 /= np.linalg.norm(w1, axis=1, keepdims=True)
    size = 0.7 * hidden ** (1.0 / inputs)
    b1 = size * np.linspace(-1.0, 1.0, hidden) * np.sign(w1[:, 0])
    w2 = rng.uniform(-0.5, 0.5, (outputs, hidden)) / np.sqrt(hidden)
    return Weights(size * w1, b1, w2, np.zeros(outputs))


def normal_equations(
    weights: Weights, x: Floats, target: Floats, hidden: Floats, stride: int = 1
) -> tuple[Floats, Floats, float]:
    """J'J (its lower triangle, to single precision), J'e and |e|^2 at ``weights``.

    ``hidden``: ``weights.hidden(x)``, which the trial of a step has already worked out. J'J is that
    of every ``stride``-th sample, times ``stride``.

    J is never whole in memory: a block of samples at a time stays in the cache while its outer
    product is added. Its columns are (w2_h tanh'_h) x_i for each input i (and 1), then tanh_h and 1
    for each output. The gradient, which says where the minimum is, has all samples and double
    precision; J'J only shapes the way there, and makes do with single precision and, of many
    samples, some (Byrd, Chin, Neveitt and Nocedal, SIAM J. Optim. 2011).
    """
    samples = len(x)
    units, inputs = weights.w1.shape
    outputs = len(weights.b2)
    edge = units * (inputs + 1)
    own = edge + units + 1
    size = edge + outputs * (units + 1)
    error = weights.outputs(hidden) - target
    # tanh' = 1 - tanh^2, and so the sums of error times input are needed with and without tanh^2.
    felt = (error[:, :, None] * np.column_stack([x, np.ones(samples)])[:, None, :]).reshape(
        samples, -1
    )
    bent = np.zeros((felt.shape[1], units))
    for begin in range(0, samples, BLOCK):
        bent += felt[begin : begin + BLOCK].T @ hidden[begin : begin + BLOCK, :units] ** 2
    sums = (felt.sum(axis=0)[:, None] - bent).reshape(outputs, inputs + 1, units)
    first = np.einsum("oiu,ou->iu", sums, weights.w2)
    gradient = np.concatenate([first.ravel(), (error.T @ hidden).ravel()])

    grams = [np.zeros((own, own), dtype=np.float32, order="F") for _ in range(outputs)]
    block = np.empty((BLOCK, own), dtype=np.float32)
    some, some_hidden = x[::stride].astype(np.float32), hidden[::stride].astype(np.float32)
    for begin in range(0, len(some), BLOCK):
        inside, out = some[begin : begin + BLOCK], some_hidden[begin : begin + BLOCK]
        jacobian = block[: len(inside)]
        jacobian[:, edge:] = out
        slope = 1 - out[:, :units] ** 2
        bias = jacobian[:, edge - units : edge]
        for output in range(outputs):
            np.multiply(slope, weights.w2[output].astype(np.float32), out=bias)
            for i in range(inputs):
                part = jacobian[:, i * units : (i + 1) * units]
                np.multiply(bias, inside[:, i : i + 1], out=part)
            grams[output] = ssyrk(
                stride, jacobian.T, beta=1.0, c=grams[output], lower=1, overwrite_c=1
            )
    gram = np.zeros((size, size), order="F")
    for output in range(outputs):
        rows = slice(edge + output * (units + 1), edge + (output + 1) * (units + 1))
        gram[:edge, :edge] += grams[output][:edge, :edge]
        gram[rows, :edge] = grams[output][edge:, :edge]
        gram[rows, rows] = grams[output][edge:, edge:]
    return gram, gradient, float(np.sum(error**2))


def descend(
    start: Weights,
    train: tuple[Floats, Floats],
    validation: tuple[Floats, Floats],
    *,
    decay: float,
    max_epochs: int,
    patience: int,
) -> Outcome:
    """Go down from ``start``; keep the weights of the lowest validation (or training) error.

    ``train``, ``validation``: (inputs, targets), both scaled to about [-1, 1]. Stops when the
    validation error has hardly fallen for ``patience`` epochs, when the gradient is small, when no
    damping gives a better step, or after ``max_epochs``.
    """
    x, target = train
    hidden = start.hidden(x)
    weights = start.with_best_outputs(hidden, target, decay)
    stride = max(1, len(x) * len(weights.b2) // (CURVATURE_SAMPLES * weights.flat().size))
    damping, growth = DAMPING_START, 2.0
    best, best_epoch = weights, 0
    first_error = float(np.mean((weights.predict(validation[0]) - validation[1]) ** 2))
    best_error = max(first_error, float(np.mean((weights.outputs(hidden) - target) ** 2)))
    progress_error, progress_epoch = best_error, 0
    train_history: list[float] = []
    validation_history: list[float] = [first_error]
    status: Status = "epoch limit"
    epoch = 0
    for epoch in range(1, max_epochs + 1):
        gram, gradient, square = normal_equations(weights, x, target, hidden, stride)
        train_history.append(square / target.size)
        vector = weights.flat()
        cost = square + decay * float(vector @ vector)
        slope = gradient + decay * vector
        if np.max(np.abs(slope)) < GRADIENT_SMALL * len(x):
            status = "gradient small"
            break
        diagonal = np.arange(len(vector))
        taken = False
        while not taken and damping < DAMPING_LIMIT:
            damped = gram.copy(order="F")
            damped[diagonal, diagonal] += decay + damping
            _, step, flaw = dposv(damped, -slope, lower=1, overwrite_a=1)
            taken = flaw == 0  # else not positive definite to rounding: damp more
            if taken:
                trial = weights.unflat(vector + step)
                trial_hidden = trial.hidden(x)
                trial = trial.with_best_outputs(trial_hidden, target, decay)
                trial_square = float(np.sum((trial.outputs(trial_hidden) - target) ** 2))
                fall = cost - trial_square - decay * float(np.sum(trial.flat() ** 2))
                taken = fall > 0
            if taken:
                promised = damping * float(step @ step) - float(slope @ step)
                damping *= max(1 / 3, 1 - (2 * fall / promised - 1) ** 3)
                growth = 2.0
            else:
                damping *= growth
                growth *= 2
        if not taken:
            status = "damping limit"
            break
        damping = max(damping, 1e-12)
        weights, hidden = trial, trial_hidden
        error = float(np.mean((weights.predict(validation[0]) - validation[1]) ** 2))
        validation_history.append(error)
        # A validation error below the training error is luck, not skill: after a few epochs a
        # network may happen to suit the validation rows while it is still poor at all others.
        error = max(error, trial_square / target.size)
        if error < best_error:
            best, best_error, best_epoch = weights, error, epoch
        if error < (1 - ERROR_SMALL) * progress_error:
            progress_error, progress_epoch = error, epoch
        elif epoch - progress_epoch >= patience:
            status = "validation stopped falling"
            break
    return Outcome(
        best,
        status,
        epoch,
        best_epoch,
        best_error,
        tuple(train_history),
        tuple(validation_history),
    )
