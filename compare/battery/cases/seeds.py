"""Random starts and random clamps: what comes back, and whether the tool says so."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
