"""Reports from stored pages: one HTML file, and its Markdown twin."""
