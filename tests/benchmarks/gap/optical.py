"""Made cases of a gap: optical, magnetic and barometric strain sensors in a soft gripper.

Written without a look at this project; nothing in it imports the effects or the simulator.
Stretched waveguides (Beer-Lambert), Hall sensors (magnet at a distance, 1/d^3) and sealed air;
the motion and the material run on a clock five times as fast as the readings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import wraps
from math import copysign, exp, log, sqrt

import numpy as np
from cases import Case, converted
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.signal import fftconvolve, lfilter
from scipy.special import erf

Floats = NDArray[np.float64]
Random = np.random.Generator

DT = 0.05
FINE = 5  # fine steps in a sample
STEP = DT / FINE
FIRST, BETWEEN, SECOND = 8000, 400, 4000
SAMPLES = FIRST + BETWEEN + SECOND
RANGE = 0.4
TOP = 4095.0
NUMBER = 90417  # of this generator's random streams
EXCITATIONS = ("rich", "typical", "poor")
RETUNED: list[str] = []


@dataclass
class View:
    """What an equation sees of its channel; ``t``, ``x`` and ``strain`` on its stage's clock."""

    t: Floats
    dt: float
    x: Floats  # strain or codes, as the earlier effects left it
    strain: Floats  # of the sensor, after the motion stage
    every: Floats  # ``x`` of all channels
    rests: Floats
    rest: float
    span: float  # codes from rest to full strain, with its sign
    channel: int
    onset: float
    common: Random  # the same on every channel
    own: Random


Apply = Callable[..., Floats]
Equation = Callable[[View], tuple[Apply, float]]  # what an amount does, and the most of it


def adds(peak: float) -> Callable[[Callable[[View], Floats]], Equation]:
    """An equation that adds its amount of a shape, at most ``peak`` of it anywhere."""

    def wrap(shape: Callable[[View], Floats]) -> Equation:
        @wraps(shape)
        def equation(view: View) -> tuple[Apply, float]:
            d = shape(view)
            return (lambda a: view.x + a * d), peak / max(float(np.abs(d).max()), 1e-12)

        return equation

    return wrap


def scales(factor: Callable[[View], tuple[float, Floats | float]]) -> Equation:
    """An equation that scales about a zero, by at most 40 %."""

    @wraps(factor)
    def equation(view: View) -> tuple[Apply, float]:
        zero, h = factor(view)
        return (lambda a: view.x + a * h * (view.x - zero)), 0.4 / float(np.abs(h).max())

    return equation


def log_uniform(rng: Random, low: float, high: float) -> float:
    return exp(rng.uniform(log(low), log(high)))


def sign(rng: Random) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def pole(x: Floats, tau: float, dt: float, start: float | None = None) -> Floats:
    """One pole, gain 1, settled at the start."""
    p = exp(-dt / max(tau, 1e-9))
    first = x[0] if start is None else start
    return lfilter([1 - p], [1, -p], x, zi=[p * first])[0]


def boxcar(x: Floats, width: float, dt: float) -> Floats:
    """Running mean over ``width`` seconds, which need not be whole steps."""
    area = np.concatenate(([0.0], np.cumsum(x - x[0]) * dt))
    at = np.arange(len(area)) * dt
    width = max(width, dt)
    return x[0] + (area - np.interp(at - width, at, area))[1:] / width


def to_fine(d: Floats | list[float]) -> Floats:
    return np.interp(np.arange(SAMPLES * FINE) / FINE, np.arange(SAMPLES), d)


def speed(view: View) -> Floats:
    return np.abs(np.gradient(view.strain, view.dt))


def play(x: Iterable[float], half: float, start: float = 0.0) -> Floats:
    y, out = start, []
    for u in x:
        if u - half > y:
            y = u - half
        elif u + half < y:
            y = u + half
        out.append(y)
    return np.array(out)


# --- Motion: lost motion (at most 15 % of the range) and loads that nobody logs.

LOST = 0.15 * RANGE


def hard_play(view: View) -> tuple[Apply, float]:
    x = view.x.tolist()
    return (lambda a: play(x, a / 2)), LOST


def sprung_play(view: View) -> tuple[Apply, float]:
    """A soft pad in the gap passes part of the motion on."""
    x, part = view.x.tolist(), view.common.uniform(0.1, 0.35)
    return (lambda a: part * view.x + (1 - part) * play(x, a / 2)), LOST


def one_flank(view: View) -> tuple[Apply, float]:
    """A tendon pulls at one flank: loading is right, unloading comes late by the whole width."""
    x = view.x.tolist()
    return (lambda a: play(x, a / 2, -a / 2) + a / 2), LOST


def rounded_play(view: View) -> tuple[Apply, float]:
    """The flanks engage gradually: the gap takes less the nearer it is to its end."""
    steps, power = np.diff(view.x, prepend=view.x[0]).tolist(), view.common.integers(2, 5)

    def apply(a: float) -> Floats:
        half, gap, out = a / 2, 0.0, []
        for dx in steps:
            share = gap / half
            gap += dx * (1 - abs(share) ** power) if dx * share > 0 else dx
            gap = min(max(gap, -half), half)
            out.append(gap)
        return view.x - np.array(out)

    return apply, LOST


def worn_gear(view: View) -> tuple[Apply, float]:
    """Wider where the teeth are worn most; ``a`` is the widest."""
    x = view.x.tolist()
    centre, width = view.common.uniform(0.08, 0.25), view.common.uniform(0.08, 0.2)
    share = (0.4 + 0.6 * np.exp(-(((view.x - centre) / width) ** 2))).tolist()

    def apply(a: float) -> Floats:
        y, out = 0.0, []
        for u, s in zip(x, share, strict=True):
            half = a * s / 2
            y = min(max(y, u - half), u + half)
            out.append(y)
        return np.array(out)

    return apply, LOST


def creeping_play(view: View) -> tuple[Apply, float]:
    """A weak spring draws the free end to the middle of the gap in some seconds."""
    x, keep = view.x.tolist(), exp(-STEP / log_uniform(view.common, 8.0, 60.0))

    def apply(a: float) -> Floats:
        half, gap, last, out = a / 2, 0.0, 0.0, []
        for u in x:
            gap = min(max(keep * gap + u - last, -half), half)
            last = u
            out.append(u - gap)
        return np.array(out)

    return apply, LOST


@adds(0.12)
def contact_load(view: View) -> Floats:
    """Objects press on the finger now and then, each with a force of its own."""
    rng, load = view.common, np.zeros_like(view.t)
    at = rng.uniform(2.0, 12.0)
    while at < view.t[-1]:
        hold = log_uniform(rng, 0.5, 15.0)
        load[(view.t >= at) & (view.t < at + hold)] = rng.gamma(3.0)
        at += hold + rng.exponential(12.0)
    return pole(pole(load, 0.15, STEP), rng.uniform(0.05, 0.4), STEP)


def second_freedom(view: View) -> tuple[Apply, float]:
    """The finger also twists, after a motor that is not in the log."""
    rng, count = view.common, view.every.shape[1]
    at = np.cumsum(rng.gamma(2.0, rng.uniform(0.8, 4.0), 3000))
    twist = pole(np.interp(view.t, at, rng.normal(size=3000)), 0.1, STEP)
    d = (twist - twist[0])[:, None] * (rng.uniform(0.5, 1.0, count) * sign(rng))
    return (lambda a: view.every + a * d), 0.12 / float(np.abs(d).max())


# --- Hysteresis, in strain: what is added lags, and does not know the rate.


@adds(0.08)
def preisach(view: View) -> Floats:
    """Relays less the mean of the branches of their major loop."""
    rng, x, count = view.own, view.x[::FINE], 120
    lows = rng.beta(1.3, 1.8, count) * 0.8 * RANGE
    ups = lows + 0.01 + rng.exponential(rng.uniform(0.02, 0.07), count)
    order, d = np.arange(len(x)), np.zeros(len(x))
    for low, up, weight in zip(lows, ups, rng.exponential(1.0, count), strict=True):
        inside = (x > low) & (x < up)
        last = np.maximum.accumulate(np.where(inside, 0, order))
        d += weight * inside * np.where(x[last] >= up, 0.5, -0.5)
    return to_fine(d)


@adds(0.08)
def dahl(view: View) -> Floats:
    """Friction of the fibre in its sleeve, of exponential presliding."""
    length, z, out = log_uniform(view.own, 0.01, 0.1), 0.0, [0.0]
    for dx in np.diff(view.x[::FINE]).tolist():
        end = copysign(1.0, dx)
        z = end + (z - end) * exp(-abs(dx) / length)
        out.append(-z)
    return to_fine(out)


@adds(0.08)
def bouc_wen(view: View) -> Floats:
    rng = view.own
    length, beta, power = log_uniform(rng, 0.02, 0.12), rng.uniform(0.25, 0.6), rng.uniform(1, 2)
    z, out = 0.0, [0.0]
    for dx in np.diff(view.x).tolist():
        turn = 1 - beta if dx * z > 0 else beta - 1
        z += dx / length * (1 - abs(z) ** power * (beta + turn))
        z = min(max(z, -1.0), 1.0)
        out.append(-z)
    return np.array(out)


@adds(0.08)
def coleman_hodgdon(view: View) -> Floats:
    """Duhem's dw = (g(x) - 1) dx - |dx| w / length, exact over a step."""
    rng, x = view.own, view.x[::FINE]
    length, g, slope = log_uniform(rng, 0.02, 0.15), rng.uniform(0.1, 0.5), rng.uniform(-0.6, 0.6)
    pull = ((g * (1 + slope * x / RANGE) - 1) * length).tolist()
    w, out = 0.0, [0.0]
    for dx, p in zip(np.diff(x).tolist(), pull[1:], strict=True):
        keep = exp(-abs(dx) / length)
        w = w * keep + copysign(p, p * dx) * (1 - keep)
        out.append(w)
    return to_fine(out)


@adds(0.08)
def jiles_atherton(view: View) -> Floats:
    """The flux guide keeps part of its magnetisation."""
    rng = view.own
    h = (view.x / RANGE - rng.uniform(0.2, 0.6)) * rng.uniform(1.5, 3.5)
    still, pin, mean = np.tanh(h), rng.uniform(0.4, 1.0), rng.uniform(0.0, 0.15)
    m, out = float(still[0]), [0.0]
    for dh, target in zip(np.diff(h).tolist(), still[1:].tolist(), strict=True):
        lack = target - m
        if lack * dh > 0:
            move = abs(dh) * lack / (pin - mean * abs(lack))
            m += lack if abs(move) > abs(lack) else move
        out.append(m - target)
    return np.array(out)


@adds(0.08)
def capstan(view: View) -> Floats:
    """Stick and slip of five pieces of the fibre; more friction where it is tight."""
    rng, x = view.own, view.x[::FINE]
    d = np.zeros(len(x))
    for half in np.geomspace(0.004, rng.uniform(0.04, 0.1), 5):
        d -= rng.exponential() * (x - play(x.tolist(), half))
    return to_fine(d * (1 + rng.uniform(0.0, 2.0) * x / RANGE))


# --- Relaxation, in strain: nothing is left of it after a long hold, or little.


@adds(0.12)
def prony(view: View) -> Floats:
    rng, d = view.own, np.zeros_like(view.x)
    for tau in np.geomspace(rng.uniform(1.0, 3.0), rng.uniform(30.0, 150.0), 3):
        d += rng.uniform(0.3, 1.0) * (pole(view.x, tau, STEP) - view.x)
    return d


def remembered(view: View, kernel: Floats) -> Floats:
    """Creep after ``kernel``; what of it is plain scale is calibrated away."""
    x = view.x[::FINE]
    d = fftconvolve(np.diff(x, prepend=x[0]), kernel)[: len(x)]
    return to_fine(d - x * (d[:FIRST] @ x[:FIRST]) / (x[:FIRST] @ x[:FIRST]))


@adds(0.12)
def springpot(view: View) -> Floats:
    """Fractional creep, t^alpha."""
    return remembered(view, ((np.arange(SAMPLES) + 0.5) * DT) ** view.own.uniform(0.08, 0.4))


@adds(0.12)
def creep_by_decades(view: View) -> Floats:
    t = (np.arange(SAMPLES) + 0.5) * DT
    return remembered(view, np.log1p(t / log_uniform(view.own, 0.3, 3.0)))


@adds(0.12)
def burgers(view: View) -> Floats:
    """A Kelvin cell and a dashpot, whose flow stays."""
    rng = view.own
    cell = pole(view.x, log_uniform(rng, 2.0, 40.0), STEP) - view.x
    return cell + np.cumsum(view.x) * STEP / log_uniform(rng, 1500.0, 6000.0)


@adds(0.12)
def schapery(view: View) -> Floats:
    """A cell whose load grows faster than the strain and which is quicker when strained."""
    rng, x = view.own, view.x[::FINE]
    load = x * (1 + rng.uniform(0.3, 1.5) * np.abs(x) / RANGE)
    tau = log_uniform(rng, 5.0, 60.0) * np.exp(-rng.uniform(0.3, 2.0) * x / RANGE)
    z, out = 0.0, []
    for u, keep in zip(load.tolist(), np.exp(-DT / tau).tolist(), strict=True):
        z = u + (z - u) * keep
        out.append(z - u)
    return to_fine(out)


@adds(0.12)
def orifice(view: View) -> Floats:
    """Air seeps through a pinhole as the root of the pressure: it reads high, then relaxes."""
    flow, z, out = log_uniform(view.own, 0.006, 0.06) * STEP, 0.0, []
    for u in view.x.tolist():
        lack = u - z
        z += copysign(min(flow * sqrt(abs(lack)), abs(lack)), lack)
        out.append(u - z)
    return np.array(out)


# --- Softening, in strain, by the largest strain so far.


def largest(view: View) -> Floats:
    return np.maximum(np.maximum.accumulate(view.x), 1e-6)


@adds(0.1)
def ogden_roxburgh(view: View) -> Floats:
    """Energies x^2 / 2 of a neo-Hookean strip."""
    rng, most = view.own, largest(view) ** 2 / 2
    width = rng.uniform(0.002, 0.02) + rng.uniform(0.05, 0.4) * most
    return -view.x * erf(np.maximum(most - view.x * np.abs(view.x) / 2, 0.0) / width)


@adds(0.1)
def simo_damage(view: View) -> Floats:
    return -view.x * (1 - np.exp(-largest(view) / log_uniform(view.own, 0.08, 0.5)))


@adds(0.1)
def set_and_slack(view: View) -> Floats:
    """Right on the virgin curve; below it the strip is longer by its set."""
    most, power = largest(view), view.own.uniform(1.0, 2.0)
    return -(most**power) * np.clip(1 - view.x / most, 0.0, 1.0)


@adds(0.1)
def cracked_cladding(view: View) -> Floats:
    """Past a threshold, new cracks lose light for good, and more when they are pulled open."""
    rng = view.own
    over = largest(view) - rng.uniform(0.02, 0.12)
    open_part = view.x / largest(view)
    return np.maximum(over, 0.0) ** rng.uniform(0.7, 2.0) * (0.2 + open_part)


@adds(0.1)
def chain_scission(view: View) -> Floats:
    """The memory follows a new largest strain in some seconds, not at once."""
    keep, most, out = exp(-STEP / log_uniform(view.own, 0.3, 6.0)), 0.0, []
    for u in view.x.tolist():
        if u > most:
            most = u + (most - u) * keep
        out.append(most)
    return -view.x * (np.array(out) / RANGE) ** view.own.uniform(0.6, 1.5)


# --- From here in codes. Overshoot: light is lost with |rate|, and comes back.

SWING = 1000.0


@adds(SWING)
def rate_loss(view: View) -> Floats:
    return view.span * pole(speed(view), log_uniform(view.own, 0.2, 3.0), STEP)


@adds(SWING)
def bounded_rate_loss(view: View) -> Floats:
    """Microbends: as the square of a low speed, no more at a high one."""
    v, knee = speed(view), log_uniform(view.own, 0.05, 0.5)
    return view.span * pole(v**2 / (v**2 + knee**2), log_uniform(view.own, 0.2, 2.0), STEP)


@adds(SWING)
def rise_and_decay(view: View) -> Floats:
    loss = pole(speed(view), view.own.uniform(0.05, 0.2), STEP)
    return view.span * pole(loss, log_uniform(view.own, 0.3, 2.5), STEP)


@adds(SWING)
def recombination(view: View) -> Floats:
    """Traps fill with |rate| and empty in pairs: dz/dt = |v| - z / tau - k z^2."""
    rng = view.own
    tau, pairs, z, out = log_uniform(rng, 0.8, 3.0), log_uniform(rng, 1.0, 10.0), 0.0, []
    for v in speed(view).tolist():
        z += STEP * v
        z *= 1 / (1 + STEP * (1 / tau + pairs * z))
        out.append(z)
    return view.span * np.array(out)


@adds(SWING)
def peak_and_decay(view: View) -> Floats:
    """Friction heats at the fastest moment."""
    keep, z, out = exp(-STEP / log_uniform(view.own, 0.3, 2.5)), 0.0, []
    for v in speed(view).tolist():
        z = max(v, z * keep)
        out.append(z)
    return view.span * np.array(out)


@adds(SWING)
def rectified_lag(view: View) -> Floats:
    """The core and its cladding shear; either way loses light."""
    shear = view.strain - pole(view.strain, log_uniform(view.own, 0.2, 2.5), STEP)
    return view.span * np.abs(shear) ** view.own.uniform(1.0, 1.5)


# --- Drift, by the time since the start only.


@adds(SWING)
def led_warm_up(view: View) -> Floats:
    rng, t = view.own, view.t
    slow = 1 - np.exp(-t / log_uniform(rng, 100.0, 500.0))
    return sign(rng) * (slow + rng.uniform(0, 0.5) * (1 - np.exp(-t / rng.uniform(10, 60))))


@adds(SWING)
def root_of_time(view: View) -> Floats:
    """Water diffuses into the silicone."""
    return sign(view.own) * view.t ** view.own.uniform(0.4, 0.8)


@adds(SWING)
def room_temperature(view: View) -> Floats:
    rng = view.own
    turn, phase = 2 * np.pi / log_uniform(rng, 500.0, 3000.0), rng.uniform(0, 2 * np.pi)
    return np.sin(turn * view.t + phase) - np.sin(phase)


@adds(SWING)
def heating_comes_on(view: View) -> Floats:
    rng = view.own
    late = (view.t - rng.uniform(80.0, 300.0)) / rng.uniform(20.0, 80.0)
    return sign(rng) / (1 + np.exp(-late))


@adds(SWING)
def ageing_by_decades(view: View) -> Floats:
    return sign(view.own) * np.log1p(view.t / log_uniform(view.own, 5.0, 100.0))


@adds(SWING)
def weather(view: View) -> Floats:
    """Air pressure, as a cubic of time."""
    u, rng = view.t / (SAMPLES * DT), view.own
    return rng.normal() * u + rng.normal() * u**2 + rng.normal() * u**3


# --- Random walk.


@adds(SWING)
def wiener(view: View) -> Floats:
    return to_fine(np.cumsum(view.own.normal(size=SAMPLES)))


@adds(SWING)
def ornstein_uhlenbeck(view: View) -> Floats:
    tau = log_uniform(view.own, 30.0, 200.0)
    return to_fine(pole(view.own.normal(size=SAMPLES), tau, DT, 0.0))


@adds(SWING)
def octaves(view: View) -> Floats:
    """Traps of equal weight in each octave of their time."""
    rng, d = view.own, np.zeros(SAMPLES)
    for tau in 12.0 * 2.0 ** np.arange(6):
        d += pole(rng.normal(size=SAMPLES), tau, DT, 0.0) * sqrt(tau)
    return to_fine(d)


@adds(SWING)
def smooth_wander(view: View) -> Floats:
    """Temperature: random power through two heat capacities."""
    rng = view.own
    power = pole(rng.normal(size=SAMPLES), log_uniform(rng, 5.0, 25.0), DT, 0.0)
    return to_fine(pole(power, log_uniform(rng, 60.0, 300.0), DT, 0.0))


@adds(SWING)
def red_spectrum(view: View) -> Floats:
    rng, count = view.own, 4 * SAMPLES
    f = np.maximum(np.fft.rfftfreq(count, DT), 1 / (count * DT))
    parts = rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))
    d = np.fft.irfft(parts * f ** -rng.uniform(0.8, 1.2), count)[:SAMPLES]
    return to_fine(d - d[0])


@adds(SWING)
def mode_hops(view: View) -> Floats:
    """The light finds another way through the guide, now and then, by a little."""
    rng = view.own
    hops = rng.normal(size=SAMPLES) * (rng.random(SAMPLES) < DT / rng.uniform(4.0, 20.0))
    return to_fine(pole(np.cumsum(hops), rng.uniform(1.0, 10.0), DT, 0.0))


# --- Gain.


@scales
def wrong_scale(view: View) -> tuple[float, float]:
    return view.rest + view.own.normal(0.0, 40.0), sign(view.own)


@scales
def wrong_reference(view: View) -> tuple[float, float]:
    """The converter's reference is off: about code 0."""
    return 0.0, sign(view.own)


@scales
def led_ageing(view: View) -> tuple[float, Floats]:
    return view.own.uniform(0, 200), np.exp(-view.t / log_uniform(view.own, 150.0, 1000.0)) - 1


@scales
def bleaching(view: View) -> tuple[float, Floats]:
    """The dye fades with every cycle."""
    path = np.cumsum(np.abs(np.diff(view.strain, prepend=view.strain[0])))
    return view.own.uniform(0, 200), -(1 - np.exp(-path / log_uniform(view.own, 10.0, 100.0)))


@scales
def magnet_ageing(view: View) -> tuple[float, Floats]:
    """Magnetic viscosity, about the code of no field."""
    zero = view.rest + view.span * view.own.uniform(0.8, 1.3)
    return zero, -np.log1p(view.t / log_uniform(view.own, 1.0, 60.0))


@scales
def warm_hall_plate(view: View) -> tuple[float, Floats]:
    """A wrong factor and, as the plate warms, more of it."""
    warm = 1 - np.exp(-view.t / log_uniform(view.own, 40.0, 300.0))
    return TOP / 2, sign(view.own) * (view.own.uniform(0.2, 1.0) + warm)


# --- Step.


@adds(SWING)
def shifted(view: View) -> Floats:
    return sign(view.own) * (view.t >= view.onset)


def steps_gain(view: View, offset: float, h: Floats) -> tuple[Apply, float]:
    """The gain about rest and ``offset`` times as much of the span change by ``h`` of an amount."""
    towards = view.x - view.rest + offset * view.span
    return (lambda a: view.x + a * h * towards), 0.4 / float(np.abs(h).max())


def lost_strand(view: View) -> tuple[Apply, float]:
    return steps_gain(view, 0.0, -1.0 * (view.t >= view.onset))


def knocked(view: View) -> tuple[Apply, float]:
    """The LED sits askew: other gain and other rest."""
    h = sign(view.own) * (view.t >= view.onset)
    return steps_gain(view, view.own.uniform(-1.0, 1.0), h)


@adds(SWING)
def partly_recovers(view: View) -> Floats:
    since, stays = view.t - view.onset, view.own.uniform(0.3, 0.8)
    back = np.exp(-np.maximum(since, 0.0) / log_uniform(view.own, 5.0, 60.0))
    return sign(view.own) * (since >= 0) * (stays + (1 - stays) * back)


def gain_recovers(view: View) -> tuple[Apply, float]:
    since, stays = view.t - view.onset, view.own.uniform(0.4, 0.8)
    back = np.exp(-np.maximum(since, 0.0) / log_uniform(view.own, 5.0, 60.0))
    h = -1.0 * (since >= 0) * (stays + (1 - stays) * back)
    return steps_gain(view, view.own.uniform(-0.3, 0.3), h)


@adds(SWING)
def slips_off(view: View) -> Floats:
    """The fibre's end slides for a moment and stays there."""
    return sign(view.own) * np.clip((view.t - view.onset) / view.own.uniform(0.1, 0.8), 0.0, 1.0)


# --- Crosstalk.


def charge_sharing(view: View) -> tuple[Apply, float]:
    """The sampling capacitor brings part of the channel read before."""
    before = view.every[:, view.channel - 1]
    return (lambda a: view.x + a * (before - view.x)), 0.25


def light_leak(view: View) -> tuple[Apply, float]:
    """Light of the guides on both sides, more of one of them."""
    n, d = view.every.shape[1], view.every - view.rests
    left, right = d[:, (view.channel - 1) % n], d[:, (view.channel + 1) % n]
    share = view.own.uniform(0.1, 0.9)
    return (lambda a: view.x + a * (share * left + (1 - share) * right)), 0.25


def supply_sag(view: View) -> tuple[Apply, float]:
    """What all others draw lowers the supply, which scales the reading."""
    load = np.delete(view.every - view.rests, view.channel, axis=1).sum(axis=1) / TOP
    return (lambda a: view.x * (1 - a * load)), 0.25


def shared_ground(view: View) -> tuple[Apply, float]:
    weights = view.common.uniform(0.2, 1.0, view.every.shape[1])
    weights[view.channel] = 0.0
    back = (view.every - view.rests) @ (weights / weights.max())
    return (lambda a: view.x + a * back), 0.25


def stray_field(view: View) -> tuple[Apply, float]:
    """Magnets in a row: 1/d^3, and the nearest have the other sign."""
    away = np.abs(np.arange(view.every.shape[1]) - view.channel).astype(float)
    away[view.channel] = np.inf
    field = (view.every - view.rests) @ (-((-1.0) ** (away == 2)) / away**3)
    return (lambda a: view.x + a * field), 0.25


def long_wire(view: View) -> tuple[Apply, float]:
    """From one other channel through the low pass of a wire."""
    n = view.every.shape[1]
    source = (view.channel + view.own.integers(1, n)) % n
    passed = pole(view.every[:, source] - view.rests[source], view.own.uniform(0.05, 0.5), STEP)
    return (lambda a: view.x + a * passed), 0.5


# --- Lag; the amount is the mean lag in seconds, gain 1.


def one_pole(view: View) -> tuple[Apply, float]:
    return (lambda a: pole(view.x, a, STEP)), 0.8


def two_poles(view: View) -> tuple[Apply, float]:
    part = view.common.uniform(0.15, 0.5)
    return (lambda a: pole(pole(view.x, part * a, STEP), (1 - part) * a, STEP)), 0.8


def moving_average(view: View) -> tuple[Apply, float]:
    return (lambda a: boxcar(view.x, 2 * a, STEP)), 0.8


def firmware_average(view: View) -> tuple[Apply, float]:
    """y += (x - y) / k at the rate of the readings: lags by (k - 1) samples."""
    x = view.x[::FINE]

    def apply(a: float) -> Floats:
        k = 1 + a / DT
        return to_fine(lfilter([1 / k], [1, 1 / k - 1], x, zi=[(1 - 1 / k) * x[0]])[0])

    return apply, 0.8


def sinc_three(view: View) -> tuple[Apply, float]:
    """Three boxcars, as in a sigma-delta converter."""

    def apply(a: float) -> Floats:
        y = view.x
        for _ in range(3):
            y = boxcar(y, 2 * a / 3, STEP)
        return y

    return apply, 0.8


def sallen_key(view: View) -> tuple[Apply, float]:
    """Two complex poles; lags by 2 zeta / omega."""
    zeta = view.common.uniform(0.5, 0.85)

    def apply(a: float) -> Floats:
        p = np.exp((-zeta + 1j * sqrt(1 - zeta**2)) * 2 * zeta / a * STEP)
        poly = [1.0, -2 * p.real, abs(p) ** 2]
        return view.x[0] + lfilter([sum(poly)], poly, view.x - view.x[0])

    return apply, 0.8


# --- Delay: when the readings were taken, in ``-a`` of these shapes after their stamps.


def sampled(every: Floats, at: Floats) -> Floats:
    place = np.clip(at / STEP, 0.0, len(every) - 1.001)
    k = place.astype(int)
    part = (place - k)[:, None]
    return every[k] * (1 - part) + every[k + 1] * part


def stamps(late: Callable[[View, Floats], Floats]) -> Equation:
    @wraps(late)
    def equation(view: View) -> tuple[Apply, float]:
        t = np.arange(SAMPLES) * DT
        shape = late(view, t)
        most = 0.7 / float(np.abs(shape).max())
        return (lambda a: sampled(view.every, t - a * shape)), most

    return equation


@stamps
def late(view: View, t: Floats) -> Floats:
    return np.ones_like(t)


@stamps
def early(view: View, t: Floats) -> Floats:
    """The log of the motion comes late."""
    return -np.ones_like(t)


@stamps
def skew(view: View, t: Floats) -> Floats:
    return sign(view.common) * (view.common.uniform(0.0, 0.3) + t / t[-1])


@stamps
def skew_and_resync(view: View, t: Floats) -> Floats:
    every = view.common.uniform(40.0, 150.0)
    return 0.3 + np.mod(t + view.common.uniform(0.0, every), every) / every


@stamps
def batches(view: View, t: Floats) -> Floats:
    """The radio sends readings in batches; the later in a batch, the fresher."""
    count = view.common.integers(3, 9)
    return 0.5 + (count - 1 - np.arange(len(t)) % count) / count


@stamps
def busy_host(view: View, t: Floats) -> Floats:
    rng = view.common
    load = pole(rng.normal(size=len(t)), log_uniform(rng, 1.0, 20.0), DT, 0.0)
    return np.maximum(1 + 0.4 * load / load.std(), 0.0)


# --- Saturation: static; the amount is the part of the codes in use that is cut.


def ends(view: View) -> tuple[float, float]:
    used = view.x[:FIRST]
    return float(used.min()), float(used.max())


def hard_top(view: View) -> tuple[Apply, float]:
    low, high = ends(view)
    return (lambda a: np.minimum(view.x, high - a * (high - low))), 0.5


def both_rails(view: View) -> tuple[Apply, float]:
    low, high = ends(view)
    part = view.own.uniform(0.25, 0.75)

    def apply(a: float) -> Floats:
        cut = a * (high - low)
        return np.clip(view.x, low + part * cut, high - (1 - part) * cut)

    return apply, 0.5


def knee_top(view: View) -> tuple[Apply, float]:
    """A smooth minimum, as an output stage near its rail."""
    low, high = ends(view)
    knee = view.own.uniform(0.01, 0.05) * (high - low)

    def apply(a: float) -> Floats:
        level = high - a * (high - low)
        return view.x - knee * np.logaddexp(0.0, (view.x - level) / knee)

    return apply, 0.5


def tanh_both(view: View) -> tuple[Apply, float]:
    """Slope 1 in the middle; the more amount, the nearer the ends."""
    low, high = ends(view)
    middle, half = (low + high) / 2, (high - low) / 2

    def apply(a: float) -> Floats:
        reach = half / (2.5 * a)
        return middle + reach * np.tanh((view.x - middle) / reach)

    return apply, 0.6


def full_well(view: View) -> tuple[Apply, float]:
    """Photodiode that fills: x / (1 + (x / level)^p)^(1/p) above its dark code."""
    low, high = ends(view)
    power = view.own.uniform(3.0, 8.0)

    def apply(a: float) -> Floats:
        x = np.maximum(view.x - low, 0.0)
        y = x / (1 + (x * a / (high - low)) ** power) ** (1 / power)
        return np.minimum(view.x, low) + y

    return apply, 2.0


# --- Interference, sampled at the readings.

TONE = 800.0


@adds(TONE)
def mains_alias(view: View) -> Floats:
    """50 or 60 Hz and some third harmonic, read 20 times a second."""
    f = view.common.choice([50.0, 60.0]) + view.common.uniform(0.2, 2.5) * sign(view.common)
    turn, phase = 2 * np.pi * f * view.t, view.own.uniform(0, 2 * np.pi)
    third = view.own.uniform(0, 0.3) * np.sin(3 * turn + view.own.uniform(0, 2 * np.pi))
    return np.sin(turn + phase) + third


@adds(TONE)
def lamp_flicker(view: View) -> Floats:
    """|sin| of the mains; the lamp only adds light."""
    f = view.common.choice([50.0, 60.0]) + view.common.uniform(0.1, 1.5)
    return np.abs(np.sin(2 * np.pi * f * view.t + view.common.uniform(0, np.pi))) - 2 / np.pi


@adds(TONE)
def pwm(view: View) -> Floats:
    """Motor drive: a square wave of any duty, folded."""
    f, duty = view.common.uniform(0.5, 9.0), view.common.uniform(0.2, 0.8)
    at = f * view.t + view.common.random()
    return sign(view.own) * ((np.mod(at, 1.0) < duty) - duty)


@adds(TONE)
def wandering_tone(view: View) -> Floats:
    rng = view.common
    off = pole(rng.normal(size=len(view.t)), rng.uniform(5, 40), DT, 0.0)
    f = rng.uniform(1.0, 8.0) * (1 + rng.uniform(0.01, 0.06) * off / off.std())
    return np.sin(2 * np.pi * np.cumsum(f) * DT + view.own.uniform(0, 2 * np.pi))


@adds(TONE)
def modulated_tone(view: View) -> Floats:
    """Two lamps beat."""
    rng = view.common
    f, beat, depth = rng.uniform(0.8, 9.0), log_uniform(rng, 0.02, 0.4), rng.uniform(0.4, 1.0)
    level = 1 + depth * np.sin(2 * np.pi * beat * view.t + rng.uniform(0, 6))
    return level * np.sin(2 * np.pi * f * view.t + view.own.uniform(0, 2 * np.pi))


@adds(TONE)
def tone_bursts(view: View) -> Floats:
    """A pump runs for some seconds."""
    rng = view.common
    turns = np.cumsum(rng.exponential(rng.uniform(5.0, 20.0), 1000))
    on = np.searchsorted(turns, view.t) % 2
    f, phase = rng.uniform(1.5, 9.0), view.own.uniform(0, 2 * np.pi)
    return pole(on.astype(float), 0.4, DT) * np.sin(2 * np.pi * f * view.t + phase)


# --- Spikes.

SPIKE = 3000.0


def events(rng: Random, chance: float) -> NDArray[np.bool_]:
    hit = rng.random(SAMPLES) < chance
    hit[rng.integers(100, FIRST, 8)] = True
    return hit


@adds(SPIKE)
def impulses(view: View) -> Floats:
    rng = view.own
    size = (0.4 + rng.gamma(2.0, 0.3, SAMPLES)) * rng.choice([-1, 1], SAMPLES)
    return events(rng, log_uniform(rng, 0.001, 0.01)) * size


@adds(SPIKE)
def discharges(view: View) -> Floats:
    """Of one sign, each decays."""
    rng, keep = view.own, exp(-DT / view.own.uniform(0.05, 0.3))
    hits = events(rng, log_uniform(rng, 0.001, 0.006)) * rng.uniform(0.3, 1.0, SAMPLES)
    return sign(rng) * lfilter([1.0], [1.0, -keep], hits)


@adds(SPIKE)
def clusters(view: View) -> Floats:
    """A loose plug: every hit brings some more within a second or two."""
    rng = view.own
    rate = lfilter([0, 1.0], [1.0, -0.94], events(rng, 0.001))
    hit = rng.random(SAMPLES) < 0.35 * np.minimum(rate, 1.0)
    return (hit + events(rng, 0.0)) * rng.uniform(0.3, 1.0, SAMPLES) * rng.choice([-1, 1], SAMPLES)


@adds(SPIKE)
def brush_sparks(view: View) -> Floats:
    """Sparks on all channels at once while the motor runs fast."""
    rng, v = view.common, speed(view)
    hit = (rng.random(SAMPLES) < 0.006 * np.minimum(v / v[:FIRST].mean(), 4)) | events(rng, 0.0)
    return sign(view.own) * hit * rng.uniform(0.3, 1.0, SAMPLES)


def flipped_bit(view: View) -> tuple[Apply, float]:
    """A bit of the bus is read wrong; the amount is how often."""
    bit, chance = 1 << view.common.integers(8, 11), view.own.random(SAMPLES)
    chance[view.own.integers(100, FIRST, 3)] = 0.0
    flip = bit * np.where(np.clip(view.x, 0, TOP).astype(int) & bit, -1.0, 1.0)
    return (lambda a: view.x + flip * (chance < a)), 0.02


@adds(SPIKE)
def doublets(view: View) -> Floats:
    """Through a coupling capacitor: up, then less of it down."""
    rng = view.own
    hits = events(rng, log_uniform(rng, 0.001, 0.006)) * rng.normal(0.0, 1.0, SAMPLES)
    return lfilter([1.0, -rng.uniform(0.3, 1.0)], [1.0], hits)


# --- Noise, on top of what the channel has.

LOUD = 3000.0


@adds(LOUD)
def louder(view: View) -> Floats:
    return view.own.normal(size=SAMPLES)


@adds(LOUD)
def shot(view: View) -> Floats:
    return np.sqrt(np.clip(view.x, 1.0, TOP) / TOP) * view.own.normal(size=SAMPLES)


@adds(LOUD)
def rattle(view: View) -> Floats:
    v = pole(speed(view), 0.2, DT)
    return (0.2 + v / v[:FIRST].mean()) * view.own.normal(size=SAMPLES)


@adds(LOUD)
def coloured(view: View) -> Floats:
    keep = view.own.uniform(0.4, 0.85) * (1.0 if view.own.random() < 0.7 else -1.0)
    return lfilter([1.0], [1.0, -keep], view.own.normal(size=SAMPLES))


@adds(LOUD)
def heavy_tailed(view: View) -> Floats:
    return np.clip(view.own.standard_t(view.own.uniform(2.5, 4.0), SAMPLES), -12, 12)


@adds(LOUD)
def noise_bursts(view: View) -> Floats:
    """The radio next to it is on for a while."""
    rng = view.own
    turns = np.cumsum(rng.exponential(rng.uniform(4.0, 20.0), 2000))
    on = np.searchsorted(turns, view.t) % 2
    return (rng.uniform(0.05, 0.3) + on) * rng.normal(size=SAMPLES)


# --- ADC: at most 2.5 % of the full range, of the code with its noise.

BOW = 0.025 * TOP


def bends(shape: Callable[[View], Callable[[Floats], Floats]]) -> Equation:
    """The amount is the largest error in codes; the error at rest is trimmed away."""

    @wraps(shape)
    def equation(view: View) -> tuple[Apply, float]:
        inl, zero = shape(view), np.array(view.rest / TOP)

        def error(u: Floats) -> Floats:
            return inl(u) - inl(zero)

        most = float(np.abs(error(np.linspace(0, 1, 4096))).max())

        def apply(a: float, x: Floats = view.x) -> Floats:
            return x + a / most * error(np.clip(x / TOP, 0.0, 1.0))

        return apply, BOW

    return equation


@bends
def bow(view: View) -> Callable[[Floats], Floats]:
    s, power = sign(view.own), view.own.uniform(0.8, 1.4)
    return lambda u: s * (4 * u * (1 - u)) ** power


@bends
def s_curve(view: View) -> Callable[[Floats], Floats]:
    s = sign(view.own)
    return lambda u: s * u * (1 - u) * (1 - 2 * u)


@bends
def wrong_table(view: View) -> Callable[[Floats], Floats]:
    """Linearised with another sensor's table of a few knots."""
    count = view.own.integers(6, 14)
    knots, errors = np.linspace(0, 1, count), view.own.normal(size=count)
    return lambda u: np.interp(u, knots, errors)


@bends
def sum_of_dnl(view: View) -> Callable[[Floats], Floats]:
    """Unequal code widths add up; the ends are trimmed."""
    codes = np.linspace(0, 1, 4096)
    inl = np.cumsum(view.own.normal(size=4096))
    inl -= inl[0] + (inl[-1] - inl[0]) * codes
    return lambda u: np.interp(u, codes, inl)


@bends
def residue_gain(view: View) -> Callable[[Floats], Floats]:
    """Pipelined: a sawtooth in each segment of the first stage."""
    count, s = view.own.choice([4, 8, 16]), sign(view.own)
    return lambda u: s * (np.mod(u * count, 1.0) - 0.5)


def missing_codes(view: View) -> tuple[Apply, float]:
    """Codes in groups: the amount is how many of a group come out as the same one."""

    def apply(a: float, x: Floats = view.x) -> Floats:
        group = 2 * a
        return np.floor(x / group) * group + a

    return apply, BOW


# --- Foreign mechanisms in codes.


def tumbling_magnet(view: View) -> tuple[Apply, float]:
    """The magnet turns in its pocket as the finger moves, and seldom tips."""
    rng = view.own
    moved = np.abs(np.diff(view.strain[::FINE], prepend=view.strain[0]))
    kicks = rng.normal(size=SAMPLES) * np.sqrt(moved)
    kicks += rng.normal(0, 1.5, SAMPLES) * (rng.random(SAMPLES) < 0.03 * moved)
    path, out, turn = np.exp(-moved / rng.uniform(2.0, 10.0)).tolist(), [], 0.0
    for keep, kick in zip(path, kicks.tolist(), strict=True):
        turn = turn * keep + kick
        out.append(turn)
    angle, tilt = to_fine(out), rng.uniform(0.1, 0.6)
    field, most = view.x - view.rest - 1.2 * view.span, 1.0 / max(np.abs(out))
    return (lambda a: view.x + field * (np.cos(tilt + a * angle) / np.cos(tilt) - 1)), most


@adds(SWING)
def passing_shadows(view: View) -> Floats:
    """Ambient light gets in, less of it when somebody stands in it."""
    rng = view.common
    turns = np.cumsum(rng.exponential(rng.uniform(3.0, 20.0), 2000))
    which = np.searchsorted(turns, view.t)
    level = np.where(which % 2, rng.uniform(0.4, 1.0, 2001)[which], 0.0)
    return pole(pole(level, rng.uniform(0.1, 0.6), STEP), 0.1, STEP)


def opening_connector(view: View) -> tuple[Apply, float]:
    """While strained, a contact opens at random, and the input goes towards a rail."""
    rng, s = view.own, np.clip(view.strain[::FINE] / RANGE, 0, 1)
    chance = s**2 / (s[:FIRST] ** 2).mean() * DT / rng.uniform(5.0, 25.0)
    start = np.flatnonzero(rng.random(SAMPLES) < chance)
    start = np.append(start, int(s[:FIRST].argmax()))
    is_open = np.zeros(SAMPLES)
    for at, held in zip(start, rng.exponential(0.6, len(start)) + 0.1, strict=True):
        is_open[at : at + int(held / DT) + 1] = 1.0
    is_open *= s > 0.2
    mask, rail = np.repeat(is_open, FINE), rng.choice([0.0, TOP])
    return (lambda a: view.x + a * mask * (rail - view.x)), 1.0


@adds(SWING)
def auto_exposure(view: View) -> Floats:
    """Exposure switches late and with hysteresis; what corrects it is not quite right."""
    rng = view.own
    low, high = np.quantile(view.x[:FIRST], [rng.uniform(0.2, 0.4), rng.uniform(0.6, 0.8)])
    wait, level, count, out = rng.integers(1, 12), 0, 0, []
    for u in view.x.tolist():
        wants = 1 if u > high else 0 if u < low else level
        count = count + 1 if wants != level else 0
        if count > wait:
            level, count = wants, 0
        out.append(level)
    error = rng.normal(size=2) * np.array([0.2, 1.0]) + np.array([0.0, sign(rng)])
    return error[np.array(out)] * view.x / TOP


# --- All of them, in physical order.


def named(*equations: Equation) -> dict[str, Equation]:
    return {equation.__name__: equation for equation in equations}


MOTION = {
    "backlash": named(hard_play, sprung_play, one_flank, rounded_play, worn_gear, creeping_play),
    "contact_load": named(contact_load),
    "second_freedom": named(second_freedom),
}
MATERIAL = {
    "hysteresis": named(preisach, dahl, bouc_wen, coleman_hodgdon, jiles_atherton, capstan),
    "relaxation": named(prony, springpot, creep_by_decades, burgers, schapery, orifice),
    "softening": named(
        ogden_roxburgh, simo_damage, set_and_slack, cracked_cladding, chain_scission
    ),
}
ANALOG = {
    "overshoot": named(
        rate_loss, bounded_rate_loss, rise_and_decay, recombination, peak_and_decay, rectified_lag
    ),
    "tumbling_magnet": named(tumbling_magnet),
    "shadows": named(passing_shadows),
    "drift": named(
        led_warm_up, root_of_time, room_temperature, heating_comes_on, ageing_by_decades, weather
    ),
    "random_walk": named(
        wiener, ornstein_uhlenbeck, octaves, smooth_wander, red_spectrum, mode_hops
    ),
    "gain": named(
        wrong_scale, wrong_reference, led_ageing, bleaching, magnet_ageing, warm_hall_plate
    ),
    "step": named(shifted, lost_strand, knocked, partly_recovers, gain_recovers, slips_off),
    "connector": named(opening_connector),
    "crosstalk": named(
        charge_sharing, light_leak, supply_sag, shared_ground, stray_field, long_wire
    ),
    "lag": named(one_pole, two_poles, moving_average, firmware_average, sinc_three, sallen_key),
}
SAMPLER = {"delay": named(late, early, skew, skew_and_resync, batches, busy_host)}
READ = {
    "saturation": named(hard_top, both_rails, knee_top, tanh_both, full_well),
    "auto_exposure": named(auto_exposure),
    "interference": named(
        mains_alias, lamp_flicker, pwm, wandering_tone, modulated_tone, tone_bursts
    ),
    "spikes": named(impulses, discharges, clusters, brush_sparks, flipped_bit, doublets),
    "noise": named(louder, shot, rattle, coloured, heavy_tailed, noise_bursts),
}
ADC = {
    "adc_nonlinearity": named(bow, s_curve, wrong_table, sum_of_dnl, residue_gain, missing_codes)
}
EQUATIONS: dict[str, dict[str, Equation]] = MOTION | MATERIAL | ANALOG | SAMPLER | READ | ADC
FOREIGN: tuple[str, ...] = (
    "contact_load",
    "second_freedom",
    "tumbling_magnet",
    "shadows",
    "connector",
    "auto_exposure",
)
WIDE = ("backlash", "delay", "contact_load", "second_freedom")
LEAST = {"lag": 0.005 / 0.8}  # of the most


# --- Motion that is logged.


def path(moves: list[tuple[float, float, bool]], count: int) -> Floats:
    """Moves of (seconds, target, whether smooth) from 0, on the fine clock."""
    pieces, at, have = [], 0.0, 0
    for seconds, target, smooth in moves:
        u = np.arange(1, max(int(seconds / STEP), 1) + 1) / max(int(seconds / STEP), 1)
        u = u**3 * (10 - 15 * u + 6 * u**2) if smooth else u
        pieces.append(at + (target - at) * u)
        at, have = target, have + len(u)
        if have >= count:
            break
    return np.concatenate([np.zeros(1), *pieces])[:count]


def rich(rng: Random, seconds: float) -> list[tuple[float, float, bool]]:
    moves: list[tuple[float, float, bool]] = []
    for peak in np.linspace(rng.uniform(0.04, 0.1), RANGE, rng.integers(5, 9)):
        slow = log_uniform(rng, 1.0, 6.0)
        moves += [(slow, peak, False), (slow, 0.0, False)]
    while sum(move[0] for move in moves) < seconds:
        kind = rng.integers(4)
        if kind == 0:
            for _ in range(rng.integers(3, 6)):
                level = rng.uniform(0.0, RANGE)
                moves += [(rng.uniform(0.1, 0.6), level, True), (rng.uniform(3, 14), level, False)]
        elif kind == 1:
            moves += [(rng.uniform(0.3, 2.0), 0.0, True), (rng.uniform(6, 22), 0.0, False)]
        elif kind == 2:
            for _ in range(rng.integers(8, 24)):
                slow, target = log_uniform(rng, 0.25, 6.0), rng.uniform(0.0, RANGE)
                moves.append((slow, target, bool(rng.integers(2))))
        else:
            slow, peak = log_uniform(rng, 0.5, 8.0), rng.uniform(0.15, RANGE)
            moves += [(slow, peak, False), (slow, rng.uniform(0, 0.1), False)] * 3
    return moves


def typical(rng: Random, seconds: float) -> list[tuple[float, float, bool]]:
    moves: list[tuple[float, float, bool]] = []
    while sum(move[0] for move in moves) < seconds:
        kind = rng.choice(4, p=[0.5, 0.2, 0.15, 0.15])
        if kind == 0:  # grasp, hold with small corrections, let go
            level = rng.uniform(0.12, 0.38)
            moves.append((rng.uniform(0.5, 2.0), level, True))
            for _ in range(rng.integers(2, 6)):
                level = min(max(level + rng.normal(0, 0.008), 0.0), RANGE)
                moves.append((rng.uniform(0.4, 1.8), level, True))
            moves.append((rng.uniform(0.4, 1.5), rng.uniform(0.0, 0.03), True))
        elif kind == 1:  # reach
            for _ in range(rng.integers(2, 5)):
                moves.append((rng.uniform(0.5, 2.5), rng.uniform(0.03, 0.3), True))
        elif kind == 2:
            level = rng.uniform(0.0, 0.03)
            moves += [(1.0, level, True), (rng.uniform(2, 15), level, True)]
        else:  # quasi-random
            centre = rng.uniform(0.1, 0.3)
            for _ in range(rng.integers(10, 30)):
                target = min(max(centre + rng.normal(0, 0.07), 0.0), RANGE)
                moves.append((rng.uniform(0.3, 1.5), target, True))
    return moves


def motion(rng: Random, samples: int, excitation: str) -> Floats:
    count, seconds = samples * FINE, samples * DT + 10.0
    if excitation == "rich":
        return path(rich(rng, seconds), count)
    if excitation == "typical":
        return path(typical(rng, seconds), count)
    at = np.arange(count) * STEP / log_uniform(rng, 4.0, 20.0)
    high = rng.uniform(0.2, RANGE)
    if rng.random() < 0.5:
        return high * (1 - np.abs(1 - 2 * np.mod(at, 1.0)))
    return high * (1 - np.cos(2 * np.pi * at)) / 2


# --- Sensors.


@dataclass(frozen=True)
class Sensor:
    rest: float
    span: float
    curve: Callable[[Floats], Floats]

    def codes(self, strain: Floats) -> Floats:
        return self.rest + self.span * self.curve(strain) / self.curve(np.array(RANGE))


def sensor(rng: Random) -> Sensor:
    curve: Callable[[Floats], Floats]
    kind, a = rng.integers(5), rng.random()
    if kind == 0:  # light through a stretched waveguide
        curve, way = (lambda e: 1 - np.exp(-(1.5 + 4.5 * a) * e)), -1.0
    elif kind == 1:  # magnet that goes away
        curve, way = (lambda e: 1 - (1 + np.maximum(e, -0.3) / (0.5 + a)) ** -3), sign(rng)
    elif kind == 2:  # sealed air
        curve, way = (lambda e: e / (1 - 0.6 * a * np.minimum(e, 0.8))), 1.0
    elif kind == 3:  # macrobends
        middle, width = 0.12 + 0.13 * a, rng.uniform(0.1, 0.2)
        curve, way = (lambda e: np.tanh((e - middle) / width) + np.tanh(middle / width)), -1.0
    else:  # dyed guide, of which the logarithm is read
        curve, way = (lambda e: e * (1 + (0.8 * a - 0.3) * e)), sign(rng)
    span = rng.uniform(0.2, 0.8) * TOP
    low = rng.uniform(400.0, 3700.0 - span)
    return Sensor(low if way > 0 else low + span, way * span, curve)


# --- A case.


def fit(size: Callable[[float], float], target: float, most: float, least: float) -> float:
    """The amount whose size is the target, or the nearest that is allowed."""

    def off(log_amount: float) -> float:
        return log(max(size(exp(log_amount)), 1e-12) / target)

    low, high = log(most * least), log(most)
    if off(high) <= 0.0:
        return most
    if off(low) >= 0.0:
        return most * least
    return exp(brentq(off, low, high, xtol=0.005))


def rms(x: Floats) -> Floats:
    return np.sqrt(np.mean(x**2, axis=0))


def make(
    seed: int,
    names: tuple[str, ...],
    excitation: str,
    equation: dict[str, str] | None = None,
) -> Case:
    """The case of a seed; ``equation`` forces the equation of a name."""
    moving, building = (np.random.default_rng([NUMBER, seed, key]) for key in (1, 2))
    first = motion(moving, FIRST, excitation)
    home = np.clip(np.arange(1, BETWEEN * FINE + 1) * STEP / 1.5, 0.0, 1.0)
    home = first[-1] * (1 - home**2 * (3 - 2 * home))
    logged = np.concatenate([first, home, motion(moving, SECOND, excitation)])

    count = int(building.integers(3, 8))
    sensors = [sensor(building) for _ in range(count)]
    spans, rests = np.array([[s.span, s.rest] for s in sensors]).T
    fullness = np.exp(building.uniform(log(120), log(600), count))  # span in rms of noise
    noise = np.clip(np.abs(spans) / fullness, 2.0, 10.0)
    sim_noise = noise * building.uniform(0.75, 1.25, count)
    onset = FIRST * DT * np.random.default_rng([NUMBER, seed, 3]).uniform(0.2, 0.8)

    def transduced(strains: Floats) -> Floats:
        return np.stack([s.codes(strains[:, c]) for c, s in enumerate(sensors)], axis=1)

    fine_t, read_t = np.arange(len(logged)) * STEP, np.arange(SAMPLES) * DT
    nominal = transduced(np.repeat(logged[::FINE, None], count, axis=1))
    fine = np.repeat(logged[:, None], count, axis=1)
    strain = fine
    truth: dict[str, tuple[int, ...]] = {}

    def act(
        stage: dict[str, dict[str, Equation]], every: Floats, noisy: Floats | None = None
    ) -> Floats:
        """``every`` after the effects of a stage (for ADCs, ``noisy`` too, in place)."""
        is_fine = len(every) == len(logged)
        recorded = slice(0, FIRST * FINE, FINE) if is_fine else slice(0, FIRST)
        as_codes = transduced if stage in (MOTION, MATERIAL) else np.asarray
        for name in stage:
            if name not in names:
                continue
            key = 10 + list(EQUATIONS).index(name)
            rng = np.random.default_rng([NUMBER, seed, key])
            options = list(stage[name])
            chosen = options[rng.integers(len(options))]
            chosen = (equation or {}).get(name, chosen)
            some = np.sort(rng.permutation(count)[: rng.integers(1, count)])
            channels = range(count) if rng.random() < 0.65 or name in WIDE else some.tolist()
            truth[name] = tuple(channels)
            targets = np.exp(rng.uniform(log(3.1), log(29.0), count))
            least = LEAST.get(name, 1e-3)

            def view(
                channel: int, now: Floats = every, fine_clock: bool = is_fine, key: int = key
            ) -> View:
                return View(
                    fine_t if fine_clock else read_t,
                    STEP if fine_clock else DT,
                    now[:, channel],
                    strain[:: 1 if fine_clock else FINE, channel],
                    now,
                    rests,
                    rests[channel],
                    spans[channel],
                    channel,
                    onset,
                    np.random.default_rng([NUMBER, seed, key, 99]),
                    np.random.default_rng([NUMBER, seed, key, 1 + channel]),
                )

            before = as_codes(every[recorded])
            after = every.copy()
            if name in WIDE:
                apply, most = stage[name][chosen](view(0))

                def whole(a: float, apply: Apply = apply) -> Floats:
                    y = apply(a)
                    return y if y.ndim == 2 else np.repeat(y[:, None], count, axis=1)

                def ratios(a: float, before: Floats = before, whole=whole) -> Floats:
                    y = whole(a)
                    read = y[:FIRST] if len(y) == SAMPLES else as_codes(y[recorded])
                    return rms(read - before) / noise

                # The least affected channel has 3, and the most affected no more than 30.
                probe = ratios(most / 3)
                room = max(log(9.3 / (probe.max() / probe.min())), 0.0)
                target = 3.1 * exp(room * rng.random())
                after = whole(fit(lambda a: ratios(a).min(), target, most, least))
            else:
                for c in channels:
                    apply, most = stage[name][chosen](view(c))

                    def size(a: float, c: int = c, apply: Apply = apply, old=before) -> float:
                        y = apply(a)[recorded]
                        y = sensors[c].codes(y) if stage is MATERIAL else y
                        return float(rms(y - old[:, c])) / noise[c]

                    amount = fit(size, targets[c], most, least)
                    after[:, c] = apply(amount)
                    if noisy is not None:
                        noisy[:, c] = apply(amount, noisy[:, c])
            every = after
        return every

    strain = act(MOTION, fine)
    codes = act(ANALOG, transduced(act(MATERIAL, strain)))
    codes = act(SAMPLER, codes) if "delay" in names else codes[::FINE]
    codes = act(READ, codes)
    hiss, sim_hiss = (
        np.random.default_rng([NUMBER, seed, key]).normal(size=(SAMPLES, count)) for key in (4, 5)
    )
    real = codes + noise * hiss
    codes = act(ADC, codes, real)
    sim = nominal + sim_noise * sim_hiss

    one, two, read = slice(0, FIRST), slice(FIRST + BETWEEN, SAMPLES), logged[::FINE]
    return Case(
        sim=converted("sim1", sim[one], read[one]),
        real=converted("real1", real[one], read[one]),
        sim2=converted("sim2", sim[two], read[two]),
        real2=converted("real2", real[two], read[two]),
        change=codes[one] - nominal[one],
        floors=np.sqrt(sim_noise**2 + noise**2 + 1 / 6),
        truth=truth,
        excitation=excitation,
        onset_s=onset if "step" in names else None,
        unseen=True,
    )
