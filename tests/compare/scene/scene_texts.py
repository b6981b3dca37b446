"""Scene texts for the tests: a good one with keys replaced, and the fault that a bad one raises."""

from __future__ import annotations

import pytest

from compare.scene.scene import loads
from ribbonbench.errors import BadInput

BASE = {
    "strip.length": "1.0",
    "strip.width": "0.03",
    "strip.poisson": "0.4",
    "strip.natural_curvature": "10.0",
    "strip.gamma": "100.0",
    "gravity.up": "[1.0, 0.0, 0.0]",
    "clamp.start.position": "[0.0, 0.0, 0.0]",
    "clamp.start.tangent": "[0.0, 0.0, 1.0]",
    "clamp.start.normal": "[-0.70710678118654757, 0.70710678118654757, 0.0]",
}
SI = {
    "strip.gamma": None,
    "strip.length": "0.5",
    "strip.width": "0.015",
    "strip.thickness": "1e-4",
    "strip.poisson": "0.5",
    "strip.natural_curvature": "30.0",
    "strip.young": "1.8e9",
    "strip.density": "1000.0",
}
PLANAR = {"clamp.start.normal": "[1.0, 0.0, 0.0]"}


def text(*changes: dict[str, str | None], extra: str = "") -> str:
    """TOML of BASE with dotted keys set to raw TOML (None: left out), then `extra`."""
    keys: dict[str, str | None] = dict(BASE)
    for change in changes:
        keys.update(change)
    sections: dict[str, list[str]] = {}
    for dotted, value in keys.items():
        section, _, name = dotted.rpartition(".")
        if value is not None:
            sections.setdefault(section, []).append(f"{name} = {value}")
    lines = sections.pop("", [])
    for section, entries in sections.items():
        lines += [f"[{section}]", *entries]
    return "\n".join(lines) + "\n" + extra


def fault(content: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        loads(content)
    error = caught.value
    assert error.exit_code == 2
    assert "\n" not in str(error)
    assert str(error).startswith(error.key)
    assert error.remedy, "an error says what would be right"
    assert " ".join(error.remedy.split()) in str(error)
    return error


# -- each bad input: change, key, what the line shows of the value, what the line offers ------------
