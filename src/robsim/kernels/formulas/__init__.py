"""Formulas without stages: rigid motions, vehicles, cameras, curves, time laws, random numbers."""
