"""Measures between shapes: distances, rigid motions, fronts of error and time."""
