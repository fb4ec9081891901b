"""Which effects: the cheapest of all models of one, two and three effects on any channels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import combinations

import numpy as np

from softsense.diagnose import moved
from softsense.diagnose.channel import CURVE, Channel, on_each_other
from softsense.diagnose.chosen import HOPELESS, LESS_LEFT
from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import Entry, Fit, Key
from softsense.diagnose.pricing import (
    DELAY,
    LAG,
    MOTION,
    RAILS,
    SERIAL,
    SHARE_OF_LEFT,
    WALK,
    Names,
    beside_walk,
)
from softsense.effects import all_effects
from softsense.effects.delay import SCAN

# Pairs begin with the most promising single effects, those that cost no more than so many times the
# cheapest, and fewer at a close look, for which so many pairs are chosen, and so many without a
# walk; triples, which are only looked at closely, begin with the best pairs.
BEAM = 8
LIKELY = 8.0
PROMISING = 3.0
SHORT_BEAM = 2
ZOOMED = 6
ZOOMED_NAMED = 3
ZOOMED_OF_LONG = 1
COMPOSED = 8
COMPOSED_WALKS = 3
# Pairs and triples whose candidates are chosen again, each form in its turn.
CHOSEN_AGAIN = 4
# Single effects that are looked at once more, as those of pairs are.
REFINED = 4
# How often candidates of the motion are chosen beside others, around how many they are looked at
# closely, and how often they are fitted, while that gains so many noise variances of one channel.
CHOSEN_ROUNDS = 3
CLOSELY = 2
FITTED_ROUNDS = 2
LEAST_FITTED = 0.02
# The same of what a fit that is not quite there may leave to parameters besides.
LEAST_MORE = 0.5
# How many kinds of parameters a motion may have, the last of which is free to go anywhere: where so
# much is left, in noise variances of one channel, and no more than this share of the gap.
STAGES = 4
LEAST_FREE = 1.5
MOST_FREE = 0.3
DELAY_S = "delay_s"
# A motion is taken as known that leaves less of the gap, or less of it on one channel; and so many
# others are tried upon it, where the best model has it too or leaves more than ``POORLY``, or it
# leaves less than ``LITTLE_ALONE``. It is not looked at closely where it leaves more than ``MOVES``
# of a gap that others say, or of a long recording ``HOPELESS`` times what they do; nor is it fitted
# freely where it leaves ``HOPELESS`` times what another motion does.
MOVES = 0.5
LITTLE_ALONE = 0.12
POORLY = 0.05
ONE_LEAVES = 0.01
UPON = 3
# So many models of a motion beside another effect are tried with the motion of the best one.
EXCHANGED = 6
# Where an effect alone costs no more than this share of the gap, beside being named, and that is
# such a share of the largest one, fits of other channels may begin with it too.
SAID_ALL = 0.02
MUCH = 0.05
# So many pairs that act on each other's signal are looked at closely, whatever they say alone.
NEAR = 4
# So many of each at first, and the rest where these then leave less than so much of what they did,
# or what is left would still pay for so many effects on every channel; of these only what costs no
# more than so many times the best: what effects do to each other is seldom much of what they do,
# but for a converter, which has other edges where another code is.
AT_FIRST = 2
WITHIN_AT_FIRST = 2.5
WITHIN = 1.6
WITHIN_BENT = 5.0
TOLD_MORE = 0.9
UNTOLD = 4.0
# What leaves less of the gap than this is looked at closely as if there were no walk.
SAYS_MOST = 0.15
# A random walk, of the largest gap of a channel that it is named on.
WALK_NAME_SHARE = 0.01
# What a walk can do by chance.
SLOW = frozenset({"drift", "step"})
SLOW_PRICE = 0.5
# How many times as much an explanation without a walk must leave, and how much of the gap.
WALK_LEAVES = 3.0
WALK_SAYS = 0.015
# Or so many times what the walk leaves, or what naming an effect costs: no equation that is nearly
# right leaves as much.
WALK_TELLS = 12.0
# Naming one effect more, in noise variances of one channel and as a share of the gap: of the whole,
# and for further effects of the channels that they are named on.
NAME_PRICE = 0.25
NAME_SHARE = 0.002
# A third one, and each further: what two equations leave that are both only nearly right.
THIRD_PRICE = 1.0
# Each effect more on a channel must leave far less there than fewer do, not just less: so much of
# what it leaves counts again, once effects act on what the others have done.
LEFT_AGAIN = 0.5
# A converter's curve that is nowhere more than a straight line.
STRAIGHT_PRICE = 0.5
# What says nearly all that is slow, with many weights: it must leave clearly less than others do.
BROAD_PRICE = 0.45
# An effect of the motion that is not named on all channels that have a gap.
PARTIAL_PRICE = 0.5
# A channel without a gap should have one of so many times what is needed to name an effect.
UNMOVED = 4.0
# The same of the second and third where all are exact.
EXACT_NAME_SHARE = 0.001
# The same of the second and third where all are named on the same channels, and not on every one:
# there lies what an equation leaves that is only nearly right, and seldom another effect.
SAME_CHANNELS_SHARE = 0.004
# An effect more that leaves nothing less must cost far less.
COSTS_MORE = 1.05
# A scale, or a curve of codes, that is named only where others are must be worth more than this
# share of the gap there, where more is left than so many noise variances per sample: it is what
# their equations leave.
SCALES = frozenset({"adc_nonlinearity", "crosstalk", "gain"})
LITTLE = 0.006
RIGHT = 0.2
ALIKE = SCALES | RAILS


@dataclass(frozen=True, eq=False)  # one that is made again is another one
class Model:
    """Effects, the fit of every channel with the cheapest of them, and the whole price."""

    names: Names
    fits: tuple[Fit, ...]
    price: float

    def channels_of(self, name: str) -> tuple[int, ...]:
        """Channels on which the effect ``name`` pays."""
        return tuple(c for c, fit in enumerate(self.fits) if name in dict(fit.picks))


def model(channels: Sequence[Channel], names: Names) -> Model:
    """The cheapest fits with any of the effects ``names``; what moves the strain is the same
    wherever it is named."""
    if names & moving():
        return _moved(channels, names)
    return leaner(channels, priced(channels, tuple(channel.within(names) for channel in channels)))


@cache
def moving() -> Names:
    """Effects of the motion."""
    return frozenset(name for name, effect in all_effects().items() if effect.stage == MOTION)


def _moved(channels: Sequence[Channel], names: Names) -> Model:
    """The cheapest model with any of ``names``, some of which move the strain: their candidates are
    chosen before the others on each channel, or beside those, until they stay."""
    motion, rest = sorted(names & moving()), names - moving()
    made = []
    for begin in dict.fromkeys((frozenset[str](), rest)):
        held: dict[str, Key] = {}
        fits = [channel.best(begin) for channel in channels]
        for _ in range(CHOSEN_ROUNDS):
            before = dict(held)
            for name in motion:
                key = moved.chosen(channels, fits, held, name)
                if key is not None:
                    held[name] = key
            if held == before:
                break
            fits = [c.within(rest, moved.picks_of(c, held)) for c in channels]
            still = [channel.within(rest) for channel in channels]
            some = [
                min(two, key=channel.price)
                for channel, *two in zip(channels, fits, still, strict=True)
            ]
            made += [leaner(channels, priced(channels, tuple(each))) for each in (fits, some)]
    if not made:
        return model(channels, rest)
    return min(made, key=lambda one: one.price)


def leaner(channels: Sequence[Channel], made: Model, composed: bool = False) -> Model:
    """``made``, whose effects may be ``composed``, or what is cheaper without some of its effects
    on channels that have others too, where they say less than it costs to name them there."""
    for number, channel in enumerate(channels):
        own = sorted({name for name, _ in made.fits[number].picks})
        for name in own if len(own) > 1 and WALK not in made.names else ():
            fit = made.fits[number]
            # Without another one, it may be all that there is.
            if name not in dict(fit.picks) or len(fit.picks) < 2:
                continue
            fewer = channel.without(fit, name, composed)
            saved = len(made.names) * NAME_SHARE * channel.excess
            if channel.price(fewer) < channel.price(fit) + saved:
                fits = (*made.fits[:number], fewer, *made.fits[number + 1 :])
                other = priced(channels, fits)
                if other.price < made.price:
                    made = other
    return made


def priced(channels: Sequence[Channel], fits: tuple[Fit, ...]) -> Model:
    """The model of these fits, one of each channel."""
    names = frozenset(name for fit in fits for name, _ in fit.picks)
    price = sum(channel.price(fit) for channel, fit in zip(channels, fits, strict=True))
    each = NAME_PRICE * channels[0].samples
    gap = sum(channel.excess for channel in channels)
    # A clock, or play in the drive, is the same for all channels.
    partial = sum(_partial(channels, fits, name) for name in names)
    price += PARTIAL_PRICE * channels[0].samples * partial
    # A walk says all that is slow anyway.
    broad = WALK not in names and any(all_effects()[name].broad for name in names)
    price += BROAD_PRICE * channels[0].samples * broad
    price += THIRD_PRICE * channels[0].samples * max(len(names) - 2, 0)
    price += STRAIGHT_PRICE * channels[0].samples * len(_straight(channels, fits))
    if _on_the_same(fits, names):
        left = _left_by(channels, fits)
        share = min(SAME_CHANNELS_SHARE * gap, SHARE_OF_LEFT * max(left, 0.0))
        price += share * (len(names) - 1)
    if WALK in names:
        walking = [c for c, fit in zip(channels, fits, strict=True) if (WALK, 0) in fit.picks]
        guard = max(c.guard for c in walking)
        # How large an effect is, is not seen beside a walk, unless it is slow.
        price += each * guard * beside_walk(len(names) - 1)
        slow = sum(_by_chance(channels, fits, name) for name in names & SLOW)
        price += (SLOW_PRICE * guard * channels[0].samples + NAME_SHARE * gap) * slow
        # Two equations, each only nearly right, leave more than one for a walk to follow.
        most = max(c.excess for c in walking)
        price += WALK_NAME_SHARE * max(len(names) - 1, 1) ** 2 * most
        return Model(names, fits, price)
    exact = all(channel.exact(fit) for channel, fit in zip(channels, fits, strict=True))
    more = EXACT_NAME_SHARE if exact else NAME_SHARE
    # What an equation that is only nearly right leaves is a share of the gap where it leaves it.
    there = sorted(_gap_of(channels, fits, name) for name in names)
    further = more * sum(there[:-1])
    if len(names) == 2:
        # Two equations that leave nearly nothing are right, whatever the gap.
        further = min(further, max(_left_by(channels, fits), 0.0))
    shares = NAME_SHARE * gap + further if names else 0.0
    costs = [
        each
        * max(c.guard for c, fit in zip(channels, fits, strict=True) if name in dict(fit.picks))
        for name in sorted(names)
    ]
    return Model(names, fits, price + sum(costs) + shares)


def _straight(channels: Sequence[Channel], fits: Sequence[Fit]) -> set[str]:
    """Curves of a converter that are little else than straight wherever they are named."""
    idle = [set(c.idle(fit, curved=False)) for c, fit in zip(channels, fits, strict=True)]
    bent = [
        {n for n, _ in fit.picks if n != WALK and all_effects()[n].bent} - own
        for own, fit in zip(idle, fits, strict=True)
    ]
    return set[str]().union(*idle) - set[str]().union(*bent)


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


def _partial(channels: Sequence[Channel], fits: Sequence[Fit], name: str) -> bool:
    """Whether a motion effect is named on some channels only, of those that have a gap or move so
    much that they would have one."""
    if name not in moving():
        return False
    both = list(zip(channels, fits, strict=True))
    share = min(c.excess / c.pace for c, fit in both if name in dict(fit.picks))
    return not all(
        name in dict(fit.picks)
        or (not channel.entries and share * channel.pace < UNMOVED * channel.effect_price)
        for channel, fit in both
    )


def _on_the_same(fits: Sequence[Fit], names: Names) -> bool:
    """Whether several effects are named on the same channels, and not on every one."""
    named = [{name for name, _ in fit.picks} for fit in fits if fit.picks]
    return len(names) > 1 and len(named) < len(fits) and all(each == names for each in named)


def search(
    channels: Sequence[Channel], names: Sequence[str], strain: moved.Together
) -> list[Model]:
    """Models by price, cheapest first: none, every single effect, and what builds on the best.

    The grids are looked at coarsely first, then closely where a fit has chosen a point. A motion is
    fitted closely for itself where any ``strain`` could say much.
    """
    coarse = _models(channels, names, LIKELY, most=2)
    if not coarse[0].names:
        return coarse
    together = _zoomed(channels, coarse)
    beside = {name for made in together for name in made.names}
    promising = [made for made in coarse if len(made.names) == 1] + together

    # What does not pay on the coarse grid may pay on the fine one.
    stood = [
        [
            fit
            for m in promising
            for fit in (
                m.fits[c],
                channels[c].best(m.names - moving(), channels[c].held(m.fits[c])),
            )
        ]
        for c in range(len(channels))
    ]
    chosen = [{pick for fit in own for pick in fit.picks} for own in stood]
    # What happened at one time on most channels is looked for there on all, and so is the motion.
    votes = Counter(pick for picks in chosen for pick in sorted(picks) if pick[0] == "step")
    common = {pick for pick, count in votes.most_common(1)}
    fitted: list[dict[str, list[Entry]]] = [{} for _ in channels]
    gap = sum(channel.excess for channel in channels)
    # Whatever moves the strain says no more than one that is free.
    may_move = not np.isfinite(strain.left) or strain.left < MOVES * strain.gap
    for name in sorted(moving() & set(names)):
        votes = Counter(pick for picks in chosen for pick in sorted(picks) if pick[0] == name)
        common |= {pick for pick, count in votes.most_common(CLOSELY)}
        alone = moved.chosen(channels, [c.best(frozenset()) for c in channels], {}, name)
        if alone is None or not may_move:
            continue
        picks = [moved.picks_of(channel, {name: alone}) for channel in channels]
        common |= {pick for own in picks for pick in own}
        fits = [channel.bare(own) for channel, own in zip(channels, picks, strict=True)]
        # Of a long recording looks take their time.
        if channels[0].long and _left(channels, priced(channels, tuple(fits))) > MOVES * gap:
            continue
        for stage in range(STAGES - 1):
            entries = moved.refined(channels, fits, stage)
            for own, made in zip(fitted, entries or (), strict=False):
                own.setdefault(name, []).append(made[name])
    chosen = [{pick for pick in picks if pick[0] not in moving()} | common for picks in chosen]

    order = sorted(range(len(channels)), key=lambda c: -channels[c].excess)
    known: dict[str, Entry] = {}

    def zoom(number: int) -> None:
        channels[number].zoom(chosen[number], beside, known, fitted[number], stood[number])

    if channels[0].long:
        # Where the gap is largest says how the strain moved.
        zoom(order[0])
        known = channels[order.pop(0)].moved_alone()
    all_at_once(zoom, order)
    if not channels[0].long:
        each = list(zip(channels, _said_elsewhere(channels, names), strict=True))
        all_at_once(lambda one: one[0].begin_with(one[1]), each)
    near = [*_near(coarse), *(made.names for made in together)]
    fine = _chosen_again(channels, _models(channels, names, PROMISING, near))
    enough = np.inf
    if channels[0].long:
        enough = HOPELESS * _left(channels, fine[0])
    elif _without_motion(channels, fine[0]):
        enough = MOVES * gap
    closely = sorted(moving() & set(names)) if may_move else []
    moves = [_moves(channels, name, enough) for name in closely]
    least = min((_left(channels, made) for made in moves), default=0.0)
    hopeful = [made for made in moves if _left(channels, made) < HOPELESS * least]
    fine = by_price([*fine, *moves, *(refined(channels, made) for made in hopeful)])
    # A walk follows what a composition would say.
    kinds = [[m for m in fine if len(m.names) > 1 and WALK not in m.names][:COMPOSED]]
    kinds.append([m for m in fine if len(m.names) > 1 and WALK in m.names][:COMPOSED_WALKS])
    kinds.append([m for m in fine if len(m.names) == 1 and WALK not in m.names][:REFINED])
    first = [made for kind in kinds for made in kind[:AT_FIRST]]
    # What acts on each other's signal says little side by side.
    first += [made for made in fine if _serial(made.names) and made not in first][:AT_FIRST]
    # A walk costs little whatever is left; what others say side by side is still far from that.
    named = next(made for made in fine if WALK not in made.names)
    to_beat = named if _left(channels, named) < SAYS_MOST * gap else fine[0]
    several = [made for made in first if _may_be_near(made, to_beat, WITHIN_AT_FIRST)]
    later = [m for kind in kinds for m in kind[AT_FIRST:] if m not in several]
    later = [made for made in later if _may_be_near(made, to_beat, WITHIN)]
    both = moving() & set(names)
    if fine[0].names & both and both not in [made.names for made in several]:
        # Side by side, these say little of what they do in series.
        several.append(replace(model(channels, both), names=both))
    if channels[0].long:
        several, later = [made for made in fine[:1] if len(made.names) > 1], []
    done = _composed(channels, several, to_beat.price)
    told = any(_left(channels, b) < TOLD_MORE * _left(channels, a) for a, b in done)
    closest = [after for _, after in done if WALK not in after.names or to_beat is not named]
    if told or _left(channels, by_price([to_beat, *closest])[0]) > UNTOLD * _for_one_each(channels):
        done += _composed(channels, later, to_beat.price)
    untouched = [made for made in fine if made not in [before for before, _ in done]]
    found = [after for _, after in done]
    found += _without_curves(channels, found)
    found += _instead(channels, by_price([*fine, *found]), names)
    found += _upon_best(channels, by_price([*fine, *found]), names)
    found += _upon_motion(channels, by_price([*fine, *found]), names)
    found += _moved_alike(channels, by_price([*fine, *found]))
    found += _earlier(channels, by_price([*fine, *found]), names)
    last = [weighed(channels, made) for made in [*untouched, *found]]
    return by_price(_fewest_first(channels, _walk_last(channels, by_price(last))))


def _zoomed(channels: Sequence[Channel], coarse: Sequence[Model]) -> list[Model]:
    """The pairs of the ``coarse`` grids that are looked at closely; also some without a walk, which
    says all that is slow however coarse they are."""
    pairs = [made for made in coarse if len(made.names) == 2]
    if channels[0].long:
        several = pairs[:ZOOMED_OF_LONG]
    else:
        named = [made for made in pairs if WALK not in made.names]
        several = by_price([*pairs[:ZOOMED], *named[:ZOOMED_NAMED]])
    return _may_pay(channels, several, coarse[0].price)


def _said_elsewhere(channels: Sequence[Channel], names: Sequence[str]) -> list[dict[str, Entry]]:
    """By channel: the candidates of effects that say all there is on another one, and not here.
    Beside something else an effect alone goes where it says a little of that."""
    result: list[dict[str, Entry]] = [{} for _ in channels]
    there = [c for c, channel in enumerate(channels) if channel.excess >= channel.effect_price]
    # Of a small gap many an effect says all.
    most = max(channels[c].excess for c in there)
    much = [c for c in there if channels[c].excess > MUCH * most]
    for name in sorted(set(names) - moving() - {WALK}):
        fits = {c: channels[c].best(frozenset({name})) for c in there}
        cost = {
            c: (channels[c].price(fit) - channels[c].samples) / channels[c].excess
            for c, fit in fits.items()
        }
        first = min(much, key=cost.__getitem__)
        # It costs as much to name it, whatever the gap.
        named = channels[first].effect_price / channels[first].excess
        if fits[first].picks and cost[first] - named < SAID_ALL:
            said = channels[first].entries[name][dict(fits[first].picks)[name]]
            for c in there:
                if cost[c] > HOPELESS * cost[first]:
                    result[c][name] = said
    return result


def _serial(names: Names) -> bool:
    """Whether these are two effects of which one acts on what the other has done."""
    return len(names) == 2 and all(all_effects()[name].stage in SERIAL for name in names)


def _may_be_near(made: Model, best: Model, within: float) -> bool:
    """Whether ``made`` may cost as little as the ``best`` where effects act on each other."""
    bent = any(all_effects()[name].bent or name in RAILS for name in made.names - {WALK})
    return made.price < (WITHIN_BENT if bent else within) * best.price


def weighed(channels: Sequence[Channel], made: Model) -> Model:
    """``made``, whose effects act on each other by now, with a price for what several leave."""
    left = sum(
        (len(fit.picks) - 1) * max(channel.left(fit), 0.0)
        for channel, fit in zip(channels, made.fits, strict=True)
        if fit.picks and (WALK, 0) not in fit.picks
    )
    return replace(made, price=made.price + LEFT_AGAIN * left)


def _without_motion(channels: Sequence[Channel], best: Model) -> bool:
    """Whether the ``best`` needs no motion to say nearly all that there is."""
    return not best.names & moving() and _left(channels, best) < _for_one_each(channels)


def _moves(channels: Sequence[Channel], name: str, enough: float) -> Model:
    """An effect of the motion alone, fitted to all channels at once from the best of each form,
    where that leaves no more than ``enough``."""
    best = nothing = priced(channels, tuple(channel.best(frozenset()) for channel in channels))
    for key in moved.forms(channels, nothing.fits, name):
        picks = [moved.picks_of(channel, {name: key}) for channel in channels]
        fits = [channel.bare(own) for channel, own in zip(channels, picks, strict=True)]
        made = priced(channels, tuple(fits))
        if _left(channels, made) > enough:
            break
        for stage in range(STAGES - 1):
            made = _fitted(channels, made, stage)
        best = by_price([best, made])[0]
        if _left(channels, best) < LEAST_FREE * channels[0].samples:
            break
    return best


def _chosen_again(channels: Sequence[Channel], models: list[Model]) -> list[Model]:
    """``models`` by price, the most promising of several effects with candidates chosen again."""
    named = [made for made in models if WALK not in made.names]
    several = [made for made in named if len(made.names) == 2][:CHOSEN_AGAIN]
    several += [made for made in named if len(made.names) == 3][:SHORT_BEAM]
    several = _may_pay(channels, several, models[0].price)

    def again(number: int) -> list[Fit]:
        channel, fits = channels[number], [made.fits[number] for made in several]
        return [channel.chosen_again(fit, channel.held(fit)) for fit in fits]

    by_channel = all_at_once(again, range(len(channels)))
    better = [leaner(channels, priced(channels, fits)) for fits in zip(*by_channel, strict=True)]
    return by_price([*models, *better])


def _walk_last(channels: Sequence[Channel], models: list[Model]) -> list[Model]:
    """A walk follows whatever is slow: beside an effect only where all else leaves far more, and
    alone where it leaves more."""
    without = next(made for made in models if WALK not in made.names)
    beside = WALK in models[0].names and len(models[0].names) > 1
    least = WALK_SAYS * sum(channels[c].excess for c in models[0].channels_of(WALK))
    left = _left(channels, without)
    with_walk = _left(channels, models[0])
    tells = WALK_TELLS * max(with_walk, NAME_PRICE * channels[0].samples)
    if beside and left < min(max(WALK_LEAVES * with_walk, least), tells):
        models = [made for made in models if WALK not in made.names or len(made.names) == 1]
    if models[0].names == {WALK} and left < _left(channels, models[0]):
        return [replace(without, price=models[0].price), *models]
    return models


def _fewest_first(channels: Sequence[Channel], models: list[Model]) -> list[Model]:
    """An effect more must leave less: where fewer that cost little more leave as little, they are
    as good, though each channel may find a cheaper one; or where they leave little more. Of what
    has a walk and others, only the walk alone is."""
    best, left = models[0], _left(channels, models[0])
    fewer = [made for made in models if made.names and made.names < best.names]
    if WALK in best.names:
        fewer = [made for made in fewer if made.names == {WALK}]
    good = [
        made
        for made in fewer
        if (_left(channels, made) <= left and made.price < COSTS_MORE * best.price)
        or (WALK not in best.names and _little_more(channels, best, made))
    ]
    return [replace(made, price=best.price) for made in good[:1]] + models


def _little_more(channels: Sequence[Channel], best: Model, fewer: Model) -> bool:
    """Whether what the ``best`` has more than ``fewer`` is only what equations leave, which are not
    quite right with it either."""
    more = best.names - fewer.names
    if not more <= SCALES:
        return False
    named = [{name for name, _ in fit.picks} for fit in best.fits]
    there = [n for n, own in enumerate(named) if own & more]
    if any(fewer.fits[n].static_columns > 1 >= best.fits[n].static_columns for n in there):
        # A curve for which nothing is named stands for it.
        return False
    cheap = fewer.price < best.price + LITTLE * sum(channels[n].excess for n in there)
    nearly = any(channels[n].left(best.fits[n]) > RIGHT * channels[n].samples for n in there)
    return cheap and nearly and not any(own and own <= more for own in named)


def _for_one_each(channels: Sequence[Channel]) -> float:
    """What one effect costs on every channel."""
    return sum(channel.effect_price for channel in channels)


def _left(channels: Sequence[Channel], made: Model) -> float:
    return _left_by(channels, made.fits)


def _left_by(channels: Sequence[Channel], fits: Sequence[Fit]) -> float:
    return sum(channel.left(fit) for channel, fit in zip(channels, fits, strict=True))


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
    made = [priced(channels, tuple(fits)) for fits in zip(*by_channel, strict=True)]
    after = [leaner(channels, each, composed=True) for each in made]
    return list(zip(several, [refined(channels, made) for made in after], strict=True))


def _without_curves(channels: Sequence[Channel], models: Sequence[Model]) -> list[Model]:
    """The one of ``models`` without a walk that leaves least, without its static curves: these may
    stand for what one effect does to another, at a price."""
    several = [made for made in models if len(made.names) > 1 and WALK not in made.names]
    if channels[0].long or not several:
        return []
    least = min(several, key=lambda made: _left(channels, made))
    each = list(zip(channels, least.fits, strict=True))
    fits = all_at_once(lambda one: one[0].without_curve(one[1]), each)
    return [leaner(channels, priced(channels, tuple(fits)), composed=True)]


def _instead(
    channels: Sequence[Channel], models: Sequence[Model], names: Sequence[str]
) -> list[Model]:
    """The best of several effects without a walk, with each other scale or rail, but no curve, in
    place of the one that it has: side by side with what these act upon, they may say little."""
    best = next(made for made in models if WALK not in made.names)
    own = best.names & ALIKE
    if channels[0].long or len(own) != 1 or len(best.names) < 2:
        return []
    (old,) = own

    def instead(new: str) -> Model:
        each = list(zip(channels, best.fits, strict=True))
        fits = all_at_once(lambda one: one[0].instead(one[1], old, new), each)
        return leaner(channels, priced(channels, tuple(fits)), composed=True)

    return [instead(new) for new in sorted((ALIKE - own - {CURVE}) & set(names))]


def _upon_best(
    channels: Sequence[Channel], models: Sequence[Model], names: Sequence[str]
) -> list[Model]:
    """The best model without a walk, which follows whatever is left, with each of the most
    promising effects more where it leaves much of a channel: side by side with what it acts upon,
    that may say little."""
    best = next(made for made in models if WALK not in made.names)
    poor = [
        number
        for number, (channel, fit) in enumerate(zip(channels, best.fits, strict=True))
        if fit.picks and channel.left(fit) > UNTOLD * channel.effect_price
    ]
    # What acts upon what moves the strain is looked for anyway.
    if channels[0].long or not poor or best.names & moving():
        return []

    def beside(name: str) -> dict[int, Fit]:
        """By channel: the best fit of its effects and one more."""
        return {c: channels[c].best(frozenset(dict(best.fits[c].picks)) | {name}) for c in poor}

    def cost(fits: dict[int, Fit]) -> float:
        return sum(channels[c].price(fit) for c, fit in fits.items())

    rest = [name for name in names if name not in best.names | moving() | {WALK}]
    result = []
    for fits in sorted(map(beside, rest), key=cost)[:UPON]:
        made = list(best.fits)
        for c, fit in fits.items():
            # Others have been fitted side by side with all there is.
            if on_each_other(fit.picks):
                fit = channels[c].composed(fit, frozenset(dict(fit.picks)))
            made[c] = min(made[c], fit, key=channels[c].price)
        result.append(leaner(channels, priced(channels, tuple(made)), composed=True))
    return result


def _upon_motion(
    channels: Sequence[Channel], models: Sequence[Model], names: Sequence[str]
) -> list[Model]:
    """What moves the strain alone, with another effect upon it.

    Side by side with a motion that moves much, little of what acts upon it is seen; but not where
    the best model without a walk, which follows whatever is left, leaves less than effects cost.
    """
    may_pay = _least(channels, 2) < models[0].price
    named = next(made for made in models if WALK not in made.names)
    if channels[0].long or not may_pay or _left(channels, named) < _for_one_each(channels):
        return []
    result = []
    rest = [name for name in names if name not in moving() and name != WALK]
    gap = sum(channel.excess for channel in channels)
    poorly = _left(channels, models[0]) > POORLY * gap
    alone = [m for m in models if len(m.names) == 1 and m.names <= moving()]
    left = {m.names: _left(channels, m) for m in alone}
    alone = [m for m in alone if channels[0].effect_price < left[m.names] < MOVES * gap]
    little = LITTLE_ALONE * gap
    alone = [m for m in alone if poorly or m.names <= named.names or left[m.names] < little]
    for before in [*alone, *_known_by_one(channels)]:
        result += _upon(channels, before, rest)
    best = min(result, key=lambda made: made.price, default=None)
    return result + ([refined(channels, best)] if best else [])


def _moved_alike(channels: Sequence[Channel], models: Sequence[Model]) -> list[Model]:
    """The most promising pairs with the same effect of the motion as the best model, moved as that
    one is: beside another effect, the fit of a motion may have gone elsewhere."""
    best = models[0]
    motion = best.names & moving()
    if channels[0].long or not motion or WALK in best.names:
        return []
    pairs = [made for made in models[1:] if len(made.names) == 2 and WALK not in made.names]
    alike = [made for made in pairs if made.names & moving() == motion]
    result = []
    for made in _may_pay(channels, alike, best.price)[:EXCHANGED]:
        each = list(zip(channels, made.fits, best.fits, strict=True))
        fits = all_at_once(lambda one: one[0].with_motion(one[1], one[0].motion_of(one[2])), each)
        result.append(leaner(channels, priced(channels, tuple(fits))))
    if result:
        # Meanwhile the others have been what they were.
        result.append(_closer(channels, min(result, key=lambda made: made.price)))
    return result


def _earlier(
    channels: Sequence[Channel], models: Sequence[Model], names: Sequence[str]
) -> list[Model]:
    """A clock that is no later than any channel, or half as late, with a lag of each upon it, where
    one of them seems to be there: alone a clock is as late as they are on average, and no lag looks
    ahead."""
    alone = [made for made in models if made.names == {DELAY}]
    late = not models[0].names.isdisjoint({DELAY, LAG}) and _least(channels, 2) < models[0].price
    if channels[0].long or not alone or LAG not in names or not late:
        return []
    fits = alone[0].fits
    least_s = min(moved.own_values(channels, fits, DELAY, DELAY_S))
    result = []
    for late_s in (least_s, 0.5 * least_s):
        early = _late(channels, fits, partial(_late_by, late_s))
        result += _upon(channels, early, [LAG])
    best = min(result, key=lambda made: made.price, default=None)
    return result + ([refined(channels, best)] if best else [])


def _late(
    channels: Sequence[Channel], fits: Sequence[Fit], change: Callable[[moved.Own], moved.Own]
) -> Model:
    """``fits`` with a ``change`` to the values of their delay."""

    def changed(one: tuple[Channel, Fit]) -> Fit:
        return one[0].with_motion(one[1], moved.with_values(*one, DELAY, change), True)

    each = list(zip(channels, fits, strict=True))
    return priced(channels, tuple(all_at_once(changed, each)))


def _late_by(late_s: float, own: moved.Own) -> moved.Own:
    return {**own, DELAY_S: late_s}


def _in_step(channels: Sequence[Channel], made: Model) -> Model:
    """``made``, or a cheaper one where all channels are late by as much: a delay alone takes for
    its own, channel by channel, what another effect does."""

    def alike(own: moved.Own) -> moved.Own:
        mean_s = own[DELAY_S] + 0.5 * own.get(SCAN, 0.0) * (len(channels) - 1)
        return {k: v for k, v in own.items() if k != SCAN} | {DELAY_S: mean_s}

    motions = [c.motion_of(fit) for c, fit in zip(channels, made.fits, strict=True)]
    delays = [own[DELAY].candidate.values for own in motions if DELAY in own]
    if len(made.names) < 2 or not any(SCAN in values for values in delays):
        return made
    return by_price([made, _fitted(channels, _late(channels, made.fits, alike), 0)])[0]


def _upon(channels: Sequence[Channel], before: Model, rest: Sequence[str]) -> list[Model]:
    """The motion of ``before`` with each of the most promising effects of ``rest`` upon it."""
    trials = all_at_once(
        lambda one: one[0].moved(one[1], rest), list(zip(channels, before.fits, strict=True))
    )
    upon = by_price(_made(trials, [frozenset(), *(frozenset({name}) for name in rest)]))
    result = []
    for second in upon[:UPON]:
        if not second.names:
            break
        each = list(zip(channels, before.fits, trials, second.fits, strict=True))
        fits = all_at_once(lambda one: one[0].then(*one[1:]), each)
        result.append(priced(channels, tuple(fits)))
    return result


def _known_by_one(channels: Sequence[Channel]) -> list[Model]:
    """What moved the strain as one channel tells that nothing else is on, for all of them, where it
    says little on others."""
    for channel in channels:
        for name in sorted(moving() & channel.entries.keys()):
            fit = channel.best(frozenset({name}))
            if not channel.held(fit) or channel.left(fit) > ONE_LEAVES * channel.excess:
                continue
            held = {name: channel.entries[name][dict(fit.picks)[name]].key}
            there = [c for c in channels if c.entries and held[name] in c.numbers(name)]
            if len(there) == sum(bool(c.entries) for c in channels):
                fits = [c.bare(moved.picks_of(c, held)) for c in channels]
                made = priced(channels, tuple(fits))
                enough = MOVES * sum(c.excess for c in channels)
                return [made] if _left(channels, made) > enough else []
    return []


def refined(channels: Sequence[Channel], made: Model) -> Model:
    """``made``, or a cheaper one where what moves the strain is fitted to all channels at once."""
    begun = made
    made = _in_step(channels, made)
    for stage in range(STAGES - 1):
        made = _fitted(channels, made, stage)
    gap = sum(channel.excess for channel in channels)
    free = LEAST_FREE * channels[0].samples < _left(channels, made) < MOST_FREE * gap
    # Two that may go anywhere say the same.
    free = free and len(made.names & moving()) == 1
    if free and not channels[0].long:
        made = _fitted(channels, made, STAGES - 1)
    if made is not begun and len(made.names) > 1:
        # Meanwhile the others have been what they were.
        made = _closer(channels, made)
    return leaner(channels, made)


def _closer(channels: Sequence[Channel], made: Model) -> Model:
    """``made``, or a cheaper one with candidates near those that it has."""
    each = list(zip(channels, made.fits, strict=True))
    fits = all_at_once(lambda one: one[0].closer(one[1]), each)
    return by_price([made, priced(channels, tuple(fits))])[0]


def _fitted(channels: Sequence[Channel], made: Model, stage: int) -> Model:
    """The same with one kind of parameters only."""
    for _ in range(FITTED_ROUNDS):
        # A static curve hides where a drive has its zero.
        begun = [replace(fit, static=None) if stage else fit for fit in made.fits]
        entries = moved.refined(channels, begun, stage)
        if entries is None:
            break
        each = list(zip(channels, made.fits, entries, strict=True))
        fits = all_at_once(lambda one: one[0].with_motion(one[1], one[2], bool(stage)), each)
        other = priced(channels, tuple(fits))
        gained = made.price - other.price
        # What there is besides must say more than what a fit that is not quite there leaves.
        if gained <= (LEAST_MORE * channels[0].samples if stage else 0.0):
            break
        made = other
        if gained < LEAST_FITTED * channels[0].samples:
            break
    return made


def _near(models: Sequence[Model]) -> list[Names]:
    """Pairs that may come to the best of ``models`` once each acts on what the other has done."""
    pairs = [made for made in models if len(made.names) == 2 and WALK not in made.names]
    near = [made.names for made in pairs if made.price < WITHIN * pairs[0].price]
    return [names for names in near if _serial(names)][:NEAR]


def _models(
    channels: Sequence[Channel],
    known: Sequence[str],
    within: float,
    near: Sequence[Names] = (),
    most: int = 3,
) -> list[Model]:
    """Models by price, of at ``most`` so many effects: of none, of one, and where more may pay, of
    two that are ``near`` or build on the best alone, which cost no more than ``within`` times the
    cheapest, and of three that build on the best two."""
    names = sorted(known)
    none, *singles = _made(channels, [frozenset(), *(frozenset({name}) for name in names)])
    singles = by_price(singles)
    if singles[0].price < _least(channels, 2):
        return by_price([none, *singles])
    # A walk may cost next to nothing beside what no effect says.
    limit = within * min((m.price for m in singles if WALK not in m.names), default=0.0)
    first = [m for m in singles[:BEAM] if WALK in m.names or m.price <= limit]
    twos = [
        frozenset(two)
        for two in combinations(names, 2)
        if any(one.names <= set(two) for one in first) or frozenset(two) in near
    ]
    pairs = _promising(channels, twos, [none, *singles])
    triples: list[Model] = []
    if most > 2 and pairs and pairs[0].price < min(none.price, singles[0].price):
        threes = [
            two.names | {name}
            for two in pairs[:SHORT_BEAM]
            for name in names
            if name not in two.names
        ]
        triples = _promising(channels, threes, pairs)
    return by_price([none, *singles, *pairs, *triples])


def _made(channels: Sequence[Channel], several: Sequence[Names]) -> list[Model]:
    """The models of ``several``, channel by channel on all cores."""
    still = [names - moving() for names in several]
    all_at_once(lambda channel: [channel.within(names) for names in still], channels)
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
    guard = min(channel.guard for channel in channels)
    named = NAME_PRICE * guard * channels[0].samples * beside_walk(len(names) - 1)
    return sum(least) + first + named


def by_price(models: Iterable[Model]) -> list[Model]:
    """``models``, the cheapest first; of those with the same names, the cheapest."""
    # An effect that pays nowhere has left the names; of equals one is enough.
    best: dict[Names, Model] = {}
    for made in models:
        if made.names not in best or made.price < best[made.names].price:
            best[made.names] = made
    return sorted(best.values(), key=lambda made: made.price)
