"""Kinematics of the curvature element: series, quaternions, the cache of compiled kernels. No energy."""
