"""Kernels that draw what a camera sees: faces, pictures on them, and their edges."""
