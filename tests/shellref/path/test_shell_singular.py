"""A tangent that cannot be factored, or is singular, wherever a factor is used: a state of the walk, never a trace.

The fault is injected: the first run of a case notes from which functions of shellref every factorisation and every
solution with one is asked for (a *place*); then that place fails once, and always. So no processor's rounding decides.
"""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.fenics import petsc_api as petsc  # noqa: E402
from shellref.path.arc import Point, follow  # noqa: E402
from shellref.path.begin import begun as solved  # noqa: E402
from shellref.path.buckling import buckling  # noqa: E402
from shellref.path.linear import MeshFactor  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.solve import Solver, solve  # noqa: E402
from shellref.path.stability import lowest_mode  # noqa: E402
from shellref.path.walk import Walk, Walker  # noqa: E402
from shellref.shell.body import Body, Supports  # noqa: E402
from shellref.shell.grid import Grid  # noqa: E402
from shellref.shell.midsurface import Cylinder  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402
from shellref.shell.strip import build_strip  # noqa: E402

OPAQUE = {
    "factor",
    "factor_at",
    "solve",
    "applied",
    "back",
    "_solve",
    "correction",
    "_sway",
    "expand",
    "mult",
    "<lambda>",
}  # ways from a place to the factors
CALLS = ("factor", "solve")


def place(call: str) -> tuple[str, ...]:
    """The call and the functions of shellref that led to it, those of OPAQUE left out, the innermost two kept."""
    frame, names = sys._getframe(2), []
    while frame is not None and len(names) < 2:
        name = frame.f_code.co_name
        if frame.f_globals.get("__name__", "").startswith("shellref.") and name not in OPAQUE:
            names.append(name)
        frame = frame.f_back
    return (call, *names)


@contextmanager
def factors(monkeypatch, fails=lambda place, number: False, how="raises"):
    """Count the calls by place; those for which `fails` (of the place and its number there, from 1) fail.

    how: "raises" what the factor raises; "not finite" puts NaN into the matrix, or into the right side of a solution.
    """
    seen: Counter[tuple[str, ...]] = Counter()
    with monkeypatch.context() as patch:
        for kind in (petsc.SymmetricFactor, MeshFactor):
            for call in CALLS:
                original = getattr(kind, call)

                def injected(self, *arguments, call=call, original=original):
                    where = place(call)
                    seen[where] += 1
                    if not fails(where, seen[where]):
                        return original(self, *arguments)
                    if how == "raises":
                        raise petsc.FactorisationFailed("injected")
                    if call == "factor" and isinstance(self, MeshFactor):
                        self.tangent.diagonal[:] = np.nan
                    elif call == "factor":
                        self.matrix.scale(np.nan)
                    return original(self, *(np.full_like(right, np.nan) for right in arguments))

                patch.setattr(kind, call, injected)
        yield seen


FRAME = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x
ON_EDGE = ShellProblem(width=0.05, thickness=2.5e-3, poisson=0.35, gamma=21.7, up=(1.0, 0.0, 0.0), elements=(4, 1))
SAG = ShellProblem(width=0.1, thickness=5e-3, poisson=0.3, gamma=3.0, up=(0.0, 1.0, 0.0), elements=(3, 1))
ARCH = ShellProblem(  # shallow, bulging to -z, pushed to +z by its weight
    width=0.05,
    thickness=2.5e-3,
    poisson=0.3,
    start_curvature=-1.0,
    end=Pose((0.985, 0.0, 0.0), FRAME),
    path=(Waypoint(natural=1.0, name="release"), Waypoint(end=Pose((0.985, 0.0, 0.0), FRAME), name="clamps")),
    clamp_frame=FRAME,
    gamma=120.0,
    up=(0.0, 0.0, -1.0),
    elements=(6, 1),
)
CASES = {
    "steps": (SAG, ShellOptions(arc_length="never")),
    "arc": (SAG, ShellOptions(arc_length="always", stability=False)),
    "kick": (ON_EDGE, ShellOptions(event_tolerance=0.05)),
    "switch": (ON_EDGE, ShellOptions(arc_length="always", switch=True, event_tolerance=0.05)),
    "limit points": (ARCH, ShellOptions(switch=True, event_tolerance=0.01)),
}


#: Places looked at in a case: those that the cases before have not got, where it is a long one.
ONLY = {"limit points": ("_limit", "_tangent")}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """(problem, options, what the undisturbed run gives, its places)."""
    problem, options = CASES[request.param]
    with pytest.MonkeyPatch.context() as monkeypatch, factors(monkeypatch) as seen:
        clean = solve(problem, options)
    assert clean.status is ShellStatus.CONVERGED
    only = ONLY.get(request.param)
    places = [where for where in seen if only is None or set(only) & set(where)]
    assert places
    return problem, options, clean, places


def accepted(result):
    return [step for step in result.steps if step.accepted]


def told(result, where):
    """What is true of every result: a status, a message, a finite state that balances the loads it says it carries."""
    assert isinstance(result.status, ShellStatus), where
    assert result.message, where
    assert np.all(np.isfinite(result.surface.points)), where
    if accepted(result):
        assert result.residual["relative"] < 1e-6, where
    result.to_dict()


@pytest.mark.parametrize("how", [pytest.param("raises", marks=pytest.mark.validate), "not finite"])
def test_one_failure_anywhere_is_survived(case, monkeypatch, how):
    """The step is cut, another place looked at, or another predictor taken: the same state of the same energy."""
    problem, options, clean, places = case
    for where in places:
        with factors(monkeypatch, lambda at, number, where=where: at == where and number == 1, how):
            result = solve(problem, options)
        told(result, where)
        if where[1] == "_begin":  # nothing stands before the first equilibrium
            assert result.status is ShellStatus.NOT_CONVERGED
            assert not accepted(result)
            continue
        assert result.status is ShellStatus.CONVERGED, (where, result.message)
        assert result.energy["total"] == pytest.approx(clean.energy["total"], abs=1e-8), where
        assert result.stable is clean.stable, where


def test_a_place_that_always_fails_ends_in_a_status(case, monkeypatch):
    """No way on: the last good state and a word why; nothing is called stable that was not seen to be."""
    problem, options, clean, places = case
    for where in places:
        with factors(monkeypatch, lambda at, number, where=where: at == where):
            result = solve(problem, options)
        told(result, where)
        if result.stable:
            assert result.status is ShellStatus.CONVERGED, where
            assert result.energy["total"] == pytest.approx(clean.energy["total"], abs=1e-8), where
        elif result.status is ShellStatus.CONVERGED:
            assert (result.stable, result.path_factor) == (None, 1.0), where
        elif result.status is ShellStatus.UNSTABLE:
            assert result.stable is False, where
            assert result.lowest_eigenvalue is None or result.lowest_eigenvalue < 0.0, where
        else:
            assert (result.status, result.stable) == (ShellStatus.NOT_CONVERGED, None), where
            assert result.path_factor < 1.0, where


@pytest.mark.parametrize("how", ["raises", "not finite"])
@pytest.mark.parametrize("last", [0, 1, 7, 30])
def test_factors_that_fail_from_some_call_on_end_in_a_status(monkeypatch, how, last):
    """None at all, or none after so many: the walk keeps what it had."""
    problem, options = CASES["switch"]
    count = 0

    def late(at, number):
        nonlocal count
        count += 1
        return count > last

    with factors(monkeypatch, late, how):
        result = solve(problem, options)
    told(result, last)
    assert (result.status, result.stable) == (ShellStatus.NOT_CONVERGED, None)
    assert bool(accepted(result)) is (last > 1)


def test_a_path_whose_tangent_is_singular_takes_the_softened_one(monkeypatch):
    """The first predictor of arc length: du/dload of tangent + SOFT * mass points almost where the true one does."""
    clean = solve(*CASES["arc"])
    for failing in (("solve", "tangent_of"), ("factor", "negative_eigenvalues")):
        with factors(monkeypatch, lambda at, number, failing=failing: at[:2] == failing and number == 1):
            result = solve(*CASES["arc"])
        assert result.status is ShellStatus.CONVERGED
        assert [s.method for s in result.steps] == [s.method for s in clean.steps]
        assert all(s.accepted for s in result.steps)
        np.testing.assert_allclose(result.surface.points, clean.surface.points, atol=1e-7)


def test_a_load_that_moves_nothing_is_no_division_by_zero(monkeypatch):
    """Arc length along a stage whose du/dload is zero: it cannot begin, and says so."""
    monkeypatch.setattr(Walker, "load_steps", follow_at_once)
    monkeypatch.setattr(Equilibrium, "_sway", lambda self, state, *rest: np.zeros_like(state))
    result = solve(SAG)
    assert (result.status, result.stable) == (ShellStatus.NOT_CONVERGED, None)
    assert result.path_factor == 0.0


def follow_at_once(walker, walk):
    follow(walker, walk)


def test_buckling_survives_one_failure_and_ends_in_a_status_when_it_always_fails(monkeypatch):
    problem, options = replace(ON_EDGE, gamma=18.0), ShellOptions(event_tolerance=0.01)
    with factors(monkeypatch) as seen:
        clean = buckling(problem, options)
    assert clean.status is ShellStatus.CONVERGED
    assert {"find", "linearised", "tangent_change", "locate"} <= {name for where in seen for name in where}
    for where in list(seen):
        with factors(monkeypatch, lambda at, number, where=where: at == where and number == 1):
            once = buckling(problem, options)
        if where[1] == "_begin":
            assert once.status is ShellStatus.NOT_CONVERGED
        else:
            assert once.status is ShellStatus.CONVERGED, where
            assert once.critical == pytest.approx(clean.critical, rel=0.06), where
            assert once.linearised == pytest.approx(clean.linearised, rel=0.02), where
        with factors(monkeypatch, lambda at, number, where=where: at == where):
            always = buckling(problem, options)
        assert isinstance(always.status, ShellStatus), where
        assert always.message, where
        assert always.status is ShellStatus.NOT_CONVERGED or always.inertia is not None, where


def test_a_refined_mesh_or_a_start_that_cannot_be_factored_ends_in_a_status(monkeypatch):
    """Adaptive meshes, and the worker's ways from a given start: factors of every mesh but the first fail, then all."""
    clean = solve(SAG)
    accurate = replace(CASES["steps"][1], accuracy=0.05)
    with factors(monkeypatch) as seen:
        assert solve(SAG, accurate).status is ShellStatus.CONVERGED
    begun = sum(number for where, number in seen.items() if "_begin" in where)
    assert begun > 4
    with factors(monkeypatch, lambda at, number: "settle_at_end" in at or ("start" in at and number > 2)):
        refined = solve(SAG, accurate)
    assert refined.status is ShellStatus.NOT_CONVERGED
    assert refined.elements == SAG.elements
    with factors(monkeypatch, lambda at, number: "settle_at_end" in at):
        found = solved(SAG, ShellOptions(), lambda event: None, clean.surface)
    assert found.how == "path (none near the start)"
    assert found.result.energy["total"] == pytest.approx(clean.energy["total"], abs=1e-9)
    with factors(monkeypatch, lambda at, number: True):
        found = solved(SAG, ShellOptions(), lambda event: None, clean.surface)
    assert (found.result.status, found.result.stable) == (ShellStatus.NOT_CONVERGED, None)


def test_an_eigenvalue_that_is_zero_to_rounding_is_at_a_fold():
    """A strip of 2.5e-6 of its length: rounding moves its eigenvalues by some 0.5, and the bound says 5. On edge at 0.9
    of its buckling weight its lowest is 2 or so: whatever the processor makes of it, it is no verdict."""
    result = solve(replace(ON_EDGE, thickness=2.5e-6, elements=(16, 2), gamma=12.7), ShellOptions(arc_length="never"))
    assert result.status is ShellStatus.CONVERGED, result.message
    assert (result.stable, result.negative_eigenvalues) == (None, None)
    assert abs(result.lowest_eigenvalue) < 5.0
    thick = solve(replace(ON_EDGE, elements=(16, 2), gamma=12.7), ShellOptions(arc_length="never"))
    assert (thick.status, thick.stable) == (ShellStatus.CONVERGED, True)


def test_a_state_at_a_fold_is_not_kicked(monkeypatch):
    """The bound made large: no state is stable or unstable, so none is left, and the flat strip is where it ends."""
    monkeypatch.setattr(petsc, "rounding", lambda matrix, x: 1e9)
    result = solve(ON_EDGE)
    assert (result.status, result.stable) == (ShellStatus.CONVERGED, None)
    assert not [step for step in result.steps if step.method == "relax"]
    assert np.max(np.abs(result.surface.points[..., 1])) < 1e-6
    monkeypatch.undo()
    assert solve(ON_EDGE, ShellOptions(kick=False)).status is ShellStatus.UNSTABLE


def test_the_bound_holds_for_states_rounded_anew():
    """The lowest eigenvalue at a state of which every number is changed by eps or less moves by less than the bound."""
    from shellref.fenics import dolfinx_api as api

    rng = np.random.default_rng(0)
    for thickness in (2.5e-3, 2.5e-5):
        problem = replace(ON_EDGE, thickness=thickness, gamma=8.0)
        solver = Solver(build_strip(problem, ShellOptions()), ShellOptions(), api.communicator("self"), lambda event: 0)
        state = solver.state_of(solve(problem).surface)
        stage = solver.strip.stages[-1]
        mode, _ = lowest_mode(solver.equilibrium, state, stage, 1.0)
        assert 0.0 < mode.rounding < 0.1 * mode.value
        for _ in range(5):
            other = state * (1.0 + np.finfo(float).eps * rng.uniform(-1.0, 1.0, state.shape))
            moved, _ = lowest_mode(solver.equilibrium, other, stage, 1.0)
            assert abs(moved.value - mode.value) < mode.rounding


def test_a_surface_that_nothing_holds_is_no_stable_state():
    """Six rigid motions cost nothing: pivots of zero, or what rounding makes of them."""
    body = Body(
        surface=Cylinder(),
        grid=Grid(np.linspace(0, 1, 4), np.linspace(-0.1, 0.1, 3)),
        thickness=0.02,
        poisson=0.3,
        supports=lambda grid, nodes: Supports.none(len(nodes)),
    )
    options = ShellOptions()
    model = NaghdiModel(body, options.stabilisation)
    walker = Walker(Equilibrium(model, options), (), options)
    walk = Walk(Point(0.0, model.reference.copy(), model.stress(model.reference)))
    walker.start(walk)
    walker.run(walk)
    verdict = walker.verdict(walk)
    assert verdict.status in (ShellStatus.CONVERGED, ShellStatus.NOT_CONVERGED)
    assert verdict.stable is None
    assert not [step for step in walk.steps if step.method == "relax"]
