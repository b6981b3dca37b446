"""Which effects a scene of the planar elastica switches on, why, and what each costs and changes (design rule 4).

For scenes that only the elastica can solve: each effect is switched off alone, the scene solved again and compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.errors import BadInput
from compare.models.elastica_run import ElasticaRun, run_elastica
from compare.scene.scene import Scene
from compare.store.progress import Reporter

_POINTS = 401


@dataclass(frozen=True)
class Part:
    """An effect: name, on or off, why, what it adds, and the keys that switch it off alone (None: nothing does)."""

    name: str
    on: bool
    why: str
    adds: str
    off: dict[str, Any] | None = None


@dataclass(frozen=True)
class Without:
    """The scene without an effect: status, iterations, warm time (s), and how far the centreline moves (l)."""

    name: str
    status: str
    iterations: int | None
    seconds: float | None
    moves: float | None


def parts(scene: Scene) -> list[Part]:
    """The effects of a scene of the elastica."""
    start, end = scene.curvature
    law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
    tip, weight = scene.tip_load, scene.gamma
    rod = scene.strip.second_moment
    held = scene.clamp_end
    return [
        Part("planar bending", True, "the scene is planar", "theta(s): one unknown a node, more for higher elements"),
        _either(
            "load at the tip", tip > 0.0, f"[tip], {tip:.4g} D w / l^2", "no [tip]", "a dead force", {"tip": False}
        ),
        _either(
            "weight", weight > 0.0, f"[gravity], Gamma = {weight:g}", "no weight along the strip",
            "a force linear in s", {"gravity": False} if not tip else None,
        ),
        _either(
            "natural curvature", (start, end) != (0.0, 0.0), law, "naturally straight", "a term in theta'",
            {"strip.natural_curvature": 0.0},
        ),
        _either(
            "second moment of area given", rod is not None, f"strip.second_moment = {rod}", "from the thickness",
            "the stiffness Y I, no unknown", None,
        ),
        _either(
            "clamp at the end", held is not None, "[clamp.end]", "no [clamp.end]: free",
            "up to two multipliers and an angle", {"clamp.end": False},
        ),
        _either(
            "continuation path", bool(scene.path), f"{len(scene.path)} [[path]] before the scene", "no [[path]]",
            "a walk through the stages", {"path": []},
        ),
        Part(
            "arc length", scene.model.arc_length != "never", f'model.arc_length = "{scene.model.arc_length}"',
            "one bordered row where load steps fail",
        ),
        Part("width, stretching and shear", False, "an elastica has none", "no unknown: no shell, no ribbon"),
    ]  # fmt: skip


def _either(name: str, on: bool, why: str, why_not: str, adds: str, off: dict[str, Any] | None) -> Part:
    return Part(name, True, why, adds, off) if on else Part(name, False, why_not, "nothing", None)


def solves(scene: Scene, found: list[Part], reporter: Reporter) -> tuple[ElasticaRun, list[Without]]:
    """The scene's solve, and one without each effect that can be off alone."""
    own = run_elastica(scene, reporter.step)
    s = np.linspace(0.0, 1.0, _POINTS)
    line = own.centreline(s)
    others = []
    for part in found:
        if not part.on or part.off is None:
            continue
        reporter.step(f"without {part.name}")
        try:
            run = run_elastica(scene.replace(part.off))
        except BadInput as refusal:
            others.append(Without(part.name, f"cannot be off alone: {refusal.problem}", None, None, None))
            continue
        moved = float(np.abs(np.linalg.norm(run.centreline(s) - line, axis=1)).max())
        r = run.result
        others.append(Without(part.name, r.status.value, r.iterations, run.warm, moved))
    return own, others


def sentences(scene: Scene, own: ElasticaRun) -> list[str]:
    """What runs, and what does not."""
    r = own.result
    error = "unknown" if r.error is None else f"{r.error:.1e} l"
    return [
        f"Elastica: {len(r.nodes) - 1} elements of degree {r.degree}; {r.message}; discretisation error {error}, "
        f"{1e3 * own.warm:.3g} ms warm.",
        "Ribbon and shell: none; what the scene asks for (see [tip], strip.second_moment) only the elastica has.",
    ]
