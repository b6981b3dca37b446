"""When a ribbon twisted under tension leaves the helicoid: the infinitely long theory, the models, the shell."""

from __future__ import annotations

import csv
import functools
import io
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from compare.measure.mesh_limit import Settled, settled
from compare.store.store import atomic_write_text
from ribbon import Clamp, Strip
from ribbon.energies.section.relaxed import torsion_loss
from ribbon.find.solve import build, solve_shape
from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint
from tests.reference import twisted_ribbon
from tests.validation import page
from tests.validation.number import Number, of_settled
from tests.validation.pieces import key

#: It takes no times that its page rests on.
ALONE = False

POISSON = 0.4
#: Width over thickness, and twist angle (rad) at which the infinitely long ribbon of that length would be critical.
RATIO, TURNS = 20.0, 10.0
TENSIONS = (30.0, 100.0, 400.0)
SEGMENTS = (20, 40, 80)
#: To what the secants find a root, relative: their last step is quadratic in the one before.
LOCATED = 1e-6
#: Elements of the shell, along and across, and fewer for what the mesh changes.
MESH, COARSER = (60, 4), (30, 2)
#: Ratio of neighbouring segments towards a clamp that holds its edge straight.
GROWTH = 1.5
#: Turn of a leg of the shell's path (rad), and last angle over the theory's.
LEG, BEYOND = 0.5, 1.6
#: Part of a leg to which the shell's instability is found.
EVENT = 5e-3
#: Largest deviation of the extensible ribbon from the theory between clamps, and of the shell from the finite ribbon.
RIBBON_WITHIN, SHELL_WITHIN = 2e-4, 1e-2


class Case:
    """A scaled tension at the length at which theory asks for TURNS: lengths in l, forces in D w / l^2."""

    def __init__(self, tension: float) -> None:
        self.tension = tension
        self.limit = twisted_ribbon.critical(tension, POISSON)
        self.kappa = TURNS / self.limit  # kappa* l
        self.width = 1.0 / (RATIO * self.kappa * np.sqrt(12.0 * (1.0 - POISSON**2)))
        self.thickness = self.width / RATIO
        self.force = tension * self.kappa**2

    def held(self) -> tuple[float, float]:
        """Critical scaled twist between clamps that guide: as the paper has torsion, and less the loss at the edges."""
        loss = torsion_loss(self.width, self.thickness)
        return tuple(twisted_ribbon.between_clamps(self.tension, POISSON, self.kappa, x) for x in (0.0, loss))  # type: ignore[return-value]


def layered(width: float, segments: int) -> np.ndarray:
    """Lengths (k,) of segments, 1 / segments in the middle, shorter towards both ends: a tenth of the width there."""
    near = [0.1 * width]
    while near[-1] * GROWTH < 1.0 / segments:
        near.append(near[-1] * GROWTH)
    middle = max(1, round((1.0 - 2.0 * sum(near)) * segments))
    return np.array([*near, *[(1.0 - 2.0 * sum(near)) / middle] * middle, *near[::-1]])


def ribbon(case: Case, energy: str, segments: int) -> float:
    """Scaled twist at which the lowest eigenvalue of the straight twisted ribbon vanishes: secants from the stable
    side, as beyond it the ribbon leaves the helicoid."""
    strip = Strip(1.0, case.width, POISSON, thickness=case.thickness)
    ruling = "straight" if energy == "finite" else "free"
    lengths = layered(case.width, segments) if energy == "finite" else np.full(segments, 1.0 / segments)

    def lowest(tau: float) -> float:
        angle = tau * case.kappa
        frame = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
        problem = build(
            strip, Clamp(ruling=ruling), end=Clamp(None, frame[:, 2], frame[:, 1], ruling), energy=energy,
            segments=lengths, formulation="mixed", tip=(0.0, 0.0, case.force),
        )  # fmt: skip
        twist = np.full(lengths.size + 1, angle)
        if ruling == "straight":
            twist[[0, -1]] = 0.0
        return solve_shape(problem, np.zeros(twist.size), twist).lowest_eigenvalue

    near = case.held()[1]
    taus = [0.92 * near, 0.95 * near]
    values = [lowest(tau) for tau in taus]
    for _ in range(8):
        root = taus[-1] + values[-1] * (taus[-1] - taus[-2]) / (values[-2] - values[-1])
        if abs(root - taus[-1]) < 5e-3 * near:
            break
        taus.append(taus[-1] + 0.8 * (root - taus[-1]))
        values.append(lowest(taus[-1]))
    return float(root)


def shell(case: Case, mesh: tuple[int, int]) -> float:
    """Scaled twist at which the shell's tangent becomes singular on the way of growing twist (bisection)."""
    from shellref.fenics import dolfinx_api as api
    from shellref.path.arc import locate
    from shellref.path.point import Point, Walk
    from shellref.path.solver import Solver
    from shellref.path.walk import Walker
    from shellref.shell.strip import build_strip

    frame = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # t_z = e_x

    def turned(angle: float) -> Pose:
        turn = Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix() @ frame
        return Pose((0.0, 0.0, 0.0), tuple(map(tuple, turn.tolist())))  # type: ignore[arg-type]

    class Watching(Walker):
        """Stops at the first state that is not stable, between loads `between` of its stage."""

        between: tuple[float, float] | None = None

        def settle(self, walk: Walk, before: Point | None = None) -> bool:
            if walk.point.negative and before is not None:
                low, high = locate(self, walk, before, walk.point)
                self.between = low.load, high.load
                walk.stop(ShellStatus.UNSTABLE, "the helicoid is left")
            return False

    legs = int(np.ceil(BEYOND * TURNS / LEG))
    leg = BEYOND * TURNS / legs
    path = (Waypoint(tip=1.0, name="tip"), *(Waypoint(end=turned(leg * k), name="twist") for k in range(1, legs)))
    problem = ShellProblem(
        case.width, case.thickness, POISSON, clamp_frame=tuple(map(tuple, frame.tolist())),  # type: ignore[arg-type]
        elements=mesh, grading=(1.0, 1.0), tip=(case.force, 0.0, 0.0), end=turned(leg * legs), guided=True, path=path,
    )  # fmt: skip
    options = ShellOptions(
        kick=False,
        switch=False,
        arc_length="never",
        event_tolerance=EVENT,
        max_step=1.0,
        first_step=1.0,
        max_strain=0.2,
    )
    solver = Solver(build_strip(problem, options), options, api.communicator("self"), lambda event: None)
    walker = Watching(solver.equilibrium, solver.strip.stages, options, solver.report, solver.observe)
    walk = Walk(Point(0.0, solver.strip.initial_state(solver.model.nodes), None))  # type: ignore[arg-type]
    walker.start(walk)
    walker.run(walk)
    if walker.between is None:
        raise AssertionError(f"T = {case.tension:g}, {mesh}: {walk.message}")
    return float(leg * (walk.stage - 1 + np.mean(walker.between)) / case.kappa)


@functools.cache
def middle() -> Case:
    """The case of the middle tension."""
    return Case(TENSIONS[1])


PROBES = {
    "held_100": lambda: middle().held()[1],
    "extensible_100_40": lambda: ribbon(middle(), "extensible", SEGMENTS[1]),
    "finite_100_40": lambda: ribbon(middle(), "finite", SEGMENTS[1]),
}


def run(out: Path) -> dict[str, Number]:
    kept = CachedRun(out.parent / "out" / "validate" / "twisted_tension" / key("twisted_tension") / "kept.csv")
    rows = []
    numbers: dict[str, Number] = {}
    limits: dict[float, dict[str, Settled]] = {}
    for tension in TENSIONS:
        case = Case(tension)
        paper, held = case.held()
        extensible, finite = (
            [kept(f"{energy} {p}", tension, lambda c=case, e=energy, p=p: ribbon(c, e, p)) for p in SEGMENTS]
            for energy in ("extensible", "finite")
        )
        surface, rougher = (
            kept(f"shell {m[0]} x {m[1]}", tension, lambda c=case, m=m: shell(c, m)) for m in (MESH, COARSER)
        )
        limits[tension] = {
            energy: settled(values, LOCATED * values[-1])
            for energy, values in (("extensible", extensible), ("finite", finite))
        }
        for name, value in (("infinitely long", case.limit), ("clamped", paper), ("clamped, torsion loss", held)):
            kept(name, tension, lambda value=value: value)
        numbers |= _numbers(case, (paper, held), (extensible, finite), limits[tension], (surface, rougher))
        rows.append([
            f"{tension:g}", f"{1.0 / case.width:.1f}", f"{case.limit:.3f}", f"{paper:.3f}", f"{held:.3f}",
            *(f"{value:.3f}" for value in (*extensible, *finite, rougher, surface)),
            f"{limits[tension]['extensible'].value / held - 1.0:+.1e}", f"{surface / finite[-1] - 1.0:+.2%}",
        ])  # fmt: skip
        if not abs(extensible[-1] / held - 1.0) < RIBBON_WITHIN:
            raise AssertionError(f"T = {tension:g}: the extensible ribbon is {extensible[-1]:.4f}, theory {held:.4f}")
        if not abs(surface / finite[-1] - 1.0) < SHELL_WITHIN:
            raise AssertionError(f"T = {tension:g}: the shell is {surface:.4f}, the finite ribbon {finite[-1]:.4f}")
    atomic_write_text(out / "twisted_tension.csv", kept.path.read_text())
    page.write(
        out / "twisted_tension.md", "A ribbon twisted under tension", "python -m tests.validation twisted_tension",
        _first_line(limits),
        "Scaled twist tau / kappa* at which a ribbon under a scaled tension T / (D w kappa*^2) leaves the helicoid, "
        f"kappa* = h / (w^2 sqrt(12 (1 - nu^2))); nu = {POISSON:g}, w/h = {RATIO:g}. *Infinitely long*: B. Audoly and "
        "S. Neukirch 2021, doi:10.1016/j.jmps.2021.104457, section 5 (f = 0). *Clamped*: the same energy between "
        f"clamps that guide, at the length at which the theory asks for {TURNS:g} rad "
        "(`tests/reference/twisted_ribbon.py`); *torsion loss*: less what transverse shear at the free edges takes of "
        "the torsion, which our `extensible` and "
        "the shell have and the paper's energy has not. Ribbons: the eigenvalue of the glued problem, `[tip] tension` "
        "at a guided end; *finite* holds its clamped edges straight, as the shell does, on segments that are "
        "shorter there. Shells: sign changes of the tangent's pivots on the way of growing twist, bisected to "
        f"{EVENT * LEG:.0e} rad. "
        "All numbers: `twisted_tension.csv`.",
        page.table(
            [
                "T", "l/w", "infinitely long", "clamped", "torsion loss",
                *(f"{energy} {p}" for energy in ("extensible", "finite") for p in SEGMENTS),
                *(f"shell {m[0]} x {m[1]}" for m in (COARSER, MESH)), "extensible to theory", "shell to finite",
            ],
            rows,
        ),
    )  # fmt: skip
    return numbers


def _first_line(limits: dict[float, dict[str, Settled]]) -> str:
    """What settles over the segments, and what of the shell does not."""
    open_ones = [f"{name}, T = {t:g}" for t, by in limits.items() for name, one in by.items() if not one.settles]
    middle_one = limits[TENSIONS[1]]
    told = ", ".join(f"`{name}` {one.text}" for name, one in middle_one.items())
    rest = f"Not settled: {'; '.join(open_ones)}. " if open_ones else "All ribbons of the table settle. "
    return (
        f"At T = {TENSIONS[1]:g} the helicoid is left at {told} (segments {', '.join(map(str, SEGMENTS))}). {rest}The "
        "shell's is of two meshes, which is no limit: what the finer one changes is what is known of its error."
    )


def _numbers(
    case: Case, theory: tuple[float, float], ribbons: tuple[list[float], list[float]], limits: dict[str, Settled],
    shells: tuple[float, float],
) -> dict[str, Number]:  # fmt: skip
    """Scaled critical twists. Theory: roots to 1e-10, kept with six digits; ribbons: how far each is from the limit
    over 20, 40, 80 segments, and the limit; shell: the change from the coarser mesh and its bisection."""
    tension = f"{case.tension:g}"
    found = {f"limit_{tension}": Number(case.limit, 1e-6, shown=".3f")}
    for name, value in zip(("paper", "held"), theory, strict=True):
        found[f"{name}_{tension}"] = Number(value, 1e-6, shown=".3f")
    for (energy, limit), values in zip(limits.items(), ribbons, strict=True):
        found[f"{energy}_{tension}"] = of_settled(limit.record(""), ".3f")
        for p, value in zip(SEGMENTS, values, strict=True):
            left = abs(value - limit.value) + limit.error if limit.settles else limit.error
            found[f"{energy}_{tension}_{p}"] = Number(value, left, shown=".3f")
    surface, rougher = shells
    found[f"shell_{tension}"] = Number(surface, abs(surface - rougher) + EVENT * LEG / case.kappa, shown=".3f")
    extensible = limits["extensible"]
    off, error = extensible.value / theory[1] - 1.0, extensible.error / theory[1]
    found[f"extensible_to_theory_{tension}"] = Number(
        off, error if extensible.settles else None, shown=".1e", why="" if extensible.settles else "not settled"
    )
    return found


class CachedRun:
    """Values by name and tension, each written to a CSV as it is found; what stands there already is taken from it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[tuple[str, str], str] = {}
        if path.exists():
            rows = list(csv.reader(io.StringIO(path.read_text())))[1:]
            self.values = {(name, tension): value for tension, name, value in rows}

    def __call__(self, name: str, tension: float, find: Callable[[], float]) -> float:
        key = name, f"{tension:g}"
        if key not in self.values:
            began = time.perf_counter()
            self.values[key] = f"{find():.6f}"
            print(f"  T = {tension:g}, {name}: {self.values[key]}, {time.perf_counter() - began:.0f} s", flush=True)
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lines = io.StringIO()
            writer = csv.writer(lines, lineterminator="\n")
            writer.writerow(["tension", "method", "critical twist"])
            writer.writerows([tension, name, value] for (name, tension), value in self.values.items())
            atomic_write_text(self.path, lines.getvalue())
        return float(self.values[key])
