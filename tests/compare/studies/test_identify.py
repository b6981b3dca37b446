"""Keys fitted to points: what is known is found again, within its interval; bad points and keys are refused by name."""

from __future__ import annotations

import json

import numpy as np
import pytest

from compare import cli, registry
from compare.errors import BadInput
from compare.scene.scene import loads
from compare.studies.identify import Points, identify, read_points
from tests.compare.studies.test_inputs import STRIP

TRUE = {"strip.young": 2.3e9, "strip.natural_curvature": 2.5}
S = np.linspace(0.05, 1.0, 12)


@pytest.fixture(scope="module")
def scene():
    return loads(STRIP, "strip")


def curve(scene, s):
    state = registry.model("ribbon").solve(scene)
    assert state.ok
    return state.shape.centreline(s)


@pytest.fixture(scope="module")
def exact(scene):
    return curve(scene.replace(TRUE), S)


@pytest.mark.parametrize("with_s", [True, False])
def test_exact_points_give_the_keys_back(scene, exact, with_s):
    found = identify(scene, Points(exact, S if with_s else None), list(TRUE))
    assert found.ok
    for fitted in found.keys:
        assert fitted.value == pytest.approx(TRUE[fitted.key], rel=1e-6)
    assert found.rms < 1e-9
    np.testing.assert_allclose(found.feet, S, atol=1e-6)
    assert found.iterations < 25


def test_the_jacobian_is_that_of_the_residuals(scene, exact):
    from compare.studies.identify import _Fit

    rng = np.random.default_rng(3)
    fit = _Fit(scene, Points(exact + 1e-2 * rng.normal(size=exact.shape)), (*TRUE, "strip.poisson"))
    jacobian, h = fit.jacobian(fit.start), 1e-4
    for k in range(3):
        unit = np.eye(3)[k] * h
        fourth = (
            8 * (fit.residuals(fit.start + unit) - fit.residuals(fit.start - unit))
            - fit.residuals(fit.start + 2 * unit)
            + fit.residuals(fit.start - 2 * unit)
        ) / (12 * h)
        np.testing.assert_allclose(jacobian[:, k], fourth, atol=2e-6 * np.abs(jacobian[:, k]).max())


def test_intervals_cover_what_is_true(scene, exact):
    """Of 20 fits to points with noise, some 95 % have each key within its interval."""
    rng = np.random.default_rng(11)
    inside = []
    for _ in range(20):
        found = identify(scene, Points(exact + 2e-3 * rng.normal(size=exact.shape), S), list(TRUE))
        inside += [low < TRUE[f.key] < high for f in found.keys for low, high in [f.interval]]
        assert 1e-3 < found.rms < 6e-3
    assert 0.85 <= np.mean(inside) <= 1.0


def test_keys_that_cannot_be_fitted_are_named(scene, exact):
    points = Points(exact, S)
    for free in ([], ["strip.young", "strip.young"], ["strip.gamma"], ["gravity.up"]):
        with pytest.raises(BadInput) as caught:
            identify(scene, points, free)
        assert caught.value.key == "--free"
    with pytest.raises(BadInput, match=r"young.*density"):
        identify(scene, points, ["strip.young", "strip.density"])
    weightless = scene.replace({"gravity": False})
    with pytest.raises(BadInput) as caught:
        identify(weightless, points, ["strip.young"])
    assert caught.value.value == "strip.young"
    with pytest.raises(BadInput) as caught:
        identify(scene, Points(exact[:1]), ["strip.young", "strip.natural_curvature", "strip.poisson"])
    assert caught.value.key == "POINTS"


@pytest.mark.parametrize(
    ("text", "line"),
    [("x,y\n1,2\n", "line 1"), ("", "line 1"), ("x,y,z\n1,2,3\n1,b,3\n", "line 3"), ("x,y,z\n1,2\n", "line 2"),
     ("x,y,z\n1,2,inf\n", "line 2"), ("s,x,y,z\n7.0,0,0,0\n", "line 2")],
)  # fmt: skip
def test_a_bad_file_is_refused_by_its_line(tmp_path, text, line):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        read_points(path, 0.3)
    assert caught.value.key == "POINTS"
    assert line in caught.value.problem


def test_the_command(tmp_path, scene, exact, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.toml").write_text(STRIP)
    rng = np.random.default_rng(2)
    rows = 0.3 * (exact + 1e-3 * rng.normal(size=exact.shape))
    (tmp_path / "points.csv").write_text("x,y,z\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    line = ["identify", "strip.toml", "points.csv", "--free", ",".join(TRUE), "--out", "out"]
    assert cli.main(line) == 0
    told = json.loads((tmp_path / "out" / "result.json").read_text())["identified"]
    assert {entry["key"] for entry in told["keys"]} == set(TRUE)
    for entry in told["keys"]:
        low, high = entry["interval"]
        assert low < entry["value"] < high
    assert told["rms_m"] == pytest.approx(0.3 * told["rms"])
    for name in ("page.json", "identify.png", "fitted.toml", "table.csv"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    fitted = loads((tmp_path / "out" / "fitted.toml").read_text(), "fitted")
    assert fitted.strip.young == pytest.approx(told["keys"][0]["value"])
    (tmp_path / "points.csv").write_text("x,y\n0,0\n")
    assert cli.main(line) == 2
