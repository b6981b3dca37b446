"""What `ribbonbench solve` says, draws and writes of several strips: result.json, NAME.vtu of each, strips.png."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grades import GOOD, POOR, UNKNOWN, worst
from compare.measure.grid import Grid
from compare.models.strips.solve import StripsState
from compare.models.strips.touches import touches
from compare.models.strips.walls import OnStrip, walls_of_strip
from compare.page.drawing import pictured
from compare.page.page import STRIP, Picture, Surface
from compare.page.study import RESULT, Study
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict, bounded
from compare.page.wording import length
from compare.pages.export.scale import BY_AREA, POWERS
from compare.pages.export.vtu import write_vtu
from compare.pages.strips import words as said
from compare.pages.written import write_touches
from compare.scene.units import Units
from compare.store.finite import explained
from compare.store.made_by import provenance
from compare.store.store import atomic_write_json

PICTURE = "strips.png"
#: Up to which what is left of force and moment, and the change on finer elements (l_0), are good.
BALANCED, FINE = 1e-6, 1e-2
_JOINTS = (
    Column("a", "a", kind="word"),
    Column("b", "b", kind="word"),
    Column("kind", "kind", kind="word"),
    Column("force", "force on b", "D w / l^2", kind="word"),
    Column("moment", "moment on b", "D w / l", kind="word"),
)
_STRIPS = (
    Column("strip", "strip", kind="word"),
    Column("elastic", "elastic energy", "D w / l", "digits:6"),
    Column("gravity", "weight's", "D w / l", "digits:6"),
    Column("end", "end", "l", kind="word"),
    Column("balance", "left of force and moment", kind="exponent:1"),
)


def answer(state: StripsState, units: Units | None = None) -> Verdict:
    """Whether the strips are in a state that they stay in, and how accurately it is known."""
    native, units = state.native, units or state.scene.first.units
    count = len(state.scene.names)
    body = f"{count} strips are" if count > 1 else "The strip is"
    if not native.ok:
        text = f"No stable equilibrium was found: {native.message}"
        if native.status.code == "saddle":
            text = f"The strips would not stay in the state that was found: {native.message}"
        return Verdict(text, POOR)
    stable = native.stable is True
    kind = "a stable equilibrium" if stable else "an equilibrium, whose stability is not known"
    near = "how accurately is not known" if native.error is None else f"computed to {length(units, native.error)}"
    touch = len(native.touching)
    more = f"; they touch at {touch} place{'s' if touch != 1 else ''}" if touch else ""
    left = "" if native.left is None else f"; it was left for from a saddle {native.left:.3g} D w / l above"
    checks = (
        bounded("residual", native.residual, 1e-8, "residual"),
        bounded("balance", max(state.balance), BALANCED, "left of force and moment"),
        Check("stability", GOOD if stable else UNKNOWN, f"lowest eigenvalue {native.lowest_eigenvalue:.3g}"),
        Check("elements", UNKNOWN, "not known")
        if native.error is None
        else bounded("elements", native.error, FINE, "change on elements half as long, l"),
    )
    return Verdict(f"{body} in {kind}; {near}{more}{left}", worst(*(check.grade for check in checks)), checks)


def rows(state: StripsState, units: Units | None = None) -> list[tuple[str, str]]:
    """What the command prints: name and text."""
    native, units = state.native, units or state.scene.first.units
    energy = native.energy
    found = [
        ("status", native.message),
        ("residual", f"{native.residual:.1e} after {native.iterations} iterations"),
    ]
    if not state.is_equilibrium:
        return found
    found += [
        ("energy", f"elastic {units.text(energy.elastic, 'D w / l')}, total {units.text(energy.total, 'D w / l')}"),
        ("lowest eigenvalue", f"{native.lowest_eigenvalue:.4g}"),
        ("left of force and moment", f"{max(state.balance):.1e}"),
    ]
    found += said.ends(state, units) + said.joints(state, units) + said.contact(state, units)
    found += said.walls(walls(state), units)
    error = "unknown" if native.error is None else length(units, native.error)
    return [*found, ("discretisation error", error), ("units", f"l and D w of the strip {state.scene.names[0]}")]


def _joints(state: StripsState) -> list[tuple[str, str, str, str, str]]:
    named = zip(state.scene.joints, state.native.joints, strict=True)
    return [
        (state.scene.end_name(said.one), state.scene.end_name(said.other), said.spec.kind, _vector(joint.force),
         _vector(joint.moment))
        for said, joint in named
    ]  # fmt: skip


def _vector(values: Any) -> str:
    return "(" + ", ".join(f"{value + 0.0:.5g}" if abs(value) > 1e-9 else "0" for value in values) + ")"


def tables(state: StripsState) -> tuple[Table, ...]:
    """Strips and joints."""
    strips = []
    for k, (name, strip) in enumerate(zip(state.scene.names, state.native.strips, strict=True)):
        unit = state.native.problem.stiffness_over[k]
        end = state.over[k] * strip.end.position
        strips.append((name, unit * strip.energy.elastic, unit * strip.energy.gravity, _vector(end), state.balance[k]))
    found = [Table("The strips", _STRIPS, tuple(strips))]
    if state.scene.joints:
        found.append(Table("The joints", _JOINTS, tuple(_joints(state))))
    return tuple(found)


def result(state: StripsState) -> dict[str, Any]:
    """result.json: numbers in l and D w of the first strip."""
    native, scene = state.native, state.scene
    energy, units = native.energy, scene.first.units
    energies = {
        "bending": energy.bending, "natural": energy.natural, "elastic": energy.elastic, "gravity": energy.gravity,
        **({"tip": energy.tip} if _is_loaded(state) else {}), "total": energy.total,
    }  # fmt: skip
    whys = {} if native.error is not None else {"discretisation_error_why": "elements half as long found no such state"}
    return {
        "title": scene.title,
        "status": native.status.code,
        "message": native.message,
        "stable": native.stable,
        "lowest_eigenvalue": native.lowest_eigenvalue,
        "unstable_modes": native.unstable_modes,
        "residual": native.residual,
        "iterations": native.iterations,
        "energy": energies if state.is_equilibrium else None,
        "discretisation_error": native.error,
        **whys,
        "left_saddle": native.left,
        **({"path": [vars(one) for one in state.went]} if scene.stages else {}),
        **({} if native.rubbed is None else {"friction_lost": native.rubbed}),
        "strips": {name: _strip(state, k) for k, name in enumerate(scene.names)},
        "joints": [_joint(state, k) for k in range(len(scene.joints))] if state.is_equilibrium else None,
        "contact": _contact(state) if state.is_equilibrium else None,
        "walls": walls(state) if state.is_equilibrium else None,
        "penetration": native.penetration,
        **({} if native.penetration is not None else {"penetration_why": _no_penetration(state)}),
        "units_of": scene.names[0],
        "length": scene.first.strip.length,
        "units": {"known": units.known, **units.to_dict()},
        "model": {
            "energy": native.problem.parts[0].energy, "formulation": "mixed",
            "elements": [part.lengths.size for part in native.problem.parts], "solver": native.solver,
        },
        "seconds": state.seconds,
        "provenance": provenance(scene),
    }  # fmt: skip


def _is_loaded(state: StripsState) -> bool:
    return any(part.tip is not None for part in state.native.problem.parts)


def walls(state: StripsState) -> list[dict[str, Any]]:
    """How every wall and obstacle pushes all strips, moments about the origin, and each that it touches: force and
    moment are without friction, which stands beside them."""
    scene = state.scene
    each = [walls_of_strip(scene, state.native, k) for k in range(len(scene.names))]
    found = []
    for number, name in enumerate(scene.first.barrier_names):
        own = {strip: sides[number] for strip, sides in zip(scene.names, each, strict=True)}
        touched = {
            strip: {
                "force": wall.force, "moment": wall.moment, "contacts": wall.contacts, "points": wall.points,
                "pushes": wall.pushes, **friction_of([wall]), **({"rubs": each_rub(wall)} if wall.rubs else {}),
            }
            for strip, wall in own.items()
            if len(wall.points)
        }  # fmt: skip
        found.append(
            {
                "name": name,
                "force": np.sum([wall.force for wall in own.values()], axis=0),
                "moment": np.sum([wall.moment for wall in own.values()], axis=0),
                **friction_of(list(own.values())),
                "strips": touched,
            }
        )
    return found


def friction_of(sides: Sequence[OnStrip]) -> dict[str, Any]:
    """The friction of a wall on strips; nothing where it has none."""
    rubs = [rub.friction for side in sides for rub in side.rubs]
    return {"friction": np.sum(rubs, axis=0)} if rubs else {}


def each_rub(side: OnStrip) -> list[dict[str, Any]]:
    """The places of a strip that rub on a wall."""
    return [
        {
            "s": rub.s, "v": rub.v, "point": rub.point, "push": rub.push, "friction": rub.friction, "slip": rub.slip,
            "state": "slips" if rub.slips else "sticks",
        }
        for rub in side.rubs
    ]  # fmt: skip


def _pose(state: StripsState, k: int, s: float) -> dict[str, Any]:
    pose = state.native.strips[k].pose(s) if s < 1.0 else state.native.strips[k].end
    return {"position": state.over[k] * pose.position, "frame": pose.frame}


def _strip(state: StripsState, k: int) -> dict[str, Any]:
    strip = state.native.strips[k]
    over, unit = state.over[k], state.native.problem.stiffness_over[k]
    if not state.is_equilibrium:
        nothing = dict.fromkeys(("energy", "start", "middle", "end", "forces", "moments"))
        return {"length": over, "width": over * strip.problem.strip.relative_width, "stiffness": unit * over, **nothing}
    found: dict[str, Any] = {
        "length": over, "width": over * strip.problem.strip.relative_width, "stiffness": unit * over,
        "energy": {"elastic": unit * strip.energy.elastic, "gravity": unit * strip.energy.gravity},
        "start": _pose(state, k, 0.0), "middle": _pose(state, k, 0.5), "end": _pose(state, k, 1.0),
        "max_abs_eta": strip.max_abs_eta, "max_abs_eta_prime_w_half": strip.max_abs_eta_prime_w_half,
        "unbalanced": state.balance[k],
    }  # fmt: skip
    if strip.problem.tip is not None:
        found["tip_force"] = unit / over * np.asarray(strip.problem.tip)
    if strip.problem.moment is not None:
        found["tip_moment"] = unit * np.asarray(strip.problem.moment)
    forces, moments = {}, {}
    for place, support in (("start", strip.start), ("end", strip.end_support)):
        if support is not None and state.scene.clamped((k, 0 if place == "start" else -1)):
            forces[place], moments[place] = unit / over * support.force, unit * support.moment
    return {**found, "forces": forces, "moments": moments}


def _joint(state: StripsState, number: int) -> dict[str, Any]:
    said, joint = state.scene.joints[number], state.native.joints[number]
    return {
        "a": state.scene.end_name(said.one), "b": state.scene.end_name(said.other), "kind": said.spec.kind,
        "position": joint.at, "force": joint.force, "moment": joint.moment, "opened": joint.opened,
        "turned": joint.turned,
    }  # fmt: skip


def _no_penetration(state: StripsState) -> str:
    return "it has no shape" if state.scene.first.barriers else "there is no wall"


def _contact(state: StripsState) -> dict[str, Any] | None:
    if state.scene.distance is None:
        return None
    names = state.scene.names
    return {
        "distance": state.native.problem.apart,
        "too_near": state.native.depth,
        "places": [
            {
                "a": names[one.one], "b": names[one.other], "s": one.s, "v": one.v, "s_b": one.s_other,
                "v_b": one.v_other, "position": one.at, "position_b": one.at_other, "force": one.force,
                "gap": one.gap,
            }
            for one in state.native.touching
        ],
        **({"rubs": _rubs(state)} if state.scene.friction else {}),
    }  # fmt: skip


def _rubs(state: StripsState) -> list[dict[str, Any]]:
    """Where strips rub on each other: `force` on the first without friction stands beside, friction is on it too."""
    names = state.scene.names
    return [
        {
            "a": names[one.one], "b": names[one.other], "s": one.s, "v": one.v, "s_b": one.s_other, "v_b": one.v_other,
            "point": one.point, "push": one.push, "friction": one.friction, "slip": one.slip,
            "state": "slips" if one.slips else "sticks",
        }
        for one in state.native.slides
    ]  # fmt: skip


def write(out: Path, state: StripsState, again: str) -> None:
    """result.json first, then surfaces and picture, and page.json."""
    found, verdict = result(state), answer(state)
    atomic_write_json(out / RESULT, explained({**found, "answer": verdict}))
    surfaces, grids, files = [], {}, {RESULT: "all numbers"}
    if not state.is_equilibrium:
        study = Study("solve", state.scene.title, verdict=verdict, sentences=(state.native.message,), files=files)
        study.write(out, found, again, state.scene)
        return
    scene = state.scene
    each = zip(scene.names, state.shapes, state.over, scene.strips, scene.stiffness, strict=True)
    for name, shape, over, strip, stiff in each:
        grid = Grid.for_shape(strip, shape.bend)
        points = over * grid.of(shape)
        s, v = np.meshgrid(over * grid.s, over * grid.v, indexing="ij")
        fields = shape.fields(grid.s, grid.v)
        by_area = stiff / state.scene.stiffness[0] / over**2
        for key, values in fields.items():  # in l and D of the first strip
            fields[key] = values * (by_area if key in BY_AREA else over ** POWERS.get(key, 0))
        write_vtu(out / f"{name}.vtu", points, {**fields, "S": s, "v": v})
        surfaces.append(Surface(f"{name}.vtu", name, STRIP, "omega"))
        files[f"{name}.vtu"] = f"surface of {name} with fields (ParaView), lengths in l of the first strip"
        grids[name] = points
    if touching := touches(state):
        marks = write_touches(out, touching, np.concatenate([points.reshape(-1, 3) for points in grids.values()]))
        surfaces += marks
        files |= {one.file: f"{one.label}, as arrows (ParaView)" for one in marks}
    pictures: tuple[Picture, ...] = ()
    if pictured(lambda: _draw(out, state, grids)):
        alt = f"{len(grids)} strips from two sides and in space; dots are joints, with arrows places of contact"
        pictures = (Picture(PICTURE, alt),)
        files[PICTURE] = "the strips from two sides and in space"
    study = Study(
        "solve", state.scene.title, tables(state), verdict, pictures=pictures, surfaces=tuple(surfaces), files=files
    )
    study.write(out, found, again, state.scene)


def _draw(out: Path, state: StripsState, grids: dict[str, Any]) -> None:
    from compare.pages.strips.picture import draw

    joints = [joint.at for joint in state.native.joints]
    scene = state.scene
    draw(out / PICTURE, grids, joints, touches(state), scene.title, scene.up, scene.first.units)
