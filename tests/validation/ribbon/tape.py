"""The tests of Martin et al. 2017 with the tape-spring rod, plain and enriched, beside the shell of the same tape.

The shell's curves are read from results/tape_shell (tests/validation/shell/tape_shell.py) where they are.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.measure.mesh_limit import Settled, settled
from compare.page.drawing import save
from compare.store.store import atomic_write_text
from ribbon.tape.held import Hold
from ribbon.tape.law import exact, greatest, plateau, uniform
from ribbon.tape.path import LoadPath, Steps, begun, standing
from ribbon.tape.rod import Rod
from ribbon.tape.section import Section
from ribbon.tape.solve import Tape, marked, solve
from tests.validation import page
from tests.validation.number import Number, of_settled
from tests.validation.pieces import Pieces
from tests.validation.ribbon import tape_fold

#: It takes no times that its page rests on.
ALONE = False

#: Of the shell's measurement: files under results/.
READS = ("tape_shell/opposite.csv", "tape_shell/equal.csv", "tape_shell/cantilever.csv")
ROOT = Path(__file__).resolve().parents[3]
SHELL = ROOT / "results" / "tape_shell"
D = 210000.0 * 0.15**3 / 12.0 / (1.0 - 0.3**2)  # N mm
MOMENT, FORCE = D * 60.0 / 1000.0, D * 60.0 / 1e6  # N mm of D w / l, N of D w / l^2
TERMS = {"plain": 1, "enriched": 3}
COLOURS = {"plain": "#4a86c8", "enriched": "#222222", "shell": "#c2662d"}
#: Of each test: how far its end goes (rad, l).
TESTS = {"opposite": 0.5, "equal": -0.5, "cantilever": 0.4}
ELEMENTS = (100, 200, 400, 800)
#: Those over which the greatest load and the snap of 4.1 are taken to their limit; to what a snap is located (rad).
HALVED, SNAP = (200, 400, 800), 1e-3
STATIONS = 201


def section(terms: int) -> Section:
    """Table 2 of the paper, in l = 1000 mm."""
    return Section(0.06, 1.5e-4, 0.3, 20.0, terms)


def tape(test: str, terms: int, n: int) -> Tape:
    """A test of the paper on n equal elements."""
    far = TESTS[test]
    held = Hold((0.0, 0.0), None, 0.0)
    if test == "cantilever":
        stages = [(held, Hold((1.0, 0.0), 0.0)), (held, Hold((1.0, far), 0.0))]
    else:
        stages = [(held, Hold((1.0, 0.0), 0.0, 0.0)), (Hold((0.0, 0.0), None, -far), Hold((1.0, 0.0), 0.0, far))]
    return solve(section(terms), stages, np.full(n, 1.0 / n))


def measured(test: str, terms: int, n: int) -> dict[str, Any]:
    """The way of a test: what is imposed (rad, mm), what it takes (N mm, N), the fold; seconds."""
    began = time.perf_counter()
    found = tape(test, terms, n)
    seconds = time.perf_counter() - began
    rows = []
    for mark in found.marks:
        if test == "cantilever":
            moved, load = mark.end[1] * 1000.0, mark.force[1] * FORCE
        else:
            moved, load = abs(mark.angles[1]), abs(mark.moments[1]) * MOMENT
        rows.append([moved, load, mark.negative, int(mark.jumped), mark.fold * 1000.0, mark.flattest / 20.0])
    s = np.linspace(0.0, 1.0, STATIONS)
    top = max(range(len(rows)), key=lambda i: rows[i][1])
    edge = section(terms).tables(np.ones(1))[1][0]  # beta at the edge, by kappa^i
    shapes = [(found.rod.at(x, s)[:, 2:, 0] @ edge).tolist() for x in (found.marks[top].x, found.marks[-1].x)]
    return {"rows": rows, "seconds": seconds, "iterations": found.iterations, "status": found.status.value,
            "shapes": shapes, "unknowns": found.rod.size}  # fmt: skip


def top_of(rows: list[list[float]]) -> tuple[float, float]:
    """(imposed, load) where the load is greatest, by the parabola through three points."""
    load = np.array([row[1] for row in rows])
    moved = np.array([row[0] for row in rows])
    k = int(np.argmax(load))
    if 0 < k < len(rows) - 1 and np.ptp(moved[k - 1 : k + 2]) > 1e-6 * abs(moved[k]):
        fit = np.polyfit(moved[k - 1 : k + 2] - moved[k], load[k - 1 : k + 2], 2)
        at = -fit[1] / (2.0 * fit[0])
        if fit[0] < 0.0 and abs(at) < np.abs(np.diff(moved[k - 1 : k + 2])).max():
            return float(moved[k] + at), float(np.polyval(fit, at))
    return float(moved[k]), float(load[k])


def buckling(rows: list[list[float]]) -> float:
    """Largest imposed value before the first unstable or jumped point: where the tape snaps."""
    last = next((i for i, row in enumerate(rows) if row[2] > 0 or row[3]), len(rows))
    return max(row[0] for row in rows[:last])


def shell_rows(test: str) -> list[list[float]]:
    """The shell's points (imposed, load, negative, 0), legs apart by a row of nan; empty where there are none."""
    path = SHELL / f"{test}.csv"
    if not path.exists():
        return []
    found: list[list[float]] = []
    legs: dict[str, list[list[float]]] = {}
    for row in csv.reader(path.read_text().splitlines()[1:]):
        legs.setdefault(row[0], []).append([float(row[1]), float(row[2]), float(row[3]), 0.0])
    for rows in legs.values():
        found += [*rows, [np.nan, np.nan, 0.0, 0.0]]
    return found


def mean_at_the_end(rows: list[list[float]]) -> float:
    """Mean load over the last half of what is imposed."""
    rows = [row for row in rows if np.isfinite(row[0])]
    tail = np.array([row[:2] for row in rows if row[0] >= 0.5 * rows[-1][0]][-30:])
    order = np.argsort(tail[:, 0])
    x, y = tail[order].T
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)) / (x[-1] - x[0]))


def draw(path: Path, ways: dict[str, dict[str, dict[str, Any]]]) -> None:
    """Above: load against what is imposed; below: how far the sections are open at the end of the way."""
    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    axes = figure.subplots(2, 3)
    titles = {"opposite": "4.1, opposite sense", "equal": "4.1, equal sense", "cantilever": "4.2, cantilever"}
    for column, test in enumerate(TESTS):
        above, below = axes[0, column], axes[1, column]
        for name, found in ways[test].items():
            rows = np.array(found["rows"])
            above.plot(rows[:, 0], rows[:, 1], "-", color=COLOURS[name], lw=1.2, label=name)
            shaky = rows[:, 2] > 0
            above.plot(rows[shaky, 0], rows[shaky, 1], "o", mfc="white", mec=COLOURS[name], ms=3)
            s = np.linspace(0.0, 1000.0, STATIONS)
            below.plot(s, found["shapes"][0], "--", color=COLOURS[name], lw=0.8, label=f"{name}, greatest load")
            below.plot(s, found["shapes"][1], "-", color=COLOURS[name], lw=1.2, label=f"{name}, end")
        shell = np.array(shell_rows(test))
        if shell.size:
            above.plot(shell[:, 0], shell[:, 1], "-", color=COLOURS["shell"], lw=1.2, label="shell")
            shaky = shell[:, 2] > 0
            above.plot(shell[shaky, 0], shell[shaky, 1], "o", mfc="white", mec=COLOURS["shell"], ms=3)
        moved = test == "cantilever"
        above.set(title=titles[test], xlabel="u3, mm" if moved else "turn of each end, rad",
                  ylabel="force, N" if moved else "moment, N mm")  # fmt: skip
        below.set(xlabel="s, mm", ylabel="angle of the section's edge, rad")
        for one in (above, below):
            one.grid(alpha=0.3)
            one.legend(fontsize="x-small")
    save(figure, path)


def law_table() -> str:
    """Uniform bending: greatest moment and plateau, by the terms of the section, and exact."""
    rows = []
    for name, law in (
        ("plain, 1 term", partial(uniform, section(1))),
        ("enriched, 3 terms", partial(uniform, section(3))),
        ("5 terms", partial(uniform, section(5))),
        ("any shape (closed form)", partial(exact, section(1))),
    ):
        for sense, sign in (("opposite", 1.0), ("equal", -1.0)):
            moment, k = greatest(law, 40.0 * sign)
            flat = plateau(law, 20.0 * sign)
            rows.append([name, sense, f"{abs(moment) * MOMENT:.2f}", f"{abs(k) / 1000.0:.4e}",
                         f"{abs(flat.moment) * MOMENT:.3f}", f"{flat.radius * 1000.0:.3f}"])  # fmt: skip
    heads = ("section", "sense", "greatest M, N mm", "at k, 1/mm", "plateau, N mm", "fold radius, mm")
    return page.table(heads, rows)


def path_table(ways: dict[str, dict[str, dict[str, Any]]]) -> str:
    """Greatest load, where the tape snaps, load at the end, time; the shell's where it is known."""
    rows = []
    for test, unit, form in (("opposite", "N mm", ".2f"), ("equal", "N mm", ".2f"), ("cantilever", "N", ".4f")):
        shell = [row for row in shell_rows(test) if np.isfinite(row[0])]
        best = top_of(shell)[1] if shell else None
        for name, found in ways[test].items():
            at, load = top_of(found["rows"])
            off = "" if best is None else f"{100.0 * (load / best - 1.0):+.2f} %"
            end = found["rows"][-1]
            rows.append([test, name, f"{load:{form}} {unit}", off, f"{at:.4g}", f"{buckling(found['rows']):.4g}",
                         f"{mean_at_the_end(found['rows']):{form}}", f"{end[4]:.0f}",
                         f"{found['seconds']:.1f}"])  # fmt: skip
        if shell:
            at, load = top_of(shell)
            rows.append([test, "shell", f"{load:{form}} {unit}", "", f"{at:.4g}", f"{buckling(shell):.4g}",
                         f"{mean_at_the_end(shell):{form}}", "", ""])  # fmt: skip
    heads = ("test", "model", "greatest load", "to the shell", "at (rad, mm)", "snaps at (rad, mm)", "mean at the end",
             "fold at, mm", "s")  # fmt: skip
    return page.table(heads, rows)


def findings(ways: dict[str, dict[str, dict[str, Any]]]) -> str:
    """The paper's statements (b) and (c) beside the shell: greatest load, and where the tape snaps."""
    said = {"opposite": "4.1 (b)", "cantilever": "4.2 (c)", "equal": "4.1 in equal sense (not in the paper)"}
    lines = []
    for test, name in said.items():
        shell = [row for row in shell_rows(test) if np.isfinite(row[0])]
        if not shell:
            continue
        parts, off = [], {}
        for model, found in ways[test].items():
            load = top_of(found["rows"])[1] / top_of(shell)[1] - 1.0
            snap = buckling(found["rows"]) / buckling(shell) - 1.0
            off[model] = abs(load)
            parts.append(
                f"{model} {100.0 * load:+.1f} % in its greatest load and {100.0 * snap:+.1f} % in where it snaps"
            )
        nearer = min(off, key=lambda model: off[model])
        lines.append(f"- {name}, against the shell: {'; '.join(parts)}. Nearer in the load: {nearer}.")
    return "\n".join(lines)


def upward(test: str, terms: int, warped: bool, n: int = 200) -> list[float]:
    """Greatest load and where, the largest imposed value before it turns back, where the section is flattest then."""
    far = 0.15
    turns = test != "cantilever"
    at_rest = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.0), 0.0, 0.0 if turns else None)
    moved = (Hold((0.0, 0.0), None, -far), Hold((1.0, 0.0), 0.0, far)) if turns else (at_rest[0], Hold((1.0, far), 0.0))
    shape = Section(0.06, 1.5e-4, 0.3, 20.0, terms, warped)
    x = begun(Rod(shape, np.full(n, 1.0 / n), *at_rest))
    rod = Rod(shape, np.full(n, 1.0 / n), *moved)
    path = LoadPath(rod, standing(rod, x), rod.targets(*moved))
    point = path.settled(x, 0.0)
    assert point is not None
    rows = []
    for at in path.walk(point, Steps(first=0.02, most=0.02)):
        mark = marked(rod, 0, at)
        load = mark.moments[1] * MOMENT if turns else mark.force[1] * FORCE
        rows.append([at.load * far * (1.0 if turns else 1000.0), load, mark.fold * 1000.0])
        if at.negative:
            break
    top = max(rows, key=lambda row: row[1])
    return [top[1], top[0], max(row[0] for row in rows), rows[-1][2]]


def warp_table(pieces: Pieces) -> str:
    """Greatest load, snap and birth of the fold without and with warping; the shell's where it is known."""
    rows = []
    for test, unit, form in (("opposite", "N mm", ".1f"), ("cantilever", "N", ".3f")):
        for name, terms in TERMS.items():
            for warped in (False, True):
                key = f"{test}_{name}_{'warped' if warped else 'unwarped'}"
                load, at, snap, fold = pieces.get(key, partial(upward, test, terms, warped))
                text = "warped" if warped else "not"
                rows.append([test, name, text, f"{load:{form}} {unit}", f"{at:.4g}", f"{snap:.4g}", f"{fold:.0f}"])
        shell = [row for row in shell_rows(test) if np.isfinite(row[0])]
        if shell:
            at, load = top_of(shell)
            rows.append([test, "shell", "", f"{load:{form}} {unit}", f"{at:.4g}", f"{buckling(shell):.4g}", ""])
    heads = ["test", "section", "membrane", "greatest load", "at (rad, mm)", "snaps at (rad, mm)", "flattest at, mm"]
    return page.table(heads, rows)


def element_table(pieces: Pieces) -> str:
    """4.1 in the opposite sense on more and more elements."""
    rows = []
    for name, terms in TERMS.items():
        for n in ELEMENTS:
            one = pieces.get(f"opposite_{name}_{n}", partial(measured, "opposite", terms, n))
            tail = np.array([row[1] for row in one["rows"] if row[0] > 0.25])
            flat = [f"{tail.mean():.3f}", f"{np.ptp(tail):.3f}"] if tail.size else ["", ""]
            spent = [str(one["iterations"]), f"{one['seconds']:.1f}", one["status"]]
            rows.append([name, str(n), str(one["unknowns"]), f"{top_of(one['rows'])[1]:.3f}", *flat, *spent])
    heads = ["section", "elements", "unknowns", "greatest M, N mm", "M beyond 0.25 rad", "its range", "iterations"]
    return page.table([*heads, "s", "status"], rows)


def _uniform_top(terms: int) -> float:
    """Greatest moment (N mm) of uniform bending in the opposite sense."""
    return abs(greatest(partial(uniform, section(terms)), 40.0)[0]) * MOMENT


def _plateau(terms: int, sense: float) -> float:
    """Moment (N mm) at which a fold grows."""
    return abs(plateau(partial(uniform, section(terms)), 20.0 * sense).moment) * MOMENT


@cache
def coarse(name: str) -> dict[str, Any]:
    """4.1 in the opposite sense on the fewest elements."""
    return measured("opposite", TERMS[name], ELEMENTS[0])


PROBES = {
    "uniform_enriched": lambda: _uniform_top(TERMS["enriched"]),
    "plateau_enriched": lambda: _plateau(TERMS["enriched"], 1.0),
    "plateau_plain_equal": lambda: _plateau(TERMS["plain"], -1.0),
    "opposite_plain_100": lambda: top_of(coarse("plain")["rows"])[1],
}


def _law() -> dict[str, Number]:
    """Uniform bending: closed to the quadrature of the section, the tolerance of its roots and so on."""
    found = {}
    for name, terms in TERMS.items():
        found[f"uniform_{name}"] = Number(_uniform_top(terms), 1e-6 * _uniform_top(terms), "N mm", ".2f")
        for word, sense in (("", 1.0), ("_equal", -1.0)):
            flat = _plateau(terms, sense)
            found[f"plateau_{name}{word}"] = Number(flat, 1e-6 * flat, "N mm", ".3f")
    return found


def _range(rows: list[list[float]]) -> float:
    """Largest less least load beyond 0.25 rad."""
    return float(np.ptp([row[1] for row in rows if row[0] > 0.25]))


def _limit(name: str, pieces: Pieces, of: Callable[[list[list[float]]], float], located: float) -> Settled:
    """A number of the way of 4.1 in the opposite sense, from its elements halved and halved again."""
    found = [
        of(pieces.get(f"opposite_{name}_{n}", partial(measured, "opposite", TERMS[name], n))["rows"]) for n in HALVED
    ]
    return settled(found, located)


def _first_line(pieces: Pieces) -> str:
    """Greatest load and snap of 4.1 with their errors, and what has none."""
    told = []
    for name in TERMS:
        load = _limit(name, pieces, lambda rows: top_of(rows)[1], 1e-5 * ways_top(name, pieces))
        snap = _limit(name, pieces, buckling, SNAP)
        told.append(f"{name}: greatest load {load.text} N mm, snap {snap.text} rad")
    return (
        f"4.1 in the opposite sense over {', '.join(map(str, HALVED))} elements: {'; '.join(told)}. Loads and snaps of "
        "the other tests are of 800 elements alone and have no error of their mesh; a snap is located to a step of the "
        f"way, some {SNAP:g} rad."
    )


def ways_top(name: str, pieces: Pieces) -> float:
    """Greatest load of 4.1 in the opposite sense on the finest elements (N mm)."""
    n = HALVED[-1]
    return top_of(pieces.get(f"opposite_{name}_{n}", partial(measured, "opposite", TERMS[name], n))["rows"])[1]


def _numbers(ways: dict[str, dict[str, dict[str, Any]]], pieces: Pieces) -> dict[str, Number]:
    """Greatest loads: of 4.1 in the opposite sense with the change from half the elements; of the others with what a
    step of the way may leave of the parabola's top, a thousandth; the plateau's range by elements."""
    numbers = {}
    for name, terms in TERMS.items():
        by_size = {
            n: pieces.get(f"opposite_{name}_{n}", partial(measured, "opposite", terms, n))["rows"] for n in ELEMENTS
        }
        tops = {n: top_of(rows)[1] for n, rows in by_size.items()}
        error = max(abs(tops[800] - tops[400]), 1e-6 * tops[800])
        numbers[f"opposite_{name}"] = Number(tops[800], error, "N mm", ".2f")
        for word, one, unit, form in (
            ("load", _limit(name, pieces, lambda rows: top_of(rows)[1], 1e-5 * tops[800]), "N mm", ".2f"),
            ("snap", _limit(name, pieces, buckling, SNAP), "rad", ".5f"),
        ):
            numbers[f"{word}_{name}"] = of_settled(one.record(unit), form)
        numbers[f"opposite_{name}_100"] = Number(tops[100], 1e-5 * tops[100], "N mm", ".3f")
        for n in (200, 800):
            numbers[f"range_{name}_{n}"] = Number(_range(by_size[n]), 1e-3, "N mm", ".3f")
        for test, unit, form in (("equal", "N mm", ".2f"), ("cantilever", "N", ".4f")):
            top = top_of(ways[test][name]["rows"])[1]
            numbers[f"{test}_{name}"] = Number(top, 1e-3 * top, unit, form)
    shell = top_of([row for row in shell_rows("opposite") if np.isfinite(row[0])])[1]
    off, error = numbers["opposite_enriched"].value / shell - 1.0, numbers["opposite_enriched"].error or 0.0
    why = "the page tape_shell has the shell's own change from mesh to mesh"
    return numbers | {
        "off_shell": Number(100.0 * off, None, "%", "+.2f", f"the ribbon's is {error / shell:.0e}; {why}")
    }


def run(results: Path) -> dict[str, Number]:
    """Writes results/tape."""
    out = results / "tape"
    pieces = Pieces("tape")
    ways: dict[str, dict[str, dict[str, Any]]] = {}
    for test in TESTS:
        ways[test] = {
            name: pieces.get(f"{test}_{name}_800", partial(measured, test, terms, 800)) for name, terms in TERMS.items()
        }
    out.mkdir(parents=True, exist_ok=True)
    draw(out / "tape.png", ways)
    tape_fold.draw(out / "fold.png")
    lines = ["test,model,imposed,load,negative,jumped,fold_mm,flattest_over_rest"]
    for test, by_name in ways.items():
        for name, found in by_name.items():
            lines += [",".join([test, name, *(f"{value:.6g}" for value in row)]) for row in found["rows"]]
    atomic_write_text(out / "ways.csv", "\n".join(lines) + "\n")
    shell = "with the shell of results/tape_shell" if any(shell_rows(test) for test in TESTS) else "without a shell yet"
    page.write(
        out / "README.md",
        "Tape spring: the tests of Martin et al. 2017",
        "python -m tests.validation tape",
        _first_line(pieces),
        f"The rod with a flexible section on 800 equal elements, plain and enriched, {shell}. Imposed: turn of each "
        "end (rad) or u3 (mm). Unstable points are hollow. In the equal sense the tape branches and jumps, its middle "
        "pushed flat by 5 % before the jump; the other ways are followed without a dent. All states are planar.",
        "![ways and sections](tape.png)",
        "![The fold of 4.1, opposite sense, at 0.5 rad](fold.png)",
        path_table(ways),
        findings(ways),
        "## Uniform bending",
        law_table(),
        "Plateaus are Maxwell's (equal areas); of the plain tape (1 + nu) D 2 beta0 = 101.250 N mm and "
        "(1 - nu) D 2 beta0 = 54.519 N mm.",
        "## What the model leaves out",
        "A section that changes along the tape moves across; a membrane that does not shear then warps along "
        "(`ribbon.tape.section`, `warped`). With that term clamps reach farther. 200 elements, up to the snap:",
        warp_table(pieces),
        "## Elements",
        "4.1, opposite sense. On coarse elements a fold rests between them: the moment of the plateau, which is flat, "
        "has a range, and arc length may lose the way.",
        element_table(pieces),
    )
    return _law() | _numbers(ways, pieces)
