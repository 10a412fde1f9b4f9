"""Oracle: poses without a guess by OpenCV's solvers, and its motions of homographies.

Program: OpenCV (`pip install opencv-python-headless`); the version is in "made_by".
Run:     python tests/oracles/generate_poses.py
Writes:  poses_opencv.json and homographies_opencv.json, always the same numbers.

The views come from _pnp_cases.py; planar targets by SOLVEPNP_IPPE, others by SOLVEPNP_SQPNP.
Kept are the errors against the true pose, view by view: rotation in radians and translation over
the distance of the target, null if the solver gave no pose; "sum" is the sum of all pixels, which
shows the test that it has the same views.
"""

import cv2
import numpy as np
from _pnp_cases import KINDS, NOISES, K, errors, rotation, targets
from _store import store

SOLVERS = {"planar": cv2.SOLVEPNP_IPPE, "spatial": cv2.SOLVEPNP_SQPNP}
MOTIONS = 40


def solved(marks, pixels, kind):
    """(R, t), or NaN if there is none."""
    try:
        found, turn, t = cv2.solvePnP(marks, pixels, K, None, flags=SOLVERS[kind])
    except cv2.error:
        found = False
    return (cv2.Rodrigues(turn)[0], t.ravel()) if found else (np.full((3, 3), np.nan), [np.nan] * 3)


def rounded(numbers):
    """Six significant digits; None for NaN."""
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in numbers]


def group(kind, noise):
    """The errors of one kind of target at one noise."""
    angles, distances, total = [], [], 0.0
    for marks, R_true, t_true, pixels in targets(kind, noise):
        found = [solved(marks, view, kind) for view in pixels]
        angle, distance = errors(
            *(np.array(part) for part in zip(*found, strict=True)), R_true, t_true
        )
        angles, distances = [*angles, *rounded(angle)], [*distances, *rounded(distance)]
        total += pixels.sum()
    return {
        "kind": kind,
        "noise": noise,
        "sum": float(total),
        "rotation": angles,
        "translation": distances,
    }


def motion(rng):
    """H = R + t n' (n towards the plane) and OpenCV's decomposition of it."""
    t, n = rng.normal(size=3) * 0.4, rng.normal([0, 0, 3])
    H = (rotation(rng) + np.outer(t, n / np.linalg.norm(n))) * rng.uniform(0.5, 2)
    if np.linalg.det(H) < 0.01:
        return motion(rng)
    _, rotations, translations, normals = cv2.decomposeHomographyMat(H, np.eye(3))
    return {
        "H": H.tolist(),
        "rotations": [R.tolist() for R in rotations],
        "translations": [v.ravel().tolist() for v in translations],
        "normals": [v.ravel().tolist() for v in normals],
    }


if __name__ == "__main__":
    made_by = f"OpenCV {cv2.__version__}"
    about = "errors of OpenCV's poses of the views in _pnp_cases.py, view by view"
    groups = [group(kind, noise) for kind in KINDS for noise in NOISES]
    store("poses_opencv.json", {"made_by": made_by, "about": about, "groups": groups})
    about = "H, and the motions R, t/d, n that OpenCV finds for it"
    rng = np.random.default_rng(12)
    motions = [motion(rng) for _ in range(MOTIONS)]
    store("homographies_opencv.json", {"made_by": made_by, "about": about, "cases": motions})
