"""Backlash: the drive has play before it takes the sensor along."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import compiled, play, uneven_play

# How many times as wide worn play is at its widest as at its least.
WORN = (0.5, 0.7, 1.4, 2.0)
# What a spring beside the play passes on of every move.
BESIDE = (0.1, 0.2, 0.3)
# Slack at rest, in widths of the play behind it.
SLACK = (0.25, 0.5, 1.0)
# How long faces that give way take.
CLOSING_S = (0.04, 0.08, 0.15)
# How gradually elastic ones take hold, as shares of the width.
SOFTNESSES = (0.1, 0.18, 0.3)
# Of a move from one sample to the next.
PARTS = 3
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
    """What the channel says of the played strain less what it says of the strain, weight 1."""
    return _traces(nominal, np.geomspace(0.004, 0.3, 22)) + _dead(
        nominal, np.geomspace(0.01, 0.3, 10)
    )


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same around one width, beside a spring, behind slack or with faces that give way; or a
    width that is not the same everywhere, or not for long."""
    width = values["width"]
    near = width * np.geomspace(0.8, 1.25, 15)
    # What a spring passes on makes play look narrower than it is.
    wider = width * np.geomspace(0.9, 1.4, 14)
    made = _traces(nominal, near) + _dead(nominal, near[::2])
    made += _worn(nominal, near[3::4]) + _sprung(nominal, wider) + _slack(nominal, near[1::2])
    made += _soft(nominal, width * np.geomspace(0.8, 1.6, 8))
    # What is late besides makes play look wider than it is.
    return made + _damped(nominal, width * np.geomspace(0.3, 1.1, 9))


def _traces(nominal: Nominal, widths: Floats) -> list[Candidate]:
    return [
        _trace(nominal, partial(_played, nominal, width), {"width": float(width)}, "play")
        for width in widths
    ]


def _worn(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Play that is wider, or less wide, at the largest strain than at none, or at the end."""
    reference = nominal.reference
    passed = np.clip((nominal.time_s - reference.start_s) / reference.duration_s, 0.0, 1.0)
    courses = {"worn_in_places": np.clip(nominal.strain, 0.0, 1.0), "worn_with_time": passed}
    result = []
    for form, course in courses.items():
        for worn in WORN:
            wear = np.log(worn) * (course - 0.5)
            for width in widths:
                played = partial(_played, nominal, width, wear)
                values = {"width": float(width), "worn": worn}
                result.append(_trace(nominal, played, values, form))
    return result


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


def _slack(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Slack at rest, and play behind it."""
    result = []
    for width in widths:
        for share in SLACK:
            values = {"width": float(width), "slack": share}
            moved = partial(_behind_slack, nominal, width, share * width)
            result.append(_trace(nominal, moved, values, "slack"))
    return result


def _behind_slack(nominal: Nominal, width: float, slack: float) -> Floats:
    taut = _taut(nominal, slack)
    played: Floats = uneven_play(taut, np.full(len(taut), width))
    return played


def _sprung(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Play beside a spring, which passes on a part of every move."""
    result = []
    for width in widths:
        for beside in BESIDE:
            values = {"width": float(width), "beside": beside}
            moved = partial(_beside_spring, nominal, width, beside)
            result.append(_trace(nominal, moved, values, "sprung"))
    return result


def _beside_spring(nominal: Nominal, width: float, beside: float) -> Floats:
    played = _played(nominal, width)
    moved: Floats = played + beside * (nominal.strain - played)
    return moved


def _soft(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Play between elastic faces, which pass on more and more of a move where it reaches them."""
    result = []
    for width in widths:
        for softness in SOFTNESSES:
            values = {"width": float(width), "softness": softness}
            moved = partial(_pressing, nominal.strain, float(width), softness * float(width))
            result.append(_trace(nominal, moved, values, "soft"))
    return result


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


def _damped(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Play between faces that give way: what is beyond the gap is closed in on, in a while."""
    result = []
    for closing_s in CLOSING_S:
        share = -float(np.expm1(-nominal.dt_s / closing_s))
        for width in widths:
            values = {"width": float(width), "closing_s": closing_s}
            moved = partial(_closing, nominal.strain, float(width), share)
            result.append(_trace(nominal, moved, values, "damped"))
    return result


@compiled
def _closing(strain: Floats, width: float, share: float) -> Floats:
    """(samples,) play that goes this ``share`` of what is beyond its gap in a sample."""
    output = np.empty_like(strain)
    y = strain[0]
    for k in range(len(strain)):
        y += share * (max(strain[k] - 0.5 * width - y, 0.0) + min(strain[k] + 0.5 * width - y, 0.0))
        output[k] = y
    return output


def _played(nominal: Nominal, width: float, courses: Floats | float = 0.0) -> Floats:
    """(samples,) the strain behind play of one width, times the exponential of ``courses``."""
    widths = np.broadcast_to(width * np.exp(courses), nominal.strain.shape).copy()
    played: Floats = uneven_play(nominal.strain, widths)
    return played


def _trace(
    nominal: Nominal, moved: Callable[[], Floats], values: Mapping[str, float], form: str
) -> Candidate:
    """What the channel says of the strain that is ``moved`` less what it says of the strain."""
    column = nominal.respond(moved(), nominal.keep) - nominal.respond(nominal.strain, nominal.keep)
    return Candidate(column[:, None], values, form, fixed=True, moved=moved)


EFFECT = Effect(
    name="backlash",
    stage="motion",
    mechanism="play in the drive, slip or slack: part of a move is lost after each reversal",
    equation="play: y = min(max(y, x - w/2), x + w/2); dead_zone: y = max(x - w, 0)",
    source="play operator: Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989); faces "
    "that give way: Nordin and Gutman, Automatica 38 (2002)",
    fingerprint="flat after each reversal, over the same width on all channels",
    parameters=(Parameter("width", "share of range", 0.005, 0.15, 0.05, "play, or slack"),),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("play", "dead_zone"),
    exact=True,
)
