"""What is said, drawn and written of several strips at once."""
