"""Branches that are images of others are told so, and by what; one that is met again is not followed twice; of a circle
of branches one is followed."""

import numpy as np
import pytest

from compare.battery.cases.branches.scenes import CLAMPS, MAST, SHIFT
from compare.scene.scene import loads
from compare.studies.branches.images import laid
from compare.studies.branches.run import Asked, diagram
from tests.validation.ribbon.twisted_clamps import scene


def surface(bend=1.0, lift=0.0, twist=0.0):
    """A strip (k, 3, 3) that is bent, out of its plane, not the same from both ends."""
    s, v = np.linspace(0.0, 1.0, 21)[:, None], 0.05 * np.array([-1.0, 0.0, 1.0])
    x, z = s + 0.0 * v, bend * s**2 * (1.0 - 0.7 * s) + 0.0 * v
    return np.stack([x, v + lift * s**3, z + twist * s * v], axis=-1)


def test_surfaces_are_laid_on_each_other_by_what_they_were_moved():
    own = surface(lift=0.3, twist=0.4)
    turned = np.diag([-1.0, -1.0, 1.0])
    about = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    assert laid(own, own) == "same"
    assert laid(own, own @ np.diag([1.0, -1.0, 1.0])) == "mirror"
    assert laid(own, own @ turned) == "half turn"
    assert laid(own, own @ about.T + [0.1, 0.0, 0.2]) == "turn"
    assert laid(own, own[::-1] @ np.diag([-1.0, 1.0, 1.0])) == "mirror, reversed"
    assert laid(own, own[::-1, ::-1] @ turned) == "half turn, reversed"
    assert laid(own, own[::-1]) == "reversal"
    assert laid(own, surface(lift=0.3, twist=0.5)) is None
    assert laid(own, surface(bend=1.02, lift=0.3, twist=0.4)) is None


def test_both_sides_of_twisted_clamps_are_half_turns_of_each_other_from_the_other_end():
    """Their first points lie at turns that differ by 1e-6 of the range: no image by parameter and energy alone."""
    there = scene("kirchhoff", 0.3).replace({"path": [{"clamp.end.normal": [0.0, -0.1, float(np.sqrt(0.99))]}]})
    found = diagram(there, "path", asked=Asked(errors=False))
    own, one, other = found.branches
    assert own.image_of is None
    assert one.image_of is None
    assert (other.image_of, other.image_by) == (one.number, "half turn, reversed")
    last, image = one.points[-1], other.points[-1]
    assert last.energy == pytest.approx(image.energy, abs=1e-8)
    assert np.abs(last.centreline - image.centreline).max() > 0.01  # and are two


def test_a_mast_falls_to_two_sides_that_are_mirror_images():
    found = diagram(loads(MAST), "strip.gamma", 5.0, 9.0, asked=Asked(errors=False))
    _, one, other = found.branches
    assert (other.image_of, other.image_by) == (one.number, "mirror")


@pytest.mark.validate
def test_a_closed_branch_that_is_met_at_both_its_forks_is_followed_once():
    """Level clamps, one shifted there and back: the arch's branch is left for one that closes, and its image."""
    level = loads(CLAMPS).replace({"clamp.end.position": [0.8, 0.0, 0.0]})
    found = diagram(level, SHIFT, -0.52, 0.52, asked=Asked(errors=False, steps=90, branches=3))
    own, one, other = found.branches
    assert one.ended == other.ended == "closed"
    assert (other.image_of, other.image_by) == (one.number, "mirror, reversed")
    assert {number for number, _ in own.joins} == {one.number}  # where it comes to the arch's own branch


def test_of_a_circle_of_branches_one_is_followed():
    rod = {"rod.bending": [1.0, 1.0], "rod.torsion": 0.8, "model.energy": "curve_angle", "model.elements": 12}
    found = diagram(loads(MAST).replace(rod), "strip.gamma", 6.0, 10.0, asked=Asked(errors=True))
    own, fallen = found.branches
    assert [len(p.critical) for p in own.points if p.kind == "branch_point"] == [2]
    assert (own.circle, fallen.circle) == (False, True)
    assert {p.unstable for p in fallen.points} == {0}
    assert fallen.ended == "range"
    assert fallen.points[-1].bars.settles
    plane = diagram(
        loads(MAST).replace({"model.energy": "elastica"}), "strip.gamma", 6.0, 10.0, asked=Asked(errors=False)
    )
    assert abs(plane.branches[1].points[-1].energy - fallen.points[-1].energy) <= fallen.points[-1].bars.energy
