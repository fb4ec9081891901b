"""Drift: the network settles or ages with time alone."""

from __future__ import annotations

import numpy as np

from softsense.effects import (
    REFERENCE_S,
    Candidate,
    Context,
    Effect,
    Floats,
    Nominal,
    Parameter,
    State,
    Values,
)


def course(t_s: Floats, values: Values, form: str) -> Floats:
    """(samples, channels): 0 at time 0 and 1 after ``REFERENCE_S``."""
    t = np.maximum(t_s, 0.0)[:, None]
    if form == "power":
        return (t / REFERENCE_S) ** values["exponent"]
    tau = values["tau_s"]
    if form == "log":
        return np.log1p(t / tau) / np.log1p(REFERENCE_S / tau)
    return np.expm1(-t / tau) / np.expm1(-REFERENCE_S / tau)


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + A d(t) (1 + b u)."""
    change = values["amplitude"] * course(context.time_s(), values, form)
    return u + change * (1.0 + values["by_signal"] * u), {}


def explain(nominal: Nominal) -> list[Candidate]:
    """Laws of time; alone, or felt somewhat more or less at full signal (a divider's slope).

    Avrami (J. Chem. Phys. 7, 1939): what cures slowly at first, or goes on for ever more slowly.
    """
    t = np.maximum(nominal.time_s, 0.0)
    laws: list[tuple[str, dict[str, float], Floats]] = []
    for tau_s in (1.0, 4.0, 15.0, 60.0, 200.0):
        laws.append(("log", {"tau_s": tau_s}, np.log1p(t / tau_s)))
        laws.append(("exponential", {"tau_s": tau_s}, -np.expm1(-t / tau_s)))
    for exponent in (0.25, 0.5, 0.75, 1.0):
        laws.append(("power", {"exponent": exponent}, (t / REFERENCE_S) ** exponent))
    scaled = [law * nominal.span for _, _, law in laws]
    result = [
        Candidate((law * (1.0 + by_signal * nominal.share))[:, None], values, form)
        for (form, values, _), law in zip(laws, scaled, strict=True)
        for by_signal in (0.0, -0.3, 0.4)
    ]
    for tau_s in (2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 240.0):
        for law in (t / (t + tau_s), 1.0 - 1.0 / np.sqrt(1.0 + t / tau_s)):
            column = (law * nominal.span)[:, None]
            result.append(Candidate(column, {"tau_s": tau_s}, "hyperbolic"))
    for tau_s in (30.0, 60.0, 120.0, 240.0):
        for order in (0.6, 1.5, 2.0):
            cured = (-np.expm1(-((t / tau_s) ** order)) * nominal.span)[:, None]
            result.append(Candidate(cured, {"tau_s": tau_s}, "avrami"))
    for tau_s in (20.0, 60.0, 150.0):
        for order in (0.7, 1.4):
            slow = (np.log1p((t / tau_s) ** order) * nominal.span)[:, None]
            result.append(Candidate(slow, {"tau_s": tau_s}, "log_power"))
    mixed = [np.log1p(t / 4.0), -np.expm1(-t / 60.0), t / REFERENCE_S]
    return [*result, Candidate(np.stack(mixed, axis=1) * nominal.span, {}, "mixed")]


EFFECT = Effect(
    name="drift",
    stage="material",
    mechanism="the conductive network settles or ages: the signal wanders with time alone",
    equation="u + A d(t) (1 + b u), d(400 s) = 1; log: d ~ ln(1 + t/tau); "
    "exponential: d ~ 1 - exp(-t/tau); power: d ~ t^a",
    source="standard creep laws: logarithmic, exponential (Kelvin-Voigt), power (Findley)",
    fingerprint="depends on the time since the start only",
    parameters=(
        Parameter("amplitude", "share of span", -0.5, 0.5, 0.05, "change after 400 s"),
        Parameter("tau_s", "s", 1.0, 1000.0, 60.0, "log, exponential: time constant"),
        Parameter("exponent", "1", 0.2, 1.5, 0.5, "power: exponent"),
        Parameter("by_signal", "1", 0.0, 3.0, 0.0, "how much more at full strain than at rest"),
    ),
    simulate=simulate,
    explain=explain,
    forms=("log", "exponential", "power"),
    memoryless=True,
)
