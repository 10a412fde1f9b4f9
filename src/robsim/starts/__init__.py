"""Starts of runs: samplers of poses and coordinates, and the coordinates that reach a pose."""
