"""The number that stands for each shipped scene on docs/gallery.md, and what it is measured against."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.models.base import State
from ribbon import Equilibrium
from tests.validation.readme import named, render
from tests.validation.record import Pages


@dataclass(frozen=True)
class Headline:
    """quantity: what the number is, with its unit; value: of an equilibrium; form: how it is written; source: what it
    stands beside (Markdown); numbers of pages in it as placeholders of `tests.validation.readme`."""

    quantity: str
    value: Callable[[Any], float]
    form: str
    source: str

    def text(self, equilibrium: Equilibrium | State) -> str:
        """The number as the page has it."""
        return format(self.value(equilibrium), self.form)

    def beside(self, pages: Pages) -> str:
        """What it stands beside, with the numbers that the pages have now."""
        kept = {name: record for name in named(self.source) if (record := pages.read(name)) is not None}
        return render(self.source, kept)


def written(page: str, pages: Pages) -> str:
    """docs/gallery.md with what stands beside every number as the pages have it now."""
    for name, headline in HEADLINES.items():
        start = page.find(f"\n## {name}\n")
        line = re.compile(r"(\*\*" + re.escape(headline.quantity) + r": .*?\*\*\. Beside it: ).*?\.(?=\n|$)")
        match = line.search(page, start) if start >= 0 else None
        if match is not None:
            page = f"{page[: match.start()]}{match[1]}{headline.beside(pages)}.{page[match.end() :]}"
    return page


#: D w / l of the tape of Martin et al. 2017, table 2, N mm; and D w / l^2, N.
_TAPE_MOMENT = 210000.0 * 0.15**3 / 12.0 / (1.0 - 0.3**2) * 60.0 / 1000.0
_TAPE_FORCE = _TAPE_MOMENT / 1000.0


def _fold_moment(e: State) -> float:
    """N mm, at s = 0."""
    assert e.supports.start is not None
    return _TAPE_MOMENT * float(np.linalg.norm(e.supports.start.moment))


def _tip_force(e: State) -> float:
    """N, along t_y at s = l."""
    assert e.supports.end is not None
    return _TAPE_FORCE * float(np.linalg.norm(e.supports.end.force))


def _total(e: Equilibrium) -> float:
    return e.energy.total


def _by_pi(e: Equilibrium) -> float:
    return e.energy.total / math.pi**2


def _roof(e: Equilibrium) -> float:
    return float(np.linalg.norm(e.walls[-1].force))


def _drop_over_reach(e: Equilibrium) -> float:
    return -float(e.end.position[1]) / float(e.end.position[2])


def _out_of_plane(e: Equilibrium) -> float:
    """Largest distance over l of the centreline from the vertical plane of the clamp's tangent."""
    r, frame = e.joints
    return float(np.abs((e.position(np.linspace(0.0, 1.0, 401)) - r[0]) @ frame[0][:, 0]).max())


def _middle_height(e: Equilibrium) -> float:
    return float(e.middle.position[2])


def _centre_height(e: Equilibrium) -> float:
    """Of the weight's centre over the table."""
    problem = e.problem
    assert problem.gravity is not None
    wall = problem.walls[0]  # type: ignore[attr-defined]
    s = (np.arange(4000) + 0.5) / 4000
    return float(((e.position(s) - np.asarray(wall.point)) @ np.asarray(wall.normal)).mean())


def _side(e: Equilibrium) -> float:
    return abs(float(e.end.position[1]))


def _across_weight(e: Equilibrium) -> float:
    return float(np.hypot(*e.end.position[1:]))


def _along_the_force(run: State) -> float:
    assert run.end is not None
    return 1e4 * float(run.end.position[1])


def _across_the_plane(run: State) -> float:
    assert run.end is not None
    return float(run.end.position[1])


def _drop(e: Equilibrium) -> float:
    return -float(e.end.position[1])


def _out_of_the_bend(run: State) -> float:
    """In the papers' unit, l being 25 pi of it."""
    return 25.0 * math.pi * float(run.shape.centreline(np.array([1.0]))[0, 0])


def _diameter(run: State) -> float:
    return float(np.linalg.norm(run.middle.position))


def _elastic(run: State) -> float:
    assert run.energy is not None
    assert run.energy.elastic is not None
    return run.energy.elastic


def _aside(run: State) -> float:
    """In cm, of a stem 10 cm long."""
    return 10.0 * float(run.shape.centreline(np.array([1.0]))[0, 0])


_ASIDE = "the flower's place to the side, cm"
_DAISY = "the same by deflation, the other equilibria beside it: [daisy](../results/daisy.md)"
_ENERGY = "total energy, D w / l"
_COIL = "energy with the thesis's p; with 320 segments, and the thesis's iterations: [coils](../results/coils.md)"
_START = "rows or elimination, quaternions or matrices give the same: [start_clamp](../results/start_clamp.md)"

HEADLINES: dict[str, Headline] = {
    "arc_5_1": Headline(
        _ENERGY, _total, ".4f",
        "all ten perturbed seeds end here: [seeds](../results/seeds.md)",
    ),
    "cantilever": Headline(
        "drop over reach of the free end", _drop_over_reach, ".5f",
        "planar elastica by collocation: 1.06680 (`tests/compare/scenes/test_scenes_shipped.py`)",
    ),
    "coil_10_100": Headline(_ENERGY, _total, ".4f", _COIL),
    "coil_40_1200": Headline(_ENERGY, _total, ".4f", _COIL),
    "coil_100_7500": Headline(
        _ENERGY, _total, ".4f",
        "20 segments, as in the thesis, are too few here: {coils.energy_100_up:.2f} with 320, and one search from "
        "the natural shape "
        "ends higher on them, at -5653; [coils](../results/coils.md), [seeds](../results/seeds.md)",
    ),
    "curl_4_3": Headline(
        _ENERGY, _total, ".4f",
        "the shell of w/h = 200 has {curl.total_up_200} and is {curl.distance_up_200:.1e} l away: "
        "[curl_4_3](../results/curl_4_3/README.md)",
    ),
    "curl_4_3_down": Headline(
        _ENERGY, _total, ".4f",
        "beside five shells: [curl_4_3_down](../results/curl_4_3_down/README.md)",
    ),
    "curl_4_4_long": Headline(
        "largest distance from the plane of the clamp, l", _out_of_plane, ".3f",
        "planar up to {curl_length.wunderlich_free:.1f} cm with this clamp and energy, of 40 cm it is not: "
        "[curl_length](../results/curl_length.md)",
    ),
    "curl_4_4_short": Headline(
        "largest distance from the plane of the clamp, l", _out_of_plane, ".3f",
        "planar up to {curl_length.wunderlich_free:.1f} cm with this clamp and energy, of 25 cm it is: "
        "[curl_length](../results/curl_length.md)",
    ),
    "daisy_5g": Headline(_ASIDE, _aside, ".5f", _DAISY),
    "daisy_10g": Headline(_ASIDE, _aside, ".5f", _DAISY),
    "daisy_sheet": Headline(
        _ASIDE, _aside, ".5f",
        "the same by deflation, and the saddle at {daisy.tip_10g:.5f} cm to which Newton goes from rest: "
        "[daisy](../results/daisy.md)",
    ),
    "daisy_straight": Headline(
        _ASIDE, _aside, ".4f",
        "one of both branches of the pitchfork, which begin at {daisy.critical_mass_bending:.3f} g: "
        "[daisy](../results/daisy.md)",
    ),
    "edge_published": Headline(
        "the free end's place to the side, l", _side, ".4f",
        "0.5258 of a published shell: an inextensible ribbon of this width falls over too far "
        "(`tests/compare/scenes/test_scenes_published.py`)",
    ),
    "figure_4_1": Headline(
        _ENERGY, _total, ".3f",
        "all ten perturbed seeds end here: [seeds](../results/seeds.md); on solve_bvp against the element: "
        "[strong_form](../results/strong_form.md)",
    ),
    "hanging_5_3_1": Headline(
        _ENERGY, _total, ".9f",
        "p = 200: -0.206780080; chained, mixed and matrix model agree: [formulations](../results/formulations.md)",
    ),
    "jfig_5_2": Headline(
        _ENERGY, _total, ".3f",
        "-113.232132 with 160 segments (`tests/compare/scenes/test_scenes_published.py`); under the thesis's load for "
        "the same figure, 6.7 times as much: [figure_4_1](#figure_4_1)",
    ),
    "lateral_7_1": Headline(
        "the free end's place to the side, l", _side, ".4f",
        "it has fallen over: the straight strip of this width loses stability at Gamma = "
        "{shell_lateral.critical_005:.2f} as a shell "
        "([shell_lateral](../results/shell_lateral.md)), as a Sadowsky ribbon with a free ruling half as much again "
        "later ([which model](which_model.md))",
    ),
    "limits_7_3": Headline(
        _ENERGY, _total, ".4f",
        "the shell held at corners of 0.01 has -31.500 and 2.2 % membrane energy, with its whole edge held -32.060 "
        "and "
        "1.6 %: [shell_corners](../results/shell_corners.md)",
    ),
    "moebius_6_1": Headline(
        "energy / pi^2", _by_pi, ".4f",
        "equal segments, as in the thesis; {moebius.energy_0p01:.4f} with segments placed by a tolerance of 2e-5: "
        "[moebius](../results/moebius.md)",
    ),
    "moebius_6_1_clamped": Headline(
        "energy / pi^2", _by_pi, ".5f", "5.82160, without the event: [moebius](../results/moebius.md)"
    ),
    "moebius_6_1_straight": Headline(
        "energy / pi^2", _by_pi, ".5f",
        "{moebius.energy_pinned:.5f} on these segments, {moebius.energy_0p01:.4f} at a tolerance of 2e-5: "
        "[moebius](../results/moebius.md)",
    ),
    "moebius_narrow": Headline(
        "energy / pi^2", _by_pi, ".4f", "{moebius.energy_0p002:.4f} at a tolerance of 2e-5: "
        "[moebius](../results/moebius.md)"
    ),
    "moebius_wide": Headline(
        "energy / pi^2", _by_pi, ".4f", "{moebius.energy_0p3:.4f} at a tolerance of 2e-5: "
        "[moebius](../results/moebius.md)"
    ),
    "moebius_table_edge": Headline(
        "height of the centre of weight over the table, l", _centre_height, ".4f",
        "0.1127 with 400 segments; on these a minimum, pushed hard enough it falls: "
        "[moebius_table](../results/moebius_table.md)",
    ),
    "moebius_table_fallen": Headline(
        "height of the centre of weight over the table, l", _centre_height, ".4f",
        "0.0351 with 400 segments: [moebius_table](../results/moebius_table.md)",
    ),
    "pretwisted_macneal": Headline(
        "the loaded end's way along the force, 1e-4 l", _along_the_force, ".5f",
        "the shell has 4.514 (0.0054168 over the length 12), the published beam 4.5204: "
        "`tests/validation/shell/rest_shapes.py`",
    ),
    "slit_annulus": Headline(
        "the lifted end's way across the plane, l", _across_the_plane, ".4f",
        "a rod, whose section keeps its shape, gives way too far at w/h = 133: the shell has 0.27596 at the inner "
        "corner and 0.34833 at the outer one (`tests/validation/shell/rest_shapes.py`)",
    ),
    "curled_end": Headline(
        "drop of the end, l", _drop, ".5f",
        "the planar elastica has the same to 1e-6 (`tests/compare/scenes/test_scenes_rest.py`)",
    ),
    "bend_45": Headline(
        "the tip's way out of the plane, in units of the section's side", _out_of_the_bend, ".3f",
        "Simo and Vu-Quoc 1986 with 8 linear elements: 53.37, shooting on the rod's equations: 53.475 "
        "(`tests/shellref/rod/test_rod.py`)",
    ),
    "roll_up": Headline(
        "diameter of the circle, l", _diameter, ".5f", "1 / pi; the ends meet (`tests/shellref/rod/test_rod.py`)"
    ),
    "ring_twisted": Headline(
        "elastic energy, D w / l", _elastic, ".3f",
        "the circle's 2 pi^2 + G J turn^2 / 2 = 94.05 in the limit of many edges; it loses stability at 14.148 rad, "
        "2 pi sqrt(3) E I / (G J) (`tests/ribbon/rods/test_buckling.py`)",
    ),
    "rod_wrung": Headline(
        "elastic energy, D w / l", _elastic, ".3f",
        "bowed and not turned: 4.05 (`tests/compare/scenes/test_scenes_rods.py`)",
    ),
    "rod_4_5": Headline(
        "the free end's place across the weight, sqrt(y^2 + z^2) / l", _across_weight, ".5f",
        "0.20971 of Wunderlich's ribbon, 0.19500 of a strip of finite thickness: "
        "[rod_ribbon](../results/rod_ribbon/README.md)",
    ),
    "tape_4_1": Headline(
        "moment of the fold, N mm", _fold_moment, ".2f",
        "96.66 of the shell, {tape.plateau_enriched} of this section by equal areas, 96.429 of any shape: "
        "[tape](../results/tape/README.md)",
    ),
    "tape_4_1_equal": Headline(
        "moment of the fold, N mm", _fold_moment, ".2f",
        "56.01 of the shell, {tape.plateau_enriched_equal} of this section by equal areas, 53.099 of any shape: "
        "[tape](../results/tape/README.md)",
    ),
    "tape_4_2": Headline(
        "force at the moved end, N", _tip_force, ".4f",
        "in the mean over the second half of the way 0.1241, the shell's 0.1294: [tape](../results/tape/README.md)",
    ),
    "roman_6_2": Headline(
        "force of the roof, D w / l^2", _roof, ".2f",
        "Roman's elastica with weight: 70.27; [roman](../results/roman.md)",
    ),
    "roman_folds": Headline(
        "force of the roof, D w / l^2", _roof, ".0f",
        "three folds; Roman's elastica with weight has 1224.1 and 2072.7 at roofs a little higher and a little lower: "
        "[roman](../results/roman.md)",
    ),
    "roman_plate": Headline(
        "force of the plate, D w / l^2", _roof, ".2f",
        "the same as the rigid roof's at the same height, to 4e-12: [roman](../results/roman.md)",
    ),
    "shift_7_2": Headline(
        "height of the middle over the clamps, l", _middle_height, ".4f",
        "the shell's path up to both kinks: [shell_shift](../results/shell_shift.md)",
    ),
    **{f"start_5_3_3_{k}": Headline(_ENERGY, _total, ".5f", _START) for k in range(1, 6)},
    "two_clamps_5_3_2": Headline(
        _ENERGY, _total, ".5f",
        "reading A of 5.3.2, where the chained model may fail: [formulations](../results/formulations.md)",
    ),
    "two_clamps_5_3_2_level": Headline(
        _ENERGY, _total, ".5f",
        "reading B, where the chained model fails every time: [formulations](../results/formulations.md)",
    ),
    "two_clamps_5_3_2_twist": Headline(
        _ENERGY, _total, ".3f",
        "one of many minima of nearly this energy (7.4 to 8.0): [formulations](../results/formulations.md)",
    ),
}  # fmt: skip
