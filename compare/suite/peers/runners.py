"""The runners of other people's programs: name, library, script, and the sizes of their two meshes."""

from __future__ import annotations

from compare.suite.answers import Answers
from compare.suite.case import Case
from compare.suite.peers.call import run
from compare.suite.peers.models import mujoco_text


def mujoco(case: Case, budget: float) -> Answers:
    """MuJoCo's cable: a chain of boxes with an elastic plugin (which version 4 has no more)."""
    return run(case, budget, "mujoco", "with_mujoco.py", (10, 20), mujoco_text)


def exudyn(case: Case, budget: float) -> Answers:
    """EXUDYN's three-dimensional ANCF beam and its static solver."""
    return run(case, budget, "exudyn", "with_exudyn.py", (10, 20))


def pyelastica(case: Case, budget: float) -> Answers:
    """PyElastica's Cosserat rod, let fall until it rests."""
    return run(case, budget, "pyelastica", "with_pyelastica.py", (10, 20))
