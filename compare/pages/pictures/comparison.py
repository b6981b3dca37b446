"""Pictures: distance against h/w, and the shapes on top of each other (thesis, figure 4.2). No screen is needed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from compare.measure.grades import YARDSTICK
from compare.page.drawing import RIBBON_COLOUR, save, screen_axes, shell_colour
from compare.studies.compare import Comparison

FloatArray = NDArray[np.float64]


def convergence(path: Path, comparison: Comparison) -> Path:
    """Distance between the models and both discretisation errors against h/w, log-log, with the yardstick drawn."""
    figure = Figure(figsize=(6.4, 4.6))
    axes = figure.add_subplot()
    shown = [row for row in comparison.rows if row.hausdorff is not None]
    x = np.array([1.0 / row.width_to_thickness for row in shown])
    axes.axhline(YARDSTICK, color="0.35", lw=1, ls=":", label="1 permille of l: no visible difference (thesis)")
    if shown:
        axes.loglog(x, [r.hausdorff for r in shown], "o-", color=RIBBON_COLOUR, label="ribbon to shell (Hausdorff)")
        axes.loglog(x, [r.centreline for r in shown], "^--", color="#6fa3d8", ms=5, label="centrelines, equal s")
        errors = [(a, r.shell_error) for a, r in zip(x, shown, strict=True) if r.shell_error]
        if errors:
            axes.loglog(*zip(*errors, strict=True), "s-", color="0.55", ms=4, label="shell's error (bound)")
        if comparison.elastica is not None:
            planar = [r.elastica for r in shown]
            axes.loglog(x, planar, "d:", color="#c2662d", ms=5, label="elastica to shell, centrelines")
        hollow = [(a, r.hausdorff) for a, r in zip(x, shown, strict=True) if not r.claimed]
        if hollow:
            x_hollow, y_hollow = zip(*hollow, strict=True)
            axes.loglog(
                x_hollow,
                y_hollow,
                "o",
                mfc="white",
                mec=RIBBON_COLOUR,
                ms=9,
                label="no claim",
            )
    if comparison.fast.error:
        axes.axhline(comparison.fast.error, color=RIBBON_COLOUR, lw=1, ls="--", label="ribbon's error")
    if comparison.slope is not None:
        slope = comparison.slope
        claimed = [(1.0 / r.width_to_thickness, r.hausdorff) for r in comparison.rows if r.claimed and r.hausdorff]
        centre = np.exp(np.mean(np.log(np.array(claimed)), axis=0))
        ends = np.array([min(c[0] for c in claimed), max(c[0] for c in claimed)])
        axes.loglog(ends, centre[1] * (ends / centre[0]) ** slope.value, "-", color="black", lw=0.8, alpha=0.7)
        axes.annotate(f"slope {slope.value:.2f}", (centre[0], centre[1]), (8, -14), textcoords="offset points")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("h / w")
    axes.set_ylabel("length / l")
    axes.set_title(comparison.scene.title)
    axes.grid(True, which="both", lw=0.3, alpha=0.6)
    axes.legend(fontsize=7.5, loc="best")
    return save(figure, path)


def shapes(path: Path, comparison: Comparison) -> Path:
    """The ribbon (blue) over the shells (a colour each): two side views, one in perspective."""
    figure = Figure(figsize=(14.0, 5.2), layout="constrained")
    shown = [
        (row.width_to_thickness, comparison.grid.of(state.shape))
        for row, state in zip(comparison.rows, comparison.shells, strict=True)
        if state.ok and state.shape is not None
    ]
    assert comparison.fast.shape is not None
    blue = comparison.grid.of(comparison.fast.shape)
    surfaces = [(shell_colour(i), f"shell, w/h = {ratio:g}", grid) for i, (ratio, grid) in enumerate(shown)]
    surfaces.append((RIBBON_COLOUR, comparison.fast.model, blue))
    up = comparison.scene.up
    for place, screen in enumerate(screen_axes([s[2] for s in surfaces], up), start=1):
        axes = figure.add_subplot(1, 3, place)
        for colour, label, grid in surfaces:
            flat = grid @ screen.T
            outline = np.concatenate([flat[:, 0], flat[::-1, -1]])
            axes.fill(outline[:, 0], outline[:, 1], color=colour, alpha=0.25, lw=0)
            middle = flat[:, flat.shape[1] // 2]
            axes.plot(
                middle[:, 0], middle[:, 1], color=colour, lw=1.8 if label == comparison.fast.model else 1.2, label=label
            )
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(True, lw=0.3, alpha=0.6)
        axes.set_xlabel("horizontal / l" if up is not None else "x / l")
        axes.set_ylabel("up / l" if up is not None else "z / l")
    figure.axes[0].legend(fontsize=8, loc="best")
    _perspective(figure, surfaces, up)
    figure.suptitle(comparison.scene.title)
    return save(figure, path)


def _perspective(figure: Figure, surfaces: list[tuple[str, str, FloatArray]], up: FloatArray | None) -> None:
    """A rendered view (VTK, off screen) in the third place; a matplotlib one when VTK cannot render here."""
    try:
        image = _render(surfaces, up)
    except Exception as error:
        image = None
        reason = f"(VTK cannot render here: {type(error).__name__})"
    if image is not None:
        axes = figure.add_subplot(1, 3, 3)
        axes.imshow(image[_ink(image)])
        axes.set_axis_off()
        return
    axes = figure.add_subplot(1, 3, 3, projection="3d")
    for colour, _, grid in surfaces:
        axes.plot_surface(*np.moveaxis(grid[::4, ::2], 2, 0), color=colour, alpha=0.8)  # type: ignore[attr-defined]
    axes.set_title(reason, fontsize=7)


def _ink(image: NDArray[np.uint8]) -> tuple[slice, slice]:
    """The part of a picture (rows, columns, 3) that is not white, with a small margin."""
    drawn = (image < 250).any(axis=2)
    if not drawn.any():
        return slice(None), slice(None)
    found = []
    for axis in (1, 0):
        places = np.nonzero(drawn.any(axis=axis))[0]
        found.append(slice(max(0, places[0] - 12), places[-1] + 13))
    return found[0], found[1]


def _render(surfaces: list[tuple[str, str, FloatArray]], up: FloatArray | None) -> NDArray[np.uint8] | None:
    if not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    vertical = np.array([0.0, 0.0, 1.0]) if up is None else np.asarray(up, dtype=float)
    first, _ = screen_axes([s[2] for s in surfaces], up)
    depth = np.cross(first[0], vertical)
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[900, 900])
    try:
        plotter.set_background("white")
        for colour, _, grid in surfaces:
            mesh = pyvista.StructuredGrid(*(np.ascontiguousarray(grid[:, :, k])[:, :, None] for k in range(3)))
            plotter.add_mesh(mesh, color=colour, smooth_shading=True, ambient=0.35)
        view = 0.75 * depth + 0.45 * first[0] + 0.3 * vertical
        centre = np.concatenate([s[2].reshape(-1, 3) for s in surfaces]).mean(axis=0)
        plotter.camera_position = [tuple(centre + 4.0 * view), tuple(centre), tuple(vertical)]
        plotter.reset_camera()
        return plotter.screenshot(return_img=True)
    finally:
        plotter.close()
