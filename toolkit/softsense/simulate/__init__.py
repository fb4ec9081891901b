"""The two rigs of the paper as a simulator: strain, stress, resistance, divider, ADC codes.

``linear_rig`` and ``run`` are the short way in; ``Rig`` is the whole description as data.
"""

from __future__ import annotations

from softsense.simulate.linear import linear_rig
from softsense.simulate.rig import Placed, Rig, Sensor, read_rig
from softsense.simulate.run import RigState, Run, run

__all__ = ["Placed", "Rig", "RigState", "Run", "Sensor", "linear_rig", "read_rig", "run"]
