"""`ribbonbench export`: surfaces of results, or of a scene's own model, in other programs' formats."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.strips.scene import StripsScene

HELP = "surfaces of results (or of a scene, solved first) as VTU, PVD, OBJ, PLY, glTF, CSV, NPZ"
EXAMPLE = "ribbonbench export my.toml --format gltf,obj"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "source", metavar="SOURCE", help="a folder of results, or a scene (shipped name or TOML file), solved first"
    )
    parser.add_argument(
        "--format", default=None, metavar="F,F", dest="formats",
        help="formats, with commas: vtu, pvd, obj, ply, gltf, csv, npz (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments",
        help="of a scene: replace a key, e.g. --set strip.gamma=50 (repeatable)",
    )  # fmt: skip
    parser.add_argument(
        "--scale", default=None, metavar="X",
        help="lengths of the files times X (1000: mm of m), or l for a strip of length 1 (default: metres where the "
        "scene gives SI, otherwise the unit of strip.length)",
    )  # fmt: skip
    parser.add_argument(
        "--to", default=None, metavar="PROGRAM", dest="program",
        choices=("mujoco", "pyelastica", "exudyn", "newton", "usd"),
        help="of a scene clamped at one end: a model for mujoco, pyelastica, exudyn, newton or usd, no surfaces",
    )  # fmt: skip
    common.out_argument(parser, "SOURCE/export, of a scene out/SCENE/export")
    common.printed_arguments(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Exports."""
    if options.program is not None:
        return _to_program(options, console)
    from compare.page.terminal import print_table, print_verdict
    from compare.pages.export.scale import Scale
    from compare.pages.export.source import answer, chosen, read_source, results_in, scaled, sizes, write, write_page_of
    from compare.store.store import check_writable

    formats = chosen(options.formats)
    Scale.of({}, options.scale)  # a number, before anything is solved
    folder, code = Path(options.source), common.DONE
    with Reporter(quiet=options.quiet) as reporter:
        beside = folder / "export"
        if not folder.is_dir():
            folder, code = _solved(options, reporter)
            beside = folder.parent / "export"
        elif options.assignments:
            raise BadInput("--set", options.assignments[0], "changes a scene, and SOURCE is a folder of results")
        source = read_source(results_in(folder))
        source = scaled(source, Scale.of(source.result, options.scale))
        out = check_writable(options.out if options.out is not None else beside)
        if out.resolve() == folder.resolve():
            raise BadInput("--out", str(out), "is the folder of the results itself", "give another folder")
        options.results = out
        with common.held(out, reporter.step):
            reporter.step(f"writing {len(source.surfaces)} surfaces as {', '.join(formats)}")
            files = write(out, source, formats)
            write_page_of(out, source, files, options.line)
    if common.spoken(options):
        print_verdict(console, answer(source, files))
        print_table(console, replace(sizes(out, files), title=source.page.title), wide=options.wide)
        if "npz" in formats and not source.ribbon and source.has_ribbon:
            console.print("The folder has no ribbon.npz: the ribbon's own segments are left out.")
        console.print(source.scale.words)
        console.print(f"Files: {out}")
    return code


def _to_program(options: argparse.Namespace, console: Console) -> int:
    """A scene, solved, as a model of another program."""
    from compare.models import solve
    from compare.page.study import Study
    from compare.pages.export.programs import PROGRAMS, exported
    from compare.store.provenance import versions
    from compare.store.store import atomic_write_text, check_writable

    for given, option in ((options.formats, "--format"), (options.scale, "--scale")):
        if given is not None:
            raise BadInput(option, given, "is of surfaces, and --to writes a model", "leave one of the two out")
    if Path(options.source).is_dir():
        raise BadInput("SOURCE", options.source, "is a folder of results", "--to wants a scene")
    options.scene = options.source
    scene = common.scene_of(options)
    with Reporter(quiet=options.quiet) as reporter:
        state = solve(scene, say=reporter)
        if state.shape is None:
            raise BadInput("SOURCE", options.source, f"has no shape to start from: {state.message}", "mend the scene")
        item = exported(scene, state.shape)
    name, text = PROGRAMS[options.program]
    out = check_writable(options.out if options.out is not None else common.OUT / scene.name / options.command)
    options.results = out
    with common.held(out):
        file = atomic_write_text(out / name, text(item))
        told = f"A model of {item.elements} elements for {options.program}, in {item.unit}."
        files = {"result.json": "what it is of", name: "the model"}
        result = {"to": options.program, "file": name, "elements": item.elements, "units": item.unit}
        study = Study("export", scene.title or scene.name, sentences=(told,), files=files)
        study.write(out, {**result, "status": state.word, "provenance": versions()}, options.line, scene)
    if common.spoken(options):
        console.print(f"{told}\nFile: {file}", markup=False)
    return common.DONE if state.ok else common.NOT_CONVERGED


def _solved(options: argparse.Namespace, reporter: Reporter) -> tuple[Path, int]:
    """The folder into which the scene was solved, and the exit code of that."""
    from compare.commands.solve import solve_into
    from compare.models.choice import chosen
    from compare.pages.presenter import presenter_of
    from compare.scene.inputs.source import STDIN, near, shipped_strips
    from compare.scene.scene import parse_assignment, shipped

    if options.source not in (STDIN, *shipped(), *shipped_strips()) and not Path(options.source).is_file():
        raise BadInput(
            "SOURCE", options.source, "is neither a folder nor a scene",
            f"{near(Path(options.source))}give a folder of results, a TOML file or the name of a shipped scene",
        )  # fmt: skip
    options.scene = options.source
    several = common.strips_of(options)
    if several is not None:
        return _strips_solved(several, options, reporter)
    scene = common.loaded(options, options.source)
    keys = dict(parse_assignment(text) for text in options.assignments)
    scene = scene.replace(keys) if keys else scene
    refused = presenter_of(chosen(scene)).no_surface(scene)
    if refused is not None:
        raise refused
    parent = None if options.out is None else Path(options.out) / "solve"
    options.scene, options.leave_saddle, options.stay, options.time = options.source, False, False, False
    requested = argparse.Namespace(**{**vars(options), "out": parent, "command": "solve"})
    folder = common.out_folder(requested, scene.name)
    options.line = requested.line
    with common.held(folder, reporter.step):
        state = solve_into(folder, scene, reporter, options)
    return folder, common.DONE if state.ok else common.NOT_CONVERGED


def _strips_solved(scene: StripsScene, options: argparse.Namespace, reporter: Reporter) -> tuple[Path, int]:
    """The folder into which several strips were solved, and the exit code of that."""
    from compare.commands.solve import strips_into

    parent = None if options.out is None else Path(options.out) / "solve"
    options.leave_saddle, options.stay = False, False
    folder = common.out_folder(argparse.Namespace(**{**vars(options), "out": parent, "command": "solve"}), scene.name)
    with common.held(folder, reporter.step):
        state = strips_into(folder, scene, reporter, options)
    return folder, common.DONE if state.ok else common.NOT_CONVERGED
