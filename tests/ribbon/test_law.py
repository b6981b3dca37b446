"""Natural curvature as a table, natural twist and natural curvature in the plane of the ribbon's energies."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import scipy.integrate

from ribbon import Clamp, Gravity, RibbonInputError, Session, Strip, gradients, solve
from ribbon import law as laws
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, add_pretwist, free_density
from ribbon.energies.section.profile import Local
from ribbon.find.solve import build

TABLE = ((0.0, 0.0), (0.3, 10.0), (0.5, -4.0), (1.0, 6.0))
UP = Gravity(up=(0.0, 1.0, 0.0))
SECTION = (0.02, 5e-4, 0.35, 0.0)


def test_a_table_is_what_it_says():
    s = np.array([0.0, 0.15, 0.3, 0.4, 0.75, 1.0])
    np.testing.assert_allclose(laws.at(TABLE, s), [0.0, 5.0, 10.0, 3.0, 1.0, 6.0], rtol=1e-15)
    fine = np.linspace(0.0, 1.0, 200001)
    assert laws.constant(TABLE) == pytest.approx(
        0.5 * scipy.integrate.trapezoid(laws.at(TABLE, fine) ** 2, fine), rel=1e-9
    )
    lengths = laws.cut(TABLE, np.full(4, 0.25))
    np.testing.assert_allclose(np.cumsum(lengths), [0.25, 0.3, 0.5, 0.75, 1.0], rtol=1e-15)
    pieces = laws.pieces(TABLE, lengths)
    np.testing.assert_allclose(pieces[:, 0], laws.at(TABLE, np.cumsum(lengths) - lengths), atol=1e-14)
    np.testing.assert_allclose(pieces[:, 1] * lengths, np.diff(laws.at(TABLE, np.append(0.0, np.cumsum(lengths)))))
    part = laws.part(TABLE, 0.25, 0.75)
    np.testing.assert_allclose(laws.at(part, (s[3:4] - 0.25) / 0.5), laws.at(TABLE, s[3:4]))
    assert laws.read("k", [[0.0, 1.0], [2.0, 3.0]], 2.0) == (1.0, 3.0)


@pytest.mark.parametrize(
    "table",
    [[[0.0, 1.0]], [[0.0, 1.0], [0.5, 2.0]], [[0.1, 1.0], [1.0, 2.0]], [[0.0, 1.0], [0.7, 1.0], [0.6, 1.0], [1.0, 0.0]],
     [[0.0, 1.0], [0.0, 1.0], [1.0, 2.0]], [[0.0, 1.0], [1.0]], [[0.0, "x"], [1.0, 2.0]], [1.0, 2.0, 3.0]],
)  # fmt: skip
def test_a_table_that_is_none_is_refused(table):
    with pytest.raises(RibbonInputError) as caught:
        Strip(1.0, 0.1, natural_curvature=table)
    assert caught.value.key == "natural_curvature"


def test_segments_that_pass_a_point_are_refused():
    with pytest.raises(RibbonInputError):
        laws.pieces(TABLE, np.full(4, 0.25))
    assert build(Strip(1.0, 0.05, natural_curvature=TABLE), Clamp(), segments=4).lengths.size == 5


def test_points_on_a_line_change_nothing_and_kinks_keep_the_order():
    strip = {"length": 1.0, "width": 0.03, "poisson": 0.3, "gamma": 20.0}
    line = ((0.0, 2.0), (0.25, 3.5), (1.0, 8.0))
    plain = solve(Strip(**strip, natural_curvature=(2.0, 8.0)), Clamp(), UP, segments=8)
    same = solve(Strip(**strip, natural_curvature=line), Clamp(), UP, segments=8)
    np.testing.assert_allclose(same.end.position, plain.end.position, atol=1e-12)
    ends = [solve(Strip(**strip, natural_curvature=TABLE), Clamp(), UP, segments=n).end.position for n in (10, 20, 40)]
    first, second = (np.linalg.norm(b - a) for a, b in pairwise(ends))
    assert first / second > 12.0  # order 4


def test_derivatives_of_a_table_are_by_its_places():
    e = solve(Strip(1.0, 0.03, 0.3, TABLE, gamma=20.0), Clamp(), UP, segments=8)
    with pytest.raises(RibbonInputError):
        gradients(e, ["natural_curvature"])
    by = gradients(e, ["natural_curvature(s)", "poisson"])
    step = 1e-4
    moved = [
        solve(Strip(1.0, 0.03, 0.3, tuple((s, k + d) for s, k in TABLE), gamma=20.0), Clamp(), UP, segments=8)
        for d in (-step, step)
    ]
    change = (moved[1].end.position - moved[0].end.position) / (2 * step)
    here = by.position(np.array([1.0]))["natural_curvature(s)"].sum(axis=-1)[0]
    np.testing.assert_allclose(here, change, atol=1e-6)
    session = Session(Strip(1.0, 0.03, 0.3, TABLE), Clamp(), segments=8)
    with pytest.raises(RibbonInputError):
        session.move(natural_curvature=1.0)


def numbers(name, k, t, natural, rest):
    out = np.zeros(15)
    free_density(FREE_CODES[name], k, t, 0.0, 0.0, natural, 0.0, SECTION, out)
    add_pretwist(FREE_CODES[name], k, t, natural, rest, SECTION, out)
    return out


@pytest.mark.parametrize("name", ["kirchhoff", "extensible", "sano"])
def test_pretwist_has_its_derivatives_and_rests_at_the_natural_twist(name):
    k, t, natural, rest, h = 6.0, 2.5, 4.0, 1.7, 1e-4
    here = numbers(name, k, t, natural, rest)
    by_k = (numbers(name, k + h, t, natural, rest) - numbers(name, k - h, t, natural, rest)) / (2 * h)
    by_t = (numbers(name, k, t + h, natural, rest) - numbers(name, k, t - h, natural, rest)) / (2 * h)
    np.testing.assert_allclose(here[[1, 5, 6]], by_k[[0, 1, 2]], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(here[[2, 6, 9]], by_t[[0, 1, 2]], rtol=1e-7, atol=1e-7)
    still = numbers(name, natural, rest, natural, rest)
    assert still[0] + 0.5 * natural**2 == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(still[1:3], 0.0, atol=1e-9)
    local = Local(*(np.array([x]) for x in (k, t, 0.0, 0.0, natural, 0.0, rest, 0.0)))
    xi, w = np.polynomial.legendre.leggauss(200)
    shares = FREE_ENERGIES[name].section.shares(local, SECTION[0] * xi, SECTION)
    assert (shares.total @ w)[0] / 2.0 == pytest.approx(here[0] + 0.5 * natural**2, rel=1e-6)


@pytest.mark.parametrize("name", ["kirchhoff", "extensible"])
def test_a_strip_without_load_is_its_rest_shape(name):
    """The helix of constant curvatures in closed form: exp of the skew matrix."""
    rest = np.array([1.5, 2.0, 0.7])
    strip = Strip(1.0, 0.05, 0.3, rest[0], thickness=1e-3, natural_twist=rest[2], natural_geodesic_curvature=rest[1])
    e = solve(strip, Clamp(), energy=name, segments=6)
    assert e.ok
    from scipy.spatial.transform import Rotation

    frame = Rotation.from_rotvec(rest).as_matrix()
    own = Clamp().frame
    np.testing.assert_allclose(e.end.frame, own @ frame, atol=1e-9)
    assert e.energy.elastic == pytest.approx(-0.5 * rest[0] ** 2, abs=1e-12)


@pytest.mark.parametrize(
    ("given", "energy", "key"),
    [
        ({"natural_twist": 1.0}, "wunderlich", "natural_twist"),
        ({"natural_twist": 1.0}, "finite", "natural_twist"),
        ({"natural_geodesic_curvature": 1.0}, "sadowsky", "natural_geodesic_curvature"),
    ],
)
def test_an_energy_that_does_not_know_the_shape_refuses_it(given, energy, key):
    with pytest.raises(RibbonInputError) as caught:
        build(Strip(1.0, 0.05, 0.3, thickness=1e-3, **given), Clamp(), energy=energy)
    assert caught.value.key == key
