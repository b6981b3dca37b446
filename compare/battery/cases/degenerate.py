"""What is undetermined or lies on the edge: straight, unsupported, critical, taut."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
