"""Would a higher degree pay? Unknowns per error on coils and on a Moebius band (prototype; results/hp.md)."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import load
from ribbon import Equilibrium
from ribbon.find.adaptive import solve_to_tolerance
from tests.peers.cases import Case, case, reference
from tests.validation import page
from tests.validation.number import Number, rounding
from tests.validation.ribbon.hp_galerkin import Galerkin

#: It takes no times that its page rests on.
ALONE = False

FloatArray = NDArray[np.float64]

#: Coils, and the segments on which the prototype of degree 1 is held against `ribbon.solve`.
COILS = {"coil_10_100": 40, "coil_40_1200": 160, "coil_100_7500": 226}
DEGREES = (1, 2, 3, 4, 6, 8)
#: Distances (l) of the free end that are asked for.
ERRORS = (1e-4, 1e-6, 1e-8)
#: Numbers of elements tried; of degree 1 they are `ribbon.solve`'s segments, and more of them.
LADDER = tuple(round(5 * 2 ** (k / 2)) for k in range(11))
FURTHER = tuple(round(5 * 2 ** (k / 2)) for k in range(11, 23))
#: The coil on which the probes ask the prototype, degree and elements, and what solve_bvp leaves of its free end (l).
LIGHTEST, REQUESTED, REFERENCE = "coil_10_100", ((1, 20), (2, 10), (4, 5)), 1e-9
#: Unknowns up to which the prototype is asked (its Jacobian is one of differences); segments it begins from.
MOST, START = 700, 1280

BAND, TOLERANCE = "moebius_6_1", 1e-6
#: Errors (rad, of the frame along the band) that are asked for there; degrees; points of an element; smallest element.
TURNS = (1e-2, 1e-3, 1e-4)
BAND_DEGREES = (1, 2, 4)
POINTS, SMALLEST, HIGHEST = 48, 1e-5, 8


def _galerkin(found: Case, segments: int, degree: int, fine: Equilibrium) -> FloatArray:
    """Free end (3,) of the prototype, begun at a fine ribbon."""
    galerkin = Galerkin(found, segments, degree)
    begin = np.concatenate([fine.omega(galerkin.nodes), fine.eta(galerkin.nodes)])
    return galerkin.tip(galerkin.solve(begin))


@cache
def fine_ribbon(name: str) -> Equilibrium:
    """A coil on the segments that the prototype begins from."""
    return case(name, 1).ribbon(START)


def _tip_error(degree: int, segments: int) -> float:
    """Error (l) of the lightest coil's free end by the prototype."""
    found = case(LIGHTEST, 1)
    return found.error(_galerkin(found, segments, degree, fine_ribbon(LIGHTEST)))


def _ribbon_error(segments: int) -> float:
    """Error (l) of the lightest coil's free end by `ribbon.solve`, the prototype of degree 1."""
    found = case(LIGHTEST, 1)
    return found.error(found.ribbon(segments).end.position)


#: The prototype of other degrees takes a quarter of a minute to compile: its errors are kept and not probed.
PROBES = {"error_20": lambda: _ribbon_error(20), "error_57": lambda: _ribbon_error(57)}


def _coil(found: Case, beside: int) -> tuple[dict[int, list[tuple[int, float]]], float]:
    """Degree -> (unknowns, error) of every number of elements; how far degree 1 is from `ribbon.solve` (l)."""
    fine = fine_ribbon(found.name.partition(",")[0])
    rows: dict[int, list[tuple[int, float]]] = {}
    same = float(np.abs(_galerkin(found, beside, 1, fine) - found.ribbon(beside).end.position).max())
    for degree in DEGREES:
        rows[degree] = []
        for segments in LADDER if degree > 1 else LADDER + FURTHER:
            unknowns = 2 * (segments * degree + 1)
            if degree == 1:
                tip = found.ribbon(segments).end.position
            elif unknowns > MOST:
                break
            else:
                try:
                    tip = _galerkin(found, segments, degree, fine)
                except AssertionError:  # so coarse that there is none nearby
                    continue
            rows[degree].append((unknowns, found.error(tip)))
            if rows[degree][-1][1] <= ERRORS[-1]:
                break
        print(f"  {found.name}, degree {degree}: {rows[degree][-1]}", flush=True)
    return rows, same


def _fewest(rows: list[tuple[int, float]], error: float) -> str:
    """Unknowns from which on the error is kept; "-": never."""
    kept = "-"
    for unknowns, reached in reversed(rows):
        if reached > error:
            break
        kept = str(unknowns)
    return kept


def _fit(field: Callable[[FloatArray], FloatArray], low: float, high: float, degree: int) -> float:
    """Turn (rad) by which polynomials of the degree in omega and eta miss the band on [low, high]."""
    x = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    omega, eta = field(low + 0.5 * (high - low) * (1.0 + x))
    basis = np.polynomial.legendre.legvander(x, degree)
    weight = np.sqrt(np.sqrt(1.0 - x * x))[:, None]
    fits = [basis @ np.linalg.lstsq(weight * basis, weight[:, 0] * v, rcond=None)[0] for v in (omega, eta)]
    missed = np.abs(fits[0] - omega) + np.abs(fits[0] * fits[1] - omega * eta)
    return float(0.5 * (high - low) * np.pi / POINTS * np.sum(missed * np.sqrt(1.0 - x * x)))


def _greedy(field: Callable[[FloatArray], FloatArray], degree: int | None) -> list[tuple[int, float]]:
    """Unknowns and turn as the worst element is halved; degree None: halved or raised, whichever is gained by more."""
    count = itertools.count()
    begin = [(k / 8, (k + 1) / 8) for k in range(8)]
    heap: list[Any] = []
    for low, high in begin:
        heapq.heappush(heap, (-_fit(field, low, high, degree or 1), next(count), low, high, degree or 1))
    found = []
    while True:
        total, unknowns = -sum(entry[0] for entry in heap), 2 * sum(entry[4] for entry in heap)
        found.append((unknowns, total))
        if total <= TURNS[-1] or unknowns > 3000:
            return found
        worst, _, low, high, d = heapq.heappop(heap)
        middle = 0.5 * (low + high)
        halves = [(_fit(field, *part, d), *part, d) for part in ((low, middle), (middle, high))]
        chosen = halves
        if degree is None and d < HIGHEST:
            raised = [(_fit(field, low, high, d + 1), low, high, d + 1)]
            rates = [np.log(-worst / max(sum(p[0] for p in parts), 1e-300)) / more for parts, more in (
                (halves, d), (raised, 1))]  # fmt: skip
            chosen = raised if rates[1] > rates[0] else halves
        if high - low < SMALLEST:
            return found
        for error, a, b, each in chosen:
            heapq.heappush(heap, (-error, next(count), a, b, each))


def _band() -> tuple[Equilibrium, dict[str, list[tuple[int, float]]]]:
    arguments: dict[str, Any] = ribbon_arguments(load(BAND))
    del arguments["segments"]
    band = solve_to_tolerance(tolerance=TOLERANCE, **arguments)

    def field(s: FloatArray) -> FloatArray:
        return np.array([band.omega(s), band.eta(s)])

    found = {f"degree {degree}": _greedy(field, degree) for degree in BAND_DEGREES}
    return band, {**found, "each its own": _greedy(field, None)}


def _unknowns(word: str, rows: list[tuple[int, float]], errors: tuple[float, ...]) -> dict[str, Number]:
    """The fewest unknowns from which on each error is kept."""
    kept = {f"{word}_{error:.0e}".replace("-0", ""): _fewest(rows, error) for error in errors}
    return {name: Number(int(value), 0, shown="d") for name, value in kept.items() if value != "-"}


def run(out: Path) -> dict[str, Number]:
    """Writes hp.md."""
    parts, numbers, apart = [], {}, []
    for name, beside in COILS.items():
        found = case(name, 1)
        reference(found.name)
        rows, same = _coil(found, beside)
        apart.append(same)
        for degree, these in rows.items():
            numbers |= _unknowns(f"{name}_{degree}", these, ERRORS)
        parts += [
            f"### {found.name}",
            page.table(
                ["degree", *(f"{error:g} l" for error in ERRORS)],
                [[str(d), *(_fewest(rows[d], error) for error in ERRORS)] for d in DEGREES],
            ),
            f"Degree 1, {beside} elements: {same:.1e} l from `ribbon.solve`.",
        ]
    band, fits = _band()
    for word, these in fits.items():
        numbers |= _unknowns(f"band_{word.replace(' ', '_')}", these, TURNS)
    for degree, segments in REQUESTED:
        numbers[f"error_{degree}_{segments}"] = Number(_tip_error(degree, segments), REFERENCE, "l", ".1e")
    for segments in (20, 57):
        numbers[f"error_{segments}"] = Number(_ribbon_error(segments), REFERENCE, "l", ".1e")
    page.write(
        out / "hp.md", "Elements of a higher degree: unknowns per error (prototype)", "python -m tests.validation hp",
        "Omega and eta continuous and of one degree on equal elements, Sadowsky's energy, the frame to rounding "
        "(`tests/validation/ribbon/hp_galerkin.py`); fewest unknowns of a ladder of elements from which on the free "
        "end is within the distance of solve_bvp's. Degree 1 is the ribbon element: fourth order at the free end, "
        "as a Galerkin method has there twice the order of its fields.",
        *parts,
        f"### {BAND}, Wunderlich's energy",
        f"No solves: its state on {band.problem.lengths.size} segments ({band.status.code}), approximated on elements "
        "that are halved where they miss most; turn of the frame that is missed (rad). The last row halves or raises "
        "the degree, whichever gains more an unknown. The event, where the ruling turns over a short length, wants "
        "short elements, the rest a higher degree.",
        page.table(
            ["elements", *(f"{turn:g} rad" for turn in TURNS)],
            [[name, *(_fewest(rows, turn) for turn in TURNS)] for name, rows in fits.items()],
        ),
    )  # fmt: skip
    return numbers | {"apart": rounding(max(apart), "l", ".1e")}
