"""Bit for bit: each evaluator against the Python reference, and fixed point against float."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from softsense.errors import DoesNotFitError, SoftsenseError
from softsense.notebook import Shown
from softsense.verify.folder import ExportFolder, read_folder
from softsense.verify.host import compilers, host_program
from softsense.verify.runtime import OnnxModel
from softsense.verify.vectors import every_input, vectors
from softsense_codegen import reference
from softsense_codegen.network import IntNetwork

DEFAULT = ("reference", "onnxruntime", "host")
Stage = Callable[[str], None]
# Over a serial line, thousands of vectors are enough and millions take hours.
SERIAL_VECTORS = 4096


class Evaluator(Protocol):
    """Whatever answers codes (samples, inputs) int16 with estimates (samples, outputs) int32."""

    def estimate(self, codes: NDArray[np.int16]) -> NDArray[np.int32]: ...


@dataclass(frozen=True)
class Comparison:
    """One evaluator against the reference: ``mismatches`` of ``compared`` vectors."""

    evaluator: str
    compared: int
    mismatches: int
    seconds: float
    first: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]] | None = None
    """The first mismatch: codes, expected, answered."""


@dataclass(frozen=True, repr=False)
class Verification(Shown):
    """All comparisons, and the fixed-point estimate against the float ONNX."""

    digest: str
    vectors: int
    comparisons: tuple[Comparison, ...]
    fixed_vs_float: dict[str, Any]
    left_out: tuple[str, ...] = ()
    """Boards that are too small for the networks."""

    @property
    def good(self) -> bool:
        """No mismatch anywhere, and fixed against float within the stated bound."""
        within = self.fixed_vs_float["max_abs"] <= self.fixed_vs_float["bound"]
        return within and all(c.mismatches == 0 for c in self.comparisons)

    def to_dict(self) -> dict[str, Any]:
        """The shape of ``softsense verify --json``."""
        return {
            "digest": self.digest,
            "vectors": self.vectors,
            "evaluators": {
                c.evaluator: {
                    "compared": c.compared,
                    "mismatches": c.mismatches,
                    "seconds": c.seconds,
                    **({} if c.first is None else {"first_mismatch": c.first}),
                }
                for c in self.comparisons
            },
            "fixed_vs_float": self.fixed_vs_float,
        }

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [
            ("good", "yes" if self.good else "no"),
            *((c.evaluator, f"{c.mismatches} of {c.compared} differ") for c in self.comparisons),
            ("worst |fixed - float|", f"{self.fixed_vs_float['max_abs']:.3g}"),
        ]


class _Reference:
    """The reference itself, from the file as it was written and read back."""

    def __init__(self, net: IntNetwork) -> None:
        self.net = net

    def estimate(self, codes: NDArray[np.int16]) -> NDArray[np.int32]:
        return reference.estimate(IntNetwork.from_json(self.net.to_json()), codes)


def verify(
    out: str | Path,
    on: Sequence[str] = DEFAULT,
    *,
    seed: int = 0,
    exhaustive: bool = True,
    where_it_fits: bool = False,
    stage: Stage = lambda text: None,
) -> Verification:
    """Compare the evaluators ``on`` with the reference on the export folder ``out``.

    "reference", "onnxruntime", "host" (gcc and clang, plain and with sanitizers), "qemu:BOARD",
    "emulate:BOARD", or a serial port. With one or two inputs the first host compiler is also run
    on every possible 12-bit input (``exhaustive``). ``where_it_fits``: boards that are too small
    for the networks are left out, and named in the result, instead of being an error.

    Raises ``SoftsenseError`` for a folder that is not whole, an unknown evaluator, or a missing
    tool.
    """
    folder = read_folder(out)
    codes = vectors(folder.network, folder.recorded, seed)
    expected = reference.estimate(folder.network, codes)
    comparisons: list[Comparison] = []
    left_out: list[str] = []
    for name in on:
        try:
            for label, open_evaluator in _evaluators(folder, name):
                stage(label)
                serial = label not in ("reference", "onnxruntime") and not label.startswith("host")
                count = min(len(codes), SERIAL_VECTORS) if serial else len(codes)
                pick = np.linspace(0, len(codes) - 1, count).astype(int)
                with open_evaluator as evaluator:
                    comparisons.append(_compare(label, evaluator, codes[pick], expected[pick]))
        except DoesNotFitError:
            if not where_it_fits:
                raise
            left_out.append(name)
    if exhaustive and "host" in on and len(folder.network.inputs) <= 2 and compilers():
        stage("every input on the host")
        comparisons.append(_exhaust(folder, compilers()[0]))
    return Verification(
        folder.network.digest,
        len(codes),
        tuple(comparisons),
        _against_float(folder, codes, expected),
        tuple(left_out),
    )


def _evaluators(
    folder: ExportFolder, name: str
) -> list[tuple[str, AbstractContextManager[Evaluator]]]:
    if name == "reference":
        return [("reference", nullcontext(_Reference(folder.network)))]
    if name == "onnxruntime":
        return [("onnxruntime", nullcontext(OnnxModel(folder.file("_int.onnx"))))]
    if name == "host":
        found = compilers()
        if not found or (os.environ.get("CI") and len(found) < 2):
            raise SoftsenseError(
                f"host compilers found: {', '.join(found) or 'none'}",
                remedy="install gcc and clang, or leave 'host' out of --on",
            )
        return [
            (
                f"host-{compiler}{'-sanitized' * sanitized}",
                host_program(folder, compiler, sanitized),
            )
            for compiler in found
            for sanitized in (False, True)
        ]
    if name.startswith(("qemu:", "emulate:", "/dev/", "socket://", "COM")):
        from softsense.device import connect

        return [(name, connect(folder.path, name))]
    raise SoftsenseError(
        f"there is no evaluator {name!r}",
        remedy="reference, onnxruntime, host, emulate:host, qemu:BOARD or a serial port",
    )


def _compare(
    label: str, evaluator: Evaluator, codes: NDArray[np.int16], expected: NDArray[np.int32]
) -> Comparison:
    start = time.perf_counter()
    answered = evaluator.estimate(codes)
    seconds = time.perf_counter() - start
    if answered.shape != expected.shape:
        raise SoftsenseError(
            f"answered {answered.shape} estimates for {expected.shape}", where=label
        )
    wrong = np.flatnonzero(np.any(answered != expected, axis=1))
    first = None
    if len(wrong):
        rows = (codes[wrong[0]], expected[wrong[0]], answered[wrong[0]])
        first = tuple(tuple(int(v) for v in row) for row in rows)
    return Comparison(label, len(codes), len(wrong), seconds, first)  # type: ignore[arg-type]


def _exhaust(folder: ExportFolder, compiler: str) -> Comparison:
    """Every 12-bit input of one or two sensors."""
    start = time.perf_counter()
    compared = mismatches = 0
    first = None
    with host_program(folder, compiler, sanitized=False) as program:
        for codes, expected in every_input(folder.network):
            part = _compare("", program, codes, expected)
            compared += part.compared
            mismatches += part.mismatches
            first = first or part.first
    seconds = time.perf_counter() - start
    return Comparison(f"host-{compiler}-exhaustive", compared, mismatches, seconds, first)


def _against_float(
    folder: ExportFolder, codes: NDArray[np.int16], expected: NDArray[np.int32]
) -> dict[str, Any]:
    """The output that comes closest to its bound: |fixed - float ONNX| within the box."""
    net = folder.network
    inside = reference.uncalibrated(net, codes) == 0
    fixed = reference.values(net, expected[inside])
    real = OnnxModel(folder.file(".onnx")).estimate(codes[inside])
    found = np.abs(fixed - real).max(axis=0) if inside.any() else np.zeros(len(net.outputs))
    bounds = np.array(folder.manifest["bounds"]["fixed_vs_float"])
    tightest = int(np.argmax(found / bounds))
    return {
        "max_abs": float(found[tightest]),
        "bound": float(bounds[tightest]),
        "unit": net.outputs[tightest].unit,
        "output": net.outputs[tightest].name,
    }
