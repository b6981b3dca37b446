"""Where a strip begins that has no path of its own: a band that is joined after half turns, and one held at a point."""
