"""Rods: a centreline with a section that keeps its shape. `curve_angle`: Kirchhoff's rod in positions and one angle."""
