"""The diagnosis: fit every effect's trace to the residual, keep what held-out time confirms.

The residual of a channel is its real codes less the noiseless simulated ones. Each effect offers
columns (see ``Effect.explain``); a model is a set of effects per channel plus, where it pays, a
static miscalibration. Models are compared by squared error on blocks of time that the fit has not
seen, in units of the noise variance, with a price per weight.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose import variance
from softsense.diagnose.nominal import Motion, denoise, motion_of, noise_rms, nominals, spline_basis
from softsense.effects import Candidate, all_effects
from softsense.errors import SoftsenseError
from softsense.recording import Recording

Floats = NDArray[np.float64]

BLOCKS = 12
# Prices and thresholds, in units of the noise variance (a chance column gains about 1). Set on
# made cases of the training half of tests/benchmarks/gap.
WEIGHT_PRICE = 12.0
# Per sample: an effect of half the noise's size gains a quarter.
CHANNEL_GAIN = 0.25
STATIC_PRICE = 0.5
FIRST_SHARE = 0.15
NEXT_SHARE = 0.5
NEXT_GAIN = 1.5
SIMILAR = 0.05
UNKNOWN_SHARE = 0.35
MOST_EFFECTS = 3
WANDER_LEFT = 0.04
STATIC_KNOTS = 8


@dataclass(frozen=True)
class Trace:
    """One effect on one channel: the candidate that fits, its weights, and what it closes."""

    effect: str
    channel: int
    candidate: int
    weights: Floats
    values: dict[str, float]
    form: str


@dataclass(frozen=True)
class Diagnosis:
    """What was found. ``data`` is diagnosis.json; ``traces`` and ``static`` let it be applied."""

    data: dict[str, Any]
    traces: tuple[Trace, ...]
    static: Floats = field(repr=False)
    low: float = 0.0
    high: float = 1.0
    elapsed_s: float = 0.0
    largest: float = 0.0
    augmented: Floats = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    def to_json(self) -> str:
        """diagnosis.json."""
        return json.dumps(self.data, indent=1) + "\n"

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that were found, largest first."""
        return tuple(effect["name"] for effect in self.data["effects"])

    def state_json(self) -> str:
        """What ``augment`` needs beside diagnosis.json."""
        return json.dumps(
            {
                "schema": "softsense.augmentation/1",
                "low": self.low,
                "high": self.high,
                "elapsed_s": self.elapsed_s,
                "largest": self.largest,
                "static": self.static.tolist(),
                "traces": [
                    {**vars(trace), "weights": trace.weights.tolist()} for trace in self.traces
                ],
            }
        )


@dataclass(frozen=True)
class _Fit:
    """A fitted model of one channel: held-out error / noise variance, and the full fit."""

    error: float
    weights: Floats
    static: Floats | None
    picks: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class _Channel:
    """All that the search needs of one channel."""

    residual: Floats
    sigma: float
    static: Floats
    candidates: dict[str, list[Candidate]]


def diagnose(
    sim: Recording, real: Recording, *, seed: int = 0, without: Sequence[str] = ()
) -> Diagnosis:
    """Compare a simulated and a real recording of the same motion.

    ``without``: effects of the catalogue that shall not be known (to test what happens then).

    Raises ``SoftsenseError`` where the recordings do not belong together, or a channel is dead.
    """
    sim, real = _aligned(sim, real)
    _check_channels(sim, real)
    low, high = float(sim.target[:, 0].min()), float(sim.target[:, 0].max())
    start_s = float(sim.t_s[0]) if sim.t_s is not None else 0.0
    temp_c = real.context.get("temp_c")
    motion = motion_of(sim, low, high, start_s, 0.0)
    if temp_c is not None:
        motion = Motion(motion.strain, motion.largest, motion.dt_s, motion.start_s, temp_c)
    codes = sim.codes.astype(np.float64)
    smooth = denoise(codes, motion)
    residual = real.codes.astype(np.float64) - smooth
    sigma = noise_rms(residual)
    channels = _channels(smooth, motion, residual, sigma, sim.adc_bits, without)
    search = _search(channels)
    found = _variance_effects(sim, channels, search, motion, without)
    from softsense.diagnose.telling import tell

    return tell(sim, real, motion, smooth, channels, search, found, seed)


def augment(diagnosis: Diagnosis, sim: Recording) -> Recording:
    """The simulated recording of another, later motion with the diagnosed effects in it."""
    from dataclasses import replace

    motion = motion_of(sim, diagnosis.low, diagnosis.high, diagnosis.elapsed_s, diagnosis.largest)
    codes = sim.codes.astype(np.float64)
    change = _apply(diagnosis, denoise(codes, motion), motion, sim.adc_bits)
    top = 2**sim.adc_bits - 1
    made = np.clip(np.rint(codes + change), 0, top).astype(np.int32)
    return replace(sim, codes=made, name=f"{sim.name}_augmented")


def _apply(diagnosis: Diagnosis, smooth: Floats, motion: Motion, bits: int) -> Floats:
    """Codes (samples, channels) that the diagnosed effects add."""
    change = np.zeros_like(smooth)
    known = all_effects()
    for channel, nominal in enumerate(nominals(smooth, motion, bits)):
        if diagnosis.static.size and np.any(diagnosis.static[channel]):
            change[:, channel] += (
                spline_basis(motion.strain, STATIC_KNOTS) @ diagnosis.static[channel]
            )
        for trace in diagnosis.traces:
            explain = known[trace.effect].explain
            if trace.channel == channel and explain is not None:
                columns = explain(nominal)[trace.candidate].columns
                change[:, channel] += columns @ trace.weights
    return change


def _aligned(sim: Recording, real: Recording) -> tuple[Recording, Recording]:
    """The common part of two recordings of one motion."""
    shared = [name for name in sim.sensors if name in real.sensors]
    if not shared:
        raise SoftsenseError(
            f"no sensor is in both: {', '.join(sim.sensors)} and {', '.join(real.sensors)}",
            where=f"{sim.name}, {real.name}",
            remedy="name the columns alike",
        )
    sim, real = sim.with_sensors(shared), real.with_sensors(shared)
    if sim.t_s is not None and real.t_s is not None:
        if abs(sim.dt_s / real.dt_s - 1.0) > 1e-3:
            raise SoftsenseError(
                f"rates differ: {1 / sim.dt_s:.4g} Hz and {1 / real.dt_s:.4g} Hz",
                where=f"{sim.name}, {real.name}",
                remedy="resample one of them",
            )
        first = max(sim.t_s[0], real.t_s[0])
        sim = sim.rows(np.flatnonzero(sim.t_s >= first - 0.5 * sim.dt_s))
        real = real.rows(np.flatnonzero(real.t_s >= first - 0.5 * real.dt_s))
    samples = min(len(sim), len(real))
    if samples < 500:
        raise SoftsenseError(
            f"{samples} common samples are too few", where=real.name, remedy="record at least 500"
        )
    sim, real = sim.rows(slice(0, samples)), real.rows(slice(0, samples))
    span = float(np.ptp(sim.target[:, 0])) or 1.0
    apart = float(np.sqrt(((sim.target - real.target) ** 2).mean())) / span
    if apart > 0.1:
        raise SoftsenseError(
            f"the motions differ by {100 * apart:.0f} % of their range",
            where=f"{sim.name}, {real.name}",
            remedy="simulate the motion that was recorded",
        )
    return sim, real


def _check_channels(sim: Recording, real: Recording) -> None:
    """Dead, clipped and swapped channels are said first: no effect is behind them."""
    top = 2**real.adc_bits - 1
    for column, name in enumerate(real.sensors):
        codes = real.codes[:, column]
        if np.ptp(codes) <= 2:
            raise SoftsenseError(
                f"channel {name!r} is dead: constant at code {int(codes[0])}",
                where=real.name,
                remedy="check its wiring, or leave it out with --sensors",
            )
        rail = float(np.mean((codes <= 0) | (codes >= top)))
        if rail > 0.2:
            raise SoftsenseError(
                f"channel {name!r} is clipped in {100 * rail:.0f} % of the samples",
                where=real.name,
                remedy="change its divider, or leave it out with --sensors",
            )
    together = np.corrcoef(sim.codes.T, real.codes.T)[: len(sim.sensors), len(sim.sensors) :]
    match = np.argmax(np.abs(together), axis=1)
    for first in range(len(match)):
        second = int(match[first])
        own, other = abs(together[first, first]), abs(together[first, second])
        if second != first and match[second] == first and own < 0.5 < 0.95 < other:
            raise SoftsenseError(
                f"channels {sim.sensors[first]!r} and {sim.sensors[second]!r} seem swapped",
                where=real.name,
                remedy="swap the columns of one recording",
            )


def _channels(
    smooth: Floats,
    motion: Motion,
    residual: Floats,
    sigma: Floats,
    bits: int,
    without: Sequence[str],
) -> list[_Channel]:
    curve = spline_basis(motion.strain, STATIC_KNOTS)
    made = []
    for channel, nominal in enumerate(nominals(smooth, motion, bits)):
        candidates = {
            name: effect.explain(nominal)
            for name, effect in all_effects().items()
            if effect.explain is not None and name not in without
        }
        made.append(
            _Channel(
                residual[:, channel],
                float(sigma[channel]),
                curve,
                {name: found for name, found in candidates.items() if found},
            )
        )
    return made


def _held_out(columns: Floats, y: Floats) -> tuple[float, Floats]:
    """Squared error on blocks that the fit has not seen, and the weights of the whole fit."""
    width = columns.shape[1]
    if width == 0:
        return float(y @ y), np.zeros(0)
    scale = np.sqrt((columns**2).mean(axis=0)) + 1e-12
    scaled = columns / scale
    blocks = np.array_split(np.arange(len(y)), BLOCKS)
    grams = np.stack([scaled[b].T @ scaled[b] for b in blocks])
    sides = np.stack([scaled[b].T @ y[b] for b in blocks])
    squares = np.array([y[b] @ y[b] for b in blocks])
    ridge = 1e-7 * len(y) * np.eye(width)
    gram, side = grams.sum(axis=0), sides.sum(axis=0)
    weights = np.linalg.solve(gram - grams + ridge, (side - sides)[..., None])[..., 0]
    error = squares - 2 * (weights * sides).sum(axis=1)
    error += np.einsum("bi,bij,bj->b", weights, grams, weights)
    whole = np.linalg.solve(gram + ridge, side)
    return float(error.sum()), whole / scale


def _fit(channel: _Channel, picks: Sequence[tuple[str, int]]) -> _Fit:
    """The best of the model with and without static miscalibration."""
    free, y = [], channel.residual.copy()
    weights_of: list[int] = []
    for name, number in picks:
        candidate = channel.candidates[name][number]
        if candidate.fixed:
            y = y - candidate.columns[:, 0]
            weights_of.append(0)
        else:
            free.append(candidate.columns)
            weights_of.append(candidate.columns.shape[1])
    columns = np.concatenate(free, axis=1) if free else np.zeros((len(y), 0))
    variance_ = channel.sigma**2
    bare, bare_weights = _held_out(columns, y)
    best = _Fit(
        bare / variance_ + WEIGHT_PRICE * columns.shape[1], bare_weights, None, tuple(picks)
    )
    both = np.concatenate([columns, channel.static], axis=1)
    error, weights = _held_out(both, y)
    price = error / variance_ + WEIGHT_PRICE * both.shape[1] + STATIC_PRICE * len(y)
    if price < best.error:
        split = columns.shape[1]
        best = _Fit(price, weights[:split], weights[split:], tuple(picks))
    return best


def _quick(channel: _Channel, base: Sequence[tuple[str, int]], name: str) -> list[int]:
    """The candidates of an effect that are worth a proper fit, by plain least squares."""
    fixed = [p for p in base if channel.candidates[p[0]][p[1]].fixed]
    y = channel.residual.copy()
    for pick in fixed:
        y -= channel.candidates[pick[0]][pick[1]].columns[:, 0]
    free = [channel.candidates[n][k].columns for n, k in base if (n, k) not in fixed]
    step = 2
    y = y[::step]
    parts = [columns[::step] for columns in free]
    scores = []
    for static in (False, True):
        design = [*parts, channel.static[::step]] if static else parts
        basis = np.zeros((len(y), 0))
        if design:
            basis = np.linalg.qr(np.concatenate(design, axis=1))[0]
        rest = y - basis @ (basis.T @ y)
        row = []
        for candidate in channel.candidates[name]:
            columns = candidate.columns[::step]
            columns = columns - basis @ (basis.T @ columns)
            if candidate.fixed:
                row.append(float(((rest - columns[:, 0]) ** 2).sum()))
            else:
                q = np.linalg.qr(columns + 0.0)[0]
                row.append(float(rest @ rest - ((q.T @ rest) ** 2).sum()))
        scores.append(row)
    order = [int(np.argmin(row)) for row in scores]
    return sorted(set(order))


@dataclass(frozen=True)
class _Step:
    """One effect on all channels: the fits of those that it helps, and the total error."""

    name: str
    total: float
    fits: tuple[_Fit, ...]
    channels: tuple[int, ...]


def _try(channels: Sequence[_Channel], base: Sequence[_Fit], name: str) -> _Step:
    """Add the effect ``name`` to every channel that it helps."""
    fits, helped = [], []
    for number, (channel, before) in enumerate(zip(channels, base, strict=True)):
        best = before
        for candidate in _quick(channel, before.picks, name) if name in channel.candidates else []:
            made = _fit(channel, [*before.picks, (name, candidate)])
            if made.error < best.error - (
                CHANNEL_GAIN * len(channel.residual) if best is before else 0.0
            ):
                best = made
        if best is not before:
            helped.append(number)
        fits.append(best)
    return _Step(name, sum(fit.error for fit in fits), tuple(fits), tuple(helped))


@dataclass(frozen=True)
class Search:
    """The chosen effects in order, all fits, and what each alternative would have reached."""

    base: tuple[_Fit, ...]
    steps: tuple[_Step, ...]
    rivals: tuple[dict[str, float], ...]
    unknown: bool

    @property
    def fits(self) -> tuple[_Fit, ...]:
        """The final model of every channel."""
        return self.steps[-1].fits if self.steps else self.base


def _search(channels: Sequence[_Channel]) -> Search:
    """Greedy forward selection over effects, on all channels at once."""
    names = sorted({name for channel in channels for name in channel.candidates})
    base = tuple(_fit(channel, ()) for channel in channels)
    floor = sum(len(channel.residual) for channel in channels)
    raw = sum(float(c.residual @ c.residual) / c.sigma**2 for c in channels)
    current = base
    steps: list[_Step] = []
    rivals: list[dict[str, float]] = []
    # A static miscalibration alone may explain the gap; named static effects compete with it.
    bare = tuple(
        _Fit(float(c.residual @ c.residual) / c.sigma**2, np.zeros(0), None, ()) for c in channels
    )
    for number in range(MOST_EFFECTS):
        start = bare if number == 0 else current
        total = sum(fit.error for fit in start)
        tried = [_try(channels, start, name) for name in names if name not in _names(steps)]
        tried = [step for step in tried if step.channels]
        if not tried:
            break
        tried.sort(key=lambda step: step.total)
        best = tried[0]
        excess = max(total - floor, 1.0)
        if number == 0:
            before = sum(fit.error for fit in base)
            worthwhile = (before - best.total) > FIRST_SHARE * max(raw - floor, 1.0) or (
                best.total < before and raw - floor > 0.5 * floor
            )
        else:
            gained = total - best.total
            # What a form that is only nearly right leaves over is small beside what it closed.
            least = NEXT_GAIN * len(best.channels) * len(channels[0].residual)
            worthwhile = gained > max(NEXT_SHARE * excess, least, 0.01 * (raw - floor))
        if not worthwhile:
            break
        steps.append(best)
        rivals.append({step.name: step.total for step in tried})
        current = best.fits
    left = sum(fit.error for fit in current) - floor
    if steps and left > WANDER_LEFT * (raw - floor) and left > 0.5 * floor:
        slow = sum(variance.wanders(c.residual, c.sigma) for c in channels)
        if slow < 0.3 * left:
            # Slow, and no law of time or motion says it: a random walk, found in the leftovers.
            return Search(base, (), (), False)
    unknown = left > UNKNOWN_SHARE * max(raw - floor, 1.0) and raw - floor > 0.3 * floor
    return Search(base, tuple(steps), tuple(rivals), unknown)


def _names(steps: Sequence[_Step]) -> set[str]:
    return {step.name for step in steps}


def predicted(channel: _Channel, fit: _Fit) -> Floats:
    """(samples,) what a fit adds to the channel's nominal codes."""
    total = np.zeros(len(channel.residual))
    used = 0
    for name, number in fit.picks:
        candidate = channel.candidates[name][number]
        if candidate.fixed:
            total += candidate.columns[:, 0]
        else:
            width = candidate.columns.shape[1]
            total += candidate.columns @ fit.weights[used : used + width]
            used += width
    if fit.static is not None:
        total += channel.static @ fit.static
    return total


def _variance_effects(
    sim: Recording,
    channels: Sequence[_Channel],
    search: Search,
    motion: Motion,
    without: Sequence[str],
) -> list[variance.Finding]:
    """Noise, spikes, lines and slow wandering in what is left."""
    left = np.stack(
        [c.residual - predicted(c, fit) for c, fit in zip(channels, search.fits, strict=True)],
        axis=1,
    )
    found = variance.findings(left, sim.codes.astype(np.float64), motion, bool(search.steps))
    # What wanders slowly after an effect was found is its form being only nearly right.
    drop = {*without, *(["random_walk"] if search.steps else [])}
    return [finding for finding in found if finding.name not in drop]
