"""What is given: where a scene's text comes from, what in it has no effect, and what can hardly be meant."""
