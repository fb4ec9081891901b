"""Pictures of sensors: loops, curves and what was measured. matplotlib without a display."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from softsense.recording import Recording
from softsense.simulate.characterise import Character, TwoFactor
from softsense_codegen.atomic import write_bytes

# More points than this hide each other and swell the file.
_POINTS = 4000
_INK, _RISE, _FALL = "#222222", "#0072b2", "#d55e00"


def draw(
    recording: Recording, character: Character, folder: Path, nets: tuple[TwoFactor, ...] = ()
) -> tuple[Path, ...]:
    """Write ``loops``, ``time`` and ``summary`` as PNG and SVG; ``two_factor`` with ``nets``."""
    figures = {
        "loops": _loops(recording, character),
        "time": _time(recording),
        "summary": _summary(character),
    }
    if nets:
        figures["two_factor"] = _two_factor(nets)
    written = []
    # A fixed salt and no date: the same recording gives the same file.
    with matplotlib.rc_context({"svg.hashsalt": "softsense", "svg.fonttype": "path"}):
        for name, figure in figures.items():
            for kind in ("png", "svg"):
                buffer = BytesIO()
                metadata = {"Date": None} if kind == "svg" else {"Software": None}
                figure.savefig(buffer, format=kind, dpi=110, metadata=metadata)
                written.append(write_bytes(folder / f"{name}.{kind}", buffer.getvalue()))
    return tuple(written)


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _loops(recording: Recording, character: Character) -> Figure:
    """Code over target, one panel per sensor, with the rising and the falling mean."""
    count = len(character.sensors)
    columns = min(count, 4)
    rows = -(-count // columns)
    figure = _figure(3.1 * columns, 2.6 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    step = max(len(recording) // _POINTS, 1)
    for axis in axes.flat[count:]:
        axis.set_visible(False)
    for axis, sensor, number in zip(axes.flat, character.sensors, range(count), strict=False):
        axis.plot(
            recording.target[::step, 0],
            recording.codes[::step, number],
            ".",
            ms=1.5,
            mew=0,
            color="#999999",
            rasterized=True,
        )
        axis.plot(character.target_bins, sensor.curve_rising, color=_RISE, lw=1.4, label="rising")
        axis.plot(character.target_bins, sensor.curve_falling, color=_FALL, lw=1.4, label="falling")
        title = f"{sensor.name} {sensor.matrix}".strip()
        axis.set_title(f"{title}: loop {100 * sensor.loop_area_share:.1f} %", fontsize=9)
        axis.set_xlabel(_label(character), fontsize=8)
        axis.tick_params(labelsize=7)
    axes.flat[0].set_ylabel("code", fontsize=8)
    axes.flat[0].legend(fontsize=7, frameon=False)
    return figure


def _time(recording: Recording) -> Figure:
    """Target and every sensor over time, each on its own scale."""
    count = len(recording.sensors) + 1
    figure = _figure(9.0, 0.9 * count + 0.6)
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    time = np.arange(len(recording)) * recording.dt_s
    step = max(len(recording) // (2 * _POINTS), 1)
    series = [(recording.targets[0], recording.target[:, 0])]
    series += [
        (name, recording.codes[:, i].astype(np.float64)) for i, name in enumerate(recording.sensors)
    ]
    for axis, (name, values) in zip(axes, series, strict=True):
        axis.plot(time[::step], values[::step], color=_INK, lw=0.6)
        axis.set_ylabel(name, fontsize=8, rotation=0, ha="right", va="center")
        axis.tick_params(labelsize=7)
    axes[-1].set_xlabel("time (s)", fontsize=8)
    return figure


def _summary(character: Character) -> Figure:
    """Bars: loop area, drift and overshoot as shares of the span, and the static error."""
    names = [sensor.name for sensor in character.sensors]
    panels = (
        ("loop area, share of span", [s.loop_area_share for s in character.sensors]),
        ("drift over the recording, share of span", [s.drift_share for s in character.sensors]),
        ("overshoot at fast moves, share of span", [s.overshoot_share for s in character.sensors]),
        (
            f"best static estimate, RMSE ({character.unit})",
            [s.static_rmse for s in character.sensors],
        ),
    )
    figure = _figure(10.0, 5.2)
    for axis, (title, values) in zip(figure.subplots(2, 2).flat, panels, strict=True):
        axis.bar(names, values, color=_RISE)
        axis.axhline(0.0, color=_INK, lw=0.6)
        axis.set_title(title, fontsize=9)
        axis.tick_params(labelsize=7)
    return figure


def _two_factor(nets: tuple[TwoFactor, ...]) -> Figure:
    """What is left unexplained of the resistance: from strain, and from strain and stress."""
    figure = _figure(6.5, 3.0)
    axis = figure.subplots()
    at = np.arange(len(nets))
    axis.bar(at - 0.2, [1.0 - n.from_strain_r2 for n in nets], 0.4, color=_FALL, label="strain")
    axis.bar(
        at + 0.2,
        [1.0 - n.from_strain_and_stress_r2 for n in nets],
        0.4,
        color=_RISE,
        label="strain and stress",
    )
    axis.set_yscale("log")
    axis.set_xticks(at, [net.name for net in nets])
    axis.set_ylabel("unexplained share of ln R")
    axis.legend(frameon=False, fontsize=8)
    return figure


def _label(character: Character) -> str:
    return character.target if character.unit == "1" else f"{character.target} ({character.unit})"
