"""Cases of a gap between simulated and real soft strain sensors, by equations of other origin.

A diagnosis that is tested on the equations it was written with is tested on nothing. Each effect
has three families of equations here, taken from the literature on materials, machines and
converters, and none of them is the play operator, the Prony ladder, the single pole or the
logarithmic drift of a usual catalogue.

The nominal sensor is a conductive elastomer in a voltage divider: the logarithm of its resistance
depends on strain and on the stress of one Maxwell element with a time constant of its own
(Thuruthel et al. 2021, doi 10.1109/LRA.2021.3061399, Fig. 4). Its static parameters are right; only
the hidden effects and the noise separate the real recording from the simulated one. The transition
between the two recordings is not recorded: the rig goes back to rest and waits for some seconds.
The nominal stress has died away by then, whereas the memory of the hidden effects goes on.

Motion effects change the strain that reaches the sensors, material effects add to the logarithm
of resistance, electrical effects act on the voltage, in this order. Strain is 1, time is s,
voltages are in codes, arrays are (samples, channels).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from cases import Case
from scipy.signal import fftconvolve, lfilter
from scipy.special import erf, expit, logit

from softsense.recording import FrontEnd, Recording

Floats: TypeAlias = npt.NDArray[np.float64]

RATE_HZ = 20.0
SAMPLES = 8000
SAMPLES_2 = 4000
BITS = 12
TOP = 2**BITS - 1
X_MAX = 0.4
FAMILIES = 3

NAMES: tuple[str, ...] = (
    "hysteresis",
    "relaxation",
    "softening",
    "overshoot",
    "drift",
    "random_walk",
    "gain",
    "step",
    "backlash",
    "delay",
    "lag",
    "saturation",
    "adc_nonlinearity",
    "crosstalk",
    "interference",
    "spikes",
    "noise",
)
FOREIGN: tuple[str, ...] = (
    "intermittent_contact",
    "unlogged_load",
    "unlogged_twist",
    "clamp_slip",
    "resonance",
    "crystallisation",
    "stale_samples",
)
RETUNED: tuple[str, ...] = ("relaxation", "hysteresis")
EXCITATIONS: tuple[str, ...] = ("rich", "typical", "poor")

_DT = 1.0 / RATE_HZ
# Effects of the stage or of the scan act on every channel.
_ON_ALL = ("backlash", "delay", "clamp_slip", "resonance")
# Sizes as rms of the change over the noise, where they differ from 3 to 30: total noise over
# nominal noise; converters that bend by more than this would be sent back to the shop; a retuned
# parameter within its plausible range moves the codes by no more than this.
_SIZE = {"noise": (1.6, 4.0), "adc_nonlinearity": (3.0, 15.0)}
_SIZE_RETUNED = (3.0, 12.0)


@dataclass(frozen=True)
class _Sensors:
    """Parameters of the nominal sensors, (channels,) each.

    ``zero``: log of resistance over reference resistor at rest, ``gain``: its rise to X_MAX,
    ``bend``, ``toe``, ``knee``, ``fade``: shape of the rise, ``tau_s``, ``stress``, ``weak``: time
    constant, weight and weakness at small strain of the stress, ``width``, ``loop``: strain and
    weight of the sensor's own hysteresis, ``noise``: codes.
    """

    zero: Floats
    gain: Floats
    bend: Floats
    toe: Floats
    knee: Floats
    fade: Floats
    tau_s: Floats
    stress: Floats
    weak: Floats
    width: Floats
    loop: Floats
    noise: Floats


@dataclass(frozen=True)
class _Path:
    """Strain over both recordings and the transition, and the static response 0 ... 1 to it."""

    t_s: Floats
    x: Floats
    s: Floats
    first: slice
    second: slice


@dataclass(frozen=True)
class _Draw:
    """Uniform numbers of an effect, mapped to its parameters, and the seed of its randomness."""

    u: Floats
    seed: int
    family: int

    def lin(self, i: int, low: float, high: float) -> float:
        return low + (high - low) * float(self.u[i])

    def log(self, i: int, low: float, high: float) -> float:
        return low * math.exp(math.log(high / low) * float(self.u[i]))

    def rng(self, channel: int = 0) -> np.random.Generator:
        return np.random.default_rng([self.seed, channel])

    def near(self, channel: int) -> "_Draw":
        """The draw for one channel: sensors of one kind resemble each other, no more.

        The last number, when something happens, is the same for all.
        """
        u = self.u + 0.08 * np.random.default_rng([self.seed, 7, channel]).normal(size=len(self.u))
        u[-1] = self.u[-1]
        return replace(self, u=np.clip(u, 0.0, 1.0))


# A motion effect turns strain into strain, given a size; a material effect gives the shape of what
# it adds for one channel; an electrical effect turns codes into codes, given a size per channel.
_Motion: TypeAlias = Callable[[_Path, _Draw, float], Floats]
_Material: TypeAlias = Callable[[_Path, int, _Draw], Floats]
_Electrical: TypeAlias = Callable[[_Path, Floats, _Draw, Floats], Floats]


# ---------------------------------------------------------------------------------- excitation


def _move(start: float, end: float, seconds: float, smooth: bool) -> Floats:
    n = max(1, round(seconds * RATE_HZ))
    phase = np.arange(1, n + 1) / n
    if smooth:
        phase = 0.5 - 0.5 * np.cos(np.pi * phase)
    return start + (end - start) * phase


def _moves(n: int, start: float, rng: np.random.Generator) -> Floats:
    """Ramps and half cosines to random strains at random speeds, with holds in between."""
    parts: list[Floats] = []
    length, x = 0, start
    while length < n:
        if rng.random() < 0.18:
            part = _move(x, x, rng.uniform(1.0, 12.0), False)
        else:
            end = X_MAX * rng.uniform(0.02, 0.99)
            speed = math.exp(rng.uniform(math.log(0.015), math.log(0.3)))
            part = _move(x, end, max(abs(end - x) / speed, 0.3), rng.random() < 0.5)
            x = end
        parts.append(part)
        length += len(part)
    return np.concatenate(parts)[:n]


def _wandering_sine(n: int, rng: np.random.Generator) -> Floats:
    """Smooth straining whose frequency, amplitude and centre wander."""
    knots = np.linspace(0, n, 2 + n // 400)

    def wander(low: float, high: float) -> Floats:
        return np.interp(np.arange(n), knots, rng.uniform(low, high, len(knots)))

    frequency = np.exp(wander(math.log(0.02), math.log(0.35)))
    phase = 2 * np.pi * np.cumsum(frequency) * _DT
    half = X_MAX * wander(0.08, 0.48)
    centre = half + wander(0.02, 1.0) * (0.98 * X_MAX - 2 * half)
    return np.minimum(np.arange(n) / 40.0, 1.0) * (centre - half * np.cos(phase))


def _triangles(amplitudes: Floats, period_s: Floats, dwell_s: float) -> Floats:
    """Triangles with the short stop at both ends that a stage with finite acceleration makes."""
    parts: list[Floats] = []
    for a, p in zip(amplitudes, period_s, strict=True):
        parts += [_move(0.0, a, p / 2, False), _move(a, a, dwell_s, False)]
        parts += [_move(a, 0.0, p / 2, False), _move(0.0, 0.0, dwell_s, False)]
    return np.concatenate(parts)


def _rich(n: int, rng: np.random.Generator) -> Floats:
    """Ascending triangles, a staircase of holds, a sweep at two amplitudes, then random moves."""
    amplitudes = np.repeat(X_MAX * np.array([0.24, 0.48, 0.73, 0.98]), 2)
    parts = [_triangles(amplitudes, 2 * amplitudes / rng.uniform(0.04, 0.09), 0.3)]
    x = 0.0
    for level in X_MAX * np.array([0.35, 0.7, 0.97, 0.6, 0.25, 0.5]):
        parts += [_move(x, level, rng.uniform(0.4, 1.0), True), _move(level, level, 11.0, False)]
        x = float(level)
    for half in (0.05, 0.12):
        t = _times(round(25 * RATE_HZ))
        sweep = 2 * np.pi * 0.05 * (25 / math.log(30)) * (np.exp(t / 25 * math.log(30)) - 1)
        parts += [_move(x, 0.2 - half, 2.0, True), 0.2 - half * np.cos(sweep)]
        x = float(parts[-1][-1])
    start = np.concatenate(parts)
    return np.concatenate((start, _moves(max(n - len(start), 1), x, rng)))[:n]


def _strain(excitation: str, n: int, second: bool, rng: np.random.Generator) -> Floats:
    if excitation == "poor":
        amplitude, period = X_MAX * rng.uniform(0.7, 0.99), rng.uniform(8.0, 30.0)
        count = 1 + math.ceil(n * _DT / period)
        dwell = rng.uniform(0.2, 1.5)
        return _triangles(np.full(count, amplitude), np.full(count, period), dwell)[:n]
    if excitation == "rich" and not second:
        return _rich(n, rng)
    if rng.random() < 0.25:
        return _wandering_sine(n, rng)
    return np.concatenate(([0.0], _moves(n - 1, 0.0, rng)))


# ------------------------------------------------------------------------------ nominal sensors


def _sensors(count: int, rng: np.random.Generator) -> _Sensors:
    def log(low: float, high: float) -> Floats:
        return np.exp(rng.uniform(math.log(low), math.log(high), count))

    base, span = rng.uniform(1310.0, 2250.0, count), log(350.0, 950.0)
    zero = logit(base / TOP)
    return _Sensors(
        zero=zero,
        gain=logit((base + span) / TOP) - zero,
        bend=rng.uniform(0.0, 0.8, count),
        toe=rng.uniform(0.0, 0.35, count),
        knee=rng.uniform(0.1, 0.3, count),
        fade=rng.uniform(0.0, 0.3, count),
        tau_s=log(0.3, 7.5),
        stress=log(0.04, 0.4),
        weak=rng.uniform(0.0, 0.6, count),
        width=rng.uniform(0.015, 0.05, count),
        loop=np.zeros(count),
        noise=rng.uniform(0.65, 2.2, count),
    )


def _faded(sensors: _Sensors, rise: Floats) -> Floats:
    """The network has fewer paths left to lose at large strain."""
    return rise * (1 + sensors.fade) / (1 + sensors.fade * rise**2)


def _stretched(sensors: _Sensors, x: Floats) -> Floats:
    """Rise with strain alone, 0 at rest and 1 at X_MAX."""
    u = x[:, None] / X_MAX

    def rise(u: Floats) -> Floats:
        bent: Floats = (1 - sensors.bend) * u + sensors.bend * u * np.abs(u)
        return bent * (1 - sensors.toe * np.exp(-np.maximum(u, 0) / sensors.knee))

    return rise(u) / rise(np.ones((1, 1)))


def _static(sensors: _Sensors, x: Floats) -> Floats:
    """Rise of the log of resistance without stress, 0 at rest and 1 at X_MAX."""
    return _faded(sensors, _stretched(sensors, x))


def _dahl(x: Floats, width: float) -> Floats:
    """Dahl's friction state, -1 ... 1, exact for strain that is linear between samples."""
    out, z = [0.0], 0.0
    for dx in np.diff(x).tolist():
        sign = 1.0 if dx > 0 else -1.0
        z = sign + (z - sign) * math.exp(-abs(dx) / width)
        out.append(z)
    return np.array(out)


def _nominal(sensors: _Sensors, path: _Path) -> Floats:
    """Log of resistance over reference resistor, (samples, channels)."""
    fade = np.ones(len(path.x))
    gap = slice(path.first.stop, path.second.start)
    fade[gap] = 0.5 + 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, gap.stop - gap.start))
    u = np.maximum(path.x, 0.0) / X_MAX
    rise = _stretched(sensors, path.x)
    for c in range(len(sensors.zero)):
        keep = math.exp(-_DT / sensors.tau_s[c])
        q = np.empty(len(path.x))
        for part in (slice(0, path.second.start), path.second):
            dx = np.diff(path.x[part], prepend=path.x[part.start]) / X_MAX
            q[part] = lfilter([keep], [1.0, -keep], dx)
        q *= fade
        weight = sensors.stress[c] * (1 - sensors.weak[c] * np.exp(-u / 0.18))
        rise[:, c] += weight * q * (1 + 0.12 * q * (1 - u))
        if sensors.loop[c]:
            loop = _less_static(path, _dahl(path.x, sensors.width[c]))
            rise[:, c] += sensors.loop[c] * loop * fade
    out: Floats = sensors.zero + sensors.gain * _faded(sensors, rise)
    return out


def _codes(log_ratio: Floats) -> Floats:
    """Voltage of the divider in codes."""
    out: Floats = TOP * expit(log_ratio)
    return out


# ------------------------------------------------------------------------------------- helpers


def _less_static(path: _Path, shape: Floats) -> Floats:
    """Without its mean curve over strain, which the calibration of the simulator took in."""
    powers = np.vander(path.x / X_MAX, 4)
    weights = np.linalg.lstsq(powers[path.first], shape[path.first], rcond=None)[0]
    out: Floats = shape - powers @ weights
    return out


def _less_mean(path: _Path, shape: Floats) -> Floats:
    """The same where the motion hardly ever rests, so that calibration saw little but the mean."""
    first = shape[path.first]
    mostly_mean = float(first.mean()) ** 2 > 0.75 * float((first**2).mean())
    return _less_static(path, shape) if mostly_mean else shape


def _pole(v: Floats, tau_s: float) -> Floats:
    """One pole with gain 1 for a signal that is linear between samples, from rest."""
    r = _DT / max(tau_s, 1e-6)
    keep = math.exp(-r)
    b1 = 1 - (1 - keep) / r
    out: Floats = lfilter([b1, 1 - keep - b1], [1.0, -keep], v - v[0], axis=0) + v[0]
    return out


def _memory(rate: Floats, kernel: Floats) -> Floats:
    out: Floats = fftconvolve(rate, kernel)[: len(rate)]
    return out


def _times(n: int) -> Floats:
    out: Floats = np.arange(n, dtype=np.float64) * _DT
    return out


def _speed(path: _Path) -> Floats:
    """Strain rate in 1/s, backward: the material does not know what comes."""
    return np.diff(path.x, prepend=path.x[0]) * RATE_HZ


def _events(n: int, rate_hz: float, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Samples at which a Poisson process fires, at least three in the first recording."""
    count = max(3, rng.poisson(rate_hz * SAMPLES * _DT))
    later = rng.poisson(rate_hz * (n - SAMPLES) * _DT)
    return np.sort(
        np.concatenate((rng.integers(20, SAMPLES, count), rng.integers(SAMPLES, n, later)))
    )


def _band(n: int, low_hz: float, high_hz: float, rng: np.random.Generator) -> Floats:
    """Gaussian noise in a band with soft edges, rms 1."""
    f = np.fft.rfftfreq(n, _DT)[1:]
    keep = np.concatenate(([0.0], 1 / np.sqrt((1 + (low_hz / f) ** 6) * (1 + (f / high_hz) ** 6))))
    out: Floats = np.fft.irfft(np.fft.rfft(rng.normal(size=n)) * keep, n)
    return out / float(out.std())


# ---------------------------------------------------------------------------- material: loops


def _preisach(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Relays over the Preisach plane with a Gaussian density of widths (Mayergoyz 1986)."""
    width, centre = draw.log(0, 0.03, 0.12), draw.lin(1, 0.12, 0.28)
    n = len(path.x)
    index = np.arange(n)
    out = np.zeros(n)
    levels = np.linspace(0.01, 0.39, 20)
    for up in levels:
        above = np.maximum.accumulate(np.where(path.x >= up, index, -1))
        for down in levels[levels < up]:
            density = math.exp(
                -(((up - down) / width) ** 2) - (((up + down) / 2 - centre) / 0.15) ** 2
            )
            if density < 0.02:
                continue
            below = np.maximum.accumulate(np.where(path.x <= down, index, 0))
            out += density * np.where(above > below, 1.0, -1.0)
    return _less_static(path, out)


def _pinched(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Bouc-Wen with slip-lock pinching (Baber and Noori 1986)."""
    width, power = draw.log(0, 0.015, 0.07), draw.lin(1, 0.8, 2.0)
    beta, pinch, narrow = draw.lin(2, 0.5, 0.9), draw.lin(3, 0.1, 0.5), draw.lin(4, 0.2, 0.5)
    out, z = [0.0], 0.0
    for dx in np.diff(path.x).tolist():
        steps = 1 + int(abs(dx) / (0.12 * width))
        d = dx / width / steps
        for _ in range(steps if d else 0):
            turn = beta * math.copysign(1.0, d * z) + 1 - beta
            slip = 1 - pinch * math.exp(-((z / narrow) ** 2))
            z += d * slip * (1 - abs(z) ** power * turn)
            z = min(max(z, -1.0), 1.0)
        out.append(z)
    return _less_static(path, np.array(out))


def _duhem(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Duhem operator of Coleman and Hodgdon (1987): dz = |dx| (f(x) - z) / width + g(x) dx."""
    width, bend = draw.log(0, 0.03, 0.15), draw.lin(1, 0.5, 3.0)
    u = path.x / X_MAX
    target = np.tanh(bend * (u - 0.5)) + 0.3 * u**2
    slope = draw.lin(2, 0.0, 0.4) * (1 + u)
    out, z = [target[0]], float(target[0])
    steps = zip(np.diff(path.x).tolist(), target.tolist(), slope.tolist(), strict=False)
    for dx, f, g in steps:
        z = f + (z - f) * math.exp(-abs(dx) / width) + g * dx / X_MAX
        out.append(z)
    return _less_static(path, np.array(out))


# ------------------------------------------------------------------- material: slow and fast time


def _spring_pot(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Fractional element: a step is followed by t^-a, by L1 weights (Koeller 1984)."""
    order = draw.lin(0, 0.15, 0.55)
    k = np.arange(len(path.x) + 1.0) ** (1 - order)
    return _less_static(path, _memory(np.diff(path.s[:, channel], prepend=0.0), np.diff(k)))


def _kohlrausch(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Stretched exponential relaxation after a step (Kohlrausch, Williams, Watts)."""
    tau, power = draw.log(0, 1.5, 30.0), draw.lin(1, 0.4, 0.8)
    kernel = np.exp(-((_times(len(path.x)) / tau) ** power))
    return _less_static(path, _memory(np.diff(path.s[:, channel], prepend=0.0), kernel))


def _schapery(path: _Path, channel: int, draw: _Draw) -> Floats:
    """One decay on a clock that runs faster under strain, weight by strain (Schapery 1969)."""
    tau, clock, growth = draw.log(0, 3.0, 40.0), draw.lin(1, 0.5, 2.0), draw.lin(2, 0.0, 0.8)
    s = path.s[:, channel]
    keep = np.exp(-_DT / tau * np.exp(clock * s)).tolist()
    out, q = [], 0.0
    for ds, k in zip(np.diff(s, prepend=0.0).tolist(), keep, strict=True):
        q = (q + ds) * k
        out.append(q)
    return _less_static(path, np.array(out) * (1 + growth * s))


def _thixotropy(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Structure broken by motion and rebuilt at rest (Moore 1959): even in the rate."""
    tau, breaking = draw.log(0, 0.3, 3.0), draw.log(1, 3.0, 25.0)
    weight = 1 + draw.lin(2, -0.3, 0.8) * path.s[:, channel]
    out, whole = [], 1.0
    for v in np.abs(_speed(path)).tolist():
        rate = 1 / tau + breaking * v
        rest = 1 / (tau * rate)
        whole = rest + (whole - rest) * math.exp(-_DT * rate)
        out.append(1 - whole)
    return _less_mean(path, np.array(out) * weight)


def _late_surge(path: _Path, channel: int, draw: _Draw) -> Floats:
    """A power of the rate through two poles: the network needs time to break and to heal."""
    power = np.abs(_speed(path)) ** draw.lin(0, 0.7, 1.5)
    tau = draw.log(1, 0.25, 2.5)
    surge = _pole(_pole(power, draw.lin(2, 0.08, 0.3)), tau)
    return _less_mean(path, surge * (1 + 0.5 * path.s[:, channel]))


def _slow_healing(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Contacts opened in proportion to the path, healed by a stretched exponential."""
    tau, power = draw.log(0, 0.2, 1.5), draw.lin(1, 0.5, 0.8)
    kernel = np.exp(-(((np.arange(2000) + 0.5) * _DT / tau) ** power))
    s = path.s[:, channel]
    opened = np.abs(_speed(path)) * (0.4 + draw.lin(2, 0.0, 1.0) * s)
    return _less_mean(path, _memory(opened, kernel))


# -------------------------------------------------------------------------- material: softening


def _ogden_roxburgh(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Pseudo-elastic softening below the largest energy so far (doi 10.1098/rspa.1999.0431)."""
    u = np.maximum(path.x, 0.0) / X_MAX
    energy = (u**2 + 0.5 * u**4) / 1.5
    most = np.maximum.accumulate(energy)
    scale = draw.log(0, 0.15, 0.5) + draw.lin(1, 0.0, 0.3) * most
    out: Floats = -erf((most - energy) / scale) * path.s[:, channel]
    return out


def _chain_classes(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Chains of several lengths break, over some cycles, where strain passes their limit.

    After the network with evolving limits of Diani, Brieu and Vacherand (2006). What a class
    carried below its limit is lost once it is broken.
    """
    limits = np.linspace(0.08, 0.38, 9)
    patience = draw.log(0, 0.05, 0.5)
    weight = np.exp(-draw.lin(1, 0.0, 1.5) * limits / X_MAX)
    forth = np.maximum(np.diff(path.x, prepend=path.x[0]), 0.0)
    out = np.zeros(len(path.x))
    for limit, w in zip(limits, weight, strict=True):
        broken = 1 - np.exp(-np.cumsum(np.where(path.x > limit, forth, 0.0)) / patience)
        below = np.maximum(1 - (path.x / limit) ** 2, 0.0)
        out -= w * broken * below * np.maximum(path.x, 0.0)
    return out


def _healing_damage(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Exponential softening below a largest strain that is slowly forgotten (Mullins, at rest)."""
    heal, length = draw.log(0, 150.0, 600.0), draw.lin(1, 0.15, 0.5)
    most, peaks = 0.0, []
    for x in (path.x / X_MAX).tolist():
        most = max(x, x + (most - x) * math.exp(-_DT / heal))
        peaks.append(most)
    gap = np.array(peaks) - path.x / X_MAX
    out: Floats = -path.s[:, channel] * (1 - np.exp(-gap / length))
    return out


# ----------------------------------------------------------------- material: time, chance, scale


def _power_drift(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Power of time (Findley's creep)."""
    return path.t_s ** draw.lin(0, 0.35, 0.8)


def _two_exponentials(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Two settling processes, of the same or of opposite direction."""
    fast, slow = draw.log(0, 15.0, 50.0), draw.log(1, 120.0, 500.0)
    share = draw.lin(2, -0.4, 0.6)
    return (1 - np.exp(-path.t_s / slow)) + share * (1 - np.exp(-path.t_s / fast))


def _avrami(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Late cure of the matrix, slow to start and complete in the end (Avrami's law)."""
    return 1 - np.exp(-((path.t_s / draw.log(0, 120.0, 350.0)) ** draw.lin(1, 1.2, 2.2)))


def _is_walk(path: _Path, walk: Floats) -> bool:
    """Whether neither a smooth drift nor one step nor an offset would be a fair name for it."""
    t, w = path.t_s[path.first][::40], walk[path.first][::40]
    if w.mean() ** 2 > 0.6 * (w**2).mean():
        return False
    trends = np.stack((np.ones(len(t)), t, np.sqrt(t), np.log1p(t / 20)), axis=1)
    total = float(((w - w.mean()) ** 2).sum())
    rest = w - trends @ np.linalg.lstsq(trends, w, rcond=None)[0]
    if float(rest @ rest) < 0.45 * total:
        return False
    halves = (
        float(((w[:k] - w[:k].mean()) ** 2).sum() + ((w[k:] - w[k:].mean()) ** 2).sum())
        for k in range(5, len(w) - 5)
    )
    return min(halves) > 0.35 * total


def _walk(path: _Path, channel: int, draw: _Draw, make_one: Callable[..., Floats]) -> Floats:
    rng = draw.rng(channel)
    for _ in range(200):
        walk = make_one(rng, len(path.t_s))
        walk = walk - walk[0]
        if _is_walk(path, walk):
            break
    return walk


def _brownian(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Integrated noise with heavy-tailed increments."""
    return _walk(path, channel, draw, lambda rng, n: np.cumsum(rng.standard_t(4, n)))


def _uhlenbeck(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Ornstein-Uhlenbeck: a walk that is pulled back."""
    keep = math.exp(-_DT / draw.log(0, 20.0, 90.0))

    def one(rng: np.random.Generator, n: int) -> Floats:
        start = rng.normal() / math.sqrt(1 - keep**2)
        out: Floats = lfilter([1.0], [1.0, -keep], rng.normal(size=n), zi=[keep * start])[0]
        return out

    return _walk(path, channel, draw, one)


def _flicker(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Noise with a spectrum f^-a, a from 1.3 to 1.8 (Hooge's law, steeper at low frequency)."""
    half = draw.lin(0, 0.65, 0.9)

    def one(rng: np.random.Generator, n: int) -> Floats:
        f = np.fft.rfftfreq(n, _DT)
        f[0] = f[1]
        return np.fft.irfft(np.fft.rfft(rng.normal(size=n)) / f**half, n)

    return _walk(path, channel, draw, one)


def _sensitivity(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Gauge factor off by a constant share."""
    return path.s[:, channel].copy()


def _fatigue(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Gauge factor that falls with the logarithm of cycles (S-N law)."""
    cycles = np.cumsum(np.abs(np.diff(path.x, prepend=path.x[0]))) / (2 * X_MAX)
    return path.s[:, channel] * np.log1p(cycles / draw.log(0, 3.0, 20.0))


def _weibull_ageing(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Gauge factor that goes over from one value to another (Weibull in time)."""
    done = 1 - np.exp(-((path.t_s / draw.log(0, 100.0, 350.0)) ** draw.lin(1, 0.9, 2.0)))
    out: Floats = path.s[:, channel] * done
    return out


def _onset_s(draw: _Draw) -> float:
    return round(_DT * SAMPLES * draw.lin(-1, 0.2, 0.8) * RATE_HZ) * _DT


def _jump(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Offset and sensitivity jump between two samples: a lead was displaced."""
    after = (path.t_s >= _onset_s(draw)).astype(np.float64)
    return after * (1 + draw.lin(1, -0.5, 0.8) * path.s[:, channel])


def _jump_recovers(path: _Path, channel: int, draw: _Draw) -> Floats:
    """A jump of which a part heals by a power law."""
    since = path.t_s - _onset_s(draw)
    left = 1 - draw.lin(1, 0.2, 0.6) * (1 - (1 + np.maximum(since, 0) / 15.0) ** -0.6)
    return np.where(since >= 0, left, 0.0) * (1 + draw.lin(2, -0.3, 0.5) * path.s[:, channel])


def _tear(path: _Path, channel: int, draw: _Draw) -> Floats:
    """A parallel path tears within a second or two; what is left is more sensitive."""
    since = path.t_s - _onset_s(draw)
    torn = np.clip(since / draw.lin(1, 0.3, 1.8), 0.0, 1.0) ** 2
    return torn * (0.5 + draw.lin(2, 0.2, 1.0) * path.s[:, channel])


# ------------------------------------------------------------------------------- motion effects


def _gap_and_spring(path: _Path, draw: _Draw, size: float) -> Floats:
    """Gap in series with a drive spring and a damped load (Nordin and Gutman 2002)."""
    settle = draw.lin(0, 0.02, 0.06)
    keep = math.exp(-_DT / settle)
    y, out = float(path.x[0]), []
    for x in path.x.tolist():
        end = min(max(y, x - size), x + size)
        y = end + (y - end) * keep
        out.append(y)
    return np.array(out)


def _presliding(path: _Path, draw: _Draw, size: float) -> Floats:
    """The carriage follows the drive through Coulomb friction with a short elastic presliding."""
    sharp = draw.lin(0, 2.0, 4.0)
    y, z, out = float(path.x[0]), 0.0, []
    for dx in np.diff(path.x, prepend=path.x[0]).tolist():
        steps = 1 + int(abs(dx) / (0.1 * size))
        for _ in range(steps):
            d = dx / steps
            passed = abs(z + 1 if d > 0 else z - 1) / 2
            y += d * min(passed, 1.0) ** sharp
            z = min(max(z + d * (1 + (sharp - 1) / 4) / size, -1.0), 1.0)
        out.append(y)
    return np.array(out)


def _worn_rack(path: _Path, draw: _Draw, size: float) -> Floats:
    """Play of a worn rack: wider where it works most."""
    centre, more = draw.lin(0, 0.1, 0.3), draw.lin(1, 0.3, 1.0)
    half = size * (1 + more * np.exp(-(((path.x - centre) / 0.1) ** 2)))
    y, out = float(path.x[0]), []
    for x, w in zip(path.x.tolist(), half.tolist(), strict=True):
        y = min(max(y, x - w), x + w)
        out.append(y)
    return np.array(out)


def _delayed(path: _Path, delay_s: Floats) -> Floats:
    return np.interp(path.t_s - delay_s, path.t_s, path.x)


def _frame_delay(path: _Path, draw: _Draw, size: float) -> Floats:
    """Constant delay and jitter of the operating system."""
    jitter = draw.rng().gamma(2.0, 0.5 * draw.lin(0, 0.02, 0.12), len(path.t_s))
    return _delayed(path, size * (1 + jitter))


def _clock_skew(path: _Path, draw: _Draw, size: float) -> Floats:
    """Two clocks: a delay that grows in proportion to time."""
    share = draw.lin(0, 0.1, 0.5)
    return _delayed(path, size * (share + (1 - share) * path.t_s / 400.0))


def _warming_clock(path: _Path, draw: _Draw, size: float) -> Floats:
    """Two clocks, one of which warms up: the skew fades, the delay settles."""
    warm = draw.log(0, 60.0, 250.0)
    share = draw.lin(1, 0.3, 0.7)
    return _delayed(path, size * (share + (1 - share) * (1 - np.exp(-path.t_s / warm))))


def _clamp_slip(path: _Path, draw: _Draw, size: float) -> Floats:
    """The specimen slips in its clamp where it is pulled hard."""
    high = path.x[path.first].max() * draw.lin(0, 0.55, 0.75)
    over = np.maximum(path.x - high, 0.0)
    if draw.family == 0:
        slip = np.cumsum(over) * _DT
    elif draw.family == 1:
        # Only now and then, at a peak.
        strikes = draw.rng().random(len(over)) < 0.15 * _DT * (over > 0)
        slip = np.cumsum(strikes * draw.rng(1).exponential(1.0, len(over)))
        slip = slip + 0.3 * np.cumsum(over) * _DT
    else:
        # Taken up again where the specimen is slack.
        slips, now = [], 0.0
        for x, o in zip(path.x.tolist(), over.tolist(), strict=True):
            now = now + o * _DT if x > 0.06 else now * math.exp(-_DT / 2.0)
            slips.append(now)
        slip = np.array(slips)
    most = float(np.abs(slip[path.first]).max())
    return path.x - size * slip / max(most, 1e-9)


def _resonance(path: _Path, draw: _Draw, size: float) -> Floats:
    """Underdamped mode of the frame: rings after each change of speed."""
    omega = 2 * np.pi * draw.log(0, 0.4, 1.5)
    damping, hard = draw.lin(1, 0.02, 0.12), (0.0, 4.0, -2.0)[draw.family]
    steps = 5
    d = _DT / steps
    acceleration = np.diff(path.x, 2, prepend=[path.x[0], path.x[0]]) / _DT**2
    y, v, out = 0.0, 0.0, []
    for a in acceleration.tolist():
        for _ in range(steps):
            stiff = omega**2 * (1 + hard * min((y / 0.1) ** 2, 0.2))
            v += d * (-2 * damping * omega * v - stiff * y - a)
            y += d * v
        out.append(y)
    return path.x + size * np.array(out)


# ----------------------------------------------------------------------------- foreign materials


def _unlogged_load(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Somebody leans on the sensors now and then."""
    rng = draw.rng()
    out = np.zeros(len(path.t_s))
    for at in _events(len(out), 0.02, rng):
        since, length = path.t_s - at * _DT, rng.uniform(2.0, 12.0)
        bump = (
            np.exp(-((since / (0.4 * length)) ** 2)),
            np.where(np.abs(since) < length / 2, np.cos(np.pi * since / length), 0.0),
            -np.expm1(-np.maximum(since, 0) / 0.3) * np.exp(-np.maximum(since, 0) / length),
        )[draw.family]
        out += rng.uniform(0.3, 1.0) * bump
    return out * (1 + 0.3 * path.s[:, channel])


def _unlogged_twist(path: _Path, channel: int, draw: _Draw) -> Floats:
    """A second degree of freedom moves and is not recorded."""
    rng, n = draw.rng(), len(path.t_s)
    low = draw.log(0, 0.05, 0.15)
    twist = _band(n, low, 3 * low, rng)
    if draw.family == 1:
        twist = np.sin(2 * np.pi * low * path.t_s + 2.0 * _band(n, 0.01, 0.05, rng))
    elif draw.family == 2:
        twist = np.abs(twist)
    return twist * (0.5 + path.s[:, channel])


def _crystallisation(path: _Path, channel: int, draw: _Draw) -> Floats:
    """Crystals that grow under strain above a threshold and melt below it."""
    onset = path.x[path.first].max() * draw.lin(0, 0.5, 0.7)
    order = (0.0, 1.0, 0.5)[draw.family]
    grow, melt = draw.log(1, 2.0, 8.0), draw.log(2, 0.7, 4.0)
    share, out = 0.0, []
    for x in path.x.tolist():
        if x > onset:
            share += _DT / grow * (0.05 + share) ** order * (1 - share)
        else:
            share *= math.exp(-_DT / melt)
        share = min(share, 1.0)
        out.append(share)
    return np.array(out)


# --------------------------------------------------------------------------- electrical effects


def _two_poles(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Two unequal poles with gain 1."""
    ratio = draw.lin(0, 0.2, 0.9)
    columns = [
        _pole(_pole(v[:, c], tau / (1 + ratio)), tau * ratio / (1 + ratio))
        for c, tau in enumerate(size)
    ]
    return np.stack(columns, axis=1)


def _diffusion(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Distributed RC line, the finite Warburg element: tanh(sqrt(p tau)) / sqrt(p tau)."""
    pad = 400
    padded = np.pad(v, ((pad, pad), (0, 0)), mode="edge")
    f = np.fft.rfftfreq(len(padded), _DT)[:, None]
    root = np.sqrt(2j * np.pi * np.maximum(f, 1e-9) * 3 * size)
    return np.fft.irfft(np.fft.rfft(padded, axis=0) * np.tanh(root) / root, len(padded), axis=0)[
        pad:-pad
    ]


def _sensor_is_the_resistor(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """RC at the divider's node: the time constant follows the sensor's own resistance."""
    out = np.empty_like(v)
    for c, tau in enumerate(size):
        r = _DT / (tau * v[:, c] / v[:, c].mean())
        keep = np.exp(-r)
        b1 = 1 - (1 - keep) / r
        drive = b1[1:] * v[1:, c] + (1 - keep[1:] - b1[1:]) * v[:-1, c]
        y, column = float(v[0, c]), [float(v[0, c])]
        for k, d in zip(keep[1:].tolist(), drive.tolist(), strict=True):
            y = k * y + d
            column.append(y)
        out[:, c] = column
    return out


def _range(path: _Path, v: Floats) -> tuple[Floats, Floats]:
    return v[path.first].min(axis=0), np.ptp(v[path.first], axis=0)


def _rational_knee(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Rapp's limiter (1991) above the lower third of the range."""
    low, span = _range(path, v)
    foot = low + 0.33 * span
    room = span * (1.6 - 1.4 * size)
    n = draw.lin(0, 3.0, 7.0)
    up = np.maximum(v - foot, 0.0)
    return np.minimum(v, foot) + up / (1 + (up / room) ** n) ** (1 / n)


def _diode_clamp(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Protection diode: exponential onset of conduction, a soft minimum."""
    low, span = _range(path, v)
    level = low + span * (1 - size)
    soft = span * draw.lin(0, 0.015, 0.05)
    out: Floats = v - soft * np.logaddexp(0.0, (v - level) / soft)
    return out


def _bent_rail(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Output stage near its rail: the slope falls to a small rest over a quadratic knee."""
    low, span = _range(path, v)
    knee, rest = span * draw.lin(0, 0.03, 0.2), draw.lin(1, 0.0, 0.15)
    over = np.clip(v - (low + span * (1 - size)), 0.0, None)
    lost = np.where(over < knee, over**2 / (2 * knee), over - knee / 2)
    return v - (1 - rest) * lost


def _add_inl(path: _Path, v: Floats, size: Floats, inl: Callable[[Floats], Floats]) -> Floats:
    """Against the line of best fit over the range in use: the calibration took in the line."""
    wrong = inl(v)
    low, span = _range(path, v)
    grid = low + span * np.linspace(0.0, 1.0, 400)[:, None]
    for c, values in enumerate(inl(grid).T):
        wrong[:, c] -= np.polyval(np.polyfit(grid[:, c], values, 1), v[:, c])
    return v + size * wrong


def _integral_s(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Smooth bow and S of a cheap converter."""
    bow, turns, phase = draw.lin(0, -3, 3), draw.lin(1, 2.0, 4.5), draw.lin(2, 0.0, 6.28)

    def inl(v: Floats) -> Floats:
        u = (v - 2250.0) / 1000.0
        out: Floats = bow * u**2 + np.sin(np.pi * turns * u + phase)
        return out

    return _add_inl(path, v, size, inl)


def _capacitor_mismatch(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Successive approximation with unequal capacitors: each bit has an error of its own."""
    weights = draw.rng().normal(size=BITS) * np.sqrt(2.0 ** np.arange(BITS)) / 45.0

    def inl(v: Floats) -> Floats:
        bits = (np.round(v).astype(np.int64)[..., None] >> np.arange(BITS)) & 1
        out: Floats = bits @ weights
        return out

    return _add_inl(path, v, size, inl)


def _subranging(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Two-step converter with a wrong residue gain: a sawtooth over the coarse steps."""
    step = 2.0 ** round(draw.lin(0, 6.5, 8.5))
    tilt = draw.rng().uniform(0.5, 1.5, 1 + round(TOP / step))

    def inl(v: Floats) -> Floats:
        coarse = np.clip(np.floor(v / step), 0, len(tilt) - 1)
        out: Floats = tilt[coarse.astype(np.int64)] * (v / step - coarse - 0.5)
        return out

    return _add_inl(path, v, size, inl)


def _swing(path: _Path, v: Floats) -> Floats:
    """Voltage against that at rest."""
    out: Floats = v - v[path.first.start]
    return out


def _charge_sharing(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """The sampling capacitor keeps a part of the channel that was scanned before."""
    swing = _swing(path, v)
    return v + size * (np.roll(swing, 1, axis=1) - draw.lin(0, 0.0, 0.7) * swing)


def _reference_droop(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """The current of all other dividers flows through the impedance of the shared reference."""
    swing = _swing(path, v)
    pull = draw.rng().uniform(0.5, 1.5, v.shape[1])
    others = (swing * pull).sum(axis=1, keepdims=True) - swing * pull
    out: Floats = v + size * others / (v.shape[1] - 1) * (0.5 + v / TOP)
    return out


def _moist_film(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Leakage from both neighbours on the connector, unequal, by a slow path on one side."""
    swing = _swing(path, v)
    left = np.roll(swing, 1, axis=1)
    right = np.roll(swing, -1, axis=1)
    share = draw.lin(0, 0.15, 0.85)
    return v + size * (share * left + (1 - share) * _pole(right, draw.lin(1, 0.05, 0.3)))


def _tone(path: _Path, v: Floats, draw: _Draw, size: Floats, wave: Floats) -> Floats:
    """Adds the in-phase and quadrature waves, (samples, 2), by a phase per channel."""
    angle = draw.rng(1).uniform(-0.8, 0.8, v.shape[1])
    out: Floats = v + size * (wave[:, :1] * np.cos(angle) + wave[:, 1:] * np.sin(angle))
    return out


def _waves(phase: Floats) -> Floats:
    return np.stack((np.sin(phase), np.cos(phase)), axis=1)


def _folded_mains(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Mains and its third and fifth harmonics, folded by sampling, on a wandering grid."""
    # The two clocks differ; 50 Hz folds to just below half the rate of 20 Hz, 47 Hz to 7 Hz.
    wander = 0.02 * _band(len(path.t_s), 0.001, 0.02, draw.rng())
    mains = draw.lin(0, 46.3, 49.9) + wander
    phase = 2 * np.pi * np.cumsum(mains) * _DT
    wave = _waves(phase)
    for order, weight in ((3, draw.lin(1, 0.1, 0.4)), (5, draw.lin(2, 0.0, 0.25))):
        wave = wave + weight * _waves(order * phase)
    return _tone(path, v, draw, size, wave)


def _motor_tone(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Tone of a drive at fixed frequency, its strength breathing with the load."""
    rng = draw.rng()
    breathe = 1 + draw.lin(1, 0.1, 0.4) * _band(len(path.t_s), 0.005, 0.05, rng)
    phase = 2 * np.pi * draw.log(0, 2.0, 9.0) * path.t_s
    return _tone(path, v, draw, size, breathe[:, None] * _waves(phase))


def _beating_pair(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Two free-running converters close in frequency, each with phase noise: a beat."""
    f, apart = draw.lin(0, 2.5, 8.5), draw.log(1, 0.03, 0.3)
    steps = draw.rng().normal(size=(len(path.t_s), 2)) * math.sqrt(_DT) * draw.lin(2, 0.02, 0.1)
    phase = 2 * np.pi * np.outer(path.t_s, [f, f + apart]) + np.cumsum(steps, axis=0)
    wave = _waves(phase[:, 0]) + draw.lin(3, 0.3, 0.8) * _waves(phase[:, 1])
    return _tone(path, v, draw, size, wave)


def _scattered(path: _Path, kernel: Floats, draw: _Draw, count: int, rate_hz: float) -> Floats:
    """Impulses of random sign and size at common instants, (samples, count)."""
    rng = draw.rng()
    out = np.zeros((len(path.t_s), count))
    at = _events(len(out), rate_hz, rng)
    size = rng.choice([-1.0, 1.0], len(at)) * rng.uniform(0.5, 1.5, len(at))
    np.add.at(out, at, size[:, None] * rng.uniform(0.6, 1.4, (len(at), count)))
    filtered: Floats = lfilter(kernel, [1.0], out, axis=0)
    return filtered


def _discharges(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Static discharges that leak away within some samples."""
    kernel = np.exp(-_times(20) / draw.log(0, 0.04, 0.2))
    rate = draw.log(1, 0.12, 0.6)
    return v + size * _scattered(path, kernel, draw, v.shape[1], rate)


def _ringing(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Impulses that ring in the input filter."""
    t = _times(20)
    kernel = np.exp(-t / draw.lin(0, 0.08, 0.2)) * np.cos(2 * np.pi * draw.lin(1, 3.0, 9.0) * t)
    return v + size * _scattered(path, kernel, draw, v.shape[1], draw.log(2, 0.1, 0.5))


def _bursts(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Clusters of single wrong samples with heavy tails: each event calls for others (Hawkes)."""
    rng = draw.rng()
    out = np.zeros(v.shape)
    for at in _events(len(v), draw.log(0, 0.06, 0.2), rng):
        for k in range(1 + rng.poisson(draw.lin(1, 1.0, 3.0))):
            place = at if k == 0 else at + 1 + int(rng.exponential(1.5 * RATE_HZ))
            if place < len(v):
                jump = 0.7 + min(rng.exponential(), 3.0)
                out[place] += jump * rng.choice([-1.0, 1.0])
    return v + size * out


def _extra_noise(path: _Path, v: Floats, draw: _Draw, size: Floats, level: Floats) -> Floats:
    level = level / np.sqrt((level[path.first] ** 2).mean(axis=0))
    return v + size * level * draw.rng().normal(size=v.shape)


def _white(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """A higher level, the same at all times."""
    return _extra_noise(path, v, draw, size, np.ones_like(v))


def _contact_noise(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Noise of the contacts between particles, which grows as the network opens."""
    return _extra_noise(path, v, draw, size, np.exp(draw.lin(0, 0.8, 2.0) * path.s))


def _friction_noise(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """Charge of rubbing leads: noise that grows with speed."""
    level = np.sqrt(0.3 + (np.abs(_speed(path)) / draw.log(0, 0.03, 0.12)) ** 1.2)
    return _extra_noise(path, v, draw, size, np.repeat(level[:, None], v.shape[1], axis=1))


def _intermittent_contact(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """A contact that has two states: dwell times exponential, heavy-tailed or set off by strain."""
    rng = draw.rng()
    bad = np.zeros(len(v))
    k, n = 0, len(v)
    while k < n:
        if draw.family == 1:
            good, off = 4.0 * rng.pareto(1.5), 0.3 * (1 + rng.pareto(1.5))
        else:
            good, off = rng.exponential(12.0), rng.exponential(1.5)
        k += 1 + round(good * RATE_HZ)
        if draw.family == 2:
            while k < n and path.x[k] < 0.6 * X_MAX:
                k += 1
        end = k + 1 + round(off * RATE_HZ)
        bad[k:end] = rng.uniform(0.7, 1.3)
        k = end
    return v + size * bad[:, None]


def _stale_samples(path: _Path, v: Floats, draw: _Draw, size: Floats) -> Floats:
    """The logger repeats an old sample for a while; ``size`` is the mean length in seconds."""
    rng = draw.rng()
    out = v.copy()
    length = 0.3 + float(size.mean())
    for at in _events(len(v), 0.08, rng):
        end = at + 1 + round(rng.uniform(0.5, 1.5) * length * RATE_HZ)
        if draw.family == 0:
            out[at:end] = v[at]
        elif draw.family == 1:
            out[at:end] = v[max(0, at - round(length * RATE_HZ))]
        else:
            part = np.arange(at, min(end, len(v)))
            out[part] = v[at + (part - at) // 15 * 15]
    return out


# ------------------------------------------------------------------------------------- registry

_MOTION: dict[str, tuple[_Motion, ...]] = {
    "delay": (_frame_delay, _clock_skew, _warming_clock),
    "backlash": (_gap_and_spring, _presliding, _worn_rack),
    "clamp_slip": (_clamp_slip,) * 3,
    "resonance": (_resonance,) * 3,
}
_MATERIAL: dict[str, tuple[_Material, ...]] = {
    "hysteresis": (_preisach, _pinched, _duhem),
    "relaxation": (_spring_pot, _kohlrausch, _schapery),
    "softening": (_ogden_roxburgh, _chain_classes, _healing_damage),
    "overshoot": (_thixotropy, _late_surge, _slow_healing),
    "drift": (_power_drift, _two_exponentials, _avrami),
    "random_walk": (_brownian, _uhlenbeck, _flicker),
    "gain": (_sensitivity, _fatigue, _weibull_ageing),
    "step": (_jump, _jump_recovers, _tear),
    "unlogged_load": (_unlogged_load,) * 3,
    "unlogged_twist": (_unlogged_twist,) * 3,
    "crystallisation": (_crystallisation,) * 3,
}
# In the order of the chain: line, contacts, amplifier, multiplexer, converter, logger.
_ELECTRICAL: dict[str, tuple[_Electrical, ...]] = {
    "intermittent_contact": (_intermittent_contact,) * 3,
    "lag": (_two_poles, _diffusion, _sensor_is_the_resistor),
    "interference": (_folded_mains, _motor_tone, _beating_pair),
    "spikes": (_discharges, _ringing, _bursts),
    "noise": (_white, _contact_noise, _friction_noise),
    "saturation": (_rational_knee, _diode_clamp, _bent_rail),
    "crosstalk": (_charge_sharing, _reference_droop, _moist_film),
    "adc_nonlinearity": (_integral_s, _capacitor_mismatch, _subranging),
    "stale_samples": (_stale_samples,) * 3,
}
# Smallest and largest size: strain, seconds, share of the range, or codes.
_BOUNDS = {
    "delay": (0.005, 0.4),
    "backlash": (0.0005, 0.04),
    "clamp_slip": (0.0005, 0.08),
    "resonance": (0.02, 12.0),
    "lag": (0.008, 0.5),
    "saturation": (0.02, 0.9),
    "crosstalk": (0.002, 0.3),
    "stale_samples": (0.01, 3.5),
}
# One size for all channels: one stage, one clock, one converter, one logger.
_COMMON = (*_ON_ALL, "adc_nonlinearity", "stale_samples")


# -------------------------------------------------------------------------------------- making


@dataclass(frozen=True)
class _Effect:
    """One hidden effect, its size still open: ``sign`` and ``spread`` are (channels,)."""

    name: str
    draw: _Draw
    channels: tuple[int, ...]
    sign: Floats
    spread: Floats
    target: float
    retuned: bool


def _effect(name: str, family: int | None, count: int, seed: int) -> _Effect:
    known = (*NAMES, *FOREIGN, *(f"retune:{r}" for r in RETUNED))
    if name not in known:
        raise ValueError(f"unknown effect {name!r}; known are {', '.join(known)}")
    rng = np.random.default_rng([seed, 2, known.index(name)])
    drawn = int(rng.integers(FAMILIES))
    family = drawn if family is None else family
    retuned = name.startswith("retune:")
    low, high = _SIZE_RETUNED if retuned else _SIZE.get(name, (3.0, 30.0))
    whole = rng.random() < 0.4
    channels = rng.permutation(count)[: int(rng.integers(1, count))]
    if whole or name in _ON_ALL:
        channels = np.arange(count)
    sign = rng.choice([-1.0, 1.0], count)
    if name in ("retune:relaxation", "retune:hysteresis", "crystallisation", "gain"):
        sign[:] = sign[0]
    if name in ("softening", "overshoot", "clamp_slip", "resonance"):
        sign[:] = 1.0
    return _Effect(
        name=name.removeprefix("retune:"),
        draw=_Draw(rng.random(6), int(rng.integers(1 << 40)), family),
        channels=tuple(sorted(int(c) for c in channels)),
        sign=sign,
        spread=np.exp(0.2 * rng.normal(size=count)),
        target=math.exp(rng.uniform(math.log(low), math.log(high))),
        retuned=retuned,
    )


def _mask(effect: _Effect, count: int) -> Floats:
    mask = np.zeros(count)
    mask[list(effect.channels)] = 1.0
    return mask


def _size(
    effect: _Effect, rms: Callable[[Floats], Floats], noise: Floats, bounds: tuple[float, float]
) -> Floats:
    """Size per channel at which the change has the rms that was drawn, within the bounds.

    ``rms`` gives codes per channel and rises with the size: bisection in logarithms.
    """
    channels = list(effect.channels)
    low, high = _SIZE.get(effect.name, (3.0, 30.0))
    if effect.name == "noise":
        wanted = np.sqrt(np.clip(effect.target * effect.spread, low, high) ** 2 - 1)
    else:
        wanted = effect.target * effect.spread * noise.mean() / noise
        wanted = np.clip(wanted, 1.02 * low, 0.98 * high)
    under, over = np.full(len(noise), bounds[0]), np.full(len(noise), bounds[1])
    for _ in range(12):
        size = np.sqrt(under * over)
        ratio = rms(size) / noise
        enough = ratio >= wanted
        if effect.name in _COMMON:
            # One size for all: of the rms over channels, and the least affected one must show it.
            whole = math.sqrt(float((ratio[channels] ** 2).mean()))
            seen = whole >= effect.target and ratio[channels].min() >= 2.0
            enough[:] = seen or whole >= 0.98 * high
        under, over = np.where(enough, under, size), np.where(enough, size, over)
    out: Floats = np.sqrt(under * over)
    return out


@dataclass(frozen=True)
class _Rig:
    """Sensors, motion and what is hidden, with what the size of each effect is found against."""

    sensors: _Sensors
    path: _Path
    codes: Floats

    def moved(self, x: Floats) -> _Path:
        return replace(self.path, x=x, s=_static(self.sensors, x))

    def rms(self, codes: Floats) -> Floats:
        change = (codes - self.codes)[self.path.first]
        out: Floats = np.sqrt((change**2).mean(axis=0))
        return out


def _retuned(sensors: _Sensors, effect: _Effect, size: Floats) -> _Sensors:
    factor = np.exp(effect.sign * size * _mask(effect, len(size)))
    slower, more = effect.draw.family in (0, 2), effect.draw.family in (1, 2)
    if effect.name == "relaxation":
        return replace(
            sensors,
            tau_s=sensors.tau_s * (factor if slower else 1.0),
            stress=sensors.stress * (factor if more else 1.0),
        )
    return replace(
        sensors,
        width=sensors.width * (factor if slower else 1.0),
        loop=sensors.loop * (factor if more else 1.0),
    )


def _other(changed: _Sensors, sensors: _Sensors, path: _Path) -> Floats:
    """What other parameters change, both sets calibrated to the same mean curve."""
    return _less_static(path, _nominal(changed, path) - _nominal(sensors, path))


def _shapes(effect: _Effect, path: _Path, count: int) -> Floats:
    """What a material effect adds, with rms about 1, (samples, channels)."""
    out = np.zeros((len(path.x), count))
    for c in effect.channels:
        shape = _MATERIAL[effect.name][effect.draw.family](path, c, effect.draw.near(c))
        rms = math.sqrt(float((shape[path.first] ** 2).mean()))
        out[:, c] = effect.sign[c] * shape / max(rms, 1e-9)
    return out


def _real(rig: _Rig, effects: tuple[_Effect, ...]) -> Floats:
    """Codes of the real sensors before noise and rounding; sizes are found one effect at a time."""
    sensors, path, noise = rig.sensors, rig.path, rig.sensors.noise
    count = len(noise)
    x = path.x
    for name in _MOTION:
        for effect in (e for e in effects if e.name == name):
            move = _MOTION[name][effect.draw.family]

            def rms_moved(size: Floats, move: _Motion = move, draw: _Draw = effect.draw) -> Floats:
                moved = rig.moved(move(path, draw, float(size[0])))
                return rig.rms(_codes(_nominal(sensors, moved)))

            size = _size(effect, rms_moved, noise, _BOUNDS[name])
            x = move(replace(path, x=x), effect.draw, float(size[0]))
    moved = rig.moved(x)

    plain, changed = _nominal(sensors, path), sensors
    for effect in (e for e in effects if e.retuned):

        def rms_retuned(size: Floats, effect: _Effect = effect) -> Floats:
            return rig.rms(_codes(plain + _other(_retuned(sensors, effect, size), sensors, path)))

        size = _size(effect, rms_retuned, noise, (0.02, 1.8))
        changed = _retuned(changed, effect, size)
    log_ratio = _nominal(sensors, moved) + _other(changed, sensors, moved)

    for effect in (e for e in effects if e.name in _MATERIAL and not e.retuned):
        shapes = _shapes(effect, path, count)

        def rms_added(size: Floats, shapes: Floats = shapes) -> Floats:
            return rig.rms(_codes(plain + size * shapes))

        size = _size(effect, rms_added, noise, (1e-5, 1.0))
        if any(e.name in _MOTION for e in effects):
            shapes = _shapes(effect, moved, count)
        log_ratio = log_ratio + size * shapes

    codes = _codes(log_ratio)
    for name in _ELECTRICAL:
        for effect in (e for e in effects if e.name == name):
            act = _ELECTRICAL[name][effect.draw.family]
            on = _mask(effect, count) > 0

            def rms_acted(
                size: Floats, act: _Electrical = act, draw: _Draw = effect.draw
            ) -> Floats:
                return rig.rms(act(path, rig.codes, draw, size))

            size = _size(effect, rms_acted, noise, _BOUNDS.get(name, (0.05, 2000.0)))
            codes = np.where(on, act(moved, codes, effect.draw, size), codes)
    return codes


def _recording(name: str, codes: Floats, x: Floats) -> Recording:
    count = codes.shape[1]
    return Recording(
        name,
        tuple(f"s{c + 1}" for c in range(count)),
        np.clip(np.floor(codes + 0.5), 0, TOP).astype(np.int32),
        ("strain",),
        ("1",),
        x[:, None].copy(),
        _times(len(x)),
        tuple(FrontEnd("codes", BITS) for _ in range(count)),
    )


def make(seed: int, names: tuple[str, ...], excitation: str, family: int | None = None) -> Case:
    """The case of a seed: ``names`` from NAMES and FOREIGN, or "retune:X" with X of RETUNED.

    The truth has the effects by these names. One seed has the same sensors and motions, whatever
    is hidden in them, but for a retuned mechanism, which the sensors must have to a fair degree.
    """
    if excitation not in EXCITATIONS:
        raise ValueError(f"unknown excitation {excitation!r}; known are {', '.join(EXCITATIONS)}")
    if len(set(names)) < len(names):
        raise ValueError(f"an effect is named twice: {', '.join(names)}")
    if family is not None and not 0 <= family < FAMILIES:
        raise ValueError(f"family {family} is not one of 0 … {FAMILIES - 1}")
    rng = np.random.default_rng([seed, 0])
    count = int(rng.integers(3, 8))
    sensors = _sensors(count, rng)
    effects = tuple(_effect(name, family, count, seed) for name in names)
    for effect in (e for e in effects if e.retuned):
        on = _mask(effect, count) > 0
        if effect.name == "hysteresis":
            sensors = replace(sensors, loop=np.where(on, rng.uniform(0.05, 0.12, count), 0.0))
        else:
            sensors = replace(
                sensors,
                stress=np.where(on, rng.uniform(0.2, 0.4, count), sensors.stress),
                tau_s=np.where(on, rng.uniform(1.0, 5.0, count), sensors.tau_s),
            )

    motion = np.random.default_rng([seed, 1])
    one = _strain(excitation, SAMPLES, False, motion)
    two = _strain(excitation, SAMPLES_2, True, motion)
    back = _move(float(one[-1]), 0.0, motion.uniform(1.0, 2.5), True)
    x = np.concatenate((one, back, np.zeros(round(motion.uniform(2.0, 5.0) * RATE_HZ)), two))
    path = _Path(
        t_s=_times(len(x)),
        x=x,
        s=_static(sensors, x),
        first=slice(0, SAMPLES),
        second=slice(len(x) - SAMPLES_2, len(x)),
    )
    simulated = _codes(_nominal(sensors, path))
    real = _real(_Rig(sensors, path, simulated), effects)

    chance = np.random.default_rng([seed, 3])
    real_noise = sensors.noise * np.exp(0.02 * chance.normal(size=count))
    sims, reals = (
        codes + level * chance.normal(size=codes.shape)
        for codes, level in ((simulated, sensors.noise), (real, real_noise))
    )
    steps = [e for e in effects if e.name == "step"]
    return Case(
        sim=_recording("sim1", sims[path.first], one),
        real=_recording("real1", reals[path.first], one),
        sim2=_recording("sim2", sims[path.second], two),
        real2=_recording("real2", reals[path.second], two),
        change=(real - simulated)[path.first],
        floors=np.sqrt(sensors.noise**2 + real_noise**2 + 2 / 12),
        truth={name: effect.channels for name, effect in zip(names, effects, strict=True)},
        excitation=excitation,
        onset_s=_onset_s(steps[0].draw) if steps else None,
        unseen=True,
    )
