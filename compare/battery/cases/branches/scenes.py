"""The two scenes of branches: a heavy mast, an arch between level clamps."""

from __future__ import annotations

MAST = """
title = "Mast"
[strip]
length = 1.0
width = 0.02
poisson = 0.0
gamma = 5.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [-1.0, 0.0, 0.0]
[model]
energy = "wunderlich"
elements = 10
"""
CLAMPS = """
title = "Two clamps"
[strip]
length = 1.0
width = 0.02
poisson = 0.3
gamma = 0.0
[clamp.start]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.8, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "elastica"
elements = 8
[seed]
curvature = [-6.0, 6.0, -6.0]
"""
#: Height of the end over the clamp.
SHIFT = "clamp.end.position[2]"
