"""The studies: what is computed of a scene by asking models. No study draws or writes."""
