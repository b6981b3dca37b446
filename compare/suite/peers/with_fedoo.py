"""fedoo's corotational shells: run by a python that has fedoo and NumPy, JSON in and out.

Quadrilaterals of four nodes with mixed shear (`pquad4mitc`) and their consistent tangent; the load grows by increments
of fedoo's own choice. A line of nodes is held with its rotations; the loads are dead and act on the nodes.
"""

from __future__ import annotations

import contextlib
import json
import sys
import time

import fedoo as fd
import numpy as np

#: First, least and largest increment of the load, iterations of each, and the tolerance of its residual.
FIRST, LEAST, LARGEST, MOST, TOLERANCE = 0.02, 1e-6, 0.1, 25, 1e-6


class Late(Exception):
    """No time is left."""


def loaded(plate, until):
    """Points (n + 1, 3) of the centreline under the load; raises `Late` and what fedoo raises."""
    n, m = plate["elements"]
    nodes, loads = np.array(plate["nodes"], float), np.array(plate["loads"], float)
    number = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    cells = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    space = fd.ModelingSpace("3D")
    mesh = fd.Mesh(nodes, np.stack(cells, axis=-1).reshape(-1, 4), "quad4", name="strip")
    material = fd.constitutivelaw.ElasticIsotrop(plate["young"], plate["poisson"])
    shell = fd.constitutivelaw.ShellHomogeneous(material, plate["thickness"])
    form = fd.weakform.PlateEquilibrium(shell, consistent_tangent=True, space=space)
    problem = fd.problem.NonLinear(fd.Assembly.create(form, mesh), nlgeom="UL")
    problem.set_nr_criterion("Force", tol=TOLERANCE, max_subiter=MOST)
    held = ["DispX", "DispY", "DispZ", "RotX", "RotY", "RotZ"]
    problem.bc.add("Dirichlet", number[0].tolist(), held, 0.0)
    for axis, name in enumerate(held[:3]):
        carries = np.flatnonzero(loads[:, axis])
        if carries.size:
            problem.bc.add("Neumann", carries.tolist(), name, loads[carries, axis])

    reached = [0.0]

    def late(now):
        reached[0] = float(now.time)
        if time.perf_counter() > until:
            raise Late

    try:
        problem.nlsolve(
            dt=FIRST, dt_min=LEAST, dt_max=LARGEST, tmax=1.0, print_info=0, callback=late,
            exec_callback_at_each_iter=True,
        )  # fmt: skip
    except Late:
        return f"out of budget: at {reached[0]:.3g} of the load"
    except Exception as fault:
        return f"its increments ended at {reached[0]:.3g} of the load: {fault!s:.150}"
    moved = problem.get_disp()[:3].T
    return (nodes + moved)[number[:, m // 2]].tolist()


def main():
    """Plates from the standard input, points to the standard output."""
    begun = time.perf_counter()
    asked = json.load(sys.stdin)
    until, points, used = begun + asked["seconds"], [], time.process_time()
    for plate in asked["plates"]:
        with contextlib.redirect_stdout(sys.stderr):
            found = loaded(plate, until)
        if isinstance(found, str):
            print(json.dumps({"broke": found}))
            return
        points.append(found)
    how = f"pquad4mitc, {plate['elements'][0]} x {plate['elements'][1]}, UL, tolerance {TOLERANCE:g} of the force"
    print(json.dumps({"points": points, "seconds": time.process_time() - used, "settings": how}))


if __name__ == "__main__":
    main()
