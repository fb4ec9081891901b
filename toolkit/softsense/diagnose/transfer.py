"""A diagnosed effect back into the rig: the simulator's own equation, fitted to what was found.

The diagnosis says what an effect adds to the codes, in columns of its own; a rig needs the
parameters of ``Effect.simulate``. They are fitted per channel by least squares on the codes that
the whole rig then gives (Gauss-Newton with damping and a numerical Jacobian).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softsense.diagnose.engine import Diagnosis, Trace, change_of
from softsense.effects import Effect, all_effects
from softsense.recording import Recording
from softsense.simulate import Rig, run
from softsense.simulate.rig import Place, Placed, Value

Floats = NDArray[np.float64]

PLACE: dict[str, Place] = {"motion": "motion", "material": "response", "electrical": "electrical"}
# Numbers that name something: not to be fitted.
NAMED = {"source", "every"}
STEPS = 12
# A range of so many times its lower end is searched from several starts.
WIDE = 20.0


@dataclass(frozen=True)
class Carried:
    """An effect in the rig, and the share (0 … 1) of the diagnosed change that it makes there."""

    placed: Placed
    share: float


def into_rig(diagnosis: Diagnosis, rig: Rig, sim: Recording) -> tuple[Rig, tuple[Carried, ...]]:
    """``rig`` with the diagnosed effects, and what each of them reproduces.

    ``sim``: the recording of ``rig`` that was diagnosed. Effects without a mean (noise, spikes,
    lines, walks) stay out: their size is in diagnosis.json. So does what the simulator's own
    equation would only make worse: its share is 0. What one leaves over is up to the others too.
    """
    strain = (sim.target[:, 0] - rig.low) / (rig.high - rig.low)
    names = sorted({trace.effect for trace in diagnosis.traces}, key=list(all_effects()).index)
    traces = {name: [t for t in diagnosis.traces if t.effect == name] for name in names}
    meant = {name: _change(diagnosis, traces[name], sim.adc_bits) for name in names}
    carried: dict[str, Carried] = {}
    first = run(rig, strain).codes
    # The second time each makes up for what all others do otherwise than meant.
    for _ in range(2 if len(names) > 1 else 1):
        for name in names:
            beside = _with(rig, [carried[other] for other in carried if other != name])
            wanted = np.sum([meant[o] for o in names if o == name or o in carried], axis=0)
            goal: Floats = wanted - (run(beside, strain).codes - first)
            carried[name] = _carried(beside, strain, name, traces[name], goal)
    return _with(rig, list(carried.values())), tuple(carried.values())


def _change(diagnosis: Diagnosis, traces: Sequence[Trace], bits: int) -> Floats:
    """(samples, channels) codes that these traces add."""
    return change_of(replace(diagnosis, traces=tuple(traces), static=np.zeros((0, 0))), bits)


def _with(rig: Rig, carried: Sequence[Carried]) -> Rig:
    placed = (one.placed for one in carried if one.share > 0.0)
    return replace(rig, effects=(*rig.effects, *placed))


def _carried(rig: Rig, strain: Floats, name: str, traces: Sequence[Trace], goal: Floats) -> Carried:
    active = [trace.channel for trace in traces]
    before = run(rig, strain).codes.astype(np.float64)
    best: Carried | None = None
    effect = all_effects()[name]
    wide = [p for p in effect.parameters if p.low > 0.0 and p.high > WIDE * p.low]
    starts = [{p.name: value} for p in wide[:1] for value in np.geomspace(p.low, p.high, 6)[1:5]]
    for form in effect.forms:
        for start in [{}, *starts]:
            made = _fitted(rig, strain, effect, form, start, traces, goal[:, active], before)
            if best is None or made.share > best.share:
                best = made
    assert best is not None
    return best


def _fitted(
    rig: Rig,
    strain: Floats,
    effect: Effect,
    form: str,
    start: Mapping[str, float],
    traces: Sequence[Trace],
    goal: Floats,
    before: Floats,
) -> Carried:
    active = [trace.channel for trace in traces]
    parameters = effect.parameters
    free = [p for p in parameters if p.name not in NAMED]
    values = {p.name: np.full(len(rig.sensors), start.get(p.name, p.default)) for p in parameters}
    for trace in traces:
        for key in values.keys() & trace.values.keys():
            values[key][trace.channel] = trace.values[key]
    low, high = np.array([p.low for p in free]), np.array([p.high for p in free])
    channels = tuple(rig.names[channel] for channel in active)

    def placed(theta: Floats) -> Placed:
        given = {key: value.copy() for key, value in values.items()}
        for number, parameter in enumerate(free):
            given[parameter.name][active] = theta[number]
        filled: dict[str, Value] = {
            key: tuple(float(v) for v in value) for key, value in given.items()
        }
        return Placed(effect.name, PLACE[effect.stage], filled, form, channels)

    def change(theta: Floats) -> Floats:
        trial = replace(rig, effects=(*rig.effects, placed(theta)))
        result: Floats = (run(trial, strain).codes - before)[:, active]
        return result

    theta = np.stack([np.clip(values[p.name][active], p.low, p.high) for p in free])
    now = change(theta)
    error = ((goal - now) ** 2).sum(axis=0)
    damping = np.full(len(active), 1e-3)
    for _ in range(STEPS):
        step = 0.02 * (high - low)
        slopes = []
        for number in range(len(free)):
            moved = theta.copy()
            # Towards the middle, so that the bounds are kept.
            way = np.where(theta[number] > 0.5 * (low + high)[number], -1.0, 1.0) * step[number]
            moved[number] += way
            slopes.append((change(moved) - now) / way)
        jacobian = np.stack(slopes)
        trial = theta.copy()
        for column in range(len(active)):
            j = jacobian[:, :, column]
            gram = j @ j.T
            gram += (damping[column] + 1e-9) * np.diag(np.diag(gram) + 1e-9)
            move = np.linalg.solve(gram, j @ (goal - now)[:, column])
            trial[:, column] = np.clip(theta[:, column] + move, low, high)
        then = change(trial)
        errors = ((goal - then) ** 2).sum(axis=0)
        better = errors < error
        theta[:, better], now[:, better] = trial[:, better], then[:, better]
        error = np.minimum(error, errors)
        damping = np.where(better, damping / 3.0, damping * 5.0)
    share = float(np.clip(1.0 - error.sum() / max(float((goal**2).sum()), 1e-9), 0.0, 1.0))
    return Carried(placed(theta), share)
