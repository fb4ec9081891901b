"""Every subset of the sensors trained, so that accuracy can be held against information.

Each finished subset is a file of its own, written whole: an interrupted run loses only the networks
that were being trained, and goes on from there.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from softsense import recording
from softsense.errors import SoftsenseError
from softsense.mlp import Mlp
from softsense.recording import Recording, Split
from softsense.train.fitting import Fit, fit
from softsense_codegen.atomic import write_text

Progress = Callable[[int, str], None]

SCHEMA = "softsense.subset/2"
# Of a fit, what its file holds besides the network; the rows follow from the settings.
KEPT = (
    "rmse",
    "accuracy",
    "status",
    "epochs",
    "best_epoch",
    "restarts",
    "train_mse",
    "validation_mse",
)
# 2^12 networks are hours; beyond, choose sensors first.
MOST_SENSORS = 12


@dataclass(frozen=True)
class Settings:
    """How each subset is trained; see ``fit``.

    ``split``: rows at random, by which subsets compare best; their errors flatter.
    """

    hidden: int = 60
    split: str = "random"
    seed: int = 0
    restarts: int = 1
    max_epochs: int = 100


def subsets_of(sensors: Sequence[str], max_size: int | None = None) -> list[tuple[str, ...]]:
    """All subsets of up to ``max_size`` sensors, by size."""
    largest = len(sensors) if max_size is None else max_size
    return [chosen for size in range(1, largest + 1) for chosen in combinations(sensors, size)]


def fit_all(
    rec: Recording,
    folder: Path,
    settings: Settings,
    *,
    jobs: int = 1,
    dask: str | None = None,
    progress: Progress | None = None,
) -> tuple[Fit, ...]:
    """Train every subset of ``rec``'s sensors; results in ``folder``/subsets, one file each.

    Finished files of an earlier run with the same data and settings are taken as they are. ``jobs``
    processes of one thread each, or the workers of a Dask scheduler at ``dask``, give the same
    networks as one process. ``progress`` is called with the number done and the latest subset.

    Raises ``SoftsenseError`` when ``folder`` holds results of other data or settings.
    """
    rec.require_usable()
    if len(rec.sensors) > MOST_SENSORS:
        raise SoftsenseError(
            f"{len(rec.sensors)} sensors have {2 ** len(rec.sensors) - 1} subsets",
            where=rec.name,
            remedy=f"choose at most {MOST_SENSORS} with --sensors; softsense rank tells which",
        )
    rows = recording.split(len(rec), settings.split, settings.seed)
    wanted = subsets_of(rec.sensors)
    key = key_of(rec, settings)
    done: dict[tuple[str, ...], Fit] = {}
    for chosen in wanted:
        path = _path(folder, chosen)
        if path.exists():
            done[chosen] = _load(path, key, rows)
    missing = [chosen for chosen in reversed(wanted) if chosen not in done]  # the longest first
    for chosen, text in _train(rec, missing, settings, key, jobs, dask):
        path = write_text(_path(folder, chosen), text)
        done[chosen] = _load(path, key, rows)
        if progress is not None:
            progress(len(done), " ".join(chosen))
    return tuple(done[chosen] for chosen in wanted)


def key_of(rec: Recording, settings: Settings) -> str:
    """A digest of everything that a subset's network depends on."""
    digest = hashlib.sha256()
    for array in (rec.codes, rec.target):
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    front_ends = [end.to_dict() for end in rec.front_ends]
    names = [rec.sensors, rec.targets, rec.target_units, front_ends, asdict(settings)]
    digest.update(json.dumps(names).encode())
    return digest.hexdigest()


def train_one(rec: Recording, chosen: tuple[str, ...], settings: Settings, key: str) -> str:
    """Train one subset; the text of its file."""
    result = fit(
        rec,
        chosen,
        hidden=settings.hidden,
        split=settings.split,
        seed=settings.seed,
        restarts=settings.restarts,
        max_epochs=settings.max_epochs,
    )
    data = {
        "schema": SCHEMA,
        "key": key,
        "sensors": list(chosen),
        **{name: getattr(result, name) for name in KEPT},
        "mlp": json.loads(result.mlp.to_json()),
    }
    return json.dumps(data) + "\n"


def _path(folder: Path, chosen: tuple[str, ...]) -> Path:
    """A file name that no other subset has, short for long sensor names too."""
    name = "+".join("".join(c if c.isalnum() else "_" for c in sensor) for sensor in chosen)
    tail = hashlib.sha256("\0".join(chosen).encode()).hexdigest()[:8]
    return folder / "subsets" / f"{name[:80]}-{tail}.json"


def _load(path: Path, key: str, rows: Split) -> Fit:
    try:
        data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        same = data["schema"] == SCHEMA and data["key"] == key
        if same:
            kept = {name: data[name] for name in KEPT}
            for name in ("train_mse", "validation_mse"):
                kept[name] = tuple(kept[name])
            kept["rmse"] = {part: tuple(values) for part, values in kept["rmse"].items()}
            return Fit(Mlp.from_json(json.dumps(data["mlp"]), str(path)), rows, **kept)
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise SoftsenseError(
            "not a whole result of a subset", where=str(path), remedy="delete it and run again"
        ) from error
    raise SoftsenseError(
        "this subset was trained on other data or with other settings",
        where=str(path),
        remedy="give another folder with -o, or delete this one",
    )


Finished = Iterator[tuple[tuple[str, ...], str]]


def _train(
    rec: Recording,
    missing: Sequence[tuple[str, ...]],
    settings: Settings,
    key: str,
    jobs: int,
    dask: str | None,
) -> Finished:
    if not missing:
        return
    if dask is not None:
        yield from _with_dask(rec, missing, settings, key, dask)
    elif jobs > 1:
        yield from _with_processes(rec, missing, settings, key, jobs)
    else:
        for chosen in missing:
            yield chosen, train_one(rec, chosen, settings, key)


_shared: dict[str, Any] = {}  # what every task of a worker process needs, sent once


def _start_worker(rec: Recording, settings: Settings, key: str) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the workers
    _shared.update(rec=rec, settings=settings, key=key)


def _work(chosen: tuple[str, ...]) -> str:
    return train_one(_shared["rec"], chosen, _shared["settings"], _shared["key"])


def _with_processes(
    rec: Recording,
    missing: Sequence[tuple[str, ...]],
    settings: Settings,
    key: str,
    jobs: int,
) -> Finished:
    # Not fork: the numerical libraries' threads do not survive it.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(
        min(jobs, len(missing)), context, initializer=_start_worker, initargs=(rec, settings, key)
    )
    try:
        tasks: dict[Future[str], tuple[str, ...]] = {pool.submit(_work, c): c for c in missing}
        for task in as_completed(tasks):
            yield tasks[task], task.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _with_dask(
    rec: Recording,
    missing: Sequence[tuple[str, ...]],
    settings: Settings,
    key: str,
    address: str,
) -> Finished:
    try:
        # A name without types: the package's own are partial, and it may not be installed.
        distributed: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise SoftsenseError(
            "--dask needs the package distributed", remedy="pip install 'softsense[dask]'"
        ) from error
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise SoftsenseError(
            f"no Dask scheduler answers at {address}",
            remedy="start one with: dask scheduler, and workers with: dask worker ADDRESS",
        ) from error
    with client:
        data = client.scatter(rec, broadcast=True)
        tasks = {
            client.submit(train_one, data, chosen, settings, key, pure=False): chosen
            for chosen in missing
        }
        for task, text in distributed.as_completed(list(tasks), with_results=True):
            yield tasks[task], text
