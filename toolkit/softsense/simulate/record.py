"""What a run leaves behind: a ``Recording``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softsense.recording import FrontEnd, Recording, unit_of
from softsense.simulate.rig import Rig
from softsense.simulate.run import Run

Floats = NDArray[np.float64]


def to_recording(rig: Rig, strain: Floats, result: Run) -> Recording:
    """The run as a recording of codes. ``strain``: (samples,) share of the rig's range."""
    first = result.state.samples - len(strain)
    return Recording(
        name=rig.name,
        sensors=rig.names,
        codes=result.codes,
        targets=(rig.target,),
        target_units=(unit_of(rig.target),),
        target=(rig.low + (rig.high - rig.low) * strain)[:, None],
        t_s=np.arange(first, result.state.samples) / rig.rate_hz,
        front_ends=tuple(FrontEnd("codes", rig.adc_bits) for _ in rig.sensors),
    )
