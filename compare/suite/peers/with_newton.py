"""NVIDIA Newton's rod at rest: run by a python that has newton (CPU is enough) and NumPy, JSON in and out.

Capsules on joints that bend alike in both directions, so that a strip can be made of them only while it stays in its
plane. Vertex block descent takes implicit steps: what statics does not depend on (mass, step) is chosen so that a step
is as long as the slowest mode, which damps all; its sweeps go body by body: with three bodies 200 of
them find the equilibrium to 1 %, with ten 400 do not, so that few elements are all that it can have here. The
first element is held, half behind the clamp; the force at the end acts on the last body, with its moment about that.
"""

from __future__ import annotations

import json
import sys
import time

import newton
import numpy as np
import warp as wp

#: Stretch and shear over the bending stiffness and l^2: of single precision more leaves no digits.
RIGID = 1e4
#: Step (l^2 / sqrt(D w)), its sweeps, the speed (l a unit of time) below which it rests, steps between two looks.
STEP, SWEEPS, SLOW, LOOK = 0.1, 400, 1e-5, 10
#: Of a strip's plane: part of its load or rest shape that may leave it.
IN_PLANE = 1e-9


def planar(bar):
    """Whether the strip stays in the plane of t_y and t_z of its clamp."""
    across = np.array(bar["frame"], float)[:, 0]
    size = 1e-300 + sum(np.linalg.norm(bar[name]) for name in ("weight", "force", "moment"))
    out = max(abs(np.dot(bar["weight"], across)), abs(np.dot(bar["force"], across)))
    turned = np.linalg.norm(np.cross(bar["moment"], across))
    return max(out, turned) <= IN_PLANE * size and max(np.abs(bar["rest"][1:])) <= IN_PLANE


def turned(turn):
    """Rotation (3, 3) about a vector by its length."""
    size = float(np.linalg.norm(turn))
    x, y, z = turn / size if size else turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(size) * cross + (1.0 - np.cos(size)) * cross @ cross


def quaternion(frame):
    """(x, y, z, w) of a rotation (3, 3)."""
    values, vectors = np.linalg.eigh(
        np.array(
            [
                [frame[0, 0] - frame[1, 1] - frame[2, 2], 0.0, 0.0, 0.0],
                [frame[1, 0] + frame[0, 1], frame[1, 1] - frame[0, 0] - frame[2, 2], 0.0, 0.0],
                [frame[2, 0] + frame[0, 2], frame[2, 1] + frame[1, 2], frame[2, 2] - frame[0, 0] - frame[1, 1], 0.0],
                [frame[2, 1] - frame[1, 2], frame[0, 2] - frame[2, 0], frame[1, 0] - frame[0, 1], np.trace(frame)],
            ]
        )
        / 3.0,
        UPLO="L",
    )
    return vectors[:, np.argmax(values)]


def at_rest(bar, n, seconds):
    """Points (n, 3) at the clamp and the other elements' ends, or in words how far it came; and how it was run."""
    b1, b2, gj = bar["stiffness"]
    if bar["shear"]:
        return {"not": "this adapter makes rods that neither stretch nor shear"}, ""
    if not planar(bar) and abs(b2 / b1 - 1.0) > 1e-6:
        return {"not": "its rod bends alike in both directions, and this strip leaves its plane"}, ""
    h = 1.0 / (n - 0.5)
    frames = [np.array(bar["frame"], float) @ turned(np.array(bar["rest"]) * k * h) for k in range(n)]
    ahead = h * np.array([frame[:, 2] for frame in frames])
    nodes = np.array(bar["start"], float) + np.vstack([np.zeros(3), np.cumsum(ahead, axis=0)]) - 0.5 * ahead[0]
    rod = newton.Rod(
        [wp.vec3(*map(float, node)) for node in nodes], radius=0.2 * h,
        quaternions=[wp.quat(*map(float, quaternion(frame))) for frame in frames],
        stretch_rigidity=RIGID * b1, shear_rigidity=RIGID * b1, bend_rigidity=b1, twist_rigidity=gj,
    )  # fmt: skip
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    shape = builder.default_shape_cfg.copy()
    shape.density = 0.0
    shape.has_shape_collision = False
    bodies, _ = builder.add_rod(rod=rod, cfg=shape, bend_damping=0.0, twist_damping=0.0)
    for k, body in enumerate(bodies):
        mass, turning = (0.0, 0.0) if k == 0 else (h, h**3)  # what has no mass is held
        builder.body_mass[body] = mass
        builder.body_inv_mass[body] = 1.0 / mass if mass else 0.0
        builder.body_inertia[body] = wp.mat33(turning * np.eye(3))
        builder.body_inv_inertia[body] = wp.mat33(np.eye(3) / turning if turning else np.zeros((3, 3)))
    builder.color(balance_colors=False)
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverVBD(model, iterations=SWEEPS)
    first, second, control = model.state(), model.state(), model.control()
    weight, force, couple = (np.array(bar[name], float) for name in ("weight", "force", "moment"))
    begun, steps, before = time.perf_counter(), 0, first.body_q.numpy().copy()
    how = f"steps of {STEP:g} l^2/sqrt(D w), {SWEEPS} sweeps each, stretch {RIGID:g} D w / l^2"
    while True:
        pushes = np.zeros((len(bodies), 6), np.float32)
        pushes[:, :3] = h * weight
        turns = first.body_q.numpy()[bodies[-1]]
        x, y, z, w = (float(v) for v in turns[3:7])
        along = np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
        pushes[-1, :3] += force
        pushes[-1, 3:] += couple + np.cross(0.5 * h * along, force)
        first.body_f.assign(pushes)
        solver.step(first, second, control, None, STEP)
        first, second = second, first
        steps += 1
        if steps % LOOK:
            continue
        places = first.body_q.numpy().copy()
        fast = float(np.abs(places[:, :3] - before[:, :3]).max()) / (LOOK * STEP)
        before = places
        if not np.isfinite(fast):
            return {"broke": f"its numbers are no longer finite after {steps} steps"}, how
        if fast < SLOW:
            return ends(places[bodies], nodes, h), f"{steps} {how}"
        if time.perf_counter() - begun > seconds:
            end = ", ".join(f"{v:.4g}" for v in places[bodies[-1], :3])
            said = f"out of budget: after {steps} {how} a body moves by {fast:.1g} l a unit of time, end ({end}) l"
            return {"broke": said}, how


def ends(places, nodes, h):
    """Points of the centreline: the clamp, and the ends of the elements behind it."""
    points = [0.5 * (nodes[0] + nodes[1])]
    for row in places[1:].astype(float):
        x, y, z, w = row[3:7]
        along = np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
        points.append(row[:3] + 0.5 * h * along)
    return np.array(points).tolist()


def main():
    """Bars from the standard input, points to the standard output."""
    begun = time.perf_counter()
    asked = json.load(sys.stdin)
    wp.config.quiet = True
    points, used, how = [], time.process_time(), ""
    for bar in asked["bars"]:
        found, how = at_rest(bar, asked["size"], asked["seconds"] - (time.perf_counter() - begun))
        if isinstance(found, dict):
            print(json.dumps(found))
            return
        points.append(found)
    print(json.dumps({"points": points, "seconds": time.process_time() - used, "settings": how}))


if __name__ == "__main__":
    main()
