r"""Equilibrium of the planar elastica as one square system G(z, t) = 0 along a way of problems.

z = (coefficients of theta (N,), reactions R_j (m,)); t: parameter of the `LoadPath`. With the forms of
`shellref.elastica` and B_j = int <t_perp, n_j> v, the rows are (docs/theory.md, eq. (8.5))

    free unknown of theta    int (theta' - K) v' + <t_perp, p> v ,   p = Gamma (1 - s) u - F - sum_j R_j n_j
    given unknown            theta - its angle
    held direction j         <n_j, r(1) - end>

    dG/dz = [[ A, -B^T ], [ B, 0 ]]   (A: tangent, the rows of given unknowns replaced by those of the identity)

Every row is affine in the data of the problem, and these in t: dG/dt = G(z, 1) - G(z, 0) exactly.

**Stability.** Stable when A is positive on the v with v = 0 where theta is given and B v = 0: the lowest eigenvalues
of A v = lambda M v there, M the L2 product (theory sheet, section 6). A lowest eigenvalue within its rounding
(`Discretisation.rounding`) is that of a fold or a bifurcation: neither stable nor unstable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from shellref.elastica.fem import Discretisation
from shellref.elastica.problem import Array, ElasticaForces, ElasticaProblem, LoadPath

MOST_DENSE = 260
"""Number of unknowns up to which eigenvalues are computed with dense matrices."""

EIGENVALUES = 3
"""How many of the lowest eigenvalues are followed along a path."""


@dataclass(frozen=True)
class Solved:
    """Newton's end: z (N + m,), or None when it failed, norm of what is left, iterations, corrections' sizes."""

    z: Array | None
    norm: float
    iterations: int


class System:
    """One discretisation along one way."""

    def __init__(self, nodes: Array, degree: int, way: LoadPath, hermite: bool = False) -> None:
        problem = way.last
        self.way = way
        self.discrete = Discretisation(nodes, degree, problem.start_angle, problem.end_angle, hermite)
        self.normals = problem.normals
        self.count = int(self.discrete.basis.N)
        self.size = self.count + len(self.normals)
        # modes are given the sign with which int exp(-2 s) v > 0: the same on every mesh
        self._side = self.discrete.weighted(self.discrete.projected(np.exp(-2.0 * self.discrete.s)))
        keep = np.zeros(self.count)
        keep[self.discrete.free] = 1.0
        self._keep, self._hold = scipy.sparse.diags(keep), scipy.sparse.diags(1.0 - keep)

    def loads(self, z: Array, t: float) -> ElasticaProblem:
        """The problem at t with the support's force at s = 1 among the dead forces."""
        return self.way.at(t).pushed(z[self.count :] @ self.normals)

    def residual(self, z: Array, t: float) -> Array:
        """G, shape (N + m,)."""
        theta, problem = z[: self.count], self.way.at(t)
        rows = self.discrete.balance(theta, problem.pushed(z[self.count :] @ self.normals))
        angles = [a for a in (problem.start_angle, problem.end_angle) if a is not None]
        rows[self.discrete.given] = theta[self.discrete.given] - angles
        if not len(self.normals) or problem.end is None:
            return rows
        return np.concatenate([rows, self.normals @ (self.discrete.reach(theta) - problem.end)])

    def holding(self, z: Array) -> Array:
        """B, shape (m, N)."""
        return self.normals @ self.discrete.sway(z[: self.count])

    def jacobian(self, z: Array, t: float) -> scipy.sparse.csc_matrix:
        """dG/dz, shape (N + m, N + m)."""
        tangent = self._keep @ self.discrete.full_tangent(z[: self.count], self.loads(z, t)) + self._hold
        if not len(self.normals):
            return tangent.tocsc()
        rows = self.holding(z)
        return scipy.sparse.bmat([[tangent, -(self._keep @ rows.T)], [rows, None]], format="csc")

    def rate(self, z: Array) -> Array:
        """dG/dt, the same at every t, shape (N + m,)."""
        return self.residual(z, 1.0) - self.residual(z, 0.0)

    def norm(self, residual: Array) -> float:
        """Out-of-balance moment in D w / l (L2), with the misfits of angles (rad) and of the end (l)."""
        return math.hypot(*self.parts(residual))

    def parts(self, residual: Array) -> tuple[float, float]:
        """The two of `norm`: out-of-balance moment, misfit."""
        moment = self.discrete.moment_norm(residual[self.discrete.free])
        misfit = np.concatenate([residual[self.discrete.given], residual[self.count :]])
        return moment, float(np.linalg.norm(misfit))

    def product(self, u: Array, v: Array) -> float:
        """L2 product of the angles of two z."""
        return self.discrete.product(u[: self.count], v[: self.count])

    def newton(self, z: Array, t: float, tolerance: float, iterations: int = 20, most_turn: float = math.inf) -> Solved:
        """Newton at fixed t from z; None when it does not converge or turns a section by more than `most_turn`."""
        start, z, norm = z, z.copy(), math.inf
        for iteration in range(iterations + 1):
            residual = self.residual(z, t)
            norm = self.norm(residual)
            if not math.isfinite(norm) or self.discrete.turned((z - start)[: self.count]) > most_turn:
                break
            if norm <= tolerance:
                return Solved(z, norm, iteration)
            if iteration < iterations:
                step = solve_sparse(self.jacobian(z, t), residual)
                if step is None:
                    break
                z -= step
        return Solved(None, norm, iteration)

    def eigenpairs(self, z: Array, t: float, count: int = EIGENVALUES) -> tuple[Array, Array]:
        """Lowest eigenvalues (k,) on the constraints, ascending, and their modes (N + m, k) of unit L2 norm."""
        free = self.discrete.free
        loads = self.loads(z, t)
        tangent = self.discrete.tangent(z[: self.count], loads)
        rows = self.holding(z)[:, free]
        count = min(count, len(free) - len(rows))
        if len(free) <= MOST_DENSE:
            values, vectors = dense_pairs(tangent, self.discrete.mass, rows, count)
        else:
            below = -self.discrete.highest_pull(z[: self.count], loads) - 1.0
            values, vectors = sparse_pairs(tangent, self.discrete.mass, rows, count, below)
        modes = np.zeros((self.size, count))
        modes[free] = vectors
        side = self._side @ modes[: self.count]
        return values, np.where(side < 0.0, -1.0, 1.0) * modes

    def rounding(self, z: Array, t: float) -> float:
        """Bound of the rounding of `eigenpairs`' values, in D w / l."""
        return self.discrete.rounding(z[: self.count], self.loads(z, t))

    def forces(self, z: Array, t: float) -> ElasticaForces:
        """Forces and couples on both ends; the couples from the balance of the ends' unknowns (order 2 p)."""
        loads = self.loads(z, t)
        rows = self.discrete.balance(z[: self.count], loads)
        given = set(self.discrete.given.tolist())
        couples = [float(rows[dof]) if int(dof) in given else 0.0 for dof in self.discrete.ends]
        end = loads.force
        start = loads.weight[0] - end[0], loads.weight[1] - end[1]
        return ElasticaForces(start, end, couples[0], couples[1])


def solve_sparse(matrix: scipy.sparse.csc_matrix, rhs: Array) -> Array | None:
    """Solution (n,) of a sparse system; None when the matrix is singular to rounding."""
    try:
        found = scipy.sparse.linalg.splu(matrix).solve(rhs)
    except RuntimeError:  # "Factor is exactly singular"
        return None
    return found if np.all(np.isfinite(found)) else None


def dense_pairs(
    tangent: scipy.sparse.csc_matrix, mass: scipy.sparse.csc_matrix, rows: Array, count: int
) -> tuple[Array, Array]:
    """Lowest pairs of tangent v = lambda mass v on rows v = 0: (k,), (F, k)."""
    a, m = tangent.toarray(), mass.toarray()
    if not len(rows):
        return scipy.linalg.eigh(a, m, subset_by_index=[0, count - 1])
    basis = scipy.linalg.null_space(rows)
    # a straight strip does not feel the direction along it: a row of zeros leaves one dimension more
    values, vectors = scipy.linalg.eigh(basis.T @ a @ basis, basis.T @ m @ basis, subset_by_index=[0, count - 1])
    return values, basis @ vectors


def sparse_pairs(
    tangent: scipy.sparse.csc_matrix, mass: scipy.sparse.csc_matrix, rows: Array, count: int, below: float
) -> tuple[Array, Array]:
    """The same by Lanczos around `below`, a number under every eigenvalue; the rows bordered to the matrices."""
    kept = rows[np.linalg.norm(rows, axis=1) > 1e-13 * math.sqrt(rows.shape[1])] if len(rows) else rows
    if len(kept):
        empty = scipy.sparse.csc_matrix((len(kept), len(kept)))
        tangent = scipy.sparse.bmat([[tangent, kept.T], [kept, None]], format="csc")
        mass = scipy.sparse.block_diag([mass, empty], format="csc")
    factor = scipy.sparse.linalg.splu((tangent - below * mass).tocsc())
    inverse = scipy.sparse.linalg.LinearOperator(tangent.shape, factor.solve)
    start = factor.solve(mass @ np.random.default_rng(0).normal(size=tangent.shape[0]))  # within the constraints
    values, vectors = scipy.sparse.linalg.eigsh(
        tangent, k=count, M=mass, sigma=below, OPinv=inverse, v0=start, which="LM"
    )
    order = np.argsort(values)
    return values[order], vectors[: tangent.shape[0] - len(kept), order]
