"""The stages of `[[path]]`: which keys each of them changes, flattened to dotted keys and checked against the contract.

Whether the scene of a stage is a good one is checked by building it (`compare.scene`).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from compare.scene import keys as contract
from compare.scene.change import known_walls, plain, wall_index
from compare.scene.spec import ObstacleSpec, StageSpec, WallSpec
from compare.scene.table import Table, brief
from ribbonbench.errors import BadInput

Named = Mapping[str, Sequence[WallSpec | ObstacleSpec]]
"""The walls and obstacles of a scene, by section."""
Names = Mapping[str, list[str | None]]
"""Their names; None: one without."""


def read_path(data: Any, named: Named) -> tuple[StageSpec, ...]:
    """The stages in order: `data` is what stands at `path`, `named` are the scene's walls and obstacles, whose names
    keys may contain."""
    if not isinstance(data, list) or not all(isinstance(entry, Mapping) for entry in data):
        raise BadInput("path", None, "is not an array of tables", "write every stage as a section [[path]]")
    names = {section: [one.name for one in entries] for section, entries in named.items()}
    return tuple(_stage(entry, index, names) for index, entry in enumerate(data))


def stage_name(index: int, key: str = "") -> str:
    """How errors name stage `index` (from 0), or a dotted key in it."""
    return f"path[{index}].{key}" if key else f"path[{index}]"


def _stage(data: Mapping[str, Any], index: int, names: Names) -> StageSpec:
    steps = None
    if "steps" in data:
        path = stage_name(index)
        steps = Table(data, path, {f"{path}.steps": contract.KEYS["path.steps"]}).value("steps")
        if index == 0:
            raise BadInput(
                f"{path}.steps",
                steps,
                "counts the steps from the stage before, and this is the first: it is reached from the seed",
                "remove it, or write it into the stage after",
            )
    changes: dict[str, Any] = {}
    resolved: dict[str, str] = {}  # the key with a wall's name replaced by its number -> the key as given
    for key, value in _flattened({name: value for name, value in data.items() if name != "steps"}, "", index):
        known = _resolved(key, value, index, names)
        if known in resolved:
            raise BadInput(
                stage_name(index, key),
                brief(value),
                f"is given twice (as {resolved[known]} too)",
                "remove one of the two",
            )
        resolved[known] = key
        changes[key] = frozen(value)
    for section in contract.SECTIONS:
        inside = [key for key in changes if key.startswith(section + ".")]
        if section in changes and inside:
            raise BadInput(
                stage_name(index, inside[0]),
                changes[inside[0]],
                f"conflicts with {section} = false in the same stage",
                "remove one of the two",
            )
    if not changes:
        raise BadInput(
            stage_name(index), None, "changes no key", 'add one, e.g. "clamp.end.position" = [0.0, 0.0, 0.9]'
        )
    return StageSpec(tuple(changes.items()), steps)


def _flattened(data: Mapping[str, Any], prefix: str, index: int) -> Iterator[tuple[str, Any]]:
    """Dotted key and value of every entry, tables (inline or made by dots without quotes) taken apart."""
    for name, value in data.items():
        key = f"{prefix}{name}"
        if isinstance(value, Mapping):
            if key.count(".") > contract.DEEPEST:
                raise BadInput(stage_name(index, key), None, "is not a known key", _suggestion(key))
            if not value:
                raise BadInput(
                    stage_name(index, key), None, "is an empty table", "give it keys, or false to leave it out"
                )
            yield from _flattened(value, f"{key}.", index)
        else:
            yield key, value


def _resolved(key: str, value: Any, index: int, names: Names) -> str:
    """The key with a wall's name replaced by its number, once it is clear that a stage may change it."""
    section, _, rest = key.partition(".")
    shown = stage_name(index, key)
    if section in contract.FIXED_ON_PATH:
        raise BadInput(
            shown, brief(value), "cannot change along a path", f"remove it from the stage: {section} is fixed"
        )
    known = key
    about = key
    if section in contract.LISTED:
        name, _, last = rest.partition(".")
        number = wall_index(names[section], name)
        article = "an" if section == "obstacle" else "a"
        if number is None:
            problem = f"is about {article} {section} that the scene does not have"
            raise BadInput(shown, brief(value), problem, known_walls(names[section], section))
        known, about = f"{section}.{number}.{last}", f"{section}.{last}"
        if about == f"{section}.name":
            remedy = f"remove it: {article} {section} keeps its name"
            raise BadInput(shown, brief(value), "cannot change along a path", remedy)
    if key in contract.SECTIONS:
        if value is not False:
            raise BadInput(
                shown,
                brief(value),
                "is a section",
                f"give false to leave it out in this stage, or its keys ({key}. ...)",
            )
    elif about not in contract.KEYS:
        raise BadInput(shown, brief(value), "is not a known key", _suggestion(about))
    return known


def _suggestion(key: str) -> str:
    fixed = contract.FIXED_ON_PATH
    changeable = [*contract.SECTIONS, *(known for known in contract.KEYS if known.partition(".")[0] not in fixed)]
    inside = [known for known in changeable if known.startswith(f"{key}.")]
    close = inside[:1] or difflib.get_close_matches(key, changeable, n=1, cutoff=0.6)
    ending = [known for known in changeable if known.rpartition(".")[2] == key.rpartition(".")[2]]
    if close or ending:
        return f"did you mean {(close or ending)[0]}?"
    return 'give the dotted key of a section, e.g. "clamp.end.position" = [0.0, 0.0, 0.9]'


def frozen(value: Any) -> Any:
    """Lists as tuples, so that a stage can be compared and hashed."""
    return tuple(frozen(item) for item in value) if isinstance(value, list) else value


def stages_without(stages: Sequence[StageSpec], keys: Sequence[str]) -> list[dict[str, Any]]:
    """The stages, as `Scene.replace` takes them, without what they say in or under the dotted `keys`; those that say
    nothing more are left out, and the first that is left counts no steps: it is reached from the seed."""
    kept: list[dict[str, Any]] = []
    for stage in stages:
        left = {
            name: plain(value)
            for name, value in stage.changes
            if not any(name == key or name.startswith(f"{key}.") for key in keys)
        }
        if left:
            kept.append({**left, "steps": stage.steps} if stage.steps is not None and kept else left)
    return kept
