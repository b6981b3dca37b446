"""Power series: error against multiple precision and time, with our limit on the exponent and with the thesis's."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from ribbon.element import series
from tests.reference.ribbon_energy import frame_and_chord
from tests.validation import page
from tests.validation.number import Number, rounding

CASES = {
    "circle, K = 10": (0, 10, 0, 0, 1),
    "circle, K = 100": (0, 100, 0, 0, 1),
    "circle, K = 1000": (0, 1000, 0, 0, 1),
    "helix, K = 1000, eta = 0.3": (0, 1000, 0, 0.3, 1),
    "K from 1000 to -1000, oblique": (-2000, 1000, 0.5, 0.2, 1),
    "K from -250 to 250, eta from -1 to 1": (500, -250, 2, -1, 1),
    "K from 100 to 1000, eta from 0.8 to -0.7": (900, 100, -1.5, 0.8, 1),
    "one of 20 segments of a coil, K = 40": (40, 40, 5, -0.5, 0.05),
}
LIMITS = {"ours": series.EXPONENT_LIMIT, "thesis": series.EXPONENT_LIMIT_THESIS}
PROMISED = 1e-12


def _time(parameters: tuple[float, ...], limit: float) -> float:
    """Best of repeated evaluations of the jets (s)."""
    jets = np.empty((15, 15))
    count = 3 if abs(parameters[1]) >= 100 else 200
    best = np.inf
    for _ in range(5):
        clock = time.perf_counter()
        for _ in range(count):
            series.segment_jets(*parameters, limit, jets)
        best = min(best, (time.perf_counter() - clock) / count)
    return best


def errors(name: str, limit: float) -> tuple[int, tuple[float, float, float]]:
    """Parts of a case's segment, and its largest errors: frame, position, orthonormality."""
    case = CASES[name]
    exact = [np.array(m.tolist(), dtype=float) for m in frame_and_chord(*case, digits=30)]
    q, p, j = np.empty((3, 3)), np.empty(3), np.empty(3)
    count = series.segment_values(*(float(v) for v in case), limit, q, p, j)
    frame, place = np.abs(q - exact[0]).max(), np.abs(p - exact[1][:, 0]).max()
    return count, (float(frame), float(place), float(np.abs(q.T @ q - np.eye(3)).max()))


PROBES = {
    "circle_1000": lambda: max(errors("circle, K = 1000", LIMITS["ours"])[1]),
    "parts_of_circle_1000": lambda: errors("circle, K = 1000", LIMITS["ours"])[0],
}


def run(out: Path) -> dict[str, Number]:
    rows = []
    worst, ours = 0.0, {}
    for name, case in CASES.items():
        parameters = tuple(float(v) for v in case)
        cells = [name]
        times = {}
        for label, limit in LIMITS.items():
            count, found = errors(name, limit)
            times[label] = _time(parameters, limit)
            cells += [str(count), *(f"{error:.0e}" for error in found)]
            if label == "ours":
                worst, ours[name] = max(worst, *found), (count, max(found))
        cells.append(f"{times['ours'] / times['thesis']:.2f}")
        rows.append(cells)
    heads = ["segment of length L = 1 (last: 0.05)"]
    for label, limit in LIMITS.items():
        heads += [f"parts, C <= {limit:.3g} ({label})", "frame", "position", "orthonormal"]
    heads.append("time of the jets, ours / thesis")
    text = (
        "Largest error of an entry against the same equations in 40 digits (mpmath). Worst with our limit: "
        f"{worst:.1e}; promised: {PROMISED:.0e} for |K| <= 1000 on a unit segment. The thesis's limit (3.3) is to "
        "keep half the digits; the last column is what the others cost."
    )
    page.write(out / "series.md", "Power series of a segment", "python -m tests.validation series",
               text, page.table(heads, rows))  # fmt: skip
    if not worst < PROMISED:
        raise AssertionError(f"the series' error {worst:.1e} is above {PROMISED:.0e}")
    parts, circle = ours["circle, K = 1000"]
    return {
        "worst": rounding(worst, shown=".1e"),
        "circle_1000": rounding(circle, shown=".1e"),
        "parts_of_circle_1000": Number(parts, 0, shown="d"),
    }
