"""Closed shells: circles against closed forms, Moebius bands of both hands, clamped at the seam, heavy, interrupted."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellStatus, ShellSurface

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.band.turns import half_turns as turned  # noqa: E402
from shellref.path.begin import begun  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from tests.reference.bent_section import stiffness  # noqa: E402

RING = ShellProblem(0.1, 1e-4, 0.0, clamp="free", half_turns=0, elements=(32, 2))
MOEBIUS = ShellProblem(0.05, 1e-3, 0.3, clamp="free", half_turns=1, elements=(40, 4), start_curvature=-2.0 * np.pi)
CIRCLE = 2.0 * np.pi**2  # of a strip without transverse contraction, D w / l


def find(problem, start=None, **options):
    return begun(problem, ShellOptions(**options), lambda event: None, start)


def test_a_circle_bent_from_flat_without_contraction():
    """2 pi^2 D w / l, of fourth order in the elements; its free vibration of two waves in the plane (Hoppe 1871): w^2 =
    n^2 (n^2 - 1)^2 / (n^2 + 1) D / (m R^4)."""
    found = [find(replace(RING, elements=(n, 2))).result for n in (32, 64)]
    errors = [result.energy["elastic"] / CIRCLE - 1.0 for result in found]
    assert errors[0] < 2e-5
    assert 5.0 < errors[0] / errors[1] < 20.0
    assert all(result.stable for result in found)
    assert found[1].lowest_eigenvalue == pytest.approx(36.0 / 5.0 * (2.0 * np.pi) ** 4, rel=1e-4)
    points = found[1].surface.points
    np.testing.assert_allclose(points[0], points[-1], atol=1e-14)
    middle = points[:-1].mean(axis=(0, 1))
    radii = np.linalg.norm((points - middle)[:, 2], axis=1)
    assert np.ptp(radii) < 1e-6


@pytest.mark.parametrize(("width_to_thickness", "error"), [(50.0, 7e-4), (200.0, 1e-4), (1000.0, 2e-5)])
def test_a_circle_whose_section_contracts(width_to_thickness, error):
    """Between E h^3 / 12 and D; the rest is the shell's shear and stretch, which falls with the thickness."""
    h = 0.1 / width_to_thickness
    problem = replace(RING, poisson=0.5, thickness=h, elements=(32, 8), grading=(1.0, 0.15))
    result = find(problem).result
    expected = stiffness(0.5, 0.1, h, 2.0 * np.pi)
    assert 0.9 < expected < 0.99
    assert result.energy["elastic"] / CIRCLE == pytest.approx(expected, rel=error)


def test_the_narrow_strip_is_a_beam_and_the_wide_one_a_plate():
    """And between them the closed form is the least energy of a section, here of sixteen Legendre polynomials."""
    assert stiffness(0.5, 1e-6, 1e-3, 6.0) == pytest.approx(0.75, rel=1e-6)
    assert stiffness(0.5, 30.0, 1e-3, 6.0) == pytest.approx(1.0, abs=1e-3)
    assert least_energy(0.3, 0.1, 2e-3, 6.0) == pytest.approx(stiffness(0.3, 0.1, 2e-3, 6.0), rel=1e-9)


def least_energy(poisson, width, thickness, curvature):
    """The least mean over v of k^2 + y''^2 + 2 nu k y'' + (12 (1 - nu^2) / h^2) (k y)^2, k the curvature, over k^2."""
    from numpy.polynomial import legendre

    x, weights = legendre.leggauss(40)
    half = 0.5 * width
    y = np.array([legendre.legval(x, unit) for unit in np.eye(16)])
    bent = np.array([legendre.legval(x, legendre.legder(unit, 2)) for unit in np.eye(16)]) / half**2
    stretch = 12.0 * (1.0 - poisson**2) * (curvature / thickness) ** 2
    matrix = 0.5 * ((bent * weights) @ bent.T + stretch * (y * weights) @ y.T)
    edges = 0.5 * poisson * curvature * bent @ weights
    return 1.0 - edges @ np.linalg.solve(matrix, edges) / curvature**2


def test_two_hands_of_a_moebius_band_are_mirror_images():
    """One energy and spectrum for both hands; begun at the mirror image of the one it is the other at once."""
    found = {n: find(replace(MOEBIUS, half_turns=n)) for n in (1, -1)}
    one, other = (found[n].result for n in (1, -1))
    assert {f.how for f in found.values()} == {"path"}
    for result in (one, other):
        assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
        assert 0.002 < result.share["membrane"] < 0.1
    assert other.energy["elastic"] == pytest.approx(one.energy["elastic"], rel=1e-8)
    assert other.lowest_eigenvalue == pytest.approx(one.lowest_eigenvalue, rel=1e-5)
    assert 45.0 < one.energy["elastic"] < 60.0
    flip, surface = np.array([-1.0, 1.0, 1.0]), one.surface
    mirrored = ShellSurface(surface.s_nodes, surface.v_nodes, surface.points * flip, -surface.directors * flip)
    again = find(replace(MOEBIUS, half_turns=1), ShellSurface(*_reversed_across(mirrored)))
    assert again.how == "given"
    assert again.result.newton_iterations <= 3
    assert again.result.energy["elastic"] == pytest.approx(one.energy["elastic"], rel=1e-10)


def _reversed_across(surface):
    """v -> -v and d -> -d: the same surface, seen from its other side, which keeps the particles' orientation."""
    return surface.s_nodes, surface.v_nodes, surface.points[:, ::-1], surface.directors[:, ::-1]


def test_a_moved_and_slid_band_is_the_same_state():
    """Turned and moved, and slid by three elements: at once an equilibrium of the same energy."""
    one = find(MOEBIUS).result
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix()
    field = np.concatenate([one.surface.points, one.surface.directors], axis=2)
    own = field[:-1]
    beyond = own[:6, ::-1] * np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    slid = np.concatenate([own[6:], beyond])
    slid = np.concatenate([slid, slid[:1, ::-1] * np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])])
    points, directors = slid[..., :3] @ turn.T + np.array([1.0, 2.0, 3.0]), slid[..., 3:] @ turn.T
    start = ShellSurface(one.surface.s_nodes, one.surface.v_nodes, points, directors)
    result = find(MOEBIUS, start).result
    assert result.newton_iterations <= 3
    assert result.energy["elastic"] == pytest.approx(one.energy["elastic"], rel=1e-10)
    assert np.abs(result.surface.points - points).max() < 1e-6


def test_the_band_of_the_open_strip_is_stiffer_than_the_closed_one():
    """Two clamps at one place hold the section straight; the tie lets it bend. Held at the seam, the clamp carries
    nothing but its own straight edge; of three half turns the band is another one."""
    free = find(MOEBIUS).result
    held = find(replace(MOEBIUS, clamp="edge")).result
    assert held.status is ShellStatus.CONVERGED
    assert 0.0 < held.energy["elastic"] / free.energy["elastic"] - 1.0 < 0.02
    assert np.abs(held.clamp_force).max() < 1e-5
    assert np.abs(held.clamp_moment).max() < 1e-5
    thrice = find(replace(MOEBIUS, half_turns=3)).result
    assert thrice.energy["elastic"] > 1.5 * free.energy["elastic"]


def test_a_heavy_ring_hangs_at_its_seam():
    """The clamp at the seam carries the weight, and the energy is least where it hangs."""
    ring = replace(RING, clamp="edge", thickness=1e-3, poisson=0.3, gamma=50.0, up=(0.0, -1.0, 0.0), elements=(40, 2))
    result = find(ring).result
    assert result.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(result.clamp_force, [0.0, -50.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(result.surface.points[0], result.surface.points[-1], atol=1e-14)
    assert set(result.clamps) == {"start"}


def test_a_refined_band_has_its_error():
    """`accuracy` refines a closed strip from its own surface; the same of both engines."""
    coarse = replace(MOEBIUS, thickness=2.5e-3, elements=(24, 4))
    result = find(coarse, accuracy=2e-2, max_cells=800).result
    assert result.status is ShellStatus.CONVERGED
    assert result.discretisation["reached"]
    forms = find(coarse, start=find(coarse).result.surface, engine="forms").result
    kernels = find(coarse, start=find(coarse).result.surface).result
    assert forms.energy["elastic"] == pytest.approx(kernels.energy["elastic"], rel=1e-9)
    assert forms.provenance["linear_solver"] != kernels.provenance["linear_solver"]


def test_a_twisted_band_needs_a_start_and_one_process():
    from shellref import ShellInputError

    with pytest.raises(ShellInputError, match="begins at a surface") as caught:
        solve(MOEBIUS)
    assert caught.value.key == "half_turns"


def slid(surface, by):
    """A Moebius band's surface slid along itself, on its own nodes."""
    s = surface.s_nodes + by
    sign = np.where(s > 1.0, -1.0, 1.0)[:, None]
    at = np.where(s > 1.0, s - 1.0, s)[:, None] + 0.0 * surface.v_nodes, sign * surface.v_nodes
    directors = sign[..., None] * surface.director(*at)
    return ShellSurface(surface.s_nodes, surface.v_nodes, surface.evaluate(*at), directors)


def test_the_mesh_resists_sliding_as_its_energy_says():
    """`residual.sliding` is dE/ds: against the energies of the band at an eighth and three eighths of an element more,
    between which it swings like a sine; it is nothing on a finer mesh, and not told of a circle, which turns."""
    own = find(MOEBIUS).result
    low, here, high = (find(MOEBIUS, slid(own.surface, k / 8.0 / 40.0)).result for k in (1, 2, 3))
    rise = (high.energy["elastic"] - low.energy["elastic"]) * 4.0 * 40.0
    assert abs(rise) > 0.1
    assert here.residual["sliding"] * np.sinc(0.25) == pytest.approx(rise, rel=0.02)
    assert here.residual["relative"] == here.residual["absolute"] < 1e-5
    fine = replace(MOEBIUS, elements=(72, 4))
    assert abs(find(fine, slid(own.surface, 0.25 / 72.0)).result.residual["sliding"]) < 0.02 * abs(rise)
    assert "sliding" not in find(RING).result.residual


@pytest.mark.parametrize(("half_turns", "modes"), [(4, 1), (-5, 2)])
def test_more_half_turns_are_kept_as_saddles(half_turns, modes):
    """By its own path, from the twisted circle: as many half turns, unstable, its ways down counted."""
    problem = replace(MOEBIUS, thickness=2e-3, half_turns=half_turns, elements=(80, 6), grading=(1.0, 0.3))
    found = find(problem).result
    assert (found.status, found.stable, found.negative_eigenvalues) == (ShellStatus.UNSTABLE, False, modes)
    assert "kept" in found.message
    assert abs(turned(found.surface, problem.width, half_turns)) == pytest.approx(abs(half_turns), abs=1e-6)
