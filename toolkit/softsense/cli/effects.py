"""The catalogue of physical effects: what the simulator can do and the diagnosis looks for."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

from softsense.cli.console import Console

if TYPE_CHECKING:
    from softsense.effects import Effect

HELP = "list the catalogue of physical effects, or explain one"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what ``softsense effects`` takes."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="explain this one")


def run(args: argparse.Namespace, console: Console) -> int:
    """Print the list, or one effect in full."""
    from softsense.effects import all_effects, effect

    chosen = [effect(args.name)] if args.name else list(all_effects().values())
    if args.json:
        print(json.dumps([_plain(one) for one in chosen], indent=1))
    elif args.name:
        _explain(chosen[0], console)
    else:
        width = max(len(one.name) for one in chosen)
        for one in chosen:
            print(f"  {one.name.ljust(width)}  {one.stage.ljust(10)}  {one.mechanism}")
        print("\nsoftsense effects NAME tells equation, source and parameters.")
    return 0


def _plain(one: Effect) -> dict[str, Any]:
    return {
        "name": one.name,
        "stage": one.stage,
        "mechanism": one.mechanism,
        "equation": one.equation,
        "forms": [form for form in one.forms if form],
        "source": one.source,
        "fingerprint": one.fingerprint,
        "parameters": [vars(parameter) for parameter in one.parameters],
    }


def _explain(one: Effect, console: Console) -> None:
    print(f"{one.name} ({one.stage}): {one.mechanism}")
    print(f"  equation     {one.equation}")
    if len(one.forms) > 1:
        print(f"  forms        {', '.join(one.forms)} (the first is the default)")
    print(f"  fingerprint  {one.fingerprint}")
    print(f"  source       {one.source}\n")
    rows = [
        [p.name, p.unit, f"{p.low:g} … {p.high:g}", f"{p.default:g}", p.meaning]
        for p in one.parameters
    ]
    console.table(("parameter", "unit", "typical range", "default", "meaning"), rows)
    print("\nTypical ranges are experience, chosen wide; they are no citation.")
