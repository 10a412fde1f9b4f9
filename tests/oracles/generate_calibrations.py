"""Oracle: calibration files by OpenCV, and pixels of points through their lenses.

Program: OpenCV (`pip install opencv-python-headless`); the version is in "made_by".
Run:     python tests/oracles/generate_calibrations.py
Writes:  calibrations_opencv.json, always the same texts and numbers.

Each case has the text of `cv2.FileStorage` as XML and as YAML, with lenses of all counts of
coefficients as a row or a column, under the names that programs give to them; and points in camera
axes (metres) with their pixels (column, row) by `cv2.projectPoints`.
"""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from _store import store

LENS = [-0.28, 0.07, 1.2e-3, -8e-4, -0.01, 0.02, -0.015, 0.004] + [0.0] * 6
NAMES = [
    ("camera_matrix", "distortion_coefficients"),
    ("cameraMatrix", "distCoeffs"),
    ("K", "D"),
    ("Camera_Matrix", "Distortion_Coefficients"),
    ("mtx", "dist"),
]
COUNTS = 4, 5, 8, 12, 14


def text(ending, names, K, lens, size):
    """The text that FileStorage writes into a file with this ending."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"calibration{ending}")
        file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        file.write("calibration_time", 'Mon 3 "Mar" & more')
        file.write("image_width", size[0])
        file.write("image_height", size[1])
        file.write(names[0], K)
        file.write(names[1], lens)
        file.write("avg_reprojection_error", 0.1234)
        file.release()
        return path.read_text(encoding="utf-8")


def case(count, names, rng):
    """One camera with its files and pixels."""
    fx, fy, cx, cy = rng.uniform(500, 900, 2).tolist() + rng.uniform(200, 400, 2).tolist()
    K, lens = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(LENS[:count])
    lens = lens[:, None] if count % 2 else lens[None]
    points = np.column_stack([rng.uniform(-0.4, 0.4, (12, 2)), rng.uniform(0.9, 1.4, 12)])
    pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, lens)
    size = 640 + count, 480 + count
    return {
        "K": K.tolist(),
        "distortion": lens.ravel().tolist(),
        "size": size,
        "xml": text(".xml", names, K, lens, size),
        "yaml": text(".yml", names, K, lens, size),
        "points": points.tolist(),
        "pixels": pixels.reshape(-1, 2).tolist(),
    }


if __name__ == "__main__":
    rng = np.random.default_rng(7)
    cases = [case(count, names, rng) for count, names in zip(COUNTS, NAMES, strict=True)]
    about = "texts by cv2.FileStorage; points: camera axes (m); pixels: (column, row)"
    made_by = f"OpenCV {cv2.__version__}"
    store("calibrations_opencv.json", {"made_by": made_by, "about": about, "cases": cases})
