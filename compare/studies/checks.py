"""What is checked of a state before a verdict is made of it (`compare.page.claims`): numbers, never words.

A check that was not made says so and is worth "unknown"; what a scene has not (a wall) is nothing to check.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from compare.measure.balance import Push, Wrench, abscissae, unbalanced
from compare.measure.friction import missed
from compare.measure.grades import FAIR, GOOD, GOOD_UP_TO, POOR, UNKNOWN, grade, worst
from compare.models.base import State, Status
from compare.page.claims import CLAIMS, SHELLS
from compare.page.pair import Row
from compare.page.verdict import Check, bounded, nothing, unchecked
from compare.scene.scene import Scene
from compare.studies.compare import LOWER
from compare.studies.priced.effects import PricedEffects

FloatArray = NDArray[np.float64]

#: Largest part of the largest force that supports and loads may leave over.
BALANCED = 1e-6
#: Part of an elastic energy by which it may differ from its adaptive integral.
QUADRATURE = 1e-8
#: How far (l) a strip may reach beyond a wall.
PENETRATION = 1e-6
#: By how much friction may miss Coulomb's law, of the largest mu N.
COULOMB = 1e-6
#: Words of a state on finer elements (`compare.models.base.Refinement`) that is an equilibrium.
_EQUILIBRIA = ("converged", "saddle", "unstable")
#: Gauss points across the strip, where the weight is that of the surface.
_ACROSS = 6


def of_state(scene: Scene, state: State, command: str = "solve") -> list[Check]:
    """The checks of a state that a command's verdict claims (`compare.page.claims`)."""
    claimed = {claim.name for claim in CLAIMS[command]}
    found = (
        finite(state),
        residual(state),
        balance(scene, state),
        quadrature(state),
        convexity(state),
        elements(state),
        forces(state),
        stability(state),
        rivals(scene, state),
        branch(scene, state),
        walls(scene, state),
        crossing(scene, state),
        model(state),
    )
    return [check for check in found if check.name in claimed]


def _numbers(state: State) -> Iterator[tuple[str, object]]:
    """Every number that a reader is given of a state, by name; None where there is none."""
    yield "energy", None if state.energy is None else [v for v in state.energy.to_dict().values() if v is not None]
    yield "residual", state.residual
    for name, pose in (("end", state.end), ("middle", state.middle)):
        yield name, None if pose is None else [*np.ravel(pose.position), *np.ravel(pose.frame)]
    for name, held in (("start", state.supports.start), ("end", state.supports.end)):
        yield f"force and moment at the {name}", None if held is None else [*held.force, *held.moment]
    for wall in state.supports.walls:
        yield f"force of wall {wall['name']}", wall["force"]


def finite(state: State) -> Check:
    """No NaN and no infinity in what a reader is given."""
    bad = [name for name, value in _numbers(state) if value is not None and not np.all(np.isfinite(np.asarray(value)))]
    if bad:
        return Check("finite", POOR, f"not finite: {', '.join(bad)}")
    if state.energy is None or state.energy.total is None or state.shape is None:
        return Check("finite", UNKNOWN, "it has no shape or no energy")
    return Check("finite", GOOD, "every number is finite")


def residual(state: State) -> Check:
    """The solver's own word and residual."""
    if not state.is_equilibrium:
        return Check("residual", POOR, f"it is {state.word.replace('_', ' ')}", state.residual)
    if state.residual is None or not math.isfinite(state.residual):
        return unchecked("residual", "its residual is not known")
    return Check("residual", GOOD, f"residual {state.residual:.1e}", state.residual)


def balance(scene: Scene, state: State) -> Check:
    """Supports against loads (`compare.measure.balance`), relative to the largest force."""
    shape = state.shape
    if shape is None or not state.is_equilibrium:
        return unchecked("balance", "without an equilibrium nothing is in balance")
    held = [
        (pose, force)
        for pose, force in ((shape.pose(0.0), state.supports.start), (state.end, state.supports.end))
        if force is not None
    ]
    wrenches = [Wrench(pose.position, force.force, force.moment) for pose, force in held if pose is not None]
    if "forces" in state.whys:
        return unchecked("balance", state.whys["forces"])
    if not wrenches and not state.supports.walls:
        return nothing("balance", "nothing holds it")
    if scene.tip is not None and state.end is not None:
        wrenches.append(Wrench(state.end.position, scene.tip_force, scene.tip_moment))
    pushes = [] if len(state.supports.walls) != len(scene.barriers) else _pushes(scene, state)
    for wall in state.supports.walls:
        wrenches += [Wrench(rub["point"], rub["friction"], np.zeros(3)) for rub in wall.get("rubs", ())]
    weight = np.zeros(3) if scene.up is None else -scene.gamma * scene.up
    left = unbalanced(wrenches, weight, _centre(scene, state), pushes)
    return bounded("balance", left, BALANCED, "supports and loads leave over")


def _pushes(scene: Scene, state: State) -> list[Push]:
    """What every wall does, at the points of the surface that touch it."""
    walls = state.supports.walls
    points = [np.asarray(wall["points"], dtype=float).reshape(-1, 3) for wall in walls]
    normals = list(scene.wall_normals)
    for number, body in enumerate(scene.bodies, start=len(normals)):
        points[number], own = body.pushes(points[number])
        normals.append(own)
    return [
        Push(normal, np.asarray(wall["force"], dtype=float), where)
        for wall, normal, where in zip(walls, normals, points, strict=True)
    ]


def _centre(scene: Scene, state: State) -> FloatArray:
    """Centre of mass (3,): of the centreline, or of the surface where the weight is the surface's."""
    assert state.shape is not None
    s, weights = abscissae()
    if scene.gravity is None or not scene.gravity.exact:
        return np.asarray(weights @ state.shape.centreline(s))
    nodes, across = np.polynomial.legendre.leggauss(_ACROSS)
    return np.einsum("k,m,kmi->i", weights, 0.5 * across, state.shape.points(s, 0.5 * scene.width * nodes))


def quadrature(state: State) -> Check:
    """The elastic energy against its adaptive integral."""
    if state.quadrature is None:
        return nothing("quadrature", "its rule is exact")
    return bounded("quadrature", state.quadrature, QUADRATURE, "of the elastic energy its rule misses")


def convexity(state: State) -> Check:
    """Whether the energy alone says what the state is: convex in curvature and twist all along the strip."""
    if state.nonconvex is None:
        return nothing("convexity", "its twist is no field of its own, or its energy is convex")
    if state.nonconvex > 0.0:
        text = (
            f"on {100.0 * state.nonconvex:.2g} % of the length its energy is not convex in curvature and twist, and "
            'the elements hold it there (model.energy = "finite" or "wunderlich" says itself how long a passage is)'
        )
        return Check("convexity", UNKNOWN, text, state.nonconvex, 0.0)
    return Check("convexity", GOOD, "its energy is convex all along the strip", 0.0, 0.0)


def elements(state: State) -> Check:
    """The discretisation error of the shape."""
    if state.error is None:
        return unchecked("elements", f"how accurately is not known{_why(state)}")
    if state.refinements and state.refinements[-1].status not in _EQUILIBRIA:
        finest = state.refinements[-1].elements
        text = f"it moves by {state.error:.1e} l on finer elements, and on {finest} it has no state: its limit is open"
        return Check("elements", UNKNOWN, text, state.error, GOOD_UP_TO["error"])
    found = grade("error", state.error)
    return Check("elements", found, f"{state.error:.1e} l from its limit", state.error, GOOD_UP_TO["error"])


def forces(state: State) -> Check:
    """The largest error of a force or moment over the largest of its kind (at least 1, in D w / l^2 and D w / l)."""
    if "forces" in state.whys:
        return unchecked("forces", state.whys["forces"])
    held = [one for one in (state.supports.start, state.supports.end) if one is not None]
    pushed = [np.asarray(wall["force"], dtype=float) for wall in state.supports.walls]
    if not held and not pushed:
        return nothing("forces", "nothing holds it")
    ends = [name for name in ("start", "end") if getattr(state.supports, name) is not None]
    known = state.errors.get("forces", {}), state.errors.get("moments", {})
    each = [[errors.get(name) for name in ends] for errors in known]
    each[0] += known[0].get("walls") or [None] * len(pushed)
    if any(error is None for errors in each for error in errors):
        return unchecked("forces", "the error of a force is not known" + _as_before(state))
    sizes = [[one.force for one in held] + pushed, [one.moment for one in held]]
    off = [
        max(errors, default=0.0) / max([1.0, *(float(np.linalg.norm(value)) for value in values)])
        for errors, values in zip(each, sizes, strict=True)
    ]
    most = float(max(off))
    text = f"forces and moments within {100.0 * most:.2g} %"
    return Check("forces", grade("force", most), text, most, GOOD_UP_TO["force"])


def rivals(scene: Scene, state: State) -> Check:
    """Whether a lower state was seen, or the scene's own start says which of several is meant."""
    found = state.rivals
    if means_one(scene):
        return Check("rivals", GOOD, "the scene's own start says which state is meant")
    if found is None:
        return unchecked("rivals", "other states were not looked for")
    if found.below > LOWER * _energy(state):
        return Check("rivals", UNKNOWN, found.text, found.below)
    return Check("rivals", GOOD, f"none lower was seen in {found.tries} solves", found.below)


def means_one(scene: Scene) -> bool:
    """Whether the scene says which of several states is meant: by a seed, a path, or a band that closes itself."""
    return scene.seed.curvature is not None or bool(scene.path) or scene.closure is not None


def branch(scene: Scene, state: State) -> Check:
    """Whether the state is the one that the scene's starting shape means."""
    if state.branch is None:
        return nothing("branch", "no starting shape is on one side" if scene.seed.curvature else "no start is given")
    if state.branch == "own":
        return Check("branch", GOOD, "on the side of its starting shape")
    if state.branch == "slid":
        text = "its seed means the other side of the clamps, where the strip would not stay: it slides here"
        return Check("branch", FAIR, text)
    return Check("branch", POOR, "its seed means another state, on the other side of the clamps")


def _energy(state: State) -> float:
    """Size of the total energy, at least 1."""
    total = None if state.energy is None else state.energy.total
    return max(1.0, abs(total or 0.0))


def stability(state: State) -> Check:
    """The lowest eigenvalue, and the error of its limit on finer elements."""
    lowest = state.lowest_eigenvalue
    if state.stable is False or state.status is Status.UNSTABLE:
        return Check("stability", POOR, "it is not stable", lowest)
    if "neutral" in state.numbers:
        error = float(state.numbers["eigenvalue_limit"]["error"])
        return Check("stability", FAIR, f"neutral: its lowest eigenvalue is zero within {error:.1g}", lowest)
    if state.stable is None:
        return unchecked("stability", "whether it is stable is not known")
    if lowest is None or math.isinf(lowest):
        return Check("stability", GOOD, "no freedom is left to be unstable")
    limit = state.numbers.get("eigenvalue_limit")
    if limit is not None:
        value, error = float(limit["value"]), float(limit["error"])
    else:
        found = state.errors.get("lowest_eigenvalue")
        if found is None:
            text = "it is stable on these elements; on finer ones is not known"
            return unchecked("stability", text + _as_before(state))
        value, error = lowest, float(found)
    return Check("stability", GOOD, f"lowest eigenvalue {value:.2g} within {error:.1g}", value)


def _why(state: State) -> str:
    return f" ({state.error_why})" if state.error_why else ""


def _as_before(state: State) -> str:
    """The reason, once: what is behind the `elements` is not told again of what follows from them."""
    return " (for the same reason)" if state.error_why and state.error is None else _why(state)


def stable_here(state: State) -> Check:
    """Stability on the state's own elements."""
    if state.stable is None:
        return unchecked("stability", "whether it is stable is not known")
    held = state.stable and state.status is not Status.UNSTABLE
    text = "it is stable on its elements" if held else "it is not stable"
    return Check("stability", GOOD if held else POOR, text, state.lowest_eigenvalue)


def walls(scene: Scene, state: State) -> Check:
    """How far beyond a wall the surface is."""
    if not scene.barriers:
        return nothing("walls", "there is no wall")
    between = state.numbers.get("penetration_between")
    if between is not None:  # of nodes that are not behind a wall: an error of the mesh
        text = f"deepest point beyond a wall, between nodes, {between:.1e} l"
        return Check("walls", grade("error", float(between)), text, float(between), GOOD_UP_TO["error"])
    deepest = state.numbers.get("penetration")
    if deepest is None:
        return unchecked("walls", "how far it is beyond a wall is not known")
    rubbed = _coulomb(scene, state)
    if rubbed is not None and not rubbed <= COULOMB:
        return bounded("walls", rubbed, COULOMB, "friction misses Coulomb's law by")
    return bounded("walls", float(deepest), PENETRATION, "deepest point beyond a wall, over l,")


def _coulomb(scene: Scene, state: State) -> float | None:
    """By how much friction misses Coulomb's law (`compare.measure.friction`); None where nothing rubs."""
    found = []
    for number, (spec, wall) in enumerate(zip(scene.barriers, state.supports.walls, strict=False)):
        if not wall.get("rubs"):
            continue
        points = np.array([rub["point"] for rub in wall["rubs"]])
        if number < len(scene.walls):
            normals = np.broadcast_to(scene.wall_normals[number], points.shape)
        else:
            normals = scene.bodies[number - len(scene.walls)].pushes(points)[1]
        found.append(missed(wall["rubs"], spec.friction, normals).most)
    return max(found, default=None)


def crossing(scene: Scene, state: State) -> Check:
    """Whether the surface passes through itself, which nothing in a model forbids."""
    if state.shape is None or not state.is_equilibrium:
        return unchecked("crossing", "without an equilibrium it has no shape that could cross itself")
    found = state.crossing(scene.width)
    if found is None:
        return unchecked("crossing", "whether it crosses itself is not known")
    if found.places:
        s, _, other, _ = found.places[0]
        more = ", and elsewhere" if len(found.places) > 1 else ""
        text = f"this shape crosses itself at s = {s:.4g}, s' = {other:.4g} (over l){more}"
        if scene.apart is None:
            text += ": add [contact] with itself = true"
        return Check("crossing", POOR, text)
    if found.within is not None:
        return unchecked("crossing", f"it comes within {found.within:.0e} l of itself; whether it crosses is not known")
    return Check("crossing", GOOD, "it does not pass through itself")


def model(state: State) -> Check:
    """Whether the energy that was chosen is within the accuracy that the scene asks for."""
    choice = state.numbers.get("auto")
    if choice is None:
        return nothing("model", "the scene names its model")
    if choice["enough"]:
        return Check("model", GOOD, f"within {choice['accuracy']:g} l of the shell by estimate")
    if all(step["estimate"] is None for step in choice["steps"] if step["model"] == choice["chosen"]):
        return unchecked("model", "how far its model is from the shell is not known")
    return Check(
        "model", FAIR, f"its model is not estimated to be within {choice['accuracy']:g} l of the shell: take the shell"
    )


def effects(prices: PricedEffects | None, error: float) -> Check:
    """Whether each effect's move is known, and is one of the same state; error: of the state's shape (l)."""
    if prices is None:
        return nothing("effects", "its model prices no effects")
    if prices.refused:
        return unchecked("effects", f"no first order: {prices.refused}")
    if prices.untold:
        return unchecked("effects", f"how far it moves with {' and '.join(prices.untold)} switched is not known")
    apart = prices.apart(error)
    if apart:
        return Check("effects", FAIR, f"with {' and '.join(apart)} switched it may be in another state")
    return Check("effects", GOOD, "the move of every effect is known")


# -- a model beside shells --------------------------------------------------------------------------------------------


def of_rows(rows: Sequence[Row], command: str = "compare") -> list[Check]:
    """The checks of a comparison's rows that a command's verdict claims: of the thinnest shell, but that every shell
    was solved."""
    claimed = {claim.name for claim in CLAIMS[command]}
    row = max(rows, key=lambda r: r.width_to_thickness)
    found = (shells(rows), same(row), distance(row))
    return [check for check in found if check.name in claimed]


def worst_of(several: Iterable[Iterable[Check]]) -> list[Check]:
    """Of the checks of several cases the worst by each name."""
    found: dict[str, Check] = {}
    for checks in several:
        for check in checks:
            known = found.get(check.name)
            if known is None or worst(known.grade, check.grade) != known.grade:
                found[check.name] = check
    return list(found.values())


def shells(rows: Sequence[Row]) -> Check:
    """Every shell in a stable equilibrium, with an error."""
    bad = [row for row in rows if row.status != "converged" or row.stable is False]
    if bad:
        return Check(SHELLS, POOR, f"at w/h = {bad[0].width_to_thickness:g} the shell is {bad[0].status}")
    unknown = [row for row in rows if row.shell_error is None or row.stable is None]
    if unknown:
        what = "error" if unknown[0].shell_error is None else "stability"
        return unchecked(SHELLS, f"the shell's {what} at w/h = {unknown[0].width_to_thickness:g} is not known")
    return Check(SHELLS, GOOD, f"{len(rows)} of {len(rows)} shells stable, with errors")


def same(row: Row) -> Check:
    """Whether both models are in one state."""
    again = f"; {row.begun_again}" if row.begun_again else ""
    if row.same_state is None:
        return unchecked("same", (row.same_why or "whether both models are in one state is not known") + again)
    if not row.same_state:
        return unchecked("same", (row.same_why or "the models are in two states") + again)
    return Check("same", GOOD, (row.same_why or "both models are in one state") + again)


def distance(row: Row) -> Check:
    """Distance of the models, or the bound of it that the errors leave."""
    if row.hausdorff is None:
        return unchecked("distance", "the distance is not known")
    if row.ribbon_error is None or row.shell_error is None:
        return unchecked("distance", "one model's own error is not known")
    most = GOOD_UP_TO["distance"]
    if row.claimed:
        found = grade("distance", row.hausdorff)
        return Check("distance", found, f"{row.hausdorff:.1e} l apart", row.hausdorff, most)
    bound = row.hausdorff + row.ribbon_error + row.shell_error
    good = grade("distance", bound) == GOOD
    return Check("distance", GOOD if good else UNKNOWN, f"at most {bound:.1e} l apart", bound, most)
