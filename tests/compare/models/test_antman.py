"""The shearable rod as a model: thin limit, beside another shape, paths, what it exports, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.measure.grid import Grid
from compare.models import solve
from compare.models.base import BESIDE, Options, Size, Status, check_keys
from compare.pages.result import state_result
from compare.pages.rods import antman as page
from compare.scene.scene import load, loads
from ribbonbench.errors import BadInput

CURL = {"strip.gamma": 20.0, "model.energy": "antman"}
S = np.linspace(0.0, 1.0, 101)


def test_the_thin_limit_is_kirchhoffs_rod():
    """At h/w = 1/10 the tips are apart by O(h^2): shear and stretch. The other rod is that of curvature elements."""
    apart, energies = [], []
    for width in (1 / 10, 1 / 20, 1 / 40):
        section = {"strip.gamma": 20.0, "strip.width": width, "strip.thickness": width / 10.0}
        rod = solve(load("rod_4_5").replace({**section, "model.energy": "antman"}), size=Size("antman 3", (24,), 3))
        thin = solve(load("rod_4_5").replace({**section, "model.elements": 60}))
        assert rod.ok
        assert thin.ok
        apart.append(float(np.linalg.norm(rod.end.position - thin.end.position)))
        energies.append(rod.energy.total - thin.energy.total)
    assert np.log2(np.array(apart[:-1]) / apart[1:]) == pytest.approx([2.0, 2.0], abs=0.15)
    assert np.log2(np.abs(np.array(energies[:-1]) / energies[1:])) == pytest.approx([2.0, 2.0], abs=0.15)


def test_beside_another_models_shape():
    scene = load("rod_4_5").replace(CURL)
    thin = solve(load("rod_4_5").replace({"strip.gamma": 20.0}))
    beside, alone = solve(scene, near=thin.shape), solve(scene)
    assert beside.start == BESIDE
    assert alone.start == "natural"
    assert beside.iterations < alone.iterations
    assert beside.shape.centreline(S) == pytest.approx(alone.shape.centreline(S), abs=1e-8)


def test_its_error_is_the_distance_to_finer_elements():
    scene = load("rod_4_5").replace(CURL)
    state = solve(scene, options=Options(error=True))
    finest = solve(scene, size=Size("antman 3", (60,), 3))
    real = np.linalg.norm(state.shape.centreline(S) - finest.shape.centreline(S), axis=1).max()
    assert 0.8 * real < state.error < 1.1 * real
    finer = registry.model("antman").refined(state)
    assert finer.ok
    assert finer.size.values == (40.0,)
    assert finer.energy.total == pytest.approx(finest.energy.total, abs=1e-3)


def test_what_is_exported_is_what_is_stored():
    """The energy's density over the surface, and positions across by t_x; supports carry the weight."""
    state = solve(load("rod_4_5").replace(CURL))
    x, weights = np.polynomial.legendre.leggauss(4)
    s = ((np.arange(20)[:, None] + 0.5 * (1.0 + x)) / 20).ravel()
    fields = state.shape.fields(s, np.array([-0.01, 0.01]))
    total = np.tile(weights / 40, 20) @ fields["energy_density"][:, 0]
    assert total == pytest.approx(state.energy.elastic, rel=1e-3)
    points = state.shape.points(s, np.array([-0.01, 0.01]))
    assert points.mean(axis=1) == pytest.approx(state.shape.centreline(s), abs=1e-14)
    assert np.linalg.norm(points[:, 1] - points[:, 0], axis=1) == pytest.approx(0.02)
    assert state.supports.start.force == pytest.approx([20.0, 0.0, 0.0], abs=1e-6)
    assert state.supports.end is None


def test_a_coarse_curl_is_found_on_halved_elements():
    """24 radians of natural curvature on 20 elements: Newton fails from there, and the descent does not."""
    scene = load("curl_4_4_long").replace({"model.energy": "antman", "strip.length": 0.35, "seed.curvature": None})
    state = solve(scene, size=Size("antman 2", (16,), 2), options=Options(leave_saddle=True))
    assert state.ok
    finer = registry.model("antman").refined(state)
    assert finer.ok
    assert np.linalg.norm(finer.end.position - state.end.position) < 0.02


def test_its_page(tmp_path):
    """rod.csv: the section's moment at the clamp is the clamp's; rows and sentences name loads and strains."""
    scene = load("bend_45")
    state = solve(scene)
    written = page.write(tmp_path, scene, state, Grid.for_shape(scene, state.shape.bend))
    assert {"rod.csv", "antman.vtu", "centreline.csv"} == set(written.files)
    assert [picture.file for picture in written.pictures] == ["antman.png"]
    along = np.genfromtxt(tmp_path / "rod.csv", delimiter=",", names=True)
    carried = [along[f"moment_{axis}"][0] for axis in "xyz"]
    assert scene.frame @ carried == pytest.approx(-state.supports.start.moment, abs=1e-2)
    end = [along[f"force_{axis}"][-1] for axis in "xyz"]
    assert state.end.frame @ end == pytest.approx(scene.tip_force, abs=2e-2)
    found = dict(page.rows(scene, state))
    assert found["force at the tip"].startswith("4.44132 0 0")
    result = state_result(scene, state)
    assert result["max_abs_shear"] == pytest.approx(1.2e-4, abs=1e-6)
    assert not result["flutter"]
    assert "1.2e-04" in page.sentences(scene, state)[1]


CLAMPED = """
[strip]
length = 1.0
width = 0.03
thickness = 0.003
poisson = 0.3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.8]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [-3.0, 3.0, 3.0, -3.0]
[model]
energy = "antman"
elements = 12
[[path]]
"clamp.end.position" = [0.0, 0.0, 0.95]
[[path]]
"clamp.end.position" = [0.0, 0.0, 0.9]
steps = 3
"""


def test_a_path_of_two_clamps_is_the_elasticas():
    """A bow between two clamps: the same branch as the planar elastica's, whose place is known to 1e-6."""
    scene = loads(CLAMPED, "clamped")
    state = solve(scene)
    assert state.status is Status.CONVERGED
    assert state.start == "path"
    assert state.end.position == pytest.approx([0.0, 0.0, 0.8], abs=1e-12)
    assert state.end.frame == pytest.approx(np.eye(3), abs=1e-12)
    assert state.supports.start.force == pytest.approx(-state.supports.end.force, abs=1e-6)
    elastica = solve(scene.replace({"model.energy": "elastica", "model.elements": None}))
    assert elastica.ok
    height = abs(state.middle.position[1])
    assert height == pytest.approx(abs(elastica.middle.position[1]), abs=3e-4)
    assert abs(state.supports.start.force[2]) == pytest.approx(abs(elastica.supports.start.force[2]), rel=3e-3)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"strip.thickness": None}, "strip.thickness"),
        ({"rod.twist": "quasi-static"}, "rod.twist"),
        ({"clamp.end": False, "clamp.start.tangent": None, "clamp.start.normal": None, "path": None}, "clamp.start"),
    ],
)
def test_what_it_cannot_do_is_refused_by_name(changes, key):
    scene = loads(CLAMPED, "clamped").replace(changes)
    with pytest.raises(BadInput) as caught:
        check_keys(registry.model("antman"), scene)
    assert caught.value.key == key


def test_walls_are_refused_by_name():
    with pytest.raises(BadInput, match="knows no contact"):
        check_keys(registry.model("antman"), load("roman_6_2"))


def test_its_ladders_are_for_scenes_that_ask_for_it():
    found = registry.model("antman")
    assert all(ladder.sizes for ladder in found.ladders(load("bend_45")))
    assert all(ladder.why for ladder in found.ladders(load("curl_4_3")))
    effects = {effect.key: effect for effect in found.effects(load("bend_45"))}
    assert [key for key, effect in effects.items() if effect.on and effect.changes] == [
        "shear", "stretch", "natural curvature in the plane", "force at the tip",
    ]  # fmt: skip
