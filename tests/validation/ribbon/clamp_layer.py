"""A straight ruling at the clamp: the layer it makes, uniform against graded segments, error and time."""

from __future__ import annotations

from pathlib import Path

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import load
from ribbon import refine
from tests.validation import page

COUNTS = (10, 20, 40, 80)


def run(out: Path) -> None:
    scene = load("curl_4_3")
    grid = Grid.for_shape(scene, 15.0)
    finest = solve_scene(scene.replace({"model.elements": 48}), "ribbon").native
    for _ in range(3):
        finest = refine(finest)
    exact = grid.of(RibbonShape(finest))
    rows = []
    errors = {}
    for count in COUNTS:
        cells = [str(count)]
        for grading in ("uniform", "clamp"):
            run_ = solve_scene(
                scene.replace({"model.elements": count, "model.grading": grading}),
                "ribbon",
                options=Options(repeats=None),
            )
            errors[grading, count] = grid_hausdorff(grid.of(run_.shape), exact)
            cells += [f"{errors[grading, count]:.1e}", f"{run_.seconds.warm * 1e3:.3g}"]
        rows.append(cells)
    page.write(
        out / "clamp_layer.md", "A straight ruling at the clamp", "python -m tests.validation clamp_layer",
        "Scene curl_4_3 (Wunderlich, eta(0) = 0): error (Hausdorff / l, to "
        f"{finest.problem.lengths.size} graded segments) and warm time. The ruling turns over a layer about as long as "
        'the strip is wide, 0.03 l; `grading = "clamp"` starts with 2.5 w / p and grows by 1.5 a segment.',
        page.table(["segments", "uniform: error / l", "ms", "graded: error / l", "ms"], rows),
    )  # fmt: skip
    if not errors["clamp", 20] < 0.1 * errors["uniform", 20]:
        raise AssertionError("graded segments should be ten times better at p = 20")
