"""The rod by shooting on its differential equations: rotation matrices, no elements, no quaternions.

r' = R (Gamma + e_3),  R' = R [kappa]_x,  n' = -weight,  m' = -r' x n,  Gamma = R^T n / S,  kappa = R^T m / B + rest
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root


def shot(problem, steps=10, rtol=1e-11):
    """Tip position (3,) and frame (3, 3) of a cantilever, the loads raised in steps."""
    stiffness, law = problem.section.stiffness, np.array(problem.rest)
    moment = np.zeros(3)
    for t in np.linspace(1.0 / steps, 1.0, steps):
        force, weight, couple = t * problem.force, t * problem.weight, t * problem.moment

        def end(start, force=force, weight=weight):
            def slope(s, y):
                frame, m = y[3:12].reshape(3, 3), y[12:]
                n = force + (1.0 - s) * weight
                strain = frame.T @ n / stiffness[:3] + [0.0, 0.0, 1.0]
                x, y_, z = frame.T @ m / stiffness[3:] + law[:, 0] + (law[:, 1] - law[:, 0]) * s
                spin = np.array([[0.0, -z, y_], [z, 0.0, -x], [-y_, x, 0.0]])
                along = frame @ strain
                return np.concatenate([along, (frame @ spin).ravel(), -np.cross(along, n)])

            first = np.concatenate([problem.start.position, problem.start.frame.ravel(), start])
            return solve_ivp(slope, (0.0, 1.0), first, rtol=rtol, atol=1e-12, method="DOP853").y[:, -1]

        found = root(lambda start, couple=couple, end=end: end(start)[12:] - couple, moment, tol=1e-11)
        assert np.abs(found.fun).max() < 1e-8, found.message
        moment = found.x
    last = end(moment)
    return last[:3], last[3:12].reshape(3, 3)
