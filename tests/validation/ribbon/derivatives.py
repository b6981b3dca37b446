"""Gradient and Hessian of the whole energy against multiple precision, on random states; H, H', H''."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ribbon.energies import wunderlich
from tests.reference import ribbon_energy
from tests.ribbon.energies.test_energies import POINTS, exact_width_factor
from tests.ribbon.problems.test_chained import problem, state, twin
from tests.validation import page
from tests.validation.number import Number, rounding

#: It takes no times that its page rests on.
ALONE = False

PROMISED = 1e-9
SEEDS = (11, 12, 13)


def errors(energy: str, kind: str) -> Iterator[tuple[float, float]]:
    """Errors of gradient and Hessian on the random states of a kind, over the largest entry, state by state."""
    pr = problem(energy)
    for seed in SEEDS:
        x = state(kind, seed)
        gradient, hessian = (np.array(v) for v in ribbon_energy.derivatives(twin(pr), x.tolist()))
        yield (
            float(np.abs(pr.gradient(x) - gradient).max() / np.abs(gradient).max()),
            float(np.abs(pr.hessian(x) - hessian).max() / np.abs(hessian).max()),
        )


def factor_errors() -> np.ndarray:
    """Largest relative errors of H, H', H'' (3,) on `POINTS`."""
    factor = np.zeros(3)
    for x in POINTS:
        for k, (got, exact) in enumerate(zip(wunderlich.width_factor(float(x)), exact_width_factor(x), strict=True)):
            if exact != 0:
                factor[k] = max(factor[k], abs(float((got - exact) / exact)))
    return factor


@functools.cache
def nearest() -> tuple[float, float]:
    """Errors of the first of the states near the bound, which are the largest."""
    return next(errors("wunderlich", "near the bound"))


PROBES = {
    "gradient_near_the_bound": lambda: nearest()[0],
    "hessian_near_the_bound": lambda: nearest()[1],
    "second_derivative_of_h": lambda: float(factor_errors()[2]),
}


def run(out: Path) -> dict[str, Number]:
    rows = []
    worst = np.zeros(2)
    for energy in ("sadowsky", "wunderlich"):
        for kind in ("generic", "near the bound", "near zero"):
            found = np.max(list(errors(energy, kind)), axis=0)
            rows.append([energy, kind, f"{found[0]:.0e}", f"{found[1]:.0e}"])
            worst = np.maximum(worst, found)
    factor = factor_errors()
    page.write(
        out / "derivatives.md", "Derivatives of the ribbon's energy", "python -m tests.validation derivatives",
        "Largest error over the largest entry, three random states each, four unequal segments, gravity and a linear "
        "natural curvature on; reference: central differences in 40 digits of a twin written from the equations.",
        page.table(["energy", "eta'", "gradient", "Hessian"], rows),
        f"H, H', H'' of Wunderlich's energy on {len(POINTS)} points of (-1, 1), up to the neighbours of +-1: relative "
        f"errors {factor[0]:.0e}, {factor[1]:.0e}, {factor[2]:.0e} (promised 1e-13, 1e-12, 1e-11).",
    )  # fmt: skip
    if not (worst.max() < PROMISED and factor[0] < 1e-13 and factor[1] < 1e-12 and factor[2] < 1e-11):
        raise AssertionError(f"derivatives: {worst}, width factor {factor}")
    names = (
        "gradient", "hessian", "h", "first_derivative_of_h", "second_derivative_of_h",
        "gradient_near_the_bound", "hessian_near_the_bound",
    )  # fmt: skip
    values = zip(names, (*worst, *factor, *nearest()), strict=True)
    return {name: rounding(value) for name, value in values}
