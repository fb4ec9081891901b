"""Made cases of a sim-to-real gap: an instrumented insole, a knee sleeve, a tendon-driven glove.

Written from the literature on soft sensors, apart from the toolkit and from the other makers of
cases. A case is worked out at 100 Hz and picked out at 20 Hz. The hidden effects come in physical
order: motion (backlash), material, front end (saturation, lag, crosstalk, delay of the clock,
interference, spikes, noise, ADC). Each mechanism has several equations; the seed draws one.

Shortcuts: sensors are tables of 65 points with a few first-order memories; hysteresis goes from
one reversal to the next in closed form where there is one and by Euler steps elsewhere; nothing
filters before 20 Hz; the time between the two recordings is moved through, not recorded.

An effect's size is the rms over the first recording of what it adds, 3 to 30 times the noise of
the channel; if little of that varies (a gain, a bow), it is taken larger, up to 30, until what
varies is 3 times the noise too. Where one parameter serves all channels (backlash, delay) or the
physics bounds it (``LIMITS``), it may come out smaller or larger.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from cases import NAMES, Case
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.signal import fftconvolve, lfilter
from scipy.special import erf, exp1

from softsense.recording import FrontEnd, Recording

Floats = NDArray[np.float64]
Random = np.random.Generator
Tuned = tuple[Callable[[float], Floats], float, float]  # what comes out at a parameter, and bounds

__all__ = ["EQUATIONS", "FOREIGN", "NAMES", "RETUNED", "drawn", "make"]

DT, OVER = 0.05, 5
H = DT / OVER
FIRST, SECOND = 8000, 4000  # samples
LEAD = 80  # samples at rest before the first recording
FOREIGN = ("sway", "crease", "migration", "brownout", "rezero", "wrinkle")
RETUNED: tuple[str, ...] = ()
WIDE = ("backlash", "delay")
STRAIN_SIDE = ("hysteresis", "relaxation", "softening", "overshoot")  # signed as the sensor is
MATERIAL = (
    "hysteresis",
    "relaxation",
    "overshoot",
    "softening",
    *FOREIGN,
    "gain",
    "drift",
    "random_walk",
    "step",
)
FRONT = ("saturation", "lag", "crosstalk")
SAMPLED = ("interference", "spikes", "noise")
# Bounds of what is physical: largest parameter.
LIMITS = {"backlash": 0.2, "delay": 0.4, "lag": 0.6, "saturation": 0.6, "adc_nonlinearity": 120.0}
LEAST, MOST = 3.1, 29.0  # times the noise
LARGEST = 1500.0  # codes, of a single spike or a moment of noise


def stream(seed: int, *tags: str | int) -> Random:
    """Random numbers of one purpose only."""
    keys = [tag if isinstance(tag, int) else zlib.crc32(tag.encode()) for tag in tags]
    return np.random.default_rng([seed, *keys, 0x1501E])


def between(rng: Random, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def lp(y: Floats, tau: float, step: float = H) -> Floats:
    """First-order low-pass that starts settled."""
    a = 1.0 - np.exp(-step / tau)
    out, _ = lfilter([a], [1.0, a - 1.0], y, zi=[(1.0 - a) * y[0]])
    return np.asarray(out)


def ou(rng: Random, n: int, tau: float, step: float = H) -> Floats:
    """Ornstein-Uhlenbeck of unit variance."""
    a = float(np.exp(-step / tau))
    start = [a * rng.normal()]
    out, _ = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], rng.normal(size=n), zi=start)
    return np.asarray(out)


# ------------------------------------------------------------------------------------- motion


class Path:
    """A course of strain, 0 … 1, put together move by move at 100 Hz."""

    def __init__(self, start: float) -> None:
        self.parts: list[Floats] = []
        self.at, self.n = start, 0

    def add(self, part: Floats) -> None:
        self.parts.append(part)
        self.n += len(part)
        self.at = float(part[-1])

    def hold(self, seconds: float) -> None:
        self.add(np.full(max(int(seconds / H), 1), self.at))

    def ramp(self, to: float, speed: float) -> None:
        n = max(int(abs(to - self.at) / speed / H), 2)
        self.add(self.at + (to - self.at) * np.arange(1, n + 1) / n)

    def reach(self, to: float, seconds: float) -> None:
        n = max(int(seconds / H), 2)
        z = np.arange(1, n + 1) / n
        self.add(self.at + (to - self.at) * z**3 * (10.0 - 15.0 * z + 6.0 * z * z))

    def cut(self, n: int) -> Floats:
        return np.concatenate(self.parts)[:n]


def rich(path: Path, rng: Random, n: int) -> None:
    """Ladders of amplitude, stairs, nested loops, reaches, chirps and rests."""
    path.hold(rng.uniform(8.0, 15.0))
    kind = "ladder"
    while path.n < n:
        if kind == "ladder":
            for top in np.linspace(rng.uniform(0.15, 0.35), rng.uniform(0.85, 1.0), 5):
                speed = between(rng, 0.08, 0.8)
                path.ramp(top, speed)
                path.ramp(0.0, speed)
        elif kind == "stairs":
            levels = np.linspace(0.0, rng.uniform(0.7, 1.0), int(rng.integers(3, 6)))
            for level in [*levels, *levels[-2::-1]]:
                path.ramp(level, between(rng, 0.1, 1.0))
                path.hold(rng.uniform(5.0, 14.0))
        elif kind == "nested":
            centre, size = rng.uniform(0.4, 0.6), rng.uniform(0.3, 0.4)
            speed = between(rng, 0.1, 0.8)
            while size > 0.05:
                path.ramp(centre + size, speed)
                path.ramp(centre - size, speed)
                size *= rng.uniform(0.7, 0.85)
        elif kind == "reaches":
            for _ in range(int(rng.integers(12, 30))):
                path.reach(rng.uniform(0.0, 1.0), between(rng, 0.4, 5.0))
                if rng.random() < 0.3:
                    path.hold(rng.uniform(0.5, 6.0))
        elif kind == "chirp":
            centre = rng.uniform(0.35, 0.65)
            size = rng.uniform(0.15, 0.34)
            path.reach(centre, 2.0)
            t = np.arange(0.0, rng.uniform(20.0, 40.0), H)
            low, high = 0.05, rng.uniform(0.8, 1.6)
            phase = low * t[-1] / np.log(high / low) * ((high / low) ** (t / t[-1]) - 1.0)
            path.add(centre + size * np.sin(2.0 * np.pi * phase))
        else:
            path.ramp(0.0, 0.3)
            path.hold(rng.uniform(8.0, 30.0))
        kind = str(
            rng.choice(["ladder", "stairs", "nested", "reaches", "reaches", "chirp", "rest"])
        )


def stride(device: str, n: int, size: float, rng: Random) -> Floats:
    """One cycle of the exercise."""
    z = np.arange(n) / n
    if device == "insole":  # stance with the humps of landing and pushing off, then swing
        stance = 0.62
        s = np.clip(z / stance, 0.0, 1.0)
        shape = np.sin(np.pi * s) ** 0.6 * (1.0 - 0.28 * np.exp(-(((s - 0.5) / 0.16) ** 2)))
        shape *= z < stance
    elif device == "sleeve":  # knee flexion: a little in stance, much in swing
        shape = 0.08 + 0.26 * np.exp(-(((z - 0.2) / 0.085) ** 2))
        shape += 0.9 * np.exp(-(((z - 0.72) / 0.11) ** 2))
    else:  # grasp, hold and let go
        shape = np.clip(np.minimum(z / 0.25, (0.9 - z) / 0.3), 0.0, 1.0)
        shape = shape * shape * (3.0 - 2.0 * shape)
    return np.asarray(size * shape * (1.0 + 0.02 * rng.normal()))


def typical(path: Path, rng: Random, n: int, device: str) -> None:
    """Bouts of cyclic exercise at a changing pace, with breaks."""
    path.hold(rng.uniform(4.0, 10.0))
    while path.n < n:
        squats = device == "sleeve" and rng.random() < 0.4
        period = between(rng, 2.5, 5.5) if squats or device == "glove" else between(rng, 0.95, 1.6)
        size = rng.uniform(0.65, 0.95)
        end = path.n + rng.uniform(25.0, 80.0) / H
        pace = 0.0
        if device == "sleeve" and not squats:
            path.reach(0.08 * size, 0.6)
        while path.n < end:
            pace = 0.9 * pace + 0.03 * rng.normal()
            length = max(int(period * np.exp(pace) / H), 40)
            own = size * (1.0 + 0.05 * rng.normal())
            if squats:
                path.reach(own, 0.4 * length * H)
                path.hold(rng.uniform(0.05, 0.2) * length * H)
                path.reach(0.02, 0.45 * length * H)
            else:
                path.add(stride(device, length, own, rng))
        path.reach(rng.choice([0.0, 0.1, 0.4]), 1.0)
        path.hold(rng.uniform(5.0, 18.0))


def poor(path: Path, rng: Random, n: int, size: float) -> None:
    """The same cycle over and over."""
    length = int(between(rng, 3.0, 20.0) / H)
    z = np.arange(1, length + 1) / length
    kind = rng.choice(["triangle", "sine", "trapezoid"])
    one = 1.0 - np.abs(2.0 * z - 1.0)
    if kind == "sine":
        one = 0.5 - 0.5 * np.cos(2.0 * np.pi * z)
    elif kind == "trapezoid":
        one = np.clip(1.6 * one - 0.2, 0.0, 1.0)
    path.add(np.tile(size * one, n // length + 1))


def motion(seed: int, excitation: str, device: str, gap: int) -> Floats:
    """Relative strain, 0 … 1, at 100 Hz: rest, first motion, unrecorded move, second motion."""
    parts = [np.zeros(LEAD * OVER)]
    for which, samples in enumerate((FIRST, SECOND)):
        rng = stream(seed, "motion", excitation, which)
        path, n = Path(0.0), samples * OVER
        if excitation == "rich":
            rich(path, rng, n)
        elif excitation == "typical":
            typical(path, rng, n, device)
        else:
            poor(path, rng, n, 1.0 if which == 0 else rng.uniform(0.6, 1.0))
        parts.append(path.cut(n))
        if which == 0:
            link, n = Path(float(parts[-1][-1])), gap * OVER
            link.reach(rng.uniform(0.0, 0.5), 0.25 * gap * DT)
            link.hold(0.25 * gap * DT)
            link.reach(0.0, 0.25 * gap * DT)
            link.hold(0.3 * gap * DT)
            parts.append(link.cut(n))
    u = gaussian_filter1d(np.concatenate(parts), 0.05 / H, mode="nearest")
    return np.asarray(np.round(np.clip(u, 0.0, 1.0), 7))


# ------------------------------------------------------------------- hysteresis between reversals


def turns(u: Floats) -> list[tuple[int, int, int]]:
    """(first, last, direction) of the stretches between reversals."""
    d = np.diff(u)
    moving = np.flatnonzero(d)
    sign = np.sign(d[moving]).astype(int)
    at = np.flatnonzero(sign[1:] != sign[:-1]) + 1
    bounds = [0, *moving[at].tolist(), len(u) - 1]
    signs = [int(sign[0]), *sign[at].tolist()] if len(sign) else [1]
    return list(zip(bounds[:-1], bounds[1:], signs, strict=True))


def play(u: Floats, lost: Floats | float, low: Floats | float | None = None) -> Floats:
    """Follows ``u`` at ``lost`` below it on the way up and ``low`` above it on the way down."""
    up = np.asarray(u - lost)
    down = np.asarray(u + (lost if low is None else low))
    out = np.empty_like(u)
    out[0] = u[0]
    for i, j, sign in turns(u):
        if sign > 0:
            out[i : j + 1] = np.maximum(out[i], up[i : j + 1])
        else:
            out[i : j + 1] = np.minimum(out[i], down[i : j + 1])
    return out


def dahl(u: Floats, reach: float) -> Floats:
    """Dahl's friction, -1 … 1, that has reversed after a travel of ``reach``."""
    z = np.zeros_like(u)
    for i, j, sign in turns(u):
        z[i : j + 1] = sign + (z[i] - sign) * np.exp(-np.abs(u[i : j + 1] - u[i]) / reach)
    return z


# ---------------------------------------------------------------------------------------- sensors


@dataclass(frozen=True)
class Sensor:
    """One simulated sensor: where it sits, its curve, its memory, its place in the codes."""

    kind: str
    zone: tuple[float, float]  # where its share of the strain begins, and how softly
    table: Floats
    memory: float
    taus: tuple[float, ...]
    rest: float
    span: float
    sign: float

    def strain(self, u: Floats) -> Floats:
        """What of the strain, 0 … 1, arrives at the place of the sensor."""
        at, soft = self.zone
        if at <= 0.0:
            return u

        def bent(z: Floats | float) -> Floats:
            return np.asarray(soft * np.logaddexp(0.0, (np.asarray(z) - at) / soft))

        return np.asarray((bent(u) - bent(0.0)) / (bent(1.0) - bent(0.0)))

    def __call__(self, u: Floats) -> Floats:
        """Codes."""
        w = self.strain(u)
        y = np.interp(w, np.linspace(0.0, 1.0, len(self.table)), self.table)
        m = self.memory
        if self.kind == "fsr":  # friction of the granules, and creep
            y = (1.0 - m) * y + 0.5 * m * (play(y, 0.05) + play(y, 0.15))
            y = y + 0.4 * m * sum(lp(y, tau) - y for tau in self.taus) / len(self.taus)
        elif self.kind == "ionic":  # a fraction of an order
            y = y + m * sum(y - lp(y, tau) for tau in self.taus) / len(self.taus)
        elif self.kind == "barometric":  # the chamber leaks
            y = y - m * lp(y, self.taus[-1])
        else:
            y = y + m * (y - lp(y, self.taus[0]))
        return np.asarray(self.rest + self.sign * self.span * y)


def sensors(seed: int) -> tuple[str, float, list[Sensor], Floats]:
    """The device, its largest strain, its sensors and their noise."""
    rng = stream(seed, "sensors")
    device = str(rng.choice(["insole", "sleeve", "glove"]))
    kinds = {
        "insole": ["fsr", "capacitive", "barometric", "resistive"],
        "sleeve": ["resistive", "capacitive", "ionic"],
        "glove": ["ionic", "optical", "resistive", "barometric"],
    }[device]
    main = str(rng.choice(kinds))
    out = []
    z = np.linspace(0.0, 1.0, 65)
    for _ in range(int(rng.integers(3, 8))):
        kind = main if rng.random() < 0.6 else str(rng.choice(kinds))
        if kind == "fsr":
            siemens = (z + 0.03) ** rng.uniform(0.6, 0.95)
            curve = siemens / (siemens + rng.uniform(0.5, 2.0))
        elif kind == "capacitive":
            curve = (1.0 + rng.uniform(0.3, 0.9) * z) / (1.0 - rng.uniform(0.02, 0.25) * z)
        elif kind == "barometric":
            curve = (1.0 - rng.uniform(0.15, 0.4) * z) ** -1.2
        elif kind == "optical":
            curve = 1.0 - np.exp(-rng.uniform(0.6, 2.0) * z)
        else:
            e = rng.uniform(0.2, 0.5)
            g = rng.uniform(1.5, 4.0)
            bent = rng.uniform(-0.2, 0.3)
            ohms = (1.0 + e * z) ** 2 if kind == "ionic" else 1.0 + g * (z + bent * z**2)
            curve = ohms / (ohms + rng.uniform(0.7, 3.0))
        curve = (curve - curve[0]) / (curve[-1] - curve[0])
        taus = np.sort(np.exp(rng.uniform(np.log(0.5), np.log(80.0), 3)))
        span = rng.uniform(900.0, 2200.0)
        low = rng.uniform(450.0, 3500.0 - span)
        sign = 1.0 if rng.random() < 0.7 else -1.0
        zone = (
            (rng.uniform(0.05, 0.35), rng.uniform(0.04, 0.12)) if device == "insole" else (0.0, 1.0)
        )
        rest = low if sign > 0 else low + span
        out.append(
            Sensor(
                kind, zone, curve, rng.uniform(0.02, 0.09), tuple(taus.tolist()), rest, span, sign
            )
        )
    largest = {"insole": 0.25, "sleeve": 0.4, "glove": 0.3}[device] * rng.uniform(0.7, 1.2)
    return device, float(largest), out, rng.uniform(0.7, 2.5, len(out))


# ---------------------------------------------------------------------- what an equation may read


@dataclass
class World:
    """All that the equations of one case may look at, at 100 Hz."""

    t: Floats  # s since the first recording began
    u: Floats  # relative strain as the sensors have it
    own: list[Floats]  # the strain at each sensor
    s: Floats  # (samples, channels) codes so far
    sensors: list[Sensor]
    first: NDArray[np.int64]  # where the samples of the first recording are
    onset_s: float  # when a step comes, if one does

    def y(self, k: int) -> Floats:
        """Signal of a channel, 0 … about 1, rising with strain."""
        one = self.sensors[k]
        return np.asarray(one.sign * (self.s[:, k] - one.rest) / one.span)

    @property
    def v(self) -> Floats:
        return np.gradient(self.u, H)

    @property
    def since(self) -> Floats:
        return np.maximum(self.t, 0.0)

    @property
    def span_s(self) -> float:
        return FIRST * DT

    def travel(self) -> Floats:
        """Full strokes so far."""
        return np.cumsum(np.abs(np.diff(self.u, prepend=self.u[0]))) / 2.0

    def looped(self, z: Floats, k: int) -> Floats:
        """``z`` about its mean curve: the simulator was calibrated to that."""
        w = self.own[k]
        fit = np.polynomial.Polynomial.fit(w[self.first], z[self.first], 3)
        return np.asarray(z - fit(np.clip(w, 0.0, 1.0)))


# An equation gets the world, the channel, random numbers that all channels share, and its own.
Equation = Callable[[World, int, Random, Random], "Floats | Tuned"]
EQUATIONS: dict[str, dict[str, Equation]] = {}


def equation(name: str) -> Callable[[Equation], Equation]:
    """Enters the function ``name_label`` as an equation of ``name``."""

    def enter(function: Equation) -> Equation:
        EQUATIONS.setdefault(name, {})[function.__name__[len(name) + 1 :]] = function
        return function

    return enter


# ------------------------------------------------------------------------------------- hysteresis


@equation("hysteresis")
def hysteresis_preisach(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Relays, Gaussian about a centre and a coercive width."""
    n, u = 700, w.own[k]
    centre = rng.normal(rng.uniform(0.35, 0.6), rng.uniform(0.15, 0.3), n)
    width = np.abs(rng.normal(rng.uniform(0.04, 0.15), rng.uniform(0.03, 0.1), n))
    on_at, off_at = centre + width, centre - width
    state = off_at < u[0]
    state &= on_at <= u[0]
    out = np.zeros_like(u)
    out[0] = state.sum()
    for i, j, sign in turns(u):
        part = u[i : j + 1]
        if sign > 0:
            waiting = np.sort(on_at[~state])
            out[i : j + 1] = out[i] + np.searchsorted(waiting, part, "right")
            state |= on_at <= part[-1]
        else:
            waiting = np.sort(-off_at[state])
            out[i : j + 1] = out[i] - np.searchsorted(waiting, -part, "right")
            state &= off_at < part[-1]
    return w.looped(gaussian_filter1d(out / n, 2.0), k)


@equation("hysteresis")
def hysteresis_dahl(w: World, k: int, com: Random, rng: Random) -> Floats:
    return -dahl(w.own[k], between(rng, 0.03, 0.25))


@equation("hysteresis")
def hysteresis_maxwell_slip(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Sliders that give way at random thresholds, in parallel."""
    u = w.own[k]
    reach = rng.weibull(1.5, 10) * between(rng, 0.06, 0.2)
    stiff = rng.gamma(2.0, 1.0, 10)
    return np.asarray(-sum(c * (u - play(u, r)) for c, r in zip(stiff, reach, strict=True)))


@equation("hysteresis")
def hysteresis_bouc_wen(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Generalised: loading and unloading yield at different levels."""
    n, yields = rng.uniform(0.8, 2.0), between(rng, 0.05, 0.2)
    beta, skew = rng.uniform(0.5, 0.8), rng.uniform(-0.25, 0.25)
    gamma = 1.0 - beta
    z, out = 0.0, []
    for d in (np.diff(w.own[k], prepend=w.own[k][0]) / yields).tolist():
        if d:
            sd, sz = (1.0 if d > 0 else -1.0), (1.0 if z > 0 else -1.0)
            z += d * (1.0 - abs(z) ** n * (gamma + beta * sd * sz + skew * (sd + sz)))
            z = min(max(z, -2.0), 2.0)
        out.append(z)
    return w.looped(-np.array(out), k)


@equation("hysteresis")
def hysteresis_duhem(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Coleman and Hodgdon: dy = a |du| (f(u) - y) + g(u) du."""
    u = w.own[k]
    a, c = between(rng, 3.0, 15.0), rng.uniform(0.0, 1.5)
    slope = rng.uniform(0.2, 0.7)
    f = u + 0.2 * c * u * u
    pull = np.abs(np.diff(u, prepend=u[0])) * a
    push = np.diff(u, prepend=u[0]) * slope * (1.0 + 0.3 * c * u)
    y, out = float(f[0]), []
    for p, q, goal in zip(pull.tolist(), push.tolist(), f.tolist(), strict=True):
        y += min(p, 1.0) * (goal - y) + q
        out.append(y)
    return w.looped(np.array(out), k)


@equation("hysteresis")
def hysteresis_jiles(w: World, k: int, com: Random, rng: Random) -> Floats:
    """As Jiles and Atherton have it for magnets: pinned walls about an ideal curve."""
    u = w.own[k] * 4.0
    a, pin, alpha = rng.uniform(0.8, 1.6), between(rng, 0.15, 0.6), rng.uniform(0.0, 0.1)
    safe = np.maximum(u / a, 1e-3)
    ideal = np.where(u / a < 1e-3, u / a / 3.0, 1.0 / np.tanh(safe) - 1.0 / safe)
    m, out = float(ideal[0]), []
    for d, goal in zip(np.diff(u, prepend=u[0]).tolist(), ideal.tolist(), strict=True):
        away = goal - m
        if d * away > 0.0:
            sign = 1.0 if d > 0 else -1.0
            rate = away / (pin * sign - alpha * away)
            m += away if abs(d * rate) > abs(away) else d * rate
        out.append(m)
    return w.looped(np.array(out), k)


# ------------------------------------------------------------------------------------- relaxation


def history(y: Floats, kernel: Floats) -> Floats:
    """Every increment of ``y`` fades as the kernel has it."""
    return np.asarray(fftconvolve(np.diff(y, prepend=y[0]), kernel)[: len(y)])


def ages(w: World) -> Floats:
    return np.arange(len(w.t), dtype=np.float64) * H


@equation("relaxation")
def relaxation_power(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Fractional: (1 + t / tau)^-n."""
    n, tau = rng.uniform(0.15, 0.6), between(rng, 0.3, 5.0)
    return history(w.y(k), (1.0 + ages(w) / tau) ** -n)


@equation("relaxation")
def relaxation_stretched(w: World, k: int, com: Random, rng: Random) -> Floats:
    beta, tau = rng.uniform(0.35, 0.85), between(rng, 1.5, 40.0)
    return history(w.y(k), np.exp(-((ages(w) / tau) ** beta)))


@equation("relaxation")
def relaxation_log_creep(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Creeps on with the logarithm of time, no end in sight; calibrated after a minute."""
    tau = between(rng, 0.2, 3.0)
    return -history(w.y(k), np.log1p(ages(w) / tau) - np.log1p(60.0 / tau))


@equation("relaxation")
def relaxation_quasilinear(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Fung: a box of time constants behind an exponential spring."""
    fast, slow = between(rng, 0.3, 2.0), between(rng, 15.0, 120.0)
    b = rng.uniform(0.3, 1.5)
    t = ages(w) + H
    kernel = (exp1(t / slow) - exp1(t / fast)) / np.log(slow / fast)
    return history(np.expm1(b * w.y(k)) / np.expm1(b), kernel)


@equation("relaxation")
def relaxation_uneven(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A standard solid that recovers more slowly than it gives way."""
    y = w.y(k)
    down = between(rng, 2.0, 15.0)
    up = down * rng.uniform(1.3, 3.0)
    q, out = float(y[0]), []
    for goal in y.tolist():
        q += (goal - q) * H / (down if goal > q else up)
        out.append(goal - q)
    return np.array(out)


@equation("relaxation")
def relaxation_eyring(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The dashpot flows as the hyperbolic sine of its load."""
    tau, soft = between(rng, 3.0, 30.0), rng.uniform(0.2, 0.6)
    z, out = 0.0, []
    for d in np.diff(w.y(k), prepend=w.y(k)[0]).tolist():
        z += d
        z -= H / tau * soft * float(np.sinh(min(max(z / soft, -8.0), 8.0)))
        out.append(z)
    return np.array(out)


# -------------------------------------------------------------------------------------- softening


@equation("softening")
def softening_ogden_roxburgh(w: World, k: int, com: Random, rng: Random) -> Floats:
    energy = 0.5 * np.maximum(w.own[k], 0.0) ** 2
    most = np.maximum.accumulate(energy)
    m, beta = between(rng, 0.02, 0.15), rng.uniform(0.0, 0.3)
    return np.asarray(-erf((most - energy) / (m + beta * most)) * w.y(k))


@equation("softening")
def softening_set(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Mullins, and what stays stretched afterwards."""
    x = w.own[k]
    most = np.maximum.accumulate(x)
    lost = x * -np.expm1(-(most - x) / between(rng, 0.1, 0.5))
    return np.asarray(rng.uniform(0.1, 0.4) * np.where(most > x, most - x, 0.0) * most - lost)


@equation("softening")
def softening_largest(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The gain falls with the largest strain there has been."""
    most = np.maximum.accumulate(w.own[k])
    power = rng.uniform(0.7, 1.5)
    return np.asarray(w.y(k) * np.expm1(-((most / rng.uniform(0.3, 1.2)) ** power)))


@equation("softening")
def softening_cyclic(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Goes on for some cycles below the largest strain."""
    x = w.own[k]
    most = np.maximum.accumulate(x)
    worn = -np.expm1(-w.travel() / between(rng, 2.0, 15.0))
    return np.asarray(-w.y(k) * np.maximum(most - x, 0.0) ** rng.uniform(0.5, 1.0) * worn)


@equation("softening")
def softening_links(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Links of many slack lengths tear one by one, and are missed from then on."""
    x = w.own[k]
    most = np.maximum.accumulate(x)
    slack = np.sort(rng.uniform(0.0, 0.75, 25))
    tears = slack + rng.weibull(2.0, 25) * rng.uniform(0.15, 0.4)
    out = np.zeros_like(x)
    for a, b in zip(slack, tears, strict=True):
        gone = np.clip((most - b) / 0.04, 0.0, 1.0)
        out -= gone * np.maximum(x - a, 0.0)
    if not out[w.first].any():
        out -= x * (most - x)
    return out


# -------------------------------------------------------------------------------------- overshoot


@equation("overshoot")
def overshoot_uneven(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Resistance rises with the rate of strain, more on the way up."""
    v = np.gradient(w.own[k], H)
    back = rng.uniform(0.5, 0.9)
    return lp(np.where(v > 0, v, -back * v), between(rng, 0.2, 2.0))


@equation("overshoot")
def overshoot_power(w: World, k: int, com: Random, rng: Random) -> Floats:
    v = np.abs(np.gradient(w.own[k], H))
    return lp(v ** rng.uniform(0.5, 1.4), between(rng, 0.2, 3.0)) * (0.4 + w.y(k))


@equation("overshoot")
def overshoot_network(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Contacts break with the rate and form again in time."""
    v = np.abs(np.gradient(w.own[k], H))
    tau, rate = between(rng, 0.4, 3.0), between(rng, 0.3, 2.0)
    whole, out = 1.0, []
    for speed in v.tolist():
        whole += H * ((1.0 - whole) / tau - rate * speed * whole)
        out.append(1.0 - whole)
    return np.array(out) * (0.3 + rng.uniform(0.2, 1.0) * w.own[k])


@equation("overshoot")
def overshoot_full(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The energy of motion, up to a ceiling."""
    power = lp(np.gradient(w.own[k], H) ** 2, between(rng, 0.2, 1.5))
    half = float(np.mean(power[w.first])) * between(rng, 1.0, 5.0) + 1e-9
    return np.asarray(power / (power + half))


@equation("overshoot")
def overshoot_two_speeds(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A quick part and a slow one, both the larger where little is stretched."""
    v = np.abs(np.gradient(w.own[k], H))
    share = rng.uniform(0.3, 0.8)
    fast, slow = lp(v, between(rng, 0.15, 0.5)), lp(v, between(rng, 1.0, 4.0))
    return np.asarray((share * fast + (1.0 - share) * slow) * (1.2 - 0.7 * w.own[k]))


# ------------------------------------------------- gain, drift, random walk, step (codes, any sign)


def toss(rng: Random) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def active(w: World, k: int) -> Floats:
    """Codes above rest."""
    return np.asarray(w.s[:, k] - w.sensors[k].rest)


@equation("gain")
def gain_constant(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(toss(com) * w.s[:, k])


@equation("gain")
def gain_ageing(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Of the whole reading, ever more."""
    return np.asarray(toss(com) * w.s[:, k] * (rng.uniform(0.0, 0.3) + w.since / w.span_s))


@equation("gain")
def gain_pivot(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Of the stretch only: the rest was adjusted."""
    return np.asarray(toss(com) * active(w, k))


@equation("gain")
def gain_worn(w: World, k: int, com: Random, rng: Random) -> Floats:
    """With the square root of the strokes."""
    return np.asarray(-active(w, k) * np.sqrt(w.travel()))


@equation("gain")
def gain_warming(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The reference settles after it is switched on."""
    tau = between(com, 60.0, 500.0)
    return np.asarray(toss(com) * active(w, k) * -np.expm1(-w.since / tau))


@equation("drift")
def drift_log(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(toss(rng) * np.log1p(w.since / between(rng, 2.0, 40.0)))


@equation("drift")
def drift_exp(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(-toss(rng) * np.expm1(-w.since / between(rng, 50.0, 500.0)))


@equation("drift")
def drift_power(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(toss(rng) * (w.since / w.span_s) ** rng.uniform(0.3, 1.6))


@equation("drift")
def drift_linear(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(toss(rng) * w.since)


@equation("drift")
def drift_two_exps(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A quick one and a slow one, perhaps against each other."""
    fast, slow = between(rng, 10.0, 40.0), between(rng, 150.0, 800.0)
    share = rng.uniform(-0.5, 0.6)
    both = share * np.expm1(-w.since / fast) + np.expm1(-w.since / slow)
    return np.asarray(toss(rng) * both)


@equation("drift")
def drift_use(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Ageing with use: of the strokes so far."""
    strokes = w.travel()
    total = strokes[w.first[-1]] + 1e-9
    return np.asarray(-toss(com) * np.expm1(-strokes / (total * rng.uniform(0.3, 2.0))))


@equation("random_walk")
def random_walk_brown(w: World, k: int, com: Random, rng: Random) -> Floats:
    walk = np.cumsum(rng.normal(size=len(w.t)))
    return np.asarray(walk - walk[w.first[0]])


@equation("random_walk")
def random_walk_ou(w: World, k: int, com: Random, rng: Random) -> Floats:
    return ou(rng, len(w.t), between(rng, 40.0, 200.0))


@equation("random_walk")
def random_walk_flicker(w: World, k: int, com: Random, rng: Random) -> Floats:
    """1/f, from a ladder of time constants."""
    return np.asarray(sum(ou(rng, len(w.t), 2.0 * 3.0**j) for j in range(6)))


@equation("random_walk")
def random_walk_bounded(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Is turned back at two walls."""
    walk = np.cumsum(rng.normal(size=len(w.t))) * np.sqrt(H / between(rng, 30.0, 120.0))
    folded = np.abs((walk + 1.0) % 4.0 - 2.0) - 1.0
    return np.asarray(folded - folded[w.first[0]])


@equation("random_walk")
def random_walk_jumps(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Many small jumps, rounded."""
    jumps = rng.normal(size=len(w.t)) * (rng.random(len(w.t)) < H / between(rng, 0.5, 3.0))
    walk = lp(np.cumsum(jumps), 0.5)
    return np.asarray(walk - walk[w.first[0]])


def onset(seed: int) -> float:
    """s into the first recording."""
    return float(np.round(stream(seed, "onset").uniform(0.2, 0.8) * FIRST) * DT)


@equation("step")
def step_jump(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(toss(rng) * (w.t >= w.onset_s))


@equation("step")
def step_with_gain(w: World, k: int, com: Random, rng: Random) -> Floats:
    more = rng.uniform(-1.5, 1.5) * w.sensors[k].sign * active(w, k) / w.sensors[k].span
    return np.asarray(toss(rng) * (w.t >= w.onset_s) * (1.0 + more))


@equation("step")
def step_ramp(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Within seconds."""
    length = com.uniform(0.5, 4.0)
    return np.asarray(toss(rng) * np.clip((w.t - w.onset_s) / length, 0.0, 1.0))


@equation("step")
def step_recovering(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A part of it is taken back."""
    back, tau = rng.uniform(0.15, 0.4), between(rng, 5.0, 60.0)
    gone = np.maximum(w.t - w.onset_s, 0.0)
    return np.asarray(toss(rng) * (w.t >= w.onset_s) * (1.0 + back * np.expm1(-gone / tau)))


# ---------------------------------------------------------- backlash (on the strain, for everyone)


@equation("backlash")
def backlash_play(w: World, k: int, com: Random, rng: Random) -> Tuned:
    return lambda p: play(w.u, p), 1e-4, LIMITS["backlash"] / 2.0


@equation("backlash")
def backlash_dead_zone(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Slack before the tendon pulls."""
    return lambda p: np.maximum(w.u - p, 0.0), 1e-4, LIMITS["backlash"]


@equation("backlash")
def backlash_slip(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Sticks until a threshold, slips most of the way, and sticks again."""
    left = com.uniform(0.2, 0.5)

    def at(p: float) -> Floats:
        held, out = float(w.u[0]), []
        for x in w.u.tolist():
            if x - held > p:
                held = x - left * p
            elif held - x > p:
                held = x + left * p
            out.append(held)
        return np.array(out)

    return at, 1e-4, LIMITS["backlash"] / 2.0


@equation("backlash")
def backlash_elastic(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """A cable that stretches before it slides in its sheath: a corner that is rounded."""
    sharp = com.uniform(0.3, 1.0)
    return lambda p: w.u - p * dahl(w.u, sharp * p), 1e-4, LIMITS["backlash"] / 2.0


@equation("backlash")
def backlash_capstan(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Friction of a cable round a bend: the loss is in proportion to the pull."""
    base = com.uniform(0.1, 0.4)
    return lambda p: play(w.u, p * (base + w.u), p * (base + w.u)), 1e-4, LIMITS["backlash"] / 1.5


# ------------------------------------------------------------------------------- the front end


def squeezed(w: World, k: int, low: bool, law: Callable[[Floats, float, float], Floats]) -> Tuned:
    """``law(codes, level, range)`` at a level that is a share of the range below its end."""
    s = -w.s[:, k] if low else w.s[:, k]
    bottom, top = float(s[w.first].min()), float(s[w.first].max())
    reach = top - bottom

    def at(p: float) -> Floats:
        z = law(s, top - p * reach, reach)
        return -z if low else z

    return at, 1e-4, LIMITS["saturation"]


@equation("saturation")
def saturation_tanh(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Straight up to a knee, then bends over to a ceiling."""
    top = float(w.s[w.first, k].max())

    def law(s: Floats, level: float, reach: float) -> Floats:
        room = 2.0 * (top - level) + 1e-9
        knee = top - room
        return np.where(s > knee, knee + room * np.tanh((s - knee) / room), s)

    return squeezed(w, k, False, law)


@equation("saturation")
def saturation_soft_knee(w: World, k: int, com: Random, rng: Random) -> Tuned:
    soft = com.uniform(0.01, 0.05)

    def law(s: Floats, level: float, reach: float) -> Floats:
        a = soft * reach
        return np.asarray(level - a * np.logaddexp(0.0, (level - s) / a))

    return squeezed(w, k, False, law)


@equation("saturation")
def saturation_rail_high(w: World, k: int, com: Random, rng: Random) -> Tuned:
    return squeezed(w, k, False, lambda s, level, reach: np.minimum(s, level))


@equation("saturation")
def saturation_rail_low(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """The amplifier does not get down to its negative supply."""
    return squeezed(w, k, True, lambda s, level, reach: np.minimum(s, level))


@equation("saturation")
def saturation_compressive(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Above a knee the output impedance takes its share."""
    steep = com.uniform(0.2, 0.8)

    def law(s: Floats, level: float, reach: float) -> Floats:
        over = np.maximum(s - level, 0.0)
        return np.asarray(np.minimum(s, level) + over / (1.0 + over / (steep * reach)))

    return squeezed(w, k, False, law)


@equation("lag")
def lag_one_pole(w: World, k: int, com: Random, rng: Random) -> Tuned:
    return lambda p: lp(w.s[:, k], p), 1e-3, LIMITS["lag"]


@equation("lag")
def lag_two_poles(w: World, k: int, com: Random, rng: Random) -> Tuned:
    other = com.uniform(0.2, 1.0)
    return lambda p: lp(lp(w.s[:, k], p), other * p), 1e-3, LIMITS["lag"] / 1.5


@equation("lag")
def lag_sallen_key(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Second order, as the bilinear rule has it."""
    q = com.uniform(0.5, 0.8)

    def at(p: float) -> Floats:
        g = 2.0 * p / H
        den = np.array([g * g + g / q + 1.0, 2.0 - 2.0 * g * g, g * g - g / q + 1.0])
        num = np.array([1.0, 2.0, 1.0]) / den[0]
        s0 = w.s[0, k]
        return np.asarray(s0 + lfilter(num, den / den[0], w.s[:, k] - s0))

    return at, 1e-3, LIMITS["lag"] / 1.5


@equation("lag")
def lag_oversampling(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """The mean of the last ``p`` s."""
    n = len(w.t)
    total = np.concatenate([[0.0], np.cumsum(w.s[:, k])])
    at_i = np.arange(1.0, n + 1.0)
    grid = np.arange(n + 1.0)

    def at(p: float) -> Floats:
        back = np.interp(np.maximum(at_i - p / H, 0.0), grid, total)
        width = np.minimum(p / H, at_i)
        return np.asarray((total[1:] - back) / width)

    return at, H, 2.0 * LIMITS["lag"]


@equation("lag")
def lag_iir(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """An exponential filter in the firmware, on every sample that is sent."""
    sent = w.s[::OVER, k]
    n, at = np.arange(len(w.t)), np.arange(len(sent)) * OVER
    return lambda p: np.interp(n, at, lp(sent, p, DT)), 4e-3, LIMITS["lag"]


@equation("crosstalk")
def crosstalk_multiplexer(w: World, k: int, com: Random, rng: Random) -> Floats:
    """What was read before is left on the capacitor; the last scan's last before the first."""
    before = np.roll(w.s[:, -1], OVER) if k == 0 else w.s[:, k - 1]
    return np.asarray(before - w.s[:, k])


@equation("crosstalk")
def crosstalk_leak(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Some of another one's codes above rest."""
    return toss(rng) * active(w, another(w, k, rng))


@equation("crosstalk")
def crosstalk_capacitive(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Flanks of another one's."""
    return lp(np.gradient(w.s[:, another(w, k, rng)], H), between(rng, 0.01, 0.06))


@equation("crosstalk")
def crosstalk_ground(w: World, k: int, com: Random, rng: Random) -> Floats:
    """All the others' currents through one return."""
    others = [j for j in range(len(w.sensors)) if j != k]
    shares = rng.uniform(0.3, 1.0, len(others))
    return np.asarray(-sum(a * active(w, j) for a, j in zip(shares, others, strict=True)))


@equation("crosstalk")
def crosstalk_ghost(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A matrix without diodes: the current goes round by another one, if both are pressed."""
    return np.asarray(w.y(another(w, k, rng)) * (0.3 + w.y(k)))


def another(w: World, k: int, rng: Random) -> int:
    return int(rng.choice([j for j in range(len(w.sensors)) if j != k]))


# ----------------------------------- delay: seconds of lateness, of samples at 20 Hz for everyone


@equation("delay")
def delay_constant(w: World, k: int, com: Random, rng: Random) -> Tuned:
    return lambda p: np.full(len(w.t) // OVER, p), 1e-3, LIMITS["delay"]


@equation("delay")
def delay_skew(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """The clocks part."""
    start = com.uniform(0.0, 0.4)
    grown = start + (1.0 - start) * w.since[::OVER] / w.span_s
    return lambda p: p * grown[: len(w.t) // OVER], 1e-3, LIMITS["delay"]


@equation("delay")
def delay_samples(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """A shift on the grid of samples, by whole and broken numbers of them (four-point Lagrange)."""
    return lambda p: np.full(len(w.t) // OVER, p), 1e-3, LIMITS["delay"]


@equation("delay")
def delay_buffer(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """A buffer fills, and is emptied when full."""
    period, start, jitter = com.uniform(15.0, 60.0), com.uniform(0.4, 0.8), com.uniform()
    saw = (w.t[::OVER] / period + jitter) % 1.0
    late = gaussian_filter1d(start + (1.0 - start) * saw, 3.0)
    return lambda p: p * late[: len(w.t) // OVER], 1e-3, LIMITS["delay"]


@equation("delay")
def delay_stairs(w: World, k: int, com: Random, rng: Random) -> Tuned:
    """Lost packets: later by a little at each loss."""
    lost = np.sort(com.uniform(0.0, w.span_s * 1.5, int(com.integers(4, 12))))
    start = com.uniform(0.3, 0.6)
    steps = np.searchsorted(lost, w.t[::OVER]) / max(int(np.sum(lost < w.span_s)), 1)
    late = start + (1.0 - start) * steps
    return lambda p: p * late[: len(w.t) // OVER], 1e-3, LIMITS["delay"]


def read_late(s: Floats, late: Floats, label: str) -> Floats:
    """(samples, channels) at 20 Hz, ``late`` s after its time."""
    if label != "samples":
        n = np.arange(len(late)) * OVER - late / H
        grid = np.arange(len(s), dtype=float)
        return np.column_stack([np.interp(np.maximum(n, 0.0), grid, one) for one in s.T])
    coarse = s[::OVER][: len(late)]
    whole, d = divmod(float(late[0]) / DT, 1.0)
    taps = np.array(
        [
            -d * (d - 1.0) * (d - 2.0) / 6.0,
            (d + 1.0) * (d - 1.0) * (d - 2.0) / 2.0,
            -(d + 1.0) * d * (d - 2.0) / 2.0,
            (d + 1.0) * d * (d - 1.0) / 6.0,
        ]
    )
    at = np.arange(len(late)) - int(whole)
    pick = [coarse[np.clip(at + shift, 0, len(late) - 1)] for shift in (1, 0, -1, -2)]
    return np.asarray(sum(a * one for a, one in zip(taps, pick, strict=True)))


# ------------------------------------------------------------- on the samples: lines, spikes, noise
# From here on the World's arrays are at 20 Hz.


def hum(w: World, com: Random) -> tuple[Floats, float]:
    """Phase of the mains' alias, and how the sampling clock is off."""
    mains = float(com.choice([50.0, 60.0])) + com.uniform(-0.05, 0.05)
    off = toss(com) * com.uniform(0.006, 0.03)
    return 2.0 * np.pi * mains * w.t * (1.0 + off), off


@equation("interference")
def interference_hum(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Mains, folded down by a clock that is a little off."""
    phase, _ = hum(w, com)
    return np.sin(phase + rng.uniform(0.0, 2.0 * np.pi))


@equation("interference")
def interference_modulated(w: World, k: int, com: Random, rng: Random) -> Floats:
    phase, _ = hum(w, com)
    depth, rate = com.uniform(0.3, 0.9), between(com, 0.01, 0.1)
    slow = 1.0 + depth * np.sin(2.0 * np.pi * rate * w.t + com.uniform(0.0, 6.28))
    return np.asarray(slow * np.sin(phase + rng.uniform(0.0, 2.0 * np.pi)))


@equation("interference")
def interference_harmonics(w: World, k: int, com: Random, rng: Random) -> Floats:
    phase, _ = hum(w, com)
    sizes = (1.0, rng.uniform(0.1, 0.5), rng.uniform(0.2, 0.7))
    return np.asarray(
        sum(a * np.sin((j + 1) * phase + rng.uniform(0.0, 6.28)) for j, a in enumerate(sizes))
    )


@equation("interference")
def interference_pwm(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The pulses of a motor or a lamp, a square wave folded down."""
    f, duty = com.uniform(0.7, 9.0), com.uniform(0.2, 0.8)
    return np.asarray(((f * w.t + com.uniform()) % 1.0 < duty) - duty)


@equation("interference")
def interference_wandering(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A converter whose frequency runs about."""
    f = com.uniform(1.5, 8.5) + com.uniform(0.005, 0.05) * ou(com, len(w.t), 20.0, DT)
    return np.sin(2.0 * np.pi * np.cumsum(f) * DT + rng.uniform(0.0, 6.28))


@equation("interference")
def interference_charger(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Only while the charger is plugged in."""
    phase, _ = hum(w, com)
    share = com.uniform(0.4, 0.8)
    start = com.uniform(0.0, 1.0 - share) * w.span_s
    on = (w.t >= start) & (w.t < start + share * w.span_s) | (w.t > w.span_s * 1.2)
    return np.asarray(on * np.sin(phase + rng.uniform(0.0, 6.28)))


def hits(rng: Random, n: int, low: float, high: float) -> Floats:
    """Poisson, ``low`` … ``high`` a second, with sizes spread about 1."""
    size = np.exp(0.4 * rng.normal(size=n)) * np.where(rng.random(n) < 0.5, 1.0, -1.0)
    out = np.asarray(size * (rng.random(n) < between(rng, low, high) * DT))
    if not out[LEAD : LEAD + FIRST].any():
        out[LEAD + FIRST // 3] = 1.0
    return out


@equation("spikes")
def spikes_isolated(w: World, k: int, com: Random, rng: Random) -> Floats:
    return hits(rng, len(w.t), 0.04, 0.4)


@equation("spikes")
def spikes_doublets(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Down again as far as up, one sample later or two."""
    one = hits(rng, len(w.t), 0.04, 0.3)
    later = int(rng.integers(1, 3))
    return np.asarray(one - rng.uniform(0.5, 1.0) * np.concatenate([np.zeros(later), one[:-later]]))


@equation("spikes")
def spikes_tails(w: World, k: int, com: Random, rng: Random) -> Floats:
    one = hits(rng, len(w.t), 0.03, 0.2)
    return np.asarray(lfilter([1.0], [1.0, -np.exp(-DT / between(rng, 0.05, 0.3))], one))


@equation("spikes")
def spikes_clustered(w: World, k: int, com: Random, rng: Random) -> Floats:
    """In showers, as a bad contact gives them."""
    n = len(w.t)
    near = lfilter(
        [1.0], [1.0, -np.exp(-DT / rng.uniform(0.5, 2.0))], hits(rng, n, 0.02, 0.08) != 0
    )
    one = (
        np.exp(0.4 * rng.normal(size=n)) * toss(rng) * (rng.random(n) < 0.3 * np.minimum(near, 1.0))
    )
    if not one[LEAD : LEAD + FIRST].any():
        one[LEAD + FIRST // 2] = 1.0
    return np.asarray(one)


@equation("spikes")
def spikes_radio(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Bursts of the radio, at the same moments and to the same side on all channels."""
    one = np.abs(hits(com, len(w.t), 0.05, 0.4))
    return np.asarray(toss(rng) * np.minimum(one, 1.5) * rng.uniform(0.8, 1.2, len(one)))


@equation("noise")
def noise_louder(w: World, k: int, com: Random, rng: Random) -> Floats:
    return rng.normal(size=len(w.t))


@equation("noise")
def noise_heavy(w: World, k: int, com: Random, rng: Random) -> Floats:
    return np.asarray(np.clip(rng.standard_t(rng.uniform(2.5, 4.0), len(w.t)), -15.0, 15.0))


@equation("noise")
def noise_with_signal(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Shot noise and worse."""
    level = np.clip(w.y(k), 0.0, None) ** rng.choice([0.5, 1.0])
    return np.asarray((0.15 + level) * rng.normal(size=len(w.t)))


@equation("noise")
def noise_with_speed(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Rubbing cables."""
    v = np.abs(np.gradient(w.u, DT))
    return np.asarray((0.1 + v / (np.sqrt(np.mean(v**2)) + 1e-9)) * rng.normal(size=len(w.t)))


@equation("noise")
def noise_coloured(w: World, k: int, com: Random, rng: Random) -> Floats:
    return ou(rng, len(w.t), between(rng, 0.05, 0.25), DT)


@equation("noise")
def noise_bursts(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Now and then."""
    state = ou(com, len(w.t), between(com, 1.0, 8.0), DT) > com.uniform(0.5, 1.2)
    return np.asarray((0.1 + state) * rng.normal(size=len(w.t)))


# -------------------------------------------------------------------------------------------- ADC
# These give a function of codes and size; the size is what the rms is solved for.

Converter = Callable[[Floats, float], Floats]
CONVERTERS: dict[str, Callable[[Random, float, float], Converter]] = {}
FULL = np.arange(4097.0)


def converter(build: Callable[[Random, float, float], Converter]) -> None:
    CONVERTERS[build.__name__.removeprefix("adc_")] = build


def tabled(error: Floats) -> Converter:
    """Codes and an error that depends on them alone."""
    return lambda codes, p: codes + p * np.interp(codes, FULL, error)


@converter
def adc_bow(rng: Random, low: float, high: float) -> Converter:
    z = FULL / 4096.0
    return tabled(toss(rng) * 4.0 * z * (1.0 - z))


@converter
def adc_s_shape(rng: Random, low: float, high: float) -> Converter:
    return tabled(toss(rng) * np.sin(2.0 * np.pi * FULL / 4096.0 + rng.uniform(-0.3, 0.3)))


@converter
def adc_segments(rng: Random, low: float, high: float) -> Converter:
    """Each segment of a string of resistors has an offset of its own."""
    n = int(rng.choice([16, 32, 64]))
    return tabled(rng.normal(size=n)[np.minimum((FULL * n / 4096.0).astype(int), n - 1)])


@converter
def adc_capacitors(rng: Random, low: float, high: float) -> Converter:
    """Errors of the binary weights: jumps at the major carries."""
    bits = (FULL.astype(int)[:, None] >> np.arange(12)) & 1
    error = bits @ (rng.normal(size=12) * np.sqrt(2.0) ** np.arange(12) / 64.0)
    return tabled(error - np.interp(FULL, [0.0, 4096.0], [error[0], error[-2]]))


@converter
def adc_widths(rng: Random, low: float, high: float) -> Converter:
    """Every code is a little wider or narrower than the last, which adds up; ends adjusted."""
    error = np.cumsum(rng.normal(size=4097) + 0.3 * rng.normal(size=16)[np.arange(4097) % 16])
    return tabled((error - np.linspace(error[0], error[-1], 4097)) / 60.0)


@converter
def adc_missing(rng: Random, low: float, high: float) -> Converter:
    """Codes that never come, a gap every so often, in some stretches the wider."""
    start = rng.uniform(0.0, 1.0)
    bent = rng.uniform(0.0, 0.15)

    def at(codes: Floats, p: float) -> Floats:
        gap = 3.5 * p * (1.0 + bent * np.sin(codes / 300.0))
        return np.asarray((np.floor(codes / gap + start) + 0.5 - start) * gap)

    return at


# ---------------------------------------------------------------------------- outside the catalogue


@equation("sway")
def sway_lateral(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The weight shifts from side to side, a second freedom that nobody logs."""
    shift = gaussian_filter1d(com.normal(size=len(w.t)), com.uniform(0.15, 0.5) / H)
    return np.asarray(rng.uniform(0.5, 1.0) * toss(rng) * shift * (0.2 + w.own[k]))


@equation("crease")
def crease_fold(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A fold pops in when stretched far enough, out when slack, never at the same place twice."""
    x = w.own[k].tolist()
    state, out = 0.0, []
    edge = rng.uniform(0.3, 0.9)
    for i, value in enumerate(x):
        if i % 2000 == 0 or (state == 0.0 and value > edge) or (state and value < edge):
            if state == 0.0 and value > edge and rng.random() < 0.6:
                state, edge = float(rng.normal(1.0, 0.5)), rng.uniform(0.05, 0.5)
            elif state and value < edge:
                state, edge = 0.0, rng.uniform(0.3, 0.9)
            elif state == 0.0:
                edge = rng.uniform(0.3, 0.9)
        out.append(state)
    return lp(np.array(out), 0.05)


@equation("migration")
def migration_sleeve(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Works its way down with every stride and is pulled up now and then, not always wholly."""
    steps = np.diff(w.travel(), prepend=0.0)
    rate = com.uniform(0.5, 1.5) / (w.travel()[-1] / len(w.t))
    pulls = com.random(len(w.t)) < H / between(com, 15.0, 50.0)
    left = com.uniform(0.0, 0.5, len(w.t))
    low, out = 0.0, []
    for moved, pull, rest in zip(
        (steps * rate).tolist(), pulls.tolist(), left.tolist(), strict=True
    ):
        low = rest * low if pull else low + moved
        out.append(low)
    return np.asarray(toss(rng) * lp(np.array(out), 0.2) * (0.4 + w.own[k]))


@equation("brownout")
def brownout_supply(w: World, k: int, com: Random, rng: Random) -> Floats:
    """The supply sags at random moments, the whole reading with it."""
    n, sag = len(w.t), np.zeros(len(w.t))
    at = int(com.exponential(8.0) / H)
    while at < n:
        length = int(com.uniform(0.3, 2.5) / H)
        sag[at : at + length] = np.maximum(sag[at : at + length], com.uniform(0.4, 1.0))
        at += length + int(com.exponential(10.0) / H)
    return np.asarray(-lp(sag, 0.1) * w.s[:, k] * rng.uniform(0.8, 1.2))


@equation("rezero")
def rezero_tracker(w: World, k: int, com: Random, rng: Random) -> Floats:
    """A touch chip takes what it reads for its new baseline, at moments of its own."""
    y, out = active(w, k), np.zeros(len(w.t))
    at = int(rng.exponential(15.0) / H)
    while at < len(y):
        after = at + int((4.0 + rng.exponential(20.0)) / H)
        out[at:after] = -y[at] * rng.uniform(0.5, 1.0)
        at = after
    return out


@equation("wrinkle")
def wrinkle_ridges(w: World, k: int, com: Random, rng: Random) -> Floats:
    """Ridges under the sensor, which lie elsewhere as it shifts."""
    phase = 3.0 * ou(rng, len(w.t), between(rng, 5.0, 30.0))
    return np.asarray(np.sin(2.0 * np.pi * rng.uniform(1.5, 5.0) * w.own[k] + phase))


# ------------------------------------------------------------------------------------ putting it up


def drawn(seed: int, name: str) -> str:
    """The equation that the seed draws for a mechanism."""
    labels = list(CONVERTERS if name == "adc_nonlinearity" else EQUATIONS[name])
    return labels[int(stream(seed, name, "equation").integers(len(labels)))]


def affected(seed: int, name: str, channels: int) -> tuple[int, ...]:
    rng = stream(seed, name, "channels")
    if name in WIDE or rng.random() < 0.3:
        return tuple(range(channels))
    few = rng.choice(channels, int(rng.integers(1, channels)), replace=False)
    return tuple(sorted(few.tolist()))


def wanted(seed: int, name: str, k: int) -> float:
    """rms over noise that a channel is to get: alike among channels, not the same."""
    common = between(stream(seed, name, "size"), 3.0, 30.0)
    own = np.exp(0.25 * stream(seed, name, "size", k).normal())
    return float(np.clip(common * own, LEAST, MOST))


def sizes(added: Floats) -> tuple[Floats, Floats]:
    """rms, and rms about the mean."""
    return np.sqrt(np.mean(np.square(added), axis=0)), np.std(added, axis=0)


def solved(ratio: Callable[[float], float], goal: float, low: float, high: float) -> float:
    """The parameter that gives ``goal``, or the bound that comes next to it."""
    if ratio(high) <= goal:
        return high
    for _ in range(16):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if ratio(middle) < goal else (low, middle)
    return float(np.sqrt(low * high))


def fitted(added: Callable[[float], Floats], goal: float, low: float, high: float) -> float:
    """The parameter that adds ``goal`` times the noise; more if next to nothing of it varies."""

    def enough(p: float) -> float:
        whole, varying = sizes(added(p))
        return float(min(whole / goal, varying / LEAST))

    most = solved(lambda p: float(sizes(added(p))[0]), MOST, low, high)
    return min(solved(enough, 1.0, low, high), most)


def shared(
    seed: int, name: str, added: Callable[[float], Floats], low: float, high: float
) -> float:
    """One parameter for all channels, all of them within 3 … 30 if that can be."""
    least = solved(lambda p: float(sizes(added(p))[1].min()), LEAST, low, high)
    most = solved(lambda p: float(sizes(added(p))[0].max()), MOST, low, high)
    p = between(stream(seed, name, "size"), least, most) if most > least else most
    while p > low and sizes(added(p))[0].max() > 30.0:  # not all grow evenly with p
        p *= 0.95
    return p


def alter(w: World, seed: int, name: str, noise: Floats, channels: tuple[int, ...]) -> None:
    """Puts one effect on the signals of its channels."""
    label = drawn(seed, name)
    before = World(w.t, w.u, w.own, w.s.copy(), w.sensors, w.first, w.onset_s)
    for k in channels:
        com, rng = stream(seed, name, "all"), stream(seed, name, "own", k)
        goal = wanted(seed, name, k)
        effect = EQUATIONS[name][label]
        shape = effect(before, k, com, rng)
        if isinstance(shape, tuple):
            at, low, high = shape
            s = before.s[:, k]

            def more(
                p: float, k: int = k, s: Floats = s, at: Callable[[float], Floats] = at
            ) -> Floats:
                return np.asarray((at(p) - s)[w.first] / noise[k])

            w.s[:, k] = at(fitted(more, goal, low, high))
            continue
        if name in STRAIN_SIDE:
            shape = shape * w.sensors[k].sign
        whole, varying = np.maximum(sizes(shape[w.first]), 1e-12)
        added = shape * noise[k] * min(max(goal / whole, LEAST / varying), MOST / whole)
        if name in ("spikes", "noise"):
            added = np.clip(added, -LARGEST, LARGEST)
        w.s[:, k] = before.s[:, k] + added


def read(u: Floats, row: list[Sensor]) -> Floats:
    return np.column_stack([sensor(u) for sensor in row])


def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    """The case that a seed gives, with the effects ``names`` hidden in its real recordings."""
    unknown = [name for name in names if name not in (*NAMES, *FOREIGN)]
    if unknown:
        raise ValueError(f"unknown effects: {unknown}")
    device, largest, row, noise = sensors(seed)
    channels = len(row)
    gap = int(stream(seed, "gap").integers(120, 1200))
    u = motion(seed, excitation, device, gap)
    t: Floats = np.arange(len(u), dtype=np.float64) * H - LEAD * DT
    first = (LEAD + np.arange(FIRST)) * OVER
    truth = {name: affected(seed, name, channels) for name in names}
    simulated = read(u, row)

    # Motion
    moved = u
    if "backlash" in names:
        still = World(t, u, [], simulated, row, first, onset(seed))
        label = drawn(seed, "backlash")
        shape = EQUATIONS["backlash"][label](still, 0, stream(seed, "backlash", "all"), stream(0))
        assert isinstance(shape, tuple)
        lost, low, high = shape

        def gap_of(p: float) -> Floats:
            return np.asarray((read(lost(p), row) - simulated)[first] / noise)

        moved = lost(shared(seed, "backlash", gap_of, low, high))
    own = [sensor.strain(moved) for sensor in row]
    real = read(moved, row) if "backlash" in names else simulated.copy()

    # Material and front end, at 100 Hz
    w = World(t, moved, own, real, row, first, onset(seed))
    for name in (*MATERIAL, *FRONT):
        if name in names:
            alter(w, seed, name, noise, truth[name])

    # The clock, and 20 Hz
    sim20, real20 = simulated[::OVER], w.s[::OVER]
    first20 = np.arange(LEAD, LEAD + FIRST)
    if "delay" in names:
        label = drawn(seed, "delay")
        shape = EQUATIONS["delay"][label](w, 0, stream(seed, "delay", "all"), stream(0))
        assert isinstance(shape, tuple)
        late, low, high = shape

        def off_by(p: float) -> Floats:
            return np.asarray((read_late(w.s, late(p), label) - w.s[::OVER])[first20] / noise)

        real20 = read_late(w.s, late(shared(seed, "delay", off_by, low, high)), label)
    own20 = [one[::OVER] for one in own]
    w20 = World(t[::OVER], moved[::OVER], own20, real20.copy(), row, first20, onset(seed))
    for name in SAMPLED:
        if name in names:
            alter(w20, seed, name, noise, truth[name])

    # Conversion: the same converter for clean codes and for noisy ones
    clean = w20.s
    noisy = clean + stream(seed, "white", "real").normal(size=clean.shape) * noise
    if "adc_nonlinearity" in names:
        build = CONVERTERS[drawn(seed, "adc_nonlinearity")]
        clean = clean.copy()
        one_chip = stream(seed, "adc_nonlinearity", "chip").random() < 0.5
        for k in truth["adc_nonlinearity"]:
            rng = stream(seed, "adc_nonlinearity", "own", 0 if one_chip else k)
            s = clean[:, k].copy()
            law = build(rng, float(s[first20].min()), float(s[first20].max()))

            def more(p: float, k: int = k, s: Floats = s, law: Converter = law) -> Floats:
                return np.asarray((law(s, p) - s)[first20] / noise[k])

            goal = wanted(seed, "adc_nonlinearity", k)
            p = fitted(more, goal, 0.05, LIMITS["adc_nonlinearity"])
            clean[:, k], noisy[:, k] = law(s, p), law(noisy[:, k], p)

    labels = tuple(f"s{k + 1}" for k in range(channels))
    strain = largest * u[::OVER]
    # A difference of arrays that may have gone through the same steps: exact zeros stay so.
    change = (clean - sim20)[first20]

    def recorded(codes: Floats, part: slice) -> Recording:
        return Recording(
            f"case{seed}",
            labels,
            np.clip(np.rint(codes[part]), 0, 4095).astype(np.int32),
            ("strain",),
            ("1",),
            strain[part, None].copy(),
            np.arange(part.stop - part.start) * DT,
            tuple(FrontEnd("codes", 12) for _ in labels),
        )

    one = slice(LEAD, LEAD + FIRST)
    start = LEAD + FIRST + gap
    two = slice(start, start + SECOND)
    noisy_sim = sim20 + stream(seed, "white", "sim").normal(size=sim20.shape) * noise
    return Case(
        recorded(noisy_sim, one),
        recorded(noisy, one),
        recorded(noisy_sim, two),
        recorded(noisy, two),
        change,
        np.sqrt(2.0 * noise**2 + 1.0 / 6.0),
        truth,
        excitation,
        onset(seed) if "step" in names else None,
        True,
    )
