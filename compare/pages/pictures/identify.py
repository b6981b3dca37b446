"""The picture of a fit: measured points on the fitted centreline, from two sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, save, screen_axes
from compare.studies.identify import Identified


def identify_picture(path: Path, fit: Identified) -> Path:
    """Both views with the distances of the points drawn as lines; in the unit of the strip's length."""
    assert fit.state.shape is not None
    length = fit.scene.strip.length
    line = length * fit.state.shape.centreline(np.linspace(0.0, 1.0, 801))
    points, feet = length * fit.points.places, length * fit.state.shape.centreline(fit.feet)
    up, unit = fit.scene.up, "m" if fit.scene.units.known else "unit of strip.length"
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, screen, name in zip(panels, screen_axes([line], up), ("front", "side"), strict=True):
        drawn = line @ screen.T
        axes.plot(*drawn.T, color=RIBBON_COLOUR, lw=2, label="fitted centreline")
        for point, foot in zip(points @ screen.T, feet @ screen.T, strict=True):
            axes.plot(*np.array([point, foot]).T, color="0.6", lw=0.8)
        axes.plot(*(points @ screen.T).T, "o", ms=4, color=SHELL_COLOURS[3], label="measured")
        axes.set(title=name, xlabel=f"across / {unit}", ylabel=f"{'upwards' if up is not None else 'z'} / {unit}")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize="small")
    figure.suptitle(fit.scene.title)
    return save(figure, path)
