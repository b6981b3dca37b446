"""Which keys differ between the cases of a grid, and how their values are said; no picture is loaded for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from compare.studies.limits import Finding


def varied(findings: Sequence[Finding]) -> list[str]:
    """Keys whose value differs between findings, w/h among them as "w/h", in order; the last is the horizontal axis."""
    keys: list[str] = []
    for finding in findings:
        keys += [key for key in axes_of(finding) if key not in keys]
    return [key for key in keys if len({text_of(axes_of(f).get(key)) for f in findings}) > 1]


def axes_of(finding: Finding) -> dict[str, Any]:
    """The varied keys of a finding, its clamp and its w/h."""
    held = {"clamp": finding.scene.shell.clamp, "w/h": finding.width_to_thickness}
    return {**finding.values, **held}


def label(values: Mapping[str, Any]) -> str:
    """Keys and values for a title."""
    return ", ".join(f"{key.split('.', 1)[-1]} = {text_of(value)}" for key, value in values.items())


def text_of(value: Any) -> str:
    """A value in a title."""
    return f"{value:g}" if isinstance(value, float) else str(value)
