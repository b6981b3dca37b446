"""A straight ruling at the clamp: the layer it makes, uniform against graded segments, error and time."""

from __future__ import annotations

import functools
from pathlib import Path

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.base import Options, State
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import load
from ribbon import Equilibrium, refine
from tests.validation import page
from tests.validation.number import Number

#: Its times, or the workers it starts, want the machine.
ALONE = True

COUNTS = (10, 20, 40, 80)
SCENE = load("curl_4_3")
GRID = Grid.for_shape(SCENE, 15.0)


@functools.cache
def reference() -> tuple[Equilibrium, float]:
    """The scene on 384 graded segments and its distance (in l) to 192: its own error is below that."""
    fine: Equilibrium = solve_scene(SCENE.replace({"model.elements": 48}), "ribbon").native
    for _ in range(3):
        coarse, fine = fine, refine(fine)
    return fine, grid_hausdorff(GRID.of(RibbonShape(coarse)), GRID.of(RibbonShape(fine)))


def measured(count: int, grading: str, options: Options | None = None) -> tuple[float, State]:
    """Distance (in l) of `count` segments to the reference, and their state."""
    scene = SCENE.replace({"model.elements": count, "model.grading": grading})
    found = solve_scene(scene, "ribbon", options=options or Options())
    return grid_hausdorff(GRID.of(found.shape), GRID.of(RibbonShape(reference()[0]))), found


PROBES = {
    "uniform_20": lambda: measured(20, "uniform")[0],
    "graded_20": lambda: measured(20, "clamp")[0],
}


def run(out: Path) -> dict[str, Number]:
    finest, uncertain = reference()
    rows = []
    errors = {}
    for count in COUNTS:
        cells = [str(count)]
        for grading in ("uniform", "clamp"):
            errors[grading, count], found = measured(count, grading, Options(repeats=None))
            cells += [f"{errors[grading, count]:.1e}", f"{found.seconds.warm * 1e3:.3g}"]
        rows.append(cells)
    page.write(
        out / "clamp_layer.md", "A straight ruling at the clamp", "python -m tests.validation clamp_layer",
        "Scene curl_4_3 (Wunderlich, eta(0) = 0): error (Hausdorff / l, to "
        f"{finest.problem.lengths.size} graded segments, good to {uncertain:.0e}) and warm time. The ruling turns "
        "over a layer about as long as the strip is wide, 0.03 l; "
        '`grading = "clamp"` starts with 2.5 w / p and grows by 1.5 a segment.',
        page.table(["segments", "uniform: error / l", "ms", "graded: error / l", "ms"], rows),
    )  # fmt: skip
    if not errors["clamp", 20] < 0.1 * errors["uniform", 20]:
        raise AssertionError("graded segments should be ten times better at p = 20")
    return {
        f"{word}_{count}": Number(errors[grading, count], uncertain, "l", ".1e")
        for word, grading in (("uniform", "uniform"), ("graded", "clamp"))
        for count in COUNTS
    }
