"""Cases for knitted, printed and capacitive strain sensors as wearables have them.

``make(seed, names, excitation)`` gives a simulated and a 'real' recording of one motion, and of a
second motion recorded afterwards. 'real' holds hidden effects, in physical order. Each effect is
scaled so that what it adds has 3 to 30 times the rms of a channel's noise (less only where its
physical limits say so). Motion, sensors, noise and every effect draw from streams of their own.

Each name has several equations, one drawn by the seed: from the literature, and the shortcuts that
people who write simulators take. Written without a look at this project; nothing in it imports the
effects or the simulator.
"""

import math

import numpy as np
from cases import Case, converted
from scipy.signal import fftconvolve, lfilter
from scipy.special import erf, exp1

SUB, DT = 5, 0.05  # fine steps per sample, sample interval
N1, REST, N2 = 8000, 400, 4000
N = N1 + REST + N2
T, TF = np.arange(N) * DT, np.arange(N * SUB) * DT / SUB
RANGE = 0.4
MIN_SIZE, MAX_SIZE = 3.0, 30.0
FULL = 4095.0


# ---------------------------------------------------------------- helpers


def lp(u, tau, dt=DT):
    """1 / (1 + tau p) on piecewise linear input, at rest at the start; columns."""
    p = math.exp(-dt / tau)
    b1 = (tau / dt) * (1 - p)
    u0 = u[0]
    return u0 + lfilter([1 - b1, b1 - p], [1, -p], u - u0, axis=0)


def rms(d):
    return np.sqrt(np.mean(d[:N1] ** 2, axis=0))


def latch(v, quiet=1e-3):
    """Direction of the last movement, +-1, kept during holds."""
    d = np.where(v > quiet, 1.0, np.where(v < -quiet, -1.0, 0.0))
    last = np.maximum.accumulate(np.where(d != 0, np.arange(len(d)), 0))
    d = d[last]
    d[d == 0] = 1.0
    return d


def memory(u, kernel):
    """Sum over the past of kernel(t - t') du(t'), as in a Boltzmann superposition; columns."""
    du = np.diff(u, axis=0, prepend=u[:1])
    return fftconvolve(du, kernel[:, None], axes=0)[: len(u)]


def ou(r, tau, k):
    p = math.exp(-DT / tau)
    e = r.standard_normal((N, k)) * math.sqrt(1 - p * p)
    e[0] /= math.sqrt(1 - p * p)
    return lfilter([1], [1, -p], e, axis=0)


class Plus:
    """Adds a * shape, a > 0 per channel, at most ``cap`` of the span in the first recording."""

    def __init__(self, shape, cap=0.5):
        self.shape, self.cap = np.asarray(shape, float), cap


class Map:
    """codes -> f(a, codes), a per channel between lo and hi, stronger for larger a."""

    def __init__(self, f, lo, hi):
        self.f, self.lo, self.hi = f, lo, hi


class Move:
    """strain -> f(a) on the fine clock, one a for all channels."""

    def __init__(self, f, lo, hi):
        self.f, self.lo, self.hi = f, lo, hi


# ---------------------------------------------------------------- motion


def segment(x0, x1, seconds, cosine=False):
    n = max(round(seconds / DT * SUB), 1)
    q = np.arange(1, n + 1) / n
    return x0 + (x1 - x0) * ((1 - np.cos(np.pi * q)) / 2 if cosine else q)


def stay(x, seconds):
    return np.full(max(int(seconds / DT * SUB), 0), float(x))


class Path:
    def __init__(self, r):
        self.r, self.parts, self.n, self.x = r, [np.zeros(SUB)], SUB, 0.0

    def add(self, part):
        if len(part):
            self.parts.append(part)
            self.n += len(part)
            self.x = float(part[-1])

    def to(self, x1, speed, hold=0.0, cosine=False):
        self.add(
            segment(self.x, x1, abs(x1 - self.x) / speed * (math.pi / 2 if cosine else 1), cosine)
        )
        self.add(stay(x1, hold))

    # blocks of the rich motion
    def ascending(self):
        v = self.r.uniform(0.06, 0.12)
        for a in np.linspace(self.r.uniform(0.06, 0.1), RANGE * self.r.uniform(0.93, 0.99), 4):
            for _ in range(2):
                self.to(a, v)
                self.to(0.0, v)

    def steps(self):
        levels = self.r.uniform(0.03, 0.38, 3)
        for q in (*np.sort(levels), self.r.uniform(0.05, 0.2)):
            self.to(q, self.r.uniform(0.15, 0.6), self.r.uniform(8, 14))

    def rest(self):
        self.to(0.0, 0.2, self.r.uniform(8, 20))

    def random(self):
        for _ in range(int(self.r.integers(8, 16))):
            hold = self.r.uniform(0.3, 5) if self.r.random() < 0.35 else 0.0
            self.to(
                self.r.uniform(0, RANGE),
                math.exp(self.r.uniform(math.log(0.02), math.log(0.4))),
                hold,
                self.r.random() < 0.4,
            )

    def chirp(self):
        a, dur = self.r.uniform(0.05, 0.17), self.r.uniform(20, 35)
        mid = self.r.uniform(0.18, 0.22)
        self.to(mid, 0.1, 1.0)
        t = np.arange(int(dur / DT * SUB)) * DT / SUB
        f0, f1 = 0.05, self.r.uniform(1.5, 3)
        f = f0 * (f1 / f0) ** (t / dur)
        ph = 2 * np.pi * np.cumsum(f) * DT / SUB
        self.add(mid + np.minimum(a, 0.5 / (2 * np.pi * f)) * np.sin(ph))

    def nested(self):
        a = self.r.uniform(0.25, 0.36)
        v = self.r.uniform(0.05, 0.15)
        for q in np.linspace(0, 0.42, 4):
            self.to(a * (1 - q), v)
            self.to(a * q, v)

    def rates(self):
        a = self.r.uniform(0.2, 0.35)
        self.to(0.0, 0.2)
        for v in (0.03, 0.1, 0.4):
            for _ in range(2):
                self.to(a, v)
                self.to(0.0, v)

    def finish(self, n):
        x = np.concatenate(self.parts)
        x = x[:n] if len(x) >= n else np.pad(x, (0, n - len(x)), mode="edge")
        w = np.hanning(15)[1:-1]
        return np.clip(np.convolve(np.pad(x, 6, mode="edge"), w / w.sum(), mode="valid"), 0, RANGE)


def piece(r, n, excitation, first):
    p = Path(r)
    if excitation == "rich":
        if first:
            p.ascending()
        while p.n < n:
            blocks = [p.steps, p.rest, p.random, p.chirp, p.nested, p.rates, p.random]
            for i in r.permutation(len(blocks)):
                blocks[i]()
    elif excitation == "typical":
        while p.n < n:  # sets of one exercise, with breaks
            period, amp, low = r.uniform(1.6, 6), r.uniform(0.18, 0.37), r.uniform(0, 0.04)
            dwell = r.uniform(0, 0.25) * period if r.random() < 0.5 else 0.0
            for _ in range(int(r.integers(8, 25))):
                up = (period - dwell) / 2 * r.uniform(0.85, 1.15)
                top = min(amp * r.uniform(0.85, 1.12), RANGE)
                p.add(segment(p.x, top, up, True))
                p.add(stay(top, dwell * r.uniform(0.5, 1.5)))
                p.add(segment(top, low + 0.01 * r.random(), up * r.uniform(0.85, 1.15), True))
            p.to(0.0, 0.1, r.uniform(4, 20))
    elif excitation == "poor":
        p.add(stay(0, r.uniform(3, 110)))
        up, peak = r.uniform(12, 60), r.uniform(0.2, 0.39)
        for _ in range(int(r.integers(1, 4))):
            p.to(peak, peak / up)
            p.to(0.0, peak / up, r.uniform(0, 25))
    else:
        raise ValueError(excitation)
    return p.finish(n)


def motion(r, excitation):
    a = piece(r, N1 * SUB, excitation, True)
    back = np.concatenate([segment(a[-1], 0, 4.0, True), stay(0, REST * DT)])[: REST * SUB]
    return np.concatenate([a, back, piece(r, N2 * SUB, excitation, False)])


# ---------------------------------------------------------------- nominal sensors


class Sensors:
    """Static curve of one of three kinds, one or two relaxing modes, a small friction loop."""

    def __init__(self, r):
        c = self.c = int(r.integers(3, 8))
        self.kind = r.integers(0, 3, c)
        self.bend = r.uniform(0.2, 1.0, c)
        self.w = r.uniform(0.0, 0.12, (2, c)) * np.array([[1.0], [0.7]])
        self.tau = np.stack(
            [
                np.exp(r.uniform(np.log(0.3), np.log(3), c)),
                np.exp(r.uniform(np.log(5), np.log(40), c)),
            ]
        )
        self.loop, self.loop_len = r.uniform(0, 0.015, c), r.uniform(0.01, 0.05)
        up = r.random(c) < 0.8
        self.gain = np.where(up, 1.0, -1.0) * r.uniform(450, 1300, c)
        self.base = np.where(up, r.uniform(900, 2000, c), r.uniform(2100, 3000, c))
        self.noise = r.uniform(0.7, 2.2, c)

    def static(self, e):
        u, b = e[:, None] / RANGE, self.bend
        knit = u + 0.6 * b * u * u - 0.35 * b * u**3  # sigmoid, as of a knitted loop
        knit = knit / (1 + 0.25 * b)
        div = u * (1 + 0.8 * b) / (1 + 0.8 * b * u)  # divider: concave
        cap = (np.exp(b * u) - 1) / (np.exp(b) - 1)  # convex
        return np.choose(self.kind, [knit, div, cap])

    def signal(self, xf):
        """(N, c), about 0 to 1."""
        e = xf[::SUB]
        f = self.static(e)
        s = f.copy()
        for i in range(self.c):
            for m in range(2):
                s[:, i] += self.w[m, i] * (f[:, i] - lp(f[:, i], self.tau[m, i]))
        q = np.exp(-np.abs(np.diff(e, prepend=e[0])) / self.loop_len).tolist()
        d = latch(np.gradient(e, DT)).tolist()
        z, out = 0.0, []
        for a, b in zip(q, d, strict=True):
            z = b + (z - b) * a
            out.append(z)
        return s + self.loop * np.array(out)[:, None]

    def __call__(self, xf):
        return self.base + self.gain * self.signal(xf)


class World:
    def __init__(self, r, xf, y, sensors, ch, size):
        self.r, self.xf, self.ch, self.size = r, xf, ch, size
        self.all, self.sensors = y, sensors
        self.e = xf[::SUB]  # strain at the sensors
        self.v = np.gradient(self.e, DT)
        self.k, self.c = len(ch), y.shape[1]
        self.base, self.gain = sensors.base[ch], sensors.gain[ch]
        self.span, self.noise = np.abs(self.gain), sensors.noise[ch]
        self.y = y[:, ch]
        self.z = self.y - self.base  # codes about rest
        self.s = self.z / self.gain  # about 0 to 1
        self.onset = None

    def uni(self, a, b, n=None):
        return self.r.uniform(a, b, n)

    def log(self, a, b):
        return float(np.exp(self.r.uniform(math.log(a), math.log(b))))

    def signs(self):
        """Own sign per channel."""
        return self.r.choice([-1.0, 1.0], self.k)

    def sign(self):
        return float(self.r.choice([-1.0, 1.0]))

    def white(self):
        return self.r.standard_normal((N, self.k))

    def norm(self, j):
        """Signals of other channels, about 0 to 1."""
        return (self.all[:, j] - self.sensors.base[j]) / self.sensors.gain[j]

    @property
    def travel(self):
        return np.cumsum(np.abs(np.diff(self.e, prepend=self.e[0])))


# ---------------------------------------------------------------- motion effects


def run_play(x, low, up, start):
    z, out = start, []
    for a, b in zip(low.tolist(), up.tolist(), strict=True):
        z = a if z < a else b if z > b else z
        out.append(z)
    return np.array(out)


def play(w):
    return Move(lambda a: run_play(w.xf, w.xf - a, w.xf + a, 0.0), 1e-4, 0.04)


def dead_zone(w):
    if w.r.random() < 0.5:
        return Move(lambda a: np.maximum(w.xf - a, 0), 1e-4, 0.06)
    x0 = w.uni(0.2, 0.6) * w.xf.max()  # slack around one pose
    return Move(
        lambda a: x0 + np.sign(w.xf - x0) * np.maximum(np.abs(w.xf - x0) - a, 0), 1e-4, 0.06
    )


def stick_slip(w):  # a mount that sticks, breaks loose and slides most of the way back
    left = w.uni(0.0, 0.5)

    def f(a):
        z, out = 0.0, []
        for x in w.xf.tolist():
            d = x - z
            if d > a:
                z = x - left * a
            elif d < -a:
                z = x + left * a
            out.append(z)
        return np.array(out)

    return Move(f, 1e-4, 0.04)


def friction(w):  # Bowden sheath: the lost motion grows with tension
    share = w.uni(0.3, 0.8)

    def f(a):
        h = a * ((1 - share) + share * w.xf / (0.5 * RANGE))
        return run_play(w.xf, w.xf - h, w.xf + h, 0.0)

    return Move(f, 1e-4, 0.04)


def cable_slack(w):  # pulls exactly, goes slack by the whole width on the way back
    return Move(lambda a: run_play(w.xf, w.xf, w.xf + a, 0.0), 1e-4, 0.06)


def compliant_gap(w):
    eps = w.uni(0.05, 0.3)
    return Move(
        lambda a: eps * w.xf + (1 - eps) * run_play(w.xf, w.xf - a, w.xf + a, 0.0), 1e-4, 0.04
    )


def late(w, shape, most=0.7):
    shape = np.broadcast_to(shape, TF.shape)
    return Move(lambda a: np.interp(TF - a * shape, TF, w.xf), 1e-3, most)


def clock_skew(w):
    return late(w, w.uni(0.02, 0.3) + TF / TF[-1], 1.5)


def wandering_clock(w):
    d = np.abs(1 + 0.5 * lp(ou(w.r, w.uni(30, 120), 1)[:, 0], 2.0))
    return late(w, np.interp(TF, T, d))


def repeated_blocks(w):  # the logger now and then sends a block twice and is late from then on
    n = int(w.r.integers(4, 14))
    at = np.sort(np.append(w.uni(5, TF[-1] - 20, n - 1), w.uni(2, 12)))
    size = w.uni(0.5, 1.5, n)
    return late(w, np.concatenate([[0], np.cumsum(size)])[np.searchsorted(at, TF)] / n, 2.5)


def jittered(w):
    u = np.repeat(w.uni(-1, 1, N), SUB)
    return late(w, 1 + w.uni(0.2, 0.7) * u)


def polled(w):  # two clocks that beat: the age of the value runs up and falls back
    period = w.uni(7, 40)
    return late(w, w.uni(0.2, 0.8) + (TF / period) % 1.0)


def unlogged_load(w):
    on, t = np.zeros(N), 0.0
    while t < T[-1]:
        t += w.uni(5, 40)
        d = w.uni(2, 15)
        on[(t < T) & (t + d > T)] = w.uni(0.4, 1)
        t += d
    b = np.interp(TF, T, lp(lp(on, 0.15), 0.15))
    return Move(lambda a: w.xf + a * b, 1e-5, 0.15)


def resonance(w):  # the test frame rings at its own frequency
    zeta = w.uni(0.04, 0.15)
    tf = DT / SUB

    def f(a):  # a = 1 / frequency
        om = 2 * math.pi / a
        k = 2 / tf
        den = np.array(
            [
                k * k + 2 * zeta * om * k + om * om,
                2 * om * om - 2 * k * k,
                k * k - 2 * zeta * om * k + om * om,
            ]
        )
        return lfilter(om * om * np.array([1, 2, 1]) / den[0], den / den[0], w.xf)

    return Move(f, 0.1, 2.0)


# ---------------------------------------------------------------- hysteresis


def only_loop(w, h):
    """Without what a calibrated static curve has already taken in; columns or one shape for all."""
    p = np.polyfit(w.e[:N1], h[:N1], 3)
    d = h - np.polyval(p, w.e)
    return Plus(d[:, None] * w.gain * w.sign() * w.uni(0.8, 1.2, w.k), 0.3)


def preisach(w):
    n = 700
    mid, half = (
        np.clip(w.r.normal(0.5, 0.28, n), -0.1, 1.1) * RANGE,
        np.abs(w.r.normal(0, w.uni(0.1, 0.25), n)) * RANGE,
    )
    up, dn = mid + half, mid - half
    z, out = -np.ones(n), np.empty(N)
    z[dn > 0] = -1
    prev = -1.0
    for i, x in enumerate(w.e.tolist()):
        if x > prev:
            z[up <= x] = 1
        elif x < prev:
            z[dn >= x] = -1
        prev = x
        out[i] = z.sum()
    return only_loop(w, lp(out, 0.03))


def dahl(w):
    n, x0 = w.r.choice([0.6, 1.0, 1.6]), w.log(0.015, 0.12)
    z, out, prev = 0.0, [], 0.0
    for x in w.e.tolist():
        dx = x - prev
        prev = x
        if dx != 0:
            g = 1.0 if dx > 0 else -1.0
            q = max(1 - g * z, 0.0)
            if n == 1.0:
                q *= math.exp(-abs(dx) / x0)
            elif q > 0:
                q = max(q ** (1 - n) - (1 - n) * abs(dx) / x0, 0.0) ** (1 / (1 - n))
            z = g * (1 - q)
        out.append(z)
    return only_loop(w, np.array(out))


def maxwell_slip(w):
    m = 10
    width, stiff = (
        np.geomspace(0.004, 0.15, m),
        w.r.dirichlet(np.ones(m)) / np.geomspace(0.004, 0.15, m),
    )
    z, out, prev = np.zeros(m), np.empty(N), 0.0
    for i, x in enumerate(w.e.tolist()):
        z = np.minimum(np.maximum(z + (x - prev), -width), width)
        prev = x
        out[i] = stiff @ z
    return only_loop(w, out)


def duhem(w):  # Coleman-Hodgdon
    alpha, b = 1 / w.log(0.03, 0.15), w.uni(0.2, 0.8)
    z, out, prev = 0.0, [], 0.0
    for x in w.e.tolist():
        n = max(int(abs(x - prev) / 0.004), 1)
        dx = (x - prev) / n
        for j in range(n):
            xi = prev + dx * (j + 0.5)
            z += alpha * abs(dx) * (xi / RANGE - z) + b * dx / RANGE
        prev = x
        out.append(z)
    return only_loop(w, np.array(out))


def jiles(w):
    k, a, alpha = w.uni(0.08, 0.25), w.uni(0.3, 0.8), w.uni(0, 0.1)
    z, out, prev = 0.0, [], 0.0
    for x in (w.e / RANGE).tolist():
        dx = x - prev
        prev = x
        if dx:
            he = (x - 0.2 + alpha * z) * 3 / a
            an = 1 / math.tanh(he) - 1 / he if abs(he) > 1e-3 else he / 3
            if (an - z) * dx > 0:
                z += (an - z) * (1 - math.exp(-abs(dx) / k))
        out.append(z)
    return only_loop(w, np.array(out))


def two_branches(w):  # another curve on the way back, changed over within a short travel
    d = latch(w.v).tolist()
    q = np.exp(-np.abs(np.diff(w.e, prepend=0)) / w.log(0.004, 0.02)).tolist()
    z, out = 1.0, []
    for a, b in zip(q, d, strict=True):
        z = b + (z - b) * a
        out.append(z)
    u = w.e / RANGE
    lens = np.sin(np.pi * np.clip(u, 0, 1)) ** w.uni(0.6, 1.2)
    return Plus((np.array(out) * lens)[:, None] * w.gain * w.sign(), 0.3)


# ---------------------------------------------------------------- relaxation, overshoot


def fractional(w):
    a = w.uni(0.15, 0.4)
    j = np.arange(1, N)
    g = np.cumprod(np.concatenate([[1.0], 1 - (a + 1) / j]))
    return Plus(fftconvolve(w.z - w.z[0], g[:, None], axes=0)[:N] * w.sign(), 0.4)


def kohlrausch(w):
    tau, b = w.log(2, 40), w.uni(0.3, 0.75)
    return Plus(memory(w.z, np.exp(-((T / tau) ** b))) * w.sign(), 0.4)


def norton(w):  # nonlinear dashpot: fast where the stress is high
    n, rate, out = w.uni(1.5, 3), 1 / w.log(1.5, 20), np.empty((N, w.k))
    for i in range(w.k):
        q, col = 0.0, []
        for s in w.s[:, i].tolist():
            d = s - q
            q += d * min(DT * rate * (abs(d) / 0.3) ** (n - 1), 0.5)
            col.append(s - q)
        out[:, i] = col
    return Plus(out * w.gain * w.sign(), 0.4)


def log_creep(w):
    return Plus(memory(w.z, np.log1p(T / w.log(0.5, 8))) * w.sign(), 0.4)


def fung(w):  # quasi-linear: a box spectrum on an exponential stress
    t1, t2 = w.log(0.3, 1.5), w.log(30, 150)
    g = exp1((T + 1e-3) / t2) - exp1((T + 1e-3) / t1)
    b = w.uni(1, 4)
    stress = np.expm1(b * w.e / RANGE) / np.expm1(b)
    return Plus(memory(stress[:, None], g / g[0]) * w.gain * w.sign(), 0.4)


def one_mode(w):  # Zener on the strain, explicit Euler
    p = DT / w.log(1.5, 60)
    q = lfilter([0, p], [1, p - 1], w.e)
    return Plus((w.e - q)[:, None] * w.gain * w.sign(), 0.4)


def overshoot(w, a, by_signal=True):
    m = 1.0
    if by_signal:
        m = w.uni(0.2, 1) + w.uni(0.3, 1.2) * w.s
    a = a[:, None] if a.ndim == 1 else a
    return Plus(a * m * w.gain * w.sign(), 0.5)


def leaky_power(w):
    return overshoot(w, lp(np.abs(w.v) ** w.uni(0.4, 1.0), w.log(0.2, 3)), False)


def network(w):  # share of broken contacts
    k1, tau = w.uni(4, 25), w.log(0.3, 3)
    b, out = 0.0, []
    for s in np.abs(w.v).tolist():
        a = k1 * s + 1 / tau
        goal = k1 * s / a
        b = goal + (b - goal) * math.exp(-a * DT)
        out.append(b)
    return overshoot(w, np.array(out))


def uneven(w):
    back = w.uni(0.3, 0.8)
    return overshoot(w, lp(np.where(w.v > 0, w.v, -back * w.v), w.log(0.2, 2.5)))


def envelope(w):  # peak detector with release
    p, z, out = math.exp(-DT / w.log(0.3, 2)), 0.0, []
    for s in np.abs(w.v).tolist():
        z = max(s, z * p)
        out.append(z)
    return overshoot(w, np.array(out), w.r.random() < 0.5)


def limited(w):
    v0 = w.log(0.03, 0.2)
    s = np.abs(w.v)
    return overshoot(w, lp(lp(s / (s + v0), w.log(0.2, 1)), 0.15))


def two_rates(w):
    s, mix = np.abs(w.v), w.uni(0.2, 0.6)
    return overshoot(w, (1 - mix) * lp(s, w.log(0.15, 0.5)) + mix * lp(s, w.log(1.2, 3)))


# ---------------------------------------------------------------- softening


def soften(w, damage, cap=0.5):
    return Plus(-damage[:, None] * (w.s + w.uni(0.0, 0.15)) * w.gain, cap)


def yeoh(e):
    i1 = (1 + e) ** 2 + 2 / (1 + e) - 3
    return i1 + 0.3 * i1**2 + 0.1 * i1**3


def pseudo_elastic(w):  # Ogden-Roxburgh
    u = yeoh(w.e)
    um = np.maximum.accumulate(u)
    return soften(w, erf((um - u) / (w.uni(0.05, 0.3) + w.uni(0.1, 0.5) * um)))


def damage(w):  # Simo
    um = np.maximum.accumulate(yeoh(w.e))
    return soften(w, 1 - np.exp(-um / w.uni(0.08, 0.4)))


def exp_max(w):
    xm = np.maximum.accumulate(w.e)
    return soften(w, 1 - np.exp(-(xm - w.e) / w.log(0.03, 0.2)))


def cycles(w):  # a share lost per cycle, counted by travel
    n = w.travel / (2 * RANGE)
    return soften(w, 1 - np.exp(-n / w.log(1.0, 5)))


def qi_boyce(w):  # hard domains give way as the largest stretch grows
    xm = np.maximum.accumulate(w.e)
    lock, a = w.uni(0.55, 0.9), w.log(0.03, 0.3)
    return soften(
        w,
        (1 - np.exp(-a * (1 / (lock - xm) - 1 / lock))) * (1 - 0.5 * (w.e / np.maximum(xm, 1e-3))),
    )


def linear_gap(w):
    xm = np.maximum.accumulate(w.e)
    return soften(w, (xm - w.e) / RANGE)


# ---------------------------------------------------------------- slow


def trend(w, c):
    sign = w.signs() if w.r.random() < 0.6 else np.full(w.k, w.sign())
    return Plus(np.asarray(c)[:, None] * w.gain * sign, 0.6)


def two_stage(w):
    fast = 1 - np.exp(-T / w.log(10, 60))
    return trend(w, fast + w.sign() * w.uni(0.5, 1.5) * T / T[-1])


def warm_up(w):  # rises and comes back
    t1, t2 = w.log(15, 60), w.log(150, 400)
    return trend(w, np.exp(-T / t2) - np.exp(-T / t1))


def wander(w, a):
    a = np.asarray(a)
    return Plus(a - a[0], 0.6)


def pink(w):
    n = 2 * N
    f = np.fft.rfftfreq(n, DT)
    f[0] = 1.0
    z = w.r.standard_normal((len(f), w.k)) + 1j * w.r.standard_normal((len(f), w.k))
    z *= (f ** -w.uni(0.45, 0.7))[:, None]
    z[0] = 0
    a = np.fft.irfft(z, n, axis=0)[:N]
    return wander(w, lp(a, 0.3))


def bounded(w):
    a = np.cumsum(w.white(), axis=0)
    b = w.uni(25, 70)
    return wander(w, np.abs((a + b) % (4 * b) - 2 * b) - b)  # reflected at +-b


def heavy_walk(w):
    return wander(w, lp(np.cumsum(np.clip(w.r.standard_t(2.2, (N, w.k)), -25, 25), axis=0), 0.3))


def scale(w, d, course=1.0):
    course = np.broadcast_to(course, (N,))
    return Plus(d * course[:, None] * (w.signs() if w.r.random() < 0.5 else w.sign()), 0.4)


def per_session(w):
    other = w.uni(-1, 2)
    return scale(w, w.z, np.where(np.arange(N) < N1, 1.0, other))


def at(w, shape, kind="sharp"):
    """``shape`` from one instant on, at which it has something to act on."""
    w.onset = float(np.round(w.uni(60, 340) / DT) * DT)
    if kind == "scales":
        share = np.cumsum(w.s[:N1, 0] ** 2)
        early, late_ = (float(T[np.searchsorted(share, q * share[-1])]) for q in (0.1, 0.75))
        if not early < w.onset < late_:
            w.onset = float(np.round(w.uni(early, late_) / DT) * DT)
    i = round(w.onset / DT)
    course = (np.arange(N) >= i).astype(float)
    if kind == "ramp":
        course[i] = w.uni(0.3, 0.7)
    if kind == "recovers":
        left = w.uni(0.3, 0.7)
        course *= left + (1 - left) * np.exp(-np.maximum(T - w.onset, 0) / w.log(10, 80))
    return Plus(shape * course[:, None], 0.5)


def both(w):
    return at(w, w.z * w.sign() + w.gain * w.uni(0.2, 0.7) * w.signs(), "scales")


# ---------------------------------------------------------------- electrical


def unequal(a, y):
    return np.stack([lp(lp(y[:, i], a[i]), 0.35 * a[i]) for i in range(len(a))], 1)


def firmware(a, y):  # y += alpha * (x - y)
    p = np.exp(-DT / a)
    return np.stack(
        [y[0, i] + lfilter([1 - p[i]], [1, -p[i]], y[:, i] - y[0, i]) for i in range(len(a))], 1
    )


def boxcar(a, y):
    out = np.empty_like(y)
    for i in range(y.shape[1]):
        u = y[:, i] - y[0, i]
        c = np.concatenate([[0], np.cumsum((u[1:] + u[:-1]) / 2) * DT])
        q = np.maximum(T - a[i], 0) / DT
        j = np.minimum(q.astype(int), N - 2)
        q = q - j
        back = c[j] + DT * (u[j] * q + (u[j + 1] - u[j]) * q * q / 2)
        out[:, i] = y[0, i] + (c - back) / a[i]
    return out


def warming(w):  # a resistance on its way to another temperature takes the time constant along
    f = 1 + w.sign() * w.uni(0.2, 0.5) * (1 - np.exp(-T / w.log(60, 300)))

    def g(a, y):
        out = np.empty_like(y)
        for i in range(y.shape[1]):
            tau = a[i] * f
            p = np.exp(-DT / tau)
            b1 = tau / DT * (1 - p)
            z, col, prev = float(y[0, i]), [], float(y[0, i])
            for x, q, b in zip(y[:, i].tolist(), p.tolist(), b1.tolist(), strict=True):
                z = q * z + (1 - b) * x + (b - q) * prev
                prev = x
                col.append(z)
            out[:, i] = col
        return out

    return Map(g, 5e-3, 0.8)


def each(f):
    return lambda a, y: np.stack([f(a[i], y[:, i]) for i in range(len(a))], 1)


def top_end(w, f):
    hi, lo = w.y[:N1].max(0), w.y[:N1].min(0)
    return Map(lambda a, y: f(a, y, hi, hi - lo), 2e-3, 0.85)


def hard_clip(w):
    return top_end(w, lambda a, y, hi, sp: np.minimum(y, hi - a * sp))


def soft_knee(w):
    k = w.uni(0.1, 0.3)

    def f(a, y, hi, sp):
        h = k * sp
        m = hi - a * sp + h
        d = y - m
        return np.where(d < -h, y, np.where(d > h, m, y - (d + h) ** 2 / (4 * h)))

    return top_end(w, f)


def tanh_top(w):
    k = w.uni(0.05, 0.25)

    def f(a, y, hi, sp):
        m, h = hi - a * sp, k * sp
        return np.where(y > m, m + h * np.tanh(np.maximum(y - m, 0) / h), y)

    return top_end(w, f)


def log_compress(w):
    k = w.uni(0.4, 0.7)

    def f(a, y, hi, sp):
        m, h = hi - k * sp, sp * 0.1 / a
        return np.where(y > m, m + h * np.log1p(np.maximum(y - m, 0) / h), y)

    return top_end(w, f)


def both_ends(w):
    k = w.uni(0.2, 0.8)
    lo = w.y[:N1].min(0)
    return top_end(w, lambda a, y, hi, sp: np.clip(y, lo + k * a * sp / 2, hi - a * sp / 2))


def tanh_full(w):
    lo = w.y[:N1].min(0)
    return top_end(
        w,
        lambda a, y, hi, sp: np.where(
            y > lo, lo + sp / (2 * a) * np.tanh((y - lo) * 2 * a / sp), y
        ),
    )


def previous(w):
    """Column before each affected one in the order of the scan, about rest."""
    j = (w.ch - 1) % w.c
    return w.all[:, j] - w.sensors.base[j]


def supply(w):  # every sensor's current pulls down the one reference
    load = np.mean([w.norm(j) for j in range(w.c)], axis=0)
    return Plus(-w.y * load[:, None])


def ground(w):  # shared return wire, in the order of the ohms
    p = np.array([w.r.dirichlet(np.ones(w.c)) for _ in range(w.k)])
    p[np.arange(w.k), w.ch] = 0
    return Plus((w.all - w.sensors.base) @ p.T * w.sign())


def product(w):
    j = (w.ch - 1) % w.c
    return Plus(w.z * np.stack([w.norm(i) for i in j], 1) * w.sign())


def edges(w):  # through a small capacitor from the line beside it
    q = previous(w)
    return Plus((q - lp(q, w.log(0.03, 0.25))) * w.sign())


def ribbon(w):  # leakage from both neighbours of a flat cable
    z, one = w.all - w.sensors.base, w.uni(0.3, 1)
    lo, hi = np.where(w.ch > 0, one, 0.0), np.where(w.ch < w.c - 1, 1 - one * 0.5, 0.0)
    return Plus(
        lo * z[:, np.maximum(w.ch - 1, 0)]
        + hi * z[:, np.minimum(w.ch + 1, w.c - 1)]
        - (lo + hi) * w.z
    )


def wave(w, phase, swell=1.0, levels=(1.0,)):
    ph = w.uni(0, 2 * np.pi, w.k) if w.r.random() < 0.5 else np.full(w.k, w.uni(0, 2 * np.pi))
    out = sum(a * np.sin((i + 1) * (phase[:, None] + ph)) for i, a in enumerate(levels))
    return Plus(out * np.broadcast_to(swell, (N,))[:, None] * w.uni(0.7, 1.3, w.k), 0.3)


def mains(w):
    f = (50.0 if w.r.random() < 0.6 else 60.0) * (1 + w.uni(-0.002, 0.002))
    fs = 20 * (1 + w.uni(-0.02, 0.02))  # the logger's own idea of 20 Hz
    return wave(w, 2 * np.pi * f / fs * np.arange(N))


def tone(w, **k):
    return wave(w, 2 * np.pi * w.uni(0.8, 9.4) * T, **k)


def hum_wander(w):
    f = w.uni(2, 8) + w.uni(0.1, 0.5) * ou(w.r, w.log(20, 80), 1)[:, 0]
    return wave(w, 2 * np.pi * np.cumsum(np.clip(f, 0.5, 9.5)) * DT)


def hum_bursts(w):
    on = (T + w.uni(0, 20)) % w.uni(10, 40) < w.uni(3, 8)
    return tone(w, swell=lp(on.astype(float), 0.1))


def pwm(w):  # a motor driver's edges, folded
    f, duty = w.uni(0.9, 8.0), w.uni(0.2, 0.8)
    a = ((T * f + w.uni(0, 1)) % 1 < duty).astype(float) - duty
    return Plus(a[:, None] * w.uni(0.7, 1.3, w.k) * w.sign(), 0.3)


def impulses(w, sizes, kernel=(1.0,), rate=None, own=None):
    rate = w.log(0.05, 0.5) if rate is None else rate
    hit = w.r.random((N, w.k if own is None else 1)) < rate * DT
    hit = np.broadcast_to(hit, (N, w.k)).copy()
    for i in range(w.k):
        if hit[:N1, i].sum() < 4:
            hit[w.r.integers(100, N1 - 100, 5), i] = True
    a = hit * sizes((N, w.k))
    return Plus(lfilter(np.asarray(kernel), [1.0], a, axis=0), 1.0)


def sp_same(w):
    s = w.signs()
    return impulses(w, lambda n: s * (1 + 0.2 * w.r.standard_normal(n)))


def sp_decay(w):
    p = w.log(0.08, 0.5)
    s = w.signs()
    return impulses(w, lambda n: s * w.r.exponential(1, n), np.exp(-np.arange(60) * DT / p))


def sp_bipolar(w):
    return impulses(
        w,
        lambda n: w.r.choice([-1.0, 1.0], n) * w.r.uniform(0.5, 1.5, n),
        own=0 if w.r.random() < 0.4 else None,
    )


def sp_heavy(w):
    return impulses(
        w, lambda n: w.r.choice([-1.0, 1.0], n) * np.minimum(w.r.pareto(1.2, n) + 0.3, 12)
    )


def sp_clusters(w):
    n = int(w.r.integers(5, 14))
    out = np.zeros((N, w.k))
    for t in np.concatenate([w.uni(5, 380, n), w.uni(420, 600, n // 2)]):
        at_ = int(t / DT) + np.sort(w.r.integers(0, 40, int(w.r.integers(3, 9))))
        out[at_] += w.r.standard_normal((len(at_), w.k)) + 1.0
    return Plus(out * w.signs(), 1.0)


def dropouts(w):  # a frame that reads the rail, or nearly
    rail = FULL if w.r.random() < 0.3 else 0.0
    mask = np.zeros((N, w.k), bool)
    for i in range(w.k):
        n = (w.size[i] * w.noise[i]) ** 2 * N1 / np.mean((w.y[:N1, i] - rail) ** 2)
        n = max(round(n), 3)
        mask[w.r.integers(50, N1 - 50, n), i] = True
        mask[w.r.integers(N1 + REST, N, max(n // 2, 1)), i] = True
    return Map(lambda a, y: np.where(mask, y + a * (rail - y), y), 1e-4, 1.0)


def by_signal(w):
    return Plus(w.white() * (0.1 + np.abs(w.s)), 1.0)


def by_speed(w):
    return Plus(w.white() * (0.1 + lp(np.abs(w.v), 0.1) / np.abs(w.v).mean())[:, None], 1.0)


def coloured(w):
    p = w.uni(0.3, 0.9)
    return Plus(lfilter([1], [1, -p], w.white(), axis=0), 1.0)


def noisy_bursts(w):
    on, t = np.full(N, 0.05), 0.0
    while t < T[-1]:
        t += w.r.exponential(25)
        d = w.uni(1, 12)
        on[(t <= T) & (t + d > T)] = 1.0
        t += d
    return Plus(w.white() * on[:, None], 1.0)


def inl(w, curve):
    """Over the whole converter, or what an amplifier uses of it; its best line is calibrated."""
    lo, hi = w.y[:N1].min(0) - w.uni(20, 150), w.y[:N1].max(0) + w.uni(20, 150)
    if w.r.random() < 0.25:
        lo, hi = np.zeros(w.k), np.full(w.k, FULL)
    s = w.signs() if w.r.random() < 0.3 else w.sign()

    def shape(y, i):
        return curve((y - lo[i]) / (hi[i] - lo[i]))

    lines = []
    for i in range(w.k):
        u = np.linspace(w.y[:N1, i].min(), w.y[:N1, i].max(), 200)
        lines.append(np.polyfit(u, shape(u, i), 1))

    def f(a, y):
        d = [shape(y[:, i], i) - np.polyval(lines[i], y[:, i]) for i in range(w.k)]
        return y + s * a * np.stack(d, 1)

    return Map(f, 0.1, 6000)


def dnl(w):  # code widths of their own, end points right
    t = np.cumsum(w.r.standard_normal(4096))
    t -= np.linspace(t[0], t[-1], 4096)
    t /= t.std()
    return Map(lambda a, y: y + a * np.interp(y, np.arange(4096), t), 0.1, 250)


def segments(w):
    x = np.linspace(0, FULL, int(w.r.choice([9, 17])))
    t = w.r.standard_normal(len(x))
    t[[0, -1]] = 0
    return Map(lambda a, y: y + a * np.interp(y, x, t), 0.1, 300)


def missing(w):
    p = float(w.r.choice([32, 64, 128, 256]))
    low = w.r.random() < 0.5

    def f(a, y):
        q = y % p
        return np.where(q < a, y - q - (0.5 if low else 0) + (0 if low else a), y)

    return Map(f, 0.5, 0.9 * p)


def sticky(w):
    p = float(w.r.choice([32, 64, 128, 256]))
    o = w.uni(0, p)

    def f(a, y):
        d = (y - o + p / 2) % p - p / 2
        return np.where(np.abs(d) < a, y - d, y)

    return Map(f, 0.5, 0.49 * p)


# ---------------------------------------------------------------- outside the catalogue


def contact(w):  # a crimp that opens at random while stretched
    state, out, open_, shut = 0, [], w.log(0.02, 0.2), w.log(0.1, 1.0)
    thr = w.uni(0.3, 0.6) * w.e[:N1].max()
    u = w.r.random(N).tolist()
    for x, q in zip(w.e.tolist(), u, strict=True):
        if state == 0 and x > thr and q < open_ * DT * 5:
            state = 1
        elif state == 1 and (x < thr * 0.5 or q < shut * DT):
            state = 0
        out.append(state)
    return Plus(np.array(out, float)[:, None] * w.gain * w.sign(), 0.5)


def twist(w):  # a second, unlogged degree of freedom
    q = lp(ou(w.r, w.log(1.5, 10), 1)[:, 0], 0.4)
    return Plus((q * (0.2 + w.e / RANGE))[:, None] * w.gain * w.uni(0.4, 1.2, w.k) * w.signs(), 0.5)


def slew(w):
    def f(a, y):
        out = np.empty_like(y)
        for i in range(y.shape[1]):
            m, z, col = 40.0 / a[i], float(y[0, i]), []
            for x in y[:, i].tolist():
                d = x - z
                z += m if d > m else -m if d < -m else d
                col.append(z)
            out[:, i] = col
        return out

    return Map(f, 0.4, 400)


def range_switch(w):  # an amplifier with two ranges that do not meet, and a hysteresis between them
    lo, hi = w.y[:N1].min(0), w.y[:N1].max(0)
    up, dn = lo + 0.6 * (hi - lo), lo + 0.4 * (hi - lo)
    s = w.sign()

    def f(a, y):
        d = np.where(y > up, 1, np.where(y < dn, -1, 0))
        last = np.maximum.accumulate(np.where(d != 0, np.arange(N)[:, None], 0), axis=0)
        upper = np.take_along_axis(d, last, 0) > 0
        return np.where(upper, y + s * a * (1 + (y - up) / (hi - lo)), y)

    return Map(f, 0.5, 400)


EQUATIONS = {  # in physical order
    "backlash": {
        "play": play,
        "dead_zone": dead_zone,
        "stick_slip": stick_slip,
        "friction": friction,
        "cable_slack": cable_slack,
        "compliant_gap": compliant_gap,
    },
    "resonance": {"resonance": resonance},
    "unlogged_load": {"unlogged_load": unlogged_load},
    "delay": {
        "constant": lambda w: late(w, 1.0),
        "clock_skew": clock_skew,
        "wandering_clock": wandering_clock,
        "repeated_blocks": repeated_blocks,
        "jitter": jittered,
        "polled": polled,
    },
    "hysteresis": {
        "preisach": preisach,
        "dahl": dahl,
        "maxwell_slip": maxwell_slip,
        "duhem": duhem,
        "jiles": jiles,
        "two_branches": two_branches,
    },
    "relaxation": {
        "fractional": fractional,
        "kohlrausch": kohlrausch,
        "norton": norton,
        "log_creep": log_creep,
        "fung_qlv": fung,
        "one_mode": one_mode,
    },
    "softening": {
        "ogden_roxburgh": pseudo_elastic,
        "simo_damage": damage,
        "exp_max": exp_max,
        "cycles": cycles,
        "qi_boyce": qi_boyce,
        "linear_gap": linear_gap,
    },
    "overshoot": {
        "leaky_power": leaky_power,
        "network_ode": network,
        "asymmetric": uneven,
        "envelope": envelope,
        "limited_speed": limited,
        "two_rates": two_rates,
    },
    "twist": {"twist": twist},
    "drift": {
        "log": lambda w: trend(w, np.log1p(T / w.log(2, 50))),
        "power": lambda w: trend(w, T ** w.uni(0.3, 0.8)),
        "saturating": lambda w: trend(w, -np.expm1(-T / w.log(40, 250))),
        "two_stage": two_stage,
        "linear": lambda w: trend(w, T),
        "warm_up": warm_up,
    },
    "random_walk": {
        "wiener": lambda w: wander(w, np.cumsum(w.white(), axis=0)),
        "ou": lambda w: wander(w, ou(w.r, w.log(15, 150), w.k)),
        "pink": pink,
        "integrated": lambda w: wander(w, np.cumsum(ou(w.r, w.log(5, 30), w.k), axis=0)),
        "bounded": bounded,
        "heavy_tailed": heavy_walk,
    },
    "gain": {
        "about_code_0": lambda w: scale(w, w.y),
        "about_rest": lambda w: scale(w, w.z),
        "about_midscale": lambda w: scale(w, w.y - 2048),
        "ageing_time": lambda w: scale(w, w.z, T / T[-1]),
        "ageing_cycles": lambda w: scale(w, w.z, np.sqrt(w.travel)),
        "per_session": per_session,
    },
    "step": {
        "offset": lambda w: at(w, w.gain * w.signs()),
        "gain": lambda w: at(w, w.z * w.sign(), "scales"),
        "both": both,
        "partial_recovery": lambda w: at(w, w.gain * w.signs(), "recovers"),
        "two_sample_ramp": lambda w: at(w, w.gain * w.signs(), "ramp"),
    },
    "intermittent_contact": {"intermittent_contact": contact},
    "lag": {
        "one_pole": lambda w: Map(each(lambda a, y: lp(y, a)), 5e-3, 0.8),
        "two_equal": lambda w: Map(each(lambda a, y: lp(lp(y, a / 2), a / 2)), 5e-3, 0.8),
        "unequal": lambda w: Map(unequal, 5e-3, 0.6),
        "firmware_iir": lambda w: Map(firmware, 5e-3, 0.8),
        "moving_average": lambda w: Map(boxcar, 0.02, 1.6),
        "warming": warming,
    },
    "slew_limit": {"slew_limit": slew},
    "saturation": {
        "hard": hard_clip,
        "soft_knee": soft_knee,
        "tanh_top": tanh_top,
        "log_compressive": log_compress,
        "both_ends": both_ends,
        "tanh_full": tanh_full,
    },
    "crosstalk": {
        "charge_sharing": lambda w: Plus(previous(w) - w.z),
        "supply": supply,
        "ground": ground,
        "product": product,
        "capacitive": edges,
        "ribbon": ribbon,
    },
    "interference": {
        "mains": mains,
        "harmonics": lambda w: tone(w, levels=(1, 0.5, 0.3)),
        "wandering": hum_wander,
        "amplitude_modulated": lambda w: tone(
            w, swell=1 + 0.8 * np.sin(2 * np.pi * w.uni(0.01, 0.2) * T)
        ),
        "bursts": hum_bursts,
        "pwm": pwm,
    },
    "spikes": {
        "poisson": sp_same,
        "decaying": sp_decay,
        "bipolar": sp_bipolar,
        "heavy_tailed": sp_heavy,
        "clustered": sp_clusters,
        "dropouts": dropouts,
    },
    "noise": {
        "level": lambda w: Plus(w.white(), 1.0),
        "by_signal": by_signal,
        "by_speed": by_speed,
        "coloured": coloured,
        "heavy_tailed": lambda w: Plus(np.clip(w.r.standard_t(3, (N, w.k)), -15, 15), 1.0),
        "bursts": noisy_bursts,
    },
    "range_switch": {"range_switch": range_switch},
    "adc_nonlinearity": {
        "bow": lambda w: inl(w, lambda u: 4 * u * (1 - u)),
        "s_cubic": lambda w: inl(w, lambda u: 20.8 * u * (1 - u) * (u - 0.5)),
        "missing_codes": missing,
        "dnl": dnl,
        "sticky_codes": sticky,
        "piecewise": segments,
    },
}
FOREIGN = (
    "intermittent_contact",
    "unlogged_load",
    "twist",
    "resonance",
    "slew_limit",
    "range_switch",
)
RETUNED: list[str] = []
ALL_CHANNELS = {"backlash", "delay", "resonance", "unlogged_load"}
DIGITAL = {"adc_nonlinearity", "range_switch"}  # these act on the noise as well
ORDER = list(EQUATIONS)


def bisect(measure, target, lo, hi, k, steps=14):
    """log-bisection per entry: the a at which measure(a), rising, reaches the target."""
    low, high = np.full(k, math.log(lo)), np.full(k, math.log(hi))
    if np.all(measure(np.exp(high)) <= target):
        return np.exp(high)
    for _ in range(steps):
        mid = (low + high) / 2
        small = measure(np.exp(mid)) < target
        low, high = np.where(small, mid, low), np.where(small, high, mid)
    return np.exp((low + high) / 2)


def apply(w, effect):
    """Scale and apply: codes of the affected channels, codes -> codes, and the strain."""
    if isinstance(effect, Plus):
        d = effect.shape
        a = np.minimum(
            w.size * w.noise / (rms(d) + 1e-12), effect.cap * w.span / (np.abs(d).max(0) + 1e-12)
        )
        return w.y + a * d, (lambda y: y + a * d), w.xf
    if isinstance(effect, Map):
        a = bisect(
            lambda a: rms(effect.f(a, w.y) - w.y) / w.noise, w.size, effect.lo, effect.hi, w.k
        )
        return effect.f(a, w.y), (lambda y: effect.f(a, y)), w.xf

    def ratio(a):
        return rms(w.sensors(effect.f(float(a))) - w.y) / w.noise

    size = float(np.exp(np.log(w.size).mean()))
    a = bisect(lambda a: np.exp(np.log(ratio(a[0]) + 1e-9).mean()), size, effect.lo, effect.hi, 1)
    q = ratio(a[0]) + 1e-9
    mean = float(np.exp(np.log(q + 1e-9).mean()))
    low, high = MIN_SIZE * mean / q.min(), MAX_SIZE * mean / q.max()
    goal = math.sqrt(low * high) if low > high else min(max(size, low * 1.03), high * 0.97)
    if abs(goal - size) > 1e-3 * size:
        a = bisect(
            lambda a: np.exp(np.log(ratio(a[0]) + 1e-9).mean()), goal, effect.lo, effect.hi, 1
        )
    xf = effect.f(float(a[0]))
    return w.sensors(xf), None, xf


def make(
    seed: int, names: tuple[str, ...], excitation: str, equation: dict[str, str] | None = None
) -> Case:
    """One case. ``equation``: name -> equation, to force one (for checks)."""
    unknown = set(names) - set(ORDER)
    if unknown:
        raise ValueError(f"unknown effects {sorted(unknown)}")

    def stream(*key):
        return np.random.default_rng([20257, seed, *key])

    xf = motion(stream(1, ("rich", "typical", "poor").index(excitation)), excitation)
    sensors = Sensors(stream(2))
    c = sensors.c
    sim_noise = sensors.noise * stream(4).uniform(0.8, 1.25, c)
    noise = [
        sim_noise * stream(5).standard_normal((N, c)),
        sensors.noise * stream(6).standard_normal((N, c)),
    ]
    nominal = sensors(xf)
    y, real, at_sensor = nominal.copy(), nominal + noise[1], xf
    truth, onset = {}, None
    for name in sorted(names, key=ORDER.index):
        r = stream(7, ORDER.index(name))
        ch = np.arange(c)
        if name not in ALL_CHANNELS and r.random() > 0.35:
            ch = np.sort(r.permutation(c)[: int(r.integers(1, c))])
        size = np.exp(r.uniform(np.log(MIN_SIZE), np.log(MAX_SIZE)))
        size = np.clip(
            size * np.exp(r.uniform(-0.3, 0.3, len(ch))), MIN_SIZE * 1.02, MAX_SIZE * 0.98
        )
        which = str(r.choice(list(EQUATIONS[name])))
        if equation and name in equation:
            which = equation[name]
        w = World(r, at_sensor, y, sensors, ch, size)
        out, onto, at_sensor = apply(w, EQUATIONS[name][which](w))
        y[:, ch] = out
        if name in DIGITAL:
            real[:, ch] = onto(real[:, ch])
        else:
            real = y + noise[1]
        onset = w.onset if w.onset is not None else onset
        truth[name] = tuple(int(i) for i in ch)

    def cut(label, codes, part):
        return converted(label, codes[part], xf[::SUB][part])

    sim, one, two = nominal + noise[0], slice(0, N1), slice(N1 + REST, N)
    return Case(
        sim=cut("sim1", sim, one),
        real=cut("real1", real, one),
        sim2=cut("sim2", sim, two),
        real2=cut("real2", real, two),
        change=(y - nominal)[:N1],
        floors=np.sqrt(sim_noise**2 + sensors.noise**2 + 1 / 6),
        truth=truth,
        excitation=excitation,
        onset_s=onset,
        unseen=True,
    )
