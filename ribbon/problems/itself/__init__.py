"""Contact of the strip with itself: places of it that are held apart from each other."""
