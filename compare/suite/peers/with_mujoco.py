"""MuJoCo's cable (plugin mujoco.elasticity.cable) at rest: run by a python that has mujoco and NumPy, JSON in and out.

The chain is that of `compare.suite.peers.models.mujoco_text`. The balance `qfrc_smooth` = 0 is solved by Newton's
method with differences, the load in steps.
"""

from __future__ import annotations

import json
import sys
import time

import mujoco
import numpy as np

STEPS, NEWTON, CLOSE = 24, 60, 1e-9
PLUGIN = '<mujoco><extension><plugin plugin="mujoco.elasticity.cable"/></extension><worldbody/></mujoco>'


def at_rest(text, until):
    """Points (n + 1, 3) of the centreline at the clamp and the ends of the elements, or in words how far it came."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    bodies = [k for k in range(1, model.nbody) if model.body_jntnum[k]]
    gravity = model.opt.gravity.copy()
    force, moment = model.numeric("end_force").data, model.numeric("end_moment").data
    ends = [2.0 * model.geom_pos[model.body_geomadr[k]] for k in bodies]
    scale = np.abs(force).max() + np.abs(moment).max() + np.linalg.norm(gravity) * model.body_mass.sum()

    def residual(part):
        data.qvel[:] = 0.0
        data.qfrc_applied[:] = 0.0
        model.opt.gravity[:] = part * gravity
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        at = data.xpos[bodies[-1]] + data.xmat[bodies[-1]].reshape(3, 3) @ ends[-1]
        mujoco.mj_applyFT(model, data, part * force, part * moment, at, bodies[-1], data.qfrc_applied)
        mujoco.mj_forward(model, data)
        return data.qfrc_smooth.copy()

    def newton(part):
        start = data.qpos.copy()
        for _ in range(NEWTON):
            found = residual(part)
            if np.abs(found).max() < CLOSE * (1.0 + scale):
                return True
            here = data.qpos.copy()
            columns = np.empty((model.nv, model.nv))
            for i in range(model.nv):
                away = np.zeros(model.nv)
                away[i] = 1e-6
                sides = []
                for sign in (1.0, -1.0):
                    data.qpos[:] = here
                    mujoco.mj_integratePos(model, data.qpos, sign * away, 1.0)
                    sides.append(residual(part))
                columns[:, i] = (sides[0] - sides[1]) / 2e-6
            data.qpos[:] = here
            step = np.linalg.solve(columns, -found)
            size = np.abs(step).max()
            if not np.isfinite(size):
                break
            mujoco.mj_integratePos(model, data.qpos, step * min(1.0, 0.3 / size), 1.0)
        data.qpos[:] = start
        return False

    part, stride = 0.0, 1.0 / STEPS
    while part < 1.0:
        if time.perf_counter() > until:
            return f"out of budget: at {part:.3g} of the load"
        ahead = min(1.0, part + stride)
        if newton(ahead):
            part, stride = ahead, 1.5 * stride
        elif stride < 1e-4:
            return f"Newton's method did not follow the load beyond {part:.4g} of it"
        else:
            stride *= 0.5
    mujoco.mj_kinematics(model, data)
    points = [data.xpos[k] + data.xmat[k].reshape(3, 3) @ end for k, end in zip(bodies, ends)]  # noqa: B905
    return [data.xpos[bodies[0]].tolist(), *(point.tolist() for point in points)]


def main():
    """Bars from the standard input, points to the standard output."""
    asked = json.load(sys.stdin)
    try:
        mujoco.MjModel.from_xml_string(PLUGIN)
    except ValueError:
        print(json.dumps({"not": f"mujoco {mujoco.__version__} has no plugin mujoco.elasticity.cable; 3.3.7 has"}))
        return
    until, used, points = time.perf_counter() + asked["seconds"], time.process_time(), []
    for text in asked["texts"]:
        found = at_rest(text, until)
        if isinstance(found, str):
            print(json.dumps({"broke": found}))
            return
        points.append(found)
    print(json.dumps({"points": points, "seconds": time.process_time() - used, "settings": f"{STEPS} steps or more"}))


if __name__ == "__main__":
    main()
