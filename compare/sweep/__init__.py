"""A grid of scenes: its file, its cases in worker processes, its journal, its results."""
