"""The diagnosis: fit every effect's trace to the residual, keep what held-out time confirms.

The residual of a channel is its real codes less the noiseless simulated ones. Each effect offers
columns (see ``Effect.explain``); a model is a set of effects per channel plus, where it pays, a
static miscalibration (``channel``). Models are compared by squared error on blocks of time that
the fit has not seen, in units of the noise variance, with a price for all that they name
(``search``). What has no mean (noise, spikes, lines) is looked for in what is left (``variance``).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from softsense.diagnose import variance
from softsense.diagnose.channel import Channel, acts_on_change
from softsense.diagnose.cores import all_at_once, one_core
from softsense.diagnose.design import Entry
from softsense.diagnose.moved import together
from softsense.diagnose.nominal import (
    Motion,
    beside_average,
    denoise,
    felt,
    levels_of,
    lost_codes,
    motion_of,
    noise_rms,
    nominals,
    own_ways,
    reference_of,
    spline_basis,
    told,
)
from softsense.diagnose.pricing import EFFECT_PRICE, SEARCHED, WALK, explained
from softsense.diagnose.rails import railed
from softsense.diagnose.search import Model, moving, search
from softsense.diagnose.vetting import MOST, Vetted, left_share, vetted
from softsense.diagnose.wandering import behind_dividers
from softsense.effects import BEFORE_CURVE, Nominal, all_effects, by_channel
from softsense.effects.adc_nonlinearity import read_instead
from softsense.errors import SoftsenseError
from softsense.notebook import Shown
from softsense.recording import FrontEnd, Recording

Floats = NDArray[np.float64]
# Of each channel, the candidates that effects have offered.
Offered = list[dict[str, list[Entry]]]

# Of what ``augment`` needs beside diagnosis.json: another one means other things.
SCHEMA = "softsense.augmentation/13"
STATIC_KNOTS = 8
BETWEEN_S = 10.0
# Channels hear what others make of what they hear: each time less by the crosstalk's share;
# and how far a curve is followed depends on what comes of it.
HEARINGS = 4
# Effects that are a curve of the code, noise included.
CURVES = ("adc_nonlinearity", "saturation")
# How much louder a recording may be than its simulation, where lost codes hide how loud it is.
LOUDER = 1.5
# What any strain leaves of one channel, in noise variances, is too little for other effects where
# play or a delay leaves less than this share of the gap.
SAYS_ALL = 1.0
SETTLED = 0.02
# What is the same on all channels looks like a strain.
ALIKE = frozenset({"lag", "gain"})
# How often what the motion's history tells is asked again, without spikes.
TOLD_AGAIN = 2
# What spikes leave that were taken out, of what they were.
SPIKES_LEAVE = 0.06
# A residual that changes by less of its noise variance is searched once.
SAME = 0.05


@dataclass(frozen=True)
class Trace:
    """One effect on one channel: the candidate that fits, and its weights.

    ``near``: of the effect's zoom around these values. ``place``: where a material's effect acts
    (``Nominal.places``). ``upon``: it acts on what the traces of
    earlier stages have done, not on the nominal signal.
    """

    effect: str
    channel: int
    candidate: int
    near: dict[str, float] | None
    place: str
    upon: bool
    weights: Floats
    values: dict[str, float]
    form: str


@dataclass(frozen=True)
class Past:
    """The motion that was diagnosed: the next one goes on from where it left the material.

    ``target`` (samples,) in the recording's unit; ``codes`` (samples, channels) noiseless;
    ``lost`` (stretches, 4) of the converter's codes (``nominal.lost_codes``); ``levels``
    (channels, 3) of what goes in steps (``nominal.levels_of``); ``own`` (channels,) which way the
    channels go that are strained otherwise (``nominal.own_ways``).
    """

    target: Floats
    codes: Floats
    dt_s: float
    start_s: float
    lost: Floats
    levels: Floats
    own: tuple[int, ...]


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """What was found: ``data`` is diagnosis.json, and ``augmented`` (samples, channels) codes.

    ``traces`` and ``static`` (channels, p) with the ``past`` let it be applied to another motion
    of the sensors in ``front_ends``.
    """

    data: dict[str, Any]
    traces: tuple[Trace, ...]
    static: Floats = field(repr=False)
    past: Past = field(repr=False)
    front_ends: dict[str, FrontEnd] = field(repr=False)
    augmented: Floats = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    def to_json(self) -> str:
        """diagnosis.json."""
        return json.dumps(self.data, indent=1) + "\n"

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that were found, largest first."""
        return tuple(effect["name"] for effect in self.data["effects"])

    def state_json(self) -> str:
        """What ``augment`` needs beside diagnosis.json and the past."""
        return json.dumps(
            {
                "schema": SCHEMA,
                "front_ends": {name: end.to_dict() for name, end in self.front_ends.items()},
                "static": self.static.tolist(),
                "traces": [
                    {**vars(trace), "weights": trace.weights.tolist()} for trace in self.traces
                ],
            }
        )

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        after = self.data["after"]
        found = [
            (
                effect["name"],
                f"{effect['kind']} on {' '.join(effect['channels'])}, "
                f"confidence {effect['confidence']:.2f}",
            )
            for effect in self.data["effects"]
        ]
        if self.data["unexplained"]["unknown_effect"]:
            found.append(("unknown", f"{self.data['unexplained']['share']:.0%} of the gap"))
        return [
            ("gap", "yes" if self.data["gap"]["present"] else "none beyond the noise"),
            *found,
            ("closed", f"{after['shrink']:.3f} of the excess gap on held-out time"),
        ]


def diagnose(
    sim: Recording, real: Recording, *, seed: int = 0, without: Sequence[str] = ()
) -> Diagnosis:
    """Compare a simulated and a real recording of the same motion.

    ``without``: effects of the catalogue that shall not be known (to test what happens then).

    Raises ``SoftsenseError`` where the recordings do not belong together, or a channel is dead.
    """
    with _one_thread(), one_core() if len(real) <= SEARCHED else nullcontext():
        return _diagnosed(sim, real, seed, without)


def _one_thread() -> AbstractContextManager[None]:
    """Sums in one order, however many cores there are; and thousands of small solves, where more
    threads only get in each other's way."""
    limits: AbstractContextManager[None] = threadpool_limits(limits=1, user_api="blas")
    return limits


def _diagnosed(sim: Recording, real: Recording, seed: int, without: Sequence[str]) -> Diagnosis:
    sim, real = aligned(sim, real)
    _check_channels(sim, real)
    start_s = float(sim.t_s[0]) if sim.t_s is not None else 0.0
    temp_c = real.context.get("temp_c", sim.context.get("temp_c"))
    motion = motion_of(sim.target[:, 0], sim.dt_s, start_s, temp_c)
    codes = real.codes.astype(np.float64)
    ways = own_ways(sim.codes.astype(np.float64), codes, motion)
    smooth, kept = denoise(sim.codes.astype(np.float64), motion, codes, ways)
    residual = codes - smooth
    lost = lost_codes(real, sim)
    coarse = sorted({int(c) for c in lost[:, 0]})
    known = [name for name in (*all_effects(), WALK) if name not in without]
    simulated = sim.codes - smooth
    own = (simulated**2).mean(axis=0)
    # Of fast moves, in the codes themselves, some would look like noise.
    beside = np.where(ways, 1.0, [beside_average(share) for share in kept])
    missed = np.maximum(own - beside * noise_rms(simulated) ** 2, 0.0)
    motion = felt(motion, smooth, ways, smooth)
    # Where fast moves are kept as simulated, their noise is in what is left, not beside it.
    fast = np.where(ways, kept, 0.0)
    louder = np.sqrt((1.0 + fast) / (1.0 - fast))
    # Tones and spikes stand out more beside what the history of the motion does not tell.
    slow = told(residual, motion)
    beside = residual - slow
    reference = reference_of(smooth, motion, lost, levels_of(beside, smooth, motion), ways)
    met = (smooth, codes)
    plain = [f for f in variance.evident(beside, motion, coarse, met) if f.name not in without]
    alone = nominals(smooth, smooth, motion, sim.adc_bits, reference)
    # Spikes on all channels at once look like a strain; tones are kept, for a drive may ring.
    spikes = [finding for finding in plain if finding.name == "spikes"]
    spikeless = variance.cleaned(beside, spikes, motion)
    for _ in range(TOLD_AGAIN if spikes else 0):
        # The history of the motion seemed to tell some of them.
        slow = told(slow + spikeless, motion)
        beside = residual - slow
        spikeless = variance.cleaned(beside, spikes, motion)
    hit = np.any(np.abs(beside - spikeless) > noise_rms(residual), 1)
    calm = spikeless if plain == spikes else variance.cleaned(beside, plain, motion)
    quiet = slow + calm if plain else residual
    strain = together(alone, residual, noise_rms(quiet), np.flatnonzero(~hit))

    def looked(
        rest: Floats,
        names: Sequence[str],
        found: Sequence[variance.Finding],
        earlier: Offered | None = None,
    ) -> tuple[list[Channel], Vetted]:
        noise = variance.noise_beside(rest, found)
        heard = by_channel(smooth + rest)
        # That only says how they are asked: of few channels each for itself is faster.
        gap = np.mean(rest**2, axis=0) > (1.0 + EFFECT_PRICE) * noise**2
        alike = bool(gap.mean() > 0.5)
        hearing = [replace(nominal, heard=heard, alike=alike) for nominal in alone]
        made = _channels(hearing, motion, rest, noise, own, missed, kept, names, earlier)
        checked = vetted(made, search(made, names, strain), motion, strain)
        checked = replace(checked, models=railed(made, checked.models))
        taken = np.sum((residual - rest) ** 2, axis=0) / noise**2
        hurt = {c for f in found if f.name == "spikes" for c in f.channels}
        return made, _without_tails(made, checked, {c: float(taken[c]) for c in hurt})

    settled, earlier = False, None
    if strain.left < min(SAYS_ALL, MOST * strain.gap):
        # Where play or a delay says it too, there is nothing else to look for.
        few = [name for name in known if name in moving() | ALIKE]
        earlier = [dict[str, list[Entry]]() for _ in alone]
        channels, checked = looked(quiet, few, plain, earlier)
        settled = checked.models[0].names <= moving()
        settled = settled and left_share(channels, checked.models[0]) < SETTLED
    if not settled:
        channels, checked = looked(quiet, known, plain, earlier)
    left = residual - said(channels, checked.models[0])
    read = louder * _read(channels, checked.models[0], simulated)
    found = _found(left, checked, residual, read, motion, coarse, met, _tones(plain))
    # A tone's neighbours belong to the effects too: it is taken out of what they leave.
    rest = variance.cleaned(left, [f for f in found if f.name not in without], motion)
    better = residual - left + rest
    again = bool(np.any(np.var(better - quiet, axis=0) > SAME * noise_rms(better) ** 2))
    if again and not settled:
        # Spikes and lines had been taken for noise, or too much for a line. What was looked at
        # before takes as much memory again.
        del channels, checked
        channels, checked = looked(better, known, found)
        left = residual - said(channels, checked.models[0])
        read = louder * _read(channels, checked.models[0], simulated)
        found = _found(left, checked, residual, read, motion, coarse, met, _tones(found))
    nameless = any(finding.name in without for finding in found)
    found = [finding for finding in found if finding.name not in without]
    heard = [finding for finding in found if finding.name == "interference"]
    if heard and strain.left < MOST * strain.gap:
        ringing = np.var(left - variance.cleaned(left, heard, motion), axis=0)
        if strain.left < MOST * float((ringing / noise_rms(quiet) ** 2).sum()):
            # A tone reads otherwise on each channel, and not as they answer a strain.
            checked = replace(checked, strained_otherwise=True)
    from softsense.diagnose.telling import tell

    return tell(sim, real, motion, smooth, channels, checked, found, nameless, seed)


def augment(diagnosis: Diagnosis, sim: Recording) -> Recording:
    """The simulated recording of another motion, which followed, with the diagnosed effects in it.

    Raises ``SoftsenseError`` where its sensors, their scale or its rate are not those of the
    diagnosis.
    """
    past = diagnosis.past
    sim = sim.with_sensors(tuple(diagnosis.front_ends))
    _check_scales(sim, diagnosis.front_ends, sim.name)
    for name, codes, end in zip(sim.sensors, sim.codes.T, sim.front_ends, strict=True):
        rail = float(np.mean((codes <= 0) | (codes >= 2**end.bits - 1)))
        if end.kind == "affine" and rail > 0.01:
            raise SoftsenseError(
                f"sensor {name!r} leaves the scale of the diagnosis in {100 * rail:.0f} % of the "
                f"samples: {end.describe()}",
                where=sim.name,
                remedy="diagnose again with a --front-end that leaves room for it",
            )
    if abs(sim.dt_s / past.dt_s - 1.0) > 1e-3:
        raise SoftsenseError(
            f"rates differ: {1 / sim.dt_s:.4g} Hz, and {1 / past.dt_s:.4g} Hz when diagnosed",
            where=sim.name,
            remedy="simulate at the same rate",
        )
    with _one_thread():
        return _augmented(diagnosis, sim)


def _augmented(diagnosis: Diagnosis, sim: Recording) -> Recording:
    past = diagnosis.past
    low, high = float(past.target.min()), float(past.target.max())
    alone = motion_of(sim.target[:, 0], sim.dt_s, 0.0, None, low, high)
    codes, _ = denoise(sim.codes.astype(np.float64), alone, own=past.own)
    # Nobody recorded how it went from one motion to the other: straight, and then a rest.
    way = np.clip(np.linspace(0.0, 2.0, round(BETWEEN_S / sim.dt_s)), 0.0, 1.0)[:, None]
    target = sim.target[:, :1]
    bridge = past.target[-1] + way * (target[:1] - past.target[-1])
    smooth = np.concatenate([past.codes, past.codes[-1] + way * (codes[0] - past.codes[-1]), codes])
    target = np.concatenate([past.target, bridge[:, 0], target[:, 0]])
    temp_c = sim.context.get("temp_c")
    if temp_c is not None:
        temp_c = np.concatenate([np.full(len(target) - len(codes), temp_c[0]), temp_c])
    motion = motion_of(target, sim.dt_s, past.start_s, temp_c, low, high)
    change = _apply(diagnosis, smooth, motion, sim.adc_bits)[-len(codes) :]
    top = 2**sim.adc_bits - 1
    made = np.clip(np.rint(sim.codes + change), 0, top).astype(np.int32)
    return replace(sim, codes=made, name=f"{sim.name}_augmented")


def change_of(diagnosis: Diagnosis, bits: int) -> Floats:
    """(samples, channels) codes that the diagnosed effects add on the motion of the diagnosis."""
    past = diagnosis.past
    motion = motion_of(past.target, past.dt_s, past.start_s, None)
    with _one_thread():
        return _apply(diagnosis, past.codes, motion, bits)


def _apply(diagnosis: Diagnosis, smooth: Floats, motion: Motion, bits: int) -> Floats:
    """Codes (samples, channels) that the diagnosed effects add."""
    change = np.zeros_like(smooth)
    past = diagnosis.past
    first = smooth[: len(past.target)]
    motion = felt(motion, smooth, past.own, first)
    reference = reference_of(first, motion, past.lost, past.levels, past.own)
    made = nominals(smooth, smooth, motion, bits, reference)
    # What depends on what is read, of other channels or half-way there.
    hears = any(t.effect == "crosstalk" or t.place == BEFORE_CURVE for t in diagnosis.traces)
    for _ in range(HEARINGS if hears else 1):
        heard = by_channel(smooth + change)
        change = _applied(
            diagnosis, smooth, motion, [replace(nominal, heard=heard) for nominal in made]
        )
    return change


def _applied(
    diagnosis: Diagnosis, smooth: Floats, motion: Motion, made: Sequence[Nominal]
) -> Floats:
    """The same with what the channels read already known."""
    change = np.zeros_like(smooth)
    for channel, nominal in enumerate(made):
        if diagnosis.static.size and np.any(diagnosis.static[channel]):
            change[:, channel] += _curve(motion.felt_by(channel)) @ diagnosis.static[channel]
        traces = [trace for trace in diagnosis.traces if trace.channel == channel]
        alone = nominal.apart_from(trace.effect for trace in traces)
        done, acted_on, moved, stage = np.zeros(len(smooth)), alone, None, ""
        for trace in traces:
            if acts_on_change(trace.effect, stage):
                stage = all_effects()[trace.effect].stage
                acted_on = alone.acting_on(smooth[:, channel] + done, moved)
            upon = acted_on if trace.upon else nominal
            candidate = explained(upon, trace.effect, trace.candidate, trace.near, trace.place)
            done += candidate.columns @ trace.weights
            moved = candidate.moved or moved
        change[:, channel] += done
    return change


def aligned(sim: Recording, real: Recording) -> tuple[Recording, Recording]:
    """The common part of two recordings of one motion."""
    shared = [name for name in sim.sensors if name in real.sensors]
    if not shared:
        raise SoftsenseError(
            f"no sensor is in both: {', '.join(sim.sensors)} and {', '.join(real.sensors)}",
            where=f"{sim.name}, {real.name}",
            remedy="name the columns alike",
        )
    sim, real = sim.with_sensors(shared), real.with_sensors(shared)
    ends = dict(zip(sim.sensors, sim.front_ends, strict=True))
    _check_scales(real, ends, f"{sim.name}, {real.name}")
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


def _check_scales(recording: Recording, others: Mapping[str, FrontEnd], where: str) -> None:
    """Values that are no codes became codes: on one scale, or they say nothing of each other."""
    for sensor, end in zip(recording.sensors, recording.front_ends, strict=True):
        other = others[sensor]
        if end != other and "codes" not in (end.kind, other.kind):
            raise SoftsenseError(
                f"{sensor!r} is read on two scales: {other.describe()}; {end.describe()}",
                where=where,
                remedy="read them together (softsense.read_together), or with one --front-end",
            )


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


def _curve(motion: Motion) -> Floats:
    """(samples, p) basis of a static miscalibration."""
    return spline_basis(motion.strain, STATIC_KNOTS)


def _channels(
    made: Sequence[Nominal],
    motion: Motion,
    residual: Floats,
    noise: Floats,
    own: Floats,
    missed: Floats,
    kept: Floats,
    known: Sequence[str],
    earlier: Offered | None,
) -> list[Channel]:
    sigma = [_noise(*each) for each in zip(made, noise, np.sqrt(own), strict=True)]

    signals = np.stack([nominal.u / nominal.full_scale for nominal in made])
    lets_through = behind_dividers(residual.T, np.array(sigma), np.abs(made[0].rate), signals)

    def channel(number: int) -> Channel:
        squares = float(own[number]), float(missed[number]), float(kept[number])
        feels = motion.felt_by(number)
        given = made[number], residual[:, number], sigma[number], _curve(feels), known, *squares
        before = earlier[number] if earlier else None
        return Channel(*given, feels.history, before, lets_through[number])

    return all_at_once(channel, range(len(made)))


def _noise(nominal: Nominal, level: float, own: float) -> float:
    """The noise ``level`` of a residual, within what lost codes make of the simulation's ``own``,
    or of somewhat more.

    What they make of the signal itself is no noise, and looks like it.
    """
    if not len(nominal.lost):
        return float(level)

    def read(noise: float) -> float:
        codes, _, square = read_instead(nominal.lost, "oftener", noise)
        return float(np.sqrt(np.interp(nominal.u, codes, square).mean()))

    return float(np.clip(level, read(own), read(LOUDER * own)))


def said(channels: Sequence[Channel], best: Model) -> Floats:
    """(samples, channels) codes that the model adds."""
    both = list(zip(channels, best.fits, strict=True))
    return np.stack(all_at_once(lambda one: one[0].predicted(one[1]), both), axis=1)


def _without_tails(
    channels: Sequence[Channel], checked: Vetted, taken: Mapping[int, float]
) -> Vetted:
    """``checked`` without a walk that is what long tails of spikes leave: it is little of what was
    ``taken`` out of the channels that have some, in noise variances, and comes and goes."""
    best = checked.models[0]
    if not checked.jerky or best.names != {WALK}:
        return checked
    if all(channels[c].excess < SPIKES_LEAVE * taken.get(c, 0.0) for c in best.channels_of(WALK)):
        calm = [made for made in checked.models if WALK not in made.names]
        return replace(checked, models=calm, jerky=False)
    return checked


def _read(channels: Sequence[Channel], best: Model, own: Floats) -> Floats:
    """(samples, channels) of a simulation's ``own`` noise as converters read it whose curve is not
    straight."""

    def of_channel(number: int) -> Floats:
        channel, read = channels[number], own[:, number].copy()
        for pick, weights in channel.weighted(best.fits[number]):
            if pick[0] in CURVES:
                read += (channel.disturbed(pick, own[:, number]) - channel.columns(pick)) @ weights
        return read

    return np.stack(all_at_once(of_channel, range(len(channels))), axis=1)


def _tones(found: Sequence[variance.Finding]) -> list[float]:
    """Hz of the tones among what was ``found``."""
    return [finding.value for finding in found if finding.name == "interference"]


def _found(
    left: Floats,
    checked: Vetted,
    residual: Floats,
    own: Floats,
    motion: Motion,
    coarse: Sequence[int],
    met: Sequence[Floats],
    heard: Sequence[float] = (),
) -> list[variance.Finding]:
    """What has no mean, in ``left``, which the effects leave over of ``residual``; ``met``: codes
    that may tell it."""
    best = checked.models[0]
    return variance.findings(
        left,
        residual,
        own,
        motion,
        explained=bool(best.names),
        walking=(*best.channels_of(WALK), *checked.noisy),
        heard=heard,
        bent=[c for name in CURVES for c in best.channels_of(name)],
        edged=best.channels_of("adc_nonlinearity"),
        coarse=coarse,
        codes=met,
        noisy=checked.noisy,
    )
