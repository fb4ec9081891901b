"""How well the diagnosis does on made cases.

  python tests/benchmarks/gap/run.py [--half train|held-out] [--cases N] [--json FILE]

Prints exact and top-1 rates per effect, false alarms, pairs, channels, onset, and time per case.
exact: that effect named and nothing else. top-1: named first. The held-out half has seeds and
equations of its own; thresholds are set on the training half.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from cases import EXCITATIONS, NAMES, make

from softsense.diagnose import diagnose


def score(names: tuple[str, ...], seed: int, excitation: str, held_out: bool) -> dict[str, Any]:
    """One case: what was hidden, what was said."""
    case = make(seed, names, excitation, held_out)
    start = time.perf_counter()
    data = diagnose(case.sim, case.real).data
    seconds = time.perf_counter() - start
    said = [effect["name"] for effect in data["effects"]]
    overlap = []
    for effect in data["effects"]:
        if effect["name"] in case.truth:
            found = {int(channel[1:]) - 1 for channel in effect["channels"]}
            true = set(case.truth[effect["name"]])
            overlap.append(len(found & true) / len(found | true))
    sets = [{e["name"], *(o["name"] for o in e["alternatives"])} for e in data["effects"]]
    onset = data["where"]["onset_s"]
    return {
        "hidden": list(names),
        "said": said,
        "exact": set(said) == set(names),
        "first": bool(said) and said[0] in names,
        "overlap": overlap,
        "covered": all(any(name in group for group in sets) for name in names),
        "set_size": len(sets[0]) if sets else 0,
        "onset_error_s": abs(onset - case.onset_s) if onset and case.onset_s else None,
        "unknown": data["unexplained"]["unknown_effect"],
        "seconds": seconds,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--half", choices=("train", "held-out"), default="train")
    parser.add_argument("--cases", type=int, default=3, help="per effect (default 3)")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    held_out = args.half == "held-out"
    rng = np.random.default_rng(int(held_out))
    results = []
    for number, name in enumerate(NAMES):
        row = []
        for k in range(args.cases):
            excitation = EXCITATIONS[k % 2]
            row.append(score((name,), 1000 * number + k, excitation, held_out))
        results += row
        wrong = ["+".join(r["said"]) or "nothing" for r in row if not r["exact"]]
        said = f"also said: {', '.join(wrong)}" if wrong else ""
        print(f"  {name:18} {sum(r['exact'] for r in row)} of {len(row)}  {said}", flush=True)
    nulls = [score((), 50_000 + k, EXCITATIONS[k % 3], held_out) for k in range(4 * args.cases)]
    pairs = []
    for k in range(5 * args.cases):
        names = tuple(str(n) for n in rng.choice(NAMES, 2, replace=False))
        pairs.append(score(names, 60_000 + k, EXCITATIONS[k % 2], held_out))

    def rate(values: list[bool]) -> str:
        return f"{100.0 * float(np.mean(values)):.0f} % of {len(values)}"

    onsets = [r["onset_error_s"] for r in results if r["onset_error_s"] is not None]
    overlaps = [o for r in results for o in r["overlap"]]
    table = {
        "one effect, exact": rate([r["exact"] for r in results]),
        "one effect, top-1": rate([r["first"] for r in results]),
        "true effect in the ambiguity set": rate([r["covered"] for r in results]),
        "size of the set, mean": f"{np.mean([r['set_size'] for r in results]):.1f}",
        "known effect called unknown": rate([r["unknown"] for r in results]),
        "no effect, false alarm": rate([bool(r["said"]) or r["unknown"] for r in nulls]),
        "two effects, both and nothing else": rate([r["exact"] for r in pairs]),
        "two effects, at least one": rate([bool(set(r["said"]) & set(r["hidden"])) for r in pairs]),
        "channels, intersection over union": f"{np.mean(overlaps):.3f}",
        "onset of a step, median error": f"{np.median(onsets):.1f} s" if onsets else "-",
        "time per case": f"{np.mean([r['seconds'] for r in results]):.2f} s",
    }
    print(f"{args.half} half")
    for name, value in table.items():
        print(f"  {name:36} {value}")
    if args.json:
        everything = {"half": args.half, "table": table, "cases": [*results, *nulls, *pairs]}
        args.json.write_text(json.dumps(everything, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
