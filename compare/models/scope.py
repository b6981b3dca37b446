"""How far the ribbon and the shell reach: the first key of a scene that is beyond one of them, and why.

What a scene may say at all is checked where it is read (`compare.scene.check`); here is what these two models make of
it. No solver is loaded.
"""

from __future__ import annotations

from compare.scene.check import OF_A_ROD
from compare.scene.data import SceneData
from ribbonbench.errors import BadInput


def beyond_the_ribbon(scene: SceneData) -> tuple[str, str] | None:
    """The first key that the ribbon does not know, and why; None: there is none."""
    if scene.strip.second_moment is not None:
        return "strip.second_moment", OF_A_ROD
    if scene.tip is not None and scene.tip.moment is not None:
        return "tip.moment", "takes forces at its tip, and only rods and the shell a moment"
    return _of_rods(scene) or _of_tapes(scene)


def _of_rods(scene: SceneData) -> tuple[str, str] | None:
    """The first key that only rods know, and why; None: there is none."""
    if scene.rod is not None:
        return "rod", "is a strip of section w x h, and [rod] is the section of a rod"
    if scene.closure is not None and scene.closure.twist:
        return "closure.twist", "closes smoothly, and only rods with a turned end"
    return None


def _of_tapes(scene: SceneData) -> tuple[str, str] | None:
    """The first key that only tape springs and rods know, and why; None: there is none."""
    if scene.strip.transverse_curvature:
        return "strip.transverse_curvature", "is flat across at rest"
    for name, clamp in (("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end)):
        if clamp is not None and clamp.slide is not None:
            return f"{name}.slide", "holds all of a point or nothing of it"
        if clamp is not None and clamp.section is not None:
            return f"{name}.section", "has a section that keeps its shape at a clamp"
    return None


def beyond_the_shell(scene: SceneData) -> tuple[str, str] | None:
    """The first section that the shell cannot do, and what it cannot; None: there is none."""
    if scene.strip.second_moment is not None:
        return "strip.second_moment", "makes the strip a rod, and the shell is a strip of section w x h"
    if scene.round_rod:
        return "contact.section", 'is "round", and the shell touches itself with its surface: use "strip"'
    beyond = _of_rods(scene)
    if beyond is not None:
        return beyond[0], f"is given, and the shell {beyond[1]}"
    if scene.closure is not None and scene.strip.transverse_curvature:
        return "strip.transverse_curvature", "curves the section, and the shell joins flat ones"
    for name, clamp in (("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end)):
        if clamp is None or clamp.holds_all:
            continue
        if clamp.section == "free":
            return f"{name}.section", "is free, and the shell needs position and frame of the plane in which it is"
        hinged = clamp.position is not None and name == "clamp.end"  # the edge turns about t_x as a whole
        if scene.strip.transverse_curvature and not (hinged or (name == "clamp.end" and scene.guided)):
            part = "position" if clamp.position is None else "frame"
            return name, f"leaves the {part} of a curved section free, and there the shell holds position and frame"
        if scene.shell.clamp == "corners":
            return "shell.clamp", f'is "corners", and {name} holds a part of the edge'
        if clamp.slide is not None and clamp.ruling == "free" and not scene.strip.transverse_curvature:
            remedy = f'the shell needs {name}.ruling = "straight"'
            return f"{name}.slide", f"moves a point of a section that is free: {remedy}"
    if scene.strip.transverse_curvature and scene.clamp_start is None and scene.clamp_end is not None:
        return "clamp.start", "is absent: the start of a curved section is free, and the shell is held there"
    return None


def require_shell(scene: SceneData) -> tuple[float, ...]:
    """w/h of the shell runs that a scene asks for.

    Raises `BadInput` where it gives no thickness at all, or holds the strip as the shell cannot.
    """
    beyond = beyond_the_shell(scene)
    if beyond is not None:
        raise BadInput(beyond[0], None, beyond[1], "use ribbonbench solve")
    if scene.shell.width_to_thickness:
        return scene.shell.width_to_thickness
    if scene.strip.thickness is None:
        raise BadInput(
            "shell.width_to_thickness",
            None,
            "is missing and so is strip.thickness, but a shell has a thickness",
            "add [shell] with width_to_thickness = [20, 50, 100], or strip.thickness",
        )
    return (scene.strip.width / scene.strip.thickness,)


def has_shell(scene: SceneData) -> bool:
    """Whether a scene gives what its shell needs: a thickness, and clamps that the shell can hold."""
    thick = scene.shell.width_to_thickness or scene.strip.thickness is not None
    return bool(thick) and beyond_the_shell(scene) is None
