"""Run a rig: strain in, resistance and ADC codes out, with the hidden states carried along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softsense.effects import Context, State, effect
from softsense.simulate.rig import Place, Placed, Rig

Floats = NDArray[np.float64]
Codes = NDArray[np.int32]


@dataclass(frozen=True)
class RigState:
    """Where a run stood: samples so far and the state of every effect in order."""

    samples: int
    effects: tuple[State, ...]


@dataclass(frozen=True)
class Run:
    """What the sensors did, (samples, sensors) each: ``stress`` and ``ohm`` as the matter has
    them, ``codes`` as the ADC gives them, and the ``state`` at the end.
    """

    stress: Floats
    ohm: Floats
    codes: Codes
    state: RigState


def run(
    rig: Rig,
    strain: Floats,
    seed: int = 0,
    state: RigState | None = None,
    temp_c: Floats | None = None,
) -> Run:
    """Drive ``rig`` with ``strain``: (samples,) or (samples, sensors), shares of its range.

    Two runs, the second with the ``state`` of the first, give the samples of one. ``seed`` draws
    all that is random in the effects; it is not used again where a ``state`` is given.
    """
    channels = len(rig.sensors)
    felt = np.repeat(strain[:, None], channels, axis=1) if strain.ndim == 1 else strain
    shared = np.ascontiguousarray(felt.mean(axis=1)) if strain.ndim == 2 else strain
    done = 0 if state is None else state.samples
    dt_s = 1.0 / rig.rate_hz
    lsb = 1.0 / (2**rig.adc_bits - 1)
    after: list[State] = [{} for _ in rig.effects]

    def stage(signal: Floats, place: Place) -> Floats:
        for index, placed in enumerate(rig.effects):
            if placed.at == place:
                rng = np.random.default_rng(np.random.SeedSequence([seed, 0x6566, index]))
                context = Context(dt_s, shared, done * dt_s, temp_c, lsb, rng)
                before = None if state is None else state.effects[index]
                signal, after[index] = _apply(rig, placed, signal, context, before)
        return signal

    x = stage(felt, "motion")
    tension = np.array([sensor.tension for sensor in rig.sensors])
    stress = stage((1.0 - tension) * x + tension * x**3, "stress")
    share = np.array([sensor.stress_share for sensor in rig.sensors])
    response = stage(_curves(rig, (1.0 - share) * x + share * stress), "response")
    base = np.array([sensor.base_ohm for sensor in rig.sensors])
    span = np.array([sensor.span for sensor in rig.sensors])
    ohm = np.maximum(base * (1.0 + span * response), 0.0)
    reference = np.array([sensor.reference_ohm for sensor in rig.sensors])
    volts = stage(ohm / (ohm + reference), "electrical")
    top = 2**rig.adc_bits - 1
    codes = np.clip(np.floor(volts * top + 0.5), 0, top).astype(np.int32)
    return Run(stress, ohm, codes, RigState(done + len(felt), tuple(after)))


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
