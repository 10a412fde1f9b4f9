"""Random views of random targets, the same for the generator and for the test of poses.

Needs NumPy only. K belongs to 640 x 480 pixels with a focal length of 800; a target has N = 4 to
12 marks in 0.3 m, in its plane z = 0 or not; it stands at 0.5 to 2 m, its centre in the middle of
the image, turned anyhow, but for planes that are seen at less than 12 degrees.
"""

import numpy as np

K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
KINDS = ("planar", "spatial")
NOISES = (0.0, 1.0)  # standard deviation of a pixel coordinate
TARGETS, VIEWS = 100, 10


def rotation(rng):
    """Uniform over all rotations, from a unit quaternion."""
    x, y, z, w = (q := rng.normal(size=4)) / np.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose(rng, planar):
    """R_c_o and t_c_o."""
    R = rotation(rng)
    while planar and abs(R[2, 2]) < 0.2:
        R = rotation(rng)
    Z = rng.uniform(0.5, 2.0)
    return R, np.array([rng.uniform(-0.2, 0.2) * Z, rng.uniform(-0.15, 0.15) * Z, Z])


def targets(kind, noise):
    """Yield marks (N, 3), R (views, 3, 3), t (views, 3), pixels (views, N, 2)."""
    for number in range(TARGETS):
        rng = np.random.default_rng([KINDS.index(kind), number])
        marks = rng.uniform(-0.15, 0.15, (4 + number % 9, 3))
        if kind == "planar":
            marks[:, 2] = 0.0
        R, t = map(np.array, zip(*(pose(rng, kind == "planar") for _ in range(VIEWS)), strict=True))
        X = marks @ np.swapaxes(R, 1, 2) + t[:, None]
        exact = 800 * X[..., :2] / X[..., 2:] + (320, 240)
        yield marks, R, t, exact + noise * rng.normal(size=exact.shape)


def errors(R, t, R_true, t_true):
    """Angle in radians, and distance relative to the distance of the target."""
    chord = np.sqrt(np.square(R - R_true).sum((-1, -2)) / 8)
    distance = np.linalg.norm(t - t_true, axis=-1) / np.linalg.norm(t_true, axis=-1)
    return 2 * np.arcsin(np.minimum(chord, 1)), distance
