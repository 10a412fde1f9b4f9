"""Rigid motion of points that are represented by image point and depth."""

from robsim.kernels.machine.jit import kernel


@kernel
def transform_image_points(x, Z, T, X):
    """Compute X[n, 3, b] = T p with p = Z (x, 1) for points x[n, 2, b] at depths Z[n, b]."""
    for n in range(X.shape[0]):
        for r in range(3):
            for b in range(X.shape[2]):
                X[n, r, b] = (T[r, 0, b] * x[n, 0, b] + T[r, 1, b] * x[n, 1, b] + T[r, 2, b]) * Z[
                    n, b
                ] + T[r, 3, b]
