"""Formulations and minimisers kept only for comparison with the thesis."""
