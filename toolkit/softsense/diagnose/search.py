"""Which effects: the cheapest of all models of one, two and three effects on any channels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from softsense.diagnose.channel import (
    LESS_LEFT,
    MOTION,
    SHARE_OF_LEFT,
    WALK,
    Channel,
    all_at_once,
    beside_walk,
)
from softsense.diagnose.design import Entry, Fit
from softsense.effects import all_effects

Names = frozenset[str]
# Pairs begin with the most promising single effects, triples with the best pairs.
BEAM = 5
SHORT_BEAM = 2
ZOOMED = 6
ZOOMED_OF_LONG = 1
COMPOSED = 8
COMPOSED_WALKS = 3
# Pairs and triples whose candidates are chosen again, each form in its turn.
CHOSEN_AGAIN = 4
# Single effects that are looked at once more, as those of pairs are.
REFINED = 4
# So many of each at first, and the rest where these then leave less than so much of what they did,
# or what is left would still pay for so many effects on every channel.
AT_FIRST = 2
TOLD_MORE = 0.9
UNTOLD = 4.0
# A random walk, of the largest gap of a channel that it is named on.
WALK_NAME_SHARE = 0.01
# What a walk can do by chance.
SLOW = frozenset({"drift", "step"})
SLOW_PRICE = 0.5
# How many times as much an explanation without a walk must leave.
WALK_LEAVES = 3.0
# Naming one effect more, in noise variances of one channel and as a share of the gap: of the whole,
# and for further effects of the channels that they are named on.
NAME_PRICE = 0.25
NAME_SHARE = 0.002
# A third one, and each further: what two equations leave that are both only nearly right.
THIRD_PRICE = 0.5
# An effect of the motion that is not named on all channels.
PARTIAL_PRICE = 0.1
# The same of the second and third where all are exact.
EXACT_NAME_SHARE = 0.001
# The same of the second and third where all are named on the same channels, and not on every one:
# there lies what an equation leaves that is only nearly right, and seldom another effect.
SAME_CHANNELS_SHARE = 0.004


@dataclass(frozen=True)
class Model:
    """Effects, the fit of every channel with the cheapest of them, and the whole price."""

    names: Names
    fits: tuple[Fit, ...]
    price: float

    def channels_of(self, name: str) -> tuple[int, ...]:
        """Channels on which the effect ``name`` pays."""
        return tuple(c for c, fit in enumerate(self.fits) if name in dict(fit.picks))


def model(channels: Sequence[Channel], names: Names) -> Model:
    """The cheapest fits with any of the effects ``names``."""
    return leaner(channels, priced(channels, tuple(channel.within(names) for channel in channels)))


def leaner(channels: Sequence[Channel], made: Model) -> Model:
    """``made``, or what is cheaper without some of its effects on channels that have others too,
    where they say less than it costs to name them there."""
    for number, (channel, fit) in enumerate(zip(channels, made.fits, strict=True)):
        own = frozenset(name for name, _ in fit.picks)
        for name in sorted(own) if len(own) > 1 and WALK not in made.names else ():
            fewer = channel.within(own - {name})
            saved = len(made.names) * NAME_SHARE * channel.excess
            if channel.price(fewer) < channel.price(fit) + saved:
                fits = (*made.fits[:number], fewer, *made.fits[number + 1 :])
                other = priced(channels, fits)
                if other.names == made.names and other.price < made.price:
                    made = other
    return made


def priced(channels: Sequence[Channel], fits: tuple[Fit, ...]) -> Model:
    """The model of these fits, one of each channel."""
    names = frozenset(name for fit in fits for name, _ in fit.picks)
    price = sum(channel.price(fit) for channel, fit in zip(channels, fits, strict=True))
    each = NAME_PRICE * channels[0].samples
    gap = sum(channel.excess for channel in channels)
    # A clock, or play in the drive, is the same for all channels.
    price += PARTIAL_PRICE * channels[0].samples * sum(_partial(fits, name) for name in names)
    price += THIRD_PRICE * channels[0].samples * max(len(names) - 2, 0)
    if _on_the_same(fits, names):
        left = sum(channel.left(fit) for channel, fit in zip(channels, fits, strict=True))
        share = min(SAME_CHANNELS_SHARE * gap, SHARE_OF_LEFT * max(left, 0.0))
        price += share * (len(names) - 1)
    if WALK in names:
        # How large an effect is, is not seen beside a walk, unless it is slow.
        price += each * beside_walk(len(names) - 1)
        slow = sum(_by_chance(channels, fits, name) for name in names & SLOW)
        price += (SLOW_PRICE * channels[0].samples + NAME_SHARE * gap) * slow
        walking = [
            c.excess for c, fit in zip(channels, fits, strict=True) if (WALK, 0) in fit.picks
        ]
        # Two equations, each only nearly right, leave more than one for a walk to follow.
        price += WALK_NAME_SHARE * max(len(names) - 1, 1) ** 2 * max(walking)
        return Model(names, fits, price)
    exact = all(channel.exact(fit) for channel, fit in zip(channels, fits, strict=True))
    more = EXACT_NAME_SHARE if exact else NAME_SHARE
    # What an equation that is only nearly right leaves is a share of the gap where it leaves it.
    there = sorted(_gap_of(channels, fits, name) for name in names)
    shares = NAME_SHARE * gap + more * sum(there[:-1]) if names else 0.0
    costs = [
        each
        * max(c.guard for c, fit in zip(channels, fits, strict=True) if name in dict(fit.picks))
        for name in names
    ]
    return Model(names, fits, price + sum(costs) + shares)


def _by_chance(channels: Sequence[Channel], fits: Sequence[Fit], name: str) -> bool:
    """Whether something slow may be a part of a walk: not where it alone says all that there is."""
    return any(
        len(fit.picks) > 1 or channel.left(fit) > channel.effect_price
        for channel, fit in zip(channels, fits, strict=True)
        if name in dict(fit.picks)
    )


def _gap_of(channels: Sequence[Channel], fits: Sequence[Fit], name: str) -> float:
    """The gap of the channels on which an effect is named."""
    return sum(c.excess for c, fit in zip(channels, fits, strict=True) if name in dict(fit.picks))


def _partial(fits: Sequence[Fit], name: str) -> bool:
    """Whether a motion effect is named on some channels only."""
    return (
        name != WALK
        and all_effects()[name].stage == MOTION
        and not all(name in dict(fit.picks) for fit in fits)
    )


def _on_the_same(fits: Sequence[Fit], names: Names) -> bool:
    """Whether several effects are named on the same channels, and not on every one."""
    named = [{name for name, _ in fit.picks} for fit in fits if fit.picks]
    return len(names) > 1 and len(named) < len(fits) and all(each == names for each in named)


def search(channels: Sequence[Channel], known: Sequence[str]) -> list[Model]:
    """Models by price, cheapest first: none, every single effect, and what builds on the best.

    The grids are looked at coarsely first, then closely where a fit has chosen a point.
    """
    coarse = _models(channels, known)
    if not coarse[0].names:
        return coarse
    most = ZOOMED_OF_LONG if channels[0].long else ZOOMED
    together = [made for made in coarse if len(made.names) == 2][:most]
    together += [made for made in coarse if len(made.names) == 3][:most]
    together = _may_pay(channels, together, coarse[0].price)
    beside = {name for made in together for name in made.names}
    near = [made for made in coarse if len(made.names) == 1] + together

    # What does not pay on the coarse grid may pay on the fine one.
    chosen = [
        {pick for m in near for fit in (m.fits[c], channels[c].best(m.names)) for pick in fit.picks}
        for c in range(len(channels))
    ]
    # What happened at one time on most channels is looked for there on all.
    votes = Counter(pick for picks in chosen for pick in picks if pick[0] == "step")
    common = {pick for pick, count in votes.most_common(1)}

    numbers = sorted(range(len(channels)), key=lambda c: -channels[c].excess)
    moved: dict[str, Entry] = {}

    def zoom(number: int) -> None:
        channels[number].zoom(chosen[number] | common, beside, moved)

    if channels[0].long:
        # The strain is the same on all channels: where the gap is largest says how it moved.
        zoom(numbers[0])
        moved = channels[numbers.pop(0)].moved_alone()
    all_at_once(zoom, numbers)
    fine = _chosen_again(channels, _models(channels, known))
    # A walk follows what a composition would say.
    kinds = [[m for m in fine if len(m.names) > 1 and WALK not in m.names][:COMPOSED]]
    kinds.append([m for m in fine if len(m.names) > 1 and WALK in m.names][:COMPOSED_WALKS])
    kinds.append([m for m in fine if len(m.names) == 1 and WALK not in m.names][:REFINED])
    several = [made for kind in kinds for made in kind[:AT_FIRST]]
    later = [made for kind in kinds for made in kind[AT_FIRST:]]
    moving = frozenset(name for name in known if all_effects()[name].stage == MOTION)
    if fine[0].names & moving and moving not in [made.names for made in several]:
        # Side by side, these say little of what they do in series.
        several.append(replace(model(channels, moving), names=moving))
    if channels[0].long:
        several, later = [made for made in fine[:1] if len(made.names) > 1], []
    done = _composed(channels, several, fine[0].price)
    told = any(_left(channels, b) < TOLD_MORE * _left(channels, a) for a, b in done)
    best = by_price([fine[0], *(after for _, after in done)])[0]
    if told or _left(channels, best) > UNTOLD * sum(channel.effect_price for channel in channels):
        done += _composed(channels, later, fine[0].price)
    untouched = [made for made in fine if made not in [before for before, _ in done]]
    return _walk_last(channels, by_price([*untouched, *(after for _, after in done)]))


def _chosen_again(channels: Sequence[Channel], models: list[Model]) -> list[Model]:
    """``models`` by price, the most promising of several effects with candidates chosen again."""
    named = [made for made in models if WALK not in made.names]
    several = [made for made in named if len(made.names) == 2][:CHOSEN_AGAIN]
    several += [made for made in named if len(made.names) == 3][:SHORT_BEAM]
    several = _may_pay(channels, several, models[0].price)

    def again(number: int) -> list[Fit]:
        return [channels[number].chosen_again(made.fits[number]) for made in several]

    by_channel = all_at_once(again, range(len(channels)))
    better = [leaner(channels, priced(channels, fits)) for fits in zip(*by_channel, strict=True)]
    return by_price([*models, *better])


def _walk_last(channels: Sequence[Channel], models: list[Model]) -> list[Model]:
    """A walk follows whatever is slow: beside an effect only where all else leaves far more."""
    without = next(made for made in models if WALK not in made.names)
    beside = WALK in models[0].names and len(models[0].names) > 1
    if beside and _left(channels, without) < WALK_LEAVES * _left(channels, models[0]):
        return [made for made in models if WALK not in made.names or len(made.names) == 1]
    return models


def _left(channels: Sequence[Channel], made: Model) -> float:
    return sum(c.left(fit) for c, fit in zip(channels, made.fits, strict=True))


def _may_pay(channels: Sequence[Channel], several: Sequence[Model], price: float) -> list[Model]:
    """Those of ``several`` that would cost less than ``price`` if they left just the noise."""
    return [made for made in several if _least(channels, len(made.names)) < price]


def _least(channels: Sequence[Channel], count: int) -> float:
    """What so many effects cost at least, where they leave just the noise."""
    price = count * NAME_PRICE * channels[0].samples * min(c.guard for c in channels)
    for channel in channels:
        price += channel.samples * (channel.noise / channel.sigma**2 - LESS_LEFT)
        price += NAME_SHARE * channel.excess
        if channel.excess > channel.effect_price:
            price += channel.effect_price
    return price


def _composed(
    channels: Sequence[Channel], several: Sequence[Model], price: float
) -> list[tuple[Model, Model]]:
    """Those of ``several`` that may come below ``price`` where every stage acts on what the stages
    before have done, and what they become."""
    several = _may_pay(channels, several, price)

    def compose(number: int) -> list[Fit]:
        return [channels[number].composed(made.fits[number], made.names) for made in several]

    by_channel = all_at_once(compose, range(len(channels)))
    made = [list(fits) for fits in zip(*by_channel, strict=True)]
    # The strain is the same on all channels: where one says it well, others begin there.
    moved = [_moved(channels, fits) for fits in made]

    def together(number: int) -> list[Fit]:
        channel, result = channels[number], []
        for known, fits, before in zip(moved, made, several, strict=True):
            fit = fits[number]
            if known and channel.left(fit) > channel.effect_price:
                fit = channel.composed_with(fit, before.names, known)
            result.append(fit)
        return result

    if any(moved):
        made = [
            list(fits) for fits in zip(*all_at_once(together, range(len(channels))), strict=True)
        ]
    after = (leaner(channels, priced(channels, tuple(fits))) for fits in made)
    return list(zip(several, after, strict=True))


def _moved(channels: Sequence[Channel], fits: Sequence[Fit]) -> dict[str, Entry]:
    """What the largest gap that ``fits`` explain says of the motion."""
    well = [
        (channel.excess, channel.motion_of(fit))
        for channel, fit in zip(channels, fits, strict=True)
        if channel.left(fit) < channel.effect_price
    ]
    said = [(excess, motion) for excess, motion in well if motion]
    return max(said, key=lambda one: one[0])[1] if said else {}


def _models(channels: Sequence[Channel], known: Sequence[str]) -> list[Model]:
    names = sorted(known)
    none, *singles = _made(channels, [frozenset(), *(frozenset({name}) for name in names)])
    singles = by_price(singles)
    twos = [
        frozenset(two)
        for two in combinations(names, 2)
        if any(first.names <= set(two) for first in singles[:BEAM])
    ]
    pairs = _promising(channels, twos, [none, *singles])
    triples: list[Model] = []
    if pairs and pairs[0].price < min(none.price, singles[0].price):
        threes = [
            first.names | {name}
            for first in pairs[:SHORT_BEAM]
            for name in names
            if name not in first.names
        ]
        triples = _promising(channels, threes, pairs)
    return by_price([none, *singles, *pairs, *triples])


def _made(channels: Sequence[Channel], several: Sequence[Names]) -> list[Model]:
    """The models of ``several``, channel by channel on all cores."""
    all_at_once(lambda channel: [channel.within(names) for names in several], channels)
    return [model(channels, names) for names in several]


def _promising(
    channels: Sequence[Channel], several: Sequence[Names], known: Sequence[Model]
) -> list[Model]:
    """The models of ``several`` by price, without those with a walk that cannot be the cheapest.

    What effects do beside a walk is much to compute, and where they say the gap nobody asks.
    """
    made = _made(channels, [names for names in several if WALK not in names])
    best = by_price([*known, *made])[0]
    # Of as many effects, one that is nearly as cheap is told as a rival.
    near = best.price + max(_left(channels, best), 0.0)
    walking = [
        names
        for names in several
        if WALK in names
        and _least_with_walk(channels, names)
        < (near if len(names) <= len(best.names) else best.price)
    ]
    return by_price([*made, *_made(channels, walking)])


def _least_with_walk(channels: Sequence[Channel], names: Names) -> float:
    """What ``names`` with a walk on any channel would cost, if the walk left just the noise."""
    walks = [channel.least_with_walk for channel in channels]
    least = [
        min(channel.price(channel.within(names - {WALK})), walk)
        for channel, walk in zip(channels, walks, strict=True)
    ]
    first = min(
        walk + WALK_NAME_SHARE * channel.excess - price
        for channel, walk, price in zip(channels, walks, least, strict=True)
    )
    return sum(least) + first + NAME_PRICE * channels[0].samples * beside_walk(len(names) - 1)


def by_price(models: Iterable[Model]) -> list[Model]:
    """``models``, the cheapest first; of those with the same names, the cheapest."""
    # An effect that pays nowhere has left the names; of equals one is enough.
    best: dict[Names, Model] = {}
    for made in models:
        if made.names not in best or made.price < best[made.names].price:
            best[made.names] = made
    return sorted(best.values(), key=lambda made: made.price)
