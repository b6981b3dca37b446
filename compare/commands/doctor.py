"""`ribbonbench doctor`: versions, linear algebra, what is missing."""

from __future__ import annotations

import argparse

from rich.console import Console

HELP = "versions, linear algebra, and what is missing with the command that mends it"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--json", action="store_true", help="machine-readable")


def run(options: argparse.Namespace, console: Console) -> int:
    """Examines."""
    from compare.doctor.doctor import main as examine

    return examine(console, as_json=options.json)
