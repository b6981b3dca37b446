"""`ribbonbench explain`: which effects are on, why, and what each costs."""

from __future__ import annotations

import argparse

from rich.console import Console
from rich.table import Table

from compare.commands import common

HELP = "which effects a scene switches on, why, and what each costs"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Explains."""
    from compare.effects import explain

    scene = common.scene_of(options)
    found = explain(scene)
    if options.quiet:
        return common.DONE
    table = Table(title=f"{scene.title}: effects", title_justify="left")
    for heading in ("effect", "on", "why", "what it adds"):
        table.add_column(heading, overflow="fold")
    table.add_column("measured cost", justify="right")
    for effect in found.effects:
        cost = "" if effect.seconds is None else f"{max(effect.seconds, 0.0) / found.evaluation:.0%} of an evaluation"
        table.add_row(effect.name, "yes" if effect.on else "no", effect.why, effect.adds, cost)
    console.print(table)
    rows = f"{found.constraints} constraints" if found.constraints else "no constraints"
    asked = "energy, gradient, Hessian" + (", constraints and their Jacobian" if found.constraints else "")
    console.print(
        f"Ribbon: {found.formulation} ({found.formulation_why}); {found.unknowns} unknowns, {found.bounds} "
        f"with bounds, {rows}; one evaluation of {asked} {found.evaluation * 1e6:.0f} us."
    )
    console.print(f"Shell: {found.shell}")
    console.print(f"Third opinion: {found.third_opinion}.")
    return common.DONE
