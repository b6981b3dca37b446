"""Branches: forks near each other and double, loops, corners, clamps at the end of their reach, segments, kills.

Judged by closed forms, shooting and collocation that share nothing with the solvers or with what follows the branch."""

from compare.battery.case import Case
from compare.battery.cases.branches import ends, forks, kills, ways

CASES: tuple[Case, ...] = (*forks.CASES, *ways.CASES, *ends.CASES, *kills.CASES)
