"""Run a rig: strain in, resistance and ADC codes out, with the hidden states carried along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softsense.effects import Context, State, effect
from softsense.simulate.finger import Pose, move
from softsense.simulate.rig import Place, Placed, Rig

Floats = NDArray[np.float64]
Codes = NDArray[np.int32]


@dataclass(frozen=True)
class RigState:
    """Where a run stood: samples so far, the state of every effect in order, and the body's."""

    samples: int
    effects: tuple[State, ...]
    body: State


@dataclass(frozen=True)
class Run:
    """What happened, in samples.

    ``strain``: (samples,) as driven, a share of the rig's range. ``stress``, ``ohm``, ``volts``,
    ``codes``: (samples, sensors); ``stress`` and ``volts`` are shares of their scales.
    ``pose``: the finger's, where the body is one. ``state``: at the end.
    """

    strain: Floats
    stress: Floats
    ohm: Floats
    volts: Floats
    codes: Codes
    pose: Pose | None
    state: RigState


def run(
    rig: Rig,
    strain: Floats,
    seed: int = 0,
    state: RigState | None = None,
    temp_c: Floats | None = None,
) -> Run:
    """Drive ``rig`` with ``strain``: (samples,) shares of the rig's range.

    Two runs, the second with the ``state`` of the first, give the samples of one. ``seed`` draws
    all that is random in the effects; it is not used again where a ``state`` is given.
    """
    done = 0 if state is None else state.samples
    dt_s = 1.0 / rig.rate_hz
    lsb = 1.0 / (2**rig.adc_bits - 1)
    after: list[State] = [{} for _ in rig.effects]
    body: State = {}
    pose = None
    felt = np.repeat(strain[:, None], len(rig.sensors), axis=1)
    if rig.body == "finger":
        pose, body = move(strain, dt_s, state.body if state else None)
        along = _row(rig, "along")
        felt = pose.arcs[:, :1] * (1.0 - along) + pose.arcs[:, 1:] * along
    shared = np.ascontiguousarray(felt.mean(axis=1)) if pose else strain

    def stage(signal: Floats, place: Place) -> Floats:
        for index, placed in enumerate(rig.effects):
            if placed.at == place:
                rng = np.random.default_rng(np.random.SeedSequence([seed, 0x6566, index]))
                context = Context(dt_s, shared, done * dt_s, temp_c, lsb, rng)
                before = None if state is None else state.effects[index]
                signal, after[index] = _apply(rig, placed, signal, context, before)
        return signal

    x = stage(felt * _row(rig, "transfer"), "motion")
    tension, share = _row(rig, "tension"), _row(rig, "stress_share")
    stress = stage((1.0 - tension) * x + tension * x**3, "stress")
    response = stage(_curves(rig, (1.0 - share) * x + share * stress), "response")
    ohm = np.maximum(_row(rig, "base_ohm") * (1.0 + _row(rig, "span") * response), 0.0)
    volts = stage(ohm / (ohm + _row(rig, "reference_ohm")), "electrical")
    top = 2**rig.adc_bits - 1
    codes = np.clip(np.floor(volts * top + 0.5), 0, top).astype(np.int32)
    return Run(
        strain, stress, ohm, volts, codes, pose, RigState(done + len(strain), tuple(after), body)
    )


def _row(rig: Rig, name: str) -> Floats:
    """One number of every sensor, (sensors,)."""
    return np.array([getattr(sensor, name) for sensor in rig.sensors], dtype=np.float64)


def _apply(
    rig: Rig, placed: Placed, signal: Floats, context: Context, state: State | None
) -> tuple[Floats, State]:
    changed, state = effect(placed.name).apply(
        signal, context, placed.parameters, placed.form or None, state
    )
    if not placed.channels:
        return changed, state
    result = signal.copy()
    columns = [rig.names.index(name) for name in placed.channels]
    result[:, columns] = changed[:, columns]
    return result, state


def _curves(rig: Rig, z: Floats) -> Floats:
    """Each sensor's curve, straight between its points and beyond its ends."""
    result = np.empty_like(z)
    for channel, sensor in enumerate(rig.sensors):
        curve = np.array(sensor.curve)
        at = (z[:, channel] - sensor.curve_low) / (sensor.curve_high - sensor.curve_low)
        at = at * (len(curve) - 1)
        piece = np.clip(np.floor(at), 0, len(curve) - 2).astype(np.intp)
        result[:, channel] = curve[piece] + (at - piece) * (curve[piece + 1] - curve[piece])
    return result
