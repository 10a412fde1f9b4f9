"""Explanations of how runs end, from trial runs with single changes and from the diagnosis."""
