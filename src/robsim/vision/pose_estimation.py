"""The pose of a target from one image of its marks, without an initial guess."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_first, move_runs_last
from robsim.base.errors import InputError, check_known
from robsim.base.value import Value
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.formulas import se3
from robsim.kernels.formulas.interaction import points_interaction
from robsim.vision.camera import Camera
from robsim.vision.nonlinear_covariance import second_moment
from robsim.vision.pixel_measurement import check_measured_pixels, check_noise, pixel_rate_matrices
from robsim.vision.pose_minima import CHUNK, EXACT, find_minima, project_marks, transform_marks
from robsim.vision.robust_minima import LEAST_MARKS, WEIGHT_KINDS, find_robust_minima

LINE = 1e-9  # relative to the target: marks within this distance of a line are on the line
SMALLEST = 1e-50  # metres
ROUNDING = 1e-9  # pixels: smaller rms errors count as rounding errors
ODDS = 100.0  # to one: odds of the best minimum that count as certain
DEEP = 1 / 3  # relative to the depth: a larger standard deviation makes the pose ambiguous


@dataclass(frozen=True, eq=False, repr=False)
class PoseEstimate(Value):
    """The result of `estimate_pose`: the minima of the reprojection error, the best one first.

    Let E1 and E2 be the squared errors of the two best minima, and sigma the standard deviation of
    a pixel coordinate. The odds of the best minimum are exp((E2 - E1) / (2 sigma^2)). If sigma is
    unknown, the odds are (E2 / E1)^(N - 3), with sigma integrated out (Jeffreys's prior) over the
    2N - 6 degrees of freedom of the residuals.

    Attributes
    ----------
    candidates : ndarray of shape (..., 4, 4, 4)
        Poses T_c_o of the target in camera axes, the best first, NaN for missing minima. The second
        pose of a planar target is the next best minimum.
    errors : ndarray of shape (..., 4)
        Root mean square, over 2N coordinates, of the distances between measured and reprojected
        marks, in pixels. With robust weights squares are weighted, and N is the sum of the weights.
    ambiguous : ndarray of bool, shape (...)
        True if the image does not determine the pose: if there is no pose, if the odds of the best
        minimum are below 100, or if the standard deviation of the target's depth is larger than a
        third of the depth. Poses from three marks are always ambiguous, because their residuals
        have no degrees of freedom.
    covariance : ndarray of shape (..., 6, 6)
        Covariance of the twist (v, omega) in camera axes from the estimate to the truth, in m and
        rad. It is the second moment of the likelihood about the best minimum; the other minima are
        ignored. NaN without a pose. If sigma is estimated from the residuals, the covariance has 2N
        - 6 degrees of freedom: only two for four marks.
    weights : ndarray of shape (..., N)
        Weights of the squared distances: 1, or from 0 to 1 with robust weights, near 0 for
        outliers.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> marks = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0, 0.1, 0]]
    >>> estimate = estimate_pose(marks, [[240, 160], [400, 160], [320, 320]], camera)
    >>> bool(estimate.ambiguous), int((estimate.errors < 1e-6).sum())  # three marks, several poses
    (True, 4)
    """

    candidates: Array
    errors: Array
    ambiguous: NDArray[np.bool_]
    covariance: Array
    weights: Array

    @property
    def T_c_o(self) -> Array:
        """The best pose (..., 4, 4) of the target in camera axes."""
        return np.asarray(self.candidates[..., 0, :, :])

    @property
    def rms(self) -> Array:
        """The rms reprojection error (...) of the best pose, in pixels."""
        return np.asarray(self.errors[..., 0])

    @property
    def other(self) -> Array:
        """The second-best pose (..., 4, 4) of the target in camera axes."""
        return np.asarray(self.candidates[..., 1, :, :])

    @property
    def other_rms(self) -> Array:
        """The rms reprojection error (...) of the second-best pose, in pixels."""
        return np.asarray(self.errors[..., 1])

    def __repr__(self) -> str:
        if self.rms.ndim:
            return f"<PoseEstimate batch {self.rms.shape}>"
        where = np.round(self.T_c_o[:3, 3], 4) + 0.0
        doubt = " ambiguous" if self.ambiguous else ""
        return f"<PoseEstimate position {where.tolist()} rms {self.rms:.3g} px{doubt}>"


def estimate_pose(
    marks: ArrayLike,
    pixels: ArrayLike,
    camera: Camera,
    *,
    noise: float | None = None,
    robust: str | None = None,
) -> PoseEstimate:
    """Return the poses T_c_o of a target from images of its marks, by least squares.

    The estimate minimises the reprojection error from several starts: both scaled-orthography poses
    of the plane of the marks (`orthographic_poses`), the best pose of the largest triangle of marks
    (`three_marks_poses`), and its mirror image. From each start a virtual camera is servoed to the
    image (`robsim.kernels.estimation.pose_fit.fit_pose`: Comport, Marchand, Pressigout and
    Chaumette 2006), which minimises the distances at unit depth. The best pose has all marks in
    front of the camera and the smallest error in the image. Three marks have up to four exact
    poses; all of them are in `candidates`.

    Robust weights suit images with mismatched marks. The weight of a mark falls with its distance
    from the pose of the other marks (iteratively reweighted least squares,
    `robsim.kernels.estimation.m_estimator`). An additional start is the pose of three marks that
    fits a majority of the marks best (least median of squares: Rousseeuw 1984). Robust weights need
    five marks, because any three of four marks have a pose that fits them exactly. If there are
    many marks, almost half of them may be outliers.

    Parameters
    ----------
    marks : array_like of shape (N, 3)
        Three marks or more in axes of the target, in metres, in a plane or not, but not on a line.
    pixels : array_like of shape (..., N, 2)
        Measured pixels (column, row). An image with a NaN pixel, or with all pixels in one point,
        has no pose, and its result is ambiguous.
    camera : Camera
        The camera.
    noise : float, optional
        Standard deviation of a pixel coordinate. Default: estimated from the residuals, which needs
        four marks.
    robust : {"huber", "tukey", "cauchy"}, optional
        Robust weights. Default: all weights are 1.

    Returns
    -------
    PoseEstimate
        Poses, errors, covariance and weights.

    Raises
    ------
    InputError
        If there are fewer than three marks, all marks are on a line, or the numbers of marks and
        pixels differ.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> marks = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    >>> estimate = estimate_pose(marks, [[240, 158], [400, 160], [400, 320], [240, 320]], camera)
    >>> estimate
    <PoseEstimate position [0.0008, -0.0008, 0.9953] rms 0.271 px>
    >>> estimate.T_c_o.shape, estimate.covariance.shape
    ((4, 4), (6, 6))
    >>> pixels = [[240, 160], [400, 160], [400, 320], [240, 320], [350, 200]]  # an outlier
    >>> estimate_pose([*marks, [0, 0, 0]], pixels, camera, robust="tukey").weights
    array([1., 1., 1., 1., 0.])
    """
    p, size = _scale_marks(marks)
    u = check_measured_pixels(pixels, "pixels", camera, len(p))
    sigma = None if noise is None else check_noise(noise)
    lead = u.shape[:-2]
    flat = u.reshape(-1, len(p), 2)
    T, squares, weights = _find_weighted_minima(p, flat, camera, robust, sigma)
    count = weights.sum(1)
    variance = _pixel_variance(squares[:, 0], count, sigma)
    covariance = _twist_covariance(p, T[:, 0], flat, camera, variance, np.sqrt(weights))
    certain = _is_distinct(squares, count, sigma) & _is_depth_known(p, T[:, 0], covariance)
    with np.errstate(over="ignore"):  # a very large target overflows, and its pose becomes NaN
        T[..., 3] *= size
        covariance[:, :3] *= size
        covariance[:, :, :3] *= size
    poses = homogeneous_matrix(np.moveaxis(T.reshape(-1, 3, 4), 0, -1), (*lead, 4))
    poses[~np.isfinite(poses).all((-1, -2))] = np.nan
    rms = np.sqrt(np.where(np.isinf(squares), np.nan, squares) / (2 * count[:, None]))
    return PoseEstimate(
        make_read_only(poses),
        make_read_only(rms.reshape(*lead, 4)),
        make_read_only((~certain).reshape(lead)),
        make_read_only(covariance.reshape(*lead, 6, 6)),
        make_read_only(weights.reshape(*lead, len(p))),
    )


def _find_weighted_minima(
    p: Array, u: Array, camera: Camera, robust: str | None, sigma: float | None
) -> tuple[Array, Array, Array]:
    """Return the minima, their weighted squares, and weights (B, N), 1 without robust weights."""
    if robust is None:
        T, squares = find_minima(p, u, camera)
        return T, squares, np.ones(u.shape[:2])
    check_known(robust, WEIGHT_KINDS, "robust: no weights {}", "weights")
    if len(p) < LEAST_MARKS:
        raise InputError(
            f"robust: {len(p)} marks do not determine the outlier, because any three of them "
            f"have a pose that fits exactly; give {LEAST_MARKS} or more"
        )
    return find_robust_minima(p, u, camera, WEIGHT_KINDS[robust], sigma)


def _scale_marks(marks: ArrayLike) -> tuple[Array, float]:
    """Return the marks divided by a unit of about their size, and this unit in metres."""
    p = as_floats(marks, "marks", ("N", 3))
    if p.ndim != 2 or len(p) < 3:
        raise InputError(f"marks: expected (N, 3) with three marks or more, got shape {p.shape}")
    unit = _power_of_two(np.abs(p).max())
    near = p / unit
    spread = np.linalg.svd(near - near.mean(0), compute_uv=False)
    if spread[1] <= max(LINE * np.abs(near).max(), SMALLEST / unit):
        raise InputError(
            "marks: a pose needs three marks that are not on one line; all of these are on a line "
            f"(within {LINE:g} of their size) or coincide"
        )
    size = unit * _power_of_two(spread[0])
    return make_read_only(p / size), size


def _power_of_two(size: float) -> float:
    """Return a power of two of about this size, for scaling without rounding; 1 for 0."""
    return 2.0 ** min(math.floor(math.log2(size)), 1000) if size > 0 else 1.0


def _pixel_variance(squares: Array, N: Array, sigma: float | None) -> Array:
    """Return the variance (B,) of a pixel coordinate: sigma^2, or an estimate from the residuals.

    The estimate is NaN for three marks.
    """
    if sigma is not None:
        return np.full(len(squares), sigma * sigma)
    return np.asarray(squares / np.where(N > 3, 2 * N - 6, np.nan))


def _twist_covariance(
    p: Array, T: Array, u: Array, camera: Camera, variance: Array, roots: Array
) -> Array:
    """Return the covariance (B, 6, 6) of the twist for a variance of the pixels.

    To first order the covariance is M M' times the variance. This is too small for planes that face
    the camera: foreshortening is quadratic in the tilt, so its derivative vanishes at the true pose
    but not at an estimate that noise has tilted. The second moment of the likelihood about the
    estimate is therefore integrated along the two directions with the largest deviations.
    """
    out = np.full((len(T), 6, 6), np.nan)
    valid = np.flatnonzero(np.isfinite(T).all((-1, -2)))
    M = _pixel_sensitivity(p, T[valid], camera, roots[valid])
    out[valid] = M @ np.swapaxes(M, -1, -2) * variance[valid, None, None]
    noisy = np.flatnonzero(np.isfinite(out[valid]).all((-1, -2)) & (variance[valid] > EXACT**2))
    for first in range(0, len(noisy), CHUNK):
        chunk = noisy[first : first + CHUNK]
        i = valid[chunk]
        out[i] = _nonlinear_covariance(
            p, T[i], u[i], camera, M[chunk], np.sqrt(variance[i]), roots[i]
        )
    return out


def _nonlinear_covariance(
    p: Array, T: Array, u: Array, camera: Camera, M: Array, sigma: Array, roots: Array
) -> Array:
    """Return second moments (B, 6, 6) of the twist for standard deviations (B,) of the pixels.

    M (B, 6, 2N) is the linear map from pixel errors to the twist. The distances of marks are
    multiplied by the roots (B, N) of their weights.
    """
    to_z, to_twist, _ = np.linalg.svd(M, full_matrices=False)
    order = np.arange(6)[::-1]  # the best known direction first
    length = sigma[:, None] * to_twist[:, order]
    S = to_z[:, :, order] * length[:, None]  # twist = S z
    back = np.swapaxes(to_z[:, :, order], 1, 2) @ M / to_twist[:, order, None]

    def residuals(rows: NDArray[np.intp], z: Array) -> Array:
        poses = _perturb_poses(T[rows], z @ np.swapaxes(S[rows], 1, 2))
        away = (project_marks(p, poses, camera) - u[rows, None]) * roots[rows, None, :, None]
        return np.asarray(away.reshape(*z.shape[:2], -1) / sigma[rows, None, None])

    with np.errstate(all="ignore"):  # marks of distant nodes may be behind the camera
        return np.asarray(S @ second_moment(residuals, back) @ np.swapaxes(S, 1, 2))


def _perturb_poses(T: Array, twists: Array) -> Array:
    """Return poses exp(twist) T (B, n, 3, 4) of T (B, 3, 4); NaN beyond a half turn."""
    columns = move_runs_last(twists, 1)
    perturbed, T_all = np.empty((3, 4, columns.shape[1])), np.repeat(T, twists.shape[1], axis=0)
    se3.exp_se3(columns, perturbed)
    out = np.empty_like(perturbed)
    se3.compose(perturbed, move_runs_last(T_all, 2), out)
    out[..., ~(np.square(columns[3:]).sum(0) < np.pi**2)] = np.nan
    return move_runs_first(out, twists.shape[:2])


def _pixel_sensitivity(p: Array, T: Array, camera: Camera, roots: Array) -> Array:
    """Return M = L^+ J^-1 (B, 6, 2N), the linear map from pixel errors to the estimate.

    L is the interaction matrix of the normalised points, and J the derivative of pixels by
    normalised points. With the diagonal matrix D of the roots (B, N) of the weights, L^+ stands for
    (D L)^+ D. With square pixels and no distortion, M M' is (L' L)^-1 with L in pixels: the
    smallest covariance of an unbiased estimate (Cramer-Rao bound).
    """
    X = transform_marks(p, T)
    x, Z = X[..., :2] / X[..., 2:], np.ascontiguousarray(X[..., 2])
    L = np.empty((2 * len(p), 6, len(X)))
    points_interaction(move_runs_last(x, 2), move_runs_last(Z, 1), L)
    rows = move_runs_first(L) * np.repeat(roots, 2, axis=1)[..., None]
    back = np.linalg.pinv(rows).reshape(-1, 6, len(p), 2).swapaxes(1, 2) * roots[..., None, None]
    M = (
        (back @ np.linalg.inv(pixel_rate_matrices(x, camera)))
        .swapaxes(1, 2)
        .reshape(-1, 6, 2 * len(p))
    )
    return np.asarray(M)


def _is_distinct(squares: Array, N: Array, sigma: float | None) -> NDArray[np.bool_]:
    """Return whether (B,) the odds of the best minimum against the next are at least ODDS."""
    first, second = squares[:, 0], squares[:, 1]
    alone = np.isinf(second)
    first, second = (np.where(np.isinf(s), 1.0, s) for s in (first, second))
    if sigma is not None:
        better = second - first >= 2 * sigma * sigma * math.log(ODDS)
    else:
        rounding = 2 * N * ROUNDING**2
        better = (N - 3) * np.log((second + rounding) / (first + rounding)) >= math.log(ODDS)
    enough = np.isfinite(squares[:, 0]) & (N > 3)
    return enough & (alone | better)


def _is_depth_known(p: Array, T: Array, covariance: Array) -> NDArray[np.bool_]:
    """Return whether (B,) the relative deviation of the centroid's depth is at most DEEP.

    A NaN covariance gives no evidence against the depth, so the result is true.
    """
    x, y, z = (T[:, :, :3] @ p.mean(0) + T[:, :, 3]).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    rate = np.stack([zero, zero, one, y, -x, zero], axis=-1)  # derivative of -z by the twist
    variance = (rate[:, None] @ covariance @ rate[:, :, None])[:, 0, 0]
    return np.asarray(~(np.sqrt(np.maximum(variance, 0.0)) > DEEP * z))
