"""Right and odd arguments of the public calls."""
