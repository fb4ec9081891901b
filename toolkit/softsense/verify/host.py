"""The generated C on this machine: compiled, run, and asked for estimates."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError
from softsense.verify.folder import ExportFolder

WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
SANITIZERS = ["-O1", "-g", "-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
# Reads int16 codes, answers int32 estimates, until the input ends.
HARNESS = """
#include <stdio.h>
#include "{name}.h"
static int16_t x[1024 * {name}_INPUTS];
static int32_t y[1024 * {name}_OUTPUTS];
int main(void)
{{
    size_t got;
    while ((got = fread(x, sizeof x[0] * {name}_INPUTS, 1024, stdin)) > 0) {{
        {name}_estimate_batch(x, y, (uint32_t)got);
        if (fwrite(y, sizeof y[0] * {name}_OUTPUTS, got, stdout) != got) {{
            return 1;
        }}
    }}
    return 0;
}}
"""


def compilers() -> list[str]:
    """The host C compilers that are here, of those that are verified with."""
    return [name for name in ("gcc", "clang") if shutil.which(name)]


class HostProgram:
    """A compiled NAME.c behind standard input and output."""

    def __init__(self, program: Path, inputs: int, outputs: int) -> None:
        self.program = program
        self.inputs = inputs
        self.outputs = outputs

    def estimate(self, codes: NDArray[np.int16]) -> NDArray[np.int32]:
        """Estimates (samples, outputs) of ``codes`` (samples, inputs).

        Raises ``SoftsenseError`` when a sanitizer stops the program.
        """
        data = np.ascontiguousarray(codes, dtype="<i2").tobytes()
        done = subprocess.run([self.program], input=data, capture_output=True)
        if done.returncode != 0:
            said = done.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
            raise SoftsenseError(f"the compiled C stopped: {said[0]}", where=self.program.name)
        result: NDArray[np.int32] = np.frombuffer(done.stdout, dtype="<i4").astype(np.int32)
        return result.reshape(-1, self.outputs)


@contextmanager
def host_program(folder: ExportFolder, compiler: str, sanitized: bool) -> Iterator[HostProgram]:
    """NAME.c compiled by ``compiler`` with all warnings as errors; removed afterwards."""
    name = folder.network.name
    with tempfile.TemporaryDirectory(prefix="softsense-") as scratch:
        harness = Path(scratch) / "harness.c"
        harness.write_text(HARNESS.format(name=name))
        program = Path(scratch) / f"{name}-{compiler}{'-sanitized' if sanitized else ''}"
        command = [
            compiler, *WARNINGS, *(SANITIZERS if sanitized else ["-O2"]),
            "-I", str(folder.path), str(folder.file(".c")), str(harness), "-o", str(program),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or ["no message"]
            raise SoftsenseError(f"{compiler} refuses it: {said[0]}", where=str(folder.file(".c")))
        yield HostProgram(program, len(folder.network.inputs), len(folder.network.outputs))
