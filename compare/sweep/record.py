"""The record of a sweep's rows: the columns of cases.csv, from those of a state, of a shell beside it, and its own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from compare.models.base import State
from compare.models.choice import beside_the_shell
from compare.page import force_displacement
from compare.page.pair import PAIR, PLANAR, Row
from compare.page.state import NUMBER, STATE, vector
from compare.record.quantity import Part, Quantity, pick, plainly
from compare.record.views import columns_of
from compare.sweep.case import COMPARE
from compare.sweep.file import Sweep
from compare.sweep.finished import Case
from compare.sweep.row import NOT_OF_ROWS, OF_ROWS, quantities_of_rows


@dataclass(frozen=True)
class Placed:
    """A row in the grid: its case, and on which branch it lies; None: not known."""

    case: Case
    branch: int | None


#: What the grid says of a row.
OF_GRID: tuple[Quantity[Placed], ...] = (
    Quantity("case", kind="integer", note="number of the case, from 0", of=lambda p: p.case.point.number),
    Quantity("gamma", kind=NUMBER, note="Gamma of the scene", of=lambda p: p.case.point.scene.gamma),
    Quantity("width", unit="l", kind=NUMBER, note="w / l", of=lambda p: p.case.point.scene.width),
    Quantity("branch", kind="integer", of=lambda p: p.branch,
             note="1: on that of most neighbours; 2, ...: on another; empty: not known"),
    Quantity("warm", kind="integer", of=lambda p: p.case.warm,
             note="case from whose state it was begun; empty: from its own start"),
    Quantity("seconds", unit="s", kind=NUMBER, note="of the whole case", of=lambda p: p.case.record["seconds"]),
    Quantity("message", kind="word", of=lambda p: p.case.record["message"]),
)  # fmt: skip


_SHELL_END, _SHARE = pick(PAIR, "shell_end", "share")
#: What a row has of the case, or of the model beside the shell, or what cases.csv goes without.
_NOT_OF_PAIR = ("status", "energy", "share", "shell_errors", PLANAR.key, "start", "ratio")
#: What the row of a comparison says beside that of its model.
OF_PAIR: tuple[Quantity[Row], ...] = (
    *plainly((quantity for quantity in PAIR if quantity.columns and quantity.key not in _NOT_OF_PAIR), NUMBER),
    replace(_SHELL_END, kind=NUMBER, parts=vector("position", "shell_end")),
    replace(_SHARE, kind=NUMBER, parts=(
        Part("bending"), Part("membrane", note="part of the shell's elastic energy"), Part("shear", note="the same"))),
)  # fmt: skip
#: What it says of the model beside the shells.
OF_FAST: tuple[Quantity[State], ...] = (
    Quantity("ribbon.status", kind="word", note="with `compare`: of the ribbon", of=lambda s: s.word),
    Quantity("ribbon.stable", kind="truth", note="the same", of=lambda s: s.stable),
)  # fmt: skip

#: The order of cases.csv.
_ORDER: tuple[Quantity[Any], ...] = (
    *pick(OF_GRID, "case", "gamma", "width"),
    *pick(OF_PAIR, "width_to_thickness"),
    *pick(STATE, "status", "stable"),
    *pick(OF_GRID, "branch"),
    *pick(STATE, "branch"),
    *pick(OF_GRID, "warm"),
    *pick(STATE, "left_saddle"),
    *OF_FAST,
    *pick(OF_PAIR, "hausdorff", "centreline", "ribbon_error", "shell_error", "same_state", "claimed"),
    *pick(STATE, "residual", "iterations"),
    *pick(OF_ROWS, "segments", "elements"),
    *pick(STATE, "lowest_eigenvalue", "max_abs_eta", "max_abs_tau", "energy"),
    *pick(OF_PAIR, "share"),
    *pick(STATE, "end", "middle"),
    *pick(OF_PAIR, "shell_end"),
    *pick(OF_ROWS, "y_over_x"),
    *pick(STATE, "forces", "moments"),
    *force_displacement.CURVE,
    *pick(STATE, "forces_why", "discretisation_error", "forces_error", "moments_error", "energy_error",
          "lowest_eigenvalue_error"),
    *pick(OF_PAIR, "seconds.ribbon", "seconds.shell"),
    *pick(OF_GRID, "seconds"),
)  # fmt: skip


def _others(order: tuple[Quantity[Any], ...], more: Iterable[Quantity[Any]]) -> tuple[Quantity[Any], ...]:
    """Those of `more` whose columns are not there yet."""
    known = {column.key for column in columns_of(order)}
    return tuple(one for one in more if one.columns and not known & {column.key for column in one.columns})


_REST = (quantity for quantity in (*STATE, *OF_ROWS) if quantity.key not in NOT_OF_ROWS)
#: The rows of a sweep: what has no place in the order, behind the others.
RUN: tuple[Quantity[Any], ...] = (*_ORDER, *_others(_ORDER, (*_REST, *OF_PAIR)), *pick(OF_GRID, "message"))


def run_of(sweep: Sweep) -> tuple[Quantity[Any], ...]:
    """The record of the rows of a sweep: with what its own model adds."""
    name = beside_the_shell(sweep.scene).name if sweep.solver == COMPARE else sweep.solver
    return (*RUN[:-1], *_others(RUN, quantities_of_rows(name)), RUN[-1])
