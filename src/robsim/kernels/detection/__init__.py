"""Kernels that detect marks in pictures."""
