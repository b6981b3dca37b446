"""What the kinds of points are called."""

WORDS = {
    "fold": "fold", "branch_point": "branch point", "event": "event", "regular": "regular", "ruling": "fall by rulings",
}  # fmt: skip
