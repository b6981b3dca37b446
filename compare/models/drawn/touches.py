"""What a round rod touches itself with, and how it is wound about itself (`ribbon.find.jointed.wound`), as numbers with
errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from compare.record.quantity import ABSENT

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]
Estimate = Callable[[Sequence[Any]], float | None]

#: Abscissae of the twist, edges of the writhe's polygon.
_SAMPLES, _EDGES = 2000, 400
#: Of the numbers of a state, the errors of these.
ERRORS = "touch_errors"
_UNLIKE = "what touches on finer segments is not as many places and lines"


def turns(e: Equilibrium) -> dict[str, float]:
    """`twist` and `writhe` of an equilibrium, in turns, of the strip's own open curve, and `link`: twist and the writhe
    of the curve closed far away (`ribbon.find.jointed.wound`), of one whose ends hold position and frame."""
    from ribbon.find.jointed.wound import closed, writhe

    tau = e.tau(np.linspace(0.0, 1.0, _SAMPLES + 1))
    twist = float((0.5 * (tau[0] + tau[-1]) + tau[1:-1].sum()) / _SAMPLES / (2.0 * np.pi))
    r, start, end = e.position(np.linspace(0.0, 1.0, _EDGES + 1)), e.problem.start, e.problem.end
    found = {"twist": twist, "writhe": writhe(r)}
    if start is not None and end is not None and start.is_whole and end.is_whole:
        found["link"] = twist + writhe(closed(r, np.asarray(start.frame), np.asarray(end.frame)[:, 2]))
    return found


def numbers(e: Equilibrium) -> dict[str, Any]:
    """What errors are told of: `places` (k, 3) and `lines` (m, 5), abscissae and force; `turns`:
    twist, writhe and, where it has one, link."""
    here, found = e.jointed, turns(e)
    places, lines = [], []
    if here is not None:
        where = zip(here.touching.places, here.pushes, strict=False)
        places = [[s, other, float(force)] for (s, other), force in where]
        lines = [[*line["s"], *line["s_other"], line["force"]] for line in here.lines()]
    return {"places": places, "lines": lines, "turns": list(found.values())}


def errors(found: Sequence[Equilibrium], estimate: Estimate) -> dict[str, Any]:
    """Errors of the `numbers` of an equilibrium, one of several on ever finer segments: of each place and line
    (abscissae, force), None where not as many touch; of twist, writhe and link."""
    chain = [numbers(e) for e in found]

    def of(name: str, k: int, part: slice) -> float | None:
        if any(len(one[name]) != len(chain[0][name]) for one in chain):
            return None
        return estimate([np.array(one[name][k][part]) for one in chain])

    out: dict[str, Any] = {
        name: [(of(name, k, slice(-1)), of(name, k, slice(-1, None))) for k in range(len(chain[0][name]))]
        for name in ("places", "lines")
    }
    return {**out, "turns": [estimate([one["turns"][k] for one in chain]) for k in range(len(chain[0]["turns"]))]}


def asked(scene: Scene | None) -> bool:
    """Whether a scene has these numbers: it begins in a drawn curve, or its segments follow what touches."""
    return scene is not None and (scene.seed.curve is not None or scene.follows)


def _known(state: State) -> Mapping[str, Any]:
    found: Mapping[str, Any] = state.numbers.get(ERRORS) or {}
    return found


def _with(entry: dict[str, Any], state: State, name: str, k: int) -> dict[str, Any]:
    """An entry with the errors of its abscissae (l) and its force, or why these are not known."""
    told = _known(state).get(name, [])
    where, force = told[k] if k < len(told) else (None, None)
    why = (_UNLIKE if told else state.error_why) or "not estimated"
    for key, error in (("s_error", where), ("force_error", force)):
        entry |= {key: error} if error is not None else {key: None, f"{key}_why": why}
    return entry


def places(scene: Scene, state: State) -> Any:
    """Places of contact of a round rod whose segments follow them: `s`, `s_other`, `force`, with errors."""
    if not scene.follows:
        return ABSENT
    if state.native.jointed is None:
        return None
    rows = numbers(state.native)["places"]
    return [
        _with({"s": s, "s_other": other, "force": force}, state, "places", k)
        for k, (s, other, force) in enumerate(rows)
    ]


def lines(scene: Scene, state: State) -> Any:
    """Lines along which such a rod touches itself (`ribbon.find.jointed.rounds.Jointed.lines`), with errors."""
    if not scene.follows:
        return ABSENT
    here = state.native.jointed
    return None if here is None else [_with(line, state, "lines", k) for k, line in enumerate(here.lines())]


def wound(scene: Scene, state: State) -> Any:
    """Twist, writhe and link of a strip that begins in a drawn curve, with errors."""
    if not asked(scene) or state.shape is None or not state.is_equilibrium:
        return ABSENT
    found: dict[str, Any] = dict(turns(state.native))
    sure = _known(state).get("turns", [None] * len(found))
    for name, error in zip(tuple(found), sure, strict=True):
        key = f"{name}_error"
        found |= {key: error} if error is not None else {key: None, f"{key}_why": state.error_why or "not estimated"}
    return found


def penetration(scene: Scene, state: State) -> Any:
    """How much nearer (l) parts of the strip are anywhere than they may be; of a scene that keeps them apart."""
    from ribbon.judge import nearness

    if scene.apart is None or not state.is_equilibrium:
        return ABSENT
    e = state.native
    return max((-gap for gap, _ in nearness.minima(e.problem, e.x, 0.0)), default=0.0)


def complementarity(scene: Scene, state: State) -> Any:
    """The largest product of what a pair pushes with and its gap (D w / l); of a scene that keeps parts apart."""
    if scene.apart is None or not state.is_equilibrium:
        return ABSENT
    e = state.native
    where = e.problem.block_slices().get("pairs")
    return 0.0 if where is None else float(np.abs(e.rows[where] * e.problem.pair_rows().values(e.x)).max(initial=0.0))
