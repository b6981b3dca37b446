"""`ribbonbench completion`: a script that lets a shell complete commands, options, their values, scenes and keys."""

from __future__ import annotations

import argparse
import sys

from rich.console import Console

from compare.commands import common

HELP = "print a completion script for bash, zsh or fish"
EXAMPLE = "ribbonbench completion bash"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("interpreter", metavar="SHELL", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")


def run(options: argparse.Namespace, console: Console) -> int:
    """Prints the script."""
    from compare.commands.parser import whole
    from compare.scene.begin.completion import script
    from compare.scene.keys import KEYS
    from compare.scene.scene import shipped

    sys.stdout.write(script(options.interpreter, whole(), list(shipped()), KEYS))
    return common.DONE
