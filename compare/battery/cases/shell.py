"""The shell: thin, coiled, incompressible, snapping, coarse."""

from __future__ import annotations

from compare.battery.case import Case

CASES: tuple[Case, ...] = ()
