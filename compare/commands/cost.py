"""`ribbonbench cost`: error against time for every solver of a scene."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from pathlib import Path

    from compare.scene.scene import Scene
    from compare.studies.cost_plan import Plan

HELP = "what accuracy costs: error against time for every model of a scene"
_REPEATS = 3
EXAMPLE = "ribbonbench cost cantilever --segments 10,20,40"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)
    parser.add_argument(
        "--solvers", nargs="+", metavar="NAME,NAME,...", default=None,
        help="of chained, mixed, placed (segments by tolerance), elastica, shell (default: all that the scene allows)",
    )  # fmt: skip
    parser.add_argument("--segments", type=ListOf(int), metavar="P,P,...", default=None, help="sizes of the ribbons")
    parser.add_argument(
        "--tolerances", type=ListOf(float), metavar="X,X,...", default=None, help="tolerances of the placed ribbon"
    )
    parser.add_argument(
        "--meshes", type=ListOf(str), metavar="AxB,AxB,...", default=None, help="meshes of the shell: 50x4,100x8"
    )
    parser.add_argument(
        "--elastica-elements", type=ListOf(int), metavar="N,N,...", default=None, help="sizes of the elastica"
    )
    parser.add_argument(
        "--width-to-thickness", type=float, metavar="R", default=None,
        help="w/h of the shell (default: the scene's largest)",
    )  # fmt: skip
    parser.add_argument(
        "--reference", default=None, metavar="MODEL",
        help="the common reference: shell, ribbon, elastica, or own for none (default: shell, without one ribbon)",
    )  # fmt: skip
    parser.add_argument(
        "--target", type=ListOf(float), metavar="X,X,...", default=None, dest="targets",
        help="errors over l whose times are asked for (default 1e-2 1e-3 1e-4)",
    )  # fmt: skip
    parser.add_argument(
        "--repeats", type=int, default=_REPEATS, metavar="N", help="timed runs of each size (default 3)"
    )
    parser.add_argument(
        "--budget", type=float, default=None, metavar="SECONDS", help="begin no new run after this time (default 180)"
    )
    parser.add_argument("--compilation", action="store_true", help="also time first calls that compile everything")
    parser.add_argument("--fresh", action="store_true", help="measure again what an earlier run has measured")


def run(options: argparse.Namespace, console: Console) -> int:
    """Measures."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import cost as cost_write
    from compare.studies.cost import measure

    scene = common.scene_of(options)
    plan = _plan(options, scene)
    out = common.out_folder(options, scene.name)
    if not options.wide and plan.ratio is not None and _asks_for_nothing(options):
        return _models(options, console, scene, plan.ratio, out)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        cost = measure(scene, plan, out / "cases", reporter, fresh=options.fresh)
        reporter.step("writing tables and the picture")
        cost_write.write(out, cost, options.line)
    if common.spoken(options):
        print_verdict(console, cost_write.answer(cost))
        for found in (cost_write.table(cost), cost_write.reach_table(cost)):
            print_table(console, found, wide=options.wide)
        for sentence in cost_write.sentences(cost):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}")
    return common.DONE if cost.ok else common.NOT_CONVERGED


#: Options by which the whole measurement is asked for.
_WHOLE = ("solvers", "segments", "tolerances", "meshes", "elastica_elements", "reference", "targets", "budget")


def _asks_for_nothing(options: argparse.Namespace) -> bool:
    """Whether no option of the whole measurement is given."""
    given = any(getattr(options, name) is not None for name in _WHOLE) or options.repeats != _REPEATS
    return not (given or options.compilation or options.fresh or common.leaves(options) is not None)


def _models(options: argparse.Namespace, console: Console, scene: Scene, ratio: float, out: Path) -> int:
    """The short answer: every model that reads the scene, by total error."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages.models import cost as page
    from compare.studies.priced.models import measure_models

    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        costs = measure_models(scene, ratio, out / "cases", reporter)
        reporter.step("writing tables and the picture")
        page.write(out, costs, options.line)
    if common.spoken(options):
        print_verdict(console, page.answer(costs))
        print_table(console, page.table(costs))
        for sentence in page.sentences(costs):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}")
    return common.DONE if costs.base.ok else common.NOT_CONVERGED


def _plan(options: argparse.Namespace, scene: Scene) -> Plan:
    """The plan that the options ask for; `BadInput` names the option that cannot be."""
    from compare.models import names
    from compare.models.choice import measure_of_all
    from compare.studies.cost_plan import OWN, Plan, chosen, families

    changes: dict[str, object] = {"leave_saddle": common.leaves(options), "compilation": options.compilation}
    known = families(scene)
    requested = [name for words in options.solvers or [] for name in words.strip("[]").replace(",", " ").split()]
    _chosen("--solvers", requested, known)
    changes["solvers"] = tuple(s for s in known if s in (requested or known))
    for name, least, most in (("segments", 2, 2000), ("elastica_elements", 2, 5000)):
        values = getattr(options, name)
        if values is not None:
            flag = f"--{name.replace('_', '-')}"
            for value in values:
                if not least <= value <= most:
                    raise BadInput(flag, value, "is not a size", f"give whole numbers from {least} to {most}")
            changes[name] = tuple(sorted(set(values)))
    if options.meshes is not None:
        changes["meshes"] = tuple(dict.fromkeys(_mesh(text) for text in options.meshes))
    if options.tolerances is not None:
        changes["tolerances"] = _fractions("--tolerances", options.tolerances, 0.1)
    if options.targets is not None:
        changes["targets"] = _fractions("--target", options.targets, 1.0)
    if options.repeats < 1:
        raise BadInput("--repeats", options.repeats, "is no number of runs", "give 1 or more")
    changes["repeats"] = options.repeats
    if options.budget is not None:
        if not (math.isfinite(options.budget) and options.budget > 0.0):
            raise BadInput("--budget", options.budget, "is no time", "give seconds, above zero")
        changes["budget"] = options.budget
    changes["ratio"] = _ratio(options, scene)
    if options.reference is not None:
        _chosen("--reference", [options.reference], (*names(), OWN))
    plan = Plan(**changes)  # type: ignore[arg-type]
    entries, _ = chosen(scene, plan)
    usual = measure_of_all([entry.model.name for entry in entries])
    return replace(plan, reference=options.reference or usual)


def _ratio(options: argparse.Namespace, scene: Scene) -> float | None:
    """w/h of the shell: of the option, or the scene's largest; None where the scene has no shell."""
    from compare.models.scope import has_shell, require_shell

    requested = options.width_to_thickness
    if requested is None:
        return max(require_shell(scene)) if has_shell(scene) else None
    if not (math.isfinite(requested) and requested > 1.0):
        raise BadInput("--width-to-thickness", requested, "is no w/h of a shell", "give a number above 1")
    require_shell(scene.replace({"shell.width_to_thickness": [requested]}))
    return float(requested)


def _chosen(option: str, values: list[object], known: tuple[str, ...]) -> None:
    for value in values:
        if value not in known:
            raise BadInput(option, value, "is not known", f"choose from {', '.join(known)}")


def _fractions(option: str, values: list[float], most: float) -> tuple[float, ...]:
    for value in values:
        if not 0.0 < value < most:
            raise BadInput(option, value, "is no error over l", f"give numbers above 0 and below {most:g}")
    return tuple(sorted(set(values), reverse=True))


def _mesh(text: str) -> tuple[int, int]:
    """The mesh of e.g. "100x8"."""
    along, cross, across = text.lower().partition("x")
    if not cross or not (along.isdecimal() and across.isdecimal()) or int(along) < 1 or int(across) < 1:
        raise BadInput("--meshes", text, "is not ALONGxACROSS", "e.g. --meshes 50x4 100x8")
    return int(along), int(across)
