"""Other people's solvers beside ours, at equal error: whichever of them are there.

How to get them, all outside this repository; where one is absent its tests are skipped and its numbers stay:

- AUTO-07p: Debian's `auto-07p` (or its package unpacked by `dpkg-deb -x`) and gfortran; AUTO_DIR names the folder that
  has `lib/bvp.o`, usr/lib/auto-07p in the package.
- solve_bvp: SciPy's, a dependency of ours.
- CasADi, PyElastica, and jax, equinox and PyYAML for DER-JAX: `requirements.txt` into an environment of their own;
  PEERS_PYTHON names its Python.
- DER-JAX: a checkout of the public repository discrete-elastic-ribbon-jax (StructuresComp; it is on no index), named by
  DER_DIR. Read are src/dismech_jax and examples/shear_induced_bifurcation/{simulate.py, config.yaml}.

No line of theirs is here: they are run as programs of their own.
"""
