"""docs/theory.md: equations are numbered once and cited by the docstrings, and they hold in the code."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from functools import cache
from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid

from compare.models.ribbon.estimate import in_plane_density, tension_density
from ribbon import Clamp, Closure, Gravity, Strip, Wall, solve
from ribbon.element.body_series import body_values
from ribbon.element.element import bending_jet
from ribbon.element.quaternion import compose, from_matrix, rotate
from ribbon.element.series import EXPONENT_LIMIT, segment_values
from ribbon.energies import CODES, natural, sadowsky, wunderlich
from ribbon.energies.edge_layer import Section, layer
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, free_density
from ribbon.energies.section.dropped import Dropped
from ribbon.energies.section.profile import Local
from ribbon.energies.section.unit import unit
from ribbon.find.solve import build
from shellref.elastica.solve import ElasticaProblem
from shellref.elastica.solve import solve as solve_elastica
from shellref.rod.problem import RodProblem, rectangle
from shellref.rod.solve import solve as solve_rod
from tests.docs_blocks import DOCS, ROOT, blocks, prose

PAGE = (DOCS / "theory.md").read_text()
#: Chapters whose every equation a docstring of the heart cites.
HEART = range(1, 9)
CITED = re.compile(r"docs/theory\.md,\s+eq\.\s+((?:\(\d+\.\d+\)(?:,\s+|\s+and\s+)?)+)")


def numbers() -> list[str]:
    return re.findall(r"\\tag\{(\d+\.\d+)\}", PAGE)


@cache
def citations() -> dict[str, set[str]]:
    """Equation -> modules that cite it in a docstring."""
    found: dict[str, set[str]] = {}
    for package in ("ribbon", "shellref", "compare"):
        for path in (ROOT / package).rglob("*.py"):
            tree = ast.parse(path.read_text())
            places = (ast.Module, ast.ClassDef, ast.FunctionDef)
            texts = [ast.get_docstring(node) or "" for node in ast.walk(tree) if isinstance(node, places)]
            for group in CITED.findall("\n".join(texts)):
                for number in re.findall(r"\((\d+\.\d+)\)", group):
                    found.setdefault(number, set()).add(path.relative_to(ROOT).as_posix())
    return found


# -- numbers ----------------------------------------------------------------------------------------------------------


def test_numbers_are_unique_and_in_order():
    found = [tuple(int(part) for part in number.split(".")) for number in numbers()]
    assert len(found) > 60
    assert all(b == (a[0], a[1] + 1) or b == (a[0] + 1, 1) for a, b in pairwise(found))
    headings = [int(n) for n in re.findall(r"^## (\d+) ", PAGE, re.M)]
    assert headings == list(range(1, 14))


def test_equations_are_well_formed():
    """One number per displayed equation; braces and left-right pairs match; inline formulas end on their line."""
    shown = [block.text for block in blocks(PAGE) if block.info == "math"]
    assert len(shown) == len(numbers())
    for text in shown:
        assert text.count("\\tag{") == 1, text
        plain = text.replace("\\{", "").replace("\\}", "")
        assert plain.count("{") == plain.count("}"), text
        assert len(re.findall(r"\\left\b", text)) == len(re.findall(r"\\right\b", text)), text
    for line in prose(PAGE).splitlines():
        assert line.count("$") % 2 == 0, line


def test_references_on_the_page_exist():
    own, _, _ = PAGE.partition("## Slips of the seeds")  # that table has the numbers of the seeds
    plain = re.sub(r"\\tag\{[^}]*\}", "", own)
    used = set(re.findall(r"\((\d+\.\d+)\)", plain))
    assert used <= set(numbers())


def test_cited_equations_exist():
    missing = {number: sorted(where) for number, where in citations().items() if number not in numbers()}
    assert not missing


@pytest.mark.parametrize("chapter", HEART)
def test_every_equation_of_the_heart_is_cited(chapter):
    cited = citations()
    mine = [number for number in numbers() if number.startswith(f"{chapter}.")]
    assert mine
    assert not [number for number in mine if number not in cited]


# -- 1 geometry -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def curl():
    """A ribbon out of the plane, eta' not zero."""
    strip = Strip(1.0, 0.1, poisson=0.4, natural_curvature=4.0, gamma=10.0)
    e = solve(strip, Clamp(normal=(-(0.5**0.5), 0.5**0.5, 0.0), ruling="free"), Gravity(up=(1, 0, 0)), segments=6)
    assert e.ok
    return e


def cross(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def test_geometry_1_1_to_1_3(curl):
    """R' = R [kappa]_x, r' = R e_z, t_z' = kappa_2 t_x - kappa_1 t_y, by central differences."""
    d = 1e-4
    for s in (0.07, 0.31, 0.72, 0.93):
        more, less, here = (curl.frame([s + k * d])[0] for k in (1, -1, 0))
        omega, eta = curl.omega([s])[0], curl.eta([s])[0]
        kappa = np.array([omega, 0.0, eta * omega])
        rate = (more - less) / (2 * d)
        np.testing.assert_allclose(rate, here @ cross(kappa), atol=2e-5)
        np.testing.assert_allclose(rate[:, 2], kappa[1] * here[:, 0] - kappa[0] * here[:, 1], atol=2e-5)
        speed = (curl.position([s + d])[0] - curl.position([s - d])[0]) / (2 * d)
        np.testing.assert_allclose(speed, here[:, 2], atol=2e-6)


def test_surface_1_4_to_1_6(curl):
    """The particle (S, v) lies on the ruling whose foot solves s + v eta(s) = S, and |eta'| <= 2 / w."""
    surface = curl.surface(20, 4)
    inside = 0
    for point, (big_s, v) in zip(surface.points, surface.material, strict=True):
        s = np.linspace(0.0, 1.0, 4001)
        miss = s + v * curl.eta(s) - big_s
        assert (np.diff(miss) > 0).all()
        if miss[0] > 0 or miss[-1] < 0:
            continue  # beyond the last ruling
        foot = float(np.interp(0.0, miss, s))
        frame = curl.frame([foot])[0]
        q = frame[:, 0] + curl.eta([foot])[0] * frame[:, 2]
        np.testing.assert_allclose(point, curl.position([foot])[0] + v * q, atol=1e-7)
        inside += 1
    assert inside > 90
    assert curl.max_abs_eta_prime_w_half < 1.0


# -- 2 energies -------------------------------------------------------------------------------------------------------


def test_gamma_2_1():
    strip = Strip.from_material(0.3, 0.02, 2e-4, young=2e9, density=1200.0, poisson=0.3)
    stiffness = 2e9 * 2e-4**3 / (12 * (1 - 0.3**2))
    assert strip.gamma == pytest.approx(1200.0 * 2e-4 * 9.81 * 0.3**3 / stiffness, rel=1e-14)


@pytest.mark.parametrize("x", [1e-4, 0.2, 0.3001, -0.7, 0.99])
def test_width_factor_2_2_2_5_and_2_6(x):
    h, d, c = wunderlich.width_factor(x)
    with mp.workdps(40):
        z = mp.mpf(x)
        mean = mp.quad(lambda t: 1 / (1 + t * z), [-1, 0, 1]) / 2
        first = (1 / (1 - z * z) - mean) / z
        second = (2 * z / (1 - z * z) ** 2 - 2 * first) / z
        series = sum(z ** (2 * k) / (2 * k + 1) for k in range(4000))
        assert abs(h - mean) < 1e-13 * mean
        assert abs(series - mean) < 1e-25
        assert abs(d - first) < 1e-12 * abs(first)
        assert abs(c - second) < 1e-11 * abs(second)


SECTION = (0.05, 1e-3, 0.3)  # w / (2 l), h / l, nu


def test_densities_2_3_2_4_and_2_7():
    omega, eta, x, big_k, nu = 3.0, -0.7, 0.6, 4.0, 0.35
    out = np.empty(10)
    wunderlich.density(omega, eta, x, SECTION, out)
    assert out[0] == pytest.approx(0.5 * omega**2 * (1 + eta**2) ** 2 * np.arctanh(x) / x, rel=1e-14)
    sadowsky.density(omega, eta, x, SECTION, out)
    assert out[0] == pytest.approx(0.5 * omega**2 * (1 + eta**2) ** 2, rel=1e-15)
    natural.density(omega, eta, big_k, nu, out)
    assert out[0] == pytest.approx(-big_k * omega * (1 + nu * eta**2), rel=1e-15)


NODES, WEIGHTS = np.polynomial.legendre.leggauss(30)


def along(lengths):
    """Gauss points and weights on every segment."""
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    s = (starts[:-1, None] + lengths[:, None] * 0.5 * (NODES + 1)).ravel()
    return s, (lengths[:, None] * 0.5 * WEIGHTS).ravel()


def test_energy_2_8_and_2_11(curl):
    """The parts of a solved ribbon are the integrals of the densities and of the height."""
    lengths = curl.problem.lengths
    s, w = along(lengths)
    omega, eta = curl.omega(s), curl.eta(s)
    x = np.repeat(curl.parameters[:, 2], len(NODES)) * 0.05
    bending = w @ (0.5 * omega**2 * (1 + eta**2) ** 2 * np.arctanh(x) / x)
    assert curl.energy.bending == pytest.approx(bending, rel=1e-12)
    assert curl.energy.natural == pytest.approx(w @ (-4.0 * omega * (1 + 0.4 * eta**2)), rel=1e-12)
    gravity = 10.0 * w @ curl.position(s)[:, 0]
    assert curl.energy.gravity == pytest.approx(gravity, rel=1e-12)
    assert curl.energy.total == pytest.approx(bending + curl.energy.natural + gravity, rel=1e-12)


def test_exact_weight_2_9_and_2_10():
    strip, up = Strip(1.0, 0.1, gamma=7.0), np.array([0.6, 0.0, 0.8])
    problem = build(strip, Clamp(ruling="free"), Gravity(up, exact=True), segments=5, formulation="mixed")
    x = problem.state(np.linspace(3.0, -2.0, 6), np.linspace(0.8, -0.5, 6))
    e = Shape(problem, x)
    s, w = along(problem.lengths)
    r, frame, _, eta = e(s)
    slope = np.repeat(problem.parameters(x)[:, 2], len(NODES))
    q = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    between = 7.0 * w @ (r @ up + 0.1**2 / 12 * slope * (q @ up))

    def end(at):
        _, f, _, there = e(np.array([at]))
        tx, tz = f[0, :, 0] @ up, f[0, :, 2] @ up
        return 7.0 * 0.1**2 / 12 * (there[0] * tx + 0.5 * there[0] ** 2 * tz)

    assert problem.energy_parts(x)[2] == pytest.approx(between + end(0.0) - end(1.0), rel=1e-11)


class Shape:
    """Position, frame, omega, eta along the ribbon of unknowns."""

    def __init__(self, problem, x):
        self.q, (self.points, self.frames), self.problem = problem.parameters(x), problem.joints(x), problem

    def __call__(self, s):
        from ribbon.surface import centreline

        return centreline(self.q, self.problem.lengths, self.points, self.frames, s, EXPONENT_LIMIT)


# -- 3 the element ----------------------------------------------------------------------------------------------------

SEGMENT = (2.0, -3.0, 1.5, 0.4)


def coefficients(a, b, n, m, count):
    """M_k of (3.4) and the three lambda of (3.3)."""
    lam = [np.array([b, 0, m * b]), np.array([a, 0, n * b + m * a]), np.array([0, 0, n * a])]
    found = [np.eye(3)]
    for k in range(1, count):
        found.append(sum(found[k - 1 - j] @ cross(lam[j]) for j in range(3) if k - 1 - j >= 0) / k)
    return found, lam


def ends(a, b, n, m, length):
    q, p, j = np.empty((3, 3)), np.empty(3), np.empty(3)
    segment_values(a, b, n, m, length, EXPONENT_LIMIT, q, p, j)
    return q, p, j


def test_series_3_2_to_3_4_and_3_6():
    length = 0.6
    big_m, lam = coefficients(*SEGMENT, 80)
    q, p, j = ends(*SEGMENT, length)
    k = np.arange(80)
    np.testing.assert_allclose(q, sum(m * length**i for i, m in enumerate(big_m)), atol=1e-14)
    np.testing.assert_allclose(p, sum(m[:, 2] * length ** (i + 1) / (i + 1) for i, m in enumerate(big_m)), atol=1e-14)
    height = sum(m[:, 2] * length ** (i + 2) / ((i + 1) * (i + 2)) for i, m in enumerate(big_m))
    np.testing.assert_allclose(j, height, atol=1e-14)
    bound = np.exp(2 * length * sum(np.linalg.norm(v) * length**i for i, v in enumerate(lam)))
    sizes = [np.linalg.norm(m, 2) * length**i for i, m in zip(k, big_m, strict=True)]
    assert max(sizes) <= bound


def test_row_recurrence_3_5():
    """The coefficients of a row of (3.4) obey the recurrence with one linear factor."""
    a, b, n, m = SEGMENT
    big_m, _ = coefficients(*SEGMENT, 30)
    for row in range(3):
        x, y, z = (np.array([c[row, i] for c in big_m]) for i in range(3))
        older = lambda v, k: v[k] if k >= 0 else 0.0  # noqa: E731
        g = np.array([z[k] - m * x[k] - n * older(x, k - 1) for k in range(30)])
        for k in range(1, 30):
            assert z[k] == pytest.approx(-(b * y[k - 1] + a * older(y, k - 2)) / k, abs=1e-13)
            assert y[k] == pytest.approx((b * g[k - 1] + a * older(g, k - 2)) / k, abs=1e-13)
            assert x[k] == pytest.approx(-m * z[k] - n * (k - 1) / k * z[k - 1], abs=1e-13)


def test_composition_3_1_and_3_7():
    a, b, n, m = SEGMENT
    first, second = 0.25, 0.35
    q, p, j = ends(*SEGMENT, first + second)
    q1, p1, j1 = ends(*SEGMENT, first)
    q2, p2, j2 = ends(a, b + a * first, n, m + n * first, second)
    np.testing.assert_allclose(q, q1 @ q2, atol=1e-14)
    np.testing.assert_allclose(p, p1 + q1 @ p2, atol=1e-14)
    np.testing.assert_allclose(j, j1 + second * p1 + q1 @ j2, atol=1e-14)


def test_quadrature_3_8():
    jet, (a, b, n, m), length = np.empty(15), SEGMENT, 0.6
    s = 0.5 * length * (NODES + 1)
    omega, eta, x = a * s + b, n * s + m, 0.05 * n
    for name, factor in (("sadowsky", 1.0), ("wunderlich", np.arctanh(x) / x)):
        bending_jet(CODES[name], a, b, n, m, length, SECTION, jet)
        exact = 0.5 * length * WEIGHTS @ (0.5 * omega**2 * (1 + eta**2) ** 2) * factor
        assert jet[0] == pytest.approx(exact, rel=1e-14)


def body(length):
    out = np.empty(13)
    body_values(*SEGMENT, length, EXPONENT_LIMIT, 2, out)
    return out[:4], out[4:7], out[7:10], out[10:13]


def test_seen_from_the_end_3_9():
    a, b, n, m = SEGMENT
    d, length = 1e-4, 0.5
    quat, u, v, t = body(length)
    frame, p, j = ends(*SEGMENT, length)
    np.testing.assert_allclose(u, frame.T @ p, atol=1e-14)
    np.testing.assert_allclose(v, frame.T @ j, atol=1e-14)
    omega, eta = a * length + b, n * length + m
    kappa = np.array([omega, 0.0, eta * omega])
    rates = [(x - y) / (2 * d) for x, y in zip(body(length + d), body(length - d), strict=True)]
    e = np.eye(3)
    for rate, right in zip(
        rates,
        (
            0.5 * compose(quat, np.concatenate([[0.0], kappa])),
            e[2] - np.cross(kappa, u),
            u - np.cross(kappa, v),
            e[0] - np.cross(kappa, t),
        ),
        strict=True,
    ):
        np.testing.assert_allclose(rate, right, atol=1e-6)


# -- 4 chained and glued ----------------------------------------------------------------------------------------------


def test_chain_4_1_and_4_2():
    strip, up = Strip(1.0, 0.05, gamma=3.0), np.array([0.0, 0.6, 0.8])
    problem = build(strip, Clamp((0.1, 0.2, 0.3), ruling="free"), Gravity(up), segments=[0.2, 0.5, 0.3])
    x = np.array([2.0, 0.3, -1.0, 0.5, 3.0, -0.7, 1.0, 0.2])
    q, lengths = problem.parameters(x), problem.lengths
    np.testing.assert_allclose(q[1:, 1], q[:-1, 1] + lengths[:-1] * q[:-1, 0])
    np.testing.assert_allclose(q[1:, 3], q[:-1, 3] + lengths[:-1] * q[:-1, 2])
    g, behind, total = up.copy(), 1.0, np.array([0.1, 0.2, 0.3]) @ up
    for i, length in enumerate(lengths):
        behind -= length
        frame, p, j = ends(q[i, 0], q[i, 1], q[i, 2], q[i, 3], length)
        total += g @ (j + behind * p)
        g = frame.T @ g
    assert problem.energy_parts(x)[2] == pytest.approx(3.0 * total, rel=1e-13)


def test_newtons_step_4_9():
    """The linear-quadratic model is half the second derivative along any change of the unknowns."""
    strip = Strip(1.0, 0.1, poisson=0.4, natural_curvature=4.0, gamma=10.0)
    tip = (0.5, -1.0, 2.0)
    problem = build(strip, Clamp(), Gravity(up=(0.6, 0.0, 0.8)), segments=5, tip=tip, formulation="chained")
    rng = np.random.default_rng(5)
    x, d = rng.standard_normal((2, problem.size))
    local, u, v = problem.jets(x)
    change = problem.parameters(x + d) - problem.parameters(x)
    psi, total = np.zeros(3), 0.0
    for k in range(5):
        block = np.zeros((4, 4))
        block[np.triu_indices(4)] = local[k, 5:]
        block = block + np.triu(block, 1).T
        total += 0.5 * change[k] @ block @ change[k] + change[k] @ v[k] @ psi
        psi = psi + change[k] @ u[k]
    assert total == pytest.approx(0.5 * d @ problem.hessian(x) @ d, rel=1e-10)


def test_glue_4_5_to_4_7():
    strip, up = Strip(1.0, 0.05, gamma=3.0), np.array([0.0, 0.6, 0.8])
    problem = build(strip, Clamp(ruling="free"), Gravity(up, exact=False), segments=3, formulation="mixed")
    rng = np.random.default_rng(3)
    x = problem.state(np.array([2.0, -1.0, 3.0, 0.5]), np.array([0.3, 0.1, -0.4, 0.2]))
    x = x + 0.05 * rng.standard_normal(x.size)
    rows, weight = problem.constraints(x), 0.0
    turned = np.empty(3)
    for i, length in enumerate(problem.lengths):
        k = 10 * i
        a, b, n, m = (x[k + 17] - x[k + 7]) / length, x[k + 7], x[k + 9], x[k + 8]
        out = np.empty(13)
        body_values(a, b, n, m, length, EXPONENT_LIMIT, 1, out)
        ahead = x[k + 13 : k + 17]
        rotate(ahead, out[4:7], turned)
        np.testing.assert_allclose(rows[8 * i : 8 * i + 3], x[k + 10 : k + 13] - x[k : k + 3] - turned, atol=1e-14)
        np.testing.assert_allclose(rows[8 * i + 3 : 8 * i + 7], ahead - compose(x[k + 3 : k + 7], out[:4]), atol=1e-14)
        assert rows[8 * i + 7] == pytest.approx(x[k + 18] - m - length * n, abs=1e-14)
        w0, vq, u = ahead[0], ahead[1:], out[7:10]
        plain = w0**2 * u + 2 * w0 * np.cross(vq, u) + 2 * vq * (vq @ u) - (vq @ vq) * u
        rotate(ahead, u, turned)
        np.testing.assert_allclose(turned, plain, atol=1e-15)
        weight += 3.0 * (length * x[k : k + 3] @ up + turned @ up)
    assert problem.energy_parts(x)[2] == pytest.approx(weight, rel=1e-13)


# -- 5 what holds, 6 stability ----------------------------------------------------------------------------------------


def test_ends_and_seams_5_1_and_5_2():
    band = build(Strip(1.0, 0.05), closure=Closure("moebius", "straight"), segments=6)
    rng = np.random.default_rng(4)
    x = rng.standard_normal(band.size)
    rows, where = band.constraints(x), band.block_slices()
    last = 60
    half_turn = np.array([0.0, 0.0, 0.0, 1.0])
    start = compose(x[3:7], half_turn) * np.array([1.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(rows[where["end_position"]], x[last : last + 3] - x[:3], atol=1e-14)
    np.testing.assert_allclose(rows[where["end_frame"]], 2 * compose(start, x[last + 3 : last + 7])[1:], atol=1e-14)
    np.testing.assert_allclose(rows[where["seam_omega"]], [x[last + 7] + x[7]], atol=1e-14)
    held = build(Strip(1.0, 0.05), Clamp(ruling="free"), end=Clamp((0.0, 0.0, 0.9), ruling="free"), segments=6)
    y = rng.standard_normal(held.size)
    clamp = from_matrix(held.end.frame) * np.array([1.0, -1.0, -1.0, -1.0])
    rows, where = held.constraints(y), held.block_slices()
    np.testing.assert_allclose(rows[where["end_frame"]], 2 * compose(clamp, y[last + 3 : last + 7])[1:], atol=1e-14)


def test_walls_plates_and_forces_5_3_to_5_6():
    """Distances of the edges; force of a plate = k z; forces and moments balance the weight."""
    strip, up = Strip(1.0, 0.1, gamma=10.0), (0.0, 1.0, 0.0)
    plate = Wall((0.0, -0.3, 0.0), (0.0, 1.0, 0.0), stiffness=50.0)
    e = solve(strip, Clamp(ruling="free"), Gravity(up), walls=(plate,), segments=16)
    assert e.ok, e.message
    z = e.walls[0].height
    distances = e.problem.blocks()["wall_0"].values(e.x)
    points, frames = e.joints
    eta = np.concatenate([e.parameters[:, 3], [e.eta([1.0])[0]]])
    joints = e.problem.blocks()["wall_0"].joints
    for i, joint in enumerate(joints):
        q = frames[joint][:, 0] + eta[joint] * frames[joint][:, 2]
        for side, sign in enumerate((1.0, -1.0)):
            edge = points[joint] + sign * 0.05 * q
            assert distances[2 * i + side] == pytest.approx(edge[1] + 0.3 - z, abs=1e-9)
    multipliers = e.rows[e.problem.block_slices()["wall_0"]]
    assert multipliers.max() < 1e-6
    np.testing.assert_allclose(e.walls[0].force, [0.0, -multipliers.sum(), 0.0], atol=1e-9)
    assert e.walls[0].force[1] == pytest.approx(-50.0 * z, rel=1e-6)
    assert e.energy.plates == pytest.approx(0.5 * 50.0 * z**2, rel=1e-9)
    np.testing.assert_allclose(e.start.force + e.walls[0].force, [0.0, 10.0, 0.0], atol=1e-6)
    s, w = along(e.problem.lengths)
    levers = w @ np.cross(e.position(s) - points[0], [0.0, -10.0, 0.0])
    pushed = sum(
        np.cross(points[j] + sign * 0.05 * frames[j][:, 0] - points[0], [0.0, -multipliers[2 * i + side], 0.0])
        for i, j in enumerate(joints)
        for side, sign in enumerate((1.0, -1.0))
    )
    np.testing.assert_allclose(e.start.moment + pushed + levers, np.zeros(3), atol=1e-6)


def test_eigenvalue_6_1(curl):
    """Lowest eigenvalue in the metric of int (domega^2 + deta^2) ds, from the Hessian and the metric by quadrature."""
    import scipy.linalg

    problem, x = curl.problem, curl.x
    s, w = along(problem.lengths)
    n = problem.size
    modes = np.empty((n, 2, s.size))
    for k in range(n):
        q = problem.parameters(np.eye(n)[k])
        starts = np.repeat(np.concatenate([[0.0], np.cumsum(problem.lengths)])[:-1], len(NODES))
        each = np.repeat(q, len(NODES), axis=0)
        modes[k] = each[:, 0] * (s - starts) + each[:, 1], each[:, 2] * (s - starts) + each[:, 3]
    metric = np.einsum("ads,bds,s->ab", modes, modes, w)
    values = scipy.linalg.eigh(problem.hessian(x), metric, eigvals_only=True)
    assert curl.active_bounds == 0
    assert curl.lowest_eigenvalue == pytest.approx(values[0], rel=1e-6)


# -- 7 the shell ------------------------------------------------------------------------------------------------------


def test_natural_curve_7_5():
    from shellref.shell.midsurface import natural_curve, turning_angle

    s, law = np.linspace(0.0, 1.0, 9), (3.0, -5.0)
    np.testing.assert_allclose(turning_angle(s, law), 3.0 * s - 4.0 * s**2, atol=1e-15)
    z, y = natural_curve(s, law)
    fine = np.linspace(0.0, 1.0, 80001)
    theta = 3.0 * fine - 4.0 * fine**2
    for got, what in ((z, np.cos(theta)), (y, -np.sin(theta))):
        total = np.concatenate([[0.0], np.cumsum(0.5 * (what[1:] + what[:-1]) * np.diff(fine))])
        np.testing.assert_allclose(got, total[::10000], atol=1e-9)


def test_material_7_4_and_layer_7_14():
    from shellref import ShellProblem
    from shellref.shell.material import plane_stress, stiffness_factors
    from shellref.shell.strip import layer_width

    h, nu = 1e-3, 0.3
    shear_modulus = 12 * (1 - nu**2) / h**3 / (2 * (1 + nu))
    membrane_factor, shear_factor = stiffness_factors(h)
    assert membrane_factor == pytest.approx(12 / h**2)
    assert (1 - nu) * shear_factor == pytest.approx(5 / 6 * shear_modulus * h)
    assert (1 - nu) * shear_factor == pytest.approx(5 * (1 - nu) / h**2)
    np.testing.assert_allclose(plane_stress(nu), [[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    problem = ShellProblem(0.1, 1e-4, 0.3, (16.0, 16.0), 0.0, None)
    assert layer_width(problem) == pytest.approx((1e-4 / 16.0) ** 0.5)


def test_edges_7_15():
    """Derivatives of all held edges: tests/shellref/shell/test_shell_edges.py; here the formula as it stands."""
    from shellref import Pose
    from shellref.shell.body import Control
    from shellref.shell.clamps import PosePath, rotation
    from shellref.shell.edges import RigidEdge
    from shellref.shell.midsurface import Cylinder

    points, directors = Cylinder(curvature_across=2.0).place(np.zeros(5), np.linspace(-0.2, 0.2, 5))
    path = PosePath((Pose((1.0, 2.0, 3.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))),))
    e, b, q = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0.4
    edge = RigidEdge("end", np.arange(5), points, directors, path, b[None], e)

    def x(theta):
        turn = rotation(theta * e)
        return np.hstack([[1.0, 2.0, 3.0] + q * b + points @ turn.T, directors @ turn.T])

    np.testing.assert_allclose(edge.placed(x(0.3), Control()), x(0.3), atol=1e-14)
    t = 1e-4
    slope, bend = (x(0.3 + t) - x(0.3 - t)) / (2 * t), (x(0.3 + t) - 2 * x(0.3) + x(0.3 - t)) / t**2
    np.testing.assert_allclose(edge.tangents(x(0.3), Control())[:, :, -1], slope, atol=1e-8)
    np.testing.assert_allclose(bend[:, :3], np.cross(e, np.cross(e, x(0.3)[:, :3] - edge.point(x(0.3)))), atol=1e-6)
    force = np.arange(30.0).reshape(5, 6)
    assert edge.curvature(x(0.3), force, Control())[-1] == pytest.approx(np.sum(bend * force), rel=1e-5)


def test_bending_stiffness_of_an_arc_7_16():
    from tests.reference.tape_section import Section

    a, h, nu, kappa0 = 0.03, 1.5e-4, 0.3, 20.0
    section = Section(a, h, kappa0, nu)
    beta = a * kappa0
    v = np.linspace(-a, a, 20001)
    height = -np.cos(kappa0 * v) / kappa0
    weights = np.full(v.size, v[1] - v[0])
    weights[[0, -1]] *= 0.5
    height -= weights @ height / (2 * a)
    inertia = float(weights @ height**2)
    expected = 12 * (1 - nu**2) / h**2 * inertia + 2 * a * (1 - nu**2)
    assert section.stiffness() == pytest.approx(expected, rel=1e-6)
    assert section.moment(1e-4) / 1e-4 == pytest.approx(expected, rel=2e-4)
    shallow = Section(a, h, kappa0, nu, exact=False).stiffness()
    assert shallow == pytest.approx(12 * (1 - nu**2) / h**2 * 2 * a**3 * beta**2 / 45 + 2 * a * (1 - nu**2))
    assert shallow / expected == pytest.approx(1.053, abs=1e-3)


def test_director_7_8():
    from shellref.shell.director import retract, tangent_bases

    rng = np.random.default_rng(2)
    d = rng.standard_normal((5, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    np.testing.assert_allclose(np.einsum("ni,nik->nk", d, tangent_bases(d)), 0.0, atol=1e-15)
    step = rng.standard_normal((5, 6))
    state = np.hstack([np.zeros((5, 3)), d])
    new = d + step[:, 3:]
    np.testing.assert_allclose(retract(state, step)[:, 3:], new / np.linalg.norm(new, axis=1)[:, None], atol=1e-15)


@pytest.mark.shell
def test_strains_and_energy_7_1_to_7_3_and_7_6():
    """A flat strip bent to a circle: kap_11 = omega, no stretching or shear, energy omega^2 / 2; alpha; T."""
    pytest.importorskip("dolfinx")
    from shellref import ShellOptions, ShellProblem
    from shellref.shell.midsurface import natural_strip
    from shellref.shell.naghdi import NaghdiModel
    from shellref.shell.strip import build_strip

    h = 1e-2
    body = build_strip(ShellProblem(0.1, h, 0.3, elements=(20, 2)), ShellOptions()).body
    model = NaghdiModel(body, 0.01)
    s, v = model.nodes.T
    omega = 0.7
    state = np.hstack(natural_strip(s, v, np.zeros(3), np.eye(3), (omega, omega)))
    strains = model.strains(state)[0]
    assert strains.shape[-1] == 8
    np.testing.assert_allclose(strains[..., 0], omega, rtol=2e-3)  # of the interpolated circle
    np.testing.assert_allclose(strains[..., [1, 2, 4, 5, 7]], 0.0, atol=1e-12)
    assert model.energies(state).bending == pytest.approx(0.5 * omega**2, rel=1e-4)
    rng = np.random.default_rng(5)
    step = 0.1 * rng.standard_normal(state.shape)
    half = 0.5 * (model.strains(state + step)[0] - model.strains(state - step)[0])
    np.testing.assert_allclose(half, model.strains(state, step)[0] - model.strains(state)[0], atol=1e-10)  # T(u, v)
    knots = body.grid.s_knots
    long = np.diff(knots)[np.searchsorted(knots, model.midpoints[:, 0]) - 1]
    np.testing.assert_allclose(model.alpha, np.minimum(1.0, 0.01 * (h / long) ** 2), rtol=1e-12)


# -- 8 the elastica ---------------------------------------------------------------------------------------------------


def test_elastica_8_1_to_8_3():
    """Energy from the centreline and from the tangent agree; the weak form vanishes on a hat function."""
    problem = ElasticaProblem(gamma=6.0, up=(0.0, 1.0), curvature=(1.0, -2.0))
    result = solve_elastica(problem, 60)
    s = np.linspace(0.0, 1.0, 4001)
    theta = result.angle(s) if hasattr(result, "angle") else result._discrete.angle(result._coefficients, s)
    bend = np.gradient(theta, s, edge_order=2)
    natural_k = 1.0 - 3.0 * s
    t = np.stack([np.cos(theta), np.sin(theta)])
    y = np.concatenate([[0.0], np.cumsum(0.5 * (t[1, 1:] + t[1, :-1]) * np.diff(s))])
    by_height, by_tangent = trapezoid(6.0 * y, s), trapezoid(6.0 * (1 - s) * t[1], s)
    assert by_height == pytest.approx(by_tangent, abs=1e-6)
    assert result.energy.gravity == pytest.approx(by_tangent, abs=1e-6)
    assert result.energy.bending == pytest.approx(trapezoid(0.5 * bend**2 - natural_k * bend, s), abs=1e-5)
    test = np.sin(2.5 * s)
    normal = 6.0 * (1 - s) * np.cos(theta)
    assert trapezoid((bend - natural_k) * 2.5 * np.cos(2.5 * s) + normal * test, s) == pytest.approx(0.0, abs=1e-4)


def test_limits_8_4():
    small = solve_elastica(ElasticaProblem(gamma=1e-3), 20).end
    assert -small[1] / small[0] / (1e-3 / 8) == pytest.approx(1.0, abs=1e-4)
    heavy = [-e[1] / e[0] / (g / 2) ** 0.5 for g in (1e3, 1e5) for e in [solve_elastica(ElasticaProblem(gamma=g)).end]]
    assert abs(heavy[1] - 1) < abs(heavy[0] - 1) < 0.05


# -- 9 comparison -----------------------------------------------------------------------------------------------------


def test_hausdorff_9_1():
    from compare.measure.distance import grid_hausdorff
    from compare.measure.grid import SAGITTA, cells_along

    s, v = np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 0.1, 3), indexing="ij")
    flat = np.stack([s, v, 0 * s], axis=2)
    longer = np.stack([1.2 * s, v, 0 * s + 0.05], axis=2)
    assert grid_hausdorff(flat, longer) == pytest.approx(np.hypot(0.2, 0.05), abs=1e-12)
    assert 10.0 / (8 * cells_along(10.0) ** 2) <= SAGITTA


# -- 10 beyond inextensibility ----------------------------------------------------------------------------------------


def g_of(z):
    return (np.cosh(z) - np.cos(z)) / (z * (np.sinh(z) + np.sin(z)))


@pytest.mark.parametrize("v", [0.5, 8.0, 60.0, 400.0])
def test_transverse_profile_10_2_to_10_4(v):
    """Ritz over the section: min 1/2 int (p'' + b)^2 + v^2 p^2 dt, t in (-1/2, 1/2), and the membrane part of it."""
    b, degree = 0.7, 40
    t, w = np.polynomial.legendre.leggauss(120)
    weights = 0.5 * w
    basis = np.polynomial.legendre.Legendre
    p = np.array([basis.basis(k)(t) for k in range(degree)])
    bent = np.array([4.0 * basis.basis(k).deriv(2)(t) if k > 1 else 0 * t for k in range(degree)])
    matrix = np.einsum("at,bt,t->ab", bent, bent, weights) + v**2 * np.einsum("at,bt,t->ab", p, p, weights)
    right = -b * bent @ weights
    found = np.linalg.solve(matrix, right)
    total = 0.5 * weights @ ((found @ bent + b) ** 2 + v**2 * (found @ p) ** 2)
    stretch = 0.5 * v**2 * weights @ (found @ p) ** 2
    z = (v / 2) ** 0.5
    assert total == pytest.approx(b**2 * (0.5 - g_of(z)), rel=1e-8)
    phi = 4 / v**2 * (0.5 - g_of(z))
    assert phi == pytest.approx(total * 4 / (v**2 * b**2), rel=1e-8)
    slope = (g_of(z * 1.0001) - g_of(z * 0.9999)) / (2e-4 * z)
    assert stretch == pytest.approx(-z / 4 * slope * b**2, rel=1e-6)
    ours, z_slope, _ = layer(np.array([z]))
    assert ours[0] == pytest.approx(g_of(z), rel=1e-12)
    assert z_slope[0] == pytest.approx(z * slope, rel=1e-6)


def test_energy_10_1_tends_to_sadowsky_10_6_and_10_7():
    kappa, eta, big_k, nu, w, h = 5.0, 0.6, 3.0, 0.35, 0.1, 1e-3
    tau = eta * kappa
    v = (12 * (1 - nu**2)) ** 0.5 * kappa * w**2 / h
    z = (v / 2) ** 0.5
    section = Section(poisson=nu, width=w, thickness=h)
    assert section.scale == pytest.approx((3 * (1 - nu**2)) ** 0.25 * w / h**0.5, rel=1e-13)
    assert z == pytest.approx(section.scale * kappa**0.5, rel=1e-13)
    phi = 4 / v**2 * (0.5 - g_of(z))
    plain = 0.5 * (1 - nu**2) * (kappa - big_k) ** 2 + (1 - nu) * tau**2
    full = plain + 3 * (1 - nu**2) * w**4 / h**2 * (nu * kappa * (kappa - big_k) + tau**2) ** 2 * phi
    b = nu * (kappa - big_k) + eta**2 * kappa
    assert full == pytest.approx(plain + b**2 * (0.5 - g_of(z)), rel=1e-13)
    limit = 0.5 * kappa**2 * (1 + eta**2) ** 2 - big_k * kappa * (1 + nu * eta**2) + 0.5 * big_k**2
    assert full == pytest.approx(limit - b**2 * g_of(z), rel=1e-12)
    a = 10**0.5 * w / (2 * h)
    chi = np.tanh(a) / a
    at = np.array([kappa]), np.array([eta]), np.array([big_k])
    assert section.softening(*at)[0][0] == pytest.approx(-(b**2) * g_of(z) - (1 - nu) * chi * tau**2, rel=1e-12)
    assert section.shear(*at[:2])[0] == pytest.approx(0.5 * (1 - nu) * tau**2 * (chi - 1 / np.cosh(a) ** 2), rel=1e-12)
    assert chi == pytest.approx(0.63 * h / w, rel=5e-3)
    thin = Section(poisson=nu, width=w, thickness=h / 1e4)
    assert thin.membrane(*at)[0] == pytest.approx(b**2 / (4 * 100 * z), rel=1e-6)
    small = np.array([0.3])
    assert (0.5 - layer(small)[0][0]) * 4 / (2 * small[0] ** 2) ** 2 == pytest.approx(1 / 360, rel=1e-3)


def test_strains_in_the_moving_frame_10_8():
    """Of the surface r + y t_x + f t_y, by differences: second-order terms of the stretch, first-order curvatures."""

    def wrong(size):
        def rates(s, u):
            turn = size * np.array([2.0 + s, 0.0, 1.0 - 3.0 * s])
            frame = u[3:].reshape(3, 3)
            skew = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
            return np.concatenate([frame[:, 2], (frame @ skew).ravel()])

        start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
        path = solve_ivp(rates, (-0.1, 0.1), start, rtol=1e-12, atol=1e-13, dense_output=True).sol

        def at(s, y):
            u = path(s)
            f = size * (0.3 + 0.7 * s + 0.9 * s * s) * y * y
            return u[:3] + u[3:].reshape(3, 3) @ np.array([y, f, 0.0])

        s, y, d = 0.02, 0.4, 1e-3
        x_s, x_y = (at(s + d, y) - at(s - d, y)) / (2 * d), (at(s, y + d) - at(s, y - d)) / (2 * d)
        x_ss = (at(s + d, y) - 2 * at(s, y) + at(s - d, y)) / d**2
        x_yy = (at(s, y + d) - 2 * at(s, y) + at(s, y - d)) / d**2
        x_sy = (at(s + d, y + d) - at(s + d, y - d) - at(s - d, y + d) + at(s - d, y - d)) / (4 * d * d)
        normal = np.cross(x_s, x_y)
        normal /= np.linalg.norm(normal)
        k, t, amount = size * (2.0 + s), size * (1.0 - 3.0 * s), size * (0.3 + 0.7 * s + 0.9 * s * s)
        f, f_s = amount * y * y, size * (0.7 + 1.8 * s) * y * y
        stretch = k * f + 0.5 * (t * y + f_s) ** 2
        bent = [k + 3.0 * size * y - 1.8 * size * y * y, -(t + 2.0 * size * (0.7 + 1.8 * s) * y), -2.0 * amount]
        found = [-x_ss @ normal, -x_sy @ normal, -x_yy @ normal]
        return abs(0.5 * (x_s @ x_s - 1.0) - stretch), np.abs(np.subtract(found, bent)).max() / size

    large, small = wrong(4e-2), wrong(2e-2)
    assert small[0] < 1e-5
    assert large[0] / small[0] > 7.0  # third order
    assert small[1] < 1e-2
    assert large[1] / small[1] > 1.8  # second order, over size


SECTION_10 = (0.02, 5e-4, 0.35, 0.0)  # w / (2 l), h / l, nu, stiffness
STATE_10 = (6.0, 2.5, 20.0, -15.0, 4.0, 3.0)  # kappa, tau, kappa', tau', K, K'


def free(name, state=STATE_10, section=SECTION_10):
    out = np.empty(15)
    free_density(FREE_CODES[name], *state, section, out)
    return out[0]


def across_10(order=80):
    """Places y and weights over the width, states, w, h, nu, c4, Y, B and the profile of (10.10) of these sections."""
    xi, w = np.polynomial.legendre.leggauss(order)
    width, thickness, nu = 2 * SECTION_10[0], SECTION_10[1], SECTION_10[2]
    c4 = 3 * (1 - nu**2) * width**4 / thickness**2
    k, t, _, _, big_k, _ = STATE_10
    local = Local(*(np.array([v]) for v in STATE_10))
    return 0.5 * xi, 0.5 * w, width, thickness, nu, c4, c4 * k * k, nu * k * (k - big_k) + t * t, local


def test_relaxed_section_10_9_to_10_11():
    """The profile is stationary for (10.9), its stretch is w^2 B Phi, and its energy is that of `extensible`."""
    xi, w, width, thickness, nu, c4, big_y, b, local = across_10()
    k, t, _, _, big_k, _ = STATE_10
    y = width * xi
    psi = unit(np.array([big_y]), xi)
    f = FREE_ENERGIES["extensible"].section.shape(local, y, SECTION_10).f[0]
    flat = 0.5 * xi**2 - 1 / 24
    np.testing.assert_allclose(f, width**2 * (nu * (k - big_k) * flat - c4 * k * b * psi.value[0]), rtol=1e-13)
    stretch = k * f + t**2 * (y**2 / 2 - width**2 / 24)
    np.testing.assert_allclose(stretch, width**2 * b * (flat - big_y * psi.value[0]), rtol=0, atol=1e-13)
    bent = c4 * k * b * psi.curvature[0] - nu * (k - big_k)

    def energy(amount):
        curved = bent + amount * 90.0 * (xi**2 - 1 / 12)  # a section of mean zero moved by amount times the second
        fibre = stretch + k * amount * -(width**2) * 90.0 * (xi**4 / 12 - xi**2 / 24 + 7 / 2880 - 1 / 960)
        membrane = 6 * (1 - nu**2) / thickness**2 * (fibre - w @ fibre) ** 2
        bending = 0.5 * (k - big_k) ** 2 + nu * (k - big_k) * curved + 0.5 * curved**2
        return w @ (bending + membrane) + (1 - nu) * t**2

    a = 10**0.5 * width / (2 * thickness)
    chi = np.tanh(a) / a
    assert energy(0.0) == pytest.approx(free("extensible") + big_k**2 / 2 + (1 - nu) * chi * t**2, rel=1e-11)
    z = big_y**0.25
    plain = 0.5 * (1 - nu**2) * (k - big_k) ** 2 + (1 - nu) * (1 - chi) * t**2 - big_k**2 / 2
    assert free("extensible") == pytest.approx(plain + c4 * b**2 * (0.5 - g_of(z)) / big_y, rel=1e-12)
    up, down = energy(1e-2) - energy(0.0), energy(-1e-2) - energy(0.0)
    assert up > 0.0
    assert up == pytest.approx(down, rel=1e-8)


def gradients_10(k, t, dk, dt):
    """psi, eta, x of (10.12), x by a difference of eta along the strip; zeta^-2."""
    width, thickness, nu = 2 * SECTION_10[0], SECTION_10[1], SECTION_10[2]
    soft = 60 * thickness**2 / ((1 - nu**2) * width**4)

    def eta(s):
        return (k + s * dk) * (t + s * dt) / ((k + s * dk) ** 2 + soft)

    step = 1e-4
    rate = (8 * (eta(step) - eta(-step)) - (eta(2 * step) - eta(-2 * step))) / (12 * step)
    return k**2 / (k**2 + soft), eta(0.0), width / 2 * rate, soft


def test_gradients_of_finite_10_12_and_10_13():
    width = 2 * SECTION_10[0]
    for state in (STATE_10, (0.4, -2.0, 15.0, 9.0, 1.0, 0.0)):
        k, t, dk, dt = state[:4]
        psi, eta, x, soft = gradients_10(k, t, dk, dt)
        assert abs(x) < 0.98
        factor = np.log((1 + x) / (1 - x)) / (2 * x)
        added = (1 - psi) * width**2 / 24 * dt**2 + 0.5 * (k**2 + soft) * (1 + eta**2) ** 2 * (factor - 1)
        assert free("finite", state) - free("extensible", state) == pytest.approx(added, rel=1e-7)


def test_terms_dropped_by_finite_10_14():
    xi, w, width, thickness, nu, *_ = across_10()
    k, t, dk, dt, big_k, slope = STATE_10
    shape, step = FREE_ENERGIES["finite"].section.shape, 1e-5

    def tilt(n):
        moved = (k + n * step * dk, t + n * step * dt, dk, dt, big_k + n * step * slope, slope)
        return shape(Local(*(np.array([v]) for v in moved)), width * xi, SECTION_10).across[0]

    rate = (8 * (tilt(1) - tilt(-1)) - (tilt(2) - tilt(-2))) / (12 * step)
    psi = gradients_10(k, t, dk, dt)[0]
    length = 1e-4
    natural = np.array([[big_k + length * slope * x for x in (np.polynomial.legendre.leggauss(5)[0] + 1) / 2]])
    found = Dropped(width, thickness, nu).along(np.array([[dk, k, dt, t]]), np.array([length]), natural)
    assert found["along"][0] / length == pytest.approx((1 - psi) * (1 - nu) * (w @ rate**2), rel=1e-2)
    assert found["odd"][0] / length == pytest.approx(-(1 - psi) * nu**2 * width**2 / 24 * dt**2, rel=1e-2)


def test_shares_10_15_and_10_16():
    xi, w, width, thickness, nu, c4, big_y, b, local = across_10()
    k, t, _, _, big_k, _ = STATE_10
    y, r = width * xi, 10**0.5 / thickness
    psi = unit(np.array([big_y]), xi)
    a, bent = k - big_k, c4 * k * b * psi.curvature[0] - nu * (k - big_k)
    twist = t * (1 - np.cosh(r * y) / np.cosh(r * width / 2))
    bending = 0.5 * (a**2 + 2 * nu * a * bent + bent**2) + (1 - nu) * twist**2
    more = free("finite") - free("extensible")
    phi = 0.5 * xi**2 - 1 / 24 - big_y * psi.value[0]
    shear = (1 - nu) * t**2 * np.sinh(r * y) ** 2 / np.cosh(r * width / 2) ** 2
    for name, added in (("extensible", 0.0), ("finite", 12 * xi**2 * more)):
        shares = FREE_ENERGIES[name].section.shares(local, y, SECTION_10)
        np.testing.assert_allclose(shares.bending[0], bending + added, rtol=1e-6)
        np.testing.assert_allclose(shares.membrane[0], 2 * c4 * (b * phi) ** 2, rtol=1e-10)
        np.testing.assert_allclose(shares.shear[0], shear, rtol=1e-9, atol=1e-30)
    section = Section(poisson=nu, width=width, thickness=thickness)
    at = np.array([k]), np.array([t / k]), np.array([big_k])
    assert w @ shares.membrane[0] == pytest.approx(section.membrane(*at)[0], rel=1e-10)


def test_regularised_and_rod_10_17_and_10_18():
    width, thickness, nu = 2 * SECTION_10[0], SECTION_10[1], SECTION_10[2]
    k, t, _, _, big_k, _ = STATE_10
    b = nu * k * (k - big_k) + t * t
    zeta2 = (1 - nu**2) * width**4 / (60 * thickness**2)
    plain = 0.5 * (1 - nu**2) * (k - big_k) ** 2 + (1 - nu) * t**2 - big_k**2 / 2
    assert free("sano") == pytest.approx(plain + 0.5 * b**2 / (1 / zeta2 + k**2), rel=1e-12)
    chi = 2 * thickness / (10**0.5 * width)
    helicoid = (0.0, t, 0.0, 0.0, big_k, 0.0)
    assert free("sano", helicoid) - (1 - nu) * chi * t**2 == pytest.approx(free("extensible", helicoid), rel=1e-10)
    odd = np.arange(1, 400, 2)
    series = (np.tanh(odd * np.pi * width / 2 / thickness) / odd**5).sum()
    torsion = (1 - nu) * (1 - 192 * thickness / (np.pi**5 * width) * series)
    for plate, beta in ((0.0, 1.0), (1.0, 1 - nu**2)):
        value = 0.5 * beta * (k - big_k) ** 2 + torsion * t**2 - big_k**2 / 2
        assert free("kirchhoff", section=(*SECTION_10[:3], plate)) == pytest.approx(value, rel=1e-10)


def test_in_plane_bending_and_tension_10_5():
    """Stiffnesses of the section over D w, from Young's modulus in units of D: Y = 12 (1 - nu^2) / h^3."""
    nu, w, h = 0.3, 0.1, 1e-3
    young = 12 * (1 - nu**2) / h**3
    moment, tension = np.array([0.7]), np.array([-1.3])
    bending = moment**2 / (2 * young * h * w**3 / 12 / w)
    assert in_plane_density(moment, nu, w, h) == pytest.approx(bending, rel=1e-13)
    assert tension_density(tension, nu, h) == pytest.approx(tension**2 / (2 * young * h * w / w), rel=1e-13)


# -- 12 the shearable rod ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rod():
    """Bent and twisted at rest, thick, under its weight and a force across it."""
    problem = RodProblem(
        rectangle(0.2, 0.05, 0.3), (2.0, 4.0), (1.0, 1.0), (0.5, 1.0),
        weight=np.array([-3.0, 1.0, 0.0]), force=np.array([0.0, 2.0, 5.0]),
    )  # fmt: skip
    return solve_rod(problem, 16, 3)


def test_strains_12_1_and_12_5(rod):
    """R^T r' - e_z and R^T R' by central differences of the solution, at Gauss points."""
    s, d = rod.elements.points.ravel()[5::7], 1e-4
    more, less, here = rod.frames(s + d), rod.frames(s - d), rod.frames(s)
    speed = (rod.position(s + d) - rod.position(s - d)) / (2 * d)
    gamma = np.einsum("kji,kj->ki", here, speed) - [0.0, 0.0, 1.0]
    spin = np.einsum("kji,kjl->kil", here, (more - less) / (2 * d))
    kappa = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
    np.testing.assert_allclose(rod.strains(s), np.column_stack([gamma, kappa]), atol=2e-5)


def test_energy_12_2_and_its_loads(rod):
    """The integral of the strains' energy, and the work of weight and force."""
    x, w = np.polynomial.legendre.leggauss(3)
    s = ((np.arange(16)[:, None] + 0.5 * (1 + x)) / 16).ravel()
    weights = np.tile(w / 32, 16)
    stored = 0.5 * weights @ (rod.excess(s) ** 2 @ rod.problem.section.stiffness)
    assert rod.energy.elastic == pytest.approx(stored, rel=1e-12)
    assert rod.energy.gravity == pytest.approx(-weights @ (rod.position(s) @ rod.problem.weight), rel=1e-12)
    assert rod.energy.force == pytest.approx(-rod.position([1.0])[0] @ rod.problem.force, rel=1e-12)


def test_section_12_3():
    found = rectangle(0.2, 0.05, 0.3)
    young = 12 * (1 - 0.3**2) / (0.2 * 0.05**3)  # of D w = 1, in units of l
    torsion = 3 * 0.2 * 0.05**3 / 3 * 0.281  # Timoshenko's rectangle 4 : 1, 0.281 w h^3
    assert found.bending == pytest.approx((1.0, young * 0.05 * 0.2**3 / 12))
    assert found.stretch == pytest.approx(young * 0.2 * 0.05)
    assert found.shear[0] == pytest.approx(5 / 6 * young / 2.6 * 0.2 * 0.05)
    assert found.torsion == pytest.approx(young / 2.6 * torsion, rel=2e-3)


def test_balance_12_4(rod):
    """Force and moment of a section against all loads behind it."""
    s = np.array([0.1, 0.35, 0.6, 0.85])
    frames, stress = rod.frames(s), rod.section_forces(s)
    n = np.einsum("kij,kj->ki", frames, stress[:, :3])
    m = np.einsum("kij,kj->ki", frames, stress[:, 3:])
    p, force = rod.problem.weight, rod.problem.force
    for i, at in enumerate(s):
        np.testing.assert_allclose(n[i], force + (1 - at) * p, atol=2e-2)
        rest = np.linspace(at, 1.0, 2001)
        arm = rod.position(rest) - rod.position([at])[0]
        about = np.cross(arm[-1], force) + np.cross(trapezoid(arm, rest, axis=0), p)
        np.testing.assert_allclose(m[i], about, atol=2e-3)


def test_tangent_12_6_and_12_7(rod):
    """The second derivative along one turn of a node, and the skew part that a moment adds."""
    elements, problem, state = rod.elements, rod.problem, rod.state
    tangent = elements.tangent(state, problem, elements.stress(state, problem))
    step, d = np.zeros((len(elements.s), 6)), 1e-3
    step[7, 3:] = [0.3, -0.5, 0.8]

    def energy(t):
        return elements.energy(state.moved(t * step), problem).sum()  # this turn moves no load

    second = (energy(d) - 2 * energy(0.0) + energy(-d)) / d**2
    assert step.ravel() @ (tangent @ step.ravel()) == pytest.approx(second, rel=1e-4)
    moment = np.array([1.0, -2.0, 3.0])
    more = elements.tangent(state, replace(problem, moment=moment), elements.stress(state, problem))
    corner = (more - tangent).toarray()[-3:, -3:]
    np.testing.assert_allclose(corner, -0.5 * cross(rod.frames([1.0])[0].T @ moment), atol=1e-12)
