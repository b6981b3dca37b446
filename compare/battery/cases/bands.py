"""Shells that nothing holds: bands joined after half turns, strips on a table; judged by virtual work and balance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from compare.battery import thin
from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.cases.shell import complementary, solved

#: By how much the thickness is changed for a difference of energies, as a part.
STEP = 0.02
#: Half turns beyond which no band that may pass through itself is stable.
STABLE = 3


def _band(half_turns: int, ratio: float, width: float) -> Any:
    """A free band of w / l = width and w/h = ratio, its ends joined after half turns, by the shell's own path."""
    from ribbonbench.errors import Missing

    try:
        from shellref.fenics import dolfinx_api
        from shellref.path.begin import begun
        from shellref.shell.options import ShellOptions
        from shellref.shell.problem import ShellProblem

        dolfinx_api.communicator("self")
    except ImportError as missing:
        raise Missing(str(missing), "apt install python3-dolfinx") from None
    problem = ShellProblem(
        width, width / ratio, 0.3, clamp="free", half_turns=half_turns, start_curvature=-2.0 * math.pi,
        elements=(100, 6), grading=(1.0, 0.3),
    )  # fmt: skip
    return begun(problem, ShellOptions(), lambda event: None).result


def _joined(half_turns: int, ratio: float, width: float = 0.05) -> Iterator[Check]:
    """In units of D the strains across and along the surface weigh 1 / h^2, the curvatures nothing: along equilibria
    h dE/dh = -2 (membrane + shear), whatever the shape does."""
    less, at, more = (_band(half_turns, ratio * factor, width) for factor in (1.0 + STEP, 1.0, 1.0 / (1.0 + STEP)))
    if half_turns > STABLE:
        counted = at.stable is False and at.negative_eigenvalues > 0
        yield holds("unstable, which is said and counted", at.status.value == "unstable" and counted, at.message)
    else:
        yield holds("status converged", at.status.value == "converged", at.message)
    surface, energy = at.surface, at.energy
    yield holds("no NaN in the surface", bool(np.all(np.isfinite(surface.points))))
    across = np.linspace(-0.5, 0.5, 9) * width
    ends = surface.grid(np.array([0.0, 1.0]), across)
    flipped = ends[1, ::-1] if half_turns % 2 else ends[1]
    yield Check("gap of the seam (l)", float(np.abs(ends[0] - flipped).max()), 1e-10)
    turned = abs(thin.half_turns(surface, width, half_turns % 2 == 1))
    yield near("half turns, by linking", turned, float(half_turns), 1e-6)
    own = thin.bending(surface, 0.3, (0.0, 0.0))
    yield near("bending energy from surface and directors", own / energy["bending"], 1.0, 0.02)
    slope = (more.energy["elastic"] - less.energy["elastic"]) / (2.0 * math.log(1.0 + STEP))
    expected = -2.0 * (energy["membrane"] + energy["shear"])
    size = energy["elastic"]
    yield near("h dE / dh against -2 (membrane + shear), over E", slope / size, expected / size, 2e-3)
    if half_turns == 0:
        yield holds("above the circle without width", size > 2.0 * math.pi**2 * (1.0 - 0.3**2), f"{size:.6g}")


def _turned(rung: Rung) -> Iterator[Check]:
    return _joined(int(rung), 25.0)


def _thinner(rung: Rung) -> Iterator[Check]:
    return _joined(1, 1.0 / float(rung))


def _laid(rung: Rung) -> Iterator[Check]:
    """A curled strip that nothing holds, on a table: it carries the weight, and dE / dGamma is the height."""
    from shellref.contact.walls import Wall

    curl = float(rung)

    def lies(gamma: float) -> Any:
        return solved(
            gamma=gamma, up=(0.0, 1.0, 0.0), poisson=0.3, clamp="free", walls=(Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),),
            natural_curvature=(curl, curl), elements=(40, 2),
        )  # fmt: skip

    gamma, change = 20.0, 0.2
    below, at, above = (lies(gamma + x) for x in (-change, 0.0, change))
    yield from complementary(at)
    (wall,) = at.walls
    yield near("the table's force over the weight", float(wall["force"][1]) / gamma, 1.0, 1e-8)
    centre = thin.centre(at.surface)
    moment = wall["moment"] + np.cross(centre, [0.0, -gamma, 0.0])
    yield Check("moments left over (of the weight's)", float(np.abs(moment).max()) / gamma, 1e-6)
    slope = (above.energy["total"] - below.energy["total"]) / (2.0 * change)
    yield near("dE / dGamma against the height of the centre (l)", slope, float(centre[1]), 2e-4)
    yield holds("stable, and lies on the table", at.stable is True and len(wall["points"]) > 0, at.message)


CASES = (
    Case(
        "bands/half turns", "free bands joined after half turns, by the shell's own path",
        "the seam is closed, turned as asked; bending energy of the surface; h dE / dh is -2 (membrane + shear)",
        "half turns", _turned, (1,), (0, 2, 3, 4, 5, 6),
    ),
    Case(
        "bands/thin", "Moebius bands from thick to thin", "the same", "h / w", _thinner, (), (0.1, 0.02, 5e-3),
    ),
    Case(
        "bands/on a table", "a curled strip that nothing holds, on a table",
        "the table carries the weight; no node behind it, no pull; dE / dGamma is the height of the centre",
        "K l", _laid, (1.0,), (0.0, 0.3, 3.0, 10.0),
        known=dict.fromkeys((3.0, 10.0), "a curl that stands on a corner falls over too far in one step: no state is "
                            "found at some weights, which is said"),
    ),
)  # fmt: skip
