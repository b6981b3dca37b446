"""`ribbonbench solve`: the ribbon alone, or the elastica."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.base import State
    from compare.models.strips.solve import StripsState
    from compare.scene.scene import Scene
    from compare.scene.strips.scene import StripsScene
    from compare.studies.branches.states import States

HELP = "solve the model of a scene alone: the ribbon, or what model.energy names"
EXAMPLE = "ribbonbench solve my.toml --set strip.natural_curvature=5"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)
    parser.add_argument("--time", action="store_true", help="solve again and again for its warm time (median)")
    parser.add_argument(
        "--all", action="store_true",
        help="also look for other equilibria, stable or not: from images of its shape, random starts and by deflation",
    )  # fmt: skip


def run(options: argparse.Namespace, console: Console) -> int:
    """Solves the scene."""
    from compare.pages.solve import write

    several = common.strips_of(options)
    if several is not None:
        return _strips(several, options, console)
    scene = common.scene_of(options)
    if options.all:
        from compare.studies.branches.states import able

        able(scene)
    out = common.out_folder(options, scene.name)
    reporter = Reporter(quiet=options.quiet)
    with common.held(out, reporter.step):
        with reporter:
            state = solved(out, scene, reporter, options)
            seen = others(scene, reporter) if options.all else None
        if common.spoken(options):
            with common.telling():  # first the answer, then what is loaded and drawn for its files
                say(out, scene, state, console, options, seen)
        write(out, scene, state, options.line, seen)
    return common.DONE if state.ok else common.NOT_CONVERGED


def _strips(scene: StripsScene, options: argparse.Namespace, console: Console) -> int:
    """Solves a scene of several strips."""
    from compare.models.strips.build import check_model
    from compare.page.terminal import print_pairs, print_table, print_verdict
    from compare.pages.strips.page import answer, rows, tables
    from compare.scene.units import Units

    for option, asked in (("--all", options.all), ("--time", options.time)):
        if asked:
            raise BadInput(option, None, "is not known for several strips", "leave it out")
    check_model(scene)
    units = Units.asked(scene.first.strip, options.units)
    out = common.out_folder(options, scene.name)
    reporter = Reporter(quiet=options.quiet)
    with common.held(out, reporter.step):
        with reporter:
            state = strips_into(out, scene, reporter, options)
        if common.spoken(options):
            with common.telling():
                print_verdict(console, answer(state, units))
                print_pairs(console, scene.title, [*rows(state, units), ("results", str(out))])
                if options.wide:
                    for table in tables(state):
                        print_table(console, table, wide=True)
                console.print(f"As a page: ribbonbench report {out}")
                console.file.flush()
    return common.DONE if state.ok else common.NOT_CONVERGED


def strips_into(out: Path, scene: StripsScene, reporter: Reporter, options: argparse.Namespace) -> StripsState:
    """Solves a scene of several strips and writes its files into the folder `out`."""
    from compare.models.strips.solve import solved as strips_solved
    from compare.pages.strips.page import write

    reporter.step(f"{len(scene.names)} strips")
    state = strips_solved(scene, common.leaves(options) is not False, reporter.step)
    reporter.step("writing results")
    write(out, state, options.line)
    return state


def others(scene: Scene, reporter: Reporter) -> States:
    """Other equilibria of the scene's own model."""
    from compare.studies.branches.states import states

    reporter.step("other equilibria: images of its shape, random starts, deflation")
    return states(scene, say=reporter)


def say(
    out: Path, scene: Scene, state: State, console: Console, options: argparse.Namespace, seen: States | None = None
) -> None:
    """The answer on the terminal; `out`: where its files will be; seen: other equilibria, where they were asked for."""
    from compare.page.terminal import print_pairs, print_table, print_verdict
    from compare.pages.solve import answer, numbers, rows, sentences

    units = common.units_of(options, scene)
    print_verdict(console, answer(scene, state, units))
    print_pairs(console, scene.title, [*rows(scene, state, units), ("results", str(out))])
    if options.wide:
        print_table(console, numbers(scene, state, units), wide=True)
    if seen is not None:
        from compare.pages.branches import states as pages_states

        print_table(console, pages_states.table(seen, units), wide=options.wide)
        for sentence in pages_states.sentences(seen, units):
            console.print(f"- {sentence}")
    for sentence in sentences(scene, state)[1:]:  # what to do; the first one says what the table says
        console.print(sentence)
    console.print(f"As a page: ribbonbench report {out}")
    console.file.flush()


def solved(out: Path, scene: Scene, reporter: Reporter, options: argparse.Namespace) -> State:
    """The state of the scene by its own model; a path keeps its steps in the folder `out`."""
    from compare.models.base import Options, check_keys
    from compare.models.choice import chosen
    from compare.store.shared import shared_store
    from compare.studies.thickness import with_thickness

    model = chosen(scene)
    check_keys(model, scene)
    repeats = None if options.time else 0
    requested = Options(leave_saddle=common.leaves(options), error=True, repeats=repeats, store=shared_store(out))
    return with_thickness(scene, model.solve(scene, options=requested, say=reporter), reporter)


def solve_into(out: Path, scene: Scene, reporter: Reporter, options: argparse.Namespace) -> State:
    """Solves the scene's own model and writes its files into the folder `out`."""
    from compare.pages.solve import write

    state = solved(out, scene, reporter, options)
    reporter.step("writing results")
    write(out, scene, state, options.line)
    return state
