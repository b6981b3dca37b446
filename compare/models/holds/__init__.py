"""What of a strip's ends a scene holds, as models take it."""
