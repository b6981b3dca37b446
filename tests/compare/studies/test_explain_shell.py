"""What a shell's own effects move: shear, an even mesh, its way there, the nonlinearity of its loads."""

import pytest

from compare.measure.grid import Grid
from compare.models.effects.weightless import loaded
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.effects_measured import LINEAR, shells

COARSE = {"shell.width_to_thickness": [10.0], "shell.elements": [10, 2]}
LIGHT = load("cantilever").replace({"strip.poisson": 0.0, **COARSE})


def moved(scene, folder):
    pytest.importorskip("dolfinx")
    grid = Grid.for_shape(scene, 1.0)
    found = shells(scene, grid, CaseStore(folder), Reporter(quiet=True))
    assert {row.status for row in found.rows} == {"converged"}
    return {row.name: row.moved for row in found.rows}


@pytest.mark.shell
def test_what_shear_the_way_and_linear_loads_are_worth(tmp_path):
    """A cantilever under a weight G, nu = 0: the shortening 1/2 int theta^2 ds of theta = G ((1 - s)^3 - 1) / 6 is what
    is not linear; shear adds G h^2 / (12 k) (S. P. Timoshenko 1921)."""
    scene = LIGHT.replace({"strip.gamma": 0.2, "strip.width": 0.1})
    found = moved(scene, tmp_path)
    assert found[LINEAR] == pytest.approx(0.2**2 / 112.0, rel=0.02)
    assert found["transverse shear"] == pytest.approx(0.2 * 0.01**2 / (12.0 * 5.0 / 6.0), rel=0.05)
    assert found["a coarse mesh first"] < 1e-8


def test_loads_by_their_share():
    scene = load("cantilever").replace({"tip.load": 3.0})
    quarter, none = (scene.replace(loaded(scene, share)) for share in (0.25, 0.0))
    assert quarter.gamma == pytest.approx(0.25 * scene.gamma)
    assert quarter.tip_force == pytest.approx(0.25 * scene.tip_force)
    assert none.gamma == 0.0
    assert not none.tip_force.any()
