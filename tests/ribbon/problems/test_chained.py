"""Energy, gradient and Hessian of the whole chained ribbon against the multiple-precision twin."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip
from ribbon.problems.chained import ChainedProblem, segment_lengths
from tests.reference import ribbon_energy

HALF = 2**-0.5
LENGTHS = np.array([0.1, 0.35, 0.2, 0.35])
WIDTH = 0.06


def problem(energy, gravity=True, ruling="free"):
    strip = Strip(1.0, WIDTH, 0.4, (10.0, -6.0), 100.0)
    clamp = Clamp((0.1, -0.2, 0.3), (0, 0, 1), (-HALF, HALF, 0), ruling)
    return ChainedProblem(strip, clamp, Gravity((0.6, 0.0, 0.8)) if gravity else None, energy, LENGTHS)


def twin(pr):
    gamma, up = (pr.strip.gamma, pr.gravity.up) if pr.gravity else (0.0, (0, 0, 0))
    return lambda x: ribbon_energy.energy(
        x, pr.lengths, pr.energy, pr.strip.relative_width, pr.strip.poisson, pr.strip.curvature, gamma, up,
        pr.clamp.position, pr.clamp.frame.tolist(),
    )  # fmt: skip


def state(kind, seed):
    """A random state; eta' generic, close to +-2/w, or close to 0."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=2 * LENGTHS.size + 2) * np.tile([15.0, 1.0], LENGTHS.size + 1)
    x[1] *= 0.3
    bound = 2.0 / WIDTH
    if kind == "near the bound":
        x[3::2] = np.array([1, -1, 1, -1]) * bound * (1 - 10.0 ** -np.array([1.0, 2.0, 3.0, 5.0]))
        x[::2] *= 0.1
    elif kind == "near zero":
        x[3::2] = [1e-9, -1e-5, 0.0, 1e-13]
    return x


#: Differences in 40 digits take half a minute with weight: in every run each kind once, all of them in `make validate`.
HEAVY = {("sadowsky", "generic"), ("wunderlich", "near the bound"), ("sadowsky", "near zero")}
DERIVATIVES = [
    pytest.param(
        energy, kind, gravity, id=f"{'gravity' if gravity else 'weightless'}-{kind}-{energy}",
        marks=pytest.mark.validate if gravity and (energy, kind) in HEAVY else (),
    )
    for gravity in (True, False)
    for kind in ("generic", "near the bound", "near zero")
    for energy in ("sadowsky", "wunderlich")
]  # fmt: skip


@pytest.mark.parametrize(("energy", "kind", "gravity"), DERIVATIVES)
def test_energy_gradient_and_hessian_to_1e_9(energy, kind, gravity):
    pr = problem(energy, gravity)
    for seed in (1, 2) if kind == "generic" else (3,):
        x = state(kind, seed)
        function = twin(pr)
        with mp.workdps(ribbon_energy.DIGITS):
            exact = float(function(x.tolist()))
        gradient, hessian = (np.array(v) for v in ribbon_energy.derivatives(function, x.tolist()))
        assert pr.value(x) == pytest.approx(exact, rel=1e-12)
        assert np.abs(pr.gradient(x) - gradient).max() < 1e-9 * np.abs(gradient).max()
        scale = np.sqrt(np.abs(np.outer(np.diag(hessian), np.diag(hessian))))
        error = np.abs(pr.hessian(x) - hessian)
        assert error.max() < 1e-9 * np.abs(hessian).max()
        # not only against the largest entry: row by row as well
        assert np.all(error < 1e-9 * np.maximum(scale, np.abs(hessian).max(axis=1, keepdims=True)))


def test_parts_of_the_energy_add_up_and_gravity_alone_is_linear_in_gamma():
    pr = problem("wunderlich")
    x = state("generic", 3)
    parts = pr.energy_parts(x)
    assert parts.sum() == pytest.approx(pr.value(x), rel=1e-14)
    other = ChainedProblem(Strip(1.0, WIDTH, 0.4, (10.0, -6.0), 250.0), pr.clamp, pr.gravity, "wunderlich", LENGTHS)
    assert other.energy_parts(x)[2] == pytest.approx(2.5 * parts[2], rel=1e-12)


def test_what_is_off_is_not_computed():
    """No weight: no series at all. A straight clamp: one unknown less."""
    pr = problem("wunderlich", gravity=False)
    x = state("generic", 4)
    pr.value(x)
    pr.gradient(x)
    pr.hessian(x)
    assert pr.counters.series == 0
    heavy = problem("wunderlich")
    heavy.value(x)
    assert heavy.counters.series == LENGTHS.size
    lower, upper = problem("wunderlich", ruling="straight").bounds()
    assert np.sum(lower == upper) == 1
    assert lower[1] == upper[1] == 0.0


def test_bounds_keep_rulings_from_crossing():
    lower, upper = problem("sadowsky").bounds()
    assert upper[3::2] == pytest.approx(np.full(LENGTHS.size, 2 / WIDTH), rel=1e-15)
    assert lower[3::2] == pytest.approx(np.full(LENGTHS.size, -2 / WIDTH), rel=1e-15)
    assert np.all(np.isinf(upper[2::2]))


def test_metric_is_the_gram_matrix_of_omega_and_eta():
    pr = problem("sadowsky")
    rng = np.random.default_rng(5)
    x = rng.normal(size=pr.size)
    q = pr.parameters(x)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    total = 0.0
    for (a, b, n, m), length in zip(q, LENGTHS, strict=True):
        s = 0.5 * length * (nodes + 1)
        total += 0.5 * length * np.sum(weights * ((a * s + b) ** 2 + (n * s + m) ** 2))
    assert x @ pr.metric() @ x == pytest.approx(total, rel=1e-13)


@pytest.mark.parametrize(
    ("segments", "key"),
    [(0, "segments"), (-3, "segments"), ([0.5, 0.6], "segments"), ([0.5, -0.1, 0.6], "segments"), ([], "segments"),
     (True, "segments"), ([0.5, float("nan")], "segments")],
)  # fmt: skip
def test_bad_segments(segments, key):
    with pytest.raises(RibbonInputError) as caught:
        segment_lengths(segments)
    assert caught.value.key == key
    assert "\n" not in str(caught.value)
