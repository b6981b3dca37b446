"""Models as systems that a branch is followed of (`compare.continuation.system`)."""
