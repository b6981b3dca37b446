"""Few and many elements, strong grading, strong curl, great weight."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
