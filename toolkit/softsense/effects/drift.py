"""Drift: the network settles or ages with time alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial

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

# How much more, or less, a drift is felt at full signal than at none.
SLOPES = (0.0, -0.3, 0.4)
# The same of a resistance that changes much, behind a divider.
STEEP = (-0.6, 0.9, 1.7)
# Laws of the time that has passed, in units of a time constant.
COURSES: dict[str, Callable[[Floats], Floats]] = {
    "log": np.log1p,
    "exponential": lambda passed: -np.expm1(-passed),
    "hyperbolic": lambda passed: passed / (1.0 + passed),
    "root": lambda passed: 1.0 - 1.0 / np.sqrt(1.0 + passed),
    "parabolic": lambda passed: np.sqrt(1.0 + passed) - 1.0,
}
# Those that a divider may bend much, or that go with a power of time.
SETTLING = ("log", "exponential", "hyperbolic")
# What settles sooner is no drift but another zero from the start.
SETTLES_S = {"exponential": 3.0, "hyperbolic": 1.0}
# Time constants of two that settle together.
FAST_S = (12.0, 20.0, 32.0, 50.0)
SLOW_S = (120.0, 200.0, 330.0, 550.0)
# And of one that begins slowly, or goes on ever more slowly.
CURING_S = (30.0, 60.0, 120.0, 240.0, 480.0)
# Periods of a room's temperature: of faster ones more than one would be seen.
PERIODS_S = (400.0, 600.0, 900.0, 1400.0, 2200.0, 3500.0)


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
    """Laws of time; alone, or felt somewhat more or less at full signal (a divider's slope). Or a
    room that warms and cools.

    Avrami (J. Chem. Phys. 7, 1939): what cures slowly at first, or goes on for ever more slowly;
    Deal and Grove (J. Appl. Phys. 36, 1965): a layer that hinders its own growth.
    """
    exponents = (0.25, 0.5, 0.75, 1.0)
    return [
        *_laws(nominal, ("log", "exponential"), (1.0, 4.0, 15.0, 60.0, 200.0), SLOPES),
        *_powers(nominal, exponents, SLOPES),
        *_laws(
            nominal,
            ("hyperbolic", "root", "parabolic"),
            (2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 240.0),
        ),
        *_laws(nominal, ("exponential",), CURING_S, orders=(0.6, 1.5, 2.0, 2.5)),
        *_laws(nominal, ("log",), (20.0, 60.0, 150.0), orders=(0.7, 1.4)),
        *_mixed(nominal),
        *_swings(nominal, PERIODS_S),
    ]


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """All laws around one time constant, or around one exponent; and some of them together; closer
    around what begins slowly. Or a room around one period, and what cures as half of it would."""
    if "exponent" in values:
        near = values["exponent"] * np.geomspace(0.7, 1.4, 7)
        return [*_powers(nominal, near.tolist(), SLOPES + STEEP), *_mixed(nominal, SLOPES)]
    if "period_s" in values:
        period_s = values["period_s"]
        taus = (period_s * np.geomspace(0.15, 0.5, 9)).tolist()
        return [
            *_swings(nominal, (period_s * np.geomspace(0.75, 1.4, 11)).tolist()),
            *_laws(nominal, ("exponential", "hyperbolic"), taus, orders=(1.5, 2.0, 2.5)),
        ]
    if "tau_s" not in values:
        return explain(nominal)
    near = values["tau_s"] * np.geomspace(0.5, 2.0, 7)
    taus, orders = near.tolist(), (0.6, 0.8, 1.25, 1.5, 2.0, 2.5)
    closer = []
    if "order" in values:
        close = (values["tau_s"] * np.geomspace(0.85, 1.18, 7)).tolist()
        some = (values["order"] * np.geomspace(0.87, 1.15, 5)).tolist()
        closer = _laws(nominal, SETTLING, close, orders=some)
    return [
        *closer,
        *_laws(nominal, tuple(COURSES), taus, SLOPES),
        *_laws(nominal, SETTLING, taus, STEEP),
        *_laws(nominal, ("log", "exponential"), taus[::2], orders=orders),
        *_mixed(nominal, SLOPES),
    ]


def _laws(
    nominal: Nominal,
    forms: Sequence[str],
    taus_s: Sequence[float],
    slopes: Sequence[float] = (0.0,),
    orders: Sequence[float] = (1.0,),
) -> list[Candidate]:
    """Laws of (t / tau)^order."""

    # One candidate may be asked for alone, and several share this.
    @cache
    def passed(tau_s: float, order: float) -> Floats:
        share: Floats = (np.maximum(nominal.time_s, 0.0) / tau_s) ** order
        return share

    def law(form: str, tau_s: float, order: float) -> Floats:
        return COURSES[form](passed(tau_s, order))

    result = []
    for tau_s in taus_s:
        for order in orders:
            values = {"tau_s": tau_s} if order == 1.0 else {"tau_s": tau_s, "order": order}
            for form in forms:
                if tau_s < SETTLES_S.get(form, 0.0):
                    continue
                result += _felt(nominal, partial(law, form, tau_s, order), values, form, slopes)
    return result


def _powers(
    nominal: Nominal, exponents: Sequence[float], slopes: Sequence[float]
) -> list[Candidate]:
    def law(exponent: float) -> Floats:
        passed: Floats = np.maximum(nominal.time_s, 0.0) / REFERENCE_S
        return passed**exponent

    return [
        candidate
        for exponent in exponents
        for candidate in _felt(
            nominal, partial(law, exponent), {"exponent": exponent}, "power", slopes
        )
    ]


def _felt(
    nominal: Nominal,
    law: Callable[[], Floats],
    values: Mapping[str, float],
    form: str,
    slopes: Sequence[float],
) -> list[Candidate]:
    """A law (samples,), or several (samples, p), where the signal feels it so much more or less."""

    @cache
    def columns() -> Floats:
        made = law()
        return made.reshape(len(made), -1) * nominal.span

    def felt(slope: float) -> Floats:
        return columns() * (1.0 + slope * nominal.share)[:, None]

    return [Candidate(partial(felt, slope), values, form) for slope in slopes]


def _mixed(nominal: Nominal, slopes: Sequence[float] = (0.0,)) -> list[Candidate]:
    """Three laws at once; and two that settle, one after the other, either way."""

    def several() -> Floats:
        t = np.maximum(nominal.time_s, 0.0)
        laws = [np.log1p(t / 4.0), -np.expm1(-t / 60.0), t / REFERENCE_S]
        return np.stack(laws, axis=1) * nominal.span

    def two(fast_s: float, slow_s: float) -> Floats:
        t = np.maximum(nominal.time_s, 0.0)
        return np.stack([-np.expm1(-t / fast_s), -np.expm1(-t / slow_s)], axis=1)

    result = [Candidate(several, {}, "mixed")]
    for fast_s in FAST_S:
        for slow_s in SLOW_S:
            values = {"tau_s": slow_s, "fast_s": fast_s}
            result += _felt(nominal, partial(two, fast_s, slow_s), values, "two", slopes)
    return result


def _swings(nominal: Nominal, periods_s: Sequence[float]) -> list[Candidate]:
    """A room that warms and cools."""

    def swing(period_s: float) -> Floats:
        turned = 2.0 * np.pi / period_s * np.maximum(nominal.time_s, 0.0)
        return np.stack([np.sin(turned), np.cos(turned) - 1.0], axis=1) * nominal.span

    return [
        Candidate(partial(swing, period_s), {"period_s": period_s}, "swing")
        for period_s in periods_s
    ]


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
    zoom=zoom,
    forms=("log", "exponential", "power"),
    memoryless=True,
)
