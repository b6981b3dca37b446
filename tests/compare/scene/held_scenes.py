"""Scenes with all that can hold a ribbon, small enough to be solved in every test run."""

from __future__ import annotations

STRIP = """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
"""
WEIGHT = """gamma = {gamma}
[gravity]
up = [0.0, 0.0, 1.0]
"""
FLAT = """tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
ruling = "free"
"""
START = f"""[clamp.start]
position = [0.0, 0.0, 0.0]
{FLAT}"""

TWO_CLAMPS = f"""{STRIP}{WEIGHT.format(gamma=20.0)}{START}[clamp.end]
position = [0.7, 0.1, 0.0]
{FLAT}[model]
elements = 16
"""

CIRCLE = f"""{STRIP}[closure]
kind = "circle"
[model]
elements = 16
"""

MOEBIUS = """
[strip]
length = 30.0
width = 1.0
poisson = 0.3
[closure]
kind = "moebius"
[model]
elements = 40
"""

FLOOR = """
[strip]
length = 2.0
width = 0.1
poisson = 0.3
gamma = 40.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.4]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
ruling = "free"
[[wall]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
elements = 16
"""

#: A strip bent into an arch whose weight comes at the end of the way.
PATH = f"""{STRIP}{WEIGHT.format(gamma=10.0)}{START}[clamp.end]
position = [0.6, 0.0, 0.1]
{FLAT}[model]
elements = 10
[[path]]
gravity = false
"clamp.end.position" = [0.9, 0.0, 0.0]
[[path]]
"clamp.end.position" = [0.7, 0.0, 0.0]
steps = 3
"""

#: A straight strip on edge, above the critical weight: a saddle.
ON_EDGE = f"""{STRIP}gamma = 30.0
[gravity]
up = [0.0, 1.0, 0.0]
{START}[model]
elements = 12
"""

#: A steel cantilever of 0.3 m in SI units.
STEEL = """
[strip]
length = 0.3
width = 0.01
thickness = 1e-4
poisson = 0.3
young = 2.1e11
density = 7850.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
elements = 20
"""
