"""The shapes of all points of a diagram, and its numbers, as the data of `branches.html`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.capabilities import Surrounds
from compare.models.choice import chosen
from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS
from compare.page.page import STRIP, WALL, Surface
from compare.pages.branches.words import WORDS
from compare.pages.export.vtu import Sheet, grid_sheet
from compare.pages.pictures.branches import ordinate
from compare.pages.report.surfaces import as_data, view
from compare.store.states import States
from compare.studies.branches.bars import known
from compare.studies.branches.diagram import Branch, BranchPoint, Diagram

FloatArray = NDArray[np.float64]

#: Points of a shape along and across, at the most and least along; of all shapes together.
ALONG, FEWEST, ACROSS, ALL = 81, 21, 3, 400_000


@dataclass(frozen=True)
class Shapes(States):
    """The shapes of points, one after another, with what each is called."""

    names: tuple[str, ...] = ()

    @property
    def labels(self) -> list[str]:
        """What each is called."""
        return list(self.names)


def page_data(diagram: Diagram) -> dict[str, Any]:
    """What the page's script reads: key, unit, the component that is drawn first, branches with the places of their
    points, every point's numbers, and the data of the viewer (`compare.pages.report.surfaces.as_data`), whose states
    are the shapes in the order of the points."""
    _, name, component = ordinate(diagram)
    pairs = [(branch, point) for branch in diagram.branches for point in branch.points]
    colours = _colours(diagram)
    branches, first = [], 0
    for branch in diagram.branches:
        branches.append({
            "model": branch.model, "number": branch.number, "first": first, "count": len(branch.points),
            "colour": colours[branch.model], "image_of": branch.image_of, "image_by": branch.image_by,
        })  # fmt: skip
        first += len(branch.points)
    return {
        "key": diagram.along.key, "unit": diagram.along.unit, "ordinate": f"{name} {'xyz'[component]}",
        "branches": branches, "points": [_numbers(branch, point) for branch, point in pairs],
        "view": _view(diagram, [point for _, point in pairs], [_label(diagram, *pair) for pair in pairs]),
    }  # fmt: skip


def _colours(diagram: Diagram) -> dict[str, str]:
    models = list(dict.fromkeys(branch.model for branch in diagram.branches))
    both = (RIBBON_COLOUR, *SHELL_COLOURS)
    return {model: both[k % len(both)] for k, model in enumerate(models)}


def _label(diagram: Diagram, branch: Branch, point: BranchPoint) -> str:
    return f"{branch.model} {branch.number}: {diagram.along.key} = {point.parameter:.6g}"


def _numbers(branch: Branch, point: BranchPoint) -> dict[str, Any]:
    return {
        "branch": branch.number, "model": branch.model, "kind": point.kind, "kind_text": WORDS[point.kind],
        "what": point.what, "parameter": point.parameter, "error": point.error, "settles": point.settles,
        "place": point.settled.value if point.settled is not None and point.settled.settles else point.parameter,
        "unstable": point.unstable, "energy": point.energy, "energy_error": known(point.bars, "energy"),
        "shape_error": known(point.bars, "shape"), "numbers_settle": None if point.bars is None else point.bars.settles,
        "end": point.end.tolist(),
        "middle": point.middle.tolist(),
    }  # fmt: skip


def _view(diagram: Diagram, points: list[BranchPoint], labels: list[str]) -> dict[str, Any]:
    along = int(np.clip(ALL // (len(points) * ACROSS), FEWEST, ALONG))
    s = np.linspace(0.0, 1.0, along)
    across = np.linspace(-0.5, 0.5, ACROSS)
    grids = []
    for point in points:
        assert point.shape is not None  # a followed point has one
        width = diagram.along.scene_at(point.t).width
        grids.append(point.shape.points(s, width * across))
    none = np.zeros(len(points))
    shapes = Shapes(none, none, s, across, np.array(grids), names=tuple(labels))
    up = diagram.scene.up
    pairs = [(Surface("", "strip", STRIP, states="shapes"), grid_sheet(grids[-1], {})), *_walls(diagram, shapes.points)]
    direction = None if up is None else (float(up[0]), float(up[1]), float(up[2]))
    found = as_data(view(pairs, direction, along * ACROSS * 4, {"shapes": shapes}), "The strip at a point of a branch.")
    return {**found, "names": {}, "file": "branch_point.png"}


def _walls(diagram: Diagram, points: FloatArray) -> list[tuple[Surface, Sheet]]:
    """What the strip cannot cross, where that stands still."""
    first, last = diagram.along.scene_at(0.0), diagram.along.scene_at(1.0)
    model = chosen(first)
    still = first.barriers == last.barriers
    if not first.barriers or not still or not isinstance(model, Surrounds):
        return []
    nets = model.barriers(first, next(iter(diagram.starts.values())), points.reshape(-1, 3))
    return [
        (Surface("", name, WALL), grid_sheet(net, {})) for name, net in zip(first.barrier_names, nets, strict=False)
    ]
