"""`result.json`: the contract that every command keeps (design document, Contracts)."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.models.ribbon_build import formulation_why
from compare.models.ribbon_run import ElasticaRun, RibbonRun
from compare.models.ribbon_way import Way
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.studies.compare import Comparison
from ribbon import Equilibrium, Pose


def _pose(pose: Pose) -> dict[str, Any]:
    return {"position": pose.position, "frame": pose.frame}


def wall_results(scene: Scene, e: Equilibrium) -> list[dict[str, Any]]:
    """What every wall exerts on the ribbon: force (3,) in D w / l^2, abscissae of joints in contact, a plate's height.

    A wall without a name goes by its number, as in the keys of the scene.
    """
    return [
        {
            "name": str(number) if wall.name is None else wall.name,
            "force": found.force,
            "contacts": found.contacts,
            "height": found.height,
        }
        for number, (wall, found) in enumerate(zip(scene.walls, e.walls, strict=True))
    ]


def path_result(way: Way) -> dict[str, Any]:
    """The steps of a way; `log` has one entry for each of them, the rejected ones too."""
    log = way.equilibrium.log
    accepted = sum(bool(entry["accepted"]) for entry in log)
    return {
        "stages": way.stages,
        "steps": accepted,
        "rejected": len(log) - accepted,
        "jumps": sum(bool(entry["accepted"] and entry["jump"]) for entry in log),
        "resumed": way.resumed,
        "log": log,
    }


def ribbon_result(scene: Scene, run: RibbonRun, error: float | None = None) -> dict[str, Any]:
    """The contract's keys of a ribbon solve; `error`: its discretisation error (Hausdorff / l) when measured."""
    e: Equilibrium = run.equilibrium
    parts = ("bending", "natural", "elastic", "gravity", "total") + (("plates",) if _has_plates(scene) else ())
    problem: Any = e.problem
    lower, upper = problem.bounds()
    result = {
        "scene": scene.name,
        "title": scene.title,
        "status": e.status.code,
        "message": e.message,
        "stable": e.stable,
        "lowest_eigenvalue": e.lowest_eigenvalue,
        "residual": e.residual,
        "iterations": e.iterations,
        "evaluations": e.evaluations,
        "energy": {name: getattr(e.energy, name) for name in parts},
        "end": _pose(e.end),
        "middle": _pose(e.middle),
        "max_abs_eta": e.max_abs_eta,
        "max_abs_eta_prime_w_half": e.max_abs_eta_prime_w_half,
        "active_bounds": e.active_bounds,
        **_supports(scene, e),
        "discretisation_error": error,
        "tolerance_error": e.tolerance_error,
        "seconds": {"first": run.first, "warm": run.warm},
        "model": {
            "energy": e.problem.energy,
            "formulation": e.problem.formulation,
            "why": formulation_why(scene, e.problem.formulation),
            "elements": int(e.problem.lengths.size),
            "element_lengths": e.problem.lengths,
            "unknowns": int(np.sum(lower < upper)),
            "constraints": problem.row_count,
        },
        "provenance": {**provenance(scene, e.options), "linear_solver": "MUMPS (sequential, in Ipopt)"},
    }
    if run.way is not None:
        result["path"] = path_result(run.way)
    return result


def _has_plates(scene: Scene) -> bool:
    return any(wall.stiffness is not None for wall in scene.walls)


def _supports(scene: Scene, e: Equilibrium) -> dict[str, Any]:
    """Forces (D w / l^2) and moments (D w / l) that clamps and walls exert on the ribbon.

    The walls of a way that stopped before its last stage may be others than the scene's: they are then not listed.
    """
    end = e.end_support
    listed = wall_results(scene, e) if len(e.walls) == len(scene.walls) else []
    return {
        "forces": {
            "start": e.start.force,
            "end": None if end is None else end.force,
            "walls": [wall["force"] for wall in listed],
        },
        "moments": {"start": e.start.moment, "end": None if end is None else end.moment},
        "walls": listed,
    }


def elastica_result(scene: Scene, run: ElasticaRun) -> dict[str, Any]:
    """The contract's keys of an elastica solve."""
    r = run.result
    ends = np.array([1.0, 0.5])
    points, frames = run.centreline(ends), run.frames(ends)
    # the elastica measures heights from its clamp, the contract from the origin
    height = 0.0 if scene.up is None else float(scene.position @ scene.up)
    datum, tip_datum = scene.gamma * height, scene.tip_load * height
    known = r.status.value != "limit_point"
    return {
        "scene": scene.name,
        "title": scene.title,
        "status": r.status.value,
        "message": r.message,
        "stable": bool(r.stable) if known else None,
        "lowest_eigenvalue": r.lowest_eigenvalue,
        "residual": r.residual,
        "iterations": r.iterations,
        "energy": {
            "bending": r.energy.bending,
            "elastic": r.energy.bending,
            "gravity": r.energy.gravity + datum,
            **({} if scene.tip is None else {"tip": r.energy.force + tip_datum}),
            "total": r.energy.total + datum + tip_datum,
        },
        "end": {"position": points[0], "frame": frames[0]},
        "middle": {"position": points[1], "frame": frames[1]},
        "max_abs_eta": 0.0,
        "max_abs_eta_prime_w_half": 0.0,
        **elastica_supports(scene, run),
        "discretisation_error": r.error,
        "seconds": {"first": run.first, "warm": run.warm},
        "model": {"energy": "elastica", "formulation": "theta", "elements": len(r.nodes) - 1, "degree": r.degree},
        "start": run.start,
        "path": {"reached": r.load_factor, "steps": r.steps, "limit_points": r.limits, "switches": r.switches},
        **({} if scene.tip is None else {"tip_load": scene.tip_load}),
        "provenance": provenance(scene),
    }


def elastica_supports(scene: Scene, run: ElasticaRun) -> dict[str, Any]:
    """Forces (D w / l^2) and moments (D w / l) on both ends, in space; None at an end that nothing holds.

    A load at the tip is no support: it is `tip_load`.
    """
    forces = run.result.forces
    held = scene.clamp_end is not None
    return {
        "forces": {
            "start": run.in_space(forces.start),
            "end": run.in_space(forces.end) if held else None,
            "walls": [],
        },
        "moments": {
            "start": run.couple(forces.start_moment),
            "end": run.couple(forces.end_moment) if held else None,
        },
    }


def comparison_result(comparison: Comparison) -> dict[str, Any]:
    """The ribbon's keys with one row per shell run, the slope and, in planar scenes, the elastica."""
    result = ribbon_result(comparison.scene, comparison.ribbon, comparison.ribbon_error)
    result["rows"] = [
        {**{name: getattr(row, name) for name in row.__dataclass_fields__}, "ratio": row.ratio}
        for row in comparison.rows
    ]
    result["slope"] = comparison.slope
    result["distance_falls"] = comparison.falls
    result["complete"] = comparison.ok
    result["provenance"]["shell"] = next(
        (c.data["provenance"] for c in comparison.shells if "provenance" in c.data), None
    )
    if comparison.elastica is not None:
        r = comparison.elastica.result
        result["elastica"] = {
            "status": r.status.value,
            "message": r.message,
            "stable": bool(r.stable),
            "start": comparison.elastica.start,
            "energy": {"elastic": r.energy.bending, "gravity": r.energy.gravity, "total": r.energy.total},
            **elastica_supports(comparison.scene, comparison.elastica),
            "discretisation_error": r.error,
            "ribbon_centreline": comparison.elastica_distance,
            "seconds": {"first": comparison.elastica.first, "warm": comparison.elastica.warm},
        }
    return result
