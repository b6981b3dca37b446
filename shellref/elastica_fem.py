r"""The discrete side of the planar elastica: theta(s) by line elements of scikit-fem, clamped theta(0) = 0.

Forms as derived in `shellref.elastica`, with v the test function and t = (cos theta, sin theta)::

    energy     int 1/2 theta'^2 - K theta' + <t, p>
    residual   int (theta' - K) v' + <t_perp, p> v
    tangent    int dtheta' v' - <t, p> dtheta v

Array shapes: coefficients (N,) over all unknowns of the basis, the clamped one included; values at quadrature points
(n, q) for n elements.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray
from skfem import (
    Basis,
    BilinearForm,
    DiscreteField,
    ElementLineP1,
    ElementLineP2,
    ElementLinePp,
    LinearForm,
    MeshLine,
)
from skfem.helpers import dot, grad

Array = NDArray[np.float64]

ELEMENTS: dict[int, Callable[[], Any]] = {
    1: ElementLineP1,
    2: ElementLineP2,
    3: lambda: ElementLinePp(3),
    4: lambda: ElementLinePp(4),
}
"""Line elements by their degree."""

QUADRATURE_ORDER = 19
"""Polynomial degree integrated exactly on every element: 10 Gauss points, since cos theta is not a polynomial."""

DENSE_EIGENVALUES = 40
"""Number of unknowns up to which the lowest eigenvalue is computed with dense matrices."""


class Loads(Protocol):
    """What the forms need of a problem, each at abscissae of any shape."""

    def natural_curvature(self, s: Array) -> Array: ...

    def carried(self, s: Array) -> tuple[Array, Array]: ...


@BilinearForm
def _stiffness(u: Any, v: Any, _: Any) -> Any:
    return dot(grad(u), grad(v))


@BilinearForm
def _product(u: Any, v: Any, w: Any) -> Any:
    return w.factor * u * v


@LinearForm
def _balance(v: Any, w: Any) -> Any:
    return w.moment * grad(v)[0] + w.couple * v


class Discretisation:
    """Elements of one degree between given joints (n + 1,), increasing from 0 to 1."""

    def __init__(self, nodes: Array, degree: int) -> None:
        self.nodes = nodes
        self.basis = Basis(MeshLine(nodes), ELEMENTS[degree](), intorder=QUADRATURE_ORDER)
        self.s = np.asarray(self.basis.global_coordinates())[0]  # (n, q)
        self.ds = np.asarray(self.basis.dx)  # (n, q)
        clamped = self.basis.get_dofs(lambda x: x[0] == 0.0).flatten()
        self.free = np.setdiff1d(np.arange(self.basis.N), clamped)
        self._stiffness = _stiffness.assemble(self.basis)
        self.mass = self._reduced(_product.assemble(self.basis, factor=DiscreteField(np.ones_like(self.s))))
        self._solve_stiffness = scipy.sparse.linalg.factorized(self._reduced(self._stiffness).tocsc())
        points, weights = np.polynomial.legendre.leggauss(12)
        self._gauss = 0.5 * (points + 1.0), 0.5 * weights

    def natural_shape(self, loads: Loads) -> Array:
        """Coefficients (N,) of the unloaded equilibrium: int (theta' - K) v' = 0."""
        coefficients = np.zeros(self.basis.N)
        zero = np.zeros_like(self.s)
        moment = DiscreteField(-loads.natural_curvature(self.s))
        rhs = _balance.assemble(self.basis, moment=moment, couple=DiscreteField(zero))
        coefficients[self.free] = self._solve_stiffness(-rhs[self.free])
        return coefficients

    def residual(self, coefficients: Array, loads: Loads) -> Array:
        """Out-of-balance couple on every free unknown, shape (N - 1,)."""
        theta = self.basis.interpolate(coefficients)
        px, py = loads.carried(self.s)
        angle = np.asarray(theta)
        return _balance.assemble(
            self.basis,
            moment=DiscreteField(theta.grad[0] - loads.natural_curvature(self.s)),
            couple=DiscreteField(py * np.cos(angle) - px * np.sin(angle)),
        )[self.free]

    def tangent(self, coefficients: Array, loads: Loads) -> scipy.sparse.csc_matrix:
        """Exact derivative of `residual`, shape (N - 1, N - 1)."""
        pull = DiscreteField(self._pull(coefficients, loads))
        return self._reduced(self._stiffness - _product.assemble(self.basis, factor=pull)).tocsc()

    def _pull(self, coefficients: Array, loads: Loads) -> Array:
        """<t, p> at the quadrature points (n, q): positive where the strip is pushed."""
        angle = np.asarray(self.basis.interpolate(coefficients))
        px, py = loads.carried(self.s)
        return px * np.cos(angle) + py * np.sin(angle)

    def moment_norm(self, residual: Array) -> float:
        """L2 norm of the moment that balances `residual` (N - 1,): a norm that does not depend on the mesh."""
        return float(np.sqrt(max(residual @ self._solve_stiffness(residual), 0.0)))

    def lowest_eigenvalue(self, coefficients: Array, loads: Loads) -> float:
        """Lowest lambda of tangent v = lambda mass v; above -max <t, p> since int v'^2 > 0, hence the Lanczos shift."""
        tangent = self.tangent(coefficients, loads)
        if tangent.shape[0] <= DENSE_EIGENVALUES:
            values = scipy.linalg.eigvalsh(tangent.toarray(), self.mass.toarray(), subset_by_index=[0, 0])
        else:
            below = -max(float(np.max(self._pull(coefficients, loads))), 0.0) - 1.0
            values = scipy.sparse.linalg.eigsh(
                tangent, k=1, M=self.mass, sigma=below, return_eigenvectors=False, v0=np.ones(len(self.free))
            )
        return float(values[0])

    def energies(self, coefficients: Array, loads: Loads) -> tuple[float, float]:
        """int 1/2 theta'^2 - K theta' and int <t, p>, in D w / l."""
        rate = self.basis.interpolate(coefficients).grad[0]
        bending = np.sum(self.ds * (0.5 * rate**2 - loads.natural_curvature(self.s) * rate))
        return float(bending), float(np.sum(self.ds * self._pull(coefficients, loads)))

    def angle(self, coefficients: Array, s: Array) -> Array:
        """theta at the abscissae s (N,): shape (N,)."""
        return self.basis.probes(s[None, :]) @ coefficients

    def position(self, coefficients: Array, s: Array) -> Array:
        """int_0^s (cos theta, sin theta) at the abscissae s (N,): shape (N, 2), by Gauss points on every element."""
        angle = np.asarray(self.basis.interpolate(coefficients))
        chords = np.stack([np.sum(self.ds * np.cos(angle), axis=1), np.sum(self.ds * np.sin(angle), axis=1)], axis=1)
        joints = np.concatenate([np.zeros((1, 2)), np.cumsum(chords, axis=0)])
        element = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        points, weights = self._gauss
        step = s - self.nodes[element]
        inner = self.nodes[element][:, None] + step[:, None] * points  # (N, 12)
        theta = self.angle(coefficients, inner.ravel()).reshape(inner.shape)
        rest = np.stack([np.cos(theta) @ weights, np.sin(theta) @ weights], axis=1) * step[:, None]
        return joints[element] + rest

    def _reduced(self, matrix: Any) -> Any:
        """Rows and columns of the free unknowns."""
        return matrix[self.free][:, self.free]
