# %% [markdown]
# # A force curve, from a strip whose stiffness is measured first
#
# A steel tape is to be pushed together between two clamps. What force does it take? That depends on Young's modulus,
# which nobody knows of this tape: so it is hung from one clamp first, points of its shape are measured, and the
# modulus is fitted to them with an interval. Then the force follows, in newtons, with that interval.

# %%
import matplotlib.pyplot as plt
import numpy as np

from compare.models import solve as solve_scene
from compare.scene.scene import loads
from compare.studies.identify import Points, identify
from ribbon import Clamp, Session, Strip

TRUE = 195e9  # Pa, of the tape on the table: what the fit has to find
hanging = loads("""
title = "A steel tape, hanging from one clamp"
[strip]
length = 0.30
width = 0.01
thickness = 1e-4
poisson = 0.3
young = 210e9              # the book's value, to begin with
density = 7850.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
""")

# %% [markdown]
# ## Measured points
#
# There is no table here, so the points are made: 24 marks on a tape with the true modulus, each seen 0.3 mm off at
# random in every direction. (One such tape in twenty has its modulus outside of the interval.)

# %%
truth = solve_scene(hanging.replace({"strip.young": TRUE}))
s = np.linspace(0.05, 1.0, 24)
noise = np.random.default_rng(0).normal(0.0, 0.3e-3 / 0.30, (len(s), 3))
measured = Points(truth.shape.centreline(s) + noise, s)  # l, in the axes of the scene
fit = identify(hanging, measured, ["strip.young"])
(young,) = fit.keys
print(f"Young's modulus {young.value / 1e9:.2f} GPa, 95 % between {young.interval[0] / 1e9:.2f} and "
      f"{young.interval[1] / 1e9:.2f}")  # fmt: skip
print(f"left over: {1000 * 0.30 * fit.rms:.2f} mm; grade: {fit.grade}")
assert fit.passes
assert young.interval[0] < TRUE < young.interval[1]

# %% mystnb={"image": {"alt": "Measured points and the fitted tape, seen from the side, in millimetres"}}
line = 300.0 * fit.state.shape.centreline(np.linspace(0.0, 1.0, 200))
figure, axes = plt.subplots(figsize=(5, 3.6))
axes.plot(line[:, 0], line[:, 2], label="fitted")
axes.plot(300.0 * measured.places[:, 0], 300.0 * measured.places[:, 2], ".", label="measured")
axes.set(xlabel="x / mm", ylabel="z / mm", aspect="equal")
_ = axes.legend()

# %% [markdown]
# ## Pushed together
#
# The same tape on its edge, where its weight bends nothing (no `Gravity` is given), stands in a low arch between two
# clamps; one of them comes nearer, step by step. A `Session` starts every state from the one before.

# %%
tape = Strip.from_material(0.30, 0.01, 1e-4, young=young.value, density=7850.0, poisson=0.3)


def clamp_at(distance):
    """The clamp that is moved, `distance` metres from the other one."""
    return Clamp((0.0, 0.0, distance), tangent=(0.0, 0.0, 1.0), normal=(0.0, 1.0, 0.0))


arch = Session(tape, clamp_at(0.0), end=clamp_at(0.294), segments=24, seed_curvature=(-10.0, 10.0, 10.0, -10.0))
ways, forces, energies = [], [], []
for distance in np.linspace(0.294, 0.18, 20):
    move = arch.move(end=clamp_at(distance))
    assert move.ok
    ways.append(0.30 - distance)
    forces.append(-arch.si.forces["end"].force[2])
    energies.append(arch.state.si.energy["total"])
ways, forces, energies = np.array(ways), np.array(forces), np.array(energies)
arch.show()

# %% [markdown]
# Two things are known without any solver. A column clamped at both ends buckles at $4 \pi^2 D w / l^2$, with the
# plate's stiffness $D = Y h^3 / (12 (1 - \nu^2))$; and the work of the moved clamp is what the tape stores.

# %% mystnb={"image": {"alt": "Force of the moved clamp against its displacement, with the buckling load as a line"}}
column = 4.0 * np.pi**2 * tape.bending_stiffness * 0.01 / 0.30**2
low, high = (bound / young.value for bound in young.interval)
figure, axes = plt.subplots(figsize=(5, 3.4))
axes.plot(1000 * ways, 1000 * forces, "o-", label="ribbon")
axes.fill_between(1000 * ways, 1000 * low * forces, 1000 * high * forces, alpha=0.4, label="by Young's modulus, 95 %")
axes.axhline(1000 * column, linestyle="--", color="gray", label="column, clamped at both ends")
axes.set(xlabel="pushed together by / mm", ylabel="force / mN")
axes.legend()
work = np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(ways))
stored = energies[-1] - energies[0]
print(f"column {1000 * column:.2f} mN, first state {1000 * forces[0]:.2f} mN, last {1000 * forces[-1]:.2f} mN")
print(f"work {1000 * work:.4f} mJ, stored {1000 * stored:.4f} mJ")
assert 1.0 < forces[0] / column < 1.02
assert abs(work / stored - 1.0) < 1e-3

# %% [markdown]
# ## How stiff it is there
#
# The slope of the curve comes with every state, exact: a row of the stiffness of the end clamp. It is that of the
# curve, by differences.

# %%
slope = arch.si.stiffness[2, 2]
by_difference = (forces[-1] - forces[-2]) / (ways[-1] - ways[-2])
print(f"{slope:.4f} N/m, by the last two points {by_difference:.4f} N/m")

# %% [markdown]
# The same from the command line, with a `[[path]]`: [for engineers](../tutorials/engineers.md); fitting from a file
# of points: [identify](../commands/identify.md).
