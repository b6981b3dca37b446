"""Folds and branch points over two numbers in one run each (`compare.studies.branches.over`): figure 7.3 of the thesis
for the models that have it as a branch point and for the one that falls by its rulings, against quotients to second
order that share nothing with `ribbon`; and the cusp of a curled mast against Greenhill's weight."""

from __future__ import annotations

import functools
from pathlib import Path

from scipy.optimize import brentq
from scipy.special import jv

from compare.battery.cases.branches.scenes import mast
from compare.pages.pictures.curves import curves_picture
from compare.scene.scene import Scene, load, loads
from compare.studies.branches.over import Curves, curves
from compare.studies.branches.run import Asked
from tests.validation import page
from tests.validation.number import Number
from tests.validation.workbench import on_edge_linear as linear

WIDTHS = (0.02, 0.05, 0.1)
SPAN = (5.0, 30.0)
CURLS, WEIGHTS = (-1.5, 1.5), (6.0, 8.0, 10.0, 12.0, 14.0)
#: Cells of the quotients, for the search over rulings and where the twist is free.
CELLS, FINE = 60, 400
#: Promised: nearer than this, relative, to the quotient; the fall by rulings from above.
NEAR, ABOVE = 2e-4, 0.01
MAST = mast("A mast that curls", 0.3, 2.0, "elastica", 8)


def edge(ruling: str) -> Scene:
    """The strip on edge of `lateral_7_1`, light, without the path that rolls it."""
    return load("lateral_7_1").replace({"path": None, "strip.gamma": SPAN[0], "clamp.start.ruling": ruling})


@functools.cache
def on_edge(energy: str, ruling: str, widths: tuple[float, ...] = WIDTHS) -> Curves:
    """Critical weights over the width."""
    scene = edge(ruling)
    return curves(scene, "strip.gamma", *SPAN, "strip.width", widths, (energy,), Asked(branches=1))


def exact(energy: str, ruling: str, width: float) -> float:
    """Of the straight strip to second order."""
    scene = edge(ruling)
    nu, thickness = scene.strip.poisson, scene.strip.thickness
    assert thickness is not None
    if energy == "wunderlich":
        return linear.developable(width, True, ruling == "straight", CELLS).gamma
    a = 10.0**0.5 * width / (2.0 * thickness)
    twist = 2.0 * (1.0 - nu) * (1.0 if energy == "sano" else 1.0 - 1.0 / a)  # tanh(a) is 1 to rounding
    if energy == "sano":
        return linear.smooth(1.0 - nu**2, twist, count=FINE)
    return linear.smooth(
        1.0 - nu**2, twist, warping=width**2 / 12.0, held=ruling == "straight", first=0.01, count=FINE
    )  # fmt: skip


@functools.cache
def mast(weights: tuple[float, ...] = WEIGHTS, models: tuple[str, ...] = ("elastica", "wunderlich")) -> Curves:
    """The heavy mast over its curl."""
    return curves(loads(MAST), "strip.natural_curvature", *CURLS, "strip.gamma", weights, models)


def greenhill() -> float:
    """Gamma at which a straight mast falls over."""
    return float(brentq(lambda gamma: jv(-1.0 / 3.0, 2.0 / 3.0 * gamma**0.5), 6.0, 9.0))


CASES = (
    ("sano", "free"),
    ("finite", "free"),
    ("finite", "straight"),
    ("wunderlich", "free"),
    ("wunderlich", "straight"),
)
PROBES = {
    "finite_straight_0_1": lambda: on_edge("finite", "straight", (0.09, 0.1)).curves[0].marks[-1].value,
    "fold_10": lambda: mast((10.0, 10.1), ("elastica",)).curves[1].marks[0].value,
}


def run(out: Path) -> dict[str, Number]:
    """Writes special_curves.md, special_curves_edge.png and special_curves_mast.png into the folder."""
    rows, numbers = [], {}
    for energy, ruling in CASES:
        found = on_edge(energy, ruling)
        (curve,) = found.curves
        for mark in curve.marks:
            known = exact(energy, ruling, mark.other)
            apart = mark.value / known - 1.0
            low, high = (-NEAR, ABOVE) if curve.kind == "ruling" else (-NEAR, NEAR)
            if not low <= apart <= high:
                raise AssertionError(f"{energy}, {ruling}, w/l = {mark.other:g}: {mark.value:g}, quotient {known:g}")
            error = "at the latest" if mark.error is None else f"{mark.error:.0e}"
            kind = "branch point" if curve.kind == "branch_point" else "fall by rulings"
            width, value = f"{mark.other:g}", f"{mark.value:.4f}"
            rows.append((energy, ruling, width, kind, value, error, f"{known:.4f}", f"{apart:.0e}"))
            name = f"{energy}_{ruling}_{mark.other:g}".replace(".", "_")
            why = "an upper bound: the worst rulings are searched for"
            numbers[name] = Number(mark.value, mark.error, "", ".3f", "" if mark.error is not None else why)
            numbers[f"apart_{name}"] = Number(100.0 * apart, 0.01, "%", ".2f")
    curled = mast()
    curves_picture(out / "special_curves_mast.png", curled)
    curves_picture(out / "special_curves_edge.png", on_edge("finite", "straight"))
    folds = {c.model: c for c in curled.curves if c.marks[-1].value > 0.0}
    table = []
    for one, other in zip(folds["elastica"].marks, folds["wunderlich"].marks, strict=True):
        apart = abs(one.value - other.value)
        assert one.error is not None
        assert other.error is not None
        errors = f"{one.error:.0e}", f"{other.error:.0e}"
        values = f"{one.value:.7f}", f"{other.value:.7f}"
        table.append((f"{one.other:g}", values[0], errors[0], values[1], errors[1], f"{apart:.0e}"))
        if one.other in WEIGHTS:
            numbers[f"fold_{one.other:g}"] = Number(one.value, max(one.error, 1e-9), "1/l", ".5f")
    by = greenhill()
    for met in curled.meetings:
        if met.at is None or abs(met.at - by) > 1e-3 or not met.between[0] < by < met.between[1]:
            raise AssertionError(f"{met.model}: the folds meet at {met.at}, {met.between}; Greenhill {by:g}")
        numbers[f"cusp_{met.model}"] = Number(met.at, met.between[1] - met.between[0], "", ".4f")
    numbers["greenhill"] = Number(by, 1e-9, "", ".4f")
    page.write(
        out / "special_curves.md",
        "Folds and branch points over two numbers",
        "python -m tests.validation special_curves",
        "Each table is one run of `ribbonbench branches --over` (per model); +-: by elements halved twice.",
        "## The critical weight of a strip on edge over its width (thesis, figure 7.3)",
        f"`lateral_7_1` without its path, nu = {edge('free').strip.poisson:g}, h = 1e-3. *quotient*: the straight "
        "strip to second order, without elements (`on_edge_linear`); of a developable strip least over all rulings "
        f"that do not cross, on {CELLS} cells. In the unknowns of a developable strip no eigenvalue vanishes there: "
        "straight, its rulings move nothing, and it is unstable as soon as it is with any of them. The worst are "
        "searched for, so that its weight is an upper bound; where the clamp holds the ruling straight the search is "
        "further from the quotient.",
        page.table(("model", "ruling at the clamp", "w/l", "what", "Gamma", "+-", "quotient", "apart"), rows),
        "![Critical weights of the strip of finite thickness](special_curves_edge.png)",
        "## A mast that curls, and where it snaps over",
        "The upright strip is heavy and curls the other way than it leans: over its curl it snaps at a fold, one for "
        "each side. The two folds meet in a cusp, the pitchfork of the straight mast.",
        page.table(("Gamma", "elastica", "+-", "wunderlich", "+-", "apart"), table),
        "The cusp: "
        + ", ".join(
            f"{met.model} {met.at:.4f} (between {met.between[0]:g} and {met.between[1]:g})" for met in curled.meetings
        )
        + f"; Greenhill (1881), by a zero of a Bessel function: {by:.4f}.",
        "![Folds of the mast over its weight](special_curves_mast.png)",
    )
    return numbers
