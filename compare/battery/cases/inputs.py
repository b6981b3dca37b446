"""Whatever a scene file may say."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
