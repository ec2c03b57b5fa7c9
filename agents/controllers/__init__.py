"""Controllers that are designed rather than trained."""
