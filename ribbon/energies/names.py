"""The registry: names of the ribbon's energies, each that of its file in this folder.

The place of a name is the energy's code in the kernels. Nothing is imported here: who reads a scene executes this file
alone (`compare.scene.keys`), without numba.
"""

NAMES = ("sadowsky", "wunderlich")
#: Energies whose twist is free of the curvature: they know no ruling (`ribbon.energies.free`).
FREE = ("kirchhoff", "sadowsky_kt", "sano", "extensible", "finite")
#: Their codes in the kernels begin here.
FREE_CODE = 100
