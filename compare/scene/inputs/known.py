"""Does every number lie where the models are known to work? What does not is refused before anything is computed.

The ranges stand with the keys (`Key.known`) and are dimensionless: lengths in l, curvatures times l, forces in
D w / l^2, moments in D w / l. They are as wide as the hard cases that pass (results/battery.md), and wider where
nothing fails beyond: a strip of K l = 1e4 has 1600 turns, one of Gamma = 1e12 hangs straight behind a layer of 1e-6 l.
`ribbon.strip.KNOWN` are the same ones for strips made in Python.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from compare.scene.data import SceneData
from compare.scene.declare import FORCE, LENGTH, MOMENT, NONE, PER_LENGTH, Key, Known
from compare.scene.inputs import law
from compare.scene.keys import KEYS, SINGLE
from compare.scene.loads import force_scale
from compare.scene.spec import StripSpec
from ribbonbench.errors import BadInput


def check_known(scene: SceneData) -> None:
    """`BadInput` for the first number beyond the range of its key, or that gives a weight or a load beyond it."""
    for name, section, spec in _sections(scene):
        if spec is None:
            continue
        for field in fields(spec):
            about = KEYS.get(f"{section}.{field.name}")
            if about is not None and about.known is not None:
                _check(name, about, about.known, getattr(spec, field.name), scene.strip)
    strip = scene.strip
    if strip.gamma is None and not _within("strip.gamma", scene.gamma):
        raise _refused(
            "strip.young", strip.young, _known("strip.gamma"), "rho h g l^3 / D", scene.gamma, KEYS["strip.young"]
        )
    if scene.tip is not None and scene.tip.mass is not None and not _within("tip.load", scene.tip_load):
        raise _refused(
            "tip.mass", scene.tip.mass, _known("tip.load"), "P = M g l^2 / (D w)", scene.tip_load, KEYS["tip.mass"]
        )


def _known(name: str) -> Known:
    known = KEYS[name].known
    assert known is not None
    return known


def _within(name: str, number: float) -> bool:
    return _known(name).holds(number)


def _sections(scene: SceneData) -> Iterator[tuple[str, str, Any]]:
    """How a section is called in this scene, how in the contract, and what it says (None: it is absent)."""
    for name in sorted(SINGLE, key=lambda section: section.startswith("clamp")):
        yield name, name, getattr(scene, name.replace(".", "_"))
    for index, wall in enumerate(scene.walls):
        yield f"wall.{index if wall.name is None else wall.name}", "wall", wall
    for index, obstacle in enumerate(scene.obstacles):
        yield f"obstacle.{index if obstacle.name is None else obstacle.name}", "obstacle", obstacle


def _check(section: str, about: Key, known: Known, value: Any, strip: StripSpec) -> None:
    numbers = value if isinstance(value, tuple) else (value,)
    if law.is_table(value):
        numbers = law.values(value)
    scale = _scale(about.unit, strip)
    for number in numbers:
        if isinstance(number, (int, float)) and not known.holds(number * scale):
            given = about.written(value) if isinstance(value, tuple) and len(set(value)) > 1 else number
            raise _refused(f"{section}.{about.field}", given, known, known.symbol, number * scale, about)


def _scale(unit: str | None, strip: StripSpec) -> float:
    """What one unit of a key is without dimension."""
    if unit == LENGTH:
        return 1.0 / strip.length
    if unit == PER_LENGTH:
        return strip.length
    if unit == FORCE:
        return force_scale(strip)
    if unit == MOMENT:
        return force_scale(strip) / (1.0 if strip.young is None else strip.length)
    return 1.0


def _refused(key: str, value: Any, known: Known, symbol: str, number: float, about: Key) -> BadInput:
    unit = f"check the unit ({about.unit})" if about.unit not in (None, NONE) else "check the number"
    return BadInput(
        key, value, f"gives {symbol} = {number:.6g}, beyond what the models are known to work for ({known.text})", unit
    )
