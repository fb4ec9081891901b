"""Fit a simulator to a recording: static curve, stress states, friction, overshoot, drift, noise.

The number of stress states is chosen on blocks of time that the fit has not seen. The rig runs in
  softsense simulate --rig rig.toml --motion nominal.csv -o again.csv
and gives codes like those of the recording. A recording of codes cannot tell the divider in front
of them: base and reference resistances of the rig are then in units of a nominal 10 kohm."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

HELP = "fit a simulator to a recording: rig.toml"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what ``softsense calibrate`` takes."""
    add_recording(parser)
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RIG.toml", help="the fitted rig"
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Fit, write the rig, and say how far it is from the recording."""
    from softsense.simulate.calibrate import calibrate
    from softsense_codegen.atomic import write_text

    recording = read_recording(args)
    with console.progress("fit", len(recording.sensors)) as advance:
        result = calibrate(recording, advance)
    write_text(args.output, result.rig.to_toml())
    if args.json:
        data = {"rig": str(args.output), "sensors": [asdict(one) for one in result.sensors]}
        print(json.dumps(data, indent=1))
        return 0
    header = ("sensor", "stress states", "residual", "on held-out time", "noise floor", "terms")
    rows = [
        [
            one.name,
            str(one.states),
            f"{one.residual:.1f}",
            f"{one.held_out:.1f}",
            f"{one.noise:.1f}",
            ", ".join(f"{term.effect} {term.value:g}" for term in one.terms) or "-",
        ]
        for one in result.sensors
    ]
    console.table(header, rows, title="RMS in codes")
    print(f"\n{args.output}: run it with softsense simulate --rig {args.output} --motion …")
    return 0
