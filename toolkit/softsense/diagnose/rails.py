"""A converter's curve that has the shape of a rail, which is told apart by what it looks like.

Where an amplifier runs into its rail softly, no equation of a limiter may say that as well as a
free curve does, and then a converter's curve costs less. But a converter is off over all of its
range, and not only above some level of each channel's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from softsense.diagnose.channel import CURVE, Channel
from softsense.diagnose.design import Fit
from softsense.diagnose.pricing import RAIL, WALK
from softsense.diagnose.search import Model
from softsense.effects import AS_CURVE, altered
from softsense.effects.saturation import is_rail


def railed(channels: Sequence[Channel], models: Sequence[Model]) -> list[Model]:
    """``models``, first the best one with its converter's curve taken for saturation, if that has
    the shape of a rail on every channel where it is named."""
    best = models[0]
    # What wanders is not seen against the codes that it moves.
    if CURVE not in best.names or best.names & {RAIL, WALK}:
        return list(models)
    fits = []
    for channel, fit in zip(channels, best.fits, strict=True):
        made = _railed(channel, fit) if CURVE in dict(fit.picks) else fit
        if made is None:
            return list(models)
        fits.append(made)
    names = best.names - {CURVE} | {RAIL}
    named = replace(best, names=names, fits=tuple(fits))
    return [named, *(made for made in models if made.names != names)]


def _railed(channel: Channel, fit: Fit) -> Fit | None:
    """A fit with its converter's curve named as a rail, or None where it is none."""
    picks = []
    for (name, number), weights in channel.weighted(fit):
        if name == CURVE:
            entry = channel.entries[name][number]
            u = channel.searched((entry.nominal or channel.nominal).u)
            if RAIL not in channel.entries or not is_rail(u, entry.said(weights)):
                return None
            near = {AS_CURVE: 1.0}
            candidate = altered(entry.candidate, values=near)
            channel.entries[RAIL].append(altered(entry, candidate=candidate, near=near))
            name, number = RAIL, len(channel.entries[RAIL]) - 1
        picks.append((name, number))
    return replace(fit, picks=tuple(picks))
