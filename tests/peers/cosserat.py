"""PyElastica's Cosserat rod relaxed to rest under its weight; a script for the peers' own Python, no file of ours.

Standard input: one line of JSON a rod, l = m = 1 (mass per length), stiffness of bending about the first director 1
(so Gamma is its weight): curvature, gamma, up (3,), frame (3, 3) of the clamp as columns (t_x, t_y, t_z), stiffnesses
(3,) of bending about t_x and t_y and of torsion; elements; stiff: of stretching and shear, not the section's own but
as low as the error allows, for it limits the step; damping: uniform, 1 / time; until; share of the longest stable step;
tip of the reference (3,) and the distance to it that is asked for, with which a run is stopped (`settled`); budget:
CPU s. Standard output: one line of JSON each: times, tips (k, 3), their errors, steps and CPU s up to each of them,
whether it settled, CPU s of the first step (numba's compilation, or its cache).

The clamp holds the first element: it reaches half of its length behind s = 0, so that its director is the clamp's
frame (held from s = 0 on, the rod is straight for half an element and the error of first order).
"""

from __future__ import annotations

import json
import sys
import time

import elastica as ea
import numpy as np

#: Steps between two looks at the tip.
LOOK = 200
#: A run is over when its tip stayed within the error for this share of its time.
STAYED = 0.3


class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """A rod, its clamp, weight and damping."""


def rod_of(given: dict) -> tuple[ea.CosseratRod, float]:
    """The rod in its natural shape, and the length of its elements."""
    n = given["elements"]
    h = 1.0 / (n - 0.5)
    frame = np.array(given["frame"])
    angles = given["curvature"] * h * np.arange(n)
    # about t_x: t_z' = -omega t_y
    t_y = frame[:, 1] * np.cos(angles)[:, None] + frame[:, 2] * np.sin(angles)[:, None]
    t_z = frame[:, 2] * np.cos(angles)[:, None] - frame[:, 1] * np.sin(angles)[:, None]
    place = np.vstack([np.zeros(3), np.cumsum(h * t_z, axis=0)]) - 0.5 * h * frame[:, 2]
    directors = np.stack([np.tile(frame[:, 0], (n, 1)), t_y, t_z]).transpose(0, 2, 1)
    radius = 0.05
    rod = ea.CosseratRod.straight_rod(
        n, place[0].copy(), frame[:, 2].copy(), frame[:, 0].copy(), n * h, radius, 1.0 / (np.pi * radius**2),
        youngs_modulus=1.0, shear_modulus=0.5, position=place.T.copy(), directors=directors.copy(),
    )  # fmt: skip
    stiff, bend = given["stiff"], np.array(given["stiffnesses"])
    rod.shear_matrix[:] = (stiff * np.eye(3))[:, :, None]
    rod.bend_matrix[:] = np.diag(bend)[:, :, None]
    # inertia of rotation matters on the way only: as large as leaves the longest step to stretching
    inertia = h * np.maximum(bend / stiff, h * h)
    rod.mass_second_moment_of_inertia[:] = np.diag(inertia)[:, :, None]
    rod.inv_mass_second_moment_of_inertia[:] = np.diag(1.0 / inertia)[:, :, None]
    rod.compute_internal_forces_and_torques(0.0)
    rod.rest_kappa[:] = rod.kappa
    return rod, h


def settled(errors: list[float], tips: list[list[float]], asked: float) -> bool:
    """Whether the tip stayed within what is asked for STAYED of the looks, and hardly moved meanwhile."""
    last = int(STAYED * len(errors))
    if last < 10 or max(errors[-last:]) > asked:
        return False
    return float(np.ptp(np.array(tips[-last:]), axis=0).max()) < 0.2 * asked


def relaxed(given: dict) -> dict:
    """The run."""
    rod, h = rod_of(given)
    stiff, bend = given["stiff"], np.array(given["stiffnesses"])
    inertia = np.maximum(bend / stiff, h * h)
    fastest = np.sqrt(max(4 * stiff / h**2 + 2 * stiff / inertia.min(), (4 * bend / (inertia * h * h)).max()))
    step = given["share"] * 2.0 / fastest
    simulator = Simulator()
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    weight = -given["gamma"] * np.array(given["up"])
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=weight)
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=given["damping"], time_step=step)
    begun = time.process_time()
    simulator.finalize()
    stepper = ea.PositionVerlet()
    now = stepper.step(simulator, 0.0, step)
    first = time.process_time() - begun
    target, requested = np.array(given["tip"]), given["asked"]
    times, tips, seconds, errors, stepped = [], [], [], [], []
    begun = time.process_time()
    steps, rests = 1, False
    while now < given["until"]:
        for _ in range(LOOK):
            now = stepper.step(simulator, now, step)
        steps += LOOK
        tip = rod.position_collection[:, -1].copy()
        times.append(now)
        tips.append(tip.tolist())
        seconds.append(time.process_time() - begun)
        errors.append(float(np.linalg.norm(tip - target)))
        stepped.append(steps)
        rests = settled(errors, tips, requested)
        if rests or not np.isfinite(errors[-1]) or seconds[-1] > given["budget"]:
            break
    return {
        "times": times, "tips": tips, "errors": errors, "seconds": seconds, "stepped": stepped, "settled": rests,
        "first": first,
    }  # fmt: skip


def main() -> None:
    """Answers line by line."""
    for line in sys.stdin:
        print(json.dumps(relaxed(json.loads(line))), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        import importlib.metadata

        print("PyElastica " + importlib.metadata.version("pyelastica"))
    else:
        main()
