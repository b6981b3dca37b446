"""On a branch of equilibria: elements that move with its passages, and where it loses its stability."""
