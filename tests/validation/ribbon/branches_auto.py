"""AUTO-07p beside `ribbonbench branches` on the same equations: two clamps of which one is shifted (planar elastica),
and Sadowsky's coils under their weight; folds and branch points of both, and what they cost at equal error."""

from __future__ import annotations

import functools
import time
from pathlib import Path

import numpy as np

from compare.battery.cases.branches.scenes import clamps
from compare.models.base import Shape
from compare.scene.scene import Scene, load, loads
from compare.studies.branches.diagram import Diagram
from compare.studies.branches.run import Asked, diagram
from tests.peers import auto, auto_branches
from tests.validation import page
from tests.validation.number import Number

#: Promised: the same places, and no others.
SAME = 1e-6
#: Intervals of AUTO's collocation; error of a place at which the times are compared.
MESHES, EQUAL = (5, 10, 20, 40, 80), 1e-8
KEY = "clamp.end.position[2]"
#: Weights up to which coils are followed, elements, by K.
COILS = {10: (200.0, 20), -10: (200.0, 20), 40: (1200.0, 40), -40: (1200.0, 40), 100: (7500.0, 80), -100: (7500.0, 80)}
ARCH, WAVE = [6.0, -6.0, 6.0], [-6.0, 0.0, 6.0]
LEVEL, TILTED = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), ([0.96, 0.0, -0.28], [0.28, 0.0, 0.96])
#: Frames of the end, seed, first and last shift, kind of the one special point.
CASES = {
    "tilted_up": (TILTED, ARCH, 0.0, 0.4, "fold"),
    "tilted_down": (TILTED, ARCH, 0.0, -0.5, "fold"),
    "level": (LEVEL, WAVE, 0.5, 0.4, "branch_point"),
}


def absent() -> str | None:
    """Why AUTO cannot be run; None: it can."""
    return auto.absent()


def scene(name: str) -> Scene:
    """The scene of a case."""
    (tangent, normal), seed, *_ = CASES[name]
    return loads(clamps(tangent, normal, seed, None), name)


def ours(name: str, errors: bool = False) -> tuple[Diagram, float]:
    """The scene's own branch, and the time of the processor for it in s."""
    _, _, first, last, _ = CASES[name]
    begun = time.process_time()
    found = diagram(scene(name), KEY, first, last, asked=Asked(branches=1, errors=errors))
    return found, time.process_time() - begun


def _table(shape: Shape, count: int = 2001) -> tuple[np.ndarray, tuple[float, float]]:
    """s, x, z, theta, kappa (k, 5) and the force (2,) on the end, which kappa = kappa_0 + F_x z - F_z x gives."""
    s = np.linspace(0.0, 1.0, count)
    along, line = shape.frames(s)[:, :, 2], shape.centreline(s)
    theta = np.unwrap(np.arctan2(along[:, 2], along[:, 0]))
    terms = np.column_stack([np.ones(count), line[:, 2], -line[:, 0]])
    found = np.linalg.lstsq(terms, np.gradient(theta, s, edge_order=2), rcond=None)[0]
    force = float(found[1]), float(found[2])
    return np.column_stack([s, line[:, 0], line[:, 2], theta, terms @ found]), force


@functools.cache
def theirs(name: str, mesh: int) -> auto_branches.Followed:
    """AUTO's branch from the first state of ours, which it corrects."""
    _, _, first, last, _ = CASES[name]
    start = ours(name)[0].branches[0].points[0].shape
    assert start is not None
    table, force = _table(start)
    return auto_branches.arch(table, (0.8, first), force, last, mesh)


def _place(name: str) -> float:
    """Of ours."""
    found, _ = ours(name)
    (one,) = [p for p in found.branches[0].special if p.kind == CASES[name][-1]]
    return one.parameter


def _row(name: str) -> tuple[list[str], dict[str, float], list[list[str]]]:
    """A case: the places of both, and the cost of each size."""
    found, _ = ours(name, errors=True)
    (one,) = [p for p in found.branches[0].special if p.kind != "event"]
    assert one.settled is not None
    assert one.settled.settles
    their = theirs(name, MESHES[-1])
    ((kind, place),) = their.special
    assert kind == one.kind == CASES[name][-1]
    costs = []
    begun, seconds = ours(name)
    at = [p.parameter for p in begun.branches[0].special if p.kind == kind]
    costs.append([name, "ours", "its own elements", f"{abs(at[0] - place):.1e}" if at else "not seen", seconds])
    for mesh in MESHES[:-1]:
        run = theirs(name, mesh)
        at = [value for what, value in run.special if what == kind]
        costs.append([name, "AUTO", f"NTST {mesh}", f"{abs(at[0] - place):.1e}" if at else "not seen", run.seconds])
    apart = abs(one.settled.value - place)
    numbers = {"ours": one.settled.value, "error": one.settled.error, "auto": place, "apart": apart}
    row = [name, kind.replace("_", " "), f"{one.settled.value:.11f}", f"{one.settled.error:.0e}", f"{place:.11f}",
           f"{apart:.1e}"]  # fmt: skip
    return row, numbers, costs


def _cheapest(costs: list[list], who: str) -> float:
    """The least time at which a place is within `EQUAL`."""
    return min(row[4] for row in costs if row[1] == who and row[3] != "not seen" and float(row[3]) <= EQUAL)


def coil(curvature: int) -> tuple[list[str], int, int]:
    """A coil's folds and branch points, ours and theirs: their numbers."""
    gamma, elements = COILS[curvature]
    given = load("coil_10_100").replace(
        {"strip.natural_curvature": float(curvature), "strip.gamma": 1.0, "model.elements": elements}
    )
    found = diagram(given, "strip.gamma", 1.0, gamma, asked=Asked(branches=1, steps=600, errors=False))
    (own,) = found.branches
    up = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    their = auto_branches.coil(gamma, float(curvature), 0.4, up, 80)
    reached = own.ended == "range" and their.values.max() >= gamma * (1.0 - 1e-9)
    assert reached, (curvature, own.ended, their.values.max())
    mine = sum(p.kind in ("fold", "branch_point") for p in own.special)
    return [f"{curvature}", f"{gamma:g}", f"{elements}", f"{mine}", f"{len(their.special)}"], mine, len(their.special)


PROBES = {f"{name}_ours": functools.partial(_place, name) for name in ("tilted_up", "tilted_down")}


def run(out: Path) -> dict[str, Number]:
    rows, numbers, costs = [], {}, []
    for name in CASES:
        row, found, cost = _row(name)
        rows.append(row)
        costs += cost
        numbers |= {
            f"{name}_ours": Number(found["ours"], max(found["error"], 1e-9), "l", ".9f"),
            f"{name}_auto": Number(found["auto"], 1e-9, "l", ".9f"),
            f"{name}_apart": Number(found["apart"], max(found["error"], 1e-9), "l", ".0e"),
        }
        for who in ("ours", "AUTO"):
            why = "time of the processor of one run"
            numbers[f"{name}_ms_{who.lower()}"] = Number(1e3 * _cheapest(cost, who), None, "ms", ".0f", why)
        print(f"  branches_auto: {name}", flush=True)
    coils = []
    for curvature in COILS:
        row, mine, their = coil(curvature)
        coils.append(row)
        numbers[f"coil_{'minus_' if curvature < 0 else ''}{abs(curvature)}"] = Number(abs(mine - their), 0, shown="d")
        print(f"  branches_auto: K = {curvature}", flush=True)
    worst = max(found.value for name, found in numbers.items() if name.endswith("_apart"))
    page.write(
        out / "branches_auto.md", "Folds and branch points beside AUTO-07p", "python -m tests.validation branches_auto",
        f"{auto.version()}. The planar elastica between two clamps 0.8 l apart, the end tilted by 16.3 degrees or "
        "level, shifted along z: `theta'' = F_x sin(theta) - F_z cos(theta)` with six boundary conditions "
        "(`tests/peers/arch.f90`); ours: `ribbonbench branches --along clamp.end.position[2] --model elastica`, the "
        "limit over elements halved twice with its error. AUTO begins at our first state, corrects it and follows it "
        "with analytic derivatives, NCOL 4.",
        page.table(["case", "kind", "ours / l", "+-", f"AUTO / l, NTST {MESHES[-1]}", "apart"], rows),
        "The level arch turns back at its fork, where AUTO sees neither a fold nor a branch point on any of these "
        "meshes; so both go down the S-shaped branch. There its own function of branch points changes sign, and its "
        "search for the place ends elsewhere (the matrix is singular on the branch): the place is interpolated from "
        "that function between the points of its branch. Ours sees the fork from either branch.",
        "Cost of the whole branch, and how far the place is from AUTO's finest one (AUTO: a process, compiled before; "
        "ours: warm; time of the processor, one run each):",
        f"At an error of {EQUAL:g} l AUTO needs "
        + ", ".join(f"{numbers[f'{name}_ms_auto'].value:.0f} ms ({name}, ours {numbers[f'{name}_ms_ours'].value:.0f})"
                    for name in CASES) + ".",
        page.table(["case", "who", "size", "off / l", "ms"], [[*row[:4], f"{1e3 * row[4]:.0f}"] for row in costs]),
        "Sadowsky's coils from Gamma = 1 (AUTO: 0), `coil_10_100` with another K: numbers of folds and branch points. "
        "(Coarse elements have folds of their own: 20 of them at K = 100 have seven below Gamma = 9000, four times as "
        "many none.)",
        page.table(["K l", "to Gamma", "our elements", "ours", "AUTO"], coils),
    )  # fmt: skip
    if worst > SAME or any(numbers[name].value for name in numbers if name.startswith("coil")):
        raise AssertionError(f"apart by {worst}; coils {coils}")
    return numbers
