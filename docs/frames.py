"""Draws docs/frames.svg: the frames of a strip and what is positive. Run it from the project's root:

python docs/frames.py [FILE ...]     # other files are for looking at, e.g. frames.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("svg")
import matplotlib.pyplot as plt

INK, ACROSS, NORMAL, ALONG, FORCE = "#333333", "#0072b2", "#009e73", "#d55e00", "#aa3377"
FACE, EDGE = "#e8eef4", "#8899aa"
#: Where a point (across, normal, along) stands on the paper: across goes back to the upper right.
DEPTH = np.array([0.42, 0.30])
HALF = 0.75
Array = NDArray[np.float64]


def on_paper(points: Array) -> Array:
    """Points (..., 3) in t_x, t_y, t_z of the clamp -> (..., 2) on the paper."""
    return points[..., 2:3] * [1.0, 0.0] + points[..., 1:2] * [0.0, 1.0] + points[..., 0:1] * DEPTH


def arc(length: float, curvature: float, s: Array) -> tuple[Array, Array]:
    """Centreline and tangent (k, 3) of a strip that leaves the clamp along t_z; positive curvature: towards -t_y."""
    k = curvature or 1e-6
    angle = k * s * length
    line = np.stack([0.0 * s, -(1.0 - np.cos(angle)) / k, np.sin(angle) / k], axis=-1)
    return line, np.stack([0.0 * s, -np.sin(angle), np.cos(angle)], axis=-1)


def strip(axes: plt.Axes, length: float, curvature: float) -> tuple[Array, Array]:
    """The strip's face and edges; its centreline and tangents."""
    line, tangent = arc(length, curvature, np.linspace(0.0, 1.0, 80))
    front, back = (on_paper(line + np.array([side * HALF, 0.0, 0.0])) for side in (-1.0, 1.0))
    axes.fill(*np.vstack([front, back[::-1]]).T, facecolor=FACE, edgecolor=EDGE, linewidth=1.2)
    axes.plot(*on_paper(line).T, color=EDGE, linewidth=0.8, linestyle=(0, (6, 3)))
    return line, tangent


def arrow(axes: plt.Axes, start: Array, way: Array, colour: str, words: str, shift: tuple[float, float]) -> None:
    """An arrow from a point along a direction, with words near its head."""
    tail, head = on_paper(start), on_paper(start + way)
    axes.annotate(
        "", head, tail, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.0, "shrinkA": 0, "shrinkB": 0}
    )
    axes.annotate(words, head, xytext=shift, textcoords="offset points", color=colour, fontsize=11, va="center")


def frame(axes: plt.Axes, point: Array, tangent: Array, size: float = 0.85) -> None:
    """t_x, t_y, t_z at a point of the strip."""
    across = np.array([1.0, 0.0, 0.0])
    normal = np.cross(tangent, across)
    arrow(axes, point, 1.35 * size * across, ACROSS, "$t_x$", (3, 4))
    arrow(axes, point, size * normal, NORMAL, "$t_y$", (4, 3))
    arrow(axes, point, size * tangent, ALONG, "$t_z$", (4, -9))


def clamp(axes: plt.Axes) -> None:
    """The held edge."""
    ends = on_paper(np.array([[-HALF, 0.0, 0.0], [HALF, 0.0, 0.0]]))
    axes.plot(*ends.T, color=INK, linewidth=5, solid_capstyle="butt")


def title(axes: plt.Axes, words: str, across: tuple[float, float], up: tuple[float, float]) -> None:
    """Heading and limits of a panel."""
    axes.set_title(words, fontsize=11, color=INK, loc="left")
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set(xlim=across, ylim=up)


def flat(axes: plt.Axes) -> None:
    """Frames at both ends, and a ruling."""
    line, tangent = strip(axes, 5.0, 0.0)
    clamp(axes)
    frame(axes, line[0], tangent[0])
    frame(axes, line[-1], tangent[-1])
    middle, eta = line[40], 0.75
    ruling = np.array([1.0, 0.0, eta])
    axes.plot(*on_paper(middle + np.outer([-HALF, HALF], ruling)).T, color=FORCE, linewidth=2)
    across = on_paper(middle + np.outer([-HALF, HALF], [1.0, 0.0, 0.0]))
    axes.plot(*across.T, color=ACROSS, linewidth=1, linestyle=":")
    axes.annotate(
        r"ruling $t_x + \eta\, t_z$, $\eta > 0$", on_paper(middle + HALF * ruling), xytext=(-40, 14),
        textcoords="offset points", color=FORCE, fontsize=11,
    )  # fmt: skip
    for place, words in ((line[0], "s = 0"), (line[-1], "s = length")):
        axes.annotate(
            words, on_paper(place - [HALF, 0.0, 0.0]), xytext=(-8, -14), textcoords="offset points", color=INK
        )
    title(axes, "Frames: $t_x = t_y \\times t_z$; at the end $t_z$ points out of the strip", (-0.9, 6.4), (-0.55, 1.05))


def curved(axes: plt.Axes) -> None:
    """What is positive: natural curvature, and the force of a support."""
    line, tangent = strip(axes, 4.2, 0.28)
    up, _ = arc(4.2, -0.28, np.linspace(0.0, 1.0, 80))
    axes.plot(*on_paper(up).T, color=EDGE, linewidth=1.2, linestyle=(0, (2, 2)))
    axes.annotate("K < 0", on_paper(up[-1]), xytext=(6, 0), textcoords="offset points", color=EDGE, fontsize=11)
    clamp(axes)
    frame(axes, line[0], tangent[0], 0.7)
    axes.annotate(
        "natural curvature K > 0:\nbends away from $t_y$", on_paper(line[-1]), xytext=(26, 6),
        textcoords="offset points", color=INK, fontsize=11, va="center",
    )  # fmt: skip
    arrow(axes, np.array([0.0, -1.3, 0.0]), np.array([0.0, 1.1, 0.0]), FORCE, "", (0, 0))
    axes.annotate(
        "force at s = 0: what the\nclamp exerts on the strip\n(here it carries the weight)",
        on_paper(np.array([0.0, -0.95, 0.0])), xytext=(-10, 0), textcoords="offset points", color=FORCE, fontsize=11,
        va="center", ha="right",
    )  # fmt: skip
    arrow(axes, line[45] + [0.0, -0.1, 0.0], np.array([0.0, -0.75, 0.0]), INK, "weight, along $-$up", (-112, 2))
    title(axes, "What is positive", (-3.0, 6.6), (-2.5, 2.35))


def main(files: list[str]) -> None:
    """Draws into the files."""
    matplotlib.rcParams.update({"svg.fonttype": "path", "svg.hashsalt": "frames", "mathtext.fontset": "cm"})
    figure, (above, below) = plt.subplots(2, 1, figsize=(7.6, 6.4), height_ratios=(0.9, 1.6), layout="constrained")
    flat(above)
    curved(below)
    for file in files:
        figure.savefig(file, dpi=140, facecolor="white", metadata={"Date": None} if file.endswith("svg") else None)


if __name__ == "__main__":
    main(sys.argv[1:] or [str(Path(__file__).with_name("frames.svg"))])
