"""Keys of a scene fitted to measured points: the points, the problem of least squares, how good its answer is."""
