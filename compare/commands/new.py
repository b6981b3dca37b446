"""`ribbonbench new`: a commented scene to begin with, from a few numbers."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from compare.commands import common
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene

HELP = "write a commented scene of one's own, by options or a few questions"
EXAMPLE = "ribbonbench new my.toml --si --length 30cm --width 10mm --thickness 0.1mm"


class _Help(str):
    """Help that names the materials when it is shown: no module of scenes is loaded before."""

    __slots__ = ()

    def __mod__(self, values: Any) -> str:
        from compare.scene.begin.materials import MATERIALS

        return super().__mod__({**values, "materials": ", ".join(MATERIALS)})


#: Options that say a number or a word of the scene, and their metavar and help.
_SAID = {
    "length": ("L", "length, in m with --si; units may be written: 30cm"),
    "width": ("W", "width, likewise"),
    "thickness": ("H", "thickness, likewise: 0.1mm"),
    "material": ("NAME", _Help("typical values of %(materials)s (default steel)")),
    "young": ("Y", "Young's modulus in Pa, or e.g. 210GPa"),
    "density": ("RHO", "density in kg/m^3"),
    "poisson": ("NU", "Poisson's ratio"),
    "gamma": ("GAMMA", "without --si: weight against bending stiffness, rho h g l^3 / D"),
    "natural_curvature": ("K", "natural curvature in 1/length: a number, or two with a comma: at start, at end"),
    "held": ("HOW", "how it is held: one, hanging, two, ring, moebius (default one)"),
    "apart": ("X", "distance of two clamps over the length (default 0.9)"),
}
_SI_ONLY = ("material", "young", "density")


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("file", metavar="FILE", help="the scene to write, e.g. my.toml; - writes it to the output")
    parser.add_argument("--si", action="store_true", help="in m, Pa and kg/m^3; without: dimensionless, with gamma")
    for name, (metavar, words) in _SAID.items():
        parser.add_argument(f"--{name.replace('_', '-')}", metavar=metavar, default=None, help=words)
    parser.add_argument("--weightless", action="store_true", help="without gravity")
    parser.add_argument("--title", metavar="TEXT", default=None, help="title of the scene (default: the file's name)")
    parser.add_argument("--force", action="store_true", help="write over a file that is there")
    common.quiet_argument(parser)
    common.json_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Writes the scene."""
    from compare.scene.begin.start import started

    path = _place(options)
    said = {name: getattr(options, name) for name in _SAID if getattr(options, name) is not None}
    si = options.si or any(name in said for name in _SI_ONLY)
    if not said and not options.weightless and path is not None and sys.stdin.isatty() and sys.stdout.isatty():
        from compare.scene.begin.questions import answers

        said = answers(si, input, print)
    title = options.title or ("My strip" if path is None else path.stem)
    text, scene = started(said, si, title, weight=not options.weightless)
    common.tell_notes(scene)
    if path is None:
        options.result = {"file": None, "scene": text}
        if not options.json:
            sys.stdout.write(text)
        return common.DONE
    _write(path, text, options.force)
    options.result = {"file": path, "scene": text}
    if common.spoken(options):
        _tell(console, path, scene)
    return common.DONE


def _place(options: argparse.Namespace) -> Path | None:
    """The file to write, None for the output; `BadInput` before anything is asked."""
    if options.file == "-":
        return None
    path = Path(options.file)
    if path.suffix != ".toml":
        raise BadInput("FILE", options.file, "is not the name of a scene file", f"e.g. {path.stem or 'my'}.toml")
    if path.is_dir():
        raise BadInput("FILE", options.file, "is a folder", "give another name")
    if path.exists() and not options.force:
        raise BadInput("FILE", options.file, "is there already", "give another name, or --force to write over it")
    if not path.parent.is_dir():
        raise BadInput("FILE", options.file, f"is in a folder that is not there ({path.parent})", "make it first")
    return path


def _write(path: Path, text: str, force: bool) -> None:
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise BadInput("FILE", str(path), f"cannot be written ({error.strerror})", "give another place") from None


def _tell(console: Console, path: Path, scene: Scene) -> None:
    """What was written, in numbers, and what to do with it."""
    import shlex

    from compare.models.scope import has_shell

    name = shlex.quote(str(path))
    strip = scene.strip
    numbers = [f"w/l = {scene.width:.3g}"]
    if strip.thickness is not None:
        numbers.append(f"w/h = {strip.width / strip.thickness:.3g}")
    if scene.gravity is not None:
        numbers.append(f"Gamma = {scene.gamma:.3g}")
    console.print(f"Written: {path} ({', '.join(numbers)})")
    steps = [(f"ribbonbench solve {name}", "its shape")]
    if has_shell(scene):
        steps.append((f"ribbonbench limits {name} --quick", "may the ribbon model be trusted?"))
        steps.append((f"ribbonbench compare {name}", "beside the shell (needs dolfinx)"))
    else:
        steps.append((f"ribbonbench explain {name}", "which effects are on, and what they change"))
    steps.append(("ribbonbench keys", "what else a scene can say"))
    console.print("Next:")
    wide = max(len(command) for command, _ in steps)
    for command, words in steps:
        console.print(f"  {command:<{wide}}   {words}", soft_wrap=True)
