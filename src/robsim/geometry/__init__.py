"""Poses, primitive solids, curves and inertias."""
