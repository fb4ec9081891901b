"""Effects without a mean: noise, spikes and lines, in what is left over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.stats import kurtosis

from softsense.diagnose import wandering
from softsense.diagnose.cores import all_at_once
from softsense.diagnose.nominal import Motion, noise_rms
from softsense.diagnose.spikes import (
    MANY,
    SPIKE_COUNT,
    are_steps,
    beyond_mean,
    has_lone,
    plain_of,
    spike_hits,
    standing_out,
    sudden_hits,
    without_spikes,
)
from softsense.diagnose.tones import (
    SAME_HZ,
    SLOW_SHARE,
    between_lines,
    line_of,
    made_by_motion,
    only_while_on,
    slow_line,
    while_off,
    without_tone,
)
from softsense.diagnose.walk import innovations, likely_gain

Floats = NDArray[np.float64]

# Real and simulated noise differ anyway by up to this factor.
NOISE_FACTOR = 2.5
# Less will do on few channels where all others, at least so many, are louder than simulated by
# factors that are equal within so much.
LONE_FACTOR = 1.6
AGREEING = 3
AGREED = 1.15
# And less still where some, at least so many, are as loud as simulated within this factor.
SIMULATED = 2
RIGHT = 1.1
BESIDE_RIGHT = 1.4
# Noise is uneven where its power varies by such a factor; by more beside an effect that ever moves,
# from one sample to the next, by so much of the noise.
UNEVEN = 2.5
UNEVEN_BESIDE = 8.0
MOVING = 0.3
# Or where it is louder by some factor besides: uneven by such a one, of such an excess kurtosis, of
# some colour, or in bursts.
SOMEWHAT = 1.4
RATHER_UNEVEN = 1.5
BURSTS = 1.5
# The slowest of so many samples are still.
STILL = 0.2
# Noise of two channels goes together by less than this.
OWN_NOISE = 0.2
# Within so many samples an edge of what was explained is no spike.
SPIKE_EDGE = 7
# Of the spikes in an effect's leftovers such a share must stand out: what is rough in places only
# is not spiky there.
SPIKE_STANDS = 0.5
# Where nothing is explained yet nearly all must, for how fast the strain is there.
EVIDENTLY_STANDS = 0.75
# How many more tones may be beside one, and their least power, of the noise's.
MORE_TONES = 2
LEAST_TONE = 0.05
# Of a tone that is taken out before all else: its power, of the noise's, and what is no motion.
LOUD_TONE = 0.5
FAST_HZ = 0.4
# And of a slow one that another channel has, or that may be beside a walk, its share of all power.
LEAST_SLOW = 0.03


@dataclass(frozen=True)
class Finding:
    """A variance-type effect on ``channels``, with a number that says how strong it is."""

    name: str
    channels: tuple[int, ...]
    value: float
    what: str


def findings(
    left: Floats,
    residual: Floats,
    own: Floats,
    motion: Motion,
    explained: bool,
    walking: Sequence[int] = (),
    heard: Sequence[float] = (),
    bent: Sequence[int] = (),
    edged: Sequence[int] = (),
    coarse: Sequence[int] = (),
    codes: Sequence[Floats] = (),
    noisy: Sequence[int] = (),
) -> list[Finding]:
    """Test the leftovers ``left`` (samples, channels) in codes, against the simulation's ``own``.

    ``residual``: the same before anything was explained, where a line that one channel seemed to
    hear of another is still there. ``explained``: an effect has been taken out, whose form being
    only nearly right leaves edges and ripples: spikes and lines must then stand out more, and what
    swings with the motion is no line.
    ``walking``: channels with a random walk, or coloured noise, which is left over too. ``heard``:
    tones (Hz) that were found before, and need stand out no more than where nothing is explained.
    ``bent``: channels behind a curve, which is steep for their noise where it is steep for them.
    ``edged``: channels behind a converter, whose edges make noise where they are.
    ``coarse``: channels whose converter has lost codes, between which noise makes it leap.
    ``codes``, each (samples, channels), which may tell what is sharp. ``noisy``: channels whose gap
    is noise.
    """
    there = noise_rms(own)
    alone = each_alone(left)

    def of_channel(c: int, heard: Sequence[float] = heard) -> _Found:
        covariates = _covariates(motion.felt_by(c))
        return _found(
            left[:, c],
            residual[:, c],
            own[:, c],
            float(there[c]),
            motion.felt_by(c),
            covariates[1:] if c in bent else covariates,
            explained,
            bool(alone[c]),
            c in walking,
            c in edged,
            heard,
            c in coarse,
            [met[:, c] for met in codes],
        )

    each = all_at_once(of_channel, range(left.shape[1]))
    tones = [one.line for one in each if one.line is not None]
    if tones:
        # What one channel has others may have too, less loud.
        deaf, tone = [c for c, one in enumerate(each) if one.line is None], float(np.median(tones))
        listened = all_at_once(lambda c: of_channel(c, [tone]), deaf)
        for c, one in zip(deaf, listened, strict=True):
            each[c] = one
    spiky = [c for c, one in enumerate(each) if one.spiky]
    lines = {c: one.line for c, one in enumerate(each) if one.line is not None}
    levels = {c: one.level for c, one in enumerate(each) if one.level is not None}
    loud = {c: one.level for c, one in enumerate(each) if one.level is not None and one.loud}
    # A tone takes some of the noise beside it along.
    toneless = {c: levels[c] / there[c] for c in levels if c not in lines}
    loud |= {c: levels[c] for c in _apart(toneless) - set(bent)}
    for c in noisy:
        rest = without_spikes(left[:, c]) if c in spiky else left[:, c]
        level, white = float(np.std(rest)), float(noise_rms(rest[:, None])[0])
        # Its colour, or its bursts, must be as loud as all that was simulated.
        if level > max(SOMEWHAT * there[c], np.hypot(white, there[c])):
            loud[c] = level
    result = []
    if spiky:
        result.append(Finding("spikes", tuple(spiky), float(len(spiky)), "channels with spikes"))
    if lines:
        frequency = float(np.median(list(lines.values())))
        for c in set(range(left.shape[1])) - set(lines):
            line = line_of(without_spikes(residual[:, c]), motion.dt_s, 2.0)
            if line is not None and abs(line - frequency) < SAME_HZ:
                lines[c] = line
        result.append(Finding("interference", tuple(sorted(lines)), frequency, "frequency_hz"))
    if loud:
        result.append(Finding("noise", tuple(sorted(loud)), max(loud.values()), "rms_codes"))
    return result


@dataclass(frozen=True)
class _Found:
    """Of one channel: its line (Hz), if it has spikes, how loud it is, and if that is noise."""

    line: float | None
    spiky: bool = False
    level: float | None = None
    loud: bool = False


def _found(
    left: Floats,
    residual: Floats,
    own: Floats,
    there: float,
    motion: Motion,
    covariates: Sequence[Floats],
    explained: bool,
    alone: bool,
    walking: bool,
    edged: bool,
    heard: Sequence[float],
    coarse: bool,
    codes: Sequence[Floats],
) -> _Found:
    """``findings`` of one channel: all (samples,). ``there``: the simulation's noise; ``alone``:
    no other channel has anything of what is left."""
    enough = MANY * SPIKE_COUNT if explained else SPIKE_COUNT
    # Each is looked for without the others: a tone hides spikes, and both pass for noise.
    rest = left
    news = _news(rest) if walking else rest
    least = 2.0 if explained else LEAST_TONE
    plain = plain_of(left)
    line = line_of(plain_of(news) if walking else plain, motion.dt_s, least)
    if walking:
        # A walk follows a slow tone too.
        line = line or line_of(plain, motion.dt_s, least)
    if line is None and heard:
        again = line_of(without_spikes(news), motion.dt_s, LEAST_TONE)
        line = next((f for f in heard if again and abs(again - f) < SAME_HZ), None)
    if line is not None and explained and made_by_motion(rest, motion, line):
        line = None
    line = line or slow_line(plain, motion, LEAST_SLOW if walking else SLOW_SHARE)
    off = np.ones(len(rest), dtype=bool)
    if line is not None:
        rest = without_tone(rest, line, motion.dt_s)
        news = _news(rest) if walking else rest
        off = while_off(plain, line, motion.dt_s)
    if coarse:
        return _Found(line)
    # Tails pass for a walk, which foretells them: what it does not is no longer sharp.
    sharp = rest if walking and not spike_hits(news).any() else news
    hit = sudden_hits(sharp)
    # What was explained may jump a moment early or late.
    said = residual - left
    jumps = maximum_filter1d(said, SPIKE_EDGE) - minimum_filter1d(said, SPIKE_EDGE)
    hit &= beyond_mean(sharp) > jumps
    # Spikes bend a tone all around them.
    stands = SPIKE_STANDS if said.any() else EVIDENTLY_STANDS * (line is None)
    if _few_stand_out(sharp, hit, covariates[-1], stands):
        hit[:] = False
    rest = news
    if only_while_on(hit, off):
        # What is left of a tone is no noise either.
        hit[:] = False
        rest = without_spikes(rest)
    if hit.any() and are_steps(sharp, hit, codes):
        hit[:] = False
    lone = hit.any() and has_lone(sharp) and not has_lone(own)
    spiky = bool(lone or hit.sum() >= enough + 2 * spike_hits(own).sum())
    if spiky:
        rest = without_spikes(rest)
    # How a tone fades leaves some of it.
    quiet = rest[off]
    level = between_lines(quiet) if line is not None else float(noise_rms(quiet[:, None])[0])
    # What an equation leaves that is only nearly right comes with moves, where it says them.
    moving, pace = float(np.abs(np.diff(said)).max()) > MOVING * there, covariates[-1:]
    unevenness = UNEVEN_BESIDE if moving else UNEVEN
    if walking:
        level = min(level, _under_walk(left))
    if moving and not (alone and wandering.with_speed(rest - rest.mean(), covariates[-1])):
        level, covariates = min(level, _still(rest, motion)), covariates[:-1]
    here, simulated = _unevenness(rest, covariates), _unevenness(own, covariates)
    uneven = here > unevenness >= simulated
    if explained and line is None and not (walking or edged):
        # Of what is in bursts all is noise, also where it is quieter for most of the time, but not
        # if they come with moves.
        with_moves = _unevenness(rest, pace) > UNEVEN
        if not with_moves and wandering.in_bursts(rest - rest.mean()):
            level = max(level, float(np.std(rest)))
    louder = level / max(there, 1.0)
    if not explained and louder > SOMEWHAT:
        # Two signs of it together, though each alone could be as simulated.
        uneven |= louder * np.sqrt(here) > NOISE_FACTOR and here > RATHER_UNEVEN * simulated
        uneven |= _tails(rest) > BURSTS > 2.0 * _tails(own)
    return _Found(line, spiky, level, bool(louder > NOISE_FACTOR or (uneven and not spiky)))


def evident(
    residual: Floats, motion: Motion, coarse: Sequence[int] = (), codes: Sequence[Floats] = ()
) -> list[Finding]:
    """Loud tones and many spikes of each channel that are seen before anything is explained.

    What all channels have in common they would else seem to hear of each other, and what is sharp
    would have to be explained again without it. On channels that are ``coarse`` all is sharp.
    ``codes``, each (samples, channels), which may tell what is sharp.
    """

    def seen(c: int, heard: Sequence[float] = ()) -> list[Finding]:
        result, signal, feels = [], residual[:, c], motion.felt_by(c)
        plain = plain_of(signal)
        line = line_of(plain, motion.dt_s, LEAST_TONE if heard else LOUD_TONE, FAST_HZ)
        if line is not None and (heard or made_by_motion(plain, feels, line)):
            line = next((f for f in heard if abs(line - f) < SAME_HZ), None)
        if line is None:
            line = slow_line(plain, feels, LEAST_SLOW if heard else SLOW_SHARE)
        if line is not None:
            result.append(Finding("interference", (c,), line, "frequency_hz"))
            signal = without_tone(signal, line, motion.dt_s)
        hit = sudden_hits(signal)
        if line is not None and only_while_on(hit, while_off(plain, line, motion.dt_s)):
            return result
        if _few_stand_out(signal, hit, _covariates(feels)[-1], EVIDENTLY_STANDS * (line is None)):
            return result
        many = hit.sum() >= MANY * SPIKE_COUNT
        many = many and not are_steps(signal, hit, [met[:, c] for met in codes])
        if c not in coarse and (many or has_lone(signal)):
            result.append(Finding("spikes", (c,), 1.0, "channels with spikes"))
        return result

    each = all_at_once(seen, range(residual.shape[1]))
    heard = [f.value for found in each for f in found if f.name == "interference"]
    deaf = [c for c, found in enumerate(each) if not any(f.value in heard for f in found)]
    if heard:
        # What is loud on one channel need not be so on others, beside a walk.
        for c, found in zip(deaf, all_at_once(lambda c: seen(c, heard), deaf), strict=True):
            each[c] = found
    return [finding for found in each for finding in found]


def _few_stand_out(signal: Floats, hit: NDArray[np.bool_], speed: Floats, share: float) -> bool:
    """Whether less than this ``share`` of what is ``hit`` stands out, if anything is."""
    return bool(share and hit.any()) and standing_out(signal, hit, speed) < share * hit.sum()


def _news(signal: Floats) -> Floats:
    """What of ``signal`` (samples,) a random walk in it does not foretell."""
    gain = likely_gain(signal, float(noise_rms(signal[:, None])[0]))
    return innovations(signal[:, None], gain)[:, 0]


def cleaned(residual: Floats, found: list[Finding], motion: Motion) -> Floats:
    """``residual`` (samples, channels) without the spikes and lines of ``found``."""

    def of_channel(c: int) -> Floats:
        clean = residual[:, c]
        # Tones first, which hide spikes.
        for finding in sorted(found, key=lambda finding: finding.name):
            if c not in finding.channels or finding.name not in ("spikes", "interference"):
                continue
            if finding.name == "spikes":
                clean = without_spikes(clean)
                continue
            clean = without_tone(clean, finding.value, motion.dt_s)
            for _ in range(MORE_TONES):
                plain = without_spikes(clean)
                line = line_of(plain, motion.dt_s, LEAST_TONE)
                if line is None or made_by_motion(plain, motion.felt_by(c), line):
                    break
                clean = without_tone(clean, line, motion.dt_s)
        return clean

    return np.stack(all_at_once(of_channel, range(residual.shape[1])), axis=1)


def noise_beside(residual: Floats, found: Sequence[Finding]) -> Floats:
    """(channels,) noise of a ``residual`` (samples, channels) that is ``cleaned`` of what was
    ``found``: with a tone went what noise there is near its frequency."""
    level = noise_rms(residual)
    for c in {c for finding in found if finding.name == "interference" for c in finding.channels}:
        level[c] = max(level[c], between_lines(residual[:, c]))
    return level


def _apart(more: Mapping[int, float]) -> set[int]:
    """Channels that are louder than simulated by far ``more`` than most are, which agree."""
    least = min(more.values(), default=0.0)
    usual = {c for c, factor in more.items() if factor < AGREED * least}
    others = more.keys() - usual
    most = max((more[c] for c in usual), default=0.0)
    if len(usual) >= SIMULATED and least > 1.0 / RIGHT and most < RIGHT:
        return others if all(more[c] > BESIDE_RIGHT for c in others) else set()
    apart = all(more[c] > LONE_FACTOR * most for c in others)
    return others if apart and len(usual) >= max(AGREEING, len(others) + 1) else set()


def each_alone(left: Floats) -> NDArray[np.bool_]:
    """(channels,) whether a channel of ``left`` (samples, channels) goes with no other one."""
    together = np.abs(np.atleast_2d(np.corrcoef(left.T)))
    np.fill_diagonal(together, 0.0)
    return np.asarray(together.max(axis=0) < OWN_NOISE)


def _still(left: Floats, motion: Motion) -> float:
    """The noise while the strain hardly moves."""
    third = np.diff(left, 3) / np.sqrt(20.0)
    speed = np.abs(np.gradient(motion.strain))[1:-2]
    level: float = np.sqrt(np.mean(third[speed <= np.quantile(speed, STILL)] ** 2))
    return level


def _under_walk(signal: Floats) -> float:
    """Noise of ``signal`` (samples,) beside a random walk, whose moves are independent: one after
    the other they go against each other by what noise makes of both."""
    moves = np.diff(signal)
    return float(np.sqrt(max(-float(np.mean(moves[1:] * moves[:-1])), 0.0)))


def _covariates(motion: Motion) -> list[Floats]:
    """(samples,) each of what noise may vary with: strain, and its rate."""
    return [motion.strain, np.abs(np.gradient(motion.strain))]


def _unevenness(left: Floats, along: Sequence[Floats]) -> float:
    """The factor by which the noise's power varies with any of ``along``, at most."""
    square = (np.diff(left, 2, append=[left[-1]] * 2) / np.sqrt(6.0)) ** 2
    most = 1.0
    for covariate in along:
        edges = np.quantile(covariate, [0.25, 0.75])
        quiet, loud = square[covariate <= edges[0]], square[covariate >= edges[1]]
        ratio = (loud.mean() + 0.05) / (quiet.mean() + 0.05)
        most = max(most, float(ratio), 1.0 / float(ratio))
    return most


def _tails(left: Floats) -> float:
    """Excess kurtosis of what is fast: noise that comes and goes has some."""
    return float(kurtosis(np.diff(left, 2)))
