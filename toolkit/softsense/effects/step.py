"""Step: damage or slip at one instant."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

# So many instants are looked at first, as exactly as that; then so many near one, and closer to it.
GRID = 65
ON_GRID = 1e-6
NEAR, CLOSE = 20, 13
# What changes earlier, as a share of the recording, is a miscalibration or a drift.
EARLIEST, LATEST = 0.05, 0.98
HEALING_S = np.array([10.0, 40.0, 160.0])
# Times between those, looked at once the instant is known; and what heals with the logarithm of the
# time, from so much of it on.
HEALING_NEAR = np.array([0.65, 1.0, 1.5])
LOGARITHM_S = 2.0
# What heals behind a divider, or with the gain, does so within this share of the recording.
SOON = 0.15
# How long a sensor that does not break at once takes to tear.
TEARING_S = (2.0, 5.0)
# How long after a first blow a second one comes.
SECOND_S = np.geomspace(1.0, 40.0, 9)


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u + h(t) (offset + gain u), h = 0 before ``at_s``, then 1 - recovery (1 - exp(-(t-at)/tau)).

    ``state`` is empty: the time of the first sample says where it stands.
    """
    since = context.time_s()[:, None] - values["at_s"]
    healed = -np.expm1(-np.maximum(since, 0.0) / values["tau_s"])
    h = np.where(since >= 0.0, 1.0 - values["recovery"] * healed, 0.0)
    return u + h * (values["offset"] + values["gain"] * u), {}


def explain(nominal: Nominal) -> list[Candidate]:
    """From an instant on another offset and gain, or an offset that heals in part."""
    reference = nominal.reference
    onsets_s = reference.start_s + np.linspace(EARLIEST, LATEST, GRID) * reference.duration_s
    return _traces(nominal, onsets_s) + _healing(nominal, onsets_s[::2], HEALING_S[1:2])


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The same at instants near one, a grid step to either side, or closer where it is on the grid
    no more; and tears around them, and what comes back with the logarithm of time."""
    reach = nominal.reference.duration_s / GRID
    # Where healing was looked for, the grid is twice as coarse.
    reach *= 1.0 if "tau_s" in values else 0.5
    # The middle is on the grid.
    steps = np.linspace(-reach, reach, NEAR)
    every, heals_s = 2, HEALING_S
    if not _on_grid(nominal, values["onset_s"]):
        # A large step says to the sample when it was, and then how it went on.
        steps = np.concatenate([steps[::3], np.linspace(-1.0, 1.0, CLOSE) * (steps[1] - steps[0])])
        every = 1
        heals_s = values["tau_s"] * HEALING_NEAR if "tau_s" in values else HEALING_S
    near_s = values["onset_s"] + np.sort(steps)
    earliest_s = nominal.reference.start_s + EARLIEST * nominal.reference.duration_s
    near_s = np.maximum(near_s, earliest_s)
    made = _traces(nominal, near_s) + _healing(nominal, near_s[::every], heals_s)
    made += _coming_back(nominal, near_s[::every])
    # A contact in series that heals, on either side of a divider; slower it would be a drift.
    q = nominal.u / nominal.full_scale
    soon_s = HEALING_S[HEALING_S / nominal.reference.duration_s < SOON]
    for slope in (q**2, (1.0 - q) ** 2):
        made += _healing(nominal, near_s[::2], soon_s, slope)
    # What comes back slowly is a gain that ages, or a drift.
    soon = heals_s / nominal.reference.duration_s < SOON
    made += _regaining(nominal, near_s[::2], heals_s[soon])
    made += _tearing(nominal, near_s[::2]) + _bent(nominal, near_s)
    return made + _in_two_blows(nominal, near_s[::4])


def _on_grid(nominal: Nominal, onset_s: float) -> bool:
    """Whether it is one of the instants that are looked at first."""
    passed = (onset_s - nominal.reference.start_s) / nominal.reference.duration_s
    at = (passed - EARLIEST) / (LATEST - EARLIEST) * (GRID - 1)
    return abs(at - round(at)) < ON_GRID


def _traces(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    result = []
    for onset_s in onsets_s:
        values = {"onset_s": float(onset_s)}
        for order in (0, 1):
            result.append(Candidate(partial(_after, nominal, onset_s, order), values))
    return result


def _after(nominal: Nominal, onset_s: float, order: int) -> Floats:
    """(samples, order + 1) a polynomial of the signal from an instant on."""
    after = (nominal.time_s >= onset_s) * nominal.span
    return after[:, None] * np.vander(nominal.share, order + 1, increasing=True)


def _healing(
    nominal: Nominal, onsets_s: Floats, times_s: Floats, slope: Floats | float = 1.0
) -> list[Candidate]:
    """An offset that heals in part, behind a curve of this ``slope``."""
    result = []
    for onset_s in onsets_s:
        for tau_s in times_s:
            values = {"onset_s": float(onset_s), "tau_s": float(tau_s)}
            made = partial(_healed, nominal, onset_s, tau_s, slope)
            result.append(Candidate(made, values, "healing"))
    return result


def _healed(nominal: Nominal, onset_s: float, tau_s: float, slope: Floats | float) -> Floats:
    """(samples, 2) what is there from an instant on, and what of it has not healed yet."""
    since = nominal.time_s - onset_s
    after = (since >= 0.0) * nominal.span * slope
    return np.stack([after, after * np.exp(-np.maximum(since, 0.0) / tau_s)], axis=1)


def _regaining(nominal: Nominal, onsets_s: Floats, times_s: Floats) -> list[Candidate]:
    """An offset and a gain that heal in part."""
    return [
        Candidate(
            partial(_regained, nominal, onset_s, tau_s),
            {"onset_s": float(onset_s), "tau_s": float(tau_s)},
            "regaining",
            pliable=True,
        )
        for onset_s in onsets_s
        for tau_s in times_s
    ]


def _regained(nominal: Nominal, onset_s: float, tau_s: float) -> Floats:
    """(samples, 4) what is there from an instant on, and what of it has not healed yet, and both
    times the signal."""
    healed = _healed(nominal, onset_s, tau_s, 1.0)
    return np.concatenate([healed, healed * nominal.share[:, None]], axis=1)


def _coming_back(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    return [
        Candidate(partial(_back, nominal, onset_s), {"onset_s": float(onset_s)}, "coming_back")
        for onset_s in onsets_s
    ]


def _back(nominal: Nominal, onset_s: float) -> Floats:
    """(samples, 2) what is there from an instant on, and that times the logarithm of the time."""
    since = nominal.time_s - onset_s
    after = (since >= 0.0) * nominal.span
    return np.stack([after, after * np.log1p(np.maximum(since, 0.0) / LOGARITHM_S)], axis=1)


def _tearing(nominal: Nominal, middles_s: Floats) -> list[Candidate]:
    result = []
    for middle_s in middles_s:
        for lasts_s in TEARING_S:
            onset_s = float(middle_s - lasts_s / 2.0)
            made = partial(_torn, nominal, onset_s, lasts_s)
            values = {"onset_s": onset_s, "lasts_s": lasts_s}
            result.append(Candidate(made, values, "tearing"))
    return result


def _torn(nominal: Nominal, onset_s: float, lasts_s: float) -> Floats:
    """(samples, 2) what comes little by little, and that times the signal."""
    torn = np.clip((nominal.time_s - onset_s) / lasts_s, 0.0, 1.0) * nominal.span
    return np.stack([torn, torn * nominal.share], axis=1)


def _bent(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    """A crack in series, say: behind a divider it bends the curve."""
    return [
        Candidate(partial(_after, nominal, onset_s, 2), {"onset_s": float(onset_s)}, "bent")
        for onset_s in onsets_s
    ]


def _in_two_blows(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    result = []
    for onset_s in onsets_s:
        for later_s in SECOND_S:
            values = {"onset_s": float(onset_s), "later_s": float(later_s)}
            made = partial(_blows, nominal, (onset_s, onset_s + later_s))
            result.append(Candidate(made, values, "two_blows"))
    return result


def _blows(nominal: Nominal, onsets_s: tuple[float, float]) -> Floats:
    """(samples, 2) what is there from either instant on."""
    after = nominal.time_s[:, None] >= np.array(onsets_s)
    return np.asarray(after * nominal.span, dtype=np.float64)


EFFECT = Effect(
    name="step",
    stage="material",
    mechanism="damage or slip at one instant shifts the signal, perhaps healing in part",
    equation="u + h(t) (a + b u), h = 0 before t0, then 1 - q (1 - exp(-(t - t0)/tau))",
    source="change-point model; partial recovery of the first order",
    fingerprint="one time of change",
    parameters=(
        Parameter("offset", "share of span", -0.3, 0.3, 0.1, "shift"),
        Parameter("gain", "1", -0.3, 0.3, 0.0, "relative change of the gain"),
        Parameter("at_s", "s", 0.0, 1.0e6, 200.0, "when"),
        Parameter("recovery", "1", 0.0, 0.8, 0.0, "share that heals"),
        Parameter("tau_s", "s", 5.0, 200.0, 50.0, "how fast it heals"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    memoryless=True,
)
