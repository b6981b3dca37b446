"""Where a scene comes from: a shipped scene, a file, or the standard input; every reason why there is none is a
`BadInput` that names what is near."""

from __future__ import annotations

import re
import sys
import unicodedata
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from ribbonbench.errors import BadInput

MAX_BYTES = 1_000_000
"""Size above which a file is not taken for a scene."""

STDIN = "-"
"""What stands for the standard input where a scene is named."""

STDIN_SOURCE = "<stdin>"
"""`Scene.source` of what was read there."""

_SLUG = 40
"""Letters of a title that make the name of a scene without a file, at most."""


def shipped() -> dict[str, Path]:
    """The scenes that come with the package: name -> file, sorted by name."""
    folder = Path(__file__).parents[2] / "scenes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def shipped_strips() -> dict[str, Path]:
    """The scenes of several strips that come with the package: name -> file, sorted by name."""
    folder = Path(__file__).parents[2] / "scenes" / "strips"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def text_of_shipped(name: str) -> str:
    """The text of a shipped scene; `BadInput` for a name that none has, with the nearest ones."""
    found = {**shipped(), **shipped_strips()}
    if name not in found:
        hint = did_you_mean(name, found)
        raise BadInput("NAME", name, "is no shipped scene", f"{hint}ribbonbench scenes lists them")
    return found[name].read_text(encoding="utf-8")


def text_of(name_or_path: str | Path) -> tuple[str, str]:
    """Text and source of a shipped scene by its name, of a file by its path, or of the standard input ("-")."""
    if str(name_or_path) == STDIN:
        return _text_of_stdin(), STDIN_SOURCE
    available = {**shipped(), **shipped_strips()}
    path = available.get(str(name_or_path)) or Path(name_or_path)
    return _text_of_file(path), str(path)


def name_of(source: str, title: str) -> str:
    """The name of a scene: of its file, without the ending; without a file of its title: "my_strip", or "stdin"."""
    if source != STDIN_SOURCE:
        return Path(source).stem
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_")[:_SLUG].strip("_") or "stdin"


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """ "did you mean x? " with the two nearest of `names`, or "" where none is near."""
    close = get_close_matches(name, list(names), n=2, cutoff=0.6)
    return f"did you mean {' or '.join(close)}? " if close else ""


def near(path: Path) -> str:
    """`did_you_mean` for a scene's file that is not there: TOML files of its folder, shipped scenes."""
    try:
        beside = {str(found) for found in path.parent.glob("*.toml")}
    except OSError:
        beside = set()
    stems = {Path(found).stem: found for found in sorted(beside)} | {name: name for name in shipped()}
    close = get_close_matches(path.stem, stems, n=2, cutoff=0.6)
    own = [stems[name] for name in close]
    return f"did you mean {' or '.join(own)}? " if own else ""


def _text_of_stdin() -> str:
    """What stands in the standard input; of several processes (mpirun) the first reads, and tells the others."""
    from ribbonbench.world import world

    return world().on_first(_read_stdin)


def _read_stdin() -> str:
    if sys.stdin is None:
        raise BadInput("scene", STDIN, "is the standard input, which is closed", "give a file, or < my.toml")
    if sys.stdin.isatty():
        print("ribbonbench: reading the scene from the keyboard; ctrl-D ends it", file=sys.stderr)
    raw = sys.stdin.buffer.read(MAX_BYTES + 1)
    if not raw.strip():
        raise BadInput("scene", STDIN, "is the standard input, and nothing stands there", "give a file, or < my.toml")
    return _decoded(raw, "standard input")


def _decoded(raw: bytes, where: str) -> str:
    if len(raw) > MAX_BYTES:
        raise BadInput("scene", where, f"is larger than {MAX_BYTES} bytes", "give a scene file")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput("scene", where, "is not a text file (UTF-8)", "give a scene file in TOML") from None


def _text_of_file(path: Path) -> str:
    """The text of a scene file."""
    try:
        with path.open("rb") as file:
            return _decoded(file.read(MAX_BYTES + 1), str(path))
    except FileNotFoundError:
        raise BadInput(
            "scene", str(path), "does not exist",
            f"{near(path)}give a TOML file (ribbonbench new makes one) or a shipped scene (ribbonbench scenes)",
        ) from None  # fmt: skip
    except IsADirectoryError:
        raise BadInput(
            "scene", str(path), "is a folder", "give a scene file (.toml) or a shipped scene's name"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise BadInput("scene", str(path), f"cannot be read ({reason})", "check the path and its permissions") from None
