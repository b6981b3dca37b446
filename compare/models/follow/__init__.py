"""States that go along, warm, while numbers of their scene change: one module a model."""
