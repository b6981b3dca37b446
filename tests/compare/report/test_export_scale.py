"""The scale of an export: metres of a scene in SI, the unit of another, what --scale asks for."""

import json
import struct

import meshio
import numpy as np
import pytest

from compare.cli import BAD_INPUT, main
from compare.page.page import read_page
from compare.pages.export.formats import texture_coordinates
from compare.pages.export.scale import Scale
from compare.pages.export.source import read_source, scaled

BAND = """
[strip]
length = 0.2
width = 0.01
thickness = 1e-4
poisson = 0.3
young = 2.1e11
density = 7850.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[gravity]
up = [0.0, 0.0, 1.0]
[model]
energy = "wunderlich"
elements = 8
"""


@pytest.fixture(scope="module")
def band(tmp_path_factory):
    """A folder of results of a band of 0.2 m."""
    folder = tmp_path_factory.mktemp("band")
    (folder / "band.toml").write_text(BAND)
    assert main(["solve", str(folder / "band.toml"), "--out", str(folder / "out"), "--quiet"]) == 0
    return folder / "out"


def exported(band, *more):
    out = band.parent / "-".join(["export", *more])
    assert main(["export", str(band), "--out", str(out), "--quiet", *more]) == 0
    return out


def glb_positions(path):
    raw = path.read_bytes()
    size = struct.unpack_from("<I", raw, 12)[0]
    document = json.loads(raw[20 : 20 + size])
    binary = raw[28 + size :]
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    view = document["bufferViews"][accessor["bufferView"]]
    return np.frombuffer(binary, "<f4", 3 * accessor["count"], view["byteOffset"]).reshape(-1, 3)


def test_a_band_of_20_cm_is_0_2_long_in_every_format(band):
    out = exported(band)
    surface = read_source(band).surfaces[0].sheet
    box = 0.2 * np.ptp(surface.points, axis=0)
    assert 0.15 < np.linalg.norm(box) < 0.2
    np.testing.assert_allclose(np.ptp(glb_positions(out / "surfaces.glb"), axis=0), box, rtol=1e-5, atol=1e-8)
    for name in ("ribbon.vtu", "ribbon.obj", "ribbon.ply"):
        np.testing.assert_allclose(np.ptp(meshio.read(out / name).points, axis=0), box, rtol=1e-7, atol=1e-9)
    points = np.genfromtxt(out / "ribbon_points.csv", delimiter=",", names=True)
    np.testing.assert_allclose([np.ptp(points[axis]) for axis in "xyz"], box, rtol=1e-9, atol=1e-10)
    line = np.genfromtxt(out / "centreline.csv", delimiter=",", names=True)
    assert line["s"][-1] == pytest.approx(0.2)
    assert np.genfromtxt(out / "segments.csv", delimiter=",", names=True)["length"].sum() == pytest.approx(0.2)


def test_curvatures_and_energies_go_with_the_lengths(band):
    """The integral of the density over the strip, in J, is the elastic energy; the curve turns by the same angle."""
    out = exported(band, "--format", "npz")
    joule = json.loads((band / "result.json").read_text())["si"]["energy"]["elastic"]
    with np.load(out / "ribbon.npz") as data, np.load(band / "ribbon.npz") as kept:
        s = data["line_s"]
        density = data["line_energy_density"]
        assert np.sum(0.5 * (density[1:] + density[:-1]) * np.diff(s)) == pytest.approx(joule, rel=1e-4)
        assert data["width"] == pytest.approx(0.01)
        np.testing.assert_allclose(data["line_omega"] * 0.2, kept["line_omega"], rtol=1e-12)
        a, b, n, m = data["parameters"].T
        np.testing.assert_allclose(
            a * data["segment_lengths"] + b, np.append(b[1:], data["line_omega"][-1]), rtol=1e-9, atol=1e-8
        )
        np.testing.assert_allclose([n * 0.2, m], kept["parameters"][:, 2:].T)
        shape = tuple(data["shape"])
        area, rows = data["point_energy_density"].reshape(shape), data["point_S"].reshape(shape)[:, 0]
        mean = 0.5 * (area[1:, 0] + area[:-1, 0])  # straight rulings across: the same at every v
        assert np.sum(mean * np.diff(rows)) * 0.01 == pytest.approx(joule, rel=1e-3)


@pytest.mark.parametrize(("asked", "size"), [("1000", 200.0), ("l", 1.0), ("0.5", 0.1)])
def test_what_scale_asks_for(band, asked, size):
    out = exported(band, "--format", "csv", "--scale", asked)
    assert np.genfromtxt(out / "segments.csv", delimiter=",", names=True)["length"].sum() == pytest.approx(size)
    told = json.loads((out / "result.json").read_text())["scale"]
    assert told["length"] == pytest.approx(size)
    assert read_page(out).verdict


@pytest.mark.parametrize("asked", ["0", "-1", "nan", "mm"])
def test_no_scale(band, asked, tmp_path):
    assert main(["export", str(band), "--scale", asked, "--out", str(tmp_path / "no")]) == BAD_INPUT
    assert not (tmp_path / "no").exists()


def test_a_scene_with_gamma_is_in_its_own_unit():
    assert Scale.of({"units": {"known": False}, "length": 300.0}).length == 300.0
    assert Scale.of({"units": {"known": False}, "length": 300.0}, "2").length == 600.0
    assert Scale.of({}).unit == "l"


def test_texture_coordinates_are_those_of_the_material(band):
    source = read_source(band)
    small = scaled(source, Scale(0.2, "m")).surfaces[0].sheet
    np.testing.assert_allclose(texture_coordinates(small), texture_coordinates(source.surfaces[0].sheet), atol=1e-12)
