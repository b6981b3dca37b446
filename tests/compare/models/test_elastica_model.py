"""The elastica as a third opinion: scenes with two clamps in a plane, what breaks planarity, where it begins."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from compare.battery.cases.branches.scenes import clamps
from compare.models import model
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.elastica import start as elastica_start
from compare.models.elastica.start import angle_of, elastica_problem, out_of_plane, seed_side, seed_turn
from compare.models.ribbon.state import RibbonShape
from compare.pages.result import comparison_result
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import _beside as beside
from compare.studies.compare import compare
from compare.studies.effects import explain
from ribbonbench.errors import BadInput
from shellref.elastica.solve import ElasticaProblem
from shellref.elastica.start import natural_start, solve_along, solve_near
from tests.compare.scene.scene_texts import PLANAR, fault, text

END = {
    "clamp.end.position": "[0.0, 0.0, 0.5]",
    "clamp.end.tangent": "[0.0, 0.0, 1.0]",
    "clamp.end.normal": "[1.0, 0.0, 0.0]",
}
TWO = ["two_clamps_5_3_2", "two_clamps_5_3_2_level", "start_5_3_3_4"]


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(np.asarray(a) - b) / np.linalg.norm(b))


@pytest.mark.parametrize("name", TWO)
def test_beside_the_ribbon_between_two_clamps(name):
    """Shape, energy, forces and couples on both ends; the elastica's own error is far below the difference allowed."""
    scene = load(name)
    ribbon = solve_scene(scene, "ribbon").native
    run = solve_scene(scene, "elastica", near=RibbonShape(ribbon), options=Options(error=True))
    r = run.native
    assert (r.status.value, run.start) == ("converged", "ribbon")
    s = np.linspace(0.0, 1.0, 51)
    assert np.linalg.norm(run.shape.centreline(s) - ribbon.position(s), axis=1).max() < 3e-5
    assert r.error is not None
    assert r.error < 1e-7
    assert r.energy.total == pytest.approx(ribbon.energy.total, abs=5e-4)
    assert ribbon.end_support is not None
    mine = run.supports
    for own, theirs in ((mine.end, ribbon.end_support), (mine.start, ribbon.start)):
        assert relative(own.force, theirs.force) < 5e-4
        assert relative(own.moment, theirs.moment) < 5e-4
    assert run.shape.frames(np.array([1.0]))[0] == pytest.approx(scene.end_frame, abs=1e-9)


def test_alone_it_finds_the_same_from_the_seed():
    scene = load("two_clamps_5_3_2")
    alone = solve_scene(scene, "elastica", options=Options(error=True))
    assert (alone.native.status.value, alone.start) == ("converged", "seed")
    assert alone.native.energy.total == pytest.approx(2.26901227, abs=1e-6)


def test_along_a_path():
    """The stage changes where the end is; the way there does not change where it ends."""
    keys = {"model.energy": "elastica", "seed.curvature": [2.0, 2.0]}
    scene = load("start_5_3_3_4").replace(keys)
    straight = solve_scene(scene, "elastica", options=Options(error=True))
    by_path = solve_scene(scene.replace({"path": [{"strip.gamma": 1.0}]}), "elastica", options=Options(error=True))
    assert by_path.start == "path"
    assert by_path.native.status.value == straight.native.status.value == "converged"
    assert by_path.native.energy.total == pytest.approx(straight.native.energy.total, abs=1e-8)


def test_a_path_that_lets_go_is_refused():
    scene = load("start_5_3_3_4").replace({"model.energy": "elastica", "path": [{"clamp.end": False}]})
    with pytest.raises(BadInput, match="hold the strip alike") as caught:
        solve_scene(scene, "elastica", options=Options(error=True))
    assert caught.value.key == "path"


def test_whole_turns_come_from_the_seed():
    scene = loads(text(PLANAR, END, {"seed.curvature": "6.0"}))
    assert seed_turn(scene) == pytest.approx(6.0)
    assert elastica_problem(scene).end_angle == pytest.approx(2.0 * math.pi)
    assert elastica_problem(scene, 0.1).end_angle == pytest.approx(0.0, abs=1e-12)
    assert elastica_problem(scene).end == pytest.approx((0.5, 0.0), abs=1e-12)


@pytest.mark.parametrize(("segments", "within"), [(20, 4e-5), (40, 7e-6)])  # measured: 1.9e-5, 3.5e-6
def test_the_ribbon_s_angle(segments, within):
    scene = load("cantilever").replace({"model.elements": segments})
    ribbon = solve_scene(scene, "ribbon").native
    s = np.linspace(0.0, 1.0, 101)
    theta = angle_of(scene, RibbonShape(ribbon), s)
    assert theta.shape == (101,)
    assert theta == pytest.approx(
        solve_scene(scene, "elastica", options=Options(error=True)).native.angle(s), abs=within
    )
    assert out_of_plane(scene, RibbonShape(ribbon), s) < 1e-9


def test_a_ribbon_out_of_the_plane_is_no_start():
    """0.4 m of the curl is planar by its scene, and its ribbon leaves the plane (results/curl_length.md)."""
    scene = load("curl_4_4_long")
    ribbon = solve_scene(scene, "ribbon").native
    assert out_of_plane(scene, RibbonShape(ribbon), np.linspace(0.0, 1.0, 101)) > 0.1
    assert solve_scene(scene, "elastica", near=RibbonShape(ribbon), options=Options(error=True)).start == "natural"


BREAKS = [
    ({"clamp.end.position": "[0.0, 0.25, 0.5]"}, "clamp.end.position stands -0.25 l out of the plane"),
    ({"clamp.end.tangent": "[0.0, 0.6, 0.8]"}, "clamp.end.tangent has the component -0.6 along t_x"),
    ({"clamp.end.normal": "[0.8, 0.6, 0.0]"}, "clamp.end.normal has the component -0.6 along t_x"),
    ({"clamp.end.normal": "[-1.0, 0.0, 0.0]"}, "half a turn of twist"),
    ({"gravity.up": "[0.8, 0.6, 0.0]"}, "gravity.up has the component -0.6 along t_x"),
    ({"clamp.end.position": "[0.0, 0.0, 1.0]"}, "stand 1 l apart"),
]


@pytest.mark.parametrize(("change", "words"), BREAKS)
def test_what_breaks_planarity_is_named(change, words):
    assert loads(text(PLANAR, END)).nonplanar_reason() is None
    assert words in str(loads(text(PLANAR, END, change)).nonplanar_reason())
    error = fault(text(PLANAR, END, change, {"model.energy": '"elastica"'}))
    assert (error.key, words in error.problem) == ("model.energy", True)


def test_a_pinned_or_a_sliding_end_is_planar():
    pinned = loads(text(PLANAR, END, {"clamp.end.tangent": None, "clamp.end.normal": None}))
    assert elastica_problem(pinned).end_angle is None
    turned = loads(text(PLANAR, END, {"clamp.end.position": None}))
    assert elastica_problem(turned).end is None
    assert elastica_problem(turned).end_angle is not None
    ends = [
        solve_scene(scene.replace({"strip.gamma": 5.0}), "elastica", options=Options(error=True)).native
        for scene in (pinned, turned)
    ]
    assert ends[0].end == pytest.approx((0.5, 0.0), abs=1e-9)
    assert ends[0].forces.end_moment == 0.0
    assert ends[1].forces.end == pytest.approx((0.0, 0.0), abs=1e-9)


def test_compare_goes_on_where_the_elastica_cannot_go_the_path():
    """A scene that ends in a plane and came there by a turn of its clamp has an elastica only beside a planar shape:
    without one it is left out of `compare`, which said so with an error after the ribbon's solve."""
    turned = {"clamp.end.normal": [0.0, 1.0, 0.0]}
    straight = loads(text(PLANAR, END, {"strip.gamma": "0.0", "strip.natural_curvature": "0.0"}))
    assert "t_x" in str(straight.replace(turned).nonplanar_reason())
    scene = straight.replace({"path": [turned]})
    ribbon = solve_scene(straight, "ribbon")
    elastica = model("elastica")
    said = []
    reporter = Reporter(quiet=True)
    reporter.aside = said.append
    assert beside(elastica, scene, replace(ribbon, shape=None), reporter) is None
    assert len(said) == 1
    assert beside(elastica, scene, ribbon, reporter).ok


def test_explain_says_that_there_is_a_third_opinion_and_where_it_begins():
    assert "begun at the natural shape" in explain(load("cantilever")).third_opinion
    assert "begun at the ribbon's shape" in explain(load("two_clamps_5_3_2")).third_opinion
    assert "clamp.end.position stands 0.2 l" in explain(load("arc_5_1")).third_opinion


def test_solve_near_and_along():
    problem = ElasticaProblem(gamma=3.0, end=(0.7, 0.0), end_angle=0.0)
    first = natural_start(problem, (2.0, -2.0))
    assert first.end_angle == pytest.approx(0.0, abs=1e-15)
    assert first.gamma == 0.0
    result = solve_along([first, problem])
    assert result.status.value == "converged"
    again = solve_near(problem, result.nodes, result.theta)
    assert again is not None
    assert again.energy.total == pytest.approx(result.energy.total, abs=1e-10)
    assert again.error is not None
    assert again.error < 1e-8
    with pytest.raises(ValueError, match="two or more"):
        solve_along([problem])
    with pytest.raises(ValueError, match="cannot change how"):
        solve_along([ElasticaProblem(gamma=3.0), problem])
    far = np.linspace(0.0, 1.0, 9)
    wild = solve_near(problem, far, 400.0 * np.sin(40.0 * far))
    assert wild is None or (wild.end == pytest.approx((0.7, 0.0), abs=1e-9) and wild.residual < 1e-6)


@pytest.mark.shell
def test_compare_writes_the_elastica_with_the_forces_of_both_ends(tmp_path):
    pytest.importorskip("dolfinx")
    keys = {"shell.width_to_thickness": 10.0, "shell.elements": [8, 1], "model.elements": 8}
    scene = load("start_5_3_3_4").replace(keys)
    found = compare(scene, CaseStore(tmp_path), Reporter(quiet=True))
    elastica = comparison_result(found)["elastica"]
    assert (elastica["status"], elastica["start"]) == ("converged", "ribbon")
    assert elastica["ribbon_centreline"] < 1e-4
    assert relative(elastica["forces"]["end"], found.fast.native.end_support.force) < 5e-3  # type: ignore[union-attr]
    assert found.rows[0].elastica is not None
    assert json.dumps({key: np.asarray(value).tolist() for key, value in elastica["moments"].items()})


@pytest.mark.parametrize("nearly", [0.0, 1e-13, -1e-13, 1e-9, -1e-9])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_seed_without_a_linear_part_keeps_its_side(nearly, side):
    """[6, -12, 6] has no mean curvature and no slope: the strip is bent to the side on which it lies of its chord, and
    not to one that the last digit chooses."""
    seed = [side * 6.0, side * -12.0, side * 6.0 * (1.0 + nearly)]
    assert seed_side(np.array(seed)) == -side
    began = _alone_begins(seed)
    assert began == pytest.approx((-2.0 * side, -2.0 * side))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("seed", [[3.0, -3.0, 3.0], [6.0, -2.0, -2.0, 6.0]])
def test_alone_it_lies_on_the_side_of_its_seed_as_a_ribbon_does(seed, side):
    """Their linear parts bend to the other side than they lie on."""
    keys = {"clamp.end.position": [0.8, 0.0, 0.0], "clamp.end.tangent": [1.0, 0.0, 0.0]}
    keys |= {"clamp.end.normal": [0.0, 0.0, 1.0], "seed.curvature": [side * value for value in seed]}
    scene = loads(clamps(elements=None)).replace(keys)
    alone, ribbon = (solve_scene(scene.replace({"model.energy": energy})) for energy in ("elastica", "sadowsky"))
    assert alone.word == ribbon.word == "converged"
    assert alone.middle.position[2] == pytest.approx(ribbon.middle.position[2], abs=1e-3)
    assert alone.middle.position[2] * side < -0.2


def test_a_seed_in_s_has_no_side():
    """Its sign is a convention, the same whatever the last digit is."""
    for nearly in (0.0, 1e-13, -1e-13):
        assert seed_side(np.array([3.0, -6.0 * (1.0 + nearly), 0.0, 6.0, -3.0])) == 1.0
    assert seed_side(np.zeros(2)) == 1.0


def _alone_begins(seed: list[float]) -> tuple[float, float]:
    """Natural curvature (2,) with which the way of an elastica between level clamps begins."""
    scene = loads(text(PLANAR, END, {"seed.curvature": str(seed)}))
    return elastica_start._beginning(scene, elastica_problem(scene, seed_turn(scene))).curvature
