"""Scenes, running, comparing, reporting: the layer that knows both the ribbon and the shell, and the command line."""

from ribbonbench import alone as _alone

__version__ = "0.1.0"

for _package in ("ribbon", "shellref"):
    _alone(_package)  # a user's folder of that name, beside a script, is none of ours
