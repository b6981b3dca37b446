"""Ribbon element against the strong form (thesis, 4.2): error of the free end and time of either."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from compare.models.ribbon.build import ribbon_clamp, ribbon_gravity
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, Strip, refine, solve
from ribbon.find.solving.refine import split_state
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.thesis.descent import Limits, newton_or_gradient, newton_shifted
from tests.reference.strong_form import Solution, StrongForm, collocate, continued
from tests.validation import one_core, page
from tests.validation.number import Number

#: Scene, sign of K, first number of segments.
SCENES = (
    ("figure_4_1", 1, 20),
    ("coil_10_100", 1, 10), ("coil_10_100", -1, 10),
    ("coil_40_1200", 1, 20), ("coil_40_1200", -1, 20),
    ("coil_100_7500", 1, 40), ("coil_100_7500", -1, 20),
)  # fmt: skip
THESIS_AUTO = {"coil_10_100": "110", "coil_40_1200": "160", "coil_100_7500": "900", "figure_4_1": "-"}
FINEST = 320
#: Tolerance of the reference; at 1e-9 solve_bvp's residual sinks into rounding at K = 100.
REFERENCE = 1e-8
TOLERANCES = tuple(10.0**-k for k in range(1, 8))
#: Searched for the fastest continuation: nodes per |K|, tolerance on the way, (first step, growth of steps).
SEARCH = tuple(itertools.product((1.5, 2.0), (1e-1, 1e-2), ((0.5, 1.3), (0.2, 1.3), (0.05, 1.2))))
TARGETS = (1e-3, 1e-4, 1e-5, 1e-6)
#: Distance of the free ends (in l) above which a run stands on another branch.
JUMP = 0.03
#: So narrow a strip (w / l) that the bound on eta' is out of reach; Sadowsky's energy does not know the width.
NARROW = 1e-3

BVP, HYBRID, DIRECT, REFINED, NEWTON = (
    "solve_bvp, continuation in Gamma", "solve_bvp from the coarse ribbon", "ribbon.solve", "ribbon.solve, then refine",
    "ribbon, NEWTONR, then Newton on cut segments",
)  # fmt: skip


@dataclass
class Run:
    """One solve: resolution (tolerance or segments), distance of its free end to the reference (l), CPU s."""

    resolution: float
    error: float
    seconds: float
    note: str = ""


@dataclass
class Measured:
    """All runs on a scene, by method; reference: tip (3,), its own error; text: what the page says of the scene.

    settings: of the fastest continuation; at_once: whether solve_bvp converges from the natural shape without one;
    numbers: what is kept of it.
    """

    name: str
    tip: np.ndarray
    own_error: float
    runs: dict[str, list[Run]] = field(default_factory=dict)
    settings: tuple[float, float, tuple[float, float]] = (2.0, 1e-2, (0.05, 1.2))
    at_once: bool = False
    text: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, Number] = field(default_factory=dict)

    def fastest(self, method: str, target: float) -> float:
        """Least time of a run of the method with an error within the target; inf when there is none."""
        return min((r.seconds for r in self.runs[method] if r.error <= target), default=np.inf)


@dataclass(frozen=True)
class Case:
    """A scene in both formulations."""

    scene: Scene
    segments: int

    @property
    def strong(self) -> StrongForm:
        s = self.scene
        return StrongForm(s.gamma, s.curvature, s.strip.poisson, np.asarray(s.up), s.frame)

    @property
    def strip(self) -> Strip:
        s = self.scene
        return Strip(1.0, NARROW, s.strip.poisson, s.curvature, s.gamma)

    def solve(self, segments: int) -> Equilibrium:
        """From the natural shape."""
        s = self.scene
        return solve(self.strip, ribbon_clamp(s), ribbon_gravity(s), energy="sadowsky", segments=segments)

    def refined(self, finest: int) -> Equilibrium:
        """From the first number of segments up to `finest`, cutting segments in two."""
        current = self.solve(self.segments)
        while current.problem.lengths.size < finest:
            current = refine(current)
        return current

    def newton(self, finest: int) -> np.ndarray:
        """Free end (3,): NEWTONR on the first segments, Newton with a line search on the cut ones."""
        s, lengths = self.scene, segment_lengths(self.segments)
        limits = Limits(1e-8, 500)
        problem = ChainedProblem(self.strip, ribbon_clamp(s), ribbon_gravity(s), "sadowsky", lengths)
        found = newton_shifted(problem, problem.natural_state(), limits)
        while lengths.size < finest:
            lengths, x = split_state(lengths, found.x, 2)
            problem = ChainedProblem(self.strip, ribbon_clamp(s), ribbon_gravity(s), "sadowsky", lengths)
            found = newton_or_gradient(problem, x, limits)
        if not found.finished:
            raise AssertionError(f"{s.name}: {found.message}")
        return problem.joints(found.x)[0][-1]

    def continued(self, settings: tuple[float, float, tuple[float, float]], tolerance: float) -> Solution:
        """solve_bvp by continuation with these settings."""
        per_turn, loose, (first, growth) = settings
        nodes = int(max(per_turn * max(map(abs, self.scene.curvature)), 15))
        return continued(self.strong, tolerance, nodes, first=first, loose=loose, growth=growth)

    def from_ribbon(self, ribbon: Equilibrium, nodes: int) -> tuple[np.ndarray, np.ndarray]:
        """Mesh (nodes,) and y (6, nodes) of a ribbon; M_2 from ``m = int_s^1 (r(t) - r(s)) x (-Gamma e_g) dt``."""
        s = np.linspace(0.0, 1.0, nodes)
        r, frames = ribbon.position(s), ribbon.frame(s)
        up = np.asarray(self.scene.up)
        steps = 0.5 * np.diff(s)[:, None] * (r[1:] + r[:-1])
        behind = np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))])
        moment = -self.scene.gamma * np.cross(behind - (1 - s)[:, None] * r, up)
        g = np.einsum("kij,i->jk", frames, up)
        return s, np.vstack([g, ribbon.omega(s), ribbon.eta(s), np.einsum("ki,ki->k", moment, frames[:, :, 1])])


def _search(case: Case, tip: np.ndarray) -> tuple[float, float, tuple[float, float]]:
    """The settings whose continuation is fastest to a tolerance of 1e-3 and ends on the reference's branch."""
    best = (np.inf, SEARCH[0])
    for settings in SEARCH:
        found = case.continued(settings, 1e-3)
        if found.converged and np.linalg.norm(found.tip() - tip) < JUMP:
            best = min(best, (found.seconds, settings))
    if not np.isfinite(best[0]):
        raise AssertionError(f"{case.scene.name}: no continuation reaches the branch")
    return best[1]


def _coarsest(case: Case, tip: np.ndarray, levels: list[int], nodes: int) -> tuple[int, int]:
    """Segments of the coarsest ribbon, and nodes, from which solve_bvp converges to the reference's branch."""
    for level, more in itertools.product(levels, (1, 2, 4)):
        solution = collocate(case.strong, *case.from_ribbon(case.refined(level), more * nodes), 1e-3, 20 * more * nodes)
        if solution.converged and np.linalg.norm(solution.tip() - tip) < JUMP:
            return level, more * nodes
    raise AssertionError(f"{case.scene.name}: solve_bvp converges from no ribbon")


def _case(name: str, sign: int, segments: int) -> Case:
    scene = load(name)
    unit = scene.strip.natural_curvature
    scene = scene.replace({"strip.natural_curvature": sign * (unit[0] if isinstance(unit, tuple) else unit)})
    return Case(scene, segments)


def reference(case: Case) -> tuple[Solution, Solution, Equilibrium]:
    """Collocation from a fine ribbon, a ten times looser one, and that ribbon."""
    fine = case.refined(160)
    nodes = int(max(4 * max(map(abs, case.scene.curvature)), 60))
    looser = collocate(case.strong, *case.from_ribbon(fine, nodes), 10 * REFERENCE, 100000)
    best = collocate(case.strong, looser.s, looser.y, REFERENCE, 100000)
    if not (looser.converged and best.converged):
        raise AssertionError(f"{case.scene.name}: no reference")
    return best, looser, fine


@cache
def lightest() -> tuple[Case, Solution]:
    """The coil of K l = 10 and its reference."""
    case = _case(*SCENES[1])
    return case, reference(case)[0]


PROBES = {
    "strong_energy_10": lambda: lightest()[1].energy(),
    "strong_reach_10": lambda: float(np.linalg.norm(lightest()[1].tip())),
    "ribbon_energy_10": lambda: lightest()[0].refined(FINEST).energy.total,
}


def _numbers(case: Case, best: Solution, own: float, end: Equilibrium) -> dict[str, Number]:
    """Energies and reach of both, each with the distance to the other and the reference's own error; how far the free
    ends are apart."""
    k = case.scene.curvature[0]
    word = f"{case.scene.name.split('_')[1] if case.scene.name.startswith('coil') else case.scene.name}"
    word += "" if k > 0 else "_down"
    apart = float(np.linalg.norm(end.end.position - end.problem.clamp.position - best.tip()))
    energies = best.energy(), end.energy.total
    error = max(abs(energies[0] - energies[1]), 1e-9 * abs(energies[0]))
    return {
        f"strong_energy_{word}": Number(energies[0], error, "D w / l", ".6f"),
        f"ribbon_energy_{word}": Number(energies[1], error, "D w / l", ".6f"),
        f"strong_reach_{word}": Number(float(np.linalg.norm(best.tip())), own + 1e-10, "l", ".8f"),
        f"tip_{word}": Number(apart, own, "l", ".0e"),
        f"own_{word}": Number(own, own, "l", ".0e"),
    }


def _measure(name: str, sign: int, segments: int) -> Measured:
    case = _case(name, sign, segments)
    scene = case.scene
    best, looser, fine = reference(case)
    nodes = int(max(4 * max(map(abs, scene.curvature)), 60))
    tip = best.tip()
    out = Measured(f"{name}, K l = {scene.curvature[0]:g}", tip, float(np.linalg.norm(tip - looser.tip())))
    out.settings = _search(case, tip)
    out.at_once = collocate(case.strong, *case.strong.natural_shape(nodes), 1e-3, 20 * nodes).converged
    start = fine.problem.clamp.position

    def runs(method: str, resolutions: list[float], once: Callable[[float], np.ndarray]) -> None:
        out.runs[method] = []
        for resolution in resolutions:
            end, seconds = one_core.timed(lambda at=resolution: once(at), budget=1.0)
            out.runs[method].append(Run(resolution, float(np.linalg.norm(end - start - tip)), seconds))

    def checked(solution: Solution) -> np.ndarray:
        return solution.tip() if solution.converged else np.full(3, np.nan)

    levels = [segments * 2**k for k in range(10) if segments * 2**k <= FINEST]
    runs(BVP, list(TOLERANCES), lambda at: checked(case.continued(out.settings, at)))
    runs(DIRECT, [float(p) for p in levels if p < FINEST], lambda at: case.solve(int(at)).end.position)
    runs(REFINED, [float(p) for p in levels], lambda at: case.refined(int(at)).end.position)
    runs(NEWTON, [float(p) for p in levels], lambda at: case.newton(int(at)))
    few = int(max(2 * max(map(abs, scene.curvature)), 15))
    level, few = _coarsest(case, tip, levels, few)
    starts = case.from_ribbon(case.refined(level), few)
    _, alone = one_core.timed(lambda: collocate(case.strong, *starts, 1e-6))

    def hybrid(tolerance: float) -> np.ndarray:
        return checked(collocate(case.strong, *case.from_ribbon(case.refined(level), few), tolerance))

    runs(HYBRID, list(TOLERANCES), hybrid)
    end = case.refined(levels[-1])
    last = case.continued(out.settings, 1e-6)
    out.numbers = _numbers(case, best, out.own_error, end)
    out.text = {
        "own": f"{out.own_error:.0e}",
        "ribbon": f"{np.linalg.norm(end.end.position - start - tip):.0e}",
        "energy": f"{best.energy():.6f}",
        "difference": f"{end.energy.total - best.energy():.0e}",
        "convex": f"{float(np.min(best.y[3] / case.strong.natural(best.s) * (1 + best.y[4] ** 2))):.3f}",
        "nu": f"{scene.strip.poisson:g}",
        "eta": f"{float(np.abs(best.y[4]).max()):.2f}",
        "stable": f"{end.lowest_eigenvalue:.3f}",
        "solves": str(last.solves), "nodes": str(last.nodes),
        "warm": f"{alone * 1e3:.3g} (p = {level})",
        "settings": "{0:g} abs(K) nodes, {1:g}, {2[0]:g} x {2[1]:g}".format(*out.settings),
        "auto": THESIS_AUTO[name],
    }  # fmt: skip
    return out


def measure() -> list[Measured]:
    """All scenes, in this process."""
    return [_measure(*scene) for scene in SCENES]


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.3g}" if np.isfinite(seconds) else "-"


def _ratio(above: float, below: float) -> str:
    return f"{above / below:.2g}" if np.isfinite(above) and np.isfinite(below) else "-"


def _equal_error(measured: list[Measured]) -> str:
    rows = []
    for m in measured:
        for target in TARGETS:
            times = {method: m.fastest(method, target) for method in (BVP, HYBRID, DIRECT, REFINED, NEWTON)}
            public = min(times[DIRECT], times[REFINED])
            rows.append(
                [m.name, f"{target:.0e}", *(_milliseconds(t) for t in times.values()),
                 _ratio(times[BVP], public), _ratio(times[BVP], times[NEWTON])]
            )  # fmt: skip
    heads = [
        "scene", "tip error within", "solve_bvp, continuation", "coarse ribbon + solve_bvp", "ribbon.solve",
        "solve + refine", "NEWTONR + Newton", "ratio: ribbon.solve / refine", "ratio: NEWTONR + Newton",
    ]  # fmt: skip
    return page.table(heads, rows)


def _all_runs(measured: list[Measured]) -> str:
    rows = []
    for m in measured:
        for method, runs in m.runs.items():
            cells = []
            for r in runs:
                error = f"{r.error:.0e}" if r.error < JUMP else f"({r.error:.0e})"
                cells.append(f"{r.resolution:g}: {error}, {_milliseconds(r.seconds)}")
            rows.append([m.name, method, " / ".join(cells)])
    return page.table(["scene", "method", "tolerance or segments: tip error, ms"], rows)


def _summary(measured: list[Measured]) -> str:
    keys = [
        "own", "ribbon", "energy", "difference", "stable", "eta", "convex", "nu", "settings", "solves", "nodes",
        "warm", "auto",
    ]  # fmt: skip
    heads = [
        "scene", "reference: own error / l", f"tip of the ribbon, p = {FINEST}", "energy", "ribbon's energy minus it",
        "lowest eigenvalue", "largest abs(eta)", "least omega (1 + eta^2) / K", "nu", "continuation: settings",
        "solves", "nodes at 1e-6", "solve_bvp alone from the ribbon, 1e-6, ms", "thesis: AUTO, ms",
    ]  # fmt: skip
    return page.table(heads, [[m.name, *(m.text[k] for k in keys)] for m in measured])


def _picture(measured: list[Measured], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    styles = {
        BVP: ("k", "o-"), HYBRID: ("0.55", "s--"), DIRECT: ("tab:blue", "^:"), REFINED: ("tab:blue", "^-"),
        NEWTON: ("tab:red", "d-"),
    }  # fmt: skip
    figure, axes = plt.subplots(2, 4, figsize=(15, 7.5), sharex=True, sharey=True, constrained_layout=True)
    for axis, m in zip(axes.flat, measured, strict=False):
        for method, (colour, style) in styles.items():
            good = [r for r in m.runs[method] if r.error < JUMP]
            axis.loglog([r.seconds for r in good], [r.error for r in good], style, color=colour, ms=5, label=method)
        axis.axhline(m.own_error, color="0.8", lw=1)
        axis.set_title(m.name, fontsize=10)
        axis.grid(alpha=0.3)
    for axis in axes[:, 0]:
        axis.set_ylabel("distance of the free end to the reference / l")
    for axis in axes[1]:
        axis.set_xlabel("CPU time, one core / s")
    axes[0, 3].set_xlabel("CPU time, one core / s")
    axes[0, 3].tick_params(labelbottom=True)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    axes.flat[-1].axis("off")
    axes.flat[-1].legend(handles, labels, loc="center", fontsize=9, frameon=False).set_in_layout(False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _headline(measured: list[Measured]) -> str:
    """The ratios at a tip error of 1e-6, the aim beside them."""
    words = []
    for m in measured:
        target = next((t for t in reversed(TARGETS) if np.isfinite(m.fastest(NEWTON, t))), TARGETS[0])
        bvp = m.fastest(BVP, target)
        public = min(m.fastest(DIRECT, target), m.fastest(REFINED, target))
        words.append(
            f"- {m.name}, tip within {target:.0e}: {_ratio(bvp, public)} with ribbon.solve and refine, "
            f"{_ratio(bvp, m.fastest(NEWTON, target))} with NEWTONR and Newton"
        )
    return "\n".join(words)


def _over(measured: list[Measured]) -> dict[str, Number]:
    """What is told of all scenes: the largest distance and own error, the ratios of times at the tightest target."""
    numbers = {name: number for m in measured for name, number in m.numbers.items()}
    ratios = [m.fastest(BVP, TARGETS[-1]) / min(m.fastest(DIRECT, TARGETS[-1]), m.fastest(REFINED, TARGETS[-1]))
              for m in measured]  # fmt: skip
    ratios = [ratio for ratio in ratios if np.isfinite(ratio)]
    for word in ("tip", "own"):
        these = [number for name, number in numbers.items() if name.startswith(f"{word}_")]
        numbers[f"{word}_most"] = max(these, key=lambda number: number.value)
    why = "CPU times of one run"
    return numbers | {
        "scenes": Number(len(measured), 0, shown="d"),
        "at_once": Number(sum(m.at_once for m in measured), 0, shown="d"),
        "ratio_least": Number(min(ratios), None, shown=".2g", why=why),
        "ratio_most": Number(max(ratios), None, shown=".2g", why=why),
    }


def run(out: Path) -> dict[str, Number]:
    measured = one_core.call(measure)
    for m in measured:
        if not all(np.isfinite(m.fastest(k, 1e-5)) for k in (BVP, HYBRID, REFINED, NEWTON)):
            raise AssertionError(f"{m.name}: the formulations do not agree")
        if m.own_error > 1e-7:
            raise AssertionError(f"{m.name}: the reference is known to {m.own_error:.0e} only")
    _picture(measured, out / "strong_form.png")
    page.write(
        out / "strong_form.md", "Ribbon element against the strong form (thesis, 4.2)",
        "python -m tests.validation strong_form",
        "The Euler-Lagrange equations of the Sadowsky ribbon (tests/reference/strong_form.py: six unknowns, vectorised "
        "right side, analytic Jacobian) by scipy's solve_bvp, and the ribbon element by energy, from the same natural "
        "shape; no bound on eta'. Error: distance of the free end, in l, to solve_bvp at a tolerance of 1e-8. Time: "
        "median CPU time of a warm call on one core (numba's kernels loaded; one BLAS thread), position of the free "
        "end included. A call of ribbon.solve or refine includes its stability check; solve_bvp and the bare Newton "
        "have none. Both sides are Python around compiled kernels: numba here, LAPACK and SuperLU there.",
        "solve_bvp gets what makes it fast: continuation in Gamma at full K (as the thesis's AUTO and shooting) with "
        "a linear predictor, growing steps and a mesh thinned after every step, and, scene by scene, the fastest of "
        f"{len(SEARCH)} settings (nodes, tolerance on the way, first step x growth). Without continuation, "
        f"from the natural shape at the full weight, it converges on {sum(m.at_once for m in measured)} of the "
        f"{len(measured)} scenes. The ribbon it also starts from is the coarsest (solve, then refine) from which it "
        "converges; the time of that ribbon is included.",
        "The ribbon starts on the thesis's number of segments, at K = 100 on 40 (20 end on another branch: coils.md), "
        "and cuts them in two; times are of the whole chain. Its last variant uses `ribbon.thesis.descent` with no "
        "Ipopt: NEWTONR from the natural shape, then NEWTONC (Newton's method with a line search) after every cut; "
        "NEWTONR's threshold for its shift, 1e-8 on the lowest eigenvalue in the unknowns' own scale, is crossed by "
        "refinement alone, and it then takes tens of steps instead of two or three.",
        "## Who is faster at equal error\n\nAim: the ribbon ten times faster than the continuation at equal tip error. "
        "Ratio of times (above 1: the ribbon is faster):",
        _headline(measured),
        "Times in ms of the fastest run whose tip error is within the target; -: none up to "
        f"{FINEST} segments or a tolerance of {TOLERANCES[-1]:.0e}.",
        _equal_error(measured),
        "![error against time](strong_form.png)\n\nGrey line: the reference's own error.",
        "## The scenes\n\nOwn error: distance between the reference and solve_bvp at 1e-7. The equations are regular "
        "where omega (1 + eta^2) / K > nu (Sadowsky's density is strictly convex there): the two columns show the "
        "margin. The lowest eigenvalue is the ribbon's (positive: the solution of the strong form is a minimum). The "
        "thesis's times for AUTO are from another machine and stand for scale only.",
        _summary(measured),
        f"## All runs\n\nIn brackets: further than {JUMP} from the reference, on another branch.",
        _all_runs(measured),
    )  # fmt: skip
    return _over(measured)
