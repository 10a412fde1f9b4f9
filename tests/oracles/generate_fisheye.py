"""Oracle: pixels of points through fisheye lenses, by mpmath.

Program: mpmath (`pip install mpmath numpy`); the version is in "made_by".
Run:     python tests/oracles/generate_fisheye.py
Writes:  fisheye_mpmath.json, always the same numbers.

A point (X, Y, Z) in camera axes is seen at the angle theta = atan2(sqrt(X^2 + Y^2), Z) to the
optical axis. The pixel is K (x', y', 1), with (x', y') in the direction of (X, Y) at the distance
theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8). The numbers in the file are exactly
the float64 values that were used; all results are good to 40 digits. "fold" is the smallest angle
(rad) at which the distance stops growing, or null if it grows up to 90 degrees. "rates" are the
derivatives of both pixel coordinates by x = X/Z and y = Y/Z.
"""

import mpmath as mp
import numpy as np
from _store import store

mp.mp.dps = 60
POINTS = 40

CAMERAS = {
    "equidistant": ([[320.5, 0, 319.5], [0, 321.25, 239.75], [0, 0, 1]], [0, 0, 0, 0]),
    "calibrated": (
        [[285.75, 0, 425.5], [0, 286.125, 398.25], [0, 0, 1]],
        [-0.008, 0.045, -0.043, 0.008],
    ),
    "skewed": ([[410.5, 2.25, 511.5], [0, 398, 383.5], [0, 0, 1]], [0.05, -0.02, 0.004, -0.0005]),
    "folding": ([[300, -1.5, 320], [0, 300, 240], [0, 0, 1]], [-0.2, 0.02, -0.01, 0.001]),
}


def image_distance(theta, lens):
    """The distance of a point from the principal point in an image of focal length 1."""
    powers = [theta ** (2 * n + 2) for n in range(4)]
    return theta * (1 + mp.fsum(mp.mpf(k) * p for k, p in zip(lens, powers, strict=True)))


def project(K, lens, x, y):
    """The pixel of the point (x, y, 1)."""
    r = mp.sqrt(x * x + y * y)
    scale = image_distance(mp.atan(r), lens) / r if r else mp.mpf(1)
    (fx, skew, cx), (_, fy, cy), _ = ([mp.mpf(n) for n in row] for row in K)
    return fx * x * scale + skew * y * scale + cx, fy * y * scale + cy


def rates(K, lens, x, y):
    """The derivatives of the pixel by x and y, by central differences in 60 digits."""
    h = mp.mpf(10) ** -20
    ahead = [project(K, lens, x + h, y), project(K, lens, x, y + h)]
    behind = [project(K, lens, x - h, y), project(K, lens, x, y - h)]
    return [[float((ahead[c][r] - behind[c][r]) / (2 * h)) for c in (0, 1)] for r in (0, 1)]


def find_fold(lens):
    """The smallest angle below 90 degrees at which the distance has its maximum, or None."""
    powers = [(2 * n + 1) * mp.mpf(k) for n, k in enumerate([1, *lens])]
    while powers[-1] == 0:
        powers.pop()
    if len(powers) == 1:
        return None
    roots = mp.polyroots(powers[::-1], maxsteps=500, extraprec=200)
    real = [mp.re(t) for t in roots if abs(mp.im(t)) < mp.mpf(10) ** -30 and mp.re(t) > 0]
    angles = [mp.sqrt(t) for t in real if mp.sqrt(t) < mp.pi / 2]
    return float(min(angles)) if angles else None


def draw_points(fold, rng):
    """Points at angles from 1e-9 rad up to the fold, or 89.9 degrees, at depths of 1e-3 to 1e3."""
    most = np.radians(89.9) if fold is None else 0.999 * fold
    angles = np.r_[1e-9, 1e-6, 1e-4, 1e-3, rng.uniform(0.01, most, POINTS - 5), most]
    around, depth = rng.uniform(-np.pi, np.pi, POINTS), 10 ** rng.uniform(-3, 3, POINTS)
    r = np.tan(angles)
    return (
        np.column_stack([r * np.cos(around), r * np.sin(around), np.ones(POINTS)]) * depth[:, None]
    )


def camera(name, rng):
    """Everything stored about one camera."""
    K, lens = CAMERAS[name]
    fold = find_fold(lens)
    points = draw_points(fold, rng).tolist()
    rays = [(mp.mpf(X) / mp.mpf(Z), mp.mpf(Y) / mp.mpf(Z)) for X, Y, Z in points]
    return {
        "name": name,
        "K": K,
        "distortion": lens,
        "fold": fold,
        "points": points,
        "pixels": [[float(c) for c in project(K, lens, *ray)] for ray in rays],
        "rates": [rates(K, lens, *ray) for ray in rays],
    }


if __name__ == "__main__":
    rng = np.random.default_rng(11)
    about = (
        "K: pixels; distortion: k1 k2 k3 k4; fold: rad; points: camera axes (m); pixels: (column, "
        "row); rates: derivatives of the pixel by X/Z and Y/Z"
    )
    cameras = [camera(name, rng) for name in CAMERAS]
    made_by = f"mpmath {mp.__version__}"
    store("fisheye_mpmath.json", {"made_by": made_by, "about": about, "cameras": cameras})
