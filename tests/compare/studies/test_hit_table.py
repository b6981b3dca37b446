"""The hit table: the same scenes wherever it runs, and what a choice is called."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models.scope import require_shell
from tests.validation.workbench.drawn import drawn
from tests.validation.workbench.hit_cases import GROUPS, cases
from tests.validation.workbench.hit_solve import ELEMENTS, lengths
from tests.validation.workbench.hit_table import BOLD, CAUTIOUS, SAME, cheapest, verdict

FAR, NEAR = 0.03, 0.004


def test_forty_scenes_are_the_same_every_time():
    first, again = drawn(), drawn()
    assert len(first) == 40
    assert [(name, scene.canonical()) for name, scene in first] == [(name, scene.canonical()) for name, scene in again]
    name, scene = first[0]
    assert (name, scene.width, scene.strip.thickness) == ("edge_01", 0.0752, 0.000592)
    assert (scene.strip.poisson, scene.curvature[0], scene.gamma) == (0.321, 3.79, 811.0)


def test_drawn_scenes_are_within_their_ranges():
    for _, scene in drawn():
        (ratio,) = require_shell(scene)
        assert 0.019 < scene.width < 0.301
        assert 19.5 < ratio < 402.0
        assert 0.0 <= scene.strip.poisson <= 0.45
        assert abs(scene.curvature[0]) <= 15.0
        assert scene.gamma <= 1000.0
        assert abs(scene.frame[2, 2]) <= np.sin(np.radians(60.01)) or scene.end_frame is not None


def test_cases_have_names_of_their_own_and_one_thickness():
    found = cases()
    assert [sum(case.group == group for case in found) for group in GROUPS] == [18, 18, 44, 40]
    assert len({case.name for case in found}) == 120
    assert all(require_shell(case.scene) == (case.scene.width / case.scene.thickness,) for case in found)


def test_elements_are_shorter_at_every_held_end():
    by_name = {case.name: case.scene for case in cases()}
    one = np.array(lengths(by_name["7_3_edge_w0.1_g100"], ELEMENTS))
    two = np.array(lengths(by_name["arch_01"], ELEMENTS))
    for found in (one, two):
        assert found.size == ELEMENTS
        assert found.sum() == pytest.approx(1.0, abs=1e-12)
    assert one[0] == pytest.approx(2.5 * 0.1 / ELEMENTS, rel=0.05)
    assert one[-1] > 2.0 * one[0]
    assert two == pytest.approx(two[::-1])
    assert two[ELEMENTS // 2] > 2.0 * two[0]


@pytest.mark.parametrize(
    ("chosen", "distances", "said"),
    [
        ("sadowsky", {"sadowsky": NEAR, "wunderlich": NEAR, "finite": NEAR}, SAME),
        ("finite", {"sadowsky": FAR, "wunderlich": NEAR, "finite": NEAR}, CAUTIOUS),
        ("shell", {"sadowsky": FAR, "wunderlich": FAR, "finite": NEAR}, CAUTIOUS),
        ("shell", {"sadowsky": FAR, "wunderlich": FAR, "finite": FAR}, SAME),
        ("wunderlich", {"sadowsky": FAR, "wunderlich": FAR, "finite": NEAR}, BOLD),
        ("finite", {"sadowsky": FAR, "wunderlich": NEAR, "finite": FAR}, BOLD),
        ("finite", {"sadowsky": FAR, "wunderlich": FAR, "finite": None}, BOLD),
        ("elastica", {"elastica": NEAR, "sadowsky": NEAR}, SAME),
    ],
)  # fmt: skip
def test_what_a_choice_is_called(chosen, distances, said):
    assert verdict(chosen, distances, 1e-2) == said


def test_cheapest_passes_over_models_without_a_state():
    assert cheapest({"elastica": None, "sadowsky": None, "wunderlich": NEAR}, 1e-2) == "wunderlich"
    assert cheapest({"extensible": NEAR}, 1e-2) == "shell"
