"""The picture of shells: deformed shape and flat strip, coloured by the membrane's share of the elastic energy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from compare.measure.energy_map import HARDLY, density_on_grid, hardly_stored, shares
from compare.models.shell_process import ShellCase
from compare.page.drawing import NOTHING, quads, save, screen_axes
from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Smallest end of the colour scale: nearly nothing is not painted as much.
LEAST_SCALE = 0.05
#: Most rows of the picture: the first and the last runs are shown where there are more.
MOST_ROWS = 6
CLAMP_COLOUR = "#c2662d"
_COLOURS = "coolwarm"  # as in the thesis, figure 7.10: blue for none
#: Light on the shape in space: its direction, and the shade of a cell seen along its surface.
_LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
_DARK = 0.55


def _up(scene: Scene, case: ShellCase) -> NDArray[np.float64]:
    if scene.up is not None and scene.gamma:
        return np.asarray(scene.up, dtype=float)
    if scene.start_frame is not None:
        return np.asarray(scene.start_frame[:, 1], dtype=float)
    points = case.surface.points.reshape(-1, 3)
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][2])


def picture(path: Path, scene: Scene, cases: Sequence[tuple[float, ShellCase]]) -> Path:
    """One row per w/h: the shape in space, its side view, and the flat strip, coloured by the membrane's local share.

    `up` of the scene is upwards; without weight the clamp's normal, of a strip that nothing holds the direction of its
    least extent.
    """
    if len(cases) > MOST_ROWS:
        half = MOST_ROWS // 2
        cases = [*cases[:half], *cases[-half:]]
    figure = Figure(figsize=(14.0, 4.2 * len(cases) + 0.6), layout="constrained")
    places = figure.add_gridspec(len(cases), 3, width_ratios=(1.3, 1.0, 1.0))
    found = []
    for _, case in cases:
        density = density_on_grid(case)
        found.append(np.where(hardly_stored(density), np.nan, shares(density)[..., 1]))
    largest = max(LEAST_SCALE, *(float(np.nanmax(share, initial=0.0)) for share in found))
    colours = ScalarMappable(Normalize(0.0, largest), colormaps[_COLOURS].with_extremes(bad=NOTHING))
    up = _up(scene, cases[0][1])
    panels = []
    for row, ((ratio, case), share) in enumerate(zip(cases, found, strict=True)):
        degree = case.surface.degree
        fine = np.repeat(np.repeat(share, degree, axis=0), degree, axis=1).ravel()  # the parts of every element
        space = figure.add_subplot(places[row, 0], projection="3d")
        _space(space, case, fine, up, colours)
        whole = case.data["share"]
        space.set_title(
            f"w/h = {ratio:g}: {case.status}; membrane {100 * whole['membrane']:.3g} %, "
            f"shear {100 * whole['shear']:.3g} %",
            fontsize=9,
        )
        side = figure.add_subplot(places[row, 1])
        _side(side, case, fine, up, colours)
        flat = figure.add_subplot(places[row, 2])
        image = flat.pcolormesh(
            case.surface.s_nodes[::degree], case.surface.v_nodes[::degree] / scene.width, share.T,
            cmap=colours.get_cmap(), vmin=0.0, vmax=largest,
        )  # fmt: skip
        image.set_rasterized(True)
        flat.set_xlabel("S / l")
        flat.set_ylabel("v / w")
        flat.set_title("flat strip (stretched across)", fontsize=9)
        panels.append(flat)
    figure.colorbar(
        colours,
        ax=panels,
        label=f"membrane's share of the local elastic energy (grey: below {100 * HARDLY:g} % of the mean)",
    )
    figure.suptitle(scene.title)
    return save(figure, path)


def mesh_picture(path: Path, scene: Scene, found: Sequence[tuple[float, Mapping[str, Any]]]) -> Path:
    """Graded meshes (w/h, shell.json's `discretisation`): the elements on the flat strip, and what each column and row
    is to blame for of the error of the asked quantity.
    """
    figure = Figure(figsize=(11.0, 3.6 * len(found) + 0.4), layout="constrained")
    places = figure.add_gridspec(2 * len(found), 2, width_ratios=(4.0, 1.0))
    for row, (ratio, data) in enumerate(found):
        s, v = np.asarray(data["s_knots"]), np.asarray(data["v_knots"]) / scene.width
        flat = figure.add_subplot(places[2 * row + 1, 0])
        flat.vlines(s, v[0], v[-1], color="0.3", lw=0.4)
        flat.hlines(v, s[0], s[-1], color="0.3", lw=0.4)
        flat.set_xlabel("S / l")
        flat.set_ylabel("v / w")
        above = figure.add_subplot(places[2 * row, 0], sharex=flat)
        above.stairs(data["columns"], s, fill=True, color=CLAMP_COLOUR)
        above.set_ylabel("of columns")
        reached = "reached" if data["reached"] else "not reached"
        above.set_title(
            f"w/h = {ratio:g}: {len(s) - 1} x {len(v) - 1} elements, error of the {data['goal']} about "
            f"{data['estimate']:.2g} ({data['accuracy']:g} {reached})",
            fontsize=9,
        )
        beside = figure.add_subplot(places[2 * row + 1, 1], sharey=flat)
        beside.stairs(data["rows"], v, fill=True, color=CLAMP_COLOUR, orientation="horizontal")
        beside.set_xlabel("of rows")
    figure.suptitle(f"{scene.title}: indicators of the error on the last mesh")
    return save(figure, path)


def _side(axes: Any, case: ShellCase, share: FloatArray, up: FloatArray, colours: ScalarMappable) -> None:
    points = case.surface.points
    screen = screen_axes([points], up)[0]
    flat = points @ screen.T
    depth = quads(points).mean(axis=1) @ np.cross(screen[0], screen[1])
    order = np.argsort(-depth)  # what is nearer is drawn later
    cells = quads(flat)[order]
    shades = colours.to_rgba(share[order])
    axes.add_collection(PolyCollection(list(cells), facecolors=shades, edgecolors=shades, linewidths=0.3))
    edges = np.concatenate([flat[:, 0], flat[::-1, -1]])
    axes.plot(*edges.T, color="0.3", lw=0.6)
    for row in _held(case):
        edge = flat[row]
        axes.plot(*edge.T, **_sign(case))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("side view / l", fontsize=9)
    axes.grid(True, lw=0.3, alpha=0.6)


def _held(case: ShellCase) -> list[int]:
    """The rows of nodes at which clamps hold."""
    return [row for name, row in (("start", 0), ("end", -1)) if name in case.data.get("clamps", {"start": None})]


def _sign(case: ShellCase) -> dict[str, Any]:
    """How a held edge is drawn: a bar, or two dots for its corners."""
    if case.data.get("problem", {}).get("clamp") == "corners":
        return {"color": CLAMP_COLOUR, "ls": "none", "marker": "o", "ms": 4, "markevery": [0, -1]}
    return {"color": CLAMP_COLOUR, "lw": 3.0}


def _space(axes: Any, case: ShellCase, share: FloatArray, up: FloatArray, colours: ScalarMappable) -> None:
    points = case.surface.points
    first, second = (pair[0] for pair in screen_axes([points], up))
    turned = points @ np.array([first, second, up]).T
    cells = quads(turned)
    normal = np.cross(cells[:, 2] - cells[:, 0], cells[:, 3] - cells[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    light = _DARK + (1.0 - _DARK) * np.abs(normal @ _LIGHT)
    shades = colours.to_rgba(share)
    shades[:, :3] *= light[:, None]
    axes.add_collection3d(Poly3DCollection(cells, facecolors=shades, edgecolors=shades, linewidths=0.2))
    for row in _held(case):
        axes.plot(*turned[row].T, zorder=10, **_sign(case))
    low, high = turned.reshape(-1, 3).min(axis=0), turned.reshape(-1, 3).max(axis=0)
    size = np.maximum(high - low, 0.15 * float((high - low).max()))
    middle = 0.5 * (low + high)
    for setter, a in ((axes.set_xlim, 0), (axes.set_ylim, 1), (axes.set_zlim, 2)):
        setter(middle[a] - 0.5 * size[a], middle[a] + 0.5 * size[a])
    axes.set_box_aspect(size, zoom=0.85)
    axes.view_init(elev=28.0, azim=-62.0)
    axes.set_axis_off()
