"""Residual and condition number of every solver's tangent against its own difficulty: docs/stability.md."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
import numpy as np
import scipy.sparse

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import NullFormatter

from compare.models import solve
from compare.scene import load
from tests.validation import page
from tests.validation.number import Number

COMMAND = ".venv/bin/python -m tests.validation stability_notes"

Measured = list[tuple[float, float, float]]
"""(difficulty, relative residual, condition number)."""


def condition(matrix: np.ndarray) -> float:
    """Of a matrix scaled to a unit diagonal where that has one: what elimination with pivots meets."""
    size = np.sqrt(np.maximum(np.abs(matrix).max(axis=1), 1e-300))
    return float(np.linalg.cond(matrix / size[:, None] / size[None, :]))


def kkt(hessian: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """The matrix of Newton's steps on a constrained problem."""
    return np.block([[hessian, jacobian.T], [jacobian, np.zeros((len(jacobian), len(jacobian)))]])


def ribbon_chained(counts: Sequence[int] = (5, 10, 20, 40, 80)) -> Measured:
    """Against the number of segments: every segment's frame depends on all before it."""
    found = []
    for count in counts:
        state = solve(load("curl_4_3").replace({"model.formulation": "chained", "model.elements": count}))
        e = state.native
        lower, upper = e.problem.bounds()
        free = np.flatnonzero(np.asarray(upper) > np.asarray(lower))
        hessian = np.asarray(e.problem.hessian(e.x))
        found.append((float(count), float(state.residual or 0.0), condition(hessian[np.ix_(free, free)])))
    return found


def ribbon_mixed(counts: Sequence[int] = (5, 10, 20, 40)) -> Measured:
    """Against the number of segments: positions and quaternions at the joints as unknowns."""
    found = []
    for count in counts:
        state = solve(load("curl_4_3").replace({"model.formulation": "mixed", "model.elements": count}))
        e = state.native
        lower, upper = e.problem.bounds()
        free = np.flatnonzero(np.asarray(upper) > np.asarray(lower))
        hessian = scipy.sparse.csr_matrix(e.problem.hessian_matrix(e.x, e.rows)).toarray()[np.ix_(free, free)]
        jacobian = scipy.sparse.csr_matrix(e.problem.jacobian_matrix(e.x)).toarray()[:, free]
        matrix = kkt(hessian, jacobian)
        found.append((float(count), float(state.residual or 0.0), condition(matrix)))
    return found


def elastica() -> Measured:
    """Against the weight Gamma, on 40 graded elements."""
    from shellref.elastica.fem import Discretisation
    from shellref.elastica.solve import ElasticaProblem
    from shellref.elastica.solve import solve as solve_elastica

    found = []
    for gamma in (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7):
        problem = ElasticaProblem(gamma=gamma)
        result = solve_elastica(problem, 40, 2, estimate_error=False)
        discrete = Discretisation(result.nodes, 2)
        theta = result.angle(discrete.s.ravel()).reshape(discrete.s.shape)
        tangent = discrete.tangent(discrete.projected(theta), problem)
        found.append((gamma, result.residual / np.sqrt(gamma), condition(tangent.toarray())))
    return found


def shell() -> Measured:
    """Against w / h: the membrane is (w / h)^2 times stiffer than the bending."""
    from shellref.fenics import dolfinx_api
    from shellref.path.newton import Equilibrium
    from shellref.path.solve import solve as solve_shell
    from shellref.shell.naghdi import NaghdiModel
    from shellref.shell.options import ShellOptions
    from shellref.shell.problem import ShellProblem
    from shellref.shell.strip import build_strip

    dolfinx_api.communicator("self")
    found = []
    for ratio in (1e1, 1e2, 1e3, 1e4, 1e5):
        problem = ShellProblem(
            width=0.1, thickness=0.1 / ratio, poisson=0.3, natural_curvature=(3.0, 3.0), gamma=20.0,
            up=(0.0, 1.0, 0.0), elements=(12, 1),
        )  # fmt: skip
        options = ShellOptions()
        result = solve_shell(problem, options)
        strip = build_strip(problem, options)
        model = NaghdiModel(strip.body, options.stabilisation)
        equilibrium = Equilibrium(model, options)
        s, v = model.nodes.T
        state = np.hstack([result.surface.evaluate(s, v), result.surface.director(s, v)])
        model.set_control(strip.stages[-1].end)
        stress = model.stress(state)
        equilibrium.factor(state, stress, model.force(state, stress))
        indptr, indices, values = equilibrium.matrix.getValuesCSR()
        matrix = scipy.sparse.csr_matrix((values, indices, indptr)).toarray()
        found.append((ratio, float(result.residual["relative"]), condition(matrix)))
    return found


def curve_angle() -> Measured:
    """Against the number of edges: forces are third differences of positions."""
    found = []
    for edges in (25, 50, 100, 200, 400):
        keys = {"model.energy": "curve_angle", "model.elements": edges, "strip.thickness": 5e-4}
        state = solve(load("cantilever").replace(keys))
        at = state.native.found
        lower, upper = at.problem.bounds()
        free = np.flatnonzero(lower < upper)
        hessian = at.problem.hessian_matrix(at.y, at.rows).toarray()[np.ix_(free, free)]
        jacobian = at.problem.jacobian_matrix(at.y).toarray()[:, free]
        found.append((float(edges), float(state.residual or 0.0), condition(kkt(hessian, jacobian))))
    return found


def antman() -> Measured:
    """Against l / h: shear and stretch are (l / h)^2 times stiffer than the bending."""
    from shellref.rod.newton import Balance

    found = []
    for slender in (1e1, 1e2, 1e3, 1e4, 1e5, 1e6):
        rod = {"rod.bending": [1.0, 1.0], "rod.torsion": 1.0, "rod.shear": [slender**2] * 2, "rod.stretch": slender**2}
        state = solve(load("cantilever").replace({"model.energy": "antman", **rod}))
        r = state.native
        balance = Balance(r.elements, r.problem)
        whole, _ = balance.factor(r.state, r.problem, r.elements.stress(r.state, r.problem))
        reduced = (balance.free.T @ whole @ balance.free).toarray()
        found.append((slender, float(state.residual or 0.0), condition(reduced)))
    return found


SOLVERS: dict[str, tuple[str, Callable[[], Measured]]] = {
    "ribbon, chained": ("segments", ribbon_chained),
    "ribbon, mixed": ("segments", ribbon_mixed),
    "elastica": ("Gamma", elastica),
    "shell": ("w / h", shell),
    "curve-angle rod": ("edges", curve_angle),
    "Antman rod": ("l / h", antman),
}


def picture(measured: dict[str, Measured], path: Path) -> None:
    """Residual and condition of every solver, each against its own difficulty."""
    figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.0), layout="constrained")
    for axis, (name, rows) in zip(axes.ravel(), measured.items(), strict=True):
        x, residual, number = np.array(rows).T
        axis.loglog(x, number, "o-", color="C0", label="condition number, scaled")
        axis.loglog(x, np.maximum(residual, 1e-17), "s--", color="C3", label="relative residual")
        axis.set(title=name, xlabel=SOLVERS[name][0], ylim=(1e-17, 1e20))
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.grid(alpha=0.3)
    axes[0, 0].legend(loc="center right", fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


PROBES = {
    "ribbon_chained_5": lambda: ribbon_chained((5,))[0][2],
    "ribbon_mixed_5": lambda: ribbon_mixed((5,))[0][2],
    "ribbon_mixed_20": lambda: ribbon_mixed((20,))[0][2],
}


def numbers(measured: dict[str, Measured]) -> dict[str, Number]:
    """Condition numbers c. A residual r (of rounding at least) leaves c r of the state open, as much of the matrix's
    entries, and c times that of the condition number; where this is all of it, no error is stated."""
    found = {}
    for name, rows in measured.items():
        for at, residual, condition_number in rows:
            left = condition_number**3 * max(residual, float(np.finfo(float).eps))
            known = left < condition_number
            key = f"{name} {at:g}".lower().replace("/", " ")
            found["_".join(re.findall(r"[a-z0-9]+", key))] = Number(
                condition_number, left if known else None, shown=".1e",
                why="" if known else "the residual's bound is larger",
            )  # fmt: skip
    return found


def run(results: Path) -> dict[str, Number]:
    """Writes results/stability/."""
    folder = results / "stability"
    folder.mkdir(exist_ok=True)
    measured = {name: measure() for name, (_, measure) in SOLVERS.items()}
    rows = []
    for name, found in measured.items():
        for at, residual, number in found:
            rows.append([name, f"{SOLVERS[name][0]} = {at:g}", f"{residual:.1e}", f"{number:.1e}"])
    picture(measured, folder / "stability.png")
    page.write(
        folder / "README.md",
        "Residual and condition number of every solver",
        COMMAND,
        "The tangent (KKT matrix where there are constraints) at the solution, its rows and columns scaled by their "
        "largest entry; the residual as the solver measures it. What the code does about it: "
        "[stability](../../docs/stability.md).",
        "![Condition numbers and residuals](stability.png)",
        page.table(["solver", "difficulty", "relative residual", "condition number"], rows),
    )
    return numbers(measured)
