"""Stress softening (Mullins effect): below its largest strain so far the material is softer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import erf

from softsense.effects import Candidate, Context, Effect, Floats, Nominal, Parameter, State, Values
from softsense.effects.operators import compiled

# Ways below the largest strain after which networks that soften side by side are soft.
NETWORKS = (0.05, 0.2)
# Strain at which chains of some lengths break, and strain gone beyond it until they have, of the
# range.
LIMITS = (0.25, 0.45, 0.65, 0.85)
PATIENCE = (0.1, 0.3, 1.0)
# Strain gone, in ranges, in which the first cycles soften it: what takes longer is ageing, and what
# is soft at once a scale.
FIRST_WAYS = (1.5, 4.0)
ENDS_WAYS = (1.0, 6.0)
# The same where it goes on below an earlier largest strain.
CYCLES_WAYS = (1.5, 4.0, 10.0)
# How far below the largest strain it is soft, beside what stays stretched.
SET_WIDTHS = (0.05, 0.08, 0.13, 0.2, 0.32, 0.5)
# How slowly the largest strain is forgotten, where it is.
HEAL_S = (150.0, 400.0)
# How long damage takes to follow a larger strain, where it is not done at once.
YIELDS_S = (1.0, 4.0)
# The largest strain so far grows by this share of the range at least.
LEAST_GROWTH = 0.02
# What damage alone does changes by this share of itself, or is a gain; or is a curve.
LEAST_DAMAGED = 0.1
LEAST_BENT = 0.25
# Around what was found, so that from round to round it comes closer.
WIDTHS_NEAR = np.array([0.45, 0.76, 1.0, 1.2, 2.2])
GROWTHS_NEAR = np.array([0.5, 0.8, 1.0, 1.4, 2.0])


def simulate(
    u: Floats, context: Context, values: Values, form: str, state: State | None
) -> tuple[Floats, State]:
    """u (1 - D s), s from 0 at the largest strain so far to 1 far below it."""
    x = context.strain[:, None]
    earlier = -np.inf if state is None else state["largest"]
    largest = np.maximum(np.maximum.accumulate(x, axis=0), earlier)
    if form == "exponential":
        soft = -np.expm1(-(largest - x) / values["width"])
    else:
        # Energy on the virgin path, as of a linear material.
        below = 0.5 * (largest**2 - np.maximum(x, 0.0) ** 2)
        soft = erf(np.maximum(below, 0.0) / values["width"])
    return u * (1.0 - values["depth"] * soft), {"largest": float(largest[-1, 0])}


def explain(nominal: Nominal) -> list[Candidate]:
    """Functions of the largest strain so far and of the distance below it.

    Where that is reached at once they are curves of the signal, and say nothing of softening.
    """
    if np.ptp(nominal.reference.largest) < LEAST_GROWTH:
        return []
    some = _bends(nominal) + _first_cycles(nominal, FIRST_WAYS)
    return some + _laws(nominal, np.array([0.05, 0.2, 0.8]), np.array([0.0, 0.3, 1.0]))


def zoom(nominal: Nominal, values: Mapping[str, float]) -> list[Candidate]:
    """The laws of softening around one width, or first cycles around one way; and whatever it is
    near, chains of classes, what is forgotten, goes on over cycles, leaves a set or a curve."""
    often = _classes(nominal) + _forgetting(nominal) + _over_cycles(nominal)
    often += [*_with_set(nominal), _settled(nominal)]
    if "ways" in values:
        near = np.clip(values["ways"] * np.geomspace(0.5, 2.0, 9), *ENDS_WAYS)
        return _bends(nominal) + often + _first_cycles(nominal, np.unique(near).tolist())
    if "width" not in values or "heal_s" in values:
        return _bends(nominal) + often
    if "grows" not in values:
        return often + _damage(nominal, values["width"] * np.geomspace(0.4, 2.5, 9))
    grows = values["grows"]
    return often + _laws(
        nominal,
        values["width"] * WIDTHS_NEAR,
        np.array([0.0, 0.15]) if not grows else grows * GROWTHS_NEAR,
    )


def _classes(nominal: Nominal) -> list[Candidate]:
    """Chains of some lengths, which break over some cycles where the strain passes their limits
    (Diani, Brieu and Vacherand, Eur. J. Mech. A 25, 2006): what they carried below is lost."""
    x = np.maximum(nominal.strain, 0.0)
    forth = np.maximum(np.diff(nominal.strain, prepend=nominal.strain[0]), 0.0)
    result = []
    for patience in PATIENCE:
        lost = []
        for limit in LIMITS:
            broken = -np.expm1(-np.cumsum(np.where(x > limit, forth, 0.0)) / patience)
            lost.append(broken * np.maximum(1.0 - (x / limit) ** 2, 0.0) * x * nominal.span)
        values = {"patience": patience}
        result.append(Candidate(np.stack(lost, axis=1), values, "classes", parallel=True))
    return result


def _first_cycles(nominal: Nominal, ways: Sequence[float]) -> list[Candidate]:
    """A share that is lost over the first cycles, whatever their strain, where all are alike."""
    gone, kept = nominal.way, nominal.kept()
    signals = _signal(kept) * kept.span, kept.strain * kept.span
    result = []
    for way in ways:
        lost = -np.expm1(-gone / way)
        for signal in signals:
            result.append(Candidate((lost * signal)[:, None], {"ways": way}, "first cycles"))
    return result


def _forgetting(nominal: Nominal) -> list[Candidate]:
    """The exponential law below a largest strain that is slowly forgotten."""
    result = []
    for heal_s in HEAL_S:
        largest = _largest(nominal.strain, 0.0, float(np.exp(-nominal.dt_s / heal_s)))
        for width in (0.15, 0.25, 0.4):
            soft = -np.expm1(-(largest - nominal.strain) / width) * nominal.span
            values = {"width": width, "heal_s": heal_s}
            for part in (soft * _signal(nominal), soft * nominal.strain):
                result.append(Candidate(part[:, None], values, "forgetting"))
    return result


def _over_cycles(nominal: Nominal) -> list[Candidate]:
    """What is softer below the largest strain so far, and goes on to soften for some cycles."""
    kept = nominal.kept()
    below, x = kept.largest - kept.strain, kept.strain
    parts = np.stack([below, below * x, below**2, np.sqrt(below) * x], axis=1) * kept.span
    return [
        Candidate(-np.expm1(-nominal.way / way)[:, None] * parts, {"ways": way}, "over cycles")
        for way in CYCLES_WAYS
    ]


def _with_set(nominal: Nominal) -> list[Candidate]:
    """The exponential law, and what stays stretched by the largest strain so far (Dorfmann and
    Ogden, Int. J. Solids Struct. 41, 2004); also beside a curve, to which a simulator may have been
    calibrated."""
    nominal = nominal.kept()
    x, below, curve = nominal.strain, nominal.largest - nominal.strain, _curve(nominal)
    result = []
    for width in SET_WIDTHS:
        law = -np.expm1(-below / width) * x
        parts, values = [law, law * x, below, below * nominal.largest], {"width": width}
        for more, curved in (([], False), (curve, True)):
            columns = np.stack([*parts, *more], axis=1) * nominal.span
            result.append(Candidate(columns, values, "set", curved=curved))
    return result


def _settled(nominal: Nominal) -> Candidate:
    """Where the largest strain is soon met, what softens is a curve from then on, and little is
    seen of how it came to that: bends, damage and that curve."""
    nominal = nominal.kept()
    x, top, below = nominal.strain, nominal.largest, nominal.largest - nominal.strain
    parts = [below, below * top, below**2, below * x, top * x, top * x**2]
    columns = np.stack([*parts, *_curve(nominal)], axis=1) * nominal.span
    return Candidate(columns, {}, "settled", curved=True, pliable=True)


def _curve(nominal: Nominal) -> list[Floats]:
    """(samples,) each: powers of the signal."""
    return [_signal(nominal) ** power for power in (1, 2, 3)]


def _signal(nominal: Nominal) -> Floats:
    """(samples,) codes from those at rest, in spans: what is soft loses a share of these."""
    return nominal.once("signal", lambda: (nominal.u - nominal.rest) / nominal.span)


@compiled
def _largest(strain: Floats, rising: float, falling: float) -> Floats:
    """(samples,) largest strain so far, of whose distance so much is kept from sample to sample:
    ``rising`` where the strain is larger, ``falling`` where it is forgotten."""
    output = np.empty_like(strain)
    largest = strain[0]
    for k in range(len(strain)):
        kept = rising if strain[k] > largest else falling
        largest = strain[k] + (largest - strain[k]) * kept
        output[k] = largest
    return output


def _laws(nominal: Nominal, widths: Floats, growths: Floats) -> list[Candidate]:
    """Ogden and Roxburgh's erf of the energy, whose width may grow with the largest energy, and
    an exponential of the distance; in proportion to signal, strain, or a mixture. And damage alone.
    """
    damaged = _damage(nominal, widths)
    nominal = nominal.kept()
    energy, top = np.maximum(nominal.strain, 0.0) ** 2, np.maximum(nominal.largest, 0.0) ** 2
    below = nominal.largest - nominal.strain
    laws = [
        ("ogden-roxburgh", width, grows, erf((top - energy) / (width + grows * top)))
        for width in widths
        for grows in growths
    ]
    laws += [("exponential", width, 0.0, -np.expm1(-below / width)) for width in widths]
    result = []
    for form, width, grows, law in laws:
        values = {"width": float(width), "grows": float(grows)}
        soft = law * nominal.span
        parts = [soft * _signal(nominal), soft * nominal.strain, soft * nominal.largest]
        result += [Candidate(part[:, None], values, form) for part in parts]
        result.append(Candidate(np.stack([*parts[:2], soft], axis=1), values, form))
    return result + damaged


def _damage(nominal: Nominal, widths: Floats) -> list[Candidate]:
    """Damage that only grows where it was never strained as much, with the strain (Miehe, Eur. J.
    Mech. A 14, 1995) or with its energy (Simo, Comput. Methods Appl. Mech. Eng. 60, 1987): nothing
    is stiffer close to the largest strain. At once, or in some seconds."""
    result = []
    # Whatever else moves the strain, and on another motion, the candidates are the same ones.
    seen = np.maximum(nominal.reference.largest, 0.0)
    kept = nominal.kept()
    tops: list[tuple[Floats, dict[str, float]]] = [(kept.largest, {})]
    for after_s in YIELDS_S:
        late = _largest(nominal.strain, float(np.exp(-nominal.dt_s / after_s)), 1.0)
        tops.append((late[nominal.keep], {"after_s": after_s}))
    laws = []
    for width in widths:
        for power in (1, 2):
            first = -np.expm1(-(seen**power) / width)
            changes = first.std() / max(first.mean(), 1e-12)
            if changes >= LEAST_DAMAGED:
                laws.append((float(width), power, changes >= LEAST_BENT))
    for top, after in tops:
        for width, power, much in laws:
            damage = -np.expm1(-(np.maximum(top, 0.0) ** power) / width) * nominal.span
            parts = [[damage * _signal(kept)], [damage * kept.strain]]
            if much:
                # What is lost of what carried it need not be a share of all.
                parts.append([damage * kept.strain, damage * kept.strain**2])
            result += [
                Candidate(np.stack(part, axis=1), {"width": width, **after}, "damage")
                for part in parts
            ]
    return result


def _bends(nominal: Nominal) -> list[Candidate]:
    nominal = nominal.kept()
    below = nominal.largest - nominal.strain
    bends = [below, below * nominal.largest, below**2, below * nominal.strain]
    deep = np.minimum(below / (0.1 + 0.9 * nominal.largest), 1.0)
    lost = nominal.largest * _signal(nominal)
    x, top = nominal.strain, nominal.largest
    laws = [-np.expm1(-below / width) for width in NETWORKS]
    networks = [law * part for law in laws for part in (x, x * top, x * x, top)]
    several = np.stack(networks, axis=1) * nominal.span
    result = [
        Candidate(np.stack(parts, axis=1) * nominal.span, {}, form)
        for parts, form in (
            (bends, "exponential"),
            ([*bends, deep, lost], "ogden-roxburgh"),
            (bends[:2], "exponential"),
        )
    ]
    return [*result, Candidate(several, {}, "networks", pliable=True)]


EFFECT = Effect(
    name="softening",
    stage="material",
    mechanism="bonds broken by the largest strain so far leave the material softer below it",
    equation="u (1 - D s); exponential: s = 1 - exp(-(x_m - x)/w); "
    "ogden_roxburgh: s = erf((W(x_m) - W(x))/w), W = x^2/2; x_m the largest strain so far",
    source="Ogden and Roxburgh, Proc. R. Soc. A 455 (1999); Miehe, Eur. J. Mech. A 14 (1995); "
    "Simo, Comput. Methods Appl. Mech. Eng. 60 (1987); "
    "Mullins, Rubber Chem. Technol. 42 (1969); with a permanent set: Dorfmann and Ogden, Int. J. "
    "Solids Struct. 41 (2004)",
    fingerprint="depends on the largest strain so far, most below an earlier maximum",
    parameters=(
        Parameter("depth", "1", 0.02, 0.5, 0.15, "share of the signal that is lost"),
        Parameter("width", "strain range (its square)", 0.05, 1.0, 0.3, "way to become soft"),
    ),
    simulate=simulate,
    explain=explain,
    zoom=zoom,
    forms=("exponential", "ogden_roxburgh"),
)
