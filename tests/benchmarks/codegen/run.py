"""What one estimate costs on each core, beside others' C of the same network.

  python tests/benchmarks/codegen/run.py [--json FILE] [--core NAME]

The network is k inputs -> 60 tanh -> 1, trained on the simulated linear rig. Every core that an
emulator here counts for takes part: instructions under QEMU, cycles under simavr; the same compiler
and flags for all. Flash and RAM are those of the objects; "linked" is the flash of a program with
all that it needs (soft float, tanhf). The worst error is over 10 000 random inputs of the box, as
a share of full scale. Peers: plain float C, and what emlearn and m2cgen make of the same weights.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import emlearn
import m2cgen
import numpy as np
from sklearn.neural_network import MLPRegressor

from softsense.errors import SoftsenseError
from softsense.mlp import Mlp
from softsense.quantise import Quantised, quantise
from softsense.recording import Recording
from softsense.select import select
from softsense.simulate import linear_rig, simulate
from softsense.train import fit
from softsense.verify.instructions import CORES, Count, count, countable, of_estimate
from softsense_codegen import reference
from softsense_codegen.generate import generate

FLOAT_C = """
#include <math.h>
static const float w1[{units}][{inputs}] = {{{w1}}};
static const float b1[{units}] = {{{b1}}};
static const float w2[{units}] = {{{w2}}};
float peer(const float *x);
float peer(const float *x)
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


def plain_float(mlp: Mlp) -> str:
    """The network as anybody would write it in float C."""
    first, last = mlp.layers

    def numbers(values: np.ndarray) -> str:
        return ", ".join(f"{value:.9g}f" for value in values.ravel())

    return FLOAT_C.format(
        units=len(first.bias),
        inputs=first.weight.shape[1],
        w1=", ".join("{" + numbers(row) + "}" for row in first.weight),
        b1=numbers(first.bias),
        w2=numbers(last.weight),
        b2=f"{last.bias[0]:.9g}",
    )


def sklearn_twin(mlp: Mlp) -> MLPRegressor:
    """scikit-learn's network with the same weights: what the peers take."""
    first, last = mlp.layers
    twin = MLPRegressor(hidden_layer_sizes=(len(first.bias),), activation="tanh", max_iter=1)
    rng = np.random.default_rng(0)
    # One step of training makes the attributes; then the weights are ours.
    twin.set_params(solver="sgd", learning_rate_init=1e-9)
    with warnings.catch_warnings(action="ignore"):
        twin.fit(rng.normal(size=(50, first.weight.shape[1])), rng.normal(size=50))
    twin.coefs_ = [first.weight.T, last.weight.T]
    twin.intercepts_ = [first.bias, last.bias]
    return twin


def with_emlearn(mlp: Mlp) -> str:
    """emlearn's C (float: its fixed point is for classifiers only)."""
    code = emlearn.convert(sklearn_twin(mlp), method="loadable").save(name="net")
    wrapper = "float peer(const float *x);\nfloat peer(const float *x) { return "
    inputs = mlp.layers[0].weight.shape[1]
    return f"{code}\n{wrapper}net_regress1(x, {inputs}); }}\n"


def with_m2cgen(mlp: Mlp) -> str:
    """m2cgen's C, if it takes the network."""
    return str(m2cgen.export_to_c(sklearn_twin(mlp)))


PEERS: dict[str, Callable[[Mlp], str]] = {
    "plain float C": plain_float,
    f"emlearn {emlearn.__version__}": with_emlearn,
    "m2cgen": with_m2cgen,
}


def error_of(code: Path, x: np.ndarray, truth: np.ndarray) -> float:
    """The worst |peer - truth| of the network's own output, on the host."""
    library = code.with_suffix(".so")
    subprocess.run(
        ["gcc", "-O2", "-shared", "-fPIC", code, "-o", library, "-lm"],
        check=True,
        stderr=subprocess.DEVNULL,
    )
    peer = ctypes.CDLL(str(library)).peer
    peer.restype = ctypes.c_float
    found = []
    for row in x.astype(np.float32):
        found.append(peer(row.ctypes.data_as(ctypes.POINTER(ctypes.c_float))))
    return float(np.abs(np.array(found) - truth).max())


def measure(size: int, recording: Recording, cores: list[str]) -> list[dict[str, object]]:
    """Rows of one network size."""
    mlp, made, codes = trained(recording, size)
    net = made.network
    rng = np.random.default_rng(0)
    low, high = [i.low for i in net.inputs], [i.high for i in net.inputs]
    x = rng.integers(low, high, size=(10_000, size), endpoint=True)
    fixed = reference.values(net, reference.estimate(net, x))
    full = net.outputs[0].full_scale
    error = float(np.abs(fixed - mlp.predict(x)).max()) / full
    scaled = (x - [i.offset for i in mlp.inputs]) * [i.scale for i in mlp.inputs]
    output = mlp.outputs[0]
    truth = (mlp.predict(x)[:, 0] - output.offset) / output.scale
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory(prefix="bench-") as scratch:
        folder = Path(scratch)
        for optimise in ("speed", "size"):
            generate(net, folder / optimise, codes, optimise=optimise)
        peers: dict[str, tuple[Path, float]] = {}
        for name, write in PEERS.items():
            try:
                with contextlib.chdir(folder):  # emlearn compiles in the current folder
                    text = write(mlp)
            except NotImplementedError as refusal:
                print(f"{name}, {size} inputs: not taken: {refusal}", file=sys.stderr)
                continue
            path = folder / f"peer{len(peers)}.c"
            path.write_text(text)
            peers[name] = path, error_of(path, scaled, truth) * output.scale / full
        for core in cores:
            number = CORES[core].rows
            lines = ", ".join(
                "{" + ", ".join(f"{v:.6f}f" for v in row) + "}" for row in scaled[:number].tolist()
            )
            setup = "float peer(const float *);\n"
            setup += f"static const float x[{number}][{size}] = {{{lines}}};\n"
            call = f"sink = (int32_t)(1000.0f * peer(x[i % {number}u]))"
            for optimise in ("speed", "size"):
                result = of_estimate(core, folder / optimise / "ours.c")
                rows.append(row(core, size, f"ours, {optimise}", result, error))
            for name, (path, worst) in peers.items():
                try:
                    result = count(core, [path], setup, call, libraries=("-lm", "-lc"))
                except SoftsenseError as refusal:
                    print(f"{name}, {size} inputs: {refusal}", file=sys.stderr)
                    continue
                rows.append(row(core, size, name, result, worst))
            ours = next(r for r in rows if r["core"] == core and r["inputs"] == size)
            for line in rows:
                if line["core"] == core and line["inputs"] == size:
                    line["ratio"] = round(float(line["work"]) / float(ours["work"]), 2)
    return rows


def row(core: str, size: int, code: str, result: Count, error: float) -> dict[str, object]:
    """One line of the table."""
    return {
        "core": core,
        "inputs": size,
        "code": code,
        "work": round(result.work, 1),
        "unit": CORES[core].unit,
        "flash": result.flash,
        "ram": result.ram,
        "linked": result.image,
        "error": error,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="write the rows here")
    parser.add_argument("--core", action="append", choices=tuple(CORES), help="only this core")
    args = parser.parse_args()
    os.environ["C_INCLUDE_PATH"] = emlearn.includedir
    cores = [core for core in args.core or CORES if countable(core)]
    recording = simulate(linear_rig(0), seed=0)
    rows = [line for size in (2, 7) for line in measure(size, recording, cores)]
    print(
        f"{'core':16} {'k':>2} {'code':16} {'per estimate':>22} {'ratio':>7} {'flash':>6} "
        f"{'RAM':>5} {'linked':>7} {'error':>8}"
    )
    for line in rows:
        print(
            f"{line['core']:16} {line['inputs']:>2} {line['code']:16} "
            f"{line['work']:>9} {line['unit']:12} {line['ratio']:>7} {line['flash']:>6} "
            f"{line['ram']:>5} {line['linked']:>7} {line['error']:>8.2g}"
        )
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
