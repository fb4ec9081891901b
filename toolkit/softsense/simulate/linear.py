"""The linear rig of the paper: CTPE wires in seven matrices, two samples of each.

CTPE is a carbon-black thermoplastic elastomer. What a wire hides, the wire's own relaxation and
friction, is common to all; how much of it shows, and what the matrix adds, differs by matrix.
The constants of ``MATRICES`` are not measured: they are chosen so that the statements of
Thuruthel et al. (2021) come out (which matrix drifts, which pair is best).
``tests/benchmarks/simulate/statements.py`` prints how often they do over many seeds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softsense.simulate.rig import Placed, Rig, Sensor, Value

Floats = NDArray[np.float64]

SENSORS = 7
# Relaxation times that all wires share, in seconds.
TAU_S = (0.6, 6.0, 60.0)
# Strain, as a share of 40 %, over which a wire's curve is tabulated: up to 180 % for the cyclic
# test to 140 %, and below rest, where a wire that relaxed under load is pressed together.
_CURVE_OVER = (-1.5, 4.5)
_CURVE_POINTS = 49
# Below rest the response fades out towards this.
_PRESSED = 0.4


@dataclass(frozen=True)
class Matrix:
    """What a matrix does to a wire. Shares are of the stress's or the response's full span.

    ``relaxation``: share relaxing at each of ``TAU_S``. ``bend``: curvature of the resistance.
    ``drift``: after 400 s. ``wander``: slow and random. ``scatter``: relative spread of samples.
    """

    base_kohm: float
    span: float
    bend: float
    tension: float
    stress_share: float
    relaxation: tuple[float, float, float]
    friction: float
    softening: float
    overshoot: float
    drift: float
    wander: float
    scatter: float


MATRICES: dict[str, Matrix] = {
    "bare": Matrix(
        2.6, 1.3, 0.10, 0.02, 0.5, (0.16, 0.20, 0.14), 0.10, 0.06, 0.060, 0.015, 0.003, 0.04
    ),
    "Dragon Skin 20": Matrix(
        31.0, 1.5, 0.20, 0.03, 0.5, (0.12, 0.18, 0.34), 0.09, 0.05, 0.040, 0.16, 0.010, 0.04
    ),
    "Ecoflex 20": Matrix(
        38.0, 1.4, 0.15, 0.01, 0.5, (0.28, 0.11, 0.18), 0.05, 0.04, 0.070, 0.20, 0.012, 0.04
    ),
    "Sylgard 184": Matrix(
        3.4, 1.2, 0.05, 0.06, 0.5, (0.03, 0.15, 0.30), 0.19, 0.06, 0.030, 0.020, 0.003, 0.04
    ),
    "silicone sealant": Matrix(
        3.0, 1.4, 0.15, 0.04, 0.8, (0.27, 0.36, 0.27), 0.18, 0.05, 0.100, 0.015, 0.003, 0.03
    ),
    "Sil-Poxy": Matrix(
        4.2, 1.1, 0.10, 0.05, 0.5, (0.20, 0.20, 0.20), 0.14, 0.08, 0.060, 0.030, 0.006, 0.45
    ),
    "natural rubber": Matrix(
        3.2, 1.6, 0.12, 0.025, 0.4, (0.115, 0.155, 0.115), 0.078, 0.03, 0.022, 0.010, 0.003, 0.03
    ),
}
# As in the paper: bare wires were studied alone, Sil-Poxy was dropped as unrepeatable.
WIRES_TO_DRAW_FROM = tuple(
    (name, sample) for name in MATRICES if name not in ("bare", "Sil-Poxy") for sample in (1, 2)
)


def all_wires() -> tuple[tuple[str, int], ...]:
    """(matrix, sample) of the fourteen wires."""
    return tuple((matrix, sample) for matrix in MATRICES for sample in (1, 2))


def draw_wires(seed: int, count: int = SENSORS) -> tuple[tuple[str, int], ...]:
    """``count`` of the ten embedded, repeatable wires, drawn by ``seed``, in the table's order."""
    pool = WIRES_TO_DRAW_FROM
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x7769]))
    chosen = np.sort(rng.choice(len(pool), size=count, replace=False))
    return tuple(pool[index] for index in chosen)


def linear_rig(
    seed: int = 0, wires: tuple[tuple[str, int], ...] | None = None, rate_hz: float = 20.0
) -> Rig:
    """The linear rig with ``wires`` (default: seven drawn by ``seed``), named s1, s2, …

    ``seed`` also draws what differs between the samples of one matrix; a wire is the same wire
    whichever others are beside it.
    """
    sensors, effects = wires_in(draw_wires(seed) if wires is None else wires, seed)
    return Rig("linear", sensors, effects, rate_hz=rate_hz)


def wires_in(
    wires: tuple[tuple[str, int], ...],
    seed: int,
    along: tuple[float, ...] | None = None,
    transfer: tuple[float, ...] | None = None,
) -> tuple[tuple[Sensor, ...], tuple[Placed, ...]]:
    """Sensors and nominal effects of ``wires`` (matrix, sample), named s1, s2, …

    ``along``, ``transfer``: see ``Sensor``; 0 and 1 where absent.
    """
    along = (0.0,) * len(wires) if along is None else along
    transfer = (1.0,) * len(wires) if transfer is None else transfer
    rows: dict[str, list[float]] = {}
    poles: list[tuple[float, ...]] = []
    sensors = []
    for number, (name, sample) in enumerate(wires):
        matrix = MATRICES[name]
        key = [seed, 0x7361, list(MATRICES).index(name), sample]
        rng = np.random.default_rng(np.random.SeedSequence(key))
        # Cut at two deviations, so that no sample is absurd.
        factor = np.exp(matrix.scatter * np.clip(rng.standard_normal(10), -2.0, 2.0)).tolist()
        at = np.linspace(*_CURVE_OVER, _CURVE_POINTS)
        pulled = at * (1.0 + matrix.bend * factor[2] * (at - 1.0))
        pressed = _PRESSED * np.expm1(np.minimum(at, 0.0) / _PRESSED)
        curve = np.where(at > 0.0, pulled, (1.0 - matrix.bend * factor[2]) * pressed)
        sensors.append(
            Sensor(
                name=f"s{number + 1}",
                matrix=name,
                sample=sample,
                base_ohm=1000.0 * matrix.base_kohm * factor[0],
                reference_ohm=1000.0 * matrix.base_kohm * (1.0 + 0.5 * matrix.span),
                span=matrix.span * factor[1],
                curve=tuple(curve.tolist()),
                curve_low=_CURVE_OVER[0],
                curve_high=_CURVE_OVER[1],
                stress_share=matrix.stress_share,
                tension=matrix.tension,
                along=along[number],
                transfer=transfer[number],
            )
        )
        poles.append(tuple(g * f for g, f in zip(matrix.relaxation, factor[3:6], strict=True)))
        drawn = {
            "friction": matrix.friction * factor[6],
            "softening": matrix.softening * factor[7],
            "overshoot": matrix.overshoot * factor[8],
            "drift": matrix.drift * factor[9],
            "wander": matrix.wander,
        }
        for quantity, value in drawn.items():
            rows.setdefault(quantity, []).append(value)

    def row(name: str) -> Value:
        return tuple(rows[name])

    effects = (
        Placed("relaxation", "stress", {"amplitude": tuple(poles), "tau_s": (TAU_S,) * len(wires)}),
        Placed("hysteresis", "stress", {"amplitude": row("friction"), "threshold": 0.15}),
        Placed("softening", "stress", {"depth": row("softening"), "width": 0.3}),
        Placed("overshoot", "response", {"amplitude": row("overshoot"), "tau_s": 0.8}),
        Placed("drift", "response", {"amplitude": row("drift"), "tau_s": 60.0, "by_signal": 0.5}),
        Placed(
            "random_walk",
            "response",
            {"amplitude": row("wander"), "tau_s": 100.0},
            form="ornstein_uhlenbeck",
        ),
        Placed("noise", "electrical", {"level_lsb": 1.0}),
    )
    return tuple(sensors), effects
