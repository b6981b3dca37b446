"""`ribbonbench sweep`: a grid of scenes, in parallel on one machine or, under mpiexec, on a cluster."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.page.verdict import Verdict
    from compare.sweep.file import Sweep
    from compare.sweep.shard import Shard
    from compare.sweep.workers import Crew

HELP = "run a grid of scenes in parallel, also under mpiexec; a killed sweep goes on"
EXAMPLE = "ribbonbench sweep my.toml --vary 'strip.length=linear(0.1,0.5,9)'"
PARALLEL = True


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "sweep", metavar="SWEEP", help="name of a shipped sweep, or a sweep's file; or a scene, with --vary"
    )
    parser.add_argument(
        "--vary", action="append", default=[], metavar="KEY=VALUES",
        help="an axis: strip.gamma=10,100 or =1:100:12 or =log(1,1e4,9); of vectors =[0,0,0.9],[0,0,0.8] or "
        "=[0,0,0.9]:[0,0,0.8]:5 (repeatable; replaces the file's axis of this key)",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments",
        help="replace a key of the scene at every point (repeatable)",
    )  # fmt: skip
    parser.add_argument(
        "--solver", metavar="NAME", default=None,
        help="what runs at each point: a model (ribbon, elastica, shell, ...) or compare (default: the file's, or the "
        "model that the scene's model.energy names)",
    )  # fmt: skip
    parser.add_argument("--errors", action="store_true", help="measure each discretisation error too (slower)")
    common.leave_saddle_argument(parser)
    parser.add_argument("--show", metavar="COLUMN", default=None, help="quantity in the picture, e.g. end.z")
    parser.add_argument(
        "--against", metavar="COLUMN", default=None, help="quantity on the picture's horizontal axis, e.g. gamma"
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", default=None,
        help="cases at once on this machine (default: the usable cores); under mpiexec its processes but one",
    )  # fmt: skip
    parser.add_argument(
        "--shard", metavar="K/N", default=None,
        help="only part K of N, for a job of an array: 1/64 to 64/64, each with an --out of its own",
    )  # fmt: skip
    parser.add_argument(
        "--join", nargs="+", metavar="FOLDER", default=None,
        help="put the parts together that --shard has left in these folders; nothing is solved that they lack",
    )  # fmt: skip
    parser.add_argument(
        "--table", choices=("csv", "parquet"), default=None,
        help="cases.csv, or parts of Parquet in table/ (default: csv up to 100,000 cases of the grid)",
    )  # fmt: skip
    parser.add_argument(
        "--shapes", type=int, metavar="N", default=None,
        help="keep N points of every centreline: shapes.npy, or parts of Parquet in shapes/",
    )  # fmt: skip
    parser.add_argument(
        "--neighbours",
        action="store_true",
        help="of a table in parts, begin cases at each other's states (quicker, and not always the state found alone)",
    )
    parser.add_argument("--fresh", action="store_true", help="forget the finished cases in the folder")
    common.yes_argument(parser)
    common.units_argument(parser)
    common.out_argument(parser, "out/SWEEP/sweep, with --vary out/SCENE/sweep")
    common.printed_arguments(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Runs the sweep; under mpiexec the first process leads, the others carry cases."""
    from ribbonbench.world import pooled, world

    if pooled():
        return _pooled(options, console)
    processes = world()
    if processes.comm is None:
        return _run(options, console, lambda: _local(options))
    from mpi4py.futures import MPICommExecutor

    from compare.sweep.workers import ClusterCrew, end_beside

    found: tuple[int, Exception | None] = (common.DONE, None)
    with MPICommExecutor(processes.comm, root=0) as executor:
        if executor is not None:
            try:
                found = (_run(options, console, lambda: ClusterCrew(executor, processes.size - 1)), None)
            except Exception as error:
                found = (common.DONE, error)
    end_beside()

    def outcome() -> int:
        code, error = found
        if error is not None:
            raise error
        return code

    return processes.on_first(outcome)


def _pooled(options: argparse.Namespace, console: Console) -> int:
    """Leads the pool of `python -m mpi4py.futures`."""
    from mpi4py import MPI
    from mpi4py.futures import MPIPoolExecutor

    from compare.sweep.workers import ClusterCrew

    with MPIPoolExecutor() as executor:
        return _run(options, console, lambda: ClusterCrew(executor, max(1, MPI.COMM_WORLD.size - 1)))


def _local(options: argparse.Namespace) -> Crew:
    from compare.sweep.workers import LocalCrew
    from ribbonbench.system import cores

    return LocalCrew(options.workers or cores())


def _run(options: argparse.Namespace, console: Console, crew: Callable[[], Crew]) -> int:
    from compare.page.terminal import print_verdict
    from compare.studies.axes import Grid
    from compare.sweep import page as sweep_write
    from compare.sweep.large.stream import CSV, LARGE, MOST, PARQUET
    from compare.sweep.shard import Shard

    if options.workers is not None and not 1 <= options.workers <= 1024:
        raise BadInput("--workers", options.workers, "is not a number of processes", "give 1 or more")
    if options.shard is not None and options.join is not None:
        raise BadInput("--join", options.join[0], "stands beside --shard", "give one or the other")
    shard = Shard() if options.shard is None else Shard.parse(options.shard)
    sweep = _sweep(options)
    common.units_of(options, sweep.scene)
    sweep_write.check_shown(sweep)
    cases = len(Grid(sweep.scene, sweep.axes, MOST))
    kind = options.table or (PARQUET if cases > LARGE else CSV)
    end = (_in_parts if kind == PARQUET else _in_one)(options, sweep, shard, crew)
    if common.spoken(options):
        print_verdict(console, end.verdict)
        for sentence in end.sentences:
            console.print(f"- {sentence}")
        console.print(f"Results: {end.out}")
    return common.DONE if end.ok else common.NOT_CONVERGED


class _End(NamedTuple):
    """What a sweep came to."""

    out: Path
    verdict: Verdict
    sentences: tuple[str, ...]
    ok: bool


def _in_one(options: argparse.Namespace, sweep: Sweep, shard: Shard, crew: Callable[[], Crew]) -> _End:
    """A sweep whose cases are all in memory, with its table in CSV."""
    from compare.sweep import page as sweep_write
    from compare.sweep import run as sweep_run
    from compare.sweep.large.aside import Aside
    from compare.sweep.parted import claimed, only, parts_of

    grid = sweep_run.check(sweep)
    joined = () if options.join is None else parts_of(options.join, sweep)
    own, points = (sweep, grid) if shard.whole else only(sweep, grid, shard)
    out = common.out_folder(options, sweep.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        if not shard.whole:
            claimed(out, sweep, shard, options.fresh)
        part = "" if shard.whole else str(shard)
        shown = None if part else lambda so_far: Aside(sweep_write.draw_so_far, str(out), so_far)
        finished = sweep_run.run(own, points, out, crew(), reporter, options.fresh, part, joined, shown)
        reporter.step("writing tables" if part else "writing tables and the picture")
        page = sweep_write.write(out, finished, options.line)
    return _End(out, sweep_write.answer(finished), page.sentences, finished.ok)


def _in_parts(options: argparse.Namespace, sweep: Sweep, shard: Shard, crew: Callable[[], Crew]) -> _End:
    """A sweep of any number of cases, with its table in parts of Parquet."""
    from compare.sweep.large import stream
    from compare.sweep.large.aside import Aside
    from compare.sweep.large.page import draw_so_far, write
    from compare.sweep.large.parts import check_parquet

    check_parquet()
    grid = stream.grid_of(sweep)
    folders = None if options.join is None else stream.joinable(options.join, sweep, grid)
    out = common.out_folder(options, sweep.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        if folders is None:
            shown = lambda key: Aside(draw_so_far, str(out), sweep, key)  # noqa: E731
            ended = stream.run(sweep, grid, shard, out, crew(), reporter, options.fresh, picture=shown)
        else:
            ended = stream.joined(sweep, grid, out, folders, reporter, options.fresh)
        reporter.step("reading the table and drawing the picture")
        page, verdict, ok = write(out, ended, options.line)
    return _End(out, verdict, page.sentences, ok)


def _sweep(options: argparse.Namespace) -> Sweep:
    from compare.scene.inputs.source import STDIN
    from compare.scene.scene import parse_assignment
    from compare.studies.axes import parse_axis
    from compare.sweep.file import known_solver, load_sweep, of_scene
    from compare.sweep.shapes import checked

    axes = [parse_axis(text) for text in options.vary]
    assigned = dict(parse_assignment(text) for text in options.assignments)
    if options.sweep == STDIN:
        sweep = of_scene(common.loaded(options, STDIN), assigned, axes)
    else:
        sweep = load_sweep(options.sweep, assigned, axes)
    changes: dict[str, Any] = {
        name: value
        for name, value in (
            ("solver", options.solver),
            ("show", options.show),
            ("against", options.against),
            ("errors", options.errors or None),
            ("leave_saddle", common.leaves(options)),
            ("neighbours", options.neighbours or None),
            ("shapes", None if options.shapes is None else checked(options.shapes)),
        )
        if value is not None
    }
    if options.solver is not None:
        known_solver(options.solver, "--solver")
    if options.show is not None and options.against is None:
        changes["against"] = ""  # the file's belongs to what the file shows
    if "show" in changes or "against" in changes:
        changes["curves"] = ()
    return dataclasses.replace(sweep, **changes)
