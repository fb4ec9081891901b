"""Which candidates fit a channel best, of one effect or of several side by side."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence, Set
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.design import Entry, Fit, Pick
from softsense.diagnose.pricing import MOTION, RAILS, SECOND_PRICE, WALK, Names, Priced, offered
from softsense.diagnose.walk import likely_gain
from softsense.effects import Candidate, all_effects

Floats = NDArray[np.float64]
NO_PICKS: Set[Pick] = frozenset()
# Per sample: what more effects may leave less than noise, or than fewer, by chance.
LESS_LEFT = 0.02
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
# What two effects leave that are chosen at once, of what they do one after the other.
FAR_LESS = 0.7
# What leaves so many times what others do.
HOPELESS = 4.0
# What an effect alone says of what no effect says, or of what the best one leaves, to be looked at
# more closely for itself.
SAYS = 0.12
SAYS_OF_LONG = 0.25
# What moves the strain, which all channels have in common.
Held = tuple[Pick, ...]


class Chosen(Priced):
    """The best fits of one channel; they are made when they are asked for, and kept."""

    def _take(self, found: Mapping[str, Sequence[Entry]]) -> None:
        super()._take(found)
        self._best: dict[tuple[frozenset[str], Held], Fit] = {}
        self._by_fewer: dict[int, bool] = {}
        self._within: dict[tuple[frozenset[str], Held], Fit] = {}
        self._elsewhere_said: dict[str, int] = {}
        self._stood: dict[Names, Fit] = {}

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

    def _better_gain(self) -> float:
        """The gain of a walk (``gain_of``) beside what the best model with one says."""
        walks = [fit for (names, _), fit in self._best.items() if WALK in names]
        if not walks:
            return self.gain
        best = min(walks, key=self.price)
        left = self.residual[self._thin].copy()
        for (name, number), weights in self.weighted(best):
            left -= self.entries[name][number].said(weights)
        return likely_gain(self.wandering(left), self.sigma)

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
        if len(names) == 2 and not held and WALK not in names:
            made += self._both_at_once(names, min(map(self.left, made)))
        if names in self._stood and not held:
            stood = self._stood[names]
            static = stood.static_columns
            for last in sorted(names):
                rest = {name: number for name, number in stood.picks if name != last}
                made.append(self._beside(last, rest, static, hopeless=hopeless))
        return min(made, key=self.price)

    def _both_at_once(self, names: Names, left: float) -> list[Fit]:
        """What begins with those candidates of two effects that say most together, of one column
        each, if that is far more than fits that leave so much, which chose one of them first."""
        first, second = sorted(names)
        one, gained = self.design.best_beside(first, second)
        rest = (float(self.design.squares.sum()) - gained) / self.sigma**2 - self.samples
        return [self._beside(second, {first: one}, 0)] if rest < FAR_LESS * left else []

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

    def within(self, names: frozenset[str], held: Held = ()) -> Fit:
        """The cheapest fit with the candidates ``held`` and any of the effects ``names``, or none
        besides."""
        if (names, held) not in self._within:
            fits = [self.best(names, held)]
            fits += [self.within(names - {name}, held) for name in sorted(names)]
            self._within[names, held] = min(fits, key=self.price)
        return self._within[names, held]

    def held(self, fit: Fit) -> Held:
        """The picks of a fit that change the strain itself."""
        return tuple(
            pick for pick in fit.picks if pick[0] != WALK and all_effects()[pick[0]].stage == MOTION
        )

    def motion_of(self, fit: Fit) -> dict[str, Entry]:
        """The candidates of a fit that change the strain itself."""
        return {name: self.entries[name][number] for name, number in self.held(fit)}

    def moved_alone(self) -> dict[str, Entry]:
        """The effect of the motion that says most alone, and its best candidate."""
        motions = [name for name in self.entries if all_effects()[name].stage == MOTION]
        fits = [self.best(frozenset({name})) for name in motions]
        return self.motion_of(min(fits, key=self.price)) if fits else {}
