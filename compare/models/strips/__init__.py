"""Several strips by ribbons on curvature elements, joined and kept apart (`ribbon.find.strips`)."""
