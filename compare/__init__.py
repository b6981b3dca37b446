"""Scenes, running, comparing, reporting: the layer that knows both the ribbon and the shell, and the command line."""

from ribbonbench import SOLVERS as _SOLVERS
from ribbonbench import alone as _alone

__version__ = "0.1.0"

_alone(*_SOLVERS)  # a user's folder of such a name, beside a script, is none of ours
