"""How well the diagnosis does on made cases.

  python tests/benchmarks/gap/run.py [--half NAME] [--cases N] [--jobs N] [--dask ADDRESS]
                                     [--json FILE]

The held-out half has seeds and equations of its own; thresholds are set on the training half.
``elsewhere``, ``liquid``, ``wearable``, ``actuator``, ``optical``, ``insole``, ``arm``,
``finger`` and ``garment`` have sensors, motions and equations of other origins, and ``strange``
has only what no entry of the catalogue describes.
exact: the hidden effects named and nothing else. Cases per effect: --cases; excitation goes
rich, typical, rich, typical … and a poor one for the size of the ambiguity set.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import actuator
import arm
import cases
import elsewhere
import finger
import garment
import insole
import liquid
import optical
import strange
import wearable
from cases import LAST, NAMES, SAMPLES

from softsense.diagnose import augment, diagnose

# What may be said where an entry of the catalogue is withheld, besides that it is unknown: what
# explains most of the same signal, or cannot be told from it without another experiment.
ALIASES = {
    "hysteresis": {"backlash", "relaxation"},
    "backlash": {"hysteresis", "lag", "delay"},
    "relaxation": {"hysteresis", "drift", "lag"},
    "lag": {"delay", "relaxation", "backlash"},
    "delay": {"lag", "backlash"},
    "drift": {"random_walk", "relaxation", "step", "temperature"},
    "random_walk": {"drift"},
    "step": {"random_walk", "drift"},
    "gain": {"adc_nonlinearity", "crosstalk", "saturation", "drift", "step", "temperature"},
    "saturation": {"adc_nonlinearity", "gain"},
    "adc_nonlinearity": {"gain", "saturation", "crosstalk"},
    "crosstalk": {"gain", "adc_nonlinearity"},
    "softening": {"drift", "hysteresis", "random_walk"},
    "overshoot": {"noise"},
    "interference": {"noise"},
    "spikes": {"noise"},
    "noise": set(),
}
RANDOM = {"random_walk", "interference", "spikes", "noise"}
EXCITATIONS = ("rich", "typical")
HALVES = (
    *("train", "held-out", "elsewhere", "liquid", "strange"),
    *("wearable", "actuator", "optical", "insole", "arm", "finger", "garment"),
)
OF_OTHERS = {
    "elsewhere": elsewhere,
    "liquid": liquid,
    "strange": strange,
    "wearable": wearable,
    "actuator": actuator,
    "optical": optical,
    "insole": insole,
    "arm": arm,
    "finger": finger,
    "garment": garment,
}

# What is hidden, seed, excitation, half, and what shall not be known.
Job = tuple[tuple[str, ...], int, str, str, tuple[str, ...]]


def score(job: Job) -> dict[str, Any]:
    """One case: what was hidden, what was said, and what it closes."""
    names, seed, excitation, half, without = job
    if half in OF_OTHERS:
        case = OF_OTHERS[half].make(seed, names, excitation)
    else:
        case = cases.make(seed, names, excitation, half == "held-out")
    start, begun = time.process_time(), time.perf_counter()
    diagnosis = diagnose(case.sim, case.real, without=without)
    seconds, on_the_clock = time.process_time() - start, time.perf_counter() - begun
    data = diagnosis.data
    said = {effect["name"]: effect for effect in data["effects"]}
    overlap = []
    for name in said.keys() & case.truth.keys():
        found = {int(channel[1:]) - 1 for channel in said[name]["channels"]}
        true = set(case.truth[name])
        overlap.append(len(found & true) / len(found | true))
    sets = [{e["name"], *(o["name"] for o in e["alternatives"])} for e in data["effects"]]
    onset = data["where"]["onset_s"]
    result = {
        "hidden": list(names),
        "excitation": excitation,
        "unseen": case.unseen,
        "said": list(said),
        "kinds": [effect["kind"] for effect in data["effects"]],
        "unknown": data["unexplained"]["unknown_effect"],
        "left": data["unexplained"]["share"],
        "overlap": overlap,
        "sets": [sorted(group) for group in sets],
        "onset_error_s": abs(onset - case.onset_s) if onset and case.onset_s else None,
        "seconds": seconds,
        "on_the_clock": on_the_clock,
    }
    if names and not set(names) & RANDOM and not without:
        result |= _closure(case, diagnosis)
    return result


def _closure(case: Any, diagnosis: Any) -> dict[str, Any]:
    """Claimed and true closed shares, on this motion and the next, and the estimator's error."""
    added = diagnosis.augmented - case.sim.codes
    left = float(((case.change - added) ** 2).sum() / (case.change**2).sum())
    later = augment(diagnosis, case.sim2).codes.astype(float)
    floor = float((case.floors**2).sum()) * len(case.sim2)
    before = float(((case.real2.codes - case.sim2.codes.astype(float)) ** 2).sum()) - floor
    after = float(((case.real2.codes - later) ** 2).sum()) - floor
    data = diagnosis.data
    low, high = data["after"]["shrink_ci95"]
    return {
        "claimed": data["after"]["shrink"],
        "closed": 1.0 - left,
        "covered": low <= 1.0 - left <= high,
        "closed_later": 1.0 - after / before,
        "estimator": data["after"]["estimator_rmse"] / data["gap"]["estimator_rmse_floor"],
    }


def jobs(half: str, count: int) -> dict[str, list[Job]]:
    """All cases by what they are to show, ``count`` of each effect."""
    rng = np.random.default_rng(LAST * HALVES.index(half))
    two = [tuple(str(n) for n in rng.choice(NAMES, 2, replace=False)) for _ in range(10 * count)]
    # The training half does without the last of those that are foreign or retuned.
    some = slice(None, -1 if half == "train" else None)
    source = OF_OTHERS.get(half, cases)
    foreign, retuned = source.FOREIGN[some], source.RETUNED[some]

    def each(base: int, names: Sequence[str], some: int) -> list[Job]:
        return [
            ((name,), base + 1000 * i + k, EXCITATIONS[k % 2], half, ())
            for i, name in enumerate(names)
            for k in range(some)
        ]

    null = [((), 50_000 + k, EXCITATIONS[k % 2], half, ()) for k in range(6 * count)]
    return {
        "one": each(0, NAMES, count),
        "poor": [((n,), 80_000 + i, "poor", half, ()) for i, n in enumerate(NAMES)],
        "none": null,
        "two": [(n, 60_000 + k, EXCITATIONS[k % 2], half, ()) for k, n in enumerate(two)],
        "foreign": each(90_000, foreign, 3 * count),
        "retune": each(100_000, [f"retune:{n}" for n in retuned], 2 * count),
        "withheld": [
            ((n,), 110_000 + i, EXCITATIONS[i % 2], half, (n,)) for i, n in enumerate(NAMES)
        ],
    }


def table(results: dict[str, list[dict[str, Any]]]) -> dict[str, str]:
    """The measures by name."""

    def rate(values: list[bool]) -> str:
        return f"{100.0 * float(np.mean(values)):.0f} % of {len(values)}" if values else "-"

    one, two = results["one"], results["two"]
    closing = [r for r in one if "closed" in r]

    def covered(row: list[dict[str, Any]]) -> str:
        return rate([any(r["hidden"][0] in group for group in r["sets"]) for r in row])

    def size(row: list[dict[str, Any]]) -> str:
        return f"{np.mean([len(r['sets'][0]) for r in row if r['sets']]):.1f}"

    def alias(r: dict[str, Any]) -> bool:
        allowed = ALIASES[r["hidden"][0]]
        return r["unknown"] or bool(r["said"] and set(r["said"]) <= allowed)

    def exact(row: list[dict[str, Any]], unseen: bool) -> str:
        right = [set(r["said"]) == set(r["hidden"]) for r in row if r["unseen"] == unseen]
        return rate(right) if right else "-"

    overlaps = [o for r in one for o in r["overlap"]]
    onsets = [r["onset_error_s"] for r in one if r["onset_error_s"] is not None]
    apart = [abs(r["claimed"] - r["closed"]) for r in closing]
    later = [r["closed_later"] for r in closing]
    return {
        "one effect, exact": rate([set(r["said"]) == set(r["hidden"]) for r in one]),
        "  with equations of the training half": exact(one, False),
        "  with equations never seen": exact(one, True),
        "one effect, top-1": rate([r["said"][:1] == r["hidden"] for r in one]),
        "two effects, both and nothing else": rate(
            [set(r["said"]) == set(r["hidden"]) for r in two]
        ),
        "  with equations of the training half ": exact(two, False),
        "  with an equation never seen": exact(two, True),
        "two effects, at least one": rate([bool(set(r["said"]) & set(r["hidden"])) for r in two]),
        "no effect, false alarm": rate([bool(r["said"]) or r["unknown"] for r in results["none"]]),
        "foreign mechanism said to be unknown": rate([r["unknown"] for r in results["foreign"]]),
        "known effect called unknown": rate([r["unknown"] for r in one]),
        "wrong parameter: said to retune": rate(
            [bool(r["kinds"]) and set(r["kinds"]) == {"retune"} for r in results["retune"]]
        ),
        "true effect in the ambiguity set": covered(one),
        "the same, poor excitation": covered(results["poor"]),
        "size of the set, mean": size(one),
        "the same, poor excitation ": size(results["poor"]),
        "entry withheld: unknown or its alias": rate([alias(r) for r in results["withheld"]]),
        "channels, intersection over union": f"{np.mean(overlaps):.3f}",
        "onset of a step, median error": f"{np.median(onsets):.2f} s" if onsets else "-",
        "excess gap closed, same motion, mean": f"{np.mean([r['closed'] for r in closing]):.3f}",
        "excess gap closed, next motion, mean": f"{np.mean(later):.3f}",
        "next motion made worse": rate([value < 0.0 for value in later]),
        "claimed and true shrink apart, mean": f"{np.mean(apart):.3f}",
        "true shrink within the 95 % interval": rate([r["covered"] for r in closing]),
        "estimator: augmented over real, median": (
            f"{np.median([r['estimator'] for r in closing]):.2f}"
        ),
        "CPU time per case, mean": f"{np.mean([r['seconds'] for r in one]):.2f} s",
    }


def mapped(work: list[Job], count: int, address: str | None) -> list[dict[str, Any]]:
    """Scores in the order of ``work``: here, in ``count`` processes, or on a Dask cluster."""
    if address is not None:
        from dask.distributed import Client

        with Client(address) as client:
            client.run(sys.path.insert, 0, str(Path(__file__).parent))
            done: list[dict[str, Any]] = client.gather(client.map(score, work))
        return done
    if count == 1:
        return [score(job) for job in work]
    from multiprocessing import get_context

    with get_context("spawn").Pool(count) as pool:
        return pool.map(score, work, chunksize=1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--half", choices=HALVES, default="train")
    parser.add_argument("--cases", type=int, default=3, help="per effect (default 3)")
    parser.add_argument("--only", help="one kind of cases, e.g. two: prints each of them")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--dask", metavar="ADDRESS", help="of a Dask scheduler")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    groups = jobs(args.half, args.cases)
    if args.half == "strange":
        if args.only not in (None, "foreign"):
            parser.error(f"strange has only foreign cases, and none of {args.only!r}")
        args.only = "foreign"
    if args.only:
        groups = {args.only: groups[args.only]}
    flat = [job for group in groups.values() for job in group]
    done = iter(mapped(flat, args.jobs, args.dask))
    results = {name: [next(done) for _ in group] for name, group in groups.items()}
    for name, rows in results.items():
        for row in rows if args.only else []:
            print(name, "+".join(row["hidden"]), row["excitation"], "->", end=" ")
            print("+".join(row["said"]), row["kinds"], "unknown" if row["unknown"] else "")
    if args.only:
        if args.only == "foreign":
            unknown = sum(row["unknown"] for row in results["foreign"])
            print(f"unknown: {unknown} of {len(results['foreign'])}")
        elif args.only in ("one", "two"):
            said = [(set(row["said"]), set(row["hidden"])) for row in results[args.only]]
            exact, some = sum(a == b for a, b in said), sum(bool(a & b) for a, b in said)
            print(f"exact: {exact} of {len(said)}, at least one: {some}")
        clock = np.mean([row["on_the_clock"] for row in results[args.only]])
        print(f"{clock:.2f} s a case on the clock, {args.jobs} at once, {os.cpu_count()} cores")
        return 0
    for effect in NAMES:
        rows = [r for r in results["one"] if r["hidden"] == [effect]]
        wrong = ["+".join(r["said"]) or "nothing" for r in rows if r["said"] != [effect]]
        note = f"also said: {', '.join(wrong)}" if wrong else ""
        print(f"  {effect:18} {len(rows) - len(wrong)} of {len(rows)}  {note}")
    measures = table(results)
    print(f"{args.half}, {SAMPLES} samples a case")
    for name, value in measures.items():
        print(f"  {name:40} {value}")
    if args.json:
        everything = {"half": args.half, "table": measures, "cases": results}
        args.json.write_text(json.dumps(everything, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
