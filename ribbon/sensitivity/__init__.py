"""How an equilibrium changes with its parameters: the implicit function theorem on the optimality system."""
