"""Poses, primitives, curves and inertias."""
