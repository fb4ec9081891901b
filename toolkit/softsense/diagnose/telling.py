"""From a finished search to diagnosis.json: shares, intervals, places, alternatives, advice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose import engine
from softsense.diagnose.channel import Channel
from softsense.diagnose.design import BLOCKS
from softsense.diagnose.nominal import (
    Motion,
    history_groups,
    noise_rms,
    spline_basis,
)
from softsense.diagnose.pricing import WALK
from softsense.diagnose.search import Model, model
from softsense.diagnose.variance import Finding, each_alone
from softsense.diagnose.vetting import REMAINING_ALONE, Vetted, left_share, signed, walks_of
from softsense.diagnose.walk import levels, without_slow
from softsense.diagnose.wandering import with_speed
from softsense.effects import MARKS, all_effects
from softsense.recording import Recording

Floats = NDArray[np.float64]

# How far a form that is only approximately right may be off beyond its held-out error.
FORM_MARGIN = 0.015
# A rival within this much of the noise variance per sample is not told from the winner.
SIMILAR = 0.01
# A gap of this many noise variances per sample of a channel, of which so much is left, is unknown.
UNKNOWN_GAP = 0.5
UNKNOWN_SHARE = 0.35
# Where even two effects leave so much of it, something is there besides, or in their place.
REMAINING_SHARE = 0.02
# And half of that is enough where it is more than such a part of the noise of channels that have a
# gap: how loud a noise is, is known only roughly.
CLEARLY_REMAINING = 0.01
PART_OF_NOISE = 0.5
# But two of which each says much are no patchwork in place of another: these leave less than such a
# part of what the better one alone does.
EACH_SAYS_MUCH = 0.25
REMAINING_OF_SUCH = 0.03
# Beside noise, spikes or tones so much of the gap, and as much as the noise itself.
REMAINING_BESIDE = 0.15
# What tails of spikes leave of any channel, in noise variances per sample.
TAILS = 1.5
# Above this share of one common walk, the walks of several channels have one cause. Independent
# ones reach .93 of three channels, and .97 of two, once in a thousand.
COMMON = {2: 0.985}
COMMON_OF_MORE = 0.96
# Samples to either side over which a walk hardly moves.
NEAR = 5
# A simulator has a mechanism where it shows by this many times the noise; a gap is of its kind
# where so much of it is said by the same few columns.
RETUNE_SHOWN = 0.4
RETUNE_ALIKE = 0.8
FLIPS = 999
# Of longer recordings about so many rows say how well an estimator does.
ESTIMATED = 50_000

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
    frozenset({"random_walk", "temperature"}): "log the temperature",
    frozenset({"step", "random_walk"}): "repeat the recording: a step stays where it was",
}
# Where all strokes are alike, so are these: they lag behind (each closes .83 to .99 of what another
# causes on one triangle), are curves, or differ by way, or between the first stroke and the next.
ALIKE = (
    frozenset({"backlash", "delay", "hysteresis", "lag", "relaxation"}),
    frozenset({"adc_nonlinearity", "crosstalk", "gain", "saturation"}),
    frozenset({"crosstalk", "overshoot", "softening"}),
)
# Such a rival's share of the doubt.
UNSEEN = 0.4
GENERAL = "triangles at two constant rates, holds of 10 s, and ascending amplitudes"


def tell(
    sim: Recording,
    real: Recording,
    motion: Motion,
    smooth: Floats,
    channels: Sequence[Channel],
    checked: Vetted,
    found: Sequence[Finding],
    nameless: bool,
    seed: int,
) -> engine.Diagnosis:
    """Put the cheapest model into words and numbers; the others are its rivals.

    ``nameless``: something without a mean was found beside ``found``, which shall not be known.
    """
    best, jerky = checked.models[0], checked.jerky
    # What goes with the signed rate is no overshoot: that is no rival either.
    models = [made for made in checked.models if made is best or not signed(channels, made)]
    rng = np.random.default_rng(seed)
    names = sim.sensors
    raw = real.codes.astype(np.float64) - sim.codes
    sigma_sim = noise_rms(sim.codes.astype(np.float64))
    sigma = np.array([c.sigma for c in channels])
    # The simulated codes carry noise of their own, which the comparison of recordings includes.
    floor = float(np.sqrt(np.mean(sigma**2 + np.minimum(sigma_sim, sigma) ** 2)))
    change = engine.said(channels, best)
    # Jumps and bumps have sharp edges, which look like spikes, and in a walk like noise; and of
    # what nobody knows some may look like tones.
    kinds = {finding.name for finding in found}
    edges = kinds <= {"spikes"}
    excess = sum(channel.excess * channel.sigma**2 for channel in channels)
    gap = float((raw**2).sum()) - raw.size * floor**2
    minor = kinds == {"interference"} and excess > UNKNOWN_SHARE * gap
    # What tails of spikes leave is little of them, and little beside the noise.
    most = max(channel.excess / channel.samples for channel in channels)
    tails = "spikes" in kinds and excess < REMAINING_ALONE * gap and most < TAILS
    unknown = jerky and ((kinds <= {"spikes", "noise"} and not tails) or minor)
    unspoken = not found or minor or (edges and bool(best.names))
    unknown = unknown or (unspoken and _unknown(channels, best))
    unknown = unknown or (nameless and not best.names and not found)
    unknown = unknown or checked.strained_otherwise or signed(channels, best)
    if unknown:
        # What is on channels where nothing wanders is no part of that.
        calm = set(range(len(channels))) - {*best.channels_of(WALK)} if jerky else set[int]()
        there = [(finding, tuple(c for c in finding.channels if c in calm)) for finding in found]
        found = [replace(finding, channels=some) for finding, some in there if some]
    if unknown or jerky:
        best = replace(best, names=frozenset())
    if not best.names:
        change = np.zeros_like(change)
    noisy = {*checked.noisy, *_nothing_but_noise(channels, change, found, motion)}
    spoken = [c for c in range(len(channels)) if c not in noisy]
    told = replace(best, fits=tuple(best.fits[c] for c in spoken))
    heard = [channels[c] for c in spoken]
    left = left_share(heard, told)
    singles = [made for made in checked.models if len(made.names - {WALK}) == len(made.names) == 1]
    alone = min((left_share(channels, made) for made in singles), default=1.0)
    remains = bool(best.names) and _remains(heard, told, left, alone, bool(found))
    present = bool(best.names or found or unknown)
    traces = _traces(channels, best) if best.names else ()
    static = np.zeros((len(names), 0))
    if best.names and any(fit.static is not None for fit in best.fits):
        width = channels[0].static.shape[1]
        static = np.stack(
            [
                np.zeros(width) if fit.static is None else np.broadcast_to(fit.static, width)
                for fit in best.fits
            ]
        )
    augmented = sim.codes + change
    effects = _effects(channels, models, names, motion, rng) if best.names else []
    if _common(channels, best):
        for effect in effects:
            if effect["name"] == WALK:
                effect["name"] = "temperature"
                effect["alternatives"].append({"name": WALK, "shrink": 0.0})
    effects += [_finding(finding, names) for finding in found]
    effects.sort(key=lambda effect: -effect["shrink"])
    estimators = _estimators(sim, real, augmented)
    shrink, interval = _shrink(channels, best, rng)
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
            "share": (1.0 if not best.names else left) if present else 0.0,
            "unknown_effect": unknown or remains,
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
        "advice": _advice(effects, unknown or remains),
    }
    return engine.Diagnosis(
        data=data,
        traces=traces,
        static=static,
        past=engine.Past(
            sim.target[:, 0],
            smooth,
            motion.dt_s,
            motion.start_s,
            channels[0].nominal.reference.lost,
            channels[0].nominal.reference.levels,
            channels[0].nominal.reference.own,
        ),
        front_ends=dict(zip(sim.sensors, sim.front_ends, strict=True)),
        augmented=augmented,
    )


def _unknown(channels: Sequence[Channel], best: Model) -> bool:
    """Whether the gap is there, and follows nothing that the catalogue knows."""
    raw = sum(c.excess - c.samples * (c.noise / c.sigma**2 - 1.0 - c.more) for c in channels)
    return raw > UNKNOWN_GAP * channels[0].samples and left_share(channels, best) > UNKNOWN_SHARE


def _nothing_but_noise(
    channels: Sequence[Channel], change: Floats, found: Sequence[Finding], motion: Motion
) -> set[int]:
    """Channels with a noise that was ``found``, of which nothing else is left by a ``change``
    (samples, channels): how loud it is where the strain is fast, the rest does not tell."""
    left = np.stack([channel.residual for channel in channels], axis=1) - change
    alone, calm = each_alone(left), left - left.mean(axis=0)
    loud = {c for finding in found if finding.name == "noise" for c in finding.channels}

    def white(c: int) -> bool:
        return with_speed(calm[:, c], np.abs(np.gradient(motion.felt_by(c).strain)))

    return {c for c in loud if alone[c] and white(c)}


def _remains(
    channels: Sequence[Channel], best: Model, left: float, alone: float, beside: bool
) -> bool:
    """Whether the share of the gap that is ``left`` is something that no effect says; ``alone``:
    what one effect leaves; ``beside``: noise, spikes or tones were found."""
    variances = left * sum(c.excess / c.samples for c in channels)
    if len(best.names - {WALK}) > 1:
        if left < EACH_SAYS_MUCH * alone:
            return left > REMAINING_OF_SUCH
        clearly = variances > PART_OF_NOISE * sum(bool(c.entries) for c in channels)
        return left > (CLEARLY_REMAINING if clearly else REMAINING_SHARE)
    if beside:
        # How loud an uneven noise is, and so what is left beyond it, is known only roughly.
        return left > REMAINING_BESIDE and variances > len(channels)
    return left > REMAINING_ALONE


def _common(channels: Sequence[Channel], best: Model) -> bool:
    """Whether what wanders is the same on several channels but for their gains.

    So does a temperature that nobody logged; walks of the sensors' own are independent.
    """
    walks = [walk for _, walk in walks_of(channels, best)]
    if len(walks) < 2:
        return False
    slow = np.stack([levels(walk) for walk in walks], axis=1)
    slow -= slow.mean(axis=0)
    powers = np.linalg.svd(slow / slow.std(axis=0), compute_uv=False) ** 2
    return float(powers[0] / powers.sum()) > COMMON.get(len(walks), COMMON_OF_MORE)


def _traces(channels: Sequence[Channel], best: Model) -> tuple[engine.Trace, ...]:
    traces = []
    for number, (channel, fit) in enumerate(zip(channels, best.fits, strict=True)):
        for (name, index), weights in channel.weighted(fit):
            entry = channel.entries[name][index]
            values = {key: float(value) for key, value in entry.candidate.values.items()}
            near = None if entry.near is None else {k: float(v) for k, v in entry.near.items()}
            upon, form = entry.nominal is not None, entry.candidate.form
            traces.append(
                engine.Trace(
                    name, number, entry.number, near, entry.place, upon, weights, values, form
                )
            )
    return tuple(traces)


def _shrink(
    channels: Sequence[Channel], best: Model, rng: np.random.Generator
) -> tuple[float, list[float]]:
    """Closed share of the excess gap on held-out blocks, with a bootstrap interval."""
    if not best.names - {WALK}:
        return 0.0, [0.0, 0.0]
    before, after = np.zeros(BLOCKS), np.zeros(BLOCKS)
    walking = best.channels_of(WALK)
    for number, (channel, fit) in enumerate(zip(channels, best.fits, strict=True)):
        noise = channel.samples / BLOCKS * channel.noise
        gap = channel.design.squares - noise
        before += gap
        # Of a walk nothing is closed on time that lies ahead.
        after += gap if number in walking else fit.errors - noise

    def share(pick: NDArray[np.intp]) -> float:
        return 1.0 - float(after[pick].sum()) / max(float(before[pick].sum()), 1e-9)

    value = float(np.clip(share(np.arange(BLOCKS)), -1.0, 1.0))
    draws = [share(rng.integers(0, BLOCKS, BLOCKS)) for _ in range(400)]
    low, high = np.quantile(draws, [0.025, 0.975])
    low, high = min(low, value) - FORM_MARGIN, max(high, value) + FORM_MARGIN
    return value, [float(np.clip(low, -1.0, 1.0)), float(min(high, 1.0))]


def _effects(
    channels: Sequence[Channel],
    models: Sequence[Model],
    names: Sequence[str],
    motion: Motion,
    rng: np.random.Generator,
) -> list[dict[str, Any]]:
    """Every effect of the cheapest model, with what could stand in its place."""
    best = models[0]
    samples = sum(channel.samples for channel in channels)
    raw = max(sum(channel.excess for channel in channels), 1.0)
    # An equation that closes the gap down to the noise is right, and what fits worse is not; one
    # that leaves something over is right only nearly, and so may be what leaves over twice as much.
    alike = motion.strokes_alike()
    slack = SIMILAR * samples + left_share(channels, best) * raw
    result = []
    for name in sorted(best.names):
        others = best.names - {name}
        rivals = {
            next(iter(made.names - others)): made.price - best.price
            for made in models
            if len(made.names) == len(best.names) and others < made.names and made is not best
        }
        without = next((made.price for made in models if made.names == others), None)
        if without is None:
            without = model(channels, others).price
        share = float(np.clip((without - best.price) / raw, 0.0, 1.0))
        near = sorted((gap, other) for other, gap in rivals.items() if gap < slack)
        doubt = sum(float(np.exp(-2.0 * gap / slack)) for gap in rivals.values())
        if alike:
            group = frozenset[str]().union(*(group for group in ALIKE if name in group))
            unseen = group - best.names - {other for _, other in near}
            near += sorted((rivals.get(other, share * raw), other) for other in unseen)
            doubt += UNSEEN * len(unseen)
        active = best.channels_of(name)
        closes = 0.0 if name == WALK else share
        result.append(
            {
                "name": name,
                "kind": _kind(channels, best, name, active, motion),
                "channels": [names[channel] for channel in active],
                "confidence": float(np.clip(1.0 / (1.0 + doubt), 0.0, 0.999)),
                "alternatives": [
                    {"name": other, "shrink": float(np.clip(closes - gap / raw, 0.0, 1.0))}
                    for gap, other in near
                ],
                "parameters": _parameters(channels, best, name, active, rng),
                "shrink": closes,
                "shrink_ci95": [
                    float(max(closes - 2 * FORM_MARGIN, 0.0)),
                    float(min(closes + 2 * FORM_MARGIN, 1.0)),
                ],
            }
        )
    return result


def _kind(
    channels: Sequence[Channel], best: Model, name: str, active: Sequence[int], motion: Motion
) -> str:
    """ "retune" where the simulator has the mechanism already, and the gap is of its kind."""
    # A few columns need no more rows.
    step = max(1, len(motion.strain) // ESTIMATED)
    groups = {k: g[::step] for k, g in history_groups(motion.strain, motion.dt_s).items()}
    if name not in groups or not active:
        return "add"
    curve = spline_basis(motion.strain[::step])
    others = np.concatenate([curve, *(part for key, part in groups.items() if key != name)], axis=1)
    alone = _beyond(curve, groups[name])
    beside = _beyond(others, groups[name])
    votes = []
    for number in active:
        channel, fit = channels[number], best.fits[number]
        history = _beyond(others, channel.nominal.u[::step])
        shown = history - _beyond(beside, history)
        pick, weights = next(w for w in channel.weighted(fit) if w[0][0] == name)
        gap = _beyond(curve, (channel.columns(pick) @ weights)[::step])
        alike = 1.0 - float((_beyond(alone, gap) ** 2).sum() / (gap**2).sum())
        votes.append(shown.std() > RETUNE_SHOWN * channel.sigma and alike > RETUNE_ALIKE)
    return "retune" if np.mean(votes) > 0.5 else "add"


def _beyond(basis: Floats, signal: Floats) -> Floats:
    """What of ``signal`` (samples, …) the columns of ``basis`` do not say."""
    rest: Floats = signal - basis @ np.linalg.lstsq(basis, signal, rcond=1e-9)[0]
    return rest


def _parameters(
    channels: Sequence[Channel],
    best: Model,
    name: str,
    active: Sequence[int],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The size in codes, and the shape's parameters, with intervals over blocks or channels."""
    sizes: list[float] = []
    values: dict[str, list[tuple[float, float, float]]] = {}
    for number in active:
        channel, fit = channels[number], best.fits[number]
        if name == WALK:
            walk = channel.residual - channel.predicted(fit)
            slow = walk - without_slow(walk[:, None], NEAR)[:, 0]
            sizes += [float(block.std()) for block in np.array_split(slow, BLOCKS)]
            continue
        pick, weights = next(w for w in channel.weighted(fit) if w[0][0] == name)
        trace = channel.columns(pick) @ weights
        for block in np.array_split(np.arange(len(trace)), BLOCKS):
            sizes.append(float(np.sqrt(np.mean(trace[block] ** 2))))
        for key in sorted(channel.entries[name][pick[1]].candidate.values.keys() - MARKS):
            values.setdefault(key, []).append(channel.interval(fit, name, key))
    draws = [float(np.mean(rng.choice(sizes, len(sizes)))) for _ in range(200)]
    result: dict[str, Any] = {
        "rms_codes": {
            "value": float(np.mean(sizes)),
            "ci95": [float(v) for v in np.quantile(draws, [0.025, 0.975])],
        }
    }
    for key, given in values.items():
        middles, lows, highs = zip(*given, strict=True)
        result[key] = {"value": float(np.median(middles)), "ci95": [min(lows), max(highs)]}
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
    channels: Sequence[Channel],
    names: Sequence[str],
    motion: Motion,
    effects: Sequence[dict[str, Any]],
) -> dict[str, Any]:
    excess = np.array([channel.excess for channel in channels])
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
    channels: Sequence[Channel], motion: Motion, smooth: Floats, rng: np.random.Generator
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
    # A few coefficients need no more rows.
    step = max(2, len(sim) // ESTIMATED)
    truth = real.target[:, 0]

    def error(codes: Floats) -> float:
        model = make_pipeline(
            StandardScaler(), PolynomialFeatures(3), StandardScaler(), Ridge(1e-1)
        )
        model.fit(codes[:cut:step], truth[:cut:step])
        miss = model.predict(real.codes[cut::step]) - truth[cut::step]
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
