"""From folds and branch points of 7.2 to hystereses (`tests.validation.workbench.shift_diagram`)."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.energies.finite import density
from tests.validation.workbench.shift_branches import CASES, CROSSED
from tests.validation.workbench.shift_diagram import SINGULAR, Diagram, Place, Shot, ends, goes_back, thin, width
from tests.validation.workbench.shift_finite import soft
from tests.validation.workbench.shift_followed import rippled
from tests.validation.workbench.shift_told import open_ones


def place(*values: float) -> Place:
    return Place.of({"values": values, "height": 0.25}, 1e-9)


LOST, FLAT = place(0.38, 0.38, 0.38), place(0.45, 0.45, 0.45)


def test_two_folds_are_one_hysteresis_with_the_limit_of_its_width():
    """0.1 + h^2 on h = 0.1, 0.05, 0.025: 0.1."""
    up, down = (place(*(a + b * h * h for h in (0.1, 0.05, 0.025))) for a, b in ((0.4, 2.0), (0.3, 1.0)))
    (loop,) = Diagram(LOST, None, (up, down), FLAT, (), 0).loops()
    assert loop == (up, down)
    assert width(loop, 0.0).value == pytest.approx(0.1, abs=1e-9)
    assert width(loop, 0.0).order == pytest.approx(2.0, abs=1e-6)


def test_without_folds_there_is_none_and_one_fold_pairs_with_the_branch_point_beside_it():
    assert Diagram(LOST, None, (), FLAT, (), 0).loops() == []
    back = place(0.37, 0.37, 0.37)
    assert Diagram(LOST, None, (back,), FLAT, (), 0).loops() == [(LOST, back)]
    out = place(0.46, 0.46, 0.46)
    assert Diagram(LOST, None, (out,), FLAT, (), 0).loops() == [(out, FLAT)]


def test_neighbouring_folds_nearer_than_a_ripple_are_not_counted():
    folds = [(0, 0.3851), (2, 0.3848), (3, 0.4004), (5, 0.3529)]
    assert rippled(folds) == {0, 2}
    assert rippled(folds[2:]) == set()
    assert rippled(folds, 0.3842) == {0, 2}
    assert rippled([(4, 0.3845), *folds[2:]], 0.3842) == {4}


def test_a_branch_that_leaves_to_the_unstable_side_is_told():
    line = {"shift": [0.381, 0.36, 0.3], "height": [0.3, 0.28, 0.2]}
    assert goes_back(0.38, line) == pytest.approx(0.02)
    assert goes_back(0.38, {**line, "shift": [0.381, 0.39, 0.3]}) == 0.0
    later = {"shift": [0.381, 0.39, 0.42, 0.36], "height": [0.3, 0.28, 0.26, 0.28]}
    assert goes_back(0.38, later) == 0.0


def test_u_is_stable_again_only_where_its_last_unstable_mode_goes():
    """With a fold forth and one back amid its unstable part; one that is stable again at once; one that never is."""
    changes = [{"change": change} for change in (1, 1, 1, -1, -1, -1)]
    assert ends(changes) == (0, 5)
    assert ends(changes[:1] + changes[-1:]) == (0, 1)
    assert ends(changes[:5]) == (0, None)
    assert ends([]) == (None, None)


def test_where_the_curvature_of_finite_crosses_one_over_zeta_nothing_resists_its_slope():
    """The second derivative of (10.13) by k' is zero there, to either side it is not; it is 12 of the density's."""
    width = 1.0 / CROSSED.narrow
    section = 0.5 * width, width / CROSSED.ratio, 0.3, 0.0
    stiff = []
    for share in (0.9, 1.0, 1.1):
        out = np.empty(15)
        density(-share * soft(CROSSED), -1.2, -480.0, -250.0, 0.0, 0.0, section, out)
        stiff.append(out[12])
    assert abs(stiff[1]) < 1e-9 * min(stiff[0], stiff[2])


def test_a_fold_before_the_shells_fork_is_a_pair_with_it():
    """US that leaves to the unstable side: the pair further along is told, and not one across the two."""
    one = {"lost": 0.377, "folds": [[0.363, 0.31], [0.368, 0.31], [0.367, 0.31], [0.394, 0.25], [0.373, 0.24]],
           "lines": []}  # fmt: skip
    two = {"lost": 0.364, "folds": [[0.393, 0.25], [0.373, 0.24]], "lines": []}
    shell = thin([(90, 9), (135, 13)], [one, two], [{"lost": 0.47, "lines": []}] * 2)
    assert shell.ends == ((0.394, 0.393), (0.373, 0.373))


def shot(error: float) -> Shot:
    """A ribbon without elements, U stable again at 0.55 by a search that ends within `error`."""
    one = {"value": 0.38, "error": 1e-6}
    us = {"lost": one, "flat": {"value": 0.45, "error": 1e-6}, "folds": [], "integral": 1e-7}
    return Shot.of(us, {"forks": [{"value": 0.38001, "error": 1e-9}, {"value": 0.55, "error": error}], "folds": []})


def test_what_only_shooting_knows_is_told_as_not_settled():
    """U lost leaps from mesh to mesh, U stable again is missing on the finest; S settles."""
    leaps, missing = place(0.413, 0.414, 0.4131), Place.of({"values": (0.571, 0.570), "height": 0.2}, 1e-9)
    lines = {CASES[0]: Diagram(leaps, missing, (), FLAT, (), 0)}
    told = open_ones(lines, {}, {CASES[0].narrow: shot(1e-9)})
    assert told == [f"wunderlich, w/l = 1/40: {what} (by shooting only)" for what in ("U lost", "U stable again")]
    assert open_ones(lines, {}, {}) == ["wunderlich, w/l = 1/40: U lost", "wunderlich, w/l = 1/40: U stable again"]


def test_the_floor_of_a_search_where_its_equations_are_singular_is_told_apart_from_its_steps():
    near, far = shot(3e-6), shot(6e-5)
    assert (near.again[1], near.bare) == (SINGULAR, 3e-6)
    assert (far.again[1], far.bare) == (6e-5, 6e-5)
    assert near.searched == (0.38001, SINGULAR)
