"""The forms of the Naghdi shell in UFL: strains, forces and tangent as dolfinx assembles them. The definition.

`shellref.kernels` computes the same by loops of its own, faster, on one process; tests hold it to these forms.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from shellref.fenics import dolfinx_api as api
from shellref.shell.body import Body
from shellref.shell.material import plane_stress_rows

BENDING, MEMBRANE, SHEAR = slice(0, 3), slice(3, 6), slice(6, 8)


def _dot(a, b):
    """Sum of products, written out: with free indices, names of forms depend on running numbers."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def bilinear_strains(u, v, scale) -> list:
    """T(u, v): eight UFL scalars, bending (11, 22, 2*12), membrane (11, 22, 2*12), shear (1, 2).

    u, v: 6-vectors; scale: (1 / |phi_0,S|, 1 / |phi_0,v|).
    """
    a, b = ([[scale[k] * w[i].dx(k) for i in range(3)] for k in (0, 1)] for w in (u, v))  # a_k of u and of v
    p, q = ([[scale[k] * w[i].dx(k) for i in (3, 4, 5)] for k in (0, 1)] for w in (u, v))  # d_k
    d, e = ([w[i] for i in (3, 4, 5)] for w in (u, v))

    def bend(i, j):
        return _dot(a[i], q[j]) + _dot(b[i], p[j])

    bending = [bend(0, 0), bend(1, 1), bend(0, 1) + bend(1, 0)]
    membrane = [_dot(a[0], b[0]), _dot(a[1], b[1]), _dot(a[0], b[1]) + _dot(a[1], b[0])]
    shear = [_dot(a[k], e) + _dot(b[k], d) for k in (0, 1)]
    return bending + membrane + shear


class Forms:
    """Forms of one body on one mesh; degrees (full, reduced): of polynomials that their Gauss rules integrate."""

    def __init__(self, mesh: Any, space: Any, body: Body, degrees: tuple[int, int], factors: tuple[float, float]):
        self._space, self._degrees = space, degrees
        k = body.grid.degree
        points = ((k + 1) ** 2, k**2)
        spaces = [
            api.quadrature_space(mesh, degree, size) for degree, size in zip(degrees * 2, (8, 5, 3, 3), strict=True)
        ]
        self._order = [api.quadrature_order(item, points[i % 2]) for i, item in enumerate(spaces)]
        self._stress = [api.function(item) for item in spaces[:2]]
        self._scale = [api.function(item) for item in spaces[2:]]
        self._u, self._step = api.function(space), api.function(space)
        # one constant for all parameters: several are ordered by the text of their running number, not always alike
        numbers = [body.poisson, 1.0 / body.normaliser]
        numbers += list(factors)
        self._numbers = api.constant(mesh, numbers)
        self._build(mesh)

    def place(self, rule: int, scale: np.ndarray) -> None:
        """1 / Lame factors and the share of membrane and shear (cells, points, 3) of a rule: 0 full, 1 reduced."""
        values = api.values(self._scale[rule], 3)
        values[:] = 1.0  # ghost cells are not integrated over
        values[self._order[2 + rule]] = scale

    def _build(self, mesh: Any) -> None:
        """Compile the forms and the point evaluations."""
        u, step = self._u, self._step
        nu, over, membrane_factor, shear_factor = (self._numbers[i] for i in range(4))
        test, trial = ufl.TestFunction(self._space), ufl.TrialFunction(self._space)
        law = plane_stress_rows(nu)

        def plane(strains):
            return [_dot(row, strains) for row in law]

        def stretch(strains, share):
            n = [share * membrane_factor * x for x in plane(strains[MEMBRANE])]
            return n + [share * (1.0 - nu) * shear_factor * x for x in strains[SHEAR]]

        self._force, self._tangent, self._strain, self._area = [], [], [], []
        for rule, (degree, first) in enumerate(zip(self._degrees, (0, 3), strict=True)):
            # one form per rule: ffcx 0.5 cannot compare two quadrature elements of different size inside one form
            dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": degree})
            scale, s = self._scale[rule], [self._stress[rule][i] for i in range(8 - first)]
            area = over / (scale[0] * scale[1])
            now, virtual, change = (bilinear_strains(a, b, scale) for a, b in ((u, test), (trial, test), (u, trial)))
            self._force.append(api.compile_form(area * _dot(s, now[first:]) * dx))
            stiff = stretch(change, scale[2]) if rule else plane(change[BENDING]) + stretch(change, scale[2])
            whole = _dot(stiff, now[first:]) + _dot(s, virtual[first:])
            self._tangent.append(api.compile_form(area * whole * dx))
            if not rule:
                self._area.append(api.compile_form(area * test[0] * dx))
            # 1/2 T(u, u) + T(u, step) = T(u, u / 2 + step)
            half = [0.5 * u[i] + step[i] for i in range(6)]
            strain = bilinear_strains(u, half, scale)[first:]
            self._strain.append(api.PointValues(mesh, ufl.as_vector(strain), degree, 8 - first))

    def strains(self, state: np.ndarray, step: np.ndarray | None) -> list[np.ndarray]:
        """1/2 T(u, u) + T(u, step) at the Gauss points of both rules: (cells, points, 8) and (cells, points, 5)."""
        api.values(self._u, 6)[:] = state
        api.values(self._step, 6)[:] = 0.0 if step is None else step
        return [evaluate() for evaluate in self._strain]

    def _load(self, state: np.ndarray, stress: tuple[np.ndarray, np.ndarray]) -> None:
        api.values(self._u, 6)[:] = state
        for item, order, field in zip(self._stress, self._order, stress, strict=False):
            api.values(item, field.shape[-1])[order] = field

    def internal(self, state: np.ndarray, full: np.ndarray, reduced: np.ndarray) -> np.ndarray:
        """int sigma . T(u, .), (nodes, 6)."""
        self._load(state, (full, reduced))
        return api.assemble_vector(self._force, self._space, 6)

    def areas(self) -> np.ndarray:
        """Integrals of the nodes' functions over the normaliser (nodes,)."""
        return api.assemble_vector(self._area, self._space, 6)[:, 0]

    def create_tangent(self) -> Any:
        """An empty PETSc matrix for `tangent`, (6 nodes, 6 nodes)."""
        return api.create_matrix(self._tangent[0])

    def tangent(self, matrix: Any, state: np.ndarray, full: np.ndarray, reduced: np.ndarray) -> None:
        """Assemble int T(u, .) C T(u, .) + sigma . T(., .) into `matrix`."""
        self._load(state, (full, reduced))
        api.assemble_matrix(matrix, self._tangent)
