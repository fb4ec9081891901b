"""The static network against other learners on the same rows, and the time of all subsets.

    python tests/benchmarks/training/references.py [RECORDING] [--target NAME] [--json FILE]

Without a recording, the built-in linear rig (seven sensors, 8000 samples). Prints test RMSE and
ratios of mean squared error to the static network's: scikit-learn's MLPRegressor (lbfgs and adam,
60 tanh units), Levenberg-Marquardt with Bayesian regularisation, k nearest neighbours, and two that
use history, a linear model on lagged inputs and a small GRU; then the weight decay's effect; with
--all, the time of every subset, and CPU time and error beside a plain Levenberg-Marquardt loop's.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, solve
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from threadpoolctl import threadpool_limits

from softsense import recording
from softsense.recording import Recording, Split
from softsense.select import select
from softsense.simulate import linear_rig, random_motion, run, to_recording
from softsense.train import Settings, fit, fit_all
from softsense.train.all_subsets import subsets_of
from softsense.train.fitting import DECAY
from softsense.train.levenberg_marquardt import Weights, nguyen_widrow, normal_equations

Floats = NDArray[np.float64]

LAGS = 20
NEIGHBOURS = (1, 2, 4, 8, 16, 32)
GRU_UNITS = 32
GRU_WINDOW = 40
BAYESIAN_EPOCHS = 200
DAMPING_LIMIT = 1e10


def scaled(rec: Recording, rows: Split) -> tuple[np.ndarray, np.ndarray, float]:
    """Inputs and the first target in [-1, 1] on training rows, and the target's unit per 1."""
    low, high = rec.codes[rows.train].min(axis=0), rec.codes[rows.train].max(axis=0)
    target = rec.target[:, 0]
    down, up = target[rows.train].min(), target[rows.train].max()
    half = (up - down) / 2
    return (2.0 * rec.codes - low - high) / (high - low), (target - down) / half - 1, float(half)


def lagged(x: np.ndarray) -> np.ndarray:
    """Each row with the ``LAGS`` rows before it (the first row repeated before the start)."""
    index = np.maximum(np.arange(len(x))[:, None] - np.arange(LAGS + 1), 0)
    return x[index].reshape(len(x), -1)


def bayesian(x: np.ndarray, y: np.ndarray) -> tuple[Weights, float]:
    """A network of 60 units whose weight decay is inferred, and its effective parameters.

    MacKay (Neural Computation 4, 1992) within Levenberg-Marquardt, as Foresee and Hagan (ICNN 1997,
    the rule of MATLAB's trainbr) do: minimise beta |e|^2 + alpha |w|^2, and after each step set
    gamma = sum of l / (l + alpha / beta) over the eigenvalues l of J'J, alpha = gamma / 2|w|^2,
    beta = (samples - gamma) / 2|e|^2. It needs no validation rows, so it is given them to learn.
    """
    start = nguyen_widrow(np.random.default_rng(0), x.shape[1], 60, 1)
    vector, damping, decay, gamma = start.flat(), 1e-3, 1e-3, float(start.flat().size)
    for _ in range(BAYESIAN_EPOCHS):
        weights = start.unflat(vector)
        gram, gradient, square = normal_equations(weights, x, y[:, None], weights.hidden(x))
        # Eigenvectors solve for every damping; rounding can leave a value just below zero.
        values, vectors = eigh(gram, lower=True)
        values = np.maximum(values, 0.0)
        slope = vectors.T @ (gradient + decay * vector)
        cost = square + decay * float(vector @ vector)
        better = False
        while not better and damping < DAMPING_LIMIT:
            trial = vector - vectors @ (slope / (values + decay + damping))
            error = start.unflat(trial).predict(x)[:, 0] - y
            better = float(error @ error) + decay * float(trial @ trial) < cost
            damping = max(damping * (0.1 if better else 10.0), 1e-12)
        if not better:
            break
        vector, square = trial, float(error @ error)
        gamma = float(np.sum(values / (values + decay)))
        decay = (gamma / float(vector @ vector)) / ((len(y) - gamma) / square)
    return start.unflat(vector), gamma


def gru(x: np.ndarray, y: np.ndarray, rows: Split, seconds: float) -> np.ndarray:
    """Estimates of a GRU over the last two seconds, stopped on validation or after ``seconds``."""
    import torch

    torch.manual_seed(0)
    torch.set_num_threads(os.cpu_count() or 1)
    index = np.maximum(np.arange(len(x))[:, None] - np.arange(GRU_WINDOW)[::-1], 0)
    windows = torch.tensor(x[index], dtype=torch.float32)
    truth = torch.tensor(y, dtype=torch.float32)
    cell = torch.nn.GRU(x.shape[1], GRU_UNITS, batch_first=True)
    head = torch.nn.Linear(GRU_UNITS, 1)
    parameters = [*cell.parameters(), *head.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=4e-3)

    def estimate(part: Any) -> torch.Tensor:
        return head(cell(windows[part])[0][:, -1])[:, 0]

    best, kept = np.inf, np.zeros(len(y))
    begin = time.perf_counter()
    while time.perf_counter() - begin < seconds:
        for batch in torch.randperm(len(rows.train)).split(128):
            part = rows.train[batch.numpy()]
            optimiser.zero_grad()
            torch.mean((estimate(part) - truth[part]) ** 2).backward()
            optimiser.step()
        with torch.no_grad():
            error = float(torch.mean((estimate(rows.validation) - truth[rows.validation]) ** 2))
            if error < best:
                best = error
                kept = torch.cat([estimate(p) for p in torch.arange(len(y)).split(2000)]).numpy()
        for group in optimiser.param_groups:
            group["lr"] *= 0.97
    return kept


def references(rec: Recording, seconds: float) -> list[dict[str, Any]]:
    """Test RMSE, its MSE over the static network's, and seconds of wall time."""
    begin = time.perf_counter()
    own = fit(rec)
    rows = own.split
    result = [{"learner": "LM, 60 tanh", "history": "no", "rmse": own.rmse["test"][0]}]
    spent = [time.perf_counter() - begin]
    x, y, unit = scaled(rec, rows)
    known = np.sort(np.concatenate([rows.train, rows.validation]))

    def add(name: str, history: str, estimate: np.ndarray, begin: float) -> None:
        error = unit * (estimate - y)[rows.test]
        rmse = float(np.sqrt(np.mean(error**2)))
        result.append({"learner": name, "history": history, "rmse": rmse})
        spent.append(time.perf_counter() - begin)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        for solver, iterations in (("lbfgs", 1500), ("adam", 300)):
            begin = time.perf_counter()
            best, kept = np.inf, y
            for seed in range(3):  # as many starts as the static network has
                learner = MLPRegressor(
                    hidden_layer_sizes=(60,),
                    activation="tanh",
                    solver=solver,
                    max_iter=iterations,
                    random_state=seed,
                )
                estimate = learner.fit(x[rows.train], y[rows.train]).predict(x)
                error = np.mean((estimate - y)[rows.validation] ** 2)
                if error < best:
                    best, kept = error, estimate
            add(f"MLPRegressor {solver}", "no", kept, begin)
    begin = time.perf_counter()
    inferred, gamma = bayesian(x[known], y[known])
    name = f"LM, Bayesian ({gamma:.0f} effective weights)"
    add(name, "no", inferred.predict(x)[:, 0], begin)
    begin = time.perf_counter()
    tried = [
        KNeighborsRegressor(k).fit(x[rows.train], y[rows.train]).predict(x) for k in NEIGHBOURS
    ]
    validation = [np.mean((estimate - y)[rows.validation] ** 2) for estimate in tried]
    add("nearest neighbours", "no", tried[int(np.argmin(validation))], begin)
    begin = time.perf_counter()
    add("linear", "no", Ridge(1e-6).fit(x[known], y[known]).predict(x), begin)
    begin = time.perf_counter()
    past = lagged(x)
    add(f"linear, {LAGS} lags", "yes", Ridge(1e-3).fit(past[known], y[known]).predict(past), begin)
    begin = time.perf_counter()
    add(f"GRU {GRU_UNITS}, {GRU_WINDOW} steps", "yes", gru(x, y, rows, seconds), begin)
    for row, time_s in zip(result, spent, strict=True):
        row["mse_over_lm"] = (row["rmse"] / own.rmse["test"][0]) ** 2
        row["seconds"] = time_s
    return result


def decays(rec: Recording) -> list[dict[str, Any]]:
    """Validation and test RMSE (mean over seeds), and sum |w2|, for several weight decays."""
    result = []
    for decay in (0.0, 1e-4, 1e-3, 1e-2, 1e-1):
        fits = [fit(rec, seed=seed, restarts=1, decay=decay) for seed in range(3)]
        result.append(
            {
                "decay": decay,
                "default": "yes" if decay == DECAY else "",
                "validation": float(np.mean([one.rmse["validation"][0] for one in fits])),
                "test": float(np.mean([one.rmse["test"][0] for one in fits])),
                "sum_w2": float(np.mean([np.abs(o.mlp.layers[1].weight).sum() for o in fits])),
            }
        )
    return result


def plain_descent(start: Weights, rows: list[tuple[Floats, Floats]], epochs: int) -> Weights:
    """Levenberg-Marquardt as it is usually written: J whole, in doubles, the damping by tens.

    ``rows``: training and validation (inputs, targets). The best of all epochs on validation.
    """
    (x, y), (unseen, wanted) = rows
    weights, damping = start, 1e-3
    best, best_error = start, np.inf
    for _ in range(epochs):
        out = np.tanh(x @ weights.w1.T + weights.b1)
        error = out @ weights.w2.T + weights.b2 - y
        felt = (1 - out**2) * weights.w2
        inner = [felt * x[:, [i]] for i in range(x.shape[1])]
        jacobian = np.hstack([*inner, felt, out, np.ones((len(x), 1))])
        vector = weights.flat()
        gram, slope = jacobian.T @ jacobian, jacobian.T @ error[:, 0] + DECAY * vector
        cost = float(np.sum(error**2)) + DECAY * float(vector @ vector)
        while damping < 1e10:
            damped = gram + (DECAY + damping) * np.eye(len(gram))
            moved = vector - solve(damped, slope, assume_a="pos")
            trial = weights.unflat(moved)
            error = np.tanh(x @ trial.w1.T + trial.b1) @ trial.w2.T + trial.b2 - y
            if float(np.sum(error**2)) + DECAY * float(moved @ moved) < cost:
                weights, damping = trial, max(0.1 * damping, 1e-12)
                break
            damping *= 10.0
        else:
            return best
        error = np.tanh(unseen @ weights.w1.T + weights.b1) @ weights.w2.T + weights.b2 - wanted
        if float(np.sum(error**2)) < best_error:
            best, best_error = weights, float(np.sum(error**2))
    return best


def beside_plain(rec: Recording, split: str, every: int, epochs: int) -> dict[str, Any]:
    """CPU time and test error of ``fit`` and of the plain loop, on every so many-th subset."""
    rows = recording.split(len(rec), split, 0)
    parts = (rows.train, rows.validation, rows.test)
    seconds, errors = np.zeros(2), []
    for chosen in subsets_of(rec.sensors)[::every]:
        part = rec.with_sensors(chosen)
        begin = time.process_time()
        ours = fit(part, split=rows, restarts=1)
        middle = time.process_time()
        mlp = ours.mlp
        x = (part.codes - [i.offset for i in mlp.inputs]) * [i.scale for i in mlp.inputs]
        y = (part.target - mlp.outputs[0].offset) / mlp.outputs[0].scale
        start = nguyen_widrow(np.random.default_rng([0, 0]), len(chosen), 60, 1)
        with threadpool_limits(1, user_api="blas"):
            plain = plain_descent(start, [(x[r], y[r]) for r in parts[:2]], epochs)
        seconds += (middle - begin, time.process_time() - middle)
        unseen = plain.predict(x[rows.test]) - y[rows.test]
        errors.append((ours.rmse["test"][0], mlp.outputs[0].scale * np.sqrt(np.mean(unseen**2))))
    mse = np.exp(2.0 * np.log(errors).mean(axis=0))
    return {
        "split": split,
        "networks": len(errors),
        "plain_epochs": epochs,
        "plain_cpu_s": float(seconds[1]),
        "cpu_s": float(seconds[0]),
        "cpu_ratio": float(seconds[0] / seconds[1]),
        "mse_ratio": float(mse[0] / mse[1]),
    }


def every_subset(rec: Recording, epochs: int) -> list[dict[str, Any]]:
    """Wall and CPU time of all subsets, on every core."""
    jobs = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder:
        before, begin = os.times(), time.perf_counter()
        trained = fit_all(rec, Path(folder), Settings(max_epochs=epochs), jobs=jobs)
        wall, after = time.perf_counter() - begin, os.times()
    # of this process and its finished workers; other load does not count here, as it does in wall
    cpu = sum(after[:4]) - sum(before[:4])
    return [
        {
            "networks": len(trained),
            "jobs": jobs,
            "wall_s": wall,
            "cpu_s": cpu,
            "mean_epochs": float(np.mean([one.epochs for one in trained])),
            "epoch_limit": sum(one.status == "epoch limit" for one in trained),
            "geometric_mean_mse": float(np.exp(-np.mean([np.log(t.accuracy) for t in trained]))),
        }
    ]


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
    parser.add_argument("--size", type=int, default=2, help="the best so many sensors, and all")
    parser.add_argument("--gru-seconds", type=float, default=45.0, help="bound for each GRU")
    parser.add_argument("--all", action="store_true", help="time the training of every subset")
    parser.add_argument("--max-epochs", type=int, default=100, help="with --all (default 100)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    if args.recording is None:
        rig, strain = linear_rig(0), random_motion(8000, 0.05, 0)
        rec = to_recording(rig, run(rig, strain, 0))
    else:
        rec = recording.read(args.recording, target=args.target)
    result: dict[str, Any] = {}
    for sensors in dict.fromkeys([select(rec, args.size).sensors, rec.sensors]):
        name = " ".join(sensors)
        part = rec.with_sensors(sensors)
        result[name] = {"learners": references(part, args.gru_seconds), "decay": decays(part)}
        show(f"{name}: test RMSE of {rec.targets[0]}", result[name]["learners"])
        show(f"{name}: weight decay, mean of three seeds", result[name]["decay"])
    if args.all:
        result["every_subset"] = every_subset(rec, args.max_epochs)
        show("every subset", result["every_subset"])
        result["beside_plain"] = [beside_plain(rec, how, 9, 80) for how in ("blocks", "random")]
        show("every ninth subset, beside a plain loop", result["beside_plain"])
    if args.json is not None:
        args.json.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
