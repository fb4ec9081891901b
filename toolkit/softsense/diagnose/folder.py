"""A diagnosis on disk: diagnosis.json, what augment needs, the augmented recording, the report."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import numpy as np

from softsense.diagnose.engine import SCHEMA, Diagnosis, Past, Trace, aligned
from softsense.errors import SoftsenseError
from softsense.recording import FrontEnd, Recording
from softsense.recording import write as write_recording
from softsense.report import Figure, Table, charts, write_page
from softsense_codegen.atomic import write_bytes, write_text

if TYPE_CHECKING:
    from softsense.diagnose.transfer import Carried
    from softsense.simulate import Rig

STATE = "augmentation.json"
PAST = "augmentation.npz"


def write(diagnosis: Diagnosis, sim: Recording, real: Recording, out: Path) -> None:
    """Write the folder ``out``."""
    write_text(out / STATE, diagnosis.state_json() + "\n")
    past = io.BytesIO()
    np.savez_compressed(past, **vars(diagnosis.past))
    write_bytes(out / PAST, past.getvalue())
    sim, real = aligned(sim, real)
    top = 2**sim.adc_bits - 1
    codes = np.clip(np.rint(diagnosis.augmented), 0, top).astype(np.int32)
    write_recording(replace(sim, codes=codes), out / "augmented.csv")
    _report(diagnosis, sim, real, out)
    write_text(out / "diagnosis.json", diagnosis.to_json())


def read(folder: Path) -> Diagnosis:
    """Read what ``write`` wrote. Raises ``SoftsenseError`` where it is not whole, or of another
    schema."""
    try:
        data = json.loads((folder / "diagnosis.json").read_text())
        state = json.loads((folder / STATE).read_text())
        if state["schema"] != SCHEMA:
            raise ValueError(f"{STATE} is {state['schema']}, not {SCHEMA}")
        traces = tuple(
            Trace(
                t["effect"],
                t["channel"],
                t["candidate"],
                t["near"],
                t["place"],
                t["upon"],
                np.asarray(t["weights"], dtype=np.float64),
                t["values"],
                t["form"],
            )
            for t in state["traces"]
        )
        with np.load(folder / PAST) as past:
            before = Past(
                past["target"],
                past["codes"],
                float(past["dt_s"]),
                float(past["start_s"]),
                past["lost"],
                past["levels"],
                tuple(past["own"].tolist()),
            )
        ends = {name: FrontEnd(**end) for name, end in state["front_ends"].items()}
        return Diagnosis(data, traces, np.asarray(state["static"], dtype=np.float64), before, ends)
    except (OSError, ValueError, KeyError, TypeError, BadZipFile) as error:
        raise SoftsenseError(
            f"not a whole diagnosis: {error}", where=str(folder), remedy="softsense diagnose"
        ) from error


def calibrated(nominal: Recording) -> Rig:
    """A simulator fitted to ``nominal``."""
    from softsense.simulate.calibrate import calibrate

    return calibrate(nominal).rig


def carry_over(diagnosis: Diagnosis, rig: Rig, sim: Recording, out: Path) -> tuple[Carried, ...]:
    """Write ``out/rig.toml``: ``rig`` with the diagnosed effects in it; what each reproduces."""
    from softsense.diagnose.transfer import into_rig

    made, carried = into_rig(diagnosis, rig, sim)
    write_text(out / "rig.toml", made.to_toml())
    return carried


def on_motion_of(real: Recording, rig: Rig, seed: int) -> Recording:
    """What ``rig`` says of the motion of ``real``."""
    from softsense.simulate import run, to_recording

    strain = (real.target[:, 0] - rig.low) / (rig.high - rig.low)
    rig = replace(rig, rate_hz=1.0 / real.dt_s)
    made = to_recording(rig, run(rig, strain, seed, None, real.context.get("temp_c")))
    return replace(made, t_s=real.t_s, targets=real.targets[:1], target=real.target[:, :1])


def verdict(diagnosis: Diagnosis) -> str:
    """A few lines that a person understands."""
    data = diagnosis.data
    gap = data["gap"]
    lines = [
        f"real and simulated codes differ by {gap['rmse_codes']:.1f} codes rms; "
        f"noise alone makes {gap['noise_floor_codes']:.1f}"
    ]
    if not gap["present"]:
        lines.append("no gap beyond the noise (nothing to add to the simulator)")
    for effect in data["effects"]:
        others = [other["name"] for other in effect["alternatives"]]
        doubt = f"; could also be {', '.join(others)}" if others else ""
        verb = "has other parameters" if effect["kind"] == "retune" else "is missing"
        lines.append(
            f"{effect['name']} {verb} on {', '.join(effect['channels'])} "
            f"(confidence {effect['confidence']:.2f}{doubt})"
        )
    if data["unexplained"]["unknown_effect"]:
        share = 100 * data["unexplained"]["share"]
        lines.append(f"{share:.0f} % of the gap follows nothing that the catalogue knows")
    after = data["after"]
    if data["effects"] and after["shrink"]:
        low, high = after["shrink_ci95"]
        lines.append(
            f"with it {100 * after['shrink']:.0f} % of the excess gap closes on held-out time "
            f"({100 * low:.0f} to {100 * high:.0f} %); the estimator's error goes from "
            f"{gap['estimator_rmse_before']:.3g} to {after['estimator_rmse']:.3g} "
            f"(trained on real data: {gap['estimator_rmse_floor']:.3g})"
        )
    return "\n".join([*lines, *(f"next: {text}" for text in data["advice"])])


def _report(diagnosis: Diagnosis, sim: Recording, real: Recording, out: Path) -> None:
    time = np.arange(float(len(sim))) if sim.t_s is None else sim.t_s
    before = real.codes.astype(np.float64) - sim.codes
    after = real.codes - diagnosis.augmented
    figures = []
    for channel, name in enumerate(sim.sensors):
        figures.append(
            Figure(
                f"residual_{channel}",
                f"{name}: real less simulated",
                "Before and after the diagnosed effects are added.",
                charts.lines(
                    time,
                    [
                        charts.Line(before[:, channel], "before"),
                        charts.Line(after[:, channel], "after"),
                    ],
                    "time / s",
                    "codes",
                ),
            )
        )
    rate = np.gradient(sim.target[:, 0])
    worst = int(np.argmax(before.std(axis=0)))
    for title, values in (("before", before), ("after", after)):
        figures.append(
            Figure(
                f"map_{title}",
                f"{sim.sensors[worst]}: residual over strain and rate, {title}",
                "Mean residual per cell: rows are strain from low (top) to high, columns strain "
                "rate from falling to rising.",
                _map(sim.target[:, 0], rate, values[:, worst]),
            )
        )
    effects = diagnosis.data["effects"]
    if effects:
        ranked = [(effects[0]["name"], effects[0]["shrink"])]
        ranked += [(other["name"], other["shrink"]) for other in effects[0]["alternatives"]]
        figures.append(
            Figure(
                "candidates",
                "Candidates",
                "Share of the excess gap that each closes on held-out time.",
                charts.bars([n for n, _ in ranked], [s for _, s in ranked], "share"),
            )
        )
    rows = [
        (
            effect["name"],
            effect["kind"],
            " ".join(effect["channels"]),
            f"{effect['confidence']:.2f}",
            f"{effect['shrink']:.3f}",
        )
        for effect in effects
    ]
    tables = [Table("effects", ("name", "kind", "channels", "confidence", "shrink"), rows)]
    write_page(out, f"{real.name}: sim-to-real gap", verdict(diagnosis), figures, tables)


def _map(strain: np.ndarray, rate: np.ndarray, values: np.ndarray, cells: int = 12) -> str:
    edges = [np.quantile(v, np.linspace(0, 1, cells + 1)[1:-1]) for v in (strain, rate)]
    i, j = np.digitize(strain, edges[0]), np.digitize(rate, edges[1])
    total = np.zeros((cells, cells))
    count = np.zeros((cells, cells))
    np.add.at(total, (i, j), values)
    np.add.at(count, (i, j), 1)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return charts.heat(mean, [str(k + 1) for k in range(cells)], [""] * cells, "codes")
