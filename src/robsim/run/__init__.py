"""Experiments, their runs and results, missions, and the controller on its own."""
