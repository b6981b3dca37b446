"""Scenes that cannot be, and how soon the tool says so."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
