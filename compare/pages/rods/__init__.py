"""What is said, drawn and written of rods beyond what every state has."""
