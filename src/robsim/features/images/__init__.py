"""Features of whole pictures, for direct visual servoing."""
