"""The variants of `make portable` compute as they say, and their selection names tests that exist."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

import pytest

from tests import portable
from tests.portable import IPOPT_ORDER, PROVED, ROOT, SENSITIVE, VARIANTS


@pytest.mark.parametrize("test", sorted({*PROVED, *SENSITIVE}))
def test_what_is_run_exists(test):
    path, _, name = test.partition("::")
    assert (ROOT / path).exists()
    assert not name or f"def {name.partition('[')[0]}(" in (ROOT / path).read_text()


@cache
def told(name, code):
    """What a process of the variant prints."""
    return told_here(code, tuple(portable.environment(name).items()))


@cache
def told_here(code, more=()):
    """What a process prints, with more environment variables than ours."""
    environment = {**os.environ, **dict(more)}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment, cwd=ROOT
    ).stdout.strip()


@pytest.mark.parametrize("name", [name for name, variant in VARIANTS.items() if variant.numpy])
def test_numpy_has_no_vector_units_beyond_its_least(name):
    code = (
        "try:\n    import numpy._core._multiarray_umath as m\n"
        "except ImportError:\n    import numpy.core._multiarray_umath as m\n"
        "print([name for name in m.__cpu_dispatch__ if m.__cpu_features__.get(name)])"
    )
    assert told(name, code) == "[]"


def test_numba_compiles_for_any_processor():
    code = "from numba.core import config; print(config.CPU_NAME)"
    assert told("numba-generic", code) == told("oldest", code) == "generic"


@pytest.mark.parametrize("name", VARIANTS)
def test_kernels_for_another_processor_are_kept_apart(name):
    if portable.lacks(name) is not None:
        pytest.skip(str(portable.lacks(name)))
    found = told(name, "from ribbon.element import kernel_cache; print(kernel_cache.root())")
    own = told_here("from ribbon.element import kernel_cache; print(kernel_cache.root())")
    generic = str(portable.PLACE / "kernels" / "generic" / "kernels")
    assert found == (generic if VARIANTS[name].kernels else own)


@pytest.mark.parametrize("name", [name for name, variant in VARIANTS.items() if variant.blas])
def test_openblas_computes_as_the_processor_that_it_is_told(name):
    """Its own word for the kernels in use, from the symbols that MUMPS finds first."""
    if portable.lacks(name) is not None:
        pytest.skip(str(portable.lacks(name)))
    code = (
        "import ctypes; core = ctypes.CDLL(None).openblas_get_corename; core.restype = ctypes.c_char_p; "
        "print(core().decode())"
    )
    assert told(name, code) == VARIANTS[name].environment["OPENBLAS_CORETYPE"]


def test_ipopts_mumps_takes_another_ordering():
    code = "import tests.conftest, ribbon.solvers.ipopt as i; print(i.DEFAULT_OPTIONS.get('mumps_pivot_order'))"
    assert told("mumps-amf", code) == VARIANTS["mumps-amf"].environment[IPOPT_ORDER]
    assert told_here(code) == "None"


def test_an_unknown_variant_is_refused(capsys):
    with pytest.raises(SystemExit):
        portable.main(["vax"])
    assert "numba-generic" in capsys.readouterr().err


def test_what_is_run_and_what_is_said(monkeypatch, capsys):
    """One a day by its turn, those that are named, and all; red is exit code 1."""
    ran = []
    monkeypatch.setattr(portable, "run", lambda name, tests, more: ran.append((name, tests)) or name != "numpy-plain")
    monkeypatch.setattr(portable, "fetch_openblas", lambda: None)
    monkeypatch.setattr(portable, "lacks", lambda name: "no avx" if name == "blas-skylakex" else None)
    assert portable.main(["--turn"]) in (0, 1)
    assert [tests for _, tests in ran] == [PROVED]
    assert portable.main(["--turn", "oldest"]) == 0
    assert ran[1:] == [("oldest", PROVED)]
    assert portable.main(["numba-generic", "blas-skylakex", "numpy-plain"]) == 1
    assert ran[2:] == [("numba-generic", SENSITIVE), ("numpy-plain", SENSITIVE)]
    said = capsys.readouterr().out
    assert "blas-skylakex: no avx" in said
    assert "red in numpy-plain" in said
