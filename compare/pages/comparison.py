"""The comparison as a table and as sentences, and what `ribbonbench solve` says of a ribbon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from compare.measure.distance import YARDSTICK
from compare.models.elastica_run import BEGAN, PLANAR_RIBBON, out_of_plane
from compare.models.ribbon_build import formulation_why
from compare.models.ribbon_run import RibbonRun
from compare.models.shell_build import line_weight
from compare.page.table import Column, ColumnOf, Table
from compare.scene.scene import Scene
from compare.studies.compare import Comparison, Row

FloatArray = NDArray[np.float64]


def _part(kind: str, name: str) -> Callable[[Row], float | None]:
    def value(row: Row) -> float | None:
        table = getattr(row, kind)
        return None if table is None else table.get(name)

    return value


_COLUMNS: tuple[ColumnOf[Row], ...] = (
    (Column("width_to_thickness", "w/h", kind="digits"), lambda r: r.width_to_thickness),
    (Column("status", "shell", kind="word"), lambda r: r.status),
    (Column("start", "start", kind="word", legend="where the shell's solve began, its path or the ribbon's surface (it "
            "then settles at the full load)"), lambda r: r.start),
    (Column("hausdorff", "distance", "l", "exponent:2", legend="symmetric Hausdorff distance of the surfaces"),
     lambda r: r.hausdorff),
    (Column("centreline", "centreline", "l", "exponent:2", legend="largest distance at equal s"),
     lambda r: r.centreline),
    (Column("ribbon_error", "ribbon error", "l", "exponent:1", legend="of the discretisation, by refinement"),
     lambda r: r.ribbon_error),
    (Column("shell_error", "shell error", "l", "exponent:1", legend="the same of the shell"), lambda r: r.shell_error),
    (Column("claimed", "models differ", kind="truth", words={"false": "not shown"},
            legend="the distance exceeds the sum of both errors"), lambda r: r.claimed),
    (Column("membrane_share", "membrane %", kind="share"), _part("share", "membrane")),
    (Column("shear_share", "shear %", kind="share"), _part("share", "shear")),
    (Column("elastic", "elastic", "D w / l", "digits:6"), _part("energy", "elastic_ribbon")),
    (Column("gravity", "gravity", "D w / l", "digits:6"),
     lambda r: None if r.energy is None else r.energy["gravity"] + 0.0),
    (Column("total", "total", "D w / l", "digits:6"), lambda r: _total(r)),
    (Column("seconds_ribbon", "ribbon s", "s", "seconds:2"), lambda r: r.seconds["ribbon"]),
    (Column("seconds_shell", "shell s", "s", "seconds:3"), lambda r: r.seconds["shell"]),
    (Column("ratio", "ratio", kind="decimals:0", legend="shell time over ribbon time"), lambda r: r.ratio),
)  # fmt: skip
_ELASTICA = (
    Column("elastica", "to elastica", "l", "exponent:2", legend="distance of the centreline to the elastica's"),
    lambda r: r.elastica,
)
LEGEND = (
    "Lengths in l, energies in D w / l without the constant of the natural curvature, shares of the shell's elastic "
    "energy, times in seconds of one solve (compilation apart). Below: the ribbon, the limit h/w = 0."
)


def columns(*keys: str) -> tuple[ColumnOf[Row], ...]:
    """Columns of these keys with what takes their value from a row, for another table of the same rows."""
    by_key = {column.key: (column, value) for column, value in _COLUMNS}
    return tuple(by_key[key] for key in keys)


def _total(row: Row) -> float | None:
    if row.energy is None:
        return None
    return row.energy["elastic_ribbon"] + row.energy["gravity"]


def table(comparison: Comparison) -> Table:
    """One row per shell; below it the ribbon, the limit h/w = 0 of the inextensible model. The elastica's column is
    absent where there is none."""
    columns = _COLUMNS if comparison.elastica is None else (*_COLUMNS, _ELASTICA)
    found = Table.of("Ribbon against shell", columns, comparison.rows, LEGEND)
    ribbon, energy = comparison.ribbon, comparison.ribbon.equilibrium.energy
    cells = {
        "width_to_thickness": "ribbon",
        "status": ribbon.equilibrium.status.code,
        "ribbon_error": comparison.ribbon_error,
        "elastic": energy.elastic,
        "gravity": energy.gravity,
        "total": energy.total,
        "seconds_ribbon": ribbon.warm,
        "elastica": comparison.elastica_distance,
    }
    return replace(found, below=(tuple(cells.get(key) for key in found.keys),))


def verdict(comparison: Comparison) -> list[str]:
    """What the table says, in sentences that its numbers bear out."""
    said: list[str] = []
    ribbon = comparison.ribbon
    e = ribbon.equilibrium
    error = "unknown" if comparison.ribbon_error is None else f"{comparison.ribbon_error:.1e} l"
    said.append(
        f"Ribbon: {e.problem.energy}, {e.problem.lengths.size} segments, {e.message}; residual {e.residual:.1e}, "
        f"lowest eigenvalue {e.lowest_eigenvalue:.3g}, discretisation error {error}, "
        f"{ribbon.warm * 1e3:.3g} ms."
    )
    advice = ribbon_advice(comparison.scene, comparison.ribbon_error)
    said += [advice] if advice else []
    if comparison.slope is not None:
        low, high = comparison.slope.spread
        word = "falls" if comparison.falls else "does not fall on every row"
        said.append(
            f"The distance between the models {word} as h/w falls: slope {comparison.slope.value:.2f} in log-log over "
            f"{comparison.slope.rows} rows on which it exceeds both errors (between rows {low:.2f} to {high:.2f})."
        )
    else:
        said.append("No slope: fewer than two rows have a distance above the discretisation errors.")
    if not comparison.falls:
        said += _undecided(comparison)
        said += _other_model(comparison)
    times = [r for r in comparison.rows if r.ratio is not None and None not in (r.shell_error, r.ribbon_error)]
    if times:
        last = times[-1]
        said.append(
            f"Time: at w/h = {last.width_to_thickness:g} the shell takes {last.seconds['shell']:.3g} s (error "
            f"{last.shell_error:.1e} l), the ribbon {ribbon.warm:.2g} s (error {last.ribbon_error:.1e} l): a factor "
            f"{last.ratio:.0f}"
            + ("; the shell's time is from the run that stored it" if last.reused else "")
            + ("." if last.start.startswith("path") else "; the shell began at the ribbon's surface.")
        )
    weight = line_weight(comparison.scene)
    said += [weight] if weight else []
    if comparison.elastica is not None and comparison.elastica_distance is not None:
        r = comparison.elastica.result
        said.append(
            f"Elastica (the scene is planar; begun at {BEGAN[comparison.elastica.start]}): centreline "
            f"{comparison.elastica_distance:.1e} l from the ribbon's; its own error {r.error or 0.0:.1e} l; {r.message}"
            + "."
            + _left_plane(comparison)
        )
    said += [
        f"w/h = {row.width_to_thickness:g}: the shell is {row.status}: {row.message}"
        for row in comparison.rows
        if row.status != "converged"
    ]
    return said


def _left_plane(comparison: Comparison) -> str:
    """That the ribbon leaves the plane, where it does: then it is not the elastica's shape."""
    across = out_of_plane(comparison.scene, comparison.ribbon.equilibrium, np.linspace(0.0, 1.0, 201))
    if across <= PLANAR_RIBBON:
        return ""
    return (
        f" The ribbon leaves the plane (its tangent by up to {across:.2g}): the planar shape is not the one it takes."
    )


def _other_model(comparison: Comparison) -> list[str]:
    """What makes this ribbon another model than the limit of its shells."""
    scene, energy = comparison.scene, comparison.ribbon.equilibrium.problem.energy
    found = []
    for name, clamp in (("start", scene.clamp_start), ("end", scene.clamp_end)):
        if clamp is None:
            continue
        if scene.shell.clamp == "edge" and clamp.ruling == "free":
            found.append(f'the shell holds its whole edge: clamp.{name}.ruling = "straight" does the same')
        if scene.shell.clamp == "corners" and clamp.ruling == "straight":
            found.append(f'the shell is held at its corners only: clamp.{name}.ruling = "free" is nearer to that')
    if energy == "sadowsky":
        found.append('the shell has a finite width: model.energy = "wunderlich"')
    return [f"The ribbon need not be the shell's limit: {'; '.join(found)}."] if found else []


def ribbon_advice(scene: Scene, error: float | None) -> str | None:
    """What to do about a ribbon whose discretisation error (Hausdorff / l) is visible; None when it is not."""
    if error is None or error <= YARDSTICK:
        return None
    clamp = scene.clamp_start
    if scene.model.tolerance is not None:
        remedy = f"lower model.tolerance = {scene.model.tolerance:g}"
    elif clamp is not None and clamp.ruling == "straight" and scene.model.grading == "uniform":
        remedy = 'set model.grading = "clamp" (a straight ruling makes a layer there)'
    else:
        remedy = "raise model.elements, or give model.tolerance in its place"
    return f"The ribbon's discretisation error {error:.1e} l is above 1 permille of l: {remedy}."


def _vector(values: FloatArray, form: str = ".6f") -> str:
    """Components (3,) for a reader, those that are zero to rounding as 0."""
    rounding = 1e-10 * max(1.0, float(np.abs(values).max()))
    return " ".join(format(0.0 if abs(c) < rounding else c, form) for c in values)


def solve_rows(scene: Scene, run: RibbonRun, error: float | None) -> list[tuple[str, str]]:
    """What `ribbonbench solve` prints of a ribbon: name and text, rows of effects that are off left out."""
    e = run.equilibrium
    used = e.problem.formulation
    parts = [f"elastic {e.energy.elastic:.6f}", f"gravity {e.energy.gravity:.6f}"]
    if any(wall.stiffness is not None for wall in scene.walls):
        parts.append(f"plates {e.energy.plates:.6f}")
    rows = [
        ("status", e.message),
        ("residual", f"{e.residual:.1e} after {e.iterations} iteration{'s' if e.iterations != 1 else ''}"),
        ("lowest eigenvalue", f"{e.lowest_eigenvalue:.4g}"),
        ("energy / (D w / l)", ", ".join(parts)),
        ("middle / l", _vector(e.middle.position)),
        ("end / l" if scene.clamp_end or scene.closure else "free end / l", _vector(e.end.position)),
        ("largest |eta|", f"{e.max_abs_eta:.4g}; |eta'| w/2 up to {e.max_abs_eta_prime_w_half:.3g}"),
    ]
    if scene.clamp_start is not None:
        rows.append(("force at s = 0 / (D w / l^2)", _vector(e.start.force, ".6g")))
    if e.end_support is not None:
        rows.append(("force at s = l / (D w / l^2)", _vector(e.end_support.force, ".6g")))
    if len(e.walls) == len(scene.walls):
        for number, (wall, found) in enumerate(zip(scene.walls, e.walls, strict=True)):
            plate = "" if found.height is None else f", plate at {found.height:.4g} l from rest"
            rows.append(
                (
                    f"force of wall {number if wall.name is None else wall.name}",
                    f"{_vector(found.force, '.6g')}; {found.contacts.size} joints in contact{plate}",
                )
            )
    rows.append(("model", f"{e.problem.energy}, {used}, {e.problem.lengths.size} segments"))
    rows.append((f"why {used}", formulation_why(scene, used)))
    if run.way is not None:
        accepted = sum(bool(entry["accepted"]) for entry in e.log)
        resumed = ", continued from an interrupted run" if run.way.resumed else ""
        rows.append(
            ("path", f"{run.way.stages} stages, {accepted} steps, {len(e.log) - accepted} rejected{resumed}: path.csv")
        )
    how = "extrapolated from two and four times the segments" if e.tolerance_error is None else "of the placed segments"
    rows.append(("discretisation error", "unknown" if error is None else f"{error:.1e} l ({how})"))
    rows.append(("time", f"{run.warm * 1e3:.3g} ms warm, {run.first:.3g} s for the first solve"))
    return rows


def _undecided(comparison: Comparison) -> list[str]:
    """Rows where no difference between the models can be claimed, and why."""
    said = []
    for row in comparison.rows:
        if row.hausdorff is None or row.claimed:
            continue
        head = f"w/h = {row.width_to_thickness:g}: no difference is claimed, "
        if row.ribbon_error is None:
            said.append(f"{head}the ribbon's discretisation error is unknown (it, or its refinement, is not stable).")
        elif row.shell_error is None:
            said.append(f"{head}the shell's discretisation error is unknown (the coarser mesh did not converge).")
        else:
            said.append(
                f"{head}the distance {row.hausdorff:.1e} l is not above the errors; use a finer shell (shell.elements) "
                "or more ribbon segments."
            )
    return said
