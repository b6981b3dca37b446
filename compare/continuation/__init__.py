"""Branches of equilibria by pseudo-arclength: folds and branch points with their null vectors, switching, events."""
