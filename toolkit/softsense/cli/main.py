"""``softsense``: finds the subcommands in this folder and runs one.

A subcommand is a module with ``HELP`` (one line), ``arguments(parser)`` and
``run(args, console) -> int``. Heavy imports belong inside ``run``: ``softsense --help`` reads
every module here.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import sys
from collections.abc import Sequence

from softsense import cli
from softsense.cli.console import Console
from softsense.errors import SoftsenseError

DESCRIPTION = """\
From a recording of soft strain sensors to a verified fixed-point estimator on a
microcontroller, and a diagnosis of why a simulator disagrees with the rig."""

EPILOG = """\
the main job, step by step:
  softsense simulate linear -o rec.csv          a recording of the paper's rig
  softsense rank rec.csv                        which sensors tell most about the strain
  softsense build rec.csv --size 2 -o out/demo  select, train, quantise, generate, verify
  softsense emulate out/demo                    the board on a serial port, without a board
  softsense device monitor --port PORT          live strain from a (real or emulated) board

Every command takes --json. Exit codes: 0 done and good, 1 an error that you can mend,
2 usage, 3 a check ran and failed."""

_NOT_COMMANDS = {"main", "console", "options"}


def build_parser() -> argparse.ArgumentParser:
    """The whole command line, from the modules in this folder."""
    parser = argparse.ArgumentParser(
        prog="softsense",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--json", action="store_true", help="machine-readable result on stdout")
    common.add_argument("--seed", type=int, default=0, help="seed of every random draw (default 0)")
    common.add_argument("-q", "--quiet", action="store_true", help="no progress, only the result")
    for module in sorted(info.name for info in pkgutil.iter_modules(cli.__path__)):
        if module in _NOT_COMMANDS:
            continue
        command = importlib.import_module(f"softsense.cli.{module}")
        sub = commands.add_parser(
            module,
            help=command.HELP,
            description=command.__doc__,
            parents=[common],
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; the result is the process's exit code."""
    parser = build_parser()
    args = parser.parse_args(argv)
    if args.version:
        from importlib.metadata import version

        print(f"softsense {version('softsense')}")
        return 0
    if args.command is None:
        parser.print_help()
        return 2
    console = Console(quiet=args.quiet or args.json)
    try:
        code: int = args.run(args, console)
        sys.stdout.flush()
        return code
    except SoftsenseError as error:
        print(f"softsense {args.command}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"softsense {args.command}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader (head, less) has left: not an error, but Python would print one at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    sys.exit(main())
