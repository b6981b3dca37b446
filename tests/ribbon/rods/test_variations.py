"""The variation formulas of du Peloux 2017, chapter 4, on smooth random rods: complex steps, Chebyshev quadrature.

Curves of unit speed come from two angles of the tangent, t = (sin b cos a, sin b sin a, cos b), the Bishop frame from
psi' = -a' cos b over the frame of the sphere. A variation changes the angles, so that the length stays; it leaves the
tangent at s = 0, where the frame is given. Derivatives by lambda are exact to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.polynomial import chebyshev

DEGREE = 64
#: Imaginary step, and how well formulas are met that differentiate a Chebyshev sum up to three times.
STEP, CLOSE = 1e-30, 2e-8
NODES = chebyshev.chebpts1(DEGREE + 1)
S = 0.5 * (NODES + 1.0)
FIT = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE))
SLOPE = chebyshev.chebvander(NODES, DEGREE - 1) @ (2.0 * chebyshev.chebder(np.eye(DEGREE + 1))) @ FIT
WHOLE = 0.5 * chebyshev.chebint(np.eye(DEGREE + 1), lbnd=-1.0)
SUM = chebyshev.chebvander(NODES, DEGREE + 1) @ WHOLE @ FIT
TOTAL = chebyshev.chebvander(np.array([1.0]), DEGREE + 1)[0] @ WHOLE @ FIT
ENDS = chebyshev.chebvander(np.array([-1.0, 1.0]), DEGREE) @ FIT
J = np.array([[0.0, -1.0], [1.0, 0.0]])


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a.b without a conjugate."""
    return (a * b).sum(axis=1)


def at_ends(values: np.ndarray) -> np.ndarray:
    """[values] from s = 0 to s = 1."""
    first, last = ENDS @ values
    return last - first


@dataclass(frozen=True)
class Smooth:
    """A rod: angles a, b of the tangent and theta (k,) at the nodes; B, G J; omega and theta' at rest."""

    a: np.ndarray
    b: np.ndarray
    theta: np.ndarray
    stiffness: np.ndarray
    torsion: float
    omega_0: np.ndarray
    tau_0: np.ndarray

    @property
    def t(self) -> np.ndarray:
        return np.column_stack([np.sin(self.b) * np.cos(self.a), np.sin(self.b) * np.sin(self.a), np.cos(self.b)])

    @property
    def bishop(self) -> tuple[np.ndarray, np.ndarray]:
        """u, v."""
        e1 = np.column_stack([np.cos(self.b) * np.cos(self.a), np.cos(self.b) * np.sin(self.a), -np.sin(self.b)])
        e2 = np.column_stack([-np.sin(self.a), np.cos(self.a), 0.0 * self.a])
        psi = -(SUM @ ((SLOPE @ self.a) * np.cos(self.b)))[:, None]
        return np.cos(psi) * e1 + np.sin(psi) * e2, np.cos(psi) * e2 - np.sin(psi) * e1

    @property
    def directors(self) -> tuple[np.ndarray, np.ndarray]:
        (u, v), theta = self.bishop, self.theta[:, None]
        return np.cos(theta) * u + np.sin(theta) * v, np.cos(theta) * v - np.sin(theta) * u

    @property
    def omega(self) -> np.ndarray:
        """(kappa_1, kappa_2), (4.15)."""
        (d1, d2), bend = self.directors, SLOPE @ self.t
        return np.column_stack([-dot(bend, d2), dot(bend, d1)])

    @property
    def kb(self) -> np.ndarray:
        return np.cross(self.t, SLOPE @ self.t)

    @property
    def couple(self) -> np.ndarray:
        """(M1, M2)."""
        return (self.omega - self.omega_0) * self.stiffness

    @property
    def m(self) -> np.ndarray:
        """M1 d1 + M2 d2, (4.57)."""
        d1, d2 = self.directors
        return self.couple[:, :1] * d1 + self.couple[:, 1:] * d2

    @property
    def q(self) -> np.ndarray:
        return self.torsion * (SLOPE @ self.theta - self.tau_0)

    @property
    def energy(self) -> complex:
        """(4.16)."""
        away = self.omega - self.omega_0
        return 0.5 * TOTAL @ (dot(away * self.stiffness, away) + self.q**2 / self.torsion)


@dataclass(frozen=True)
class Varied:
    """A rod, its variation by lambda = i STEP, and h' and h of its centreline (h = 0 at s = 0 unless moved)."""

    rod: Smooth
    other: Smooth
    dh: np.ndarray
    h: np.ndarray

    def change(self, name: str) -> np.ndarray:
        """Derivative by lambda of a property."""
        value = getattr(self.other, name)
        parts = value if isinstance(value, tuple) else (value,)
        found = [np.imag(part) / STEP for part in parts]
        return found if isinstance(value, tuple) else found[0]


def smooth(rng: np.random.Generator, size: float) -> np.ndarray:
    return chebyshev.chebvander(NODES, 6) @ (size * rng.normal(size=7) / (1.0 + np.arange(7)) ** 2)


@pytest.fixture(params=[1, 2, 3])
def bent(request) -> Varied:
    """The centreline changes, theta does not; all of it moves too."""
    rng = np.random.default_rng(request.param)
    rest = np.column_stack([smooth(rng, 1.0), smooth(rng, 1.0)])
    rod = Smooth(
        smooth(rng, 2.0), 1.5 + smooth(rng, 0.6), smooth(rng, 2.0), np.array([1.0, 5.0]), 0.7, rest, smooth(rng, 1.0)
    )
    ways = [S * smooth(rng, 1.0) for _ in range(2)]  # the tangent at s = 0 stays
    other = replace(rod, a=rod.a + 1j * STEP * ways[0], b=rod.b + 1j * STEP * ways[1])
    dh = np.imag(other.t) / STEP
    return Varied(rod, other, dh, SUM @ dh + rng.normal(size=3))


def balanced(bent: Varied) -> Varied:
    """The same curve and angle, with a shape at rest for which m = 0 (4.29)."""
    rng = np.random.default_rng(5)
    rod = bent.rod
    couple = np.column_stack([smooth(rng, 1.0), smooth(rng, 2.0)])
    twisting = 0.7 + SUM @ (rod.omega[:, 1] * couple[:, 0] - rod.omega[:, 0] * couple[:, 1])
    rest = {"omega_0": rod.omega - couple / rod.stiffness, "tau_0": SLOPE @ rod.theta - twisting / rod.torsion}
    return replace(bent, rod=replace(rod, **rest), other=replace(bent.other, **rest))


def test_frames(bent):
    """(4.3), (4.6), (4.10), (4.14): no spin of u and v, d1'.d2 = theta', kb from both sides, also where t' is small."""
    rod = bent.rod
    u, v = rod.bishop
    (d1, d2), omega = rod.directors, rod.omega
    assert dot(SLOPE @ u, v) == pytest.approx(0.0 * S, abs=CLOSE)
    assert dot(SLOPE @ d1, d2) == pytest.approx(SLOPE @ rod.theta, abs=CLOSE)
    assert rod.kb == pytest.approx(omega[:, :1] * d1 + omega[:, 1:] * d2, abs=CLOSE)
    assert dot(bent.dh, rod.t) == pytest.approx(0.0 * S, abs=1e-12)  # (4.2)


def test_by_theta(bent):
    """(4.21) D omega.h = -J omega h and (4.28), the twisting moment with its ends; (4.69) is the same."""
    rod = bent.rod
    h = np.cos(3.0 * S) + S
    other = replace(rod, theta=rod.theta + 1j * STEP * h)
    assert np.imag(other.omega) / STEP == pytest.approx(-h[:, None] * (rod.omega @ J.T), abs=1e-10)
    m = SLOPE @ rod.q + dot(rod.couple, rod.omega @ J.T)
    assert m == pytest.approx(SLOPE @ rod.q - dot(rod.kb, np.cross(rod.t, rod.m)), abs=CLOSE)
    slope = np.imag(other.energy) / STEP
    assert slope == pytest.approx(-(TOTAL @ (m * h)) + at_ends(rod.q * h), abs=CLOSE)
    assert abs(at_ends(rod.q * h)) > 0.01


def test_turn_of_the_bishop_frame(bent):
    """(4.32) Psi = -int kb.h' and (4.33). Its first line, (4.30), has the wrong sign: Psi = + int kb[x + h].d3[x]; so
    has its second, (h' x x'').x' = -kb.h'. The two cancel."""
    rod = bent.rod
    v = rod.bishop[1]
    psi = dot(bent.change("bishop")[0], v)
    assert psi == pytest.approx(-(SUM @ dot(rod.kb, bent.dh)), abs=CLOSE)
    parts = dot(rod.kb, bent.h) - ENDS[0] @ dot(rod.kb, bent.h) - SUM @ dot(SLOPE @ rod.kb, bent.h)
    assert psi == pytest.approx(-parts, abs=CLOSE)
    assert psi == pytest.approx(SUM @ dot(bent.change("kb"), rod.t), abs=CLOSE)
    assert dot(np.cross(bent.dh, SLOPE @ rod.t), rod.t) == pytest.approx(-dot(rod.kb, bent.dh), abs=CLOSE)
    assert np.abs(psi).max() > 0.02


def test_axis_of_the_turn(bent):
    """(4.40) and (4.44): u_eps.t = alpha cos gamma, v_eps.t = -alpha sin gamma need b = sin gamma u + cos gamma v, with
    b = t_eps x t; with b = cos gamma u + sin gamma v, as printed, they miss."""
    rod = bent.rod
    u, v = rod.bishop
    turn = np.cross(bent.dh, rod.t)  # alpha b
    du, dv = bent.change("bishop")
    sine, cosine = dot(turn, u), dot(turn, v)
    assert dot(du, rod.t) == pytest.approx(cosine, abs=1e-10)
    assert dot(dv, rod.t) == pytest.approx(-sine, abs=1e-10)
    printed_sine, printed_cosine = cosine, sine
    assert np.abs(dot(du, rod.t) - printed_cosine).max() > 0.02
    assert np.abs(dot(dv, rod.t) + printed_sine).max() > 0.02
    # (4.46a): cos(theta + gamma), printed cos(theta - gamma); (4.46b): -sin(theta + gamma)
    d1, d2 = bent.change("directors")
    alpha_cos = np.cos(rod.theta) * cosine - np.sin(rod.theta) * sine
    alpha_sin = np.sin(rod.theta) * cosine + np.cos(rod.theta) * sine
    assert dot(d1, rod.t) == pytest.approx(alpha_cos, abs=1e-10)
    assert dot(d2, rod.t) == pytest.approx(-alpha_sin, abs=1e-10)
    printed = np.cos(rod.theta) * cosine + np.sin(rod.theta) * sine
    assert np.abs(dot(d1, rod.t) - printed).max() > 0.02


def test_curvatures_by_the_centreline(bent):
    """(4.49), (4.50): the frame's turn, not local, and the bend itself."""
    rod = bent.rod
    d1, d2 = rod.directors
    second = SLOPE @ bent.dh
    local = np.column_stack([-dot(second, d2), dot(second, d1)])
    turned = SUM @ dot(rod.kb, bent.dh)
    assert bent.change("omega") == pytest.approx(turned[:, None] * (rod.omega @ J.T) + local, abs=CLOSE)
    assert np.abs(bent.change("omega") - local).max() > 0.02


def test_forces_without_quasi_static_twist(bent):
    """(4.54), (4.60), (4.63): D_x E.h = A + B + C, a backward sum, with the ends that (4.63) leaves out; (4.60) with h'
    and (d3 x M').h at its ends, where h'' is printed."""
    rod = bent.rod
    across = np.cross(rod.t, SLOPE @ rod.m)
    a = at_ends(dot(across, bent.h) - dot(np.cross(rod.t, rod.m), bent.dh)) - TOTAL @ dot(SLOPE @ across, bent.h)
    direct = TOTAL @ (-dot(np.cross(rod.t, rod.m), SLOPE @ bent.dh))
    assert a == pytest.approx(direct, abs=CLOSE)
    printed = at_ends(dot(across, SLOPE @ bent.dh) - dot(np.cross(rod.t, rod.m), bent.dh))
    assert abs(printed - TOTAL @ dot(SLOPE @ across, bent.h) - direct) > 0.01
    density = dot(rod.couple, rod.omega @ J.T)
    behind = TOTAL @ density - SUM @ density  # int from t to L
    b_and_c = -(TOTAL @ dot(SLOPE @ (behind[:, None] * rod.kb), bent.h)) + at_ends(behind * dot(rod.kb, bent.h))
    assert bent.change("energy") == pytest.approx(a + b_and_c, abs=CLOSE)
    assert abs(at_ends(behind * dot(rod.kb, bent.h))) > 0.01


def test_forces_with_quasi_static_twist(bent):
    """(4.64), (4.67), (4.68): with m = 0 the force is f = (d3 x M')' + (Q kb)', T = d3 x M' + Q kb. At ends with free
    frames Q(L) Psi(L) is left; where the material frame is held theta(L) turns by -Psi(L) and takes it away."""
    bent = balanced(bent)
    rod = bent.rod
    assert SLOPE @ rod.q + dot(rod.couple, rod.omega @ J.T) == pytest.approx(0.0 * S, abs=1e-6)
    shear = np.cross(rod.t, SLOPE @ rod.m) + rod.q[:, None] * rod.kb
    local = -(TOTAL @ dot(SLOPE @ shear, bent.h)) + at_ends(dot(shear, bent.h) - dot(np.cross(rod.t, rod.m), bent.dh))
    turn = -(TOTAL @ dot(rod.kb, bent.dh))
    last = ENDS[1] @ rod.q
    assert bent.change("energy") == pytest.approx(local + last * turn, abs=1e-6)
    assert abs(last * turn) > 1e-3
    held = replace(bent.other, theta=bent.other.theta - 1j * STEP * turn * S)
    d1 = ENDS[1] @ (np.imag(held.directors[0]) / STEP)
    assert d1 @ (ENDS[1] @ rod.directors[1]) == pytest.approx(0.0, abs=1e-9)  # d1(L) does not turn about t
    assert np.imag(held.energy) / STEP == pytest.approx(local, abs=1e-6)


def test_no_term_is_missing(bent):
    """The note after (4.67): M' is the derivative of the vector and has tau M in it; d3 x M' is Kirchhoff's shear."""
    rod = bent.rod
    d1, d2 = rod.directors
    couple, tau = rod.couple, SLOPE @ rod.theta
    slopes = SLOPE @ couple
    along = SLOPE @ rod.m
    assert dot(along, d1) == pytest.approx(slopes[:, 0] - tau * couple[:, 1], abs=CLOSE)
    assert dot(along, d2) == pytest.approx(slopes[:, 1] + tau * couple[:, 0], abs=CLOSE)
    # balance of moments, d3 x T = -(M + Q t)' across t, with (4.68)
    bent = balanced(bent)
    rod = bent.rod
    whole = SLOPE @ (rod.m + rod.q[:, None] * rod.t)
    shear = np.cross(rod.t, SLOPE @ rod.m) + rod.q[:, None] * rod.kb
    assert whole + np.cross(rod.t, shear) == pytest.approx(0.0 * whole, abs=1e-6)
