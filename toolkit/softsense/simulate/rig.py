"""A rig: sensors, the effects in them and the front end, as data that a text file holds whole.

A sensor's chain, every quantity a share of its nominal span (0 at rest, 1 at full strain)::

    x       strain that the sensor feels: the body's, transferred, with the effects "motion"
    stress  tension(x) with the effects "stress"
    u       curve((1 - stress_share) x + stress_share * stress) with the effects "response"
    R       base_ohm (1 + span u)
    volts   R / (R + reference_ohm) with the effects "electrical"
    code    floor(volts (2^bits - 1) + 1/2), held within 0 … 2^bits - 1
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softsense.effects import effect
from softsense.errors import SoftsenseError

Floats = NDArray[np.float64]
SCHEMA = "softsense.rig/1"
Place = Literal["motion", "stress", "response", "electrical"]
PLACES: tuple[Place, ...] = ("motion", "stress", "response", "electrical")
_STAGE_OF = {
    "motion": "motion",
    "stress": "material",
    "response": "material",
    "electrical": "electrical",
}
# A parameter of a placed effect: one number, one per sensor, or several per sensor.
Value = float | tuple[float, ...] | tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Sensor:
    """One wire. ``curve``: u at equally spaced strains ``curve_low`` … ``curve_high`` (shares of
    the strain range), straight between and beyond. ``tension``: the settled stress is
    (1 - tension) x + tension x^3. ``transfer``: strain that reaches the sensor, as a share of the
    body's; ``along``: where it lies on a finger, from 0 at the root to 1 at the tip.
    """

    name: str
    matrix: str
    sample: int
    base_ohm: float
    reference_ohm: float
    span: float
    curve: tuple[float, ...] = (0.0, 1.0)
    curve_low: float = 0.0
    curve_high: float = 1.0
    stress_share: float = 0.0
    tension: float = 0.0
    along: float = 0.0
    transfer: float = 1.0

    def __post_init__(self) -> None:
        if len(self.curve) < 2 or self.curve_high <= self.curve_low:
            raise ValueError(f"{self.name}: a curve has two points or more, from low to high")
        if self.base_ohm <= 0 or self.reference_ohm <= 0:
            raise ValueError(f"{self.name}: resistances are above zero")


@dataclass(frozen=True)
class Placed:
    """An effect in a rig. ``channels``: names of the sensors that have it; () means all."""

    name: str
    at: Place
    parameters: dict[str, Value]
    form: str = ""
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known = effect(self.name)
        if self.at not in PLACES:
            raise ValueError(f"{self.name}: no place {self.at!r}: {', '.join(PLACES)}")
        # A delay or a lag may sit anywhere; the others belong where their physics is.
        if self.name not in ("delay", "lag") and known.stage != _STAGE_OF[self.at]:
            raise ValueError(f"{self.name} is of stage {known.stage}, not {self.at}")
        unknown = sorted(set(self.parameters) - set(known.defaults()))
        if unknown:
            raise ValueError(f"{self.name} has no parameter {', '.join(unknown)}")
        if self.form not in ("", *known.forms):
            raise ValueError(f"{self.name} has no form {self.form!r}: {', '.join(known.forms)}")


@dataclass(frozen=True)
class Rig:
    """Sensors under one motion.

    ``target``: the quantity that drives the rig, ``low`` at rest and ``high`` at full strain: the
    strain itself, or the pressure of a finger.
    """

    name: str
    sensors: tuple[Sensor, ...]
    effects: tuple[Placed, ...]
    body: Literal["linear", "finger"] = "linear"
    target: str = "strain"
    low: float = 0.0
    high: float = 0.4
    rate_hz: float = 20.0
    adc_bits: int = 12
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        if not self.sensors:
            raise ValueError("a rig has one sensor or more")
        if not (self.high > self.low and self.rate_hz > 0 and 4 <= self.adc_bits <= 15):
            raise ValueError(
                "a rig's target range and rate are above zero, its ADC has 4 … 15 bits"
            )
        names = self.names
        if len(set(names)) != len(names):
            raise ValueError("two sensors of a rig have the same name")
        for placed in self.effects:
            lost = [name for name in placed.channels if name not in names]
            if lost:
                raise ValueError(f"{placed.name}: there is no sensor {', '.join(lost)}")
            for key, value in placed.parameters.items():
                if isinstance(value, tuple) and len(value) != len(names):
                    raise ValueError(
                        f"{placed.name}.{key}: {len(value)} values for {len(names)} sensors"
                    )

    @property
    def names(self) -> tuple[str, ...]:
        """Sensors in order."""
        return tuple(sensor.name for sensor in self.sensors)

    def to_toml(self) -> str:
        """Text from which ``from_toml`` makes the identical rig."""
        lines = [*(f"# {note}" for note in self.notes), f"schema = {_toml(SCHEMA)}"]
        for key in ("name", "body", "target", "low", "high", "rate_hz", "adc_bits"):
            lines.append(f"{key} = {_toml(getattr(self, key))}")
        for sensor in self.sensors:
            lines += ["", "[[sensors]]", *(f"{k} = {_toml(v)}" for k, v in vars(sensor).items())]
        for placed in self.effects:
            lines += ["", "[[effects]]"]
            for key in ("name", "at", "form", "channels"):
                value = getattr(placed, key)
                if value:
                    lines.append(f"{key} = {_toml(value)}")
            lines.append("[effects.parameters]")
            lines += [f"{key} = {_toml(value)}" for key, value in placed.parameters.items()]
        return "\n".join(lines) + "\n"

    @classmethod
    def from_toml(cls, text: str, where: str = "rig.toml") -> Rig:
        """The inverse of ``to_toml``. Raises ``SoftsenseError`` for a file that is no rig."""
        try:
            data: dict[str, Any] = tomllib.loads(text)
            if data.pop("schema", None) != SCHEMA:
                raise SoftsenseError(
                    "not a rig", where=where, remedy=f'its first line is schema = "{SCHEMA}"'
                )
            sensors = tuple(
                Sensor(**{**entry, "curve": tuple(map(float, entry.get("curve", (0.0, 1.0))))})
                for entry in data.pop("sensors")
            )
            effects = tuple(
                Placed(
                    name=entry["name"],
                    at=entry["at"],
                    parameters={k: _value(v) for k, v in entry.get("parameters", {}).items()},
                    form=entry.get("form", ""),
                    channels=tuple(entry.get("channels", ())),
                )
                for entry in data.pop("effects", [])
            )
            notes = []
            for line in text.splitlines():
                if not line.startswith("#"):
                    break
                notes.append(line[1:].removeprefix(" "))
            return cls(sensors=sensors, effects=effects, notes=tuple(notes), **data)
        except (ValueError, TypeError, KeyError) as error:
            what = f"no key {error}" if isinstance(error, KeyError) else str(error)
            raise SoftsenseError(
                f"not a whole rig: {what}", where=where, remedy="compare with a saved rig.toml"
            ) from error


def read_rig(path: str | Path) -> Rig:
    """The rig in a .toml file. Raises ``SoftsenseError``."""
    path = Path(path)
    try:
        return Rig.from_toml(path.read_text(encoding="utf-8"), where=str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise SoftsenseError(f"cannot be read: {error}", where=str(path)) from error


def _value(value: Any) -> Value:
    if isinstance(value, list):
        if value and isinstance(value[0], list):
            return tuple(tuple(float(part) for part in row) for row in value)
        return tuple(float(part) for part in value)
    return float(value)


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(part) for part in value) + "]"
    return repr(value)
