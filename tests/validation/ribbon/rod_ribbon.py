"""Rod and ribbon (thesis, 4.4): the curl of figure 4.4 by length, and that of figures 4.5 and 4.6 by weight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from compare.models import solve as solve_scene
from compare.models.base import State
from compare.models.shell_process import run_shell, shell_options, shell_problem
from compare.scene.scene import Scene, load
from compare.store.store import CaseStore
from tests.validation import page
from tests.validation.number import Number, rounding

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FloatArray = NDArray[np.float64]
#: Models: label -> what the scene says.
MODELS: dict[str, dict[str, Any]] = {
    "rod": {"model.energy": "kirchhoff"},
    "rod, Y I": {"model.energy": "kirchhoff", "model.stiffness": "plate"},
    "sadowsky": {"model.energy": "sadowsky"},
    "wunderlich": {"model.energy": "wunderlich"},
    "extensible": {"model.energy": "extensible"},
    "finite": {"model.energy": "finite"},
}
#: Figure 4.4: lengths in m; the thesis says that rod and ribbon coincide up to 0.29.
LENGTHS = (0.05, 0.15, 0.25, 0.29, 0.35, 0.40, 0.50)
PLANAR = 0.29
#: Largest distance in l below which two centrelines coincide, least above which they differ.
SAME, APART = 1e-6, 1e-2
#: Figure 4.5: weights, and sqrt(y^2 + z^2) of the tip as a prototype of the rod has it (boundary value problem of the
#: moment balance, another code), and of Sadowsky's ribbon on 40 segments.
GAMMAS = (0, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100)
PROTOTYPE = {
    "rod": {20: 0.16360, 60: 0.20285, 100: 0.21369},
    "sadowsky": {20: 0.16012, 60: 0.19672, 100: 0.21351},
}
SHOWN = 80
#: Weights of the shells of w/h = 10, and their mesh.
SHELLS, MESH = (20, 60, 100), (60, 6)
SEGMENTS = 40
S = np.linspace(0.0, 1.0, 801)


def by_length(length: float, label: str, segments: int = SEGMENTS) -> State:
    """The curl of figure 4.4, from a straight seed a little out of the plane."""
    changes = {"strip.length": length, "model.elements": segments, "seed.ruling": 0.01}
    return _solved(load("curl_4_4_long").replace(changes | MODELS[label]), label)


def by_weight(gamma: float, label: str, segments: int = SEGMENTS) -> State:
    """The curl of figure 4.5."""
    return _solved(
        load("rod_4_5").replace({"strip.gamma": float(gamma), "model.elements": segments} | MODELS[label]), label
    )


def _solved(scene: Scene, label: str) -> State:
    found = solve_scene(scene)
    if not found.ok:
        raise AssertionError(f"{label}, {scene.name}, l = {scene.strip.length}: {found.message}")
    return found


def distance(one: State, other: State) -> float:
    """Largest distance in l of points of equal arc length; mirror images across the clamp's plane count as one."""
    a, b = one.shape.centreline(S), other.shape.centreline(S)
    mirrored = b * np.array([-1.0, 1.0, 1.0])  # the plane of t_y and t_z of curl_4_4_long
    return float(min(np.linalg.norm(a - c, axis=1).max() for c in (b, mirrored)))


def aside(state: State) -> float:
    """sqrt(y^2 + z^2) of the tip: its place across gravity, which pulls along -x."""
    return float(np.hypot(*state.shape.centreline(np.array([1.0]))[0, 1:]))


def shell_aside(gamma: float, store: CaseStore) -> float:
    """The same of the shell, its whole edge held."""
    scene = load("rod_4_5").replace({"strip.gamma": float(gamma)})
    case = run_shell(shell_problem(scene, 10.0, MESH), store, shell_options(scene))
    if not case.ok:
        raise AssertionError(f"shell, Gamma = {gamma}: {case.data['message']}")
    return float(np.hypot(*case.surface.centreline(np.array([1.0]))[0, 1:]))


def lengths_table(found: dict[tuple[float, str], State]) -> str:
    """Distances of the models from Wunderlich's ribbon, and how far the shapes leave the plane."""
    rows = []
    for length in LENGTHS:
        ribbon = found[length, "wunderlich"]
        away = [distance(found[length, name], ribbon) for name in MODELS if name != "wunderlich"]
        out = np.abs(ribbon.shape.centreline(S)[:, 0]).max()
        rod = np.abs(found[length, "rod"].shape.centreline(S)[:, 0]).max()
        rows.append([f"{100 * length:.0f}", *(f"{x:.1e}" for x in away), f"{out:.3f}", f"{rod:.3f}"])
        if (length <= PLANAR - 0.01 and away[0] > SAME) or (length > PLANAR + 0.01 and away[0] < APART):
            raise AssertionError(f"l = {length} m: rod and ribbon are {away[0]} l apart")
    heads = [f"{name} / l" for name in MODELS if name != "wunderlich"]
    return page.table(["length, cm", *heads, "ribbon out of plane / l", "rod out of plane / l"], rows)


def weights_table(found: dict[tuple[float, str], State], shells: dict[float, float]) -> str:
    """sqrt(y^2 + z^2) / l of every model; checked against the prototype."""
    for name, values in PROTOTYPE.items():
        for gamma, value in values.items():
            here = aside(found[gamma, name])
            if abs(here - value) > 5.5e-6:
                raise AssertionError(f"{name}, Gamma = {gamma}: {here}, the prototype has {value}")
    rows = [[str(g), *(f"{aside(found[g, name]):.5f}" for name in MODELS), f"{shells[g]:.5f}" if g in shells else ""]
            for g in GAMMAS]  # fmt: skip
    return page.table(["Gamma", *MODELS, "shell, w/h = 10"], rows)


def draw(
    path: Path, lengths: dict[tuple[float, str], State], weights: dict[tuple[float, str], State],
    shells: dict[float, float],
) -> None:  # fmt: skip
    """Figures 4.4 (from the side), 4.5 and 4.6."""
    figure = plt.figure(figsize=(12, 9))
    above = figure.add_subplot(2, 1, 1)
    for k, length in enumerate(LENGTHS):
        for name, colour in (("wunderlich", "tab:blue"), ("rod", "tab:orange"), ("finite", "k")):
            r = 100 * length * lengths[length, name].shape.centreline(S)
            r[:, 0] *= np.sign(r[np.abs(r[:, 0]).argmax(), 0]) or 1.0
            label = name if k == 0 else None
            above.plot(11 * k + r[:, 2] + 0.5 * r[:, 0], r[:, 1] - 0.2 * r[:, 0], color=colour, lw=1.3, label=label)
        above.text(11 * k, 1.5, f"{100 * length:.0f} cm", ha="center")
    above.set(aspect="equal")
    above.set_axis_off()
    above.legend(fontsize=9)
    left = figure.add_subplot(2, 2, 3)
    for name in MODELS:
        left.plot(GAMMAS, [aside(weights[g, name]) for g in GAMMAS], "o-", ms=3, label=name)
    left.plot(list(shells), list(shells.values()), "k^", ms=7, label="shell")
    left.set(xlabel="Gamma", ylabel="sqrt(y^2 + z^2) of the free end / l")
    left.legend(fontsize=8)
    right = figure.add_subplot(2, 2, 4, projection="3d")
    for name in MODELS:
        r = weights[SHOWN, name].shape.centreline(S)
        right.plot(r[:, 1], r[:, 2], r[:, 0], lw=1.3, label=name)
    r = weights[0, "rod"].shape.centreline(S)
    right.plot(r[:, 1], r[:, 2], r[:, 0], color="tab:purple", lw=1, label="natural shape")
    right.set(xlabel="y", ylabel="z", zlabel="x (up)", title=f"Gamma = {SHOWN}")
    right.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _away(length: float, segments: int = SEGMENTS) -> float:
    """Distance (l) of rod and Wunderlich's ribbon."""
    return distance(by_length(length, "rod", segments), by_length(length, "wunderlich", segments))


PROBES = {
    "apart_35": lambda: _away(0.35),
    "tip_20": lambda: aside(by_weight(20, "rod")),
    "tip_100": lambda: aside(by_weight(100, "rod")),
    "sadowsky_60": lambda: aside(by_weight(60, "sadowsky")),
}


def _numbers(
    lengths: dict[tuple[float, str], State], weights: dict[tuple[float, str], State], shells: dict[float, float]
) -> dict[str, Number]:
    """Distances by length and tips by weight, each with its change on twice the segments."""
    away = {length: distance(lengths[length, "rod"], lengths[length, "wunderlich"]) for length in LENGTHS}
    numbers = {"together": rounding(max(away[length] for length in LENGTHS if length <= PLANAR), "l", ".1e")}
    for length in (length for length in LENGTHS if length > PLANAR):
        error = abs(_away(length, 2 * SEGMENTS) - away[length])
        numbers[f"apart_{100 * length:.0f}"] = Number(away[length], error, "l", ".1e")
    for word, name in (("tip", "rod"), ("sadowsky", "sadowsky")):
        for gamma in PROTOTYPE[name]:
            tip = aside(weights[gamma, name])
            error = abs(aside(by_weight(gamma, name, 2 * SEGMENTS)) - tip)
            numbers[f"{word}_{gamma}"] = Number(tip, error, "l", ".5f")
    # the shell's mesh is one; nothing tells its error here
    why = "one mesh"
    return numbers | {f"shell_{gamma}": Number(tip, None, "l", ".4f", why) for gamma, tip in shells.items()}


def run(out: Path) -> dict[str, Number]:
    folder = out / "rod_ribbon"
    folder.mkdir(parents=True, exist_ok=True)
    lengths = {(length, name): by_length(length, name) for name in MODELS for length in LENGTHS}
    weights = {(gamma, name): by_weight(gamma, name) for name in MODELS for gamma in GAMMAS}
    store = CaseStore(out.parent / "out" / "validate" / "rod_ribbon" / "cases")
    shells = {gamma: shell_aside(gamma, store) for gamma in SHELLS}
    first, second = lengths_table(lengths), weights_table(weights, shells)
    draw(folder / "shapes.png", lengths, weights, shells)
    page.write(
        folder / "README.md", "Rod and ribbon (thesis, 4.4)", "python -m tests.validation rod_ribbon",
        "rod: `kirchhoff`, bending stiffness D w (the thesis multiplies Y I by 1 / (1 - nu^2)), in-plane bending "
        "(w / h)^2 times as stiff, torsion constant of the rectangle; rod, Y I: without that factor. "
        f"{SEGMENTS} segments. Free rulings, as in the thesis.",
        "![Figures 4.4, 4.5 and 4.6 again](shapes.png)",
        "## Figure 4.4: distance from Wunderlich's ribbon by length", first,
        "Scene `curl_4_4_long` with other lengths: w = 1 cm, h = 0.1 mm (w/h = 100), K = 60 /m, from a straight seed "
        "with eta = 0.01. Largest distance of points of equal arc length; mirror images count as one. As the thesis "
        "says, rod and ribbon coincide up to 29 cm, where both are planar and bend alike, and differ beyond. "
        "Sadowsky's ribbon leaves the plane a little before Wunderlich's ([curl_length](../curl_length.md)); a section "
        "that curves across (extensible, finite) bends more softly in the plane already.",
        "## Figure 4.5: sqrt(y^2 + z^2) of the free end / l, w/l = 1/30, h/w = 1/10, K = 10, nu = 0.4", second,
        "Scene `rod_4_5`, clamp of 3.5.2, weight along -x. The rod agrees to 5.5e-06 with a prototype that solves the "
        "balance of moments as a boundary value problem (0.16360, 0.20285, 0.21369 at Gamma = 20, 60, 100), "
        "Sadowsky's ribbon with 0.16012, 0.19672, 0.21351.",
        f"The shell, Q2 {MESH[0]} x {MESH[1]}, holds its whole edge.",
        f"Figure 4.6 is Gamma = {SHOWN}, below right in the picture.",
    )  # fmt: skip
    return _numbers(lengths, weights, shells)
