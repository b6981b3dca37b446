"""Judges of a ribbon's state that share no code with the solver: they read its curvatures, clamps and loads as data."""
