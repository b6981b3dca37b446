"""Every shipped scene from its declared seed and from ten perturbed ones: where the minimiser ends."""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import build_arguments, ribbon_arguments
from compare.models.ribbon.stages import run_way
from compare.models.scope import beyond_the_ribbon
from compare.scene.scene import Scene, load, shipped
from ribbon import Equilibrium, Status, solve
from ribbon.errors import RibbonInputError
from ribbon.find.adaptive import solve_to_tolerance
from ribbon.find.solve import build, solve_shape, starting_shapes
from tests.validation import page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

PERTURBED = 10
#: Size of the ten perturbations, relative to 1 + the largest |omega| l or to 1 for eta, growing from first to last.
SIZES = np.geomspace(0.03, 0.3, PERTURBED)
#: Cosines in s of which a perturbation is made.
MODES = 5
SEED = 20211
#: CPU time (s) for one scene's perturbed seeds and for all scenes; what does not fit is left out and counted as such.
PER_SCENE, ALL = 15.0, 165.0
#: Relative difference of energies that counts as the same.
SAME = 1e-7


@dataclass
class Row:
    """A scene: how its own seed ended, and how many of the perturbed ones ended how, against `energy`."""

    name: str
    own: Equilibrium
    energy: float
    iterations: list[int] = field(default_factory=list)
    same: int = 0
    lower: int = 0
    higher: int = 0
    saddle: int = 0
    failed: int = 0
    left_out: int = 0
    statuses: set[str] = field(default_factory=set)
    energies: list[float] = field(default_factory=list)
    note: str = ""

    def add(self, e: Equilibrium) -> None:
        """Counts one perturbed solve."""
        own, here = self.energy, e.energy.total
        if e.status is Status.SADDLE:
            self.saddle += 1
        elif not e.ok:
            self.failed += 1
            self.statuses.add(e.status.name.lower())
            return
        elif abs(here - own) <= SAME * max(1.0, abs(own)):
            self.same += 1
        elif here < own:
            self.lower += 1
        else:
            self.higher += 1
        self.iterations.append(e.iterations)
        self.energies.append(here)


def _smooth(rng: np.random.Generator, s: np.ndarray) -> np.ndarray:
    """A random combination of cosines in s, largest value 1 at most."""
    modes = np.cos(np.pi * np.outer(s, np.arange(MODES))) @ rng.uniform(-1.0, 1.0, MODES)
    return modes / max(np.abs(modes).max(), 1e-12)


def _perturbed(
    rng: np.random.Generator, size: float, s: np.ndarray, omega: np.ndarray, eta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """omega (times l) and eta with smooth noise of that relative size."""
    return (
        omega + size * (1.0 + np.abs(omega).max()) * _smooth(rng, s),
        eta + size * _smooth(rng, s),
    )


def _own(scene: Scene) -> Equilibrium:
    if scene.path:
        return run_way(scene).equilibrium
    arguments = ribbon_arguments(scene)
    if scene.model.tolerance is None:
        return solve(**arguments)
    del arguments["segments"]
    first = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return solve_to_tolerance(*first, **arguments, tolerance=scene.model.tolerance)


def _again(scene: Scene, rng: np.random.Generator, size: float, shape: dict[str, Any]) -> Equilibrium:
    """From a perturbed seed: of the first stage where there is a path."""
    if scene.path:
        s = np.linspace(0.0, 1.0, 33)
        given = scene.stages()[0]
        values = [np.interp(s, np.linspace(0, 1, len(v)), v) for v in (given.seed_curvature, given.seed.ruling)]
        omega, eta = _perturbed(rng, size, s, *values)
        keys = {"seed.curvature": (omega / scene.strip.length).tolist(), "seed.ruling": eta.tolist()}
        return run_way(scene.replace(keys)).equilibrium
    if not shape:
        shape["problem"] = build(**build_arguments(scene))
        given = ribbon_arguments(scene)
        shape["shape"] = next(iter(starting_shapes(shape["problem"], given["seed_curvature"], given["seed_ruling"])))
    problem = shape["problem"]
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    omega, eta = _perturbed(rng, size, s, *shape["shape"])
    # rulings that cross are no shape at all
    steep = np.abs(np.diff(eta) / problem.lengths).max() * problem.half_width
    if steep > 0.95:
        eta = eta * 0.95 / steep
    return solve_shape(problem, omega, eta)


def measure(name: str, deadline: float) -> Row:
    """One scene; `deadline`: of process_time, beyond which perturbed seeds are left out."""
    scene = load(name)
    clock = time.process_time()
    own = _own(scene)
    row = Row(name, own, own.energy.total)
    once = time.process_time() - clock
    rng = np.random.default_rng(SEED)
    until = min(deadline, time.process_time() + PER_SCENE)
    shape: dict[str, Any] = {}
    if scene.model.tolerance is not None:
        row.note = f"perturbed on the first {scene.model.elements} equal segments, and compared there"
        row.energy = _again(scene, rng, 0.0, shape).energy.total
    for size in SIZES:
        if time.process_time() + (once if scene.path else 0.0) > until:
            row.left_out += 1
            continue
        try:
            row.add(_again(scene, rng, float(size), shape))
        except RibbonInputError as error:
            row.failed += 1
            row.statuses.add(f"refused ({error.key})" if hasattr(error, "key") else "refused")
    return row


def _line(row: Row) -> list[str]:
    own = row.own
    spread = f"{min(row.iterations)} to {max(row.iterations)}" if row.iterations else "-"
    others = [v for v in row.energies if abs(v - row.energy) > SAME * max(1.0, abs(row.energy))]
    note = "; ".join(filter(None, [row.note, ", ".join(sorted(row.statuses))]))
    return [
        row.name, own.status.name.lower(), str(own.iterations), f"{own.residual:.0e}", f"{own.energy.total:.6g}",
        spread,        *(str(v) for v in (row.same, row.lower, row.higher, row.saddle, row.failed, row.left_out)),
        f"{min(others):.6g} to {max(others):.6g}" if others else "", note,
    ]  # fmt: skip


def _same(name: str) -> int:
    """Of a scene's perturbed seeds: how many end in the state of its own."""
    return measure(name, time.process_time() + ALL).same


PROBES = {f"same_{name}": functools.partial(_same, name) for name in ("cantilever", "coil_10_100", "start_5_3_3_4")}


def run(out: Path) -> dict[str, Number]:
    began = time.process_time()
    rows = []
    for name in shipped():
        scene = load(name)
        if beyond_the_ribbon(scene) is not None or scene.shaped:  # no ruling has such a shape at rest
            continue
        if time.process_time() - began > ALL:
            print(f"  seeds: no time left for {name}", flush=True)
            continue
        rows.append(measure(name, began + ALL))
        print(f"  seeds: {name}, {time.process_time() - began:.0f} s", flush=True)
    counted = {
        key: sum(getattr(row, key) for row in rows)
        for key in ("same", "lower", "higher", "saddle", "failed", "left_out")
    }  # fmt: skip
    tried = sum(counted.values()) - counted["left_out"]
    stable = counted["same"] + counted["lower"] + counted["higher"]
    others = ", ".join(row.name for row in rows if row.lower + row.higher) or "none"
    page.write(
        out / "seeds.md", "Where the scenes end from other seeds", "python -m tests.validation seeds",
        f"Every shipped scene from its declared seed and from {PERTURBED} perturbed ones: to omega l and eta, "
        f"combinations of {MODES} cosines in s with random coefficients (fixed generator) are added, of largest "
        f"value from {SIZES[0]:.2f} to {SIZES[-1]:.2f} of 1 + the largest |omega| l, and of 1 for eta, growing from "
        "the first to the last; a scene with a path is perturbed at its first stage. The solves are "
        "`ribbon.solve`'s, its several barriers from a far start included; saddles are not left. Same: energy "
        f"equal to {SAME:.0e}, relative. Left out: did not fit in {PER_SCENE:g} s of CPU time a scene, "
        f"{ALL:g} s in all.",
        f"Of {tried} perturbed seeds {counted['same']} end in the state of the declared seed, "
        f"{counted['lower'] + counted['higher']} in another stable one ({counted['lower']} of lower energy, "
        f"{counted['higher']} of higher), {counted['saddle']} on a saddle, which is reported as such, "
        f"{counted['failed']} elsewhere, with a status that says so. Other stable states: {others}.",
        page.table(
            ["scene", "from its own seed", "iterations", "residual", "energy", "iterations, perturbed", "same", "lower",
             "higher", "saddle", "failed", "left out", "energies of the others", "notes"],
            [_line(row) for row in rows],
        ),
    )  # fmt: skip
    if stable + counted["saddle"] < 0.9 * tried:
        raise AssertionError(f"{stable} of {tried} perturbed seeds end in a stable state")
    every = {**counted, "tried": tried, "other": counted["lower"] + counted["higher"]}
    return {name: Number(value, 0, shown="d") for name, value in every.items()} | {
        f"same_{row.name}": Number(row.same, 0, shown="d") for row in rows
    }
