"""Ends that are held in part, and the rigid motions that they leave a strip."""
