"""Triangulation of points from the images of two cameras, with covariances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, make_read_only, move_runs_first, move_runs_last
from robsim.base.errors import InputError, prefix_errors
from robsim.base.value import Value
from robsim.geometry.pose import PoseLike, as_pose, broadcast_leading_shape
from robsim.kernels.features import midpoint_triangulation as kernels
from robsim.vision.camera import Camera
from robsim.vision.pixel_measurement import (
    check_measured_pixels,
    check_noise,
    normalise_pixels,
    pixel_rate_matrices,
)
from robsim.vision.plane import append_one

RCOND = 1e-12  # relative to the largest singular value: smaller ones count as zero
STEPS = 4  # Gauss-Newton steps: exact to rounding for noise of 0.5 pixels, to 1e-11 for 3 pixels


@dataclass(frozen=True, eq=False)
class Triangulation(Value):
    """Triangulated points with covariances, the result of `triangulate`.

    A point is NaN if its images do not determine the depth: if the rays are parallel or diverge, or
    a pixel is NaN.

    Attributes
    ----------
    points : ndarray of shape (..., N, 3)
        Points in axes of the left camera, in metres.
    covariance : ndarray of shape (..., N, 3, 3)
        Covariance of the points in m^2.
    miss : ndarray of shape (..., N)
        Reprojection error in pixels: the root of the sum of four squares, which the point
        minimises. The residual has one degree of freedom, the distance from the epipolar line, so
        `miss` is about the noise of a pixel coordinate. If `miss` is far larger, the images do not
        show the same mark. An error along the epipolar line moves the point without a residual, so
        two images cannot detect it.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> T_left_right = [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    >>> triangulate([[340, 241]], [[300, 239]], camera, camera, T_left_right).miss.round(3)
    array([1.414])
    """

    points: Array
    covariance: Array
    miss: Array


def triangulate(
    pixels_left: ArrayLike,
    pixels_right: ArrayLike,
    left: Camera,
    right: Camera,
    T_left_right: PoseLike,
    *,
    noise: float = 1.0,
) -> Triangulation:
    """Return points from their pixels in both images of a stereo pair.

    The points minimise the squared distances in both images; they are the most likely points if
    every pixel coordinate has independent noise of standard deviation `noise`. Gauss-Newton
    iterations start from the midpoint of the rays
    (`robsim.kernels.features.midpoint_triangulation.triangulate_midpoint`). Their unknowns are (x,
    y, 1/Z), in which the left image is linear and far points are regular.

    To first order the covariance is noise^2 (J' J)^-1 (Hartley and Zisserman 2004, section 5.2). In
    a parallel rig of two equal cameras with focal length f and baseline b, its last element is
    sigma_Z^2 = 2 (Z^2 noise / (f b))^2.

    Parameters
    ----------
    pixels_left, pixels_right : array_like of shape (..., N, 2)
        Pixels (column, row) of the same points in both images.
    left, right : Camera
        The cameras.
    T_left_right : pose_like of shape (..., 4, 4)
        Pose of the right camera in axes of the left camera.
    noise : float, default 1
        Standard deviation of a pixel coordinate.

    Returns
    -------
    Triangulation
        Points, covariances and reprojection errors.

    Raises
    ------
    InputError
        If the numbers of points differ, or both cameras have the same position.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> rig = np.eye(4)
    >>> rig[0, 3] = 0.1
    >>> result = triangulate([[340, 240]], [[300, 240]], camera, camera, rig)
    >>> result.points, np.round(np.sqrt(result.covariance[0, 2, 2]), 6)
    (array([[0.05, 0.  , 2.  ]]), np.float64(0.070711))
    """
    a = check_measured_pixels(pixels_left, "pixels_left", left)
    b = check_measured_pixels(pixels_right, "pixels_right", right)
    T, sigma = _check_rig_pose(T_left_right), check_noise(noise)
    if a.shape[-2] != b.shape[-2]:
        raise InputError(
            f"pixels_left and pixels_right: expected the same points in both images, got "
            f"{a.shape[-2]} and {b.shape[-2]} points"
        )
    lead = broadcast_leading_shape(a.shape[:-2], b.shape[:-2], "pixels_left and pixels_right")
    lead = broadcast_leading_shape(lead, T.shape[:-2], "pixels and T_left_right")
    a, b = (np.broadcast_to(p, (*lead, *a.shape[-2:])) for p in (a, b))
    return _fit_points(a, b, left, right, np.broadcast_to(T, (*lead, 4, 4)), sigma)


def _check_rig_pose(T_left_right: PoseLike) -> Array:
    """Return the checked pose (..., 4, 4) of the right camera; its baseline must not be zero."""
    with prefix_errors("T_left_right"):
        T: Array = as_pose(T_left_right).matrix
    if (T[..., :3, 3] == 0).all(-1).any():
        raise InputError(
            "T_left_right: both cameras have the same position, so the depth is undetermined"
        )
    return T


def _fit_points(
    a: Array, b: Array, left: Camera, right: Camera, T: Array, sigma: float
) -> Triangulation:
    """Return the most likely points of checked pixels a and b (..., N, 2)."""
    x, other = normalise_pixels(a, left), normalise_pixels(b, right)
    start = _ray_midpoints(x, other, T)
    seen = (start[..., 2] > 0) & np.isfinite(start).all(-1)
    start[~seen], x[~seen], other[~seen] = (0.0, 0.0, 1.0), 0.0, 0.0
    weights = pixel_rate_matrices(x, left), pixel_rate_matrices(other, right)
    ray = append_one(start[..., :2]) / start[..., 2:]
    for _ in range(STEPS):
        residual, J, _ = _stereo_residuals(ray, x, other, weights, T)
        ray = ray - (np.linalg.pinv(J, rcond=RCOND) @ residual[..., None])[..., 0]
    residual, J, ahead = _stereo_residuals(ray, x, other, weights, T)
    seen &= ahead & (ray[..., 2] > 0) & (np.linalg.matrix_rank(J, rtol=RCOND) == 3)
    depth = 1.0 / np.where(seen, ray[..., 2], np.nan)
    points = np.concatenate([ray[..., :2] * depth[..., None], depth[..., None]], axis=-1)
    G = np.zeros_like(J[..., :3, :])  # derivative of the point by the ray
    G[..., 0, 0] = G[..., 1, 1] = depth
    G[..., :, 2] = -points * depth[..., None]
    M = sigma * (G @ np.linalg.pinv(J, rcond=RCOND))
    miss = np.where(seen, np.sqrt(np.square(residual).sum(-1)), np.nan)
    return Triangulation(
        make_read_only(points), make_read_only(M @ np.swapaxes(M, -1, -2)), make_read_only(miss)
    )


def _ray_midpoints(x: Array, other: Array, T: Array) -> Array:
    """Return the points (..., N, 3) midway between both rays at their smallest distance."""
    between = move_runs_last(T[..., :3, :], 2)
    X = np.empty((x.shape[-2], 3, between.shape[-1]))
    kernels.triangulate_midpoint(move_runs_last(x, 2), move_runs_last(other, 2), between, X)
    return move_runs_first(X, x.shape[:-2])


def _stereo_residuals(
    ray: Array, x: Array, other: Array, weights: tuple[Array, Array], T: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return residuals (..., N, 4) in pixels, and their Jacobian J (..., N, 4, 3) by the rays.

    A ray is (x, y, 1/Z). The third result (..., N) is true if the point is in front of the right
    camera. Lenses are linearised about the measured pixels, with the derivatives `weights`.
    """
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    D = np.concatenate([R[..., :2], -R @ T[..., :3, 3:]], axis=-1)  # derivative of q by the ray
    D = np.broadcast_to(D[..., None, :, :], (*ray.shape[:-1], 3, 3))
    # q is the direction of the point in axes of the right camera
    q = (D @ ray[..., None])[..., 0] + R[..., None, :, 2]
    ahead = q[..., 2] > 0
    q = np.where(ahead[..., None], q, 1.0)
    seen = q[..., :2] / q[..., 2:]
    rates = (D[..., :2, :] - seen[..., None] * D[..., 2:, :]) / q[..., 2:, None]
    first, second = weights
    J = np.zeros((*ray.shape[:-1], 4, 3))
    J[..., :2, :2], J[..., 2:, :] = first, second @ rates
    misses = np.stack([ray[..., :2] - x, seen - other], axis=-2)
    both = np.stack([first, second], axis=-3)
    return (both @ misses[..., None])[..., 0].reshape(J.shape[:-1]), J, ahead
