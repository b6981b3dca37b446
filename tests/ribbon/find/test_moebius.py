"""Moebius bands through the API: known energy, widths, sliding seam, forces, the event."""

from __future__ import annotations

import numpy as np
import pytest

from compare.battery.judge.ribbon import judged
from compare.models.ribbon.stages import run_way
from compare.scene.scene import load
from ribbon import Closure, Strip, solve
from ribbon.find.adaptive import solve_to_tolerance
from tests.validation.ribbon import moebius, wunderlich_event


def band(width: float, segments: int, poisson: float = 0.5):
    return solve(Strip(1, width, poisson), closure=Closure("moebius"), segments=segments)


def test_energy_of_starostin_and_van_der_heijden():
    """U = 5.93 pi^2 at w/l = 1/30 (Nature Materials, 2007); from above, as p grows."""
    energies = [band(1 / 30, p).energy.total / np.pi**2 for p in (50, 100, 200)]
    assert energies[0] > energies[1] > energies[2]
    assert energies[1] == pytest.approx(5.93, rel=3e-3)
    assert energies[2] == pytest.approx(5.93, rel=1e-3)


def test_poisson_does_not_matter_without_natural_curvature():
    assert band(0.05, 48, 0.0).energy.total == pytest.approx(band(0.05, 48, 0.4).energy.total, rel=1e-9)


@pytest.mark.parametrize(("width", "energy"), [(0.01, 5.8518), (0.1, 6.2121), (0.4, 10.961)])
def test_tolerance_resolves_the_event_without_placed_segments(width, energy):
    e = solve_to_tolerance(Strip(1, width, 0.5), closure=Closure("moebius"), tolerance=1e-4)
    assert e.ok, e.message
    assert e.energy.total / np.pi**2 == pytest.approx(energy, rel=5e-4)
    assert e.max_abs_eta_prime_w_half > 0.98
    assert e.problem.lengths.size < 400  # as many on both sides of the event, about whose middle they are mirror images


@pytest.mark.parametrize("width", [0.011274653, 0.0226])
def test_nothing_pushes_a_free_band_along_itself(width):
    """Sliding changes no energy: segments placed by a tolerance hold the band with no force, others say so.

    The balance is the judge's, which knows of no seam; at w/l = 0.01127 the state with the seam held, on which segments
    are placed, is no mirror image of itself.
    """
    equilibrium = solve_to_tolerance(Strip(1, width, 0.38), closure=Closure("moebius"), tolerance=1e-3)
    assert equilibrium.ok
    assert "push" not in equilibrium.message
    (balance,) = [check for check in judged(equilibrium, spectrum=False) if check.what.startswith("not in balance")]
    assert balance.value < 0.2 * balance.bound
    lengths = equilibrium.problem.lengths[1:] / equilibrium.problem.lengths[1:].sum()
    uneven = solve(Strip(1, width, 0.38), closure=Closure("moebius"), segments=lengths)
    assert uneven.ok
    assert "push it along itself" in uneven.message


def test_the_seam_slides():
    """A band cut where eta vanishes away from the event is the same band, its seam elsewhere (figures 6.2, 6.3)."""
    pinned = moebius.straight(0.05, 160)
    zero = moebius.other_zero(pinned) - 0.5 / 160  # the middle of the first element is put there
    assert 0.2 < zero < 0.45
    moved = moebius.shifted(pinned, zero)
    assert moved.ok
    assert abs(moved.omega([0.0])[0]) > 5.0, "the event is not at the seam"
    steepest = int(np.argmax(np.abs(moved.parameters[:, 2])))
    assert (steepest + 0.5) / 160 == pytest.approx(1.0 - zero, abs=0.02)
    assert moved.energy.total == pytest.approx(pinned.energy.total, rel=2e-3)
    s = np.linspace(0.0, 1.0, 801)
    sign, back = np.where(s < zero, -1.0, 1.0), (s - zero) % 1.0
    away = (s > 0.1) & (s < 0.9)
    bend = sign * moved.omega(back)
    bend *= np.sign(bend[400] * pinned.omega([0.5])[0])
    assert np.abs(bend - pinned.omega(s))[away].max() < 0.1


def test_forces_from_multipliers_are_the_slopes_of_the_energy():
    e = run_way(load("moebius_6_1_clamped").replace({"model.elements": 50})).equilibrium
    force, moment = moebius.extrapolated(e)
    support = e.end_support
    assert support is not None
    assert np.abs(force - support.force).max() < 1e-6 * np.linalg.norm(support.force)
    assert np.abs(moment - support.moment).max() < 1e-6 * np.linalg.norm(support.moment)


def test_the_event_does_not_follow_one_linear_law():
    """Figure 6.6: inside the event lengths scale with w; the curve's turning point does not."""
    narrow, wide = (wunderlich_event.edges(wunderlich_event.band(w)) for w in (0.005, 0.03))
    for name, size in (("peak", 0.49), ("0.9", 0.21), ("0.5", 0.42), ("0.1", 0.82)):
        assert narrow[name] / 0.005 == pytest.approx(size, rel=0.06)
        assert wide[name] / 0.03 == pytest.approx(size, rel=0.06)
    assert narrow["cusp"] / 0.005 == pytest.approx(1.49, abs=0.02)
    assert wide["cusp"] / 0.03 == pytest.approx(0.92, abs=0.02)


def test_the_event_s_edges_on_a_curve_that_is_known():
    """`law` recovers a power law and a linear one."""
    widths = np.array([0.01, 0.02, 0.05])
    linear, power, misfit = wunderlich_event.law(widths, 0.79 * widths)
    assert (linear, power, misfit) == pytest.approx((0.79, 1.0, 0.0), abs=1e-12)
    assert wunderlich_event.law(widths, np.sqrt(widths))[1] == pytest.approx(0.5)


def test_a_band_that_nothing_holds_says_that_its_start_chooses_its_state():
    """Turned with its table, the band begins as before and ends otherwise: it lies as it fell, not on edge."""
    from ribbon import Clamp, Closure, Gravity, Strip, Wall, solve
    from ribbon.notes import Note

    strip, low = Strip(1.0, 0.1, 0.5, gamma=10.0), -0.2
    energies = []
    for up in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        table = Wall(tuple(low * x for x in up), up)
        found = solve(strip, gravity=Gravity(up), closure=Closure("moebius"), walls=[table], segments=20)
        if found.ok:
            assert found.notes[-1] is Note.FREE_BAND
            assert found.message.endswith(Note.FREE_BAND.text())
            energies.append(found.energy.total - strip.gamma * low)
    assert energies
    held = solve(strip, Clamp(), Gravity((0.0, 1.0, 0.0)), closure=Closure("moebius"), segments=20)
    assert held.ok
    assert Note.FREE_BAND not in held.notes
    assert "nothing holds the band" not in held.message
