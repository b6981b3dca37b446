"""What is undetermined or lies on the edge: straight, unsupported, critical, taut."""

from __future__ import annotations

import json
import math
import re
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from compare.battery.case import Case, Check, Rung, ends_as, holds, near
from compare.battery.judge.ribbon import judged
from compare.battery.processes import ran
from compare.battery.scenes import changed, solved
from ribbon import Clamp, Strip, solve

#: Most CPU seconds for a strip without any load, and how far from its critical load nothing is said of stability.
_NOTHING = 2.0
_CRITICAL = 1e-4
#: Time for a solve, s of the processor.
_BUDGET = 30.0


def _straight(width: Rung) -> Iterator[Check]:
    """Neither weight nor curl: nothing bends, no ruling is determined, and no shape has less energy."""
    keys = {"strip.gamma": 0.0, "strip.width": float(width)}
    for energy in ("wunderlich", "sadowsky"):
        solved(changed("cantilever", {**keys, "model.energy": energy}))  # what a process compiles once
        began = time.process_time()
        state = solved(changed("cantilever", {**keys, "model.energy": energy}))
        yield Check(f"time (CPU s), {energy}", time.process_time() - began, _NOTHING, timed=True)
        yield ends_as(state, "converged")
        assert state.energy is not None
        assert state.end is not None
        yield near(f"energy, {energy}", state.energy.total or 0.0, 0.0, 1e-14)
        off = float(np.abs(state.end.position - [0.0, 0.0, 1.0]).max())
        yield Check(f"end apart from the straight strip's (l), {energy}", off, 1e-14)
        yield from judged(state.native)


def _column(share: Rung) -> Iterator[Check]:
    """Greenhill's column: upright it buckles at Gamma = (9/4) j^2, j the first zero of J_(-1/3), 7.8373."""
    from scipy.optimize import brentq
    from scipy.special import jv

    critical = 2.25 * brentq(lambda z: jv(-1.0 / 3.0, z), 1.0, 2.5) ** 2
    factor = float(share)
    keys = {"strip.gamma": factor * critical, "gravity.up": [0.0, 0.0, 1.0], "model.elements": 40}
    state = solved(changed("cantilever", keys))
    yield from _either_side(state, factor)


def _on_edge(share: Rung) -> Iterator[Check]:
    """A strip on edge under its weight: as a rod it buckles sideways at Gamma = 6 j sqrt(B C), j the first zero of
    J_(-1/6), 12.854 sqrt(B C), with B = 1, C = 2 (1 - nu) (1 - 0.630 h/w), Saint-Venant's (D w)."""
    from scipy.optimize import brentq
    from scipy.special import jv

    factor, nu, slenderness = float(share), 0.3, 1e-3
    series = math.fsum(math.tanh(n * math.pi / (2.0 * slenderness)) / n**5 for n in range(1, 200, 2))
    twist = 2.0 * (1.0 - nu) * (1.0 - 192.0 / math.pi**5 * slenderness * series)
    critical = 6.0 * brentq(lambda z: jv(-1.0 / 6.0, z), 1.5, 2.5) * math.sqrt(twist)
    keys = {
        "strip.gamma": factor * critical, "strip.poisson": nu, "shell.width_to_thickness": [1.0 / slenderness],
        "model.energy": "kirchhoff", "model.in_plane": False, "model.elements": 80, "gravity.up": [1.0, 0.0, 0.0],
        "seed.curvature": 0.0, "clamp.start.ruling": None,
    }  # fmt: skip
    state = solved(changed("cantilever", keys))
    yield from _either_side(state, factor)


def _either_side(state: object, factor: float) -> Iterator[Check]:
    """The straight strip: stable below its critical load, a saddle above, indifferent to rounding at it."""
    from compare.models.base import State

    assert isinstance(state, State)
    codes = ("converged",) if factor < 1.0 - _CRITICAL else ("unstable",) if factor > 1.0 + _CRITICAL else (
        "converged", "unstable",
    )  # fmt: skip
    yield ends_as(state, *codes)
    assert state.lowest_eigenvalue is not None
    if abs(factor - 1.0) <= _CRITICAL:
        bound = 1e-5 + 3.0 * abs(factor - 1.0)  # it passes zero in proportion to the load
        yield Check("lowest eigenvalue at the critical load", abs(state.lowest_eigenvalue), bound)
    yield from judged(state.native)


def _ring(turns: Rung) -> Iterator[Check]:
    """Closed, nothing holds it: six rigid motions, and the coil of K = 2 pi n turned n times is at rest unstressed."""
    from ribbon import Closure, Strip, solve

    n = int(turns)
    k = 2.0 * math.pi * n
    found = solve(Strip(1.0, 0.02, natural_curvature=k), closure=Closure("circle", turns=n), segments=max(20, 10 * n))
    yield holds("status converged", found.ok, found.message)
    yield near("energy, -K^2/2", found.energy.total, -0.5 * k * k, 1e-10)
    yield from judged(found)


def _flat_ring(segments: Rung) -> Iterator[Check]:
    """A flat strip closed to a ring: energy 2 pi^2 and curvature 2 pi, on any number of segments."""
    from ribbon import Closure, Strip, solve

    found = solve(Strip(1.0, 0.02), closure=Closure("circle"), segments=int(segments))
    yield holds("status converged", found.ok, found.message)
    yield near("energy, 2 pi^2", found.energy.total, 2.0 * math.pi**2, 1e-10)
    yield from judged(found)


def _compressed(shortening: Rung) -> Iterator[Check]:
    """Clamps in line, moved together by a part d of the length: Euler's strut, energy 4 pi^2 d (1 + O(d))."""
    from ribbon import Clamp, Strip, solve

    d = float(shortening)
    found = solve(Strip(1.0, 0.05), Clamp(), end=Clamp(position=(0.0, 0.0, 1.0 - d)), segments=40, leave_saddle=True)
    yield holds("status converged", found.ok, found.message)
    yield Check("energy over 4 pi^2 d, from 1", abs(found.energy.total / (4.0 * math.pi**2 * d) - 1.0), d + 1e-5)
    yield from judged(found)


_LOADS = (0.9, 0.999, 1.001, 1.1)


def _meeting(rung: Rung) -> Iterator[Check]:
    found = solve(Strip(1.0, 0.05), Clamp(), end=Clamp((0.0, 0.0, float(rung))), budget=_BUDGET)
    yield holds("converged", found.status.code == "converged", f"{found.status.code}: {found.message}")
    yield from judged(found)
    if float(rung) <= 1e-9:
        yield near("energy", found.energy.total, 2.0 * math.pi**2, 1e-6)


#: Slack (l) from which on down a taut strip's residual (some 1e-8 of its forces) is rounding: it is solved on one
#: processor, and on another said to be lost in rounding.
_ROUNDED = 1e-12
#: A tape between two holders: steel, 0.5 m x 20 mm x 0.1 mm.
_TAPE = """
[strip]
length = 0.5
width = 0.02
thickness = 1e-4
young = 2e11
density = 7850.0
poisson = 0.3
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, {place!r}]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[model]
elements = 20
"""


def _taut(rung: Rung) -> Iterator[Check]:
    """The arch without weight by the solver, and the tape of steel under its weight as its user sees it."""
    slack = float(rung)
    found = solve(Strip(1.0, 0.05), Clamp(), end=Clamp((0.0, 0.0, 1.0 - slack)), budget=_BUDGET)
    yield holds("converged", found.status.code == "converged", f"{found.status.code}: {found.message}")
    # an arch that is too short by d has the energy 4 pi^2 d of two clamped ends, to first order in d
    arch = 4.0 * math.pi**2 * slack
    yield Check("energy over that of the arch, less 1", abs(found.energy.total - arch) / (arch or 1.0), slack + 2e-3)
    determined = found.end_support is not None and bool(np.all(np.isfinite(found.end_support.force)))
    yield holds("a thrust where there is slack, a reason where there is none", determined == (slack > 0.0))
    if found.lowest_eigenvalue == math.inf:
        yield holds("says that no freedom is left", "no freedom is left" in found.message, found.message)
    yield from _tape(slack)


def _tape(slack: float) -> Iterator[Check]:
    """result.json, the standard output and the first line of the tape's answer."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "tape.toml").write_text(_TAPE.format(place=0.5 * (1.0 - slack)))
        seen = ran(("solve", "tape.toml", "--json", "--out", "o"), place)
        told = ran(("solve", "tape.toml", "--out", "o"), place)
    yield holds("it ends as a command does, both times", seen.plain and told.plain, f"{seen.err}{told.err}"[-300:])
    result = json.loads(seen.out or "{}")
    words = re.findall(r"\b(?:nan|inf)\b", seen.out + told.out, re.IGNORECASE)
    yield holds("no number that is none is told", not words, " ".join(words))
    force = result.get("forces", {}).get("end")
    if 0.0 < slack <= _ROUNDED and result["status"] == "not_converged":
        yield holds("what is lost in rounding is said to be", "are lost in rounding" in result["answer"]["text"])
        yield holds("no force is told of it", force is None, str(force))
        return
    if slack > 0.0:
        string = result["gamma"] / math.sqrt(24.0 * slack)  # its layers at the clamps apart
        layers = 2.0 / math.sqrt(string) + 0.05
        yield Check("tension over a string's, less 1", abs(force[2] / string - 1.0) if force else math.nan, layers)
        return
    yield holds("the forces are null, with a reason", force is None and bool(result.get("forces_why")), str(force))
    yield holds("the answer is not called good", result.get("answer", {}).get("grade") != "good")
    # Timoshenko's plate between built-in edges: a shell of 100 x 8 elements has 2985.6 D w / l^2 and 0.0020416 l
    yield near("tension of a strip that stretches", result.get("taut_tension") or math.nan, 2985.6, 5e-3)
    yield Check("its sag over the shell's, less 1", abs((result.get("taut_sag") or math.nan) / 0.0020416 - 1.0), 1e-3)


def _few(rung: Rung) -> Iterator[Check]:
    found = solve(Strip(1.0, 0.05), Clamp(), end=Clamp((0.0, 0.1, 0.8)), segments=int(rung), budget=_BUDGET)
    code = found.status.code
    yield holds("converged, or not", code in ("converged", "saddle", "not_converged", "infeasible"), found.message)
    if found.lowest_eigenvalue == math.inf:
        yield holds("says that no freedom is left", "no freedom" in found.message, found.message)


CASES: tuple[Case, ...] = (
    Case(
        "degenerate/straight",
        "omega = 0 everywhere: the ruling moves nothing, all its modes are null",
        "stable, energy zero, end in line, at once: no shape has less energy, and no ruling has to be looked for",
        "w / l", _straight, (0.05,), (1e-6, 1e-3, 0.5),
    ),
    Case(
        "degenerate/column",
        "an upright column near its critical weight, begun straight",
        "stable below Greenhill's 7.8373, a saddle above: the straight shape is stationary on both sides",
        "Gamma over critical", _column, _LOADS, (0.99, 0.9999, 1.0, 1.0001, 1.01, 2.0),
    ),
    Case(
        "degenerate/on_edge",
        "a strip on edge near the weight at which it falls over, begun straight",
        "stable below 12.854 sqrt(B C), a saddle above (rod, Bessel's function)",
        "Gamma over critical", _on_edge, _LOADS, (0.99, 0.9999, 1.0, 1.0001, 1.01, 2.0),
    ),
    Case(
        "degenerate/ring",
        "a closed coil without supports: six free motions, natural curvature of whole turns",
        "at rest unstressed, energy -K^2/2",
        "turns", _ring, (1,), (2, 3, 5, 10),
    ),
    Case(
        "degenerate/flat_ring",
        "three segments are the fewest of a band",
        "energy 2 pi^2 on any number, for the circle is in the space of shapes",
        "segments", _flat_ring, (3, 20), (4, 100, 500),
    ),
    Case(
        "degenerate/compressed",
        "clamps in line nearly as far apart as the strip is long: the constraint's gradients become dependent",
        "Euler's strut: energy 4 pi^2 d",
        "d", _compressed, (0.1, 1e-3), (1e-2, 1e-4, 1e-6, 1e-8),
    ),
    Case(
        "degenerate/clamps_that_meet",
        "both ends clamped at one place: the chord has no direction, no arc subtends it",
        "a whole circle, 2 pi^2, whose lowest eigenvalue is positive",
        "distance of the clamps / l",
        _meeting,
        (1e-3, 1e-9, 0.0),
    ),
    Case(
        "degenerate/taut_clamps",
        "clamps as far apart as the strip is long, or hardly less: the rows' derivatives become dependent",
        "the shallow arch of energy 4 pi^2 d, and under weight a string's tension; at its full length straight, its "
        "tension undetermined and said to be, in JSON and in words, with that of a strip that stretches",
        "shortening / l",
        _taut,
        (1e-6, 1e-8, 1e-12, 0.0),
        (1e-9, 1e-10),
    ),
    Case(
        "degenerate/few_segments",
        "two clamps and one to three segments: as many rows as unknowns, or more",
        "a status that is true; where no freedom is left nothing can be unstable, and that is said",
        "segments",
        _few,
        (1, 2, 3, 4),
    ),
)  # fmt: skip
