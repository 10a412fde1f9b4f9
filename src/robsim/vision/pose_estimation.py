"""The pose of a target from one image of its marks, without a guess."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, frozen, numbers, runs_first, runs_last
from robsim.base.errors import InputError
from robsim.base.values import Value
from robsim.geometry.pose import homogeneous
from robsim.kernels import camera as camera_kernels
from robsim.kernels import se3
from robsim.kernels.features import points_interaction
from robsim.kernels.pose import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.image import deviation, measured, normalised, pixel_rates
from robsim.vision.orthography import mirrored, orthographic_poses
from robsim.vision.spread import second_moment
from robsim.vision.three_marks import three_marks_poses

LINE = 1e-9  # of their size: marks that leave a line by less are on it
SMALLEST = 1e-50  # metres
POINT = 1e-12  # normalised: an image no larger is one point
ASIDE = 1e8  # normalised: what is so far from the axis is no image
SAME = 1e-3  # radians, and of the distance: nearer minima are one
ROUNDING = 1e-9  # pixels: a smaller rms error is rounding
EXACT = 1e-6  # pixels: what three marks' minima may leave over and still be poses of theirs
ODDS = 100.0  # to one: what is less likely wrong is told apart
DEEP = 1 / 3  # of the depth: a larger standard deviation leaves it open
CHUNK = 32  # poses that are refined together
ROUNDS = 10  # of 30 updates; a start on the wrong side of a thick far target takes some
ARRIVED = 1e-9  # radians, and of the distance: a round that moves a pose by less is its last


@dataclass(frozen=True, eq=False, repr=False)
class PoseEstimate(Value):
    """What `estimate_pose` found: the minimum of the reprojection error, and the next one.

    T_c_o (..., 4, 4): the target in camera axes; rms (...): distance in the image between measured
    and reprojected marks, root of the mean square over the 2N coordinates, pixels. `other` and
    `other_rms`: the next best minimum, the second pose of a planar target; `candidates`
    (..., 4, 4, 4) and `errors` (..., 4): all that were found with their rms, the best first.
    `covariance` (..., 6, 6) of the twist (v, omega) in camera axes that leads from the estimate to
    the truth, m and rad: the second moment of what the image leaves likely about this minimum, not
    about the other one. NaN where there is none. Where sigma is estimated, it has 2N - 6 degrees of
    freedom only: of four marks two.

    `ambiguous` (...) is true where the image does not tell the pose: no pose was found; or the
    other minimum is not a hundred times less likely; or the standard deviation of the target's
    depth is above a third of it. The odds are exp((E2 - E1) / (2 sigma^2)) with E the squared
    errors, and where sigma is unknown (E2 / E1)^(N - 3): sigma integrated out (Jeffreys's prior)
    over the 2N - 6 degrees of freedom that a fit leaves. Three marks leave nothing over to judge
    by: they are always ambiguous.
    """

    candidates: Array
    errors: Array
    ambiguous: NDArray[np.bool_]
    covariance: Array

    @property
    def T_c_o(self) -> Array:
        """(..., 4, 4) the best."""
        best: Array = self.candidates[..., 0, :, :]
        return best

    @property
    def rms(self) -> Array:
        """(...) of the best, pixels."""
        return np.asarray(self.errors[..., 0])

    @property
    def other(self) -> Array:
        """(..., 4, 4) the next best."""
        second: Array = self.candidates[..., 1, :, :]
        return second

    @property
    def other_rms(self) -> Array:
        """(...) of the next best, pixels."""
        return np.asarray(self.errors[..., 1])

    def __repr__(self) -> str:
        if self.rms.ndim:
            return f"<PoseEstimate batch {self.rms.shape}>"
        where = np.round(self.T_c_o[:3, 3], 4) + 0.0
        doubt = " ambiguous" if self.ambiguous else ""
        return f"<PoseEstimate position {where.tolist()} rms {self.rms:.3g} px{doubt}>"


def estimate_pose(
    marks: ArrayLike, pixels: ArrayLike, camera: Camera, *, noise: float | None = None
) -> PoseEstimate:
    """T_c_o from pixels (..., N, 2) of marks (N, 3) in target axes (metres), by least squares.

    Three marks or more, not on one line; in a plane or not. Starts are both scaled-orthography
    poses of the marks' plane (`orthographic_poses`), the best pose of the largest triangle of marks
    (`three_marks_poses`) and its mirror image; each is refined by servoing a virtual camera
    (`robsim.kernels.pose.fit_pose`: Comport, Marchand, Pressigout and Chaumette 2006), which
    minimises the distances at unit depth. The best has all marks in front of the camera and the
    least error in the image. Three marks have up to four poses: all are in `candidates`.

    `noise` is the standard deviation of a pixel coordinate; without it, it is estimated from what
    the fit leaves over, which takes four marks. A run with a NaN among its pixels, or whose image
    is a single point, has no pose and is flagged as ambiguous. InputError for anything else.

    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> marks = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    >>> found = estimate_pose(marks, [[240, 158], [400, 160], [400, 320], [240, 320]], camera)
    >>> found
    <PoseEstimate position [0.0008, -0.0008, 0.9953] rms 0.271 px>
    >>> found.T_c_o.shape, found.covariance.shape
    ((4, 4), (6, 6))
    """
    p, size = _checked_marks(marks)
    u = measured(pixels, "pixels", camera, len(p))
    sigma = None if noise is None else deviation(noise)
    lead = u.shape[:-2]
    T, squares = _all_minima(p, u.reshape(-1, len(p), 2), camera)
    variance = _variance(squares[:, 0], len(p), sigma)
    covariance = _covariance(p, T[:, 0], u.reshape(-1, len(p), 2), camera, variance)
    sure = _told_apart(squares, len(p), sigma) & _depth_known(p, T[:, 0], covariance)
    with np.errstate(over="ignore"):  # of a target beyond measure
        T[..., 3] *= size
        covariance[:, :3] *= size
        covariance[:, :, :3] *= size
    poses = homogeneous(np.moveaxis(T.reshape(-1, 3, 4), 0, -1), (*lead, 4))
    poses[~np.isfinite(poses).all((-1, -2))] = np.nan
    rms = np.sqrt(np.where(np.isinf(squares), np.nan, squares) / (2 * len(p)))
    return PoseEstimate(
        frozen(poses),
        frozen(rms.reshape(*lead, 4)),
        frozen((~sure).reshape(lead)),
        frozen(covariance.reshape(*lead, 6, 6)),
    )


def _checked_marks(marks: ArrayLike) -> tuple[Array, float]:
    """Marks in units of about their size, so that metres and radians count alike; that size."""
    p = numbers(marks, "marks", ("N", 3))
    if p.ndim != 2 or len(p) < 3:
        raise InputError(f"marks: expected (N, 3) with three marks or more, got shape {p.shape}")
    unit = _power_of_two(np.abs(p).max())
    near = p / unit
    spread = np.linalg.svd(near - near.mean(0), compute_uv=False)
    if spread[1] <= max(LINE * np.abs(near).max(), SMALLEST / unit):
        raise InputError(
            "marks: a pose takes three that are not on one line; these are on a line "
            f"(to {LINE:g} of their size) or fewer than three places"
        )
    size = unit * _power_of_two(spread[0])
    return frozen(p / size), size


def _power_of_two(size: float) -> float:
    """A power of two about as large, which changes no digit of what it scales; 1 for 0."""
    return 2.0 ** min(math.floor(math.log2(size)), 1000) if size > 0 else 1.0


def _all_minima(p: Array, u: Array, camera: Camera) -> tuple[Array, Array]:
    """`_minima` of the runs that show something; NaN and inf for the others."""
    x = normalised(u, camera)
    T, squares = np.full((len(x), 4, 3, 4), np.nan), np.full((len(x), 4), np.inf)
    seen = (np.ptp(x, axis=1).max(-1) > POINT) & (np.abs(x).max((1, 2)) < ASIDE)  # no NaN
    with np.errstate(all="ignore"):  # a start that is not finite leads nowhere
        T[seen], squares[seen] = _minima(p, x[seen], u[seen], camera)
    return T, squares


def _minima(p: Array, x: Array, u: Array, camera: Camera) -> tuple[Array, Array]:
    """T_c_o (B, 4, 3, 4) and sums of squared pixels (B, 4) of the minima, the best first."""
    T = _refined(p, x, _starts(p, x))
    squares = _squares(p, T, u, camera)
    if len(p) == 3:  # exact poses, or what is nearest to one
        exact = squares.min(1, keepdims=True) + 2 * len(p) * EXACT**2
        squares = np.where(squares <= exact, squares, np.inf)
    T, squares = _sorted(T, squares)
    for k in range(1, T.shape[1]):
        again = (_apart(T[:, :k], T[:, k, None]) < SAME).any(1)
        squares[again, k] = np.inf
    T, squares = _sorted(T, squares)
    T[np.isinf(squares)] = np.nan
    return T[:, :4], squares[:, :4]


def _starts(p: Array, x: Array) -> Array:
    """T_c_o (B, k, 3, 4); finite, if only as a start that leads nowhere."""
    three = _largest_triangle(p)
    exact = three_marks_poses(p[three], x[:, three])
    if len(p) > 3:
        found = _normalised_squares(p, exact, x).argmin(1)
        best = exact[np.arange(len(x)), found, None]
        exact = np.concatenate([best, mirrored(p, best)], axis=1)
    poses = np.concatenate([orthographic_poses(p, x), exact], axis=1)
    return np.where(np.isfinite(poses).all((-1, -2), keepdims=True), poses, 0.0)


def _largest_triangle(p: Array) -> NDArray[np.int64]:
    """The three marks of the largest triangle that has the two of the longest distance."""
    between = np.linalg.norm(p[:, None] - p, axis=-1)
    i, j = np.unravel_index(between.argmax(), between.shape)
    k = np.linalg.norm(np.cross(p - p[i], p[j] - p[i]), axis=-1).argmax()
    return np.array([i, j, k])


def _refined(p: Array, x: Array, starts: Array) -> Array:
    """The minima (B, k, 3, 4) to which the starts lead; those that are not there yet go on."""
    T = starts.reshape(-1, 3, 4).copy()
    images = np.repeat(x, starts.shape[1], axis=0)
    going = np.flatnonzero(T.any((1, 2)))
    for _ in range(ROUNDS):
        moved = _fitted(p, images[going], T[going])
        far = _apart(moved, T[going]) > ARRIVED  # false where NaN
        T[going], going = moved, going[far]
    return T.reshape(starts.shape)


def _fitted(p: Array, images: Array, guess: Array) -> Array:
    """T (n, 3, 4) after at most 30 updates, a few at a time: none waits long for a slow one."""
    out = np.empty_like(guess)
    for first in range(0, len(images), CHUNK):
        some = slice(first, first + CHUNK)
        start = runs_last(guess[some], 2)
        T = np.empty_like(start)
        fit_pose(p, runs_last(images[some], 2), start, T)
        out[some] = runs_first(T)
    return out


def _in_camera(p: Array, T: Array) -> Array:
    """Marks (..., N, 3) in camera axes."""
    return p @ np.swapaxes(T[..., :3], -1, -2) + T[..., None, :, 3]


def _normalised_squares(p: Array, T: Array, x: Array) -> Array:
    """Sums (B, k) of squared distances at unit depth; inf where a mark is behind."""
    X = _in_camera(p, T)
    depth = np.where(X[..., 2:] > 0, X[..., 2:], np.nan)
    squares = np.square(X[..., :2] / depth - x[:, None]).sum((-1, -2))
    return np.where(np.isnan(squares), np.inf, squares)


def _pixels(p: Array, T: Array, camera: Camera) -> Array:
    """(B, k, N, 2) where marks are seen from poses (B, k, 3, 4); NaN where they are behind."""
    X = runs_last(_in_camera(p, T), 2)
    pixels = np.empty((X.shape[0], 2, X.shape[2]))
    camera_kernels.project(X, camera.K, camera.lens, pixels)
    return runs_first(pixels, T.shape[:2])


def _squares(p: Array, T: Array, u: Array, camera: Camera) -> Array:
    """Sums (B, k) of squared distances in the image; inf where a mark is behind."""
    squares = np.square(_pixels(p, T, camera) - u[:, None]).sum((-1, -2))
    return np.where(np.isnan(squares), np.inf, squares)


def _sorted(T: Array, squares: Array) -> tuple[Array, Array]:
    """Both with the least error first."""
    order, rows = np.argsort(squares, axis=1, kind="stable"), np.arange(len(T))[:, None]
    return T[rows, order], squares[rows, order]


def _apart(A: Array, B: Array) -> Array:
    """Radians of rotation, or the distance of the positions over that from the camera, if more."""
    chord = np.sqrt(np.square(A[..., :3] - B[..., :3]).sum((-1, -2)) / 2)
    shift = np.sqrt(np.square(A[..., 3] - B[..., 3]).sum(-1) / np.square(B[..., 3]).sum(-1))
    return np.asarray(np.maximum(chord, shift))


def _variance(squares: Array, N: int, sigma: float | None) -> Array:
    """Of a pixel coordinate (B): as given, or as the residuals have it; NaN for three marks."""
    if sigma is not None:
        return np.full(len(squares), sigma * sigma)
    return squares / (2 * N - 6) if N > 3 else np.full(len(squares), np.nan)


def _covariance(p: Array, T: Array, u: Array, camera: Camera, variance: Array) -> Array:
    """(B, 6, 6) of the twist for pixels of that variance, beyond first order.

    To first order, at the estimate, it is M M' times the variance. Of planes that face the camera
    that is too little: foreshortening goes with the square of their tilt, so an estimate that noise
    has tilted seems to be known better than the truth is. So the second moment is taken of what
    the image leaves likely about the estimate, along the two directions that are known least.
    """
    out = np.full((len(T), 6, 6), np.nan)
    found = np.flatnonzero(np.isfinite(T).all((-1, -2)))
    M = _following(p, T[found], camera)
    out[found] = M @ np.swapaxes(M, -1, -2) * variance[found, None, None]
    noisy = np.flatnonzero(np.isfinite(out[found]).all((-1, -2)) & (variance[found] > EXACT**2))
    for first in range(0, len(noisy), CHUNK):
        some = noisy[first : first + CHUNK]
        i = found[some]
        out[i] = _spread(p, T[i], u[i], camera, M[some], np.sqrt(variance[i]))
    return out


def _spread(p: Array, T: Array, u: Array, camera: Camera, M: Array, sigma: Array) -> Array:
    """(B, 6, 6) second moments of the twist, from M and the deviations (B) of a coordinate."""
    to_z, to_twist, _ = np.linalg.svd(M, full_matrices=False)
    order = np.arange(6)[::-1]  # known best first
    length = sigma[:, None] * to_twist[:, order]
    S = to_z[:, :, order] * length[:, None]  # twist = S z
    back = np.swapaxes(to_z[:, :, order], 1, 2) @ M / to_twist[:, order, None]

    def residuals(z: Array) -> Array:
        pixels = _pixels(p, _moved(T, z @ np.swapaxes(S, 1, 2)), camera)
        return np.asarray((pixels - u[:, None]).reshape(*z.shape[:2], -1) / sigma[:, None, None])

    with np.errstate(all="ignore"):  # nodes far away may be anywhere
        return np.asarray(S @ second_moment(residuals, back) @ np.swapaxes(S, 1, 2))


def _moved(T: Array, twists: Array) -> Array:
    """Poses (B, n, 3, 4) exp(twist) T of T (B, 3, 4); NaN beyond a half turn."""
    columns = runs_last(twists, 1)
    moved, T_all = np.empty((3, 4, columns.shape[1])), np.repeat(T, twists.shape[1], axis=0)
    se3.exp(columns, moved)
    out = np.empty_like(moved)
    se3.compose(moved, runs_last(T_all, 2), out)
    out[..., ~(np.square(columns[3:]).sum(0) < np.pi**2)] = np.nan
    return runs_first(out, twists.shape[:2])


def _following(p: Array, T: Array, camera: Camera) -> Array:
    """M (B, 6, 2N) = L^+ J^-1, by which the twist of the estimate follows the pixels.

    L is the interaction matrix of the normalised points, of which the fit takes the pseudo-inverse,
    and J their rates in the image. With square pixels and no distortion M M' is (L' L)^-1 with L
    in pixels, the least that any unbiased estimate can have.
    """
    X = _in_camera(p, T)
    x, Z = X[..., :2] / X[..., 2:], np.ascontiguousarray(X[..., 2])
    L = np.empty((2 * len(p), 6, len(X)))
    points_interaction(runs_last(x, 2), runs_last(Z, 1), L)
    back = np.linalg.pinv(runs_first(L)).reshape(-1, 6, len(p), 2).swapaxes(1, 2)
    M = (back @ np.linalg.inv(pixel_rates(x, camera))).swapaxes(1, 2).reshape(-1, 6, 2 * len(p))
    return np.asarray(M)


def _told_apart(squares: Array, N: int, sigma: float | None) -> NDArray[np.bool_]:
    """Whether there is a best minimum (B), and the next is by ODDS less likely."""
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


def _depth_known(p: Array, T: Array, covariance: Array) -> NDArray[np.bool_]:
    """Whether the depth of the centroid (B) is known to DEEP; true where nothing tells."""
    x, y, z = (T[:, :, :3] @ p.mean(0) + T[:, :, 3]).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    rate = np.stack([zero, zero, one, y, -x, zero], axis=-1)  # of -z with the twist
    variance = (rate[:, None] @ covariance @ rate[:, :, None])[:, 0, 0]
    return np.asarray(~(np.sqrt(np.maximum(variance, 0.0)) > DEEP * z))
