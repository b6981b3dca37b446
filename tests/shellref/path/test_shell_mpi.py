"""mpirun -n 2 gives the serial result: the same positions, energies, reactions and log."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellSurface, Waypoint
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import Wall
from tests.patience import PATIENCE

pytest.importorskip("dolfinx")
pytestmark = [
    pytest.mark.shell,
    pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is missing"),
]

from shellref.path.begin import begun  # noqa: E402
from shellref.path.solve import solve  # noqa: E402

FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x


def straight_on(distance):
    """A clamp at a distance along the strip's own line, turned as its start."""
    return Pose((0.0, 0.0, distance), tuple(map(tuple, np.eye(3).tolist())))


PROBLEMS = {
    "corners": ShellProblem(
        width=0.1,
        thickness=2e-3,
        poisson=0.3,
        natural_curvature=(2.0, 1.0),
        gamma=4.0,
        up=(0.6, 0.8, 0.0),
        clamp="corners",
        elements=(11, 3),
    ),
    "both clamps": ShellProblem(
        width=0.05,
        thickness=5e-4,
        poisson=0.3,
        start_curvature=-2.5,
        end=Pose((0.5, 0.01, 0.0), FLAT),
        path=(Waypoint(natural=1.0, name="release"),),
        clamp_frame=FLAT,
        elements=(15, 2),
    ),
    "branch": ShellProblem(
        width=0.05, thickness=2.5e-3, poisson=0.35, gamma=21.7, up=(1.0, 0.0, 0.0), elements=(13, 2), grading=(0.3, 1.0)
    ),
    "free": ShellProblem(
        width=0.05, thickness=5e-4, poisson=0.3, natural_curvature=(4.0, 4.0), clamp="free", elements=(13, 2)
    ),
}
#: Bands clamped at their seam, by their own paths: a circle, a Moebius band.
PROBLEMS |= {
    "ring": ShellProblem(
        width=0.1, thickness=5e-3, poisson=0.3, half_turns=0, start_curvature=-2.0 * np.pi, gamma=6.0,
        up=(0.0, 1.0, 0.0), clamp_frame=((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), elements=(26, 2),
    ),
    "moebius": ShellProblem(width=0.05, thickness=2.5e-3, poisson=0.3, half_turns=1, elements=(24, 2)),
}  # fmt: skip
#: Bands that nothing holds, or a point of their seam.
LOOSE = {
    "clamp": "free",
    "gamma": 0.0,
    "up": None,
    "clamp_frame": np.eye(3).tolist(),
    "clamp_position": (0.0, 0.0, 0.0),
}
POINT = {"holds": ("position", "all"), "sections": ("free", "undeformed")}
PROBLEMS |= {
    "loose ring": replace(PROBLEMS["ring"], **LOOSE),
    "loose moebius": replace(PROBLEMS["moebius"], clamp="free", elements=(24, 4)),
    "ring at a point": replace(PROBLEMS["ring"], **POINT),
}
UP = (0.0, 1.0, 0.0)
UPRIGHT = ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), UP)
LOWER = Wall((0.0, -0.1, 0.0), UP)
#: On a table, between a plate and one on a spring, over a bar, and on itself.
PROBLEMS |= {
    "table": ShellProblem(
        width=0.1, thickness=2e-3, poisson=0.3, natural_curvature=(1.0, 1.0), gamma=5.0, up=UP, clamp="free",
        walls=(LOWER,), elements=(12, 2),
    ),
    "plates": ShellProblem(
        width=0.1, thickness=1e-3, poisson=0.0, clamp_frame=UPRIGHT, half_turns=0, start_curvature=-2.0 * np.pi,
        elements=(32, 2), grading=(1.0, 1.0), walls=(LOWER, Wall((0.0, 0.1, 0.0), (0.0, -1.0, 0.0), 500.0)),
        contact="faces",
    ),
    "bar": ShellProblem(
        width=0.1, thickness=2e-3, poisson=0.0, gamma=20.0, up=UP, elements=(30, 2), grading=(1.0, 1.0),
        obstacles=(Obstacle("cylinder", (0.0, -0.25, 0.6), 0.1, (1.0, 0.0, 0.0)),),
    ),
    "fold": ShellProblem(
        width=0.02, thickness=2e-4, poisson=0.0, elements=(40, 1), grading=(1.0, 1.0), end=straight_on(0.15),
        start_curvature=2.0, apart=0.02,
        path=(Waypoint(natural=1.0, name="natural"), Waypoint(end=straight_on(0.5)), Waypoint(end=straight_on(0.25))),
    ),
}  # fmt: skip
#: Without stress nothing resists that it turns about its point: rounding says whether that is tried in vain.
SWINGS = "ring at a point"
OPTIONS = ShellOptions(switch=True)
TOUCHING = ShellOptions(stability=True)
CODE = """
import json, sys
from pathlib import Path
from mpi4py import MPI
from shellref import ShellOptions, ShellProblem
from shellref.path.begin import begun
from shellref.path.solve import solve
folder = Path(sys.argv[1])
for name, (problem, options) in json.loads((folder / "problems.json").read_text()).items():
    problem, options = ShellProblem.from_dict(problem), ShellOptions.from_dict(options)
    if problem.half_turns is not None:
        result = begun(problem, options, lambda event: None, processes="world").result
    else:
        result = solve(problem, options, processes="world", folder=folder / "log")
    if MPI.COMM_WORLD.rank == 0:
        (folder / name).mkdir()
        result.save(folder / name)
"""


def launched(processes, *words):
    """What mpirun prints, all its processes on one core: who waits there leaves it to who is waited for. On two, beside
    another worker's tests, they waited for each other most of the time."""
    environment = {
        **os.environ, "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_mpi_yield_when_idle": "1",
    }  # fmt: skip
    command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(processes), sys.executable, "-c", *words]
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})  # this thread's, which its child processes inherit
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=PATIENCE)
    finally:
        os.sched_setaffinity(0, cores)
    assert done.returncode == 0, done.stderr
    return done.stdout


#: Solved by one mpirun each. Held corners in two processes: `test_two_processes_find_the_same_numbers` too.
TOGETHER = (
    ("both clamps", "branch", "free", "ring", "moebius", "loose ring", "loose moebius", "ring at a point"),
    ("table", "plates", "bar"),
    ("corners", "fold"),
)


def options(name):
    return TOUCHING if PROBLEMS[name].touches else OPTIONS


@pytest.fixture(scope="module")
def parallel(tmp_path_factory):
    """Name of a problem -> folder of its result by two processes, made with those that are solved together with it."""

    @cache
    def made(names):
        folder = tmp_path_factory.mktemp("mpi")
        requests = {name: (PROBLEMS[name].to_dict(), options(name).to_dict()) for name in names}
        (folder / "problems.json").write_text(json.dumps(requests))
        launched(2, CODE, str(folder))
        return folder

    return lambda name: made(next(names for names in TOGETHER if name in names)) / name


@pytest.mark.parametrize(
    "name", [*TOGETHER[0], *TOGETHER[1], *(pytest.param(name, marks=pytest.mark.validate) for name in TOGETHER[2])]
)
def test_two_processes_give_the_serial_result(name, parallel):
    folder = parallel(name)
    problem = PROBLEMS[name]
    chosen = options(name)
    serial = begun(problem, chosen, lambda event: None).result if problem.closed else solve(problem, chosen)
    data = json.loads((folder / "shell.json").read_text())
    surface = ShellSurface.load(folder / "shell.npz")
    assert data["provenance"]["processes"] == 2
    assert data["status"] == serial.status.value == "converged"
    assert (data["stable"], data["negative_eigenvalues"]) == (True, 0)
    assert data["lowest_eigenvalue"] == pytest.approx(serial.lowest_eigenvalue, rel=1e-6)
    np.testing.assert_allclose(surface.points, serial.surface.points, atol=1e-10)
    np.testing.assert_allclose(surface.directors, serial.surface.directors, atol=1e-9)
    for key, value in serial.energy.items():
        assert data["energy"][key] == pytest.approx(value, abs=1e-10 * max(1.0, abs(serial.energy["elastic"])))
    for where, clamp in serial.clamps.items():
        for kind, vector in clamp.items():
            np.testing.assert_allclose(data["clamps"][where][kind], vector, atol=1e-6)
    walls_are_alike(data, serial)
    kinds = ["stage", "method", "accepted", "negative"]
    if name != SWINGS:
        kinds.append("iterations")
    assert [[s[key] for key in kinds] for s in data["steps"]] == [
        [getattr(s, key) for key in kinds] for s in serial.steps
    ]
    np.testing.assert_allclose([s["load"] for s in data["steps"]], [s.load for s in serial.steps], atol=1e-8)
    with np.load(folder / "shell.npz") as stored:
        for key in ("cell_midpoints", "energy_density"):
            mine = getattr(serial, key)
            order = [np.lexsort(x["cell_midpoints"].T) for x in (stored, {"cell_midpoints": serial.cell_midpoints})]
            scale = max(1.0, np.max(np.abs(mine)))
            np.testing.assert_allclose(stored[key][order[0]], mine[order[1]], atol=1e-8 * scale)


def walls_are_alike(data, serial):
    """The same places push what is touched and each other, with the same forces."""
    assert len(data["walls"]) == len(serial.walls)
    for wall, own in zip(data["walls"], serial.walls, strict=True):
        size = max(1.0, float(np.abs(own["force"]).max()))
        for key in ("force", "moment"):
            np.testing.assert_allclose(wall[key], own[key], atol=1e-9 * size)
        assert (wall["height"] is None) == (own["height"] is None)
        assert wall["gap"] == pytest.approx(own["gap"], abs=1e-10)
        places = [np.array(x).reshape(-1, 2) for x in (wall["contacts"], own["contacts"])]
        order = [np.lexsort(x.T.round(9)) for x in places]
        assert len(places[0]) == len(places[1]) > 0
        np.testing.assert_allclose(places[0][order[0]], places[1][order[1]], atol=1e-12)
        pushes = [np.array(x)[k] for x, k in zip((wall["pushes"], own["pushes"]), order, strict=True)]
        np.testing.assert_allclose(*pushes, atol=1e-8 * size)
    assert len(data["pairs"]) == len(serial.pairs)
    pairs = [
        sorted((round(p["s"], 9), round(p["v"], 9), *p["force"]) for p in x) for x in (data["pairs"], serial.pairs)
    ]
    np.testing.assert_allclose(*pairs, atol=1e-6)
    if serial.contact is not None:
        assert max(data["contact"][key] for key in ("through", "pull", "product")) < 1e-9


@pytest.mark.parametrize("processes", [2, 3])
def test_the_first_process_has_the_seam_of_a_band(processes):
    """The cells of both ends are its own, in runs along the strip for the others; too few cells are refused."""
    script = """
import numpy as np
from mpi4py import MPI
from shellref.fenics import dolfinx_api as api
comm, s, v = MPI.COMM_WORLD, np.linspace(0.0, 1.0, 13), np.linspace(-0.1, 0.1, 3)
mesh = api.rectangle(s, v, comm, closed=True)
middles, nodes = api.cell_midpoints(mesh)[:, 0], api.node_coordinates(api.lagrange_space(mesh, 2, 6))[:, 0]
ends = np.isclose(nodes, 0.0).sum(), np.isclose(nodes, 1.0).sum()
assert ends == ((5, 5) if comm.rank == 0 else (0, 0)), ends
every = comm.allgather(np.abs(middles - 0.5))
assert all(one.min() > other.max() - 1e-9 for one, other in zip(every, every[1:]))
assert sum(map(len, every)) == 24
try:
    api.rectangle(np.linspace(0.0, 1.0, 4 * comm.size), v, comm, closed=True)
except ValueError:
    print("refused")
"""
    assert launched(processes, script).count("refused") == processes


@pytest.mark.parametrize(
    ("change", "why"),
    [({"slide": ((0.0, 0.0, 1.0), None)}, "edges"), ({"transverse_curvature": 2.0}, "edges")],
)
def test_what_needs_one_process_says_so(change, why, monkeypatch):
    from shellref import ShellInputError
    from shellref.fenics import dolfinx_api

    monkeypatch.setattr(dolfinx_api, "communicator", lambda processes: SimpleNamespace(size=2, rank=0))
    with pytest.raises(ShellInputError) as caught:
        solve(replace(PROBLEMS["branch"], **change), OPTIONS, processes="world")
    assert caught.value.key == "processes"
    assert why in str(caught.value)
