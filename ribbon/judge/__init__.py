"""What a state is worth: stability on the tangent of its rows, the spectrum, penetration of walls."""
