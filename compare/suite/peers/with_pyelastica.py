"""PyElastica's Cosserat rod at rest: run by a python that has pyelastica and NumPy, JSON in and out.

An explicit method: the rod is let fall and damped until it rests. What statics does not depend on is chosen for speed:
its mass, its rotary inertia (that of a section as thick as shear waves need), its damping. Where the bar is rigid in
shear and stretch these are 2e4 times its bending stiffness, which leaves stretches of about 1e-3 under loads of 20.
Its directors are rows: d_1 = t_x, d_2 = t_y, d_3 = t_z.
"""

from __future__ import annotations

import json
import sys

import elastica as ea
import numpy as np

#: Shear and stretch over bending where the bar is rigid in them; greatest time and its step over that of a wave.
RIGID, LONGEST, COURANT = 2e4, 40.0, 0.3


class Falling(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """A rod that is held, loaded and damped."""


class Loads(ea.NoForces):
    """Dead loads on the nodes and a dead moment on the last element, grown from nothing over the time `grow`."""

    def __init__(self, loads, moment, grow):
        super().__init__()
        self.loads, self.moment, self.grow = loads, moment, grow

    def apply_forces(self, system, time=0.0):
        """Adds the loads."""
        system.external_forces += min(1.0, time / self.grow) * self.loads

    def apply_torques(self, system, time=0.0):
        """Adds the moment, in the directors of the last element."""
        system.external_torques[:, -1] += (
            min(1.0, time / self.grow) * system.director_collection[:, :, -1] @ self.moment
        )


def at_rest(bar, n):
    """Points (n + 1, 3) of the nodes; None: it does not come to rest."""
    b = np.array(bar["stiffness"])
    unit = b[0]
    shear = np.array(bar["shear"]) if bar["shear"] else np.full(3, RIGID * unit)
    shear = np.minimum(shear, RIGID * unit)
    frame = np.array(bar["frame"], dtype=float)
    rod = ea.CosseratRod.straight_rod(
        n,
        np.array(bar["start"], float),
        frame[:, 2],
        frame[:, 1],
        1.0,
        0.05,
        1.0,
        youngs_modulus=1.0,
        shear_modulus=1.0,
    )
    rod.director_collection[...] = frame.T[:, :, None]
    rod.mass[...] = np.where(np.isin(np.arange(n + 1), (0, n)), 0.5, 1.0) / n
    inertia = 0.3 / n**2 * max(1.0, float(b.max()) / unit / 30.0) / n
    rod.mass_second_moment_of_inertia[...] = (inertia * np.eye(3))[:, :, None]
    rod.inv_mass_second_moment_of_inertia[...] = (np.eye(3) / inertia)[:, :, None]
    rod.bend_matrix[...] = np.diag(b)[:, :, None]
    rod.shear_matrix[...] = np.diag(shear)[:, :, None]
    rod.rest_kappa[...] = -np.array(bar["rest"])[:, None]
    waves = [np.sqrt(shear.max()) * n, np.sqrt(shear.max() / n / inertia), 2 * np.sqrt(b.max() * n / inertia)]
    step = COURANT / max(waves)
    system = Falling()
    system.append(rod)
    system.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    loads = np.outer(bar["weight"], np.where(np.isin(np.arange(n + 1), (0, n)), 0.5, 1.0) / n)
    loads[:, -1] += bar["force"]
    system.add_forcing_to(rod).using(Loads, loads=loads, moment=np.array(bar["moment"]), grow=2.0)
    system.dampen(rod).using(ea.AnalyticalLinearDamper, damping_constant=4.0 * np.sqrt(unit), time_step=step)
    system.finalize()
    stepper = ea.PositionVerlet()
    time = 0.0
    while time < LONGEST:
        for _ in range(int(1.0 / step)):
            time = stepper.step(system, time, step)
        if not np.isfinite(rod.position_collection).all():
            return None
        if time > 4.0 and np.abs(rod.velocity_collection).max() < 1e-5:
            return rod.position_collection.T.tolist()
    return None


def main():
    """Bars from the standard input, points to the standard output."""
    asked = json.load(sys.stdin)
    points = [at_rest(bar, asked["size"]) for bar in asked["bars"]]
    broke = {"broke": "it does not come to rest"}
    print(json.dumps(broke if None in points else {"points": points}))


if __name__ == "__main__":
    main()
