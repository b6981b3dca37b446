"""Surfaces and centrelines in other programs' formats."""
