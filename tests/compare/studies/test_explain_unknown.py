"""What is left out and moves the strip nobody knows how far is said before what would move it most."""

from __future__ import annotations

import json

from compare.cli import main

#: A steel strip between two clamps, whose rulings are at their bound: first order of a stiffer section says nothing.
OWN = """
title = "Own"
[strip]
length = 0.5
width = 0.02
thickness = 1e-4
young = 2.1e11
poisson = 0.3
density = 7850.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.3, 0.05, 0.02]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, -1.0, 0.0]
"""


def test_what_is_not_known_is_said_first(tmp_path, capsys):
    (tmp_path / "own.toml").write_text(OWN)
    assert main(["explain", str(tmp_path / "own.toml"), "--out", str(tmp_path / "o")]) == 0
    first = " ".join(capsys.readouterr().out.split()).partition(": good")[0]
    rows = json.loads((tmp_path / "o" / "result.json").read_text())["prices"]
    unknown = {
        row["effect"] for row in rows if not row["on"] and row["moves"] is None and row["energy_share"] is not None
    }
    assert "section between soft and stiff" in unknown
    known, _, most = first.partition("is not known")
    assert all(name in known for name in unknown)
    assert not any(name in most.partition("would move it most")[0] for name in unknown)
