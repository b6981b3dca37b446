# %% [markdown]
# # A first strip
#
# A steel ruler, 30 cm long, 1 cm wide and a tenth of a millimetre thick, is clamped level at one end and hangs under
# its own weight. Where is its free end, what does the clamp carry, and how far is the answer from the true one? A
# second solver, ten lines of SciPy, says that.

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp, trapezoid

from ribbon import Clamp, Gravity, Strip, solve, solve_many

length, width, thickness = 0.30, 0.01, 1e-4  # m
steel = {"young": 210e9, "density": 7850.0, "poisson": 0.3}  # Pa, kg/m^3
ruler = Strip.from_material(length, width, thickness, **steel)
print(f"Gamma = {ruler.gamma:.3f}: the weight against the stiffness, rho g h l^3 / D")

# %% [markdown]
# The tangent is the direction in which the strip leaves the clamp, the normal that of its face. What is given is in
# metres; what is told is in units of the length l and of the stiffness D w, unless one asks for `.si`.

# %%
level = Clamp((0.0, 0.0, 0.0), tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
weight = Gravity(up=(0.0, 0.0, 1.0))
held = solve(ruler, level, weight, segments=20)
assert held.ok
held

# %% mystnb={"image": {"alt": "The ruler in space, hanging down from its clamp"}}
axes = held.plot()

# %% [markdown]
# ## What the clamp carries
#
# The weight, and a moment that is the weight times the lever of its centre of mass.

# %%
force, moment = held.si.start_force[2], np.linalg.norm(held.si.start_moment)
mass = steel["density"] * length * width * thickness
s = np.linspace(0.0, 1.0, 4001)
lever = trapezoid(length * held.position(s)[:, 0], s)
print(f"force {1000 * force:.3f} mN, weight {1000 * mass * 9.81:.3f} mN")
print(f"moment {1000 * moment:.4f} N mm, weight times lever {1000 * mass * 9.81 * lever:.4f} N mm")
assert abs(force / (mass * 9.81) - 1.0) < 1e-9
assert abs(moment / (mass * 9.81 * lever) - 1.0) < 1e-3

# %% [markdown]
# ## Another solver beside it
#
# A level strip stays in a plane, and there it is Euler's elastica: with the angle $\theta$ below the horizontal,
#
# $$\theta' = m, \qquad m' = -\Gamma (1 - s) \cos\theta, \qquad \theta(0) = 0, \quad m(1) = 0.$$


# %%
def elastica(gamma):
    """Place (x, z) of the free end in l, of a strip clamped level, by SciPy's collocation."""
    grid = np.linspace(0.0, 1.0, 41)
    found = solve_bvp(
        lambda s, y: np.array([y[1], -gamma * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])]),
        lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
        grid, np.array([1.3 * grid, 1.3 * (1.0 - grid), grid, -grid]), tol=1e-9, max_nodes=20000,
    )  # fmt: skip
    assert found.success
    return found.sol(1.0)[2:]


true = elastica(ruler.gamma)
off = np.linalg.norm(held.end.position[[0, 2]] - true)
drop = -1000.0 * length * held.end.position[2]
print(f"the end hangs {drop:.1f} mm below the clamp, {1e9 * length * off:.1f} nm from the elastica's")

# %% [markdown]
# The ruler was made of 20 elements. The error falls with the fourth power of their length: twice as many, a sixteenth
# of it.

# %% mystnb={"image": {"alt": "Error of the free end against the number of elements, falling with its fourth power"}}
counts = [5, 10, 20, 40]
errors = [np.linalg.norm(solve(ruler, level, weight, segments=count).end.position[[0, 2]] - true) for count in counts]
order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
figure, axes = plt.subplots(figsize=(5, 3.2))
axes.loglog(counts, errors, "o-", label=f"ribbon, order {order:.2f}")
axes.set(xlabel="elements", ylabel="error of the free end / l", xticks=counts, xticklabels=counts)
axes.minorticks_off()
axes.legend()
print("errors in l:", ", ".join(f"{error:.2e}" for error in errors))
assert off < 1e-6
assert 3.5 < order < 4.5

# %% [markdown]
# ## Many at once
#
# How far does it hang for other thicknesses? `solve_many` solves all of them in one call, and every case is what
# `solve` gives.

# %% mystnb={"image": {"alt": "Drop of the free end in mm against thickness, from the ribbon and the elastica"}}
sheets = np.geomspace(0.05e-3, 0.4e-3, 9)
strips = [Strip.from_material(length, width, sheet, **steel) for sheet in sheets]
many = solve_many(strips, level, weight, segments=20)
drops = -1000.0 * length * many.ends()[:, 2]
others = np.array([-1000.0 * length * elastica(strip.gamma)[1] for strip in strips])
figure, axes = plt.subplots(figsize=(5, 3.2))
axes.semilogx(1000 * sheets, others, label="elastica")
axes.semilogx(1000 * sheets, drops, "o", label="ribbon")
axes.set(xlabel="thickness / mm", ylabel="drop of the end / mm")
axes.legend()
print(f"largest difference {1000 * np.abs(drops - others).max():.2f} um, of drops up to {drops.max():.0f} mm")
assert many.ok.all()
assert np.abs(drops - others).max() < 0.1

# %% [markdown]
# Next: [a force curve](force_curve.py), [a band to Blender](band_to_blender.py), [the ribbon against a
# shell](ribbon_and_shell.py), and the [tutorial](../tutorials/first_scene.md) that does the same from the command
# line.
