"""Whether what a model takes for a random walk is one, and whether the strain was as recorded.

A walk follows whatever is slow, so that a search finds one in all that no equation says well; and
a specimen that slips in its clamp leaves on every channel what looks like a drift of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose import variance
from softsense.diagnose.channel import MOTION, WALK, Channel
from softsense.diagnose.design import Design, Term
from softsense.diagnose.nominal import Motion, history_basis
from softsense.diagnose.search import Model, by_price, priced
from softsense.diagnose.walk import innovations, without_slow
from softsense.effects import all_effects

Floats = NDArray[np.float64]

# Where an effect alone leaves so much of the gap, something is there besides, or in its place.
REMAINING_ALONE = 0.06
# Independent walks' innovations of two channels have a larger chi-squared once in 120 cases.
ALIKE = 7.0
# Share of what a walk does within ``FAST`` samples that the history of the motion may tell.
DRIVEN = 0.5
FAST = 100
# What one strain for all, of this many seconds a knot, must leave of what the effects leave.
SLIPPED_LEAVES = 0.5
SLIPPED_KNOT_S = 1.0
SLIPPED_CHANNELS = 3
# Newton's steps to it, and a share of the strain's range over which a sensor is nearly straight.
SLIPPED_STEPS = 4
STRAIGHT = 0.005


def vetted(
    channels: Sequence[Channel], models: Sequence[Model], motion: Motion
) -> tuple[list[Model], bool]:
    """``models`` without the walks that are none, the cheapest first; and whether what that one
    takes for a walk goes in jumps or bumps."""
    named = [made for made in models if WALK not in made.names]
    if WALK in models[0].names and len(models[0].names) > 1:
        models = by_price([_calm(channels, models[0]), *named])
    jerky = _jerky(channels, models[0])
    beside = len(models[0].names) > 1
    if (
        (beside and (jerky or _alike(channels, models[0])))
        or _driven(channels, models[0], motion)
        or (jerky and left_share(channels, named[0]) < REMAINING_ALONE)
    ):
        # What another effect leaves over, its form being only nearly right, is no walk: it is alike
        # on all its channels. Nor is one what goes in jumps that an effect can say.
        models, jerky = named, False
    best = models[0]
    kept = [
        made
        for made in models
        if made.names != {WALK}
        or made is best
        or not (_jerky(channels, made) or _driven(channels, made, motion))
    ]
    return kept, jerky


def slipped(channels: Sequence[Channel], best: Model) -> bool:
    """Whether the specimen was strained otherwise than recorded: a strain that goes its own way,
    the same for all channels, says the gap far better than the effects of ``best``.

    It is a spline of time, which has no equation: whatever it is, it is none of the catalogue. Play
    and delays are such a strain too, and a step may be a slip at one instant.
    """
    stages = {all_effects()[name].stage for name in best.names - {WALK}}
    if len(channels) < SLIPPED_CHANNELS or best.names == {"step"} or MOTION in stages:
        return False
    samples = len(channels[0].residual)
    left = sum(c.left(fit) for c, fit in zip(channels, best.fits, strict=True))
    left *= samples / channels[0].samples
    each = max(round(SLIPPED_KNOT_S / channels[0].nominal.dt_s), 1)
    knots = -(-samples // each)
    # As many weights gain so much by chance, and lose it on time that they have not seen.
    least = 2.0 * knots
    if SLIPPED_LEAVES * left < least:
        return False
    at = np.arange(samples)
    away = np.zeros(samples)
    for _ in range(SLIPPED_STEPS):
        power, pull = np.zeros(samples), np.zeros(samples)
        for channel in channels:
            slope, rest = _strained(channel, away)
            power += (slope / channel.sigma) ** 2
            pull += slope * rest / channel.sigma**2
        starts = np.arange(0, samples, each)
        middles = np.minimum(starts + 0.5 * (each - 1), samples - 1)
        steps = np.add.reduceat(pull, starts) / (np.add.reduceat(power, starts) + power.mean())
        away += np.interp(at, middles, steps)
    squares = sum(float((_strained(c, away)[1] ** 2).sum()) / c.sigma**2 for c in channels)
    return squares - len(channels) * samples + least < SLIPPED_LEAVES * left


def _strained(channel: Channel, away: Floats) -> tuple[Floats, Floats]:
    """(samples,) by how much a channel changes with a strain that is so far ``away``, and what that
    strain leaves of its residual."""
    nominal, whole = channel.nominal, slice(None)
    below, above = (
        nominal.respond(nominal.strain + away + sign * STRAIGHT, whole) for sign in (-1.0, 1.0)
    )
    rest = channel.residual - (0.5 * (below + above) - nominal.u)
    return (above - below) / (2.0 * STRAIGHT), rest


def left_share(channels: Sequence[Channel], best: Model) -> float:
    """Share of the gap beyond the noise that the model leaves on time that it has not seen."""
    left = sum(
        (float(fit.errors.sum()) - channel.samples * channel.noise) / channel.sigma**2
        for channel, fit in zip(channels, best.fits, strict=True)
    )
    return float(np.clip(left / max(sum(c.excess for c in channels), 1.0), 0.0, 1.0))


def walks_of(channels: Sequence[Channel], best: Model) -> list[tuple[Channel, Floats]]:
    """Channels on which the model sees a walk, and (samples,) what wanders there."""
    found = []
    for number in best.channels_of(WALK):
        channel = channels[number]
        found.append((channel, channel.residual - channel.predicted(best.fits[number])))
    return found


def _alike(channels: Sequence[Channel], best: Model) -> bool:
    """Whether what the walks' past does not foresee goes together on several channels.

    Correlations of two series that are white and independent have the variance 1 / samples.
    """
    walks = walks_of(channels, best)
    if len(walks) < 2:
        return False
    news = np.stack([innovations(walk[:, None], channel.gain)[:, 0] for channel, walk in walks])
    if any(all_effects()[name].stage == MOTION for name in best.names - {WALK}):
        # A clock that is late now more, now less shows on all of them, but only where they move.
        speed = np.abs(np.gradient(channels[0].nominal.strain))
        news = news[:, speed <= np.median(speed)]
    together = np.asarray(np.corrcoef(news))[np.triu_indices(len(news), 1)]
    return bool(np.mean(together**2) * news.shape[1] > ALIKE)


def _jerky(channels: Sequence[Channel], best: Model) -> bool:
    """Whether what the model takes for a walk goes in jumps or bumps on any channel."""
    return any(variance.jerky(walk, channel.gain) for channel, walk in walks_of(channels, best))


def _calm(channels: Sequence[Channel], made: Model) -> Model:
    """The same without a walk on those of several channels where it goes in jumps or bumps: there
    it is what another effect leaves."""
    fits = list(made.fits)
    for number, (channel, walk) in zip(
        made.channels_of(WALK), walks_of(channels, made), strict=True
    ):
        if variance.jerky(walk, channel.gain):
            fits[number] = channel.within(made.names - {WALK})
    calm = priced(channels, tuple(fits))
    return calm if WALK in calm.names else made


def _driven(channels: Sequence[Channel], best: Model, motion: Motion) -> bool:
    """Whether the history of the motion tells what the model takes for a walk, on any channel.

    The history is a black box (``history_basis``), asked on time that its fit has not seen.
    """
    for channel, walk in walks_of(channels, best):
        history = history_basis(motion.strain, motion.dt_s)
        # What is slow, a walk and the history share by chance.
        table = without_slow(np.concatenate([history, walk[:, None]], axis=1), FAST)
        columns = tuple(range(1, table.shape[1]))
        term = Term("history", columns, stiff=channel.sigma**2)
        errors, _ = Design(table[:, -1:].T, {"history": table[:, :-1].T}).fit([term])
        noise = len(walk) * channel.sigma**2
        told = float((table[:, -1] ** 2).sum() - errors.sum())
        if told > DRIVEN * float((table[:, -1] ** 2).sum() - noise) and told > noise:
            return True
    return False
