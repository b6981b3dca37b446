"""Rows of contact with curved surfaces: at the joints, and between them (docs/theory.md, eq. (5.9), (5.10))."""
