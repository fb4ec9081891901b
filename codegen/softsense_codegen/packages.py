"""The generated C as a package: for the Arduino IDE, CMake and PlatformIO, and as a self-test."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from softsense_codegen.atomic import write_text
from softsense_codegen.network import IntNetwork
from softsense_codegen.render import render
from softsense_codegen.view import label

Package = Literal["arduino", "cmake", "platformio", "vectors"]
PACKAGES: tuple[Package, ...] = ("arduino", "cmake", "platformio", "vectors")


def write_packages(
    nets: Sequence[IntNetwork], out: Path, packages: Sequence[Package], adc_bits: int = 12
) -> list[Path]:
    """Write ``packages`` of the networks whose C is in ``out``; the first is the main one.

    "arduino": ``out/arduino/NAME``, a library folder to copy or zip; "cmake": CMakeLists.txt;
    "platformio": library.json; "vectors": NAME_selftest.c, which runs NAME_vectors.h on the
    device. ``adc_bits``: bits of the codes that the networks were trained on. Returns the paths.

    Raises ``SoftsenseError`` for a disk that cannot be written to.
    """
    main = nets[0]
    view = {
        "name": main.name,
        "names": [net.name for net in nets],
        # A version for package managers: the digest says which network it is.
        "version": f"1.0.0+{main.digest[:12]}",
        "digest": main.digest,
        "inputs": [label(i.name) for i in main.inputs],
        "outputs": [label(o.name) for o in main.outputs],
        "units": [label(o.unit) for o in main.outputs],
        "adc_bits": adc_bits,
    }
    written = []
    if "arduino" in packages:
        folder = out / "arduino" / main.name
        written.append(
            write_text(folder / "library.properties", render("library.properties.j2", view))
        )
        example = folder / "examples" / "Estimate" / "Estimate.ino"
        written.append(write_text(example, render("Estimate.ino.j2", view)))
        for net in nets:
            for suffix in (".h", ".c"):
                text = (out / f"{net.name}{suffix}").read_text(encoding="utf-8")
                written.append(write_text(folder / "src" / f"{net.name}{suffix}", text))
    if "cmake" in packages:
        written.append(write_text(out / "CMakeLists.txt", render("CMakeLists.txt.j2", view)))
    if "platformio" in packages:
        written.append(write_text(out / "library.json", render("library.json.j2", view)))
    if "vectors" in packages:
        for net in nets:
            text = render("selftest.c.j2", {**view, "name": net.name, "digest": net.digest})
            written.append(write_text(out / f"{net.name}_selftest.c", text))
    return written
