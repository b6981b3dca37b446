"""Scenes: what is simulated, as data. A TOML file, strictly read into a frozen dataclass.

`load` takes the name of a shipped scene or a path, `loads` a text; every fault raises `ribbonbench.errors.BadInput`
naming the key, its value and what would be right, before anything is computed. An absent section is an absent effect.

The values of the file and the dimensionless numbers that follow from them are those of `compare.scene.data.SceneData`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare import registry
from compare.scene.change import canonical_of, changed, document_of, given_keys
from compare.scene.check import check_geometry
from compare.scene.data import SceneData
from compare.scene.declare import Kind
from compare.scene.inputs.curve import with_points
from compare.scene.inputs.known import check_known
from compare.scene.inputs.plausible import implausible
from compare.scene.inputs.source import name_of, shipped, text_of, text_of_shipped
from compare.scene.inputs.through import begins_through
from compare.scene.inputs.without_effect import without_effect
from compare.scene.keys import KEYS, contract_name
from compare.scene.planar import nonplanar_reason
from compare.scene.read import one_line, read_sections
from compare.scene.spec import StageSpec
from compare.scene.stages import stage_name
from compare.scene.toml import toml_text
from ribbonbench.errors import BadInput

__all__ = ["Scene", "load", "loads", "parse_assignment", "shipped", "text_of_shipped"]


@dataclass(frozen=True)
class Scene(SceneData):
    """One scene: a strip, what holds and loads it, the ribbon's model, the way to the scene and the shell runs."""

    # -- questions ---------------------------------------------------------------------------------------------------

    def nonplanar_reason(self) -> str | None:
        """What leaves the plane of t_y and t_z (clamp or load, with its component), or else keeps the planar elastica
        from the scene; None when it can be asked."""
        return nonplanar_reason(self)

    def is_planar(self) -> bool:
        """True when a planar equilibrium (eta = 0) exists; it need not be the stable one."""
        return self.nonplanar_reason() is None

    def notes(self, seed: str | None = "[seed]") -> tuple[str, ...]:
        """One line for every given value that has no effect on the result, so that none is ignored silently, and for
        every one that can hardly be meant (a slip of units), with what probably was; seed: as of `begins_through`."""
        return without_effect(self) + implausible(self) + begins_through(self, seed)

    def given(self) -> frozenset[str]:
        """The dotted keys that the scene sets, be it to their default, as `KEYS` names them: a key of any wall is
        "wall.stiffness", a path gives "path" and every key that its stages set. Without the title and `across`."""
        return self.own_keys.union(*({"path", *given_keys(stage)} for stage in self.path))

    # -- the scene as data -------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The scene as a nested dictionary of the contract's keys: what the scene says (`given`), and its title."""
        return {"title": self.title, **document_of(self)}

    def canonical(self) -> dict[str, Any]:
        """All that can influence the result, defaults filled in, ready for JSON and hashing.

        Name, title and source are left out.
        """
        return canonical_of(self)

    def to_toml(self) -> str:
        """TOML text with a comment on every key; `loads` gives back the same scene."""
        return toml_text(self.to_dict())

    def replace(self, keys: Mapping[str, Any]) -> Scene:
        """The scene with dotted keys replaced, e.g. `{"strip.gamma": 50.0}`, and checked again.

        None removes a key or a section, and so does False a section that can be absent ("clamp.end", "closure", ...).
        A wall goes by its number or its name: "wall.0.point", "wall.roof.point". A key that says the same thing in
        another way (gamma for young and density, elements for element_lengths) replaces it.
        """
        return _build(changed(self.to_dict(), keys), self.source)

    def stages(self) -> tuple[Scene, ...]:
        """The scenes of the path in order, then the scene itself; none of them has a path of its own.

        A stage changes the scene of the stage before it, the first one the scene itself: a key keeps the value of the
        last stage that names it.
        """
        scene = self if not self.path else self.replace({"path": None})
        return (*_stage_scenes(scene, self.path), scene)


#: A key with far more dots than any has, whose tables within tables a parser would make for minutes (time and memory go
#: with the square of the dots); and what is no bare key: texts in quotes (or keys in them) and comments.
_DEEP = re.compile(r"(?:\.[ \t]*+[\w-]*+[ \t]*+){64}")
_QUOTED = re.compile(r'"""(?:\\.|[^\\])*?"""|' r"'''.*?'''|" r'"(?:\\.|[^"\\\n])*+"|' r"'[^'\n]*+'|#[^\n]*+", re.DOTALL)


def load(name_or_path: str | Path) -> Scene:
    """Read a shipped scene by its name, a scene file by its path, or with "-" what stands in the standard input."""
    return loads(*text_of(name_or_path))


def loads(text: str, source: str = "<text>") -> Scene:
    """Read a scene from TOML text; `source` is where it came from, its stem becomes the scene's name."""
    try:
        if _DEEP.search(_QUOTED.sub("q", text)):
            raise RecursionError
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(
            "scene",
            source,
            f"is not valid TOML: {error}{_line_of(text, str(error))}",
            "mend that line; texts need quotes, numbers none and no unit behind them (0.3, not 30 cm or 0,3)",
        ) from None
    except (ValueError, RecursionError):
        raise BadInput(
            "scene", source, "is not valid TOML: a number or a nesting beyond all bounds", "mend it"
        ) from None
    listed = document.get("strip")
    if isinstance(listed, list) and any(isinstance(one, dict) for one in listed):
        raise BadInput(
            "strip", None, "is a list, [[strip]]: several strips, which solve and export alone compute together",
            "use one of them, or write one strip as a section [strip]",
        )  # fmt: skip
    return _build(document, source)


def _line_of(text: str, error: str) -> str:
    """The line that a fault of TOML names, as the file has it; "" where it names none."""
    found = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    if found is None or not 0 < int(found[1]) <= len(lines):
        return ""
    return f": {one_line(lines[int(found[1]) - 1].partition('#')[0].strip())[:80]}"


def parse_assignment(text: str) -> tuple[str, Any]:
    """`key=value` of a command line, e.g. `strip.gamma=50` -> ("strip.gamma", 50).

    The value is TOML; a bare word is a text, and so is what stands at a key whose kind is text.
    """
    key, equals, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not equals or not key or not value:
        raise BadInput("--set", text, "is not key=value", "e.g. --set strip.gamma=50")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        parsed = {}
    if set(parsed) == {"value"}:
        return key, parsed["value"]
    about = KEYS.get(contract_name(key))
    if re.fullmatch(r"[A-Za-z_]+(-[A-Za-z_]+)*", value) or (
        about is not None and about.kind is Kind.TEXT and value[0] not in "\"'["
    ):
        return key, value
    remedy = "a number, a text in quotes or a list, e.g. [0.0, 1.0, 0.0]"
    if about is not None:
        remedy = f"the {about.meaning}, e.g. {about.example}"
    raise BadInput(key, value, "is not a TOML value", f"give {remedy}")


def _build(document: Mapping[str, Any], source: str) -> Scene:
    document = with_points(document, source)
    sections = read_sections(document)
    name = name_of(source, sections.title)
    said = {**vars(sections), "title": sections.title or one_line(name)}
    scene = Scene(name=name, source=source, own_keys=given_keys(document), **said)
    check_geometry(scene)
    check_known(scene)
    if registry.chosen_by(scene.model.energy).planar:
        reason = scene.nonplanar_reason()
        if reason is not None:
            raise BadInput(
                "model.energy", scene.model.energy, f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp'
            )
    if scene.path:
        _stage_scenes(scene.replace({"path": None}), scene.path)
    return scene


def _stage_scenes(scene: Scene, path: Sequence[StageSpec]) -> list[Scene]:
    """The scene of every stage on the way to `scene`; an error names the stage."""
    found = []
    for index, stage in enumerate(path):
        try:
            scene = scene.replace(stage)
        except BadInput as error:
            raise BadInput(stage_name(index, error.key), error.value, error.problem, error.remedy) from None
        found.append(scene)
    return found
