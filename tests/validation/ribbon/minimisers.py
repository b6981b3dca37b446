"""The minimisers of 3.5.2 on the thesis's scenes: its tables 3.1 and 3.2, with errors (thesis, 3.5.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from compare.models.ribbon.build import ribbon_clamp, ribbon_gravity
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, Gravity, Strip, refine
from ribbon.find.solve import solve_from
from ribbon.judge import stability
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.solvers import newton
from ribbon.thesis.descent import METHODS, Descent, Limits, Unbounded, ipopt_exact, ipopt_lbfgs
from tests.validation import one_core, page
from tests.validation.number import Number

SCENES = ("coil_10_100", "coil_40_1200", "coil_100_7500")
#: What table 3.2 prints, scene by scene.
THESIS = {
    "GRADDESC": ("- (> 500)", "- (> 600)", "- (> 600)"),
    "GRADDESC, unit step": ("", "", ""),
    "BFGS": ("272, 0.5 s", "506, 6.2 s", "554, 30 s"),
    "NEWTON": ("diverges", "diverges", "diverges"),
    "NEWTONC": ("- (> 500)", "- (> 500)", "- (> 500)"),
    "NEWTONR": ("14, 0.1 s", "24, 1.2 s", "46, 8.6 s"),
    "IPOPT-HESS": ("11, 0.09 s", "23, 0.9 s", "35, 5.8 s"),
    "IPOPT-L-BFGS": ("", "", ""),
    "trust-exact": ("", "", ""),
    "RICCATI": ("", "", ""),
}
THESIS_3_1 = (("IPOPT-HESS", "43", "87", "44", "43", "9.8"), ("IPOPT-L-BFGS", "> 1000", "15379", "1001", "0", "367.5"))
#: The same for all methods; 5000 steps are ten times what the thesis allowed.
LIMITS = Limits(tolerance=1e-6, steps=5000, seconds=3.0)
#: Table 3.1: its limit of steps.
LIMITS_3_1 = Limits(tolerance=1e-6, steps=1000, seconds=25.0)
FINEST = 320
#: Distance of the free ends (in l) between p and 2 p segments above which the finer solve has left the branch.
JUMP = 0.03
#: A ribbon coiled more than this (rad / l) is not evaluated: a diverging method stops there.
MOST_COILED = 1e4
#: So narrow a strip (w / l) that the references' bound on eta' is out of reach too.
NARROW = 1e-3


def _free(problem: ChainedProblem) -> Unbounded:
    """The problem without bounds, not evaluated where omega (1 + |eta|) exceeds `MOST_COILED`."""

    def admissible(x: np.ndarray) -> bool:
        q = problem.parameters(x)
        ends = q[-1, [1, 3]] + problem.lengths[-1] * q[-1, [0, 2]]
        omega = max(np.abs(q[:, 1]).max(), abs(ends[0]))
        return bool(omega * (1 + max(np.abs(q[:, 3]).max(), abs(ends[1]))) < MOST_COILED)

    return Unbounded(problem, admissible)


def _riccati(problem: ChainedProblem, start: np.ndarray) -> Descent:
    """The minimiser of `solve`: bounds kept (they are out of reach), no dense matrix, and its own, lower tolerance."""
    before = replace(problem.counters)
    m = newton.minimise(problem, start)
    counts = {
        name: getattr(problem.counters, name) - getattr(before, name) for name in ("value", "gradient", "hessian")
    }
    size = float(np.abs(problem.gradient(m.x)).max())
    word = "converged" if m.finished else m.message
    return Descent(m.x, problem.value(m.x), size, m.iterations, counts, m.finished, word, m.seconds)


@dataclass
class _Reference:
    """The branch of a minimum on p segments, refined: its free end (3,), own error (l), energy; None: branch lost."""

    energy: float
    tip: np.ndarray | None
    own_error: float
    finest_energy: float


def _refined(problem: ChainedProblem, x: np.ndarray) -> _Reference:
    current: Equilibrium = solve_from(problem, x)
    energy, error = current.energy.total, np.inf
    while current.problem.lengths.size < FINEST:
        finer = refine(current)
        step = float(np.linalg.norm(finer.end.position - current.end.position))
        if step > JUMP or not finer.ok:
            return _Reference(energy, None, np.inf, np.nan)
        current, error = finer, step / 15  # the error falls with the fourth power
    return _Reference(energy, current.end.position, error, current.energy.total)


def _tip(problem: ChainedProblem, x: np.ndarray) -> np.ndarray:
    return problem.joints(x)[0][-1]


def _problem(index: int, sign: int) -> ChainedProblem:
    """A scene of table 3.2."""
    scene: Scene = load(SCENES[index])
    strip = Strip(1.0, NARROW, scene.strip.poisson, sign * scene.curvature[0], scene.gamma)
    lengths = segment_lengths(scene.model.elements)
    return ChainedProblem(strip, ribbon_clamp(scene), ribbon_gravity(scene), "sadowsky", lengths)


def _descent(index: int, method: str) -> Descent:
    """One method on a scene, K > 0, from its natural shape."""
    problem = _problem(index, 1)
    if method == "RICCATI":
        return _riccati(problem, problem.natural_state())
    return METHODS[method](_free(problem), problem.natural_state(), LIMITS)


PROBES = {
    "steps_10_ipopt_hess": lambda: _descent(0, "IPOPT-HESS").iterations,
    "steps_10_riccati": lambda: _descent(0, "RICCATI").iterations,
    "steps_10_newtonr": lambda: _descent(0, "NEWTONR").iterations,
    "energy_10": lambda: _descent(0, "RICCATI").value,
    "energy_100": lambda: _descent(2, "RICCATI").value,
}
#: A scene's rows of table 3.2, of the table of its branches, and its numbers.
Found = tuple[list[list[str]], list[list[str]], dict[str, Number]]


def _numbers(name: str, done: list[tuple[str, Descent, float]]) -> dict[str, Number]:
    """Of what converged: steps and times; the energy of RICCATI's minimum."""
    numbers = {}
    for method, found, seconds in done:
        if found.finished:
            word = f"{name}_{method.lower().replace('-', '_')}"
            numbers[f"steps_{word}"] = Number(found.iterations, 0, shown="d")
            numbers[f"ms_{word}"] = Number(1e3 * seconds, None, "ms", ".3g", why="median CPU time of one machine")
        if method == "RICCATI":
            numbers[f"energy_{name}"] = Number(found.value, 1e-9 * abs(found.value), "D w / l", ".6f")
    return numbers


def _scene_rows(index: int, sign: int) -> Found:
    """What is found on a scene."""
    problem = _problem(index, sign)
    scene, lengths = load(SCENES[index]), problem.lengths
    k = sign * scene.curvature[0]
    free, start = _free(problem), problem.natural_state()
    METHODS["IPOPT-HESS"](free, start, LIMITS)  # loads the kernels
    done: list[tuple[str, Descent, float]] = []
    runs: dict[str, Callable[[], Descent]] = {name: partial(m, free, start, LIMITS) for name, m in METHODS.items()}
    runs["RICCATI"] = partial(_riccati, problem, start)
    _riccati(problem, start)
    for name, once in runs.items():
        found, seconds = one_core.timed(once, budget=1.0)
        done.append((name, found, seconds))
    references: list[_Reference] = []
    for _, found, _ in done:
        if found.finished and not any(abs(r.energy - found.value) < 1e-6 for r in references):
            references.append(_refined(problem, found.x))
    if not references:
        raise AssertionError(f"{scene.name}: nothing converged")
    title = f"{k:g}, {scene.gamma:g}, p = {lengths.size}"
    rows = [[title, *_cells(problem, *run, references), THESIS[run[0]][index]] for run in done]
    branches = [
        [title, "ABC"[i], f"{r.energy:.4f}", "lost" if r.tip is None else f"{r.finest_energy:.4f}"]
        for i, r in enumerate(references)
    ]
    name = f"{abs(k):.0f}" if sign > 0 else f"{abs(k):.0f}_down"
    return rows, branches, _numbers(name, done)


def _cells(
    problem: ChainedProblem, name: str, found: Descent, seconds: float, references: list[_Reference]
) -> list[str]:
    """Cells of table 3.2 from the method's name on."""
    counts = " / ".join(str(found.evaluations[key]) for key in ("value", "gradient", "hessian"))
    cells = [name, str(found.iterations), counts, f"{seconds * 1e3:.3g}"]
    if not np.isfinite(found.value):
        return [*cells, "-", "-", "-", "-", "-", found.message]
    # a point on no branch is measured against the first converged method's
    branch = next((i for i, r in enumerate(references) if abs(r.energy - found.value) < 1e-6), None)
    reference = references[branch or 0]
    error = "-"
    if reference.tip is not None:
        error = f"{np.linalg.norm(_tip(problem, found.x) - reference.tip):.2e}"
        error = f"{error} ({reference.own_error:.0e})" if branch is not None else f"[{error}]"
    lowest = stability.check(problem, found.x).eigenvalue
    return [
        *cells, f"{found.gradient_norm:.0e}", f"{found.value:.6f}", error, "-" if branch is None else "ABC"[branch],
        f"{lowest:.3f}", found.message,
    ]  # fmt: skip


def _table_3_1() -> list[list[str]]:
    """Ipopt with exact and approximated Hessian on the scene of table 3.1."""
    rows = []
    clamp = ribbon_clamp(load(SCENES[0]))
    for sign in (1, -1):
        strip = Strip.from_material(0.5, 0.005, 1e-4, 1.8e9, 2000.0, 0.5, sign * 80.0)
        problem = ChainedProblem(strip, clamp, Gravity((1.0, 0.0, 0.0)), "wunderlich", segment_lengths(20))
        ipopt_exact(problem, problem.natural_state(), LIMITS_3_1)
        methods = (
            ("IPOPT-HESS", ipopt_exact),
            ("IPOPT-L-BFGS, all vectors", ipopt_lbfgs),
            ("IPOPT-L-BFGS, 6 vectors", partial(ipopt_lbfgs, vectors=6)),
        )
        for name, method in methods:
            once = partial(method, problem, problem.natural_state(), LIMITS_3_1)
            found, seconds = one_core.timed(once, budget=1.0)
            counts = [str(found.evaluations[key]) for key in ("value", "gradient", "hessian")]
            rows.append(
                [f"{sign * 80}/m", name, str(found.iterations), *counts, f"{seconds:.3g}",
                 f"{found.gradient_norm:.0e}", f"{found.value:.4f}", found.message]
            )  # fmt: skip
    return rows


def measure() -> tuple[list[list[str]], list[list[str]], list[list[str]], dict[str, Number]]:
    """Rows of table 3.2, of its branches and of table 3.1, and the numbers, in this process."""
    scenes = [_scene_rows(i, sign) for i in range(3) for sign in (1, -1)]
    rows, branches = ([row for scene in scenes for row in scene[k]] for k in (0, 1))
    return rows, branches, _table_3_1(), {name: number for scene in scenes for name, number in scene[2].items()}


def run(out: Path) -> dict[str, Number]:
    rows, branches, rows_3_1, numbers = one_core.call(measure)
    for row in rows:
        if row[1] in ("NEWTONR", "IPOPT-HESS", "RICCATI") and row[-2] != "converged":
            raise AssertionError(f"{row[0]}: {row[1]}: {row[-2]}")
    heads = [
        "K l, Gamma", "method", "steps", "energy / gradient / Hessian", "ms", "gradient", "energy",
        "tip error / l (reference's own)", "branch", "lowest eigenvalue", "outcome", "thesis",
    ]  # fmt: skip
    heads_3_1 = [
        "K", "method", "steps", "# energy", "# gradient", "# Hessian", "s", "gradient", "energy reached", "outcome",
    ]  # fmt: skip
    page.write(
        out / "minimisers.md", "Minimisers compared (thesis, 3.5.2)", "python -m tests.validation minimisers",
        "Methods: `ribbon/thesis/descent.py`, thesis's names; trust-exact (scipy) is ours; RICCATI is the Newton "
        "method of `ribbon.solve` (`ribbon/solvers/chained_newton.py`), to its own, lower tolerance. All from the "
        "natural shape, all stop when the largest component of the gradient is below "
        f"{LIMITS.tolerance:.0e} (units D w / l), after {LIMITS.steps} steps or {LIMITS.seconds:g} s. ms: median CPU "
        "time of a warm call on one core (one call only where it takes more than a second).",
        "## Table 3.2\n\nSadowsky's energy, nu = 0.4, bounds dropped. The thesis prints K = -10, -40, -100 in the text "
        "and 10, 40, 100 in the table: two different problems, both here. Tip error: distance of the free end to the "
        f"same branch refined to {FINEST} segments, that reference's own error in brackets; it is the element's error "
        "at this p, the same for all that converge to the branch. -: no reference, cutting the segments in two leaves "
        "the branch. In square brackets: a point on no branch, measured against branch A. Branch: A, B in the order of "
        "the table. Lowest eigenvalue: of the Hessian in the metric of `ribbon.judge.stability`; negative: no minimum. "
        "The thesis's steps and times (its machine, its code) stand for scale. Where IPOPT-L-BFGS ends above its start "
        "(-5053.3 at K = -100), Ipopt itself accepted steps that climb: the energy falls for some hundred steps, "
        "jumps, and stays.",
        page.table(heads, rows),
        f"The branches, refined to {FINEST} segments; lost: a cut moved the free end by more than {JUMP} l.",
        page.table(["K l, Gamma", "branch", "energy at p", f"energy at {FINEST}"], branches),
        "## Table 3.1\n\nl = 50 cm, w = 5 mm, h = 0.1 mm, rho = 2000 kg/m^3, Y = 1.8 GPa, nu = 0.5, K = 80/m, with "
        "the bounds. INFERRED, not in the caption: Wunderlich's energy, 20 segments, the clamp of 3.5.2 for 'an angle "
        "of pi/4 to the vertical', the sign of K (both here). L-BFGS with as many vectors as there are unknowns (the "
        f"thesis's footnote 8), and with Ipopt's usual 6; at most {LIMITS_3_1.steps} steps, as there, and "
        f"{LIMITS_3_1.seconds:g} s.",
        page.table(heads_3_1, rows_3_1),
        page.table(["thesis", "steps", "# energy", "# gradient", "# Hessian", "s"], THESIS_3_1),
    )  # fmt: skip
    return numbers
