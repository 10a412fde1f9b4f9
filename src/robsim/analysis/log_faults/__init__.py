"""Faults of a recorded robot: hypotheses fitted to its log, and the choice among them."""
