"""`ribbonbench scenes`: the shipped scenes."""

from __future__ import annotations

import argparse

from rich.console import Console
from rich.table import Table

from compare.commands import common

HELP = "list the shipped scenes"


def register(parser: argparse.ArgumentParser) -> None:
    """No arguments."""


def run(options: argparse.Namespace, console: Console) -> int:
    """Lists."""
    from compare.scene.scene import load, shipped

    table = Table(title="Shipped scenes", title_justify="left")
    table.add_column("name", no_wrap=True)
    for heading in ("title", "w/l", "K l", "Gamma", "energy", "elements", "shell w/h"):
        table.add_column(heading, overflow="fold")
    for name in shipped():
        scene = load(name)
        start, end = scene.curvature
        table.add_row(
            name,
            scene.title,
            f"{scene.width:g}",
            f"{start:g}" if start == end else f"{start:g} to {end:g}",
            f"{scene.gamma:.4g}",
            scene.model.energy,
            str(len(scene.model.lengths)),
            ", ".join(f"{r:g}" for r in scene.require_shell()) if scene.has_shell() else "-",
        )
    console.print(table)
    return common.DONE
