"""Goals: where the features shall be."""
