"""What moves the strain: one clock and one drive, and so the same on every channel.

On one channel alone a delay that is a little off makes room for a lag, and play for hysteresis; all
channels together know it closely. Its candidate is chosen for all of them at once, and its
parameters are then fitted to all (Gauss-Newton with damping and numerical derivatives), beside what
other effects do on each channel. One that comes and goes in time is known by what a change of it
would gain at every sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.channel import Channel
from softsense.diagnose.cores import all_at_once
from softsense.diagnose.design import Entry, Fit, Key, Pick
from softsense.diagnose.periods import courses
from softsense.diagnose.pricing import LAG
from softsense.effects import Fine, Nominal, Recurring, all_effects
from softsense.effects.operators import low_pass

Floats = NDArray[np.float64]
# Parameters of one effect, and of each.
Own = Mapping[str, float]
Values = Mapping[str, Own]
Forms = Mapping[str, str]
# (channels, searched samples) of what others leave, in noise sizes.
Left = Callable[[Values, Forms], Floats]

# One strain says nothing of fewer channels, nor of a smaller gap.
LEAST_CHANNELS = 3
LEAST_GAP = 2.0
# No fit leaves less of a noise variance.
LEAST_LEFT = 0.1
# Newton's steps to any strain, a share of its range over which a sensor is nearly straight, and of
# the usual power of what a strain does where it does little.
NEWTON_STEPS = 6
STRAIGHT = 0.005
LITTLE = 0.02
STEPS = 20
# What comes and goes in time says so much of what one that is free at every sample would, and more
# than so many variances of the noise; it is looked for again so often, around what was found.
RECURS = 0.3
LEAST_RECURRING = 100.0
AGAIN = 2
# A step that gains less of the cost is the last, where it is a whole one; and one that fails where
# it is this short.
LEAST_GAIN = 1e-3
WELL_DAMPED = 0.03
MOST_DAMPED = 1e3


@dataclass(frozen=True)
class Together:
    """What one strain for all channels, other than the recorded one, leaves of a ``gap``: both in
    squares per sample of one channel, in noise variances beyond the noise."""

    left: float
    gap: float


def together(
    nominals: Sequence[Nominal], residual: Floats, sigma: Floats, counted: NDArray[np.intp]
) -> Together:
    """Of a ``residual`` (samples, channels) with noise ``sigma`` (channels,), of the samples
    ``counted``.

    The strain is free at every sample and has no equation (Newton's method). Channels differ in how
    they answer a strain, so that nothing but what moves it leaves little: what a material or a
    circuit does is seldom within a tenth of the gap.
    """
    samples, channels = residual.shape
    gap = float(((residual[counted] / sigma) ** 2).mean(axis=0).sum()) - channels
    if channels < LEAST_CHANNELS or gap < LEAST_GAP or any(nominals[0].reference.own):
        return Together(np.inf, gap)
    away, squares = np.zeros(samples), np.zeros(samples)
    for _ in range(NEWTON_STEPS):
        power, pull, squares = np.zeros(samples), np.zeros(samples), np.zeros(samples)
        around = all_at_once(partial(_around, away=away), nominals)
        for nominal, own, noise, (below, above) in zip(
            nominals, residual.T, sigma, around, strict=True
        ):
            slope = (above - below) / (2.0 * STRAIGHT * noise)
            rest = (own - (0.5 * (below + above) - nominal.u)) / noise
            power += slope**2
            pull += slope * rest
            squares += rest**2
        away += pull / (power + LITTLE * power.mean())
    # Each sample's strain takes one channel's noise with it.
    return Together(float(squares[counted].mean()) - (channels - 1), gap)


def answer(nominal: Nominal) -> Floats:
    """(samples,) by how much a channel changes with a little more strain."""
    below, above = _around(nominal, np.zeros(1))
    return (above - below) / (2.0 * STRAIGHT)


def _around(nominal: Nominal, away: Floats) -> list[Floats]:
    """(samples,) of a channel at a little less and a little more than a strain so far ``away``."""
    strain = nominal.strain + away
    return [nominal.respond(strain + way * STRAIGHT, slice(None)) for way in (-1.0, 1.0)]


def chosen(
    channels: Sequence[Channel], fits: Sequence[Fit], held: Mapping[str, Key], name: str
) -> Key | None:
    """The candidate of an effect of the motion that says most on all channels together, beside the
    others that ``fits`` have and those ``held``; none where no channel has any."""
    return next(iter(_by_likelihood(channels, fits, held, name)), None)


def forms(channels: Sequence[Channel], fits: Sequence[Fit], name: str) -> list[Key]:
    """The same of every form beside ``fits``, the most likely first."""
    best: dict[str, Key] = {}
    asked = next((channel for channel in channels if channel.entries), None)
    for key in _by_likelihood(channels, fits, {}, name):
        assert asked is not None
        number = asked.numbers(name)[key]
        best.setdefault(asked.entries[name][number].candidate.form, key)
    return list(best.values())


def _by_likelihood(
    channels: Sequence[Channel], fits: Sequence[Fit], held: Mapping[str, Key], name: str
) -> list[Key]:
    """Candidates of an effect of the motion, the most likely first, where each channel is off by a
    variance of its own: those that it says well know it best, and something else may be on the
    others."""
    total: dict[Key, float] = {}
    for first, (channel, fit) in enumerate(_asked(channels, fits)):
        others = {n: k for n, k in fit.picks if n not in held} | dict(picks_of(channel, held))
        others.pop(name, None)
        static = fit.static_columns
        # Of a nearly exact fit rounding may leave less than nothing.
        each = channel.left_by_each(tuple(others.items()), static, name)
        left = np.log(np.maximum(each, LEAST_LEFT))
        own = {key: float(left[number]) for key, number in channel.numbers(name).items()}
        total = {k: own[k] + total.get(k, 0.0) for k in own if not first or k in total}
    return sorted(total, key=lambda key: total[key])


def picks_of(channel: Channel, held: Mapping[str, Key]) -> tuple[Pick, ...]:
    """The picks on a channel of what is ``held`` on all; none where no effect can pay."""
    there = channel.entries.keys() & held.keys()
    return tuple((name, channel.numbers(name)[held[name]]) for name in sorted(there))


def _asked(channels: Sequence[Channel], fits: Sequence[Fit]) -> list[tuple[Channel, Fit]]:
    """Those where an effect may pay."""
    return [both for both in zip(channels, fits, strict=True) if both[0].entries]


def refined(
    channels: Sequence[Channel], fits: Sequence[Fit], stage: int
) -> list[dict[str, Entry]] | None:
    """Of each channel, the entries of what moves the strain in ``fits``, with the parameters that
    leave least on all channels; None where there is nothing to refine.

    ``stage``: 0, or which of the parameters besides that such an effect may have.
    """
    active = [both for both in zip(channels, fits, strict=True) if both[0].held(both[1])]
    entries = active[0][0].motion_of(active[0][1]) if active else {}
    fine = {n: f for n in entries if (f := all_effects()[n].fine) is not None}
    if not fine or len(fine) < len(entries):
        return None
    further = {name: fine[name].more[stage - 1] if stage else () for name in entries}
    if stage and not any(further.values()):
        return None
    begun = {
        name: dict.fromkeys(further[name], 0.0) | dict(entry.candidate.values)
        for name, entry in entries.items()
    }
    # What there is besides goes around what is known already.
    free = [
        (name, key)
        for name, given in begun.items()
        for key in (further[name] or given)
        if key in fine[name].steps
    ]
    if not free:
        return None
    forms: Forms = {name: entry.candidate.form for name, entry in entries.items()}
    left = _left_by(active)
    values = _fitted(left, begun, free, forms, fine)
    if stage == 1:
        values, forms = _recurring(left, active[0][0], values, forms, fine)
    return [_entries(channel, channel.nominal, values, forms) for channel in channels]


def _left_by(active: Sequence[tuple[Channel, Fit]]) -> Left:
    """What effects of the motion leave of what the others do."""
    rests = np.stack([c.left_by(fit, set(fit.picks) - set(c.held(fit))) for c, fit in active])
    sigmas = np.array([[channel.sigma] for channel, _ in active])
    # A clock and a circuit do nearly the same: what both may do is left to the circuit.
    circuits = np.stack([_slower(channel, fit) for channel, fit in active])

    def left(values: Values, forms: Forms) -> Floats:
        rest: Floats = (rests - _changes(active, values, forms)) / sigmas
        rest -= circuits * (circuits * rest).sum(axis=1, keepdims=True)
        return rest

    return left


def own_values(
    channels: Sequence[Channel], fits: Sequence[Fit], name: str, key: str
) -> list[float]:
    """The value of an effect of the motion that each channel on which it is would have for itself,
    where ``fits`` have one for all: one step of Newton's."""
    active = [
        both for both in zip(channels, fits, strict=True) if name in both[0].motion_of(both[1])
    ]
    channel, fit = active[0]
    candidate, fine = channel.motion_of(fit)[name].candidate, all_effects()[name].fine
    assert fine is not None
    begun, step, forms = dict(candidate.values), fine.steps[key], {name: candidate.form}
    left = _left_by(active)
    now = left({name: begun}, forms)
    slopes = (now - left({name: {**begun, key: begun[key] + step}}, forms)) / step
    more = (slopes * now).sum(axis=1) / np.maximum((slopes**2).sum(axis=1), 1e-12)
    own: list[float] = (begun[key] + more).tolist()
    return own


def with_values(
    channel: Channel, fit: Fit, name: str, change: Callable[[Own], Own]
) -> dict[str, Entry]:
    """The entries of what moves the strain in ``fit``, with a ``change`` to the values of one such
    effect; none where it is not there."""
    entries = channel.motion_of(fit)
    if name not in entries:
        return {}
    values = {n: dict(entry.candidate.values) for n, entry in entries.items()}
    values[name] = dict(change(values[name]))
    forms = {n: entry.candidate.form for n, entry in entries.items()}
    return _entries(channel, channel.nominal, values, forms)


def _slower(channel: Channel, fit: Fit) -> Floats:
    """(searched samples,) of norm 1: what a lag that ``fit`` has would do with a little longer time
    constant; 0 where there is none."""
    number = dict(fit.picks).get(LAG)
    if number is None:
        return np.zeros(channel.samples)
    read = (channel.nominal.u + channel.predicted(fit))[:, None]
    tau_s = channel.entries[LAG][number].candidate.values["tau_s"]
    slow, _ = low_pass(read, channel.nominal.dt_s, np.array([tau_s]), None)
    more = channel.searched((slow - read)[:, 0])
    slower: Floats = more / max(float(np.linalg.norm(more)), 1e-12)
    return slower


def _weights(left: Floats) -> Floats:
    """(channels, 1) where each channel is off by a variance of its own: those that are said well
    know it best."""
    weights: Floats = 1.0 / np.maximum((left**2).mean(axis=1, keepdims=True), 1.0)
    return weights


def _recurring(
    left: Left, channel: Channel, values: Values, forms: Forms, fine: Mapping[str, Fine]
) -> tuple[Values, Forms]:
    """``values`` and ``forms``, or such with a value that comes and goes in time, where that leaves
    less."""

    def offered(
        name: str, values: Values, forms: Forms, of: Sequence[str] | None = None
    ) -> list[tuple[Values, Forms]]:
        given = fine[name].recurring
        if given is None:
            return []
        step = fine[name].steps[given.key]
        now = left(values, forms)
        there = {**values, name: {**values[name], given.key: values[name][given.key] + step}}
        slope, weights = (now - left(there, forms)) / step, _weights(now)
        pull, power = (weights * slope * now).sum(axis=0), (weights * slope**2).sum(axis=0)
        if of is not None:
            given = replace(given, waves={form: given.waves[form] for form in of})
        nominal = channel.thinned(channel.nominal)
        made = _comes_and_goes(given, nominal, values[name], forms[name], pull, power)
        return [({**values, name: own}, {**forms, name: form}) for form, own in made]

    def cost(values: Values, forms: Forms) -> float:
        return float(np.log(np.maximum((left(values, forms) ** 2).mean(axis=1), LEAST_LEFT)).sum())

    best = values, forms
    for name in values:
        for made in offered(name, values, forms):
            for _ in range(AGAIN):
                again = offered(name, *made, of=[made[1][name]])
                made = min([made, *again], key=lambda one: cost(*one))
            keys = [(name, key) for key in made[0][name] if key in fine[name].steps]
            fitted = _fitted(left, made[0], keys, made[1], fine), made[1]
            best = min([best, fitted], key=lambda one: cost(*one))
    return best


def _comes_and_goes(
    given: Recurring,
    nominal: Nominal,
    values: Mapping[str, float],
    form: str,
    pull: Floats,
    power: Floats,
) -> list[tuple[str, dict[str, float]]]:
    """Forms and values with a ``given`` one that comes and goes in time, and says much of what
    ``values`` leave.

    ``pull`` and ``power`` (kept samples,): what a small change p of the given value gains there is
    2 p pull - p^2 power.
    """
    step_s = nominal.dt_s * (nominal.keep.step or 1)
    time_s = nominal.start_s - nominal.reference.start_s + step_s * np.arange(float(len(pull)))
    # What any value at every sample would gain, beyond chance.
    most = float(np.sum(pull**2 / np.maximum(power, 1e-9 * power.max()))) - len(pull)
    pull = pull + power * given.course(nominal, values, form)
    forms, result = {shape: form for form, shape in given.waves.items()}, []
    for course in courses(time_s, pull, power, max(RECURS * most, LEAST_RECURRING), forms):
        made = {given.key: course.begin, given.pace: course.pace, given.swing: course.swing}
        made |= {"period_s": course.period_s, "phase": course.phase}
        result.append((forms[course.shape], made))
    return result


def _fitted(
    left_of: Left,
    begun: Values,
    keys: Sequence[tuple[str, str]],
    forms: Forms,
    fine: Mapping[str, Fine],
) -> Values:
    """``begun`` with the values of ``keys`` that leave least of what other effects leave."""
    sizes = np.array([fine[name].steps[key] for name, key in keys])

    def values(theta: Floats) -> Values:
        made = {name: dict(given) for name, given in begun.items()}
        for (name, key), value in zip(keys, theta.tolist(), strict=True):
            made[name][key] = value
        return made

    def left(theta: Floats) -> Floats:
        return left_of(values(theta), forms)

    theta = np.array([begun[name][key] for name, key in keys])
    now, damping, moved = left(theta), 1e-3, True
    slopes = np.empty((len(theta), now.size))
    for _ in range(STEPS):
        if moved:
            weights = _weights(now)
            for k, size in enumerate(sizes):
                there = theta.copy()
                there[k] += size
                slopes[k] = ((left(there) - now) * np.sqrt(weights)).ravel()
            products, side = slopes @ slopes.T, slopes @ (now * np.sqrt(weights)).ravel()
        gram = products.copy()
        gram[np.diag_indices_from(gram)] *= 1.0 + damping
        gram[np.diag_indices_from(gram)] += 1e-9 * np.trace(gram) + 1e-12
        trial = theta - sizes * np.linalg.solve(gram, side)
        then = left(trial)
        cost = float((weights * now**2).sum())
        gained = cost - float((weights * then**2).sum())
        moved = gained > 0.0
        if moved:
            theta, now = trial, then
            if damping < WELL_DAMPED and gained < LEAST_GAIN * cost:
                break
        elif damping > MOST_DAMPED:
            break
        damping = damping / 4.0 if moved else 5.0 * damping
    return values(theta)


def _changes(active: Sequence[tuple[Channel, Fit]], values: Values, forms: Forms) -> Floats:
    """(channels, searched samples) what effects of the motion change on each channel."""
    channels = [channel for channel, _ in active]
    (name, given), *others = values.items()
    first = channels[0].nominal
    _, candidate = channels[0].between(first, name, given, forms[name])
    # What is thinned for the search is not what a second effect acts on.
    whole = not others or channels[0].samples == len(first.strain)
    if candidate.by_strain and candidate.moved is not None and whole:
        # One strain, and what all say of it at once.
        strain = candidate.moved()
        said = channels[0].said_by_all(strain)
        changes = np.stack([channel.changed_by(said) for channel in channels])
        for channel, change in zip(channels, changes, strict=True) if others else ():
            nominal = channel.nominal.acting_on(channel.nominal.u + change, lambda: strain)
            change += _change(_entries(channel, nominal, dict(others), forms))
        return changes
    return np.stack([_change(_entries(c, c.nominal, values, forms)) for c in channels])


def _change(entries: Mapping[str, Entry]) -> Floats:
    """(searched samples,) what all of ``entries`` change."""
    change: Floats = np.sum([entry.columns[:, 0] for entry in entries.values()], axis=0)
    return change


def _entries(channel: Channel, nominal: Nominal, values: Values, forms: Forms) -> dict[str, Entry]:
    """The entries of effects of the motion upon a ``nominal`` signal of the channel, each acting on
    what the one before has done."""
    result: dict[str, Entry] = {}
    now, done = nominal, np.zeros(len(nominal.u))
    for name in values:
        entry = channel.fine(now, name, values[name], forms[name])
        result[name] = replace(entry, nominal=now)
        if len(result) < len(values):
            done += channel.whole(name, result[name])[:, 0]
            now = nominal.acting_on(nominal.u + done, entry.candidate.moved)
    return result
