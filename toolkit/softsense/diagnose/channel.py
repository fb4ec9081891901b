"""One channel of a comparison: its residual, what effects could leave in it, and the best fits."""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable, Mapping, Sequence, Set
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import (
    COUNTED,
    Base,
    Columns,
    Design,
    Entry,
    Fit,
    Group,
    Key,
    Pick,
    Term,
    further,
)
from softsense.diagnose.nominal import history_basis, slow_over
from softsense.diagnose.walk import innovations, likely_gain
from softsense.effects import (
    CALIBRATED,
    EXACTLY,
    STAGES,
    Candidate,
    Effect,
    Nominal,
    all_effects,
    altered,
)

Floats = NDArray[np.float64]
# What moves the strain, which all channels have in common.
Held = tuple[Pick, ...]
Names = frozenset[str]
NOBODY: Names = frozenset()
NO_PICKS: Set[Pick] = frozenset()

# Prices in units of the noise variance (a chance column gains about 1). Set on made cases of the
# training half of tests/benchmarks/gap.
WEIGHT_PRICE = 12.0
# And of the gap: many weights follow what an equation that is only nearly right leaves.
WEIGHT_SHARE = 2e-5
# Per sample: an effect of half the noise's size gains a quarter.
EFFECT_PRICE = 0.25
# That is for what the nominal signal may be wrong by, not for chance: where the real noise is far
# louder than the simulated one (by more than this factor of power), less.
LOUD = 4.0
LEAST_GUARD = 0.05
# So many times an effect's price more for a second one: what an equation leaves that is only nearly
# right.
SECOND_PRICE = 0.25
# Per sample: what more effects may leave less than noise, or than fewer, by chance.
LESS_LEFT = 0.02
# What an effect does that says next to nothing, of the noise.
SAYS_NOTHING = 2.0
# A static miscalibration: an offset, or a whole curve, with a share of the gap for each.
OFFSET_PRICE = 0.05
OFFSET_SHARE = 0.005
STATIC_PRICE = 0.5
STATIC_SHARE = 0.02
# A curve that comes with an effect (``Candidate.curved``), or beside one of the past alone is no
# more than this share of the gap: there its equation has another mean curve.
SMALL_CURVE = 0.05
CURVED_PRICE = 0.03
CURVED_SHARE = 0.006
# Per sample: an offset that comes with one (``Candidate.shifting``).
SHIFTING_PRICE = 0.03
# Per sample: such a curve is one of its own where the effect adds less to it.
IDLE = 0.06
# And what goes with the strain rate, where it is no more than so much of all that it does.
MOST_CURVED = 0.1
# Per sample: a second parameter of an equation, and each further one. Where two equations leave
# nearly nothing, which leaves less says how well the nominal signal is known.
PARAMETER_PRICE = 0.01
# What follows whatever is near (``Candidate.pliable``) says a little more than it should.
PLIABLE_SHARE = 0.002
# What one effect's equation, being only nearly right, may leave to a second one, of the gap.
FORM_SHARE = 0.006
# The same where every equation is exact: play, delays, circuits.
EXACT_SHARE = 0.002
# Of two effects that leave nearly nothing both are right, whatever the gap: such a share is no more
# than so many times what is left.
SHARE_OF_LEFT = 2.0
# Standard deviation of a weight that physics fixes at 1, beside other effects.
LEEWAY = 0.03
# A residual within this much of what the simulation has of its own (over the noise) is no gap.
OWN_RANDOM = 1.5
# Sum of sizes over size of the sum of weights that should have one sign.
CANCELLING = 2.0
# How many times the gap an effect may say that a walk takes back: only what is fast of it is seen.
CANCELLED = 3.0
# One of several weights is alone where it is so much of all.
ALONE = 0.95
# 95 % of a chi-squared variable with one degree of freedom.
CHI2_95 = 3.84
# A random walk follows all that is slow: it must be far better than what says why.
WALK = "random_walk"
WALK_PRICE = 0.5
WALK_SHARE = 0.005
BESIDE_WALK = 0.1
# What an effect alone may leave of the gap, for a closer look at it in other places.
WORTH = 0.5
# What it leaves in another place, of what it leaves on the codes, to be looked at closely there.
PLACED = 0.6
# So many narrow candidates are all looked at in other places, whatever was chosen on the codes.
FEW = 32
# So many candidates whose weights are not as physics has them are left for the next best.
REFUSED = 4
# How often the candidates of several effects are chosen beside each other; once where that is
# hopeless.
PASSES = 3
# What leaves so many times what others do.
HOPELESS = 4.0
# How often effects are fitted again upon what the others then do.
ROUNDS = 5
# What one does may change from round to round by this share, or by the noise, in the end.
UNSETTLED = 0.1
# Of so many candidates what is near them is kept meanwhile.
KEPT = 4
# Stages whose effects act on each other: one circuit follows the other, and a clock that is late
# has seen the play before it. Play and delay may change places; circuits may not.
MOTION = "motion"
MATERIAL = "material"
ELECTRICAL = "electrical"
SERIAL = frozenset({MOTION, ELECTRICAL})
# What acts on codes as they are; of that a converter's curve says something beside anything.
CURVE = "adc_nonlinearity"
# A rail: what others do says where it begins.
RAIL = "saturation"
RAILS = frozenset({RAIL})
# Longer recordings are thinned for the search, after their filters have run at the full rate.
SEARCHED = 16_000
# So many times longer ones are looked at less closely: at the full rate each filter takes its time.
# Fewer of their samples are searched.
LONG = 10
SEARCHED_OF_LONG = 10_000
# What an effect alone says of what no effect says, or of what the best one leaves, to be looked at
# more closely for itself.
SAYS = 0.12
SAYS_OF_LONG = 0.25
# Columns are compared that are the same in so many samples.
GLANCED = 100
# The columns of a candidate that an entry has laid out.
NOTHING: Floats = np.zeros((0, 0))


class Channel:
    """What the search needs of one channel; fits are made when they are asked for, and kept."""

    def __init__(
        self,
        nominal: Nominal,
        residual: Floats,
        sigma: float,
        static: Floats,
        known: Sequence[str],
        own: float,
        missed: float,
        kept: float,
        history: Floats,
        earlier: dict[str, list[Entry]] | None = None,
        felt: Floats | None = None,
    ) -> None:
        """``residual`` (samples,) codes, ``sigma`` its noise, ``static`` (samples, p) a basis.

        ``own``: mean square of what the simulation itself has beside its nominal signal. Where that
        is more than noise (its random walks, its spikes), as much is no gap. ``missed``: how much
        of it is no noise; ``kept``: the share of the noise that is in the nominal signal.
        ``history``: the ``history_basis`` of the motion. ``earlier``: what effects have offered to
        the same residual before, or where none has, what these do now. ``felt``: (samples,) how
        much of a walk shows, where that is not the same everywhere.
        """
        square = float(np.mean(residual**2))
        self.guard = min(1.0, max(LOUD * own / sigma**2, LEAST_GUARD))
        self.quiet = own > OWN_RANDOM * sigma**2 and square < OWN_RANDOM * own
        self.nominal, self.residual, self.sigma, self.static = nominal, residual, sigma, static
        # Where fast moves are kept as simulated, nothing of the simulation's noise is beside them.
        strained = nominal.reference.own[nominal.channel] != 0
        simulated = own / (1.0 - kept) if strained else own
        # The slow part of that noise is still in the nominal signal, and what of its motion nobody
        # could tell is not.
        self.noise = sigma**2 + kept * min(simulated, sigma**2) + missed
        self.long = len(residual) > LONG * SEARCHED
        most = SEARCHED_OF_LONG if self.long else SEARCHED
        self._thin = slice(None, None, -(-len(residual) // most))
        self._together = slow_over(nominal.strain[self._thin])
        squares = float(np.sum(residual[self._thin] ** 2)) / sigma**2
        self._size = float(np.sqrt(np.mean(residual[self._thin] ** 2)))
        self.samples = len(residual[self._thin])
        # Squares of the residual beyond the noise, over its variance; with what fast moves keep.
        usual = self.samples * (self.noise / sigma**2 if strained else 1.0)
        self.excess = 0.0 if self.quiet else max(squares - usual, 0.0)
        # Squares of its moves from sample to sample, in noise variances.
        self.pace = max(float(np.sum(np.diff(nominal.u) ** 2)) / sigma**2, 1.0)
        self.weight_price = WEIGHT_PRICE + WEIGHT_SHARE * self.excess
        self.felt = felt
        self.gain = likely_gain(self.wandering(residual)[self._thin], sigma)
        self._of_simulation = own, missed, kept
        self._unchanged: dict[Hashable, list[Entry]] = {}
        bent = np.vander(nominal.share[self._thin], static.shape[1] // 2)
        curves = np.concatenate([static[self._thin], bent], axis=1)
        self._curves: Floats = np.linalg.qr(curves)[0]
        self._straight: Floats = np.linalg.qr(bent[:, -2:])[0]
        found: dict[str, list[Entry]] = {}
        # Where no effect can pay, none is asked.
        if self.excess >= self.effect_price:
            found = {name: [] for name in known}
            # Channels begin with different effects, so that they seldom wait for the same.
            first = 4 * nominal.channel % max(len(known), 1)
            for name in (*known[first:], *known[:first]):
                found[name] = (earlier or {}).get(name) or self._offered(nominal, name, None)
            if earlier is not None and not earlier:
                earlier.update(found)
            self.gain = self._first_gain(history[self._thin])
        thinned = self.static[self._thin]
        rows = np.stack([residual[self._thin], np.ones(len(thinned)), *thinned.T])
        self._base = Base(rows, None, self._together)
        self._beside_walk = self._innovations_of(rows)
        self._take(found)

    def wandering(self, walk: Floats) -> Floats:
        """(samples, …) what wanders where ``walk`` (samples, …) of it shows in the codes."""
        if self.felt is None:
            return walk
        felt = self.felt if len(walk) == len(self.felt) else self.searched(self.felt)
        return (walk.T / felt).T

    def _innovations_of(self, rows: Floats) -> Base:
        """``rows`` (n, searched samples) as they show beside a walk."""
        felt = None if self.felt is None else self.searched(self.felt)
        return Base(rows, self.gain, self._together, felt)

    def _offered(
        self, nominal: Nominal, name: str, near: Mapping[str, float] | None, place: str = ""
    ) -> list[Entry]:
        """What an effect explains in a place, or its zoom around ``near``."""
        made = offered(self._asked(all_effects()[name], nominal), name, near, place)
        return all_at_once(lambda k: self._entry(made[k], k, near, place), range(len(made)))

    def _elsewhere(self, nominal: Nominal, name: str, there: Iterable[Entry]) -> list[Entry]:
        """The candidates ``there`` in all other places where the effect may act."""
        effect, entries = all_effects()[name], []
        asked = self._asked(effect, nominal)
        places = self.nominal.felt(effect.stage).places
        for place in ("", *places) if effect.stage == MATERIAL else ():
            made: dict[Hashable, list[Candidate]] = {}
            for entry in there:
                if entry.place == place:
                    continue
                key = None if entry.near is None else tuple(entry.near.items())
                if key not in made:
                    made[key] = offered(asked, name, entry.near, place)
                number = entry.number
                entries.append(self._entry(made[key][number], number, entry.near, place))
        return entries

    def _asked(self, effect: Effect, nominal: Nominal) -> Nominal:
        """``nominal`` for traces of the samples that the search looks at."""
        # Before samples are left out: the largest strain so far is one of all.
        asked = self.thinned(nominal.felt(effect.stage))
        return asked.kept() if effect.memoryless else asked

    def thinned(self, nominal: Nominal) -> Nominal:
        """``nominal`` with only the samples that the search looks at kept."""
        return replace(nominal, keep=self._thin)

    def _first_gain(self, history: Floats) -> float:
        """The gain of a walk beside whatever the motion's history tells (see ``walk``)."""
        residual, gain = self.wandering(self.residual)[self._thin], self.gain
        history = self.wandering(history)
        for _ in range(2):
            basis, news = innovations(history, gain), innovations(residual[:, None], gain)[:, 0]
            weights = np.linalg.lstsq(basis.T @ basis, basis.T @ news)[0]
            gain = likely_gain(residual - history @ weights, self.sigma)
        return gain

    def gain_of(self, walk: Floats) -> float:
        """The gain of a ``walk`` (samples,): from one sample that is searched to the next one it
        goes farther than between all of them."""
        return self.gain if self._thin.step == 1 else likely_gain(walk, self.sigma)

    def _better_gain(self) -> float:
        """The same beside what the best model with a walk says."""
        walks = [fit for (names, _), fit in self._best.items() if WALK in names]
        if not walks:
            return self.gain
        best = min(walks, key=self.price)
        left = self.residual[self._thin].copy()
        for (name, number), weights in self.weighted(best):
            left -= self.entries[name][number].said(weights)
        return likely_gain(self.wandering(left), self.sigma)

    def _entry(
        self, candidate: Candidate, number: int, near: Mapping[str, float] | None, place: str
    ) -> Entry:
        columns = self._searched(candidate).astype(np.float32, order="F")
        return Entry((), altered(candidate, made=NOTHING), columns, number, near, place)

    def _searched(self, candidate: Candidate) -> Floats:
        """(searched samples, p) the columns of a candidate."""
        return self.searched(candidate.columns)

    def searched(self, values: Floats) -> Floats:
        """Of ``values`` (samples, …) or (searched samples, …) those that the search looks at."""
        return values[self._thin] if len(values) == len(self.residual) else values

    def _take(self, found: Mapping[str, Sequence[Entry]]) -> None:
        """Lay out the columns of ``found``, each once, and forget all fits."""
        begin, glance = len(self._base.rows), slice(None, None, self.samples // GLANCED + 1)
        self.entries: dict[str, list[Entry]] = {}
        self.groups: dict[str, Group] = {}
        for name, entries in found.items():
            if not entries:
                continue
            rows: list[Columns] = []
            places: dict[bytes, list[int]] = {}
            made: dict[tuple[int, ...], Columns] = {}
            laid = []
            for entry in entries:
                numbers, columns = [], np.asarray(entry.columns, dtype=np.float32, order="F")
                for row in columns.T:
                    alike = places.setdefault(row[glance].tobytes(), [])
                    place = next((k for k in alike if np.array_equal(rows[k], row)), len(rows))
                    if place == len(rows):
                        alike.append(place)
                        rows.append(row)
                    numbers.append(begin + place)
                at = tuple(numbers)
                laid.append(entry.laid(at, made.setdefault(at, columns)))
            begin += len(rows)
            self.entries[name], self.groups[name] = laid, Group(laid, rows)
        self.design = Design(self._base, self.groups)
        # How effects show beside a walk: what the past does not foresee of them.
        if self._beside_walk.gain != self.gain:
            self._beside_walk = self._innovations_of(self._base.rows)
        self.walking = Design(self._beside_walk, self.groups)
        self._fits: dict[tuple[tuple[Pick, ...], int], Fit] = {}
        self._prices: dict[int, tuple[Fit, float]] = {}
        self._worths: dict[tuple[tuple[Pick, ...], int, str], tuple[Floats, Floats]] = {}
        self._whole: dict[Pick, Floats] = {}
        self._best: dict[tuple[frozenset[str], Held], Fit] = {}
        self._by_fewer: dict[int, bool] = {}
        self._numbers: dict[str, dict[Key, int]] = {}
        self._beside_curves: dict[Hashable, tuple[float, float]] = {}
        self._within: dict[tuple[frozenset[str], Held], Fit] = {}
        self._elsewhere_said: dict[str, int] = {}
        self._stood: dict[Names, Fit] = {}
        self._rounds: dict[Hashable, Fit] = {}

    def zoom(
        self,
        chosen: Iterable[Pick],
        beside: Container[str],
        moved: Mapping[str, Entry],
        fitted: Mapping[str, Sequence[Entry]],
        stood: Iterable[Fit],
    ) -> None:
        """Look closer around the grid points ``chosen``, and nowhere else; where no effect can pay,
        not at all, and else only at effects that say something alone, or are promising ``beside``
        others. Of the motion only at what is known to have ``moved`` it; and at what was ``fitted``
        to all channels. Fits of several effects also begin then where they ``stood``."""
        if self.excess < self.effect_price:
            return
        chosen = set(chosen)
        found: dict[str, list[Entry]] = {}
        at: dict[Pick, int] = {}
        for name, entries in self.entries.items():
            effect = all_effects()[name]
            numbers = {number for other, number in chosen if other == name}
            if not numbers or name in RAILS:
                alone = self._choose((), 0, name)
                # Beside a static curve a rail may be anywhere.
                if not numbers or self.left(self.bare([(name, alone)])) < WORTH * self.excess:
                    numbers.add(alone)
            if effect.zoom is None:
                # Candidates of one column cost little.
                numbers |= {k for k, entry in enumerate(entries) if entry.width == 1}
            kept = [entries[number].apart() for number in sorted(numbers)]
            all_stay = effect.zoom is None and name not in moved
            for place, number in enumerate(sorted(numbers)):
                at[name, number] = number if all_stay else place
            if name in moved:
                found[name] = [*kept, self._again(self.nominal, name, moved[name])]
                continue
            found[name] = [*entries] if all_stay else [*kept]
            # At the full rate a closer look takes its time.
            if self.long and name not in beside and self._leaves_far_more(name):
                continue
            looked_at = [""]
            if self.left(self.best(frozenset({name}))) < WORTH * self.excess:
                narrow = len(entries) <= FEW and all(entry.width == 1 for entry in entries)
                there = self._elsewhere(self.nominal, name, entries if narrow else kept)
                found[name] += there
                looked_at += self._better_places(kept, there)
            if effect.zoom and (name in beside or self._says(name)):
                for near in {tuple(entry.candidate.values.items()): None for entry in kept}:
                    for where in looked_at:
                        found[name] += self._offered(self.nominal, name, dict(near), where)
        for name, more in fitted.items():
            found[name] += more
        self.gain = self._better_gain()
        self._take(found)
        for fit in stood:
            if len(fit.picks) > 1 and at.keys() >= set(fit.picks):
                picks = tuple((name, at[name, number]) for name, number in fit.picks)
                self._stood[frozenset(dict(picks))] = replace(fit, picks=picks)

    def _better_places(self, here: Iterable[Entry], there: Iterable[Entry]) -> list[str]:
        """The places of what is ``there`` that leave far less of the residual than all ``here``."""
        if self.long:
            return []
        residual = self.residual[self._thin]
        squares = float(residual @ residual)

        def left(entry: Entry) -> float:
            columns = entry.columns.astype(np.float64)
            gram, side = columns.T @ columns, columns.T @ residual
            return squares - float(side @ np.linalg.lstsq(gram, side)[0])

        least = PLACED * min(map(left, here))
        return sorted({entry.place for entry in there if left(entry) < least})

    def begin_with(self, elsewhere: Mapping[str, Entry]) -> None:
        """Candidates of another channel, with which fits of several effects may begin here too."""
        begin: dict[str, list[Entry]] = {}
        for name in sorted(elsewhere.keys() & self.entries.keys()):
            entry = elsewhere[name]
            asked = self._asked(all_effects()[name], self.nominal)
            source = entry.number, entry.near, entry.place
            here = offered(asked, name, entry.near, entry.place)[entry.number : entry.number + 1]
            # Not all channels have the same ones: of that number may be crosstalk from another one.
            if [candidate.values for candidate in here] == [entry.candidate.values]:
                begin[name] = [self._entry(here[0], *source)]
        if begin:
            entries, stood = self.entries.items(), self._stood
            self._take({n: [e.apart() for e in own] + begin.get(n, []) for n, own in entries})
            self._stood = stood
            self._elsewhere_said = {name: len(self.entries[name]) - 1 for name in begin}

    def _leaves_far_more(self, name: str) -> bool:
        """Whether an effect alone leaves many times what another one does, which is no walk."""
        alone = {other: self.left(self.best(frozenset({other}))) for other in self.entries}
        return alone[name] > HOPELESS * max(min(alone.values()), self.effect_price)

    def _says(self, name: str) -> bool:
        """Whether an effect says something alone, or of a short recording beside the best one."""
        alone, nothing = self.best(frozenset({name})), self.best(frozenset())
        if self.long:
            return self.left(alone) < (1.0 - SAYS_OF_LONG) * self.left(nothing)
        if self.left(alone) < (1.0 - SAYS) * self.left(nothing):
            return True
        if name in RAILS and self.left(alone) < WORTH * self.excess:
            # A static curve says all that a rail does.
            return True
        others = [other for other in self.entries if all_effects()[other].stage != MOTION]
        best = min([nothing, *(self.best(frozenset({other})) for other in others)], key=self.price)
        both = self.best(frozenset(dict(best.picks)) | {name})
        return self.left(both) < (1.0 - SAYS) * self.left(best)

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

    def numbers(self, name: str) -> dict[Key, int]:
        """Where the candidates of an effect stand, by what makes them."""
        if name not in self._numbers:
            self._numbers[name] = {
                entry.key: k for k, entry in enumerate(self.entries[name]) if entry.at
            }
        return self._numbers[name]

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

    def left_by(self, fit: Fit, picks: Iterable[Pick]) -> Floats:
        """(searched samples,) of the residual that these ``picks`` of a fit and its static part
        leave."""
        chosen, rest = set(picks), self.residual[self._thin].copy()
        for pick, weights in self.weighted(fit):
            if pick in chosen:
                rest -= self.entries[pick[0]][pick[1]].said(weights)
        if fit.static is not None:
            one = len(fit.static) == 1
            rest -= fit.static[0] if one else self.static[self._thin] @ fit.static
        return rest

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

    def moved_alone(self) -> dict[str, Entry]:
        """The effect of the motion that says most alone, and its best candidate."""
        motions = [name for name in self.entries if all_effects()[name].stage == MOTION]
        fits = [self.best(frozenset({name})) for name in motions]
        return self.motion_of(min(fits, key=self.price)) if fits else {}

    def motion_of(self, fit: Fit) -> dict[str, Entry]:
        """The candidates of a fit that change the strain itself."""
        return {name: self.entries[name][number] for name, number in self.held(fit)}

    def held(self, fit: Fit) -> Held:
        """The picks of a fit that change the strain itself."""
        return tuple(
            pick for pick in fit.picks if pick[0] != WALK and all_effects()[pick[0]].stage == MOTION
        )

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

    def _upon(self, nominal: Nominal, name: str, number: int) -> list[Entry]:
        """A candidate and what is close to it, of a changed nominal signal."""
        entry = self.entries[name][number]
        made = [self._again(nominal, name, entry), *self._elsewhere(nominal, name, [entry])]
        near = None if all_effects()[name].zoom is None else dict(entry.candidate.values)
        made += self._offered(nominal, name, near, entry.place)
        return [altered(other, nominal=nominal) for other in made]

    def _again(self, nominal: Nominal, name: str, entry: Entry) -> Entry:
        """A candidate of another nominal signal."""
        asked = self._asked(all_effects()[name], nominal)
        source = entry.number, entry.near, entry.place
        return self._entry(explained(asked, name, *source), *source)

    def _once_more(self, alone: Nominal, name: str, number: int) -> list[Entry]:
        """The same where nothing has changed the nominal signal, which is that of the channel
        ``alone``."""
        entry = self.entries[name][number]
        key = alone is self.nominal, name, entry.number, entry.place, *(entry.near or {}).items()
        if key not in self._unchanged:
            while len(self._unchanged) >= KEPT:
                del self._unchanged[next(iter(self._unchanged))]
            if self.long and entry.near is not None:
                # It was looked at closely, which takes long.
                again = self._again(alone, name, entry)
                self._unchanged[key] = [altered(again, nominal=alone)]
            else:
                self._unchanged[key] = self._upon(alone, name, number)
        return self._unchanged[key]

    def columns(self, pick: Pick) -> Floats:
        """(samples, p) of a candidate, at the full rate."""
        entry = self.entries[pick[0]][pick[1]]
        if self._thin.step == 1:
            return self.whole(pick[0], entry)
        if pick not in self._whole:
            self._whole[pick] = self.whole(pick[0], entry)
        return self._whole[pick]

    def whole(self, name: str, entry: Entry) -> Floats:
        """(samples, p) the columns of an ``entry`` of the effect ``name``, at the full rate."""
        if self._thin.step == 1:
            return entry.columns.astype(np.float64)
        source = entry.number, entry.near, entry.place
        return explained(entry.nominal or self.nominal, name, *source).columns

    def disturbed(self, pick: Pick, noise: Floats) -> Floats:
        """(samples, p) the columns of a candidate where ``noise`` (samples,) is on what it acts on,
        at the full rate."""
        entry = self.entries[pick[0]][pick[1]]
        nominal = entry.nominal or self.nominal
        noisy = nominal.acting_on(nominal.u + noise, None)
        return explained(noisy, pick[0], entry.number, entry.near, entry.place).columns

    def left(self, fit: Fit) -> float:
        """Error on unseen time over the noise variance, beyond the noise itself."""
        left = float(fit.errors.sum()) / self.sigma**2 - self.samples
        if (WALK, 0) in fit.picks:
            # The likelihood of its innovations, whose variance is larger than the noise's.
            left -= self.samples * float(np.log1p(-self.gain))
            # A curve of what was read says of the noise what the noise itself has moved.
            left = max(left, 0.0)
        return left

    def price(self, fit: Fit) -> float:
        """What a fit leaves on unseen time, noise included, and what its terms cost."""
        if id(fit) not in self._prices:
            self._prices[id(fit)] = fit, self._price(fit)
        return self._prices[id(fit)][1]

    def _price(self, fit: Fit) -> float:
        price, guarded = self.weight_price * fit.columns, self.guard * self.samples
        if (WALK, 0) in fit.picks:
            price += self.effect_price * beside_walk(len(fit.picks) - 1)
            price += WALK_PRICE * guarded + WALK_SHARE * self.excess
            if len(fit.picks) > 1:
                moves = float(self.walking.squares.sum()) / self.sigma**2
                price += FORM_SHARE * max(moves - self.samples, 0.0) * (len(fit.picks) - 1)
        else:
            # Parts that cancel are as good as one effect more.
            count = len(fit.picks) + len(self._cancelling(fit))
            price += self.effect_price * (count + SECOND_PRICE * max(count - 1, 0))
            share = EXACT_SHARE if self.exact(fit) else FORM_SHARE
            price += self._share_price(share, fit) * max(count - 1, 0)
        picks = [pick for pick in fit.picks if pick[0] != WALK]
        candidates = [self.entries[name][number].candidate for name, number in picks]
        if any(candidate.curved for candidate in candidates):
            price += CURVED_PRICE * guarded + self._share_price(CURVED_SHARE, fit)
        if any(candidate.shifting for candidate in candidates):
            price += SHIFTING_PRICE * guarded
        price += STATIC_PRICE * guarded * len(self.idle(fit, curved=True))
        more = sum(further(candidate) for candidate in candidates)
        price += PARAMETER_PRICE * guarded * more
        if any(candidate.pliable for candidate in candidates):
            price += self._share_price(PLIABLE_SHARE, fit)
        if fit.static_columns == 1:
            price += OFFSET_PRICE * guarded + self._share_price(OFFSET_SHARE, fit)
        elif self._own_curve(fit):
            price += CURVED_PRICE * guarded + self._share_price(CURVED_SHARE, fit)
        elif fit.static is not None:
            price += STATIC_PRICE * guarded + STATIC_SHARE * self.excess
        return self.samples + self.left(fit) + (np.inf if self._beyond(fit) else price)

    def idle(self, fit: Fit, curved: bool) -> list[str]:
        """Effects that add little else to a curve (``curved``) which their columns hold besides, or
        which goes with the past and the strain rate; or else a converter's curve that is little
        else than straight."""
        result = []
        for (name, number), weights in self.weighted(fit):
            effect, entry = all_effects()[name], self.entries[name][number]
            beside = entry.candidate.curved and not effect.bent
            beside |= effect.lasting and effect.by_rate
            if not (beside if curved else effect.bent):
                continue
            key = name, number, weights.tobytes()
            if key not in self._beside_curves:
                said = entry.said(weights)
                curves = self._straight if effect.bent else self._curves
                beyond = said - curves @ (curves.T @ said)
                most = MOST_CURVED * float(said.var()) if effect.by_rate else 0.0
                self._beside_curves[key] = float((beyond**2).mean()), most
            adds, most = self._beside_curves[key]
            if adds < max(IDLE * self.sigma**2, most):
                result.append(name)
        return result

    def _own_curve(self, fit: Fit) -> bool:
        """Whether the static curve of a fit is a small one beside an effect of the past alone."""
        if fit.static is None or len(fit.picks) != 1 or fit.picks[0][0] == WALK:
            return False
        curve = self.static[self._thin] @ fit.static
        small = float(curve.var()) < SMALL_CURVE * self.excess / self.samples * self.sigma**2
        return all_effects()[fit.picks[0][0]].lasting and small

    def _share_price(self, share: float, fit: Fit) -> float:
        """This share of the gap, or less where a fit without a walk leaves nearly nothing of it."""
        if (WALK, 0) in fit.picks:
            return share * self.excess
        return min(share * self.excess, SHARE_OF_LEFT * max(self.left(fit), 0.0))

    @property
    def least_with_walk(self) -> float:
        """The price of a fit with a walk and nothing else that leaves just the noise."""
        walk = WALK_PRICE * self.guard * self.samples + WALK_SHARE * self.excess
        return self.samples + self.effect_price + walk

    def exact(self, fit: Fit) -> bool:
        """Whether every equation is what happens, and not a model of a material."""

        def equation(name: str, number: int) -> bool:
            made = self.entries[name][number].candidate
            return not (made.pliable or made.nearly)

        return all(
            all_effects()[name].exact and equation(name, number) for name, number in fit.picks
        )

    @property
    def effect_price(self) -> float:
        """What an effect costs, whatever its columns are."""
        return EFFECT_PRICE * self.guard * self.samples

    def fit(self, picks: Iterable[Pick]) -> Fit:
        """The cheapest of the picks with no static miscalibration, an offset, or a curve."""
        ordered = tuple(picks)
        return min((self._fit(ordered, static) for static in self._statics()), key=self.price)

    def bare(self, picks: Iterable[Pick]) -> Fit:
        """The fit of the picks without any static miscalibration, which would hide how far off they
        are."""
        return self._fit(tuple(picks), 0)

    def _statics_of(self, fit: Fit) -> tuple[int, ...]:
        """What is tried beside one effect more: what ``fit`` has, and none."""
        return (0,) if fit.static is None else (0, len(fit.static))

    def _statics(self) -> tuple[int, ...]:
        return 0, 1, self.static.shape[1]

    def _fit(self, picks: tuple[Pick, ...], static: int) -> Fit:
        if (picks, static) not in self._fits:
            errors, weights = self._design(picks).fit(self._terms(picks), static)
            beside, curve = weights[static:], weights[:static] if static else None
            self._fits[picks, static] = Fit(picks, errors, beside, curve)
        return self._fits[picks, static]

    def _design(self, picks: Sequence[Pick]) -> Design:
        return self.walking if (WALK, 0) in picks else self.design

    def _terms(self, picks: Sequence[Pick]) -> list[Term]:
        """The candidates ``picks`` as terms of a fit."""
        result = []
        for name, number in picks:
            if name == WALK:
                continue
            entry = self.entries[name][number]
            fixed, stiff = entry.candidate.fixed, 0.0
            if fixed:
                # Another effect changes what this one acts on, and so its weight of 1.
                stiff = (self.sigma / LEEWAY) ** 2 if len(picks) > 1 else np.inf
            result.append(Term(name, entry.at, fixed, stiff))
        return result

    def best(self, names: frozenset[str], held: Held = ()) -> Fit:
        """The cheapest fit with the candidates ``held`` and exactly the effects ``names`` besides,
        one candidate of each.

        Where no effect can pay the empty fit stands for all, and where fewer effects say all that
        there is, those do.
        """
        if self.excess < self.effect_price or not names <= {WALK, *self.entries}:
            names, held = frozenset(), ()
        count = len(names) + len(held)
        if names and count > 1 and WALK not in names and self._said_by_fewer(count):
            each = (self.best(names - {name}, held) for name in sorted(names))
            return min(each, key=self.price)
        if (names, held) not in self._best:
            self._best[names, held] = self._search(names, held)
        return self._best[names, held]

    def _said_by_fewer(self, count: int) -> bool:
        """Whether so many effects would cost more than fewer do, even if they left just noise."""
        if count not in self._by_fewer:
            known = [fit for (names, held), fit in self._best.items() if WALK not in names]
            fits = [fit for fit in known if len(fit.picks) < count]
            singles = {fit.picks[0][0] for fit in fits if len(fit.picks) == 1}
            # What moves the strain is not asked of every channel.
            still = {n for n in self.entries if n != WALK and all_effects()[n].stage != MOTION}
            if not still <= singles:
                return False
            noise = (self.noise / self.sigma**2 - 1.0) * self.samples
            least = min(noise, *map(self.left, fits)) - LESS_LEFT * self.samples
            more = (count + SECOND_PRICE * (count - 1)) * self.effect_price
            self._by_fewer[count] = min(map(self.price, fits)) < self.samples + least + more
        return self._by_fewer[count]

    def _search(self, names: frozenset[str], held: Held) -> Fit:
        if not names:
            return self.fit(held)
        made: list[Fit] = []
        alone = len(names) == 1 and not held
        hopeless = np.inf if alone or WALK in names else self._hopeless()
        for last in sorted(names):
            fewer = self.best(names - {last}, held)
            others = dict(fewer.picks)
            for static in self._statics() if alone else self._statics_of(fewer):
                if made and min(map(self.price, made)) > hopeless:
                    continue
                fit = self._beside(last, others, static, held, hopeless=hopeless)
                made.append(fit)
                made += self._otherwise(last, others, static, fit, held)
                pliable = self._pliable(fit, held)
                if pliable and self.price(fit) <= hopeless:
                    # What follows all that it has seen may be far off where it has not.
                    made.append(self._beside(last, others, static, held, refused=pliable))
            for name in sorted(others.keys() & self._elsewhere_said.keys()):
                begun = {**others, name: self._elsewhere_said[name]}
                made.append(self._beside(last, begun, 0, held, hopeless=hopeless))
        if names in self._stood and not held:
            stood = self._stood[names]
            static = stood.static_columns
            for last in sorted(names):
                rest = {name: number for name, number in stood.picks if name != last}
                made.append(self._beside(last, rest, static, hopeless=hopeless))
        return min(made, key=self.price)

    def _hopeless(self) -> float:
        """The price of what leaves too many times what the cheapest fit so far does; a walk, which
        follows whatever is left, says nothing of that."""
        known = [fit for (names, _), fit in self._best.items() if WALK not in names]
        least = min(map(self.price, known), default=np.inf)
        return self.samples + HOPELESS * max(least - self.samples, 0.0)

    def _pliable(self, fit: Fit, held: Held) -> set[Pick]:
        """Pliable candidates of the effects of which ``fit`` has one, but for those ``held``."""
        return {
            (name, number)
            for name, chosen in fit.picks
            if name != WALK and (name, chosen) not in held
            if self.entries[name][chosen].candidate.pliable
            for number in self.groups[name].pliable
        }

    def chosen_again(self, fit: Fit, held: Held = ()) -> Fit:
        """``fit``, or a cheaper one of the same effects: those chosen one after the other may stand
        in each other's way, so that each but those ``held`` begins once with its best candidate of
        every form."""
        free = [name for name, _ in fit.picks if name not in dict(held)]
        if len(free) < 2 or (WALK, 0) in fit.picks:
            return fit
        made, statics = [fit], {0, fit.static_columns}
        for name in free:
            rest = {n: k for n, k in fit.picks if n != name}
            for static in statics:
                worth = self.worth(tuple(rest.items()), static, name)
                best: dict[str, int] = {}
                for number in np.argsort(-worth).tolist():
                    best.setdefault(self.entries[name][number].candidate.form, number)
                for number in best.values():
                    for last in sorted(set(free) - {name}):
                        begin = {n: k for n, k in rest.items() if n != last} | {name: number}
                        made.append(self._beside(last, begin, static, held))
        return min(made, key=self.price)

    def _otherwise(
        self, last: str, others: Mapping[str, int], static: int, fit: Fit, held: Held
    ) -> list[Fit]:
        """The same without the candidates of ``fit`` whose weights are not as physics has them."""
        made: list[Fit] = []
        refused: set[Pick] = set()
        for _ in range(REFUSED):
            cancelling = self._cancelling(fit)
            wrong = {*cancelling, *self._beyond(fit)} - dict(held).keys()
            if not wrong:
                break
            refused |= {pick for pick in fit.picks if pick[0] in wrong}
            refused |= {o for pick in fit.picks if pick[0] in cancelling for o in self._alike(pick)}
            refused |= {
                o for pick in fit.picks if pick[0] in wrong for o in self._at_other_times(pick)
            }
            free = {n: k for n, k in others.items() if n not in wrong}
            fit = self._beside(last, free, static, held, wrong, refused)
            made.append(fit)
        return made

    def _alike(self, pick: Pick) -> list[Pick]:
        """Candidates of the same effect whose weights cancel where those of this one do."""
        name, number = pick
        form = self.entries[name][number].candidate.form
        return [
            (name, k)
            for k, entry in enumerate(self.entries[name])
            if entry.candidate.parallel and entry.candidate.form == form
        ]

    def _at_other_times(self, pick: Pick) -> list[Pick]:
        """Of a candidate with several weights, none of which may be negative, those that differ in
        their time constants only: one of theirs is as well."""
        name, number = pick
        entry = self.entries[name][number]
        if not entry.candidate.positive or entry.width < 2:
            return []

        def beside(candidate: Candidate) -> tuple[str, dict[str, float]]:
            return candidate.form, {k: v for k, v in candidate.values.items() if k != "tau_s"}

        own = beside(entry.candidate)
        every = enumerate(self.entries[name])
        return [(name, k) for k, other in every if beside(other.candidate) == own]

    def _beside(
        self,
        last: str,
        others: Mapping[str, int],
        static: int,
        held: Held = (),
        more: Iterable[str] = (),
        refused: Set[Pick] = NO_PICKS,
        hopeless: float = np.inf,
    ) -> Fit:
        """The best candidate of ``last`` beside ``others``, then of ``more`` and of the others
        beside it, but for those ``held``; none that is ``refused``. Once only where it costs more
        than is ``hopeless``."""
        picks, made = {**others, **dict(held)}, []
        names = (last, *sorted({*others, *more} - {last, *dict(held)}))
        for _ in range(PASSES):
            before = dict(picks)
            for name in names:
                rest = [(n, k) for n, k in picks.items() if n != name]
                picks[name] = self._choose(rest, static, name, refused)
                if len(picks) == len(names) + len(held):
                    made.append(self._fit(tuple(sorted(picks.items())), static))
            if picks == before or min(map(self.price, made)) > hopeless:
                break
        return min(made, key=self.price)

    def _cancelling(self, fit: Fit) -> list[str]:
        """Effects whose weights ought to have one sign, and cancel."""
        return [
            pick[0]
            for pick, weights in self.weighted(fit)
            if self.entries[pick[0]][pick[1]].candidate.parallel
            and float(np.abs(weights).sum()) > CANCELLING * abs(float(weights.sum()))
        ]

    def _beyond(self, fit: Fit) -> list[str]:
        """Effects whose weights are larger than physics has them, or of the other sign; or that say
        far more than there is, which a walk takes back."""
        result, walking = [], (WALK, 0) in fit.picks
        for pick, weights in self.weighted(fit):
            candidate = self.entries[pick[0]][pick[1]].candidate
            if candidate.levels is not None:
                weights = candidate.levels(weights)
                if len(fit.picks) > 1:
                    # Beside what bends it the other way it may be straight as well.
                    weights = bent(weights)
            sizes = np.abs(weights)
            alone = float(sizes.max()) > ALONE * float(sizes.sum())
            most = min(candidate.largest, candidate.alone if alone else np.inf)
            below = candidate.positive and float(weights.min()) < 0.0
            below |= candidate.opposed and float(weights[:-1].sum() * weights[-1]) > 0.0
            quick = float(weights[: candidate.quick].sum()) > candidate.alone
            far = False
            if np.isfinite(candidate.farthest) or walking:
                said = self.entries[pick[0]][pick[1]].said(weights)
                far = float(np.ptp(said)) > 2.0 * candidate.farthest
                far |= walking and float(said.std()) > CANCELLED * self._size
            if below or quick or far or float(sizes.max()) > most:
                result.append(pick[0])
        return result

    def _choose(
        self,
        picks: Sequence[Pick],
        static: int,
        name: str,
        refused: Set[Pick] = NO_PICKS,
    ) -> int:
        """The candidate of an effect that fits best beside ``picks``, of those not ``refused``."""
        if name == WALK:
            return 0
        worth = self.worth(picks, static, name)
        best = int(np.argmax(worth))
        if (name, best) in refused:
            left = worth.copy()
            # Those tried since are not among them.
            left[[k for n, k in refused if n == name and k < len(left)]] = -np.inf
            best = int(np.argmax(left))
        return best

    def worth(self, picks: Sequence[Pick], static: int, name: str) -> Floats:
        """(candidates,) of an effect: what each gains beside ``picks``, less what it costs."""
        return self._worth_and_left(picks, static, name)[0]

    def left_by_each(self, picks: Sequence[Pick], static: int, name: str) -> Floats:
        """(candidates,) of an effect: squares per sample, in noise variances, that each leaves
        beside ``picks``, on time that is seen, and what its parameters cost."""
        return self._worth_and_left(picks, static, name)[1]

    def _worth_and_left(
        self, picks: Sequence[Pick], static: int, name: str
    ) -> tuple[Floats, Floats]:
        key = tuple(sorted(picks)), static, name
        if key not in self._worths:
            self._worths[key] = self._worth_beside(*key)
        return self._worths[key]

    def _worth_beside(self, picks: Sequence[Pick], static: int, name: str) -> tuple[Floats, Floats]:
        group = self.groups[name]
        gained, error = self._design(picks).gains(self._terms(picks), static, name)
        gains: Floats = gained / self.sigma**2
        all_left: Floats = error / self.sigma**2 - gains
        share: Floats = np.full(len(gains), CURVED_SHARE * self.excess)
        if (WALK, 0) not in picks:
            beyond = np.maximum(all_left - self.design.chosen_by, 0.0)
            share = np.minimum(share, SHARE_OF_LEFT * beyond)
        costs = self.weight_price * group.free_widths
        costs = costs + group.curved * (CURVED_PRICE * self.samples + share)
        # Beside an offset, one more of its own says nothing.
        costs = costs + np.where(
            group.shifting, np.inf if static else SHIFTING_PRICE * self.samples, 0.0
        )
        left = all_left / self.design.chosen_by + PARAMETER_PRICE * self.guard * group.further
        return gains - costs, left

    def within(self, names: frozenset[str], held: Held = ()) -> Fit:
        """The cheapest fit with the candidates ``held`` and any of the effects ``names``, or none
        besides."""
        if (names, held) not in self._within:
            fits = [self.best(names, held)]
            fits += [self.within(names - {name}, held) for name in sorted(names)]
            self._within[names, held] = min(fits, key=self.price)
        return self._within[names, held]

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

    def predicted(self, fit: Fit) -> Floats:
        """(samples,) what a fit adds to the channel's nominal codes."""
        total = np.zeros(len(self.residual))
        for pick, weights in self.weighted(fit):
            total += self.columns(pick) @ weights
        if fit.static is not None:
            total += fit.static[0] if len(fit.static) == 1 else self.static @ fit.static
        return total

    def weighted(self, fit: Fit) -> list[tuple[Pick, Floats]]:
        """Every pick of a fit with its weights (1 where physics fixes it)."""
        result: list[tuple[Pick, Floats]] = []
        used = 0
        for pick in fit.picks:
            if pick[0] == WALK:
                continue
            entry = self.entries[pick[0]][pick[1]]
            fixed = entry.candidate.fixed
            width = entry.width if not fixed or len(fit.picks) > 1 else 0
            weights = fit.weights[used : used + width]
            if fixed:
                weights = weights + 1.0 if width else np.ones(1)
            used += width
            result.append((pick, weights))
        return result


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


def beside_walk(effects: int) -> float:
    """What a walk and so many effects cost, in prices of one: of a first effect beside a walk only
    its fast part shows, which is small."""
    return 1.0 + BESIDE_WALK * min(effects, 1) + max(effects - 1, 0)


def offered(
    nominal: Nominal, name: str, near: Mapping[str, float] | None, place: str
) -> list[Candidate]:
    """What the effect ``name`` explains in a place, or its zoom around ``near``; also beside a
    simulator that was calibrated with it there."""
    effect = all_effects()[name]
    nominal = nominal.felt(effect.stage)
    if place:
        there, slope = nominal.at(place)
        made = offered(there, name, near, "")
        return [candidate.through(slope, nominal.keep, place) for candidate in made]
    if near is None:
        made = effect.explain(nominal) if effect.explain else []
    elif EXACTLY in near:
        assert effect.fine is not None, name
        return effect.fine.at(nominal, {k: v for k, v in near.items() if k != EXACTLY})
    else:
        assert effect.zoom is not None, name
        made = effect.zoom(nominal, near)
    if not effect.lasting:
        return made
    less = nominal.calibration()
    calibrated = [candidate.calibrated(less) for candidate in made if not candidate.curved]
    if near is None:
        return made + calibrated
    return calibrated if CALIBRATED in near else made


def explained(
    nominal: Nominal, name: str, number: int, near: Mapping[str, float] | None, place: str
) -> Candidate:
    """One candidate of the effect ``name``: of what it explains, or of its zoom around ``near``."""
    return offered(nominal, name, near, place)[number]


def bent(weights: Floats) -> Floats:
    """``weights`` at even steps less their straight line."""
    at = np.linspace(-1.0, 1.0, len(weights))
    centred = weights - weights.mean()
    line: Floats = centred - at * float(at @ centred) / float(at @ at)
    return line
