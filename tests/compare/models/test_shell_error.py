"""The errors of a shell where none was asked for: by another mesh, coarser where that is one, else finer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models.reference import beside_mesh
from compare.models.shell_here import run
from compare.pages.shell import answer, document
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from ribbonbench.world import world


@pytest.mark.parametrize(
    ("elements", "beside"),
    [
        ((100, 8), (50, 4)),
        ((50, 4), (25, 2)),
        ((20, 2), (40, 4)),
        ((16, 4), (32, 8)),
        ((10, 1), (20, 2)),
        ((1, 1), (2, 2)),
        ((5000, 1), (5000, 2)),
    ],
)
def test_the_other_mesh_is_coarser_where_that_is_one(elements, beside):
    assert beside_mesh(elements) == beside


def test_the_other_mesh_is_never_dearer_than_four_times_a_small_one():
    for along in (1, 3, 10, 40, 100, 400, 3000):
        for across in (1, 2, 3, 4, 8, 20):
            cells, other = along * across, math.prod(beside_mesh((along, across)))
            assert other != cells
            assert other <= max(2 * cells, 1600)


def shells(elements, folder, **keys):
    scene = load("cantilever").replace(
        {"shell.width_to_thickness": [50], "shell.elements": elements, "shell.tolerance": None, **keys}
    )
    return scene, run(scene, CaseStore(folder), Reporter(quiet=True), world())[0]


@pytest.mark.shell
def test_one_element_across_states_its_error(tmp_path):
    """Poisson's ratio bends the section, which one element across cannot follow: energies 3 % off (8 to 9 % on others),
    the tip 2.8 % of l, all of it "converged, stable". The stated errors bound what a fine mesh says, and not by more
    than tenfold."""
    pytest.importorskip("dolfinx")
    scene, coarse = shells([10, 1], tmp_path)
    _, fine = shells([40, 4], tmp_path)
    grid = Grid.for_shape(scene, 10.0)
    off = grid_hausdorff(grid.of(coarse.shape), grid.of(fine.shape))
    assert off > 0.02
    assert off < coarse.error < 10.0 * off
    for name in ("elastic", "gravity", "total"):
        off = abs(getattr(coarse.energy, name) - getattr(fine.energy, name))
        assert off < coarse.errors["energy"][name] < 10.0 * off
    off = float(np.linalg.norm(coarse.supports.start.moment - fine.supports.start.moment))
    assert off < coarse.errors["moments"]["start"] < 10.0 * off
    off = abs(coarse.lowest_eigenvalue - fine.lowest_eigenvalue)
    assert off < coarse.errors["lowest_eigenvalue"] < 10.0 * off
    assert coarse.errors["forces"]["start"] < 1e-6  # the clamp carries the weight on any mesh
    assert coarse.errors["forces"]["end"] is None
    assert answer(scene, [coarse]).grade == "poor"
    written = document(scene, [coarse])
    assert written["discretisation_error"] == coarse.error
    for name in ("energy", "forces", "moments"):
        assert written[f"{name}_error"] == coarse.errors[name]
    assert written["lowest_eigenvalue_error"] == coarse.errors["lowest_eigenvalue"]
    assert fine.error < 0.1 * coarse.error


@pytest.mark.shell
def test_a_refined_shell_states_the_errors_of_its_numbers_too(tmp_path):
    pytest.importorskip("dolfinx")
    _, found = shells([20, 2], tmp_path, **{"shell.tolerance": 1e-3})
    _, fine = shells([80, 8], tmp_path)
    for name in ("elastic", "gravity", "total"):
        off = abs(getattr(found.energy, name) - getattr(fine.energy, name))
        assert 0.9 * off < found.errors["energy"][name] < 0.01
    assert found.errors["moments"]["start"] < 0.01
