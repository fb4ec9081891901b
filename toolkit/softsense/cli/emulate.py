"""Run a board without a board: the firmware with a model, behind a serial port.

Prints the port on stdout and runs until Ctrl-C. With --recording, the codes of a recording are
played into the emulated converter, one row per conversion, so that `softsense device monitor`
shows moving estimates.

  softsense emulate out/demo
  softsense emulate out/demo --board mps2-an386 --faults 'drop=0.001,flip=1e-4,cut=30s,reset'

Faults: drop, flip, noise (probability per byte), reorder (per frame), delay (at most that late),
cut and reset (mean time between them), baud (limits the rate)."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from softsense.cli.console import Console

HELP = "run the firmware on an emulated board behind a serial port"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense emulate``."""
    parser.add_argument("out", type=Path, metavar="OUT", help="folder that build or export wrote")
    parser.add_argument("--board", default="host", help="a folder of firmware/ports (default host)")
    parser.add_argument("--faults", default="", metavar="SPEC", help="what is wrong with the cable")
    parser.add_argument(
        "--tcp", type=int, metavar="PORT", help="also listen on 127.0.0.1:PORT (0: any free one)"
    )
    parser.add_argument(
        "--recording", type=Path, metavar="FILE", help="recording to play into the converter"
    )
    parser.add_argument(
        "--sensor-fault",
        action="append",
        default=[],
        metavar="SENSOR:KIND@ROW",
        help="from that row of the recording on, the sensor is open, short or stuck",
    )


def run(args: argparse.Namespace, console: Console) -> int:
    """Start the board, print the port, wait for Ctrl-C."""
    import signal

    from softsense.device.board import read_manifest
    from softsense.device.emulator import Emulator, parse_faults, terminate_on
    from softsense.device.feeder import converter_codes
    from softsense.errors import SoftsenseError

    faults = parse_faults(args.faults)
    read_manifest(args.out)
    adc = None
    if args.recording is not None:
        adc = converter_codes(args.out, args.recording, args.sensor_fault)
    terminate_on(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    console.say(f"building the firmware for {args.board} …")
    with Emulator(args.out, args.board, faults, args.seed, args.tcp, adc) as emulator:
        try:  # from the first word of the port on: who reads it may end us at once
            if args.json:
                print(json.dumps({"port": emulator.port, "tcp": emulator.tcp}), flush=True)
            else:
                print(emulator.port, flush=True)
                if emulator.tcp is not None:
                    print(f"socket://127.0.0.1:{emulator.tcp}", flush=True)
            console.say(f"try: softsense device ping --port {emulator.port}      (Ctrl-C ends)")
            while (failure := emulator.failure()) is None:
                time.sleep(0.2)
        except KeyboardInterrupt:
            return 0
        raise SoftsenseError(f"the emulated board has stopped: {failure}", where=args.board)
