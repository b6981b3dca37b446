"""The ribbon on curvature elements as a model: `compare.models.ribbon.model.RibbonModel`."""
