"""The pages (page.json) of `ribbonbench solve`: a ribbon, or an elastica."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from compare.models.elastica_run import BEGAN
from compare.models.ribbon_run import ElasticaRun, RibbonRun
from compare.page.page import Picture, Surface
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.pages.comparison import ribbon_advice, solve_rows
from compare.scene.scene import Scene

RIBBON_PICTURE = "ribbon.png"
RIBBON_FILES = {
    "ribbon.vtu": "surface with fields (ParaView)",
    "ribbon.npz": "segments and centreline as arrays (NumPy)",
    "centreline.csv": "centreline, curvature, ruling and frame",
}


def ribbon_picture(run: RibbonRun) -> Picture:
    """`profile.ribbon_profile` in words."""
    e = run.equilibrium
    alt = (
        "Normal curvature omega and ruling eta along the ribbon, and its side view. Largest |eta| "
        f"{e.max_abs_eta:.3g}; the end stands at ({', '.join(f'{c + 0.0:.3f}' for c in e.end.position)}) l."
    )
    return Picture(RIBBON_PICTURE, alt, "The ribbon: normal curvature and ruling along it, and its side view.")


_PATH = (
    Column("stage", "stage", kind="integer", legend="that was approached, from 1"),
    Column("t", "t", kind="digits", legend="where the step ended, from 0 to 1 in each stage"),
    Column("size", "size", kind="digits", legend="of the step"),
    Column("status", "status", kind="word"),
    Column("accepted", "accepted", kind="truth"),
    Column("iterations", "iterations", kind="integer"),
    Column("residual", "residual", kind="exponent:1"),
    Column("energy", "energy", "D w / l", "digits:6"),
    Column("lowest_eigenvalue", "lowest eigenvalue", kind="digits:4"),
    Column("seconds", "s", "s", "seconds"),
    Column("jump", "jump", kind="truth", legend="the shape snapped"),
)


def path_table(log: Sequence[Mapping[str, Any]]) -> Table:
    """The log of a way, one row a step; nothing where nothing was judged."""
    return Table.of_records("Steps of the path", _PATH, log)


def _listed(title: str, rows: Sequence[tuple[str, str]]) -> Table:
    """Names and texts as a table: each row has a unit, or several values, of its own."""
    columns = Column("quantity", "quantity", kind="word"), Column("value", "value", kind="word")
    return Table(title, columns, tuple(rows))


def ribbon_study(scene: Scene, run: RibbonRun, error: float | None) -> Study:
    """A ribbon solve; `error`: its discretisation error (Hausdorff / l) when measured."""
    e = run.equilibrium
    known = "unknown" if error is None else f"{error:.1e} l"
    said = [
        f"Ribbon: {e.problem.energy}, {e.problem.lengths.size} segments, {e.message}; residual {e.residual:.1e}, "
        f"lowest eigenvalue {e.lowest_eigenvalue:.3g}, discretisation error {known}, {run.warm * 1e3:.3g} ms."
    ]
    advice = ribbon_advice(scene, error)
    files, data = {"result.json": "all numbers", **RIBBON_FILES}, {}
    if run.way is not None:
        files["path.csv"] = "every step of the path"
        data["path.csv"] = path_table(e.log)
    return Study(
        "solve",
        scene.title,
        tables=(_listed("The ribbon", solve_rows(scene, run, error)),),
        sentences=tuple(said + ([advice] if advice else [])),
        pictures=(ribbon_picture(run),),
        surfaces=(Surface("ribbon.vtu", "ribbon", "ribbon", "omega"),),
        data=data,
        files=files,
    )


def elastica_rows(run: ElasticaRun, result: dict[str, Any]) -> list[tuple[str, str]]:
    """What `ribbonbench solve` prints of an elastica; result: its result.json."""
    r = run.result
    parts = [name for name in ("elastic", "gravity", "tip") if name in result["energy"]]
    return [
        ("status", r.message),
        ("residual", f"{r.residual:.1e} after {r.iterations} iterations"),
        ("began at", BEGAN[run.start]),
        ("energy / (D w / l)", ", ".join(f"{name} {result['energy'][name]:.6f}" for name in parts)),
        ("s = l, over l", " ".join(f"{c:.6f}" for c in result["end"]["position"] + 0.0)),
        *(
            (f"force at {where} / (D w / l^2)", " ".join(f"{c:.6g}" for c in result["forces"][end] + 0.0))
            for end, where in (("start", "s = 0"), ("end", "s = l"))
            if result["forces"][end] is not None
        ),
        *([("load at the tip / (D w / l^2)", f"{result['tip_load']:.6g}")] if "tip_load" in result else []),
        ("discretisation error", "unknown" if r.error is None else f"{r.error:.1e} l"),
        ("time", f"{run.warm * 1e3:.3g} ms warm, {run.first:.3g} s for the first solve"),
    ]


ELASTICA_PICTURE = "elastica.png"


def elastica_study(scene: Scene, run: ElasticaRun, result: dict[str, Any]) -> Study:
    """An elastica solve: a planar curve, no surface."""
    error = "unknown" if run.result.error is None else f"{run.result.error:.1e} l"
    return Study(
        "solve",
        scene.title,
        tables=(_listed("The elastica", elastica_rows(run, result)),),
        sentences=(f"Elastica: {run.result.message}; discretisation error {error}, {run.warm * 1e3:.3g} ms.",),
        pictures=(
            Picture(
                ELASTICA_PICTURE,
                "Angle of the tangent along the elastica, and its shape; the end stands at "
                f"({', '.join(f'{c + 0.0:.3f}' for c in result['end']['position'])}) l.",
                "The elastica: angle of the tangent along it, and its shape in its plane.",
            ),
        ),
    )
