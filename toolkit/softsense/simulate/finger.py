"""The pneumatic bending finger of the paper: pressure in, seven sensors, a fingertip in pixels.

Pressure follows its command through the tube (first order). The finger bends as two arcs; each
angle follows the pressure with its own time constant and friction, so that one pressure does not
mean one pose. Sensors lie along the finger in three matrices; where they are bonded to the
finger, the interface differs: some slip before they are taken along. The constants are chosen
after the pictures of Thuruthel et al. (2021), Figs 11 to 14; they are not measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softsense.effects import Context, State, effect
from softsense.effects.operators import low_pass
from softsense.simulate.linear import wires_in
from softsense.simulate.rig import Placed, Rig

Floats = NDArray[np.float64]

PRESSURE_KPA = 60.0
_WIRES = (
    *(("Dragon Skin 20", 1), ("Dragon Skin 20", 2)),
    *(("natural rubber", 1), ("natural rubber", 2), ("natural rubber", 3)),
    *(("Ecoflex 20", 1), ("Ecoflex 20", 2)),
)
_TUBE_S = 0.15
_ARC_S = np.array([0.25, 0.55])
_ARC_DEG = np.array([70.0, 95.0])
# Bending per pressure stiffens: q + c q^2, c below zero at the root, where the base holds it.
_ARC_BEND = np.array([-0.15, 0.30])
_FRICTION: dict[str, ArrayLike] = {"amplitude": [0.03, 0.05], "threshold": 0.1}
_RELAXATION: dict[str, ArrayLike] = {"amplitude": [-0.05, -0.10], "tau_s": [8.0, 20.0]}
_LENGTH_PX = 150.0
_ROOT_PX = (320.0, 60.0)


@dataclass(frozen=True)
class Pose:
    """What the finger does, (samples,) each, and ``arcs`` (samples, 2), shares of full bending."""

    arcs: Floats
    pressure_kpa: Floats
    bend_deg: Floats
    x_px: Floats
    y_px: Floats


def move(command: Floats, dt_s: float, state: State | None) -> tuple[Pose, State]:
    """The finger's pose under a commanded pressure, (samples,) share of ``PRESSURE_KPA``."""
    before: State = {} if state is None else state
    pressure, tube = low_pass(command[:, None], dt_s, np.array([_TUBE_S]), before.get("tube"))
    settled = np.repeat(pressure, 2, axis=1)
    settled = settled + _ARC_BEND * settled * (settled - 1.0)
    context = Context(dt_s, pressure[:, 0])
    rubbed, friction = effect("hysteresis").apply(
        settled, context, _FRICTION, state=before.get("friction")
    )
    crept, creep = effect("relaxation").apply(
        rubbed, context, _RELAXATION, state=before.get("creep")
    )
    arcs, mass = low_pass(crept, dt_s, _ARC_S, before.get("mass"))
    x, y = _tip(np.deg2rad(arcs * _ARC_DEG))
    pose = Pose(arcs, PRESSURE_KPA * pressure[:, 0], arcs @ _ARC_DEG, x, y)
    return pose, {"tube": tube, "friction": friction, "creep": creep, "mass": mass}


def _tip(angles: Floats) -> tuple[Floats, Floats]:
    """Tip of two arcs of equal length in a row; the finger hangs along y and bends towards x."""
    x, y = np.full(len(angles), _ROOT_PX[0]), np.full(len(angles), _ROOT_PX[1])
    heading = np.zeros(len(angles))
    for arc in range(angles.shape[1]):
        # The chord of an arc: its length times sinc(angle / 2), halfway between its headings.
        chord = _LENGTH_PX * np.sinc(angles[:, arc] / (2.0 * np.pi))
        middle = heading + 0.5 * angles[:, arc]
        x = x + chord * np.sin(middle)
        y = y + chord * np.cos(middle)
        heading = heading + angles[:, arc]
    return x, y


def finger_rig(seed: int = 0, rate_hz: float = 20.0) -> Rig:
    """The finger with its seven sensors, named s1 … s7; ``seed`` draws what differs in each."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x6669]))
    count = len(_WIRES)
    # Interfaces spread: where a sensor sits, how much strain reaches it, how far it slips.
    along = np.linspace(0.15, 0.85, count)[rng.permutation(count)]
    transfer = rng.uniform(0.75, 1.05, count)
    slip = rng.uniform(0.0, 0.05, count)
    sensors, effects = wires_in(
        _WIRES, seed, along=tuple(along.tolist()), transfer=tuple(transfer.tolist())
    )
    backlash = Placed("backlash", "motion", {"width": tuple(slip.tolist())})
    return Rig(
        "finger",
        sensors,
        (backlash, *effects),
        body="finger",
        target="pressure_kpa",
        low=0.0,
        high=PRESSURE_KPA,
        rate_hz=rate_hz,
    )
