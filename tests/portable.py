"""The tests that rounding can turn, in other arithmetic on this machine:  python -m tests.portable [VARIANT ...]

Another processor rounds otherwise: other vector units, another kernel of the linear algebra, a product and a sum in one
step or in two. What a test asks for has to hold on all of them. Each variant is a pytest of `SENSITIVE` in processes
whose libraries are told, by their own environment variables, to compute as on another processor; kernels are compiled
into a folder of the variant. Without names all that this machine can do are run, one after the other.

  --list        the variants, and which of them this machine cannot do
  --turn        one of them: another one every day
  --whole       the whole suite instead of `SENSITIVE`
  -- ARGUMENTS  for pytest

Exit code: 0 when all are green, 1 otherwise.
"""

from __future__ import annotations

import argparse
import ctypes.util
import datetime
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Where kernels and junit files of the variants are kept.
PLACE = ROOT / "out" / "portable"

#: Files and tests whose outcome hung on rounding once, or hangs on which branch an iteration takes.
SENSITIVE = (
    "tests/compare/studies/test_agreement.py",
    "tests/compare/studies/test_cost.py::test_runs_are_what_solve_finds",
    "tests/compare/models/test_judge.py",
    "tests/compare/models/test_refinements.py",
    "tests/compare/models/test_way.py",
    "tests/ribbon/find",
    "tests/ribbon/solvers",
    "tests/ribbon/rods",
    "tests/ribbon/tape",
    "tests/shellref/path/test_shell_arc.py",
    "tests/shellref/path/test_shell_singular.py",
    "tests/shellref/path/test_shell_buckling.py",
    "tests/shellref/elastica",
    "tests/shellref/rod",
)


@dataclass(frozen=True)
class Variant:
    """Other arithmetic: its environment variables; needs: flags of the processor; blas: OpenBLAS is put before the
    system's reference BLAS (which Ipopt's MUMPS calls), where it is installed; numpy: its vector units are left out."""

    environment: Mapping[str, str]
    needs: frozenset[str] = frozenset()
    blas: bool = False
    numpy: bool = False


VARIANTS: dict[str, Variant] = {
    "numba-generic": Variant({"NUMBA_CPU_NAME": "generic"}),
    "blas-prescott": Variant({"OPENBLAS_CORETYPE": "Prescott"}, blas=True),
    "blas-haswell": Variant({"OPENBLAS_CORETYPE": "Haswell"}, frozenset({"avx2", "fma"}), blas=True),
    "blas-skylakex": Variant({"OPENBLAS_CORETYPE": "SkylakeX"}, frozenset({"avx512f", "avx512vl"}), blas=True),
    "numpy-plain": Variant({}, numpy=True),
    "mumps-amf": Variant({"PETSC_OPTIONS": "-mat_mumps_icntl_7 2"}),
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


def environment(name: str) -> dict[str, str]:
    """The environment variables of a variant, beyond those of this process."""
    variant = VARIANTS[name]
    found = {**variant.environment, "RIBBONBENCH_CACHE": str(PLACE / name / "cache")}
    if variant.numpy and (units := vector_units()):
        found["NPY_DISABLE_CPU_FEATURES"] = units
    library = ctypes.util.find_library("openblas") if variant.blas else None
    if library is not None:
        found["LD_PRELOAD"] = " ".join(part for part in (library, os.environ.get("LD_PRELOAD")) if part)
    return found


def lacks(name: str) -> str | None:
    """What this machine lacks for a variant; None: nothing."""
    missing = VARIANTS[name].needs - flags()
    return f"the processor has no {', '.join(sorted(missing))}" if missing else None


def run(name: str, whole: bool, arguments: Sequence[str]) -> bool:
    """Whether the tests are green in a variant."""
    PLACE.joinpath(name).mkdir(parents=True, exist_ok=True)
    tests = [] if whole else list(SENSITIVE)
    workers = os.environ.get("WORKERS", "2")
    words = [sys.executable, "-m", "pytest", "-n", workers, "--dist", "worksteal", "-m", "not validate"]
    words += [f"--junitxml={PLACE / name / 'junit.xml'}", "-p", "no:cacheprovider", *arguments, *tests]
    done = subprocess.run(words, cwd=ROOT, env={**os.environ, **environment(name)}, check=False)
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
    able = [name for name in VARIANTS if lacks(name) is None]
    if options.list:
        for name in VARIANTS:
            print(f"{name:14} {lacks(name) or ' '.join(f'{k}={v}' for k, v in environment(name).items())}")
        return 0
    chosen = options.variants or able
    if options.turn:
        chosen = [able[datetime.date.today().toordinal() % len(able)]]
    red = []
    for name in chosen:
        why = lacks(name)
        print(f"portable: {name}: {why or 'running'}", flush=True)
        if why is None and not run(name, options.whole, more):
            red.append(name)
    print(f"portable: red in {', '.join(red)}" if red else f"portable: green in {', '.join(chosen)}")
    return 1 if red else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
