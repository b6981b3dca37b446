"""Strips wound on the inside of a round wall."""
