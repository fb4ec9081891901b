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


@dataclass(frozen=True)
class Matrix:
    """What a matrix does to a wire. Shares are of the stress's or the response's full span.

    ``relaxation``: share relaxing at each of ``TAU_S``. ``bend``: curvature of the resistance.
    ``scatter``: relative spread between two samples. ``drift``: after 400 s.
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
    scatter: float


MATRICES: dict[str, Matrix] = {
    "bare": Matrix(2.6, 1.3, 0.10, 0.10, 0.5, (0.16, 0.20, 0.14), 0.10, 0.06, 0.030, 0.015, 0.04),
    "Dragon Skin 20": Matrix(
        31.0, 1.5, 0.20, 0.15, 0.5, (0.10, 0.14, 0.30), 0.06, 0.05, 0.020, 0.16, 0.05
    ),
    "Ecoflex 20": Matrix(
        38.0, 1.4, 0.15, 0.05, 0.5, (0.26, 0.10, 0.16), 0.04, 0.04, 0.035, 0.20, 0.05
    ),
    "Sylgard 184": Matrix(
        3.4, 1.2, 0.05, 0.30, 0.5, (0.08, 0.28, 0.10), 0.13, 0.06, 0.015, 0.020, 0.04
    ),
    "silicone sealant": Matrix(
        3.0, 1.4, 0.15, 0.20, 0.8, (0.36, 0.48, 0.36), 0.24, 0.05, 0.050, 0.015, 0.04
    ),
    "Sil-Poxy": Matrix(
        4.2, 1.1, 0.10, 0.25, 0.5, (0.20, 0.20, 0.20), 0.14, 0.08, 0.030, 0.030, 0.45
    ),
    "natural rubber": Matrix(
        3.2, 1.6, 0.12, 0.12, 0.4, (0.12, 0.16, 0.12), 0.08, 0.03, 0.012, 0.010, 0.03
    ),
}
# As in the paper: bare wires were studied alone, Sil-Poxy was dropped as unrepeatable.
_DRAWN_FROM = tuple(name for name in MATRICES if name not in ("bare", "Sil-Poxy"))


def all_wires() -> tuple[tuple[str, int], ...]:
    """(matrix, sample) of the fourteen wires."""
    return tuple((matrix, sample) for matrix in MATRICES for sample in (1, 2))


def draw_wires(seed: int, count: int = SENSORS) -> tuple[tuple[str, int], ...]:
    """``count`` of the ten embedded, repeatable wires, drawn by ``seed``, in the table's order."""
    pool = [wire for wire in all_wires() if wire[0] in _DRAWN_FROM]
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
    wires = draw_wires(seed) if wires is None else wires
    every = all_wires()
    rows: dict[str, list[float]] = {}
    poles: list[tuple[float, ...]] = []
    sensors = []
    for number, (name, sample) in enumerate(wires):
        matrix = MATRICES[name]
        key = [seed, 0x7361, every.index((name, sample))]
        rng = np.random.default_rng(np.random.SeedSequence(key))
        # Spread of 1 in ``scatter`` units, cut at two so that no sample is absurd.
        unit = np.clip(rng.standard_normal(10), -2.0, 2.0)
        factor = np.exp(matrix.scatter * unit)
        base = 1000.0 * matrix.base_kohm * float(factor[0])
        span = matrix.span * float(factor[1])
        bend = matrix.bend * float(factor[2])
        at = np.linspace(-0.5, 4.5, 41)
        curve = at * (1.0 + bend * (at - 1.0))
        sensors.append(
            Sensor(
                name=f"s{number + 1}",
                matrix=name,
                sample=sample,
                base_ohm=base,
                reference_ohm=1000.0 * matrix.base_kohm * (1.0 + 0.5 * matrix.span),
                span=span,
                curve=tuple(curve.tolist()),
                curve_low=-0.5,
                curve_high=4.5,
                stress_share=matrix.stress_share,
                tension=0.2 * matrix.tension,
            )
        )
        poles.append(
            tuple(g * float(f) for g, f in zip(matrix.relaxation, factor[3:6], strict=True))
        )
        drawn = {
            "friction": matrix.friction * factor[6],
            "softening": matrix.softening * factor[7],
            "overshoot": matrix.overshoot * factor[8],
            "drift": matrix.drift * factor[9],
        }
        for quantity, value in drawn.items():
            rows.setdefault(quantity, []).append(float(value))

    def row(name: str) -> Value:
        return tuple(rows[name])

    effects = (
        Placed("relaxation", "stress", {"amplitude": tuple(poles), "tau_s": (TAU_S,) * len(wires)}),
        Placed("hysteresis", "stress", {"amplitude": row("friction"), "threshold": 0.15}),
        Placed("softening", "stress", {"depth": row("softening"), "width": 0.3}),
        Placed("overshoot", "response", {"amplitude": row("overshoot"), "tau_s": 0.8}),
        Placed("drift", "response", {"amplitude": row("drift"), "tau_s": 60.0, "by_signal": 0.5}),
        Placed("noise", "electrical", {"level_lsb": 1.0}),
    )
    return Rig("linear", tuple(sensors), effects, rate_hz=rate_hz)
