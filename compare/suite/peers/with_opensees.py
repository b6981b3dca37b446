"""OpenSees' elastic beams at rest: run by a python that has openseespy and NumPy, JSON in and out.

Two-node beams without shear (elasticBeamColumn) in frames that turn with them (geomTransf Corotational), each straight
and without stress in the rest shape: the chords of its arcs. Local x is t_z, y is -t_y, z is t_x. Newton's method on
the nodes' places and rotations, the load in steps that are halved where it fails. Where the bar is rigid in stretch it
has 1e6 times its bending stiffness over l^2.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np
import openseespy.opensees as ops

STEPS, LEAST, CLOSE, NEWTON = 20, 1e-4, 1e-10, 40
RIGID = 1e6


def turned(turn):
    """Rotation (3, 3) about a vector by its length."""
    size = float(np.linalg.norm(turn))
    x, y, z = turn / size if size else turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(size) * cross + (1.0 - np.cos(size)) * cross @ cross


def rest_shape(bar, n):
    """Nodes (n + 1, 3) and frames (n, 3, 3) at the elements' middles."""
    rest, frame = np.array(bar["rest"], float), np.array(bar["frame"], float)
    at, weights = np.polynomial.legendre.leggauss(8)
    nodes = [np.array(bar["start"], float)]
    for k in range(n):
        tangents = np.array([(frame @ turned(rest * (k + 0.5 * (x + 1.0)) / n))[:, 2] for x in at])
        nodes.append(nodes[-1] + 0.5 / n * weights @ tangents)
    return np.array(nodes), [frame @ turned(rest * (k + 0.5) / n) for k in range(n)]


def at_rest(bar, n, until):
    """Points (n + 1, 3) of the nodes, or in words how far it came."""
    b1, b2, gj = bar["stiffness"]
    stretch = bar["shear"][2] if bar["shear"] else RIGID * b1
    nodes, frames = rest_shape(bar, n)
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for k, place in enumerate(nodes):
        ops.node(k + 1, *place.tolist())
    ops.fix(1, 1, 1, 1, 1, 1, 1)
    for k, frame in enumerate(frames, 1):
        ops.geomTransf("Corotational", k, *frame[:, 0].tolist())
        ops.element("elasticBeamColumn", k, k, k + 1, stretch, 1.0, 1.0, gj, b2, b1, k)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    weight, force, moment = (np.array(bar[key], float) for key in ("weight", "force", "moment"))
    for k in range(1, n + 1):
        pull = weight * (0.5 if k == n else 1.0) / n + (force if k == n else 0.0)
        ops.load(k + 1, *pull.tolist(), *(moment if k == n else np.zeros(3)).tolist())
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", CLOSE, NEWTON)
    ops.algorithm("Newton")
    part, step = 0.0, 1.0 / STEPS
    while part < 1.0 - 1e-12:
        step = min(step, 1.0 - part)
        ops.integrator("LoadControl", step)
        ops.analysis("Static")
        if ops.analyze(1) == 0:
            part = ops.getTime()
        elif step < LEAST:
            return f"Newton's method did not follow the load beyond {part:.4g} of it"
        else:
            step *= 0.5
        if time.perf_counter() > until:
            return f"out of budget: at {part:.3g} of the load"
    return [(place + np.array(ops.nodeDisp(k + 1)[:3])).tolist() for k, place in enumerate(nodes)]


def main():
    """Bars from the standard input, points to the standard output."""
    asked = json.load(sys.stdin)
    until, used, points = time.perf_counter() + asked["seconds"], time.process_time(), []
    for bar in asked["bars"]:
        found = at_rest(bar, asked["size"], until)
        if isinstance(found, str):
            print(json.dumps({"broke": found}))
            return
        points.append(found)
    print(json.dumps({"points": points, "seconds": time.process_time() - used, "settings": f"{STEPS} steps or more"}))


if __name__ == "__main__":
    main()
