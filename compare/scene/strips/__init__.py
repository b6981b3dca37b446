"""Scenes of several strips: a list of strips, each as a scene of its own, and what joins them and keeps them apart."""
