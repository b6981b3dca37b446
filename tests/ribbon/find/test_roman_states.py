"""Roman's strip aside of its plane (thesis, figure 6.11): a state of the strip, whose energy settles over meshes."""

from pathlib import Path

import numpy as np
import pytest

from compare.measure.balance import Push, Wrench, abscissae, unbalanced
from compare.models import solve
from compare.scene.scene import load
from ribbon.find.branch.passages import settled as on_passages
from tests.validation.ribbon import roman
from tests.validation.ribbon.roman_states import PLACED, halved, nearest

ROOT = Path(__file__).resolve().parents[3]

#: The fold that leans over in the plane, on 120 to 960 segments (results/roman_states).
PLANAR = 96.038


@pytest.fixture(scope="module")
def coarse():
    """The strip aside on 80 segments: the scene beside the page."""
    return solve(load(ROOT / "results" / "roman_states" / "aside.toml"), "ribbon").native


def test_the_strip_aside_is_a_stable_state_far_below_the_planar_one(coarse):
    fine = halved(coarse)
    for found in (coarse, fine):
        assert found.ok
        assert found.lowest_eigenvalue > 0.1
        assert abs(found.position([0.5])[0, 0]) == pytest.approx(0.19, abs=2e-3)
        assert found.energy.total < 0.6 * PLANAR
    assert fine.energy.total < coarse.energy.total
    assert fine.energy.total == pytest.approx(52.540, abs=0.06)


def test_the_walls_push_where_its_slanting_rulings_end(coarse):
    found = coarse
    weight = -found.problem.strip.gamma * np.array([0.0, 1.0, 0.0])
    s, weights = abscissae()
    centre = weights @ found.position(s)
    clamps = [
        Wrench(found.position([at])[0], held.force, held.moment)
        for at, held in ((0.0, found.start), (1.0, found.end_support))
    ]
    r, frames, _, eta = found.continued(np.concatenate([wall.ends[:, 0] for wall in found.walls]))
    across = np.concatenate([wall.ends[:, 1] for wall in found.walls])[:, None]
    points = r + across * (frames[:, :, 0] + eta[:, None] * frames[:, :, 2])
    cuts = np.cumsum([len(wall.ends) for wall in found.walls])[:-1]
    normals = [np.array(wall.normal) for wall in found.problem.walls]
    pushes = [
        Push(normal, wall.force, there)
        for normal, wall, there in zip(normals, found.walls, np.split(points, cuts), strict=True)
    ]
    assert abs(eta).max() > 0.05
    assert unbalanced(clamps, weight, centre, pushes) < 1e-8
    square = [
        Push(push.normal, push.force, there)
        for push, there in zip(pushes, np.split(r + across * frames[:, :, 0], cuts), strict=True)
    ]
    assert unbalanced(clamps, weight, centre, square) > 1e-5


def test_elements_at_its_passages_say_the_same(coarse):
    """On elements graded to where its curvature passes zero, 115 and 228 of them: less energy on more, towards 52.540,
    which halved equal segments tend to from above too (results/roman_states)."""
    rough = on_passages(coarse.problem, coarse, PLACED)
    fine = on_passages(coarse.problem, rough, PLACED.finer())
    assert rough.ok
    assert fine.ok
    assert 52.540 < fine.energy.total < rough.energy.total < coarse.energy.total
    assert fine.energy.total - 52.540 < 0.4 * (rough.energy.total - 52.540)
    assert nearest(fine) > 0.1  # it does not touch itself


@pytest.mark.parametrize("count", [2, pytest.param(3, marks=pytest.mark.validate)])
def test_plane_contacts_of_two_folds_and_more(count):
    """Thesis, figure 6.14, has hardly any from two waves on. At H N = 0.17 every fold lies on its plates, stable, under
    the force of the elastica with flat parts; at 0.19 it touches along lines."""
    experiment = roman.Experiment(gamma=0.0)
    for scaled, kind in ((0.17, "plane"), (0.19, "line")):
        equilibrium = experiment.folded(count, scaled / count, 60)
        seen = roman.folds(equilibrium, scaled / count)
        assert equilibrium.ok
        assert (seen.count, seen.kind(1.01 / 60)) == (count, kind)
        if kind == "plane":
            force = count * roman.plane_contact(scaled / count, roman.DELTA, count).force
            assert roman.press(equilibrium) == pytest.approx(force, rel=2e-2)
