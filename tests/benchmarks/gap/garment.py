"""Cases of an eleventh origin: sleeves and shirts of knitted conductive yarn, which a cheap
microcontroller reads.

Three devices (elbow sleeve, breathing shirt, knee sleeve) with 3 to 7 yarn sensors. The simulator
knows each sensor's curve and a mild creep and knit friction. All is on one clock: recording 1,
minutes of rest that nobody records, recording 2.
"""

# ruff: noqa: B023 - what is defined in a loop is called before the loop goes on

from types import SimpleNamespace

import numpy as np
from cases import Case, converted
from scipy.interpolate import PchipInterpolator
from scipy.signal import bilinear, fftconvolve, lfilter
from scipy.special import erf, expit

DT, N1, N2, FULL = 0.05, 8000, 4000, 0.4
LOW, HIGH = 3.1, 29.0  # rms of a change, in noises of its channel
EXCITATIONS = ("rich", "typical", "poor")
EQUATIONS = {
    "hysteresis": ["dahl", "maxwell_slip", "bouc_wen", "preisach", "tension_friction"],
    "backlash": ["play", "slack", "two_plays", "soft_play", "tension_play"],
    "relaxation": ["ladder", "stretched", "fractional", "schapery", "burgers"],
    "lag": ["one_pole", "two_poles", "bessel2", "moving_average", "rc_average"],
    "delay": ["constant", "skew", "resync", "scan"],
    "drift": ["log", "power", "fickian", "weibull", "logistic"],
    "random_walk": ["brown", "ou", "pink", "sparse", "smooth"],
    "step": ["jump", "offset_gain", "recovery", "edge", "yarn_break"],
    "gain": ["constant", "frontend", "wear_linear", "cycles", "wash"],
    "saturation": ["hard", "soft_knee", "rapp", "diode", "tanh"],
    "adc_nonlinearity": ["bow", "s_shape", "sar_weights", "subrange", "missing_codes"],
    "crosstalk": ["capacitor", "supply", "capacitive", "leak", "two_back"],
    "softening": ["ogden_roxburgh", "dorfmann_tanh", "elias_sqrt", "simo", "healing"],
    "overshoot": ["lp_speed", "breakdown", "two_rates", "speed_power", "slow_healing"],
    "interference": ["hum", "harmonics", "wandering", "body_coupled", "duty_cycle"],
    "spikes": ["single", "decay", "pair", "heavy", "bursts"],
    "noise": ["level", "signal", "speed", "low_tension", "modulated"],
}
FOREIGN = (
    "intermittent_contact",  # loops of yarn lose contact for seconds
    "unlogged_load",  # somebody leans on the sleeve
    "wrinkle_snap",  # a fold comes below a stretch, its size by chance, and snaps out
    "garment_ratchet",  # the sleeve creeps down with every stroke until it is tugged back
    "co_contraction",  # muscle bulge scales the signal for a while
    "packet_loss",  # the radio repeats the last sample
    "auto_tare",  # firmware pulls the baseline to the signal while it is quiet
    "triboelectric",  # charge of sudden changes of speed
    "slew_limit",  # firmware limits the change per sample
)
EQUATIONS |= {name: [name] for name in FOREIGN}
NAMES = tuple(EQUATIONS)
# In the order in which they act.
CHAIN = (
    "backlash softening hysteresis relaxation overshoot gain drift random_walk step "
    "garment_ratchet wrinkle_snap co_contraction unlogged_load intermittent_contact "
    "triboelectric lag saturation crosstalk slew_limit delay interference spikes noise "
    "auto_tare adc_nonlinearity packet_loss"
).split()
RETUNED: tuple[str, ...] = ()
WIDE = ("backlash", "delay")
MATERIAL = ("hysteresis", "relaxation", "overshoot", "softening", "drift")  # along the response


def _rng(seed: int, purpose: int):
    return np.random.default_rng([seed, purpose])


def drawn(seed: int, name: str) -> str:
    """Which equation of an effect a seed draws."""
    labels = EQUATIONS[name]
    return labels[int(_rng(seed, 100 + NAMES.index(name)).integers(len(labels)))]


def _log(rng, low, high, size=None):
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def _around(rng, value, size, by=0.12):
    """A physical constant as it differs from sensor to sensor."""
    return value * np.exp(by * np.clip(rng.standard_normal(size), -2.5, 2.5))


# --- building blocks
def _lp(signal, tau, dt=DT):
    a = np.exp(-dt / tau)
    return lfilter([1 - a], [1, -a], signal, axis=0)


def _play(x, width):
    """Play: the output stays within half a width of the input."""
    half, y, out = width / 2, 0.0, []
    for value in x.tolist():
        y = min(max(y, value - half), value + half)
        out.append(y)
    return np.array(out)


def _dahl(x, width):
    step = np.diff(x, prepend=x[0])
    keep, z, out = np.exp(-np.abs(step) / width).tolist(), 0.0, []
    for k, d in enumerate(np.sign(step).tolist()):
        z = d + (z - d) * keep[k] if d else z
        out.append(z)
    return np.array(out)


def _ou(rng, samples, tau, size):
    """Ornstein-Uhlenbeck of unit spread that starts at 0."""
    a = np.exp(-DT / tau)
    return lfilter([np.sqrt(1 - a * a)], [1, -a], rng.standard_normal((samples, size)), axis=0)


def _rms(change):
    return np.sqrt(np.mean(change[:N1] ** 2, axis=0))


# --- motions
def _path(moves, samples):
    """Moves (to, seconds, eased) from 0, one after the other."""
    x, at = [np.zeros(1)], 0.0
    for to, seconds, eased in moves:
        w = np.arange(1, max(1, round(seconds / DT)) + 1) / max(1, round(seconds / DT))
        x.append(at + (to - at) * (0.5 - 0.5 * np.cos(np.pi * w) if eased else w))
        at = to
    return np.concatenate(x)[:samples]


def _rich(rng, seconds):
    moves, at = [(0.0, rng.uniform(0.5, 5), 0)], 0.0
    for top in np.linspace(rng.uniform(0.08, 0.13), rng.uniform(0.34, 0.39), rng.integers(4, 8)):
        speed = _log(rng, 0.04, 0.3)
        moves += [(top, top / speed, 0), (0.01, (top - 0.01) / speed, 0)]
    while sum(move[1] for move in moves) < seconds:
        kind = rng.choice(
            ["hold", "moves", "stairs", "sine", "triangles"], p=[0.15, 0.4, 0.15, 0.15, 0.15]
        )
        at = moves[-1][0]
        if kind == "hold":
            moves.append((at, rng.uniform(5, 20), 0))
        elif kind == "moves":
            for to in rng.uniform(0.01, 0.39, rng.integers(3, 9)):
                moves.append(
                    (to, max(0.3, abs(to - at) / _log(rng, 0.02, 0.4)), rng.random() < 0.5)
                )
                at = to
        elif kind == "stairs":
            for to in np.linspace(rng.uniform(0.03, 0.1), rng.uniform(0.25, 0.38), 5):
                moves += [(to, 0.6, 1), (to, rng.uniform(2, 6), 0)]
        elif kind == "sine":
            low, high, half = rng.uniform(0.02, 0.12), rng.uniform(0.2, 0.38), _log(rng, 0.6, 5)
            moves += [(to, half, 1) for _ in range(rng.integers(3, 7)) for to in (high, low)]
        else:
            low, high, speed = rng.uniform(0.0, 0.1), rng.uniform(0.2, 0.39), _log(rng, 0.05, 0.3)
            moves += [(to, (high - low) / speed, 0) for _ in range(3) for to in (high, low)]
    return moves


def _elbow(rng, seconds):
    moves = [(0.0, rng.uniform(1, 6), 0), (0.03, 1.0, 1)]
    while sum(move[1] for move in moves) < seconds:
        top, low, half = rng.uniform([0.16, 0.02, 0.7], [0.37, 0.06, 2.2])
        for _ in range(rng.integers(5, 13)):
            j = rng.normal(1, 0.06, 3).clip(0.8, 1.2)
            moves += [(top * j[0], half * j[1], 1), (low * j[2], half * j[1] * 1.15, 1)]
        hold = rng.uniform(0.02, 0.3)
        moves += [(hold, 1.2, 1), (hold, rng.uniform(4, 18), 0)]
        for _ in range(rng.integers(0, 4)):  # reaching for something
            moves.append((rng.uniform(0.02, 0.33), rng.uniform(0.6, 2), 1))
    return moves


def _breathing(rng, seconds):
    moves, base = [(0.0, rng.uniform(1, 4), 0)], rng.uniform(0.04, 0.08)
    while sum(move[1] for move in moves) < seconds:
        effort, period = _log(rng, 0.06, 0.22), rng.uniform(2.2, 5.0)
        for _ in range(rng.integers(6, 16)):
            deep = rng.uniform(1.5, 2.5) if rng.random() < 0.07 else 1.0
            j = rng.normal(1, 0.1, 2).clip(0.7, 1.3)
            top = min(0.38, base + effort * deep * j[0])
            moves += [(top, 0.42 * period * j[1], 1), (base, 0.58 * period * j[1], 1)]
        if rng.random() < 0.3:  # breath held
            top = base + rng.uniform(0.1, 0.25)
            moves += [(top, 1.8, 1), (top, rng.uniform(6, 16), 0), (base, 1.5, 1)]
        base = rng.uniform(0.03, 0.1)  # another posture
        moves.append((base, 1.5, 1))
    return moves


def _gait(rng, seconds):
    moves = [(0.0, rng.uniform(1, 6), 0)]
    while sum(move[1] for move in moves) < seconds:
        top, period = rng.uniform(0.16, 0.34), rng.uniform(1.0, 1.5)
        for _ in range(rng.integers(12, 40)):
            a, t = np.array([top, period]) * rng.normal(1, 0.04, 2).clip(0.9, 1.1)
            moves += [
                (0.3 * a, 0.15 * t, 1),
                (0.1 * a, 0.25 * t, 1),
                (a, 0.3 * t, 1),
                (0.06 * a, 0.3 * t, 1),
            ]
        rest = rng.choice([0.01, 0.02, rng.uniform(0.2, 0.36)])  # standing or sitting
        moves += [(rest, 1.3, 1), (rest, rng.uniform(4, 20), 0)]
    return moves


def _poor(rng, seconds):
    top, half, eased, moves = rng.uniform(0.26, 0.38), rng.uniform(6, 25), rng.random() < 0.5, []
    while sum(move[1] for move in moves) < seconds:
        moves += [(top, half, eased), (0.0, half, eased)]
    return moves


def _motion(seed, excitation, device):
    """Strain over recording 1, minutes of rest, recording 2; and where recording 2 begins."""
    kind = {"rich": _rich, "typical": (_elbow, _breathing, _gait)[device], "poor": _poor}[
        excitation
    ]
    purpose = 20 + EXCITATIONS.index(excitation)
    first = _path(kind(_rng(seed, purpose), N1 * DT + 10), N1)
    second = _path(kind(_rng(seed, purpose + 5), N2 * DT + 10), N2)
    pause = int(_rng(seed, purpose + 8).integers(2400, 6000))
    rest = np.zeros(pause)
    rest[:60] = first[-1] * (0.5 + 0.5 * np.cos(np.pi * np.arange(1, 61) / 60))
    return np.concatenate([first, rest, second]), N1 + pause


# --- the simulated device
def _curve(kind, p, x):
    """Static curve of a yarn sensor, 0 at rest and 1 at full stretch."""
    w = x / FULL
    if kind == "contact":  # loops come apart
        return (1 - np.exp(-p * w)) / (1 - np.exp(-p))
    if kind == "bent":
        return (1 - 0.3 * p) * w + 0.3 * p * w * w
    if kind == "sigmoid":
        at = [np.tanh((v - 0.45) * p / 0.45) for v in (w, 0.0, 1.0)]
        return (at[0] - at[1]) / (at[2] - at[1])
    if kind == "divider":  # R0 (1 + p w) under a reference resistor
        return (p * w / (2 + p * w)) * (2 + p) / p
    knee = [np.logaddexp(0, (v - 0.5) / 0.12) * 0.12 for v in (w, 0.0, 1.0)]  # jamming
    return (w + p / 2 * (knee[0] - knee[1])) / (1 + p / 2 * (knee[2] - knee[1]))


def _device(seed):
    rng = _rng(seed, 1)
    kind, c = int(rng.integers(3)), int(rng.integers(3, 8))
    curves = list(rng.choice(["contact", "bent", "sigmoid", "divider", "jamming"], c))
    d = SimpleNamespace(kind=kind, channels=c, curves=curves, p=rng.uniform(0.5, 1.5, c))
    span = _log(rng, 320, 1150, c)
    d.noise = np.clip(span / _log(rng, 330, 700, c), 0.5, 2.5)
    falling = rng.random(c) < 0.3
    d.rest = np.where(falling, rng.uniform(2200, 2700, c), rng.uniform(1000, 1500, c))
    d.span = np.where(falling, -span, span)
    d.creep, d.tau = rng.uniform(0.01, 0.06, c), _log(rng, 3, 60, c)
    d.friction = rng.uniform(0.01, 0.05, (c, 3))
    return d


def _nominal(d, x):
    """(samples, channels) codes of the simulator's sensors at strain ``x``."""
    w = x / FULL
    slip = np.stack([_play(w, width) - w for width in (0.02, 0.06, 0.15)], axis=1)
    out = np.empty((len(x), d.channels))
    for c in range(d.channels):
        f = _curve(d.curves[c], d.p[c], x)
        out[:, c] = f + d.creep[c] * (f - _lp(f, d.tau[c])) + slip @ d.friction[c]
    return d.rest + d.span * out


# --- additive effects: what one unit adds, (samples, affected channels)
def _hysteresis(w, rng, label, ch):
    x, k, out, sign = w.x, len(ch), [], rng.choice([-1, 1])
    width = _around(rng, w.reach * _log(rng, 0.04, 0.15), k)
    if label == "preisach":
        edges = np.linspace(0, w.reach, 21) + 1e-9
        n, last, total = np.arange(len(x)), {}, np.zeros((len(x), k))
        for e in edges:  # when the strain was last above or below a threshold
            last[e] = [np.maximum.accumulate(np.where(hit, n, -1)) for hit in (x > e, x < e)]
        centre, spread = rng.uniform(0.3, 0.7), width / w.reach * 2
        for i, up in enumerate(edges):
            for down in edges[:i]:
                on = last[up][0] > last[down][1]
                mid, gap = (up + down) / 2 / w.reach, (up - down) / w.reach
                total += on[:, None] * np.exp(-gap / spread - ((mid - centre) / 0.5) ** 2)
        # Relays up and down differ by their loop; the branch they share is no hysteresis.
        grid = np.argsort(x, kind="stable")[:: max(1, len(x) // 400)]
        for j in range(k):
            total[:, j] -= np.polyval(np.polyfit(x[grid], total[grid, j], 3), x)
        return sign * total
    for j in range(k):
        if label in ("dahl", "tension_friction"):
            z = _dahl(x, width[j])
            out.append(z if label == "dahl" else z * (0.2 + x / w.reach))
        elif label == "maxwell_slip":
            widths, stiff = w.reach * np.geomspace(0.02, 0.4, 6), _around(rng, 1.0, 6, 0.3)
            out.append(
                sum(a * b**-0.7 * (x - _play(x, b)) for a, b in zip(stiff, widths, strict=True))
            )
        else:
            n, beta, z, one = rng.uniform(1.2, 2.5), rng.uniform(0.55, 0.85), 0.0, []
            for dx in (np.diff(x, prepend=x[0]) / width[j] / 3).tolist():
                for _ in range(3 if dx else 0):
                    turn = beta if dx * z > 0 else -beta
                    z = min(1.0, max(-1.0, z + dx * (1 - abs(z) ** n * (turn + 1 - beta))))
                one.append(z)
            out.append(np.array(one))
    return sign * np.stack(out, axis=1)


def _relaxation(w, rng, label, ch):
    u, k, sign, out = w.u[:, ch], len(ch), rng.choice([-1, 1]), []
    if label == "ladder":
        taus = [_log(rng, 2, 8), _log(rng, 10, 30), _log(rng, 40, 120)]
        part = _around(rng, 1.0, (3, k), 0.3)
        return sign * sum(part[i] * (u - _lp(u, tau)) for i, tau in enumerate(taus))
    if label == "fractional":
        order, taus = _around(rng, rng.uniform(0.12, 0.35), k, 0.08), np.geomspace(0.4, 1500, 14)
        return sign * sum(tau**-order * (u - _lp(u, tau)) for tau in taus)
    if label == "burgers":  # Kelvin element and a dashpot that recovers slowly
        fast, slow, part = _log(rng, 4, 15), _log(rng, 100, 250), rng.uniform(0.4, 0.8)
        return sign * ((1 - part) * (u - _lp(u, fast)) + part * (u - _lp(u, slow)))
    tau, beta = _around(rng, _log(rng, 8, 50), k), _around(rng, rng.uniform(0.35, 0.65), k, 0.06)
    bend, shift = rng.uniform(0.3, 1.0), rng.uniform(0.5, 1.5)
    for j in range(k):
        if label == "stretched":
            creep = 1 - np.exp(-((w.t / tau[j]) ** beta[j]))
            out.append(u[:, j] - fftconvolve(np.diff(u[:, j], prepend=0.0), creep)[: len(u)])
        else:  # Schapery: bent in the load, and faster under load
            load = u[:, j] * (1 + bend * u[:, j])
            share = 1 - np.exp(-DT * np.exp(shift * np.clip(u[:, j], 0, 1.2)) / tau[j])
            y, one = 0.0, []
            for a, to in zip(share.tolist(), load.tolist(), strict=True):
                y += a * (to - y)
                one.append(y)
            out.append(load - np.array(one))
    return sign * np.stack(out, axis=1)


def _overshoot(w, rng, label, ch):
    speed, k = np.abs(w.v)[:, None], len(ch)
    tau, a, b = _around(rng, _log(rng, 0.3, 2.0), k), rng.uniform(0.3, 1.0), rng.uniform(0.0, 1.0)
    size = rng.choice([-1, 1]) * (a + b * w.u[:, ch])
    if label == "two_rates":
        return size * (_lps(speed, tau / 1.8) + rng.uniform(0.5, 2) * _lps(speed, tau * 2))
    if label == "speed_power":
        return size * _lps(speed ** rng.uniform(0.55, 0.8), tau)
    if label == "lp_speed":
        return size * _lps(speed, tau)
    out, rate = [], _log(rng, 0.5, 1.5) / _rms(w.v) / tau  # contacts broken by motion
    for j in range(k):
        whole, one, order = 1.0, [], 1.0 if label == "breakdown" else 1.6
        for v in np.abs(w.v).tolist():
            step = DT * rate[j] * v  # implicit in what breaks, explicit in what re-forms
            whole = (whole + DT / tau[j] * (1 - whole) ** order) / (1 + step)
            one.append(1 - whole)
        out.append(one)
    return size * np.array(out).T


def _lps(signal, taus):
    return np.stack([_lp(signal[:, min(j, signal.shape[1] - 1)], t) for j, t in enumerate(taus)], 1)


def _softening(w, rng, label, ch):
    x, k, top = w.x / w.reach, len(ch), np.maximum.accumulate(w.x / w.reach)
    if label == "healing":
        rate, high = DT / _log(rng, 800, 2000), 0.0
        for i, value in enumerate(x.tolist()):
            high = top[i] = value if value > high else high - rate * (high - value)
    m, beta = _around(rng, _log(rng, 0.05, 0.2), k)[None], rng.uniform(0.1, 0.5)
    x, top = x[:, None], np.maximum(top, 1e-6)[:, None]
    if label in ("ogden_roxburgh", "healing"):
        lost = erf((top**2 - x**2) / (m + beta * top**2))
    elif label == "dorfmann_tanh":
        lost = np.tanh((top**1.5 - np.maximum(x, 0) ** 1.5) / (2 * m))
    elif label == "elias_sqrt":
        lost = 1 - np.exp(-m * 12 * np.sqrt(np.maximum(top - x, 0)))
    else:
        lost = (1 - np.exp(-top / (m * 4))) * (1 - np.clip(x / top, 0, 1) ** rng.uniform(1, 2.5))
    return -lost * w.u[:, ch]


def _gain(w, rng, label, ch):
    rise = (w.s - w.d.rest)[:, ch] * rng.choice([-1, 1])
    if label == "constant":
        return rise
    if label == "frontend":  # the amplifier's factor, about its own zero
        zero = w.d.rest[ch] + rng.uniform(-0.3, 0.3, len(ch)) * w.d.span[ch]
        return (w.s[:, ch] - zero) * rng.choice([-1, 1])
    if label == "wear_linear":
        return rise * w.t[:, None]
    if label == "cycles":
        return rise * np.sqrt(np.cumsum(np.abs(np.diff(w.x, prepend=0))))[:, None]
    return rise * (1 - np.exp(-w.t[:, None] / _around(rng, _log(rng, 150, 500), len(ch))))


def _drift(w, rng, label, ch):
    t, k = w.t[:, None], len(ch)
    if label == "log":
        one = np.log1p(t / _around(rng, _log(rng, 5, 60), k))
    elif label == "power":
        one = (t / 400) ** _around(rng, rng.uniform(0.3, 0.8), k, 0.06)
    elif label == "fickian":  # sweat diffuses into the yarn
        odd, tau = 2 * np.arange(12) + 1, _around(rng, _log(rng, 150, 600), k)
        one = 1 - sum(np.exp(-(o**2) * t / tau) / o**2 for o in odd) / sum(1 / odd**2)
    elif label == "weibull":
        one = 1 - np.exp(-((t / _around(rng, _log(rng, 60, 250), k)) ** rng.uniform(0.6, 1.4)))
    else:  # the sweat comes after a while
        at, width = rng.uniform(80, 250), _around(rng, rng.uniform(40, 80), k)
        one = expit((t - at) / width) - expit(-at / width)
    return np.where(rng.random(k) < 0.8, 1, -1) * rng.choice([-1, 1]) * one


def _random_walk(w, rng, label, ch):
    n, k = len(w.t), len(ch) + 1  # the last one is common
    if label == "brown":
        z = np.cumsum(rng.standard_normal((n, k)), axis=0) * np.sqrt(DT / 200)
    elif label == "ou":
        z = _ou(rng, n, _log(rng, 40, 150), k)
    elif label == "smooth":
        z = _lp(_ou(rng, n, _log(rng, 40, 120), k), rng.uniform(5, 15))
    elif label == "sparse":  # contacts rearrange, a little each time
        z = np.cumsum((rng.random((n, k)) < 0.02) * rng.standard_normal((n, k)), axis=0)
        z = _lp(z, 0.5) * np.sqrt(DT / 0.02 / 200)
    else:
        f = np.maximum(np.fft.rfftfreq(n, DT), 1 / n / DT)
        shape = f ** (-0.5 * rng.uniform(1.0, 1.4)) / (1 + (f / 0.15) ** 4)
        z = np.fft.irfft(
            np.fft.rfft(rng.standard_normal((n, k)), axis=0) * shape[:, None], n, axis=0
        )
    z, mix = (z - z[0]) / (_rms(z - z[0]) + 1e-12), 0.6 if rng.random() < 0.3 else 0.0
    return np.sqrt(1 - mix) * z[:, :-1] + np.sqrt(mix) * z[:, -1:]


def _step(w, rng, label, ch):
    w.onset = float(w.t[int(rng.uniform(60, 340) / DT)])
    since, k, u = (w.t - w.onset)[:, None], len(ch), w.u[:, ch]
    on, sign = since >= 0, rng.choice([-1, 1], k)
    if label == "jump":
        return sign * on
    if label == "offset_gain":
        return sign * on * (1 + rng.choice([-1, 1]) * _around(rng, rng.uniform(0.4, 1.2), k) * u)
    if label == "recovery":
        left, tau = rng.uniform(0.3, 0.7), _around(rng, _log(rng, 15, 60), k)
        return sign * on * (left + (1 - left) * np.exp(-np.maximum(since, 0) / tau))
    if label == "edge":  # the snagged yarn gives within a second or two
        return sign * np.clip(since / rng.uniform(0.3, 1.5), 0, 1)
    return (
        rng.choice([-1, 1]) * on * np.sign(w.d.span[ch]) * (u + rng.uniform(0.1, 0.3))
    )  # some yarn gone


def _crosstalk(w, rng, label, ch):
    rise, c = w.s - w.d.rest, w.d.channels
    before = rise[:, (ch - 1) % c]
    if label == "capacitor":
        return before - rise[:, ch]
    if label == "supply":  # the other sensors' current pulls the supply
        pull = _around(rng, 1.0, c, 0.5)
        others = (rise @ pull)[:, None] - rise[:, ch] * pull[ch]
        return -others * w.s[:, ch] / 2000
    if label == "capacitive":
        return rng.uniform(0.4, 0.8) * before + (before - _lp(before, _log(rng, 0.3, 1.5)))
    if label == "leak":  # a film of sweat to the next trace, better under tension
        return (rise * (1 + 0.6 * w.u))[:, (ch + 1) % c]
    return before + rng.uniform(0.3, 0.6) * rise[:, (ch - 2) % c]


def _interference(w, rng, label, ch):
    t, k = w.t[:, None], len(ch)
    phase, f = rng.uniform(0, 2 * np.pi, k), rng.uniform(0.4, 9.6)
    if label == "hum":
        return np.sin(2 * np.pi * f * t + phase)
    if label == "harmonics":
        f = rng.choice([50, 60]) + rng.choice([-1, 1]) * rng.uniform(0.15, 0.45)
        part, turn = (1.0, *rng.uniform([0.2, 0.3], [0.5, 0.7])), rng.uniform(0, 6, (3, k))
        return sum(part[h] * np.sin(2 * np.pi * (h + 1) * f * t + turn[h]) for h in range(3))
    if label == "wandering":
        pitch = f * (1 + 0.01 * _ou(rng, len(t), 40.0, 1))
        return np.sin(2 * np.pi * np.cumsum(pitch, axis=0) * DT + phase)
    if label == "body_coupled":
        return np.sin(2 * np.pi * f * t + phase) * (0.4 + np.clip(w.u[:, ch], 0, 1.3))
    one = ((rng.uniform(0.4, 3.0) * t + phase / 6.3) % 1 < rng.uniform(0.25, 0.5)) * 1.0
    return one - one[:N1].mean(axis=0)


def _spikes(w, rng, label, ch):
    n, k, rate = len(w.t), len(ch), _log(rng, 0.008, 0.02)
    if label == "bursts":  # a few within seconds
        near = fftconvolve(rng.random((n, k)) < rate / 8, np.ones((60, 1)), axes=0)[:n] > 0.5
        hits = near & (rng.random((n, k)) < 0.2)
    else:
        hits = rng.random((n, k)) < rate
    size = rng.choice([-1, 1], (n, k)) * rng.uniform(0.5, 1.5, (n, k))
    if label == "heavy":
        size = np.clip(
            rng.choice([-1, 1], (n, k)) * np.exp(0.7 * rng.standard_normal((n, k))), -3, 3
        )
    one = hits * size
    if label == "decay":
        return _lp(one, _log(rng, 0.08, 0.25))
    if label == "pair":
        return one - rng.uniform(0.5, 0.9) * np.roll(one, 1, axis=0)
    return one


def _noise(w, rng, label, ch):
    white, u = rng.standard_normal((len(w.t), len(ch))), np.clip(w.u[:, ch], 0, 1.3)
    if label == "signal":
        white *= 0.15 + u
    elif label == "speed":
        white *= 0.15 + np.minimum(_lp(np.abs(w.v), 0.15) / _rms(w.v), 4)[:, None]
    elif label == "low_tension":
        white *= 0.1 + np.exp(-w.x / w.reach / _log(rng, 0.15, 0.4))[:, None]
    elif label == "modulated":
        white *= np.exp(0.5 * _ou(rng, len(w.t), _log(rng, 3, 15), len(ch)))
    return white


def _events(rng, n, every, low, high):
    """Starts and ends of what happens now and then."""
    at, out = rng.exponential(every), []
    while at < n * DT - 1:
        end = at + rng.uniform(low, high)
        out.append((int(at / DT), min(n, int(end / DT) + 1)))
        at = end + rng.exponential(every)
    return out


def _foreign(w, rng, label, ch):
    n, k, out = len(w.t), len(ch), np.zeros((len(w.t), len(ch)))
    sign, reversals = rng.choice([-1, 1]), np.diff(np.sign(w.v), prepend=0) < 0
    if label == "triboelectric":
        charge = w.v[:, None] - _lps(w.v[:, None], _around(rng, _log(rng, 0.25, 0.8), k))
        return sign * np.tanh(charge / (4 * _rms(charge)))
    for j in range(k):
        if label == "intermittent_contact":
            for a, b in _events(rng, n, 12, 0.5, 5):
                if rng.random() < 1.2 - w.x[a] / w.reach:
                    out[a:b, j] = rng.uniform(0.4, 1) * (1 + 0.1 * rng.standard_normal(b - a))
        elif label == "unlogged_load":
            for a, b in _events(rng, n, 15, 4, 16):
                out[a:b, j] = (
                    rng.uniform(0.3, 1) * np.sin(np.pi * np.arange(b - a) / (b - a)) ** 0.5
                )
        elif label == "co_contraction":
            for a, b in _events(rng, n, 15, 8, 35):
                out[a:b, j] = rng.uniform(0.3, 1) * rng.choice([1, 1, -0.5])
            out[:, j] = _lp(out[:, j], 0.4) * w.u[:, ch[j]]
        elif label == "wrinkle_snap":
            at, width, folded, size = *w.reach * rng.uniform([0.3, 0.04], [0.5, 0.1]), False, 0.0
            for i, value in enumerate(w.x.tolist()):
                if not folded and value < at - width and i > 20 and w.v[i] < 0:
                    folded, size = (
                        True,
                        rng.choice([-0.4, 1, 1]) * np.exp(0.6 * rng.standard_normal()),
                    )
                elif folded and value > at + width:
                    folded = False
                out[i, j] = size * (1.2 - value / (at + width)) if folded else 0.0
        elif label == "garment_ratchet":
            tug, slip = {a for a, _ in _events(rng, n, 60, 0.1, 0.2)}, 0.0
            for i, turn in enumerate(reversals.tolist()):
                slip = 0.0 if i in tug else slip + turn * w.x[i] / w.reach
                out[i, j] = slip
            out[:, j] = _lp(out[:, j], 0.2) * (1 + 0.5 * w.u[:, ch[j]])
        else:  # auto_tare
            u = w.u[:, ch[j]]
            pace = _lp(np.abs(np.gradient(u, DT)), 0.7)
            quiet = pace <= np.quantile(pace[20:N1], 0.35) + 0.005
            base, rate = 0.0, DT / _log(rng, 3, 12)
            for i, value in enumerate(u.tolist()):
                base += rate * (value - base) if quiet[i] else 0.0
                out[i, j] = -base
    return sign * out


ADDITIVE = {name: globals().get("_" + name, _foreign) for name in NAMES}


# --- effects that change the signal, by one parameter each
def _filtered(signal, label, tau, ratio):
    """Lag of mean delay ``tau``, worked out at a tenth of the sample interval."""
    n, h = len(signal), DT / 10
    fine = np.interp(np.arange(10 * n - 9) / 10, np.arange(n), signal) - signal[0]
    if label == "rc_average":
        tau = tau / 2
    if label != "moving_average":
        two = np.polymul([tau * ratio, 1], [tau * (1 - ratio), 1])
        below = {"two_poles": two, "bessel2": [tau * tau / 3, tau, 1]}.get(label, [tau, 1])
        fine = lfilter(*bilinear([1], below, 1 / h), fine)
    if label in ("moving_average", "rc_average"):
        total = np.concatenate([[0], np.cumsum((fine[1:] + fine[:-1]) / 2)]) * h
        t = np.arange(len(fine)) * h
        fine = (total - np.interp(t - 2 * tau, t, total)) / (2 * tau)
    return signal[0] + fine[::10]


def _limited(signal, label, below, knee, power):
    """Saturation at a level by ``below`` (share of the range) under 1.2 times what is reached."""
    low, high = signal[:N1].min(), signal[:N1].max()
    level = high - (below - 0.2) * (high - low)  # a soft knee may lie above the top
    if label == "hard":
        return np.minimum(signal, level)
    if label == "soft_knee":
        width = knee * (high - low)
        return level - width * np.logaddexp(0, (level - signal) / width)
    if label == "rapp":
        zero = low - 0.3 * (high - low)
        w = np.maximum(signal - zero, 0) / (level - zero)
        return np.where(
            signal > zero, zero + (level - zero) * w / (1 + w**power) ** (1 / power), signal
        )
    width, over = 2 * knee * (high - low), np.maximum(signal - level, 0)
    bent = np.log1p if label == "diode" else np.tanh
    return np.minimum(signal, level) + width * bent(over / width)


def _slewed(signal, _, slowness, *__):
    most, y, out = 400 * DT / slowness, float(signal[0]), []
    for value in signal.tolist():
        y += min(most, max(-most, value - y))
        out.append(y)
    return np.array(out)


def _adc_shape(rng, label, low, high):
    """A converter's error by code, for a channel that uses the codes low … high."""
    a, b = low - rng.uniform(0, 0.2) * (high - low), high + rng.uniform(0, 0.2) * (high - low)
    sign, bits = rng.choice([-1, 1]), np.arange(5, 12)
    if label == "sar_weights":
        error = rng.standard_normal(7) * 2.0 ** (bits / 2)
    if label == "subrange":
        parts = int(rng.integers(3, 7))
        slope, offset = rng.standard_normal(parts), 0.4 * rng.standard_normal(parts)

    def shape(y):
        w = np.clip((y - a) / (b - a), -0.3, 1.3)
        if label == "bow":
            return sign * 4 * w * (1 - w)
        if label == "s_shape":
            return sign * np.sin(2 * np.pi * w)
        if label == "sar_weights":
            code = np.clip(np.floor(y + 0.5), 0, 4095).astype(int)
            return ((code[..., None] >> bits & 1) - 0.5) @ error
        i = np.clip((w * parts).astype(int), 0, parts - 1)
        return slope[i] * (w * parts - i) + offset[i]

    # As INL is given: offset and gain of the best straight line are trimmed.
    codes = np.linspace(low, high, 400)
    line = np.polyfit(codes, shape(codes), 1)
    return lambda y: shape(y) - np.polyval(line, y)


def _missing(rng, low, high):
    """Runs of codes that never come: the nearest that does is given instead."""
    count = int(rng.integers(4, 8))
    centres = low + (high - low) * (np.arange(count) + rng.uniform(0.35, 0.65, count)) / count
    widths = rng.uniform(0.6, 1.0, count) * (high - low) / count

    def gap(y, share):
        out = np.array(y, dtype=float)
        for centre, width in zip(centres, widths, strict=True):
            half = share * width / 2
            out = np.where(
                np.abs(y - centre) < half, centre + np.where(y < centre, -half, half), out
            )
        return out

    return gap


def _slipped(x, label, width, other):
    """What strain the yarn sees where the sleeve has slack or slips."""
    if label == "play":
        return _play(x, width)
    if label == "two_plays":
        return other * _play(x, 0.5 * width) + (1 - other) * _play(x, 1.8 * width)
    if label == "slack":
        return np.maximum(x - width, 0)
    y, out, half, last = 0.0, [], width / 2, 0.0
    for value in x.tolist():
        if label == "tension_play":  # slips less where it is stretched tight
            edge = half * (1.6 - 1.2 * min(1.0, value / FULL))
            y = min(max(y, value - edge), value + edge)
        else:  # grips more and more as the slack is taken up
            slack = min(1.0, max(0.0, (value - y if value > last else y - value) / half))
            y += (value - last) * slack**3
        last = value
        out.append(y)
    return np.array(out)


def _late(w, label, seconds, rng):
    """(samples, channels or 1) delays whose usual one is ``seconds``."""
    t = w.t[:, None]
    share, period, at = rng.uniform(0.3, 0.8), rng.uniform(60, 140), rng.random()
    if label == "skew":
        return seconds * (1 - share + share * t / 200)
    if label == "resync":  # the clock runs away and is set right again and again
        return seconds * (0.6 + 0.8 * ((t / period + at) % 1))
    if label == "scan":
        return seconds * (1 + share * np.arange(w.d.channels) / w.d.channels) + 0 * t
    return seconds + 0 * t


# --- sizes
def _solve(change, noise, share, low, high):
    """Parameters (one a channel) at which ``change(j, p)`` is of the wanted size, in noises."""
    out = []
    for j in range(len(noise)):
        size = lambda p, j=j: _rms(change(j, p)) / noise[j]  # noqa: E731
        most = min(HIGH, max(size(high) * 0.98, 1.02 * LOW))
        wanted = LOW * (most / LOW) ** share[j]
        a, b, best = np.log(low), np.log(high), (np.inf, high)
        for _ in range(14):
            is_now = size(np.exp(middle := (a + b) / 2))
            best = min(best, (abs(np.log(max(is_now, 1e-9) / wanted)), float(np.exp(middle))))
            a, b = (middle, b) if is_now < wanted else (a, middle)
            if best[0] < 0.01:
                break
        out.append(best[1])
    return out


def _solve_wide(change, noise, share, low, high):
    """One parameter for all channels, all of which are to change by 3 to 30 noises."""
    grid = np.geomspace(low, high, 9)
    sizes = np.log(np.array([_rms(change(p)) / noise for p in grid]) + 1e-9)
    least, most = sizes.min(axis=1), sizes.max(axis=1)
    first = np.interp(np.log(LOW * 1.04), np.maximum.accumulate(least), np.log(grid))
    last = np.interp(np.log(HIGH * 0.97), np.maximum.accumulate(most), np.log(grid))
    return float(np.exp(first + (last - first) * (share if last > first else 0.5)))


def _shares(rng, k):
    """Sizes between the least (0) and the most (1) on a log scale, alike on all channels."""
    share = np.abs(rng.random() + 0.15 * rng.standard_normal(k)) % 2
    return np.where(share > 1, 2 - share, share)


def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    """The case of a seed with the hidden effects ``names``."""
    d = _device(seed)
    x, start = _motion(seed, excitation, d.kind)
    n, c, clean = len(x), d.channels, _nominal(d, x)
    white = [_rng(seed, p).standard_normal((n, c)) * d.noise for p in (4, 5)]
    w = SimpleNamespace(d=d, x=x, t=np.arange(n) * DT, s=clean, onset=None)
    w.reach = float(x[:N1].max())
    truth, after, held = {}, {}, np.tile(np.arange(n)[:, None], (1, c))
    for name in sorted(names, key=CHAIN.index):
        index, label = NAMES.index(name), drawn(seed, name)
        rng, sizes = _rng(seed, 200 + index), _rng(seed, 300 + index)
        k = c if name in WIDE else int(sizes.integers(1, c + 1))
        ch = np.sort(sizes.permutation(c)[:k])
        share, noise = _shares(sizes, k), d.noise[ch]
        truth[name] = tuple(int(i) for i in ch)
        s, w.v, w.u = w.s.copy(), np.gradient(w.x, DT), (w.s - d.rest) / d.span

        def tried(fn, s=s, ch=ch):
            """The change of channel j's recording 1 where its signal goes through ``fn``."""
            return lambda j, p: fn(j, s[:N1, ch[j]], p) - s[:N1, ch[j]]

        if name == "backlash":
            other, first = rng.uniform(0.4, 0.7), _nominal(d, x[:N1])
            slipped = lambda p: _nominal(d, _slipped(x[:N1], label, p, other)) - first  # noqa: E731
            width = _solve_wide(slipped, noise, share[0], 0.0008, 0.35 * w.reach)
            w.x = _slipped(x, label, width, other)
            s = _nominal(d, w.x)
        elif name == "delay":
            curve, seeds = PchipInterpolator(w.t, s, axis=0), int(rng.integers(2**31))

            def late(p, rows, curve=curve, seeds=seeds, label=label):
                at = w.t[:, None] - _late(w, label, p, np.random.default_rng(seeds))
                at = np.maximum(np.broadcast_to(at, (n, c))[:rows], 0)
                if label != "scan":
                    return curve(at[:, 0])
                return np.stack([curve(at[:, j])[:, j] for j in range(c)], axis=1)

            seconds = _solve_wide(lambda p: late(p, N1) - s[:N1], noise, share[0], 0.003, 1.5)
            s = late(seconds, n)
        elif name in ("lag", "saturation", "slew_limit"):
            one = {"lag": _filtered, "saturation": _limited, "slew_limit": _slewed}[name]
            low, high = {"lag": (0.005, 1.2), "saturation": (0.01, 1.0), "slew_limit": (0.05, 25)}[
                name
            ]
            extra = [(rng.uniform(0.02, 0.07), rng.uniform(8, 16)) for _ in ch]
            if name == "lag":
                extra = [(rng.uniform(0.6, 0.9),) for _ in ch]
            fn = lambda j, y, p: one(y, label, p, *extra[j])  # noqa: E731
            for j, p in enumerate(_solve(tried(fn), noise, share, low, high)):
                s[:, ch[j]] = fn(j, s[:, ch[j]], p)
        elif name == "packet_loss":
            lost = [_events(rng, n, 12.0, 0.2, 1.0) for _ in ch]

            def stale(j, rows, p, lost=lost):
                index = np.arange(rows)
                for a, b in lost[j]:
                    index[a : a + int((b - a) * p)] = a
                return index

            fn = lambda j, y, p: y[stale(j, len(y), p)]  # noqa: E731
            for j, p in enumerate(_solve(tried(fn), noise, share, 0.1, 8)):
                held[:, ch[j]] = stale(j, n, p)
        elif name == "adc_nonlinearity":
            ends = [(s[:N1, i].min(), s[:N1, i].max()) for i in ch]
            if label == "missing_codes":
                gaps = [_missing(rng, *pair) for pair in ends]
                fn = lambda j, y, p: gaps[j](y, p)  # noqa: E731
                solved = _solve(tried(fn), noise, share, 0.05, 1.0)
            else:
                gaps = [_adc_shape(rng, label, *pair) for pair in ends]
                fn = lambda j, y, p: y + p * gaps[j](y)  # noqa: E731
                wanted = LOW * (HIGH / LOW) ** share * noise
                solved = [wanted[j] / _rms(gaps[j](s[:, i])) for j, i in enumerate(ch)]
                for j, i in enumerate(ch if label in ("bow", "s_shape") else ()):  # stay monotone
                    steepest = np.abs(np.diff(gaps[j](np.arange(*ends[j])))).max()
                    solved[j] = min(
                        solved[j], max(0.7 / steepest, LOW * noise[j] / _rms(gaps[j](s[:, i])))
                    )
            after = {
                int(i): (lambda y, j=j, p=solved[j], fn=fn: fn(j, y, p)) for j, i in enumerate(ch)
            }
        else:
            unit = np.asarray(ADDITIVE[name](w, rng, label, ch), dtype=float)
            if name in MATERIAL:
                unit = unit * np.sign(d.span[ch])
            s[:, ch] += unit * (LOW * (HIGH / LOW) ** share * noise / _rms(unit))
        w.s = s

    def recorded(noises):
        y = w.s + noises
        for i, fn in after.items():
            y[:, i] = fn(y[:, i])
        return np.take_along_axis(y, held, axis=0)

    change = (recorded(0.0) - clean)[:N1]
    sims, reals = clean + white[0], recorded(white[1])
    sources = {"sim": sims[:N1], "real": reals[:N1], "sim2": sims[start:], "real2": reals[start:]}
    series = [
        converted(key, y, x[:N1] if len(y) == N1 else x[start:]) for key, y in sources.items()
    ]
    floors, truth = np.sqrt(2 * d.noise**2 + 1 / 6), {name: truth[name] for name in names}
    return Case(*series, change, floors, truth, excitation, onset_s=w.onset, unseen=True)
