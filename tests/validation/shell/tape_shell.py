"""The seed's tape spring as a shell: moment against rotation, force against displacement, folds; on several meshes.

Every case is a piece (out/validate/tape_shell): an interrupted run goes on. What the rods of a flexible section are
compared with is written to results/tape_shell.
"""

from __future__ import annotations

import csv
import functools
import io
from pathlib import Path
from typing import Any

import numpy as np

from compare.store.store import atomic_write_text
from tests.reference.tape_section import Section
from tests.validation import page
from tests.validation.number import Number
from tests.validation.pieces import Pieces
from tests.validation.shell import tape_parts as parts
from tests.validation.shell.tape_parts import Case

#: It takes no times that its page rests on.
ALONE = False

#: Meshes of the parts; the last of each test is the one whose curve is written.
CASES = {
    "opposite": (Case("opposite", 50, 4),),
    "equal": (Case("equal", 25, 4),),
    "cantilever": (Case("cantilever", 50, 4),),
}
WORDS = {
    "opposite": "Opposite: their test 4.1, both ends turned, their sections undeformed, one of them sliding along the "
    "axis; a quarter of the tape, symmetric about its length and its middle.",
    "equal": "Equal: the same in the other sense; two folds form, at either end.",
    "cantilever": "Cantilever: their test 4.2, one end moved by u3 towards the convex face, free to turn and to slide; "
    "a half.",
    "two_folds": "Two folds: both ends keep their frames and one is moved sideways; a half.",
}
SHAPES = ("at the greatest load", "at the end")
LEGS = ("up", "back", "ahead")  # before the snap; the fold followed back to where it vanishes, and on
Rows = list[dict[str, Any]]


def leg(found: dict[str, Any], name: str) -> Rows:
    """The points of one leg."""
    return [row for row in found["rows"] if row["leg"] == name]


def greatest(rows: Rows) -> tuple[float, float]:
    """(moved, load) where the load is greatest: by the parabola through three points, or the point itself."""
    load = np.array([row["load"] for row in rows])
    moved = np.array([row["moved"] for row in rows])
    k = int(np.argmax(load))
    if 0 < k < len(rows) - 1:
        a, b, _ = fit = np.polyfit(moved[k - 1 : k + 2] - moved[k], load[k - 1 : k + 2], 2)
        top = -b / (2.0 * a)
        if moved[k - 1] < moved[k] + top < moved[k + 1]:
            return float(moved[k] + top), float(np.polyval(fit, top))
    return float(moved[k]), float(load[k])


def stretches(row: dict[str, Any]) -> list[tuple[int, int]]:
    """First and last station of every stretch whose sections are less than half as open as at rest."""
    flat = np.concatenate([[False], np.abs(row["opening"]) < 0.3, [False]])
    edges = np.flatnonzero(flat[1:] != flat[:-1])
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def fold(row: dict[str, Any], case: Case) -> str:
    """Middles of the folds (mm); one that reaches the plane of symmetry lies on it."""
    last = parts.STATIONS - 1
    middles = [last if case.turned and b == last else 0.5 * (a + b) for a, b in stretches(row)]
    return " ".join(f"{case.span * parts.LENGTH * middle / last:.3g}" for middle in middles)


def plateau(rows: Rows) -> tuple[float, float]:
    """Mean load over the second half of what is imposed, and half the range of the load there."""
    half = 0.5 * (rows[0]["moved"] + rows[-1]["moved"])
    first = next(i for i, row in enumerate(rows) if row["moved"] >= half)
    x, y = (np.array([row[key] for row in rows[first:]]) for key in ("moved", "load"))
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)) / (x[-1] - x[0])), float(0.5 * np.ptp(y))


@functools.cache
def uniform(terms: int = 4, count: int = 13) -> tuple[float, float]:
    """Greatest moment (N mm) of the section bent uniformly, exact in its rotations, and of the shallow one: of a
    parabola through the three largest of `count` curvatures."""
    a, h = parts.HALF_WIDTH / parts.LENGTH, parts.THICKNESS / parts.LENGTH
    found = []
    for exact in (True, False):
        section = Section(a, h, parts.CURVATURE * parts.LENGTH, parts.POISSON, terms=terms, exact=exact)
        at = np.linspace(0.14, 0.20, count)
        moments = np.array([section.moment(-k) for k in at]) * -1.0
        k = int(np.argmax(moments))
        fit = np.polyfit(at[k - 1 : k + 2] - at[k], moments[k - 1 : k + 2], 2)
        found.append(float(np.polyval(fit, -fit[1] / (2.0 * fit[0]))) * parts.STIFFNESS)
    return found[0], found[1]


def write_curve(path: Path, case: Case, found: dict[str, Any]) -> None:
    """The path of one case: leg, what is imposed, what it takes, negative eigenvalues, energy, where the fold is."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    imposed = ["rotation_rad", "moment_N_mm"] if case.turned else ["u3_mm", "force_N"]
    rows.writerow(["leg", *imposed, "negative", "energy_N_mm", "fold_mm"])
    for name in LEGS:
        for row in leg(found, name):
            place = fold(row, case)
            numbers = (f"{row[key]:.7g}" for key in ("moved", "load"))
            rows.writerow([name, *numbers, row["negative"], f"{row['energy']:.7g}", place])
    atomic_write_text(path, text.getvalue())


def shapes(found: dict[str, Any]) -> tuple[list[float], list[float]]:
    """Openings (rad, of half the section) along the tape at the greatest load before the snap, and at the end."""
    up = leg(found, "up")
    return max(up, key=lambda row: row["load"])["opening"], leg(found, "ahead")[-1]["opening"]


def write_shapes(path: Path, case: Case, found: dict[str, Any]) -> None:
    """Both of them."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(["s_mm", "opening_at_greatest_rad", "opening_at_end_rad"])
    for k, place in enumerate(np.linspace(0.0, case.span * parts.LENGTH, parts.STATIONS)):
        out.writerow([f"{place:.6g}", *(f"{opening[k]:.6g}" for opening in shapes(found))])
    atomic_write_text(path, text.getvalue())


def draw(path: Path, curves: dict[str, list[tuple[Case, dict[str, Any]]]]) -> None:
    """Load against what is imposed, all meshes; openings along the tape."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, len(curves), figsize=(4.4 * len(curves), 7.5), layout="constrained", squeeze=False)
    for column, (test, found) in enumerate(curves.items()):
        top, low = axes[:, column]
        for number, (case, one) in enumerate(found):
            label = f"{case.along} x {case.across}, Q{case.degree}"
            for name in LEGS:
                x, y = (np.array([row[key] for row in leg(one, name)]) for key in ("moved", "load"))
                top.plot(x, y, lw=1.2, color=f"C{number}", label=label if name == "up" else None)
            up, down = leg(one, "up")[-1], one["snapped"][0]
            top.plot([up["moved"], down["moved"]], [up["load"], down["load"]], ":", lw=0.8, color=f"C{number}")
        case = found[-1][0]
        for words, opening in zip(SHAPES, shapes(found[-1][1]), strict=True):
            low.plot(np.linspace(0.0, case.span * parts.LENGTH, parts.STATIONS), opening, label=words)
        top.set(title=test.replace("_", " "), xlabel="rotation of either end, rad" if case.turned else "u3, mm",
                ylabel="moment, N mm" if case.turned else "force, N")  # fmt: skip
        low.set(xlabel="s, mm", ylabel="opening of half the section, rad")
        top.legend(fontsize=8)
        low.legend(fontsize=8)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def row_of(case: Case, one: dict[str, Any]) -> list[str]:
    """A line of the table."""
    at, load = greatest(leg(one, "up"))
    ahead, back = leg(one, "ahead"), leg(one, "back")
    mean, spread = plateau(ahead)
    return [
        case.test.replace("_", " "), f"{case.along} x {case.across}", one["status"], f"{load:.5g}", f"{at:.4g}",
        f"{leg(one, 'up')[-1]['moved']:.5g}", f"{one['snapped'][0]['load']:.4g}", f"{back[-1]['moved']:.4g}",
        f"{mean:.4g} +- {spread:.2g}", str(len(one["snapped"])),
        fold(one["snapped"][0], case),
        fold(ahead[-1], case), str(one["unknowns"]), str(one["iterations"]), f"{one['seconds']:.0f}",
    ]  # fmt: skip


PROBES = {"uniform_exact": lambda: uniform()[0], "uniform_shallow": lambda: uniform()[1]}


def numbers(curves: dict[str, list[tuple[Case, dict[str, Any]]]]) -> dict[str, Number]:
    """Closed forms with what one more term changes; of every test's finest mesh the greatest load and the limit point,
    with their change from the mesh before where there is one, and the plateau with its waves."""
    found = {
        f"uniform_{word}": Number(value, abs(finer - value) + abs(closer - value), "N mm", ".1f")
        for word, value, finer, closer in zip(
            ("exact", "shallow"), uniform(), uniform(terms=5), uniform(count=25), strict=True
        )
    }
    alone = "one mesh"
    for test, runs in curves.items():
        unit, turn = ("N mm", "rad") if runs[-1][0].turned else ("N", "mm")
        tops = [greatest(leg(one, "up"))[1] for _, one in runs]
        ends = [leg(one, "up")[-1]["moved"] for _, one in runs]
        for name, values, of in (("greatest", tops, unit), ("limit", ends, turn)):
            error = abs(values[-1] - values[-2]) if len(values) > 1 else None
            found[f"{test}_{name}"] = Number(values[-1], error, of, ".5g", "" if error is not None else alone)
        mean, waves = plateau(leg(runs[-1][1], "ahead"))
        found[f"{test}_plateau"] = Number(mean, waves, unit, ".4g")
    return found


def run(out: Path) -> dict[str, Number]:
    """All cases, the tables and curves of results/tape_shell."""
    kept = Pieces("tape_shell")
    folder = out / "tape_shell"
    folder.mkdir(parents=True, exist_ok=True)
    curves: dict[str, list[tuple[Case, dict[str, Any]]]] = {}
    for test, cases in CASES.items():
        curves[test] = [
            (case, kept.get(f"{case.name}_snap", lambda case=case: parts.Path(case).snap()))  # type: ignore[misc]
            for case in cases
        ]
        write_curve(folder / f"{test}.csv", *curves[test][-1])
        write_shapes(folder / f"{test}_shapes.csv", *curves[test][-1])
    draw(folder / "tape_shell.png", curves)
    exact, shallow = uniform()
    ends = {sign: (1.0 + sign * parts.POISSON) * parts.STIFFNESS * 2.0 * 0.6 for sign in (1.0, -1.0)}
    heads = ["test", "mesh", "status", "greatest load", "at", "limit point", "load after", "fold from", "plateau"]
    heads += ["snaps", "folds born / mm", "at the end / mm", "unknowns", "Newton", "s"]
    page.write(
        folder / "README.md",
        "A tape spring as a shell",
        "python -m tests.validation tape_shell",
        "Limit points and greatest loads are of one mesh each, which is no limit and has no error of its mesh here; on "
        "its rising branch the moment is within 2 % on half as many elements (`tests/test_on_pages.py`). "
        "Tape of Martin et al. (2017): 1000 x 60 x 0.15 mm, R = 50 mm, E = 210 GPa, nu = 0.3 (w/h = 400). "
        + " ".join(WORDS[test] for test in CASES)
        + " Parts are equal to the whole tape where that is symmetric (`tests/shellref/path/test_shell_tape.py`); of "
        "modes that twist the tape they know nothing.",
        "Stable states alone: arc length to a limit point, at the same rotation or displacement down to the stable "
        "state below it, on to the next one or to the end of the test; and back to where the first fold vanishes.",
        f"Closed forms: greatest moment of uniform bending {exact:.1f} N mm for a section exact in its rotations, "
        f"{shallow:.1f} for a shallow one (of one angle: 1510.6); plateau (1 +- nu) 2 beta0 D = {ends[1.0]:.2f} N mm "
        f"in opposite, {ends[-1.0]:.2f} in equal sense.",
        page.table(heads, [row_of(case, one) for found in curves.values() for case, one in found]),
        "Mesh: elements of degree 2 of the part, along x across. Loads in N mm (opposite, equal) or N, what is imposed "
        "in rad or mm. Load after: of the stable state below the limit point. Fold from: where it vanishes when "
        "followed back. Plateau: mean and half the range over the second half of what is imposed after "
        "the first snap: on coarse elements a fold that grows or moves makes waves. s: on a machine that others load.",
        "Curves: " + ", ".join(f"[{test}]({test}.csv)" for test in CASES) + "; openings of the sections along it: "
        + ", ".join(f"[{test}]({test}_shapes.csv)" for test in CASES) + ".",
        "![loads against what is imposed, and openings of the sections](tape_shell.png)",
    )  # fmt: skip
    return numbers(curves)
