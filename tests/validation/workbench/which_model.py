"""The tables of docs/which_model.md that say which model is near the shell, from the data of the pages they link.

Between `<!-- NAME -->` and `<!-- end -->` the page's template is written by `blocks()`; its test holds it to them.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from compare.store.store import atomic_write_text
from tests.validation.number import Number
from tests.validation.readme import template
from tests.validation.record import Pages
from tests.validation.workbench.on_edge import NAMED, straight

#: It takes no times that its page rests on.
ALONE = False

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "which_model.md"
RESULTS = ROOT / "results"

#: The widths over the length of the strip on edge, and who is told beside its shell.
WIDTHS = ("0.02", "0.05", "0.1")
ON_EDGE = {
    "wunderlich, straight": "Wunderlich, ruling straight", "kirchhoff, plate": "rod (Kirchhoff, Y I)",
    "finite, straight": "finite, ruling straight",
}  # fmt: skip
_SHELL = "shell"
#: What the page of limits calls its cases -> what this page does.
HIT_CASES = {
    "grid, edge": "7.3, whole edge held", "grid, corners": "7.3, two corners held",
    "other scenes": "other scenes, in view too when two constants were set",
}  # fmt: skip


@cache
def _distances() -> dict[tuple[str, str, str], Mapping[str, str]]:
    """Rows of models_4_3 by scene, w/h and model."""
    with (RESULTS / "models_4_3" / "distances.csv").open(newline="") as file:
        return {(row["scene"], row["w/h"], row["model"]): row for row in csv.DictReader(file)}


@cache
def _frontier() -> dict[tuple[str, float], float]:
    """Critical weight (Gamma) of the strip on edge by model and w/l: the linearised problem, of a shell its inertia."""
    with (RESULTS / "on_edge" / "frontier.csv").open(newline="") as file:
        found = {}
        for row in csv.DictReader(file):
            value = row["linear"] or row["eigenvalue"] or row["shape"]
            if value:
                found[row["model"], float(row["width"])] = float(value)
        return found


def distance(scene: str, ratio: str, model: str) -> float:
    """Hausdorff distance to the shell over l."""
    return float(_distances()[scene, ratio, model]["hausdorff / l"])


def off(model: str, width: float) -> float:
    """Critical weight over the shell's, less 1."""
    return _frontier()[model, width] / _frontier()[_SHELL, width] - 1.0


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(head), ["---", *["---:"] * (len(list(head)) - 2), "---"], *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def distances() -> str:
    """Curl 4.3 against shells, by w/h."""
    where = "[models_4_3](../results/models_4_3/README.md)"
    rows = []
    for ratio in ("10", "20", "50", "100", "200", "400"):
        cells = [
            f"{distance(s, ratio, m):.1e}" for s in ("curl_4_3", "curl_4_3_down") for m in ("wunderlich", "finite")
        ]
        share = _distances()["curl_4_3", ratio, "shell"]["membrane share"]
        rows.append([ratio, *cells, f"{100.0 * float(share):.4f}" if share else "-", where])
    head = ["w/h", "Wunderlich, K = 10", "finite, K = 10", "Wunderlich, K = -10", "finite, K = -10"]
    return table([*head, "membrane % of the shell, K = 10", "where"], rows)


def frontier() -> str:
    """The weight under which a strip on edge falls over."""
    where = "[on_edge](../results/on_edge/README.md)"
    rows = [["shell", *(f"{_frontier()[_SHELL, float(width)]:.3f}" for width in WIDTHS), where]]
    for model, words in ON_EDGE.items():
        cells = [f"{_frontier()[model, float(w)]:.3f} ({100.0 * off(model, float(w)):+.2f} %)" for w in WIDTHS]
        rows.append([words, *cells, where])
    return table(["critical weight on edge, nu = 0.35", *(f"w/l = {width}" for width in WIDTHS), "where"], rows)


def bands() -> str:
    """Moebius bands of w/l = 1/30 beside their shells."""
    record = Pages(ROOT).read("shell_bands")
    assert record is not None

    def number(name: str) -> float:
        return record.numbers[name].value

    below = 100.0 * (1.0 - number("energy_30_100") / number("ribbon_30"))
    finite = 100.0 * max(abs(number(f"finite_30_{ratio}")) for ratio in (10, 25, 50, 100, 200, 400))
    return (
        f"{number('distance_30_100'):.2e} l at w/h = 100, the shell's energy {below:.2f} % below, `finite` within "
        f"{finite:.2f} %: [Moebius bands](../results/shell_bands.md)"
    )


def in_one() -> str:
    """Section 5: what to use, with the distances of this page's data."""

    def d(ratio: str, model: str) -> str:
        return f"{max(distance(scene, ratio, model) for scene in ('curl_4_3', 'curl_4_3_down')):.1e}"

    twist = max(abs(off("finite, straight", w)) for w in (0.05, 0.1))
    thick = abs(off("finite, straight", 0.02))
    rod = max(abs(off("kirchhoff, plate", float(w))) for w in WIDTHS)
    finite, curl = 'ribbon, `energy = "finite"`', "[curl 4.3](../results/models_4_3/README.md)"
    rows = [
        ["thin (w/h > 100), shape wanted to some percents of l", "ribbon, Wunderlich",
         f"{d('200', 'wunderlich')} l at w/h = 200, {curl}"],
        ["w/h from 20 on, shape wanted to 1 % of l or better", finite,
         f"{d('20', 'finite')} l at w/h = 20, {d('100', 'finite')} at 100, {curl}"],
        ["w/h = 10", f"{finite}, and one shell to know the distance",
         f"{d('10', 'finite')} l, Wunderlich {d('10', 'wunderlich')}, {curl}"],
        ["nu near 0", "ribbon, Wunderlich", "section 3"],
        ["forces and contact of a planar fold", "ribbon",
         "planar, and wide strips stay plane across ([roman](../results/roman.md))"],
        ["closed bands", "ribbon; a shell where the energy matters below w/h = 400", bands()],
        ["buckling in twist, w/h >= 50", f"{finite}, ruling straight",
         f"{100.0 * twist:.2f} % at w/h = 50 and 100; Wunderlich is half as much too high"],
        ["buckling in twist, thicker", f"{finite}, and a shell below w/h = 20",
         f"{100.0 * thick:.2f} % at w/h = 20; the rod up to {100.0 * rod:.1f} %"],
        ["two corners held, or a fold at a clamp under a large weight", "shell", "no model of lines has it: section 2"],
        ["local stress at a clamp", "shell, with the clamp that you have", "section 2"],
    ]  # fmt: skip
    return table(["the ribbon", "use", "because"], rows)


def cost() -> str:
    """Section 4: times and errors of single solves, from the tables of curl 4.3 and of the narrow Moebius band."""
    with (RESULTS / "curl_4_3" / "table.csv").open(newline="") as file:
        row = next(row for row in csv.DictReader(file) if float(row["width_to_thickness"]) == 200.0)
    curl, shells = "[curl_4_3](../results/curl_4_3/README.md)", "[shell_cost](../results/shell_cost.md)"

    def cells(model: str) -> list[str]:
        return [f"{float(row[f'{model}_error']):.1e}", f"{float(row[f'seconds_{model}']):.{_SECONDS[model]}g}", curl]

    # mesh: error and seconds, of "mesh, unknowns, status, error, membrane, Newton, factorisations, s, ..."
    on_mesh = {row[0]: (row[3], row[7]) for row in _rows("shell_cost.md") if row[0].startswith("Q2 ")}
    page = (RESULTS / "moebius.md").read_text()
    band = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| adaptive |")][-1]
    rows = [
        ["ribbon, curl 4.3, 20 graded segments", *cells("ribbon")],
        ["shell, the same, w/h = 200", *cells("shell")],
        *([f"shell, w/h = 100, {mesh}", *on_mesh[mesh], shells] for mesh in ("Q2 25 x 2", "Q2 50 x 4", "Q2 150 x 12")),
        [f"Moebius band, w/l = 0.01, segments by a tolerance, p = {band[1]}", band[4], band[-1],
         "[moebius](../results/moebius.md)"],
    ]  # fmt: skip
    return table(["solver and scene", "error", "s", "where"], rows)


def hits() -> str:
    """How often the quick check is right, and the distances that it estimates, from the page of limits."""
    where = "[limits](../results/limits/README.md)"
    found = _rows("limits/README.md")
    rows = []
    for name, words in HIT_CASES.items():
        (counts,) = (row[2:] for row in found if row[:2] == [name, "1 %"])
        rows.append([words, *counts, where])
    head = ["cases (limits: 1 % of l, 1 % of the energy)", "known", "good by the shell", "same level", "too cautious"]
    (ratio,) = (row[1:3] for row in found if row[0] == "grid, edge" and " to " in row[2])
    return (
        table([*head, "too bold", "false safe", "where"], rows)
        + f"\n\nOn the edge-held cases the estimated distance is {ratio[0]} times the shell's in the median, from "
        f"{ratio[1]} times: it errs towards caution where a wide strip folds at its clamp."
    )


def _rows(file: str) -> list[list[str]]:
    """The rows of all tables of a page under results/."""
    lines = (RESULTS / file).read_text().splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]


#: Digits of a time on the page of curl 4.3.
_SECONDS = {"ribbon": 2, "shell": 3}


def blocks() -> dict[str, str]:
    """What stands on the page between its marks, by name."""
    return {"distances": distances(), "frontier": frontier(), "hits": hits(), "cost": cost(), "in_one": in_one()}


def written(page: str) -> str:
    """The page with its blocks made anew. ValueError where a mark is missing."""
    for name, block in blocks().items():
        first = page.index(f"<!-- {name} -->\n") + len(f"<!-- {name} -->\n")
        page = page[:first] + block + "\n" + page[page.index("<!-- end -->", first) :]
    return page


#: What the tables are made of.
READS = (
    "models_4_3/distances.csv", "on_edge/frontier.csv", "curl_4_3/table.csv", "moebius.md", "data/shell_bands.json",
    "shell_cost.md", "limits/README.md",
)  # fmt: skip
#: The critical weights of `finite` that the page sets beside the shell's, computed again as the page `on_edge` does.
PROBES = {
    f"finite_{NAMED[width]}": lambda width=width: straight("finite, straight", width)
    for width in map(float, WIDTHS[:2])
}
#: The frontiers are located to this (`on_edge`), relative.
LOCATED = 5e-4


def numbers() -> dict[str, Number]:
    """What its tables say in words: critical weights of `finite`, their distance to the shell's, largest distances."""
    found = {}
    for width in WIDTHS:
        value = _frontier()["finite, straight", float(width)]
        found[f"finite_{NAMED[float(width)]}"] = Number(value, LOCATED * value, "D w / l^2", ".3f")
    twist = max(abs(off("finite, straight", float(width))) for width in WIDTHS[1:])
    found["twist"] = Number(100.0 * twist, 100.0 * LOCATED, "%", ".2f")
    for ratio in ("20", "200"):
        for model in ("finite", "wunderlich"):
            value = max(distance(scene, ratio, model) for scene in ("curl_4_3", "curl_4_3_down"))
            found[f"{model}_{ratio}"] = Number(value, None, "l", ".1e", "the page models_4_3 has the shells' errors")
    return found


def run(out: Path) -> dict[str, Number]:
    """Writes the blocks into the template of docs/which_model.md, which is then rendered (readme.py)."""
    place = template(PAGE)
    atomic_write_text(place, written(place.read_text()))
    return numbers()
