"""`ribbonbench doctor`: versions, linear algebra, what is missing."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from compare.commands.common import DONE

HELP = "versions, linear algebra, and what is missing with the command that mends it"
EXAMPLE = "ribbonbench doctor"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--json", action="store_true", help="machine-readable")
    parser.add_argument(
        "--clean-store",
        action="store_true",
        help="remove the finished shells that are kept for all commands",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Examines, or empties the store."""
    if options.clean_store:
        return _clean(console)
    from compare.doctor.doctor import main as examine

    return examine(console, as_json=options.json)


def _clean(console: Console) -> int:
    """Empties the store of finished shells, and says what was in it."""
    from compare.store.shared import shared_store

    store = shared_store(Path())
    count, size = store.size()
    store.clear()
    left = store.size()[0]
    console.print(f"Removed {count - left} finished shells ({size / 1e6:.3g} MB) from {store.root}")
    return DONE
