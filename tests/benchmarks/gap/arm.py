"""Made sim-to-real gaps of a soft continuum arm with a prosthetic hand.

Carbon-black fibres, dielectric-elastomer strips and ionic-gel strips are strained by one motion.
The simulator knows their curves, a little hysteresis and relaxation, and the room's temperature;
the real recording has the named effects as well. Every mechanism has several equations from the
literature: the seed draws one. Physics runs at 100 Hz; the board picks 20 Hz samples of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, exp, log, tanh
from typing import Any
from zlib import crc32

import numpy as np
from cases import NAMES, Case
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.ndimage import map_coordinates
from scipy.signal import bessel, butter, fftconvolve, freqs, lfilter, sosfiltfilt
from scipy.special import erf

from softsense.recording import FrontEnd, Recording

Floats = NDArray[np.float64]
Rng = np.random.Generator
Law = Callable[[float], Floats]

RATE = 20.0
OVER = 5
DT = 1.0 / RATE
H = DT / OVER
LEAD = 400
FIRST = 8000
SECOND = 4000
TOP = 4095.0
FULL = 4096.0

FOREIGN: tuple[str, ...] = (
    "intermittent_contact",
    "external_load",
    "buckling",
    "touch",
    "torsion",
    "lock_loss",
)
RETUNED: tuple[str, ...] = ()


def stream(seed: int, *tags: object) -> Rng:
    """An own random stream for each purpose of a seed."""
    return np.random.default_rng([seed, crc32(b"arm"), *(crc32(str(tag).encode()) for tag in tags)])


def spread(rng: Rng, low: float, high: float) -> float:
    """A log-uniform number."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def sign(rng: Rng, positive: float = 0.5) -> float:
    return 1.0 if rng.random() < positive else -1.0


def rms(x: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


# Motion


def jerkless(a: float, b: float, n: int) -> Floats:
    """A minimum-jerk move of n samples from a to b."""
    s = np.arange(1, n + 1) / n
    return np.asarray(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def smooth_noise(rng: Rng, n: int, cutoff: float, rate: float = 1.0 / H) -> Floats:
    """Gaussian noise under a cutoff in Hz, of unit rms."""
    pad = int(2.0 * rate / cutoff)
    raw = rng.normal(size=n + 2 * pad)
    out = sosfiltfilt(butter(2, cutoff, fs=rate, output="sos"), raw)[pad : pad + n]
    return np.asarray(out / np.std(out))


def piece(rng: Rng, kind: str, x: float, top: float) -> list[Floats]:
    """One activity of the arm, which starts at position x and stays in 0 ... top."""
    seconds = 1.0 / H

    def move(a: float, b: float, speed: float) -> Floats:
        return jerkless(a, b, max(int(seconds * max(abs(b - a) / speed, 0.25)), 1))

    def hold(a: float, low: float, high: float) -> Floats:
        return np.full(int(seconds * spread(rng, low, high)), a)

    if kind == "rest":
        return [move(x, 0.0, rng.uniform(0.2, 1.0)), hold(0.0, 4.0, 25.0)]
    if kind == "hold":
        goal = top * rng.uniform(0.15, 1.0)
        return [move(x, goal, spread(rng, 0.08, 1.5)), hold(goal, 1.5, 25.0)]
    if kind == "stairs":
        out = []
        levels: list[float] = sorted((top * rng.uniform(0.0, 1.0, rng.integers(3, 7))).tolist())
        for level in levels if rng.random() < 0.5 else levels[::-1]:
            out += [move(x, level, spread(rng, 0.2, 1.5)), hold(level, 1.0, 6.0)]
            x = level
        return out
    if kind == "grasp":
        goal = top * rng.uniform(0.6, 1.0)
        near = goal * rng.uniform(0.5, 0.8)
        out = [move(x, near, rng.uniform(0.4, 0.9)), hold(near, 0.2, 1.0)]
        out += [move(near, goal, rng.uniform(0.2, 0.8)), hold(goal, 1.0, 8.0)]
        back = top * rng.uniform(0.0, 0.15)
        return [*out, move(goal, back, rng.uniform(0.4, 1.2)), hold(back, 0.6, 5.0)]
    if kind == "reach":
        out = []
        for _ in range(rng.integers(2, 6)):
            goal = top * rng.uniform(0.05, 1.0)
            out += [move(x, goal, rng.uniform(0.3, 1.2)), hold(goal, 0.2, 2.0)]
            x = goal
        return out
    if kind in ("sine", "chirp"):
        start = spread(rng, 0.05, 2.5 if kind == "sine" else 0.2)
        end = start if kind == "sine" else spread(rng, 0.8, 3.0)
        swing = min(0.5 * top * rng.uniform(0.3, 1.0), 0.3 / max(start, end) ** 0.8)
        middle = rng.uniform(swing, max(top - swing, swing + 1e-3))
        n = int(seconds * (max(12.0, 2.0 / start) if kind == "sine" else rng.uniform(15.0, 30.0)))
        sweep = start * (end / start) ** (np.arange(n) / n)
        return [
            move(x, middle - swing, 0.5),
            middle - swing * np.cos(2.0 * np.pi * np.cumsum(sweep) * H),
        ]
    if kind == "sway":
        f, swing = rng.uniform(0.5, 1.6), rng.uniform(0.05, 0.2) * top
        middle = rng.uniform(swing, top - swing)
        t = np.arange(int(seconds * rng.uniform(5.0, 12.0))) * H
        fall = np.exp(-t / rng.uniform(1.5, 5.0))
        return [
            move(x, middle + swing, 0.7),
            middle + swing * fall * np.cos(2.0 * np.pi * f * t),
        ]
    assert kind == "teleoperated"
    n = int(seconds * rng.uniform(8.0, 25.0))
    free = 0.5 + 0.22 * smooth_noise(rng, n, rng.uniform(0.3, 1.0))
    free = top * np.clip(free, 0.0, 1.0)
    return [move(x, float(free[0]), 0.5), free]


KINDS = {
    "rich": (
        ("rest", "hold", "stairs", "grasp", "reach", "sine", "chirp", "sway", "teleoperated"),
        (1, 2, 1, 1, 1, 3, 1, 1, 2),
    ),
    "typical": (("rest", "hold", "grasp", "reach", "sway", "teleoperated"), (1, 1, 5, 3, 1, 2)),
}


def session(rng: Rng, excitation: str, n: int, quiet: int) -> Floats:
    """The shared motion (0 ... 1) of one recording, at 100 Hz, from rest to rest."""
    u = np.zeros(n)
    size = n - quiet
    if excitation == "poor":
        period, swing = rng.uniform(2.0, 8.0), rng.uniform(0.5, 0.9)
        low = rng.uniform(0.0, 0.95 - swing)
        pace = 1.0 + 0.004 * smooth_noise(rng, size, 0.1)
        turn = np.cumsum(pace) * H / period
        wave = 2.0 * np.abs(turn - np.round(turn))
        width = max(int(rng.uniform(0.03, 0.08) * period / H), 3)
        box = np.ones(width) / width
        wave = np.convolve(np.convolve(np.pad(wave, width, "edge"), box), box)
        wave = low + swing * wave[2 * width - 1 : 2 * width - 1 + size]
        edge = int(1.5 / H)
        wave[:edge] *= jerkless(0.0, 1.0, edge)
        wave[-edge:] *= jerkless(1.0, 0.0, edge)
        u[quiet:] = wave
        return u
    kinds, weights = KINDS[excitation]
    chance = np.array(weights, dtype=float) / sum(weights)
    careful = excitation == "rich" or rng.random() < 0.5
    most, grown = rng.uniform(0.85, 1.0), rng.uniform(0.3, 0.7) * size
    at, x = quiet, 0.0
    while at < n:
        top = most * (min(0.55 + 0.45 * (at - quiet) / grown, 1.0) if careful else 1.0)
        for part in piece(rng, str(rng.choice(kinds, p=chance)), x, top):
            part = part[: n - at]
            u[at : at + len(part)] = part
            at += len(part)
            x = float(part[-1]) if len(part) else x
    edge = int(2.0 / H)
    u[-edge:] *= jerkless(1.0, 0.0, edge)
    return u


def motion(seed: int, excitation: str, gap: int) -> tuple[Floats, Floats]:
    """The main motion u (0 ... 1) and the bending out of its plane v (-0.7 ... 1)."""
    rng = stream(seed, "motion")
    a = session(rng, excitation, (LEAD + FIRST) * OVER, int(rng.uniform(8.0, 18.0) / H))
    b = session(rng, excitation, SECOND * OVER, int(rng.uniform(0.5, 3.0) / H))
    u = np.concatenate([a, np.zeros(gap * OVER), b])
    f, damping = rng.uniform(0.5, 1.5), rng.uniform(0.3, 0.9)
    omega = 2.0 * np.pi * f
    swung = filtered(u, lambda w: 1.0 / (1.0 + 2j * damping * w / omega - (w / omega) ** 2))
    v = 0.8 * swung * (1.0 - 0.5 * swung)
    if excitation != "poor":
        moving = lfilter([H / 2.0], [1.0, H / 2.0 - 1.0], (u > 0.03).astype(float))
        v = v + 0.25 * smooth_noise(rng, len(u), 0.25) * moving
    return u, np.clip(v, -0.7, 1.0)


# Operators


def filtered(x: Floats, response: Callable[[Floats], NDArray[Any]]) -> Floats:
    """A signal at 100 Hz through a causal linear filter, given by its frequency response."""
    pad = 1500
    size = next_fast_len(len(x) + 2 * pad, real=True)
    wide = np.pad(x - x[0], (pad, size - len(x) - pad), mode="edge")
    wide[-pad // 2 :] = np.linspace(wide[-pad // 2], 0.0, len(wide[-pad // 2 :]))
    omega = 2.0 * np.pi * rfftfreq(size, H)
    return np.asarray(irfft(rfft(wide) * response(omega), size)[pad : pad + len(x)] + x[0])


def slow(x: Floats, tau: float, step: float = H) -> Floats:
    """A first-order low pass that starts settled."""
    a = exp(-step / tau)
    return np.asarray(lfilter([1.0 - a], [1.0, -a], x, zi=[a * x[0]])[0])


def recur(a: Floats, b: Floats, start: float = 0.0) -> Floats:
    """y[i] = a[i] y[i-1] + b[i]."""
    out, y = [], start
    for p, q in zip(a.tolist(), b.tolist(), strict=True):
        y = p * y + q
        out.append(y)
    return np.array(out)


def leaky(x: Floats, tau: float) -> Floats:
    """dy/dt = x - y / tau."""
    a = exp(-H / tau)
    return np.asarray(lfilter([tau * (1.0 - a)], [1.0, -a], x))


def steps(x: Floats) -> Floats:
    return np.asarray(np.diff(x, prepend=x[0]))


def speed(x: Floats, step: float = H) -> Floats:
    return np.asarray(np.gradient(x, step))


def play(x: Floats, r: float) -> Floats:
    """The play operator with half-width r, exact between turning points."""
    d = np.sign(np.diff(x))
    moving = np.flatnonzero(d)
    turns = moving[1:][d[moving[1:]] != d[moving[:-1]]]
    ends = np.concatenate([[0], turns, [len(x) - 1]])
    held, w = [], float(x[0])
    for one in x[ends[1:]].tolist():
        held.append(w)
        w = min(max(w, one - r), one + r)
    w0 = np.repeat(held, np.diff(ends))
    return np.asarray(np.minimum(np.maximum(np.append(w0, w0[-1]), x - r), x + r))


def memory(x: Floats, kernel: Callable[[Floats], Floats]) -> Floats:
    """The hereditary integral of kernel(t - s) dx(s)."""
    return np.asarray(
        fftconvolve(steps(x), kernel(np.arange(len(x), dtype=np.float64) * H))[: len(x)]
    )


def coloured(rng: Rng, n: int, exponent: float) -> Floats:
    """Noise with the spectrum f^-exponent."""
    size = next_fast_len(2 * n, real=True)
    f = rfftfreq(size)
    f[0] = np.inf
    return np.asarray(irfft(rfft(rng.normal(size=size)) * f ** (-exponent / 2.0), size)[:n])


def episodes(
    rng: Rng, n: int, step: float, wait: tuple[float, float], last: tuple[float, float]
) -> list[tuple[int, int]]:
    """Starts and ends (samples) of episodes, with log-uniform waits and durations in seconds."""
    out, at = [], int(spread(rng, *wait) / step)
    while at < n:
        end = at + max(int(spread(rng, *last) / step), 1)
        out.append((at, min(end, n)))
        at = end + max(int(spread(rng, *wait) / step), 1)
    return out


# Sensors


@dataclass(frozen=True)
class Sensor:
    """One channel: its place on the arm, its material, and the circuit that reads it."""

    along: float
    across: float
    bend: float
    follow: float
    curve: str
    shape: tuple[float, float]
    divider: float | None
    low: float
    span: float
    loops: tuple[tuple[float, float], ...]
    relaxing: tuple[float, float]
    warmth: float

    def strain(self, u: Floats, v: Floats) -> Floats:
        """The relative strain of this channel, about 0 ... 1."""
        x = self.along * (u + self.bend * u * (1.0 - u)) + self.across * v
        least = min(self.along, 0.0) - 0.6 * abs(self.across)
        most = max(self.along, 0.0) + 0.8 * abs(self.across)
        e = (x - least) / (most - least)
        return slow(e, self.follow) if self.follow > 0.0 else e

    def signal(self, e: Floats, warm: Floats) -> Floats:
        """What the material makes of the strain, as far as the simulator knows."""
        part, tau = self.relaxing
        z = e + part * (e - slow(e, tau)) + self.warmth * warm
        for weight, r in self.loops:
            z = z + weight * (play(e, r) - e)
        return z

    def raw(self, z: Floats) -> Floats:
        a, b = self.shape
        if self.curve == "percolation":
            y = np.maximum(1.0 - a * z, 0.06) ** -b
        elif self.curve == "tunnelling":
            y = np.maximum(1.0 + a * z, 0.05) * np.exp(b * z)
        else:
            y = np.maximum(1.0 + a * z, 0.05) ** b
        return y if self.divider is None else y / (y + self.divider)

    def code(self, z: Floats) -> Floats:
        ends = self.raw(np.array([0.0, 1.0]))
        return np.asarray(self.low + self.span * (self.raw(z) - ends[0]) / (ends[1] - ends[0]))


def sensors(seed: int) -> tuple[list[Sensor], Floats, Floats, float]:
    """The channels, their noise in the simulation and in reality, and the largest strain."""
    rng = stream(seed, "sensors")
    channels = int(rng.integers(3, 8))
    round_arm = 3 if channels < 6 or rng.random() < 0.5 else 6
    angle = rng.uniform(0.0, 2.0 * np.pi)
    largest = rng.uniform(0.25, 0.6)
    one_family = rng.random() < 0.4
    family = str(rng.choice(["fibre", "strip", "gel"]))
    row = []
    for k in range(channels):
        if not one_family:
            family = str(rng.choice(["fibre", "strip", "gel"]))
        if k < round_arm:
            turn = angle + 2.0 * np.pi * k / round_arm
            along = float(np.cos(turn))
            along = copysign(max(abs(along), 0.35), along)
            across, follow = 0.7 * float(np.sin(turn)), rng.uniform(0.0, 0.05)
            bend = rng.uniform(-0.2, 0.2)
        else:
            along, across = rng.uniform(0.6, 1.0), rng.uniform(-0.3, 0.3)
            follow, bend = rng.uniform(0.03, 0.15), rng.uniform(-0.6, 0.6)
        if family == "fibre":
            curve = "percolation" if rng.random() < 0.5 else "tunnelling"
            if curve == "percolation":
                shape = (rng.uniform(0.25, 0.5), rng.uniform(1.0, 2.0))
            else:
                shape = (largest, rng.uniform(0.5, 1.8))
            divider = spread(rng, 0.8, 4.0)
            loops, part, warmth = rng.uniform(0.02, 0.08), rng.uniform(0.02, 0.12), 0.01
        elif family == "strip":
            curve, shape = "stretch", (largest, rng.uniform(1.0, 1.6))
            divider = None
            loops, part, warmth = rng.uniform(0.0, 0.02), rng.uniform(0.0, 0.04), 0.003
        else:
            curve, shape = "stretch", (largest, rng.uniform(1.8, 2.2))
            divider = spread(rng, 0.8, 4.0) if rng.random() < 0.7 else None
            loops, part, warmth = rng.uniform(0.0, 0.03), rng.uniform(0.01, 0.1), 0.02
        span = rng.uniform(1400.0, 2400.0)
        low = rng.uniform(650.0, TOP - 650.0 - span)
        if rng.random() < 0.3:
            low, span = low + span, -span
        row.append(
            Sensor(
                along,
                across,
                bend,
                float(follow),
                curve,
                shape,
                divider,
                low,
                span,
                ((loops, rng.uniform(0.02, 0.06)), (loops, rng.uniform(0.08, 0.2))),
                (part, spread(rng, 1.0, 30.0)),
                warmth * rng.uniform(0.5, 1.5),
            )
        )
    noise = np.array([spread(rng, 1.5, 5.0) for _ in row])
    return row, noise, noise * rng.uniform(0.88, 1.15, channels), float(largest)


@dataclass
class World:
    """What an equation may know: time, the motion, all channels so far."""

    seed: int
    t: Floats
    u: Floats
    z: list[Floats]
    s: Floats
    row: list[Sensor]
    first: NDArray[np.int64]
    onset: float

    def own(self, x: Floats) -> Floats:
        """The signal over the first recording."""
        return x[self.first]


Build = Callable[[Floats, World, int, Rng], Law]


def plus(x: Floats, g: Floats) -> Law:
    return lambda p: x + p * g


def loop_only(x: Floats, g: Floats, w: World) -> Floats:
    """What a straight line in x leaves of g: the simulator's curve was fitted to the sensor."""
    slope, level = np.polyfit(w.own(x), w.own(g), 1)
    return np.asarray(g - slope * x - level)


# Hysteresis: x is the material's signal, 0 ... 1


def preisach(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Preisach's relays with a Gaussian density, by Everett's function and the turning points."""
    size = 81
    grid = np.linspace(-0.3, 1.3, size)
    up, down = np.meshgrid(grid, grid, indexing="ij")
    middle, width = rng.uniform(0.35, 0.65), rng.uniform(0.15, 0.35)
    coerce, across = rng.uniform(0.03, 0.15), rng.uniform(0.03, 0.1)
    density = np.exp(-0.5 * (((up + down) / 2.0 - middle) / width) ** 2)
    density *= np.exp(-0.5 * (((up - down) / 2.0 - coerce) / across) ** 2) * (up >= down)
    # everett[i, j]: the relays that a rise from grid[j] to grid[i] switches
    rows = np.cumsum(density, axis=0)
    everett = np.cumsum(rows[:, ::-1], axis=1)[:, ::-1]
    everett = everett / everett[-1, 0]
    inside = np.clip(x, -0.29, 1.29)

    def switched(a: Floats | float, b: Floats | float) -> Floats:
        where = [(np.atleast_1d(np.asarray(c)) + 0.3) / (grid[1] - grid[0]) for c in (a, b)]
        return np.asarray(map_coordinates(everett, where, order=1))

    # The stack: extremes in turn (a minimum first) and the output at each.
    points, output = [-0.3], [0.0]
    rising = True
    base, origin, upward = [], [], []
    last = -0.3
    for v in inside.tolist():
        if (v < last) if rising else (v > last):
            if rising:
                output.append(output[-1] + float(switched(last, points[-1])[0]))
            else:
                output.append(output[-1] - float(switched(points[-1], last)[0]))
            points.append(last)
            rising = not rising
        while len(points) > 2 and ((v > points[-2]) if rising else (v < points[-2])):
            del points[-2:], output[-2:]
        if len(points) == 2 and not rising and v <= points[0]:
            v = points[0] + 1e-9
        base.append(output[-1])
        origin.append(points[-1])
        upward.append(rising)
        last = v
    start = np.array(origin)
    rise = np.array(upward)
    part = switched(np.where(rise, inside, start), np.where(rise, start, inside))
    g = np.array(base) + np.where(rise, part, -part)
    return plus(x, loop_only(x, g, w))


def lugre(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """LuGre bristles before they slide, with a Stribeck curve."""
    reach, stribeck = spread(rng, 0.02, 0.12), spread(rng, 0.05, 0.5)
    more = rng.uniform(0.0, 0.5)
    v, dx = speed(x), steps(x)
    level = reach * (1.0 + more * np.exp(-((v / stribeck) ** 2)))
    a = 1.0 / (1.0 + np.abs(dx) / level)
    return plus(x, sign(rng, 0.3) * loop_only(x, recur(a, a * dx), w))


def duhem(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Coleman and Hodgdon's Duhem model: dh = alpha |dx| (f(x) - h) + g(x) dx."""
    alpha, b = spread(rng, 4.0, 20.0), rng.uniform(0.5, 1.0)
    dx = steps(x)
    c = x - 0.5
    f = b * np.tanh(2.0 * c) / 2.0
    a = np.exp(-alpha * np.abs(dx))
    flat = b * (1.0 - np.tanh(2.0 * c) ** 2) * rng.uniform(0.0, 0.6)
    h = recur(a, (1.0 - a) * f + flat * dx, float(f[0]))
    return plus(x, loop_only(x, h, w))


def bouc_wen(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Asymmetric: dh = dx (1 - |h|^n (beta sgn(dx h) + gamma + delta sgn dx))."""
    n = rng.uniform(1.0, 2.0)
    reach = spread(rng, 0.04, 0.2)
    beta = rng.uniform(0.5, 0.8)
    gamma, delta = 1.0 - beta, rng.uniform(-0.3, 0.3)
    h, out = 0.0, []
    for d in (steps(x) / reach).tolist():
        if d != 0.0:
            h += d * (
                1.0 - abs(h) ** n * (beta * copysign(1.0, d * h) + gamma + delta * copysign(1.0, d))
            )
        out.append(h)
    return plus(x, sign(rng, 0.3) * loop_only(x, np.array(out), w))


def maxwell_slip(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Iwan's sliders in parallel, each a spring with dry friction."""
    count = int(rng.integers(4, 9))
    reaches = np.geomspace(0.01, rng.uniform(0.15, 0.5), count)
    weights = rng.dirichlet(np.full(count, 2.0)) / reaches
    g = np.sum([a * (x - play(x, float(r))) for a, r in zip(weights, reaches, strict=True)], axis=0)
    return plus(x, sign(rng, 0.3) * loop_only(x, g, w))


def jiles_atherton(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Jiles and Atherton's pinned walls, with the strain as the field."""
    wide, pin, back = rng.uniform(0.12, 0.3), rng.uniform(0.05, 0.15), rng.uniform(0.05, 0.3)
    coupling = rng.uniform(0.0, 0.05)
    m, out, last = 0.0, [], float(x[0]) - 0.5
    for field in (x - 0.5).tolist():
        d = field - last
        last = field
        if d != 0.0:
            q = (field + coupling * m) / wide
            if abs(q) < 1e-2:
                ideal, slope = q / 3.0, 1.0 / 3.0
            else:
                c = 1.0 / tanh(q)
                ideal, slope = c - 1.0 / q, 1.0 / q**2 - c * c + 1.0
            if (ideal - m) * d > 0.0:
                m += (1.0 - back) * (ideal - m) * (1.0 - exp(-abs(d) / pin))
            m += back * slope / wide * d
        out.append(m)
    return plus(x, loop_only(x, np.array(out), w))


# Relaxation


def relaxing(x: Floats, excess: Floats, w: World, rng: Rng) -> Law:
    """An answer that fades, over the equilibrium curve or over one fitted to the motion."""
    fitted_curve = rng.random() < 0.5
    return plus(x, sign(rng, 0.85) * (loop_only(x, excess, w) if fitted_curve else excess))


def fractional_zener(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A spring-pot: E_a(-(t/tau)^a) from its spectrum of exponentials."""
    order, tau = rng.uniform(0.35, 0.8), spread(rng, 1.0, 60.0)
    taus = tau * np.geomspace(1e-4, 1e4, 49)
    ratio = (taus / tau) ** order
    weights = 1.0 / (ratio + 1.0 / ratio + 2.0 * np.cos(np.pi * order))
    weights /= weights.sum()
    keep = (taus > 0.2 * H) & (weights > 1e-4)
    parts = [a * (x - slow(x, float(c))) for a, c in zip(weights[keep], taus[keep], strict=True)]
    return relaxing(x, np.sum(parts, axis=0), w, rng)


def kohlrausch(x: Floats, w: World, k: int, rng: Rng) -> Law:
    beta, tau = rng.uniform(0.3, 0.7), spread(rng, 1.0, 60.0)
    return relaxing(x, memory(x, lambda t: np.exp(-((t / tau) ** beta))), w, rng)


def schapery(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Schapery: clocks that run faster with strain, and a factor g2 of the strain."""
    speedup, power = rng.uniform(0.5, 2.5), rng.uniform(0.3, 1.0)
    clock = np.exp(speedup * np.clip(x, -0.2, 1.3))
    driven = x * (1.0 + power * x)
    total = np.zeros_like(x)
    shortest = spread(rng, 0.8, 6.0)
    for ratio, weight in ((1.0, 0.4), (8.0, 0.35), (50.0, 0.25)):
        a = np.exp(-H * clock / (ratio * shortest))
        total += weight * recur(a, a * steps(driven))
    return relaxing(x, total, w, rng)


def burgers(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Burgers' fluid under given strain: two rates from its four constants."""
    e1, e2 = 1.0, spread(rng, 0.5, 3.0)
    eta1, eta2 = spread(rng, 40.0, 300.0), e2 * spread(rng, 2.0, 15.0)
    p1, p2 = eta1 / e1 + eta1 / e2 + eta2 / e2, eta1 * eta2 / (e1 * e2)
    root = np.sqrt(p1**2 - 4.0 * p2)
    r1, r2 = (p1 - root) / (2.0 * p2), (p1 + root) / (2.0 * p2)
    q1, q2 = eta1, eta1 * eta2 / e2

    def modulus(t: Floats) -> Floats:
        fast, late = (q1 - q2 * r2) * np.exp(-r2 * t), (q1 - q2 * r1) * np.exp(-r1 * t)
        return np.asarray((late - fast) / root)

    return relaxing(x, memory(x, modulus), w, rng)


def poroelastic(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Water leaves a strained gel: the diffusion series of a strip."""
    tau = spread(rng, 6.0, 120.0)
    n = 2 * np.arange(12) + 1

    def left(t: Floats) -> Floats:
        parts = [8.0 / (np.pi * m) ** 2 * np.exp(-(m**2) * t / tau) for m in n]
        return np.asarray(np.sum(parts, axis=0))

    return relaxing(x, memory(x, left), w, rng)


def curie_von_schweidler(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Dielectric absorption: a power law of time."""
    order, t0 = rng.uniform(0.25, 0.9), spread(rng, 0.1, 1.5)
    return relaxing(x, memory(x, lambda t: (1.0 + t / t0) ** -order), w, rng)


# Softening: virgin material at the start of the first recording


def ogden_roxburgh(x: Floats, w: World, k: int, rng: Rng) -> Law:
    e = np.maximum(x, 0.0)
    energy = e**2
    most = np.maximum.accumulate(energy)
    m, beta = rng.uniform(0.05, 0.3), rng.uniform(0.0, 0.4)
    return plus(x, -e * erf((most - energy) / (m + beta * most)))


def dorfmann_ogden(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Softening below the largest strain, with a residual strain that grows with it."""
    e = np.maximum(x, 0.0)
    energy = e**2
    most = np.maximum.accumulate(energy)
    softer = e * np.tanh((most - energy) / (rng.uniform(0.05, 0.3) + 0.2 * most))
    rest = rng.uniform(0.1, 0.4) * np.tanh(1.5 * most) * (1.0 - e / (np.sqrt(most) + 1e-3))
    return plus(x, rest - softer)


def path(e: Floats, w: World) -> Floats:
    """The energy path so far, as a share of that of the first recording."""
    gone = np.cumsum(np.abs(steps(e**2)))
    return np.asarray(gone / gone[w.first[-1]])


def miehe_damage(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Damage that saturates with the path of the energy."""
    e = np.maximum(x, 0.0)
    return plus(x, -e * (1.0 - np.exp(-path(e, w) / rng.uniform(0.08, 0.5))))


def govindjee_simo(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Chains come off the filler up to the largest stretch, in loaded time."""
    e = np.maximum(x, 0.0)
    off = 1.0 - np.exp(-rng.uniform(1.0, 3.0) * np.maximum.accumulate(e))
    a = np.exp(-H * np.clip(e, 0.0, 1.5) / spread(rng, 5.0, 60.0))
    return plus(x, -e * recur(a, (1.0 - a) * off))


def log_cycles(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Softening with the logarithm of the number of cycles."""
    e = np.maximum(x, 0.0)
    return plus(x, -e * np.log1p(path(e, w) / spread(rng, 0.005, 0.1)))


def healing_damage(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Softening below the largest recent strain, whose memory heals in minutes."""
    e = np.maximum(x, 0.0)
    keep = exp(-H / spread(rng, 40.0, 300.0))
    d, out = 0.0, []
    for one in e.tolist():
        d = max(one, d * keep)
        out.append(d)
    damage = np.array(out)
    return plus(x, -e * (damage - e) / (damage + rng.uniform(0.1, 0.4)))


# Overshoot: the conducting network breaks with the strain rate and comes back


def tunnel_break(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return plus(x, leaky(np.abs(speed(x)), spread(rng, 0.15, 2.0)))


def uneven_peaks(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Peaks on loading and on unloading, each with its own height and time."""
    v = speed(x)
    tau, part = spread(rng, 0.15, 1.5), rng.uniform(0.1, 0.6)
    rise = leaky(np.maximum(v, 0.0), tau)
    fall = leaky(np.maximum(-v, 0.0), tau * rng.uniform(0.5, 2.5))
    return plus(x, rise + part * fall if rng.random() < 0.7 else part * rise + fall)


def full_break(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Broken paths dq/dt = c |v| (1 - q) - q / tau: no more than all can break."""
    tau, c = spread(rng, 0.2, 3.0), rng.uniform(1.0, 5.0)
    broken = c * np.abs(speed(x))
    a = np.exp(-H * (broken + 1.0 / tau))
    return plus(x, recur(a, (1.0 - a) * broken / (broken + 1.0 / tau)))


def rate_power(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A power of the loading rate, larger where the network is stretched thin."""
    v, m = speed(x), rng.uniform(0.5, 0.85)
    drive = np.maximum(v, 0.0) ** m * (0.3 + np.clip(x, 0.0, 1.5))
    return plus(x, leaky(drive, spread(rng, 0.1, 1.2)))


def shoulder(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A main peak on loading and a shoulder on unloading at low strain (Poisson's recovery)."""
    v, tau = speed(x), spread(rng, 0.15, 1.0)
    low = np.exp(-np.clip(x, -0.2, 1.5) / rng.uniform(0.15, 0.4))
    drive = np.maximum(v, 0.0) + rng.uniform(0.6, 2.0) * np.maximum(-v, 0.0) * low
    return plus(x, leaky(drive, tau))


def two_structures(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Thixotropy: weak links break and rebuild fast, strong ones slowly."""
    v = np.abs(speed(x))
    g = np.zeros_like(x)
    for tau, c, part in ((spread(rng, 0.1, 0.5), 1.5, 0.7), (spread(rng, 2.0, 8.0), 0.3, 0.3)):
        a = np.exp(-H * (c * v + 1.0 / tau))
        g += part * recur(a, (1.0 - a) * c * v / (c * v + 1.0 / tau)) / c / tau
    return plus(x, g)


# Drift


def drifting(x: Floats, w: World, rng: Rng, law: Callable[[Floats], Floats]) -> Law:
    """A law of the age, zero at the start of the first recording."""
    age = w.t - w.t[0]
    start = np.array([LEAD * DT])
    return plus(x, sign(rng) * (law(age) - law(start)[0]))


def log_ageing(x: Floats, w: World, k: int, rng: Rng) -> Law:
    t0 = spread(rng, 5.0, 100.0)
    return drifting(x, w, rng, lambda t: np.log1p(t / t0))


def water_loss(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Fickian drying: the square root of time, which levels off."""
    end = spread(rng, 500.0, 4000.0)
    return drifting(x, w, rng, lambda t: np.sqrt(np.tanh(t / end)))


def cure(x: Floats, w: World, k: int, rng: Rng) -> Law:
    tau = spread(rng, 60.0, 600.0)
    return drifting(x, w, rng, lambda t: 1.0 - np.exp(-t / tau))


def power_ageing(x: Floats, w: World, k: int, rng: Rng) -> Law:
    m = rng.uniform(0.6, 1.4)
    return drifting(x, w, rng, lambda t: (t / 100.0) ** m)


def warm_up(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The board warms up, and the sensor goes on at a constant pace."""
    tau, pace = spread(rng, 40.0, 200.0), rng.uniform(0.0005, 0.003)
    return drifting(x, w, rng, lambda t: 1.0 - np.exp(-t / tau) + pace * t)


def oxidation(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Electrodes oxidise autocatalytically: a slow logistic rise."""
    middle, tau = rng.uniform(100.0, 320.0), rng.uniform(40.0, 120.0)
    return drifting(x, w, rng, lambda t: 1.0 / (1.0 + np.exp(-(t - middle) / tau)))


# Random walk


def walking(x: Floats, w: World, path_: Floats) -> Law:
    return plus(x, path_ - path_[w.first[0]])


def brownian(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return walking(x, w, np.cumsum(rng.normal(size=len(x))) * np.sqrt(H))


def ornstein_uhlenbeck(x: Floats, w: World, k: int, rng: Rng) -> Law:
    a = exp(-H / spread(rng, 30.0, 300.0))
    return walking(x, w, np.asarray(lfilter([1.0], [1.0, -a], rng.normal(size=len(x)))))


def flicker(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return walking(x, w, coloured(rng, len(x), rng.uniform(1.2, 1.5)))


def fractional_brownian(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return walking(x, w, coloured(rng, len(x), 2.0 * rng.uniform(0.6, 0.85) + 1.0))


def jump_diffusion(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Brownian motion with small rearrangements of the network now and then."""
    walk = rng.normal(size=len(x)) * np.sqrt(H)
    jumps = (rng.random(len(x)) < H / spread(rng, 10.0, 40.0)) * rng.normal(size=len(x))
    return walking(x, w, np.cumsum(walk + rng.uniform(1.0, 3.0) * jumps))


def wandering_pace(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A drift whose pace wanders: an integrated slow process next to Brownian motion."""
    a = exp(-H / spread(rng, 15.0, 60.0))
    pace = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], rng.normal(size=len(x)))
    walk = rng.normal(size=len(x)) * np.sqrt(H)
    return walking(x, w, np.cumsum(pace * H * rng.uniform(0.2, 0.6) + walk))


# Step


def since(w: World) -> Floats:
    """Seconds since the step, negative before."""
    return w.t - w.onset + 1e-9


def contact_slip(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return plus(x, sign(rng) * (since(w) >= 0.0).astype(float))


def delamination(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A part of the sensor comes off: an offset and a loss of gain."""
    on = since(w) >= 0.0
    return plus(x, on * (sign(rng) * rng.uniform(0.3, 0.8) - (x - x[0])))


def settling_jump(x: Floats, w: World, k: int, rng: Rng) -> Law:
    t = since(w)
    creep = 1.0 - np.exp(-np.maximum(t, 0.0) / spread(rng, 5.0, 60.0))
    return plus(x, sign(rng) * (t >= 0.0) * (1.0 + rng.uniform(0.2, 0.8) * creep))


def healing_jump(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A jump that goes back in part."""
    t = since(w)
    back = rng.uniform(0.2, 0.6)
    gone = np.exp(-np.maximum(t, 0.0) / spread(rng, 3.0, 40.0))
    return plus(x, sign(rng) * (t >= 0.0) * (1.0 - back + back * gone))


def broken_strand(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """One strand of the fibre breaks: higher resistance, which also counts for more."""
    on = since(w) >= 0.0
    return plus(x, on * (1.0 + rng.uniform(0.2, 0.8) * (x - x[0])))


def slow_slip(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The clamp gives way within seconds."""
    return plus(x, sign(rng) * np.clip(since(w) / spread(rng, 0.2, 3.0), 0.0, 1.0))


# Gain: x is in codes from here on


def gauge_factor(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Another gauge factor, before the divider."""
    z, way = w.z[k], sign(rng)
    before = w.row[k].code(z)
    return lambda p: x + w.row[k].code(z + way * p * (z - z[0])) - before


def reference_voltage(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return plus(x, sign(rng) * x)


def divider_resistor(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A divider whose fixed resistor is off its nominal value."""
    way = sign(rng)
    share = np.clip(x / FULL, 0.01, 0.99)
    r = share / (1.0 - share)
    return lambda p: x + FULL * (r / (r + exp(way * p)) - share)


def ageing_gain(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A gain that has moved and still moves a little."""
    age = 1.0 - np.exp(-(w.t - w.t[0]) / spread(rng, 200.0, 1500.0))
    return plus(x, sign(rng) * (1.0 + rng.uniform(0.3, 1.0) * age) * (x - x[0]))


def two_gains(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """One gain above a point and another one below it."""
    break_ = float(np.quantile(w.own(x), rng.uniform(0.35, 0.65)))
    above, below = sign(rng) * rng.uniform(0.6, 1.0), rng.uniform(-0.4, 0.4)
    d = x - break_
    return plus(x, np.where(d > 0.0, above, below) * d)


def amplifier_gain(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """An amplifier's gain about its mid-supply, with the temperature of the room in it."""
    slow_wave = np.sin(2.0 * np.pi * w.t / rng.uniform(400.0, 1500.0) + rng.uniform(0.0, 6.28))
    return plus(x, sign(rng) * (1.0 + 0.2 * slow_wave) * (x - FULL / 2.0))


# Saturation


def ends(x: Floats, w: World) -> tuple[float, float]:
    return float(w.own(x).min()), float(w.own(x).max())


def rail_high(x: Floats, w: World, k: int, rng: Rng) -> Law:
    low, high = ends(x, w)
    return lambda p: np.minimum(x, high - p * (high - low))


def rail_low(x: Floats, w: World, k: int, rng: Rng) -> Law:
    low, high = ends(x, w)
    return lambda p: np.maximum(x, low + p * (high - low))


def bending(x: Floats, w: World, rng: Rng, curve: Callable[[Floats], Floats]) -> Law:
    """A curve of slope one at one end of the range that flattens towards the other."""
    low, high = ends(x, w)
    start, way = (low, 1.0) if rng.random() < 0.7 else (high, -1.0)

    def law(p: float) -> Floats:
        scale = (high - low) / p
        q = way * (x - start) / scale
        return np.where(q > 0.0, start + way * scale * curve(np.maximum(q, 0.0)), x)

    return law


def soft_tanh(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return bending(x, w, rng, np.tanh)


def langevin(x: Floats, w: World, k: int, rng: Rng) -> Law:
    def curve(q: Floats) -> Floats:
        far = np.maximum(3.0 * q, 1e-2)
        return np.where(3.0 * q < 1e-2, q, 1.0 / np.tanh(far) - 1.0 / far)

    return bending(x, w, rng, curve)


def hill(x: Floats, w: World, k: int, rng: Rng) -> Law:
    n = rng.uniform(1.5, 5.0)
    return bending(x, w, rng, lambda q: q / (1.0 + q**n) ** (1.0 / n))


def knee(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A rail with a soft knee (a diode's exponential)."""
    low, high = ends(x, w)
    wide = (high - low) * rng.uniform(0.02, 0.08)
    return lambda p: x - wide * np.logaddexp(0.0, (x - high + (p - 0.25) * (high - low)) / wide)


# Lag


def one_pole(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return lambda p: filtered(x, lambda o: 1.0 / (1.0 + 1j * o * p))


def two_poles(x: Floats, w: World, k: int, rng: Rng) -> Law:
    other = rng.uniform(0.1, 0.9)
    return lambda p: filtered(x, lambda o: 1.0 / ((1.0 + 1j * o * p) * (1.0 + 1j * o * p * other)))


def three_cascaded(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return lambda p: filtered(x, lambda o: (1.0 + 1j * o * p / 3.0) ** -3)


def window(o: Floats, width: float) -> NDArray[Any]:
    """The response of a running mean over ``width`` seconds."""
    return np.asarray(np.sinc(o * width / (2.0 * np.pi)) * np.exp(-0.5j * o * width))


def moving_average(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return lambda p: filtered(x, lambda o: window(o, 2.0 * p))


def bessel_filter(x: Floats, w: World, k: int, rng: Rng) -> Law:
    b, a = bessel(int(rng.integers(2, 5)), 1.0, analog=True, norm="delay")
    return lambda p: filtered(x, lambda o: freqs(b, a, o * p)[1])


def sinc_filter(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The decimator of a delta-sigma converter: third-order sinc."""
    return lambda p: filtered(x, lambda o: window(o, 2.0 * p / 3.0) ** 3)


# Crosstalk


def moved(w: World) -> Floats:
    """How far each channel is from its rest, in codes."""
    return np.asarray(w.s - w.s[0])


def residual_charge(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The hold capacitor keeps a part of the channel scanned before."""
    d = moved(w)
    return plus(x, d[:, k - 1] - d[:, k])


def shared_ground(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The currents of all other dividers lift a common return wire."""
    current = 1.0 - np.clip(w.s, 0.0, TOP) / FULL
    current = (current**2 + current) / 2.0
    lift = FULL * np.delete(current - current[0], k, axis=1).sum(axis=1)
    return plus(x, lift * np.clip(1.0 - 0.5 * x / FULL, 0.3, 1.0))


def mutual_capacitance(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A neighbouring strip couples in: mostly its changes, a part of its level."""
    j = k - 1 if k > 0 and (k + 1 == w.s.shape[1] or rng.random() < 0.5) else k + 1
    d = moved(w)[:, j]
    return plus(x, sign(rng) * (d - rng.uniform(0.3, 0.7) * slow(d, spread(rng, 0.1, 1.0))))


def common_mode(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The mean of all channels, through a slow common-mode loop."""
    mean = np.delete(moved(w), k, axis=1).mean(axis=1)
    return plus(x, sign(rng) * slow(mean, spread(rng, 0.03, 0.3)))


def sneak_path(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A matrix read-out: current through another element, which depends on both."""
    d = moved(w)
    j = int((k + rng.integers(1, d.shape[1])) % d.shape[1])
    return plus(x, sign(rng) * d[:, j] * (1.0 + d[:, k] / 3000.0))


def transverse_strain(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The skin between two channels pulls on one of them: strains of its neighbours add up."""
    weights = rng.dirichlet(np.ones(len(w.z)))
    weights[k] = 0.0
    pulled = np.sum([a * (z - z[0]) for a, z in zip(weights, w.z, strict=True)], axis=0)
    return plus(x, -sign(rng, 0.8) * abs(w.row[k].span) * pulled)


# Backlash: x is the motion u


def plain_play(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return lambda p: play(x, p)


def tendon_slack(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Lost motion that is largest where the tendon is slack, near zero."""
    slack = rng.uniform(0.2, 0.6)

    def law(p: float) -> Floats:
        bent = x + slack * (np.exp(-x / slack) - 1.0) * 0.8
        loose = play(bent, 0.4 * p)
        return np.asarray(np.interp(loose, *inverse(slack)))

    return law


def inverse(slack: float) -> tuple[Floats, Floats]:
    """Table of the inverse of tendon_slack's curve."""
    grid = np.linspace(-0.2 * slack, 1.6, 2001)
    return grid + slack * (np.exp(-grid / slack) - 1.0) * 0.8, grid


def capstan(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A sheath's friction grows with the tension: play between two rays."""
    floor = rng.uniform(0.05, 0.3)

    def law(p: float) -> Floats:
        # play in the logarithm of the tension
        return np.asarray(np.exp(play(np.log(np.maximum(x, 0.0) + floor), p)) - floor)

    return law


def soft_gap(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A gap between compliant flanks: the link follows with a spring and a damper."""
    share = H / (H + spread(rng, 0.02, 0.15))

    def law(p: float) -> Floats:
        y, out = float(x[0]), []
        for one in x.tolist():
            d = one - y
            if d > p:
                y += share * (d - p)
            elif d < -p:
                y += share * (d + p)
            out.append(y)
        return np.array(out)

    return law


def gravity_gap(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A loaded joint falls across its gap where gravity changes sides, with some friction."""
    middle, friction = rng.uniform(0.35, 0.6), rng.uniform(0.03, 0.1)

    def law(p: float) -> Floats:
        side, out = -1.0, []
        for one in x.tolist():
            if one > middle + friction:
                side = 1.0
            elif one < middle - friction:
                side = -1.0
            out.append(side)
        return x + p * (slow(np.array(out), 0.04) + 1.0)

    return law


def stiction(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Choudhury's two parameters: it sticks over a band and then jumps most of the way."""
    jump = rng.uniform(0.1, 0.6)

    def law(p: float) -> Floats:
        y, way, out = float(x[0]), 0.0, []
        last = y
        for one in x.tolist():
            d = one - y
            moves = one - last
            last = one
            if way != 0.0 and moves * way > 0.0:
                y = one - way * p * (1.0 - jump)
            elif abs(d) > p:
                way = copysign(1.0, d)
                y = one - way * p * (1.0 - jump)
            else:
                way = 0.0 if moves * way < 0.0 else way
            out.append(y)
        return slow(np.array(out), 0.02)

    return law


# Delay: x is the clock at 20 Hz; the law gives how late each reading is, in seconds


def constant_delay(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return lambda p: np.full(len(x), p)


def clock_skew(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A clock that runs some parts per million off."""
    gone = (x - x[0]) / (FIRST * DT)
    return lambda p: p * gone


def packet_buffer(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Readings wait for their packet to fill: the first of each waits longest."""
    size = int(rng.integers(4, 30))
    place = np.arange(len(x)) % size
    return lambda p: p * (0.5 + (size - 1 - place) / size)


def held_readings(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The converter runs slower than the log, which takes the latest reading."""
    off = rng.random()
    late = rng.uniform(0.2, 0.8)
    return lambda p: np.asarray(late * p + np.mod(x / p + off, 1.0) * p)


def wandering_clock(x: Floats, w: World, k: int, rng: Rng) -> Law:
    wave = smooth_noise(rng, len(x), 1.0 / spread(rng, 40.0, 150.0), RATE)
    return lambda p: p * np.maximum(1.0 + 0.4 * wave, 0.0)


def lost_frames(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Each lost frame puts the log one slot behind, until the next synchronisation."""
    lost = np.cumsum(rng.random(len(x)) < DT / spread(rng, 6.0, 20.0))
    sync = int(spread(rng, 40.0, 120.0) / DT)
    start = lost[(np.arange(len(x)) // sync) * sync]
    behind = np.asarray(0.2 + 0.25 * (lost - start))
    return lambda p: p * behind


# Interference: x is in codes at 20 Hz from here on


def clock_of_board(w: World) -> tuple[Rng, Floats]:
    """The tone's own stream, common to the channels, and the true sampling times."""
    rng = stream(w.seed, "interference", "tone")
    true_rate = RATE * (1.0 + sign(rng) * rng.uniform(0.003, 0.015))
    return rng, np.arange(len(w.t)) / true_rate


def mains(common: Rng, t: Floats, offset: float) -> Floats:
    """Hum with odd harmonics, as the samples alias it; the grid's frequency wanders a little."""
    f = 50.0 if common.random() < 0.5 else 60.0
    wander = 0.01 * smooth_noise(common, len(t), 0.02, RATE)
    phase = 2.0 * np.pi * (f * t + np.cumsum(wander) * DT) + offset
    third, fifth = common.uniform(0.0, 0.5), common.uniform(0.0, 0.3)
    return np.asarray(np.sin(phase) + third * np.sin(3.0 * phase) + fifth * np.sin(5.0 * phase))


def hum(x: Floats, w: World, k: int, rng: Rng) -> Law:
    common, t = clock_of_board(w)
    return plus(x, mains(common, t, rng.uniform(-0.5, 0.5)))


def posture_hum(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The arm is an antenna: the hum grows as it stretches out, or bends towards a wire."""
    common, t = clock_of_board(w)
    tone = mains(common, t, rng.uniform(-0.5, 0.5))
    near = w.u if common.random() < 0.5 else 1.0 - w.u
    return plus(x, tone * (0.2 + near) ** rng.uniform(0.7, 2.0))


def pump(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The PWM of the pump, whose tone wanders with its load."""
    common, _ = clock_of_board(w)
    f0, wide = common.uniform(1.0, 9.0), spread(common, 0.05, 0.5)
    f = f0 + wide * smooth_noise(common, len(x), 0.05, RATE)
    phase = 2.0 * np.pi * np.cumsum(f) * DT + rng.uniform(-0.3, 0.3)
    return plus(x, np.sin(phase) + common.uniform(0.0, 0.5) * np.sin(2.0 * phase + 1.0))


def regulator_beat(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The beat of a switching regulator with the sampling clock: a saw that slides as it warms."""
    common, _ = clock_of_board(w)
    f0, slide = common.uniform(0.8, 7.0), sign(common) * common.uniform(0.2, 1.5)
    f = f0 + slide * (1.0 - np.exp(-(w.t - w.t[0]) / common.uniform(60.0, 300.0)))
    phase = np.cumsum(f) * DT + rng.uniform(0.0, 0.2)
    saw = 2.0 * np.mod(phase, 1.0) - 1.0
    return plus(x, 0.6 * saw + 0.6 * np.sin(2.0 * np.pi * phase))


def radio_bursts(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A radio nearby sends frames: a tone in bursts, the same on all leads that pick it up."""
    common, t = clock_of_board(w)
    f = 217.0 if common.random() < 0.5 else common.uniform(101.0, 119.0)
    gate = np.zeros(len(x))
    for a, b in episodes(common, len(x), DT, (2.0, 12.0), (0.8, 6.0)):
        gate[a:b] = common.uniform(0.6, 1.4)
    tone = np.sign(np.sin(2.0 * np.pi * f * t + 0.3)) + 0.4 * np.sin(4.0 * np.pi * f * t)
    return plus(x, sign(rng) * gate * (tone + rng.uniform(0.0, 0.3)))


def commutation(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The tendon motor's brushes: a tone that follows its speed and fades at a stop."""
    common, _ = clock_of_board(w)
    v = np.abs(speed(w.u, DT))
    phase = 2.0 * np.pi * np.cumsum(v * common.uniform(40.0, 120.0) + 3.1) * DT
    hum_ = np.sin(phase + rng.uniform(-0.3, 0.3)) * (0.15 + np.sqrt(v))
    return plus(x, hum_)


# Spikes


def heights(rng: Rng, n: int, spread_: float = 0.5) -> Floats:
    one_way = rng.random() < 0.4
    way = sign(rng) if one_way else rng.choice([-1.0, 1.0], n)
    return np.asarray(way * np.exp(spread_ * rng.normal(size=n)))


def isolated(x: Floats, w: World, k: int, rng: Rng) -> Law:
    hit = rng.random(len(x)) < spread(rng, 0.003, 0.02)
    return plus(x, hit * heights(rng, len(x)))


def doublets(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A spike and its rebound in the next reading."""
    hit = (rng.random(len(x)) < spread(rng, 0.002, 0.01)) * heights(rng, len(x))
    return plus(x, hit - rng.uniform(0.4, 1.0) * np.roll(hit, 1))


def clusters(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Neyman and Scott's process: a loose plug makes spikes in groups."""
    g = np.zeros(len(x))
    many = rng.uniform(3.0, 8.0)
    for at in np.flatnonzero(rng.random(len(x)) < spread(rng, 0.0015, 0.004)):
        near = at + np.rint(rng.exponential(10.0, rng.poisson(many))).astype(int)
        near = near[near < len(x)]
        g[near] += heights(rng, len(near))
    return plus(x, g)


def tailed(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A charge amplifier's answer to a discharge: a jump and an exponential tail."""
    hit = (rng.random(len(x)) < spread(rng, 0.002, 0.01)) * heights(rng, len(x))
    return plus(x, np.asarray(lfilter([1.0], [1.0, -rng.uniform(0.15, 0.6)], hit)))


def stuck_reading(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The bus returns a fixed word, or a stale register, for a single reading."""
    stale = np.roll(x, int(rng.uniform(0.5, 4.0) / DT))
    fixed = float(rng.choice([0.0, TOP, 2048.0, rng.uniform(200.0, 3900.0)]))
    word = stale if rng.random() < 0.6 else np.full(len(x), fixed)
    luck = rng.random(len(x))
    return lambda p: np.where(luck < p, word, x)


def flipped_bit(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A bit of the word flips on the way."""
    luck = rng.random(len(x))
    bits = 2 ** rng.integers(6, 11, len(x))
    word = np.clip(np.rint(x), 0.0, TOP).astype(np.int64)
    change = (word ^ bits) - word
    return lambda p: x + (luck < p) * change


# Noise


def white(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return plus(x, rng.normal(size=len(x)))


def level_noise(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Noise that grows with the resistance."""
    low, high = ends(x, w)
    y = np.clip((x - low) / (high - low), 0.0, 1.2)
    return plus(x, (0.15 + y) ** rng.uniform(1.0, 2.0) * rng.normal(size=len(x)))


def speed_noise(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Noise of movement: contacts in the network rub."""
    v = slow(np.abs(speed(w.u, DT)), 0.15, DT)
    return plus(x, (0.05 + v ** rng.uniform(0.6, 1.0)) * rng.normal(size=len(x)))


def student_noise(x: Floats, w: World, k: int, rng: Rng) -> Law:
    return plus(x, rng.standard_t(rng.uniform(2.8, 6.0), len(x)))


def short_memory(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Noise with a short correlation: generation and recombination, next to white noise."""
    a = rng.uniform(0.3, 0.85)
    g = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], rng.normal(size=len(x)))
    return plus(x, g + rng.uniform(0.2, 0.6) * rng.normal(size=len(x)))


def noisy_bursts(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Two states: quiet, and noisy for seconds."""
    gate = np.full(len(x), rng.uniform(0.05, 0.25))
    for a, b in episodes(rng, len(x), DT, (2.0, 30.0), (1.0, 15.0)):
        gate[a:b] = 1.0
    return plus(x, gate * rng.normal(size=len(x)))


# ADC: x is what the converter gets


def inl_bow(x: Floats, w: World, k: int, rng: Rng) -> Law:
    q = np.clip(x / FULL, 0.0, 1.0)
    return plus(x, sign(rng) * 4.0 * q * (1.0 - q))


def inl_s(x: Floats, w: World, k: int, rng: Rng) -> Law:
    q = np.clip(x / FULL, 0.0, 1.0)
    return plus(x, sign(rng) * np.sin(2.0 * np.pi * q))


def inl_cubic(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A third-order curve between the end points, with its crossing anywhere."""
    q = np.clip(x / FULL, 0.0, 1.0)
    cross = rng.uniform(0.3, 0.7)
    return plus(x, sign(rng) * 10.0 * q * (1.0 - q) * (q - cross))


def inl_segments(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A segmented converter: straight pieces that meet at random errors."""
    count = int(rng.choice([8, 12, 16]))
    knots = np.concatenate([[0.0], rng.normal(size=count - 1), [0.0]])
    return plus(x, np.interp(x / FULL, np.linspace(0.0, 1.0, count + 1), knots))


def missing_codes(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Wide codes after carries of the higher bits: what falls in them reads as their edge."""
    every = int(rng.choice([256, 512]))
    width = rng.uniform(0.3, 1.0, 4096 // every + 1)
    upper = rng.random() < 0.5
    c = np.clip(x, 0.0, TOP)
    cell = (c // every).astype(int)
    into = c - cell * every

    def law(p: float) -> Floats:
        wide = p * width[cell] * every
        return np.where(into < wide, x - into + (wide if upper else 0.0), x)

    return law


def capacitor_mismatch(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The weights of a SAR's capacitors are off: jumps at the carries of the top bits."""
    c = np.clip(np.floor(x), 0.0, TOP).astype(np.int64)
    off = rng.normal(size=5) * 2.0 ** (-0.5 * np.arange(5))
    bits = [(c >> (11 - b)) & 1 for b in range(5)]
    error = np.sum([a * b for a, b in zip(off, bits, strict=True)], axis=0)
    return plus(x, error - off.sum() * x / FULL)


# Foreign effects


def intermittent_contact(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A crimp opens for moments, mostly in motion: the reading goes towards a rail."""
    rail = float(rng.choice([0.0, TOP]))
    v = np.abs(speed(w.u, DT))
    gate = np.zeros(len(x))
    for a, b in episodes(rng, len(x), DT, (1.0, 15.0), (0.1, 2.5)):
        if rng.random() < 0.25 + 1.5 * v[a]:
            gate[a:b] = rng.uniform(0.3, 1.0, b - a)
    return plus(x, gate * (rail - x))


def external_load(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Objects that nobody logged hang on the arm for a while."""
    common = stream(w.seed, "external_load", "objects")
    g = np.zeros(len(x))
    for a, b in episodes(common, len(x), H, (5.0, 40.0), (4.0, 40.0)):
        n = min(int(common.uniform(0.4, 1.2) / H), (b - a) // 2)
        g[a:b] = spread(common, 0.3, 1.5)
        g[a : a + n] *= jerkless(0.0, 1.0, n)
        g[b - n : b] *= jerkless(1.0, 0.0, n)
    lever = 1.0 + rng.uniform(-0.4, 0.4) * (x - x[0])
    return plus(x, sign(rng) * g * lever)


def buckling(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """Past a critical bend a wall buckles to either side, at random each time."""
    common = stream(w.seed, "buckling", "sides")
    critical = float(np.quantile(w.u[w.first], common.uniform(0.4, 0.65)))
    over = w.u > critical
    count = np.cumsum(np.diff(over, prepend=False) & over)
    side = common.choice([-1.0, 1.0], int(count[-1]) + 1)[count]
    size = 0.2 + np.sqrt(np.maximum(w.u - critical, 0.0))
    return plus(x, sign(rng) * slow(over * side * size, 0.06))


def touch(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """A hand comes near a channel and touches it: a field that falls with the distance."""
    g = np.zeros(len(x))
    for a, b in episodes(rng, len(x), H, (4.0, 40.0), (1.0, 8.0)):
        s = np.linspace(-1.0, 1.0, b - a)
        gap_ = np.maximum(np.abs(s) ** 2 - rng.uniform(0.1, 0.5), 0.0)
        g[a:b] = spread(rng, 0.5, 1.5) * (1.0 / (1.0 + 6.0 * gap_) - 1.0 / 7.0)
    return plus(x, sign(rng) * slow(np.maximum(g, 0.0), 0.05))


def torsion(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The operator also twists the arm, which nothing measures."""
    common = stream(w.seed, "torsion", "twist")
    n = len(x)
    twist = smooth_noise(common, n, spread(common, 0.15, 0.7))
    gate = np.zeros(n)
    for a, b in episodes(common, n, H, (3.0, 20.0), (10.0, 60.0)):
        gate[a:b] = 1.0
    twist = twist * slow(gate, 0.5)
    return plus(x, twist + rng.uniform(0.1, 0.5) * twist**2)


def lock_loss(x: Floats, w: World, k: int, rng: Rng) -> Law:
    """The demodulator of an AC-fed strip slips by whole cycles: the reading turns over and back."""
    phase = np.zeros(len(x))
    for a, b in episodes(rng, len(x), H, (3.0, 30.0), (0.6, 5.0)):
        turn = sign(rng) * 2.0 * np.pi * (1.0 if rng.random() < 0.7 else 2.0)
        phase[a:b] = jerkless(0.0, turn, b - a)
    middle = FULL / 2.0 if rng.random() < 0.5 else 0.0
    return plus(x, (x - middle) * (np.cos(phase) - 1.0))


EQUATIONS: dict[str, list[Build]] = {
    "hysteresis": [preisach, lugre, duhem, bouc_wen, maxwell_slip, jiles_atherton],
    "relaxation": [
        fractional_zener,
        kohlrausch,
        schapery,
        burgers,
        poroelastic,
        curie_von_schweidler,
    ],
    "softening": [
        ogden_roxburgh,
        dorfmann_ogden,
        miehe_damage,
        govindjee_simo,
        log_cycles,
        healing_damage,
    ],
    "overshoot": [tunnel_break, uneven_peaks, full_break, rate_power, shoulder, two_structures],
    "drift": [log_ageing, water_loss, cure, power_ageing, warm_up, oxidation],
    "random_walk": [
        brownian,
        ornstein_uhlenbeck,
        flicker,
        fractional_brownian,
        jump_diffusion,
        wandering_pace,
    ],
    "gain": [
        gauge_factor,
        reference_voltage,
        divider_resistor,
        ageing_gain,
        two_gains,
        amplifier_gain,
    ],
    "step": [contact_slip, delamination, settling_jump, healing_jump, broken_strand, slow_slip],
    "backlash": [plain_play, tendon_slack, capstan, soft_gap, gravity_gap, stiction],
    "delay": [
        constant_delay,
        clock_skew,
        packet_buffer,
        held_readings,
        wandering_clock,
        lost_frames,
    ],
    "lag": [one_pole, two_poles, three_cascaded, moving_average, bessel_filter, sinc_filter],
    "saturation": [rail_high, rail_low, soft_tanh, langevin, hill, knee],
    "adc_nonlinearity": [
        inl_bow,
        inl_s,
        inl_cubic,
        inl_segments,
        missing_codes,
        capacitor_mismatch,
    ],
    "crosstalk": [
        residual_charge,
        shared_ground,
        mutual_capacitance,
        common_mode,
        sneak_path,
        transverse_strain,
    ],
    "interference": [hum, posture_hum, pump, regulator_beat, radio_bursts, commutation],
    "spikes": [isolated, doublets, clusters, tailed, stuck_reading, flipped_bit],
    "noise": [white, level_noise, speed_noise, student_noise, short_memory, noisy_bursts],
    "intermittent_contact": [intermittent_contact],
    "external_load": [external_load],
    "buckling": [buckling],
    "touch": [touch],
    "torsion": [torsion],
    "lock_loss": [lock_loss],
}

# Where each effect acts, in the order of the signal
MATERIAL = (
    "external_load",
    "torsion",
    "buckling",
    "hysteresis",
    "softening",
    "relaxation",
    "overshoot",
    "drift",
    "random_walk",
    "step",
)
FRONT = ("gain", "touch", "lock_loss", "saturation", "lag", "crosstalk")
SAMPLED = ("intermittent_contact", "interference", "spikes", "noise")

# The least and the largest strength; a material's effect moves its signal by MOST at most
MOST = 0.6
LIMITS = {
    "backlash": (0.0005, 0.25),
    "capstan": (0.001, 1.0),
    "delay": (0.0005, 2.0),
    "held_readings": (0.01, 1.0),
    "gain": (1e-4, 0.7),
    "divider_resistor": (1e-4, 1.5),
    "saturation": (0.01, 6.0),
    "rail_high": (0.002, 0.9),
    "rail_low": (0.002, 0.9),
    "knee": (0.01, 1.2),
    "lag": (0.001, 2.0),
    "crosstalk": (1e-5, 0.6),
    "adc_nonlinearity": (0.05, 600.0),
    "missing_codes": (0.01, 0.98),
    "touch": (0.01, 1500.0),
    "lock_loss": (1e-4, 1.0),
    "intermittent_contact": (1e-4, 1.0),
    "interference": (0.01, 1000.0),
    "spikes": (0.01, 3000.0),
    "stuck_reading": (8e-4, 0.2),
    "flipped_bit": (8e-4, 0.2),
    "noise": (0.01, 1000.0),
}


def equation(seed: int, name: str) -> Build:
    choices = EQUATIONS[name]
    return choices[int(stream(seed, name, "equation").integers(len(choices)))]


def drawn(seed: int, name: str) -> str:
    """The name of the equation that the seed draws for an effect."""
    return equation(seed, name).__name__


def one_chip(seed: int) -> bool:
    """Whether one converter serves all channels."""
    return bool(stream(seed, "chip").random() < 0.5)


def affected(seed: int, name: str, channels: int) -> tuple[int, ...]:
    rng = stream(seed, name, "channels")
    everywhere = (
        name in ("backlash", "delay")
        or (name == "adc_nonlinearity" and one_chip(seed))
        or rng.random() < (0.5 if name == "interference" else 0.2)
    )
    count = channels if everywhere else int(rng.integers(1, channels + 1))
    return tuple(int(k) for k in np.sort(rng.permutation(channels)[:count]))


def wanted(seed: int, name: str, k: int | str) -> float:
    """The rms of an effect in multiples of the channel's noise."""
    return spread(stream(seed, name, "size", k), 3.0, 30.0)


def fitted(size: Callable[[float], float], goal: float, low: float, high: float) -> float:
    """The strength at which a growing size reaches its goal, or the nearest limit."""
    a, b = log(low), log(high)
    x, slope = 0.5 * (a + b), 1.0
    before: tuple[float, float] | None = None
    for _ in range(14):
        y = log(max(size(exp(x)), 1e-9) / goal)
        if abs(y) < 0.04 or b - a < 1e-3:
            break
        if before is not None and x != before[0]:
            slope = min(max((y - before[1]) / (x - before[0]), 0.3), 6.0)
        before = (x, y)
        a, b = (a, x) if y > 0.0 else (x, b)
        x -= y / slope
        if not a < x < b:
            x = 0.5 * (a + b)
    return exp(x)


def together(
    change: Callable[[float], Floats], noise: Floats, goal: float, low: float, high: float
) -> float:
    """One strength for all channels, by the geometric mean of their sizes."""

    def size(p: float) -> float:
        each = np.sqrt(np.mean(np.square(change(p)), axis=0)) / noise
        return float(np.exp(np.mean(np.log(np.maximum(each, 1e-6)))))

    return fitted(size, goal, low, high)


def limits(seed: int, name: str) -> tuple[float, float]:
    return LIMITS.get(drawn(seed, name), LIMITS.get(name, (1e-5, 1e5)))


def change_of(law: Law, x: Floats, w: World, unit: float) -> Callable[[float], float]:
    """How much a law changes a signal in the first recording, by its strength."""
    return lambda p: rms(w.own(law(p) - x)) / unit


def code_change_of(law: Law, x: Floats, sensor: Sensor, unit: float) -> Callable[[float], float]:
    """The same for a material's signal, in the codes that it gives."""
    return lambda p: rms(sensor.code(law(p)) - sensor.code(x)) / unit


def alter_material(w: World, seed: int, name: str, noise: Floats, where: tuple[int, ...]) -> None:
    """Put an effect into the signals of the affected materials."""
    build = equation(seed, name)
    for k in where:
        x = w.z[k]
        law = build(x, w, k, stream(seed, name, "own", k))
        g = law(1.0) - x
        most = MOST / max(float(np.abs(g).max()), 1e-9)

        short = plus(w.own(x), w.own(g))
        size = code_change_of(short, w.own(x), w.row[k], float(noise[k]))
        w.z[k] = law(fitted(size, wanted(seed, name, k), 1e-5 * most, most))


def alter(w: World, seed: int, name: str, noise: Floats, where: tuple[int, ...]) -> None:
    """Put an effect into the codes of the affected channels, all from the codes before it."""
    build = equation(seed, name)
    after = w.s.copy()
    for k in where:
        x = w.s[:, k].copy()
        law = build(x, w, k, stream(seed, name, "own", k))
        size = change_of(law, x, w, float(noise[k]))
        after[:, k] = law(fitted(size, wanted(seed, name, k), *limits(seed, name)))
    w.s = after


def convert(
    seed: int, w: World, noisy: Floats, noise: Floats, where: tuple[int, ...]
) -> tuple[Floats, Floats]:
    """The clean and the noisy codes after the same imperfect converters."""
    name = "adc_nonlinearity"
    build = equation(seed, name)
    chip = one_chip(seed)

    def law(x: Floats, k: int) -> Law:
        return build(x, w, k, stream(seed, name, "own", "chip" if chip else k))

    clean, after = w.s.copy(), noisy.copy()
    laws = {k: law(w.s[:, k], k) for k in where}
    common = 0.0
    if chip:

        def change(p: float) -> Floats:
            return np.column_stack([w.own(one(p) - w.s[:, k]) for k, one in laws.items()])

        goal = wanted(seed, name, "chip")
        common = together(change, noise[list(where)], goal, *limits(seed, name))
    for k in where:
        size = change_of(laws[k], w.s[:, k], w, float(noise[k]))
        p = common if chip else fitted(size, wanted(seed, name, k), *limits(seed, name))
        clean[:, k], after[:, k] = laws[k](p), law(noisy[:, k], k)(p)
    return clean, after


def read(u: Floats, v: Floats, warm: Floats, row: list[Sensor]) -> list[Floats]:
    """The signals of all materials for a motion."""
    return [sensor.signal(sensor.strain(u, v), warm) for sensor in row]


def codes(z: list[Floats], row: list[Sensor]) -> Floats:
    return np.column_stack([sensor.code(one) for sensor, one in zip(row, z, strict=True)])


def onset(seed: int) -> float:
    """When the step comes, in seconds of the first recording."""
    return float(stream(seed, "onset").integers(int(0.25 * FIRST), int(0.75 * FIRST)) * DT)


def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    """The case that a seed gives, with the effects ``names`` hidden in its real recordings."""
    unknown = [name for name in names if name not in (*NAMES, *FOREIGN)]
    if unknown:
        raise ValueError(f"unknown effects: {unknown}")
    row, noise, real_noise, largest = sensors(seed)
    channels = len(row)
    gap = int(stream(seed, "gap").integers(200, 1200))
    u, v = motion(seed, excitation, gap)
    t = np.arange(len(u), dtype=np.float64) * H - LEAD * DT
    room = stream(seed, "room")
    warm = np.sin(2.0 * np.pi * t / room.uniform(600.0, 2400.0) + room.uniform(0.0, 2.0 * np.pi))
    first20 = LEAD + np.arange(FIRST)
    first = first20 * OVER
    truth = {name: affected(seed, name, channels) for name in names}

    # The simulation
    z = read(u, v, warm, row)
    simulated = codes(z, row)
    w = World(seed, t, u, z, simulated, row, first, onset(seed))

    # Motion
    if "backlash" in names:
        lost = equation(seed, "backlash")(u, w, 0, stream(seed, "backlash", "own"))

        def gap_of(p: float) -> Floats:
            return (codes(read(lost(p), v, warm, row), row) - simulated)[first]

        goal = wanted(seed, "backlash", "all")
        p = together(gap_of, noise, goal, *limits(seed, "backlash"))
        w.u = lost(p)
        w.z = read(w.u, v, warm, row)

    # Material and front end, at 100 Hz
    w.z = list(w.z)
    for name in MATERIAL:
        if name in names:
            alter_material(w, seed, name, noise, truth[name])
    w.s = codes(w.z, row)
    for name in FRONT:
        if name in names:
            alter(w, seed, name, noise, truth[name])

    # The clock, and 20 Hz
    sim20, real20 = simulated[::OVER], w.s[::OVER].copy()
    t20 = t[::OVER]
    late = np.zeros(len(t20))
    if "delay" in names:
        lag_of = equation(seed, "delay")(t20, w, 0, stream(seed, "delay", "own"))

        def read_late(p: float) -> Floats:
            when = t20 - lag_of(p)
            return np.column_stack([np.interp(when, t, one) for one in w.s.T])

        prompt = real20

        def off_by(p: float) -> Floats:
            return (read_late(p) - prompt)[first20]

        p = together(off_by, noise, wanted(seed, "delay", "all"), *limits(seed, "delay"))
        real20, late = read_late(p), lag_of(p)
    u20 = np.interp(t20 - late, t, w.u)
    w20 = World(seed, t20, u20, [one[::OVER] for one in w.z], real20, row, first20, w.onset)
    for name in SAMPLED:
        if name in names:
            alter(w20, seed, name, noise, truth[name])

    # Conversion
    clean = w20.s
    noisy = clean + stream(seed, "white", "real").normal(size=clean.shape) * real_noise
    if "adc_nonlinearity" in names:
        clean, noisy = convert(seed, w20, noisy, noise, truth["adc_nonlinearity"])
    change = (np.clip(clean, 0.0, TOP) - np.clip(sim20, 0.0, TOP))[first20]
    noisy_sim = sim20 + stream(seed, "white", "sim").normal(size=sim20.shape) * noise
    labels = tuple(f"s{k + 1}" for k in range(channels))
    strain = largest * u[::OVER]

    def recorded(values: Floats, part: slice) -> Recording:
        return Recording(
            f"arm{seed}",
            labels,
            np.clip(np.rint(values[part]), 0, TOP).astype(np.int32),
            ("strain",),
            ("1",),
            strain[part, None].copy(),
            np.arange(part.stop - part.start) * DT,
            tuple(FrontEnd("codes", 12) for _ in labels),
        )

    one = slice(LEAD, LEAD + FIRST)
    two = slice(LEAD + FIRST + gap, LEAD + FIRST + gap + SECOND)
    return Case(
        recorded(noisy_sim, one),
        recorded(noisy, one),
        recorded(noisy_sim, two),
        recorded(noisy, two),
        change,
        np.sqrt(noise**2 + real_noise**2 + 1.0 / 6.0),
        truth,
        excitation,
        onset(seed) if "step" in names else None,
        True,
    )
