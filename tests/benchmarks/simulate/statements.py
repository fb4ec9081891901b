"""How often the simulated rig says what the paper's rig said, over many seeds.

    python tests/benchmarks/simulate/statements.py [SEEDS] [--json FILE]

Every statement of Thuruthel et al. (2021) that the simulator's constants were chosen for is
checked on recordings of 8000 samples; a seed draws wires, samples and motion. Accuracy is that of
a ridge regression on polynomials (degree 5 for one sensor, 4 for two, 3 beyond), tested on held-
out blocks of time: a cheap stand-in for the network of the paper.
"""

from __future__ import annotations

import argparse
import json
import sys
from itertools import combinations, combinations_with_replacement
from pathlib import Path

import numpy as np

from softsense.simulate import (
    all_wires,
    finger_rig,
    linear_rig,
    random_motion,
    run,
    simulate,
    to_recording,
    triangle,
)
from softsense.simulate.characterise import characterise, two_factor

SAMPLES = 8000
DT_S = 0.05
DEGREE = {1: 5, 2: 4}
MI_BINS = 24
PLATINUM = ("Dragon Skin 20", "Ecoflex 20")


def accuracies(
    codes: np.ndarray, strain: np.ndarray, sizes: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7)
) -> dict[tuple[int, ...], float]:
    """Held-out RMSE of the target for every subset of sensors of these sizes."""
    middle = strain.mean()
    strain = strain - middle
    scaled = (codes - codes.mean(axis=0)) / np.ptp(codes, axis=0) * 2.0
    count = codes.shape[1]
    terms = [
        term for degree in range(6) for term in combinations_with_replacement(range(count), degree)
    ]
    wanted = [
        term for term in terms if len(term) <= DEGREE.get(len(set(term)), 3) or len(term) <= 3
    ]
    values = np.stack([np.prod(scaled[:, list(term)], axis=1) for term in wanted], axis=1)
    test = np.isin(np.arange(len(strain)) * 20 // len(strain), (1, 6, 11, 16))
    gram, moment = values[~test].T @ values[~test], values[~test].T @ strain[~test]
    gram_test, moment_test = values[test].T @ values[test], values[test].T @ strain[test]
    power = strain[test] @ strain[test]
    result = {}
    for size in sizes:
        for subset in combinations(range(count), size):
            degree = DEGREE.get(size, 3)
            use = [i for i, t in enumerate(wanted) if set(t) <= set(subset) and len(t) <= degree]
            block = gram[np.ix_(use, use)]
            ridge = 1e-6 * np.trace(block) / len(use) * np.eye(len(use))
            weights = np.linalg.solve(block + ridge, moment[use])
            left = power - 2 * weights @ moment_test[use]
            left += weights @ gram_test[np.ix_(use, use)] @ weights
            result[subset] = float(np.sqrt(max(left, 0.0) / test.sum()))
    return result


def pair_information(codes: np.ndarray, strain: np.ndarray, pair: tuple[int, ...]) -> float:
    """Plug-in mutual information, bits, of a pair with the strain, in bins of equal counts."""
    ranks = [np.argsort(np.argsort(column)) for column in (*codes[:, list(pair)].T, strain)]
    a, b, y = (rank * MI_BINS // len(strain) for rank in ranks)
    joint = np.zeros((MI_BINS * MI_BINS, MI_BINS))
    np.add.at(joint, (a * MI_BINS + b, y), 1.0 / len(strain))
    product = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0)
    used = joint > 0
    return float((joint[used] * np.log2(joint[used] / product[used])).sum())


def rank_correlation(a: list[float], b: list[float]) -> float:
    """Spearman's."""
    ranks = [np.argsort(np.argsort(values)) for values in (a, b)]
    return float(np.corrcoef(ranks)[0, 1])


def about_accuracy(seed: int) -> dict[str, bool | float | None]:
    """Statements on seven drawn wires under the random motion. None: wires not drawn."""
    rig, strain = linear_rig(seed), random_motion(SAMPLES, DT_S, seed)
    codes = run(rig, strain, seed).codes.astype(np.float64)
    matrix = [sensor.matrix for sensor in rig.sensors]
    rmse = accuracies(codes, strain)
    alone = sorted(range(7), key=lambda i: rmse[(i,)])
    pairs = list(combinations(range(7), 2))
    best = min(pairs, key=lambda pair: rmse[pair])
    by_size = [[rmse[s] for s in rmse if len(s) == size] for size in range(1, 8)]
    means = [float(np.mean([v**-2 for v in values])) for values in by_size]
    information = [pair_information(codes, strain, pair) for pair in pairs]
    rubber = {i for i in range(7) if matrix[i] == "natural rubber"}
    sealant = {i for i in range(7) if matrix[i] == "silicone sealant"}
    others = [rmse[(i,)] for i in range(7) if i not in rubber]
    return {
        "natural rubber best alone": matrix[alone[0]] == "natural rubber" if rubber else None,
        "  error of the next matrix / natural rubber": min(others) / rmse[(alone[0],)]
        if rubber
        else None,
        "sealant worst alone": matrix[alone[-1]] == "silicone sealant" if sealant else None,
        "sealant + natural rubber the best pair": {matrix[i] for i in best}
        == {"natural rubber", "silicone sealant"}
        if rubber and sealant
        else None,
        "best pair mixes matrices": matrix[best[0]] != matrix[best[1]],
        "mean accuracy grows with every sensor": bool((np.diff(means) > 0).all()),
        "MI ranks the pairs (Spearman > 0.7)": rank_correlation(
            information, [-rmse[pair] for pair in pairs]
        )
        > 0.7,
        "  Spearman of MI and accuracy": rank_correlation(
            information, [-rmse[pair] for pair in pairs]
        ),
        "  strain RMSE, best alone (% of range)": 100 * min(by_size[0]),
        "  strain RMSE, best pair (% of range)": 100 * min(by_size[1]),
        "  strain RMSE, all seven (% of range)": 100 * by_size[6][0],
    }


def about_matter(seed: int) -> dict[str, bool | float | None]:
    """Statements on all fourteen wires: base resistance, drift, repeatability."""
    rig, strain = linear_rig(seed, all_wires()), random_motion(SAMPLES, DT_S, seed)
    found = characterise(to_recording(rig, run(rig, strain, seed)), rig)
    platinum = [sensor.matrix in PLATINUM for sensor in rig.sensors]
    base = np.array([sensor.base_ohm for sensor in found.sensors])
    drift = np.abs([sensor.drift_share for sensor in found.sensors])
    plain = [not is_platinum for is_platinum in platinum]
    silpoxy = {sensor.name for sensor in rig.sensors if sensor.matrix == "Sil-Poxy"}
    flagged = [pair for pair in found.pairs if not pair.repeatable]
    return {
        "platinum-cured: 5 to 20 times the base resistance": bool(
            5 < np.median(base[platinum]) / np.median(base[plain]) < 20
        ),
        "platinum-cured: every one drifts more than any other": bool(
            drift[platinum].min() > drift[plain].max()
        ),
        "  drift, platinum-cured / others (medians)": float(
            np.median(drift[platinum]) / np.median(drift[plain])
        ),
        "Sil-Poxy flagged as unrepeatable": any(pair.first in silpoxy for pair in flagged),
        "the other pairs agree": all(pair.first in silpoxy for pair in flagged),
    }


def about_stress(seed: int) -> dict[str, bool | float | None]:
    """Fig. 4: a small network predicts resistance from strain and stress, not from strain."""
    rig = linear_rig(seed)
    strain = triangle(2400, DT_S, 3.5, 30.0)
    nets = two_factor(to_recording(rig, run(rig, strain, seed)), rig, seed)
    left = [(1 - n.from_strain_and_stress_r2) / (1 - n.from_strain_r2) for n in nets]
    return {
        "strain and stress give R^2 > 0.99 of ln R, all wires": min(
            n.from_strain_and_stress_r2 for n in nets
        )
        > 0.99,
        "stress helps, all wires": max(left) < 1.0,
        "  R^2 from strain alone, worst wire": min(n.from_strain_r2 for n in nets),
        "  share of the error that stress leaves, median wire": float(np.median(left)),
    }


def about_finger(seed: int) -> dict[str, bool | float | None]:
    """The finger: no sensor alone knows the pose, all seven know it better."""
    recording = simulate(finger_rig(seed), 15000, seed)
    codes = recording.codes.astype(np.float64)
    result: dict[str, bool | float | None] = {}
    for column, name in enumerate(recording.targets):
        rmse = accuracies(codes, recording.target[:, column], sizes=(1, 7))
        alone, together = min(rmse[(i,)] for i in range(7)), rmse[tuple(range(7))]
        result[f"finger, {name}: all seven beat the best alone"] = together < alone
        result[f"  finger, {name}: RMSE, best alone"] = alone
        result[f"  finger, {name}: RMSE, all seven"] = together
    return result


PARTS = (about_accuracy, about_matter, about_stress, about_finger)


def rates(seeds: int, parts: tuple = PARTS) -> dict:
    """For each statement, (times true, times asked), or the list of values of a number."""
    table: dict[str, list] = {}
    for seed in range(seeds):
        for part in parts:
            for name, value in part(seed).items():
                table.setdefault(name, []).append(value)
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=40)
    parser.add_argument("--json", type=Path, help="write the rows here")
    args = parser.parse_args()
    table = rates(args.seeds)
    rows = {}
    for name, values in table.items():
        asked = [value for value in values if value is not None]
        if isinstance(asked[0], float) and not isinstance(asked[0], bool):
            low, middle, high = np.quantile(asked, (0.05, 0.5, 0.95))
            rows[name.strip()] = {"median": middle, "from": low, "to": high}
            text = f"{middle:.3g} ({low:.3g} … {high:.3g} in 90 % of seeds)"
        else:
            rows[name.strip()] = {"true": int(sum(asked)), "asked": len(asked)}
            text = f"{sum(asked)} of {len(asked)} seeds"
        print(f"{name:62s} {text}")
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
