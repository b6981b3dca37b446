"""Units, stiffnesses, rigid motions, mirror and reversal change no dimensionless number."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from compare.battery import motions
from compare.battery.case import Case, Check, Rung
from compare.battery.motions import Alike
from compare.models.base import State
from compare.scene import Scene, load

#: Shipped scenes that the ribbon solves: quickly, one with many minima (`ribbon.find.minima`), and the others.
QUICK = ("figure_4_1", "start_5_3_3_1")
TWISTED = ("two_clamps_5_3_2_twist",)
LONG = (
    "cantilever", "arc_5_1", "coil_100_7500", "coil_10_100", "coil_40_1200", "curl_4_3", "curl_4_3_down",
    "curl_4_4_long", "curl_4_4_short", "edge_published", "hanging_5_3_1", "jfig_5_2", "lateral_7_1", "limits_7_3",
    "moebius_6_1", "moebius_6_1_clamped", "moebius_6_1_straight", "moebius_narrow", "moebius_table_edge",
    "moebius_table_fallen", "moebius_wide", "rod_4_5", "roman_6_2", "roman_folds", "roman_plate",
    "shift_7_2", "start_5_3_3_2", "start_5_3_3_3", "start_5_3_3_4", "start_5_3_3_5", "two_clamps_5_3_2",
    "two_clamps_5_3_2_level",
)  # fmt: skip
#: Lengths in m, and factors of the stiffness, under which a scene is said again.
LENGTHS = (1e-6, 1e-3, 1e3)
STIFFNESSES = (1e-12, 1e12)
#: Scenes with several states that rounding or the frame chooses among, and why; elastic energies (D w / l) of them all,
#: None: mirror images of each other.
MULTISTABLE: Mapping[str, tuple[str, tuple[float, ...] | None]] = {
    "figure_4_1": (
        "a coil that hangs in several ways: held at its end several starts are compared, at its start one is gone from",
        (-33.308797534, 8.488712081016),
    ),
    "curl_4_4_long": ("begun in its plane, which it leaves to either side by rounding", None),
    "moebius_table_edge": (
        # held on the table's side between joints too; at joints alone: 58.01431431464, 58.00775626962
        "a free band is begun in the frame of the scene, whatever the table: on edge, or falling over",
        (58.01433160008, 58.00776623283),
    ),
}
_TURN = np.array([0.7, -1.1, 0.4])
_AWAY = np.array([0.3, -0.5, 0.8])


@functools.lru_cache(maxsize=4)
def stands(name: str) -> tuple[Scene, State]:
    """A shipped scene and its state."""
    scene = load(name)
    return scene, answer(scene)


def answer(scene: Scene) -> State:
    """The scene's state by the model that it asks for."""
    from compare.models import solve

    return solve(scene)


def of_scene(change: Callable[[Scene], Iterator[tuple[Scene, Alike]]]) -> Callable[[Rung], Iterator[Check]]:
    """What checks one scene: its state, beside that of every changed scene."""

    def run(rung: Rung) -> Iterator[Check]:
        scene, state = stands(str(rung))
        _, energies = MULTISTABLE.get(str(rung), ("", ()))
        for other, alike in change(scene):
            known = replace(alike, either=energies is None, energies=energies or ())
            yield from known.apart(state, answer(other))

    return run


def _units(scene: Scene) -> Iterator[tuple[Scene, Alike]]:
    for length in LENGTHS:
        yield motions.scaled(scene, length), Alike()
    if scene.strip.young is not None:
        for stiffness in STIFFNESSES:
            yield motions.scaled(scene, stiffness=stiffness), Alike()


def _turned(scene: Scene) -> Iterator[tuple[Scene, Alike]]:
    yield motions.moved(scene, motions.rotation(_TURN), _AWAY), Alike()


def _far(scene: Scene) -> Iterator[tuple[Scene, Alike]]:
    yield motions.moved(scene, np.eye(3), 1e6 * _AWAY), Alike()


def _mirrored(scene: Scene) -> Iterator[tuple[Scene, Alike]]:
    band = scene.closure is not None and scene.closure.kind == "moebius"  # of the one hand that is built in
    yield motions.mirrored(scene), Alike(across=not band)


def _reversed(scene: Scene) -> Iterator[tuple[Scene, Alike]]:
    if motions.reversible(scene):
        closed = scene.closure is not None  # begun at its seam, the same scene as before
        yield motions.end_for_end(scene), Alike(along=not closed)


_TWIN = (
    "a line of contact in the middle is held by points on one side of it, 120 segments: two copies, each the other's "
    "reversal, 2.8e-4 l apart (2.3e-3 with contact at joints alone); the distance falls with the segments' length"
)
_LOST: Mapping[Rung, str] = {
    "start_5_3_3_3": "clamps are rounded to 1e-10 l there; the forces move by 5e-8, as its stiffness has it",
    "roman_folds": "rounding of 1e-10 l in clamps and walls chooses among copies by contact: 4.9e-3 l",
    "roman_plate": f"rounding of 1e-10 l in clamps and walls chooses the twin: {_TWIN}",
}


def _case(
    name: str,
    hard: str,
    why: str,
    change: Callable[[Scene], Iterator[tuple[Scene, Alike]]],
    quick: bool = True,
    known: Mapping[Rung, str] = MappingProxyType({}),
) -> Case:
    """A case over all shipped scenes; quick: the twisted one is among the quick rungs; known: as of `Case`."""
    return Case(
        name=f"frames/{name}",
        hard=hard,
        expected=f"the same status, energy, distances between particles and forces to 1e-9, eigenvalue to 1e-7: {why}",
        parameter="scene",
        run=of_scene(change),
        rungs=(*QUICK, *(TWISTED if quick else ())),
        long=(*LONG, *(() if quick else TWISTED)),
        known=known,
    )


CASES: tuple[Case, ...] = (
    _case("units", "lengths in um, mm and km, stiffness times 1e-12 and 1e12",
          "the equations know l, D and Gamma alone", _units, quick=False),
    _case("turned", "another frame: rounding differs in every number", "no direction is distinguished", _turned),
    _case("far", "3e5 to 8e5 l away from the origin: six digits of every position are lost in sums",
          "no place is distinguished", _far, quick=False, known=_LOST),
    _case("mirror", "right is left", "bending knows no hand", _mirrored),
    _case("reversal", "s counted from the other end", "neither end is the first", _reversed),
)  # fmt: skip
