"""Where several strips touch walls, obstacles and each other, in l and D w / l^2 of the first one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from compare.models.strips.solve import StripsState
from compare.models.strips.walls import walls_of_strip
from compare.store.touches import Touches


def touches(state: StripsState) -> Touches:
    """All places: of strips on each other both, named by the strip there; of walls and obstacles by their name."""
    return Touches.of(_rows(state))


def _rows(state: StripsState) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, str]]:
    names, none = state.scene.names, np.zeros(3)
    for touch in state.native.touching:
        yield touch.at, np.asarray(touch.force), none, names[touch.one]
        yield touch.at_other, -np.asarray(touch.force), none, names[touch.other]
    for slide in state.native.slides:
        yield slide.point, none, np.asarray(slide.friction), names[slide.one]
        yield slide.point, none, -np.asarray(slide.friction), names[slide.other]
    for k in range(len(names)):
        for wall in walls_of_strip(state.scene, state.native, k):
            for point, normal, push in zip(wall.points, wall.normals, wall.pushes, strict=True):
                yield point, push * normal, none, wall.name
            for rub in wall.rubs:
                yield rub.point, none, rub.friction, wall.name
