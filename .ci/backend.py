"""setuptools' build backend on a copy of the tree: a wheel leaves no build/ and no egg-info behind.

An editable installation is made in place, since its files are those of the tree.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from setuptools import build_meta

get_requires_for_build_wheel = build_meta.get_requires_for_build_wheel
get_requires_for_build_sdist = build_meta.get_requires_for_build_sdist
get_requires_for_build_editable = build_meta.get_requires_for_build_editable

#: What a distribution is made from.
PARTS = (
    "pyproject.toml", "README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "ribbonbench", "ribbon", "shellref",
    "compare", ".ci/backend.py",
)  # fmt: skip


@contextlib.contextmanager
def _copy() -> Iterator[None]:
    """The current folder is a copy of the parts of the tree."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="ribbonbench-build-") as place:
        for part in PARTS:
            source, target = here / part, Path(place, part)
            target.parent.mkdir(exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            elif source.is_file():
                shutil.copy2(source, target)
        Path(place, "MANIFEST.in").write_text("include .ci/backend.py CITATION.cff CHANGELOG.md\n")
        os.chdir(place)
        try:
            yield
        finally:
            os.chdir(here)


def build_editable(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """The tree on the path, by a file .pth: a mere folder of a user's called `compare` or `ribbon` does not hide a
    package that stands on the path. It hides one that setuptools' own finder gives, which is asked last."""
    return build_meta.build_editable(folder, {**(settings or {}), "editable_mode": "compat"}, metadata)


def prepare_metadata_for_build_wheel(folder: str, settings: Any = None) -> str:
    with _copy():
        return build_meta.prepare_metadata_for_build_wheel(os.path.abspath(folder), settings)


def prepare_metadata_for_build_editable(folder: str, settings: Any = None) -> str:
    with _copy():
        return build_meta.prepare_metadata_for_build_editable(os.path.abspath(folder), settings)


def build_wheel(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    with _copy():
        return build_meta.build_wheel(folder, settings, metadata)


def build_sdist(folder: str, settings: Any = None) -> str:
    with _copy():
        return build_meta.build_sdist(folder, settings)
