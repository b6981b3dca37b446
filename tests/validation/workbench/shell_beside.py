"""Every shipped scene beside a shell of the same strip: one row each, with distance, both errors, energies and times.

A scene with a thickness, or with shells of its own, has its shell (of several w/h the one next to `THIN`); one without
is given w/h = `THIN`, and its row says so. `compare` runs them, with its rules: two models are compared in one state or
not at all. A rod that says its own stiffnesses is no strip: there is no shell to be beside it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from ribbonbench.errors import BadInput
from tests.reference.bent_section import stiffness
from tests.test_setup import ROOT
from tests.validation import page
from tests.validation.kept_rows import KeptRows
from tests.validation.number import Number

COMMAND = "python -m tests.validation shell_beside"
#: It takes no times that its page rests on.
ALONE = False
SCENES = ROOT / "compare" / "scenes"
#: w/h of the shell where a scene leaves it open.
THIN = 100.0
#: Scenes whose shell is another: a band on a table whose w/h is 100 stretches so much that it lies elsewhere on it, and
#: 16 coils take a longer mesh.
OTHERS: Mapping[str, Mapping[str, Any]] = {
    "moebius_table_edge": {"shell.width_to_thickness": [400.0]},
    "moebius_table_fallen": {"shell.width_to_thickness": [400.0]},
    "coil_100_7500": {"shell.width_to_thickness": [THIN], "shell.elements": [400, 4]},
}
SAME, ANOTHER, OPEN, NONE, REFUSED = "same state", "another state", "not known", "no equilibrium", "refused"
NO_STRIP = "no strip"
OUTCOMES = (SAME, ANOTHER, OPEN, NONE, REFUSED, NO_STRIP)
#: Scenes whose shells are solved again, and what a processor may change of their distances, as a part.
PROBED, REPEATED = ("cantilever", "hanging_5_3_1"), 1e-3


def beside(name: str) -> tuple[Scene, str]:
    """The scene with one shell, and where its w/h is from: "its own" or "given"."""
    scene = load(SCENES / f"{name}.toml")
    of_strip = scene.strip.thickness is not None
    ratios = scene.shell.width_to_thickness
    if len(ratios) > 1:
        scene = scene.replace(
            {"shell.width_to_thickness": [min(ratios, key=lambda ratio: abs(math.log(ratio / THIN)))]}
        )
    if of_strip or ratios:
        return scene, "its own"
    return scene.replace(OTHERS.get(name, {"shell.width_to_thickness": [THIN]})), "given"


def row(name: str, store: CaseStore, reporter: Reporter) -> dict[str, Any]:
    """One shipped scene beside its shell."""
    scene, given = beside(name)
    found: dict[str, Any] = {"name": name, "given": given}
    if (why := no_strip(scene)) is not None:
        return {**found, "outcome": NO_STRIP, "why": why}
    if scene.tip is not None and scene.tip.moment is not None:
        found["uniform"] = uniform(scene)
    try:
        comparison = compare(scene, store, reporter, bare=True)
    except BadInput as error:
        return {**found, "outcome": REFUSED, "why": str(error)}
    (pair,) = comparison.rows
    fast = comparison.beside[0] if comparison.beside else comparison.fast
    outcome = {True: SAME, False: ANOTHER, None: OPEN}[pair.same_state]
    if pair.status != "converged" or not fast.ok:
        outcome = NONE
    elastic = (
        None if fast.energy is None else fast.energy.elastic,
        None if pair.energy is None else pair.energy.elastic,
    )
    return {
        **found, "outcome": outcome, "why": pair.same_why if outcome != NONE else f"{fast.word}; {pair.message}",
        "model": fast.model, "ratio": pair.width_to_thickness, "mesh": list(pair.elements),
        "stable": [fast.stable, pair.stable],
        "distance": pair.hausdorff, "ribbon_error": pair.ribbon_error, "shell_error": pair.shell_error,
        "claimed": pair.claimed, "elastic": elastic, "share": pair.share, "start": pair.start,
        "seconds": [pair.seconds.ribbon, pair.seconds.shell],
    }  # fmt: skip


def no_strip(scene: Scene) -> str | None:
    """Why a scene is of a rod whose section is no strip's; None: it is of a strip."""
    if scene.strip.second_moment is not None:
        return "a round stem, of which only the second moment about one axis is given; nothing of it is flat"
    if scene.rod is None:
        return None
    first, second = scene.rod.bending
    return (
        f"a rod of its own stiffnesses, alike about both axes by a factor {second / first:g}: as a rectangle w/h = "
        f"{math.sqrt(second / first):g}, no plate"
    )


def uniform(scene: Scene) -> float:
    """Elastic energy (D w / l) of the strip bent evenly by that moment, its section as free edges have it: Lamb's, of
    which the moment is dU / dkappa."""
    from scipy.optimize import brentq

    strip, moment = scene.strip, float(np.linalg.norm(scene.tip_moment))

    def energy(k: float) -> float:
        return 0.5 * k**2 * stiffness(strip.poisson, scene.width, strip.thickness / strip.length, k)

    step = 1e-4
    bent = brentq(lambda k: (energy(k + step) - energy(k - step)) / (2.0 * step) - moment, 0.5 * moment, 2.0 * moment)
    return energy(bent)


def rows(out: Path, names: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """All rows, each kept as soon as it is known, under a key of the code behind it."""
    place = out.parent / "out" / "validate" / "shell_beside"
    kept = KeptRows.of(place, "compare.studies.compare")
    store, found = CaseStore(place / "cases"), []
    with Reporter() as reporter:
        for name in names or scenes():
            reporter.step(name)
            found.append(kept.row(name, partial(row, name, store, reporter)))
    return found


def scenes() -> list[str]:
    """The shipped scenes, by name."""
    return sorted(file.stem for file in SCENES.glob("*.toml"))


@cache
def distance(name: str) -> float:
    """Of a probed scene, in l, computed anew."""
    scene, _ = beside(name)
    store = CaseStore(ROOT / "out" / "validate" / "shell_beside" / "probe")
    with Reporter() as reporter:
        (pair,) = compare(scene, store, reporter, bare=True).rows
    assert pair.hausdorff is not None
    return pair.hausdorff


PROBES = {f"distance_{name}": partial(distance, name) for name in PROBED}


def run(out: Path) -> dict[str, Number]:
    """Writes shell_beside.md; the counts, and the distances of what rests in one state."""
    found = rows(out)
    write(out, found)
    counts = Counter(one["outcome"] for one in found)
    numbers = {"scenes": Number(len(found), 0.0, shown="d")}
    numbers |= {outcome.replace(" ", "_"): Number(counts[outcome], 0.0, shown="d") for outcome in OUTCOMES}
    for one in found:
        if one["outcome"] == SAME and one["distance"] is not None:
            error = (one["ribbon_error"] or 0.0) + (one["shell_error"] or 0.0) + REPEATED * one["distance"]
            numbers[f"distance_{one['name']}"] = Number(one["distance"], error, "l", ".1e")
    return numbers


def write(out: Path, found: Sequence[Mapping[str, Any]]) -> None:
    """The page."""
    counts = Counter(one["outcome"] for one in found)
    said = ", ".join(f"{outcome} {counts[outcome]}" for outcome in OUTCOMES)
    solved = [one for one in found if one["outcome"] not in (REFUSED, NO_STRIP)]
    heads = ["scene", "model", "w/h", "mesh", "state", "distance", "ribbon's error", "shell's error", "elastic, ribbon",
             "elastic, shell", "membrane", "shell, s"]  # fmt: skip
    page.write(
        out / "shell_beside.md",
        "A shell beside every shipped scene",
        COMMAND,
        f"Of {len(found)} shipped scenes: {said}. A scene that leaves the thickness open has a shell of w/h = {THIN:g} "
        "(marked *; bands on a table 400). Distances and errors (Hausdorff) in l, energies in D w / l; a distance is "
        "given where both models rest in one state. Stable unless said. A moment at the end (roll_up) has no "
        "potential, so that the stability of its shell is not asked; it bends further than the rod, which bends with "
        "D w: its edges are free to curl."
        + "".join(f" Bent evenly, Lamb's section has {x['uniform']:.5g} D w / l." for x in found if "uniform" in x),
        page.table(heads, [_cells(one) for one in solved]),
        "## What is no strip, refused, or in no one state, and why",
        "\n".join(
            f"- `{one['name']}`: {one['outcome']}. {one['why']}" for one in found if one["outcome"] != SAME
        ),
    )  # fmt: skip


def _cells(one: Mapping[str, Any]) -> list[str]:
    def number(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    unstable = [who for who, stable in zip(("ribbon", "shell"), one["stable"], strict=True) if stable is not True]
    state = one["outcome"] + (f" ({' and '.join(unstable)} not known to be stable)" if unstable else "")
    ratio = f"{one['ratio']:.4g}" + ("*" if one["given"] == "given" else "")
    return [
        one["name"], one["model"], ratio, "{} x {}".format(*one["mesh"]), state,
        number(one["distance"] if one["outcome"] == SAME else None, ".1e"), number(one["ribbon_error"], ".0e"),
        number(one["shell_error"], ".0e"), number(one["elastic"][0], ".5g"), number(one["elastic"][1], ".5g"),
        number(None if one["share"] is None else one["share"]["membrane"], ".1e"), number(one["seconds"][1], ".2g"),
    ]  # fmt: skip
