"""Layers of a strip that lie on each other."""
