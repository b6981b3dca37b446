"""`ribbonbench doctor`: versions, linear algebra, what is missing."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from compare.commands.common import DONE, MISSING

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
    parser.add_argument(
        "--warm",
        action="store_true",
        help="compile now what a first solve would wait for: the ribbon's kernels, the shell's forms (a minute or two)",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Examines, empties the store, or compiles."""
    if options.clean_store:
        return _clean(console)
    if options.warm:
        return _warm(console)
    from compare.commands.installed.doctor import main as examine

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


def _warm(console: Console) -> int:
    """Compiles what is not kept yet, and says what that was."""
    from compare.models.warm import warm
    from compare.store.progress import Reporter

    with Reporter() as reporter:
        done = warm(reporter)
    shell = {True: "the shell's forms are ready", False: "the shell did not answer", None: "no shell is installed"}
    console.print(f"{done.kernels} kernels compiled, {shell[done.shell]}; {done.seconds:.0f} s")
    return DONE if done.shell is not False else MISSING
