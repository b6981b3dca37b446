"""A shell's equations at any state that it is handed, in a process of its own: its branches are followed by them."""
