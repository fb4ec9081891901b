"""Instructions, flash and error of the generated C, beside plain float C of the same network.

  python tests/benchmarks/codegen/run.py [--json FILE]

The network is k inputs -> 60 tanh -> 1, trained on the simulated linear rig; guest instructions
per inference are counted under QEMU (softsense.verify.instructions), the worst error over 10 000
random inputs. Needs arm-none-eabi-gcc and qemu-system-arm.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from softsense.mlp import Mlp
from softsense.quantise import Quantised, quantise
from softsense.recording import Recording
from softsense.select import select
from softsense.simulate import linear_rig, simulate
from softsense.train import fit
from softsense.verify.instructions import CORES, Count, count, of_estimate
from softsense_codegen import reference
from softsense_codegen.generate import generate

FLOAT_C = """
#include <math.h>
static const float w1[{units}][{inputs}] = {{{w1}}};
static const float b1[{units}] = {{{b1}}};
static const float w2[{units}] = {{{w2}}};
float plain(const float *x);
float plain(const float *x)
{{
    float y = {b2}f;
    for (int j = 0; j < {units}; j++) {{
        float z = b1[j];
        for (int i = 0; i < {inputs}; i++) z += w1[j][i] * x[i];
        y += w2[j] * tanhf(z);
    }}
    return y;
}}
"""


def trained(recording: Recording, size: int) -> tuple[Mlp, Quantised, np.ndarray]:
    """A network on the best ``size`` sensors, its integers, and the codes."""
    sensors = select(recording, size).sensors
    mlp = fit(recording, sensors, restarts=1, max_epochs=40).mlp
    codes = recording.with_sensors(sensors).codes
    return mlp, quantise(mlp, codes, name="ours"), codes


def plain_float(mlp: Mlp, folder: Path) -> Path:
    """The network as anybody would write it in float C."""
    first, last = mlp.layers

    def numbers(values: np.ndarray) -> str:
        return ", ".join(f"{value:.9g}f" for value in values.ravel())

    text = FLOAT_C.format(
        units=len(first.bias),
        inputs=first.weight.shape[1],
        w1=", ".join("{" + numbers(row) + "}" for row in first.weight),
        b1=numbers(first.bias),
        w2=numbers(last.weight),
        b2=f"{last.bias[0]:.9g}",
    )
    path = folder / "plain.c"
    path.write_text(text)
    return path


def measure(size: int, recording: Recording) -> list[dict[str, object]]:
    """Rows of one network size."""
    mlp, made, codes = trained(recording, size)
    net = made.network
    rng = np.random.default_rng(0)
    low, high = [i.low for i in net.inputs], [i.high for i in net.inputs]
    x = rng.integers(low, high, size=(10_000, size), endpoint=True)
    fixed = reference.values(net, reference.estimate(net, x))
    error = float(np.abs(fixed - mlp.predict(x)).max()) / net.outputs[0].full_scale
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory(prefix="bench-") as scratch:
        for core in CORES:
            found: dict[str, Count] = {}
            for optimise in ("speed", "size"):
                folder = Path(scratch) / optimise
                generate(net, folder, codes, optimise=optimise)
                found[optimise] = of_estimate(core, folder / "ours.c")
            float_inputs = ", ".join(
                "{" + ", ".join(f"{v:.6f}f" for v in row) + "}"
                for row in rng.uniform(-1, 1, size=(64, size)).tolist()
            )
            setup = "float plain(const float *);\n"
            setup += f"static const float x[64][{size}] = {{{float_inputs}}};\n"
            plain = count(
                core,
                [plain_float(mlp, Path(scratch))],
                setup,
                "sink = (int32_t)(1000.0f * plain(x[i & 63u]))",
                calls=64,
                libraries=("-lm", "-lc"),
            )
            for name, result in (*found.items(), ("plain float C, newlib tanhf", plain)):
                rows.append(
                    {
                        "core": core,
                        "inputs": size,
                        "code": f"ours, {name}" if name in found else name,
                        "instructions": round(result.instructions, 1),
                        "ratio": round(plain.instructions / result.instructions, 1),
                        "flash": result.flash,
                        "error": error if name in found else 0.0,
                    }
                )
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the rows here")
    args = parser.parse_args()
    recording = simulate(linear_rig(0), seed=0)
    rows = [row for size in (2, 7) for row in measure(size, recording)]
    print(f"{'core':12} {'k':>2} {'code':28} {'instr.':>9} {'ratio':>6} {'flash':>6} {'error':>9}")
    for row in rows:
        print(
            f"{row['core']:12} {row['inputs']:>2} {row['code']:28} {row['instructions']:>9} "
            f"{row['ratio']:>6} {row['flash']:>6} {row['error']:>9.2g}"
        )
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
