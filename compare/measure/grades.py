"""Good, fair, poor: the one table of what a number must be for each grade."""

from __future__ import annotations

#: From best to worst; the last one: not known.
GRADES = ("good", "fair", "poor", "unknown")
GOOD, FAIR, POOR, UNKNOWN = GRADES
#: The thesis calls two shapes the same to the eye when their Hausdorff distance is below 1 permille of the length.
YARDSTICK = 1e-3
#: Up to which a number is good. error: of a discretisation, Hausdorff over l; distance: between two models, the same;
#: share: of stretching in the elastic energy (the thesis calls a scene safe when it is well under 1 %); force: error of
#: a force or moment over the largest of its kind.
GOOD_UP_TO = {"error": YARDSTICK, "distance": 0.01, "share": 0.01, "force": 0.01}
#: Times that up to which it is fair.
FAIR_FACTOR = 5.0


def graded(value: float | None, most: float) -> str:
    """The grade of a number that is good up to `most`."""
    if value is None or not value >= 0.0:  # NaN too
        return UNKNOWN
    return GOOD if value <= most else FAIR if value <= FAIR_FACTOR * most else POOR


def resolved(value: float | None, error: float | None, most: float) -> str:
    """The grade of a number that stands with its error: of the number where it is above the error; else "good" where
    both together are, and not known. Without an error it is not known."""
    if value is None or error is None or value > error:
        return UNKNOWN if error is None else graded(value, most)
    return GOOD if graded(value + error, most) == GOOD else UNKNOWN


def grade(kind: str, value: float | None) -> str:
    """The grade of a number of one of the kinds of `GOOD_UP_TO`; "unknown" for None."""
    return graded(value, GOOD_UP_TO[kind])


def worst(*grades: str) -> str:
    """The worst of several grades; what is not known counts as worse than good and fair, and better than poor."""
    order = (GOOD, FAIR, UNKNOWN, POOR)
    return max(grades, key=order.index, default=UNKNOWN)
