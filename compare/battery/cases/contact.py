"""Walls, from touching to crushing."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
