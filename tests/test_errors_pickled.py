"""Every error that is made of parts comes through a process whole: type, line and parts."""

from __future__ import annotations

import ast
import pickle

import pytest

from ribbon.errors import NotDifferentiable, RibbonInputError
from ribbon.solvers.cyipopt_api import IpoptMissing
from ribbonbench.errors import BadInput, Missing, ShellMissing
from shellref.inputs import ShellInputError
from tests.test_setup import ROOT

ERRORS = (
    BadInput("strip.width", -1.0, "is not above 0", "take a width"),
    BadInput("--out"),
    Missing("dolfinx", "run `make setup`"),
    Missing("dolfinx", ""),
    ShellMissing(Missing("dolfinx", "run `make setup`"), "a scene", "a state"),
    RibbonInputError("width", -1.0, "must be above 0"),
    NotDifferentiable("saddle", "the state is a saddle"),
    IpoptMissing("numpy", "built for another NumPy"),
    ShellInputError("width", -1.0, "must be above 0"),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: f"{type(error).__name__}: {error}")
def test_an_error_is_pickled_whole(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_none_is_left_out():
    """Exceptions with a constructor of their own, in all sources; private ones never leave their module."""
    made = set()
    for package in ("ribbon", "shellref", "compare", "ribbonbench"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and any(_is_error(base) for base in node.bases):
                    own = {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
                    if "__init__" in own and not node.name.startswith("_"):
                        made.add(node.name)
    assert made == {type(error).__name__ for error in ERRORS}


def _is_error(base: ast.expr) -> bool:
    name = ast.unparse(base).rpartition(".")[2]
    return name.endswith(("Error", "Exception", "Missing"))
