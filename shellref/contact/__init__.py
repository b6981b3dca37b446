"""Unilateral frictionless contact of a shell with planes: what is asked, which rows push, their linear algebra."""
