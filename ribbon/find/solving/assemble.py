"""From a request to its minimisation problem, in the formulation that fits."""

from __future__ import annotations

from dataclasses import replace

from ribbon import law
from ribbon.element import quaternion
from ribbon.errors import RibbonInputError
from ribbon.find import stretched
from ribbon.find.solving import check
from ribbon.find.solving.request import Request
from ribbon.problems import formulation
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solvers import choose

#: Quaternion at s = 0 where no clamp holds a frame.
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def assembled(request: Request) -> Problem:
    """The minimisation problem of a request.

    `RibbonInputError` for what contradicts itself, or is beyond what the models are known to work for."""
    check.numbers(request)
    lengths = request.lengths
    for one in request.strip.rest:
        lengths = law.cut(one, lengths)
    if lengths is not request.lengths:
        request = replace(request, lengths=lengths)
    start, end, closure = request.start, request.end, request.closure
    chosen, _ = formulation.choose(
        request.formulation, start, end, closure, request.walls, request.gravity, request.lengths.size, choose.asked(),
        request.apart is not None,
    )  # fmt: skip
    if chosen == "chained" and end is None:
        assert start is not None
        chained = ChainedProblem(
            request.strip, start, request.gravity, request.energy, request.lengths,
            stiffness=request.stiffness, in_plane=request.in_plane, tip=request.tip,
        )  # fmt: skip
        check.rulings(chained)
        return chained
    if closure is not None and request.lengths.size < 3:
        raise RibbonInputError("segments", request.lengths.size, "a closed band needs at least three segments")
    stretched.check_distance(request.strip, start, end)
    if chosen == "matrix" and law.is_table(request.strip.curvature):
        raise RibbonInputError("formulation", chosen, 'a table of natural curvature needs "mixed" or "chained"')
    if chosen == "matrix" and request.gravity is not None and request.gravity.exact:
        raise RibbonInputError("formulation", chosen, 'the weight of the surface needs "mixed"')
    check.pulled(request, chosen)
    mixed = MixedProblem(
        strip=request.strip, start=start, end=end, closure=closure, walls=request.walls, gravity=request.gravity,
        energy=request.energy, lengths=request.lengths, held_by=request.held_by, reference=_reference(request),
        model=chosen, stiffness=request.stiffness, in_plane=request.in_plane, tip=request.tip,
        apart=request.apart or 0.0, round=request.round_rod,
    )  # fmt: skip
    check.rulings(mixed)
    return mixed


def _reference(request: Request) -> tuple[float, ...]:
    """Quaternion to which signs and gauges refer."""
    if request.start is None or not request.start.holds_frame:
        return _UPRIGHT
    return tuple(quaternion.from_matrix(request.start.frame).tolist())
