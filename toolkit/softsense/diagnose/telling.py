"""From a finished search to diagnosis.json: shares, intervals, places, alternatives, advice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose import engine
from softsense.diagnose.nominal import Motion, noise_rms
from softsense.diagnose.variance import Finding
from softsense.effects import all_effects
from softsense.recording import Recording

Floats = NDArray[np.float64]

# How far a form that is only approximately right may be off beyond its held-out error.
FORM_MARGIN = 0.015
RETUNE_SHARE = 0.6
RETUNE_CORRELATION = 0.8
# Mechanisms with memory of the channel's own motion: a simulator's own trace of them can be told.
RETUNABLE = {"hysteresis", "relaxation", "softening", "overshoot", "lag"}
FLIPS = 999

ADVICE = {
    frozenset({"relaxation", "hysteresis"}): "step and hold for at least 10 s, up and down",
    frozenset({"lag", "delay"}): "a chirp from 0.05 to 3 Hz at two amplitudes",
    frozenset({"lag", "backlash"}): "a chirp from 0.05 to 3 Hz at two amplitudes",
    frozenset({"delay", "backlash"}): "a chirp from 0.05 to 3 Hz at two amplitudes",
    frozenset({"backlash", "hysteresis"}): "nested minor loops",
    frozenset({"drift", "relaxation"}): "rest first, and repeat the first block at the end",
    frozenset({"drift", "random_walk"}): "a longer recording, with rests",
    frozenset({"drift", "gain"}): "rest at two strains at the beginning and at the end",
    frozenset({"drift", "softening"}): "ascending amplitudes from virgin, then the first again",
    frozenset({"gain", "temperature"}): "log the temperature",
    frozenset({"step", "random_walk"}): "repeat the recording: a step stays where it was",
}
GENERAL = "triangles at two constant rates, holds of 10 s, and ascending amplitudes"


def tell(
    sim: Recording,
    real: Recording,
    motion: Motion,
    smooth: Floats,
    channels: Sequence[engine._Channel],
    search: engine.Search,
    found: Sequence[Finding],
    seed: int,
) -> engine.Diagnosis:
    """Put the search into words and numbers."""
    rng = np.random.default_rng(seed)
    names = sim.sensors
    raw = real.codes.astype(np.float64) - sim.codes
    sigma_sim = noise_rms(sim.codes.astype(np.float64))
    sigma = np.array([c.sigma for c in channels])
    # The simulated codes carry noise of their own, which the comparison of recordings includes.
    floor = float(np.sqrt(np.mean(sigma**2 + np.minimum(sigma_sim, sigma) ** 2)))
    change = np.stack(
        [engine.predicted(c, fit) for c, fit in zip(channels, search.fits, strict=True)], axis=1
    )
    present = bool(search.steps or found)
    traces = _traces(channels, search) if search.steps else ()
    static = np.zeros((len(names), 0))
    if search.steps and any(fit.static is not None for fit in search.fits):
        width = channels[0].static.shape[1]
        static = np.stack(
            [np.zeros(width) if fit.static is None else fit.static for fit in search.fits]
        )
    augmented = sim.codes.astype(np.float64)
    if search.steps:
        augmented += change
    effects = _effects(channels, search, names, motion, smooth, rng)
    effects += [_finding(finding, names) for finding in found]
    estimators = _estimators(sim, real, augmented)
    shrink, interval = _shrink(channels, search, rng)
    data: dict[str, Any] = {
        "schema": "softsense.diagnosis/1",
        "gap": {
            "present": present,
            "rmse_codes": float(np.sqrt(np.mean(raw**2))),
            "noise_floor_codes": floor,
            "p_value": _p_value(channels, motion, smooth, rng),
            "estimator_rmse_before": estimators[0],
            "estimator_rmse_floor": estimators[1],
        },
        "where": _where(channels, names, motion, effects),
        "effects": effects,
        "unexplained": {
            "share": _left_share(channels, search) if present or search.unknown else 0.0,
            "unknown_effect": bool(search.unknown and not found),
        },
        "confusable": [
            [effect["name"], other["name"]]
            for effect in effects
            for other in effect["alternatives"]
        ],
        "after": {
            "rmse_codes": float(np.sqrt(np.mean((real.codes - augmented) ** 2))),
            "shrink": shrink,
            "shrink_ci95": interval,
            "estimator_rmse": estimators[2],
        },
        "advice": _advice(effects, search.unknown and not found),
    }
    if search.unknown and not present:
        data["gap"]["present"] = True
    return engine.Diagnosis(
        data=data,
        traces=traces,
        static=static,
        low=float(sim.target[:, 0].min()),
        high=float(sim.target[:, 0].max()),
        elapsed_s=motion.start_s + len(sim) * motion.dt_s,
        largest=float(motion.largest[-1]),
        augmented=augmented,
    )


def _traces(channels: Sequence[engine._Channel], search: engine.Search) -> tuple[engine.Trace, ...]:
    traces = []
    for number, (channel, fit) in enumerate(zip(channels, search.fits, strict=True)):
        used = 0
        for name, index in fit.picks:
            candidate = channel.candidates[name][index]
            width = 0 if candidate.fixed else candidate.columns.shape[1]
            weights = np.ones(1) if candidate.fixed else fit.weights[used : used + width]
            used += width
            values = {key: float(value) for key, value in candidate.values.items()}
            traces.append(engine.Trace(name, number, index, weights, values, candidate.form))
    return tuple(traces)


def _excess(channels: Sequence[engine._Channel]) -> Floats:
    """(channels,) sum of squares beyond the noise, in units of its variance."""
    return np.array(
        [max(float(c.residual @ c.residual) / c.sigma**2 - len(c.residual), 0.0) for c in channels]
    )


def _left_share(channels: Sequence[engine._Channel], search: engine.Search) -> float:
    floor = sum(len(c.residual) for c in channels)
    left = sum(fit.error for fit in search.fits) - floor
    return float(np.clip(left / max(float(_excess(channels).sum()), 1.0), 0.0, 1.0))


def _block_errors(channels: Sequence[engine._Channel], search: engine.Search) -> tuple[Floats, ...]:
    """Per block of time: squared error before, held-out after, and the noise's share."""
    before = np.zeros(engine.BLOCKS)
    after = np.zeros(engine.BLOCKS)
    noise = np.zeros(engine.BLOCKS)
    for channel, fit in zip(channels, search.fits, strict=True):
        blocks = np.array_split(np.arange(len(channel.residual)), engine.BLOCKS)
        free = [
            channel.candidates[n][k].columns
            for n, k in fit.picks
            if not channel.candidates[n][k].fixed
        ]
        y = channel.residual.copy()
        for n, k in fit.picks:
            if channel.candidates[n][k].fixed:
                y -= channel.candidates[n][k].columns[:, 0]
        if fit.static is not None:
            free.append(channel.static)
        columns = np.concatenate(free, axis=1) if free else np.zeros((len(y), 0))
        for number, block in enumerate(blocks):
            keep = np.ones(len(y), dtype=bool)
            keep[block] = False
            guess = np.zeros(len(block))
            if columns.shape[1]:
                weights = np.linalg.lstsq(columns[keep], y[keep], rcond=1e-10)[0]
                guess = columns[block] @ weights
            before[number] += float((channel.residual[block] ** 2).sum())
            after[number] += float(((y[block] - guess) ** 2).sum())
            noise[number] += len(block) * channel.sigma**2
    return before, after, noise


def _shrink(
    channels: Sequence[engine._Channel], search: engine.Search, rng: np.random.Generator
) -> tuple[float, list[float]]:
    """Closed share of the excess gap on held-out blocks, with a bootstrap interval."""
    if not search.steps:
        return 0.0, [0.0, 0.0]
    before, after, noise = _block_errors(channels, search)

    def share(pick: NDArray[np.intp]) -> float:
        gap = float((before - noise)[pick].sum())
        return 1.0 - float((after - noise)[pick].sum()) / max(gap, 1e-9)

    everything = np.arange(engine.BLOCKS)
    value = float(np.clip(share(everything), -1.0, 1.0))
    draws = [share(rng.integers(0, engine.BLOCKS, engine.BLOCKS)) for _ in range(400)]
    low, high = np.quantile(draws, [0.025, 0.975])
    low, high = min(low, value) - FORM_MARGIN, max(high, value) + FORM_MARGIN
    return value, [float(np.clip(low, -1.0, 1.0)), float(min(high, 1.0))]


def _effects(
    channels: Sequence[engine._Channel],
    search: engine.Search,
    names: Sequence[str],
    motion: Motion,
    smooth: Floats,
    rng: np.random.Generator,
) -> list[dict[str, Any]]:
    result = []
    base = sum(float(c.residual @ c.residual) / c.sigma**2 for c in channels)
    floor = sum(len(c.residual) for c in channels)
    gap = max(base - floor, 1.0)
    last = base
    for number, (step, rivals) in enumerate(zip(search.steps, search.rivals, strict=True)):
        before = base if number == 0 else last
        explained = max(before - step.total, 1.0)
        alternatives = [
            {"name": name, "shrink": float(np.clip((before - total) / gap, 0.0, 1.0))}
            for name, total in sorted(rivals.items(), key=lambda item: item[1])
            if name != step.name and before - total > (1.0 - engine.SIMILAR) * explained
        ]
        margins = [
            (total - step.total) / explained for name, total in rivals.items() if name != step.name
        ]
        doubt = sum(float(np.exp(-margin / (0.4 * engine.SIMILAR))) for margin in margins)
        active = [
            channel
            for channel, fit in enumerate(search.fits)
            if any(name == step.name for name, _ in fit.picks)
        ]
        share = float(np.clip(explained / gap, 0.0, 1.0))
        result.append(
            {
                "name": step.name,
                "kind": _kind(channels, search, step.name, active, motion, smooth),
                "channels": [names[channel] for channel in active],
                "confidence": float(np.clip(1.0 / (1.0 + doubt), 0.0, 0.999)),
                "alternatives": alternatives,
                "parameters": _parameters(channels, search, step.name, active, rng),
                "shrink": share,
                "shrink_ci95": [
                    float(max(share - 2 * FORM_MARGIN, 0.0)),
                    float(min(share + 2 * FORM_MARGIN, 1.0)),
                ],
            }
        )
        last = step.total
    return [effect for effect in result if effect["channels"]]


def _kind(
    channels: Sequence[engine._Channel],
    search: engine.Search,
    name: str,
    active: Sequence[int],
    motion: Motion,
    smooth: Floats,
) -> str:
    """ "retune" where the simulator shows the mechanism already, and the gap is parallel to it."""
    if name not in RETUNABLE:
        return "add"
    votes = []
    for number in active:
        channel, fit = channels[number], search.fits[number]
        history = smooth[:, number].copy()
        curve = channel.static
        history -= curve @ np.linalg.lstsq(curve, history, rcond=None)[0]
        if history.std() < 3.0 * channel.sigma:
            votes.append(False)
            continue
        index = next(k for n, k in fit.picks if n == name)
        own = channel.candidates[name][index].columns
        own = own - curve @ np.linalg.lstsq(curve, own, rcond=None)[0]
        said = own @ np.linalg.lstsq(own, history, rcond=None)[0]
        closed = 1.0 - float(((history - said) ** 2).sum() / (history**2).sum())
        gap = channel.residual - curve @ np.linalg.lstsq(curve, channel.residual, rcond=None)[0]
        together = abs(float(np.corrcoef(gap, history)[0, 1]))
        votes.append(closed > RETUNE_SHARE and together > RETUNE_CORRELATION)
    return "retune" if votes and np.mean(votes) > 0.5 else "add"


def _parameters(
    channels: Sequence[engine._Channel],
    search: engine.Search,
    name: str,
    active: Sequence[int],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The size in codes, and the shape's parameters, with intervals over blocks or channels."""
    sizes: list[float] = []
    values: dict[str, list[float]] = {}
    for number in active:
        channel, fit = channels[number], search.fits[number]
        used = 0
        for other, index in fit.picks:
            candidate = channel.candidates[other][index]
            width = 0 if candidate.fixed else candidate.columns.shape[1]
            weights = np.ones(1) if candidate.fixed else fit.weights[used : used + width]
            used += width
            if other != name:
                continue
            trace = candidate.columns @ weights
            for block in np.array_split(np.arange(len(trace)), engine.BLOCKS):
                sizes.append(float(np.sqrt(np.mean(trace[block] ** 2))))
            for key, value in candidate.values.items():
                values.setdefault(key, []).append(float(value))
    draws = [float(np.mean(rng.choice(sizes, len(sizes)))) for _ in range(200)]
    result: dict[str, Any] = {
        "rms_codes": {
            "value": float(np.mean(sizes)),
            "ci95": [float(v) for v in np.quantile(draws, [0.025, 0.975])],
        }
    }
    for key, given in values.items():
        # One grid step on either side is what the search can tell apart.
        low, high = min(given) / 1.25, max(given) * 1.25
        result[key] = {
            "value": float(np.median(given)),
            "ci95": sorted([low, high]),
        }
    return result


def _finding(finding: Finding, names: Sequence[str]) -> dict[str, Any]:
    return {
        "name": finding.name,
        "kind": "add",
        "channels": [names[channel] for channel in finding.channels],
        "confidence": 0.9,
        "alternatives": [],
        "parameters": {finding.what: {"value": finding.value, "ci95": [finding.value] * 2}},
        "shrink": 0.0,
        "shrink_ci95": [0.0, 0.0],
    }


def _where(
    channels: Sequence[engine._Channel],
    names: Sequence[str],
    motion: Motion,
    effects: Sequence[dict[str, Any]],
) -> dict[str, Any]:
    excess = _excess(channels)
    total = float(excess.sum())
    shares = {
        name: float(value / total)
        for name, value in zip(names, excess, strict=True)
        if total > 0 and value / total > 0.01
    }
    power = np.sum([(c.residual / c.sigma) ** 2 - 1.0 for c in channels], axis=0)
    time = motion.start_s + motion.dt_s * np.arange(len(motion.strain))
    rate = np.gradient(motion.strain) / motion.dt_s
    regions = []
    if effects:
        for covariate, values in (("time_s", time), ("strain", motion.strain), ("rate", rate)):
            edges = np.quantile(values, np.linspace(0.0, 1.0, 5))
            for low, high in pairwise(edges):
                inside = (values >= low) & (values <= high)
                share = float(power[inside].sum() / max(float(power.sum()), 1e-9))
                if inside.any() and share > 1.5 * float(inside.mean()):
                    regions.append(
                        {
                            "covariate": covariate,
                            "from": float(low),
                            "to": float(high),
                            "share": min(share, 1.0),
                        }
                    )
    stage = all_effects()[effects[0]["name"]].stage if effects else None
    onset = next(
        (e["parameters"]["onset_s"]["value"] for e in effects if "onset_s" in e["parameters"]), None
    )
    return {
        "channels": shares if effects else {},
        "stage": stage,
        "regions": regions,
        "onset_s": onset,
    }


def _p_value(
    channels: Sequence[engine._Channel], motion: Motion, smooth: Floats, rng: np.random.Generator
) -> float:
    """Global test: the largest of many block statistics, against random signs of the blocks.

    Under no gap a block's inner product with any covariate is as likely positive as negative.
    """
    products = []
    time = np.linspace(-1.0, 1.0, len(motion.strain))
    rate = np.gradient(motion.strain)
    for number, channel in enumerate(channels):
        covariates = np.stack(
            [np.ones_like(time), time, rate, np.abs(rate), motion.largest, smooth[:, number]],
            axis=1,
        )
        covariates = (covariates - covariates.mean(axis=0)) / (covariates.std(axis=0) + 1e-12)
        covariates[:, 0] = 1.0
        for block in (np.array_split(np.arange(len(time)), 24),):
            products.append(np.stack([covariates[b].T @ channel.residual[b] for b in block]))
    table = np.concatenate(products, axis=1)
    scale = np.sqrt((table**2).sum(axis=0)) + 1e-12
    observed = float(np.max(np.abs(table.sum(axis=0)) / scale))
    signs = rng.choice([-1.0, 1.0], size=(FLIPS, len(table)))
    null = np.max(np.abs(signs @ table) / scale, axis=1)
    return float((1 + np.sum(null >= observed)) / (FLIPS + 1))


def _estimators(sim: Recording, real: Recording, augmented: Floats) -> tuple[float, float, float]:
    """Strain RMSE on the last 30 % of the real recording, in the target's unit.

    A quick static estimator (cubic ridge) trained on the simulated, the real, and the augmented
    codes of the first 70 %.
    """
    from sklearn.linear_model import Ridge
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    cut = int(0.7 * len(sim))
    truth = real.target[:, 0]

    def error(codes: Floats) -> float:
        model = make_pipeline(
            StandardScaler(), PolynomialFeatures(3), StandardScaler(), Ridge(1e-1)
        )
        model.fit(codes[:cut:2], truth[:cut:2])
        miss = model.predict(real.codes[cut::2]) - truth[cut::2]
        return float(np.sqrt(np.mean(miss**2)))

    real_codes = real.codes.astype(np.float64)
    return error(sim.codes.astype(np.float64)), error(real_codes), error(augmented)


def _advice(effects: Sequence[dict[str, Any]], unknown: bool) -> list[str]:
    result = []
    for effect in effects:
        by_experiment: dict[str, list[str]] = {}
        for other in effect["alternatives"]:
            pair = frozenset({effect["name"], other["name"]})
            by_experiment.setdefault(ADVICE.get(pair, GENERAL), []).append(other["name"])
        for what, others in by_experiment.items():
            result.append(f"to tell {effect['name']} from {', '.join(others)}: {what}")
    if unknown:
        result.append(
            "part of the gap follows no effect of the catalogue: look at the residual over time "
            "and strain in the report, and for loads or contacts that nobody logged"
        )
    return result
