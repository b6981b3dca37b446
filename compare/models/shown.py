"""How a state of any model shows itself: in a line, as a small table, as a picture, in a file, in PyVista.

Nothing is loaded before it is needed: matplotlib in `plot`, PyVista in `to_pyvista`.
"""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

import numpy as np

from compare.store.finite import explained
from ribbonbench.errors import BadInput, Missing

#: Points along and across of a surface that is drawn or saved.
ALONG, ACROSS = 401, 9


class Shown:
    """What `compare.models.base.State` offers to people; lengths in l, in SI beside them where `units` are known."""

    def __repr__(self) -> str:
        state: Any = self
        energy = (
            "unknown" if state.energy is None or state.energy.total is None else f"{state.energy.total:.6g} D w / l"
        )
        end = "" if state.end is None else f", end ({_vector(state.end.position)}) l"
        return f"State({state.model}, {state.word}, energy {energy}{end}, {state.size.label} elements)"

    def _repr_html_(self) -> str:
        body = "".join(f"<tr><th>{html.escape(a)}</th><td>{html.escape(b)}</td></tr>" for a, b in self._rows())
        return f"<table>{body}</table>"

    def _rows(self) -> list[tuple[str, str]]:
        state: Any = self
        units = state.units
        found = [("model", f"{state.model}, {state.size.label} elements"), ("status", state.message or state.word)]
        if state.energy is not None and state.energy.total is not None:
            found.append(("energy", _both(units, state.energy.total, "D w / l")))
        if state.end is not None:
            end = f"({_vector(state.end.position)}) l"
            if units.known:
                end += f" = ({_vector(units.length * state.end.position)}) m"
            found.append(("end", end))
        for name, support in (("force at s = 0", state.supports.start), ("force at s = l", state.supports.end)):
            if support is not None:
                found.append((f"{name}, size", _both(units, float(np.linalg.norm(support.force)), "D w / l^2")))
        if "forces" in state.whys:
            found.append(("forces", f"not determined: {state.whys['forces']}"))
        if state.error is not None:
            found.append(("discretisation error", _both(units, state.error, "l")))
        return found

    def _grid(self) -> tuple[Any, Any, Any]:
        """s (k,), v (m,), points (k, m, 3); `BadInput` without a shape."""
        state: Any = self
        if state.shape is None:
            raise BadInput("state", state.word, "has no shape to show", "solve it again with other settings")
        s = np.linspace(0.0, 1.0, ALONG)
        v = np.linspace(-0.5, 0.5, ACROSS) * state.width
        return s, v, state.shape.points(s, v)

    def plot(self, axes: Any = None) -> Any:
        """Draws the surface in space with matplotlib, on new 3-D axes where none are given; returns the axes."""
        _, _, points = self._grid()
        from matplotlib import pyplot

        if axes is None:
            axes = pyplot.figure().add_subplot(projection="3d")
        axes.plot_surface(*np.moveaxis(points, 2, 0), rcount=ALONG, ccount=ACROSS, color="#6fa3d8", linewidth=0.0)
        axes.set_box_aspect(np.maximum(np.ptp(points.reshape(-1, 3), axis=0), 1e-3))
        for name in "xyz":
            getattr(axes, f"set_{name}label")(f"{name} / l")
        return axes

    def save(self, path: str | Path) -> Path:
        """Writes the numbers (.json), or numbers and arrays (.npz: `numbers` as a JSON text, s, v, points (k, m, 3),
        frames (k, 3, 3), and the model's fields by name); returns the path. `BadInput` for another suffix."""
        state: Any = self
        path = Path(path)
        if path.suffix not in (".json", ".npz"):
            raise BadInput("path", str(path), "ends neither in .json nor in .npz", "give one of the two")
        told = {
            "model": state.model, "status": state.word, "message": state.message, "stable": state.stable,
            "residual": state.residual, "lowest_eigenvalue": state.lowest_eigenvalue, "error": state.error,
            "energy": None if state.energy is None else state.energy.to_dict(),
            "end": state.end, "middle": state.middle,
            "supports": {"start": state.supports.start, "end": state.supports.end, "walls": state.supports.walls},
            "units": {**state.units.to_dict(), "known": state.units.known},
            **{f"{name}_why": why for name, why in state.whys.items()},
        }  # fmt: skip
        text = json.dumps(explained(told), indent=2, allow_nan=False)
        if path.suffix == ".json":
            path.write_text(text + "\n", encoding="utf-8")
            return path
        s, v, points = self._grid()
        fields = {f"field_{name}": values for name, values in state.shape.fields(s, v).items()}
        frames = state.shape.frames(s)
        np.savez_compressed(path, numbers=np.array(text), s=s, v=v, points=points, frames=frames, **fields)
        return path

    def to_pyvista(self) -> Any:
        """The surface as `pyvista.StructuredGrid` with the model's fields, units of l; `Missing` without PyVista."""
        try:
            import pyvista
        except ImportError:
            raise Missing("pyvista", "pip install pyvista") from None
        state: Any = self
        s, v, points = self._grid()
        # a grid whose first index runs fastest has the points in the order of ours
        mesh = pyvista.StructuredGrid()
        mesh.points = points.reshape(-1, 3)
        mesh.dimensions = (len(v), len(s), 1)
        for name, values in state.shape.fields(s, v).items():
            mesh.point_data[name] = values.reshape(len(s) * len(v), *values.shape[2:])
        return mesh


def _vector(values: Any) -> str:
    return ", ".join(f"{float(v) + 0.0:.4g}" for v in values)


def _both(units: Any, value: float, unit: str) -> str:
    text = f"{value:.6g} {unit}"
    return f"{text} = {units.text(value, unit, 4)}" if units.known else text
