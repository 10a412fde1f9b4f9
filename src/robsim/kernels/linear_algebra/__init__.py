"""Linear algebra of many small matrices: least squares, singular values, QR factorisation."""
