"""One channel of a comparison: its residual, what effects could leave in it, and what fits cost."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import (
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
from softsense.diagnose.nominal import KEPT_USUALLY, beside_average, slow_over
from softsense.diagnose.walk import innovations, likely_gain
from softsense.effects import CALIBRATED, EXACTLY, Candidate, Effect, Nominal, all_effects, altered

Floats = NDArray[np.float64]
Names = frozenset[str]
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
# A random walk follows all that is slow: it must be far better than what says why.
WALK = "random_walk"
WALK_PRICE = 0.5
WALK_SHARE = 0.005
BESIDE_WALK = 0.1
# Of so many candidates what is near them is kept meanwhile.
KEPT = 4
# Stages whose effects act on each other: one circuit follows the other, and a clock that is late
# has seen the play before it. Play and delay may change places; circuits may not.
MOTION = "motion"
MATERIAL = "material"
ELECTRICAL = "electrical"
SERIAL = frozenset({MOTION, ELECTRICAL})
# A clock, and a circuit: what the one does is nearly what the other does.
DELAY = "delay"
LAG = "lag"
# A rail: what others do says where it begins.
RAIL = "saturation"
RAILS = frozenset({RAIL})
# Longer recordings are thinned for the search, after their filters have run at the full rate.
SEARCHED = 16_000
# So many times longer ones are looked at less closely: at the full rate each filter takes its time.
# Fewer of their samples are searched.
LONG = 10
SEARCHED_OF_LONG = 10_000
# Columns are compared that are the same in so many samples.
GLANCED = 100
# The columns of a candidate that an entry has laid out.
NOTHING: Floats = np.zeros((0, 0))


class Priced:
    """The candidates of one channel, fits of them, which are kept, and their prices."""

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
        simulated = min(own / (1.0 - kept if strained else beside_average(kept)), sigma**2)
        # The slow part of that noise is still in the nominal signal, and what of its motion nobody
        # could tell is not.
        self.noise = sigma**2 + kept * simulated + missed
        # What an average of fewer samples keeps of it besides is no gap, per noise variance.
        self.more = 0.0 if strained else (kept - min(kept, KEPT_USUALLY)) * simulated / sigma**2
        self.long = len(residual) > LONG * SEARCHED
        most = SEARCHED_OF_LONG if self.long else SEARCHED
        self._thin = slice(None, None, -(-len(residual) // most))
        self._together = slow_over(nominal.strain[self._thin])
        squares = float(np.sum(residual[self._thin] ** 2)) / sigma**2
        self._size = float(np.sqrt(np.mean(residual[self._thin] ** 2)))
        self.samples = len(residual[self._thin])
        # Squares of the residual beyond the noise, over its variance; with what fast moves keep.
        usual = self.samples * (self.noise / sigma**2 if strained else 1.0 + self.more)
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

    def thinned(self, nominal: Nominal) -> Nominal:
        """``nominal`` with only the samples that the search looks at kept."""
        return replace(nominal, keep=self._thin)

    def searched(self, values: Floats) -> Floats:
        """Of ``values`` (samples, …) or (searched samples, …) those that the search looks at."""
        return values[self._thin] if len(values) == len(self.residual) else values

    def _searched(self, candidate: Candidate) -> Floats:
        """(searched samples, p) the columns of a candidate."""
        return self.searched(candidate.columns)

    def _asked(self, effect: Effect, nominal: Nominal) -> Nominal:
        """``nominal`` for traces of the samples that the search looks at."""
        # Before samples are left out: the largest strain so far is one of all.
        asked = self.thinned(nominal.felt(effect.stage))
        return asked.kept() if effect.memoryless else asked

    def _entry(
        self, candidate: Candidate, number: int, near: Mapping[str, float] | None, place: str
    ) -> Entry:
        columns = self._searched(candidate).astype(np.float32, order="F")
        return Entry((), altered(candidate, made=NOTHING), columns, number, near, place)

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

    def _again(self, nominal: Nominal, name: str, entry: Entry) -> Entry:
        """A candidate of another nominal signal."""
        asked = self._asked(all_effects()[name], nominal)
        source = entry.number, entry.near, entry.place
        return self._entry(explained(asked, name, *source), *source)

    def _upon(self, nominal: Nominal, name: str, number: int) -> list[Entry]:
        """A candidate and what is close to it, of a changed nominal signal."""
        entry = self.entries[name][number]
        made = [self._again(nominal, name, entry), *self._elsewhere(nominal, name, [entry])]
        near = None if all_effects()[name].zoom is None else dict(entry.candidate.values)
        made += self._offered(nominal, name, near, entry.place)
        return [altered(other, nominal=nominal) for other in made]

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
        self._numbers: dict[str, dict[Key, int]] = {}
        self._beside_curves: dict[Hashable, tuple[float, float]] = {}

    def numbers(self, name: str) -> dict[Key, int]:
        """Where the candidates of an effect stand, by what makes them."""
        if name not in self._numbers:
            self._numbers[name] = {
                entry.key: k for k, entry in enumerate(self.entries[name]) if entry.at
            }
        return self._numbers[name]

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

    def predicted(self, fit: Fit) -> Floats:
        """(samples,) what a fit adds to the channel's nominal codes."""
        total = np.zeros(len(self.residual))
        for pick, weights in self.weighted(fit):
            total += self.columns(pick) @ weights
        if fit.static is not None:
            total += fit.static[0] if len(fit.static) == 1 else self.static @ fit.static
        return total

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

    def left(self, fit: Fit) -> float:
        """Error on unseen time over the noise variance, beyond the noise itself."""
        left = float(fit.errors.sum()) / self.sigma**2 - (1.0 + self.more) * self.samples
        if (WALK, 0) in fit.picks:
            # The likelihood of its innovations, whose variance is larger than the noise's.
            left -= self.samples * float(np.log1p(-self.gain))
            # A curve of what was read says of the noise what the noise itself has moved.
            left = max(left, 0.0)
        return left

    def unsaid(self, fit: Fit) -> float:
        """What is ``left`` beyond what of the simulation's noise is in the nominal signal."""
        known = self.noise / self.sigma**2 - 1.0 - self.more
        return max(self.left(fit) - known * self.samples, 0.0)

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
