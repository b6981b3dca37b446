"""The runners of other people's programs: name, library, script, and the sizes of their two meshes.

MuJoCo, EXUDYN and PyElastica are named in `compare.suite.runners`, the others by the entry points of the distribution.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from compare.suite.answers import Answers
from compare.suite.case import Case
from compare.suite.peers.call import Text, run
from compare.suite.peers.models import mujoco_text


@dataclass(frozen=True)
class Program:
    """A library in an interpreter of its own, the script that asks it, the sizes of its two meshes, and what makes a
    model of a bar where the script takes models."""

    library: str
    script: str
    sizes: tuple[int, int] = (10, 20)
    text: Text | None = None

    def answers(self, case: Case, budget: float) -> Answers:
        """Of a case, within the budget (s)."""
        return run(case, budget, self.library, self.script, self.sizes, self.text)


PROGRAMS: Mapping[str, Program] = {
    "mujoco": Program("mujoco", "with_mujoco.py", text=mujoco_text),
    "exudyn": Program("exudyn", "with_exudyn.py"),
    "pyelastica": Program("pyelastica", "with_pyelastica.py", (20, 40)),
    "opensees": Program("openseespy", "with_opensees.py", (20, 40)),
    "newton": Program("newton", "with_newton.py", (4, 8)),
}


def mujoco(case: Case, budget: float) -> Answers:
    """MuJoCo's cable: a chain of boxes with an elastic plugin (which version 4 has no more)."""
    return PROGRAMS["mujoco"].answers(case, budget)


def exudyn(case: Case, budget: float) -> Answers:
    """EXUDYN's three-dimensional ANCF beam and its static solver."""
    return PROGRAMS["exudyn"].answers(case, budget)


def pyelastica(case: Case, budget: float) -> Answers:
    """PyElastica's Cosserat rod, let fall until it rests."""
    return PROGRAMS["pyelastica"].answers(case, budget)


def newton(case: Case, budget: float) -> Answers:
    """NVIDIA Newton's rod, by vertex block descent until it rests."""
    return PROGRAMS["newton"].answers(case, budget)


def opensees(case: Case, budget: float) -> Answers:
    """OpenSees' elastic beams in frames that turn with them."""
    return PROGRAMS["opensees"].answers(case, budget)
