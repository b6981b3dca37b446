"""Pictures of ribbons, shells, elasticas and studies."""
