"""A result's own words, files, pictures and SI numbers, against formulas by hand."""

import json

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip, solve

WEIGHT = 7850.0 * 9.81 * 0.01 * 1e-4 * 0.3


@pytest.fixture(scope="module")
def steel():
    strip = Strip.from_material(0.3, 0.01, 1e-4, young=2.1e11, density=7850.0, poisson=0.3)
    return solve(strip, Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1)), Gravity(up=(0, 0, 1)), segments=12)


@pytest.fixture(scope="module")
def bare():
    strip = Strip(1.0, 0.03, 0.3, gamma=5.0)
    return solve(strip, Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1)), Gravity(up=(0, 0, 1)), segments=12)


def test_the_clamp_carries_the_weight_in_newtons(steel):
    np.testing.assert_allclose(steel.si.start_force, [0.0, 0.0, WEIGHT], rtol=1e-9, atol=1e-9 * WEIGHT)
    s = np.linspace(0.0, 0.3, 2001)
    lever = np.mean(0.5 * (steel.si.position(s)[1:, 0] + steel.si.position(s)[:-1, 0]))
    assert abs(steel.si.start_moment[1]) == pytest.approx(WEIGHT * lever, rel=1e-6)
    assert steel.si.end_force is None


def test_energies_in_joules(steel):
    s = np.linspace(0.0, 1.0, 4001)
    bending = 2.1e11 * 1e-12 / (12.0 * (1.0 - 0.09))
    curvature = steel.omega(s) / 0.3
    square = np.sum(0.5 * (curvature[1:] ** 2 + curvature[:-1] ** 2)) * 0.3 / 4000
    assert steel.si.energy["elastic"] == pytest.approx(0.5 * bending * 0.01 * square, rel=1e-6)
    assert steel.si.energy["total"] == pytest.approx(steel.si.energy["elastic"] + steel.si.energy["gravity"])


def test_a_strip_without_material_has_no_numbers_in_si(bare):
    with pytest.raises(RibbonInputError):
        _ = bare.si
    with pytest.raises(RibbonInputError):
        Strip(1.0, 0.03, bending_stiffness=-1.0)


@pytest.mark.parametrize("name", ["steel", "bare"])
def test_a_line_and_a_table(request, name):
    result = request.getfixturevalue(name)
    assert repr(result).count("\n") == 0
    assert len(repr(result)) < 160
    assert "converged" in repr(result)
    table = result._repr_html_()
    assert table.count("<tr>") == table.count("</tr>") >= 6
    assert (" J" in table) == (name == "steel")


def test_numbers_as_json(steel, bare, tmp_path):
    read = json.loads(steel.save(tmp_path / "a.json").read_text())
    assert read["forces"]["start"] == steel.start.force.tolist()
    assert read["si"]["start_force"] == steel.si.start_force.tolist()
    assert read["energy"]["total"] == steel.energy.total
    assert json.loads(bare.save(tmp_path / "b.json").read_text())["si"] is None
    with pytest.raises(RibbonInputError):
        steel.save(tmp_path / "a.txt")
    assert not (tmp_path / "a.txt").exists()


def test_arrays_tell_the_shape(steel, tmp_path):
    """The segments' own law, and the surface, from the file alone."""
    with np.load(steel.save(tmp_path / "a.npz"), allow_pickle=False) as data:
        np.testing.assert_allclose(data["position"], steel.position(data["s"]))
        a, b = data["parameters"][0, :2]
        s = 0.4 * data["segment_lengths"][0]
        assert steel.omega(s)[0] == pytest.approx(a * s + b)
        assert data["triangles"].max() == len(data["points"]) - 1
        assert json.loads(str(data["numbers"]))["status"] == "converged"


def test_a_picture_on_axes(steel):
    from matplotlib.figure import Figure

    given = Figure().add_subplot(projection="3d")
    assert steel.plot(given) is given
    low, high = given.get_zlim()
    assert low < steel.end.position[2] < high
    assert given.collections


def test_pyvista(steel, monkeypatch):
    pytest.importorskip("pyvista")
    mesh = steel.to_pyvista(40, 4)
    assert mesh.n_points == 41 * 5
    assert mesh.area == pytest.approx(1.0 / 30.0, rel=1e-3)
    np.testing.assert_allclose(mesh.point_data["omega"], steel.omega(mesh.point_data["S"]), atol=1e-6)
    monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    with pytest.raises(ImportError, match="pip install"):
        steel.to_pyvista()
