"""Whatever a scene file may say."""

from __future__ import annotations

import csv
import html.parser
import io
import json
import math
import re
import tempfile
import time
import traceback
import unicodedata
from collections.abc import Callable, Iterator
from pathlib import Path

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.processes import ran
from compare.battery.random_scenes import BUDGET, WORDS, literal, scene_text
from compare.scene.scene import loads
from ribbonbench.errors import RibbonbenchError

#: Seconds of the processor beside the budget that a solve may take: of a path each stage, and the error estimate, have
#: a budget for themselves, and a step that is begun is ended.
BESIDE = 4.0
#: Seconds of the processor in which a scene is read, or refused.
READ = 1.0


class _Tried:
    """What random scenes did."""

    def __init__(self, bound: float) -> None:
        self.bound = bound
        self.traces: list[str] = []
        self.lines: list[str] = []
        self.wrong: list[str] = []
        self.longest, self.slowest = 0.0, ""
        self.refused = self.taken = 0

    def scene(self, number: int, do: Callable[[str], str], wild: float, again: bool = True) -> None:
        """One scene; `do` returns what is wrong with it, or nothing. wild: see `scene_text`; again: what takes too long
        is timed once more."""
        text = scene_text(number, 3 if wild else 2, wild)
        began = time.process_time()
        try:
            fault = do(text)
            self.taken += 1
            if fault:
                self.wrong.append(f"scene {number}: {fault}")
        except RibbonbenchError as error:
            self.refused += 1
            if not str(error).isprintable():
                self.lines.append(f"scene {number}: {error!s:.200}")
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            self.traces.append(f"scene {number}: {type(error).__name__}: {error!s:.200} ({where.name}, {where.lineno})")
        spent = time.process_time() - began
        if spent > self.bound and again:  # once for what was compiled
            self.scene(number, do, wild, again=False)
        elif spent > self.longest:
            self.longest, self.slowest = spent, f"scene {number}"

    def checks(self) -> Iterator[Check]:
        """What has to hold of them."""
        text = f"{self.taken} taken, {self.refused} refused"
        yield holds("some are taken and some refused", self.taken > 0 and self.refused > 0, text)
        yield Check("traces", float(len(self.traces)), 0.0, said="; ".join(self.traces[:5]))
        yield Check("errors that are not one plain line", float(len(self.lines)), 0.0, said="; ".join(self.lines[:5]))
        yield Check("wrong answers", float(len(self.wrong)), 0.0, said="; ".join(self.wrong[:5]))
        yield Check("longest (s)", self.longest, self.bound, timed=True, said=self.slowest)


def read(rung: Rung) -> Iterator[Check]:
    """Scenes that are read, written and read again."""
    tried = _Tried(READ)
    for number in range(int(rung)):
        tried.scene(number, _read, wild=0.2)
    yield from tried.checks()


def _read(text: str) -> str:
    scene = loads(text)
    scene.notes()
    again = loads(scene.to_toml())
    return "" if again.canonical() == scene.canonical() else "written and read it is another one"


def solved(rung: Rung) -> Iterator[Check]:
    """Scenes that are solved by the model they name, with its error."""
    tried = _Tried(BUDGET + BESIDE)
    for number in range(int(rung)):
        tried.scene(number, _solve, wild=0.0)
    yield from tried.checks()


def _solve(text: str) -> str:
    from compare.models.base import Options, check_keys
    from compare.models.choice import chosen

    scene = loads(text)
    model = chosen(scene)
    check_keys(model, scene)
    state = model.solve(scene, options=Options(error=True))
    if not state.status.ok:
        return ""
    found = {"residual": state.residual, "error": state.error}
    if state.lowest_eigenvalue is not None:  # None where nothing can move
        found["lowest eigenvalue"] = state.lowest_eigenvalue
    if state.energy is not None:
        found |= {"elastic energy": state.energy.elastic, "weight's energy": state.energy.gravity}
    if state.end is not None:
        found |= {f"end {axis}": float(x) for axis, x in zip("xyz", state.end.position, strict=True)}
    odd = [f"{name} {value}" for name, value in found.items() if value is not None and not math.isfinite(value)]
    return f"{state.status.code}: {', '.join(odd)}" if odd else ""


#: A scene that is solved at once; its title is given.
_TITLED = """
title = {title}
[strip]
length = 1.0
width = 0.03
poisson = 0.4
thickness = 1e-3
gamma = 10.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
elements = 2
"""


def titled(rung: Rung) -> Iterator[Check]:
    """A title as every file shows it."""
    text = WORDS[int(rung)]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        scene, out = place / "scene.toml", place / "o"
        scene.write_text(_TITLED.format(title=literal(text)))
        code = ran(("solve", "scene.toml", "--quiet", "--out", "o"), place).code
        plain = all(unicodedata.category(c) not in ("Cc", "Zl", "Zp") for c in text) and not _turns(text)
        yield holds("taken, or refused in one line", code == (0 if plain else 2), f"exit code {code}")
        if code == 0:
            ran(("export", "scene.toml", "--quiet", "--format", "gltf,csv", "--out", "o"), place)
            ran(("report", "o", "--quiet"), place)
            inside = [path for path in place.rglob("*") if path.is_file()]
            yield holds("all files are where they belong", all(place in path.resolve().parents for path in inside))
            yield from _inert(out)


def _turns(text: str) -> bool:
    return any("\u202a" <= c <= "\u202e" or "\u2066" <= c <= "\u2069" for c in text)


def _inert(out: Path) -> Iterator[Check]:
    """That nothing in the files of a folder is more than text."""
    page = _Page()
    page.feed((out / "report.html").read_text(encoding="utf-8"))
    yield Check(
        "scripts, handlers and links of strangers in HTML", float(len(page.strange)), 0.0, said=str(page.strange)
    )
    formulas = [
        f"{path.name}: {cell[:40]}"
        for path in out.rglob("*.csv")
        for row in csv.reader(io.StringIO(path.read_text(encoding="utf-8")))
        for cell in row
        if cell[:1] in ("=", "+", "-", "@", "\t", "\r") and not _number(cell)
    ]
    yield Check("formulas in CSV", float(len(formulas)), 0.0, said=str(formulas[:3]))
    marked = _CODE.sub("", (out / "report.md").read_text(encoding="utf-8"))
    live = re.findall(r"(?<!\\)\[[^\]]*\]\(javascript:|<(?:script|img|svg)\b", marked)
    yield Check("markup in Markdown", float(len(live)), 0.0, said=str(live[:3]))
    for path in out.rglob("*.gltf"):
        strange = [buffer.get("uri", "")[:30] for buffer in json.loads(path.read_text())["buffers"]]
        yield holds("no file of strangers in glTF", not any(uri.startswith(("/", "..", "http")) for uri in strange))


_CODE = re.compile(r"^(`{3,}|~{3,}).*?^\1", re.MULTILINE | re.DOTALL)


def _number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


class _Page(html.parser.HTMLParser):
    """What in a page does more than stand there: `strange`."""

    def __init__(self) -> None:
        super().__init__()
        self.strange: list[str] = []
        self.scripts = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A tag."""
        for name, value in attrs:
            to = (value or "").strip().lower()
            if name.startswith("on") or (name in ("href", "src") and to.startswith(("javascript:", "http:", "//"))):
                self.strange.append(f"{tag} {name}={value}")
        if tag in ("iframe", "object", "embed", "base", "form"):
            self.strange.append(tag)
        self.scripts += tag == "script"
        if self.scripts > 2:
            self.strange.append("script")


CASES: tuple[Case, ...] = (
    Case(
        "inputs/read",
        "random values for random keys: numbers to the ends of their range and beyond, other kinds, markup, paths",
        "a scene that says the same when it is written and read again, or one plain line",
        "scenes",
        read,
        (300,),
        (10000,),
    ),
    Case(
        "inputs/solved",
        "the same scenes, solved with a budget of 1 s",
        "a status, and no NaN where it is a converged one; never a trace, never longer than the budget allows",
        "scenes",
        solved,
        (20,),
        (300, 2000),
    ),
    Case(
        "inputs/titles",
        "titles with markup, formulas, parts of paths, control characters, marks that turn a line round",
        "text in HTML, CSV, Markdown, glTF and paths, or refused in one line",
        "number of the title",
        titled,
        (2,),
        tuple(number for number in range(len(WORDS)) if number != 2),
    ),
)
