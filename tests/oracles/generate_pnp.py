"""Oracle: poses of targets from images of their marks, by OpenCV's perspective-n-point solvers.

Program: OpenCV (`pip install opencv-python-headless`); the version is in "made_by".
Run:     python tests/oracles/generate_pnp.py
Writes:  pnp_opencv.json, always the same numbers.

marks are in axes of the target (metres); T_c_o is the true pose of the target in camera axes
(x right, y down, z forward), fitted the pose with the least reprojection error in the image.
points are normalised: x/z, y/z, in exact images as they are, in noisy ones with a standard
deviation of one pixel of a camera with a focal length of 800 pixels. The solver starts from
SQPNP, for three marks near the true pose, and goes on by Levenberg-Marquardt until it stands
still. Fits that leave the neighbourhood of the true pose are left out: they are other minima.
"""

import cv2
import numpy as np
from _store import store

SQUARE = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
TARGETS = {
    "triangle": np.array([[-0.12, -0.1, 0.0], [0.15, -0.05, 0.08], [0.0, 0.13, -0.06]]),
    "square": np.array(SQUARE),
    "roof": np.array([*SQUARE, [0.0, 0.1, -0.08], [0.0, -0.1, -0.08]]),
    "cloud": np.random.default_rng(8).uniform(-0.2, 0.2, (12, 3)),
}
VIEWS, PIXEL = 6, 1 / 800
RESTARTS = 8  # the solver itself stops at single precision
LAST_DIGIT = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 1000, 1e-16)


def matrix(rotation_vector, t):
    """The upper 3x4 part of a pose."""
    return np.column_stack([cv2.Rodrigues(rotation_vector)[0], np.ravel(t)])


def random_pose(rng):
    """(rotation vector, t): about a metre in front of the camera, turned by up to 0.7 rad."""
    return rng.uniform(-0.4, 0.4, 3), rng.uniform([-0.2, -0.2, 0.7], [0.2, 0.2, 1.3])


def solved(marks, points, start):
    """The pose of least reprojection error, from `start`."""
    rotation_vector, t = (np.array(part, dtype=float).reshape(3, 1) for part in start)
    if len(marks) > 3:
        _, rotation_vector, t = cv2.solvePnP(
            marks, points, np.eye(3), None, rotation_vector, t, True, cv2.SOLVEPNP_ITERATIVE
        )
    for _ in range(RESTARTS):
        rotation_vector, t = cv2.solvePnPRefineLM(
            marks, points, np.eye(3), None, rotation_vector, t, LAST_DIGIT
        )
    return matrix(rotation_vector, t)


def sqpnp(marks, points):
    """(rotation vector, t) by SQPNP, which needs no start."""
    _, rotation_vector, t = cv2.solvePnP(marks, points, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    return rotation_vector, t


def view(target, noise, rng):
    """One case, or None if the fit is another minimum than that near the truth."""
    marks, (rotation_vector, t) = TARGETS[target], random_pose(rng)
    points = cv2.projectPoints(marks, rotation_vector, t, np.eye(3), None)[0].reshape(-1, 2)
    points = points + noise * rng.normal(size=points.shape)
    nearby = rotation_vector + 0.02, t + 0.02
    start = nearby if target == "triangle" else sqpnp(marks, points)
    T_c_o, fitted = matrix(rotation_vector, t), solved(marks, points, start)
    if np.abs(fitted - T_c_o).max() > 60 * noise + 1e-9:
        return None
    return {
        "target": target,
        "noise": noise,
        "points": points.tolist(),
        "T_c_o": T_c_o.tolist(),
        "fitted": fitted.tolist(),
    }


if __name__ == "__main__":
    rng = np.random.default_rng(9)
    about = (
        "targets: marks in target axes (m); points: normalised; noise: standard deviation of a "
        "normalised coordinate; T_c_o: true pose (3x4); fitted: that of least reprojection error"
    )
    found = [view(t, n, rng) for t in TARGETS for n in (0.0, PIXEL) for _ in range(VIEWS)]
    cases = [case for case in found if case]
    print(f"{len(cases)} of {len(found)} cases")
    targets = {name: marks.tolist() for name, marks in TARGETS.items()}
    made_by = f"OpenCV {cv2.__version__}"
    document = {"made_by": made_by, "about": about, "targets": targets, "cases": cases}
    store("pnp_opencv.json", document)
