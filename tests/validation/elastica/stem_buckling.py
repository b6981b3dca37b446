r"""The buckling of a straight clamped-free stem on dolfinx, its eigenproblem by SLEPc (lab sheet, 2.2).

    int dtheta' v' = P int dtheta v ,  dtheta(0) = 0 :   K x = P M x

The second opinion on `shellref.elastica.buckling`: own mesh, forms, assembly and eigensolver; the clamp as a row and a
column of the identity in K and of zeros in M (so that its eigenvalue is infinite), factorised by MUMPS,
Krylov-Schur with shift and invert about 0. Needs dolfinx; importing it without raises `DolfinxMissing`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shellref.fenics import dolfinx_api as api

TOLERANCE, ITERATIONS = 1e-13, 500


@dataclass(frozen=True)
class StemBuckling:
    """loads (k,) ascending in D w / l^2; modes (k, N): dtheta at the nodes s (N,) ascending, largest value 1.

    residuals (k,): SLEPc's |K x - P M x| / |P M x|.
    """

    loads: np.ndarray
    s: np.ndarray
    modes: np.ndarray
    residuals: np.ndarray
    unknowns: int


def stem_buckling(elements: int, degree: int = 1, count: int = 4) -> StemBuckling:
    """The first buckling loads and modes on equal elements of this degree; serial."""
    import ufl
    from dolfinx import fem, mesh
    from dolfinx.fem import petsc as fpetsc

    if isinstance(elements, bool) or elements < 1:
        raise ValueError(f"elements = {elements}: must be a whole number >= 1")
    if not 1 <= count <= elements * degree:
        raise ValueError(f"count = {count}: these elements have {elements * degree} buckling modes; use more elements")
    line = mesh.create_interval(api.communicator("self"), elements, [0.0, 1.0])
    space = api.SPACE(line, ("Lagrange", degree))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    clamped = fem.locate_dofs_geometrical(space, lambda x: np.isclose(x[0], 0.0))
    clamp = fem.dirichletbc(np.array(0.0), clamped, space)
    matrices = []
    for form, diagonal in ((ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx, 1.0), (ufl.inner(u, v) * ufl.dx, 0.0)):
        matrix = fpetsc.assemble_matrix(api.compile_form(form), bcs=[clamp], diagonal=diagonal)
        matrix.assemble()
        matrices.append(matrix)
    vectors, residuals = _smallest(matrices[0], matrices[1], count)
    shape = api.function(space)
    quotient = [
        api.compile_form(form)
        for form in (ufl.inner(ufl.grad(shape), ufl.grad(shape)) * ufl.dx, ufl.inner(shape, shape) * ufl.dx)
    ]
    s = space.tabulate_dof_coordinates()[:, 0]
    order = np.argsort(s)
    loads = np.zeros(count)
    modes = np.zeros((count, len(s)))
    for k, vector in enumerate(vectors):
        vector[clamped] = 0.0
        shape.x.array[:] = vector
        # int v'^2 / int v^2: rounded like n, where the assembled matrices' eigenvalue is like n^2 (n elements)
        loads[k] = fem.assemble_scalar(quotient[0]) / fem.assemble_scalar(quotient[1])
        modes[k] = vector[order] / vector[np.argmax(np.abs(vector))]
    return StemBuckling(loads, s[order], modes, residuals, elements * degree)


def _smallest(stiffness: Any, mass: Any, count: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Eigenvectors (N,) of the smallest P > 0 of K x = P M x, ascending, and their relative residuals (count,)."""
    from petsc4py import PETSc
    from slepc4py import SLEPc

    eps = SLEPc.EPS().create(stiffness.comm)
    eps.setOperators(stiffness, mass)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    eps.setDimensions(count)
    eps.setTolerances(TOLERANCE, ITERATIONS)
    eps.setTarget(0.0)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    transform = eps.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    ksp = transform.getKSP()
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.LU)
    ksp.getPC().setFactorSolverType("mumps")
    eps.solve()
    if eps.getConverged() < count:
        found = eps.getConverged()
        raise ArithmeticError(f"SLEPc found {found} of {count} buckling loads: reason {eps.getConvergedReason()}")
    vectors, residuals = [], np.zeros(count)
    for k in range(count):
        vector = stiffness.createVecRight()
        eps.getEigenpair(k, vector)
        vectors.append(vector.array.copy())
        residuals[k] = eps.computeError(k, SLEPc.EPS.ErrorType.RELATIVE)
        vector.destroy()
    eps.destroy()
    return vectors, residuals
