"""The poses that project three marks exactly to their image (perspective-3-point, P3P)."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.vision.plane import append_one

TINY = 1e-14  # relative to the largest coefficient: a leading coefficient that counts as zero
SIDES = ((1, 2), (0, 2), (0, 1))  # sides a, b and c are opposite to marks 0, 1 and 2


def three_marks_poses(marks: Array, x: Array) -> Array:
    """Return candidates T_c_o (B, 8, 3, 4) of marks (3, 3) at normalised points x (B, 3, 2).

    Let s1, u s1 and v s1 be the distances of the marks from the camera. The law of cosines in the
    three triangles of the camera and two marks gives a quartic in v (Grunert 1841; Haralick, Lee,
    Ottenberg and Noelle 1994, eq. 9), and a quadratic in u for each v. (The paper computes u as a
    quotient, which is 0/0 in symmetric views.)

    At most four candidates are poses. The other candidates satisfy only two of the three equations,
    so the caller must compare reprojection errors. Complex roots are replaced by their real parts,
    which are starting values for noisy images. A candidate is NaN if a distance is not positive.
    """
    rays = unit_vectors(append_one(x))
    aa, bb, cc = (np.square(marks[i] - marks[j]).sum() for i, j in SIDES)
    alpha, beta, gamma = ((rays[:, i] * rays[:, j]).sum(-1) for i, j in SIDES)  # cosines
    v = np.repeat(
        _quartic_roots(_distance_quartic(aa / bb, cc / bb, alpha, beta, gamma)), 2, axis=-1
    )
    beta, gamma = beta[:, None], gamma[:, None]
    s1 = np.sqrt(bb / (1 + v * v - 2 * v * beta))
    half = np.sqrt(np.maximum(0.0, gamma * gamma - 1 + cc / (s1 * s1)))
    u = gamma + half * np.tile([1.0, -1.0], 4)
    s = np.stack([s1, u * s1, v * s1], axis=-1)
    X = np.where(s > 0, s, np.nan)[..., None] * rays[:, None]
    R = _triangle_axes(X) @ _triangle_axes(marks).T
    t = X[..., 0, :] - (R @ marks[0])
    return np.concatenate([R, t[..., None]], axis=-1)


def unit_vectors(a: Array) -> Array:
    """Return vectors (..., n) normalised to length one."""
    length: Array = np.sqrt((a * a).sum(-1, keepdims=True))
    return a / length


def _distance_quartic(aa: float, cc: float, alpha: Array, beta: Array, gamma: Array) -> Array:
    """Return coefficients (B, 5) of the quartic in v, highest first, for squared sides over b^2."""
    q, p, two = aa - cc, aa + cc, 2 * alpha * gamma
    return np.stack(
        [
            (q - 1) ** 2 - 4 * cc * alpha**2,
            4 * q * (1 - q) * beta - 2 * (1 - p) * two + 8 * cc * alpha**2 * beta,
            2 * (q * q - 1 + 2 * q * q * beta**2 + 2 * (1 - cc) * alpha**2)
            + 4 * ((1 - aa) * gamma**2 - p * beta * two),
            -4 * q * (1 + q) * beta + 8 * aa * gamma**2 * beta - 2 * (1 - p) * two,
            (1 + q) ** 2 - 4 * aa * gamma**2,
        ],
        axis=-1,
    )


def _quartic_roots(quartic: Array) -> Array:
    """Return the real parts (B, 4) of the roots, the eigenvalues of the companion matrix."""
    least = TINY * np.abs(quartic).max(-1)
    lead = np.where(np.abs(quartic[:, 0]) > least, quartic[:, 0], least)
    companion = np.zeros((len(quartic), 4, 4))
    companion[:, 0] = -quartic[:, 1:] / lead[:, None]
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[~np.isfinite(companion)] = 0.0
    return np.asarray(np.linalg.eigvals(companion).real, dtype=np.float64)


def _triangle_axes(corners: Array) -> Array:
    """Return axes (..., 3, 3) of triangles as columns: along a side, in the plane, and normal."""
    side = corners[..., 1, :] - corners[..., 0, :]
    e = unit_vectors(side)
    n = unit_vectors(np.cross(e, corners[..., 2, :] - corners[..., 0, :]))
    return np.stack([e, np.cross(n, e), n], axis=-1)
