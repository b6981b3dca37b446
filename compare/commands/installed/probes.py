"""What `ribbonbench doctor` runs in processes of their own: one probe, one process, one line of JSON.

Run as a script (``python -P probes.py NAME``), never imported by the solvers; it imports nothing of this
project, so that a probe loads exactly the library it looks at. Ipopt and dolfinx never meet in one process.
Every probe yields rows {name, what, ok, remedy}.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

MARK = "@doctor@ "
"""Begins the line of standard output that carries the rows; libraries print what they like beside it."""

SETUP = "make setup"
APT = "sudo apt-get install --no-install-recommends"
IPOPT = "coinor-libipopt-dev pkg-config gcc libc6-dev python3-dev"
"""Debian's packages that cyipopt is built with."""
REBUILD = "pip install --force-reinstall --no-cache-dir --no-binary cyipopt cyipopt --no-deps"
"""Mends a cyipopt that was built for another NumPy: built anew, past the one that pip keeps, and nothing else moved."""

Row = dict[str, Any]


def row(name: str, what: object, ok: bool = True, remedy: str = "") -> Row:
    """One line of the table; a remedy is kept only where something is wrong."""
    return {"name": name, "what": " ".join(str(what).split()), "ok": bool(ok), "remedy": "" if ok else remedy}


def begun(name: str, remedy: str) -> Row:
    """The row of something that may crash the process: it stands until the row that follows it; remedy: of a crash."""
    return {"name": name, "what": "", "ok": None, "remedy": remedy}


def broken(name: str, error: BaseException, remedy: str, without: str = "") -> Row:
    """The row of something that cannot be imported or does not work; without: what alone needs it, so that a machine
    on which it is not installed lacks no more than that."""
    absent = isinstance(error, ModuleNotFoundError)
    found = row(name, "not installed" if absent else f"does not work: {error}"[:200], False, remedy)
    return {**found, "without": without if absent else ""}


#: What is not there without an optional part.
SHELL, PICTURES, ELASTICA, JUDGE = "the shell", "pictures", "the elastica", "Ipopt as a judge, curve-angle rods"


# ---------------------------------------------------------------------------------------------------------------------
# Which shared libraries this process has really loaded


def loaded_libraries() -> list[Path]:
    """Real paths of the shared objects mapped into this process (Linux; elsewhere none is known)."""
    if not os.path.exists("/proc/self/maps"):
        return []
    with open("/proc/self/maps", encoding="utf-8", errors="replace") as maps:
        found = {line.split(maxsplit=5)[5].strip() for line in maps if line.count("/") and ".so" in line}
    return sorted(Path(name) for name in found if name.startswith("/"))


def linear_algebra(libraries: list[Path]) -> str:
    """Names the BLAS and LAPACK among `libraries`, those bundled in Python wheels (numpy's, scipy's own) left out."""
    names = []
    for path in libraries:
        text = str(path).lower()
        if "site-packages" in text or not re.match(
            r"lib(blas|lapack|openblas|mkl_|blis|atlas|f77blas|flexiblas)", path.name
        ):
            continue
        maker = next(
            (label for key, label in _MAKERS if key in text),
            "reference" if path.name.startswith(("libblas", "liblapack")) else "",
        )
        names.append(f"{maker} {path.name}".strip())
    return ", ".join(names) or "none found among the loaded libraries"


_MAKERS = (("openblas", "OpenBLAS"), ("mkl", "MKL"), ("blis", "BLIS"), ("atlas", "ATLAS"), ("flexiblas", "FlexiBLAS"))


# ---------------------------------------------------------------------------------------------------------------------
# Probes


def python() -> Iterator[Row]:
    """The numerical Python packages: imported, and numba made to compile."""
    for name, module in (
        ("numpy", "numpy"),
        ("scipy", "scipy.optimize"),
        ("numba", "numba"),
        ("scikit-fem", "skfem"),
        ("meshio", "meshio"),
        ("matplotlib", "matplotlib.backends.backend_agg"),
    ):
        try:
            loaded = importlib.import_module(module)
            if name == "numba" and loaded.njit(lambda x: x + 1)(1) != 2:
                raise RuntimeError("a compiled function returns a wrong value")
            what = importlib.metadata.version(name)
            if name == "numba":
                what += f" (llvmlite {importlib.metadata.version('llvmlite')}, {loaded.get_num_threads()} threads)"
            yield row(name, what)
        except Exception as error:
            yield broken(name, error, SETUP, {"matplotlib": PICTURES, "scikit-fem": ELASTICA}.get(name, ""))


class _Parabola:
    """min (x - 1)^2, the smallest problem that makes Ipopt factorise a matrix."""

    def objective(self, x: Any) -> float:
        return float((x[0] - 1.0) ** 2)

    def gradient(self, x: Any) -> Any:
        return 2.0 * (x - 1.0)


def cyipopt_broken(error: BaseException, remedy: str) -> Row:
    """The row of a cyipopt that cannot be loaded; one that was built for another NumPy is built anew."""
    words = str(error).lower()
    if isinstance(error, ModuleNotFoundError) or not any(part in words for part in ("numpy", "multiarray", "api ver")):
        return broken("cyipopt", error, remedy, JUDGE)
    numpy = importlib.metadata.version("numpy")
    return row("cyipopt", f"was built for another NumPy than {numpy} ({str(error).partition(' (')[0]})", False, REBUILD)


def ipopt() -> Iterator[Row]:
    """cyipopt, the Ipopt library behind it, the linear solvers it can use, and its BLAS."""
    remedy = f"{APT} {IPOPT}; {SETUP}"
    try:
        import cyipopt
        import numpy as np

        yield row("cyipopt", cyipopt.__version__)
    except Exception as error:
        yield cyipopt_broken(error, remedy)
        return

    def mumps_works() -> bool:
        problem = cyipopt.Problem(n=1, m=0, problem_obj=_Parabola(), lb=[-5.0], ub=[5.0])
        problem.add_option("print_level", 0)
        problem.add_option("hessian_approximation", "limited-memory")
        problem.add_option("linear_solver", "mumps")
        solution, outcome = problem.solve(np.array([3.0]))
        return outcome["status"] == 0 and abs(solution[0] - 1.0) < 1e-6

    version = ".".join(str(part) for part in getattr(cyipopt, "IPOPT_VERSION", ())) or "unknown version"
    works = mumps_works()
    libraries = loaded_libraries()
    mumps = [path.name for path in libraries if re.match(r"lib[sdcz]mumps", path.name)]
    kind = f"MUMPS ({'sequential' if '_seq' in mumps[0] else 'parallel'}: {mumps[0]})" if mumps else "MUMPS"
    # Ipopt loads HSL at run time, and aborts the process where it is asked for and absent: only looked for here.
    hsl = [name for name in ("libhsl.so", "libcoinhsl.so") if _loads(name)]
    yield row("Ipopt", version)
    yield row(
        "Ipopt's linear solver",
        f"{kind if works else 'no MUMPS'}, {f'HSL ({hsl[0]})' if hsl else 'no HSL'}",
        works or bool(hsl),
        f"sudo apt-get install --reinstall coinor-libipopt1v5; {SETUP}",
    )
    yield row("Ipopt's BLAS, LAPACK", linear_algebra(libraries))


def _loads(library: str) -> bool:
    """Whether the dynamic loader finds `library`."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def dolfinx() -> Iterator[Row]:
    """dolfinx, PETSc, SLEPc, MPI as Debian builds them, and a MUMPS factorisation through PETSc."""
    try:
        import dolfinx

        yield row("dolfinx", dolfinx.__version__)
    except Exception as error:
        yield broken("dolfinx", error, f"{APT} python3-dolfinx; {SETUP}", SHELL)
    try:
        import numpy as np
        import petsc4py
        from petsc4py import PETSc

        matrix = PETSc.Mat().createAIJ((2, 2), nnz=2, comm=PETSc.COMM_SELF)
        matrix.setValues([0, 1], [0, 1], [4.0, 1.0, 1.0, 3.0])
        matrix.assemble()
        right, solution = PETSc.Vec().createSeq(2), PETSc.Vec().createSeq(2)
        right.array[:] = (1.0, 2.0)
        solver = PETSc.KSP().create(PETSc.COMM_SELF)
        solver.setOperators(matrix)
        solver.setType("preonly")
        solver.getPC().setType("lu")
        mumps = "MUMPS"
        try:
            solver.getPC().setFactorSolverType("mumps")
            solver.solve(right, solution)
            if not np.allclose(solution.array, (1.0 / 11.0, 7.0 / 11.0)):
                raise RuntimeError("a MUMPS solution is wrong")
            parallel = [path.name for path in loaded_libraries() if path.name.startswith("libdmumps")]
            mumps += f" ({parallel[0]})" if parallel else ""
        except PETSc.Error:
            mumps = ""
        version = ".".join(str(part) for part in PETSc.Sys.getVersion())
        scalar, index = np.dtype(PETSc.ScalarType).name, np.dtype(PETSc.IntType).name
        yield row("PETSc", f"{version} (petsc4py {petsc4py.__version__}), {scalar} scalars, {index} indices")
        yield row("PETSc's linear solver", mumps or "no MUMPS", bool(mumps), f"{APT} python3-petsc4py python3-dolfinx")
        yield row("PETSc's BLAS, LAPACK", linear_algebra(loaded_libraries()))
    except Exception as error:
        yield broken("PETSc", error, f"{APT} python3-dolfinx; {SETUP}", SHELL)
    try:
        from slepc4py import SLEPc

        yield row("SLEPc", ".".join(str(part) for part in SLEPc.Sys.getVersion()))
    except Exception as error:
        yield broken("SLEPc", error, f"{APT} python3-slepc4py; {SETUP}", SHELL)
    try:
        import mpi4py
        from mpi4py import MPI

        library = MPI.Get_library_version().split(",")[0]
        shared = "mpirun there: ribbonbench shell can share its work" if shutil.which("mpirun") else "no mpirun"
        yield row("MPI", f"{library} (mpi4py {mpi4py.__version__}); {shared}")
    except Exception as error:
        yield broken("MPI", error, f"{APT} python3-mpi4py; {SETUP}", SHELL)


def pictures() -> Iterator[Row]:
    """VTK: a sphere rendered off screen is not an empty picture."""
    try:
        import pyvista
        import vtkmodules

        yield row("pyvista, VTK", f"{pyvista.__version__}, {vtkmodules.__version__}")
    except Exception as error:
        yield broken("pyvista, VTK", error, SETUP, PICTURES)
        return
    yield begun("off-screen pictures", _PICTURES)
    try:
        plotter: Any = pyvista.Plotter(off_screen=True, window_size=[64, 64])
        plotter.add_mesh(pyvista.Sphere(), color="red")
        picture = plotter.screenshot(None, return_img=True)
        window = plotter.render_window
        report = window.ReportCapabilities()
        renderer = re.search(r"OpenGL renderer string:\s*(.*)", report)
        plotter.close()
        if picture.std() < 1.0:
            raise RuntimeError("the picture is empty")
        what = f"{window.GetClassName()}" + (f", {renderer[1].strip()}" if renderer else "")
        yield row("off-screen pictures", what)
    except Exception as error:
        yield broken("off-screen pictures", error, _PICTURES)


_PICTURES = f"{APT} libegl1 libgl1-mesa-dri"


def compiler() -> Iterator[Row]:
    """The C compiler that dolfinx's forms are compiled with: an extension with Python.h is compiled and linked."""
    remedy = f"{APT} gcc libc6-dev python3-dev"
    command = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
    if shutil.which(command[0]) is None:
        yield {**row("C compiler", f"{command[0]} is not installed", False, remedy), "without": SHELL}
        return
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text("#include <Python.h>\n#include <math.h>\nint probe(void) { return 0; }\n")
        include = [f"-I{sysconfig.get_path(name)}" for name in ("include", "platinclude")]
        done = subprocess.run(
            [*command, "-shared", "-fPIC", *include, str(source), "-o", str(Path(folder, "probe.so"))],
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        error = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        yield row("C compiler", f"{command[0]} fails: {error.rpartition('error: ')[2]}"[:200], False, remedy)
        return
    version = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=False).stdout
    yield row("C compiler", version.partition("\n")[0])


PROBES: dict[str, Callable[[], Iterator[Row]]] = {
    "python": python,
    "ipopt": ipopt,
    "dolfinx": dolfinx,
    "pictures": pictures,
    "compiler": compiler,
}


def main(name: str) -> None:
    """Runs one probe; its rows are printed as they come, so that a crash later on does not lose them."""
    for entry in PROBES[name]():
        print("\n" + MARK + json.dumps([entry]), flush=True)
    sys.stderr.flush()
    os._exit(0)  # some libraries crash in their own clean-up, which is none of our business


if __name__ == "__main__":
    main(sys.argv[1])
