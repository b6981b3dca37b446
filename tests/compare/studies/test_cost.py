"""What accuracy costs: front and interpolation on made-up marks, ladders of real runs, bad input, the command.

What is inside the clocks: test_cost_clock.py.
"""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from compare import registry
from compare.cli import main
from compare.measure.distance import grid_hausdorff
from compare.measure.front import Mark, front, reach
from compare.models import solve
from compare.models.scope import require_shell
from compare.page.csv import as_csv
from compare.page.page import read_page
from compare.pages import cost as cost_write
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare as compare_scene
from compare.studies.cost import available, measure
from compare.studies.cost_plan import Cost, Plan, Reference, Row, chosen, families
from compare.studies.cost_runs import CachedRun, Finest, Run
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import PLANAR, text
from tests.compare.studies.outside import SIZES, Apart, Arc, ArcShape, Coarse, registered

QUICK = Plan(
    solvers=("chained", "mixed", "elastica"), segments=(5, 10, 20), elastica_elements=(5, 10), reference="ribbon",
    repeats=2, budget=1e9,
)  # fmt: skip


# -- the front --------------------------------------------------------------------------------------------------------


def test_the_front_has_what_no_other_run_beats():
    marks = [Mark("a", 1.0, 1e-2), Mark("b", 2.0, 1e-3), Mark("slow", 3.0, 5e-3), Mark("c", 4.0, 1e-4),
             Mark("same", 5.0, 0.995e-4)]  # fmt: skip
    assert [m.label for m in front(marks[::-1])] == ["a", "b", "c"]
    assert front([]) == []


def test_times_are_interpolated_in_log_log_and_never_beyond():
    marks = [Mark(f"{n}", 0.01 * n, n**-2.0) for n in (5, 10, 20, 40)]  # error = (time / 0.01)^-2
    for target in (1e-2, 3e-3, 1e-3):
        found = reach(marks, target)
        assert found.seconds == pytest.approx(0.01 * target**-0.5, rel=1e-12)
        assert found.between[0].error >= target >= found.between[-1].error
        assert not found.bound
    beyond = reach(marks, 1e-4)
    assert beyond.seconds is None
    assert beyond.best.label == "40"
    easy = reach(marks, 0.5)
    assert (easy.seconds, easy.bound, easy.between[0].label) == (0.05, True, "5")
    assert reach([], 1e-3) is None


def test_runs_off_the_front_do_not_count():
    marks = [Mark("a", 1.0, 1e-2), Mark("bad", 50.0, 2e-2), Mark("b", 4.0, 1e-4)]
    assert reach(marks, 1e-3).seconds == pytest.approx(2.0)


# -- words from made-up runs ------------------------------------------------------------------------------------------


def run(solver, label, seconds, points=None, ok=True, **changes) -> Run:
    status = "converged" if ok else "not_converged"
    return Run(solver, label, 10, status, ok, seconds, None, points, **{"model": "ribbon", **changes})


def made(rows, plan=QUICK, common="shell") -> Cost:
    points = np.zeros((3, 3, 3))
    references = tuple(Reference(m, f"finest {m}", points, e, "check") for m, e in (("ribbon", 1e-6), ("shell", 1e-5)))
    return Cost(
        load("curl_4_3"), plan, None, None, tuple(rows), references, next(r for r in references if r.model == common),
        (), ("elastica: not planar",), {"cpu": "a cpu", "cores": 2, "threads": {"OMP_NUM_THREADS": "1"}, "system": "x"},
    )  # fmt: skip


def row(solver, label, seconds, error, distance, ok=True) -> Row:
    model = "shell" if solver.startswith("shell") else "ribbon"
    return Row(run(solver, label, seconds, ok=ok), model, error, error, error > 1e-5, distance, distance, True)


ROWS = (
    row("chained", "10", (0.01, 0.02, 0.03), 1e-2, 2.5e-2),
    row("chained", "20", (0.04,), 1e-4, 1.6e-2),
    row("chained", "40", (0.05,), 1.0, 1e-9, ok=False),
    row("shell", "25 x 2", (1.0,), 1e-2, 1e-2),
    row("shell", "50 x 4", (4.0,), 1e-4, 1e-4),
)


def test_the_sentence_names_times_sizes_and_the_factor():
    cost = made(ROWS, replace(QUICK, targets=(1e-3,)))
    lines = cost_write.sentences(cost)
    own = next(text for text in lines if text.startswith("Discretisation"))
    # medians: 0.02 and 0.04 s at 1e-2 and 1e-4, so sqrt(2) 0.02 at 1e-3; the shell 2 s: a factor 70.7
    assert "to 1 permille of l" in own
    assert "28.3 ms (chained 10 to chained 20)" in own
    assert "2 s (shell 25 x 2 to shell 50 x 4)" in own
    assert "a factor 70.7 from ribbon to shell" in own
    against = next(text for text in lines if text.startswith("Against one reference"))
    assert "own error 1.0e-05 l" in against
    assert "the ribbon does not reach it: 1.6e-02 at best" in against
    assert "factor" not in against
    assert any("however fine" in text and "1.6e-02" in text for text in lines)
    assert any("chained 40 (not_converged)" in text for text in lines)
    assert any("OMP_NUM_THREADS=1" in text and "a cpu" in text for text in lines)
    assert any("not planar" in text for text in lines)


def test_a_shell_on_its_own_and_from_the_ribbons_surface_are_told_apart():
    near = (row("shell near", "25 x 2", (0.1,), 1e-2, 1e-2), row("shell near", "50 x 4", (0.4,), 1e-4, 1e-4))
    cost = made((*ROWS, *near), replace(QUICK, targets=(1e-3,)))
    assert [party.words for party in cost.parties] == ["ribbon", "shell on its own", "shell from the ribbon's surface"]
    lines = cost_write.sentences(cost)
    own = next(text for text in lines if text.startswith("Discretisation"))
    assert "a factor 70.7 from ribbon to shell on its own" in own
    assert "a factor 7.07 from ribbon to shell from the ribbon's surface" in own
    assert any("its inertia checked" in text for text in lines)
    reached = {
        r["model"]: r["seconds"] for r in cost_write.reach_table(cost).records() if r["kind"] == "discretisation"
    }
    assert reached["shell on its own"] == pytest.approx(10.0 * reached["shell from the ribbon's surface"])


def test_a_shell_that_is_the_faster_one_is_said_to_be():
    """No "factor 0"."""
    cost = made(
        [row("chained", "10", (40.0,), 1e-3, 1e-3), row("shell", "a", (0.1,), 1e-3, 1e-3)],
        replace(QUICK, targets=(1e-3,)),
    )
    own = next(text for text in cost_write.sentences(cost) if text.startswith("Discretisation"))
    assert "shell is faster than the ribbon, by a factor 400" in own
    assert "factor" not in cost_write.answer(cost).text


def test_a_coarse_run_near_another_model_by_accident_does_not_count():
    cost = made([row("chained", "5", (0.01,), 3e-2, 1e-7), row("shell", "a", (1.0,), 1e-3, 1e-3)])
    (mark,) = cost.marks("ribbon", common=True)
    assert mark.error == pytest.approx(3e-2 + 1e-5)


def test_the_total_error_is_the_distance_and_the_references_own_error():
    """Both together bound the distance to what the reference stands for (its own error here 1e-5)."""
    cost = made(ROWS)
    assert [mark.error for mark in cost.marks("shell", common=True)] == pytest.approx([1e-2 + 1e-5, 1e-4 + 1e-5])
    assert [mark.error for mark in cost.marks("ribbon", common=True)] == pytest.approx([2.5e-2 + 1e-5, 1.6e-2 + 1e-5])


def test_the_headline_is_of_total_error():
    """The ribbon ends 1.6 % of l from the shell: it is nobody's 1 permille, however small its discretisation error."""
    found = cost_write.answer(made(ROWS, replace(QUICK, targets=(1e-3,))))
    assert "ribbon" not in found.text
    both = cost_write.answer(made(ROWS, replace(QUICK, targets=(2e-2, 1e-3))))
    assert "To 20 permille of l" in both.text
    assert "the ribbon" in both.text
    assert "to 1 permille of l only the shell 2" in both.text
    alone = cost_write.answer(made(ROWS[:3], replace(QUICK, targets=(1e-3,)), common="ribbon"))
    assert "28.3 ms" not in alone.text


@pytest.mark.parametrize(("distance", "kept"), [(0.049, True), (0.051, False), (0.91, False)])
def test_a_model_that_is_far_from_the_finest_is_named_and_left_out(distance, kept):
    rows = (row("chained", "10", (1e-3,), 1e-6, distance), row("shell", "a", (1.0,), 1e-4, 1e-4))
    cost = made(rows)
    assert bool(cost.marks("ribbon")) == kept
    assert bool(cost.marks("ribbon", common=True)) == kept
    assert ("ribbon" in cost.far) != kept
    assert cost_write.result_of(cost)["far"] == cost.far
    assert any(f"{distance:.1e} l from the common reference" in text for text in cost_write.sentences(cost)) != kept
    if not kept:
        assert f"the ribbon is left out, {100 * distance:.2g} % of l away" in cost_write.answer(cost).text
        assert all(record["model"] != "ribbon" for record in cost_write.reach_table(cost).records())


@pytest.mark.parametrize("name", ["limits_7_3", "jfig_5_2", "figure_4_1"])
def test_a_model_that_would_ignore_a_key_takes_no_part(name):
    """A film under its weight, which a tape does not read: `ribbonbench solve` refuses it by name, and so does this."""
    scene = load(name)
    tape = registry.model("tape")
    assert tape.refusal(scene) is None  # by its shape alone it would do
    entries, why = chosen(scene, Plan())
    assert "tape" not in {entry.model.name for entry in entries}
    assert any("gravity" in text and "tape" in text for text in why)


def test_what_a_model_refuses_in_one_command_it_refuses_in_all(tmp_path):
    scene = load("limits_7_3").replace({"model.energy": "tape"})
    for refused in (
        lambda: solve(scene),
        lambda: solve(load("limits_7_3"), "tape"),
        lambda: compare_scene(scene, CaseStore(tmp_path), Reporter(quiet=True)),
        lambda: measure(scene, QUICK, tmp_path, Reporter(quiet=True)),
    ):
        with pytest.raises(BadInput, match="gravity"):
            refused()


def test_no_error_counts_below_that_of_its_reference():
    cost = made([row("shell", "a", (1.0,), 1e-8, 1e-8)])
    assert [m.error for m in cost.marks("shell")] == [1e-5]


def test_tables_and_csv_hold_every_run():
    cost = made(ROWS)
    assert len(cost_write.table(cost).rows) == len(ROWS)
    lines = as_csv(cost_write.table(cost)).splitlines()
    assert len(lines) == 1 + len(ROWS)
    assert len({line.count(",") for line in lines}) == 1
    assert lines[1].startswith("chained,10,10,converged,0.01,")
    texts = cost_write.reach_table(cost).texts()
    assert len(texts) == 2 * 2 * len(QUICK.targets)


def test_the_picture_is_drawn(tmp_path):
    from matplotlib.image import imread

    pixels = imread(cost_write.picture(tmp_path / "c.png", made(ROWS)))[:, :, :3]
    assert pixels.shape[1] > 1.5 * pixels.shape[0]  # two panels
    assert pixels.std() > 0.05


# -- real runs --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cost")
    return measure(load("cantilever"), QUICK, folder, Reporter(quiet=True)), folder


def test_errors_fall_with_the_order_of_each_solver(flat):
    cost, _ = flat
    assert cost.ok
    for solver, order in (("chained", 4), ("mixed", 4), ("elastica 1", 2), ("elastica 2", 4)):
        errors = [r.error for r in cost.rows if r.run.solver == solver]
        assert len(errors) in (2, 3)
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all(np.abs(orders - order) < 0.5), (solver, orders)
    assert all(r.shown for r in cost.rows)
    assert all(len(r.run.seconds) == 2 for r in cost.rows)


def test_the_models_agree_where_they_are_one_and_their_references_state_errors(flat):
    cost, _ = flat
    assert {r.model for r in cost.references} == {"ribbon", "elastica"}
    assert all(r.error < 1e-8 for r in cost.references)
    # the flat ribbon is the elastica: the elastica's distance to the ribbon is its own discretisation error
    for r in cost.rows:
        if r.model == "elastica" and r.error > 1e-6:
            assert r.distance == pytest.approx(r.error, rel=1e-2)
    assert cost_write.plateau(cost, "elastica") is None


def test_chained_and_glued_have_the_same_error(flat):
    cost, _ = flat
    errors = {name: [r.error for r in cost.rows if r.run.solver == name] for name in ("chained", "mixed")}
    assert len(errors["chained"]) == 3
    assert errors["chained"] == pytest.approx(errors["mixed"], rel=1e-4)


def test_finished_runs_are_found_again_and_fresh_ones_made(flat):
    cost, folder = flat
    plan = replace(QUICK, segments=(5, 20), solvers=("chained",))
    again = measure(load("cantilever"), plan, folder, Reporter(quiet=True))
    assert len(again.references) == 1
    assert [r.run.label for r in again.rows] == ["5", "20"]
    assert all(r.run.reused for r in again.rows)
    before = [r for r in cost.rows if r.run.solver == "chained" and r.run.label in ("5", "20")]
    assert [r.run.seconds for r in again.rows] == [r.run.seconds for r in before]
    assert [r.error for r in again.rows] == pytest.approx([r.error for r in before], rel=1e-3)
    made_anew = measure(load("cantilever"), plan, folder, Reporter(quiet=True), fresh=True)
    assert not any(r.run.reused for r in made_anew.rows)


def test_an_interrupted_ladder_loses_nothing_that_was_finished(tmp_path):
    kept = CachedRun(tmp_path)
    kept.run(["a"], lambda: run("chained", "5", (1.0, 2.0), np.ones((2, 2, 3))))

    def stopped() -> Run:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kept.run(["b"], stopped)
    found = CachedRun(tmp_path).run(["a"], stopped)
    assert found.reused
    assert found.seconds == (1.0, 2.0)
    assert found.points.shape == (2, 2, 3)
    with pytest.raises(KeyboardInterrupt):
        CachedRun(tmp_path).finest(["a"], stopped)
    fine = Finest(run("ribbon", "80 segments", (), np.ones((2, 2, 3))), 1e-6, "160 segments", run("x", "5", (1.0,)))
    CachedRun(tmp_path).finest(["a"], lambda: fine)
    kept = CachedRun(tmp_path).finest(["a"], stopped)
    assert (kept.error, kept.checked, kept.against.seconds) == (1e-6, "160 segments", (1.0,))
    assert kept.run.points.shape == (2, 2, 3)
    without = CachedRun(tmp_path).run(["c"], lambda: run("chained", "5", ()))
    assert without.points is None
    assert CachedRun(tmp_path).run(["c"], stopped).warm is None
    CachedRun(tmp_path).run(["d"], lambda: replace(run("shell", "5 x 2", (), ok=False), status="crashed"))
    with pytest.raises(KeyboardInterrupt):  # a process that died is tried again
        CachedRun(tmp_path).run(["d"], stopped)


def test_an_unstable_size_is_a_row_without_a_mark(flat):
    cost, _ = flat
    bad = replace(cost.rows[0], run=replace(cost.rows[0].run, status="saddle", ok=False))
    changed = replace(cost, rows=(bad, *cost.rows[1:]))
    assert len(changed.marks()) == len(cost.marks()) - 1
    assert any("chained 5 (saddle)" in text for text in cost_write.sentences(changed))


def test_the_placed_ribbon_reaches_its_tolerance(tmp_path):
    plan = Plan(
        solvers=("mixed", "placed"), segments=(40,), tolerances=(1e-2, 1e-4), repeats=1, reference="own", budget=1e9
    )
    cost = measure(load("curl_4_3"), plan, tmp_path, Reporter(quiet=True))
    placed = [r for r in cost.rows if r.run.solver == "placed"]
    assert [r.error < t for r, t in zip(placed, (1e-2, 1e-4), strict=True)] == [True, True]
    assert cost.common is None
    assert all(r.distance is None for r in cost.rows)


def test_sizes_of_the_plan_are_those_of_its_ladders():
    plan = Plan(
        segments=(20, 5), tolerances=(1e-4, 1e-2), meshes=((50, 4), (10, 2)), elastica_elements=(7,), ratio=50.0
    )
    found, _ = chosen(load("cantilever"), plan)
    values = {entry.ladder.name: [size.values for size in entry.ladder.sizes] for entry in found}
    assert values == {
        "chained": [(5,), (20,)], "mixed": [(5,), (20,)], "placed": [(1e-2,), (1e-4,)],
        "elastica 1": [(7,)], "elastica 2": [(7,)], "elastica 3": [(7,)], "shell": [(10, 2), (50, 4)],
        "shell near": [(10, 2), (50, 4)],
    }  # fmt: skip
    assert [e.ladder.sizes[0].degree for e in found if e.model.name == "elastica"] == [1, 2, 3]
    assert require_shell(found[-1].scene) == (50.0,)
    usual, _ = chosen(load("cantilever"), Plan(solvers=("elastica",)))
    assert [e.ladder for e in usual] == list(usual[0].model.ladders(load("cantilever")))
    own, near = (ladder.sizes for ladder in registry.model("shell").ladders(load("curl_4_3")))
    assert [size.values for size in near] == [*(size.values for size in own), (150.0, 12.0)]


def test_a_band_has_no_chained_ribbon_and_no_shell():
    found, why = available(load("moebius_6_1"), Plan(solvers=("chained", "mixed", "shell", "elastica")))
    assert found == ("mixed",)
    assert [text.split(":")[0] for text in why] == ["chained", "elastica", "shell"]
    others = ("elastica", "curve_angle", "antman", "shell", "tape")
    assert families(load("moebius_6_1")) == ("chained", "mixed", "placed", *others)


# -- one truth --------------------------------------------------------------------------------------------------------

#: Two level clamps 0.8 apart in a plane: [6, -12, 6] bends it down, the natural shape's way leads up.
BOWED = {
    "strip.natural_curvature": "0.0", "strip.gamma": "1.0", "strip.width": "0.05",
    "clamp.end.position": "[0.0, 0.0, 0.8]", "clamp.end.tangent": "[0.0, 0.0, 1.0]",
    "clamp.end.normal": "[1.0, 0.0, 0.0]", "seed.curvature": "[6.0, -12.0, 6.0]",
}  # fmt: skip


@pytest.fixture(scope="module")
def bowed(tmp_path_factory):
    scene = loads(text(PLANAR, BOWED))
    plan = Plan(
        solvers=("mixed", "elastica"),
        segments=(10, 20),
        elastica_elements=(10, 20),
        reference="ribbon",
        repeats=1,
        budget=1e9,
    )
    return measure(scene, plan, tmp_path_factory.mktemp("bowed"), Reporter(quiet=True))


def test_all_models_are_on_the_branch_of_the_seed(bowed):
    """The elastica from the natural shape, whatever the seed, is 0.53 l away, with an energy of 8.45605."""
    assert {r.model for r in bowed.rows} == {"ribbon", "elastica"}
    assert bowed.ok
    for row in bowed.rows:
        assert row.distance < 2e-2, row.label
        if row.run.solver != "elastica 1":  # too coarse an energy
            assert row.run.energy == pytest.approx(8.18973, abs=0.05), row.label
    finest = [r for r in bowed.rows if r.run.solver == "elastica 3"][-1]
    assert finest.run.energy == pytest.approx(8.189728, abs=1e-6)  # as `ribbonbench solve` has it
    assert finest.distance < 2e-5
    assert cost_write.plateau(bowed, "elastica") is None or cost_write.plateau(bowed, "elastica") < 1e-5


def test_a_first_call_that_needs_another_models_shape_is_left_out(bowed):
    assert [start.solver for start in bowed.starts] == ["mixed"]
    assert any(words.startswith("first calls of elastica:") for words in bowed.left_out)


@pytest.mark.parametrize("which", ["flat", "bowed"])
def test_runs_are_what_solve_finds(which, request):
    """End, middle and energy of every run: the scene's own solve of that model and size, which knows of no bench."""
    found = request.getfixturevalue(which)
    cost = found[0] if which == "flat" else found
    assert len(cost.rows) >= 8
    for row in cost.rows:
        state = solve(cost.scene, row.model, size=row.run.size)
        line = row.run.points[:, row.run.points.shape[1] // 2]
        assert row.run.energy == pytest.approx(state.energy.total, rel=1e-8), row.label
        assert line[-1] == pytest.approx(state.end.position, abs=1e-7), row.label
        assert line[line.shape[0] // 2] == pytest.approx(state.middle.position, abs=1e-7), row.label
        assert row.run.status == state.word


# -- a model from outside ---------------------------------------------------------------------------------------------


@pytest.mark.validate
def test_a_model_from_outside_is_measured_like_the_others(tmp_path):
    """Its errors are the distances to its limit; its reference is refined, its first call a process."""
    scene = load("cantilever")
    with registered(tmp_path / "site", Arc):
        assert families(scene)[-1] == "arc"
        plan = Plan(solvers=("mixed", "arc"), segments=(5, 10), repeats=1, reference="ribbon")
        cost = measure(scene, plan, tmp_path / "cases", Reporter(quiet=True))
    assert "arc" not in families(scene)
    mine = [r for r in cost.rows if r.model == "arc"]
    assert [r.run.label for r in mine] == ["4", "8", "16", "32"]
    exact = cost.grid.of(ArcShape(10**6, scene.position, scene.frame, 1.0))
    true = {
        n: grid_hausdorff(cost.grid.of(ArcShape(n, scene.position, scene.frame, 1.0)), exact) for n in (*SIZES, 128)
    }
    assert [r.error for r in mine] == pytest.approx([true[n] for n in SIZES], rel=1e-1)
    assert np.log2([a.error / b.error for a, b in itertools.pairwise(mine)]) == pytest.approx([2.0] * 3, abs=0.2)
    reference = cost.reference_of("arc")
    assert (reference.what, reference.checked) == ("128", "256")
    assert reference.error == pytest.approx(true[128], rel=2e-2)
    assert [s.solver for s in cost.starts] == ["mixed", "arc"]
    assert all(r.distance > 0.01 for r in mine)  # another model
    assert cost.ok
    assert cost_write.result(cost)["cost"]["rows"][-1]["solver"] == "arc"
    assert "arc" in " ".join(cost_write.sentences(cost))
    assert cost_write.picture(tmp_path / "c.png", cost).exists()


def test_a_model_that_does_not_refine_is_checked_by_the_size_before(tmp_path):
    scene = load("cantilever")
    with registered(tmp_path / "site", Coarse):
        plan = Plan(solvers=("coarse",), repeats=1, reference="coarse")
        cost = measure(scene, plan, tmp_path / "cases", Reporter(quiet=True))
    reference = cost.reference_of("coarse")
    assert (reference.what, reference.checked) == ("32", "16")
    sizes = [cost.grid.of(ArcShape(n, scene.position, scene.frame, 1.0)) for n in (16, 32)]
    assert reference.error == pytest.approx(grid_hausdorff(*sizes), rel=1e-9)
    assert cost.rows[-1].shown is False


def test_a_model_in_its_own_processes_is_run_again_and_brings_its_first_calls(tmp_path):
    scene = load("cantilever")
    plan = Plan(solvers=("apart",), repeats=3, reference="own")
    with registered(tmp_path / "site", Apart):
        Apart.calls = 0
        cost = measure(scene, plan, tmp_path / "cases", Reporter(quiet=True))
        calls = Apart.calls
        again = measure(scene, plan, tmp_path / "cases", Reporter(quiet=True))
        assert Apart.calls == calls == 2 + 3 * len(SIZES)  # the reference and its check, then the ladder
    mine = [r.run for r in cost.rows if r.model == "apart"]
    assert [run.seconds for run in mine] == [(1.0 / n,) * 3 for n in SIZES]
    assert [run.start for run in mine] == [0.25] * len(mine)
    assert [(start.solver, start.seconds) for start in cost.starts] == [("apart", 0.25)]
    assert [r.run.seconds for r in again.rows if r.model == "apart"] == [run.seconds for run in mine]
    assert all(r.run.reused for r in again.rows)


def test_the_budget_ends_ladders_and_says_where(tmp_path):
    """Nothing is left from the beginning: of a ladder in this process the smallest size, of one in others nothing."""
    scene = load("cantilever")
    plan = Plan(solvers=("arc", "apart"), repeats=3, reference="own", budget=1e-9)
    with registered(tmp_path / "site", Arc, Apart):
        cost = measure(scene, plan, tmp_path / "cases", Reporter(quiet=True))
    assert [r.label for r in cost.rows] == ["arc 4"]
    left = [words.split(":")[0] for words in cost.left_out]
    assert left == [*(f"arc {n}" for n in SIZES[1:]), *(f"apart {n}" for n in SIZES)]
    assert not cost.ok
    with registered(
        tmp_path / "again", Apart
    ):  # 0.5 s for the first, 1/8 + 1/4 for the next: within 100 s, all of them
        plan = replace(plan, solvers=("apart",), budget=100.0)
        assert len(measure(scene, plan, tmp_path / "other", Reporter(quiet=True)).rows) == len(SIZES)


# -- the command ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--solvers", "chain"], "chained, mixed, placed, elastica, curve_angle, antman, shell, tape"),
        (["--segments", "1"], "--segments"),
        (["--meshes", "50"], "--meshes"),
        (["--meshes", "0x4"], "--meshes"),
        (["--target", "0"], "--target"),
        (["--tolerances", "0.5"], "--tolerances"),
        (["--repeats", "0"], "--repeats"),
        (["--budget", "-1"], "--budget"),
        (["--reference", "elastic"], "ribbon, elastica, curve_angle, antman, shell, tape, own"),
        (["--width-to-thickness", "0.5"], "--width-to-thickness"),
    ],
)
def test_bad_input_is_one_line_before_anything_is_made(arguments, said, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["cost", "curl_4_3", "--out", str(out), *arguments]) == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert said in error[-1]
    assert not out.exists()


def test_a_reference_that_is_not_run_is_refused(tmp_path, capsys):
    arguments = ["cost", "curl_4_3", "--solvers", "chained", "--reference", "elastica", "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "not among the models" in capsys.readouterr().err


@pytest.mark.shell
def test_cost_from_the_command_line(tmp_path, capsys):
    pytest.importorskip("dolfinx")
    requested = "--solvers chained shell --segments 10 20 --meshes 10x2 20x2 --width-to-thickness 20.0 --target 0.01"
    arguments = ["cost", "curl_4_3", *requested.split(), "--repeats", "1", "--budget", "1e9", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert "permille of l" in capsys.readouterr().out
    result = json.loads((tmp_path / "result.json").read_text())
    assert {"status", "energy", "provenance", "cost"} <= result.keys()
    cost = result["cost"]
    assert cost["common"] == "shell"
    shells = [r for r in cost["rows"] if r["solver"] == "shell"]
    assert [r["size"] for r in shells] == ["10 x 2", "20 x 2", "30 x 3"]
    near = [r for r in cost["rows"] if r["solver"] == "shell near"]
    assert [r["size"] for r in near] == ["10 x 2", "20 x 2"]
    assert [r["error"] for r in near] == pytest.approx([r["error"] for r in shells[:2]], rel=1e-6)
    starts = [r["seconds"]["start"] for r in (*shells, *near)]
    assert cost["starts"][-1] == {"solver": "shell", "seconds": pytest.approx(np.median(starts)), "compiled": None}
    assert all(0.1 < start < 60.0 for start in starts)  # Python, dolfinx and the forms: never none
    reference = next(r for r in cost["references"] if r["model"] == "shell")
    assert shells[-1]["error"] == pytest.approx(reference["error"])  # the mesh the reference is checked on
    # the shell's distance is its own error, the ribbon's ends on the difference of the models
    assert all(r["distance"] == r["error"] for r in shells)
    ribbons = [r for r in cost["rows"] if r["model"] == "ribbon"]
    assert all(r["distance"] > 0.05 for r in ribbons)
    page = read_page(tmp_path)
    assert str(tmp_path) not in (tmp_path / "page.json").read_text() + (tmp_path / "result.json").read_text()
    assert (tmp_path / page.pictures[0].file).exists()
    # again: shells come from the store, with their times marked
    assert main([*arguments, "--quiet"]) == 0
    kept = [r for r in json.loads((tmp_path / "result.json").read_text())["cost"]["rows"] if r["solver"] == "shell"]
    assert all(r["reused"] for r in kept)
    assert [r["seconds"]["warm"] for r in kept] == [r["seconds"]["warm"] for r in shells]
