"""Features and their interaction matrices."""
