"""What only one model says, draws and writes: a `Presenter`, of which a model's page gives as much as it has.

A model names its own by text (`compare.models.base.Model.presenter`, ``module:NAME``) and does not import it: what is
kept of a model does not depend on how it is shown.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.measure.grid import Grid
from compare.models import model
from compare.models.base import Model, State
from compare.pages.written import Written, write_any
from compare.scene.scene import Scene
from compare.scene.units import Units
from ribbonbench.errors import BadInput

Effects = Sequence[Mapping[str, Any]]


def _none(effects: Effects, without: Mapping[str, Any]) -> dict[str, Any]:
    return {}


def _silent(scene: Scene) -> str:
    return ""


def _has_one(scene: Scene) -> BadInput | None:
    return None


def _unasked(state: State, units: Units) -> str:
    return ""


@dataclass(frozen=True)
class Presenter:
    """rows and sentences: what `ribbonbench solve` prints (None: what every state has); write: its files and pictures;
    explained: keys of the result.json of `explain`, from effects and solves without each; undetermined: what there is
    to say where the forces are not; chosen: which energy was, in words of the first line; no_surface: why there is
    nothing to export (None: there is)."""

    rows: Callable[[Scene, State, Units | None], Sequence[tuple[str, str]]] | None = None
    sentences: Callable[[Scene, State], Sequence[str]] | None = None
    write: Callable[[Path, Scene, State, Grid], Written] = write_any
    explained: Callable[[Effects, Mapping[str, Any]], Mapping[str, Any]] = _none
    undetermined: Callable[[Scene], str] = _silent
    chosen: Callable[[State, Units], str] = _unasked
    no_surface: Callable[[Scene], BadInput | None] = _has_one


def presenter(state: State) -> Presenter:
    """Of the model that a state is of."""
    return presenter_of(model(state.model))


def presenter_of(found: Model) -> Presenter:
    """Of a model, before it has solved anything. Raises TypeError where what it names is none."""
    if found.presenter is None:
        return Presenter()
    module, _, name = found.presenter.partition(":")
    own = vars(importlib.import_module(module)).get(name)
    if not isinstance(own, Presenter):
        raise TypeError(f"the model {found.name} names {found.presenter}, which is no Presenter")
    return own
