"""A recording from a built-in rig: what the sensors would have said, with the truth beside it.

  softsense simulate linear -o rec.csv               seven wires of the paper, random straining
  softsense simulate linear --wires all -o all.csv   all fourteen: seven matrices, two samples
  softsense simulate linear --motion triangle --amplitude 1.4 --period 30 -o cyclic.csv
  softsense simulate finger -o finger.csv            the pneumatic finger

linear writes t_s,strain,s1,…; strain is the default target of every command. finger writes
t_s,x_px,y_px,bend_deg,pressure_kpa,s1,…: say --target x_px,y_px (or bend_deg) when you use the
recording; columns with these names are never taken for sensors by default. A motion file for the
finger has the commanded pressure_kpa; the recording has the pressure within the finger."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from softsense.cli.console import Console

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softsense.simulate import Rig, RigState

HELP = "a recording from a built-in rig, or from a rig.toml"
_SAMPLES = {"linear": 8000, "finger": 15000}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what ``softsense simulate`` takes."""
    parser.add_argument("kind", nargs="?", choices=tuple(_SAMPLES), help="a built-in rig")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the recording, .csv")
    parser.add_argument(
        "--samples", type=int, metavar="N", help="default: linear 8000, finger 15000, motion's own"
    )
    parser.add_argument("--rate", type=float, metavar="HZ", help="sample rate (default 20 Hz)")
    parser.add_argument(
        "--signal", choices=("codes", "ohms"), default="codes", help="ADC codes (default) or ohms"
    )
    rig = parser.add_argument_group("the rig")
    rig.add_argument("--rig", type=Path, metavar="RIG.toml", help="this rig, no built-in one")
    rig.add_argument(
        "--wires", default="7", metavar="N|all", help="linear: how many are drawn (default 7)"
    )
    rig.add_argument("--save-rig", type=Path, metavar="RIG.toml", help="write the rig here")
    motion = parser.add_argument_group("the motion")
    motion.add_argument(
        "--motion",
        default="random",
        metavar="random|triangle|FILE",
        help="random (default), triangle, or a file with t_s and the rig's target (strain)",
    )
    motion.add_argument(
        "--target", metavar="NAME", help="column of the motion file (default: as the rig says)"
    )
    motion.add_argument(
        "--amplitude", type=float, metavar="A", help="triangle: in the target's unit (full range)"
    )
    motion.add_argument(
        "--period", type=float, default=30.0, metavar="S", help="triangle: seconds (default 30)"
    )
    later = parser.add_argument_group("a recording that goes on")
    later.add_argument("--save-state", type=Path, metavar="STATE", help="write the state here")
    later.add_argument(
        "--continue", dest="state", type=Path, metavar="STATE", help="go on from this state"
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Simulate and write the recording."""
    from softsense import recording
    from softsense.simulate import run as drive
    from softsense.simulate.record import read_state, to_recording, write_ohms, write_state

    state = None
    seed = args.seed
    if args.state:
        _refuse_with_state(args)
        rig, seed, state = read_state(args.state)
    else:
        rig = _rig(args)
    rig, strain, temp_c = _motion(args, rig, seed, state)
    result = drive(rig, strain, seed, state, temp_c)
    if args.signal == "ohms":
        write_ohms(rig, result, args.output, temp_c)
    else:
        recording.write(to_recording(rig, result, temp_c), args.output)
    from softsense_codegen.atomic import write_text

    if args.save_rig:
        write_text(args.save_rig, rig.to_toml())
    if args.save_state:
        write_state(rig, seed, result.state, args.save_state)
    _tell(args, console, rig, len(strain))
    return 0


def _refuse_with_state(args: argparse.Namespace) -> None:
    from softsense.errors import SoftsenseError

    if args.kind or args.rig or args.rate:
        raise SoftsenseError(
            "the state says which rig goes on, and at which rate",
            where=str(args.state),
            remedy="leave out the rig's name, --rig and --rate",
        )


def _rig(args: argparse.Namespace) -> Rig:
    from softsense.errors import SoftsenseError
    from softsense.simulate import all_wires, finger_rig, linear_rig, read_rig
    from softsense.simulate.linear import WIRES_TO_DRAW_FROM, draw_wires

    if args.rig and args.kind:
        raise SoftsenseError("a built-in rig and --rig were both given", remedy="give one of them")
    if args.rate is not None and not args.rate > 0:
        raise SoftsenseError(f"a rate of {args.rate} Hz is not above zero", remedy="--rate 20")
    if args.rig:
        rig = read_rig(args.rig)
    elif args.kind == "finger":
        rig = finger_rig(args.seed)
    elif args.kind == "linear":
        most = len(WIRES_TO_DRAW_FROM)
        if args.wires != "all" and args.wires not in map(str, range(1, most + 1)):
            raise SoftsenseError(
                f"{args.wires!r} wires cannot be drawn", remedy=f"give 1 … {most}, or all"
            )
        wires = all_wires() if args.wires == "all" else draw_wires(args.seed, int(args.wires))
        rig = linear_rig(args.seed, wires)
    else:
        raise SoftsenseError("no rig was named", remedy="give linear, finger or --rig RIG.toml")
    return replace(rig, rate_hz=args.rate) if args.rate else rig


def _motion(
    args: argparse.Namespace, rig: Rig, seed: int, state: RigState | None
) -> tuple[Rig, NDArray[np.float64], NDArray[np.float64] | None]:
    """The rig at the motion's rate, strain as shares of its range, and a logged temperature."""
    from softsense.errors import SoftsenseError
    from softsense.simulate.motion import random_motion, read_motion, triangle

    if args.samples is not None and not 10 <= args.samples <= 10**8:
        raise SoftsenseError(f"{args.samples} samples cannot be a recording", remedy="10 … 10^8")
    samples = args.samples or _SAMPLES["finger" if rig.body == "finger" else "linear"]
    start = 0 if state is None else state.samples
    reach = rig.high - rig.low
    if args.motion == "random":
        return rig, random_motion(samples, 1.0 / rig.rate_hz, seed, start), None
    if args.motion == "triangle":
        share = 1.0 if args.amplitude is None else args.amplitude / reach
        if not args.period > 0:
            raise SoftsenseError(f"a period of {args.period} s is not above zero")
        return rig, triangle(samples, 1.0 / rig.rate_hz, share, args.period, start), None
    values, rate_hz, temp_c = read_motion(Path(args.motion), args.target or rig.target)
    if state is not None and abs(rate_hz / rig.rate_hz - 1.0) > 1e-3:
        raise SoftsenseError(
            f"the motion has {rate_hz:.6g} Hz, the state {rig.rate_hz:.6g} Hz",
            where=args.motion,
            remedy="resample the motion",
        )
    if args.rate and abs(rate_hz / args.rate - 1.0) > 1e-3:
        raise SoftsenseError(
            f"the motion has {rate_hz:.6g} Hz, not {args.rate:g}",
            where=args.motion,
            remedy="leave out --rate",
        )
    if args.samples and args.samples > len(values):
        raise SoftsenseError(
            f"the motion has {len(values)} samples, not {args.samples}", where=args.motion
        )
    cut = slice(None, args.samples)
    strain = (values[cut] - rig.low) / reach
    rig = rig if state is not None else replace(rig, rate_hz=float(f"{rate_hz:.9g}"))
    return rig, strain, None if temp_c is None else temp_c[cut]


def _tell(args: argparse.Namespace, console: Console, rig: Rig, samples: int) -> None:
    sensors = [
        {"name": sensor.name, "matrix": sensor.matrix, "sample": sensor.sample}
        for sensor in rig.sensors
    ]
    if args.json:
        data = {
            "recording": str(args.output),
            "rig": rig.name,
            "samples": samples,
            "rate_hz": rig.rate_hz,
            "signal": args.signal,
            "sensors": sensors,
        }
        print(json.dumps(data, indent=1))
        return
    print(f"{args.output}: {samples} samples at {rig.rate_hz:g} Hz, {args.signal}")
    for sensor in rig.sensors:
        if sensor.matrix:
            console.say(f"  {sensor.name}  {sensor.matrix}, sample {sensor.sample}")
