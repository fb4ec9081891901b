"""Requests under each kind of fault: prints how many answers were wrong (none may be).

python tests/benchmarks/link/soak.py [--requests 100000] [--board host] [--faults SPEC]
                                      [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from softsense.device import connect
from softsense.device.emulator import parse_faults
from softsense.errors import SoftsenseError

MODEL = Path(__file__).resolve().parents[2] / "firmware" / "model"
KINDS = [
    "",
    "drop=0.001",
    "flip=0.001",
    "noise=0.001",
    "delay=2ms",
    "reorder=0.05",
    "cut=1s",
    "reset=1s",
    "drop=0.0005,flip=0.0005,noise=0.0005,delay=2ms,cut=5s,reorder=0.02,reset=5s",
]
PART = 2000


def expected(x: np.ndarray) -> np.ndarray:
    """The stand-in network of tests/firmware/model."""
    x0, x1 = x.astype(np.int64).T
    product = x0 * x1
    return (3 * x0 - 5 * x1 + np.sign(product) * (abs(product) // 16))[:, None]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--requests", type=int, default=100_000)
    parser.add_argument("--board", default="host")
    parser.add_argument("--faults", help="only these, e.g. drop=0.01,delay=20ms,reset")
    parser.add_argument("--json", type=Path, help="write the rows here")
    args = parser.parse_args()
    rng = np.random.default_rng(0)
    print(f"{args.requests} requests of one row each, board {args.board}")
    print("fault              wrong  errors  retries  damaged  resets  cuts  requests/s")
    rows: list[dict[str, object]] = []
    kinds = KINDS if args.faults is None else [args.faults]
    for number, text in enumerate(kinds):
        wrong = errors = 0
        started = time.monotonic()
        faults = parse_faults(text)
        with connect(MODEL, f"emulate:{args.board}", faults=faults, seed=number) as device:
            for _ in range(0, args.requests, PART):
                x = rng.integers(-32768, 32768, (PART, 2)).astype(np.int16)
                try:
                    wrong += int(np.sum(device.estimate(x, batch=1) != expected(x)))
                except SoftsenseError as error:
                    errors += 1
                    print(f"  {error}")
            seconds = time.monotonic() - started
            counters, cable = device.counters, device.owner
        assert cable is not None
        label = "all together" if "," in text else text or "none"
        print(
            f"{label:18s} {wrong:5d} {errors:7d} {counters.retries:8d} {counters.damaged:8d} "
            f"{cable.resets:7d} {cable.cuts:5d} {args.requests / seconds:11.0f}",
            flush=True,
        )
        rows.append(
            {
                "faults": text,
                "requests": args.requests,
                "wrong": wrong,
                "errors": errors,
                "retries": counters.retries,
                "resets": cable.resets,
                "cuts": cable.cuts,
                "requests_per_s": args.requests / seconds,
            }
        )
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 3 if any(row["wrong"] for row in rows) else 0


if __name__ == "__main__":
    raise SystemExit(main())
