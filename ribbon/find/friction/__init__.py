"""Strips that rub on their walls: one increment of a path with Coulomb friction, and the path."""
