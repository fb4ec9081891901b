"""What a board is compared with: the same C, compiled for this machine."""

from __future__ import annotations

import ctypes
import itertools
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softsense.device.boards import networks, read_manifest
from softsense.errors import SoftsenseError

# Corners of the box are 2^inputs: beyond this many inputs a random share of them is taken.
MOST_CORNER_INPUTS = 10


def vectors(out: Path, count: int, seed: int) -> tuple[NDArray[np.int16], NDArray[np.int32]]:
    """Codes (rows, inputs) and the estimates (rows, outputs) they must give.

    All corners of the calibrated box and of int16, then ``count`` random rows: half within full
    scale of the converter, half anywhere in int16.
    """
    network = networks(out)[0]
    inputs = len(network.inputs)
    rng = np.random.default_rng(seed)
    highest = 2 ** int(read_manifest(out).get("adc_bits", 12)) - 1
    ends = np.array([[-0x8000, 0x7FFF], [0, highest]])
    if inputs <= MOST_CORNER_INPUTS:
        chosen = np.array(list(itertools.product((0, 1), repeat=inputs)))
    else:
        chosen = rng.integers(0, 2, (1 << MOST_CORNER_INPUTS, inputs))
    corners = np.concatenate([pair[chosen] for pair in ends])
    inside = rng.integers(0, highest + 1, (count - count // 2, inputs))
    anywhere = rng.integers(-0x8000, 0x8000, (count // 2, inputs))
    codes = np.ascontiguousarray(np.concatenate([corners, inside, anywhere]), np.int16)
    return codes, reference(out, codes)


def reference(out: Path, codes: NDArray[np.int16], network: int = 0) -> NDArray[np.int32]:
    """Estimates (rows, outputs) of the export folder's C on this machine."""
    chosen = networks(out)[network]
    compiler = next((c for c in ("cc", "gcc", "clang") if shutil.which(c)), None)
    if compiler is None:
        raise SoftsenseError("there is no C compiler to check with", remedy="apt-get install gcc")
    result = np.zeros((len(codes), len(chosen.outputs)), np.int32)
    with tempfile.TemporaryDirectory(prefix="softsense-") as folder:
        library = Path(folder) / "network.so"
        source = out / f"{chosen.name}.c"
        done = subprocess.run(
            [compiler, "-std=c99", "-O2", "-shared", "-fPIC", str(source), "-o", str(library)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise SoftsenseError(
                f"{compiler} refuses: {done.stderr.strip().splitlines()[0]}", where=str(source)
            )
        function = getattr(ctypes.CDLL(str(library)), f"{chosen.name}_estimate")
        function.restype = None
        codes = np.ascontiguousarray(codes, np.int16)
        for row in range(len(codes)):
            function(
                ctypes.c_void_p(codes[row].ctypes.data), ctypes.c_void_p(result[row].ctypes.data)
            )
    return result
