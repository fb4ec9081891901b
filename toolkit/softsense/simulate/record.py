"""What a run leaves behind: a recording, a table of resistances, a state to continue from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError
from softsense.recording import TIME_COLUMN, FrontEnd, Recording, unit_of
from softsense.simulate.motion import random_motion
from softsense.simulate.rig import Rig
from softsense.simulate.run import RigState, Run, run
from softsense_codegen.atomic import write_text

Floats = NDArray[np.float64]
_STATE_SCHEMA = "softsense.rig-state/1"


def truths(rig: Rig, result: Run) -> dict[str, Floats]:
    """Every column of truth by name: strain, or pose and pressure of a finger."""
    if result.pose is None:
        return {rig.target: rig.low + (rig.high - rig.low) * result.strain}
    pose = result.pose
    return {
        "x_px": pose.x_px,
        "y_px": pose.y_px,
        "bend_deg": pose.bend_deg,
        "pressure_kpa": pose.pressure_kpa,
    }


def times_s(rig: Rig, result: Run) -> Floats:
    """(samples,) seconds since the rig was first moved."""
    first = result.state.samples - len(result.strain)
    times: Floats = np.arange(first, result.state.samples) / rig.rate_hz
    return times


def codes_of(rig: Rig) -> dict[str, FrontEnd]:
    """The front end of each sensor: a rig says ADC codes, not what stands before its dividers."""
    return dict.fromkeys(rig.names, FrontEnd("codes", rig.adc_bits))


def to_recording(rig: Rig, result: Run, temp_c: Floats | None = None) -> Recording:
    """The run as a recording of codes. A finger's targets are x_px, y_px and bend_deg."""
    columns = truths(rig, result)
    context = {"pressure_kpa": columns.pop("pressure_kpa")} if result.pose else {}
    if temp_c is not None:
        context["temp_c"] = temp_c
    return Recording(
        name=rig.name,
        sensors=rig.names,
        codes=result.codes,
        targets=tuple(columns),
        target_units=tuple(unit_of(name) for name in columns),
        target=np.stack(list(columns.values()), axis=1),
        t_s=times_s(rig, result),
        front_ends=tuple(codes_of(rig).values()),
        context=context,
    )


def simulate(rig: Rig, samples: int = 8000, seed: int = 0) -> Recording:
    """The recording of ``rig`` under the pseudo-random motion of ``seed``."""
    return to_recording(rig, run(rig, random_motion(samples, 1.0 / rig.rate_hz, seed), seed))


def write_ohms(rig: Rig, result: Run, path: Path, temp_c: Floats | None = None) -> Path:
    """Write resistances in ohm as CSV, as the front end sees them before the ADC rounds."""
    reference = np.array([sensor.reference_ohm for sensor in rig.sensors])
    # A divider at its rail would read an infinite resistance.
    volts = np.clip(result.volts, 0.0, 1.0 - 1e-6)
    ohm = reference * volts / (1.0 - volts)
    columns = {TIME_COLUMN: times_s(rig, result), **truths(rig, result)}
    if temp_c is not None:
        columns["temp_c"] = temp_c
    columns.update(zip(rig.names, ohm.T, strict=True))
    texts = [
        [f"{value:.6f}" if name == TIME_COLUMN else f"{value:.9g}" for value in column.tolist()]
        for name, column in columns.items()
    ]
    lines = [",".join(columns), *(",".join(row) for row in zip(*texts, strict=True))]
    return write_text(path, "\n".join(lines) + "\n")


def write_state(rig: Rig, seed: int, state: RigState, path: Path) -> Path:
    """Write everything that a later run needs to go on where this one stopped."""
    data = {
        "schema": _STATE_SCHEMA,
        "rig": rig.to_toml(),
        "seed": seed,
        "samples": state.samples,
        "effects": [_plain(one) for one in state.effects],
        "body": _plain(state.body),
    }
    return write_text(path, json.dumps(data) + "\n")


def read_state(path: Path) -> tuple[Rig, int, RigState]:
    """The rig, its seed and its state. Raises ``SoftsenseError`` for a foreign or broken file."""
    try:
        data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if data["schema"] != _STATE_SCHEMA:
            raise ValueError(f"schema {data['schema']!r}")
        effects = tuple(_arrays(one) for one in data["effects"])
        state = RigState(int(data["samples"]), effects, _arrays(data["body"]))
        return Rig.from_toml(data["rig"], str(path)), int(data["seed"]), state
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SoftsenseError(
            f"not the state of a rig: {error}", where=str(path), remedy="write one: --save-state"
        ) from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {"array": value.tolist(), "shape": value.shape}
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    return value


def _arrays(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"array", "shape"}:
            return np.array(value["array"], dtype=np.float64).reshape(value["shape"])
        return {key: _arrays(part) for key, part in value.items()}
    return value
