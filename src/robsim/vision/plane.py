"""A plane in two images: its homography, and the camera motions that explain it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.geometry.pose import broadcast_leading_shape

RANK = 1e-10  # relative to the largest singular value: smaller ones count as zero
FARTHEST = 1e100  # points farther from the origin count as missing
CLOSE = 1e-100  # points closer together count as one point
SMALLEST_TRANSLATION = 1e-10  # relative to the plane's distance: smaller ones count as zero


def estimate_homography(points_a: ArrayLike, points_b: ArrayLike) -> Array:
    """Return the homography H with (x_b, 1) ~ H (x_a, 1) from four or more points.

    The normalised direct linear transform (Hartley and Zisserman 2004, algorithm 4.2) is used. H is
    scaled to a middle singular value of 1, with the sign that makes H (x_a, 1) a positive multiple
    of (x_b, 1). For normalised points of a plane in front of both cameras, H then equals R + t n'/d
    (Ma, Soatto, Kosecka and Sastry 2004, lemma 5.18). For pixels it equals K_b (R + t n'/d) K_a^-1
    up to scale.

    Parameters
    ----------
    points_a, points_b : array_like of shape (..., N, 2)
        Points of the plane in both images, normalised or in pixels, with N at least 4.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Homography, NaN if a point is NaN or the points do not determine H, for example if three of
        four points are on a line.

    Raises
    ------
    InputError
        If there are fewer than four points, or different numbers of points.

    Examples
    --------
    >>> square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    >>> np.round(estimate_homography(square, square + 0.5), 9) + 0.0
    array([[1. , 0. , 0.5],
           [0. , 1. , 0.5],
           [0. , 0. , 1. ]])
    """
    a = as_floats(points_a, "points_a", ("N", 2), gaps=True)
    b = as_floats(points_b, "points_b", ("N", 2), gaps=True)
    if a.shape[-2] != b.shape[-2] or a.shape[-2] < 4:
        raise InputError(
            "points_a and points_b: a homography takes four points or more, the same in both "
            f"images; got {a.shape[-2]} and {b.shape[-2]}"
        )
    lead = broadcast_leading_shape(a.shape[:-2], b.shape[:-2], "points_a and points_b")
    a, b = (np.broadcast_to(p, (*lead, *a.shape[-2:])).reshape(-1, *a.shape[-2:]) for p in (a, b))
    H = np.full((len(a), 3, 3), np.nan)
    seen = np.ones(len(a), dtype=bool)
    for p in (a, b):
        seen &= (np.ptp(p, axis=1).max(-1) > CLOSE) & (np.abs(p).max((1, 2)) < FARTHEST)
    H[seen] = _fit_homographies(a[seen], b[seen])
    return H.reshape(*lead, 3, 3)


def _fit_homographies(a: Array, b: Array) -> Array:
    """Return H (B, 3, 3) of finite points (B, N, 2) that do not all coincide."""
    (p, Ta), (q, Tb) = _normalise_points(a), _normalise_points(b)
    p, zero = append_one(p), np.zeros((*p.shape[:-1], 3))
    rows = [  # equations (q, 1) x H (p, 1) = 0 for the elements of H, row by row
        np.concatenate([p, zero, -q[..., :1] * p], axis=-1),
        np.concatenate([zero, p, -q[..., 1:] * p], axis=-1),
        np.zeros((*p.shape[:-1], 9)),  # nine rows at least, for nine right singular vectors
    ]
    _, s, Vt = np.linalg.svd(np.concatenate(rows, axis=1), full_matrices=False)
    N = Vt[:, -1].reshape(-1, 3, 3)
    sizes = np.linalg.svd(N, compute_uv=False)  # the last is zero if H is singular
    H = np.linalg.inv(Tb) @ N @ Ta
    middle = np.linalg.svd(H, compute_uv=False)[:, 1]
    forward = (append_one(b) * (append_one(a) @ np.swapaxes(H, -1, -2))).sum((-1, -2))
    good = (s[:, 7] > RANK * s[:, 0]) & (sizes[:, 2] > RANK * sizes[:, 0]) & (middle > 0)
    scale = np.where(good, np.copysign(middle, forward), np.nan)
    return np.asarray(H / scale[:, None, None])


def _normalise_points(a: Array) -> tuple[Array, Array]:
    """Return points (B, N, 2) with centroid 0 and mean distance sqrt 2, and the transform T."""
    centre = a.mean(1)
    size = np.sqrt(np.square(a - centre[:, None]).sum(-1)).mean(1) / np.sqrt(2)
    T = np.zeros((len(a), 3, 3))
    T[:, 0, 0] = T[:, 1, 1] = 1.0 / size
    T[:, :2, 2] = -centre / size[:, None]
    T[:, 2, 2] = 1.0
    return (a - centre[:, None]) / size[:, None, None], T


def append_one(a: Array) -> Array:
    """Return points (..., 2) with a third coordinate 1, (..., 3)."""
    return np.concatenate([a, np.ones_like(a[..., :1])], axis=-1)


def map_points(H: Array, points: Array) -> Array:
    """Return the images (..., N, 2) of points (..., N, 2) by H (..., 3, 3), NaN behind the camera.

    >>> map_points(np.diag([1.0, 1.0, 2.0]), np.array([[2.0, 4.0]]))
    array([[1., 2.]])
    """
    mapped = append_one(points) @ np.swapaxes(H, -1, -2)
    depth = np.where(mapped[..., 2:] > 0, mapped[..., 2:], np.nan)
    return np.asarray(mapped[..., :2] / depth)


@dataclass(frozen=True, eq=False)
class HomographyMotions(Value):
    """The camera motions of a homography H = R + t n'/d, with X_b = R X_a + t and n'X_a = d.

    There are four motions, two of them in front of both cameras in general. If the translation is
    along the normal, the same motion occurs twice. If H is a pure rotation, the first motion is
    this rotation with translation 0 and normal NaN, and the other motions are NaN.

    Attributes
    ----------
    rotations : ndarray of shape (..., 4, 3, 3)
        Rotations R_b_a.
    translations : ndarray of shape (..., 4, 3)
        Translations t / d in axes of camera b.
    normals : ndarray of shape (..., 4, 3)
        Unit normals of the plane in axes of camera a.
    in_front : ndarray of bool, shape (..., 4)
        Whether the points are in front of both cameras.

    Examples
    --------
    >>> decompose_homography(np.eye(3)).in_front
    array([ True, False, False, False])
    """

    rotations: Array
    translations: Array
    normals: Array
    in_front: NDArray[np.bool_]


def decompose_homography(H: ArrayLike, points: ArrayLike = ((0.0, 0.0),)) -> HomographyMotions:
    """Return the rotations, translations and normals of a homography of normalised points.

    The motions follow from the singular value decomposition of H (Faugeras and Lustman 1988; in
    this form Ma, Soatto, Kosecka and Sastry 2004, section 5.3.3).

    Parameters
    ----------
    H : array_like of shape (..., 3, 3)
        Homography with any positive scale. The motions are NaN if H is NaN.
    points : array_like of shape (..., N, 2), default the image centre
        Normalised points of the plane in camera a, used for `in_front`.

    Returns
    -------
    HomographyMotions
        Four motions of each homography.

    Raises
    ------
    InputError
        If the determinant of H is not positive. It is positive if both cameras are on the same side
        of the plane.

    Examples
    --------
    >>> motions = decompose_homography(np.eye(3) + np.outer([0.1, 0, 0], [0, 0, 1]))
    >>> np.round(motions.translations[motions.in_front], 9) + 0.0
    array([[0.00499376, 0.        , 0.09987523],
           [0.1       , 0.        , 0.        ]])
    """
    A = as_floats(H, "H", (3, 3), gaps=True)
    p = as_floats(points, "points", ("N", 2))
    lead = broadcast_leading_shape(A.shape[:-2], p.shape[:-2], "H and points")
    A = np.broadcast_to(A, (*lead, 3, 3)).reshape(-1, 3, 3)
    finite = np.isfinite(A).all((1, 2))
    if not (np.linalg.slogdet(A[finite])[0] > 0).all():
        raise InputError("H: a plane seen from one side has a homography of positive determinant")
    R, t, n = (np.full((len(A), 4, *shape), np.nan) for shape in ((3, 3), (3,), (3,)))
    R[finite], t[finite], n[finite] = _homography_motions(A[finite])
    R, t, n = R.reshape(*lead, 4, 3, 3), t.reshape(*lead, 4, 3), n.reshape(*lead, 4, 3)
    ahead = (n @ np.swapaxes(append_one(p), -1, -2) > 0).all(-1)
    ahead |= np.isfinite(t).all(-1) & np.isnan(n).all(-1)
    return HomographyMotions(
        make_read_only(R), make_read_only(t), make_read_only(n), make_read_only(np.asarray(ahead))
    )


def _homography_motions(H: Array) -> tuple[Array, Array, Array]:
    """Return R (B, 4, 3, 3), t/d (B, 4, 3) and n (B, 4, 3) of H (B, 3, 3)."""
    s, Vt = np.linalg.svd(H)[1:]
    H = H / s[:, 1, None, None]
    v1, v2, v3 = (Vt[:, i] for i in range(3))
    up, down = s[:, 0] / s[:, 1] - 1.0, 1.0 - s[:, 2] / s[:, 1]
    rest = up + down <= SMALLEST_TRANSLATION
    # H preserves the length of two directions, v2 and u, which the plane contains
    along = np.sqrt(down * (2.0 - down))[:, None] * v1
    across = np.sqrt(up * (2.0 + up))[:, None] * v3
    length = np.sqrt(np.where(rest, 1.0, (up + down) * (2.0 + up - down)))[:, None]
    R, t, n = [], [], []
    for u in ((along + across) / length, (along - across) / length):
        normal = np.cross(v2, u)
        a, b = H @ v2[..., None], H @ u[..., None]
        axes_b = np.concatenate([a, b, np.cross(a, b, axis=1)], axis=-1)  # with axes as columns
        rotation = axes_b @ np.stack([v2, u, normal], axis=-2)
        translation = ((H - rotation) @ normal[..., None])[..., 0]
        R += [rotation, rotation]
        t += [translation, -translation]
        n += [normal, -normal]
    out = np.stack(R, 1), np.stack(t, 1), np.stack(n, 1)
    _set_rotations(H, rest, *out)
    return out


def _set_rotations(H: Array, rest: NDArray[np.bool_], R: Array, t: Array, n: Array) -> None:
    """Write the motion R = H, t = 0 in place for the homographies that are pure rotations."""
    U, _, Vt = np.linalg.svd(H[rest])
    n[rest], R[rest], t[rest] = np.nan, np.nan, np.nan
    R[rest, 0], t[rest, 0] = U @ Vt, 0.0
