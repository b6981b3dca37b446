"""The ways to a shell's state: Newton, load steps, arc length, stability, refinement, checkpoints."""
