"""DER-JAX's own example, a strip shifted sideways between clamps; a script for the peers' own Python, no file of ours.

Argument: the folder of discrete-elastic-ribbon-jax. Standard input: one line of JSON a run: energy, nodes, changes
(section -> key -> value, laid over examples/shear_induced_bifurcation/config.yaml). Standard output: one line of JSON
each: width and length of the strip, ends (2, 2) in s of what is free, times, place (k, 2) of the moved end along and
across, middle (k, 3) of what is free relative to the clamp that is held, steps, Newton's iterations, CPU s of the
run and of compiling before it.

Nothing of the example is changed but what it records (every step's state, no forces or energies). Its step is
compiled anew by every stepper: here by one step that is thrown away, whose time is `compiling`.
"""

from __future__ import annotations

import json
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np


def timed(stepper: type, clock: dict) -> type:
    """The example's stepper, compiling apart."""

    class Timed(stepper):  # type: ignore[misc]
        def simulate(self):  # type: ignore[no-untyped-def]
            import jax.numpy as jnp

            begun = time.process_time()
            mask = self._free_mask if hasattr(self, "_free_mask") else self._free_dof
            still = self._jit_step(
                self.q, self.u, self.aux, self.rod.F_ext, mask, self.mass, jnp.float64(self.sim_params.dt),
                jnp.float64(self.current_reg), jnp.bool_(self.sim_params.static_sim), jnp.float64(self.eta),
            )  # fmt: skip
            still[0].block_until_ready()
            clock["compiling"] = time.process_time() - begun
            begun = time.process_time()
            result = super().simulate()
            clock["seconds"] = time.process_time() - begun
            return result

    return Timed


def run(example, config: dict, given: dict, clock: dict) -> dict:  # type: ignore[no-untyped-def]
    """One run, with what is asked of it."""
    config = json.loads(json.dumps(config))
    config["energy_model"]["name"] = given["energy"]
    config["simulation"]["log_step"] = 1
    config["tracking"] = dict.fromkeys(config["tracking"], False)
    for section, values in given["changes"].items():
        config[section].update(values)
    length, narrow, nodes = float(config["geometry"]["L"]), Fraction(config["geometry"]["w_by_l_ratio"]), given["nodes"]
    result, fixed, start = example.run_simulation(config, float(narrow), nodes)
    q = np.stack(result.qs)
    place = np.stack([q[:, i::4][:, :nodes] for i in range(3)], axis=2)  # (k, nodes, 3)
    first = int(start[-1])
    last = int(fixed[fixed > first].min())
    ends = place[:, [first, last]]
    left, odd = divmod(first + last, 2)
    # halfway between two nodes: the cubic through four of them
    near = {left: 1.0} if not odd else {left - 1: -1 / 16, left: 9 / 16, left + 1: 9 / 16, left + 2: -1 / 16}
    middle = sum(weight * place[:, k] for k, weight in near.items()) - ends[:, 1]
    across = ends[:, 1, :2] - ends[:, 0, :2]
    return {
        "length": length, "width": float(narrow) * length, "thickness": float(config["geometry"]["h"]),
        "free": last - first, "edge": length / (nodes - 1), "times": result.times, "place": across.tolist(),
        "middle": middle.tolist(), "steps": len(result.times) - 1, "newton": int(result.total_newton_iters), **clock,
    }  # fmt: skip


def main() -> None:
    """Answers line by line."""
    folder = Path(sys.argv[1])
    sys.path[:0] = [str(folder / "src"), str(folder / "examples" / "shear_induced_bifurcation")]
    answers, sys.stdout = sys.stdout, sys.stderr  # the example prints
    import dismech_jax
    import simulate

    config = simulate.load_config(folder / "examples" / "shear_induced_bifurcation" / "config.yaml")
    clock: dict = {}
    simulate.dm.TimeStepper = timed(dismech_jax.TimeStepper, clock)
    for line in sys.stdin:
        given = json.loads(line)
        # its small operations outside the step are compiled by a short run
        short = {**given, "changes": {**given["changes"], "simulation": {"total_time": 0.2}}}
        run(simulate, config, short, clock)
        print(json.dumps(run(simulate, config, given, clock)), file=answers, flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        import importlib.metadata

        names = ("jax", "jaxlib", "equinox")
        print(", ".join(f"{name} {importlib.metadata.version(name)}" for name in names))
    else:
        main()
