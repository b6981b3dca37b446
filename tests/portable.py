"""The tests that rounding can turn, in other arithmetic on this machine:  python -m tests.portable [VARIANT ...]

Another processor rounds otherwise: other vector units, another kernel of the linear algebra, a product and a sum in one
step or in two. What a test asks for has to hold on all of them. Each variant is a pytest of `SENSITIVE` in processes
whose libraries are told, by their own environment variables, to compute as on another processor; kernels for another
processor are compiled into a folder of their own. Without names all that this machine can do are run, in turn.

OpenBLAS is not installed for it, which would give every program of the machine another BLAS: Debian's package is
fetched once (`apt-get download`, no root), unpacked under out/portable, and put before the reference BLAS.

  --list        the variants, and which of them this machine cannot do
  --turn        the tests of `PROVED` only; without names in one variant, another one every day
  --whole       the whole suite instead of `SENSITIVE`
  -- ARGUMENTS  for pytest

Exit code: 0 when all are green, 1 otherwise.
"""

from __future__ import annotations

import argparse
import datetime
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Where kernels and junit files of the variants are kept.
PLACE = ROOT / "out" / "portable"

#: Tests that were red in other arithmetic once: `make test` runs them in one variant.
PROVED = (
    "tests/compare/studies/test_agreement.py::test_a_shell_that_fails_is_a_status_and_exit_code_1",
    "tests/compare/studies/test_cost.py::test_runs_are_what_solve_finds[bowed]",
    "tests/compare/models/test_judge.py::test_newton_and_ipopt_end_in_one_state[roman_folds]",
    "tests/compare/models/test_judge.py::test_newton_and_ipopt_end_in_one_state[roman_plate]",
)

#: These, and files whose outcome hangs on which branch an iteration takes.
SENSITIVE = (
    *PROVED[:2],
    "tests/compare/battery/test_cases.py::test_the_quick_rungs_hold[degenerate/taut_clamps [shortening / l = 1e-12]]",
    "tests/compare/models/test_judge.py",
    "tests/compare/models/test_refinements.py",
    "tests/compare/models/test_way.py",
    "tests/ribbon/find/test_basin.py",
    "tests/ribbon/find/test_curl_length.py",
    "tests/ribbon/find/test_free_minima.py",
    "tests/ribbon/find/test_many.py",
    "tests/ribbon/find/test_minima.py",
    "tests/ribbon/find/test_moebius.py",
    "tests/ribbon/find/test_on_edge.py",
    "tests/ribbon/find/test_slow_cases.py",
    "tests/ribbon/find/test_spectrum.py",
    "tests/ribbon/solvers/test_chained_newton.py",
    "tests/ribbon/solvers/test_frontal.py",
    "tests/ribbon/solvers/test_newton_rows.py",
    "tests/ribbon/solvers/test_riccati.py",
    "tests/ribbon/rods",
    "tests/ribbon/tape",
    "tests/shellref/path/test_shell_arc.py",
    "tests/shellref/path/test_shell_singular.py",
    "tests/shellref/path/test_shell_buckling.py",
    "tests/shellref/elastica/test_elastica_buckling.py",
    "tests/shellref/rod/test_rod_derivatives.py",
)

#: Of `tests/conftest.py`: the ordering that Ipopt's MUMPS takes, its option mumps_pivot_order.
IPOPT_ORDER = "RIBBONBENCH_TESTS_IPOPT_ORDER"
#: Of `tests/slow.py`: "1" takes the slow tests for ordinary ones.
SLOW_TOO = "RIBBONBENCH_TESTS_SLOW"

#: Debian's package with every kernel of OpenBLAS in one library, chosen at run time.
OPENBLAS = "libopenblas0-pthread"


@dataclass(frozen=True)
class Variant:
    """Other arithmetic: its environment variables; needs: flags of the processor; blas: OpenBLAS is put before the
    system's reference BLAS (which MUMPS calls, Ipopt's and PETSc's); numpy: its vector units are left out."""

    environment: Mapping[str, str]
    needs: frozenset[str] = frozenset()
    blas: bool = False
    numpy: bool = False

    @property
    def kernels(self) -> str | None:
        """Whose kernels of numba: None, this processor's."""
        return self.environment.get("NUMBA_CPU_NAME")


VARIANTS: dict[str, Variant] = {
    "numba-generic": Variant({"NUMBA_CPU_NAME": "generic"}),
    "blas-prescott": Variant({"OPENBLAS_CORETYPE": "Prescott"}, blas=True),
    "blas-haswell": Variant({"OPENBLAS_CORETYPE": "Haswell"}, frozenset({"avx2", "fma"}), blas=True),
    "blas-skylakex": Variant({"OPENBLAS_CORETYPE": "SkylakeX"}, frozenset({"avx512f", "avx512vl"}), blas=True),
    "numpy-plain": Variant({}, numpy=True),
    "mumps-amf": Variant({"PETSC_OPTIONS": "-mat_mumps_icntl_7 2", IPOPT_ORDER: "2"}),
    "oldest": Variant({"NUMBA_CPU_NAME": "generic", "OPENBLAS_CORETYPE": "Prescott"}, blas=True, numpy=True),
}


def flags() -> frozenset[str]:
    """What the processor can do, in the kernel's words; nothing where it does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return frozenset()
    return frozenset(next((line.partition(":")[2].split() for line in lines if line.startswith("flags")), []))


def vector_units() -> str:
    """NumPy's vector units beyond its least that this processor has: what NPY_DISABLE_CPU_FEATURES can leave out."""
    code = (
        "try:\n    import numpy._core._multiarray_umath as m\n"
        "except ImportError:\n    import numpy.core._multiarray_umath as m\n"
        "print(' '.join(name for name in m.__cpu_dispatch__ if m.__cpu_features__.get(name)))"
    )
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def openblas() -> Path | None:
    """The library, where it has been unpacked."""
    return next((PLACE / "openblas").glob("usr/lib/*/openblas-pthread/libopenblas.so.0"), None)


def fetch_openblas() -> None:
    """Brings it from Debian, once; where that does not succeed `lacks` says so."""
    if openblas() is not None or shutil.which("apt-get") is None:
        return
    place = PLACE / "openblas"
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["apt-get", "-qq", "download", OPENBLAS], cwd=place, check=False, capture_output=True)
    for package in place.glob(f"{OPENBLAS}_*.deb"):
        subprocess.run(["dpkg-deb", "-x", package.name, "."], cwd=place, check=False, capture_output=True)


def environment(name: str) -> dict[str, str]:
    """The environment variables of a variant, beyond those of this process."""
    variant = VARIANTS[name]
    found = dict(variant.environment)
    if variant.kernels is not None:
        found["RIBBONBENCH_CACHE"] = str(PLACE / "kernels" / variant.kernels)
    if variant.numpy and (units := vector_units()):
        found["NPY_DISABLE_CPU_FEATURES"] = units
    library = openblas() if variant.blas else None
    if library is not None:
        found["LD_PRELOAD"] = " ".join(part for part in (str(library), os.environ.get("LD_PRELOAD")) if part)
    return found


def lacks(name: str) -> str | None:
    """What this machine lacks for a variant; None: nothing."""
    missing = VARIANTS[name].needs - flags()
    if missing:
        return f"the processor has no {', '.join(sorted(missing))}"
    if VARIANTS[name].blas and openblas() is None:
        return f"OpenBLAS is not there (apt-get download {OPENBLAS} did not succeed)"
    return None


def run(name: str, tests: Sequence[str], arguments: Sequence[str]) -> bool:
    """Whether these tests (none: the whole suite) are green in a variant."""
    PLACE.joinpath(name).mkdir(parents=True, exist_ok=True)
    workers = os.environ.get("WORKERS", "2")
    words = [sys.executable, "-m", "pytest", "-n", workers, "--dist", "worksteal", "-m", "not validate"]
    words += [f"--junitxml={PLACE / name / 'junit.xml'}", "-p", "no:cacheprovider", *arguments, *tests]
    done = subprocess.run(words, cwd=ROOT, env={**os.environ, SLOW_TOO: "1", **environment(name)}, check=False)
    return done.returncode == 0


def main(words: Sequence[str]) -> int:
    """The exit code."""
    own, more = list(words), []
    if "--" in own:
        place = own.index("--")
        own, more = own[:place], own[place + 1 :]
    parser = argparse.ArgumentParser(prog="python -m tests.portable", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("variants", nargs="*", metavar="VARIANT", help=", ".join(VARIANTS))
    for flag in ("--list", "--turn", "--whole"):
        parser.add_argument(flag, action="store_true")
    options = parser.parse_args(own)
    unknown = set(options.variants) - VARIANTS.keys()
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: no such variant; there are {', '.join(VARIANTS)}")
    fetch_openblas()
    able = [name for name in VARIANTS if lacks(name) is None]
    if options.list:
        for name in VARIANTS:
            print(f"{name:14} {lacks(name) or ' '.join(f'{k}={v}' for k, v in environment(name).items())}")
        return 0
    chosen, tests = options.variants or able, () if options.whole else SENSITIVE
    if options.turn:
        tests = PROVED
        chosen = options.variants or [able[datetime.date.today().toordinal() % len(able)]]
    red = []
    for name in chosen:
        why = lacks(name)
        print(f"portable: {name}: {why or 'running'}", flush=True)
        if why is None and not run(name, tests, more):
            red.append(name)
    if red:
        flag = " --turn" if options.turn else ""
        print(f"portable: red in {', '.join(red)}; again: python -m tests.portable{flag} {' '.join(red)}")
    else:
        print(f"portable: green in {', '.join(chosen)}")
    return 1 if red else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
