"""Thesis 7.2, the hysteresis: branches U, US and S of ribbons, rods and shells, their folds and branch points."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from compare.measure.mesh_limit import Settled
from ribbon.find.branch.passages import Grading
from tests.validation.number import Number
from tests.validation.pieces import Pieces
from tests.validation.workbench import shift_finite, shift_shells, shift_shot
from tests.validation.workbench.shift_diagram import Diagram, Shot, Thin, diagram, goes_back, located_to, thin, width
from tests.validation.workbench.shift_followed import RIPPLE, Case, flat, tilted, upright
from tests.validation.workbench.shift_shells import Shell
from tests.validation.workbench.shift_told import picture, write

#: It takes no times that its page rests on.
ALONE = False

#: Ribbons whose elements are placed at every point, and rods on equal ones.
CASES = (
    Case("wunderlich", 40.0, 0.0, Grading(0.005, 0.0005, 0.05)),
    Case("wunderlich", 20.0, 0.0, Grading(0.005, 0.001, 0.05)),
    Case("wunderlich", 10.0, 0.0, Grading(0.01, 0.002, 0.1)),
    Case("wunderlich", 6.0, 0.0, Grading(0.01, 0.002, 0.1)),
)
#: The rod: without weight its shape hangs on the ratio of its stiffnesses, which is that of w/h, and not on w/l.
ROD = Case("kirchhoff", 20.0, 50.0, None, 50)
#: A branch of a ribbon on other elements than the rest: S; and US of the narrowest, whose passages beside the clamps,
#: 0.001 to 0.004 l from them, held by elements of 0.001 l make a fold at every step.
OTHER = {
    (CASES[0], "us"): Case("wunderlich", 40.0, 0.0, Grading(0.01, 0.0002, 0.1), easy=11, steps=1200),
    (CASES[1], "s"): Case("wunderlich", 20.0, 0.0, Grading(0.005, 0.0005, 0.05)),
}
#: `finite`: on equal elements that step over the layer at its clamps, halved.
FINITE = tuple(Case("finite", narrow, 50.0, None, 50) for narrow in (40.0, 20.0))
#: `finite` on elements that stand where its curvature crosses 1 / zeta.
CROSSED = Case("finite", 20.0, 50.0, Grading(0.01, 0.001, 0.1))
#: Shells: 1 over w/l, w/h, meshes whose elements are `FINER` times shorter each.
SHELLS = (
    (20.0, 50.0, ((27, 3), (40, 4), (60, 6))),
    (20.0, 100.0, ((60, 6), (90, 9), (135, 13))),
    (20.0, 200.0, ((90, 9), (135, 13), (203, 20))),
)  # fmt: skip
#: Ribbons whose folds and branch points are found without elements too, 1 over w/l.
SHOT = (40.0, 20.0, 10.0, 6.0)


@functools.cache
def coarse(flat_one: bool) -> float:
    """Where the rod of w/l = 1/20 leaves the arch, or S, on its first elements."""
    case = ROD
    found = flat(case, 0) if flat_one else upright(case, 0)
    return float(next(s for s in found["specials"] if s["kind"] == "branch_point")["values"][0])


PROBES = {
    "coarse_lost_kirchhoff_20": functools.partial(coarse, False),
    "coarse_flat_kirchhoff_20": functools.partial(coarse, True),
}


def run(out: Path) -> dict[str, Number]:
    """Measures what is not kept, writes shift_branches.md and shift_branches.png; its numbers by name."""
    kept = Pieces("shift_branches", by="shift_finite")
    lines = {
        case: diagram(case, *(kept.get(name, make) for name, make in parts(case))) for case in (*CASES, ROD, *FINITE)
    }
    shells = {(narrow, ratio): measured(narrow, ratio, meshes) for narrow, ratio, meshes in SHELLS}
    shots = {narrow: without(narrow) for narrow in SHOT}
    onset(lines, shells)
    picture(out / "shift_branches.png", lines, shells)
    crossed = kept.get(f"{CROSSED.name}_crossed", functools.partial(shift_finite.reach, CROSSED))
    ends = shift_finite.limit(crossed)
    write(out / "shift_branches.md", lines, shells, shots, crossed, ends)
    return numbers(lines, shells) | {"ends_finite_20": _number(ends)} | shot_numbers(shots)


def onset(lines: Mapping[Case, Diagram], shells: Mapping[tuple[float, float], Thin]) -> None:
    """AssertionError where US leaves U to the unstable side by more than what elements make of it, on one mesh."""
    both: list[Diagram | Thin] = [*lines.values(), *shells.values()]
    for one in both:
        lost = math.nan if one.lost is None else one.lost[-1] if isinstance(one, Thin) else one.lost.values[0]
        for line in one.lines:
            if line["name"] == "US" and not goes_back(lost, line) < RIPPLE:
                raise AssertionError(f"US goes back by {goes_back(lost, line):g} l from {lost:g} l")


def parts(case: Case) -> list[tuple[str, Callable[[], Any]]]:
    """Names of the pieces of a ribbon or rod, and what makes them: U, US and S; of `FINITE` U."""
    branches = (("u", upright), ("us", tilted), ("s", flat))
    return [
        (f"{of.name}_{word}", functools.partial(follow, of))
        for word, follow in branches[: 1 if case in FINITE else 3]
        for of in (OTHER.get((case, word), case),)
    ]


def measured(narrow: float, ratio: float, meshes: tuple[tuple[int, int], ...]) -> Thin:
    """A shell over its meshes, piece by piece."""
    kept = Pieces("shift_branches", by="shift_shells")
    arch, odd = (
        [
            kept.get(f"{one.name}_{word}", functools.partial(make, one))
            for one in (Shell(narrow, ratio, m) for m in meshes)
        ]
        for word, make in (("arch", shift_shells.arch_lost), ("flat", shift_shells.flat_lost))
    )
    return thin(meshes, arch, odd)


def without(narrow: float) -> Shot:
    """A ribbon's special points without elements."""
    kept = Pieces("shift_branches", by="shift_shot")
    us, u = (
        kept.get(f"shot_{narrow:g}_{word}", functools.partial(make, narrow))
        for word, make in (("us", shift_shot.measured), ("u", shift_shot.arch))
    )
    return Shot.of(us, u)


def _key(word: str, case: Case) -> str:
    return f"{word}_{case.energy}_{case.narrow:g}"


def numbers(lines: Mapping[Case, Diagram], shells: Mapping[tuple[float, float], Thin]) -> dict[str, Number]:
    """By name."""
    found: dict[str, Number] = {}
    for case, one in lines.items():
        named = (("lost", one.lost), ("again", one.again), ("flat", one.flat))
        found |= {_key(word, case): place.number() for word, place in named if place is not None}
        for k, loop in enumerate(one.loops()):
            end = f"_{k + 1}" if k else ""
            found[_key("out", case) + end], found[_key("back", case) + end] = (place.number() for place in loop)
            found[_key("width", case) + end] = _number(width(loop, located_to(case)))
        found[_key("loops", case)] = Number(len(one.loops()), 0, shown="d")
    for kind, place in (("lost", lines[ROD].lost), ("flat", lines[ROD].flat)):
        assert place is not None
        found[f"coarse_{kind}_kirchhoff_20"] = Number(
            place.values[0], abs(place.values[1] - place.values[0]), "l", ".6f"
        )  # fmt: skip
    for (narrow, ratio), shell in shells.items():
        for word, values in (("lost", shell.lost), ("flat", shell.flat)):
            if all(math.isfinite(v) for v in values):
                found[f"{word}_shell_{narrow:g}_{ratio:g}"] = _number(shell.limit(values))
        for word, values in zip(("out", "back"), shell.ends or (), strict=False):
            found[f"{word}_shell_{narrow:g}_{ratio:g}"] = _number(shell.limit(values))
        found[f"width_shell_{narrow:g}_{ratio:g}"] = _number(shell.width())
    return found


def shot_numbers(shots: Mapping[float, Shot]) -> dict[str, Number]:
    """Those without elements, by name."""
    return {
        f"shot_{word}_{narrow:g}": Number(value, error, "l", ".6f")
        for narrow, shot in shots.items()
        for word, (value, error) in shot.named().items()
    }


def _number(found: Settled) -> Number:
    if found.settles:
        return Number(found.value, found.error, "l", ".4f")
    return Number(found.value, None, "l", ".4f", "it does not settle over its meshes")
