"""Every model of the registry."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
