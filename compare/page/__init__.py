"""A page as data, and its tables on the terminal and in files."""
