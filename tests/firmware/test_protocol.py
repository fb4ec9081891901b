"""One table of bytes, one file of frames: C, Python and the page say the same."""

from __future__ import annotations

import json
import re
import struct
import subprocess
from pathlib import Path

import fastcrc
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsense.device.framing import (
    HEADER,
    LAYOUTS,
    STRUCTS,
    TRAILER,
    Frame,
    Kind,
    Splitter,
    answers,
    decode,
    encode,
)

HERE = Path(__file__).parent
FIRMWARE = HERE.parents[1] / "firmware"
FRAMES = json.loads((HERE / "frames.json").read_text())


def table(heading: str) -> list[list[str]]:
    """Rows of the README's table that begins with ``heading``."""
    text = (FIRMWARE / "README.md").read_text()
    lines = text[text.index(heading) :].splitlines()[2:]
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def test_the_page_and_python_have_the_same_payloads() -> None:
    page: dict[str, list[tuple[str, int]]] = {}
    for payload, size, field, _ in table("| payload | bytes"):
        page.setdefault(payload, []).append((field, int(size)))
    python = {
        name: [
            (field, struct.calcsize("<" + letter))
            for field, letter in zip(fields, layout.lstrip("<"), strict=True)
        ]
        for name, (layout, fields) in LAYOUTS.items()
        if fields
    }
    assert page == python


def test_the_page_and_python_have_the_same_frame_and_kinds() -> None:
    sizes = [size for _, size, _ in table("| frame | bytes")]
    assert sizes[:4] == [str(struct.calcsize("<" + c)) for c in HEADER.format.lstrip("<")]
    assert sizes[5:] == [str(struct.calcsize("<" + c)) for c in TRAILER.format.lstrip("<")]
    kinds = {name: int(value, 16) for name, value in table("| kind | value |")}
    assert kinds == {
        kind.name.lower().replace("_", "-"): kind.value for kind in Kind if kind != Kind.ANSWER
    }


def test_c_and_the_page_have_the_same_kinds() -> None:
    header = (FIRMWARE / "include" / "messages.h").read_text()
    for name, value in table("| kind | value |"):
        found = re.search(rf"MESSAGE_{name.upper().replace('-', '_')} = (0x\w+)", header)
        assert found is not None
        assert int(found[1], 16) == int(value, 16)


def test_the_checks_are_the_catalogued_ones() -> None:
    assert fastcrc.crc16.ibm_3740(b"123456789") == 0x29B1
    assert fastcrc.crc16.en_13757(b"123456789") == 0xC2B7


@pytest.mark.parametrize("number", range(len(FRAMES)))
def test_python_reads_and_writes_the_frames(number: int) -> None:
    case = FRAMES[number]
    frame = Frame(case["kind"], case["sequence"], case["session"], bytes.fromhex(case["payload"]))
    wire, check = encode(frame, case["request_check"])
    assert (wire.hex(), check) == (case["wire"], case["check"])
    (piece,) = Splitter().push(wire)
    got = decode(piece)
    assert got is not None
    assert answers(got, case["request_check"])
    assert not answers(got, case["request_check"] ^ 1)
    assert (got.kind, got.sequence, got.session, got.payload) == (
        frame.kind,
        frame.sequence,
        frame.session,
        frame.payload,
    )


SANITIZE = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


@pytest.mark.parametrize(
    ("compiler", "flags", "emulator"),
    [
        ("gcc", SANITIZE, None),
        ("clang", SANITIZE, None),
        # big-endian
        ("powerpc-linux-gnu-gcc", ["-O2", "-static"], "qemu-ppc"),
    ],
)
def test_c_reads_and_writes_the_frames(
    compiler: str, flags: list[str], emulator: str | None, tool, tmp_path: Path
) -> None:
    program = tmp_path / "frames"
    sources = [FIRMWARE / "src" / f"{name}.c" for name in ("cobs", "crc", "frame")]
    command = [
        tool(compiler),
        "-std=c11",
        *flags,
        "-DPORT_FRAME_BYTES=1024",
        f"-I{FIRMWARE / 'include'}",
    ]
    subprocess.run([*command, *sources, HERE / "test_frames.c", "-o", program], check=True)
    lines = [
        f"{c['kind']:x} {c['sequence']:x} {c['session']:x} {c['request_check']:x} {c['check']:x} "
        f"{c['payload'] or '-'} {c['wire']}"
        for c in FRAMES
    ]
    done = subprocess.run(
        [*([tool(emulator)] if emulator else []), program],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout.strip(), done.returncode) == (str(len(FRAMES)), 0), done.stderr


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=600))
def test_the_python_decoder_survives_any_bytes(data: bytes) -> None:
    for piece in Splitter().push(data + b"\0"):
        frame = decode(piece)
        if frame is not None:
            wire, _ = encode(frame)
            assert not answers(frame, 0) or wire.strip(b"\0") == piece


@settings(max_examples=300, deadline=None)
@given(
    st.integers(0, 255),
    st.integers(0, 65535),
    st.binary(max_size=700),
    st.integers(0, 65535),
    st.data(),
)
def test_damage_is_seen(
    kind: int, number: int, payload: bytes, request_check: int, data: st.DataObject
) -> None:
    wire, _ = encode(Frame(kind, number, number, payload), request_check)
    whole = [decode(piece) for piece in Splitter().push(wire)]
    assert len(whole) == 1
    assert whole[0] is not None
    assert answers(whole[0], request_check)
    bit = data.draw(st.integers(8, 8 * (len(wire) - 1) - 1))
    damaged = bytearray(wire)
    damaged[bit // 8] ^= 1 << bit % 8
    for piece in Splitter().push(bytes(damaged)):
        frame = decode(piece)
        assert frame is None or not answers(frame, request_check)


def test_the_splitter_forgets_endless_noise_and_resynchronises() -> None:
    splitter = Splitter()
    for _ in range(100):
        assert splitter.push(b"x" * 1000) == []
    wire, _ = encode(Frame(1, 2, 3, b"abc"))
    found = [decode(piece) for piece in splitter.push(wire)]
    assert [frame.payload for frame in found if frame is not None] == [b"abc"]


def test_sizes_are_whole() -> None:
    assert {name: STRUCTS[name].size for name in ("sample", "estimate answer")} == {
        "sample": 18,
        "estimate answer": 12,
    }
