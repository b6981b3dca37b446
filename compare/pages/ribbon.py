"""What `ribbonbench solve` and `compare` say, draw and write of a ribbon beyond what every state has."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.grades import YARDSTICK
from compare.measure.grid import Grid
from compare.measure.load_curve import LoadPoint, load_curve_of
from compare.models import in_words
from compare.models.base import State
from compare.models.capabilities import Rival
from compare.models.drawn.touches import wound
from compare.models.holds.touches import touches
from compare.models.quantities import Answered
from compare.models.quantities.ribbon import PATH as PATH_NUMBERS
from compare.models.ribbon.auto import LADDER, PLANAR, REFERENCE, THICKNESS
from compare.models.ribbon.build import formulation_why
from compare.models.ribbon.fields import stretching
from compare.models.ribbon.state import RibbonShape
from compare.models.ribbon.taut import words as taut_words
from compare.page import force_displacement, wording
from compare.page.drawing import pictured
from compare.page.page import STRIP, Picture, Surface
from compare.page.remedies import message
from compare.page.si import array_with_si, with_si
from compare.page.state import STATE
from compare.page.table import Column, Table
from compare.pages.presenter import Presenter
from compare.pages.result import spent
from compare.pages.written import Written, write_barriers, write_touches
from compare.record.quantity import ABSENT, Quantity, pick
from compare.record.views import columns_of, document
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.states import FILE as STATES
from compare.studies.thickness import THICKEST

FloatArray = NDArray[np.float64]

PICTURE = "ribbon.png"
FILES = {
    "ribbon.vtu": "surface with fields (ParaView)",
    "ribbon.npz": "segments and centreline as arrays (NumPy)",
    "centreline.csv": "centreline, curvature, ruling or twist, and frame",
}


def centreline_csv(equilibrium: Any, units: Units) -> bytes:
    """The centreline as CSV (`compare.pages.export.ribbon.centreline`); where units are known also s_m, x_m, y_m, z_m,
    omega_per_m, tau_per_m."""
    from compare.pages.export.formats import array_csv
    from compare.pages.export.ribbon import UNITS, centreline

    names, table = centreline(equilibrium)
    return array_csv(*array_with_si(names, table, UNITS, units))


def write(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """ribbon.vtu, ribbon.npz, centreline.csv, ribbon.png and, with a path, path.csv."""
    from compare.pages.export.ribbon import write_arrays
    from compare.pages.export.surfaces import write_surface
    from compare.store.store import atomic_write_bytes

    e = state.native
    write_surface(out / "ribbon.vtu", RibbonShape(e), grid)
    write_arrays(out / "ribbon.npz", e)
    atomic_write_bytes(out / "centreline.csv", centreline_csv(e, scene.units))
    files, data, states = dict(FILES), {}, ""

    def draw() -> None:
        from compare.pages.pictures import ribbon as profile

        profile.ribbon_profile(out / PICTURE, e, scene.title, scene.units)

    drawn = pictured(draw)
    shown: tuple[Picture, ...] = (picture(state),) if drawn else ()
    if scene.path:
        data["path.csv"] = with_si(path_table(state.log, scene), scene.units)
        files["path.csv"] = "every step of the path, with the forces of what holds the ribbon"
        stands = path_stands(state.log, scene)
        curve = load_curve_of([stand for _, stand in stands], scene.strip.length)
        if curve is not None and drawn:
            title = f"{scene.title}: force against displacement"
            shown += (force_displacement.draw(out / force_displacement.PICTURE, curve, scene.units, title),)
    if state.states is not None and len(state.states.t) > 1:
        states = STATES
        atomic_write_bytes(out / states, state.states.to_bytes())
        files[states] = f"{len(state.states.t)} states along the path as arrays (NumPy)"
    around = write_barriers(out, scene, state, grid)
    files |= {one.file: f"{one.label}, where the strip ends (ParaView)" for one in around}
    if len(e.walls) or e.pairs:
        marks = write_touches(out, touches(e), grid.of(RibbonShape(e)), state.states)
        files |= {one.file: f"{one.label}, as arrows (ParaView)" for one in marks}
        around = (*around, *marks)
    return Written(files, shown, (Surface("ribbon.vtu", state.model, STRIP, "omega", states=states), *around), data)


def _of(name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda entry: entry.get(name)


PATH: tuple[Quantity[Mapping[str, Any]], ...] = (
    Quantity("stage", "stage", kind="integer", legend="that was approached, from 1", of=_of("stage")),
    Quantity("t", "t", kind="digits", legend="where the step ended, from 0 to 1 in each stage", of=_of("t")),
    Quantity("size", "size", kind="digits", legend="of the step", of=_of("size")),
    Quantity("status", "status", kind="word", of=_of("status")),
    Quantity("accepted", "accepted", kind="truth", of=_of("accepted")),
    Quantity("iterations", "iterations", kind="integer", of=_of("iterations")),
    Quantity("residual", "residual", kind="exponent:1", of=_of("residual")),
    Quantity("energy", "energy", "D w / l", "digits:6", of=_of("energy")),
    Quantity("lowest_eigenvalue", "lowest eigenvalue", kind="digits:4", of=_of("lowest_eigenvalue")),
    Quantity("seconds", "s", "s", "seconds", of=_of("seconds")),
    Quantity("jump", "jump", kind="truth", legend="the shape snapped", of=_of("jump")),
)
#: Of accepted steps, where known.
PATH_SUPPORTS: tuple[Quantity[Any], ...] = (*pick(STATE, "forces", "moments"), *force_displacement.CURVE)


def path_stands(log: Sequence[Mapping[str, Any]], scene: Scene) -> list[tuple[int, LoadPoint]]:
    """The accepted steps of a way by their number in its log: values of the path's keys, forces, moments."""
    names = list(scene.barrier_names)
    return [
        (number, force_displacement.load_point_of(entry["moved"], entry["forces"], entry["moments"], names))
        for number, entry in enumerate(log)
        if "moved" in entry
    ]


def path_table(log: Sequence[Mapping[str, Any]], scene: Scene) -> Table:
    """The log of a way, one row a step: how it went, the forces and moments of what holds the ribbon, the curve of what
    is moved and the path's keys (vectors by component, in the scene's unit); nothing where nothing is known."""
    records: list[dict[str, Any]] = [dict(entry) for entry in log]
    stands = path_stands(log, scene)
    curve = force_displacement.curve_of(load_curve_of([stand for _, stand in stands], scene.strip.length))
    moved: dict[str, Column] = {}
    for place, (number, stand) in enumerate(stands):
        records[number] |= force_displacement.supports_of(stand) | curve.get(place, {})
        for key, value in stand.values.items():
            for name, part in _parts(key, value):
                moved[name] = Column(name, name)
                records[number][name] = part
    walls = force_displacement.wall_columns(records)
    held = Table.of_records("", (*columns_of(PATH_SUPPORTS), *walls, *moved.values()), records).known().columns
    return Table.of_records("Steps of the path", (*columns_of(PATH), *held), records)


def _parts(key: str, value: Any) -> list[tuple[str, Any]]:
    """A value as cells: a vector by its components, by x, y, z where there are three."""
    if not isinstance(value, list | tuple):
        return [(key, value)]
    names = "xyz" if len(value) == 3 else range(len(value))
    return [(f"{key}.{name}", part) for name, part in zip(names, value, strict=True)]


def chosen(state: State, units: Units) -> str:
    """Which energy was chosen, in words of the first line: how far it is from the shell by estimate, and by how much
    the strip's thickness would move it; "" where the scene names it."""
    choice = state.numbers.get("auto")
    if choice is None:
        return ""
    taken = state.native.problem.energy
    told = next((step["estimate"] for step in choice["steps"] if step["model"] == choice["chosen"]), None)
    if told is None:
        return f"how far {in_words(taken)} is from a shell is not known"
    left = choice["skipped"].get(THICKNESS)
    more = "" if left is None else f" ({in_words(REFERENCE)} would move it by {wording.length(units, left)})"
    if not choice["enough"]:
        return f"not even {in_words(taken)} is enough, {wording.length(units, told)} from the shell by estimate"
    return f"{in_words(taken)} is enough, {wording.length(units, told)} from the shell by estimate{more}"


def thickness_text(told: Mapping[str, Any]) -> str:
    """From which w/h on the energy of a scene without a thickness is near enough to a shell."""
    within, ratio = wording.percent(told["accuracy"]), told["enough_from"]
    if ratio is None:
        why = told["enough_from_why"]
        return f"Without strip.thickness no energy is chosen; from which w/h on this one would do: {why}."
    where = (
        f"from about w/h = {float(f'{ratio:.2g}'):g} on, and a thicker strip is not"
        if ratio > THICKEST
        else f"even at w/h = {THICKEST:g}"
    )
    return (
        f"Without strip.thickness no energy is chosen: by estimate this one is within {within} of the length of a "
        f"shell {where}."
    )


def choice_text(choice: Mapping[str, Any]) -> str:
    """How `model.accuracy` chose the energy, step by step: estimated distances to the shell in % of l, times."""
    accuracy = float(choice["accuracy"])
    said = []
    for step in choice["steps"]:
        estimate = step["estimate"]
        text = "not known" if estimate is None else f"{wording.percent(estimate)} of l"
        beyond = "" if estimate is None or estimate <= accuracy else f" > {wording.percent(accuracy)}"
        model = f"{in_words(LADDER[0])} in its plane" if step["model"] == PLANAR else in_words(step["model"])
        passed = f", passed over: {step['passed_over']}" if step.get("passed_over") else ""
        said.append(f"{model}, {text}{beyond} ({took(float(step['seconds']))}){passed}")
    end = ": taken" if choice["enough"] else ": not enough, take the shell (ribbonbench shell)"
    rival = choice.get("rival")
    doubt = "" if rival is None else f", but not sure: {Rival(**rival).text}"
    return "; ".join(said) + end + doubt


def took(seconds: float) -> str:
    """A time in words: "1.2 s", "32 ms", "0.45 ms"."""
    return (
        f"{seconds:.1f} s"
        if seconds >= 1.0
        else f"{1e3 * seconds:.2g} ms"
        if seconds < 0.01
        else f"{1e3 * seconds:.0f} ms"
    )


def picture(state: State) -> Picture:
    """`compare.pages.pictures.ribbon` in words."""
    e = state.native
    name, largest = ("ruling eta", f"|eta| {e.max_abs_eta:.3g}")
    if e.has_free_twist:
        name, largest = ("twist tau", f"|tau| l {state.numbers['max_abs_tau']:.3g}")
    alt = (
        f"Normal curvature omega and {name} along the ribbon, and its side view. Largest {largest}; "
        f"the end stands at ({', '.join(f'{c + 0.0:.3f}' for c in e.end.position)}) l."
    )
    return Picture(PICTURE, alt, f"The ribbon: normal curvature and {name.split()[0]} along it, and its side view.")


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in a sentence, and what to do about a visible discretisation error."""
    e = state.native
    known = f"unknown ({state.error_why})" if state.error is None else f"{state.error:.1e} l"
    said = [
        f"Ribbon: {e.problem.energy}, {e.problem.lengths.size} segments, {message(state)}; residual {e.residual:.1e}, "
        f"lowest eigenvalue {_eigenvalue(state, 3)}, discretisation error {known}, "
        f"{took(state.seconds.warm)}."
    ]
    if "auto" in state.numbers:
        own = "by model.accuracy" if "model.accuracy" in scene.own_keys else "without one named"
        said[0] += f" Energy chosen {own}, by estimated distance to a shell: {choice_text(state.numbers['auto'])}."
    if "thickness" in state.numbers:
        said.append(thickness_text(state.numbers["thickness"]))
    advised = advice(scene, state.error)
    return said + ([advised] if advised else [])


def advice(scene: Scene, error: float | None) -> str | None:
    """What to do about a ribbon whose discretisation error (Hausdorff / l) is visible; None when it is not."""
    if error is None or error <= YARDSTICK:
        return None
    clamp = scene.clamp_start
    if scene.model.tolerance is not None and error > scene.model.tolerance and not scene.strict:
        remedy = f"set model.tolerance = {scene.model.tolerance:g}, for as many elements as that takes"
    elif scene.model.tolerance is not None:
        remedy = f"lower model.tolerance = {scene.model.tolerance:g}"
    elif scene.barriers or scene.apart is not None:  # the error is where it touches, not at the clamp
        rubs = any(wall.friction for wall in scene.walls) or any(body.friction for body in scene.obstacles)
        placed = (
            ""
            if rubs or scene.follows
            else ", or give model.tolerance in its place: segments then end where it touches"
        )
        remedy = f"raise model.elements{placed}"
    elif clamp is not None and clamp.ruling == "straight" and scene.model.grading == "uniform":
        remedy = 'set model.grading = "clamp" (a straight ruling makes a layer there)'
    else:
        remedy = "raise model.elements, or give model.tolerance in its place"
    return f"The ribbon's discretisation error {error:.1e} l is above 1 permille of l: {remedy}."


def undetermined(scene: Scene) -> str:
    """What there is to say where the forces of a straight strip are not determined."""
    return taut_words(scene)


def _touching(state: State, number: int, units: Units) -> str:
    """From where to where the strip touches a wall, with the error of these ends; "" where it does nowhere."""
    lines = state.supports.walls[number]["lines"]
    known = state.errors.get("lines", ())
    if not len(lines):
        return ""
    each = (
        units.text(first, "l", 4) if first == last else f"{units.text(first, 'l', 4)} to {units.text(last, 'l', 4)}"
        for first, last in lines
    )
    return f" at s = {', '.join(each)}{wording.within(known[number] if number < len(known) else None, 'l', units)}"


def _bent(scene: Scene, state: State, units: Units) -> list[tuple[str, str]]:
    """How steep the rulings are; of a strip with free twist how large that is, and how much of its energy stretches it,
    where."""
    e = state.native
    if not e.has_free_twist:
        return [("largest |eta|", f"{e.max_abs_eta:.4g}; |eta'| w/2 up to {e.max_abs_eta_prime_w_half:.3g}")]
    found = [("largest |tau|", units.text(state.numbers["max_abs_tau"], "1/l", 4))]
    held = stretching(scene, state)
    if held is not None:
        where = ", ".join(f"{part:.0%} {_ZONES[name]}" for name, part in held.zones.items())
        shares = f"membrane {held.share['membrane']:.2%}, shear {held.share['shear']:.2%} of the elastic energy"
        found.append(("stretching", f"{shares}: {where}"))
    return found


_ZONES = {"clamps": "near clamps", "edges": "beside the edges", "rest": "elsewhere"}


def _limit(state: State) -> str:
    """What the lowest eigenvalue tends to as segments are halved, in words; "" where it is not known."""
    limit = state.numbers.get("eigenvalue_limit")
    if limit is None:
        return ""
    order = "" if limit["order"] is None else f", order {limit['order']:.2g}"
    return f"; of finer segments {limit['value']:.4g} within {limit['error']:.2g}{order}"


def _lowest(state: State) -> str:
    """The lowest eigenvalue with its limit; in words where nothing is free."""
    return f"{_eigenvalue(state, 4)}{_limit(state)}"


def _eigenvalue(state: State, digits: int) -> str:
    """The lowest eigenvalue; in words where there is none."""
    lowest = state.native.lowest_eigenvalue
    if np.isfinite(lowest):
        return f"{lowest:.{digits}g}"
    return "none: no freedom is left" if lowest == np.inf else "not judged"


def rows(scene: Scene, state: State, units: Units | None = None) -> list[tuple[str, str]]:
    """What `ribbonbench solve` prints of a ribbon: name and text, rows of effects that are off left out; of a state
    that is no equilibrium nothing about its place. units: in which all that has a unit is told first;
    None: the scene's."""
    units = units or scene.units
    e = state.native
    used = e.problem.formulation
    parts = {"elastic": e.energy.elastic, "gravity": e.energy.gravity}
    if any(wall.stiffness is not None for wall in scene.walls):
        parts["plates"] = e.energy.plates
    found = [("status", message(state))]
    if state.is_equilibrium:
        found += [
            ("energy", wording.energies(parts, units, state.errors.get("energy", {}))),
            ("middle", wording.place(e.middle.position, units)),
            ("end" if scene.clamp_end or scene.closure else "free end", wording.place(e.end.position, units)),
            *_bent(scene, state, units),
        ]
        if e.forces_why:
            found.append(("forces", f"not determined: {e.forces_why}; {taut_words(scene)}"))
        free = () if scene.clamp_start is not None else ("force at s = 0", "moment at s = 0")
        found += [row for row in wording.supports(state, units) if row[0] not in free]
        sure = state.errors.get("forces", {}).get("walls", ())
        for number, wall in enumerate(state.supports.walls):
            plate = "" if wall["height"] is None else f", plate at {units.text(wall['height'], 'l', 4)} from rest"
            error = wording.within(sure[number] if number < len(sure) else None, "D w / l^2", units)
            touching = f"{wall['contacts'].size} points in contact{_touching(state, number, units)}"
            text = f"{wording.force(wall['force'], units)}{error}; {touching}{plate}"
            if number < len(scene.walls):
                found += [(f"force of wall {wall['name']}", text), *_rubbing(wall, "wall", state, number, units)]
                continue
            touching = f"{len(wall['points'])} points in contact{_touching(state, number, units)}"
            text = f"{wording.force(wall['force'], units)}{error}; {touching}"
            found += [(f"force of obstacle {wall['name']}", text), *_rubbing(wall, "obstacle", state, number, units)]
            found.append((f"moment of obstacle {wall['name']}", f"{wording.moment(wall['moment'], units)} about 0"))
    if scene.apart is not None and state.is_equilibrium:
        found.append(("touches itself", _touched(e.pairs, units)))
    turned = wound(scene, state)
    if turned is not ABSENT:
        found.append(("twist, writhe", f"{turned['twist']:.4g} and {turned['writhe']:.4g} turns"))
    if e.penetration is not None:
        where = "anywhere on its surface" if scene.obstacles else "anywhere along the edges"
        found.append(("beyond the walls", f"at most {wording.length(units, e.penetration)}, {where}"))
    found += [
        ("residual", f"{e.residual:.1e} after {e.iterations} iteration{'s' if e.iterations != 1 else ''}"),
        ("lowest eigenvalue", _lowest(state)),
    ]
    found.append(("model", f"{e.problem.energy}, {used}, {e.problem.lengths.size} segments"))
    if "auto" in state.numbers:
        found.append(("chosen energy", choice_text(state.numbers["auto"])))
    found.append((f"why {used}", formulation_why(scene, used)))
    if scene.path:
        path = document(PATH_NUMBERS, Answered(scene, state))["path"]
        resumed = ", continued from an interrupted run" if path["resumed"] else ""
        steps = f"{path['stages']} stages, {path['steps']} steps, {path['rejected']} rejected{resumed}: path.csv"
        found.append(("path", steps))
        if e.rubbed is not None:
            found.append(("taken by friction", f"{units.text(e.rubbed, 'D w / l', 4)} along the path"))
    error = "unknown" if state.error is None else wording.length(units, state.error)
    found.append(("discretisation error", f"{error}, {state.error_why}" if state.error_why else error))
    found.append(("time", spent(state.seconds)))
    return found


def _rubbing(wall: Mapping[str, Any], kind: str, state: State, number: int, units: Units) -> list[tuple[str, str]]:
    """The friction of a wall with its error, and at how many places the strip sticks and slips; none without."""
    if "friction" not in wall:
        return []
    slipping = sum(rub["state"] == "slips" for rub in wall["rubs"])
    error = wording.within(state.errors.get("friction", {}).get(str(number)), "D w / l^2", units)
    places = f"sticks at {len(wall['rubs']) - slipping}, slips at {slipping} places"
    return [(f"friction of {kind} {wall['name']}", f"{wording.force(wall['friction'], units)}{error}; {places}")]


def _touched(pairs: Sequence[Any], units: Units) -> str:
    """At how many pairs of places a strip touches itself, where they push most, and how much in all."""
    if not pairs:
        return "nowhere"
    pushes = [float(np.linalg.norm(pair.force)) for pair in pairs]
    most = pairs[int(np.argmax(pushes))]
    several = "one pair" if len(pairs) == 1 else f"{len(pairs)} pairs"
    where = f"s = {units.text(most.s, 'l', 4)} and {units.text(most.s_other, 'l', 4)}"
    return f"{several} of places, most at {where}; {units.text(sum(pushes), 'D w / l^2', 4)} in all"


PRESENTER = Presenter(chosen=chosen, rows=rows, sentences=sentences, write=write, undetermined=undetermined)
