"""Chained, mixed and matrix formulation on the scenes of 5.3: figures 5.2 and 5.4, orders of convergence, cost."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import load
from ribbon import Equilibrium, refine, solve
from ribbon.find import relax
from ribbon.find.solve import build, solve_from, solve_shape, starting_shapes
from ribbon.find.solving import start
from ribbon.judge import stability
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import choose, ipopt, newton, newton_rows
from ribbon.solvers.problem import RESIDUAL_TOLERANCE
from ribbon.surface import surface
from ribbon.thesis.chained_clamped import ChainedClampedProblem
from ribbon.thesis.matrix import MatrixProblem
from tests.validation import one_core, page
from tests.validation.number import Number

HANGING, ARC, CURL = "hanging_5_3_1", "arc_5_1", "curl_4_3"
ENERGIES = ("sadowsky", "wunderlich")
#: Segments on which each formulation is timed (figure 5.2 has 10, 20, 40 and 100).
TIMED = {
    "chained": (5, 10, 20, 40, 100, 200, 400),
    "mixed": (5, 10, 20, 40, 100, 200, 400, 1000, 3000, 10000),
    "matrix": (5, 10, 20, 40, 100, 200, 400, 1000),
}
#: The same problems by Newton's methods of `ribbon.solvers`, which `solve` takes.
BY_NEWTON: dict[str, tuple[str, Any, tuple[int, ...]]] = {
    "chained, Newton": ("chained", newton, (*TIMED["chained"], 1000, 3000, 10000)),
    "mixed, Newton": ("mixed", newton_rows, TIMED["mixed"]),
}
BY_IPOPT: dict[str, tuple[str, Any, tuple[int, ...]]] = {name: (name, ipopt, counts) for name, counts in TIMED.items()}
ALONE = "mixed (bare)"
#: CPU s at most of one of its solves: where it runs away it would take minutes to 1000 iterations.
ALONE_SECONDS = 8.0
#: Slopes are fitted from this p on.
LARGE = {"chained": 100, "mixed": 400, "matrix": 100, "chained, Newton": 400, "mixed, Newton": 400}
CROSSING = (50, 70, 100, 140, 200, 280)
#: Readings of 5.3.2: letter, scene, segments.
CLAMPED: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    ("A", "two_clamps_5_3_2", (10, 20, 40, 100)),
    ("B", "two_clamps_5_3_2_level", (10, 20, 40)),
    ("C", "two_clamps_5_3_2_twist", (10, 20, 40, 100)),
)
ORDERS = (5, 10, 20, 40, 80, 160)
FINEST = 1280
COSTS = {
    "chained": (10, 30, 100, 300, 1000), "mixed": (10, 30, 100, 300, 1000, 3000, 10000),
    "matrix": (10, 30, 100, 300, 1000, 3000, 10000),
}  # fmt: skip


def _arguments(name: str, **keys: Any) -> dict[str, Any]:
    return ribbon_arguments(load(name).replace({f"model.{key}": value for key, value in keys.items()}))


def _bare(arguments: dict[str, Any]) -> tuple[Any, np.ndarray]:
    """The problem itself in the formulation asked for, and its unknowns of the scene's seed as it is given: `solve`
    brings it between the clamps first."""
    given = dict(arguments)
    curvature, ruling = given.pop("seed_curvature"), given.pop("seed_ruling")
    problem = build(given.pop("strip"), given.pop("clamp"), given.pop("gravity"), **given)
    if isinstance(curvature, str):
        omega, eta = next(iter(starting_shapes(problem, curvature, ruling)))
    else:
        omega, eta = start.given(problem, curvature, ruling)
    if not isinstance(problem, MixedProblem):
        return problem, problem.state(omega, eta)
    if problem.model == "matrix":
        twin = MatrixProblem(
            problem.strip, problem.start, problem.end, problem.closure, problem.walls, problem.gravity, problem.energy,
            problem.lengths,
        )  # fmt: skip
        return twin, twin.state(omega, eta)
    return problem, relax.placed(problem, omega, eta)


def _from_the_seed(arguments: dict[str, Any]) -> Equilibrium:
    """The state from the scene's seed as it is given."""
    seed = arguments["seed_curvature"], arguments["seed_ruling"]
    keys = {key: value for key, value in arguments.items() if not key.startswith("seed_")}
    problem = build(keys.pop("strip"), keys.pop("clamp"), keys.pop("gravity"), **keys)
    return solve_from(problem, relax.placed(problem, *start.given(problem, *seed)))


@dataclass
class Timed:
    """One minimisation: formulation, energy, segments, iterations, CPU s, residual, energy at the end."""

    formulation: str
    energy: str
    segments: int
    iterations: int
    seconds: float
    residual: float
    value: float


def _hanging(formulation: str, energy: str, p: int) -> tuple[int, float]:
    """Iterations of Ipopt on the hanging scene from the thesis's seed, and the energy that it reaches."""
    problem, x = _bare(_arguments(HANGING, energy=energy, formulation=formulation, elements=p))
    minimum = ipopt.minimise(problem, x)
    return minimum.iterations, problem.value(minimum.x)


PROBES = {
    "energy_mixed_wunderlich_20": lambda: _hanging("mixed", "wunderlich", 20)[1],
    "energy_chained_sadowsky_20": lambda: _hanging("chained", "sadowsky", 20)[1],
    "iterations_chained_sadowsky_20": lambda: _hanging("chained", "sadowsky", 20)[0],
    "iterations_matrix_sadowsky_20": lambda: _hanging("matrix", "sadowsky", 20)[0],
}
_TIME = "median CPU time of one machine"


def hanging() -> list[Timed]:
    """One minimisation each from the thesis's seed: Ipopt with the same options, and Newton's methods."""
    found = []
    for energy in ENERGIES:
        for name, (formulation, solver, counts) in {**BY_IPOPT, **BY_NEWTON}.items():
            for p in counts:
                problem, x = _bare(_arguments(HANGING, energy=energy, formulation=formulation, elements=p))
                once = partial(solver.minimise, problem, x)
                if p == counts[0]:
                    once()  # loads the kernels
                m, seconds = one_core.timed(once, budget=1.0)
                value = problem.value(m.x)
                found.append(Timed(name, energy, p, m.iterations, seconds, m.residual, value))
    return found


def crossing(solver: str) -> dict[str, list[tuple[int, float, float]]]:
    """Of a whole `solve`, its stability check included: segments, CPU s chained, CPU s mixed."""
    out: dict[str, list[tuple[int, float, float]]] = {}
    for name in (HANGING, CURL):
        out[name] = []
        for p in CROSSING:
            seconds = []
            for formulation in ("chained", "mixed"):
                arguments = _arguments(name, elements=p, formulation=formulation)
                arguments["segments"] = p  # equal ones
                found, spent = one_core.timed(partial(solve, solver=solver, **arguments), budget=1.0)
                if not found.ok:
                    raise AssertionError(f"{name}, {formulation}, p = {p}: {found.message}")
                seconds.append(spent)
            out[name].append((p, seconds[0], seconds[1]))
    return out


def crossing_point(rows: list[tuple[int, float, float]]) -> float:
    """Number of segments from which mixed stays faster, linear in the logarithms."""
    p, chained, mixed = np.array(rows).T
    gain = np.log(chained / mixed)
    slower = np.nonzero(gain < 0)[0]
    if slower.size == 0 or slower[-1] == p.size - 1:
        raise AssertionError("chained and mixed do not cross in the range")
    i = int(slower[-1])
    return float(np.exp(np.interp(0.0, gain[i : i + 2], np.log(p[i : i + 2]))))


@dataclass
class Clamped:
    """One solve between two clamps."""

    reading: str
    formulation: str
    energy: str
    segments: int
    status: str
    message: str
    iterations: int
    seconds: float
    residual: float
    value: float
    eta: float


def _alone(reading: str, name: str, energy: str, p: int) -> Clamped:
    """The mixed model by Ipopt with the options of the others."""
    problem, x = _bare(_arguments(name, energy=energy, formulation="mixed", elements=p))
    clock = time.process_time()
    m = ipopt.minimise(problem, x, {"max_cpu_time": ALONE_SECONDS})
    status = "not_converged"
    if m.residual < RESIDUAL_TOLERANCE:
        stable = stability.check_mixed(problem, m.x, m.multipliers, m.rows).stable
        status = "converged" if stable else "saddle"
    seconds = time.process_time() - clock
    eta = float(np.abs(m.x[problem.layout.eta]).max())
    text = "solved" if m.finished else m.message
    return Clamped(
        reading, ALONE, energy, p, status, text, m.iterations, seconds, m.residual, problem.value(m.x), eta
    )  # fmt: skip


def clamped() -> list[Clamped]:
    """All formulations by Ipopt from the thesis's almost flat seed; at most 1000 iterations, as there."""
    with choose.using("ipopt"):
        return _clamped()


def _clamped() -> list[Clamped]:
    found = []
    for formulation in ("chained", "mixed", "matrix"):  # loads the kernels
        solve(**_arguments("two_clamps_5_3_2", formulation=formulation, elements=4), options={"max_iter": 20})
    for reading, name, counts in CLAMPED:
        for energy in ENERGIES:
            for p in counts:
                for formulation in ("chained", "mixed", "matrix"):
                    arguments = _arguments(name, energy=energy, formulation=formulation, elements=p)
                    clock = time.process_time()
                    e = solve(**arguments) if formulation == "mixed" else _from_the_seed(arguments)
                    seconds = time.process_time() - clock
                    text = e.message.partition("(Ipopt: ")[2].rstrip(")") or "solved"
                    found.append(
                        Clamped(reading, formulation, energy, p, e.status.name.lower(), text, e.iterations, seconds,
                                e.residual, e.energy.total, e.max_abs_eta)
                    )  # fmt: skip
                found.append(_alone(reading, name, energy, p))
    return found


@dataclass
class Order:
    """Errors against p: by quantity, (p,) each."""

    scene: str
    energy: str
    formulation: str
    errors: dict[str, list[float]] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)

    def slope(self, name: str) -> float:
        """Order in 1/p, fitted over the last four p with an error above rounding."""
        p, e = np.array(ORDERS, dtype=float), np.array(self.errors[name])
        use = np.nonzero(e > 3e-11)[0][-4:]
        return -float(np.polyfit(np.log(p[use]), np.log(e[use]), 1)[0]) if use.size > 2 else float("nan")


def _chained_between_clamps(e: Equilibrium) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Grid, middle (3,), energy and force of the end of the chained model's own minimum next to `e`."""
    problem: Any = e.problem
    chained = ChainedClampedProblem(
        problem.strip, problem.start, problem.end, problem.gravity, problem.energy, problem.lengths
    )
    x = np.empty(chained.size)
    omega, eta = problem.joint_values(e.x)
    x[0], x[1] = omega[0], eta[0]
    x[2::2], x[3::2] = np.diff(omega) / problem.lengths, np.diff(eta) / problem.lengths
    # from a point off the solution, so that it has to find it
    minimum = ipopt.minimise(chained, x * 1.001, {"mu_init": 1e-6, "tol": 1e-11})
    if minimum.residual > RESIDUAL_TOLERANCE or chained.flipped(minimum.x):
        raise AssertionError(f"chained, p = {problem.lengths.size}: {minimum.message}")
    points, frames = chained.joints(minimum.x)
    q = chained.parameters(minimum.x)
    grid = surface(
        q, problem.lengths, points, frames, chained.exponent_limit, problem.strip.relative_width, 80, 4
    ).points  # fmt: skip
    middle = grid.reshape(81, 5, 3)[40, 2]
    return grid, middle, chained.value(minimum.x), -minimum.rows[chained.block_slices()["end_position"]]


@cache
def _finest(name: str, energy: str) -> Equilibrium:
    """The scene on `FINEST` segments, by cutting segments in two."""
    fine = solve(**_arguments(name, energy=energy, elements=40, formulation="mixed"))
    while fine.problem.lengths.size < FINEST:
        fine = refine(fine, options={"tol": 1e-11}, check=False)
    return fine


def orders() -> list[Order]:
    """Errors of both models on both scenes with both energies, each against the same branch on `FINEST` segments."""
    out = []
    for name in (ARC, HANGING):
        for energy in ENERGIES:
            fine = _finest(name, energy)
            held = fine.end_support is not None
            measured = {form: Order(name, energy, form) for form in ("chained", "mixed")}
            exact = _quantities(fine, held)
            for p in ORDERS:
                given = _arguments(name, energy=energy, elements=p, formulation="mixed")
                del given["seed_curvature"], given["seed_ruling"]
                for form in ("chained", "mixed"):
                    problem = build(**{**given, "formulation": form if not held else "mixed"})
                    s = np.concatenate([[0.0], np.cumsum(problem.lengths)]).clip(0.0, 1.0)
                    e = solve_shape(problem, fine.omega(s), fine.eta(s), options={"tol": 1e-11})
                    if not e.ok:
                        raise AssertionError(f"{name}, {energy}, {form}, p = {p}: {e.message}")
                    values = _quantities(e, held)
                    if held and form == "chained":
                        values = _named(_chained_between_clamps(e), held)
                    for key, value in values.items():
                        difference = np.atleast_2d(value - exact[key])
                        size = float(np.linalg.norm(difference, axis=1).max())
                        measured[form].errors.setdefault(key, []).append(size)
            out += measured.values()
    return out


def _quantities(e: Equilibrium, held: bool) -> dict[str, Any]:
    grid = e.surface(80, 4).points
    if held:
        assert e.end_support is not None
        return _named((grid, e.middle.position, e.energy.total, e.end_support.force), held)
    return _named((grid, e.end.position, e.energy.total, e.start.moment), held)


def _named(values: tuple[Any, ...], held: bool) -> dict[str, Any]:
    names = ("surface", "middle", "energy", "force") if held else ("surface", "end", "energy", "moment")
    return dict(zip(names, values, strict=True))


def work() -> dict[tuple[str, str], list[tuple[int, float, float]]]:
    """(energy, formulation) -> segments, CPU s of a warm `solve` on the hanging scene, error of its surface / l."""
    out: dict[tuple[str, str], list[tuple[int, float, float]]] = {}
    for energy in ENERGIES:
        exact = _finest(HANGING, energy).surface(80, 4).points
        for formulation in ("chained", "mixed"):
            rows = []
            for p in (2, 3, 5, 10, 20, 40, 80, 160):
                arguments = _arguments(HANGING, energy=energy, elements=p, formulation=formulation)
                e, seconds = one_core.timed(partial(solve, **arguments), budget=0.5)
                rows.append((p, seconds, float(np.linalg.norm(e.surface(80, 4).points - exact, axis=1).max())))
            out[energy, formulation] = rows
    return out


def accuracy() -> tuple[list[Order], dict[tuple[str, str], list[tuple[int, float, float]]]]:
    """Both measurements that need the finest solves."""
    return orders(), work()


def _per_call(once: Callable[[int], object]) -> float:
    """CPU s of one call, over as many as fill 0.03 s; the argument alternates between 0 and 1."""
    once(0)
    once(1)
    best = np.inf
    for _ in range(3):
        calls, clock = 0, time.process_time()
        while (spent := time.process_time() - clock) < 0.03 or calls < 2:
            once(calls % 2)
            calls += 1
        best = min(best, spent / calls)
    return best


def costs() -> dict[str, list[tuple[int, list[float]]]]:
    """Formulation -> segments, CPU s of: value and rows; gradient; Jacobian; Hessian; all five at one new point."""
    out: dict[str, list[tuple[int, list[float]]]] = {}
    for formulation, counts in COSTS.items():
        out[formulation] = []
        for p in counts:
            problem, x = _bare(_arguments(HANGING, formulation=formulation, elements=p))
            points = (x + 1e-3, x + 1.001e-3)
            mixed = problem.rows is not None
            rows = np.full(problem.constraint_bounds()[0].size, 0.1) if mixed else None

            def value(k: int, problem=problem, points=points, mixed=mixed) -> None:
                problem.value(points[k])
                if mixed:
                    problem.constraints(points[k])

            def gradient(k: int, problem=problem, points=points) -> None:
                problem.gradient(points[k])

            def jacobian(k: int, problem=problem, points=points) -> None:
                problem.jacobian(points[k])

            def hessian(k: int, problem=problem, points=points, rows=rows) -> None:
                problem.hessian(points[k], *(() if rows is None else (rows,)))

            def everything(k: int, parts=(value, gradient, hessian), more=jacobian, mixed=mixed) -> None:
                for part in parts:
                    part(k)
                if mixed:
                    more(k)

            seconds = [
                _per_call(value), _per_call(gradient), _per_call(jacobian) if mixed else 0.0, _per_call(hessian),
                _per_call(everything),
            ]  # fmt: skip
            out[formulation].append((p, seconds))
    return out


def _slope(rows: list[Timed]) -> float:
    p, t = np.array([(r.segments, r.seconds) for r in rows]).T
    return float(np.polyfit(np.log(p), np.log(t), 1)[0])


def _timed_table(rows: list[Timed]) -> str:
    lines = []
    names = (*BY_IPOPT, *BY_NEWTON)
    for energy in ENERGIES:
        for p in TIMED["mixed"]:
            cells = [energy, str(p)]
            for formulation in names:
                r = [r for r in rows if (r.energy, r.formulation, r.segments) == (energy, formulation, p)]
                cells += [str(r[0].iterations), f"{r[0].seconds * 1e3:.3g}"] if r else ["", ""]
            value = next(r.value for r in rows if (r.energy, r.formulation, r.segments) == (energy, "mixed", p))
            lines.append([*cells, f"{value:.9f}"])
    heads = ["energy", "p", *(f"{f}: {what}" for f in names for what in ("iterations", "ms")), "energy at the end"]
    return page.table(heads, lines)


def _slopes_table(rows: list[Timed]) -> str:
    lines = []
    for formulation, least in LARGE.items():
        cells = [formulation, f"{least} to {({**BY_IPOPT, **BY_NEWTON})[formulation][2][-1]}"]
        for energy in ENERGIES:
            use = [r for r in rows if (r.formulation, r.energy) == (formulation, energy) and r.segments >= least]
            each = [Timed(**{**r.__dict__, "seconds": r.seconds / r.iterations}) for r in use]
            cells += [f"{_slope(use):.2f}", f"{_slope(each):.2f}"]
        lines.append(cells)
    heads = ["formulation", "p", *(f"{e}: {what}" for e in ENERGIES for what in ("whole solve", "one iteration"))]
    return page.table(heads, lines)


def _short(message: str) -> str:
    """Ipopt's message without its explanations."""
    first = message.partition(".")[0].partition(",")[0].partition("(")[0].strip()
    return "solved" if first.startswith("Algorithm terminated successfully") else first


def _clamped_table(rows: list[Clamped]) -> str:
    lines = []
    for r in rows:
        good = r.residual < RESIDUAL_TOLERANCE
        lines.append([
            r.reading, r.energy, r.formulation, str(r.segments), r.status, _short(r.message),
            str(r.iterations), f"{r.seconds:.2g}", f"{r.residual:.0e}", f"{r.value:.5f}" if good else "-",
            f"{r.eta:.2f}" if good else "-",
        ])  # fmt: skip
    heads = [
        "reading", "energy", "formulation", "p", "status", "Ipopt says", "iterations", "s", "residual", "energy",
        "largest abs(eta)",
    ]  # fmt: skip
    return page.table(heads, lines)


def _orders_table(found: list[Order]) -> str:
    lines = []
    for o in found:
        for key, errors in o.errors.items():
            lines.append([o.scene, o.energy, o.formulation, key, *(f"{v:.1e}" for v in errors), f"{o.slope(key):.2f}"])
    return page.table(["scene", "energy", "formulation", "error of", *(f"p = {p}" for p in ORDERS), "order"], lines)


def _costs_table(found: dict[str, list[tuple[int, list[float]]]]) -> str:
    lines = []
    for formulation, rows in found.items():
        for p, seconds in rows:
            cells = [f"{v / p * 1e6:.2f}" if v else "-" for v in seconds]
            lines.append([formulation, str(p), *cells, f"{seconds[-1] * 1e3:.3g}"])
    heads = ["formulation", "p", "value, rows", "gradient", "Jacobian", "Hessian", "all at one point", "all, ms"]
    return page.table(heads, lines)


def _work_table(found: dict[tuple[str, str], list[tuple[int, float, float]]]) -> str:
    lines = []
    for (energy, formulation), rows in found.items():
        lines.append([energy, formulation, *(f"{seconds * 1e3:.3g} ms, {error:.0e}" for _, seconds, error in rows)])
    return page.table(["energy", "formulation", *(f"p = {row[0]}" for row in next(iter(found.values())))], lines)


COLOURS = {
    "chained": "tab:red", "mixed": "tab:blue", "matrix": "0.5", "chained, Newton": "tab:orange",
    "mixed, Newton": "tab:cyan",
}  # fmt: skip
STYLES = {"sadowsky": ("o", "--"), "wunderlich": ("s", "-")}


def _picture(
    timed: list[Timed],
    order: list[Order],
    worked: dict[tuple[str, str], list[tuple[int, float, float]]],
    cost: dict[str, list[tuple[int, list[float]]]],
    path: Path,
) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(12, 9.5), constrained_layout=True)
    for energy in ENERGIES:
        marker, line = STYLES[energy]
        for formulation, colour in COLOURS.items():
            rows = [r for r in timed if (r.energy, r.formulation) == (energy, formulation)]
            axes[0, 0].loglog(
                [r.segments for r in rows], [r.seconds for r in rows], line, marker=marker, color=colour, ms=4,
                label=f"{formulation}, {energy}",
            )  # fmt: skip
    p = np.array([60.0, 400.0])
    axes[0, 0].loglog(p, 0.0015 * (p / 60) ** 3, "k:", lw=1)
    axes[0, 0].annotate("p$^3$", (260, 0.05))
    p = np.array([600.0, 10000.0])
    axes[0, 0].loglog(p, 0.06 * p / 600, "k:", lw=1)
    axes[0, 0].annotate("p", (3000, 0.18))
    axes[0, 0].set(
        title="Hanging strip, 5.3.1 (figure 5.2)", xlabel="segments p", ylabel="CPU time of one minimisation / s"
    )
    shown = {("arc_5_1", "surface"): "arc", ("hanging_5_3_1", "surface"): "hanging"}
    for o in order:
        if o.formulation != "mixed":
            continue
        marker, line = STYLES[o.energy]
        colour = "tab:green" if o.scene == ARC else "tab:purple"
        label = f"{shown[o.scene, 'surface']}, {o.energy}"
        axes[0, 1].loglog(ORDERS, o.errors["surface"], line, marker=marker, color=colour, ms=4, label=label)
    p = np.array([10.0, 160.0])
    axes[0, 1].loglog(p, 3e-4 * (p / 10) ** -2, "k:", lw=1)
    axes[0, 1].annotate("p$^{-2}$", (80, 8e-6))
    p = np.array([10.0, 80.0])
    axes[0, 1].loglog(p, 2e-7 * (p / 10) ** -4, "k:", lw=1)
    axes[0, 1].annotate("p$^{-4}$", (18, 3e-9))
    axes[0, 1].set(title="Largest error of the surface (chained: the same)", xlabel="segments p", ylabel="error / l")
    for (energy, formulation), rows in worked.items():
        marker, line = STYLES[energy]
        axes[1, 0].loglog(
            [r[1] for r in rows], [r[2] for r in rows], line, marker=marker, color=COLOURS[f"{formulation}, Newton"],
            ms=4, label=f"{formulation}, {energy}",
        )  # fmt: skip
    axes[1, 0].set(
        title="Hanging strip: work and precision (p = 2 to 160)", xlabel="CPU time of solve / s",
        ylabel="error of the surface / l",
    )  # fmt: skip
    for formulation, rows in cost.items():
        axes[1, 1].semilogx(
            [p for p, _ in rows], [s[-1] / p * 1e6 for p, s in rows], "s-", color=COLOURS[formulation], ms=4,
            label=formulation,
        )  # fmt: skip
    axes[1, 1].set(
        title="Value, gradient, rows, Jacobian and Hessian at one point", xlabel="segments p",
        ylabel="CPU time per segment / microseconds", ylim=(0.0, 7.0),
    )  # fmt: skip
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _check(timed: list[Timed], order: list[Order], two: list[Clamped]) -> None:
    for r in timed:
        if r.residual > RESIDUAL_TOLERANCE:
            raise AssertionError(f"{r.formulation}, {r.energy}, p = {r.segments}: residual {r.residual:.1e}")
    for r in two:
        if r.formulation == "mixed" and r.status != "converged":
            raise AssertionError(f"mixed between clamps, {r.reading}, {r.energy}, p = {r.segments}: {r.status}")
    for o in order:
        if o.slope("energy") < 1.7:
            raise AssertionError(f"{o.scene}, {o.energy}, {o.formulation}: order {o.slope('energy'):.2f} of the energy")


def _minima(rows: list[Clamped]) -> str:
    """The stable states found on each reading with each p, by energy."""
    lines = []
    for reading, _, counts in CLAMPED:
        for p in counts:
            cells = [reading, str(p)]
            for energy in ENERGIES:
                good = [r for r in rows if (r.reading, r.segments, r.energy) == (reading, p, energy)]
                found: dict[str, list[str]] = {}
                for r in good:
                    if r.status == "converged":
                        found.setdefault(f"{r.value:.4f}", []).append(r.formulation)
                ordered = sorted(found.items(), key=lambda item: float(item[0]))
                cells.append("; ".join(f"{value} ({', '.join(who)})" for value, who in ordered))
            lines.append(cells)
    return page.table(["reading", "p", *ENERGIES], lines)


def _of_hanging(timed: list[Timed]) -> dict[str, Number]:
    """On 20 segments: iterations by Ipopt and energies, which the formulations agree on to what is their error; the
    longest chained one by Newton's method."""
    numbers = {}
    for energy in ENERGIES:
        these = {r.formulation: r for r in timed if (r.energy, r.segments) == (energy, 20) and r.formulation in TIMED}
        values = [r.value for r in these.values()]
        error = max(max(values) - min(values), 1e-9 * abs(values[0]))
        for name, r in these.items():
            numbers[f"energy_{name}_{energy}_20"] = Number(r.value, error, "D w / l", ".9f")
            numbers[f"iterations_{name}_{energy}_20"] = Number(r.iterations, 0, shown="d")
    longest = max((r for r in timed if r.formulation == "chained, Newton"), key=lambda r: (r.segments, r.energy))
    return numbers | {"newton_ms_10000": Number(1e3 * longest.seconds, None, "ms", ".3g", why=_TIME)}


def _of_orders(found: list[Order]) -> dict[str, Number]:
    """Orders of the energy in the mixed model by scene and energy, where they can be fitted: over the last four p, with
    the change that leaving out the first of them makes."""
    numbers = {}
    for o in found:
        if o.formulation != "mixed":
            continue
        p, e = np.array(ORDERS, dtype=float), np.array(o.errors["energy"])
        use = np.nonzero(e > 3e-11)[0][-4:]
        if use.size > 2:
            order, later = (-float(np.polyfit(np.log(p[k]), np.log(e[k]), 1)[0]) for k in (use, use[1:]))
            numbers[f"order_{o.scene}_{o.energy}"] = Number(order, abs(order - later), shown=".2f")
    return numbers


def _numbers(
    crossed: dict[str, float], faster: list[float], solved: dict[str, int], each: int,
    cost: dict[str, list[tuple[int, list[float]]]],
) -> dict[str, Number]:  # fmt: skip
    """Crossings and ratios of times, stable equilibria between two clamps, cost of a segment."""
    per = {p: seconds[-1] / p * 1e6 for p, seconds in cost["mixed"]}
    words = {name: name.replace(" (", "_").rstrip(")") for name in solved}
    return {
        **{f"crossing_{name}": Number(p, None, "", ".0f", why=_TIME) for name, p in crossed.items()},
        "faster_least": Number(min(faster), None, "", ".1f", why=_TIME),
        "faster_most": Number(max(faster), None, "", ".1f", why=_TIME),
        **{f"solved_{words[name]}": Number(count, 0, shown="d") for name, count in solved.items()},
        "clamped": Number(each, 0, shown="d"),
        **{f"cost_{p}": Number(value, None, "us", ".2f", why=_TIME) for p, value in per.items()},
    }


def run(out: Path) -> dict[str, Number]:
    timed = one_core.call(hanging)
    crossed, quick = one_core.call(crossing, "ipopt"), one_core.call(crossing, "newton")
    two = one_core.call(clamped)
    order, worked = one_core.call(accuracy)
    cost = one_core.call(costs)
    _check(timed, order, two)
    _picture(timed, order, worked, cost, out / "formulations.png")
    points = {name: crossing_point(rows) for name, rows in crossed.items()}
    lines = [
        [name, *(f"{a * 1e3:.3g} / {b * 1e3:.3g}" for _, a, b in rows), f"{points[name]:.0f}"]
        for name, rows in crossed.items()
    ]
    gains = [[name, *(f"{a * 1e3:.3g} / {b * 1e3:.3g}" for _, a, b in rows)] for name, rows in quick.items()]
    faster = [b / a for rows in quick.values() for _, a, b in rows]
    solved = {f: sum(r.status == "converged" for r in two if r.formulation == f) for f in (*TIMED, ALONE)}
    each = len(two) // 4
    level = [r.status == "converged" for r in two if (r.reading, r.formulation) == ("B", "chained")]
    page.write(
        out / "formulations.md", "Chained, mixed and matrix formulation (thesis, 5.3)",
        "python -m tests.validation formulations",
        "Times are CPU times on one core, warm (kernels loaded, one BLAS thread), medians. chained: 2 p + 2 unknowns, "
        "dense. mixed: this project's, 10 p + 9 unknowns in quaternions. matrix: the thesis's mixed model, 16 p "
        "unknowns. All use Ipopt with exact derivatives and the same options, as the thesis does; where it says "
        "Newton, the methods that `solve` takes by itself ([newton](newton.md), [newton_glued](newton_glued.md)).",
        "![time, order, work and precision, cost](formulations.png)",
        "## Held at s = 0 only: figure 5.2\n\nScene hanging_5_3_1 from the thesis's seed, one minimisation (no coarse "
        "start, no stability check). All reach the same state: the last column is the mixed model's.",
        _timed_table(timed),
        "Slopes of log time against log p. The thesis draws 3 (chained) and 1 (mixed).",
        _slopes_table(timed),
        "## Where mixed gets faster than chained\n\nBy Ipopt, a whole `ribbon.solve`, its stability check included "
        "(the same for both), ms chained / ms mixed on equal segments; the mixed model starts from a chained solve on "
        "100 segments at most when there are more than 100. Last column: segments from which mixed stays faster. "
        "The thesis finds 20 to 40.",
        page.table(["scene", *(f"p = {p}" for p in CROSSING), "crossing"], lines),
        f"By Newton's methods they do not cross: mixed over chained is {min(faster):.1f} to {max(faster):.1f}.",
        page.table(["scene", *(f"p = {p}" for p in CROSSING)], gains),
        "## Two clamps: figure 5.4\n\nFrom the thesis's almost flat seed, at most 1000 iterations an attempt, as "
        "there. The geometry is not given. A: scene two_clamps_5_3_2, tangents vertical and horizontal, the line "
        "between the clamps at 45 degrees. B: two_clamps_5_3_2_level, the same tangents, the end level with the "
        f"start: here the chained model finds a stable state in {level.count(True)} of {len(level)} runs (the thesis: "
        "none; with Sadowsky's energy after 1000 iterations, with Wunderlich's by a failed restoration). C: "
        "two_clamps_5_3_2_twist, the width vertical, then horizontal. chained and matrix begin at the seed as it is; "
        "mixed is `ribbon.solve` by Ipopt (the seed brought between the clamps, box on eta, several barriers, a coarse "
        f"start above 40 segments); mixed (bare) is Ipopt on its own from the seed as it is, with the "
        f"options that chained and matrix get, {ALONE_SECONDS:g} s of CPU time at most. `flipped`: the rows hold, "
        "but in a frame turned over (thesis, 5.1), or Ipopt stopped in one. The mixed model's rows of quaternions "
        "have no flipped frames. s: one run, stability check included. Stable, unflipped equilibria: chained "
        f"{solved['chained']} of {each}, mixed {solved['mixed']}, {ALONE} {solved[ALONE]}, matrix "
        f"{solved['matrix']}.",
        _clamped_table(two),
        "Energies of the stable states that were found: on A and B all find the same. On C the discrete problem "
        "has many minima: facets whose number and place depend on p, at energies that differ by a few per cent, "
        "and, far above, states with rulings turned almost along the strip (largest abs(eta) of 4 and more), in which "
        "those end that start Ipopt on its own. The box on eta (`ribbon.find.relax`) keeps the mixed model from those. "
        "Two different minima of nearly equal energy are no error of either formulation.",
        _minima(two),
        "## Orders of convergence\n\nAgainst the same branch on "
        f"{FINEST} segments; surface: largest distance of material points on an 80 x 4 grid, in l; force: of the end "
        "clamp; moment: of the start clamp (its force is the weight, exactly). Order: slope over the last four p. Each "
        "p starts from the finest shape. chained and mixed discretise the same way: their errors agree to the "
        "residual. Sadowsky's energy holds no derivative of omega or eta, linear "
        "functions approximate them to 1/p^2 and the energy, the forces and the centreline at the joints to 1/p^4; the "
        "rulings, and with them the edges, only to 1/p^2. Wunderlich's energy holds eta': order 2, as finite elements "
        "of degree 1 have it.",
        _orders_table(order),
        "## Work and precision\n\nHanging strip: CPU time of a warm `ribbon.solve` as it is, by Newton's methods, "
        "error of the surface / l.",
        _work_table(worked),
        "## Cost of one evaluation\n\nMicroseconds per segment, hanging strip; each column at a new point, so that "
        "nothing is taken from the cache; derivatives share their series, hence the last columns are less than the "
        "sum. chained: the Hessian is dense, cost and memory quadratic in p.",
        _costs_table(cost),
    )  # fmt: skip
    return _of_hanging(timed) | _of_orders(order) | _numbers(points, faster, solved, each, cost)
