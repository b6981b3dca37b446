"""`ribbonbench scenes`: the shipped scenes, or the text of one."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from rich.console import Console

from compare.commands import common
from compare.page.table import Column, Table

HELP = "list the shipped scenes, or print one of them"
EXAMPLE = "ribbonbench scenes curl_4_3"


_COLUMNS = (
    Column("name", "name", rank=0),
    Column("title", "title", kind="word", rank=1),
    Column("width", "w/l", kind="digits:4", rank=2),
    Column("curvature", "K l", kind="interval", rank=4),
    Column("gamma", "Gamma", kind="digits:4", rank=3),
    Column("energy", "energy", kind="word", rank=6),
    Column("elements", "elements", kind="integer", rank=7),
    Column("width_to_thickness", "shell w/h", kind="word", rank=5),
)


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "name", metavar="NAME", nargs="?", default=None,
        help="print this scene as it is, TOML with comments: ribbonbench scenes curl_4_3 > my.toml",
    )  # fmt: skip
    common.wide_argument(parser)
    common.json_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Lists, or prints one."""
    from compare.models.scope import has_shell, require_shell
    from compare.page.terminal import print_table
    from compare.scene.inputs.law import values
    from compare.scene.inputs.source import shipped_strips
    from compare.scene.scene import load, shipped, text_of_shipped
    from compare.scene.strips import read as strips

    if options.name is not None:
        text = text_of_shipped(options.name)
        options.result = {"name": options.name, "scene": text}
        if not options.json:
            sys.stdout.write(text)
        return common.DONE
    rows: list[tuple[Any, ...]] = []
    for name in shipped():
        scene = load(name)
        start, *rest = values(scene.curvature)
        curvature = start if all(k == start for k in rest) else (start, *rest)
        shells = ", ".join(f"{r:g}" for r in require_shell(scene)) if has_shell(scene) else None
        elements = len(scene.model.lengths)
        rows.append((name, scene.title, scene.width, curvature, scene.gamma, scene.model.energy, elements, shells))
    for name, file in shipped_strips().items():
        several = strips.loads(file.read_text(encoding="utf-8"), str(file))
        first = several.first
        rows.append(
            (name, several.title, first.width, None, first.gamma, first.model.energy, first.model.elements, None)
        )
    table = Table("Shipped scenes", _COLUMNS, tuple(rows))
    options.result = table.records()
    if not options.json:
        print_table(console, table, wide=options.wide)
    return common.DONE
