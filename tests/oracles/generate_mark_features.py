"""Oracle: features of marks and their interaction matrices to 40 digits, by mpmath.

Program: mpmath (`pip install mpmath numpy`); the version is in "made_by".
Run:     python tests/oracles/generate_mark_features.py
Writes:  mark_features_mpmath.json, always the same numbers.

x (normalised image points) and Z (depths, m) are exactly the float64 values in the file. s is the
feature as it is defined. Column c of L is the derivative at t = 0 of s, while the camera moves by
exp(t E_c) with a unit velocity along, or about, one of its axes: every mark in camera axes is then
exp(-t E_c) (x Z, y Z, Z). So no formula of an interaction matrix enters.
"""

import mpmath as mp
import numpy as np
from _store import store

mp.mp.dps = 40


def twist(c):
    """The 4x4 matrix of a unit velocity (c < 3) or angular velocity of the camera."""
    E = mp.zeros(4)
    if c < 3:
        E[c, 3] = 1
    else:
        i, j = [(1, 2), (2, 0), (0, 1)][c - 3]
        E[j, i], E[i, j] = 1, -1
    return E


def pairs(image):
    """(x0, y0, x1, y1) of marks 0 and 1, 2 and 3 ..."""
    return [(*image[i], *image[i + 1]) for i in range(0, len(image), 2)]


def image_of(P):
    return [(X / Z, Y / Z) for X, Y, Z in P]


def polar(P):
    return [f(x, y) for x, y in image_of(P) for f in (mp.hypot, lambda x, y: mp.atan2(y, x))]


def spherical(P):
    return [c / mp.sqrt(sum(a * a for a in p)) for p in P for c in p]


def log_depth(P):
    return [mp.log(Z) for _, _, Z in P]


def points_3d(P):
    return [c for p in P for c in p]


def segments(P):
    s = []
    for x0, y0, x1, y1 in pairs(image_of(P)):
        way = mp.mpc(x1 - x0, y1 - y0)
        s += [(x0 + x1) / 2, (y0 + y1) / 2, abs(way), mp.arg(way)]
    return s


def lines(P):
    """From the normal of the plane of interpretation, P0 x P1: no image point enters."""
    s = []
    for p, q in zip(P[::2], P[1::2], strict=True):
        n = [p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3] for i in range(3)]
        s += [n[2] / mp.hypot(n[0], n[1]), mp.atan2(-n[1], -n[0])]
    return s


def vanishing_point(P):
    """The image of the direction that the lines have in space."""
    direction = [b - a for a, b in zip(P[0], P[1], strict=True)]
    return [direction[0] / direction[2], direction[1] / direction[2]]


def derivative(feature, P, c):
    """Of s, while the camera moves along (c < 3) or about one axis."""
    E = twist(c)
    columns = [mp.matrix([*p, 1]) for p in P]

    def s(t, i):
        T = mp.expm(-t * E)
        return feature([list(T * column)[:3] for column in columns])[i]

    return [mp.diff(lambda t, i=i: s(t, i), 0) for i in range(len(feature(P)))]


def case(feature, kind, x, Z):
    """One stored case."""
    x, Z = np.asarray(x, float), np.asarray(Z, float)
    P = [
        (mp.mpf(a) * mp.mpf(d), mp.mpf(b) * mp.mpf(d), mp.mpf(d))
        for (a, b), d in zip(x.tolist(), Z.tolist(), strict=True)
    ]
    columns = [derivative(feature, P, c) for c in range(6)]
    return {
        "feature": feature.__name__,
        "kind": kind,
        "x": x.tolist(),
        "Z": Z.tolist(),
        "s": [float(v) for v in feature(P)],
        "L": [[float(column[i]) for column in columns] for i in range(len(columns[0]))],
    }


def rails(rng):
    """Image and depths of two lines that are parallel in space, to float64."""
    start, along = rng.uniform([-0.5, -0.5, 1], [0.5, 0.5, 2], (2, 3)), rng.uniform(0.2, 0.6, 3)
    P = np.concatenate([[p, p + d * along] for p, d in zip(start, (1.0, 1.5), strict=True)])
    return P[:, :2] / P[:, 2:], P[:, 2]


def inputs(rng):
    """(feature, kind, x, Z) of every case."""
    marks = [polar, spherical, log_depth, points_3d, segments, lines]
    for feature in marks:
        for _ in range(8):
            yield feature, "random", rng.uniform(-0.6, 0.6, (4, 2)), rng.uniform(0.2, 3, 4)
        yield feature, "far", rng.uniform(-3, 3, (4, 2)), rng.uniform(50, 200, 4)
    for rho in (1e-1, 1e-3, 1e-6):
        yield polar, "near_centre", rho * rng.normal(size=(2, 2)), [0.7, 1.4]
    yield polar, "near_half_turn", [[-0.3, 1e-9], [-0.3, -1e-9]], [1.0, 0.5]
    for size in (1e-1, 1e-3, 1e-6):
        ends = rng.uniform(-0.5, 0.5, 2) + size * rng.normal(size=(2, 2))
        yield segments, "short", ends, [1.0, 1.1]
    yield segments, "near_half_turn", [[0.3, 0.2], [-0.1, 0.2 + 1e-9]], [1.0, 0.5]
    yield lines, "near_half_turn", [[-0.3, 0.2], [-0.3 + 1e-9, -0.1]], [1.0, 0.5]
    yield lines, "through_centre", [[-0.25, -0.5], [0.125, 0.25]], [1.0, 2.0]
    for _ in range(8):
        yield vanishing_point, "random", *rails(rng)


if __name__ == "__main__":
    rng = np.random.default_rng(7)
    about = (
        "x and Z are exact float64 inputs; s as defined and L its derivative along the six unit "
        "twists (v, omega) of the camera; lines of vanishing_point are parallel to float64 only"
    )
    cases = [case(*given) for given in inputs(rng)]
    made_by = f"mpmath {mp.__version__}, {mp.mp.dps} digits, rounded to float64"
    store("mark_features_mpmath.json", {"made_by": made_by, "about": about, "cases": cases})
