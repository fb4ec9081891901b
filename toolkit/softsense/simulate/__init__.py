"""The two rigs of the paper as a simulator: strain, stress, resistance, divider, ADC codes.

``simulate(linear_rig(seed), seed=seed)`` is the short way to a recording; ``run`` drives a rig with
any motion and tells what is hidden too; ``Rig`` is the whole description as data.
"""

from __future__ import annotations

from softsense.simulate.finger import finger_rig
from softsense.simulate.linear import all_wires, linear_rig
from softsense.simulate.motion import random_motion, triangle
from softsense.simulate.record import codes_of, simulate, to_recording
from softsense.simulate.rig import Placed, Rig, Sensor, read_rig
from softsense.simulate.run import RigState, Run, run

__all__ = [
    "Placed",
    "Rig",
    "RigState",
    "Run",
    "Sensor",
    "all_wires",
    "codes_of",
    "finger_rig",
    "linear_rig",
    "random_motion",
    "read_rig",
    "run",
    "simulate",
    "to_recording",
    "triangle",
]
