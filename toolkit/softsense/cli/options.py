"""Options that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softsense.recording import FrontEnd, Recording
    from softsense_codegen.packages import Package


def add_recording(parser: argparse.ArgumentParser, sensors: bool = True) -> None:
    """The positional recording and how to read it."""
    parser.add_argument("recording", type=Path, help="recording: .csv, .npz, .mat or .parquet")
    add_reading(parser, sensors)


def add_reading(parser: argparse.ArgumentParser, sensors: bool = True) -> None:
    """How to read a recording: which columns are what, and the ADC in front of them."""
    group = parser.add_argument_group("reading the recording")
    group.add_argument(
        "--target", default="strain", metavar="A[,B]", help="target column(s) (default strain)"
    )
    if sensors:
        group.add_argument(
            "--sensors", metavar="A,B,…", help="sensor columns (default every other column)"
        )
    group.add_argument(
        "--context", default="", metavar="A,B", help="columns that are neither, e.g. temp_c"
    )
    group.add_argument(
        "--adc-bits",
        type=int,
        default=12,
        metavar="N",
        help="bits of a code (default 12)",
    )
    group.add_argument(
        "--front-end",
        default="auto",
        metavar="SPEC",
        help="how physical columns become codes: auto (default), affine:SCALE,OFFSET or "
        "divider:R_REF[,SUPPLY_CODE]",
    )


def read_recording(args: argparse.Namespace, path: Path | None = None) -> Recording:
    """The recording that ``args`` describe (``path`` where it is not ``args.recording``)."""
    return read_recordings(args, args.recording if path is None else path)[0]


def read_recordings(
    args: argparse.Namespace, *paths: Path, front_end: Mapping[str, FrontEnd] | None = None
) -> tuple[Recording, ...]:
    """The recordings ``paths``, read on one scale (``front_end`` where ``args`` leave it open)."""
    from softsense.recording import read_together

    return read_together(
        paths,
        target=args.target,
        sensors=getattr(args, "sensors", None),
        context=args.context,
        adc_bits=args.adc_bits,
        front_end=front_end if front_end and args.front_end == "auto" else args.front_end,
    )


def add_packages(parser: argparse.ArgumentParser) -> None:
    """Ways to hand the generated C on."""
    group = parser.add_argument_group("hand the C on")
    for name, text in (
        ("arduino", "an Arduino library with an example, in OUT/arduino"),
        ("cmake", "a CMakeLists.txt with a library target"),
        ("platformio", "a library.json"),
        ("vectors", "NAME_selftest.c, which runs the vectors on the device"),
    ):
        group.add_argument(f"--{name}", action="store_true", help=text)


def packages_of(args: argparse.Namespace) -> tuple[Package, ...]:
    """The packages that were asked for."""
    from softsense_codegen.packages import PACKAGES

    return tuple(name for name in PACKAGES if getattr(args, name))
