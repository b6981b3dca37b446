"""Every format of `ribbonbench export` read back by an independent reader and compared with the solver's numbers."""

from __future__ import annotations

import csv
import json
import struct
import xml.etree.ElementTree as ET
from pathlib import Path

import meshio
import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, NOT_CONVERGED, main
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.ribbon.fields import fields
from compare.models.ribbon.state import RibbonShape
from compare.page.page import Page, Surface, read_page, write_page
from compare.pages.export.formats import COLOURED_BY, pvd_bytes
from compare.pages.export.gltf import glb_bytes, turn
from compare.pages.export.source import FORMATS, chosen, read_source
from compare.pages.export.vtu import Sheet, grid_sheet, read_vtu, triangles, write_vtu
from compare.scene.scene import load, loads
from ribbon.analysis import along
from ribbonbench.errors import BadInput
from tests.compare.models import outside
from tests.compare.report.test_report import result, states
from tests.compare.scene import held_scenes
from tests.compare.studies.outside import registered
from tests.energy_integrals import over_s, over_surface

SCALARS = {"S", "v", "ruling_foot", "segment", "omega", "eta", "energy_density"}
VECTORS = {"ruling", "tangent", "width_direction", "normal"}


@pytest.fixture(scope="module")
def solved():
    """A ribbon of ten segments, as `ribbonbench export` solves it too."""
    return solve_scene(load("coil_10_100"), "ribbon").native


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of an export of a scene in every format."""
    out = tmp_path_factory.mktemp("export")
    assert main(["export", "coil_10_100", "--out", str(out), "--quiet"]) == DONE
    return out


@pytest.fixture(scope="module")
def surface(solved):
    """The surface as the solver has it, on the grid of the export."""
    scene = load("coil_10_100")
    grid = Grid.for_shape(scene, float(np.abs(solved.omega(np.linspace(0, 1, 2001))).max()))
    points = grid.of(RibbonShape(solved))
    return grid, points.reshape(-1, 3), fields(solved, grid.s, grid.v)


def test_the_files_of_an_export(made):
    names = {path.name for path in made.iterdir()}
    wanted = {"ribbon.vtu", "surfaces.pvd", "ribbon.obj", "ribbon.ply", "surfaces.glb", "ribbon_points.csv",
              "centreline.csv", "segments.csv", "ribbon.npz", "result.json", "page.json", "solve"}  # fmt: skip
    assert names == wanted
    page = read_page(made)
    assert page.again.startswith("ribbonbench export coil_10_100 --out ")
    assert set(page.files) == wanted - {"result.json", "page.json", "solve"}
    result = json.loads((made / "result.json").read_text())
    assert result["status"] == "converged"
    assert result["exported"] == dict(page.files)


# --- the numbers that come along -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "energy"), [("coil_10_100", "sadowsky"), ("curl_4_3", "wunderlich")])
def test_energy_per_length_and_per_area_integrate_to_the_elastic_energy(name, energy):
    scene = load(name)
    e = solve_scene(scene, "ribbon").native
    assert e.problem.energy == energy
    assert over_s(e) == pytest.approx(e.energy.elastic, rel=1e-9)
    assert over_surface(e) == pytest.approx(e.energy.elastic, rel=1e-6)


def test_the_exported_energy_density_integrates_over_the_triangles(made, solved):
    """On the exported file itself: the triangles' areas in the flat strip, the mean of the corners' densities."""
    mesh = meshio.read(made / "ribbon.vtu")
    flat = np.column_stack([mesh.point_data["S"], mesh.point_data["v"]])[mesh.cells_dict["triangle"]]
    (ax, ay), (bx, by) = (flat[:, 1] - flat[:, 0]).T, (flat[:, 2] - flat[:, 0]).T
    area = 0.5 * np.abs(ax * by - ay * bx)
    width = np.ptp(mesh.point_data["v"])
    assert area.sum() == pytest.approx(width)
    density = mesh.point_data["energy_density"][mesh.cells_dict["triangle"]].mean(axis=1)
    assert area @ density / width == pytest.approx(solved.energy.elastic, rel=2e-3)


def test_segment_numbers(solved):
    joints = np.concatenate([[0.0], np.cumsum(solved.problem.lengths)])
    middles = 0.5 * (joints[1:] + joints[:-1])
    assert list(along.segment_of(solved, middles)) == list(range(10))
    assert list(along.segment_of(solved, np.array([-0.1, 0.0, 1.0, 1.1]))) == [0, 0, 9, 9]


def test_rulings_that_cross_have_no_energy_per_area(solved):
    density = along.area_density(solved, np.array([0.55, 0.55]), np.array([0.0, 1e6]))
    slope = solved.parameters[along.segment_of(solved, np.array([0.55])), 2]
    assert np.isfinite(density[0])
    assert np.isnan(density[1]) == (slope[0] < 0)
    assert np.isnan(along.area_density(solved, np.array([0.55]), -np.sign(slope) * 1e6)).all()


# --- formats ---------------------------------------------------------------------------------------------------------


def test_vtu(made, surface):
    _, points, fields = surface
    mesh = meshio.read(made / "ribbon.vtu")
    assert mesh.points.shape == points.shape
    assert np.abs(mesh.points - points).max() == 0.0
    assert set(mesh.point_data) == SCALARS | VECTORS
    for name, values in fields.items():
        assert mesh.point_data[name].shape == values.reshape(len(points), *values.shape[2:]).shape
        assert np.array_equal(mesh.point_data[name], values.reshape(mesh.point_data[name].shape))


@pytest.mark.parametrize("along", [3, 700])
def test_vtu_is_read_to_the_last_bit(tmp_path, along):
    """By meshio and by VTK, of one block (less than 32,768 bytes an array) and of several, names and gaps included."""
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    random = np.random.default_rng(1)
    grid = random.standard_normal((along, 7, 3))
    by_point = {'e < 1 & "w"': random.standard_normal((along, 7)), "normal": random.standard_normal((along, 7, 3))}
    by_point['e < 1 & "w"'][0, 0] = np.nan
    sheet = grid_sheet(grid, by_point, {"share": random.standard_normal((along - 1, 6))})
    path = write_vtu(tmp_path / "s.vtu", grid, by_point, {"share": sheet.cells["share"][: 6 * (along - 1)]})
    first = meshio.read(path)
    assert np.array_equal(first.points, sheet.points)
    assert np.array_equal(first.cells_dict["triangle"], sheet.triangles)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    second = reader.GetOutput()
    assert np.array_equal(vtk_to_numpy(second.GetPoints().GetData()), sheet.points)
    assert np.array_equal(vtk_to_numpy(second.GetCells().GetConnectivityArray()), sheet.triangles.ravel())
    for name, values in sheet.fields.items():
        assert np.array_equal(first.point_data[name], values, equal_nan=True)
        assert np.array_equal(vtk_to_numpy(second.GetPointData().GetArray(name)), values, equal_nan=True)
    assert np.array_equal(first.cell_data["share"][0], sheet.cells["share"])
    assert np.array_equal(vtk_to_numpy(second.GetCellData().GetArray("share")), sheet.cells["share"])


def test_pvd(made, surface):
    import pyvista

    reader = pyvista.get_reader(made / "surfaces.pvd")
    reader.set_active_time_value(0.0)
    block = reader.read()[0]
    assert np.abs(np.asarray(block.points) - surface[1]).max() == 0.0
    assert set(block.point_data.keys()) == SCALARS | VECTORS


def test_pvd_has_a_time_step_for_each_ratio(tmp_path):
    import pyvista

    folder = tmp_path / "results"
    sheets = []
    for k, name in enumerate(("ribbon", "shell_w10", "shell_w50")):
        grid = np.stack([*np.meshgrid(np.linspace(0, 1, 5), [0.0, 0.1, 0.2], indexing="ij"), np.full((5, 3), k)], 2)
        s, v = np.meshgrid(np.linspace(0, 1, 5), [-0.1, 0.0, 0.1], indexing="ij")
        write_vtu(folder / f"{name}.vtu", grid, {"S": s, "v": v})
        ratio = float(name[7:]) if k else None
        sheets.append(Surface(f"{name}.vtu", name, "shell" if k else "ribbon", width_to_thickness=ratio))
    write_page(folder, Page("compare", 'A title with <&" quotes', surfaces=tuple(sheets)))
    assert main(["export", str(folder), "--format", "pvd,gltf", "--quiet"]) == DONE
    reader = pyvista.get_reader(folder / "export" / "surfaces.pvd")
    assert reader.time_values == [10.0, 50.0]
    for time, height in ((10.0, 1.0), (50.0, 2.0)):
        reader.set_active_time_value(time)
        blocks = reader.read()
        assert [float(block.points[0, 2]) for block in blocks] == [0.0, height]
    assert not (folder / "export" / "ribbon.obj").exists()
    document = ET.fromstring(pvd_bytes([(1.0, 0, 'a "label" & <more>', "x.vtu")]))
    assert document[0][0].attrib["name"] == 'a "label" & <more>'


def test_obj(made, surface):
    import pyvista

    grid, points, _ = surface
    mesh = meshio.read(made / "ribbon.obj")
    assert mesh.points.shape == points.shape
    assert np.abs(mesh.points - points).max() < 1e-8
    assert np.array_equal(mesh.cells_dict["triangle"], triangles(grid.s.size, grid.v.size))
    read = pyvista.read(made / "ribbon.obj")
    texture = np.asarray(read.active_texture_coordinates)
    assert texture.shape == (len(points), 2)
    s, v = np.meshgrid(grid.s, (grid.v - grid.v[0]) / np.ptp(grid.v), indexing="ij")
    assert np.abs(texture - np.column_stack([s.ravel(), v.ravel()])).max() < 1e-6


def test_ply(made, surface):
    _, points, fields = surface
    mesh = meshio.read(made / "ribbon.ply")
    assert mesh.points.shape == points.shape
    assert np.abs(mesh.points - points).max() == 0.0
    for name in SCALARS - {"v"}:
        assert np.allclose(mesh.point_data[name], fields[name].ravel(), rtol=1e-6, atol=1e-7), name
    for name in VECTORS:
        stored = np.column_stack([mesh.point_data[f"{name}_{axis}"] for axis in "xyz"])
        assert np.allclose(stored, fields[name].reshape(-1, 3), atol=1e-6), name
    import pyvista

    read = pyvista.read(made / "ribbon.ply")
    assert read.n_points == len(points)
    assert read.n_cells == len(mesh.cells_dict["triangle"])
    assert read.point_data["RGB"].std() > 10


def gltf(path: Path):
    """JSON and binary chunk of a .glb file, its frame checked."""
    raw = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", raw)
    assert (magic, version, length) == (b"glTF", 2, len(raw))
    size, kind = struct.unpack_from("<I4s", raw, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    after = 20 + size
    binary, kind = struct.unpack_from("<I4s", raw, after)
    assert kind == b"BIN\0"
    assert binary % 4 == 0
    assert after + 8 + binary == len(raw)
    return json.loads(raw[20:after]), raw[after + 8 :]


KINDS = {5126: "<f4", 5125: "<u4", 5121: "u1"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def accessor(document, binary, number):
    """The values of an accessor; alignment, lengths and bounds checked as the specification (3.6.2) asks."""
    entry = document["accessors"][number]
    view = document["bufferViews"][entry["bufferView"]]
    kind, width = np.dtype(KINDS[entry["componentType"]]), WIDTHS[entry["type"]]
    assert (entry["byteOffset"] + view["byteOffset"]) % kind.itemsize == 0
    assert view["byteOffset"] % 4 == 0
    if view["target"] == 34962:  # vertex attributes: strides of whole words
        assert kind.itemsize * width % 4 == 0
    assert entry["count"] * width * kind.itemsize <= view["byteLength"]
    assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"] <= len(binary)
    values = np.frombuffer(binary, kind, entry["count"] * width, view["byteOffset"]).reshape(entry["count"], width)
    if "min" in entry:
        assert values.min(axis=0).tolist() == entry["min"]
        assert values.max(axis=0).tolist() == entry["max"]
    return values


def test_gltf_keeps_the_rules(made, surface):
    _, points, fields = surface
    document, binary = gltf(made / "surfaces.glb")
    assert document["asset"]["version"] == "2.0"
    (primitive,) = document["meshes"][0]["primitives"]
    attributes = primitive["attributes"]
    position = accessor(document, binary, attributes["POSITION"])
    assert {"min", "max"} <= set(document["accessors"][attributes["POSITION"]])
    assert np.array_equal(position, points.astype("<f4"))
    normal = accessor(document, binary, attributes["NORMAL"])
    assert np.abs(np.linalg.norm(normal, axis=1) - 1.0).max() < 1e-6
    colour = document["accessors"][attributes["COLOR_0"]]
    assert colour["normalized"] is True
    assert len({tuple(c) for c in accessor(document, binary, attributes["COLOR_0"])}) > 50
    assert accessor(document, binary, attributes["TEXCOORD_0"]).shape == (len(points), 2)
    for name in SCALARS:
        stored = accessor(document, binary, attributes[f"_{name.upper()}"])
        assert np.array_equal(stored[:, 0], fields[name].ravel().astype("<f4")), name
    assert all(key.startswith("_") or key in ("POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0") for key in attributes)
    indices = accessor(document, binary, primitive["indices"])
    assert indices.max() == len(points) - 1
    assert len(indices) % 3 == 0
    assert document["nodes"][0]["children"] == [1]


def test_gltf_is_read_by_vtk(made, surface):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkGLTFReader

    reader = vtkGLTFReader()
    reader.SetFileName(str(made / "surfaces.glb"))
    reader.ApplyDeformationsToGeometryOff()
    reader.Update()
    blocks = reader.GetOutput()
    found = []
    iterator = blocks.NewIterator()
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        found.append(iterator.GetCurrentDataObject())
        iterator.GoToNextItem()
    (mesh,) = found
    assert mesh.GetNumberOfPoints() == len(surface[1])
    assert mesh.GetNumberOfCells() == len(triangles(surface[0].s.size, surface[0].v.size))
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    up = load("coil_10_100").up
    turned = points if np.abs(points - surface[1]).max() < 1e-6 else rotated(surface[1], turn(up))
    assert np.abs(points - turned).max() < 1e-6


def rotated(points, quaternion):
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion).apply(points)


@pytest.mark.parametrize("up", [(1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0.6, 0.0, -0.8), (1e-9, -1, 0)])
def test_gltf_turns_up_to_y(up):
    assert np.abs(rotated(np.array(up, dtype=float), turn(up)) - [0, 1, 0]).max() < 1e-8
    assert np.linalg.norm(turn(up)) == pytest.approx(1.0)


def test_gltf_without_material_coordinates_and_with_unknown_values():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    plain = Sheet(points, np.array([[0, 1, 2], [1, 3, 2]]))
    coloured = Sheet(points, plain.triangles, {COLOURED_BY[0]: np.array([0.0, np.nan, 1.0, 2.0])})
    raw = glb_bytes([("a", plain), ("b", coloured)], None)
    assert b"NaN" not in raw
    size = struct.unpack_from("<I", raw, 12)[0]
    document = json.loads(raw[20 : 20 + size])
    first, second = (mesh["primitives"][0]["attributes"] for mesh in document["meshes"])
    assert set(first) == {"POSITION", "NORMAL"}
    assert {"COLOR_0", "_ENERGY_DENSITY"} <= set(second)


def test_csv(made, solved, surface):
    _, points, fields = surface
    with (made / "ribbon_points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(points)
    for axis, column in zip("xyz", points.T, strict=True):
        assert np.abs(np.array([float(row[axis]) for row in rows]) - column).max() < 1e-11
    omega = np.array([float(row["omega"]) for row in rows])
    assert np.allclose(omega, fields["omega"].ravel(), rtol=1e-10)
    line = np.genfromtxt(made / "centreline.csv", delimiter=",", names=True)
    assert line.shape == (401,)
    position = solved.position(line["s"])
    assert np.abs(np.column_stack([line[axis] for axis in "xyz"]) - position).max() < 1e-11
    assert np.allclose(line["energy_density"], along.line_density(solved, line["s"]), rtol=1e-9)
    segments = np.genfromtxt(made / "segments.csv", delimiter=",", names=True)
    assert segments.shape == (10,)
    assert np.allclose(np.column_stack([segments[k] for k in "abnm"]), solved.parameters, rtol=1e-10)


def test_npz(made, solved, surface):
    grid, points, fields = surface
    with np.load(made / "ribbon.npz", allow_pickle=False) as data:
        assert np.array_equal(data["parameters"], solved.parameters)
        assert np.array_equal(data["segment_lengths"], solved.problem.lengths)
        assert data["joints"].shape == (solved.problem.lengths.size + 1,)
        np.testing.assert_allclose(
            data["joints"], np.concatenate([[0.0], np.cumsum(solved.problem.lengths)]), atol=1e-14
        )
        assert np.array_equal(data["joint_positions"], solved.joints[0])
        assert np.array_equal(data["line_position"], solved.position(data["line_s"]))
        assert data["line_frame"].shape == (401, 3, 3)
        assert np.array_equal(data["points"], points)
        assert tuple(data["shape"]) == (grid.s.size, grid.v.size)
        assert np.array_equal(data["triangles"], triangles(grid.s.size, grid.v.size))
        for name in SCALARS | VECTORS:
            assert np.array_equal(data[f"point_{name}"], fields[name].reshape(data[f"point_{name}"].shape))
        # a segment's own law, put together again from the file alone
        k = 3
        a, b, n, m = data["parameters"][k]
        s = data["joints"][k] + 0.4 * data["segment_lengths"][k]
        local = s - data["joints"][k]
        assert solved.omega(s)[0] == pytest.approx(a * local + b)
        assert solved.eta(s)[0] == pytest.approx(n * local + m)


# --- a model from outside ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def bow(tmp_path_factory):
    """The folder of an export of a scene of an outside model, and its surface and fields in closed form."""
    folder = tmp_path_factory.mktemp("bow")
    path = folder / "arc.toml"
    path.write_text(outside.SCENE.format(energy="arc"))
    with registered(folder / "site", outside.Arc):
        scene = loads(path.read_text())
        assert main(["export", str(path), "--scale", "l", "--out", str(folder / "out"), "--quiet"]) == DONE
    grid = Grid.for_shape(scene, 1.0)
    s, v = (part.ravel() for part in np.meshgrid(grid.s, grid.v, indexing="ij"))
    scalars = {"S": s, "v": v, "energy_density": -0.5 * s, "x": 2.0 * s}
    normal = np.column_stack([np.sin(s), 0.0 * s, np.cos(s)])
    vectors = {"normal": normal, "pull of weight": np.broadcast_to(outside.PULL, normal.shape)}
    return folder / "out", np.column_stack([np.sin(s), v, np.cos(s) - 1.0]), scalars, vectors


def test_the_files_of_a_model_from_outside(bow):
    out, _, _, _ = bow
    names = {path.name for path in out.iterdir()}
    assert names == {"arc.vtu", "surfaces.pvd", "arc.obj", "arc.ply", "surfaces.glb", "arc_points.csv", "arc.npz",
                     "result.json", "page.json", "solve"}  # fmt: skip
    result = json.loads((out / "result.json").read_text())
    assert (result["status"], result["model"]["energy"]) == ("converged", "arc")
    assert {path.name for path in (out / "solve").iterdir()} == {
        "arc.vtu",
        "centreline.csv",
        "result.json",
        "page.json",
    }
    line = np.genfromtxt(out / "solve" / "centreline.csv", delimiter=",", names=True)
    assert np.abs(line["z"] - (np.cos(line["s"]) - 1.0)).max() < 1e-11


def test_vtu_and_npz_of_a_model_from_outside(bow):
    out, points, scalars, vectors = bow
    mesh = meshio.read(out / "arc.vtu")
    assert np.abs(mesh.points - points).max() < 1e-14
    with np.load(out / "arc.npz", allow_pickle=False) as data:
        assert np.abs(data["points"] - points).max() < 1e-14
        assert set(mesh.point_data) == scalars.keys() | vectors.keys()
        assert {name for name in data.files if name.startswith("point_")} == {
            f"point_{name}" for name in mesh.point_data
        }
        for name, values in {**scalars, **vectors}.items():
            assert np.abs(mesh.point_data[name] - values).max() < 1e-14, name
            assert np.abs(data[f"point_{name}"] - values).max() < 1e-14, name


def test_ply_and_csv_keep_fields_whose_names_they_need_themselves(bow):
    """The field x beside the coordinate x, the field with blanks in one word."""
    out, points, scalars, vectors = bow
    mesh = meshio.read(out / "arc.ply")
    line = np.genfromtxt(out / "arc_points.csv", delimiter=",", names=True)
    assert np.abs(mesh.points - points).max() < 1e-14
    assert np.abs(np.column_stack([line[axis] for axis in "xyz"]) - points).max() < 1e-11
    for table, within in ((mesh.point_data, 1e-6), (line, 1e-11)):
        assert np.abs(table["x_"] - scalars["x"]).max() < within
        assert np.abs(table["energy_density"] - scalars["energy_density"]).max() < within
        for name, values in vectors.items():
            stored = np.column_stack([table[f"{name.replace(' ', '_')}_{axis}"] for axis in "xyz"])
            assert np.abs(stored - values).max() < within, name


def test_gltf_and_obj_of_a_model_from_outside(bow):
    out, points, scalars, _ = bow
    document, binary = gltf(out / "surfaces.glb")
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    assert np.array_equal(accessor(document, binary, attributes["POSITION"]), points.astype("<f4"))
    for name, values in scalars.items():
        assert np.abs(accessor(document, binary, attributes[f"_{name.upper()}"])[:, 0] - values).max() < 1e-6, name
    assert len({tuple(c) for c in accessor(document, binary, attributes["COLOR_0"])}) > 50
    assert np.abs(meshio.read(out / "arc.obj").points - points).max() < 1e-8


def test_arrays_of_a_ribbon_that_was_in_the_folder_before_are_left_alone(bow, made, tmp_path):
    """The arc solved into the folder of a ribbon: the ribbon's arrays are still there, and are not the arc's."""
    folder = tmp_path / "results"
    folder.mkdir()
    for path in (bow[0] / "solve").iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "ribbon.npz").write_bytes((made / "solve" / "ribbon.npz").read_bytes())
    assert main(["export", str(folder), "--format", "npz,csv", "--quiet"]) == DONE
    names = {path.name for path in (folder / "export").iterdir()}
    assert names == {"arc.npz", "arc_points.csv", "result.json", "page.json"}
    with np.load(folder / "export" / "arc.npz", allow_pickle=False) as data:
        assert "parameters" not in data.files
    # beside the ribbon's own surface they are the ribbon's alone
    (folder / "ribbon.vtu").write_bytes((made / "solve" / "ribbon.vtu").read_bytes())
    both = tuple(Surface(f"{name}.vtu", name, "ribbon") for name in ("arc", "ribbon"))
    write_page(folder, Page("compare", "both", surfaces=both))
    assert main(["export", str(folder), "--format", "npz", "--quiet"]) == DONE
    for name in ("arc", "ribbon"):
        with np.load(folder / "export" / f"{name}.npz", allow_pickle=False) as data:
            assert ("parameters" in data.files) == (name == "ribbon")


# --- surfaces --------------------------------------------------------------------------------------------------------


def test_a_sheet_knows_its_grid():
    s, v = np.meshgrid(np.linspace(0, 1, 4), np.linspace(-1, 1, 3), indexing="ij")
    points = np.stack([s, v, 0 * s], axis=2)
    sheet = grid_sheet(points, {"S": s, "v": v}, {"share": np.arange(6.0).reshape(3, 2)})
    assert sheet.shape == (4, 3)
    assert np.array_equal(sheet.normals(), np.tile([0.0, 0.0, 1.0], (12, 1)))
    assert sheet.scalars()["share"].shape == (12,)
    assert sheet.scalars()["share"][0] == 0.0
    assert Sheet(sheet.points, sheet.triangles[::-1], sheet.fields).shape is None
    assert Sheet(sheet.points, sheet.triangles).shape is None


@pytest.mark.parametrize("content", [b"", b"nonsense", b"<VTKFile/>", "half"])
def test_a_damaged_surface(tmp_path, made, content):
    whole = (made / "ribbon.vtu").read_bytes()
    path = tmp_path / "ribbon.vtu"
    path.write_bytes(whole[: len(whole) // 2] if content == "half" else content)
    with pytest.raises(BadInput, match=r"ribbon\.vtu.*cannot be read"):
        read_vtu(path)


# --- sources and mistakes --------------------------------------------------------------------------------------------


def run(capsys, *arguments):
    code = main(["export", *map(str, arguments)])
    said = capsys.readouterr()
    assert said.err.count("ribbonbench:") <= 1
    return code, said.out, said.err


def test_an_unknown_format_names_the_known(capsys, tmp_path):
    code, _, err = run(capsys, "coil_10_100", "--format", "vtu,stl", "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "stl" in err
    assert all(name in err for name in FORMATS)
    assert not (tmp_path / "o").exists()
    with pytest.raises(BadInput, match="names no format"):
        chosen(" , ")
    assert chosen("PLY, obj,ply") == ("ply", "obj")


def test_a_folder_without_surfaces(capsys, tmp_path):
    assert run(capsys, tmp_path, "--quiet")[0] == BAD_INPUT
    write_page(tmp_path, Page("sweep", "numbers only"))
    code, _, err = run(capsys, tmp_path)
    assert code == BAD_INPUT
    assert "no surfaces" in err
    assert {path.name for path in tmp_path.iterdir()} == {"page.json"}


@pytest.mark.parametrize("name", ["../ribbon.vtu", "/etc/hostname", "absent.vtu"])
def test_a_page_that_names_other_files(tmp_path, name):
    write_page(tmp_path, Page("solve", "x", surfaces=(Surface(name, "ribbon", "ribbon"),)))
    with pytest.raises(BadInput, match=r"page\.json names"):
        read_source(tmp_path)


def test_neither_folder_nor_scene(capsys, tmp_path):
    code, _, err = run(capsys, tmp_path / "absent", "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "neither a folder nor a scene" in err
    code, _, err = run(capsys, "cantilever", "--set", "model.energy=elastica", "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "no surface" in err
    assert not (tmp_path / "o").exists()  # said before anything is solved
    assert run(capsys, "daisy_5g", "--out", tmp_path / "o")[0] == BAD_INPUT


def test_options_that_do_not_fit_a_folder(capsys, made, tmp_path):
    code, _, err = run(capsys, made / "solve", "--set", "strip.gamma=3")
    assert code == BAD_INPUT
    assert "--set" in err
    code, _, err = run(capsys, made / "solve", "--out", made / "solve")
    assert code == BAD_INPUT
    assert "another folder" in err


def test_a_folder_of_results_without_the_segments(capsys, made, tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("page.json", "result.json", "ribbon.vtu"):
        (folder / name).write_bytes((made / "solve" / name).read_bytes())
    code, out, _ = run(capsys, folder, "--format", "npz,csv")
    assert code == DONE
    assert "segments are left out" in out
    assert {p.name for p in (folder / "export").glob("*.csv")} == {"ribbon_points.csv"}
    (folder / "ribbon.npz").write_bytes(b"PK nonsense")
    code, _, err = run(capsys, folder, "--format", "npz")
    assert code == BAD_INPUT
    assert "ribbon.npz" in err


def test_a_ribbon_that_is_not_stable_is_exported_with_exit_code_1(capsys, tmp_path):
    path = tmp_path / "edge.toml"
    # a way that changes more than the weight stays on its saddle
    path.write_text(f'{held_scenes.ON_EDGE}[[path]]\n"strip.gamma" = 5.0\n"strip.poisson" = 0.3\n')
    code, _, _ = run(capsys, path, "--format", "ply", "--out", tmp_path / "o", "--quiet")
    assert code == NOT_CONVERGED
    assert (tmp_path / "o" / "ribbon.ply").is_file()
    assert "edge.toml --format ply" in read_page(tmp_path / "o").again


def test_the_states_of_a_path_are_an_animation(tmp_path):
    """Every key frame of path.glb, first mesh and weighted targets, is a state of the path in metres."""
    folder = result(tmp_path / "film", film=True)
    metres = {"known": True, "length_m": 0.2, "force_N": 1.0, "bending_stiffness_Nm": 1.0}
    (folder / "result.json").write_text(json.dumps({"units": metres}))
    assert main(["export", str(folder), "--format", "gltf", "--quiet"]) == DONE
    document, binary = gltf(folder / "export" / "path.glb")
    known = states()

    def values(number):
        accessor = document["accessors"][number]
        view, width = (
            document["bufferViews"][accessor["bufferView"]],
            {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]],
        )
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        found = np.frombuffer(binary, kind, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        if "min" in accessor:
            assert found.min(axis=0) == pytest.approx(accessor["min"], abs=1e-7)
            assert found.max(axis=0) == pytest.approx(accessor["max"], abs=1e-7)
        return found

    (mesh,), (animation,) = document["meshes"], document["animations"]
    (primitive,), (sampler,), (channel,) = mesh["primitives"], animation["samplers"], animation["channels"]
    assert channel["target"]["path"] == "weights"
    assert document["nodes"][channel["target"]["node"]]["mesh"] == 0
    seconds = values(sampler["input"])[:, 0]
    assert seconds == pytest.approx(known.seconds)
    assert seconds[-1] == pytest.approx(2.0)  # of the one stage that is gone to
    count = len(primitive["targets"])
    assert count == len(known.t) - 1
    weights = values(sampler["output"]).reshape(len(seconds), count)
    assert mesh["weights"] == weights[-1].tolist()
    first = {name: values(primitive["attributes"][name]) for name in ("POSITION", "NORMAL")}
    moved = {name: np.array([values(target[name]) for target in primitive["targets"]]) for name in first}
    for state, weight in zip(known.points, weights, strict=True):
        shown = {name: first[name] + np.tensordot(weight, moved[name], axes=1) for name in first}
        assert shown["POSITION"] == pytest.approx(0.2 * state.reshape(-1, 3), abs=1e-6)
        assert np.linalg.norm(shown["NORMAL"], axis=1) == pytest.approx(1.0, abs=1e-5)
    assert document["accessors"][primitive["indices"]]["count"] == 6 * (len(known.s) - 1) * (len(known.v) - 1)
    assert not (tmp_path / "film" / "export" / "ribbon.obj").exists()


def test_without_a_path_there_is_no_animation(tmp_path):
    assert main(["export", str(result(tmp_path / "still")), "--format", "gltf", "--quiet"]) == DONE
    assert not (tmp_path / "still" / "export" / "path.glb").exists()
