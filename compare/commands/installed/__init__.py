"""What is installed, and what mends what is missing."""
