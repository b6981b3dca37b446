"""From a request to an equilibrium: its check, where it starts, the search, the verdict, finer segments."""
