"""The ribbon's problems: unknowns, energies and conditions joined (chained and glued elements)."""
