"""Throughput and latency of the link, per board, beside what the link could carry at most.

python tests/benchmarks/link/throughput.py [--baud 115200] [--boards host,mps2-an386]
                                            [--json FILE]

The limit is that of the busier direction: ten bits per byte, every byte of a frame counted, while
requests go one way and answers the other at the same time.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from softsense.device import Faults, boards, connect
from softsense.device.framing import OVERHEAD, STRUCTS
from softsense.device.transport import now_s

MODEL = Path(__file__).resolve().parents[2] / "firmware" / "model"
SECONDS = 4.0
# COBS and the zeros around a frame.
WRAPPING = 3


def limit(baud: int, rows: int) -> float:
    """Estimates per second of two int16 inputs and one int32 output, ``rows`` per request."""
    there = OVERHEAD + STRUCTS["estimate request"].size + 4 * rows
    back = OVERHEAD + STRUCTS["estimate answer"].size + 4 * rows
    longest = max(size + WRAPPING + size // 254 for size in (there, back))
    return rows * baud / 10 / longest


def measure(name: str, baud: int) -> list[dict[str, object]]:
    found: list[dict[str, object]] = []
    with connect(MODEL, f"emulate:{name}", faults=Faults(baud=baud)) as device:
        trips = sorted(device.ping() * 1e3 for _ in range(20))
        full = device.rows_per_batch()
        for rows in (1, full):
            most = limit(baud, rows)
            x = np.zeros((max(int(SECONDS * most) // rows, 1) * rows, 2), np.int16)
            device.estimate(x[: 2 * rows], batch=rows)
            started = now_s()
            device.estimate(x, batch=rows)
            rate = len(x) / (now_s() - started)
            print(
                f"{name:14s} {baud:7d} {rows:5d} {rate:9.0f}/s {most:9.0f}/s {rate / most:6.0%}"
                f"   {trips[len(trips) // 2]:6.2f} ms   {device.counters.retries} retries",
                flush=True,
            )
            found.append(
                {
                    "board": name,
                    "baud": baud,
                    "rows": rows,
                    "estimates_per_s": rate,
                    "limit_per_s": most,
                    "round_trip_ms": trips[len(trips) // 2],
                    "retries": device.counters.retries,
                }
            )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--boards", default="")
    parser.add_argument("--json", type=Path, help="write the rows here")
    args = parser.parse_args()
    chosen = args.boards.split(",") if args.boards else [b.name for b in boards() if b.usable]
    print("board             baud  rows  estimates   the limit  share   round trip")
    rows = [row for name in chosen for row in measure(name, args.baud)]
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
