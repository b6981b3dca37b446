# %% [markdown]
# # A band to Blender
#
# A strip of paper, 20 cm long and 2 cm wide, is closed to a band with half a turn. Its equilibrium goes to Blender as
# a mesh in its true size: paper bends, and does not stretch, so that area and edges of the mesh can be held against
# those of the flat strip.

# %%
import json
import struct
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from compare.cli import main
from ribbon import Closure, Strip, solve

length, width = 0.20, 0.02  # m
paper = Strip(length=length, width=width, poisson=0.3)
band = solve(paper, closure=Closure("moebius"), segments=40)
assert band.ok
band

# %% mystnb={"image": {"alt": "The Moebius band in space"}}
axes = band.plot()

# %% [markdown]
# ## Is it developable?
#
# Triangles of the surface against the same triangles of the flat strip: all areas together, and the worst edge.

# %%
surface = band.surface(400, 8)


def edges_and_area(points):
    """Lengths of the edges of all triangles, (n, 3), and the sum of the areas."""
    corners = points[surface.triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.linalg.norm(sides, axis=2), area.sum()


flat = np.column_stack([surface.material, np.zeros(len(surface.material))])
sides, area = edges_and_area(surface.points)
flat_sides, flat_area = edges_and_area(flat)
worst = np.abs(sides / flat_sides - 1.0).max()
print(f"area off by {abs(area / flat_area - 1.0):.1e} of itself, the worst edge by {worst:.1e}")
assert abs(area / flat_area - 1.0) < 1e-3
assert worst < 1e-2

# %% [markdown]
# Where it bends is where the energy is: a flat part, and a fold that the half turn needs.

# %% mystnb={"image": {"alt": "Normal curvature and slope of the rulings along the band"}}
s = np.linspace(0.0, 1.0, 801)
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(5, 4))
axes[0].plot(s, band.omega(s))
axes[0].set(ylabel="curvature / (1/l)")
axes[1].plot(s, band.eta(s))
axes[1].set(xlabel="s / l", ylabel="slope of the rulings")
reach = 0.5 * width / length * np.abs(band.eta(s)).max()
print(f"rulings reach {reach:.3f} l along the strip; energy {band.energy.total:.4f} D w / l")

# %% [markdown]
# ## The mesh
#
# `ribbonbench export` writes binary glTF for Blender and for browsers, and OBJ for anything else, in metres. Here the
# command is called from Python; in a shell it is the same line.

# %%
Path("band.toml").write_text(f"""
title = "A paper band with half a turn"
[strip]
length = {length}
width = {width}
poisson = 0.3
[closure]
kind = "moebius"
[model]
elements = 40
""")
code = main(["export", "band.toml", "--format", "gltf,obj", "--out", "meshes", "--quiet"])
assert code == 0
for path in sorted(Path("meshes").glob("*.*")):
    print(path.name, path.stat().st_size, "bytes")

# %% [markdown]
# What Blender will read, read here: the head of the file is JSON, positions have their bounds beside them.

# %%
data = Path("meshes/surfaces.glb").read_bytes()
(size,) = struct.unpack("<I", data[12:16])
gltf = json.loads(data[20 : 20 + size])
places = gltf["accessors"][gltf["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
extent = 1000.0 * (np.array(places["max"]) - np.array(places["min"]))
print(f"{places['count']} vertices, {extent[0]:.1f} x {extent[1]:.1f} x {extent[2]:.1f} mm")

vertices = [line.split()[1:4] for line in Path("meshes/ribbon.obj").read_text().splitlines() if line[:2] == "v "]
from_obj = 1000.0 * np.ptp(np.array(vertices, dtype=float), axis=0)
assert np.allclose(np.sort(extent), np.sort(from_obj), atol=0.5)

# %% [markdown]
# In Blender: *File, Import, glTF 2.0*, or
#
# ```text
# blender --python-expr "import bpy; bpy.ops.import_scene.gltf(filepath='meshes/surfaces.glb')"
# ```
#
# A motion, key frame by key frame an equilibrium: [for graphics](../tutorials/graphics.md); all formats:
# [export](../commands/export.md).
