"""The equations of a shell on one mesh over all its unknowns and problems, and their factored tangent.

Unknowns z: positions and directors u (6 at every node, in the order of the grid) and the stress sigma at the Gauss
points. What vanishes in an equilibrium of a problem p is

    dE/du(u; p) on the free increments ,   u - place(p) where the clamps hold ,   |d| - 1 ,   C E(u; p) - sigma

and its tangent at u, sigma is that of the mixed integration point Newton (docs/theory.md, eq. (7.10)): the rows of the
Hellinger-Reissner functional's, combined so that the first ones are those of the displacements alone,

    [ P^T K(sigma) P   0 ]       K(sigma) = int T(u, .) C T(u, .) + sigma . T(., .)
    [ C T(u, .)       -1 ]

Where sigma is the stress of u this is the exact derivative; elsewhere Newton's iteration with it is that of the
functional with stresses, which a thin shell follows over long steps. Directors of any length are read as unit vectors:
increments move them in their tangent planes and along themselves, and a state is brought back by `stepped`
(docs/theory.md, eq. (7.8)).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shellref.inputs import ShellInputError
from shellref.path.newton import Equilibrium
from shellref.shell.body import Control
from shellref.shell.director import FREE, Bases
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Cylinder
from shellref.shell.naghdi import NaghdiModel, Stress
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.strip import Strip, build_strip, strip_grid

#: Membrane strain by which sigma may miss the stress of u and the tangent is that of u's own stress.
OWN = 1e-7
#: Fields of a problem that a model is made of, beside its reference surface; the others are loads and places.
MADE_OF = ("width", "thickness", "poisson", "transverse_curvature")


def refused(problem: ShellProblem) -> str | None:
    """Why a strip's equations are not known here; None: they are."""
    if problem.closed:
        return "is closed: its motion along itself would have to be taken out"
    if problem.touches:
        return "touches something: which places do is not part of its unknowns"
    if problem.partly_held or problem.guided or problem.turns or any(s is not None for s in problem.slide):
        return "has ends of which a part is held: their edges have unknowns of their own"
    if problem.twisted:
        return "carries a moment of fixed direction, whose tangent is not symmetric"
    if problem.transverse_curvature or "free" in problem.sections:
        return "has a section that its clamps carry as a whole: their edges have unknowns of their own"
    if problem.clamp == "free":
        return "is held nowhere: its rigid motions would have to be taken out"
    return None


class Tangent:
    """The factored tangent at a state (nodes, 6); free (nodes,): directors that are."""

    def __init__(self, equilibrium: Equilibrium, state: np.ndarray, bases: Bases, free: np.ndarray) -> None:
        self._equilibrium, self._model, self._state = equilibrium, equilibrium.model, state
        self._bases, self._free, self._held = bases, free, equilibrium.increments.held

    def _parts(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What of u (nodes, 6) is held, and what is along the free directors."""
        held = np.where(self._held, b, 0.0)
        d = self._state[:, 3:]
        along = np.zeros_like(b)
        along[:, 3:] = np.where(self._free, np.einsum("ni,ni->n", d, b[:, 3:]), 0.0)[:, None] * d
        return held, along

    def _turning(self, field: np.ndarray) -> np.ndarray:
        """The field (nodes, 6) without what is along directors: all that strains see of it."""
        d = self._state[:, 3:]
        out = field.copy()
        out[:, 3:] -= np.einsum("ni,ni->n", d, field[:, 3:])[:, None] * d
        return out

    def _solved(self, right: np.ndarray) -> np.ndarray:
        """P (P^T K P)^-1 P^T right (nodes, 6)."""
        return self._equilibrium.back(right, self._bases)

    def _strained(self, step: np.ndarray) -> Stress:
        """C T(u, step)."""
        change, own = self._model.stress(self._state, step), self._model.stress(self._state)
        return Stress(change.full - own.full, change.reduced - own.reduced)

    def solve(self, right: np.ndarray, beta: Stress) -> tuple[np.ndarray, Stress]:
        """Its inverse times forces (nodes, 6) and stresses."""
        held, along = self._parts(right)
        turning = self._turning(held)
        stiff = self._equilibrium.linear.stiff(turning) if held.any() else 0.0
        moved = self._solved(right - stiff)
        change = self._strained(moved + turning)
        return moved + held + along, Stress(change.full - beta.full, change.reduced - beta.reduced)

    def solve_transposed(self, right: np.ndarray, beta: Stress) -> tuple[np.ndarray, Stress]:
        """The inverse of its transpose times the same."""
        pulled = self._pulled(beta) if beta.full.any() or beta.reduced.any() else np.zeros_like(right)
        held, along = self._parts(right)
        moved = self._solved(right + pulled)
        stiff = self._equilibrium.linear.stiff(moved)
        held = held + np.where(self._held, self._turning(pulled - stiff), 0.0)
        return moved + held + along, Stress(-beta.full, -beta.reduced)

    def _pulled(self, beta: Stress) -> np.ndarray:
        """(C T(u, .))^T beta, (nodes, 6)."""
        model = self._model
        law, alpha = model.law(), model.alpha[:, None, None]
        full, reduced = (
            part / (weights / model.body.normaliser)[..., None]
            for part, weights in zip((beta.full, beta.reduced), model.weights, strict=True)
        )
        full, reduced = full @ law, (1.0 - alpha) * (reduced @ law[3:, 3:])
        full[..., 3:] *= alpha
        return model.internal(self._state, Stress(full, reduced))


class Equations:
    """The shell of a problem, and of others on the same mesh; every element cut in refine (along, across)."""

    def __init__(self, problem: ShellProblem, options: ShellOptions, refine: tuple[int, int] = (1, 1)) -> None:
        """ShellInputError for a problem of which the equations are not known."""
        why = refused(problem)
        if why is not None:
            raise ShellInputError("problem", None, why)
        self.options, self.refine, self.problem = options, refine, problem
        self._width, self.grid = problem.width, strip_grid(problem, refine)
        self._build(self._strip(problem))
        self._tangent: Tangent | None = None

    # -- the problem ---------------------------------------------------------------------------------------------------

    def _strip(self, problem: ShellProblem) -> Strip:
        grid = Grid(self.grid.s_knots, problem.width / self._width * self.grid.v_knots, self.grid.degree)
        return build_strip(problem, self.options, self.refine, grid)

    def _build(self, strip: Strip) -> None:
        self.model = NaghdiModel(strip.body, self.options.stabilisation, None, self.options.engine)
        self.equilibrium = Equilibrium(self.model, self.options)
        self.held = self.equilibrium.increments.held
        self._free = self.equilibrium.increments.directors == FREE
        self._order = self.model.grid.order(self.model.nodes).ravel()
        along, across = self.model.grid.elements
        cells = self.model.midpoints
        i = np.searchsorted(self.model.grid.s_knots, cells[:, 0]) - 1
        self._cells = np.empty(along * across, dtype=np.int64)
        self._cells[i * across + np.searchsorted(self.model.grid.v_knots, cells[:, 1]) - 1] = np.arange(len(cells))
        none = self.model.no_stress()
        self._shapes = none.full.shape, none.reduced.shape
        self._placed(strip)

    def _placed(self, strip: Strip) -> None:
        """Loads and places of a strip on the present model."""
        control = strip.stages[-1].end if strip.stages else Control(1.0, 0.0, 0.0, 0.0)
        self.model.set_control(control._replace(natural=1.0))
        placement = self.model.body.supports(self.model.grid, self.model.nodes).placement
        self.place = self.model.reference if placement is None else placement(control.move)

    def set_problem(self, problem: ShellProblem) -> None:
        """What is asked from now on is asked of this problem. ShellInputError for one that does not fit the mesh."""
        if problem == self.problem:
            return
        why = refused(problem)
        if why is not None:
            raise ShellInputError("problem", None, why)
        strip = self._strip(problem)
        if self._same_model(problem, strip):
            self.model.load(strip.body)
            self._placed(strip)
        else:
            self._build(strip)
        self.problem = problem

    def _same_model(self, problem: ShellProblem, strip: Strip) -> bool:
        same = all(getattr(problem, name) == getattr(self.problem, name) for name in MADE_OF)
        flat = isinstance(strip.body.surface, Cylinder) and isinstance(self.model.body.surface, Cylinder)
        return same and flat

    # -- unknowns ------------------------------------------------------------------------------------------------------

    @property
    def nodes(self) -> int:
        """How many."""
        return len(self._order)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 6 * self.nodes + sum(int(np.prod(shape)) for shape in self._shapes)

    def split(self, z: np.ndarray) -> tuple[np.ndarray, Stress]:
        """u (nodes, 6) and sigma of z (size,), in the model's order."""
        u = np.empty((self.nodes, 6))
        u[self._order] = z[: 6 * self.nodes].reshape(-1, 6)
        found, at = [], 6 * self.nodes
        for shape in self._shapes:
            count = int(np.prod(shape))
            part = np.empty(shape)
            part[self._cells] = z[at : at + count].reshape(shape)
            found.append(part)
            at += count
        return u, Stress(*found)

    def joined(self, u: np.ndarray, stress: Stress) -> np.ndarray:
        """z (size,) of u (nodes, 6) and sigma."""
        return np.concatenate([u[self._order].ravel(), stress.full[self._cells].ravel(),
                               stress.reduced[self._cells].ravel()])  # fmt: skip

    def weights(self) -> np.ndarray:
        """(size,) M of z^T M z: mean over the surface of the square of what positions that are free move."""
        mass = np.zeros((self.nodes, 6))
        mass[:, :3] = (self.model.nodal_areas / self.model.nodal_areas.sum())[:, None]
        mass[self.held] = 0.0
        return self.joined(mass, self.model.no_stress())

    def held_rows(self) -> np.ndarray:
        """(rows, columns, 6) 1 where a clamp holds, on the grid."""
        return self.held[self._order].astype(float)

    def at_rest(self, u: np.ndarray) -> np.ndarray:
        """z (size,) of positions and directors (rows, columns, 6) on the grid, without stress."""
        z = self.joined(np.zeros((self.nodes, 6)), self.model.no_stress())
        z[: 6 * self.nodes] = u.ravel()
        return z

    def own(self, z: np.ndarray) -> np.ndarray:
        """z with the stress of its own positions and directors."""
        u, _ = self.split(z)
        state = self._unit(u)
        return self.joined(state, self.model.stress(state))

    @staticmethod
    def _unit(u: np.ndarray) -> np.ndarray:
        state = u.copy()
        state[:, 3:] /= np.linalg.norm(u[:, 3:], axis=1)[:, None]
        return state

    # -- equations -----------------------------------------------------------------------------------------------------

    def residual(self, z: np.ndarray) -> np.ndarray:
        """What vanishes (size,)."""
        u, sigma = self.split(z)
        state = self._unit(u)
        stress = self.model.stress(state)
        increments = self.equilibrium.increments
        bases = increments.bases(state, self.model.control)
        out = increments.expand(increments.reduce(self.model.force(state, stress), bases), bases)
        long = np.linalg.norm(u[:, 3:], axis=1) - 1.0
        out[:, 3:] += np.where(self._free, long, 0.0)[:, None] * state[:, 3:]
        out[self.held] = (u - self.place)[self.held]
        return self.joined(out, Stress(stress.full - sigma.full, stress.reduced - sigma.reduced))

    def factor(self, z: np.ndarray) -> int:
        """Factorises the tangent at z for `solve` and `solve_transposed`, also behind another problem; its number of
        negative eigenvalues. petsc_api.FactorisationFailed."""
        u, sigma = self.split(z)
        state = self._unit(u)
        stress = self.model.stress(state)
        missed = max(np.abs(sigma.full[..., 3:6] - stress.full[..., 3:6]).max(), np.abs(
            sigma.reduced[..., :3] - stress.reduced[..., :3]).max())  # fmt: skip
        used = stress if missed * self.problem.thickness**2 / 12.0 <= OWN else sigma
        bases = self.equilibrium.factor(state, used, self.model.force(state, used))
        self._tangent = Tangent(self.equilibrium, state, bases, self._free)
        negative, zero, _ = self.equilibrium.factors.inertia()
        return int(negative + zero)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """The inverse of the tangent factored last times b (size,)."""
        assert self._tangent is not None
        return self.joined(*self._tangent.solve(*self.split(b)))

    def solve_transposed(self, b: np.ndarray) -> np.ndarray:
        """The inverse of its transpose times b (size,)."""
        assert self._tangent is not None
        return self.joined(*self._tangent.solve_transposed(*self.split(b)))

    def stepped(self, z: np.ndarray, dz: np.ndarray) -> np.ndarray:
        """z + dz with unit directors."""
        u, sigma = self.split(z + dz)
        return self.joined(self._unit(u), sigma)

    def energy(self, z: np.ndarray) -> float:
        """Elastic energy, less the work of loads, D w / l."""
        u, _ = self.split(z)
        return float(self.model.energies(self._unit(u)).total)

    def noise(self) -> float:
        """What rounding of positions and directors leaves out of balance in this shell: the norm of its residual, D w /
        l^2, at rest, every number wrong by half of its last bit."""
        wrong = np.finfo(float).eps * np.random.default_rng(0).uniform(-1.0, 1.0, self.model.reference.shape)
        state = self.model.reference + wrong
        force = self.model.internal(state, self.model.stress(state))
        increments = self.equilibrium.increments
        reduced = increments.reduce(force, increments.bases(self.model.reference, self.model.control))
        return float(np.linalg.norm(reduced))

    def described(self) -> dict[str, Any]:
        """What another process needs to know."""
        return {
            "size": self.size,
            "nodes": [len(self.grid.s_nodes), len(self.grid.v_nodes)],
            "degree": self.grid.degree,
            "noise": self.noise(),
            "unknowns": self.equilibrium.unknowns,
        }
