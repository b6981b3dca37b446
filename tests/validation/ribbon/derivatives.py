"""Gradient and Hessian of the whole energy against multiple precision, on random states; H, H', H''."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ribbon.energies import wunderlich
from tests.reference import ribbon_energy
from tests.ribbon.energies.test_energies import POINTS, exact_width_factor
from tests.ribbon.problems.test_chained import problem, state, twin
from tests.validation import page

PROMISED = 1e-9


def run(out: Path) -> None:
    rows = []
    worst = 0.0
    for energy in ("sadowsky", "wunderlich"):
        for kind in ("generic", "near the bound", "near zero"):
            pr = problem(energy)
            errors = np.zeros(2)
            for seed in (11, 12, 13):
                x = state(kind, seed)
                gradient, hessian = (np.array(v) for v in ribbon_energy.derivatives(twin(pr), x.tolist()))
                errors[0] = max(errors[0], np.abs(pr.gradient(x) - gradient).max() / np.abs(gradient).max())
                errors[1] = max(errors[1], np.abs(pr.hessian(x) - hessian).max() / np.abs(hessian).max())
            rows.append([energy, kind, f"{errors[0]:.0e}", f"{errors[1]:.0e}"])
            worst = max(worst, errors.max())
    factor = np.zeros(3)
    for x in POINTS:
        for k, (got, exact) in enumerate(zip(wunderlich.width_factor(float(x)), exact_width_factor(x), strict=True)):
            if exact != 0:
                factor[k] = max(factor[k], abs(float((got - exact) / exact)))
    page.write(
        out / "derivatives.md", "Derivatives of the ribbon's energy", "python -m tests.validation derivatives",
        "Largest error over the largest entry, three random states each, four unequal segments, gravity and a linear "
        "natural curvature on; reference: central differences in 40 digits of a twin written from the equations.",
        page.table(["energy", "eta'", "gradient", "Hessian"], rows),
        f"H, H', H'' of Wunderlich's energy on {len(POINTS)} points of (-1, 1), up to the neighbours of +-1: relative "
        f"errors {factor[0]:.0e}, {factor[1]:.0e}, {factor[2]:.0e} (promised 1e-13, 1e-12, 1e-11).",
    )  # fmt: skip
    if not (worst < PROMISED and factor[0] < 1e-13 and factor[1] < 1e-12 and factor[2] < 1e-11):
        raise AssertionError(f"derivatives: {worst:.1e}, width factor {factor}")
