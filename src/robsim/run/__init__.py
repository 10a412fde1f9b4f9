"""Experiments, their runs and results, missions, and the standalone controller."""
