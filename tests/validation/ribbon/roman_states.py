"""Roman's strip that leaves its plane (thesis, figure 6.11), over meshes, and its contacts down to i = 2.3 (6.14)."""

from __future__ import annotations

import functools
import itertools
import math
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from scipy.spatial import KDTree

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.mesh_limit import Settled, settled
from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.find.branch.passages import Grading
from ribbon.find.branch.passages import settled as on_passages
from ribbon.find.continuation import switch
from ribbon.find.solve import Problem, build
from tests.validation import page
from tests.validation.number import Number, of_settled
from tests.validation.pieces import Pieces
from tests.validation.ribbon import roman

#: Figure 6.11: w/l, nu, Gamma; the last picture's Delta and a low roof.
WIDTH, POISSON, GAMMA = 0.05, 0.5, 10.0
DELTA, HEIGHT = 0.3, 0.12
SEED, RULING = (-8.0, 8.0, 8.0, -8.0), 0.05
#: States: on how many segments, first of all its meshes, and from which oblique seed `solve` ends in each.
STATES = {
    "in the plane, leaning over": (120, SEED, RULING),
    "aside, symmetrical": (80, SEED, RULING),
    "aside, leaning over": (160, SEED, RULING),
    "aside, uneven": (80, (-6.0, 8.0, 8.0, -8.0), 0.2),
}
#: Seeds of which it is counted where they end, and on how many segments.
SEEDS = tuple(itertools.product(((-8.0, 8.0, 8.0, -8.0), (-8.0, 4.0, 8.0, -8.0)), (0.01, 0.05, 0.2)))
ON = (80, 120, 160)
#: Two energies of one state on one mesh differ by no more.
ONE_STATE = 0.05
#: Elements graded to where the curvature passes zero: the first of `MESHES` gradings, each twice as fine.
PLACED = Grading(longest=0.02, least=0.004, growth=0.1, ends=False)
MESHES = 4
#: Energies are minima to this.
LOCATED = 1e-6
#: Algorithm 3: step of the exponent, its last value, segments at full height.
STEP, LAST, SEGMENTS = 0.02, 2.28, 60
#: The last stretch, to the thesis's i = 2.3: equal folds from a wave, on how many segments, first and last exponent.
FOLDS, FINE, FROM, TO = 8, 480, 2.28, 2.3


def arguments(segments: int) -> dict[str, Any]:
    """Keywords of `solve` and `build`: between floor and roof."""
    return {
        "strip": Strip(1.0, WIDTH, POISSON, gamma=GAMMA), "clamp": Clamp(ruling="free"),
        "gravity": Gravity((0.0, 1.0, 0.0)), "end": Clamp((0.0, 0.0, 1.0 - DELTA), ruling="free"),
        "walls": [Wall((0.0, -roman.EPSILON, 0.0), (0.0, 1.0, 0.0)), Wall((0.0, HEIGHT, 0.0), (0.0, -1.0, 0.0))],
        "segments": segments,
    }  # fmt: skip


def found_on(segments: int, seed: tuple[float, ...] = SEED, ruling: float = RULING) -> Equilibrium:
    """What `solve` finds from an oblique seed, saddles left."""
    return solve(**arguments(segments), seed_curvature=seed, seed_ruling=ruling, leave_saddle=True, budget=300.0)


def halved(equilibrium: Equilibrium) -> Equilibrium:
    """The same state on segments cut in two."""
    problem: Problem = build(**arguments(2 * equilibrium.problem.lengths.size))
    return switch(problem, equilibrium, leave_saddle=True)


def seen(equilibrium: Equilibrium) -> list[Any]:
    """p, energy, largest distance from the plane, lowest eigenvalue, stable."""
    aside = float(np.abs(equilibrium.position(np.linspace(0.0, 1.0, 401))[:, 0]).max())
    return [
        int(equilibrium.problem.lengths.size),
        equilibrium.energy.total,
        aside,
        float(equilibrium.lowest_eigenvalue),
        bool(equilibrium.ok),
    ]


def _state(first: int, seed: tuple[float, ...], ruling: float) -> dict[str, Any]:
    """A state on `MESHES` meshes: "rows" (`seen`), "line" (k, 3) of the finest, how near it comes to itself."""
    found, rows = found_on(first, seed, ruling), []
    for k in range(MESHES):
        found = found if not k else halved(found)
        rows.append(seen(found))
        print("  6.11:", rows[-1], flush=True)
    line = found.position(np.linspace(0.0, 1.0, 401)).tolist()
    return {"rows": rows, "line": line, "nearest": nearest(found)}


def nearest(equilibrium: Equilibrium) -> float:
    """Least distance (l) between parts of the surface whose rulings are more than three widths apart along the strip:
    a strip that touches itself has none."""
    surface = equilibrium.surface(400, 8).grid
    grid, s = surface.reshape(-1, 3), np.repeat(np.linspace(0.0, 1.0, surface.shape[0]), surface.shape[1])
    tree, least = KDTree(grid), math.inf
    for place, at in zip(grid, s, strict=True):
        near = np.array(tree.query_ball_point(place, min(least, 3.0 * WIDTH)))
        apart = near[np.abs(s[near] - at) > 3.0 * WIDTH]
        if apart.size:
            least = min(least, float(np.linalg.norm(grid[apart] - place, axis=1).min()))
    return least if math.isfinite(least) else 3.0 * WIDTH


def _placed(first: int, seed: tuple[float, ...], ruling: float) -> list[list[Any]]:
    """The same state on elements that stand where its curvature passes zero, twice as fine each (`seen`)."""
    found, rows, grading = halved(found_on(first, seed, ruling)), [], PLACED
    for _ in range(MESHES):
        found = on_passages(found.problem, found, grading)
        rows.append(seen(found))
        grading = grading.finer()
    return rows


def _ends(segments: int) -> list[list[Any]]:
    """Where the seeds end on a number of segments: energy, stable."""
    return [[one.energy.total, bool(one.ok)] for one in (found_on(segments, *seed) for seed in SEEDS)]


def counted(ends: list[list[Any]], states: dict[str, dict[str, Any]], segments: int) -> dict[str, int]:
    """How many seeds end in which state, by the energy that each has on so many segments (its limit, where it was not
    solved on these: energies of a state fall by less than 0.15 from any of the meshes)."""
    found = dict.fromkeys([*states, "another"], 0)
    for energy, stable in ends:
        near = {}
        for name, state in states.items():
            on = [row[1] for row in state["rows"] if row[0] == segments]
            known, most = (on[0], ONE_STATE) if on else (state["rows"][-1][1], 0.2)
            if stable and abs(energy - known) < most:
                near[name] = abs(energy - known)
        found[min(near, key=lambda name: near[name]) if near else "another"] += 1
    return found


def _lowered() -> list[list[Any]]:
    """Algorithm 3: (i, H, N, contact, F, segments, snapped) of every state."""
    path = roman.lower(roman.Experiment(segments=SEGMENTS), STEP, LAST)
    out = []
    for r in path.records:
        out.append([-math.log(r.height / path.top), r.height, r.count, r.kind, r.force, r.snapped])
    return out


def _last_stretch(top: float) -> list[list[Any]]:
    """(i, H, N, contact, F, stable) of `FOLDS` equal folds under roofs down to the thesis's last, each from a wave."""
    experiment, out = roman.Experiment(segments=SEGMENTS), []
    for i in np.linspace(FROM, TO, round((TO - FROM) / (0.5 * STEP)) + 1):
        height = top * math.exp(-i)
        equilibrium = experiment.folded(FOLDS, height, FINE)
        own = roman.folds(equilibrium, height)
        out.append([float(i), height, own.count, own.kind(1.01 / FINE), roman.press(equilibrium), bool(equilibrium.ok)])
        print("  6.14:", out[-1], flush=True)
    return out


def _limits(states: dict[str, dict[str, Any]], of: int = 1, located: float = LOCATED) -> dict[str, Settled]:
    """Limits over the meshes of what stands in a column of `seen`."""
    return {name: settled([row[of] for row in state["rows"]], located) for name, state in states.items()}


def _contacts(way: list[list[Any]]) -> list[list[str]]:
    """For each number of folds: how many states, with which contacts, and H N where they become planes."""
    rows = []
    for count in sorted({r[2] for r in way}):
        own = [r for r in way if r[2] == count]
        kinds = [sum(r[3] == kind for r in own) for kind in ("hanging", "line", "plane")]
        planes = [r for r in own if r[3] == "plane"]
        first = f"{planes[0][1] * count:.4f}" if planes else "none"
        at = f"{planes[0][4] / count**3:.0f}" if planes else ""
        until = f"{planes[-1][1] * count:.4f}" if planes else ""
        rows.append([str(count), f"{own[0][0]:.2f} to {own[-1][0]:.2f}", *map(str, kinds), first, at, until])
    return rows


#: Few segments, on which a state is found within a second or two: the one in the plane.
FEW = 30


@functools.cache
def _few() -> Equilibrium:
    return found_on(FEW)


PROBES = {
    "few_energy": lambda: _few().energy.total,
    "few_height": lambda: float(_few().position(np.linspace(0.0, 1.0, 401))[:, 1].max()),
}


def _numbers(
    states: dict[str, dict[str, Any]], limits: dict[str, Settled], placed: Settled,
    ways: tuple[list[list[Any]], list[list[Any]]],
) -> dict[str, Number]:  # fmt: skip
    """Energies with their errors, the lowest on placed elements too; energy and height of the state on `FEW` segments,
    with the change on twice as many;
    plane contacts."""
    path, last = ways
    many = [r for r in path if r[2] > 1]
    found = {
        f"energy_{name.replace(' ', '_').replace(',', '')}": of_settled(v.record("D w / l"))
        for name, v in limits.items()
    }
    found["energy_placed"] = of_settled(placed.record("D w / l"))
    for name, state in states.items():
        word = name.replace(" ", "_").replace(",", "")
        found[f"nearest_{word}"] = Number(state["nearest"], 1.0 / 400.0, "l", ".3f")
    finer = halved(_few())
    high = float(finer.position(np.linspace(0.0, 1.0, 401))[:, 1].max())
    for word, value, unit in (("few_energy", finer.energy.total, "D w / l"), ("few_height", high, "l")):
        first = PROBES[word]()
        found[word] = Number(first, abs(value - first), unit, ".4f")
    return found | {
        "planes": Number(sum(r[3] == "plane" for r in many), 0, shown="d"),
        "states": Number(len(many), 0, shown="d"),
        "lowest_i": Number(last[-1][0], 0.5 * STEP, shown=".2f"),
        "planes_last": Number(sum(row[3] == "plane" for row in last), 0, shown="d"),
    }


def run(out: Path) -> dict[str, Number]:
    """Measures what is not kept, writes the page; its numbers by name."""
    kept = Pieces("roman_states")
    states = {
        name: kept.get(f"state_{k}", lambda how=how: _state(*how)) for k, (name, how) in enumerate(STATES.items())
    }
    placed = kept.get("placed", lambda: _placed(*STATES["aside, symmetrical"]))
    ends = {p: kept.get(f"ends_{p}", lambda p=p: _ends(p)) for p in ON}
    path = kept.get("lowered", _lowered)
    last = kept.get("last", lambda: _last_stretch(path[0][1] * math.exp(path[0][0])))
    if not all(row[5] and row[2] == FOLDS and row[3] == "plane" for row in last):
        raise AssertionError(f"the last stretch of figure 6.14: {last}")
    limits = _limits(states)
    on_placed = settled([row[1] for row in placed], LOCATED)
    if not all(row[4] for state in (*states.values(), {"rows": placed}) for row in state["rows"]):
        raise AssertionError("a state of figure 6.11 is not stable")
    lowest = limits["aside, symmetrical"]
    if not abs(on_placed.value - lowest.value) < on_placed.error + lowest.error:
        raise AssertionError(f"aside, symmetrical: {lowest.text}, on placed elements {on_placed.text}")
    folder = out / "roman_states"
    folder.mkdir(parents=True, exist_ok=True)
    figure(folder / "states.png", states)
    write(folder / "README.md", states, (limits, on_placed), placed, ends, (path, last))
    return _numbers(states, limits, on_placed, (path, last))


def figure(path: Path, states: dict[str, dict[str, Any]]) -> None:
    """The centrelines of the states, from the side and from above."""
    fig, axes = plt.subplots(2, 1, figsize=(8, 6), layout="constrained", sharex=True)
    for name, state in states.items():
        x, y, z = np.array(state["line"]).T
        side = np.sign(x[np.argmax(np.abs(x))]) if np.abs(x).max() > 1e-6 else 1.0
        axes[0].plot(z, y, lw=1.5, label=f"{name}: {state['rows'][-1][1]:.2f}")
        axes[1].plot(z, side * x, lw=1.5)
    for height in (0.0, HEIGHT):
        axes[0].axhline(height, color="0.6", lw=1.0)
    axes[0].set(ylabel="y / l (from the side)", title=f"Delta = {DELTA:g}, H = {HEIGHT:g}; energies in D w / l")
    axes[1].set(ylabel="x / l (from above)", xlabel="z / l")
    axes[0].legend(fontsize=9)
    for axis in axes:
        axis.grid(True, lw=0.3, alpha=0.6)
        axis.set_aspect("equal")
    fig.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(fig)


def write(
    path: Path, states: dict[str, Any], energies: tuple[dict[str, Settled], Settled], placed: list[list[Any]],
    ends: dict[int, list[list[Any]]], ways: tuple[list[list[Any]], list[list[Any]]],
) -> None:  # fmt: skip
    """The page."""
    way, last = ways
    limits, on_placed = energies
    lows = _limits(states, 3, 1e-4)
    counts = {p: counted(one, states, p) for p, one in ends.items()}
    rows = [
        [name, str(p), f"{energy:.4f}", f"{aside:.4f}", f"{low:.3g}"]
        for name, state in states.items()
        for p, energy, aside, low, _ in state["rows"]
    ]
    rows += [
        ["aside, symmetrical, placed", str(p), f"{energy:.4f}", f"{aside:.4f}", f"{low:.3g}"]
        for p, energy, aside, low, _ in placed
    ]
    many = [r for r in way if r[2] > 1]
    planes = sum(r[3] == "plane" for r in many)
    lowest = min(limits, key=lambda name: limits[name].value)
    told = "; ".join(f"{name} {found.text}" for name, found in limits.items())
    page.write(
        path, "Roman's strip: states aside of its plane, and contacts down to i = 2.3 (thesis 6.2.2)",
        "python -m tests.validation roman_states",
        f"Energies over D w / l at Delta = {DELTA:g}, H = {HEIGHT:g}: {told}. The lowest is {lowest}. Plane contacts "
        f"are there for every number of folds, in {planes} of {len(many)} states with two folds or more.",
        "## Figure 6.11: states of the strip, not of the mesh\n\n"
        f"w/l = {WIDTH:g}, Gamma = {GAMMA:g}, free rulings. From one oblique seed `solve` ends in another state on "
        "other meshes (80, 120, 160 segments: 52.67, 96.04, 76.31 in what was here before): each of them is an "
        "equilibrium of the strip, stable on every mesh, whose energy settles; which one a mesh finds from a seed is "
        "chance. Each is halved three times, begun at itself; the lowest also on elements that stand where its "
        f"curvature passes zero (`ribbon.find.branch.passages`): {on_placed.text}. Aside it needs little more than "
        "half the energy of the fold that leans over in its plane, which is stable only against small disturbances. "
        "There may be more states. Contacts stand where the strip is nearest to a wall, between joints too. Parts of "
        "the strip that are more than three widths apart along it come no nearer than "
        + ", ".join(f"{state['nearest']:.3f} l ({name})" for name, state in states.items())
        + ": it does not touch itself. Lowest eigenvalue over the meshes: "
        + "; ".join(f"{name} {one.text}" for name, one in lows.items())
        + ".",
        page.table(["state", "p", "energy", "largest distance from the plane / l", "lowest eigenvalue"], rows),
        "![The states from the side and from above](states.png)",
        f"Where {len(SEEDS)} seeds end (curvatures -8, 8 or 4, 8, -8 at equal distances, rulings of 0.01, 0.05 and "
        "0.2):",
        page.table(
            ["segments", *next(iter(counts.values()))],
            [[str(p), *(str(n) for n in by.values())] for p, by in counts.items()],
        ),
        "`aside.toml` beside this page is the scene of the lowest (`ribbonbench solve aside.toml`).",
        f"## Figure 6.14: down to i = {TO:g}\n\n"
        f"Algorithm 3 with Delta = {roman.DELTA:g}, i by {STEP:g}, {SEGMENTS} segments at full height, doubled as H "
        "halves. Counted: states in which a fold hangs free, all touch along lines, or one lies on a plate "
        "(longer than one segment). The thesis finds that plane contacts hardly appear from two waves on. Followed on "
        "a branch they do, for every number of folds, from H N = 0.17 to 0.18 on as for one fold (F / N^3 near 115, "
        "where the elastica has them), until the strip snaps; how many states there are before a snap depends on the "
        "branch that is followed, H N of the first plane contact does not.\n\n"
        + page.table(
            ["N", "i", "hanging", "line", "plane", "H N of the first plane", "F / N^3 there", "H N of the last"],
            _contacts(way),
        ),
        f"The way down is followed to i = {LAST:g}; the last stretch to the thesis's i = {TO:g} from {FOLDS} equal "
        f"folds on {FINE} segments, in steps of {0.5 * STEP:g}: all are stable and touch along planes.\n\n"
        + page.table(
            ["i", "H N", "N", "contact", "F / N^3", "stable"],
            [
                [f"{i:.2f}", f"{h * n:.4f}", str(n), kind, f"{f / n**3:.1f}", "yes" if ok else "no"]
                for i, h, n, kind, f, ok in last
            ],
        ),
    )  # fmt: skip
