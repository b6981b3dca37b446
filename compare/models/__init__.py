"""The models: one room for everything that knows a solver; the rest of `compare` asks the registry."""
