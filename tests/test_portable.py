"""The variants of `make portable` compute as they say, and their selection names tests that exist."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests import portable
from tests.portable import ROOT, SENSITIVE, VARIANTS


@pytest.mark.parametrize("test", SENSITIVE)
def test_what_is_sensitive_exists(test):
    path, _, name = test.partition("::")
    assert (ROOT / path).exists()
    assert not name or f"def {name}(" in (ROOT / path).read_text()


def told(name, code):
    """What a process of the variant prints."""
    environment = {**os.environ, **portable.environment(name)}
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
def test_a_variant_keeps_its_kernels_apart(name):
    found = told(name, "from ribbon.element import kernel_cache; print(kernel_cache.root())")
    assert found == str(portable.PLACE / name / "cache" / "kernels")


def test_an_unknown_variant_is_refused(capsys):
    with pytest.raises(SystemExit):
        portable.main(["vax"])
    assert "numba-generic" in capsys.readouterr().err


def test_what_is_run_and_what_is_said(monkeypatch, capsys):
    """One a day by its turn, those that are named, and all; red is exit code 1."""
    ran = []
    monkeypatch.setattr(portable, "run", lambda name, whole, more: ran.append(name) or name != "numpy-plain")
    monkeypatch.setattr(portable, "lacks", lambda name: "no avx" if name == "blas-skylakex" else None)
    assert portable.main(["--turn"]) in (0, 1)
    assert len(ran) == 1
    assert portable.main(["numba-generic", "blas-skylakex", "numpy-plain"]) == 1
    assert ran[1:] == ["numba-generic", "numpy-plain"]
    said = capsys.readouterr().out
    assert "blas-skylakex: no avx" in said
    assert "red in numpy-plain" in said
