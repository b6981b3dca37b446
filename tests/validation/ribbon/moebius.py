"""Moebius bands: energy against width, orders of convergence, curvature diagram, seam conditions, forces (6.1.1)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.models.ribbon.stages import run_way
from compare.scene.scene import load
from ribbon import Clamp, Closure, Equilibrium, Strip, solve
from ribbon.find.adaptive import cut, indicators, refine_to_tolerance
from ribbon.find.continuation import switch
from ribbon.find.solve import build
from tests.validation import page
from tests.validation.number import Number, rounding
from tests.validation.ribbon.wunderlich_event import band

FloatArray = NDArray[np.float64]

WIDTHS = (0.002, 0.005, 0.01, 0.02, 1 / 30, 0.05, 0.1, 0.2, 0.3, 0.4)
TOLERANCES = (1e-3, 1e-4, 2e-5)
#: Starostin and van der Heijden (2007): U = 5.93 pi^2 at w/l = 1/30.
KNOWN = 5.93
CASES = (0.1, 0.01)
UNIFORM = (24, 48, 96, 192, 384, 768)
ROUNDS = 5
STEP = 2e-3


def held(
    width: float, lengths: Sequence[float] | FloatArray, start: Equilibrium, ruling: str = "straight"
) -> Equilibrium:
    """The band between two clamps at the seam, which hold its ruling too or leave it free, from `start`."""
    frame = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ruling)
    turned = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), ruling)
    problem = build(Strip(1, width, 0.5), frame, end=turned, segments=np.asarray(lengths), formulation="mixed")
    return switch(problem, start, check=False)


def straight(width: float, segments: int) -> Equilibrium:
    """The weightless band with a straight ruling at the seam, on equal elements."""
    return solve(Strip(1, width, 0.5), closure=Closure("moebius", "straight"), segments=segments)


@dataclass(frozen=True)
class Measured:
    """Errors of one discretisation against the reference; seconds from the circle to it."""

    kind: str
    segments: int
    shape: float
    energy: float
    force: float
    steepest: float
    smallest: float
    seconds: float


def _measured(kind: str, equilibrium: Equilibrium, reference: Equilibrium, seconds: float) -> Measured:
    grid = equilibrium.surface(400, 4).points - reference.surface(400, 4).points
    support, other = equilibrium.end_support, reference.end_support
    assert support is not None
    assert other is not None
    force = np.linalg.norm(support.force - other.force) / np.linalg.norm(other.force)
    return Measured(
        kind, equilibrium.problem.lengths.size, float(np.linalg.norm(grid, axis=1).max()),
        equilibrium.energy.total / reference.energy.total - 1.0, float(force), equilibrium.max_abs_eta_prime_w_half,
        float(equilibrium.problem.lengths.min()), seconds,
    )  # fmt: skip


def _convergence(width: float) -> list[Measured]:
    """Equal elements, and elements cut where the error estimate is large, against a finer solution."""
    uniform, adaptive = [], []
    for p in UNIFORM:
        clock = time.perf_counter()
        found = straight(width, p)
        seconds = time.perf_counter() - clock
        uniform.append((held(width, found.problem.lengths, found), seconds))
    clock = time.perf_counter()
    current = straight(width, UNIFORM[0])
    for _ in range(ROUNDS):
        problem: Any = current.problem
        halved = switch(problem.with_changes(lengths=np.repeat(problem.lengths / 2.0, 2)), current, check=False)
        adaptive.append((held(width, halved.problem.lengths, halved), time.perf_counter() - clock))
        lengths = cut(problem.lengths, indicators(current, halved))
        current = switch(problem.with_changes(lengths=lengths), halved, check=False)
    finest = adaptive[-1][0]
    reference = held(width, np.repeat(finest.problem.lengths / 8.0, 8), finest)
    if reference.residual > 1e-8:
        raise AssertionError(reference.message)
    equal = [_measured("equal", e, reference, t) for e, t in uniform]
    return equal + [_measured("adaptive", e, reference, t) for e, t in adaptive]


def _without_event() -> list[Measured]:
    """w / l = 0.01 between clamps that leave the ruling free: no event, a smooth solution; equal elements."""
    found = []
    for p in (*UNIFORM[:-1], 2 * UNIFORM[-1]):
        clock = time.perf_counter()
        start = straight(0.01, min(p, UNIFORM[-2]))
        e = held(0.01, np.full(p, 1.0 / p), start, "free")
        found.append((e, time.perf_counter() - clock))
    return [_measured("equal", e, found[-1][0], t) for e, t in found[:-1]]


def _orders(runs: list[Measured], value: Callable[[Measured], float]) -> list[str]:
    out = ["-"]
    for one, other in pairwise(runs):
        order = -np.log(abs(value(other)) / abs(value(one))) / np.log(other.segments / one.segments)
        out.append(f"{order:.1f}")
    return out


def _first(runs: list[Measured], value: Callable[[Measured], float]) -> str:
    return _orders(runs, value)[1]


def _convergence_table(runs: list[Measured]) -> str:
    rows = []
    for kind in ("equal", "adaptive"):
        these = [r for r in runs if r.kind == kind]
        if not these:
            continue
        shape, energy, force = (_orders(these, f) for f in (_shape, _energy, _force))
        for r, a, b, c in zip(these, shape, energy, force, strict=True):
            rows.append(
                [kind, str(r.segments), f"{r.smallest:.1e}", f"{r.steepest:.4f}", f"{r.shape:.1e}", a,
                 f"{r.energy:.1e}", b, f"{r.force:.1e}", c, f"{r.seconds:.2f}"]
            )  # fmt: skip
    heads = [
        "elements", "p", "shortest", "abs(eta') w/2", "shape", "order", "energy", "order", "force", "order", "s",
    ]  # fmt: skip
    return page.table(heads, rows)


def _shape(r: Measured) -> float:
    return r.shape


def _energy(r: Measured) -> float:
    return r.energy


def _force(r: Measured) -> float:
    return r.force


def tolerated(width: float) -> list[Equilibrium]:
    """The band at every tolerance, each from the one before, from 24 equal elements."""
    found, states = straight(width, 24), []
    for tolerance in TOLERANCES:
        found = refine_to_tolerance(found, tolerance)
        if not found.ok:
            raise AssertionError(f"w/l = {width:g}: {found.message}")
        states.append(found)
    return states


def _scaled(equilibrium: Equilibrium) -> float:
    """Energy over pi^2."""
    return float(equilibrium.energy.total / np.pi**2)


def _energies() -> tuple[list[list[str]], dict[float, Number]]:
    """Rows, and by width the energy over pi^2 at the last tolerance with its change from the one before."""
    rows, limit = [], {}
    for width in WIDTHS:
        clock = time.perf_counter()
        states = tolerated(width)
        found = states[-1]
        cells = [cell for e in states for cell in (str(e.problem.lengths.size), f"{_scaled(e):.5f}")]
        limit[width] = Number(_scaled(found), abs(_scaled(found) - _scaled(states[-2])), "pi^2 D w / l", ".5f")
        rows.append(
            [f"{width:.4g}", *cells, f"{found.tolerance_error:.0e}",
             f"{found.lowest_eigenvalue:.3f}", f"{found.max_abs_eta:.4f}", f"{found.max_abs_eta_prime_w_half:.5f}",
             f"{time.perf_counter() - clock:.1f}"]
        )  # fmt: skip
    return rows, limit


PROBES = {
    "energy_0p2": lambda: _scaled(tolerated(0.2)[-1]),
    "energy_pinned": lambda: _scaled(straight(0.01, 100)),
    "energy_pinned_wide": lambda: _scaled(straight(0.2, 48)),
}


def differences(equilibrium: Equilibrium, h: float) -> tuple[FloatArray, FloatArray]:
    """dE/d(place of the end) (3,) and dE/d(its rotation about the axes) (3,) by central differences of step h."""
    problem: Any = equilibrium.problem
    frame = problem.end.frame
    place = np.asarray(problem.end.position)

    def energy(shift: FloatArray, turn: FloatArray) -> float:
        turned = Rotation.from_rotvec(turn).as_matrix() @ frame
        end = Clamp(tuple(place + shift), tuple(turned[:, 2]), tuple(turned[:, 1]), problem.end.ruling)
        moved = switch(problem.with_changes(end=end), equilibrium, check=False)
        if moved.residual > 1e-8:
            raise AssertionError(moved.message)
        return moved.energy.total

    none, steps = np.zeros(3), h * np.eye(3)
    force = [(energy(step, none) - energy(-step, none)) / (2.0 * h) for step in steps]
    moment = [(energy(none, step) - energy(none, -step)) / (2.0 * h) for step in steps]
    return np.array(force), np.array(moment)


def extrapolated(equilibrium: Equilibrium, h: float = STEP) -> tuple[FloatArray, FloatArray]:
    """`differences` with the error's terms of order h^2 and h^4 removed (Richardson)."""
    levels = [differences(equilibrium, h / 2**k) for k in range(3)]
    out = []
    for kind in (0, 1):
        a, b, c = (level[kind] for level in levels)
        ab, bc = (4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0
        out.append((16.0 * bc - ab) / 15.0)
    return out[0], out[1]


def _multipliers(equilibrium: Equilibrium) -> tuple[str, float]:
    support = equilibrium.end_support
    assert support is not None
    rows, worst = [], 0.0
    for name, exact, measured in zip(
        ("force", "moment"), (support.force, support.moment), extrapolated(equilibrium), strict=True
    ):
        error = float(np.abs(measured - exact).max() / np.linalg.norm(exact))
        worst = max(worst, error)
        rows.append([name, _vector(exact), _vector(measured), f"{error:.1e}"])
    return page.table(["on the end", "multipliers", "differences", "largest difference / size"], rows), worst


def _vector(value: FloatArray) -> str:
    return ", ".join(f"{v + 0.0:.7f}" for v in np.where(np.abs(value) < 5e-8, 0.0, value))


def shifted(equilibrium: Equilibrium, at: float) -> Equilibrium:
    """The same weightless band cut at `at`: omega and eta change sign beyond the old seam; solved again from there."""
    problem: Any = equilibrium.problem
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)]) + at
    sign = np.where(s > 1.0, -1.0, 1.0)
    s = np.clip(np.where(s > 1.0, s - 1.0, s), 0.0, 1.0)
    return solve(
        problem.strip, closure=Closure("moebius"), segments=problem.lengths,
        seed_curvature=tuple(sign * equilibrium.omega(s)), seed_ruling=tuple(sign * equilibrium.eta(s)),
    )  # fmt: skip


def other_zero(equilibrium: Equilibrium) -> float:
    """The first s > 0 with eta = 0 away from the seam."""
    s = np.linspace(0.05, 0.5, 20001)
    eta = equilibrium.eta(s)
    k = int(np.nonzero(eta[:-1] * eta[1:] < 0)[0][0])
    return float(s[k] - eta[k] * (s[k + 1] - s[k]) / (eta[k + 1] - eta[k]))


def _seams() -> tuple[str, dict[str, tuple[FloatArray, FloatArray]], Equilibrium]:
    """The three conditions on 100 equal elements: energies, and omega and eta at s (moved onto each other)."""
    clamped = run_way(load("moebius_6_1_clamped")).equilibrium
    pinned = straight(0.01, 100)
    zero = other_zero(pinned) - 0.5 * pinned.problem.lengths[0]  # the middle of the first element is put there
    free = shifted(pinned, zero)
    s = np.linspace(0.0, 1.0, 4001)
    back = (s - zero) % 1.0
    sign = np.where(s < zero, -1.0, 1.0)
    shown = {
        "eta(l) = -eta(0), moved": (sign * free.omega(back), sign * free.eta(back)),
        "eta(0) = eta(l) = 0": (pinned.omega(s), pinned.eta(s)),
        "no condition on eta": (clamped.omega(s), clamped.eta(s)),
    }
    away = (s > 0.05) & (s < 0.95)
    rows = []
    for (name, (omega, eta)), e in zip(shown.items(), (free, pinned, clamped), strict=True):
        turned = -1.0 if omega[2000] * shown["eta(0) = eta(l) = 0"][0][2000] < 0 else 1.0
        bend = np.abs(turned * omega - pinned.omega(s))[away].max()
        ruling = np.abs(turned * eta - pinned.eta(s))[away].max()
        rows.append(
            [name, f"{e.energy.total / np.pi**2:.5f}", f"{e.lowest_eigenvalue:.4f}", f"{e.eta([0.0])[0]:+.4f}",
             f"{e.eta([1.0])[0]:+.4f}", f"{e.omega([0.0])[0]:+.3f}", f"{e.omega([1.0])[0]:+.3f}", f"{bend:.1e}",
             f"{ruling:.1e}"]
        )  # fmt: skip
        shown[name] = turned * omega, turned * eta
    heads = [
        "seam", "energy / pi^2", "lowest eigenvalue", "eta(0)", "eta(l)", "omega(0)", "omega(l)",
        "omega against the second, 0.05 < s < 0.95", "eta, there",
    ]  # fmt: skip
    return page.table(heads, rows), shown, clamped


def run(out: Path) -> dict[str, Number]:
    energies, errors = _energies()
    limit = {width: number.value for width, number in errors.items()}
    known = limit[1 / 30]
    if abs(known / KNOWN - 1.0) > 1e-3:
        raise AssertionError(f"energy at w/l = 1/30: {known:.5f} pi^2")
    runs = {width: _convergence(width) for width in CASES}
    smooth = _without_event()
    seams, shown, clamped = _seams()
    forces, worst = _multipliers(clamped)
    if worst > 1e-6:
        raise AssertionError(f"multipliers against differences: {worst:.1e}")
    _picture(out / "moebius.png", limit, runs, shown)
    narrow = np.polyfit(list(limit)[:3], [limit[w] for w in list(limit)[:3]], 2)[-1]
    heads = ["w / l"]
    for tolerance in TOLERANCES:
        heads += [f"p at {tolerance:g}", "energy / pi^2"]
    heads += ["estimated error", "lowest eigenvalue", "largest abs(eta)", "largest abs(eta') w/2", "s, all"]
    parts = [
        "Weightless bands, nu = 0.5 (the energy does not depend on it without natural curvature), Wunderlich's energy. "
        "Units l and D w / l. The way from a circle to the band is built in (thesis, algorithm 2).",
        "## Energy against width\n\nElements placed by tolerance (Hausdorff distance / l), each from the last, from 24 "
        f"equal ones; nothing is placed by hand. Starostin and van der Heijden (2007) give {KNOWN} pi^2 at w / l = "
        f"1/30; here {known:.4f}. The first three widths extrapolate to {narrow:.3f} at w = 0. |eta| "
        f"stays below 1 at the "
        f"narrow end, as the thesis remarks of figure 6.5.",
        page.table(heads, energies),
    ]
    for width in CASES:
        good = [r for r in runs[width] if r.kind == "adaptive"][-1]
        equal = [r for r in runs[width] if r.kind == "equal"][-1]
        near = "is resolved from p = 24 on" if width == 0.1 else "needs elements shorter than w = 0.01"
        parts += [
            f"## Convergence, w / l = {width:g}\n\nThe seam as two clamps that hold the ruling straight too: the same "
            "equilibrium, with a force. Errors against the last adaptive elements cut into 8: shape, the largest "
            "distance of equal particles (material coordinates) in l; energy and force relative. s: from the circle. "
            f"The event {near}: abs(eta') w/2 tells, which is 1 at the event. On equal elements {equal.segments} leave "
            f"an error in shape of {equal.shape:.0e}, adaptive ones {good.shape:.0e} with {good.segments}.",
            _convergence_table(runs[width]),
        ]
    parts += [
        "## Convergence without an event, w / l = 0.01\n\nThe same between clamps that leave the ruling free (the "
        f"third condition below): a smooth solution. Reference: {2 * UNIFORM[-1]} equal elements. "
        f"Orders {_first(smooth, _shape)} (shape), {_first(smooth, _energy)} (energy) and {_first(smooth, _force)} "
        "(force) from 24 to 48 elements, as for smooth scenes elsewhere; below errors of about 1e-7 "
        "they fall towards 2 (why "
        "was not looked into). With the event they are 2 once it is resolved, at errors a hundred times "
        "as large or more, "
        "and below 2 before.",
        _convergence_table(smooth),
        "## The three seam conditions (figure 6.3)\n\nw / l = 0.01, 100 equal elements. The middle of "
        "the first element "
        "of a free seam is put where eta = 0, as without weight every place is as good "
        "(`MixedProblem.slides`); here it was started at another zero of "
        "eta than the event and stays there: the seam slides along the band and the shape stays. Its energy differs "
        "from the second only by where the joints lie about the event. Without a condition on eta "
        "(scene moebius_6_1_clamped, algorithm 2 with its weight on the way) both omega and eta are equal at the ends "
        "instead of opposite: the surface is not continuous there, there is no event, and the energy is lower.",
        seams,
        "## Forces against differences of the energy\n\nScene moebius_6_1_clamped; the end is moved and turned by "
        f"+-{STEP:g}, +-{STEP / 2:g}, +-{STEP / 4:g} (l, rad), solved again each time, and extrapolated.",
        forces,
        "![moebius](moebius.png)\n\nTop left: energy. Top middle, right: convergence, equal (circles) and adaptive "
        "(triangles). Bottom left: the curvature diagram (figure 6.5), which tends to a limit as w falls: a smooth "
        "outer arc that ends in the corner abs(kappa_1) = abs(kappa_3), eta = -1, and the event, an inner arc from "
        "there to zero that overshoots the corner in kappa_1 (van der Heijden and Audoly 2022, [HA22] of the thesis, "
        "whose limit curve was not at hand). Bottom middle, right: the seam conditions (figure 6.3).",
    ]
    page.write(out / "moebius.md", "Moebius bands (thesis, 6.1.1)", "python -m tests.validation moebius", *parts)
    return {
        **{f"energy_{width:.2g}".replace(".", "p"): number for width, number in errors.items()},
        "energy_pinned": _solved(straight(0.01, 100)),
        "energy_pinned_wide": _solved(straight(0.2, 48)),
        "multipliers": rounding(worst),
        **_shapes(runs),
    }


def _solved(equilibrium: Equilibrium) -> Number:
    """Energy over pi^2 on these elements: good to what the minimiser leaves."""
    return Number(_scaled(equilibrium), 1e-9 * _scaled(equilibrium), "pi^2 D w / l", ".7f")


def _shapes(runs: dict[float, list[Measured]]) -> dict[str, Number]:
    """Of the finest equal and the finest placed elements: how many, and their error of shape, of second order against
    a reference of eight times as many as the placed ones: that leaves a 64th of theirs."""
    found = {}
    for width, these in runs.items():
        last = {kind: [r for r in these if r.kind == kind][-1] for kind in ("equal", "adaptive")}
        error = last["adaptive"].shape / 63.0
        for kind, r in last.items():
            name = f"{kind}_{width:g}".replace(".", "p")
            found[f"segments_{name}"] = Number(r.segments, 0, shown="d")
            found[f"shape_{name}"] = Number(r.shape, error, "l", ".1e")
    return found


def _picture(
    path: Path,
    limit: dict[float, float],
    runs: dict[float, list[Measured]],
    shown: dict[str, tuple[FloatArray, FloatArray]],
) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullFormatter

    curves = ((_shape, "tab:blue", "shape"), (_energy, "tab:red", "energy"), (_force, "0.4", "force"))
    figure, axes = plt.subplots(2, 3, figsize=(15, 9), constrained_layout=True)
    axes[0, 0].plot(list(limit), list(limit.values()), "o-", ms=4)
    axes[0, 0].plot([1 / 30], [KNOWN], "k+", ms=12, label="Starostin and van der Heijden 2007")
    axes[0, 0].set_xlabel("w / l")
    axes[0, 0].set_ylabel("energy / (pi^2 D w / l)")
    axes[0, 0].legend(fontsize=8)
    for axis, (width, found) in zip(axes[0, 1:], runs.items(), strict=True):
        for kind, style in (("equal", "o-"), ("adaptive", "^--")):
            these = [r for r in found if r.kind == kind]
            for value, colour, name in curves:
                x, y = [r.segments for r in these], [abs(value(r)) for r in these]
                axis.loglog(x, y, style, color=colour, ms=5, label=f"{name}, {kind}")
        axis.set_title(f"w / l = {width:g}", fontsize=10)
        axis.set_xlabel("p")
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set_ylabel("error")
        axis.legend(fontsize=7)
    for width in (0.1, 0.05, 0.02, 0.01, 0.005, 0.002):
        one = band(width)
        s = np.unique(np.concatenate([np.linspace(0.0, 0.5, 1001), np.linspace(0.0, min(8.0 * width, 0.5), 800)]))
        bend = np.abs(one.omega(s))
        axes[1, 0].plot(bend, bend * one.eta(s), lw=1.0, label=f"w / l = {width:g}")
    axes[1, 0].plot([0.0, 6.5], [0.0, -6.5], "k:", lw=0.8, label="eta = -1")
    axes[1, 0].set_xlabel("kappa_1 l")
    axes[1, 0].set_ylabel("kappa_3 l")
    axes[1, 0].legend(fontsize=7)
    s = np.linspace(0.0, 1.0, 4001)
    for (name, (omega, eta)), style in zip(shown.items(), ("-", "--", ":"), strict=True):
        axes[1, 1].plot(s, omega, style, label=name)
        axes[1, 2].plot(s, eta, style, label=name)
    axes[1, 1].set_ylabel("omega l")
    axes[1, 2].set_ylabel("eta")
    for axis in axes[1, 1:]:
        axis.set_xlabel("s / l")
        axis.legend(fontsize=8)
    for axis in axes.flat:
        axis.grid(True, which="both", lw=0.3, alpha=0.6)
    figure.savefig(path, dpi=110)
    plt.close(figure)
