"""Newton's iteration along the strip against Ipopt, its judge, on glued ribbons: shipped scenes, random ones, many
segments (results/newton_glued.md)."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.solving import solver
from compare.models.ribbon.stages import run_way
from compare.scene.scene import load
from ribbon import Clamp, Closure, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.errors import RibbonInputError
from ribbon.find import doubling, relax
from ribbon.find.solve import build
from ribbon.find.solving import check
from ribbon.judge import reduction
from ribbon.judge.spectrum import SecondVariation
from ribbon.problems import transfer
from ribbon.solvers import choose, ipopt, newton_rows
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum
from tests.validation import one_core, page
from tests.validation.number import Number, rounding
from tests.validation.pieces import Pieces

SCENES = (
    "arc_5_1", "start_5_3_3_1", "start_5_3_3_2", "start_5_3_3_3", "start_5_3_3_4", "start_5_3_3_5", "two_clamps_5_3_2",
    "two_clamps_5_3_2_level", "two_clamps_5_3_2_twist", "shift_7_2", "roman_6_2", "roman_plate", "moebius_6_1",
    "moebius_6_1_clamped", "moebius_6_1_straight", "moebius_narrow", "moebius_wide", "moebius_table_edge",
    "moebius_table_fallen",
)  # fmt: skip
RANDOM = 220
#: States are one where joints (l) and energies (relative, at least 1) agree to this.
SAME = 1e-9
SIZES = (40, 1000)
#: Segments on which Newton alone is measured, with the stability check.
MANY = 10000
#: Segments on which `solve` over few segments is held against the long way, and bodies that it is for.
BESIDE = 1280
NESTED = ("two clamps", "two clamps, curled", "Moebius")
#: Time (s) that `solve` has for those that neither finds at once.
BUDGET = 30.0
STRIP = Strip(1.0, 0.05, 0.4, gamma=10.0)
END = Clamp((0.1, 0.2, 0.7), (0, 0.6, 0.8), (0, 0.8, -0.6))
BODIES: dict[str, dict[str, Any]] = {
    "two clamps": {"clamp": Clamp(), "end": END},
    "two clamps, curled": {"clamp": Clamp(), "end": END, "strip": Strip(1.0, 0.05, 0.4, 8.0, 10.0)},
    "Moebius": {"clamp": None, "gravity": None, "closure": Closure("moebius")},
    "on a table": {"clamp": Clamp(), "walls": (Wall((0, -0.3, 0), (0, 1, 0)),)},
}


@dataclass(frozen=True)
class Pair:
    """Both solvers on one thing: agreement, iterations, residuals, CPU seconds; judged: how far Ipopt moves from
    Newton's state when it begins there (l)."""

    apart: float
    energy: float
    energies: tuple[float, float]
    iterations: tuple[int, int]
    residuals: tuple[float, float]
    seconds: tuple[float, float]
    judged: float

    @property
    def same(self) -> bool:
        return self.apart <= SAME and self.energy <= SAME


def _both(run: Callable[[], Equilibrium]) -> Pair:
    found, seconds = [], []
    run()  # loads the kernels
    for name in ("newton", "ipopt"):
        with choose.using(name):
            clock = time.process_time()
            found.append(run())
            seconds.append(time.process_time() - clock)
    one, other = found
    alike = one.problem.lengths.shape == other.problem.lengths.shape
    apart = float(np.abs(one.problem.joints(one.x)[0] - other.problem.joints(other.x)[0]).max()) if alike else np.inf
    energies = one.energy.total, other.energy.total
    return Pair(
        apart,
        abs(energies[0] - energies[1]) / max(1.0, abs(energies[1])),
        energies,
        (one.iterations, other.iterations),
        (one.residual, other.residual),
        (seconds[0], seconds[1]),
        _judged(one),
    )


def _judged(equilibrium: Equilibrium) -> float:
    """How far Ipopt moves the joints (l) when it begins at the state with its multipliers."""
    problem: Any = equilibrium.problem
    if not problem.row_count:
        return 0.0
    again = ipopt.minimise(problem, equilibrium.x, None, None, (equilibrium.rows, equilibrium.multipliers))
    return float(np.abs(problem.joints(again.x)[0] - problem.joints(equilibrium.x)[0]).max())


def shipped(name: str) -> dict[str, Any]:
    """A shipped scene by both."""
    scene = load(name)
    run = (lambda: run_way(scene).equilibrium) if scene.path else solver(scene)
    return _both(run).__dict__


def _energy(name: str) -> float:
    """Energy of a shipped scene's state by Newton's method."""
    with choose.using("newton"):
        return solver(load(name))().energy.total


PROBES = {
    "energy_arc_5_1": lambda: _energy("arc_5_1"),
    "energy_start_5_3_3_3": lambda: _energy("start_5_3_3_3"),
    "energy_two_clamps_5_3_2": lambda: _energy("two_clamps_5_3_2"),
}


def _is_same(v: dict[str, Any]) -> bool:
    good = max(v["residuals"]) <= RESIDUAL_TOLERANCE
    return good and v["apart"] <= SAME and v["energy"] <= SAME


def random_arguments(seed: int) -> dict[str, Any]:
    """A random glued ribbon: clamps, width, curvature, weight, energy."""
    rng = np.random.default_rng(seed)
    energy = ("sadowsky", "wunderlich", "wunderlich", "kirchhoff", "finite")[rng.integers(5)]
    thick = {"thickness": float(10 ** rng.uniform(-3.5, -2))} if energy in ("kirchhoff", "finite") else {}
    curl = tuple(rng.normal(size=2) * rng.choice([0.0, 2.0, 8.0]))
    gamma = float(rng.choice([0.0, 10 ** rng.uniform(-1, 2)]))
    strip = Strip(1.0, float(rng.uniform(0.01, 0.15)), float(rng.uniform(0.0, 0.5)), curl, gamma, **thick)
    arguments: dict[str, Any] = {"strip": strip, "energy": energy, "segments": int(rng.integers(8, 30))}
    up = rng.normal(size=3)
    arguments["gravity"] = Gravity(tuple(up / np.linalg.norm(up))) if gamma else None
    kind = rng.choice(["clamps", "clamps", "pinned", "band", "wall"])
    arguments["clamp"] = Clamp()
    if kind in ("clamps", "pinned"):
        tangent = np.array([0.0, 0.0, 1.0]) + 0.6 * rng.normal(size=3)
        tangent /= np.linalg.norm(tangent)
        normal = np.cross(tangent, rng.normal(size=3))
        normal /= np.linalg.norm(normal)
        place = rng.normal(size=3)
        place *= rng.uniform(0.3, 0.9) / np.linalg.norm(place)
        ruling = str(rng.choice(["free", "straight"]))
        ruling = "free" if energy == "kirchhoff" else ruling  # it knows no ruling
        frame = (tuple(tangent), tuple(normal)) if kind == "clamps" else (None, None)
        arguments["end"] = Clamp(tuple(place), *frame, ruling=ruling if kind == "clamps" else "free")
        if rng.uniform() < 0.3:
            arguments["held_by"] = "constraints"
    elif kind == "band":
        arguments["clamp"] = None
        arguments["closure"] = Closure(str(rng.choice(["moebius", "circle"])))
    else:
        depth = float(rng.uniform(0.1, 0.6))
        arguments["walls"] = (Wall((0.0, -depth, 0.0), (0.0, 1.0, 0.0)),)
        arguments["gravity"] = Gravity((0.0, 1.0, 0.0))
    return arguments


def randomly(seed: int) -> dict[str, Any]:
    """A random glued ribbon from a random shape by both: the first attempt of `relax.from_far`."""
    arguments = random_arguments(seed)
    problem: Any = build(**arguments, formulation="mixed")
    rng = np.random.default_rng([seed, 1])
    s = np.linspace(0.0, 1.0, problem.lengths.size + 1)
    natural = problem.strip.curvature[0] + s * (problem.strip.curvature[1] - problem.strip.curvature[0])
    bent = rng.normal() * np.sin(np.pi * s) + rng.normal() * np.cos(np.pi * s) + natural
    if problem.closure is not None:
        bent += 2.0 * np.pi
    start = problem.state(bent, 0.2 * rng.normal() * np.sin(np.pi * s))
    return _once(problem, start)


def _once(problem: Any, start: np.ndarray) -> dict[str, Any]:
    found: list[Minimum] = []
    seconds = []
    for name in ("newton", "ipopt"):
        with choose.using(name):
            clock = time.process_time()
            found.append(relax.once(problem.with_changes(), start, {"mu_init": 1e-3, "max_iter": 250}))
            seconds.append(time.process_time() - clock)
    one, other = found
    energies = problem.value(one.x), problem.value(other.x)
    again = ipopt.minimise(problem, one.x, None, None, (one.rows, one.multipliers))
    joints = [problem.joints(m.x)[0] for m in (one, other, again)]
    return Pair(
        float(np.abs(joints[0] - joints[1]).max()),
        abs(energies[0] - energies[1]) / max(1.0, abs(energies[1])),
        energies,
        (one.iterations, other.iterations),
        (one.residual, other.residual),
        (seconds[0], seconds[1]),
        float(np.abs(joints[2] - joints[0]).max()),
    ).__dict__


def sized(name: str, segments: int) -> dict[str, Any]:
    """One minimisation from the shape on few segments, by both, in turn."""
    many, start = _from_few(name, segments)
    times: dict[str, list[float]] = {"newton": [], "ipopt": []}
    for _ in range(3):
        for key, minimise in (("newton", newton_rows.minimise), ("ipopt", ipopt.minimise)):
            clock = time.process_time()
            minimum = minimise(many.with_changes(), start, {"mu_init": 1e-5})
            times[key].append(time.process_time() - clock)
            if key == "newton":
                one = minimum
            else:
                other = minimum
    apart = float(np.abs(many.joints(one.x)[0] - many.joints(other.x)[0]).max())
    seconds = {key: float(np.median(t)) for key, t in times.items()}
    return {
        "apart": apart, "iterations": (one.iterations, other.iterations), "residuals": (one.residual, other.residual),
        "codes": (one.code, other.code), "seconds": (seconds["newton"], seconds["ipopt"]),
    }  # fmt: skip


def _from_few(name: str, segments: int) -> tuple[Any, np.ndarray]:
    """A problem of many segments and the shape found on few as its start."""
    arguments = {"strip": STRIP, "gravity": Gravity((0, 1, 0)), **BODIES[name]}
    first = [arguments.pop(key) for key in ("strip", "clamp", "gravity")]
    few = solve(*first, **arguments, segments=20 if segments < 100 else 125, formulation="mixed")
    problem: Any = few.problem
    problem = problem.with_changes(touching=())
    many = problem.anchored(problem.anchor(few.x)).with_changes(lengths=np.full(segments, 1.0 / segments))
    return many, transfer.transferred(problem, few.x, many)


def alone() -> dict[str, Any]:
    """Newton and the stability check on `MANY` segments between two clamps: CPU s."""
    many, start = _from_few("two clamps", MANY)
    clock = time.process_time()
    minimum = newton_rows.minimise(many, start, {"mu_init": 1e-5})
    seconds = time.process_time() - clock
    held = reduction.tangent(many, minimum.x, minimum.multipliers, minimum.rows)
    clock = time.process_time()
    lowest, _ = SecondVariation(many, minimum.x, minimum.rows, held).lowest()
    return {
        "iterations": minimum.iterations, "residual": minimum.residual, "seconds": seconds, "lowest": lowest,
        "stability": time.process_time() - clock,
    }  # fmt: skip


def nested(name: str, segments: int) -> dict[str, Any]:
    """All of `solve`, over few segments and (not at `MANY`) all on many: CPU s, iterations, how far the last doubling
    moved the joints, how far both states are apart."""

    def run(p: int) -> tuple[Equilibrium, float]:
        arguments = {"strip": STRIP, "gravity": Gravity((0, 1, 0)), **BODIES[name]}
        first = [arguments.pop(key) for key in ("strip", "clamp", "gravity")]
        clock = time.process_time()
        found = solve(*first, **arguments, segments=p, formulation="mixed")
        return found, time.process_time() - clock

    run(4 * doubling.FEWEST)  # loads the kernels
    found, seconds = run(segments)
    few = doubling.few(found.problem).lengths.size  # type: ignore[arg-type]
    out = {
        "seconds": seconds, "few": few, "few_seconds": run(few)[1], "moved": found.moved, "residual": found.residual,
        "eigenvalue": found.lowest_eigenvalue, "stability": found.seconds["stability"],
    }  # fmt: skip
    if segments < MANY:
        requested, doubling.is_possible = doubling.is_possible, lambda *_: False
        try:
            other, out["long"] = run(segments)
        finally:
            doubling.is_possible = requested
        out["apart"] = float(np.abs(found.problem.joints(found.x)[0] - other.problem.joints(other.x)[0]).max())
    return out


def falls(arguments: dict[str, Any]) -> bool:
    """Whether nothing carries the weight, so that there is no equilibrium."""
    try:
        check.carried(build(**arguments))
    except RibbonInputError:
        return True
    return False


def solved(seed: int) -> dict[str, Any]:
    """What `solve` makes of a random ribbon from its own starts."""
    arguments = random_arguments(seed)
    first = [arguments.pop(key) for key in ("strip", "clamp", "gravity")]
    found = solve(*first, **arguments, budget=BUDGET)
    return {"status": found.status.value, "residual": found.residual, "kind": _kind(seed)}


def _kind(seed: int) -> str:
    arguments = random_arguments(seed)
    held = "a band" if "closure" in arguments else "a table" if "walls" in arguments else "two clamps"
    return f"{arguments['energy']}, {held}"


def _row(name: str, value: dict[str, Any]) -> list[str]:
    one, other = value["seconds"]
    first, second = value["iterations"]
    worst, judge = value["residuals"]
    cells = [name, f"{value['apart']:.1e}", f"{first} / {second}", f"{worst:.0e} / {judge:.0e}"]
    return [*cells, f"{one:.3g}", f"{other:.3g}", f"{other / one:.2f}"]


def _numbers(found: dict[int, dict[str, Any]], pieces: Pieces) -> dict[str, Number]:
    """What is told of scenes, random ones and many segments."""
    scenes = {name: pieces.get(name, dict) for name in SCENES}
    _, same, energy, other = _parted(found)
    missed = _missed(found)
    counts = {
        "scenes": len(SCENES), "random": len(found), "random_same": len(same), "random_other": len(other),
        "random_lower": _lower(found, other), "random_neither": len(missed),
        "no_equilibrium": sum(falls(random_arguments(seed)) for seed in missed),
    }  # fmt: skip
    numbers = {name: Number(count, 0, shown="d") for name, count in counts.items()}
    for name, v in scenes.items():
        one, judge = v["energies"]
        numbers[f"energy_{name}"] = Number(one, max(1e-8 * abs(one), 2.0 * abs(one - judge)), "D w / l", ".9g")
    for p in SIZES:
        one, judge = pieces.get(f"two clamps {p}", dict)["seconds"]
        numbers[f"ratio_{p}"] = Number(judge / one, None, shown=".2f", why=_TIME)
    long = [pieces.get(f"nested {name} {BESIDE}", dict)["apart"] for name in NESTED]
    most = pieces.get(f"nested two clamps {MANY}", dict)["seconds"]
    return numbers | {
        "apart": rounding(max(v["apart"] for v in scenes.values()), "l", ".1e"),
        "nested_apart": rounding(max(long), "l", ".1e"),
        "judged": rounding(_farthest(found, [*energy, *other]), "l", ".1e"),
        f"solve_{MANY}": Number(most, None, "s", ".2f", why=_TIME),
    }


_TIME = "CPU time of one run"


def run(folder: Path) -> dict[str, Number]:
    """Writes newton_glued.md into the folder."""
    pieces = Pieces("newton_glued")
    heads = ["", "apart (l)", "iterations", "residuals", "Newton (CPU s)", "Ipopt (CPU s)", "ratio"]
    scenes = [_row(name, pieces.get(name, lambda name=name: one_core.call(shipped, name))) for name in SCENES]
    worst = max(pieces.get(name, dict)["apart"] for name in SCENES)
    sizes = [
        _row(f"{name}, p = {p}", pieces.get(f"{name} {p}", lambda name=name, p=p: one_core.call(sized, name, p)))
        for name in BODIES
        for p in SIZES
    ]
    found = {seed: pieces.get(f"random {seed}", lambda seed=seed: randomly(seed)) for seed in range(RANDOM)}
    page.write(
        folder / "newton_glued.md",
        "Newton's iteration along the strip and Ipopt on glued ribbons",
        "python -m tests.validation newton_glued",
        "Shipped scenes, all that `solve` does, by either; apart: joints. Iterations and residuals: Newton / Ipopt.",
        page.table(["scene", *heads[1:]], scenes),
        f"{len(scenes)} scenes, apart by at most {worst:.1e} l.",
        "One minimisation from the shape on few segments:",
        page.table(["body", *heads[1:]], sizes),
        _many(pieces.get(f"{MANY} alone", alone)),
        "`solve` in all, seeds, minima, stability: over few segments, and (long) all on many; apart: joints of both; "
        "moved: joints in the last doubling.",
        page.table(
            ["body", "segments", "solve (CPU s)", "of it on few", "long (CPU s)", "apart (l)", "moved (l)", "residual"],
            [
                _nested_row(
                    name, p, pieces.get(f"nested {name} {p}", lambda name=name, p=p: one_core.call(nested, name, p))
                )
                for p in (BESIDE, MANY)
                for name in NESTED
            ],
        ),
        _words(found),
        _neither(found, pieces),
    )
    return _numbers(found, pieces)


def _nested_row(name: str, segments: int, v: dict[str, Any]) -> list[str]:
    moved = "-" if v["moved"] is None else f"{v['moved']:.1e}"
    long = [f"{v['long']:.3g}", f"{v['apart']:.1e}"] if "long" in v else ["-", "-"]
    seconds = [f"{v['seconds']:.2f}", f"{v['few_seconds']:.2f} ({v['few']})"]
    return [name, str(segments), *seconds, *long, moved, f"{v['residual']:.0e}"]


def _neither(found: dict[int, dict[str, Any]], pieces: Pieces) -> str:
    """What those are that neither converges on."""
    seeds = _missed(found)
    without = [seed for seed in seeds if falls(random_arguments(seed))]
    rest = [seed for seed in seeds if seed not in without]
    again = {seed: pieces.get(f"solve {seed}", lambda seed=seed: solved(seed)) for seed in rest}
    good = [seed for seed, v in again.items() if v["residual"] <= RESIDUAL_TOLERANCE]
    bad = [f"{seed} ({again[seed]['kind']}: {again[seed]['status']})" for seed in rest if seed not in good]
    known = "; ".join(bad)
    return (
        f"Of the {len(seeds)} on which neither converges {len(without)} have no equilibrium: bands with a weight that "
        f"nothing carries, which fall for ever (`solve` refuses them). The other {len(rest)} are one attempt from a "
        f"shape that was drawn: `solve`, from its own starts, finds {len(good)} of them"
        + (f", and not {known}." if bad else ".")
    )


def _many(v: dict[str, Any]) -> str:
    return (
        f"{MANY} segments between two clamps, Newton alone: {v['iterations']} iterations to {v['residual']:.0e} in "
        f"{v['seconds']:.2g} CPU s, {v['seconds'] / v['iterations'] / MANY * 1e6:.0f} us a segment and iteration; "
        f"stability {v['stability']:.2g} CPU s, lowest eigenvalue {v['lowest']:.6f}."
    )


def _parted(found: dict[int, dict[str, Any]]) -> tuple[dict[int, dict[str, Any]], list[int], list[int], list[int]]:
    """Where both converge; of these the same, those of the same energy, other minima."""
    good = {seed: v for seed, v in found.items() if max(v["residuals"]) <= RESIDUAL_TOLERANCE}
    same = [seed for seed, v in good.items() if _is_same(v)]
    energy = [seed for seed, v in good.items() if seed not in same and v["energy"] <= SAME]
    return good, same, energy, [seed for seed in good if seed not in same and seed not in energy]


def _lower(found: dict[int, dict[str, Any]], other: list[int]) -> int:
    """In how many of other minima Newton's is the lower."""
    return sum(found[seed]["energies"][0] < found[seed]["energies"][1] for seed in other)


def _farthest(found: dict[int, dict[str, Any]], seeds: list[int]) -> float:
    """How far Ipopt moves Newton's states."""
    return max((float(found[seed]["judged"]) for seed in seeds), default=0.0)


def _missed(found: dict[int, dict[str, Any]]) -> list[int]:
    """Those on which neither converges."""
    return [seed for seed, v in found.items() if min(v["residuals"]) > RESIDUAL_TOLERANCE]


def _words(found: dict[int, dict[str, Any]]) -> str:
    good, same, energy, other = _parted(found)
    lower, judged = _lower(found, other), _farthest(found, [*energy, *other])
    only = [
        sum(v["residuals"][k] <= RESIDUAL_TOLERANCE < v["residuals"][1 - k] for v in found.values()) for k in (0, 1)
    ]
    neither = len(_missed(found))
    ratios = [v["seconds"][1] / v["seconds"][0] for v in good.values()]
    return (
        f"{len(found)} random ones (clamps, pins, bands, tables; 8 to 29 segments; `random_arguments`): both converge "
        f"in {len(good)}, only Newton in {only[0]}, only Ipopt in {only[1]}, neither in {neither}. Of them "
        f"{len(same)} are the same to {SAME:g}; {len(energy)} more have the same energy to that (mirrored, "
        f"or rulings and motions that change nothing); {len(other)} are other minima, Newton's the lower in {lower}. "
        f"Ipopt, begun at those states of Newton's, moves them by at most {judged:.1e} l. CPU time, Ipopt over Newton, "
        f"median {np.median(ratios):.2f}."
    )
