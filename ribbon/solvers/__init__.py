"""Minimisers: a problem (value, gradient, Hessian, bounds) in, a point with its multipliers out."""
