"""How a result shows itself: in a line, as a small table, as a picture, in a file, in PyVista.

Nothing here is loaded before it is needed: matplotlib in `plot`, PyVista in `to_pyvista`.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
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
#: States that a view goes through at most, and cells of each along and across.
STATES, FILM_CELLS = 60, (120, 1)


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


class Seen:
    """States one after another, to be turned and gone through in a notebook (`_repr_html_`) or a file (`save`): one
    text that needs no library and no network. What is asked of a kernel is nothing: states are shown, not solved."""

    def __init__(self, states: Sequence[Equilibrium], labels: Sequence[str]) -> None:
        chosen = np.unique(np.linspace(0, len(states) - 1, min(len(states), STATES)).round().astype(int))
        self.labels = [labels[k] for k in chosen]
        #: Positions (K, k, m, 3) in l, the weight along -z.
        self.points = np.array([states[k].surface(*FILM_CELLS).grid for k in chosen]) @ upright(states[-1])

    def page(self) -> str:
        """The HTML of the whole view."""
        low = self.points.min(axis=(0, 1, 2))
        span = float(np.max(self.points.max(axis=(0, 1, 2)) - low)) or 1.0
        packed = np.round((self.points - low) / span * 65535.0).astype("<u2")
        data = {
            "grid": self.points.shape[:3],
            "labels": self.labels,
            "centre": ((self.points.max(axis=(0, 1, 2)) - low) / span / 2.0).tolist(),
            "places": base64.b64encode(packed.tobytes()).decode("ascii"),
        }
        text = json.dumps(data).replace("<", "\\u003c")
        return _PAGE.replace("DATA", text)

    def save(self, path: str | Path) -> Path:
        """Writes the view as an HTML file; returns the path."""
        path = Path(path)
        path.write_text("<!DOCTYPE html><meta charset=utf-8>" + self.page() + "\n", encoding="utf-8")
        return path

    def _repr_html_(self) -> str:
        """For notebooks: in a frame of its own, whose script reaches nothing of the notebook."""
        page = html.escape(self.page(), quote=True)
        return (
            f'<iframe sandbox="allow-scripts" srcdoc="{page}" '
            'style="width:100%;max-width:50rem;height:27rem;border:0"></iframe>'
        )


def upright(result: Equilibrium) -> Any:
    """Matrix (3, 3) whose product with positions (k, 3) from the left has the weight along -z; 1 without a weight."""
    gravity = result.problem.gravity
    if gravity is None:
        return np.eye(3)
    up = np.asarray(gravity.up, dtype=float)
    across = np.eye(3)[np.argmin(np.abs(up))]
    across = across - (across @ up) * up
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(up, across), up])


def label(result: Equilibrium) -> str:
    """A state in a few words."""
    return f"{result.status.code}, energy {result.energy.total:.6g} D w / l"


#: Cells from far to near, lit from the eye, of a grid of places (x, y, z) in [-0.5, 0.5]; and a drag that turns them.
PAINT = """
function paint(canvas, along, across, at, view) {
  const ratio = window.devicePixelRatio || 1, width = canvas.width = canvas.clientWidth * ratio;
  const height = canvas.height = canvas.clientHeight * ratio, context = canvas.getContext("2d");
  const size = 1.1 * Math.min(width, height), [ca, sa] = [Math.cos(view.azimuth), Math.sin(view.azimuth)];
  const [ce, se] = [Math.cos(view.elevation), Math.sin(view.elevation)], seen = [];
  for (let i = 0; i < along * across; i++) {
    const [x, y, z] = at(i), side = x * ca + y * sa, far = -x * sa + y * ca;
    seen.push([width / 2 + size * side, height / 2 - size * (z * ce + far * se), far * ce - z * se]);
  }
  const cells = [];
  for (let i = 0; i + 1 < along; i++) for (let j = 0; j + 1 < across; j++) {
    const c = [i * across + j, (i + 1) * across + j, (i + 1) * across + j + 1, i * across + j + 1].map((k) => seen[k]);
    const u = [0, 1, 2].map((k) => c[2][k] - c[0][k]), w = [0, 1, 2].map((k) => c[3][k] - c[1][k]);
    const a = [u[0] / size, u[1] / size, u[2]], b = [w[0] / size, w[1] / size, w[2]];
    const n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const light = Math.abs(n[2]) / (Math.hypot(...n) || 1);
    cells.push([c.reduce((sum, p) => sum + p[2], 0), c, 0.35 + 0.65 * light, i === 0]);
  }
  cells.sort((a, b) => b[0] - a[0]);
  for (const [, c, light, first] of cells) {
    context.beginPath();
    c.forEach((p, k) => (k ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.closePath();
    const [r, g, b] = first ? [213, 94, 0] : [31, 95, 168];
    context.fillStyle = context.strokeStyle = `rgb(${r * light}, ${g * light}, ${b * light})`;
    context.fill();
    context.stroke();
  }
}
function turning(canvas, view, draw) {
  let last = null;
  canvas.addEventListener("pointerdown", (e) => {
    last = [e.clientX, e.clientY];
    canvas.setPointerCapture(e.pointerId);
  });
  canvas.addEventListener("pointerup", () => { last = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!last) return;
    view.azimuth += 0.008 * (e.clientX - last[0]);
    view.elevation = Math.max(-1.5, Math.min(1.5, view.elevation + 0.008 * (e.clientY - last[1])));
    last = [e.clientX, e.clientY];
    draw();
  });
}
"""
#: The view: a drag turns it, the slider goes through the states.
_PAGE = (
    """<style>body{margin:0;font:14px sans-serif}canvas{width:100%;height:22rem;background:#edf0f3;cursor:grab;
touch-action:none}input{width:60%}</style><canvas aria-label="The strip: drag to turn"></canvas>
<label>state <input type="range" min="0" step="1"></label> <output></output><script>"use strict";
const data = DATA, [count, along, across] = data.grid, canvas = document.querySelector("canvas");
const bytes = Uint8Array.from(atob(data.places), (c) => c.charCodeAt(0)), places = new Uint16Array(bytes.buffer);
const slide = document.querySelector("input"), output = document.querySelector("output");
const view = { azimuth: -1, elevation: 0.35 };
slide.max = slide.value = count - 1;
function draw() {
  const start = 3 * along * across * slide.value;
  const at = (i) => [0, 1, 2].map((k) => places[start + 3 * i + k] / 65535 - data.centre[k]);
  paint(canvas, along, across, at, view);
  output.textContent = `${Number(slide.value) + 1} of ${count}: ${data.labels[slide.value]}`;
}
"""
    + PAINT
    + """
slide.addEventListener("input", draw);
turning(canvas, view, draw);
window.addEventListener("resize", draw);
draw();
</script>"""
)
