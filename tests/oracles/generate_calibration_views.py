"""Oracle: views of a tag and of a board by a camera on a UR5e, for calibrations with faults.

Programs: OpenCV for pixels and SciPy for rotations (`pip install opencv-python-headless scipy`);
          their versions are in "made_by".
Run:      python tests/oracles/generate_calibration_views.py
Writes:   calibration_views_opencv.json, always the same numbers.

The arm is a product of transforms by the Denavit-Hartenberg table that Universal Robots publishes
for the UR5e. Each case has coordinates `q` (V, 6) in rad, `marks` (N, 3) in m, `pixels` (V, N, 2)
by `cv2.projectPoints` plus normal noise of 0.15 px, and the true 4 x 4 poses `mount` T_flange_c and
`place` T_base_o. `chi2` and `fisher` have quantiles of scipy.stats, [level, freedom, quantile] and
[level, numerator, denominator, quantile]. `mount_forms` is the mount as SciPy gives it: rpy in
degrees (extrinsic x y z), quaternion (x, y, z, w), and rotation vector in degrees.
"""

import cv2
import numpy as np
import scipy
from _store import store
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, f

A = 0, -0.425, -0.3922, 0, 0, 0
D = 0.1625, 0, 0, 0.1333, 0.0997, 0.0996
ALPHA = 90, 0, 0, 90, -90, 0
K, LENS = (
    np.array([[1105.0, 0, 646], [0, 1102, 471], [0, 0, 1]]),
    np.array([-0.11, 0.06, 4e-4, -7e-4]),
)
SIZE, NOISE = np.array([1280, 960]), 0.15
MOUNT = [0.034, -0.061, 0.043], [-4, 3, 92]  # m, degrees
PLACE = [0.0, -0.69, 0.0], [180, 0, 180]
START = np.radians([-76, -100, -66, -91, 92, -62])
TAG = 0.038 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
BOARD = np.array([[0.03 * x - 0.09, 0.03 * y - 0.06, 0] for y in range(5) for x in range(7)])


def pose(position, rotation):
    """The 4 x 4 pose of a position and a rotation of SciPy."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), position
    return T


def flange(q):
    """The pose of the flange in the base of the robot."""
    T = np.eye(4)
    for angle, a, d, alpha in zip(q, A, D, ALPHA, strict=True):
        turn = pose([0, 0, d], Rotation.from_rotvec([0, 0, angle]))
        T = T @ turn @ pose([a, 0, 0], Rotation.from_euler("x", alpha, degrees=True))
    return T


def case(name, marks, views, rng):
    """Coordinates from which all marks are in the image, with their noisy pixels."""
    mount, place = (
        pose(t, Rotation.from_euler("xyz", rpy, degrees=True)) for t, rpy in (MOUNT, PLACE)
    )
    every_q, every_pixel = [], []
    while len(every_q) < views:
        q = START + rng.uniform(-0.5, 0.5, 6)
        T_c_o = np.linalg.inv(flange(q) @ mount) @ place
        depth = (marks @ T_c_o[:3, :3].T + T_c_o[:3, 3])[:, 2]
        pixels = cv2.projectPoints(marks, cv2.Rodrigues(T_c_o[:3, :3])[0], T_c_o[:3, 3], K, LENS)[
            0
        ][:, 0]
        if (depth > 0.25).all() and ((pixels > 5) & (pixels < SIZE - 5)).all():
            every_q.append(q.tolist())
            every_pixel.append((pixels + rng.normal(0, NOISE, pixels.shape)).tolist())
    return {
        "name": name,
        "marks": marks.tolist(),
        "mount": mount.tolist(),
        "place": place.tolist(),
        "q": every_q,
        "pixels": every_pixel,
    }


if __name__ == "__main__":
    rng = np.random.default_rng(29)
    turn = Rotation.from_euler("xyz", MOUNT[1], degrees=True)
    store(
        "calibration_views_opencv.json",
        {
            "made_by": f"OpenCV {cv2.__version__}, SciPy {scipy.__version__}",
            "K": K.tolist(),
            "distortion": LENS.tolist(),
            "size": SIZE.tolist(),
            "noise": NOISE,
            "mount_forms": {
                "position": MOUNT[0],
                "rpy": MOUNT[1],
                "quaternion": turn.as_quat().tolist(),
                "rotvec": np.degrees(turn.as_rotvec()).tolist(),
            },
            "chi2": [[p, n, chi2.ppf(p, n)] for p in (0.5, 0.95, 0.99995) for n in (2, 7, 64, 688)],
            "fisher": [
                [p, n, m, f.ppf(p, n, m)] for p in (0.95, 0.99995) for n, m in ((44, 620), (78, 30))
            ],
            "cases": [case("tag", TAG, 15, rng), case("board", BOARD, 10, rng)],
        },
    )
