"""Independent references: nothing here imports the packages under test."""
