"""Where a shell begins: from a surface, from the path on a coarse mesh, or with its path; what is refused."""

import dataclasses

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellSurface
from shellref.path import begin
from shellref.path.begin import begun, coarse_meshes

CURL = ShellProblem(
    0.05, 1e-3, 0.3, (4.0, 4.0), 20.0, (1.0, 0.0, 0.0), elements=(32, 4), grading=(1.0, 1.0),
    clamp_frame=((0.5**0.5, -(0.5**0.5), 0.0), (0.5**0.5, 0.5**0.5, 0.0), (0.0, 0.0, 1.0)),
)  # fmt: skip
#: Upright, of natural curvature 1: under this weight it leans to either side, and both are stable.
UPRIGHT = ShellProblem(
    0.05, 1e-3, 0.3, (1.0, 1.0), 20.0, (0.0, 0.0, 1.0), elements=(32, 4), grading=(1.0, 1.0)
)  # fmt: skip


@pytest.fixture
def _small(monkeypatch):
    """Coarse meshes for small ones."""
    monkeypatch.setattr(begin, "LEAST", (16, 2))
    monkeypatch.setattr(begin, "FEWEST", (16, 2))


def find(problem, start=None, **options):
    pytest.importorskip("dolfinx")
    return begun(problem, ShellOptions(**options), lambda event: None, start)


def gap(one, other):
    return float(np.abs(one.result.surface.points - other.result.surface.points).max())


def mirrored(surface):
    """The surface mirrored in the plane y = 0, the side of its normal with it."""
    flip = np.array([1.0, -1.0, 1.0])
    return ShellSurface(
        surface.s_nodes, surface.v_nodes, surface.points * flip, -surface.directors * flip, surface.degree
    )


@pytest.mark.parametrize(
    ("elements", "meshes"),
    [
        ((12, 2), []),
        ((50, 4), [(25, 2)]),
        ((100, 8), [(25, 2), (50, 4)]),
        ((150, 12), [(25, 2), (37, 3), (75, 6)]),
        ((400, 100), [(25, 2), (50, 12), (100, 25), (200, 50)]),
    ],
)
def test_coarse_meshes_have_at_most_a_quarter_of_the_cells(elements, meshes):
    assert coarse_meshes(elements) == meshes


@pytest.mark.shell
@pytest.mark.usefixtures("_small")
def test_every_beginning_ends_in_the_state_of_the_path():
    path = find(CURL)
    assert path.how == "path"
    coarse = find(CURL, coarse=True)
    assert (coarse.how, coarse.notes["coarse"]) == ("coarse path", [16, 2])
    assert 1e-5 < coarse.notes["gap"] < begin.FAR
    assert {step.note for step in coarse.result.steps[:-1]} == {"on 16 x 2"}
    moved = path.result.surface.points + 1e-3 * np.sin(3.0 * path.result.surface.points)
    near = ShellSurface(path.result.surface.s_nodes, path.result.surface.v_nodes, moved, path.result.surface.directors)
    checked, stable = (find(CURL, near, begin=how, coarse=True) for how in ("checked", "stable"))
    assert (checked.how, stable.how) == ("given, as the coarse path", "given")
    for other in (coarse, checked, stable):
        assert gap(path, other) < 1e-10
        assert other.result.energy["total"] == pytest.approx(path.result.energy["total"], abs=1e-10)
        assert other.result.lowest_eigenvalue == pytest.approx(path.result.lowest_eigenvalue, rel=1e-5)
        assert other.result.stable is True
        last = other.result.steps[-1]
        assert (last.method, last.load) == ("start", 1.0)
        assert last.iterations < 0.4 * path.result.newton_iterations
        assert other.result.newton_iterations == sum(step.iterations for step in other.result.steps)
        assert other.result.options.kick is True


@pytest.mark.shell
@pytest.mark.usefixtures("_small")
def test_a_stable_state_on_another_branch_is_refused_by_the_coarse_path():
    """The strip that leans to the other side is stable too; only its energy and the path tell."""
    path = find(UPRIGHT)
    assert path.result.stable is True
    other = mirrored(path.result.surface)
    believed = find(UPRIGHT, other, begin="stable")
    assert (believed.how, believed.result.stable) == ("given", True)
    assert gap(path, believed) > 0.5
    assert believed.result.energy["total"] > path.result.energy["total"] + 1e-3
    for coarse, how in ((True, "coarse path"), (False, "path (the start is refused)")):
        refused = find(UPRIGHT, other, begin="checked", coarse=coarse)
        assert refused.how == how
        assert "from the coarse path's state" in refused.notes["refused"][0]
        assert gap(path, refused) < 1e-10


@pytest.mark.shell
@pytest.mark.usefixtures("_small")
def test_a_saddle_is_refused_and_a_coarse_path_that_left_one_is_not_believed():
    """Straight up and beyond its critical weight: an equilibrium with two negative eigenvalues."""
    straight = dataclasses.replace(UPRIGHT, natural_curvature=(0.0, 0.0))
    s, v = np.linspace(0.0, 1.0, 5), np.linspace(-0.025, 0.025, 3)
    points = np.stack(np.broadcast_arrays(v, 0.0, s[:, None]), axis=-1)
    start = ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy())
    found = find(straight, start, begin="stable", coarse=True)
    assert found.how == "path (the start is refused)"
    assert found.notes["refused"][0].startswith("unstable")
    assert found.notes["refused"][1].endswith("it left an unstable state")
    assert found.result.stable is True
    assert np.abs(found.result.surface.points[..., 1]).max() > 0.3


def test_a_mesh_without_a_coarse_one_has_nothing_to_check_by():
    pytest.importorskip("dolfinx")
    small = dataclasses.replace(CURL, elements=(8, 1), natural_curvature=(0.2, 0.2), gamma=0.2)
    flat = find(small)
    found = find(small, flat.result.surface, begin="checked", coarse=True)
    assert found.how == "path"
    assert gap(flat, found) == 0.0
