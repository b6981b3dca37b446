"""Two corners held, as in the thesis's 7.3: as cells of the mesh, as squares of a given size, and the whole edge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from compare.models.shell_process import shell_problem
from compare.scene.scene import load
from shellref import ShellResult, ShellStatus
from shellref.path.solve import solve
from tests.validation import page
from tests.validation.number import Number

MESHES = ((25, 4), (50, 8), (100, 16), (150, 24))
KINDS: tuple[tuple[str, float | None], ...] = (("edge", None), ("corners", None), ("corners", 0.02), ("corners", 0.01))
#: Largest change between the two finest meshes of the tip (over l) where the corner has a size.
CONVERGED = 2e-3


def solved(clamp: str, corner: float | None, mesh: tuple[int, int]) -> ShellResult:
    """The scene's shell on this mesh, its edge or its corners held."""
    base = shell_problem(load("limits_7_3"), 100.0, MESHES[0])
    result = solve(replace(base, elements=mesh, grading=(0.4, 0.4), clamp=clamp, corner=corner))
    if result.status is not ShellStatus.CONVERGED:
        raise AssertionError(f"{clamp} {corner} {mesh}: {result.message}")
    return result


PROBES = {
    "membrane_edge_25x4": lambda: 100.0 * solved("edge", None, MESHES[0]).share["membrane"],
    "membrane_cells_25x4": lambda: 100.0 * solved("corners", None, MESHES[0]).share["membrane"],
}


def run(out: Path) -> dict[str, Number]:
    rows = []
    shares: dict[tuple[str, float | None], list[float]] = {}
    moved: dict[tuple[str, float | None], float] = {}
    for clamp, corner in KINDS:
        last = None
        for mesh in MESHES:
            result = solved(clamp, corner, mesh)
            shares.setdefault((clamp, corner), []).append(100.0 * result.share["membrane"])
            end = np.array(result.section(1.0)["position"])
            change = np.nan if last is None else float(np.linalg.norm(end - last))
            moved[clamp, corner], last = change, end
            cell = result.surface.s_nodes[2], np.diff(result.surface.v_nodes[[0, 2]])[0]
            held = "edge" if clamp == "edge" else f"{corner:g} squared" if corner else f"{cell[0]:.4f} x {cell[1]:.4f}"
            spent = result.seconds["total"] - result.seconds["import"] - result.seconds["compile"]
            rows.append([
                held, f"{mesh[0]} x {mesh[1]}", " ".join(f"{x:.4f}" for x in end),
                f"{change:.1e}" if np.isfinite(change) else "", f"{result.energy['elastic']:.4f}",
                f"{result.energy['total']:.4f}", f"{100 * result.share['membrane']:.3f}",
                f"{100 * result.share['shear']:.3f}", f"{100 * result.stabilisation['share']:.4f}", f"{spent:.0f}",
            ])  # fmt: skip
    page.write(
        out / "shell_corners.md", "What a clamp at two corners is", "python -m tests.validation shell_corners",
        "Scene limits_7_3 (thesis 7.3: w/l = 0.1, Gamma = 100, nu = 0.4, h/l = 1e-3), meshes graded (0.4, 0.4). "
        "held: at "
        "S = 0 the whole edge, or every node in the two corner cells: cells of the mesh (their size shrinks "
        "with it), or "
        "squares of a given side (knots of the mesh are put there). change: of the tip, from the mesh above.",
        page.table(
            ["held", "mesh", "end / l", "change", "elastic", "total", "membrane %", "shear %", "stabilisation %", "s"],
            rows,
        ),
        "With cells of the mesh the support is another one on every mesh, and the tip does not settle; with "
        "squares of a "
        "size it converges as with the whole edge. A result for two corners means nothing without that size.",
    )  # fmt: skip
    for (clamp, corner), change in moved.items():
        if (clamp == "edge" or corner) and not change < CONVERGED:
            raise AssertionError(f"{clamp} {corner}: the tip still moves by {change:.1e}")
    return _numbers(shares, moved)


def _numbers(
    shares: dict[tuple[str, float | None], list[float]], moved: dict[tuple[str, float | None], float]
) -> dict[str, Number]:
    """Shares on the coarsest and the finest mesh with what the mesh leaves open: their change on the next mesh. A
    corner of cells is another support on every mesh; beside it the mesh leaves open what it does with an edge held."""
    found = {}
    names = {("edge", None): "edge", ("corners", None): "cells", ("corners", 0.02): "002", ("corners", 0.01): "001"}
    for kind, values in shares.items():
        like = shares["edge", None] if names[kind] == "cells" else values
        for at, beside, mesh in ((0, 1, MESHES[0]), (-1, -2, MESHES[-1])):
            name = f"membrane_{names[kind]}_{mesh[0]}x{mesh[1]}"
            found[name] = Number(values[at], abs(like[at] - like[beside]), "%", ".3f")
        found[f"moved_{names[kind]}"] = Number(moved[kind], moved[kind], "l", ".1e")
    first, last = (f"{mesh[0]}x{mesh[1]}" for mesh in (MESHES[0], MESHES[-1]))
    return found | {
        "cells_coarsest": found[f"membrane_cells_{first}"], "cells_finest": found[f"membrane_cells_{last}"],
        "squares": found[f"membrane_001_{last}"],
    }  # fmt: skip
