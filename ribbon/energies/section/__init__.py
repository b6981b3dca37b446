"""The cross-section of a strip whose twist is free: its relaxed shape, and what its energy consists of.

`relaxed` has the functions that the compiled kernels ask for, `profile` the shape and its densities in numpy.
"""
