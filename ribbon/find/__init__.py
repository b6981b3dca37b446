"""Finding equilibria: seeds, solving, stability, refinement, continuation."""
