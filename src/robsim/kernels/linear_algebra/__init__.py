"""Linear algebra of many small matrices at once: least squares, singular values, reflections."""
