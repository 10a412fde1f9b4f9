"""Stages and kernels of features and their interaction matrices."""
