"""The registry: names of the ribbon's energies, each that of its file in this folder.

The place of a name is the energy's code in the kernels. Nothing is imported here: who reads a scene executes this file
alone (`compare.scene.keys`), without numba.
"""

NAMES = ("sadowsky", "wunderlich")
