"""`ribbonbench shell`: the contract's files, several w/h, mpirun, going on after an interruption, exit codes."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from compare.measure.energy_map import density_on_grid, shares
from compare.models import solve as solve_scene
from compare.models.shell import PARTS, state_of
from compare.models.shell_process import ShellCase
from compare.page.page import read_page
from compare.pages import solve as solve_page
from compare.pages.export.vtu import triangles
from compare.scene.scene import load
from ribbon.surface import grid_triangles
from ribbonbench.world import World, placed
from shellref.shell.surface import ShellSurface
from tests.patience import PATIENCE

#: A small scene: its corners held, two stages' worth of steps in a second.
SMALL = ("limits_7_3", "--elements", "16", "4")
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
TOGETHER = {
    **ENVIRONMENT, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",  # whoever waits leaves its core to the tests beside it
}  # fmt: skip
MPIRUN = ("mpirun", "--oversubscribe", "-n", "2")


def command(*arguments):
    """The command line of a process of its own."""
    return [sys.executable, "-m", "compare.cli", "shell", *map(str, arguments)]


def alone(*arguments, environment=ENVIRONMENT, before=()):
    """A finished process of `ribbonbench shell`."""
    return subprocess.run(
        [*before, *command(*arguments)], capture_output=True, text=True, check=False, env=environment, timeout=PATIENCE
    )


needs_dolfinx = pytest.mark.shell
needs_mpirun = pytest.mark.skipif(shutil.which("mpirun") is None, reason="no mpirun")


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """The small scene solved once in one process: its folder and what was said."""
    pytest.importorskip("dolfinx")
    out = tmp_path_factory.mktemp("serial")
    done = alone(*SMALL, "--out", out)
    assert done.returncode == DONE, done.stderr
    return out, done


def result_of(out: Path):
    return json.loads((out / "result.json").read_text())


@needs_dolfinx
def test_result_json_keeps_the_contract(serial):
    out, done = serial
    result = result_of(out)
    keys = """status stable lowest_eigenvalue residual iterations energy end middle max_abs_eta max_abs_eta_prime_w_half
        forces seconds model provenance share"""
    assert set(keys.split()) <= set(result)
    assert (result["status"], result["stable"]) == ("converged", True)
    assert result["lowest_eigenvalue"] > 0
    assert result["residual"] < 1e-7
    assert result["model"] == {**result["model"], "energy": "naghdi", "elements": [16, 4], "clamp": "corners"}
    assert result["model"]["corner"] == 0.01
    energy = result["energy"]
    assert energy["total"] == pytest.approx(energy["elastic"] + energy["gravity"])
    assert energy["elastic"] == pytest.approx(sum(energy[part] for part in PARTS))
    assert energy["total"] == pytest.approx(-31.49, abs=0.35)
    assert sum(result["share"].values()) == pytest.approx(1.0)
    assert result["forces"] == {"start": pytest.approx([0, 0, 100], abs=1e-6), "end": None, "walls": []}
    assert {"first", "warm"} <= set(result["seconds"])
    frame = np.array(result["end"]["frame"])
    assert np.abs(frame.T @ frame - np.eye(3)).max() < 1e-12
    assert "rows" not in result
    assert result["complete"] is True
    assert result["provenance"]["scene"]["shell"]["elements"] == [16, 4]
    assert result["provenance"]["shell"]["versions"]["dolfinx"]
    assert "equilibrium at the full load" in done.stdout


@needs_dolfinx
def test_files_of_a_run(serial):
    out, _ = serial
    names = {"result.json", "page.json", "path.csv", "shell.npz", "shell.vtu", "shell.png", "cases"}
    assert {path.name for path in out.iterdir()} == names
    page = read_page(out)
    assert [s.width_to_thickness for s in page.surfaces] == [result_of(out)["width_to_thickness"]]
    assert set(page.files) == names - {"page.json", "shell.png", "cases"}
    surface = ShellSurface.load(out / "shell.npz")
    result = result_of(out)
    assert surface.points[-1, 4] == pytest.approx(result["end"]["position"], abs=1e-12)
    with (out / "path.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    head = "width_to_thickness stage method load accepted iterations factorisations seconds correction negative note"
    places = [f"{place}_{axis}" for place in ("middle", "end") for axis in "xyz"]
    assert list(rows[0]) == [*head.split(), *places]
    assert rows[-1]["stage"] == "gravity"
    assert float(rows[-1]["load"]) == 1.0
    assert [float(rows[-1][f"end_{axis}"]) for axis in "xyz"] == pytest.approx(result["end"]["position"])
    assert sum(int(row["iterations"]) for row in rows) == result["iterations"]
    mesh = meshio.read(out / "shell.vtu")
    assert mesh.points == pytest.approx(surface.points.reshape(-1, 3))
    shares = sum(mesh.cell_data[f"{name}_share"][0] for name in ("bending", "membrane", "shear"))
    assert len(shares) == 2 * 32 * 8
    assert shares.max() < 1.0
    assert np.median(shares) > 0.99  # the held corner cells store nothing
    corners = mesh.points[mesh.cells_dict["triangle"]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    membrane = float(area @ mesh.cell_data["membrane_energy"][0]) / 0.1
    assert membrane == pytest.approx(result["energy"]["membrane"], rel=0.02)
    from matplotlib.image import imread

    pixels = imread(out / "shell.png")[:, :, :3]
    assert pixels.shape[0] > 300
    blue = (pixels[:, :, 2] > pixels[:, :, 0] + 0.2).mean()
    assert 0.05 < blue < 0.6
    assert (pixels[:, :, 0] > pixels[:, :, 2] + 0.2).mean() > 1e-4


@needs_dolfinx
def test_the_model_says_and_writes_the_same_as_the_command(serial, tmp_path):
    """The shell solved as a model, in a process of its own and with nothing kept: the same numbers and arrays."""
    out, _ = serial
    command_result = result_of(out)
    scene = load("limits_7_3").replace({"shell.elements": [16, 4]})
    state = solve_scene(scene, "shell")
    solve_page.write(tmp_path, scene, state, "")
    result = result_of(tmp_path)
    for key in ("status", "stable", "iterations", "width_to_thickness", "start"):
        assert result[key] == command_result[key], key
    for key in ("energy", "share"):
        assert result[key] == pytest.approx(command_result[key], rel=1e-9), key
    assert result["energy"]["elastic"] == state.energy.elastic
    assert result["energy"]["total"] == state.energy.total
    assert result["model"].items() >= {"clamp": "corners", "formulation": "mixed", "elements": [16, 4]}.items()
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in out.iterdir()} - {"cases"}
    with np.load(out / "shell.npz") as one, np.load(tmp_path / "shell.npz") as two:
        assert set(one.files) == set(two.files)
        assert np.abs(one["points"] - two["points"]).max() < 1e-10
        assert two["energy_density"] == pytest.approx(one["energy_density"], rel=1e-6, abs=1e-6)
    # the files of the run are gone, its fields are not: every part of the energy is there
    assert not state.native.folder.exists()
    s, v = np.linspace(0.005, 0.995, 100), np.array([-0.04, 0.0, 0.04])
    fields = state.shape.fields(s, v)
    parts = sum(fields[f"{name}_density"] for name in ("bending", "membrane", "shear"))
    assert np.abs(parts - fields["energy_density"]).max() < 1e-12 * np.abs(parts).max()
    assert dict(solve_page.rows(scene, state))["status"] == "converged"


@needs_dolfinx
def test_the_energy_field_integrates_to_the_energy():
    """Both without the constant of the natural curvature, which is linear along the strip."""
    pytest.importorskip("dolfinx")
    scene = load("curl_4_3").replace({"shell.elements": [16, 4], "strip.natural_curvature": [4.0, 2.0]})
    state = solve_scene(scene.replace({"shell.width_to_thickness": 20}), "shell")
    assert state.ok
    surface = state.shape.surface
    s, v = (nodes[:: surface.degree] for nodes in (surface.s_nodes, surface.v_nodes))
    middles = [0.5 * (x[1:] + x[:-1]) for x in (s, v)]
    density = state.shape.fields(*middles)["energy_density"]
    assert state.energy.constant == pytest.approx((16 + 8 + 4) / 6)
    stored = state.energy.elastic - state.energy.parts["stabilisation"]  # what holds the elements' own modes is nowhere
    assert np.diff(s) @ density @ np.diff(v) == pytest.approx(scene.width * stored, rel=1e-9)


def test_a_shell_whose_process_died_is_written_too(tmp_path):
    case = ShellCase({"status": "crashed", "stable": None, "message": "killed", "seconds": {}}, None, False)
    scene = load("limits_7_3")
    state = state_of(scene, case)
    solve_page.write(tmp_path, scene, state, "")
    assert result_of(tmp_path)["status"] == "crashed"
    assert {path.name for path in tmp_path.iterdir()} == {"result.json", "page.json"}
    assert "killed" in solve_page.sentences(scene, state)[0]


@needs_dolfinx
def test_neither_ribbon_nor_its_solvers_are_imported(tmp_path):
    pytest.importorskip("dolfinx")
    code = (
        "import sys\nfrom compare.cli import main\ncode = main(sys.argv[1:])\n"
        "bad = [m for m in sys.modules if m.split('.')[0] in ('ribbon', 'cyipopt')]\n"
        "assert 'dolfinx' in sys.modules\nassert not bad, bad\nsys.exit(code)"
    )
    arguments = ["shell", *SMALL, "--width-to-thickness", "20", "--out", str(tmp_path), "--quiet"]
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False, env=ENVIRONMENT
    )
    assert done.returncode == DONE, done.stderr
    assert done.stdout == ""


@needs_dolfinx
@needs_mpirun
def test_two_processes_find_the_same_numbers(serial, tmp_path):
    out, _ = serial
    done = alone(*SMALL, "--out", tmp_path, environment=TOGETHER, before=MPIRUN)
    assert done.returncode == DONE, done.stderr
    one, two = result_of(out), result_of(tmp_path)
    assert two["provenance"]["shell"]["processes"] == 2
    assert done.stdout.count("equilibrium at the full load") == 1
    for key in ("status", "stable", "negative_eigenvalues", "load_factor"):
        assert one[key] == two[key], key
    for key in ("energy", "share"):
        assert two[key] == pytest.approx(one[key], rel=1e-10, abs=1e-10), key
    for key in ("end", "middle"):
        assert two[key]["position"] == pytest.approx(one[key]["position"], abs=1e-10)
        assert np.array(two[key]["frame"]) == pytest.approx(np.array(one[key]["frame"]), abs=1e-10)
    weight = 100.0
    for kind in ("forces", "moments"):
        assert two[kind]["start"] == pytest.approx(one[kind]["start"], abs=1e-10 * weight)
    assert two["lowest_eigenvalue"] == pytest.approx(one["lowest_eigenvalue"], rel=1e-5)
    a, b = (ShellSurface.load(folder / "shell.npz") for folder in (out, tmp_path))
    assert np.abs(a.points - b.points).max() < 1e-10
    assert two["iterations"] == one["iterations"]


@needs_mpirun
@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("limits_7_3", "--set", "strip.width=-1"), "strip.width = -1"),
        (("limits_7_3", "--out", "/proc/nowhere"), "--out"),
        (("limits_7_3", "--elements", "2"), "--elements"),
    ],
)
def test_two_processes_say_an_error_once(arguments, word):
    done = alone(*arguments, environment=TOGETHER, before=MPIRUN)
    assert done.returncode == BAD_INPUT
    assert sum(line.startswith("ribbonbench") and word in line for line in done.stderr.splitlines()) == 1


RING = """
[strip]
length = 1.0
width = 0.05
thickness = 1e-3
poisson = 0.0
[closure]
kind = "circle"
[shell]
elements = [20, 2]
"""
SEAM = "[clamp.start]\nposition = [0.0, 0.0, 0.0]\ntangent = [0.0, 0.0, 1.0]\nnormal = [0.0, 1.0, 0.0]\n"


@pytest.mark.validate
@needs_dolfinx
@needs_mpirun
def test_two_processes_bend_a_ring_whose_seam_is_held_and_say_what_they_cannot(tmp_path):
    """2 pi^2 D w / l of a circle bent from flat; one that nothing holds is refused in one line."""
    scene = tmp_path / "ring.toml"
    scene.write_text(RING + SEAM)
    done = alone(scene, "--out", tmp_path / "ring", environment=TOGETHER, before=MPIRUN)
    assert done.returncode == DONE, done.stderr
    found = result_of(tmp_path / "ring")
    assert found["provenance"]["shell"]["processes"] == 2
    assert found["stable"]
    assert found["energy"]["elastic"] == pytest.approx(2.0 * np.pi**2, rel=1e-2)
    scene.write_text(RING)
    done = alone(scene, "--out", tmp_path / "free", environment=TOGETHER, before=MPIRUN)
    assert done.returncode == BAD_INPUT
    assert sum(line.startswith("ribbonbench: ") and "one process" in line for line in done.stderr.splitlines()) == 1


@needs_mpirun
def test_other_commands_refuse_mpirun():
    arguments = [*MPIRUN, sys.executable, "-m", "compare.cli", "solve", "limits_7_3"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False, env=TOGETHER)
    assert done.returncode == BAD_INPUT
    assert "mpirun" in done.stderr


#: The command of argv[1:], which keeps every step, says so after the third and then waits for what may come.
WAITING = """
import sys, time
import shellref.path.journal
from compare.cli import main
shellref.path.journal.EVERY = 0.0
keep, kept = shellref.path.journal.FolderJournal.point, []
def point(self, *rest, **more):
    keep(self, *rest, **more)
    kept.append(1)
    if len(kept) == 3:
        print("kept", flush=True)
        while True:
            time.sleep(0.1)
shellref.path.journal.FolderJournal.point = point
sys.exit(main(sys.argv[1:]))
"""


@needs_dolfinx
@pytest.mark.parametrize("how", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.validate)])
def test_an_interrupted_run_goes_on(tmp_path, how):
    pytest.importorskip("dolfinx")
    arguments = ("limits_7_3", "--elements", "30", "4", "--out", tmp_path, "--quiet")
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING, "shell", *map(str, arguments)],
        env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "kept\n"
    process.send_signal(how)
    said = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == (130 if how == signal.SIGINT else -signal.SIGKILL)
    if how == signal.SIGINT:
        assert said.startswith("ribbonbench: interrupted")
        assert said.count("\n") == 1
    kept = tmp_path / "cases" / ".unfinished"
    logs = list(kept.glob("*/path/steps.jsonl"))
    first = json.loads(logs[0].read_text().splitlines()[0])
    done = alone(*arguments)
    assert done.returncode == DONE, done.stderr
    result = result_of(tmp_path)
    with (tmp_path / "path.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[0]["seconds"]) == first["seconds"]
    assert result["iterations"] == sum(int(row["iterations"]) for row in rows)
    assert result["status"] == "converged"
    assert list(kept.iterdir()) == []


@needs_dolfinx
def test_several_thicknesses_are_rows_and_finished_ones_are_kept(tmp_path):
    pytest.importorskip("dolfinx")
    scene = ("curl_4_3", "--elements", "20", "2", "--out", str(tmp_path), "--width-to-thickness")
    assert main(["shell", *scene, "20"]) == DONE
    assert main(["shell", *scene, "20", "50"]) == DONE
    assert read_page(tmp_path).tables[0].values("reused") == (True, False)
    result = result_of(tmp_path)
    rows = result["rows"]
    assert [(row["width_to_thickness"], row["reused"]) for row in rows] == [(20.0, True), (50.0, False)]
    assert {**rows[1], **result} == result
    # without the constant of the natural curvature (K = 10): near the ribbon's -37.5
    assert rows[1]["energy"]["elastic"] == pytest.approx(-38.0, abs=0.5)
    assert rows[1]["energy"]["elastic_with_constant"] == pytest.approx(rows[1]["energy"]["elastic"] + 50.0)
    names = {"shell_w20.npz", "shell_w20.vtu", "shell_w50.npz", "shell_w50.vtu", "shell.png", "path.csv", "result.json"}
    assert names <= {path.name for path in tmp_path.iterdir()}
    with (tmp_path / "path.csv").open() as stream:
        assert {row["width_to_thickness"] for row in csv.DictReader(stream)} == {"20.0", "50.0"}


@needs_dolfinx
def test_two_clamps_and_plain_newton(tmp_path):
    """Without a ribbon the shell of 7.2 goes from an arc to the same state that compare finds at the ribbon's."""
    pytest.importorskip("dolfinx")
    arguments = ["shell", "shift_7_2", "--elements", "20", "2", "--width-to-thickness", "50", "--quiet"]
    assert main([*arguments, "--out", str(tmp_path / "mixed")]) == DONE
    assert main([*arguments, "--plain", "--out", str(tmp_path / "plain")]) == DONE
    mixed, plain = result_of(tmp_path / "mixed"), result_of(tmp_path / "plain")
    assert (mixed["model"]["formulation"], plain["model"]["formulation"]) == ("mixed", "plain")
    assert mixed["iterations"] < plain["iterations"]
    assert mixed["energy"]["total"] == pytest.approx(plain["energy"]["total"], rel=1e-8)
    assert mixed["middle"]["position"] == pytest.approx([0.25, 0.05, 0.369], abs=2e-3)
    assert mixed["end"]["position"] == pytest.approx([0.5, 0.1, 0.0], abs=1e-12)
    force, other = (np.array(mixed["forces"][name]) for name in ("start", "end"))
    assert np.abs(force + other).max() < 1e-6 * np.abs(force).max()
    stages = [row["stage"] for row in csv.DictReader((tmp_path / "mixed" / "path.csv").open())]
    assert list(dict.fromkeys(stages)) == ["natural", "clamps"]


@needs_dolfinx
def test_a_tolerance_refines_the_mesh(tmp_path):
    pytest.importorskip("dolfinx")
    arguments = ["shell", "cantilever", "--elements", "6", "1", "--tolerance", "3e-3", "--width-to-thickness", "20"]
    assert main([*arguments, "--out", str(tmp_path), "--quiet"]) == DONE
    result = result_of(tmp_path)
    assert result["discretisation"]["reached"] is True
    assert result["discretisation"]["estimate"] <= 3e-3
    assert result["model"]["elements"] != [6, 1]
    assert ShellSurface.load(tmp_path / "shell.npz").points.shape[0] == 2 * result["model"]["elements"][0] + 1


@needs_dolfinx
def test_a_shell_that_does_not_get_there_ends_with_1_and_is_written(tmp_path):
    pytest.importorskip("dolfinx")
    arguments = ["shell", "curl_4_3", "--elements", "6", "1", "--width-to-thickness", "20000", "--out", str(tmp_path),
                 "--set", "strip.gamma=30000", "--quiet"]  # fmt: skip
    assert main(arguments) == NOT_CONVERGED
    result = result_of(tmp_path)
    assert result["status"] != "converged"
    assert result["message"]
    assert result["complete"] is False
    assert (tmp_path / "shell.png").exists()


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("roman_6_2",), "shell.width_to_thickness"),
        (("curl_4_3", "--width-to-thickness", "0.5"), "shell.width_to_thickness"),
        (("curl_4_3", "--elements", "0", "4"), "shell.elements"),
        (("curl_4_3", "--tolerance", "1.0"), "shell.tolerance"),
        (("limits_7_3", "--elements", "3", "2"), "shell.elements"),
    ],
)
def test_bad_input_is_one_line(capsys, tmp_path, arguments, key):
    if key == "shell.elements":
        pytest.importorskip("dolfinx")
    assert main(["shell", *arguments, "--out", str(tmp_path), "--quiet"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.startswith(f"ribbonbench: {key}")
    assert said.count("\n") == 1
    assert not (tmp_path / "result.json").exists()


def test_without_dolfinx_the_remedy_is_said(tmp_path):
    (tmp_path / "dolfinx.py").write_text("raise ImportError('not here')\n")
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[3])])
    done = alone(*SMALL, "--out", tmp_path / "o", "--quiet", environment={**ENVIRONMENT, "PYTHONPATH": path})
    assert done.returncode == MISSING
    assert "apt-get install python3-dolfinx" in done.stderr
    assert done.stderr.count("\n") == 1


# -- parts ------------------------------------------------------------------------------------------------------------


def test_shares_and_the_order_of_cells(tmp_path):
    """Cells in any order come back on the grid; what stores nothing has no share."""
    s, v = np.linspace(0, 1, 9), np.linspace(-0.1, 0.1, 5)
    points = np.stack(np.broadcast_arrays(v, 0.0, s[:, None]), axis=-1)
    surface = ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy())
    grid = np.stack(np.meshgrid(s[1::2], v[1::2], indexing="ij"), axis=-1).reshape(-1, 2)
    density = np.column_stack([np.full(8, 1.0), grid[:, 0], grid[:, 1] + 0.1])
    density[0] = 0.0
    order = np.random.default_rng(0).permutation(8)
    surface.save(tmp_path / "shell.npz", cell_midpoints=grid[order], energy_density=density[order])
    found = density_on_grid(ShellCase({}, tmp_path, False))
    assert found.reshape(8, 3) == pytest.approx(density)
    parts = shares(found)
    assert parts[0, 0] == pytest.approx(0.0)
    assert parts.reshape(8, 3)[1:].sum(axis=1) == pytest.approx(1.0, abs=1e-5)


def test_triangles_are_those_of_the_ribbons_surface():
    assert np.array_equal(triangles(4, 3), grid_triangles(4, 3))


class Comm:
    """Two processes one after the other: what the first one broadcasts, the second receives."""

    def __init__(self):
        self.sent = []

    def bcast(self, value, root):
        self.sent.append(value)
        return self.sent[0]


def test_what_the_first_process_finds_is_known_to_all():
    comm = Comm()
    assert World(0, 2, comm).on_first(lambda: 7) == 7
    assert World(1, 2, comm).on_first(lambda: 1 / 0) == 7
    failed = Comm()
    for rank in (0, 1):
        with pytest.raises(ZeroDivisionError):
            World(rank, 2, failed).on_first(lambda: 1 / 0)


def test_places_in_an_mpirun(monkeypatch):
    for name in ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMI_SIZE"):
        monkeypatch.delenv(name, raising=False)
    assert placed() == (0, 1)
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setenv("PMI_SIZE", "3")
    assert placed() == (1, 3)
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "0")
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    assert placed() == (0, 2)


def test_the_scene_keeps_what_the_command_line_said():
    scene = load("limits_7_3")
    assert scene.shell_corner == 0.01
    assert scene.notes() == ()
