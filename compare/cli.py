"""The command `ribbonbench` as a module: `python -m compare.cli`, and its exit codes by name."""

from __future__ import annotations

from compare.commands.main import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from ribbonbench import start

__all__ = ["BAD_INPUT", "DONE", "MISSING", "NOT_CONVERGED", "main"]

if __name__ == "__main__":
    start.command(main)
