"""Kernels of an image sensor: blur of the lens, noise of each pixel, and grey values."""
