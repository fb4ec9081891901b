"""Talk to a board, real or emulated, over its serial port.

  softsense device list                                  serial ports that answer
  softsense device ping --port /dev/ttyACM0
  softsense device estimate --port PORT 2048 1711        one row of codes
  softsense device estimate --port PORT --csv codes.csv  columns by the sensors' names
  softsense device verify OUT --port PORT                bit for bit against the reference
  softsense device record --port PORT -o rec.csv --rate 50
  softsense device monitor --port PORT                   live, in the terminal or --web
  softsense device flash OUT --board BOARD

PORT is a path, a pyserial URL (socket://host:port), or with a model folder emulate:BOARD."""

from __future__ import annotations

import argparse
from pathlib import Path

from softsense.cli.console import Console

HELP = "talk to a board: ping, info, estimate, verify, record, monitor, flash, list"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``softsense device``."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)

    def add(name: str, text: str, port: bool = True) -> argparse.ArgumentParser:
        sub = actions.add_parser(name, help=text, description=text)
        # SUPPRESS: the same options before ACTION stay in force.
        sub.add_argument("--json", action="store_true", default=argparse.SUPPRESS)
        sub.add_argument("-q", "--quiet", action="store_true", default=argparse.SUPPRESS)
        sub.add_argument("--seed", type=int, default=argparse.SUPPRESS)
        if port:
            sub.add_argument("--port", required=True, help="serial path or URL")
        sub.add_argument("--baud", type=int, default=115200, help="symbol rate (default 115200)")
        sub.add_argument(
            "--patience", type=float, default=5.0, metavar="S", help="give up after (default 5 s)"
        )
        if port or name == "list":
            sub.add_argument(
                "--model", type=Path, metavar="OUT", help="the model the board must hold"
            )
        return sub

    add("list", "serial ports that answer", port=False)
    ping = add("ping", "round-trip time of the link")
    ping.add_argument("--count", type=int, default=10, metavar="N", help="requests (default 10)")
    add("info", "what the board holds, and its counters")
    estimate = add("estimate", "estimates for codes from the command line, a CSV or stdin")
    estimate.add_argument("codes", nargs="*", type=int, metavar="CODE", help="one row of codes")
    estimate.add_argument(
        "--csv", metavar="FILE", help="codes in columns by the sensors' names; - is stdin"
    )
    estimate.add_argument(
        "--health",
        action="store_true",
        help="codes of all channels; the board watches the sensors and chooses the network",
    )
    verify = add("verify", "compare the board bit for bit with the model's vectors")
    verify.add_argument("out", type=Path, metavar="OUT", help="folder that build or export wrote")
    verify.add_argument("--vectors", type=int, default=20000, metavar="N", help="random ones")
    record = add("record", "raw codes and device time to a recording")
    record.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.csv")
    record.add_argument("--rate", type=float, default=50.0, metavar="HZ", help="default 50")
    record.add_argument("--seconds", type=float, metavar="S", help="stop after (default: Ctrl-C)")
    record.add_argument("--resume", action="store_true", help="go on with an existing file")
    monitor = add("monitor", "live estimates")
    monitor.add_argument("--rate", type=float, default=20.0, metavar="HZ", help="default 20")
    monitor.add_argument("--seconds", type=float, metavar="S", help="stop after (default: Ctrl-C)")
    monitor.add_argument("--truth", type=Path, metavar="FILE", help="recording in the emulator")
    monitor.add_argument("--target", help="column of the truth (default: the model's output)")
    monitor.add_argument("--web", nargs="?", const=0, type=int, metavar="PORT", help="as a page")
    monitor.add_argument("--csv", metavar="FILE", help="as rows; - is stdout")
    flash = add("flash", "put the firmware with a model on a board", port=False)
    flash.add_argument("out", type=Path, metavar="OUT", help="folder that build or export wrote")
    flash.add_argument("--board", required=True, help="a folder of firmware/ports")
    flash.add_argument("--port", default="", help="serial path, where the board's tool needs one")


def run(args: argparse.Namespace, console: Console) -> int:
    """Run one action."""
    import signal

    from softsense.device import actions
    from softsense.device.emulator import terminate_on

    terminate_on(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    action = getattr(actions, args.action if args.action != "list" else "list_ports")
    code: int = action(args, console)
    return code
