"""Effects of one channel that act on what others do, and how well their parameters are known."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.chosen import REFUSED, Chosen, Held
from softsense.diagnose.design import COUNTED, Entry, Fit, Pick
from softsense.diagnose.nominal import history_basis
from softsense.diagnose.pricing import (
    ELECTRICAL,
    MOTION,
    NOTHING,
    RAIL,
    RAILS,
    SERIAL,
    WALK,
    Names,
    offered,
)
from softsense.effects import CALIBRATED, EXACTLY, STAGES, Candidate, Nominal, all_effects, altered

Floats = NDArray[np.float64]
NOBODY: Names = frozenset()
# What an effect does that says next to nothing, of the noise.
SAYS_NOTHING = 2.0
# 95 % of a chi-squared variable with one degree of freedom.
CHI2_95 = 3.84
# How often effects are fitted again upon what the others then do.
ROUNDS = 5
# What one does may change from round to round by this share, or by the noise, in the end.
UNSETTLED = 0.1
# What acts on codes as they are; of that a converter's curve says something beside anything.
CURVE = "adc_nonlinearity"


class Channel(Chosen):
    """What the search needs of one channel."""

    def _take(self, found: Mapping[str, Sequence[Entry]]) -> None:
        super()._take(found)
        self._rounds: dict[Hashable, Fit] = {}

    def composed(self, fit: Fit, names: frozenset[str]) -> Fit:
        """``fit``, or a cheaper one where every stage acts on what the stages before have done.

        Motion comes before material, and material before the electrical side, whose effects come
        one after the other in either order; what moves the strain stays as it is in ``fit``. What
        does not act on each other is looked at once more, side by side in all its places. Where
        ``fit`` leaves enough to pay for an effect more, all of ``names`` are tried, which can say
        little side by side; also from what says all of another channel, a rail from anywhere, and a
        converter's curve upon what lags.
        """
        told = fit.static is None and self.left(fit) < self.effect_price
        if told and not on_each_other(fit.picks):
            return fit
        begun, made = [fit], [fit]
        if self.left(fit) > self.effect_price:
            if len(names) > len(fit.picks):
                rest = frozenset(n for n in names if n == WALK or all_effects()[n].stage != MOTION)
                begun.append(self.best(rest, self.held(fit)))
            for name in sorted(names & self._elsewhere_said.keys()):
                made += self._upon_said(name, names, self.held(fit))
            others = [pick for pick in fit.picks if pick[0] not in RAILS]
            if RAIL in names and WALK not in names and others:
                made += self._with_best(self.bare(others), RAIL, NOBODY)
            serial = others and all(all_effects()[name].stage in SERIAL for name, _ in others)
            if CURVE in names - {name for name, _ in others} and WALK not in names and serial:
                # A static curve has stood for one of what lags.
                made += self._with_best(self._part(fit, others), CURVE, NOBODY)
        return min([*made, *self._upon_each_other_from(begun)], key=self.price)

    def _upon_said(self, name: str, names: Names, held: Held) -> list[Fit]:
        """What some rounds come to of ``names`` where the effect ``name`` stays what says all of
        another channel: side by side it may have to give way."""
        said, kept = (name, self._elsewhere_said[name]), frozenset({name})
        rest = names - {name, *dict(held)}
        made = self._upon_each_other_from([self.best(rest, (*held, said))], kept)
        return made + (self._with_best(self.bare([said]), RAIL, kept) if rest == RAILS else [])

    def instead(self, fit: Fit, old: str, new: str) -> Fit:
        """``fit``, or where it has the effect ``old`` the cheapest with ``new`` in its place, upon
        what others do, or with these alone."""
        rest = [pick for pick in fit.picks if pick[0] != old]
        if len(rest) == len(fit.picks):
            return fit
        if not rest:
            return self.best(frozenset({new}))
        made = self._with_best(self._part(fit, rest), new, NOBODY)
        return min([self.without(fit, old), *made], key=self.price)

    def _part(self, fit: Fit, picks: Sequence[Pick]) -> Fit:
        """What these ``picks`` of a fit do in it."""
        weights = [
            own - self.entries[name][number].candidate.fixed
            for (name, number), own in self.weighted(fit)
            if (name, number) in picks
        ]
        return Fit(tuple(picks), fit.errors, np.concatenate([np.zeros(0), *weights]), None)

    def _with_best(self, first: Fit, name: str, kept: Names) -> list[Fit]:
        """What some rounds come to from ``first`` and the best of an effect upon what that does."""
        trial = self._under(first, [name])
        upon = trial.best(frozenset({name}))
        if not upon.picks:
            return []
        begun = self._both(first, trial, upon)
        bare = [] if begun.static is None else [replace(begun, static=None)]
        return self._upon_each_other_from([begun, *bare], kept)

    def fine(self, nominal: Nominal, name: str, values: Mapping[str, float], form: str) -> Entry:
        """The candidate of an effect with any ``values``, of a nominal signal."""
        number, candidate = self.between(nominal, name, values, form)
        # As exactly as can be: what a small step does is a difference.
        columns = self._searched(candidate)
        near = {EXACTLY: 1.0, **values}
        return Entry((), altered(candidate, made=NOTHING), columns, number, near, "")

    def between(
        self, nominal: Nominal, name: str, values: Mapping[str, float], form: str
    ) -> tuple[int, Candidate]:
        """The number of that candidate of those with its values, and itself."""
        near = {EXACTLY: 1.0, **values}
        made = offered(self._asked(all_effects()[name], nominal), name, near, "")
        number = next((k for k, candidate in enumerate(made) if candidate.form == form), 0)
        return number, made[number]

    def said_by_all(self, strain: Floats) -> Floats:
        """(channels, searched samples) codes that all channels would give for another ``strain``
        (samples,)."""
        return self.nominal.all_respond(strain, self._thin)

    def changed_by(self, said: Floats) -> Floats:
        """(searched samples,) the change of the channel's codes where ``said`` (channels, searched
        samples) is what all channels say of another strain."""
        nominal = self.nominal
        change: Floats = said[nominal.channel] - nominal.respond(nominal.strain, self._thin)
        return change

    def with_motion(self, fit: Fit, moved: Mapping[str, Entry], bare: bool = False) -> Fit:
        """The same where these entries are what moves the strain, and the others what they were,
        begun without a static curve where ``bare``; ``fit`` where that moves nothing or where it
        does not settle."""
        picks = []
        for name, number in fit.picks:
            if name in moved:
                self.entries[name].append(moved[name].apart())
                number = len(self.entries[name]) - 1
            picks.append((name, number))
        if tuple(picks) == fit.picks:
            return fit
        static = None if bare else fit.static
        begun, kept = replace(fit, picks=tuple(picks), static=static), frozenset(dict(picks))
        made = self._upon_each_other_from([begun], kept)
        return min(made, key=self.price, default=fit)

    def closer(self, fit: Fit) -> Fit:
        """``fit``, or a cheaper one with candidates near those that it has, all acting on each
        other."""
        if len(fit.picks) < 2:
            return fit
        begun = [fit]
        if fit.static_columns == 1:
            # An offset that one candidate needs hides that another needs none.
            begun.append(replace(fit, static=None))
        return min([fit, *self._upon_each_other_from(begun)], key=self.price)

    def without_curve(self, fit: Fit) -> Fit:
        """``fit``, or a cheaper one of effects that act on each other without a static curve, which
        stood for what they do."""
        if fit.static_columns < 2 or not on_each_other(fit.picks):
            return fit
        picks = tuple((name, self._uncalibrated(name, number)) for name, number in fit.picks)
        kept = frozenset(name for name, _ in set(picks) - set(fit.picks))
        begun = replace(fit, picks=picks, static=None)
        return min([fit, *self._upon_each_other_from([begun], kept)], key=self.price)

    def _uncalibrated(self, name: str, number: int) -> int:
        """The same candidate beside a simulator that was calibrated without the effect, where there
        is one."""
        if name == WALK or CALIBRATED not in self.entries[name][number].candidate.values:
            return number
        entry = self.entries[name][number]
        values, near = (
            None if of is None else {k: v for k, v in of.items() if k != CALIBRATED}
            for of in (entry.candidate.values, entry.near)
        )
        for other in self._offered(self.nominal, name, near, entry.place):
            if other.candidate.form == entry.candidate.form and other.candidate.values == values:
                self.entries[name].append(other.apart())
                return len(self.entries[name]) - 1
        return number

    def without(self, fit: Fit, name: str, composed: bool = False) -> Fit:
        """The cheapest fit of ``fit`` without the effect ``name``, under the same motion; where
        effects are ``composed``, also with the others as they are."""
        held = tuple(pick for pick in self.held(fit) if pick[0] != name)
        rest = frozenset(n for n, _ in fit.picks if n != name and n not in dict(held))
        keys = [(n, self.entries[n][k].key) for n, k in held]
        there = tuple((n, self.numbers(n)[key]) for n, key in keys if key in self.numbers(n))
        if rest or len(there) == len(held):
            fewer = self.within(rest, there)
            if rest and composed and self._says_nothing(fit, name):
                # Beside it, the others may have come closer to what they are.
                part = self._part(fit, [pick for pick in fit.picks if pick[0] != name])
                fewer = min([fewer, self._composed(part.picks, part)], key=self.price)
            return fewer
        # Its parameters are between those of the grid.
        weights = np.zeros(len(held) if len(held) > 1 else 0)
        return self._composed(held, Fit(held, fit.errors, weights, None))

    def _says_nothing(self, fit: Fit, name: str) -> bool:
        """Whether the effect ``name`` of a fit without a walk says next to nothing."""
        if (WALK, 0) in fit.picks:
            return False
        (said,) = (self.columns(pick) @ own for pick, own in self.weighted(fit) if pick[0] == name)
        return float(said.std()) < SAYS_NOTHING * self.sigma

    def moved(self, fit: Fit, known: Sequence[str]) -> Channel:
        """The channel as it is under the motion that ``fit`` has, with what that leaves and the
        effects ``known`` upon it."""
        return self._under(self._part(fit, self.held(fit)), known)

    def _under(self, first: Fit, known: Sequence[str]) -> Channel:
        """The channel under all that ``first`` does, with what that leaves and the effects
        ``known`` upon it."""
        change = self.predicted(first)
        moved = [entry.candidate.moved for entry in self.motion_of(first).values()]
        nominal = self.nominal.acting_on(self.nominal.u + change, moved[-1] if moved else None)
        history = history_basis(nominal.strain, nominal.dt_s)
        left = self.residual - change
        given = nominal, left, self.sigma, self.static, known, *self._of_simulation, history
        return Channel(*given, felt=self.felt)

    def then(self, fit: Fit, trial: Channel, upon: Fit) -> Fit:
        """The motion of ``fit``, and what ``upon`` has of a ``trial``, the channel under it."""
        held = self.held(fit)
        begun = self._both(Fit(held, fit.errors, np.zeros(len(held)), None), trial, upon)
        return min([begun, *self._upon_each_other_from([begun])], key=self.price)

    def _both(self, first: Fit, trial: Channel, upon: Fit) -> Fit:
        """``first``, and what ``upon`` has of a ``trial``, the channel under it."""
        picks = []
        for name, number in upon.picks:
            entry = trial.entries[name][number].apart()
            self.entries[name].append(replace(entry, nominal=trial.nominal))
            picks.append((name, len(self.entries[name]) - 1))
        # What was alone had a weight of 1.
        weights = [
            fit.weights if len(fit.picks) != 1 or len(fit.weights) else np.zeros(1)
            for fit in (first, upon)
        ]
        return Fit((*first.picks, *picks), upon.errors, np.concatenate(weights), upon.static)

    def _upon_each_other_from(self, begun: Sequence[Fit], kept: Names = NOBODY) -> list[Fit]:
        """What some rounds come to from ``begun``, also with candidates near those, and at first
        with any rail; but for effects that are ``kept`` as they are."""
        made = []
        for begin in begun:
            for ordered in _orders(begin.picks):
                now, picks, before, anew = begin, ordered, np.inf, RAILS - kept
                for _ in range(ROUNDS):
                    then, now = now, self._composed(picks, now, kept, anew)
                    anew = NOBODY
                    picks = now.picks
                    settled = self._settled(then, now)
                    if settled:
                        made.append(now)
                    # A motion alone has nothing to act on, and nothing near it is tried.
                    alone = self.held(now) == picks and len(picks) == 1
                    if settled and (alone or self.price(now) > before - self.effect_price):
                        break
                    before = self.price(now)
        return made

    def _settled(self, before: Fit, now: Fit) -> bool:
        """Whether what others have acted on, of ``before``, is what effects do ``now``."""
        said = {
            name: self.entries[name][number].said(weights)
            for (name, number), weights in self.weighted(before)
        }
        # Nothing acts on what the last one does.
        for (name, number), weights in self.weighted(now)[:-1]:
            done = self.entries[name][number].said(weights)
            far = float(np.std(done - said[name]))
            if far > max(UNSETTLED * float(np.std(done)), self.sigma):
                return False
        return True

    def _own(self, trial: Channel, picks: Sequence[Pick]) -> tuple[Pick, ...]:
        """The picks of a ``trial``, whose candidates are among the entries from now on."""
        chosen: list[Pick] = []
        for name, number in picks:
            if name != WALK:
                self.entries[name].append(trial.entries[name][number].apart())
                number = len(self.entries[name]) - 1
            chosen.append((name, number))
        return tuple(chosen)

    def _composed(
        self, ordered: Sequence[Pick], fit: Fit, kept: Names = NOBODY, anew: Names = NOBODY
    ) -> Fit:
        """The fit of one more round (see ``_upon_each_other``); its candidates are among the
        entries from now on."""
        # Models of more effects than a channel has ask for the same again.
        asked = (*ordered,), fit.picks, fit.weights.tobytes(), fit.static_columns, kept, anew
        if asked not in self._rounds:
            self._rounds[asked] = self._one_more_round(ordered, fit, kept, anew)
        return self._rounds[asked]

    def _one_more_round(self, ordered: Sequence[Pick], fit: Fit, kept: Names, anew: Names) -> Fit:
        trial = self._upon_each_other(ordered, fit, kept, anew)
        picks = {name: 0 for name, _ in ordered}
        static = fit.static_columns
        several = [name for name in picks if len(trial.entries.get(name, ())) > 1]
        refused: set[Pick] = set()
        for _ in range(REFUSED):
            for name in several:
                rest = [(n, k) for n, k in picks.items() if n != name]
                picks[name] = trial._choose(rest, static, name, refused)
            best = trial.fit(picks.items())
            beyond = trial._beyond(best)
            if not beyond:
                break
            # Those weights are not as physics has them: the next best.
            refused |= {pick for pick in best.picks if pick[0] in beyond}
            several = beyond
        return replace(best, picks=self._own(trial, best.picks))

    def _upon_each_other(
        self, ordered: Sequence[Pick], fit: Fit, kept: Names, anew: Names
    ) -> Channel:
        """The channel with the candidates of ``fit`` upon what earlier stages do, each but those
        ``kept`` followed by those near it, and ``anew`` by all of its effect."""
        # Nothing acts on what the last one does.
        said = {
            pick[0]: self.columns(pick) @ weights
            for pick, weights in self.weighted(fit)
            if pick != ordered[-1]
        }
        change, moved = np.zeros(len(self.nominal.u)), None
        wanders, read = (WALK, 0) in ordered, False
        made: dict[str, list[Entry]] = {}
        alone = self.nominal.apart_from(name for name, _ in ordered if name != WALK)
        nominal, stage = alone, ""
        for name, number in ordered:
            if name == WALK:
                continue
            if acts_on_change(name, stage):
                stage = all_effects()[name].stage
                # Whatever wanders, what was read says where on its curve a converter was.
                read = wanders and all_effects()[name].bent
                done = self.residual if read else change
                nominal = alone.acting_on(alone.u + done, moved)
            if all_effects()[name].stage == MOTION or name in kept:
                again = self._again(nominal, name, self.entries[name][number])
                made[name] = [altered(again, nominal=nominal)]
            elif read or change.any():
                made[name] = self._upon(nominal, name, number)
            else:
                made[name] = self._once_more(alone, name, number)
            if name in anew and change.any():
                everywhere = self._offered(nominal, name, None)
                made[name] += [altered(other, nominal=nominal) for other in everywhere]
            change += said.get(name, 0.0)
            moved = self.entries[name][number].candidate.moved or moved
        trial = copy(self)
        trial._take(made)
        return trial

    def interval(self, fit: Fit, name: str, key: str) -> tuple[float, float, float]:
        """The parameter ``key`` of the effect ``name`` in a fit, and its 95 % interval.

        By the error of the same fit with other values of the grid: a parabola around the best (the
        likelihood ratio), widened by how far the residual is from white noise of its stated size.
        At least half a step of the grid to either side, and a whole one at its end.
        """
        entries = [(n, self.entries[n][k]) for n, k in fit.picks if n != WALK]
        if any(n == name and EXACTLY in (entry.near or {}) for n, entry in entries):
            return self._interval_around(fit, name, key)
        if any(entry.nominal is not None for _, entry in entries):
            # Upon what other effects do, as those are that it is compared with.
            trial = self._upon_each_other(fit.picks, fit, NOBODY, NOBODY)
            return trial._interval(trial.fit((name, 0) for name, _ in fit.picks), name, key)
        return self._interval(fit, name, key)

    def _interval_around(self, fit: Fit, name: str, key: str) -> tuple[float, float, float]:
        """The same of one that is on no grid, by what a small step of it does."""
        fine = all_effects()[name].fine
        entry = self.entries[name][dict(fit.picks)[name]]
        assert fine is not None
        step, values = fine.steps[key], entry.candidate.values
        nominal = entry.nominal or self.nominal
        moved = self.fine(nominal, name, {**values, key: values[key] + step}, entry.candidate.form)
        bend = float(((moved.columns - entry.columns) ** 2).sum()) / (step * self.sigma) ** 2
        noise = max(float(fit.errors.sum()) / self.sigma**2 / self.samples, 1.0)
        half = float(np.sqrt(CHI2_95 * noise / max(bend, 1e-30)))
        value = float(values[key])
        return value, value - half, value + half

    def _interval(self, fit: Fit, name: str, key: str) -> tuple[float, float, float]:
        picks = dict(fit.picks)
        chosen = self.entries[name][picks[name]].candidate
        value = float(chosen.values[key])
        if key in COUNTED:
            return value, value, value
        static = fit.static_columns
        rest = {k: v for k, v in chosen.values.items() if k != key}
        tried: dict[float, float] = {}
        for number, entry in enumerate(self.entries[name]):
            other = entry.candidate
            if not entry.at:
                break  # of another table, and so are all that follow
            alike = other.form == chosen.form and other.columns.shape == chosen.columns.shape
            same = {k: v for k, v in other.values.items() if k != key}
            if alike and same == rest and key in other.values:
                made = self._fit(tuple(sorted({**picks, name: number}.items())), static)
                tried[float(other.values[key])] = float(made.errors.sum()) / self.sigma**2
        grid = np.array(sorted(tried))
        if len(grid) > 2:
            # A candidate and what was tried near it may all but coincide, which says nothing.
            apart = np.abs(grid - value)
            grid = grid[(apart == 0.0) | (apart > 0.25 * np.median(np.diff(grid)))]
        at = int(np.argmin(np.abs(grid - value))) if len(grid) else 0
        if not 0 < at < len(grid) - 1:
            steps = np.abs(np.delete(grid, at) - value)
            # Alone on the grid, it is known as closely as the coarsest grids are: by a quarter.
            step = float(steps.min()) if len(steps) else 0.25 * abs(value)
            return value, value - step, value + step
        below, best, above = (tried[v] for v in grid[at - 1 : at + 2])
        left, right = grid[at] - grid[at - 1], grid[at + 1] - grid[at]
        bend = ((above - best) / right + (below - best) / left) / (left + right)
        noise = max(float(fit.errors.sum()) / self.sigma**2 / self.samples, 1.0)
        half = np.sqrt(CHI2_95 * noise / bend) if bend > 0.0 else max(left, right)
        return value, value - float(max(half, left / 2)), value + float(max(half, right / 2))


def acts_on_change(name: str, before: str) -> bool:
    """Whether an effect acts on what others have done, the last of them of the stage ``before``."""
    stage = all_effects()[name].stage
    return stage not in (before, "") or stage in SERIAL


def on_each_other(picks: Sequence[Pick]) -> bool:
    """Whether effects act on what others of them do, or on what wanders."""
    names = [name for name, _ in picks if name != WALK]
    stages = {all_effects()[name].stage for name in names}
    if len(names) < len(picks) and any(all_effects()[name].bent for name in names):
        # What wanders moves along the curve of a converter.
        return True
    return len(stages) > 1 or (len(names) > 1 and not SERIAL.isdisjoint(stages))


def _orders(picks: Sequence[Pick]) -> list[tuple[Pick, ...]]:
    """In which the effects may act on each other, or are looked at once more; none beside a walk
    that none of them acts on."""
    stages = {pick: all_effects()[pick[0]].stage for pick in picks if pick[0] != WALK}
    if not stages or (len(stages) < len(picks) and not on_each_other(picks)):
        return []
    circuits = [pick for pick, stage in stages.items() if stage == ELECTRICAL]
    at = {pick: STAGES.index(stage) for pick, stage in stages.items()}
    rest = sorted(set(picks) - set(circuits), key=lambda pick: (at.get(pick, 0), pick))
    return [
        (*rest, *order) for order in dict.fromkeys((tuple(circuits), tuple(reversed(circuits))))
    ]
