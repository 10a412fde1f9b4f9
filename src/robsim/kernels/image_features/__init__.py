"""Kernels of features that are measured from whole pictures."""
