"""What the user of a scene can do about a state that is no stable equilibrium: written once, in keys and flags.

Solvers speak in status codes, numbers and their own options; the words of scenes and commands stand here.
"""

from __future__ import annotations

from typing import Protocol


class Ended(Protocol):
    """What is asked of a state (`compare.models.base.State`)."""

    @property
    def model(self) -> str: ...

    @property
    def word(self) -> str: ...

    @property
    def message(self) -> str: ...


#: (model, its word for the end) -> what is said after the solver's message.
REMEDIES = {
    ("ribbon", "saddle"): ": leave it along its unstable direction (without --stay; on a [[path]] --leave-saddle), or "
    "start from another [seed]: a bent one, e.g. curvature = 0.5, or out of its plane, e.g. ruling = 0.01",
    ("ribbon", "not_converged"): "; try another [seed], more segments, or a smaller load first",
    ("ribbon", "failed"): "; try another [seed] or a smaller load",
    ("ribbon", "infeasible"): ", or declare a [[path]] that leads there",
    ("ribbon", "flipped"): "; start from a nearer [seed] or a [[path]]",
    ("elastica", "limit_point"): ": go past it by arc length: --set model.arc_length=always",
    ("antman", "unstable"): ": use --leave-saddle to go down to a stable one",
    ("curve_angle", "saddle"): ": use --leave-saddle to go down to a stable one, or start from a bent [seed], e.g. "
    "curvature = 0.5",
    ("elastica", "unstable"): ": start from a bent [seed], e.g. curvature = 0.5, or tilt the clamp a little",
    ("antman", "limit_point"): ": choose another [seed], or go there by a [[path]]",
    ("elastica", "not_converged"): ": choose another [seed], or go there by a [[path]]",
}


def message(state: Ended) -> str:
    """The solver's message with the remedy; of an elastica in the place of the solver's own options, which end it."""
    remedy = REMEDIES.get((state.model, state.word))
    if remedy is None:
        return state.message
    said = state.message.rpartition(": ")[0] if state.model == "elastica" else state.message
    return said + remedy
