"""Formulas without stages: rigid motions, joints, cameras, curves, time laws, random numbers."""
