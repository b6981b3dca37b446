"""Scenes: what is simulated, as data. A TOML file, strictly read into a frozen dataclass.

`load` takes the name of a shipped scene or a path, `loads` a text; every fault raises `compare.errors.BadInput` naming
the key, its value and what would be right, before anything is computed. An absent section is an absent effect.

The attributes of `Scene` hold the values of the file in its own units. The derived, dimensionless numbers that the
solvers take (lengths in l, energies in D w / l; theory sheet, section 2; thesis 4.1) are properties: `width`,
`curvature`, `gamma`, `up`, `position`, `frame`.
"""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.scene_read import gamma_of, one_line, read_sections
from compare.scene_spec import (
    STANDARD_GRAVITY,
    ClampSpec,
    GravitySpec,
    ModelSpec,
    SeedSpec,
    ShellSpec,
    StripSpec,
)
from compare.scene_write import toml_text

__all__ = [
    "ClampSpec",
    "GravitySpec",
    "ModelSpec",
    "Scene",
    "SeedSpec",
    "ShellSpec",
    "StripSpec",
    "load",
    "loads",
    "parse_assignment",
    "shipped",
]

PLANAR_TOLERANCE = 1e-9
"""Largest component of the weight's direction along t_x for which a scene counts as planar."""

MAX_BYTES = 1_000_000
"""Size above which a file is not taken for a scene."""

EXCLUSIVE = (
    (("strip.gamma",), ("strip.young", "strip.density")),
    (("model.elements", "model.grading"), ("model.element_lengths",)),
)
"""Pairs of ways to say one thing; `Scene.replace` with one way drops the other."""


@dataclass(frozen=True)
class Scene:
    """One scene: a clamped strip, its loads, the ribbon's model and the shell runs beside it."""

    name: str
    title: str
    source: str
    strip: StripSpec
    gravity: GravitySpec | None
    clamp_start: ClampSpec
    clamp_end: None
    model: ModelSpec
    seed: SeedSpec
    shell: ShellSpec

    # -- dimensionless: l = 1, D = 1 ---------------------------------------------------------------------------------

    @property
    def width(self) -> float:
        """w / l."""
        return self.strip.width / self.strip.length

    @property
    def thickness(self) -> float | None:
        """h / l, or None when the scene gives no thickness."""
        return None if self.strip.thickness is None else self.strip.thickness / self.strip.length

    @property
    def curvature(self) -> tuple[float, float]:
        """Natural normal curvature times l, at s = 0 and at s = 1."""
        start, end = self.strip.natural_curvature
        return start * self.strip.length, end * self.strip.length

    @property
    def gamma(self) -> float:
        """Gamma = rho h g l^3 / D with D = Y h^3 / (12 (1 - nu^2)); 0.0 without gravity."""
        return 0.0 if self.gravity is None else gamma_of(self.strip, self.gravity.acceleration)

    @property
    def up(self) -> NDArray[np.float64] | None:
        """Unit vector against the weight, shape (3,), normalised to rounding; None without gravity."""
        return None if self.gravity is None else _normalised(self.gravity.up)

    @property
    def position(self) -> NDArray[np.float64]:
        """The clamped point in units of l, shape (3,)."""
        return np.array(self.clamp_start.position) / self.strip.length

    @property
    def frame(self) -> NDArray[np.float64]:
        """The clamped frame, 3x3 with columns t_x = t_y x t_z, t_y, t_z, orthonormal to rounding."""
        tangent = _normalised(self.clamp_start.tangent)
        given = np.array(self.clamp_start.normal)
        normal = _normalised(given - (given @ tangent) * tangent)
        return np.column_stack([np.cross(normal, tangent), normal, tangent])

    @property
    def seed_curvature(self) -> tuple[float, float]:
        """Curvature of the starting shape times l, at s = 0 and at s = 1 ("natural" resolved)."""
        if self.seed.curvature is None:
            return self.curvature
        return self.seed.curvature[0] * self.strip.length, self.seed.curvature[1] * self.strip.length

    # -- questions ---------------------------------------------------------------------------------------------------

    def nonplanar_reason(self) -> str | None:
        """Why the scene has no planar equilibrium (the load and clamp axis that break it), or None when it has one.

        The strip bends in the plane of t_y and t_z, with eta = 0, when the weight has no component along t_x.
        """
        up = self.up
        if up is None or self.gamma == 0.0:
            return None
        across = self.frame[:, 0]
        component = float(up @ across)
        if abs(component) <= PLANAR_TOLERANCE:
            return None
        axis = ", ".join(f"{c + 0.0:.4g}" for c in across)
        return (
            f"gravity.up has the component {component:.4g} along t_x = clamp.start.normal x clamp.start.tangent = "
            f"[{axis}], so the weight pulls the strip out of the plane of t_y and t_z"
        )

    def is_planar(self) -> bool:
        """True when a planar equilibrium (eta = 0) exists; it need not be the stable one."""
        return self.nonplanar_reason() is None

    def require_shell(self) -> tuple[float, ...]:
        """w/h of the shell runs that the scene asks for; `BadInput` when it gives no thickness at all."""
        if self.shell.width_to_thickness:
            return self.shell.width_to_thickness
        if self.strip.thickness is None:
            raise BadInput(
                "shell.width_to_thickness",
                None,
                "is missing and so is strip.thickness, but a shell has a thickness",
                "add [shell] with width_to_thickness = [20, 50, 100], or strip.thickness",
            )
        return (self.strip.width / self.strip.thickness,)

    def notes(self) -> tuple[str, ...]:
        """One line for every given value that has no effect on the result, so that none is ignored silently."""
        found = []
        if self.gravity is None and self.strip.gamma:
            found.append(
                f"strip.gamma = {self.strip.gamma} has no effect: there is no [gravity], the scene is weightless"
            )
        if self.gravity is None and self.strip.density is not None:
            found.append("strip.young and strip.density have no effect: there is no [gravity], the scene is weightless")
        if self.gravity is not None and self.strip.gamma is not None and self.gravity.acceleration != STANDARD_GRAVITY:
            found.append(
                f"gravity.acceleration = {self.gravity.acceleration} has no effect: strip.gamma gives the weight"
            )
        if self.shell.width_to_thickness and self.strip.thickness is not None:
            found.append(
                "strip.thickness is replaced by shell.width_to_thickness in the shell runs, with D and Gamma kept"
            )
        return tuple(found)

    # -- the scene as data -------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The scene as a nested dictionary of the contract's keys: what the scene says, defaults left out."""
        return {"title": self.title, **self._document(defaults=False)}

    def canonical(self) -> dict[str, Any]:
        """All that can influence the result, defaults filled in, ready for JSON and hashing.

        Name, title and source are left out.
        """
        return self._document(defaults=True)

    def to_toml(self) -> str:
        """TOML text with a comment on every key; `loads` gives back the same scene."""
        return toml_text(self.to_dict())

    def replace(self, keys: Mapping[str, Any]) -> Scene:
        """The scene with dotted keys replaced (None removes a key), e.g. `{"strip.gamma": 50.0}`, and checked again.

        A key that says the same thing in another way (gamma for young and density, elements for element_lengths)
        replaces it.
        """
        document = copy.deepcopy(self.to_dict())
        for pair in EXCLUSIVE:
            for one, other in (pair, pair[::-1]):
                if any(key in keys for key in one) and not any(key in keys for key in other):
                    for key in other:
                        _assign(document, key, None)
        for key, value in keys.items():
            _assign(document, key, _plain(value))
        return _build(document, self.source)

    def _document(self, defaults: bool) -> dict[str, Any]:
        strip, model, seed, shell = self.strip, self.model, self.seed, self.shell
        gravity: dict[str, Any] | None = None
        if self.gravity is not None:
            gravity = {
                "up": list(self.gravity.up),
                "acceleration": self.gravity.acceleration,
                "exact": self.gravity.exact,
            }
            if not defaults:
                _drop(gravity, {"acceleration": STANDARD_GRAVITY, "exact": False})
        clamp = {
            "position": list(self.clamp_start.position),
            "tangent": list(self.clamp_start.tangent),
            "normal": list(self.clamp_start.normal),
            "ruling": self.clamp_start.ruling,
        }
        discretisation: dict[str, Any] = {"elements": model.elements, "grading": model.grading}
        if model.element_lengths is not None:
            discretisation = {"element_lengths": list(model.element_lengths)}
        sections: dict[str, Any] = {
            "strip": {
                "length": strip.length,
                "width": strip.width,
                "thickness": strip.thickness,
                "poisson": strip.poisson,
                "natural_curvature": list(strip.natural_curvature),
                "gamma": strip.gamma,
                "young": strip.young,
                "density": strip.density,
            },
            "gravity": gravity,
            "clamp": {"start": clamp},
            "model": {"energy": model.energy, **discretisation, "formulation": model.formulation},
            "seed": {
                "curvature": "natural" if seed.curvature is None else list(seed.curvature),
                "ruling": list(seed.ruling),
            },
            "shell": {
                "width_to_thickness": list(shell.width_to_thickness) or None,
                "clamp": shell.clamp,
                "elements": None if shell.elements is None else list(shell.elements),
            },
        }
        return sections if defaults else _without_none(sections)


def shipped() -> dict[str, Path]:
    """The scenes that come with the package: name -> file, sorted by name."""
    folder = Path(__file__).parent / "scenes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load(name_or_path: str | Path) -> Scene:
    """Read a shipped scene by its name, or a scene file by its path."""
    available = shipped()
    path = available.get(str(name_or_path)) or Path(name_or_path)
    return loads(_file_text(path, available), str(path))


def loads(text: str, source: str = "<text>") -> Scene:
    """Read a scene from TOML text; `source` is where it came from, its stem becomes the scene's name."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(
            "scene", source, f"is not valid TOML: {error}", "mend that line; texts need quotes, numbers none"
        ) from None
    except (ValueError, RecursionError):
        raise BadInput(
            "scene", source, "is not valid TOML: a number or a nesting beyond all bounds", "mend it"
        ) from None
    return _build(document, source)


def parse_assignment(text: str) -> tuple[str, Any]:
    """`key=value` of a command line, e.g. `strip.gamma=50` -> ("strip.gamma", 50).

    The value is TOML; a bare word is a text.
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
    if re.fullmatch(r"[A-Za-z_]+", value):
        return key, value
    raise BadInput(key, value, "is not a TOML value", "give a number, a text in quotes or a list, e.g. [0.0, 1.0, 0.0]")


def _file_text(path: Path, available: Mapping[str, Path]) -> str:
    """The text of a scene file; every reason why there is none is a `BadInput`."""
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise BadInput("scene", str(path), f"is larger than {MAX_BYTES} bytes", "give a scene file")
        return raw.decode("utf-8-sig")
    except FileNotFoundError:
        close = get_close_matches(path.stem, available, n=1, cutoff=0.5)
        hint = f"did you mean {close[0]}? " if close else ""
        raise BadInput(
            "scene", str(path), "does not exist", f"{hint}give a path or one of {', '.join(available)}"
        ) from None
    except IsADirectoryError:
        raise BadInput(
            "scene", str(path), "is a folder", "give a scene file (.toml) or a shipped scene's name"
        ) from None
    except UnicodeDecodeError:
        raise BadInput("scene", str(path), "is not a text file (UTF-8)", "give a scene file in TOML") from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise BadInput("scene", str(path), f"cannot be read ({reason})", "check the path and its permissions") from None


def _build(document: Mapping[str, Any], source: str) -> Scene:
    sections = read_sections(document)
    name = Path(source).stem
    scene = Scene(
        name=name,
        title=sections.title or one_line(name),
        source=source,
        strip=sections.strip,
        gravity=sections.gravity,
        clamp_start=sections.clamp_start,
        clamp_end=None,
        model=sections.model,
        seed=sections.seed,
        shell=sections.shell,
    )
    if scene.model.energy == "elastica":
        reason = scene.nonplanar_reason()
        if reason is not None:
            raise BadInput(
                "model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp'
            )
    return scene


def _normalised(vector: Any) -> NDArray[np.float64]:
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


def _assign(document: dict[str, Any], key: str, value: Any) -> None:
    """Set (or, with None, remove) the dotted `key` of a nested dictionary, making the tables on the way."""
    *path, last = key.split(".")
    table = document
    for name in path:
        if value is None and name not in table:
            return
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            raise BadInput(key, value, f"is not a known key: {name} is a value, not a section", "check the dots")
    if value is None:
        table.pop(last, None)
    else:
        table[last] = value


def _plain(value: Any) -> Any:
    """A value as TOML would give it: tuples and arrays become lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, (tuple, list)) else value


def _drop(table: dict[str, Any], defaults: Mapping[str, Any]) -> None:
    """Remove the entries that equal their default."""
    for name, default in defaults.items():
        if table[name] == default:
            del table[name]


def _without_none(table: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _without_none(value) if isinstance(value, Mapping) else value
        for name, value in table.items()
        if value is not None
    }
