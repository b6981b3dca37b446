"""How a result shows itself: in a line, as a small table, as a picture, in a file, in PyVista.

Nothing here is loaded before it is needed: matplotlib in `plot`, PyVista in `to_pyvista`.
"""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

import numpy as np

from ribbon.errors import RibbonInputError

Equilibrium = Any
"""A `ribbon.Equilibrium`, which is built on this module."""

#: Parts of the energy that are saved.
_ENERGIES = ("bending", "natural", "gravity", "plates", "tip", "total")
#: Points of a saved centreline, cells of a surface that is drawn.
LINE_POINTS, ALONG, ACROSS = 401, 200, 8


def rows(result: Equilibrium) -> list[tuple[str, str]]:
    """Name and text of what a reader wants first; in SI beside l and D w where the strip knows its stiffness."""
    known = result.problem.strip.bending_stiffness is not None
    energy = f"{result.energy.total:.6g} D w / l"
    end = f"({_vector(result.end.position)}) l"
    if known:
        energy += f" = {result.si.energy['total']:.4g} J"
        end += f" = ({_vector(result.si.end_position)}) m"
    found = [
        ("status", result.status.value),
        ("energy", energy),
        ("end", end),
        ("segments", str(result.problem.lengths.size)),
        ("lowest eigenvalue", _eigenvalue(result)),
        ("residual", f"{result.residual:.1e} after {result.iterations} iterations"),
    ]
    if result.forces_why:
        found.append(("forces", f"not determined: {result.forces_why}"))
    elif result.start is not None and np.any(result.start.force):
        force = f"({_vector(result.start.force)}) D w / l^2"
        found.append(("force at s = 0", force + (f" = ({_vector(result.si.start_force)}) N" if known else "")))
    return found


def _eigenvalue(result: Equilibrium) -> str:
    if np.isfinite(result.lowest_eigenvalue):
        return f"{result.lowest_eigenvalue:.4g}"
    return "none: no freedom is left" if result.lowest_eigenvalue == np.inf else "not judged"


def _vector(values: Any) -> str:
    return ", ".join(f"{float(v) + 0.0:.4g}" for v in values)


def line(result: Equilibrium) -> str:
    """One line: status, energy, end, number of segments."""
    energy, end = f"energy {result.energy.total:.6g} D w / l", f"end ({_vector(result.end.position)}) l"
    return f"Equilibrium({result.status.code}, {energy}, {end}, {result.problem.lengths.size} segments)"


def table(result: Equilibrium) -> str:
    """A small table in HTML, for notebooks."""
    body = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>" for name, text in rows(result))
    return f"<table>{body}</table>"


def plot(result: Equilibrium, axes: Any = None) -> Any:
    """The surface in space, in units of l; returns the 3-D axes, new ones where none are given."""
    from matplotlib import pyplot

    if axes is None:
        axes = pyplot.figure().add_subplot(projection="3d")
    surface = result.surface(ALONG, ACROSS)
    x, y, z = surface.points.T
    axes.plot_trisurf(x, y, z, triangles=surface.triangles, color="#6fa3d8", linewidth=0.0)
    axes.set_box_aspect(np.maximum(np.ptp(surface.points, axis=0), 1e-3))
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} / l")
    axes.set_title(result.status.code)
    return axes


def numbers(result: Equilibrium) -> dict[str, Any]:
    """Numbers in Python's own types, in l and D w; `si`: in m, N, N m, J; None where the strip does not know them."""
    strip, start, end = result.problem.strip, result.start, result.end_support
    known = strip.bending_stiffness is not None
    return {
        "status": result.status.code,
        "message": result.message,
        "stable": result.stable,
        "lowest_eigenvalue": _finite(result.lowest_eigenvalue),
        **({} if np.isfinite(result.lowest_eigenvalue) else {"lowest_eigenvalue_why": _eigenvalue(result)}),
        "residual": _finite(result.residual),
        "iterations": result.iterations,
        "energy": {name: _finite(getattr(result.energy, name)) for name in _ENERGIES},
        "end": {"position": result.end.position.tolist(), "frame": result.end.frame.tolist()},
        "forces": {
            "start": None if start is None else start.force.tolist(),
            "end": None if end is None else end.force.tolist(),
            "walls": [wall.force.tolist() for wall in result.walls],
        },
        "moments": {
            "start": None if start is None else start.moment.tolist(),
            "end": None if end is None else end.moment.tolist(),
        },
        **({"forces_why": result.forces_why} if result.forces_why else {}),
        "segments": int(result.problem.lengths.size),
        "penetration": result.penetration,
        "strip": {
            "length": strip.length, "width": strip.width, "poisson": strip.poisson, "gamma": strip.gamma,
            "natural_curvature": np.array(strip.natural_curvature).tolist(),
            "thickness": strip.thickness, "bending_stiffness": strip.bending_stiffness,
        },
        "si": None if not known else {
            "energy": dict(result.si.energy),
            "end_position": result.si.end_position.tolist(),
            "start_force": None if start is None else result.si.start_force.tolist(),
            "start_moment": None if start is None else result.si.start_moment.tolist(),
            "end_force": None if end is None else result.si.end_force.tolist(),
            "end_moment": None if end is None else result.si.end_moment.tolist(),
        },
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def save(result: Equilibrium, path: str | Path) -> Path:
    """Writes the numbers (.json), or numbers and arrays (.npz); returns the path. `RibbonInputError`: another suffix.

    .npz: `numbers` (the JSON as a text); of the centreline s (k,), position (k, 3), frame (k, 3, 3), omega (k,), eta
    (k,), or tau (k,) where the twist is free; segment_lengths (p,) and parameters (p, 4 or 6), from which all of the
    shape follows (`Equilibrium.parameters`); of the surface points (N, 3), material (N, 2), triangles (T, 3). Units of
    l. Made to be read by others: no solve goes on from it.
    """
    path = Path(path)
    said = json.dumps(numbers(result), indent=2, allow_nan=False)
    if path.suffix == ".json":
        path.write_text(said + "\n", encoding="utf-8")
        return path
    if path.suffix != ".npz":
        raise RibbonInputError("path", str(path), "ends neither in .json nor in .npz")
    s = np.linspace(0.0, 1.0, LINE_POINTS)
    surface = result.surface()
    np.savez_compressed(
        path, numbers=np.array(said), s=s, position=result.position(s), frame=result.frame(s), omega=result.omega(s),
        **_second(result, s), segment_lengths=result.problem.lengths, parameters=result.parameters,
        points=surface.points, material=surface.material, triangles=surface.triangles,
    )  # fmt: skip
    return path


def to_pyvista(result: Equilibrium, along: int = 400, across: int = 8) -> Any:
    """The surface as `pyvista.PolyData` in units of l, with S, v, omega and eta (of the ruling through each point), or
    the twist tau where it is free.

    ImportError, which says what to install, without PyVista.
    """
    try:
        import pyvista
    except ImportError as error:
        raise ImportError("to_pyvista needs PyVista: pip install pyvista") from error
    surface = result.surface(along, across)
    faces = np.column_stack([np.full(len(surface.triangles), 3), surface.triangles]).ravel()
    mesh = pyvista.PolyData(surface.points, faces)
    foot, _, _ = result.rulings(surface.material)
    mesh.point_data["S"], mesh.point_data["v"] = surface.material.T
    _, _, mesh.point_data["omega"], second = result.continued(foot)
    mesh.point_data["tau" if result.has_free_twist else "eta"] = second
    return mesh


def _second(result: Equilibrium, s: Any) -> dict[str, Any]:
    """What bends the strip beside omega, by its name: the ruling eta, or the twist tau that is free of it."""
    return {"tau": result.tau(s)} if result.has_free_twist else {"eta": result.eta(s)}
