"""Geometrically exact Naghdi shell on a flat strip: strains, forces, tangent and energies.

Unknowns u = (phi, d): mid-surface position and unit director, six components at the nodes of biquadratic
quadrilaterals. With X = (S, v), a_i = phi_,i and d_i = d_,i (theory sheet, section 5; the sign of the bending strain is
that of d = +t_y, so a cylinder of normal curvature omega has kappa_11 = omega):

    eps_ij = 1/2 (a_i . a_j - delta_ij)      kap_ij = 1/2 (a_i . d_j + a_j . d_i) - k_nat      gam_i = a_i . d

All three are quadratic: E(u) = 1/2 T(u, u) - E_0, so that E'(u)[v] = T(u, v) and E''[v, w] = T(v, w) for one
symmetric bilinear map T, which is all this module writes down. Strains are vectors (11, 22, 2*12).

Energy per area, D = 1:  1/2 kap:C:kap + (12 / h^2) 1/2 eps:C:eps + (5 (1 - nu) / h^2) 1/2 |gam|^2, C plane stress; the
weight adds Gamma <phi, up>. All integrals are divided by w: energies in D w / l, forces in D w / l^2.

Locking: bending on 3x3 Gauss points; membrane and shear (1 - alpha) on 2x2 and alpha on 3x3, alpha = c (h / h_e)^2 with
h_e the mean length of an element. alpha only removes the zero-energy modes of the reduced rule.

The tangent's geometric stiffness takes its stress from a field at the Gauss points: the stress of the state (Newton),
or the stress linearised at the previous iterate, "mixed integration point" Newton (Magisano, Leonetti & Garcea 2017,
Int. J. Numer. Meth. Engng 109, 1237, doi:10.1002/nme.5322).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl

from shellref import dolfinx_api as api
from shellref.material import plane_stress, plane_stress_rows, stiffness_factors
from shellref.midsurface import Grid
from shellref.problem import ShellOptions, ShellProblem

FULL, REDUCED = 4, 3  # degrees whose Gauss rules on quadrilaterals are 3x3 and 2x2
BENDING, MEMBRANE, SHEAR = slice(0, 3), slice(3, 6), slice(6, 8)


def _dot(a, b):
    """Sum of products, written out: with free indices, names of forms depend on running numbers."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def bilinear_strains(u, v) -> list:
    """T(u, v): eight UFL scalars, bending (11, 22, 2*12), membrane (11, 22, 2*12), shear (1, 2); u, v 6-vectors."""
    a, b = ([[w[i].dx(k) for i in range(3)] for k in (0, 1)] for w in (u, v))  # phi_,k of u and of v
    p, q = ([[w[i].dx(k) for i in (3, 4, 5)] for k in (0, 1)] for w in (u, v))  # d_,k
    d, e = ([w[i] for i in (3, 4, 5)] for w in (u, v))

    def bend(i, j):
        return _dot(a[i], q[j]) + _dot(b[i], p[j])

    bending = [bend(0, 0), bend(1, 1), bend(0, 1) + bend(1, 0)]
    membrane = [_dot(a[0], b[0]), _dot(a[1], b[1]), _dot(a[0], b[1]) + _dot(a[1], b[0])]
    shear = [_dot(a[k], e) + _dot(b[k], d) for k in (0, 1)]
    return bending + membrane + shear


@dataclass(frozen=True)
class Stress:
    """Stress at the Gauss points, stabilisation factors included: full (cells, 9, 8), reduced (cells, 4, 5)."""

    full: np.ndarray
    reduced: np.ndarray

    def extrapolate(self, older: Stress, ratio: float) -> Stress:
        """self + ratio (self - older)."""
        full, reduced = self.full - older.full, self.reduced - older.reduced
        return Stress(self.full + ratio * full, self.reduced + ratio * reduced)


@dataclass(frozen=True)
class Energies:
    """Energies in D w / l; `density` (cells, 3): bending, membrane, shear energy per area (D / l^2), by cell."""

    bending: float
    membrane: float
    shear: float
    gravity: float
    stabilisation: float  # part of membrane + shear that comes from alpha times (full - reduced)
    density: np.ndarray

    @property
    def elastic(self) -> float:
        """bending + membrane + shear."""
        return self.bending + self.membrane + self.shear

    @property
    def total(self) -> float:
        """elastic + gravity."""
        return self.elastic + self.gravity


class NaghdiModel:
    """The discrete shell of one problem: residual, tangent, stresses and energies of nodal states (nodes, 6)."""

    def __init__(self, problem: ShellProblem, options: ShellOptions):
        self.problem = problem
        self.width = problem.width
        self.grid = Grid(problem.elements, problem.width, problem.grading)
        self.mesh = api.rectangle(self.grid.s_knots, self.grid.v_knots)
        self.space = api.lagrange_space(self.mesh, 2, 6)
        self.nodes = api.node_coordinates(self.space)
        spaces = [api.quadrature_space(self.mesh, FULL, 8), api.quadrature_space(self.mesh, REDUCED, 5)]
        self._order = [api.quadrature_order(spaces[0], 9), api.quadrature_order(spaces[1], 4)]
        self.midpoints = api.cell_midpoints(self.mesh)
        self._areas = self.grid.areas(self.midpoints)
        self._weights = [np.outer(self._areas, api.gauss_rule(degree)[1]) for degree in (FULL, REDUCED)]
        self.alpha = min(1.0, options.stabilisation * (problem.thickness * problem.elements[0]) ** 2)
        self._factors = stiffness_factors(problem.thickness)
        self._u, self._step = api.function(self.space), api.function(self.space)
        self._stress = [api.function(space) for space in spaces]
        # one constant for all parameters: several are ordered by the text of their running number, not always alike
        numbers = [problem.poisson, 1.0 / problem.width]
        numbers += [share * factor for factor in self._factors for share in (self.alpha, 1.0 - self.alpha)]
        self._numbers = api.constant(self.mesh, [*numbers, 0.0, 0.0, 0.0, 0.0, 0.0])
        self.set_load(1.0, 1.0)
        self._build()

    def set_load(self, natural: float, gravity: float) -> None:
        """Fractions of the natural curvature and of the weight that act."""
        p = self.problem
        self._numbers.value[6:8] = natural * np.array(p.natural_curvature)
        self._numbers.value[8:] = (gravity * p.gamma / p.width) * np.array(p.up) if p.loaded and p.up else 0.0

    def _build(self) -> None:
        """Compile the two forms and the two point evaluations."""
        mesh, u, step = self.mesh, self._u, self._step
        nu, over, *rest = (self._numbers[i] for i in range(11))
        membrane_factors, shear_factors, ends, up = rest[:2], rest[2:4], rest[4:6], rest[6:]
        test, trial = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        full = ufl.dx(domain=mesh, metadata={"quadrature_degree": FULL})
        reduced = ufl.dx(domain=mesh, metadata={"quadrature_degree": REDUCED})
        natural = ends[0] + (ends[1] - ends[0]) * ufl.SpatialCoordinate(mesh)[0]
        law = plane_stress_rows(nu)

        def plane(strains):
            return [_dot(row, strains) for row in law]

        def stretch(strains, rule):
            n = [membrane_factors[rule] * x for x in plane(strains[MEMBRANE])]
            return n + [(1.0 - nu) * shear_factors[rule] * x for x in strains[SHEAR]]

        now, virtual, change = bilinear_strains(u, test), bilinear_strains(trial, test), bilinear_strains(u, trial)
        sf, sr = ([item[i] for i in range(count)] for item, count in zip(self._stress, (8, 5), strict=True))
        weight = _dot(up, [test[i] for i in range(3)])
        force = [(over * _dot(sf, now) + weight) * full, over * _dot(sr, now[3:]) * reduced]
        stiff = plane(change[BENDING]) + stretch(change, 0)
        tangent = [
            over * (_dot(stiff, now) + _dot(sf, virtual)) * full,
            over * (_dot(stretch(change, 1), now[3:]) + _dot(sr, virtual[3:])) * reduced,
        ]
        # one form per rule: ffcx 0.5 cannot compare two quadrature elements of different size inside one form
        self._force = [api.compile_form(form) for form in force]
        self._tangent = [api.compile_form(form) for form in tangent]

        half, along = bilinear_strains(u, u), bilinear_strains(u, step)
        reference = [natural, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0]
        strain = [0.5 * a - r + b for a, r, b in zip(half, reference, along, strict=True)]
        self._strain = [
            api.PointValues(mesh, ufl.as_vector(strain), FULL, 8),
            api.PointValues(mesh, ufl.as_vector(strain[3:]), REDUCED, 5),
        ]

    def strains(self, state: np.ndarray, step: np.ndarray | None = None) -> list[np.ndarray]:
        """E(u) + E'(u)[step] at the Gauss points: (cells, 9, 8), without bending (cells, 4, 5); both are (nodes, 6)."""
        api.values(self._u, 6)[:] = state
        api.values(self._step, 6)[:] = 0.0 if step is None else step
        return [evaluate() for evaluate in self._strain]

    def _law(self) -> np.ndarray:
        """(8, 8) stress from strain, without stabilisation factors."""
        c = plane_stress(self.problem.poisson)
        law = np.zeros((8, 8))
        law[BENDING, BENDING] = c
        law[MEMBRANE, MEMBRANE] = self._factors[0] * c
        law[SHEAR, SHEAR] = self._factors[1] * (1.0 - self.problem.poisson) * np.eye(2)
        return law

    def stress(self, state: np.ndarray, step: np.ndarray | None = None) -> Stress:
        """Stress of a state, or linearised along a step from it."""
        full, reduced = self.strains(state, step)
        law = self._law()
        share = np.array([1.0] * 3 + [self.alpha] * 5)
        return Stress(full @ (law * share), reduced @ (law[3:, 3:] * (1.0 - self.alpha)))

    def _load_stress(self, state: np.ndarray, stress: Stress) -> None:
        api.values(self._u, 6)[:] = state
        for item, order, field in zip(self._stress, self._order, (stress.full, stress.reduced), strict=True):
            api.values(item, field.shape[-1])[order] = field

    def force(self, state: np.ndarray, stress: Stress) -> np.ndarray:
        """int sigma . T(u, .) + weight, (nodes, 6): the residual dE/du when `stress` is the state's own."""
        self._load_stress(state, stress)
        return api.assemble_vector(self._force, 6)

    def residual(self, state: np.ndarray) -> np.ndarray:
        """dE/du (nodes, 6), units D w / l^2 (positions) and D w / l (directors)."""
        return self.force(state, self.stress(state))

    def create_tangent(self):
        """An empty PETSc matrix for `tangent`, (6 nodes, 6 nodes)."""
        return api.create_matrix(self._tangent[0])

    def tangent(self, matrix, state: np.ndarray, stress: Stress) -> None:
        """Assemble int T(u, .) C T(u, .) + sigma . T(., .) into `matrix`."""
        self._load_stress(state, stress)
        api.assemble_matrix(matrix, self._tangent)

    def energies(self, state: np.ndarray) -> Energies:
        """Energies of a state, from the strains, rules and weights of the forms."""
        full, reduced = self.strains(state)
        law = self._law()
        wf, wr = self._weights

        def integrate(strain, part, weights):
            return 0.5 * np.einsum("cqi,ij,cqj,cq->c", strain, law[part, part], strain, weights, optimize=True)

        five = {"membrane": (MEMBRANE, slice(0, 3)), "shear": (SHEAR, slice(3, 5))}
        cells = {"bending": integrate(full[..., BENDING], BENDING, wf)}
        stabilisation = 0.0
        for name, (part, short) in five.items():
            complete, short_cut = integrate(full[..., part], part, wf), integrate(reduced[..., short], part, wr)
            extra = self.alpha * (complete - short_cut)
            cells[name] = short_cut + extra
            stabilisation += float(extra.sum())
        density = np.stack([cells["bending"], cells["membrane"], cells["shear"]], axis=1) / self._areas[:, None]
        sums = {name: float(part.sum()) / self.width for name, part in cells.items()}
        gravity = float(np.sum(self.weight_forces() * state))  # Gamma <phi, up> is linear in the positions
        return Energies(**sums, gravity=gravity, stabilisation=stabilisation / self.width, density=density)

    def weight_forces(self) -> np.ndarray:
        """dG/du of the weight that acts, (nodes, 6), units D w / l^2; it does not depend on the state."""
        nothing = Stress(np.zeros((len(self._order[0]), 9, 8)), np.zeros((len(self._order[1]), 4, 5)))
        return self.force(np.zeros((len(self.nodes), 6)), nothing)
