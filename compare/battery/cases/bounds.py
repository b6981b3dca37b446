"""Rulings that nearly cross, events, the widest bands."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
