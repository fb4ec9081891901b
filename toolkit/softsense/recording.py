"""Recordings: what the sensors said while the truth was known.

A ``Recording`` holds ADC codes, targets and context on one uniform clock. Files are read once,
here, and every kind of bad file is refused here with file, row and column.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import StringIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError
from softsense.notebook import Shown
from softsense_codegen.atomic import write_text

TIME_COLUMN = "t_s"
# Truth and surroundings as the built-in rigs name them: never taken for sensors unless asked to.
KNOWN_CONTEXT = ("temp_c", "strain", "x_px", "y_px", "bend_deg", "pressure_kpa")
# A step that differs from the median by more than this share is not a uniform clock: it leaves
# room for time stamps rounded to 1 ms at 20 Hz, and none for a missing sample.
TIME_STEP_TOLERANCE = 0.2
MIN_SAMPLES = 10

Floats = NDArray[np.float64]
Codes = NDArray[np.int32]


@dataclass(frozen=True)
class FrontEnd:
    """How a physical value becomes an ADC code, the same on the rig and on the device.

    ``kind`` "codes": the column holds codes already. "affine": code = scale * value + offset.
    "divider": code = scale * value / (value + offset), i.e. a voltage divider with the reference
    resistor ``offset`` (unit of the column) to the supply, which itself reads ``scale`` codes.
    Results are rounded half up and clipped to 0 … 2**bits - 1.
    """

    kind: Literal["codes", "affine", "divider"]
    bits: int
    scale: float = 1.0
    offset: float = 0.0

    def encode(self, values: Floats) -> Codes:
        """Codes (same shape as ``values``) that the ADC would give for physical ``values``."""
        if self.kind == "divider":
            # A resistance below zero is noise around zero: the divider then reads zero.
            positive = np.maximum(values, 0.0)
            codes = self.scale * positive / (positive + self.offset)
        else:
            codes = self.scale * values + self.offset
        return np.clip(np.floor(codes + 0.5), 0, 2**self.bits - 1).astype(np.int32)

    def describe(self) -> str:
        """One line for headers and reports."""
        if self.kind == "codes":
            return f"{self.bits}-bit ADC codes as recorded"
        if self.kind == "affine":
            return f"code = round({self.scale:.9g} * value + {self.offset:.9g}), {self.bits} bits"
        return f"code = round({self.scale:.9g} * R / (R + {self.offset:.9g})), {self.bits} bits"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"kind": self.kind, "bits": self.bits, "scale": self.scale, "offset": self.offset}


@dataclass(frozen=True)
class Recording(Shown):
    """Sensors and targets on one uniform clock.

    ``codes``: (samples, sensors) int32 ADC codes. ``target``: (samples, targets) float64 in
    ``target_units``. ``t_s``: (samples,) seconds, or None where the file has no time.
    ``context``: further named columns, (samples,) each, e.g. ``temp_c``.
    """

    name: str
    sensors: tuple[str, ...]
    codes: Codes
    targets: tuple[str, ...]
    target_units: tuple[str, ...]
    target: Floats
    t_s: Floats | None
    front_ends: tuple[FrontEnd, ...]
    context: dict[str, Floats] = field(default_factory=dict)

    def __post_init__(self) -> None:
        samples = len(self.codes)
        if self.codes.shape != (samples, len(self.sensors)) or self.target.shape != (
            samples,
            len(self.targets),
        ):
            raise ValueError(
                f"codes {self.codes.shape} and target {self.target.shape} do not fit "
                f"{len(self.sensors)} sensors and {len(self.targets)} targets"
            )

    def __len__(self) -> int:
        return len(self.codes)

    def summary(self) -> list[tuple[str, str]]:
        """What a notebook shows of it."""
        return [
            (name, f"{int(low)} … {int(high)}")
            for name, low, high in zip(
                self.sensors, self.codes.min(axis=0), self.codes.max(axis=0), strict=True
            )
        ] + [
            (f"{name} [{unit}]", f"{low:.4g} … {high:.4g}")
            for name, unit, low, high in zip(
                self.targets,
                self.target_units,
                self.target.min(axis=0),
                self.target.max(axis=0),
                strict=True,
            )
        ]

    def __repr__(self) -> str:
        rate = f" at {1 / self.dt_s:.6g} Hz" if self.t_s is not None else ""
        return (
            f"Recording {self.name!r}: {len(self)} samples{rate}, sensors "
            f"{', '.join(self.sensors)}; target {', '.join(self.targets)}"
        )

    @property
    def adc_bits(self) -> int:
        """Word length of the codes."""
        return max((f.bits for f in self.front_ends), default=12)

    @property
    def dt_s(self) -> float:
        """Sample interval in seconds. Raises ``SoftsenseError`` without a time column."""
        if self.t_s is None:
            raise SoftsenseError(
                "this step needs time and the recording has none",
                where=self.name,
                remedy=f"add a uniform column {TIME_COLUMN!r} in seconds",
            )
        return float(self.t_s[-1] - self.t_s[0]) / (len(self.t_s) - 1)

    def index_of(self, sensors: Sequence[str]) -> list[int]:
        """Column numbers of ``sensors``. Raises ``SoftsenseError`` for an unknown name."""
        for sensor in sensors:
            if sensor not in self.sensors:
                raise SoftsenseError(
                    f"there is no sensor {sensor!r}",
                    where=self.name,
                    remedy=f"sensors are {', '.join(self.sensors)}",
                )
        return [self.sensors.index(sensor) for sensor in sensors]

    def with_sensors(self, sensors: Sequence[str]) -> Recording:
        """The same recording with only ``sensors``, in that order."""
        columns = self.index_of(sensors)
        return replace(
            self,
            sensors=tuple(sensors),
            codes=np.ascontiguousarray(self.codes[:, columns]),
            front_ends=tuple(self.front_ends[i] for i in columns),
        )

    def rows(self, index: NDArray[np.intp] | slice) -> Recording:
        """The same recording with only the rows ``index``."""
        return replace(
            self,
            codes=self.codes[index],
            target=self.target[index],
            t_s=None if self.t_s is None else self.t_s[index],
            context={name: column[index] for name, column in self.context.items()},
        )

    def require_usable(self, samples: int = 100) -> None:
        """Refuse, with the reason, what no estimator can be trained on.

        Raises ``SoftsenseError`` for fewer than ``samples`` rows, a constant sensor or a constant
        target.
        """
        if len(self) < samples:
            raise SoftsenseError(
                f"{len(self)} samples are too few to train and test on",
                where=self.name,
                remedy=f"record at least {samples}",
            )
        for column, sensor in enumerate(self.sensors):
            if np.ptp(self.codes[:, column]) == 0:
                raise SoftsenseError(
                    f"sensor {sensor!r} is constant at code {self.codes[0, column]}",
                    where=self.name,
                    remedy="check its wiring, or leave it out with --sensors",
                )
        for column, target in enumerate(self.targets):
            if np.ptp(self.target[:, column]) == 0:
                raise SoftsenseError(
                    f"target {target!r} is constant at {self.target[0, column]:g}",
                    where=self.name,
                    remedy="record motion, or choose another column with --target",
                )


@dataclass(frozen=True)
class Split:
    """Row numbers for training, validation and test, and how they were drawn."""

    how: str
    train: NDArray[np.intp]
    validation: NDArray[np.intp]
    test: NDArray[np.intp]


def split(
    samples: int,
    how: str = "blocks",
    seed: int = 0,
    fractions: tuple[float, float] = (0.70, 0.15),
) -> Split:
    """Draw 70:15:15 rows for training, validation and test.

    "blocks" (default): 20 contiguous blocks of time, shuffled by ``seed``, so that a test sample
    has no neighbour in time within the training set, except at a block's edge. "forward": the
    first 70 % of time, the next 15 %, the last 15 %, as a device lives it. "random": each sample
    on its own, as the MATLAB toolbox of the paper does; neighbours in time are nearly copies, so
    this flatters.

    Raises ``SoftsenseError`` for another ``how``.
    """
    rng = np.random.default_rng(seed)
    if how == "random":
        order = rng.permutation(samples)
    elif how == "forward":
        order = np.arange(samples)
    elif how == "blocks":
        edges = np.linspace(0, samples, 21).astype(int)
        blocks = rng.permutation(20)
        order = np.concatenate([np.arange(edges[b], edges[b + 1]) for b in blocks])
    else:
        raise SoftsenseError(
            f"there is no split {how!r}", remedy="choose blocks, forward or random"
        )
    first = round(fractions[0] * samples)
    second = first + round(fractions[1] * samples)
    parts = (order[:first], order[first:second], order[second:])
    return Split(how, *(np.sort(part).astype(np.intp) for part in parts))


def unit_of(column: str) -> str:
    """The unit that a column's name carries: ``knee_deg`` is in deg; "1" where it carries none."""
    units = {"deg", "rad", "mm", "cm", "m", "px", "pct", "n", "kpa", "s", "hz", "c", "v", "mv"}
    head, _, tail = column.rpartition("_")
    return tail if head and tail.lower() in units else "1"


def parse_front_end(text: str, bits: int) -> FrontEnd | None:
    """Read ``auto``, ``affine:SCALE,OFFSET`` or ``divider:R_REF[,SUPPLY_CODE]``.

    Returns None for ``auto`` (an affine map fitted to the column's range).
    """
    if text == "auto":
        return None
    kind, _, rest = text.partition(":")
    remedy = "give auto, affine:SCALE,OFFSET or divider:R_REF[,SUPPLY_CODE]"
    try:
        numbers = [float(part) for part in rest.split(",")]
    except ValueError as error:
        raise SoftsenseError(f"front end {text!r} is not understood", remedy=remedy) from error
    if all(math.isfinite(number) for number in numbers):
        if kind == "affine" and len(numbers) == 2 and numbers[0] != 0:
            return FrontEnd("affine", bits, numbers[0], numbers[1])
        if kind == "divider" and len(numbers) in (1, 2) and numbers[0] > 0:
            supply = numbers[1] if len(numbers) == 2 else 2.0**bits - 1
            return FrontEnd("divider", bits, supply, numbers[0])
    raise SoftsenseError(f"front end {text!r} is not understood", remedy=remedy)


def read(
    path: str | Path,
    *,
    target: str | Sequence[str] = "strain",
    sensors: str | Sequence[str] | None = None,
    context: str | Sequence[str] = (),
    adc_bits: int = 12,
    front_end: str | Mapping[str, FrontEnd] = "auto",
) -> Recording:
    """Read a recording from CSV, .npz, .mat or .parquet.

    ``target``, ``sensors``, ``context``: column names, as a list or joined by commas; sensors
    default to every remaining numeric column that is not one of ``KNOWN_CONTEXT``.
    Integer-valued sensor columns are ADC codes of ``adc_bits`` bits; others are physical values
    and go through ``front_end`` (see ``parse_front_end``; or one front end by sensor, where
    "codes" refuses physical values and a sensor without one is on "auto").

    Raises ``SoftsenseError`` with file, row and column for whatever is wrong.
    """
    return read_together(
        (path,),
        target=target,
        sensors=sensors,
        context=context,
        adc_bits=adc_bits,
        front_end=front_end,
    )[0]


def read_together(
    paths: Sequence[str | Path],
    *,
    target: str | Sequence[str] = "strain",
    sensors: str | Sequence[str] | None = None,
    context: str | Sequence[str] = (),
    adc_bits: int = 12,
    front_end: str | Mapping[str, FrontEnd] = "auto",
) -> tuple[Recording, ...]:
    """Read recordings that are to be compared: as ``read``, but on one scale.

    What "auto" fits to a sensor's physical values spans those of all the files, so that equal
    codes are equal values. Raises ``SoftsenseError`` where a sensor has codes in one file and
    physical values in another.
    """
    if not 4 <= adc_bits <= 15:
        raise SoftsenseError(
            f"{adc_bits} ADC bits are outside 4 … 15",
            remedy="codes travel as int16; shift a 16-bit converter right by one",
        )
    chosen = None if sensors is None else _names(sensors)
    files = [_load(Path(path), _names(target), chosen, _names(context)) for path in paths]
    fitted = parse_front_end(front_end, adc_bits) if isinstance(front_end, str) else None
    ends = []
    for file in files:
        given = front_end if isinstance(front_end, Mapping) else dict.fromkeys(file.sensors, fitted)
        ends.append(
            {name: _front_end(file, name, adc_bits, given.get(name)) for name in file.sensors}
        )
    if front_end == "auto":
        for name in dict.fromkeys(name for file in files for name in file.sensors):
            _share_scale(name, files, ends)
    return tuple(_recording(file, own) for file, own in zip(files, ends, strict=True))


@dataclass(frozen=True)
class _File:
    """The columns of a file, and which of them are what."""

    path: Path
    columns: dict[str, Floats]
    targets: tuple[str, ...]
    sensors: tuple[str, ...]
    context: tuple[str, ...]


def _load(
    path: Path,
    targets: tuple[str, ...],
    sensors: tuple[str, ...] | None,
    contexts: tuple[str, ...],
) -> _File:
    columns = read_columns(path)
    names = list(columns)
    for name in (*targets, *contexts, *(sensors or ())):
        if name not in columns:
            raise SoftsenseError(
                f"there is no column {name!r}",
                where=str(path),
                remedy=f"columns are {', '.join(names)}; choose with --target, --sensors",
            )
    if not targets:
        raise SoftsenseError("no target column was named", where=str(path), remedy="--target NAME")
    special = {TIME_COLUMN, *targets, *contexts, *KNOWN_CONTEXT}
    if sensors is None:
        sensors = tuple(name for name in names if name not in special)
    for name in sensors:
        if name in targets:
            raise SoftsenseError(f"column {name!r} is both target and sensor", where=str(path))
        if sensors.count(name) > 1:
            raise SoftsenseError(f"sensor {name!r} is named twice", where=str(path))
    if not sensors:
        raise SoftsenseError(
            "no sensor column is left",
            where=str(path),
            remedy=f"columns are {', '.join(names)}; choose with --sensors",
        )
    samples = len(columns[targets[0]])
    if samples < MIN_SAMPLES:
        raise SoftsenseError(
            f"{samples} rows are too few to be a recording",
            where=str(path),
            remedy=f"at least {MIN_SAMPLES} are needed",
        )
    for name in (
        *targets,
        *contexts,
        *sensors,
        *((TIME_COLUMN,) if TIME_COLUMN in columns else ()),
    ):
        bad = np.flatnonzero(~np.isfinite(columns[name]))
        if len(bad):
            raise SoftsenseError(
                f"{columns[name][bad[0]]} is not a finite number",
                where=_cell(path, int(bad[0]), name),
                remedy="remove or repair the row",
            )
    time = columns.get(TIME_COLUMN)
    if time is not None:
        _check_time(path, time)
    known = (n for n in KNOWN_CONTEXT if n in columns and n not in (*targets, *sensors))
    return _File(path, columns, targets, sensors, tuple(dict.fromkeys((*contexts, *known))))


def _recording(file: _File, ends: Mapping[str, FrontEnd]) -> Recording:
    columns = file.columns
    return Recording(
        name=file.path.stem,
        sensors=file.sensors,
        codes=np.stack([ends[name].encode(columns[name]) for name in file.sensors], axis=1),
        targets=file.targets,
        target_units=tuple(unit_of(name) for name in file.targets),
        target=np.stack([columns[name] for name in file.targets], axis=1),
        t_s=columns.get(TIME_COLUMN),
        front_ends=tuple(ends[name] for name in file.sensors),
        context={name: columns[name] for name in file.context},
    )


def write(recording: Recording, path: str | Path) -> Path:
    """Write ``recording`` as CSV: time, targets, context, codes. Returns the path."""
    header: list[str] = []
    columns: list[list[str]] = []
    if recording.t_s is not None:
        header.append(TIME_COLUMN)
        columns.append([f"{value:.6f}" for value in recording.t_s])
    for index, name in enumerate(recording.targets):
        header.append(name)
        columns.append([f"{value:.9g}" for value in recording.target[:, index]])
    for name, values in recording.context.items():
        header.append(name)
        columns.append([f"{value:.9g}" for value in values])
    for index, name in enumerate(recording.sensors):
        header.append(name)
        columns.append([str(code) for code in recording.codes[:, index].tolist()])
    lines = [",".join(header), *(",".join(row) for row in zip(*columns, strict=True))]
    return write_text(path, "\n".join(lines) + "\n")


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    if isinstance(names, str):
        names = names.split(",")
    return tuple(name.strip() for name in names if name.strip())


def _cell(path: Path, row: int, column: str) -> str:
    """``row`` counts data rows from 0; people count the header as row 1."""
    return f"{path}, row {row + 2}, column {column!r}"


def _front_end(file: _File, name: str, bits: int, given: FrontEnd | None) -> FrontEnd:
    values = file.columns[name]
    if given is not None and given.kind != "codes":
        return given
    fraction = values != np.floor(values)
    if not fraction.any():
        bad = np.flatnonzero((values < 0) | (values >= 2**bits))
        if len(bad):
            raise SoftsenseError(
                f"code {values[bad[0]]:.0f} is outside 0 … {2**bits - 1}",
                where=_cell(file.path, int(bad[0]), name),
                remedy="set --adc-bits, or --front-end if these are physical values",
            )
        return FrontEnd("codes", bits)
    if given is not None:
        row = int(np.argmax(fraction))
        raise SoftsenseError(
            f"{values[row]:g} is no code",
            where=_cell(file.path, row, name),
            remedy="--front-end says how physical values become codes; affine:1,0 only rounds",
        )
    # 2 % of head room on each side keeps a slightly larger value from clipping on the device.
    low, high = float(values.min()), float(values.max())
    margin = 0.02 * (high - low)
    return _spanning(low - margin, high + margin, bits)


def _spanning(low: float, high: float, bits: int) -> FrontEnd:
    scale = (2**bits - 1) / ((high - low) or 1.0)  # a constant is any code
    return FrontEnd("affine", bits, scale, -low * scale)


def _share_scale(name: str, files: list[_File], ends: list[dict[str, FrontEnd]]) -> None:
    """One fitted front end for a sensor in all ``files``; a constant there may be anything."""
    moving = [k for k, file in enumerate(files) if name in ends[k] and np.ptp(file.columns[name])]
    fitted = [k for k in moving if ends[k][name].kind == "affine"]
    if not fitted or len(files) == 1:
        return
    if len(fitted) < len(moving):
        whole = next(files[k] for k in moving if k not in fitted)
        raise SoftsenseError(
            f"sensor {name!r} has codes here and physical values in {files[fitted[0]].path}",
            where=str(whole.path),
            remedy="give both the same kind; --front-end affine:1,0 rounds codes with decimals",
        )
    bounds = [
        (code - end.offset) / end.scale
        for end in (ends[k][name] for k in fitted)
        for code in (0, 2**end.bits - 1)
    ]
    shared = _spanning(min(bounds), max(bounds), ends[fitted[0]][name].bits)
    for own in ends:
        if name in own:
            own[name] = shared


def _check_time(path: Path, time: Floats) -> None:
    steps = np.diff(time)
    median = float(np.median(steps))
    if median <= 0:
        raise SoftsenseError(
            "time does not increase",
            where=_cell(path, 1, TIME_COLUMN),
            remedy="sort the rows, in seconds",
        )
    bad = np.flatnonzero(np.abs(steps - median) > TIME_STEP_TOLERANCE * median)
    if len(bad):
        raise SoftsenseError(
            f"time is not uniform: a step of {steps[bad[0]]:.6g} s among steps of {median:.6g} s",
            where=_cell(path, int(bad[0]) + 1, TIME_COLUMN),
            remedy="resample to a uniform rate, or cut the file at the gap",
        )


def read_columns(path: Path) -> dict[str, Floats]:
    """Every numeric column of a file by name, in the file's order."""
    readers = {".csv": _read_csv, ".npz": _read_npz, ".mat": _read_mat, ".parquet": _read_parquet}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise SoftsenseError(
            f"files of kind {path.suffix or '(none)'!r} are not read",
            where=str(path),
            remedy=f"give one of {', '.join(readers)}",
        )
    try:
        columns = reader(path)
    except OSError as error:
        raise SoftsenseError(
            f"cannot be read: {error.strerror or error}", where=str(path), remedy="check the path"
        ) from error
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise SoftsenseError(
            f"columns differ in length: {lengths}", where=str(path), remedy="save equal columns"
        )
    if not columns:
        raise SoftsenseError("there is no numeric column", where=str(path))
    return columns


def _read_csv(path: Path) -> dict[str, Floats]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise SoftsenseError(
            f"byte {error.start} is not UTF-8 text", where=str(path), remedy="save as CSV (UTF-8)"
        ) from error
    head, _, body = text.partition("\n")
    delimiter = next((mark for mark in (",", ";", "\t") if mark in head), ",")
    names = [name.strip().strip('"') for name in head.strip().split(delimiter)]
    if not head.strip() or not body.strip():
        raise SoftsenseError("the file has no rows", where=str(path), remedy="header, then data")
    try:
        [float(name) for name in names]
    except ValueError:
        pass
    else:
        raise SoftsenseError(
            "the first row holds numbers, not column names",
            where=f"{path}, row 1",
            remedy="add a header such as t_s,strain,s1,s2",
        )
    for name in names:
        if not name or names.count(name) > 1:
            raise SoftsenseError(
                f"column name {name!r} is {'empty' if not name else 'used twice'}",
                where=f"{path}, row 1, column {names.index(name) + 1}",
                remedy="name every column once",
            )
    try:
        table = np.loadtxt(StringIO(body), delimiter=delimiter, ndmin=2, comments=None)
        if table.shape[1] == len(names):
            return {name: table[:, i].copy() for i, name in enumerate(names)}
    except ValueError:
        pass  # the slow reader below says which cell it is
    return _read_csv_cells(path, body, delimiter, names)


def _read_csv_cells(path: Path, body: str, delimiter: str, names: list[str]) -> dict[str, Floats]:
    """Cell by cell, for files with a flaw or text columns: names the one, drops the other."""
    rows = [line.split(delimiter) for line in body.splitlines() if line.strip()]
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise SoftsenseError(
                f"{len(row)} cells where the header has {len(names)}",
                where=f"{path}, row {number + 2}",
                remedy="repair or remove the row",
            )
    columns: dict[str, Floats] = {}
    for index, name in enumerate(names):
        values = np.empty(len(rows))
        flaw: tuple[int, str] | None = None
        numbers = 0
        for number, row in enumerate(rows):
            try:
                values[number] = float(row[index])
                numbers += 1
            except ValueError:
                flaw = flaw or (number, row[index].strip())
        if flaw is None:
            columns[name] = values
        elif numbers:  # a column without any number is a comment column, not a flaw
            raise SoftsenseError(
                f"{flaw[1]!r} is not a number" if flaw[1] else "the cell is empty",
                where=_cell(path, flaw[0], name),
                remedy="repair or remove the row",
            )
    return columns


def _read_npz(path: Path) -> dict[str, Floats]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return _from_arrays({name: archive[name] for name in archive.files})
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        raise SoftsenseError(
            f"not a readable .npz: {error}", where=str(path), remedy="save with numpy.savez"
        ) from error


def _read_mat(path: Path) -> dict[str, Floats]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, squeeze_me=True)
    except (NotImplementedError, MatReadError, ValueError, TypeError, EOFError) as error:
        raise SoftsenseError(
            f"not a readable .mat: {error}",
            where=str(path),
            remedy="save with -v7 (HDF5 files of -v7.3 are not read)",
        ) from error
    return _from_arrays({k: v for k, v in content.items() if not k.startswith("__")})


def _read_parquet(path: Path) -> dict[str, Floats]:
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise SoftsenseError(
            "reading .parquet needs pyarrow", where=str(path), remedy="pip install pyarrow"
        ) from error
    try:
        table = pyarrow.parquet.read_table(path)
    except (pyarrow.ArrowInvalid, pyarrow.ArrowIOError) as error:
        raise SoftsenseError(
            f"not a readable .parquet: {str(error).splitlines()[0]}", where=str(path)
        ) from error
    return _from_arrays(
        {name: table.column(name).to_numpy(zero_copy_only=False) for name in table.column_names}
    )


def _from_arrays(arrays: dict[str, Any]) -> dict[str, Floats]:
    """One-dimensional numeric arrays by name; a matrix X becomes X1, X2, …"""
    columns: dict[str, Floats] = {}
    for name, array in arrays.items():
        values = np.asarray(array)
        if not (np.issubdtype(values.dtype, np.number) or values.dtype == bool):
            continue
        if np.iscomplexobj(values) or values.ndim == 0:
            continue
        if values.ndim == 2 and 1 not in values.shape:
            for index in range(values.shape[1]):
                columns[f"{name}{index + 1}"] = values[:, index].astype(np.float64)
        else:
            columns[name] = values.ravel().astype(np.float64)
    return columns
