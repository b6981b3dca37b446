"""What a state is made of: its elastic energy by parts and along the strip, per length and per area."""
