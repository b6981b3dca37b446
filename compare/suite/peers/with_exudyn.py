"""EXUDYN's three-dimensional ANCF beam at rest: run by a python that has exudyn and NumPy, JSON in and out.

Two-node elements with two slopes each (ObjectANCFBeam), shear-deformable; the section's six stiffnesses are given as
they are, its static solver goes in load steps. The beam's x is t_z, its y is t_x, its z is t_y. It is straight at rest.
"""

from __future__ import annotations

import json
import os
import sys
import time

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    CoordinateConstraint,
    Force,
    MarkerNodeCoordinate,
    MarkerNodeRigid,
    NodePointGround,
    NodePointSlope23,
    ObjectANCFBeam,
    Torque,
)

#: Load steps; shear and stretch against bending where the bar is rigid in them, of which there is a limit: one percent
#: of a thousandth of the length.
STEPS, RIGID = 20, 1e6


def at_rest(bar, n):
    """Points (n + 1, 3) of the nodes; None: it did not converge."""
    b1, b2, gj = bar["stiffness"]
    unit = min(b1, b2, gj)
    shear = bar["shear"] or [RIGID * unit] * 3
    frame = np.array(bar["frame"])
    across, normal, along = frame.T
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    section = exu.BeamSection()
    # Stretch, shear along y and z, torsion, bending about y and z.
    section.stiffnessMatrix = np.diag([shear[2], shear[0], shear[1], gj, b1, b2])
    section.inertia = 1e-3 * np.eye(3)
    section.massPerLength = 1.0
    ground = mbs.AddNode(NodePointGround(referenceCoordinates=[0, 0, 0]))
    zero = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    slopes = [*across.tolist(), *normal.tolist()]
    start = np.array(bar["start"])
    nodes = [
        mbs.AddNode(NodePointSlope23(referenceCoordinates=[*(start + k / n * along).tolist(), *slopes]))
        for k in range(n + 1)
    ]
    for first, second in zip(nodes, nodes[1:]):  # noqa: B905, RUF007
        mbs.AddObject(
            ObjectANCFBeam(
                nodeNumbers=[first, second], physicsLength=1.0 / n, sectionData=section,
                crossSectionPenaltyFactor=[10, 10, 10],
            )
        )  # fmt: skip
    for i in range(9):
        held = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=i))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[zero, held]))
    weight, force = np.array(bar["weight"]), np.array(bar["force"])
    for k, node in enumerate(nodes[1:], 1):
        pull = weight * (0.5 if k == n else 1.0) / n + (force if k == n else 0.0)
        if np.any(pull):
            marker = mbs.AddMarker(MarkerNodeRigid(nodeNumber=node))
            mbs.AddLoad(Force(markerNumber=marker, loadVector=pull.tolist(), bodyFixed=False))
    if any(bar["moment"]):
        marker = mbs.AddMarker(MarkerNodeRigid(nodeNumber=nodes[-1]))
        mbs.AddLoad(Torque(markerNumber=marker, loadVector=bar["moment"], bodyFixed=False))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.numberOfLoadSteps = STEPS
    settings.staticSolver.newton.relativeTolerance = 1e-9
    settings.staticSolver.newton.absoluteTolerance = 1e-9
    settings.staticSolver.newton.maxIterations = 50
    settings.staticSolver.adaptiveStep = True
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    try:
        mbs.SolveStatic(settings)
    except Exception:
        return None
    return [np.array(mbs.GetNodeOutput(node, exu.OutputVariableType.Position)).tolist() for node in nodes]


def main():
    """Bars from the standard input, points to the standard output."""
    asked = json.load(sys.stdin)
    if any(any(bar["rest"]) for bar in asked["bars"]):
        print(json.dumps({"not": "its ANCF beam is straight at rest"}))
        return
    said, sys.stdout = sys.stdout, open(os.devnull, "w")  # noqa: SIM115
    used = time.process_time()
    points = [at_rest(bar, asked["size"]) for bar in asked["bars"]]
    used, sys.stdout = time.process_time() - used, said
    broke = {"broke": "its static solver did not converge"}
    done = {"points": points, "seconds": used, "settings": f"{STEPS} steps"}
    print(json.dumps(broke if None in points else done))


if __name__ == "__main__":
    main()
