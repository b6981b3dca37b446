"""Linear buckling of struts: closed forms, orders, modes; and the same on dolfinx with SLEPc."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.integrate

from shellref.elastica.arc import point_at, trace
from shellref.elastica.buckling import ENDS, buckling_modes, exact_loads, strut
from shellref.elastica.problem import LoadPath
from shellref.elastica.system import System

MESHES = {1: (10, 30, 100, 300, 1000), 2: (10, 20, 40, 80), 3: (6, 9, 12, 18), 4: (2, 3, 4, 6)}


@pytest.mark.parametrize("degree", MESHES)
@pytest.mark.parametrize("ends", ENDS)
def test_loads_converge_with_twice_the_degree(ends, degree):
    """From both sides, and from above (Rayleigh)."""
    counts = np.array(MESHES[degree])
    ratios = np.array([buckling_modes(int(n), degree, 1, ends).loads[0] for n in counts]) / exact_loads(ends, 1)[0] - 1
    assert np.all(ratios > -1e-13)
    slopes = -np.diff(np.log(ratios)) / np.diff(np.log(counts))
    assert np.all(np.abs(slopes[1:] - 2 * degree) < 0.2), slopes


def test_the_lab_sheets_table():
    """The first four loads for 10, 100 and 1000 linear elements; (2 i - 1)^4 pi^2 / 48 n^2 is the leading error."""
    exact = exact_loads("clamped-free")
    assert exact == pytest.approx([(2 * i - 1) ** 2 * math.pi**2 / 4 for i in (1, 2, 3, 4)], rel=1e-15)
    for count in (10, 100, 1000):
        loads = buckling_modes(count).loads
        assert loads.shape == (4,)
        leading = exact / (12 * count**2)
        assert loads / exact - 1 == pytest.approx(leading, rel=0.02 if count > 10 else 0.15)


@pytest.mark.parametrize(("degree", "hermite"), [(1, False), (2, False), (3, True)])
def test_modes_have_the_root_that_the_sheet_drops(degree, hermite):
    """sin(sqrt(P_i) s); sin(P_i s), as printed, is nowhere near."""
    found = buckling_modes(100, degree, 4, hermite=hermite)
    assert found.modes.shape == (4, 101)
    for load, mode in zip(found.loads, found.modes, strict=True):
        right = np.sin(np.sqrt(load) * found.s)
        right /= right[np.argmax(np.abs(right))]
        assert min(np.max(np.abs(mode - right)), np.max(np.abs(mode + right))) < 5e-3
        printed = np.sin(load * found.s)
        assert min(np.max(np.abs(mode - printed)), np.max(np.abs(mode + printed))) > 0.3


def test_a_pinned_struts_mode_is_a_cosine_and_leaves_the_ends_on_the_axis():
    found = buckling_modes(60, 2, 2, "pinned-pinned")
    assert np.max(np.abs(np.abs(found.modes[0]) - np.abs(np.cos(math.pi * found.s)))) < 1e-5
    assert abs(scipy.integrate.trapezoid(found.modes[0], found.s)) < 1e-9


@pytest.mark.parametrize("ends", ENDS)
def test_the_path_bifurcates_at_the_linear_load(ends):
    """Two ways to one number on one mesh: an eigenvalue of the path's tangent, and the linear problem."""
    first = buckling_modes(12, 3, 1, ends).loads[0]
    path = LoadPath(strut(ends, 0.0), strut(ends, 1.2 * first))
    system = System(np.linspace(0.0, 1.0, 13), 3, path)
    branch = trace(system, point_at(system, np.zeros(system.size), 0.0), 1.0, (0.0, 1.0))
    assert len(branch.bifurcations()) == 1
    assert 1.2 * first * branch.bifurcations()[0].point.t == pytest.approx(first, rel=1e-10)


@pytest.mark.shell
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("elements", [10, 100, 1000])
def test_dolfinx_and_slepc_agree(elements, degree):
    """Same mesh and degree, other assembly and eigensolver: 1e-10 in the loads, 1e-8 in the modes."""
    pytest.importorskip("dolfinx")
    from tests.validation.elastica.stem_buckling import stem_buckling

    other, own = stem_buckling(elements, degree), buckling_modes(elements, degree)
    assert other.loads.shape == (4,)
    assert np.max(np.abs(other.loads / own.loads - 1.0)) < 1e-10
    assert np.max(other.residuals) < 1e-10
    assert np.max(np.abs(np.abs(other.modes[:, ::degree]) - np.abs(own.modes))) < 1e-8
    assert other.s.shape == (degree * elements + 1,)
    assert np.max(np.abs(other.s[::degree] - own.s)) < 1e-13


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: buckling_modes(0), "elements = 0"),
        (lambda: buckling_modes(3, 1, 4), "count = 4"),
        (lambda: buckling_modes(10, 1, 0), "count = 0"),
        (lambda: buckling_modes(10, ends="free-free"), "ends = 'free-free'"),
        (lambda: strut("clamped"), "ends = 'clamped'"),
        (lambda: exact_loads("none"), "ends = 'none'"),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ValueError) as caught:
        call()
    assert word in str(caught.value)


@pytest.mark.shell
@pytest.mark.parametrize(("arguments", "word"), [((0,), "elements = 0"), ((2, 1, 3), "count = 3")])
def test_bad_input_to_dolfinx_is_named(arguments, word):
    pytest.importorskip("dolfinx")
    from tests.validation.elastica.stem_buckling import stem_buckling

    with pytest.raises(ValueError) as caught:
        stem_buckling(*arguments)
    assert word in str(caught.value)
