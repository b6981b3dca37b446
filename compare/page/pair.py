"""The record of a row: a shell beside another model, as result.json and every table of such rows hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from compare.measure.align import Alignment
from compare.models.base import Energy
from compare.models.same_state import Counterpart
from compare.record.quantity import ABSENT, DATA, Part, Quantity

FORCE, MOMENT, ENERGY = "D w / l^2", "moment", "D w / l"


@dataclass(frozen=True)
class Times:
    """Seconds of one solve of the model beside the shell and of the shell; None: not known."""

    ribbon: float | None
    shell: float | None


@dataclass(frozen=True)
class Row:
    """A shell run beside the ribbon. Lengths in l, energies in D w / l, times in s; None where there is no surface.

    hausdorff, centreline: distances between the models; ribbon_error, shell_error: of the discretisations (Hausdorff);
    claimed: the distance exceeds the sum of the errors; energy: the shell's (without the constant of the natural
    curvature, like every model's); share: of its elastic energy, the constant included; elastica: distance of the
    shell's centreline to the elastica's, in planar scenes; start: how the shell's solve began; begun_again: what came
    of beginning it once more at the surface beside it (`compare.studies.compare.lower_state`), "" where it was not;
    share_error: change of the shares of membrane and shear on the mesh that tells its error, where one was solved;
    same_state: whether the shell rests in the state that is beside it, None: not known, or no shell; same_why: how that
    was found; counterpart: where the model beside comes to rest from the shell's shape, where that is another state
    than its own; shell_errors: of the shell's forces, moments, energies and lowest eigenvalue (`State.errors`);
    shell_walls: what each wall
    exerts on the shell, force, moment about the origin, gap, mean and greatest pressure, each with its error
    (None: not known); shell_contacts:
    where parts of the shell push each other (None: they are not kept apart): the force of those at larger S on the
    others with its error, the number of pairs, and the pairs; `claimed` is of one
    state only; laid: how the ribbon was moved before distances were taken, where nothing resists
    that; warm: the ribbon's time is of repeated solves, with all loaded, as the shell's always is without its imports
    and compilation; searched: it holds a search for segments.
    """

    width_to_thickness: float
    status: str
    stable: bool | None
    message: str
    hausdorff: float | None
    centreline: float | None
    ribbon_error: float | None
    shell_error: float | None
    claimed: bool
    energy: Energy | None
    share: dict[str, float] | None
    shell_end: dict[str, Any] | None
    shell_middle: dict[str, Any] | None
    seconds: Times
    elements: tuple[int, int]
    newton_iterations: int | None
    reused: bool
    same_state: bool | None
    same_why: str
    counterpart: Counterpart | None = None
    shell_forces: Mapping[str, Any] = field(default_factory=dict)
    shell_moments: Mapping[str, Any] = field(default_factory=dict)
    shell_walls: tuple[Mapping[str, Any], ...] = ()
    shell_contacts: Mapping[str, Any] | None = None
    shell_errors: Mapping[str, Any] = field(default_factory=dict)
    elastica: float | None = None
    start: str = "path"
    begun_again: str = ""
    share_error: float | None = None
    laid: Alignment | None = None
    warm: bool = field(kw_only=True)
    searched: bool = field(kw_only=True)

    @property
    def ratio(self) -> float | None:
        """How many times longer the shell takes than the ribbon, like for like: the faster one at least as exact as the
        other, so that at one error the factor is no smaller. None where `unlike` says why not."""
        ribbon, shell = self.seconds.ribbon, self.seconds.shell
        return None if not ribbon or shell is None or self.unlike is not None else shell / ribbon

    @property
    def unlike(self) -> str | None:
        """Why the times are not compared: "error" (one is not known), "first" (of the ribbon a first solve only),
        "exact" (the faster one is less exact), "search" (the ribbon is slower, but searches its segments); None."""
        ribbon, shell = self.seconds.ribbon, self.seconds.shell
        if self.ribbon_error is None or self.shell_error is None:
            return "error"
        if not self.warm:
            return "first"
        quicker = ribbon is not None and shell is not None and ribbon <= shell
        less, more = (self.ribbon_error, self.shell_error) if quicker else (self.shell_error, self.ribbon_error)
        if less > more:
            return "exact"
        return "search" if self.searched and not quicker else None


def _energy(row: Row) -> dict[str, Any] | None:
    """The shell's energy in the convention of every model, with the constant that is left out beside it."""
    if row.energy is None:
        return None
    parts = {**row.energy.to_dict(), "constant": row.energy.constant}
    return {name: None if value is None else value + 0.0 for name, value in parts.items()}  # + 0.0: no -0


#: In planar scenes alone.
PLANAR: Quantity[Row] = Quantity(
    "elastica", "to elastica", "l", "exponent:2", legend="distance of the centreline to the elastica's",
    of=lambda r: r.elastica,
)  # fmt: skip

PAIR: tuple[Quantity[Row], ...] = (
    Quantity("width_to_thickness", "w/h", kind="digits", rank=0, note="w/h", of=lambda r: r.width_to_thickness),
    Quantity("status", "shell", kind="word", rank=3, note="of the shell", of=lambda r: r.status),
    Quantity("stable", kind=DATA, of=lambda r: r.stable),
    Quantity("message", kind=DATA, of=lambda r: r.message),
    Quantity("hausdorff", "distance", "l", "exponent:2", 1, "symmetric Hausdorff distance of the surfaces",
             of=lambda r: r.hausdorff),
    Quantity("centreline", "centreline", "l", "exponent:2", legend="largest distance at equal s",
             of=lambda r: r.centreline),
    Quantity("ribbon_error", "ribbon error", "l", "exponent:1", 2, "of the discretisation, by refinement",
             of=lambda r: r.ribbon_error),
    Quantity("shell_error", "shell error", "l", "exponent:1", 2, "the same of the shell", of=lambda r: r.shell_error),
    Quantity("claimed", "models differ", kind="truth", words={"false": "not shown"}, rank=1,
             legend="the distance exceeds the sum of both errors, both in one state", of=lambda r: r.claimed),
    Quantity("energy", unit=ENERGY, kind="digits:6", rank=6, of=_energy, parts=(
        Part("elastic", "elastic", note="without the constant of the natural curvature"),
        Part("gravity", "gravity"), Part("total", "total"))),
    Quantity("share", kind="share", of=lambda r: r.share, parts=(
        Part("membrane", "membrane_share", "membrane %", rank=3, note="part of the shell's elastic energy"),
        Part("shear", "shear_share", "shear %", rank=6, note="the same"))),
    Quantity("shell_end", unit="l", kind=DATA, of=lambda r: r.shell_end),
    Quantity("shell_middle", unit="l", kind=DATA, of=lambda r: r.shell_middle),
    Quantity("shell_forces", unit=FORCE, kind=DATA, of=lambda r: r.shell_forces),
    Quantity("shell_moments", unit=MOMENT, kind=DATA, of=lambda r: r.shell_moments),
    Quantity("shell_walls", kind=DATA, of=lambda r: list(r.shell_walls)),
    Quantity("shell_contacts", kind=DATA, of=lambda r: ABSENT if r.shell_contacts is None else dict(r.shell_contacts)),
    Quantity("seconds.ribbon", "ribbon s", "s", "seconds:2", name="seconds_ribbon", note="a warm solve",
             of=lambda r: r.seconds.ribbon),
    Quantity("seconds.shell", "shell s", "s", "seconds:3", 4, name="seconds_shell", note="a solve, compilation apart",
             of=lambda r: r.seconds.shell),
    Quantity("elements", kind=DATA, of=lambda r: r.elements),
    Quantity("newton_iterations", kind=DATA, of=lambda r: r.newton_iterations),
    Quantity("reused", kind=DATA, of=lambda r: r.reused),
    Quantity("same_state", "state", kind="truth", words={"true": "the same", "false": "another"}, rank=1,
             legend="whether both are in one state: the shell settled at the ribbon's surface, or the ribbon, begun at "
             "the shell's shape, comes back; elsewhere the distance is none between models", of=lambda r: r.same_state),
    Quantity("same_why", kind=DATA, of=lambda r: r.same_why),
    Quantity("counterpart", kind=DATA, of=lambda r: r.counterpart),
    Quantity("shell_errors", kind="exponent:1", of=lambda r: r.shell_errors, parts=(
        Part("energy.elastic", "elastic_error", "elastic error", unit=ENERGY,
             legend="of the shell's, by its own change"),
        Part("energy.gravity", "gravity_error", "gravity error", unit=ENERGY, note="the same"),
        Part("energy.total", "total_error", "total error", unit=ENERGY, note="the same"))),
    PLANAR,
    Quantity("start", "start", kind="word", rank=6, of=lambda r: r.start,
             legend="where the shell's solve began, its path or the ribbon's surface (it then settles at the full "
             "load, and may be checked by the path on a coarse mesh)"),
    Quantity("begun_again", kind=DATA, of=lambda r: r.begun_again),
    Quantity("share_error", kind=DATA, of=lambda r: r.share_error),
    Quantity("laid", kind=DATA, of=lambda r: r.laid),
    Quantity("warm", kind=DATA, of=lambda r: r.warm),
    Quantity("searched", kind=DATA, of=lambda r: r.searched),
    Quantity("ratio", "ratio", kind="digits:3", rank=4, legend="shell time over ribbon time", of=lambda r: r.ratio),
)  # fmt: skip
