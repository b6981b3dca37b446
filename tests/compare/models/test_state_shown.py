"""A state of any model shows itself: line, table, files, picture, PyVista."""

import json

import numpy as np
import pytest

from compare.models import solve
from compare.scene import load
from ribbonbench.errors import BadInput, Missing

SI = {"model.elements": 10}


@pytest.fixture(scope="module", params=["ribbon", "elastica"])
def state(request):
    return solve(load("cantilever").replace(SI), request.param)


def test_a_line_and_a_table(state):
    assert repr(state).count("\n") == 0
    assert len(repr(state)) < 160
    assert state.model in repr(state)
    assert state._repr_html_().count("<tr>") >= 4


def test_units_of_the_scene():
    found = solve(load("figure_4_1"))
    assert found.units.known
    assert found.width == pytest.approx(0.03)
    weight = 1000.0 * 9.81 * 0.5 * 0.015 * 1e-4
    assert found.units.force * found.supports.start.force[0] == pytest.approx(weight, rel=1e-9)
    assert "J</td>" in found._repr_html_()


def test_files(state, tmp_path):
    read = json.loads(state.save(tmp_path / "a.json").read_text())
    assert read["energy"]["total"] == state.energy.total
    assert read["supports"]["start"]["force"] == state.supports.start.force.tolist()
    with np.load(state.save(tmp_path / "a.npz"), allow_pickle=False) as data:
        np.testing.assert_allclose(data["points"][:, data["v"].size // 2], state.shape.centreline(data["s"]), atol=1e-9)
        assert data["field_energy_density"].shape == data["points"].shape[:2]
        assert json.loads(str(data["numbers"]))["status"] == state.word
    with pytest.raises(BadInput):
        state.save(tmp_path / "a.vtk")


def test_pyvista_and_picture(state, monkeypatch):
    from matplotlib.figure import Figure

    given = Figure().add_subplot(projection="3d")
    assert state.plot(given) is given
    pytest.importorskip("pyvista")
    mesh = state.to_pyvista()
    assert mesh.area == pytest.approx(state.width, rel=1e-3)
    assert mesh.point_data["S"].max() == 1.0
    assert mesh.points[-1] == pytest.approx(state.shape.points(np.ones(1), np.array([0.5 * state.width]))[0, 0])
    monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    with pytest.raises(Missing):
        state.to_pyvista()


@pytest.fixture(
    scope="module",
    params=[
        ("cantilever", "sadowsky"), ("cantilever", "elastica"), ("rod_4_5", "antman"), ("rod_4_5", "curve_angle"),
        ("tape_4_1_equal", "tape"),
    ],
    ids=lambda param: param[1],
)  # fmt: skip
def shape(request):
    name, energy = request.param
    return solve(load(name).replace({"model.energy": energy})).shape


@pytest.mark.parametrize("s", [-1e-3, 1.5, float("nan")])
def test_no_shape_goes_on_beyond_the_strip(shape, s):
    v = np.zeros(1)
    requested = (
        lambda at: shape.centreline(at),
        lambda at: shape.frames(at),
        lambda at: shape.points(at, v),
        lambda at: shape.fields(at, v),
        lambda at: shape.pose(at[-1]),
    )
    for ask in requested:
        with pytest.raises(BadInput) as failed:
            ask(np.array([0.5, s]))
        assert failed.value.key == "s"
    rounded, end = (shape.centreline(np.array([at]))[0] for at in (1.0 + 1e-12, 1.0))
    np.testing.assert_array_equal(rounded, end)
