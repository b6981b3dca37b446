"""Units, stiffnesses, rigid motions, mirror and reversal change no dimensionless number."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
