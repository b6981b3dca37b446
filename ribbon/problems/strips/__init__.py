"""Several strips whose ends are joined, and that touch each other: one problem of glued ribbons."""
