"""Scenes, running, comparing, reporting: the layer that knows both the ribbon and the shell, and the command line."""

__version__ = "0.1.0"
