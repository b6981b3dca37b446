"""The transverse shear factor k: a soft cantilever's deflection, and the torsion that free edges take off."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellInputError, ShellProblem, ShellStatus
from shellref.shell.clamps import rotation
from shellref.shell.material import SHEAR_FACTOR, stiffness_factors

FRAME = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))  # t_x = -e_z, t_y = e_y, t_z = e_x
STRIP = ShellProblem(width=0.2, thickness=0.02, poisson=0.0, clamp_frame=FRAME, elements=(20, 2))
LITTLE, ANGLE = 1e-3, 1e-3


def solved(problem):
    pytest.importorskip("dolfinx")
    from shellref.path.solve import solve

    found = solve(problem)
    assert found.status is ShellStatus.CONVERGED
    return found


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), "stiff"])
def test_a_factor_is_positive(factor):
    with pytest.raises(ShellInputError) as caught:
        replace(STRIP, shear_factor=factor)
    assert caught.value.key == "shear_factor"


def test_reissner_s_is_the_default():
    assert STRIP.shear_factor == SHEAR_FACTOR == 5.0 / 6.0
    assert stiffness_factors(0.02) == stiffness_factors(0.02, STRIP.shear_factor)


@pytest.mark.shell
@pytest.mark.parametrize("factor", [SHEAR_FACTOR, 1e-3 * SHEAR_FACTOR])
def test_a_soft_cantilever_is_timoshenko_s(factor):
    """F l^3 / 3 + F h^2 l / (6 k) per width, D = 1, nu = 0 (S. P. Timoshenko 1921)."""
    found = solved(replace(STRIP, tip=(0.0, -LITTLE, 0.0), shear_factor=factor))
    expected = LITTLE * (1.0 / 3.0 + STRIP.thickness**2 / (6.0 * factor))
    assert -found.section(1.0)["position"][1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.shell
def test_free_edges_take_torsion_off_by_their_layers():
    """Moments of twisted strips as 1 - tanh(a) / a, a = sqrt(12 k) w / (2 h) (docs/theory.md, eq. (10.7))."""
    turned = tuple(map(tuple, (rotation(np.array([ANGLE, 0.0, 0.0])) @ np.array(FRAME)).tolist()))
    held = {"guided": True, "end": Pose((0.0, 0.0, 0.0), turned)}
    wide = replace(STRIP, width=0.05, thickness=0.01, elements=(20, 8), grading=(1.0, 0.2), **held)

    def moment(factor):
        return solved(replace(wide, shear_factor=factor)).clamps["end"]["moment"][0]

    def left(factor):
        a = np.sqrt(12.0 * factor) * wide.width / (2.0 * wide.thickness)
        return 1.0 - np.tanh(a) / a

    stiff, soft = 30.0 * SHEAR_FACTOR, SHEAR_FACTOR / 4.0
    measured, known = moment(soft) / moment(stiff), left(soft) / left(stiff)
    assert known < 0.8
    assert measured == pytest.approx(known, rel=0.02)
