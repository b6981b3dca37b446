"""`ribbonbench identify`: keys of a scene from measured points."""

from __future__ import annotations

import argparse

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter

HELP = "fit keys of a scene (Young's modulus, natural curvature, ...) to measured points of its centreline"
EXAMPLE = "ribbonbench identify my.toml points.csv --free strip.young"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    parser.add_argument(
        "points", metavar="POINTS",
        help="CSV file with the columns x, y, z and, if known, s, in the unit of strip.length and the scene's own axes",
    )  # fmt: skip
    parser.add_argument(
        "--unit", metavar="UNIT",
        help="unit of the points: m, cm, mm, in (strip.length in m), or how many units of strip.length it is",
    )  # fmt: skip
    parser.add_argument(
        "--register", action="store_true",
        help="the points stand in axes of their own: find their rigid motion (shift and turn) together with the keys",
    )  # fmt: skip
    parser.add_argument(
        "--free", metavar="KEY,KEY", required=True,
        help="keys to fit, e.g. strip.young,strip.natural_curvature (also gamma, density, poisson, thickness, width)",
    )  # fmt: skip
    common.out_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Fits and says what was found."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import identify as page
    from compare.studies.fit.points import unit_of
    from compare.studies.identify import check_free, identify, read_points

    scene = common.scene_of(options)
    free = check_free(scene, options.free.split(","))
    unit = unit_of(options.unit)
    points = read_points(options.points, scene.strip.length, unit)
    out = common.out_folder(options, scene.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        reporter.step(f"fitting {len(free)} keys to {len(points.places)} points")
        fit = identify(scene, points, free, register=options.register, unit=unit)
        reporter.step("writing results")
        page.write(out, fit, options.line)
    if common.spoken(options):
        print_verdict(console, page.answer(fit))
        print_table(console, page.table(fit), wide=options.wide)
        for sentence in page.sentences(fit):
            console.print(sentence)
        console.print(f"Files: {out}")
    return common.DONE if fit.passes else common.NOT_CONVERGED
