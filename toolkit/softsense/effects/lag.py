"""Lag: the reading follows with a time constant."""

from __future__ import annotations

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import low_pass


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u through 1 / (1 + tau p)^n, n = 1 or 2, settled at the first sample."""
    memories = []
    for pole in range(2 if form == "two_poles" else 1):
        before = None if state is None else state["memory"][pole]
        u, memory = low_pass(u, context.dt_s, values["tau_s"], before)
        memories.append(memory)
    return u, {"memory": np.stack(memories)}


def explain(nominal: Nominal) -> list[Candidate]:
    """The filtered signal less the signal itself, weight 1, one pole and two."""
    result = []
    for tau_s in np.geomspace(0.01, 0.8, 21):
        once = low_pass(nominal.u[:, None], nominal.dt_s, np.array([tau_s]), None)[0]
        twice = low_pass(once, nominal.dt_s, np.array([tau_s]), None)[0]
        for poles, y in ((1, once), (2, twice)):
            values = {"tau_s": float(tau_s), "poles": float(poles)}
            result.append(Candidate(y - nominal.u[:, None], values, fixed=True))
    return result


EFFECT = Effect(
    name="lag",
    stage="electrical",
    mechanism="an RC filter or slow contact: the reading follows with a time constant",
    equation="u / (1 + tau p)^n, gain 1; one_pole: n = 1; two_poles: n = 2",
    source="first-order low-pass; two in a row with the same time constant",
    fingerprint="fast motion is attenuated and late",
    parameters=(Parameter("tau_s", "s", 0.01, 0.5, 0.1, "time constant of each pole"),),
    simulate=simulate,
    explain=explain,
    forms=("one_pole", "two_poles"),
)
