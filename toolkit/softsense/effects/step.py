"""Step: damage or slip at one instant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values

GRID = 65
# What changes earlier, as a share of the recording, is a miscalibration or a drift.
EARLIEST, LATEST = 0.05, 0.98
HEALING_S = np.array([10.0, 40.0, 160.0])
# What heals behind a divider does so within this share of the recording.
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
    """The same at instants near one, a grid step to either side; and tears around them."""
    reach = nominal.reference.duration_s / GRID
    # Where healing was looked for, the grid is twice as coarse.
    wide = 1.0 if "tau_s" in values else 0.5
    near_s = values["onset_s"] + np.linspace(-wide * reach, wide * reach, 21)
    earliest_s = nominal.reference.start_s + EARLIEST * nominal.reference.duration_s
    near_s = np.maximum(near_s, earliest_s)
    made = _traces(nominal, near_s) + _healing(nominal, near_s[::2], HEALING_S)
    # A contact in series that heals, on either side of a divider; slower it would be a drift.
    q = nominal.u / nominal.full_scale
    soon_s = HEALING_S[HEALING_S / nominal.reference.duration_s < SOON]
    for slope in (q**2, (1.0 - q) ** 2):
        made += _healing(nominal, near_s[::2], soon_s, slope)
    made += _tearing(nominal, near_s[::2]) + _bent(nominal, near_s)
    return made + _in_two_blows(nominal, near_s[::4])


def _traces(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    result = []
    for onset_s in onsets_s:
        after = (nominal.time_s >= onset_s) * nominal.span
        values = {"onset_s": float(onset_s)}
        result.append(Candidate(after[:, None], values))
        result.append(Candidate(np.stack([after, after * nominal.share], axis=1), values))
    return result


def _healing(
    nominal: Nominal, onsets_s: Floats, times_s: Floats, slope: Floats | float = 1.0
) -> list[Candidate]:
    """An offset that heals in part, behind a curve of this ``slope``."""
    result = []
    for onset_s in onsets_s:
        since = nominal.time_s - onset_s
        after = (since >= 0.0) * nominal.span
        for tau_s in times_s:
            healed = after * np.exp(-np.maximum(since, 0.0) / tau_s)
            values = {"onset_s": float(onset_s), "tau_s": float(tau_s)}
            columns = np.stack([after * slope, healed * slope], axis=1)
            result.append(Candidate(columns, values, "healing"))
    return result


def _tearing(nominal: Nominal, middles_s: Floats) -> list[Candidate]:
    result = []
    for middle_s in middles_s:
        for lasts_s in TEARING_S:
            onset_s = middle_s - lasts_s / 2.0
            torn = np.clip((nominal.time_s - onset_s) / lasts_s, 0.0, 1.0) * nominal.span
            values = {"onset_s": float(onset_s), "lasts_s": lasts_s}
            columns = np.stack([torn, torn * nominal.share], axis=1)
            result.append(Candidate(columns, values, "tearing"))
    return result


def _bent(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    """A crack in series, say: behind a divider it bends the curve."""
    result = []
    for onset_s in onsets_s:
        after = (nominal.time_s >= onset_s) * nominal.span
        columns = after[:, None] * nominal.share[:, None] ** np.arange(3)
        result.append(Candidate(columns, {"onset_s": float(onset_s)}, "bent"))
    return result


def _in_two_blows(nominal: Nominal, onsets_s: Floats) -> list[Candidate]:
    result = []
    for onset_s in onsets_s:
        first = (nominal.time_s >= onset_s) * nominal.span
        for later_s in SECOND_S:
            second = (nominal.time_s >= onset_s + later_s) * nominal.span
            values = {"onset_s": float(onset_s), "later_s": float(later_s)}
            result.append(Candidate(np.stack([first, second], axis=1), values, "two_blows"))
    return result


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
