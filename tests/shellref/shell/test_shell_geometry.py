"""The parts of the shell that are plain NumPy: natural shape, grid, directors, evaluated surface."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shellref import ShellSurface
from shellref.shell import director
from shellref.shell.body import Control
from shellref.shell.clamps import reactions
from shellref.shell.grid import Grid, knots_across, knots_along, snapped
from shellref.shell.material import plane_stress, stiffness_factors, young
from shellref.shell.midsurface import natural_curve, natural_strip

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("law", [(0.0, 0.0), (10.0, 10.0), (-10.0, -10.0), (-30.0, 55.0), (100.0, 0.0)])
def test_natural_curve_against_the_frame_equation(law):
    """r' = t, t' = -K n, n' = K t with K linear, by a Runge-Kutta of order 8."""
    s = np.linspace(0.0, 1.0, 31)

    def right(x, y):
        k = law[0] + (law[1] - law[0]) * x
        t, n = y[2:4], y[4:6]
        return np.concatenate([t, -k * n, k * t])

    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])  # components along (t_z, t_y)
    exact = solve_ivp(right, (0, 1), start, t_eval=s, method="DOP853", rtol=1e-12, atol=1e-13).y
    z, y = natural_curve(s[::-1], law)  # any order of abscissae
    np.testing.assert_allclose(np.stack([z, y])[:, ::-1], exact[:2], atol=2e-11)
    _, directors = natural_strip(s, 0 * s, np.zeros(3), np.eye(3), law)
    np.testing.assert_allclose(directors[:, [2, 1]].T, exact[4:6], atol=2e-11)


def test_material_constants():
    h, nu = 0.01, 0.3
    y = young(h, nu)
    assert y * h**3 / (12 * (1 - nu**2)) == pytest.approx(1.0, rel=1e-14)
    membrane, shear = stiffness_factors(h)
    assert membrane == pytest.approx(y * h / (1 - nu**2), rel=1e-14)
    assert shear * (1 - nu) == pytest.approx(5 / 6 * y / (2 * (1 + nu)) * h, rel=1e-14)
    np.testing.assert_allclose(plane_stress(nu), [[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])


@pytest.mark.parametrize("grading", [(1.0, 1.0), (0.2, 0.1)])
def test_grid_orders_nodes_and_lumps_the_area(grading):
    grid = Grid(knots_along(6, grading[0]), knots_across(5, grading[1], 0.1))
    assert (grid.elements, grid.cells) == ((6, 5), 30)
    mesh = np.stack(np.meshgrid(grid.s_nodes, grid.v_nodes, indexing="ij"), axis=-1).reshape(-1, 2)
    shuffle = RNG.permutation(len(mesh))
    order = grid.order(mesh[shuffle])
    np.testing.assert_array_equal(mesh[shuffle][order].reshape(-1, 2), mesh)
    lumped = grid.nodal_areas(mesh)
    assert lumped.sum() == pytest.approx(0.1, rel=1e-13)
    assert lumped @ mesh[:, 0] ** 2 == pytest.approx(0.1 / 3, rel=1e-13)  # Simpson is exact
    middles = np.stack(np.meshgrid(*(0.5 * (k[1:] + k[:-1]) for k in (grid.s_knots, grid.v_knots))), -1).reshape(-1, 2)
    assert grid.areas(middles).sum() == pytest.approx(0.1, rel=1e-13)
    np.testing.assert_allclose(grid.v_knots, -grid.v_knots[::-1], atol=1e-16)
    sizes = np.diff(grid.v_knots)
    assert sizes[0] / sizes[2] == pytest.approx(1.0, abs=1e-9) if grading[1] == 1 else sizes[0] < 0.4 * sizes[2]


def test_tangent_bases_are_orthonormal_everywhere():
    d = RNG.standard_normal((50, 3))
    d = np.vstack([d / np.linalg.norm(d, axis=1)[:, None], np.eye(3), -np.eye(3)])
    frames = np.concatenate([director.tangent_bases(d), d[:, :, None]], axis=2)
    products = np.einsum("nij,nik->njk", frames, frames)
    np.testing.assert_allclose(products, np.tile(np.eye(3), (len(d), 1, 1)), atol=1e-14)


def test_knots_are_graded_at_one_end_or_both_and_snap_to_places():
    one, two = knots_along(20, 0.1), knots_along(20, 0.1, both=True)
    for knots in (one, two):
        assert (knots[0], knots[-1]) == (0.0, 1.0)
        assert np.all(np.diff(knots) > 0)
    np.testing.assert_allclose(two, 1.0 - two[::-1], atol=1e-15)
    sizes = np.diff(one)
    assert sizes[0] < 0.4 * sizes[-1]
    assert sizes[-1] == pytest.approx(sizes[-2], rel=1e-3)
    moved = snapped(one, [0.037, 0.5])
    assert {0.037, 0.5} <= set(moved)
    assert np.sum(moved != one) == 2
    for places in ([0.001, 0.002], [1.5]):
        with pytest.raises(ValueError, match="more elements"):
            snapped(one, places)
    with pytest.raises(ValueError, match="more elements"):
        snapped(np.array([0.0, 1.0]), [0.3])


def test_refined_grids_are_nested():
    grid = Grid(knots_along(4, 0.3), knots_across(3, 0.5, 0.2))
    fine = grid.refined(3, 2)
    assert fine.elements == (12, 6)
    np.testing.assert_allclose(fine.s_knots[::3], grid.s_knots, atol=1e-15)
    np.testing.assert_allclose(fine.v_knots[::2], grid.v_knots, atol=1e-15)
    np.testing.assert_allclose(fine.s_knots[1], grid.s_knots[1] / 3, rtol=1e-12)


def _mixed_supports() -> tuple[np.ndarray, np.ndarray]:
    """Every combination of held translations with a director that is free, held or normal to an axis."""
    masks = np.array([[bool(k & 1), bool(k & 2), bool(k & 4)] for k in range(8)])
    kinds = [director.FREE, director.HELD, 0, 1, 2]
    return np.repeat(masks, len(kinds), axis=0), np.tile(kinds, len(masks))


@pytest.mark.parametrize("owned", [None, 23])
def test_projection_agrees_with_reduce_and_expand(owned):
    """Mixed supports; `owned`: the other nodes are ghosts, which have no unknowns here."""
    import scipy.sparse as sparse

    translations, kinds = _mixed_supports()
    n = len(kinds)
    d = RNG.standard_normal((n, 3))
    for axis in (0, 1, 2):
        d[kinds == axis, axis] = 0.0
    d /= np.linalg.norm(d, axis=1)[:, None]
    increments = director.Increments(translations, kinds, owned)
    bases = increments.bases(np.hstack([np.zeros((n, 3)), d]), Control())
    indptr, indices, values = increments.projection(bases)
    m = n if owned is None else owned
    p = sparse.csr_matrix((values, indices, indptr), shape=(6 * m, increments.unknowns)).toarray()
    columns = []  # P by hand: a column per free translation, one or two directions of each director
    for i in range(m):
        turns = {director.FREE: 2, director.HELD: 0}.get(int(kinds[i]), 1)
        for column in [
            *np.eye(6)[:3][~translations[i]],
            *(np.append(np.zeros(3), bases.directors[i, :, k]) for k in range(turns)),
        ]:
            columns.append(np.zeros((m, 6)))
            columns[-1][i] = column
    dense = np.array(columns).reshape(len(columns), -1).T
    np.testing.assert_array_equal(p, dense)
    np.testing.assert_allclose(p.T @ p, np.eye(increments.unknowns), atol=1e-14)
    f, q = RNG.standard_normal((n, 6)), RNG.standard_normal(increments.unknowns)
    np.testing.assert_allclose(p.T @ f[:m].ravel(), increments.reduce(f, bases), atol=1e-14)
    expanded = increments.expand(q, bases)
    np.testing.assert_allclose(p @ q, expanded[:m].ravel(), atol=1e-14)
    assert not expanded[m:].any()
    # increments are tangent to the sphere, and keep a director normal to its axis
    assert np.max(np.abs(np.einsum("ni,ni->n", expanded[:, 3:], d))) < 1e-14
    for axis in (0, 1, 2):
        assert np.max(np.abs(expanded[kinds == axis, 3 + axis])) < 1e-14
    np.testing.assert_array_equal(increments.projection(bases, 5)[1], indices + 5)


def test_reactions_take_the_couple_of_a_director():
    """A couple m on a director acts through d x f with f normal to d."""
    state = np.array([[0.0, 0, 0, 0, 1, 0], [2.0, 0, 0, 0, 1, 0]])
    residual = np.array([[0.0, 3, 0, 0, 0, 0], [0.0, 1, 0, 0, 5, 7]])
    force, moment = reactions(state, residual, np.array([True, True]), np.array([1.0, 0, 0]))
    np.testing.assert_allclose(force, [0, 4, 0])
    np.testing.assert_allclose(moment, [7, 0, -1 * 3 + 1 * 1])


def _surface() -> tuple[ShellSurface, np.ndarray]:
    s, v = np.array([0.0, 0.1, 0.2, 0.6, 1.0]), np.array([-0.05, 0.0, 0.05])
    c = RNG.standard_normal((3, 3, 3))
    x = np.einsum("ai,bj,ijk->abk", s[:, None] ** np.arange(3), v[:, None] ** np.arange(3), c)
    d = np.tile([0.0, 1.0, 0.0], (5, 3, 1))
    return ShellSurface(s, v, x, d), c


def test_surface_is_exact_on_biquadratics_of_an_uneven_grid(tmp_path):
    surface, c = _surface()
    s, v = RNG.uniform(0, 1, (4, 6)), RNG.uniform(-0.05, 0.05, (4, 6))
    exact = np.einsum("...i,...j,ijk->...k", s[..., None] ** np.arange(3), v[..., None] ** np.arange(3), c)
    np.testing.assert_allclose(surface.evaluate(s, v), exact, atol=1e-13)
    np.testing.assert_allclose(surface.grid(s[0], v[0])[2, 3], surface.evaluate(s[0, 2], v[0, 3]), atol=1e-15)
    surface.save(tmp_path / "a.npz")
    np.testing.assert_array_equal(ShellSurface.load(tmp_path / "a.npz").evaluate(s, v), surface.evaluate(s, v))
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]
    for bad in (1.01, -0.01, np.nan):
        with pytest.raises(ValueError, match="s must lie"):
            surface.evaluate(np.array(bad), np.array(0.0))


def test_frames_of_a_cylinder():
    s, v = np.linspace(0, 1, 81), np.linspace(-0.1, 0.1, 5)
    k = 4.0
    mesh = np.stack(np.meshgrid(s, v, indexing="ij"), -1).reshape(-1, 2)
    q, _ = np.linalg.qr(RNG.standard_normal((3, 3)))
    q *= np.sign(np.linalg.det(q))
    points, directors = natural_strip(*mesh.T, np.ones(3), q, (k, k))
    surface = ShellSurface(s, v, points.reshape(81, 5, 3), directors.reshape(81, 5, 3))
    at = np.array([0.0, 0.3, 0.5, 1.0])
    c, z, o, one = np.cos(k * at), np.sin(k * at), 0 * at, 1 + 0 * at
    local = np.stack([np.stack([one, o, o], -1), np.stack([o, c, z], -1), np.stack([o, -z, c], -1)], axis=-1)
    np.testing.assert_allclose(surface.frames(at), q @ local, atol=2e-3)
    np.testing.assert_allclose(np.linalg.det(surface.frames(at)), 1.0, atol=1e-12)
