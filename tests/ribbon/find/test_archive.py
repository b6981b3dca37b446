"""An equilibrium that is written and read again is the same, field by field; no field can be forgotten."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from compare.models.quantities.ribbon import LINEAR_SOLVERS
from ribbon import Clamp, Equilibrium, Gravity, Strip, archive, refine, solve
from ribbon.result import Branch, Left, Minima, Refinement, Status
from ribbon.solvers.problem import SOLVERS


@pytest.fixture(scope="module")
def found():
    return solve(Strip(1.0, 0.1, gamma=20.0, natural_curvature=3.0), Clamp(), Gravity((1, 0, 0)), segments=6)


def same(one, other):
    """Whether two values are the same to the last bit, NaN included."""
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)
    return type(one) is type(other) and repr(one) == repr(other)


#: A value for every field that the class's own tests would hardly give.
OTHERS = {
    "status": Status.SADDLE, "message": "ends\nhere", "stable": None, "lowest_eigenvalue": float("nan"),
    "evaluations": {"value": np.int64(3)}, "rows": np.array([1.5, np.inf]), "at": np.array([0.1, 0.2]),
    "log": ({"t": 0.5, "moved": [1.0, None]},), "tolerance_error": 1e-3, "penetration": 0.0,
    "refinements": (
        Refinement(8, Status.SADDLE, -1e-3, None, {"energy.total": np.array(1.0)}, None),
        Refinement(16, Status.CONVERGED, 1e-3, 1.0 / 3.0, {"forces.start": np.arange(3.0) / 7.0}, {"x": np.array(0.1)}),
    ),
    "left": Left(0.5, None), "branch": Branch.SLID, "quadrature_error": 1e-12, "nonconvex": 0.25,
    "forces_why": "taut",
    "minima": Minima((1.0, 2.0), 2.0, 8, 3, False), "solver": "Newton, dense", "moved": 1.0 / 3.0,
    "options": {"max_iter": 3, "mu_strategy": "adaptive"}, "active_bounds": 2, "iterations": 7,
}  # fmt: skip


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(Equilibrium) if field.name != "problem"])
def test_every_field_is_kept(found, name):
    state = replace(found, **{name: OTHERS[name]}) if name in OTHERS else found
    again = archive.unpack(archive.pack(state), state.problem)
    for field in dataclasses.fields(Equilibrium):
        ours = getattr(state, field.name)
        ours = {"value": 3} if field.name == name == "evaluations" else ours
        assert same(ours, getattr(again, field.name)), field.name


def test_a_new_field_is_kept_or_refused(found):
    """A field that the class gets tomorrow is written and read too; one that cannot be written is named."""
    more = dataclasses.make_dataclass(
        "More", [("extra", tuple[float, ...], dataclasses.field(default=())), ("what", object, None)],
        bases=(Equilibrium,), frozen=True,
    )  # fmt: skip
    values = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    state = more(**values, extra=(1.0, 2.0))
    arrays = archive.pack(state)
    assert archive.unpack(arrays, found.problem, more).extra == (1.0, 2.0)
    with pytest.raises(KeyError, match="extra"):
        archive.unpack(archive.pack(found), found.problem, more)
    with pytest.raises(TypeError, match="what"):
        archive.pack(more(**values, what=object()))


@pytest.mark.parametrize("name", ["status", "energy", "x", "seconds", "refinements"])
def test_what_is_damaged_is_no_state(found, name):
    arrays = archive.pack(found)
    text = str(arrays["about"])
    arrays["about"] = np.array(text.replace(f'"{name}"', '"else"', 1))
    arrays.pop(name, None)
    with pytest.raises((KeyError, TypeError, ValueError)):
        archive.unpack(arrays, found.problem)


def test_a_result_says_what_found_it(found):
    """Newton, on finer segments too; Ipopt only where it was called; nothing where it was known."""
    assert found.solver == "Newton"
    finer = refine(found)
    assert (finer.solver, finer.options) == ("Newton", {})
    assert "Ipopt" not in finer.message
    judged = solve(
        found.problem.strip, Clamp(), Gravity((1, 0, 0)), segments=6, solver="ipopt", options={"max_iter": 200}
    )
    assert (judged.solver, judged.options["max_iter"]) == ("Ipopt", 200)
    flat = solve(Strip(1.0, 0.1), Clamp(), end=Clamp((0.0, 0.0, 1.0)), segments=4)
    assert (flat.ok, flat.solver, flat.options) == (True, "none", {})
    assert set(LINEAR_SOLVERS) == set(SOLVERS)


def test_what_can_be_false_has_no_default():
    """A solver, the forces of the rows, a wall's penetration: who makes a result has to say them."""
    given = {field.name for field in dataclasses.fields(Equilibrium) if field.default is not dataclasses.MISSING}
    given |= {
        field.name for field in dataclasses.fields(Equilibrium) if field.default_factory is not dataclasses.MISSING
    }
    assert not given & {"solver", "rows", "penetration", "options", "stable", "status", "residual"}
