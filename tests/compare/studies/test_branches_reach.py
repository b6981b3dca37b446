"""Elasticas that are all but straight: elements that follow their layers, and an end before what they miss matters."""

import numpy as np
import pytest

from compare.battery.cases.branches.ends import _layers
from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.battery.judge.turning import turning
from compare.models.branches import elastica
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram
from shellref.elastica.fitted import fitted, missed

SCENE = loads(CLAMPS, "taut").replace({"seed.curvature": [-6.0, 0.0, 6.0]})
ASKED = Asked(branches=1, errors=False)


def taut(short):
    (own,) = diagram(SCENE, SHIFT, 0.5, 0.6 - short, asked=ASKED).branches
    return own


def test_the_judge_agrees_with_auto_and_with_small_slopes():
    assert turning(0.2) == pytest.approx(0.473535450, abs=2e-9)  # AUTO-07p, results/branches_auto.md
    assert turning(1e-7) / np.sqrt(4e-7 / 3.0) == pytest.approx(1.0, abs=2e-7)


def test_layers_are_followed_and_what_is_missed_is_the_square_root_of_the_energys_error():
    own = taut(1e-3)
    assert own.ended == "range"
    energy, _ = _layers(own.points[-1].parameter)
    assert own.points[-1].energy == pytest.approx(energy, rel=1e-6)
    assert abs(own.points[-1].shape.result.forces.end[0]) > 3e4


def test_on_elements_that_stay_the_branch_ends_before_it_is_wrong(monkeypatch):
    monkeypatch.setattr(elastica, "FITTED", np.inf)
    own = taut(1e-3)
    assert own.ended == "unresolved"
    energy, _ = _layers(own.points[-1].parameter)
    assert own.points[-1].energy == pytest.approx(energy, rel=elastica.RESOLVED**2)


def test_an_estimate_is_that_of_finer_elements():
    """Missed on elements of a state against those four times as many: the curvature's change."""
    own = taut(2e-2)
    found = own.points[-1].shape.result
    system, z = elastica.ElasticaEquations.of(lambda t: found.problem, found)
    coarse = missed(system.system, system.degree, z, 0.0)
    nodes = fitted(system.system, system.degree, z, 0.0, 10, found.problem)
    rough = missed(system.system, system.degree, z, 0.0, nodes)
    assert len(nodes) == 11
    assert rough > 10.0 * coarse
    even = missed(system.system, system.degree, z, 0.0, np.linspace(0.0, 1.0, 11))
    assert even > rough  # fitted ones are better than as many that are not
