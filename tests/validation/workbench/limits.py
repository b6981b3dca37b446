"""Thesis 7.3 over its grid, both ways of clamping; a mesh study; how often the ribbon's own estimate is right."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from compare.models.scope import require_shell
from compare.models.shell_build import shell_options, shell_problem
from compare.models.shell_process import run_shell
from compare.page.csv import as_csv
from compare.page.markdown import as_markdown
from compare.pages import limits as limits_results
from compare.pages.pictures import limits as limits_figures
from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_text
from compare.studies.axes import parse_axis, points
from compare.studies.limits import Finding, Thresholds, hits, quick, study, with_clamp
from tests.validation import page
from tests.validation.number import Number

WIDTHS = "strip.width=0.03,0.05,0.1,0.2,0.3,0.5"
GAMMAS = "strip.gamma=10,100,1000"
#: (width, Gamma, held) of the mesh study, and its meshes.
STUDIED = (
    (0.03, 100, "edge"), (0.1, 100, "edge"), (0.2, 1000, "edge"), (0.5, 1000, "edge"), (0.1, 100, "corners"),
    (0.5, 10, "corners"),
)  # fmt: skip
MESHES = ((50, 6), (100, 12), (130, 16))
#: The case whose fold at the clamp needs more.
FOLDED = (0.5, 1000, "edge")
FINE = ((100, 12), (130, 16), (200, 24))
GRADED = (0.1, 0.2)
#: Scenes on which nothing was fitted: name, how it is held, fixed keys, axes.
OTHERS: tuple[tuple[str, str, dict[str, Any], tuple[str, ...]], ...] = (
    ("limits_7_3", "edge", {"strip.poisson": 0.0}, ("strip.width=0.05,0.2", "strip.gamma=10,100,1000")),
    ("limits_7_3", "edge", {"strip.poisson": 0.25}, ("strip.width=0.05,0.2", "strip.gamma=10,100")),
    ("limits_7_3", "edge", {"strip.thickness": 1e-4}, ("strip.width=0.05,0.2", "strip.gamma=10,100")),
    ("limits_7_3", "edge", {"strip.thickness": 3e-3}, ("strip.width=0.1,0.3", "strip.gamma=10,100")),
    ("limits_7_3", "edge", {"strip.gamma": 1.0}, ("strip.width=0.05,0.2",)),
    ("curl_4_3", "edge", {}, ("shell.width_to_thickness=10,20,50,100,200",)),
    ("curl_4_3", "edge", {"strip.poisson": 0.0}, ("shell.width_to_thickness=20,100,500",)),
    ("curl_4_3", "edge", {"strip.natural_curvature": 3.0, "strip.gamma": 20.0}, ("shell.width_to_thickness=20,200",)),
    ("curl_4_3_down", "edge", {}, ("shell.width_to_thickness=20,100",)),
    ("cantilever", "edge", {"strip.poisson": 0.0}, ("shell.width_to_thickness=20,200",)),
    ("cantilever", "edge", {"strip.poisson": 0.3}, ("shell.width_to_thickness=20,200",)),
    ("limits_7_3", "corners", {"shell.corner": 0.02, "strip.poisson": 0.25},
     ("strip.width=0.1,0.3", "strip.gamma=10,100")),
    ("limits_7_3", "corners", {"shell.corner": 0.005, "strip.thickness": 5e-4},
     ("strip.width=0.05,0.2", "strip.gamma=30,300")),
)  # fmt: skip
STEPS = Thresholds(), Thresholds(0.02, 0.02), Thresholds(0.05, 0.05)
#: What must hold, or the page is not written: every case of the grid converged; shares on the two finest meshes agree
#: to this part (for the folded case the page states by how much they differ); estimates of the edge-held cases of 7.3
#: within this factor.
MESH_CHANGE = 0.05
FACTOR = 4.0


def findings(scene: Scene, axes: Sequence[str], store: CaseStore, reporter: Reporter) -> list[Finding]:
    """The findings of a grid."""
    found: list[Finding] = []
    for point in points(scene, [parse_axis(axis) for axis in axes]):
        found += study(point.scene, store, reporter, Thresholds(), point.values)[0]
    return found


#: w and Gamma of the estimates (whole edge held) that `make test` computes again.
PROBED = ((0.05, 10.0), (0.1, 100.0))


@functools.cache
def estimate(width: float, gamma: float, finer: int = 1) -> tuple[float, float]:
    """What the ribbon alone says of a case of 7.3: distance (% of l) and share of stretching (%)."""
    scene = with_clamp(load("limits_7_3"), "edge").replace({"strip.width": width, "strip.gamma": gamma})
    scene = scene.replace({"model.elements": finer * scene.model.elements})
    found = quick(scene, Thresholds())[0].estimate
    return 100.0 * float(found.distance), 100.0 * float(found.share)


def _named(width: float, gamma: float) -> str:
    return f"w{width:g}_g{gamma:g}".replace(".", "")


PROBES = {
    f"estimate_{kind}_{_named(*case)}": lambda case=case, k=k: estimate(*case)[k]
    for case in PROBED
    for k, kind in enumerate(("distance", "share"))
}


def numbers(grid: dict[str, list[Finding]], others: list[Finding]) -> dict[str, Number]:
    """Estimates with their change on twice as many elements; counts over the grid and over the other scenes."""
    found = {}
    for case in PROBED:
        for k, kind in enumerate(("distance", "share")):
            value, finer = estimate(*case)[k], estimate(*case, finer=2)[k]
            found[f"estimate_{kind}_{_named(*case)}"] = Number(value, abs(finer - value), "%", ".3g")
    for clamp, findings_of in grid.items():
        shares = [100.0 * one.share for one in findings_of if one.share is not None]
        found[f"above_one_{clamp}"] = Number(sum(share > 1.0 for share in shares), 0, shown="d")
        found[f"cases_{clamp}"] = Number(len(shares), 0, shown="d")
        for word, share in (("least", min(shares)), ("most", max(shares))):
            found[f"{word}_{clamp}"] = Number(share, MESH_CHANGE * share, "%", ".2f")
    score = hits(others)
    for key in ("known", "same", "cautious", "bold", "false_safe"):
        found[f"others_{key}"] = Number(score[key], 0, shown="d")
    ratio = [f.estimate.distance / f.distance for f in others if f.distance and f.distance > 1e-3]
    for word, value in (("median", median(ratio)), ("least", min(ratio)), ("most", max(ratio))):
        found[f"ratio_{word}"] = Number(value, None, shown=".2f", why="over cases of different shells")
    return found


def run(out: Path) -> dict[str, Number]:
    store = CaseStore(out.parent / "out" / "validate" / "limits" / "cases")
    with Reporter() as reporter:
        grid = {
            clamp: findings(with_clamp(load("limits_7_3"), clamp), (WIDTHS, GAMMAS), store, reporter)
            for clamp in ("edge", "corners")
        }
        meshes = [
            (width, gamma, clamp, _on_meshes(width, gamma, clamp, store, reporter)) for width, gamma, clamp in STUDIED
        ]
        even = [_even(width, gamma, store, reporter) for width in (0.03, 0.05, 0.1) for gamma in (10, 100)]
        others = [
            finding
            for name, clamp, keys, axes in OTHERS
            for finding in findings(with_clamp(load(name), clamp).replace(keys), axes, store, reporter)
        ]
    _check(grid, meshes)
    both = [*grid["edge"], *grid["corners"]]
    folder = out / "limits"
    folder.mkdir(parents=True, exist_ok=True)
    for clamp, found in grid.items():
        held = "whole edge held" if clamp == "edge" else "corners of 0.01 held"
        limits_figures.shares_picture(folder / f"shares_{clamp}.png", found, f"7.3, {held}")
        limits_figures.maps_picture(folder / f"maps_{clamp}.png", found, f"7.3, {held}")
        if clamp == "corners":
            limits_figures.shapes_picture(folder / f"shapes_{clamp}.png", found, f"7.3, {held}")
    limits_figures.estimate_picture(
        folder / "estimate.png", [*both, *others], "Estimate from the ribbon alone, and shell"
    )
    atomic_write_text(folder / "grid.csv", as_csv(limits_results.full_table(both)))
    atomic_write_text(folder / "others.csv", as_csv(limits_results.full_table(others)))
    page.write(
        folder / "README.md",
        "Limits of inextensibility (thesis, 7.3)",
        "python -m tests.validation limits",
        "Strip clamped with its width at 45 degrees, weight across: l = 1, h = 1e-3, nu = 0.4, w and Gamma as in the "
        "thesis (scene limits_7_3; shells of 100 x 8 elements, above w = 0.15 of 100 x 12, errors from half as many; "
        "ribbon with a straight ruling for the edge, a free one for the corners). The first 36 rows are what "
        "`ribbonbench limits limits_7_3 --clamp both --widths 0.03,0.05,0.1,0.2,0.3,0.5 --gammas 10,100,1000` gives.",
        *(
            part
            for clamp, found in grid.items()
            for part in (f"## {'Whole edge' if clamp == 'edge' else 'Two corners (cells of 0.01)'} held", _table(found))
        ),
        "## Beside the thesis",
        _statements(grid),
        "![Energies by kind, whole edge](shares_edge.png)",
        "![Energies by kind, corners](shares_corners.png)",
        "![Local shares, whole edge](maps_edge.png)",
        "![Local shares, corners](maps_corners.png)",
        "![Shells at rest, corners](shapes_corners.png)",
        "## Meshes",
        "Membrane and shear share (%) and the distance to the ribbon (% of l). The strip of w = 0.5 folds at its clamp "
        "under Gamma = 1000; its share has not settled to more than the change stated.",
        page.table(
            ["w/l", "Gamma", "held", "mesh", "stretching %", "change", "distance % l", "mesh's own error % l"],
            [row for study_of in meshes for row in _mesh_rows(*study_of)],
        ),
        "Even meshes of squares of 0.01, one-cell corners held, as the thesis's triangles:",
        page.table(["w/l", "Gamma", "elements", "membrane %", "shear %"], even),
        "## The estimate from the ribbon alone",
        "How often `ribbonbench limits --quick` gives the level that the shell gives, for several thresholds of "
        '"good" (percent of l, and of the elastic energy). How far the shape moves is the distance to the strip with '
        'energy "finite" and what that one leaves out; what clamps do is fitted on rows of the grid and of '
        "[auto](../auto/README.md): two constants of the distance, two of the share. The other scenes (`others.csv`: "
        "other nu, h, K, corners, scenes) were no rows of that fit, and were in view; "
        "[unseen](../unseen.md) ones were not.",
        _hits({"grid, edge": grid["edge"], "grid, corners": grid["corners"], "other scenes": others}),
        _accuracy({"grid, edge": grid["edge"], "grid, corners": grid["corners"], "other scenes": others}),
        "(Ratios over cases whose shell has more than 0.1 % of it.)",
        "![Estimates against shells](estimate.png)",
        "### Other scenes",
        _table(others, named=True),
    )
    return numbers(grid, others)


def _on_meshes(width: float, gamma: float, clamp: str, store: CaseStore, reporter: Reporter) -> list[Finding]:
    base = with_clamp(load("limits_7_3"), clamp).replace({"strip.width": width, "strip.gamma": gamma})
    return [
        study(
            base.replace({"shell.elements": list(mesh), "shell.grading": list(GRADED)}), store, reporter, Thresholds()
        )[0][0]
        for mesh in (FINE if (width, gamma, clamp) == FOLDED else MESHES)
    ]


def _mesh_rows(width: float, gamma: float, clamp: str, found: list[Finding]) -> list[list[str]]:
    rows, last = [], None
    for finding in found:
        assert finding.row is not None
        share = finding.share or 0.0
        along, across = finding.row.elements
        rows.append([
            f"{width:g}", f"{gamma:g}", clamp, f"{along} x {across}", f"{100 * share:.2f}",
            "" if last is None else f"{100 * (share / last - 1.0):+.1f} %", _percent(finding.distance),
            _percent(finding.row.shell_error),
        ])  # fmt: skip
        last = share
    return rows


def _even(width: float, gamma: float, store: CaseStore, reporter: Reporter) -> list[str]:
    """The shares on a mesh like the thesis's."""
    elements = [100, round(100 * width)]
    scene = load("limits_7_3").replace(
        {
            "strip.width": width, "strip.gamma": gamma, "shell.corner": None, "shell.elements": elements,
            "shell.grading": [1.0, 1.0],
        }
    )  # fmt: skip
    reporter.step(f"even mesh: w = {width:g}, Gamma = {gamma:g}")
    case = run_shell(shell_problem(scene, require_shell(scene)[0]), store, shell_options(scene))
    if not case.ok:
        raise AssertionError(f"even mesh, w = {width}, Gamma = {gamma}: {case.data['message']}")
    share = case.data["share"]
    return [
        f"{width:g}", f"{gamma:g}", f"{elements[0]} x {elements[1]}", f"{100 * share['membrane']:.2f}",
        f"{100 * share['shear']:.2f}",
    ]  # fmt: skip


def _check(grid: dict[str, list[Finding]], meshes: Sequence[tuple[float, float, str, list[Finding]]]) -> None:
    for found in grid.values():
        for finding in found:
            if not finding.ok or finding.share is None:
                raise AssertionError(f"{finding.values}: {finding.sentence}")
    for finding in grid["edge"]:
        for measured, estimated in (
            (finding.distance, finding.estimate.distance),
            (finding.share, finding.estimate.share),
        ):
            assert measured is not None
            if estimated is None or not 1.0 / FACTOR < estimated / measured < FACTOR:
                raise AssertionError(f"{finding.values}: estimate {estimated}, shell {measured}")
    for width, gamma, clamp, found in meshes:
        finer = [f.share for f in found[-2:]]
        assert finer[0] is not None
        assert finer[1] is not None
        if (width, gamma, clamp) != FOLDED and not abs(finer[0] / finer[1] - 1.0) < MESH_CHANGE:
            raise AssertionError(f"w = {width}, Gamma = {gamma}, {clamp}: shares {finer} on the two finest meshes")


def _table(found: Sequence[Finding], named: bool = False) -> str:
    if named:
        rows = []
        for finding in found:
            assert finding.row is not None
            scene = finding.scene
            rows.append([
                scene.name, scene.shell.clamp, f"{scene.width:g}", f"{scene.strip.poisson:g}",
                f"{scene.curvature[0]:g}", f"{scene.gamma:g}", f"{finding.width_to_thickness:.4g}",
                finding.level or finding.row.status, _percent(finding.distance), _percent(finding.estimate.distance),
                _percent(finding.share), _percent(finding.estimate.share), str(finding.estimated_level),
            ])  # fmt: skip
        return page.table(
            [
                "scene", "held", "w/l", "nu", "K l", "Gamma", "w/h", "level", "distance % l", "estimated",
                "stretching %", "estimated", "level",
            ],
            rows,
        )  # fmt: skip
    return as_markdown(limits_results.table(found))


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.2f}"


def _statements(grid: dict[str, list[Finding]]) -> str:
    """What the thesis says of figures 7.9 and 7.10, and what the grid gives."""
    lines = []
    for clamp, found in grid.items():
        held = "whole edge" if clamp == "edge" else "corners"
        shares = [(100.0 * (f.share or 0.0), f.values) for f in found]
        above = sum(share > 1.0 for share, _ in shares)
        narrow = [s for s in shares if s[1]["strip.width"] <= 0.1 and s[1]["strip.gamma"] <= 100]
        low, high = min(narrow, key=lambda s: s[0]), max(narrow, key=lambda s: s[0])
        least = min(shares, key=lambda s: s[0])
        lines.append(
            f"- {held}: membrane and shear above 1 % of the elastic energy in {above} of {len(shares)} cases (thesis: "
            f"always), least {least[0]:.2f} % at w = {least[1]['strip.width']:g}, Gamma = {least[1]['strip.gamma']:g}; "
            f"for w <= 0.1 and Gamma <= 100 from {low[0]:.2f} to {high[0]:.2f} %, the largest at w = "
            f"{high[1]['strip.width']:g}, Gamma = {high[1]['strip.gamma']:g} (thesis: above 7 %)."
        )
    lines += [
        "- What stretches away from the clamp is the pair of layers along the free edges, which curve against "
        "Poisson's ratio: by the estimate their share is about nu^2 / (2 z) where eta = 0 and z is large, z = (3 (1 - "
        "nu^2))^(1/4) w sqrt(kappa / h). It falls with w, with kappa and with 1 / h, and is of order 1 % for these "
        'strips whatever holds them: the thesis\'s "never negligible", with a reason. Wide strips with the whole edge '
        "held go below.",
        '- Two corners let the edge between them bulge. That stretches the strip within w/2 of the clamp (column "at '
        "clamps\"), the more the wider it is, while the edges' part falls. It depends on the size of the corners: "
        "shell_corners.",
        "- With the whole edge held and Gamma = 1000 the rulings crowd at the clamp (|eta'| w/2 near 1) and most of "
        "the stretching of wide strips is there, about 1 % of the elastic energy.",
        "- Coarse meshes overstate all this: where the strip folds at its clamp, 8 elements across w = 0.5 give 3.0 % "
        "of membrane energy at Gamma = 1000, whole edge (`ribbonbench limits limits_7_3 --clamp edge --widths 0.5 "
        "--gammas 1000 "
        '--set "shell.elements=[100,8]" --set "shell.grading=[0.2,0.1]"`), and 12 to 24 the values below. '
        "The thesis's mesh (right triangles of 0.01) has 3 to 10 elements across strips of w <= 0.1.",
        "- The thesis's 7 % is not reached at w <= 0.1 on any mesh here, also not on even meshes of 0.01 by 0.01 with "
        "one-cell corners (6.3 % at w = 0.03, Gamma = 100, then 3 to 4 % at 0.05 and 2.4 % at 0.1). One-cell corners "
        "on finer meshes go up without a limit (shell_corners). Its elements (triangles with another integration rule) "
        "are not at hand; whether they make the difference stays open.",
    ]
    return "\n".join(lines)


def _hits(groups: dict[str, list[Finding]]) -> str:
    rows = []
    for name, found in groups.items():
        for thresholds in STEPS:
            scored = [again(f, thresholds) for f in found]
            score = hits(scored)
            rows.append([
                name, f"{100 * thresholds.distance:g} %", str(score["known"]), str(score["good"]), str(score["same"]),
                str(score["cautious"]), str(score["bold"]), str(score["false_safe"]),
            ])  # fmt: skip
    return page.table(
        ["cases", "threshold", "known", "good by the shell", "same level", "too cautious", "too bold", "false safe"],
        rows,
    )


def again(finding: Finding, thresholds: Thresholds) -> Finding:
    """The finding with its levels at other thresholds."""
    from dataclasses import replace

    known = finding.level is not None
    own = finding.estimate
    return replace(
        finding,
        level=thresholds.level(finding.distance, finding.share) if known else None,
        estimated_level=thresholds.level(own.distance, own.missing, more=own.passages, crowded=own.crowded),
    )


def _accuracy(groups: dict[str, list[Finding]]) -> str:
    import numpy as np

    rows = []
    for name, found in groups.items():
        cells = [name]
        for pairs in (
            [(f.distance, f.estimate.distance) for f in found],
            [(f.share, f.estimate.share) for f in found],
        ):
            ratio = np.array([b / a for a, b in pairs if a and b and a > 1e-3])
            cells += [f"{np.exp(np.median(np.log(ratio))):.2f}", f"{ratio.min():.2f} to {ratio.max():.2f}"]
        cells.append(f"{1e3 * float(np.median([f.estimate.seconds for f in found])):.0f}")
        rows.append(cells)
    return page.table(
        ["cases", "estimated / shell, distance: median", "range", "stretching: median", "range", "estimate, ms"], rows
    )
