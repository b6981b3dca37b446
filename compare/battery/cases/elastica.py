"""The planar elastica: great weight, S-shapes, branches."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
