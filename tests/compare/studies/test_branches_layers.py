"""Ribbons and rods that are pulled taut between clamps: elements that follow their layers, and an end, with the reason,
before what they miss matters. The judge is the energy of two layers (`compare.battery.cases.branches.ends`)."""

import numpy as np
import pytest

from compare.battery.cases.branches.ends import _layers
from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.models.branches import rod
from compare.pages.branches.page import branch_table
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram
from ribbon.find.branch import equations, layers
from ribbon.rods import equations as edges
from ribbon.rods import layers as edge_layers

SCENE = loads(CLAMPS, "taut").replace({"seed.curvature": [-6.0, 0.0, 6.0]})
THICK = SCENE.replace({"strip.thickness": 1e-4, "strip.poisson": 0.0})


def taut(model, elements, short, errors=False):
    scene = THICK if model in ("antman", "curve_angle") else SCENE.replace({"model.energy": model})
    scene = scene.replace({"model.elements": elements})
    found = diagram(scene, SHIFT, 0.5, 0.6 - short, (model,), Asked(branches=1, errors=errors))
    return found, found.branches[0]


@pytest.mark.parametrize("energy", ["wunderlich", "sadowsky"])
def test_a_ribbons_elements_follow_its_layers(energy):
    """At a force of 1e5 D w / l^2, where the middle is straight to rounding and its rulings move nothing."""
    _, own = taut(energy, 40, 1e-3)
    assert own.ended == "range"
    last = own.points[-1]
    assert np.linalg.norm(last.force) > 1e5
    assert last.energy == pytest.approx(_layers(last.parameter)[0], rel=1e-3)
    assert {p.unstable for p in own.points} == {0}


def test_a_ribbons_error_holds_the_layers():
    _, own = taut("wunderlich", 20, 1e-2, errors=True)
    last = own.points[-1]
    assert last.bars.settles
    assert abs(last.energy - _layers(last.parameter)[0]) <= last.bars.energy < 1e-3 * last.energy


def test_where_a_ribbons_elements_stay_the_branch_ends_before_it_is_wrong(monkeypatch):
    monkeypatch.setattr(equations, "FITTED", np.inf)
    found, own = taut("wunderlich", 20, 1e-3)
    assert own.ended == "unresolved"
    assert not found.ok
    assert branch_table(found).records()[0]["ended"] == "unresolved"
    last = own.points[-1]
    assert last.energy == pytest.approx(_layers(last.parameter)[0], rel=2.0 * equations.RESOLVED**2)


@pytest.mark.parametrize(
    ("model", "elements", "stretch", "off"), [("antman", 20, 12.0 / 1e-5**2, 2e-4), ("curve_angle", 80, np.inf, 1e-2)]
)
def test_a_rods_elements_follow_its_layers(model, elements, stretch, off):
    """The shearable rod is longer by its force over its stiffness in tension, and stores that."""
    scene = THICK.replace({"model.energy": model, "model.elements": elements, "strip.thickness": 1e-5})
    (own,) = diagram(scene, SHIFT, 0.5, 0.599, asked=Asked(branches=1, errors=False)).branches
    assert own.ended == "range"
    last = own.points[-1]
    force = float(np.linalg.norm(last.force))
    assert force > 1e5
    apart = np.hypot(0.8, last.parameter) / (1.0 + force / stretch)
    expected = _layers(np.sqrt(apart**2 - 0.8**2))[0] + 0.5 * force**2 / stretch
    assert last.energy == pytest.approx(expected, rel=off)
    assert {p.unstable for p in own.points} == {0}


@pytest.mark.parametrize(("model", "elements", "home"), [("antman", 20, rod), ("curve_angle", 160, edges)])
def test_where_a_rods_elements_stay_the_branch_ends_before_it_is_wrong(model, elements, home, monkeypatch):
    """Without that the curve-angle rod went to the end of the range with a fifth of the energy."""
    monkeypatch.setattr(home, "FITTED", np.inf)
    _, own = taut(model, elements, 1e-3)
    assert own.ended == "unresolved"
    last = own.points[-1]
    assert last.energy == pytest.approx(_layers(last.parameter)[0], rel=2.0 * home.RESOLVED**2)


@pytest.mark.parametrize(("model", "elements"), [("wunderlich", 24), ("antman", 40), ("curve_angle", 80)])
def test_what_is_missed_is_the_root_of_the_energys_error(model, elements, monkeypatch):
    seen = []

    def watched(home, name):
        own = getattr(home, name)
        monkeypatch.setattr(home, name, lambda *asked: seen.append(own(*asked)) or seen[-1])

    for home in (rod, layers, edge_layers):
        watched(home, "missed")
    for home in (rod, equations, edges):
        monkeypatch.setattr(home, "RESOLVED", np.inf)
        monkeypatch.setattr(home, "FITTED", np.inf)
    _, own = taut(model, elements, 1e-2)
    last = own.points[-1]
    off = abs(last.energy / _layers(last.parameter)[0] - 1.0)
    assert own.ended == "range"
    assert 0.5 * off <= seen[-1] ** 2 <= 2.0 * off


def test_a_bent_strip_that_nothing_pulls_keeps_its_elements():
    scene = SCENE.replace({"model.energy": "wunderlich", "model.elements": 20, "seed.curvature": [-6.0, 6.0, -6.0]})
    (own,) = diagram(scene, SHIFT, 0.0, 0.2, asked=Asked(branches=1, errors=False)).branches
    assert own.ended == "range"
    assert np.allclose(own.points[-1].shape.equilibrium.problem.lengths, 0.05)
