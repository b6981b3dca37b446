"""Bifurcation diagrams: branches of equilibria of one scene over one of its numbers, for every model that can."""
