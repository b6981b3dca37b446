"""Ribbons that begin in a drawn curve, and round rods whose segments follow what touches."""
