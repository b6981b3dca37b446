"""The only module that knows which dolfinx is installed: 0.5 (Debian 12) or 0.9 (Debian 13).

Serial or parallel by the communicator of the mesh. Cells: every process has its own and no copies of others'. Nodes:
its own first, then ghosts, copies of nodes that other processes own. Arrays of cells, points and nodes are NumPy arrays
of what this process has; functions that take a mesh, space or form are collective on its communicator.

Importing this module without dolfinx raises `DolfinxMissing` with the remedy.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import numpy as np

from ribbonbench import system
from shellref.fenics.cache import cache_folder

REMEDY = "dolfinx is missing: run `apt-get install python3-dolfinx python3-slepc4py`, then `make setup`"


class DolfinxMissing(ImportError):
    """dolfinx (or petsc4py, slepc4py, mpi4py, ufl) cannot be imported, or is a version this module does not know."""


try:
    import petsc4py

    petsc4py.init(["-no_signal_handler"])  # PETSc would take the signals of the process
    import dolfinx
    import slepc4py
    import ufl
    from dolfinx import fem, la
    from dolfinx import mesh as dmesh
    from dolfinx.fem import petsc as fpetsc
    from mpi4py import MPI
    from petsc4py import PETSc
    from slepc4py import SLEPc
except ImportError as error:
    raise DolfinxMissing(f"{REMEDY} ({error})") from error
with suppress(ValueError):  # in another thread than the main one
    # where someone began PETSc before, it ends the process by MPI_Abort for a broken pipe that it never saw
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)

VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
COMPILE_FLAGS = ("-O3", "-ffast-math", "-g0")


# --- what differs between versions -----------------------------------------------------------------------------------
if VERSION == (0, 5):
    from ffcx.element_interface import create_quadrature

    JIT_KEYWORD, ADD, SPACE = "jit_params", la.ScatterMode.add, fem.FunctionSpace
    # nodes that processes share are found from copies of the cells around (9 with the cell), which are then dropped
    DESTINATIONS, NO_COPIES = 9, {"ghost_mode": dmesh.GhostMode.none}
    # ffcx gives an element without this variant another one when it first compiles a form, which renames (and so
    # recompiles) every form that follows; with it, names do not depend on what is in the cache
    COORDINATES = ufl.VectorElement(ufl.FiniteElement("Lagrange", ufl.quadrilateral, 1, variant="equispaced"))

    def _lagrange(degree: int, components: int) -> Any:
        return ufl.VectorElement("Lagrange", ufl.quadrilateral, degree, dim=components)

    def _quadrature(degree: int, components: int) -> Any:
        return ufl.VectorElement("Quadrature", ufl.quadrilateral, degree, dim=components, quad_scheme="default")

    _rule = partial(create_quadrature, "quadrilateral", rule="default")

elif VERSION == (0, 9):
    import basix.ufl

    JIT_KEYWORD, ADD, SPACE = "jit_options", la.InsertMode.add, fem.functionspace  # type: ignore[attr-defined]
    DESTINATIONS, NO_COPIES = 1, {}
    COORDINATES = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))

    def _lagrange(degree: int, components: int) -> Any:
        return basix.ufl.element("Lagrange", "quadrilateral", degree, shape=(components,))

    def _quadrature(degree: int, components: int) -> Any:
        return basix.ufl.quadrature_element("quadrilateral", (components,), scheme="default", degree=degree)

    _rule = partial(basix.make_quadrature, basix.CellType.quadrilateral)

else:
    raise DolfinxMissing(f"dolfinx {dolfinx.__version__} is installed; needed: 0.5 (Debian 12) or 0.9 (Debian 13)")


# --- processes -------------------------------------------------------------------------------------------------------
def communicator(name: str) -> Any:
    """The communicator "self" (this process alone) or "world" (all processes of this run)."""
    return {"self": MPI.COMM_SELF, "world": MPI.COMM_WORLD}[name]


def sum_over(comm: Any, x: Any) -> Any:
    """Sum over the processes, of numbers or of arrays of one shape."""
    return comm.allreduce(x, op=MPI.SUM)


def max_over(comm: Any, x: Any) -> Any:
    """Largest over the processes, of numbers."""
    return comm.allreduce(x, op=MPI.MAX)


def gather_rows(comm: Any, array: np.ndarray) -> np.ndarray:
    """The rows of all processes, stacked in the order of ranks, on every process."""
    return np.concatenate(comm.allgather(array))


def versions() -> dict[str, str]:
    """Versions of everything that takes part in a solve."""
    return {
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "dolfinx": dolfinx.__version__,
        "ufl": ufl.__version__,
        "petsc": ".".join(str(part) for part in PETSc.Sys.getVersion()),
        "petsc4py": petsc4py.__version__,
        "slepc": ".".join(str(part) for part in SLEPc.Sys.getVersion()),
        "slepc4py": slepc4py.__version__,
    }


# --- compiled forms --------------------------------------------------------------------------------------------------
@contextmanager
def _jit(comm: Any) -> Iterator[dict[str, Any]]:
    """Options of the form compiler's C stage, for one compilation.

    One process at a time compiles into the folder (of a communicator only the first does, dolfinx sees to that), so a
    source without the mark of a finished compilation is what a killed process left: ffcx would wait for it in vain.
    """
    folder = cache_folder()
    options = {"cache_dir": str(folder), "cffi_extra_compile_args": list(COMPILE_FLAGS), "timeout": 120}
    comm.barrier()  # or the first would hold the lock and wait for one that waits for the lock, compiling by itself
    if comm.rank > 0:
        yield {JIT_KEYWORD: options}
        return
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with open(folder / "lock", "w") as lock:
        system.lock(lock.fileno(), wait=True)
        for source in folder.glob("libffcx_*.c"):
            if not source.with_suffix(".c.cached").exists():
                source.unlink()
        yield {JIT_KEYWORD: options}


def compile_form(form: Any) -> Any:
    """A form compiled (or found in the cache)."""
    with _jit(form.ufl_domains()[0].ufl_cargo().comm) as options:
        return fem.form(form, **options)


#: Columns of cells that the first process has of a closed strip, two at each end: its neighbours' copies of the inner
#: ones have no node of the seam.
SEAM = 4


# --- mesh ------------------------------------------------------------------------------------------------------------
def rectangle(s_knots: np.ndarray, v_knots: np.ndarray, comm: Any, closed: bool = False) -> Any:
    """Quadrilateral mesh of the material coordinates (S, v) with these ends of elements (nx + 1,), (ny + 1,).

    Cells, counted across the strip first, are dealt out in equal runs: a process has a piece of the strip's length and
    shares one row of nodes, about 2 ny, with each neighbour. Fewer cells than processes: ValueError on all of them.
    closed: columns of cells go by their distance from the nearer end, so that the first process has both ends, and no
    other one knows a node of the seam; each process has two pieces of the length.
    """
    nx, ny = len(s_knots) - 1, len(v_knots) - 1
    if nx * ny < comm.size:
        raise ValueError(f"a mesh of {nx} x {ny} elements cannot be shared by {comm.size} processes: use fewer")
    ends = np.arange(comm.size + 1) * (nx * ny) // comm.size
    if closed and comm.size > 1 and ends[1] < SEAM * ny:
        raise ValueError(f"a band of {nx} x {ny} elements cannot be shared by {comm.size} processes: use fewer")
    columns = np.arange(nx)
    if closed and comm.size > 1:
        columns = np.argsort(np.minimum(columns, nx - 1 - columns), kind="stable")
    numbers = (columns[:, None] * ny + np.arange(ny)).ravel()  # of the cells, in the order in which they are dealt out
    mine = numbers[ends[comm.rank] : ends[comm.rank + 1]]
    first = mine // ny * (ny + 1) + mine % ny
    cells = np.stack([first, first + ny + 1, first + 1, first + ny + 2], axis=1).astype(np.int64)
    # any process may bring any nodes: the first brings all
    nodes = np.stack(np.meshgrid(s_knots, v_knots, indexing="ij"), axis=2).reshape(-1, 2)
    nodes = np.ascontiguousarray(nodes if comm.rank == 0 else nodes[:0], dtype=float)
    # of every cell: its own rank, then those of the cells around it
    owners = np.empty(nx * ny, dtype=np.int64)
    owners[numbers] = np.searchsorted(ends, np.arange(nx * ny), side="right") - 1
    owners = np.pad(owners.reshape(nx, ny), 1, mode="edge")
    near = [owners[1 + i : nx + 1 + i, 1 + j : ny + 1 + j].ravel()[mine] for i in (0, -1, 1) for j in (0, -1, 1)]

    def destinations(*_: Any) -> Any:
        links = [[row[0], *sorted(set(row) - {row[0]})] for row in np.stack(near[:DESTINATIONS], axis=1).tolist()]
        starts = np.cumsum([0] + [len(link) for link in links]).astype(np.int32)
        return dolfinx.cpp.graph.AdjacencyList_int32(np.concatenate(links).astype(np.int32), starts)

    return dmesh.create_mesh(comm, cells, nodes, ufl.Mesh(COORDINATES), partitioner=destinations, **NO_COPIES)


def cell_count(mesh: Any) -> int:
    """Number of cells of this process."""
    return mesh.topology.index_map(mesh.topology.dim).size_local


def cell_midpoints(mesh: Any) -> np.ndarray:
    """(cells, 2) midpoints in material coordinates."""
    cells = np.arange(cell_count(mesh), dtype=np.int32)
    return dmesh.compute_midpoints(mesh, mesh.topology.dim, cells)[:, :2]


# --- spaces and functions --------------------------------------------------------------------------------------------
def lagrange_space(mesh: Any, degree: int, components: int) -> Any:
    """Continuous Lagrange space with `components` per node."""
    with _jit(mesh.comm) as options:
        return SPACE(mesh, _lagrange(degree, components), **options)


def quadrature_space(mesh: Any, degree: int, components: int) -> Any:
    """Values at the points of the Gauss rule of this degree."""
    with _jit(mesh.comm) as options:
        return SPACE(mesh, _quadrature(degree, components), **options)


def node_coordinates(space: Any) -> np.ndarray:
    """(nodes, 2) material coordinates of the nodes, in the order of the unknowns, ghosts last."""
    nodes = space.tabulate_dof_coordinates()[:, :2].copy()
    update_ghosts(space, nodes)  # computed from other cells than the owner's, they differ in the last digit
    return nodes


def node_ranges(space: Any) -> tuple[int, int, int]:
    """Numbers of this process's own nodes and of its ghosts, and the global number of its first own node."""
    index = space.dofmap.index_map
    return index.size_local, index.num_ghosts, index.local_range[0]


def function(space: Any) -> Any:
    """A finite element function, zero."""
    return fem.Function(space)


def values(item: Any, components: int) -> np.ndarray:
    """The unknowns of a function as a writable view (nodes, components), ghosts last."""
    return item.x.array.reshape(-1, components)


def constant(mesh: Any, value: Any) -> Any:
    """A constant of forms, changed without recompilation through `.value`."""
    return fem.Constant(mesh, PETSc.ScalarType(value) if np.ndim(value) == 0 else np.asarray(value, dtype=float))


def _scratch(space: Any, components: int) -> Any:
    """A distributed vector over a space's nodes, made once: each holds communicators of its own."""
    store = space.__dict__.setdefault("_ribbonbench_vectors", {})
    if components not in store:
        store[components] = la.vector(space.dofmap.index_map, components)
    return store[components]


def update_ghosts(space: Any, array: np.ndarray) -> None:
    """Ghosts take their owners' values, in place: array (nodes, components) of floats."""
    if space.mesh.comm.size > 1:
        vector = _scratch(space, array.shape[1])
        vector.array[:] = array.ravel()
        vector.scatter_forward()
        array[:] = vector.array.reshape(array.shape)


def gauss_rule(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, 2) and weights (q,) on the unit square of the rule that forms use for this degree."""
    points, weights = _rule(degree)
    return np.asarray(points), np.asarray(weights)


class PointValues:
    """A UFL vector evaluated at the points of a Gauss rule in every cell of this process."""

    def __init__(self, mesh: Any, expression: Any, degree: int, components: int):
        points, _ = gauss_rule(degree)
        with _jit(mesh.comm) as options:
            self._expression = fem.Expression(expression, points, **options)
        cells = np.arange(cell_count(mesh), dtype=np.int32)
        self._where = (cells,) if VERSION == (0, 5) else (mesh, cells)
        self._shape = (len(cells), len(points), components)

    def __call__(self) -> np.ndarray:
        """(cells, points, components)."""
        return self._expression.eval(*self._where).reshape(self._shape)


def quadrature_order(space: Any, points: int) -> np.ndarray:
    """(cells, points) number of each point's block of unknowns in a quadrature space."""
    blocks = space.dofmap.list.array if VERSION == (0, 5) else space.dofmap.list
    return np.asarray(blocks).reshape(-1, points)[: cell_count(space.mesh)]


def assemble_vector(forms: list[Any], space: Any, components: int) -> np.ndarray:
    """Sum of assembled linear forms on a space, (nodes, components), complete at ghosts too."""
    vector = _scratch(space, components)
    vector.array[:] = 0.0
    for form in forms:
        fem.assemble_vector(vector.array, form)
    if space.mesh.comm.size > 1:
        vector.scatter_reverse(ADD)
        vector.scatter_forward()
    return vector.array.reshape(-1, components).copy()


def create_matrix(form: Any) -> Any:
    """An empty PETSc matrix with the pattern of a bilinear form; row components * node + component, nodes global."""
    return fpetsc.create_matrix(form)


def assemble_matrix(matrix: Any, forms: list[Any]) -> None:
    """Assemble the sum of bilinear forms into a PETSc matrix made by `create_matrix`."""
    matrix.zeroEntries()
    for form in forms:
        fpetsc.assemble_matrix(matrix, form)
    matrix.assemble()
