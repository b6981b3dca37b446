"""What every picture needs, without a solver: files, screen axes, cells as polygons."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.store.store import atomic_write_bytes
from ribbonbench import start

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

#: The ribbon is blue as in the thesis; shells take colours that those who see few of them can tell apart too (after
#: M. Okabe and K. Ito, Color Universal Design, 2008), in order of w/h.
RIBBON_COLOUR = "#1f5fa8"
#: What it cannot cross.
WALL_COLOUR = "#8a8a8a"
#: Pushes and friction where it touches.
PUSH_COLOUR, RUB_COLOUR = "#d40000", "#7a3fb0"
SHELL_COLOURS = ("#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#8c6d31", "#6b6b6b")

#: Where a map has nothing to tell.
NOTHING = "#b8bcc2"


def shell_colour(index: int) -> str:
    """The colour of the shell at a place in the order of w/h, from 0."""
    return SHELL_COLOURS[index % len(SHELL_COLOURS)]


def save(figure: Figure, path: Path, dpi: int = 200, *, placed: bool = False) -> Path:
    """Writes the picture, atomically. placed: all of it lies within the figure as it stands; otherwise it is drawn
    twice, once to see how much room it takes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Text

    FigureCanvasAgg(figure)
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if "$" in text.get_text() and "\\mathdefault" not in text.get_text():  # a title's; of ticks it is a formula
            text.set_parse_math(False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, bbox_inches=None if placed else "tight")
    return atomic_write_bytes(path, buffer.getvalue())


def pictured(draw: Callable[[], object]) -> bool:
    """Whether `draw` has drawn: without matplotlib (the extra "plot") pictures are left out, and that is said."""
    try:
        _untold()
        draw()
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("matplotlib", "mpl_toolkits"):
            raise
        print("ribbonbench: note: no pictures without matplotlib; pip install 'ribbonbench[plot]'", file=sys.stderr)
        return False
    return True


def _untold() -> None:
    """Where the process is a command, matplotlib's classes are made without the texts that list their properties: half
    of the time that its figures take to be imported, and nobody asks for help there."""
    if not start.is_command() or "matplotlib.figure" in sys.modules:
        return
    from matplotlib.artist import Artist

    told: Any = Artist  # what it calls there has no public name
    if "_update_set_signature_and_docstring" in vars(Artist):
        told._update_set_signature_and_docstring = classmethod(lambda _: None)


def screen_axes(grids: list[FloatArray], up: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Screen axes (2, 3) of two side views: `up` vertical on the page, across the main direction and its normal."""
    vertical = np.array([0.0, 0.0, 1.0]) if up is None else np.asarray(up, dtype=float)
    cloud = np.concatenate([g.reshape(-1, 3) for g in grids])
    flat = cloud - cloud.mean(axis=0)
    flat = flat - np.outer(flat @ vertical, vertical)
    _, _, directions = np.linalg.svd(flat, full_matrices=False)
    first = directions[0] - (directions[0] @ vertical) * vertical
    first /= np.linalg.norm(first)
    second = np.cross(vertical, first)
    return np.array([first, vertical]), np.array([second, vertical])


def quads(points: FloatArray) -> FloatArray:
    """Corners (cells, 4, d) of the cells of a grid (k, m, d)."""
    cells = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    return cells.reshape(-1, 4, points.shape[2])
