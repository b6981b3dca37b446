"""How the ladders of the models are called and drawn, and which sizes of a cost plan are theirs."""

from __future__ import annotations

#: Colour and marker of each ladder's curve, and of one that has none of its own.
STYLES = {
    "chained": ("#1f5fa8", "o"),
    "mixed": ("#6fa3d8", "s"),
    "placed": ("#2b8c83", "D"),
    "elastica 1": ("#e8b48f", "v"),
    "elastica 2": ("#c2662d", "^"),
    "elastica 3": ("#7d3c12", ">"),
    "elastica 4": ("#4a220a", "<"),
    "shell": ("#4d4d4d", "P"),
    "shell near": ("#9a6bb0", "X"),
}
UNSTYLED = ("0.3", "x")
#: Colour of what lies below the error of a model's reference.
SHADES = {"ribbon": "#1f5fa8", "elastica": "#c2662d", "shell": "#4d4d4d"}
#: What a reader sees for a ladder's name.
NAMES = {
    "chained": "ribbon chained",
    "mixed": "ribbon glued",
    "placed": "ribbon placed",
    **{f"elastica {q}": f"elastica degree {q}" for q in range(1, 5)},
    "shell": "shell Q2",
    "shell near": "shell Q2 from the ribbon",
}
#: Which sizes of a plan (`compare.studies.cost_plan.Plan`) are those of which ladders, or families of ladders.
GIVEN = {
    "chained": "segments", "mixed": "segments", "placed": "tolerances", "elastica": "elastica_elements",
    "shell": "meshes",
}  # fmt: skip
