"""Scenes whose ribbon has a free twist, as a strip of finite thickness: what they need, and what they cannot have."""

from __future__ import annotations

import math

from compare.models.base import Variant
from compare.models.ribbon.build import has_free_twist, needs_thickness, relative_thickness, ribbon_energy
from compare.scene.inputs.curve import fault
from compare.scene.inputs.law import values
from compare.scene.scene import Scene
from compare.scene.spec import THIN
from ribbon.energies.names import FREE
from ribbonbench.errors import BadInput

#: The energy that knows of clamped edges, named in remedies.
FINITE = "finite"
#: Energies that know a twist at rest (`ribbon.energies.energy.FreeTwist.pretwist`).
TWISTED = ("kirchhoff", "extensible", "sano")
#: Largest v = sqrt(12 (1 - nu^2)) kappa w^2 / h (Audoly & Neukirch 2021) to which the relaxed section is verified.
MOST_V = 1e6


def per_thickness(scene: Scene) -> tuple[Variant, ...]:
    """The scene with each of its w/h alone, where its energy needs a thickness and it has several; else none."""
    ratios = scene.shell.width_to_thickness
    if not needs_thickness(scene) or len(ratios) < 2:
        return ()
    return tuple(
        Variant({"width_to_thickness": float(ratio)}, scene.replace({"shell.width_to_thickness": [float(ratio)]}))
        for ratio in ratios
    )


def refusal(scene: Scene) -> BadInput | None:
    """Why the scene is not for its energy, as far as that is a matter of thickness and rulings; None: it is."""
    energy = ribbon_energy(scene)
    model = scene.model
    if scene.shaped:
        refused = _shape(scene, energy)
        if refused is not None:
            return refused
    if model.accuracy is not None:
        refused = _accuracy(scene, model.accuracy)
        if refused is not None:
            return refused
    if not has_free_twist(scene):
        if model.in_plane:
            remedy = 'remove it, or choose energy = "finite"'
            return BadInput(
                "model.in_plane", True, f'"{energy}" is developable: it cannot bend in its own plane', remedy
            )
        if model.stiffness is not None:
            return _stiffness(scene, energy)
        return None
    if model.stiffness is not None and energy != "kirchhoff":
        return _stiffness(scene, energy)
    if energy != "sadowsky_kt":
        refused = _thickness(scene, f'energy = "{energy}"') or _range(scene, energy)
        if refused is not None:
            return refused
    if model.formulation == "matrix":
        remedy = 'choose "mixed" or "auto"'
        return BadInput("model.formulation", "matrix", f'knows rulings only, and "{energy}" has none', remedy)
    return None if energy == FINITE else _ruling(scene, energy)


def of_a_curve(scene: Scene) -> BadInput | None:
    """Why the ribbon cannot begin in the scene's drawn curve, or have segments that follow what touches; None: it can,
    or is not asked to."""
    if scene.follows:
        if ribbon_energy(scene) != "kirchhoff":
            remedy = 'choose model.energy = "kirchhoff", or leave contact.joints out'
            problem = f'is of a round rod, and the energy is "{scene.model.energy}"'
            return BadInput("contact.joints", "follow", problem, remedy)
        if scene.model.tolerance is not None:
            problem = "places segments, and so does contact.joints"
            return BadInput("model.tolerance", scene.model.tolerance, problem, "give model.elements")
    if scene.seed.curve is None:
        return None
    if not has_free_twist(scene) or scene.model.in_plane is False or scene.model.accuracy is not None:
        problem = f'begins in space, and the energy "{scene.model.energy}" bends across its plane alone'
        return BadInput("seed.curve", None, problem, 'choose model.energy = "kirchhoff", or give seed.curvature')
    if scene.model.formulation not in ("auto", "mixed"):
        return BadInput("model.formulation", scene.model.formulation, "does not begin in seed.curve", 'choose "auto"')
    if scene.model.in_plane is None and ribbon_energy(scene) != "kirchhoff":
        problem = f'bends across its plane alone with "{scene.model.energy}", and seed.curve is in space'
        return BadInput("model.in_plane", None, problem, "add in_plane = true")
    return fault(scene.stages()[0])


def _shape(scene: Scene, energy: str) -> BadInput | None:
    """The refusal of a twist or of a curvature in the plane at rest that the energy does not know."""
    for key, law, known in (
        ("strip.natural_twist", scene.twist, TWISTED), ("strip.natural_geodesic_curvature", scene.geodesic, FREE),
    ):  # fmt: skip
        if not any(values(law)):
            continue
        if energy not in known or scene.model.accuracy is not None:
            problem = f'is not known to the energy "{scene.model.energy}", of a strip that is flat at rest'
            remedy = f'choose model.energy = "kirchhoff" (or {", ".join(known)}), or "antman", a rod'
            return BadInput(key, getattr(scene.strip, key.removeprefix("strip.")), problem, remedy)
        if scene.model.in_plane is False and known is FREE:
            return BadInput("model.in_plane", False, f"leaves out what {key} is about", f"remove it, or {key}")
    return None


def _accuracy(scene: Scene, accuracy: float) -> BadInput | None:
    """What the choice of an energy by an accuracy needs."""
    if scene.model.energy != "auto":
        problem = f'chooses the energy, and the scene has energy = "{scene.model.energy}"'
        return BadInput("model.accuracy", accuracy, problem, 'remove it, or choose energy = "auto"')
    if scene.model.formulation == "matrix":
        remedy = 'choose "mixed" or "auto"'
        return BadInput("model.formulation", "matrix", "knows rulings only, and model.accuracy may choose none", remedy)
    return _thickness(scene, "model.accuracy")


def _thickness(scene: Scene, what: str) -> BadInput | None:
    """The refusal of a scene without one thickness, on which `what` depends."""
    if relative_thickness(scene) is not None:
        return None
    ratios = scene.shell.width_to_thickness
    if len(ratios) > 1:
        problem = f"has {len(ratios)} values, and a strip with {what} has one thickness"
        remedy = f"give one, as --set shell.width_to_thickness=[{ratios[-1]:g}]; compare takes them all"
        return BadInput("shell.width_to_thickness", list(ratios), problem, remedy)
    remedy = "give strip.thickness, or one w/h as shell.width_to_thickness = [100]"
    return BadInput("strip.thickness", None, f"is missing, and {what} depends on it", remedy)


def _range(scene: Scene, energy: str) -> BadInput | None:
    """The refusal of a natural curvature for which the section's law of a thin plate does not hold: bent to a radius of
    a few thicknesses, or, for the energies that relax the section, v of (10.2) beyond what its functions reach."""
    h, bent = relative_thickness(scene), max(abs(k) for k in values(scene.curvature))
    if h is None or bent == 0.0:
        return None
    if bent * h > THIN:
        problem = (
            f"times the thickness is {bent * h:.2g}: a strip bent to a radius of a few thicknesses is no thin plate"
        )
        remedy = f"keep it below {THIN / h / scene.strip.length:.3g}"
        return BadInput("strip.natural_curvature", scene.strip.natural_curvature, problem, remedy)
    v = math.sqrt(12.0 * (1.0 - scene.strip.poisson**2)) * bent * scene.width**2 / h
    if v > MOST_V and energy != "kirchhoff":
        problem = f"gives v = {v:.1e} with this curvature, and the section's law is verified up to {MOST_V:.0e}"
        remedy = 'choose energy = "wunderlich": so thin a strip does not stretch'
        return BadInput("strip.thickness", h * scene.strip.length, problem, remedy)
    return None


def _stiffness(scene: Scene, energy: str) -> BadInput:
    remedy = 'remove it, or choose energy = "kirchhoff"'
    return BadInput("model.stiffness", scene.model.stiffness, f'is of the rod; "{energy}" knows one stiffness', remedy)


def _ruling(scene: Scene, energy: str) -> BadInput | None:
    """A straight ruling that the scene itself asks for."""
    requested = [
        (f"{name}.ruling", spec.ruling)
        for name, spec in (
            ("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end), ("closure", scene.closure)
        )
        if spec is not None and f"{name}.ruling" in scene.own_keys
    ]  # fmt: skip
    for key, ruling in requested:
        if ruling == "straight":
            remedy = f'remove it, or choose energy = "{FINITE}", which knows of clamped edges'
            return BadInput(key, ruling, f'is asked of energy = "{energy}", which knows no ruling', remedy)
    return None
