"""What the simulator says without its noise, and how noisy a recording is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from softsense.effects import Nominal, Reference
from softsense.effects.operators import low_pass, play

Floats = NDArray[np.float64]
KNOTS = 16
ALL = slice(None)
# Weights of the average over two thirds of a second, and the share of white noise that it keeps.
AVERAGE = np.hanning(15)[1:-1] / np.hanning(15).sum()
AVERAGED_NOISE = float((AVERAGE**2).sum())
# Smaller strokes, as shares of the range, are no strokes; larger ones are alike within so much.
TREMBLE = 0.05
ALIKE = 0.1


@dataclass(frozen=True)
class Motion:
    """The common motion: ``strain`` 0 … 1, and the ``largest`` so far, of its range."""

    strain: Floats
    largest: Floats
    dt_s: float
    start_s: float
    temp_c: Floats | None

    def strokes_alike(self) -> bool:
        """Whether the strain goes to and fro between the same ends at one rate, nothing else.

        What happens after a smaller stroke, a faster one or a rest is not seen then.
        """
        smooth = np.convolve(self.strain, AVERAGE, "valid")
        turns = np.flatnonzero(np.diff(np.sign(np.diff(smooth))) != 0) + 1
        strokes = np.abs(np.diff(smooth[turns]))
        long = strokes > TREMBLE
        paces = strokes[long] / np.diff(turns)[long]
        return bool(
            len(paces) > 1
            and strokes[long].std() < ALIKE * strokes[long].mean()
            and paces.std() < ALIKE * paces.mean()
        )


def motion_of(
    target: Floats,
    dt_s: float,
    start_s: float,
    temp_c: Floats | None,
    low: float | None = None,
    high: float | None = None,
) -> Motion:
    """The motion ``target`` (samples,), as shares of ``low`` … ``high`` (its own where absent)."""
    low = float(target.min()) if low is None else low
    high = float(target.max()) if high is None else high
    strain = (target - low) / ((high - low) or 1.0)
    return Motion(strain, np.maximum.accumulate(strain), dt_s, start_s, temp_c)


def spline_basis(values: Floats, knots: int = KNOTS) -> Floats:
    """(samples, knots + 2) cubic B-splines over the range of ``values`` (0 … 1, clipped)."""
    inside = np.clip(values, 0.0, 1.0 - 1e-12)
    basis: Floats = BSpline.design_matrix(inside, _knots(knots), 3).toarray()
    return basis


def _knots(knots: int) -> Floats:
    return np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, knots), [1.0] * 3])


def noise_rms(signal: Floats) -> Floats:
    """(channels,) noise of ``signal`` (samples, channels), from third differences.

    Slow parts vanish in differences; the square root of 20 is their gain for white noise. The
    median of windows keeps fast moves out.
    """
    third = np.diff(signal, 3, axis=0) / np.sqrt(20.0)
    windows = np.array_split(third, 64)
    level = np.sqrt(np.median([np.mean(w**2, axis=0) for w in windows], axis=0))
    # Rounding to whole codes alone makes 0.29.
    result: Floats = np.maximum(level, 0.29)
    return result


def history_basis(x: Floats, dt_s: float) -> Floats:
    """(samples, columns) a static curve of the strain, and what mechanisms make of its history."""
    return np.concatenate([spline_basis(x), *history_parts(x, dt_s)], axis=1)


def history_parts(x: Floats, dt_s: float, keep: slice = ALL) -> list[Floats]:
    """``history_basis`` behind its static curve, mechanism by mechanism."""
    return [*history_groups(x, dt_s, keep).values(), np.maximum.accumulate(x)[keep, None]]


def history_groups(x: Floats, dt_s: float, keep: slice = ALL) -> dict[str, Floats]:
    """(kept samples, columns) by mechanism: relaxing parts, play, and the filtered rate."""
    taus = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
    relaxing = [
        low_pass(signal[:, None], dt_s, np.array([tau]), None)[0][keep]
        for signal in (x, x**2)
        for tau in taus
    ]
    widths = np.array([0.03, 0.1, 0.3, 0.6])
    speed = np.abs(np.gradient(x))[:, None] / dt_s
    broken = [low_pass(speed, dt_s, np.array([tau]), None)[0][keep] for tau in (0.1, 0.5, 2.0)]
    return {
        "relaxation": np.concatenate(relaxing, axis=1),
        "hysteresis": play(np.repeat(x[:, None], 4, axis=1), widths, np.full(4, x[0]))[keep],
        "overshoot": np.concatenate(broken, axis=1),
    }


def history_weights(codes: Floats, motion: Motion) -> Floats:
    """(columns, channels) of ``history_basis`` that say the simulated ``codes``."""
    basis = history_basis(motion.strain, motion.dt_s)
    scale = np.sqrt((basis**2).mean(axis=0)) + 1e-12
    scaled = basis / scale
    gram = scaled.T @ scaled
    gram[np.diag_indices_from(gram)] += 1e-9 * len(basis)
    weights: Floats = np.linalg.solve(gram, scaled.T @ codes) / scale[:, None]
    return weights


def denoise(codes: Floats, motion: Motion) -> Floats:
    """(samples, channels) nominal codes as a smooth function of strain and its history.

    The noise of the simulated codes is left out, which would otherwise look like a lag.
    """
    smooth: Floats = history_basis(motion.strain, motion.dt_s) @ history_weights(codes, motion)
    # What this cannot say is kept, averaged over two thirds of a second.
    left = codes - smooth
    smooth += np.stack([np.convolve(column, AVERAGE, "same") for column in left.T], axis=1)
    return smooth


def reference_of(codes: Floats, motion: Motion) -> Reference:
    """The yardsticks of a recording with noiseless ``codes``."""
    duration_s = len(codes) * motion.dt_s
    return Reference(
        codes[0].copy(), codes.min(axis=0), np.ptp(codes, axis=0), motion.start_s, duration_s
    )


def nominals(
    codes: Floats, heard: Floats, motion: Motion, bits: int, reference: Reference
) -> list[Nominal]:
    """One ``Nominal`` per channel of noiseless ``codes``, which read ``heard`` in truth."""
    weights = history_weights(codes, motion)
    known: dict[tuple[bytes, int | None], Floats] = {}
    curve = BSpline(_knots(KNOTS), weights[: KNOTS + 2], 3)

    def said_of(strain: Floats, keep: slice) -> Floats:
        """``history_basis`` times its weights, without the table of the splines."""
        said: Floats = curve(np.clip(strain[keep], 0.0, 1.0 - 1e-12))
        at = KNOTS + 2
        for part in history_parts(strain, motion.dt_s, keep):
            said += part @ weights[at : at + part.shape[1]]
            at += part.shape[1]
        return said

    def all_channels(strain: Floats, keep: slice) -> Floats:
        # Channels ask for the same strains one after the other.
        key = strain.tobytes(), keep.step
        if key not in known:
            known[key] = said_of(strain, keep)
        return known[key]

    def respond_of(channel: int) -> Callable[[Floats, slice], Floats]:
        return lambda strain, keep: all_channels(strain, keep)[:, channel]

    return [
        Nominal(
            codes=codes,
            heard=heard,
            channel=channel,
            strain=motion.strain,
            dt_s=motion.dt_s,
            respond=respond_of(channel),
            largest=motion.largest,
            reference=reference,
            start_s=motion.start_s,
            temp_c=motion.temp_c,
            full_scale=float(2**bits - 1),
        )
        for channel in range(codes.shape[1])
    ]
