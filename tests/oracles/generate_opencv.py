"""Oracle: pixels of points seen by cameras without and with lens distortion, by OpenCV.

Program: OpenCV (`pip install opencv-python-headless`); the version is in "made_by".
Run:     python tests/oracles/generate_opencv.py
Writes:  opencv_project.json, always the same numbers.

T_w_c is the pose of the camera in the world (metres): p_w = T_w_c p_c. Camera axes are OpenCV's:
x right, y down, z forward. K is in pixels without skew; a pixel is (column, row). Distortion is
in OpenCV's order: (k1, k2, p1, p2, k3[, k4, k5, k6]), k4 to k6 being the denominator.
Normalised points are x/z, y/z in camera axes.
"""

import cv2
import numpy as np
from _store import store

VIEWS, POINTS_PER_VIEW, PAIRS = 3, 20, 40

CAMERAS = {
    "no_distortion": ([812.5, 790.25, 321.75, 238.5], []),
    "five_parameters": ([655.0, 701.5, 330.25, 251.0], [-0.28, 0.07, 1.2e-3, -8e-4, -0.01]),
    "rational": ([910.75, 870.0, 499.5, 381.25], [0.5, -0.2, 2e-4, -3e-4, 0.02, 0.8, -0.15, 0.05]),
}


def intrinsics(fx, fy, u0, v0):
    """K without skew."""
    return np.array([[fx, 0, u0], [0, fy, v0], [0, 0, 1]])


def random_pose(rng):
    """A camera anywhere within two metres of the world's origin, turned in any way."""
    rotation_vector = rng.normal(size=3)
    rotation_vector *= rng.uniform(0.1, 3.0) / np.linalg.norm(rotation_vector)
    T_w_c = np.eye(4)
    T_w_c[:3, :3] = cv2.Rodrigues(rotation_vector)[0]
    T_w_c[:3, 3] = rng.uniform(-2, 2, 3)
    return T_w_c


def points_in_front(T_w_c, rng):
    """World points with normalised coordinates within 0.5 of the image centre."""
    depth = rng.uniform(0.3, 5.0, (POINTS_PER_VIEW, 1))
    normalised = rng.uniform(-0.5, 0.5, (POINTS_PER_VIEW, 2))
    in_camera = np.hstack([normalised, np.ones_like(depth)]) * depth
    return in_camera @ T_w_c[:3, :3].T + T_w_c[:3, 3]


def view(K, distortion, rng):
    """One random pose with its points and their pixels."""
    T_w_c = random_pose(rng)
    points = points_in_front(T_w_c, rng)
    R_c_w = T_w_c[:3, :3].T
    t_c_w = -R_c_w @ T_w_c[:3, 3]
    pixels, _ = cv2.projectPoints(points, cv2.Rodrigues(R_c_w)[0], t_c_w, K, distortion)
    return {
        "T_w_c": T_w_c.tolist(),
        "points": points.tolist(),
        "pixels": pixels.reshape(-1, 2).tolist(),
    }


def distort_only(distortion, rng):
    """Normalised points and their image in the lens: a projection with K = 1 at rest."""
    normalised = rng.uniform(-0.5, 0.5, (PAIRS, 2))
    points = np.hstack([normalised, np.ones((PAIRS, 1))])
    distorted, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), distortion)
    return {"normalised": normalised.tolist(), "distorted": distorted.reshape(-1, 2).tolist()}


def camera(name, rng):
    """Everything stored about one camera."""
    focal_and_centre, coefficients = CAMERAS[name]
    K, distortion = intrinsics(*focal_and_centre), np.array(coefficients or [0.0] * 5)
    return {
        "name": name,
        "K": K.tolist(),
        "distortion": coefficients,
        "views": [view(K, distortion, rng) for _ in range(VIEWS)],
        "distort_only": distort_only(distortion, rng),
    }


if __name__ == "__main__":
    rng = np.random.default_rng(3)
    about = (
        "T_w_c: pose of the camera in the world (m); points: world (m); pixels: (column, row); "
        "distortion: k1 k2 p1 p2 k3 k4 k5 k6; distort_only: normalised points before and after "
        "the lens, row by row"
    )
    cameras = [camera(name, rng) for name in CAMERAS]
    made_by = f"OpenCV {cv2.__version__}"
    store("opencv_project.json", {"made_by": made_by, "about": about, "cameras": cameras})
