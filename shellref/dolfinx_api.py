"""The only module that knows which dolfinx is installed (written for and tested on 0.5.2, Debian 12).

Everything is serial (MPI.COMM_SELF): one solve, one process. Arrays of cells, points and nodes are NumPy arrays.
Importing this module without dolfinx raises `DolfinxMissing` with the remedy.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

REMEDY = "dolfinx is missing: run `apt-get install python3-dolfinx`, then `make setup`"


class DolfinxMissing(ImportError):
    """dolfinx (or petsc4py, mpi4py, ufl) cannot be imported, or is a version this module does not know."""


try:
    import dolfinx
    import petsc4py
    import ufl
    from dolfinx import fem
    from dolfinx import mesh as dmesh
    from dolfinx.fem import petsc as fpetsc
    from mpi4py import MPI
    from petsc4py import PETSc
except ImportError as error:
    raise DolfinxMissing(f"{REMEDY} ({error})") from error

if tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) != (0, 5):
    raise DolfinxMissing(f"dolfinx {dolfinx.__version__} is installed; needed: 0.5 (Debian 12's python3-dolfinx)")

COMPILE_FLAGS = ("-O3", "-ffast-math", "-g0")


def cache_folder() -> Path:
    """Where compiled forms are kept between runs: $RIBBONBENCH_CACHE, or $XDG_CACHE_HOME, or ~/.cache."""
    own = os.environ.get("RIBBONBENCH_CACHE")
    if own:
        return Path(own).expanduser() / "forms"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ribbonbench" / "forms"


def _jit() -> dict[str, Any]:
    """Options of the form compiler's C stage."""
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    return {"cache_dir": str(folder), "cffi_extra_compile_args": list(COMPILE_FLAGS), "timeout": 120}


def versions() -> dict[str, str]:
    """Versions of everything that takes part in a solve."""
    petsc = ".".join(str(part) for part in PETSc.Sys.getVersion())
    return {
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "dolfinx": dolfinx.__version__,
        "ufl": ufl.__version__,
        "petsc": petsc,
        "petsc4py": petsc4py.__version__,
    }


def rectangle(s_knots: np.ndarray, v_knots: np.ndarray) -> Any:
    """Quadrilateral mesh of the material coordinates (S, v) with these ends of elements (nx + 1,), (ny + 1,)."""
    along, across = len(s_knots) - 1, len(v_knots) - 1
    corners = [np.array([0.0, 0.0]), np.array([1.0, 1.0])]
    mesh = dmesh.create_rectangle(MPI.COMM_SELF, corners, [along, across], dmesh.CellType.quadrilateral)
    place = mesh.geometry.x
    place[:, 0] = s_knots[np.rint(along * place[:, 0]).astype(int)]
    place[:, 1] = v_knots[np.rint(across * place[:, 1]).astype(int)]
    # ffcx 0.5 makes this change to the mesh when it first compiles a form, which renames (and so recompiles) every form
    # that follows; made here, names do not depend on what is in the cache
    domain = mesh.ufl_domain()
    element = ufl.FiniteElement("Lagrange", domain.ufl_cell(), 1, variant="equispaced")
    domain._ufl_coordinate_element = ufl.VectorElement(element)
    return mesh


def cell_count(mesh: Any) -> int:
    """Number of cells."""
    return mesh.topology.index_map(mesh.topology.dim).size_local


def cell_midpoints(mesh: Any) -> np.ndarray:
    """(cells, 2) midpoints in material coordinates."""
    cells = np.arange(cell_count(mesh), dtype=np.int32)
    return dmesh.compute_midpoints(mesh, mesh.topology.dim, cells)[:, :2]


def lagrange_space(mesh: Any, degree: int, components: int) -> Any:
    """Continuous Lagrange space with `components` per node."""
    element = ufl.VectorElement("Lagrange", mesh.ufl_cell(), degree, dim=components)
    return fem.FunctionSpace(mesh, element, jit_params=_jit())


def quadrature_space(mesh: Any, degree: int, components: int) -> Any:
    """Values at the points of the Gauss rule of this degree."""
    element = ufl.VectorElement("Quadrature", mesh.ufl_cell(), degree, dim=components, quad_scheme="default")
    return fem.FunctionSpace(mesh, element, jit_params=_jit())


def node_coordinates(space: Any) -> np.ndarray:
    """(nodes, 2) material coordinates of the nodes, in the order of the unknowns."""
    return space.tabulate_dof_coordinates()[:, :2]


def function(space: Any) -> Any:
    """A finite element function, zero."""
    return fem.Function(space)


def values(item: Any, components: int) -> np.ndarray:
    """The unknowns of a function as a writable view (nodes, components)."""
    return item.x.array.reshape(-1, components)


def constant(mesh: Any, value: Any) -> Any:
    """A constant of forms, changed without recompilation through `.value`."""
    return fem.Constant(mesh, PETSc.ScalarType(value) if np.ndim(value) == 0 else np.asarray(value, dtype=float))


def gauss_rule(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, 2) and weights (q,) on the unit square of the rule that forms use for this degree."""
    from ffcx.element_interface import create_quadrature

    points, weights = create_quadrature("quadrilateral", degree, "default")
    return np.asarray(points), np.asarray(weights)


def compile_form(form: Any) -> Any:
    """A form compiled (or found in the cache)."""
    return fem.form(form, jit_params=_jit())


class PointValues:
    """A UFL vector evaluated at the points of a Gauss rule in every cell."""

    def __init__(self, mesh: Any, expression: Any, degree: int, components: int):
        points, _ = gauss_rule(degree)
        self._expression = fem.Expression(expression, points, jit_params=_jit())
        self._cells = np.arange(cell_count(mesh), dtype=np.int32)
        self._shape = (len(self._cells), len(points), components)

    def __call__(self) -> np.ndarray:
        """(cells, points, components)."""
        return self._expression.eval(self._cells).reshape(self._shape)


def quadrature_order(space: Any, points: int) -> np.ndarray:
    """(cells, points) number of each point's block of unknowns in a quadrature space."""
    return np.asarray(space.dofmap.list.array).reshape(-1, points)


def assemble_vector(forms: list[Any], components: int) -> np.ndarray:
    """Sum of assembled linear forms, (nodes, components)."""
    return sum(fem.assemble_vector(form).array for form in forms).reshape(-1, components)


def create_matrix(form: Any) -> Any:
    """An empty PETSc matrix with the pattern of a bilinear form."""
    return fpetsc.create_matrix(form)


def assemble_matrix(matrix: Any, forms: list[Any]) -> None:
    """Assemble the sum of bilinear forms into a PETSc matrix made by `create_matrix`."""
    matrix.zeroEntries()
    for form in forms:
        fpetsc.assemble_matrix(matrix, form)
    matrix.assemble()


def sparse_matrix(shape: tuple[int, int], csr: tuple[np.ndarray, np.ndarray, np.ndarray]) -> Any:
    """A PETSc AIJ matrix from (indptr, indices, values)."""
    matrix = PETSc.Mat().createAIJ(size=shape, csr=csr, comm=PETSc.COMM_SELF)
    matrix.assemble()
    return matrix


def refill(matrix: Any, csr: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    """New values in a matrix made by `sparse_matrix` with the same pattern."""
    matrix.setValuesCSR(*csr)
    matrix.assemble()


def add_diagonal(matrix: Any, diagonal: np.ndarray) -> None:
    """matrix += diag(diagonal)."""
    vector = PETSc.Vec().createWithArray(np.ascontiguousarray(diagonal), comm=PETSc.COMM_SELF)
    matrix.setDiagonal(vector, addv=PETSc.InsertMode.ADD_VALUES)


class SymmetricFactor:
    """L D L^T of a symmetric PETSc matrix by MUMPS: solves, and the inertia that says how stable a state is."""

    def __init__(self, matrix: Any):
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._matrix = matrix
        self._ksp = PETSc.KSP().create(comm=PETSc.COMM_SELF)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = self._ksp.getPC()
        pc.setType(PETSc.PC.Type.CHOLESKY)
        pc.setFactorSolverType("mumps")
        self._ksp.setOperators(matrix)
        pc.setFactorSetUpSolverType()
        factor = pc.getFactorMatrix()
        factor.setMumpsIcntl(24, 1)  # null pivots are detected: the inertia is then trustworthy
        factor.setMumpsIcntl(13, 1)  # the root is factored with pivot signs known
        self._pc = pc

    def factor(self) -> None:
        """Factorise the matrix's present values."""
        self._ksp.setOperators(self._matrix)
        self._ksp.setUp()

    def solve(self, right: np.ndarray) -> np.ndarray:
        """matrix^-1 right, (n,)."""
        b = PETSc.Vec().createWithArray(np.ascontiguousarray(right), comm=PETSc.COMM_SELF)
        x = np.zeros_like(right)
        self._ksp.solve(b, PETSc.Vec().createWithArray(x, comm=PETSc.COMM_SELF))
        return x

    def inertia(self) -> tuple[int, int, int]:
        """Numbers of (negative, zero, positive) eigenvalues of the matrix last factored."""
        return self._pc.getFactorMatrix().getInertia()
