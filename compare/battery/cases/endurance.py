"""Thousands of solves in one process."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
