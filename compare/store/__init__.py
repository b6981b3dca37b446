"""Where results live and where they come from: atomic files, finished cases, provenance, progress."""
