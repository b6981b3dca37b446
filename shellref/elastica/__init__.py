"""The planar elastica in scikit-fem; never imports dolfinx."""
