"""Refinement until an accuracy: the estimate is honest, the limit of cells is kept, failures are said."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellStatus

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.adaptive import gap  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from shellref.shell.strip import build_strip  # noqa: E402

CURL = ShellProblem(
    width=0.1,
    thickness=2e-3,
    poisson=0.4,
    natural_curvature=(6.0, 6.0),
    gamma=20.0,
    up=(0.6, 0.8, 0.0),
    elements=(6, 1),
    grading=(0.5, 1.0),
)


@pytest.fixture(scope="module")
def fine():
    return solve(replace(CURL, elements=(48, 8)), ShellOptions(stability=False)).surface


@pytest.mark.parametrize("accuracy", [2e-2, 3e-3])
def test_the_accuracy_reached_is_true(accuracy, fine):
    events = []
    result = solve(CURL, ShellOptions(accuracy=accuracy), events.append)
    assert result.status is ShellStatus.CONVERGED
    found = result.discretisation
    assert found["reached"] is True
    assert found["accuracy"] == accuracy
    assert found["estimate"] <= accuracy
    assert gap(result.surface, fine) < 1.5 * found["estimate"]
    meshes = found["meshes"]
    assert meshes[-1]["elements"] == list(result.elements)
    assert meshes[-1]["estimate"] == found["estimate"]
    assert all(row["estimate"] > accuracy for row in meshes[:-1])
    assert [event["elements"] for event in events if event["event"] == "mesh"] == [row["elements"] for row in meshes]
    same = solve(replace(CURL, elements=result.elements, grading=CURL.grading), start=result.surface)
    assert gap(same.surface, result.surface) < 0.1 * accuracy  # a mesh of the same size, if not the same mesh
    assert result.to_dict()["discretisation"]["reached"] is True


def test_refinement_goes_where_the_error_is():
    """Across only: the strip needs more than one element over its width; the first row says so, the mesh follows."""
    result = solve(CURL, ShellOptions(accuracy=2e-2))
    first, *rest = result.discretisation["meshes"]
    assert first["across"] > 2 * first["along"]
    assert rest
    assert result.elements == (6, 2)


def test_a_mesh_without_equilibrium_is_said(monkeypatch):
    """Refinement that fails is a status of the coarse result, which is kept."""
    from shellref.path import adaptive

    coarse = solve(CURL)
    options = ShellOptions(accuracy=1e-3)

    class Lost:
        """A solver whose refined meshes come to nothing."""

        def __init__(self, strip, options, comm, report):
            self.strip, self.options, self.comm, self.report = strip, options, comm, report

        def run(self, start=None):
            return replace(coarse, status=ShellStatus.NOT_CONVERGED, message="nothing found", elements=(12, 1))

    monkeypatch.setattr(adaptive, "Solver", Lost)
    result = adaptive.refine(coarse, Lost(build_strip(CURL, options), options, None, lambda e: None))
    assert result.status is ShellStatus.NOT_CONVERGED
    assert "refined mesh (12, 1): nothing found" in result.message
    np.testing.assert_array_equal(result.surface.points, coarse.surface.points)


def test_cells_are_limited_and_the_message_says_so():
    result = solve(CURL, ShellOptions(accuracy=1e-6, max_cells=30))
    assert result.status is ShellStatus.CONVERGED
    assert result.discretisation["reached"] is False
    assert result.discretisation["estimate"] > 1e-6
    assert result.elements[0] * result.elements[1] <= 30
    assert "max_cells" in result.message
    assert "not reached" in result.message
