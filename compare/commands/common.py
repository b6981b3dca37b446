"""What commands share: exit codes, the scene with its assignments, the folder for results held by one run at a time."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from compare.commands.line import fed
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.scene.strips.scene import StripsScene
    from compare.scene.units import Units

DONE, NOT_CONVERGED, BAD_INPUT, MISSING = 0, 1, 2, 3

#: Where results go without --out.
OUT = Path("out")
#: Values of --units.
UNITS = ("auto", "si", "l")


def scene_arguments(parser: argparse.ArgumentParser) -> None:
    """SCENE, --set, --yes, --units, --quiet, --wide."""
    one_scene_arguments(parser)
    printed_arguments(parser)


def one_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """SCENE, --set, --yes, --units."""
    parser.add_argument(
        "scene", metavar="SCENE", help="name of a shipped scene, path of a TOML file, or - for the standard input"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments",
        help="replace a key of the scene, e.g. --set strip.gamma=50 (repeatable)",
    )  # fmt: skip
    yes_argument(parser)
    units_argument(parser)


def yes_argument(parser: argparse.ArgumentParser) -> None:
    """--yes."""
    parser.add_argument(
        "--yes", action="store_true",
        help="compute also what looks like a slip of units, or takes hours or much memory",
    )  # fmt: skip


def printed_arguments(parser: argparse.ArgumentParser) -> None:
    """--quiet, --wide and --json: what is printed."""
    quiet_argument(parser)
    wide_argument(parser)
    json_argument(parser)


def units_argument(parser: argparse.ArgumentParser) -> None:
    """--units."""
    parser.add_argument(
        "--units", choices=UNITS, default="auto",
        help="what numbers are told in: si (mm, N, J; the scene gives strip.young), l (of the length, without "
        "dimensions), auto: si where it is known (default)",
    )  # fmt: skip


def quiet_argument(parser: argparse.ArgumentParser) -> None:
    """--quiet."""
    parser.add_argument("--quiet", action="store_true", help="files and exit code only")


def wide_argument(parser: argparse.ArgumentParser) -> None:
    """--wide."""
    parser.add_argument(
        "--wide",
        action="store_true",
        help="tables with all their columns, however wide (default: six, in the terminal)",
    )


def json_argument(parser: argparse.ArgumentParser) -> None:
    """--json."""
    parser.add_argument("--json", action="store_true", help="print result.json and nothing else; progress to stderr")


def spoken(options: argparse.Namespace) -> bool:
    """Whether the command prints its answer in words."""
    return not options.quiet and not options.json


def print_json(options: argparse.Namespace) -> None:
    """With --json what the command has found: `options.result`, or result.json of its folder `options.results`."""
    import json

    from compare.store.finite import explained

    if not getattr(options, "json", False):
        return
    found, folder = getattr(options, "result", None), getattr(options, "results", None)
    if found is not None:
        print(json.dumps(explained(found), indent=2, ensure_ascii=False, allow_nan=False))
    elif folder is not None:
        sys.stdout.write((folder / "result.json").read_text(encoding="utf-8"))


def out_argument(parser: argparse.ArgumentParser, default: str = "out/SCENE/COMMAND") -> None:
    """--out; one folder for each command, so that none overwrites another's results."""
    parser.add_argument("--out", metavar="FOLDER", default=None, help=f"where results go (default {default})")


def leave_saddle_argument(parser: argparse.ArgumentParser) -> None:
    """--leave-saddle or --stay (`leaves`)."""
    requested = parser.add_mutually_exclusive_group()
    requested.add_argument(
        "--leave-saddle", action="store_true",
        help="leave a saddle along its unstable direction, also along a [[path]] and with the rods",
    )  # fmt: skip
    requested.add_argument(
        "--stay", action="store_true", help="stay on a saddle; a ribbon without a [[path]] leaves it"
    )


def leaves(options: argparse.Namespace) -> bool | None:
    """Whether saddles are left, as `compare.models.base.Options` asks; None: neither was said."""
    return True if options.leave_saddle else False if options.stay else None


def scene_of(options: argparse.Namespace, computes: bool = True) -> Scene:
    """The scene with the assignments of --set, and its notes on stderr. Where it is to be solved (`computes`), one that
    cannot be meant is a `BadInput`, unless --yes."""
    from compare.scene.inputs.plausible import check_meant
    from compare.scene.inputs.through import check_wound
    from compare.scene.scene import parse_assignment

    scene = loaded(options, options.scene)
    keys = dict(parse_assignment(text) for text in options.assignments)
    if keys:
        scene = scene.replace(keys)
    units_of(options, scene)
    if computes:
        check_meant(scene)
        check_wound(scene)
    tell_notes(scene)
    return scene


def strips_of(options: argparse.Namespace) -> StripsScene | None:
    """The scene of several strips with the assignments of --set; None where it is one of a single strip."""
    from compare.scene.inputs.plausible import check_meant
    from compare.scene.inputs.source import STDIN, text_of
    from compare.scene.scene import parse_assignment
    from compare.scene.strips.read import loads
    from compare.scene.strips.scene import is_several

    text, source = text_of(options.scene)
    if options.scene == STDIN:
        options.read = text, source
    if not is_several(text):
        return None
    scene = loads(text, source, dict(parse_assignment(one) for one in options.assignments))
    if options.scene == STDIN:
        options.typed = text
    for name, strip in zip(scene.names, scene.strips, strict=True):
        try:
            check_meant(strip)
        except BadInput as error:
            key = error.key.replace("strip.", f"strip.{name}.", 1)
            raise BadInput(key, error.value, error.problem, error.remedy) from None
    for note in scene.notes():
        print(f"ribbonbench: note: {note}", file=sys.stderr)
    return scene


def loaded(options: argparse.Namespace, name: str) -> Scene:
    """The scene of this name; the text of one from the standard input is kept for the folder of its results."""
    from compare.scene.inputs.source import STDIN, text_of
    from compare.scene.scene import loads

    text, source = getattr(options, "read", None) or text_of(name)
    scene = loads(text, source)
    if name == STDIN:
        options.typed = text
    return scene


def tell_notes(scene: Scene) -> None:
    """The scene's notes on stderr, one line each."""
    for note in scene.notes():
        print(f"ribbonbench: note: {note}", file=sys.stderr)


def units_of(options: argparse.Namespace, scene: Scene) -> Units:
    """What the numbers of a scene are told in, as --units asks (without it: auto); `BadInput` where it asks for SI and
    the scene lacks the keys."""
    from compare.scene.units import Units

    return Units.asked(scene.strip, getattr(options, "units", "auto"))


def out_folder(options: argparse.Namespace, name: str) -> Path:
    """The folder of --out, or out/`name`/COMMAND, made and proved writable. A scene that came through the standard
    input is laid into it, and the command line that makes the results again reads it from there."""
    from compare.store.store import atomic_write_text, check_writable

    folder = check_writable(options.out if options.out is not None else OUT / name / options.command)
    options.results = folder
    if getattr(options, "typed", None) is not None:
        file = atomic_write_text(folder / "scene.toml", options.typed)
        options.line = fed(options.line, file)
    return folder


@contextlib.contextmanager
def telling() -> Iterator[None]:
    """An answer that is told before its files are written: a reader who has read enough (`| head`) stops no writing."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        _nobody_reads()
    except SystemExit:  # rich's word for the same
        _nobody_reads()


def _nobody_reads() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def held(folder: Path, say: Callable[[str], object] | None = None) -> Iterator[Path]:
    """The folder, held by this run alone; another run into it is waited for, and `say` is told so once."""
    from compare.store.store import occupied

    with occupied(folder, None if say is None else lambda: say(f"another run writes into {folder.name}: waiting")):
        yield folder
