"""A branch that closes on itself, and paths with corners."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.battery.judge.turning import turning
from compare.battery.planar import judged
from compare.scene.scene import loads

#: Shift (l) up to which the loop may go.
_FAR = 0.59


def _loop(energy: Rung) -> Iterator[Check]:
    """The arch between two level clamps, one of which is shifted: over to its mirror image at one side, and back at the
    other. It closes; both turns are at the shift that shooting gives."""
    from compare.studies.branches.run import through

    keys = {"model.energy": str(energy), "model.elements": 8 if energy == "elastica" else 60}
    ended, special = through(loads(CLAMPS, "level").replace(keys), SHIFT, -_FAR, _FAR, steps=300)
    yield holds("it closes", ended == "closed", ended)
    shifts = [value for kind, value in special if kind != "event"]
    turns = sorted({round(value, 6) for value in shifts})
    expected = turning(0.2)
    bound = 1e-9 if energy == "elastica" else 2e-3
    yield Check("places of its special points, apart from two", abs(len(turns) - 2), 0.0, said=str(turns))
    yield near("the turn at one side", max(shifts), expected, bound)
    yield near("the turn at the other", min(shifts), -expected, bound)


def _corners(stages: Rung) -> Iterator[Check]:
    """The same arch at the end of paths of one to four straight stages, followed along the last: the state there is
    the collocation's."""
    from compare.models.elastica.shape import ElasticaShape
    from compare.studies.branches.run import Asked, diagram

    corners = [[0.8, 0.0, 0.0], [0.8, 0.0, 0.2], [0.7, 0.0, 0.2], [0.75, 0.0, -0.1], [0.6, 0.0, 0.1]]
    count = int(stages)
    plain = loads(CLAMPS, "corners").replace({"clamp.end.position": corners[count]})
    path = [{"clamp.end.position": place} for place in corners[:count]]
    found = diagram(plain.replace({"path": path}), "path", asked=Asked(branches=1, errors=False))
    (own,) = found.branches
    yield holds("it goes to the end of the path", own.ended == "range", own.ended)
    shape = own.points[-1].shape
    assert isinstance(shape, ElasticaShape)
    found_there: Any = shape.result
    forces = found_there.forces.end
    energies = found_there.energy.bending, found_there.energy.gravity
    eigenvalue = found_there.lowest_eigenvalue
    yield from judged(found_there.problem, found_there, found_there.nodes, energies, eigenvalue, forces)
    yield Check("unstable modes at its end", own.points[-1].unstable, 0.0)


CASES: tuple[Case, ...] = (
    Case(
        name="branches/loop",
        hard="a branch that closes on itself, through both its turns",
        expected="closed; the turns where shooting has them, to 1e-9 for the elastica, to 2e-3 for ribbons",
        parameter="model",
        run=_loop,
        rungs=("elastica",),
        long=("sadowsky", "wunderlich"),
    ),
    Case(
        name="branches/corners",
        hard="paths of straight stages with corners, followed along their last",
        expected="the state at the end is the collocation's, stable",
        parameter="stages",
        run=_corners,
        rungs=(1, 2),
        long=(3, 4),
    ),
)
