"""The main job: from a recording to a verified estimator, and from a network to an export."""

from __future__ import annotations

import io
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softsense.device.board import code_bits
from softsense.errors import SoftsenseError
from softsense.mlp import Mlp
from softsense.notebook import Shown
from softsense.onnx_file import float_model, int_model
from softsense.quantise import Quantised, quantise
from softsense.recording import Recording, Split, split
from softsense.report import Table
from softsense.report.building import Estimates, write_build_report, write_export_report
from softsense.select import Ranking, Selection, rank, select
from softsense.train import Fit, fit
from softsense.train.fitting import DECAY
from softsense.verify import Verification, verify
from softsense.verify.costs import HEADER as COST_HEADER
from softsense.verify.costs import Cost, measure_costs
from softsense.verify.folder import MANIFEST, SCHEMA
from softsense_codegen import bounds, reference
from softsense_codegen.atomic import write_bytes, write_text
from softsense_codegen.generate import generate
from softsense_codegen.network import IntNetwork, c_name
from softsense_codegen.packages import Package, write_packages
from softsense_codegen.view import Optimise, table_bytes

Stage = Callable[[str], None]
Rows = list[tuple[str, ...]]
BITS = "bit for bit:"
CALMER_DECAYS = (1e-2, 3e-2, 1e-1)
CALMER_COST = 1.03
# Hidden units that are tried under a budget.
BUDGET_SIZES = (60, 40, 28, 20, 14, 10, 7, 5)
LAYOUTS: tuple[Optimise, ...] = ("speed", "size")
# What float32 arithmetic of the float ONNX adds to a difference, as a share of full scale.
FLOAT32_SHARE = 2.0**-18
# What a search over a sample of the box may have missed.
SEARCH_MARGIN = 1.1


def _silent(text: str) -> None:
    return None


@dataclass(frozen=True)
class Budget:
    """The most that the network may cost on ``core``: bytes of ``flash``, ``work`` per estimate.

    ``work`` is in cycles where an emulator here counts them, else in instructions.
    """

    core: str = "Cortex-M4F"
    flash: int | None = None
    work: int | None = None

    def allows(self, cost: Cost) -> bool:
        """Whether ``cost`` is within. Raises ``SoftsenseError`` where it was not counted."""
        if self.work is not None and cost.work is None:
            raise SoftsenseError(
                f"neither cycles nor instructions on {self.core} can be counted here",
                remedy="install gcc-arm-none-eabi and qemu-system-arm, and name a Cortex-M core",
            )
        return (self.flash is None or cost.flash <= self.flash) and (
            self.work is None or (cost.work or 0) <= self.work
        )


@dataclass(frozen=True)
class Recipe:
    """How an estimator is made of a recording (see ``softsense build --help``)."""

    size: int | None = None
    hidden: int = 60
    split: str = "blocks"
    seed: int = 0
    restarts: int = 1
    epochs: int = 100
    bits: int = 16
    optimise: Optimise = "speed"
    fallback: bool = False
    packages: tuple[Package, ...] = ()
    budget: Budget | None = None


@dataclass(frozen=True)
class Candidate:
    """One network under a budget: its fixed-point error on validation, and its cost.

    ``optimise``: the layout of its C; ``rmse`` per output in target units; ``cost`` on the budget's
    core; ``fits`` the budget.
    """

    hidden: int
    bits: int
    optimise: Optimise
    rmse: tuple[float, ...]
    cost: Cost
    fits: bool


@dataclass(frozen=True, repr=False)
class Export(Shown):
    """What was written: the ``network``, what is known of it, its cost, and the files."""

    out: Path
    quantised: Quantised
    costs: tuple[Cost, ...]
    files: tuple[str, ...]

    @property
    def network(self) -> IntNetwork:
        """The integer network."""
        return self.quantised.network

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [
            ("folder", str(self.out)),
            *self.quantised.summary(),
            *((cost.target, cost.line.partition(": ")[2]) for cost in self.costs),
        ]


@dataclass(frozen=True, repr=False)
class Build(Shown):
    """Everything that ``build`` found out, stage by stage."""

    out: Path
    recording: Recording = field(repr=False)
    ranking: Ranking = field(repr=False)
    selection: Selection
    fit: Fit
    export: Export
    verification: Verification
    rmse_fixed: tuple[float, ...]
    fallbacks: tuple[Fallback, ...] = ()
    candidates: tuple[Candidate, ...] = ()

    @property
    def good(self) -> bool:
        """Every evaluator agreed on every bit."""
        return self.verification.good

    def to_dict(self) -> dict[str, Any]:
        """For ``softsense build --json``."""
        network = self.export.network
        return {
            "out": str(self.out),
            "name": network.name,
            "digest": network.digest,
            "sensors": list(self.selection.sensors),
            "score": self.selection.score,
            "status": self.fit.status,
            "rmse": {part: list(values) for part, values in self.fit.rmse.items()},
            "rmse_fixed_test": list(self.rmse_fixed),
            "units": [output.unit for output in network.outputs],
            "fixed_vs_float_share": self.export.quantised.share,
            "within_tolerance": self.export.quantised.reached,
            "fallbacks": [
                {
                    "name": fallback.estimator.network.name,
                    "without": fallback.without,
                    "sensors": [i.name for i in fallback.estimator.network.inputs],
                    "rmse_cut": list(fallback.cut_rmse),
                    "rmse": list(fallback.rmse),
                }
                for fallback in self.fallbacks
            ],
            "candidates": [asdict(candidate) for candidate in self.candidates],
            "verification": self.verification.to_dict(),
            "costs": [asdict(cost) for cost in self.export.costs],
            "files": list(self.export.files),
        }

    def tables(self) -> list[tuple[str, tuple[str, ...], Rows]]:
        """Title, header and rows of what a person wants to see at the end."""
        accuracy: Rows = []
        network = self.export.network
        assert network.accuracy is not None
        for index, output in enumerate(network.outputs):
            unit = "" if output.unit == "1" else f" {output.unit}"
            accuracy.append(
                (
                    output.name,
                    f"{self.fit.rmse['test'][index]:.4g}{unit}",
                    f"{self.rmse_fixed[index]:.4g}{unit}",
                    f"{network.accuracy.worst[index]:.2g}{unit}",
                    f"1/{output.full_scale / max(network.accuracy.worst[index], 1e-300):.0f}",
                )
            )
        mismatches: Rows = [
            (c.evaluator, f"{c.mismatches} of {c.compared}", f"{c.seconds:.2f} s")
            for c in self.verification.comparisons
        ]
        mismatches += [(name, "does not fit", "-") for name in self.verification.left_out]
        costs: Rows = [cost.row for cost in self.export.costs]
        header = ("target", "RMSE float", "RMSE fixed", "worst |fixed - float|", "of full scale")
        cut: Rows = [
            (
                fallback.without,
                " ".join(i.name for i in fallback.estimator.network.inputs),
                ", ".join(f"{value:.4g}" for value in fallback.cut_rmse),
                ", ".join(f"{value:.4g}" for value in fallback.rmse),
            )
            for fallback in self.fallbacks
        ]
        sizes: Rows = [
            (
                str(candidate.hidden),
                str(candidate.bits),
                candidate.optimise,
                ", ".join(f"{value:.4g}" for value in candidate.rmse),
                f"{candidate.cost.flash} B",
                candidate.cost.time or "-",
                "yes" if candidate.fits else "no",
            )
            for candidate in self.candidates
        ]
        error = "RMSE fixed (validation)"
        size_header = ("units", "bits", "layout", error, "flash", "per estimate", "fits")
        failing = ("sensor cut", "fallback uses", "RMSE without fallback", "RMSE with fallback")
        return [
            (f"{' + '.join(self.selection.sensors)}, held-out time:", header, accuracy),
            *([("sizes under the budget:", size_header, sizes)] if sizes else []),
            *([("when a sensor fails:", failing, cut)] if cut else []),
            (BITS, ("evaluator", "mismatches", "time"), mismatches),
            ("cost:", COST_HEADER, costs),
        ]

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [
            ("good", "yes" if self.good else "no"),
            ("sensors", " ".join(self.selection.sensors)),
            ("accuracy", rmse_text(self)),
            ("report", str(self.out / "report.html")),
        ]


@dataclass(frozen=True, repr=False)
class Estimator(Shown):
    """A float network, its integers, and the recorded codes (samples, inputs) they were made on."""

    mlp: Mlp
    quantised: Quantised
    codes: NDArray[np.int64] = field(repr=False)

    @property
    def network(self) -> IntNetwork:
        """The integer network."""
        return self.quantised.network

    def predict(self, codes: ArrayLike) -> NDArray[np.float64]:
        """The fixed-point estimate (samples, outputs) in target units of ``codes``."""
        return reference.values(self.network, reference.estimate(self.network, codes))

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [("float", repr(self.mlp)), *self.quantised.summary()]


@dataclass(frozen=True)
class Fallback:
    """The estimator for the day when the sensor ``without`` has failed.

    Per target on held-out time: ``cut_rmse`` of the primary network while the sensor reads 0,
    ``rmse`` of this one.
    """

    without: str
    estimator: Estimator
    cut_rmse: tuple[float, ...]
    rmse: tuple[float, ...]


def quantise_fit(
    fitted: Fit, recording: Recording, *, name: str | None = None, bits: int = 16, seed: int = 0
) -> Estimator:
    """Integers for the trained network of ``fitted``, on the recording that it was trained on.

    ``name``: the C prefix (default: the recording's name). See ``softsense.quantise.quantise``.
    """
    codes = recording.with_sensors(fitted.sensors).codes.astype(np.int64)
    prefix = c_name(recording.name if name is None else name)
    made = quantise(fitted.mlp, codes, name=prefix, bits=bits, seed=seed)
    return Estimator(fitted.mlp, made, codes)


def generate_export(
    estimator: Estimator,
    out: str | Path,
    *,
    optimise: Optimise = "speed",
    fallbacks: Sequence[Fallback] = (),
    packages: Sequence[Package] = (),
) -> Export:
    """Write the export folder of ``estimator``; ``optimise`` lays out the C for speed or size.

    ``packages``: also "arduino", "cmake", "platformio" or "vectors" (see ``write_packages``).

    The folder gets NAME.h, NAME.c, NAME_vectors.h, NAME.onnx, NAME_int.onnx, NAME.json, the same
    for every fallback, codes.npz and manifest.json; the manifest comes last, so that a folder with
    a manifest is whole.

    Raises ``SoftsenseError`` for a disk that cannot be written to.
    """
    out = Path(out)
    (out / MANIFEST).unlink(missing_ok=True)
    costs, written = _write_network(estimator, out, optimise)
    for fallback in fallbacks:
        written += _write_network(fallback.estimator, out, optimise)[1]
    networks = [estimator.network, *(fallback.estimator.network for fallback in fallbacks)]
    bits = code_bits(i.front_end for i in estimator.network.inputs)
    written += write_packages(networks, out, packages, bits)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, codes=estimator.codes.astype(np.int16))
    written.append(write_bytes(out / "codes.npz", buffer.getvalue()))
    difference = estimator.predict(estimator.codes) - estimator.mlp.predict(estimator.codes)
    units = [output.unit for output in estimator.network.outputs]
    name, verdict = estimator.network.name, estimator.quantised.verdict()
    written.append(write_export_report(out, name, verdict, difference, units, costs)[0])
    files = tuple(sorted(path.relative_to(out).as_posix() for path in written))
    manifest = _manifest(estimator.quantised, costs, files, optimise)
    if fallbacks:
        manifest["fallbacks"] = [
            {
                "name": fallback.estimator.network.name,
                "without": fallback.without,
                "digest": fallback.estimator.network.digest,
                "inputs": [asdict(i) for i in fallback.estimator.network.inputs],
                "outputs": [asdict(o) for o in fallback.estimator.network.outputs],
            }
            for fallback in fallbacks
        ]
    write_text(out / MANIFEST, json.dumps(manifest, indent=1) + "\n")
    return Export(out, estimator.quantised, costs, (*files, MANIFEST))


def _write_network(
    estimator: Estimator, out: Path, optimise: Optimise
) -> tuple[tuple[Cost, ...], list[Path]]:
    """C, vectors, JSON and ONNX of one network; what it costs, and the paths."""
    network, data = estimator.network, estimator.codes
    generate(network, out, data, optimise=optimise)
    # The header tells the cost of the source beside it, so the source comes first.
    costs = measure_costs(out / f"{network.name}.c")
    written = generate(network, out, data, [cost.line for cost in costs], optimise)
    model = float_model(estimator.mlp, network.name)
    written.append(write_bytes(out / f"{network.name}.onnx", model))
    written.append(write_bytes(out / f"{network.name}_int.onnx", int_model(network)))
    return costs, written


def export(
    mlp: Mlp,
    codes: ArrayLike,
    out: str | Path,
    *,
    name: str,
    bits: int = 16,
    seed: int = 0,
    optimise: Optimise = "speed",
    packages: Sequence[Package] = (),
    stage: Stage = _silent,
) -> Export:
    """Quantise ``mlp`` on ``codes`` (samples, inputs) and write its export folder.

    Raises ``SoftsenseError`` for a name that C cannot take, weights beyond 32 bits, or a disk that
    cannot be written to.
    """
    data = np.atleast_2d(np.asarray(codes, dtype=np.int64))
    stage("quantise")
    quantised = quantise(mlp, data, name=name, bits=bits, seed=seed)
    stage(f"quantised: {quantised.verdict()}")
    stage("generate C and ONNX")
    return generate_export(
        Estimator(mlp, quantised, data), out, optimise=optimise, packages=packages
    )


def build(
    recording: Recording,
    out: str | Path,
    recipe: Recipe = Recipe(),
    *,
    name: str | None = None,
    on: Sequence[str] | None = None,
    stage: Stage = _silent,
) -> Build:
    """Select, train, quantise, generate, verify: the whole way, into the folder ``out``.

    ``on``: evaluators (see ``softsense.verify.verify``); default all that this machine can run.

    Raises ``SoftsenseError`` for a recording that nothing can be learnt from, and whatever the
    stages raise.
    """
    recording.require_usable()
    prefix = c_name(recording.name if name is None else name)
    size = len(recording.sensors) if recipe.size is None else recipe.size
    stage(f"recording: {recording!r}")
    rows = split(len(recording), recipe.split, recipe.seed)
    # What is held out for the test has no say in the choice of sensors either.
    known = recording.rows(np.sort(np.concatenate([rows.train, rows.validation])))
    selection = select(known, size)
    ranking = rank(known)
    stage(f"selected: {', '.join(selection.sensors)}")
    candidates: tuple[Candidate, ...] = ()
    if recipe.budget is not None:
        candidates = _candidates(recording, selection.sensors, recipe, recipe.budget, rows, stage)
        best = _best(candidates, recipe)
        recipe = replace(recipe, hidden=best.hidden, bits=best.bits, optimise=best.optimise)
    stage("train")
    fitted = _fit(recording, selection.sensors, recipe, rows)
    rmse = ", ".join(f"{value:.4g}" for value in fitted.rmse["test"])
    stage(f"trained: RMSE {rmse} on held-out time; {fitted.status} after {fitted.epochs} epochs")
    used = recording.with_sensors(selection.sensors)
    stage("quantise")
    estimator = quantise_fit(fitted, recording, name=prefix, bits=recipe.bits, seed=recipe.seed)
    stage(f"quantised: {estimator.quantised.verdict()}")
    if not estimator.quantised.reached and recipe.bits == 16 and recipe.budget is None:
        fitted, estimator = _calmer(recording, fitted, estimator, recipe, rows, stage)
    fallbacks: tuple[Fallback, ...] = ()
    if recipe.fallback:
        fallbacks = tuple(
            _fallback(recording, known, selection, estimator, sensor, recipe, rows, stage)
            for sensor in (selection.sensors if len(recording.sensors) > 1 else ())
        )
    stage("generate C and ONNX")
    exported = generate_export(
        estimator,
        out,
        optimise=recipe.optimise,
        fallbacks=fallbacks,
        packages=recipe.packages,
    )
    evaluators = available() if on is None else tuple(on)
    stage(f"verify on {', '.join(evaluators)}")
    verification = verify(out, evaluators, seed=recipe.seed, where_it_fits=on is None, stage=stage)
    network = exported.network
    fixed = reference.values(network, reference.estimate(network, used.codes))
    square = ((fixed - used.target) ** 2)[fitted.split.test].mean(axis=0)
    rmse_fixed = tuple(float(value) for value in np.sqrt(square))
    result = Build(
        Path(out),
        recording,
        ranking,
        selection,
        fitted,
        exported,
        verification,
        rmse_fixed,
        fallbacks,
        candidates,
    )
    stage("report")
    estimates = Estimates(used.target, fitted.mlp.predict(used.codes), fixed, fitted.split.test)
    # Times differ from run to run; the report of the same build should not.
    tables = [
        Table(title, header[:2], [row[:2] for row in rows])
        if title == BITS
        else Table(title, header, rows)
        for title, header, rows in result.tables()
    ]
    lead = (
        f"{', '.join(recording.targets)} from {', '.join(selection.sensors)}. {rmse_text(result)}"
    )
    write_build_report(Path(out), recording, ranking, estimates, exported.costs, tables, lead)
    return result


def _candidates(
    recording: Recording,
    sensors: Sequence[str],
    recipe: Recipe,
    budget: Budget,
    rows: Split,
    stage: Stage,
) -> tuple[Candidate, ...]:
    """Every size, word length and layout: trained, quantised, compiled and counted."""
    made = []
    for hidden in [recipe.hidden, *(size for size in BUDGET_SIZES if size < recipe.hidden)]:
        fitted = _fit(recording, sensors, replace(recipe, hidden=hidden), rows)
        for bits in (16, 8):
            estimator = quantise_fit(fitted, recording, name="trial", bits=bits, seed=recipe.seed)
            validation = rows.validation
            error = estimator.predict(estimator.codes[validation]) - recording.target[validation]
            rmse = tuple(float(v) for v in np.sqrt((error**2).mean(axis=0)))
            for optimise in LAYOUTS:
                cost = _cost(estimator.network, budget.core, optimise)
                made.append(Candidate(hidden, bits, optimise, rmse, cost, budget.allows(cost)))
                stage(f"{hidden} units, {bits} bits, {optimise}: RMSE {rmse[0]:.4g}, {cost.line}")
    return tuple(made)


def _cost(network: IntNetwork, core: str, optimise: Optimise) -> Cost:
    with tempfile.TemporaryDirectory(prefix="softsense-") as scratch:
        costs = measure_costs(generate(network, scratch, optimise=optimise)[1], only=core)
    if not costs:
        raise SoftsenseError(
            f"the cost on {core} cannot be measured here",
            remedy="install its cross compiler, or name another core",
        )
    return costs[0]


def _best(candidates: Sequence[Candidate], recipe: Recipe) -> Candidate:
    """The smallest error that fits, laid out as asked for if that fits too.

    Outputs weigh alike, each by its best.
    """
    budget = recipe.budget
    assert budget is not None
    fitting = [candidate for candidate in candidates if candidate.fits]
    if not fitting:
        flash = min(candidate.cost.flash for candidate in candidates)
        quickest = min(candidates, key=lambda candidate: candidate.cost.work or 0)
        raise SoftsenseError(
            f"no network fits on {budget.core}: the smallest takes {flash} bytes of flash"
            + (f", the quickest {quickest.cost.time}" if budget.work is not None else ""),
            remedy="raise --max-flash or --max-cycles, or use fewer sensors",
        )
    scale = np.min([candidate.rmse for candidate in fitting], axis=0)

    def order(candidate: Candidate) -> tuple[float, bool]:
        error = float(np.mean(np.array(candidate.rmse) / scale))
        return error, candidate.optimise != recipe.optimise

    return min(fitting, key=order)


def _fallback(
    recording: Recording,
    known: Recording,
    selection: Selection,
    primary: Estimator,
    sensor: str,
    recipe: Recipe,
    rows: Split,
    stage: Stage,
) -> Fallback:
    """The best network of the same size that does without ``sensor``."""
    rest = [name for name in recording.sensors if name != sensor]
    chosen = select(known.with_sensors(rest), min(len(selection.sensors), len(rest)))
    stage(f"fallback without {sensor}: {', '.join(chosen.sensors)}")
    fitted = _fit(recording, chosen.sensors, recipe, rows)
    name = c_name(f"{primary.network.name[:30]}_no_{sensor}")
    made = quantise_fit(fitted, recording, name=name, bits=recipe.bits, seed=recipe.seed)
    cut = primary.codes[rows.test].copy()
    cut[:, selection.sensors.index(sensor)] = 0
    truth = recording.target[rows.test]

    def rmse(values: NDArray[np.float64]) -> tuple[float, ...]:
        return tuple(float(v) for v in np.sqrt(((values - truth) ** 2).mean(axis=0)))

    own = made.predict(made.codes[rows.test])
    return Fallback(sensor, made, rmse(primary.predict(cut)), rmse(own))


def rmse_text(build: Build) -> str:
    """One sentence about accuracy, bits and the promise."""
    parts = [
        f"{output.name} within {rmse:.3g}{'' if output.unit == '1' else ' ' + output.unit} RMSE"
        for output, rmse in zip(build.export.network.outputs, build.rmse_fixed, strict=True)
    ]
    compared = sum(c.compared for c in build.verification.comparisons)
    wrong = sum(c.mismatches for c in build.verification.comparisons)
    return (
        f"On held-out time: {', '.join(parts)}. {wrong} mismatches in {compared} comparisons; "
        f"{build.export.quantised.verdict()}."
    )


def simulate_rig(path: str | Path, *, seed: int = 0, samples: int = 8000) -> Recording:
    """A recording of pseudo-random motion on the rig that ``path`` (rig.toml) describes."""
    from softsense.simulate import read_rig, simulate

    return simulate(read_rig(Path(path)), samples=samples, seed=seed)


def available() -> tuple[str, ...]:
    """The evaluators that this machine can run."""
    from softsense.device.board import boards

    found = ["reference", "onnxruntime"]
    if shutil.which("gcc") or shutil.which("clang") or os.environ.get("CI"):
        found += ["host", "emulate:host"]
    for board in boards():
        if board.name != "host" and board.usable:
            found.append(f"qemu:{board.name}")
    return tuple(found)


def _calmer(
    recording: Recording,
    fitted: Fit,
    estimator: Estimator,
    recipe: Recipe,
    rows: Split,
    stage: Stage,
) -> tuple[Fit, Estimator]:
    """Train again with more weight decay, where that keeps the promise at hardly any cost.

    Large weights that cancel are what 16 bits resolve worst. The first decay is taken that reaches
    the tolerance with a validation error within ``CALMER_COST`` of the former one; else all stays.
    """
    before = np.array(fitted.rmse["validation"])
    for decay in CALMER_DECAYS:
        again = _fit(recording, fitted.sensors, recipe, rows, decay)
        if float(np.mean(np.array(again.rmse["validation"]) / before)) > CALMER_COST:
            continue
        made = quantise_fit(
            again, recording, name=estimator.network.name, bits=recipe.bits, seed=recipe.seed
        )
        if made.quantised.reached:
            stage(f"trained again with weight decay {decay:g}: {made.quantised.verdict()}")
            return again, made
    stage("more weight decay would cost accuracy: the network stays as it is")
    return fitted, estimator


def _fit(
    recording: Recording,
    sensors: Sequence[str],
    recipe: Recipe,
    rows: Split,
    decay: float = DECAY,
) -> Fit:
    return fit(
        recording,
        sensors,
        hidden=recipe.hidden,
        split=rows,
        seed=recipe.seed,
        restarts=recipe.restarts,
        max_epochs=recipe.epochs,
        decay=decay,
    )


def _manifest(
    quantised: Quantised, costs: Sequence[Cost], files: Sequence[str], optimise: Optimise
) -> dict[str, Any]:
    network = quantised.network
    accuracy = network.accuracy
    assert accuracy is not None
    stated = []
    for output, worst in zip(network.outputs, accuracy.worst, strict=True):
        found = worst if accuracy.exhaustive else SEARCH_MARGIN * worst
        aimed = 0.0 if accuracy.exhaustive else quantised.tolerance * output.full_scale
        stated.append(max(found, aimed) + FLOAT32_SHARE * output.full_scale)
    return {
        "schema": SCHEMA,
        "name": network.name,
        "digest": network.digest,
        "bits": network.bits,
        "inputs": [asdict(i) for i in network.inputs],
        "outputs": [asdict(o) for o in network.outputs],
        "bounds": {
            "fixed_vs_float": stated,
            "worst_found": accuracy.worst,
            "worst_codes": accuracy.worst_codes,
            "exhaustive": accuracy.exhaustive,
            "compared": accuracy.compared,
            "proved": accuracy.bound,
            "share_of_full_scale": quantised.share,
            "aim": quantised.tolerance,
            "reached": quantised.reached,
            "table_error": quantised.table_error,
            "accumulators": [{"product": p.product, "sum": p.total} for p in bounds.prove(network)],
        },
        "costs": {
            "macs": network.macs,
            "table_bytes": table_bytes(network, optimise),
            "targets": [asdict(cost) for cost in costs],
        },
        "files": [*files, MANIFEST],
    }


def read_training(folder: str | Path) -> tuple[Mlp, NDArray[np.int64], str]:
    """What ``softsense train -o DIR`` left: the network, its codes, and the recording's name."""
    folder = Path(folder)
    path = folder / "mlp.json"
    try:
        mlp = Mlp.from_json(path.read_text(), where=str(path))
        with np.load(folder / "recording.npz") as archive:
            codes = archive["codes"].astype(np.int64)
        name = json.loads((folder / "train.json").read_text())["recording"]
    except OSError as error:
        raise SoftsenseError(
            f"not a training folder: {error.strerror}", where=str(folder), remedy="softsense train"
        ) from error
    return mlp, codes, name
