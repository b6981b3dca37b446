"""The functions of energies and series against mpmath, over their whole range."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
