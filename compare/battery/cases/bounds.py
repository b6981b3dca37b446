"""Rulings that nearly cross, events, the widest bands."""

from __future__ import annotations

from collections.abc import Iterator

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.judge.ribbon import judged
from ribbon import Clamp, Closure, Strip, solve

BUDGET = 60.0


def _band(rung: Rung) -> Iterator[Check]:
    width = float(rung)
    found = solve(Strip(1.0, width), closure=Closure("moebius", "straight"), segments=60, budget=BUDGET)
    yield holds("converged", found.status.code == "converged", f"{found.status.code}: {found.message}")
    yield from judged(found, spectrum=False)
    yield Check("|eta'| w / 2 over 1", found.max_abs_eta_prime_w_half - 1.0, 0.0)
    yield Check("rulings that stay apart, 1 - |eta'| w / 2", 1.0 - found.max_abs_eta_prime_w_half, 0.05)


def _event(rung: Rung) -> Iterator[Check]:
    """A strip whose end is turned by half a turn about its tangent, its ends ever nearer: an event where it is."""
    turned = Clamp((0.0, 0.0, 1.0 - float(rung)), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    found = solve(Strip(1.0, 0.1), Clamp(), end=turned, segments=60, leave_saddle=True, budget=BUDGET)
    code = found.status.code
    yield holds("an equilibrium", code in ("converged", "saddle"), f"{code}: {found.message}")
    yield from judged(found, spectrum=False)
    yield Check("|eta'| w / 2 over 1", found.max_abs_eta_prime_w_half - 1.0, 0.0)


_NARROW = "residual 1.5e-8 to 4e-8 (tolerance 1e-8) where 1 - |eta'| w / 2 falls below 4e-8"

CASES: tuple[Case, ...] = (
    Case(
        "bounds/widest_moebius",
        "a Moebius band (60 segments) ever wider: rulings come within 1e-8 of crossing, the energy grows without bound "
        "as w / l tends to 1 / sqrt(3) = 0.5774 (Schwartz 2023)",
        "a stable band whose rulings do not cross",
        "w / l",
        _band,
        (0.1, 0.4),
        (0.2, 0.3, 0.45, 0.5, 0.52, 0.53, 0.55),
        {
            0.52: "its forces balance to 2e-7 of the largest only, as the judge finds them",
            0.53: "its forces balance to 7e-7 of the largest only, as the judge finds them",
            0.55: "wider than the elements reach: " + _NARROW,
        },
    ),
    Case(
        "bounds/turned_end",
        "a strip whose far end is turned by half a turn: an event in its middle, or at the clamps",
        "an equilibrium whose rulings do not cross",
        "shortening / l",
        _event,
        (0.4,),
        (0.6, 0.3, 0.2, 0.1),
    ),
)
