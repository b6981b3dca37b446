"""Strips on round walls: wound on their inside, and bodies that move through them."""
