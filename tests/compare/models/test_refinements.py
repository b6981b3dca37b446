"""What finer segments say: a state that is stable on few segments only is not stable; an unknown error has a reason."""

from __future__ import annotations

from dataclasses import replace

import pytest

from compare.measure.grades import GOOD, UNKNOWN
from compare.measure.limit import Limit
from compare.models.base import Options, Status
from compare.models.ribbon.model import RibbonModel
from compare.models.ribbon.refinement import _with_limit
from compare.pages.result import state_result
from compare.scene.scene import load, loads
from compare.studies.checks import elements, stability

TAPE = """
[strip]
length = 1.0
width = 0.019
thickness = 1e-4
poisson = 0.3
young = 2.1e11
density = 7850.0
natural_curvature = 2.0

[gravity]
up = [0.0, 0.0, 1.0]

[clamp.start]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]

[clamp.end]
position = [0.95, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""
COARSE = "[model]\nelements = 20\n"
NATURAL = "[seed]\ncurvature = 2.0\n"  # its natural shape, which is then the only start


@pytest.fixture(scope="module")
def curl():
    return RibbonModel().solve(load("curl_4_3").replace({"model.elements": 20}), options=Options(error=True))


def solved(text: str, **options):
    scene = loads(text).replace({"model.energy": "wunderlich"})
    return scene, RibbonModel().solve(scene, options=Options(**{"error": True, "leave_saddle": False, **options}))


def test_a_saddle_that_coarse_segments_hide_is_one():
    scene, found = solved(TAPE + COARSE + NATURAL)
    first, last = found.refinements[0], found.refinements[-1]
    assert (first.elements, first.status) == (20, "converged")
    assert first.lowest_eigenvalue > 0.0
    assert last.elements in (40, 80, 160)
    assert last.status == "saddle"
    assert last.lowest_eigenvalue < 0.0
    met = next(one for one in found.refinements if one.status == "saddle")
    assert 0.0 < met.distance < 0.1
    assert found.status is Status.UNSTABLE
    assert found.stable is False
    assert found.lowest_eigenvalue == last.lowest_eigenvalue
    assert found.error is None
    assert found.error_why
    result = state_result(scene, found)
    assert (result["status"], result["stable"]) == ("saddle", False)
    assert [one["elements"] for one in result["refinements"]] == [one.elements for one in found.refinements]
    assert result["model"]["elements"] == last.elements
    assert result["end"]["position"] == pytest.approx([0.95, 0.0, 0.0], abs=1e-8)


@pytest.mark.parametrize(("apart", "limit"), [("0.95", -0.1002), ("0.9", -0.0967), ("0.6", -0.0961)])
@pytest.mark.parametrize("elements", [COARSE, ""])
def test_the_eigenvalue_of_the_limit_is_estimated_whatever_the_segments(apart, limit, elements):
    """On 320 equal segments -0.0994, -0.0959, -0.0923, falling; on 20 all of them are above 0.3."""
    scene, found = solved(TAPE.replace("0.95", apart) + elements + NATURAL)
    told = found.numbers["eigenvalue_limit"]
    assert told["value"] < -told["error"] < 0.0
    assert abs(told["value"] - limit) <= 1.5 * told["error"]
    assert found.stable is False
    assert state_result(scene, found)["lowest_eigenvalue_limit"] == told


def test_a_stable_strip_is_stable_in_the_limit():
    """What the numbers of 20, 40 and 80 segments of a curl tend to, beside those of 80, 160 and 320."""
    curl = load("curl_4_3")
    found, fine = (
        RibbonModel().solve(curl.replace({"model.elements": count}), options=Options(error=True)) for count in (20, 80)
    )
    told = found.numbers["eigenvalue_limit"]
    assert found.stable is True
    assert told["value"] > told["error"]
    assert abs(told["value"] - fine.numbers["eigenvalue_limit"]["value"]) <= 2.0 * told["error"] + 1e-6


def test_leaving_it_ends_in_a_state_that_is_stable_on_finer_segments_too():
    _, found = solved(TAPE + COARSE + NATURAL, leave_saddle=True)
    assert found.status is Status.CONVERGED
    assert found.refinements[-1].status == "converged"
    assert found.refinements[-1].elements >= 80
    assert "saddle" in [one.status for one in found.refinements]


def test_placed_segments_tell_their_refinements():
    _, found = solved(TAPE)
    assert found.refinements[0].elements == 24
    assert found.refinements[-1].elements == found.native.problem.lengths.size
    assert found.refinements[-1].status == found.word
    if found.ok:
        assert found.error == found.refinements[-1].distance <= 1e-3


def test_a_budget_that_is_spent_ends_without_a_place():
    scene, found = solved(TAPE + "[model]\nbudget = 1e-9\n")
    assert found.status is Status.NOT_CONVERGED
    result = state_result(scene, found)
    assert result["status"] == "not_converged"
    assert result["end"] is result["middle"] is None
    assert result["forces"] == {"start": None, "end": None, "walls": []}
    _, found = solved(TAPE.split("[clamp.end]")[0].replace("= 2.0", "= 0.0") + COARSE + "budget = 30.0\n")
    assert found.status is Status.CONVERGED
    assert found.error is not None


def test_a_tolerance_that_is_only_the_default_ends_with_what_was_reached(monkeypatch):
    """Asked for and not reached it is "not converged"; of the default the finest state stands, with its error."""
    from ribbon.find import adaptive

    monkeypatch.setattr(adaptive, "MOST_WISHED", 60)
    monkeypatch.setattr(adaptive, "MOST_SEGMENTS", 60)
    twisted = TAPE.replace("0.95", "0.8").replace("normal = [0.0, 0.0, 1.0]\n", "normal = [0.0, -1.0, 0.0]\n")
    twisted = twisted.replace("normal = [0.0, -1.0, 0.0]", "normal = [0.0, 0.0, 1.0]", 1)
    _, found = solved(twisted)
    assert found.status in (Status.CONVERGED, Status.UNSTABLE)
    assert found.native.tolerance_error > 1e-3
    assert found.native.problem.lengths.size <= 2 * 60
    assert found.refinements[-1].distance == found.native.tolerance_error
    _, requested = solved(twisted + "[model]\ntolerance = 1e-3\n")
    assert requested.status is Status.NOT_CONVERGED


def test_ends_held_a_length_apart_are_straight_on_any_segments():
    for model in ("", COARSE):
        _, found = solved(TAPE.replace("0.95", "1.0").replace("curvature = 2.0", "curvature = 0.0") + model)
        assert found.status is Status.CONVERGED
        assert found.error == 0.0
        assert found.iterations == 0


@pytest.mark.parametrize(
    ("value", "error", "stable"),
    [(-1.2e-7, 1.2e-6, None), (3e-10, 2e-9, True), (2e-5, 1e-5, True), (1e-3, 2e-3, None)],
)
def test_a_limit_whose_sign_is_open_leaves_stability_open(curl, value, error, stable):
    """A zero to rounding, error and all, is one that nothing resists (docs/theory.md, 4.5), and stays as it was."""
    told = _with_limit(curl, Limit(value, error, 2.0))
    assert told.stable is stable
    assert (stability(told).grade == UNKNOWN) == (stable is None)


def test_an_error_beyond_which_finer_segments_have_no_state_is_not_known(curl):
    assert elements(curl).grade == GOOD
    broken = replace(curl, refinements=(*curl.refinements[:-1], replace(curl.refinements[-1], status="not_converged")))
    assert elements(broken).grade == UNKNOWN
