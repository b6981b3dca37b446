"""Where the inextensible model stops being true (thesis, chapter 7): ribbon against shell, with a verdict in words.

For one scene, or each point of a grid: the shell's energies by kind and where on the strip they are, its distance to
the ribbon, and beside it what the ribbon alone had estimated (`compare.models.capabilities.Estimates`). Three levels:

    good   distance and share of stretching (membrane + shear, of the elastic energy) within the thresholds
    fair   both within five times the thresholds
    poor   beyond

The thresholds are 1 % of l and 1 % of the energy (`compare.measure.grades`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.energy_map import stretching_zones as by_zone
from compare.measure.grades import FAIR, GOOD, GOOD_UP_TO, GRADES, UNKNOWN, graded, resolved, worst
from compare.models import RICHEST
from compare.models.base import Options, State, check_keys
from compare.models.capabilities import Estimate, Estimates
from compare.models.choice import beside_the_shell, chosen
from compare.models.holds.words import briefly
from compare.models.scope import require_shell
from compare.page.pair import Row
from compare.page.wording import percent
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import Comparison, compare
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

LEVELS = GRADES[:3]
#: Size of held corners over l where the scene gives none (thesis, 7.3: triangles of 0.01), at most this part of w.
CORNER = 0.01
_CORNER_OF_WIDTH = 0.25
#: Part of the share by which it may differ from that on the coarser mesh without a word.
_SHARE_CHANGE = 0.25
#: The same of what an estimated share may be too small by.
_TOLD = 0.1


#: Errors of a measured distance and share, None: not known.
Errors = tuple[float | None, float | None]


@dataclass(frozen=True)
class Thresholds:
    """Up to which the model is "good": Hausdorff distance over l, share of the elastic energy."""

    distance: float = GOOD_UP_TO["distance"]
    share: float = GOOD_UP_TO["share"]

    def level(
        self,
        distance: float | None,
        share: float | None,
        errors: Errors | None = None,
        more: float = 0.0,
        crowded: float = 0.0,
    ) -> str | None:
        """The level of a distance and a share; None when one of them is not known and the other is not beyond. errors:
        of both, by which a measured one may not be known (`compare.measure.grades.resolved`); more: by how much an
        estimated share may be too small: it is good with that, or fair; crowded: the same where it rests on a formula
        near its pole: it is graded with that."""
        found = worst(*self.grades(distance, share, errors, more, crowded).values())
        return None if found == UNKNOWN else found

    def grades(
        self,
        distance: float | None,
        share: float | None,
        errors: Errors | None = None,
        more: float = 0.0,
        crowded: float = 0.0,
    ) -> dict[str, str]:
        """The grade of each of them."""
        values = {"distance": (distance, self.distance), "share": (share, self.share)}
        if errors is None:
            found = {name: graded(value, most) for name, (value, most) in values.items()}
            if share is not None:
                found["share"] = graded(share + crowded, self.share)
                if found["share"] == GOOD and graded(share + crowded + more, self.share) != GOOD:
                    found["share"] = FAIR
            return found
        own = dict(zip(values, errors, strict=True))
        return {name: resolved(value, own[name], most) for name, (value, most) in values.items()}


@dataclass(frozen=True)
class Maps:
    """Energy of the shell over the flat strip: knots s (k + 1,) and v (m + 1,) in l, density (k, m, 3) of bending,
    membrane and shear in D / l^2; points (n, q, 3) of the deformed surface in l."""

    s: FloatArray
    v: FloatArray
    density: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class Finding:
    """One scene at one w/h.

    values: the varied keys; row: of the comparison, None for an estimate alone; share_of_total: bending, membrane,
    shear and gravity over elastic + |gravity|; zones: where the stretching is, as parts of 1 ("clamps": within w/2 of
    them, "edges": beside the long edges, "rest"); parts: by cause, of the elastic energy; level, cause and sentence:
    the verdict; grades: of distance and share, each for itself, none where the state is not sure.
    """

    values: Mapping[str, Any]
    scene: Scene
    width_to_thickness: float
    ribbon: State
    ribbon_error: float | None
    row: Row | None
    estimate: Estimate
    share_of_total: Mapping[str, float] | None
    zones: Mapping[str, float] | None
    parts: Mapping[str, float]
    distance: float | None
    share: float | None
    level: str | None
    estimated_level: str | None
    sentence: str
    maps: Maps | None
    grades: Mapping[str, str] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Every solve behind it converged to a stable state."""
        return self.ribbon.ok and (self.row is None or self.row.status == "converged")

    @property
    def another(self) -> bool | None:
        """Whether the shell rests in another state than the ribbon; None: not known, of a shell that was found."""
        row = self.row
        if row is None or row.hausdorff is None or row.same_state is True:
            return False
        return None if row.same_state is None else True

    @property
    def cause(self) -> str:
        """What stretches most; "" where that is not known."""
        return max(self.parts, key=lambda name: self.parts[name], default="")

    @property
    def left_out(self) -> float | None:
        """Share of the energy that the model leaves out: all of the stretching where it bends alone, what it has too
        much or too little of otherwise; None where the share is not known."""
        return None if self.share is None else abs(self.share - self.estimate.own)

    @property
    def words(self) -> str:
        """The model beside the shell."""
        energy = self.ribbon.native.problem.energy
        return f'ribbon with energy = "{energy}"' if self.ribbon.native.has_free_twist else "inextensible ribbon"

    @property
    def false_safe(self) -> bool | None:
        """The estimate says "good" and the shell does not; None when one of them does not say."""
        if self.row is None or self.level is None or self.estimated_level is None:
            return None
        return self.estimated_level == "good" and self.level != "good"


def with_clamp(scene: Scene, clamp: str) -> Scene:
    """The scene held by "edge" (the ribbon's ruling straight there) or "corners" (its ruling free)."""
    ruling = "straight" if clamp == "edge" else "free"
    keys: dict[str, Any] = {"shell.clamp": clamp}
    for name, held in (("start", scene.clamp_start), ("end", scene.clamp_end)):
        if held is not None:
            keys[f"clamp.{name}.ruling"] = ruling
    model = scene.model
    graded = model.tolerance is None and model.element_lengths is None and scene.clamp_end is None
    if clamp == "edge" and graded and scene.clamp_start is not None:
        keys["model.grading"] = "clamp"
    if clamp == "corners" and scene.shell.corner is None:
        keys["shell.corner"] = scene.strip.length * min(CORNER, _CORNER_OF_WIDTH * scene.width)
    return scene.replace(keys)


def require_limits(scene: Scene) -> None:
    """Refuses a scene that no shell can stand beside, before anything is computed."""
    require_shell(scene)
    if not isinstance(chosen(scene), Estimates):
        raise BadInput(
            "model.energy",
            scene.model.energy,
            "has no estimate of what it leaves out",
            'choose "wunderlich" where the ribbon can do the scene, or ask shells: ribbonbench compare',
        )
    check_keys(beside_the_shell(scene), scene)


def quick(
    scene: Scene,
    thresholds: Thresholds,
    values: Mapping[str, Any] | None = None,
    say: Reporter | None = None,
) -> list[Finding]:
    """The estimates from the ribbon alone, one per w/h."""
    require_limits(scene)
    ribbon = beside_the_shell(scene).solve(scene, options=Options(error=True), say=say)
    return [estimated(scene, ribbon, ratio, thresholds, values or {}, say) for ratio in require_shell(scene)]


def estimated(
    scene: Scene,
    ribbon: State,
    ratio: float,
    thresholds: Thresholds,
    values: Mapping[str, Any],
    say: Reporter | None = None,
) -> Finding:
    """The estimate from a state of the ribbon that is solved already. scene: one that `require_limits` lets through."""
    beside = beside_the_shell(scene)
    assert isinstance(beside, Estimates)  # require_limits
    found = beside.estimate(scene, ribbon, ratio, say)
    sure = ribbon.ok and found.rival is None and not found.why
    more, crowded = found.passages, found.crowded
    grades = thresholds.grades(found.distance, found.missing, more=more, crowded=crowded) if sure else {}
    level = thresholds.level(found.distance, found.missing, more=more, crowded=crowded) if sure else None
    bare = Finding(
        values=values, scene=scene, width_to_thickness=ratio, ribbon=ribbon, ribbon_error=None, row=None,
        estimate=found, share_of_total=None, zones=None, parts=found.parts, distance=found.distance,
        share=None if found.why else found.share,
        level=level, estimated_level=level, sentence="", maps=None, grades=grades,
    )  # fmt: skip
    return replace(bare, sentence=sentence(bare))


def study(
    scene: Scene,
    store: CaseStore,
    reporter: Reporter,
    thresholds: Thresholds,
    values: Mapping[str, Any] | None = None,
    *,
    leave_saddle: bool | None = None,
) -> tuple[list[Finding], Comparison]:
    """The findings of a scene, one per w/h, with the comparison behind them; finished shells come from `store`."""
    require_limits(scene)
    comparison = compare(scene, store, reporter, leave_saddle=leave_saddle)
    found = [
        _found(comparison, row, state, thresholds, values or {})
        for row, state in zip(comparison.rows, comparison.shells, strict=True)
    ]
    return found, comparison


def _found(
    comparison: Comparison, row: Row, state: State, thresholds: Thresholds, values: Mapping[str, Any]
) -> Finding:
    from compare.measure.energy_map import density_on_grid

    scene, ratio = comparison.scene, row.width_to_thickness
    bare = estimated(scene, comparison.fast, ratio, thresholds, values)
    bare = replace(bare, row=row, ribbon_error=comparison.fast.error, level=None, distance=None, share=None, grades={})
    if not state.ok or row.share is None or row.energy is None or row.energy.elastic is None:
        return replace(bare, sentence=sentence(bare))
    energy = {**{part: row.energy.parts[part] for part in row.share}, "gravity": abs(row.energy.gravity)}
    of_total = {name: part / sum(energy.values()) for name, part in energy.items()}
    case = state.native
    parts = row.share if bare.estimate.bends else of_total  # an elastic energy of almost nothing has no shares
    share = parts["membrane"] + parts["shear"]
    surface = case.surface
    k = surface.degree
    maps = Maps(surface.s_nodes[::k], surface.v_nodes[::k], density_on_grid(case), surface.points)
    zones, shear_there = stretching_zones(scene, maps, ratio)
    left_out = abs(share - bare.estimate.own)
    sure = comparison.fast.ok and row.same_state is True
    unknown = row.ribbon_error is None or row.shell_error is None
    errors = None if unknown else row.ribbon_error + row.shell_error, row.share_error  # type: ignore[operator]
    level = thresholds.level(row.hausdorff, left_out, errors) if sure else None
    full = replace(
        bare,
        share_of_total=of_total,
        zones=zones,
        parts=_by_cause(bare.estimate, zones, share, parts["shear"], shear_there),
        distance=row.hausdorff,
        share=share,
        level=level,
        maps=maps,
        grades=thresholds.grades(row.hausdorff, left_out, errors) if sure else {},
    )
    return replace(full, sentence=sentence(full))


def stretching_zones(scene: Scene, maps: Maps, width_to_thickness: float) -> tuple[dict[str, float], float]:
    """`compare.measure.energy_map.stretching_zones` of a shell's map."""
    return by_zone(scene, maps.s, maps.v, maps.density, width_to_thickness)


def _by_cause(
    estimate: Estimate, zones: Mapping[str, float], share: float, shear: float, shear_away: float
) -> dict[str, float]:
    """The shell's stretching by cause: clamps and shear as measured, in-plane bending and tension as estimated (they
    cannot be told apart in a map of energy), the edges' layers the rest."""
    parts = {
        "clamps": zones["clamps"] * share,
        "shear": shear * shear_away,
        "in_plane": estimate.parts.get("in_plane", 0.0),
        "tension": estimate.parts.get("tension", 0.0),
    }
    return {"edges": max(share - sum(parts.values()), 0.0), **parts}


# -- words ------------------------------------------------------------------------------------------------------------


def reason(finding: Finding) -> str:
    """Why the strip stretches, in words with the number behind it."""
    scene, cause = finding.scene, finding.cause
    h = scene.width / finding.width_to_thickness
    whole = sum(finding.parts.values())
    portion = f" ({finding.parts[cause] / whole:.0%} of the stretching)" if whole > 0.0 else ""
    if cause == "edges":
        curvature = float(np.sqrt(np.mean(finding.ribbon.native.omega(np.linspace(0.0, 1.0, 401)) ** 2)))
        if not curvature > 0.0:
            return f"the layers along the free edges{portion}"
        layer = math.sqrt(h / curvature)
        if finding.estimate.scale < 2.0:
            text = f"that the whole width curves across (sqrt(h / kappa) = {layer:.2g} l, w = {scene.width:g} l)"
        else:
            text = f"the layers along the free edges, sqrt(h / kappa) = {layer:.2g} l wide, that curve and stretch"
    elif cause == "shear":
        text = f"transverse shear where the strip is twisted (h/w = {1 / finding.width_to_thickness:.2g})"
    elif cause == "in_plane":
        text = "bending in the strip's own plane under the load"
    elif cause == "tension":
        text = "tension under the load"
    elif scene.shell.clamp == "corners":
        text = "the clamp: held at two corners only, the strip bulges between them"
    elif finding.ribbon.native.has_free_twist:
        text = "the clamp: the held edge keeps the section flat, whose shape changes within a width from there"
    else:
        steep = finding.ribbon.native.max_abs_eta_prime_w_half
        text = f"the clamp: the held edge straightens the rulings, which crowd there (|eta'| w/2 = {steep:.2g})"
    return text + portion


def sentence(finding: Finding) -> str:
    """The verdict with the numbers behind it."""
    scene = finding.scene
    where = f"w/h = {finding.width_to_thickness:g}, {briefly(scene)} held"
    if finding.values:
        where = ", ".join(f"{key.split('.', 1)[-1]} = {_plain(value)}" for key, value in finding.values.items()) + (
            f", {where}"
        )
    if not finding.ribbon.ok:
        return f"No verdict for {where}: the ribbon is {finding.ribbon.word}."
    if finding.row is not None and finding.share is None:
        return f"No verdict for {where}: the shell is {finding.row.status} ({finding.row.message})."
    if finding.estimate.why and finding.share is None:
        return f"No verdict for {where}: its tension is {finding.estimate.why}; ask shells (without --quick)."
    if finding.another is not False:
        return f"No verdict for {where}: {_elsewhere(finding)}."
    distance = "unknown" if finding.distance is None else percent(finding.distance)
    model = "inextensible model" if not finding.estimate.own else finding.words
    by = f"By estimate from the ribbon alone: {model}" if finding.row is None else model[0].upper() + model[1:]
    level = f": {finding.level}" if finding.level else ""
    text = (
        f"{by} off by {distance} of l and {percent(finding.left_out or 0.0)} of energy here ({where}){level}; "
        f"the reason is {reason(finding)}."
    )
    return text + _doubt(finding)


def _elsewhere(finding: Finding) -> str:
    """That the shell is not known to be in the ribbon's state, with both energies (total, D w / l)."""
    row = finding.row
    assert row is not None
    energies = ((RICHEST, row.energy), (finding.ribbon.model, finding.ribbon.energy))
    both = ", ".join(f"{name} {'unknown' if e is None else f'{e.total:.6g} D w / l'}" for name, e in energies)
    state = "the shell rests in another state" if finding.another else "shell and ribbon may be in different states"
    return f"{state} (total energies: {both}; {row.same_why})"


def _doubt(finding: Finding) -> str:
    """What keeps the distance from being claimed, or nothing."""
    row = finding.row
    if row is None and finding.estimate.rival is not None:
        return f" Not sure: {finding.estimate.rival.text}."
    if row is None:
        return doubted_share(finding.estimate) + other_side(finding.estimate)
    if row.hausdorff is None:
        return ""
    text = ""
    if row.share_error is not None and finding.share and row.share_error > _SHARE_CHANGE * finding.share:
        text = (
            f" By the change to another mesh the share is sure to {percent(row.share_error)}: refine shell.elements "
            "before quoting it."
        )
    if row.claimed:
        return text
    if row.shell_error is None or row.ribbon_error is None:
        return text + " The discretisation error of one model is unknown: the distance is no claim."
    return text + (
        f" The distance is not above the discretisation errors (ribbon {row.ribbon_error:.1e} l, shell "
        f"{row.shell_error:.1e} l)."
    )


def doubted_share(estimate: Estimate) -> str:
    """How much more the strip may stretch than is estimated, where that is as much as a tenth of it; "" elsewhere."""
    where = doubted_where(estimate)
    if not where:
        return ""
    return f" {where[0].upper() + where[1:]} the strip may stretch instead of bending sharply: up to " + (
        f"{percent(estimate.share + estimate.more)} of energy in all."
    )


def doubted_where(estimate: Estimate) -> str:
    """Where that is; "" where it is not as much."""
    if not estimate.more > _TOLD * estimate.share:
        return ""
    places = {
        "where its curvature passes zero": estimate.passages,
        "where its rulings crowd at a clamp": estimate.crowded,
    }
    return " and ".join(name for name, value in places.items() if value > _TOLD * estimate.more)


def other_side(estimate: Estimate) -> str:
    """That the shell may rest on either side of the ribbon, with both energies; "" where there is one."""
    if estimate.sides is None:
        return ""
    energies = " and ".join(f"{energy:.6g}" for energy in estimate.sides.energies)
    apart = estimate.sides.distances[1]
    distance = "not known" if apart is None else f"{percent(apart)} of l"
    return (
        f" A shell may rest on either side of the ribbon (total energies {energies} D w / l), which is not known; on "
        f"the other side the distance is {distance}."
    )


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def hits(findings: Sequence[Finding]) -> dict[str, int]:
    """How often the estimate's level is the shell's: "same", "cautious" (worse than the shell's), "bold" (better),
    "false_safe" (good, and the shell is not), "good" (by the shell), "known" (both say something)."""
    known = [f for f in findings if f.false_safe is not None]
    rank = {name: place for place, name in enumerate(LEVELS)}
    gap = [rank[str(f.estimated_level)] - rank[str(f.level)] for f in known]
    return {
        "known": len(known),
        "same": sum(g == 0 for g in gap),
        "cautious": sum(g > 0 for g in gap),
        "bold": sum(g < 0 for g in gap),
        "false_safe": sum(bool(f.false_safe) for f in known),
        "good": sum(f.level == "good" for f in known),
    }
