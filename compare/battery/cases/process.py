"""Killed, interrupted, without room, with damaged or foreign files."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
