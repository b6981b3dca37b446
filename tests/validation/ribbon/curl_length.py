"""The curl of growing length (thesis, 4.4, figure 4.4): planar up to which length, and what comes after."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from compare.measure.mesh_limit import Settled, settled
from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.find.continuation import StepRecord, follow
from ribbon.find.solve import Problem, build, solve_from
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers.problem import FloatArray, polish
from tests.validation import page
from tests.validation.number import Number, of_settled, rounding

matplotlib.use("Agg")
import matplotlib.pyplot as plt

#: Section 4.4: w and h in m, Y in Pa, rho in kg/m^3, nu, natural curvature in 1/m, segments.
WIDTH, THICKNESS, YOUNG, DENSITY, POISSON, NATURAL = 0.01, 1e-4, 1.8e9, 1000.0, 0.5, 60.0
SEGMENTS = 20
THESIS = 0.29
#: Segments on which a critical length is found, and to what on each (cm).
MESHES, LOCATED = (20, 40, 80), 1e-4

#: How the clamp stands -> the direction of up (the clamp's t_z = e_z, t_y = e_y) and the sign of K.
CLAMPS = {
    "horizontal, curls down first": ((0.0, 1.0, 0.0), 1.0),
    "horizontal, curls up first": ((0.0, 1.0, 0.0), -1.0),
    "points down": ((0.0, 0.0, -1.0), 1.0),
    "points up": ((0.0, 0.0, 1.0), 1.0),
}
HORIZONTAL = "horizontal, curls down first"
#: Lengths between which a planar curl is followed (m), and the step in length.
SHORT, STEP = 0.2, 0.005
#: eta of a seed that is not symmetric about the plane; from a planar one Ipopt does not leave it.
OBLIQUE = 0.01
#: Excursion (in l) below which a shape counts as planar.
PLANAR = 1e-6


@dataclass(frozen=True)
class Curl:
    """One way of holding and modelling it."""

    clamp: str = HORIZONTAL
    energy: str = "wunderlich"
    ruling: str = "free"
    segments: int = SEGMENTS

    def strip(self, length: float) -> Strip:
        """Of that length, in m."""
        natural = NATURAL * CLAMPS[self.clamp][1]
        return Strip.from_material(length, WIDTH, THICKNESS, YOUNG, DENSITY, POISSON, natural)

    def problem(self, length: float) -> Problem:
        """The reduced problem of that length."""
        return build(
            self.strip(length), Clamp(ruling=self.ruling), Gravity(CLAMPS[self.clamp][0]), energy=self.energy,
            segments=self.segments, formulation="chained",
        )  # fmt: skip

    def solved(self, length: float, ruling: float = 0.0) -> Equilibrium:
        """From the thesis's seed, straight and horizontal; `ruling`: eta of the seed, which breaks its symmetry."""
        return solve(
            self.strip(length), Clamp(ruling=self.ruling), Gravity(CLAMPS[self.clamp][0]), energy=self.energy,
            segments=self.segments, seed_curvature=0.0, seed_ruling=ruling,
        )  # fmt: skip

    def planar(self, length: float, near: tuple[float, FloatArray]) -> Equilibrium:
        """The planar equilibrium, stable or not, by Newton's iteration from that of a neighbouring length."""
        at, x = near
        count = max(1, int(np.ceil(abs(length - at) / STEP - 1e-9)))
        for k in range(1, count + 1):
            problem = self.problem(at + (length - at) * k / count)
            assert isinstance(problem, ChainedProblem)
            equilibrium = solve_from(problem, polish(problem, x), near=True)
            x = equilibrium.x
        if excursion(equilibrium) > PLANAR or equilibrium.residual > 1e-8:
            raise AssertionError(f"{self}, l = {length}: left the plane, or not stationary")
        return equilibrium

    def critical(self) -> tuple[float, Equilibrium]:
        """Length (m) at which the planar equilibrium loses stability, to 1e-6, and the last stable one."""
        low, high = SHORT, SHORT
        held = self.solved(SHORT)
        while high < 0.6:
            high = low + STEP
            found = self.planar(high, (low, held.x))
            if not found.ok:
                break
            low, held = high, found
        while high - low > 1e-6:
            middle = 0.5 * (low + high)
            found = self.planar(middle, (low, held.x))
            if found.ok:
                low, held = middle, found
            else:
                high = middle
        return low, held

    def branch(self, start: Equilibrium, first: float, last: float) -> tuple[Equilibrium, list[tuple[float, float]]]:
        """The stable state followed from one length to another, half a centimetre a step: (l, excursion), both in m."""
        seen: list[tuple[float, float]] = [(first, excursion(start) * first)]

        def on_step(record: StepRecord, equilibrium: Equilibrium) -> None:
            length = first + (last - first) * record.t
            if not equilibrium.ok or record.jump:
                raise AssertionError(f"{self}, l = {length}: {equilibrium.message}, jump: {record.jump}")
            seen.append((length, excursion(equilibrium) * length))

        end = follow(
            lambda t: self.problem(first + (last - first) * t), start, steps=round(abs(last - first) / STEP),
            leave_saddle=True, on_step=on_step,
        )  # fmt: skip
        return end, seen


def excursion(equilibrium: Equilibrium) -> float:
    """Largest distance of the centreline from the plane of the clamp's t_y and t_z, in l."""
    return float(np.abs(equilibrium.position(np.linspace(0.0, 1.0, 401))[:, 0]).max())


def square_root(curl: Curl, critical: float) -> float:
    """Length (m) at which the square of the excursion, through four shapes past the critical length, vanishes."""
    lengths = critical + 1e-3 * np.array([0.5, 1.0, 1.5, 2.0])
    squares = [(excursion(curl.solved(length, OBLIQUE)) * length) ** 2 for length in lengths]
    return float(np.polynomial.Polynomial.fit(squares, lengths, 2)(0.0))  # l as a function of the square


def _table(curls: list[Curl], lengths: Lengths) -> str:
    rows = []
    for curl in curls:
        row = [curl.clamp, curl.energy, curl.ruling]
        for segments in MESHES:
            length, held = lengths[Curl(curl.clamp, curl.energy, curl.ruling, segments)]
            row.append(f"{length * 100:.2f}")
        row.append(_limit(curl, lengths).text)
        s = np.linspace(0.0, 1.0, 401)
        row.append(f"{np.abs(held.omega(s)).min() / (length * NATURAL):.3f}")
        rows.append(row)
    heads = ["clamp", "energy", "ruling at the clamp", *(f"p = {p}" for p in MESHES), "limit", "least omega / K there"]
    return page.table(heads, rows)


def _limit(curl: Curl, lengths: Lengths) -> Settled:
    """The critical length (cm) of the strip, from its three meshes."""
    found = [100.0 * lengths[Curl(curl.clamp, curl.energy, curl.ruling, p)][0] for p in MESHES]
    return settled(found, LOCATED)


#: Critical length (m) and the last stable planar equilibrium.
Lengths = dict[Curl, tuple[float, Equilibrium]]


def project(points: FloatArray) -> FloatArray:
    """Points (..., 3) as seen from the side, a little from ahead and above: right, up, towards the eye."""
    turn, tilt = np.radians(25.0), np.radians(12.0)
    side = points[..., 2] * np.cos(turn) + points[..., 0] * np.sin(turn)
    depth = points[..., 0] * np.cos(turn) - points[..., 2] * np.sin(turn)
    up = points[..., 1]
    return np.stack([side, up * np.cos(tilt) - depth * np.sin(tilt), depth * np.cos(tilt) + up * np.sin(tilt)], axis=-1)


def _patch(axes: Axes, grid: FloatArray, colour: str) -> None:
    """The surface with points grid (k, m, 3), far cells first, darker where it is seen at an angle."""
    corners = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    facing = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    shade = (0.45 + 0.55 * facing)[:, None] * np.array(to_rgb(colour))
    cells = PolyCollection(list(corners[order, :, :2]), facecolors=shade[order], edgecolors=shade[order], lw=0.3)
    axes.add_collection(cells)


def _draw(
    path: Path, branches: dict[str, list[tuple[float, float]]], lengths: dict[Curl, tuple[float, Equilibrium]]
) -> None:
    figure = plt.figure(figsize=(12, 8.5))
    left, right = figure.add_subplot(2, 2, 1), figure.add_subplot(2, 2, 2)
    styles = itertools.cycle(("-", "o", "-", "s"))
    for (label, seen), style in zip(branches.items(), styles, strict=False):
        values = 100 * np.array(seen)
        colour = "tab:blue" if "wunderlich" in label else "tab:orange"
        left.plot(*values.T, style, color=colour, ms=3.5, mfc="none", label=label)
    left.axvline(100 * THESIS, color="0.5", ls=":", label="thesis: 29 cm")
    left.set(xlabel="length l (cm)", ylabel="distance from the plane (cm)", xlim=(25, 50))
    left.legend(fontsize=8)
    for (name, (_, sign)), colour in zip(CLAMPS.items(), ("tab:blue", "tab:cyan", "tab:red", "tab:green"), strict=True):
        curl = Curl(name, segments=40)
        held, points, at = curl.solved(SHORT), [], SHORT
        for length in np.arange(0.24, 0.3401, 0.001):
            held = curl.planar(length, (at, held.x))
            at = length
            points.append((100 * length, held.lowest_eigenvalue))
        values = np.array(points)
        right.plot(values[:, 0], values[:, 1], color=colour, label=f"{name} (K {'>' if sign > 0 else '<'} 0)")
        right.plot(100 * lengths[curl][0], 0.0, "o", color=colour)
    right.axhline(0.0, color="0.7", lw=0.8)
    right.axvline(100 * THESIS, color="0.5", ls=":")
    right.set(xlabel="length l (cm)", ylabel="lowest eigenvalue of the planar curl (D w / l)", ylim=(-4, 2.2))
    right.legend(fontsize=8, loc="upper right")
    below = figure.add_subplot(2, 1, 2)
    curl = Curl(segments=40)
    for k, length in enumerate((0.05, 0.15, 0.25, 0.29, 0.31, 0.35, 0.40, 0.50)):
        found = curl.solved(length, OBLIQUE if length > 0.28 else 0.0)
        turned = project(100 * length * found.surface(300, 2).grid)
        colour = "tab:blue" if excursion(found) > PLANAR else "tab:green"
        _patch(below, turned + np.array([11.0 * k, 0.0, 0.0]), colour)
        below.text(11.0 * k, 1.5, f"{100 * length:.0f} cm", ha="center")
    below.plot([-4.0, 1.0], [-20.0, -20.0], color="k")
    below.text(-1.5, -19.5, "5 cm", ha="center")
    below.set(aspect="equal", xlim=(-6, 83), ylim=(-25, 4))
    below.set_axis_off()
    below.set_title("Wunderlich, free ruling, seen from the side; green: planar, blue: out of the plane", fontsize=10)
    figure.subplots_adjust(hspace=0.18, left=0.05, right=0.98, top=0.98, bottom=0.02, wspace=0.14)
    figure.savefig(path, dpi=110)
    plt.close(figure)


PROBES = {
    "sadowsky_free_20": lambda: 100.0 * Curl(energy="sadowsky").critical()[0],
    "wunderlich_free_20": lambda: 100.0 * Curl().critical()[0],
}


def _first_line(curls: list[Curl], lengths: Lengths) -> str:
    """The critical length that the thesis has, with its error, and which of the table do not settle."""
    one = _limit(Curl(), lengths)
    open_ones = [curl for curl in curls if not _limit(curl, lengths).settles]
    names = "; ".join(f"{curl.clamp}, {curl.energy}, {curl.ruling}" for curl in open_ones)
    rest = f"{len(open_ones)} of {len(curls)} do not settle: {names}." if open_ones else "All of the table settle."
    return f"Wunderlich's curl with a free ruling is planar up to {one.text} cm (thesis: {100 * THESIS:.0f}). {rest}"


def _numbers(lengths: Lengths) -> dict[str, Number]:
    """Critical lengths (cm) of the clamp that fits: on a number of segments to the bisection, and the finest with its
    change from half as many."""
    found: dict[str, Number] = {}
    for energy, ruling in itertools.product(("sadowsky", "wunderlich"), ("free", "straight")):
        at = {p: 100.0 * lengths[Curl(HORIZONTAL, energy, ruling, p)][0] for p in MESHES}
        for p, value in at.items():
            found[f"{energy}_{ruling}_{p}"] = Number(value, 2e-4, "cm", ".2f")
        found[f"{energy}_{ruling}"] = of_settled(_limit(Curl(HORIZONTAL, energy, ruling), lengths).record("cm"), ".2f")
    these = sorted(
        (n for name, n in found.items() if name[-1].isdigit()), key=lambda number: number.value
    )  # fmt: skip
    return found | {"least": these[0], "most": these[-1]}


def run(out: Path) -> dict[str, Number]:
    curls = [Curl(c, e, r) for c in CLAMPS for e in ("sadowsky", "wunderlich") for r in ("free", "straight")]
    lengths = {}
    for curl, segments in itertools.product(curls, MESHES):
        one = Curl(curl.clamp, curl.energy, curl.ruling, segments)
        lengths[one] = one.critical()
    branches: dict[str, list[tuple[float, float]]] = {}
    sentences = []
    numbers = _numbers(lengths)
    for energy in ("wunderlich", "sadowsky"):
        curl = Curl(energy=energy, segments=40)
        long, up = curl.branch(curl.solved(0.25), 0.25, 0.50)
        _, down = curl.branch(long, 0.50, 0.25)
        branches[f"{energy}, growing"], branches[f"{energy}, shrinking"] = up, down
        gap = max(abs(a[1] - b[1]) for a, b in zip(up, reversed(down), strict=True))
        critical, _ = lengths[curl]
        fitted = square_root(curl, critical)
        seeded = curl.solved(0.50, OBLIQUE)
        sentences.append(
            f"- {energy}, free ruling, p = 40: the eigenvalue vanishes at {100 * critical:.3f} cm; the square of the "
            f"distance from the plane, fitted to four shapes within 2 mm past it, vanishes at {100 * fitted:.3f} cm. "
            f"Growing and shrinking differ by at most {100 * gap:.1e} cm: no snap, no hysteresis (a supercritical "
            f"pitchfork). At 50 cm the energy is {long.energy.total:.4f} D w / l, from a straight "
            f"seed with eta = {OBLIQUE} it is {seeded.energy.total:.4f}."
        )
        if gap > 1e-6 or abs(fitted - critical) > 2e-5:
            raise AssertionError(f"{energy}: hysteresis {gap}, critical length {critical} against {fitted}")
        if not (long.ok and seeded.ok) or abs(long.energy.total - seeded.energy.total) > 1e-3:
            raise AssertionError(f"{energy}: the straight seed ends elsewhere than the growing curl, at 50 cm")
        numbers[f"{energy}_gap"] = rounding(100.0 * gap, "cm")
        numbers[f"{energy}_fitted"] = Number(100.0 * fitted, 100.0 * abs(fitted - critical), "cm", ".3f")
        energies = long.energy.total, abs(long.energy.total - seeded.energy.total)
        numbers[f"{energy}_energy_50"] = Number(
            energies[0], max(energies[1], 1e-8 * abs(energies[0])), "D w / l", ".4f"
        )
    tenth = {e: Curl(energy=e).critical()[0] for e in ("sadowsky", "wunderlich")}
    if not all(0.285 < value < 0.295 for value in tenth.values()):
        raise AssertionError(f"planar up to {tenth}, the thesis has 0.29 m")
    _draw(out / "curl_length.png", branches, lengths)
    page.write(
        out / "curl_length.md", "The curl of growing length (4.4)", "python -m tests.validation curl_length",
        _first_line(curls, lengths),
        "Thesis, 4.4, figure 4.4: w = 1 cm, h = 0.1 mm, rho = 1000 kg/m^3, Y = 1.8 GPa, nu = 0.5, natural curvature "
        "60 /m, l from 1 to 50 cm, 20 segments, seed straight and horizontal; planar up to 29 cm, then out of the "
        "plane. Here: the planar equilibrium is followed in l, stable or not, and the length at which the lowest "
        "eigenvalue of its Hessian crosses zero is found by bisection.",
        "The thesis does not draw its clamp. A planar curl exists when the clamp's t_x is horizontal; taken here: t_z "
        "horizontal, as the seed, and K > 0, which bends the tangent downwards first (`R' = R [kappa]_x`). The other "
        "ways to hold it are in the table: only this one fits the 29 cm.",
        "## Planar up to (cm)", _table(curls, lengths),
        "The last column (at p = 80): both energy densities lose convexity in eta where 0 < omega < nu K = 0.5 K. "
        "The planar curl tips before any point of it is unbent so far, in a mode of the whole ribbon; a straight "
        "ruling at the clamp, and the cost of eta' in Wunderlich's energy, delay it.",
        "## Beyond", "\n".join(sentences), "![distance from the plane, eigenvalue, shapes](curl_length.png)",
    )  # fmt: skip
    return numbers
