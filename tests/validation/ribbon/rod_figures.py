"""Antman's rod beside Kirchhoff's and the ribbon (thesis, figures 4.4 to 4.6; JFIG 2019, figures 5 and 9), its thin
limit, and what its accuracy costs."""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from compare.models import solve as solve_scene
from compare.models.antman.problem import problem_of
from compare.models.base import Options, Shape, Size, State
from compare.scene.scene import load
from tests.shellref.rod.shooting import shot
from tests.validation import page
from tests.validation.number import Number

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FloatArray = NDArray[np.float64]
#: Figure 4.5: weights, and the models that the thesis draws.
GAMMAS = (0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100)
MODELS = ("antman", "kirchhoff", "sadowsky")
SHOWN = 80
#: sqrt(y^2 + z^2) of the tip: a prototype of Kirchhoff's rod (boundary value problem), and Sadowsky's ribbon.
PROTOTYPE = {20: (0.16360, 0.16012), 60: (0.20285, 0.19672), 100: (0.21369, 0.21351)}
#: By how much the two rods may be apart there: shear, stretch and the elements of both.
COINCIDE = 5e-5
#: Thin limit: w / l at h / w = 1 / 10.
WIDTHS = (1 / 15, 1 / 30, 1 / 60, 1 / 120)
#: Figure 4.4 and JFIG's figures 5 (50 cm) and 9: lengths in m of a curl 1 cm wide and 0.1 mm thick.
LENGTHS = (0.15, 0.25, 0.35, 0.40, 0.50)
#: Work and error: elements by degree.
SIZES = {1: (10, 20, 40, 80), 2: (5, 10, 20, 40), 3: (4, 8, 16)}
S = np.linspace(0.0, 1.0, 401)
#: What shooting with a tolerance of 1e-11 leaves of a tip (l).
SHOT = 1e-10


def solved(name: str, changes: dict[str, Any], near: Shape | None = None, size: Size | None = None) -> State:
    """A state that has to be a stable equilibrium."""
    found = solve_scene(load(name).replace(changes), near=near, size=size, options=Options(repeats=0))
    if not found.ok:
        raise AssertionError(f"{name}, {changes}: {found.message}")
    return found


def aside(state: State) -> float:
    """sqrt(y^2 + z^2) of the tip."""
    assert state.end is not None
    return float(np.hypot(*state.end.position[1:]))


def apart(one: State, other: State, s: FloatArray = S) -> float:
    """Largest distance in l of points of equal arc length."""
    assert one.shape is not None
    assert other.shape is not None
    return float(np.linalg.norm(one.shape.centreline(s) - other.shape.centreline(s), axis=1).max())


def tip_of(name: str, gamma: int, elements: int = 40) -> float:
    """`aside` of one of the models of figure 4.5."""
    return aside(solved("rod_4_5", {"strip.gamma": float(gamma), "model.energy": name, "model.elements": elements}))


PROBES = {
    "antman_20": lambda: tip_of("antman", 20),
    "antman_100": lambda: tip_of("antman", 100),
    "kirchhoff_60": lambda: tip_of("kirchhoff", 60),
    "sadowsky_60": lambda: tip_of("sadowsky", 60),
}


def _tips(found: dict[tuple[int, str], State]) -> dict[str, Number]:
    """Those beside the prototype, each with its change on twice the elements."""
    numbers = {}
    for gamma in PROTOTYPE:
        for name in MODELS:
            tip = aside(found[gamma, name])
            numbers[f"{name}_{gamma}"] = Number(tip, abs(tip_of(name, gamma, 80) - tip), "l", ".5f")
    return numbers


def figure_4_5() -> tuple[dict[tuple[int, str], State], str]:
    """All states by weight and model, and the table."""
    found = {
        (gamma, name): solved("rod_4_5", {"strip.gamma": float(gamma), "model.energy": name, "model.elements": 40})
        for gamma in GAMMAS
        for name in MODELS
    }
    rows = []
    for gamma in GAMMAS:
        rod, thin, ribbon = (aside(found[gamma, name]) for name in MODELS)
        shape = apart(found[gamma, "antman"], found[gamma, "kirchhoff"])
        ribbon_shape = apart(found[gamma, "antman"], found[gamma, "sadowsky"])
        rows.append([str(gamma), *(f"{x:.5f}" for x in (rod, thin, ribbon)), f"{shape:.1e}", f"{ribbon_shape:.1e}"])
        if gamma in PROTOTYPE:
            kirchhoff, sadowsky = PROTOTYPE[gamma]
            if abs(thin - kirchhoff) > 5.5e-6 or abs(ribbon - sadowsky) > 5.5e-6 or abs(rod - kirchhoff) > COINCIDE:
                raise AssertionError(f"Gamma = {gamma}: {rod}, {thin}, {ribbon}")
        if gamma >= 20 and ribbon_shape < 20 * shape:
            raise AssertionError(f"Gamma = {gamma}: the ribbon is no further than the rods are apart")
    return found, page.table(["Gamma", *MODELS, "antman to kirchhoff / l", "antman to sadowsky / l"], rows)


def thin_limit() -> tuple[str, dict[str, Number]]:
    """Tips of both rods as w / l falls at h / w = 1 / 10: the table, and the distances, each with what Kirchhoff's
    80 segments change of it from 40."""
    rows, before, numbers = [], float("nan"), {}
    for width in WIDTHS:
        section = {"strip.gamma": 20.0, "strip.width": width, "strip.thickness": width / 10.0}
        rod = solved("rod_4_5", {**section, "model.energy": "antman"}, size=Size("antman 3", (40,), 3))
        thin, coarse = (solved("rod_4_5", {**section, "model.elements": n}) for n in (80, 40))
        here = apart(rod, thin, np.array([1.0]))
        error = apart(thin, coarse, np.array([1.0]))
        numbers[f"thin_{1 / width:.0f}"] = Number(here, error, "l", ".2e")
        ratio = "" if np.isnan(before) else f"{before / here:.2f}"
        rows.append([f"1/{1 / width:.0f}", f"{width / 10:.1e}", f"{here:.2e}", ratio])
        before = here
    return page.table(["w/l", "h/l", "tips apart / l", "of the one before"], rows), numbers


def by_length() -> str:
    """The curl of figure 4.4: both rods on one branch, and how far the ribbon is."""
    rows = []
    for length in LENGTHS:
        strip = {"strip.length": length, "model.elements": 40, "seed.ruling": 0.01}
        ribbon = solved("curl_4_4_long", strip)
        thin = solved("curl_4_4_long", {**strip, "model.energy": "kirchhoff"})
        rod = solved("curl_4_4_long", {**strip, "model.energy": "antman", "model.elements": 80}, near=thin.shape)
        line = ribbon.shape.centreline(S)
        mirrored = rod.shape.centreline(S) * np.array([-1.0, 1.0, 1.0])
        away = min(apart(rod, ribbon), float(np.linalg.norm(mirrored - line, axis=1).max()))
        out = float(np.abs(rod.shape.centreline(S)[:, 0]).max())
        rows.append([f"{100 * length:.0f}", f"{apart(rod, thin):.1e}", f"{away:.1e}", f"{out:.3f}"])
    return page.table(
        ["length, cm", "antman to kirchhoff / l", "antman to wunderlich / l", "rod out of plane / l"], rows
    )


def work() -> tuple[dict[int, list[tuple[float, float]]], str, dict[str, Number]]:
    """Error of the tip against shooting and time by elements, of the curl at Gamma = 20: degree -> (s, error)."""
    scene = load("rod_4_5").replace({"strip.gamma": 20.0, "model.energy": "antman"})
    exact, _ = shot(problem_of(scene), steps=3)
    found: dict[int, list[tuple[float, float]]] = {}
    rows, numbers = [], {}
    for degree, sizes in SIZES.items():
        before = float("nan")
        for elements in sizes:
            clock = time.process_time()
            state = solved("rod_4_5", {"strip.gamma": 20.0, "model.energy": "antman"},
                           size=Size(f"antman {degree}", (elements,), degree))  # fmt: skip
            spent = time.process_time() - clock
            assert state.end is not None
            error = float(np.linalg.norm(state.end.position - exact))
            order = "" if np.isnan(before) else f"{np.log2(before / error):.2f}"
            numbers[f"off_{degree}_{elements}"] = Number(error, SHOT, "l", ".1e")
            found.setdefault(degree, []).append((spent, error))
            rows.append([str(degree), str(elements), str(state.unknowns), f"{error:.1e}", order, f"{spent:.2f}"])
            before = error
    return found, page.table(["degree", "elements", "unknowns", "tip off / l", "order", "processor, s"], rows), numbers


def bend() -> tuple[str, dict[str, Number]]:
    """The 45 degree bend beside what is published; its tip on the finest elements, with its distance to shooting."""
    unit = 25.0 * np.pi
    scene = load("bend_45")
    exact, _ = shot(problem_of(scene), steps=3)

    def row(name: str, tip: FloatArray) -> list[str]:
        return [name, *(f"{unit * x:.3f}" for x in (tip[1], tip[2], tip[0]))]

    rows = [
        ["Bathe and Bolourchi 1979", "15.9", "47.2", "53.4"],
        ["Simo and Vu-Quoc 1986", "15.79", "47.23", "53.37"],
    ]
    for degree, elements in ((1, 8), (1, 32), (2, 8), (3, 16)):
        state = solved("bend_45", {}, size=Size(f"antman {degree}", (elements,), degree))
        assert state.end is not None
        rows.append(row(f"antman, {elements} elements of degree {degree}", state.end.position))
    rows.append(row("shooting on (12.4), 1e-11", exact))
    numbers = {
        f"bend_{word}": Number(
            unit * state.end.position[k], unit * (abs(state.end.position[k] - exact[k]) + SHOT), "", ".3f"
        )
        for word, k in (("radius", 1), ("start", 2), ("out", 0))
    }
    return page.table(["", "along the bend's radius", "along its start", "out of its plane"], rows), numbers


def draw(path: Path, weights: dict[tuple[int, str], State], errors: dict[int, list[tuple[float, float]]]) -> None:
    """Figures 4.5 and 4.6, and error against time."""
    colours = {"antman": "tab:brown", "kirchhoff": "tab:red", "sadowsky": "k"}
    figure = plt.figure(figsize=(15, 4.8))
    left = figure.add_subplot(1, 3, 1)
    for name, style in zip(MODELS, ("o", "-", "-"), strict=True):
        left.plot(GAMMAS, [aside(weights[g, name]) for g in GAMMAS], style, color=colours[name], label=name)
    left.set(xlabel="Gamma", ylabel="sqrt(y^2 + z^2) of the free end / l", title="Figure 4.5")
    left.legend()
    middle = figure.add_subplot(1, 3, 2, projection="3d")
    for name in MODELS:
        r = weights[SHOWN, name].shape.centreline(S)
        style = ":" if name == "antman" else "-"
        middle.plot(r[:, 1], r[:, 2], r[:, 0], style, color=colours[name], lw=3 if style == ":" else 1.2, label=name)
    r = weights[0, "antman"].shape.centreline(S)
    middle.plot(r[:, 1], r[:, 2], r[:, 0], color="tab:purple", lw=1, label="natural shape")
    middle.set(xlabel="y", ylabel="z", zlabel="x (up)", title=f"Figure 4.6, Gamma = {SHOWN}")
    middle.legend(fontsize=8)
    right = figure.add_subplot(1, 3, 3)
    for degree, points in errors.items():
        right.loglog(*np.array(points).T, "o-", label=f"degree {degree}")
    right.set(xlabel="processor, s", ylabel="tip off / l", title="Gamma = 20, against shooting")
    right.legend()
    figure.tight_layout(w_pad=4.0)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def run(out: Path) -> dict[str, Number]:
    folder = out / "rod_figures"
    folder.mkdir(parents=True, exist_ok=True)
    solved("rod_4_5", {"model.energy": "antman"})  # what is loaded once
    weights, first = figure_4_5()
    errors, cost, numbers = work()
    (thin, apart_by), (bent, tips) = thin_limit(), bend()
    orders = [float(np.log2(a[1] / b[1])) for a, b in itertools.pairwise(errors[2])]
    numbers["order_2"] = Number(orders[-1], abs(orders[-1] - orders[-2]), shown=".2f")
    draw(folder / "rods.png", weights, errors)
    page.write(
        folder / "README.md", "Antman's rod, Kirchhoff's and the ribbon (thesis, 4.4)",
        "python -m tests.validation rod_figures",
        "Antman's rod (`antman`, [theory](../../docs/theory.md), chapter 12) bends, twists, shears and stretches; 40 "
        "quadratic elements. `kirchhoff` is the rod on curvature elements, 40 segments, another code. Both bend with "
        "D w, as in the thesis; Sadowsky's ribbon with a free ruling.",
        "![Figures 4.5 and 4.6, and error against time](rods.png)",
        "## Figure 4.5: sqrt(y^2 + z^2) of the free end / l", first,
        "w/l = 1/30, h/w = 1/10, K = 10, nu = 0.4, scene `rod_4_5`. As the thesis says, the two rods coincide and the "
        "ribbon is elsewhere: its strip is developable and the rods' are not. A prototype of Kirchhoff's rod has "
        "0.16360, 0.20285, 0.21369 at Gamma = 20, 60, 100. Figure 4.6 is Gamma = 80.",
        "## The thin limit", thin,
        "Gamma = 20, h/w = 1/10: shear and stretch go with (h/l)^2, a quarter for half the section. 40 cubic elements "
        "against 80 segments.",
        "## Figure 4.4 and JFIG's figures 5 and 9, by length", by_length(),
        "Scene `curl_4_4_long` with other lengths (w = 1 cm, h = 0.1 mm, K = 60 /m), Antman's rod begun at "
        "Kirchhoff's shape, 80 elements; mirror images count as one for the ribbon. Rod and ribbon coincide while "
        "planar, up to 29 cm, and not beyond ([rod_ribbon](../rod_ribbon/README.md)).",
        "## The 45 degree bend, load 600", bent,
        "## What accuracy costs: the curl at Gamma = 20 from its rest shape", cost,
        "Error of the tip against shooting on the differential equations. Order 2 p for degree p, at the nodes.",
    )  # fmt: skip
    return numbers | _tips(weights) | apart_by | tips
