"""Made cases of a sim-to-real gap: a soft gripper's finger with sensors of carbon-black silicone
and liquid metal.

Written from the literature on rubber and on soft sensors, apart from the toolkit and from the other
makers of cases. In physical order: motion, material (0 at rest, about 1 where it is bent most),
divider, circuits, converter; codes rise or fall as it bends. Of one timeline: the first recording,
some minutes of rest that nobody records, the second recording. Every effect is sized by bisection
on the first recording, given the effects before it in that order.
"""

from __future__ import annotations

import numpy as np
from cases import NAMES, Case, converted
from scipy.signal import bessel, cont2discrete, fftconvolve, lfilter
from scipy.special import erf

__all__ = ["EQUATIONS", "FOREIGN", "NAMES", "RETUNED", "drawn", "make"]

DT, N1, N2 = 0.05, 8000, 4000
LOW, HIGH = 3.0, 30.0  # rms of what an effect adds, in rms of the channel's noise

EQUATIONS = {
    "backlash": ["play", "dead_zone", "compliant_play", "wearing_play"],
    "delay": ["constant", "skew", "scan_order", "warming_clock"],
    "softening": ["ogden_roxburgh", "elias_zuniga", "dorfmann_ogden", "damage"],
    "hysteresis": ["preisach", "dahl", "bouc_wen", "maxwell_slip"],
    "relaxation": ["prony", "fractional_zener", "stretched", "schapery", "logarithmic"],
    "overshoot": ["filtered_speed", "network_kinetics", "kraus", "two_time", "speed_peak"],
    "gain": ["wrong", "linear_ageing", "root_cycles", "log_cycles", "saturating_ageing"],
    "drift": ["log", "exponential", "power", "two_exponentials", "fick"],
    "random_walk": ["brown", "ornstein_uhlenbeck", "flicker", "fractional_brown"],
    "step": ["jump", "jump_and_gain", "partial_recovery", "gain_only"],
    "lag": ["one_pole", "two_unequal", "bessel", "moving_average"],
    "saturation": ["hard", "softplus", "tanh_knee", "compressed"],
    "crosstalk": ["leak", "charge_sharing", "source_settling", "supply_sag", "two_back"],
    "interference": ["tone", "folded_harmonics", "wandering", "beating"],
    "spikes": ["poisson_decay", "single_sample", "doublets", "clusters"],
    "noise": ["level", "with_signal", "with_speed", "regimes"],
    "adc_nonlinearity": ["bow", "skewed_s", "sar_weights", "missing_codes", "sub_ranging"],
    # no entry of the catalogue
    "contact": [
        "grasp_wrap"
    ],  # the finger touches things in some grasps: extra local strain above a level
    "payload": ["trapezoids"],  # weights picked up and put down, not logged
    "twist": ["second_axis"],  # another degree of freedom that moves on its own
    "stick_slip": ["creak"],  # sawtooth over the distance travelled
    "ringing": ["knocked_mode"],  # a lightly damped mode of the finger, knocked and accelerated
    "telegraph": ["popcorn"],  # contact resistance jumps between two levels, again and again
    "range_flips": ["two_gains"],  # the amplifier changes between two gains at random
    "frozen": ["held_samples"],  # a stuck bus repeats the last sample
}
RETUNED: tuple[str, ...] = ()
FOREIGN = (
    "contact",
    "payload",
    "twist",
    "stick_slip",
    "ringing",
    "telegraph",
    "range_flips",
    "frozen",
)
MATERIAL = (
    *("softening", "hysteresis", "relaxation", "overshoot", "gain", "drift", "random_walk", "step"),
    *("contact", "payload", "twist", "stick_slip", "ringing"),
)
ELECTRICAL = (
    "telegraph",
    "range_flips",
    "lag",
    "saturation",
    "crosstalk",
    "interference",
    "spikes",
    "noise",
)
DIGITAL = ("adc_nonlinearity", "frozen")
ORDER = ("backlash", "delay", *MATERIAL, *ELECTRICAL, *DIGITAL)
WIDE = ("backlash", "delay")


def stream(seed, *purpose):
    return np.random.default_rng([seed, *purpose])


def drawn(seed: int, name: str) -> str:
    labels = EQUATIONS[name]
    return labels[stream(seed, 100, ORDER.index(name)).integers(len(labels))]


def logu(rng, low, high, size=None):
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def rms(a):
    return np.sqrt(np.mean(np.square(a), axis=0))


# ---------------------------------------------------------------- motion
def go(start, end, samples, kind):
    u = np.arange(1, samples + 1) / samples
    if kind == "jerk":
        u = u**3 * (10 - 15 * u + 6 * u * u)
    elif kind == "cosine":
        u = 0.5 - 0.5 * np.cos(np.pi * u)
    return start + (end - start) * u


def motion(rng, n, excitation, first):
    """Bend 0 … 1 of the finger, nominal, from rest."""
    parts, at, length = [np.zeros(4)], 0.0, 4

    def move(end, seconds, kind):
        nonlocal at, length
        parts.append(go(at, end, max(round(seconds / DT), 2), kind))
        at, length = end, length + len(parts[-1])

    def cycle(high, low, seconds, kind):
        move(high, seconds, kind)
        move(low, seconds, kind)

    def hold(seconds):
        move(at, seconds, "line")

    if excitation == "rich":
        for top in (0.25, 0.45, 0.65, 0.85, 1.0) if first else (0.5, 0.95):
            cycle(top, 0.0, top / logu(rng, 0.1, 0.5), "line")
        while length < n:
            pick = rng.choice(["hold", "move", "loops", "sine"], p=[0.25, 0.45, 0.15, 0.15])
            if pick == "hold":
                hold(rng.uniform(3, 14))
            elif pick == "move":
                kind = rng.choice(["line", "jerk", "cosine"])
                for _ in range(rng.integers(1, 5)):
                    end = rng.uniform(0, 1)
                    move(end, max(logu(rng, 0.4, 9), 0.3 * abs(end - at)), kind)
            elif pick == "loops":  # nested minor loops
                middle, half, seconds = (
                    rng.uniform(0.35, 0.65),
                    rng.uniform(0.2, 0.34),
                    logu(rng, 0.8, 5),
                )
                for part in (1, 0.7, 0.45):
                    cycle(middle + half * part, middle - half * part, seconds, "line")
            else:
                middle, half, seconds = (
                    rng.uniform(0.3, 0.7),
                    rng.uniform(0.1, 0.3),
                    logu(rng, 0.6, 3),
                )
                for _ in range(rng.integers(2, 6)):
                    cycle(middle + half, middle - half, seconds, "cosine")
    elif excitation == "typical":  # pick and place
        while length < n:
            hold(rng.uniform(0.5, 3) if rng.random() > 0.1 else rng.uniform(6, 15))
            top, pre = (
                rng.choice([0.45, 0.6, 0.8, 1.0]) * rng.uniform(0.93, 1.0),
                rng.uniform(0.1, 0.25),
            )
            if rng.random() < 0.5:  # pre-shape, then close
                move(pre, rng.uniform(0.4, 1.0), "jerk")
                hold(rng.uniform(0.2, 1))
            move(top, rng.uniform(0.5, 1.6), "jerk")
            for _ in range(rng.integers(1, 4)):
                hold(rng.uniform(0.8, 4))
                move(
                    float(np.clip(top + rng.uniform(-0.08, 0.05), 0, 1)),
                    rng.uniform(0.2, 0.6),
                    "jerk",
                )
            hold(rng.uniform(0.5, 3))
            move(rng.uniform(0, 0.06), rng.uniform(0.5, 1.4), "jerk")
    else:  # one cycle, again and again
        kind, seconds = rng.choice(["line", "cosine"]), logu(rng, 6, 20)
        top = 1.0 if first else rng.uniform(0.75, 0.95)
        while length < n:
            cycle(top, 0.0, seconds, kind)
    return np.concatenate(parts)[:n]


# ---------------------------------------------------------------- the nominal device
class World:
    """One device, its motion and its nominal model."""

    def __init__(self, seed, excitation):
        rng = stream(seed, 1, ("rich", "typical", "poor").index(excitation))
        one, two = motion(rng, N1, excitation, True), motion(rng, N2, excitation, False)
        two *= min(1.0, one.max() / two.max())
        gap = int(rng.integers(2400, 4800))  # back to rest, and rest
        self.x0 = np.concatenate([one, go(one[-1], 0.0, 40, "jerk"), np.zeros(gap - 40), two])
        self.samples, self.second = len(self.x0), N1 + gap
        self.t = np.arange(self.samples) * DT
        rng = stream(seed, 2)
        self.full = rng.uniform(0.25, 0.4)  # strain at full bend
        n = self.channels = int(rng.integers(3, 8))
        self.noise = rng.uniform(0.5, 2.5, n)
        while True:
            reach = logu(
                rng, np.maximum(250, 320 / self.noise), np.minimum(1500, 1500 / self.noise)
            )
            self.span = self.noise * reach * rng.choice([1, -1], n, p=[0.7, 0.3])
            if np.all(np.abs(self.span - np.roll(self.span, 1)) > 0.25 * np.abs(self.span)):
                break
        low = rng.uniform(950, np.maximum(3100 - np.abs(self.span), 960))
        self.rest = np.where(self.span > 0, low, low + np.abs(self.span))
        self.bend = rng.uniform(0.02, 0.12, n)  # curvature of the divider
        self.kinds = rng.choice(["liquid_metal", "percolation", "tunnel", "fibre", "fading"], n)
        self.shape = rng.uniform(0, 1, n)
        self.local = rng.uniform(0, 0.12, n)  # s: outer segments bend later
        self.relax, self.relax_tau = rng.uniform(-0.02, 0.09, n), logu(rng, 2, 20, n)
        self.loop, self.radius = rng.uniform(-0.02, 0.05, n), rng.uniform(0.02, 0.1)

    def static(self, x):
        out = np.empty_like(x)
        for k, kind in enumerate(self.kinds):
            u, c = x[:, k], self.shape[k]
            a = (0.2 + 0.25 * c) if kind == "percolation" else (0.4 + 0.9 * c)
            if kind == "liquid_metal":  # R = rho l / A at constant volume
                out[:, k] = ((1 + self.full * u) ** 2 - 1) / ((1 + self.full) ** 2 - 1)
            elif kind == "percolation":  # (p - p_c)^-mu with strain
                out[:, k] = ((1 - a * u) ** -1.7 - 1) / ((1 - a) ** -1.7 - 1)
            elif kind == "tunnel":
                out[:, k] = np.expm1(a * u) / np.expm1(a)
            elif kind == "fibre":
                out[:, k] = u + (0.8 * c - 0.4) * np.sin(2 * np.pi * u) / (2 * np.pi)
            else:
                out[:, k] = np.expm1(-a * u) / np.expm1(-a)
        return out

    def nominal(self, x):
        """m (samples, channels) for a bend x (samples,)."""
        m = self.static(pole(np.repeat(x[:, None], self.channels, 1), self.local))
        lagging = play(x, self.radius) - x
        return m + self.relax * (m - pole(m, self.relax_tau)) + self.loop * lagging[:, None]

    def divider(self, m):
        return self.rest + self.span * (m * (1 + self.bend) / (1 + self.bend * m))


def pole(v, tau):
    """1 / (1 + tau p) of each column, exact for straight lines between samples."""
    out = v.copy()
    for k, one in enumerate(np.broadcast_to(tau, v.shape[1:])):
        if one > 1e-4:
            a = np.exp(-DT / one)
            b1 = (1 - a) * one / DT - a
            out[:, k] = lfilter([1 - a - b1, b1], [1, -a], v[:, k], zi=[(b1 + a) * v[0, k]])[0]
    return out


def play(x, radius):
    """Play operator; ``radius`` a number or one per sample."""
    y, out = 0.0, []
    radii = np.broadcast_to(radius, x.shape)
    for high, low in zip((x + radii).tolist(), (x - radii).tolist(), strict=False):
        if y > high:
            y = high
        elif y < low:
            y = low
        out.append(y)
    return np.array(out)


def shifted(v, delay_s):
    """v(t - delay) by four-point interpolation, v(0) before the start."""
    at = np.arange(len(v))[:, None] - delay_s / DT
    whole = np.floor(at).astype(int)
    u = at - whole
    taps = (
        -u * (u - 1) * (u - 2) / 6,
        (u + 1) * (u - 1) * (u - 2) / 2,
        -(u + 1) * u * (u - 2) / 2,
        (u + 1) * u * (u - 1) / 6,
    )
    columns = np.arange(v.shape[1])
    return sum(w * v[np.clip(whole + i - 1, 0, len(v) - 1), columns] for i, w in enumerate(taps))


# ---------------------------------------------------------------- effects on the motion
def backlash(label, rng, w):
    share = rng.uniform(0.15, 0.45)
    path = np.cumsum(np.abs(np.diff(w.x0, prepend=0)))
    wear = 0.5 + path / path[N1 - 1]

    def f(p, n):
        x = w.x0[:n]
        if label == "play":
            return play(x, p)
        if label == "dead_zone":
            return np.maximum(x - p, 0)
        if label == "compliant_play":
            return share * x + (1 - share) * play(x, p)
        return play(x, p * wear[:n])

    return f, 2e-4, 0.35


def delay(label, rng, w):
    slope, scan, tau = rng.uniform(0.5, 2.5), rng.uniform(0.03, 0.12), rng.uniform(60, 200)
    since = np.where(np.arange(w.samples) < w.second, w.t, w.t - w.t[w.second])[:, None]
    if label == "constant":
        d = np.ones((w.samples, 1))
    elif label == "skew":  # clocks are set equal at the start of each recording
        d = 0.3 + slope * since / (N1 * DT)
    elif label == "scan_order":
        d = np.ones((w.samples, 1)) + scan * np.arange(w.channels)
    else:
        d = 0.4 + 1.2 * (1 - np.exp(-since / tau))
    return d, 1e-3, 3.0


# ------------------------------------------------- effects of the material: h, added p * h
def around(rng, centre, n, spread=0.15):
    return centre * np.exp(spread * rng.standard_normal(n))


def without_static(h, x):
    """What of h is no smooth static function of x."""
    u = np.clip(x, 0, x[:N1].max()) / x[:N1].max()
    basis = np.polynomial.chebyshev.chebvander(2 * u - 1, 6)
    return h - basis @ np.linalg.lstsq(basis[:N1], h[:N1], rcond=None)[0]


def hysteresis(label, rng, w, m):
    x, n = w.x, w.channels
    moved = np.diff(x, prepend=0.0)
    steps = np.flatnonzero(np.abs(moved) > 1e-9)
    h = np.zeros((w.samples, n))
    if label == "preisach":
        count = 3000
        middle, half = rng.uniform(-0.2, 1.2, count), rng.gamma(1.5, rng.uniform(0.04, 0.1), count)
        up, down = middle + half, middle - half
        weights = (
            rng.gamma(2, 1, count)[:, None]
            * np.exp(0.2 * rng.standard_normal((1, n)))
            * (1 + around(rng, 0.8, n, 0.3) * np.clip(middle, 0, 1)[:, None])
        )
        by_up, by_down = np.argsort(up), np.argsort(down)
        ups, downs = up[by_up], down[by_down]
        z = np.where(up <= 0, 1.0, -1.0)
        total, at = z @ weights, 0.0
        change = np.zeros((w.samples, n))
        for i in steps:
            if moved[i] > 0:
                s, new = (
                    by_up[np.searchsorted(ups, at, "right") : np.searchsorted(ups, x[i], "right")],
                    1.0,
                )
            else:
                s, new = by_down[np.searchsorted(downs, x[i]) : np.searchsorted(downs, at)], -1.0
            s = s[z[s] != new]
            if len(s):
                change[i] = 2 * new * weights[s].sum(0)
                z[s] = new
            at = x[i]
        h = total + np.cumsum(change, 0)
    elif label == "maxwell_slip":
        yields = np.geomspace(0.015, rng.uniform(0.25, 0.6), 9)
        z, states = np.zeros(9), np.zeros((w.samples, 9))
        for i in range(w.samples):
            if moved[i]:
                z = np.minimum(np.maximum(z + moved[i], -yields), yields)
            states[i] = z
        stiff = yields ** -rng.uniform(0.3, 1.2)
        h = states @ (stiff[:, None] * np.exp(0.25 * rng.standard_normal((9, n))))
    else:
        width = around(rng, logu(rng, 0.05, 0.2), n)
        power = rng.uniform(0.8, 1.8) if label == "dahl" else rng.uniform(1, 2.2)
        beta = rng.uniform(0.5, 0.85)
        z, last = np.zeros(n), 0
        for i in steps:
            h[last:i] = z
            sign = np.sign(moved[i])
            parts = int(np.ceil(abs(moved[i]) / (0.3 * width.min())))
            d = abs(moved[i]) / parts / width
            for _ in range(parts):
                if label == "dahl":
                    z = np.clip(z + d * sign * np.maximum(1 - sign * z, 0) ** power, -1, 1)
                else:
                    z = z + d * (
                        sign - np.abs(z) ** power * (beta * np.sign(z) + (1 - beta) * sign)
                    )
            last = i
        h[last:] = z
    return without_static(h, x)


def relaxation(label, rng, w, m):
    n, sign = w.channels, rng.choice([1, -1], p=[0.8, 0.2])
    h = np.zeros_like(m)
    if label in ("prony", "fractional_zener"):
        if label == "prony":
            taus = np.array([1, 8, 60]) * logu(rng, 0.8, 2, 3)
            weights = rng.dirichlet([2, 2, 2])
        else:  # Cole-Cole spectrum of a Mittag-Leffler relaxation
            alpha, centre = rng.uniform(0.35, 0.7), logu(rng, 3, 30)
            taus = np.geomspace(0.1, 2000, 22)
            u = np.log(taus / centre)
            weights = np.sin(np.pi * alpha) / (np.cosh(alpha * u) + np.cos(np.pi * alpha))
        stretch = around(rng, 1, n)
        for tau, weight in zip(taus, weights / weights.sum(), strict=False):
            h += weight * (m - pole(m, tau * stretch))
        return sign * h
    taus = around(rng, logu(rng, 3, 30), n)
    beta, level, late = rng.uniform(0.35, 0.7), rng.uniform(0.5, 2), rng.uniform(0.2, 0.6)
    for k, tau in enumerate(taus):
        s = m[:, k]
        if label == "stretched":
            phi = np.exp(-((w.t / tau) ** beta))
        elif label == "logarithmic":  # Guiu and Pratt
            phi = np.maximum(1 - np.log1p(w.t / (0.1 * tau)) / np.log1p(300 / (0.1 * tau)), 0)
        else:  # Schapery: the stress that relaxes grows faster than the strain
            s = s * (1 + level * s)
            phi = (1 - late) * np.exp(-w.t / tau) + late * np.exp(-w.t / (6 * tau))
        h[:, k] = fftconvolve(np.diff(s, prepend=s[0]), phi)[: w.samples]
        if label == "schapery":
            h[:, k] *= 1 + 0.3 * level * m[:, k]
    return sign * h


def overshoot(label, rng, w, m):
    n = w.channels
    speed = np.abs(np.gradient(w.x)) / DT
    tau, rise = around(rng, logu(rng, 0.3, 2.5), n), rng.uniform(-0.3, 1.0)
    power, strength = rng.uniform(0.6, 1.0), logu(rng, 0.4, 1.5)
    fade = np.exp(-DT / tau)
    y, out = np.zeros(n), np.zeros((w.samples, n))
    if label in ("filtered_speed", "two_time"):
        each = np.repeat(speed[:, None], n, 1)
        out = pole(each, tau)
        if label == "two_time":
            out = 0.7 * pole(each**power, 0.35 * tau) + 0.3 * pole(each**power, 1.6 * tau)
    elif label == "network_kinetics":  # bonds break with speed and form again
        for i, v in enumerate(speed):
            rate = 1 / tau + strength * v
            goal = strength * v / rate
            y = goal + (y - goal) * np.exp(-rate * DT)
            out[i] = y
    elif label == "kraus":  # breaking as |v|^p, forming again in second order
        for i, v in enumerate(speed**power):
            for _ in range(2):
                y = np.clip(
                    (y + 0.5 * DT * strength * v * (1 - y)) / (1 + 0.5 * DT * (0.6 + 3 * y) / tau),
                    0,
                    1,
                )
            out[i] = y
    else:  # broken at once, formed again exponentially
        for i, v in enumerate(speed**power):
            y = np.maximum(v, y * fade)
            out[i] = y
    return out * (1 + rise * m)


def softening(label, rng, w, m):
    n, sign = w.channels, rng.choice([-1, 1], p=[0.7, 0.3])
    x = np.maximum(w.x, 0)[:, None]
    top = np.maximum.accumulate(x, 0)
    width, beta = around(rng, logu(rng, 0.08, 0.4), n), rng.uniform(0, 0.3)
    if label == "ogden_roxburgh":
        return sign * m * erf((top**2 - x**2) / (width + beta * top**2)), 0.7
    if label == "dorfmann_ogden":
        return sign * m * np.tanh((top**1.5 - x**1.5) / (width + beta * top)), 0.7

    def factor(p, rows):
        if label == "elias_zuniga":
            return np.exp(-p * np.sqrt(top[:rows] - x[:rows])) - 1
        scale = 0.3 + width  # continuum damage with the largest energy; the virgin curve stays
        whole = [1 - p * (1 - np.exp(-(e[:rows] ** 2) / scale)) for e in (top, x)]
        return whole[0] / whole[1] - 1

    def f(p, rows):
        return m[:rows] - sign * m[:rows] * factor(p, rows)

    return f, 0.9 if label == "damage" else 2.0


def gain(label, rng, w, m):
    path = np.cumsum(np.abs(np.diff(w.x, prepend=0)))[:, None] / 2
    tau, cycles = rng.uniform(100, 400), rng.uniform(1, 6)
    t = w.t[:, None]
    grown = {
        "wrong": np.ones_like(t),
        "linear_ageing": t / 400,
        "root_cycles": np.sqrt(path / 40),
        "log_cycles": np.log1p(path / cycles),
        "saturating_ageing": 1 - np.exp(-t / tau),
    }[label]
    return rng.choice([-1, 1]) * m * grown


def drift(label, rng, w, m):
    n, t = w.channels, w.t[:, None]
    tau = around(rng, 1.0, n)
    if label == "log":
        h = np.log1p(t / (tau * logu(rng, 3, 60)))
    elif label == "exponential":
        h = 1 - np.exp(-t / (tau * rng.uniform(60, 300)))
    elif label == "power":
        h = (t / 400) ** np.clip(rng.uniform(0.3, 0.9) * tau, 0.25, 1.1)
    elif label == "two_exponentials":
        h = 0.4 * (1 - np.exp(-t / (tau * rng.uniform(10, 40)))) + 0.6 * (
            1 - np.exp(-t / (tau * rng.uniform(200, 800)))
        )
    else:  # water uptake of a sheet
        far = np.array([1, 3, 5, 7, 9, 11])
        d = np.pi**2 / (4 * tau * rng.uniform(200, 1500))
        h = 1 - sum(8 / (np.pi * k) ** 2 * np.exp(-(k**2) * d * t) for k in far)
        h = h - h[0]
    return h * rng.choice([-1, 1]) * np.where(rng.random(n) < 0.2, -1, 1)


def spectral(rng, samples, columns, slope, corner=None):
    """Gaussian, power as f^-slope above 1 / (2 timelines)."""
    f = np.fft.rfftfreq(2 * samples, DT)
    amplitude = np.zeros_like(f)
    amplitude[1:] = f[1:] ** (-slope / 2)
    if corner:
        amplitude /= 1 + (f / corner) ** 2
    white = rng.standard_normal((len(f), columns)) + 1j * rng.standard_normal((len(f), columns))
    return np.fft.irfft(white * amplitude[:, None], axis=0)[:samples]


def random_walk(label, rng, w, m):
    n, T = w.channels, w.samples
    if label == "brown":
        return np.cumsum(rng.standard_normal((T, n)), 0)
    if label == "ornstein_uhlenbeck":
        a = np.exp(-DT / rng.uniform(25, 120))
        return lfilter([np.sqrt(1 - a * a)], [1, -a], rng.standard_normal((T, n)), axis=0)
    if label == "flicker":
        return spectral(rng, T, n, 1.0, 0.1)
    h = spectral(rng, T, n, 2 * rng.uniform(0.3, 0.75) + 1, 1.0)
    return h - h[0]


def step(label, rng, w, m):
    n = w.channels
    w.onset = round(int(rng.uniform(0.15, 0.85) * N1) * DT, 3)
    on = (w.t >= w.onset - 1e-9)[:, None]
    sign = rng.choice([-1, 1], n)
    if label == "jump":
        return sign * on * np.ones_like(m)
    if label == "jump_and_gain":
        return sign * on * (1 + around(rng, rng.choice([-1, 1]) * rng.uniform(0.3, 0.8), n) * m)
    if label == "gain_only":
        return sign * on * m
    kept, tau = rng.uniform(0.4, 0.7), around(rng, rng.uniform(8, 50), n)
    return sign * on * (kept + (1 - kept) * np.exp(-np.maximum(w.t[:, None] - w.onset, 0) / tau))


def intervals(rng, w, pause, length):
    """Starts and ends (samples) of random stretches over the timeline."""
    at, out = 0.0, []
    while True:
        at += rng.uniform(*pause)
        end = at + rng.uniform(*length)
        if at >= w.t[-1]:
            return out
        out.append((int(at / DT), int(min(end, w.t[-1]) / DT)))
        at = end


def foreign(name, rng, w, m):
    n, T = w.channels, w.samples
    h = np.zeros((T, n))
    gains = around(rng, 1, n, 0.3)
    if name == "contact":
        for a, b in intervals(rng, w, (3, 20), (4, 20)):
            touch, hard = rng.uniform(0.1, 0.6), rng.uniform(0.4, 1.6)
            h[a:b] += hard * np.maximum(w.x[a:b] - touch, 0)[:, None] ** 0.8
        return pole(h * gains, 0.08)
    if name == "payload":
        for a, b in intervals(rng, w, (2, 15), (3, 20)):
            h[a:b] += rng.uniform(0.4, 1.5)
        return pole(pole(h * gains, 0.15), 0.15)
    if name == "twist":
        other = motion(rng, T, "rich", False)[:, None] - 0.4
        return other * (around(rng, 0.5, n, 0.3) + m) * rng.choice([-1, 1], n)
    if name == "stick_slip":
        path = np.cumsum(np.abs(np.diff(w.x, prepend=0)))
        slips = np.cumsum(around(rng, rng.uniform(0.05, 0.12), int(path[-1] / 0.03) + 50, 0.3))
        i = np.searchsorted(slips, path, "right")
        start = np.concatenate([[0], slips])[i]
        return ((path - start) / (slips[i] - start) - 0.5)[:, None] * gains
    if name == "ringing":
        f, damping = rng.uniform(1.2, 4), rng.uniform(0.02, 0.06)
        drive = np.gradient(np.gradient(w.x)) * 20
        drive = drive + (rng.random(T) < DT * 0.12) * rng.choice([-1, 1], T) * rng.uniform(
            0.5, 1.5, T
        )
        r, angle = np.exp(-2 * np.pi * f * damping * DT), 2 * np.pi * f * DT
        return lfilter([1.0], [1, -2 * r * np.cos(angle), r * r], drive)[:, None] * gains
    if name == "telegraph":
        for a, b in intervals(rng, w, (2, 12), (0.5, 9)):
            h[a:b] = 1.0
        return h * gains * rng.choice([-1, 1], n)
    for a, b in intervals(rng, w, (6, 35), (6, 35)):  # range_flips
        h[a:b] = 1.0
    return h * (m - w.rest) * rng.choice([-1, 1])


# ---------------------------------------------------------------- electrical, on codes
def lag(label, rng, w, v):
    ratio = around(rng, rng.uniform(0.15, 0.5), w.channels)
    uneven = around(rng, 1, w.channels, 0.1)

    def f(p, rows):
        s, tau, out = v[:rows], p * uneven, v[:rows].copy()
        if label == "one_pole":
            return pole(s, tau)
        if label == "two_unequal":
            return pole(pole(s, tau), tau * ratio)
        for k in np.flatnonzero(p > 0):
            if label == "bessel":
                b, a = bessel(3, 1 / tau[k], analog=True, norm="delay")
                b, a, _ = cont2discrete((b, a), DT, "foh")
                out[:, k] = lfilter(b.ravel(), a, s[:, k] - s[0, k]) + s[0, k]
            else:
                length = 2 * tau[k]
                padded = np.concatenate([np.full(200, s[0, k]), s[:, k]])
                area = np.concatenate([[0], np.cumsum(padded[1:] + padded[:-1])]) * DT / 2
                out[:, k] = ((area[:, None] - shifted(area[:, None], length)) / length)[200:, 0]
        return out

    return f, 3e-3, 3.0


def saturation(label, rng, w, v):
    top = v[:N1].max(0)
    q = around(rng, rng.uniform(0.3, 0.8), w.channels)
    slope = np.clip(around(rng, rng.uniform(0.05, 0.3), w.channels), 0, 0.5)

    def f(p, rows):
        s, on = v[:rows], p > 0
        depth = np.where(on, p, 1.0)
        knee, above = top - depth, s - (top - depth)
        if label == "hard":
            out = np.minimum(s, knee)
        elif label == "softplus":
            out = knee - q * depth * np.logaddexp(0, -above / (q * depth))
        elif label == "tanh_knee":
            out = np.where(above > 0, knee + q * depth * np.tanh(above / (q * depth)), s)
        else:
            out = np.where(above > 0, knee + slope * above, s)
        return np.where(on, out, s)

    return f, 0.5, 1000.0


def crosstalk(label, rng, w, v):
    own = v - w.rest
    before, earlier = np.roll(own, 1, 1), np.roll(own, 2, 1)
    if label == "leak":
        return before, 0.6
    if label == "charge_sharing":
        return before - own, 0.6  # part of the last charge stays on the capacitor
    if label == "source_settling":  # settling slower the higher the source resistance
        m = np.abs(own) / np.abs(w.span)
        return (before - own) * np.exp(rng.uniform(0.5, 1.5) * (m - 0.5)), 0.6
    if label == "supply_sag":  # the current of all others loads the common supply
        others = (np.abs(own).sum(1, keepdims=True) - np.abs(own)) / (w.channels - 1)
        return -others * v / v.mean(0), 0.6
    return before - own + rng.uniform(0.3, 0.6) * (earlier - own), 0.6


def folded(f):
    """Frequency that ``f`` has after sampling at 20 Hz."""
    return abs((f + 10) % 20 - 10)


def interference(label, rng, w, v):
    n, t = w.channels, w.t[:, None]
    phase, level = rng.uniform(0, 2 * np.pi, n), around(rng, 1, n)
    while True:
        f = rng.uniform(20, 120)
        if all(0.4 < folded(k * f) < 9.6 for k in (1, 2, 3)):
            break
    angle = 2 * np.pi * f * t + phase
    if label == "tone":
        h = np.sin(angle)
    elif label == "folded_harmonics":
        h = (
            np.sin(angle)
            + rng.uniform(0.3, 0.7) * np.sin(2 * angle + 1)
            + rng.uniform(0.3, 0.7) * np.sin(3 * angle)
        )
    elif label == "wandering":
        walk = np.cumsum(rng.standard_normal(w.samples)) * np.sqrt(
            2 * np.pi * logu(rng, 0.001, 0.006) * DT
        )
        h = np.sin(angle + walk[:, None])
    else:
        h = np.sin(angle) * (
            1 + rng.uniform(0.5, 0.9) * np.sin(2 * np.pi * rng.uniform(0.01, 0.05) * t)
        )
    return h * level


def spikes(label, rng, w, v):
    n, T = w.channels, w.samples
    rate, tau = rng.uniform(0.3, 0.7), rng.uniform(0.05, 0.2)
    if label == "clusters":
        centre = rng.random((T, n)) < DT * rate * 0.25
        hits = rng.random((T, n)) < 0.22 * np.minimum(lfilter(np.ones(16), [1], centre, axis=0), 1)
        hits |= centre
    else:
        hits = rng.random((T, n)) < DT * rate
    marks = hits * rng.choice([-1, 1], (T, n)) * rng.uniform(0.6, 1.4, (T, n))
    if label == "single_sample":
        return marks
    if label == "doublets":
        return lfilter([1, -0.8, 0.3], [1], marks, axis=0)
    a = np.exp(-DT / (tau if label == "poisson_decay" else 0.04))
    return lfilter([1], [1, -a], marks, axis=0)


def noise(label, rng, w, v):
    n, T = w.channels, w.samples
    e = rng.standard_normal((T, n))
    if label == "level":
        return e
    if label == "with_signal":
        return e * np.abs(v - w.rest) / np.abs(w.span)
    if label == "with_speed":
        return e * (np.abs(np.gradient(w.x)) / DT)[:, None] ** rng.uniform(0.6, 1.0)
    h = np.full((T, 1), rng.uniform(0.1, 0.3))
    for a, b in intervals(rng, w, (15, 50), (15, 50)):
        h[a:b] = rng.uniform(0.7, 1.3)
    return e * h


# ------------------------------------------------- digital: a function of what is sampled
def adc_nonlinearity(label, rng, w, v):
    low, high = v[:N1].min(0), v[:N1].max(0)
    low, high = (
        low - 0.03 * (high - low),
        high + 0.03 * (high - low),
    )  # what the end points were trimmed on
    power, sign = rng.uniform(0.7, 1.4), rng.choice([-1, 1])
    period = around(rng, 1, w.channels, 0.05) * rng.uniform(0.18, 0.4) * (high - low)
    errors = rng.uniform(0.5, 1, 4) * rng.choice([-1, 1], 4)
    offset = rng.uniform(0, 1, w.channels)

    def f(p, a):
        u = np.clip((a - low) / (high - low), 0, 1)
        if label == "bow":
            h = 4 * u * (1 - u)
        elif label == "skewed_s":
            h = np.sin(2 * np.pi * u**power)
        elif label == "sar_weights":  # capacitors of the upper bits off by some share
            h = sum(
                e * (np.floor(np.floor(u * 64) / 2**b) % 2 - 0.5) * 2.0 ** (0.5 * b)
                for b, e in zip((2, 3, 4, 5), errors, strict=False)
            )
        elif label == "sub_ranging":  # residue amplifier with a wrong gain
            h = (a / period + offset) % 1 - 0.5
        else:  # runs of codes that never come
            width = np.where(p > 0, p, 1.0)
            return np.where(p > 0, (np.floor(a / width + offset) + 0.5 - offset) * width, a)
        return np.where(p > 0, a + sign * p * h, a)

    return f, 0.1, 400.0


def frozen(label, rng, w, v):
    starts = np.flatnonzero(rng.random(w.samples) < DT / rng.uniform(6, 15))
    lengths = rng.uniform(0.4, 1.6, len(starts))

    def f(p, a):
        out = a.copy()
        for k in np.flatnonzero(p > 0):
            for start, length in zip(starts, lengths, strict=False):
                if start < len(a):
                    out[start : start + 1 + round(length * p[k] / DT), k] = out[start, k]
        return out

    return f, 0.04, 15.0


def built(name, label, rng, w, v):
    """f(p, rows) -> signals, and bounds of p, for an effect on the signals ``v`` of a material or
    of circuits."""
    made = foreign(name, rng, w, v) if name in FOREIGN else globals()[name](label, rng, w, v)
    if isinstance(made, tuple) and len(made) == 3:
        return made
    made, high = made if isinstance(made, tuple) else (made, None)
    if callable(made):
        return made, 1e-4, high
    if high is None:
        high = 1.5 * np.abs(v[:N1]).max() / np.maximum(rms(made[:N1]), 1e-12)
    return (lambda p, rows: v[:rows] + p * made[:rows]), 1e-6 * high, high


# ---------------------------------------------------------------- sizes
def bisected(size_of, target, on, low, high, steps=22):
    """p by channel, 0 where not ``on``, with size_of(p) = target; size_of grows with p."""
    low, high = (np.log(np.broadcast_to(b, on.shape)).astype(float) for b in (low, high))
    for _ in range(steps):
        middle = (low + high) / 2
        less = size_of(np.where(on, np.exp(middle), 0.0)) < target
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return np.where(on, np.exp((low + high) / 2), 0.0)


def folded_share(share):
    """Back into 0 … 1 at the ends, so that uniform stays uniform."""
    return 1 - np.abs(1 - np.abs(share))


def wide_size(sizes, target_share, low, high):
    """One p for all channels: their ratios to the noise all within LOW … HIGH where that can be."""

    def solve(goal):
        one = np.array([True])
        return bisected(
            lambda p: np.exp(np.mean(np.log(sizes(p[0]) + 1e-9))), goal, one, low, high, 16
        )[0]

    p = solve(np.sqrt(LOW * HIGH))
    for _ in range(2):  # the spread of the ratios depends a little on the size
        ratio = sizes(p)
        middle = np.exp(np.mean(np.log(ratio)))
        bottom, top = 1.04 * LOW * middle / ratio.min(), 0.96 * HIGH * middle / ratio.max()
        goal = (
            np.exp(np.log(bottom) + target_share * np.log(top / bottom))
            if top > bottom
            else np.sqrt(bottom * top)
        )
        p = solve(goal)
    return p


def simulated(seed, w, names, chosen, shares, floor, ceiling):
    """(signals before the ADC, function of the ADC) with the effects ``names``."""
    sized = {}
    w.x = w.x0

    def parameters(name):
        return drawn(seed, name), stream(seed, 200, ORDER.index(name))

    def goal(name):
        top = (
            10.0 if name == "adc_nonlinearity" and drawn(seed, name) == "missing_codes" else ceiling
        )
        return w.noise * np.exp(np.log(floor) + shares[name] * np.log(top / floor))

    if "backlash" in names:
        f, low, high = backlash(*parameters("backlash"), w)
        base = w.divider(w.nominal(w.x0[:N1]))
        p = wide_size(
            lambda p: rms(w.divider(w.nominal(f(p, N1))) - base) / w.noise,
            shares["backlash"].mean(),
            low,
            high,
        )
        w.x, sized["backlash"] = f(p, w.samples), p
    m = w.nominal(w.x)
    if "delay" in names:
        d, low, high = delay(*parameters("delay"), w)
        base = w.divider(m[:N1])
        p = wide_size(
            lambda p: rms(w.divider(shifted(m[:N1], p * d[:N1])) - base) / w.noise,
            shares["delay"].mean(),
            low,
            high,
        )
        m, sized["delay"] = shifted(m, p * d), p
        w.x = shifted(w.x[:, None], p * d[:, :1])[:, 0]
    for stage, view in ((MATERIAL, w.divider), (ELECTRICAL, lambda a: a)):
        for name in stage:
            if name in names:
                f, low, high = built(name, *parameters(name), w, m)
                base = view(m[:N1])
                p = bisected(
                    lambda p, view=view, f=f, base=base: rms(view(f(p, N1)) - base),
                    *(goal(name), chosen[name], low, high),
                )
                m, sized[name] = np.where(p > 0, f(p, w.samples), m), p
        if stage is MATERIAL:
            m = w.divider(m)
    chain = []
    for name in DIGITAL:
        if name in names:
            f, low, high = globals()[name](*parameters(name), w, m)
            p = bisected(
                lambda p, f=f: rms(f(p, m[:N1]) - m[:N1]),
                *(goal(name), chosen[name], low, high, 18),
            )
            chain.append((f, p))
            sized[name] = p

    def digital(a):
        for f, p in chain:
            a = f(p, a)
        return a

    w.sized = sized
    return m, digital


def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    w = World(seed, excitation)
    n, chosen = w.channels, {}
    for name in names:
        rng = stream(seed, 300, ORDER.index(name))
        count = n if name in WIDE else int(rng.integers(1, n + 1))
        chosen[name] = np.isin(np.arange(n), rng.permutation(n)[:count])
    any_on = np.any([*chosen.values(), np.zeros(n, bool)], axis=0)
    plain = w.divider(w.nominal(w.x0))
    for attempt in range(5):  # another size where two effects together leave LOW … HIGH
        floor, ceiling = (3.03, 29.7) if attempt == 0 else (4.5, 18.0)
        shares = {}
        for name in names:
            rng = stream(seed, 400 + attempt, ORDER.index(name))
            shares[name] = folded_share(rng.uniform() + 0.1 * rng.standard_normal(n))
        signals, digital = simulated(seed, w, names, chosen, shares, floor, ceiling)
        change = digital(signals[:N1]) - plain[:N1]
        ratio = rms(change)[any_on] / w.noise[any_on]
        if np.all((ratio >= LOW) & (ratio <= HIGH)):
            break
    w.attempts = attempt + 1
    later = slice(w.second, w.second + N2)
    quiet, loud = stream(seed, 3), stream(seed, 4)
    white = [r.standard_normal((w.samples, n)) * w.noise for r in (quiet, loud)]
    strain = w.full * w.x0
    real = digital(signals + white[1])
    return Case(
        converted("sim", (plain + white[0])[:N1], strain[:N1]),
        converted("real", real[:N1], strain[:N1]),
        converted("sim2", (plain + white[0])[later], strain[later]),
        converted("real2", real[later], strain[later]),
        change=change,
        floors=np.sqrt(2 * w.noise**2 + 1 / 6),
        excitation=excitation,
        unseen=True,
        truth={name: tuple(int(k) for k in np.flatnonzero(chosen[name])) for name in names},
        onset_s=w.onset if "step" in names else None,
    )
