"""Boards on a serial line, real or emulated: ask them for estimates and believe the answers."""

from __future__ import annotations

from pathlib import Path

from softsense.device.board import Board, boards, networks
from softsense.device.client import Device, Identity, Sample, Verdict
from softsense.device.emulator import Emulator, Faults
from softsense.device.transport import DEFAULT_BAUD, Line
from softsense.errors import SoftsenseError

__all__ = [
    "Board",
    "Device",
    "Emulator",
    "Faults",
    "Identity",
    "Sample",
    "Verdict",
    "boards",
    "connect",
]


def connect(
    out: str | Path | None,
    where: str,
    *,
    baud: int = DEFAULT_BAUD,
    patience_s: float = 5.0,
    faults: Faults | None = None,
    seed: int = 0,
) -> Device:
    """A board to use in a ``with`` statement.

    ``where``: a serial path or pyserial URL, or ``emulate:BOARD`` / ``qemu:BOARD``, which starts
    the emulator with ``faults`` on its cable. ``out``: the export folder that the board must hold;
    its digest is compared at once and after every reset. None takes any board.

    Raises ``SoftsenseError`` where nothing answers or the board holds another model.
    """
    expected = None if out is None else networks(Path(out))[0].digest
    kind, _, board = where.partition(":")
    if kind not in ("emulate", "qemu"):
        return Device(Line(where, baud), expected, patience_s)
    if out is None:
        raise SoftsenseError(
            "an emulated board needs a model", where=where, remedy="name the export folder"
        )
    emulator = Emulator(Path(out), board, faults or Faults(), seed).__enter__()
    return Device(Line(emulator.port, baud), expected, patience_s, owner=emulator)
