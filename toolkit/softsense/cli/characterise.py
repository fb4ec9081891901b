"""Per sensor of a recording: hysteresis, drift, relaxation, overshoot, response time, linearity,
noise and resolution; repeatability of paired samples. Table, JSON and pictures.

Shares are of a sensor's own span. With --rig (as simulate --save-rig wrote it) dividers and
paired samples are known, and a small network predicts the simulated resistance from strain, and
from strain and stress."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softsense.cli.console import Console
from softsense.cli.options import add_recording, read_recording

if TYPE_CHECKING:
    from softsense.simulate.characterise import Character, TwoFactor

HELP = "per sensor: hysteresis, drift, relaxation, response, linearity, noise, repeatability"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what ``softsense characterise`` takes."""
    add_recording(parser)
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="pictures and JSON here")
    parser.add_argument("--rig", type=Path, metavar="RIG.toml", help="the rig that simulated it")
    parser.add_argument(
        "--pairs", default="", metavar="A:B,…", help="sensors that are samples of the same kind"
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Characterise, print, and write where asked to."""
    from softsense.simulate import read_rig
    from softsense.simulate.characterise import characterise, two_factor
    from softsense_codegen.atomic import write_text

    recording = read_recording(args)
    rig = read_rig(args.rig) if args.rig else None
    character = characterise(recording, rig, _pairs(args.pairs))
    nets: tuple[TwoFactor, ...] = ()
    stressed = rig is not None and any(placed.at == "stress" for placed in rig.effects)
    if rig and stressed and rig.body == "linear" and rig.target == recording.targets[0]:
        nets = two_factor(recording, rig, args.seed)
    data = _plain({**asdict(character), "two_factor": [asdict(net) for net in nets]})
    if args.output:
        from softsense.simulate.pictures import draw

        args.output.mkdir(parents=True, exist_ok=True)
        write_text(args.output / "characterise.json", json.dumps(data, indent=1) + "\n")
        draw(recording, character, args.output, nets)
        console.say(f"{args.output}: characterise.json and pictures")
    if args.json:
        print(json.dumps(data, indent=1))
    else:
        _print(character, nets, console)
    return 0


def _pairs(text: str) -> tuple[tuple[str, str], ...]:
    from softsense.errors import SoftsenseError

    pairs = []
    for part in filter(None, text.split(",")):
        names = part.split(":")
        if len(names) != 2:
            raise SoftsenseError(f"pair {part!r} is not understood", remedy="--pairs s1:s2,s3:s4")
        pairs.append((names[0].strip(), names[1].strip()))
    return tuple(pairs)


def _plain(value: Any) -> Any:
    """Plain data for JSON: arrays as lists, what is not a number as null."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and value - value != 0.0:  # infinite or not a number
        return None
    return value


def _print(character: Character, nets: tuple[TwoFactor, ...], console: Console) -> None:
    def percent(share: float) -> str:
        return f"{100 * share:.1f} %"

    unit = "" if character.unit == "1" else f" {character.unit}"
    motion = ("sensor", "span", "loop", "drift", "overshoot", "settles", "relaxes (s: share)")
    rows = [
        [
            one.name,
            f"{one.span_codes:.0f}",
            percent(one.loop_area_share),
            percent(one.drift_share),
            percent(one.overshoot_share),
            f"{one.response_s:.1f} s",
            "  ".join(f"{tau:.3g}: {percent(share)}" for tau, share in one.relaxation) or "-",
        ]
        for one in character.sensors
    ]
    console.table(motion, rows, title=f"{character.target}{unit and ' in'}{unit}")
    print()
    static = (
        "sensor",
        "R^2 line",
        "bend",
        "gauge",
        "base ohm",
        "noise",
        "resolution",
        "static RMSE",
    )
    rows = [
        [
            one.name,
            f"{one.linearity_r2:.3f}",
            percent(one.nonlinearity_share),
            "-" if one.gauge_factor is None else f"{one.gauge_factor:.3g}",
            "-" if one.base_ohm is None else f"{one.base_ohm:.4g}",
            f"{one.noise_codes:.2f} LSB",
            f"{one.resolution:.2g}{unit}",
            f"{one.static_rmse:.3g}{unit}",
        ]
        for one in character.sensors
    ]
    console.table(static, rows)
    for pair in character.pairs:
        verdict = "repeatable" if pair.repeatable else "NOT repeatable"
        print(
            f"  {pair.first}, {pair.second}: differ by {percent(pair.difference_share)}: {verdict}"
        )
    if nets:
        print("\n  resistance, explained on held-out time by a small network (R^2)")
        header = ("sensor", "from strain", "from strain and stress")
        console.table(
            header,
            [
                [net.name, f"{net.from_strain_r2:.4f}", f"{net.from_strain_and_stress_r2:.4f}"]
                for net in nets
            ],
        )
