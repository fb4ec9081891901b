"""The host-side feeder of an emulated board's converter.

The converter of an emulated board reads the file ``adc.bin``: rows of little-endian int16, one per
channel, in the order of the board's channels (the primary network's inputs, then what the fallback
networks add). Conversion n is row n modulo the number of rows. This file makes those rows from a
recording, through the front end that the model was trained with.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softsense.device.board import adc_bits, channels, networks, read_manifest
from softsense.errors import SoftsenseError
from softsense.recording import FrontEnd, Recording, read, read_columns

_KINDS = ("open", "short", "stuck")


def read_truth(out: Path | None, path: Path, target: str | None = None) -> Recording:
    """The recording with the model's own targets (or ``target``)."""
    if target is None and out is not None:
        target = ",".join(networks(out)[0].outputs)
    bits = 12 if out is None else adc_bits(out)
    return read(path, target=target or "strain", adc_bits=bits)


def converter_codes(out: Path, path: Path, sensor_faults: Sequence[str] = ()) -> NDArray[np.int16]:
    """(rows, channels) int16 for the converter, with ``sensor_faults`` ("s3:open@200") applied.

    Raises ``SoftsenseError`` where the recording lacks a sensor of the model.
    """
    names = channels(networks(out))
    recording = read_truth(out, path)
    codes = _through_front_ends(out, path, recording.with_sensors(names))
    highest = 2 ** adc_bits(out) - 1
    for fault in sensor_faults:
        _break(codes, names, fault, highest)
    return codes


def _through_front_ends(out: Path, path: Path, recording: Recording) -> NDArray[np.int16]:
    """Physical columns pass the front ends stored with the model, not ones fitted anew."""
    manifest = read_manifest(out)
    stored = {
        item["name"]: stored_front_end(str(item.get("front_end", "")))
        for entry in (manifest, *manifest.get("fallbacks", ()))
        for item in entry["inputs"]
    }
    codes = recording.codes.astype(np.int16)
    columns = read_columns(path)
    for column, name in enumerate(recording.sensors):
        end = stored.get(name)
        if end is not None and recording.front_ends[column].kind != "codes":
            codes[:, column] = end.encode(columns[name])
    return codes


def stored_front_end(text: str) -> FrontEnd | None:
    """The front end that ``FrontEnd.describe`` has described; None where codes pass as they are."""
    bits = re.search(r"(\d+) bits", text)
    affine = re.search(r"round\((\S+) \* value \+ (\S+)\)", text)
    if affine and bits:
        return FrontEnd("affine", int(bits[1]), float(affine[1]), float(affine[2]))
    divider = re.search(r"round\((\S+) \* R / \(R \+ ([^)\s]+)\)\)", text)
    if divider and bits:
        return FrontEnd("divider", int(bits[1]), float(divider[1]), float(divider[2]))
    return None


def _break(codes: NDArray[np.int16], names: Sequence[str], fault: str, highest: int) -> None:
    name, _, rest = fault.partition(":")
    kind, _, row_text = rest.partition("@")
    if name not in names or kind not in _KINDS or not (row_text or "0").isdigit():
        raise SoftsenseError(
            f"sensor fault {fault!r} is not understood",
            remedy=f"SENSOR:KIND@ROW with sensors {', '.join(names)} and kinds {', '.join(_KINDS)}",
        )
    row = min(int(row_text or 0), len(codes) - 1)
    value = {"open": highest, "short": 0, "stuck": int(codes[row, names.index(name)])}[kind]
    codes[row:, names.index(name)] = value
