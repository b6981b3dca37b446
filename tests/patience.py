"""How long a test waits for what is sure to come before it calls it hung: never reached, however busy the machine."""

PATIENCE = 1800.0  # s
