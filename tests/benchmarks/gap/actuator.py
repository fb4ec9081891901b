"""Cases for sensors on pneumatic actuators; nothing here imports the effects or the simulator.

Five or six equations of each effect, one drawn by the seed or given by its name in ``EQUATIONS``;
written without a look at this project.

Physical order: motion (backlash, clock) -> material (on p, a sensor's normalised response) ->
readout (divider) -> own lag -> lag, saturation, crosstalk (fine grid, 200 Hz) -> sampling at 20 Hz
-> interference, spikes, noise -> the channel's own noise -> converter.

An equation is ``eq(w, r, q) -> f``; ``f(e) -> g``; ``g(a) -> signal`` at amplitude ``a``. ``r`` is
the channel's stream, ``q`` a stream that starts alike on every channel of one effect.
"""

from __future__ import annotations

import zlib
from types import SimpleNamespace

import numpy as np
from cases import Case, converted
from numba import njit
from scipy.ndimage import gaussian_filter1d
from scipy.signal import fftconvolve, lfilter
from scipy.special import erf

DT, SUB = 0.05, 10
H = DT / SUB
N1, REST, N2 = 8000, 400, 4000
N = N1 + REST + N2
NF = N * SUB
T = np.arange(NF) * H
TS = np.arange(N) * DT
XMAX = 0.4
RETUNED: tuple[str, ...] = ()
CAP = {
    "backlash": 0.06, "delay": 0.5, "softening": 0.75, "lag": 1.5, "saturation": 0.75,
    "adc_nonlinearity": 60.0, "crosstalk": 0.45, "gain": 0.6, "chamber_leak": 0.6,
    "intermittent_short": 1.0, "pump_sag": 0.5, "baseline_tracker": 1.0,
}  # fmt: skip


def stream(seed, *parts):
    return np.random.default_rng([seed, *(zlib.crc32(str(p).encode()) for p in parts)])


def between(r, a, b):
    return float(r.uniform(a, b))


def logu(r, a, b):
    return float(np.exp(r.uniform(np.log(a), np.log(b))))


def sign(r):
    return 1.0 if r.random() < 0.5 else -1.0


def rms(d):
    return float(np.sqrt(np.mean(np.square(d))))


def lp(u, tau, dt=H):
    k = np.exp(-dt / tau)
    return lfilter([1.0 - k], [1.0, -k], u, zi=np.array([k * u[0]]))[0]


def rate(x):
    return np.gradient(x) / H


def up(s):
    """From 20 Hz to the fine grid."""
    return np.interp(T, TS, s)


def plus(u):
    """An equation's result that adds ``u(e)`` to the signal."""
    return lambda e: (lambda s, d: lambda a: s + a * d)(e.s, u(e))


# ---------------------------------------------------------------- motion


def reach(x0, x1, n):
    q = np.linspace(0.0, 1.0, max(n, 2) + 1)[1:]
    return x0 + (x1 - x0) * (10 * q**3 - 15 * q**4 + 6 * q**5)


def ramp(x0, x1, speed):
    return np.linspace(x0, x1, max(int(abs(x1 - x0) / speed / H), 1) + 1)[1:]


def programme(r, samples, excitation):
    n, out, x = samples * SUB, [], 0.0
    total = 0

    def put(piece):
        nonlocal x, total
        out.append(piece)
        total += len(piece)
        x = float(piece[-1])

    put(np.zeros(int(between(r, 2.0, 5.0) / H)))
    if excitation == "poor":
        top, half = between(r, 0.3, XMAX), between(r, 4.0, 12.0)
        while total < n:
            put(ramp(x, top, top / half))
            put(ramp(x, 0.0, top / half))
        return np.concatenate(out)[:n]
    if excitation == "typical":
        while total < n:
            goal = XMAX * r.beta(1.1, 1.1)
            put(reach(x, goal, int(logu(r, 0.7, 4.0) / H)))
            if r.random() < 0.25:
                put(np.full(int(between(r, 0.2, 2.5) / H), x))
        y = np.concatenate(out)[:n]
        return gaussian_filter1d(y, 0.08 / H)
    assert excitation == "rich", excitation
    while total < n:
        block = r.integers(3) if total > n // 3 else 0
        if block == 0:  # ascending triangles
            speed = logu(r, 0.03, 0.25)
            for top in np.linspace(between(r, 0.06, 0.1), XMAX, int(r.integers(4, 6))):
                put(ramp(x, top, speed))
                put(ramp(x, between(r, 0.0, 0.3) * top, speed))
        elif block == 1:  # holds
            for _ in range(int(r.integers(3, 6))):
                put(ramp(x, between(r, 0.0, XMAX), logu(r, 0.1, 0.8)))
                put(np.full(int(between(r, 6.0, 16.0) / H), x))
        else:  # moves at several speeds
            for _ in range(int(r.integers(10, 25))):
                goal = between(r, 0.0, XMAX)
                put(ramp(x, goal, logu(r, 0.02, 0.7)))
        if r.random() < 0.5:
            put(ramp(x, 0.0, 0.15))
            put(np.full(int(between(r, 3.0, 9.0) / H), 0.0))
    return np.concatenate(out)[:n]


def whole_motion(seed, excitation):
    one = programme(stream(seed, "motion1"), N1, excitation)
    two = programme(stream(seed, "motion2"), N2, excitation)
    home = reach(one[-1], 0.0, int(3.0 / H))
    rest = np.concatenate([home, np.zeros(REST * SUB - len(home))])
    x = np.concatenate([one, rest, two])
    smooth = 0.03 if excitation != "typical" else 0.0
    return np.clip(gaussian_filter1d(x, smooth / H) if smooth else x, 0.0, XMAX)


# ---------------------------------------------------------------- nominal sensors


def sensor(r):
    """Static curve, divider, place in the range, and maybe a mild mechanism of its own."""
    s = SimpleNamespace()
    s.kind = ("poly", "exp", "root")[int(r.integers(3))]
    s.k = between(r, -0.35, 0.9) if s.kind == "poly" else between(r, 0.4, 1.6)
    gauge = between(r, 0.8, 4.0) if r.random() < 0.65 else -between(r, 0.4, 1.4)
    s.change = gauge * XMAX  # of the resistance, at full strain
    s.load = logu(r, 0.6, 2.5)  # divider's fixed resistor / R0
    s.high = r.random() < 0.5  # measured across the fixed resistor
    s.span = between(r, 800.0, 1600.0)
    s.low = between(r, 950.0, 3100.0 - s.span)
    s.own = ("none", "lag", "loop", "zener", "lag+loop")[int(r.integers(5))]
    s.tau, s.width = logu(r, 0.04, 0.3), between(r, 0.01, 0.04)
    s.loop, s.creep, s.creep_tau = between(r, 0.01, 0.035), between(r, 0.02, 0.06), logu(r, 3, 40)
    s.flip = np.sign(volts(s, 1.0) - volts(s, 0.0))
    s.v0, s.v1 = volts(s, 0.0), volts(s, 1.0)
    return s


def volts(s, p):
    res = np.maximum(1.0 + s.change * p, 0.03)
    return s.load / (res + s.load) if s.high else res / (res + s.load)


def static(s, x):
    u = x / XMAX
    if s.kind == "poly":
        return (u + s.k * u * u) / (1.0 + s.k)
    if s.kind == "exp":
        return np.expm1(s.k * u) / np.expm1(s.k)
    return (np.sqrt(1.0 + 2.0 * s.k * u) - 1.0) / (np.sqrt(1.0 + 2.0 * s.k) - 1.0)


def readout(s, p):
    v = (volts(s, p) - s.v0) / (s.v1 - s.v0)
    return s.low + s.span * (v if s.flip > 0 else 1.0 - v)


def own_material(s, x):
    p = static(s, x)
    if "loop" in s.own:
        p = p + s.loop * dahl_loop(x, s.width, 1.0)
    if s.own == "zener":
        p = p + s.creep * (p - lp(p, s.creep_tau))
    return p


def own_wire(s, y):
    return lp(y, s.tau) if "lag" in s.own else y


# ---------------------------------------------------------------- loops


@njit(cache=True)
def dahl_loop(x, width, n):
    z = np.zeros(len(x))
    for i in range(1, len(x)):
        dx = x[i] - x[i - 1]
        sg = 1.0 if dx > 0 else -1.0
        left = max(1.0 - sg * z[i - 1], 0.0)
        z[i] = min(max(z[i - 1] + dx / width * left**n, -1.0), 1.0)
    return z


@njit(cache=True)
def lugre_loop(x, h, width, extra, vs, damp):
    z = np.zeros(len(x))
    out = np.zeros(len(x))
    for i in range(1, len(x)):
        dx = x[i] - x[i - 1]
        v = dx / h
        top = width * (1.0 + extra * np.exp(-((v / vs) ** 2)))
        end = top if dx > 0 else -top
        new = end + (z[i - 1] - end) * np.exp(-abs(dx) / top)
        out[i] = new / width + damp * (new - z[i - 1]) / h
        z[i] = new
    return out


@njit(cache=True)
def preisach_loop(x, alpha, beta, w):
    s = -np.ones(len(w))
    z = np.zeros(len(x))
    total = -w.sum()
    z[0] = total
    for i in range(1, len(x)):
        if x[i] > x[i - 1]:
            for j in range(len(w)):
                if s[j] < 0 and x[i] >= alpha[j]:
                    s[j] = 1.0
                    total += 2.0 * w[j]
        elif x[i] < x[i - 1]:
            for j in range(len(w)):
                if s[j] > 0 and x[i] <= beta[j]:
                    s[j] = -1.0
                    total -= 2.0 * w[j]
        z[i] = total
    return z


@njit(cache=True)
def iwan_loop(x, limits, weights):
    q = np.zeros(len(limits))
    z = np.zeros(len(x))
    for i in range(1, len(x)):
        dx = x[i] - x[i - 1]
        for j in range(len(q)):
            q[j] = min(max(q[j] + dx, -limits[j]), limits[j])
            z[i] += weights[j] * q[j]
    return z


@njit(cache=True)
def jiles_loop(h, a, k, alpha, c):
    m = np.zeros(len(h))
    out = np.zeros(len(h))
    for i in range(1, len(h)):
        dh = h[i] - h[i - 1]
        u = (h[i] + alpha * m[i - 1]) / a
        an = u / 3.0 if abs(u) < 1e-3 else 1.0 / np.tanh(u) - 1.0 / u
        d = 1.0 if dh > 0 else -1.0
        gap = an - m[i - 1]
        m[i] = m[i - 1]
        if gap * d > 0:
            m[i] += (
                dh * gap / max(k * d - alpha * gap, 0.05 * k)
                if d > 0
                else (dh * gap / min(k * d - alpha * gap, -0.05 * k))
            )
        out[i] = c * an + (1.0 - c) * m[i]
    return out


@njit(cache=True)
def wide_play(low, high, start):
    """Play between two curves of the input: low <= z <= high."""
    z = np.empty(len(low))
    z[0] = min(max(start, low[0]), high[0])
    for i in range(1, len(low)):
        z[i] = min(max(z[i - 1], low[i]), high[i])
    return z


def loop_only(z, x):
    """Without what a calibrated static curve has taken already."""
    i = slice(0, N1 * SUB, SUB)
    return z - np.polyval(np.polyfit(x[i], z[i], 2), x)


def h_preisach(w, r, q):
    n = 44
    edge = np.linspace(0.0, XMAX, n)
    al, be = (m.ravel() for m in np.meshgrid(edge, edge, indexing="ij"))
    keep = al > be
    al, be = al[keep], be[keep]
    # relays off the grid, so that the steps are small
    al = al + r.uniform(-0.5, 0.5, len(al)) * edge[1]
    be = np.minimum(be + r.uniform(-0.5, 0.5, len(be)) * edge[1], al - 1e-4)
    mid, wide = between(r, 0.12, 0.28), between(r, 0.06, 0.14)
    d0 = between(r, 0.02, 0.08)
    den = np.exp(-(((al + be) / 2 - mid) ** 2) / 2 / wide**2) * np.exp(-(al - be) / d0)
    den *= sign(r) / np.abs(den).sum()
    return plus(lambda e: loop_only(preisach_loop(e.x, al, be, den), e.x))


def h_lugre(w, r, q):
    a = (logu(r, 0.01, 0.06), between(r, 0.1, 0.5), logu(r, 0.02, 0.2), between(r, 0.0, 0.3))
    g = sign(r)
    return plus(lambda e: g * loop_only(lugre_loop(e.x, H, *a), e.x))


def h_dahl_n(w, r, q):
    width, n, g, b = logu(r, 0.015, 0.08), between(r, 1.2, 2.5), sign(r), between(r, -0.4, 0.8)
    return plus(lambda e: g * loop_only(dahl_loop(e.x, width, n) * (1 + b * e.x / XMAX), e.x))


def h_iwan(w, r, q):
    lim = np.geomspace(0.004, between(r, 0.08, 0.2), 24)
    wei = 1.0 / (1.0 + lim / between(r, 0.01, 0.05)) ** between(r, 1.5, 2.5)
    g = sign(r)
    return plus(lambda e: g * loop_only(iwan_loop(e.x, lim, wei / wei.sum() / 0.02), e.x))


def h_jiles(w, r, q):
    a, k = between(r, 0.15, 0.5), between(r, 0.1, 0.35)
    al, c, g = between(r, 0.0, 0.1), between(r, 0.05, 0.3), sign(r)

    def u(e):
        # magnetised once all the way and back before
        tri = 1 - np.abs(np.linspace(-1.0, 1.0, 4000))
        run = np.concatenate([2 * tri - 1, 2 * tri - 1, e.x / 0.2 - 1.0])
        return g * loop_only(jiles_loop(run, a, k, al, c)[8000:], e.x)

    return plus(u)


def h_general_play(w, r, q):
    bend, g, top = between(r, 0.6, 1.8), sign(r), between(r, 0.04, 0.15)
    other = bend * between(r, 0.7, 1.4)

    def u(e):
        s, z = e.x / XMAX, 0.0
        for k in range(1, 6):
            half = top * k / 5
            z = z + wide_play(s**bend - half, np.maximum(s**other, s**bend) + half, 0.0) / k
        return g * loop_only(z, e.x)

    return plus(u)


# ---------------------------------------------------------------- relaxation


def memory(p, kernel):
    s = p[::SUB]
    return up(fftconvolve(np.diff(s, prepend=0.0), kernel(TS))[:N])


@njit(cache=True)
def eyring_loop(p, h, speed, scale):
    q = np.zeros(len(p))
    for i in range(1, len(p)):
        u = (p[i - 1] - q[i - 1]) / scale
        # exact for frozen p: tanh(u/2) decays exponentially
        y = np.tanh(0.5 * min(max(u, -40.0), 40.0)) * np.exp(-speed * h / scale)
        held = min(max(y, -1 + 1e-15), 1 - 1e-15)
        q[i] = p[i] - scale * 2.0 * np.arctanh(held) - (p[i] - p[i - 1])
    return q


@njit(cache=True)
def follow(u, tau):
    """dz/dt = (u - z) / tau_i, the time constants given per step as h / tau."""
    z = np.empty(len(u))
    z[0] = u[0]
    for i in range(1, len(u)):
        z[i] = u[i] + (z[i - 1] - u[i]) * np.exp(-tau[i])
    return z


def relaxing(r, part):
    mu, g = between(r, 0.0, 0.5), 1.0 if r.random() < 0.8 else -1.0
    return plus(lambda e: g * (lambda h: h - mu * e.s)(part(e)))


def r_springpot(w, r, q):
    order = between(r, 0.12, 0.4)
    taus = np.geomspace(0.1, 3000.0, 14)
    g = taus**-order / np.sum(taus**-order)
    return relaxing(
        r, lambda e: sum(k * (e.s - lp(e.s, tau)) for k, tau in zip(g, taus, strict=True))
    )


def r_kww(w, r, q):
    tau, b = logu(r, 2.0, 60.0), between(r, 0.35, 0.75)
    return relaxing(r, lambda e: memory(e.s, lambda t: np.exp(-((t / tau) ** b))))


def r_eyring(w, r, q):
    scale = between(r, 0.08, 0.25)
    speed = scale / logu(r, 5.0, 60.0)
    return relaxing(r, lambda e: e.s - eyring_loop(e.s, H, speed, scale))


def r_strain_clock(w, r, q):
    tau, k, b = logu(r, 4.0, 50.0), between(r, -2.0, 2.5), between(r, 0.0, 1.0)
    return relaxing(
        r,
        lambda e: (e.s - follow(e.s, H / tau * np.exp(k * e.x / XMAX))) * (1 + b * e.x / XMAX),
    )


def r_two_ways(w, r, q):  # three-element solid, another time constant while recovering
    tau, ratio = logu(r, 3.0, 25.0), logu(r, 1.5, 5.0)

    def part(e):
        slow = e.s - lp(e.s, tau) < 0
        return e.s - follow(e.s, H / tau / np.where(slow, ratio, 1.0))

    return relaxing(r, part)


def r_log_creep(w, r, q):
    t0, end = logu(r, 0.2, 3.0), logu(r, 150.0, 600.0)
    return relaxing(
        r, lambda e: memory(e.s, lambda t: np.maximum(1 - np.log1p(t / t0) / np.log1p(end / t0), 0))
    )


# ---------------------------------------------------------------- softening


def softened(share):
    return lambda e: (lambda d: lambda a: e.s * (1.0 - a * d))(share(e))


def energy(x):
    lam = 1.0 + x
    i1 = lam**2 + 2.0 / lam - 3.0
    return i1 + 0.15 * i1**2


def s_ogden_roxburgh(w, r, q):
    m, b = logu(r, 0.02, 0.12), between(r, 0.0, 0.5)

    def share(e):
        en = energy(e.x)
        top = np.maximum.accumulate(en)
        return erf((top - en) / (m + b * top))

    return softened(share)


def s_simo(w, r, q):
    k, p0 = between(r, 0.05, 0.25), between(r, 0.8, 1.6)
    return softened(lambda e: 1 - np.exp(-((np.maximum.accumulate(e.x) / k) ** p0)))


def s_dorfmann_ogden(w, r, q):
    m, set_, n = logu(r, 0.03, 0.2), between(r, 0.05, 0.3), between(r, 0.3, 1.0)

    def share(e):
        en = energy(e.x)
        top = np.maximum.accumulate(en)
        full = np.tanh((top - en) / m)
        rest = np.tanh((en / np.maximum(top, 1e-9)) ** n) / np.tanh(1.0)
        return full + set_ * (1.0 - rest) * np.tanh(top / m)

    return softened(share)


def s_fatigue(w, r, q):
    k, scale = between(r, 0.5, 2.5), between(r, 4.0, 25.0)

    def share(e):
        work = np.cumsum(np.abs(np.diff(e.x, prepend=e.x[0])) / (2 * XMAX) * (e.x / XMAX) ** k)
        return 1 - np.exp(-((work / scale) ** 0.7))

    return softened(share)


@njit(cache=True)
def break_loop(x, h, limits, weights, speed, heal):
    alive = np.ones(len(limits))
    lost = np.zeros(len(x))
    for i in range(1, len(x)):
        total = 0.0
        for j in range(len(limits)):
            over = x[i] - limits[j]
            if over > 0:
                alive[j] *= np.exp(-speed * over * h)
            else:
                alive[j] += heal * h * (1.0 - alive[j])
            total += weights[j] * (1.0 - alive[j])
        lost[i] = total
    return lost


def s_chains(w, r, q):
    lim = np.linspace(0.02, 0.39, 20)
    wei = np.exp(-0.5 * ((lim - between(r, 0.1, 0.3)) / between(r, 0.06, 0.15)) ** 2)
    speed = logu(r, 3.0, 60.0)
    return softened(lambda e: break_loop(e.x, H, lim, wei / wei.sum(), speed, 0.0))


def s_healing(w, r, q):
    lim = np.linspace(0.02, 0.39, 16)
    heal, speed = 1.0 / logu(r, 150.0, 900.0), logu(r, 50.0, 200.0)
    m = logu(r, 0.04, 0.15)
    return softened(
        lambda e: break_loop(e.x, H, lim, np.ones(16) / 16, speed, heal) * np.exp(-e.x / m / 3)
    )


# ---------------------------------------------------------------- overshoot


@njit(cache=True)
def junctions(v, h, broke, mend, order):
    n = np.ones(len(v))
    for i in range(1, len(v)):
        gone = 1.0 - n[i - 1]
        d = -broke * abs(v[i]) * n[i - 1] + mend * gone**order
        n[i] = min(max(n[i - 1] + h * d, 0.0), 1.0)
    return 1.0 - n


def o_junctions(w, r, q):
    broke, mend, b = logu(r, 0.5, 5.0), 1 / logu(r, 0.3, 2.0), between(r, 0.0, 1.0)
    return plus(lambda e: junctions(rate(e.x), H, broke, mend, 1.0) * (1 + b * e.s))


def o_second_order(w, r, q):
    broke, mend, b = logu(r, 1.0, 8.0), logu(r, 1.5, 8.0), between(r, 0.0, 0.6)
    return plus(lambda e: junctions(rate(e.x), H, broke, mend, 2.0) * (1 + b * e.s))


def o_power(w, r, q):
    m, tau, b = between(r, 0.5, 1.5), logu(r, 0.15, 1.2), between(r, 0.0, 1.0)
    return plus(lambda e: lp((np.abs(rate(e.x)) + 1e-6) ** m, tau) * (1 + b * e.s))


@njit(cache=True)
def since_reversal(x):
    d = np.zeros(len(x))
    way = 0.0
    for i in range(1, len(x)):
        dx = x[i] - x[i - 1]
        d[i] = d[i - 1] + abs(dx)
        if dx * way < 0:
            d[i] = abs(dx)
        if dx != 0:
            way = dx
    return d


def o_reversal_peaks(w, r, q):
    far, tau, floor = logu(r, 0.02, 0.1), logu(r, 0.2, 1.2), between(r, 0.2, 0.6)
    return plus(lambda e: lp(np.abs(rate(e.x)) * (floor + np.exp(-since_reversal(e.x) / far)), tau))


def o_tunnelling(w, r, q):
    tau, k, b = logu(r, 0.2, 1.5), between(r, 2.0, 8.0), between(r, 0.0, 0.8)
    return plus(lambda e: np.expm1(k * np.minimum(lp(np.abs(rate(e.x)), tau), 0.5)) * (1 + b * e.s))


# ---------------------------------------------------------------- slow


def timed(curve, g):
    c = g * curve
    return plus(lambda e: c)


def d_fick(w, r, q):
    tau = logu(r, 150.0, 1500.0)
    k = (2 * np.arange(40) + 1)[:, None] ** 2
    s = 1 - (8 / np.pi**2 / k * np.exp(-k * TS / tau)).sum(axis=0)
    return timed(up(s - s[0]), sign(r))


def d_log(w, r, q):
    return timed(np.log1p(T / logu(r, 3.0, 120.0)), sign(r))


def d_power(w, r, q):
    return timed((T / 400.0) ** between(r, 0.25, 0.85), sign(r))


def d_two_exp(w, r, q):
    a, b, c = logu(r, 15.0, 80.0), logu(r, 200.0, 900.0), between(r, 0.2, 0.8)
    return timed(c * (1 - np.exp(-T / a)) + (1 - c) * (1 - np.exp(-T / b)), sign(r))


def d_deal_grove(w, r, q):
    thick, slow = 1.0, logu(r, 40.0, 400.0)
    return timed(thick * (np.sqrt(1 + 4 * T / slow) - 1), sign(r))


def d_oxide(w, r, q):  # grows at a constant rate until the surface is used up
    end, knee = between(r, 150.0, 380.0), between(r, 10.0, 50.0)
    return timed((T - knee * np.logaddexp(0.0, (T - end) / knee)) / end, sign(r))


def w_brown(w, r, q):
    return timed(up(np.cumsum(r.standard_normal(N))) / 100, 1.0)


def w_ou(w, r, q):
    k = np.exp(-DT / logu(r, 60.0, 300.0))
    s = lfilter([1.0], [1.0, -k], r.standard_normal(N))
    return timed(up(s) / 100, 1.0)


def spectral(r, power):
    n = 1 << 15
    f = np.fft.rfftfreq(n, DT)
    amp = np.where(f > 0, np.maximum(f, 1e-9) ** (-power / 2), 0.0)
    z = (r.standard_normal(len(f)) + 1j * r.standard_normal(len(f))) * amp
    s = np.fft.irfft(z)[:N]
    return (s - s[0]) / s.std()


def w_flicker(w, r, q):
    s = lp(spectral(r, 1.15), logu(r, 1.0, 5.0), DT)
    return timed(up(s - s[0]), 1.0)


def w_fractional(w, r, q):
    return timed(up(spectral(r, between(r, 1.5, 2.6))), 1.0)


def w_heavy(w, r, q):
    s = np.cumsum(np.clip(r.standard_t(3.0, N), -8, 8))
    return timed(up(lp(s, between(r, 0.5, 3.0), DT)) / 100, 1.0)


# ---------------------------------------------------------------- gain and step


def scaled(course, zero=0.0):
    return lambda e: (lambda k: lambda a: e.s + a * k * (e.s - zero))(course(e))


def g_gauge(w, r, q):
    g = sign(r)
    return scaled(lambda e: g)


def g_zero_slope(w, r, q):
    g, zero = sign(r), between(r, 0.2, 1.0)
    return scaled(lambda e: g, zero)


def g_age_linear(w, r, q):
    g, b = sign(r), between(r, 0.0, 0.5)
    return scaled(lambda e: g * (b + T / 400.0))


def travel(x):
    return np.cumsum(np.abs(np.diff(x, prepend=x[0]))) / (2 * XMAX)


def g_age_cycles(w, r, q):
    g, m = sign(r), between(r, 0.4, 0.7)
    return scaled(lambda e: g * (travel(e.x) / 30.0) ** m)


def g_warm_amp(w, r, q):
    g, tau = sign(r), logu(r, 80.0, 400.0)
    return scaled(lambda e: g * (1 - np.exp(-T / tau)))


def g_fading(w, r, q):  # gauge factor falls by a share of what is left, per cycle
    k, g = logu(r, 0.02, 0.15), sign(r)
    return scaled(lambda e: g * -np.expm1(-k * travel(e.x)))


def after(w):
    return T - w.onset


def t_slip(w, r, q):
    return timed((after(w) >= 0) * 1.0, sign(r))


def t_partial(w, r, q):
    tau, back = logu(r, 4.0, 40.0), between(r, 0.25, 0.65)
    t = np.maximum(after(w), 0.0)
    return timed((after(w) >= 0) * (1 - back * -np.expm1(-t / tau)), sign(r))


def t_gain(w, r, q):
    g = sign(r)
    return scaled(lambda e: g * (after(w) >= 0))


def t_zero_gain(w, r, q):
    g, zero = sign(r), -between(r, 0.2, 1.0) * sign(r)
    return scaled(lambda e: g * (after(w) >= 0), zero)


def t_settling(w, r, q):
    tau, over = logu(r, 0.15, 1.5), between(r, -0.5, 0.5)
    t = np.maximum(after(w), 0.0)
    return timed((after(w) >= 0) * (1 + over * np.exp(-t / tau)) * -np.expm1(-t / 0.1), sign(r))


# ---------------------------------------------------------------- lag (fine codes)


def box(y, width):
    c = np.concatenate([[0.0], np.cumsum(y) * H])
    at = np.arange(NF + 1) * H
    k = np.maximum(width, H)
    past = np.interp(at - k, at, c) + np.minimum(at - k, 0.0) * y[0]
    return ((c - past) / k)[1:]


def l_two_poles(w, r, q):
    k = between(q, 0.2, 0.9)
    return lambda e: lambda a: lp(lp(e.s, a / (1 + k)), a * k / (1 + k))


def l_boxcar(w, r, q):
    return lambda e: lambda a: box(e.s, 2 * a)


@njit(cache=True)
def integer_smoothing(y, share, bits):
    out = np.empty(len(y))
    one = 1 << bits
    acc = int(y[0]) * one
    for i in range(len(y)):
        acc += (share * (int(y[i] + 0.5) * one - acc)) >> 12
        out[i] = acc / one
    return out


def l_integer(w, r, q):
    bits = int(q.integers(5, 9))
    return lambda e: (
        lambda a: integer_smoothing(e.s, max(int(4096 * -np.expm1(-H / max(a, H))), 1), bits)
    )


def l_sinc3(w, r, q):
    return lambda e: lambda a: box(box(box(e.s, a * 2 / 3), a * 2 / 3), a * 2 / 3)


def l_strain_rc(w, r, q):  # the sensor's own resistance charges the capacitor
    def f(e):
        c = w.sensors[e.c]
        share = (e.s - readout(c, 0.0)) / (readout(c, 1.0) - readout(c, 0.0))
        res = np.maximum(1 + c.change * share, 0.05)
        return lambda a: follow(e.s, H / (a * res))

    return f


@njit(cache=True)
def bessel_loop(y, h, wn, zeta):
    z = np.empty(len(y))
    u, v = y[0], 0.0
    for i in range(len(y)):
        for _ in range(4):
            v += 0.25 * h * (wn * wn * (y[i] - u) - 2 * zeta * wn * v)
            u += 0.25 * h * v
        z[i] = u
    return z


def l_bessel(w, r, q):
    zeta = between(q, 0.8, 0.9)
    return lambda e: lambda a: bessel_loop(e.s, H, min(2 * zeta / a, 400.0), zeta)


# ---------------------------------------------------------------- saturation (fine codes)


def top_of(w, e):
    c = w.sensors[e.c]
    return c.low + c.span, c.span


def a_hard(w, r, q):
    return lambda e: lambda a: np.minimum(e.s, top_of(w, e)[0] - a * top_of(w, e)[1])


def a_rail(w, r, q):
    soft = between(r, 0.015, 0.06)

    def g(e, a):
        top, span = top_of(w, e)
        k = soft * span
        m = top - a * span
        return e.s - k * np.logaddexp(0.0, (e.s - m) / k)

    return lambda e: lambda a: g(e, a)


def bent(shape, room):
    """Unchanged below the knee; above, ``room`` (a share of the span) is left."""

    def g(w, e, a):
        top, span = top_of(w, e)
        knee, left = top - a * span, room * a * span
        over = np.maximum(e.s - knee, 0.0) / max(left, 1e-9)
        return np.minimum(e.s, knee) + left * shape(over)

    return g


def a_tanh(w, r, q):
    g = bent(np.tanh, between(r, 0.15, 0.6))
    return lambda e: lambda a: g(w, e, a)


def a_rational(w, r, q):
    g = bent(lambda u: u / (1 + u), between(r, 0.2, 0.8))
    return lambda e: lambda a: g(w, e, a)


def a_fold(w, r, q):  # a rail that gives way: a small slope is left
    slope = between(r, 0.02, 0.2)

    def g(e, a):
        top, span = top_of(w, e)
        m = top - a * span
        return np.where(e.s > m, m + slope * (e.s - m), e.s)

    return lambda e: lambda a: g(e, a)


# ---------------------------------------------------------------- converter (sampled codes)


def code_error(curve):
    return lambda e: lambda a: e.s + a * curve(e.s)


def over_range(w, shape):
    """A smooth error over the range that the amplifier gives this channel, gain and zero right."""

    def f(e):
        c = w.sensors[e.c]
        used = np.linspace(0.0, 1.0, 101)
        line = np.polyfit(used, shape(used), 1)
        u = np.clip((e.s - c.low) / c.span, -0.4, 1.4)
        d = shape(u) - np.polyval(line, u)
        d = d / rms(shape(used) - np.polyval(line, used))
        return lambda a: e.s + a * d

    return f


def c_bow(w, r, q):
    skew, g = between(r, -0.4, 0.4), sign(r)
    return over_range(w, lambda u: g * u * (1 - u) * (1 + skew * (2 * u - 1)))


def c_s(w, r, q):
    m, ph, g = between(r, 0.7, 1.6), between(r, -0.6, 0.6), sign(r)
    return over_range(w, lambda u: g * np.sin(2 * np.pi * m * u + ph))


def c_missing(w, r, q):
    every, off = int(r.choice([64, 96, 128, 192])), int(r.integers(64))

    def f(e):
        at = np.floor(e.s + 0.5)
        part = np.mod(at - off, every)
        # the last a codes before a major transition do not exist
        wide = every * 0.8
        return lambda a: np.where(part > every - 1 - min(2 * a, wide), at - part + every, e.s)

    return f


def c_capacitors(w, r, q):
    bits = 2.0 ** np.arange(12)
    err = r.standard_normal(12) * np.sqrt(bits)
    err[11] += 20 * sign(r)
    err /= np.sqrt(np.sum(err**2))

    def curve(c):
        n = np.clip(np.floor(c + 0.5), 0, 4095).astype(np.int64)
        bit = (n[..., None] >> np.arange(12)) & 1
        full = np.sum(err)
        return bit @ err - full * n / 4095

    return code_error(curve)


def c_segments(w, r, q):
    n = int(r.choice([16, 24, 32]))
    knots = np.concatenate([[0.0], np.cumsum(r.standard_normal(n))])
    knots -= np.linspace(0, knots[-1], n + 1)
    jump = r.standard_normal(n) * 0.4
    knots /= max(np.std(knots), 1e-6)

    def curve(c):
        u = np.clip(c / 4095 * n, 0, n - 1e-9)
        return np.interp(u, np.arange(n + 1), knots) + jump[np.floor(u).astype(int)]

    return code_error(curve)


# ---------------------------------------------------------------- crosstalk (fine, all channels)


def k_capacitor(w, r, q):  # what is left of the channel scanned before
    return lambda e: lambda a: e.s + a * (e.all[:, e.c - 1] - e.s)


def k_matrix(w, r, q):  # rows and columns leak, most from the neighbours
    def f(e):
        n = e.all.shape[1]
        wei = r.uniform(0.2, 1.0, n) / (1.0 + np.abs(np.arange(n) - e.c)) ** 2
        wei[e.c] = 0.0
        u = (e.all - e.s[:, None]) @ (wei / wei.sum())
        return lambda a: e.s + a * u

    return f


def k_supply(w, r, q):  # the others' currents pull down the reference
    part = between(r, 0.5, 1.0)

    def f(e):
        other = (e.all.sum(axis=1) - e.s) / (e.all.shape[1] - 1) / 4095
        return lambda a: e.s * (1 - a * part * other)

    return f


def k_edges(w, r, q):
    tau, g = logu(r, 0.05, 0.3), sign(r)

    def f(e):
        j = (e.c + int(r.integers(1, e.all.shape[1]))) % e.all.shape[1]
        u = e.all[:, j]
        d = (u - lp(u, tau)) * g
        return lambda a: e.s + 8 * a * d

    return f


def k_absorption(w, r, q):  # the capacitor's dielectric gives back an older part too
    tau, mix = logu(r, 0.3, 3.0), between(r, 0.3, 0.8)

    def f(e):
        u = e.all[:, e.c - 1]
        d = (1 - mix) * u + mix * lp(u, tau) - e.s
        return lambda a: e.s + a * d

    return f


# ---------------------------------------------------------------- added at the samples


def tone(r, phase, shape=np.cos):
    return plus(lambda e: shape(phase + between(r, 0, 2 * np.pi)))


def i_mains(w, r, q):
    f = (50.0 if q.random() < 0.7 else 150.0) + between(q, 0.02, 2.5) * sign(q)
    return tone(r, 2 * np.pi * f * TS)


def i_harmonics(w, r, q):
    f, n, fall = between(q, 0.8, 3.0), int(q.integers(2, 5)), between(q, 0.5, 1.5)
    return tone(
        r, 2 * np.pi * f * TS, lambda ph: sum(np.cos(k * ph + k) / k**fall for k in range(1, n + 1))
    )


def i_wander(w, r, q):
    f = between(q, 2.0, 8.0) + gaussian_filter1d(q.standard_normal(N), 200) * between(q, 0.5, 1.5)
    return tone(r, 2 * np.pi * np.cumsum(f) * DT)


def i_modulated(w, r, q):
    f, slow, depth = between(q, 1.5, 9.0), 1 / logu(q, 15.0, 120.0), between(q, 0.4, 1.0)
    swell = 1 + depth * np.cos(2 * np.pi * slow * TS + between(q, 0, 6))
    return tone(r, 2 * np.pi * f * TS, lambda ph: swell * np.cos(ph))


def i_pwm(w, r, q):
    f, duty = 490.0 + between(q, 1.0, 8.0) * sign(q), between(q, 0.15, 0.85)
    return tone(r, 2 * np.pi * f * TS, lambda ph: (np.mod(ph / 2 / np.pi, 1.0) < duty) - duty)


def train(r, size, kernel=(1.0,), rate_=None):
    rate_ = rate_ if rate_ is not None else logu(r, 0.003, 0.012)
    hit = r.random(N) < rate_
    if not hit[:N1].any():
        hit[int(r.integers(N1))] = True
    s = np.zeros(N)
    s[hit] = size(int(hit.sum()))
    return timed(np.convolve(s, kernel)[:N], 1.0)


def p_poisson(w, r, q):
    g = sign(r)
    return train(r, lambda n: g * r.uniform(0.7, 1.3, n))


def p_tail(w, r, q):
    g, tau = sign(r), between(r, 0.8, 3.0)
    return train(r, lambda n: g * r.uniform(0.5, 1.5, n), np.exp(-np.arange(20) / tau))


def p_bursts(w, r, q):
    s = np.zeros(N)
    for at in np.flatnonzero(r.random(N) < logu(r, 0.0015, 0.004)).tolist() + [int(r.integers(N1))]:
        n = int(r.integers(3, 12))
        i = at + np.sort(r.choice(3 * n, n, replace=False))
        s[i[i < N]] = r.uniform(0.5, 1.5, n)[i < N]
    return timed(s, sign(r))


def p_bipolar(w, r, q):
    return train(
        r, lambda n: r.choice([-1.0, 1.0], n) * r.uniform(0.6, 1.4, n), (1.0, -between(r, 0.3, 0.9))
    )


def p_heavy(w, r, q):
    tail, g = between(r, 1.5, 3.0), sign(r)
    return train(r, lambda n: g * np.minimum(1 + r.pareto(tail, n), 8.0))


def n_level(w, r, q):
    return timed(r.standard_normal(N), 1.0)


def n_strain(w, r, q):
    z, k, inv = r.standard_normal(N), between(r, 1.0, 2.5), r.random() < 0.3
    return plus(lambda e: z * (1e-2 + (1 - e.xs / XMAX if inv else e.xs / XMAX)) ** k)


def n_speed(w, r, q):
    z, k = r.standard_normal(N), between(r, 0.5, 1.2)
    return plus(lambda e: z * (2e-3 + np.abs(np.gradient(e.xs, DT))) ** k)


def n_flicker(w, r, q):  # one over f above some tenths of a hertz
    z = spectral(r, between(r, 0.5, 1.0))
    return timed(z - lp(z, between(r, 0.2, 0.8), DT), 1.0)


def n_heavy(w, r, q):
    return timed(np.clip(r.standard_t(between(r, 3.0, 5.0), N), -12, 12), 1.0)


def n_coarse(w, r, q):  # a dithered step of a coarse converter
    step = between(r, 1.0, 2.2)
    return timed(step * np.round(r.standard_normal(N) / step), 1.0)


# ---------------------------------------------------------------- motion effects


def b_play(w, r, q):
    return lambda e: lambda a: wide_play(e.s - a / 2, e.s + a / 2, -1.0)


def b_slack_start(w, r, q):  # slack to be taken up from rest, and some play
    part, at = between(r, 0.3, 0.7), between(r, 0.0, 0.2)

    def g(x, a):
        dead = a * (1 - part)
        y = np.where(x > at + dead, x - dead, np.minimum(x, at))
        return wide_play(y - a * part / 2, y + a * part / 2, 0.0)

    return lambda e: lambda a: g(e.s, a)


def b_compliant(w, r, q):  # flanks of rubber; the gap transmits a little
    leak = between(r, 0.05, 0.3)
    return lambda e: lambda a: (1 - leak) * iwan_free(e.s, a / (1 - leak)) + leak * e.s


def iwan_free(x, width):
    return sum(wide_play(x - width * k, x + width * k, 0.0) for k in (0.3, 0.45, 0.6)) / 3


def b_capstan(w, r, q):  # Coulomb friction along a sheath: lost motion in proportion to tension
    base = between(r, 0.1, 0.5)

    def g(x, a):
        half = a * (base + (1 - base) * np.maximum(x, 0) / XMAX)
        return wide_play(x - half, x + half, 0.0)

    return lambda e: lambda a: g(e.s, a)


@njit(cache=True)
def sprung_play(x, width, share, h, tau):
    """One-sided play whose gap is closed by a weak spring, slowly."""
    z = np.zeros(len(x))
    for i in range(1, len(x)):
        y = z[i - 1] + (x[i] - z[i - 1]) * (1.0 - np.exp(-h / tau))
        z[i] = min(max(y, x[i] - width * share), x[i] + width * (1.0 - share))
    return z


def b_sprung(w, r, q):
    share, tau = between(r, 0.0, 0.25), logu(r, 15.0, 90.0)
    return lambda e: lambda a: sprung_play(e.s, a, share, H, tau)


def late(shape):
    s = shape
    return lambda e: lambda a: np.interp(T - a * s, T, e.s)


def y_offset(w, r, q):
    return late(1.0)


def y_skew(w, r, q):
    return late(T / 400.0)


def y_offset_skew(w, r, q):
    k = between(r, 0.3, 0.7)
    return late((1 - k) + k * T / 400.0)


def y_lost(w, r, q):
    k, at = between(r, 0.0, 0.4), between(r, 100.0, 300.0)
    return late(np.where(at < T, 1.0, k))


def y_wander(w, r, q):
    s = gaussian_filter1d(r.standard_normal(N), between(r, 30.0, 90.0) / DT, mode="reflect")
    s = np.cumsum(s - s.mean()) if r.random() < 0.3 else s
    return late(up(0.55 + 0.45 * (s - s.mean()) / np.abs(s - s.mean()).max()))


# ---------------------------------------------------------------- foreign


@njit(cache=True)
def peel_loop(x, thresholds, back):
    o = np.zeros(len(x))
    k = 0
    for i in range(1, len(x)):
        o[i] = o[i - 1]
        if abs(x[i] - o[i]) > thresholds[k % len(thresholds)]:
            o[i] += back[k % len(back)] * (x[i] - o[i])
            k += 1
    return o


def f_peel(w, r, q):
    thr, back = r.uniform(0.08, 0.24, 500), r.uniform(0.2, 0.9, 500)
    return plus(lambda e: -peel_loop(e.x, thr, back) / XMAX)


@njit(cache=True)
def leak_loop(x, h, tau, refill):
    """What a closed chamber has lost; the valve refills it whenever more is asked for."""
    lost = np.zeros(len(x))
    for i in range(1, len(x)):
        dx = x[i] - x[i - 1]
        d = -lost[i - 1] / refill if dx > 1e-7 else (x[i] - lost[i - 1]) / tau
        lost[i] = lost[i - 1] + h * d
    return lost


def f_leak(w, r, q):
    tau, refill = logu(r, 8.0, 40.0), logu(r, 0.2, 1.0)
    return lambda e: (lambda u: lambda a: e.s - a * u)(leak_loop(e.s, H, tau, refill))


@njit(cache=True)
def snap_loop(x, high, low, h, tau):
    z = np.zeros(len(x))
    state = 0.0
    for i in range(1, len(x)):
        if x[i] > high:
            state = 1.0
        elif x[i] < low:
            state = 0.0
        z[i] = z[i - 1] + (state - z[i - 1]) * (1 - np.exp(-h / tau))
    return z


def f_snap(w, r, q):
    hi, lo = between(r, 0.6, 0.85), between(r, 0.2, 0.45)
    tau, g, b = logu(r, 0.02, 0.1), sign(r), between(r, -0.6, 0.6)

    def u(e):
        q1, q2 = np.quantile(w.x[: N1 * SUB], [lo, hi])
        return g * snap_loop(e.x, q2, q1, H, tau) * (1 + b * e.x / XMAX)

    return plus(u)


def f_short(w, r, q):
    mid, wide, to = between(r, 0.25, 0.75), between(r, 0.08, 0.2), between(r, 700.0, 3300.0)
    on, off, u = between(r, 0.1, 0.4), between(r, 0.1, 0.4), r.random(N)

    def f(e):
        a0, a1 = np.quantile(w.x[: N1 * SUB], [max(mid - wide, 0), min(mid + wide, 1)])
        state, z = 0, np.zeros(N)
        for i in range(N):
            inside = a0 <= e.xs[i] <= a1
            state = int(inside and (u[i] < on if state == 0 else u[i] > off))
            z[i] = state
        return lambda a: e.s + a * z * (to - e.s)

    return f


def f_axis(w, r, q):
    """Bending across, in bouts, that nobody records; shared by the channels, each its own gain."""
    wave = gaussian_filter1d(q.standard_normal(N), between(q, 0.4, 1.5) / DT)
    wave = wave / wave.std() * (gaussian_filter1d(q.standard_normal(N), 15 / DT) > 0)
    wave = gaussian_filter1d(wave, 0.2 / DT)
    sq, g, k = between(r, 0.0, 0.5), sign(r), between(r, 0.0, 1.0)
    return plus(lambda e: g * up(wave + sq * wave**2) * (1 + k * e.s))


def f_sag(w, r, q):
    """The reference drops when the pump starts (the actuator begins to fill) and comes back."""
    tau, still = logu(q, 0.4, 2.5), between(q, 0.3, 1.0)
    hum = between(q, 0.1, 0.5)

    def f(e):
        fills = rate(w.x) > 5e-3
        ago = np.where(fills, T, -9.0)
        last = np.concatenate([[-9.0], np.maximum.accumulate(ago)[:-1]])
        start = fills & (T - last > still)
        k = np.exp(-H / tau)
        d = np.minimum(lfilter([1.0], [1.0, -k], start * 1.0), 1.5) + hum * lp(fills * 1.0, 0.1)
        return lambda a: e.s * (1 - a * d)

    return f


def f_sweat(w, r, q):
    """Effort wets the dielectric beyond a threshold; it dries slowly and by itself."""
    tau, dry = logu(q, 8.0, 30.0), logu(q, 60.0, 200.0)
    k = between(r, 0.3, 1.5)

    def u(e):
        effort = lp(rate(e.x) ** 2, tau)
        wet = np.maximum(effort - np.quantile(effort[: N1 * SUB], 0.45), 0.0)
        wet = lp(wet / (wet.std() + 1e-12), dry)
        return wet / (1 + wet) * (1 + k * e.s)

    return plus(u)


@njit(cache=True)
def slewed(y, step, band):
    b = np.empty(len(y))
    b[0] = y[0]
    for i in range(1, len(y)):
        d = y[i] - b[i - 1]
        b[i] = b[i - 1] + (step if d > band else -step if d < -band else 0.0)
    return b


def f_tracker(w, r, q):
    """A touch controller's baseline creeps after the signal at a fixed pace, and is subtracted."""
    pace, band = logu(q, 4.0, 30.0), between(q, 5.0, 60.0)
    return lambda e: (lambda b: lambda a: e.s - a * (b - b[0]))(slewed(e.s, pace * H, band))


# ---------------------------------------------------------------- tables

STAGES = {
    "motion": ("backlash", "delay", "chamber_leak"),
    "material": ("bond_peel", "hysteresis", "relaxation", "softening", "bistable_snap", "overshoot",
                 "hidden_axis", "sweat", "drift", "random_walk", "gain", "step"),
    "wire": ("lag", "saturation", "crosstalk", "pump_sag", "baseline_tracker"),
    "sample": ("intermittent_short", "interference", "spikes", "noise"),
    "converter": ("adc_nonlinearity",),
}  # fmt: skip
STAGE = {n: s for s, names in STAGES.items() for n in names}
ORDER = tuple(STAGE)
TABLE = {
    "backlash": (b_play, b_slack_start, b_compliant, b_capstan, b_sprung),
    "delay": (y_offset, y_skew, y_offset_skew, y_lost, y_wander),
    "hysteresis": (h_preisach, h_lugre, h_dahl_n, h_iwan, h_jiles, h_general_play),
    "relaxation": (r_springpot, r_kww, r_eyring, r_strain_clock, r_two_ways, r_log_creep),
    "softening": (s_ogden_roxburgh, s_simo, s_dorfmann_ogden, s_fatigue, s_chains, s_healing),
    "overshoot": (o_junctions, o_second_order, o_power, o_reversal_peaks, o_tunnelling),
    "drift": (d_fick, d_log, d_power, d_two_exp, d_deal_grove, d_oxide),
    "random_walk": (w_brown, w_ou, w_flicker, w_fractional, w_heavy),
    "gain": (g_gauge, g_zero_slope, g_age_linear, g_age_cycles, g_warm_amp, g_fading),
    "step": (t_slip, t_partial, t_gain, t_zero_gain, t_settling),
    "lag": (l_two_poles, l_boxcar, l_integer, l_sinc3, l_strain_rc, l_bessel),
    "saturation": (a_hard, a_rail, a_tanh, a_rational, a_fold),
    "adc_nonlinearity": (c_bow, c_s, c_missing, c_capacitors, c_segments),
    "crosstalk": (k_capacitor, k_matrix, k_supply, k_edges, k_absorption),
    "interference": (i_mains, i_harmonics, i_wander, i_modulated, i_pwm),
    "spikes": (p_poisson, p_tail, p_bursts, p_bipolar, p_heavy),
    "noise": (n_level, n_strain, n_speed, n_flicker, n_heavy, n_coarse),
}
OUTSIDE = {
    "bond_peel": f_peel, "chamber_leak": f_leak, "bistable_snap": f_snap,
    "intermittent_short": f_short, "hidden_axis": f_axis, "pump_sag": f_sag, "sweat": f_sweat,
    "baseline_tracker": f_tracker,
}  # fmt: skip
NAMES = tuple(TABLE)
FOREIGN = tuple(OUTSIDE)
MAKERS = {n: {f.__name__.split("_", 1)[1]: f for f in fs} for n, fs in TABLE.items()}
EQUATIONS: dict[str, tuple[str, ...]] = {n: tuple(m) for n, m in MAKERS.items()}


# ---------------------------------------------------------------- a case


class World:
    def __init__(self, seed, excitation):
        self.seed = seed
        self.x = whole_motion(seed, excitation)
        r = stream(seed, "sensors")
        self.channels = int(r.integers(3, 8))
        self.sensors = [sensor(stream(seed, "sensor", i)) for i in range(self.channels)]
        level, apart = r.uniform(0.0, 1.0, (2, self.channels))
        level = 0.66 * 3.5**level
        self.noise = np.stack([level, level * (0.9 + 0.2 * apart)])  # sim, real
        self.onset = between(stream(seed, "onset"), 70.0, 330.0)
        # nominal signals at the end of each stage
        self.p = [own_material(s, self.x) for s in self.sensors]
        self.y = np.stack([self.wire(i, p) for i, p in enumerate(self.p)], axis=1)

    def wire(self, i, p):
        return own_wire(self.sensors[i], readout(self.sensors[i], p))


def env(c, s, x, matrix=None):
    return SimpleNamespace(c=c, s=s, x=x, xs=x[::SUB], all=matrix)


def solve(measure, cap):
    """Amplitude at which the measure is 1, or the cap."""
    if measure(cap) <= 1.0:
        return cap
    lo, hi = np.log(cap) - 18.0, np.log(cap)
    for _ in range(19):
        mid = (lo + hi) / 2
        lo, hi = (lo, mid) if measure(np.exp(mid)) > 1.0 else (mid, hi)
    return float(np.exp(lo))


def size_of(w, c, d, times):
    return max(rms(d[:N1]) / (times * w.noise[1, c]), np.abs(d).max() / (0.5 * w.sensors[c].span))


def hidden(w, name, forced):
    """Channels, equation on each and amplitude on each, set with this effect alone."""
    r = stream(w.seed, "hidden", name)
    stage, n = STAGE[name], w.channels
    k = int(r.integers(1, n + 1))
    ch = list(range(n)) if stage == "motion" else sorted(r.choice(n, k, replace=False).tolist())
    times = np.exp(r.uniform(np.log(3.0), np.log(30.0), n))
    if name in MAKERS:
        options = EQUATIONS[name]
        eq = forced or options[int(stream(w.seed, "equation", name).integers(len(options)))]
        maker = MAKERS[name][eq]
    else:
        maker = OUTSIDE[name]

    def fresh(c):
        return maker(w, stream(w.seed, "own", name, c), stream(w.seed, "shared", name))

    cap = CAP.get(name, 200.0 if stage in ("material", "motion") else 3000.0)
    if stage == "motion":
        g = fresh(0)(env(0, w.x, w.x))

        def ratios(a):
            x = g(a)
            d = [(w.wire(c, own_material(w.sensors[c], x)) - w.y[:, c])[::SUB] for c in ch]
            return np.array([rms(d[c][:N1]) / w.noise[1, c] for c in ch]) + 1e-9

        # the channels share one width or one clock: their mean as drawn, the least at least 3
        # times its noise, the most at most 30 times and half the span (this one wins)
        mean = solve(lambda a: np.exp(np.log(ratios(a)).mean()) / times[0], cap)
        least = solve(lambda a: ratios(a).min() / 3.0, cap)

        def most(a):
            x = g(a)
            d = [(w.wire(c, own_material(w.sensors[c], x)) - w.y[:, c])[::SUB] for c in ch]
            return max(size_of(w, c, d[c], 30.0) for c in ch)

        a = min(max(mean, least), solve(most, cap))
        return ch, fresh, dict.fromkeys(ch, a)
    amount = {}
    for c in ch:
        if stage == "material":
            g = fresh(c)(env(c, w.p[c], w.x))

            def out(a, c=c, g=g):
                return w.wire(c, g(a))[::SUB]

        elif stage == "wire":
            g = fresh(c)(env(c, w.y[:, c], w.x, w.y))

            def out(a, g=g):
                return g(a)[::SUB]

        else:
            out = fresh(c)(env(c, w.y[::SUB, c], w.x))
        base, most = w.y[::SUB, c], times[c]

        def size(a, c=c, out=out, base=base, most=most):
            return size_of(w, c, out(a) - base, most)

        amount[c] = solve(size, cap)
    return ch, fresh, amount


def make(
    seed: int,
    names: tuple[str, ...],
    excitation: str,
    equation: dict[str, str] | None = None,
) -> Case:
    w = World(seed, excitation)
    todo = {n: hidden(w, n, (equation or {}).get(n)) for n in sorted(set(names), key=ORDER.index)}
    at = {s: [n for n in todo if STAGE[n] == s] for s in STAGES}
    x = w.x
    for n in at["motion"]:
        _, fresh, amount = todo[n]
        x = fresh(0)(env(0, x, x))(amount[0])
    y = np.empty_like(w.y)
    for c in range(w.channels):
        p = own_material(w.sensors[c], x)
        for n in at["material"]:
            ch, fresh, amount = todo[n]
            if c in ch:
                p = fresh(c)(env(c, p, x))(amount[c])
        y[:, c] = w.wire(c, p)
    for n in at["wire"]:
        ch, fresh, amount = todo[n]
        before = y.copy()
        for c in ch:
            y[:, c] = fresh(c)(env(c, before[:, c], x, before))(amount[c])
    clean = y[::SUB].copy()
    for n in at["sample"]:
        ch, fresh, amount = todo[n]
        for c in ch:
            clean[:, c] = fresh(c)(env(c, clean[:, c], x))(amount[c])
    noise = [stream(seed, "noise", k).standard_normal(clean.shape) * w.noise[k] for k in (0, 1)]
    real = clean + noise[1]
    for n in at["converter"]:
        ch, fresh, amount = todo[n]
        for c in ch:
            clean[:, c] = fresh(c)(env(c, clean[:, c], x))(amount[c])
            real[:, c] = fresh(c)(env(c, real[:, c], x))(amount[c])
    nominal = w.y[::SUB]
    sim = nominal + noise[0]

    def cut(label, codes, part):
        return converted(label, codes[part], w.x[::SUB][part])

    one, two = slice(0, N1), slice(N1 + REST, N)
    return Case(
        sim=cut("sim1", sim, one),
        real=cut("real1", real, one),
        sim2=cut("sim2", sim, two),
        real2=cut("real2", real, two),
        change=(clean - nominal)[:N1],
        floors=np.sqrt((w.noise**2).sum(axis=0) + 1 / 6),
        truth={n: tuple(todo[n][0]) for n in dict.fromkeys(names)},
        excitation=excitation,
        onset_s=w.onset if "step" in names else None,
        unseen=False,
    )
