"""What the effects of a scene, and the models that read it, are worth: moves and errors beside their times."""
