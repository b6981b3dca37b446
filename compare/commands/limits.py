"""`ribbonbench limits`: where the inextensible model stops being true (thesis, chapter 7)."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.studies.axes import Axis
    from compare.studies.compare import Comparison
    from compare.studies.limits import Finding, Thresholds

HELP = "where the inextensible model stops being true: the shell's stretching, its distance to the ribbon, a verdict"
EXAMPLE = "ribbonbench limits my.toml --quick"

_AXES = {"widths": "strip.width", "gammas": "strip.gamma", "thickness_to_width": "shell.width_to_thickness"}


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)
    parser.add_argument(
        "--quick", action="store_true", help="estimate from the ribbon alone, without a shell (a second or two)"
    )
    parser.add_argument(
        "--clamp", choices=("scene", "edge", "corners", "both"), default="scene",
        help="what clamps hold: as the scene says (default), the whole edge (ribbon's ruling straight), two corners "
        "(ruling free), or both in turn",
    )  # fmt: skip
    parser.add_argument(
        "--vary", action="append", default=[], metavar="KEY=VALUES",
        help="an axis of a grid: values or vectors, FIRST:LAST:COUNT or log(FIRST,LAST,COUNT) (repeatable)",
    )  # fmt: skip
    parser.add_argument(
        "--width-to-thickness", type=ListOf(float), metavar="R,R,...", default=None,
        help="w/h of the shells (default: the scene's)",
    )  # fmt: skip
    parser.add_argument("--thickness-to-width", metavar="X,X,...", help=argparse.SUPPRESS)  # the same as h/w
    parser.add_argument("--widths", metavar="W,W,...", help="a grid over w/l")
    parser.add_argument("--gammas", metavar="G,G,...", help="a grid over Gamma")
    parser.add_argument(
        "--distance", type=float, default=1.0, metavar="PERCENT", help='distance up to which it is "good" (default 1)'
    )
    parser.add_argument(
        "--share", type=float, default=1.0, metavar="PERCENT",
        help='share of stretching in the elastic energy up to which it is "good" (default 1)',
    )  # fmt: skip


def run(options: argparse.Namespace, console: Console) -> int:
    """Studies the scene or the grid."""
    from compare.pages import limits as limits_results
    from compare.studies import limits
    from compare.studies.axes import points

    thresholds = _thresholds(options)
    scene = common.scene_of(options)
    scenes = [scene] if options.clamp == "scene" else [limits.with_clamp(scene, clamp) for clamp in _clamps(options)]
    axes = _axes(options, scene)
    cases = [(point.values, point.scene) for held in scenes for point in points(held, axes)]
    for _, case in cases:
        limits.require_limits(case)
    out = common.out_folder(options, scene.name)
    reporter = Reporter(quiet=options.quiet)
    with common.held(out, reporter.step):
        with reporter:
            findings, comparison = _study(options, thresholds, cases, out, reporter)
        if common.spoken(options):
            with common.telling():  # first the answer, then its files and pictures
                _tell(options, console, findings, thresholds, out)
        limits_results.write(out, findings, comparison, thresholds, options.line)
    return common.DONE if all(finding.ok for finding in findings) else common.NOT_CONVERGED


def _clamps(options: argparse.Namespace) -> tuple[str, ...]:
    return ("edge", "corners") if options.clamp == "both" else (options.clamp,)


def _thresholds(options: argparse.Namespace) -> Thresholds:
    from compare.studies.limits import Thresholds

    for name in ("distance", "share"):
        if not 0.0 < getattr(options, name) < 100.0:
            raise BadInput(f"--{name}", getattr(options, name), "is no percentage", "give one between 0 and 100")
    return Thresholds(options.distance / 100.0, options.share / 100.0)


def _axes(options: argparse.Namespace, scene: Scene) -> list[Axis]:
    """The axes of --vary and of the short options; w/l and h/w are turned into the scene's keys."""
    from compare.studies.axes import Axis, checked, parse_axis

    axes = [parse_axis(text) for text in options.vary]
    for name, key in _AXES.items():
        text = getattr(options, name)
        if text is None:
            continue
        option = f"--{name.replace('_', '-')}"
        axis = parse_axis(f"{key}={text}", option)
        if name == "widths":
            axis = Axis.of(key, [_number(option, v[0]) * scene.strip.length for v in axis.values])
        if name == "thickness_to_width":
            axis = Axis.of(key, [1.0 / _number(option, v[0]) for v in axis.values])
        axes.append(axis)
    if options.width_to_thickness is not None:
        axes.append(checked(Axis.of("shell.width_to_thickness", options.width_to_thickness), "--width-to-thickness"))
    return axes


def _number(option: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0.0:
        raise BadInput(option, value, "is no positive number", f"e.g. {option} 0.01,0.02")
    return float(value)


def _study(
    options: argparse.Namespace,
    thresholds: Thresholds,
    cases: list[tuple[Any, Scene]],
    out: Path,
    reporter: Reporter,
) -> tuple[list[Finding], Comparison | None]:
    from compare.store.shared import shared_store
    from compare.studies import limits

    findings: list[Finding] = []
    comparison: Comparison | None = None
    began = time.perf_counter()
    for number, (values, case) in enumerate(cases):
        if len(cases) > 1:
            left = (time.perf_counter() - began) / number * (len(cases) - number) if number else None
            when = "" if left is None else f", about {left:.0f} s left"
            what = ", ".join(f"{key} = {value}" for key, value in values.items())
            reporter.step(
                f"case {number + 1} of {len(cases)} ({case.shell.clamp} held{', ' if what else ''}{what}){when}"
            )
        if options.quick:
            findings += limits.quick(case, thresholds, values, reporter)
            continue
        found, comparison = limits.study(
            case, shared_store(out), reporter, thresholds, values, leave_saddle=common.leaves(options)
        )
        findings += found
    return findings, comparison if len(cases) == 1 else None


def _tell(
    options: argparse.Namespace, console: Console, findings: list[Finding], thresholds: Thresholds, out: Path
) -> None:
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import limits as limits_results

    units = common.units_of(options, findings[-1].scene) if len({id(f.scene) for f in findings}) == 1 else None
    print_verdict(console, limits_results.answer(findings, units))
    over = limits_results.grid_map(findings)
    if over is not None:
        print_table(console, over)
    if over is None or options.wide:
        print_table(console, limits_results.table(findings), legend=False, wide=options.wide)
    for sentence in limits_results.verdict(findings, thresholds):
        console.print(f"- {sentence}")
    console.print(f"Results: {out}")
    console.file.flush()
