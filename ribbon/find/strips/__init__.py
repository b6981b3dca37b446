"""Several strips at rest: from what they are and how they are joined to an equilibrium with its verdict."""
