"""Geometrically exact Naghdi shell: strains, forces, tangent and energies of nodal states.

Unknowns u = (phi, d): mid-surface position and unit director, six components at the nodes of quadrilaterals of degree k
in the orthogonal material coordinates X = (S, v). With a_i = phi_,i and d_i = d_,i, derivatives along unit vectors of
the reference surface (coordinate derivatives over the Lame factors), and u0 the reference surface (docs/theory.md,
eq. (7.1); the sign of the bending strain is that of d = +t_y, so a flat strip bent to a cylinder of normal curvature
omega has kap_11 = omega):

    eps_ij = 1/2 (a_i . a_j) - at u0 ,  kap_ij = 1/2 (a_i . d_j + a_j . d_i) - at u0 - k_nat ,  gam_i = a_i . d - at u0

All three are quadratic: E(u) = 1/2 T(u, u) - 1/2 T(u0, u0) - k_nat, so that E'(u)[v] = T(u, v), E''[v, w] = T(v, w) for
one symmetric bilinear map T, which is all that forms contain (docs/theory.md, eq. (7.2)). Strains are vectors (11, 22,
2*12). The reference part is taken from the interpolated u0, so the reference and its rigid motions are exactly free of
strain.

Energy per area, D = 1:  1/2 kap:C:kap + (12 / h^2) 1/2 eps:C:eps + (5 (1 - nu) / h^2) 1/2 |gam|^2, C plane stress
(docs/theory.md, eq. (7.3)). All integrals are divided by the body's normaliser (a strip's w: energies in D w / l,
forces in D w / l^2).

Locking: bending on (k + 1)^2 Gauss points; membrane and shear (1 - alpha) on k^2 and alpha on (k + 1)^2, with
alpha = c (h / h_e)^2, h_e the element's length (Body.bends_along). alpha only removes the zero-energy modes of the
reduced rule. A strip bent to the curvature kappa has the membrane stress -kappa^2, which cancels against its bending
moment in smooth modes; hourglass modes stay stable where c > (kappa h_v)^2 / 12, h_v the element's size across
(docs/theory.md, eq. (7.6), (7.7)).

The tangent's geometric stiffness takes its stress from a field at the Gauss points: the stress of the state (Newton),
or the stress linearised at the previous iterate, "mixed integration point" Newton (Magisano, Leonetti & Garcea 2017,
Int. J. Numer. Meth. Engng 109, 1237, doi:10.1002/nme.5322).

On several processes every nodal array holds the owned nodes, then the ghosts; sums are over owned nodes and cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from shellref.fenics import dolfinx_api as api
from shellref.shell.body import Body, Control
from shellref.shell.forms import BENDING, MEMBRANE, SHEAR, Forms
from shellref.shell.material import plane_stress, stiffness_factors

if TYPE_CHECKING:
    from shellref.shell.cells import Cells

__all__ = ["BENDING", "MEMBRANE", "SHEAR", "Energies", "NaghdiModel", "Stress"]


@dataclass(frozen=True)
class Stress:
    """Stress at the Gauss points with stabilisation factors: full (cells, (k + 1)^2, 8), reduced (cells, k^2, 5)."""

    full: np.ndarray
    reduced: np.ndarray

    def extrapolate(self, older: Stress, ratio: float) -> Stress:
        """self + ratio (self - older)."""
        full, reduced = self.full - older.full, self.reduced - older.reduced
        return Stress(self.full + ratio * full, self.reduced + ratio * reduced)


@dataclass(frozen=True)
class Energies:
    """Energies over the normaliser.

    density (cells, 3): bending, membrane, shear energy per area, this process's cells. Membrane and shear are those of
    the reduced rule, whose points are where elements of degree k have no strain of interpolation; stabilisation, alpha
    times (full - reduced), is what holds the elements' own modes, and no stretching of the strip (docs/theory.md, eq.
    (7.6)).
    """

    bending: float
    membrane: float
    shear: float
    gravity: float
    stabilisation: float
    density: np.ndarray
    tip: float = 0.0  # of the dead forces

    @property
    def elastic(self) -> float:
        """bending + membrane + shear + stabilisation: what the discrete shell makes least."""
        return self.bending + self.membrane + self.shear + self.stabilisation

    @property
    def total(self) -> float:
        """elastic + gravity + tip."""
        return self.elastic + self.gravity + self.tip


class NaghdiModel:
    """The discrete shell of one body: residual, tangent, stresses and energies of nodal states (nodes, 6)."""

    def __init__(self, body: Body, stabilisation: float = 0.01, comm: Any = None, engine: str = "kernels"):
        """engine: "kernels" (compiled loops, on one process) or "forms" (dolfinx's; always on several)."""
        self.body = body
        self.comm = api.communicator("self") if comm is None else comm
        grid = self.grid = body.grid
        self.mesh = api.rectangle(grid.s_knots, grid.v_knots, self.comm, body.closed)
        k = grid.degree
        self.degrees = (2 * k, 2 * k - 1)  # whose Gauss rules have (k + 1)^2 and k^2 points: full and reduced
        self.space = api.lagrange_space(self.mesh, k, 6)
        self.nodes = api.node_coordinates(self.space)
        self.owned, self.ghosts, self.offset = api.node_ranges(self.space)
        self.midpoints = api.cell_midpoints(self.mesh)
        self._factors = stiffness_factors(body.thickness, body.shear_factor)
        self._geometry(stabilisation)
        self.cells: Cells | None = None
        self._made: Forms | None = None
        if engine == "kernels" and self.comm.size == 1:
            from shellref.shell.cells import Cells

            self.cells = Cells(self)
        self._sums = self.forms if self.cells is None else self.cells
        self.reference = np.hstack(body.surface.place(*self.nodes.T))
        self._loads()
        self.control = Control()
        self.set_control(Control(load=1.0))

    @property
    def forms(self) -> Forms:
        """dolfinx's, compiled when they are first asked for."""
        if self._made is None:
            self._made = Forms(self.mesh, self.space, self.body, self.degrees, self._factors)
            for rule, scale in enumerate(self.scales):
                self._made.place(rule, scale)
        return self._made

    def _geometry(self, stabilisation: float) -> None:
        """Gauss points in material coordinates, Lame factors there, areas and stabilisation of cells."""
        cells = len(self.midpoints)
        grid = self.grid
        i = np.searchsorted(grid.s_knots, self.midpoints[:, 0]) - 1
        j = np.searchsorted(grid.v_knots, self.midpoints[:, 1]) - 1
        size = np.stack([np.diff(grid.s_knots)[i], np.diff(grid.v_knots)[j]], axis=1)
        corner = np.stack([grid.s_knots[i], grid.v_knots[j]], axis=1)
        self.gauss_points, self.weights, self.scales, self.sizes = [], [], [], size
        middle = self.body.surface.lame(*self.midpoints.T) * size
        length = middle[:, 0] if self.body.bends_along else np.sqrt(middle[:, 0] * middle[:, 1])
        self.alpha = np.minimum(1.0, stabilisation * (self.body.thickness / length) ** 2)  # (cells,)
        self.largest_alpha = float(api.max_over(self.comm, float(np.max(self.alpha))))
        for k, degree in enumerate(self.degrees):
            points, weights = api.gauss_rule(degree)
            place = corner[:, None] + size[:, None] * points  # (cells, points, 2)
            lame = self.body.surface.lame(*place.reshape(-1, 2).T).reshape(cells, len(points), 2)
            share = np.broadcast_to((1.0 - self.alpha if k else self.alpha)[:, None, None], (*lame.shape[:2], 1))
            self.scales.append(np.concatenate([1.0 / lame, share], axis=2))
            self.gauss_points.append(place)
            self.weights.append(np.prod(size, axis=1)[:, None] * weights * np.prod(lame, axis=2))
        self.areas = self.weights[0].sum(axis=1)

    def load(self, body: Body) -> None:
        """The loads and natural curvatures of another body, alike in all else."""
        self.body = body
        self._loads()

    def _loads(self) -> None:
        """Reference strains, natural curvatures, nodal weights and forces."""
        body, n = self.body, len(self.nodes)
        self._base = self._sums.strains(self.reference, None)
        shape = (*self.gauss_points[0].shape[:2], 3)
        self._natural = []
        for law in (body.natural_start, body.natural):
            field = np.zeros(shape)
            if law is not None:
                field[:] = law(*self.gauss_points[0].reshape(-1, 2).T).reshape(shape)
            self._natural.append(field)
        self.nodal_areas = self._sums.areas()  # over the normaliser
        self.dead_forces = np.zeros((n, 3)) if body.forces is None else body.forces(self.grid, self.nodes)
        self.dead_forces = self.dead_forces / body.normaliser
        self.couples = None if body.couples is None else body.couples(self.grid, self.nodes) / body.normaliser
        self.moment = None if body.moment is None else body.moment(self.grid, self.nodes)
        self.weight = np.zeros(3) if body.weight is None else np.asarray(body.weight, dtype=float)

    def set_control(self, control: Control) -> None:
        """How much of the natural curvature, of the weight and of the loads acts."""
        self.control = control
        start, end = self._natural
        full = self._base[0].copy()
        full[..., BENDING] += start + control.natural * (end - start)
        self._reference = [full, self._base[1]]

    def strains(self, state: np.ndarray, step: np.ndarray | None = None) -> list[np.ndarray]:
        """E(u) + E'(u)[step] at the Gauss points: (cells, (k + 1)^2, 8), without bending (cells, k^2, 5); both are
        (nodes, 6).
        """
        return [raw - base for raw, base in zip(self._sums.strains(state, step), self._reference, strict=True)]

    def curvatures(self, state: np.ndarray) -> np.ndarray:
        """Normal curvature along S, (cells, (k + 1)^2), natural curvature included."""
        return (self._sums.strains(state, None)[0] - self._base[0])[..., 0]

    def law(self) -> np.ndarray:
        """(8, 8) stress from strain, without stabilisation factors."""
        c = plane_stress(self.body.poisson)
        law = np.zeros((8, 8))
        law[BENDING, BENDING] = c
        law[MEMBRANE, MEMBRANE] = self._factors[0] * c
        law[SHEAR, SHEAR] = self._factors[1] * (1.0 - self.body.poisson) * np.eye(2)
        return law

    def _stress_of(self, full: np.ndarray, reduced: np.ndarray) -> Stress:
        law = self.law()
        alpha = self.alpha[:, None, None]
        full, reduced = full @ law, (1.0 - alpha) * (reduced @ law[3:, 3:])
        full[..., 3:] *= alpha
        return Stress(full, reduced)

    def stress(self, state: np.ndarray, step: np.ndarray | None = None) -> Stress:
        """Stress of a state, or linearised along a step from it."""
        return self._stress_of(*self.strains(state, step))

    @property
    def stiffness(self) -> np.ndarray:
        """(nu, factor of the membrane's, of the shear's stiffness)."""
        return np.array([self.body.poisson, *self._factors])

    def no_stress(self) -> Stress:
        """Zeros."""
        return self._stress_of(np.zeros_like(self._base[0]), np.zeros_like(self._base[1]))

    def internal(self, state: np.ndarray, stress: Stress) -> np.ndarray:
        """int sigma . T(u, .), (nodes, 6)."""
        return self._sums.internal(state, stress.full, stress.reduced)

    def stiff(self, state: np.ndarray, stress: Stress, step: np.ndarray) -> np.ndarray:
        """[int T(u, .) C T(u, .) + sigma . T(., .)] step, (nodes, 6), by the kernels."""
        assert self.cells is not None
        change = self._stress_of(*self.cells.strains(state, step, 0.0))
        return self.internal(state, change) + self.internal(step, stress)

    def external(self, state: np.ndarray, control: Control) -> np.ndarray:
        """Forces that act on the nodes, (nodes, 6): weight, dead forces, couples, moment; linear in the control."""
        f = np.zeros((len(self.nodes), 6))
        f[:, :3] = control.weight * np.outer(self.nodal_areas, self.weight) + control.load * self.dead_forces
        if self.couples is not None:
            f[:, 3:] = control.load * np.cross(self.couples, state[:, 3:])
        if self.moment is not None:
            f += control.load * self.moment.forces(state)
        return f

    @property
    def potential(self) -> bool:
        """Whether its loads have one: not couples, nor a moment."""
        return self.couples is None and self.moment is None

    def force(self, state: np.ndarray, stress: Stress) -> np.ndarray:
        """int sigma . T(u, .) minus the loads, (nodes, 6): the residual dE/du when `stress` is the state's own."""
        return self.internal(state, stress) - self.external(state, self.control)

    def residual(self, state: np.ndarray) -> np.ndarray:
        """dE/du (nodes, 6)."""
        return self.force(state, self.stress(state))

    def residual_rate(self, state: np.ndarray, rate: Control) -> np.ndarray:
        """d(residual)/d(load) (nodes, 6) at a fixed state, when the controls change at `rate`."""
        out = -self.external(state, rate)
        if rate.natural:
            full = np.zeros_like(self._base[0])
            full[..., BENDING] = -rate.natural * (self._natural[1] - self._natural[0])
            out += self.internal(state, self._stress_of(full, np.zeros_like(self._base[1])))
        return out

    def on_grid(self, state: np.ndarray) -> np.ndarray:
        """Nodal values (nodes, k) of all processes on the grid, (k nx + 1, k ny + 1, components), on every process."""
        nodes = api.gather_rows(self.comm, self.nodes[: self.owned])
        return api.gather_rows(self.comm, np.ascontiguousarray(state[: self.owned]))[self.grid.order(nodes)]

    def from_grid(self, field: np.ndarray) -> np.ndarray:
        """This process's nodal values (nodes, k) of a field on the grid."""
        return np.ascontiguousarray(field[self.grid.positions(self.nodes)])

    def create_tangent(self):
        """An empty PETSc matrix for `tangent`, (6 nodes, 6 nodes)."""
        return self.forms.create_tangent()

    def tangent(self, matrix, state: np.ndarray, stress: Stress) -> None:
        """Assemble int T(u, .) C T(u, .) + sigma . T(., .) into `matrix`."""
        self.forms.tangent(matrix, state, stress.full, stress.reduced)

    def energies(self, state: np.ndarray) -> Energies:
        """Energies of a state, from the strains, rules and weights of the forms."""
        full, reduced = self.strains(state)
        law = self.law()
        wf, wr = self.weights

        def integrate(strain, part, weights):
            return 0.5 * np.einsum("cqi,ij,cqj,cq->c", strain, law[part, part], strain, weights, optimize=True)

        five = {"membrane": (MEMBRANE, slice(0, 3)), "shear": (SHEAR, slice(3, 5))}
        cells = {"bending": integrate(full[..., BENDING], BENDING, wf)}
        stabilisation = 0.0
        for name, (part, short) in five.items():
            complete, short_cut = integrate(full[..., part], part, wf), integrate(reduced[..., short], part, wr)
            cells[name] = short_cut
            stabilisation += float((self.alpha * (complete - short_cut)).sum())
        density = np.stack([cells["bending"], cells["membrane"], cells["shear"]], axis=1) / self.areas[:, None]
        sums = [float(cells[name].sum()) for name in ("bending", "membrane", "shear")]
        total = api.sum_over(self.comm, np.array([*sums, stabilisation])) / self.body.normaliser
        weight = self.control.weight * np.outer(self.nodal_areas, self.weight)[: self.owned]
        gravity = -float(api.sum_over(self.comm, np.sum(weight * state[: self.owned, :3])))
        dead = self.control.load * self.dead_forces[: self.owned]
        tip = -float(api.sum_over(self.comm, np.sum(dead * state[: self.owned, :3])))
        bending, membrane, shear, extra = (float(x) for x in total)
        return Energies(bending, membrane, shear, gravity, extra, density, tip)
