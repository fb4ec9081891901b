"""Whether what a model takes for a random walk is one, and whether the strain was as recorded.

A walk follows whatever is slow, so that a search finds one in all that no equation says well; and
a specimen that slips in its clamp, or play of a kind that no equation has, leaves on every channel
what looks like some effect of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from softsense.diagnose import wandering
from softsense.diagnose.channel import Channel
from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import Base, Design, Fit, Group, Term
from softsense.diagnose.moved import LEAST_CHANNELS, Together, answer
from softsense.diagnose.nominal import Motion
from softsense.diagnose.pricing import DELAY, LAG, WALK, WALK_PRICE
from softsense.diagnose.search import (
    SLOW,
    Model,
    by_price,
    model,
    moving,
    priced,
    refined,
    weighed,
)
from softsense.diagnose.variance import each_alone
from softsense.diagnose.walk import CALM, innovations, levels, without_slow
from softsense.effects import all_effects
from softsense.effects.overshoot import SIGNED

Floats = NDArray[np.float64]

# Where an effect alone leaves so much of the gap, something is there besides, or in its place.
REMAINING_ALONE = 0.06
# And so much that what it does is wandering, where only what is slow can do it.
SLOWLY = 0.015
# Samples to either side of a step that are no part of a walk beside it.
BESIDE_STEP = 40
# What of walks is no answer to one strain for all.
OTHERWISE = 0.3
# Independent walks' innovations of two channels have a larger chi-squared once in 120 cases.
ALIKE = 7.0
# Where only what is slow would say it, more of it is asked.
MUCH_ALIKE = 40.0
# What is alike is most of what wanders where it is so much of its slower moves: a little of what
# another effect leaves makes no walk its own.
MOVES_ALIKE = 0.1
# Share of what a walk does within ``FAST`` samples that the history of the motion may tell, by the
# first ``ASKED`` samples.
DRIVEN = 0.5
FAST = 100
ASKED = 100_000
# One strain for all channels says more than effects do where these leave so many noise variances of
# one channel more, or with play or a delay among them not so many less; and where it leaves no more
# than this share of the gap.
WORSE = 0.3
NEARLY = 0.1
MOST = 0.05
# Nor does it say walks beside a motion where it leaves this share of what is left without them.
NO_STRAIN = 0.5
# What moves the strain is known where it leaves less of the gap. Other effects stand where they do
# not leave so many times as much as any strain.
MOVED_LEAVES = 0.1
# And is not looked for again where it leaves no more than this.
MOVED_RIGHT = 0.002
FAR_WORSE = 3.0
# A gap of which an effect leaves less than this share is no noise.
OF_NOISE = 0.5
# What motion breaks is alike both ways, up to this share of it.
ONE_SIGN = 0.1
STEP = "step"
# Per sample and channel: what a circuit of its own says more than one clock for all, by chance,
# where its time constant is no more than a sample.
OWN_VALUE = 0.05
# Beside a walk that jumps a step may cost so many times what the effect does that is there instead.
STEPS_INSTEAD = 1.5
# So many models with a walk and something else are looked at where the walk of the best is none.
INSTEAD = 4


@dataclass(frozen=True)
class Vetted:
    """``models``, the cheapest first of those that may be; whether what that one takes for a walk
    is ``jerky``, in jumps or bumps; whether the specimen was ``strained_otherwise`` than
    recorded, by nothing that is known; and channels that are ``noisy``: what effects leave of their
    gap is nothing but noise of some colour or in bursts."""

    models: list[Model]
    jerky: bool
    strained_otherwise: bool
    noisy: tuple[int, ...] = ()


def vetted(
    channels: Sequence[Channel], models: Sequence[Model], motion: Motion, strain: Together
) -> Vetted:
    """``models`` without the walks that are none, or only those that move the strain where any
    strain that is the same for all channels says the gap as well."""
    if (noise := _beside_noise(channels, models)) is not None:
        return noise
    named = [made for made in models if WALK not in made.names]
    walks = [made for made in models if made.names == {WALK}]
    if models[0].names == {WALK, STEP}:
        models = [*_jumped(channels, models[0]), *models]
    if WALK in models[0].names and len(models[0].names) > 1:
        models = by_price([_beside_walks(channels, models, named[0], motion), *named])
    models = _by_clock(channels, _by_sign(channels, models))
    if models[0].names == {WALK}:
        instead = _jumped(channels, models[0]) or _told(channels, models[0], named[0], motion)
        models = [*instead, *models]
    jerky = _jerky(channels, models[0])
    beside = len(models[0].names) > 1
    if (
        (beside and _is_none(channels, models[0], named[0], motion))
        or (not beside and _driven(channels, models[0], motion))
        or (jerky and left_share(channels, named[0]) < REMAINING_ALONE)
        or (jerky and _unguarded(channels, models[0]) > named[0].price)
    ):
        # What another effect leaves over, its form being only nearly right, is no walk: it is alike
        # on all its channels. Nor is one what goes in jumps that an effect can say, or a loud noise
        # may have. But all of it may be walks, of which the other effect has only followed some.
        alone = [made for made in walks if beside and _are_walks(channels, made, motion)]
        models, jerky = by_price([*alone, *named]), False
    best = models[0]
    kept = [
        made
        for made in models
        if made.names != {WALK}
        or made is best
        or not (_jerky(channels, made) or _driven(channels, made, motion))
    ]
    said = next(made for made in kept if WALK not in made.names)
    left = left_share(channels, said) * strain.gap
    # What is the same on all channels is such a strain too: an exact equation is not given up.
    worse = -NEARLY if said.names & moving() else WORSE
    # What a motion leaves beside walks, no strain says.
    wander = WALK in best.names and best.names & moving() and strain.left > NO_STRAIN * left
    if wander or strain.left > min(left - worse, MOST * strain.gap):
        return Vetted(kept, jerky, False)
    moved = [made for made in kept if made.names <= moving()]
    if left_share(channels, moved[0]) >= (MOVED_LEAVES if channels[0].long else MOVED_RIGHT):
        moved = by_price([*moved, *_moving_alone(channels)])
    if left_share(channels, moved[0]) < MOVED_LEAVES:
        return Vetted(moved, False, False)
    known = best.names == {STEP} or FAR_WORSE * strain.left > left
    return Vetted(kept, jerky, not known)


def _by_sign(channels: Sequence[Channel], models: Sequence[Model]) -> list[Model]:
    """``models``, first what says the gap as well as what goes with the signed strain rate alone:
    so does a little lag."""
    best = models[0]
    if not signed(channels, best):
        return list(models)
    others = [m for m in models if WALK not in m.names and not signed(channels, m)]
    alike = [m for m in others if m.price < best.price + channels[0].effect_price]
    return [*alike[:1], *models]


def _by_clock(channels: Sequence[Channel], models: Sequence[Model]) -> list[Model]:
    """``models``, first what says the gap as well with a delay as with a lag of no more than a
    sample on every channel: a clock has one value for all, where each circuit has its own."""
    best = models[0]
    late = best.channels_of(LAG)
    if DELAY in best.names or len(late) < LEAST_CHANNELS:
        return list(models)
    picks = [(channels[c], dict(best.fits[c].picks)[LAG]) for c in late]
    times_s = [channel.entries[LAG][number].candidate.values["tau_s"] for channel, number in picks]
    if max(times_s) > channels[0].nominal.dt_s or any(
        channel.entries for c, channel in enumerate(channels) if c not in late
    ):
        return list(models)
    near = best.price + OWN_VALUE * len(late) * channels[0].samples
    clock = best.names - {LAG} | {DELAY}
    alike = [made for made in models if made.names == clock and made.price < near]
    return [*alike[:1], *models]


def _beside_walks(
    channels: Sequence[Channel], models: Sequence[Model], named: Model, motion: Motion
) -> Model:
    """The cheapest of ``models``, which has a walk and something else, or what costs nearly as
    little and whose walk is one, where that one's is none; ``named``: the best without."""
    near = models[0].price + sum(channel.effect_price for channel in channels if channel.entries)
    near = min(near, named.price)
    rivals = [m for m in models if WALK in m.names and len(m.names) > 1 and m.price < near]
    looked, good = list[Model](), list[Model]()
    for made in [_stepped(channels, models), *rivals[1:INSTEAD]]:
        if good and min(one.price for one in good) <= made.price:
            break
        calm = _calm(channels, _steady(channels, made))
        # Of a rival all walks must be some: of what follows whatever is slow there is always one.
        if looked and calm is not made:
            continue
        one = weighed(channels, calm)
        looked.append(one)
        if WALK not in one.names or not _is_none(channels, one, named, motion):
            good.append(one)
    return by_price(good or looked[:1])[0]


def _is_none(channels: Sequence[Channel], made: Model, named: Model, motion: Motion) -> bool:
    """Whether what the model takes for walks beside something else are none; ``named``: the best
    without."""
    # What only a slow effect would have in place of a walk is one where that leaves much.
    slow = not SLOW.isdisjoint(named.names) and left_share(channels, named) > SLOWLY
    return (
        _jerky(channels, made)
        or _alike(channels, made, slow)
        or (not slow and _driven(channels, made, motion))
    )


def _are_walks(channels: Sequence[Channel], made: Model, motion: Motion) -> bool:
    """Whether all that the model takes for walks are some, each channel's its own."""
    return not (
        _jerky(channels, made) or _driven(channels, made, motion) or _alike(channels, made, False)
    )


def _beside_noise(channels: Sequence[Channel], models: Sequence[Model]) -> Vetted | None:
    """What is left where only a walk, or nothing, says a gap that is noise, or what an effect
    leaves of it."""
    best, named = models[0].names, [made for made in models if WALK not in made.names]
    if best and WALK not in best:
        return None
    told = left_share(channels, named[0]) < OF_NOISE
    for said in (named[0],) if told else (model(channels, frozenset()), named[0]):
        if best <= said.names | {WALK} and (noisy := _noisy(channels, said)):
            return Vetted([said, *named], False, False, noisy)
    return None


def _noisy(channels: Sequence[Channel], said: Model) -> tuple[int, ...]:
    """Channels whose gap is noise, on all where ``said`` does not say it: each its own, while what
    touches the specimen shows on several. An effect says all on some channel."""
    there = [both for both in zip(channels, said.fits, strict=True) if both[0].entries]
    gaping = [
        (channel, fit) for channel, fit in there if channel.unsaid(fit) > channel.effect_price
    ]
    if not gaping or (said.names and len(gaping) == len(there)):
        return ()
    gaps = all_at_once(lambda both: both[0].residual - both[0].predicted(both[1]), gaping)
    if not each_alone(np.stack(gaps, axis=1)).all():
        return ()
    speed = np.abs(channels[0].nominal.rate)
    if not all(wandering.noisy(left, speed) for left in gaps):
        return ()
    return tuple(channel.nominal.channel for channel, _ in gaping)


def _moving_alone(channels: Sequence[Channel]) -> list[Model]:
    """Models of what moves the strain, and of nothing else."""
    known = moving() & {name for channel in channels for name in channel.entries}
    several = [known, *(frozenset({name}) for name in sorted(known))]
    return [refined(channels, model(channels, names)) for names in several if names]


def left_share(channels: Sequence[Channel], best: Model) -> float:
    """Share of the gap beyond the noise that the model leaves on time that it has not seen."""
    left = sum(
        (float(fit.errors.sum()) - channel.samples * channel.noise) / channel.sigma**2
        for channel, fit in zip(channels, best.fits, strict=True)
        if not channel.quiet
    )
    return float(np.clip(left / max(sum(c.excess for c in channels), 1.0), 0.0, 1.0))


def _unguarded(channels: Sequence[Channel], best: Model) -> float:
    """What a model with walks would cost if the real noise were no louder than simulated."""
    there = [channels[number] for number in best.channels_of(WALK)]
    return best.price + sum(WALK_PRICE * (1.0 - c.guard) * c.samples for c in there)


def walks_of(channels: Sequence[Channel], best: Model) -> list[tuple[Channel, Floats]]:
    """Channels on which the model sees a walk, and (samples,) what wanders there."""
    return [
        (channels[number], _walk_on(channels, best, number)) for number in best.channels_of(WALK)
    ]


def _walk_on(channels: Sequence[Channel], best: Model, number: int) -> Floats:
    """(samples,) what wanders on the channel of this ``number``."""
    channel = channels[number]
    return channel.wandering(channel.residual - channel.predicted(best.fits[number]))


def signed(channels: Sequence[Channel], best: Model) -> bool:
    """Whether what the model takes for ``overshoot``, and nothing else, has one sign on the way up
    and the other one on the way down, where most of it is: a charge or a force goes so with the
    strain rate, which no effect does, and not what motion breaks."""
    if best.names != {"overshoot"}:
        return False
    of_sign, all_of_it = 0.0, 0.0
    for channel, fit in zip(channels, best.fits, strict=True):
        for pick, weights in channel.weighted(fit):
            entry = channel.entries[pick[0]][pick[1]]
            size = float((entry.said(weights) ** 2).sum()) / channel.sigma**2
            cancels = abs(float(weights.sum())) < ONE_SIGN * float(np.abs(weights).sum())
            candidate = entry.candidate
            of_sign += size * (candidate.form == SIGNED or (candidate.parallel and cancels))
            all_of_it += size
    return of_sign > 0.5 * all_of_it


def _alike(channels: Sequence[Channel], best: Model, slow: bool) -> bool:
    """Whether what the walks' past does not foresee goes together on several channels, and so do
    their slower moves; much so where else only what is ``slow`` would say it.

    Correlations of two series that are white and independent have the variance 1 / samples.
    """
    walks = walks_of(channels, best)
    if len(walks) < 2:
        return False
    if best.names & moving():
        return not slow and _strained(walks)
    news = np.stack([innovations(w[:, None], channel.gain_of(w))[:, 0] for channel, w in walks])
    moves = np.diff(np.stack([levels(walk) for _, walk in walks]), axis=1)
    most = MUCH_ALIKE if slow else ALIKE
    return _shared(news) * news.shape[1] > most and _shared(moves) > MOVES_ALIKE


def _shared(series: Floats) -> float:
    """The mean square of the correlations of each two of ``series`` (several, samples)."""
    together = np.asarray(np.corrcoef(series))[np.triu_indices(len(series), 1)]
    return float(np.mean(together**2))


def _strained(walks: Sequence[tuple[Channel, Floats]]) -> bool:
    """Whether most of what wanders is as channels answer one strain: what the equation of a motion
    leaves that is only nearly right."""
    nominals = [channel.nominal for channel, _ in walks]
    answers = np.stack([answer(nominal) for nominal in nominals], axis=1)
    walked = np.stack([walk for _, walk in walks], axis=1)
    sigma = np.array([channel.sigma for channel, _ in walks])
    answers, walked = answers / sigma, walked / sigma
    together = (answers * walked).sum(axis=1) / np.maximum((answers**2).sum(axis=1), 1e-12)
    other = walked - together[:, None] * answers
    return float((other**2).sum()) < OTHERWISE * float((walked**2).sum())


def _jerky(channels: Sequence[Channel], best: Model) -> bool:
    """Whether what the model takes for a walk goes in jumps or bumps on any channel, or of walks
    alone on half of them: one of many may by chance."""
    numbers = best.channels_of(WALK)
    rough = sum(all_at_once(lambda number: _jerky_on(channels, best, number), numbers))
    return rough > 0 and (best.names != {WALK} or 2 * rough >= len(numbers))


def _jerky_on(channels: Sequence[Channel], best: Model, number: int) -> bool:
    """The same of one channel.

    Jumps that something else may make do not count: what is nearly right of an effect of the motion
    leaves some while the strain moves, a step some about its instant, and a rail where it holds and
    within a move of there.
    """
    channel, fit = channels[number], best.fits[number]
    said = {
        name: channel.columns((name, entry)) @ weights
        for (name, entry), weights in channel.weighted(fit)
    }
    walk = _walk_on(channels, best, number)
    where = np.ones(len(walk), dtype=bool)
    moved = bool(best.names & moving())
    speed = np.abs(channel.nominal.rate)
    if best.names == {WALK} and wandering.moved_by(walk, speed):
        return True
    if moved:
        where &= speed <= np.median(speed)
    if STEP in said:
        jump = _jump(said[STEP])
        where[max(jump - BESIDE_STEP, 0) : jump + BESIDE_STEP] = False
    if "saturation" in said:
        railed = np.abs(said["saturation"]) >= channel.sigma
        where &= ~binary_dilation(railed, iterations=CALM)
    return wandering.jerky(walk, channel.gain_of(walk), where, not moved)


def _jumped(channels: Sequence[Channel], walks: Model) -> list[Model]:
    """The same with a step at one instant where the walks go in jumps, if they then do not.

    Beside a walk a step is a single move, which no other time foretells, so that it never pays.
    """
    if not _jerky(channels, walks):
        return []
    rough = [
        channel
        for channel, walk in walks_of(channels, walks)
        # What heeds the motion does so with a step, too.
        if not wandering.moved_by(walk, np.abs(channel.nominal.rate))
        and _jerky_on(channels, walks, channel.nominal.channel)
    ]
    if not rough:
        return []
    fits = list(walks.fits)
    for channel in rough:
        fits[channel.nominal.channel] = channel.best(frozenset({WALK, STEP}))
    instants = [_instant(channel, fit) for channel, fit in zip(channels, fits, strict=True)]
    instant = _most_agree([own for own in instants if own is not None])
    if instant is None:
        return []
    for channel in rough:
        own = instants[channel.nominal.channel]
        if own is None or abs(own - instant) > BESIDE_STEP:
            fits[channel.nominal.channel] = _stepped_at(channel, instant)
    both = priced(channels, tuple(fits))
    return [] if _jerky(channels, both) else [replace(both, price=walks.price)]


def _most_agree(instants: Sequence[int]) -> int | None:
    """The one of ``instants`` that most agree upon, if more do than do not."""
    agree = [sum(abs(one - other) <= BESIDE_STEP for other in instants) for one in instants]
    most = max(agree, default=0)
    return instants[agree.index(most)] if 2 * most > len(instants) else None


def _stepped_at(channel: Channel, instant: int) -> Fit:
    """A walk, and the step that says most beside it, of those within a moment of an ``instant``."""
    walk = ((WALK, 0),)
    worth = channel.worth(walk, 0, STEP)
    # Those that are composed since are not among them.
    at_s = [entry.candidate.values["onset_s"] for entry in channel.entries[STEP][: len(worth)]]
    away_s = np.abs(np.array(at_s) - channel.nominal.time_s[instant])
    far = away_s > BESIDE_STEP * channel.nominal.dt_s
    return channel.fit((*walk, (STEP, int(np.argmax(np.where(far, -np.inf, worth))))))


def _told(channels: Sequence[Channel], walks: Model, named: Model, motion: Motion) -> list[Model]:
    """The same with one effect more where the motion tells something of the walks, if it then does
    not; ``named``: the best without walks."""
    there = _driven_on(channels, walks, motion)
    known = {name for number in there for name in channels[number].entries}
    made = []
    for name in sorted(known - moving()):
        fits = list(walks.fits)
        for number in there:
            fits[number] = channels[number].best(frozenset({WALK, name}))
        made.append(priced(channels, tuple(fits)))
    some = [one for one in by_price(made)[:INSTEAD] if one.names > {WALK}]
    good = [one for one in some if not _is_none(channels, one, named, motion)]
    return [replace(good[0], price=walks.price)] if good else []


def _stepped(channels: Sequence[Channel], models: Sequence[Model]) -> Model:
    """The best of ``models``, or where a walk of it goes in jumps that a step says, what has that
    step instead of another effect."""
    if _jerky(channels, models[0]):
        for made in models:
            near = made.price < STEPS_INSTEAD * models[0].price
            if near and made.names == {WALK, STEP} and not _jerky(channels, made):
                return made
    return models[0]


def _instant(channel: Channel, fit: Fit) -> int | None:
    """The sample in which the step of a fit happens, if it has one."""
    for pick, weights in channel.weighted(fit):
        if pick[0] == STEP:
            return _jump(channel.columns(pick) @ weights)
    return None


def _jump(said: Floats) -> int:
    """Where ``said`` (samples,) jumps most."""
    return int(np.argmax(np.abs(np.diff(said))))


def _calm(channels: Sequence[Channel], made: Model) -> Model:
    """The same without a walk on those of several channels where it goes in jumps or bumps: there
    it is what another effect leaves."""
    rough = [c for c in made.channels_of(WALK) if _jerky_on(channels, made, c)]
    calm = _without_walk(channels, made, rough)
    return calm if WALK in calm.names else made


def _steady(channels: Sequence[Channel], made: Model) -> Model:
    """The same without a walk that comes and goes as the strain moves where the other effects say
    nearly all: it is what they leave."""
    left_over = []
    for channel, walk in walks_of(channels, made):
        without = channel.within(made.names - {WALK})
        nearly = channel.left(without) < REMAINING_ALONE * channel.excess
        if nearly and wandering.moved_by(walk, np.abs(channel.nominal.rate)):
            left_over.append(channel.nominal.channel)
    return _without_walk(channels, made, left_over)


def _without_walk(channels: Sequence[Channel], made: Model, numbers: Sequence[int]) -> Model:
    """The same without a walk on channels of these ``numbers``."""
    fits = list(made.fits)
    for number in numbers:
        fits[number] = channels[number].within(made.names - {WALK})
    return priced(channels, tuple(fits)) if numbers else made


def _driven(channels: Sequence[Channel], best: Model, motion: Motion) -> bool:
    """Whether the history of the motion tells what the model takes for a walk, on any channel.

    The history is a black box (``history_basis``), asked on time that its fit has not seen; not
    behind a curve of what wanders, of which what is nearly right goes with the motion.
    """
    return bool(_driven_on(channels, best, motion))


def _driven_on(channels: Sequence[Channel], best: Model, motion: Motion) -> list[int]:
    """The channels where it does."""
    result = []
    for channel, walk in walks_of(channels, best):
        picks = best.fits[channel.nominal.channel].picks
        if any(name != WALK and all_effects()[name].bent for name, _ in picks):
            continue
        own = motion.felt_by(channel.nominal.channel)
        walk, history = walk[:ASKED], own.history[:ASKED]
        # What is slow, a walk and the history share by chance.
        table = without_slow(np.concatenate([history, walk[:, None]], axis=1), FAST)
        columns = tuple(range(1, table.shape[1]))
        term = Term("history", columns, stiff=channel.sigma**2)
        told_by = Group((), list(table[:, :-1].T))
        errors, _ = Design(Base(table[:, -1:].T), {"history": told_by}).fit([term])
        noise = len(walk) * channel.sigma**2
        told = float((table[:, -1] ** 2).sum() - errors.sum())
        if told > DRIVEN * float((table[:, -1] ** 2).sum() - noise) and told > noise:
            result.append(channel.nominal.channel)
    return result
