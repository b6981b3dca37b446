"""Thesis 7.2, the hysteresis: the picture of every model's branches, the tables and the sentences of the page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.mesh_limit import Settled
from tests.validation import page
from tests.validation.workbench import shift_words as words
from tests.validation.workbench.shift_diagram import SINGULAR, Diagram, Place, Shot, Thin, located_to, width, widths
from tests.validation.workbench.shift_followed import RIPPLE, Case

COLOURS = {"wunderlich": "tab:red", "kirchhoff": "tab:gray", "finite": "tab:blue"}
SHELLS = ("tab:green", "tab:purple", "tab:orange")


def picture(path: Path, lines: Mapping[Case, Diagram], shells: Mapping[tuple[float, float], Thin]) -> None:
    """Height of the middle over the shift: left every model at w/l = 1/20, right Wunderlich's ribbon by its width;
    dashed where not stable, special points with their errors."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.8), sharey=True, layout="constrained")
    for case, one in lines.items():
        if case.narrow == 20.0 and case.energy != "finite":
            _drawn(left, one.lines, COLOURS[case.energy], case.energy)
            _marked(left, one, COLOURS[case.energy])
    for k, ((_, ratio), shell) in enumerate(shells.items()):
        _drawn(left, shell.lines, SHELLS[k], f"shell, w/h = {ratio:g}")
        _marked_shell(left, shell, SHELLS[k])
    widths = [case for case in lines if case.energy == "wunderlich"]
    for k, case in enumerate(widths):
        _drawn(right, lines[case].lines, f"C{k}", f"w/l = 1/{case.narrow:g}")
        _marked(right, lines[case], f"C{k}")
    for axes, title in ((left, "w/l = 1/20, every model"), (right, "wunderlich")):
        axes.set(xlabel="shift (l)", title=title)
        axes.legend(frameon=False)
    left.set_ylabel("height of the middle (l)")
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def _drawn(axes: Any, lines: Sequence[Mapping[str, Any]], colour: str, label: str) -> None:
    """Parts of one stability, each from the point before it."""
    for line in lines:
        x, y, loose = line["shift"], line["height"], [n > 0 for n in line["unstable"]]
        first = 0
        for k in range(1, len(x) + 1):
            if k == len(x) or loose[k] != loose[first]:
                axes.plot(x[max(first - 1, 0) : k], y[max(first - 1, 0) : k], color=colour, lw=1.1,
                          ls="--" if loose[first] else "-")  # fmt: skip
                first = k
    axes.plot([], [], color=colour, label=label)


def _marked(axes: Any, one: Diagram, colour: str) -> None:
    for place in (one.lost, one.again, *one.folds, *one.turned, one.flat):
        if place is not None:
            error = place.limit.error if place.limit.settles else abs(place.finest - place.values[0])
            axes.errorbar(place.finest, place.height, xerr=error, fmt="o", ms=4, capsize=2, color=colour)


def _marked_shell(axes: Any, shell: Thin, colour: str) -> None:
    """On the finest mesh; errors of the limit, or the change from the mesh before."""
    upright = next(line for line in shell.lines if line["name"] == "U")
    height = float(np.interp(shell.lost[-1], upright["shift"], upright["height"]))
    places = [(shell.lost, height), (shell.flat, 0.0)]
    outer = [
        [min(found, key=lambda one, last=last: math.dist(one, last)) for found in shell.pairs if found]  # type: ignore[misc]
        for last in shell.pairs[-1]
    ]
    for k, (_, high) in enumerate(shell.folds[: 2 * len(outer)]):
        places.append((tuple(pair[k % 2] for pair in outer[k // 2]), high))
    for values, high in places:
        limit = shell.limit(values)
        change = abs(values[-1] - values[-2]) if len(values) > 1 else 0.0
        error = limit.error if limit.settles else change
        axes.errorbar(values[-1], high, xerr=error, fmt="o", ms=4, capsize=2, color=colour)


def _told(place: Place, digits: int = 5) -> tuple[str, ...]:
    """Values on the meshes, limit and error."""
    values = tuple(f"{v:.{digits}f}" if math.isfinite(v) else "not found" for v in place.values)
    return (*values, *_ended(place.limit, place.values, digits))


def _ended(limit: Settled, values: Sequence[float], digits: int) -> tuple[str, str]:
    if limit.settles:
        return f"{limit.value:.{digits}f}" if limit.value else "none", f"{limit.error:.0e}"
    known = [v for v in values if math.isfinite(v)]
    return "not settled", f"changes by {max(known) - min(known):.0e}" if len(known) > 1 else "-"


def _rows(lines: Mapping[Case, Diagram]) -> list[tuple[str, ...]]:
    """Every special point of ribbons and rods."""
    rows = []
    for case, one in lines.items():
        of = (case.energy, "any" if case.energy == "kirchhoff" else f"1/{case.narrow:g}",
              f"{case.ratio:g}" if case.ratio else "")  # fmt: skip
        loops = one.loops()
        named = [("U lost", one.lost), ("U stable again", one.again)]
        for branch, folds in (("U", one.turned), ("US", one.folds)):
            named += [(f"fold of {branch} {k + 1}", place) for k, place in enumerate(folds)]
        for what, place in (*named, ("S lost", one.flat)):
            if place is not None:
                rows.append((*of, what, *_told(place)))
        for loop in loops:
            values = widths(loop)
            limit = width(loop, located_to(case))
            cells = tuple(f"{v:.5f}" if math.isfinite(v) else "not found" for v in values)
            rows.append((*of, "**width**", *cells, *_ended(limit, values, 5)))
        if not loops and case.energy != "finite":
            rows.append((*of, "**width**", "", "", "", "none", f"{RIPPLE:.0e}"))
    return rows


def _shell_rows(shells: Mapping[tuple[float, float], Thin]) -> list[tuple[str, ...]]:
    rows = []
    for (narrow, ratio), one in shells.items():
        of = (f"1/{narrow:g}", f"{ratio:g}", ", ".join(f"{a} x {b}" for a, b in one.meshes))
        for what, values in (("U lost", one.lost), ("S lost", one.flat)):
            cells = tuple(f"{v:.5f}" if math.isfinite(v) else "not found" for v in values)
            rows.append((*of, what, *_three(cells), *_ended(one.limit(values), values, 5)))
        for what, values in zip(("fold of US 1", "fold of US 2"), one.ends or (), strict=False):
            cells = tuple(f"{v:.5f}" if math.isfinite(v) else "none" for v in values)
            rows.append((*of, what, *_three(cells), *_ended(one.limit(values), values, 5)))
        found = one.ends or ((), ())
        cells = tuple(f"{a - b:.5f}" if math.isfinite(a - b) else "none" for a, b in zip(*found, strict=True))
        limit = one.width()
        rows.append((*of, "**width**", *_three(cells), *_ended(limit, [a - b for a, b in zip(*found, strict=True)], 5)))
    return rows


def _shot_rows(lines: Mapping[Case, Diagram], shots: Mapping[float, Shot]) -> tuple[list[tuple[str, ...]], str]:
    """Each special point on elements and without, and how far they are apart; how many of those that settle are so
    within both errors, as the page says it."""
    rows: list[tuple[str, ...]] = []
    within, bare = [], []
    for case, one in lines.items():
        if case.energy != "wunderlich" or case.narrow not in shots:
            continue
        shot = shots[case.narrow]
        if len(shot.folds) != len(one.folds):
            raise AssertionError(f"w/l = 1/{case.narrow:g}: {len(shot.folds)} folds of US without elements")
        for what, place, (value, error) in shot.points(one):
            apart = abs(place.limit.value - value)
            if place.limit.settles:
                within.append(apart <= place.limit.error + error)
                bare.append(apart <= place.limit.error + (shot.bare if place is one.again else error))
            cells = (f"{value:.6f}", f"{error:.0e}", *_ended(place.limit, place.values, 5))
            rows.append((f"1/{case.narrow:g}", what, *cells, f"{apart:.0e}" if place.limit.settles else ""))
    return rows, f"{sum(within)} of {len(within)} values (without the floor {sum(bare)})"


def _searched(shots: Mapping[float, Shot]) -> str:
    """U lost by the search that finds U stable again, beside what it is from US."""
    apart = [abs(one.searched[0] - one.lost[0]) for one in shots.values()]
    inside = sum(a <= one.searched[1] + one.lost[1] for a, one in zip(apart, shots.values(), strict=True))
    return f"{min(apart):.0e} to {max(apart):.0e} l from it, at {inside} of {len(apart)} widths within both errors"


def _three(cells: tuple[str, ...]) -> tuple[str, ...]:
    """Of as many meshes as there are."""
    return (*cells, *[""] * (3 - len(cells)))


def _named(case: Case, one: Diagram) -> str:
    loops = one.loops()
    if not loops:
        return f"none at w/l = 1/{case.narrow:g}"
    told = []
    for out, back in loops:
        limit = width((out, back), located_to(case))
        error = f"+- {limit.error:.0e}" if limit.settles else "not settled"
        told.append(f"{back.number()} to {out.number()} l at w/l = 1/{case.narrow:g} (width {limit.value:.4f} {error})")
    return " and ".join(told)


def _shelled(ratio: float, shell: Thin) -> str:
    if shell.ends is None:
        return f"none at w/h = {ratio:g} (below {RIPPLE:g})"
    limit = shell.width()
    error = f"+- {limit.error:.0e}" if limit.settles else "not settled"
    out, back = (shell.limit(values).value for values in shell.ends)
    return f"{back:.4f} to {out:.4f} l at w/h = {ratio:g} (width {limit.value:.4f} {error})"


def open_ones(
    lines: Mapping[Case, Diagram], shells: Mapping[tuple[float, float], Thin], shots: Mapping[float, Shot]
) -> list[str]:
    """What does not settle on its meshes, in words, and of what a value is known without elements only."""
    found = []
    for case, one in lines.items():
        only = " (by shooting only)" if case.energy == "wunderlich" and case.narrow in shots else ""
        for what, place in (("U lost", one.lost), ("U stable again", one.again), ("S lost", one.flat)):
            if place is not None and not place.limit.settles:
                found.append(f"{case.energy}, w/l = 1/{case.narrow:g}: {what}{only}")
        found += [
            f"{case.energy}, w/l = 1/{case.narrow:g}: fold {k + 1} of {branch}"
            for branch, folds in (("U", one.turned), ("US", one.folds))
            for k, place in enumerate(folds) if not place.limit.settles
        ]  # fmt: skip
    for (narrow, ratio), shell in shells.items():
        for what, values in (("U lost", shell.lost), ("S lost", shell.flat)):
            if not shell.limit(values).settles:
                found.append(f"shell, w/l = 1/{narrow:g}, w/h = {ratio:g}: {what}")
        if not shell.width().settles:
            found.append(f"shell, w/l = 1/{narrow:g}, w/h = {ratio:g}: hysteresis")
    return found


def answer(lines: Mapping[Case, Diagram], shells: Mapping[tuple[float, float], Thin]) -> str:
    """The question of 7.2 in one sentence."""
    ribbon = "; ".join(_named(case, one) for case, one in lines.items() if case.energy == "wunderlich")
    rod = "has one" if any(one.loops() for case, one in lines.items() if case.energy == "kirchhoff") else "has none"
    shell = ", ".join(_shelled(ratio, one) for (_, ratio), one in shells.items())
    return (
        f"**The inextensible ribbon has a hysteresis ({ribbon}), between two folds of the tilted branch and not where "
        f"U or S is lost; the shell of w/l = 1/20 has it where it is thin ({shell}); the rod {rod}.**"
    )


def write(
    path: Path,
    lines: Mapping[Case, Diagram],
    shells: Mapping[tuple[float, float], Thin],
    shots: Mapping[float, Shot],
    crossed: Sequence[Mapping[str, Any]],
    ends: Settled,
) -> None:
    """The page."""
    left = open_ones(lines, shells, shots)
    both, within = _shot_rows(lines, shots)
    rippled = [f"{one.ripples} folds (w/l = 1/{case.narrow:g})" for case, one in lines.items() if one.ripples]
    page.write(
        path,
        "The branches between shifted clamps: is there a hysteresis? (thesis 7.2)",
        "python -m tests.validation shift_branches",
        f"Not settled: {'; '.join(left)}." if left else "Every special point settles over its meshes.",
        answer(lines, shells),
        words.SETUP.replace("\n", " "),
        "![Height of the middle over the shift](shift_branches.png)",
        "Full: stable, dashed: not; points: special ones with their errors. Shells: finest mesh, US as followed.",
        "## What the hysteresis is",
        words.WHAT.replace("\n", " ").format(ripple=RIPPLE),
        "## Ribbons and rods",
        "Elements of `wunderlich` are placed anew at every point (`Grading`), those of `kirchhoff` (w/h = 50; it does "
        f"not know w/l) are 50 equal ones; halved twice. Pairs of folds nearer to each other (or one to the "
        f"fork) than {RIPPLE:g} l are what elements make of a steep piece and are not counted: "
        f"{', '.join(rippled) or 'none'}, `wunderlich`.",
        page.table(("model", "w/l", "w/h", "what", "elements", "halved", "twice", "limit", "+-"), _rows(lines)),
        words.NARROW.replace("\n", " "),
        "### The same without elements",
        words.WITHOUT.replace("\n", " ").format(
            integral=max(one.integral for one in shots.values()),
            within=within,
            floor=SINGULAR,
            searched=_searched(shots),
        ),
        page.table(("w/l", "what", "by shooting", "+-", "on elements", "+-", "apart"), both),
        words.OTHERS.replace("\n", " "),
        "### `finite` on elements that stand at its crossings (w/l = 1/20, w/h = 50)",
        words.CROSSED.replace("\n", " ").format(ends=f"{ends.value:.4f} +- {ends.error:.0e}"),
        page.table(
            ("shortest", "longest element", "elements", "last stable shift", "first crossing at", "clamp's curvature"),
            [
                (
                    f"{one['least']:.1e}",
                    f"{one['longest']:g}",
                    str(one["elements"]),
                    f"{one['shift']:.5f}",
                    f"{one['crossing']:.5f}",
                    f"{one['clamp']:.3f}",
                )
                for one in crossed
            ],
        ),
        "## Shells",
        "Meshes with elements 1.5 times shorter each; a hysteresis is the interval between two folds of US, which is "
        "followed down to a height of 0.18 l. Where S is lost at w/h = 50 settles on meshes that are halved: "
        "[branches of shells](branches_shell.md).",
        page.table(("w/l", "w/h", "meshes", "what", "coarse", "finer", "finest", "limit", "+-"), _shell_rows(shells)),
        words.THIN.replace("\n", " "),
    )
