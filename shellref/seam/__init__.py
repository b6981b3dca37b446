"""Closed strips: nodes that are one at the seam, and what holds a band that nothing holds."""
