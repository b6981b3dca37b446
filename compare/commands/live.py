"""`ribbonbench live`: a strip in the hand, on a page of this machine."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.commands.line import recorded
from ribbonbench.start import Terminated

if TYPE_CHECKING:
    from compare.pages.live.desk import Beginning, Desk

HELP = "a strip in the hand: a page with sliders, answering while they move"
EXAMPLE = "ribbonbench live two_clamps_5_3_2"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.one_scene_arguments(parser)
    common.out_argument(parser)
    parser.add_argument("--no-browser", action="store_true", help="print the address, open no browser")
    common.quiet_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Serves the page until ctrl-C."""
    from compare.pages.live.page import document
    from compare.pages.live.server import Live

    scene = common.scene_of(options)
    units = common.units_of(options, scene)
    out = common.out_folder(options, scene.name)
    begun: list[Beginning] = []

    def begin() -> Desk:
        from compare.pages.live.desk import Beginning, Desk

        if not begun:
            begun.append(Beginning.of(scene, units))
        return Desk(begun[0], out, _again)

    page, headers = document(scene)
    live = Live(page, headers, begin)
    console.print(f"{live.address}", highlight=False, soft_wrap=True)
    if not options.quiet:
        console.print("The page answers as long as this runs; ctrl-C ends it. What is kept:", out)
    console.file.flush()
    if not options.no_browser:
        import webbrowser

        webbrowser.open(live.address)
    try:
        live.serve()
    except Terminated:
        raise
    except KeyboardInterrupt:
        if not options.quiet:
            print("ribbonbench: the page is closed", file=sys.stderr)
    return common.DONE


def _again(path: Path) -> str:
    """The command line that solves a kept scene."""
    return recorded(["solve", str(path.resolve())])
