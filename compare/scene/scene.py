"""Scenes: what is simulated, as data. A TOML file, strictly read into a frozen dataclass.

`load` takes the name of a shipped scene or a path, `loads` a text; every fault raises `compare.errors.BadInput` naming
the key, its value and what would be right, before anything is computed. An absent section is an absent effect.

The attributes of `Scene` hold the values of the file in its own units. The derived, dimensionless numbers that the
solvers take (lengths in l, energies in D w / l; theory sheet, section 2; thesis 4.1) are properties: `width`,
`curvature`, `gamma`, `up`, `start_position`, `start_frame`, `end_position`, `end_frame`, `wall_points`, ...
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.scene.change import changed, document_of, given_keys
from compare.scene.check import beyond_the_shell, check_geometry, frame_of, unit
from compare.scene.loads import gamma_of, load_of
from compare.scene.planar import nonplanar_reason
from compare.scene.read import one_line, read_sections
from compare.scene.spec import (
    STANDARD_GRAVITY,
    ClampSpec,
    ClosureSpec,
    GravitySpec,
    ModelSpec,
    SeedSpec,
    ShellSpec,
    StageSpec,
    StripSpec,
    TipSpec,
    WallSpec,
)
from compare.scene.stages import stage_name
from compare.scene.toml import toml_text

__all__ = [
    "ClampSpec",
    "ClosureSpec",
    "GravitySpec",
    "ModelSpec",
    "Scene",
    "SeedSpec",
    "ShellSpec",
    "StageSpec",
    "StripSpec",
    "TipSpec",
    "WallSpec",
    "load",
    "loads",
    "parse_assignment",
    "shipped",
]

MAX_BYTES = 1_000_000
"""Size above which a file is not taken for a scene."""


@dataclass(frozen=True)
class Scene:
    """One scene: a strip, what holds and loads it, the ribbon's model, the way to the scene and the shell runs."""

    name: str
    title: str
    source: str
    strip: StripSpec
    gravity: GravitySpec | None
    tip: TipSpec | None
    clamp_start: ClampSpec | None
    clamp_end: ClampSpec | None
    closure: ClosureSpec | None
    walls: tuple[WallSpec, ...]
    model: ModelSpec
    seed: SeedSpec
    path: tuple[StageSpec, ...]
    shell: ShellSpec
    keys: frozenset[str] = field(default=frozenset(), compare=False, repr=False)
    """The dotted keys that the scene itself sets, without its path; see `given`."""

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
    def tip_load(self) -> float:
        """Load at s = 1 along -up in D w / l^2 (Y I / l^2 of a rod): M g l^2 / (Y I) of a mass M; 0.0 without [tip]."""
        if self.tip is None or self.gravity is None:
            return 0.0
        return load_of(self.tip, self.strip, self.gravity.acceleration)

    @property
    def up(self) -> NDArray[np.float64] | None:
        """Unit vector against the weight, shape (3,), normalised to rounding; None without gravity."""
        return None if self.gravity is None else unit(self.gravity.up)

    @property
    def start_position(self) -> NDArray[np.float64] | None:
        """The point held at s = 0 in units of l, shape (3,); None: not held."""
        return self._position(self.clamp_start)

    @property
    def start_frame(self) -> NDArray[np.float64] | None:
        """The frame held at s = 0, 3x3 with columns t_x = t_y x t_z, t_y, t_z, orthonormal to rounding, or None."""
        return frame_of(self.clamp_start)

    @property
    def end_position(self) -> NDArray[np.float64] | None:
        """The point held at s = length in units of l, shape (3,); None: not held."""
        return self._position(self.clamp_end)

    @property
    def end_frame(self) -> NDArray[np.float64] | None:
        """The frame held at s = length, as `start_frame`; None: not held."""
        return frame_of(self.clamp_end)

    @property
    def position(self) -> NDArray[np.float64]:
        """`start_position` of a scene whose start is fully clamped; `BadInput` for another one."""
        position = self.start_position
        if position is None or not self.start_clamped:
            raise self._start_not_clamped()
        return position

    @property
    def frame(self) -> NDArray[np.float64]:
        """`start_frame` of a scene whose start is fully clamped; `BadInput` for another one."""
        frame = self.start_frame
        if frame is None or not self.start_clamped:
            raise self._start_not_clamped()
        return frame

    @property
    def start_clamped(self) -> bool:
        """True when position and frame are held at s = 0."""
        return self.clamp_start is not None and self.clamp_start.holds_all

    @property
    def wall_points(self) -> NDArray[np.float64]:
        """A point of every wall in units of l, shape (walls, 3); of a pressure plate, where it rests."""
        return np.array([wall.point for wall in self.walls]).reshape(-1, 3) / self.strip.length

    @property
    def wall_normals(self) -> NDArray[np.float64]:
        """Unit normals of the walls towards the ribbon, shape (walls, 3), normalised to rounding."""
        return np.array([unit(wall.normal) for wall in self.walls]).reshape(-1, 3)

    @property
    def seed_curvature(self) -> tuple[float, ...]:
        """Curvature of the starting shape times l ("natural" resolved) at equal distances from s = 0 to s = 1.

        Two values or more; linear in between.
        """
        if self.seed.curvature is None:
            return self.curvature
        return tuple(value * self.strip.length for value in self.seed.curvature)

    def _position(self, clamp: ClampSpec | None) -> NDArray[np.float64] | None:
        if clamp is None or clamp.position is None:
            return None
        return np.array(clamp.position) / self.strip.length

    def _start_not_clamped(self) -> BadInput:
        return BadInput(
            "clamp.start",
            None,
            "does not hold position and frame, which this needs",
            "add [clamp.start] with position, tangent and normal",
        )

    @property
    def shell_corner(self) -> float | None:
        """Size of the shell's held corner cells in units of l; None: one cell of its mesh."""
        return None if self.shell.corner is None else self.shell.corner / self.strip.length

    @property
    def shell_edge_layer(self) -> float | str | None:
        """Width in units of l of the layer at the shell's clamps and edges, or "auto"; None: the mesh is graded."""
        layer = self.shell.edge_layer
        return layer if layer is None or isinstance(layer, str) else layer / self.strip.length

    @property
    def shell_start_curvature(self) -> float | None:
        """Curvature times l of the arc where the shell's path begins; None: not said."""
        curvature = self.shell.start_curvature
        return None if curvature is None else curvature * self.strip.length

    # -- questions ---------------------------------------------------------------------------------------------------

    def nonplanar_reason(self) -> str | None:
        """What leaves the plane of t_y and t_z (clamp or load, with its component), or else keeps the planar elastica
        from the scene; None when it can be asked."""
        return nonplanar_reason(self)

    def is_planar(self) -> bool:
        """True when a planar equilibrium (eta = 0) exists; it need not be the stable one."""
        return self.nonplanar_reason() is None

    def require_shell(self) -> tuple[float, ...]:
        """w/h of the shell runs that the scene asks for.

        `BadInput` when it gives no thickness at all, or holds the strip as the shell cannot.
        """
        beyond = beyond_the_shell(self)
        if beyond is not None:
            raise BadInput(beyond[0], None, beyond[1], "use ribbonbench solve")
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

    def has_shell(self) -> bool:
        """True when the scene gives what its shell needs: a thickness, and clamps that the shell can hold."""
        thick = self.shell.width_to_thickness or self.strip.thickness is not None
        return bool(thick) and beyond_the_shell(self) is None

    def notes(self) -> tuple[str, ...]:
        """One line for every given value that has no effect on the result, so that none is ignored silently."""
        found = []
        if self.model.held_by != "elimination" and self.clamp_start is None:
            found.append(f'model.held_by = "{self.model.held_by}" has no effect: there is no [clamp.start]')
        if self.gravity is None and self.strip.gamma:
            found.append(
                f"strip.gamma = {self.strip.gamma} has no effect: there is no [gravity], the scene is weightless"
            )
        if self.gravity is None and self.strip.density is not None:
            found.append("strip.young and strip.density have no effect: there is no [gravity], the scene is weightless")
        if self.strip.second_moment is not None and self.tip is None:
            found.append("strip.young and strip.second_moment have no effect: there is no [tip], the rod is weightless")
        if self.gravity is not None and self.strip.gamma is not None and self.gravity.acceleration != STANDARD_GRAVITY:
            found.append(
                f"gravity.acceleration = {self.gravity.acceleration} has no effect: strip.gamma gives the weight"
            )
        if self.shell.width_to_thickness and self.strip.thickness is not None:
            found.append(
                "strip.thickness is replaced by shell.width_to_thickness in the shell runs, with D and Gamma kept"
            )
        if self.shell.clamp == "corners" and self.shell.corner is None:
            found.append(
                'shell.clamp = "corners" without shell.corner holds one cell of the mesh at each corner: the shell\'s '
                "results then depend on the mesh"
            )
        return tuple(found)

    def given(self) -> frozenset[str]:
        """The dotted keys that the scene sets, be it to their default, as `KEYS` names them: a key of any wall is
        "wall.stiffness", a path gives "path" and every key that its stages set. Without the title and `across`."""
        return self.keys.union(*({"path", *given_keys(stage)} for stage in self.path))

    # -- the scene as data -------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The scene as a nested dictionary of the contract's keys: what the scene says (`given`), and its title."""
        return {"title": self.title, **document_of(self, defaults=False)}

    def canonical(self) -> dict[str, Any]:
        """All that can influence the result, defaults filled in, ready for JSON and hashing.

        Name, title and source are left out.
        """
        return document_of(self, defaults=True)

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


def shipped() -> dict[str, Path]:
    """The scenes that come with the package: name -> file, sorted by name."""
    folder = Path(__file__).parent.parent / "scenes"
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
        tip=sections.tip,
        clamp_start=sections.clamp_start,
        clamp_end=sections.clamp_end,
        closure=sections.closure,
        walls=sections.walls,
        model=sections.model,
        seed=sections.seed,
        path=sections.path,
        shell=sections.shell,
        keys=given_keys(document),
    )
    check_geometry(scene)
    if scene.model.energy == "elastica":
        reason = scene.nonplanar_reason()
        if reason is not None:
            raise BadInput(
                "model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp'
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
