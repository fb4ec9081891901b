"""Physical effects that separate an ideal soft sensor from a real one: one file each.

A module in this folder defines ``EFFECT``. Effects act on a dimensionless signal
``(samples, channels)``, so that one equation serves a simulated sensor and the ADC codes of
anybody's recording alike:

========== ====================================================================================
stage      signal ``u``
========== ====================================================================================
motion     strain as each channel feels it, as a share of the nominal strain range (0 at rest)
material   response (or stress) as a share of its nominal span, 0 at rest, 1 at full strain
electrical voltage at the ADC as a share of its full scale, 0 … 1
========== ====================================================================================

Simulation may be cut anywhere: running two halves with the state handed over gives the samples
of one run, random draws included.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import uniform_filter1d

from softsense.errors import SoftsenseError

Floats = NDArray[np.float64]
# Everything that an effect remembers: arrays, numbers and the state of its random generator.
State = dict[str, Any]
Of = TypeVar("Of")
Stage = Literal["motion", "material", "electrical"]
STAGES: tuple[Stage, ...] = ("motion", "material", "electrical")

# Slow effects state their size after this time: 8000 samples at 20 Hz.
REFERENCE_S = 400.0

# Where a material's effect may act besides on the codes that the simulator says: before the
# channel's curve made them, or on what the strain alone says of them. Values of a candidate say so,
# and that the simulator's curve was fitted with the effect there.
BEFORE_CURVE = "before_curve"
ELASTIC = "elastic"
CALIBRATED = "calibrated"
# Of what a candidate is near: it is just that.
EXACTLY = "exactly"
# Or it is a rail whose shape is as free as a converter's curve.
AS_CURVE = "as_curve"
# Or the signal goes straight from sample to sample, as software reads it late.
STRAIGHT = "straight"
MARKS = frozenset({BEFORE_CURVE, ELASTIC, CALIBRATED, AS_CURVE, STRAIGHT})
# What relaxes or lags behind, of the span, before it matters which of them is meant.
STRESSED = 0.004
# So many samples at most are kept of what all channels ask for, and so many of the latest changes.
KEPT_FOR_ALL = 20_000
CHANGES_KEPT = 512
# Over so long what is read is averaged, to know where a change goes.
SMOOTH_S = 0.5
# Powers of the strain that make such a curve.
CURVE_POWERS = 4

# A curve is bent whose steepest part is more than so many times its flattest.
BENT = 1.3

# Modules of this folder that hold tools of the effects rather than an effect.
_NOT_EFFECTS = {"operators"}


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, with its unit and the range that is met in practice."""

    name: str
    unit: str
    low: float
    high: float
    default: float
    meaning: str


@dataclass(frozen=True)
class Context:
    """What an effect may know beside its signal.

    ``strain``: (samples,) share of the nominal strain range. ``temp_c``: (samples,) logged
    temperature, or None. ``t0_s``: time of the first sample. ``lsb``: size of one ADC code in the
    signal's unit. ``rng``: seeds an effect's own random stream at its start; later on its state
    carries the stream.
    """

    dt_s: float
    strain: Floats
    t0_s: float = 0.0
    temp_c: Floats | None = None
    lsb: float = 1.0 / 4095.0
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def time_s(self) -> Floats:
        """(samples,) seconds since the beginning of the experiment."""
        times: Floats = self.t0_s + self.dt_s * np.arange(len(self.strain), dtype=np.float64)
        return times

    def generator(self, state: State | None) -> np.random.Generator:
        """The effect's own stream: a child of ``rng`` at the start, afterwards where it stood."""
        if state is None:
            return self.rng.spawn(1)[0]
        bits = np.random.PCG64()
        bits.state = state["rng"]
        return np.random.Generator(bits)


@dataclass(frozen=True)
class Curve:
    """The static curve of a channel: ``codes`` at evenly spaced shares of the strain range, from 0
    to 1; all rising or all falling, where the strain is asked of them."""

    codes: Floats

    @property
    def bent(self) -> bool:
        """Whether the curve is not nearly a straight line."""
        steps = np.abs(np.diff(self.codes))
        return float(steps.max()) > BENT * float(steps.min())

    def at(self, strain: Floats) -> Floats:
        """(samples,) codes; at its ends as inside."""
        result: Floats = np.interp(strain, np.linspace(0.0, 1.0, len(self.codes)), self.codes)
        return result

    def strain(self, codes: Floats) -> Floats:
        """(samples,) of the range, straight on beyond its ends, where the curve has ``codes``."""
        sign = np.sign(self.codes[-1] - self.codes[0])
        at, last = np.linspace(0.0, 1.0, len(self.codes)), len(self.codes) - 2
        below = np.clip(np.searchsorted(sign * self.codes, sign * codes) - 1, 0, last)
        step = np.diff(self.codes)
        result: Floats = at[below] + (codes - self.codes[below]) / step[below] * at[1]
        return result

    def slope(self, strain: Floats) -> Floats:
        """(samples,) codes per strain range; at its ends as inside."""
        at = np.linspace(0.0, 1.0, len(self.codes))
        result: Floats = np.interp(strain, at, np.gradient(self.codes, at))
        return result


@dataclass(frozen=True)
class Reference:
    """The recording that weights belong to: a later one is measured with the same yardsticks.

    ``rest``, ``low``, ``span``: (channels,) codes at its beginning, the lowest, and how many from
    there to the highest. ``start_s``, ``duration_s``: when it was. ``lost`` (stretches, 4): where
    codes never occurred in truth, the channel, the codes below and above them that did, and how
    often the one above did, of both.
    ``levels`` (channels, 3): how many there are in the range of what makes a channel go in steps,
    one of them, and whether that is the strain (0) or its own signal (1); zeros where nothing does.
    ``curves``: of each channel, codes over strain; ``elastic``: the same where nothing lags behind.
    ``largest`` (some samples,): the largest strain so far. ``own`` (channels,): 0, or which way a
    channel's own signal goes with its strain, where the recorded one does not say it.
    """

    rest: Floats
    low: Floats
    span: Floats
    start_s: float
    duration_s: float
    lost: Floats
    levels: Floats
    curves: tuple[Curve, ...]
    elastic: tuple[Curve, ...]
    largest: Floats
    own: tuple[int, ...]


def along(share: Floats, way: int) -> Floats:
    """(samples,) a strain that goes this ``way``, up or down, with a ``share`` (samples,)."""
    return share if way > 0 else 1.0 - share


def by_channel(codes: Floats) -> tuple[Floats, ...]:
    """(samples,) of each channel of ``codes`` (samples, channels), each in one piece of memory."""
    return tuple(np.ascontiguousarray(codes.T))


@dataclass(frozen=True)
class Nominal:
    """One channel as a simulator without the effect says it, for the effect to leave its trace in.

    ``codes``: noiseless nominal codes (samples,) of each channel; ``heard``: what these
    channels really read, with all their effects; ``channel``: which is meant. ``strain``:
    (samples,) share of the range; ``respond(strain, keep)``: codes that the channel would give for
    another strain, at the samples ``keep``; ``all_respond`` those of all (channels, samples).
    ``start_s``: time of the first sample since the experiment began; ``largest``: (samples,)
    largest strain so far. ``keep``: the samples that traces are asked for; an effect may give them
    for all. ``known``, ``known_of_strain``: what ``once``, ``once_for_all`` and ``once_of`` have
    made. ``itself``: the strain is the channel's own signal (``felt``). ``alike``: most channels
    ask what the same strains change.
    """

    codes: tuple[Floats, ...]
    heard: tuple[Floats, ...]
    channel: int
    strain: Floats
    dt_s: float
    respond: Callable[[Floats, slice], Floats]
    all_respond: Callable[[Floats, slice], Floats]
    largest: Floats
    reference: Reference
    start_s: float = 0.0
    temp_c: Floats | None = None
    full_scale: float = 4095.0
    keep: slice = field(default_factory=lambda: slice(None))
    known: dict[str, Any] = field(default_factory=dict, repr=False)
    known_of_strain: dict[Hashable, Any] = field(default_factory=dict, repr=False)
    itself: bool = False
    alike: bool = False

    def once(self, name: str, make: Callable[[], Of]) -> Of:
        """What ``make`` makes of the channel's signal, made once whatever samples are kept."""
        if name not in self.known:
            self.known[name] = make()
        made: Of = self.known[name]
        return made

    def once_for_all(self, name: Hashable, make: Callable[[], Of]) -> Of:
        """What ``make`` makes of the strain alone, at the samples to keep: made once for all
        channels, where these are few."""
        step = self.keep.step or 1
        if len(self.strain) > step * KEPT_FOR_ALL:
            return make()
        key = step, name
        if key not in self.known_of_strain:
            self.known_of_strain[key] = make()
        made: Of = self.known_of_strain[key]
        return made

    def once_of(self, other: int, name: str, make: Callable[[Floats], Of]) -> Of:
        """What ``make`` makes of the signal of an ``other`` channel, made once for all."""
        key = "of", other, name
        if key not in self.known_of_strain:
            self.known_of_strain[key] = make(self.codes[other])
        made: Of = self.known_of_strain[key]
        return made

    def changed(self, name: Hashable, moved: Callable[[], Floats]) -> Floats:
        """(kept samples,) what the channel says of the strain that is ``moved`` less what it says
        of its own; that of one ``name`` is made once for all channels where most ask for it."""
        few = len(self.strain) <= KEPT_FOR_ALL and self.keep.step in (None, 1)
        if not (self.alike and few):
            return self.respond(moved(), self.keep) - self.respond(self.strain, self.keep)
        kept = self.known_of_strain.setdefault("changed", OrderedDict())
        if name not in kept:
            own = self.once_for_all("unmoved", lambda: self.all_respond(self.strain, self.keep))
            # Half the memory: a trace is known to seven digits.
            kept[name] = (self.all_respond(moved(), self.keep) - own).astype(np.float32)
            if len(kept) > CHANGES_KEPT:
                kept.popitem(last=False)
        change: Floats = kept[name][self.channel].astype(np.float64)
        return change

    @property
    def u(self) -> Floats:
        """(samples,) the channel's own codes."""
        return self.codes[self.channel]

    def _with(self, own: Floats) -> tuple[Floats, ...]:
        """``codes`` where these are the channel's ``own``."""
        return *self.codes[: self.channel], own, *self.codes[self.channel + 1 :]

    def acting_on(self, codes: Floats, moved: Callable[[], Floats] | None) -> Nominal:
        """The same where effects have made ``codes`` (samples,) of the channel's own, and the
        strain is what ``moved`` says."""
        changed = self._with(codes)
        if moved is None:
            return replace(self, codes=changed, known={})
        strain = moved()
        largest = np.maximum.accumulate(strain)
        return replace(
            self,
            codes=changed,
            strain=strain,
            largest=largest,
            known={},
            known_of_strain={},
            alike=False,
        )

    def apart_from(self, names: Iterable[str]) -> Nominal:
        """The same where these effects are on the channel: of what electrical ones make of it,
        nothing came through the curve."""
        if all(all_effects()[name].stage != "electrical" for name in names):
            return self
        here, after = slice(self.channel), slice(self.channel + 1, None)
        heard = (*self.heard[here], self.u, *self.heard[after])
        return replace(
            self.once("apart", lambda: replace(self, heard=heard, known={})), keep=self.keep
        )

    def felt(self, stage: Stage) -> Nominal:
        """The same as an effect of this ``stage`` has it: on a channel that is strained otherwise
        than recorded, its own signal is what a material feels."""
        way = self.reference.own[self.channel]
        if not way or stage != "material":
            return self
        return replace(self.once("felt", lambda: self._by_itself(way)), keep=self.keep)

    def _by_itself(self, way: int) -> Nominal:
        """The same with its own signal for the strain, which goes this ``way`` with it."""
        strain, reference = along(self.share, way), self.reference
        largest = np.maximum.accumulate(strain)
        straight = Curve(self.low + self.span * np.array([0.0, 1.0])[::way])
        here, after = slice(self.channel), slice(self.channel + 1, None)
        there = replace(
            reference,
            elastic=(*reference.elastic[here], straight, *reference.elastic[after]),
            largest=largest[: round(reference.duration_s / self.dt_s)],
            own=(*reference.own[here], 0, *reference.own[after]),
        )
        return replace(
            self,
            strain=strain,
            largest=largest,
            reference=there,
            respond=lambda of, keep: straight.at(of)[keep],
            known={},
            known_of_strain={},
            itself=True,
            alike=False,
        )

    def kept(self) -> Nominal:
        """Of the samples to ``keep`` alone, for traces that need no others."""
        step = self.keep.step or 1
        if step == 1:
            return self
        return replace(
            self,
            codes=tuple(codes[self.keep] for codes in self.codes),
            heard=tuple(codes[self.keep] for codes in self.heard),
            strain=self.strain[self.keep],
            largest=self.largest[self.keep],
            dt_s=self.dt_s * step,
            keep=slice(None),
            known={},
            known_of_strain={},
        )

    @property
    def way(self) -> Floats:
        """(kept samples,) strain ranges gone so far."""
        way: Floats = np.cumsum(np.abs(np.diff(self.strain, prepend=self.strain[0])))
        return way[self.keep]

    @property
    def curve(self) -> Curve:
        """The channel's codes over strain, in the reference."""
        return self.reference.curves[self.channel]

    @property
    def places(self) -> tuple[str, ...]:
        """Where else a material's effect may act, where that is not the same."""
        lag = self.u - self.reference.elastic[self.channel].at(self.strain)
        stressed = float(lag.std()) > STRESSED * self.span
        return (BEFORE_CURVE,) * self.curve.bent + (ELASTIC,) * stressed

    def at(self, place: str) -> tuple[Nominal, Floats]:
        """The same in one of ``places``, over the same span of codes; and (samples,) by how much
        what changes there changes the codes."""
        reference = self.reference
        rest = np.array([self.rest, self.low, self.low + self.span])
        if place == ELASTIC:
            elastic = reference.elastic[self.channel]
            felt = elastic.at(self.strain)
            # It begins at its rest, and its lowest and highest codes are the ends.
            ends = np.array([felt[0], elastic.codes.min(), elastic.codes.max()])
            slope = np.ones(len(felt))
        else:
            strain = self.curve.strain(self.u)
            felt = self.low + self.span * strain
            ends = self.low + self.span * self.curve.strain(rest)
            # Half-way to what is read, for a curve is not straight over a large change; without
            # the noise, of which the traces would say some.
            change = uniform_filter1d(self.heard[self.channel] - self.u, self._samples(SMOOTH_S))
            slope = self.curve.slope(self.curve.strain(self.u + 0.5 * change)) / self.span
        rests, lows, spans = reference.rest.copy(), reference.low.copy(), reference.span.copy()
        rests[self.channel], lows[self.channel] = ends[0], ends[1:].min()
        spans[self.channel] = np.ptp(ends[1:])
        reference = replace(reference, rest=rests, low=lows, span=spans)
        return replace(self, codes=self._with(felt), reference=reference, known={}), slope

    def _samples(self, time_s: float) -> int:
        """How many samples are in such a time, at least one."""
        return max(round(time_s / self.dt_s), 1)

    def calibration(self) -> Callable[[Floats], Floats]:
        """What takes from columns (samples, p) their mean curve over strain, of the reference."""

        @cache
        def powers(samples: int) -> tuple[Floats, Floats]:
            step = 1 if samples == len(self.strain) else self.keep.step
            table: Floats = np.vander(self.strain[::step], CURVE_POWERS).astype(np.float64)
            first = table[: round(self.reference.duration_s / self.dt_s / step)]
            return table, np.linalg.solve(first.T @ first, first.T).astype(np.float64)

        def less(columns: Floats) -> Floats:
            table, fit = powers(len(columns))
            result: Floats = columns - table @ (fit @ columns[: fit.shape[1]])
            return result

        return less

    @property
    def rest(self) -> float:
        """The channel's codes where the reference begins."""
        return float(self.reference.rest[self.channel])

    @property
    def low(self) -> float:
        """The channel's lowest codes in the reference."""
        return float(self.reference.low[self.channel])

    @property
    def span(self) -> float:
        """How many codes the channel moves by in the reference."""
        return float(self.reference.span[self.channel]) or 1.0

    @property
    def lost(self) -> Floats:
        """(stretches, 3) the codes below and above those that the channel never reads, and how
        often it reads the one above, of both."""
        lost = self.reference.lost
        return lost[lost[:, 0] == self.channel, 1:]

    @property
    def levels(self) -> tuple[float, float, Floats]:
        """How many levels there are at which the channel goes in steps, one of them, and (samples,)
        what has them, its range from 0 to 1."""
        count, first, own = self.reference.levels[self.channel]
        return float(count), float(first), self.share if own else self.strain

    @property
    def share(self) -> Floats:
        """(samples,) 0 … 1 of the span."""
        return self.once("share", lambda: (self.u - self.low) / self.span)

    @property
    def time_s(self) -> Floats:
        """(samples,) seconds since the experiment began."""
        times: Floats = self.start_s + self.dt_s * np.arange(len(self.u), dtype=np.float64)
        return times

    @property
    def passed(self) -> Floats:
        """(samples,) how much of the recording that was diagnosed has passed, 0 … 1."""
        reference = self.reference
        since_s = self.time_s - reference.start_s
        result: Floats = np.clip(since_s / reference.duration_s, 0.0, 1.0)
        return result

    @property
    def rate(self) -> Floats:
        """(samples,) strain per second."""
        change: Floats = np.gradient(self.strain) / self.dt_s
        return change


def altered(one: Of, **changes: Any) -> Of:
    """``dataclasses.replace`` of a frozen ``one``, where a search makes many thousands of them."""
    result = object.__new__(type(one))
    vars(result).update(vars(one), **changes)
    return result


@dataclass(frozen=True)
class Candidate:
    """What an effect would add to a channel's codes, up to weights: ``columns`` (samples, p).

    ``made``: the columns, or what makes them once they are asked for. ``fixed``: the weight is 1 by
    physics (a delay cannot be half there). ``parallel``: the weights have one sign by physics (all
    parts relax); where they cancel, something else is mimicked. ``values``: the parameters that the
    columns were made with. ``curved``: the columns hold a curve besides, of the signal or of time,
    which other effects could be behind. ``shifting``: or an offset. ``pliable``: it follows
    whatever is near, and ``nearly``: it is a model of a material, also where the effect is an exact
    equation. ``largest``: weights beyond it are not physical, nor those beyond ``alone`` where the
    others are next to nothing, or of the first ``quick`` ones together; ``positive``: nor those
    below 0; ``opposed``: nor a last one that goes the same way as the others; ``farthest``: nor
    what goes farther than so many codes to both sides, whatever its parts are. ``levels(weights)``:
    of a curve, at even steps, where ``largest`` is of those; beside other effects they may be
    straight as well. ``moved()``: (samples,) the strain that reaches the sensor, where that is what
    the effect changes; ``by_strain``: the columns are just what the channel says of it, less what
    it says of the nominal strain.
    """

    made: Floats | Callable[[], Floats]
    values: Mapping[str, float]
    form: str = ""
    fixed: bool = False
    parallel: bool = False
    curved: bool = False
    shifting: bool = False
    pliable: bool = False
    nearly: bool = False
    largest: float = np.inf
    alone: float = np.inf
    quick: int = 0
    positive: bool = False
    opposed: bool = False
    farthest: float = np.inf
    levels: Callable[[Floats], Floats] | None = None
    moved: Callable[[], Floats] | None = None
    by_strain: bool = False

    @property
    def columns(self) -> Floats:
        """(samples, p) what the weights belong to."""
        if callable(self.made):
            # Made once. A cached property of Python 3.11 would let only one thread at a time do so.
            object.__setattr__(self, "made", self.made())
        assert not callable(self.made)
        return self.made

    def through(self, slope: Floats, keep: slice, place: str) -> Candidate:
        """The same in a ``place`` of this ``slope`` (samples,), or of all samples to ``keep``."""

        def made() -> Floats:
            columns = self.columns
            here = slope if len(slope) == len(columns) else slope[keep]
            result: Floats = columns * here[:, None]
            return result

        return altered(self, made=made, values={**self.values, place: 1.0})

    def calibrated(self, less: Callable[[Floats], Floats]) -> Candidate:
        """The same beside a simulator whose curve was fitted to what the effect makes of it, which
        is ``less`` then (``Nominal.calibration``)."""
        values = {**self.values, CALIBRATED: 1.0}
        return altered(self, made=lambda: less(self.columns), values=values)

    def leaking(self, through: float, form: str = "leaking") -> Candidate:
        """The same where this part of the signal comes through unchanged."""
        values = {**self.values, "through": through}
        less = 1.0 - through
        return altered(self, made=lambda: less * self.columns, values=values, form=form)


@dataclass(frozen=True)
class Recurring:
    """A value that may come and go in time: ``key + pace t + swing wave(t / period_s + phase)``.

    ``key``, ``pace`` and ``swing``: what these are called, besides ``period_s`` and ``phase``.
    ``course(nominal, values, form)``: (kept samples,) of that value; ``waves``: of each form
    (``operators.wave``).
    """

    key: str
    pace: str
    swing: str
    course: Callable[[Nominal, Mapping[str, float], str], Floats]
    waves: Mapping[str, str]


@dataclass(frozen=True)
class Fine:
    """Candidates between those of any grid.

    ``at(nominal, values)``: all that have these values; ``steps``: how far each value is moved to
    see what that does; ``more``: further values that such an effect may have, at first 0, in three
    kinds that are asked for one after the other: of all channels alike, of each by its number, and
    free to go anywhere. ``recurring``: one of the values that may come and go in time.
    """

    at: Callable[[Nominal, Mapping[str, float]], list[Candidate]]
    steps: Mapping[str, float]
    more: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    recurring: Recurring | None = None


Explain = Callable[[Nominal], list[Candidate]]
Zoom = Callable[[Nominal, Mapping[str, float]], list[Candidate]]
Values = Mapping[str, Floats]
Simulate = Callable[[Floats, Context, Values, str, State | None], tuple[Floats, State]]


@dataclass(frozen=True)
class Effect:
    """A physical mechanism: what it does, what it is called, and who described it.

    ``simulate(u, context, values, form, state)`` returns the changed signal and the state after
    it; ``values`` holds (channels,) or (channels, parts) for every parameter. Call ``apply``,
    which fills in defaults. ``exact``: the equation is what happens, not a model of a material.
    ``memoryless``: its traces at an instant follow from the nominal signals at that instant, or
    nearly so from as few as a search of a long recording looks at.
    ``lasting``: it depends on what was before, and has a mean curve over the strain besides, which
    the calibration of a simulator takes in. ``by_rate``: what does not change with how fast the
    strain changes is none of it. ``bent``: it is a curve of the codes, of which what is straight is
    none of it. ``broad``: its many weights say much of what other effects do.
    """

    name: str
    stage: Stage
    mechanism: str
    equation: str
    source: str
    fingerprint: str
    parameters: tuple[Parameter, ...]
    simulate: Simulate
    forms: tuple[str, ...] = ("",)
    explain: Explain | None = None
    # As ``explain``, on a fine grid around a candidate's ``values``.
    zoom: Zoom | None = None
    # Of those that are the same on all channels, which are fitted to them together.
    fine: Fine | None = None
    exact: bool = False
    memoryless: bool = False
    lasting: bool = False
    by_rate: bool = False
    bent: bool = False
    broad: bool = False

    def defaults(self) -> dict[str, float]:
        """Every parameter's default by name."""
        return {parameter.name: parameter.default for parameter in self.parameters}

    def apply(
        self,
        signal: Floats,
        context: Context,
        parameters: Mapping[str, ArrayLike] | None = None,
        form: str | None = None,
        state: State | None = None,
    ) -> tuple[Floats, State]:
        """``signal`` (samples, channels) with the effect in it, and the state at its end.

        ``parameters``: a number for all channels or (channels,) each; where an effect has
        several parts (relaxation times) also (channels, parts). What is absent takes its default.

        Raises ``ValueError`` for an unknown parameter, form or a shape that does not fit.
        """
        channels = signal.shape[1]
        given = dict(parameters or {})
        unknown = sorted(set(given) - {parameter.name for parameter in self.parameters})
        if unknown:
            raise ValueError(f"{self.name} has no parameter {', '.join(unknown)}")
        chosen = self.forms[0] if form is None else form
        if chosen not in self.forms:
            raise ValueError(f"{self.name} has no form {chosen!r}: {', '.join(self.forms)}")
        values = {}
        for parameter in self.parameters:
            value = np.asarray(given.get(parameter.name, parameter.default), dtype=np.float64)
            if value.ndim and value.shape[0] != channels:
                raise ValueError(
                    f"{self.name}.{parameter.name}: {value.shape[0]} values for {channels} channels"
                )
            values[parameter.name] = np.full(channels, value) if value.ndim == 0 else value
        return self.simulate(signal, context, values, chosen, state)


@cache
def all_effects() -> dict[str, Effect]:
    """Every effect of this folder by name, in the order of stages, then of names."""
    found: list[Effect] = []
    for info in pkgutil.iter_modules(__path__):
        if info.name not in _NOT_EFFECTS:
            effect: Effect = importlib.import_module(f"{__name__}.{info.name}").EFFECT
            found.append(effect)
    found.sort(key=lambda effect: (STAGES.index(effect.stage), effect.name))
    return {effect.name: effect for effect in found}


def effect(name: str) -> Effect:
    """The effect called ``name``. Raises ``SoftsenseError`` where there is none."""
    try:
        return all_effects()[name]
    except KeyError:
        raise SoftsenseError(
            f"there is no effect {name!r}", remedy=f"effects are {', '.join(all_effects())}"
        ) from None
