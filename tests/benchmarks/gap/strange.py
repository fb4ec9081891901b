"""Cases of a gap that the catalogue does not have: fourteen mechanisms which no entry describes.

Sensors and motions are of an origin of their own, written without a look at this project; nothing
is shared with the other generators. Sizes are in noises of the channel, between SMALLEST and
LARGEST.
"""

from __future__ import annotations

import numpy as np
from cases import Case
from scipy import signal
from scipy.ndimage import gaussian_filter1d

from softsense.recording import FrontEnd, Recording

NAMES: tuple[str, ...] = ()
FOREIGN: tuple[str, ...] = (
    "solder_crack",
    "cable_swing",
    "etalon_fringe",
    "watchdog_retare",
    "tribo_discharge",
    "historian_compression",
    "yarn_snag",
    "lost_steps",
    "alternating_fold",
    "unlogged_bending",
    "bubble_train",
    "anticipating_grip",
    "crack_map_redrawn",
    "thread_load_exchange",
)
RETUNED: tuple[str, ...] = ()
EXCITATIONS = ("rich", "typical", "poor")
ON_ALL = ("lost_steps",)
FEWEST = {"thread_load_exchange": 2}

RATE = 20.0
FIRST, PAUSE, SECOND = 8000, 100, 4000
TOTAL = FIRST + PAUSE + SECOND
TIME = np.arange(TOTAL) / RATE
TOP = 0.4
SMALLEST, LARGEST = 5.0, 30.0  # size, in times the channel's noise


# ------------------------------------------------------------------ motion
def _sweep(times, points, length):
    """Minimum-jerk moves between way points (the time of each, in samples)."""
    now = np.arange(length, dtype=float)
    leg = np.clip(np.searchsorted(times, now, side="right") - 1, 0, len(times) - 2)
    part = np.clip((now - times[leg]) / (times[leg + 1] - times[leg]), 0, 1)
    done = part**3 * (10 - 15 * part + 6 * part * part)
    return points[leg] + (points[leg + 1] - points[leg]) * done


def _rich(rng, length, start, grow):
    times, points = [0.0], [start]

    def move(to, seconds):
        times.append(times[-1] + max(3.0, seconds * RATE))
        points.append(float(np.clip(to, 0, TOP)))

    move(start, 2.0)
    while times[-1] < length:
        if grow:
            top = TOP * min(1.0, 0.25 + 0.85 * times[-1] / length)
        else:
            top = TOP * rng.uniform(0.6, 1.0)
        kind = rng.integers(4)
        if kind == 0:  # steps and holds
            for _ in range(rng.integers(2, 5)):
                move(rng.uniform(0, top), rng.uniform(0.2, 0.6))
                move(points[-1], rng.uniform(3, 10))
        elif kind == 1:  # cycles at one speed
            half = np.exp(rng.uniform(np.log(0.6), np.log(6)))
            bottom = rng.uniform(0, 0.15) * top
            for _ in range(rng.integers(2, 6)):
                move(top, half)
                move(bottom, half)
        elif kind == 2:  # random moves
            for _ in range(rng.integers(8, 25)):
                move(rng.uniform(0, top), rng.uniform(0.4, 2.0))
        else:  # to the top, slowly back, a rest
            move(top, rng.uniform(0.3, 3))
            move(0.0, rng.uniform(3, 10))
            move(0.0, rng.uniform(2, 8))
    return _sweep(np.array(times), np.array(points), length)


def _typical(rng, length, start, human):
    if human:
        fastest = rng.uniform(0.35, 0.8)
        white = rng.standard_normal(length + 2000)
        sections = signal.butter(4, [0.04, fastest], "bandpass", fs=RATE, output="sos")
        wave = signal.sosfilt(sections, white)[2000:]
        wave /= wave.std()
        strain = 0.2 + 0.2 * np.tanh(wave * rng.uniform(0.5, 0.75))
    else:
        times, points = [0.0], [start]
        while times[-1] < length:
            times.append(times[-1] + RATE * rng.uniform(0.8, 3.5))
            far = rng.uniform(0.05, 0.35)
            to = points[-1] + far * (1 if points[-1] < 0.2 else -1)
            points.append(float(np.clip(to, 0.0, TOP)))
        strain = _sweep(np.array(times), np.array(points), length)
    part = np.clip(np.arange(length) / 40.0, 0, 1)
    fade = part * part * (3 - 2 * part)
    return start + (strain - start) * fade


def _poor(rng, length, start):
    period = rng.uniform(16, 40) * RATE
    top, bottom = rng.uniform(0.3, 0.4), rng.uniform(0.0, 0.05)
    phase = (np.arange(length) / period) % 1.0
    strain = bottom + (top - bottom) * (1 - np.abs(2 * phase - 1))
    fade = np.clip(np.arange(length) / 20.0, 0, 1)
    return gaussian_filter1d(start + (strain - start) * fade, 1.5, mode="nearest")


def _motion(seed, excitation):
    rng = np.random.default_rng([seed, 1])
    human = bool(rng.integers(2))

    def session(length, start, grow):
        if excitation == "rich":
            return _rich(rng, length, start, grow)
        if excitation == "typical":
            return _typical(rng, length, start, human)
        return _poor(rng, length, start)

    first = session(FIRST, 0.0, True)
    start = float(rng.uniform(0.0, 0.03))
    part = np.linspace(0, 1, PAUSE)
    pause = first[-1] + (start - first[-1]) * 0.5 * (1 - np.cos(np.pi * part))
    second = session(SECOND, start, False)
    return np.clip(np.concatenate([first, pause, second]), 0.0, TOP)


# ------------------------------------------------------------------ nominal sensors
def _lowpass(strain, seconds):
    keep = np.exp(-1 / (RATE * seconds))
    return signal.lfilter([1 - keep], [1, -keep], strain, zi=[keep * strain[0]])[0]


class Sensor:
    """Curve of a strain that relaxes; codes around zero (make adds the base)."""

    def __init__(self, rng, strain):
        self.parts = rng.uniform(0.03, 0.15, 2)
        self.seconds = (
            np.exp(rng.uniform(np.log(0.4), np.log(3))),
            np.exp(rng.uniform(np.log(8), np.log(60))),
        )
        self.shape = rng.uniform(-0.3, 0.8)
        self.kink = rng.uniform(-0.08, 0.08)
        self.sign = rng.choice([-1.0, 1.0])
        span = rng.uniform(600, 2000)
        self.noise = float(np.clip(span / 400 * np.exp(rng.uniform(-0.3, 0.3)), 1.5, 5.0))
        self.scale = 1.0
        self.scale = span / np.ptp(self(strain))

    def __call__(self, strain):
        """felt = e + sum part (e - lowpass e); codes = x + shape x^2 + kink sin 4x, x = felt/TOP"""
        felt = strain.copy()
        for part, seconds in zip(self.parts, self.seconds, strict=True):
            felt = felt + part * (strain - _lowpass(strain, seconds))
        unit = felt / TOP
        curve = unit + self.shape * unit * unit + self.kink * np.sin(4.0 * unit)
        return self.sign * self.scale * curve


# ------------------------------------------------------------------ helpers of the equations
def _standard(wave):
    return (wave - wave[:FIRST].mean()) / max(wave[:FIRST].std(), 1e-12)


def _band(rng, slowest, fastest):
    """Noise of a band (Hz), of mean zero and deviation one over the first recording."""
    white = rng.standard_normal(TOTAL + 1000)
    sections = signal.butter(2, [slowest, fastest], "bandpass", fs=RATE, output="sos")
    return _standard(signal.sosfilt(sections, white)[1000:])


def _cycles(strain):
    """Number of the cycle at every sample, and the levels of slack and stretched.

    A cycle begins when the sensor, after it was stretched, goes slack.
    """
    slack, stretched = np.quantile(strain[:FIRST], 0.3), np.quantile(strain[:FIRST], 0.6)
    mark = np.where(strain <= slack, 1, np.where(strain >= stretched, 2, 0))
    marked = np.flatnonzero(mark)
    begin = marked[1:][(mark[marked[1:]] == 1) & (mark[marked[:-1]] == 2)]
    begins = np.zeros(len(strain), int)
    begins[begin] = 1
    return np.cumsum(begins), slack, stretched


def _path(strain):
    return np.cumsum(np.abs(np.diff(strain, prepend=strain[0])))


def _rms(added):
    return float(np.sqrt(np.mean(added[:FIRST] ** 2)))


def _to_size(shape, goal):
    return shape * (goal / max(_rms(shape), 1e-12))


def _goal(rng, noise):
    return noise * np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST)))


def _common(rng, ratio, low, high):
    """One scale for all channels, as one cause has: ratio(scale) is size over noise of each.

    Their geometric mean is as drawn, unless a channel would leave SMALLEST ... LARGEST.
    """
    goal = np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST)))

    def solve(value, summary):
        below, above = low, high
        for _ in range(22):
            middle = np.sqrt(below * above)
            if summary(ratio(middle)) < value:
                below = middle
            else:
                above = middle
        return np.sqrt(below * above)

    scale = solve(goal, lambda sizes: np.exp(np.mean(np.log(np.maximum(sizes, 1e-9)))))
    sizes = ratio(scale)
    if sizes.max() > LARGEST:
        scale = solve(LARGEST, np.max)
    elif sizes.min() < SMALLEST:
        scale = solve(SMALLEST, np.min)
    return scale


# ------------------------------------------------------------------ mechanisms
# each: (rng, strain, sensors, nominal codes (TOTAL, all), channels it is on) -> codes it adds
def _solder_crack(rng, strain, sensors, nominal, channels):
    """Cracked joint: opens at rate exp(b (e/0.2 - 1))/t, closes at one rate; a step while open."""
    added = np.zeros_like(nominal)
    for channel in channels:
        bias = rng.uniform(1.5, 3.5)
        opens = np.exp(bias * (strain / 0.2 - 1)) / rng.uniform(4, 9) / RATE
        closes = 1 / rng.uniform(0.8, 2.5) / RATE
        chance, height = rng.random(TOTAL), np.exp(0.35 * rng.standard_normal(TOTAL))
        state, steps = 0.0, np.zeros(TOTAL)
        for i, (drawn, rate) in enumerate(zip(chance.tolist(), opens.tolist(), strict=True)):
            if state == 0.0:
                if drawn < rate:
                    state = height[i]
            elif drawn < closes:
                state = 0.0
            steps[i] = state
        if not steps[:FIRST].any():
            steps[FIRST // 2 : FIRST // 2 + 60] = 1.0
        sign = rng.choice([-1, 1])
        added[:, channel] = _to_size(sign * steps, _goal(rng, sensors[channel].noise))
    return added


def _cable_swing(rng, strain, sensors, nominal, channels):
    """Pendulum of cable: a'' + 2 z w a' + w^2 a = -e''; it pulls with 1 - cos a + tilt sin a."""
    added = np.zeros_like(nominal)
    mount = gaussian_filter1d(strain, 1.0, mode="nearest")
    for channel in channels:
        omega, zeta = 2 * np.pi * rng.uniform(0.4, 1.3), rng.uniform(0.015, 0.05)
        system = ([-1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega * omega])
        over, under, _ = signal.cont2discrete(system, 1 / RATE, method="bilinear")
        angle = signal.lfilter(over.ravel(), under, mount - mount[0])
        angle = np.tanh(angle / angle[:FIRST].std() * 0.6) * 1.3
        tilt = rng.uniform(-0.35, 0.35)
        pull = (1 - np.cos(angle)) + tilt * np.sin(angle)
        pull = pull - pull[:FIRST].mean()
        sign = rng.choice([-1, 1])
        added[:, channel] = _to_size(sign * pull, _goal(rng, sensors[channel].noise))
    return added


def _etalon_fringe(rng, strain, sensors, nominal, channels):
    """Two reflections interfere: cos(2 pi fringes e/TOP + phase), the phase drifts unevenly."""
    added = np.zeros_like(nominal)
    for channel in channels:
        fringes = rng.uniform(1.8, 5.0)
        rate = 2 * np.pi / rng.uniform(15, 40) * rng.choice([-1, 1])
        phase = np.cumsum(rate * (1 + 0.9 * _band(rng, 0.005, 0.1))) / RATE
        fringe = np.cos(2 * np.pi * fringes * strain / TOP + phase)
        added[:, channel] = _to_size(fringe, _goal(rng, sensors[channel].noise))
    return added


def _watchdog_retare(rng, strain, sensors, nominal, channels):
    """A watchdog restarts the amplifier, which tares: -(y at the last restart - mean y)."""
    added = np.zeros_like(nominal)
    period = rng.uniform(9, 28)
    seconds = np.cumsum(period * rng.uniform(0.4, 1.6, int(2 * TOTAL / RATE / period) + 9))
    restarts = np.round(seconds * RATE).astype(int)
    restarts = restarts[(restarts > 0) & (restarts < TOTAL)]
    last = np.searchsorted(restarts, np.arange(TOTAL), side="right")
    for channel in channels:
        tares = nominal[restarts, channel] - nominal[:FIRST, channel].mean()
        tares = np.concatenate([[0.0], tares])
        added[:, channel] = _to_size(-tares[last], _goal(rng, sensors[channel].noise))
    return added


def _tribo_discharge(rng, strain, sensors, nominal, channels):
    """Rubbing charges the skin, sparks empty it: q = path of |de| since the last spark."""
    added = np.zeros_like(nominal)
    path = _path(strain)
    for channel in channels:
        mean = path[-1] / (TOTAL / RATE) * rng.uniform(10, 28)
        sparks = np.cumsum(mean * rng.uniform(0.4, 1.6, int(path[-1] / mean * 3) + 20))
        sparks = np.concatenate([[0.0], sparks])
        charge = path - sparks[np.searchsorted(sparks, path, side="right") - 1]
        charge = charge - charge[:FIRST].mean()
        sign = rng.choice([-1, 1])
        added[:, channel] = _to_size(sign * charge, _goal(rng, sensors[channel].noise))
    return added


def _door(codes, tolerance, batches):
    """Swinging-door archive: lines between the samples kept, on which all others are read.

    batches: (first sample, last sample, width in tolerances); ends of a batch are always kept.
    """
    keep, values = [0], codes.tolist()
    length = len(values)
    for first, end, unit in batches:
        last = min(end, length - 1)
        if first >= last:
            break
        width = unit * tolerance
        hinge, base, upper, lower, i = first, values[first], 1e18, -1e18, first + 1
        while i <= last:
            inverse = 1.0 / (i - hinge)
            rise = values[i] - base
            upper = min(upper, (rise + width) * inverse)
            lower = max(lower, (rise - width) * inverse)
            if lower > upper and i - 1 > hinge:
                hinge = i - 1
                base, upper, lower = values[hinge], 1e18, -1e18
                keep.append(hinge)
                continue
            i += 1
        keep.append(last)
    return np.interp(np.arange(length), keep, codes[keep])


def _historian_compression(rng, strain, sensors, nominal, channels):
    """Archive that keeps the ends of lines within a door of y, wider while its link is crowded."""
    end, batches = 0, []
    while end < TOTAL - 1:
        crowded = rng.random() < 0.55
        more = int(RATE * (4 + rng.exponential(11.0)))
        batches.append((end, end + more, rng.uniform(0.6, 2.0) if crowded else 0.08))
        end += more
    added = np.zeros_like(nominal)
    for channel in channels:
        codes = nominal[:, channel]
        goal, below, above = _goal(rng, sensors[channel].noise), 1.0, 3000.0
        tolerance, least, best = 2.0 * goal, np.inf, None
        for _ in range(14):
            size = _rms(_door(codes[:FIRST], tolerance, batches) - codes[:FIRST])
            miss = abs(np.log(max(size, 1e-6) / goal))
            if miss < least:
                least, best = miss, tolerance
            if miss < 0.02:
                break
            if size < goal:
                below = tolerance
            else:
                above = tolerance
            tolerance *= np.clip(goal / max(size, 1e-6), 0.5, 2.0)
            if not below < tolerance < above:
                tolerance = np.sqrt(below * above)
        lost = _door(codes, best, batches) - codes
        added[:, channel] = lost * np.clip(goal / _rms(lost), 0.8, 1.25)
    return added


def _caught(strain, path, free, reach, longest):
    """Strain at which the yarn is caught, else the strain itself."""
    out, snag, held, since, begun = strain.copy(), 0, None, 0.0, 0
    travelled = path.tolist()
    for i, here in enumerate(strain.tolist()):
        if held is None and travelled[i] - since > free[snag]:
            held, begun = here, i
        if held is not None:
            if abs(here - held) > reach[snag] or i - begun > longest[snag]:
                held, since, snag = None, travelled[i], snag + 1
            else:
                out[i] = held
    return out


def _yarn_snag(rng, strain, sensors, nominal, channels):
    """Yarn catches at strain h until pulled or waited free: codes of e - share (e - h)."""
    added = np.zeros_like(nominal)
    path = _path(strain)
    for channel in channels:
        sensor, codes = sensors[channel], nominal[:, channel]
        goal = _goal(rng, sensor.noise)
        free = rng.exponential(1.0, TOTAL + 1) * rng.uniform(0.8, 1.5)
        reach = rng.uniform(0.5, 1.5, TOTAL + 1)
        longest = (2 + rng.exponential(8.0, TOTAL + 1)) * RATE
        least, held = np.inf, None
        for unit in np.geomspace(0.015, 0.22, 9):
            tried = _caught(strain, path, (free + 0.3) * unit * 1.5, reach * unit, longest)
            size = _rms(sensor(strain - 0.8 * (strain - tried)) - codes)
            miss = abs(np.log(max(size, 1e-6) / goal))
            if miss < least:
                least, held = miss, tried
            if size > 2 * goal:
                break
        below, above = 0.3, 1.3
        for _ in range(12):
            share = 0.5 * (below + above)
            if _rms(sensor(strain - share * (strain - held)) - codes) < goal:
                below = share
            else:
                above = share
        share = 0.5 * (below + above)
        added[:, channel] = sensor(strain - share * (strain - held)) - codes
    return added


def _lost_steps(rng, strain, sensors, nominal, channels):
    """Stepper stalls at a load, short until it homes: codes of max(e - step lost, 0)."""
    cycle, slack, stretched = _cycles(strain)
    cycles = cycle.max() + 1
    stalls = rng.random(cycles) < 0.65
    lowest = slack + 0.3 * (stretched - slack)
    level = rng.uniform(lowest, stretched + 0.3 * (strain.max() - stretched), cycles)
    size = rng.uniform(0.4, 1.6, cycles)
    lost = np.zeros(TOTAL)
    for k in range(cycles):
        here = np.flatnonzero(cycle == k)
        over = np.flatnonzero(strain[here] > level[k])
        if stalls[k] and len(over):
            after = np.arange(len(here)) > over[0]
            home = np.flatnonzero(after & (strain[here] <= slack))
            lost[here[over[0]] : (here[home[0]] if len(home) else here[-1] + 1)] = size[k]
    if not lost[:FIRST].any():
        lost[:FIRST][strain[:FIRST] > stretched] = 1.0
    lost = gaussian_filter1d(lost, 0.8)

    def added(step):
        real = np.maximum(strain - step * lost, 0.0)
        return np.stack([sensor(real) for sensor in sensors], 1) - nominal

    noise = np.array([sensor.noise for sensor in sensors])

    def ratio(step):
        return np.array([_rms(codes) for codes in added(step).T]) / noise

    return added(_common(rng, ratio, 1e-4, 0.35))


def _alternating_fold(rng, strain, sensors, nominal, channels):
    """Skin folds to the other side every cycle: (-1)^cycle max(e - slack, 0)^power."""
    cycle, slack, _ = _cycles(strain)
    added = np.zeros_like(nominal)
    for channel in channels:
        fold = np.maximum(0.0, strain - slack) ** rng.uniform(0.6, 1.2)
        side = np.where((cycle + rng.integers(2)) % 2 == 0, 1.0, -1.0)
        added[:, channel] = _to_size(side * fold, _goal(rng, sensors[channel].noise))
    return added


def _unlogged_bending(rng, strain, sensors, nominal, channels):
    """Bending b about two axes nobody logs: (b + square (b^2 - 1)) (1 + product e/TOP)."""
    slowest = rng.uniform(0.05, 0.12)
    pitch = _band(rng, slowest, rng.uniform(0.25, 0.6))
    roll = _band(rng, slowest, rng.uniform(0.25, 0.6))
    added = np.zeros_like(nominal)
    for channel in channels:
        place = rng.uniform(0, 2 * np.pi)
        bend = np.cos(place) * pitch + np.sin(place) * roll
        square = bend + rng.uniform(0.2, 0.5) * (bend * bend - 1)
        felt = square * (1 + rng.uniform(0.2, 1.5) * strain / TOP)
        added[:, channel] = _to_size(felt, _goal(rng, sensors[channel].noise))
    return added


def _bubble_train(rng, strain, sensors, nominal, channels):
    """Bubbles pass channel by channel: sum size exp(-|(t - t0)/w|^3/2), times 1 + k e/TOP."""
    starts = np.cumsum(2 + rng.exponential(rng.uniform(7, 14), 200))
    starts = starts[starts < TOTAL / RATE] - 1.0
    size, slow = np.exp(0.35 * rng.standard_normal(len(starts))), rng.uniform(0.7, 1.6, len(starts))
    apart, wide = rng.uniform(2, 5), rng.uniform(0.8, 2.0)
    added = np.zeros_like(nominal)
    for place, channel in enumerate(rng.permutation(channels)):
        away = (TIME[:, None] - starts - place * apart * slow) / (wide * slow)
        bumps = (size * np.exp(-0.5 * np.abs(away) ** 3)).sum(1)
        sensor = sensors[channel]
        felt = sensor.sign * bumps * (1 + rng.uniform(0.3, 1.5) * strain / TOP)
        added[:, channel] = _to_size(felt, _goal(rng, sensor.noise))
    return added


def _anticipating_grip(rng, strain, sensors, nominal, channels):
    """A hand tightens before a move it knows of: (t/ramp)^power up to it, exp(-t/2) after it."""
    tops = signal.find_peaks(strain, prominence=0.03)[0]
    bottoms = signal.find_peaks(-strain, prominence=0.03)[0]
    speed = np.abs(np.gradient(strain)) * RATE
    quiet = gaussian_filter1d((speed < 0.003).astype(float), 5) > 0.95
    begins = np.flatnonzero(quiet[:-1] & ~quiet[1:]) + 8  # a rest ends, a move begins
    moves = np.unique(np.concatenate([tops, bottoms, begins]))
    moves = moves[moves < TOTAL]
    moves = moves[np.concatenate([[True], np.diff(moves) > 8])]
    size = np.exp(0.45 * rng.standard_normal(len(moves))) * (rng.random(len(moves)) < 0.7)
    share, power = rng.uniform(0.35, 0.55), rng.uniform(1.0, 2.0)
    longest = rng.uniform(4, 7) * RATE
    grip = np.zeros(TOTAL)
    for k, move in enumerate(moves):
        since = move - (moves[k - 1] if k else 0)
        ramp = min(int(np.clip(share * since, 4, longest)), move)
        rise = size[k] * (np.arange(1, ramp + 1) / ramp) ** power
        grip[move - ramp : move] = np.maximum(grip[move - ramp : move], rise)
        tail = min(7, TOTAL - move)
        fall = size[k] * np.exp(-np.arange(tail) / 2.0)
        grip[move : move + tail] = np.maximum(grip[move : move + tail], fall)
    added = np.zeros_like(nominal)
    for channel in channels:
        sign = rng.choice([-1, 1])
        added[:, channel] = _to_size(sign * grip, _goal(rng, sensors[channel].noise))
    return added


def _crack_map_redrawn(rng, strain, sensors, nominal, channels):
    """Cracks of a film open at strains drawn anew each cycle: sum of jumps below e, less trend."""
    cycle, slack, _ = _cycles(strain)
    cycles, bins = cycle.max() + 1, 160
    level = np.clip((strain - slack) / (TOP - slack), 0, 1) * (bins - 1)
    index = level.astype(int)
    added = np.zeros_like(nominal)
    for channel in channels:
        many = rng.uniform(5, 12) / bins
        jumps = rng.gamma(1.5, 1.0, (cycles, bins)) * (rng.random((cycles, bins)) < many)
        cracks = np.cumsum(jumps - many * 1.5, 1)
        cracks -= cracks[:, :1]
        cracks *= rng.choice([-1, 1])
        felt = cracks[cycle, index] * np.clip(level / 8.0, 0, 1)
        added[:, channel] = _to_size(felt, _goal(rng, sensors[channel].noise))
    return added


def _thread_load_exchange(rng, strain, sensors, nominal, channels):
    """Threads side by side slip when stretched and share anew: w (y - y0), sum of w zero."""
    stretched = strain > np.quantile(strain[:FIRST], 0.55)
    hazard = np.where(stretched, 1 / rng.uniform(2.5, 6), 0.0) / RATE
    slips = np.flatnonzero(rng.random(TOTAL) < hazard)
    shares = np.zeros((len(slips) + 1, len(channels)))
    load = rng.standard_normal(len(channels))
    for i in range(len(shares)):
        shares[i] = load - load.mean()
        load = 0.4 * load + np.sqrt(1 - 0.16) * rng.standard_normal(len(channels))
    share = shares[np.searchsorted(slips, np.arange(TOTAL), side="right")]
    share = gaussian_filter1d(share, 0.6, axis=0)
    unit = np.zeros_like(nominal)
    for k, channel in enumerate(channels):
        unit[:, channel] = share[:, k] * (nominal[:, channel] - nominal[0, channel])
    noise = np.array([sensors[channel].noise for channel in channels])
    sizes = np.array([_rms(unit[:, channel]) for channel in channels]) / noise
    return unit * _common(rng, lambda scale: scale * sizes, 1e-5, 10.0)


MECHANISMS = {
    "solder_crack": _solder_crack,
    "cable_swing": _cable_swing,
    "etalon_fringe": _etalon_fringe,
    "watchdog_retare": _watchdog_retare,
    "tribo_discharge": _tribo_discharge,
    "historian_compression": _historian_compression,
    "yarn_snag": _yarn_snag,
    "lost_steps": _lost_steps,
    "alternating_fold": _alternating_fold,
    "unlogged_bending": _unlogged_bending,
    "bubble_train": _bubble_train,
    "anticipating_grip": _anticipating_grip,
    "crack_map_redrawn": _crack_map_redrawn,
    "thread_load_exchange": _thread_load_exchange,
}


# ------------------------------------------------------------------ a case
def make(seed: int, names: tuple[str, ...], excitation: str) -> Case:
    if len(names) > 1 or not set(names) <= set(FOREIGN):
        raise ValueError(f"{names!r}: at most one name, of {', '.join(FOREIGN)}")
    if excitation not in EXCITATIONS:
        raise ValueError(f"{excitation!r}: an excitation is one of {', '.join(EXCITATIONS)}")
    strain = _motion(seed, excitation)
    rng = np.random.default_rng([seed, 2])
    count = int(rng.integers(3, 8))
    sensors = [Sensor(rng, strain) for _ in range(count)]
    nominal = np.stack([sensor(strain) for sensor in sensors], 1)
    noise = np.array([sensor.noise for sensor in sensors])

    change, truth = np.zeros_like(nominal), {}
    for name in names:
        own = np.random.default_rng([seed, 10 + FOREIGN.index(name)])
        many = count if name in ON_ALL else int(own.integers(FEWEST.get(name, 1), count + 1))
        channels = np.sort(own.choice(count, many, replace=False))
        change += MECHANISMS[name](own, strain, sensors, nominal, channels)
        truth[name] = tuple(int(channel) for channel in channels)

    # the base: nominal at least 200 codes from the rails, and what is real inside them too
    real = nominal + change
    low = np.maximum(200 - nominal.min(0), 32 - real.min(0))
    high = np.minimum(3895 - nominal.max(0), 4063 - real.max(0))
    drawn = low + (high - low) * rng.uniform(0.0, 1.0, count)
    base = np.where(high > low, drawn, 0.5 * (low + high))
    nominal, real = nominal + base, real + base

    labels = tuple(f"s{i + 1}" for i in range(count))
    ends = tuple(FrontEnd("codes", 12) for _ in range(count))

    def record(name, values, part, stream):
        clean = values[part]
        white = np.random.default_rng([seed, stream]).standard_normal(clean.shape)
        codes = np.clip(np.round(clean + noise * white), 0, 4095).astype(np.int32)
        target = strain[part][:, None].copy()
        seconds = np.arange(len(clean)) / RATE
        return Recording(name, labels, codes, ("strain",), ("1",), target, seconds, ends)

    first, second = slice(0, FIRST), slice(FIRST + PAUSE, TOTAL)
    return Case(
        sim=record("sim", nominal, first, 101),
        real=record("real", real, first, 102),
        sim2=record("sim2", nominal, second, 103),
        real2=record("real2", real, second, 104),
        change=change[first].copy(),
        floors=np.sqrt(2 * noise**2 + 1 / 6),
        truth=truth,
        excitation=excitation,
        onset_s=None,
        unseen=True,
    )
