"""Agreement of ribbon and shell as a claim that can fail: the pins, and what is decided of them."""
