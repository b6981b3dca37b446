"""The commands of `ribbonbench`, one module each, in the order in which the help lists them.

A module has HELP (one line), EXAMPLE (a command line that parses), `register(parser)` (its arguments) and
`run(options, console)` (its exit code). It imports solvers and libraries inside `run`, so that `ribbonbench --help` is
quick. PARALLEL = True: it may run under mpirun. A module that is put beside them is a command, last in the help.
`options.line` is the command line as typed (`compare.commands.line`), for the page of the results.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
from typing import Protocol

from rich.console import Console


class Command(Protocol):
    """What a module of this package offers."""

    HELP: str
    EXAMPLE: str

    def register(self, parser: argparse.ArgumentParser) -> None:
        """Adds the command's arguments."""

    def run(self, options: argparse.Namespace, console: Console) -> int:
        """Does it; returns the exit code."""


#: The commands of the package, in the order of the help.
ORDER = (
    "new",
    "solve",
    "live",
    "compare",
    "shell",
    "limits",
    "cost",
    "converge",
    "report",
    "export",
    "sweep",
    "identify",
    "branches",
    "explain",
    "check",
    "battery",
    "suite",
    "scenes",
    "keys",
    "completion",
    "doctor",
)
#: Modules of this folder that are no commands.
_SHARED = {"common", "line", "lists", "main", "parser"}


def _beside() -> list[str]:
    """The modules of this folder that `ORDER` does not know."""
    found = {place.name for place in pkgutil.iter_modules(__path__) if not place.ispkg}
    return sorted(found - _SHARED - set(ORDER))


NAMES = (*ORDER, *_beside())


def module(name: str) -> Command:
    """The command of this name."""
    return importlib.import_module(f"compare.commands.{name}")  # type: ignore[return-value]


def parallel(name: str) -> bool:
    """Whether the command may run under mpirun."""
    return bool(getattr(module(name), "PARALLEL", False))
