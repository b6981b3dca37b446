"""Keys fitted to points: what is known is found again, within its interval; bad points and keys are refused by name."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compare import cli, registry
from compare.models.base import Options
from compare.scene.scene import load, loads
from compare.studies.identify import Points, identify, read_points
from ribbonbench.errors import BadInput
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
    fit = identify(scene, Points(exact, S if with_s else None), list(TRUE))
    assert fit.ok
    for fitted in fit.keys:
        assert fitted.value == pytest.approx(TRUE[fitted.key], rel=1e-6)
    assert fit.rms < 1e-9
    np.testing.assert_allclose(fit.feet, S, atol=1e-6)
    assert fit.iterations < 25


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
        fit = identify(scene, Points(exact + 2e-3 * rng.normal(size=exact.shape), S), list(TRUE))
        inside += [low < TRUE[f.key] < high for f in fit.keys for low, high in [f.interval]]
        assert 1e-3 < fit.rms < 6e-3
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
    assert told["grade"] == "good"
    assert told["scatter"] == pytest.approx(1e-3 * np.sqrt(2.0), rel=0.5)
    (tmp_path / "points.csv").write_text("x,y\n0,0\n")
    assert cli.main(line) == 2


# -- how good ---------------------------------------------------------------------------------------------------------


def written(path, places, s=None):
    table = places if s is None else np.column_stack([places, s])
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([["x,y,z", "x,y,z,s"][s is not None], *rows]))
    return path


def test_points_aside_are_no_fit(tmp_path, scene, exact, monkeypatch):
    """2 cm beside a strip of 30 cm: poor, exit code 1, the offset said; with --register the keys and the offset."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.toml").write_text(STRIP)
    written(tmp_path / "points.csv", 0.3 * exact + [0.0, 0.02, 0.0])
    line = ["identify", "strip.toml", "points.csv", "--free", ",".join(TRUE), "--quiet", "--out"]
    assert cli.main([*line, "aside"]) == 1
    told = json.loads((tmp_path / "aside" / "result.json").read_text())["identified"]
    assert told["grade"] == "poor"
    assert told["offset"]["shift"] == pytest.approx(0.02 / 0.3, rel=0.3)
    assert told["registered"] is None
    assert cli.main([*line, "moved", "--register"]) == 0
    told = json.loads((tmp_path / "moved" / "result.json").read_text())["identified"]
    assert told["grade"] == "good"
    assert told["rms"] < 1e-9
    np.testing.assert_allclose(told["registered"]["shift"], [0.0, -0.02 / 0.3, 0.0], atol=1e-7)
    assert {entry["key"]: entry["value"] for entry in told["keys"]} == pytest.approx(TRUE, rel=1e-5)


@pytest.mark.parametrize("with_s", [True, False])
@pytest.mark.parametrize("turn", [(0.02, -0.05, 0.03), (0.4, 2.0, -1.1)])
def test_points_in_axes_of_their_own(scene, exact, with_s, turn):
    """Any turn and shift are found together with the keys; noise of the points is their scatter."""
    rng = np.random.default_rng(7)
    places = np.array([3.0, -1.0, 0.5]) + Rotation.from_rotvec(turn).apply(exact)
    fit = identify(scene, Points(places, S if with_s else None), list(TRUE), register=True)
    assert fit.passes
    assert fit.rms < 1e-8
    assert {f.key: f.value for f in fit.keys} == pytest.approx(TRUE, rel=1e-5)
    np.testing.assert_allclose(fit.points.places, exact, atol=1e-7)
    turned = Rotation.from_rotvec(fit.registered.motion.turn) * Rotation.from_rotvec(turn)
    assert turned.magnitude() < 1e-6
    noisy = places + 1e-3 * rng.normal(size=places.shape)
    fit = identify(scene, Points(noisy, S if with_s else None), list(TRUE), register=True)
    assert fit.passes
    assert fit.scatter == pytest.approx(1e-3 * np.sqrt(3.0 if with_s else 2.0), rel=0.5)
    for f in fit.keys:  # the interval knows that the motion was not known either
        low, high = f.interval
        assert low - 0.5 * (high - low) < TRUE[f.key] < high + 0.5 * (high - low)


def test_the_jacobian_of_a_motion_is_that_of_the_residuals(scene, exact):
    from compare.studies.identify import _Fit

    rng = np.random.default_rng(5)
    for s in (None, S):
        fit = _Fit(scene, Points(exact + 1e-2 * rng.normal(size=exact.shape), s), tuple(TRUE), register=True)
        fit.begin()
        x = fit.start + np.concatenate([[0.01, 0.02], [0.3, -0.2, 0.1], [0.01, 0.02, -0.01]])
        jacobian, h = fit.jacobian(x), 1e-4
        for k, unit in enumerate(np.eye(x.size) * h):
            a, b, c, d = (fit.residuals(x + step * unit) for step in (1, -1, 2, -2))
            fourth = (8 * (a - b) - c + d) / (12 * h)
            np.testing.assert_allclose(jacobian[:, k], fourth, atol=2e-6 * np.abs(jacobian[:, k]).max())


@pytest.mark.parametrize("line", [np.linspace(0.1, 1.0, 9)])
def test_a_motion_that_points_do_not_tell(line):
    """Points of a straight strip: the turn about it cannot be found."""
    hanging = loads(STRIP, "strip").replace(
        {"gravity.up": [0.0, 0.0, -1.0], "clamp.start.normal": [0.0, 1.0, 0.0], "strip.natural_curvature": 0.0}
    )
    places = np.column_stack([0 * line, 0 * line, line])
    with pytest.raises(BadInput) as caught:
        identify(hanging, Points(places), ["strip.natural_curvature"], register=True)
    assert caught.value.key == "--register"


@pytest.mark.parametrize(("name", "factor"), [("mm", 1e3), ("cm", 1e2), ("in", 1 / 0.0254)])
def test_points_in_another_unit(tmp_path, scene, exact, monkeypatch, name, factor, capsys):
    """Said by its name, exit code 2; with --unit it is the same fit."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.toml").write_text(STRIP)
    written(tmp_path / "points.csv", 0.3 * factor * exact)
    line = ["identify", "strip.toml", "points.csv", "--free", ",".join(TRUE), "--quiet", "--out", "out"]
    assert cli.main(line) == 2
    assert f"--unit {name}" in capsys.readouterr().err
    assert cli.main([*line, "--unit", name]) == 0
    told = json.loads((tmp_path / "out" / "result.json").read_text())["identified"]
    assert {entry["key"]: entry["value"] for entry in told["keys"]} == pytest.approx(TRUE, rel=1e-6)
    written(tmp_path / "points.csv", 0.3 * factor * exact, 0.3 * factor * S)
    assert cli.main(line) == 2
    assert f"--unit {name}" in capsys.readouterr().err
    assert cli.main([*line, "--unit", name]) == 0
    assert cli.main([*line, "--unit", "furlong"]) == 2


def test_points_in_a_larger_unit_than_the_strip(exact):
    """A strip of 300 mm, by Gamma, and points in metres: a dot."""
    scene = load("curl_4_3").replace({"strip.length": 300.0, "strip.width": 9.0, "strip.natural_curvature": 0.03})
    places = curve(scene.replace({"strip.gamma": 60.0}), S)
    with pytest.raises(BadInput) as caught:
        identify(scene, Points(1e-3 * places), ["strip.gamma"])
    assert "--unit 1000" in caught.value.remedy
    fit = identify(scene, Points(1e-3 * places).in_unit(1e3), ["strip.gamma"])
    assert fit.keys[0].value == pytest.approx(60.0, rel=1e-6)


def test_what_is_left_is_judged(scene, exact):
    """Noise is good up to 1 % of the length; a difference of shapes that is as large is not."""
    rng = np.random.default_rng(4)
    noise = identify(scene, Points(exact + 4e-3 * rng.normal(size=exact.shape), S), list(TRUE))
    assert noise.rms > 3e-3
    assert noise.grade == "good"
    assert noise.scatter == pytest.approx(noise.rms, rel=0.5)
    wave = 1e-2 * np.sin(2.5 * np.pi * S)[:, None] * [1.0, 1.0, 0.0]
    bent = identify(scene, Points(exact + wave, S), list(TRUE))
    assert bent.scatter < 0.4 * bent.rms
    assert bent.grade in ("fair", "poor")
    assert bent.grade == ("poor" if bent.rms > 5e-3 else "fair")
    few = identify(scene, Points(exact[:2]), list(TRUE))
    assert few.scatter is None


# -- where it begins ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("curl", [2.0, -3.0])
def test_it_begins_where_the_curl_is_zero(curl):
    """Its heavy tail hangs straight, where rulings move nothing: the equilibrium has no derivative there."""
    scene = load("figure_4_1")
    true = curl / scene.strip.length
    places = curve(scene.replace({"strip.natural_curvature": true}), S)
    fit = identify(scene.replace({"strip.natural_curvature": 0.0}), Points(places), ["strip.natural_curvature"])
    assert fit.differenced
    assert fit.passes
    assert fit.keys[0].value == pytest.approx(true, rel=1e-6)


@pytest.mark.parametrize("curl", [3.0, -3.0])
def test_it_begins_beside_a_saddle(scene, curl):
    """A strip that stands upright, too heavy for it: it has fallen to the side of the points."""
    standing = scene.replace(
        {"gravity.up": [0.0, 0.0, 1.0], "clamp.start.normal": [0.0, 1.0, 0.0], "strip.natural_curvature": 0.0}
    )
    assert registry.model("ribbon").solve(standing, options=Options(leave_saddle=False)).stable is False
    places = curve(standing.replace({"strip.natural_curvature": curl}), S)
    fit = identify(standing, Points(places), ["strip.natural_curvature"])
    assert fit.began_beside
    assert fit.passes
    assert fit.keys[0].value == pytest.approx(curl, rel=1e-6)
    assert curve(fit.scene, S) == pytest.approx(places, abs=1e-6)  # fitted.toml is that state


def test_a_poor_fit_is_begun_elsewhere():
    """From no curl the least squares of a heavy curl end 0.2 l away."""
    scene = load("curl_4_3")
    places = curve(scene.replace({"strip.natural_curvature": 5.0}), S)
    fit = identify(scene.replace({"strip.natural_curvature": 0.0}), Points(places), ["strip.natural_curvature"])
    assert fit.grade == "good"
    assert fit.keys[0].value == pytest.approx(5.0, rel=1e-6)
