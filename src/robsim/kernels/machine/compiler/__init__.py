"""Numba's side of the machine layer. It is imported only if a kernel must be compiled."""
