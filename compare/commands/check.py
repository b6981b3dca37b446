"""`ribbonbench check`: whether ribbon and shell agree as closely as is claimed."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.studies.agreement.pins import Pin
    from compare.studies.agreement.verdict import Outcome

HELP = "check that ribbon and shell agree as closely as is claimed (pins)"
EXAMPLE = "ribbonbench check my.toml --distance 0.01"
_CLAIMS = ("distance", "share", "slope", "width_to_thickness", "assignments", "leave_saddle", "stay")


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "scene", metavar="WHAT", nargs="?", default=None,
        help="a scene (name or TOML file), or a TOML file of [[agreement]]s (default: those of the shipped scenes)",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments",
        help="replace a key of the scene, e.g. --set 'shell.elements=[40, 4]' (repeatable)",
    )  # fmt: skip
    common.yes_argument(parser)
    common.units_argument(parser)
    common.printed_arguments(parser)
    common.out_argument(parser, "out/SCENE/check, of a file of pins out/check")
    common.leave_saddle_argument(parser)
    parser.add_argument(
        "--distance", type=float, metavar="X", default=None, help="claim: Hausdorff distance over length at most X"
    )
    parser.add_argument(
        "--share", type=float, metavar="X", default=None, help="claim: membrane share of the elastic energy at most X"
    )
    parser.add_argument(
        "--slope", type=ListOf(float, 2), metavar="LOW,HIGH", default=None,
        help="claim: slope of log(distance) against log(h/w), over two w/h or more",
    )  # fmt: skip
    parser.add_argument(
        "--width-to-thickness", type=ListOf(float), metavar="R,R,...", default=None,
        help="w/h of the shells (default: the scene's)",
    )  # fmt: skip
    parser.add_argument("--pin", action="store_true", help="measure, and write the claims that hold: agreements.toml")
    parser.add_argument("--all", action="store_true", help="check the long pins of a file too (validate = true)")


def run(options: argparse.Namespace, console: Console) -> int:
    """Checks, or pins."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import check as check_page
    from compare.store.shared import shared_store
    from compare.studies.agreement.pins import is_pins
    from compare.studies.agreement.verdict import check

    pins = _pins(options)
    for pin in pins:
        common.units_of(options, pin.scene)
    out = common.out_folder(options, "" if options.scene is None or is_pins(options.scene) else pins[0].scene.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        store = shared_store(out)
        outcomes: list[Outcome] = []
        for pin in pins:
            reporter.step(f"check: {pin.label}")
            outcomes.append(check(pin, store, reporter))
        written = check_page.write(out, outcomes, options.line, pinned=options.pin)
    if common.spoken(options):
        print_verdict(console, check_page.answer(outcomes, options.pin))
        print_table(console, check_page.table(outcomes, options.pin), wide=options.wide)
        for sentence in check_page.sentences(outcomes, options.pin):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}" + (f"; pins: {written}" if written is not None else ""))
    agreed = all(found.agreed for found in outcomes)
    return common.DONE if agreed else common.NOT_CONVERGED


def _pins(options: argparse.Namespace) -> list[Pin]:
    """What is to be checked; `BadInput` for claims beside a file of pins, and for none beside a scene."""
    from compare.studies.agreement.pins import SHIPPED, Pin, is_pins, read_pins

    if options.scene is None or is_pins(options.scene):
        for name in _CLAIMS:
            if getattr(options, name):
                flag = "--set" if name == "assignments" else f"--{name.replace('_', '-')}"
                raise BadInput(flag, None, "is for a scene, and a file of pins has its own claims", "leave it out")
        if options.pin:
            raise BadInput("--pin", None, "is for a scene: it writes a file of pins", "give a scene")
        pins = read_pins(SHIPPED if options.scene is None else options.scene)
        chosen = [pin for pin in pins if options.all or not pin.validate]
        if not chosen:
            raise BadInput("FILE", str(options.scene), "has long pins only (validate = true)", "give --all")
        return chosen
    from compare.scene.scene import parse_assignment

    keys = dict(parse_assignment(text) for text in options.assignments)
    distance, share, slope = options.distance, options.share, options.slope
    if options.pin:
        if distance is not None or share is not None or slope is not None:
            raise BadInput("--pin", None, "finds the claims itself", "leave out --distance, --share and --slope")
        distance, share = 10.0, 1.0
    where = "--"
    scene = common.loaded(options, options.scene)
    return [
        Pin.of(
            scene, distance, share, slope, options.width_to_thickness, keys, common.leaves(options), where=where,
        )
    ]  # fmt: skip
