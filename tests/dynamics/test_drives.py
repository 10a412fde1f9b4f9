"""Joints that drives move by torques, against closed forms and an integration by SciPy."""
