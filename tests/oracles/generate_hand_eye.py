"""Oracle: mounts of cameras by the hand-eye calibrations of OpenCV.

Program: OpenCV below 5, with Python bindings (`pip install "opencv-python-headless<5"`); the
         version is in "made_by".
Run:     python tests/oracles/generate_hand_eye.py
Writes:  hand_eye_opencv.json, always the same numbers.

T_m_f are poses of the target's frame in the frame that carries the camera, the inverse of
OpenCV's gripper2base; T_c_o poses of the target in camera axes with the noise of a twist; its
standard deviation is `noise` (m and rad); all are 3 x 4. By each method `mounts` has T_m_c;
`mount` and `place` are the results of Shah's method, T_m_c and T_f_o.
"""

import cv2
import numpy as np
from _store import store

METHODS = {
    "tsai_lenz": cv2.CALIB_HAND_EYE_TSAI,
    "park_martin": cv2.CALIB_HAND_EYE_PARK,
    "daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}
SHAH = cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH


def pose(rng, spread):
    """A random 4 x 4 pose, its rotation vector with this standard deviation."""
    T = np.eye(4)
    T[:3, :3] = cv2.Rodrigues(rng.normal(0, spread, 3))[0]
    T[:3, 3] = rng.normal(0, 0.5, 3)
    return T


def nearly(T, rng, noise):
    """A pose that is moved a little, to first order by a twist."""
    moved = np.eye(4)
    moved[:3, :3] = cv2.Rodrigues(noise * rng.normal(size=3))[0]
    moved[:3, 3] = noise * rng.normal(size=3)
    return T @ moved


def split(poses):
    """Rotations and positions, as OpenCV takes them."""
    return [T[:3, :3] for T in poses], [T[:3, 3] for T in poses]


def joined(R, t):
    """The 3 x 4 matrix of a pose."""
    return np.column_stack([R, np.ravel(t)]).tolist()


def case(seed, noise):
    """Twelve views, and OpenCV's results for them."""
    rng = np.random.default_rng(seed)
    A = [pose(rng, 0.4) for _ in range(12)]
    X, Z = pose(rng, 0.8), pose(rng, 0.8)
    B = [nearly(np.linalg.inv(X) @ T @ Z, rng, noise) for T in A]
    hand, eye = split([np.linalg.inv(T) for T in A]), split(B)
    mounts = {
        name: joined(*cv2.calibrateHandEye(*hand, *eye, method=method))
        for name, method in METHODS.items()
    }
    R_b, t_b, R_g, t_g = cv2.calibrateRobotWorldHandEye(*eye, *split(A), method=SHAH)
    base, gripper = np.eye(4), np.eye(4)
    base[:3], gripper[:3] = joined(R_b, t_b), joined(R_g, t_g)
    return {
        "noise": noise,
        "T_m_f": [T[:3].tolist() for T in A],
        "T_c_o": [T[:3].tolist() for T in B],
        "mounts": mounts,
        "mount": np.linalg.inv(gripper)[:3].tolist(),
        "place": np.linalg.inv(base)[:3].tolist(),
    }


if __name__ == "__main__":
    store(
        "hand_eye_opencv.json",
        {
            "made_by": f"OpenCV {cv2.__version__}",
            "about": "T_m_f, T_c_o: poses of views (3x4); mounts, mount: T_m_c; place: T_f_o",
            "cases": [case(seed, noise) for seed, noise in enumerate((0.0, 0.0, 1e-3, 1e-2))],
        },
    )
