"""The fold of a tape spring in space: the end of test 4.1 in opposite sense, coloured by its curvature across."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from compare.page.drawing import save
from compare.registry import model
from compare.scene.scene import load

#: Elements, and points along and across that are drawn.
ELEMENTS, ALONG, ACROSS = 200, 301, 41
#: The part of the tape that is drawn, in l.
PART = (0.38, 0.62)


def draw(path: Path) -> None:
    """Writes the picture; raises AssertionError where the state is not found."""
    scene = load("tape_4_1").replace({"model.elements": ELEMENTS})
    state = model("tape").solve(scene)
    assert state.status.ok, state.message
    assert state.shape is not None
    s, v = np.linspace(*PART, ALONG), np.linspace(-0.5, 0.5, ACROSS) * scene.width
    points = 1000.0 * scene.strip.length * state.shape.points(s, v)
    across = state.shape.fields(s, v)["kappa"] / scene.transverse_curvature
    scale = Normalize(0.0, 1.0)
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    axis.plot_surface(
        points[..., 2], points[..., 0], points[..., 1], facecolors=colormaps["viridis"](scale(across)), rstride=1,
        cstride=1, linewidth=0, antialiased=False, shade=True,
    )  # fmt: skip
    axis.set_box_aspect(np.ptp(points[..., [2, 0, 1]].reshape(-1, 3), axis=0), zoom=1.5)
    axis.set_axis_off()
    axis.view_init(elev=28, azim=-58)
    bar = figure.colorbar(ScalarMappable(norm=scale, cmap="viridis"), ax=axis, shrink=0.8)
    bar.set_label("curvature across over that at rest")
    save(figure, path)
