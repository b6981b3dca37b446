"""Numbers that stood on pages of results alone, computed again here: fewer cases, smaller sizes, the stated errors."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from compare.models.ribbon.build import ribbon_clamp
from compare.scene.scene import load
from compare.studies.limits import Thresholds, quick
from compare.studies.limits import with_clamp as held_by
from ribbon import Gravity, Strip
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.thesis.descent import Limits, ipopt_exact
from tests.validation.ribbon import rod_ribbon, shooting, tape
from tests.validation.workbench import limits

ROOT = Path(__file__).resolve().parents[1]


def rows(file: str) -> list[dict[str, str]]:
    return list(csv.DictReader((ROOT / "results" / file).read_text().splitlines()))


@pytest.mark.parametrize(("sign", "energy"), [(1, -934.9929), (-1, -990.6318)])
def test_the_exact_hessian_of_table_3_1(sign, energy):
    """Thesis, table 3.1 (results/minimisers.md): its strip in some tens of steps, as many Hessians as steps."""
    strip = Strip.from_material(0.5, 0.005, 1e-4, 1.8e9, 2000.0, 0.5, sign * 80.0)
    problem = ChainedProblem(
        strip, ribbon_clamp(load("coil_10_100")), Gravity((1.0, 0.0, 0.0)), "wunderlich", segment_lengths(20)
    )
    found = ipopt_exact(problem, problem.natural_state(), Limits(tolerance=1e-6, steps=1000, seconds=60.0))
    assert found.finished
    assert found.value == pytest.approx(energy, abs=6e-5)
    assert found.iterations <= 60
    assert found.evaluations["hessian"] == found.iterations


@pytest.mark.parametrize("sign", [1, -1])
def test_classical_shooting_arrives_where_the_ribbon_is(sign):
    """Thesis, 4.2 (results/shooting.md): the lightest coil from the clamp and from the free end, 3e-10 l from 320
    segments; 80 are there to 1e-7."""
    scene = load("coil_10_100")
    strip = shooting.ribbon(scene, sign, 10, 80)
    end = strip.end.position - strip.problem.clamp.position
    for shot in shooting.shots(shooting.strong(scene, sign)):
        assert shot.converged
        assert np.linalg.norm(shot.solution().tip() - end) < 1e-7


@pytest.mark.parametrize(("length", "least", "most"), [(0.25, 0.0, 1e-9), (0.29, 0.0, 1e-9), (0.35, 6.75e-2, 6.85e-2)])
def test_rod_and_ribbon_are_one_curl_up_to_29_cm(length, least, most):
    """Thesis, 4.4 (results/rod_ribbon): planar and the same to 2.4e-11 l at most up to 29 cm, 6.8e-2 l apart at 35."""
    rod, ribbon = (rod_ribbon.by_length(length, label) for label in ("rod", "wunderlich"))
    assert least <= rod_ribbon.distance(rod, ribbon) < most


def _same_as_on_the_page(row: dict[str, str]) -> None:
    """A row of results/limits/grid.csv: the quick check of its scene gives its level and its distance."""
    scene = held_by(load("limits_7_3"), row["clamp"])
    scene = scene.replace({"strip.width": float(row["strip.width"]), "strip.gamma": float(row["strip.gamma"])})
    (found,) = quick(scene, Thresholds())
    assert found.estimate.distance == pytest.approx(float(row["estimate.distance"]), rel=1e-3), row
    assert found.estimated_level == row["estimate.level"], row
    # what the page counts as hits is what a user is told, bounds and all
    assert limits.again(found, Thresholds()).estimated_level == found.estimated_level, row


#: A width for each weight and clamp: every width, weight and clamp of 7.3 once.
ONE_EACH = {
    ("edge", 10): 0.03, ("edge", 100): 0.1, ("edge", 1000): 0.2,
    ("corners", 10): 0.5, ("corners", 100): 0.05, ("corners", 1000): 0.3,
}  # fmt: skip


@pytest.mark.parametrize(("clamp", "gamma"), list(ONE_EACH))
def test_the_quick_check_of_a_row_of_7_3(clamp, gamma):
    """Thesis, 7.3 (results/limits): level and estimated distance from the ribbon alone."""
    width = ONE_EACH[clamp, gamma]
    (row,) = (
        row
        for row in rows("limits/grid.csv")
        if (row["clamp"], float(row["strip.gamma"]), float(row["strip.width"])) == (clamp, gamma, width)
    )
    _same_as_on_the_page(row)


@pytest.mark.validate
@pytest.mark.parametrize("gamma", [10, 100, 1000])
@pytest.mark.parametrize("clamp", ["edge", "corners"])
def test_the_quick_check_of_every_row_of_7_3(clamp, gamma):
    """The same for all widths."""
    of_both = [row for row in rows("limits/grid.csv") if (row["clamp"], float(row["strip.gamma"])) == (clamp, gamma)]
    assert len(of_both) == 6
    for row in of_both:
        _same_as_on_the_page(row)


@pytest.mark.parametrize(
    ("test", "plain", "enriched"), [("opposite", 0.1763, -0.0150), ("cantilever", 0.0524, -0.1116)]
)
def test_statements_b_and_c_on_tape_springs(test, plain, enriched):
    """Martin et al., 4.1 (b) and 4.2 (c), against the shell (results/tape): in the greatest load the enriched section
    is the nearer one where both ends turn, the plain one where an end is moved. 100 elements: to half a percent."""
    _, shell = tape.top_of([row for row in tape.shell_rows(test) if np.isfinite(row[0])])
    off = {terms: tape.upward(test, terms, False, 100)[0] / shell - 1.0 for terms in (1, 3)}
    assert off[1] == pytest.approx(plain, abs=1e-2)
    assert off[3] == pytest.approx(enriched, abs=1e-2)
    assert (abs(off[3]) < abs(off[1])) == (test == "opposite")


@pytest.mark.shell
def test_the_tape_shells_error_of_its_mesh():
    """results/tape_shell: the moment at 0.05 rad in opposite sense, on the page's 50 x 4 elements of a quarter; half as
    many are near it, and a quarter as many are not, so that what is printed is not the mesh's."""
    pytest.importorskip("dolfinx")
    from tests.validation.shell import tape_parts as parts

    up = [row for row in rows("tape_shell/opposite.csv") if row["leg"] == "up"]
    angle, moment = (np.array([float(row[key]) for row in up]) for key in ("rotation_rad", "moment_N_mm"))
    page = float(np.interp(0.05, angle, moment))
    found = {}
    for along, across in ((12, 1), (25, 2), (50, 4)):
        path = parts.Path(parts.Case("opposite", along, across))
        state, stress = path.model.reference, None
        for share in (0.05, 0.1):  # of 0.5 rad
            attempt = path.equilibrium.solve(state, stress, path.stage, share)
            assert attempt.converged
            state, stress = attempt.state, attempt.stress
        found[along] = path.observe(state)["load"]
    assert found[50] == pytest.approx(page, rel=3e-3)
    errors = [abs(found[along] / found[50] - 1.0) for along in (12, 25)]
    assert errors[1] < 2e-2
    assert errors[1] < 0.5 * errors[0]
