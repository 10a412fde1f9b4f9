"""Poses, primitives, curves and inertia."""
