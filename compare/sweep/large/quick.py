"""Points of a grid without reading each scene anew, where the varied keys are numbers of the strip alone.

Reading a scene takes a quarter of the time that a light one takes in all. A key of `ALONE` sets one number of [strip],
is checked against its own range, and nothing else in a scene is read by it: so every value of an axis is read strictly
once, and a point of several axes is put together from these. `checked` holds that against the strict way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from compare.scene.scene import Scene
from compare.studies.axes import Grid, Point

#: The keys, with the field of the strip that each sets.
ALONE = {"strip.gamma": "gamma", "strip.natural_curvature": "natural_curvature"}


class Quick:
    """The points of a grid, each as `Grid.point` gives it."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        keys = [key for axis in grid.axes for key in axis.keys]
        one_each = all(len(axis.keys) == 1 for axis in grid.axes)
        self._able = one_each and not grid.scene.path and all(key in ALONE for key in keys)
        self._base = grid.point(0).scene if self._able else grid.scene  # with the keys that every point has
        self._read: dict[tuple[str, float], Scene] = {}

    def points(self, numbers: Sequence[int], check: bool = True) -> list[Point] | None:
        """The points of these numbers; None where they have to be read one by one. check: whether the strict way is
        gone, too, for the first and the last."""
        if not self._able:
            return None
        values = [self.grid.values(number) for number in numbers]
        if not all(type(value) in (int, float) for one in values for value in one.values()):
            return None
        found = [Point(number, one, self._scene(one)) for number, one in zip(numbers, values, strict=True)]
        return found if not check or self.checked(found) else None

    @property
    def able(self) -> bool:
        """Whether the varied keys allow it."""
        return self._able

    def given(self, numbers: Sequence[int]) -> tuple[list[float], list[float]] | None:
        """Gamma and natural curvature K l of these points, without their scenes; None where one of them is no constant
        number."""
        every = [self.grid.values(number) for number in numbers]
        gamma = [self._of(values, "strip.gamma").gamma for values in every]
        curled = [self._of(values, "strip.natural_curvature").curvature for values in every]
        if any(len(set(one)) != 1 for one in curled):
            return None
        return gamma, [float(one[0]) for one in curled]  # type: ignore[arg-type]

    def _of(self, values: dict[str, float], key: str) -> Scene:
        """A scene with the value of this key at a point."""
        return self._one(key, values[key]) if key in values else self._base

    def checked(self, found: Sequence[Point]) -> bool:
        """Whether the first and the last of them are what the strict way reads."""
        return all(self.grid.point(point.number).scene == point.scene for point in (found[0], found[-1]))

    def _scene(self, values: dict[str, float]) -> Scene:
        fields = {ALONE[key]: getattr(self._one(key, value).strip, ALONE[key]) for key, value in values.items()}
        return replace(self._base, strip=replace(self._base.strip, **fields))

    def _one(self, key: str, value: float) -> Scene:
        """The scene with one value replaced, read strictly."""
        if (key, value) not in self._read:
            self._read[key, value] = self._base.replace({key: value})
        return self._read[key, value]
