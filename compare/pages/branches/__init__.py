"""Branches and other equilibria: what `branches` and `solve --all` say and write."""
