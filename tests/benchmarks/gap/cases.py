"""Made cases of a sim-to-real gap, with equations that are not the catalogue's.

Every mechanism has several families of equations; the last one is used by the held-out half
only. Nothing here imports the effects or the simulator of softsense.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, fftconvolve, lfilter
from scipy.special import erf, ndtr

from softsense.recording import FrontEnd, Recording

Floats = NDArray[np.float64]
Random = np.random.Generator

DT_S = 0.05
# Of the first recording; a step in one of another length is where it is in a usual one.
USUAL = SAMPLES = 8000
# Of the second recording, of another motion, and of the move between that nobody records.
LATER = 4000
BETWEEN = 100
EXCITATIONS = ("rich", "typical", "poor")
WIDE = {"backlash", "delay"}  # act on the motion or the clock: on all channels
LAST = 10  # family of the held-out half


@dataclass(frozen=True)
class Case:
    """Simulated and real recordings of two motions, and the truth: channels (0, 1, …) by effect.

    ``change``: (SAMPLES, channels) codes that the hidden effects add. ``floors``: (channels,) rms
    of the difference of two recordings where nothing is hidden.
    """

    sim: Recording
    real: Recording
    sim2: Recording
    real2: Recording
    change: Floats
    floors: Floats
    truth: dict[str, tuple[int, ...]]
    excitation: str
    onset_s: float | None
    unseen: bool  # an equation of it is not used by the training half


def converted(label: str, signals: Floats, strain: Floats) -> Recording:
    """The recording of ``signals`` (samples, channels) in codes, as 12 bits have them, beside a
    ``strain`` (samples,)."""
    samples, channels = signals.shape
    return Recording(
        label,
        tuple(f"s{channel + 1}" for channel in range(channels)),
        np.clip(np.floor(signals + 0.5), 0, 4095).astype(np.int32),
        ("strain",),
        ("1",),
        strain[:, None].copy(),
        np.arange(samples) * DT_S,
        tuple(FrontEnd("codes", 12) for _ in range(channels)),
    )


def motion(rng: Random, samples: int, excitation: str) -> Floats:
    """Strain 0 … 0.4."""
    t = np.arange(samples) * DT_S
    if excitation == "poor":
        return 0.4 * np.abs((t / rng.uniform(15.0, 25.0) + 0.0) % 2.0 - 1.0) * -1.0 + 0.4
    if excitation == "typical":
        tones = np.exp(rng.uniform(np.log(0.03), np.log(0.6), 12))
        phases = rng.uniform(0.0, 2.0 * np.pi, 12)
        wave = np.sin(2.0 * np.pi * tones[:, None] * t + phases[:, None]).sum(axis=0) / 3.0
        return 0.4 * ndtr(wave) * np.minimum(t / 3.0, 1.0)
    x, at, reach = np.zeros(samples), 0, 0.1
    while at < samples:
        length = int(rng.uniform(3.0, 15.0) / DT_S)
        here, there = (x[at - 1] if at else 0.0), rng.uniform(0.0, min(reach, 0.4))
        reach *= 1.06
        kind = rng.integers(3)
        if kind == 0:
            ramp = np.linspace(here, there, max(int(length * rng.uniform(0.1, 0.6)), 5))
            part = np.concatenate([ramp, np.full(length // 2, there)])
        elif kind == 1:
            half = length // 3 + 3
            part = np.concatenate(
                [np.linspace(here, there, half), np.linspace(there, 0.5 * here, half)]
            )
        else:
            k = np.linspace(0.0, 1.0, length)
            swing = np.sin(2.0 * np.pi * k * length * DT_S * rng.uniform(0.2, 1.0))
            part = here + (there - here) * k + 0.03 * swing * np.sin(np.pi * k)
        part = np.clip(part, 0.0, 0.4)[: samples - at]
        x[at : at + len(part)] = part
        at += len(part)
    return np.asarray(lfilter([0.3], [1.0, -0.7], x))


def low_pass(u: Floats, tau_s: float, poles: int = 1) -> Floats:
    a = np.exp(-DT_S / tau_s)
    for _ in range(poles):
        u = lfilter([1.0 - a], [1.0, -a], u, zi=[a * u[0]])[0]
    return u


def sensors(
    rng: Random, x: Floats, channels: int, more: dict[str, float] | None = None
) -> tuple[Floats, Floats]:
    """(samples, channels) noiseless codes and dimensionless signals of nominal sensors.

    ``more``: factors on the nominal parameters, which are 1.
    """
    factor = dict.fromkeys(RETUNED, 1.0) | (more or {})
    y = x / 0.4
    signals = []
    for _ in range(channels):
        s = rng.uniform(0.3, 1.2) * (y + rng.uniform(-0.3, 0.5) * y**2)
        share, tau_s = rng.uniform(0.05, 0.3), rng.uniform(1.0, 4.0)
        s = s + factor["memory"] * factor["relaxation"] * share * (
            low_pass(s, factor["tau"] * factor["pace"] * factor["quick"] * tau_s) - s
        )
        slow = factor["memory"] * factor["slow"] * factor["creep"] * rng.uniform(0.02, 0.15)
        s = s + slow * (
            low_pass(
                s,
                factor["slow"]
                * factor["late"]
                * factor["pace"]
                * factor["slack"]
                * rng.uniform(8.0, 40.0),
            )
            - s
        )
        speed = np.abs(np.gradient(y)) / DT_S
        size = factor["overshoot"] * rng.uniform(0.0, 0.05)
        signals.append(
            s
            + size
            * low_pass(
                speed, factor["settle"] * factor["quick"] * factor["slack"] * rng.uniform(0.2, 0.6)
            )
        )
    s = np.stack(signals, axis=1)
    base = rng.uniform(1300.0, 1800.0, channels)
    gain = rng.choice([-1.0, 1.0], channels) * rng.uniform(500.0, 900.0, channels)
    return base + gain * s, s


def _stepped(y: Floats, rule: Callable[[float, float], float]) -> Floats:
    z = np.zeros(len(y))
    for k in range(1, len(y)):
        z[k] = z[k - 1] + rule(z[k - 1], y[k] - y[k - 1])
    return z


def _preisach(rng: Random, y: Floats) -> Floats:
    middle, width = rng.uniform(0.0, 1.0, 60), rng.uniform(0.03, 0.5, 60)
    state = -np.ones(60)
    out = np.empty(len(y))
    for k, value in enumerate(y):
        state[value > middle + width / 2] = 1.0
        state[value < middle - width / 2] = -1.0
        out[k] = state.mean()
    return out


def _plane(rng: Random, y: Floats) -> Floats:
    """Relays without number: their widths in groups, their middles in a bell for each."""
    out = np.zeros(len(y))
    for width in rng.uniform(0.02, 0.4, 5):
        z, played = y[0], np.empty(len(y))
        for k, value in enumerate(y):
            z = min(max(z, value - width / 2), value + width / 2)
            played[k] = z
        out += rng.uniform(0.2, 1.0) * erf((played - rng.uniform(0.1, 0.9)) / rng.uniform(0.1, 0.5))
    return out


def _fractional(rng: Random, s: Floats) -> Floats:
    order = rng.uniform(0.1, 0.35)
    weight = np.cumprod(np.concatenate([[1.0], 1.0 - (order + 1.0) / np.arange(1, len(s))]))
    return -np.asarray(fftconvolve(s - s[0], weight)[: len(s)])


def _stretched(rng: Random, s: Floats, t: Floats) -> Floats:
    share = 1.0 - np.exp(-((t / rng.uniform(2.0, 30.0)) ** rng.uniform(0.4, 0.8)))
    return np.asarray(fftconvolve(s, np.diff(share, prepend=0.0))[: len(s)]) - s


def _hodgdon(rng: Random, y: Floats) -> Floats:
    """Coleman and Hodgdon: what the branch pulls to is a curve, and loading outruns unloading."""
    pull, top = rng.uniform(3.0, 12.0), rng.uniform(0.5, 2.0)
    z = np.zeros(len(y))
    for k in range(1, len(y)):
        d = y[k] - y[k - 1]
        drawn = pull * abs(d) * (np.tanh(top * (y[k] - 0.4)) - z[k - 1])
        z[k] = z[k - 1] + drawn + (0.4 if d > 0 else 0.1) * d
    return z


def _following(s: Floats, rule: Callable[[float], float]) -> Floats:
    """How far what begins at ``s`` and goes by ``rule`` of its distance is behind."""
    z = np.zeros(len(s))
    z[0] = s[0]
    for k in range(1, len(s)):
        z[k] = z[k - 1] + rule(s[k] - z[k - 1])
    return z - s


def _eyring(rng: Random, s: Floats) -> Floats:
    """Creep that goes the faster the further it has to go."""
    tau_s, bend = rng.uniform(5.0, 30.0), rng.uniform(0.1, 0.5)
    return _following(s, lambda gone: DT_S / tau_s * bend * np.sinh(gone / bend))


def _yielding(rng: Random, s: Floats) -> Floats:
    """Norton: creep at a power of what is still to go."""
    pull, power = DT_S / rng.uniform(2.0, 20.0), rng.uniform(1.3, 2.0)
    return _following(s, lambda gone: pull * np.sign(gone) * min(abs(gone), 5.0) ** power)


def _healing(rng: Random, y: Floats) -> Floats:
    """Softening below the largest stretch, which is forgotten slowly."""
    kept, top = np.exp(-DT_S / rng.uniform(80.0, 300.0)), y.copy()
    for k in range(1, len(y)):
        top[k] = max(kept * top[k - 1], y[k])
    return (top - y) * (0.3 + y)


def _two_paces(rng: Random, n: int) -> Floats:
    """Two states that forget, one slowly and one more slowly."""
    slow = [np.exp(-DT_S / tau_s) for tau_s in (30.0, 300.0)]
    return np.asarray(sum(lfilter([1.0], [1.0, -a], rng.normal(size=n)) for a in slow))


def _flicker(rng: Random, n: int) -> Floats:
    """1/f: many slow states, each slower than the one before."""
    slow = [np.exp(-DT_S / tau_s) for tau_s in (3.0, 10.0, 30.0, 100.0, 300.0)]
    return np.asarray(
        sum(np.sqrt(1.0 - a * a) * lfilter([1.0], [1.0, -a], rng.normal(size=n)) for a in slow)
    )


def _anhysteretic(rng: Random, y: Floats) -> Floats:
    """Jiles and Atherton: pinned, it is drawn to a curve that its own state shifts."""
    width, pin, own = rng.uniform(0.1, 0.4), rng.uniform(0.05, 0.3), rng.uniform(0.0, 0.1)
    z = np.zeros(len(y))
    for k in range(1, len(y)):
        d = y[k] - y[k - 1]
        pull = np.tanh((y[k] - 0.5 + own * z[k - 1]) / width) - z[k - 1]
        z[k] = z[k - 1] + (pull * abs(d) / pin if pull * d > 0.0 else 0.0)
    return z


def _logarithmic(rng: Random, s: Floats, t: Floats) -> Floats:
    share = np.log1p(t / rng.uniform(0.3, 3.0)) / np.log1p(400.0)
    return np.asarray(fftconvolve(s, np.diff(share, prepend=0.0))[: len(s)]) - s * share[-1]


def _thixotropic(rng: Random, speed: Floats) -> Floats:
    """Structure that shear breaks faster than it heals, and heals the faster the less is left."""
    broken, heals = rng.uniform(0.5, 3.0), rng.uniform(0.5, 3.0)
    z = np.ones(len(speed))
    for k in range(1, len(speed)):
        z[k] = z[k - 1] + DT_S * (heals * (1.0 - z[k - 1]) ** 1.5 - broken * speed[k] * z[k - 1])
    return 1.0 - z


def _stops(rng: Random, y: Floats) -> Floats:
    """Prandtl: friction sliders on springs, which a bent strain stretches."""
    bent, out = y ** rng.uniform(0.6, 1.8), np.zeros(len(y))
    for yields in rng.uniform(0.02, 0.3, 6):
        pull, z = np.empty(len(y)), 0.0
        for k, d in enumerate(np.diff(bent, prepend=bent[0])):
            z = min(max(z + d, -yields), yields)
            pull[k] = z
        out += rng.uniform(0.3, 1.0) * pull
    return out


def _power_law(rng: Random, s: Floats, t: Floats) -> Floats:
    share = 1.0 - (1.0 + t / rng.uniform(0.5, 5.0)) ** -rng.uniform(0.15, 0.6)
    return np.asarray(fftconvolve(s, np.diff(share, prepend=0.0))[: len(s)]) - s


def _sloped(rng: Random, y: Floats) -> Floats:
    """Krasnosel'skii and Pokrovskii: relays that switch over a ramp and not at once."""
    middle, width = rng.uniform(0.1, 0.9, 40), rng.uniform(0.05, 0.4, 40)
    ramp = rng.uniform(0.05, 0.3)
    state, out = -np.ones(40), np.empty(len(y))
    for k, value in enumerate(y):
        up = np.clip(2.0 * (value - middle - 0.5 * width) / ramp - 1.0, -1.0, 1.0)
        down = np.clip(2.0 * (value - middle + 0.5 * width) / ramp + 1.0, -1.0, 1.0)
        state = np.minimum(np.maximum(state, up), down)
        out[k] = state.mean()
    return out


def _quasi_linear(rng: Random, s: Floats, t: Floats) -> Floats:
    """Fung: an elastic response that is curved, and relaxes alike over some decades."""
    elastic = np.expm1(rng.uniform(0.3, 1.0) * s)
    taus = np.geomspace(rng.uniform(0.3, 1.0), rng.uniform(20.0, 100.0), 12)
    share = np.mean([-np.expm1(-t / tau_s) for tau_s in taus], axis=0)
    return np.asarray(fftconvolve(elastic, np.diff(share, prepend=0.0))[: len(s)]) - elastic


def _enveloped(rng: Random, y: Floats) -> Floats:
    """Generalised Prandtl and Ishlinskii: the way up and the way down have curves of their own."""
    rise, fall = rng.uniform(1.0, 2.5, 2)
    up, down = np.tanh(rise * (y - 0.4)), np.tanh(fall * (y - 0.6))
    out = np.zeros(len(y))
    for width in np.linspace(0.03, 0.4, 7):
        z = 0.0
        for k in range(len(y)):
            z = max(up[k] - width, min(down[k] + width, z))
            out[k] += np.exp(-3.0 * width) * z
    return out


def _uneven(rng: Random, s: Floats) -> Floats:
    """Recovers more slowly than it relaxes."""
    tau_s, slower = rng.uniform(3.0, 20.0), rng.uniform(1.5, 3.0)
    return _following(s, lambda gone: DT_S / tau_s * (gone if gone > 0.0 else gone / slower))


def _endochronic(rng: Random, y: Floats) -> Floats:
    """Valanis: memory fades along the path that was gone, and the path hardens."""
    fade, hardens = rng.uniform(3.0, 8.0), rng.uniform(0.0, 0.02)
    gone = np.cumsum(np.abs(np.diff(y, prepend=y[0])))
    inner = np.log1p(hardens * gone) / hardens
    out = np.zeros(len(y))
    for term in (1.0, 4.0):
        keep = np.exp(-fade * term * np.diff(inner, prepend=0.0))
        z = np.zeros(len(y))
        for k in range(1, len(y)):
            z[k] = keep[k] * z[k - 1] + y[k] - y[k - 1]
        out += z
    return out


def _shifted(rng: Random, s: Floats, y: Floats) -> Floats:
    """Schapery: the clock of the creep runs the faster the more it is stretched."""
    tau_s, shift = rng.uniform(3.0, 20.0), rng.uniform(0.5, 1.5)
    z = np.zeros(len(s))
    z[0] = s[0]
    for k in range(1, len(s)):
        keep = np.exp(-DT_S / tau_s * np.exp(shift * (y[k] - 0.5)))
        z[k] = keep * z[k - 1] + (1.0 - keep) * s[k]
    return z - s


def _branched(rng: Random, y: Floats) -> Floats:
    """Duhem: up and down it is drawn to two curves, and climbs as they do."""
    steep, apart, draws = rng.uniform(1.5, 4.0), rng.uniform(0.05, 0.2), rng.uniform(1.0, 5.0)
    z = np.zeros(len(y))
    for k in range(1, len(y)):
        d = y[k] - y[k - 1]
        curve = np.tanh(steep * (y[k] - 0.5 - apart * np.sign(d)))
        z[k] = z[k - 1] + steep * (1.0 - curve**2) * d + draws * abs(d) * (curve - z[k - 1])
    return z


def _spread(rng: Random, s: Floats, t: Floats) -> Floats:
    """Cole and Cole: time constants spread evenly about their middle, on a log scale."""
    width, middle = rng.uniform(0.3, 0.7), rng.uniform(2.0, 15.0)
    far = np.linspace(-6.0, 6.0, 49)
    weight = 1.0 / (np.cosh((1.0 - width) * far) - np.cos(width * np.pi))
    gone = -np.expm1(-t[:, None] / (middle * np.exp(far)))
    return (
        np.asarray(fftconvolve(s, np.diff(gone @ weight / weight.sum(), prepend=0.0))[: len(s)]) - s
    )


def _damaged(rng: Random, y: Floats, top: Floats) -> Floats:
    """Ogden and Roxburgh on a neo-Hookean bar: damage by stored energy, on its stress."""

    def energy(strain: Floats) -> Floats:
        stretch = 1.0 + 0.4 * strain
        return stretch**2 + 2.0 / stretch - 3.0

    stretch = 1.0 + 0.4 * y
    scale, share = rng.uniform(0.02, 0.2), rng.uniform(0.1, 0.6)
    lost = np.tanh((energy(top) - energy(y)) / (scale + share * energy(top)))
    return lost * (stretch - stretch**-2)


def _lingering(rng: Random, speed: Floats, t: Floats) -> Floats:
    """What the strain rate stirs up dies down as a stretched exponential."""
    dies = np.exp(-((t / rng.uniform(0.2, 0.8)) ** rng.uniform(0.6, 0.9)))
    return np.asarray(fftconvolve(speed, dies)[: len(speed)])


def _bowed(share: Floats, slanted: float) -> Floats:
    """A converter whose error is a bow that leans to one side."""
    middle = 2.0 * share - 1.0
    return (1.0 - middle**2) * (1.0 + slanted * middle) ** 2


def _soaked(share: Floats) -> Floats:
    """Crank: how much water has gone into a plate, at this share of its time constant."""
    odd = np.arange(1, 40, 2)
    return 1.0 - 8.0 / np.pi**2 * (np.exp(-(np.pi**2) * share[:, None] * odd**2) / odd**2).sum(
        axis=1
    )


def _calm(rng: Random, n: int) -> Floats:
    """A level that wanders over some tens of seconds, of size 1."""
    a = np.exp(-DT_S / 20.0)
    return np.asarray(np.sqrt(1.0 - a * a) * lfilter([1.0], [1.0, -a], rng.normal(size=n)))


def _turns(y: Floats) -> Floats:
    """How often the motion has turned."""
    rate = np.gradient(y)
    moving = np.flatnonzero(np.abs(rate) > 1e-4)
    turned = moving[1:][np.diff(np.sign(rate[moving])) != 0]
    return np.cumsum(np.bincount(turned, minlength=len(y))).astype(np.float64)


def _coloured(rng: Random, n: int, exponent: float) -> Floats:
    """Noise whose power falls with this exponent of the frequency."""
    tones = np.fft.rfft(rng.normal(size=n))
    tones[1:] *= np.arange(1, len(tones)) ** (-0.5 * exponent)
    return np.fft.irfft(tones, n)


def _kinked(rng: Random, s: Floats) -> Floats:
    """A string of resistors that are not quite alike."""
    knots = np.linspace(s.min(), s.max(), 12)
    return np.interp(s, knots, np.cumsum(rng.normal(size=12)))


def shape(rng: Random, name: str, family: int, s: Floats, y: Floats, t: Floats) -> Floats:
    """What a mechanism adds to the dimensionless signal ``s`` (samples,), of any size."""
    top = np.maximum.accumulate(y)
    speed = np.abs(np.gradient(y)) / DT_S
    bend, rate = rng.uniform(4.0, 15.0), rng.uniform(0.5, 3.0)
    table: dict[str, list[Callable[[], Floats]]] = {
        "hysteresis": [
            lambda: _stepped(y, lambda z, d: d - bend * abs(d) * z - 0.3 * bend * d * abs(z)),
            lambda: (
                _stepped(y, lambda z, d: bend * d * (1.0 - z * np.sign(d)))
                if rng.random() < 0.5
                else _plane(rng, y)
            ),
            lambda: _preisach(rng, y),
            lambda: _hodgdon(rng, y),
            lambda: _anhysteretic(rng, y),
            lambda: _stops(rng, y),
            lambda: _sloped(rng, y),
            lambda: _enveloped(rng, y),
            lambda: _endochronic(rng, y),
            lambda: _branched(rng, y),
            lambda: _stepped(y, lambda z, d: bend * d * max(1.0 - z * np.sign(d), 0.0) ** 1.5),
        ],
        "relaxation": [
            lambda: _stretched(rng, s, t),
            lambda: 0.7 * (low_pass(s, rng.uniform(1, 5)) - s) + low_pass(s, 40.0) - s,
            lambda: _fractional(rng, s),
            lambda: _eyring(rng, s),
            lambda: _logarithmic(rng, s, t),
            lambda: _power_law(rng, s, t),
            lambda: _quasi_linear(rng, s, t),
            lambda: _uneven(rng, s),
            lambda: _shifted(rng, s, y),
            lambda: _spread(rng, s, t),
            lambda: _yielding(rng, s),
        ],
        "softening": [
            lambda: (1.0 - np.exp(-(top - y) * rng.uniform(1.0, 4.0))) * top,
            lambda: (top - y) * top ** rng.uniform(0.5, 1.5),
            lambda: erf((top - y) / (rng.uniform(0.2, 0.5) + 0.2 * top)) * s,
            lambda: erf((top**2 - y**2) / (0.1 + rng.uniform(0.3, 1.0) * top**2)) * y,
            lambda: -np.expm1(-rng.uniform(0.5, 3.0) * np.sqrt(np.maximum(top - y, 0.0))) * y,
            lambda: np.expm1(-top / rng.uniform(0.2, 1.5)) * s,
            lambda: np.tanh((top**2 - y**2) / (0.2 + 0.5 * top**2)) * y + rng.uniform(0, 0.3) * top,
            lambda: (1.0 - (y / np.maximum(top, 1e-3)) ** rng.uniform(1.0, 3.0)) * y,
            lambda: _damaged(rng, y, top),
            lambda: (top - y) * y / (rng.uniform(0.1, 0.5) + top),
            lambda: _healing(rng, y),
        ],
        "overshoot": [
            lambda: low_pass(speed, 0.3) + 0.5 * low_pass(speed, 1.5),
            lambda: low_pass(speed ** rng.uniform(0.6, 1.0), rng.uniform(0.2, 1.0)) * (0.5 + s),
            lambda: _broken(speed, rate) * (0.5 + s),
            lambda: (
                low_pass(np.tanh(speed / rng.uniform(0.1, 0.6)), rng.uniform(0.2, 1.2)) * (0.3 + y)
            ),
            lambda: _thixotropic(rng, speed) * (1.0 + rng.uniform(0.0, 1.0) * s),
            lambda: low_pass(
                np.maximum(speed - rng.uniform(0.02, 0.1), 0.0), rng.uniform(0.2, 1.0)
            ),
            lambda: low_pass(np.arcsinh(speed / rng.uniform(0.01, 0.1)), rng.uniform(0.2, 1.0)),
            lambda: low_pass(
                np.where(np.gradient(y) > 0.0, speed, rng.uniform(0.2, 0.6) * speed),
                rng.uniform(0.2, 1.0),
            ),
            lambda: _lingering(rng, speed, t),
            lambda: (
                low_pass(speed / (speed + rng.uniform(0.05, 0.3)), rng.uniform(0.2, 1.0))
                * (1.2 - y)
            ),
            lambda: low_pass(np.sqrt(low_pass(speed**2, rng.uniform(0.2, 0.8))), 0.3),
        ],
        "drift": [
            lambda: np.log1p(t / rng.uniform(5.0, 80.0)),
            lambda: 1.0 - np.exp(-((t / rng.uniform(60.0, 200.0)) ** 0.7)),
            lambda: (t + 1.0) ** rng.uniform(0.3, 0.7),
            lambda: t / (t + rng.uniform(30.0, 300.0)),
            lambda: 1.0 - 1.0 / np.sqrt(1.0 + t / rng.uniform(10.0, 100.0)),
            lambda: -np.expm1(-t / rng.uniform(5.0, 40.0)) - 2.0 * np.expm1(-t / 250.0),
            lambda: _soaked(t / rng.uniform(100.0, 1000.0)),
            lambda: -np.expm1(-((t / rng.uniform(80.0, 250.0)) ** 2)),
            lambda: np.tanh(t / rng.uniform(100.0, 300.0)) + rng.uniform(0.0, 0.4) * t / 400.0,
            lambda: np.log1p((t / rng.uniform(20.0, 150.0)) ** rng.uniform(0.7, 1.5)),
            lambda: np.arctan(t / rng.uniform(30.0, 200.0)),
        ],
        "gain": [
            lambda: s - s[0],
            lambda: (s - s[0]) * t,
            lambda: (s - s[0]) * np.sqrt(t),
            lambda: (s - s[0]) * (1.0 - np.exp(-t / rng.uniform(50.0, 300.0))),
            lambda: (s - s[0]) * np.log1p(np.cumsum(speed) * DT_S / rng.uniform(1.0, 20.0)),
            lambda: (s - s[0]) * np.sqrt(_turns(y)),
            lambda: (s - s[0]) * -np.expm1(-np.cumsum(speed) * DT_S / rng.uniform(5.0, 50.0)),
            lambda: (s - s[0]) * -np.expm1(-((t / rng.uniform(80.0, 250.0)) ** 1.5)),
            lambda: (s - s[0]) / (1.0 + np.exp((rng.uniform(100.0, 300.0) - t) / 40.0)),
            lambda: (s - s[0]) * (1.0 - (1.0 + t / rng.uniform(10.0, 100.0)) ** -0.5),
            lambda: (s - s[0]) * np.sqrt(np.cumsum(y**2)),
        ],
        "random_walk": [
            lambda: np.cumsum(rng.normal(size=len(t))),
            lambda: np.asarray(lfilter([1.0], [1.0, -0.9995], rng.normal(size=len(t)))),
            lambda: _flicker(rng, len(t)),
            lambda: np.cumsum(rng.standard_t(4.0, size=len(t))),
            lambda: _coloured(rng, len(t), rng.uniform(1.5, 1.9)),
            lambda: np.cumsum(rng.normal(size=len(t)) * np.exp(0.5 * _calm(rng, len(t)))),
            lambda: np.cumsum(lfilter([1.0], [1.0, -0.8], rng.normal(size=len(t)))),
            lambda: np.cumsum(rng.laplace(size=len(t)) * (rng.random(len(t)) < 0.3)),
            lambda: _coloured(rng, len(t), rng.uniform(2.0, 2.3)),
            lambda: _two_paces(rng, len(t)),
        ],
        "adc_nonlinearity": [
            lambda: np.sin(np.pi * (s - s.min()) / 4.0),
            lambda: np.sin(2.0 * np.pi * (s - s.min()) / 4.0),
            lambda: (8.0 * s / np.abs(s).max()) % 1.0,
            lambda: ((s - s.min()) / 4.0 - rng.uniform(0.2, 0.6)) ** 3,
            lambda: _kinked(rng, s),
            lambda: np.abs((6.0 * (s - s.min()) / np.ptp(s)) % 1.0 - 0.5),
            lambda: np.sum(
                rng.normal(size=(3, 1))
                * (s > s.min() + np.ptp(s) * np.array([[0.25], [0.5], [0.75]])),
                axis=0,
            ),
            lambda: _bowed((s - s.min()) / np.ptp(s), rng.uniform(-1.0, 1.0)),
            lambda: np.polynomial.chebyshev.chebval(
                2.0 * (s - s.min()) / np.ptp(s) - 1.0, [0, 0, 0, *rng.normal(size=4)]
            ),
            lambda: np.cbrt((s - s.min()) / np.ptp(s) - rng.uniform(0.3, 0.7)),
        ],
        "interference": [
            lambda: np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t),
            lambda: np.sin(2.0 * np.pi * (rng.uniform(2.0, 8.0) * t + 0.05 * np.sin(0.1 * t))),
            lambda: np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t) * (1.0 + np.sin(0.3 * t)),
            lambda: np.sign(np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t)),
            lambda: (
                np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t)
                * (np.sin(2.0 * np.pi * t / rng.uniform(30.0, 90.0)) > -0.3)
            ),
            lambda: np.sin(
                2.0 * np.pi * rng.uniform(1.0, 9.0) * t + np.cumsum(0.03 * rng.normal(size=len(t)))
            ),
            lambda: (
                np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t)
                + 0.6 * np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t)
            ),
            lambda: np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t) * np.exp(0.4 * s),
            lambda: np.sin(2.0 * np.pi * (rng.uniform(1.0, 8.0) + 0.0005 * t) * t),
            lambda: np.sin(2.0 * np.pi * rng.uniform(1.0, 9.0) * t) * (0.2 + low_pass(speed, 0.5)),
        ],
        "spikes": [
            lambda: (rng.random(len(t)) < 0.004) * rng.normal(size=len(t)),
            lambda: np.asarray(
                lfilter([1.0], [1.0, -0.3], (rng.random(len(t)) < 0.003) * rng.normal(size=len(t)))
            ),
            lambda: (rng.random(len(t)) < 0.003) * rng.exponential(size=len(t)),
            lambda: np.convolve(rng.random(len(t)) < 0.003, [1.0, -0.6, 0.2])[: len(t)],
            lambda: (rng.random(len(t)) < 0.003) * rng.choice([-2.0, -1.0, 1.0, 2.0], len(t)),
            lambda: np.convolve(rng.random(len(t)) < 0.001, [1.0, 0, 0, -1.2, 0, 0.7])[: len(t)],
            lambda: (rng.random(len(t)) < 0.002) * (s.min() - s - 0.3),
            lambda: np.convolve((rng.random(len(t)) < 0.001) * rng.normal(size=len(t)), [1.0, 1.0])[
                : len(t)
            ],
            lambda: (
                (rng.random(len(t)) < 0.003) * rng.lognormal(0.0, 0.8, len(t)) * np.sign(y - 0.5)
            ),
            lambda: np.convolve(rng.random(len(t)) < 0.001, [1.0, 0, -1.0, 0, 1.0])[: len(t)],
        ],
        "noise": [
            lambda: rng.normal(size=len(t)),
            lambda: rng.normal(size=len(t)) * (0.2 + y),
            lambda: rng.normal(size=len(t)) * (0.3 + speed),
            lambda: rng.laplace(size=len(t)) * (0.5 + y**2),
            lambda: lfilter([1.0], [1.0, -0.25], rng.normal(size=len(t))) * (1.3 - y),
            lambda: rng.normal(size=len(t)) * np.exp(0.5 * _calm(rng, len(t))),
            lambda: rng.normal(size=len(t)) * (0.3 + t / 400.0),
            lambda: rng.uniform(-1.0, 1.0, len(t)) * np.sqrt(0.2 + np.abs(s)),
            lambda: rng.standard_t(6.0, size=len(t)) * np.sqrt(0.1 + (y - 0.5) ** 2),
            lambda: rng.normal(size=len(t)) * (0.3 + low_pass(speed, 2.0)),
        ],
    }
    choices = table[name]
    return choices[-1 if family == LAST else family % (len(choices) - 1)]()


def _broken(speed: Floats, rate: float) -> Floats:
    """Conductive paths that break with the strain rate and form again."""
    z = np.zeros(len(speed))
    for k in range(1, len(speed)):
        z[k] = z[k - 1] + DT_S * (speed[k] * (1.0 - z[k - 1]) - rate * z[k - 1])
    return z


NAMES = (
    "hysteresis relaxation softening overshoot drift random_walk gain step backlash delay lag "
    "saturation adc_nonlinearity crosstalk interference spikes noise"
).split()
CHANCE = {"random_walk", "spikes", "noise"}
# In which order they act.
CHAIN = (
    "backlash delay hysteresis relaxation softening overshoot drift random_walk gain step lag "
    "saturation crosstalk interference spikes noise adc_nonlinearity"
).split()
# Mechanisms that no catalogue entry describes; the last one for the held-out half only.
FOREIGN = tuple(
    "contact load sticking ringing loose tremble touch tug bend gust knock pinch".split()
)
# Parameters that the simulator has, and may have wrong; the last one for the held-out half only.
RETUNED = tuple("relaxation tau overshoot creep late settle pace memory slow quick slack".split())


def make(seed: int, names: tuple[str, ...], excitation: str, held_out: bool) -> Case:
    """A case with the hidden effects ``names``, each 3 to 30 times the noise.

    A name may be of ``NAMES``, of ``FOREIGN``, or ``retune:`` and one of ``RETUNED``. Effects act
    one after the other, from the drive to the converter, each on what those before it made.
    """
    rng = np.random.default_rng([seed, LAST * int(held_out)])
    channels = int(rng.integers(3, 8))
    earlier, later = motion(rng, SAMPLES, excitation), motion(rng, LATER, excitation)
    x = np.concatenate([earlier, np.linspace(earlier[-1], later[0], BETWEEN), later])
    t = np.arange(len(x)) * DT_S
    physics = int(rng.integers(2**31))
    nominal, signals = sensors(np.random.default_rng(physics), x, channels)
    noise = rng.uniform(0.7, 2.2, channels)
    real = nominal.copy()
    truth, onset, unseen, seen = {}, None, False, x
    for name in sorted(names, key=lambda name: CHAIN.index(name) if name in CHAIN else -1):
        some = rng.choice(channels, int(rng.integers(1, channels + 1)), replace=False)
        everywhere = name in WIDE or rng.random() < 0.4
        chosen = np.arange(channels) if everywhere else np.sort(some)
        size = float(np.exp(rng.uniform(np.log(3.0), np.log(30.0))))
        stream = int(rng.integers(2**31))
        family = LAST if held_out and rng.random() < 0.6 else int(rng.integers(LAST))
        unseen = unseen or family == LAST
        if name in WIDE or name.startswith("retune:"):
            truth[name] = tuple(range(channels))
            change, moved = _moved(name, family, size, x, physics, channels, noise, nominal)
            real += change
            if name in WIDE:
                seen = seen + moved - x
                signals = sensors(np.random.default_rng(physics), seen, channels)[1]
            continue
        truth[name] = tuple(int(c) for c in chosen)
        if name == "step":
            onset = float(rng.uniform(80.0, 320.0)) * SAMPLES / USUAL
        for c in chosen:
            # Parameters are shared by the channels, and chance is not.
            own = np.random.default_rng([stream, c] if name in CHANCE else stream)
            if name in FOREIGN:
                change = _foreign(name, own, signals[:, c], real[:, c], seen)
                change *= size * noise[c] / _rms(change)
            else:
                change = _change(
                    name, family, own, size * noise[c], c, real, signals, seen, t, onset
                )
            real[:, c] += change
    names_ = tuple(f"s{c + 1}" for c in range(channels))

    def recorded(codes: Floats, stream: int, part: slice) -> Recording:
        noisy = codes + np.random.default_rng([seed, stream]).normal(size=codes.shape) * noise
        return Recording(
            f"case{seed}",
            names_,
            np.clip(np.rint(noisy[part]), 0, 4095).astype(np.int32),
            ("strain",),
            ("1",),
            x[part, None],
            t[: part.stop - part.start],
            tuple(FrontEnd("codes", 12) for _ in names_),
        )

    first, second = slice(0, SAMPLES), slice(SAMPLES + BETWEEN, len(x))
    return Case(
        recorded(nominal, 1, first),
        recorded(real, 2, first),
        recorded(nominal, 3, second),
        recorded(real, 4, second),
        (real - nominal)[first],
        # Rounding adds the twelfth of a code squared, twice.
        np.sqrt(2.0 * noise**2 + 1.0 / 6.0),
        truth,
        excitation,
        onset,
        unseen,
    )


def _foreign(name: str, rng: Random, s: Floats, own: Floats, x: Floats) -> Floats:
    """(samples,) what a mechanism outside any catalogue adds, of any size."""
    n = len(x)
    if name == "contact":  # comes and goes at random
        out = np.zeros(n)
        at = int(rng.exponential(20.0) / DT_S)
        while at < n:
            length = max(int(rng.exponential(3.0) / DT_S), 4)
            out[at : at + length] = 0.5 + rng.uniform(0.0, 1.0) * s[at : at + length]
            at += length + int(rng.exponential(20.0) / DT_S)
        return out
    if name == "load":  # leans on the sensor now and then
        t = np.arange(n) * DT_S
        centres = rng.uniform(0.0, t[-1], int(rng.integers(10, 30)))
        widths = rng.uniform(0.5, 3.0, len(centres))
        sizes = rng.normal(size=len(centres))
        bumps = np.exp(-0.5 * ((t[:, None] - centres) / widths) ** 2)
        return np.asarray(bumps @ sizes)
    if name == "sticking":  # the reading hangs for a while
        seen = own.copy()
        at = int(rng.exponential(8.0) / DT_S)
        while at < n:
            length = int(rng.uniform(1.0, 4.0) / DT_S)
            seen[at : at + length] = seen[at]
            at += length + int(rng.exponential(8.0) / DT_S)
        return seen - own
    if name == "loose":  # its clamp lets go of a part of the strain, and takes it again
        state, at = np.zeros(n), 0
        while at < n:
            length = int(rng.exponential(25.0) / DT_S) + 4
            state[at : at + length] = rng.uniform(0.0, 1.0)
            at += length
        return state * s
    if name == "tremble":  # something shakes it now and then
        tones = np.zeros(n)
        for _ in range(int(rng.integers(15, 40))):
            begin, length = int(rng.integers(n)), int(rng.uniform(1.0, 6.0) / DT_S)
            part = np.arange(min(length, n - begin)) * DT_S
            tones[begin : begin + len(part)] += np.sin(2.0 * np.pi * rng.uniform(0.7, 3.0) * part)
        return tones
    if name == "touch":  # a hand on it, now and then
        pressed = np.zeros(n)
        for _ in range(int(rng.integers(8, 25))):
            begin, length = int(rng.integers(n)), int(rng.uniform(2.0, 12.0) / DT_S)
            part = slice(begin, begin + length)
            pressed[part] = rng.uniform(0.4, 1.0)
        return low_pass(pressed, 0.15)
    if name == "tug":  # pulled by its cable, held, and let go
        pulled = np.zeros(n)
        for _ in range(int(rng.integers(8, 25))):
            begin = int(rng.integers(n))
            part = np.arange(min(int(rng.uniform(3.0, 15.0) / DT_S), n - begin)) * DT_S
            pulled[begin : begin + len(part)] += np.minimum(part / 2.0, 1.0) * rng.normal()
        return pulled
    if name == "bend":  # moves in another way too, that nobody logs
        tones = np.exp(rng.uniform(np.log(0.02), np.log(0.4), 10))
        phases = rng.uniform(0.0, 2.0 * np.pi, 10)
        waves = np.sin(2.0 * np.pi * tones[:, None] * np.arange(n) * DT_S + phases[:, None])
        return waves.sum(axis=0)
    if name == "gust":  # a warm breath now and then, that it gets rid of slowly
        puffs = (rng.random(n) < 0.002) * rng.exponential(size=n)
        return low_pass(low_pass(puffs, rng.uniform(5.0, 15.0)), 0.5)
    if name == "knock":  # struck now and then, and rings a little
        struck = (rng.random(n) < 0.002) * rng.normal(size=n)
        k = np.arange(40) * DT_S
        rung = np.exp(-k / 0.4) * np.cos(2.0 * np.pi * rng.uniform(0.8, 2.0) * k)
        return np.asarray(fftconvolve(struck, rung)[:n])
    if name == "pinch":  # something keeps it from going back, at times
        out = np.zeros(n)
        for _ in range(int(rng.integers(8, 25))):
            begin, length = int(rng.integers(n)), int(rng.uniform(3.0, 15.0) / DT_S)
            part = slice(begin, begin + length)
            out[part] = np.maximum(rng.uniform(0.3, 0.8) - x[part] / 0.4, 0.0)
        return out
    # ringing after some of the reversals
    rate = np.gradient(x)
    turns = np.flatnonzero(rate[1:] * rate[:-1] < 0)
    hit = np.zeros(n)
    if len(turns):
        hit[rng.choice(turns, max(len(turns) // 3, 1), replace=False)] = 1.0
    wave = np.exp(-np.arange(60) * DT_S / 0.6) * np.sin(2.0 * np.pi * 1.7 * np.arange(60) * DT_S)
    return np.asarray(fftconvolve(hit, wave)[:n])


def _rms(values: Floats) -> float:
    """Of the first recording."""
    return float(np.sqrt(np.mean(values[:SAMPLES] ** 2)))


def _moved(
    name: str,
    family: int,
    size: float,
    x: Floats,
    physics: int,
    channels: int,
    noise: Floats,
    nominal: Floats,
) -> tuple[Floats, Floats]:
    """What the same sensors read more under a moved clock, a drive with play, or with other
    parameters; and the strain that they feel.

    As large as asked, or as large as such a change gets.
    """
    low, high = 1e-4, 1.0
    index = np.arange(len(x))
    change, seen = np.zeros_like(nominal), x
    for _ in range(18):
        middle = float(np.sqrt(low * high))
        seen, more = x, None
        if name == "delay":
            drifting = {
                3: 0.5 + index / SAMPLES,
                4: 1.0 + 0.3 * np.sin(index / 900.0),
                5: 0.5 + (index / SAMPLES) ** 2,
                6: 1.2 - 0.6 * np.exp(-index / 2000.0),
                7: 0.5 + 0.3 * np.floor(index / 2300.0),  # samples get lost
                8: 0.5 + (index % 2600) / 2600.0,  # set right now and then
                9: 0.5 + np.maximum(index / SAMPLES - 0.5, 0.0),  # goes wrong half way
                LAST: 1.0 + 0.4 * np.sin(index / 400.0) * np.cos(index / 1700.0),
            }
            late = drifting.get(family, 1.0) * middle / DT_S
            seen = np.interp(index - late, index, x)
        elif name == "backlash":
            # A spring takes the play up with time.
            soft = {3: DT_S / 60.0, 4: DT_S / 20.0}.get(family, 0.0)
            seen, z = np.empty_like(x), x[0]
            for k, value in enumerate(x):
                # Worn where it is used most.
                wide = 0.2 * middle * (1.0 + value if family == 5 else 1.0)
                if family == 6:  # and more with time
                    wide *= 0.7 + 0.6 * k / SAMPLES
                if family == 7:  # teeth that are not alike
                    wide *= 1.0 + 0.3 * np.sin(30.0 * value)
                # One of its sides is worn, where it is used most.
                behind = wide * (0.4 + value) if family == 9 else wide
                stop = min(max(z, value - behind), value + wide)
                z = stop + soft * (value - stop)
                seen[k] = z
            if family == 8:  # a spring beside the play
                seen = 0.8 * seen + 0.2 * x
            if family == LAST:  # stops of rubber
                seen = seen + 0.08 * middle * np.tanh((x - seen) / (0.2 * middle))
        else:
            more = {name.removeprefix("retune:"): 1.0 + 4.0 * middle}
        rng = np.random.default_rng(physics)
        change = sensors(rng, seen, channels, more)[0] - nominal
        ratio = float(np.median([_rms(change[:, c]) / noise[c] for c in range(channels)]))
        low, high = (middle, high) if ratio < size else (low, middle)
    return change, seen


def _change(
    name: str,
    family: int,
    rng: Random,
    target: float,
    channel: int,
    codes: Floats,
    signals: Floats,
    x: Floats,
    t: Floats,
    onset: float | None,
) -> Floats:
    """(samples,) codes that the mechanism adds to ``channel``, of rms ``target``."""
    own = codes[:, channel]
    if name == "lag":

        def lagging(tau: float) -> Floats:
            late = low_pass(own, tau, 1 + family % 2)
            if family == 3:
                late = low_pass(late, 0.4 * tau)
            if family == 9:  # discharges more slowly than it charges
                rise, fall = DT_S / (tau + DT_S), DT_S / (1.5 * tau + DT_S)
                late = own + _following(own, lambda gone: gone * (rise if gone > 0.0 else fall))
            if family == LAST:  # the sensor's own resistance charges it
                taus = tau * (0.6 + 0.8 * (own - own.min()) / np.ptp(own))
                late = own.copy()
                for k in range(1, len(own)):
                    late[k] = late[k - 1] + (own[k] - late[k - 1]) * DT_S / (taus[k] + DT_S)
            if family == 8:  # a part of it comes through at once
                late = 0.85 * late + 0.15 * own
            if family == 7:  # three stages that are alike
                late = low_pass(own, 0.6 * tau, 3)
            if family == 6:  # two poles that go together, of a filter against aliasing
                poles = butter(2, min(0.3 / (np.pi * tau), 9.9), fs=1.0 / DT_S)
                late = lfilter(*poles, own - own[0]) + own[0]
            if family == 5:  # the mean of the last moments
                width = tau / DT_S
                box = np.clip(width + 1.0 - np.arange(int(width) + 2), 0.0, 1.0)
                held = np.concatenate([np.full(len(box), own[0]), own])
                late = np.convolve(held, box / box.sum())[len(box) : len(held)]
            if family == 4:  # a line of many small resistors and capacitors
                late = low_pass(low_pass(low_pass(own, tau), tau / 9.0), tau / 25.0)
            return late - own

        low, high = 0.003, 3.0
        for _ in range(20):
            tau = float(np.sqrt(low * high))
            low, high = (tau, high) if _rms(lagging(tau)) < target else (low, tau)
        return lagging(low)
    if name == "saturation":
        for share in np.linspace(0.98, 0.4, 60):
            level = own.min() + share * np.ptp(own)
            soft = 0.04 * np.ptp(own) * (family > 0) + 1e-9
            over = (own - level) / soft
            change = -soft * np.logaddexp(0.0, over)
            if family == 3:  # a tenth of what is above comes through
                change = -0.9 * np.maximum(own - level, 0.0)
            if family == 9:  # at both of its ends
                low = own.min() + 0.3 * (own.max() - level)
                change = np.clip(own, low, level) - own
            if family == LAST:  # the logarithm of what is above
                above, room = np.maximum(own - level, 0.0), 0.05 * np.ptp(own)
                change = room * np.log1p(above / room) - above
            if family == 8:  # its last part is bent to a limit
                above, room = np.maximum(own - level, 0.0), 0.15 * np.ptp(own)
                change = room * np.tanh(above / room) - above
            if family == 7:  # a supply that sags
                change = -np.maximum(own - level + 0.06 * np.ptp(own) * t / t[-1], 0.0)
            if family == 6:  # an amplifier that comes to its end
                top = level + 0.1 * np.ptp(own)
                base = own.min() - 1.0
                bent = (own - base) / (top - base)
                change = (top - base) * bent * ((1.0 + bent**8) ** (-1 / 8) - 1.0)
            if family == 5:  # a wide knee
                change = -3.0 * soft * np.logaddexp(0.0, over / 3.0)
            if family == 4:  # less and less comes through
                above, room = np.maximum(own - level, 0.0), 0.1 * np.ptp(own)
                change = above / (1.0 + above / room) - above
            if _rms(change) >= target:
                break
        return change
    if name == "crosstalk":
        change = codes[:, channel - 1] - own
        if family == 1:  # beside its own, and not instead
            change = codes[:, channel - 1] - codes[0, channel - 1]
        if family == 3:  # a shared supply
            change = codes.mean(axis=1) - own
        if family == 9:  # the more, the higher its own resistance is
            change *= 0.4 + (own - own.min()) / np.ptp(own)
        if family == LAST:  # of both neighbours
            after = codes[:, (channel + 1) % codes.shape[1]]
            change = 0.7 * codes[:, channel - 1] + 0.3 * after - own
        if family == 8:  # a little of every other
            mixed = np.random.default_rng(channel).uniform(0.2, 1.0, codes.shape[1])
            change = codes @ mixed / mixed.sum() - own
        if family == 7:  # through a capacitor
            change = codes[:, channel - 1] - low_pass(codes[:, channel - 1], 1.0)
        if family == 6:  # as the converter had it at its last turn
            change = np.append(codes[0, channel - 1], codes[:-1, channel - 1]) - own
        if family == 5:  # as its wire has it a moment later
            change = low_pass(codes[:, channel - 1], 0.15) - own
        if family == 4:  # and a part of the one before that
            change = change + 0.3 * (codes[:, channel - 2] - codes[:, channel - 1])
        # No converter hears more of another channel than of its own.
        return change * min(target / _rms(change), 0.5)
    if name == "step":
        since = np.maximum(t - (onset or 0.0), 0.0)
        change = (since > 0.0) * (1.0 + 0.3 * (family % 3) * signals[:, channel])
        if family == 3:  # heals in part
            change *= 0.5 + 0.5 * np.exp(-since / 40.0)
        if family == 9:  # comes back with the logarithm of time
            change *= 1.0 - 0.1 * np.log1p(since / 2.0)
        if family == LAST:  # swings into its place
            change *= 1.0 + 0.5 * np.exp(-since / 4.0) * np.cos(1.5 * since)
        if family == 8:  # goes in two blows
            change *= 0.6 + 0.4 * (since > 3.0)
        if family == 7:  # slips once more
            change *= 1.0 + 0.5 * (since > 25.0)
        if family == 6:  # gives way a little more
            change *= 1.0 - 0.4 * np.exp(-since / 15.0)
        if family == 5:  # loses some of its sensitivity
            change = (since > 0.0) * (signals[:, channel] + 0.1)
        if family == 4:  # tears over some seconds
            change *= np.minimum(since / 4.0, 1.0)
    else:
        # A converter sees what has become of the signal.
        seen = (own - own[0]) / 700.0 if name == "adc_nonlinearity" else signals[:, channel]
        change = shape(rng, name, family, seen, x / 0.4, t)
        if name not in ("noise", "spikes"):
            change = change - change[0]
    return change * target / _rms(change)
