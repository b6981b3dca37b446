"""Newton's method by the Riccati recursion against Ipopt, its judge, on chained ribbons: shipped scenes, random ones,
many segments, and batches (results/newton.md)."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_arguments, ribbon_problem
from compare.scene.scene import load, shipped
from ribbon import Clamp, Gravity, Strip, solve, solve_many
from ribbon.find import nested, relax
from ribbon.find.solve import build, starting_shapes
from ribbon.judge import stability
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import ipopt, newton
from ribbon.solvers.problem import RESIDUAL_TOLERANCE
from tests.validation import page
from tests.validation.number import Number, rounding

#: States are one where joints (l) agree to this.
SAME = 1e-9
RANDOM = 500
SIZES = (20, 80, 320, 1280, 5120, 20480, 81920)
CURLED = ("coil_40_1200", "coil_100_7500", "curl_4_3")
#: Cantilevers of a batch, their segments, and how many of them are solved one by one beside it.
BATCH, SEGMENTS, BESIDE = 10000, 40, 200
REPEATS = 5
#: Of the random ones, those that the probes try again; and the segments on which they ask for a stability.
FEW, REQUESTED = 8, 320
_TIME = "CPU time of one run"


def _chained(name: str) -> ChainedProblem | None:
    """The shipped scene as a chained problem, on its own elements or 40; None where it is held otherwise."""
    scene = load(name)
    if scene.model.energy not in ("wunderlich", "sadowsky", "kirchhoff", "finite", "extensible", "sano", "sadowsky_kt"):
        return None
    if scene.model.tolerance is not None:
        scene = scene.replace({"model.elements": 40})
    problem: Any = ribbon_problem(scene)
    if isinstance(problem, ChainedProblem):
        return problem
    plain = problem.start is not None and problem.start.is_whole and problem.end is None and problem.closure is None
    exact = problem.gravity is not None and problem.gravity.exact
    return ChainedProblem.twin(problem, problem.lengths) if plain and not problem.walls and not exact else None


def _timed(run: Callable[[], Any]) -> tuple[Any, float]:
    clock = time.process_time()
    found = run()
    return found, time.process_time() - clock


def _pair(problem: ChainedProblem, start: np.ndarray, repeats: int) -> dict[str, Any]:
    """Both from the same start, in turn; judged: how far Ipopt moves Newton's state (l)."""
    times: dict[str, list[float]] = {"newton": [], "ipopt": []}
    found: dict[str, Any] = {}
    for _ in range(repeats):
        for name, solver in (("newton", newton), ("ipopt", ipopt)):
            found[name], seconds = _timed(lambda solver=solver: solver.minimise(problem.with_changes(), start))
            times[name].append(seconds)
    one, other = found["newton"], found["ipopt"]
    again = ipopt.minimise(problem, one.x, {"mu_init": 1e-9})
    joints = [problem.joints(each.x)[0] for each in (one, other, again)]
    return {
        "apart": float(np.abs(joints[0] - joints[1]).max()),
        "judged": float(np.abs(joints[0] - joints[2]).max()),
        "iterations": (one.iterations, other.iterations),
        "residuals": (one.residual, other.residual),
        "energies": (problem.value(one.x), problem.value(other.x)),
        "seconds": tuple(statistics.median(times[name]) for name in ("newton", "ipopt")),
    }


def _scenes() -> tuple[list[list[str]], dict[str, Number]]:
    rows, ratios, steps = [], [], {}
    for name in sorted(shipped()):
        problem = _chained(name)
        if problem is None:
            continue
        given = ribbon_arguments(load(name))
        shape = next(iter(starting_shapes(problem, given["seed_curvature"], given["seed_ruling"])))
        v = _pair(problem, relax.placed(problem, *shape), REPEATS + 1)
        (a, b), (c, d), (e, f) = v["iterations"], v["residuals"], v["seconds"]
        ratios.append(f / e)
        steps[f"steps_{name}"] = Number(a, 0, shown="d")
        rows.append(
            [
                name,
                str(problem.lengths.size),
                f"{v['apart']:.1e}",
                f"{a} / {b}",
                f"{c:.0e} / {d:.0e}",
                f"{1e3 * e:.2f}",
                f"{1e3 * f:.1f}",
                f"{f / e:.1f}",
            ]
        )
    return rows, steps | {
        "ratio_least": Number(min(ratios), None, shown=".1f", why=_TIME),
        "ratio_most": Number(max(ratios), None, shown=".1f", why=_TIME),
    }


def random_problem(seed: int) -> ChainedProblem:
    """A random ribbon held at s = 0: width, curl, weight, direction, energy, end force, segments."""
    rng = np.random.default_rng(seed)
    width = 10 ** rng.uniform(-2.5, -0.6)
    curl = rng.choice([0.0, rng.uniform(-15.0, 15.0), rng.uniform(-40.0, 40.0)])
    curvature = (curl, curl if rng.random() < 0.6 else curl * rng.uniform(-1.0, 1.0))
    gamma = float(rng.choice([0.0 if curl else 5.0, 10 ** rng.uniform(0.0, 4.0)]))
    energy = str(rng.choice(["wunderlich", "wunderlich", "sadowsky", "sadowsky", "kirchhoff", "finite"]))
    thick = {"thickness": width * 10 ** rng.uniform(-2.0, -1.0)} if energy in ("kirchhoff", "finite") else {}
    up = rng.standard_normal(3)
    up = up / np.linalg.norm(up) if rng.random() < 0.7 else np.array([0.0, 0.0, 1.0])
    tip = None if rng.random() < 0.7 else rng.standard_normal(3) * 10 ** rng.uniform(0.0, 2.0)
    strip = Strip(1.0, width, rng.uniform(0.0, 0.5), curvature, gamma, **thick)
    segments = int(rng.choice([10, 20, 40, 80]))
    return build(  # type: ignore[return-value]
        strip, Clamp(), Gravity(tuple(up)), energy=energy, segments=segments, tip=tip, formulation="chained"
    )


def _random_pair(seed: int) -> dict[str, Any]:
    """A random one by both from its stress-free shape."""
    problem = random_problem(seed)
    return _pair(problem, relax.placed(problem, *next(iter(starting_shapes(problem, "natural", 0.0)))), 1)


def _same(v: dict[str, Any]) -> bool:
    return max(v["residuals"]) <= RESIDUAL_TOLERANCE and v["apart"] <= SAME


def _curled(name: str, p: int) -> Any:
    """A shipped coil on so many chained segments."""
    given = {key: value for key, value in ribbon_arguments(load(name)).items() if not key.startswith("seed")}
    return build(**{**given, "segments": p, "formulation": "chained"})


def _eigenvalue(name: str) -> float:
    """The lowest eigenvalue of its state on `REQUESTED` segments."""
    problem = _curled(name, REQUESTED)
    return stability.check(problem, nested.minimum(problem, problem.natural_state()).x).eigenvalue


PROBES = {
    "same_of_few": lambda: sum(_same(_random_pair(seed)) for seed in range(FEW)),
    "eigenvalue_coil_40_1200": lambda: _eigenvalue("coil_40_1200"),
    "eigenvalue_curl_4_3": lambda: _eigenvalue("curl_4_3"),
}


def _random() -> tuple[str, dict[str, Number]]:
    few = 0
    same, lower, higher, missed, neither, only_newton, ratios, judged, fewer = 0, 0, 0, 0, 0, 0, [], 0.0, []
    for seed in range(RANDOM):
        v = _random_pair(seed)
        few += _same(v) and seed < FEW
        good = [r <= RESIDUAL_TOLERANCE for r in v["residuals"]]
        ratios.append(v["seconds"][1] / v["seconds"][0])
        fewer.append(v["iterations"])
        if all(good):
            same += v["apart"] <= SAME
            if v["apart"] > SAME:
                judged = max(judged, v["judged"])
                lower += v["energies"][0] < v["energies"][1]
                higher += v["energies"][0] >= v["energies"][1]
        missed += good == [False, True]
        only_newton += good == [True, False]
        neither += not any(good)
    steps = np.median(fewer, axis=0)
    numbers = {
        "random": Number(RANDOM, 0, shown="d"),
        "random_same": Number(int(same), 0, shown="d"),
        "random_other": Number(int(lower + higher), 0, shown="d"),
        "judged": rounding(judged, "l", ".1e"),
        "same_of_few": Number(int(few), 0, shown="d"),
    }
    words = (
        f"{RANDOM} random ones (`random_problem`: w / l 0.003 to 0.25, |K| to 40, Gamma to 1e4, end forces to 100 D w "
        f"/ l^2, four energies, 10 to 80 segments), from the stress-free shape: {same} are the same to {SAME:g} l; "
        f"{lower + higher} are other minima, Newton's the lower in {lower}; Ipopt, begun at those states of Newton's, "
        f"moves them by at most {judged:.1e} l. Newton alone converges in {only_newton}, Ipopt alone in {missed} "
        f"(`solve` then asks Ipopt), neither in {neither}. Steps in the median {steps[0]:.0f} and {steps[1]:.0f}; CPU "
        f"time of Ipopt over Newton's: median {np.median(ratios):.1f}, mean {np.mean(ratios):.1f}."
    )
    return words, numbers


def _sizes() -> tuple[list[list[str]], dict[str, Number]]:
    rows, numbers, eigenvalues = [], {}, []
    for name in CURLED:
        for p in SIZES:
            problem = _curled(name, p)
            start = problem.natural_state()
            again = partial(nested.minimum, problem.with_changes(), start)
            runs = [_timed(again) for _ in range(1 if p > 2000 else 3)]
            found, seconds = runs[-1][0], statistics.median(run[1] for run in runs)
            check, judged = _timed(partial(stability.check, problem, found.x))
            rows.append(
                [
                    name,
                    str(p),
                    str(found.iterations),
                    f"{found.residual:.0e}",
                    f"{1e3 * seconds:.3g}",
                    f"{1e6 * seconds / p:.0f}",
                    f"{1e3 * judged:.3g}",
                    f"{check.eigenvalue:.8f}",
                    "" if found.moved is None else f"{found.moved:.1e}",
                ]
            )
            eigenvalues.append(check.eigenvalue)
            if p == REQUESTED:  # with its change from a quarter as many
                error = abs(eigenvalues[-1] - eigenvalues[-2])
                numbers[f"eigenvalue_{name}"] = Number(check.eigenvalue, error, "D w / l", ".6f")
        numbers[f"steps_{name}_{p}"] = Number(found.iterations, 0, shown="d")
        numbers[f"ms_{name}_{p}"] = Number(1e3 * seconds, None, "ms", ".3g", why=_TIME)
        numbers[f"stability_ms_{name}_{p}"] = Number(1e3 * judged, None, "ms", ".3g", why=_TIME)
    return rows, numbers


def cantilevers(count: int) -> list[Strip]:
    """Strips with weights from 1 to 1000 and natural curvatures from -2 to 2, drawn at random."""
    rng = np.random.default_rng(17)
    weights, curls = 10 ** rng.uniform(0.0, 3.0, count), rng.uniform(-2.0, 2.0, count)
    return [Strip(1.0, 0.05, gamma=g, natural_curvature=k) for g, k in zip(weights, curls, strict=True)]


def _batch() -> tuple[str, dict[str, Number]]:
    strips, up = cantilevers(BATCH), Gravity((0.6, 0.0, 0.8))
    solve_many(strips[:4], Clamp(), up, segments=SEGMENTS)
    clock = time.perf_counter()
    (many, seconds) = _timed(lambda: solve_many(strips, Clamp(), up, segments=SEGMENTS))
    wall = time.perf_counter() - clock
    singles: Sequence[int] = range(0, BATCH, BATCH // BESIDE)
    one_by_one, alone = _timed(lambda: [solve(strips[i], Clamp(), up, segments=SEGMENTS) for i in singles])
    apart = max(
        float(np.abs(found.joints[0] - many.problems[i].joints(many.x[i])[0]).max())
        for i, found in zip(singles, one_by_one, strict=True)
    )
    numbers = {
        "batch": Number(BATCH, 0, shown="d"),
        "batch_ms": Number(1e3 * seconds / BATCH, None, "ms", ".2f", why=_TIME),
        "batch_apart": rounding(apart, "l", ".1e"),
    }
    words = (
        f"{BATCH} cantilevers of {SEGMENTS} segments (`cantilevers`) by `ribbon.solve_many`: {wall:.1f} s of wall time "
        f"on two cores, {1e3 * seconds / BATCH:.2f} ms of CPU a case; {int(many.ok.sum())} are stable, "
        f"{len(many.again)} went to `solve`. {len(singles)} of them one by one: {1e3 * alone / len(singles):.2f} ms a "
        f"case, at most {apart:.1e} l away."
    )
    return words, numbers


def run(folder: Path) -> dict[str, Number]:
    """Writes newton.md into the folder."""
    (scenes, numbers), (drawn, about_random), (sizes, about_sizes), (batch, about_batch) = (
        _scenes(), _random(), _sizes(), _batch(),
    )  # fmt: skip
    heads = ["scene", "p", "apart (l)", "iterations", "residuals", "Newton (CPU ms)", "Ipopt (CPU ms)", "ratio"]
    many = [
        "scene",
        "p",
        "steps",
        "residual",
        "CPU ms",
        "us / p",
        "stability, CPU ms",
        "lowest eigenvalue",
        "moved (l)",
    ]
    page.write(
        folder / "newton.md",
        "Newton's method by the Riccati recursion and Ipopt on chained ribbons",
        "OMP_NUM_THREADS=1 python -m tests.validation newton",
        "One minimisation from the scene's own start by either, medians in turn; apart: joints. Iterations and "
        "residuals: Newton / Ipopt.",
        page.table(heads, scenes),
        drawn,
        "Nested start and stability by inertia; moved: how far the joints went in the last doubling.",
        page.table(many, sizes),
        batch,
    )
    return numbers | about_random | about_sizes | about_batch
