"""Backlash: the drive has play before it takes the sensor along."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np

from softsense.effects import (
    Candidate,
    Context,
    Effect,
    Fine,
    Floats,
    Nominal,
    Parameter,
    State,
    Values,
)
from softsense.effects.operators import compiled, play, uneven_play

# How many times as wide worn play is at its widest as at its least.
WORN = (0.5, 0.7, 1.4, 2.0)
# The same where it works most, around such a part of the range, and how far that reaches.
CENTRES = (0.25, 0.5, 0.75)
AROUND, MUCH_AROUND = 1.45, 1.85
REACH = 0.25
# What a spring beside the play passes on of every move.
BESIDE = (0.1, 0.2, 0.3)
# Slack at rest, in widths of the play behind it.
SLACK = (0.25, 0.5, 1.0)
# Poses of the range about which nothing is passed on, and how many widths are tried there.
POSES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
WIDTHS_THERE = 7
# To which face the drive goes at its zero, in halves of the play.
ZEROED = (-1.0, -0.3, 0.3, 1.0)
# How long faces that give way take.
CLOSING_S = (0.04, 0.08, 0.15)
# How long a carriage rolls on.
ROLLS_S = (0.1, 0.3, 1.5, 10.0)
# How long a spring takes to bring the drive back to the middle of its play.
CENTRED_S = (8.0, 22.0, 60.0)
# How gradually elastic ones take hold, as shares of the width.
SOFTNESSES = (0.1, 0.18, 0.3)
# How suddenly a drive that gives way takes hold: 0 is play, 1 is Dahl's friction in its middle.
POWERS = (0.3, 0.7, 1.5)
# How late a drive that creeps along passes moves on.
LATE = (1.5, 2.5, 4.0)
# What is left of the play once a drive that stuck is moving.
MOVING = (0.35, 0.6, 0.85)
# Where a drive is none of these: the logarithm of how many times as wide it is at even places of
# the range, straight in between, and at most; and which part of a move goes through plays so many
# times as wide.
PLACES = tuple(f"place{k}" for k in range(25))
UNEVEN = 2.0
OTHERS = (0.06, 0.15, 0.3, 0.5, 0.75, 1.4, 2.0, 3.0)
PARTLY = tuple(f"part{k}" for k in range(len(OTHERS)))
FREELY = (*PLACES, *PARTLY)
# Of a move from one sample to the next.
PARTS = 4
# How many times its softness from a face a move is not passed on.
FREE = 12.0


def simulate(
    x: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """play_w(x), starting in touch in the middle of its play, or max(x - d, 0)."""
    if form == "dead_zone":
        return np.maximum(x - values["width"], 0.0), {}
    memory = x[0].copy() if state is None else state["memory"].copy()
    moved: Floats = play(x, np.ascontiguousarray(values["width"]), memory)
    return moved, {"memory": memory}


def explain(nominal: Nominal) -> list[Candidate]:
    """What the channel says of the played strain less what it says of the strain, weight 1; or
    behind slack, at rest or about a pose."""
    return [
        *_traces(nominal, np.geomspace(0.004, 0.3, 22)),
        *_dead(nominal, np.geomspace(0.01, 0.3, 10)),
        *_formed(nominal, "pose", np.geomspace(0.01, 0.3, WIDTHS_THERE), POSES),
    ]


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one width, beside a spring, behind slack or with faces that give way; or a
    width that is not the same everywhere, or not for long. Around one of those, closer."""
    width = values["width"]
    plain = _traces(nominal, width * np.geomspace(0.8, 1.25, 15))
    for key in sorted(_FORMS.keys() & values.keys()):
        close, around = np.geomspace(0.92, 1.09, 5), np.geomspace(0.75, 1.33, 7)
        return plain + _formed(nominal, key, width * close, values[key] * around)
    made = plain + _dead(nominal, width * np.geomspace(0.8, 1.25, 5))
    for key, (_, _, others, widths) in _FORMS.items():
        made += _formed(nominal, key, width * widths, others)
    return made


def at(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """Just this play; of any form its zero may be off the middle, and it may be uneven and part of
    it another."""
    width = float(np.clip(values["width"], LEAST, WIDEST))
    if PLACES[0] in values:
        base = {key: value for key, value in values.items() if key not in FREELY}
        played = at(nominal, base)[0].moved
        assert played is not None
        moved = partial(_freely, nominal, played, width, dict(values))
        return [_trace(nominal, moved, {**values, "width": width}, "free", pliable=True)]
    for key in sorted((_FORMS.keys() - {ZEROED_BY}) & values.keys()):
        other = values[key] if key in ANY_SIGN else max(values[key], LEAST)
        if ZEROED_BY not in values:
            return _formed(nominal, key, np.array([width]), [other])
        form, moved_by, *_ = _FORMS[key]
        off = 0.5 * values[ZEROED_BY] * width
        moved = partial(_shifted, partial(moved_by, nominal, width, other), off)
        return [_trace(nominal, moved, {**values, "width": width, key: other}, form)]
    if ZEROED_BY in values:
        return _formed(nominal, ZEROED_BY, np.array([width]), [values[ZEROED_BY]])
    return _traces(nominal, np.array([width])) + _dead(nominal, np.array([width]))


def _traces(nominal: Nominal, widths: Floats) -> list[Candidate]:
    return [
        _trace(nominal, partial(_played, nominal, width), {"width": float(width)}, "play")
        for width in widths
    ]


def _formed(nominal: Nominal, key: str, widths: Floats, others: Iterable[float]) -> list[Candidate]:
    """Play of one of ``_FORMS``, which has the parameter ``key`` beside its width."""
    form, moved_by, *_ = _FORMS[key]
    return [
        _trace(
            nominal,
            partial(moved_by, nominal, float(width), float(other)),
            {"width": float(width), key: float(other)},
            form,
        )
        for width in widths
        for other in others
    ]


def _dead(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Slack at rest that is taken up once and for all."""
    return [
        _trace(nominal, partial(_taut, nominal, width), {"width": float(width)}, "dead_zone")
        for width in widths
    ]


def _taut(nominal: Nominal, slack: float) -> Floats:
    """(samples,) the strain where so much slack is taken up first."""
    taut: Floats = np.maximum(nominal.strain - slack, 0.0)
    return taut


def _about_pose(nominal: Nominal, width: float, pose: float) -> Floats:
    """Nothing is passed on within half a width of a ``pose``, to either side (a dead zone: Tao and
    Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996)."""
    beyond = nominal.strain - pose
    moved: Floats = pose + np.sign(beyond) * np.maximum(np.abs(beyond) - 0.5 * width, 0.0)
    return moved


def _worn_in_places(nominal: Nominal, width: float, worn: float) -> Floats:
    """Play that is so many times as wide at the largest strain as at none."""
    return _played(nominal, width, np.log(worn) * (np.clip(nominal.strain, 0.0, 1.0) - 0.5))


def _worn_around(nominal: Nominal, width: float, centre: float, worn: float = AROUND) -> Floats:
    """Play that is so many times as wide where the drive works most."""
    there = np.exp(-(((nominal.strain - centre) / REACH) ** 2))
    return _played(nominal, width, np.log1p((worn - 1.0) * there))


def _worn_much_around(nominal: Nominal, width: float, centre: float) -> Floats:
    """The same, worn more."""
    return _worn_around(nominal, width, centre, MUCH_AROUND)


def _worn_with_time(nominal: Nominal, width: float, worn: float) -> Floats:
    """Play that is so many times as wide at the end as at the beginning."""
    return _played(nominal, width, np.log(worn) * (nominal.passed - 0.5))


def _freely(
    nominal: Nominal,
    played: Callable[[], Floats],
    width: float,
    values: Mapping[str, float],
) -> Floats:
    """(samples,) the strain that is ``played`` where the play is of another width in each place, as
    of a gear whose teeth are not alike, and where others share the move (Iwan 1966)."""
    at, knots = np.linspace(0.0, 1.0, len(PLACES)), np.array([values[key] for key in PLACES])
    uneven = np.clip(np.interp(nominal.strain, at, knots), -UNEVEN, UNEVEN)
    even = _played(nominal, width)
    moved: Floats = played() + _played(nominal, width, uneven) - even
    for key, share in zip(PARTLY, OTHERS, strict=True):
        if values[key]:
            moved += values[key] * (_played(nominal, share * width, uneven) - even)
    return moved


def _behind_slack(nominal: Nominal, width: float, share: float) -> Floats:
    """Play behind slack at rest, of this share of its width."""
    taut = _taut(nominal, share * width)
    played: Floats = uneven_play(taut, np.full(len(taut), width))
    return played


def _off_centre(nominal: Nominal, width: float, zeroed: float) -> Floats:
    """Play whose zero is not in its middle: a drive that was zeroed while it pulled, or let go."""
    moved: Floats = _played(nominal, width) + 0.5 * zeroed * width
    return moved


def _shifted(moved: Callable[[], Floats], off: float) -> Floats:
    """(samples,) the strain that is ``moved``, and so far off."""
    return moved() + off


def _beside_spring(nominal: Nominal, width: float, share: float) -> Floats:
    """Play beside a spring, which passes on this share of every move."""
    played = _played(nominal, width)
    moved: Floats = played + share * (nominal.strain - played)
    return moved


def _soft(nominal: Nominal, width: float, softness: float) -> Floats:
    """Play between elastic faces, which pass on more and more of a move where it reaches them."""
    moved: Floats = _pressing(nominal.strain, width, softness * width)
    return moved


@compiled
def _pressing(strain: Floats, width: float, softness: float) -> Floats:
    """(samples,) play that passes on 1 / (1 + exp(-over / softness)) of a move so far ``over`` half
    its width."""
    output = np.empty_like(strain)
    x = y = strain[0]
    for k in range(len(strain)):
        move = (strain[k] - x) / PARTS
        for _ in range(PARTS):
            # As it is in the middle of this part of the move.
            x += 0.5 * move
            ahead = x - y if move > 0.0 else y - x
            short = (0.5 * width - ahead) / softness
            # Most moves are far from a face.
            if short < FREE:
                y += move / (1.0 + np.exp(short))
            x += 0.5 * move
        output[k] = y
    return output


def _compliant(nominal: Nominal, width: float, power: float) -> Floats:
    """A drive with friction that gives way before it slips (Dahl 1976)."""
    moved: Floats = _giving_way(nominal.strain, width, power)
    return moved


@compiled
def _giving_way(strain: Floats, width: float, power: float) -> Floats:
    """(samples,) x - F with dF = dx ((1 - F / half) / 2)^power upwards, half the ``width``."""
    output = np.empty_like(strain)
    half, force, x = 0.5 * width, 0.0, strain[0]
    for k in range(len(strain)):
        move = (strain[k] - x) / PARTS
        for _ in range(PARTS):
            rest = 0.5 * (1.0 - force / half) if move > 0.0 else 0.5 * (1.0 + force / half)
            force = min(max(force + move * max(rest, 0.0) ** power, -half), half)
        x = strain[k]
        output[k] = x - force
    return output


def _creeping(nominal: Nominal, width: float, late: float) -> Floats:
    """A drive that slips a little before it takes hold, and never makes up for it (Dupont et al.
    2002)."""
    moved: Floats = _slipping(nominal.strain, width, late)
    return moved


@compiled
def _slipping(strain: Floats, width: float, late: float) -> Floats:
    """(samples,) y with dy = dx ((1 + z) / 2)^late upwards, where z, from -1 to 1, is how far the
    contact is bent, which takes ``width`` from one end to the other."""
    output = np.empty_like(strain)
    bent, y, x = 0.0, strain[0], strain[0]
    for k in range(len(strain)):
        move = (strain[k] - x) / PARTS
        for _ in range(PARTS):
            halfway = min(max(bent + move / width, -1.0), 1.0)
            y += move * (0.5 * (1.0 + halfway if move > 0.0 else 1.0 - halfway)) ** late
            bent = min(max(bent + 2.0 * move / width, -1.0), 1.0)
        x = strain[k]
        output[k] = y
    return output


def _stuck(nominal: Nominal, width: float, moving: float) -> Floats:
    """A drive that sticks after each reversal, and jumps on (Choudhury et al. 2005)."""
    moved: Floats = _jumping(nominal.strain, width, moving)
    return moved


@compiled
def _jumping(strain: Floats, width: float, moving: float) -> Floats:
    """(samples,) that stay until the strain has gone ``width`` from where it turned, and then
    follow it by this share of half the width."""
    output = np.empty_like(strain)
    anchor, way, y = strain[0], 0.0, strain[0]
    for k in range(len(strain)):
        x = strain[k]
        if way != 0.0 and way * (x - anchor) < 0.0:
            # It has turned.
            way = 0.0
        if way != 0.0:
            anchor = x
        elif abs(x - anchor) > width:
            way, anchor = 1.0 if x > anchor else -1.0, x
        if way != 0.0:
            y = x - way * 0.5 * moving * width
        output[k] = y
    return output


def _damped(nominal: Nominal, width: float, closing_s: float) -> Floats:
    """Play between faces that give way: what is beyond the gap is closed in on, in a while."""
    moved: Floats = _closing(nominal.strain, width, -float(np.expm1(-nominal.dt_s / closing_s)))
    return moved


@compiled
def _closing(strain: Floats, width: float, share: float) -> Floats:
    """(samples,) play that goes this ``share`` of what is beyond its gap in a sample."""
    output = np.empty_like(strain)
    y = strain[0]
    for k in range(len(strain)):
        y += share * (max(strain[k] - 0.5 * width - y, 0.0) + min(strain[k] + 0.5 * width - y, 0.0))
        output[k] = y
    return output


def _centred(nominal: Nominal, width: float, centred_s: float) -> Floats:
    """Play in which a spring slowly brings the drive back to the middle."""
    moved: Floats = _returning(nominal.strain, width, -float(np.expm1(-nominal.dt_s / centred_s)))
    return moved


@compiled
def _returning(strain: Floats, width: float, share: float) -> Floats:
    """(samples,) play of which such a ``share`` is taken up in each sample."""
    output = np.empty_like(strain)
    y = strain[0]
    for k in range(len(strain)):
        y = min(max(y, strain[k] - 0.5 * width), strain[k] + 0.5 * width)
        y += share * (strain[k] - y)
        output[k] = y
    return output


def _coasting(nominal: Nominal, width: float, rolls_s: float) -> Floats:
    """Play in which a carriage rolls on, until it meets the other face."""
    kept = float(np.exp(-nominal.dt_s / PARTS / rolls_s))
    moved: Floats = _rolling(nominal.strain, width, kept)
    return moved


@compiled
def _rolling(strain: Floats, width: float, kept: float) -> Floats:
    """(samples,) what goes on at its pace, of which so much is ``kept`` from part to part of a move
    between samples, within half the ``width`` of the strain; a face that it meets takes it along.
    """
    output = np.empty_like(strain)
    x = y = strain[0]
    pace = 0.0
    for k in range(len(strain)):
        move = (strain[k] - x) / PARTS
        for _ in range(PARTS):
            x += move
            pace *= kept
            y += pace
            held = min(max(y, x - 0.5 * width), x + 0.5 * width)
            if held != y:
                # As fast as the face, not as the jump to it.
                y, pace = held, move
        x = strain[k]
        output[k] = y
    return output


def _played(nominal: Nominal, width: float, courses: Floats | float = 0.0) -> Floats:
    """(samples,) the strain behind play of one width, times the exponential of ``courses``."""
    widths = np.broadcast_to(width * np.exp(courses), nominal.strain.shape).copy()
    played: Floats = uneven_play(nominal.strain, widths)
    return played


def _trace(
    nominal: Nominal,
    moved: Callable[[], Floats],
    values: Mapping[str, float],
    form: str,
    pliable: bool = False,
) -> Candidate:
    """What the channel says of the strain that is ``moved`` less what it says of the strain."""
    made = partial(_change, nominal, (form, *values.items()), moved)
    return Candidate(made, values, form, fixed=True, pliable=pliable, moved=moved, by_strain=True)


def _change(nominal: Nominal, name: Hashable, moved: Callable[[], Floats]) -> Floats:
    return nominal.changed(name, moved)[:, None]


ZEROED_BY = "zeroed"
ANY_SIGN = ("around", "much_around", ZEROED_BY)
# Play of more than a width, by its second parameter: what it is called, how it moves, some values,
# and widths as shares of the play that is nearest. What a spring or a soft face passes on makes
# play look narrower than it is; what is late besides, wider.
_FORMS: dict[
    str, tuple[str, Callable[[Nominal, float, float], Floats], Sequence[float], Floats]
] = {
    "worn_in_places": ("worn_in_places", _worn_in_places, WORN, np.geomspace(0.85, 1.18, 4)),
    "worn_with_time": ("worn_with_time", _worn_with_time, WORN, np.geomspace(0.85, 1.18, 4)),
    "around": ("worn_around", _worn_around, CENTRES, np.geomspace(0.7, 0.95, 4)),
    "much_around": ("worn_around", _worn_much_around, CENTRES, np.geomspace(0.6, 0.9, 4)),
    ZEROED_BY: ("off_centre", _off_centre, ZEROED, np.geomspace(0.92, 1.09, 5)),
    "beside": ("sprung", _beside_spring, BESIDE, np.geomspace(0.95, 1.4, 5)),
    "slack": ("slack", _behind_slack, SLACK, np.geomspace(0.85, 1.18, 3)),
    "softness": ("soft", _soft, SOFTNESSES, np.geomspace(0.85, 1.5, 5)),
    "power": ("compliant", _compliant, POWERS, np.geomspace(0.9, 1.8, 4)),
    "late": ("creeping", _creeping, LATE, np.geomspace(0.9, 1.8, 4)),
    "moving": ("stuck", _stuck, MOVING, np.geomspace(0.9, 1.6, 4)),
    "centred_s": ("centred", _centred, CENTRED_S, np.geomspace(0.95, 1.2, 4)),
    "rolls_s": ("coasting", _coasting, ROLLS_S, np.geomspace(0.75, 1.25, 5)),
    "closing_s": ("damped", _damped, CLOSING_S, np.geomspace(0.3, 1.1, 6)),
    "pose": ("dead_zone", _about_pose, POSES[1::2], np.geomspace(0.9, 1.15, 3)),
}

# How far each parameter is moved to see what it does; which may be below 0; and what the others are
# at least.
STEPS = {
    "width": 1e-4,
    "closing_s": 0.001,
    "rolls_s": 0.02,
    "centred_s": 0.2,
    "softness": 0.001,
    **dict.fromkeys((*ANY_SIGN, *FREELY), 0.005),
}
STEPS |= dict.fromkeys(_FORMS.keys() - STEPS.keys(), 0.005)
LEAST = 1e-3
# Of the range: what is never taken up is a gain, where a spring is beside it.
WIDEST = 0.6

EFFECT = Effect(
    name="backlash",
    stage="motion",
    mechanism="play in the drive, slip or slack: part of a move is lost after each reversal",
    equation="play: y = min(max(y, x - w/2), x + w/2); dead_zone: y = max(x - w, 0)",
    source="play operator: Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989); faces "
    "that give way: Nordin and Gutman, Automatica 38 (2002); sticking: Choudhury, Thornhill and "
    "Shah, Control Eng. Pract. 13 (2005); slipping before it holds: Dupont et al., IEEE Trans. "
    "Autom. Control 47 (2002); several at once: Iwan, J. Appl. Mech. 33 (1966)",
    fingerprint="flat after each reversal, over the same width on all channels",
    parameters=(Parameter("width", "share of range", 0.005, 0.15, 0.05, "play, or slack"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    fine=Fine(at, STEPS, ((ZEROED_BY,), (), FREELY)),
    forms=("play", "dead_zone"),
    exact=True,
)
