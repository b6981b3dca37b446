"""CasADi and Ipopt on the ribbon as a problem of optimal control; a script for the peers' own Python, no file of ours.

Standard input: one line of JSON a problem (gamma, curvature, poisson, up: g at the clamp; intervals, degree, repeats);
standard output: one line of JSON each: abscissae, y = (g, omega, eta, M_2 = 0) at them, CPU s of every solve and of
building the problem, Ipopt's word.

    minimise  int_0^1 omega^2 (1 + eta^2)^2 / 2 - K omega (1 + nu eta^2) + Gamma (1 - s) g_3 ds
    over omega(s), eta(s), with  g' = -kappa x g,  kappa = (omega, 0, eta omega),  g(0) = R(0)^T e_g

(the weight by parts: Gamma int z ds = Gamma int (1 - s) g_3 ds). Direct collocation at Radau points, g continuous of
degree d on every interval, omega and eta free at its points; CasADi's exact derivatives, C code or not as it comes.
"""

from __future__ import annotations

import json
import sys
import time

import casadi as ca
import numpy as np


def problem(given: dict) -> tuple:
    """CasADi's solver, its start, and the abscissae of the collocation points."""
    n, d = given["intervals"], given["degree"]
    h = 1.0 / n
    tau = np.array(ca.collocation_points(d, "radau"))
    c, _, b = ca.collocation_coeff(list(tau))
    c, b = np.array(c), np.array(b).ravel()
    s = (np.arange(n)[:, None] + tau).ravel() * h
    k, nu, gamma, up = given["curvature"], given["poisson"], given["gamma"], np.array(given["up"])
    states, controls = ca.MX.sym("g", 3, n * d), ca.MX.sym("u", 2, n * d)
    g, u, at = ca.SX.sym("g", 3), ca.SX.sym("u", 2), ca.SX.sym("s")
    w, e = u[0], u[1]
    rate = ca.vertcat(e * w * g[1], w * (g[2] - e * g[0]), -w * g[1])
    density = 0.5 * w**2 * (1 + e**2) ** 2 - k * w * (1 + nu * e**2) + gamma * (1 - at) * g[2]
    both = ca.Function("both", [g, u, at], [rate, density]).map(n * d)
    rates, densities = both(states, controls, ca.DM(s).T)
    # slopes of the interpolants: columns (begin, points) of every interval times c
    joints = ca.horzcat(ca.DM(up), states[:, d - 1 :: d][:, : n - 1]) if n > 1 else ca.DM(up)
    spread = ca.kron(ca.DM.eye(n), ca.DM(c[0:1]))
    slopes = joints @ spread + states @ ca.kron(ca.DM.eye(n), ca.DM(c[1:]))
    rows = ca.vec(slopes - h * rates)
    total = h * ca.dot(ca.repmat(ca.DM(b).T, 1, n), densities)
    unknowns = ca.veccat(states, controls)
    options = {
        "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": given["tolerance"],
        "ipopt.max_iter": 500, "ipopt.mu_strategy": "monotone",
    }  # fmt: skip
    solver = ca.nlpsol("solver", "ipopt", {"x": unknowns, "f": total, "g": rows}, options)
    angle = k * s
    start = np.vstack([
        np.full_like(s, up[0]), up[1] * np.cos(angle) + up[2] * np.sin(angle),
        up[2] * np.cos(angle) - up[1] * np.sin(angle),
    ])  # fmt: skip
    first = np.concatenate([start.T.ravel(), np.tile([k, 0.0], n * d)])
    return solver, first, s, states.shape


def main() -> None:
    """Answers line by line."""
    for line in sys.stdin:
        given = json.loads(line)
        begun = time.process_time()
        solver, first, s, _ = problem(given)
        building = time.process_time() - begun
        seconds = []
        for _ in range(given["repeats"]):
            begun = time.process_time()
            found = solver(x0=first, lbg=0.0, ubg=0.0)
            seconds.append(time.process_time() - begun)
        x = np.array(found["x"]).ravel()
        g, u = x[: 3 * s.size].reshape(-1, 3).T, x[3 * s.size :].reshape(-1, 2).T
        word = solver.stats()["return_status"]
        y = [*g.tolist(), *u.tolist()]
        print(json.dumps({"s": s.tolist(), "y": y, "seconds": seconds, "building": building, "word": word}), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        print(f"CasADi {ca.__version__}")
    else:
        main()
