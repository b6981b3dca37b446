"""The effects of a scene in each model: on or off, why, and the keys that switch one off alone."""
