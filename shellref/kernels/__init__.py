"""The shell on one process without a form compiler or a general solver: elements in numba, factors along the mesh."""
