"""Reading recordings: every format gives the same numbers, every flaw one line that names it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsense.errors import SoftsenseError
from softsense.recording import FrontEnd, parse_front_end, read, split, unit_of, write

HEADER = "t_s,strain,s1,s2"


def table(rows: int = 20) -> list[str]:
    return [f"{0.05 * i:.2f},{0.01 * i:.2f},{100 + i},{900 - 3 * i}" for i in range(rows)]


def csv(folder: Path, lines: list[str], header: str = HEADER, name: str = "rec.csv") -> Path:
    path = folder / name
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_every_format_gives_the_same_recording(tmp_path: Path) -> None:
    import pyarrow
    import pyarrow.parquet
    from scipy.io import savemat

    from_csv = read(csv(tmp_path, table()))
    columns = {
        "t_s": from_csv.t_s,
        "strain": from_csv.target[:, 0],
        "s1": from_csv.codes[:, 0],
        "s2": from_csv.codes[:, 1],
    }
    np.savez(tmp_path / "rec.npz", **columns)
    savemat(tmp_path / "rec.mat", columns)
    pyarrow.parquet.write_table(pyarrow.table(columns), tmp_path / "rec.parquet")
    for suffix in ("npz", "mat", "parquet"):
        other = read(tmp_path / f"rec.{suffix}")
        assert other.sensors == from_csv.sensors
        assert np.array_equal(other.codes, from_csv.codes)
        assert np.array_equal(other.target, from_csv.target)
        assert other.dt_s == pytest.approx(0.05)


def test_written_recordings_read_back(tmp_path: Path) -> None:
    first = read(csv(tmp_path, table()))
    second = read(write(first, tmp_path / "again.csv"))
    assert np.array_equal(first.codes, second.codes)
    assert np.array_equal(first.target, second.target)


def test_semicolons_byte_order_marks_and_comment_columns_are_read(tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    rows = [line.replace(",", ";") + ";ok" for line in table()]
    path.write_text(
        "\ufeff" + "\r\n".join([HEADER.replace(",", ";") + ";note", *rows]), encoding="utf-8"
    )
    assert read(path).sensors == ("s1", "s2")


def test_columns_are_chosen_by_name(tmp_path: Path) -> None:
    path = csv(tmp_path, table())
    recording = read(path, target="s2,strain", sensors="s1")
    assert recording.targets == ("s2", "strain")
    assert recording.sensors == ("s1",)
    assert read(path, context="s2").context["s2"][0] == 900


FLAWS = {
    "not a number": (lambda r: [*r[:4], "0.20,x,104,888", *r[5:]], ["row 6", "'strain'", "'x'"]),
    "empty cell": (lambda r: [*r[:4], "0.20,,104,888", *r[5:]], ["row 6", "'strain'", "empty"]),
    "nan": (lambda r: [*r[:4], "0.20,nan,104,888", *r[5:]], ["row 6", "'strain'", "finite"]),
    "inf": (lambda r: [*r[:4], "0.20,0.1,inf,888", *r[5:]], ["row 6", "'s1'", "finite"]),
    "ragged": (lambda r: [*r[:4], "0.20,0.1,104", *r[5:]], ["row 6", "3 cells", "4"]),
    "code too large": (lambda r: [*r[:4], "0.20,0.1,4096,888", *r[5:]], ["row 6", "'s1'", "4095"]),
    "negative code": (lambda r: [*r[:4], "0.20,0.1,-1,888", *r[5:]], ["row 6", "'s1'", "-1"]),
    "gap in time": (lambda r: [*r[:4], *r[6:]], ["row 6", "'t_s'", "uniform"]),
    "time backwards": (lambda r: r[::-1], ["'t_s'", "increase"]),
    "too few": (lambda r: r[:5], ["5 rows", "too few"]),
    "no rows": (lambda r: [], ["no rows"]),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_a_flaw_is_named_with_its_place(tmp_path: Path, flaw: str) -> None:
    spoil, words = FLAWS[flaw]
    path = csv(tmp_path, spoil(table()))
    with pytest.raises(SoftsenseError) as caught:
        read(path)
    text = str(caught.value)
    assert "\n" not in text
    for word in (str(path), *words):
        assert word in text


@pytest.mark.parametrize(
    ("header", "word"),
    [
        ("t_s,strain,s1,s1", "used twice"),
        ("t_s,strain,,s2", "empty"),
        ("0,0.1,100,200", "column names"),
        ("t_s,angle,s1,s2", "no column 'strain'"),
    ],
)
def test_a_bad_header_is_refused(tmp_path: Path, header: str, word: str) -> None:
    with pytest.raises(SoftsenseError, match=word):
        read(csv(tmp_path, table(), header))


def test_other_bad_files_are_refused(tmp_path: Path) -> None:
    for name, content in (
        ("broken.npz", b"PK\x03\x04 not really"),
        ("broken.mat", b"MATLAB 7.3"),
        ("broken.parquet", b"PAR1"),
        ("latin.csv", "t_s,strain,s\xe9\n".encode("latin-1")),
        ("picture.png", b"\x89PNG"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(SoftsenseError, match=name):
            read(tmp_path / name)
    with pytest.raises(SoftsenseError, match="nowhere"):
        read(tmp_path / "nowhere.csv")
    with pytest.raises(SoftsenseError, match="bits"):
        read(csv(tmp_path, table()), adc_bits=16)


def test_columns_of_different_length_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "rec.npz", strain=np.arange(20.0), s1=np.arange(19))
    with pytest.raises(SoftsenseError, match="differ in length"):
        read(tmp_path / "rec.npz")


def test_float_columns_pass_a_declared_front_end(tmp_path: Path) -> None:
    rows = [f"{0.05 * i:.2f},{0.01 * i:.2f},{1 + 0.1 * i:.3f},{5 - 0.2 * i:.3f}" for i in range(20)]
    path = csv(tmp_path, rows)
    auto = read(path)
    assert auto.front_ends[0].kind == "affine"
    assert 0 < auto.codes.min() < auto.codes.max() < 4095
    divider = read(path, front_end="divider:0.471,3750", adc_bits=12)
    expected = np.floor(3750 * 1.0 / (1.0 + 0.471) + 0.5)
    assert divider.codes[0, 0] == expected
    for wrong in ("divider:-1", "affine:1", "affine:0,1", "magic", "divider:x", "affine:nan,0"):
        with pytest.raises(SoftsenseError, match="front end"):
            read(path, front_end=wrong)


@given(st.floats(-1e6, 1e6), st.integers(4, 15))
def test_codes_never_leave_their_word(value: float, bits: int) -> None:
    for end in (
        FrontEnd("affine", bits, 3.7, -100.0),
        FrontEnd("divider", bits, 2.0**bits + 500, 2.0),
    ):
        code = int(end.encode(np.array([value]))[0])
        assert 0 <= code < 2**bits


@settings(max_examples=50)
@given(st.integers(20, 3000), st.sampled_from(["blocks", "forward", "random"]), st.integers(0, 9))
def test_a_split_uses_every_row_once(samples: int, how: str, seed: int) -> None:
    parts = split(samples, how, seed)
    rows = np.concatenate([parts.train, parts.validation, parts.test])
    assert np.array_equal(np.sort(rows), np.arange(samples))
    assert len(parts.train) == round(0.7 * samples)


def test_blocks_are_blocks_and_forward_is_forward() -> None:
    blocks = split(8000, "blocks", 1)
    assert np.sum(np.diff(blocks.test) > 1) <= 3
    forward = split(8000, "forward")
    assert forward.train.max() < forward.validation.min() < forward.test.min()
    with pytest.raises(SoftsenseError, match="no split"):
        split(100, "sideways")


def test_unusable_recordings_are_refused_at_the_door(tmp_path: Path) -> None:
    with pytest.raises(SoftsenseError, match="too few"):
        read(csv(tmp_path, table(20))).require_usable()
    constant = [f"{0.05 * i:.2f},{0.01 * i:.2f},7,{i}" for i in range(200)]
    with pytest.raises(SoftsenseError, match="'s1' is constant"):
        read(csv(tmp_path, constant)).require_usable()
    still = [f"{0.05 * i:.2f},0.3,{i},{i}" for i in range(200)]
    with pytest.raises(SoftsenseError, match="'strain' is constant"):
        read(csv(tmp_path, still)).require_usable()


def test_units_come_from_names() -> None:
    assert unit_of("knee_deg") == "deg"
    assert unit_of("strain") == "1"
    assert parse_front_end("auto", 12) is None


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path) -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    from softsense_codegen import atomic

    target = tmp_path / "rec.csv"
    target.mkdir()  # the rename fails, as it does when the disk is full at the last moment
    with pytest.raises(SoftsenseError, match="cannot write"):
        atomic.write_text(target, "x")
    assert [p.name for p in tmp_path.iterdir()] == ["rec.csv"]


def test_real_recordings_are_read(shared: Path) -> None:
    for path in sorted((shared / "recordings").glob("*.csv")):
        recording = read(path, target="knee_deg")
        assert recording.sensors == ("r1_kohm", "r2_kohm", "r3_kohm", "r4_kohm", "r5_kohm")
        assert recording.target_units == ("deg",)
        recording.require_usable()
