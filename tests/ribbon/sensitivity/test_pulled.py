"""Where small terms pull a strip with a free twist: against solving again, by a term whose effect is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, Strip, gradients, solve
from ribbon.element.element import free_jet
from ribbon.errors import NotDifferentiable
from ribbon.result import Status
from ribbon.sensitivity import pulled_chain
from ribbon.sensitivity.pulled import pulled
from ribbon.sensitivity.system import point

R = 2.0**-0.5
HELD = Clamp((0, 0, 0), (0, 0, 1), (-R, R, 0), "straight")
UP = Gravity((1, 0, 0))
S = np.linspace(0.0, 1.0, 41)


def strip(gamma=40.0, length=1.0):
    return Strip(length, 0.05, 0.35, 5.0, gamma, thickness=1e-3)


def held(gamma=40.0, **changes):
    keys = {"energy": "finite", "segments": 16, **changes}
    return solve(strip(gamma), HELD, UP, **keys)


def elastic_slope(found):
    """Derivative (p, 4 or 6) of the elastic energy by the parameters of every segment."""
    q, fields = found.parameters, found.problem.fields
    out, jet = np.empty(q.shape), np.empty(15 if q.shape[1] == 4 else 28)
    for i, length in enumerate(found.problem.lengths):
        free_jet(fields.code, q[i].copy(), float(length), 5.0, 0.0, fields.section, jet)
        out[i] = jet[1 : 1 + q.shape[1]]
    return out


@pytest.mark.parametrize("formulation", ["chained", "mixed"])
def test_more_elastic_energy_is_less_weight(formulation):
    """(1 + e) E_elastic + E_gravity is in equilibrium where E_elastic + E_gravity / (1 + e) is."""
    share = 1e-4
    here = held(formulation=formulation, in_plane=True)
    lighter, heavier = (held(40.0 / (1.0 + e), formulation=formulation, in_plane=True) for e in (share, -share))
    slope = elastic_slope(here)
    moved = pulled(here, [share * slope, -2.0 * share * slope]).terms
    for found, times in zip(moved, (1.0, -2.0), strict=True):
        expected = times * 0.5 * (lighter.position(S) - heavier.position(S))
        size = np.abs(expected).max()
        assert size > 1e-6
        np.testing.assert_allclose(found.position(S) - here.position(S), expected, rtol=0.0, atol=2e-3 * size)


def test_a_strip_stiff_in_its_plane_takes_a_step_towards_the_one_that_is_not():
    """The thicker, the farther; the first step is nearly the whole way."""
    here, there = held(), held(in_plane=True)
    step = pulled(here, [np.zeros((16, 4))])
    path = there.position(S) - here.position(S)
    found = step.in_plane.position(S) - here.position(S)
    assert np.abs(path).max() > 1e-5
    np.testing.assert_allclose(found, path, rtol=0.0, atol=0.03 * np.abs(path).max())
    assert np.abs(step.terms[0].position(S) - here.position(S)).max() < 1e-12
    bent = step.in_plane.in_plane(S)
    np.testing.assert_allclose(bent, there.in_plane(S), rtol=0.0, atol=0.03 * np.abs(bent).max())


def test_terms_pull_alike_with_and_without_bending_in_the_plane():
    """By the factors of the chained Hessian as by the tangent of all unknowns of the glued strip, quaternions too."""
    here = held()
    one, two = (pulled(found, [1e-3 * elastic_slope(found)]) for found in (here, held(formulation="mixed")))
    for a, b in ((one.terms[0], two.terms[0]), (one.in_plane, two.in_plane)):
        assert np.abs(a.position(S) - here.position(S)).max() > 1e-7
        np.testing.assert_allclose(a.position(S), b.position(S), atol=1e-10)
        np.testing.assert_allclose(a.frame(S), b.frame(S), atol=1e-9)


def test_a_strip_that_is_nearly_neutral_is_left_to_the_tangent_of_all_unknowns(monkeypatch):
    """Factors without pivoting are not trusted with every condition."""
    here = held()
    assert pulled_chain.along_the_chain(here.problem, here.x, [np.zeros((16, 4))]) is not None
    monkeypatch.setattr(pulled_chain, "_CONDITION", 1.0)
    assert pulled_chain.along_the_chain(here.problem, here.x, [np.zeros((16, 4))]) is None
    assert np.isfinite(pulled(here, [np.zeros((16, 4))]).in_plane.x).all()


def test_a_chained_strip_keeps_its_energy_and_its_bending_in_the_plane():
    """On the unknowns of the glued ribbon it is the same equilibrium, with the same derivatives."""
    keys = {"energy": "kirchhoff", "stiffness": "plate", "segments": 12}
    clamp = Clamp((0, 0, 0), (0, 0, 1), (-R, R, 0))
    chained, mixed = (solve(strip(), clamp, UP, formulation=name, **keys) for name in ("chained", "mixed"))
    here = point(chained)
    assert here.problem.value(here.x) == pytest.approx(chained.energy.total, rel=1e-12)
    lower, upper = here.problem.bounds()
    residual = here.problem.gradient(here.x) + here.problem.jacobian_matrix(here.x).T @ here.rows
    assert np.abs(residual[lower < upper]).max() < 1e-6
    a, b = (gradients(found, wrt=["gamma"]).position(1.0)["gamma"] for found in (chained, mixed))
    np.testing.assert_allclose(a, b, rtol=1e-5)


def test_what_is_no_equilibrium_is_refused():
    with pytest.raises(NotDifferentiable):
        pulled(replace(held(), status=Status.NOT_CONVERGED), [np.zeros((16, 4))])


def test_a_closed_band_that_bends_in_its_plane_has_a_row_more():
    """The seam holds the curvature in the plane too, and exerts nothing on the band that has none."""
    band = solve(
        Strip(1.0, 0.05, 0.35, 5.0, 0.0, thickness=1e-3), closure=Closure("circle"), energy="finite", segments=8
    )
    assert band.problem.fields.count == 2
    slope = elastic_slope(band)
    moved = pulled(band, [0.0 * slope])
    assert moved.in_plane.problem.row_count == band.problem.row_count + 1
    assert np.abs(moved.terms[0].omega(S) - band.omega(S)).max() < 1e-9
