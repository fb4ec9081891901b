"""Frames of the serial protocol: bytes on the wire, and what they mean.

The byte tables are in ``firmware/README.md``; ``LAYOUTS`` restates them and a test compares the two.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

import fastcrc
from cobs import cobs

VERSION = 1
HEADER = struct.Struct("<BBHH")
TRAILER = struct.Struct("<HH")
OVERHEAD = HEADER.size + TRAILER.size
# COBS adds a byte per 254, and one; a zero on either side separates frames.
LONGEST_ENCODED = 4096


class Kind(IntEnum):
    """Kinds of request; ``ANSWER`` is added in what the board sends."""

    IDENTIFY = 0x01
    ESTIMATE = 0x02
    BATCH = 0x03
    SELF_TEST = 0x04
    STREAM = 0x05
    STATISTICS = 0x06
    SAMPLE = 0x40
    ERROR = 0x7F
    ANSWER = 0x80


class Refusal(IntEnum):
    """Why a board refuses a request."""

    BAD_VERSION = 1
    BAD_KIND = 2
    BAD_LENGTH = 3
    BAD_SESSION = 4
    BAD_NETWORK = 5
    BAD_RATE = 6
    NO_CONVERTER = 7


class Flag(IntFlag):
    """What a board says about an estimate."""

    UNCALIBRATED = 0x01
    FAILED = 0x02
    FALLBACK = 0x04
    UNTRUSTED = 0x08


# The fixed part of every payload, little-endian; lists of int16 codes, int32 estimates or text
# follow it. Names as in the byte tables.
LAYOUTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "identify request": ("<HBH", ("session", "network", "offset")),
    "identify answer": (
        "<BBBBHHIH",
        ("networks", "inputs", "outputs", "channels", "frame", "queue", "baud", "total"),
    ),
    "estimate request": ("<BH", ("network", "rows")),
    "estimate answer": ("<BBIIH", ("network", "flags", "uncalibrated", "failed", "rows")),
    "self-test request": ("<BIH", ("network", "first", "count")),
    "self-test answer": ("<IHH", ("total", "compared", "mismatches")),
    "stream request": ("<I", ("period_us",)),
    "stream answer": ("<I", ("period_us",)),
    "statistics request": ("<", ()),
    "statistics answer": (
        "<IIIIIIII",
        (
            "time_us",
            "frames",
            "damaged",
            "overrun",
            "answers",
            "refused",
            "estimates",
            "conversions",
        ),
    ),
    "sample": (
        "<IIBBII",
        ("conversion", "time_us", "network", "flags", "uncalibrated", "failed"),
    ),
    "error": ("<B", ("error",)),
}
STRUCTS = {name: struct.Struct(layout) for name, (layout, _) in LAYOUTS.items()}


@dataclass(frozen=True)
class Frame:
    """One frame without its checks. ``check`` is the frame's own, once it is on the wire."""

    kind: int
    sequence: int
    session: int
    payload: bytes
    version: int = VERSION
    check: int = 0


def check_of(request_check: int, body: bytes) -> int:
    """Second check (CRC-16/EN-13757) over the request's check, header and payload.

    Its polynomial differs from that of the CRC, so that a damaged frame which one misses the other
    sees; and since it begins with the request's check, an answer fits only the very request that
    was sent.
    """
    value: int = fastcrc.crc16.en_13757(struct.pack("<H", request_check) + body)
    return value


def encode(frame: Frame, request_check: int = 0) -> tuple[bytes, int]:
    """Bytes for the wire, with a zero before and after, and the frame's check."""
    header = HEADER.pack(frame.version, frame.kind, frame.sequence, frame.session)
    body = header + frame.payload
    check = check_of(request_check, body)
    body += struct.pack("<H", check)
    body += struct.pack("<H", fastcrc.crc16.ibm_3740(body))
    return b"\0" + cobs.encode(body) + b"\0", check


def decode(encoded: bytes) -> Frame | None:
    """The frame between two zeros, or None when it is damaged.

    The second check is still to be compared by ``answers``, which knows the request.
    """
    try:
        body = cobs.decode(encoded)
    except cobs.DecodeError:
        return None
    if len(body) < OVERHEAD:
        return None
    check, crc = TRAILER.unpack_from(body, len(body) - TRAILER.size)
    if fastcrc.crc16.ibm_3740(body[:-2]) != crc:
        return None
    version, kind, sequence, session = HEADER.unpack_from(body)
    payload = body[HEADER.size : -TRAILER.size]
    return Frame(kind, sequence, session, payload, version, check)


def answers(frame: Frame, request_check: int) -> bool:
    """Whether ``frame`` is intact and answers the request with that check (0: answers none)."""
    header = HEADER.pack(frame.version, frame.kind, frame.sequence, frame.session)
    return frame.check == check_of(request_check, header + frame.payload)


class Splitter:
    """Cuts a stream of bytes at its zeros. Never holds more than ``LONGEST_ENCODED`` bytes."""

    def __init__(self) -> None:
        self._rest = b""
        self._lost = False

    def push(self, data: bytes) -> list[bytes]:
        """Everything that ``data`` completes, without empty pieces."""
        *whole, rest = (self._rest + data).split(b"\0")
        if whole and self._lost:
            whole, self._lost = whole[1:], False
        self._rest = rest
        if len(rest) > LONGEST_ENCODED:
            self._rest, self._lost = b"", True
        return [piece for piece in whole if piece]
