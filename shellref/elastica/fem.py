r"""The discrete side of the planar elastica: theta(s) by line elements of scikit-fem, given or free at either end.

Forms as derived in `shellref.elastica`, with v the test function and t = (cos theta, sin theta)::

    energy     int 1/2 theta'^2 - K theta' + <t, p>
    residual   int (theta' - K) v' + <t_perp, p> v
    tangent    int dtheta' v' - <t, p> dtheta v

Array shapes: coefficients (N,) over all unknowns of the basis, given ones included; values at quadrature points (n, q)
for n elements.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
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
    ElementLineHermite,
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
"""Continuous line elements by their degree; from 3 on hierarchical (integrated Legendre polynomials)."""

HERMITE_DEGREE = 3
"""Degree of the Hermite element, whose unknowns are theta and theta' at the joints: the curvature is continuous."""

QUADRATURE_ORDER = 19
"""Polynomial degree integrated exactly on every element: 10 Gauss points, since cos theta is not a polynomial."""

DENSE_EIGENVALUES = 40
"""Number of unknowns up to which the lowest eigenvalue is computed with dense matrices."""


ROUNDING = 10.0
"""Rounding of a lowest eigenvalue, over eps times the highest one that the elements can have."""


def stability(eigenvalue: float, rounding: float) -> bool | None:
    """Stable or not by the sign of the lowest eigenvalue; None within its rounding: at a fold or a bifurcation."""
    return None if abs(eigenvalue) <= rounding else eigenvalue > 0.0


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
    """Elements of one kind between given joints (n + 1,), increasing from 0 to 1.

    start_angle, end_angle : theta at the ends, None where it is free. hermite : the C1 cubic, degree 3, instead of the
    continuous element of the same degree.
    """

    def __init__(
        self,
        nodes: Array,
        degree: int,
        start_angle: float | None = 0.0,
        end_angle: float | None = None,
        hermite: bool = False,
    ) -> None:
        self.nodes = nodes
        self._new_element = ElementLineHermite if hermite else ELEMENTS[degree]
        self._hermite = hermite
        self.basis = Basis(MeshLine(nodes), self._new_element(), intorder=QUADRATURE_ORDER)
        self.s = np.asarray(self.basis.global_coordinates())[0]  # (n, q)
        self.ds = np.asarray(self.basis.dx)  # (n, q)
        self.ends = np.asarray(self.basis.nodal_dofs)[0, [0, -1]]  # unknowns theta(0), theta(1)
        angles = [(dof, a) for dof, a in zip(self.ends, (start_angle, end_angle), strict=True) if a is not None]
        self.given = np.array([dof for dof, _ in angles], dtype=int)
        self.angles = np.array([a for _, a in angles])
        self.free = np.setdiff1d(np.arange(self.basis.N), self.given)
        self._stiffness = _stiffness.assemble(self.basis)
        self._full_mass = _product.assemble(self.basis, factor=DiscreteField(np.ones_like(self.s)))
        self.mass = self._reduced(self._full_mass)
        self._stiffest = _stiffest(degree, hermite) / float(np.min(np.diff(nodes))) ** 2
        norm = self._stiffness if len(self.given) else self._stiffness + self._full_mass  # a free turn costs nothing
        self._solve_stiffness = scipy.sparse.linalg.factorized(self._reduced(norm).tocsc())
        points, weights = np.polynomial.legendre.leggauss(12)
        self._gauss = 0.5 * (points + 1.0), 0.5 * weights

    def natural_shape(self, loads: Loads) -> Array:
        """Coefficients (N,) of the unloaded equilibrium: int (theta' - K) v' = 0, with one angle given at least."""
        coefficients = np.zeros(self.basis.N)
        coefficients[self.given] = self.angles
        zero = np.zeros_like(self.s)
        moment = DiscreteField(-loads.natural_curvature(self.s))
        rhs = _balance.assemble(self.basis, moment=moment, couple=DiscreteField(zero)) + self._stiffness @ coefficients
        coefficients[self.free] -= self._solve_stiffness(rhs[self.free])
        return coefficients

    def projected(self, values: Array) -> Array:
        """Coefficients (N,) nearest in L2 to values (n, q) at the quadrature points, without regard to given angles."""
        zero = DiscreteField(np.zeros_like(values))
        rhs = _balance.assemble(self.basis, moment=zero, couple=DiscreteField(values))
        return scipy.sparse.linalg.spsolve(self._full_mass.tocsc(), rhs)

    def balance(self, coefficients: Array, loads: Loads) -> Array:
        """Out-of-balance couple on every unknown, shape (N,); on a given one, the couple that its support provides."""
        theta = self.basis.interpolate(coefficients)
        px, py = loads.carried(self.s)
        angle = np.asarray(theta)
        return _balance.assemble(
            self.basis,
            moment=DiscreteField(np.asarray(theta.grad)[0] - loads.natural_curvature(self.s)),
            couple=DiscreteField(py * np.cos(angle) - px * np.sin(angle)),
        )

    def residual(self, coefficients: Array, loads: Loads) -> Array:
        """Out-of-balance couple on every free unknown, shape (F,)."""
        return self.balance(coefficients, loads)[self.free]

    def full_tangent(self, coefficients: Array, loads: Loads) -> scipy.sparse.csr_matrix:
        """Exact derivative of `balance`, shape (N, N)."""
        pull = DiscreteField(self._pull(coefficients, loads))
        return (self._stiffness - _product.assemble(self.basis, factor=pull)).tocsr()

    def tangent(self, coefficients: Array, loads: Loads) -> scipy.sparse.csc_matrix:
        """Exact derivative of `residual`, shape (F, F)."""
        return self._reduced(self.full_tangent(coefficients, loads)).tocsc()

    def sway(self, coefficients: Array) -> Array:
        """Derivative of r(1) by the unknowns, int t_perp v: shape (2, N)."""
        angle = np.asarray(self.basis.interpolate(coefficients))
        zero = DiscreteField(np.zeros_like(angle))
        return np.stack([
            _balance.assemble(self.basis, moment=zero, couple=DiscreteField(part))
            for part in (-np.sin(angle), np.cos(angle))
        ])  # fmt: skip

    def reach(self, coefficients: Array) -> Array:
        """r(1), shape (2,)."""
        angle = np.asarray(self.basis.interpolate(coefficients))
        return np.array([np.sum(self.ds * np.cos(angle)), np.sum(self.ds * np.sin(angle))])

    def product(self, u: Array, v: Array) -> float:
        """int u v of two functions by their coefficients (N,)."""
        return float(u @ self.weighted(v))

    def weighted(self, v: Array) -> Array:
        """int v w for every basis function w, shape (N,)."""
        return self._full_mass @ v

    def turned(self, difference: Array) -> float:
        """Largest |value| at quadrature points of a function by its coefficients (N,), in radians."""
        return float(np.max(np.abs(np.asarray(self.basis.interpolate(difference)))))

    def highest_pull(self, coefficients: Array, loads: Loads) -> float:
        """Largest <t, p>, or 0: no eigenvalue of the tangent lies below minus this."""
        return max(float(np.max(self._pull(coefficients, loads))), 0.0)

    def _pull(self, coefficients: Array, loads: Loads) -> Array:
        """<t, p> at the quadrature points (n, q): positive where the strip is pushed."""
        angle = np.asarray(self.basis.interpolate(coefficients))
        px, py = loads.carried(self.s)
        return px * np.cos(angle) + py * np.sin(angle)

    def moment_norm(self, residual: Array) -> float:
        """L2 norm of the moment that balances `residual` (F,): a norm that does not depend on the mesh."""
        return float(np.sqrt(max(residual @ self._solve_stiffness(residual), 0.0)))

    def lowest_eigenvalue(self, coefficients: Array, loads: Loads) -> float:
        """Lowest lambda of tangent v = lambda mass v; above -max <t, p> since int v'^2 > 0, hence the Lanczos shift."""
        tangent = self.tangent(coefficients, loads)
        if tangent.shape[0] <= DENSE_EIGENVALUES:
            values = scipy.linalg.eigvalsh(tangent.toarray(), self.mass.toarray(), subset_by_index=[0, 0])
        else:
            below = -self.highest_pull(coefficients, loads) - 1.0
            values = scipy.sparse.linalg.eigsh(
                tangent, k=1, M=self.mass, sigma=below, return_eigenvectors=False, v0=np.ones(len(self.free))
            )
        return float(values[0])

    def rounding(self, coefficients: Array, loads: Loads) -> float:
        """Bound of the rounding of the lowest eigenvalues, in D w / l: ROUNDING eps times the highest one.

        Dense eigenvalues are those of matrices that differ by eps times the norm (LAPACK Users' Guide, SIAM 1999,
        section 4.8). The highest is at most that of the single elements (I. Fried, J. Sound Vib. 22 (1972), 407), with
        <t, p>. Measured, states and matrices rounded anew, dense and sparse, 12 to 400 elements of degree 2 to 4: the
        lowest eigenvalues of one state lie within 2 eps times it of each other.
        """
        highest = self._stiffest + float(np.max(np.abs(self._pull(coefficients, loads))))
        return ROUNDING * float(np.finfo(float).eps) * highest

    def energies(self, coefficients: Array, loads: Loads) -> tuple[float, float]:
        """int 1/2 theta'^2 - K theta' and int <t, p>, in D w / l."""
        rate = np.asarray(self.basis.interpolate(coefficients).grad)[0]
        bending = np.sum(self.ds * (0.5 * rate**2 - loads.natural_curvature(self.s) * rate))
        return float(bending), float(np.sum(self.ds * self._pull(coefficients, loads)))

    def angle(self, coefficients: Array, s: Array) -> Array:
        """theta at the abscissae s (N,): shape (N,)."""
        cells = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        length = np.diff(self.nodes)[cells]
        shapes = self._shapes((s - self.nodes[cells]) / length, length)
        return np.einsum("kn,kn->n", coefficients[np.asarray(self.basis.element_dofs)[:, cells]], shapes)

    def _shapes(self, x: Array, length: Array) -> Array:
        """Shape functions (k, N) at x (N,) of 0 to 1 on elements of these lengths (N,).

        From an element made for this call: scikit-fem's ElementLinePp keeps the values of its last points and gives
        them again for others when there are as many.
        """
        if self._hermite:
            return np.stack([
                1.0 - 3.0 * x**2 + 2.0 * x**3, length * (x - 2.0 * x**2 + x**3),
                3.0 * x**2 - 2.0 * x**3, length * (x**3 - x**2),
            ])  # fmt: skip
        element = self._new_element()
        count = np.asarray(self.basis.element_dofs).shape[0]
        return np.stack([np.broadcast_to(element.lbasis(x[None, :], k)[0], x.shape) for k in range(count)])

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


@lru_cache
def _stiffest(degree: int, hermite: bool) -> float:
    """Highest eigenvalue of int u' v' = lambda int u v on one element of length 1: 12, 60, 170, 380 by degree."""
    element = ElementLineHermite() if hermite else ELEMENTS[degree]()
    basis = Basis(MeshLine(np.array([0.0, 1.0])), element, intorder=QUADRATURE_ORDER)
    one = DiscreteField(np.ones_like(np.asarray(basis.dx)))
    stiffness, mass = _stiffness.assemble(basis), _product.assemble(basis, factor=one)
    return float(scipy.linalg.eigvalsh(stiffness.toarray(), mass.toarray())[-1])
