"""Cases of a gap of a third origin: liquid metal and capacitive gauges in dividers, which remember
as Oldroyd's fluid does.

Equations from magnetics, ferroelectrics, biomechanics, polymer physics, electronics and metrology,
written without a look at this project. Sizes are in noises of the real recording; where rails, gaps
of a converter or the longest delay allow no more, less.
"""

from __future__ import annotations

import numpy as np
from cases import Case
from scipy.signal import butter, fftconvolve, lfilter, sosfilt
from scipy.special import erf, exp1, wrightomega

from softsense.recording import FrontEnd, Recording

MOTION = ("backlash", "delay")
MATERIAL = (
    "hysteresis",
    "relaxation",
    "softening",
    "overshoot",
    "drift",
    "random_walk",
    "gain",
    "step",
)
ELECTRICAL = (
    "lag",
    "saturation",
    "adc_nonlinearity",
    "crosstalk",
    "interference",
    "spikes",
    "noise",
)
NAMES = MOTION + MATERIAL + ELECTRICAL
FOREIGN = (
    "thermal_wave",
    "stuck_reading",
    "cycle_fatigue",
    "toe_slack",
    "mount_ringing",
    "viscous_rate",
)
RETUNED: tuple[str, ...] = ()
EXCITATIONS = ("rich", "typical", "poor")
ON_ALL = ("backlash", "delay", "mount_ringing")

FS, N1, NB, N2 = 20.0, 8000, 100, 4000
T = N1 + NB + N2
UP = 3
TH = T * UP
FH = FS * UP
DT = 1.0 / FS
TIME = np.arange(T) / FS
TIME_H = np.arange(TH) / FH
TOP = 0.4
LOW, HIGH = 8.0, 4087.0


# ------------------------------------------------------------------ motion
def _jerk(n):
    s = np.linspace(0.0, 1.0, n + 1)[1:]
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def _band(rng, n, fc):
    pad = int(20 * FH)
    w = sosfilt(butter(4, fc / (FH / 2), output="sos"), rng.standard_normal(n + pad))[pad:]
    return w / w.std()


def _rich(rng, n, growing):
    parts, have, here = [], 0, 0.0
    while have < n:
        frac = min(1.0, have / (0.7 * n)) if growing else 1.0
        cap = TOP * (0.2 + 0.8 * frac)
        kind = rng.integers(0, 5)
        if kind == 0:  # step and hold
            to = rng.uniform(0, cap)
            m = max(6, int(FH * rng.uniform(0.12, 0.3)))
            parts.append(here + (to - here) * _jerk(m))
            parts.append(np.full(int(FH * rng.uniform(2, 15)), to))
            here = to
        elif kind == 1:  # ramps at one of several speeds
            v = rng.choice([0.01, 0.03, 0.1, 0.3, 0.6])
            for _ in range(int(rng.integers(1, 4)) if v < 0.05 else int(rng.integers(3, 8))):
                to = rng.uniform(0, cap)
                m = max(6, int(FH * abs(to - here) / v))
                parts.append(np.linspace(here, to, m + 1)[1:])
                here = to
            parts.append(np.full(int(FH * rng.uniform(0.2, 4)), here))
        elif kind == 2:  # full cycles up to the amplitude of the day
            v = rng.choice([0.05, 0.15, 0.4])
            for _ in range(int(rng.integers(2, 5))):
                for to in (cap, rng.uniform(0, 0.3 * cap)):
                    m = max(6, int(FH * abs(to - here) / v))
                    parts.append(here + (to - here) * _jerk(m))
                    here = to
        elif kind == 3:  # random moves
            m = int(FH * rng.uniform(8, 25))
            w = 0.5 * (1 + np.tanh(0.9 * _band(rng, m, rng.uniform(0.3, 1.5)))) * cap
            fade = np.minimum(1, np.arange(m) / (1.0 * FH))
            fade = fade * fade * (3 - 2 * fade)
            parts.append(here * (1 - fade) + w * fade)
            here = float(w[-1])
        else:  # back to rest
            m = int(FH * rng.uniform(0.3, 3))
            parts.append(here * (1 - _jerk(m)))
            parts.append(np.zeros(int(FH * rng.uniform(2, 12))))
            here = 0.0
        have = sum(len(p) for p in parts)
    return np.concatenate(parts)[:n]


def _typical(rng, n):
    fc = rng.uniform(0.35, 0.8)
    w = 0.75 * _band(rng, n, fc) + 0.35 * _band(rng, n, 0.08)
    e = TOP * 0.5 * (1 + np.tanh(rng.uniform(0.8, 1.2) * w))
    return e * np.minimum(1.0, np.arange(n) / (2.0 * FH))


def _poor(rng, n):
    p, amp = rng.uniform(12, 26), rng.uniform(0.3, 0.39)
    ph = (np.arange(n) / FH / p) % 1.0
    return amp * (1 - np.abs(2 * ph - 1))


def _motion(seed, excitation):
    rng = np.random.default_rng([seed, 100 + EXCITATIONS.index(excitation)])
    n1, nb, n2 = N1 * UP, NB * UP, N2 * UP
    if excitation == "rich":
        a, b = _rich(rng, n1, True), _rich(rng, n2, False)
    elif excitation == "typical":
        a, b = _typical(rng, n1), _typical(rng, n2)
    else:
        a, b = _poor(rng, n1), _poor(rng, n2)
    back = a[-1] + (b[0] - a[-1]) * _jerk(nb)
    return np.clip(np.concatenate([a, back, b]), 0.0, TOP)


# ------------------------------------------------------------------ nominal sensors
class World:
    def __init__(self, seed, excitation):
        rng = np.random.default_rng([seed, 1])
        self.seed, self.excitation = seed, excitation
        self.n = n = int(rng.integers(3, 8))
        self.liquid = rng.random(n) < 0.5
        self.top_side = rng.random(n) < 0.5  # sensor in the upper or lower arm of the divider
        self.q = np.exp(rng.uniform(np.log(0.4), np.log(3.0), n))
        self.k = rng.uniform(0.8, 2.2, n)
        self.l1 = np.exp(rng.uniform(np.log(0.6), np.log(20.0), n))  # Oldroyd relaxation time
        self.l2 = self.l1 * (
            1 + rng.choice([-1, 1], n) * rng.uniform(0.02, 0.15, n)
        )  # retardation time
        self.noise_sim = rng.uniform(1.5, 5.0, n)
        self.noise_real = self.noise_sim * rng.uniform(0.85, 1.2, n)
        span = np.exp(rng.uniform(np.log(600), np.log(2000), n))
        self.span = span
        place = rng.random(n)
        self.v0 = self._divide(np.zeros((1, n)))[0]
        self.v1 = self._divide(np.ones((1, n)))[0]
        self.sign = np.sign(self.v1 - self.v0)
        self.e_h = _motion(seed, excitation)
        self.e = self.e_h[::UP]
        self.v = self.memory(self.e)
        f = self.curve(self.v)
        lo, hi = f.min(0), f.max(0)
        self.scale = self.sign * span / (hi - lo)
        bottom = 450 + place * (3645 - span - 450)
        self.zero = np.where(self.sign > 0, bottom - self.scale * lo, bottom - self.scale * hi)
        self.f = f
        self.y = self.zero + self.scale * f
        self.ylo, self.yhi = self.y.min(0), self.y.max(0)

    def _divide(self, v):
        u = np.maximum(TOP * v, -0.3)
        z = np.where(self.liquid, (1 + u) ** 2, 1 + self.k * u)
        return np.where(self.top_side, z, self.q) / (z + self.q)

    def curve(self, v):
        return (self._divide(v) - self.v0) / (self.v1 - self.v0)

    def memory(self, e):
        """u + l1 u' = e + l2 e' (bilinear), in units of the top strain."""
        x = np.asarray(e) / TOP
        out = np.empty((len(x), self.n))
        for c in range(self.n):
            a, b = 2 * self.l1[c] / DT, 2 * self.l2[c] / DT
            out[:, c] = lfilter([1 + b, 1 - b], [1 + a, 1 - a], x)
        return out

    def codes(self, f):
        return self.zero + self.scale * f


# ------------------------------------------------------------------ helpers of the equations
def _prony(phi, x):
    """-integral of phi(t-s) dx(s): what a memory with decaying kernel phi lags behind."""
    dx = np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1])))
    return -fftconvolve(dx, phi, axes=0)[: len(x)]


def _plays(x, radii, start=None):
    """Play operators: x (T, n), radii (m, n or 1) -> (T, m, n)."""
    out = np.empty((len(x), len(radii), x.shape[1]))
    up, dn = x[:, None, :] + radii, x[:, None, :] - radii
    z = np.zeros(out.shape[1:])
    for i in range(len(x)):
        z = np.minimum(np.maximum(z, dn[i]), up[i])
        out[i] = z
    return out


def _unit(s):
    r = np.sqrt(np.mean(s[:N1] ** 2, axis=0))
    return s / np.maximum(r, 1e-9)


def _rms(d):
    return np.sqrt(np.mean(d[:N1] ** 2, axis=0))


# ------------------------------------------------------------------ operators
class Op:
    """stage 'motion' | 'pre' | 'post' | 'code'; prep(x, e) -> S once per input; run(x, a, S)."""

    stage = "post"
    bounds = (1e-5, 3.0)

    def __init__(self, name, w):
        self.name, self.w = name, w
        every = NAMES + FOREIGN
        self.rng = np.random.default_rng([w.seed, 1000 + every.index(name)])
        n = w.n
        k = n if name in ON_ALL else int(self.rng.integers(1, n + 1))
        self.channels = np.sort(self.rng.permutation(n)[:k])
        self.on = np.zeros(n)
        self.on[self.channels] = 1.0
        self.asked = float(np.exp(self.rng.uniform(np.log(3.0), np.log(30.0))))
        self.sgn = self.rng.choice([-1.0, 1.0], n)
        self.a = np.zeros(n)
        self.norm = None
        getattr(self, "init_" + name)()

    def family(self, *fams):
        self.fam = fams[int(self.rng.integers(0, len(fams)))]

    # default: add a * unit shape, the unit fixed by what the nominal input gives
    def prep(self, x, e):
        s = self.fam(x, e)
        if self.norm is None:
            self.norm = np.maximum(_rms(s), 1e-9)
        return s / self.norm

    def run(self, x, a, s):
        return x + a * self.on * s

    # ---------------- motion
    def init_backlash(self):
        self.stage, self.bounds = "motion", (2e-4, 0.1)
        r = self.rng
        self.ecc, self.pitch, self.ph = (
            r.uniform(0.2, 0.6),
            r.uniform(0.08, 0.25),
            r.uniform(0, 6.28),
        )
        self.cush = r.uniform(0.1, 0.3)
        self.worn = r.uniform(0.05, 0.3)

        def nut_clearance(e, w):
            return self._gap(e, np.tile(w / 2, (len(e), 1)))

        def eccentric_gear(e, w):
            g = 1 + self.ecc * np.sin(2 * np.pi * e / self.pitch + self.ph)
            return self._gap(e, g[:, None] * w / 2)

        def worn_middle(e, w):
            g = 0.5 + 1.0 / (1 + ((e - self.worn) / 0.08) ** 2)
            return self._gap(e, g[:, None] * w / 2)

        def cushioned_coupling(e, w):
            p = self._gap(e, np.tile(w / 2, (len(e), 1)))
            return p + self.cush * (e[:, None] - p)

        def dahl_takeup(e, w):  # belt wind-up: dz = (sgn - z)|de| / (w/2)
            de = np.diff(e, prepend=0.0)
            k = np.exp(-np.abs(de)[:, None] / (0.35 * w))
            sg = np.sign(de)
            z, out = np.zeros(len(w)), np.empty((len(e), len(w)))
            for i in range(len(e)):
                z = sg[i] + (z - sg[i]) * k[i]
                out[i] = z
            return e[:, None] - 0.5 * w * out

        self.family(nut_clearance, eccentric_gear, worn_middle, cushioned_coupling, dahl_takeup)

    @staticmethod
    def _gap(e, half):
        up, dn = e[:, None] + half, e[:, None] - half
        z, out = np.zeros(half.shape[1]), np.empty(half.shape)
        for i in range(len(e)):
            z = np.minimum(np.maximum(z, dn[i]), up[i])
            out[i] = z
        return out

    def init_delay(self):
        self.stage, self.bounds = "motion", (0.008, 0.3)
        r = self.rng
        self.resync, self.ph = r.uniform(40, 150), r.uniform(0, 6.28)
        self.rise = r.random() < 0.6

        def clock_offset(t):
            return np.ones_like(t)

        def crystal_skew(t):
            return t / t[-1] if self.rise else 1 - 0.9 * t / t[-1]

        def resynchronised(t):  # skew between the beats of a time server
            return (t % self.resync) / self.resync

        def oven_wander(t):  # tuning-fork crystal in a room that warms and cools
            return 0.6 + 0.4 * np.sin(2 * np.pi * t / (2.5 * self.resync) + self.ph)

        self.family(clock_offset, crystal_skew, resynchronised, oven_wander)

    def move(self, e_h, w):
        """w (m,) candidates -> (TH, m)"""
        if self.name == "backlash":
            return self.fam(e_h, w)
        if self.name == "delay":
            out = np.empty((len(e_h), len(w)))
            for j, a in enumerate(w):
                out[:, j] = np.interp(TIME_H - np.maximum(0.005, a * self.fam(TIME_H)), TIME_H, e_h)
            return out
        return self.ring(e_h, w)

    # ---------------- material
    def init_hysteresis(self):
        r, n = self.rng, self.w.n
        self.stage = "pre" if r.random() < 0.5 else "post"
        self.soft, self.pin, self.alpha = (
            r.uniform(0.15, 0.35, n),
            r.uniform(0.08, 0.3, n),
            r.uniform(0, 0.05, n),
        )
        self.hodg = r.uniform(3.0, 15.0, n)
        self.shape, self.bias = r.uniform(1.5, 3.5, n), r.uniform(0.2, 0.7, n)
        self.reach = r.uniform(0.25, 0.6, n)

        def jiles_atherton(x, e):  # irreversible part only, less the anhysteretic curve
            m, out = np.zeros(n), np.empty_like(x)
            prev = np.zeros(n)

            def lang(h):
                h = np.where(np.abs(h) < 1e-3, 1e-3, h)
                return 1 / np.tanh(h) - 1 / h

            dx = np.diff(x, axis=0, prepend=np.zeros((1, n)))
            many = np.maximum(1, np.ceil(np.abs(dx).max(1) / 0.03)).astype(int)
            for i in range(len(x)):
                d = dx[i] / many[i]
                h, gain = prev, 1 - np.exp(-np.abs(d) / self.pin)
                for _ in range(many[i]):
                    h = h + d
                    go = lang((h + self.alpha * m) / self.soft) - m
                    m = m + np.where(go * d > 0, go * gain, 0.0)
                out[i] = m
                prev = x[i]
            return out - lang(x / self.soft)

        def coleman_hodgdon(x, e):  # dz = -alpha |dx| z + dx: loop less its spine
            dx = np.diff(x, axis=0, prepend=np.zeros((1, n)))
            k = np.exp(-self.hodg * np.abs(dx))
            src = np.sign(dx) * (1 - k) / self.hodg
            z, out = np.zeros(n), np.empty_like(x)
            for i in range(len(x)):
                z = z * k[i] + src[i]
                out[i] = z
            return -out

        def ferroelectric_preisach(x, e):  # Lorentzian coercive fields, saturating polarisation
            rad = np.linspace(0.01, 0.45, 14)[:, None] * np.ones(n)
            wgt = 1 / (1 + ((rad - 0.15) / 0.1) ** 2)
            p = np.tanh(self.shape * (_plays(x, rad) - self.bias))
            return ((p - np.tanh(self.shape * (x[:, None] - self.bias))) * wgt).sum(1)

        def rayleigh(x, e):  # uniform Preisach density: B = (mu+aH)H, parabolic loops
            rad = np.linspace(0.02, 1.0, 18)[:, None] * self.reach
            return (_plays(x, rad) - x[:, None]).mean(1)

        if self.stage == "pre":  # felt strain lags; resistance may go either way
            self.sgn[:] = 1.0
        self.family(jiles_atherton, coleman_hodgdon, ferroelectric_preisach, rayleigh)

    def init_relaxation(self):
        r, n = self.rng, self.w.n
        self.stage = "pre" if r.random() < 0.5 else "post"
        tau = np.exp(r.uniform(np.log(2.0), np.log(40.0), n))
        beta = r.uniform(0.4, 0.8, n)
        expo = r.uniform(0.3, 0.8, n)
        t1, t2 = r.uniform(0.2, 1.0, n), r.uniform(20, 60, n)
        big = r.uniform(0.5, 2.5, n)
        st = r.uniform(0.08, 0.3, n)
        t = TIME[:, None]

        def kohlrausch(x, e):
            return _prony(np.exp(-((t / tau) ** beta)), x)

        def curie_schweidler(x, e):
            return _prony((1 + t / 0.5) ** -expo * np.exp(-t / 60.0), x)

        def fung_quasilinear(x, e):  # tendon: box spectrum on an exponential elastic response
            tt = np.maximum(t, 1e-6)
            phi = (exp1(tt / t2) - exp1(tt / t1)) / np.log(t2 / t1)
            return _prony(phi, np.expm1(big * x) / np.expm1(big))

        def eyring_dashpot(x, e):  # z' = (s/tau) sinh((x - z)/s)
            z, out = np.zeros(n), np.empty_like(x)
            for i in range(len(x)):
                d = (x[i] - z) / st
                # exact for frozen x: tanh(d/2) decays exponentially
                th = np.tanh(0.5 * d) * np.exp(-DT / tau)
                z = x[i] - st * 2 * np.arctanh(np.clip(th, -0.999999, 0.999999))
                out[i] = z
            return out - x

        self.family(kohlrausch, curie_schweidler, fung_quasilinear, eyring_dashpot)

    def init_softening(self):
        r, n = self.rng, self.w.n
        self.stage = "post"
        rr, mm = r.uniform(1.2, 2.5, n), r.uniform(0.1, 0.4, n)
        theta = r.uniform(0.2, 0.8, n)
        b = r.uniform(0.5, 2.0, n)
        wk, ws = r.uniform(1.5, 3.5, n), r.uniform(0.4, 0.9, n)

        def top(x):
            return np.maximum.accumulate(np.maximum(x, 0), axis=0)

        def energy(x):  # neo-Hookean in tension
            lam = 1 + TOP * np.maximum(x, 0)
            lt = 1 + TOP
            return (lam**2 + 2 / lam - 3) / (lt**2 + 2 / lt - 3)

        def ogden_roxburgh(x, e):
            wm = energy(top(x))
            return -x * erf((wm - energy(x)) / (mm + 0.3 * wm)) / rr

        def simo_damage(x, e):
            return -x * (1 - np.exp(-energy(top(x)) / theta))

        def network_alteration(x, e):  # Marckmann: chains lengthen with the largest stretch
            m = top(x)
            ch = np.exp(-b * m)
            return -x * (1 - ch * (1 + 0.4 * ch * x**2) / (1 + 0.4 * x**2))

        def fibre_rupture(x, e):  # Weibull bundle: fibres pulled beyond their length are gone
            return -x * (1 - np.exp(-((top(x) / ws) ** wk)))

        self.family(ogden_roxburgh, simo_damage, network_alteration, fibre_rupture)
        self.sgn[:] = 1.0

    def init_overshoot(self):
        r, n = self.rng, self.w.n
        self.stage = "pre" if r.random() < 0.4 else "post"
        tau = np.exp(r.uniform(np.log(0.4), np.log(5.0), n))
        rate = r.uniform(0.03, 0.2, n)
        pw = r.uniform(0.5, 1.0, n)
        pc, tt = r.uniform(0.2, 0.5, n), r.uniform(1.3, 2.0, n)
        dc = r.uniform(0.01, 0.06, n)

        def rates(e):
            return np.abs(np.diff(e, prepend=e[0]) / DT)[:, None]

        def kinetics(e, power):  # dl/dt = (1-l)/tau - l (g/g0)^p / tau, exact by step
            g = (rates(e) / rate) ** power
            k = np.exp(-DT * (1 + g) / tau)
            eq = 1 / (1 + g)
            lam, out = np.ones(n), np.empty((len(e), n))
            for i in range(len(e)):
                lam = eq[i] + (lam - eq[i]) * k[i]
                out[i] = lam
            return out

        def goodeve_thixotropy(x, e):
            return 1 - kinetics(e, 1.0)

        def kraus_agglomerates(x, e):
            return 1 - kinetics(e, pw)

        def percolation(x, e):
            p = kinetics(e, 1.0)
            frac = (pc * 0.5 + (1 - pc * 0.5) * (0.45 + 0.55 * p) - pc * 0.5) / (1 - pc * 0.5)
            return frac**-tt - 1

        def contact_age(x, e):  # Dieterich-Ruina: theta' = 1 - theta/sat - theta |e'|/Dc
            g = rates(e) / dc + 1 / (3 * tau)
            k = np.exp(-DT * g)
            th, out = 3 * tau, np.empty((len(e), n))
            for i in range(len(e)):
                th = 1 / g[i] + (th - 1 / g[i]) * k[i]
                out[i] = th
            return np.log1p(3 * tau / 0.05) - np.log1p(out / 0.05)

        self.family(goodeve_thixotropy, kraus_agglomerates, percolation, contact_age)

    def init_drift(self):
        r, n = self.rng, self.w.n
        t = TIME[:, None]
        tf, t0 = r.uniform(300, 1500, n), r.uniform(5, 80, n)
        ta, na = r.uniform(150, 500, n), r.uniform(1.2, 2.5, n)
        tx, ty, mix = r.uniform(20, 60, n), r.uniform(200, 900, n), r.uniform(0, 0.5, n)

        def fickian_uptake(x, e):
            s = 0.0
            for j in range(12):
                q = (2 * j + 1) ** 2
                s = s + np.exp(-q * np.pi**2 * t / (4 * tf)) * 8 / (np.pi**2 * q)
            return s[0] - s

        def struik_ageing(x, e):
            return np.log1p(t / t0)

        def avrami(x, e):
            return 1 - np.exp(-((t / ta) ** na))

        def warm_up(x, e):
            return mix * (1 - np.exp(-t / tx)) + (1 - mix) * (1 - np.exp(-t / ty))

        self.family(fickian_uptake, struik_ageing, avrami, warm_up)

    def init_random_walk(self):
        r, n = self.rng, self.w.n

        def ou(tau):
            k = np.exp(-DT / tau)
            return np.stack(
                [
                    lfilter([np.sqrt(1 - k[c] ** 2)], [1, -k[c]], r.standard_normal(T))
                    for c in range(n)
                ],
                1,
            )

        def langevin():
            s = ou(r.uniform(20, 120, n))
            return s - s[0]

        def mcwhorter():  # 1/f: traps with times spread over two decades
            s = sum(ou(np.full(n, tau)) for tau in (20.0, 45.0, 100.0, 220.0, 500.0))
            return s - s[0]

        def wiener():
            return np.cumsum(r.standard_normal((T, n)), 0)

        def kasdin():  # fractional integration, power 1/f^alpha
            al = r.uniform(1.3, 1.8)
            j = np.arange(1, T)
            h = np.concatenate([[1.0], np.cumprod((j - 1 + al / 2) / j)])
            return fftconvolve(r.standard_normal((T, n)), h[:, None], axes=0)[:T]

        fams = (langevin, mcwhorter, wiener, kasdin)
        f = fams[int(r.integers(0, 4))]
        track = f()
        self.fam = lambda x, e: track

    def init_gain(self):
        r, n, w = self.rng, self.w.n, self.w
        t = TIME[:, None]
        centre = (2048 - w.zero) / w.scale
        tau, t0 = r.uniform(80, 400, n), r.uniform(5, 60, n)

        def strain_transfer(x, e):  # shear lag of a bonded gauge: it feels a share
            self.stage = "pre"
            return x

        def span_error(x, e):
            return x

        def reference_voltage(x, e):  # about the middle of the converter
            return x - centre

        def depoling(x, e):  # ferroelectric ageing by the decade
            return -x * np.log1p(t / t0)

        def corrosion(x, e):
            return -x * (1 - np.exp(-t / tau))

        self.family(strain_transfer, span_error, reference_voltage, depoling, corrosion)
        if self.fam is strain_transfer:
            self.stage = "pre"

    def init_step(self):
        r, n = self.rng, self.w.n
        self.onset = float(np.round(r.uniform(0.22, 0.78) * N1)) / FS
        t = np.maximum(TIME - self.onset, 0)[:, None]
        on = (self.onset <= TIME)[:, None] * 1.0
        keep, tau = r.uniform(0.4, 0.85, n), r.uniform(8, 60, n)
        mixg = r.uniform(-1.5, 1.5, n)

        def clamp_slip(x, e):
            return on * np.ones(n)

        def healed_crack(x, e):
            return on * (keep + (1 - keep) * np.exp(-t / tau))

        def lost_branch(x, e):  # one of several parallel paths opens: gain
            return on * x

        def knock(x, e):  # offset and gain, heals as a power of time
            return on * (1 + mixg * x) * (keep + (1 - keep) * (1 + t / tau) ** -1.5)

        self.family(clamp_slip, healed_crack, lost_branch, knock)
        if self.fam is clamp_slip and r.random() < 0.5:
            self.stage = "pre"

    # ---------------- electrical
    def init_lag(self):
        r, w = self.rng, self.w
        self.stage, self.bounds = "code", (1e-3, 3.0)
        load, dep = r.uniform(0.15, 0.6), r.uniform(0.4, 0.8)

        def per(y, a, f):
            out = y.copy()
            for c in self.channels:
                out[:, c] = y[0, c] + f(y[:, c] - y[0, c], max(a[c], 1e-3))
            return out

        def pole(x, tau):  # exact for input linear between samples
            k = np.exp(-DT / tau)
            m = (1 - k) * tau / DT
            return lfilter([1 - m, m - k], [1, -k], x)

        def rc(y, a):
            return per(y, a, pole)

        def loaded_ladder(y, a):  # two RC sections, the second loads the first
            tr, disc = 2 + load, np.sqrt((2 + load) ** 2 - 4)
            return per(
                y, a, lambda x, tau: pole(pole(x, tau * (tr + disc) / 4), tau * (tr - disc) / 4)
            )

        def sallen_key(y, a):  # critically damped, two equal poles
            return per(y, a, lambda x, tau: pole(pole(x, tau / 2), tau / 2))

        def source_resistance(y, a):  # the sensor's own resistance charges the capacitor
            rel = np.clip((y - w.ylo) / (w.yhi - w.ylo), 0, 1)
            tau = np.maximum(a, 1e-3) * (1 - dep + 2 * dep * rel)
            k = np.exp(-DT / tau)
            mid = np.empty_like(y)
            z = y[0].copy()
            m = (1 - k) * tau / DT
            src = np.empty_like(y)
            src[0] = 0
            src[1:] = y[1:] * (1 - m[1:]) + y[:-1] * (m[1:] - k[1:])
            mid[0] = z
            for i in range(1, len(y)):
                z = k[i] * z + src[i]
                mid[i] = z
            return np.where(self.on > 0, mid, y)

        self.family(rc, loaded_ladder, sallen_key, source_resistance)
        self._code_run()

    def _code_run(self):
        fam = self.fam
        self.prep = lambda x, e: None
        self.run = lambda x, a, s: fam(x, a)

    def init_saturation(self):
        r, w, n = self.rng, self.w, self.w.n
        self.stage, self.bounds = "code", (1e-3, 0.66)
        upper = r.random(n) < 0.5
        sg = np.where(upper, 1.0, -1.0)
        edge = np.where(upper, w.yhi, -w.ylo)
        soft, slope = r.uniform(0.01, 0.03, n) * w.span, r.uniform(0.05, 0.45, n)
        limit, pw = r.uniform(0.1, 0.3, n), r.uniform(1.5, 4, n)

        def over(y, a):
            return sg * y - (edge - (a - 0.06) * w.span)

        def end(y, lost):
            return y - sg * lost * self.on

        def headroom(y, a):  # emitter follower runs out of supply
            d = over(y, a)
            return end(y, soft * np.logaddexp(0, d / soft))

        def clamp_diode(y, a):  # series resistor, junction: Lambert W
            d = over(y, a)
            vt = soft * 2
            return end(y, vt * np.real(wrightomega(d / vt)))

        def loop_gain(y, a):
            return end(y, (1 - slope) * np.maximum(over(y, a), 0))

        def rapp(y, a):
            d = np.maximum(over(y, a), 0)
            lim = limit * np.maximum(a, 1e-4) * w.span
            return end(y, d - d / (1 + (d / lim) ** pw) ** (1 / pw))

        self.family(headroom, clamp_diode, loop_gain, rapp)
        self._code_run()

    def init_adc_nonlinearity(self):
        r, w, n = self.rng, self.w, self.w.n
        self.stage, self.bounds = "code", (0.05, 600.0)
        lo, wide = w.ylo - 0.05 * w.span, 1.1 * w.span
        c3, mist = r.uniform(-1, 1, n), r.standard_normal((12, n))
        mist[:5] = 0.0  # mismatch of the heavy capacitors
        seg = 2.0 ** r.integers(7, 9, n)
        seg = np.where(w.span < 900, 128.0, seg)
        folds, ph = r.uniform(2.0, 6.0, n), r.uniform(0, 6.28, n)
        kind = r.integers(0, 2)
        places = lo + wide * np.sort((np.arange(5)[:, None] + r.uniform(0.15, 0.85, (5, n))) / 5, 0)

        def z(y):
            return np.clip(2 * (y - lo) / wide - 1, -1.3, 1.3)

        def bow_and_s(y, e):
            q = z(y)
            return (1 - q * q) * (1 - kind + 2.5 * (kind + 0.3 * c3) * q)

        def capacitor_weights(y, e):
            code = np.clip(np.floor(y), 0, 4095).astype(int)
            s = np.zeros(y.shape)
            for b in range(5, 11):
                s += ((code >> b) & 1) * mist[b] * 2.0 ** (b / 2)
            return s - self.mid

        def residue_gain(y, e):  # pipelined: interstage gain wrong, saw-tooth
            return (y / seg) % 1.0 - 0.5

        def folding(y, e):
            return np.sin(2 * np.pi * folds * (y - lo) / wide + ph)

        base = (bow_and_s, capacitor_weights, residue_gain, folding)

        def missing_codes(y, a):  # runs of codes never come: stuck to their lower edge
            out = y.copy()
            gap = np.minimum(a * np.sqrt(2.0), wide / 5)
            for j in range(5):
                out = np.where((y >= places[j]) & (y < places[j] + gap), places[j], out)
            return np.where(self.on > 0, out, y)

        k = int(r.integers(0, 5))
        if k == 4:
            self.fam, self.bounds = missing_codes, (1.0, 500.0)
            self._code_run()
            return
        self.fam = base[k]
        if k == 1:
            code = np.clip(np.floor(w.y), 0, 4095).astype(int)
            self.mid = sum(((code >> b) & 1) * mist[b] * 2.0 ** (b / 2) for b in range(5, 11)).mean(
                0
            )

    def init_crosstalk(self):
        r, w, n = self.rng, self.w, self.w.n
        self.stage, self.bounds = "code", (0.05, 600.0)
        other = np.array([(c + 1 + int(r.integers(0, n - 1))) % n for c in range(n)])
        tau = np.exp(r.uniform(np.log(0.3), np.log(4.0), n))
        rest = w.y[0]

        def leakage(y, e):
            return (y - rest)[:, other]

        def mutual_capacitance(y, e):  # differentiating coupling: high-passed neighbour
            d = (y - rest)[:, other]
            out = np.empty_like(d)
            for c in range(n):
                k = np.exp(-DT / tau[c])
                out[:, c] = lfilter([(1 + k) / 2, -(1 + k) / 2], [1, -k], d[:, c])
            return out

        def ground_return(y, e):  # currents of all others in one lead
            d = y - rest
            return (d.sum(1, keepdims=True) - d) / (n - 1)

        def multiplexer_charge(y, e):  # what the hold capacitor kept of the channel before
            return np.roll(y, 1, axis=1) - 2048.0

        self.family(leakage, mutual_capacitance, ground_return, multiplexer_charge)

    def init_interference(self):
        r, n = self.rng, self.w.n
        self.stage, self.bounds = "code", (0.05, 600.0)
        t = TIME[:, None]
        f = r.uniform(0.6, 8.8)
        ph = r.uniform(0, 6.28, n)

        def mains_alias():  # fundamental and third, folded
            f3 = abs((3 * f + 10) % 20 - 10)
            return np.sin(2 * np.pi * f * t + ph) + 0.2 * np.sin(2 * np.pi * f3 * t + 2 * ph)

        def wandering_mains():  # grid frequency wanders
            df = lfilter([0.02], [1, -0.998], r.standard_normal(T)) * 0.02
            return np.sin(2 * np.pi * f * t + (2 * np.pi * np.cumsum(df) * DT)[:, None] + ph)

        def beat():
            g = np.clip(f + r.choice([-1, 1]) * r.uniform(0.02, 0.3), 0.5, 9.0)
            return np.sin(2 * np.pi * f * t + ph) + r.uniform(0.4, 0.9) * np.sin(
                2 * np.pi * g * t + 1.3 * ph
            )

        def swelling_hum():  # machine nearby goes on and off, depth below one
            return (1 + 0.7 * np.sin(2 * np.pi * t / 70 + ph)) * np.cos(2 * np.pi * f * t + ph)

        fams = (mains_alias, wandering_mains, beat, swelling_hum)
        g = fams[int(r.integers(0, 4))]
        tone = g()
        self.fam = lambda y, e: tone

    def init_spikes(self):
        r, n = self.rng, self.w.n
        self.stage, self.bounds = "code", (0.05, 600.0)
        tau = r.uniform(0.08, 0.5, n)
        ring = r.uniform(0.3, 0.7, n)

        def arrivals(rate):
            return (r.random((T, n)) < rate) * 1.0

        def signs():
            return r.choice([-1.0, 1.0], (T, n)) if r.random() < 0.5 else np.ones((T, n))

        def poisson_glitch():
            return arrivals(0.012) * signs() * r.lognormal(0, 0.35, (T, n))

        def electrostatic():  # charge bleeds off
            s = arrivals(0.005) * signs() * r.lognormal(0, 0.35, (T, n))
            return np.stack(
                [lfilter([1], [1, -np.exp(-DT / tau[c])], s[:, c]) for c in range(n)], 1
            )

        def contact_bounce():  # clusters
            p = arrivals(0.003)
            s = np.zeros((T, n))
            for k in range(6):
                s[k:] += (p * (r.random((T, n)) < 0.7) * r.uniform(0.4, 1.2, (T, n)))[: T - k]
            return s * signs()[:1]

        def ringing():
            s = arrivals(0.006) * signs() * r.uniform(0.6, 1.4, (T, n))
            return np.stack([lfilter([1], [1, ring[c]], s[:, c]) for c in range(n)], 1)

        fams = (poisson_glitch, electrostatic, contact_bounce, ringing)
        g = fams[int(r.integers(0, 4))]
        sp = g()
        sp[:20] = 0
        self.fam = lambda y, e: sp

    def init_noise(self):
        r, w, n = self.rng, self.w, self.w.n
        self.stage = "noise"
        factor = r.uniform(1.8, 4.0, n)

        def johnson(y):
            return np.ones((T, n)), None

        def signal_shot(y):  # louder with signal
            rel = np.clip((y - w.ylo) / (w.yhi - w.ylo), 0, 1)
            m = np.sqrt(0.1 + rel**2)
            return m, None

        def popcorn(y):  # quiet and loud spells
            p = (np.cumsum(r.random((T, n)) < 0.004, axis=0) + r.integers(0, 2, n)) % 2
            return 1.0 + 3.0 * p, None

        def heavy_tail(y):
            return np.ones((T, n)), 5

        self.family(johnson, signal_shot, popcorn, heavy_tail)
        self.factor = factor

    def loud(self, y, white):
        m, df = self.fam(y)
        m = m / np.sqrt(np.mean(m[:N1] ** 2, axis=0)) * self.factor
        if df:
            white = self.rng.standard_t(df, white.shape) / np.sqrt(df / (df - 2))
        return np.where(self.on > 0, m * white, white)

    # ---------------- foreign
    def init_thermal_wave(self):
        r, n = self.rng, self.w.n
        p, ph = r.uniform(60, 180), r.uniform(0, 6.28)
        depth = r.uniform(0, 1, n)
        wave = np.sin(2 * np.pi * TIME / p + ph)[:, None]
        self.fam = lambda x, e: wave * (1 + depth * x)

    def init_stuck_reading(self):  # radio packets lost: the last reading repeats
        self.stage, self.bounds = "code", (0.08, 6.0)
        starts = np.sort(self.rng.choice(np.arange(40, T - 40), 55, replace=False))
        length = self.rng.uniform(0.5, 1.5, 55)

        def fam(y, a):
            out = y.copy()
            for c in self.channels:
                hold = np.zeros(T + 1)
                for i, m in zip(starts, length, strict=False):
                    hold[i] += 1
                    hold[min(T, i + int(np.ceil(a[c] * m * FS)))] -= 1
                held = np.cumsum(hold)[:T] > 0
                held[0] = False
                idx = np.maximum.accumulate(np.where(held, 0, np.arange(T)))
                out[:, c] = y[idx[: len(y)], c]
            return out

        self.fam = fam
        self._code_run()

    def init_cycle_fatigue(self):  # Coffin-Manson: damage by path travelled
        r, n = self.rng, self.w.n
        pw = r.uniform(0.6, 1.0, n)

        def fam(x, e):
            path = np.cumsum(np.abs(np.diff(e, prepend=0.0)))[:, None] / TOP
            return (path / 20) ** pw

        self.fam = fam

    def init_toe_slack(self):  # tendon crimp: little is felt until the fibres are straight
        r, n = self.rng, self.w.n
        self.stage = "pre"
        toe = r.uniform(0.08, 0.3, n)
        self.sgn[:] = 1.0
        self.fam = lambda x, e: -toe * (1 - np.exp(-np.maximum(x, 0) / toe))

    def init_mount_ringing(self):  # bracket of mass and spring between drive and sensors
        self.stage, self.bounds = "motion", (0.03, 3.0)
        self.zeta = self.rng.uniform(0.05, 0.25)

    def ring(self, e_h, w):
        out = np.empty((len(e_h), len(w)))
        dt = 1 / FH
        for j, a in enumerate(w):  # a = 1/natural frequency (s)
            om = 2 * np.pi / a
            k = 2 / dt
            den = [
                k * k + 2 * self.zeta * om * k + om * om,
                2 * om * om - 2 * k * k,
                k * k - 2 * self.zeta * om * k + om * om,
            ]
            out[:, j] = lfilter(np.array([1, 2, 1.0]) * om * om, den, e_h)
        return out

    def init_viscous_rate(self):  # Newtonian solvent: proportional to signed rate

        def fam(x, e):
            g = np.diff(e, prepend=e[0]) / DT
            return np.repeat(lfilter([0.5, 0.5], [1], g)[:, None], self.w.n, 1)

        self.fam = fam


# ------------------------------------------------------------------ chain
def _chain(w, ops):
    """Noiseless codes before the electrical stage, and the strain felt."""
    ops = [o for o in ops if o.stage != "noise"]
    e_h = w.e_h
    moved = False
    for o in ops:
        if o.stage == "motion":
            e_h = o.move(e_h, np.array([o.a0]))[:, 0]
            moved = True
    e = e_h[::UP]
    v = w.memory(e) if moved else w.v
    for o in ops:
        if o.stage == "pre":
            v = o.run(v, o.a, o.prep(v, e))
    f = w.curve(v)
    for o in ops:
        if o.stage == "post":
            f = o.run(f, o.a, o.prep(f, e))
    return w.codes(f), e


def _electrical(ops, y, e, noise=None):
    for o in ops:
        if o.stage != "code":
            continue
        if noise is not None and o.name == "adc_nonlinearity":
            y, noise = y + noise, None
        y = o.run(y, o.a, o.prep(y, e))
    return y if noise is None else y + noise


def _solve(w, o):
    """Sets o.a so that the effect alone adds o.asked times the noise."""
    if o.stage == "noise":
        return
    want = o.asked * w.noise_real
    lo, hi = o.bounds
    if o.stage == "motion":
        grid = np.exp(np.linspace(np.log(lo), np.log(hi), 12))
        moved = o.move(w.e_h, grid)[::UP]
        got = np.array(
            [
                _rms(w.codes(w.curve(w.memory(moved[:, j]))) - w.y) / w.noise_real
                for j in range(len(grid))
            ]
        )
        typ = np.exp(np.mean(np.log(np.maximum(got, 1e-6)), axis=1))
        least = np.maximum.accumulate(got.min(1) + 1e-9 * np.arange(len(grid)))
        typ = np.maximum.accumulate(typ + 1e-9 * np.arange(len(grid)))
        a = np.interp(np.log(o.asked), np.log(typ), np.log(grid))
        floor = np.interp(np.log(3.0), np.log(least), np.log(grid))
        most = np.maximum.accumulate(got.max(1) + 1e-9 * np.arange(len(grid)))
        ceil = np.interp(np.log(30.0), np.log(most), np.log(grid))
        o.a0 = float(
            np.exp(max(min(a, ceil), floor))
        )  # one motion: typical channel as asked, all in 3 ... 30
        return
    if o.stage == "pre":
        x0, out = w.v, lambda x: w.codes(w.curve(x))
    elif o.stage == "post":
        x0, out = w.f, w.codes
    else:
        x0, out = w.y, lambda x: x
    s = o.prep(x0, w.e)
    sgn = o.sgn if s is not None else np.ones(w.n)
    la, lb = np.full(w.n, np.log(lo)), np.full(w.n, np.log(hi))
    a = np.zeros(w.n)
    for _ in range(34):
        mid = 0.5 * (la + lb)
        y = out(o.run(x0, sgn * np.exp(mid), s))
        d = y - w.y
        got = _rms(d)
        bad = (y.min(0) < LOW) | (y.max(0) > HIGH)
        up = (got < want) & ~bad
        la, lb = np.where(up, mid, la), np.where(up, lb, mid)
        a = sgn * np.exp(la)
        done = (np.abs(got / want - 1) < 0.004) & ~bad | (o.on == 0)
        if done.all():
            a = sgn * np.exp(mid)
            break
    o.a = a * o.on if s is not None else np.where(o.on > 0, a, 0.0)


def _build(seed, names, excitation):
    w = World(seed, excitation)
    ops = [Op(k, w) for k in names]
    for _ in range(7):
        for o in ops:
            _solve(w, o)
        y, e = _chain(w, ops)
        z = _electrical(ops, y, e)
        if z.min() >= LOW and z.max() <= HIGH:
            break
        for o in ops:
            o.asked = max(3.0, 0.7 * o.asked)
    return w, ops, y, e, z


def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    w, ops, y, e, z = _build(seed, tuple(names), excitation)
    n = w.n
    white = np.random.default_rng([seed, 2]).standard_normal((T, n))
    for o in ops:
        if o.stage == "noise":
            white = o.loud(y, white)
    real = _electrical(ops, y, e, white * w.noise_real)
    sim = w.y + np.random.default_rng([seed, 3]).standard_normal((T, n)) * w.noise_sim
    sensors = tuple(f"s{c + 1}" for c in range(n))

    def rec(name, codes, a, b):
        q = np.clip(np.rint(codes[a:b]), 0, 4095).astype(np.int32)
        return Recording(
            name,
            sensors,
            q,
            ("strain",),
            ("1",),
            w.e[a:b, None].copy(),
            np.arange(b - a) / FS,
            tuple(FrontEnd("codes", 12) for _ in range(n)),
        )

    c = N1 + NB
    truth = {o.name: tuple(int(k) for k in o.channels) for o in ops}
    onset = next((o.onset for o in ops if o.name == "step"), None)
    floors = np.sqrt(w.noise_sim**2 + w.noise_real**2 + 1 / 6)
    return Case(
        sim=rec("sim", sim, 0, N1),
        real=rec("real", real, 0, N1),
        sim2=rec("sim2", sim, c, T),
        real2=rec("real2", real, c, T),
        change=(z - w.y)[:N1].copy(),
        floors=floors,
        truth=truth,
        excitation=excitation,
        onset_s=onset,
        unseen=True,
    )
