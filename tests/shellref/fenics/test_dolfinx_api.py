"""The dolfinx layer: meshes, spaces, assembly and evaluation against closed forms, on one process and on several."""

import itertools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")
import ufl

from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as la
from tests.patience import PATIENCE

pytestmark = pytest.mark.shell
ROOT = Path(__file__).parents[3]
ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
S_KNOTS = np.array([0.0, 0.1, 0.3, 0.35, 0.6, 0.8, 1.0])
V_KNOTS = np.array([-0.1, 0.0, 0.15])
COMPONENTS = np.arange(1.0, 7.0)


class Small:
    """A space of 6-vectors on a 6 x 2 mesh, two forms of its function u and of stress s, and two point evaluations."""

    def __init__(self, comm):
        self.comm, self.mesh = comm, api.rectangle(S_KNOTS, V_KNOTS, comm)
        self.space = api.lagrange_space(self.mesh, 2, 6)
        self.stresses = api.quadrature_space(self.mesh, 3, 2)
        self.u, self.s = api.function(self.space), api.function(self.stresses)
        self.number = api.constant(self.mesh, [2.0, 3.0])
        test, trial = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        self.x = ufl.SpatialCoordinate(self.mesh)
        full = ufl.dx(domain=self.mesh, metadata={"quadrature_degree": 4})
        reduced = ufl.dx(domain=self.mesh, metadata={"quadrature_degree": 3})
        u = self.u
        stiff = sum(trial[i] * test[i] + (1.0 + u[i] * u[i]) * trial[i].dx(0) * test[i].dx(0) for i in range(6))
        self.forms = [
            api.compile_form(self.number[0] * sum(u[i] * test[i] for i in range(6)) * full),
            api.compile_form((self.s[0] * test[0] + self.s[1] * test[5].dx(0)) * reduced),
        ]
        self.stiffness = api.compile_form((stiff + self.number[1] * trial[0].dx(1) * test[1].dx(1)) * full)
        self.points = api.PointValues(self.mesh, ufl.as_vector([u[1].dx(0), u[2].dx(1), self.x[0]]), 4, 3)

    def fill(self) -> None:
        """u_i = i S (1 + v), s = (S v, cos of the point's number) at the points."""
        nodes = api.node_coordinates(self.space)
        api.values(self.u, 6)[:] = (nodes[:, 0] * (1.0 + nodes[:, 1]))[:, None] * COMPONENTS
        middle = api.cell_midpoints(self.mesh).prod(axis=1)[:, None]
        field = np.stack([middle + np.zeros(4), np.cos(np.arange(4.0)) + 0.0 * middle], axis=2)
        api.values(self.s, 2)[api.quadrature_order(self.stresses, 4)] = field

    def vector(self) -> np.ndarray:
        return api.assemble_vector(self.forms, self.space, 6)

    def by_place(self, array: np.ndarray) -> np.ndarray:
        """The owned rows of all processes, ordered by the place of their nodes."""
        owned = api.node_ranges(self.space)[0]
        places = api.gather_rows(self.comm, api.node_coordinates(self.space)[:owned]).round(9)
        return api.gather_rows(self.comm, array[:owned])[np.lexsort((places[:, 1], places[:, 0]))]


@pytest.fixture(scope="module")
def small() -> Small:
    made = Small(api.communicator("self"))
    made.fill()
    return made


def test_mesh_has_the_given_knots(small):
    expected = [((a + b) / 2, (c + d) / 2) for a, b in pairs(S_KNOTS) for c, d in pairs(V_KNOTS)]
    assert api.cell_count(small.mesh) == 12
    found = api.cell_midpoints(small.mesh)
    assert np.allclose(found[np.lexsort((found[:, 1], found[:, 0]))], sorted(expected), atol=1e-15)
    nodes = api.node_coordinates(small.space)
    for axis, knots in ((0, S_KNOTS), (1, V_KNOTS)):
        halves = np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
        assert np.allclose(np.unique(nodes[:, axis].round(12)), halves, atol=1e-12)
    assert api.node_ranges(small.space) == (65, 0, 0)


def pairs(knots: np.ndarray):
    return itertools.pairwise(knots)


@pytest.mark.parametrize(("degree", "points"), [(3, 4), (4, 9)])
def test_gauss_rule_is_the_one_of_forms(small, degree, points):
    places, weights = api.gauss_rule(degree)
    assert places.shape == (points, 2)
    assert weights.sum() == pytest.approx(1.0)
    # a form integrates S^3 v^3 with the rule as the rule itself does on the mapped cells
    test = ufl.TestFunction(small.space)
    measure = ufl.dx(domain=small.mesh, metadata={"quadrature_degree": degree})
    form = api.compile_form((small.x[0] * small.x[1]) ** 6 * test[0] * measure)
    total = api.assemble_vector([form], small.space, 6)[:, 0].sum()
    expected = 0.0
    for a, b in pairs(S_KNOTS):
        for c, d in pairs(V_KNOTS):
            s, v = a + (b - a) * places[:, 0], c + (d - c) * places[:, 1]
            expected += (b - a) * (d - c) * np.sum(weights * (s * v) ** 6)
    assert total == pytest.approx(expected, rel=1e-12)


def test_point_values_follow_the_function(small):
    small.fill()
    s = api.cell_midpoints(small.mesh)[:, 0]
    found = small.points()
    assert found.shape == (12, 9, 3)
    # u_1 = 2 S (1 + v), u_2 = 3 S (1 + v)
    v = api.cell_midpoints(small.mesh)[:, 1]
    np.testing.assert_allclose(found[:, :, 0].mean(axis=1), 2.0 * (1.0 + v), rtol=1e-12)
    assert np.abs(found[:, :, 2]).min() > 1e-3  # nothing is compared with zero
    np.testing.assert_allclose(found[:, :, 1], 3.0 * found[:, :, 2], rtol=1e-12)
    assert np.allclose(found[:, 4, 2], s), "the middle point of the 3 x 3 rule is not the fifth"
    api.values(small.u, 6)[:] *= 2.0
    assert np.allclose(small.points()[:, :, :2], 2.0 * found[:, :, :2])


def test_vectors_against_integrals(small):
    small.fill()
    total = small.vector().sum(axis=0)
    # int 2 i S (1 + v) over S in (0, 1), v in (-0.1, 0.15)
    expected = 2.0 * COMPONENTS * 0.5 * (0.25 + (0.15**2 - 0.1**2) / 2)
    areas = np.array([(b - a) * (d - c) for a, b in pairs(S_KNOTS) for c, d in pairs(V_KNOTS)])
    middles = np.array([(a + b) * (c + d) / 4 for a, b in pairs(S_KNOTS) for c, d in pairs(V_KNOTS)])
    expected[0] += np.sum(areas * middles)
    assert total.shape == expected.shape
    np.testing.assert_allclose(total, expected, rtol=1e-12, atol=1e-15)
    small.number.value[0] = 0.0
    assert np.allclose(small.vector()[:, 1:5], 0.0, atol=1e-15), "the constant is frozen into the form"
    small.number.value[0] = 2.0
    # every point has its own weight: int s_1 test_5' against the weights by hand
    nodes = api.node_coordinates(small.space)
    work = small.vector()[:, 5] @ nodes[:, 0] - 2.0 * 6.0 * (0.25 + (0.15**2 - 0.1**2) / 2) / 3.0
    assert work == pytest.approx(0.25 * np.cos(np.arange(4.0)).mean(), rel=1e-12)


def test_matrix_rows_are_components_of_nodes(small):
    small.fill()
    matrix = api.create_matrix(small.stiffness)
    api.assemble_matrix(matrix, [small.stiffness])
    nodes = api.node_coordinates(small.space)
    x, y = np.zeros((65, 6)), np.zeros((65, 6))
    x[:, 0], y[:, 1] = nodes[:, 1], nodes[:, 1] * nodes[:, 0]
    # int 3 v_,v (S v)_,v = 3 * 0.5 * 0.25
    assert np.sum(y.ravel() * la.multiply(matrix, x.ravel())) == pytest.approx(0.375, rel=1e-12)
    assert np.sum(x.ravel() * la.multiply(matrix, y.ravel())) == pytest.approx(0.0, abs=1e-14)
    once = la.to_scipy(matrix).toarray()
    api.assemble_matrix(matrix, [small.stiffness, small.stiffness])
    assert np.allclose(la.to_scipy(matrix).toarray(), 2.0 * once, rtol=1e-14)


def test_too_many_processes_for_a_mesh():
    class Crowd:
        rank, size = 3, 13

    with pytest.raises(ValueError, match="6 x 2 elements cannot be shared by 13 processes"):
        api.rectangle(S_KNOTS, V_KNOTS, Crowd())


def test_versions_name_all_libraries():
    assert {"dolfinx", "ufl", "petsc", "petsc4py", "slepc", "slepc4py", "numpy", "python"} == set(api.versions())
    assert all(value[0].isdigit() for value in api.versions().values())


# --- in other processes ----------------------------------------------------------------------------------------------
def results(made: Small) -> dict[str, np.ndarray]:
    """What must not depend on the number of processes."""
    made.fill()
    owned, ghosts, first = api.node_ranges(made.space)
    vector = made.vector()
    assert len(vector) == owned + ghosts == len(api.node_coordinates(made.space))
    matrix = api.create_matrix(made.stiffness)
    api.assemble_matrix(matrix, [made.stiffness])
    assert matrix.getOwnershipRange() == (6 * first, 6 * (first + owned))
    product = la.multiply(matrix, vector[:owned].ravel()).reshape(-1, 6)
    points = made.points()
    assert len(points) == api.cell_count(made.mesh) == len(api.quadrature_order(made.stresses, 4))
    return {
        "cells": api.sum_over(made.comm, api.cell_count(made.mesh)),
        "nodes": api.sum_over(made.comm, owned),
        "vector": made.by_place(vector),
        "product": made.by_place(product),
        "points": api.sum_over(made.comm, points.sum(axis=0)),
    }


def several_processes() -> None:
    """What each process of the next test does."""
    world, alone = api.communicator("world"), results(Small(api.communicator("self")))
    made = Small(world)
    for name, found in results(made).items():
        assert np.allclose(found, alone[name], rtol=1e-12, atol=1e-14), name
    owned, ghosts, _ = api.node_ranges(made.space)
    assert api.max_over(world, ghosts) > 0
    for components in (6, 3):
        nodes = api.node_coordinates(made.space)
        field = nodes[:, :1] * np.arange(components) + nodes[:, 1:]
        spoilt = field.copy()
        spoilt[owned:] = np.nan
        api.update_ghosts(made.space, spoilt)
        assert np.array_equal(spoilt, field)
    assert api.max_over(world, world.rank) == world.size - 1
    assert np.array_equal(api.gather_rows(world, np.full((1, 2), world.rank))[:, 0], np.arange(world.size))
    try:
        api.rectangle(np.linspace(0.0, 1.0, world.size), V_KNOTS[:2], world)
    except ValueError:
        return
    raise AssertionError("a mesh with fewer cells than processes was made")


def call(function: str) -> list[str]:
    return [
        sys.executable,
        "-m",
        "mpi4py",
        "-c",
        f"from {__name__} import {function}; {function}(); print('fine', flush=True)",
    ]


@pytest.mark.parametrize("processes", [pytest.param(2, marks=pytest.mark.validate), 3])
def test_several_processes(processes):
    mpirun = shutil.which("mpirun")
    if not mpirun:
        pytest.skip("no mpirun")
    command = [mpirun, "--oversubscribe", "-n", str(processes), *call("several_processes")]
    environment = os.environ | ENVIRONMENT
    run = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("fine") == processes


def compile_all() -> None:
    """Everything that is compiled, in a process of its own."""
    Small(api.communicator("self"))


def test_cache_is_shared_and_names_do_not_depend_on_it(tmp_path):
    environment = os.environ | ENVIRONMENT | {"RIBBONBENCH_CACHE": str(tmp_path)}
    folder = tmp_path / "forms"

    def at_once(count: int) -> set[str]:
        started = [subprocess.Popen(call("compile_all"), cwd=ROOT, env=environment) for _ in range(count)]
        assert [process.wait(timeout=PATIENCE) for process in started] == [0] * count
        return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.so")}

    empty = at_once(2)  # two processes that compile the same forms at once
    assert len(empty) >= 4
    assert at_once(1) == empty, "a full cache changed names, or forms were compiled again"
    # what a killed process leaves: a source and no mark, which without care stops ffcx for good
    victim = next(iter(sorted(folder.glob("libffcx_forms_*.c.cached"))))
    victim.unlink()
    again = at_once(1)
    assert set(again) == set(empty)
    assert sum(again[name] != empty[name] for name in empty) == 1


@pytest.mark.parametrize("before", ["", "import dolfinx; "])
def test_a_broken_pipe_is_an_exception(before):
    """PETSc takes no signal: SIGPIPE, which Python ignores, would end the whole process by MPI_Abort; nor does one that
    was begun by others."""
    code = (
        f"{before}import subprocess, sys; from shellref.fenics import dolfinx_api\n"
        "ended = subprocess.Popen([sys.executable, '-c', ''], stdin=subprocess.PIPE); ended.wait()\n"
        "try:\n    ended.stdin.write(b'x'); ended.stdin.flush()\n"
        "except BrokenPipeError:\n    print('raised')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["raised"], done.stderr
