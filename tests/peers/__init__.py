"""Other people's solvers beside ours, at equal error: whichever of them are there."""
