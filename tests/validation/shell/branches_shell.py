"""Branches of shells by the equations of `ribbonbench branches` (`shellref.follow`): the clamped strut against closed
forms, the strip on edge (thesis 7.1) against bisection on the inertia of solved states, and the branches U, US and S of
the shifted arch (7.2), each with an error on its branch points."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

from compare import registry
from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.capabilities import Branches, BranchStart
from compare.scene.scene import Scene, load, loads
from compare.studies.branches.along import Along
from compare.studies.branches.run import scene_for
from tests.validation import page
from tests.validation.number import Number

ROOT = Path(__file__).resolve().parents[3]

STRUT = """
title = "Strut"
[strip]
length = 1.0
width = 0.02
poisson = 0.0
thickness = 1e-3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [1.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[shell]
elements = [16, 2]
grading = [1.0, 1.0]
"""
#: Shortening over h^2 / 12, from first to last.
LOADS = (24.0, 120.0)
SHIFT, SPAN = "clamp.end.position[1]", (0.01, 0.6)
#: Models of 7.2: name on the page, word of --model, w/h, elements (of a shell along and across).
MODELS = (("shell, w/h = 50", "shell", 50.0, (40, 4)),)
HALVINGS, LOCATED = 2, 1e-9
#: Promised, relative: strut to the closed form (its own thickness moves it by P h^2), strip on edge to `bisected`.
STRUT_NEAR, EDGE_NEAR = 2e-5, 2e-3
#: Height (l) below the clamps' plane at which a branch has passed through S.
PASSED = -0.02


@dataclass(frozen=True)
class Found:
    """A branch point with its place on each mesh, and their limit."""

    values: tuple[float, ...]
    limit: Settled
    unstable: int


@dataclass(frozen=True)
class Line:
    """A branch: parameter, height of the middle, energy and number of unstable modes of its points, how it ended."""

    name: str
    parameter: tuple[float, ...]
    height: tuple[float, ...]
    energy: tuple[float, ...]
    unstable: tuple[int, ...]
    ended: str


def located(special: Special, along: Along, finer: int = HALVINGS) -> Found:
    """A branch point on elements halved so many times."""
    values, last = [special.point.t], special
    for _ in range(finer):
        again = None if last is None else relocated(last)
        last = again  # type: ignore[assignment]
        values.append(math.nan if again is None else again.point.t)
    places = [along.value(t) for t in values]
    return Found(tuple(places), settled(places, LOCATED * abs(along.last - along.first)), special.point.unstable)


def begun(scene: Scene, word: str, along: Along, moving: bool = False) -> tuple[BranchStart, Point]:
    """The first point of the scene's own branch."""
    _, name = scene_for(scene, word)
    model = registry.model(name)
    assert isinstance(model, Branches)
    start = model.branch_start(along.scene_at, moving=moving)
    first = first_point(start.system, start.z, 0.0, Options().tolerance)
    assert first is not None
    return start, first


@functools.cache
def strut() -> list[Found]:
    """The first two buckling loads of the clamped strut, as shortenings over h^2 / 12."""
    scene = loads(STRUT)
    thickness = scene.strip.thickness
    assert thickness is not None
    short = thickness**2 / 12.0
    along = Along.of(scene, "clamp.end.position[0]", 1.0 - LOADS[0] * short, 1.0 - LOADS[1] * short)
    _, first = begun(scene, "shell", along)
    run = follow(first)
    found = [located(special, along) for special in run.specials]
    return [
        Found(
            tuple((1.0 - v) / short for v in one.values),
            settled([(1.0 - v) / short for v in one.values], 1e-6),
            one.unstable,
        )
        for one in found
    ]


def closed_forms() -> tuple[float, float]:
    """P l^2 / D w of the clamped strut's first two modes: (2 pi)^2, and (2 k)^2 with tan k = k."""
    return 4.0 * math.pi**2, 4.0 * brentq(lambda k: math.tan(k) - k, 4.4, 4.6) ** 2


@functools.cache
def edge(width: float = 0.05, elements: tuple[int, int] = (20, 4)) -> Found:
    """The critical weight of the strip on edge of `lateral_7_1`."""
    scene = load("lateral_7_1").replace(
        {"path": None, "strip.gamma": 5.0, "strip.width": width, "shell.elements": list(elements)}
    )
    along = Along.of(scene, "strip.gamma", 5.0, 20.0)
    _, first = begun(scene, "shell", along)
    (special, *_) = follow(first, options=Options(most=0.3)).specials
    return located(special, along)


def scene_of(word: str, ratio: float, elements: tuple[int, ...]) -> Scene:
    """`shift_7_2` at the shift where the branch begins, nu = 0.3."""
    scene = load("shift_7_2").replace({"strip.poisson": 0.3})
    if ratio:
        scene = scene.replace({"shell.width_to_thickness": [ratio], "strip.thickness": scene.strip.width / ratio})
    if len(elements) == 2:
        return scene.replace({"shell.elements": list(elements)})
    return scene_for(scene.replace({"model.elements": elements[0]}), word)[0]


def line(name: str, start: BranchStart, points: tuple[Point, ...], ended: str, along: Along) -> Line:
    """What is drawn of a branch."""
    middle = [float(start.shape(p).centreline(np.array([0.5]))[0, 2]) for p in points]
    return Line(
        name, tuple(along.value(p.t) for p in points), tuple(middle),
        tuple(float(p.system.energy(p.z, p.t)) for p in points), tuple(p.unstable for p in points), ended,
    )  # fmt: skip


@functools.cache
def arch(
    word: str, ratio: float, elements: tuple[int, ...], finer: int = HALVINGS
) -> tuple[dict[str, Found], tuple[Line, ...]]:
    """The branches U, US and S of a model: where US leaves U and meets S, and what was followed."""
    scene = scene_of(word, ratio, elements)
    along = Along.of(scene, SHIFT, *SPAN)
    start, first = begun(scene, word, along, moving=len(elements) == 1)
    upright = follow(first, options=Options(steps=80))
    lines = [line("U", start, upright.points, upright.ended, along)]
    forks = [s for s in upright.specials if s.kind == "branch_point"]
    found: dict[str, Found] = {}
    if not forks:
        return found, tuple(lines)
    found["U-US"] = located(forks[0], along, finer)
    for fork in forks[1:]:
        found["U again"] = located(fork, along, finer)

    def above(point: Point) -> bool:
        return float(start.shape(point).centreline(np.array([0.5]))[0, 2]) > PASSED

    for leaving in switched(forks[0])[:1]:
        tilted = follow(leaving, options=Options(steps=80), on_point=above)
        lines.append(line("US", start, tilted.points, tilted.ended, along))
        for number, fold in enumerate(s for s in tilted.specials if s.kind == "fold"):
            found[f"US fold {number}"] = located(fold, along, finer)
        meets = [s for s in tilted.specials if s.kind == "branch_point"]
        if meets:
            found["US-S"] = located(meets[0], along, finer)
            for flat in switched(meets[0])[:2]:
                ran = follow(flat, options=Options(steps=60))
                lines.append(line("S", start, ran.points, ran.ended, along))
    return found, tuple(lines)


def _height(word: str, found: Found, lines: tuple[Line, ...]) -> float:
    """The height at which a branch point stands: on U, or where US meets S."""
    return float(np.interp(finest(found), lines[0].parameter, lines[0].height)) if word != "US-S" else 0.0


def pieces(line: Line, meets: list[tuple[float, float]]) -> Iterator[tuple[list[float], list[float], bool]]:
    """Parts of a line between two points, cut at the branch points on it (they end what is stable and what is not), and
    whether each is dashed; US and S begin at the branch point that they leave."""
    x, y, loose = list(line.parameter), list(line.height), [n > 0 for n in line.unstable]
    first = min(meets, key=lambda m: math.hypot(m[0] - x[0], m[1] - y[0])) if line.name != "U" else None
    if first is not None:
        yield [first[0], x[0]], [first[1], y[0]], loose[0]
    for k in range(len(x) - 1):
        within = [m for m in meets if loose[k] != loose[k + 1] and min(x[k : k + 2]) < m[0] < max(x[k : k + 2])]
        if within:
            yield [x[k], within[0][0]], [y[k], within[0][1]], loose[k]
            yield [within[0][0], x[k + 1]], [within[0][1], y[k + 1]], loose[k + 1]
        else:
            yield x[k : k + 2], y[k : k + 2], loose[k] or loose[k + 1]


def picture(path: Path, lines: dict[str, tuple[Line, ...]], forks: dict[str, dict[str, Found]]) -> None:
    """Height of the middle over the shift: full where stable, dashed where not, branch points marked."""
    figure, axes = plt.subplots(figsize=(7.0, 4.2))
    for k, (name, each) in enumerate(lines.items()):
        meets = [(finest(found), _height(word, found, each)) for word, found in forks[name].items()]
        for one in each:
            for x, y, dashed in pieces(one, meets):
                axes.plot(x, y, color=f"C{k}", lw=1.2, ls="--" if dashed else "-")
        axes.plot([], [], color=f"C{k}", label=name)
        for (place, height), found in zip(meets, forks[name].values(), strict=True):
            error = found.limit.error if found.limit.settles else None
            axes.errorbar(place, height, xerr=error, fmt="o", ms=4, color=f"C{k}")
    axes.set_xlabel("shift (l)")
    axes.set_ylabel("height of the middle (l)")
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=150)
    plt.close(figure)


def finest(found: Found) -> float:
    """The place on the finest mesh on which it was found."""
    return next(value for value in reversed(found.values) if math.isfinite(value))


def number(found: Found, unit: str, shown: str) -> Number:
    """The limit with its error, or the finest mesh's value and why it has none."""
    if found.limit.settles:
        return Number(found.limit.value, found.limit.error, unit, shown)
    return Number(finest(found), None, unit, shown, "does not settle on elements halved twice")


def told(found: Found, digits: int) -> tuple[str, ...]:
    """Places on each mesh, their limit and its error, as cells."""
    places = tuple(f"{value:.{digits}f}" if math.isfinite(value) else "not found" for value in found.values)
    if not found.limit.settles:
        change = abs(found.values[-1] - found.values[-2])
        return (*places, "does not settle", f"changes by {change:.0e}" if math.isfinite(change) else "-")
    return (*places, f"{found.limit.value:.{digits}f}", f"{found.limit.error:.0e}")


def bisected() -> float:
    """Gamma_c of the same strip by bisection on the inertia of solved states, on its own meshes (`shell_lateral`)."""
    kept = json.loads((ROOT / "results" / "data" / "shell_lateral.json").read_text())["numbers"]
    return float(kept["critical_005"]["value"])


PROBES = {f"strut_{k + 1}": functools.partial(lambda k: strut()[k].limit.value, k) for k in (0, 1)}


def run(out: Path) -> dict[str, Number]:
    """Writes branches_shell.md and branches_shell.png into the folder."""
    numbers: dict[str, Number] = {}
    rows = []
    for k, (found, exact) in enumerate(zip(strut(), closed_forms(), strict=True), 1):
        if abs(found.limit.value / exact - 1.0) > STRUT_NEAR:
            raise AssertionError(f"strut {k}: {found.limit.value:g}, closed form {exact:g}")
        numbers[f"strut_{k}"] = number(found, "D w / l^2", ".4f")
        rows.append((f"{k}", *told(found, 5), f"{exact:.5f}", f"{found.limit.value / exact - 1.0:.0e}"))
    weight = edge()
    band = bisected()
    if abs(finest(weight) / band - 1.0) > EDGE_NEAR:
        raise AssertionError(f"strip on edge: {finest(weight):g}, by bisection {band:g}")
    numbers["edge"] = number(weight, "", ".4f")
    forks, lines, table, ends = {}, {}, [], []
    for name, word, ratio, elements in MODELS:
        forks[name], lines[name] = arch(word, ratio, elements)
        for kind, found in forks[name].items():
            key = f"{kind}_{ratio:g}".lower().replace("-", "_").replace(" ", "_")
            numbers[key] = number(found, "l", ".4f")
            table.append((name, kind, *told(found, 5)))
        for one in lines[name]:
            span = f"{one.parameter[0]:.3f} to {one.parameter[-1]:.3f}"
            modes = f"{min(one.unstable)} to {max(one.unstable)}"
            ends.append((name, one.name, span, f"{one.height[0]:.3f} to {one.height[-1]:.3f}", modes, one.ended))
    picture(out / "branches_shell.png", lines, forks)
    folds = sum("fold" in kind and found.limit.settles for each in forks.values() for kind, found in each.items())
    numbers["folds"] = Number(folds, 0, shown="d")
    page.write(
        out / "branches_shell.md",
        "Branches of shells: a strut, a strip on edge, the shifted arch (thesis 7.1, 7.2)",
        "python -m tests.validation branches_shell",
        "Pseudo-arclength on the shell's own equations (`shellref.follow`), branch points located on the scene's mesh "
        "and on elements halved and quartered each way; limit and error by `compare.measure.mesh_limit`.",
        "## A clamped strut under end shortening",
        "nu = 0, w/l = 0.02, h/l = 1e-3, 16 x 2 elements at first. P l^2 / D w = 12 u / h^2 with the shortening u. "
        "Closed forms: (2 pi)^2, and (2 k)^2 with tan k = k; a shell of this thickness lies below by some P h^2 / D w.",
        page.table(("mode", "16 x 2", "32 x 4", "64 x 8", "limit", "+-", "closed form", "apart"), rows),
        "## A strip on edge under its weight",
        "`lateral_7_1` without its path, w/l = 0.05, nu = 0.35, h/l = 1e-3, 20 x 4 elements at first: Gamma on the "
        f"three meshes, limit, error; bisection on the inertia ([page](shell_lateral.md)) has {band:.4f}.",
        page.table(("20 x 4", "40 x 8", "80 x 16", "limit", "+-"), [told(weight, 5)]),
        "## The arch between shifted clamps",
        "`shift_7_2`, w/l = 1/20, nu = 0.3, 40 x 4 elements at first. U: the upright arch; US: tilted to a side; "
        "S: the flat one, its middle at the height of the clamps. U again: from where on U is stable "
        "once more on the first mesh. US is followed from the upper branch point until it "
        "has passed through S.",
        page.table(("model", "branch point", "40 x 4", "80 x 8", "160 x 16", "limit", "+-"), table),
        "![Height of the middle over the shift](branches_shell.png)",
        page.table(("model", "branch", "shift", "height", "unstable modes", "ended"), ends),
        f"Folds on US between its two ends that are not the mesh's: {folds}. "
        + (
            "As far as US is followed it has none: the shell is lost to a side at one shift and comes back at the same."
            if not folds
            else "Between a fold and the branch point there are two stable states: hysteresis."
        ),
        "Not measured here: other widths. Ribbons' branches, and a thinner shell's, whose tilted branch has a pair of "
        "folds on finer meshes too: [shifted clamps](shift_branches.md).",
    )
    return numbers
