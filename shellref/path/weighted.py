"""The error of an asked quantity of a shell, by residuals weighted with its adjoint (Becker & Rannacher 2001).

Becker & Rannacher, doi:10.1017/S0962492901000010; adjoint: docs/theory.md, eq. (7.18). Asked: the position of the
centreline's end or middle, or the total energy. Meshes are products of columns (along) and rows (across), so there are
two questions, each answered on the mesh that is cut in two in that direction alone: how far is the quantity from the
one of the cut mesh, and which columns (rows) does that come from.

How far: the state is lifted to the cut mesh (cubic splines through the nodes, which reduced integration makes far more
accurate than what lies between them), membrane and shear strains are carried over from the reduced points, where alone
they are true. With these in the geometric stiffness, K z = dJ/du is solved there: J - J_h = -R(u) z. A lifted state's
own membrane stress would be wrong by (w/h)^2 and its tangent indefinite. Where the inertia of that tangent is not that
of the state, the mesh is too coarse for one linear step: the sum of the indicators stands for the estimate.

Where from: the stationary functional of the mixed form (membrane and shear strains e beside u, their adjoints t beside
z), cell by cell, of the fields on the mesh with its own adjoint, less that of the lifted ones. The fields agree at the
nodes of the mesh, so nothing is exchanged between columns, and no mismatch of membrane strains is multiplied by
(1/h)^2: it meets the adjoint's stress.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as petsc
from shellref.inputs import ShellInputError
from shellref.kernels import lagrange
from shellref.path.solver import Solver
from shellref.shell.body import Stage
from shellref.shell.director import retract
from shellref.shell.grid import Grid
from shellref.shell.naghdi import BENDING, NaghdiModel, Stress
from shellref.shell.result import ShellResult
from shellref.shell.strip import build_strip

#: Degree of the splines through the nodes.
SMOOTH = 3
#: Where on the centreline the asked position is (S).
PLACES = {"end": 1.0, "middle": 0.5}


class Thin(NamedTuple):
    """Membrane and shear strains (cells, points, 5) at the points of the full and of the reduced rule."""

    full: np.ndarray
    reduced: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """Of one direction: change (m,) of the asked quantity when every column (row) is cut in two; indicators (n, m): of
    each column (row); sharp: the change is that of the adjoint on the cut mesh, not the sum of the indicators.

    m is 3 for a position (units l), 1 for the energy (D w / l).
    """

    change: np.ndarray
    indicators: np.ndarray
    sharp: bool

    @property
    def size(self) -> float:
        """|change|."""
        return float(np.linalg.norm(self.change))

    @property
    def each(self) -> np.ndarray:
        """(n,) |indicator|."""
        return np.asarray(np.linalg.norm(self.indicators, axis=1))


def check(solver: Solver) -> None:
    """Raises ShellInputError where the asked quantity has no estimate."""
    goal, why = solver.options.goal, solver.strip.problem.without_goal(solver.options.goal)
    if why is not None:
        raise ShellInputError("goal", goal, f"{why}: ask for another one, or for the surface")
    if solver.model.cells is None:
        raise ShellInputError("goal", goal, "needs the compiled elements: one process and engine = kernels")


def last_stage(solver: Solver) -> Stage:
    """The stage at whose end the result is, its controls set."""
    stages, model = solver.strip.stages, solver.model
    stage = stages[-1] if stages else Stage("start", model.control, model.control)
    model.set_control(stage.at(1.0))
    return stage


def centre_weights(model: NaghdiModel, place: float) -> np.ndarray:
    """(nodes,) with which the nodes give the centreline at S = place (v = 0)."""
    grid, k = model.grid, model.grid.degree
    shares = []
    for knots, x in ((grid.s_knots, place), (grid.v_knots, 0.0)):
        i = int(np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2))
        share = np.zeros(k * (len(knots) - 1) + 1)
        at = (x - knots[i]) / (knots[i + 1] - knots[i])
        share[k * i : k * i + k + 1] = lagrange.values(k, np.array(at))
        shares.append(share)
    return model.from_grid(np.multiply.outer(*shares)[..., None])[:, 0]


def lifted(coarse: NaghdiModel, fine: NaghdiModel, field: np.ndarray) -> np.ndarray:
    """A nodal field (nodes, 6) on the nodes of a finer mesh: splines along S and along v where there are new nodes."""
    values = coarse.on_grid(field)
    old, new = coarse.grid, fine.grid
    for axis, (a, b) in enumerate(((old.s_nodes, new.s_nodes), (old.v_nodes, new.v_nodes))):
        if len(a) != len(b):
            degree = SMOOTH if len(a) > SMOOTH else 1
            values = make_interp_spline(a, values, k=degree, axis=axis)(b)
    return fine.from_grid(values)


def _parents(grid: Grid, midpoints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Column and row of the grid in which each midpoint (cells, 2) lies."""
    columns, rows = np.searchsorted(grid.s_knots, midpoints[:, 0]), np.searchsorted(grid.v_knots, midpoints[:, 1])
    return columns - 1, rows - 1


def carried(coarse: NaghdiModel, fine: NaghdiModel, reduced: np.ndarray) -> Thin:
    """Strains known at the reduced points of a mesh (cells, k^2, 5), polynomials of degree k - 1 in each direction
    through them, at the points of a finer one."""
    k, grid = coarse.grid.degree, coarse.grid
    number = np.empty(grid.elements, dtype=int)
    number[_parents(grid, coarse.midpoints)] = np.arange(len(coarse.midpoints))
    i, j = _parents(grid, fine.midpoints)
    size = np.stack([np.diff(grid.s_knots)[i], np.diff(grid.v_knots)[j]], axis=1)[:, None]
    corner = np.stack([grid.s_knots[i], grid.v_knots[j]], axis=1)[:, None]

    def monomials(x: np.ndarray) -> np.ndarray:
        return np.stack([x[..., 0] ** a * x[..., 1] ** b for a in range(k) for b in range(k)], axis=-1)

    points, _ = api.gauss_rule(coarse.degrees[1])
    coefficients = np.einsum("mq,cqx->cmx", np.linalg.inv(monomials(points)), reduced)[number[i, j]]
    full, short = (monomials((p - corner) / size) @ coefficients for p in fine.gauss_points)
    return Thin(full, short)


def own_strains(model: NaghdiModel, state: np.ndarray, step: np.ndarray | None = None) -> Thin:
    """The membrane and shear strains of a state, or linearised along a step from it."""
    full, reduced = model.strains(state, step)
    return Thin(full[..., BENDING.stop :], reduced)


def own_changes(model: NaghdiModel, state: np.ndarray, field: np.ndarray) -> Thin:
    """Those of T(u, z)."""
    assert model.cells is not None
    full, reduced = model.cells.strains(state, field, 0.0)
    return Thin(full[..., BENDING.stop :], reduced)


def load_work(model: NaghdiModel, field: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """(cells,) work of the weight and of a force per length of the end edge (3,) along a field (nodes, 6), over the
    normaliser."""
    cells, control = model.cells, model.control
    assert cells is not None
    shape, _, weights = cells.rules[0]
    here = field[cells.nodes][..., :3]
    out = control.weight * np.einsum("cn,cni,i->c", weights @ shape[:, 0], here, model.weight)
    last = cells.along == model.grid.elements[0] - 1  # whose last nodes are on the edge; Gauss-Lobatto rule
    share = lagrange.lobatto(cells.degree)[1] * model.sizes[last, 1:] / model.body.normaliser
    out[last] += control.load * np.einsum("cj,cji,i->c", share, here[last][:, -(cells.degree + 1) :], tip)
    return np.asarray(out)


def _both(model: NaghdiModel, one: Thin, other: Thin) -> np.ndarray:
    """(cells,) of one : C : other over both rules with their shares."""
    law, out = model.law()[BENDING.stop :, BENDING.stop :], np.zeros(len(model.midpoints))
    for share, weights, a, b in zip((model.alpha, 1.0 - model.alpha), model.weights, one, other, strict=True):
        out += share * np.einsum("cqi,cqi,cq->c", a @ law, b, weights)
    return out / model.body.normaliser


def _bent(model: NaghdiModel, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(cells,) of bending strains."""
    law = model.law()[BENDING, BENDING]
    return np.einsum("cqi,cqi,cq->c", one @ law, other, model.weights[0]) / model.body.normaliser


def weighed(model: NaghdiModel, state: np.ndarray, z: np.ndarray, e: Thin, t: Thin) -> np.ndarray:
    """(cells,) of kap:C:T(u, z) + e:C:T(u, z) + t:C:(E(u) - e), the mixed form's residual but for the loads:
    docs/theory.md, eq. (7.20)."""
    assert model.cells is not None
    bent, turned = model.strains(state)[0][..., BENDING], model.cells.strains(state, z, 0.0)[0][..., BENDING]
    actual = own_strains(model, state)
    left = Thin(actual.full - e.full, actual.reduced - e.reduced)
    return _bent(model, bent, turned) + _both(model, e, own_changes(model, state, z)) + _both(model, t, left)


def mixed_energy(model: NaghdiModel, state: np.ndarray, e: Thin) -> np.ndarray:
    """(cells,) of 1/2 kap:C:kap + e:C:(E(u) - e/2), Hellinger and Reissner's functional but for the loads:
    docs/theory.md, eq. (7.21)."""
    bent = model.strains(state)[0][..., BENDING]
    actual = own_strains(model, state)
    left = Thin(actual.full - 0.5 * e.full, actual.reduced - 0.5 * e.reduced)
    return 0.5 * _bent(model, bent, bent) + _both(model, e, left)


def stress_with(model: NaghdiModel, state: np.ndarray, e: Thin) -> Stress:
    """The stress of a state's bending and of these membrane and shear strains."""
    full = model.strains(state)[0]
    full[..., BENDING.stop :] = e.full
    return model._stress_of(full, e.reduced)


class Weighted:
    """The estimates of one result: its mesh, its adjoints, and for each direction the mesh cut in two."""

    def __init__(self, result: ShellResult, solver: Solver):
        """solver: of the result's mesh. Raises ShellInputError as `check`."""
        check(solver)
        self.result, self.solver = result, solver
        self.goal = solver.options.goal
        self._tip = np.array(solver.strip.problem.tip or (0.0, 0.0, 0.0))
        self.stage = last_stage(solver)
        model, equilibrium = solver.model, solver.equilibrium
        self.state = equilibrium.target(self.stage, 1.0, solver.state_of(result.surface))
        self.thin = own_strains(model, self.state)
        self.adjoints: list[np.ndarray] = []
        self.factorisations = 0
        if self.goal != "energy":
            equilibrium.factor_at(self.state, self.stage, 1.0)
            self.factorisations = 1
            weights = centre_weights(model, PLACES[self.goal])
            self.adjoints = [equilibrium.back(unit, equilibrium.last_bases) for unit in units(weights)]

    def direction(self, axis: int) -> Estimate:
        """Along (0) or across (1). Raises petsc_api.FactorisationFailed where the cut mesh's tangent is singular."""
        solver = self.solver
        strip = build_strip(
            solver.strip.problem, solver.options, grid=solver.model.grid.refined(*((2, 1), (1, 2))[axis])
        )
        finer = Solver(strip, solver.options, solver.comm, lambda event: None)
        stage = last_stage(finer)
        state = lifted(solver.model, finer.model, self.state)
        state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1)[:, None]
        state = finer.equilibrium.target(stage, 1.0, state)
        thin = carried(solver.model, finer.model, self.thin.reduced)
        indicators = self._indicators(finer, axis, state, thin)
        try:
            change = self._change(finer, stage, state, thin)
        except petsc.FactorisationFailed:
            change = None
        self.factorisations += finer.equilibrium.factorisations
        if change is None:
            return Estimate(indicators.sum(axis=0), indicators, False)
        return Estimate(change, indicators, True)

    def _change(self, finer: Solver, stage: Stage, state: np.ndarray, thin: Thin) -> np.ndarray | None:
        """(m,) -R(u) z (docs/theory.md, eq. (7.19)), or of the energy after one step; None: another inertia."""
        model, equilibrium = finer.model, finer.equilibrium
        stress, residual = stress_with(model, state, thin), model.residual(state)
        bases = equilibrium.factor(state, stress, model.force(state, stress))
        if equilibrium.factors.inertia()[0] != (self.result.negative_eigenvalues or 0):
            return None
        if self.goal == "energy":
            step = -equilibrium.back(residual, bases)
            after = own_strains(model, state, step)
            there = self._energy(model, retract(state, step), after).sum()
            return np.array([there - self._energy(self.solver.model, self.state, self.thin).sum()])
        weights, before = centre_weights(model, PLACES[self.goal]), centre_weights(self.solver.model, PLACES[self.goal])
        moved = weights @ state[:, :3] - before @ self.state[:, :3]
        free = np.where(equilibrium.held, 0.0, residual)
        return moved - np.array([np.sum(equilibrium.back(unit, bases) * free) for unit in units(weights)])

    def _indicators(self, finer: Solver, axis: int, state: np.ndarray, thin: Thin) -> np.ndarray:
        """(n, m) of the columns or rows."""
        model, fine = self.solver.model, finer.model
        grid = model.grid
        here, there = (_parents(grid, x.midpoints)[axis] for x in (model, fine))
        out = np.zeros((grid.elements[axis], max(1, len(self.adjoints))))
        if self.goal == "energy":
            np.add.at(out[:, 0], there, self._energy(fine, state, thin))
            np.add.at(out[:, 0], here, -self._energy(model, self.state, self.thin))
        for m, z in enumerate(self.adjoints):
            t = own_changes(model, self.state, z)
            up = np.where(finer.equilibrium.held, 0.0, lifted(model, fine, z))
            up[:, 3:] -= np.sum(up[:, 3:] * state[:, 3:], axis=1)[:, None] * state[:, 3:]
            lifted_t = carried(model, fine, t.reduced)
            np.add.at(out[:, m], there, self._work(fine, up) - weighed(fine, state, up, thin, lifted_t))
            np.add.at(out[:, m], here, weighed(model, self.state, z, self.thin, t) - self._work(model, z))
        return out

    def _work(self, model: NaghdiModel, field: np.ndarray) -> np.ndarray:
        return load_work(model, field, self._tip)

    def _energy(self, model: NaghdiModel, state: np.ndarray, e: Thin) -> np.ndarray:
        return mixed_energy(model, state, e) - self._work(model, state)


def units(weights: np.ndarray) -> list[np.ndarray]:
    """dJ/du (nodes, 6) of the three components of a position that nodes give with these weights."""
    found = []
    for component in range(3):
        unit = np.zeros((len(weights), 6))
        unit[:, component] = weights
        found.append(unit)
    return found
