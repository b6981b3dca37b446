"""A planar elastica that touches itself, lines and circles: exact unilateral conditions without friction."""
