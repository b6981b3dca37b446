"""The beginning: a scene of one's own from a few numbers, written as a commented template."""
