"""Every benchmark, one after the other; tables on stdout, and as JSON where a script offers it.

  python tests/benchmarks/run.py [--only NAME] [--out FOLDER]

A benchmark is a script in a folder beside this one that parses arguments; those that take
``--json`` leave FOLDER/NAME.json.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def scripts() -> dict[str, Path]:
    """Runnable benchmarks by name (folder/script)."""
    found = sorted(path for path in HERE.glob("*/*.py") if "__main__" in path.read_text())
    return {f"{path.parent.name}_{path.stem}": path for path in found}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="part of a name")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "bench", help="for JSON")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    paths = [str(ROOT / "toolkit"), str(ROOT / "codegen"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    failed = []
    for name, path in scripts().items():
        if args.only and args.only not in name:
            continue
        print(f"\n== {name}", flush=True)
        command = [sys.executable, str(path)]
        if "--json" in path.read_text():
            command += ["--json", str(args.out / f"{name}.json")]
        if subprocess.run(command, cwd=ROOT, env=environment).returncode != 0:
            failed.append(name)
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
