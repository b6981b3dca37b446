"""An effect that is off is not computed: kernels counted by name, rows, unknowns, procedures and processes.

The kernels run interpreted here, every call counted: a kernel that is compiled into another one cannot be counted
otherwise. What an effect brings must be called when it is on, and never when it is off.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import ribbon
from compare.cli import DONE, main
from compare.models import shell_process
from compare.models import solve as solve_scene
from compare.models.effects.ribbon_off import explained_problem, keys_without, starting_state
from compare.models.elastica import start as elastica_start
from compare.models.elastica.model import ElasticaModel
from compare.models.ribbon import stages
from compare.models.ribbon.build import ribbon_arguments, ribbon_problem
from compare.models.ribbon.model import RibbonModel
from compare.models.shell import ShellModel
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.studies import compare as comparison
from compare.studies.effects import explain
from compare.studies.effects_measured import solves
from ribbon.find import adaptive
from ribbon.problems.chained import ChainedProblem
from tests.compare.scene import held_scenes

QUIET = Reporter(quiet=True)
NO_STORE = SimpleNamespace(root=Path("unused") / "cases")
NATURAL = ("element.natural_value", "element.natural_jet", "natural.density")
WIDTH = ("wunderlich.density", "wunderlich.width_factor")
BASE = load("curl_4_3").replace({"model.elements": 3, "model.grading": "uniform"})
HELD = loads(held_scenes.TWO_CLAMPS).replace({"model.elements": 3, "strip.natural_curvature": 2.0})
FLOOR = loads(held_scenes.FLOOR).replace({"model.elements": 3})
PLATE = FLOOR.replace({"wall.floor.stiffness": 50.0})
CIRCLE = loads(held_scenes.CIRCLE).replace({"model.elements": 3})


@pytest.fixture
def counted(monkeypatch):
    """Interpreted kernels; the calls of each, by "module.name"."""
    calls: Counter[str] = Counter()
    wrapped: dict[int, object] = {}

    def interpreted(kernel):
        name = f"{kernel.py_func.__module__.rpartition('.')[2]}.{kernel.py_func.__name__}"

        def call(*arguments):
            calls[name] += 1
            return kernel.py_func(*arguments)

        return call

    for info in pkgutil.walk_packages(ribbon.__path__, "ribbon."):
        module = importlib.import_module(info.name)
        for name, value in list(vars(module).items()):
            if isinstance(value, Dispatcher):
                if id(value) not in wrapped:
                    wrapped[id(value)] = interpreted(value)
                monkeypatch.setattr(module, name, wrapped[id(value)])
    return calls


def evaluated(scene, calls):
    """Calls of kernels, by name, in one evaluation of all that the minimiser asks for, and the problem."""
    problem = ribbon_problem(scene)
    x = starting_state(scene, problem) + 0.01
    calls.clear()
    problem.value(x)
    problem.gradient(x)
    if isinstance(problem, ChainedProblem):
        problem.hessian(x)
    else:
        problem.constraints(x)
        problem.jacobian(x)
        problem.hessian(x, np.ones(problem.constraint_bounds()[0].size))
    return Counter(calls), problem


#: Effect, scene with it, keys without it, kernels that only it calls.
KERNELS = {
    "gravity, chained": (
        BASE, {"gravity": None},
        ("weight.height", "weight.derivatives", "chained_kernels.load_derivatives", "balance_series.balance"),
    ),
    "gravity, glued": (HELD, {"gravity": None}, ("mixed_kernels.weight_jets",)),
    "exact gravity": (HELD.replace({"gravity.exact": True}), {"gravity.exact": None}, ("mixed_kernels.end_weight",)),
    "natural curvature, chained": (BASE, {"strip.natural_curvature": 0.0}, NATURAL),
    "natural curvature, glued": (HELD, {"strip.natural_curvature": 0.0}, NATURAL),
    "finite width, chained": (BASE, {"model.energy": "sadowsky"}, WIDTH),
    "finite width, glued": (HELD, {"model.energy": "sadowsky"}, WIDTH),
    "contact": (FLOOR, {"wall": None}, ("conditions._distances", "conditions._slopes", "conditions._curvatures")),
}  # fmt: skip


@pytest.mark.parametrize("case", KERNELS)
def test_its_kernels_are_called_when_it_is_on_and_only_then(counted, case):
    scene, keys, kernels = KERNELS[case]
    keys = {**keys, "model.formulation": ribbon_problem(scene).formulation}
    on, _ = evaluated(scene, counted)
    off, _ = evaluated(scene.replace(keys), counted)
    for kernel in kernels:
        assert on[kernel] > 0, kernel
        assert off[kernel] == 0, kernel
    assert sum(off.values()) < sum(on.values())
    assert off["element.bending_value"] == on["element.bending_value"] == 3


@pytest.mark.parametrize(("exact", "weighed", "rows"), [(None, False, 12), (False, True, 15), (True, True, 18)])
def test_integrals_that_only_weight_needs_are_left_alone(counted, monkeypatch, exact, weighed, rows):
    """Jets of the glued ribbon's series: Q and p, with weight J, over the surface T too (rows of the states)."""
    series = importlib.import_module("ribbon.element.kinematics")
    walked = []
    kernel = series.walk
    monkeypatch.setattr(series, "walk", lambda *given: walked.append(given[-1].shape[1]) or kernel(*given))
    _, problem = evaluated(HELD.replace({"gravity": None} if exact is None else {"gravity.exact": exact}), counted)
    assert walked == [rows]
    assert problem.has_gravity is weighed


def test_terms_of_the_series_of_values(counted):
    """One recurrence (u) without weight, two (and c) with it, three (and t) over the surface."""
    terms = []
    for keys in ({"gravity": None}, {}, {"gravity.exact": True}):
        found, _ = evaluated(HELD.replace({"strip.natural_curvature": 0.0, "seed.curvature": 2.0, **keys}), counted)
        terms.append(found["series.next_term"])
    assert terms[0] < terms[1] < terms[2]


def test_the_whole_solve_without_weight_evaluates_no_series(counted):
    off = BASE.replace({"gravity": None})
    counted.clear()
    result = ribbon.solve(**ribbon_arguments(off), options={"max_iter": 5})
    assert result.evaluations["series"] == 0
    assert counted["chained_kernels.load_derivatives"] == counted["chained_kernels._height"] == 0
    assert counted["weight.height"] == counted["weight.derivatives"] == counted["series.walk"] == 0


# -- unknowns, rows, entries of the matrices ---------------------------------------------------------------------------


def without(scene, effect, formulation):
    return scene.replace(keys_without(scene, effect, formulation))


def sizes(scene):
    problem = explained_problem(scene)
    lower, upper = problem.bounds()
    entries = () if isinstance(problem, ChainedProblem) else (
        problem.jacobian_structure()[0].size, problem.hessian_structure()[0].size,
    )  # fmt: skip
    rows = 0 if isinstance(problem, ChainedProblem) else problem.constraint_bounds()[0].size
    return int(np.sum(lower < upper)), rows, *entries


#: Effect, scene with it, change of (unknowns, rows, entries of Jacobian and Hessian) when it is off; p = 3.
SIZES = {
    "clamp at the end": (HELD, (0, -6, -15, 0)),
    "contact": (FLOOR, (0, -6, -48, -42)),
    "pressure plates": (PLATE, (-1, 0, -6, -1)),
    "straight rulings": (CIRCLE.replace({"closure.ruling": "straight"}), (2, 1, 2, 0)),
    "gravity over the surface": (HELD.replace({"gravity.exact": True}), (0, 0, 0, -30)),
    "gravity": (HELD, (0, 0, 0, 0)),
    "natural curvature": (HELD, (0, 0, 0, 0)),
    "finite width (Wunderlich)": (HELD, (0, 0, 0, 0)),
}


@pytest.mark.parametrize("effect", SIZES)
def test_what_goes_from_the_matrices(effect):
    scene, change = SIZES[effect]
    off = without(scene, effect, ribbon_problem(scene).formulation)
    found = tuple(b - a for a, b in zip(sizes(scene), sizes(off), strict=True))
    assert found == change
    told = next(e for e in explain(scene).effects if e.key == effect)
    assert (told.unknowns, told.constraints) == (-change[0], -change[1])


def test_blocks_of_rows_are_those_of_what_holds():
    """Seam and gauge are there for bands and free motions only; the start has rows only when it is asked for."""
    blocks = {
        name: set(ribbon_problem(s).blocks()) for name, s in (("held", HELD), ("floor", FLOOR), ("circle", CIRCLE))
    }
    assert blocks == {
        "held": {"end_position", "end_frame"},
        "floor": {"wall_0"},
        "circle": {"end_position", "end_frame", "seam_omega", "seam_eta"},
    }
    rows = set(ribbon_problem(HELD.replace({"model.held_by": "constraints"})).blocks())
    assert rows == blocks["held"] | {"start_position", "start_frame"}
    table = load("moebius_table_edge")
    assert {"gauge_position", "gauge_frame"} <= set(ribbon_problem(table).blocks())
    # a band that weight and a wall hold against all but sliding and turning on the table
    assert "gauge_slide" not in ribbon_problem(table).blocks()
    assert "gauge_slide" in ribbon_problem(load("moebius_6_1")).blocks()


def test_bounds_are_those_of_the_rulings_alone():
    problem = ribbon_problem(HELD)
    lower, upper = problem.bounds()
    bounded = np.isfinite(upper) & (lower < upper)
    assert np.flatnonzero(bounded).tolist() == [9, 19, 29]
    assert upper[9] == pytest.approx(1.0 / problem.half_width)


# -- procedures and processes ------------------------------------------------------------------------------------------


def _raise(*arguments, **keywords):
    raise AssertionError("computed although it is off")


def test_no_path_no_tolerance_no_elastica_no_process(monkeypatch, tmp_path):
    """A scene without them solves with all of them broken."""
    monkeypatch.setattr(adaptive, "solve_to_tolerance", _raise)
    for name in ("solve_elastica", "solve_near", "solve_along", "start_of"):
        monkeypatch.setattr(elastica_start, name, _raise)
    for name in ("run_way", "follow"):
        monkeypatch.setattr(stages, name, _raise)
    monkeypatch.setattr(shell_process, "subprocess", SimpleNamespace(Popen=_raise))
    assert main(["solve", "curl_4_3", "--out", str(tmp_path), "--quiet"]) == DONE


@pytest.mark.parametrize(
    ("scene", "broken", "name"),
    [
        (loads(held_scenes.PATH), stages, "follow"),
        (loads(held_scenes.TWO_CLAMPS.replace("elements = 16", "tolerance = 1e-2")), adaptive, "solve_to_tolerance"),
    ],
)
def test_a_procedure_that_is_on_is_run(monkeypatch, scene, broken, name):
    monkeypatch.setattr(broken, name, _raise)
    with pytest.raises(AssertionError, match="although"):
        solve_scene(scene)


def test_the_elastica_is_solved_for_planar_scenes_only(monkeypatch):
    monkeypatch.setattr(ElasticaModel, "solve", _raise)
    monkeypatch.setattr(ShellModel, "solve", _shell_reached)
    scene = load("curl_4_3").replace({"shell.width_to_thickness": [20]})
    with pytest.raises(LookupError):
        comparison.compare(scene, NO_STORE, QUIET)
    with pytest.raises(AssertionError, match="although"):
        comparison.compare(load("cantilever"), NO_STORE, QUIET)


def _shell_reached(*arguments, **keywords):
    raise LookupError


# -- whole solves ------------------------------------------------------------------------------------------------------


def test_whole_solves_without_each_effect():
    """On the flat cantilever nothing leaves the plane: the finite width costs and changes nothing; weight does."""
    scene = load("cantilever").replace({"model.elements": 8})
    found = solves(scene, explain(scene), QUIET, always=True)
    assert set(found.without) == {"gravity", "finite width (Wunderlich)", "straight rulings"}
    assert all(off.status == "converged" for off in found.without.values())
    assert all(off.iterations >= 0 and off.warm > 0.0 for off in found.without.values())
    assert found.without["finite width (Wunderlich)"].moved < 1e-9
    assert found.without["straight rulings"].moved < 1e-9
    assert found.without["gravity"].moved > 0.3
    assert solves(scene, explain(scene), QUIET, always=False).without == {}


def test_what_cannot_be_off_says_why():
    effects = {effect.key: effect for effect in explain(load("moebius_table_edge")).effects}
    assert "fall for ever" in effects["contact"].fixed
    assert "no switch" in effects["closure"].fixed
    assert effects["contact"].unknowns is None
    assert effects["gravity"].fixed == ""


def test_a_path_loses_what_it_says_of_the_effect():
    scene = loads(held_scenes.PATH)
    off = without(scene, "clamp at the end", "mixed")
    assert off.clamp_end is None
    assert off.to_dict()["path"] == [{"gravity": False}]
    assert without(scene, "gravity", "mixed").to_dict()["path"][0] == {"clamp.end.position": [0.9, 0.0, 0.0]}
    assert without(scene, "continuation path", "mixed").path == ()


def test_the_first_stage_that_is_left_counts_no_steps():
    """Without weight the stage that changes only that is gone, and the next one is reached from the seed."""
    stages = [{"gravity": False}, {"clamp.end.position": [0.9, 0.0, 0.0], "steps": 3}]
    off = without(loads(held_scenes.PATH).replace({"path": stages}), "gravity", "mixed")
    assert off.to_dict()["path"] == [{"clamp.end.position": [0.9, 0.0, 0.0]}]


def test_equal_segments_stand_for_those_that_a_tolerance_placed(monkeypatch):
    """As many as the scene's own state has, of equal length, in the same formulation."""
    scene = loads(held_scenes.TWO_CLAMPS.replace("elements = 16", "tolerance = 1e-2"))
    found = explain(scene)
    effect = next(e for e in found.effects if e.key == "adaptive segments")
    assert (effect.unknowns, effect.constraints, effect.seconds) == (0, 0, None)
    states = []
    solve = RibbonModel.solve
    monkeypatch.setattr(RibbonModel, "solve", lambda *a, **more: states.append(solve(*a, **more)) or states[-1])
    table = solves(scene, replace(found, effects=(effect,)), QUIET, always=True).without
    own, equal = (state.native.problem for state in states)
    count = own.lengths.size
    assert count != len(scene.replace(effect.changes).model.lengths)  # not the number that a scene has unasked
    assert equal.lengths == pytest.approx(np.full(count, 1.0 / count))
    assert equal.formulation == own.formulation == "mixed"
    assert table["adaptive segments"].moved < 1e-2
