"""One equilibrium of the discrete shell at fixed load: Newton on the 5-component unknowns, inertia, relaxation.

The reduced tangent is P^T K P + constraint curvature (see director.py), over the free nodes only: held unknowns are not
in it, so its inertia counts the unstable directions of the clamped shell. It is factored as L D L^T (MUMPS).

Mixed integration point Newton: at state u_j with stress sigma_j (an unknown of its own) solve

    [ int T(u_j, .) C T(u_j, .) + sigma_j . T(., .) ] du = -dE/du(u_j) ,    sigma_{j+1} = C (E(u_j) + T(u_j, du))

so the right-hand side, and the solution, are Newton's; only the geometric stiffness differs on the way.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellref import director
from shellref import dolfinx_api as api
from shellref.clamps import held_nodes
from shellref.naghdi import NaghdiModel, Stress
from shellref.problem import ShellOptions

LARGEST_CORRECTION = 3.0  # a larger component (in l, or radians) is a failed solve


@dataclass
class Attempt:
    """What a Newton solve came to; `negative` is the inertia of the last tangent, one correction before the state."""

    converged: bool
    state: np.ndarray
    stress: Stress
    iterations: int
    correction: float
    negative: int | None


class Equilibrium:
    """Newton, inertia and relaxation for one model; counts factorisations and seconds by part."""

    def __init__(self, model: NaghdiModel, options: ShellOptions):
        self.model, self.options = model, options
        self.held = held_nodes(model.nodes, model.problem.clamp)
        self.free = np.flatnonzero(~self.held).astype(np.int32)
        self.unknowns = 5 * len(self.free)
        self.iterations = self.factorisations = 0
        self.seconds: dict[str, float] = {}
        self._full = model.create_tangent()
        self._projection: Any = None
        self._reduced: Any = None
        self._factor: Any = None
        self.mass = self._lumped_mass()

    def _lumped_mass(self) -> np.ndarray:
        """Diagonal (unknowns,) of the mass matrix for areal mass 1, divided by w, with rotary inertia h^2 / 12."""
        nodal = self.model.grid.nodal_areas(self.model.nodes)[self.free] / self.model.width
        rotary = self.model.problem.thickness**2 / 12.0
        return np.stack([nodal, nodal, nodal, rotary * nodal, rotary * nodal], axis=1).ravel()

    def _spend(self, part: str, seconds: float) -> None:
        self.seconds[part] = self.seconds.get(part, 0.0) + seconds

    def reduced_residual(self, state: np.ndarray) -> np.ndarray:
        """P^T dE/du on the free unknowns (unknowns,)."""
        return director.reduce_vector(self.model.residual(state), director.tangent_bases(state[:, 3:]), self.free)

    def factor(self, state: np.ndarray, stress: Stress, force: np.ndarray, shift: float = 0.0) -> np.ndarray:
        """Factorise the reduced tangent + shift * mass; force (nodes, 6) = int stress . T(u, .) + weight.

        Returns the tangent bases (nodes, 3, 2) of its unknowns.
        """
        start = time.perf_counter()
        self.model.tangent(self._full, state, stress)
        tangent = time.perf_counter()
        bases = director.tangent_bases(state[:, 3:])
        csr = director.projection_csr(bases, self.free)
        if self._projection is None:
            self._projection = api.sparse_matrix((6 * len(state), self.unknowns), csr)
            self._reduced = self._full.ptap(self._projection)
            self._factor = api.SymmetricFactor(self._reduced)
        else:
            api.refill(self._projection, csr)
            self._full.ptap(self._projection, result=self._reduced)
        diagonal = director.as_rotation_diagonal(director.constraint_curvature(state, force, self.free))
        api.add_diagonal(self._reduced, diagonal + shift * self.mass)
        reduced = time.perf_counter()
        self._factor.factor()
        self.factorisations += 1
        for part, spent in (("tangent", tangent - start), ("reduce", reduced - tangent)):
            self._spend(part, spent)
        self._spend("factor", time.perf_counter() - reduced)
        return bases

    def solve(self, state: np.ndarray, stress: Stress | None = None) -> Attempt:
        """Newton from `state` (with a stress of its own, when mixed) to equilibrium at the model's load."""
        mixed = self.options.iteration == "mixed"
        stress = stress or self.model.stress(state)
        correction, negative = np.inf, None
        for iteration in range(1, self.options.max_newton + 1):
            start = time.perf_counter()
            actual = self.model.stress(state)
            residual = self.model.force(state, actual)
            used, force = (stress, self.model.force(state, stress)) if mixed else (actual, residual)
            self._spend("forces", time.perf_counter() - start)
            bases = self.factor(state, used, force)
            negative = self._factor.inertia()[0]
            self.iterations += 1
            reduced = self._factor.solve(-director.reduce_vector(residual, bases, self.free))
            correction = float(np.max(np.abs(reduced))) if np.all(np.isfinite(reduced)) else np.inf
            if correction > LARGEST_CORRECTION:
                return Attempt(False, state, stress, iteration, correction, negative)
            step = director.expand_vector(reduced, bases, self.free)
            stress = self.model.stress(state, step)
            state = director.retract(state, step)
            if correction <= self.options.tolerance:
                return Attempt(True, state, stress, iteration, correction, negative)
        return Attempt(False, state, stress, self.options.max_newton, correction, negative)

    def negative_eigenvalues(self, state: np.ndarray) -> int:
        """Negative eigenvalues of the tangent at a state, by its own factorisation."""
        stress = self.model.stress(state)
        self._bases = self.factor(state, stress, self.model.force(state, stress))
        negative, zero, _ = self._factor.inertia()
        return negative + zero

    def lowest_mode(self, state: np.ndarray, negative: int) -> tuple[float | None, np.ndarray]:
        """Lowest eigenvalue and its vector (nodes, 6) of tangent x = lambda mass x: Lanczos on the inverse.

        lambda: squared angular frequency of the slowest small vibration, in D / (areal mass l^4); negative = unstable.
        None and zeros when Lanczos does not converge. `negative`: how many negative eigenvalues there are.
        """
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

        self.negative_eigenvalues(state)
        root = np.sqrt(self.mass)
        shape = (self.unknowns, self.unknowns)
        operator = LinearOperator(shape, matvec=lambda x: root * self._factor.solve(root * x.ravel()), dtype=float)
        start = np.random.default_rng(1).standard_normal(self.unknowns)
        # of the inverse, the negative end holds the unstable modes, the positive end the slowest stable ones
        count = max(negative, 1)
        end = "SA" if negative else "LA"
        try:
            inverse, vectors = eigsh(operator, k=count, which=end, v0=start, tol=1e-10, maxiter=100)
        except ArpackNoConvergence:
            return None, np.zeros_like(state)
        values = 1.0 / inverse
        lowest = int(np.argmin(values))
        mode = vectors[:, lowest] / root
        mode = mode / mode[np.argmax(np.abs(mode))]
        return float(values[lowest]), director.expand_vector(mode, self._bases, self.free)

    def leave_saddle(self, state: np.ndarray, negative: int, max_iterations: int = 60) -> Attempt:
        """From an unstable equilibrium down its most unstable mode to a stable one, at the same load.

        Kicks along the mode, growing until one succeeds: the mode's strain is followed to first order only (the mixed
        iteration's stress), so a large kick does not stretch a thin strip. Then mixed Newton with the tangent shifted
        by mu * mass so that it is positive definite: every step goes down, and mu falls to zero as the state settles.
        The attempt is converged only when it ends at a lower energy with a positive definite tangent.
        """
        eigenvalue, mode = self.lowest_mode(state, negative)
        if eigenvalue is None:
            return Attempt(False, state, self.model.stress(state), 0, np.inf, negative)
        energy, spent, correction = self.model.energies(state).total, 0, np.inf
        for size in (0.02, 0.05, 0.1, 0.2, 0.4):
            attempt = self._descend(state, size * mode, abs(eigenvalue), max_iterations)
            spent, correction = spent + attempt.iterations, attempt.correction
            lower = attempt.converged and self.model.energies(attempt.state).total < energy
            if lower and self.negative_eigenvalues(attempt.state) == 0:
                attempt.iterations, attempt.negative = spent, 0
                return attempt
        return Attempt(False, state, self.model.stress(state), spent, correction, negative)

    def _descend(self, state: np.ndarray, kick: np.ndarray, scale: float, max_iterations: int) -> Attempt:
        """Mixed Newton from state + kick (nodes, 6) with a falling positive shift; then plain mixed Newton."""
        stress, state = self.model.stress(state, kick), director.retract(state, kick)
        shift, correction = 2.0 * scale, np.inf
        for iteration in range(1, max_iterations + 1):
            residual, force = self.model.residual(state), self.model.force(state, stress)
            bases = self.factor(state, stress, force, shift)
            self.iterations += 1
            if self._factor.inertia()[0] > 0:
                shift = max(4.0 * shift, scale)
                continue
            reduced = self._factor.solve(-director.reduce_vector(residual, bases, self.free))
            correction = float(np.max(np.abs(reduced)))
            if not correction < LARGEST_CORRECTION:
                return Attempt(False, state, stress, iteration, correction, None)
            step = director.expand_vector(reduced, bases, self.free)
            stress, state = self.model.stress(state, step), director.retract(state, step)
            if shift == 0.0 and correction < 1e-3:
                attempt = self.solve(state, stress)
                attempt.iterations += iteration
                return attempt
            shift = 0.4 * shift if shift > 0.05 * scale else 0.0
        return Attempt(False, state, stress, max_iterations, correction, None)
