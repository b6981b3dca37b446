"""What a shell has of a scene: itself, in words, and the effects that can be off in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from compare.models.base import Effect
from compare.models.effects.weightless import weightless
from compare.models.scope import require_shell
from compare.models.shell_build import FIRST_ELEMENTS, line_weight, shell_elements, shell_options, shell_words
from compare.scene.inputs.law import values
from compare.scene.stages import stages_without
from ribbonbench.errors import BadInput
from shellref.shell.material import SHEAR_FACTOR

if TYPE_CHECKING:
    from compare.scene.scene import Scene

#: How many times as stiff against shear a shell is that has none.
_STIFF = 1000.0


#: What contact costs.
ON_WALLS = "an active set, and a saddle system by MUMPS"


def effects(scene: Scene) -> tuple[Effect, ...]:
    """The shell first, on where the scene has one; then those that can be off alone. What the stages of a path say
    about an effect goes with it."""

    def either(name: str, on: bool, why: str, key: str) -> Effect:
        if not on:
            return Effect(name, "nothing", False, why)
        off: dict[str, Any] = weightless(scene) if key == "gravity" else {key: None}
        if scene.path:
            off["path"] = stages_without(scene.path, (key,)) or None
        costs = {"clamp.end": "a clamp of its path", "wall": ON_WALLS, "obstacle": ON_WALLS, "contact": ON_WALLS}
        return Effect(name, costs.get(key, "a load of its path"), True, why, off)

    return (
        _itself(scene),
        either("gravity", bool(scene.gamma), f"Gamma = {scene.gamma:g}", "gravity"),
        either("load at the tip", bool(scene.tip_force.any()), "[tip]" if scene.tip else "no [tip]", "tip"),
        either(
            "moment at the tip",
            bool(scene.tip_moment.any()),
            "tip.moment" if scene.tip else "no [tip]",
            "tip.moment" if scene.tip_force.any() else "tip",
        ),
        either("natural curvature", any(values(scene.curvature)), "strip.natural_curvature", "strip.natural_curvature"),
        either("natural twist", any(values(scene.twist)), "strip.natural_twist", "strip.natural_twist"),
        either(
            "natural curvature in the plane",
            any(values(scene.geodesic)),
            "strip.natural_geodesic_curvature",
            "strip.natural_geodesic_curvature",
        ),
        either(
            "curved section",
            bool(scene.transverse_curvature),
            "strip.transverse_curvature",
            "strip.transverse_curvature",
        ),
        either("contact", bool(scene.walls), "[[wall]]" if scene.walls else "no [[wall]]", "wall"),
        either(
            "obstacles", bool(scene.obstacles), "[[obstacle]]" if scene.obstacles else "no [[obstacle]]", "obstacle"
        ),
        either(
            "contact with itself",
            scene.apart is not None,
            "contact.itself" if scene.apart else "no [contact]",
            "contact",
        ),
        either("clamp at the end", scene.clamp_end is not None, "[clamp.end]", "clamp.end"),
        *_own(scene),
    )


def _own(scene: Scene) -> tuple[Effect, ...]:
    """What a shell has beyond the scene's: shear across its thickness, a graded mesh, a coarse mesh first."""
    factor = scene.shell.shear_factor
    sheared = factor < _STIFF * SHEAR_FACTOR
    layered = scene.shell.edge_layer is not None
    graded = layered or scene.shell.grading != (1.0, 1.0)
    coarse = shell_options(scene).coarse
    even = {"shell.grading": [1.0, 1.0], "shell.edge_layer": None}
    return (
        Effect(
            "transverse shear", "two strains, on a reduced rule against locking", sheared, f"k = {factor:.3g} of k G h",
            {"shell.shear_factor": _STIFF * SHEAR_FACTOR} if sheared else None,
        ),
        Effect(
            "mesh grading", "nothing: as many elements, elsewhere", graded,
            "layers of two elements" if layered else "smaller cells at clamps and edges" if graded else "an even mesh",
            even if graded else None,
        ),
        Effect(
            "a coarse mesh first", "the path on a coarse mesh, a start on the mesh itself", coarse,
            "one equilibrium, or the scene says so" if coarse else "the path is walked on the mesh itself",
            {"shell.start": "path"} if coarse else None,
        ),
    )  # fmt: skip


def _itself(scene: Scene) -> Effect:
    try:
        ratios = ", ".join(f"{r:g}" for r in require_shell(scene))
        said = [f"{shell_words(scene)}.", line_weight(scene)]
    except BadInput as refusal:
        return Effect("shell", "", False, f"{refusal.key} {refusal.problem}")
    return Effect("shell", " ".join(text for text in said if text), True, f"w/h = {ratios}")


def thickest(scene: Scene) -> tuple[Scene, tuple[int, int]]:
    """The scene with its thickest shell alone, and a mesh on which it can be solved several times: `FIRST_ELEMENTS` at
    most, without refinement. Raises `BadInput` for a scene without a shell."""
    ratio = float(min(require_shell(scene)))
    along, across = shell_elements(scene)
    alone = scene.replace({"shell.width_to_thickness": [ratio], "shell.tolerance": None, "shell.goal": None})
    return alone, (min(along, FIRST_ELEMENTS[0]), min(across, FIRST_ELEMENTS[1]))
