"""PyElastica's Cosserat rod at rest: run by a python that has pyelastica and NumPy, JSON in and out.

An explicit method: the rod is let fall and damped until it rests. What statics does not depend on is chosen for speed:
its mass, its rotary inertia (as much as leaves the time step to the waves of stretch), its damping, which is that of
its slowest mode, in translation and rotation alike (`uniform_damping_constant`: the older `damping_constant` damps
rotations by the mass over the rotary inertia more, and creeps). Where the bar is rigid in shear and stretch, these are
so stiff that its load strains it by 2e-4. Its directors are rows: d_1 = t_x, d_2 = t_y, d_3 = t_z.
"""

from __future__ import annotations

import json
import sys
import time

import elastica as ea
import numpy as np

#: Where the bar is rigid in shear and stretch these are so many times its load, and its bending stiffness over l^2, at
#: least; bending in its own plane over the softer one at most; step over the longest stable one.
STRAINED, RIGID, STIFFEST, SHARE = 5e3, 2e4, 1e3, 0.9
#: Damping over the root of the bending stiffness: twice the lowest frequency of a cantilever of mass 1.
DAMPING = 7.0
#: The loads grow over this time (l^2 / sqrt(D w)); then it is looked every `LOOK` whether any node is faster than
#: `SLOW` l; what remains to go is about a quarter of that.
GROW, LOOK, SLOW = 1.5, 0.25, 1e-5


class Falling(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """A rod that is held, loaded and damped."""


class Loads(ea.NoForces):
    """Dead loads on the nodes and a dead moment on the last element, grown from nothing over the time `grow`."""

    def __init__(self, loads, moment, grow):
        super().__init__()
        self.loads, self.moment, self.grow, self.turned = loads, moment, grow, bool(np.any(moment))

    def part(self, now):
        """Of the load, without a jump of its rate."""
        x = min(1.0, now / self.grow)
        return x * x * (3.0 - 2.0 * x)

    def apply_forces(self, system, time=0.0):
        """Adds the loads."""
        system.external_forces += self.part(time) * self.loads

    def apply_torques(self, system, time=0.0):
        """Adds the moment, in the directors of the last element."""
        if self.turned:
            system.external_torques[:, -1] += self.part(time) * system.director_collection[:, :, -1] @ self.moment


def turned(turn):
    """Rotation (3, 3) about a vector by its length."""
    size = float(np.linalg.norm(turn))
    x, y, z = turn / size if size else turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(size) * cross + (1.0 - np.cos(size)) * cross @ cross


def at_rest(bar, n, seconds):
    """Points (n + 1, 3) of the centreline at the clamp and the ends of the other elements, or in words how far it came
    within the seconds; and how it was run.

    What is held is an element's directors, at its middle: the first element stands half behind the clamp.
    """
    unit = bar["stiffness"][0]
    b = np.minimum(bar["stiffness"], STIFFEST * unit)
    # What a rod has of its own is kept where it costs twice the steps at most.
    load = np.linalg.norm(bar["weight"]) + np.linalg.norm(bar["force"])
    rigid = max(STRAINED * load, RIGID * unit)
    shear = np.array(bar["shear"] or [np.inf] * 3)
    shear = np.where(shear <= 4.0 * rigid, shear, rigid)
    h = 1.0 / (n - 0.5)
    frames = [np.array(bar["frame"], float) @ turned(np.array(bar["rest"]) * k * h) for k in range(n)]
    ahead = h * np.array([frame[:, 2] for frame in frames])
    nodes = np.array(bar["start"], float) + np.vstack([np.zeros(3), np.cumsum(ahead, axis=0)]) - 0.5 * ahead[0]
    rod = ea.CosseratRod.straight_rod(
        n, nodes[0], np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), n * h, 0.05, 1.0, youngs_modulus=1.0,
        shear_modulus=1.0,
    )  # fmt: skip
    rod.position_collection[...] = nodes.T
    rod.director_collection[...] = np.array(frames).transpose(2, 1, 0)
    share = np.where(np.arange(n + 1) == n, 0.5, 1.0) * h
    rod.mass[...] = share
    # As much inertia of rotation as leaves the step to the waves of stretch and shear; the same about all axes, since
    # where the rod is curved the stiff axis of one element is a soft one of the next.
    turning = max(h * h, b.max() / shear.max())
    waves = 4.0 * shear.max() / h**2 + 2.0 * shear.max() / turning, 4.0 * b.max() / (turning * h * h)
    fastest, inertia = np.sqrt(max(waves)), h * turning
    rod.mass_second_moment_of_inertia[...] = (inertia * np.eye(3))[:, :, None]
    rod.inv_mass_second_moment_of_inertia[...] = (np.eye(3) / inertia)[:, :, None]
    rod.bend_matrix[...] = np.diag(b)[:, :, None]
    rod.shear_matrix[...] = np.diag(shear)[:, :, None]
    rod.compute_internal_forces_and_torques(0.0)
    rod.rest_kappa[...] = rod.kappa
    step = SHARE * 2.0 / fastest
    system = Falling()
    system.append(rod)
    system.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    loads = np.outer(bar["weight"], share)
    loads[:, -1] += bar["force"]
    system.add_forcing_to(rod).using(Loads, loads=loads, moment=np.array(bar["moment"], float), grow=GROW)
    damping = DAMPING * np.sqrt(unit)
    system.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=step)
    system.finalize()
    stepper, now, begun, steps = ea.PositionVerlet(), 0.0, time.perf_counter(), 0
    while True:
        for _ in range(int(LOOK / step) + 1):
            now = stepper.step(system, now, step)
            steps += 1
        fast = np.abs(rod.velocity_collection).max()
        how = f"{steps} steps of {step:.2g}, damping {damping:.3g}"
        if not np.isfinite(fast):
            return f"broke down: its numbers are no longer finite after {how}", how
        if now > GROW + 1.0 and fast < SLOW:
            points = rod.position_collection.T.copy()
            points[0] = 0.5 * (points[0] + points[1])
            return points.tolist(), how
        if time.perf_counter() - begun > seconds:
            end = ", ".join(f"{x:.4g}" for x in rod.position_collection[:, -1])
            return f"out of budget: after {how} a node still moves by {fast:.1g} l a unit of time, end ({end}) l", how


def main():
    """Bars from the standard input, points to the standard output."""
    begun = time.perf_counter()
    asked = json.load(sys.stdin)
    at_rest(asked["bars"][0], 4, 0.0)  # what is compiled before the first step is no work of the solve
    points, used, how = [], time.process_time(), ""
    for bar in asked["bars"]:
        found, how = at_rest(bar, asked["size"], asked["seconds"] - (time.perf_counter() - begun))
        if isinstance(found, str):
            print(json.dumps({"broke": found}))
            return
        points.append(found)
    print(json.dumps({"points": points, "seconds": time.process_time() - used, "settings": how}))


if __name__ == "__main__":
    main()
