"""Classical shooting beside the ribbon (thesis, 4.2, figure 4.1, and the row SHOOTING of table 3.2)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from compare.models.ribbon.build import ribbon_clamp, ribbon_gravity
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, Strip, refine, solve
from tests.reference.shooting import Shooter, Shot
from tests.reference.strong_form import StrongForm
from tests.validation import one_core, page
from tests.validation.number import Number

#: Scene, sign of K, segments at first, segments at most; the thesis's steps of SHOOTING (table 3.2).
SCENES = (
    ("coil_10_100", -1, 10, 320, "42"), ("coil_10_100", 1, 10, 320, "42"), ("figure_4_1", 1, 20, 320, "-"),
    ("coil_40_1200", -1, 20, 320, "78"), ("coil_40_1200", 1, 20, 320, "78"),
    ("coil_100_7500", -1, 20, 320, "784"), ("coil_100_7500", 1, 40, 320, "784"),
)  # fmt: skip
#: Natural curvatures of the sweep, under Gamma = `WEIGHT` K^2, as the thesis's last two coils are.
CURVATURES = (5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0)
WEIGHT = 0.75
#: CPU s after which a shot counts as not arrived; integrator's tolerance.
BUDGET, TOLERANCE = 45.0, 1e-11
#: So narrow a strip (w / l) that the bound on eta' is out of reach; Sadowsky's energy does not know the width.
NARROW = 1e-3
#: Arrived shots stand at most this far (in l) from the ribbon's free end, where both are on one branch.
AGREE, BRANCH = 1e-5, 0.03


def strong(scene: Scene, sign: int) -> StrongForm:
    """The boundary-value problem of a scene, K with this sign."""
    k = tuple(sign * c for c in scene.curvature)
    return StrongForm(scene.gamma, (k[0], k[1]), scene.strip.poisson, np.asarray(scene.up), scene.frame)


def ribbon(scene: Scene, sign: int, first: int, most: int) -> Equilibrium:
    """Sadowsky's ribbon from its natural shape, segments cut in two up to `most`."""
    strip = Strip(1.0, NARROW, scene.strip.poisson, tuple(sign * c for c in scene.curvature), scene.gamma)
    found = solve(strip, ribbon_clamp(scene), ribbon_gravity(scene), energy="sadowsky", segments=first)
    while found.problem.lengths.size < most:
        found = refine(found)
    return found


def shots(problem: StrongForm) -> tuple[Shot, Shot]:
    """From the clamp and from the free end."""
    forth, back = (Shooter(problem, TOLERANCE, backwards).shoot(budget=BUDGET) for backwards in (False, True))
    return forth, back


@cache
def _shot(name: str, sign: int, backwards: bool) -> Shot:
    """One of them."""
    return Shooter(strong(load(name), sign), TOLERANCE, backwards).shoot(budget=BUDGET)


def _reached(name: str, sign: int, backwards: bool) -> float:
    """Distance (l) of a shot's free end from the clamp."""
    return float(np.linalg.norm(_shot(name, sign, backwards).solution().tip()))


PROBES = {
    "tip_10_clamp": lambda: _reached("coil_10_100", 1, False),
    "tip_10_free_end": lambda: _reached("coil_10_100", 1, True),
    "weights_10_clamp": lambda: _shot("coil_10_100", 1, False).steps,
    "weights_10_free_end": lambda: _shot("coil_10_100", 1, True).steps,
}


def _numbers(name: str, sign: int, what: str, shot: Shot, apart: float) -> dict[str, Number]:
    """Of a shot: weights tried, growth (an estimate), how far it went; where it arrived on the ribbon's branch the
    free end, whose distance from the ribbon's is its error."""
    curvature = load(name).curvature[0]
    word = f"{curvature:.0f}{'' if sign > 0 else '_down'}_{what.replace(' ', '_')}"
    numbers = {
        f"weights_{word}": Number(shot.steps, 0, shown="d"),
        f"growth_{word}": Number(shot.growth, 0.1 * shot.growth, shown=".0e"),
        f"reached_{word}": Number(100.0 * shot.reached, 1.0, "%", ".0f"),
    }
    if apart < BRANCH:
        tip = float(np.linalg.norm(shot.solution().tip()))
        numbers[f"tip_{word}"] = Number(tip, apart + TOLERANCE, "l", ".7f")
        numbers[f"apart_{word}"] = Number(apart, AGREE, "l", ".0e")
    return numbers


def _arrived(shot: Shot) -> str:
    return "yes" if shot.converged else f"no, {100 * shot.reached:.0f} % of the weight"


def _row(shot: Shot) -> list[str]:
    return [_arrived(shot), str(shot.steps), str(shot.integrations), f"{shot.growth:.0e}", f"{shot.seconds:.1f}"]


def _scenes() -> tuple[list[list[str]], list[float], dict[str, np.ndarray], dict[str, Number]]:
    rows, distances, overlay, numbers = [], [], {}, {}
    for name, sign, first, most, thesis in SCENES:
        scene = load(name)
        problem, strip = strong(scene, sign), ribbon(scene, sign, first, most)
        end = strip.end.position - strip.problem.clamp.position
        for what, shot in zip(("clamp", "free end"), shots(problem), strict=True):
            apart = float(np.linalg.norm(shot.solution().tip() - end)) if shot.converged else np.nan
            if apart < BRANCH:
                distances.append(apart)
            numbers.update(_numbers(name, sign, what, shot, apart))
            words = "-" if np.isnan(apart) else f"{apart:.0e}" if apart < BRANCH else f"({apart:.2g}: another branch)"
            rows.append([f"{name}, K l = {problem.curvature[0]:g}", what, *_row(shot), words, thesis])
            if name == "figure_4_1" and what == "clamp" and shot.converged:
                overlay = {"shooting": shot.solution().centreline()[1]}
                overlay["ribbon"] = strip.position(np.linspace(0, 1, 41)) - strip.problem.clamp.position
        print(f"  {name} {sign}: {rows[-2][2:]} {rows[-1][2:]}", flush=True)
    return rows, distances, overlay, numbers


def _sweep() -> list[list[str]]:
    scene, rows = load("coil_40_1200"), []
    base = strong(scene, -1)
    for k in CURVATURES:
        problem = replace(base, curvature=(-k, -k), gamma=WEIGHT * k * k)
        for what, shot in zip(("clamp", "free end"), shots(problem), strict=True):
            rows.append([f"{k:g}", f"{problem.gamma:g}", what, *_row(shot)])
        print(f"  K = {k:g}: {rows[-2][3:]} {rows[-1][3:]}", flush=True)
    return rows


def _picture(overlay: dict[str, np.ndarray], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(5.2, 6.4), sharey=True, constrained_layout=True)
    line, dots = overlay["shooting"], overlay["ribbon"]
    for axis, (i, j) in zip(axes, ((2, 0), (1, 0)), strict=True):
        axis.plot(line[:, i], line[:, j], color="tab:green", lw=2, label="shooting")
        axis.plot(dots[:, i], dots[:, j], "o", color="tab:blue", ms=4, mfc="none", label="curvature elements")
        axis.set_aspect("equal")
        axis.set_xlabel(f"{'xyz'[i]} / l")
        axis.tick_params(axis="x", rotation=60)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("x / l, upwards")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle("Figure 4.1 of the thesis: one strip, two methods", fontsize=11)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def measure() -> tuple[list[list[str]], list[float], dict[str, np.ndarray], dict[str, Number], list[list[str]]]:
    """All shots, in this process."""
    return (*_scenes(), _sweep())


def run(out: Path) -> dict[str, Number]:
    rows, distances, overlay, numbers, sweep = one_core.call(measure)
    if not overlay or max(distances) > AGREE:
        raise AssertionError(f"shooting and the ribbon stand {max(distances, default=np.nan):.0e} apart")
    _picture(overlay, out / "shooting.png")
    heads = ["from the", "arrives", "weights tried", "integrations", "growth", "CPU s"]
    page.write(
        out / "shooting.md", "Classical shooting (thesis, 4.2)", "python -m tests.validation shooting",
        "The Euler-Lagrange equations of Sadowsky's ribbon as an initial value problem (tests/reference/shooting.py): "
        "omega, eta and M_2 at the clamp are guessed so that the free end is free; or, from the free end, the "
        "direction of the weight there so that the clamp is where it is. Newton's method on variational equations, "
        f"the weight growing from nothing, integration to {TOLERANCE:g}, {BUDGET:g} s of CPU time at most. Growth: "
        "the norm of the residual's derivative by the guess, that is, by how much a guess's error is larger at the "
        "other end.",
        "## The thesis's scenes\n\n"
        + page.table(["scene", *heads, "free end from the ribbon's / l", "thesis: steps"], rows),
        f"Arrived shots on the ribbon's branch stand {max(distances):.0e} l from it at most (320 segments). "
        "Figure 4.1 as the thesis draws it:\n\n![Figure 4.1](shooting.png)",
        "## How far it goes as the natural curvature grows\n\n"
        f"The clamp of 3.5.2, curling down, Gamma = {WEIGHT:g} K^2.\n\n"
        + page.table(["K l", "Gamma", *heads], sweep),
    )  # fmt: skip
    return numbers
