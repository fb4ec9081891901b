"""Temperature: the resistance follows the room, or the heat of its own current."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import low_pass

_REFERENCE_C = 25.0


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + (alpha dT + beta dT^2) (1 + b u)."""
    samples, channels = u.shape
    if form == "self_heating":
        # At constant voltage the power falls as the resistance, here taken as 1 + u, rises.
        power = values["rise_k"] / np.maximum(1.0 + u, 0.1)
        cold = np.zeros(channels)
        before = None if state is None else state["memory"]
        heat, memory = low_pass(power, context.dt_s, values["wander_s"], before, rest=cold)
        after: State = {"memory": memory}
    elif context.temp_c is not None:
        heat = np.broadcast_to((context.temp_c - _REFERENCE_C)[:, None], u.shape)
        after = {}
    else:
        # Nobody logged it: a room that wanders, the same for every channel.
        rng = context.generator(state)
        keep = float(np.exp(-context.dt_s / values["wander_s"][0]))
        size = float(values["wander_k"][0])
        last = size * rng.standard_normal() if state is None else state["room_k"]
        steps = size * np.sqrt(1.0 - keep**2) * rng.standard_normal(samples)
        room = lfilter([1.0], [1.0, -keep], steps, zi=[keep * last])[0]
        heat = np.broadcast_to(room[:, None], u.shape)
        after = {"rng": rng.bit_generator.state, "room_k": float(room[-1])}
    change = values["alpha"] * heat + values["beta"] * heat**2
    return u + change * (1.0 + values["by_signal"] * u), after


def explain(nominal: Nominal) -> list[Candidate]:
    """In proportion to the logged temperature, alone and times the signal; none without a log."""
    if nominal.temp_c is None or np.ptp(nominal.temp_c) == 0:
        return []
    # In tens of kelvin from room temperature.
    warm = (nominal.temp_c - 25.0) / 10.0 * nominal.span
    columns = np.stack([warm, warm * nominal.share], axis=1)
    return [Candidate(columns[:, :1], {}), Candidate(columns, {})]


EFFECT = Effect(
    name="temperature",
    stage="material",
    mechanism="the resistance follows the temperature of the room or of its own current",
    equation="u + (alpha dT + beta dT^2) (1 + b u); ambient: dT from 25 C, logged or a room that "
    "wanders; self_heating: tau d(dT)/dt = P/(1 + u) - dT",
    source="temperature coefficient of resistance; Joule heat into a first-order thermal mass",
    fingerprint="common to the channels, each with its own gain; follows a logged temperature",
    parameters=(
        Parameter("alpha", "share of span / K", -0.01, 0.02, 0.005, "linear coefficient"),
        Parameter("beta", "share of span / K^2", -0.001, 0.001, 0.0, "quadratic coefficient"),
        Parameter("by_signal", "1", 0.0, 3.0, 0.0, "how much more at full strain than at rest"),
        Parameter("wander_k", "K", 0.2, 5.0, 1.0, "no log: deviation of the room"),
        Parameter("wander_s", "s", 30.0, 1000.0, 150.0, "no log: its correlation time; thermal"),
        Parameter("rise_k", "K", 0.5, 20.0, 5.0, "self heating: settled rise at rest"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("ambient", "self_heating"),
)
