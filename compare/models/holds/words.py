"""What the supports of a shell hold, and what they leave to move, in the words of the pages."""

from __future__ import annotations

from compare.measure.align import Motions
from compare.models.holds.shell import part
from compare.scene.scene import Scene
from compare.scene.spec import ClampSpec
from shellref.holds import parts


def at_ends(scene: Scene, edge: str) -> str:
    """What is held at which end of an open strip; edge: what a clamp that holds a frame holds of it. "" where nothing
    is."""
    start, end = (_held(clamp, edge) for clamp in (scene.clamp_start, scene.clamp_end))
    if start == end:
        return f"{start} at both ends" if start else ""
    return " and ".join(f"{held} at {where}" for held, where in ((start, "s = 0"), (end, "s = l")) if held)


def _held(clamp: ClampSpec | None, edge: str) -> str:
    """What a clamp holds of an end (`shellref.holds.parts`)."""
    straight = "" if clamp is None or clamp.ruling == "free" else ", which stays straight"
    return {
        parts.ALL: edge,
        parts.FRAME: f"{edge} in its directions, not in its place,",
        parts.POSITION: f"the middle of the edge{straight}",
        parts.SECTION: "the edge straight",
        parts.NOTHING: "",
    }[part(clamp)]


def briefly(scene: Scene) -> str:
    """What of the strip is held, before the word held: the least that any of its clamps holds of an edge."""
    clamps = [clamp for clamp in (scene.clamp_start, scene.clamp_end) if clamp is not None]
    if not clamps:
        return "nothing"
    if all(clamp.tangent is None for clamp in clamps):
        return "points" if any(clamp.position is not None for clamp in clamps) else "straight edges"
    return "corners" if scene.shell.clamp == "corners" else "whole edge"


def left(motions: Motions | None) -> str:
    """By which motions a shape may be laid on another: those that nothing resists; "" where there is none."""
    if motions is None:
        return ""
    shifts, turns = len(motions.translations), len(motions.axes)
    if shifts == 3 and turns == 3:
        return "moved and turned as a whole"
    moved = {0: "", 1: "moved along a line", 2: "moved in a plane", 3: "moved"}[shifts]
    about = "the point that is held" if motions.pivot is not None else "any point"
    turned = {0: "", 1: "turned about an axis"}.get(turns, f"turned about {about}")
    return " and ".join(word for word in (moved, turned) if word)
