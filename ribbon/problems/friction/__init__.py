"""Coulomb friction at places of contact: the particles there, and what an increment's friction adds to the energy."""
