"""Roman's strip by the shell: the roof's force against its height beside elastica and ribbon, and figure 6.11's states
of the strip that leaves its plane."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.distance import grid_hausdorff
from compare.models.ribbon.state import RibbonShape
from compare.models.shell import starting_surface
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import Scene, load
from ribbon import Equilibrium
from shellref.path.begin import Beginning, begun
from shellref.shell.result import ShellResult
from tests.test_setup import ROOT
from tests.validation import page
from tests.validation.number import Number
from tests.validation.pieces import Pieces
from tests.validation.ribbon import roman, roman_states

#: N H of every number of folds: two with contacts along lines, one with planes (results/roman.md).
SCALED = (0.19, 0.185, 0.16)
FOLDS = (1, 2, 3)
#: Segments of the ribbon, with joints where one, two and three folds touch.
SEGMENTS = 240
#: w/h, and for every nu the meshes (along, across): nothing happens across for nu = 0.
RATIO = 400.0
MESHES = {0.0: ((48, 2), (96, 2)), 0.5: ((36, 4), (60, 6))}
#: Figure 6.11: w/h and meshes; points of a surface on which distances are measured.
THIN = 100.0
STATE_MESHES = {
    "in the plane, leaning over": ((60, 4), (90, 6)),
    "aside, symmetrical": ((60, 4), (90, 6)),
    "aside, leaning over": ((60, 4),),
    "aside, uneven": ((60, 4),),
}
POINTS = (201, 5)
#: The state that a shell leaves for another: thinner shells from its surface, w/h.
LEFT, THINNER = "aside, uneven", (200.0, 400.0)


def folded(folds: int, height: float) -> Equilibrium:
    """The ribbon's N equal folds under a roof, on `SEGMENTS`."""
    return roman.Experiment(segments=SEGMENTS).folded(folds, height, SEGMENTS)


def scene_of(poisson: float, height: float) -> Scene:
    """roman_6_2 with another nu and another roof."""
    change = {"strip.poisson": poisson, "wall.roof.point": [0.0, height, 0.0],
              "shell.width_to_thickness": [RATIO], "shell.grading": [1.0, 1.0]}  # fmt: skip
    return load(ROOT / "compare" / "scenes" / "roman_6_2.toml").replace(change)


def aside(ratio: float) -> Scene:
    """Figure 6.11's strip (results/roman_states)."""
    change = {"shell.width_to_thickness": [ratio], "shell.grading": [1.0, 1.0]}
    return load(ROOT / "results" / "roman_states" / "aside.toml").replace(change)


def shell(
    scene: Scene, mesh: tuple[int, int], near: Equilibrium | None, ratio: float = RATIO, kick: bool = True
) -> ShellResult | None:
    """The shell on a mesh, begun at a ribbon's surface, if need be by way of thicker strips, None where it comes to no
    equilibrium from there; with near None by its own path. kick: whether a saddle is left."""
    problem, options = shell_problem(scene, ratio, mesh), replace(shell_options(scene), kick=kick)
    if near is None:
        return begun(problem, options, _silent).result
    start = starting_surface(RibbonShape(near), problem)
    return Beginning(problem, replace(options, begin="given"), _silent, None, "self").given(start)[0]


def _silent(event: dict[str, Any]) -> None:
    """Nothing is said of a step."""


def roof(result: ShellResult) -> float:
    """Of the shell on the roof, D w / l^2."""
    return -float(result.walls[1]["force"][1])


def elastica(folds: int, scaled: float) -> float | None:
    """Roman's elastica under its weight where it touches along lines; None where it lies flat."""
    half = roman.line_contact(scaled / folds, roman.DELTA, roman.GAMMA, folds)
    return folds * half.force if half.low >= 0.0 >= half.high else None


def _curve(folds: int, scaled: float, poisson: float) -> list[list[Any]]:
    """For every mesh: force, stable, energy, folds seen, deepest point behind a wall; empty where nothing is found."""
    near, rows = folded(folds, scaled / folds), []
    for mesh in MESHES[poisson]:
        found = shell(scene_of(poisson, scaled / folds), mesh, near)
        if found is None:
            rows.append([])
            continue
        touch = found.contact or {}
        rows.append([roof(found), bool(found.stable), float(found.energy["total"]), _folds(found, scaled / folds),
                     float(touch.get("penetration", 0.0))])  # fmt: skip
        print("  ", folds, scaled, poisson, mesh, rows[-1], flush=True)
    return rows


def _folds(found: ShellResult, height: float) -> int:
    """How often the shell's centreline rises through half the height of the roof."""
    above = found.surface.centreline(np.linspace(0.0, 1.0, 801))[:, 1] > 0.5 * height
    return int(np.count_nonzero(above[1:] & ~above[:-1]))


def _ribbon(folds: int, scaled: float) -> list[float]:
    """The ribbon's force, and its change from half as many segments."""
    fine = roman.press(folded(folds, scaled / folds))
    coarse = roman.Experiment(segments=SEGMENTS).folded(folds, scaled / folds, SEGMENTS // 2)
    return [fine, abs(fine - roman.press(coarse))]


def _state(name: str, ratio: float = THIN) -> dict[str, Any]:
    """One of figure 6.11's ribbon states (total energy, roof, farthest from the plane) and the shells that begin at its
    surface: mesh, stable, lowest eigenvalue, total energy, roof, distance to the ribbon, farthest from the plane."""
    ribbon = roman_states.halved(roman_states.found_on(*roman_states.STATES[name]))
    s, v = np.linspace(0.0, 1.0, POINTS[0]), 0.5 * roman_states.WIDTH * np.linspace(-1.0, 1.0, POINTS[1])
    shape, rows, line = RibbonShape(ribbon), [], None
    for mesh in STATE_MESHES[name]:
        found = shell(aside(ratio), mesh, ribbon, ratio)
        if found is None:
            rows.append([list(mesh)])
            continue
        line = found.surface.centreline(s)
        apart = grid_hausdorff(shape.points(s, v), found.surface.grid(s, v))
        rows.append([list(mesh), bool(found.stable), float(found.lowest_eigenvalue or 0.0),
                     float(found.energy["total"]), roof(found), float(apart), float(np.abs(line[:, 0]).max()),
                     found.message])  # fmt: skip
        print("  ", name, rows[-1], flush=True)
    own = [float(ribbon.energy.total), roman.press(ribbon), float(np.abs(shape.centreline(s)[:, 0]).max())]
    return {"ribbon": own, "rows": rows, "line": None if line is None else line.tolist(),
            "ribbon_line": shape.centreline(s).tolist()}  # fmt: skip


@cache
def _first() -> ShellResult:
    """One fold on few elements."""
    found = shell(scene_of(0.0, 0.185), (24, 2), folded(1, 0.185))
    assert found is not None
    return found


def _known(found: ShellResult | None) -> ShellResult:
    assert found is not None
    return found


PROBES = {
    "few": lambda: roof(_first()),
    "force_1_1850_0": lambda: roof(_known(shell(scene_of(0.0, 0.185), MESHES[0.0][-1], folded(1, 0.185)))),
}


def _curves(kept: Pieces, numbers: dict[str, Number]) -> tuple[str, dict[tuple[int, float], list[float]]]:
    """The table of forces, and (elastica or nan, ribbon, shells) for the picture."""
    rows, drawn = [], {}
    for folds in FOLDS:
        for scaled in SCALED:
            exact = elastica(folds, scaled)
            own, change = kept.get(f"ribbon_{folds}_{scaled}", lambda f=folds, x=scaled: _ribbon(f, x))
            cells, seen = [], []
            for poisson in MESHES:
                found = kept.get(
                    f"curve_{folds}_{scaled}_{poisson}", lambda f=folds, x=scaled, p=poisson: _curve(f, x, p)
                )
                known = [row for row in found if row]
                if not known:
                    cells += ["none found", "", ""]
                    seen.append(float("nan"))
                    continue
                force = known[-1][0]
                error = abs(known[-1][0] - known[0][0]) if len(known) > 1 else None
                stands = "yes" if all(row[1] for row in known) else "no"
                stands += "" if all(row[3] == folds for row in known) else f", {known[-1][3]} folds"
                cells += [f"{force:.2f}", "" if error is None else f"{error:.1g}", f"{force / own - 1.0:+.2%}", stands]
                seen.append(force)
                numbers[f"force_{folds}_{1e4 * scaled:.0f}_{100 * poisson:.0f}"] = Number(
                    force, error, "D w / l^2", ".2f", "" if error is not None else "on one mesh alone")  # fmt: skip
            drawn[folds, scaled] = [float("nan") if exact is None else exact, own, *seen]
            rows.append([str(folds), f"{scaled:g}", f"{scaled / folds:.4f}", "" if exact is None else f"{exact:.3f}",
                         f"{own:.3f}", f"{change:.1g}", *cells])  # fmt: skip
    heads = ["N", "N H", "H", "elastica", "ribbon", "change"]
    for poisson in MESHES:
        heads += [f"shell, nu = {poisson:g}", "change", "off the ribbon", "stable"]
    return page.table(heads, rows), drawn


def _states(kept: Pieces, numbers: dict[str, Number]) -> tuple[str, dict[str, dict[str, Any]]]:
    """The table of figure 6.11's states."""
    states = {name: kept.get(f"state_{k}", lambda name=name: _state(name)) for k, name in enumerate(STATE_MESHES)}
    rows = []
    for name, state in states.items():
        energy, push, far = state["ribbon"]
        rows.append([name, "ribbon", "yes", "", f"{energy:.2f}", "", f"{push:.2f}", "", f"{far:.4f}"])
        known = [row for row in state["rows"] if len(row) > 1]
        for mesh, *found in state["rows"]:
            label = f"shell {mesh[0]} x {mesh[1]}"
            if not found:
                rows.append([name, label, "no equilibrium reached", "", "", "", "", "", ""])
                continue
            stable, low, total, roofed, apart, out, _ = found
            rows.append([name, label, "yes" if stable else "no", f"{low:.3g}", f"{total:.2f}",
                         f"{total / energy - 1.0:+.1%}", f"{roofed:.2f}", f"{apart:.3f}", f"{out:.4f}"])  # fmt: skip
        if len(known) > 1:
            word = name.replace(",", "").replace(" ", "_")
            numbers[f"energy_{word}"] = Number(known[-1][3], abs(known[-1][3] - known[0][3]), "D w / l", ".2f")
    heads = ["state", "model", "stable", "lowest eigenvalue", "energy", "off the ribbon", "roof", "distance / l",
             "farthest from the plane / l"]  # fmt: skip
    return page.table(heads, rows), states


def _thinner(kept: Pieces, numbers: dict[str, Number]) -> str:
    """The table of thinner shells that begin at the surface of the state that a shell leaves."""
    rows = []
    for ratio in THINNER:
        state = kept.get(f"left_{ratio:g}", lambda ratio=ratio: _state(LEFT, ratio))
        for mesh, *found in state["rows"]:
            label = f"{mesh[0]} x {mesh[1]}"
            if not found:
                rows.append([f"{ratio:g}", label, "no equilibrium reached", "", "", "", "", ""])
                continue
            stable, low, total, roofed, apart, out, _ = found
            rows.append([f"{ratio:g}", label, "yes" if stable else "no", f"{low:.3g}", f"{total:.2f}", f"{roofed:.2f}",
                         f"{apart:.3f}", f"{out:.4f}"])  # fmt: skip
            numbers[f"left_{ratio:g}"] = Number(apart, None, "l", ".3f", "on one mesh alone")
    heads = ["w/h", "mesh", "stable", "lowest eigenvalue", "energy", "roof", "distance / l",
             "farthest from the plane / l"]  # fmt: skip
    return page.table(heads, rows)


def figure(path: Path, drawn: dict[tuple[int, float], list[float]], states: dict[str, dict[str, Any]]) -> None:
    """Forces over N^3 against N H; the states from above, ribbon and shell."""
    fig, axes = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    marks = (("elastica", "k-"), ("ribbon", "C0+"), ("shell, nu = 0", "C1o"), ("shell, nu = 0.5", "C3x"))
    for folds in FOLDS:
        for k, (name, mark) in enumerate(marks):
            values = [drawn[folds, x][k] / folds**3 for x in SCALED]
            axes[0].plot(SCALED, values, mark, mfc="none", label=name if folds == 1 else None)
    axes[0].set(xlabel="N H / l", ylabel="F / N^3, D w / l^2", title="Roof's force, one to three folds, Gamma = 10")
    axes[0].legend(fontsize=9)
    for k, (name, state) in enumerate(states.items()):
        for key, style in (("ribbon_line", "-"), ("line", "--")):
            if state[key] is not None:
                x, _, z = np.array(state[key]).T
                axes[1].plot(z, x, f"C{k}{style}", lw=1.5, label=name if style == "-" else None)
    axes[1].set(xlabel="z / l", ylabel="x / l (from above)", title="Figure 6.11: ribbon, and shell (dashed)")
    axes[1].legend(fontsize=8)
    for axis in axes:
        axis.grid(True, lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(fig)


def run(out: Path) -> dict[str, Number]:
    """results/shell_roman.md."""
    kept, numbers = Pieces("shell_roman"), {}
    told, states = _states(kept, numbers)
    curves, drawn = _curves(kept, numbers)
    thinner = _thinner(kept, numbers)
    few, next_ = PROBES["few"](), shell(scene_of(0.0, 0.185), (48, 2), folded(1, 0.185))
    assert next_ is not None
    numbers["few"] = Number(few, abs(roof(next_) - few), "D w / l^2", ".2f")
    figure(out / "shell_roman.png", drawn, states)
    page.write(
        out / "shell_roman.md", "Roman's strip by the shell (6.2.2)", "python -m tests.validation shell_roman",
        "## Force against height, one to three folds",
        f"Delta = {roman.DELTA:g}, w/l = {roman.WIDTH:g}, Gamma = {roman.GAMMA:g}; forces of the roof in D w / l^2. "
        "Elastica under its weight, by shooting, where contacts are lines ([roman](roman.md)); ribbon on "
        f"{SEGMENTS} segments, change from half as many; shells of w/h = {RATIO:g} that begin at the ribbon's surface, "
        f"change from the coarser of two meshes ({_meshes(0.0)} for nu = 0, {_meshes(0.5)} for nu = 0.5). With nu = 0 "
        "the shell is the elastica's strip; nu = 0.5 is the thesis's, whose free edges make a shell softer than "
        "D. A fold that touches along a line touches a shell along one row of nodes, about which it would turn, and "
        "rests leaning on the next row: an angle of half an element, of second order in the energy.",
        curves,
        "## Figure 6.11: the states aside of the plane",
        f"w/l = {roman_states.WIDTH:g}, nu = 0.5, Gamma = 10, Delta = {roman_states.DELTA:g}, H = "
        f"{roman_states.HEIGHT:g}, w/h = {THIN:g}: each of the ribbon's four stable states "
        "([roman_states](roman_states/README.md)), and where a shell comes to rest from its surface, downwards. "
        "Where no equilibrium is reached that is said, and proves nothing. Where the distance is large the shell has "
        "left the ribbon's state for another.",
        told,
        f"Thinner shells from the surface of the ribbon's state '{LEFT}': whether they come to rest beside it. What "
        "was tried by hand to keep one there, held sideways: docs/decisions.md.",
        thinner,
        "![Forces over N^3, and the states from above](shell_roman.png)",
    )  # fmt: skip
    return numbers


def _meshes(poisson: float) -> str:
    """The meshes in words."""
    return " and ".join(f"{along} x {across}" for along, across in MESHES[poisson])
