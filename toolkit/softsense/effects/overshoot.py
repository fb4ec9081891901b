"""Overshoot: conductive paths break in motion, whichever way it goes, and form again."""

from __future__ import annotations

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import low_pass, rate

TAUS_S = (0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 4.0)
LADDERS_S = ((0.12, 0.5, 2.0), (0.05, 0.25, 1.0, 4.0))


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + A y (1 + b u), y = LP_tau(|v|), starting at rest."""
    speed = np.abs(rate(context.strain, context.dt_s, None if state is None else state["strain"]))
    speeds = np.broadcast_to(speed[:, None], u.shape)
    memory = None if state is None else state["memory"]
    broken, memory = low_pass(
        speeds, context.dt_s, values["tau_s"], memory, rest=np.zeros(u.shape[1])
    )
    result = u + values["amplitude"] * broken * (1.0 + values["by_signal"] * u)
    return result, {"memory": memory, "strain": float(context.strain[-1])}


def explain(nominal: Nominal) -> list[Candidate]:
    """Filtered magnitude of the strain rate, alone and times the signal: even in direction.

    Or more of one direction than of the other, but of one sign.
    """
    result = []
    share = nominal.share[nominal.keep]
    for power in (0.5, 0.75, 1.0, 1.5):
        speed = (np.abs(nominal.rate) ** power)[:, None]
        parts = {}
        for tau_s in TAUS_S:
            y = low_pass(speed, nominal.dt_s, np.array([tau_s]), None)[0][nominal.keep, 0]
            y = y * nominal.span
            parts[tau_s] = np.stack([y, y * share], axis=1)
            result.append(Candidate(parts[tau_s], {"tau_s": tau_s}))
        # A network that forms again at several rates.
        for ladder in LADDERS_S:
            columns = np.concatenate([parts[tau_s] for tau_s in ladder], axis=1)
            result.append(Candidate(columns, {}))
    ways = np.stack([np.maximum(nominal.rate, 0.0), np.maximum(-nominal.rate, 0.0)], axis=1)
    sides = {}
    for tau_s in TAUS_S:
        y = low_pass(ways, nominal.dt_s, np.full(2, tau_s), None, rest=np.zeros(2))[0]
        sides[tau_s] = y[nominal.keep] * nominal.span
        result.append(Candidate(sides[tau_s], {"tau_s": tau_s}, "one_way", parallel=True))
    for ladder in LADDERS_S:
        columns = np.concatenate([sides[tau_s] for tau_s in ladder], axis=1)
        result.append(Candidate(columns, {}, "one_way", parallel=True))
    return result


EFFECT = Effect(
    name="overshoot",
    stage="material",
    mechanism="conductive paths break while the strain changes and form again at rest",
    equation="u + A y (1 + b u), tau dy/dt = |v| - y, v the strain rate",
    source="first-order breakdown and re-formation of the filler network, after the rate-dependent "
    "peaks that Thuruthel et al. (2021), Figs 3 and 6, show",
    fingerprint="even in the strain rate: a spike at fast moves in both directions",
    parameters=(
        Parameter("amplitude", "s * share of span", 0.005, 0.5, 0.05, "per strain range per s"),
        Parameter("tau_s", "s", 0.1, 5.0, 0.8, "time to form again"),
        Parameter("by_signal", "1", -1.0, 3.0, 0.0, "how much more at full strain than at rest"),
    ),
    simulate=simulate,
    explain=explain,
)
