"""The comparison as a table and as sentences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import both
from compare.models import RICHEST, USUAL
from compare.models.base import BESIDE, State
from compare.models.holds.words import left
from compare.models.shell import START
from compare.models.shell_build import line_weight
from compare.page.claims import SHELLS
from compare.page.pair import PAIR, PLANAR, Row
from compare.page.remedies import message
from compare.page.table import Column, Table
from compare.page.verdict import Verdict
from compare.page.wording import force, length
from compare.pages.elastica import BEGAN
from compare.pages.solve import sentences
from compare.record.quantity import Quantity, first
from compare.scene.units import Units
from compare.studies.checks import of_rows, of_state
from compare.studies.compare import LOWER, OWN_IS_HIGHER, Comparison
from compare.studies.inputs import input_uncertainty

FloatArray = NDArray[np.float64]


#: The columns of table.csv in their order; others of the record come behind them.
_FIRST = (
    "width_to_thickness", "status", "start", "hausdorff", "centreline", "ribbon_error", "shell_error", "same_state",
    "claimed", "share", "energy", "shell_errors", "seconds.ribbon", "seconds.shell", "ratio",
)  # fmt: skip
TABLE: tuple[Quantity[Row], ...] = first(PAIR, *_FIRST)
LEGEND = (
    "Lengths in l, energies in D w / l without the constant of the natural curvature, shares of the shell's elastic "
    "energy, times in seconds of one solve (compilation apart). Below: the ribbon, the limit h/w = 0."
)


def _named(column: Column, model: str) -> Column:
    """A column whose heading and legend are about another model than the ribbon."""
    heading, legend = (text.replace(BESIDE, model) for text in (column.heading, column.legend))
    words = (
        {word: word.replace(BESIDE, model) for word in (*START.values(), OWN_IS_HIGHER)}
        if column.key == "start"
        else column.words
    )
    return replace(column, heading=heading, legend=legend, words=words)


def table(comparison: Comparison) -> Table:
    """One row per shell; below it the model beside them, for the ribbon the limit h/w = 0. The elastica's column is
    absent where there is none."""
    shown = [quantity for quantity in TABLE if quantity.key != PLANAR.key or comparison.elastica is not None]
    fast = comparison.fast
    name = fast.model.replace("_", " ")
    legend = LEGEND if fast.model == USUAL else LEGEND.replace("the ribbon, the limit h/w = 0", f"the {name}")
    found = Table.of(f"{name[:1].upper()}{name[1:]} against shell", shown, comparison.rows, legend)
    if fast.model != USUAL:  # the keys are the contract's, the headings name the model
        found = replace(found, columns=tuple(_named(column, fast.model) for column in found.columns))
    cells = {
        "width_to_thickness": fast.model,
        "status": fast.word,
        "ribbon_error": fast.error,
        "seconds_ribbon": fast.seconds.warm,
        PLANAR.key: comparison.elastica_distance,
    }
    if fast.energy is not None:
        parts = ("elastic", "gravity", "total")
        cells |= {name: getattr(fast.energy, name) for name in parts}
        cells |= {f"{name}_error": fast.errors.get("energy", {}).get(name) for name in parts}
    return replace(found, below=(tuple(cells.get(key) for key in found.keys),))


def answer(comparison: Comparison, units: Units | None = None) -> Verdict:
    """How far the ribbon (or the model beside the shells) is from the thinnest shell; where the comparison error does
    not exceed the numerical uncertainty, the bound of both together. As good as what was checked of both."""
    scene, fast = comparison.scene, comparison.fast
    units = units or scene.units
    checks = [*of_state(scene, fast, "compare"), *of_rows(comparison.rows, "compare")]
    row = max(comparison.rows, key=lambda r: r.width_to_thickness)
    ratio = f"w/h = {row.width_to_thickness:g}"
    if not fast.stands:
        return Verdict.of("compare", f"No comparison: the {fast.model} is {message(fast)}", checks)
    if row.hausdorff is None:
        return Verdict.of("compare", f"No comparison at {ratio}: the shell is {row.status}", checks)
    if row.same_state is not True:
        return Verdict.of("compare", another_state(row, fast, units), checks).doubted("same", "distance", SHELLS)
    far = f"At {ratio} the {fast.model} is {length(units, row.hausdorff)} from the shell"
    if row.ribbon_error is None or row.shell_error is None:
        lacking = fast.model if row.ribbon_error is None else RICHEST
        text = f"{far}; the {lacking}'s own error is not known"
        return Verdict.of("compare", text, checks).doubted("distance", "elements", SHELLS)
    if not row.claimed:
        bound = length(units, row.hausdorff + row.ribbon_error + row.shell_error)
        far = f"At {ratio} the {fast.model} is at most {bound} from the shell, as far as the meshes can tell"
    return Verdict.of("compare", far, checks).doubted("distance")


def another_state(row: Row, fast: State, units: Units) -> str:
    """What is to be said of a shell that is not known to be in the state of the model beside it: both energies, and how
    far apart the two states are; a sentence without its full stop."""
    ratio, beside = f"w/h = {row.width_to_thickness:g}", fast.model
    own = None if fast.energy is None else fast.energy.total
    its = None if row.energy is None else row.energy.total

    def told(value: float | None) -> str:
        return "unknown" if value is None else units.text(value, "D w / l", 6)

    both = f"total energies {told(its)} (shell) and {told(own)} ({beside}), {length(units, row.hausdorff)} apart"
    again = f"; {row.begun_again}" if row.begun_again else ""
    if row.same_state is None:
        return f"At {ratio} it is not known whether shell and {beside} are in one state: {both}; {row.same_why}{again}"
    text = f"At {ratio} the shell rests in another state than the {beside}: {both}{again}"
    found = row.counterpart
    if found is None:
        return text
    lower = own is not None and found.energy is not None and found.energy < own - LOWER * max(1.0, abs(own))
    rank = "lower than" if lower else "not lower than"
    there = f"{told(found.energy)}, {rank} its own, {length(units, found.distance)} from the shell"
    return f"{text}; the {beside} has a state there too ({there})"


def separable(comparison: Comparison, units: Units | None = None) -> list[str]:
    """The distances in the words of ASME V&V 20: comparison error, numerical uncertainty, separable or not."""
    units = units or comparison.scene.units
    known = [
        (row, row.hausdorff, row.ribbon_error + row.shell_error)
        for row in comparison.rows
        if row.hausdorff is not None and row.ribbon_error is not None and row.shell_error is not None
        if row.same_state is True
    ]
    if not known:
        return []
    each = "; ".join(
        f"w/h = {row.width_to_thickness:g}: |E| = {units.text(far, 'l')}, u_num = {units.text(error, 'l', 2)}, "
        f"{'separable' if row.claimed else 'not separable'}"
        for row, far, error in known
    )
    return [
        "In the words of ASME V&V 20, with the comparison error E (ribbon minus shell) and the numerical uncertainty "
        f"u_num of both (discretisation): {each}. {_inputs(comparison, units)}"
    ]


def _inputs(comparison: Comparison, units: Units) -> str:
    """What the scene's uncertainties leave open of the shape, in both models alike."""
    found = input_uncertainty(comparison.scene, comparison.fast)
    if found is None:
        return "u_input is not known: the scene gives no [uncertainty]."
    if found.total is None:
        return f"u_input is not known: {found.why}."
    return (
        f"u_input = {units.text(found.total, 'l')} at most along the {comparison.fast.model}, from what both are given."
    )


def verdict(comparison: Comparison) -> list[str]:
    """What the table says, in sentences that its numbers bear out: the numbers, then how they were computed."""
    fast = comparison.fast
    units = comparison.scene.units
    elsewhere = [row for row in comparison.rows if fast.ok and row.hausdorff is not None and row.same_state is not True]
    said = [f"{another_state(row, fast, units)}." for row in elsewhere]
    said += _laid(comparison)
    said += separable(comparison)
    if comparison.slope is not None:
        low, high = comparison.slope.spread
        word = "falls" if comparison.falls else "does not fall on every row"
        said.append(
            f"The distance between the models {word} as h/w falls: slope {comparison.slope.value:.2f} in log-log over "
            f"{comparison.slope.rows} rows on which it exceeds both errors (between rows {low:.2f} to {high:.2f})."
        )
    else:
        said.append("No slope: fewer than two rows have a distance above the discretisation errors.")
    if not comparison.falls:
        said += _undecided(comparison)
        said += _other_model(comparison)
    said += sentences(comparison.scene, fast)
    said += _tension(comparison)
    times = [r for r in comparison.rows if None not in (r.seconds.shell, r.shell_error, r.ribbon_error)]
    if times:
        last = times[-1]
        said.append(
            f"Time: at w/h = {last.width_to_thickness:g} the shell takes {last.seconds.shell:.3g} s (error "
            f"{last.shell_error:.1e} l), the {fast.model} {last.seconds.ribbon:.2g} s (error "
            f"{last.ribbon_error:.1e} l): "
            + _factor(last, fast.model)
            + ("; the shell's time is from the run that stored it." if last.reused else ".")
        )
    weight = line_weight(comparison.scene)
    said += [weight] if weight else []
    if comparison.elastica is not None and comparison.elastica_distance is not None:
        third = comparison.elastica
        said.append(
            f"Elastica (the scene is planar; begun at {BEGAN[third.start]}): centreline "
            f"{comparison.elastica_distance:.1e} l from the {fast.model}'s; its own error {third.error or 0.0:.1e} l; "
            f"{message(third)}." + _left_plane(comparison)
        )
    said += [
        f"w/h = {row.width_to_thickness:g}: the shell is {row.status}: {row.message}"
        for row in comparison.rows
        if row.status != "converged"
    ]
    return said


def _laid(comparison: Comparison) -> list[str]:
    """How shapes that nothing holds were laid on each other before distances were taken."""
    found = [(row, row.laid) for row in comparison.rows if row.laid is not None and row.laid.free]
    if not found:
        return []
    row, last = found[-1]
    words = left(both(comparison.fast.motions, comparison.shells[comparison.rows.index(row)].motions))
    if last.seam:
        words += f", and slid along itself (at w/h = {row.width_to_thickness:g} by {last.slide:.1e} l)"
    if last.mirrored:
        words += "; the mirror image is compared, the band of the other hand"
    what = "strip" if comparison.scene.closure is None else "band"
    model = comparison.fast.model
    clamped = comparison.scene.clamp_start is not None or comparison.scene.clamp_end is not None
    free = "Nothing resists some motions of" if clamped else "Nothing holds"
    return [f"{free} the {what}: the {model} is laid on the shell by least squares, {words}."]


def _tension(comparison: Comparison) -> list[str]:
    """What the shells' ends are pulled with where the model's forces are not determined."""
    if "forces" not in comparison.fast.whys:
        return []
    units = comparison.scene.units
    each = "; ".join(
        f"w/h = {row.width_to_thickness:g}: {force(np.asarray(state.supports.end.force), units)}"
        for row, state in zip(comparison.rows, comparison.shells, strict=True)
        if state.ok and state.supports.end is not None
    )
    name = comparison.fast.model
    return [f"The {name}'s forces are undetermined; the shell is held at s = l by {each}."] if each else []


def _factor(row: Row, fast: str) -> str:
    """Which of the two is the faster one and by how much at least, and where the shell began: that is part of its time;
    no factor where that would not be like for like."""
    ratio, start = row.ratio, row.start
    if ratio is None:
        why = {
            "first": f"the {fast}'s is of a first solve, with all that it loads",
            "exact": "the faster one is the less exact",
            "search": f"the {fast} searches its elements too",
        }[row.unlike or "first"]
        return f"no factor: {why} (ribbonbench cost compares like with like)"
    factor = "the shell is the faster one, by a factor" if ratio < 1.0 else "a factor"
    factor += f" {max(ratio, 1.0 / ratio):.3g} or more"
    surface = f"the shell begun at the surface of the {fast}"
    began = {
        "path": "the shell on its own, along its path",
        "coarse path": "the shell on its own, its path on a coarse mesh first",
        BESIDE: surface,
        START["given, as the coarse path"]: f"{surface} and checked by its own path on a coarse mesh",
    }
    return f"{factor} ({began.get(start, f'the shell begun at: {start}')})"


def _left_plane(comparison: Comparison) -> str:
    """That the ribbon leaves the plane, where it does: then it is not the elastica's shape."""
    from compare.models.elastica.start import PLANAR, out_of_plane  # not where scikit-fem is not installed

    shape = comparison.fast.shape
    if shape is None:
        return ""
    across = out_of_plane(comparison.scene, shape, np.linspace(0.0, 1.0, 201))
    if across <= PLANAR:
        return ""
    return (
        f" The ribbon leaves the plane (its tangent by up to {across:.2g}): the planar shape is not the one it takes."
    )


def _other_model(comparison: Comparison) -> list[str]:
    """What makes this ribbon another model than the limit of its shells."""
    scene = comparison.scene
    found = []
    for name, clamp in (("start", scene.clamp_start), ("end", scene.clamp_end)):
        if clamp is None or clamp.tangent is None:  # a point holds no edge
            continue
        if scene.shell.clamp == "edge" and clamp.ruling == "free":
            found.append(f'the shell holds its whole edge: clamp.{name}.ruling = "straight" does the same')
        if scene.shell.clamp == "corners" and clamp.ruling == "straight":
            found.append(f'the shell is held at its corners only: clamp.{name}.ruling = "free" is nearer to that')
    if not comparison.fast.numbers.get("knows_width", True):
        found.append('the shell has a finite width: model.energy = "wunderlich"')
    return [f"The ribbon need not be the shell's limit: {'; '.join(found)}."] if found else []


def _undecided(comparison: Comparison) -> list[str]:
    """Rows where no difference between the models can be claimed, and why."""
    said = []
    for row in comparison.rows:
        if row.hausdorff is None or row.claimed or (comparison.fast.ok and row.same_state is not True):
            continue
        head = f"w/h = {row.width_to_thickness:g}: no difference is claimed, "
        if row.ribbon_error is None:
            said.append(f"{head}the ribbon's discretisation error is unknown (it, or its refinement, is not stable).")
        elif row.shell_error is None:
            said.append(f"{head}the shell's discretisation error is unknown (the coarser mesh did not converge).")
        else:
            said.append(
                f"{head}the distance {row.hausdorff:.1e} l is not above the errors; use a finer shell (shell.elements) "
                "or more ribbon segments."
            )
    return said
